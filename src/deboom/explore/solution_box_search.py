"""The search for the largest box: several starts, a smoothed share, then the share itself."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.seeds import checked_seed
from deboom.explore.solution_box import Box, BoxQuestion
from deboom.explore.solution_box_reach import (
    box_around,
    largest_size,
    ranked_excess,
    reachable_designs,
)
from deboom.explore.solution_box_share import (
    CONFIDENCE,
    VERIFICATION,
    VerifiedShare,
    bernstein_gap,
    box_sample,
    smooth_share,
    typical_spread,
    verified_share,
)

NARROWEST = 1e-3
"""Least width of an interval, as a part of its bounds, that counts as one [1]."""
SMALLEST_GAIN = 1e-6
"""Steps end when the logarithm of the volume gains less [1]."""
ON_BOUND = 1e-9
"""An end this close to its bound, as a part of the bounds' distance, lies on it [1]."""
OUTSIDE = 0.6
"""Part of the share in the first box of the start that comes from outside [1]."""
LEAST_SIZED = 4096
"""Parts on which the boxes of different starts and stages are made comparable, at least."""
QUIETER = 0.5
"""Standard error of a share over scrambled Sobol points, in those of random points [1]."""
RESERVE = 2.0
"""Standard errors of both samples by which the search aims above what the bound needs [1]."""

Progress = Callable[[int, int, str], None]
"""Called after each stage with its number, the number of stages, and a line of text."""


@dataclass(frozen=True)
class BoxEffort:
    """How hard a box is searched for.

    Parameters
    ----------
    starts : int
        Descents from designs that lie apart, beside the given ones and the whole bounds.
    coarse : tuple of (softness, parts)
        Stages of every start: softness of the share in standard deviations of the responses, and a
        power of two of parts.
    fine : tuple of (softness, parts)
        Stages of the best start.
    steps : int
        Of each stage at most.
    calibration : int
        Parts on which the size of the box is settled; a power of two.
    verification : int
        Independent parts of the verification.
    confidence : float
        Of its one-sided bound [1].
    """

    starts: int = 2
    coarse: tuple[tuple[float, int], ...] = ((0.5, 256), (0.2, 512))
    fine: tuple[tuple[float, int], ...] = ((0.15, 2048), (0.1, 2048))
    steps: int = 60
    calibration: int = 65536
    verification: int = VERIFICATION
    confidence: float = CONFIDENCE


@dataclass(frozen=True, eq=False)
class FoundBox:
    """The largest box, with what shows that it is one.

    Parameters
    ----------
    question : BoxQuestion
    box : Box
    verified : VerifiedShare
        Of independent parts that the search has not seen.
    calibrated : float
        Share of the parts that settled the size of the box [1].
    room : float
        What the limits could be lowered by at most, before no design keeps them [response_unit].
    start_log_volumes : array, shape (n_starts,)
        Logarithm of the weighted volume that each start reached in the coarse stages.
    seconds : float
        Of search and verification.
    """

    question: BoxQuestion
    box: Box
    verified: VerifiedShare
    calibrated: float
    room: float
    start_log_volumes: RealArray
    seconds: float

    @property
    def confirmed(self) -> bool:
        """Whether the bound on the verified share reaches the stated one."""
        return self.verified.bound >= self.question.share


