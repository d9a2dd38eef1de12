"""The door to pymoo: a robust response as its problem, and NSGA-II with an archive."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.termination.max_gen import MaximumGenerationTermination

from deboom.errors import InputError
from deboom.explore.arrays import RealArray, frozen_copy
from deboom.explore.design_space import DesignSpace
from deboom.explore.fronts import ParetoFront, hypervolume, pareto_front
from deboom.explore.robust import Robust, RobustValues
from deboom.explore.seeds import checked_seed

FAILED_OBJECTIVE = 1e30
"""Both objectives of a failed design: finite, because pymoo lets NaN win [response unit]."""

Progress = Callable[[int, int, str], None]
"""Called after each generation with its number, the number of generations, and a line of text."""


class RobustProblem(Problem):
    """A robust response as a pymoo problem: minimise ``[mean_sum, sigma_sum]``.

    A failed design is infeasible (``G > 0``), so that it never beats one that could be computed.
    The columns ``mean``, ``sigma``, ``standard_error_mean_sum`` and ``standard_error_sigma_sum``
    travel with each individual: ``res.pop.get("sigma")`` has shape (n, r).

    Parameters
    ----------
    robust : Robust
        Such as `RobustResponse`.

    Examples
    --------
    >>> from pymoo.optimize import minimize
    >>> from deboom.explore import design_space, known_truth, robust, tolerance_samples
    >>> model = known_truth.quad2(4, seed=1)
    >>> space = design_space.stiffness_factor_space(model.variable_names)
    >>> sample = tolerance_samples.sobol_sample(space.n_variables, seed=1)
    >>> problem = RobustProblem(robust.RobustResponse(model, space, sample))
    >>> result = minimize(problem, NSGA2(20), ("n_gen", 10), seed=1)
    >>> result.F.shape[1], result.pop.get("sigma").shape
    (2, (20, 2))
    """

    def __init__(self, robust: Robust) -> None:
        space = robust.space
        super().__init__(
            n_var=space.n_variables, n_obj=2, n_ieq_constr=1, xl=space.lower, xu=space.upper
        )
        self.robust = robust

    def _evaluate(self, x: RealArray, out: dict[str, Any], *_args: Any, **_kwargs: Any) -> None:
        values = self.robust(x)
        out["F"] = np.where(values.failed[:, None], FAILED_OBJECTIVE, values.objectives)
        out["G"] = np.where(values.failed, 1.0, -1.0)[:, None]
        for name in ("mean", "sigma", "standard_error_mean_sum", "standard_error_sigma_sum"):
            out[name] = getattr(values, name)


@dataclass(frozen=True, eq=False)
class SearchResult:
    """What a search found and how.

    Parameters
    ----------
    front : ParetoFront
        Of all designs seen, not only of the last population.
    n_evaluated : int
        Designs evaluated.
    failed_designs : array, shape (n_failed, k)
        Designs that could not be computed.
    hypervolume : array, shape (n_generations,)
        Of the front after each generation [response unit squared].
    reference_point : array, shape (2,)
        Of the hypervolume: the worst objectives in the first generation [response unit].
    seed : int
        Of the search.
    seconds : float
        Wall time [s].
    """

    front: ParetoFront
    n_evaluated: int
    failed_designs: RealArray
    hypervolume: RealArray
    reference_point: RealArray
    seed: int
    seconds: float

    def __post_init__(self) -> None:
        for name in ("failed_designs", "hypervolume", "reference_point"):
            object.__setattr__(self, name, frozen_copy(np.asarray(getattr(self, name))))

    @property
    def n_failed(self) -> int:
        """Designs that could not be computed."""
        return len(self.failed_designs)


class _Archive:
    """Hands designs on to a robust response and keeps what a search must not lose.

    pymoo asks once per generation.
    """

    def __init__(self, robust: Robust) -> None:
        self.robust = robust
        self.front: ParetoFront | None = None
        self.n_evaluated = 0
        self.failed_designs: list[RealArray] = []
        self.reference_point = np.empty(0)
        self.hypervolume: list[float] = []

    @property
    def space(self) -> DesignSpace:
        return self.robust.space

    def __call__(self, designs: RealArray) -> RobustValues:
        values = self.robust(designs)
        self.n_evaluated += len(values)
        self.failed_designs.append(values.designs[values.failed])
        if self.front is None:
            self.reference_point = _worst_objectives(values)
            self.front = pareto_front(values)
        else:
            self.front = pareto_front(self.front, values)
        self.hypervolume.append(hypervolume(self.front.objectives, self.reference_point))
        return values

    def summary(self) -> str:
        n_failed = sum(map(len, self.failed_designs))
        failed = f", {n_failed} failed" if n_failed else ""
        return f"hypervolume {self.hypervolume[-1]:.5g}{failed}"


def _worst_objectives(values: RobustValues) -> RealArray:
    if np.all(values.failed):
        raise InputError(
            f"none of the {len(values)} designs of the first generation could be computed: "
            "evaluate the nominal design alone and check the bounds of the design space"
        )
    return np.asarray(values.objectives[~values.failed].max(axis=0))


def nsga2(
    robust: Robust,
    population: int = 100,
    generations: int = 100,
    *,
    seed: int,
    progress: Progress | None = None,
) -> SearchResult:
    """Search the Pareto front of both objectives with NSGA-II.

    Population for population the same as pymoo's ``minimize(RobustProblem(robust),
    NSGA2(population), ("n_gen", generations), seed=seed)``; beyond it, an archive keeps every
    non-dominated design that was seen.

    Parameters
    ----------
    robust : Robust
        Such as `RobustResponse`.
    population, generations : int
        Designs per generation, at least 4, and generations, at least 1. The search always runs
        them all.
    seed : int
        From 1 upwards. The global random generators are neither read nor moved.
    progress : callable, optional
        See `Progress`.

    Returns
    -------
    SearchResult

    Raises
    ------
    InputError
        Seed 0, too small a population or no generation; a first generation that fails altogether.
    """
    checked_seed(seed)
    if population < 4 or generations < 1:
        raise InputError(
            f"a search with a population of {population} over {generations} generations cannot "
            "run: take at least 4 designs and 1 generation"
        )
    start = time.perf_counter()
    archive = _Archive(robust)
    algorithm = NSGA2(pop_size=population)
    algorithm.setup(
        RobustProblem(archive), termination=MaximumGenerationTermination(generations), seed=seed
    )
    while algorithm.has_next():
        algorithm.next()
        if progress is not None:
            progress(len(archive.hypervolume), generations, archive.summary())
    assert archive.front is not None  # at least one generation has run
    return SearchResult(
        front=archive.front,
        n_evaluated=archive.n_evaluated,
        failed_designs=np.concatenate(archive.failed_designs),
        hypervolume=np.asarray(archive.hypervolume),
        reference_point=archive.reference_point,
        seed=seed,
        seconds=time.perf_counter() - start,
    )
