"""Whether a limit can be kept at all, and the designs from which a box can grow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.solution_box import Box, BoxQuestion, checked_point
from deboom.explore.solution_box_share import box_sample

TRIED = 1024
"""Designs over the bounds that are tried first."""
STEPS = 60
"""Of each descent towards the limit."""


class UnreachableLimit(InputError):
    """No design inside the bounds keeps the limit in as many responses as the share asks for.

    Parameters
    ----------
    question : BoxQuestion
    design : array, shape (k,)
        That comes closest.
    missed : float
        By how much it misses the limit that binds [response_unit].
    binding : str
        Response that binds.
    """

    def __init__(
        self, question: BoxQuestion, design: RealArray, missed: float, binding: str
    ) -> None:
        unit = question.response.response_unit
        names = question.response.response_names
        column = names.index(binding)
        super().__init__(
            f"no design inside the bounds keeps the limit in {question.least_kept} of "
            f"{len(names)} responses: the closest one misses it by {missed:.3g} {unit} in "
            f"'{binding}', which binds ({question.limit[column] + missed:.4g} against "
            f"{question.limit[column]:.4g} {unit}): raise the limit or widen the bounds"
        )
        self.question, self.design, self.missed, self.binding = question, design, missed, binding


def ranked_excess(question: BoxQuestion, excess: RealArray) -> RealArray:
    """Return the excess that decides whether enough responses keep the limit, (n,), of (n, r)."""
    return np.asarray(np.sort(excess, axis=1)[:, question.least_kept - 1])


def reachable_designs(
    question: BoxQuestion,
    *,
    seed: int,
    count: int,
    points: Sequence[npt.ArrayLike] = (),
) -> tuple[RealArray, ...]:
    """Return designs around which a box has room, the roomiest first.

    Parameters
    ----------
    question : BoxQuestion
    seed : int
        From 1 upwards, of the designs that are tried.
    count : int
        Descents towards the limit, from places that lie apart.
    points : sequence of array, shape (k,)
        Designs to start from as well, such as one of a Pareto front; they go on to the limit too.

    Returns
    -------
    tuple of array, shape (k,)
        At least one, each below the limit in as many responses as the share asks for.

    Raises
    ------
    UnreachableLimit
        There is none.

    Notes
    -----
    Each descent minimises the largest excess of the responses that the start keeps best, by
    sequential quadratic programming (SLSQP) with the model's gradient.
    """
    given = np.array([checked_point(question, point) for point in points])
    unit = box_sample(len(question.names), TRIED, seed=seed, purpose="designs below a limit")
    tried = question.bounds.at(unit)
    if len(given):
        tried = np.vstack([given, tried])
    worst = ranked_excess(question, question.excess(tried))
    starts = _apart(question, tried, worst, count, len(given))
    ends = np.array([_descend(question, tried[row]) for row in starts])
    found = ranked_excess(question, question.excess(ends))
    order = np.argsort(found, kind="stable")
    if not found[order[0]] < 0.0:
        _refuse(question, ends[order[0]])
    return tuple(ends[row] for row in order if found[row] < 0.0)


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
        distance = [
            min(np.linalg.norm(scaled[row] - scaled[one]) for one in chosen) for row in rest
        ]
        chosen.append(rest[int(np.argmax(distance))])
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
        found = question.excess((low + place[:-1] * span)[np.newaxis])[0, easy]
        return np.asarray(place[-1] - found / scale)

    def slope(place: RealArray) -> RealArray:
        gradient = question.response.gradient((low + place[:-1] * span)[np.newaxis])[0, easy]
        return np.hstack([-gradient * span / scale, np.ones((len(easy), 1))])

    top = float(excess[easy].max()) / scale
    found = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
        lambda place: place[-1],
        np.append(first, top),
        jac=lambda place: np.append(np.zeros(len(place) - 1), 1.0),
        method="SLSQP",
        bounds=[(0.0, 1.0)] * len(start) + [(None, None)],
        constraints={"type": "ineq", "fun": below, "jac": slope},
        options={"maxiter": STEPS, "ftol": 1e-9},
    )
    end = low + np.clip(found.x[:-1], 0.0, 1.0) * span
    both = np.array([start, end])
    return np.asarray(both[int(np.argmin(ranked_excess(question, question.excess(both))))])


def _refuse(question: BoxQuestion, design: RealArray) -> None:
    excess = question.excess(design[np.newaxis])[0]
    binding = int(np.argsort(excess, kind="stable")[question.least_kept - 1])
    raise UnreachableLimit(
        question, design, float(excess[binding]), question.response.response_names[binding]
    )


def box_around(question: BoxQuestion, design: RealArray, size: float) -> Box:
    """Return the bounds of the question, shrunk about a design to a part `size` of them [1]."""
    lower = design - size * (design - question.lower)
    upper = design + size * (question.upper - design)
    return Box(question.names, lower, upper)


def largest_size(question: BoxQuestion, design: RealArray, unit: RealArray, share: float) -> float:
    """Return the largest `size` of `box_around` that keeps a share of the sample, by bisection.

    Parameters
    ----------
    question : BoxQuestion
    design : array, shape (k,)
        Below the limit in as many responses as the share asks for.
    unit : array, shape (n, k)
        Uniform draws that stand for the parts [1].
    share : float
        To be kept [1].
    """
    good, bad = 0.0, 1.0
    if question.share_of(box_around(question, design, bad), unit) >= share:
        return bad
    for _ in range(30):
        middle = 0.5 * (good + bad)
        if question.share_of(box_around(question, design, middle), unit) >= share:
            good = middle
        else:
            bad = middle
    return good
