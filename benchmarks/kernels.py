"""Booming model: SPLV of a design with all draws of its scatter, in every vehicle.

One evaluation is one design: all draws x vehicles x lines, with the motion prescribed, coupled (a
6x6 complex solution per line) or amplitude-dependent (a fixed point of such solutions per line;
stiffnesses soften by about a tenth per doubled amplitude). The loop is plain numpy draw by draw;
with amplitudes it takes six sweeps from rest. All rivals use one thread and the same random data.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.vehicles.amplitude_motion import AmplitudeMotion
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.fleet import PathContributions
from deboom.vehicles.kernels import LevelSum, level_sum
from interleaved import quiet_seconds

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from samples.drawn_cars import (
    PROBLEMS,
    Case,
    Shape,
    at_once,
    designs,
    flexible_problem,
    tilted_problem,
)

LOOP = "loop over draws"
NUMPY, NUMBA = "model, numpy", "model, numba"
BESIDE = "model, numba, without"
SWEEPS = 6
Sums = Callable[[RealArray], RealArray]


SHAPES = (
    Shape("100 draws x 5 vehicles x 321 lines, 4 powertrain mounts", 100, 5, 321, 4, 0, 16),
    Shape("128 draws x 5 vehicles x 161 lines, as shipped", 128, 5, 161, 3, 2, 1),
)


OTHER_PROBLEMS: dict[str, Callable[[Shape], Case]] = {
    "coupled motion of tilted mounts": tilted_problem,
    "coupled motion on bodies that give way": flexible_problem,
}
"""Measured beside coupled motion without what the title names."""


def loop(case: Case, rows: RealArray) -> RealArray:
    """Return the sums of levels draw by draw, as one would write it first."""
    if isinstance(case, CoupledMotion) and not isinstance(case, AmplitudeMotion):
        return np.concatenate([at_once(case, row[np.newaxis]) for row in rows])
    if isinstance(case, PathContributions):
        sums = np.empty((len(rows), len(case.values)))
        for d, row in enumerate(rows):
            for v, values in enumerate(case.values):
                sums[d, v] = np.sum(10 * np.log10(np.abs(values @ row) ** 2))
        return sums
    powertrain, *wheel_ends = case.bodies
    n_body, forward = powertrain.variables.size, powertrain.forward
    squared = case.angular_frequency_squared[:, np.newaxis]
    inertia = squared[..., np.newaxis] * powertrain.mass_matrix
    end_inertia = squared * np.array([end.mass_matrix[0, 0] for end in wheel_ends])
    end_load = np.hstack([np.empty((len(squared), 0)), *(end.load for end in wheel_ends)])
    nominal, transfer, c = case.stiffness, case.transfer, case.cubic
    levels = []
    for row in rows:
        factors = row[case.variables]
        ratio = np.zeros(case.lowest.shape)
        for _ in range(SWEEPS):
            t = np.minimum(ratio, case.highest)
            relative = c[..., 0] + t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3]))
            springs = factors * nominal * relative
            body = springs[:, :n_body, np.newaxis] * forward
            matrix = forward.T @ body - inertia
            moved = np.linalg.solve(matrix, powertrain.load[..., np.newaxis])[..., 0]
            ends = end_load / (springs[:, n_body:] - end_inertia)
            displacement = np.hstack([moved @ forward.T, ends])
            ratio = np.abs(displacement) / case.amplitude
        pressure = np.einsum("vfi,fi->vf", transfer, springs * displacement)
        levels.append((20 * np.log10(np.abs(pressure))).sum(axis=-1))
    return np.array(levels)


def exact(case: Case, rows: RealArray) -> RealArray:
    """Return the sums of levels as exactly as double precision allows."""
    if isinstance(case, AmplitudeMotion):
        return level_sum(replace(case, tolerance=1e-12), compiled=False)(rows)
    return loop(case, rows)


def measure(
    motion: Motion, shape: Shape, seconds: float, problem: Callable[[Shape], Case] | None = None
) -> pd.DataFrame:
    """Time all rivals side by side; one row each."""
    case = (problem or PROBLEMS[motion])(shape)
    rows = designs(shape)
    rows_of_design = rows[: shape.n_draws]
    plain, compiled = (level_sum(case, compiled=compiled) for compiled in (False, True))
    few = rows_of_design[: {Motion.prescribed: 25, Motion.coupled: 3, Motion.amplitude: 2}[motion]]
    rivals: dict[str, tuple[Sums, RealArray]] = {LOOP: (lambda x: loop(case, x), few)}
    rivals |= {NUMPY: (plain, rows_of_design), NUMBA: (compiled, rows)}
    if problem is not None:
        rivals |= {BESIDE: (level_sum(PROBLEMS[motion](shape), compiled=True), rows)}

    def bind(sums: Sums, x: RealArray) -> Callable[[], object]:
        return lambda: sums(x)

    # glibc keeps what was freed from now on; without this, large temporaries cost the rivals fresh
    # pages in every call, and einsum up to three times as much
    np.ones(30 * 2**20 // 8)
    with threadpool_limits(1, user_api="blas"):
        calls = {name: bind(*rival) for name, rival in rivals.items()}
        quiet = quiet_seconds(calls, seconds, calls=2 if motion is Motion.amplitude else 4)
        truth = exact(case, rows_of_design)
        same = [name for name in rivals if name != BESIDE]
        errors = {name: np.abs(rivals[name][0](rows_of_design) - truth).max() for name in same}
    each = pd.Series(
        {name: quiet[name] * len(rows_of_design) / len(x) for name, (_, x) in rivals.items()}
    )
    return pd.DataFrame(
        {
            "one evaluation [µs]": 1e6 * each,
            "x loop": each[LOOP] / each,
            "largest error of the sum [dB]": pd.Series(errors),
        }
    )


def ratios(shape: Shape, seconds: float) -> pd.DataFrame:
    """Compare motions and gradients on one vehicle and on all vehicles of a shape; one row each.

    A gradient is that of two weighted sums of all vehicles, such as mean and sigma, with the values
    themselves.
    """
    problems = {
        "prescribed": PROBLEMS[Motion.prescribed],
        "coupled": PROBLEMS[Motion.coupled],
        "on bodies that give way": flexible_problem,
    }
    rows = []
    for n_vehicles in (1, shape.n_vehicles):
        cars = replace(shape, n_vehicles=n_vehicles)
        x = designs(cars)
        calls: dict[tuple[str, bool], Callable[[], object]] = {}
        for name, problem in problems.items():
            summed = level_sum(problem(cars), compiled=True)
            calls[name, False] = partial(summed, x)
            calls[name, True] = partial(_with_gradients, summed, x)
        quiet = quiet_seconds(calls, seconds)
        for name in problems:
            ratio = quiet[name, False] / quiet["coupled", False]
            rows.append(
                {
                    "motion": name,
                    "vehicles": n_vehicles,
                    "x coupled": ratio,
                    "x coupled per vehicle": ratio / n_vehicles,
                    "gradients [evaluations]": quiet[name, True] / quiet[name, False],
                }
            )
    return pd.DataFrame(rows).set_index("motion")


def _with_gradients(summed: LevelSum, rows: RealArray) -> RealArray:
    """Return the slopes of two sums over all vehicles, whose values come first."""
    levels, pull_back = summed.linearised(rows)
    return pull_back(np.ones((2, *levels.shape)))


def report() -> str:
    """Measure every motion and shape and return the tables as text."""
    tables = [f"motions and gradients\n{ratios(SHAPES[-1], seconds=8.0).round(1).to_string()}"]
    for motion in Motion:
        for shape in SHAPES:
            table = measure(motion, shape, seconds=8.0)
            formats = ("{:.0f}".format, "{:.1f}".format, "{:.0e}".format)
            text = table.to_string(formatters=dict(zip(table.columns, formats, strict=True)))
            tables.append(f"{motion.value} motion, {shape.title}\n{text}")
    for title, problem in OTHER_PROBLEMS.items():
        for shape in SHAPES:
            table = measure(Motion.coupled, shape, seconds=8.0, problem=problem)
            text = table.to_string(formatters=dict(zip(table.columns, formats, strict=True)))
            tables.append(f"{title}, {shape.title}\n{text}")
    return "\n\n".join(tables)
