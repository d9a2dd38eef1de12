"""The whole front of two smooth objectives, by descents along exact gradients.

An evolutionary search finds the branches of a front and stays short of its ends; descents own the
ends and miss branches. Here many descents with few draws find the branches, descents with all draws
bring a net of points onto the front, and the net is refined where it still loses most.

The scalarisation is that of A. Pascoletti and P. Serafini, "Scalarizing vector optimization
problems", Journal of Optimization Theory and Applications 42 (1984) 499; the descents are those of
D. Kraft (SLSQP) in scipy.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache, cached_property, partial
from itertools import pairwise
from typing import Any, NamedTuple, Protocol, cast, runtime_checkable

import numpy as np
from scipy.optimize import minimize

from deboom.arrays import RealArray
from deboom.explore.front import nondominated, pareto_front
from deboom.explore.moments import Draws, Limit, Objective
from deboom.explore.robust import Limits, Robust, RobustValues, numbers_of_designs
from deboom.explore.scatter import ToleranceSample, ToleranceSampler
from deboom.explore.space import DesignSpace, generator
from deboom.progress import Progress

FEW_DRAWS = 16
"""Draws that find the branches of a front; a prefix of the Sobol points of the search."""
TARGETS, STARTS = 16, 6
"""Targets along the front with few draws, and random descents at each of them."""
END_STARTS = (6, 12)
"""Random descents with few draws to the best first and to the best second objective, which most
designs do not lead to."""
NO_INFLUENCE = 1e-3
"""Scaled difference of an objective up to which a variable does not count at its best design."""
VALLEY = 1e-2
"""Scaled difference of an objective up to which descents with few draws ended in one valley."""
APART, SAME = 0.7, 0.5
"""Distance in scaled designs above which two designs are of different branches, and below which
designs between them are worth an evaluation."""
REFINEMENTS = 80
"""Most targets that are added where the net loses most."""
ENOUGH = 5e-4
"""Hypervolume, as a share of the box of the front, that the net may still lose."""
STRAIGHT = 3e-4
"""Share of the box of the front that a descent gains on a line between neighbours, below which
designs on the two halves of the line are good enough: they miss the front by a quarter of it."""
LINES = 400
"""Designs evaluated on lines between neighbours of one branch."""
STEEP = 20.0
"""Factor on what a descent minimises. SLSQP begins with the curvature 1, which is far too much for
shares of a box: the larger the factor, the longer the first step."""
ROUGH, FINE = 1e-3, 1e-5
"""Share of the box of the front below which descents to a target end, with few and all draws."""

WORSE = 10.0
"""Scaled distance of a design that fails beyond the worst objectives so far: a descent steps back,
and its line search is not upset as it would be by an infinite value."""

BEYOND = 1e3
"""Scaled distance that counts for each scaled unit beyond a limit: what keeps it is better."""
DIFFERENCE = 1e-6
"""Step of differences of a function without a gradient, in scaled designs."""
MARGIN = 3e-6
"""Scaled distance that descents keep from limits, which they meet to within their tolerance."""
GUIDES = 24
"""Designs within all limits that descents begin from, beside random ones."""

PullBack = Callable[[RealArray], RealArray]
"""Map from weights (o, n, r) to ``Σ_r w_onr ∂y_nr/∂x_nk``, shape (o, n, k) [response unit per unit
of the space]."""


@runtime_checkable
class Linearisable(Protocol):
    """A model whose responses have exact derivatives by its variables."""

    @property
    def is_linearisable(self) -> bool:
        """Whether the derivatives exist and are exact, at all designs."""

    def linearised(self, designs: RealArray) -> tuple[RealArray, PullBack]:
        """Return the responses of designs (n, k), shape (n, r), and the pull-back of weights.

        Products of weights and derivatives cost one adjoint solution for each set of weights, while
        all derivatives would cost one for each response.
        """


class Gradients(Enum):
    """How the gradients of a response are computed."""

    exact = "exact"
    differences = "differences"
    none = "none"


def gradients_of(robust: Robust) -> Gradients:
    """Return how the gradients of a robust response are computed.

    There are some if designs share their draws, no variable is a whole number, and the model is not
    marked by ``smooth = False``, such as the rise of a booming peak, which comes and goes. They are
    exact for two objectives that are means, sigmas and other statistics with derivatives of a
    `Linearisable` model. Limits may be bounds of these, of the worst response from above, and of
    functions of the design, of which differences are taken where there is no ``gradient``. The
    extremes of the drawn parts have none.
    """
    if (
        not isinstance(robust.sample, ToleranceSample)
        or robust.space.integer.any()
        or not getattr(robust.evaluate, "smooth", True)
    ):
        return Gradients.none
    is_exact = (
        len(robust.objectives) == 2
        and all(_has_gradient(robust, objective) for objective in robust.objectives)
        and not robust.nominal_mean
        and not without_gradient(robust)
        and bool(np.any(robust.space.upper > robust.space.lower))
        and isinstance(robust.evaluate, Linearisable)
        and robust.evaluate.is_linearisable
    )
    return Gradients.exact if is_exact else Gradients.differences


def without_gradient(robust: Robust) -> list[Limit]:
    """Return the limits of a robust response that descents cannot keep."""
    return [
        limit
        for limit in robust.limits.limits
        if not all(_has_gradient(robust, each.number) for each in _of_each(robust, limit))
    ]


def by_differences(robust: Robust) -> list[Limit]:
    """Return the limits of a robust response whose gradients are differences."""
    return [limit for limit in robust.limits.limits if _is_differenced(limit.number)]


def _has_gradient(robust: Robust, number: Objective) -> bool:
    """Say whether a number has a gradient, apart from what the model may lack."""
    if not number.has_own_model:
        return number.shares(robust.evaluate.response_names, robust.weights) is not None
    smooth = number.is_of_design or number.rule.by_draw is not None
    return smooth and not number.worst and getattr(number.response, "smooth", True)


def _is_differenced(number: Objective) -> bool:
    """Say whether the gradient of a number with a model of its own takes differences."""
    given = number.is_of_design and hasattr(number.response, "gradient")
    return number.has_own_model and not given


def _of_each(robust: Robust, limit: Limit) -> list[Limit]:
    """Return a limit, or one of each response for that of the worst one from above."""
    number = limit.number
    if number.worst and number.response is None and np.isinf(float(limit.at_least)):
        # the largest is below a bound if all are
        names = np.array(robust.evaluate.response_names)[robust.is_compared].tolist()
        each = [replace(number, worst=False, response=name) for name in names]
        return [replace(limit, number=one) for one in each]
    return [limit]


def objectives_and_gradients(
    robust: Robust, design: RealArray, *, each_mean: bool = False
) -> tuple[RealArray, RealArray]:
    """Return the two objectives of a design (k,), and their gradients.

    Parameters
    ----------
    robust : Robust
        Response whose `gradients_of` are exact.
    design : array, shape (k,)
        Design [units of the space].
    each_mean : bool
        Whether the mean of each of the r responses follows the two objectives.

    Returns
    -------
    objectives : array, shape (2,) or (2 + r,)
        By default the sums over the responses of their means and standard deviations, and perhaps
        each mean [response unit]; not finite where the design fails.
    gradients : array, shape (2, k) or (2 + r, k)
        Derivatives by each variable [response unit per unit of the space].

    Notes
    -----
    With draws ``x_t = x m_t + a_t`` (`Robust.made_terms`; ``m_t = 1 + σ z_t`` of a relative
    tolerance) and responses ``y_tr``, ``∂/∂x_k = Σ_t m_tk Σ_r w_tr ∂y_tr/∂x_k``, where w are the
    derivatives of the objective by the responses: ``1/n`` for the mean,
    ``(y_tr − mean_r) / (σ_r (n − 1))`` for the sigma of plain moments.
    """
    numbers = list(robust.objectives)
    if each_mean:
        numbers += [Objective("mean", response=name) for name in robust.evaluate.response_names]
    objectives, gradients = _linearised(robust, design, numbers, _shares(robust, numbers))
    return objectives, gradients()


def _shares(robust: Robust, numbers: Sequence[Objective]) -> RealArray:
    """Return the weights of the responses in each number that is smooth, (o, r)."""
    names = robust.evaluate.response_names
    return np.array([cast(Any, number.shares(names, robust.weights)) for number in numbers])


def _linearised(
    robust: Robust, design: RealArray, numbers: Sequence[Objective], shares: RealArray
) -> tuple[RealArray, Callable[[], RealArray]]:
    """Return several numbers (o,) of a design, and a function that returns their gradients (o, k).

    See `objectives_and_gradients`: the gradients cost more than the numbers, and descents do not
    need them everywhere.
    """
    model = cast(Linearisable, robust.evaluate)
    made_per_design, added = robust.made_terms(design)
    values, pull_back = model.linearised(design * made_per_design + added)
    derivatives = robust.prepared(design).derivatives(values)
    draws = Draws(
        values, derivatives.mean, derivatives.sigma, lambda: robust.evaluate(design[np.newaxis])[0]
    )
    sums = [
        np.einsum("r,r->", share, number.rule.of(draws, number))
        for number, share in zip(numbers, shares, strict=True)
    ]

    def gradients() -> RealArray:
        # a number without derivatives has no shares
        by_draw = [cast(Any, number.rule.by_draw)(derivatives) for number in numbers]
        weights = [share * slope for share, slope in zip(shares, by_draw, strict=True)]
        slopes = pull_back(np.array(weights))
        return np.asarray(np.einsum("otk,tk->ok", slopes, made_per_design))

    return np.array(sums), gradients


@dataclass(frozen=True, eq=False)
class _Problem:
    """Two objectives and the excess over limits of a design, with their gradients."""

    robust: Robust

    @cached_property
    def _limits(self) -> Limits:
        """Limits of numbers of the responses, then those of functions of designs."""
        limits = self.robust.limits.limits
        of_responses = (limit for limit in limits if not limit.number.has_own_model)
        each = [one for limit in of_responses for one in _of_each(self.robust, limit)]
        return Limits((*each, *(limit for limit in limits if limit.number.has_own_model)))

    @cached_property
    def _own(self) -> list[Objective]:
        """Numbers whose model is their own."""
        numbers = (limit.number for limit in self._limits.limits)
        return [number for number in numbers if number.has_own_model]

    @cached_property
    def _numbers(self) -> list[Objective]:
        """Objectives, and limited numbers of the responses."""
        limited = [limit.number for limit in self._limits.limits if not limit.number.has_own_model]
        return [*self.robust.objectives, *limited]

    @cached_property
    def _shares(self) -> RealArray:
        return _shares(self.robust, self._numbers)

    def __call__(self, design: RealArray) -> tuple[RealArray, Callable[[], RealArray]]:
        """Return the objectives and the excess of a design, and a function for their gradients.

        - returns: (2 + c,), and a function that returns (2 + c, k).
        """
        numbers, slopes = _linearised(self.robust, design, self._numbers, self._shares)
        if not self._limits:
            return numbers, slopes
        by_model = [self.robust.own_number(number, design) for number in self._own]

        def gradients() -> RealArray:
            rows = slopes()
            for number, value in zip(self._own, by_model, strict=True):
                rows = np.vstack([rows, _own_gradient(self.robust, number, design, value)])
            return np.vstack([rows[:2], self._limits.excess_slopes(rows[2:])])

        excess = self._limits.excess(np.array([[*numbers[2:], *by_model]]))[0]
        return np.concatenate([numbers[:2], excess]), gradients


def _own_gradient(robust: Robust, number: Objective, design: RealArray, value: float) -> RealArray:
    """Return the derivatives (k,) of a number whose model is its own, exact or by differences.

    - `value`: the number of the design.
    """
    if not _is_differenced(number):
        gradient = cast(Any, number.response).gradient(design[np.newaxis])[0]
        return np.asarray(gradient.sum(axis=0))
    space = robust.space
    step = DIFFERENCE * (space.upper - space.lower)
    # within the bounds, beyond which a function may not reach
    step = np.where(design + step > space.upper, -step, step)
    free = np.flatnonzero(step)
    moved = design + np.diag(step)[free]
    if number.is_of_design:
        values = numbers_of_designs([number], moved)[:, 0]
    else:
        values = np.array([robust.own_number(number, each) for each in moved])
    gradient = np.zeros(design.size)
    gradient[free] = (values - value) / step[free]
    return gradient


class _Point(NamedTuple):
    """A scaled design (k,) from 0 to 1, its objectives (2,), and how far it misses a limit."""

    x: RealArray
    value: RealArray
    beyond: float

    @property
    def penalty(self) -> float:
        """What objectives beyond a limit are taken to be worse by; 0 within all."""
        return BEYOND * max(self.beyond, 0.0)


@dataclass
class _Landscape:
    """Objectives over scaled designs from 0 to 1, and all designs that were evaluated.

    - `xs`, `values`, `beyond`: scaled designs that were evaluated, objectives, largest excess.
    - `size` (2 + c,): what an objective or an excess is divided by, so that one tolerance serves
      all.
    - `worst` (2,): largest objectives so far, scaled.
    - `excess` (c,), `slope`: excess over the limits at the last design, scaled, and a function that
      returns the gradients there, (2 + c, k), which cost more than the values.
    """

    problem: _Problem
    size: RealArray
    worst: RealArray
    xs: list[RealArray] = field(default_factory=list)
    values: list[RealArray] = field(default_factory=list)
    beyond: list[float] = field(default_factory=list)
    excess: RealArray = field(init=False)
    slope: Callable[[], RealArray] = field(init=False)

    @property
    def n_limits(self) -> int:
        """Number c of limits."""
        return self.size.size - 2

    def at(self, x: RealArray) -> RealArray:
        """Return the objectives (2,) at a scaled design (k,)."""
        if not self.xs or self.xs[-1].tobytes() != x.tobytes():
            space = self.problem.robust.space
            design = space.lower + x * (space.upper - space.lower)
            value, gradients = self.problem(design)
            scaled = value / self.size
            if np.isfinite(scaled).all():
                self.worst = np.fmax(self.worst, scaled[:2])
            else:
                scaled = np.r_[self.worst + WORSE, np.full(self.n_limits, WORSE)]
            self.xs.append(x.copy())
            self.values.append(scaled[:2])
            self.excess, self.slope = scaled[2:], cache(partial(self._scaled, gradients))
            self.beyond.append(float(np.max(self.excess, initial=-np.inf)))
        return self.values[-1]

    def excess_at(self, x: RealArray) -> RealArray:
        """Return the excess over the limits (c,) at a scaled design."""
        self.at(x)
        return self.excess

    def slope_at(self, x: RealArray) -> RealArray:
        """Return the gradients of the objectives and the excess (2 + c, k) at a scaled design."""
        self.at(x)
        return self.slope()

    def _scaled(self, gradients: Callable[[], RealArray]) -> RealArray:
        """Return gradients by scaled designs; 0 where one is not finite."""
        space = self.problem.robust.space
        slope = gradients() * (space.upper - space.lower) / self.size[:, np.newaxis]
        # contiguous: SLSQP reads a strided row as if it were not
        return np.ascontiguousarray(np.where(np.isfinite(slope).all(), slope, 0.0))

    def _kept(self, n: int, *, goal: float) -> list[dict[str, Any]]:
        """Return the constraints of n scaled variables, perhaps with more after them."""
        if self.n_limits == 0:
            return []
        distance = MARGIN + goal

        def slopes(y: RealArray) -> RealArray:
            gradient = -self.slope_at(y[:n])[2:]
            return np.hstack([gradient, np.zeros((self.n_limits, len(y) - n))])

        return [
            {
                "type": "ineq",
                "fun": lambda y: -distance - self.excess_at(y[:n]),
                "jac": slopes,
            }
        ]

    def descend(self, start: RealArray, row: int, *, goal: float, steps: int) -> _Point:
        """Return where a descent of one objective ends."""
        end = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
            lambda x: STEEP * self.at(x)[row],
            start,
            jac=lambda x: STEEP * self.slope_at(x)[row],
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(start),
            constraints=self._kept(len(start), goal=goal),
            options={"maxiter": steps, "ftol": STEEP * goal},
        )
        return self.point(end.x)

    def reach(
        self, start: RealArray, target: RealArray, box: RealArray, *, goal: float, steps: int
    ) -> _Point:
        """Return where a descent towards a target ends: min t with ``f ≤ target + t box``."""
        n = len(start)
        slope = np.r_[np.zeros(n), STEEP]
        constraint: dict[str, Any] = {
            "type": "ineq",
            "fun": lambda y: y[-1] - (self.at(y[:-1]) - target) / box,
            "jac": lambda y: np.hstack(
                [-self.slope_at(y[:-1])[:2] / box[:, np.newaxis], np.ones((2, 1))]
            ),
        }
        first = np.max((self.at(start) - target) / box)
        end = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
            lambda y: STEEP * y[-1],
            np.r_[start, first],
            jac=lambda _: slope,
            method="SLSQP",
            constraints=[constraint, *self._kept(n, goal=goal)],
            bounds=[(0.0, 1.0)] * n + [(None, None)],
            options={"maxiter": steps, "ftol": STEEP * goal},
        )
        return self.point(end.x[:-1])

    def evaluated(self, row: int) -> _Point:
        """Return one of the designs that were evaluated."""
        return _Point(self.xs[row], self.values[row], self.beyond[row])

    def point(self, x: RealArray) -> _Point:
        """Return the objectives at a scaled design, clipped into the bounds."""
        inside = np.clip(x, 0.0, 1.0)
        value = self.at(inside)
        return _Point(inside, value, self.beyond[-1])


@dataclass(frozen=True)
class _Line:
    """The line from the best first to the best second objective, and the box between them.

    - `first`, `second` (2,): objectives of both ends, scaled.
    """

    first: RealArray
    second: RealArray

    @property
    def box(self) -> RealArray:
        """Size of the box of the front, shape (2,); positive."""
        gap = np.array([self.second[0] - self.first[0], self.first[1] - self.second[1]])
        return np.asarray(np.maximum(gap, 1e-9))

    def target(self, share: float) -> RealArray:
        """Return the point of the line at a share of its length, (2,)."""
        return np.asarray(self.first + share * (self.second - self.first))

    def excess(self, point: _Point, share: float) -> float:
        """Return by how many boxes a point lies beyond a target; negative if below [1]."""
        return float(np.max((point.value - self.target(share)) / self.box)) + point.penalty


def converged_front(
    robust: Robust,
    *,
    seed: int,
    begin: RealArray | None = None,
    ends_only: bool = False,
    progress: Progress | None = None,
) -> RobustValues:
    """Return a converged front of two smooth objectives, perhaps within limits.

    Parameters
    ----------
    robust : Robust
        Response whose `gradients_of` are exact.
    seed : int
        Seed from 1 upwards of the random designs that find the branches.
    begin : array, shape (n, k), optional
        Designs within all limits from which descents begin too, by the first objective, such as the
        front of another search [units of the space]. Random designs seldom are within limits.
    ends_only : bool
        Whether to leave the front between its ends as the descents to these happen to meet it.
    progress : callable, optional
        Called after each stage.

    Returns
    -------
    RobustValues
        Designs within all limits that no other evaluated one beats, with their values; perhaps
        none.

    Notes
    -----
    1. With a few draws, random designs descend to both ends of the front and to targets between
       them (Pascoletti-Serafini, along the line between the ends): this finds its branches.
    2. Both ends, with all draws, from the distinct ends of the first stage.
    3. The targets, with all draws, from the optima of the first stage, and from the neighbours on
       another branch, there and back.
    4. The interval between two neighbours that loses most hypervolume is halved, again and again,
       except where a line between neighbours is as good.
    5. Designs on the straight line between neighbours of one branch are evaluated.

    The objectives of few draws are shifted, and have a box of their own.
    """
    random = generator(seed, "converged front")
    space = robust.space
    free = space.upper > space.lower

    def draw() -> RealArray:
        return np.where(free, random.random(free.size), 0.0)

    stages = _Stages(progress, 3 if ends_only else 5)
    few = _Problem(replace(robust, sample=_first_draws(robust.sample, FEW_DRAWS)))
    size, worst = _scale(few, np.array([draw() for _ in range(16)]))
    guides = _guides(space, begin)
    targets = 0 if ends_only else TARGETS
    ends, branches = _branches(_Landscape(few, size, worst), draw, guides, targets)
    stages.done("branches of the front")
    landscape = _Landscape(_Problem(robust), size, worst)
    net = _Net(landscape, _ends(landscape, ends, branches, guides))
    stages.done("both ends")
    if not ends_only:
        for guide in guides:
            landscape.point(guide)
        for share, points in branches.items():
            starts = [points[0].x, *_at_share(guides, share)]
            net.solve(share, [landscape.point(start) for start in starts])
        for shares in (sorted(net.points), sorted(net.points, reverse=True)):
            for before, share in pairwise(shares[:-1]):
                net.solve(share, [net.points[before]])
        stages.done("targets between them")
        net.refine()
        stages.done("widest gaps halved")
    kept = np.array(landscape.beyond) <= 0.0
    xs, reached = np.array(landscape.xs)[kept], np.array(landscape.values)[kept]
    lines = [] if ends_only else net.lines()
    xs = np.vstack([xs[nondominated(reached)], *lines])
    values = robust(space.lower + xs * (space.upper - space.lower))
    stages.done("lines between neighbours")
    return pareto_front(values)


def _guides(space: DesignSpace, begin: RealArray | None) -> list[RealArray]:
    """Return at most `GUIDES` of given designs, evenly along their order, scaled."""
    if begin is None or len(begin) == 0:
        return []
    chosen = np.unique(np.linspace(0, len(begin) - 1, GUIDES).round().astype(int))
    span = space.upper - space.lower
    return list((begin[chosen] - space.lower) / np.where(span > 0.0, span, 1.0))


def _at_share(guides: Sequence[RealArray], share: float) -> list[RealArray]:
    """Return the guide at a share of their order, 0 to 1, if there are any."""
    return [guides[round(share * (len(guides) - 1))]] if guides else []


class _Stages:
    """Tells a progress bar which of its stages are done."""

    def __init__(self, progress: Progress | None, n_stages: int) -> None:
        self.progress, self.n_done, self.n_stages = progress, 0, n_stages

    def done(self, words: str) -> None:
        self.n_done += 1
        if self.progress is not None:
            self.progress(self.n_done, self.n_stages, f"descents, {words}")


def _first_draws(sample: ToleranceSampler, n: int) -> ToleranceSampler:
    """Return the first draws of a sample: of a power of two, a Sobol net again."""
    assert isinstance(sample, ToleranceSample)
    return replace(sample, values=sample.values[:n])


def _scale(problem: _Problem, xs: RealArray) -> tuple[RealArray, RealArray]:
    """Return standard deviations over designs, and the worst objectives, scaled.

    - returns: of objectives and excess, (2 + c,), and of the objectives, (2,).
    """
    space = problem.robust.space
    designs = space.lower + xs * (space.upper - space.lower)
    values = problem.robust(designs)
    computed = values.objectives[~values.failed]
    excess = np.empty((len(designs), 0))
    if problem.robust.limits:
        excess = np.array([problem(design)[0][2:] for design in designs])
        excess = excess[np.isfinite(excess).all(axis=1)]
    if len(computed) == 0:
        return np.ones(2 + excess.shape[1]), np.zeros(2)
    spread = np.r_[computed.std(axis=0), excess.std(axis=0) if len(excess) else excess.sum(axis=0)]
    size = np.where(spread > 0.0, spread, 1.0)
    return size, computed.max(axis=0) / size[:2]


def _branches(
    few: _Landscape, draw: Callable[[], RealArray], guides: Sequence[RealArray], targets: int
) -> tuple[list[list[_Point]], dict[float, list[_Point]]]:
    """Return both ends and the optima at each target, all with few draws, the best first."""
    ends = []
    for row, count in enumerate(END_STARTS):
        starts = [draw() for _ in range(count)] + _at_share(guides, float(row))
        points = [few.descend(start, row, goal=1e-4, steps=30) for start in starts]
        ends.append(sorted(points, key=partial(_value_of, row=row)))
    line = _Line(ends[0][0].value, ends[1][0].value)
    branches = {}
    for share in (np.arange(targets) + 0.5) / max(targets, 1):
        target = line.target(share)
        starts = [draw() for _ in range(STARTS)] + _at_share(guides, float(share))
        points = [few.reach(start, target, line.box, goal=ROUGH, steps=20) for start in starts]
        points.sort(key=lambda point: line.excess(point, share))
        lowest = line.excess(points[0], share)
        branches[float(share)] = [
            point for point in points if line.excess(point, share) < lowest + 0.05
        ]
    return ends, branches


def _ends(
    landscape: _Landscape,
    ends: list[list[_Point]],
    branches: dict[float, list[_Point]],
    guides: Sequence[RealArray],
) -> list[_Point]:
    """Return both ends with all draws."""
    best = []
    nearest = [branches[min(branches)], branches[max(branches)]] if branches else [[], []]
    for row in range(2):
        starts = _distinct(_valleys(ends[row], row), 6, 0.3)
        starts += _distinct(nearest[row], 2, APART)
        starts += _at_share(guides, float(row))
        value_of = partial(_value_of, row=row)
        points = [landscape.descend(x, row, goal=1e-4, steps=25) for x in starts]
        first = min(points, key=value_of)
        for x in _mirrored(first.x):
            if abs(value_of(landscape.point(x)) - value_of(first)) > NO_INFLUENCE:
                points.append(landscape.descend(x, row, goal=1e-4, steps=25))
        first = min(points, key=value_of)
        best.append(landscape.descend(first.x, row, goal=1e-10, steps=60))
    return best


def _mirrored(x: RealArray) -> RealArray:
    """Return a scaled design (k,) with each of its variables at the bound that is farther, (k, k).

    Basins of an end lie at other bounds of one or two variables, and which is the deepest depends
    on the draws.
    """
    farther = np.where(x < 0.5, 1.0, 0.0)
    return np.where(np.eye(x.size, dtype=bool), farther, x)


def _valleys(points: Sequence[_Point], row: int) -> list[_Point]:
    """Return the first of points, sorted by an objective, that are equal in it.

    What an objective hardly depends on leaves a valley, whose designs lie far apart.
    """
    kept = list(points[:1])
    for point in points[1:]:
        if _value_of(point, row=row) - _value_of(kept[-1], row=row) > VALLEY:
            kept.append(point)
    return kept


def _value_of(point: _Point, *, row: int) -> float:
    """Return an objective of a point, with what it misses limits by."""
    return float(point.value[row]) + point.penalty


class _Net:
    """Points on the front, by their share of the line between its ends."""

    def __init__(self, landscape: _Landscape, ends: Sequence[_Point]) -> None:
        self.landscape = landscape
        self.line = _Line(ends[0].value, ends[1].value)
        self.points = {0.0: ends[0], 1.0: ends[1]}
        self.reached: dict[float, float] = {}

    def solve(self, share: float, starts: Sequence[_Point]) -> float:
        """Bring the point of a target down from several starts, the lowest first.

        Starts of the branch that was reached already are left out.

        - returns: share of the box that a descent from the lowest start gains [1].
        """
        target, box = self.line.target(share), self.line.box
        excess = partial(self.line.excess, share=share)
        starts = sorted(starts, key=excess)
        for start in starts:
            if share in self.points and _distance(start, self.points[share]) < APART:
                continue
            point = self.landscape.reach(start.x, target, box, goal=FINE, steps=40)
            if excess(point) < self.reached.get(share, np.inf) - 1e-9:
                self.points[share], self.reached[share] = point, excess(point)
        return excess(starts[0]) - self.reached[share]

    def _loss(self, left: float, right: float) -> float:
        """Hypervolume that the staircase between two neighbours may lose, share of the box [1]."""
        gap = np.abs(self.points[left].value - self.points[right].value) / self.line.box
        return float(0.5 * gap.prod())

    def refine(self) -> None:
        """Halve the interval that loses most, until the net loses little or long enough."""
        shares = sorted(self.points)
        heap = [(-self._loss(left, right), left, right) for left, right in pairwise(shares)]
        heapq.heapify(heap)
        total, left_over = -sum(loss for loss, *_ in heap), REFINEMENTS
        while heap and left_over and total > ENOUGH:
            loss, left, right = heapq.heappop(heap)
            total += loss
            if right - left < 5e-4:
                continue
            middle = 0.5 * (left + right)
            on_one_branch = self._on_one_branch(left, right)
            gain = self.solve(middle, self._starts(left, right, middle))
            left_over -= 1
            if on_one_branch and gain < STRAIGHT:
                continue
            for part in ((left, middle), (middle, right)):
                heapq.heappush(heap, (-self._loss(*part), *part))
                total += self._loss(*part)

    def _on_one_branch(self, left: float, right: float) -> bool:
        return _distance(self.points[left], self.points[right]) < SAME

    def _starts(self, left: float, right: float, middle: float) -> list[_Point]:
        """Return where the descents to a new target begin: between, or on both branches."""
        first, second = self.points[left], self.points[right]
        values = np.array(self.landscape.values)
        excess = np.max((values - self.line.target(middle)) / self.line.box, axis=1)
        excess += BEYOND * np.maximum(self.landscape.beyond, 0.0)
        lowest = int(excess.argmin())
        nearest = self.landscape.evaluated(lowest)
        if not self._on_one_branch(left, right):
            return [first, second, nearest]
        between = self.landscape.point(0.5 * (first.x + second.x))
        is_lower = excess[lowest] < self.line.excess(between, middle)
        return [between, nearest] if is_lower else [between]

    def lines(self) -> list[RealArray]:
        """Return scaled designs on the lines between neighbours of one branch, each (n, k).

        Where the staircase loses more there are more of them: for a given number together they
        lose least if each part has the same loss, which falls with the square of its length.
        """
        pairs = [pair for pair in pairwise(sorted(self.points)) if self._on_one_branch(*pair)]
        lengths = np.sqrt([self._loss(*pair) for pair in pairs])
        counts = np.ceil(LINES * lengths / max(lengths.sum(), 1e-300)).astype(int)
        between = []
        for (left, right), count in zip(pairs, counts, strict=True):
            first, second = self.points[left].x, self.points[right].x
            parts = (np.arange(count) + 1.0) / (count + 1.0)
            between.append(first + parts[:, np.newaxis] * (second - first))
        return between


def _distance(first: _Point, second: _Point) -> float:
    return float(np.linalg.norm(first.x - second.x))


def _distinct(points: Sequence[_Point], n: int, apart: float) -> list[RealArray]:
    """Return the scaled designs of the first n points that lie apart from each other."""
    xs: list[RealArray] = []
    for point in points:
        if all(np.linalg.norm(point.x - x) > apart for x in xs):
            xs.append(point.x)
        if len(xs) == n:
            break
    return xs
