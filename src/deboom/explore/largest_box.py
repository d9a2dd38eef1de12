"""The largest box in which a stated share of the parts keeps a limit, and what it is compared with.

The problem is that of M. Zimmermann and J. E. von Hoessle, "Computing solution spaces for robust
design", Int. J. Numer. Meth. Engng 94, 2013.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.box import (
    VERIFICATION,
    Box,
    BoxQuestion,
    VerifiedShare,
    bernstein_gap,
    smooth_share,
    verified_share,
)
from deboom.explore.moments import CONFIDENCE
from deboom.explore.space import checked_seed, sobol_points
from deboom.explore.workers import process_pool
from deboom.progress import Progress
from deboom.tabled import Tabled

_TRIED = 1024  # designs over the bounds that are tried first
_STEPS = 60  # of each descent towards the limit, and of each stage of a box
_NARROWEST = 1e-3  # width of an interval, as a part of its bounds, that counts as one
_SMALLEST_GAIN = 1e-6  # of the logarithm of the volume, at which a stage ends
_ON_BOUND = 1e-9  # distance, as a part of the bounds' distance, at which an end lies on its bound
_OUTSIDE = 0.6  # part of the share in the first box of the start that comes from outside
_LEAST_SIZED = 4096  # parts on which boxes of different starts and stages are compared, at least
_QUIETER = 0.5  # standard error of a share over scrambled Sobol points, in those of random ones
_RESERVE = 2.0  # standard errors by which the search aims above what the bound needs


@dataclass(frozen=True)
class BoxEffort:
    """How hard a box is searched for.

    - `starts`: descents from designs that lie apart, beside those from the given designs.
    - `coarse`, `fine`: stages of every start, and of the best one: softness of the share in
      standard deviations of the responses, and a power of two of parts.
    - `calibration`, `verification`: parts that settle the size of the box, a power of two, and
      independent parts that verify it.
    """

    starts: int = 2
    coarse: tuple[tuple[float, int], ...] = ((0.5, 256), (0.2, 512))
    fine: tuple[tuple[float, int], ...] = ((0.15, 2048), (0.1, 2048))
    calibration: int = 65536
    verification: int = VERIFICATION


@dataclass(frozen=True, eq=False)
class LargestBox(Tabled):
    """The largest box, with what shows that it is one.

    - `question`: question that was asked.
    - `box`: intervals.
    - `verified`: share of independent parts that the search has not seen.
    - `calibrated`: share of the parts that settled the size of the box [1].
    - `room`: step by which limits can fall until no design keeps enough of them [response_unit].
    - `start_log_volumes` (n_starts,): logarithm of the weighted volume that each start reached in
      the coarse stages.
    - `seconds`: time of search and verification [s].

    See Also
    --------
    deboom.largest_box, deboom.BoxQuestion, deboom.read_solution_box
    """

    question: BoxQuestion
    box: Box
    verified: VerifiedShare
    calibrated: float
    room: float
    start_log_volumes: RealArray
    seconds: float

    @property
    def table(self) -> pd.DataFrame:
        """Interval of each variable [its unit]."""
        return pd.DataFrame(
            {"variable": self.box.names, "from": self.box.lower, "to": self.box.upper}
        )

    @property
    def confirmed(self) -> bool:
        """Whether the bound on the verified share reaches the stated one."""
        return self.verified.bound >= self.question.share


class NoBoxFound(InputError):
    """No box with an interior keeps the share."""


class UnreachableLimit(NoBoxFound):
    """No design inside the bounds keeps the limit in as many responses as the share asks for.

    Its sentence names the response that binds at the closest ``design``, shape (k,).
    """

    def __init__(self, question: BoxQuestion, design: RealArray) -> None:
        excess = question.excess(design[np.newaxis])[0]
        column = int(np.argsort(excess, kind="stable")[question.least_kept - 1])
        unit, names = question.response.response_unit, question.response.response_names
        missed, limit = float(excess[column]), question.limit[column]
        super().__init__(
            f"no design inside the bounds keeps the limit in {question.least_kept} of "
            f"{len(names)} responses: the closest one misses it by {missed:.3g} {unit} in "
            f"'{names[column]}', which binds ({limit + missed:.4g} against {limit:.4g} {unit}): "
            "raise the limit or widen the bounds"
        )
        self.missed, self.binding = missed, names[column]


def largest_box(
    question: BoxQuestion,
    *,
    seed: int,
    points: Sequence[npt.ArrayLike] = (),
    effort: BoxEffort | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> LargestBox:
    """Find and verify the largest box that keeps a limit.

    Parameters
    ----------
    question : BoxQuestion
        Response, limits, share that must keep them, and bounds.
    seed : int
        Seed from 1 upwards. Same seed, same box, whatever the number of workers.
    points : sequence of array, shape (k,)
        Designs to start from as well, such as those of a front.
    effort : BoxEffort, optional
        How hard it is searched for.
    workers, progress : int, callable, optional
        Processes that share the starts, and what is called after each stage.

    Returns
    -------
    LargestBox
        ``box.lower`` and ``box.upper``, shape (k,) [units of the variables]; ``verified``, the
        share of independent parts that keep their limits; ``table``.

    Raises
    ------
    InputError
        `UnreachableLimit`; `NoBoxFound`, no start keeps the share or the box has no interior; seed
        or workers 0.

    See Also
    --------
    deboom.BoxQuestion, deboom.explore.largest_box.LargestBox, deboom.read_solution_box
    deboom.allocate_tolerances

    Notes
    -----
    The parts of every box are the same scrambled Sobol points, mapped into it. A sequential
    quadratic program (SLSQP) maximises ``Σ weight log(u - l)`` within
    ``log(1 - S) ≤ log(1 - share)`` for the smoothed share S, with the model's exact gradients, from
    boxes around reachable designs, one of them too large. The softness falls from stage to stage;
    what a larger sample counts corrects the target of the last one. At the end the ends that are
    not bounds are moved together until the larger sample keeps the stated share plus the reserve
    that the verification's bound needs.

    Examples
    --------
    >>> import deboom, numpy as np
    >>> from deboom.explore.largest_box import BoxEffort
    >>> model = deboom.read_platform("u06").model(vehicles="U06-1", motion="prescribed")
    >>> space = model.design_space(bounds=0.3)
    >>> limit = model(np.ones((1, 12)))[0] - 1.0 * model.n_lines
    >>> question = deboom.BoxQuestion(model, limit, 0.9, space.lower, space.upper)
    >>> quick = BoxEffort(starts=1, calibration=4096, verification=4096)
    >>> solution = deboom.largest_box(question, seed=1, effort=quick)
    >>> upper = solution.table.set_index("variable")["to"]
    >>> round(float(upper["TSM x"]), 1)  # × today's stiffness
    0.9
    """
    checked_seed(seed)
    if workers < 1:
        raise InputError(f"{workers} workers cannot compute anything: take a whole number from 1")
    effort, say = effort or BoxEffort(), progress or (lambda *_: None)
    began = time.perf_counter()
    size = question.n_draws
    most = max(n_parts for _, n_parts in (*effort.coarse, *effort.fine))
    designs = reachable_designs(question, seed=seed, count=effort.starts, points=points)
    sample = sobol_points(size, effort.calibration, seed=seed, purpose="size of a box")
    search = sobol_points(size, most, seed=seed, purpose="search of a box")
    few = search[: effort.coarse[0][1]]
    shares = [(x, question.share) for x in designs] + [(designs[0], _OUTSIDE * question.share)]
    begins = [_box_around(question, x, _largest_size(question, x, few, part)) for x, part in shares]
    coarse = partial(_coarse, question, effort, search, sample)
    if workers == 1:
        with threadpool_limits(1, "blas"):  # as in other processes: the same bits
            ends = [coarse(begin) for begin in begins]
    else:
        with process_pool(min(workers, len(begins))) as pool:
            ends = list(pool.map(coarse, begins))
    say(1, 4, f"{len(ends)} starts")
    volumes = np.array([volume for _, volume in ends])
    if np.isneginf(volumes.max()):
        raise NoBoxFound(
            "no start has led to a box that keeps the share: raise the limit, lower the share or "
            "give a design about which parts keep it"
        )
    best = _fine(question, effort, search, sample, ends[int(np.argmax(volumes))][0])
    say(2, 4, "fine stages")
    wanted = _wanted(question, effort, best, sample)
    box, calibrated = _calibrated(question, best, sample, wanted, halvings=11)
    _refuse_flat(question, box)
    say(3, 4, "size settled")
    verified = verified_share(question, box, seed=seed, n_parts=effort.verification)
    say(4, 4, "verified")
    room = -float(_ranked_excess(question, designs[0][np.newaxis])[0])
    return LargestBox(
        question, box, verified, calibrated, room, volumes, time.perf_counter() - began
    )


def reachable_designs(
    question: BoxQuestion, *, seed: int, count: int, points: Sequence[npt.ArrayLike] = ()
) -> tuple[RealArray, ...]:
    """Return designs around which a box has room, each of shape (k,), the roomiest first.

    ``count`` descents towards the limit start at designs that lie apart, and one at each of
    ``points``.

    - raises UnreachableLimit: there is none.

    Each descent minimises the largest excess of the responses that the start keeps best, by
    sequential quadratic programming (SLSQP) with the model's gradient.
    """
    given = [question.checked(point) for point in points]
    unit = sobol_points(len(question.names), _TRIED, seed=seed, purpose="designs below a limit")
    tried = np.vstack([*given, question.bounds.at(unit)])
    worst = _ranked_excess(question, tried)
    starts = _apart(question, tried, worst, count, len(given))
    ends = np.array([_descend(question, tried[row]) for row in starts])
    reached = _ranked_excess(question, ends)
    order = np.argsort(reached, kind="stable")
    if not reached[order[0]] < 0.0:
        raise UnreachableLimit(question, ends[order[0]])
    return tuple(ends[row] for row in order if reached[row] < 0.0)


def _ranked_excess(question: BoxQuestion, designs: RealArray) -> RealArray:
    """Return the excess that decides whether enough responses keep the limit, (n,)."""
    excess = question.excess(designs)
    return np.asarray(np.sort(excess, axis=1)[:, question.least_kept - 1])


def _apart(
    question: BoxQuestion, designs: RealArray, worst: RealArray, count: int, n_given: int
) -> list[int]:
    """Return the given rows, and of the best tenth those that lie farthest from each other."""
    chosen = list(range(n_given))
    order = np.argsort(worst, kind="stable")
    best = [int(row) for row in order[: max(count, len(order) // 10)] if row >= n_given]
    span = np.where(question.free, question.upper - question.lower, 1.0)
    scaled = designs / span
    if not chosen:
        chosen.append(best[0])
    while len(chosen) < n_given + count and len(set(best) - set(chosen)):
        rest = [row for row in best if row not in chosen]
        gaps = np.linalg.norm(scaled[rest][:, np.newaxis] - scaled[chosen], axis=2).min(axis=1)
        chosen.append(rest[int(np.argmax(gaps))])
    return chosen


def _descend(question: BoxQuestion, start: RealArray) -> RealArray:
    """Return the design where the largest of the easiest excesses is least."""
    excess = question.excess(start[np.newaxis])[0]
    if not np.all(np.isfinite(excess)):
        return start
    easy = np.sort(np.argsort(excess, kind="stable")[: question.least_kept])
    low, span = question.lower, question.upper - question.lower
    first = (start - low) / np.where(span > 0.0, span, 1.0)
    scale = float(np.ptp(excess)) or float(np.abs(excess).max()) or 1.0

    def below(place: RealArray) -> RealArray:
        reached = question.excess((low + place[:-1] * span)[np.newaxis])[0, easy]
        return np.asarray(place[-1] - reached / scale)

    def slope(place: RealArray) -> RealArray:
        gradient = question.response.gradient((low + place[:-1] * span)[np.newaxis])[0, easy]
        return np.hstack([-gradient * span / scale, np.ones((len(easy), 1))])

    top = float(excess[easy].max()) / scale
    end = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
        lambda place: place[-1],
        np.append(first, top),
        jac=lambda place: np.append(np.zeros(len(place) - 1), 1.0),
        method="SLSQP",
        bounds=[(0.0, 1.0)] * len(start) + [(None, None)],
        constraints={"type": "ineq", "fun": below, "jac": slope},
        options={"maxiter": _STEPS, "ftol": 1e-9},
    )
    both = np.array([start, low + np.clip(end.x[:-1], 0.0, 1.0) * span])
    return np.asarray(both[int(np.argmin(_ranked_excess(question, both)))])


def _box_around(question: BoxQuestion, design: RealArray, size: float) -> Box:
    """Return the bounds of the question, shrunk about a design to a part `size` of them."""
    lower = design - size * (design - question.lower)
    upper = design + size * (question.upper - design)
    return Box(question.names, lower, upper)


def _largest_size(question: BoxQuestion, design: RealArray, unit: RealArray, share: float) -> float:
    """Return the largest `size` of `_box_around` that keeps a share of the sample, by bisection."""

    def share_at(size: float) -> float:
        return question.share_of(_box_around(question, design, size), unit)

    return 1.0 if share_at(1.0) >= share else _bisected(share_at, 0.0, 1.0, share, halvings=30)


def _bisected(
    share_at: Callable[[float], float], good: float, bad: float, wanted: float, halvings: int
) -> float:
    """Return the value next to `bad` that was seen to keep the wanted share, or `good`."""
    for _ in range(halvings):
        middle = 0.5 * (good + bad)
        if share_at(middle) >= wanted:
            good = middle
        else:
            bad = middle
    return good


def _coarse(
    question: BoxQuestion, effort: BoxEffort, search: RealArray, sample: RealArray, begin: Box
) -> tuple[Box, float]:
    """Return the sized box of the coarse stages of one start and the logarithm of its volume."""
    box = begin
    for softness, n_parts in effort.coarse:
        box = _stage(question, box, search[:n_parts], softness, question.share)
    sized = _sized(question, box, sample)
    return sized if sized[1] > -np.inf else _sized(question, begin, sample)


def _fine(
    question: BoxQuestion, effort: BoxEffort, search: RealArray, sample: RealArray, box: Box
) -> Box:
    """Go on from the best start, to the share that the larger sample counts."""
    target = question.share
    sized = [_sized(question, box, sample)]
    for softness, n_parts in effort.fine:
        box = _stage(question, box, search[:n_parts], softness, target)
        sized.append(_sized(question, box, sample))
        counted = question.share_of(box, sample)
        missed = (1.0 - question.share) / max(1.0 - counted, 1.0 / len(sample))
        target = float(np.clip(1.0 - (1.0 - target) * missed, 0.5 * question.share, 1.0 - 1e-6))
    return max(sized, key=lambda pair: pair[1])[0]


def _sized(question: BoxQuestion, box: Box, sample: RealArray) -> tuple[Box, float]:
    """Return a box, sized to the share, and its log volume; -inf if it cannot have the share."""
    few = sample[: max(_LEAST_SIZED, len(sample) // 16)]
    box, kept = _calibrated(question, box, few, question.share, halvings=7)
    flat = np.any(box.width[question.free] <= 0.0)
    return box, -np.inf if flat or kept < question.share else question.log_volume(box)


def _stage(question: BoxQuestion, box: Box, unit: RealArray, softness: float, target: float) -> Box:
    """Maximise the volume with a smoothed share of at least `target`, from a box."""
    spread = softness * _typical_spread(question, box, unit)
    span = question.upper - question.lower
    scale = np.where(question.free, np.maximum(box.width, _NARROWEST * span), 1.0)
    size = len(span)
    excess_of_box: dict[bytes, tuple[float, RealArray]] = {}

    def ends_of(place: RealArray) -> RealArray:
        return np.asarray(box.lower + place.reshape(2, size) * scale)

    def missed(place: RealArray) -> tuple[float, RealArray]:
        key = place.tobytes()
        if key not in excess_of_box:
            excess_of_box.clear()
            share, gradient = smooth_share(question, ends_of(place), unit, spread)
            lost = max(1.0 - share, 1e-12)
            excess_of_box[key] = (float(np.log(lost)), -(gradient * scale).ravel() / lost)
        return excess_of_box[key]

    weight = np.where(question.free, question.weight, 0.0)
    weight = weight / weight.sum()

    def negative_volume(place: RealArray) -> float:
        width = place[size:] - place[:size]
        tiny = np.minimum(width, _NARROWEST) / _NARROWEST - 1.0  # a straight line below it
        return float(-weight @ (np.log(np.maximum(width, _NARROWEST)) + tiny))

    def volume_slope(place: RealArray) -> RealArray:
        slope = weight / np.maximum(place[size:] - place[:size], _NARROWEST)
        return np.concatenate([slope, -slope])

    allowed = float(np.log(1.0 - target))
    low, high = (question.lower - box.lower) / scale, (question.upper - box.lower) / scale
    end = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
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
        options={"maxiter": _STEPS, "ftol": _SMALLEST_GAIN},
    )
    ends = np.clip(np.sort(ends_of(end.x), axis=0), question.lower, question.upper)
    return Box(question.names, *ends)


def _typical_spread(question: BoxQuestion, box: Box, unit: RealArray) -> float:
    """Root mean square over the responses of their standard deviation over the parts of a box."""
    excess = question.excess(question.parts(box.ends, unit))
    valid = excess[np.isfinite(excess).all(axis=1)]
    spread = float(np.sqrt(valid.var(axis=0).mean())) if len(valid) > 1 else 0.0
    return spread if spread > 0.0 else 1.0


def resized(question: BoxQuestion, box: Box, growth: float) -> Box:
    """Return a box whose ends are moved outwards by a part of each half width, up to the bounds.

    Ends on the bounds stay; a growth from -1 to 0 moves the others inwards.
    """
    near = _ON_BOUND * (question.upper - question.lower)
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

    def share_at(growth: float) -> float:
        return question.share_of(resized(question, box, growth), sample)

    outwards = question.share_of(box, sample) >= wanted
    good, bad = (0.0, None) if outwards else (-1.0, 0.0)
    end, step = 0.0, 0.02 if outwards else -0.02
    while -0.999 < end < 16.0:
        end, step = max(end + step, -0.999), 2.0 * step
        kept = share_at(end) >= wanted
        good, bad = (end, bad) if kept else (good, end)
        if kept != outwards:
            break
    if bad is not None:
        good = _bisected(share_at, good, bad, wanted, halvings)
    return resized(question, box, good), share_at(good)


def _wanted(question: BoxQuestion, effort: BoxEffort, box: Box, sample: RealArray) -> float:
    """Return the share that the larger sample must keep for the bound to reach the stated one."""
    shares = question.part_shares(question.excess(question.parts(box.ends, sample)))
    variance = float(shares.var(ddof=1))
    sobol = _QUIETER**2 * variance / effort.calibration
    both = np.sqrt(variance / effort.verification + sobol)
    gap = bernstein_gap(variance, effort.verification, CONFIDENCE)
    return float(min(question.share + gap + _RESERVE * both, 1.0 - 1e-9))


def _refuse_flat(question: BoxQuestion, box: Box) -> None:
    """Refuse a box with an interval that is none."""
    span = np.where(question.free, question.upper - question.lower, 1.0)
    part = np.where(question.free, box.width / span, np.inf)
    column = int(np.argmin(part))
    if part[column] < _NARROWEST:
        raise NoBoxFound(
            f"the largest box has no interior: '{question.names[column]}' would have to lie "
            f"between {box.lower[column]:.6g} and {box.upper[column]:.6g}; raise the limit, lower "
            "the share or widen the bounds"
        )


def tolerance_box(names: Sequence[str], design: RealArray, tolerance: float) -> Box:
    """Return the box of one tolerance, a part of each variable's own value, about a design (k,)."""
    half = tolerance * np.abs(design)
    return Box(tuple(names), design - half, design + half)
