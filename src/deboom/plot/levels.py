"""Where a level comes from: maps over speed, and the paths that add up to a pressure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.curves import rpm_axis
from deboom.plot.style import INK, MUTED, canvas, finite, halo, panel_grid, place_legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW, _TALLEST = 0.132, 13.0  # in, of a row and of a map; of more rows not each has its name
_NAMED = 0.05
"""Share of the pressure from which a path is named [1]."""


@dataclass(frozen=True, eq=False)
class LineMap:
    """Values of all rows over the lines of an order.

    - `title`: such as a vehicle or a state.
    - `values` (n_row, n_frequency): [unit of the label].
    - `label`: of the colour scale, which maps of one label share.
    - `limits`: ends of that scale [unit of the label].
    - `colours`: a colour map of matplotlib.
    - `peaks` (p,): frequencies that are marked above the map [Hz].
    """

    title: str
    values: npt.ArrayLike
    label: str
    limits: tuple[float, float] = (0.0, 1.0)
    colours: str = "Blues"
    peaks: npt.ArrayLike = ()


def line_maps(
    frequency: npt.ArrayLike,
    order: float,
    rows: Sequence[str],
    maps: Sequence[LineMap],
    *,
    columns: int = 3,
) -> Figure:
    """Draw values over frequency and speed as maps that share their rows.

    - `frequency` (n_frequency,): lines of the order, rising [Hz].
    - `order`: of the lines, per revolution [1]; gives the speed above.
    - `rows`: what each row of values is, such as a vehicle in a load case; of more than about 100
      rows every second, third, … is named.
    - `maps`: at least one.
    - `columns`: maps per row of the figure.
    - raises InputError: no map, shapes that disagree, values that are not finite.
    """
    lines = finite("line_maps", {"frequency": frequency})["frequency"]
    columns = min(columns, max(len(maps), 1))
    height = 0.5 + min(max(_ROW * len(rows), 0.9), _TALLEST)
    named = slice(None, None, math.ceil(_ROW * len(rows) / _TALLEST))
    with panel_grid("line_maps", len(maps), columns, 0.9, height, True, True) as (figure, grid):
        shown: dict[str, tuple[Any, list[Axes]]] = {}
        for place, (axes, drawn) in enumerate(zip(grid, maps, strict=True)):
            values = finite("line_maps", {drawn.title: drawn.values})[drawn.title]
            if values.shape != (len(rows), lines.size):
                raise InputError(
                    f"figure line_maps: {drawn.title} has shape {values.shape}, expected "
                    f"{(len(rows), lines.size)}"
                )
            mesh = axes.pcolormesh(lines, np.arange(len(rows)), values, shading="nearest")
            mesh.set(clim=drawn.limits, cmap=drawn.colours)
            shown.setdefault(drawn.label, (mesh, []))[1].append(axes)
            above = axes.get_xaxis_transform()
            for peak in np.asarray(drawn.peaks, dtype=float):
                axes.plot(peak, 1.0, "v", color=INK, ms=4.0, transform=above, clip_on=False)
            axes.grid(visible=False)
            axes.tick_params(axis="y", labelsize=7)
            axes.set_title(drawn.title, loc="left", fontweight="bold", pad=9.0)
            if place < columns:
                rpm_axis(axes, order)
            if place + columns >= len(maps):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel("frequency [Hz]")
        for label, (mesh, of) in shown.items():
            figure.colorbar(mesh, ax=of, label=label, pad=0.02)
        grid[0].set_yticks(range(len(rows))[named], list(rows)[named])
        grid[0].set_ylim(len(rows) - 0.5, -0.5)
        return figure


def vector_sum(
    paths: Sequence[str],
    contributions: Mapping[str, npt.ArrayLike],
    colours: Sequence[str],
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw the paths of one line head to tail in the complex plane, and the pressure they give.

    - `paths`: of the contributions, in the order they are added.
    - `contributions`: state, such as today or a pick → complex peaks, (n_path,) [Pa].
    - `colours`: of the paths.
    - raises InputError: nothing to draw, arrays of another length, values that are not finite.
    """
    if not contributions:
        raise InputError("figure vector_sum: there is no state to draw")
    with canvas(ax, 5.4, 3.0) as axes:
        for number, (state, given) in enumerate(contributions.items()):
            values = np.asarray(given, dtype=complex)
            finite("vector_sum", {"paths": np.zeros(len(paths)), state: np.abs(values)})
            ends = np.concatenate([[0.0], np.cumsum(values)])
            style = "-" if number else "--"
            for path, start, end, colour in zip(paths, ends, ends[1:], colours, strict=False):
                axes.plot([start.real, end.real], [start.imag, end.imag], style, color=colour)
                if number == 0 and abs(end - start) > _NAMED * abs(ends[-1]):
                    # labels stand above and below in turns, each pair further away
                    side, place = 1 - 2 * (len(axes.texts) % 2), (start + end) / 2
                    axes.annotate(
                        path,
                        (place.real, place.imag),
                        xytext=(0, side * (14 + 6 * len(axes.texts))),
                        textcoords="offset points",
                        ha="center",
                        color=colour,
                        fontsize=9.0,
                        path_effects=halo(2.0),
                        arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.6},
                    )
            tip, colour = ends[-1], INK if number else MUTED
            label = f"{state}: {abs(tip):.3g} Pa"
            axes.plot([0, tip.real], [0, tip.imag], color=colour, linewidth=2.4, label=label)
            axes.plot(tip.real, tip.imag, "o", color=colour, markersize=6)
        axes.margins(0.1)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("real part [Pa]")
        axes.set_ylabel("imaginary part [Pa]")
        place_legend(axes, ax, loc="outside upper right", ncols=len(contributions))
        return axes
