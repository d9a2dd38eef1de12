"""Pareto fronts: one, several beside each other, and several under one judge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.plot.style import (
    ACCENT,
    FULL_WIDTH,
    HALF_WIDTH,
    INK,
    MUTED,
    TRACK,
    VEHICLE_PALETTE,
    canvas,
    figure_of,
    finite,
    freeze_layout,
    mount_colours,
    place_labels,
    place_legend,
    styled_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PICK_MARKERS = ("o", "D", "^", "s", "P", "v")
_FRONT_COLOUR = "#4C86B0"
_ERROR_COLOUR = "#C3D7E6"


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
    beside: Pairs | None = None,
    width: float = FULL_WIDTH,
    ax: Axes | None = None,
) -> Axes:
    """Draw the two objectives of the front, both minimised, with baseline and named picks.

    Parameters
    ----------
    mean, sigma : array, shape (n_front,)
        Objectives [unit in the label].
    mean_error, sigma_error : array, shape (n_front,)
        Standard errors of the objectives, drawn as bars of ± one error [unit of the label].
    baseline : (float, float) or None
        Mean and sigma of the nominal design [units of the labels]; None where it has none.
    picks : mapping of str to (float, float)
        Mean and sigma of each named design [units of the labels].
    mean_label, sigma_label : str
        Axis labels with units.
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
    finite("pareto_front", {"baseline": today})
    finite("pareto_front", picks)
    chosen = _by_place(picks)
    order = np.argsort(front["mean"], kind="stable")
    points = np.column_stack([front["mean"], front["sigma"]])[order]
    with canvas(ax, width, min(4.0, 0.85 * width)) as axes:
        for name, (x, y) in (beside or {}).items():
            pair = finite("pareto_front", {f"{name} x": x, f"{name} y": y})
            axes.plot(*pair.values(), color=MUTED, linewidth=1.2, label=name)
        axes.errorbar(
            points[:, 0],
            points[:, 1],
            xerr=front["mean_error"][order],
            yerr=front["sigma_error"][order],
            fmt="o",
            markersize=3.6,
            color=_FRONT_COLOUR,
            ecolor=_ERROR_COLOUR,
            elinewidth=0.8,
            label="Pareto front, ± standard error",
        )
        for place in today:
            axes.plot(*place, "X", color=INK, markersize=8, zorder=4)
        for number, position in enumerate(chosen):
            axes.plot(
                *position,
                marker=_PICK_MARKERS[number % len(_PICK_MARKERS)],
                color=VEHICLE_PALETTE[1],
                markeredgecolor="white",
                markersize=8.5,
                zorder=5,
            )
        axes.margins(0.08)
        axes.set_xlabel(f"← better    {mean_label}")
        axes.set_ylabel(f"← better    {sigma_label}")
        axes.ticklabel_format(useOffset=False, style="plain")
        place_legend(axes, ax, loc="outside upper right")
        freeze_layout(figure_of(axes))
        place_labels(
            axes,
            np.array([*today, *chosen]),
            ["baseline"] * len(today) + list(chosen.values()),
            [INK] * len(today) + [VEHICLE_PALETTE[1]] * len(chosen),
            obstacles=points,
            size=9.0,
        )
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
    ax: Axes | None = None,
) -> Axes:
    """Draw several fronts of two objectives, with clouds of designs and single designs.

    - `curves`: label → both objectives of a front, drawn as points on a step line.
    - `points`: label → both objectives of many designs, drawn small and below.
    - `marks`: label → both objectives of one design.
    - `mean_label`, `sigma_label`: axis labels with units.
    - raises InputError: nothing to draw, arrays of different lengths or values that are not finite.
    """
    if not curves:
        raise InputError("figure fronts: there is no front to draw")
    with canvas(ax, FULL_WIDTH, 3.4) as axes:
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
        for name, place_of in marks.items():
            axes.plot(*place_of, "X", color=INK, markersize=8.0, linestyle="none", label=name)
        axes.set_xlabel(mean_label)
        axes.set_ylabel(sigma_label)
        place_legend(axes, ax, loc="outside upper right", ncols=2)
        return axes


def part_choices(
    mounts: Sequence[str],
    labels: Sequence[Sequence[str]],
    chosen: npt.ArrayLike,
    *,
    point_label: str,
) -> Figure:
    """Draw which part every design of a front has at each mount.

    - `mounts`: one per row of panels.
    - `labels`: names of the parts of each mount.
    - `chosen` (n_design, n_mount): number of the part, in the order of the front.
    - `point_label`: label of the common axis.
    - raises InputError: a part number without a label, or not one column per mount.
    """
    from matplotlib.ticker import MaxNLocator

    numbers = np.asarray(chosen, dtype=int)
    if numbers.ndim != 2 or numbers.shape[1] != len(mounts) or len(labels) != len(mounts):
        raise InputError("figure part_choices: give one column of part numbers per mount")
    for column, names in zip(numbers.T, labels, strict=True):
        if column.size == 0 or column.min() < 0 or column.max() >= len(names):
            raise InputError("figure part_choices: a part number has no label")
    heights = [len(names) for names in labels]
    with styled_figure(FULL_WIDTH, 0.8 + 0.17 * sum(heights) + 0.2 * len(mounts)) as figure:
        panels = figure.subplots(
            len(mounts), 1, squeeze=False, sharex=True, height_ratios=heights
        ).ravel()
        points = np.arange(1, len(numbers) + 1)
        for axes, mount, names, column, colour in zip(
            panels, mounts, labels, numbers.T, mount_colours(mounts).values(), strict=True
        ):
            axes.plot(points, column, "s", color=colour, markersize=3.5)
            axes.set_yticks(range(len(names)), names)
            axes.set_ylim(len(names) - 0.4, -0.6)
            axes.set_title(mount, loc="left", fontweight="bold")
        panels[-1].set_xlabel(point_label)
        panels[-1].xaxis.set_major_locator(MaxNLocator(8, integer=True))
        return figure


