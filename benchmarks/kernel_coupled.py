"""Coupled motion: SPLV of a design with all draws of its scatter, the powertrain re-solved.

One evaluation is one design: `n_draws` draws x `n_vehicles` vehicles x `n_lines` lines, each with a
6x6 complex solution. All rivals use one thread and the same random data. The work of the compiled
kernel is counted in its own source, so that zeros it skips do not count; rates of matrix products
are those of a square one of 320 x 320 in the same precision.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.physics.rigid_body import forward_matrices, mass_matrix
from deboom.vehicles import kernel_source
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numba import NUMBA_COUPLED, NUMBA_COUPLED_FLOAT32
from interleaved import quiet_seconds

SIDE = 320
LOOP = "loop over draws, linalg.solve over lines"
BATCHED = "batched linalg.solve"
NUMPY_ROW, NUMBA_ROW, FLOAT32_ROW = (
    f"kernel {kernel.name}" for kernel in (NUMPY_COUPLED, NUMBA_COUPLED, NUMBA_COUPLED_FLOAT32)
)


@dataclass(frozen=True)
class Shape:
    """How much is one evaluation, and how many designs a call of a kernel gets."""

    title: str
    n_draws: int
    n_vehicles: int
    n_lines: int
    n_mounts: int
    n_wheel_ends: int
    n_designs: int


SHAPES = (
    Shape("100 draws x 5 vehicles x 321 lines, 4 powertrain mounts", 100, 5, 321, 4, 0, 16),
    Shape("128 draws x 5 vehicles x 161 lines, as shipped", 128, 5, 161, 3, 2, 1),
)


def problem(shape: Shape, seed: int = 1) -> CoupledMotion:
    """Draw a plausible powertrain: 200 kg, rigid-body modes of 8 to 35 Hz, losses of 10 to 20 %."""
    rng = np.random.default_rng(seed)
    lines = np.linspace(20.0, 60.0, shape.n_lines)
    place = (lines - 20.0) / 40.0
    corner = np.array([[0.05, 0.43, 0.2], [-0.03, -0.45, 0.19], [0.2, -0.06, -0.27]])
    extra = rng.uniform(-0.4, 0.4, (max(shape.n_mounts - 3, 0), 3))
    positions = np.vstack([corner, extra])[: shape.n_mounts]
    n = 3 * shape.n_mounts

    def stiffness(count: int) -> np.ndarray:
        real = rng.uniform(1e5, 6e5, count) * (1 + np.outer(place, rng.uniform(0.05, 0.25, count)))
        return real * (1 + 1j * rng.uniform(0.10, 0.20, count))

    def smooth(*size: int) -> np.ndarray:
        ripples = np.cos(np.pi * np.outer(place, np.arange(8)))
        parts = rng.normal(size=(8, *size)) + 1j * rng.normal(size=(8, *size))
        return np.tensordot(ripples, parts, axes=1)

    inertia = [[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]]
    load = np.array([30.0, 10.0, 30.0, 20.0, 150.0, 10.0]) * smooth(6)
    own = shape.n_wheel_ends
    return CoupledMotion(
        load_case=f"drawn {seed}",
        frequency=lines,
        forward=forward_matrices(positions),
        mass_matrix=mass_matrix(195.0, inertia),
        stiffness=stiffness(n),
        load=load,
        variables=np.arange(n),
        transfer=1e-3 * np.moveaxis(smooth(shape.n_vehicles, n), 0, 1),
        own_mass=np.full(own, 40.0),
        own_stiffness=stiffness(own),
        own_load=50.0 * smooth(own),
        own_variables=np.full(own, n),
        own_transfer=1e-3 * np.moveaxis(smooth(shape.n_vehicles, 1), 0, 1).repeat(own, axis=2),
        rigid_residual=0.0,
        vehicle_names=tuple(f"vehicle {v}" for v in range(shape.n_vehicles)),
        variable_names=tuple(f"m{k // 3} {'xyz'[k % 3]}" for k in range(n + 3 * (own > 0))),
    )


def designs(shape: Shape, seed: int = 2) -> RealArray:
    """Draw designs within 20 % and their scatter of 5 %, shape (n_designs n_draws, n_variable)."""
    rng = np.random.default_rng(seed)
    n_variable = 3 * (shape.n_mounts + (shape.n_wheel_ends > 0))
    nominal = rng.uniform(0.8, 1.2, (shape.n_designs, 1, n_variable))
    scatter = 1 + 0.05 * rng.normal(size=(shape.n_draws, n_variable))
    return (nominal * scatter).reshape(-1, n_variable)


def batched(motion: CoupledMotion, rows: RealArray) -> RealArray:
    """Return the sums of levels by one batched solution of all lines and designs."""
    pressure = motion.pressure(rows)
    return np.asarray((20 * np.log10(np.abs(pressure))).sum(axis=-1))


def loop(motion: CoupledMotion, rows: RealArray) -> RealArray:
    """Return the same with a loop over designs."""
    return np.concatenate([batched(motion, row[np.newaxis]) for row in rows])


def flops_per_line(level_sum: object, n_vehicles: int) -> int:
    """Count the additions, multiplications and divisions of one lane and line of the solution."""
    text = kernel_source.coupled_source(level_sum.pattern)  # type: ignore[attr-defined]
    *solve, hear = (
        sum(map(_is_arithmetic, ast.walk(node)))
        for node in ast.walk(ast.parse("def jit(f): pass\n" + text))
        if isinstance(node, ast.For) and getattr(node.target, "id", "") == "lane"
    )
    return sum(solve) + n_vehicles * (hear + 1)


def _is_arithmetic(node: ast.AST) -> bool:
    return isinstance(node, ast.BinOp) and "LANES" not in ast.dump(node)


def measure(shape: Shape, seconds: float) -> pd.DataFrame:
    """Time all rivals side by side; one row each."""
    motion, rows = problem(shape), designs(shape)
    one = rows[: shape.n_draws]
    few = one[: max(shape.n_draws // 32, 1)]
    sums = {
        NUMPY_ROW: NUMPY_COUPLED.prepare(motion),
        NUMBA_ROW: NUMBA_COUPLED.prepare(motion),
        FLOAT32_ROW: NUMBA_COUPLED_FLOAT32.prepare(motion),
    }
    square = np.random.default_rng(3).random((SIDE, SIDE))
    single = square.astype(np.float32)
    out, single_out = np.empty_like(square), np.empty_like(single)
    calls: dict[str, Callable[[], object]] = {
        LOOP: lambda: loop(motion, few),
        BATCHED: lambda: batched(motion, few),
        NUMPY_ROW: lambda: sums[NUMPY_ROW](one),
        NUMBA_ROW: lambda: sums[NUMBA_ROW](rows),
        FLOAT32_ROW: lambda: sums[FLOAT32_ROW](rows),
        "double": lambda: square.dot(square, out),
        "single": lambda: single.dot(single, single_out),
    }
    with threadpool_limits(1, user_api="blas"):
        quiet = pd.Series(quiet_seconds(calls, seconds))
        exact = loop(motion, one)
        errors = {name: np.abs(level_sum(one) - exact).max() for name, level_sum in sums.items()}
    share = pd.Series({LOOP: len(few), BATCHED: len(few), NUMPY_ROW: len(one)}) / shape.n_draws
    share = share.reindex([LOOP, BATCHED, *sums]).fillna(shape.n_designs)
    each = quiet[share.index] / share
    work = shape.n_draws * shape.n_lines * flops_per_line(sums[NUMBA_ROW], shape.n_vehicles)
    rate = 2 * SIDE**3 / quiet
    peak = pd.Series({NUMBA_ROW: rate["double"], FLOAT32_ROW: rate["single"]})
    return pd.DataFrame(
        {
            "one evaluation [µs]": 1e6 * each,
            "x loop": each[LOOP] / each,
            "x batched": each[BATCHED] / each,
            "of matrix-product rate": work / each / peak,
            "largest error of the sum [dB]": pd.Series(errors),
        }
    ).loc[list(share.index)]


def report() -> str:
    """Measure every shape and return the tables as text."""
    tables = []
    for shape in SHAPES:
        table = measure(shape, seconds=10.0)
        columns = {
            "one evaluation [µs]": "{:.0f}".format,
            "x loop": "{:.1f}".format,
            "x batched": "{:.1f}".format,
            "of matrix-product rate": "{:.2f}".format,
            "largest error of the sum [dB]": "{:.0e}".format,
        }
        tables.append(f"{shape.title}\n{table.to_string(formatters=columns, na_rep='')}")
    return "\n\n".join(tables)
