"""Every response against every other, as in the thesis: clouds below, coefficients above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import RealArray, finite, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, MUTED, VEHICLE_PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 8
"""Responses that one figure holds legibly."""
_DOTS = 1500  # a cloud of more is thinned, evenly


def scatter_matrix(
    names: Sequence[str],
    values: npt.ArrayLike,
    coefficients: tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike],
    colours: Mapping[str, str],
    *,
    value_label: str,
) -> bytes:
    """Draw histograms on the diagonal, clouds below it, correlations with intervals above it.

    Parameters
    ----------
    names : sequence of str
        Two to `MOST` responses.
    values : array, shape (n, r)
        One row per design [unit in the label].
    coefficients : (r, low, high), each of shape (r, r)
        Pearson's correlation and the ends of its interval [1].
    colours : mapping of str to str
        Of the histograms.
    value_label : str
        Of all axes, with unit.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Too few or too many responses, shapes that do not fit, values that are not finite.
    """
    n = len(names)
    if not 2 <= n <= MOST:
        raise InputError(f"figure scatter_matrix: {n} responses, it shows 2 to {MOST}")
    data = finite("scatter_matrix", {"values": values})["values"]
    r, low, high = (
        finite("scatter_matrix", {"coefficients": part})["coefficients"] for part in coefficients
    )
    if data.ndim != 2 or data.shape[1] != n or any(part.shape != (n, n) for part in (r, low, high)):
        raise InputError(
            f"figure scatter_matrix: values {data.shape} and coefficients {r.shape} for {n} names"
        )
    dots = data[:: max(-(-len(data) // _DOTS), 1)]
    with styled_figure(FULL_WIDTH, FULL_WIDTH) as figure:
        grid = figure.subplots(n, n, sharex="col")
        for row in range(n):
            for column in range(n):
                axes = grid[row, column]
                if row == column:
                    axes.hist(data[:, row], bins=20, color=colours.get(names[row], MUTED))
                    axes.set_yticks([])
                elif row > column:
                    _cloud(axes, dots[:, column], dots[:, row])
                else:
                    _coefficient(axes, r[row, column], low[row, column], high[row, column])
                if column > 0 or row == column:
                    axes.tick_params(labelleft=False)
                axes.tick_params(labelsize=6.5, length=2, pad=1.5)
                if row == 0:
                    axes.set_title(names[column], fontweight="bold")
                if column == 0:
                    axes.set_ylabel(names[row], fontweight="bold", fontsize=9)
        figure.supxlabel(value_label, fontsize=8.5)
        return png(figure)


def _cloud(axes: Axes, x: RealArray, y: RealArray) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.plot(x, y, "o", markersize=1.8, alpha=0.45, color=VEHICLE_PALETTE[0], markeredgewidth=0)
    slope, offset = np.polyfit(x - x.mean(), y, 1)
    ends = np.array([x.min(), x.max()])
    axes.plot(ends, offset + slope * (ends - x.mean()), color=VEHICLE_PALETTE[1], linewidth=1.0)
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_locator(MaxNLocator(3))


def _coefficient(axes: Axes, value: float, low: float, high: float) -> None:
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    axes.set_yticks([])
    axes.tick_params(axis="x", length=0)
    text = f"{np.trunc(1000.0 * value) / 1000.0:.3f}".replace("-", "−")
    axes.text(
        0.5, 0.56, text, transform=axes.transAxes, ha="center", va="center", fontsize=11, color=INK
    )
    ends = f"{low:.3f} – {high:.3f}".replace("-", "−")
    axes.text(
        *(0.5, 0.34, ends),
        transform=axes.transAxes,
        ha="center",
        va="center",
        fontsize=6.5,
        color=MUTED,
    )
