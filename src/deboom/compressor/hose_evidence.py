"""What sweeps and hammer tests say about hoses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.placement import deviation_from_coherence
from deboom.compressor.routes import FactorOverFrequency
from deboom.compressor.unbalance_load import RotationSense
from deboom.errors import InputError
from deboom.measurement.compressor_test import HoseState, OperatingSweep, OperatingTest
from deboom.physics.rigid_body import skew

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification

SAME_PRESSURE = 0.02
"""Pressures that differ by less than this part are one."""
SAME_LINE = 1e-6
"""Lines that differ by less than this part are one."""
SMALLEST_LINES = 10


@dataclass(frozen=True, eq=False)
class RunningCompressor:
    """Apparent mass of a compressor without hoses while its rotor turns.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Of the rotation [Hz].
    apparent_mass : array, shape (n_frequency, 6, 6)
        At the virtual point [kg, kg m, kg m²].
    mounts : array, shape (n_frequency, 6, 6)
        Part of the mounts, ``(1 + δ) v K/ω²`` [kg, kg m, kg m²].
    length : float
        At which a rotation counts as much as a translation [m].
    """

    frequency: RealArray
    apparent_mass: ComplexArray
    mounts: ComplexArray
    length: float


def running_compressor(
    found: Identification,
    frequency: npt.ArrayLike,
    *,
    change: npt.ArrayLike = 0.0,
    rotor_inertia: float | None = None,
    sense: RotationSense = RotationSense.POSITIVE,
) -> RunningCompressor:
    """Turn the compressor of the hammer test into the running one.

    Parameters
    ----------
    found : Identification
    frequency : array, shape (n_frequency,)
        Above 0 [Hz].
    change : complex array, shape (n_frequency,) or ()
        δ of the mounts' dynamic stiffness against the hammer test, as the unbalance room finds it
        [1].
    rotor_inertia : float, optional
        Polar moment of the rotor; without it the gyroscopic moment is left out [kg m²].
    sense : RotationSense

    Returns
    -------
    RunningCompressor

    Notes
    -----
    ``AM = M − (1 + δ) v K/ω² + j J skew(e_x)`` in the rotational block.
    """
    lines = np.asarray(frequency, dtype=float)
    model = found.calibrated.model
    factor = model.gain.at(lines) * (1 + np.asarray(change)) / (2 * np.pi * lines) ** 2
    mounts = factor[:, np.newaxis, np.newaxis] * model.stiffness
    mass = model.mass_matrix - mounts
    if rotor_inertia is not None:
        mass[:, 3:, 3:] += 1j * sense.value * rotor_inertia * skew([1.0, 0.0, 0.0])
    return RunningCompressor(lines, mass, mounts, found.length)


@dataclass(frozen=True, eq=False)
class SweepPair:
    """Motion of the virtual point with soft and with standard hoses at one pressure.

    Parameters
    ----------
    soft_name, standard_name : str
        Of the sweeps.
    pressure : float
        [Pa].
    frequency : array, shape (n_frequency,)
        Lines of both [Hz].
    soft, standard : array, shape (n_frequency, 6)
        [m/s², rad/s²].
    soft_covariance, standard_covariance : array, shape (n_frequency, 6, 6)
        Of the real as of the imaginary part.
    inverse : array, shape (6, n_channel)
        Channels → motion of the virtual point, by which they were found.
    """

    soft_name: str
    standard_name: str
    pressure: float
    frequency: RealArray
    soft: ComplexArray
    standard: ComplexArray
    soft_covariance: RealArray
    standard_covariance: RealArray
    inverse: RealArray


def sweep_pairs(
    test: OperatingTest, found: Identification, band: tuple[float, float] = (17.0, 150.0)
) -> tuple[SweepPair, ...]:
    """Find for each sweep with standard hoses the one with soft hoses that goes with it.

    Parameters
    ----------
    test : OperatingTest
    found : Identification
        With the accelerometers of the sweeps.
    band : (float, float)
        Lines that are kept [Hz].

    Returns
    -------
    tuple of SweepPair
        At least one, in the order of the sweeps with standard hoses.

    Raises
    ------
    InputError
        No pressure at which both were run over common lines.

    Notes
    -----
    Rotor and gas are those of the pressure and the speed, whatever the hoses: the two motions
    differ by the hoses alone, as long as the mounts kept their temperature.
    """
    pairs = []
    for standard in test.with_hoses(HoseState.STANDARD):
        partners = [
            (soft, _common(soft, standard, band))
            for soft in test.with_hoses(HoseState.SOFT)
            if abs(soft.pressure / standard.pressure - 1) < SAME_PRESSURE
        ]
        partners = [one for one in partners if one[1][0].size >= SMALLEST_LINES]
        if partners:
            soft, lines = max(partners, key=lambda one: one[1][0].size)
            pairs.append(_pair(soft, standard, lines, found))
    if not pairs:
        raise InputError(
            f"{test.name}: no pressure was run with standard and with soft hoses over common lines "
            f"between {band[0]:g} and {band[1]:g} Hz: what the hoses do cannot be told from what "
            "the rotor does"
        )
    return tuple(pairs)


def motion_at_virtual_point(
    sweep: OperatingSweep, found: Identification
) -> tuple[ComplexArray, RealArray]:
    """Project the channels of a sweep on the calibrated virtual point.

    Parameters
    ----------
    sweep : OperatingSweep
    found : Identification

    Returns
    -------
    motion : array, shape (n_frequency, 6)
        [m/s², rad/s²].
    covariance : array, shape (n_frequency, 6, 6)
        Of the real as of the imaginary part.

    Raises
    ------
    InputError
        Channels of other sensors than those of the hammer test.
    """
    if sweep.acceleration.channels != found.test.frf.outputs:
        raise InputError(
            f"sweep {sweep.name} has other accelerometers than {found.test.name}: the "
            "sensors must stay where they were struck"
        )
    inverse = calibrated_inverse(found)
    covariance = (inverse * sweep.deviation[:, np.newaxis] ** 2) @ inverse.T
    return np.asarray(sweep.acceleration.values @ inverse.T), np.asarray(covariance)


def calibrated_inverse(found: Identification) -> RealArray:
    """Channels → motion of the virtual point, as the hammer test calibrated them.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    array, shape (6, n_channel)
        [1, 1/m].
    """
    calibrated = found.calibrated
    return np.asarray(np.linalg.pinv(calibrated.placement.response_matrix(calibrated.errors)))


def _common(
    soft: OperatingSweep, standard: OperatingSweep, band: tuple[float, float]
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Find the lines that both sweeps have: their indices in each of them."""
    own, other = soft.frequency, standard.frequency
    nearest = np.abs(other - own[:, np.newaxis]).argmin(axis=1)
    same = np.abs(other[nearest] / own - 1) < SAME_LINE
    kept = np.flatnonzero(same & (own >= band[0]) & (own <= band[1]))
    return kept, nearest[kept]


