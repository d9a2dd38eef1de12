"""Every response against every other, as in the thesis: clouds below, coefficients above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import RealArray, finite, png, styled_figure
from deboom.report.figures.correlations import coefficient
from deboom.report.style import FULL_WIDTH, INK, MUTED, VEHICLE_PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 8
"""Responses that one figure holds legibly."""
_MARGINS = {
    "left": 0.075,
    "right": 0.995,
    "bottom": 0.065,
    "top": 0.97,
    "wspace": 0.1,
    "hspace": 0.1,
}
_DOTS = 1500  # a cloud of more is thinned


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
    from matplotlib.ticker import MaxNLocator

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
    # in a fixed random order: every n-th row may be the same tolerance draw of every design
    dots = data[np.random.default_rng(1).permutation(len(data))[:_DOTS]]
    margin = 0.04 * np.ptp(data, axis=0)
    limits = np.stack([data.min(axis=0) - margin, data.max(axis=0) + margin], axis=1)
    with styled_figure(FULL_WIDTH, FULL_WIDTH) as figure:
        figure.set_layout_engine("none")  # the automatic one takes seconds for so many panels
        grid = figure.subplots(n, n, gridspec_kw=_MARGINS)
        for row in range(n):
            for column in range(n):
                axes = grid[row, column]
                if row < column:
                    axes.set_axis_off()
                    _coefficient(axes, r[row, column], low[row, column], high[row, column])
                    if row == 0:
                        axes.set_title(names[column], fontweight="bold")
                    continue
                axes.set_xlim(*limits[column])
                axes.xaxis.set_major_locator(MaxNLocator(3))
                axes.tick_params(labelsize=6.5, length=2, pad=1.5)
                axes.tick_params(labelbottom=row == n - 1, labelleft=column == 0)
                if row == column:
                    axes.hist(
                        data[:, row],
                        bins=20,
                        color=colours.get(names[row], MUTED),
                        histtype="stepfilled",
                    )
                    axes.set_yticks([])
                else:
                    _cloud(axes, dots[:, column], dots[:, row])
                    axes.set_ylim(*limits[row])
                    axes.yaxis.set_major_locator(MaxNLocator(3))
                if row == 0:
                    axes.set_title(names[column], fontweight="bold")
                if column == 0:
                    axes.set_ylabel(names[row], fontweight="bold", fontsize=9)
                    axes.yaxis.set_label_coords(-0.058 * n, 0.5)
        figure.supxlabel(value_label, fontsize=8.5)
        return png(figure)


def _cloud(axes: Axes, x: RealArray, y: RealArray) -> None:
    axes.plot(x, y, "o", markersize=1.8, alpha=0.45, color=VEHICLE_PALETTE[0], markeredgewidth=0)
    slope, offset = np.polyfit(x - x.mean(), y, 1)
    ends = np.array([x.min(), x.max()])
    axes.plot(ends, offset + slope * (ends - x.mean()), color=VEHICLE_PALETTE[1], linewidth=1.0)


def _coefficient(axes: Axes, value: float, low: float, high: float) -> None:
    text = coefficient(value, 3)
    axes.text(
        0.5, 0.56, text, transform=axes.transAxes, ha="center", va="center", fontsize=11, color=INK
    )
    ends = f"{coefficient(low, 3)} – {coefficient(high, 3)}"
    axes.text(
        *(0.5, 0.34, ends),
        transform=axes.transAxes,
        ha="center",
        va="center",
        fontsize=6.5,
        color=MUTED,
    )
