"""Coupled motion and the compiled kernels: speed, agreement, and what the bench's truth says.

Speeds are quiet times side by side in one process on one thread; `make bench` shows the tables.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import qmc

import kernel
import kernel_coupled
from claims import Claim
from deboom.files.platform import Platform, read_platform
from deboom.vehicles.booming_model import levels
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.fleet import path_contributions
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numba import NUMBA_COUPLED, NUMBA_COUPLED_FLOAT32

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
N_PROBLEMS = 20
N_POWERTRAINS = 40
Bound = tuple[str, float, str]


def claims() -> list[Claim]:
    found = _speeds()
    found += _agreement()
    platform = read_platform(PLATFORM)
    designs = 0.85 + 0.30 * qmc.LatinHypercube(12, seed=5).random(300)
    found += _prescribed_against_coupled(platform, designs)
    found.append(_data_sheet(platform, designs[:50]))
    return found


def _speeds() -> list[Claim]:
    prescribed = kernel.measure(kernel.SHAPES[0], seconds=8.0)
    coupled = kernel_coupled.measure(kernel_coupled.SHAPES[0], seconds=12.0)
    rate = "of matrix-product rate"
    bounds: list[tuple[str, pd.Series, tuple[Bound, ...]]] = [
        (
            "prescribed, numba",
            prescribed.loc[kernel.NUMBA_ROW],
            (("x loop", 20.0, "times the loop"), (rate, 0.80, rate)),
        ),
        (
            "prescribed, numba float32",
            prescribed.loc[kernel.FLOAT32_ROW],
            (("x loop", 32.0, "times the loop"), (rate, 0.60, rate)),
        ),
        (
            "coupled, numba",
            coupled.loc[kernel_coupled.NUMBA_ROW],
            (
                ("x loop", 25.0, "times the loop"),
                ("x batched", 12.0, "times batched linalg.solve"),
                (rate, 0.65, rate),
            ),
        ),
        (
            "coupled, numba float32",
            coupled.loc[kernel_coupled.FLOAT32_ROW],
            (("x loop", 50.0, "times the loop"),),
        ),
    ]
    return [
        Claim(
            topic=f"speed, {title}",
            asked=f"at least {least:g} {unit}",
            measured=f"{row[column]:.2f} {unit}",
            holds=bool(row[column] >= least),
        )
        for title, row, wanted in bounds
        for column, least, unit in wanted
    ]


def _agreement() -> list[Claim]:
    shape = kernel_coupled.SHAPES[1]
    worst = dict.fromkeys(("numpy", "numba", "numba float32"), 0.0)
    for seed in range(1, N_PROBLEMS + 1):
        motion, designs = kernel_coupled.problem(shape, seed), kernel_coupled.designs(shape, seed)
        exact = kernel_coupled.batched(motion, designs)
        for tier in (NUMPY_COUPLED, NUMBA_COUPLED, NUMBA_COUPLED_FLOAT32):
            error = np.abs(tier.prepare(motion)(designs) - exact).max()
            worst[tier.name] = max(worst[tier.name], float(error))
    return [
        Claim(
            topic=f"error of coupled SPLV over 161 lines against LAPACK, {name}",
            asked=f"at most {bound:g} dB",
            measured=f"{worst[name]:.1e} dB over {N_PROBLEMS} problems x 128 draws x 5 vehicles",
            holds=worst[name] <= bound,
        )
        for name, bound in (("numpy", 1e-9), ("numba", 1e-9), ("numba float32", 5e-3))
    ]


def _prescribed_against_coupled(platform: Platform, designs: np.ndarray) -> list[Claim]:
    correlation, slope = [], []
    for fleet in map(platform.fleet.group, ("U06", "F39", "F45")):
        for case in platform.load_cases:
            motion = coupled_motion(fleet, platform.mounts, platform.powertrain, case)
            coupled = NUMPY_COUPLED.prepare(motion)(designs).T
            contributions = path_contributions(fleet, platform.mounts, case)
            prescribed = levels(contributions, designs).sum(axis=-1).T
            for p, c in zip(prescribed, coupled, strict=True):
                correlation.append(np.corrcoef(p, c)[0, 1])
                slope.append(np.polyfit(p, c, 1)[0])
    sample = f"{len(slope)} vehicles and load cases of gears 5 to 7, 300 designs within 15 %"
    return [
        Claim(
            topic="SPLV, prescribed against coupled motion: correlation",
            asked="at least 0.97",
            measured=f"{min(correlation):.3f} to {max(correlation):.3f}; {sample}",
            holds=min(correlation) >= 0.97,
        ),
        Claim(
            topic="SPLV, coupled over prescribed motion: slope",
            asked="1.1 to 1.35",
            measured=f"{min(slope):.2f} to {max(slope):.2f}; {sample}",
            holds=min(slope) >= 1.1 and max(slope) <= 1.35,
        ),
    ]


def _data_sheet(platform: Platform, designs: np.ndarray) -> Claim:
    fleet = platform.fleet.group("U06")
    case = platform.load_case(platform.default_load_case)
    rng = np.random.default_rng(1)
    rows = np.vstack([np.ones(designs.shape[1]), designs])
    changes = []
    for _ in range(N_POWERTRAINS):
        powertrain = platform.powertrain.within_tolerance(rng)
        motion = coupled_motion(fleet, platform.mounts, powertrain, case)
        splv = NUMPY_COUPLED.prepare(motion)(rows)
        changes.append((splv[1:] - splv[0]) / motion.frequency.size)
    spread = float(np.std(changes, axis=0).max())
    return Claim(
        topic="change of coupled SPLV a line: standard deviation by the data sheet's tolerances",
        asked="at most 0.02 dB",
        measured=f"{spread:.3f} dB over {N_POWERTRAINS} powertrains x {len(designs)} designs",
        holds=spread <= 0.02,
    )