def _pair(
    soft: OperatingSweep,
    standard: OperatingSweep,
    lines: tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]],
    found: Identification,
) -> SweepPair:
    motion, covariance = motion_at_virtual_point(soft, found)
    other, other_covariance = motion_at_virtual_point(standard, found)
    first, second = lines
    return SweepPair(
        soft.name,
        standard.name,
        standard.pressure,
        soft.frequency[first],
        motion[first],
        other[second],
        covariance[first],
        other_covariance[second],
        calibrated_inverse(found),
    )


if TYPE_CHECKING:
    from collections.abc import Sequence

    from deboom.compressor.hose_evidence import RunningCompressor, SweepPair
    from deboom.compressor.identify import Identification
    from deboom.measurement.compressor_test import InertanceTest, OperatingTest

HIT_SCATTER = 5e-4
"""Of the hits around their mark, per axis, 1 σ [m]."""


class Residuals(NamedTuple):
    """Deviations in units of their noise, and their derivatives.

    Parameters
    ----------
    values : array, shape (n,)
        Complex, both parts of unit deviation [1].
    slopes : array, shape (n_hose_number + n_nuisance, n)
        By the numbers of the hoses, then by the nuisances.
    """

    values: ComplexArray
    slopes: ComplexArray


class Changes(NamedTuple):
    """What k errors of the identification change, each alone.

    Parameters
    ----------
    apparent_mass : array, shape (k, n_frequency, 6, 6)
        [kg, kg m, kg m²].
    response : array, shape (k, n_channel, 6)
        Calibrated sensors [1, m].
    excitation : array, shape (k, n_impact, 6)
        Calibrated impacts [1, m].
    """

    apparent_mass: ComplexArray
    response: RealArray
    excitation: RealArray


