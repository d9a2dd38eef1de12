"""Routes from measured accelerations to the load inside: which apparent mass, which sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar, cast

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.compressor.identified_compressor import Identification
from deboom.compressor.model import applied
from deboom.compressor.self_calibration import Placement, SelfCalibration
from deboom.compressor.unbalance_load import RotationSense, gyroscopic_mass
from deboom.measurement.channels import Spectrum
from deboom.measurement.compressor_test import OperatingSweep
from deboom.measurement.quality import RigidConsistency, response_consistency
from deboom.measurement.virtual_point import VirtualPoint, motion_at_point

ROUNDING = 1e-13
"""Relative to the largest, of eigenvalues of a covariance [1]."""

COMMON, AT_KNOT, APART = 0.3, 0.1, 0.2
"""1 σ of both parts of a change of the mounts, of what each knot adds to it, and of what each
direction adds to it by itself [1]."""

STATED_AT = 30.0
"""Line at which a change of the mounts is put in words: within the rigid-body modes [Hz]."""

_Array = TypeVar("_Array", bound=np.ndarray[Any, Any])


class StiffnessChange(Protocol):
    """How the mounts in operation may differ from those struck: linear in unknowns, 0 for none."""

    @property
    def deviations(self) -> RealArray:
        """1 σ of each unknown before the sweep, shape (n_unknown,) [1]."""

    def matrices(
        self, frequency: RealArray, mounts: ComplexArray, motion: ComplexArray
    ) -> ComplexArray:
        """Compute the part of the apparent mass that each unknown takes away.

        `frequency` (n_frequency,): lines [Hz]; `mounts` (n_frequency, 6, 6): part of the mounts as
        they were struck, ``v K/ω²`` [kg, kg m, kg m²]; `motion` (n_frequency, 6): acceleration of
        the virtual point in the sweep in question [m/s², rad/s²]. Returns (n_unknown, n_frequency,
        6, 6) [kg, kg m, kg m²].
        """


@dataclass(frozen=True)
class FactorOverFrequency:
    """A complex factor ``1 + δ`` on all mounts, and one more at each knot, linear between them.

    `knots`: rising; dense where the motion changes quickly, around the rigid-body modes; none for
    one factor at every speed, such as of another temperature or preload [Hz].
    """

    knots: tuple[float, ...] = (17.0, 22.0, 28.0, 36.0, 50.0, 150.0)

    def basis(self, frequency: RealArray) -> ComplexArray:
        """Compute δ per unknown, a hat around each knot, shape (2 + 2 n_knot, n_frequency)."""
        hats = [np.interp(frequency, self.knots, row) for row in np.eye(len(self.knots))]
        rows = np.vstack([np.ones(frequency.size), *hats])
        return np.asarray(np.stack([rows, 1j * rows], axis=1).reshape(-1, frequency.size))

    def matrices(
        self,
        frequency: RealArray,
        mounts: ComplexArray,
        motion: ComplexArray,  # noqa: ARG002  only a law over the stroke needs it
    ) -> ComplexArray:
        """Scale the mounts by each unknown."""
        return np.asarray(self.basis(frequency)[..., np.newaxis, np.newaxis] * mounts)

    @property
    def deviations(self) -> RealArray:
        """1 σ of both parts of the common δ, then of those of each knot [1]."""
        return np.repeat([COMMON, *(AT_KNOT for _ in self.knots)], 2)


ONE_FACTOR = FactorOverFrequency(())


@dataclass(frozen=True)
class MountsApart:
    """Mounts that changed apart from each other at all speeds alike, besides a common factor.

    ``K → K½ (1 + E) K½`` with a symmetric complex E, so that each direction of the body may become
    stiffer or softer by itself: what any single mount, axis or place of a mount does to the whole,
    without a drawing that says what is where. 21 numbers with two parts each.
    """

    common: FactorOverFrequency = FactorOverFrequency()

    def matrices(
        self, frequency: RealArray, mounts: ComplexArray, motion: ComplexArray
    ) -> ComplexArray:
        """Scale the mounts by the common unknowns, then by each entry of E."""
        left, right, ratio = _split(mounts)
        each = left @ _SYMMETRIC @ right
        real = ratio[:, np.newaxis, np.newaxis] * each[:, np.newaxis]
        apart = np.stack([real, 1j * real], axis=1).reshape(-1, *mounts.shape)
        return np.concatenate([self.common.matrices(frequency, mounts, motion), apart])

    @property
    def deviations(self) -> RealArray:
        """1 σ of the common unknowns, then of both parts of each entry of E [1]."""
        return np.append(self.common.deviations, np.full(2 * len(_SYMMETRIC), APART))

    def change_at(self, line: float) -> ComplexArray:
        """Differentiate ``δ + E`` at a line [Hz] by each unknown, shape (n_unknown, 6, 6) [1]."""
        common = self.common.basis(np.array([line])) * np.eye(6)[:, np.newaxis].reshape(1, 36)
        apart = np.stack([_SYMMETRIC, 1j * _SYMMETRIC], axis=1)
        return np.concatenate([common.reshape(-1, 6, 6), apart.reshape(-1, 6, 6)])

    @staticmethod
    def coordinates(changes: RealOrComplexArray) -> RealOrComplexArray:
        """Return the 21 numbers of the symmetric part of changes, (..., 6, 6) to (..., 21) [1]."""
        return np.asarray(np.tensordot(changes, _SYMMETRIC, axes=([-2, -1], [1, 2])))

    @staticmethod
    def share(part: RealArray, mounts: ComplexArray) -> RealArray:
        """Return the change ``δ + E`` by which one part of the stiffness is gone, (6, 6) [1].

        `part` (6, 6): what a mount adds to K_VP, over its trace; `mounts`: as in `matrices`.
        """
        left, right, _ = _split(mounts)
        return np.asarray(np.linalg.solve(left, part) @ np.linalg.inv(right))


def _symmetric_basis() -> RealArray:
    """Symmetric matrices of one entry and its mirror, their norm 1, shape (21, 6, 6)."""
    basis = np.zeros((21, 6, 6))
    for number, (row, column) in enumerate(zip(*np.triu_indices(6), strict=True)):
        basis[number, row, column] = basis[number, column, row] = 1.0 if row == column else 0.5**0.5
    return basis


_SYMMETRIC = _symmetric_basis()


def _split(mounts: ComplexArray) -> tuple[RealArray, RealArray, ComplexArray]:
    """Split the mounts' part at all lines into ``ratio · left @ right``, ``left ≈ rightᵀ``.

    All entries of ``v K/ω²`` share one phase; axes of sensors and impacts that are not calibrated
    leave it nearly symmetric.
    """
    trace = np.trace(mounts, axis1=1, axis2=2)
    at_rest = (mounts[0] / trace[0]).real
    first, singular, last = np.linalg.svd(at_rest)
    root = np.sqrt(singular)
    return np.asarray(first * root), np.asarray(root[:, np.newaxis] * last), np.asarray(trace)


@dataclass(frozen=True, eq=False)
class HammerNoise:
    """Noise that a measured apparent mass brings into the load.

    `seen` (n_frequency, 6, n_channel): ``AM V⁺``; `inverse` (6, n_impact): ``U⁺``; `deviation`
    (n_frequency, n_channel, n_impact): standard deviation of real and imaginary part of each FRF
    [1/kg]; `columns` (n_frequency, 6, n_impact): ``AM V⁺ Y``: wrench of each impact as the test
    shows it; `force_deviation`: relative noise of the hammer's signal [1].
    """

    seen: ComplexArray
    inverse: RealArray
    deviation: RealArray
    columns: ComplexArray
    force_deviation: float

    def select(self, lines: npt.NDArray[np.intp]) -> HammerNoise:
        """Keep these lines, given by their indices."""
        return replace(
            self,
            seen=self.seen[lines],
            deviation=self.deviation[lines],
            columns=self.columns[lines],
        )

    def covariance(self, load: ComplexArray, other: ComplexArray) -> ComplexArray:
        """Compute the covariance per part of two loads found with the same measured matrix.

        `load`, `other` (n_frequency, 6): loads [N, N m]. Returns (n_frequency, 6, 6) half of
        ``E[e_load e_otherᴴ]``.

        ``δF = −AM V⁺ δY (U⁺)ᵀ F``.
        """
        first, second = load @ self.inverse, other @ self.inverse
        product = first * second.conj()
        spread = applied(self.deviation**2, product)[:, np.newaxis]
        of_channels = (self.seen * spread) @ np.swapaxes(self.seen, 1, 2).conj()
        weighted = self.columns * product[:, np.newaxis]
        of_force = weighted @ np.swapaxes(self.columns, 1, 2).conj()
        return np.asarray(of_channels + self.force_deviation**2 * of_force)


@dataclass(frozen=True, eq=False)
class FrameErrors:
    """What each error of a route does to the load of mounts that have changed.

    `load`, `motion` (n_error, 6, 6): relative change of a load, and of a motion, at the virtual
    point, by errors of unit standard deviation. The load of a change C is ``(1 + Σ n_k L_k) C (1 +
    Σ n_k S_k) s`` with the errors' normal numbers n_k.

    Sensors and impacts whose errors shift, turn or scale the axes of motion and load alike leave
    the hammer test explained to its noise: ``AM_route = (1 + L)⁻¹ AM (1 + S)⁻¹``, mass and mounts
    in the same way. Without this product a change of the mounts, which the sweep shows, would stand
    in true axes beside a mass in those of the route, and their difference would seem to reveal
    where the origin lies.
    """

    load: RealArray
    motion: RealArray

    def product(self, errors: RealArray, change: ComplexArray) -> ComplexArray:
        """Compute what errors add to the load per motion of a change.

        `errors` (n_error,): in standard deviations [1]; `change` (n_frequency, 6, 6): what the
        mounts take off the apparent mass [kg, kg m, kg m²]. Returns the shape of `change`.
        """
        of_load, of_motion = self.combined(errors)
        return np.asarray(of_load @ change + change @ of_motion)

    def combined(self, errors: RealArray) -> tuple[RealArray, RealArray]:
        """Add up load and motion over errors (n_error,) in standard deviations, (6, 6) each."""
        return np.tensordot(errors, self.load, axes=1), np.tensordot(errors, self.motion, axes=1)

    def slopes(self, change: ComplexArray, motion: ComplexArray) -> ComplexArray:
        """Differentiate the load of a change by each error, shape (n_error, n_frequency, 6).

        `change` (n_frequency, 6, 6) [kg, kg m, kg m²]; `motion` (n_frequency, 6) [m/s², rad/s²].
        """
        of_load = np.tensordot(self.load, applied(change, motion), axes=(2, 1))
        turned = np.moveaxis(np.tensordot(self.motion, motion, axes=(2, 1)), 2, 0)
        of_motion = np.moveaxis(change @ np.moveaxis(turned, 1, 2), 2, 0)
        return np.asarray(np.moveaxis(of_load, 2, 1) + of_motion)


@dataclass(frozen=True, eq=False)
class RouteModel:
    """What a route makes of a motion.

    `frequency` (n_frequency,): lines [Hz]; `inverse` (6, n_channel): channels → motion of the
    virtual point; `apparent_mass` (n_frequency, 6, 6): with the mounts as they were struck [kg, kg
    m, kg m²]; `by_error` (n_error, n_frequency, 6, 6): load per motion, by each of independent
    errors of unit standard deviation, which are the same at every line and in every sweep; `mounts`
    (n_frequency, 6, 6): part of the mounts, ``v K/ω²``: a change δ of their stiffness takes
    ``δ v K/ω²`` off the apparent mass; `frame`: what the same errors do to that change.
    """

    frequency: RealArray
    inverse: RealArray
    apparent_mass: ComplexArray
    by_error: ComplexArray
    mounts: ComplexArray
    frame: FrameErrors
    noise: HammerNoise | None

    def with_rotor(self, inertia: float | None, sense: RotationSense) -> RouteModel:
        """Add the gyroscopic moment of the rotor [kg m²], which a struck compressor lacks."""
        return replace(self, apparent_mass=self.apparent_mass + gyroscopic_mass(inertia, sense))


@dataclass(frozen=True)
class Route:
    """One way to the load inside.

    `letter`: under which tables and figures list it; `title`: what it does, in words; `model`:
    apparent mass and sensors at lines [Hz], with what is uncertain in them; `needs_model`: whether
    it rests on a model of mounts and foundation; `update`: change of the mounts that is fitted to
    the sweep and taken into the load, if any.
    """

    letter: str
    title: str
    model: Callable[[Identification, SelfCalibration, RealArray], RouteModel]
    needs_model: bool = True
    update: StiffnessChange | None = None


def _by_sheet(
    identification: Identification, calibration: SelfCalibration, lines: RealArray
) -> RouteModel:
    """Take the measured apparent mass, everything as the position sheet has it (thesis, 4.4.1).

    Errors of the accelerometers cancel, since test and sweep share them; those of the hammer and
    its places stay. The band takes them as large as the tolerances.
    """
    placement = calibration.placement
    zero = np.zeros(len(placement.names))
    tolerances = placement.deviations(identification.test.tolerances)
    return _measured(identification, lines, placement, zero, np.diag(tolerances**2))


def _point_model(
    identification: Identification, calibration: SelfCalibration, lines: RealArray
) -> RouteModel:
    """Take the model of the fit at the virtual point, everything as the position sheet has it.

    Nothing cancels: the sensors' errors enter twice. Its band takes the errors of sensors and
    impacts as independent of the fit, which is what a fit that cannot absorb them would leave.
    """
    placement = calibration.placement
    zero = np.zeros(len(placement.names))
    inverse = _pseudo_inverse(placement.response_matrix(zero))
    mass = identification.point.model.apparent_mass(lines)
    seen = inverse @ placement.response_derivatives(zero)
    scale = placement.deviations(identification.test.tolerances)[:, np.newaxis, np.newaxis]
    of_load, of_motion = np.zeros((2, scale.size, 6, 6))
    of_motion[: len(seen)], of_load[len(seen) :] = -seen, _by_impact(placement, zero)
    frame = FrameErrors(scale * of_load, scale * of_motion)
    by_error = frame.load[:, np.newaxis] @ mass + mass @ frame.motion[:, np.newaxis]
    mounts = identification.point.model.mount_part(lines)
    return RouteModel(lines, inverse, mass, np.asarray(by_error), mounts, frame, None)


def _calibrated_model(
    identification: Identification,
    calibration: SelfCalibration,  # noqa: ARG001  the model goes with its own sensors
    lines: RealArray,
) -> RouteModel:
    """Take the self-calibrated model and sensors with their joint posterior.

    What their errors do to a change of the mounts is that of the impacts' errors which go with
    them: all three explain one hammer test.
    """
    calibrated = identification.calibrated
    inverse = _pseudo_inverse(calibrated.response_matrix)
    mass = calibrated.model.apparent_mass(lines)
    seen = inverse @ calibrated.placement.response_derivatives(calibrated.errors)
    by_parameter = calibrated.parametrisation.sensitivities(calibrated.values, lines)
    slopes = np.concatenate([by_parameter, -mass @ seen[:, np.newaxis]])
    n = len(slopes)
    independent = _IndependentErrors.of(calibrated.covariance[:n, :n])
    of_impacts = independent.scores(calibrated.covariance[:n, n:])
    load = _combination(of_impacts, _by_impact(calibrated.placement, calibrated.errors))
    frame = FrameErrors(load, np.zeros_like(load))
    by_error = _combination(independent.factor, slopes)
    mounts = calibrated.model.mount_part(lines)
    return RouteModel(lines, inverse, mass, by_error, mounts, frame, None)


def _calibrated_measurement(
    identification: Identification, calibration: SelfCalibration, lines: RealArray
) -> RouteModel:
    """Take the measured apparent mass by self-calibrated sensors and impacts: the default.

    Needs no model of mounts or foundation, only a rigid body: the accelerometers' errors cancel and
    those of the hammer were found.
    """
    n = calibration.values.size
    covariance = calibration.covariance[n:, n:]
    return _measured(identification, lines, calibration.placement, calibration.errors, covariance)


def _measured(
    identification: Identification,
    lines: RealArray,
    placement: Placement,
    errors: RealArray,
    covariance: RealArray,
) -> RouteModel:
    """Measured apparent mass by the placement with these errors, known to this covariance."""
    raw = identification.raw
    inverse = _pseudo_inverse(placement.response_matrix(errors))
    of_impacts = _pseudo_inverse(placement.excitation_matrix(errors))
    hammer_lines = raw.frf.frequency
    measured = inverse @ raw.frf.values @ of_impacts.T
    mass: ComplexArray = np.asarray(np.linalg.inv(measured), dtype=complex)

    after = np.clip(np.searchsorted(hammer_lines, lines), 1, hammer_lines.size - 1)
    share = (lines - hammer_lines[after - 1]) / (hammer_lines[after] - hammer_lines[after - 1])

    def at_lines(values: _Array) -> _Array:
        """Interpolate linearly; the sweeps were cut to the lines of the hammer test."""
        part = share.reshape(-1, *(1,) * (values.ndim - 1))
        return cast("_Array", (1 - part) * values[after - 1] + part * values[after])

    # the dynamic stiffness ω² AM runs smoothly through resonances, the inertance does not
    stiffness = (2 * np.pi * hammer_lines)[:, np.newaxis, np.newaxis] ** 2 * mass
    mass_at_lines = at_lines(stiffness) / (2 * np.pi * lines)[:, np.newaxis, np.newaxis] ** 2
    n = 9 * len(placement.sensors)
    noise = HammerNoise(
        seen=mass_at_lines @ inverse,
        inverse=of_impacts,
        deviation=at_lines(raw.deviation),
        columns=at_lines(mass @ (inverse @ raw.frf.values)),
        force_deviation=raw.force_deviation,
    )
    factor = _IndependentErrors.of(covariance[n:, n:]).factor
    load = _combination(factor, _by_impact(placement, errors))
    frame = FrameErrors(load, np.zeros_like(load))
    by_error = np.asarray(load[:, np.newaxis] @ mass_at_lines)
    # the mounts as sensors and impacts of this placement see them
    calibrated = identification.calibrated
    seen, struck = inverse @ calibrated.response_matrix, of_impacts @ calibrated.excitation_matrix
    mounts = np.linalg.inv(struck).T @ calibrated.model.mount_part(lines) @ np.linalg.inv(seen)
    return RouteModel(lines, inverse, mass_at_lines, by_error, mounts, frame, noise)


MEASURED = Route("a", "measured apparent mass (thesis)", _by_sheet, needs_model=False)
POINT_MODEL = Route("b", "model at the virtual point", _point_model)
CALIBRATED_MODEL = Route("c", "self-calibrated model", _calibrated_model)
CALIBRATED_MEASUREMENT = Route(
    "d", "measured apparent mass, self-calibrated", _calibrated_measurement, needs_model=False
)


def updated(base: Route, update: StiffnessChange | None = None) -> Route:
    """Return another route, with the mounts brought up to date by the sweep itself."""
    title = f"{base.title}, mounts updated"
    return Route("e", title, base.model, update=update or FactorOverFrequency())


UPDATED = updated(CALIBRATED_MODEL)


def _pseudo_inverse(matrix: RealArray) -> RealArray:
    return np.asarray(np.linalg.pinv(matrix), dtype=float)


def _by_impact(placement: Placement, errors: RealArray) -> RealArray:
    """Relative change of a load by gain, offsets and tilts of the hammer, shape (1 + 4 m, 6, 6)."""
    inverse = np.linalg.pinv(placement.excitation_matrix(errors))
    change = inverse @ placement.excitation_derivatives(errors)
    return np.asarray(np.swapaxes(change, -1, -2), dtype=float)


@dataclass(frozen=True, eq=False)
class _IndependentErrors:
    """Independent errors of unit deviation behind correlated ones.

    `factor` (n_error, n_independent): correlated errors are ``factor @ n``; `inverse`
    (n_independent, n_error).
    """

    factor: RealArray
    inverse: RealArray

    @classmethod
    def of(cls, covariance: RealArray) -> _IndependentErrors:
        """Divide a covariance, shape (n_error, n_error)."""
        scale = np.sqrt(np.diag(covariance))
        values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
        # a posterior of very exact data is singular up to rounding: what is certain has no slope
        kept = values > ROUNDING * values[-1]
        along, size = vectors[:, kept], np.sqrt(values[kept])
        return cls(scale[:, np.newaxis] * along * size, (along / size).T / scale)

    def scores(self, covariance: RealArray) -> RealArray:
        """Regress other errors on the independent ones, shape (n_other, n_independent).

        `covariance` (n_error, n_other): of the correlated errors with the others.
        """
        return np.asarray((self.inverse @ covariance).T)


def _combination(factor: RealArray, slopes: _Array) -> _Array:
    """Turn slopes by errors into slopes by what each column of `factor` moves together."""
    return cast("_Array", np.tensordot(factor, slopes, axes=(0, 0)))


@dataclass(frozen=True, eq=False)
class OperatingLoad:
    """Motion and load over the speed of one sweep, with the mounts as they were struck.

    `frequency` (n_frequency,): frequency of the rotation [Hz]; `lines` (n_frequency,): their
    indices among the lines of the route's model; `deviation` (n_frequency, n_channel): of the real
    and of the imaginary part of each accelerometer [m/s²]; `motion` (n_frequency, 6): acceleration
    of the virtual point, ``V⁺ a`` [m/s², rad/s²]; `load` (n_frequency, 6): ``AM V⁺ a`` [N, N m].
    """

    name: str
    pressure: float
    frequency: RealArray
    lines: npt.NDArray[np.intp]
    deviation: RealArray
    motion: ComplexArray
    load: ComplexArray

    def select(self, lines: npt.NDArray[np.intp]) -> OperatingLoad:
        """Keep these lines, given by their indices."""
        names = ("frequency", "lines", "deviation", "motion", "load")
        return replace(self, **{name: getattr(self, name)[lines] for name in names})


def operating_load(model: RouteModel, sweep: OperatingSweep) -> OperatingLoad:
    """Take the load inside out of a sweep.

    Thesis, 4.2: in-situ inverse method, ``F = AM V⁺ a``.
    """
    lines = np.searchsorted(model.frequency, sweep.frequency)
    motion = sweep.acceleration.values @ model.inverse.T
    return OperatingLoad(
        sweep.name,
        sweep.pressure,
        sweep.frequency,
        lines,
        sweep.deviation,
        motion,
        applied(model.apparent_mass[lines], motion),
    )


def noise_covariance(
    model: RouteModel, loads: Sequence[OperatingLoad], apparent_mass: Sequence[ComplexArray]
) -> ComplexArray:
    """Compute the covariance of the noise of loads at one set of lines, which they share.

    `apparent_mass` (n_frequency, 6, 6): apparent mass in each sweep, with the mounts as they are
    then [kg, kg m, kg m²]. Returns (n_frequency, 6 n, 6 n) of the real as of the imaginary part;
    independent from line to line.

    Each sweep has its own noise; that of the hammer test is the same in all of them.
    """
    lines = loads[0].lines
    n = len(loads)
    blocks = np.zeros((lines.size, n, 6, n, 6), dtype=complex)
    noise = None if model.noise is None else model.noise.select(lines)
    for i, (load, mass) in enumerate(zip(loads, apparent_mass, strict=True)):
        seen = mass @ model.inverse
        weighted = seen * load.deviation[:, np.newaxis, :] ** 2
        blocks[:, i, :, i] = weighted @ np.swapaxes(seen, 1, 2).conj()
        for j, other in enumerate(loads):
            if noise is not None:
                blocks[:, i, :, j] += noise.covariance(load.load, other.load)
    return blocks.reshape(lines.size, 6 * n, 6 * n)


def mount_covariance(model: RouteModel, loads: Sequence[OperatingLoad]) -> ComplexArray:
    """Compute the covariance of loads whose mounts have changed in a way that nothing describes.

    Returns (n_frequency, 6 n, 6 n) per squared relative change of the stiffness; of the real as of
    the imaginary part.

    ``K → K½ (1 + E) K½`` with independent entries of E, so that each direction changes by itself:
    ``(sᴴ A s) A`` with ``A = |v| K/ω²``. The mounts are the same in all sweeps.
    """
    mounts = model.mounts[loads[0].lines]
    # all entries of v K/ω² share one phase
    trace = np.trace(mounts, axis1=1, axis2=2)
    static = (mounts * (np.abs(trace) / trace)[:, np.newaxis, np.newaxis]).real
    # sensors and impacts that are not calibrated have axes of their own
    static = (static + np.swapaxes(static, 1, 2)) / 2
    motions = np.stack([load.motion for load in loads], axis=1)
    strain = motions @ static @ np.swapaxes(motions, 1, 2).conj()
    n = len(loads)
    blocks = strain[:, :, np.newaxis, :, np.newaxis] * static[:, np.newaxis, :, np.newaxis, :]
    return np.asarray(blocks.reshape(len(static), 6 * n, 6 * n))


@dataclass(frozen=True, eq=False)
class OperatingMotion:
    """Motion of the virtual point over the speed of one sweep, by calibrated sensors.

    `sweep`: name of the sweep.
    """

    sweep: str
    motion: Spectrum
    consistency: RigidConsistency


def operating_motion(
    sweep: OperatingSweep, sheet: VirtualPoint, forward: RealArray
) -> OperatingMotion:
    """Project the channels of a sweep on the motions of a rigid body.

    `sheet`: sensors as the sheet has them; `forward` (n_channel, 6): as calibrated [1, m].
    InputError: channels of other sensors, or a line without any signal.

    Thesis, eq. 27 and figure 52. A consistency that rises with the calibration shows that the
    errors were those of the sheet and not a body that bends.
    """
    point = replace(sheet, forward=forward, inverse=_pseudo_inverse(forward))
    measured = sweep.acceleration
    return OperatingMotion(
        sweep.name, motion_at_point(point, measured), response_consistency(point, measured)
    )
