"""A compressor as it runs, and sweeps that differ by their hoses only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.unbalance_load import RotationSense
from deboom.errors import InputError
from deboom.measurement.operating_sweep import HoseState, OperatingSweep, OperatingTest
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
