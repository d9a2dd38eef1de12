"""Sound pressure level over frequency and engine speed: baseline against optimised (Figure 47)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import RealArray, finite, png, styled_figure
from deboom.report.figures.labels import freeze_layout, place_labels
from deboom.report.style import FULL_WIDTH, INK, MUTED, signed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

_PANEL_HEIGHT = {1: 2.9, 2: 1.85, 3: 1.6}  # in, by the number of columns
_RANGE = 50.0  # dB below the loudest line; deeper notches leave the panel
_HEADROOM = 9.0  # dB above the loudest line, for marker and label
_ABOVE = 1.8  # dB between a curve and the tip that points at its peak
_SAME_PEAK = 1.5  # Hz; a peak that stayed where it was is labelled once


def spl_curves(
    frequency: npt.ArrayLike,
    order: float,
    baseline: npt.ArrayLike,
    optimised: npt.ArrayLike,
    vehicles: Sequence[str],
    peaks_before: Sequence[npt.ArrayLike],
    peaks_after: Sequence[npt.ArrayLike],
    colours: Mapping[str, str],
) -> bytes:
    """Draw one panel per vehicle, Hz below and rpm above, all on one dB scale.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Lines [Hz].
    order : float
        Engine order of the lines [1]; gives the rpm axis.
    baseline, optimised : array, shape (n_vehicle, n_frequency)
        SPL [dB(A)].
    vehicles : sequence of str
        Name of each row.
    peaks_before, peaks_after : sequence of arrays
        Frequencies of the booming peaks of each vehicle [Hz], for baseline and optimised.
    colours : mapping of str to str
        Colour of each vehicle, from `deboom.report.style.vehicle_colours`.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Shapes that disagree or values that are not finite.

    Notes
    -----
    As the text of the thesis on its Figure 47: baseline dashed, optimised solid. The scale ends
    50 dB below the loudest line; deeper notches leave the panel.
    """
    lines = finite("spl_curves", {"frequency": frequency})["frequency"]
    rows = finite(
        "spl_curves",
        {
            "baseline": baseline,
            "optimised": optimised,
            "vehicles": np.zeros(len(vehicles)),
            "peaks_before": np.zeros(len(peaks_before)),
            "peaks_after": np.zeros(len(peaks_after)),
        },
    )
    for name in ("baseline", "optimised"):
        if rows[name].shape != (len(vehicles), lines.size):
            raise InputError(
                f"figure spl_curves: {name} has shape {rows[name].shape}, expected (n_vehicle, "
                f"n_frequency) = ({len(vehicles)}, {lines.size})"
            )
    columns = min(len(vehicles), 2 if len(vehicles) <= 6 else 3)
    n_rows = -(-len(vehicles) // columns)
    with styled_figure(FULL_WIDTH, 1.15 + n_rows * _PANEL_HEIGHT[columns]) as figure:
        figure.get_layout_engine().set(wspace=0.06)  # type: ignore[union-attr, call-arg]
        panels = _panels(figure, n_rows, columns, len(vehicles))
        for place, (axes, name) in enumerate(zip(panels, vehicles, strict=True)):
            _curves(axes, lines, rows["baseline"][place], rows["optimised"][place], colours[name])
            axes.set_title(name, loc="left", fontweight="bold")
            change = float(np.mean(rows["optimised"][place] - rows["baseline"][place]))
            axes.set_title(f"mean change {signed(change, 1)} dB", loc="right", fontsize=8.0)
            if place < columns:
                rpm_axis(axes, order)
            if place + columns >= len(vehicles):
                axes.tick_params(labelbottom=True)
                axes.set_xlabel("frequency [Hz]")
            if place % columns == 0:
                axes.set_ylabel("SPL [dB(A)]")
        _level_axis(panels[0], lines, np.vstack([rows["baseline"], rows["optimised"]]))
        _legend(figure, panels, n_rows * columns)
        freeze_layout(figure)
        for place, axes in enumerate(panels):
            curves = (rows["baseline"][place], rows["optimised"][place])
            peaks = (np.asarray(peaks_before[place]), np.asarray(peaks_after[place]))
            _peaks(axes, lines, curves, peaks, colours[vehicles[place]])
        return png(figure)


def _panels(figure: Figure, n_rows: int, columns: int, count: int) -> list[Axes]:
    grid = figure.subplots(n_rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.set_axis_off()
    return list(grid[:count])


def _curves(
    axes: Axes, frequency: RealArray, before: RealArray, after: RealArray, colour: str
) -> None:
    quieter = after < before
    axes.fill_between(
        frequency, before, after, where=quieter, color=colour, alpha=0.22, linewidth=0.0
    )
    axes.plot(frequency, before, color=MUTED, linewidth=1.1, linestyle=(0, (4, 1.6)))
    axes.plot(frequency, after, color=colour, linewidth=1.5)


def rpm_axis(axes: Axes, order: float, label: str = "engine speed [rpm]") -> None:
    """Put the speed above a frequency axis [Hz] of an order."""
    from matplotlib.ticker import MaxNLocator

    def rpm(frequency: npt.ArrayLike) -> npt.ArrayLike:
        return np.asarray(frequency, dtype=float) * 60.0 / order

    def hertz(speed: npt.ArrayLike) -> npt.ArrayLike:
        return np.asarray(speed, dtype=float) * order / 60.0

    top = axes.secondary_xaxis("top", functions=(rpm, hertz))
    top.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 4, 5, 10]))
    top.set_xlabel(label)


def _level_axis(axes: Axes, frequency: RealArray, levels: RealArray) -> None:
    """Grid of 10 dB with 5 dB between; the panels share it."""
    from matplotlib.ticker import MultipleLocator

    highest = 5.0 * np.ceil((levels.max() + _HEADROOM) / 5.0)
    lowest = 5.0 * np.floor(max(levels.min(), levels.max() - _RANGE) / 5.0)
    axes.set_ylim(lowest, highest)
    axes.set_xlim(frequency[0], frequency[-1])
    axes.yaxis.set_major_locator(MultipleLocator(10.0))
    axes.yaxis.set_minor_locator(MultipleLocator(5.0))
    for panel in axes.get_figure().axes:  # type: ignore[union-attr]
        panel.grid(True, which="minor", axis="y", linewidth=0.4)


def _legend(figure: Figure, panels: list[Axes], cells: int) -> None:
    handles: list[Line2D | Patch] = _legend_handles()
    if len(panels) < cells:
        free = figure.axes[len(panels)]
        free.legend(handles=handles, loc="center left", fontsize=8.5)
    else:
        figure.legend(handles=handles, loc="outside lower center", ncols=3)


def _legend_handles() -> list[Line2D | Patch]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    return [
        Line2D([], [], color=MUTED, linewidth=1.1, linestyle=(0, (4, 1.6)), label="baseline"),
        Line2D([], [], color=INK, linewidth=1.5, label="optimised"),
        Patch(facecolor=INK, alpha=0.22, label="quieter than baseline"),
        _peak_marker("v", "white", MUTED, "booming peak [Hz], baseline"),
        _peak_marker("^", INK, INK, "booming peak [Hz], optimised"),
    ]


def _peak_marker(shape: str, face: str, edge: str, label: str) -> Line2D:
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        linestyle="none",
        marker=shape,
        markersize=6,
        markerfacecolor=face,
        markeredgecolor=edge,
        label=label,
    )


def _peaks(
    axes: Axes,
    frequency: RealArray,
    curves: tuple[RealArray, RealArray],
    peaks: tuple[RealArray, RealArray],
    colour: str,
) -> None:
    """Mark the peaks of both curves and write the frequency of each place once."""
    looks = (("v", _ABOVE, "white", MUTED), ("^", -_ABOVE, colour, colour))
    for curve, found, (shape, above, face, edge) in zip(curves, peaks, looks, strict=True):
        axes.plot(
            found,
            np.interp(found, frequency, curve) + above,
            shape,
            markersize=5,
            markerfacecolor=face,
            markeredgecolor=edge,
            linestyle="none",
        )
    before, after = peaks
    moved = [f for f in after if not np.any(np.abs(before - f) < _SAME_PEAK)]
    labelled = np.concatenate([before, np.asarray(moved, dtype=float)])
    heights = np.maximum(*(np.interp(labelled, frequency, curve) for curve in curves)) + _ABOVE
    every = np.concatenate([np.column_stack([frequency, curve]) for curve in curves])
    place_labels(
        axes,
        np.column_stack([labelled, heights]),
        [f"{f:.1f}" for f in labelled],
        [INK] * labelled.size,
        obstacles=every,
        size=7.0,
    )
