"""Self-calibration of a hammer test: compressor and placement errors out of the raw FRFs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked, derivatives
from deboom.compressor.model import CompressorModel
from deboom.compressor.parameters import Parametrisation
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import InertanceTest
from deboom.measurement.electric_car import tangents
from deboom.measurement.sensors import SENSOR_AXES, Impact, PlacementTolerances, Sensor
from deboom.physics.rigid_body import rotation_matrix, skew

SMOOTHING_LINES = 9
"""Lines over which the noise of a few hits is averaged: one line alone knows it to ±30 %."""
STEP = 1e-3
"""Of differences by gains, places and angles [1, m, rad]."""


@dataclass(frozen=True, eq=False)
class Placement:
    """Sensors and impacts as they may really be: gains, positions and angles off the sheet.

    Per sensor three gains, three offsets and three angles about its own axes; one gain of the
    hammer; per impact two offsets across its direction and two tilts: 9 n + 1 + 4 m unknowns.
    """

    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each unknown."""
        per_sensor = [
            f"{sensor.name} {what} {axis}"
            for what in ("gain", "position", "angle")
            for sensor in self.sensors
            for axis in SENSOR_AXES
        ]
        per_impact = [
            f"{impact.name} {what} {number}"
            for what in ("position", "angle")
            for impact in self.impacts
            for number in (1, 2)
        ]
        return (*per_sensor, "hammer gain", *per_impact)

    def deviations(self, tolerances: PlacementTolerances) -> RealArray:
        """State how well each unknown is known before, 1 σ, shape (9 n + 1 + 4 m,)."""
        tolerance_of_kind = [
            (3 * len(self.sensors), tolerances.sensor_gain),
            (3 * len(self.sensors), tolerances.sensor_position),
            (3 * len(self.sensors), tolerances.sensor_angle),
            (1, tolerances.hammer_gain),
            (2 * len(self.impacts), tolerances.impact_position),
            (2 * len(self.impacts), tolerances.impact_angle),
        ]
        return np.concatenate([np.full(*each) for each in tolerance_of_kind])

    def response_matrix(self, errors: RealArray) -> RealArray:
        """Compute motion of the virtual point → channels, (..., n_error) → (..., 3 n, 6)."""
        n, rows = len(self.sensors), errors.shape[:-1]
        gain, offset, angle = np.moveaxis(errors[..., : 9 * n].reshape(*rows, 3, n, 3), -3, 0)
        levers = skew(np.array([sensor.position for sensor in self.sensors]) + offset)
        turn = np.array([sensor.orientation for sensor in self.sensors]) @ rotation_matrix(angle)
        along = (1 + gain)[..., np.newaxis] * np.swapaxes(turn, -1, -2)
        seen = np.concatenate([along, along @ np.swapaxes(levers, -1, -2)], axis=-1)
        return np.asarray(seen.reshape(*rows, 3 * n, 6))

    def response_derivatives(self, errors: RealArray) -> RealArray:
        """Differentiate `response_matrix` by gains, offsets and angles, shape (9 n, 3 n, 6)."""
        return derivatives(self.response_matrix, errors[: 9 * len(self.sensors)], STEP)

    def excitation_matrix(self, errors: RealArray) -> RealArray:
        """Compute the wrench of each impact per newton that the hammer states, (..., m, 6)."""
        rows, m = errors.shape[:-1], len(self.impacts)
        gain = errors[..., -4 * m - 1]
        offsets, tilts = np.moveaxis(errors[..., -4 * m :].reshape(*rows, 2, m, 1, 2), -4, 0)
        stated = np.array([impact.direction for impact in self.impacts])
        across = np.stack(tangents(stated), axis=1)
        places = np.array([impact.position for impact in self.impacts])
        places = places + (offsets @ across)[..., 0, :]
        leaning = stated + (tilts @ across)[..., 0, :]
        direction = leaning / np.linalg.norm(leaning, axis=-1, keepdims=True)
        wrenches = np.concatenate([direction, np.cross(places, direction)], axis=-1)
        return np.asarray(wrenches / (1 + gain)[..., np.newaxis, np.newaxis])

    def excitation_derivatives(self, errors: RealArray) -> RealArray:
        """Differentiate `excitation_matrix` by gain, offsets and tilts, shape (1 + 4 m, m, 6)."""
        return derivatives(self.excitation_matrix, errors[9 * len(self.sensors) :], STEP)


