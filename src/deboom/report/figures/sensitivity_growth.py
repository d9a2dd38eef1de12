"""Sensitivity: how shares of variance settle as points are added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.figures.sensitivity import refuse_nothing, switch_off
from deboom.report.style import FULL_WIDTH

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DASHES = ("-", (0, (4, 1.6)), (0, (1, 1.2)))


@dataclass(frozen=True, eq=False)
class IndexGrowth:
    """One panel of shares over the number of points.

    Parameters
    ----------
    title : str
        Such as a vehicle.
    total, interval : array, shape (d, n_count)
        Share of each factor and half width of its interval [1].
    """

    title: str
    total: npt.ArrayLike
    interval: npt.ArrayLike


def index_growth(
    counts: npt.ArrayLike,
    factors: Sequence[str],
    colours: Sequence[str],
    panels: Sequence[IndexGrowth],
    *,
    x_label: str,
    y_label: str,
    columns: int = 3,
) -> bytes:
    """Draw how shares of variance settle as points are added, with their intervals.

    Parameters
    ----------
    counts : array, shape (n_count,)
        Numbers of points, rising.
    factors : sequence of str
        d names.
    colours : sequence of str
        One for each factor; the second and third one of a colour are dashed and dotted.
    panels : sequence of IndexGrowth
        At least one.
    x_label, y_label : str
        With units.
    columns : int
        Panels per row.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        No panel, arrays of another shape or values that are not finite.
    """
    from matplotlib.ticker import NullLocator

    refuse_nothing("index_growth", panels)
    points = finite("index_growth", {"counts": counts})["counts"]
    styles = [_DASHES[list(colours[:place]).count(c) % 3] for place, c in enumerate(colours)]
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 0.85 + rows * 1.75) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
            data = finite("index_growth", {"total": panel.total, "interval": panel.interval})
            if any(values.shape != (len(factors), points.size) for values in data.values()):
                raise InputError(
                    f"figure index_growth: {panel.title} needs shape {(len(factors), points.size)}"
                )
            for row, half, colour, style in zip(*data.values(), colours, styles, strict=True):
                axes.fill_between(
                    points, row - half, row + half, color=colour, alpha=0.16, linewidth=0
                )
                axes.plot(points, row, color=colour, linestyle=style, linewidth=1.4)
            axes.set_title(panel.title, loc="left", fontweight="bold")
            if place % columns == 0:
                axes.set_ylabel(y_label)
            if place + columns >= len(panels):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel(x_label)
        switch_off(list(grid[len(panels) :]))
        grid[0].set_xscale("log", base=2)
        shown = points[:: -(-points.size // 4)]
        grid[0].set_xticks(shown, [f"{count:g}" for count in shown])
        grid[0].xaxis.set_minor_locator(NullLocator())
        grid[0].set_ylim(bottom=0.0)
        _growth_legend(figure, factors, colours, styles)
        return png(figure)


def _growth_legend(
    figure: Figure, factors: Sequence[str], colours: Sequence[str], styles: Sequence[object]
) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour, linestyle=style, label=name)  # type: ignore[arg-type]
        for name, colour, style in zip(factors, colours, styles, strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
