"""Stiffness factors within their bounds, and acceptance boxes: a row per direction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from deboom.plot.style import (
    FULL_WIDTH,
    INK,
    MUTED,
    TRACK,
    RealArray,
    finite,
    mount_of,
    signed,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

_GAP = 0.45  # rows between two mounts
_PLACES = (0.34, 0.68, 1.0)  # right ends of the columns


@contextmanager
def factor_rows(
    variables: Sequence[str],
    lower: RealArray,
    upper: RealArray,
    no_requirement: Sequence[bool],
    *,
    texts: Sequence[Sequence[str]],
    headings: Sequence[str],
    title: str,
    x_label: str,
) -> Iterator[tuple[Figure, Axes, list[float]]]:
    """Open a figure with a row per stiffness factor: its allowed range, and numbers beside it.

    - `variables`: names ``<mount> <axis>``, n of them; mounts are set apart.
    - `lower`, `upper` (n,): ends of the range [1]; `no_requirement`: those without effect.
    - `texts`, `headings`, `title`: three columns beside the rows.
    - yields the figure, the axes of the bars, and the height of each row from the top.
    """
    rows = [0.0]
    for before, name in pairwise(variables):
        rows.append(rows[-1] + (1.0 if mount_of(name) == mount_of(before) else 1.0 + _GAP))
    with styled_figure(FULL_WIDTH, 1.35 + 0.28 * (rows[-1] + 1.0)) as figure:
        bars, table = figure.subplots(1, 2, sharey=True, width_ratios=(2.5, 1.0))
        bars.barh(rows, upper - lower, left=lower, height=0.75, color=TRACK)
        bars.axvline(1.0, color=INK, linewidth=0.9, zorder=2)
        beside: dict[str, Any] = {"ha": "right", "transform": table.get_yaxis_transform()}
        for place, row in enumerate(rows):
            if no_requirement[place]:
                middle = 0.5 * (lower[place] + upper[place])
                box: dict[str, Any] = {"facecolor": TRACK, "edgecolor": "none", "pad": 0.4}
                words = bars.text(middle, row, "no requirement", ha="center", va="center", bbox=box)
                words.set(color=MUTED, fontstyle="italic")
            for end, text in zip(_PLACES, texts[place], strict=True):
                colour = MUTED if text in ("–", "not measured") else INK
                table.text(end, row, text, color=colour, va="center_baseline", **beside)
        bars.set_yticks(rows, variables)
        bars.set_ylim(rows[-1] + 0.6, -0.6)
        ends = min(float(lower.min()), 1.0), max(float(upper.max()), 1.0)
        margin = 0.03 * (ends[1] - ends[0])
        bars.set_xlim(ends[0] - margin, ends[1] + margin)
        bars.grid(False, axis="y")
        bars.tick_params(axis="y", length=0)
        bars.set_xlabel(x_label)
        table.set_axis_off()
        table.set_title(title, loc="right", fontsize=8.0, color=MUTED, pad=19.0)
        above: dict[str, Any] = {"ha": "right", "va": "bottom", "transform": table.transAxes}
        for end, heading in zip(_PLACES, headings, strict=True):
            table.text(end, 1.015, heading, fontweight="bold", **above)
        yield figure, bars, rows


def _stiffness(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 99.95 else f"{value:.1f}"


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
    """Draw the new stiffness factors from today's within their bounds, N/mm beside them.

    - `variables`: names ``<mount> <axis>``, n of them.
    - `factor`, `lower`, `upper` (n,): new stiffness factor and its bounds [1]; 1 is today's.
    - `nominal_stiffness` (n,): dynamic stiffness at factor 1 [N/mm]; nan where none was measured.
    - `no_requirement`: true where the variable has no effect on the objectives.
    - `indifference` (n, 2): ends of the interval of the factor within which the objectives do not
      change noticeably [1]; nan where none was found.
    - `colours`: colour of each mount, from `deboom.plot.style.mount_colours`.
    - `stiffness_label`: what the numbers are, such as ``|K| at 36 Hz [N/mm]``.
    - raises InputError: arrays of different lengths, or a factor that is not finite.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

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
    chosen, low, high = checked["factor"], checked["lower"], checked["upper"]
    texts = [
        (
            _stiffness(stiffness) if np.isfinite(stiffness) else "not measured",
            "–" if free or not np.isfinite(stiffness) else _stiffness(stiffness * value),
            "–" if free else f"{signed(100.0 * (value - 1.0), 0)} %",
        )
        for stiffness, value, free in zip(nominal, chosen, no_requirement, strict=True)
    ]
    with factor_rows(
        variables,
        low,
        high,
        no_requirement,
        texts=texts,
        headings=("today", "new", "change"),
        title=stiffness_label,
        x_label="stiffness factor, 1 = today [1]",
    ) as (figure, bars, rows):
        for place, name in enumerate(variables):
            if no_requirement[place]:
                continue
            row, value, colour = rows[place], chosen[place], colours[mount_of(name)]
            bars.barh(row - 0.08, value - 1.0, left=1.0, height=0.36, color=colour)
            bars.plot(value, row - 0.08, "o", color=colour, mec="white", ms=7, zorder=4)
            if np.isfinite(interval[place]).all():
                bars.plot(interval[place], [row + 0.26] * 2, "|-", color=INK, lw=1.0, ms=4.5)
        handles: list[Patch | Line2D] = [
            Patch(facecolor=TRACK, label="allowed range"),
            Line2D([], [], color=MUTED, marker="o", mec="white", ms=7, label="today to new"),
            Line2D([], [], color=INK, lw=1.0, marker="|", ms=6, label="no noticeable difference"),
        ]
        figure.legend(handles=handles, loc="outside lower left", ncols=3)
        return figure


