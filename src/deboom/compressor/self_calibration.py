"""Compressor and placement errors together, out of the raw FRFs: self-calibration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.placement import Placement

if TYPE_CHECKING:
    from deboom.compressor.model import CompressorModel
    from deboom.compressor.parametrisation import Parametrisation
    from deboom.compressor.raw_inertance import RawInertance
    from deboom.measurement.placement_tolerances import PlacementTolerances


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the parameters before the hammer test.

    Parameters
    ----------
    values : array, shape (n_parameters,)
        Expected values.
    deviations : array, shape (n_parameters,)
        1 σ; infinite where nothing is known.
    """

    values: RealArray
    deviations: RealArray


@dataclass(frozen=True)
class WeighedMass:
    """Mass of the compressor from a pair of scales.

    Parameters
    ----------
    mass, deviation : float
        With its standard deviation [kg].
    """

    mass: float
    deviation: float


@dataclass(frozen=True, eq=False)
class SelfCalibration:
    """Compressor and placement that agree best with the raw FRFs and with what was known before.

    Parameters
    ----------
    parametrisation : Parametrisation
        What `values` mean.
    values : array, shape (n_parameters,)
        Most probable parameters.
    placement : Placement
        What `errors` mean.
    errors : array, shape (n_errors,)
        Most probable placement errors.
    covariance : array, shape (n_parameters + n_errors, n_parameters + n_errors)
        Posterior, linearised at the solution.
    reduced_chi : float
        Root mean square of the residuals in units of their noise; 1 where the model and the noise
        explain the measurement, above 1.5 an alarm [1].
    residuals : array, shape (n_frequency, n_channel, n_impact)
        Complex, in units of the noise of one part [1].
    n_evaluations : int
        Of the residuals.
    converged : bool
        False where the optimiser stopped for its number of evaluations.
    """

    parametrisation: Parametrisation
    values: RealArray
    placement: Placement
    errors: RealArray
    covariance: RealArray
    reduced_chi: float
    residuals: ComplexArray
    n_evaluations: int
    converged: bool

    @property
    def model(self) -> CompressorModel:
        """The compressor that was found."""
        return self.parametrisation.model(self.values)

    @property
    def parameter_covariance(self) -> RealArray:
        """Of the parameters alone, placement errors integrated out."""
        n = self.values.size
        return self.covariance[:n, :n]

    def at_virtual_point(self, frf: ComplexArray) -> ComplexArray:
        """Inertance at the virtual point by the placement that was found.

        Parameters
        ----------
        frf : array, shape (n_frequency, n_channel, n_impact)
            Raw, of the sensors and impacts of `placement` [1/kg].

        Returns
        -------
        array, shape (n_frequency, 6, 6)
            [1/kg, 1/(kg m), 1/(kg m²)].
        """
        response = np.linalg.pinv(self.placement.response_matrix(self.errors))
        excitation = np.linalg.pinv(self.placement.excitation_matrix(self.errors))
        return np.asarray(response @ frf @ excitation.T)


