"""Measured points over two of their variables, with a third number as colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.plot.curves import plain_logarithmic
from deboom.plot.style import INK, MUTED, finite, panel_grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ENDS = (1.0, 99.0)  # percentiles at the ends of a colour scale
_PANEL_HEIGHT = {1: 3.0, 2: 2.4, 3: 1.9, 4: 1.7}  # in, by the number of columns
_DOT = 5.0  # pt²


@dataclass(frozen=True, eq=False)
class PointMap:
    """One panel of coloured points.

    - `title`: what the panel shows.
    - `x`, `y`, `value` (n,): coordinates and colour of each point [units of the labels].
    - `x_label`, `y_label`, `value_label`: with units.
    - `splits`: abscissae that are marked, such as where pieces of a model meet.
    - `outline` (k, 2), optional: corners of the region in which points lie.
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
    outline: npt.ArrayLike | None = None
    amplitude: bool = False


def point_maps(maps: Sequence[PointMap], *, columns: int = 3) -> Figure:
    """Draw points whose colour is a number, a scale beside each panel.

    - `maps`: at least one; `columns`: per row, up to 4.
    - raises InputError: no map, arrays of different lengths, values that are not finite.

    The scale ends at the 1st and the 99th percentile, with arrow heads where values lie beyond.
    Points of large values lie above the others.
    """
    columns = min(columns, max(len(maps), 1))
    with panel_grid("point_maps", len(maps), columns, 0.4, _PANEL_HEIGHT[columns]) as (
        figure,
        grid,
    ):
        for axes, shown in zip(grid, maps, strict=True):
            data = finite("point_maps", {"x": shown.x, "y": shown.y, "value": shown.value})
            low, high = np.percentile(data["value"], _ENDS)
            order = np.argsort(data["value"], kind="stable")
            x, y, value = (data[name][order] for name in ("x", "y", "value"))
            points = axes.scatter(x, y, c=value, s=_DOT, lw=0, cmap="viridis", vmin=low, vmax=high)
            if shown.outline is not None:
                corners = finite("point_maps", {"outline": shown.outline})["outline"]
                axes.plot(*np.vstack([corners, corners[:1]]).T, color=MUTED, lw=0.7)
            for split in shown.splits:
                axes.axvline(split, color=INK, lw=1.0, ls="--")
            if shown.amplitude:
                plain_logarithmic(axes)
                axes.invert_yaxis()
            axes.set_title(shown.title, loc="left", fontweight="bold")
            axes.set_xlabel(shown.x_label)
            axes.set_ylabel(shown.y_label)
            beyond = {(False, False): "neither", (True, False): "min", (False, True): "max"}
            ends = beyond.get((bool(value[0] < low), bool(value[-1] > high)), "both")
            figure.colorbar(points, ax=axes, label=shown.value_label, extend=ends, pad=0.02)
        return figure
