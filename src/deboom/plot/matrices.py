"""Matrices as pictures: a colour or a curve in every entry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.curves import frequency_axis
from deboom.plot.style import (
    FULL_WIDTH,
    INK,
    TRACK,
    VEHICLE_PALETTE,
    RealArray,
    finite,
    panel_grid,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def cell_numbers(values: RealArray, decimals: int, largest: float = 1.0) -> npt.NDArray[np.str_]:
    """Write every number of a matrix as `cell_number` does."""
    flat = [cell_number(float(value), decimals, largest) for value in values.ravel()]
    return np.array(flat).reshape(values.shape)


def cell_number(value: float, decimals: int, largest: float = 1.0) -> str:
    """Round a number; the largest one, such as a full agreement, is written for nothing less."""
    rounded = round(value, decimals)
    if abs(value) < largest - 1e-9:  # beyond what arithmetic leaves of a full agreement
        most = largest - 10.0**-decimals
        rounded = min(max(rounded, -most), most)
    return f"{rounded + 0.0:.{decimals}f}".replace("-", "−")


_CELL = 1.13
_SMALL = 7.0


@dataclass(frozen=True, eq=False)
class HeatMap:
    """One matrix of numbers.

    - `title`: what it shows, with the unit of other numbers than [1].
    - `rows`, `columns`: labels; `row_title`, `column_title`: what these are.
    - `values` (n_rows, n_columns).
    - `limits`: ends of the colour scale; where the first is negative, signs have colours.
    - `decimals`: of the numbers in the cells.
    - `texts` (n_rows, n_columns), optional: what stands in the cells in place of the numbers.
    """

    title: str
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    values: npt.ArrayLike
    row_title: str = ""
    column_title: str = ""
    limits: tuple[float, float] = (0.0, 1.0)
    decimals: int = 2
    texts: npt.NDArray[np.str_] | None = None


def curve_matrix(
    names: Sequence[str],
    frequency: npt.ArrayLike,
    curves: Mapping[str, npt.ArrayLike],
    *,
    units: Sequence[str],
    what: str,
    reading: str = "response in rows, excitation in columns",
    dashed: Sequence[str] = (),
    fitted: Sequence[tuple[float, float]] = (),
    logarithmic: bool = False,
) -> Figure:
    """Draw one small panel per entry of a matrix.

    - `names`: of rows and columns, translations before rotations.
    - `frequency` (n_frequency,): increasing, above 0 [Hz].
    - `curves` (n_frequency, n, n): label → real values.
    - `units`: of the translational, the coupling and the rotational entries.
    - `what`: quantity, `reading`: what rows and columns are; both for the title.
    - `dashed`: labels whose curves are dashed and dark.
    - `fitted`: frequency bands that are shaded [Hz].
    - `logarithmic`: scale of the values; entries of one unit then share it.
    - raises InputError: a shape that does not fit, values that are not finite.
    """
    n = len(names)
    lines = finite("curve_matrix", {"frequency": frequency})["frequency"]
    values = finite("curve_matrix", {"frequency": frequency, **curves})
    for name in curves:
        if values[name].shape != (lines.size, n, n):
            raise InputError(f"figure curve_matrix: {name} has shape {values[name].shape}")
    plain = [name for name in curves if name not in dashed]
    colour = {name: VEHICLE_PALETTE[i % len(VEHICLE_PALETTE)] for i, name in enumerate(plain)}
    height = 0.95 + n * _CELL
    with styled_figure(FULL_WIDTH, height) as figure:
        # places by hand: the layout engine takes seconds over 36 panels
        figure.set_layout_engine("none")
        places = {
            "left": 0.075,
            "right": 0.99,
            "bottom": 0.62 / height,
            "top": 1 - 0.5 / height,
            "wspace": 0.4 if logarithmic else 0.33,  # a shared scale has labels in the middle, too
            "hspace": 0.12 if logarithmic else 0.24,
        }
        grid = figure.subplots(n, n, sharex=True, gridspec_kw=places)
        # of one panel: each would look at all that share its scale
        frequency_axis(grid[0, 0], lines[0], lines[-1])
        grid[0, 0].set_xticks([tick for tick in (10, 30, 100) if lines[0] <= tick <= lines[-1]])
        for row in range(n):
            for column in range(n):
                axes = grid[row, column]
                for low, high in fitted:
                    axes.axvspan(low, high, color=TRACK, alpha=0.6, linewidth=0, zorder=0)
                for name in curves:
                    model = name in dashed
                    axes.plot(
                        lines,
                        values[name][:, row, column],
                        color=colour.get(name, INK),
                        ls=(0, (3, 1.5)) if model else "-",
                        linewidth=0.7 if model else 1.1,
                        zorder=3 if model else 2,
                        label=name,
                    )
                _small_axes(axes, logarithmic=logarithmic)
                if row == 0:
                    axes.set_title(names[column], fontweight="bold")
                if column == 0:
                    axes.annotate(
                        names[row],
                        (0.008, 0.5),
                        xycoords=("figure fraction", "axes fraction"),
                        rotation=90,
                        va="center",
                        fontweight="bold",
                    )
                if row == n - 1:
                    axes.set_xlabel("f [Hz]", fontsize=7, labelpad=1)
        if logarithmic:
            _share_blocks(grid, n)
        figure.suptitle(
            f"{what}: {reading}; translations [{units[0]}], couplings [{units[1]}], rotations "
            f"[{units[2]}]",
            fontsize=8,
            y=1 - 0.1 / height,
            va="top",
        )
        if len(curves) > 1:
            handles, labels = grid[0, 0].get_legend_handles_labels()
            figure.legend(handles, labels, loc="lower center", ncols=min(len(labels), 4))
        return figure


def heat_maps(maps: Sequence[HeatMap], *, columns: int = 3) -> Figure:
    """Draw matrices side by side, each number written into its cell.

    - `maps`: at least one.
    - `columns`: per row of the figure.
    - raises InputError: no map, a shape that does not fit its labels, values that are not finite.
    """
    import seaborn as sns

    tallest = max((len(heat_map.rows) / len(heat_map.columns) for heat_map in maps), default=1.0)
    height = 0.25 + FULL_WIDTH / columns * min(tallest, 1.0)
    with panel_grid("heat_maps", len(maps), columns, 0.0, height) as (figure, grid):
        for axes, heat_map in zip(grid, maps, strict=True):
            values = finite("heat_maps", {heat_map.title: heat_map.values})[heat_map.title]
            if values.shape != (len(heat_map.rows), len(heat_map.columns)):
                raise InputError(f"figure heat_maps: {heat_map.title} has shape {values.shape}")
            sns.heatmap(
                values,
                ax=axes,
                cmap="PuOr_r" if heat_map.limits[0] < 0 else "Blues",
                vmin=heat_map.limits[0],
                vmax=heat_map.limits[1],
                annot=cell_numbers(values, heat_map.decimals, heat_map.limits[1])
                if heat_map.texts is None
                else heat_map.texts,
                fmt="",
                annot_kws={"fontsize": 6.3},
                xticklabels=list(heat_map.columns),
                yticklabels=list(heat_map.rows),
                square=True,
                cbar=False,
            )
            axes.grid(visible=False)
            axes.tick_params(length=0, labelsize=7.0)
            axes.tick_params(axis="y", rotation=0)
            axes.set(xlabel=heat_map.column_title, ylabel=heat_map.row_title)
            axes.set_title(heat_map.title, loc="left", fontweight="bold", fontsize=8.5)
        return figure


def _small_axes(axes: Axes, *, logarithmic: bool) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator, NullLocator

    if logarithmic:
        axes.set_yscale("log")
        axes.yaxis.set_minor_locator(NullLocator())
        # names may have a dollar sign, so powers of ten are not set as formulae
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _short_power(value)))
    else:
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
        axes.yaxis.get_offset_text().set_fontsize(_SMALL)
    axes.tick_params(labelsize=_SMALL, length=2, pad=1.5)


def _short_power(value: float) -> str:
    """Write a power of ten in at most four letters: 0.01, 100, 1e-4, 1e5."""
    return f"{value:g}" if 0.01 <= value <= 1000.0 else f"1e{round(float(np.log10(value)))}"


def _share_blocks(grid: npt.NDArray[np.object_], n: int) -> None:
    """One scale for all entries of a unit; numbers only at the left end of a block."""
    half = n // 2
    first, last = slice(None, half), slice(half, None)
    couplings = [*grid[first, last].ravel(), *grid[last, first].ravel()]
    for block in (list(grid[first, first].ravel()), couplings, list(grid[last, last].ravel())):
        limits = np.array([axes.get_ylim() for axes in block])
        for axes in block:
            axes.set_ylim(limits[:, 0].min(), limits[:, 1].max())
    for column in range(n):
        if column not in (0, half):
            for axes in grid[:, column]:
                axes.tick_params(labelleft=False)
