"""The chosen stiffness of every mount direction within its bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, MUTED, TRACK, mount_of, signed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

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
) -> bytes:
    """Draw the chosen stiffness factors from nominal within their bounds, N/mm beside them.

    Parameters
    ----------
    variables : sequence of str
        Names ``<mount> <axis>``, n of them.
    factor, lower, upper : array, shape (n,)
        Chosen stiffness factor and its bounds [1]; 1 is nominal.
    nominal_stiffness : array, shape (n,)
        Dynamic stiffness at factor 1 [N/mm]; nan where none was measured.
    no_requirement : sequence of bool
        True where the variable has no effect on the objectives.
    indifference : array, shape (n, 2)
        Ends of the interval of the factor within which the objectives do not change noticeably
        [1]; nan where none was found.
    colours : mapping of str to str
        Colour of each mount, from `deboom.report.style.mount_colours`.
    stiffness_label : str
        What the numbers are, such as ``|K| at 36 Hz [N/mm]``.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Arrays of different lengths, a factor outside its bounds or one that is not finite.
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
        return png(figure)


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
