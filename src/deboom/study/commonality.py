"""Which vehicles of a platform can share which mounts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom import plot as figures
from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.commonality import Commonality, fewest_part_numbers, separate_sets
from deboom.explore.correlation import correlations, families
from deboom.explore.doe import latin_hypercube
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import variables_without_effect
from deboom.explore.sharing import (
    OwnOptima,
    SharedDesign,
    Sharing,
    SharingProblem,
    SharingRules,
    own_optima,
)
from deboom.explore.space import DesignSpace, responses
from deboom.files.tables import read_rows
from deboom.plot.style import mount_of, signed
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.platform_model import Operation, motion_report
from deboom.study.progress import Progress
from deboom.study.result import Scalar, StudyResult
from deboom.study.supplier_study import letters
from deboom.vehicles.booming_model import LoadCaseIndex
from deboom.vehicles.limit_responses import MeanLevel, ScatteredLevel

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


TERMS = ("booming noise", "SPLV", "stiffness factor", "tolerance")
PERCENT = 100.0


def commonality_result(study: CommonalityStudy) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    study : CommonalityStudy

    Returns
    -------
    StudyResult
        Tables ``part_numbers``, ``vehicles``, ``counts``.
    """
    tables = {
        "part_numbers": part_table(study),
        "vehicles": vehicle_table(study),
        "counts": count_table(study),
    }
    pictures = commonality_figures(study)
    summary = commonality_summary(study)
    table = (study.aims.limits,) if study.aims.limits else ()
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures, summary),
        inputs=(*study.runs.platform.input_files, *table),
        facts={"kernel": study.level.index.kernel.name},
    )


def part_table(study: CommonalityStudy) -> pd.DataFrame:
    """One row per part number and axis: its stiffness factor and its vehicles."""
    chosen, space = study.found.fewest, study.problem.space
    rows: list[dict[str, object]] = []
    for part, (mount, columns) in enumerate(
        zip(study.problem.part_names, study.problem.columns, strict=True)
    ):
        for number in range(chosen.sharing.counts[part]):
            holder = np.flatnonzero(chosen.sharing.numbers[part] == number)[0]
            for column in columns:
                heard = space.names[column] not in study.silent
                factor = chosen.designs[holder, column] if heard else np.nan
                rows.append(
                    {
                        "part number": f"{mount} {letters(number)}",
                        "direction": space.names[column],
                        "stiffness factor [1]": factor,
                        "vehicles": ", ".join(chosen.sharing.members(part, number)),
                    }
                )
    return pd.DataFrame(rows)


def vehicle_table(study: CommonalityStudy) -> pd.DataFrame:
    """One row per vehicle: today, with mounts of its own, with shared ones, and its limit."""
    chosen = study.found.fewest
    return pd.DataFrame(
        {
            "vehicle": study.vehicles,
            "today [dB(A)]": study.today,
            "own mounts [dB(A)]": study.own.levels,
            "shared mounts [dB(A)]": chosen.levels,
            "limit as drawn [dB(A)]": study.problem.limits,
            "margin for scatter [dB]": study.margin,
            "price of sharing [dB]": study.price(chosen),
            "change against today [dB]": chosen.levels - study.today,
            "cars within the limit [%]": PERCENT * study.shares,
        }
    )


def count_table(study: CommonalityStudy) -> pd.DataFrame:
    """One row per count of part numbers that is worth its numbers, and the comparisons."""
    named = [(str(one.sharing.total), one) for one in study.found.by_count]
    if study.by_group is not None:
        named.append((f"{study.by_group.sharing.total}, one set per group", study.by_group))
    n_own = len(study.problem.part_names) * len(study.vehicles)
    rows = [_count_row(study, name, one) for name, one in named]
    rows.append({"part numbers": f"{n_own}, every vehicle its own", "worst price [dB]": 0.0})
    rows[-1] |= {"mean price [dB]": 0.0, "dearest for": "", "worst excess [dB]": _own_excess(study)}
    return pd.DataFrame(rows)


def _own_excess(study: CommonalityStudy) -> float:
    return float((study.own.levels - study.problem.limits).max())


def _count_row(study: CommonalityStudy, name: str, one: SharedDesign) -> dict[str, object]:
    price = study.price(one)
    counts = zip(study.problem.part_names, one.sharing.counts, strict=True)
    return {
        "part numbers": name,
        **{f"of {mount}": count for mount, count in counts},
        "worst price [dB]": float(price.max()),
        "dearest for": study.vehicles[int(np.argmax(price))],
        "mean price [dB]": float(price.mean()),
        "worst excess [dB]": one.worst,
    }


def commonality_summary(study: CommonalityStudy) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    chosen, found = study.found.fewest, study.found
    price = study.price(chosen)
    summary: dict[str, Scalar] = {
        "part_numbers_min": chosen.sharing.total,
        "part_numbers_lower_bound": found.lower_bound,
        "part_numbers_own": len(study.problem.part_names) * len(study.vehicles),
        "price_db": float(price.mean()),
        "price_worst_db": float(price.max()),
        "price_worst_vehicle": study.vehicles[int(np.argmax(price))],
        "one_set_price_worst_db": float(study.price(found.by_count[0]).max()),
        "change_db_per_line_mean": float((chosen.levels - study.today).mean()),
        "share_verified_min": float(study.shares.min()),
    }
    if study.by_group is not None:
        summary["group_sets_part_numbers"] = study.by_group.sharing.total
        summary["group_sets_price_worst_db"] = float(study.price(study.by_group).max())
    return summary


