"""The search by any algorithm of pymoo: resume, descents, verification."""

from __future__ import annotations

import hashlib
import time
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import comb
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import pandas as pd
import pymoo.util
from pymoo.algorithms.moo.age import AGEMOEA
from pymoo.algorithms.moo.moead import MOEAD, ParallelMOEAD
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.core.algorithm import Algorithm
from pymoo.core.problem import Problem
from pymoo.core.sampling import Sampling
from pymoo.operators.crossover.sbx import SBX
from pymoo.operators.mutation.pm import PM
from pymoo.operators.sampling.rnd import FloatRandomSampling
from pymoo.termination.max_gen import MaximumGenerationTermination
from pymoo.util.ref_dirs import get_reference_directions

from deboom.arrays import RealArray
from deboom.errors import InputError, listed
from deboom.explore.choices import SearchAlgorithm
from deboom.explore.descent import (
    Gradients,
    by_differences,
    converged_front,
    gradients_of,
    without_gradient,
)
from deboom.explore.doe import checked_within, designs_of, latin_hypercube
from deboom.explore.front import hypervolume, pareto_front, replicates, thinned, verified
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM, Limit
from deboom.explore.result import Front, SearchResult, UnverifiedSearchError, merge
from deboom.explore.robust import (
    Limits,
    Robust,
    RobustEvaluation,
    RobustValues,
    RobustWrapper,
    chosen,
    joined,
    kept_values,
)
from deboom.explore.selection import improved, pick
from deboom.explore.space import DesignSpace, check_repeats, checked_seed, spread_unit
from deboom.explore.workers import workers_for
from deboom.progress import Progress, progress_shown

FAILED_OBJECTIVE = 1e30
"""All objectives of a failed design: finite, because pymoo lets NaN win [response unit]."""

_TRAVELLING = ("mean", "sigma", "standard_error_mean_sum", "standard_error_sigma_sum")


