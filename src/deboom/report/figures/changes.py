"""What each vehicle gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.report.figures.canvas import RealArray, finite, halo, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, signed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


def per_vehicle_change(
    vehicles: Sequence[str],
    level_change: npt.ArrayLike,
    level_sigma: npt.ArrayLike,
    energy_change: npt.ArrayLike,
    energy_sigma: npt.ArrayLike,
    colours: Mapping[str, str],
    *,
    level_label: str,
    energy_label: str,
) -> bytes:
    """Draw the change of each vehicle against the baseline, with ± one standard deviation.

    Parameters
    ----------
    vehicles : sequence of str
        n names.
    level_change, level_sigma : array, shape (n,)
        Change of the mean SPL over the lines (SPLV over the number of lines) and its scatter over
        the mounts' tolerance [dB].
    energy_change, energy_sigma : array, shape (n,)
        Change of the energy level of one band and its scatter [dB].
    colours : mapping of str to str
        Colour of each vehicle, from `deboom.report.style.vehicle_colours`.
    level_label, energy_label : str
        Axis labels with units and band.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Arrays of different lengths or values that are not finite.
    """
    rows = finite(
        "per_vehicle_change",
        {
            "vehicles": np.zeros(len(vehicles)),
            "level_change": level_change,
            "level_sigma": level_sigma,
            "energy_change": energy_change,
            "energy_sigma": energy_sigma,
        },
    )
    paint = [colours[name] for name in vehicles]
    with styled_figure(FULL_WIDTH, 1.2 + 0.3 * len(vehicles)) as figure:
        left, right = figure.subplots(1, 2, sharex=True, sharey=True)
        _bars(left, rows["level_change"], rows["level_sigma"], paint, level_label)
        _bars(right, rows["energy_change"], rows["energy_sigma"], paint, energy_label)
        left.set_yticks(range(len(vehicles)), vehicles)
        left.set_ylim(len(vehicles) - 0.4, -0.6)
        left.set_xlim(*_limits(rows))
        figure.legend(handles=[_sigma_handle()], loc="outside lower right")
        return png(figure)


def _sigma_handle() -> Line2D:
    from matplotlib.lines import Line2D

    return Line2D(
        [],
        [],
        color=INK,
        linewidth=1.0,
        marker="|",
        markersize=4.5,
        label="± one standard deviation over the tolerance",
    )


def _limits(rows: Mapping[str, RealArray]) -> tuple[float, float]:
    """One scale for both panels, with room for the numbers beyond the bars."""
    lows = [rows[f"{what}_change"] - rows[f"{what}_sigma"] for what in ("level", "energy")]
    highs = [rows[f"{what}_change"] + rows[f"{what}_sigma"] for what in ("level", "energy")]
    low, high = min(0.0, float(np.min(lows))), max(0.0, float(np.max(highs)))
    room = 0.17 * max(high - low, 0.1)
    return low - (room if low < 0.0 else 0.0), high + (room if high > 0.0 or low == 0.0 else 0.0)


def _bars(
    axes: Axes, change: RealArray, sigma: RealArray, paint: Sequence[str], label: str
) -> None:
    from matplotlib.ticker import MaxNLocator

    places = np.arange(change.size)
    axes.barh(places - 0.1, change, height=0.42, color=list(paint))
    axes.axvline(0.0, color=INK, linewidth=0.9)
    for place, value, spread in zip(places, change, sigma, strict=True):
        ends = [value - spread, value + spread]
        axes.plot(ends, [place + 0.26] * 2, "|-", color=INK, linewidth=1.0, markersize=4.5)
        side = -1 if value < 0 else 1
        axes.annotate(
            signed(value, 1),
            (value, place - 0.1),
            xytext=(4 * side, 0),
            textcoords="offset points",
            ha="right" if side < 0 else "left",
            va="center_baseline",
            path_effects=halo(2.5),
        )
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel(f"← better    {label}")
