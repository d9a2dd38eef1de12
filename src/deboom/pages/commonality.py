"""The page on mounts that vehicles share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from openpyxl.utils import get_column_letter

from deboom import plot
from deboom.arrays import PERCENT, RealArray
from deboom.explore.sharing import SeparateOptima, SharedDesign, SharingProblem
from deboom.measurement.booming_peaks import compare_peaks
from deboom.pages.front_answer import (
    abbreviations,
    certainty_sentence,
    expected_column,
    expected_on_average,
    model_sentence,
    peaks_sentence,
    report_expected,
    report_expected_numbers,
)
from deboom.pages.motion import motion_report, report_runs
from deboom.report import Report, Step, Table
from deboom.vehicles.expected_change import ExpectedChange
from deboom.vehicles.platform import Runs

MOST_VEHICLES = 20
"""Vehicles of the first screen's table, those that pay most."""


@dataclass(frozen=True, eq=False)
class SharedMounts:
    """Own optima and sharings by count; margin and share of cars kept of each vehicle, (v,).

    - `share`: of the cars of each vehicle that shall keep the limit [1].
    - `expected`: what is expected of the fewest part numbers against today's; or why nothing is.
    """

    problem: SharingProblem
    optima: SeparateOptima
    fewest: SharedDesign
    by_count: Sequence[SharedDesign]
    lower_bound: int
    by_group: SharedDesign | None
    margin: RealArray
    share: float
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


def commonality_report(
    shared: SharedMounts,
    runs: Runs,
    index: Any,
    *,
    limits_in_words: str,
    inputs: Sequence[Path],
    run: str,
) -> Report:
    """Report how few part numbers serve all vehicles.

    - `runs`, `index`: platform and model of the levels.
    - `limits_in_words`: what the cars stay below.
    - `inputs`: files read.
    - `run`: its name.
    """
    vehicles = shared.problem.vehicles
    report = Report(
        "Mounts that vehicles can share",
        f"How few mount part numbers serve {len(vehicles)} vehicles, if "
        f"{PERCENT * shared.share:.0f} % of the cars of each are to stay below {limits_in_words}?",
    )
    report.explain("booming noise", "SPLV", "stiffness factor", "tolerance")
    _warn_of_short_ones(report, shared)
    report.warn(*motion_report(index, shared.fewest.designs).warnings)
    _numbers(report, shared)
    report.facts["kernel"] = index.kernel
    report.inputs += inputs
    _answer(report, shared, abbreviations(runs.platform.mounts), _peaks(shared, runs, index))
    _panels(report, shared, run)
    _sharing_section(report, shared)
    _price_section(report, shared)
    report_expected(report, shared.expected, ["shared"], vehicles)
    report_runs(report, runs)
    return report


def _warn_of_short_ones(report: Report, shared: SharedMounts) -> None:
    """Warn of vehicles of which new draws find too few cars within the limit."""
    short = [
        f"{name} ({PERCENT * share:.1f} %)"
        for name, share in zip(shared.problem.vehicles, shared.shares, strict=True)
        if share < shared.share
    ]
    if short:
        report.warn(
            f"New draws find fewer than {PERCENT * shared.share:.0f} % of the cars within the "
            f"limit: {', '.join(short)}: no search found a sharing that keeps it; ask for a lower "
            "--share or a wider --allowed."
        )


