"""Curves over the frequency of a rotor, with the lines that are not to be trusted and why."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import RealArray, finite, png, styled_figure
from deboom.report.figures.levels import rpm_axis
from deboom.report.style import FULL_WIDTH, INK, MOUNT_PALETTE, MUTED, VEHICLE_PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_HEIGHT = {1: 2.0, 2: 1.75}  # in, by the number of columns
_HATCHES = ("////", "....", "xxxx", "----")
_MASK_FACE, _MASK_EDGE = "#F1EFEA", "#BDB6A6"
_THINNEST, _WIDER, _WIDEST = 1.2, 0.4, 2.2  # pt
_LEGEND, _KEY = 105, 7  # characters in a row of the legend, and of each key
_MARGIN = 0.08  # of the range of the trusted values, above and below
_ROOM = 2.0  # of that range at most, for values that are not trusted
_REST = (5, 95)  # percentiles of values that are not trusted, where nothing is

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class MaskedPanel:
    """One panel over the frequency of the rotor.

    Parameters
    ----------
    title : str
        What the panel shows.
    y_label : str
        With unit.
    frequency : array, shape (n,)
        Of the rotation, increasing [Hz].
    curves : mapping of str to array, shape (n,)
        Label → values. A label has the same colour in every panel.
    ranges : mapping of str to (array, array), each shape (n,)
        Label of a curve → lower and upper values, drawn as a shade in its colour.
    masked : mapping of str to bool array, shape (n,)
        Why lines are not to be trusted → which; the first reason of a line is shown.
    levels : mapping of str to float
        Label → a horizontal line, labelled at its place.
    note : str
        Short, on the right above the panel.
    logarithmic : bool
        Scale of the values.
    """

    title: str
    y_label: str
    frequency: npt.ArrayLike
    curves: Mapping[str, npt.ArrayLike]
    ranges: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]] = field(default_factory=dict)
    masked: Mapping[str, npt.ArrayLike] = field(default_factory=dict)
    levels: Mapping[str, float] = field(default_factory=dict)
    note: str = ""
    logarithmic: bool = False


def masked_panels(
    panels: Sequence[MaskedPanel],
    *,
    columns: int = 1,
    dashed: Sequence[str] = (),
    order: float = 1.0,
) -> bytes:
    """Draw panels with Hz below and rpm above, one legend for all.

    Parameters
    ----------
    panels : sequence of MaskedPanel
        At least one.
    columns : int
        Panels per row, 1 or 2.
    dashed : sequence of str
        Labels whose curves are dashed and dark, such as the truth.
    order : float
        Of the lines, per revolution [1].

    Returns
    -------
    bytes
        PNG. The scale is made for trusted lines; others may leave it.

    Raises
    ------
    InputError
        No panel, arrays of different lengths, values that are not finite.
    """
    if not panels:
        raise InputError("figure masked_panels: there is no panel to draw")
    labels = list(dict.fromkeys(name for panel in panels for name in panel.curves))
    plain = [name for name in labels if name not in dashed]
    palette = (*VEHICLE_PALETTE, *MOUNT_PALETTE)
    colour = {name: palette[i % len(palette)] for i, name in enumerate(plain)}
    colour |= {name: INK for name in labels if name in dashed}
    reasons = list(dict.fromkeys(reason for panel in panels for reason in _shown(panel)))
    hatch = {reason: _HATCHES[i % len(_HATCHES)] for i, reason in enumerate(reasons)}
    rows = -(-len(panels) // columns)
    with styled_figure(FULL_WIDTH, 1.0 + 0.18 * len(reasons) + rows * _PANEL_HEIGHT[columns]) as (
        figure
    ):
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
            _draw(axes, panel, colour, hatch, dashed)
            if place < columns or _span(panel) != _span(panels[place - columns]):
                rpm_axis(axes, order, "rotor speed [rpm]")
            if place + columns >= len(panels):
                axes.set_xlabel("frequency [Hz]")
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        _legend(figure, colour, hatch, dashed)
        return png(figure)


def _draw(
    axes: Axes,
    panel: MaskedPanel,
    colour: Mapping[str, str],
    hatch: Mapping[str, str],
    dashed: Sequence[str],
) -> None:
    data = finite("masked_panels", {"frequency": panel.frequency, **panel.curves})
    shades = {
        name: finite("masked_panels", {"frequency": panel.frequency, "low": low, "high": high})
        for name, (low, high) in panel.ranges.items()
    }
    lines = data.pop("frequency")
    shown = _shown(panel)
    for name, mask in shown.items():
        for low, high in _spans(lines, mask):
            axes.axvspan(
                low,
                high,
                facecolor=_MASK_FACE,
                edgecolor=_MASK_EDGE,
                hatch=hatch[name],
                linewidth=0,
                zorder=0,
            )
    for name, shade in shades.items():
        axes.fill_between(
            lines, shade["low"], shade["high"], color=colour[name], alpha=0.25, linewidth=0
        )
    last = max((place for place, name in enumerate(data) if name not in dashed), default=0)
    for place, (name, values) in enumerate(data.items()):
        model = name in dashed
        axes.plot(
            lines,
            values,
            color=colour[name],
            ls=(0, (4, 1.6)) if model else "-",
            # thinner ones over wider ones: curves that coincide stay visible
            linewidth=1.0 if model else min(_THINNEST + _WIDER * (last - place), _WIDEST),
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
        _plain_logarithmic(axes)
    else:
        bounds = [part for shade in shades.values() for part in (shade["low"], shade["high"])]
        free = ~np.any([*shown.values(), np.zeros(lines.size, dtype=bool)], axis=0)
        axes.set_ylim(*_scale([*data.values(), *bounds], free, list(panel.levels.values())))
    axes.set_xlim(lines[0], lines[-1])
    axes.set_ylabel(panel.y_label)
    axes.set_title(panel.title, loc="left", fontweight="bold")
    if panel.note:
        axes.set_title(panel.note, loc="right", fontsize=8.0, color=INK)


def _span(panel: MaskedPanel) -> tuple[float, float]:
    lines = np.asarray(panel.frequency, dtype=float)
    return float(lines[0]), float(lines[-1])


def _plain_logarithmic(axes: Axes) -> None:
    """Set a logarithmic scale with few plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _shown(panel: MaskedPanel) -> dict[str, Mask]:
    """Give each line its first reason; reasons without a line are left out."""
    free = np.ones(np.shape(panel.frequency), dtype=bool)
    shown = {}
    for name, given in panel.masked.items():
        mask = np.asarray(given, dtype=bool)
        if mask.shape != free.shape:
            raise InputError(f"figure masked_panels: the mask '{name}' has other lines")
        if np.any(mask & free):
            shown[name] = mask & free
        free &= ~mask
    return shown


