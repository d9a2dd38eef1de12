"""Which vehicles of a platform can share which mounts: limits, search, verification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.commonality import Commonality, fewest_part_numbers, separate_sets
from deboom.explore.correlation_study import correlations, families
from deboom.explore.design_space import DesignSpace
from deboom.explore.evaluate import responses
from deboom.explore.selection import variables_without_effect
from deboom.explore.shared_design import (
    OwnOptima,
    SharedDesign,
    SharingProblem,
    own_optima,
)
from deboom.explore.sharing import Sharing, SharingRules
from deboom.explore.space_filling import latin_hypercube
from deboom.explore.tolerance_samples import sobol_sample
from deboom.files.table_cells import read_rows
from deboom.report.style import mount_of
from deboom.study.mount_source import Operation
from deboom.study.progress import Progress
from deboom.vehicles.limit_responses import MeanLevel, ScatteredLevel
from deboom.vehicles.load_case_index import LoadCaseIndex

FAMILY_DESIGNS = 100
"""Designs of the correlation study that the search begins with."""
FAMILY_CUT = 0.9
"""Least correlation within a family [1]."""
SEARCH_DRAWS, VERIFYING_DRAWS = 128, 8192
"""Of the scatter: for the margin of the search, and for the check."""


@dataclass(frozen=True)
class CommonalityAims:
    """What is asked of shared mounts.

    Parameters
    ----------
    allowed : float
        Each vehicle may be louder than with mounts of its own by this [dB]; not used with a table.
    limits : Path or None
        Table of limits, columns ``vehicle, limit [dB(A)]``.
    share : float
        Of the cars of each vehicle that must keep its limit as their mounts scatter [1].
    starts : int
        Descents per vehicle for its own best.
    seed : int
        From 1.

    Raises
    ------
    InputError
        A negative allowance, a share outside 0.5 to 1.
    """

    allowed: float
    limits: Path | None
    share: float
    starts: int
    seed: int

    def __post_init__(self) -> None:
        if not self.allowed >= 0.0:
            raise InputError(f"--allowed {self.allowed:g}: sharing costs 0 dB or more")
        if not 0.5 <= self.share < 1.0:
            raise InputError(f"--share {self.share:g}: ask for at least half of the cars, below 1")


@dataclass(frozen=True, eq=False)
class CommonalityStudy:
    """Everything that the report says.

    Parameters
    ----------
    runs : Operation
    level : MeanLevel
        Mean level of each vehicle's lines.
    problem : SharingProblem
        Of `ScatteredLevel`. Limits are those of a car as drawn, the margin for scatter taken off
        [dB(A)].
    own : OwnOptima
    found : Commonality
    by_group : SharedDesign or None
        One set of mounts for each group of the platform; None with one group only.
    margin : array, shape (v,)
        Between a car as drawn and the asked quantile of cars as made [dB].
    shares : array, shape (v,)
        Of cars that keep their limit, counted with draws of its own [1].
    silent : tuple of str
        Variables that no vehicle hears.
    aims : CommonalityAims
    """

    runs: Operation
    level: MeanLevel
    problem: SharingProblem
    own: OwnOptima
    found: Commonality
    by_group: SharedDesign | None
    margin: RealArray
    shares: RealArray
    silent: tuple[str, ...]
    aims: CommonalityAims

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names, in the platform's order."""
        return self.problem.vehicles

    @property
    def today(self) -> RealArray:
        """Level of each vehicle with today's mounts, shape (v,) [dB(A)]."""
        return np.asarray(
            responses(self.problem.evaluate, self.problem.space.nominal[np.newaxis])[0]
        )

    def price(self, design: SharedDesign) -> RealArray:
        """Return what sharing costs each vehicle against mounts of its own, shape (v,) [dB]."""
        return np.asarray(design.levels - self.own.levels)


def commonality_study(
    runs: Operation,
    index: LoadCaseIndex[Any, Any],
    space: DesignSpace,
    aims: CommonalityAims,
    together: Sequence[str],
    apart: Sequence[str],
    progress: Progress,
) -> CommonalityStudy:
    """Find the fewest mount part numbers with which every vehicle keeps its limit.

    Parameters
    ----------
    runs : Operation
        Vehicles, load cases and band.
    index : LoadCaseIndex
        Of these runs, with a gradient.
    space : DesignSpace
        Of the stiffness factors, with their tolerances.
    aims : CommonalityAims
    together, apart : sequence of str
        Rules, such as ``TSM=U06-1,U06-2``.
    progress : callable

    Returns
    -------
    CommonalityStudy

    Raises
    ------
    InputError
        One vehicle only; a table of limits that lacks a vehicle, or a limit that a vehicle misses
        even with mounts of its own; see `fewest_part_numbers`.
    """
    with threadpool_limits(1):  # threads may change the last bit of an optimum
        level = MeanLevel(index)
        vehicles = level.response_names
        if len(vehicles) < 2:
            raise InputError(f"only vehicle {vehicles[0]} was asked for: sharing needs two")
        parts = {
            mount: [name for name in space.names if mount_of(name) == mount]
            for mount in dict.fromkeys(mount_of(name) for name in space.names)
        }
        rules = SharingRules(_rule("--together", together), _rule("--apart", apart))
        rules.check(tuple(parts), vehicles)
        stated = None if aims.limits is None else _table_limits(aims.limits, vehicles)
        silent = variables_without_effect(level, space)
        fixed = np.isin(space.names, silent)
        searched = replace(
            space,
            lower=np.where(fixed, space.nominal, space.lower),
            upper=np.where(fixed, space.nominal, space.upper),
        )
        progress(0, 4, "mounts of its own for each vehicle")
        drawn = ScatteredLevel(index, space.nominal, space.relative_sigma)
        own = own_optima(drawn, searched, starts=aims.starts, seed=aims.seed)
        draws = sobol_sample(space.n_variables, SEARCH_DRAWS, seed=aims.seed).values
        margin = _margin(level, space, own, draws, aims.share)
        limits = own.levels + aims.allowed
        if stated is not None:
            _refuse_missed(aims, vehicles, stated, own.levels + margin)
            limits = stated - margin
        problem = SharingProblem(drawn, searched, parts, limits, rules)
        progress(1, 4, "families of the correlation study")
        guesses = _guesses(runs, problem, aims.seed)
        found = fewest_part_numbers(
            problem, own, list(guesses.values()), lambda _done, _all, text: progress(2, 4, text)
        )
        progress(3, 4, "verification")
        by_group = None
        if "groups" in guesses:
            by_group = separate_sets(problem, own, guesses["groups"])
        check = sobol_sample(
            space.n_variables, VERIFYING_DRAWS, seed=aims.seed, purpose="verification sample"
        ).values
        shares = _shares(level, space, found.fewest.designs, check, limits + margin)
        progress(4, 4, "done")
        return CommonalityStudy(
            runs, level, problem, own, found, by_group, margin, shares, silent, aims
        )