class Store(Protocol):
    """Where one search keeps what must survive its process, such as a folder.

    A search that starts again with the same seed asks for the same designs; those that the store
    holds are not computed again, so that it ends bit for bit as if it had never stopped.
    """

    def save(self, facts: Mapping[str, Any]) -> None:
        """Replace the facts about the search, which JSON can hold, in one step."""

    def load(self) -> Mapping[str, Any] | None:
        """Return the facts; None before they were first saved."""

    def keep(self, number: int, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Keep the evaluations of one generation by name; the first is number 1.

        Number 0 is what descents found.
        """

    def kept(self, number: int) -> Mapping[str, npt.NDArray[Any]] | None:
        """Return the evaluations of one generation; None if they were not kept."""


class RobustProblem(Problem):
    """A robust response as a pymoo problem: minimise its objectives.

    A failed design is infeasible (``G > 0``), so that it never beats one that could be computed.
    Whole-number variables are rounded to their options, in the individuals as well.
    ``G`` has this constraint first, then the limits of the response, each relative to its bound.
    The columns ``mean``, ``sigma``, ``standard_error_mean_sum`` and ``standard_error_sigma_sum``
    travel with each individual: ``res.pop.get("sigma")`` has shape (n, r).

    Parameters
    ----------
    robust : RobustEvaluation
        Designs, shape (n, k) → values with m objectives, as `deboom.Robust` makes them.
    constraints : bool
        Whether failed designs and limits are constraints, as most algorithms of pymoo take them.
        Without, such as for MOEA/D, these designs have objectives of `FAILED_OBJECTIVE`.

    Raises
    ------
    InputError
        While it runs: responses of another shape than the model names.

    See Also
    --------
    deboom.Robust, deboom.search, deboom.BoomingProblem, deboom.Search

    Examples
    --------
    >>> import deboom
    >>> import numpy as np
    >>> from pymoo.algorithms.moo.nsga2 import NSGA2
    >>> from pymoo.optimize import minimize
    >>> variables, vehicles = ("TSM x", "GeM x"), ("sedan", "tourer")
    >>> model = deboom.ResponseFunction(np.square, variables, vehicles, "dB")
    >>> problem = deboom.RobustProblem(deboom.Robust(model, model.design_space()))
    >>> result = minimize(problem, NSGA2(20), ("n_gen", 10), seed=1)
    >>> result.F.shape[1], result.pop.get("sigma").shape
    (2, (20, 2))
    """

    def __init__(self, robust: RobustEvaluation, *, constraints: bool = True) -> None:
        space, limits = robust.space, robust.limits
        n_constraints = 1 + len(limits.names) if constraints else 0
        super().__init__(
            space.n_variables, robust.n_objectives, n_constraints, xl=space.lower, xu=space.upper
        )
        self.robust = robust

    def _evaluate(self, x: RealArray, out: dict[str, Any], *_args: Any, **_kwargs: Any) -> None:
        space = self.robust.space
        if space.integer.any():
            # the individuals themselves become whole
            out["X"] = x = space.made_whole(x)
        values = self.robust(x)
        bad = values.failed if self.n_ieq_constr else ~values.feasible
        out["F"] = np.where(bad[:, None], FAILED_OBJECTIVE, values.objectives)
        if self.n_ieq_constr:
            out["G"] = self._constraints(values)
        for name in _TRAVELLING:
            out[name] = getattr(values, name)

    def _constraints(self, values: RobustValues) -> RealArray:
        """Constraints, shape (n, 1 + c): at most 0 if they are kept."""
        failed, limits = values.failed[:, None], self.robust.limits
        if not limits:
            return np.where(failed, 1.0, -1.0)
        missed = np.minimum(values.excess / limits.scale, FAILED_OBJECTIVE)
        return np.hstack([np.where(failed, FAILED_OBJECTIVE, -1.0), missed])


@dataclass(frozen=True)
class Until:
    """What ends a search before its last generation.

    Parameters
    ----------
    seconds : float, optional
        Wall time, with all parts of a resumed search [s]; such a front depends on the machine.
    evaluations : int, optional
        Designs that were evaluated, at the end of a generation.
    gain : float, optional
        Gain of the hypervolume over the last `over` generations, as a share of it, below which the
        search stands still [1].
    over : int
        Generations of that gain.

    Raises
    ------
    InputError
        None of seconds, evaluations and gain, or numbers that are not positive.

    See Also
    --------
    deboom.Search, deboom.search

    Examples
    --------
    >>> import deboom
    >>> deboom.Until(gain=1e-3, over=20).over
    20
    """

    seconds: float | None = None
    gain: float | None = None
    over: int = 10
    evaluations: int | None = None

    def __post_init__(self) -> None:
        stated = (self.seconds, self.gain, self.evaluations)
        given = [value for value in stated if value is not None]
        if not given or min(given) <= 0 or self.over < 1:
            raise InputError(
                "a search ends after positive seconds or evaluations, or below a positive gain "
                "over at least 1 generation: such as Until(seconds=60), Until(evaluations=1000) "
                "or Until(gain=1e-3, over=10)"
            )

    def reached(self, hypervolume: list[float], seconds: float, n_evaluated: int) -> str | None:
        """Return why a search ends here, in words; None if it goes on."""
        if self.seconds is not None and seconds >= self.seconds:
            return f"ended after {self.seconds:g} s"
        if self.evaluations is not None and n_evaluated >= self.evaluations:
            return f"ended after {n_evaluated} evaluations"
        if self.gain is not None and len(hypervolume) > self.over:
            gain = 1.0 - hypervolume[-1 - self.over] / hypervolume[-1] if hypervolume[-1] else 0.0
            if gain < self.gain:
                return f"ended by a gain below {self.gain:g} over {self.over} generations"
        return None


@dataclass(frozen=True)
class Search:
    """How a front is searched: algorithm, budget, seed, and what follows.

    Parameters
    ----------
    population, generations : int
        Designs per generation, at least 4, and most generations, at least 1. Where gradients bring
        the whole front to convergence, without limits and `until`, the algorithm ends with the
        generation that completes `BEFORE_DESCENTS` evaluations; ``polish=False`` runs them all.
    seed : int
        Seed from 1; the same seed gives the same front for any number of workers. The global random
        generators are neither read nor moved.
    searches : int
        Seeds from `seed` upwards, whose fronts are merged; each also draws the designs that
        descents begin from, so that n searches take n times as long.
    algorithm : str or pymoo algorithm
        ``nsga2``, ``nsga3``, ``age-moea``, ``sms-emoa``, ``moead``, or an object of
        ``pymoo.algorithms.moo`` for several objectives, which is copied; its own population then
        counts.
    until : Until, optional
        What ends the search before its last generation: seconds, evaluations, or a hypervolume that
        stands still.
    polish : bool
        Whether gradients follow the algorithm; a model with ``smooth = False`` is left alone.

    Raises
    ------
    InputError
        A budget or a seed that cannot be.

    See Also
    --------
    deboom.search, deboom.Until, deboom.CheckpointFolder

    Examples
    --------
    >>> import deboom
    >>> deboom.Search(population=40, generations=30).seed
    1
    """

    population: int = 100
    generations: int = 100
    seed: int = 1
    searches: int = 1
    algorithm: str | Algorithm = "nsga2"
    until: Until | None = None
    polish: bool = True

    def __post_init__(self) -> None:
        checked_seed(self.seed)
        if self.population < 4 or self.generations < 1:
            raise InputError(
                f"a search with a population of {self.population} over {self.generations} "
                "generations cannot run: take at least 4 designs and 1 generation"
            )
        if self.searches < 1:
            raise InputError(f"{self.searches} searches find nothing: ask for at least one")


def nsga2(
    robust: RobustEvaluation,
    settings: Search = Search(),
    *,
    progress: Progress | None = None,
    checkpoint: Store | None = None,
    first_population: RealArray | None = None,
) -> SearchResult:
    """Search the Pareto front of all objectives with NSGA-II or another algorithm of pymoo.

    Population for population the same as pymoo's
    ``minimize(RobustProblem(robust), NSGA2(population), ("n_gen", generations), seed=seed)``, but
    that within limits the first design of all is today's, which may keep them; all generations are
    run, but for `Until`. Beyond it, every non-dominated design that was seen is kept. Whole-number
    variables get operators of their own: pymoo's treat options as if they had an order. A design
    beyond a limit never beats one that keeps them all; of two such designs the smaller sum of
    excesses, each relative to its bound, wins.

    Parameters
    ----------
    robust : RobustEvaluation
        Response such as `Robust`.
    settings : Search
        Algorithm, budget and seed of one search.
    progress : callable, optional
        Called after each generation.
    checkpoint : Store, optional
        Where evaluations are kept, and taken from when the search is started again.
    first_population : array, shape (n, k), optional
        Designs of the first generation, at least a population [units of the space]; drawn at random
        if None.

    Raises
    ------
    InputError
        A first population or an algorithm that cannot be; a first generation that fails
        altogether; limits that no design keeps; a checkpoint of another search.
    """
    population, generations, seed = settings.population, settings.generations, settings.seed
    if first_population is not None:
        first_population = checked_within(robust.space, first_population)
        if len(first_population) < population:
            raise InputError(
                f"a first population of {len(first_population)} designs does not fit a search "
                f"with a population of {population}: give at least as many"
            )
    runner, name = _algorithm(robust, settings, first_population)
    facts: dict[str, Any] = {
        "seed": seed,
        "population": population,
        "variables": list(robust.space.names),
        "first_population_sha256": None,
    }
    if name != "nsga2":
        facts["algorithm"] = name
    if first_population is not None:
        data = np.ascontiguousarray(first_population).tobytes()
        facts["first_population_sha256"] = hashlib.sha256(data).hexdigest()
    begun = time.perf_counter() - _seconds_before(checkpoint, facts)
    archive = _Archive(robust, checkpoint)
    problem = RobustProblem(archive, constraints=not isinstance(runner, MOEAD))
    stopped = None
    with _seeded_pymoo(seed):
        runner.setup(problem, termination=MaximumGenerationTermination(generations), seed=seed)
        while stopped is None and runner.has_next():
            runner.next()
            seconds = time.perf_counter() - begun
            if checkpoint is not None:
                checkpoint.save({**facts, "seconds": seconds})
            if progress is not None:
                progress(runner.n_gen - 1, generations, archive.summary(generations))
            if settings.until is not None:
                n_evaluated = sum(len(values) for values in archive.generations)
                stopped = settings.until.reached(archive.hypervolume, seconds, n_evaluated)
    n = len(archive.hypervolume)
    done = f"{n} generation{'s' if n > 1 else ''}"
    stopped = f"{done}, {stopped}" if stopped else done
    seconds = time.perf_counter() - begun
    if checkpoint is not None:
        checkpoint.save({**facts, "seconds": seconds, "stopped": stopped})
    return archive.result(
        seed,
        seconds,
        stopped=stopped,
        algorithm=SearchAlgorithm(name).label if name in ALGORITHMS else name,
    )


@contextmanager
def _seeded_pymoo(seed: int) -> Iterator[None]:
    """Seed the choices of pymoo that forget the state of their algorithm.

    NSGA-III compares infeasible designs, and picks among equals, by generators without a seed.
    """

    class Random:
        def __init__(self) -> None:
            self.stream = np.random.SeedSequence(seed)

        def __getattr__(self, name: str) -> Any:
            return getattr(np.random, name)

        def default_rng(self, seed: Any = None) -> np.random.Generator:
            return np.random.default_rng(self.stream.spawn(1)[0] if seed is None else seed)

    class Numpy:
        random = Random()

        def __getattr__(self, name: str) -> Any:
            return getattr(np, name)

    module: Any = pymoo.util
    before = module.np
    module.np = Numpy()
    try:
        yield
    finally:
        module.np = before


def _seconds_before(checkpoint: Store | None, facts: Mapping[str, Any]) -> float:
    """Wall time of the parts of a search before this one; refuses those of another search."""
    facts_before = checkpoint.load() if checkpoint is not None else None
    if facts_before is None:
        return 0.0
    for name, value in facts.items():
        if facts_before.get(name) != value:
            raise InputError(
                f"what was kept belongs to {name} {facts_before.get(name)!r}, not {value!r}: "
                "go on with the former or start anew"
            )
    return float(facts_before["seconds"])


class _Archive(RobustWrapper):
    """Hands designs on to a robust response, once per generation, and keeps all values."""

    def __init__(self, robust: RobustEvaluation, store: Store | None) -> None:
        self.robust = robust
        self.store = store
        self.front: RobustValues | None = None
        self.reference_point = np.empty(0)
        self.generations: list[RobustValues] = []
        self.hypervolume: list[float] = []

    def __call__(self, designs: RealArray) -> RobustValues:
        values = self._values(designs)
        if self.front is None:
            self.reference_point = _worst_objectives(values)
            self.front = pareto_front(values)
        else:
            self.front = pareto_front(self.front, values)
        self.generations.append(values)
        self.hypervolume.append(hypervolume(self.front.objectives, self.reference_point))
        return values

    def _values(self, designs: RealArray) -> RobustValues:
        if self.store is None:
            return self.robust(designs)
        number = len(self.generations) + 1
        kept = self.store.kept(number)
        if kept is not None and np.array_equal(kept["designs"], designs):
            values = kept_values(kept)
            if number == 1 and not _agrees(self.robust, values):
                raise InputError(
                    "what was kept was computed by another model or with other draws: its first "
                    "design has other values now; go on with the former or start anew"
                )
            return values
        values = self.robust(designs)
        columns = (column.name for column in fields(RobustValues))
        self.store.keep(number, {name: getattr(values, name) for name in columns})
        return values

    def summary(self, generations: int) -> str:
        """Return one line of text about the generations so far, of all that are planned."""
        n_failed = sum(int(values.failed.sum()) for values in self.generations)
        n_worse = sum(int((~values.failed & ~values.feasible).sum()) for values in self.generations)
        parts = [f"generation {len(self.generations)} of {generations}"]
        if self.front is not None and len(self.front) and np.isfinite(self.today):
            change = (self.front.mean_sum.min() - self.today) / self.front.mean.shape[1]
            units = getattr(self._innermost, "weighted_units", ("1",))
            unit = spread_unit(units[0])
            number = f"{change / self.n_lines:+.2g}" + (f" {unit}" if unit != "1" else "")
            if len(units) == 1:  # of several units nothing adds up
                parts.append(f"best mean {number}".replace("-", "−"))
        parts += [f"{n_failed} failed"] if n_failed else []
        parts += [f"{n_worse} beyond limits"] if n_worse else []
        return ", ".join(parts)

    @cached_property
    def today(self) -> float:
        """Mean of the nominal design, summed over the responses [unit of the responses]."""
        return float(self.robust(self.robust.space.nominal[np.newaxis, :]).mean_sum[0])

    @cached_property
    def n_lines(self) -> int:
        """Lines that each response is the sum of; 1 for a model that does not say."""
        return int(getattr(getattr(self._innermost, "evaluate", None), "n_lines", 1))

    @property
    def _innermost(self) -> Any:
        robust: Any = self.robust
        while hasattr(robust, "robust"):
            robust = robust.robust
        return robust

    def result(self, seed: int, seconds: float, *, stopped: str, algorithm: str) -> SearchResult:
        """Return what was found; refuse a search without a design that keeps all limits."""
        assert self.front is not None
        every = joined(self.generations)
        if len(self.front) == 0 and self.limits:
            infeasible = ~every.failed & ~every.feasible
            raise InputError(
                f"none of the {len(every)} designs of this search keeps all limits: "
                f"{self.limits.closest(every.excess[infeasible])}; relax that limit or widen the "
                "bounds of the design space"
            )
        return SearchResult(
            front=self.front,
            evaluated=every,
            hypervolume=np.asarray(self.hypervolume),
            reference_point=self.reference_point,
            seed=seed,
            seconds=seconds,
            stopped=stopped,
            algorithm=algorithm,
        )


def _worst_objectives(values: RobustValues) -> RealArray:
    if np.all(values.failed):
        raise InputError(
            f"none of the {len(values)} designs of the first generation could be computed, the "
            f"first one with '{values.message[0]}': evaluate the nominal design alone and check "
            "the bounds of the design space"
        )
    return np.asarray(values.objectives[~values.failed].max(axis=0))


ALGORITHMS = tuple(SearchAlgorithm)
"""Algorithms of pymoo by name; any other comes as an object of pymoo."""


def _algorithm(
    robust: RobustEvaluation, settings: Search, first: RealArray | None
) -> tuple[Algorithm, str]:
    """Return an algorithm that has not begun, and its name."""
    space, m = robust.space, robust.n_objectives
    algorithm, population = settings.algorithm, settings.population
    mixed = bool(space.integer.any())
    drawn = _sampling(_MixedSampling() if mixed else FloatRandomSampling(), robust)
    operators: dict[str, Any] = {"sampling": drawn if first is None else first}
    if mixed:
        operators |= {
            "crossover": _MixedCrossover(eta=15, prob=0.9),
            "mutation": _MixedMutation(eta=20),
        }
    if isinstance(algorithm, Algorithm):
        runner: Any = deepcopy(algorithm)
        name = type(algorithm).__name__
        modules = [kind.__module__ for kind in type(algorithm).__mro__]
        if any(module.startswith("pymoo.algorithms.soo") for module in modules):
            raise InputError(
                f"{name} minimises one objective, and this problem has {m}: take an algorithm of "
                f"pymoo.algorithms.moo, or one of {', '.join(ALGORITHMS)}"
            )
        sampling = runner.initialization.sampling
        if first is not None:
            runner.initialization.sampling = first
        elif isinstance(sampling, Sampling):
            runner.initialization.sampling = _sampling(sampling, robust)
        return runner, name
    if algorithm not in ALGORITHMS:
        raise InputError(
            f"there is no algorithm '{algorithm}': take one of {', '.join(ALGORITHMS)}, or an "
            "object of pymoo.algorithms.moo"
        )
    if algorithm == "moead":
        directions = _directions(m, population)
        if first is not None and len(first) != len(directions):
            raise InputError(
                f"MOEA/D begins with {len(directions)} designs here, one for each direction, not "
                f"with {len(first)}: give as many, or take another algorithm"
            )
        return ParallelMOEAD(
            directions, n_neighbors=min(20, len(directions)), **operators
        ), algorithm
    if algorithm == "nsga3":
        return NSGA3(_directions(m, population), pop_size=population, **operators), algorithm
    made = {"nsga2": NSGA2, "age-moea": AGEMOEA, "sms-emoa": SMSEMOA}[algorithm]
    return made(pop_size=population, **operators), algorithm


def _directions(m: int, population: int) -> RealArray:
    """Return as many evenly spaced directions in m objectives as a population has designs."""
    parts = 1
    while comb(parts + m, m - 1) <= population:
        parts += 1
    return np.asarray(get_reference_directions("das-dennis", m, n_partitions=parts))


class _TodayFirst(Sampling):
    """Draws a first population whose first design is today's."""

    def __init__(self, sampling: Sampling) -> None:
        super().__init__()
        self.sampling = sampling

    def _do(self, problem: Any, *args: Any, **kwargs: Any) -> RealArray:
        designs = np.array(self.sampling._do(problem, *args, **kwargs))
        designs[0] = problem.robust.space.nominal
        return designs


def _sampling(sampling: Sampling, robust: RobustEvaluation) -> Sampling:
    """Return a sampling, within limits one with today's design, which may keep them."""
    return _TodayFirst(sampling) if robust.limits else sampling


class _MixedSampling(FloatRandomSampling):
    """Draws whole-number variables evenly from their options."""

    def _do(self, problem: Any, *args: Any, random_state: Any = None, **kwargs: Any) -> RealArray:
        designs = super()._do(problem, *args, random_state=random_state, **kwargs)
        return _with_options(designs, problem.robust.space, random_state)


class _MixedCrossover(SBX):
    """Exchanges whole-number variables between the parents, never mixes them."""

    def _do(  # type: ignore[override]  # the base classes do not agree on its arguments
        self, problem: Any, X: RealArray, *args: Any, random_state: Any = None, **kwargs: Any
    ) -> RealArray:
        children = super()._do(problem, X, *args, random_state=random_state, **kwargs)
        whole = problem.robust.space.integer
        exchanged = random_state.random(X.shape[1:]) < 0.5
        children[:, :, whole] = np.where(exchanged, X[::-1], X)[:, :, whole]
        return np.asarray(children)


class _MixedMutation(PM):
    """Mutates a whole-number variable to any of its options."""

    def _do(  # type: ignore[override]  # the base classes do not agree on its arguments
        self, problem: Any, X: RealArray, *args: Any, random_state: Any = None, **kwargs: Any
    ) -> RealArray:
        mutated = super()._do(problem, X, *args, random_state=random_state, **kwargs)
        space, whole = problem.robust.space, problem.robust.space.integer
        chosen = random_state.random(X.shape) < 1.0 / space.n_variables
        drawn = _with_options(X, space, random_state)
        mutated[:, whole] = np.where(chosen, drawn, X)[:, whole]
        return np.asarray(mutated)


def _with_options(designs: RealArray, space: DesignSpace, random: Any) -> RealArray:
    """Designs (n, k) whose whole-number variables are drawn anew."""
    n_options = np.where(space.integer, space.upper - space.lower + 1.0, 0.0)
    drawn = space.lower + np.floor(random.random(designs.shape) * n_options)
    return np.where(space.integer, drawn, designs)


VERIFIED = 1024
"""Draws of each scramble behind a verified number."""
SHOWN = 200
"""Designs of a front that are verified and shown; of a longer one those that add least are left."""

BEFORE_DESCENTS = 800
"""Designs that an algorithm evaluates before descents bring the whole front to convergence, which
begin elsewhere and leave next to nothing of its front."""

Checkpoint = Callable[[int], Store]
"""Returns where the search of a seed is kept."""


def searched(
    robust: Robust,
    settings: Search = Search(),
    *,
    first_population: RealArray | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    checkpoint: Checkpoint | None = None,
) -> SearchResult:
    """Search with one seed or several, and merge what they found; arguments as for `search`.

    Of several searches the result has the merged front, and the convergence of the first one. A
    single search is `nsga2`'s, bit for bit.
    """
    seeds = range(settings.seed, settings.seed + settings.searches)
    with workers_for(robust, workers, scheduler) as spread:
        results = [
            nsga2(
                spread,
                replace(settings, seed=seed),
                progress=progress,
                checkpoint=checkpoint(seed) if checkpoint else None,
                first_population=first_population,
            )
            for seed in seeds
        ]
    first = results[0]
    if len(results) == 1:
        return first
    return replace(
        merge(results), hypervolume=first.hypervolume, reference_point=first.reference_point
    )


def search(
    robust: Robust,
    settings: Search = Search(),
    *,
    population: int | None = None,
    generations: int | None = None,
    seed: int | None = None,
    searches: int | None = None,
    limits: None = None,
    first_population: RealArray | pd.DataFrame | Front | None = None,
    algorithm: str | Algorithm | None = None,
    until: Until | None = None,
    polish: bool | None = None,
    shown: int | None = SHOWN,
    verified_with: int = VERIFIED,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | bool | None = None,
    checkpoint: Checkpoint | None = None,
) -> Front:
    """Search the robust front, let it converge, and verify it with new draws.

    NSGA-II keeps every evaluation. Gradients then improve the front, if the objectives are two
    means or sigmas, all designs share their draws, and no variable takes whole numbers only. For a
    model with exact gradients, such as a `deboom.BoomingModel` in prescribed or coupled motion, the
    whole front converges (`deboom.explore.descent.converged_front`), of more
    objectives the best of each; also within limits of means,
    sigmas and functions of the design, of which differences are taken where they have no
    ``gradient`` and are not marked by ``smooth = False``. For any other smooth model
    without limits, each `Pick` is improved along gradients from differences. In all other cases the
    picks are the best of all evaluated designs. Finally the designs that are shown are evaluated
    again with new draws.

    Parameters
    ----------
    robust : Robust
        Mean and scatter of the responses.
    settings : Search
        Algorithm, budget and seed, with their defaults.
    population, generations, seed, searches, algorithm, until, polish : optional
        Each replaces the one of `settings`; see `deboom.Search`.
    limits : None
        Refused: limits are those of ``Robust(limits=…)``.
    first_population : array, shape (n, k), DataFrame, Front or what `read_run` gives, optional
        Designs to begin with, any number [units of the space]; a Latin hypercube completes fewer
        than a population.
    shown : int or None
        Designs of the front that are verified, those that add most to it, beside all picks; None:
        the whole front as it was searched, and no other design.
    verified_with : int
        Draws of each of the four scrambles of the verification, a power of two. On six platforms
        σ was wrong by 0.02 to 0.08 % (rms) with 1024, and by 0.2 to 0.5 % with 256, which cost a
        quarter.
    workers : int
        Processes that evaluate a generation.
    scheduler : str, optional
        Address of a Dask cluster in their place, such as ``tcp://node7:8786``.
    progress : bool or callable, optional
        True shows a line in a notebook or terminal: ``generation 8 of 30, best mean −2.7 dB, 12 s
        left``. A callable gets the number of each generation, their count and a line of text.
    checkpoint : callable, optional
        Returns where the search of a seed is kept, such as
        ``deboom.CheckpointFolder("my_search")``: called again, an interrupted search goes on from
        there, descents included.

    Returns
    -------
    Front
        ``front.table``, one row per design: sums over responses and lines, and means per response
        and line; ``front.designs()`` [units of the space]; ``front.picks``.

    Raises
    ------
    InputError
        A budget, draws or a seed that cannot be; an algorithm for one objective; limits that no
        design keeps; a front that fails under the new draws: its evaluations are the error's
        ``search``.

    See Also
    --------
    deboom.Robust, deboom.Search, deboom.Until, deboom.explore.result.Front, deboom.verify
    deboom.compare

    Examples
    --------
    >>> import deboom
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> front = deboom.search(robust, population=8, generations=4)
    >>> round(float(front.pick_designs["best-mean"][0]), 2)
    0.9
    """
    if not isinstance(robust, Robust):
        raise InputError(
            f"{type(robust).__name__} cannot be verified: search a deboom.Robust, which also takes "
            "limits"
        )
    if limits is not None:
        raise InputError(
            "a search takes no limits: give them to the response, such as deboom.Robust(model, "
            "space, limits=[deboom.Objective('nominal', response=price).at_most(5.0)])"
        )
    given: dict[str, Any] = {
        "population": population,
        "generations": generations,
        "seed": seed,
        "searches": searches,
        "algorithm": algorithm,
        "until": until,
        "polish": polish,
    }
    given = {name: value for name, value in given.items() if value is not None}
    settings = replace(settings, **given)
    check_repeats(robust.evaluate, robust.space)
    begin = designs_of(first_population, robust.space)
    if begin is not None and len(begin) < settings.population:
        rest = latin_hypercube(robust.space, settings.population, seed=settings.seed)[len(begin) :]
        if robust.limits:
            rest[0] = robust.space.nominal
        begin = np.vstack([begin, rest])
    free = not robust.limits
    picks_improve = (
        settings.polish
        and free
        and robust.objectives[:2] == (MEAN_SUM, SIGMA_SUM)
        and gradients_of(robust) is not Gradients.none
    )
    pairs = _pairs_to_descend(robust) if settings.polish else []
    converges = bool(pairs) and robust.n_objectives == 2
    if settings.until is None and converges and free:
        settings = replace(settings, until=Until(evaluations=BEFORE_DESCENTS))
    with progress_shown(progress, "search") as told:
        result = searched(
            robust,
            settings,
            first_population=begin,
            workers=workers,
            scheduler=scheduler,
            progress=told,
            checkpoint=checkpoint,
        )
        within_limits = np.asarray(result.front.designs) if robust.limits else None
        for pair in pairs:
            for each in range(settings.seed, settings.seed + settings.searches):
                result = _with_descents(
                    robust,
                    pair,
                    result,
                    seed=each,
                    begin=within_limits,
                    progress=told,
                    store=checkpoint(each) if checkpoint else None,
                )
    rows = result.front
    if shown is not None:
        picked = _picked(robust, result.evaluated, polish=picks_improve)
        front = pareto_front(result.front, picked)
        result = replace(result, front=front)
        rows = _distinct(joined([thinned(front, shown), picked]))
    notes = []
    if settings.searches > 1:
        notes.append(f"The front is that of {settings.searches} searches with different seeds.")
    if pairs:
        what = "the whole front" if converges else "the best of each objective"
        notes.append(f"Descents along exact gradients then brought {what} to convergence.")
        differenced = by_differences(robust)
        if differenced:
            notes.append(f"Gradients of {_named(differenced)} came from differences.")
    if picks_improve and shown is not None and not converges:
        notes.append("Its picks then went on by gradient.")
    if settings.polish and not pairs and _pairs_to_descend(replace(robust, limits=Limits())):
        notes.append(
            f"Limits of {_named(without_gradient(robust))} have no gradient, so that the "
            "algorithm's designs are the front."
        )
    judge = replicates(robust, verified_with, seed=settings.seed)
    try:
        values = verified(rows, judge)
    except InputError as error:
        raise UnverifiedSearchError(
            f"{error}; the {result.n_evaluated} evaluated designs are kept: `search.evaluated` of "
            "this error, and the checkpoint of a run",
            result,
        ) from error
    return Front(
        robust=robust,
        search=result,
        searched=rows,
        values=values,
        judge=judge,
        note=" ".join(notes),
    )


def _named(limits: Sequence[Limit]) -> str:
    """Return the numbers that are limited, each once, in words."""
    return listed(list(dict.fromkeys(f"'{limit.number.name}'" for limit in limits)))


def _pairs_to_descend(robust: Robust) -> list[Robust]:
    """Return a response with the first and each other objective alone, if descents can follow."""
    first, *others = robust.objectives
    pairs = [robust]
    if len(others) > 1:
        pairs = [replace(robust, objectives=(first, other)) for other in others]
    return [pair for pair in pairs if gradients_of(pair) is Gradients.exact]


def _with_descents(
    robust: Robust,
    pair: Robust,
    result: SearchResult,
    *,
    seed: int,
    begin: RealArray | None,
    progress: Progress | None,
    store: Store | None,
) -> SearchResult:
    """Return a search whose front has converged by descents, which join its archive.

    - `pair`: two of its objectives alone, of which more have their best only converge.
    - `begin` (n, k), optional: designs within all limits that descents begin from too.
    - `store`, optional: where they are kept, as number 0, and taken from where they are the same.
    """
    begun = time.perf_counter()
    words = " ".join(pair.objective_labels).encode()
    mark = zlib.crc32(words + (b"" if begin is None else begin.tobytes()))
    values = _kept_descents(pair, store, mark)
    if values is None:
        values = converged_front(
            pair,
            seed=seed,
            begin=begin,
            ends_only=robust.n_objectives > 2,
            progress=progress,
        )
        if store is not None and len(values):
            columns = {each.name: getattr(values, each.name) for each in fields(RobustValues)}
            store.keep(0, {**columns, "began": np.full(len(values), mark)})
    if robust.n_objectives > 2:
        values = robust(values.designs)
    return replace(
        result,
        front=pareto_front(result.front, values),
        evaluated=joined([result.evaluated, values]),
        converged=robust.n_objectives == 2,
        seeds=(),
        seconds=result.seconds + time.perf_counter() - begun,
    )


def _kept_descents(robust: RobustEvaluation, store: Store | None, mark: int) -> RobustValues | None:
    """Return what descents found before; None unless they began alike, with the same model."""
    kept = None if store is None else store.kept(0)
    if kept is None or not np.all(kept.get("began", np.array([-1])) == mark):
        return None
    values = kept_values(kept)
    return values if _agrees(robust, values) else None


def _agrees(robust: RobustEvaluation, values: RobustValues) -> bool:
    """Say whether a response gives the first of kept values again."""
    first = chosen(values, [0])
    again = robust(first.designs).objectives
    return bool(np.allclose(again, first.objectives, rtol=1e-6, atol=0.0, equal_nan=True))


def _picked(robust: Robust, evaluated: RobustValues, *, polish: bool) -> RobustValues:
    """Return the picks of evaluated designs, perhaps improved; none of other objectives."""
    if not robust.begins_with_level_and_sigma:
        return chosen(evaluated, [])
    today = robust(robust.space.nominal[np.newaxis])
    if polish:
        return improved(robust, evaluated, today)
    return chosen(evaluated, sorted(set(pick(evaluated, today).values())))


def _distinct(values: RobustValues) -> RobustValues:
    """Return each design once, by the first objective."""
    order = np.lexsort([*values.designs.T, values.objectives[:, 0]])
    new = np.r_[True, np.any(np.diff(values.designs[order], axis=0) != 0.0, axis=1)]
    return chosen(values, order[new])