class HoseEvidence(Protocol):
    """A measurement with hoses beside one without, as a function of the hoses' stiffness."""

    @property
    def name(self) -> str:
        """Such as ``hammer tests``."""
        ...

    @property
    def frequency(self) -> RealArray:
        """Lines at which the stiffness is wanted, shape (n_frequency,) [Hz]."""
        ...

    @property
    def nuisance_deviations(self) -> RealArray:
        """1 σ of what is estimated along and of no interest, shape (n_nuisance,)."""
        ...

    def residuals(
        self, stiffness: ComplexArray, slopes: ComplexArray, nuisances: RealArray
    ) -> Residuals:
        """Compare with a stiffness (n_frequency, 6, 6) and its slopes (k, n_frequency, 6, 6)."""
        ...

    def by_identification(
        self, stiffness: ComplexArray, nuisances: RealArray, changes: Changes
    ) -> ComplexArray:
        """Differentiate the residuals by errors of the identification, shape (k, n)."""
        ...


@dataclass(frozen=True, eq=False)
class HammerEvidence:
    """Inertance with hoses less inertance without, in coordinates of white noise.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    difference : array, shape (n_frequency, 6, 6)
        ``Q_Vᵀ (Y_with − Y_without) Q_U``, with the calibrated ``V = Q_V R_V``, ``U = Q_U R_U``
        [1/kg].
    deviation : array, shape (n_frequency,)
        Of the real as of the imaginary part of each entry [1/kg].
    apparent_mass : array, shape (n_frequency, 6, 6)
        Of the identified compressor without hoses [kg, kg m, kg m²].
    response, excitation : array, shape (6, 6)
        R_V and R_U [1, m].
    channels, impacts : array, shape (n_channel, 6) and (n_impact, 6)
        Q_V and Q_U [1].
    scatter : float
        Of the middle of each impact's hits between the two tests, 1 σ [m].

    Notes
    -----
    Errors of sensors, hammer and model are the same in both tests and leave the difference but
    for a share of itself. The hits do not strike where they struck before: 18 nuisances, moments
    in the columns of U.
    """

    frequency: RealArray
    difference: ComplexArray
    deviation: RealArray
    apparent_mass: ComplexArray
    response: RealArray
    excitation: RealArray
    channels: RealArray
    impacts: RealArray
    scatter: float

    @property
    def name(self) -> str:
        """For statements."""
        return "hammer tests"

    @property
    def nuisance_deviations(self) -> RealArray:
        """Of the moments per newton [m]."""
        return np.full(18, self.scatter)

    def residuals(
        self, stiffness: ComplexArray, slopes: ComplexArray, nuisances: RealArray
    ) -> Residuals:
        """See `HoseEvidence`; ``H_with = (AM − K_h/ω²)⁻¹``."""
        squared = ((2 * np.pi * self.frequency) ** 2)[:, np.newaxis, np.newaxis]
        with_hoses = np.linalg.inv(self.apparent_mass - stiffness / squared)
        without = np.linalg.inv(self.apparent_mass)
        seen, struck = self.response @ with_hoses, self._struck(nuisances)
        predicted = seen @ struck.T - self.response @ without @ self.excitation.T
        scale = self.deviation[:, np.newaxis, np.newaxis]
        by_hose = seen @ (slopes / squared) @ (with_hoses @ struck.T)
        by_scatter = np.zeros((6, 3, *seen.shape), dtype=complex)
        for impact in range(6):
            by_scatter[impact, :, :, :, impact] = np.moveaxis(seen[:, :, 3:], -1, 0)
        derivatives = np.concatenate([by_hose, by_scatter.reshape(18, *seen.shape)]) / scale
        deviation: ComplexArray = (predicted - self.difference) / scale
        return Residuals(
            deviation.reshape(-1),
            np.asarray(derivatives.reshape(derivatives.shape[0], -1), dtype=complex),
        )

    def by_identification(
        self, stiffness: ComplexArray, nuisances: RealArray, changes: Changes
    ) -> ComplexArray:
        """See `HoseEvidence`; both inertances answer."""
        squared = ((2 * np.pi * self.frequency) ** 2)[:, np.newaxis, np.newaxis]
        with_hoses = np.linalg.inv(self.apparent_mass - stiffness / squared)
        without = np.linalg.inv(self.apparent_mass)
        by_mass = without @ changes.apparent_mass @ without
        by_mass -= with_hoses @ changes.apparent_mass @ with_hoses
        own, struck = with_hoses - without, self._struck(nuisances).T
        seen = (self.channels.T @ changes.response)[:, np.newaxis]
        moved = np.swapaxes(self.impacts.T @ changes.excitation, -1, -2)[:, np.newaxis]
        change = (self.response @ by_mass + seen @ own) @ struck + self.response @ own @ moved
        scaled = change / self.deviation[:, np.newaxis, np.newaxis]
        return np.asarray(scaled.reshape(scaled.shape[0], -1))

    def _struck(self, nuisances: RealArray) -> RealArray:
        """R_U with the hits where they struck the second time."""
        return self.excitation + np.hstack([np.zeros((6, 3)), nuisances.reshape(6, 3)])