def _spans(lines: RealArray, mask: Mask) -> list[tuple[float, float]]:
    """Join neighbouring lines of a mask; each reaches half way to the next one."""
    edges = np.concatenate([lines[:1], 0.5 * (lines[1:] + lines[:-1]), lines[-1:]])
    steps = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [
        (float(edges[a]), float(edges[b])) for a, b in zip(steps[::2], steps[1::2], strict=True)
    ]


def _scale(
    drawn: Sequence[RealArray], trusted: Mask, levels: Sequence[float]
) -> tuple[float, float]:
    """Range of the trusted values, or of most where none is, with room for some of the others."""
    stacked = np.array(drawn)
    kept = stacked[:, trusted] if trusted.any() else np.percentile(stacked, _REST)
    low, high = float(np.min(kept)), float(np.max(kept))
    room = _ROOM * (high - low)
    low = min([max(low - room, float(stacked.min())), *levels])
    high = max([min(high + room, float(stacked.max())), *levels])
    margin = _MARGIN * (high - low or abs(high) or 1.0)
    return low - margin, high + margin


def _legend(
    figure: Figure, colour: Mapping[str, str], hatch: Mapping[str, str], dashed: Sequence[str]
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Line2D | Patch] = [
        Line2D([], [], color=shade, ls=(0, (4, 1.6)) if name in dashed else "-", label=name)
        for name, shade in colour.items()
    ]
    handles += [
        Patch(
            facecolor=_MASK_FACE,
            edgecolor=_MASK_EDGE,
            hatch=pattern,
            linewidth=0,
            label=textwrap.fill(f"not to be trusted: {reason}", _LEGEND - 10),
        )
        for reason, pattern in hatch.items()
    ]
    if len(handles) > 1:
        widest = max(len(str(handle.get_label())) for handle in handles) + _KEY
        columns = min(len(handles), 4, max(_LEGEND // widest, 1))
        figure.legend(handles=handles, loc="outside lower center", ncols=columns)
