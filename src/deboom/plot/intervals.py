"""Numbers with their interval, and single results by category."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    ACCENT,
    FULL_WIDTH,
    INK,
    MUTED,
    VEHICLE_PALETTE,
    canvas,
    finite,
    panel_grid,
    place_legend,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW = 0.21  # in, of one interval
_SPREAD = 0.3
_MARKS = ("o", "s", "D", "^")


@dataclass(frozen=True, eq=False)
class IntervalPanel:
    """One quantity of all rows.

    - `x_label`: with its unit.
    - `groups`: group → value, lower and upper bound of every row [unit of the label].
    - `title`: above the panel.
    """

    x_label: str
    groups: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike]]
    title: str = ""


def interval_panels(rows: Sequence[str], panels: Sequence[IntervalPanel]) -> Figure:
    """Draw values with their intervals, panels side by side that share their rows.

    - `rows`: top to bottom.
    - `panels`: at least one; a group has one colour in all of them.
    - raises InputError: no panel, arrays of other lengths than the rows, values that are not
      finite.
    """
    from matplotlib.lines import Line2D

    names = list(dict.fromkeys(name for panel in panels for name in panel.groups))
    colours = {name: _colour(place) for place, name in enumerate(names)}
    height = _ROW * len(rows) * max(len(names), 2) * 0.62
    count = len(panels)
    with panel_grid("interval_panels", count, count, 1.2, height, share_y=True) as (figure, grid):
        for axes, panel in zip(grid, panels, strict=True):
            places = np.linspace(-_SPREAD, _SPREAD, max(len(panel.groups), 2))
            for offset, (name, bounds) in zip(places, panel.groups.items(), strict=False):
                arrays = dict(zip(("value", "lower", "upper"), bounds, strict=True))
                checked = finite("interval_panels", {"rows": range(len(rows)), **arrays})
                y = checked["rows"] + (offset if len(panel.groups) > 1 else 0.0)
                axes.hlines(y, checked["lower"], checked["upper"], color=colours[name], lw=1.6)
                mark = _MARKS[names.index(name) % len(_MARKS)]
                axes.plot(checked["value"], y, mark, color=colours[name], markersize=4.0)
            axes.set_xlabel(panel.x_label)
            axes.set_title(panel.title, loc="left", fontweight="bold")
            axes.grid(False, axis="y")
        grid[0].set_yticks(range(len(rows)), list(rows))
        grid[0].set_ylim(len(rows) - 0.5, -0.5)
        if len(names) > 1:
            handles = [
                Line2D([], [], color=colours[n], marker=_MARKS[k % len(_MARKS)], ms=4, label=n)
                for k, n in enumerate(names)
            ]
            figure.legend(handles=handles, loc="outside lower center", ncols=min(len(names), 4))
        return figure


def front_intervals(
    mean: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike],
    sigma: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike],
    picks: Mapping[str, int],
    *,
    mean_label: str,
    sigma_label: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw a front whose points have an interval along both objectives.

    - `mean`, `sigma` (n,): value, lower and upper bound of both objectives.
    - `picks`: name of a point → its row.
    - `mean_label`, `sigma_label`: with units.
    - raises InputError: arrays of different lengths, empty ones, values that are not finite.
    """
    keys = [f"{what} {end}" for what in ("mean", "sigma") for end in ("value", "lower", "upper")]
    arrays = finite("front_intervals", dict(zip(keys, (*mean, *sigma), strict=True)))
    x, y = arrays["mean value"], arrays["sigma value"]
    with canvas(ax, FULL_WIDTH, 3.6) as axes:
        axes.hlines(y, arrays["mean lower"], arrays["mean upper"], color=MUTED, lw=0.7, alpha=0.55)
        axes.vlines(
            x, arrays["sigma lower"], arrays["sigma upper"], color=MUTED, lw=0.7, alpha=0.55
        )
        axes.plot(x, y, "o", color=ACCENT, markersize=3.2, label="front, with 90 % intervals")
        for place, (name, row) in enumerate(picks.items()):
            axes.plot(
                x[row],
                y[row],
                _MARKS[place % len(_MARKS)],
                color=_colour(place + 1),
                markersize=7,
                markeredgecolor=INK,
                label=name,
            )
        axes.set_xlabel(mean_label)
        axes.set_ylabel(sigma_label)
        place_legend(axes, ax, loc="outside lower center", ncols=4)
        return axes


def _colour(place: int) -> str:
    return VEHICLE_PALETTE[place % len(VEHICLE_PALETTE)]


@dataclass(frozen=True, eq=False)
class DotPanel:
    """One measure of all categories.

    - `x_label`: with its unit.
    - `values`: category → group → values; a group has one colour in all panels.
    - `limit`, optional: what was asked for, drawn as a line [unit of the label].
    - `limit_label`: what that is.
    """

    x_label: str
    values: Mapping[str, Mapping[str, npt.ArrayLike]]
    limit: float | None = None
    limit_label: str = ""


def dot_panels(panels: Sequence[DotPanel], colours: Mapping[str, str]) -> Figure:
    """Draw panels side by side that share their categories, top to bottom.

    - `panels`: at least one; all with the same categories.
    - `colours`: of every group.
    - raises InputError: no panel, categories that differ, values that are not finite, a group
      without colour.
    """
    import pandas as pd
    import seaborn as sns

    count = len(panels)
    categories = list(panels[0].values) if panels else []
    if any(list(panel.values) != categories for panel in panels):
        raise InputError("figure dot_panels: panels side by side need the same categories")
    height = 0.36 * len(categories)
    with panel_grid("dot_panels", count, count, 1.35, height, share_y=True) as (figure, grid):
        for axes, panel in zip(grid, panels, strict=True):
            rows = [
                (category, name, float(value))
                for category in categories
                for name, values in panel.values[category].items()
                for value in finite("dot_panels", {name: values})[name]
            ]
            frame = pd.DataFrame(rows, columns=["category", "group", "value"])
            unknown = set(frame["group"]) - set(colours)
            if unknown:
                raise InputError(f"figure dot_panels: '{min(unknown)}' has no colour")
            shown = [name for name in colours if name in set(frame["group"])]
            sns.stripplot(
                frame,
                x="value",
                y="category",
                hue="group",
                order=categories,
                hue_order=shown,
                palette={name: colours[name] for name in shown},
                dodge=len(shown) > 1,
                jitter=False,
                size=3.6,
                alpha=0.8,
                legend=False,
                ax=axes,
            )
            axes.set_ylabel("")
            for row, category in enumerate(categories):
                middle = float(frame.loc[frame["category"] == category, "value"].median())
                axes.plot([middle, middle], [row - 0.4, row + 0.4], color=INK, linewidth=1.6)
            if panel.limit is not None:
                axes.axvline(panel.limit, color=ACCENT, linewidth=1.0, linestyle=(0, (4, 2)))
                axes.set_title(panel.limit_label, loc="right", fontsize=8.0, color=ACCENT)
            axes.set_xlabel(panel.x_label)
            axes.set_xlim(left=0.0)
            axes.grid(False, axis="y")
        grid[0].set_yticks(range(len(categories)), categories)
        grid[0].set_ylim(len(categories) - 0.5, -0.5)
        drawn = {name for panel in panels for one in panel.values.values() for name in one}
        _legend(figure, [name for name in colours if name in drawn], colours)
        return figure


def _legend(figure: Figure, names: Sequence[str], colours: Mapping[str, str]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], linestyle="none", marker="o", markersize=4, color=colours[n], label=n)
        for n in names
    ]
    handles.append(
        Line2D([], [], linestyle="none", marker="|", markersize=9, color=INK, label="median")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
