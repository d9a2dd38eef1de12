"""Curves over frequency: what was measured, what was identified, how surely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, MUTED, TRACK, VEHICLE_PALETTE

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
) -> bytes:
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
    bytes
        PNG.

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
        return png(figure)


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
