"""Fit of a parametrised compressor to measured inertance at its virtual point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

if TYPE_CHECKING:
    from deboom.compressor.model import CompressorModel
    from deboom.compressor.objectives import Objective
    from deboom.compressor.parametrisation import Parametrisation

AT_BOUND = 1e-3
"""A parameter this near its bound, relative to the width of its bounds, counts as held by it."""


class Bounds(NamedTuple):
    """Smallest and largest value of each parameter, shape (n_parameters,) each."""

    lower: RealArray
    upper: RealArray


@dataclass(frozen=True, eq=False)
class PointFit:
    """Result of a fit at the virtual point.

    Parameters
    ----------
    parametrisation : Parametrisation
        What `values` mean.
    values : array, shape (n_parameters,)
        Of the units of the parametrisation.
    cost : float
        Half the sum of the squared residuals [1].
    jacobian : array, shape (n_residuals, n_parameters)
        Of the real residuals at `values`.
    n_residuals : int
        Real numbers fitted.
    n_evaluations : int
        Of the residuals.
    at_bound : tuple of str
        Names of the parameters that a bound holds.
    converged : bool
        False where the optimiser stopped for its number of evaluations.
    """

    parametrisation: Parametrisation
    values: RealArray
    cost: float
    jacobian: RealArray
    n_residuals: int
    n_evaluations: int
    at_bound: tuple[str, ...]
    converged: bool

    @property
    def model(self) -> CompressorModel:
        """The compressor that was found."""
        return self.parametrisation.model(self.values)


def fit_at_virtual_point(
    parametrisation: Parametrisation,
    objective: Objective,
    start: RealArray,
    bounds: Bounds | None = None,
    largest_evaluations: int = 200,
) -> PointFit:
    """Fit by nonlinear least squares with the analytic Jacobian.

    Parameters
    ----------
    parametrisation : Parametrisation
    objective : Objective
    start : array, shape (n_parameters,)
        Inside the bounds.
    bounds : Bounds, optional
        Without them the parameters are free.
    largest_evaluations : int
        Of the residuals.

    Returns
    -------
    PointFit

    Raises
    ------
    InputError
        A start outside its bounds.
    """
    from scipy.optimize import least_squares

    if bounds is None:
        bounds = Bounds(np.full(start.shape, -np.inf), np.full(start.shape, np.inf))
    outside = (start < bounds.lower) | (start > bounds.upper)
    if outside.any():
        name = parametrisation.names[int(np.flatnonzero(outside)[0])]
        raise InputError(f"the start value of {name} lies outside its bounds")
    residuals, jacobian = _functions(parametrisation, objective)
    width = bounds.upper - bounds.lower
    scale: RealArray | Literal["jac"] = width / 2 if np.isfinite(width).all() else "jac"
    result = least_squares(
        residuals,
        start,
        jac=jacobian,
        bounds=(bounds.lower, bounds.upper),
        x_scale=scale,
        method="trf",
        max_nfev=largest_evaluations,
        xtol=1e-8,
        ftol=1e-8,
        gtol=1e-8,
    )
    return PointFit(
        parametrisation,
        result.x,
        float(result.cost),
        np.asarray(result.jac),
        int(result.fun.size),
        int(result.nfev),
        _names_at_bound(parametrisation, result.x, bounds),
        bool(result.status > 0),
    )


def fit_by_slsqp(
    parametrisation: Parametrisation,
    objective: Objective,
    start: RealArray,
    bounds: Bounds,
    largest_iterations: int = 300,
) -> PointFit:
    """Fit by sequential quadratic programming, near to the spreadsheet's GRG method of the thesis.

    Parameters
    ----------
    parametrisation, objective, start, bounds
        As `fit_at_virtual_point`.
    largest_iterations : int

    Returns
    -------
    PointFit

    Notes
    -----
    A reference only: it needs several times more evaluations than least squares, because it sees
    the sum of the squares instead of each residual.
    """
    from scipy.optimize import minimize

    residuals, jacobian = _functions(parametrisation, objective)
    middle, half = (bounds.upper + bounds.lower) / 2, (bounds.upper - bounds.lower) / 2

    def cost(scaled: RealArray) -> tuple[float, RealArray]:
        values = middle + half * scaled
        deviation = residuals(values)
        return 0.5 * float(deviation @ deviation), half * (jacobian(values).T @ deviation)

    result = minimize(
        cost,
        (start - middle) / half,
        jac=True,
        bounds=[(-1.0, 1.0)] * start.size,
        method="SLSQP",
        options={"maxiter": largest_iterations, "ftol": 1e-9},
    )
    values = middle + half * result.x
    final = jacobian(values)
    return PointFit(
        parametrisation,
        values,
        float(result.fun),
        final,
        final.shape[0],
        int(result.nfev),
        _names_at_bound(parametrisation, values, bounds),
        bool(result.success),
    )


def _functions(
    parametrisation: Parametrisation, objective: Objective
) -> tuple[Callable[[RealArray], RealArray], Callable[[RealArray], RealArray]]:
    """Real residuals and their Jacobian as functions of the parameters."""

    def residuals(values: RealArray) -> RealArray:
        apparent = parametrisation.model(values).apparent_mass(objective.frequency)
        return _real(objective.residuals(apparent, np.asarray(np.linalg.inv(apparent))))

    def jacobian(values: RealArray) -> RealArray:
        inertance = parametrisation.model(values).inertance(objective.frequency)
        by_mass = parametrisation.sensitivities(values, objective.frequency)
        by_inertance = -(inertance @ by_mass @ inertance)
        weighed = objective.derivatives(by_mass, by_inertance)
        return np.stack([_real(one) for one in weighed], axis=1)

    return residuals, jacobian


def _real(values: ComplexArray) -> RealArray:
    """Real over imaginary parts of all entries."""
    return np.concatenate([values.real.ravel(), values.imag.ravel()])


def _names_at_bound(
    parametrisation: Parametrisation, values: RealArray, bounds: Bounds
) -> tuple[str, ...]:
    width = bounds.upper - bounds.lower
    near = np.minimum(values - bounds.lower, bounds.upper - values) < AT_BOUND * width
    held = near & np.isfinite(width)
    return tuple(name for name, at in zip(parametrisation.names, held, strict=True) if at)