def commonality_figures(study: CommonalityStudy) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    counts = np.array([one.sharing.total for one in study.found.by_count], dtype=float)
    worst = np.array([study.price(one).max() for one in study.found.by_count])
    mean = np.array([study.price(one).mean() for one in study.found.by_count])
    chosen, group = study.found.fewest, study.by_group
    marks = {}
    if group is not None:
        price = float(study.price(group).max())
        marks["one set per group, worst vehicle"] = (float(group.sharing.total), price)
    labels = np.array([[letters(number) for number in row] for row in chosen.sharing.numbers])
    return {
        "price": figures.fronts(
            {"worst vehicle": (counts, worst), "mean of the vehicles": (counts, mean)},
            {},
            marks,
            mean_label="mount part numbers in all",
            sigma_label="level above mounts of its own [dB]",
        ),
        "sharing": figures.shared_parts(study.problem.part_names, study.vehicles, labels),
    }


def _page(
    study: CommonalityStudy,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
    summary: Mapping[str, Scalar],
) -> Page:
    chosen, aims = study.found.fewest, study.aims
    total, bound = chosen.sharing.total, study.found.lower_bound
    proof = (
        "No sharing has fewer, as far as descents from several starts find the best values."
        if total == bound
        else f"Fewer than {bound} are impossible, as far as descents from several starts find the "
        f"best values; between {bound} and {total} the search found none."
    )
    asked = (
        f"the limits of {aims.limits.name}"
        if aims.limits
        else f"{aims.allowed:g} dB above what mounts of its own would give it"
    )
    one_set = float(summary["one_set_price_worst_db"])
    return Page(
        title="Mounts that vehicles can share",
        question=(
            f"How few mount part numbers serve {len(study.vehicles)} vehicles, if {aims.share:.0%} "
            f"of the cars of each are to keep {asked}?"
        ),
        headlines=(
            Headline(f"{total}", f"part numbers instead of {summary['part_numbers_own']}"),
            Headline(f"{signed(float(summary['price_db']), 2)} dB", "mean price of sharing"),
            Headline(
                f"{signed(float(summary['price_worst_db']), 2)} dB",
                f"for {summary['price_worst_vehicle']}, the worst",
            ),
            Headline(
                f"{signed(float(summary['change_db_per_line_mean']), 2)} dB",
                "mean change against today",
            ),
        ),
        terms=TERMS,
        warnings=(
            *_not_kept(study),
            *motion_report(study.level.index, chosen.designs).warnings,
        ),
        sections=(
            Section(
                "Which vehicle has which mount",
                f"{proof} A letter is a part number of the mount in that row; vehicles with one "
                "letter share it in all directions.",
                figures=(
                    Picture(
                        pictures["sharing"],
                        "Part number of each mount in each vehicle",
                        "Equal letters are equal parts.",
                    ),
                ),
                tables=(
                    Table(
                        tables["part_numbers"],
                        "Values of the part numbers; a direction without a number is heard by no "
                        "vehicle, any stiffness within the bounds serves.",
                        {"stiffness factor [1]": 3},
                    ),
                ),
            ),
            Section(
                "What sharing costs",
                "A vehicle with mounts of its own is the zero line. One set for all vehicles costs "
                f"the worst of them {one_set:.2f} dB per line; every further part number buys some "
                "of it back. Counts that buy nothing are left out.",
                figures=(
                    Picture(
                        pictures["price"],
                        "Price of sharing over the count of part numbers",
                        f"Price against part numbers; {total} keep every limit.",
                    ),
                ),
                tables=(
                    Table(
                        tables["counts"],
                        "Best sharing found for each count, with values that keep the worst "
                        "vehicle low; those of the chosen one are then moved until all vehicles "
                        "together are as quiet as their limits allow. The excess is beyond the "
                        "limit, negative where room is left.",
                    ),
                    Table(
                        tables["vehicles"],
                        "Mean level of the lines, each with the energy that scatter adds: a notch "
                        "that no made part has is no gain. The limit is that of a car as drawn: "
                        "the margin between it and the asked share of cars as made is taken off. "
                        "The last column counts cars with draws of its own.",
                    ),
                ),
            ),
        ),
    )


def _not_kept(study: CommonalityStudy) -> tuple[str, ...]:
    """Warn of vehicles whose cars, counted with draws of its own, miss the asked share."""
    pairs = zip(study.vehicles, study.shares, strict=True)
    short = [
        f"{name} ({PERCENT * share:.1f} %)" for name, share in pairs if share < study.aims.share
    ]
    if not short:
        return ()
    return (
        f"New draws find fewer than {study.aims.share:.0%} of the cars within the limit: "
        f"{', '.join(short)}. The margin for scatter is that of mounts of its own.",
    )
