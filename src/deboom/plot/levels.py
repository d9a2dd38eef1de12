"""Where a level comes from: maps over speed, and the paths that add up to a pressure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.curves import rpm_axis
from deboom.plot.style import INK, MUTED, canvas, finite, halo, panel_grid, place_legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DYNAMIC = 40.0
"""Below the loudest line, levels share the darkest colour [dB]."""
_NAMED = 0.05
"""Share of the pressure from which a path is named [1]."""


def level_maps(
    frequency: npt.ArrayLike,
    order: float,
    rows: Sequence[str],
    before: npt.ArrayLike,
    after: npt.ArrayLike,
    *,
    titles: tuple[str, str] = ("today", "after"),
) -> Figure:
    """Draw levels over the speed as maps: before, after, and their difference.

    - `frequency` (n_frequency,): lines of the order, rising [Hz].
    - `order`: of the lines, per revolution [1]; gives the speed above.
    - `rows`: what each row of levels is, such as a vehicle in a load case.
    - `before`, `after` (n_row, n_frequency): SPL [dB(A)].
    - `titles`: of the first two maps.
    - raises InputError: shapes that disagree, values that are not finite.
    """
    lines = finite("level_maps", {"frequency": frequency})["frequency"]
    maps = [finite("level_maps", {"levels": levels})["levels"] for levels in (before, after)]
    if any(levels.shape != (len(rows), lines.size) for levels in maps):
        raise InputError(
            f"figure level_maps: {len(rows)} rows and {lines.size} lines, but the levels have the "
            f"shapes {maps[0].shape} and {maps[1].shape}"
        )
    change = maps[1] - maps[0]
    loudest, most = max(levels.max() for levels in maps), max(np.abs(change).max(), 0.1)
    looks = [{"cmap": "inferno", "vmin": loudest - _DYNAMIC, "vmax": loudest}] * 2
    looks.append({"cmap": "PuOr_r", "vmin": -most, "vmax": most})
    height = 0.5 + max(0.13 * len(rows), 0.9)
    with panel_grid("level_maps", 3, 3, 0.9, height, True, True) as (figure, grid):
        for axes, title, levels, look in zip(
            grid, (*titles, "difference"), (*maps, change), looks, strict=True
        ):
            shown = axes.pcolormesh(lines, np.arange(len(rows)), levels, shading="nearest", **look)
            axes.grid(visible=False)
            axes.set_title(title, loc="left", fontweight="bold")
            axes.set_xlabel("frequency [Hz]")
            rpm_axis(axes, order)
            if title != titles[0]:
                of = [axes] if title == "difference" else grid[:2]
                label = "change [dB]" if title == "difference" else "SPL [dB(A)]"
                figure.colorbar(shown, ax=of, label=label, pad=0.02)
        grid[0].set_yticks(range(len(rows)), rows, fontsize=7)
        grid[0].set_ylim(len(rows) - 0.5, -0.5)
        return figure


def vector_sum(
    paths: Sequence[str],
    contributions: Mapping[str, npt.ArrayLike],
    colours: Sequence[str],
    *,
    unit: str = "Pa",
    ax: Axes | None = None,
) -> Axes:
    """Draw the paths of one line head to tail in the complex plane, and the pressure they give.

    - `paths`: of the contributions, in the order they are added.
    - `contributions` (n_path,): state, such as today and a pick → complex peak [`unit`].
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
                    middle = (start + end) / 2
                    axes.annotate(
                        *(path, (middle.real, middle.imag)),
                        xytext=(0, 5),
                        textcoords="offset points",
                        ha="center",
                        color=colour,
                        path_effects=halo(2.5),
                    )
            tip, colour = ends[-1], INK if number else MUTED
            label = f"{state}: {abs(tip):.3g} {unit}"
            axes.plot([0, tip.real], [0, tip.imag], color=colour, linewidth=2.4, label=label)
            axes.plot(tip.real, tip.imag, "o", color=colour, markersize=6)
        axes.margins(0.1)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel(f"real part [{unit}]")
        axes.set_ylabel(f"imaginary part [{unit}]")
        place_legend(axes, ax, loc="outside upper right", ncols=len(contributions))
        return axes
