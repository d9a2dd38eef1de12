"""Bars: changes per vehicle, stiffness within its bounds, and other numbers before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
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
    RealArray,
    finite,
    halo,
    mount_of,
    panel_grid,
    signed,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

_BAR = 0.21


@dataclass(frozen=True, eq=False)
class MarkedPanel:
    """One number of every direction.

    - `x_label`: with its unit.
    - `bars`, `marks` (n,): [unit of the label].
    """

    x_label: str
    bars: npt.ArrayLike
    marks: npt.ArrayLike


def marked_bars(
    names: Sequence[str],
    colours: Sequence[str],
    panels: Sequence[MarkedPanel],
    *,
    bar_label: str,
    mark_label: str,
) -> Figure:
    """Draw panels side by side that share their directions, top to bottom.

    - `names`, `colours` (n,): of the directions.
    - `panels`: at least one.
    - `bar_label`, `mark_label`: what the bars and the marks are.
    - raises InputError: no panel, arrays of different lengths, values that are not finite.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    rows, count = np.arange(len(names)), len(panels)
    height = _BAR * len(names)
    with panel_grid("marked_bars", count, count, 0.95, height, share_y=True) as (figure, grid):
        for axes, panel in zip(grid, panels, strict=True):
            data = finite("marked_bars", {"names": rows, "bars": panel.bars, "marks": panel.marks})
            shown = np.concatenate([data["bars"], data["marks"], [0.0]])
            low, high = float(shown.min()), float(shown.max())
            axes.barh(rows, np.full(len(names), high), color=TRACK, height=0.66)
            axes.barh(rows, data["bars"], color=list(colours), height=0.66)
            axes.plot(data["marks"], rows, "D", color="white", mec=INK, ms=4.0, mew=0.9)
            axes.axvline(0.0, color=MUTED, linewidth=0.8)
            axes.set_xlabel(panel.x_label)
            axes.grid(False, axis="y")
            axes.tick_params(axis="y", length=0)
            reach = high - low
            axes.set_xlim(low - 0.02 * reach, high + 0.04 * reach)
            axes.set_yticks(rows, names)
            axes.set_ylim(len(names) - 0.4, -0.6)
        handles: list[Patch | Line2D] = [
            Patch(facecolor=MUTED, label=bar_label),
            Line2D([], [], ls="none", marker="D", color="white", mec=INK, ms=4, label=mark_label),
        ]
        figure.legend(handles=handles, loc="outside upper right", ncols=2)
        return figure


_BAR_HEIGHT = 0.175


def ratio_bars(
    names: Sequence[str],
    ratios: npt.ArrayLike,
    *,
    limit: float,
    x_label: str,
    below: str,
    above: str,
) -> Figure:
    """Draw one bar per name from 0 to 1, in two columns, coloured by a limit.

    - `names`: in reading order.
    - `ratios` (n,): from 0 to 1 [1].
    - `limit`: where the verdict changes [1].
    - `x_label`: what the ratio is.
    - `below`, `above`: the verdict on either side of the limit, for the legend.
    - raises InputError: arrays of different lengths, values that are not finite.
    """
    from matplotlib.patches import Patch

    values = finite("ratio_bars", {"names": range(len(names)), "ratios": ratios})["ratios"]
    half = -(-len(names) // 2)
    good, bad = VEHICLE_PALETTE[0], VEHICLE_PALETTE[1]
    with styled_figure(FULL_WIDTH, 0.9 + half * _BAR_HEIGHT) as figure:
        grid = figure.subplots(1, 2, sharex=True)
        for axes, part in zip(grid, (slice(None, half), slice(half, None)), strict=True):
            shown, own = values[part], list(names[part])
            axes.barh(range(len(own)), [1.0] * len(own), color=TRACK, height=0.72)
            axes.barh(
                range(len(own)),
                shown,
                color=[bad if r > limit else good for r in shown],
                height=0.72,
            )
            axes.axvline(limit, color=INK, linewidth=0.8, ls=":")
            axes.set_yticks(range(len(own)), own, fontsize=7)
            axes.set_ylim(half - 0.4, -0.6)
            axes.set_xlim(0, 1)
            axes.grid(axis="y", visible=False)
            axes.tick_params(axis="y", length=0)
            axes.set_xlabel(x_label)
        figure.legend(
            handles=[Patch(color=good, label=below), Patch(color=bad, label=above)],
            loc="outside lower center",
            ncols=2,
        )
        return figure


def per_vehicle_change(
    vehicles: Sequence[str],
    level_change: npt.ArrayLike,
    level_sigma: npt.ArrayLike,
    energy_change: npt.ArrayLike,
    energy_sigma: npt.ArrayLike,
    colours: Mapping[str, str],
    *,
    level_label: str,
    energy_label: str,
) -> Figure:
    """Draw the change of each vehicle against the baseline, with ± one standard deviation.

    - `vehicles`: n names.
    - `level_change`, `level_sigma` (n,): change of the mean SPL over the lines (SPLV over the
      number of lines) and its scatter over the mounts' tolerance [dB].
    - `energy_change`, `energy_sigma` (n,): change of the energy level of one band and its scatter
      [dB].
    - `colours`: colour of each vehicle, from `deboom.plot.style.vehicle_colours`.
    - `level_label`, `energy_label`: axis labels with units and band.
    - raises InputError: arrays of different lengths or values that are not finite.
    """
    rows = finite(
        "per_vehicle_change",
        {
            "vehicles": np.zeros(len(vehicles)),
            "level_change": level_change,
            "level_sigma": level_sigma,
            "energy_change": energy_change,
            "energy_sigma": energy_sigma,
        },
    )
    paint = [colours[name] for name in vehicles]
    with styled_figure(FULL_WIDTH, 1.2 + 0.3 * len(vehicles)) as figure:
        left, right = figure.subplots(1, 2, sharex=True, sharey=True)
        _bars(left, rows["level_change"], rows["level_sigma"], paint, level_label)
        _bars(right, rows["energy_change"], rows["energy_sigma"], paint, energy_label)
        left.set_yticks(range(len(vehicles)), vehicles)
        left.set_ylim(len(vehicles) - 0.4, -0.6)
        left.set_xlim(*_limits(rows))
        figure.legend(handles=[_sigma_handle()], loc="outside lower right")
        return figure


def _sigma_handle() -> Line2D:
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        color=INK,
        linewidth=1.0,
        marker="|",
        markersize=4.5,
        label="± one standard deviation over the tolerance",
    )


