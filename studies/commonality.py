"""Which vehicles of the platform can share which mounts, and what does sharing cost?

Each vehicle would be quietest with its own set of mounts, but a platform needs few part numbers.
The study finds the smallest number of part numbers, of all mounts together, with which every
vehicle keeps its limit. The limit is --allowed dB per line above the level with its own mounts, or
comes from a table. Levels include the energy that scatter adds to each line, so a notch that real
parts do not have counts for nothing. The study first tries one set per group. Then an integer
program chooses which vehicles share a part, and gradients improve the stiffness of each part.

Keys of summary.json: part_numbers_min, part_numbers_lower_bound (fewer are impossible),
part_numbers_own (nothing shared); price_db, price_worst_db, price_worst_vehicle (level above
mounts of its own, mean over the vehicles and worst); one_set_price_worst_db (one set for all);
group_sets_part_numbers, group_sets_price_worst_db (one set per group);
change_db_per_line_mean (against today's mounts); expected_change_db_<vehicle>,
expected_change_db_mean, expected_change_db_worst, the same with _low and _high (shared mounts in
cars as they are, 90 %); share_verified_min (of the cars of a vehicle
within its limit); surface_difference_at_peaks_db (library against spectra).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from openpyxl.utils import get_column_letter
from typer import Option

from deboom import plot
from deboom.arrays import RealArray
from deboom.common import PERCENT, Progress
from deboom.errors import InputError
from deboom.explore.commonality import fewest_part_numbers, separate_sets
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import variables_without_effect
from deboom.explore.sharing import (
    SeparateOptima,
    SharedDesign,
    Sharing,
    SharingProblem,
    check_together,
    separate_optima,
)
from deboom.explore.space import DesignSpace, responses
from deboom.files.uncertain_index import uncertain_index
from deboom.pages.front_answer import (
    abbreviations,
    expected_column,
    expected_numbers,
    expected_on_average,
    expected_sentence,
    report_expected,
)
from deboom.pages.motion import motion_report, report_runs
from deboom.plot.style import mount_of, signed
from deboom.progress import progress_bar
from deboom.report import Report, Step, Table
from deboom.runs.made_parts import rows_of
from deboom.runs.options import Bounds, Seed, Tolerance, at_least
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.runs.result import RunContext, run_name
from deboom.vehicles.design_factor import factor_space
from deboom.vehicles.expected_change import ExpectedChange, expected_or_why
from deboom.vehicles.limits import MeanLevel, ScatteredLevel
from deboom.vehicles.platform import Runs

DRAWS = 8192
"""Of the scatter: for the margin of the search, and others for the check."""
SURE = 3.0
"""Standard errors of the share of `DRAWS` by which the search asks for more than --share."""
ROUNDS = 5
"""Searches at most; each takes the margin that the sharing before it turned out to need."""


MOST_VEHICLES = 20
"""Vehicles of the first screen's table, those that pay most."""


@dataclass(frozen=True)
class Options:
    """What sharing may cost, who may share, and for how long is searched."""

    seed: Seed = 1
    allowed: Annotated[
        float, Option(help="Allowed rise above the level with own mounts, per line [dB].")
    ] = 0.5
    limits: Annotated[
        Path | None,
        Option(help="Table with the columns vehicle and limit [dB(A)], in place of --allowed."),
    ] = None
    share: Annotated[float, Option(help="Share of cars that keep the limit [1].")] = 0.95
    together: Annotated[
        list[str] | None,
        Option(help="Vehicles that must share a mount, such as TSM=U06-1,U06-2; repeatable."),
    ] = None
    starts: Annotated[
        int,
        Option(
            help="Number of descents to find the best mounts of one vehicle.", callback=at_least(1)
        ),
    ] = 12
    bounds: Bounds = 0.20
    tolerance: Tolerance = 0.15
    platform: PlatformOptions = PlatformOptions(group=None)
    motion: MotionOptions = MotionOptions()

    def __post_init__(self) -> None:
        if not self.allowed >= 0.0:
            raise InputError(f"--allowed {self.allowed:g}: sharing costs 0 dB or more")
        if not 0.5 <= self.share < 1.0:
            raise InputError(f"--share {self.share:g}: ask for at least half of the cars, below 1")


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles, their design space, and who must share."""

    runs: Runs
    index: Any
    space: DesignSpace
    parts: dict[str, list[str]]
    together: dict[str, list[list[str]]]
    limits: RealArray | None

    @property
    def level(self) -> MeanLevel:
        """Mean level of the lines of each vehicle [dB(A)]."""
        return MeanLevel(self.index)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names, in the platform's order."""
        return tuple(self.index.response_names)


