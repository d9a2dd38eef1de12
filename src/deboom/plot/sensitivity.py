"""Sensitivity: shares of variance as bars and over frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.curves import rpm_axis
from deboom.plot.style import (
    INK,
    MUTED,
    RealArray,
    finite,
    panel_grid,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW = 0.165  # in, of one factor
_SHOWN_FROM = 0.01  # total index that is written beside its bar


@dataclass(frozen=True, eq=False)
class IndexBars:
    """One panel of shares of variance.

    - `title`: such as a vehicle.
    - `first`, `total`, `interval` (d,): share of each factor alone, with all couplings, and half
      width of the latter's interval [1].
    - `zero` (d,): factors whose total share is not above its interval.
    """

    title: str
    first: npt.ArrayLike
    total: npt.ArrayLike
    interval: npt.ArrayLike
    zero: npt.ArrayLike


@dataclass(frozen=True, eq=False)
class IndexMap:
    """One panel of shares over frequency.

    - `title`: such as a vehicle.
    - `total` (d, n_frequency): share of each factor [1].
    - `peaks` (p,): frequencies to be marked above the panel [Hz].
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

    - `factors`: d names.
    - `colours`: one for each factor.
    - `panels`: at least one.
    - `x_label`: with its unit.
    - `columns`: panels per row.
    - raises InputError: no panel, arrays of different lengths or values that are not finite.
    """
    from matplotlib.ticker import MultipleLocator

    height = 0.42 + _ROW * len(factors)
    with panel_grid("index_bars", len(panels), columns, 0.75, height, True, True) as (figure, grid):
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=True)):
            _bars(axes, panel, len(factors), colours)
            axes.set_title(panel.title, loc="left", fontweight="bold")
            if place + columns >= len(panels):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel(x_label)
        grid[0].set_yticks(range(len(factors)), factors)
        grid[0].set_ylim(len(factors) - 0.4, -0.6)
        grid[0].set_xlim(0.0, 1.12 * max(_reach(panel) for panel in panels))
        grid[0].xaxis.set_major_locator(MultipleLocator(0.2))
        _bar_legend(figure, figure.axes[len(panels) :])
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

    - `frequency` (n_frequency,): lines, rising [Hz].
    - `order`: engine order of the lines [1]; gives the rpm axis.
    - `factors`: d names.
    - `panels`: at least one.
    - `value_label`: of the colour scale, 0 to 1.
    - `columns`: panels per row.
    - raises InputError: no panel, arrays of another shape or values that are not finite.
    """
    lines = finite("index_map", {"frequency": frequency})["frequency"]
    edges = _edges(lines)
    columns = min(columns, max(len(panels), 1))
    height = 0.4 + 0.8 * _ROW * len(factors)
    with panel_grid("index_map", len(panels), columns, 1.0, height, True, True) as (figure, grid):
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=True)):
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
        grid[0].set_yticks(range(len(factors)), factors)
        grid[0].set_ylim(len(factors) - 0.5, -0.5)
        grid[0].set_xlim(edges[0], edges[-1])
        figure.colorbar(shown, ax=grid, label=value_label, pad=0.015, aspect=40)
        return figure


def _edges(lines: RealArray) -> RealArray:
    """Return where the cell of each line begins and ends [Hz]."""
    middle = 0.5 * (lines[1:] + lines[:-1])
    first, last = (middle[0], middle[-1]) if middle.size else (lines[0] - 0.5, lines[0] + 0.5)
    outer = (2.0 * lines[0] - first, 2.0 * lines[-1] - last) if middle.size else (first, last)
    return np.concatenate([outer[:1], middle, outer[1:]])


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
    zero, places = np.asarray(panel.zero, dtype=bool), np.arange(count)
    # estimates of next to nothing may be negative
    first = np.where(zero, 0.0, np.clip(data["first"], 0.0, data["total"]))
    total, half = (np.where(zero, 0.0, data[name]) for name in ("total", "interval"))
    axes.barh(places, first, height=0.62, color=list(colours))
    look: dict[str, Any] = {"facecolor": "white", "edgecolor": list(colours), "hatch": "//////"}
    look["error_kw"] = {"elinewidth": 0.9, "capsize": 2.0, "ecolor": INK}
    ends = axes.barh(places, total - first, left=first, xerr=half, height=0.62, lw=0.6, **look)
    texts = [f"{value:.2f}" if value >= _SHOWN_FROM else "" for value in total]
    texts = ["zero" if is_zero else text for text, is_zero in zip(texts, zero, strict=True)]
    axes.bar_label(ends, texts, padding=3, fontsize=7.0)
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
