"""Acceptance boxes: intervals of every direction, boxes over the limit, levels inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.bars import factor_rows
from deboom.plot.style import (
    ACCENT,
    FULL_WIDTH,
    INK,
    MUTED,
    TRACK,
    canvas,
    finite,
    mount_of,
    place_legend,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

_BINS = 60


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
    others: Sequence[Intervals],
    bounds: Intervals,
    point: npt.ArrayLike,
    stiffness: npt.ArrayLike,
    no_requirement: Sequence[bool],
    colours: Mapping[str, str],
) -> Figure:
    """Draw the interval of every direction against others, stiffnesses beside them.

    - `variables`: names ``<mount> <axis>``, n of them.
    - `box`: the acceptance box.
    - `others`: thin lines below each bar, at most two.
    - `bounds`: where parts may lie at all.
    - `point` (n,): a design that is marked [1].
    - `stiffness` (n,): today's dynamic stiffness [N/mm]; nan where none was measured.
    - `no_requirement`: true where no vehicle depends on the direction.
    - `colours`: colour of each mount, from `deboom.plot.style.mount_colours`.
    - raises InputError: arrays of different lengths or values that are not finite; more than two
      others.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if len(others) > 2:
        raise InputError("figure box_intervals: at most two boxes to compare with have room")
    columns = {"variables": np.zeros(len(variables)), "point": point}
    for one in (box, *others, bounds):
        columns |= {f"{one.label} lower": one.lower, f"{one.label} upper": one.upper}
    data = finite("box_intervals", columns)
    today = np.asarray(stiffness, dtype=float)
    ends = [data[f"{box.label} {end}"] for end in ("lower", "upper")]
    texts = [
        (
            f"{known:.0f}" if np.isfinite(known) else "not measured",
            *(f"{known * f:.0f}" if np.isfinite(known) and not free else "–" for f in (low, high)),
        )
        for known, low, high, free in zip(today, *ends, no_requirement, strict=True)
    ]
    with factor_rows(
        *(variables, data[f"{bounds.label} lower"], data[f"{bounds.label} upper"], no_requirement),
        texts=texts,
        headings=("today", "from", "to"),
        title="dynamic stiffness [N/mm]",
        x_label="stiffness factor, 1 = today [1]",
    ) as (figure, bars, rows):
        for k, name in enumerate(variables):
            if no_requirement[k]:
                continue
            row, colour = rows[k], colours[mount_of(name)]
            width = ends[1][k] - ends[0][k]
            bars.barh(row - 0.1, width, left=ends[0][k], height=0.4, color=colour)
            for place, (one, line) in enumerate(zip(others, ("-", ":"), strict=False)):
                span = [data[f"{one.label} {end}"][k] for end in ("lower", "upper")]
                bars.plot(span, [row + 0.2 + 0.15 * place] * 2, color=INK, lw=1.3, ls=line)
            bars.plot(data["point"][k], row - 0.1, "D", color="white", mec=INK, ms=4.5, zorder=4)
        handles: list[Patch | Line2D] = [
            Patch(facecolor=MUTED, label=box.label),
            Patch(facecolor=TRACK, label=bounds.label),
            *(
                Line2D([], [], color=INK, lw=1.3, ls=line, label=one.label)
                for one, line in zip(others, ("-", ":"), strict=False)
            ),
            Line2D([], [], ls="none", marker="D", color="white", mec=INK, ms=4.5, label="design"),
        ]
        figure.legend(handles=handles, loc="outside lower left", ncols=3)
        return figure