def prepare(options: Options) -> Model:
    """Read the platform, build its model and check who is to share."""
    runs = options.platform.runs()
    index = options.motion.model(runs)
    vehicles = tuple(index.response_names)
    if len(vehicles) < 2:
        raise InputError(f"only vehicle {vehicles[0]} was asked for: sharing needs two")
    space = factor_space(index.variable_names, options.bounds, options.tolerance)
    parts = {
        mount: [name for name in space.names if mount_of(name) == mount]
        for mount in dict.fromkeys(mount_of(name) for name in space.names)
    }
    together = _together(options.together)
    check_together(together, tuple(parts), vehicles)
    limits = None
    if options.limits is not None:
        rows = rows_of(options.limits, ("vehicle",), {"limit": "dB(A)"}, vehicles)
        limits = np.array([row.number("limit") for row in rows])
    return Model(runs, index, space, parts, together, limits)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Search, verify and report."""
    with progress_bar("commonality") as progress:
        shared = _shared(model, options, progress)
    limits_in_words = f"{options.allowed:g} dB above what mounts of its own would give it"
    if options.limits is not None:
        limits_in_words = f"the limits of {options.limits.name}"
    report = Report(
        "Mounts that vehicles can share",
        f"How few mount part numbers serve {len(model.vehicles)} vehicles, if {options.share:.0%} "
        f"of the cars of each are to keep {limits_in_words}?",
    )
    report.explain("booming noise", "SPLV", "stiffness factor", "tolerance")
    _tiles(report, shared, options)
    report.warn(*motion_report(model.index, shared.fewest.designs).warnings)
    report.summary |= _summary(shared)
    report.facts["kernel"] = model.index.kernel
    report.inputs += model.runs.platform.input_files
    if options.limits is not None:
        report.inputs.append(options.limits)
    _answer(report, shared, limits_in_words, abbreviations(model.runs.platform.mounts))
    _panels(report, shared, run_name(context, "commonality"))
    _sharing_section(report, shared)
    _price_section(report, shared)
    report_expected(report, shared.expected, ["shared"], model.vehicles)
    report_runs(report, model.runs)
    return report


@dataclass(frozen=True, eq=False)
class _Shared:
    """Own optima and sharings by count; margin and share of cars kept of each vehicle, (v,).

    - `expected`: what is expected of the fewest part numbers against today's; or why nothing is.
    """

    problem: SharingProblem
    optima: SeparateOptima
    fewest: SharedDesign
    by_count: Sequence[SharedDesign]
    lower_bound: int
    by_group: SharedDesign | None
    margin: RealArray
    shares: RealArray
    silent: tuple[str, ...]
    today: RealArray
    expected: ExpectedChange | str

    def price(self, design: SharedDesign) -> RealArray:
        """Return what sharing costs each vehicle against mounts of its own, shape (v,) [dB]."""
        return np.asarray(design.levels - self.optima.levels)

    @property
    def price_of_fewest(self) -> RealArray:
        """What the fewest part numbers cost each vehicle, shape (v,) [dB]."""
        return self.price(self.fewest)

    @property
    def change(self) -> RealArray:
        """What they change against today's mounts, shape (v,) [dB]."""
        return np.asarray(self.fewest.levels - self.today)

    @property
    def dearest(self) -> str:
        """The vehicle that pays most."""
        return self.problem.vehicles[int(np.argmax(self.price_of_fewest))]

    @property
    def one_set_price(self) -> float:
        """What one set for all costs the vehicle that pays most [dB]."""
        return float(self.price(self.by_count[0]).max())

    @property
    def n_set(self) -> int:
        """Part numbers of one set."""
        return len(self.problem.part_names)

    @property
    def n_unshared(self) -> int:
        """Part numbers if nothing is shared."""
        return self.n_set * len(self.problem.vehicles)

    @property
    def letters(self) -> pd.DataFrame:
        """A letter for the part number of each mount in each vehicle."""
        numbers = self.fewest.sharing.numbers.T
        lettered = [[get_column_letter(number + 1) for number in column] for column in numbers]
        table = pd.DataFrame(lettered, columns=list(self.problem.part_names))
        table.insert(0, "vehicle", list(self.problem.vehicles))
        return table


