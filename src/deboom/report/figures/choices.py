"""Fronts beside each other, and which part each of their designs has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.report.figures.canvas import finite, png, styled_figure
from deboom.report.style import FULL_WIDTH, INK, MUTED, VEHICLE_PALETTE

Pairs = Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]]


def fronts(
    curves: Pairs,
    points: Pairs,
    marks: Mapping[str, tuple[float, float]],
    *,
    mean_label: str,
    sigma_label: str,
) -> bytes:
    """Draw several fronts of two objectives, with clouds of designs and single designs.

    Parameters
    ----------
    curves : mapping of str to (array, array)
        Label → both objectives of a front, drawn as points on a step line.
    points : mapping of str to (array, array)
        Label → both objectives of many designs, drawn small and below.
    marks : mapping of str to (float, float)
        Label → both objectives of one design.
    mean_label, sigma_label : str
        Axis labels with units.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        Nothing to draw, arrays of different lengths or values that are not finite.
    """
    if not curves:
        raise InputError("figure fronts: there is no front to draw")
    with styled_figure(FULL_WIDTH, 3.4) as figure:
        axes = figure.add_subplot()
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
        figure.legend(loc="outside upper right", ncols=2)
        return png(figure)


def part_choices(
    mounts: Sequence[str],
    labels: Sequence[Sequence[str]],
    chosen: npt.ArrayLike,
    *,
    point_label: str,
) -> bytes:
    """Draw which part every design of a front has at each mount.

    Parameters
    ----------
    mounts : sequence of str
        One per row of panels.
    labels : sequence of sequence of str
        Names of the parts of each mount.
    chosen : array of int, shape (n_design, n_mount)
        Number of the part, in the order of the front.
    point_label : str
        Label of the common axis.

    Returns
    -------
    bytes
        PNG.

    Raises
    ------
    InputError
        A part number without a label, or not one column per mount.
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
            panels, mounts, labels, numbers.T, _colours(len(mounts)), strict=True
        ):
            axes.plot(points, column, "s", color=colour, markersize=3.5)
            axes.set_yticks(range(len(names)), names)
            axes.set_ylim(len(names) - 0.4, -0.6)
            axes.set_title(mount, loc="left", fontweight="bold")
        panels[-1].set_xlabel(point_label)
        panels[-1].xaxis.set_major_locator(MaxNLocator(8, integer=True))
        return png(figure)


def _colours(count: int) -> list[str]:
    return [VEHICLE_PALETTE[place % len(VEHICLE_PALETTE)] for place in range(count)]
