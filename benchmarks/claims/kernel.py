"""Booming-index kernel: speed against plain code, error, and independence of the batch.

Speeds are quiet times side by side in one process on one thread; `make bench` shows the tables.
"The loop" is the one over draws and vehicles with numpy over the lines.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import kernel as bench
from claims import Claim
from deboom.arrays import ComplexArray, RealArray
from deboom.files.platform import read_platform
from deboom.vehicles.fleet import path_contributions
from deboom.vehicles.kernel_numpy import NUMPY

N_DATA_SETS = 60
ERROR = 1e-9
PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"


def claims() -> list[Claim]:
    found = []
    for shape in bench.SHAPES:
        row = bench.measure(shape, seconds=10.0).loc[bench.KERNEL]
        for column, least, unit in (
            ("x loop", 12.0, "times the loop"),
            ("x einsum", 2.5, "times plain einsum"),
        ):
            found.append(
                Claim(
                    topic=f"speed of the numpy kernel, {shape.title}",
                    asked=f"at least {least:g} {unit}",
                    measured=f"{row[column]:.1f} {unit}",
                    holds=bool(row[column] >= least),
                )
            )
    for title, draw in (("random data", _random), ("a notch at every line", _notches)):
        worst = max(_error(*draw(seed)) for seed in range(1, N_DATA_SETS + 1))
        found.append(
            Claim(
                topic=f"error of SPLV over 161 lines against long double, {title}",
                asked=f"at most {ERROR:g} dB",
                measured=f"{worst:.1e} dB over {N_DATA_SETS} data sets x 128 draws x 5 vehicles",
                holds=bool(worst <= ERROR),
            )
        )
    worst, n_sets = _shipped_error()
    found.append(
        Claim(
            topic="error of SPLV over 161 lines against long double, shipped platform",
            asked=f"at most {ERROR:g} dB",
            measured=f"{worst:.1e} dB over {n_sets} groups and load cases x 128 designs",
            holds=bool(worst <= ERROR),
        )
    )
    different, n_batches = _differences()
    found.append(
        Claim(
            topic="designs whose SPLV changes a bit with batch size or order",
            asked="0",
            measured=f"{different} in {n_batches} ways to batch 1000 designs",
            holds=different == 0,
        )
    )
    return found


def _random(seed: int) -> tuple[ComplexArray, RealArray]:
    data = bench.problem(bench.SHAPES[1], seed)
    return data.contributions, data.designs


def _notches(seed: int) -> tuple[ComplexArray, RealArray]:
    """At each line the nominal design cancels to 60 dB below its largest path."""
    contributions, designs = _random(seed)
    last = bench.SHAPES[1].n_effective - 1
    rest = contributions[:, :, :last].sum(axis=2)
    contributions[:, :, last] = -rest + 1e-3 * np.abs(contributions).max(axis=2)
    return contributions, 1 + 0.02 * (designs - 1)


def _shipped_error() -> tuple[float, int]:
    platform = read_platform(PLATFORM)
    designs = bench.problem(bench.SHAPES[1]).designs
    errors = [
        _error(path_contributions(fleet, platform.mounts, load_case).values, designs)
        for fleet in map(platform.fleet.group, ("U06", "F39", "F45"))
        for load_case in platform.load_cases
    ]
    return max(errors), len(errors)


def _error(contributions: ComplexArray, designs: RealArray) -> float:
    x = designs.astype(np.longdouble)
    real = np.einsum("vfk,dk->dvf", contributions.real.astype(np.longdouble), x)
    imaginary = np.einsum("vfk,dk->dvf", contributions.imag.astype(np.longdouble), x)
    exact = (10 * np.log10(real**2 + imaginary**2)).sum(axis=-1)
    return float(np.abs(NUMPY.prepare(contributions)(designs) - exact).max())


def _differences() -> tuple[int, int]:
    contributions = bench.problem(bench.SHAPES[1]).contributions
    rng = np.random.default_rng(3)
    designs = rng.uniform(0.8, 1.2, (1000, contributions.shape[2]))
    level_sum = NUMPY.prepare(contributions)
    whole, different, n_batches = level_sum(designs), 0, 0
    for size in (1, 2, 17, 100, 127, 128, 129, 500):
        order = rng.permutation(len(designs))
        parts = [level_sum(designs[order[i : i + size]]) for i in range(0, len(designs), size)]
        different += int((np.concatenate(parts) != whole[order]).any(axis=1).sum())
        n_batches += 1
    return different, n_batches