@checked(deviation="f c i")
class RawInertance:
    """FRFs from every impact to every channel, and how well they are known.

    `deviation` (n_frequency, n_channel, n_impact): standard deviation of the real and of the
    imaginary part that differs from channel to channel [1/kg]; `force_deviation`: relative standard
    deviation of the real and of the imaginary part that all channels of one impact share at a line:
    the noise of the hammer's signal [1].
    """

    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]
    frf: Frf
    deviation: RealArray
    force_deviation: float = 0.001

    def select(self, lines: BoolArray) -> RawInertance:
        """Keep the marked lines."""
        frf = replace(self.frf, frequency=self.frf.frequency[lines], values=self.frf.values[lines])
        return replace(self, frf=frf, deviation=self.deviation[lines])


def deviation_from_coherence(frf: Frf, coherence: npt.ArrayLike, n_averages: int) -> RealArray:
    """Estimate the noise of each FRF from the coherence of few hits.

    `coherence` (n_frequency, n_channel, n_impact): ordinary coherence of `n_averages` hits [1].
    Returns (n_frequency, n_channel, n_impact) standard deviation of the real and of the imaginary
    part [1/kg]. InputError: one hit: its coherence is 1 whatever the noise.

    ``σ² = |H|² (1 − γ²)/(2 n γ²)`` (Bendat and Piersol, eq. 9.52) per FRF. Few hits know it badly,
    but the noise of the response is the same for all channels of a kind and smooth over frequency:
    the mean over the channels and a running mean over `SMOOTHING_LINES` lines take its place. The
    factor ``n/(n−1)`` mends the bias of the coherence of n hits.
    """
    if n_averages < 2:
        raise InputError(
            "one hit per impact says nothing of the noise, its coherence is 1 by construction: "
            "average at least two"
        )
    values = np.clip(np.asarray(coherence, dtype=float), 1e-6, 1 - 1e-12)
    variance = np.abs(frf.values) ** 2 * (1 - values) / (2 * n_averages * values)
    variance *= n_averages / (n_averages - 1)
    smooth = _running_mean(variance.mean(axis=1))[:, np.newaxis]
    return np.sqrt(np.broadcast_to(smooth, variance.shape))


def _running_mean(values: RealArray) -> RealArray:
    """Mean over neighbouring lines, shorter at the ends, shape (n_frequency, n_impact)."""
    width = min(SMOOTHING_LINES, values.shape[0])
    kernel = np.ones(width)
    weight = np.convolve(np.ones(values.shape[0]), kernel, mode="same")
    summed = np.stack([np.convolve(column, kernel, mode="same") for column in values.T], axis=1)
    return np.asarray(summed / weight[:, np.newaxis])


