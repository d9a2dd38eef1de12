"""Forces from response surfaces.

The main study takes the forces of its mounts from the library's response surfaces, driven by the
torque and the motion that were measured in a run, and compares them with the measured forces: at
the booming peaks of 15 vehicles in six load cases, at nominal stiffness. The measured forces are
the nearer ones to the truth: a force from a surface carries the error of the measured motion as
well. Surfaces are for loads and stiffnesses that nobody measured.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from claims import Claim
from deboom.bench.platform_writer import write_platform
from deboom.files.library_export import read_library_json
from deboom.files.platform import Platform, read_platform
from deboom.measurement.channels import Spectrum
from deboom.measurement.load_case import LoadCase
from deboom.mounts.surface_forces import Outside, SurfaceForces, surface_forces
from deboom.study.mount_source import LIBRARY_FILE
from deboom.study.surface_check import PEAKS, surface_check
from write_library import PLATFORM, write_platform_library

OTHER = 2
"""Seed of another bench and fleet."""
BAND = (20, 60)


def claims() -> list[Claim]:
    """Compare on the shipped platform, and on another bench with a library of its own."""
    rows = _claims(read_platform(PLATFORM), "shipped platform")
    with tempfile.TemporaryDirectory() as temporary:
        folder = write_platform(Path(temporary) / "platform", seed=OTHER)
        write_platform_library(folder / LIBRARY_FILE, seed=OTHER)
        return rows + _claims(read_platform(folder), f"bench {OTHER}")


def _claims(platform: Platform, whose: str) -> list[Claim]:
    mounts = read_library_json(platform.folder / LIBRARY_FILE)[1]
    cases = platform.load_cases
    modelled = [surface_forces(case, mounts, Outside.KEEP_MEASURED) for case in cases]
    measured = [SurfaceForces(case, ()) for case in cases]
    true = _true_cases(platform)
    lines = [
        (one.n_measured, one.n_lines)
        for forces in modelled
        for one in forces.sources
        if not one.reason
    ]
    outside, total = np.sum(lines, axis=0)
    between = _at_peaks(platform, cases, modelled)
    surfaces, spectra = (_at_peaks(platform, true, forces) for forces in (modelled, measured))
    return [
        Claim(
            f"{whose}: lines outside of the measured region, x and z",
            "≤ 0.1 %",
            f"{outside} of {total}",
            bool(outside <= 1e-3 * total),
        ),
        Claim(
            f"{whose}: surfaces against spectra at booming peaks, 90 % of the curves [dB]",
            "≤ 0.3",
            _quantiles(between),
            bool(np.quantile(between, 0.9) <= 0.3),
        ),
        Claim(
            f"{whose}: surfaces against the truth, the same [dB]",
            "≤ 0.3",
            f"{_quantiles(surfaces)}; spectra: {_quantiles(spectra)}",
            bool(np.quantile(surfaces, 0.9) <= 0.3),
        ),
    ]


def _at_peaks(
    platform: Platform, cases: tuple[LoadCase, ...], forces: list[SurfaceForces]
) -> np.ndarray:
    pairs = list(zip(cases, forces, strict=True))
    return surface_check(platform.fleet, platform.mounts, pairs, BAND).table[PEAKS].to_numpy()


def _true_cases(platform: Platform) -> tuple[LoadCase, ...]:
    with np.load(platform.folder / "truth" / "operating.npz", allow_pickle=False) as truth:
        names, channels = truth["load_cases"].tolist(), truth["channels"].tolist()
        force = truth["force"]
    cases = []
    for case in platform.load_cases:
        columns = [channels.index(name) for name in case.force.channels]
        values = force[names.index(case.name)][:, columns]
        spectrum = Spectrum(case.force.frequency, values, case.force.channels, case.force.unit)
        cases.append(replace(case, force=spectrum))
    return tuple(cases)


def _quantiles(values: np.ndarray) -> str:
    return (
        f"{np.quantile(values, 0.9):.2f} (median {np.median(values):.2f}, all {values.max():.2f})"
    )
