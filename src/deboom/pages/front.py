"""A front on a page: its tables, and what the vehicles hear of it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from deboom import plot
from deboom.arrays import PERCENT, RealArray
from deboom.explore.choices import Pick
from deboom.explore.result import Front
from deboom.files.front_table import facts_of, tables_of
from deboom.files.made_parts import MadeParts
from deboom.plot.style import FULL_WIDTH
from deboom.report import Report
from deboom.vehicles.fleet_front import FleetFront

if TYPE_CHECKING:
    from deboom.plot import Figure
    from deboom.plot.style import Drawing


def report_front(
    report: Report, front: Front, beside: Mapping[str, Sequence[str]] | None = None
) -> None:
    """Add the files and the facts of a front to a report, see `deboom.files.front_table`.

    - `beside`: further columns after the picks, one text per design.
    """
    report.facts |= facts_of(front)
    for name, frame in tables_of(front).items():
        if name == "front":
            for place, (column, texts) in enumerate((beside or {}).items(), start=2):
                frame.insert(place, column, texts)
        report.table(name, frame)


def front_numbers(report: Report, fleet: FleetFront, build: str) -> None:
    """Say the numbers that every front has: what to build, peaks, scatter, verification, search.

    - `build`: what best-mean consists of, in a few words.
    """
    front = fleet.front
    report.number("build", build, "", "best-mean: what to build", headline="s")
    peaks = fleet.peak_changes(front.pick_designs[Pick.best_mean]).values()
    rises = [peak.change for changes in peaks for peak in changes if peak.counts]
    if rises:
        report.number(
            "largest_rise_db",
            max(rises),
            "dB",
            "change of the booming peak that changes for the worst, of today's and of new ones "
            "louder than today, in the model",
            headline="+.1f",
        )
    for name, row in front.picks.items():
        ratio = front.values.sigma_sum[row] / front.baseline.sigma_sum[0]
        pick = re.sub(r"\W+", "_", name)
        report.number(
            f"sigma_change_percent_{pick}",
            PERCENT * (ratio - 1.0),
            "%",
            f"change of the scatter σ of the mean level by {name}",
            headline="+.0f" if name == Pick.best_mean else "",
        )
    report.number(
        "sigma_bias_percent",
        front.sigma_bias_percent,
        "%",
        "error of σ in the search: search minus verification",
    )
    report.number(
        "mean_bias_db_per_line",
        front.mean_bias * front.per_line,
        "dB",
        "error of the mean level in the search: search minus verification",
    )
    search = front.search
    report.number("n_front", len(search.front), "", "designs on the front of the search")
    report.number("n_evaluated", search.n_evaluated, "", "designs that the search evaluated")
    report.number("n_failed", search.n_failed, "", "designs that could not be computed")
    report.number("seconds_search", round(search.seconds, 3), "s", "time of the search")


PANELS = 24
"""Vehicles that are drawn as curves; of a larger fleet the others are a map."""


def drawn_rows(values: RealArray) -> list[int]:
    """Return the rows that are drawn, in their order: those of the `PANELS` largest values (n,)."""
    return sorted(int(row) for row in np.argsort(-values, kind="stable")[:PANELS])


def left_out(count: int, which: str, table: str) -> str:
    """Say which of `count` vehicles are drawn, and where all stand; nothing where all are drawn."""
    if count <= PANELS:
        return ""
    return f" The {PANELS} of {count} vehicles {which}; {table}.csv has all."


CELLS = 10 * PANELS
"""Vehicles beyond those with panels that are cells of matrices; the tables have them all."""


def report_cells(
    report: Report,
    name: str,
    what: str,
    rows: Sequence[str],
    vehicles: Sequence[str],
    values: RealArray,
    drawn: Sequence[int],
    *,
    unit: str = "1",
) -> None:
    """Show numbers of the vehicles without a panel as cells of matrices, where there are any.

    - `name`: of the figure; `what`: the numbers are, such as ``total index``.
    - `values` (n_row, n_vehicle): [unit]; with a unit they have signs, which have colours.
    - `drawn`: vehicles that have a panel.
    """
    others = [row for row in range(len(vehicles)) if row not in drawn]
    if not others:
        return
    shown = others[:CELLS]
    reach = 1.0 if unit == "1" else max(float(np.abs(values[:, shown]).max()), SMALLEST_REACH)
    maps = [
        plot.HeatMap(
            f"{what} [{unit}]" if part[0] == shown[0] else "",
            tuple(rows),
            tuple(vehicles[row] for row in part),
            values[:, part],
            limits=(0.0 if unit == "1" else -reach, reach),
            decimals=2 if unit == "1" else 1,
        )
        # parts of one width: cells of a narrow one would be large
        for part in np.array_split(shown, -(-len(shown) // PANELS))
    ]
    report.figure(
        name,
        lambda: plot.heat_maps(maps, columns=1),
        f"{what.capitalize()} of {'the other ' if shown == others else ''}{len(shown)} vehicles.",
    )


def curve_rows(fleet: FleetFront, design: RealArray) -> list[int]:
    """Return the vehicles that are drawn as curves, in their order: those that gain least."""
    return drawn_rows(fleet.splv_change(design))


def report_heard(
    report: Report,
    fleet: FleetFront,
    design: RealArray,
    colours: Mapping[str, str],
    caption: str,
    *,
    speed_label: str = "engine speed [rpm]",
    change: RealArray | None = None,
) -> None:
    """Show the levels of all vehicles today and in one design: as curves, of many some as a map.

    - `colours`, `speed_label`, `change`: as for `heard`; `caption`: of the curves.
    """
    drawn = curve_rows(fleet, design)
    others = [row for row in range(len(fleet.vehicles)) if row not in drawn]
    if others:
        caption = f"The {len(drawn)} of {len(fleet.vehicles)} vehicles that gain least. {caption}"
    report.figure(
        "spl_curves",
        lambda: heard(fleet, design, colours, rows=drawn, speed_label=speed_label, change=change),
        caption,
    )
    if others:
        report.figure(
            "spl_maps",
            lambda: before_and_after(
                fleet.frequency,
                fleet.order,
                [fleet.vehicles[row] for row in others],
                fleet.levels(fleet.today)[others],
                fleet.levels(design)[others],
            ),
            f"The other {len(others)} vehicles: today, with best-mean, and the difference "
            "(violet: quieter). Not every row is named.",
        )


DYNAMIC = 40.0
"""Levels that lie below the loudest one by this or more share the darkest colour [dB]."""
SMALLEST_REACH = 0.1
"""Change that has the strongest colour, at least [dB]."""


def before_and_after(
    frequency: RealArray, order: float, rows: Sequence[str], before: RealArray, after: RealArray
) -> Figure:
    """Draw levels over frequency as maps: today, with best-mean, and the difference.

    - `before`, `after` (n_row, n_frequency): [dB(A)].
    """
    change, loudest = after - before, float(max(before.max(), after.max()))
    reach = max(float(np.abs(change).max()), SMALLEST_REACH)
    scale = ("SPL [dB(A)]", (loudest - DYNAMIC, loudest), "inferno")
    maps = [
        plot.LineMap("today", before, *scale),
        plot.LineMap(Pick.best_mean, after, *scale),
        plot.LineMap("difference", change, "change [dB]", (-reach, reach), "PuOr_r"),
    ]
    return plot.line_maps(frequency, order, rows, maps)


def heard(
    fleet: FleetFront,
    design: RealArray,
    colours: Mapping[str, str],
    *,
    rows: Sequence[int] | None = None,
    speed_label: str = "engine speed [rpm]",
    change: RealArray | None = None,
    width: float = FULL_WIDTH,
) -> Drawing:
    """Draw the levels of all vehicles, or of some rows, today and in one design.

    - `colours`: of each vehicle; `speed_label`: what turns, above the frequency axis.
    - `change`: of each vehicle of the fleet, as a table beside says it [dB].
    - `width`: of the figure [inch].
    """
    shown = list(range(len(fleet.vehicles)) if rows is None else rows)
    names, changes = [fleet.vehicles[row] for row in shown], fleet.peak_changes(design)
    return plot.spl_curves(
        fleet.frequency,
        fleet.order,
        fleet.levels(fleet.today)[shown],
        fleet.levels(design)[shown],
        names,
        [[c.before.frequency for c in changes[name] if c.before] for name in names],
        [[c.after.frequency for c in changes[name] if c.after] for name in names],
        colours,
        speed_label=speed_label,
        change=None if change is None else np.asarray(change)[shown],
        width=width,
    )


def report_parts(report: Report, made: MadeParts) -> None:
    """Add a section and a table ``parts`` to a report; nothing without a file."""
    if made.structure is None:
        return
    report.section("How parts scatter", made.text)
    caption = "Half widths of the scatter are three standard deviations."
    report.table("parts", made.table, caption)
    report.inputs += made.inputs
