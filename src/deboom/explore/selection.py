"""Choosing designs: named picks, their last steps by gradient, and indifference intervals.

Decisions on a front are pymoo's, whose import takes long and waits until one is asked for.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.descent import Gradients, gradients_of, objectives_and_gradients
from deboom.explore.robust import Robust, RobustEvaluation, RobustValues, chosen, joined
from deboom.explore.space import DesignSpace, Evaluate, responses

SMALLEST_GAIN = 1e-7
"""Gain of a step, as a share of today's sum of standard deviations, at which a pick rests [1]."""
STEP = 1e-4
"""Step of the central differences, as a share of the bounds [1]."""
KEPT_BY = 5e-3
"""Distance of a pick from what it must keep, as a share of the standard deviation [1]."""
OBJECTIVE = {Pick.best_mean: 0, Pick.none_louder: 0, Pick.sigma_kept: 0, Pick.best_sigma: 1}
"""Objective that a pick has least of: 0 the sum of means, 1 that of standard deviations."""

_Picked = TypeVar("_Picked")


class ByPick(dict[str, _Picked]):
    """What belongs to each pick; a `Pick` and its text are the same key.

    - raises InputError: on looking up a name that is no pick, or a pick that no design has.
    """

    def __missing__(self, name: str) -> _Picked:
        here = ", ".join(self)
        near = str(name).replace(" ", "-").replace("_", "-")
        if near in self:
            raise InputError(f"a pick is spelled '{near}', not '{name}'")
        if name in tuple(Pick):
            raise InputError(f"no design is '{name}', none is better than today's: take {here}")
        raise InputError(f"there is no pick '{name}': take {here}")


def pick(
    values: RobustValues,
    today: RobustValues | None = None,
    allowed: npt.NDArray[np.bool_] | None = None,
) -> ByPick[int]:
    """Return the rows of values, such as those of a front, that are a `Pick`.

    Best-mean has the smallest first objective; none-louder the same among designs in which no
    response is above today's, sigma-kept among those whose sum of sigma is not above today's
    either; best-sigma the smallest second objective.

    - `values`: at least one feasible row; a level and a sigma are its first two objectives.
    - `today`: today's design under the same draws, one row; without it only best-mean and
      best-sigma are picked.
    - `allowed` (n,), optional: which rows may be none-louder and sigma-kept besides, such as those
      without a louder booming peak.
    - returns: rows by name, of equals the better in the other of the two. None-louder and
      sigma-kept are missing where no design is better than today's.

    Raises
    ------
    InputError
        No feasible row, or a single objective.
    """
    rows = _feasible(values)
    if values.objectives.shape[1] < 2:
        raise InputError("picks belong to a level and a sigma, and there is one objective")
    every = np.ones(rows.size, dtype=bool)
    kept = {Pick.best_mean: every}
    if today is not None:
        quieter = values.objectives[rows, 0] < today.objectives[0, 0]
        quieter &= np.all(values.mean[rows] <= today.mean[0], axis=1)
        quieter &= True if allowed is None else allowed[rows]
        tight = quieter & (values.sigma_sum[rows] <= today.sigma_sum[0])
        kept |= {Pick.none_louder: quieter, Pick.sigma_kept: tight}
    kept[Pick.best_sigma] = every
    row_of_pick: ByPick[int] = ByPick()
    for name, among in kept.items():
        if among.any():
            left = rows[among]
            least, then = OBJECTIVE[name], 1 - OBJECTIVE[name]
            objectives = values.objectives[left]
            row_of_pick[name] = int(
                left[np.lexsort((objectives[:, then], objectives[:, least]))[0]]
            )
    return row_of_pick


def _feasible(values: RobustValues) -> npt.NDArray[np.intp]:
    """Return the rows that may be picked, at least one."""
    rows = np.flatnonzero(values.feasible)
    if rows.size == 0 and not values.failed.all():
        raise InputError(
            "no design of this front keeps all limits under these draws: there is nothing to pick; "
            "ease a limit, or search with more draws"
        )
    if rows.size == 0:
        raise InputError("no design of this front could be computed: there is nothing to pick")
    return rows


NONE_WORSE, NEAREST = "none-worse", "nearest-to-ideal"
"""Picks of any objectives: no objective is above today's, and the nearest to the best of each."""


