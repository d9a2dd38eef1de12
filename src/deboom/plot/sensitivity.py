"""Sensitivity: shares of variance as bars, over frequency, and over the number of points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.levels import rpm_axis
from deboom.plot.style import (
    FULL_WIDTH,
    INK,
    MUTED,
    RealArray,
    finite,
    halo,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW = 0.165  # in, of one factor
_SHOWN_FROM = 0.01  # total index that is written beside its bar


@dataclass(frozen=True, eq=False)
class IndexBars:
    """One panel of shares of variance.

    Parameters
    ----------
    title : str
        Such as a vehicle.
    first, total, interval : array, shape (d,)
        Share of each factor alone, with all couplings, and half width of the latter's interval [1].
    zero : array of bool, shape (d,)
        Factors whose total share is not above its interval.
    """

    title: str
    first: npt.ArrayLike
    total: npt.ArrayLike
    interval: npt.ArrayLike
    zero: npt.ArrayLike


@dataclass(frozen=True, eq=False)
class IndexMap:
    """One panel of shares over frequency.

    Parameters
    ----------
    title : str
        Such as a vehicle.
    total : array, shape (d, n_frequency)
        Share of each factor [1].
    peaks : array, shape (p,)
        Frequencies to be marked above the panel [Hz].
    """

    title: str
    total: npt.ArrayLike
    peaks: npt.ArrayLike = ()


def index_bars(
    factors: Sequence[str],
    colours: Sequence[str],
    panels: Sequence[IndexBars],
    *,
    x_label: str,
    columns: int = 3,
) -> Figure:
    """Draw shares of variance as stacked bars: alone, and interacting with others.

    Parameters
    ----------
    factors : sequence of str
        d names.
    colours : sequence of str
        One for each factor.
    panels : sequence of IndexBars
        At least one.
    x_label : str
        With its unit.
    columns : int
        Panels per row.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        No panel, arrays of different lengths or values that are not finite.
    """
    from matplotlib.ticker import MultipleLocator

    refuse_nothing("index_bars", panels)
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 0.75 + rows * (0.42 + _ROW * len(factors))) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
            _bars(axes, panel, len(factors), colours)
            axes.set_title(panel.title, loc="left", fontweight="bold")
            if place + columns >= len(panels):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel(x_label)
        switch_off(list(grid[len(panels) :]))
        grid[0].set_yticks(range(len(factors)), factors)
        grid[0].set_ylim(len(factors) - 0.4, -0.6)
        grid[0].set_xlim(0.0, 1.12 * max(_reach(panel) for panel in panels))
        grid[0].xaxis.set_major_locator(MultipleLocator(0.2))
        _bar_legend(figure, list(grid[len(panels) :]))
        return figure


def index_map(
    frequency: npt.ArrayLike,
    order: float,
    factors: Sequence[str],
    panels: Sequence[IndexMap],
    *,
    value_label: str,
    columns: int = 2,
) -> Figure:
    """Draw how the shares of all factors change over the frequency of an engine order.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Lines, rising [Hz].
    order : float
        Engine order of the lines [1]; gives the rpm axis.
    factors : sequence of str
        d names.
    panels : sequence of IndexMap
        At least one.
    value_label : str
        Of the colour scale, 0 to 1.
    columns : int
        Panels per row.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        No panel, arrays of another shape or values that are not finite.
    """
    refuse_nothing("index_map", panels)
    lines = finite("index_map", {"frequency": frequency})["frequency"]
    edges = _edges(lines)
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 1.0 + rows * (0.4 + 0.8 * _ROW * len(factors))) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
        shown = None
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
            values = finite("index_map", {"total": panel.total})["total"]
            if values.shape != (len(factors), lines.size):
                raise InputError(
                    f"figure index_map: {panel.title} has shape {values.shape}, expected "
                    f"{(len(factors), lines.size)}"
                )
            shown = axes.pcolormesh(
                edges,
                np.arange(len(factors) + 1) - 0.5,
                values,
                cmap="Blues",
                vmin=0.0,
                vmax=1.0,
            )
            _peaks(axes, np.asarray(panel.peaks, dtype=float))
            axes.grid(visible=False)
            axes.tick_params(axis="y", length=0)
            axes.set_title(panel.title, loc="left", fontweight="bold", pad=9.0)
            if place < columns:
                rpm_axis(axes, order)
            if place + columns >= len(panels):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel("frequency [Hz]")
        switch_off(list(grid[len(panels) :]))
        grid[0].set_yticks(range(len(factors)), factors)
        grid[0].set_ylim(len(factors) - 0.5, -0.5)
        grid[0].set_xlim(edges[0], edges[-1])
        figure.colorbar(shown, ax=list(grid), label=value_label, pad=0.015, aspect=40)  # type: ignore[arg-type]
        return figure


def _edges(lines: RealArray) -> RealArray:
    """Return where the cell of each line begins and ends [Hz]."""
    middle = 0.5 * (lines[1:] + lines[:-1])
    first, last = (middle[0], middle[-1]) if middle.size else (lines[0] - 0.5, lines[0] + 0.5)
    outer = (2.0 * lines[0] - first, 2.0 * lines[-1] - last) if middle.size else (first, last)
    return np.concatenate([outer[:1], middle, outer[1:]])


def refuse_nothing(name: str, panels: Sequence[object]) -> None:
    """Refuse a figure without panels."""
    if not panels:
        raise InputError(f"figure {name}: there is no panel to draw")


def switch_off(rest: Sequence[Axes]) -> None:
    """Hide the panels that nothing is drawn in."""
    for axes in rest:
        axes.set_axis_off()


def _reach(panel: IndexBars) -> float:
    """Where the longest bar of a panel ends, with its interval."""
    return max(float(np.max(np.asarray(panel.total) + np.asarray(panel.interval))), 1e-6)


def _bars(axes: Axes, panel: IndexBars, count: int, colours: Sequence[str]) -> None:
    data = finite(
        "index_bars",
        {
            "factors": np.zeros(count),
            "first": panel.first,
            "total": panel.total,
            "interval": panel.interval,
        },
    )
    zero = np.asarray(panel.zero, dtype=bool)
    # estimates of next to nothing may be negative
    first = np.clip(data["first"], 0.0, data["total"])
    for place, colour in enumerate(colours):
        total, half = data["total"][place], data["interval"][place]
        if zero[place]:
            axes.text(0.004, place, "zero", color=MUTED, fontsize=6.5, va="center_baseline")
            continue
        axes.barh(place, first[place], height=0.62, color=colour)
        axes.barh(
            place,
            total - first[place],
            left=first[place],
            height=0.62,
            facecolor="white",
            edgecolor=colour,
            hatch="//////",
            linewidth=0.6,
        )
        axes.plot([total - half, total + half], [place] * 2, "|-", color=INK, lw=0.9, ms=4.0)
        if total >= _SHOWN_FROM:
            axes.annotate(
                f"{total:.2f}",
                (total + half, place),
                xytext=(3, 0),
                textcoords="offset points",
                fontsize=7.0,
                va="center_baseline",
                path_effects=halo(2.0),
            )
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)


def _bar_legend(figure: Figure, free: Sequence[Axes]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Patch(facecolor=MUTED, label="alone (first order)"),
        Patch(facecolor="white", edgecolor=MUTED, hatch="//////", label="interacting with others"),
        Line2D([], [], color=INK, marker="|", ms=4.0, lw=0.9, label="95 % interval of the total"),
        Line2D([], [], linestyle="none", label="zero: not above its interval"),
    ]
    if free:
        free[0].legend(handles=handles, loc="center left", fontsize=8.0)
    else:
        figure.legend(handles=handles, loc="outside lower center", ncols=4)


def _peaks(axes: Axes, peaks: RealArray) -> None:
    axes.plot(
        peaks,
        np.full(peaks.size, 1.0),
        "v",
        color=INK,
        markersize=4.0,
        transform=axes.get_xaxis_transform(),
        clip_on=False,
        zorder=4,
    )


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
) -> Figure:
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
    Figure

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
        return figure


def _growth_legend(
    figure: Figure, factors: Sequence[str], colours: Sequence[str], styles: Sequence[object]
) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour, linestyle=style, label=name)  # type: ignore[arg-type]
        for name, colour, style in zip(factors, colours, styles, strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