def _shared(model: Model, options: Options, progress: Progress) -> _Shared:
    """Find the fewest mount part numbers with which every vehicle keeps its limit, and verify."""
    level, space, seed = model.level, model.space, options.seed
    silent = variables_without_effect(level, space)
    fixed = np.isin(space.names, silent)
    searched = replace(
        space,
        lower=np.where(fixed, space.nominal, space.lower),
        upper=np.where(fixed, space.nominal, space.upper),
    )
    progress(0, 3, "mounts of its own for each vehicle")
    drawn = ScatteredLevel(model.index, space.nominal, space.relative_sigma)
    optima = separate_optima(drawn, searched, starts=options.starts, seed=seed)
    draws = sobol_sample(space.n_variables, DRAWS, seed=seed).values
    made = _as_made(level, space, optima.designs, draws)
    limits = np.quantile(made, options.share, axis=1) + options.allowed
    if model.limits is not None:
        limits = model.limits
        _refuse_missed(options, model.vehicles, limits, np.quantile(made, options.share, axis=1))
    # draws are finite: ask for more than the share, as far as mounts of its own still keep it
    share_searched = options.share + SURE * np.sqrt(options.share * (1.0 - options.share) / DRAWS)
    room = limits - optima.levels
    margin = np.minimum(np.quantile(made, min(share_searched, 1.0), axis=1) - optima.levels, room)
    problem = SharingProblem(drawn, searched, model.parts, limits - margin, model.together)
    groups = _group_sets(model.runs, problem)
    guesses = [] if groups is None else [groups]
    for _ in range(ROUNDS):
        sharing = fewest_part_numbers(
            problem, optima, guesses, lambda _done, _all, text: progress(1, 3, text)
        )
        made = _as_made(level, space, sharing.fewest.designs, draws)
        needed = np.quantile(made, min(share_searched, 1.0), axis=1) - sharing.fewest.levels
        wider = np.clip(needed, margin, room)
        if np.all(sharing.fewest.levels + wider <= limits):
            break
        margin = wider
        problem = replace(problem, limits=limits - margin)
    progress(2, 3, "verification")
    by_group = None if groups is None else separate_sets(problem, optima, groups)
    check = sobol_sample(space.n_variables, DRAWS, seed=seed, purpose="verification sample").values
    made = _as_made(level, space, sharing.fewest.designs, check)
    kept = np.mean(made <= limits[:, np.newaxis], axis=1)
    today = np.asarray(responses(problem.evaluate, problem.space.nominal[np.newaxis])[0])
    progress(3, 3, "done")
    return _Shared(
        problem=problem,
        optima=optima,
        fewest=sharing.fewest,
        by_count=sharing.by_count,
        lower_bound=sharing.lower_bound,
        by_group=by_group,
        margin=margin,
        shares=kept,
        silent=silent,
        today=today,
        expected=_expected(model, sharing.fewest.designs, seed),
    )


def _expected(model: Model, designs: RealArray, seed: int) -> ExpectedChange | str:
    """State what is expected of designs (v, k), one for each vehicle; or why nothing is."""
    index, runs = model.index, model.runs
    return expected_or_why(
        index,
        lambda: (
            uncertain_index(index, runs.platform, runs.parts)
            .expected_change(designs[np.newaxis], seed=seed)
            .of(0)
        ),
    )