def largest_box(
    question: BoxQuestion,
    *,
    seed: int,
    points: Sequence[npt.ArrayLike] = (),
    boxes: Sequence[Box] = (),
    effort: BoxEffort | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> FoundBox:
    """Find and verify the largest box that keeps a limit.

    Parameters
    ----------
    question : BoxQuestion
    seed : int
        From 1 upwards. Same seed, same box, whatever the number of workers.
    points : sequence of array, shape (k,)
        Designs to start from as well, such as one of a Pareto front.
    boxes : sequence of Box
        To start from as well, such as the box at a neighbouring limit.
    effort : BoxEffort, optional
    workers : int
        Processes that share the starts.
    progress : callable, optional
        See `Progress`.

    Returns
    -------
    FoundBox

    Raises
    ------
    UnreachableLimit
        No design inside the bounds keeps the limit.
    InputError
        A box with no interior: an interval that nobody can make; seed 0.

    Notes
    -----
    The parts of every box are the same scrambled Sobol points, mapped into it. A sequential
    quadratic program (SLSQP) maximises ``Σ weight log(u - l)`` within
    ``log(1 - S) ≤ log(1 - share)`` for the smoothed share S, with the model's exact gradients, from
    boxes around reachable designs, one of them too large. The softness falls from stage to stage.
    The smoothing and the few points bias S a little; what a larger sample counts instead corrects
    the target of the last stage. At the end the ends that are not bounds are moved together until
    the larger sample keeps the stated share plus the reserve that the verification's bound needs.
    """
    checked_seed(seed)
    effort = effort or BoxEffort()
    started = time.perf_counter()
    n_variables = len(question.names)
    designs = reachable_designs(question, seed=seed, count=effort.starts, points=points)
    sample = box_sample(n_variables, effort.calibration, seed=seed, purpose="size of a box")
    search = box_sample(n_variables, _most_parts(effort), seed=seed, purpose="search of a box")
    few = search[: effort.coarse[0][1]]
    sizes = [(x, question.share) for x in designs] + [(designs[0], OUTSIDE * question.share)]
    begins = [box_around(question, x, largest_size(question, x, few, least)) for x, least in sizes]
    tasks = [_Coarse(question, effort, search, sample, begin) for begin in (*begins, *boxes)]
    ends = _all(tasks, workers)
    _tell(progress, 1, f"{len(ends)} starts")
    volumes = np.array([volume for _, volume in ends])
    if np.isneginf(volumes.max()):
        raise InputError(
            "no start has led to a box that keeps the share: raise the limit, lower the share or "
            "give a design about which parts keep it"
        )
    best = ends[int(np.argmax(volumes))][0]
    best = _fine(question, effort, search, sample, best)
    _tell(progress, 2, "fine stages")
    wanted = _wanted(question, effort, best, sample)
    box, calibrated = _calibrated(question, best, sample, wanted, halvings=11)
    _refuse_flat(question, box)
    _tell(progress, 3, "size settled")
    verified = verified_share(
        question, box, seed=seed, n_parts=effort.verification, confidence=effort.confidence
    )
    _tell(progress, 4, "verified")
    seconds = time.perf_counter() - started
    room = -float(ranked_excess(question, question.excess(designs[0][np.newaxis]))[0])
    return FoundBox(question, box, verified, calibrated, room, volumes, seconds)


@dataclass(frozen=True, eq=False)
class _Coarse:
    """The coarse stages of one start; a process can carry it."""

    question: BoxQuestion
    effort: BoxEffort
    search: RealArray
    sample: RealArray
    begin: Box

    def __call__(self) -> tuple[Box, float]:
        """Return the box, sized to the stated share, and its volume; -inf if it has not got it.

        The first box itself stays where the stages lead nowhere, such as at the edge of what could
        be computed, which has no slope.
        """
        box = self.begin
        for softness, n_parts in self.effort.coarse:
            box = _stage(
                self.question,
                box,
                self.search[:n_parts],
                softness,
                self.effort,
                self.question.share,
            )
        found = _sized(self.question, box, self.sample)
        return found if found[1] > -np.inf else _sized(self.question, self.begin, self.sample)


def _all(tasks: Sequence[_Coarse], workers: int) -> list[tuple[Box, float]]:
    if workers < 1:
        raise InputError(f"{workers} workers cannot compute anything: take a whole number from 1")
    if workers == 1:
        return [task() for task in tasks]
    with ProcessPoolExecutor(min(workers, len(tasks)), get_context("spawn")) as pool:
        return list(pool.map(_call, tasks))


def _call(task: _Coarse) -> tuple[Box, float]:
    return task()


def _most_parts(effort: BoxEffort) -> int:
    return max(n_parts for _, n_parts in (*effort.coarse, *effort.fine))


def _tell(progress: Progress | None, number: int, text: str) -> None:
    if progress is not None:
        progress(number, 4, text)


def _fine(
    question: BoxQuestion, effort: BoxEffort, search: RealArray, sample: RealArray, box: Box
) -> Box:
    """Go on from the best start, to the share that the larger sample counts."""
    target = question.share
    found = [_sized(question, box, sample)]
    for softness, n_parts in effort.fine:
        box = _stage(question, box, search[:n_parts], softness, effort, target)
        found.append(_sized(question, box, sample))
        counted = question.share_of(box, sample)
        missed = (1.0 - question.share) / max(1.0 - counted, 1.0 / len(sample))
        target = float(np.clip(1.0 - (1.0 - target) * missed, 0.5 * question.share, 1.0 - 1e-6))
    return max(found, key=lambda one: one[1])[0]


def _sized(question: BoxQuestion, box: Box, sample: RealArray) -> tuple[Box, float]:
    """Return a box, sized to the stated share, and its volume; -inf if it cannot have the share."""
    few = sample[: max(LEAST_SIZED, len(sample) // 16)]
    box, kept = _calibrated(question, box, few, question.share, halvings=7)
    flat = np.any(box.width[question.free] <= 0.0)
    return box, -np.inf if flat or kept < question.share else question.log_volume(box)


def _stage(
    question: BoxQuestion,
    box: Box,
    unit: RealArray,
    softness: float,
    effort: BoxEffort,
    target: float,
) -> Box:
    """Maximise the volume within a smoothed share of at least `target`, from a box.

    The ends are counted in widths of that box, so that all steps are of the order of one.
    """
    spread = softness * typical_spread(question, box, unit)
    span = question.upper - question.lower
    scale = np.where(question.free, np.maximum(box.width, NARROWEST * span), 1.0)
    size = len(span)
    known: dict[bytes, tuple[float, RealArray]] = {}

    def ends_of(place: RealArray) -> RealArray:
        return np.asarray(box.lower + place.reshape(2, size) * scale)

    def missed(place: RealArray) -> tuple[float, RealArray]:
        key = place.tobytes()
        if key not in known:
            known.clear()
            tried = _AnyBox(question.names, *ends_of(place))
            share, gradient = smooth_share(question, tried, unit, spread)
            lost = max(1.0 - share, 1e-12)
            known[key] = (float(np.log(lost)), -(gradient * scale).ravel() / lost)
        return known[key]

    weight = np.where(question.free, question.weight, 0.0)
    weight = weight / weight.sum()

    def negative_volume(place: RealArray) -> float:
        width = place[size:] - place[:size]
        tiny = np.minimum(width, NARROWEST) / NARROWEST - 1.0  # a straight line below NARROWEST
        return float(-weight @ (np.log(np.maximum(width, NARROWEST)) + tiny))

    def volume_slope(place: RealArray) -> RealArray:
        slope = weight / np.maximum(place[size:] - place[:size], NARROWEST)
        return np.concatenate([slope, -slope])

    allowed = float(np.log(1.0 - target))
    low, high = (question.lower - box.lower) / scale, (question.upper - box.lower) / scale
    found = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
        negative_volume,
        np.concatenate([np.zeros(size), box.width / scale]),
        jac=volume_slope,
        method="SLSQP",
        bounds=list(zip(np.tile(low, 2), np.tile(high, 2), strict=True)),
        constraints={
            "type": "ineq",
            "fun": lambda place: allowed - missed(place)[0],
            "jac": lambda place: -missed(place)[1],
        },
        options={"maxiter": effort.steps, "ftol": SMALLEST_GAIN},
    )
    ends = np.clip(np.sort(ends_of(found.x), axis=0), question.lower, question.upper)
    return Box(question.names, *ends)


class _AnyBox(Box):
    """A box of a line search, whose ends may have crossed for a moment."""

    def __post_init__(self) -> None:
        """Check nothing."""


def resized(question: BoxQuestion, box: Box, growth: float) -> Box:
    """Return a box whose ends, where they are no bounds, are moved outwards.

    Parameters
    ----------
    question : BoxQuestion
    box : Box
    growth : float
        By this part of each half width, from -1 upwards; ends stop at the bounds [1].
    """
    near = ON_BOUND * (question.upper - question.lower)
    step = 0.5 * growth * box.width
    lower = np.where(box.lower - question.lower > near, box.lower - step, question.lower)
    upper = np.where(question.upper - box.upper > near, box.upper + step, question.upper)
    return replace(
        box, lower=np.maximum(lower, question.lower), upper=np.minimum(upper, question.upper)
    )


def _calibrated(
    question: BoxQuestion, box: Box, sample: RealArray, wanted: float, halvings: int
) -> tuple[Box, float]:
    """Return the box, resized to keep the wanted share of a sample, and the share it keeps."""
    good, bad = -1.0, None
    kept = question.share_of(box, sample)
    step = 0.02
    if kept >= wanted:
        good, best = 0.0, kept
        while bad is None and good < 16.0:
            share = question.share_of(resized(question, box, good + step), sample)
            if share >= wanted:
                good, best, step = good + step, share, 2.0 * step
            else:
                bad = good + step
    else:
        bad, best = 0.0, 0.0
        while bad > -0.999:
            tried = max(bad - step, -0.999)
            share = question.share_of(resized(question, box, tried), sample)
            if share >= wanted:
                good, best = tried, share
                break
            bad, step = tried, 2.0 * step
    if bad is None:
        return resized(question, box, good), best
    for _ in range(halvings):
        middle = 0.5 * (good + bad)
        share = question.share_of(resized(question, box, middle), sample)
        if share >= wanted:
            good, best = middle, share
        else:
            bad = middle
    return resized(question, box, good), best


def _wanted(question: BoxQuestion, effort: BoxEffort, box: Box, sample: RealArray) -> float:
    """Return the share that the larger sample must keep for the bound to reach the stated one."""
    shares = question.part_shares(question.excess(question.parts(box, sample)))
    variance = float(shares.var(ddof=1))
    sobol = QUIETER**2 * variance / effort.calibration
    both = np.sqrt(variance / effort.verification + sobol)
    gap = bernstein_gap(variance, effort.verification, effort.confidence)
    return float(min(question.share + gap + RESERVE * both, 1.0 - 1e-9))


def _refuse_flat(question: BoxQuestion, box: Box) -> None:
    """Refuse a box with an interval that is none."""
    span = np.where(question.free, question.upper - question.lower, 1.0)
    part = np.where(question.free, box.width / span, np.inf)
    column = int(np.argmin(part))
    if part[column] < NARROWEST:
        raise InputError(
            f"the largest box has no interior: '{question.names[column]}' would have to lie "
            f"between {box.lower[column]:.6g} and {box.upper[column]:.6g}; raise the limit, lower "
            "the share or widen the bounds"
        )
