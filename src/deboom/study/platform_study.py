"""DOE, correlation, robust front and sensitivities of one platform, in one study."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.correlation_study import tolerance_scatter
from deboom.explore.evaluate import Evaluate
from deboom.explore.fronts import pareto_rank, verify
from deboom.explore.workers import workers_for
from deboom.study.aims import Aim, robust_response
from deboom.study.context import RunContext
from deboom.study.correlation import CorrelationStudy, Levels, correlation_study
from deboom.study.doe import DoeRequest
from deboom.study.motion import Kernel, Motion, motion_index
from deboom.study.mount_source import Operation
from deboom.study.progress import Progress
from deboom.study.robust_front import RobustFront
from deboom.study.robust_search import Budget, robust_search
from deboom.study.sampling import Sampler, factor_space, tolerance_sample
from deboom.study.sensitivity import Sensitivity, SensitivityPlan, sensitivity
from deboom.vehicles.load_case_index import LoadCaseIndex

SEARCHED = 0.20
"""Stiffness factors of the search run within ``1 ± SEARCHED`` [1]."""
VERIFIED = 1024
"""Draws behind the verified front."""
FAMILY = 0.9
"""Least correlation within a family of vehicles [1]."""
FROM_DOE = (
    "Its first population were the best designs of the DOE, by non-dominated fronts of mean and "
    "sigma over the DOE's tolerance draws."
)


@dataclass(frozen=True)
class DoePlan:
    """Which designs are tried, and how they are correlated.

    Parameters
    ----------
    request : DoeRequest
        The designs, with the seed of everything that is drawn.
    half_width : float
        They lie within ``1 ± half_width`` [1].
    tolerance : float
        Half width of the scatter, three standard deviations [1].
    draws : int
        Of the scatter per design, a power of two.
    resamples : int
        Of the bootstrap.
    """

    request: DoeRequest
    half_width: float
    tolerance: float
    draws: int
    resamples: int


@dataclass(frozen=True)
class FrontPlan:
    """How a front is searched.

    Parameters
    ----------
    budget : Budget
        How long.
    samples : int
        Tolerance draws per design, a power of two.
    from_doe : bool
        Whether the first population are the best designs of the DOE.
    workers : int
        Processes.
    """

    budget: Budget
    samples: int
    from_doe: bool
    workers: int


@dataclass(frozen=True, eq=False)
class PlatformStudy:
    """Everything that was asked of one platform, in the order of the work.

    All parts ask one model: the same forces, motion, lines and kernel.

    Parameters
    ----------
    group : str
        Whose vehicles the front serves.
    plan : DoePlan
        Of the DOE.
    fleet : CorrelationStudy or None
        The DOE in all vehicles of the platform; None if there is only one.
    vehicles : CorrelationStudy or None
        The same designs in the vehicles of the group; None if there is only one.
    front : RobustFront
        Of the group.
    sensitivity : Sensitivity
        Of the group.
    """

    group: str
    plan: DoePlan
    fleet: CorrelationStudy | None
    vehicles: CorrelationStudy | None
    front: RobustFront
    sensitivity: Sensitivity


def platform_study(
    everyone: Operation,
    group: str,
    model: tuple[Motion, Kernel | None],
    doe: DoePlan,
    search: FrontPlan,
    sensitivities: SensitivityPlan,
    run: RunContext | None,
    progress: Callable[[str], AbstractContextManager[Progress]],
) -> PlatformStudy:
    """Try a DOE in all vehicles, then search the front of a group and rank its variables.

    Parameters
    ----------
    everyone : Operation
        With all vehicles of the platform.
    group : str
        Vehicles of the front and of the sensitivities.
    model : (Motion, Kernel or None)
        See `deboom.study.motion.motion_index`.
    doe, search, sensitivities
        The plans; the seed and the tolerance of the search are those of the DOE.
    run : RunContext or None
        Where the search is kept.
    progress : callable
        From a title to a context that shows progress.

    Raises
    ------
    InputError
        An unknown group; a plan that a step refuses.
    """
    motion, kernel = model
    runs = replace(everyone, fleet=everyone.fleet.group(group))
    index = motion_index(runs, motion, kernel)
    fleet = fleet_doe(everyone, motion_index(everyone, motion, kernel), doe, motion.value)
    with progress("NSGA-II") as bar:
        front = _front(runs, index, doe, search, bar, run)
    with progress("sensitivity") as bar:
        ranked = sensitivity(runs.platform, index, sensitivities, bar)
    return PlatformStudy(
        group=group,
        plan=doe,
        fleet=fleet,
        vehicles=within_group(fleet, runs, index),
        front=front,
        sensitivity=ranked,
    )


def _front(
    runs: Operation,
    index: LoadCaseIndex[Any, Any],
    doe: DoePlan,
    plan: FrontPlan,
    progress: Progress,
    run: RunContext | None,
) -> RobustFront:
    """Search and verify as the study of the front alone does."""
    seed, budget = doe.request.seed, plan.budget
    space = factor_space(index.variable_names, SEARCHED, doe.tolerance)
    sample = tolerance_sample(Sampler.sobol, space.n_variables, plan.samples, seed=seed)
    robust = robust_response(index, space, sample, Aim.mean, False, False)
    first = best_of_doe(index, doe, budget.population) if plan.from_doe else None
    files = runs.platform.input_files
    with workers_for(robust, plan.workers, None) as spread:
        found = robust_search(
            spread, robust, budget, seed, progress, run, files, first_population=first
        )
    check = verify(found.front, robust, n_samples=VERIFIED, seed=seed)
    note = " ".join(filter(None, (budget.note, FROM_DOE if plan.from_doe else "")))
    return RobustFront(runs.platform, index, robust, found, check, note)


def fleet_doe(
    runs: Operation, index: LoadCaseIndex[Any, Any], plan: DoePlan, motion: str
) -> CorrelationStudy | None:
    """Try the designs of a DOE in all vehicles.

    Parameters
    ----------
    runs : Operation
        With all vehicles of the platform.
    index : LoadCaseIndex
        Of these runs.
    plan : DoePlan
        Which designs.
    motion : str
        Of the powertrain, for the name of the DOE.

    Returns
    -------
    CorrelationStudy or None
        None for a single vehicle.

    Raises
    ------
    InputError
        See `deboom.study.correlation.correlation_study`.
    """
    if len(index.response_names) < 2:
        return None
    return correlation_study(
        runs,
        index,
        plan.request,
        motion=motion,
        half_width=plan.half_width,
        tolerance=plan.tolerance,
        draws=plan.draws,
        resamples=plan.resamples,
        cut=FAMILY,
    )


def within_group(
    study: CorrelationStudy | None, runs: Operation, index: LoadCaseIndex[Any, Any]
) -> CorrelationStudy | None:
    """Return the part of a fleet's DOE that some of its vehicles heard; nothing is run again.

    Parameters
    ----------
    study : CorrelationStudy or None
        Of all vehicles.
    runs : Operation
        With the vehicles that are wanted.
    index : LoadCaseIndex
        Of these runs.

    Returns
    -------
    CorrelationStudy or None
        None for a single vehicle.
    """
    names = index.response_names
    if study is None or len(names) < 2:
        return None
    heard, columns = study.vehicles, [study.names.index(name) for name in names]
    levels = Levels(
        names, heard.designs[:, columns], heard.means[:, columns], heard.scatter[..., columns]
    )
    return replace(study, runs=runs, index=index, vehicles=levels)


def best_of_doe(evaluate: Evaluate, plan: DoePlan, population: int) -> RealArray:
    """Return the designs of a DOE that a search may begin with.

    Parameters
    ----------
    evaluate : Evaluate
        The model, with the vehicles that the search serves.
    plan : DoePlan
        The DOE.
    population : int
        Designs that are wanted.

    Returns
    -------
    array, shape (population, k)
        Front by front of the sums over the vehicles of mean and sigma, in the DOE's order within a
        front [1].

    Raises
    ------
    InputError
        Fewer designs that could be computed than wanted.
    """
    space = factor_space(evaluate.variable_names, plan.half_width, plan.tolerance)
    designs = plan.request.designs(space)
    mean, scatter = tolerance_scatter(
        evaluate, space, designs, n_draws=plan.draws, seed=plan.request.seed
    )
    objectives = np.column_stack([mean.sum(axis=1), scatter.std(axis=1, ddof=1).sum(axis=1)])
    computed = np.isfinite(objectives).all(axis=1)
    if computed.sum() < population:
        raise InputError(
            f"the DOE has {computed.sum()} designs that could be computed, too few for a first "
            f"population of {population}: take a larger DOE or a smaller population"
        )
    order = np.argsort(pareto_rank(objectives[computed]), kind="stable")
    return np.asarray(designs[computed][order[:population]])
