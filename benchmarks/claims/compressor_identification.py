"""The compressor in situ: identification from a roving-hammer test.

Random virtual compressors, mounts, gain, mass and inertia drawn around the thesis's table 10, 6
triaxial accelerometers and 18 impacts of 5 hits each with noise and scatter of the hits (bench
seeds from 2 upwards). Levels are those of the bench: C2 has gains of 2 %, places of 1.5 mm, angles
of 1.5°, a hammer of 1 %; C0.5 has 0.5 %, 0.5 mm, 0.5°, 0.5 %. Files are written and read as a
laboratory's; the truth is read for these rows only. Errors are 90 % quantiles over them: inertia,
the worst moment; K_VP, Frobenius norm with rotations scaled by the radius of gyration, at 20 Hz;
gain, the largest in 10-30 Hz with a real part of 1 at 20 Hz. "Cover" is the share of the 35
parameters, pooled over the compressors, that lie within their stated standard deviation of the
truth. Times are CPU seconds of one thread.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from claims import Claim, draws
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.choices import CalibrationLevel
from deboom.compressor.identify import IdentifyOptions, identify
from deboom.compressor.mount_shares import mount_shares
from deboom.compressor.thesis_fit import fit_thesis_parameters
from deboom.study.compressor_identification import (
    IdentificationErrors,
    errors_of,
    mounting_errors,
    read_test,
)

SEEDS = range(2, 2 + draws(4))
THESIS_SEEDS = range(2, 2 + draws(2))
OPTIONS = IdentifyOptions()


@dataclass(frozen=True, eq=False)
class Measured:
    """Figures of one compressor."""

    error: IdentificationErrors
    mass_alone: float
    """Relative error without scales [1]."""
    reduced_chi: float
    seconds: dict[str, float]
    rank: int
    """Of the thesis's numbers; 0 where they were not fitted."""


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        by_level = {
            level: list(pool.map(partial(_case, level), SEEDS))
            for level in (CalibrationLevel.C2, CalibrationLevel.C05)
        }
        mounts = list(pool.map(_identical, SEEDS))
    coarse, fine = by_level[CalibrationLevel.C2], by_level[CalibrationLevel.C05]
    return [
        *_errors("C2", coarse, (1.2, 1.5, 1.5)),
        *_errors("C0.5", fine, (0.4, 0.6, 0.6)),
        _mass_alone(coarse),
        *_cover({"C2": coarse, "C0.5": fine}),
        _rank(coarse),
        _mounts(mounts),
        _times(coarse),
    ]


def _case(level: CalibrationLevel, seed: int) -> Measured:
    with threadpool_limits(1), tempfile.TemporaryDirectory() as scratch:
        folder = write_compressor_test(Path(scratch) / "test", seed, level)
        test, truth = read_test(folder, truth=True)
        assert truth is not None
        assert test.drawing is not None
        begun: list[tuple[str, float]] = []
        found = identify(test, OPTIONS, lambda text: begun.append((text, time.process_time())))
        begun.append(("end", time.process_time()))
        seconds = {text: after - at for (text, at), (_, after) in pairwise(begun)}
        rank, mass_alone = 0, np.nan
        if level is CalibrationLevel.C2:
            alone = replace(test, weighed_mass=None, weighed_mass_deviation=0.0)
            mass_alone = errors_of(identify(alone, OPTIONS), truth).mass
            if seed in THESIS_SEEDS:
                begin = time.process_time()
                rank = fit_thesis_parameters(found, test.drawing).seen.rank
                seconds["thesis"] = time.process_time() - begin
        return Measured(
            errors_of(found, truth), mass_alone, found.calibrated.reduced_chi, seconds, rank
        )


def _identical(seed: int) -> tuple[float, float, bool]:
    """Largest error of place [m] and axis [rad], and whether identical mounts were accepted."""
    with threadpool_limits(1), tempfile.TemporaryDirectory() as scratch:
        plan = CompressorPlan(identical_mounts=True)
        folder = write_compressor_test(Path(scratch) / "test", seed, CalibrationLevel.C2, plan)
        test, truth = read_test(folder, truth=True)
        assert truth is not None
        assert test.drawing is not None
        fit = mount_shares(identify(test, OPTIONS), test.drawing.mounts, identical=True)
        return (*mounting_errors(fit, truth), fit.identical_holds)


