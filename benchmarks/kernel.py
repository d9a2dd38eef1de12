"""Booming-index kernel: SPLV of a design with all draws of its scatter, in every vehicle.

One evaluation is one design: `n_draws` draws x `n_vehicles` vehicles x `n_lines` lines. All rivals
use one thread and the same random data. The rate of matrix products is that of a square one of
320 x 320 in the same precision; only products with variables that have an effect count as work.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.physics.sound_level import REFERENCE_PRESSURE, spl
from deboom.vehicles.kernel_numba import NUMBA, NUMBA_FLOAT32
from deboom.vehicles.kernel_numpy import NUMPY
from interleaved import quiet_seconds

PEAK = np.sqrt(2.0) * REFERENCE_PRESSURE
SIDE = 320
LOOP = "loop over draws and vehicles, 10 lg |p|²"
EINSUM = "einsum over everything, 20 lg |p|"
KERNEL = f"kernel {NUMPY.name}"
NUMBA_ROW, FLOAT32_ROW = f"kernel {NUMBA.name}", f"kernel {NUMBA_FLOAT32.name}"


@dataclass(frozen=True)
class Shape:
    """How much is one evaluation, and how many of them a call of the kernel gets."""

    title: str
    n_draws: int
    n_vehicles: int
    n_lines: int
    n_variables: int
    n_effective: int
    n_designs: int


SHAPES = (
    Shape("100 draws x 5 vehicles x 321 lines", 100, 5, 321, 12, 12, 32),
    Shape("128 draws x 5 vehicles x 161 lines, as shipped", 128, 5, 161, 12, 10, 1),
)


@dataclass(frozen=True)
class Problem:
    """Random contributions [Pa], the weighting of their lines [dB], and perturbed designs."""

    contributions: ComplexArray
    weighting: RealArray
    designs: RealArray


def problem(shape: Shape, seed: int = 1) -> Problem:
    """Draw a problem of a shape: designs within 20 % and their scatter of 5 %."""
    rng = np.random.default_rng(seed)
    size = (shape.n_vehicles, shape.n_lines, shape.n_variables)
    contributions = 1e-3 * (rng.normal(size=size) + 1j * rng.normal(size=size))
    contributions[:, :, shape.n_effective :] = 0.0
    lines = np.linspace(20.0, 60.0, shape.n_lines)
    weighting = spl(np.full(shape.n_lines, PEAK), lines)
    nominal = rng.uniform(0.8, 1.2, (shape.n_designs, 1, shape.n_variables))
    scatter = 1 + 0.05 * rng.normal(size=(shape.n_draws, shape.n_variables))
    return Problem(contributions, weighting, (nominal * scatter).reshape(-1, shape.n_variables))


Line = Callable[[ComplexArray], npt.NDArray[np.float64]]


def loop(contributions: ComplexArray, designs: RealArray, level: Line) -> RealArray:
    """Return the sums of `level` with Python loops over designs and vehicles."""
    sums = np.empty((len(designs), len(contributions)))
    for d, design in enumerate(designs):
        for v, vehicle in enumerate(contributions):
            sums[d, v] = np.sum(level(vehicle @ design))
    return sums


def einsum(contributions: ComplexArray, designs: RealArray) -> RealArray:
    """Return the sums of levels with one complex product of everything."""
    pressure = np.einsum("dk,vfk->dvf", designs, contributions, optimize=True)
    return np.asarray((20 * np.log10(np.abs(pressure))).sum(axis=-1))


def measure(shape: Shape, seconds: float) -> pd.DataFrame:
    """Time all rivals side by side; one row each."""
    data = problem(shape)
    one = data.designs[: shape.n_draws]
    # a quarter of the draws keeps the calls of the slow rivals short; folded puts A and p0 into C
    some = one[: shape.n_draws // 4]
    folded = data.contributions * (10 ** (data.weighting / 20) / PEAK)[:, np.newaxis]
    sums = {
        f"kernel {kernel.name}": kernel.prepare(folded) for kernel in (NUMPY, NUMBA, NUMBA_FLOAT32)
    }
    square = np.random.default_rng(2).random((SIDE, SIDE))
    single = square.astype(np.float32)
    out, single_out = np.empty_like(square), np.empty_like(single)

    def as_written(pressure: ComplexArray) -> RealArray:
        return np.asarray(20 * np.log10(np.abs(pressure) / PEAK) + data.weighting)

    rivals: dict[str, tuple[Callable[[], object], float]] = {
        "loop over draws and vehicles, eq. 35 as written": (
            lambda: loop(data.contributions, some, as_written),
            len(some) / len(one),
        ),
        LOOP: (
            lambda: loop(folded, some, lambda p: 10 * np.log10(np.abs(p) ** 2)),
            len(some) / len(one),
        ),
        "loop over draws and vehicles, 20 lg |p|": (
            lambda: loop(folded, some, lambda p: 20 * np.log10(np.abs(p))),
            len(some) / len(one),
        ),
        EINSUM: (lambda: einsum(folded, one), 1.0),
        KERNEL: (lambda: sums[KERNEL](data.designs), shape.n_designs),
        NUMBA_ROW: (lambda: sums[NUMBA_ROW](data.designs), shape.n_designs),
        FLOAT32_ROW: (lambda: sums[FLOAT32_ROW](data.designs), shape.n_designs),
    }
    calls: dict[str, Callable[[], object]] = {name: call for name, (call, _) in rivals.items()}
    calls["double"] = lambda: square.dot(square, out)
    calls["single"] = lambda: single.dot(single, single_out)
    # glibc keeps what was freed from now on; without this, large temporaries cost the rivals fresh
    # pages in every call, and einsum up to three times as much
    np.ones(30 * 2**20 // 8)
    with threadpool_limits(1, user_api="blas"):
        quiet = quiet_seconds(calls, seconds)
        exact = loop(data.contributions, one, as_written)
        errors = {name: np.abs(level_sum(one) - exact).max() for name, level_sum in sums.items()}
    rate = pd.Series(2 * SIDE**3 / quiet["double"], index=list(rivals))
    rate[FLOAT32_ROW] = 2 * SIDE**3 / quiet["single"]
    work = 4.0 * shape.n_draws * shape.n_vehicles * shape.n_lines * shape.n_effective
    each = pd.Series({name: quiet[name] / share for name, (_, share) in rivals.items()})
    return pd.DataFrame(
        {
            "one evaluation [µs]": 1e6 * each,
            "x loop": each[LOOP] / each,
            "x einsum": each[EINSUM] / each,
            "of matrix-product rate": work / each / rate,
            "largest error of the sum [dB]": pd.Series(errors),
        }
    ).loc[list(rivals)]


def report() -> str:
    """Measure every shape and return the tables as text."""
    tables = []
    for shape in SHAPES:
        table = measure(shape, seconds=8.0)
        columns = {
            "one evaluation [µs]": "{:.0f}".format,
            "x loop": "{:.1f}".format,
            "x einsum": "{:.1f}".format,
            "of matrix-product rate": "{:.2f}".format,
            "largest error of the sum [dB]": "{:.0e}".format,
        }
        tables.append(f"{shape.title}\n{table.to_string(formatters=columns, na_rep='')}")
    return "\n\n".join(tables)
