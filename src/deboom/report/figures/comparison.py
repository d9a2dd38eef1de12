"""Fronts of several runs under one judge: where they lie, how they differ, what is built there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, MUTED, TRACK, VEHICLE_PALETTE

_MARKERS = ("o", "s", "D", "^", "v", "P")
_BAR = 0.7
_MARKS = 40
"""Marks on a front that has more points."""


@dataclass(frozen=True, eq=False)
class AttainedFront:
    """What the runs of one configuration attain, two objectives.

    Parameters
    ----------
    median : array, shape (n, 2)
        What half of the runs attain; of a single run its front.
    best, worst : array, shape (n, 2), optional
        What at least one run, and what every run attains: the edges of the band.
    """

    median: npt.ArrayLike
    best: npt.ArrayLike | None = None
    worst: npt.ArrayLike | None = None


def attained_fronts(
    fronts: Mapping[str, AttainedFront],
    reference_point: tuple[float, float],
    *,
    mean_label: str,
    sigma_label: str,
) -> bytes:
    """Draw fronts of two objectives as steps, with bands from the best to the worst seed.

    Parameters
    ----------
    fronts : mapping of str to AttainedFront
        By configuration.
    reference_point : (float, float)
        Of the hypervolume, marked with a cross [units of the labels].
    mean_label, sigma_label : str
        Axis labels with units.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Nothing to draw, or values that are not finite.
    """
    if not fronts:
        raise InputError("figure attained_fronts: there is no front to draw")
    corner = finite("attained_fronts", {"reference point": reference_point})["reference point"]
    with styled_figure(FULL_WIDTH, 4.0) as figure:
        axes = figure.add_subplot()
        for place, (name, front) in enumerate(fronts.items()):
            colour = VEHICLE_PALETTE[place % len(VEHICLE_PALETTE)]
            if front.best is not None and front.worst is not None:
                best = _steps(f"{name}, best", front.best, corner)
                worst = _steps(f"{name}, worst", front.worst, corner)
                outline = np.vstack([best, worst[::-1]])
                axes.fill(*outline.T, color=colour, alpha=0.22, linewidth=0)
            points = finite("attained_fronts", {name: front.median})[name]
            axes.plot(*_steps(name, front.median, corner).T, color=colour, linewidth=1.3)
            axes.plot(
                *points.T,
                linestyle="none",
                marker=_MARKERS[place % len(_MARKERS)],
                markersize=3.6,
                markevery=max(len(points) // _MARKS, 1),
                color=colour,
                label=name,
            )
        axes.plot(*corner, "+", color=INK, markersize=10, markeredgewidth=1.4, clip_on=False)
        axes.annotate(
            "reference point",
            tuple(corner),
            xytext=(-7, -9),
            textcoords="offset points",
            ha="right",
            va="top",
            color=INK,
        )
        axes.set_xlabel(f"← better    {mean_label}")
        axes.set_ylabel(f"← better    {sigma_label}")
        axes.ticklabel_format(useOffset=False, style="plain")
        figure.legend(loc="outside upper right", ncols=3, markerscale=1.6)
        return png(figure)


def _steps(
    name: str, front: npt.ArrayLike, corner: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Return the edge of what a sorted front dominates, up to the corner, as a path."""
    points = finite("attained_fronts", {name: front})[name]
    points = points[np.all(points <= corner, axis=1)]
    if len(points) == 0:
        return np.array([corner])
    x = np.repeat(points[:, 0], 2)[1:]
    y = np.repeat(points[:, 1], 2)[:-1]
    first, last = (points[0, 0], corner[1]), (corner[0], points[-1, 1])
    return np.vstack([first, np.column_stack([x, y]), last])