_LINES = 300
"""Designs beyond which lines and clouds are thinned, evenly."""


def parallel_coordinates(
    names: Sequence[str],
    designs: npt.ArrayLike,
    bounds: npt.ArrayLike,
    value: npt.ArrayLike,
    marks: Mapping[str, npt.ArrayLike],
    *,
    value_label: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw every design as a line over its variables, coloured by a response.

    - `names`: of the k variables.
    - `designs` (n, k), `bounds` (2, k): lower, then upper ones [units of the variables].
    - `value` (n,): of each design [unit of the label].
    - `marks` (k,): single designs by name, drawn above all others.
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
                *(places, share),
                color=INK if number else MUTED,
                linewidth=1.5,
                marker=_PICK_MARKERS[number % len(_PICK_MARKERS)],
                markersize=5,
                label=name,
            )
        axes.set_xticks(places, names, rotation=35, ha="right", rotation_mode="anchor")
        axes.set_ylabel("from lower to upper bound [%]")
        figure_of(axes).colorbar(colour, ax=axes, label=value_label, pad=0.02)
        place_legend(axes, ax, loc="outside upper left", ncols=len(marks))
        return axes


_MARKERS = ("o", "s", "D", "^", "v", "P")
_BAR = 0.7
_MARKS = 40
"""Marks on a front that has more points."""


@dataclass(frozen=True, eq=False)
class AttainedFront:
    """What the runs of one configuration attain, two objectives.

    - `median` (n, 2): what half of the runs attain; of a single run its front.
    - `best`, `worst` (n, 2), optional: what at least one run, and what every run attains: the edges
      of the band.
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
    ax: Axes | None = None,
) -> Axes:
    """Draw fronts of two objectives as steps, with bands from the best to the worst seed.

    - `fronts`: by configuration.
    - `reference_point`: of the hypervolume, marked with a cross [units of the labels].
    - `mean_label`, `sigma_label`: axis labels with units.
    - raises InputError: nothing to draw, or values that are not finite.
    """
    if not fronts:
        raise InputError("figure attained_fronts: there is no front to draw")
    corner = finite("attained_fronts", {"reference point": reference_point})["reference point"]
    with canvas(ax, FULL_WIDTH, 4.0) as axes:
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
        place_legend(axes, ax, loc="outside upper right", ncols=3, markerscale=1.6)
        return axes


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
    ax: Axes | None = None,
) -> Axes:
    """Draw each difference beside the band that chance alone may fill.

    - `labels`: pairs that were compared, top to bottom.
    - `differences`, `noise` (n_pairs,): differences, and the largest that is still chance; NaN
      noise draws no band [unit of the label].
    - `difference_label`: axis label with unit.
    - raises InputError: arrays that do not fit the labels, differences that are not finite.
    """
    values = finite("noise_bars", {"labels": np.zeros(len(labels)), "differences": differences})
    reach = np.asarray(noise, dtype=float)
    if reach.shape != values["differences"].shape:
        raise InputError("figure noise_bars: give one noise per difference")
    with canvas(ax, FULL_WIDTH, 1.15 + 0.3 * len(labels)) as axes:
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
        place_legend(axes, ax, loc="outside upper right", ncols=3)
        return axes


def design_ranges(
    variables: Sequence[str],
    ranges: Mapping[str, npt.ArrayLike],
    bounds: npt.ArrayLike,
    *,
    value_label: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw which values of each variable the designs of every front have.

    - `variables`: top to bottom.
    - `ranges` (n_variables, 3): configuration → smallest, median and largest value [unit of the
      label].
    - `bounds` (n_variables, 2): of the search [unit of the label].
    - `value_label`: axis label with unit.
    - raises InputError: nothing to draw, arrays that do not fit the variables, values that are not
      finite.
    """
    if not ranges:
        raise InputError("figure design_ranges: there is no front to draw")
    named = {"variables": np.zeros(len(variables)), "bounds": bounds, **ranges}
    checked = finite("design_ranges", named)
    pitch = _BAR / len(ranges)
    height = 0.9 + len(variables) * max(0.24, 0.11 * len(ranges) + 0.08)
    with canvas(ax, FULL_WIDTH, height) as axes:
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
        place_legend(axes, ax, loc="outside upper right", ncols=3)
        return axes


def convergence(
    generation: npt.ArrayLike,
    hypervolume: npt.ArrayLike,
    *,
    hypervolume_label: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw the hypervolume over the generations of one search.

    - `generation` (n,): number of each generation [1].
    - `hypervolume` (n,): of the front found so far [unit in the label].
    - `hypervolume_label`: axis label with unit.
    - raises InputError: arrays of different lengths or values that are not finite.
    """
    from matplotlib.ticker import MaxNLocator

    curve = finite("convergence", {"generation": generation, "hypervolume": hypervolume})
    with canvas(ax, HALF_WIDTH, 2.5) as axes:
        axes.plot(curve["generation"], curve["hypervolume"], color=ACCENT, linewidth=1.5)
        axes.plot(curve["generation"][-1], curve["hypervolume"][-1], "o", color=ACCENT)
        axes.set_xlabel("generation [1]")
        axes.set_ylabel(hypervolume_label)
        axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
        axes.margins(x=0.03)
        return axes
