"""Numbers with their interval, a row each, in panels side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.plot.style import ACCENT, INK, MUTED, TRACK, finite, panel_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW = 0.21  # in, of one interval
_LONGEST = 48  # letters of a line
_SPREAD = 0.3
_MARKS = ("o", "s", "D", "^")
_COLOURS = (ACCENT, "#8996A5", INK, "#B7C0CA")  # of no vehicle and no mount


@dataclass(frozen=True, eq=False)
class IntervalPanel:
    """One quantity of all rows.

    - `x_label`: with its unit.
    - `groups`: group → value, lower and upper bound of every row [unit of the label].
    - `title`: above the panel.
    - `allowed`, optional: both ends of a grey bar in every row, such as bounds.
    """

    x_label: str
    groups: Mapping[str, Sequence[npt.ArrayLike]]
    title: str = ""
    allowed: Sequence[npt.ArrayLike] | None = None


def interval_panels(
    rows: Sequence[str], panels: Sequence[IntervalPanel], *, columns: int | None = None
) -> Figure:
    """Draw values with their intervals, in panels that share their rows.

    - `rows`: top to bottom.
    - `panels`: at least one; a group has one colour in all of them, and a label one axis.
    - `columns`: panels side by side; by default all.
    - raises InputError: no panel, arrays of other lengths than the rows, values that are not
      finite.
    """
    from matplotlib.lines import Line2D

    names = list(dict.fromkeys(name for panel in panels for name in panel.groups))
    colours = {name: _COLOURS[k % len(_COLOURS)] for k, name in enumerate(names)}
    marks = {name: _MARKS[place % len(_MARKS)] for place, name in enumerate(names)}
    labels = [fill(row, _LONGEST) for row in rows]
    written = _ROW * sum(1 + label.count("\n") for label in labels if "\n" in label)
    height = max(_ROW * len(rows) * max(len(names), 2) * 0.62, written)
    count = columns or len(panels)
    height += 0.0 if count >= len(panels) else 0.5
    with panel_grid("interval_panels", len(panels), count, 1.2, height, share_y=True) as (
        figure,
        grid,
    ):
        for axes, panel in zip(grid, panels, strict=True):
            if panel.allowed is not None:
                ends = dict(zip(("lower", "upper"), panel.allowed, strict=True))
                bar = finite("interval_panels", {"rows": range(len(rows)), **ends})
                axes.barh(bar["rows"], bar["upper"] - bar["lower"], 0.8, bar["lower"], color=TRACK)
            places = np.linspace(-_SPREAD, _SPREAD, max(len(panel.groups), 2))
            for offset, (name, bounds) in zip(places, panel.groups.items(), strict=False):
                arrays = dict(zip(("value", "lower", "upper"), bounds, strict=True))
                checked = finite("interval_panels", {"rows": range(len(rows)), **arrays})
                y = checked["rows"] + (offset if len(panel.groups) > 1 else 0.0)
                axes.hlines(y, checked["lower"], checked["upper"], color=colours[name], lw=1.6)
                axes.plot(checked["value"], y, marks[name], color=colours[name], markersize=4.0)
        _share_x(grid, panels)
        for axes, panel in zip(grid, panels, strict=True):
            low, high = axes.get_xlim()
            if low < 0.0 < high:
                axes.axvline(0.0, color=MUTED, linewidth=0.8, zorder=0)
            axes.set_xlabel(panel.x_label)
            axes.set_title(panel.title, loc="left", fontweight="bold")
            axes.grid(False, axis="y")
        grid[0].set_yticks(range(len(rows)), labels)
        grid[0].set_ylim(len(rows) - 0.5, -0.5)
        if len(names) > 1:
            handles = [
                Line2D([], [], color=colours[name], marker=marks[name], ms=4, label=name)
                for name in names
            ]
            figure.legend(handles=handles, loc="outside lower center", ncols=min(len(names), 4))
        return figure


def _share_x(grid: Sequence[Axes], panels: Sequence[IntervalPanel]) -> None:
    """Give panels of one quantity the same axis, so that they compare by eye."""
    for label in {panel.x_label for panel in panels}:
        alike = [axes for axes, panel in zip(grid, panels, strict=True) if panel.x_label == label]
        low, high = np.transpose([axes.get_xlim() for axes in alike])
        for axes in alike:
            axes.set_xlim(low.min(), high.max())