def pick_of_any(
    values: RobustValues, names: Mapping[int, str], today: RobustValues | None = None
) -> ByPick[int]:
    """Return the rows of values that are the best of each objective, and two compromises.

    - `values`: at least one feasible row.
    - `names`: of the objectives whose best is a pick, by their column.
    - `today`: today's design under the same draws, one row.
    - returns: ``best-<name>`` of each; ``none-worse``, the nearest to the ideal point of those in
      which no objective is above today's, if there is one; ``nearest-to-ideal``. Distances are in
      the box of the rows.
    - raises InputError: no feasible row.
    """
    rows = _feasible(values)
    objectives = values.objectives[rows]
    box = np.ptp(objectives, axis=0)
    scaled = (objectives - objectives.min(axis=0)) / np.where(box > 0.0, box, 1.0)
    distance = np.linalg.norm(scaled, axis=1)
    picks: ByPick[int] = ByPick()
    for column, name in names.items():
        best = np.lexsort((distance, objectives[:, column]))[0]
        picks[f"best-{name}"] = int(rows[best])
    if today is not None:
        kept = np.flatnonzero(np.all(objectives <= today.objectives[0], axis=1))
        if kept.size:
            picks[NONE_WORSE] = int(rows[kept[distance[kept].argmin()]])
    picks[NEAREST] = int(rows[distance.argmin()])
    return picks


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep pymoo's decisions from silencing all warnings, and from telling of an old import."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _scaled(values: RealArray) -> RealArray:
    """Return columns from 0, the best of a front, to 1."""
    span = np.ptp(values, axis=0)
    return np.asarray((values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0))


def nearest_to_ideal(values: RealArray) -> int:
    """Return the row of a front (n, m) that is nearest to the best of each column in its box."""
    return int(np.linalg.norm(_scaled(values), axis=1).argmin())


def knee(values: RealArray) -> int:
    """Return the row of a front (n, m) where a little of one column costs most of the others.

    Of several such rows, the nearest to the ideal (`pymoo.mcdm.high_tradeoff`; L. Rachmawati and D.
    Srinivasan, IEEE Transactions on Evolutionary Computation 13, 2009).

    - raises InputError: a front without a knee.
    """
    scaled, rows = _scaled(values), None
    if len(values) > 2:
        with _quiet(), np.errstate(all="ignore"):
            from pymoo.mcdm.high_tradeoff import HighTradeoffPoints

            rows = HighTradeoffPoints()(scaled)
    if rows is None or len(rows) == 0:
        raise InputError(
            "this front has no knee, no design where a little of one objective costs much more of "
            "another than elsewhere: take 'nearest'"
        )
    rows = np.sort(rows)
    return int(rows[nearest_to_ideal(scaled[rows])])


def nearest_to_reference(values: RealArray, reference: RealArray) -> int:
    """Return the row of a front (n, m) that misses a reference (m,) least, or beats it most.

    The worst column counts, each over its range on the front (`pymoo.decomposition.asf`; A. P.
    Wierzbicki, "The use of reference objectives in multiobjective optimization", 1980).
    """
    from pymoo.decomposition.asf import ASF

    span = np.ptp(values, axis=0)
    missed = ASF()(values, np.where(span > 0.0, span, 1.0), utopian_point=reference)
    return int(np.argmin(missed))


def nearest_to_weights(values: RealArray, weights: RealArray) -> int:
    """Return the row of a front (n, m) whose pseudo-weights are nearest to weights (m,).

    A design's pseudo-weight is its distance from the worst of a column, as a share of the sum over
    the columns (`pymoo.mcdm.pseudo_weights`; K. Deb, "Multi-objective optimization using
    evolutionary algorithms", 2001).
    """
    with _quiet():
        from pymoo.mcdm.pseudo_weights import PseudoWeights
    scaled = _scaled(values)
    rows = np.flatnonzero((scaled < 1.0).any(axis=1))  # the worst of all columns has no weights
    if len(np.unique(scaled[rows], axis=0)) == 1:
        return int(rows[0])
    ends = {"ideal": np.zeros(weights.size), "nadir": np.ones(weights.size)}
    return int(rows[PseudoWeights(weights / weights.sum(), **ends)(scaled[rows])])


