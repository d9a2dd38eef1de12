"""A front on a page: its tables, and what the vehicles hear of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from deboom import plot
from deboom.arrays import RealArray
from deboom.explore.result import Front
from deboom.files.front_table import FrontTable
from deboom.plot.style import FULL_WIDTH
from deboom.report import Report
from deboom.vehicles.fleet_front import FleetFront

if TYPE_CHECKING:
    from deboom.plot.style import Drawing


def report_front(
    report: Report, front: Front, beside: Mapping[str, Sequence[str]] | None = None
) -> None:
    """Add the files of a front to a report, see `deboom.files.front_table`.

    - `beside`: further columns after the picks, one text per design.
    """
    for name, frame in FrontTable.of(front).frames().items():
        if name == "front":
            for place, (column, texts) in enumerate((beside or {}).items(), start=2):
                frame.insert(place, column, texts)
        report.table(name, frame)


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
    - `change`: of each vehicle drawn, as a table beside says it [dB].
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
        change=change,
        width=width,
    )