def _tiles(report: Report, shared: _Shared, options: Options) -> None:
    """Show the count and its price; warn of vehicles that new draws find short."""
    price = shared.price_of_fewest
    report.tile(
        f"{shared.fewest.sharing.total}",
        f"part numbers; one set for all is {shared.n_set}, one per vehicle {shared.n_unshared}",
    )
    report.tile(f"{signed(float(price.mean()), 1)} dB", "mean price of sharing")
    report.tile(f"{signed(float(price.max()), 1)} dB", f"for {shared.dearest}, the worst")
    change, expected = float(shared.change.mean()), shared.expected
    if not isinstance(expected, str):
        report.tile(
            f"{signed(float(expected.mean.expected), 1)} dB", "expected mean change against today"
        )
    report.tile(f"{signed(change, 1)} dB", "mean change against today, in the model")
    short = [
        f"{name} ({PERCENT * share:.1f} %)"
        for name, share in zip(shared.problem.vehicles, shared.shares, strict=True)
        if share < options.share
    ]
    if short:
        report.warn(
            f"New draws find fewer than {options.share:.0%} of the cars within the limit: "
            f"{', '.join(short)}: no search found a sharing that keeps it; ask for a lower --share "
            "or a wider --allowed."
        )


def _summary(shared: _Shared) -> dict[str, Any]:
    """Return the numbers of summary.json."""
    price = shared.price_of_fewest
    summary = {
        "part_numbers_min": shared.fewest.sharing.total,
        "part_numbers_lower_bound": shared.lower_bound,
        "part_numbers_own": shared.n_unshared,
        "price_db": float(price.mean()),
        "price_worst_db": float(price.max()),
        "price_worst_vehicle": shared.dearest,
        "one_set_price_worst_db": shared.one_set_price,
        "change_db_per_line_mean": float(shared.change.mean()),
        "share_verified_min": float(shared.shares.min()),
        **expected_numbers(shared.expected, shared.problem.vehicles),
    }
    if shared.by_group is not None:
        summary["group_sets_part_numbers"] = shared.by_group.sharing.total
        summary["group_sets_price_worst_db"] = float(shared.price(shared.by_group).max())
    return summary


def _answer(report: Report, shared: _Shared, limits_in_words: str, names: str) -> None:
    """Say how many part numbers serve all vehicles, and at which price."""
    price, change = shared.price_of_fewest, float(shared.change.mean())
    report.answer(
        f"{shared.fewest.sharing.total} part numbers serve all {len(shared.problem.vehicles)} "
        f"vehicles (one set for all would be {shared.n_set}, one per vehicle "
        f"{shared.n_unshared}): {expected_on_average(shared.expected, change)} against today's "
        f"mounts; in the model sharing costs {float(price.mean()):.1f} dB on average and "
        f"{float(price.max()):.1f} dB in {shared.dearest}, the worst.",
        expected_sentence(shared.expected, change),
        f"In the model, {PERCENT * float(shared.shares.min()):.0f} % or more of the cars of every "
        f"vehicle keep {limits_in_words}. One set for all would cost the worst vehicle "
        f"{shared.one_set_price:.1f} dB.",
        names,
    )


def _panels(report: Report, shared: _Shared, name_of_run: str) -> None:
    """Show each vehicle, what each count costs, and what to do next."""
    price, n_vehicles = shared.price_of_fewest, len(shared.problem.vehicles)
    columns = {
        "today [dB(A)]": shared.today,
        "shared [dB(A)]": shared.fewest.levels,
        **expected_column(shared.expected, range(n_vehicles)),
        "change [dB]": shared.change,
        "price of sharing [dB]": price,
        "cars in limit [%]": PERCENT * shared.shares,
    }
    each = pd.concat([shared.letters, pd.DataFrame(columns)], axis=1)
    shown = np.sort(np.argsort(-price, kind="stable")[:MOST_VEHICLES])
    report.panel(
        "Each vehicle",
        Table(each.iloc[shown], "", {"change [dB]": 1, "price of sharing [dB]": 2}),
        "A letter is a part number of the mount in that column; vehicles with one letter share it. "
        "Levels, change and price are the model's."
        + ("" if len(shown) == n_vehicles else f" The {len(shown)} that pay most."),
        wide=True,
    )
    worth = _counts(shared).iloc[:, [0, -4, -3, -2]]
    report.panel(
        "What each count costs", Table(worth, "", {str(c): 1 for c in worth.columns[[1, 3]]})
    )
    report.panel(
        "What to do next",
        Step(
            f"deboom report FRONT --supplier --sharing {name_of_run}", "sheets with shared numbers"
        ),
        Step("deboom run commonality --allowed 1", "let sharing cost more"),
        Step("deboom run commonality --limits FILE", "state each vehicle's limit"),
    )


