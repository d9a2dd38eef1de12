"""Steady motion of a compressor on mounts that soften with their own amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.gain import AmplitudeGain, GainFactor
from deboom.errors import InputError
from deboom.measurement.inertance_test import CompressorMount
from deboom.physics.forced_response import (
    ConvergenceError,
    SteadyState,
    amplitude_dependent_response,
)
from deboom.physics.rigid_body import forward_matrices, mount_stiffness_matrix

RELAXATIONS = (0.5, 0.25, 0.12, 0.06)
"""Shares of a step, tried in turn: the next one where the one before swings without end."""
STEPS_PER_SHARE = 250
"""Steps allowed, times the inverse of the share."""
TOLERANCE = 1e-11
"""Largest relative change of an amplitude at the end [1]."""


@dataclass(frozen=True)
class AmplitudeFactor:
    """Softening of real and imaginary part of one mount's stiffness.

    Parameters
    ----------
    real, imaginary : AmplitudeGain
        Factors on the parts of the gain over frequency.

    Notes
    -----
    Second brackets of the thesis's eq. 54 and 55.
    """

    real: AmplitudeGain
    imaginary: AmplitudeGain

    def on(self, gain: ComplexArray, amplitude: RealArray) -> ComplexArray:
        """Gain over frequency and amplitude.

        Parameters
        ----------
        gain : array, shape (n_frequency,)
            Of `GainFactor.at` [1].
        amplitude : array, shape (n_frequency,)
            Of the mount [m].

        Returns
        -------
        array, shape (n_frequency,)
            Complex [1].
        """
        return np.asarray(
            gain.real * self.real.at(amplitude) + 1j * gain.imag * self.imaginary.at(amplitude)
        )


@dataclass(frozen=True, eq=False)
class AmplitudeResponse:
    """Motion in which every mount is as stiff as its own amplitude makes it.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    displacement : array, shape (n_frequency, 6)
        Of the virtual point, complex amplitudes [m, rad].
    amplitude : array, shape (n_frequency, n_mount)
        Of each mount [m].
    gain : array, shape (n_frequency, n_mount)
        Of each mount, complex [1].
    stiffness : array, shape (n_frequency, 6, 6)
        At the virtual point, in this motion [N/m, N/rad, N m/rad].
    iterations : int
        Needed by the slowest line.
    """

    frequency: RealArray
    displacement: ComplexArray
    amplitude: RealArray
    gain: ComplexArray
    stiffness: ComplexArray
    iterations: int

    def __post_init__(self) -> None:
        for name in ("frequency", "displacement", "amplitude", "gain", "stiffness"):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def acceleration(self) -> ComplexArray:
        """Of the virtual point, shape (n_frequency, 6) [m/s², rad/s²]."""
        omega = 2 * np.pi * self.frequency[:, np.newaxis]
        return np.asarray(-(omega**2) * self.displacement)


def amplitude_response(
    mass_matrix: npt.ArrayLike,
    mounts: Sequence[CompressorMount],
    gain: GainFactor,
    softening: Sequence[AmplitudeFactor],
    force: npt.ArrayLike,
    frequency: npt.ArrayLike,
    *,
    start: float = 1e-4,
) -> AmplitudeResponse:
    """Solve for the steady motion under harmonic loads at the virtual point.

    Parameters
    ----------
    mass_matrix : array, shape (6, 6)
        At the virtual point [kg, kg m, kg m²].
    mounts : sequence of CompressorMount
        At least one.
    gain : GainFactor
        Over frequency, common to all mounts.
    softening : sequence of AmplitudeFactor
        One per mount.
    force : array, shape (n_frequency, 6)
        Complex amplitudes [N, N m].
    frequency : array, shape (n_frequency,)
        Above 0 [Hz].
    start : float
        Amplitude to begin with [m].

    Returns
    -------
    AmplitudeResponse

    Raises
    ------
    InputError
        Not one factor per mount, a line at or below 0 Hz, loads that do not fit.
    ConvergenceError
        No steady state with any of `RELAXATIONS`.

    Notes
    -----
    Thesis, eq. 52-55, where ``s = |s(ω)|`` is left open: here ``s_i = |T_i s_VP|``, the root of the
    sum of squares of the three complex amplitudes at mount i (at most √2 times the true stroke,
    exact for motion along a line). The equation is implicit, since the motion needs the stiffness:
    damped fixed point on the logarithm of the amplitudes. Rubber, which softens by some ten
    percent per decade, has one solution, found in 40 to 60 steps from any start.
    """
    lines = np.asarray(frequency, dtype=float)
    if not mounts or len(softening) != len(mounts):
        raise InputError(
            f"{len(mounts)} mounts and {len(softening)} amplitude factors: give each mount its own"
        )
    if np.any(lines <= 0):
        raise InputError("a line at 0 Hz has no gain factor: start above it")
    over_frequency = gain.at(lines)
    positions = np.array([mount.position for mount in mounts])
    static = np.array([mount.stiffness for mount in mounts])
    orientations = np.array([mount.orientation for mount in mounts])

    def gains(strokes: RealArray) -> ComplexArray:
        amplitude = _amplitudes(strokes)
        parts = [one.on(over_frequency, amplitude[:, i]) for i, one in enumerate(softening)]
        return np.stack(parts, axis=1)

    def stiffness(strokes: RealArray) -> ComplexArray:
        dynamic = gains(strokes)[..., np.newaxis] * static
        return np.asarray(mount_stiffness_matrix(positions, dynamic, orientations))

    def steady(relaxation: float) -> SteadyState:
        return amplitude_dependent_response(
            mass_matrix,
            stiffness,
            force,
            lines,
            forward_matrices(positions),
            start=start,
            tolerance=TOLERANCE,
            relaxation=relaxation,
            max_iterations=round(STEPS_PER_SHARE / relaxation),
        )

    for relaxation in RELAXATIONS[:-1]:
        try:
            found = steady(relaxation)
            break
        except ConvergenceError:
            continue
    else:
        found = steady(RELAXATIONS[-1])
    return AmplitudeResponse(
        lines,
        found.displacement,
        _amplitudes(found.amplitude),
        gains(found.amplitude),
        stiffness(found.amplitude),
        found.iterations,
    )


def _amplitudes(strokes: RealArray) -> RealArray:
    """Root of the sum of squares of the three axes of each mount, shape (n_frequency, n_mount)."""
    return np.asarray(np.linalg.norm(strokes.reshape(strokes.shape[0], -1, 3), axis=2))