def most_desirable(values: RealArray, desired: RealArray, unacceptable: RealArray) -> int:
    """Return the row of a front (n, m) with the largest geometric mean of desirabilities.

    A column's is 1 up to the desired value (m,), 0 from the unacceptable one (m,), and linear
    between them (G. Derringer and R. Suich, Journal of Quality Technology 12, 1980).

    - raises InputError: each design has an unacceptable value.
    """
    share = np.clip((unacceptable - values) / (unacceptable - desired), 0.0, 1.0)
    overall = share.prod(axis=1)
    if not overall.max() > 0.0:
        least = ", ".join(f"{value:.6g}" for value in values.min(axis=0))
        raise InputError(
            f"each design has a value that is not acceptable (the least of each are {least}): ease "
            "what is not"
        )
    return int(overall.argmax())


def variables_without_effect(evaluate: Evaluate, space: DesignSpace) -> tuple[str, ...]:
    """Return the variables that no response depends on ("no requirement").

    Their lower and upper bound give the same responses, bit for bit, at the nominal design and at
    two designs between the bounds. A weak variable is not among them: see `indifference_intervals`;
    nor is a whole number, which has no order: the parts between its bounds may differ.
    """
    pattern = np.where(np.arange(space.n_variables) % 2 == 0, 0.25, 0.75)
    span = space.upper - space.lower
    same = (span > 0.0) & ~space.integer  # what cannot move has not been shown to have no effect
    for base in (space.nominal, space.lower + pattern * span, space.upper - pattern * span):
        at_bound, base = [], np.where(space.integer, np.round(base), base)
        for bound in (space.lower, space.upper):
            designs = np.tile(base, (space.n_variables, 1))
            np.fill_diagonal(designs, bound)
            # one call per bound: both bounds of a variable sit in the same row of equal batches,
            # where a matrix product rounds alike
            at_bound.append(responses(evaluate, designs))
        same &= np.all(at_bound[0] == at_bound[1], axis=1)
    return tuple(name for name, alike in zip(space.names, same, strict=True) if alike)


def at_nominal(designs: RealArray, space: DesignSpace, variables: Sequence[str]) -> RealArray:
    """Return designs, shape (n, k), with the named variables back at their nominal values."""
    changed = space.checked(designs).copy()
    for name in variables:
        if name not in space.names:
            raise InputError(f"no design variable '{name}': there are {list(space.names)}")
        column = space.names.index(name)
        changed[:, column] = space.nominal[column]
    return changed


def indifference_intervals(
    robust: RobustEvaluation, design: RealArray, change: float, n_points: int = 21
) -> tuple[RealArray, RealArray]:
    """Return how far each variable may move alone before the mean moves noticeably.

    The lower and upper ends of the interval around the design have shape (k,) [units of the space].

    - `robust`: response such as `Robust`.
    - `design` (k,): pick within the bounds of the space [units of the space].
    - `change`: change of `mean_sum` per response that counts as noticeable [response unit].
    - `n_points`: values of each variable that are tried from bound to bound; ends between them are
      interpolated.
    - raises InputError: a design outside the bounds or one that fails; no positive change; fewer
      than 2 points.
    """
    space = robust.space
    base = space.checked(np.atleast_2d(design))[0]
    if np.any((base < space.lower) | (base > space.upper)):
        raise InputError("indifference intervals belong to a design within the bounds of its space")
    if not change > 0.0 or n_points < 2:
        raise InputError(
            f"an indifference of {change:g} over {n_points} points cannot be found: "
            "take a positive change and at least 2 points"
        )
    grid = np.linspace(space.lower, space.upper, n_points).T
    columns = np.arange(space.n_variables)
    scan = np.tile(base, (space.n_variables, n_points, 1))
    scan[columns, :, columns] = grid
    values = robust(np.vstack([base, scan.reshape(-1, space.n_variables)]))
    if values.failed[0]:
        raise InputError("the design whose indifference intervals are asked for fails itself")
    limit = change * values.mean.shape[1]
    moved = np.abs(values.mean_sum[1:] - values.mean_sum[0]).reshape(grid.shape)
    intervals = np.empty((space.n_variables, 2))
    for interval, start, points, movement in zip(intervals, base, grid, moved, strict=True):
        below, above = points < start, points > start
        interval[0] = _reach(start, points[below][::-1], movement[below][::-1], limit)
        interval[1] = _reach(start, points[above], movement[above], limit)
    return intervals[:, 0], intervals[:, 1]


