"""Choosing from a front: named picks, indifference intervals, and the last steps by gradient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.optimize import minimize

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM
from deboom.explore.robust import Robust, RobustResponse, RobustValues
from deboom.explore.scatter import ToleranceSample
from deboom.explore.space import DesignSpace, Evaluate, check_gradient, responses

_SMALLEST_GAIN = 1e-9  # of the sum of standard deviations, at which a polish ends


@dataclass(frozen=True)
class Picks:
    """Rows of a front that have a name.

    - `best_mean`, `best_sigma`: smallest `mean_sum` and smallest `sigma_sum`; of equals the better
      in the other objective.
    - `knee`: row where a little of one objective costs most of the other, see `pick`.
    """

    best_mean: int
    best_sigma: int
    knee: int


def pick(values: RobustValues) -> Picks:
    """Return the named rows of a front, or of a front evaluated again; failed rows do not count.

    Raises
    ------
    InputError
        No row that could be computed, or another number of objectives than two.

    Notes
    -----
    The knee is the row farthest from the chord between best mean and best sigma, on the side of the
    ideal point, after both objectives are scaled to run from 0 to 1 along the chord (I. Das, "On
    characterizing the 'knee' of the Pareto curve", Structural Optimization 18, 1999). A front
    without any row on that side has its knee at best mean.
    """
    rows = np.flatnonzero(~values.failed)
    if rows.size == 0:
        raise InputError("no design of this front could be computed: there is nothing to pick")
    if values.objectives.shape[1] != 2:
        raise InputError(
            f"best mean, best sigma and knee belong to two objectives, not to "
            f"{values.objectives.shape[1]}: choose a row by its objectives"
        )
    mean, sigma = values.objectives[rows].T
    best_mean = np.lexsort((sigma, mean))[0]
    best_sigma = np.lexsort((mean, sigma))[0]
    mean_span = mean[best_sigma] - mean[best_mean]
    sigma_span = sigma[best_mean] - sigma[best_sigma]
    knee = best_mean
    if mean_span > 0.0 and sigma_span > 0.0:
        along_mean = (mean - mean[best_mean]) / mean_span
        along_sigma = (sigma - sigma[best_sigma]) / sigma_span
        depth = 1.0 - along_mean - along_sigma
        depth[best_mean] = 0.0
        knee = np.argmax(depth) if depth.max() > 0.0 else best_mean
    return Picks(*(int(rows[row]) for row in (best_mean, best_sigma, knee)))


def variables_without_effect(evaluate: Evaluate, space: DesignSpace) -> tuple[str, ...]:
    """Return the variables that no response depends on ("no requirement").

    Their lower and upper bound give the same responses, bit for bit, at the nominal design and at
    two designs between the bounds. A weak variable is not among them: see `indifference_intervals`.
    """
    pattern = np.where(np.arange(space.n_variables) % 2 == 0, 0.25, 0.75)
    span = space.upper - space.lower
    same = span > 0.0  # what cannot move has not been shown to have no effect
    for base in (space.nominal, space.lower + pattern * span, space.upper - pattern * span):
        at_bound = []
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
    robust: Robust, design: RealArray, change: float, n_points: int = 21
) -> tuple[RealArray, RealArray]:
    """Return how far each variable may move alone before the mean moves noticeably.

    The lower and upper ends of the interval around the design have shape (k,) [units of the space].

    - `robust`: response such as `RobustResponse`.
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


def polish(
    robust: RobustResponse, front: RobustValues, rows: Sequence[int], steps: int = 30
) -> RobustValues:
    """Improve some rows of a front by gradient: less mean at no more sigma.

    - `robust`: response of the search, of a model with a gradient (`Differentiable`).
    - `front`: front of the search.
    - `rows`, `steps`: designs to improve, and the largest number of steps of each.
    - returns: one row per design, never dominated by where it came from.
    - raises InputError: a model without gradient, other objectives than the sums of means and of
      standard deviations, draws that the designs do not share, or a design that fails.

    The ε-constraint method: minimise ``mean_sum`` within ``sigma_sum ≤ sigma_sum(start)`` and the
    bounds, by sequential quadratic programming (SLSQP). Mean and variance of the draws are a linear
    and a quadratic form of the responses, so that their derivatives follow from the model's.
    """
    check_gradient(
        robust.evaluate, "designs can be polished only with one, search more generations instead"
    )
    if robust.objectives != (MEAN_SUM, SIGMA_SUM):
        raise InputError(
            "designs are polished for the sums of means and standard deviations, not for "
            f"{[objective.name for objective in robust.objectives]}"
        )
    if not isinstance(robust.sample, ToleranceSample):
        raise InputError("designs are polished with draws that they share: take sobol_sample")
    chosen = np.asarray(rows, dtype=int)
    if chosen.size == 0 or np.any(front.failed[chosen]):
        raise InputError("choose at least one design to polish, and none that fails")
    polished = robust(np.array([_descend(robust, front.designs[row], steps) for row in chosen]))
    worse = polished.failed | np.all(polished.objectives >= front.objectives[chosen], axis=1)
    columns = {}
    for column in fields(RobustValues):
        new, old = getattr(polished, column.name), getattr(front, column.name)[chosen]
        columns[column.name] = np.where(worse.reshape(-1, *[1] * (new.ndim - 1)), old, new)
    return RobustValues(**columns)


def sums_and_gradient(robust: RobustResponse, design: RealArray) -> tuple[RealArray, RealArray]:
    """Return mean and sigma sum, shape (2,), and their derivatives, shape (2, k), of one design."""
    model: Any = robust.evaluate
    made, values = robust.made_responses(design)
    estimator = robust.prepared(design)
    mean, sigma = estimator.moments(values)[:2]
    mean_weight, sigma_weight = estimator.derivatives(values, sigma)
    # a made design is x (1 + scatter)
    by_variable = model.gradient(made) * (made / design)[:, None, :]
    mean_gradient = np.einsum("t,trk->k", mean_weight, by_variable)
    if robust.nominal_mean:
        mean = responses(model, design[None, :])[0]
        mean_gradient = model.gradient(design[None, :])[0].sum(axis=0)
    sigma_gradient = np.einsum("tr,trk->k", sigma_weight, by_variable)
    return np.array([mean.sum(), sigma.sum()]), np.array([mean_gradient, sigma_gradient])


def _descend(robust: RobustResponse, start: RealArray, steps: int) -> RealArray:
    """Where SLSQP ends, in variables that run from 0 to 1 between their bounds."""
    lower, upper = robust.space.lower, robust.space.upper
    span = upper - lower
    known: dict[bytes, tuple[RealArray, RealArray]] = {}

    def at(place: RealArray) -> tuple[RealArray, RealArray]:
        key = place.tobytes()
        if key not in known:
            known.clear()
            known[key] = sums_and_gradient(robust, lower + place * span)
        return known[key]

    first = (start - lower) / np.where(span > 0.0, span, 1.0)
    limit = at(first)[0][1]
    scale = limit or 1.0
    no_more_sigma = {
        "type": "ineq",
        "fun": lambda place: (limit - at(place)[0][1]) / scale,
        "jac": lambda place: -at(place)[1][1] * span / scale,
    }
    end = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
        lambda place: at(place)[0][0] / scale,
        first,
        jac=lambda place: at(place)[1][0] * span / scale,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * len(start),
        constraints=no_more_sigma,
        options={"maxiter": steps, "ftol": _SMALLEST_GAIN},
    )
    return np.asarray(np.clip(lower + end.x * span, lower, upper))