def box_trade_off(
    limit: npt.ArrayLike,
    width: npt.ArrayLike,
    plain_share: npt.ArrayLike,
    missed: Mapping[str, npt.ArrayLike],
    colours: Mapping[str, str],
    *,
    stated: tuple[float, float],
    unreachable: float | None,
    limit_label: str,
    width_label: str,
    plain_label: str,
) -> Figure:
    """Draw how boxes grow with the limit, and which vehicle binds.

    - `limit` (n,): of each box [dB(A) or dB].
    - `width` (n,): of each box [%].
    - `plain_share` (n,): what the box of one tolerance keeps there [%].
    - `missed` (n,): vehicle → parts of each box that miss its limit [%].
    - `colours`: of the vehicles.
    - `stated`: limit and width of the box that was asked for.
    - `unreachable` or None: limit that no design keeps.
    - `limit_label`, `width_label`, `plain_label`: axes, with units.
    - raises InputError: arrays of different lengths or values that are not finite.
    """
    data = finite("box_trade_off", {"limit": limit, "width": width, "plain": plain_share, **missed})
    order = np.argsort(data["limit"])
    x = data["limit"][order]
    with styled_figure(FULL_WIDTH, 2.9) as figure:
        left, middle, right = figure.subplots(1, 3, sharex=True)
        left.plot(x, data["width"][order], "o-", color=ACCENT, markersize=4)
        left.plot(*stated, "o", markersize=8, mfc="none", mec=INK, label="as asked")
        left.set_ylabel(width_label)
        left.set_ylim(bottom=0.0)
        left.legend(loc="lower right")
        middle.plot(x, data["plain"][order], "s-", color=INK, markersize=3.5)
        middle.set_ylabel(plain_label)
        middle.set_ylim(-3.0, 103.0)
        for name in missed:
            right.plot(x, data[name][order], "o-", color=colours[name], markersize=3.5, label=name)
        right.set_ylabel("parts of the box that miss it [%]")
        right.set_ylim(bottom=0.0)
        figure.legend(*right.get_legend_handles_labels(), loc="outside lower right", ncols=6)
        for axes in (left, middle, right):
            axes.set_xlabel(limit_label)
            if unreachable is not None:
                axes.axvline(unreachable, color=MUTED, linewidth=1.0, linestyle=(0, (4, 2)))
        if unreachable is not None:
            where = {"rotation": 90, "va": "bottom", "color": MUTED, "fontsize": 7.5}
            left.text(unreachable, 0.5, " lowest of all designs", **where)
        return figure


def levels_in_box(
    vehicles: Sequence[str],
    levels: npt.ArrayLike,
    limit: npt.ArrayLike,
    today: npt.ArrayLike,
    missed: npt.ArrayLike,
    colours: Mapping[str, str],
    *,
    level_label: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw how the levels of the parts of a box lie about the limit, vehicle by vehicle.

    - `vehicles`: n of them.
    - `levels` (m, n): of parts in the box [dB(A)].
    - `limit`, `today` (n,): [dB(A)].
    - `missed` (n,): share of the parts above the limit [%].
    - `colours`: of the vehicles.
    - `level_label`: what the levels are, with the unit.
    - raises InputError: arrays of different lengths or values that are not finite.
    """
    from matplotlib.lines import Line2D

    columns = {"vehicles": np.zeros(len(vehicles)), "limit": limit, "today": today}
    data = finite("levels_in_box", {**columns, "missed": missed, "levels": np.transpose(levels)})
    drawn = data["levels"]
    edges = np.linspace(drawn.min(), drawn.max(), _BINS + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    with canvas(ax, FULL_WIDTH, 1.2 + 0.5 * len(vehicles)) as axes:
        for row, name in enumerate(vehicles):
            count = np.histogram(drawn[row], edges)[0]
            top = row - 0.85 * count / count.max()
            axes.fill_between(middles, row, top, step="mid", color=colours[name], alpha=0.35, lw=0)
            over = middles >= data["limit"][row]
            axes.fill_between(middles, row, top, where=over, step="mid", color=colours[name], lw=0)
            axes.plot([data["limit"][row]] * 2, [row, row - 0.9], color=INK, linewidth=1.5)
            axes.plot(data["today"][row], row - 0.12, "v", color=MUTED, markersize=5)
            share = f"{data['missed'][row]:.1f} % miss it"
            place = axes.get_yaxis_transform()
            axes.text(1.0, row - 0.5, share, color=INK, transform=place, ha="right", va="bottom")
        axes.set_yticks(range(len(vehicles)), vehicles)
        axes.set_ylim(len(vehicles) - 0.7, -1.05)
        low = min(float(drawn.min()), float(data["today"].min()))
        high = max(float(drawn.max()), float(data["today"].max()), float(data["limit"].max()))
        axes.set_xlim(low - 0.02 * (high - low), high + 0.16 * (high - low))
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel(level_label)
        handles = [
            Line2D([], [], color=INK, linewidth=1.5, label="limit"),
            Line2D([], [], ls="none", marker="v", color=MUTED, markersize=5, label="today"),
        ]
        place_legend(axes, ax, handles=handles, loc="outside lower left", ncols=2)
        return axes
