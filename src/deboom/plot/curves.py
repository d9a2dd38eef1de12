"""Small multiples of curves over frequency, speed and other abscissae; levels before and after."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    FULL_WIDTH,
    INK,
    MOUNT_PALETTE,
    MUTED,
    TRACK,
    VEHICLE_PALETTE,
    RealArray,
    finite,
    halo,
    panel_grid,
    signed,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_HEIGHT = {1: 2.3, 2: 1.85, 3: 1.6, 4: 1.6}  # in, by the number of columns
_DASH, _GAP = 4.0, 1.6  # in line widths
_TICKS = (10, 20, 30, 50, 70, 100, 150, 200, 300, 500)  # Hz
_HATCHES = ("////", "....", "xxxx", "----")
_MASK_FACE, _MASK_EDGE = "#F1EFEA", "#BDB6A6"
_FEW_DECADES = 300.0  # ratio of the ends of a logarithmic axis below which 2 and 5 have room
_THINNEST, _WIDER, _WIDEST = 1.2, 0.4, 2.2  # pt
_LEGEND, _KEY = 105, 7  # characters in a row of the legend, and of each key
_MARGIN = 0.08  # of the range of the trusted values, above and below
_ROOM = 2.0  # of that range at most, for values that are not trusted
_REST = (5, 95)  # percentiles of values that are not trusted, where nothing is

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CurvePanel:
    """One panel of curves over a common abscissa; a label has one colour in all panels.

    - `title`: what the panel shows; `note`: short, on the right below it.
    - `abscissa` (n,): rising; `curves`: label → values (n,) [units of the axis labels].
    - `points`: label → abscissa and values; on a curve of that label dots, else a cloud below.
    - `ranges`: label → lower and upper values (n,), a shade in the colour of that label.
    - `masked`: reason not to trust lines → which, bool (n,); a line shows its first reason, and
      the scale is made for the others.
    - `levels`: label → a horizontal line.
    - `x_label`, `y_label`: with units, where panels have labels of their own; `logarithmic`: the
      scale of y.
    """

    title: str
    abscissa: npt.ArrayLike
    curves: Mapping[str, npt.ArrayLike]
    points: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]] = field(default_factory=dict)
    ranges: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]] = field(default_factory=dict)
    masked: Mapping[str, npt.ArrayLike] = field(default_factory=dict)
    levels: Mapping[str, float] = field(default_factory=dict)
    y_label: str = ""
    note: str = ""
    logarithmic: bool = False
    x_label: str = ""


@dataclass(frozen=True)
class _Looks:
    """Colour, line style and hatch of every label."""

    colour: Mapping[str, str]
    line: Mapping[str, tuple[float, tuple[float, float]]]
    hatch: Mapping[str, str]


def curve_panels(
    panels: Sequence[CurvePanel],
    *,
    x_label: str = "frequency [Hz]",
    y_label: str = "",
    columns: int = 3,
    dashed: Sequence[str] = (),
    colours: Mapping[str, str] | None = None,
    share_y: bool = False,
    order: float | None = None,
    speed_label: str = "engine speed [rpm]",
    log_frequency: bool = False,
    fitted: Sequence[tuple[float, float]] = (),
    depth: float | None = None,
    width: float = FULL_WIDTH,
    panel_height: float | None = None,
) -> Figure:
    """Draw panels of curves, with one legend for all.

    - `panels`: at least one; `columns`: per row, up to 4.
    - `x_label`, `y_label`: with units; a panel's own come first.
    - `dashed`: labels whose curves are dashed, in turns: curves that coincide stay visible. A
      single one, such as what was measured, is dark.
    - `colours`: of every label, in the order of the legend; by default the palette.
    - `share_y`: one scale for all panels.
    - `order`: of the lines, per revolution [1]: puts the speed above the panels; `speed_label`: of
      what turns.
    - `log_frequency`: logarithmic frequency axis.
    - `fitted`: frequency bands that are shaded: where a model was fitted [Hz].
    - `depth`: how far below the highest value the scale ends, for levels with notches [unit of y].
    - `width`: of the figure [inch]; `panel_height`: of each row, which default suits the columns.
    - raises InputError: no panel, arrays of different lengths, values that are not finite, a label
      without colour, a mask of other lines.
    """
    names = dict.fromkeys(n for p in panels for n in (*p.points, *p.curves, *p.ranges))
    looks = _looks(panels, list(names), dashed, colours)
    spans = [_span(panel) for panel in panels]
    alike = len(set(spans)) <= 1
    columns = min(columns, max(len(panels), 1))
    height = 0.9 + 0.18 * len(looks.hatch) + 0.15 * (order is not None)
    if panel_height is None:
        panel_height = _PANEL_HEIGHT[columns] * np.sqrt(width / FULL_WIDTH)
    with panel_grid(
        "curve_panels", len(panels), columns, height, panel_height, alike, share_y, width
    ) as (figure, grid):
        drawn = []
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=True)):
            for low, high in fitted:
                axes.axvspan(low, high, color=TRACK, alpha=0.6, linewidth=0, zorder=0)
            drawn.append(_draw(axes, panel, looks, free_scale=not share_y and depth is None))
            if log_frequency and (place == 0 or not alike):
                frequency_axis(axes, *spans[place])
            above = place - columns
            if order is not None and (above < 0 or spans[place] != spans[above]):
                rpm_axis(axes, order, speed_label)
            if place + columns >= len(panels):
                axes.tick_params(labelbottom=True)
            if panel.x_label or place + columns >= len(panels):
                axes.set_xlabel(panel.x_label or x_label)
            if panel.y_label or place % columns == 0:
                axes.set_ylabel(panel.y_label or y_label)
        if depth is not None:
            highest = max(float(np.max(curve)) for curves in drawn for curve in curves.values())
            for axes in grid:
                axes.set_ylim(highest - depth, highest + 0.06 * depth)
        _legend(figure, panels, looks, shaded=bool(fitted))
        return figure


def _looks(
    panels: Sequence[CurvePanel],
    names: list[str],
    dashed: Sequence[str],
    colours: Mapping[str, str] | None,
) -> _Looks:
    """Give every label its looks; the gap of several dashed ones holds the dashes of the others."""
    if colours is None:
        dark = dashed if len(dashed) == 1 else ()
        palette = (*VEHICLE_PALETTE, *MOUNT_PALETTE)
        plain = [name for name in names if name not in dark]
        colour = {name: palette[k % len(palette)] for k, name in enumerate(plain)}
        colour |= {name: INK for name in names if name in dark}
    else:
        unknown = [name for name in names if name not in colours]
        if unknown:
            raise InputError(f"figure curve_panels: '{unknown[0]}' has no colour")
        colour = {name: shade for name, shade in colours.items() if name in names}
    turn = _DASH + _GAP / len(dashed) if dashed else 0.0
    gap = max(len(dashed) - 1, 0) * turn + _GAP / max(len(dashed), 1)
    line = {name: (k * turn, (_DASH, gap)) for k, name in enumerate(dashed)}
    reasons = list(dict.fromkeys(reason for panel in panels for reason in _shown(panel)))
    hatch = {reason: _HATCHES[k % len(_HATCHES)] for k, reason in enumerate(reasons)}
    return _Looks(colour, line, hatch)


def _draw(
    axes: Axes, panel: CurvePanel, looks: _Looks, *, free_scale: bool
) -> dict[str, RealArray]:
    """Draw one panel and return its curves."""
    data = finite("curve_panels", {"abscissa": panel.abscissa, **panel.curves})
    lines, shown = data.pop("abscissa"), _shown(panel)
    for reason, mask in shown.items():
        for start, end in _spans(lines, mask):
            axes.axvspan(start, end, zorder=0, **_masked_look(looks.hatch[reason]))
    bounds: list[RealArray] = []
    for name, (below, above) in panel.ranges.items():
        pair = finite("curve_panels", {"abscissa": lines, "low": below, "high": above})
        bounds += [pair["low"], pair["high"]]
        axes.fill_between(
            lines, pair["low"], pair["high"], color=looks.colour[name], alpha=0.25, linewidth=0
        )
    for name, (x, y) in panel.points.items():
        pair = finite("curve_panels", {f"{name} x": x, f"{name} y": y})
        look = {"ms": 3.5, "mec": "white", "mew": 0.3} if name in data else {"ms": 1.6, "mew": 0.0}
        axes.plot(*pair.values(), "o", color=looks.colour[name], **look)
    plain = [name for name in data if name not in looks.line]
    for name, values in data.items():
        # thinner ones over wider ones: curves that coincide stay visible
        wider = len(plain) - 1 - plain.index(name) if name in plain else 0
        axes.plot(
            lines,
            values,
            color=looks.colour[name],
            ls=looks.line.get(name, "-"),
            lw=min(_THINNEST + _WIDER * wider, _WIDEST),
            zorder=2 if name in plain else 3,
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
        plain_logarithmic(axes)
    elif free_scale and all(name in data for name in panel.points):
        free = ~np.any([*shown.values(), np.zeros(lines.size, dtype=bool)], axis=0)
        axes.set_ylim(*_scale([*data.values(), *bounds], free, list(panel.levels.values())))
    if all(name in data for name in panel.points):
        axes.set_xlim(*_span(panel))
    axes.set_title(panel.title + ("\n" if panel.note else ""), loc="left", fontweight="bold")
    if panel.note:  # on a line of its own: panels are narrow on paper
        axes.set_title(panel.note, loc="right", fontsize=8.0, color=INK)
    return data


def _legend(figure: Figure, panels: Sequence[CurvePanel], looks: _Looks, *, shaded: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    curves = {name for panel in panels for name in panel.curves}
    clouds = {name for panel in panels for name in panel.points} - curves
    single = (0.0, (_DASH, _GAP))
    handles: list[Artist] = []
    for name, colour in looks.colour.items():
        if name in curves:
            style = single if name in looks.line else "-"
            handles.append(Line2D([], [], color=colour, ls=style, label=name))
        elif name in clouds:
            handles.append(Line2D([], [], color=colour, ls="none", marker=".", label=name))
        else:
            handles.append(Patch(color=colour, alpha=0.3, linewidth=0, label=name))
    for reason, hatch in looks.hatch.items():
        words = textwrap.fill(f"not to be trusted: {reason}", _LEGEND - 10)
        handles.append(Patch(label=words, **_masked_look(hatch)))
    if shaded:
        handles.append(Patch(color=TRACK, label="lines of the fit"))
    if len(handles) > 1:
        widest = max(len(str(handle.get_label())) for handle in handles) + _KEY
        columns = min(len(handles), 4, max(_LEGEND // widest, 1))
        figure.legend(handles=handles, loc="outside lower center", ncols=columns)


def _masked_look(hatch: str) -> dict[str, Any]:
    return {"facecolor": _MASK_FACE, "edgecolor": _MASK_EDGE, "hatch": hatch, "linewidth": 0}


def _span(panel: CurvePanel) -> tuple[float, float]:
    lines = finite("curve_panels", {"abscissa": panel.abscissa})["abscissa"]
    room = 0.5 if lines.min() == lines.max() else 0.0  # a curve of one value
    return float(lines.min()) - room, float(lines.max()) + room


def plain_logarithmic(axes: Axes) -> None:
    """Set a logarithmic scale with few plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    class FewTicks(LogLocator):
        """Ticks at 1, 2 and 5 of few decades, at 1 of many."""

        def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
            self.set_params(subs=(1.0, 2.0, 5.0) if vmax < _FEW_DECADES * vmin else (1.0,))
            return super().tick_values(vmin, vmax)

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(FewTicks())
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _shown(panel: CurvePanel) -> dict[str, Mask]:
    """Give each line its first reason; reasons without a line are left out."""
    free = np.ones(np.shape(panel.abscissa), dtype=bool)
    shown = {}
    for name, given in panel.masked.items():
        mask = np.asarray(given, dtype=bool)
        if mask.shape != free.shape:
            raise InputError(f"figure curve_panels: the mask '{name}' has other lines")
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


