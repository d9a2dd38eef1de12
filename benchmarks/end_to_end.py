"""NSGA-II, 100 designs over 100 generations, end to end against an element-wise loop in pymoo.

The same random problems as in the tables of the kernels, 5 vehicles x 321 lines, with the 128 draws
of the studies, on one thread in double precision. The search is that of the studies, with its
archive, standard errors and hypervolume; the rival is pymoo's `ElementwiseProblem` that loops over
draws (and, for prescribed motion, vehicles). It evaluates two designs after each generation of the
search, so that both see the same machine, and the second, whose memory is warm, is timed by the
processor's clock; its total is extrapolated, without what NSGA-II itself would take beside it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from pymoo.core.problem import ElementwiseProblem
from threadpoolctl import threadpool_limits

import kernels
from deboom.arrays import RealArray
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.space import DesignSpace, stiffness_factor_space
from deboom.vehicles.kernels import level_sum
from samples import drawn_cars

POPULATION, GENERATIONS = 100, 100
Sums = Callable[[RealArray], RealArray]


@dataclass(frozen=True, eq=False)
class _Model:
    """Sums of levels as the exploration takes them."""

    sums: Sums
    variable_names: tuple[str, ...]
    response_names: tuple[str, ...] = tuple("vwxyz")
    response_unit: str = "dB"

    def __call__(self, designs: RealArray) -> RealArray:
        return self.sums(designs)


class _Loop(ElementwiseProblem):
    """One design at a time: mean and standard deviation over the draws, summed over vehicles."""

    def __init__(self, sums: Sums, space: DesignSpace, scatter: RealArray) -> None:
        super().__init__(n_var=space.n_variables, n_obj=2, xl=space.lower, xu=space.upper)
        self.sums, self.scatter = sums, scatter

    def _evaluate(self, x: RealArray, out: dict[str, Any], *_args: Any, **_kwargs: Any) -> None:
        values = self.sums(x * self.scatter)
        out["F"] = [values.mean(axis=0).sum(), values.std(axis=0, ddof=1).sum()]


def report() -> str:
    """Run every search beside its rival and return the table as text."""
    shape = kernels.SHAPES[0]
    with threadpool_limits(1, user_api="blas"):
        rows = {
            "prescribed, numba": _compared(drawn_cars.prescribed_problem(shape)),
            "coupled, numba": _compared(drawn_cars.coupled_problem(shape)),
        }
    table = pd.DataFrame(rows, ["search [s]", "loop, extrapolated [s]", "x loop"]).T
    return str(table.to_string(float_format="{:.1f}".format))


def _compared(case: drawn_cars.Case) -> tuple[float, float, float]:
    """Seconds of the search and of its rival, and their ratio."""
    sums, names = level_sum(case, compiled=True), case.variable_names
    space = stiffness_factor_space(names)
    sample = sobol_sample(len(names), 128, seed=1)
    sums(np.ones((2, len(names))))  # compiles
    scatter = 1.0 + space.relative_sigma * sample.values
    rival = _Loop(lambda rows: kernels.loop(case, rows), space, scatter)
    turns, loop = 0.0, 0.0

    def take_turns(*_state: object) -> None:
        nonlocal turns, loop
        begin = time.process_time()
        rival.evaluate(np.ones((1, len(names))))
        warm = time.process_time()
        rival.evaluate(np.ones((1, len(names))))
        turns += time.process_time() - begin
        loop += time.process_time() - warm

    begin = time.process_time()
    robust = Robust(_Model(sums, names), space, sample)
    nsga2(robust, Search(POPULATION, GENERATIONS, seed=1), progress=take_turns)
    search = time.process_time() - begin - turns
    return search, POPULATION * loop, POPULATION * loop / search