@dataclass(frozen=True, eq=False)
class Intervals:
    """One interval per direction.

    - `label`: what they are.
    - `lower`, `upper` (n,): [1].
    """

    label: str
    lower: npt.ArrayLike
    upper: npt.ArrayLike


def box_intervals(
    variables: Sequence[str],
    box: Intervals,
    other: Intervals,
    bounds: Intervals,
    point: npt.ArrayLike,
    stiffness: npt.ArrayLike,
    no_requirement: Sequence[bool],
    colours: Mapping[str, str],
) -> Figure:
    """Draw the interval of every direction against another one, stiffnesses beside them.

    - `variables`: names ``<mount> <axis>``, n of them.
    - `box`: the acceptance box.
    - `other`: thin line below each bar.
    - `bounds`: where parts may lie at all.
    - `point` (n,): a design that is marked [1].
    - `stiffness` (n,): today's dynamic stiffness [N/mm]; nan where none was measured.
    - `no_requirement`: true where no vehicle depends on the direction.
    - `colours`: colour of each mount, from `deboom.plot.style.mount_colours`.
    - raises InputError: arrays of different lengths or values that are not finite.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    columns = {"variables": np.zeros(len(variables)), "point": point}
    for ends in (box, other, bounds):
        columns |= {f"{ends.label} lower": ends.lower, f"{ends.label} upper": ends.upper}
    data = finite("box_intervals", columns)
    today = np.asarray(stiffness, dtype=float)
    edges = [data[f"{box.label} {end}"] for end in ("lower", "upper")]
    texts = [
        (
            f"{nominal:.0f}" if np.isfinite(nominal) else "not measured",
            *(
                f"{nominal * factor:.0f}" if np.isfinite(nominal) and not free else "–"
                for factor in (low, high)
            ),
        )
        for nominal, low, high, free in zip(today, *edges, no_requirement, strict=True)
    ]
    with factor_rows(
        variables,
        data[f"{bounds.label} lower"],
        data[f"{bounds.label} upper"],
        no_requirement,
        texts=texts,
        headings=("today", "from", "to"),
        title="dynamic stiffness [N/mm]",
        x_label="stiffness factor, 1 = today [1]",
    ) as (figure, bars, rows):
        for k, name in enumerate(variables):
            if no_requirement[k]:
                continue
            row, colour = rows[k], colours[mount_of(name)]
            width = edges[1][k] - edges[0][k]
            bars.barh(row - 0.1, width, left=edges[0][k], height=0.4, color=colour)
            span = [data[f"{other.label} {end}"][k] for end in ("lower", "upper")]
            bars.plot(span, [row + 0.2] * 2, color=INK, lw=1.3)
            bars.plot(data["point"][k], row - 0.1, "D", color="white", mec=INK, ms=4.5, zorder=4)
        handles: list[Patch | Line2D] = [
            Patch(facecolor=MUTED, label=box.label),
            Patch(facecolor=TRACK, label=bounds.label),
            Line2D([], [], color=INK, lw=1.3, label=other.label),
            Line2D([], [], ls="none", marker="D", color="white", mec=INK, ms=4.5, label="design"),
        ]
        figure.legend(handles=handles, loc="outside lower left", ncols=3)
        return figure
