"""NSGA-II, 100 designs over 100 generations, end to end against an element-wise loop in pymoo.

The same random problems as in the tables of the kernels, 5 vehicles x 321 lines, with the 128 draws
of the studies, on one thread in double precision. The search is that of the studies, with its
archive, standard errors and hypervolume; the rival is pymoo's NSGA2 on an `ElementwiseProblem` that
loops over draws (and, for prescribed motion, vehicles). Both are timed by the processor's clock;
the rival evaluates a few designs only, from which its total is extrapolated.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize
from threadpoolctl import threadpool_limits

import kernels
from deboom.arrays import RealArray
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.space import DesignSpace, Evaluate, stiffness_factor_space
from deboom.vehicles.kernels import level_sum

POPULATION, GENERATIONS = 100, 100
FEW = {"prescribed, numba": 20, "coupled, numba": 4}
"""Designs that the rival evaluates."""

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
    cases: tuple[kernels.Case, ...] = (
        kernels.prescribed_problem(shape),
        kernels.coupled_problem(shape),
    )
    with threadpool_limits(1, user_api="blas"):
        rows = {name: _compared(case, FEW[name]) for name, case in zip(FEW, cases, strict=True)}
    table = pd.DataFrame(rows, ["search [s]", "loop, extrapolated [s]", "x loop"]).T
    return str(table.to_string(float_format="{:.1f}".format))


def _compared(case: kernels.Case, few: int) -> tuple[float, float, float]:
    """Seconds of the search and of its rival, and their ratio."""
    sums, names = level_sum(case, compiled=True), case.variable_names
    space = stiffness_factor_space(names)
    sample = sobol_sample(len(names), 128, seed=1)
    model: Evaluate = _Model(sums, names)
    sums(np.ones((2, len(names))))  # compiles
    begin = time.process_time()
    nsga2(RobustResponse(model, space, sample), POPULATION, GENERATIONS, seed=1)
    search = time.process_time() - begin
    scatter = 1.0 + space.relative_sigma * sample.values
    problem = _Loop(lambda rows: kernels.loop(case, rows), space, scatter)
    begin = time.process_time()
    minimize(problem, NSGA2(pop_size=few), ("n_gen", 1), seed=1)
    loop = (time.process_time() - begin) * POPULATION * GENERATIONS / few
    return search, loop, loop / search