def noise_bars(
    labels: Sequence[str],
    differences: npt.ArrayLike,
    noise: npt.ArrayLike,
    *,
    difference_label: str,
) -> bytes:
    """Draw each difference beside the band that chance alone may fill.

    Parameters
    ----------
    labels : sequence of str
        Pairs that were compared, top to bottom.
    differences, noise : array, shape (n_pairs,)
        Differences, and the largest that is still chance; NaN noise draws no band [unit of the
        label].
    difference_label : str
        Axis label with unit.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Arrays that do not fit the labels, differences that are not finite.
    """
    values = finite("noise_bars", {"labels": np.zeros(len(labels)), "differences": differences})
    reach = np.asarray(noise, dtype=float)
    if reach.shape != values["differences"].shape:
        raise InputError("figure noise_bars: give one noise per difference")
    with styled_figure(FULL_WIDTH, 1.15 + 0.3 * len(labels)) as figure:
        axes = figure.add_subplot()
        rows = np.arange(len(labels))
        known = np.nan_to_num(reach)
        band = axes.barh(rows, 2 * known, _BAR, -known, color=TRACK)
        band.set_label("what chance alone may give (99 %)")
        for patch in band:
            patch.sticky_edges.x.clear()
        axes.axvline(0.0, color=MUTED, linewidth=0.9)
        real = np.abs(values["differences"]) > reach
        for chosen, marker, colour, label in (
            (~real, "o", VEHICLE_PALETTE[0], "within noise"),
            (real, "D", VEHICLE_PALETTE[1], "real difference"),
        ):
            if chosen.any():
                axes.plot(
                    values["differences"][chosen],
                    rows[chosen],
                    marker,
                    color=colour,
                    markersize=6,
                    label=label,
                )
        axes.margins(x=0.05)
        axes.set_yticks(rows, labels)
        axes.set_ylim(len(labels) - 0.4, -0.6)
        axes.grid(False, axis="y")
        axes.set_xlabel(difference_label)
        figure.legend(loc="outside upper right", ncols=3)
        return png(figure)


def design_ranges(
    variables: Sequence[str],
    ranges: Mapping[str, npt.ArrayLike],
    bounds: npt.ArrayLike,
    *,
    value_label: str,
) -> bytes:
    """Draw which values of each variable the designs of every front have.

    Parameters
    ----------
    variables : sequence of str
        Top to bottom.
    ranges : mapping of str to array, shape (n_variables, 3)
        Configuration → smallest, median and largest value [unit of the label].
    bounds : array, shape (n_variables, 2)
        Of the search [unit of the label].
    value_label : str
        Axis label with unit.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Nothing to draw, arrays that do not fit the variables, values that are not finite.
    """
    if not ranges:
        raise InputError("figure design_ranges: there is no front to draw")
    named = {"variables": np.zeros(len(variables)), "bounds": bounds, **ranges}
    checked = finite("design_ranges", named)
    pitch = _BAR / len(ranges)
    height = 0.9 + len(variables) * max(0.24, 0.11 * len(ranges) + 0.08)
    with styled_figure(FULL_WIDTH, height) as figure:
        axes = figure.add_subplot()
        rows = np.arange(len(variables))
        low, high = checked["bounds"].T
        axes.barh(rows, high - low, _BAR + 0.1, low, color=TRACK, alpha=0.5)
        for place, name in enumerate(ranges):
            colour = VEHICLE_PALETTE[place % len(VEHICLE_PALETTE)]
            at = rows - _BAR / 2 + pitch * (place + 0.5)
            first, middle, last = checked[name].T
            axes.hlines(at, first, last, color=colour, linewidth=2.2, alpha=0.55)
            axes.plot(
                middle,
                at,
                linestyle="none",
                marker=_MARKERS[place % len(_MARKERS)],
                markersize=4.0,
                color=colour,
                label=name,
            )
        axes.set_yticks(rows, variables)
        axes.set_ylim(len(variables) - 0.4, -0.6)
        axes.grid(False, axis="y")
        axes.set_xlabel(value_label)
        figure.legend(loc="outside upper right", ncols=3)
        return png(figure)
