"""Forces from response surfaces.

The main study takes the forces of its mounts from the library's response surfaces, driven by the
torque and the motion that were measured in a run, and compares them with the measured forces: at
the booming peaks of 15 vehicles in six load cases, at nominal stiffness. The measured forces are
the nearer ones to the truth: a force from a surface carries the error of the measured motion as
well. Surfaces are for loads and stiffnesses that nobody measured.

The platform's spectra and its library come from two sets of instruments. An error of gain, position
or angle of the accelerometers then stands in the motion but not in the surface, and the force is
wrong by it: a few percent of the torque strut's, most where paths partly cancel. Runs of the
library's own campaign, whose errors stand in both and cancel in ``f = K s``, show what the surfaces
alone cost: see "Characterisation of mounts".
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from claims import Claim, at_most
from deboom.bench.platform_writer import write_platform
from deboom.files.library_export import read_library_json
from deboom.files.platform import Platform, read_platform
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.mounts.surface_forces import Outside, SurfaceForces, surface_forces
from deboom.study.campaigns import write_platform_library
from deboom.study.platform_model import LIBRARY_FILE, PEAKS, surface_check
from write_library import PLATFORM

OTHER = 2
"""Seed of another bench and fleet."""

BAND = (20, 60)


def claims() -> list[Claim]:
    """Compare on the shipped platform, and on another bench with a library of its own."""
    rows = _claims(read_platform(PLATFORM), "shipped platform")
    with tempfile.TemporaryDirectory() as temporary:
        folder = write_platform(Path(temporary) / "platform", seed=OTHER)
        write_platform_library(folder / LIBRARY_FILE, OTHER, lambda *_: None)
        rows += _claims(read_platform(folder), f"bench {OTHER}")
    return rows


def _claims(platform: Platform, whose: str) -> list[Claim]:
    mounts = read_library_json(platform.folder / LIBRARY_FILE)[1]
    cases = platform.load_cases
    modelled = [surface_forces(case, mounts, Outside.KEEP_MEASURED) for case in cases]
    true = _true_cases(platform)
    outside = sum(sum(forces.outside.values()) for forces in modelled)
    total = sum(len(f.outside) * f.load_case.force.frequency.size for f in modelled)
    between = at_peaks(platform, cases, modelled)
    surfaces = at_peaks(platform, true, modelled)
    share = 100 * outside / total
    return [
        at_most(f"{whose}: lines outside of the measured region, x and z [%]", 0.1, share),
        *(
            at_most(
                f"{whose}: surfaces against {what} at booming peaks, 90 % of the curves, median "
                "and largest [dB]",
                [0.3, 0.3, np.inf],
                np.quantile(values, [0.9, 0.5, 1.0]),
            )
            for what, values in (("spectra", between), ("the truth", surfaces))
        ),
    ]


def at_peaks(
    platform: Platform, cases: tuple[LoadCase, ...], forces: list[SurfaceForces]
) -> np.ndarray:
    """Differences at the booming peaks of a platform's vehicles, a value per curve [dB]."""
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
