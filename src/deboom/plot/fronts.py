"""Pareto fronts: one with its errors, several beside each other, and the designs on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    FULL_WIDTH,
    INK,
    MUTED,
    VEHICLE_PALETTE,
    canvas,
    figure_of,
    finite,
    place_legend,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PICK_MARKERS = ("o", "D", "^", "s", "P", "v")
_FRONT_COLOUR = "#4C86B0"
_ERROR_COLOUR = "#C3D7E6"
_NARROW = {"fontsize": 7.5, "columnspacing": 0.8, "handlelength": 1.2, "handletextpad": 0.4}
"""Looks of a legend beside which a half figure has room for two columns."""

Pairs = Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]]


def pareto_front(
    mean: npt.ArrayLike,
    sigma: npt.ArrayLike,
    mean_error: npt.ArrayLike,
    sigma_error: npt.ArrayLike,
    baseline: tuple[float, float] | None,
    picks: Mapping[str, tuple[float, float]],
    *,
    mean_label: str,
    sigma_label: str,
    label: str = "front, ± 95 %",
    beside: Pairs | None = None,
    width: float = FULL_WIDTH,
    ax: Axes | None = None,
) -> Axes:
    """Draw the two objectives of the front, both minimised, with baseline and named picks.

    Parameters
    ----------
    mean, sigma : array, shape (n_front,)
        Objectives [unit in the label].
    mean_error, sigma_error : array, shape (n_front,) or (n_front, 2)
        How far bars reach to both sides, or down and up, such as halves of 95 % intervals [unit of
        the label].
    baseline : (float, float) or None
        Mean and sigma of the nominal design [units of the labels]; None where it has none.
    picks : mapping of str to (float, float)
        Mean and sigma of each named design [units of the labels].
    mean_label, sigma_label : str
        Axis labels with units.
    label : str
        What points and bars are.
    beside : mapping of str to two arrays, optional
        Both objectives of further fronts, drawn as muted lines, by label [units of the labels].
    width : float
        Of a figure of its own [inch].
    ax : Axes, optional
        Where to draw; by default a figure of its own.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        Arrays of different lengths or values that are not finite.
    """
    front = finite(
        "pareto_front",
        {"mean": mean, "sigma": sigma, "mean_error": mean_error, "sigma_error": sigma_error},
    )
    today = [] if baseline is None else [baseline]
    if today:
        finite("pareto_front", {"baseline": today})
    finite("pareto_front", picks)
    order = np.argsort(front["mean"], kind="stable")
    points = np.column_stack([front["mean"], front["sigma"]])[order]
    with canvas(ax, width, min(4.0, 0.85 * width)) as axes:
        for name, (x, y) in (beside or {}).items():
            pair = finite("pareto_front", {f"{name} x": x, f"{name} y": y})
            axes.plot(*pair.values(), color=MUTED, linewidth=1.2, label=name)
        axes.errorbar(
            points[:, 0],
            points[:, 1],
            xerr=front["mean_error"][order].T,
            yerr=front["sigma_error"][order].T,
            fmt="o",
            markersize=3.6,
            color=_FRONT_COLOUR,
            ecolor=_ERROR_COLOUR,
            elinewidth=0.8,
            label=label,
        )
        for place in today:
            axes.plot(*place, "X", color=INK, markersize=8, ls="none", zorder=4, label="today")
        for number, (position, name) in enumerate(_by_place(picks).items()):
            axes.plot(
                *position,
                marker=_PICK_MARKERS[number % len(_PICK_MARKERS)],
                color=VEHICLE_PALETTE[1],
                markeredgecolor="white",
                markersize=8.5,
                linestyle="none",
                zorder=5,
                label=name,
            )
        axes.margins(0.08)
        axes.set_xlabel(f"← better    {mean_label}")
        axes.set_ylabel(f"← better    {sigma_label}")
        axes.ticklabel_format(useOffset=False, style="plain")
        place_legend(axes, ax, loc="outside upper right", ncols=2, **_NARROW)
        return axes


def _by_place(
    picks: Mapping[str, tuple[float, float]],
) -> dict[tuple[float, float], str]:
    """Join the names of picks that are one and the same design."""
    joined: dict[tuple[float, float], str] = {}
    for name, place in picks.items():
        joined[place] = f"{joined[place]}, {name}" if place in joined else name
    return joined


def fronts(
    curves: Pairs,
    points: Pairs,
    marks: Mapping[str, tuple[float, float]],
    *,
    mean_label: str,
    sigma_label: str,
    width: float = FULL_WIDTH,
    ax: Axes | None = None,
) -> Axes:
    """Draw several fronts of two objectives, with clouds of designs and single designs.

    - `curves`: label → both objectives of a front, drawn as points on a step line.
    - `points`: label → both objectives of many designs, drawn small and below.
    - `marks`: label → both objectives of one design, the first one in black; designs at one place
      share a mark.
    - `mean_label`, `sigma_label`: axis labels with units.
    - `width`: of a figure of its own [inch].
    - raises InputError: no front, arrays of different lengths or values that are not finite.
    """
    if not curves:
        raise InputError("figure fronts: there is no front to draw")
    with canvas(ax, width, min(3.4, 0.85 * width)) as axes:
        for name, (x, y) in points.items():
            pair = finite("fronts", {f"{name} x": x, f"{name} y": y})
            axes.plot(*pair.values(), ".", color=MUTED, markersize=2.5, alpha=0.45, label=name)
        for place, (name, (x, y)) in enumerate(curves.items()):
            pair = finite("fronts", {f"{name} x": x, f"{name} y": y})
            colour = VEHICLE_PALETTE[place % len(VEHICLE_PALETTE)]
            axes.step(
                *pair.values(),
                where="post",
                color=colour,
                linewidth=1.0,
                marker="o",
                markersize=3.0,
                label=name,
            )
        for number, (place_of, name) in enumerate(_by_place(marks).items()):
            if number == 0:
                axes.plot(*place_of, "X", color=INK, markersize=8.0, linestyle="none", label=name)
                continue
            axes.plot(
                *place_of,
                marker=_PICK_MARKERS[(number - 1) % len(_PICK_MARKERS)],
                color=VEHICLE_PALETTE[1],
                markeredgecolor="white",
                markersize=8.5,
                linestyle="none",
                zorder=5,
                label=name,
            )
        axes.set_xlabel(mean_label)
        axes.set_ylabel(sigma_label)
        place_legend(axes, ax, loc="outside upper right", ncols=2, **_NARROW)
        return axes


_LINES = 300
"""From twice this number of designs on, lines are thinned to about this number, evenly."""

_BESIDE = 5
"""Names that have room beside each other below an axis or in a legend."""


def parallel_coordinates(
    names: Sequence[str],
    designs: npt.ArrayLike,
    bounds: npt.ArrayLike,
    value: npt.ArrayLike,
    marks: Mapping[str, npt.ArrayLike],
    *,
    value_label: str,
    share_label: str = "from lower to upper bound [%]",
    ax: Axes | None = None,
) -> Axes:
    """Draw every design as a line over its variables, coloured by a response.

    - `names`: of the k variables.
    - `designs` (n, k), `bounds` (2, k): lower, then upper ones [units of the variables].
    - `value` (n,): of each design [unit of the label].
    - `marks` (k,): single designs by name, drawn above all others.
    - `share_label`: what the height of a line means, with unit.
    - raises InputError: shapes that disagree, values that are not finite.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    rows = finite("parallel_coordinates", {"value": value})["value"]
    low, high = finite("parallel_coordinates", {"bounds": bounds})["bounds"]
    everything = [np.atleast_2d(given) for given in (designs, *marks.values())]
    if any(given.shape[1] != len(names) for given in everything) or len(everything[0]) != len(rows):
        raise InputError(
            "figure parallel_coordinates: give one column per variable, one value each"
        )
    shares = [100.0 * (given - low) / (high - low) for given in everything]
    colour = ScalarMappable(Normalize(rows.min(), rows.max()), colormaps["viridis"])
    places = np.arange(len(names))
    with canvas(ax, FULL_WIDTH, 2.9) as axes:
        for row in np.argsort(-rows, kind="stable")[:: max(1, len(rows) // _LINES)]:
            axes.plot(places, shares[0][row], color=colour.to_rgba(rows[row]), alpha=0.5, lw=0.8)
        for number, (name, (share,)) in enumerate(zip(marks, shares[1:], strict=True)):
            axes.plot(
                places,
                share,
                color=INK if number else MUTED,
                linewidth=1.5,
                marker=_PICK_MARKERS[number % len(_PICK_MARKERS)],
                markersize=5,
                label=name,
            )
        if len(names) > _BESIDE:
            axes.set_xticks(places, names, rotation=35, ha="right", rotation_mode="anchor")
        else:
            axes.set_xticks(places, names)
        axes.set_ylabel(share_label)
        figure_of(axes).colorbar(colour, ax=axes, label=value_label, pad=0.02)
        columns = len(marks) if len(marks) <= _BESIDE else 3
        place_legend(axes, ax, loc="outside upper left", ncols=columns)
        return axes