def hammer_evidence(
    without: InertanceTest,
    with_hoses: InertanceTest,
    found: Identification,
    *,
    band: tuple[float, float],
    largest_lines: int,
    scatter: float = HIT_SCATTER,
) -> HammerEvidence:
    """Compare two hammer tests of one compressor.

    Parameters
    ----------
    without, with_hoses : InertanceTest
        Same sensors, impacts and lines.
    found : Identification
        Identified from `without`.
    band : (float, float)
        Lines that are used [Hz].
    largest_lines : int
        Denser ones are thinned evenly.
    scatter : float
        Of single hits around their mark, per axis, 1 σ [m].

    Returns
    -------
    HammerEvidence

    Raises
    ------
    InputError
        Other sensors, impacts or lines, or no line in the band.
    """
    for test in (without, with_hoses):
        if test.frf.outputs != found.test.frf.outputs or test.frf.inputs != found.test.frf.inputs:
            raise InputError(
                f"{test.name} has other sensors or impacts than {found.test.name}: keep the "
                "sensors, strike the same points"
            )
    lines = without.frf.frequency
    if not np.array_equal(lines, with_hoses.frf.frequency):
        raise InputError(
            f"{without.name} and {with_hoses.name} have other lines: record both with one setting"
        )
    kept = np.flatnonzero((lines >= band[0]) & (lines <= band[1]))
    if not kept.size:
        raise InputError(f"{without.name} has no line between {band[0]:g} and {band[1]:g} Hz")
    if kept.size > largest_lines:
        spread = np.linspace(0, kept.size - 1, largest_lines)
        kept = kept[np.round(spread).astype(int)]
    calibrated = found.calibrated
    seen, response = np.linalg.qr(calibrated.placement.response_matrix(calibrated.errors))
    struck, excitation = np.linalg.qr(calibrated.placement.excitation_matrix(calibrated.errors))
    change = (with_hoses.frf.values - without.frf.values)[kept]
    variance = sum(
        np.mean(
            deviation_from_coherence(test.frf, test.coherence, test.n_averages)[kept] ** 2, (1, 2)
        )
        for test in (without, with_hoses)
    )
    hits = 1 / without.n_averages + 1 / with_hoses.n_averages
    floor = (1e-9 * np.abs(without.frf.values).max()) ** 2
    return HammerEvidence(
        lines[kept],
        np.asarray(seen.T @ change @ struck),
        np.sqrt(np.maximum(variance, floor)),
        calibrated.model.apparent_mass(lines[kept]),
        response,
        excitation,
        seen,
        struck,
        scatter * float(np.sqrt(hits)),
    )