def self_calibrate(
    parametrisation: Parametrisation,
    raw: RawInertance,
    tolerances: PlacementTolerances,
    start: RealArray,
    *,
    weighed: WeighedMass | None = None,
    prior: Prior | None = None,
    largest_evaluations: int = 60,
) -> SelfCalibration:
    """Find the most probable parameters and placement errors.

    Parameters
    ----------
    parametrisation : Parametrisation
    raw : RawInertance
        Lines of the fit only.
    tolerances : PlacementTolerances
        1 σ of the errors; their expected value is 0.
    start : array, shape (n_parameters,)
        Such as a fit at the virtual point.
    weighed : WeighedMass, optional
        Without it the hammer's gain is the only scale.
    prior : Prior, optional
        Of the parameters.
    largest_evaluations : int

    Returns
    -------
    SelfCalibration

    Notes
    -----
    Model ``Y = V(q) H(θ) U(q)ᵀ`` for a rigid, reciprocal body. Maximum of the posterior by
    `scipy.optimize.least_squares` on the compressed problem: ``R`` with ``Rᵀ R = Jᵀ J`` and
    ``R⁻ᵀ Jᵀ r`` have the cost, the gradient and the Gauss-Newton matrix of the full residuals, at a
    hundredth of their number. Check `reduced_chi` before trusting the result.
    """
    from scipy.optimize import least_squares

    problem = _Problem(parametrisation, raw, tolerances, weighed, prior)
    first = np.concatenate([start, np.zeros(problem.errors_deviation.size)])
    latest: dict[bytes, tuple[RealArray, RealArray]] = {}

    def at(values: RealArray) -> tuple[RealArray, RealArray]:
        # the optimiser asks for residuals and Jacobian of one point by turns: both cost one visit
        key = values.tobytes()
        if key not in latest:
            latest.clear()
            latest[key] = problem.compressed(values)
        return latest[key]

    def residuals_at(values: RealArray) -> RealArray:
        return at(values)[0]

    def jacobian_at(values: RealArray) -> RealArray:
        return at(values)[1]

    scale = np.concatenate([problem.parameter_scale(first), problem.errors_deviation])
    result = least_squares(
        residuals_at,
        first,
        jac=jacobian_at,
        method="trf",
        x_scale=scale,
        max_nfev=largest_evaluations,
        xtol=1e-9,
        ftol=1e-9,
        gtol=1e-6,
    )
    n = start.size
    residuals = problem.residuals(result.x)
    normal, _, _ = problem.normal_equations(result.x)
    unit = 1 / np.sqrt(np.diag(normal))
    covariance = np.linalg.inv(normal * np.outer(unit, unit)) * np.outer(unit, unit)
    return SelfCalibration(
        parametrisation,
        result.x[:n],
        problem.placement,
        result.x[n:],
        covariance,
        float(np.sqrt(np.mean(np.abs(residuals) ** 2) / 2)),
        residuals,
        int(result.nfev),
        bool(result.status > 0),
    )


