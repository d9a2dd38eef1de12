"""Problems whose largest acceptance boxes are known, found without a sample and without smoothing.

Parts lie evenly in their box. The share of a box is then a volume over a volume, which linear and
quadratic responses give in closed form or by quadrature. Known boxes share nothing with the search
of `deboom.explore.largest_box` but the box itself; `ratio_of` holds that search against them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
from scipy.optimize import brentq, minimize

from deboom.arrays import RealArray
from deboom.explore.box import Box, BoxQuestion
from deboom.explore.largest_box import BoxEffort, largest_box
from samples.known_truth import Quad2, quad2

SHARE = 0.95
NODES = 400
"""Nodes per variable of a quadrature; the error of a share is below 1e-4."""


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """Responses ``y_r = Σ_k slopes_rk x_k``.

    Parameters
    ----------
    slopes : array, shape (r, k)
    """

    slopes: RealArray
    response_unit: str = "1"

    @property
    def variable_names(self) -> tuple[str, ...]:
        """``x1`` to ``xk``."""
        return tuple(f"x{k + 1}" for k in range(self.slopes.shape[1]))

    @property
    def response_names(self) -> tuple[str, ...]:
        """``y1`` to ``yr``."""
        return tuple(f"y{r + 1}" for r in range(self.slopes.shape[0]))

    def __call__(self, designs: RealArray) -> RealArray:
        """Return the responses, shape (n, r)."""
        return np.asarray(designs @ self.slopes.T)

    def gradient(self, designs: RealArray) -> RealArray:
        """Return the derivatives of the responses, shape (n, r, k)."""
        return np.broadcast_to(self.slopes, (len(designs), *self.slopes.shape)).copy()

    def shares(self, limit: RealArray, lower: RealArray, upper: RealArray) -> RealArray:
        """Return the share that keeps each limit, shape (r,)."""
        pairs = zip(self.slopes, limit, strict=True)
        return np.array([linear_share(slope, value, lower, upper) for slope, value in pairs])


@dataclass(frozen=True, eq=False)
class QuadraticProblem(Quad2):
    """QUAD2 of `samples.known_truth`, or one of its responses, with the share of a box."""

    def shares(self, limit: RealArray, lower: RealArray, upper: RealArray) -> RealArray:
        """Return the share that keeps each limit, shape (r,)."""
        rows = zip(self.weights, self.targets, limit, strict=True)
        return np.array([quadratic_share(w, c, value, lower, upper) for w, c, value in rows])


KnownShare = LinearProblem | QuadraticProblem


def linear_share(slope: RealArray, limit: float, lower: RealArray, upper: RealArray) -> float:
    """Return the share of a box in which ``slope · x ≤ limit``.

    Notes
    -----
    ``P(Σ s_k U_k ≤ c) = Σ_S (-1)^|S| max(0, c - Σ_S s)^n / (n! Π s)`` over all subsets S of the n
    steps ``s_k = |slope_k| width_k``, with c counted from the lowest corner: the volume of a cube
    below a plane (D. L. Barrow and P. W. Smith, "Spline notation applied to a volume problem",
    Amer. Math. Monthly 86, 1979).
    """
    steps = np.abs(slope) * (upper - lower)
    room = limit - float(np.where(slope > 0.0, slope * lower, slope * upper).sum())
    steps = steps[steps > 0.0]
    if not steps.size or room <= 0.0 or room >= steps.sum():
        return float(room >= steps.sum())
    if room > 0.5 * steps.sum():  # the small corner above the plane: no digits are lost
        return 1.0 - _corner(steps, float(steps.sum()) - room)
    return _corner(steps, room)


def _corner(steps: RealArray, room: float) -> float:
    signs, sums = np.ones(1), np.zeros(1)
    for step in steps:
        signs, sums = np.concatenate([signs, -signs]), np.concatenate([sums, sums + step])
    n = steps.size
    return float(signs @ np.maximum(0.0, room - sums) ** n / (factorial(n) * np.prod(steps)))


def quadratic_share(
    weight: RealArray, target: RealArray, limit: float, lower: RealArray, upper: RealArray
) -> float:
    """Return the share of a box in which ``Σ_k weight_k (x_k - target_k)² ≤ limit``.

    Notes
    -----
    The last variable that is not held is integrated in closed form (an interval's overlap with
    another), the others by the midpoint rule with `NODES` nodes.
    """
    free = np.flatnonzero(upper > lower)
    held = np.setdiff1d(np.arange(weight.size), free)
    left = np.array(limit - float(weight[held] @ (lower[held] - target[held]) ** 2))
    if not free.size:
        return float(left >= 0.0)
    middle = (np.arange(NODES) + 0.5) / NODES
    for k in free[:-1]:
        term = weight[k] * (lower[k] + middle * (upper[k] - lower[k]) - target[k]) ** 2
        left = np.subtract.outer(left, term)
    last = free[-1]
    reach = np.sqrt(np.maximum(left, 0.0) / weight[last])
    top = np.minimum(upper[last], target[last] + reach)
    bottom = np.maximum(lower[last], target[last] - reach)
    overlap = np.where(left >= 0.0, np.maximum(0.0, top - bottom), 0.0)
    return float(overlap.mean() / (upper[last] - lower[last]))


def exact_share(problem: KnownShare, limit: RealArray, box: Box) -> float:
    """Return the true share of parts and responses that keep their limits [1]."""
    return float(problem.shares(limit, box.lower, box.upper).mean())


def exact_largest_box(
    problem: KnownShare, limit: RealArray, share: float, bounds: Box, anchor: RealArray
) -> Box:
    """Return the largest box by its true share, from a small one about a design that keeps it."""
    size, span = len(bounds.names), bounds.width

    def box(place: RealArray) -> Box:
        lower, upper = np.sort(bounds.lower + place.reshape(2, size) * span, axis=0)
        return Box(bounds.names, lower, upper)

    at = (anchor - bounds.lower) / span
    optimum = minimize(
        lambda place: -float(np.log(np.maximum(place[size:] - place[:size], 1e-3)).sum()),
        np.clip(np.concatenate([at - 0.05, at + 0.05]), 0.0, 1.0),
        method="SLSQP",
        bounds=[(0.0, 1.0)] * (2 * size),
        constraints={
            "type": "ineq",
            "fun": lambda place: exact_share(problem, limit, box(place)) - share,
        },
        options={"maxiter": 200, "ftol": 1e-10},
    )
    return box(optimum.x)


def largest_linear_box(slope: RealArray, limit: float, share: float, lower: RealArray) -> Box:
    """Return the largest box below a plane with rising slopes, its lower ends at the bounds.

    Notes
    -----
    The steps ``slope_k width_k`` are equal, by symmetry, so that ``Σ U_k`` of uniform U_k has to
    stay below ``room / step``: the step follows from the quantile of the Irwin-Hall distribution.
    """
    ones = np.ones(slope.size)
    room = limit - float(slope @ lower)
    quantile = brentq(
        lambda c: linear_share(ones, c, 0.0 * ones, ones) - share,
        0.0,
        float(slope.size),
        xtol=1e-13,
    )
    names = LinearProblem(slope[np.newaxis]).variable_names
    return Box(names, lower, lower + room / (quantile * slope))


def plane(n_variables: int, seed: int) -> tuple[KnownShare, RealArray, Box, Box]:
    """Return problem, limit, bounds and exact box of an instance below a plane."""
    slope = np.random.default_rng(seed).uniform(0.5, 2.0, n_variables)
    problem = LinearProblem(slope[np.newaxis])
    bounds = Box(problem.variable_names, np.zeros(n_variables), np.full(n_variables, 3.0))
    return problem, np.ones(1), bounds, largest_linear_box(slope, 1.0, SHARE, bounds.lower)


def bowl(seed: int) -> tuple[KnownShare, RealArray, Box, Box]:
    """Return an instance in a quadratic bowl of two variables."""
    weight, target = np.random.default_rng(seed).uniform(0.5, 1.5, (2, 1, 2))
    problem = QuadraticProblem(weight, target)
    bounds = Box(problem.variable_names, np.full(2, -1.0), np.full(2, 3.0))
    limit = np.array([0.05])
    return problem, limit, bounds, exact_largest_box(problem, limit, SHARE, bounds, target[0])


def two_vehicles(n_variables: int, seed: int) -> tuple[KnownShare, RealArray, Box, RealArray]:
    """Return problem, limit, bounds and a design below the limit of an instance of QUAD2."""
    truth = quad2(n_variables, seed=seed)
    problem = QuadraticProblem(truth.weights, truth.targets)
    bounds = Box(problem.variable_names, np.full(n_variables, 0.4), np.full(n_variables, 1.6))
    middle = truth.targets.mean(axis=0)
    limit = np.full(2, float(problem(middle[np.newaxis]).max()) + 0.05)
    return problem, limit, bounds, middle


def ratio_of(
    kind: str, n_variables: int, seed: int, effort: BoxEffort
) -> tuple[float, bool, bool, float]:
    """Return volume over the exact one, and what holds of an instance.

    The true share is above its bound and the stated one; the bound is above the stated one; how far
    the verified share is from the true one, in standard errors.
    """
    if kind == "QUAD2":
        problem, limit, bounds, middle = two_vehicles(n_variables, seed)
        exact = exact_largest_box(problem, limit, SHARE, bounds, middle)
    else:
        problem, limit, bounds, exact = plane(n_variables, seed) if kind == "plane" else bowl(seed)
    question = BoxQuestion(problem, limit, SHARE, bounds.lower, bounds.upper)
    largest = largest_box(question, seed=seed, effort=effort)
    true = exact_share(problem, limit, largest.box)
    ratio = float(np.prod(largest.box.width / exact.width))
    off = abs(largest.verified.share - true) / largest.verified.standard_error
    return ratio, true >= max(largest.verified.bound, SHARE), largest.confirmed, off
