"""Measured points over two of their variables, with a third number as colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.curves import plain_logarithmic
from deboom.plot.style import INK, MUTED, VEHICLE_PALETTE, finite, halo, panel_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ENDS = (1.0, 99.0)  # percentiles at the ends of a colour scale
_PANEL_HEIGHT = {1: 3.0, 2: 2.4, 3: 1.9, 4: 1.7}  # in, by the number of columns
_DOT = 5.0  # pt²
_MARKED = "#D55E00"


@dataclass(frozen=True, eq=False)
class PointMap:
    """One panel of coloured points.

    - `title`: what the panel shows.
    - `x`, `y`, `value` (n,): coordinates and colour of each point [units of the labels].
    - `x_label`, `y_label`, `value_label`: with units.
    - `splits`: abscissae that are marked, such as where pieces of a model meet.
    - `marks`: points that are marked, such as inflection points: abscissa and ordinate of each.
    - `outline`, optional: abscissae (m,), ordinates (k,) and a height (k, m) that is above 0 within
      the region to be outlined, which may have holes.
    - `rays`: label → slope of a dashed line through the origin, such as an order.
    - `amplitude`: whether the ordinate is an amplitude: logarithmic, and growing downwards.
    """

    title: str
    x: npt.ArrayLike
    y: npt.ArrayLike
    value: npt.ArrayLike
    x_label: str
    y_label: str
    value_label: str
    splits: Sequence[float] = ()
    marks: Sequence[tuple[float, float]] = ()
    outline: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike] | None = None
    amplitude: bool = False
    rays: Mapping[str, float] = field(default_factory=dict)


def point_maps(maps: Sequence[PointMap], *, columns: int = 3) -> Figure:
    """Draw points whose colour is a number, a scale beside each panel.

    - `maps`: at least one; `columns`: per row, up to 4.
    - raises InputError: no map, arrays of different lengths, values that are not finite.

    The scale ends at the 1st and the 99th percentile, with arrow heads where values lie beyond.
    Points of large values lie above the others. Where all panels of each column show the same
    points, they share their axes, with the numbers of the abscissa below the last.
    """
    columns = min(columns, max(len(maps), 1))
    share = all(
        above.x is below.x and above.y is below.y
        for above, below in zip(maps, maps[columns:], strict=False)
    )
    with panel_grid(
        "point_maps",
        len(maps),
        columns,
        0.4,
        _PANEL_HEIGHT[columns],
        share_x="col" if share else False,
        share_y="col" if share else False,
    ) as (figure, grid):
        for place, (axes, shown) in enumerate(zip(grid, maps, strict=True)):
            data = finite("point_maps", {"x": shown.x, "y": shown.y, "value": shown.value})
            low, high = np.percentile(data["value"], _ENDS)
            order = np.argsort(data["value"], kind="stable")
            x, y, value = (data[name][order] for name in ("x", "y", "value"))
            points = axes.scatter(x, y, c=value, s=_DOT, lw=0, cmap="viridis", vmin=low, vmax=high)
            if shown.outline is not None:
                axes.contour(*shown.outline, levels=[0.0], colors=MUTED, linewidths=0.7)
            if shown.marks:
                across, up = zip(*shown.marks, strict=True)
                axes.plot(across, up, "o", color=_MARKED, ms=4.5, mec="white", mew=0.6)
            for split in shown.splits:
                axes.axvline(split, color=INK, lw=1.0, ls="--")
            _rays(axes, shown.rays)
            if shown.amplitude:
                plain_logarithmic(axes)
                axes.yaxis.set_inverted(True)
            # plain numbers leave nothing above a panel for which its title would look at each tick
            height = 1.0 if shown.amplitude else None
            axes.set_title(shown.title, loc="left", y=height, fontweight="bold")
            if not share or place + columns >= len(maps):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel(shown.x_label)
            axes.set_ylabel(shown.y_label)
            beyond = {(False, False): "neither", (True, False): "min", (False, True): "max"}
            ends = beyond.get((bool(value[0] < low), bool(value[-1] > high)), "both")
            figure.colorbar(points, ax=axes, label=shown.value_label, extend=ends, pad=0.02)
        return figure


def _rays(axes: Axes, rays: Mapping[str, float]) -> None:
    """Draw lines through the origin, each with its label where it leaves the points."""
    if not rays:
        return
    (left, right), (bottom, top) = axes.dataLim.intervalx, axes.dataLim.intervaly
    for label, slope in rays.items():
        end = min(right, top / slope)
        if end > left:
            axes.plot([left, end], [slope * left, slope * end], color="w", lw=0.7, ls=(0, (4, 3)))
            axes.annotate(
                label,
                (end, slope * end),
                xytext=(1, 1),
                textcoords="offset points",
                fontsize=6.0,
                color=INK,
                path_effects=halo(1.5),
                annotation_clip=False,
            )
    axes.set(xlim=(left, right), ylim=(bottom, top))


_VIEWS = ((0, 2, "side view"), (1, 2, "front view"), (0, 1, "from above"))
"""Columns of positions across and up in each view."""
_MARKS = ("o", "^", "s", "D")
_MOST_NAMES = 40
"""Points whose names are still legible."""


def places(groups: Mapping[str, Mapping[str, npt.ArrayLike]]) -> Figure:
    """Draw where points lie, from three sides, with axes to scale.

    - `groups`: at least one, such as ``sensors``; names to positions (3,) [m].
    - raises InputError: no group, or more than four; positions that are not finite.
    """
    if not 0 < len(groups) <= len(_MARKS) or not all(groups.values()):
        raise InputError(f"figure places: give one to {len(_MARKS)} groups of points")
    named = sum(map(len, groups.values())) <= _MOST_NAMES
    with panel_grid("places", len(_VIEWS), len(_VIEWS), 0.7, 2.6) as (figure, grid):
        for axes, (across, up, title) in zip(grid, _VIEWS, strict=True):
            for mark, colour, (group, points) in zip(
                _MARKS, VEHICLE_PALETTE, groups.items(), strict=False
            ):
                positions = finite("places", {group: np.array(list(points.values()))})[group]
                x, y = positions[:, across], positions[:, up]
                axes.scatter(x, y, s=14.0, marker=mark, color=colour, lw=0, label=group)
                for name, place in zip(points, positions[:, [across, up]], strict=True):
                    if named:
                        axes.annotate(
                            name,
                            tuple(place),
                            xytext=(0, 4),
                            textcoords="offset points",
                            ha="center",
                            fontsize=5.0,
                            color=INK,
                            path_effects=halo(1.5),
                        )
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_title(title, loc="left", fontweight="bold")
            axes.set_xlabel(f"{'xyz'[across]} [m]")
            axes.set_ylabel(f"{'xyz'[up]} [m]")
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        return figure
