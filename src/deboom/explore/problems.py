"""The door to pymoo: a robust response as its problem, and NSGA-II with an archive."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.operators.sampling.rnd import FloatRandomSampling
from pymoo.termination.max_gen import MaximumGenerationTermination

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.archive import (
    AnyArray,
    Archive,
    Arrays,
    Checkpoint,
    SearchResult,
    check_same_search,
    generator_state,
    restore_generator,
)
from deboom.explore.doe import checked_within
from deboom.explore.limits import Limits
from deboom.explore.robust import Robust, RobustValues
from deboom.explore.space import DesignSpace, checked_seed

__all__ = ["FAILED_OBJECTIVE", "Progress", "RobustProblem", "SearchResult", "nsga2"]

TRAVELLING = ("mean", "sigma", "standard_error_mean_sum", "standard_error_sigma_sum")
"""Columns of `RobustValues` that travel with each individual."""

OF_INDIVIDUAL = ("X", "F", "G", "rank", "crowding", *TRAVELLING)
"""All that the selection, the survival and the reader of an individual can see of it."""

FAILED_OBJECTIVE = 1e30
"""All objectives of a failed design: finite, because pymoo lets NaN win [response unit]."""

Progress = Callable[[int, int, str], None]
"""Called after each generation with its number, the number of generations, and a line of text."""


class RobustProblem(Problem):
    """A robust response as a pymoo problem: minimise its objectives.

    A failed design is infeasible (``G > 0``), so that it never beats one that could be computed.
    After it come the limits of the response, if it has any, each relative to its bound.
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
        self.limits: Limits | None = getattr(robust, "limits", None)
        n_objectives = getattr(robust, "n_objectives", 2)
        n_constraints = 1 + (len(self.limits.names) if self.limits else 0)
        super().__init__(
            space.n_variables, n_objectives, n_constraints, xl=space.lower, xu=space.upper
        )
        self.robust = robust

    def _evaluate(self, x: RealArray, out: dict[str, Any], *_args: Any, **_kwargs: Any) -> None:
        values = self.robust(x)
        out["F"] = np.where(values.failed[:, None], FAILED_OBJECTIVE, values.objectives)
        out["G"] = self._infeasibility(values)
        for name in TRAVELLING:
            out[name] = getattr(values, name)

    def _infeasibility(self, values: RobustValues) -> RealArray:
        """Return the constraints, shape (n, 1 + c): at most 0 if they are kept."""
        failed = values.failed[:, None]
        if self.limits is None:
            return np.where(failed, 1.0, -1.0)
        missed = np.minimum(values.excess / self.limits.scale, FAILED_OBJECTIVE)
        return np.hstack([np.where(failed, FAILED_OBJECTIVE, -1.0), missed])


class _MixedSampling(FloatRandomSampling):
    """Whole-number variables are drawn evenly from their options."""

    def __init__(self, space: DesignSpace) -> None:
        super().__init__()
        self.space = space

    def _do(self, *args: Any, random_state: Any = None, **kwargs: Any) -> RealArray:
        designs = super()._do(*args, random_state=random_state, **kwargs)
        return _with_options(designs, self.space, random_state)


class _MixedCrossover(SBX):
    """Whole-number variables are exchanged between the parents, never mixed: options have no order.

    The others are crossed as usual.
    """

    def __init__(self, space: DesignSpace) -> None:
        super().__init__(eta=15, prob=0.9)
        self.space = space

    def _do(  # type: ignore[override]  # the base classes do not agree on its arguments
        self, problem: Any, X: RealArray, *args: Any, random_state: Any = None, **kwargs: Any
    ) -> RealArray:
        children = super()._do(problem, X, *args, random_state=random_state, **kwargs)
        whole = self.space.integer
        exchanged = random_state.random(X.shape[1:]) < 0.5
        children[:, :, whole] = np.where(exchanged, X[::-1], X)[:, :, whole]
        return np.asarray(children)


class _MixedMutation(PM):
    """A whole-number variable mutates to any of its options; the others as usual."""

    def __init__(self, space: DesignSpace) -> None:
        super().__init__(eta=20)
        self.space = space

    def _do(  # type: ignore[override]  # the base classes do not agree on its arguments
        self, problem: Any, X: RealArray, *args: Any, random_state: Any = None, **kwargs: Any
    ) -> RealArray:
        mutated = super()._do(problem, X, *args, random_state=random_state, **kwargs)
        chosen = random_state.random(X.shape) < 1.0 / self.space.n_variables
        drawn = _with_options(X, self.space, random_state)
        whole = self.space.integer
        mutated[:, whole] = np.where(chosen, drawn, X)[:, whole]
        return np.asarray(mutated)


def _with_options(designs: RealArray, space: DesignSpace, random: Any) -> RealArray:
    """Return designs (n, k) whose whole-number variables are drawn anew."""
    n_options = np.where(space.integer, space.upper - space.lower + 1.0, 0.0)
    drawn = space.lower + np.floor(random.random(designs.shape) * n_options)
    return np.where(space.integer, drawn, designs)


