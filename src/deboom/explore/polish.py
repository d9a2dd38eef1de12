"""The last steps to the front by gradient, where the model offers one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Protocol

import numpy as np
from scipy.optimize import minimize

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.evaluate import Evaluate, responses
from deboom.explore.moments import moment_weights
from deboom.explore.objectives import MEAN_SUM, SIGMA_SUM
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.tolerance_samples import ToleranceSample

SMALLEST_GAIN = 1e-9
"""Steps end when they gain less than this part of the sum of standard deviations [1]."""


class Differentiable(Evaluate, Protocol):
    """An evaluation with exact derivatives."""

    def gradient(self, designs: RealArray) -> RealArray:
        """Return the derivatives of the responses by the variables, shape (n, r, k)."""


def polish(
    robust: RobustResponse, front: RobustValues, rows: Sequence[int], steps: int = 30
) -> RobustValues:
    """Improve designs: less mean at no more sigma.

    Parameters
    ----------
    robust : RobustResponse
        Of the search, of a model with a gradient (`Differentiable`).
    front : RobustValues
        Of the search.
    rows : sequence of int
        Which designs to improve.
    steps : int
        Largest number of steps per design. Each costs about one evaluation with its gradient.

    Returns
    -------
    RobustValues
        One row per design, never dominated by where it came from; ``pareto_front(front,
        polished)`` joins both.

    Raises
    ------
    InputError
        A model without gradient, other objectives than the sums of means and of standard
        deviations, draws that the designs do not share, or a design that fails.

    Notes
    -----
    The ε-constraint method: minimise ``mean_sum`` within ``sigma_sum ≤ sigma_sum(start)`` and the
    bounds, by sequential quadratic programming (SLSQP). Mean and variance of the draws are a linear
    and a quadratic form of the responses, so that their derivatives follow from the model's.
    """
    _check(robust, front, rows)
    designs = [_descend(robust, front.designs[row], steps) for row in rows]
    return _better(robust(np.array(designs)), front, rows)


def sums_and_gradient(robust: RobustResponse, design: RealArray) -> tuple[RealArray, RealArray]:
    """Return mean and sigma sum, shape (2,), and their derivatives, shape (2, k), of one design.

    Raises
    ------
    InputError
        A design that fails.
    """
    normals = robust.sample.normals(design)
    made = robust.made(design)
    values = responses(robust.evaluate, made)
    if not np.all(np.isfinite(values)):
        raise InputError("a design on the way of a polish fails: leave its row out")
    moments = robust.estimator(normals)
    mean, sigma = moments(values)[:2]
    mean_weight, sigma_weight = moment_weights(moments, values, sigma)
    # a made design is x (1 + scatter)
    by_variable = _gradient_of(robust, made) * (made / design)[:, None, :]
    mean_gradient = np.einsum("t,trk->k", mean_weight, by_variable)
    if robust.nominal_mean:
        mean = responses(robust.evaluate, design[None, :])[0]
        mean_gradient = _gradient_of(robust, design[None, :])[0].sum(axis=0)
    sigma_gradient = np.einsum("tr,trk->k", sigma_weight, by_variable)
    return np.array([mean.sum(), sigma.sum()]), np.array([mean_gradient, sigma_gradient])


def _descend(robust: RobustResponse, start: RealArray, steps: int) -> RealArray:
    """Return where SLSQP ends, in variables that run from 0 to 1 between their bounds."""
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
    found = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
        lambda place: at(place)[0][0] / scale,
        first,
        jac=lambda place: at(place)[1][0] * span / scale,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * len(start),
        constraints=no_more_sigma,
        options={"maxiter": steps, "ftol": SMALLEST_GAIN},
    )
    return np.asarray(np.clip(lower + found.x * span, lower, upper))


def _better(found: RobustValues, front: RobustValues, rows: Sequence[int]) -> RobustValues:
    """Return what was found where it is not dominated by its start, and the start elsewhere."""
    keep = np.asarray(rows, dtype=int)
    worse = found.failed | (np.all(found.objectives >= front.objectives[keep], axis=1))
    columns = {}
    for column in fields(RobustValues):
        new, old = getattr(found, column.name), getattr(front, column.name)[keep]
        columns[column.name] = np.where(worse.reshape(-1, *[1] * (new.ndim - 1)), old, new)
    return RobustValues(**columns)


def _gradient_of(robust: RobustResponse, designs: RealArray) -> RealArray:
    gradient: RealArray = robust.evaluate.gradient(designs)  # type: ignore[attr-defined]
    return gradient


def _check(robust: RobustResponse, front: RobustValues, rows: Sequence[int]) -> None:
    if not hasattr(robust.evaluate, "gradient"):
        raise InputError(
            f"{type(robust.evaluate).__name__} offers no gradient: designs can be polished only "
            "with one, search for more generations instead"
        )
    if robust.objectives != (MEAN_SUM, SIGMA_SUM):
        raise InputError(
            "designs are polished for the sums of means and standard deviations, not for "
            f"{[objective.name for objective in robust.objectives]}"
        )
    if not isinstance(robust.sample, ToleranceSample):
        raise InputError("designs are polished with draws that they share: take sobol_sample")
    if len(rows) == 0 or np.any(front.failed[np.asarray(rows, dtype=int)]):
        raise InputError("choose at least one design to polish, and none that fails")