@dataclass(frozen=True, eq=False)
class SweepEvidence:
    """Motion with standard hoses as predicted from that with soft ones at one pressure.

    Parameters
    ----------
    pair : SweepPair
    state : RunningCompressor
        At its lines.
    whitening : array, shape (n_frequency, 6, 6)
        ``L⁻¹`` of the covariance of both motions.
    basis : array, shape (n_unknown, n_frequency)
        Change δ of the mounts in operation per real unknown, complex [1].
    nuisance_deviations : array, shape (n_unknown,)
        1 σ of each [1].

    Notes
    -----
    ``(AM − K_h/ω²) a_standard = AM a_soft``: rotor and gas drop out, no unbalance is needed, and
    the apparent mass counts in the product ``AM⁻¹ K_h`` only.
    """

    pair: SweepPair
    state: RunningCompressor
    whitening: RealArray
    basis: ComplexArray
    nuisance_deviations: RealArray

    @property
    def name(self) -> str:
        """For statements."""
        return f"sweeps {self.pair.standard_name} and {self.pair.soft_name}"

    @property
    def frequency(self) -> RealArray:
        """Of the pair [Hz]."""
        return self.pair.frequency

    def residuals(
        self, stiffness: ComplexArray, slopes: ComplexArray, nuisances: RealArray
    ) -> Residuals:
        """See `HoseEvidence`."""
        squared = ((2 * np.pi * self.frequency) ** 2)[:, np.newaxis, np.newaxis]
        change = nuisances @ self.basis
        mounts = self.state.mounts
        now = self.state.apparent_mass - change[:, np.newaxis, np.newaxis] * mounts
        coupled = np.linalg.solve(now, stiffness / squared)
        answer = np.linalg.inv(np.eye(6) - coupled)
        predicted = answer @ self.pair.soft[..., np.newaxis]
        deviation = self.whitening @ (predicted - self.pair.standard[..., np.newaxis])
        pushed = self.whitening @ answer @ np.linalg.inv(now)
        by_hose = (pushed @ ((slopes / squared) @ predicted))[..., 0]
        by_change = (pushed @ mounts @ (coupled @ predicted))[..., 0]
        derivatives = np.concatenate([by_hose, self.basis[:, :, np.newaxis] * by_change])
        return Residuals(deviation.reshape(-1), derivatives.reshape(derivatives.shape[0], -1))

    def by_identification(
        self, stiffness: ComplexArray, nuisances: RealArray, changes: Changes
    ) -> ComplexArray:
        """See `HoseEvidence`; ``∂a = (AM − K_h/ω²)⁻¹ ∂AM (a_soft − a)``, ``∂V⁺ = −V⁺ ∂V V⁺``."""
        squared = ((2 * np.pi * self.frequency) ** 2)[:, np.newaxis, np.newaxis]
        change = nuisances @ self.basis
        now = self.state.apparent_mass - change[:, np.newaxis, np.newaxis] * self.state.mounts
        loaded = now - stiffness / squared
        soft, standard = (
            motion[..., np.newaxis] for motion in (self.pair.soft, self.pair.standard)
        )
        misread = -(self.pair.inverse @ changes.response)[:, np.newaxis]
        pushed = changes.apparent_mass @ (soft - np.linalg.solve(loaded, now @ soft))
        answer = np.linalg.solve(loaded, pushed + now @ (misread @ soft)) - misread @ standard
        return np.asarray((self.whitening @ answer).reshape(answer.shape[0], -1))


def sweep_evidence(
    test: OperatingTest,
    found: Identification,
    *,
    band: tuple[float, float],
    mounts: FactorOverFrequency | None = None,
    sense: RotationSense = RotationSense.POSITIVE,
) -> tuple[SweepEvidence, ...]:
    """Compare sweeps with standard and with soft hoses at each pressure that has both.

    Parameters
    ----------
    test : OperatingTest
    found : Identification
        From its hammer test without hoses.
    band : (float, float)
        Lines that are used [Hz].
    mounts : FactorOverFrequency, optional
        How the mounts may differ from the hammer test; estimated along.
    sense : RotationSense
        Of the rotor, for its gyroscopic moment.

    Returns
    -------
    tuple of SweepEvidence

    Raises
    ------
    InputError
        No pressure with both.
    """
    mounts = mounts or FactorOverFrequency()
    result = []
    for pair in sweep_pairs(test, found, band):
        state = running_compressor(
            found, pair.frequency, rotor_inertia=test.rotor_inertia, sense=sense
        )
        noise = pair.soft_covariance + pair.standard_covariance
        result.append(
            SweepEvidence(
                pair,
                state,
                np.asarray(np.linalg.inv(np.linalg.cholesky(noise)), dtype=float),
                mounts.basis(pair.frequency),
                mounts.deviations,
            )
        )
    return tuple(result)


def stack(parts: Sequence[Residuals], first: int) -> tuple[RealArray, RealArray]:
    """Put residuals of several measurements of the same hoses below each other, real.

    Parameters
    ----------
    parts : sequence of Residuals
        Each with nuisances of its own.
    first : int
        Number of the hoses' numbers, which all share.

    Returns
    -------
    values : array, shape (n,)
    jacobian : array, shape (n, first + n_nuisance)
    """
    sizes = [part.slopes.shape[0] - first for part in parts]
    values, rows = [], []
    at = first
    for part, size in zip(parts, sizes, strict=True):
        block = np.zeros((2 * part.values.size, first + sum(sizes)))
        real = np.ascontiguousarray(part.slopes).view(float).T
        block[:, :first], block[:, at : at + size] = real[:, :first], real[:, first:]
        at += size
        values.append(part.values.view(float))
        rows.append(block)
    return np.concatenate(values), np.concatenate(rows)