def _reach(start: float, points: RealArray, moved: RealArray, limit: float) -> float:
    """How far along `points`, which lead away from `start`, `moved` stays below `limit`."""
    path = np.concatenate([[start], points])
    height = np.concatenate([[0.0], moved])
    beyond = np.flatnonzero(~(height < limit))  # a failed design, NaN, counts as beyond
    if beyond.size == 0:
        return float(path[-1])
    last, first = beyond[0] - 1, beyond[0]
    if np.isnan(height[first]):
        return float(path[last])
    fraction = (limit - height[last]) / (height[first] - height[last])
    return float(path[last] + fraction * (path[first] - path[last]))


def improved(robust: Robust, evaluated: RobustValues, today: RobustValues) -> RobustValues:
    """Search each `Pick` on from the best design that is known, by gradient.

    - `robust`: response of the search, smooth, whose designs share their draws; its first two
      objectives are the sums of means and sigmas.
    - `evaluated`: designs of the search.
    - `today`: today's design under the same draws, one row.
    - returns: the picks of the evaluated designs, of today's and of what they became.

    Sequential quadratic programming (SLSQP) within the bounds, along exact gradients
    where `deboom.explore.descent.gradients_of` says so, elsewhere by central differences under
    common draws. The constraints keep a distance of `KEPT_BY` of σ, which the draws of a
    verification may take.
    """
    goal = _Goal(replace(robust, objectives=robust.objectives[:2]), today)
    evaluations = [evaluated, today]
    for name in Pick:
        all_designs = joined(evaluations)
        start = all_designs.designs[pick(all_designs, today).get(name, len(evaluated))]
        evaluations.append(robust(goal.descend(name, start)[np.newaxis]))
    all_designs = joined(evaluations)
    return chosen(all_designs, sorted(set(pick(all_designs, today).values())))


class _Goal:
    """What a pick minimises and keeps, as functions of a place between the bounds, 0 to 1."""

    def __init__(self, robust: Robust, today: RobustValues) -> None:
        self.robust, self.today = robust, today
        self.exact = gradients_of(robust) is Gradients.exact
        self.lower, self.span = robust.space.lower, robust.space.upper - robust.space.lower
        self.scale = float(today.sigma_sum[0]) or 1.0
        self.evaluated: dict[bytes, tuple[RealArray, RealArray]] = {}

    def at(self, place: RealArray) -> tuple[RealArray, RealArray]:
        """Return mean sum, sigma sum and mean of each response over the scale, and gradients."""
        if place.tobytes() not in self.evaluated and self.exact:
            design = self.lower + place * self.span
            sums, slopes = objectives_and_gradients(self.robust, design, each_mean=True)
            gradient = np.ascontiguousarray(slopes * self.span / self.scale)
            self.evaluated = {place.tobytes(): (sums / self.scale, gradient)}
        if place.tobytes() not in self.evaluated:
            moves = STEP * np.eye(len(place))
            places = np.vstack([place, place + moves, place - moves])
            values = self.robust(self.lower + places * self.span)
            sums = np.column_stack([values.mean_sum, values.sigma_sum, values.mean]) / self.scale
            up, down = np.split(sums[1:], 2)
            # contiguous: SLSQP reads a strided row as if it were not
            gradient = np.ascontiguousarray(((up - down) / (2.0 * STEP)).T)
            self.evaluated = {place.tobytes(): (sums[0], gradient)}
        return self.evaluated[place.tobytes()]

    def descend(self, name: Pick, start: RealArray) -> RealArray:
        """Return the design where the search for one pick ends."""
        row = OBJECTIVE[name]
        limits = np.concatenate([self.today.sigma_sum, self.today.mean[0]])
        distance = KEPT_BY * np.concatenate([self.today.sigma_sum, self.today.sigma[0]])
        kept = (limits - distance) / self.scale
        first = {Pick.none_louder: 1, Pick.sigma_kept: 0}.get(name, len(kept))
        keep: dict[str, Any] = {
            "type": "ineq",
            "fun": lambda place: kept[first:] - self.at(place)[0][1 + first :],
            "jac": lambda place: -self.at(place)[1][1 + first :],
        }
        begin = (start - self.lower) / np.where(self.span > 0.0, self.span, 1.0)
        end = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
            lambda place: self.at(place)[0][row],
            begin,
            jac=lambda place: self.at(place)[1][row],
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(start),
            constraints=[keep] if first < len(kept) else [],
            options={"maxiter": 40, "ftol": SMALLEST_GAIN},
        )
        place = end.x if np.isfinite(end.fun) else begin
        return np.asarray(self.lower + np.clip(place, 0.0, 1.0) * self.span)