def frequency_axis(axes: Axes, lowest: float, highest: float) -> None:
    """Set a logarithmic frequency axis with plain numbers."""
    from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

    axes.set_xscale("log")
    axes.set_xlim(lowest, highest)
    axes.xaxis.set_major_locator(FixedLocator([t for t in _TICKS if lowest <= t <= highest]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())


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


_RANGE = 50.0  # dB below the loudest line; deeper notches leave the panel
_HEADROOM = 9.0  # dB above the loudest line, for marker and label
_ABOVE = 1.8  # dB between a curve and the tip that points at its peak
_CLOSE = 0.09  # share of the axis; of two peaks nearer than that the second is labelled higher
_SAME_PEAK = 1.5  # Hz; a peak that stayed where it was is labelled once


def spl_curves(
    frequency: npt.ArrayLike,
    order: float,
    today: npt.ArrayLike,
    new: npt.ArrayLike,
    vehicles: Sequence[str],
    peaks_before: Sequence[npt.ArrayLike],
    peaks_after: Sequence[npt.ArrayLike],
    colours: Mapping[str, str],
    *,
    speed_label: str = "engine speed [rpm]",
    change: npt.ArrayLike | None = None,
    width: float = FULL_WIDTH,
) -> Figure:
    """Draw levels before (dashed) and after, one panel per vehicle, all on one dB scale.

    - `frequency` (n_frequency,): lines [Hz]; `order`: per revolution [1], gives the speed above.
    - `today`, `new` (n_vehicle, n_frequency): SPL [dB(A)]; notches deeper than 50 dB below
      the loudest line leave the panel.
    - `peaks_before`, `peaks_after`: frequencies of the booming peaks of each vehicle [Hz].
    - `change` (n_vehicle,), optional: stated above each panel [dB]; by default that of its curves.
    - `colours`: of the vehicles; `speed_label`: what turns; `width`: of the figure [inch].
    - raises InputError: shapes that disagree or values that are not finite.
    """
    lines = finite("spl_curves", {"frequency": frequency})["frequency"]
    rows = finite(
        "spl_curves",
        {
            "today": today,
            "new": new,
            "vehicles": np.zeros(len(vehicles)),
            "peaks_before": np.zeros(len(peaks_before)),
            "peaks_after": np.zeros(len(peaks_after)),
        },
    )
    for name in ("today", "new"):
        if rows[name].shape != (len(vehicles), lines.size):
            raise InputError(
                f"figure spl_curves: {name} has shape {rows[name].shape}, expected (n_vehicle, "
                f"n_frequency) = ({len(vehicles)}, {lines.size})"
            )
    by_curves = np.mean(rows["new"] - rows["today"], axis=1)
    said = np.asarray(by_curves if change is None else change, dtype=float)
    columns = min(len(vehicles), 2 if len(vehicles) <= 6 else 3)
    row_height = {1: 2.9 * np.sqrt(width / FULL_WIDTH), 2: 1.6, 3: 1.6}[columns]
    with panel_grid("spl_curves", len(vehicles), columns, 1.15, row_height, True, True, width) as (
        figure,
        panels,
    ):
        figure.get_layout_engine().set(wspace=0.06)  # type: ignore[union-attr, call-arg]
        for place, (axes, name) in enumerate(zip(panels, vehicles, strict=True)):
            _curves(axes, lines, rows["today"][place], rows["new"][place], colours[name])
            axes.set_title(name, loc="left", fontweight="bold")
            axes.set_title(f"mean change {signed(said[place], 1)} dB", loc="right", fontsize=8.0)
            if place < columns:
                rpm_axis(axes, order, speed_label)
            if place + columns >= len(vehicles):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel("frequency [Hz]")
            if place % columns == 0:
                axes.set_ylabel("SPL [dB(A)]")
        _level_axis(panels[0], lines, np.vstack([rows["today"], rows["new"]]))
        for place, axes in enumerate(panels):
            curves = (rows["today"][place], rows["new"][place])
            peaks = (np.asarray(peaks_before[place]), np.asarray(peaks_after[place]))
            _peaks(axes, lines, curves, peaks, colours[vehicles[place]])
        if width == FULL_WIDTH:  # beside another figure the caption says it
            _spl_legend(figure, panels)
        return figure


def _curves(
    axes: Axes, frequency: RealArray, before: RealArray, after: RealArray, colour: str
) -> None:
    quieter, louder = after < before, after > before
    axes.plot(frequency, before, color=MUTED, lw=1.1, ls=(0, (4, 1.6)), label="today")
    axes.plot(frequency, after, color=colour, linewidth=1.5, label="new")
    axes.fill_between(
        frequency,
        before,
        after,
        where=quieter,
        color=colour,
        alpha=0.22,
        linewidth=0.0,
        label="quieter than today",
    )
    if louder.any():
        axes.fill_between(
            frequency,
            before,
            after,
            where=louder,
            facecolor="none",
            edgecolor=INK,
            hatch="//////",
            linewidth=0.0,
            label="louder than today",
        )


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


def _spl_legend(figure: Figure, panels: list[Axes]) -> None:
    shown = (zip(*axes.get_legend_handles_labels(), strict=True) for axes in panels)
    by_label = {label: handle for pairs in shown for handle, label in pairs}
    handles, labels = list(by_label.values()), list(by_label)
    if len(panels) < len(figure.axes):
        free = figure.axes[len(panels)]
        free.legend(handles, labels, loc="center left", fontsize=8.5)
    else:
        figure.legend(handles, labels, loc="outside lower center", ncols=3)


def _peaks(
    axes: Axes,
    frequency: RealArray,
    curves: tuple[RealArray, RealArray],
    peaks: tuple[RealArray, RealArray],
    colour: str,
) -> None:
    """Mark the peaks of both curves and write the frequency of each place once."""
    looks = (
        ("v", _ABOVE, "white", MUTED, "today"),
        ("^", -_ABOVE, colour, colour, "new"),
    )
    for curve, frequencies, (shape, above, fill, edge, name) in zip(
        curves, peaks, looks, strict=True
    ):
        axes.plot(
            frequencies,
            np.interp(frequencies, frequency, curve) + above,
            shape,
            markersize=5,
            markerfacecolor=fill,
            markeredgecolor=edge,
            linestyle="none",
            label=f"booming peak [Hz], {name}",
        )
    before, after = peaks
    moved = [f for f in after if not np.any(np.abs(before - f) < _SAME_PEAK)]
    labelled = np.concatenate([before, np.asarray(moved, dtype=float)])
    labelled.sort()
    heights = np.maximum(*(np.interp(labelled, frequency, curve) for curve in curves)) + _ABOVE
    close = np.diff(labelled, prepend=-np.inf) < _CLOSE * np.ptp(frequency)
    raised = False
    for peak, height, near in zip(labelled, heights, close, strict=True):
        raised = bool(near) and not raised
        axes.annotate(
            f"{peak:.1f}",
            (peak, height),
            xytext=(0, 11 if raised else 3),
            textcoords="offset points",
            ha="center",
            fontsize=7.0,
            path_effects=halo(2.0),
        )