def _sharing_section(report: Report, shared: _Shared) -> None:
    """List which vehicle has which mount, and the stiffness of each part number."""
    bound, total = shared.lower_bound, shared.fewest.sharing.total
    proof = (
        f"With fewer than {bound} part numbers some vehicle misses its limit, whatever their "
        "stiffness. This result relies on descents from several starts, which found the best "
        "stiffness."
    )
    if total > bound:
        proof += f" Between {bound} and {total} the search found no sharing that keeps all limits."
    report.section(
        "Which vehicle has which mount",
        f"{proof} Each letter is a part number of the mount in its column; vehicles with the same "
        "letter share this part in all directions.",
    )
    report.table("sharing", shared.letters, "Part number of each mount in each vehicle.")
    report.table(
        "part_numbers",
        _part_numbers(shared),
        "Values of the part numbers; a direction without a number is heard by no "
        "vehicle, any stiffness within the bounds serves.",
        {"stiffness factor [1]": 3},
    )


def _price_section(report: Report, shared: _Shared) -> None:
    """Draw the price over the count of part numbers, and list it by count and by vehicle."""
    report.section(
        "What sharing costs",
        "A vehicle with mounts of its own is the zero line. One set for all vehicles costs "
        f"the worst of them {shared.one_set_price:.2f} dB per line; more part numbers reduce this "
        "price. Numbers that do not reduce it are left out.",
    )
    total = shared.fewest.sharing.total
    counts = np.array([design.sharing.total for design in shared.by_count], dtype=float)
    prices = [
        shared.price_of_fewest if design.sharing.total == total else shared.price(design)
        for design in shared.by_count
    ]
    marks = {}
    if shared.by_group is not None:
        dearest = float(shared.price(shared.by_group).max())
        n_numbers = float(shared.by_group.sharing.total)
        marks["one set per group, worst vehicle"] = (n_numbers, dearest)
    report.figure(
        "price",
        lambda: plot.fronts(
            {
                "worst vehicle": (counts, np.array([values.max() for values in prices])),
                "mean of the vehicles": (counts, np.array([values.mean() for values in prices])),
            },
            {},
            marks,
            mean_label="mount part numbers in all",
            sigma_label="level above mounts of its own [dB]",
        ),
        f"Price against part numbers; {total} keep every limit.",
    )
    report.table(
        "counts",
        _counts(shared),
        f"Best sharing found for each count, with values that keep the worst vehicle low; those "
        f"of the chosen {total} were then improved until the mean over all vehicles was lowest "
        "within the limits. The excess is the level minus the limit; a negative excess leaves a "
        "margin.",
    )
    table = {
        "vehicle": shared.problem.vehicles,
        "today [dB(A)]": shared.today,
        "own mounts [dB(A)]": shared.optima.levels,
        "shared mounts [dB(A)]": shared.fewest.levels,
        "limit as drawn [dB(A)]": shared.problem.limits,
        "margin for scatter [dB]": shared.margin,
        "price of sharing [dB]": shared.price_of_fewest,
        "change against today [dB]": shared.change,
        "cars within the limit [%]": PERCENT * shared.shares,
    }
    report.table(
        "vehicles",
        pd.DataFrame(table),
        "Mean level of the lines, including the energy that scatter adds to each line: a notch "
        "that real parts do not have counts for nothing. The limit applies to the car without "
        "scatter; a margin for the stated share of cars with scatter is subtracted from it. The "
        "last column counts cars in new draws.",
    )


def _part_numbers(shared: _Shared) -> pd.DataFrame:
    """Tabulate stiffness factor and vehicles of every part number and axis."""
    problem, chosen = shared.problem, shared.fewest
    rows: list[dict[str, object]] = []
    for part, (mount, columns) in enumerate(zip(problem.part_names, problem.columns, strict=True)):
        for number in range(chosen.sharing.counts[part]):
            holder = np.flatnonzero(chosen.sharing.numbers[part] == number)[0]
            for column in columns:
                heard = problem.space.names[column] not in shared.silent
                factor = chosen.designs[holder, column] if heard else np.nan
                rows.append(
                    {
                        "part number": f"{mount} {get_column_letter(number + 1)}",
                        "direction": problem.space.names[column],
                        "stiffness factor [1]": factor,
                        "vehicles": ", ".join(chosen.sharing.members(part, number)),
                    }
                )
    return pd.DataFrame(rows)


