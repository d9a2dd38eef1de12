"""DOE, correlation, robust front and sensitivities of one platform, in one study."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.correlation import tolerance_scatter
from deboom.explore.front import pareto_rank, verify
from deboom.explore.space import Evaluate
from deboom.explore.workers import workers_for
from deboom.report.page import Headline, Page, Section, Table
from deboom.study.correlation import (
    CorrelationStudy,
    DoeRequest,
    Levels,
    correlation_study,
    group_correlation_result,
    vehicle_correlation_result,
)
from deboom.study.options import Aim, Sampler, factor_space, robust_response, tolerance_sample
from deboom.study.platform_model import Kernel, Motion, Operation, motion_index
from deboom.study.progress import Progress
from deboom.study.result import RunContext, Scalar, StudyResult
from deboom.study.robust_front import RobustFront, robust_front_result
from deboom.study.search import Budget, robust_search
from deboom.study.sensitivity import Sensitivity, SensitivityPlan, sensitivity, sensitivity_result
from deboom.vehicles.booming_model import LoadCaseIndex

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
        See `deboom.study.platform_model.motion_index`.
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


NOTHING = "There is one vehicle only: nothing to correlate, and no DOE was run."


def platform_page(
    study: PlatformStudy,
    by_group: StudyResult | None,
    by_vehicle: StudyResult | None,
    front: StudyResult,
    sensitivities: StudyResult,
) -> Page:
    """Compose the page of the pages of the parts.

    Parameters
    ----------
    study : PlatformStudy
        Done.
    by_group, by_vehicle : StudyResult or None
        Correlation of groups, and of the vehicles of the group; None if there is nothing to
        correlate.
    front, sensitivities : StudyResult
        The other parts.
    """
    groups = () if by_group is None else by_group.page.headlines
    vehicles = () if by_vehicle is None else by_vehicle.page.headlines
    found, ranked = front.page.headlines, sensitivities.page.headlines
    parts = [part.page for part in (by_group, by_vehicle, front, sensitivities) if part is not None]
    alone = f"{study.front.vehicles[0]} is the only vehicle: there is none to compare it with."
    return Page(
        title=f"{study.front.platform.title}: one study",
        question=(
            "Which vehicles go together, which mount stiffnesses make those of group "
            f"{study.group} quiet and keep them so, and which stiffness matters?"
        ),
        headlines=(*groups[:1], *vehicles[:2], *found[:3], *ranked[:2]),
        terms=tuple(dict.fromkeys(term for part in parts for term in part.terms)),
        warnings=tuple(dict.fromkeys(warning for part in parts for warning in part.warnings)),
        sections=(
            _in_short(study, groups, vehicles, found, ranked),
            *_part(study, "DOE and groups", by_group, NOTHING),
            *_part(study, f"Vehicles of {study.group}", by_vehicle, alone, first=1),
            *_part(study, "Front", front),
            *_part(study, "Sensitivity", sensitivities),
        ),
    )


def _part(
    study: PlatformStudy, name: str, part: StudyResult | None, otherwise: str = "", first: int = 0
) -> tuple[Section, ...]:
    """Return the sections of a part, from the `first` one, under its name.

    The platform is described once, by the section in short.
    """
    if part is None:
        return (Section(name, otherwise),)
    said = _platform(study)
    return tuple(
        replace(
            section,
            title=f"{name} · {section.title}",
            text=section.text.removeprefix(f"{said}\n\n"),
        )
        for section in part.page.sections[first:]
    )


def _platform(study: PlatformStudy) -> str:
    platform = study.front.platform
    return f"{platform.title}: {platform.description}"


def _in_short(
    study: PlatformStudy,
    groups: Sequence[Headline],
    vehicles: Sequence[Headline],
    found: Sequence[Headline],
    ranked: Sequence[Headline],
) -> Section:
    """Say what was done in which step, and what came out."""
    front, sensitivity, doe = study.front, study.sensitivity, study.fleet
    tried = "no DOE"
    if doe is not None:
        tried = (
            f"{len(doe.doe)} designs ({doe.plan}), each as it is and made {study.plan.draws} "
            f"times, heard in {len(doe.names)} vehicles"
        )
    space, search = front.robust.space, front.search
    steps = (
        ("DOE and groups", tried, groups, NOTHING),
        (
            f"Vehicles of {study.group}",
            f"the same designs in {len(front.vehicles)} vehicles",
            vehicles,
            "one vehicle",
        ),
        (
            "Front",
            f"NSGA-II, {search.n_evaluated} designs with {front.robust.sample.n_samples} draws "
            f"each, within {space.lower.min():g} to {space.upper.max():g}; "
            f"{front.verification.n_samples} draws to verify",
            found,
            "",
        ),
        (
            "Sensitivity",
            f"{sensitivity.n_runs} designs, {sensitivity.label}, {sensitivity.indices.n_base} base "
            "points",
            ranked,
            "",
        ),
    )
    table = pd.DataFrame(
        [
            {"step": name, "what was done": done, "what came out": _answer(headlines) or otherwise}
            for name, done, headlines, otherwise in steps
        ]
    )
    return Section(
        "In short",
        f"{_platform(study)}\n\n"
        "All steps ask one model: the same forces, motion, lines and kernel. Every vehicle of the "
        f"platform hears the DOE; front and sensitivities are those of group {study.group}. DOE "
        f"and sensitivities keep within ±{100 * study.plan.half_width:g} %, the search within "
        f"±{100 * SEARCHED:g} %. {front.note}",
        tables=(Table(table, "The steps in the order of the work, which is that of this page."),),
    )


def _answer(headlines: Sequence[Headline]) -> str:
    return "; ".join(f"{headline.value} {headline.label}" for headline in headlines)


_T = TypeVar("_T")
SAME_DOE = ("doe", "n_designs", "n_failed", "n_unselected_fleets")
"""What the vehicles of a group would say of the DOE once more."""


def platform_result(study: PlatformStudy) -> StudyResult:
    """Make tables, figures, headline numbers and page of a platform study.

    Parameters
    ----------
    study : PlatformStudy
        Done.

    Returns
    -------
    StudyResult
        Everything that `robust_front_result`, `group_correlation_result`,
        `vehicle_correlation_result` and `sensitivity_result` return, under their names. Of a name
        that an earlier one of them has, the later gets a prefix: ``doe_``, ``within_group_`` or
        ``sobol_``.
    """
    fleet, vehicles = study.fleet, study.vehicles
    by_group = None if fleet is None else group_correlation_result(fleet)
    by_vehicle = (
        None if vehicles is None else _without_doe(vehicle_correlation_result(vehicles, None))
    )
    front = robust_front_result(study.front)
    ranked = sensitivity_result(study.sensitivity)
    by_prefix = {"": front, "doe_": by_group, "within_group_": by_vehicle, "sobol_": ranked}
    parts = {prefix: part for prefix, part in by_prefix.items() if part is not None}
    inputs = dict.fromkeys(path for part in parts.values() for path in part.inputs)
    facts: dict[str, Scalar] = {}
    for part in parts.values():
        facts = {**part.facts, **facts}
    return StudyResult(
        tables=_joined({prefix: part.tables for prefix, part in parts.items()}),
        figures=_joined({prefix: part.figures for prefix, part in parts.items()}),
        summary=_joined({prefix: part.summary for prefix, part in parts.items()}),
        page=platform_page(study, by_group, by_vehicle, front, ranked),
        inputs=tuple(inputs),
        facts=facts,
    )


def _without_doe(result: StudyResult) -> StudyResult:
    """Leave out what the correlation of groups says of the same DOE."""
    return replace(result, tables=_new(result.tables), summary=_new(result.summary))


def _new(part: Mapping[str, _T]) -> dict[str, _T]:
    return {name: value for name, value in part.items() if name not in SAME_DOE}


def _joined(parts: Mapping[str, Mapping[str, _T]]) -> dict[str, _T]:
    """Put parts into one mapping; a name that is taken gets the prefix of its part."""
    joined: dict[str, _T] = {}
    for prefix, part in parts.items():
        joined |= {prefix + name if name in joined else name: part[name] for name in part}
    return joined