def _limits(rows: Mapping[str, RealArray]) -> tuple[float, float]:
    """One scale for both panels, with room for the numbers beyond the bars."""
    lows = [rows[f"{what}_change"] - rows[f"{what}_sigma"] for what in ("level", "energy")]
    highs = [rows[f"{what}_change"] + rows[f"{what}_sigma"] for what in ("level", "energy")]
    low, high = min(0.0, float(np.min(lows))), max(0.0, float(np.max(highs)))
    room = 0.17 * max(high - low, 0.1)
    return low - (room if low < 0.0 else 0.0), high + (room if high > 0.0 or low == 0.0 else 0.0)


def _bars(
    axes: Axes, change: RealArray, sigma: RealArray, paint: Sequence[str], label: str
) -> None:
    from matplotlib.ticker import MaxNLocator

    places = np.arange(change.size)
    axes.barh(places - 0.1, change, height=0.42, color=list(paint))
    axes.axvline(0.0, color=INK, linewidth=0.9)
    for place, value, spread in zip(places, change, sigma, strict=True):
        ends = [value - spread, value + spread]
        axes.plot(ends, [place + 0.26] * 2, "|-", color=INK, linewidth=1.0, markersize=4.5)
        side = -1 if value < 0 else 1
        axes.annotate(
            signed(value, 1),
            (value, place - 0.1),
            xytext=(4 * side, 0),
            textcoords="offset points",
            ha="right" if side < 0 else "left",
            va="center_baseline",
            path_effects=halo(2.5),
        )
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel(f"← better    {label}")


_GAP = 0.45
_COLUMNS = (0.38, 0.70, 1.0)
_HEADINGS = ("nominal", "chosen", "change")


def stiffness_bars(
    variables: Sequence[str],
    factor: npt.ArrayLike,
    lower: npt.ArrayLike,
    upper: npt.ArrayLike,
    nominal_stiffness: npt.ArrayLike,
    no_requirement: Sequence[bool],
    indifference: npt.ArrayLike,
    colours: Mapping[str, str],
    *,
    stiffness_label: str,
) -> Figure:
    """Draw the chosen stiffness factors from nominal within their bounds, N/mm beside them.

    - `variables`: names ``<mount> <axis>``, n of them.
    - `factor`, `lower`, `upper` (n,): chosen stiffness factor and its bounds [1]; 1 is nominal.
    - `nominal_stiffness` (n,): dynamic stiffness at factor 1 [N/mm]; nan where none was measured.
    - `no_requirement`: true where the variable has no effect on the objectives.
    - `indifference` (n, 2): ends of the interval of the factor within which the objectives do not
      change noticeably [1]; nan where none was found.
    - `colours`: colour of each mount, from `deboom.plot.style.mount_colours`.
    - `stiffness_label`: what the numbers are, such as ``|K| at 36 Hz [N/mm]``.
    - raises InputError: arrays of different lengths, a factor outside its bounds or one that is not
      finite.
    """
    checked = finite(
        "stiffness_bars",
        {
            "factor": factor,
            "lower": lower,
            "upper": upper,
            "variables": np.zeros(len(variables)),
            "no_requirement": np.asarray(no_requirement, dtype=float),
        },
    )
    nominal = np.asarray(nominal_stiffness, dtype=float)
    interval = np.asarray(indifference, dtype=float)
    if nominal.shape != (len(variables),) or interval.shape != (len(variables), 2):
        raise InputError(
            f"figure stiffness_bars: {len(variables)} variables, but nominal_stiffness has shape "
            f"{nominal.shape} and indifference {interval.shape}"
        )
    chosen, low, high = checked["factor"], checked["lower"], checked["upper"]
    for name, value, least, most in zip(variables, chosen, low, high, strict=True):
        if not least - 1e-9 <= value <= most + 1e-9:
            raise InputError(
                f"figure stiffness_bars: {name} = {value} lies outside its bounds {least}..{most}"
            )
    rows = _rows(variables)
    with styled_figure(FULL_WIDTH, 1.25 + 0.25 * (rows[-1] + 1.0)) as figure:
        bars, table = figure.subplots(1, 2, sharey=True, width_ratios=(2.5, 1.0))
        for place, name in enumerate(variables):
            row, bounds = rows[place], (float(low[place]), float(high[place]))
            free = bool(no_requirement[place])
            _track(bars, row, bounds, free)
            if not free:
                _bar(bars, row, float(chosen[place]), interval[place], colours[mount_of(name)])
            _numbers(table, row, float(nominal[place]), float(chosen[place]), free)
        _finish(bars, rows, variables, (min(low.min(), 1.0), max(high.max(), 1.0)))
        _headings(table, stiffness_label)
        figure.legend(handles=_legend_handles(), loc="outside lower left", ncols=3)
        return figure