def _algorithm(space: DesignSpace, population: int, first: RealArray | None) -> NSGA2:
    if not space.integer.any():
        sampling = FloatRandomSampling() if first is None else first
        return NSGA2(pop_size=population, sampling=sampling)
    return NSGA2(
        pop_size=population,
        sampling=_MixedSampling(space) if first is None else first,
        crossover=_MixedCrossover(space),
        mutation=_MixedMutation(space),
    )


def nsga2(
    robust: Robust,
    population: int = 100,
    generations: int = 100,
    *,
    seed: int,
    progress: Progress | None = None,
    checkpoint: Checkpoint | None = None,
    first_population: RealArray | None = None,
) -> SearchResult:
    """Search the Pareto front of all objectives with NSGA-II.

    Population for population the same as pymoo's ``minimize(RobustProblem(robust),
    NSGA2(population), ("n_gen", generations), seed=seed)``; beyond it, an archive keeps every
    non-dominated design that was seen. Whole-number variables of the design space get operators of
    their own: pymoo's treat options as if they had an order. A design beyond a limit never beats
    one that keeps them all; of two such designs the smaller sum of excesses, each relative to its
    bound, wins.

    Parameters
    ----------
    robust : Robust
        Such as `RobustResponse`, or `deboom.explore.limits.LimitedResponse`.
    population, generations : int
        Designs per generation, at least 4, and generations, at least 1. The search always runs
        them all.
    seed : int
        From 1 upwards. The global random generators are neither read nor moved.
    progress : callable, optional
        See `Progress`.
    checkpoint : Checkpoint, optional
        Where the search is kept. If a state is found there the search goes on from it, and ends
        with the same result, bit for bit, as if it had never stopped.
    first_population : array, shape (population, n_variables), optional
        Designs of the first generation [units of the space]; drawn at random if None.

    Returns
    -------
    SearchResult

    Raises
    ------
    InputError
        Seed 0, too small a population or no generation; a first generation that fails altogether;
        limits that no design keeps; a first population of another size or outside the bounds; a
        checkpoint of a search with another seed, population, first population or other variables.
    """
    checked_seed(seed)
    if population < 4 or generations < 1:
        raise InputError(
            f"a search with a population of {population} over {generations} generations cannot "
            "run: take at least 4 designs and 1 generation"
        )
    if first_population is not None:
        first_population = _checked_first(robust.space, first_population, population)
    start = time.perf_counter()
    archive = Archive(robust, checkpoint.store if checkpoint else None)
    algorithm = _algorithm(robust.space, population, first_population)
    algorithm.setup(
        RobustProblem(archive), termination=MaximumGenerationTermination(generations), seed=seed
    )
    search = {
        "seed": seed,
        "population": population,
        "variables": list(robust.space.names),
        "first_population_sha256": _digest(first_population),
    }
    found = checkpoint.store.load() if checkpoint else None
    if found is not None:
        arrays, facts = found
        check_same_search(facts, search)
        archive.restore(arrays, facts)
        _restore(algorithm, arrays, facts)
        start -= facts["seconds"]
    while archive.generation < generations and algorithm.has_next():
        algorithm.next()
        if checkpoint and checkpoint.due(archive.generation, generations):
            arrays, facts = _state(algorithm, archive)
            seconds = {"seconds": time.perf_counter() - start}
            said = {name: value for name, value in search.items() if value is not None}
            checkpoint.store.save(arrays, facts | said | seconds)
        if progress is not None:
            progress(archive.generation, generations, archive.summary())
    return archive.result(seed, time.perf_counter() - start)


def _checked_first(space: DesignSpace, designs: RealArray, population: int) -> RealArray:
    """Return the first population, or refuse it."""
    designs = checked_within(space, designs)
    if len(designs) != population:
        raise InputError(
            f"a first population of {len(designs)} designs does not fit a search with a population "
            f"of {population}: give as many"
        )
    return designs


def _digest(designs: RealArray | None) -> str | None:
    """Return the SHA-256 of a first population; None if the search draws its own."""
    if designs is None:
        return None
    return hashlib.sha256(np.ascontiguousarray(designs).tobytes()).hexdigest()


def _state(algorithm: Any, archive: Archive) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """Return all that the next generation depends on."""
    arrays, facts = archive.state()
    for name in OF_INDIVIDUAL:
        # an infeasible individual may have no rank: None becomes NaN
        values = np.asarray(algorithm.pop.get(name), dtype=float)
        arrays[f"population.{name}"] = values
    facts["iteration"] = algorithm.n_iter
    facts["evaluations"] = algorithm.evaluator.n_eval
    facts["random"] = generator_state(algorithm.random_state)
    return arrays, facts


def _restore(algorithm: Any, arrays: Arrays, facts: Mapping[str, Any]) -> None:
    """Put a new algorithm where another one was when its state was taken."""
    algorithm.pop = Population.new(**{name: arrays[f"population.{name}"] for name in OF_INDIVIDUAL})
    for individual in algorithm.pop:
        individual.evaluated.update(algorithm.evaluator.evaluate_values_of)
    algorithm.is_initialized = True
    algorithm.start_time = time.time()
    algorithm.n_iter = facts["iteration"]
    algorithm.evaluator.n_eval = facts["evaluations"]
    restore_generator(algorithm.random_state, facts["random"])
    algorithm._set_optimum()