def _counts(shared: _Shared) -> pd.DataFrame:
    """Tabulate every count of part numbers that is worth its numbers, and what it compares with."""
    problem = shared.problem
    chosen = shared.fewest.sharing.total
    named = [
        (
            str(shared_design.sharing.total),
            shared.fewest if shared_design.sharing.total == chosen else shared_design,
        )
        for shared_design in shared.by_count
    ]
    if shared.by_group is not None:
        named.append((f"{shared.by_group.sharing.total}, one set per group", shared.by_group))
    rows: list[dict[str, object]] = []
    for name, shared_design in named:
        price = shared.price(shared_design)
        counts = zip(problem.part_names, shared_design.sharing.counts, strict=True)
        rows.append(
            {
                "part numbers": name,
                **{f"of {mount}": count for mount, count in counts},
                "worst price [dB]": float(price.max()),
                "dearest for": problem.vehicles[int(np.argmax(price))],
                "mean price [dB]": float(price.mean()),
                "worst excess [dB]": shared_design.worst,
            }
        )
    rows.append(
        {
            "part numbers": f"{shared.n_unshared}, every vehicle its own",
            **{f"of {mount}": len(problem.vehicles) for mount in problem.part_names},
            "worst price [dB]": 0.0,
            "mean price [dB]": 0.0,
            "dearest for": "",
            "worst excess [dB]": float((shared.optima.levels - problem.limits).max()),
        }
    )
    return pd.DataFrame(rows)


def _as_made(
    level: MeanLevel, space: DesignSpace, designs: RealArray, draws: RealArray
) -> RealArray:
    """Level of cars of each vehicle as they are made with its own design, shape (v, n) [dB(A)]."""
    scale = 1.0 + space.relative_sigma * draws
    return np.array([responses(level, row * scale)[:, v] for v, row in enumerate(designs)])


def _together(texts: Sequence[str] | None) -> dict[str, list[list[str]]]:
    """Read ``TSM=U06-1,U06-2``."""
    together: dict[str, list[list[str]]] = {}
    for text in texts or ():
        part, mark, names = text.partition("=")
        vehicles = [name.strip() for name in names.split(",") if name.strip()]
        if not mark or len(vehicles) < 2:
            raise InputError(
                f"--together '{text}': write a mount and at least two vehicles, TSM=U06-1,U06-2"
            )
        together.setdefault(part.strip(), []).append(vehicles)
    return together


def _refuse_missed(
    options: Options, vehicles: Sequence[str], limits: RealArray, kept: RealArray
) -> None:
    """Refuse limits that vehicles miss with mounts of their own, both (v,) [dB(A)]."""
    missed = kept - limits
    binding = int(np.argmax(missed))
    if missed[binding] > 0.0:
        raise InputError(
            f"{options.limits}: {vehicles[binding]} cannot keep its limit of {limits[binding]:.4g} "
            f"dB(A): with mounts of its own {options.share:.0%} of the cars reach "
            f"{kept[binding]:.4g} dB(A), {missed[binding]:.3g} dB too much; "
            f"{int((missed > 0.0).sum())} of {missed.size} vehicles miss theirs: raise the limits, "
            "or widen the bounds (--bounds)"
        )


def _group_sets(runs: Runs, problem: SharingProblem) -> Sharing | None:
    """Sharing of one set per group of the platform; None if there is one group."""
    group_of = {vehicle.name: vehicle.group for vehicle in runs.fleet.vehicles}
    groups = list(dict.fromkeys(group_of.values()))
    if len(groups) < 2:
        return None
    numbers = [groups.index(group_of[name]) for name in problem.vehicles]
    sets = np.tile(numbers, (len(problem.part_names), 1))
    return Sharing(problem.part_names, problem.vehicles, sets)
