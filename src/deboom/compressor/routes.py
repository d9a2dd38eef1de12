"""Ways from measured accelerations to the load inside: which apparent mass, which sensors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from deboom.compressor.operating_stiffness import FactorOverFrequency, StiffnessChange
from deboom.compressor.placement import Placement
from deboom.compressor.route_model import HammerNoise, RouteModel, between_lines

if TYPE_CHECKING:
    from deboom.arrays import ComplexArray, RealArray
    from deboom.compressor.identify import Identification
    from deboom.compressor.self_calibration import SelfCalibration

ROUNDING = 1e-13
"""Relative to the largest, of eigenvalues of a covariance [1]."""


class Route(Protocol):
    """One way to the load inside."""

    @property
    def letter(self) -> str:
        """Under which tables and figures list it."""
        ...

    @property
    def title(self) -> str:
        """What it does, in words."""
        ...

    @property
    def update(self) -> StiffnessChange | None:
        """Change of the mounts that is fitted to the sweep and taken into the load, if any."""
        ...

    def model(self, basis: RouteBasis, frequency: RealArray) -> RouteModel:
        """Apparent mass and sensors at these lines, with what is uncertain in them."""
        ...


@dataclass(frozen=True, eq=False)
class RouteBasis:
    """What routes are made of.

    Parameters
    ----------
    identification : Identification
        Of the hammer test.
    calibration : SelfCalibration
        Whose sensors and impacts are used: that of the identification, or one from the mass line
        alone where the foundation is not rigid.
    """

    identification: Identification
    calibration: SelfCalibration


@dataclass(frozen=True)
class MeasuredRoute:
    """Measured apparent mass, everything as the position sheet has it (thesis, 4.4.1).

    Notes
    -----
    Errors of the accelerometers cancel, since test and sweep share them; those of the hammer and
    its places stay.
    """

    letter: str = "a"
    title: str = "measured apparent mass (thesis)"
    update: None = field(default=None, init=False)

    def model(self, basis: RouteBasis, frequency: RealArray) -> RouteModel:
        """Measured matrix, with placement errors as large as the tolerances."""
        found = basis.identification
        placement = basis.calibration.placement
        zero = np.zeros(len(placement.names))
        tolerances = np.diag(placement.deviations(found.test.tolerances) ** 2)
        return _measured(basis, frequency, placement, zero, tolerances)


@dataclass(frozen=True)
class PointModelRoute:
    """Model fitted at the virtual point, everything as the position sheet has it.

    Notes
    -----
    Nothing cancels: the sensors' errors enter twice. Its band takes the errors of sensors and
    impacts as independent of the fit, which is what a fit that cannot absorb them would leave.
    """

    letter: str = "b"
    title: str = "model at the virtual point"
    update: None = field(default=None, init=False)

    def model(self, basis: RouteBasis, frequency: RealArray) -> RouteModel:
        """Model of the fit at the virtual point."""
        found, placement = basis.identification, basis.calibration.placement
        zero = np.zeros(len(placement.names))
        forward = placement.response_matrix(zero)
        inverse = _pseudo_inverse(forward)
        mass = found.point.model.apparent_mass(frequency)
        slopes = np.concatenate(
            [
                -mass @ (inverse @ placement.response_derivatives(zero))[:, np.newaxis],
                _by_impact(placement, zero) @ mass,
            ]
        )
        scale = placement.deviations(found.test.tolerances)
        return RouteModel(
            frequency,
            inverse,
            mass,
            np.asarray(slopes * scale[:, np.newaxis, np.newaxis, np.newaxis], dtype=complex),
            _mounts(found, frequency),
            None,
        )


@dataclass(frozen=True)
class CalibratedModelRoute:
    """Self-calibrated model and sensors."""

    letter: str = "c"
    title: str = "self-calibrated model"
    update: None = field(default=None, init=False)

    def model(self, basis: RouteBasis, frequency: RealArray) -> RouteModel:
        """Model and sensors with their joint posterior."""
        calibration = basis.identification.calibrated
        placement, errors = calibration.placement, calibration.errors
        inverse = _pseudo_inverse(placement.response_matrix(errors))
        mass = calibration.model.apparent_mass(frequency)
        seen = inverse @ placement.response_derivatives(errors)
        slopes = np.concatenate(
            [
                calibration.parametrisation.sensitivities(calibration.values, frequency),
                -mass @ seen[:, np.newaxis],
            ]
        )
        n = slopes.shape[0]
        return RouteModel(
            frequency,
            inverse,
            mass,
            _standardised(slopes, calibration.covariance[:n, :n]),
            _mounts(basis.identification, frequency),
            None,
        )


@dataclass(frozen=True)
class CalibratedMeasurementRoute:
    """Measured apparent mass by self-calibrated sensors and impacts: the default.

    Notes
    -----
    Needs no model of mounts or foundation, only a rigid body: the accelerometers' errors cancel
    and those of the hammer were found.
    """

    letter: str = "d"
    title: str = "measured apparent mass, self-calibrated"
    update: None = field(default=None, init=False)

    def model(self, basis: RouteBasis, frequency: RealArray) -> RouteModel:
        """Measured matrix, with the posterior of the placement."""
        calibration = basis.calibration
        n = calibration.values.size
        covariance = calibration.covariance[n:, n:]
        return _measured(basis, frequency, calibration.placement, calibration.errors, covariance)


@dataclass(frozen=True)
class UpdatedRoute:
    """Another route, with the stiffness of the mounts brought up to date by the sweep itself.

    Parameters
    ----------
    base : Route
    update : StiffnessChange
        What may have changed; `OneFactor` is the smallest change, knots follow softening mounts.
    """

    base: Route = field(default_factory=CalibratedModelRoute)
    update: StiffnessChange = field(default_factory=FactorOverFrequency)
    letter: str = "e"

    @property
    def title(self) -> str:
        """Of the base, with its update."""
        return f"{self.base.title}, mounts updated"

    def model(self, basis: RouteBasis, frequency: RealArray) -> RouteModel:
        """As the base: the update comes with the sweep."""
        return self.base.model(basis, frequency)


def _measured(
    basis: RouteBasis,
    frequency: RealArray,
    placement: Placement,
    errors: RealArray,
    covariance: RealArray,
) -> RouteModel:
    """Measured apparent mass by the placement with these errors, known to this covariance."""
    raw = basis.identification.raw
    inverse = _pseudo_inverse(placement.response_matrix(errors))
    of_impacts = _pseudo_inverse(placement.excitation_matrix(errors))
    hammer_lines = raw.frf.frequency
    measured = inverse @ raw.frf.values @ of_impacts.T
    mass: ComplexArray = np.asarray(np.linalg.inv(measured), dtype=complex)
    at = between_lines(hammer_lines, frequency)
    # the dynamic stiffness ω² AM runs smoothly through resonances, the inertance does not
    square = (2 * np.pi * hammer_lines)[:, np.newaxis, np.newaxis] ** 2
    mass_here: ComplexArray = (
        at(square * mass) / (2 * np.pi * frequency)[:, np.newaxis, np.newaxis] ** 2
    )
    slopes = _by_impact(placement, errors) @ mass_here
    n = 9 * len(placement.sensors)
    noise = HammerNoise(
        seen=mass_here @ inverse,
        inverse=of_impacts,
        deviation=at(raw.deviation),
        columns=at(mass @ (inverse @ raw.frf.values)),
        force_deviation=raw.force_deviation,
    )
    return RouteModel(
        frequency,
        inverse,
        mass_here,
        _standardised(slopes, covariance[n:, n:]),
        _mounts(basis.identification, frequency),
        noise,
    )


def _pseudo_inverse(matrix: RealArray) -> RealArray:
    return np.asarray(np.linalg.pinv(matrix), dtype=float)


def _by_impact(placement: Placement, errors: RealArray) -> ComplexArray:
    """Change of a load by the hammer's gain, offsets and tilts, shape (1 + 4 m, 1, 6, 6).

    A matrix measured with wrong impacts is wrong by the same factor at every line.
    """
    inverse = np.linalg.pinv(placement.excitation_matrix(errors))
    change = inverse @ placement.excitation_derivatives(errors)
    return np.asarray(np.swapaxes(change, -1, -2)[:, np.newaxis], dtype=complex)


def _mounts(found: Identification, frequency: RealArray) -> ComplexArray:
    """Part of the apparent mass that the mounts have, ``v K/ω²``, shape (n_frequency, 6, 6)."""
    model = found.calibrated.model
    factor = model.gain.at(frequency) / (2 * np.pi * frequency) ** 2
    return np.asarray(factor[:, np.newaxis, np.newaxis] * model.stiffness)


def _standardised(slopes: ComplexArray, covariance: RealArray) -> ComplexArray:
    """Turn slopes by correlated errors into slopes by independent ones of unit deviation."""
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    # a posterior of very exact data is singular up to rounding: what is certain has no slope
    kept = values > ROUNDING * values[-1]
    factor = scale[:, np.newaxis] * vectors[:, kept] * np.sqrt(values[kept])
    return np.asarray(np.tensordot(factor, slopes, axes=(0, 0)))