def _numbers(report: Report, shared: SharedMounts) -> None:
    """Say how few part numbers serve all vehicles, and what sharing costs."""
    price = shared.price_of_fewest
    report.number(
        "part_numbers_min",
        shared.fewest.sharing.total,
        "",
        "part numbers that serve all vehicles",
        headline="d",
    )
    report.number(
        "part_numbers_lower_bound", shared.lower_bound, "", "fewer part numbers are impossible"
    )
    report.number("part_numbers_own", shared.n_unshared, "", "part numbers where nothing is shared")
    report.number(
        "price_db",
        float(price.mean()),
        "dB",
        "price of sharing: level above mounts of its own, mean of the vehicles",
        headline="+.1f",
    )
    report.number(
        "price_worst_db",
        float(price.max()),
        "dB",
        "price of sharing in the vehicle that pays most",
        headline="+.1f",
    )
    report.number("price_worst_vehicle", shared.dearest, "", "vehicle that pays most")
    report.number(
        "one_set_price_worst_db",
        shared.one_set_price,
        "dB",
        "price of one set for all in the vehicle that pays most",
    )
    report.number(
        "change_db_per_line_mean",
        float(shared.change.mean()),
        "dB",
        "change of the mean level against today's mounts in the model, mean of the vehicles",
        headline="+.1f",
    )
    report.number(
        "share_verified_min",
        float(shared.shares.min()),
        "1",
        "share of a vehicle's cars within its limit, the smallest, verified with new draws",
    )
    report_expected_numbers(report, shared.expected, shared.problem.vehicles)
    if shared.by_group is not None:
        report.number(
            "group_sets_part_numbers",
            shared.by_group.sharing.total,
            "",
            "part numbers with one set per group",
        )
        report.number(
            "group_sets_price_worst_db",
            float(shared.price(shared.by_group).max()),
            "dB",
            "price of one set per group in the vehicle that pays most",
        )


def _answer(report: Report, shared: SharedMounts, names: str, peaks: str) -> None:
    """Say how many part numbers serve all vehicles, and at which price."""
    price, change = shared.price_of_fewest, float(shared.change.mean())
    report.answer(
        f"{shared.fewest.sharing.total} part numbers serve all {len(shared.problem.vehicles)} "
        f"vehicles (one set for all would be {shared.n_set}, one per vehicle "
        f"{shared.n_unshared}): {expected_on_average(shared.expected, change)} against today's "
        f"mounts; in the model sharing costs {float(price.mean()):.1f} dB on average and "
        f"{float(price.max()):.1f} dB in {shared.dearest}, the worst, and {peaks}.",
        certainty_sentence(shared.expected),
        model_sentence(shared.expected, change),
        f"{PERCENT * float(shared.shares.min()):.0f} % of the cars keep the limit in the model, in "
        f"the vehicle with the fewest. One set for all would cost up to {shared.one_set_price:.1f} "
        "dB.",
        names,
    )


def _peaks(shared: SharedMounts, runs: Runs, index: Any) -> str:
    """Say what becomes of today's booming peaks in the first load case."""
    designs, rows = shared.fewest.designs, range(len(shared.problem.vehicles))
    before = index.levels(np.ones((1, designs.shape[1])))[0]
    after = index.levels(designs)
    lines, order = index.frequency, runs.cases[0][0].order
    pairs = (compare_peaks(before[row], after[row, row], lines, order) for row in rows)
    return peaks_sentence(dict(zip(shared.problem.vehicles, pairs, strict=True)))


def _panels(report: Report, shared: SharedMounts, name_of_run: str) -> None:
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
        "Levels, change and price are the model's, with the energy that scatter adds to each line; "
        "levels on the page of a front leave that out."
        + ("" if len(shown) == n_vehicles else f" The {len(shown)} that pay most."),
        wide=True,
    )
    part_numbers = _part_numbers(shared)
    report.table("part_numbers", part_numbers)
    report.panel(
        "What to build",
        Table(
            part_numbers[part_numbers["stiffness factor [1]"].notna()],
            "",
            {"stiffness factor [1]": 2},
        ),
        "Factors of today's stiffness. No vehicle hears the other directions.",
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


def _sharing_section(report: Report, shared: SharedMounts) -> None:
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


def _price_section(report: Report, shared: SharedMounts) -> None:
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


def _part_numbers(shared: SharedMounts) -> pd.DataFrame:
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


def _counts(shared: SharedMounts) -> pd.DataFrame:
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
                "largest price [dB]": float(price.max()),
                "paid by": problem.vehicles[int(np.argmax(price))],
                "mean price [dB]": float(price.mean()),
                "worst excess [dB]": shared_design.worst,
            }
        )
    rows.append(
        {
            "part numbers": f"{shared.n_unshared}, every vehicle its own",
            **{f"of {mount}": len(problem.vehicles) for mount in problem.part_names},
            "largest price [dB]": 0.0,
            "mean price [dB]": 0.0,
            "paid by": "",
            "worst excess [dB]": float((shared.optima.levels - problem.limits).max()),
        }
    )
    return pd.DataFrame(rows)
