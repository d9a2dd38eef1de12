"""A matrix as coloured cells with its numbers in them: what every heat map here is drawn from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from deboom.report.figures.canvas import RealArray
from deboom.report.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage

_DARK_FROM = 0.55
"""Share of the scale from which a cell is so dark that its number is white."""


def matrix_cells(
    axes: Axes,
    values: RealArray,
    rows: Sequence[str],
    columns: Sequence[str],
    *,
    limits: tuple[float, float] = (0.0, 1.0),
    fontsize: float = 7.0,
) -> AxesImage:
    """Draw the cells and their labels; where the first limit is negative, signs have colours.

    Parameters
    ----------
    axes : Axes
    values : array, shape (n_row, n_column)
        In one unit.
    rows, columns : sequence of str
        Labels.
    limits : (float, float)
        Ends of the colour scale [unit of the values].
    fontsize : float
        Of the labels [pt].

    Returns
    -------
    AxesImage
        For a colour bar.
    """
    shown = axes.imshow(
        values, cmap="PuOr_r" if limits[0] < 0 else "Blues", vmin=limits[0], vmax=limits[1]
    )
    axes.grid(visible=False)
    axes.set_xticks(range(len(columns)), columns, fontsize=fontsize)
    axes.set_yticks(range(len(rows)), rows, fontsize=fontsize)
    axes.tick_params(length=0)
    return shown


def write_cells(
    axes: Axes,
    values: RealArray,
    *,
    decimals: int,
    fontsize: float,
    largest: float = 1.0,
) -> None:
    """Write its number into every cell, white where the cell is dark.

    Parameters
    ----------
    axes : Axes
    values : array, shape (n_row, n_column)
        What the cells are coloured by.
    decimals : int
        As `cell_number` writes them.
    fontsize : float
        [pt].
    largest : float
        Upper end of the colour scale [unit of the values].
    """
    for (row, column), value in np.ndenumerate(values):
        axes.text(
            column,
            row,
            cell_number(float(value), decimals, largest),
            ha="center",
            va="center",
            fontsize=fontsize,
            color=on_cell(float(value), largest),
        )


def on_cell(value: float, largest: float = 1.0) -> str:
    """Colour in which a text on the cell of a value can be read."""
    return "white" if abs(value) > _DARK_FROM * largest else INK


def cell_number(value: float, decimals: int, largest: float = 1.0) -> str:
    """Round a number; the largest one, such as a full agreement, is written for nothing less."""
    rounded = round(value, decimals)
    if abs(value) < largest - 1e-9:  # beyond what arithmetic leaves of a full agreement
        most = largest - 10.0**-decimals
        rounded = min(max(rounded, -most), most)
    return f"{rounded + 0.0:.{decimals}f}".replace("-", "−")
