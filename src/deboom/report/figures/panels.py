"""Small multiples: curves, and points coloured by a value, one panel per thing compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, MUTED, VEHICLE_PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_HEIGHT = 1.65


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
) -> bytes:
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
    bytes
        PNG.

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
    with styled_figure(FULL_WIDTH, 0.75 + rows * _PANEL_HEIGHT) as figure:
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
        return png(figure)


def map_panels(
    panels: Sequence[MapPanel],
    *,
    x_label: str,
    y_label: str,
    value_label: str,
    columns: int = 3,
) -> bytes:
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
    bytes
        PNG.

    Raises
    ------
    InputError
        No panel, arrays of different lengths, values that are not finite.
    """
    if not panels:
        raise InputError("figure map_panels: there is no panel to draw")
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 0.75 + rows * _PANEL_HEIGHT) as figure:
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
        return png(figure)


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