LARGEST_EVALUATIONS = 60
MISFIT_BANDS = 8
"""Groups of lines whose pulls are compared with each other."""


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the parameters before the hammer test.

    `values` (n_parameters,): expected values; `deviations` (n_parameters,): 1 σ; infinite where
    nothing is known.
    """

    values: RealArray
    deviations: RealArray


@dataclass(frozen=True, eq=False)
class SelfCalibration:
    """Compressor and placement that agree best with the raw FRFs and with what was known before.

    `values` (n_parameters,): most probable parameters; `errors` (n_errors,): most probable
    placement errors; `covariance` (n_parameters + n_errors, n_parameters + n_errors): posterior,
    linearised at the solution; `reduced_chi`: root mean square of the residuals in units of their
    noise; 1 where the model and the noise explain the measurement, above 1.5 an alarm [1].
    """

    parametrisation: Parametrisation
    values: RealArray
    placement: Placement
    errors: RealArray
    covariance: RealArray
    reduced_chi: float
    converged: bool

    @property
    def model(self) -> CompressorModel:
        """Identified compressor."""
        return self.parametrisation.model(self.values)

    @property
    def parameter_covariance(self) -> RealArray:
        """Covariance of the parameters alone, placement errors integrated out."""
        n = self.values.size
        return self.covariance[:n, :n]

    @property
    def response_matrix(self) -> RealArray:
        """Motion of the virtual point → channels, as calibrated, shape (n_channel, 6) [1, m]."""
        return self.placement.response_matrix(self.errors)

    @property
    def excitation_matrix(self) -> RealArray:
        """Wrench of each impact per stated newton, as calibrated, shape (n_impact, 6) [1, m]."""
        return self.placement.excitation_matrix(self.errors)


def self_calibrate(
    parametrisation: Parametrisation,
    raw: RawInertance,
    test: InertanceTest,
    start: RealArray,
    prior: Prior | None = None,
) -> SelfCalibration:
    """Find the most probable parameters and placement errors.

    `test`: tolerances and weighed mass of the hammer test; `start` (n_parameters,): values to begin
    with, such as a fit at the virtual point.

    Model ``Y = V(q) H(θ) U(q)ᵀ`` for a rigid, reciprocal body. Maximum of the posterior by
    `scipy.optimize.least_squares` on the compressed problem: ``R`` with ``Rᵀ R = Jᵀ J`` and
    ``R⁻ᵀ Jᵀ r`` have the cost, the gradient and the Gauss-Newton matrix of the full residuals, at a
    hundredth of their number. Check `reduced_chi` before trusting the result.
    """
    from scipy.optimize import least_squares

    problem = _Problem(parametrisation, raw, test, prior)
    first = np.concatenate([start, np.zeros(problem.errors_deviation.size)])
    residuals_at, jacobian_at = evaluated_together(problem.compressed)
    n = start.size
    # the step at which each parameter alone changes the cost by one
    steps = 1 / np.linalg.norm(jacobian_at(first)[:, :n], axis=0)
    result = least_squares(
        residuals_at,
        first,
        jac=jacobian_at,
        method="trf",
        x_scale=np.concatenate([steps, problem.errors_deviation]),
        max_nfev=LARGEST_EVALUATIONS,
        xtol=1e-9,
        ftol=1e-9,
        gtol=1e-6,
    )
    residuals, jacobian = problem.residuals(result.x), np.asarray(result.jac, dtype=float)
    return SelfCalibration(
        parametrisation,
        result.x[:n],
        problem.placement,
        result.x[n:],
        _inverse(jacobian.T @ jacobian),
        float(np.sqrt(np.mean(np.abs(residuals) ** 2) / 2)),
        bool(result.status > 0),
    )


def _inverse(normal: RealArray) -> RealArray:
    """Invert equations of many units."""
    unit = 1 / np.sqrt(np.diag(normal))
    return np.asarray(np.linalg.inv(normal * np.outer(unit, unit)) * np.outer(unit, unit))


def with_misfit(
    calibration: SelfCalibration, raw: RawInertance, test: InertanceTest, prior: Prior | None = None
) -> SelfCalibration:
    """Let the covariance grow by what residuals that are no noise may have moved.

    `raw`: lines of the whole band, those that were held out included.

    Noise pulls no group of residuals in one direction, a wrong model does. What each of
    `MISFIT_BANDS` bands, each impact, each sensor and each prior alone would move the solution by,
    adds up in squares (sandwich covariance of clusters; Liang and Zeger 1986), and so does what all
    together move it by, since some lines were not fitted.

    What carries the mounts lies in series with them. Its static part leaves no residual, so no
    deviation tells of it: on the bench's receiver K is 7 % low at 10 Hz and 15 % at 30 Hz. In one
    such test it lay 14 deviations from the mounts' own, while mass and centre lay within one.
    """
    problem = _Problem(calibration.parametrisation, raw, test, prior)
    unknowns = np.concatenate([calibration.values, calibration.errors])
    slopes = problem.slopes(unknowns)
    bands = np.array_split(slopes.sum(axis=(2, 3)), MISFIT_BANDS, axis=1)
    by_sensor = slopes.reshape(*slopes.shape[:2], -1, 3, slopes.shape[3]).sum(axis=(1, 3, 4))
    normal, gradient, _ = problem.normal_equations(unknowns)
    groups = [
        np.stack([band.sum(axis=1) for band in bands], axis=1),
        slopes.sum(axis=(1, 2)),
        by_sensor,
        *((deviations[:, np.newaxis] * rows).T for deviations, rows in problem.priors(unknowns)),
        gradient[:, np.newaxis],
    ]
    moves = _inverse(normal) @ np.concatenate(groups, axis=1)
    return replace(calibration, covariance=calibration.covariance + moves @ moves.T)


def evaluated_together(
    compute: Callable[[RealArray], tuple[RealArray, RealArray]],
) -> tuple[Callable[[RealArray], RealArray], Callable[[RealArray], RealArray]]:
    """Split a function of residuals and Jacobian into two that share one evaluation per point.

    An optimiser asks for residuals and Jacobian of one point by turns.
    """
    latest: dict[bytes, tuple[RealArray, RealArray]] = {}

    def at(values: RealArray) -> tuple[RealArray, RealArray]:
        key = values.tobytes()
        if key not in latest:
            latest.clear()
            latest[key] = compute(values)
        return latest[key]

    return lambda values: at(values)[0], lambda values: at(values)[1]


class _Problem:
    """Residuals and their derivatives; holds only what does not change from step to step."""

    def __init__(
        self,
        parametrisation: Parametrisation,
        raw: RawInertance,
        test: InertanceTest,
        prior: Prior | None,
    ) -> None:
        self.parametrisation = parametrisation
        self.raw = raw
        self.placement = Placement(raw.sensors, raw.impacts)
        self.errors_deviation = self.placement.deviations(test.tolerances)
        self.test = test
        self.prior = prior
        self.n = len(parametrisation.names)
        # noise of the hammer's signal is common to a column: whitened by a rank-one change
        column = raw.frf.values / raw.deviation
        size = np.linalg.norm(column, axis=1, keepdims=True)
        self.common = column / size
        self.shrink = 1 - 1 / np.sqrt(1 + (raw.force_deviation * size) ** 2)

    def residuals(self, unknowns: RealArray) -> ComplexArray:
        """Whitened deviations of the raw FRFs, shape (n_frequency, n_channel, n_impact)."""
        _, inertance, response, excitation = self._state(unknowns)
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

    def slopes(self, unknowns: RealArray) -> RealArray:
        """Share of each residual in ``Jᵀ r``, (n_unknowns, n_frequency, n_channel, n_impact)."""
        return np.asarray((self._jacobian(unknowns).conj() * self.residuals(unknowns)).real)

    def normal_equations(self, unknowns: RealArray) -> tuple[RealArray, RealArray, float]:
        """``Jᵀ J``, ``Jᵀ r`` and ``rᵀ r`` of residuals and priors."""
        residuals, jacobian = self.residuals(unknowns), self._jacobian(unknowns)
        rows = jacobian.reshape(jacobian.shape[0], -1).view(float)
        flat = residuals.reshape(-1).view(float)
        normal, gradient = rows @ rows.T, rows @ flat
        squares = float(flat @ flat)
        for deviations, slopes in self.priors(unknowns):
            normal += slopes.T @ slopes
            gradient += slopes.T @ deviations
            squares += float(deviations @ deviations)
        return normal, gradient, squares

    def _state(self, unknowns: RealArray) -> tuple[RealArray, ComplexArray, RealArray, RealArray]:
        """Parameters; inertance, response and excitation matrices that the unknowns stand for."""
        values, errors = np.split(unknowns, [self.n])
        inertance = self.parametrisation.model(values).inertance(self.raw.frf.frequency)
        response = self.placement.response_matrix(errors)
        return values, inertance, response, self.placement.excitation_matrix(errors)

    def _jacobian(self, unknowns: RealArray) -> ComplexArray:
        """Whitened, shape (n_unknowns, n_frequency, n_channel, n_impact)."""
        values, inertance, response, excitation = self._state(unknowns)
        by_mass = self.parametrisation.sensitivities(values, self.raw.frf.frequency)
        by_response = self.placement.response_derivatives(unknowns[self.n :])
        by_excitation = self.placement.excitation_derivatives(unknowns[self.n :])
        seen, pushed = response @ inertance, inertance @ excitation.T
        jacobian = np.empty(
            (unknowns.size, by_mass.shape[1], len(response), len(excitation)), dtype=complex
        )
        np.matmul(-(seen @ by_mass), pushed, out=jacobian[: self.n])
        split = self.n + by_response.shape[0]
        np.matmul(by_response[:, np.newaxis], pushed, out=jacobian[self.n : split])
        transposed = np.swapaxes(by_excitation, -1, -2)[:, np.newaxis]
        np.matmul(seen, transposed, out=jacobian[split:])
        return self._white(jacobian)

    def _white(self, deviation: ComplexArray) -> ComplexArray:
        """Divide by the noise, in place, shape (..., n_frequency, n_channel, n_impact)."""
        scaled = np.ascontiguousarray(deviation)
        conjugate, shrunk = self.common.conj(), self.shrink * self.common
        for block in scaled.reshape(-1, *shrunk.shape):  # one after the other fits into the cache
            block /= self.raw.deviation
            along = np.einsum("fci,fci->fi", conjugate, block)
            block -= shrunk * along[:, np.newaxis]
        return scaled

    def priors(self, unknowns: RealArray) -> list[tuple[RealArray, RealArray]]:
        """Deviations from what was known, and their derivatives, both in units of 1 σ."""
        n = self.n
        values, errors = np.split(unknowns, [n])
        of_errors = np.zeros((errors.size, unknowns.size))
        of_errors[:, n:] = np.diag(1 / self.errors_deviation)
        rows = [(errors / self.errors_deviation, of_errors)]
        if self.prior is not None:
            slopes = np.zeros((n, unknowns.size))
            slopes[:, :n] = np.diag(1 / self.prior.deviations)
            rows.append(((values - self.prior.values) / self.prior.deviations, slopes))
        if self.test.weighed_mass is not None:
            slope = np.zeros((1, unknowns.size))
            slope[0, :n] = self.parametrisation.mass_slope(values)
            mass = self.parametrisation.model(values).mass
            deviation = self.test.weighed_mass_deviation
            off = np.array([(mass - self.test.weighed_mass) / deviation])
            rows.append((off, slope / deviation))
        return rows


@dataclass(frozen=True, eq=False)
class HoldOut:
    """Measured FRFs that took no part in a fit, against its prediction.

    `what`: lines held out, in words; `reduced_chi`: rms deviation in units of the noise
    [1]; `relative_error`: rms deviation over rms of the measured FRFs [1].
    """

    what: str
    reduced_chi: float
    relative_error: float


def hold_out_lines(calibration: SelfCalibration, raw: RawInertance) -> HoldOut:
    """Predict lines of the same sensors and impacts that were not fitted."""
    measured, lines = raw.frf, raw.frf.frequency
    predicted = (
        calibration.response_matrix
        @ calibration.model.inertance(lines)
        @ calibration.excitation_matrix.T
    )
    deviation = predicted - measured.values
    return HoldOut(
        f"{lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz",
        float(np.sqrt(np.mean(np.abs(deviation / raw.deviation) ** 2) / 2)),
        float(np.sqrt(np.mean(np.abs(deviation) ** 2) / np.mean(np.abs(measured.values) ** 2))),
    )
