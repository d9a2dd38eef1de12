"""What a largest box is compared with, and boxes at several limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, RealArray
from deboom.errors import InputError
from deboom.explore.seeds import checked_seed
from deboom.explore.solution_box import Box, BoxQuestion, checked_point
from deboom.explore.solution_box_reach import UnreachableLimit
from deboom.explore.solution_box_search import BoxEffort, FoundBox, largest_box
from deboom.explore.solution_box_share import box_sample


def tolerance_box(names: Sequence[str], design: RealArray, tolerance: float) -> Box:
    """Return the box of one tolerance about a design.

    Parameters
    ----------
    names : sequence of str
    design : array, shape (k,)
    tolerance : float
        Half width as a part of each variable's own value, 0 or more [1].
    """
    half = tolerance * np.abs(design)
    return Box(tuple(names), design - half, design + half)


def kept_offset(question: BoxQuestion, box: Box, *, seed: int, n_parts: int = 65536) -> float:
    """Return what the limits have to be raised by for a box to keep just the share.

    Parameters
    ----------
    question : BoxQuestion
    box : Box
    seed : int
        From 1 upwards.
    n_parts : int
        A power of two.

    Returns
    -------
    float
        Below 0 if they may be lowered: quantile of the excess, pooled over parts and responses or,
        with ``question.together``, of the largest of each part [response_unit].

    Raises
    ------
    InputError
        A quantile that is not finite: too many parts could not be computed.
    """
    unit = box_sample(len(question.names), n_parts, seed=checked_seed(seed), purpose="kept limit")
    excess = question.excess(question.parts(box, unit))
    pooled = excess.max(axis=1) if question.together else excess.ravel()
    found = float(np.quantile(pooled, question.share, method="higher"))
    if not np.isfinite(found):
        raise InputError("too many parts of the box could not be computed: no limit is kept")
    return found


@dataclass(frozen=True, eq=False)
class BisectionBox:
    """The largest box of one tolerance for all variables, about a design.

    Parameters
    ----------
    box : Box
        Cut at the bounds.
    tolerance : float
        Half width as a part of each variable's own value; 0 if none is kept [1].
    share : float
        Of the sample that settled it [1].
    """

    box: Box
    tolerance: float
    share: float


def bisection_box(
    question: BoxQuestion, design: npt.ArrayLike, *, seed: int, effort: BoxEffort | None = None
) -> BisectionBox:
    """Return the box of one tolerance about a design that plain bisection finds.

    Parameters
    ----------
    question : BoxQuestion
    design : array, shape (k,)
    seed : int
        From 1 upwards.
    effort : BoxEffort, optional
        Its calibration is the sample.
    """
    effort = effort or BoxEffort()
    point = checked_point(question, design)
    size = effort.calibration
    unit = box_sample(len(point), size, seed=checked_seed(seed), purpose="size of a box")

    def cut(tolerance: float) -> Box:
        whole = tolerance_box(question.names, point, tolerance)
        return Box(
            question.names,
            np.maximum(whole.lower, question.lower),
            np.minimum(whole.upper, question.upper),
        )

    good, share = 0.0, question.share_of(cut(0.0), unit[:1])
    bad = 1.0
    for _ in range(14):
        middle = 0.5 * (good + bad)
        kept = question.share_of(cut(middle), unit)
        if kept >= question.share:
            good, share = middle, kept
        else:
            bad = middle
    return BisectionBox(cut(good), good, share)


@dataclass(frozen=True)
class VolumeRatio:
    """One box over another.

    Parameters
    ----------
    volume : float
        Ratio of the products of the widths [1].
    width : float
        Geometric mean of the ratios of the widths [1].
    n_variables : int
        That were counted.
    """

    volume: float
    width: float
    n_variables: int


def volume_ratio(box: Box, other: Box, counted: BoolArray) -> VolumeRatio:
    """Compare two boxes over the variables that count; infinite where the other has no volume.

    Parameters
    ----------
    box, other : Box
        Of the same variables.
    counted : array of bool, shape (k,)
        Such as those with an effect on a response.
    """
    if np.any(other.width[counted] <= 0.0):
        return VolumeRatio(float("inf"), float("inf"), int(counted.sum()))
    ratio = np.log(box.width[counted]) - np.log(other.width[counted])
    return VolumeRatio(float(np.exp(ratio.sum())), float(np.exp(ratio.mean())), int(counted.sum()))


def trade_off(
    question: BoxQuestion,
    steps: Sequence[float],
    *,
    seed: int,
    points: Sequence[npt.ArrayLike] = (),
    effort: BoxEffort | None = None,
    workers: int = 1,
) -> tuple[FoundBox | UnreachableLimit, ...]:
    """Find the largest box at several limits, each starting from that of the one before too.

    Parameters
    ----------
    question : BoxQuestion
    steps : sequence of float
        What all limits are lowered by [response_unit].
    seed, points, effort, workers
        As for `deboom.explore.solution_box_search.largest_box`.

    Returns
    -------
    tuple
        In the order of the steps; what cannot be reached is in it as the error that says why.
    """
    found: dict[float, FoundBox | UnreachableLimit] = {}
    before: tuple[Box, ...] = ()
    for step in sorted(steps):
        try:
            one = largest_box(
                question.lowered(step),
                seed=seed,
                points=points,
                boxes=before,
                effort=effort,
                workers=workers,
            )
            found[step], before = one, (one.box,)
        except UnreachableLimit as error:
            found[step] = error
    return tuple(found[step] for step in steps)