class _Problem:
    """Residuals and their derivatives; holds only what does not change from step to step."""

    def __init__(
        self,
        parametrisation: Parametrisation,
        raw: RawInertance,
        tolerances: PlacementTolerances,
        weighed: WeighedMass | None,
        prior: Prior | None,
    ) -> None:
        self.parametrisation = parametrisation
        self.raw = raw
        self.placement = Placement(raw.sensors, raw.impacts)
        self.errors_deviation = self.placement.deviations(tolerances)
        self.weighed = weighed
        self.prior = prior
        # noise of the hammer's signal is common to a column: whitened by a rank-one change
        column = raw.frf.values / raw.deviation
        size = np.linalg.norm(column, axis=1, keepdims=True)
        self.common = column / size
        self.shrink = 1 - 1 / np.sqrt(1 + (raw.force_deviation * size) ** 2)

    def residuals(self, unknowns: RealArray) -> ComplexArray:
        """Whitened deviations of the raw FRFs, shape (n_frequency, n_channel, n_impact)."""
        values, errors = np.split(unknowns, [len(self.parametrisation.names)])
        inertance = self.parametrisation.model(values).inertance(self.raw.frf.frequency)
        response = self.placement.response_matrix(errors)
        excitation = self.placement.excitation_matrix(errors)
        deviation = response @ inertance @ excitation.T - self.raw.frf.values
        return self._white(deviation)

    def compressed(self, unknowns: RealArray) -> tuple[RealArray, RealArray]:
        """Residuals and Jacobian of the compressed problem, one row more than unknowns."""
        normal, gradient, squares = self.normal_equations(unknowns)
        # scaled to a unit diagonal, so that the factor sees no units
        unit = np.sqrt(np.diag(normal))
        factor = np.linalg.cholesky(normal / np.outer(unit, unit)).T * unit
        projected = np.linalg.solve(factor.T, gradient)
        rest = np.sqrt(max(squares - float(projected @ projected), 0.0))
        return np.append(projected, rest), np.vstack([factor, np.zeros(unknowns.size)])

    def normal_equations(self, unknowns: RealArray) -> tuple[RealArray, RealArray, float]:
        """``Jᵀ J``, ``Jᵀ r`` and ``rᵀ r`` of residuals and priors."""
        residuals, jacobian = self.residuals(unknowns), self._jacobian(unknowns)
        rows = jacobian.reshape(jacobian.shape[0], -1).view(float)
        flat = residuals.reshape(-1).view(float)
        normal, gradient = rows @ rows.T, rows @ flat
        squares = float(flat @ flat)
        for deviations, slopes in self._priors(unknowns):
            normal += slopes.T @ slopes
            gradient += slopes.T @ deviations
            squares += float(deviations @ deviations)
        return normal, gradient, squares

    def parameter_scale(self, unknowns: RealArray) -> RealArray:
        """Step at which each parameter alone changes the cost by one."""
        normal, _, _ = self.normal_equations(unknowns)
        n = len(self.parametrisation.names)
        return np.asarray(1 / np.sqrt(np.diag(normal)[:n]))

    def _jacobian(self, unknowns: RealArray) -> ComplexArray:
        """Whitened, shape (n_unknowns, n_frequency, n_channel, n_impact)."""
        values, errors = np.split(unknowns, [len(self.parametrisation.names)])
        lines = self.raw.frf.frequency
        inertance = self.parametrisation.model(values).inertance(lines)
        response = self.placement.response_matrix(errors)
        excitation = self.placement.excitation_matrix(errors)
        by_mass = self.parametrisation.sensitivities(values, lines)
        seen, pushed = response @ inertance, inertance @ excitation.T
        n_values, n_lines = by_mass.shape[:2]
        by_response = self.placement.response_derivatives(errors)
        by_excitation = self.placement.excitation_derivatives(errors)
        jacobian = np.empty(
            (n_values + len(errors), n_lines, response.shape[0], excitation.shape[0]), complex
        )
        np.matmul(-(seen @ by_mass), pushed, out=jacobian[:n_values])
        split = n_values + by_response.shape[0]
        np.matmul(by_response[:, np.newaxis], pushed, out=jacobian[n_values:split])
        transposed = np.swapaxes(by_excitation, -1, -2)[:, np.newaxis]
        np.matmul(seen, transposed, out=jacobian[split:])
        return self._white(jacobian)

    def _white(self, deviation: ComplexArray) -> ComplexArray:
        """Divide by the noise, shape (..., n_frequency, n_channel, n_impact)."""
        scaled = deviation / self.raw.deviation
        along = np.sum(self.common.conj() * scaled, axis=-2, keepdims=True)
        return np.asarray(scaled - self.shrink * self.common * along)

    def _priors(self, unknowns: RealArray) -> list[tuple[RealArray, RealArray]]:
        """Deviations from what was known, and their derivatives, both in units of 1 σ."""
        n = len(self.parametrisation.names)
        values, errors = np.split(unknowns, [n])
        of_errors = np.zeros((errors.size, unknowns.size))
        of_errors[:, n:] = np.diag(1 / self.errors_deviation)
        rows = [(errors / self.errors_deviation, of_errors)]
        if self.prior is not None:
            slopes = np.zeros((n, unknowns.size))
            slopes[:, :n] = np.diag(1 / self.prior.deviations)
            rows.append(((values - self.prior.values) / self.prior.deviations, slopes))
        if self.weighed is not None:
            slope = np.zeros((1, unknowns.size))
            slope[0, :n] = self.parametrisation.mass_sensitivities(values)[:, 0, 0]
            mass = self.parametrisation.model(values).mass
            off = np.array([(mass - self.weighed.mass) / self.weighed.deviation])
            rows.append((off, slope / self.weighed.deviation))
        return rows
