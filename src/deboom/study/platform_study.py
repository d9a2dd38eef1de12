"""DOE, correlation, robust front and sensitivities of one platform, in one study."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deboom.errors import InputError
from deboom.explore.correlation_study import tolerance_scatter
from deboom.explore.design_space import DesignSpace
from deboom.explore.evaluate import Evaluate
from deboom.explore.fronts import pareto_rank
from deboom.physics.arrays import RealArray
from deboom.study.correlation import CorrelationStudy, Levels, correlation_study
from deboom.study.doe import DoeRequest
from deboom.study.mount_source import Operation
from deboom.study.robust_front import RobustFront
from deboom.study.sensitivity import Sensitivity
from deboom.vehicles.load_case_index import LoadCaseIndex

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


def best_of_doe(
    evaluate: Evaluate, space: DesignSpace, plan: DoePlan, population: int
) -> RealArray:
    """Return the designs of a DOE that a search may begin with.

    Parameters
    ----------
    evaluate : Evaluate
        The model, with the vehicles that the search serves.
    space : DesignSpace
        Of the search.
    plan : DoePlan
        The DOE.
    population : int
        Designs that are wanted.

    Returns
    -------
    array, shape (population, k)
        Front by front of the sums over the vehicles of mean and sigma, in the DOE's order within a
        front [units of the space].

    Raises
    ------
    InputError
        Fewer designs that could be computed than wanted.
    """
    bounds = replace(space, lower=1.0 - plan.half_width + 0.0 * space.lower,
                     upper=1.0 + plan.half_width + 0.0 * space.upper)
    designs = plan.request.designs(bounds)
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