def _rule(option: str, texts: Sequence[str]) -> dict[str, list[list[str]]]:
    """Read ``TSM=U06-1,U06-2``."""
    rules: dict[str, list[list[str]]] = {}
    for text in texts:
        part, mark, names = text.partition("=")
        vehicles = [name.strip() for name in names.split(",") if name.strip()]
        if not mark or len(vehicles) < 2:
            raise InputError(
                f"{option} '{text}': write a mount and at least two vehicles, TSM=U06-1,U06-2"
            )
        rules.setdefault(part.strip(), []).append(vehicles)
    return rules


def _table_limits(path: Path, vehicles: Sequence[str]) -> RealArray:
    limits: dict[str, float] = {}
    for row in read_rows(path, ("vehicle",), {"limit": "dB(A)"}):
        name = row.filled("vehicle")
        if name in limits or name not in vehicles:
            raise row.error(f"'{name}' is named twice or is none of {list(vehicles)}")
        limits[name] = row.number("limit")
    missing = [name for name in vehicles if name not in limits]
    if missing:
        raise InputError(f"{path}: there is no limit for {missing}: give every vehicle one")
    return np.array([limits[name] for name in vehicles])


def _refuse_missed(
    aims: CommonalityAims, vehicles: Sequence[str], limits: RealArray, kept: RealArray
) -> None:
    """Refuse limits that vehicles miss with mounts of their own, both (v,) [dB(A)]."""
    missed = kept - limits
    binding = int(np.argmax(missed))
    if missed[binding] > 0.0:
        raise InputError(
            f"{aims.limits}: {vehicles[binding]} cannot keep its limit of {limits[binding]:.4g} "
            f"dB(A): with mounts of its own {aims.share:.0%} of the cars reach "
            f"{kept[binding]:.4g} dB(A), {missed[binding]:.3g} dB too much; "
            f"{int((missed > 0.0).sum())} of {missed.size} vehicles miss theirs: raise the limits, "
            "or widen the bounds (--half-width)"
        )


def _scattered(
    level: MeanLevel, space: DesignSpace, design: RealArray, draws: RealArray, vehicle: int
) -> RealArray:
    """Level of cars of one vehicle as they are made, shape (n,) [dB(A)]."""
    made = design * (1.0 + space.relative_sigma * draws)
    return responses(level, made)[:, vehicle]


def _margin(
    level: MeanLevel, space: DesignSpace, own: OwnOptima, draws: RealArray, share: float
) -> RealArray:
    """Asked quantile of the cars as made less the car as drawn, shape (v,) [dB]."""
    made = [
        np.quantile(_scattered(level, space, design, draws, vehicle), share)
        for vehicle, design in enumerate(own.designs)
    ]
    return np.asarray(np.array(made) - own.levels)


def _shares(
    level: MeanLevel, space: DesignSpace, designs: RealArray, draws: RealArray, limits: RealArray
) -> RealArray:
    return np.array(
        [
            np.mean(_scattered(level, space, design, draws, vehicle) <= limits[vehicle])
            for vehicle, design in enumerate(designs)
        ]
    )


def _guesses(runs: Operation, problem: SharingProblem, seed: int) -> dict[str, Sharing]:
    """Sharings by the families of a correlation study and by the platform's groups."""
    designs = latin_hypercube(problem.space, FAMILY_DESIGNS, seed=seed)
    levels = responses(problem.evaluate, designs)
    found = correlations(levels, problem.vehicles, seed=seed, resamples=100)
    members = families(problem.vehicles, found.pearson, FAMILY_CUT).members
    family = {name: place for place, names in enumerate(members) for name in names}
    group_of = {vehicle.name: vehicle.group for vehicle in runs.fleet.vehicles}
    groups = list(dict.fromkeys(group_of.values()))
    guesses = {"families": [family[name] for name in problem.vehicles]}
    if len(groups) > 1:
        guesses["groups"] = [groups.index(group_of[name]) for name in problem.vehicles]
    rows = len(problem.part_names)
    return {
        name: Sharing(problem.part_names, problem.vehicles, np.tile(numbers, (rows, 1)))
        for name, numbers in guesses.items()
    }
