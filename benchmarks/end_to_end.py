"""NSGA-II, 100 designs over 100 generations, end to end against an element-wise loop in pymoo.

The same random problems as in the tables of the kernels, 5 vehicles x 321 lines, with the 128 draws
of the studies, on one thread in double precision. The search is that of the studies, with its
archive, standard errors and hypervolume; the rival is pymoo's NSGA2 on an `ElementwiseProblem` that
loops over draws (and, for prescribed motion, vehicles). Both take turns in one process, the search
over all its generations, the rival over a few of them, so that its total is extrapolated. Seconds
are those of a quiet machine: 10 000 times the 10th percentile of one design's evaluation (of the
rival in pieces of a few draws, as long as an evaluation of the search), plus 100 times that of what
else a generation takes.
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
from pymoo.termination.max_gen import MaximumGenerationTermination
from threadpoolctl import threadpool_limits

import kernels
from deboom.arrays import RealArray
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.space import DesignSpace, Evaluate, stiffness_factor_space
from deboom.vehicles.kernels import level_sum

POPULATION, GENERATIONS, EVERY = 100, 100, 25
"""Budget of the search, and generations of it between two of the rival."""
PRESCRIBED, COUPLED = "prescribed, numba", "coupled, numba"

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


class _Watch:
    """Keeps the times of single evaluations, and of whole generations without them."""

    def __init__(self, n_pieces: int = 1) -> None:
        self.n_pieces = n_pieces
        self.evaluations: list[float] = []
        self.rests: list[float] = []
        self._seen = 0

    def evaluation(self, start: float) -> None:
        self.evaluations.append(time.perf_counter() - start)

    def generation(self, start: float) -> None:
        inside = sum(self.evaluations[self._seen :])
        self.rests.append(time.perf_counter() - start - inside)
        self._seen = len(self.evaluations)

    @property
    def quiet_search(self) -> float:
        """Seconds of a whole search on a quiet machine."""
        one, rest = (float(np.percentile(t, 10)) for t in (self.evaluations, self.rests))
        return GENERATIONS * (POPULATION * self.n_pieces * one + rest)


class _Timed(RobustResponse):
    """The search's robust response, looked at design by design."""

    watch: _Watch

    def _statistics(self, *args: Any) -> Any:
        start = time.perf_counter()
        found = super()._statistics(*args)
        self.watch.evaluation(start)
        return found


class _Loop(ElementwiseProblem):
    """One design at a time: mean and standard deviation over the draws, summed over vehicles."""

    def __init__(self, sums: Sums, space: DesignSpace, scatter: RealArray, watch: _Watch) -> None:
        super().__init__(n_var=space.n_variables, n_obj=2, xl=space.lower, xu=space.upper)
        self.sums, self.scatter, self.watch = sums, scatter, watch

    def _evaluate(self, x: RealArray, out: dict[str, Any], *_args: Any, **_kwargs: Any) -> None:
        pieces = []
        for rows in np.split(self.scatter, self.watch.n_pieces):
            start = time.perf_counter()
            pieces.append(self.sums(x * rows))
            self.watch.evaluation(start)
        values = np.concatenate(pieces)
        out["F"] = [values.mean(axis=0).sum(), values.std(axis=0, ddof=1).sum()]


def measure() -> pd.DataFrame:
    """Run every search beside its rival; one row each."""
    shape = kernels.SHAPES[0]
    prescribed, coupled = kernels.prescribed_problem(shape), kernels.coupled_problem(shape)
    rivals: dict[str, tuple[kernels.Case, int]] = {
        PRESCRIBED: (prescribed, 16),
        COUPLED: (coupled, 64),
    }
    rows = {}
    with threadpool_limits(1, user_api="blas"):
        for name, (case, n_pieces) in rivals.items():
            rows[name] = _side_by_side(case, n_pieces)
    return pd.DataFrame(rows).T


def _side_by_side(case: kernels.Case, n_pieces: int) -> dict[str, float]:
    sums, names = level_sum(case, compiled=True), case.variable_names
    n_variables = len(names)
    space = stiffness_factor_space(names)
    sample = sobol_sample(n_variables, 128, seed=1)
    own, other = _Watch(), _Watch(n_pieces)
    model: Evaluate = _Model(sums, names)
    robust = _Timed(model, space, sample)
    object.__setattr__(robust, "watch", own)
    sums(np.ones((2, n_variables)))  # compiles
    scatter = 1.0 + space.relative_sigma * sample.values
    rival = NSGA2(pop_size=POPULATION)
    loops = _Loop(lambda rows: kernels.loop(case, rows), space, scatter, other)
    rival.setup(loops, termination=MaximumGenerationTermination(GENERATIONS), seed=1)
    begin = time.perf_counter()

    def take_turns(generation: int, _total: int, _text: str) -> None:
        nonlocal begin
        own.generation(begin)
        if generation % EVERY == 0:
            begin = time.perf_counter()
            rival.next()
            other.generation(begin)
        begin = time.perf_counter()

    nsga2(robust, POPULATION, GENERATIONS, seed=1, progress=take_turns)
    return {
        "search [s]": own.quiet_search,
        "loop, extrapolated [s]": other.quiet_search,
        "generations of the loop": len(other.rests),
        "x loop": other.quiet_search / own.quiet_search,
    }


def report() -> str:
    """Measure and return the table as text."""
    columns = {
        "search [s]": "{:.1f}".format,
        "loop, extrapolated [s]": "{:.0f}".format,
        "generations of the loop": "{:.0f}".format,
        "x loop": "{:.1f}".format,
    }
    return str(measure().to_string(formatters=columns))