def _rows(variables: Sequence[str]) -> list[float]:
    """Height of each row from the top, with a gap where a new mount begins."""
    rows = [0.0]
    for before, name in pairwise(variables):
        rows.append(rows[-1] + (1.0 if mount_of(name) == mount_of(before) else 1.0 + _GAP))
    return rows


def _track(axes: Axes, row: float, bounds: tuple[float, float], free: bool) -> None:
    low, high = bounds
    axes.barh(row, high - low, left=low, height=0.7, color=TRACK)
    if free:
        axes.text(
            (low + high) / 2.0,
            row,
            "no requirement",
            ha="center",
            va="center_baseline",
            color=MUTED,
            fontstyle="italic",
            bbox={"facecolor": TRACK, "edgecolor": "none", "pad": 0.4},
        )


def _bar(
    axes: Axes, row: float, chosen: float, interval: npt.NDArray[np.float64], colour: str
) -> None:
    axes.barh(row - 0.08, chosen - 1.0, left=1.0, height=0.36, color=colour)
    axes.plot(
        chosen, row - 0.08, "o", color=colour, markeredgecolor="white", markersize=7, zorder=4
    )
    if np.isfinite(interval).all():
        axes.plot(interval, [row + 0.26] * 2, "|-", color=INK, linewidth=1.0, markersize=4.5)


def _numbers(axes: Axes, row: float, nominal: float, chosen: float, free: bool) -> None:
    """Write three right-aligned columns: nominal, chosen, change."""
    measured = np.isfinite(nominal)
    texts = (
        _stiffness(nominal) if measured else "not measured",
        "–" if free or not measured else _stiffness(nominal * chosen),
        "–" if free else f"{signed(100.0 * (chosen - 1.0), 0)} %",
    )
    for column, text in zip(_COLUMNS, texts, strict=True):
        axes.text(
            column,
            row,
            text,
            transform=axes.get_yaxis_transform(),
            ha="right",
            va="center_baseline",
            color=MUTED if text in ("–", "not measured") else INK,
        )


def _stiffness(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 99.95 else f"{value:.1f}"


def _finish(
    axes: Axes, rows: Sequence[float], variables: Sequence[str], limits: tuple[float, float]
) -> None:
    axes.axvline(1.0, color=INK, linewidth=0.9, zorder=2)
    axes.set_yticks(rows, variables)
    axes.set_ylim(rows[-1] + 0.6, -0.6)
    margin = 0.03 * (limits[1] - limits[0])
    axes.set_xlim(limits[0] - margin, limits[1] + margin)
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("stiffness factor, 1 = nominal [1]")


def _headings(axes: Axes, stiffness_label: str) -> None:
    axes.set_axis_off()
    axes.set_title(f"{stiffness_label}\n", loc="right", fontsize=8.0, color=MUTED, pad=8.0)
    for column, heading in zip(_COLUMNS, _HEADINGS, strict=True):
        axes.text(
            column,
            1.015,
            heading,
            transform=axes.transAxes,
            ha="right",
            va="bottom",
            fontweight="bold",
        )


def _legend_handles() -> list[Line2D | Patch]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    return [
        Patch(facecolor=TRACK, label="allowed range"),
        Line2D(
            [],
            [],
            color=MUTED,
            linewidth=5,
            marker="o",
            markeredgecolor="white",
            markersize=7,
            label="from nominal to chosen",
        ),
        Line2D(
            [],
            [],
            color=INK,
            linewidth=1.0,
            marker="|",
            markersize=6,
            label="no noticeable difference within",
        ),
    ]
