"""Sound pressure levels and other curves over frequency and engine speed."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    FULL_WIDTH,
    INK,
    MOUNT_PALETTE,
    MUTED,
    VEHICLE_PALETTE,
    RealArray,
    finite,
    freeze_layout,
    place_labels,
    signed,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

_PANEL_HEIGHT = {1: 2.9, 2: 1.85, 3: 1.6}  # in, by the number of columns
_RANGE = 50.0  # dB below the loudest line; deeper notches leave the panel
_HEADROOM = 9.0  # dB above the loudest line, for marker and label
_ABOVE = 1.8  # dB between a curve and the tip that points at its peak
_SAME_PEAK = 1.5  # Hz; a peak that stayed where it was is labelled once


def spl_curves(
    frequency: npt.ArrayLike,
    order: float,
    baseline: npt.ArrayLike,
    optimised: npt.ArrayLike,
    vehicles: Sequence[str],
    peaks_before: Sequence[npt.ArrayLike],
    peaks_after: Sequence[npt.ArrayLike],
    colours: Mapping[str, str],
) -> Figure:
    """Draw one panel per vehicle, Hz below and rpm above, all on one dB scale.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Lines [Hz].
    order : float
        Engine order of the lines [1]; gives the rpm axis.
    baseline, optimised : array, shape (n_vehicle, n_frequency)
        SPL [dB(A)].
    vehicles : sequence of str
        Name of each row.
    peaks_before, peaks_after : sequence of arrays
        Frequencies of the booming peaks of each vehicle [Hz], for baseline and optimised.
    colours : mapping of str to str
        Colour of each vehicle, from `deboom.plot.style.vehicle_colours`.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        Shapes that disagree or values that are not finite.

    Notes
    -----
    As the text of the thesis on its Figure 47: baseline dashed, optimised solid. The scale ends
    50 dB below the loudest line; deeper notches leave the panel.
    """
    lines = finite("spl_curves", {"frequency": frequency})["frequency"]
    rows = finite(
        "spl_curves",
        {
            "baseline": baseline,
            "optimised": optimised,
            "vehicles": np.zeros(len(vehicles)),
            "peaks_before": np.zeros(len(peaks_before)),
            "peaks_after": np.zeros(len(peaks_after)),
        },
    )
    for name in ("baseline", "optimised"):
        if rows[name].shape != (len(vehicles), lines.size):
            raise InputError(
                f"figure spl_curves: {name} has shape {rows[name].shape}, expected (n_vehicle, "
                f"n_frequency) = ({len(vehicles)}, {lines.size})"
            )
    columns = min(len(vehicles), 2 if len(vehicles) <= 6 else 3)
    n_rows = -(-len(vehicles) // columns)
    with styled_figure(FULL_WIDTH, 1.15 + n_rows * _PANEL_HEIGHT[columns]) as figure:
        figure.get_layout_engine().set(wspace=0.06)  # type: ignore[union-attr, call-arg]
        panels = _panels(figure, n_rows, columns, len(vehicles))
        for place, (axes, name) in enumerate(zip(panels, vehicles, strict=True)):
            _curves(axes, lines, rows["baseline"][place], rows["optimised"][place], colours[name])
            axes.set_title(name, loc="left", fontweight="bold")
            change = float(np.mean(rows["optimised"][place] - rows["baseline"][place]))
            axes.set_title(f"mean change {signed(change, 1)} dB", loc="right", fontsize=8.0)
            if place < columns:
                rpm_axis(axes, order)
            if place + columns >= len(vehicles):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel("frequency [Hz]")
            if place % columns == 0:
                axes.set_ylabel("SPL [dB(A)]")
        _level_axis(panels[0], lines, np.vstack([rows["baseline"], rows["optimised"]]))
        _legend(figure, panels, n_rows * columns)
        freeze_layout(figure)
        for place, axes in enumerate(panels):
            curves = (rows["baseline"][place], rows["optimised"][place])
            peaks = (np.asarray(peaks_before[place]), np.asarray(peaks_after[place]))
            _peaks(axes, lines, curves, peaks, colours[vehicles[place]])
        return figure


def _panels(figure: Figure, n_rows: int, columns: int, count: int) -> list[Axes]:
    grid = figure.subplots(n_rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.set_axis_off()
    return list(grid[:count])


def _curves(
    axes: Axes, frequency: RealArray, before: RealArray, after: RealArray, colour: str
) -> None:
    quieter = after < before
    axes.fill_between(
        frequency, before, after, where=quieter, color=colour, alpha=0.22, linewidth=0.0
    )
    axes.plot(frequency, before, color=MUTED, linewidth=1.1, linestyle=(0, (4, 1.6)))
    axes.plot(frequency, after, color=colour, linewidth=1.5)


def rpm_axis(axes: Axes, order: float, label: str = "engine speed [rpm]") -> None:
    """Put the speed above a frequency axis [Hz] of an order."""
    from matplotlib.ticker import MaxNLocator

    def rpm(frequency: npt.ArrayLike) -> npt.ArrayLike:
        return np.asarray(frequency, dtype=float) * 60.0 / order

    def hertz(speed: npt.ArrayLike) -> npt.ArrayLike:
        return np.asarray(speed, dtype=float) * order / 60.0

    top = axes.secondary_xaxis("top", functions=(rpm, hertz))
    top.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 4, 5, 10]))
    top.set_xlabel(label)


def _level_axis(axes: Axes, frequency: RealArray, levels: RealArray) -> None:
    """Grid of 10 dB with 5 dB between; the panels share it."""
    from matplotlib.ticker import MultipleLocator

    highest = 5.0 * np.ceil((levels.max() + _HEADROOM) / 5.0)
    lowest = 5.0 * np.floor(max(levels.min(), levels.max() - _RANGE) / 5.0)
    axes.set_ylim(lowest, highest)
    axes.set_xlim(frequency[0], frequency[-1])
    axes.yaxis.set_major_locator(MultipleLocator(10.0))
    axes.yaxis.set_minor_locator(MultipleLocator(5.0))
    for panel in axes.get_figure().axes:  # type: ignore[union-attr]
        panel.grid(True, which="minor", axis="y", linewidth=0.4)


def _legend(figure: Figure, panels: list[Axes], cells: int) -> None:
    handles: list[Line2D | Patch] = _legend_handles()
    if len(panels) < cells:
        free = figure.axes[len(panels)]
        free.legend(handles=handles, loc="center left", fontsize=8.5)
    else:
        figure.legend(handles=handles, loc="outside lower center", ncols=3)


def _legend_handles() -> list[Line2D | Patch]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    return [
        Line2D([], [], color=MUTED, linewidth=1.1, linestyle=(0, (4, 1.6)), label="baseline"),
        Line2D([], [], color=INK, linewidth=1.5, label="optimised"),
        Patch(facecolor=INK, alpha=0.22, label="quieter than baseline"),
        _peak_marker("v", "white", MUTED, "booming peak [Hz], baseline"),
        _peak_marker("^", INK, INK, "booming peak [Hz], optimised"),
    ]


def _peak_marker(shape: str, face: str, edge: str, label: str) -> Line2D:
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        linestyle="none",
        marker=shape,
        markersize=6,
        markerfacecolor=face,
        markeredgecolor=edge,
        label=label,
    )


def _peaks(
    axes: Axes,
    frequency: RealArray,
    curves: tuple[RealArray, RealArray],
    peaks: tuple[RealArray, RealArray],
    colour: str,
) -> None:
    """Mark the peaks of both curves and write the frequency of each place once."""
    looks = (("v", _ABOVE, "white", MUTED), ("^", -_ABOVE, colour, colour))
    for curve, found, (shape, above, face, edge) in zip(curves, peaks, looks, strict=True):
        axes.plot(
            found,
            np.interp(found, frequency, curve) + above,
            shape,
            markersize=5,
            markerfacecolor=face,
            markeredgecolor=edge,
            linestyle="none",
        )
    before, after = peaks
    moved = [f for f in after if not np.any(np.abs(before - f) < _SAME_PEAK)]
    labelled = np.concatenate([before, np.asarray(moved, dtype=float)])
    heights = np.maximum(*(np.interp(labelled, frequency, curve) for curve in curves)) + _ABOVE
    every = np.concatenate([np.column_stack([frequency, curve]) for curve in curves])
    place_labels(
        axes,
        np.column_stack([labelled, heights]),
        [f"{f:.1f}" for f in labelled],
        [INK] * labelled.size,
        obstacles=every,
        size=7.0,
    )


_PANEL_HEIGHT_2 = {1: 3.3, 2: 1.85, 3: 1.6}  # in, by the number of columns
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
) -> Figure:
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
    Figure

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
    with styled_figure(FULL_WIDTH, 1.1 + rows * _PANEL_HEIGHT_2[columns]) as figure:
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
        _legend_2(figure, there, colours, looks)
        return figure


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


def _legend_2(
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


_PANEL_HEIGHT_3 = {1: 2.0, 2: 1.75}  # in, by the number of columns
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
) -> Figure:
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
    Figure The scale is made for trusted lines; others may leave it.

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
    with styled_figure(FULL_WIDTH, 1.0 + 0.18 * len(reasons) + rows * _PANEL_HEIGHT_3[columns]) as (
        figure
    ):
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
            _draw_3(axes, panel, colour, hatch, dashed)
            if place < columns or _span(panel) != _span(panels[place - columns]):
                rpm_axis(axes, order, "rotor speed [rpm]")
            if place + columns >= len(panels):
                axes.set_xlabel("frequency [Hz]")
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        _legend_3(figure, colour, hatch, dashed)
        return figure


def _draw_3(
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


def _legend_3(
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
