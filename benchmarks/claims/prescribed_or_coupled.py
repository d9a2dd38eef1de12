"""Prescribed or coupled motion, searches end to end, and interpolation over frequency.

`studies/prescribed_or_coupled.py` with its default budget and three seeds per motion merged into
one front; the tables `end_to_end` and `kernel_smooth` of `make bench`; the shipped load cases under
the smooth kernel, which must refuse what it would get wrong.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np

import end_to_end
import kernel_coupled
import kernel_smooth
from claims import Claim
from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.study.platform_model import MountSource, operation
from deboom.study.runner import load_study, run_study
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.kernel_smooth_numpy import SMOOTH_COUPLED

STUDY = Path(__file__).parents[2] / "studies" / "prescribed_or_coupled.py"
PLATFORM = STUDY.parent / "data" / "u06_f39_f45"
SEARCHES = 3
N_PROBLEMS = 20


def claims() -> list[Claim]:
    return [*_study(), *_end_to_end(), *_smooth(), _shipped()]


def _study() -> list[Claim]:
    with tempfile.TemporaryDirectory() as folder:
        run = run_study(load_study(STUDY), Path(folder), {"searches": SEARCHES})
        summary = json.loads((run / "summary.json").read_text())
    r, low, high = (summary[key] for key in ("r_min", "slope_min", "slope_max"))
    prescribed, coupled = (summary[f"benefit_{name}_db"] for name in ("prescribed", "coupled"))
    return [
        Claim(
            "SPLV under prescribed against coupled motion, shipped fleet: smallest correlation",
            "at least 0.97",
            f"{r:.3f} over {summary['n_compared']} vehicles and load cases",
            r >= 0.97,
        ),
        Claim(
            "the same: slope, coupled over prescribed",
            "1.1 to 1.35",
            f"{low:.2f} to {high:.2f}",
            low >= 1.1 and high <= 1.35,
        ),
        Claim(
            "true (coupled) benefit of the optimum of prescribed motion [dB]",
            "within 0.1 of that of the optimum of coupled motion",
            f"{prescribed:.2f} against {coupled:.2f}; prescribed motion promised "
            f"{summary['promised_prescribed_db']:.2f}",
            abs(prescribed - coupled) <= 0.1,
        ),
    ]


def _end_to_end() -> list[Claim]:
    table = end_to_end.measure()
    return [
        Claim(
            f"NSGA-II 100 × 100 end to end, {row}",
            f"at least {least:g} times the element-wise loop in pymoo",
            f"{table.loc[row, 'x loop']:.1f} times ({table.loc[row, 'search [s]']:.1f} s, loop "
            f"extrapolated {table.loc[row, 'loop, extrapolated [s]']:.0f} s)",
            bool(table.loc[row, "x loop"] >= least),
        )
        for row, least in ((end_to_end.PRESCRIBED, 14.0), (end_to_end.COUPLED, 24.0))
    ]


def _smooth() -> list[Claim]:
    shape = kernel_coupled.SHAPES[0]
    ratio = kernel_smooth.measure(shape, 12.0).loc[kernel_smooth.SMOOTH_ROW, "x loop"]
    worst = 0.0
    for seed in range(1, N_PROBLEMS + 1):
        motion = kernel_smooth.smooth_problem(shape, seed)
        designs = kernel_coupled.designs(shape, seed)[: shape.n_draws]
        error = SMOOTH_COUPLED.prepare(motion)(designs) - kernel_coupled.batched(motion, designs)
        worst = max(worst, float(np.abs(error).max()))
    return [
        Claim(
            "speed, coupled, numpy, smooth data interpolated",
            "at least 32 times the loop",
            f"{ratio:.1f} times the loop",
            bool(ratio >= 32.0),
        ),
        Claim(
            "its error of SPLV over 321 lines",
            "at most 0.2 dB",
            f"{worst:.2f} dB over {N_PROBLEMS} smooth problems",
            worst <= 0.2,
        ),
    ]


def _shipped() -> Claim:
    platform = read_platform(PLATFORM)
    names = [case.name for case in platform.load_cases]
    refused = total = 0
    for source in (MountSource.spectra, MountSource.library_inside):
        runs = operation(platform, names, source, "U06", band=(20.0, 60.0))
        for case, _ in runs.cases:
            motion = coupled_motion(runs.fleet, platform.mounts, platform.powertrain, case)
            total += 1
            try:
                SMOOTH_COUPLED.prepare(motion)
            except InputError:
                refused += 1
    return Claim(
        "smooth kernel on the shipped load cases, forces of spectra and of library",
        "refused: measured data are not smooth",
        f"{refused} of {total} refused",
        refused == total,
    )
