"""Curves over frequency and other small multiples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    FULL_WIDTH,
    INK,
    MUTED,
    TRACK,
    VEHICLE_PALETTE,
    finite,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_HEIGHT = 1.55
_TICKS = (10, 20, 30, 50, 70, 100, 150, 200, 300, 500)


@dataclass(frozen=True, eq=False)
class SpectrumPanel:
    """One panel over frequency.

    Parameters
    ----------
    title : str
        What the panel shows.
    y_label : str
        With unit.
    frequency : array, shape (n,)
        Increasing, above 0 [Hz].
    curves : mapping of str to array, shape (n,)
        Label → values. A label has the same colour in every panel.
    ranges : mapping of str to (array, array), each shape (n,)
        Label → lower and upper values, drawn as a shade under the curves.
    levels : mapping of str to float
        Label → a horizontal line, labelled at its place.
    logarithmic : bool
        Scale of the values.
    """

    title: str
    y_label: str
    frequency: npt.ArrayLike
    curves: Mapping[str, npt.ArrayLike]
    ranges: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]] = field(default_factory=dict)
    levels: Mapping[str, float] = field(default_factory=dict)
    logarithmic: bool = False


def spectra_panels(
    panels: Sequence[SpectrumPanel],
    *,
    columns: int = 3,
    dashed: Sequence[str] = (),
    fitted: Sequence[tuple[float, float]] = (),
) -> Figure:
    """Draw panels over a logarithmic frequency axis, with one legend.

    Parameters
    ----------
    panels : sequence of SpectrumPanel
        At least one.
    columns : int
        Panels per row.
    dashed : sequence of str
        Labels whose curves are dashed and dark, such as a model's.
    fitted : sequence of (float, float)
        Frequency bands that are shaded: where a model was fitted [Hz].

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        No panel, arrays of different lengths, values that are not finite.
    """
    if not panels:
        raise InputError("figure spectra_panels: there is no panel to draw")
    labels = list(dict.fromkeys(name for p in panels for name in (*p.curves, *p.ranges)))
    plain = [name for name in labels if name not in dashed]
    colour = {name: VEHICLE_PALETTE[i % len(VEHICLE_PALETTE)] for i, name in enumerate(plain)}
    colour |= {name: INK for name in labels if name in dashed}
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 0.7 + rows * _PANEL_HEIGHT) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
        for place, (axes, panel) in enumerate(zip(grid.ravel(), panels, strict=False)):
            _draw(axes, panel, colour, dashed, fitted)
            axes.set_title(panel.title, loc="left", fontweight="bold")
            axes.set_ylabel(panel.y_label)
            if place + columns >= len(panels):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel("frequency [Hz]")
        for axes in grid.ravel()[len(panels) :]:
            axes.set_axis_off()
        _legend(figure, labels, colour, dashed, panels, shaded=bool(fitted))
        return figure


def frequency_axis(axes: Axes, lowest: float, highest: float) -> None:
    """Set a logarithmic frequency axis with plain numbers."""
    from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

    axes.set_xscale("log")
    axes.set_xlim(lowest, highest)
    axes.xaxis.set_major_locator(FixedLocator([t for t in _TICKS if lowest <= t <= highest]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())


def _draw(
    axes: Axes,
    panel: SpectrumPanel,
    colour: Mapping[str, str],
    dashed: Sequence[str],
    fitted: Sequence[tuple[float, float]],
) -> None:
    from matplotlib.ticker import NullLocator

    data = finite("spectra_panels", {"frequency": panel.frequency, **panel.curves})
    frequency = data["frequency"]
    for low, high in fitted:
        axes.axvspan(low, high, color=TRACK, alpha=0.6, linewidth=0, zorder=0)
    for name, (below, above) in panel.ranges.items():
        pair = finite("spectra_panels", {"low": below, "high": above})
        axes.fill_between(
            frequency, pair["low"], pair["high"], color=colour[name], alpha=0.3, linewidth=0
        )
    for name in panel.curves:
        model = name in dashed
        axes.plot(
            frequency,
            data[name],
            color=colour[name],
            ls=(0, (4, 1.6)) if model else "-",
            linewidth=1.0 if model else 1.4,
            zorder=3 if model else 2,
        )
    for name, level in panel.levels.items():
        axes.axhline(level, color=MUTED, linewidth=0.9, ls=":")
        axes.annotate(
            name,
            (1.0, level),
            xycoords=("axes fraction", "data"),
            xytext=(-2, 2),
            textcoords="offset points",
            ha="right",
            fontsize=7.5,
            color=MUTED,
        )
    if panel.logarithmic:
        axes.set_yscale("log")
        axes.yaxis.set_minor_locator(NullLocator())
    frequency_axis(axes, frequency[0], frequency[-1])


def _legend(
    figure: Figure,
    labels: Sequence[str],
    colour: Mapping[str, str],
    dashed: Sequence[str],
    panels: Sequence[SpectrumPanel],
    *,
    shaded: bool,
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    drawn = {name for panel in panels for name in panel.curves}
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=colour[name], ls=(0, (4, 1.6)) if name in dashed else "-", label=name)
        if name in drawn
        else Patch(color=colour[name], alpha=0.3, linewidth=0, label=name)
        for name in labels
    ]
    if shaded:
        handles.append(Patch(color=TRACK, label="lines of the fit"))
    if len(handles) > 1:
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 4))


_PANEL_HEIGHT_2 = 1.65


@dataclass(frozen=True, eq=False)
class CurvePanel:
    """One panel of curves over a common abscissa.

    Parameters
    ----------
    title : str
        What the panel shows.
    abscissa : array, shape (n,)
        [unit in the axis label].
    curves : mapping of str to array, shape (n,)
        Label → values [unit in the axis label]. A label has the same colour in every panel.
    points : mapping of str to (array, array)
        Label → abscissa and values of single points, drawn under the curves.
    """

    title: str
    abscissa: npt.ArrayLike
    curves: Mapping[str, npt.ArrayLike]
    points: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class MapPanel:
    """One panel of points whose colour is a value.

    Parameters
    ----------
    title : str
        What the panel shows.
    x, y, value : array, shape (n,)
        [units in the labels].
    """

    title: str
    x: npt.ArrayLike
    y: npt.ArrayLike
    value: npt.ArrayLike


def curve_panels(
    panels: Sequence[CurvePanel],
    *,
    x_label: str,
    y_label: str,
    columns: int = 3,
    dashed: Sequence[str] = (),
    share_y: bool = False,
) -> Figure:
    """Draw panels of curves with one legend.

    Parameters
    ----------
    panels : sequence of CurvePanel
        At least one.
    x_label, y_label : str
        Axis labels with units.
    columns : int
        Panels per row.
    dashed : sequence of str
        Labels whose curves are dashed, such as what was measured.
    share_y : bool
        One scale for all panels.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        No panel, arrays of different lengths, values that are not finite.
    """
    if not panels:
        raise InputError("figure curve_panels: there is no panel to draw")
    labels = list(dict.fromkeys(name for p in panels for name in (*p.points, *p.curves)))
    colour = {name: _colour(place) for place, name in enumerate(labels)}
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 0.75 + rows * _PANEL_HEIGHT_2) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharey=share_y, sharex=True)
        for place, (axes, panel) in enumerate(zip(grid.ravel(), panels, strict=False)):
            for name, (x, y) in panel.points.items():
                pair = finite("curve_panels", {f"{name} x": x, f"{name} y": y})
                axes.plot(*pair.values(), ".", color=colour[name], markersize=1.5, alpha=0.5)
            lines = finite("curve_panels", {"abscissa": panel.abscissa, **panel.curves})
            for name in panel.curves:
                style = (0, (4, 1.6)) if name in dashed else "-"
                width = 1.1 if name in dashed else 1.3
                axes.plot(
                    lines["abscissa"], lines[name], color=colour[name], ls=style, linewidth=width
                )
            axes.set_title(panel.title, loc="left", fontweight="bold")
            _outer_labels(axes, place, columns, len(panels), x_label, y_label)
        for axes in grid.ravel()[len(panels) :]:
            axes.set_axis_off()
        _curve_legend(figure, labels, colour, panels, dashed)
        return figure


def map_panels(
    panels: Sequence[MapPanel],
    *,
    x_label: str,
    y_label: str,
    value_label: str,
    columns: int = 3,
) -> Figure:
    """Draw panels of coloured points, each with a colour scale of its own.

    Parameters
    ----------
    panels : sequence of MapPanel
        At least one.
    x_label, y_label, value_label : str
        Labels with units; the last one is that of all colour scales.
    columns : int
        Panels per row.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        No panel, arrays of different lengths, values that are not finite.
    """
    if not panels:
        raise InputError("figure map_panels: there is no panel to draw")
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 0.75 + rows * _PANEL_HEIGHT_2) as figure:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        for place, (axes, panel) in enumerate(zip(grid.ravel(), panels, strict=False)):
            data = finite("map_panels", {"x": panel.x, "y": panel.y, "value": panel.value})
            # the extreme single points would take the whole scale
            low, high = np.quantile(data["value"], (0.01, 0.99))
            shown = axes.scatter(
                data["x"],
                data["y"],
                c=data["value"],
                s=2.0,
                cmap="viridis",
                vmin=low,
                vmax=max(high, low + 1e-12),
                linewidths=0,
            )
            figure.colorbar(shown, ax=axes, pad=0.02, extend="both")
            axes.set_title(panel.title, loc="left", fontweight="bold")
            _outer_labels(axes, place, columns, len(panels), x_label, y_label)
        for axes in grid.ravel()[len(panels) :]:
            axes.set_axis_off()
        figure.suptitle(f"colour: {value_label}", x=0.99, ha="right", fontsize=8.5, color=MUTED)
        return figure


def _colour(place: int) -> str:
    return VEHICLE_PALETTE[place % len(VEHICLE_PALETTE)]


def _outer_labels(
    axes: Axes, place: int, columns: int, count: int, x_label: str, y_label: str
) -> None:
    if place % columns == 0:
        axes.set_ylabel(y_label)
    if place + columns >= count:
        axes.tick_params(labelbottom=True)
        axes.set_xlabel(x_label)


def _curve_legend(
    figure: Figure,
    labels: Sequence[str],
    colour: Mapping[str, str],
    panels: Sequence[CurvePanel],
    dashed: Sequence[str],
) -> None:
    from matplotlib.lines import Line2D

    if len(labels) < 2:
        return
    with_points = {name for panel in panels for name in panel.points}
    handles = [
        Line2D([], [], linestyle="none", marker=".", color=colour[name], label=name)
        if name in with_points
        else Line2D(
            [],
            [],
            color=colour.get(name, INK),
            ls=(0, (4, 1.6)) if name in dashed else "-",
            label=name,
        )
        for name in labels
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 4))
