"""Modal analysis: poles over the order of the polynomial, and matrices of modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.figures.cells import matrix_cells, write_cells
from deboom.report.style import FULL_WIDTH, INK, MUTED, TRACK, VEHICLE_PALETTE

_STABLE, _ALONE = VEHICLE_PALETTE[0], VEHICLE_PALETTE[1]


def stabilisation_chart(
    frequency: npt.ArrayLike,
    level: npt.ArrayLike,
    pole_frequency: npt.ArrayLike,
    pole_order: npt.ArrayLike,
    stable: npt.ArrayLike,
    modes: npt.ArrayLike,
    *,
    level_label: str,
) -> bytes:
    """Draw the poles of every order over the sum of the FRFs, and the modes they agree on.

    Parameters
    ----------
    frequency : array, shape (f,)
        [Hz].
    level : array, shape (f,)
        Of the sum of the FRFs [unit in the label].
    pole_frequency, pole_order : array, shape (n_pole,)
        [Hz], [1].
    stable : bool array, shape (n_pole,)
        Confirmed by the order below.
    modes : array, shape (n_mode,)
        Natural frequencies taken as modes [Hz].
    level_label : str
        With unit.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Arrays of different lengths or values that are not finite.
    """
    curve = finite("stabilisation_chart", {"frequency": frequency, "level": level})
    poles = finite("stabilisation_chart", {"poles": pole_frequency, "orders": pole_order})
    confirmed = np.asarray(stable, dtype=bool)
    lines = finite("stabilisation_chart", {"modes": modes})["modes"]
    if confirmed.shape != poles["poles"].shape:
        raise InputError("figure stabilisation_chart: one flag for every pole")
    with styled_figure(FULL_WIDTH, 3.6) as figure:
        axes = figure.subplots()
        behind = axes.twinx()
        behind.fill_between(
            curve["frequency"], curve["level"], curve["level"].min(), color=TRACK, linewidth=0
        )
        behind.plot(curve["frequency"], curve["level"], color=MUTED, linewidth=1.1)
        behind.set_ylabel(level_label)
        behind.grid(visible=False)
        behind.spines["right"].set_visible(True)
        axes.set_zorder(behind.get_zorder() + 1)
        axes.patch.set_visible(False)
        span = curve["frequency"][-1] - curve["frequency"][0]
        close = np.diff(lines, prepend=-np.inf) < 0.045 * span
        for mode, raised in zip(lines, close, strict=True):
            axes.axvline(mode, color=INK, linewidth=0.7, linestyle=(0, (4, 2)))
            axes.annotate(
                f"{mode:.1f}",
                (mode, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 12 if raised else 3),
                textcoords="offset points",
                ha="center",
                fontsize=7.5,
            )
        for chosen, label, marker, colour in (
            (~confirmed, "once", "x", _ALONE),
            (confirmed, "stable in frequency and damping", "o", _STABLE),
        ):
            axes.plot(
                poles["poles"][chosen],
                poles["orders"][chosen],
                linestyle="none",
                marker=marker,
                markersize=3.6,
                markerfacecolor=colour if marker == "x" else "white",
                color=colour,
                label=label,
            )
        axes.set_xlim(curve["frequency"][0], curve["frequency"][-1])
        axes.set_ylim(poles["orders"].min() - 1, poles["orders"].max() + 1)
        axes.set_xlabel("frequency [Hz]; modes above the frame")
        axes.set_ylabel("order of the polynomial [1]")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
        return png(figure)


def matrix_map(
    values: npt.ArrayLike,
    rows: Sequence[str],
    columns: Sequence[str],
    *,
    value_label: str,
    limits: tuple[float, float] = (0.0, 1.0),
    decimals: int = 2,
) -> bytes:
    """Draw a matrix as a heat map with its numbers, such as a MAC matrix or shares of panels.

    Parameters
    ----------
    values : array, shape (n_row, n_column)
        [unit in the label].
    rows, columns : sequence of str
        Names.
    value_label : str
        With unit.
    limits : (float, float)
        Ends of the colour scale; where the first is negative, zero is white and signs have colours.
    decimals : int
        Of the numbers.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Names that do not fit the matrix, values that are not finite.
    """
    matrix = finite("matrix_map", {"values": values})["values"]
    if matrix.shape != (len(rows), len(columns)):
        raise InputError(
            f"figure matrix_map: {len(rows)} rows and {len(columns)} columns are named, the matrix "
            f"is {matrix.shape}"
        )
    longest = max(map(len, columns))
    with styled_figure(FULL_WIDTH, 0.9 + 0.36 * len(rows) + 0.055 * longest) as figure:
        axes = figure.subplots()
        shown = matrix_cells(axes, matrix, rows, columns, limits=limits)
        axes.set_aspect("auto")
        write_cells(axes, matrix, decimals=decimals, fontsize=7.5, largest=limits[1])
        figure.colorbar(shown, ax=axes, label=value_label, pad=0.02)
        for label in axes.get_xticklabels():
            label.set_rotation(35 if longest > 9 else 0)
            label.set_horizontalalignment("right" if longest > 9 else "center")
            label.set_rotation_mode("anchor")
        return png(figure)