def _p90(values: Sequence[float]) -> float:
    return float(np.percentile(values, 90))


def _errors(
    level: str, measured: Sequence[Measured], asked: tuple[float, float, float]
) -> list[Claim]:
    errors = [one.error for one in measured]
    found = (
        1e3 * _p90([error.centre for error in errors]),
        100 * _p90([error.inertia for error in errors]),
        100 * _p90([error.stiffness for error in errors]),
    )
    gain = [
        100 * _p90([e.gain_real for e in errors]),
        100 * _p90([e.gain_imaginary for e in errors]),
    ]
    return [
        Claim(
            f"{level}, mass weighed to 0.1 %: centre of gravity [mm], inertia [%], K_VP [%]",
            "at most " + ", ".join(f"{value:g}" for value in asked),
            ", ".join(f"{value:.2f}" for value in found),
            all(value <= limit for value, limit in zip(found, asked, strict=True)),
        ),
        Claim(
            f"{level}: real and imaginary part of the gain in 10-30 Hz [%]",
            "at most 0.1, 0.2",
            f"{gain[0]:.3f}, {gain[1]:.3f}",
            gain[0] <= 0.1 and gain[1] <= 0.2,
        ),
    ]


def _mass_alone(measured: Sequence[Measured]) -> Claim:
    found = 100 * _p90([one.mass_alone for one in measured])
    return Claim(
        "C2: mass from FRFs alone, hammer known to 1 % [%]",
        "at most 2",
        f"{found:.2f}",
        found <= 2,
    )


def _cover(by_level: dict[str, Sequence[Measured]]) -> list[Claim]:
    rows = []
    for level, measured in by_level.items():
        scores = np.concatenate([one.error.scores for one in measured])
        share = 100 * float(np.mean(np.abs(scores) < 1))
        chi = [one.reduced_chi for one in measured]
        rows.append(
            Claim(
                f"{level}: cover of 68 % intervals [%], {scores.size} parameters; reduced χ",
                "55 to 80",
                f"{share:.0f}; {min(chi):.2f} to {max(chi):.2f}",
                55 <= share <= 80,
            )
        )
    return rows


def _rank(measured: Sequence[Measured]) -> Claim:
    ranks = [one.rank for one in measured if one.rank]
    return Claim(
        f"rank of the Jacobian of the thesis's 44 numbers, {len(ranks)} compressors",
        "35",
        ", ".join(str(rank) for rank in ranks),
        all(rank == 35 for rank in ranks),
    )


def _mounts(mounts: Sequence[tuple[float, float, bool]]) -> Claim:
    place = 1e3 * _p90([one for one, _, _ in mounts])
    angle = float(np.degrees(_p90([one for _, one, _ in mounts])))
    accepted = sum(holds for _, _, holds in mounts)
    return Claim(
        "C2: identical round mounts, worst of three: place [mm], axis [°]; accepted as identical",
        "at most 1.5, 1; all",
        f"{place:.2f}, {angle:.2f}; {accepted} of {len(mounts)}",
        place <= 1.5 and angle <= 1 and accepted == len(mounts),
    )


def _times(measured: Sequence[Measured]) -> Claim:
    minimal = [
        one.seconds["linear start"] + one.seconds["fit at the virtual point"] for one in measured
    ]
    calibration = [one.seconds["self-calibration"] for one in measured]
    thesis = [one.seconds["thesis"] for one in measured if "thesis" in one.seconds]
    found = [float(np.median(values)) for values in (minimal, calibration, thesis)]
    return Claim(
        "time of minimal model with its linear start, self-calibration, 44-number fit, median [s]",
        "at most 2, 5, 10",
        ", ".join(f"{value:.1f}" for value in found),
        found[0] <= 2 and found[1] <= 5 and found[2] <= 10,
    )
