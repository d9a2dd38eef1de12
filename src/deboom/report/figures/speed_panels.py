"""Small multiples over an engine order: Hz below, engine speed above, several curves each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import RealArray, finite, png, styled_figure
from deboom.report.figures.levels import rpm_axis
from deboom.report.style import FULL_WIDTH, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_HEIGHT = {1: 3.3, 2: 1.85, 3: 1.6}  # in, by the number of columns
_DASH, _GAP = 4.0, 1.6  # in line widths

_Dash = tuple[float, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class SpeedPanel:
    """One panel of curves over the frequency of an engine order.

    Parameters
    ----------
    title : str
        What the panel shows.
    curves : mapping of str to array, shape (n_frequency,)
        Label → values [unit in the axis label]; nan where there is none.
    note : str
        Short, on the right above the panel.
    peaks : mapping of str to (array, array)
        Label of a curve → frequencies and values of its marked points.
    """

    title: str
    curves: Mapping[str, npt.ArrayLike]
    note: str = ""
    peaks: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]] = field(default_factory=dict)


def speed_panels(
    frequency: npt.ArrayLike,
    order: float,
    panels: Sequence[SpeedPanel],
    *,
    y_label: str,
    colours: Mapping[str, str],
    dashed: Sequence[str] = (),
    columns: int = 2,
    depth: float | None = None,
) -> bytes:
    """Draw panels over one frequency axis, on one scale, with one legend.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Lines [Hz].
    order : float
        Engine order of the lines [1]; gives the rpm axis.
    panels : sequence of SpeedPanel
        At least one.
    y_label : str
        With its unit.
    colours : mapping of str to str
        Of every label, in the order of the legend.
    dashed : sequence of str
        Labels whose curves are dashed, in turns: curves that coincide stay visible.
    columns : int
        Panels per row, up to 3.
    depth : float, optional
        How far below the highest value the scale ends, for levels with notches [unit of y]; by
        default everything is shown.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        No panel, curves of another length, a label without colour.
    """
    if not panels:
        raise InputError("figure speed_panels: there is no panel to draw")
    lines = finite("speed_panels", {"frequency": frequency})["frequency"]
    drawn = [_checked(panel, lines, colours) for panel in panels]
    looks = _dashes(dashed)
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 1.1 + rows * _PANEL_HEIGHT[columns]) as figure:
        grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for place, (axes, panel, curves) in enumerate(zip(grid, panels, drawn, strict=False)):
            _draw(axes, lines, panel, curves, colours, looks)
            if place < columns:
                rpm_axis(axes, order)
            if place + columns >= len(panels):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel("frequency [Hz]")
            if place % columns == 0:
                axes.set_ylabel(y_label)
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        grid[0].set_xlim(lines[0], lines[-1])
        if depth is not None:
            highest = max(float(np.nanmax(curve)) for curves in drawn for curve in curves.values())
            grid[0].set_ylim(highest - depth, highest + 0.06 * depth)
        there = [name for name in colours if any(name in curves for curves in drawn)]
        _legend(figure, there, colours, looks)
        return png(figure)


def _checked(
    panel: SpeedPanel, lines: RealArray, colours: Mapping[str, str]
) -> dict[str, RealArray]:
    curves = {name: np.asarray(values, dtype=float) for name, values in panel.curves.items()}
    for name, values in curves.items():
        if values.shape != lines.shape or not np.isfinite(values).any():
            raise InputError(
                f"figure speed_panels: {name} in '{panel.title}' has shape {values.shape}, "
                f"expected {lines.shape} with finite values"
            )
        if name not in colours:
            raise InputError(f"figure speed_panels: '{name}' has no colour")
    return curves


def _dashes(dashed: Sequence[str]) -> dict[str, _Dash]:
    """Give each dashed label its turn; the gap of several holds the dashes of the others."""
    turn = _DASH + _GAP / len(dashed) if dashed else 0.0
    gap = max(len(dashed) - 1, 0) * turn + _GAP / max(len(dashed), 1)
    return {name: (k * turn, (_DASH, gap)) for k, name in enumerate(dashed)}


def _draw(
    axes: Axes,
    lines: RealArray,
    panel: SpeedPanel,
    curves: Mapping[str, RealArray],
    colours: Mapping[str, str],
    looks: Mapping[str, _Dash],
) -> None:
    for name, values in curves.items():
        axes.plot(
            lines,
            values,
            color=colours[name],
            linestyle=looks.get(name, "-"),
            linewidth=1.4,
        )
    for name, (x, y) in panel.peaks.items():
        axes.plot(x, y, "o", color=colours[name], markersize=3.5, markeredgecolor="white")
    axes.set_title(panel.title, loc="left", fontweight="bold")
    if panel.note:
        axes.set_title(panel.note, loc="right", fontsize=8.0, color=INK)


def _legend(
    figure: Figure, labels: Sequence[str], colours: Mapping[str, str], looks: Mapping[str, _Dash]
) -> None:
    from matplotlib.lines import Line2D

    single: _Dash = (0.0, (_DASH, _GAP))
    handles = [
        Line2D([], [], color=colours[name], linestyle=single if name in looks else "-", label=name)
        for name in labels
    ]
    if len(handles) > 1:
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 4))
