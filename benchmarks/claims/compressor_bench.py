"""Virtual compressor test.

The roving hammer on the bench's compressor: exact files, hits over time, noise and the errors of
each level. Case 0 stands on the mounts of the thesis's table 11; all others are random.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from claims import Claim
from deboom.bench.compressor_rig import (
    NO_PLACEMENT_ERRORS,
    averaged,
    exact_inertance,
    hit_plan,
    place,
    placement_errors,
    position_sheet,
    strike,
)
from deboom.bench.compressor_truth import CompressorPlan, true_compressor
from deboom.bench.compressor_writer import write_compressor_test
from deboom.choices import CalibrationLevel, CompressorCase
from deboom.files.inertance_test import read_inertance_test
from deboom.physics.rigid_body import rigid_body_modes

SEEDS = range(1, 21)
STUDY_MODES = (10.1, 11.0, 17.2, 21.4, 28.4, 30.0)
PLANS = (
    CompressorPlan(CompressorCase.TABLE11),
    CompressorPlan(),
    CompressorPlan(flexible_receiver=True, flexible_body=400.0),
)


def claims() -> list[Claim]:
    """Measure everything afresh; about 15 s on one core."""
    return [_modes(), _exact(), _hits(), *_noise(), _levels()]


def _modes() -> Claim:
    body = true_compressor(CompressorPlan(CompressorCase.TABLE11), np.random.default_rng(1))
    static, _ = rigid_body_modes(body.mass_matrix, body.static_stiffness)
    modes = static
    for _ in range(50):
        modes = static * np.sqrt(body.gain_at(modes).real)
    return Claim(
        "rigid-body modes of case 0 with the real part of the gain [Hz]",
        "within 0.06 of " + ", ".join(map(str, STUDY_MODES)),
        ", ".join(f"{mode:.1f}" for mode in modes),
        bool(np.all(np.abs(modes - STUDY_MODES) < 0.06)),
    )


def _exact() -> Claim:
    worst = 0.0
    with TemporaryDirectory() as scratch:
        for number, plan in enumerate(PLANS):
            folder = Path(scratch) / str(number)
            test = read_inertance_test(
                write_compressor_test(folder, 1 + number, plan=plan, noise_free=True)
            )
            with np.load(folder / "truth/truth.npz") as truth:
                size = np.abs(truth["frf"]).max()
                worst = max(worst, float(np.abs(test.frf.values - truth["frf"]).max() / size))
    return Claim(
        "files without errors against the closed form, rigid and flexible, largest deviation over "
        "largest FRF",
        "at most 1e-10",
        f"{worst:.1e}",
        worst <= 1e-10,
    )


def _hits() -> Claim:
    with TemporaryDirectory() as scratch:
        folder = write_compressor_test(Path(scratch) / "test", 1, plan=CompressorPlan(hits=True))
        delivered, made = (read_inertance_test(folder, from_hits=flag) for flag in (False, True))
    size = np.abs(delivered.frf.values).max()
    off = float(np.abs(delivered.frf.values - made.frf.values).max() / size)
    return Claim(
        "FRFs that deboom makes of the hits over time against the delivered ones, largest "
        "deviation over largest FRF",
        "at most 1e-12",
        f"{off:.1e}",
        off <= 1e-12,
    )


def _noise() -> list[Claim]:
    sheet, plan = position_sheet(), replace(hit_plan(), scatter=0.0)
    rows = []
    relative = []
    for seed in SEEDS[:5]:
        body = true_compressor(CompressorPlan(), np.random.default_rng(seed))
        placed = place(sheet, NO_PLACEMENT_ERRORS, np.random.default_rng(seed))
        blows = strike(body, sheet, placed, plan, np.random.default_rng([seed, 1]))
        found, _ = averaged(blows, plan)
        exact = exact_inertance(body, sheet, placed, plan.lines, np.ones((18, 3)))
        relative.append((found - exact) * body.mass)
    off = np.array(relative)
    for middle, asked in ((10.5, 0.014), (100.0, 0.007)):
        band = np.abs(plan.lines - middle) <= 5.0 if middle > 50 else plan.lines <= 11.0
        part = float(np.sqrt(np.mean(np.abs(off[:, band]) ** 2) / 2))
        rows.append(
            Claim(
                f"noise of the real and of the imaginary part of an FRF near {middle:g} Hz, over "
                "the mass line [%]",
                f"about {100 * asked:g}",
                f"{100 * part:.2f}",
                abs(part / asked - 1) < 0.2,
            )
        )
    return rows


def _levels() -> Claim:
    sheet = position_sheet()
    lines = np.arange(10.0, 150.5, 10.0)
    medians = []
    for level in CalibrationLevel:
        errors = []
        for seed in SEEDS:
            body = true_compressor(CompressorPlan(), np.random.default_rng(seed))
            exact, found = (
                exact_inertance(body, sheet, placed, lines, np.ones((18, 3)))
                for placed in (
                    place(sheet, size, np.random.default_rng(seed))
                    for size in (NO_PLACEMENT_ERRORS, placement_errors(level))
                )
            )
            errors.append(float(np.linalg.norm(found - exact) / np.linalg.norm(exact)))
        medians.append(100 * float(np.median(errors)))
    names = ", ".join(level.value for level in CalibrationLevel)
    return Claim(
        f"error of the raw FRFs by placement and calibration alone, levels {names}, median of "
        f"{len(SEEDS)} rigs [%]",
        "said",
        "; ".join(f"{value:.1f}" for value in medians),
        medians == sorted(medians),
    )
