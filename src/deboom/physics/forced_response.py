"""Steady harmonic motion of a body, or of any linear system, on complex stiffnesses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray, checked
from deboom.errors import InputError
from deboom.physics.rigid_body import rigid_body_modes

SMALLEST_AMPLITUDE = 1e-12
"""Smallest amplitude that a stiffness is asked for [m]."""
MOST_ITERATIONS = 200
"""Iterations after which an amplitude-dependent steady state is given up."""


class ConvergenceError(ArithmeticError):
    """An amplitude-dependent steady state was not found."""


def dynamic_stiffness_matrix(
    mass_matrix: npt.ArrayLike, stiffness: npt.ArrayLike, frequency: npt.ArrayLike
) -> RealOrComplexArray:
    """Return force per displacement, ``K − ω²M``, shape (n_frequency, n, n) [N/m, N/rad, N m/rad].

    Arguments as for `forced_response`. Divided by −ω² it is the apparent mass ``M − K/ω²``.
    """
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)[:, np.newaxis, np.newaxis]
    matrix: RealOrComplexArray = np.asarray(stiffness) - omega**2 * np.asarray(mass_matrix)
    return matrix


def forced_response(
    mass_matrix: npt.ArrayLike,
    stiffness: npt.ArrayLike,
    force: npt.ArrayLike,
    frequency: npt.ArrayLike,
) -> ComplexArray:
    """Return the displacement under harmonic loads, ``(K − ω²M) q = F``, solved line by line.

    Thesis, eq. 47 and 59 (with the damping inside K). Raises InputError: loads that do not fit, or
    an undamped system in resonance.

    Parameters
    ----------
    mass_matrix : array, shape (n, n) — mass matrix [kg, kg m, kg m²]
    stiffness : array, shape (n_frequency, n, n) or (n, n) — complex [N/m, N/rad, N m/rad]
    force : array, shape (n_frequency, n) — complex amplitudes [N, N m]
    frequency : array, shape (n_frequency,) — lines [Hz]

    Returns
    -------
    array, shape (n_frequency, n) — complex amplitudes [m, rad]
    """
    impedance = dynamic_stiffness_matrix(mass_matrix, stiffness, frequency)
    load = np.asarray(force, dtype=complex)
    if load.shape != impedance.shape[:2]:
        raise InputError(
            f"loads have shape (n_frequency, n) = {impedance.shape[:2]}, not {load.shape}"
        )
    try:
        return np.linalg.solve(impedance.astype(complex), load[..., np.newaxis])[..., 0]
    except np.linalg.LinAlgError:
        raise InputError(
            "a line lies on a resonance without damping: give the stiffness a loss"
        ) from None


def modal_superposition(
    mass_matrix: npt.ArrayLike,
    stiffness: npt.ArrayLike,
    gain: npt.ArrayLike,
    force: npt.ArrayLike,
    frequency: npt.ArrayLike,
) -> ComplexArray:
    """Return the displacement as a sum over modes, for one gain common to all stiffness.

    As `forced_response`, with a real, static stiffness (n, n) and the complex dynamic gain v of
    each line: the stiffness of a line is ``v K``. Errors as of `rigid_body_modes`.

    Notes
    -----
    ``q = Ψ (S ∘ Ψᵀ F)``, ``S_r = 1/(v ω_r² − ω²)`` with ``Ψᵀ M Ψ = I``: thesis, eq. 62-75, where Ψ
    is also written for Ψᵀ and Ψ⁻¹ and the last line lacks a term. Exact for the common gain only;
    mounts whose gains differ by ±15 % make it wrong by up to 47 % near the modes. A cross-check of
    `forced_response`, not its replacement.
    """
    mode_frequency, shapes = rigid_body_modes(mass_matrix, stiffness)
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)[:, np.newaxis]
    common = np.asarray(gain, dtype=complex)[:, np.newaxis]
    per_mode = 1 / (common * (2 * np.pi * mode_frequency) ** 2 - omega**2)
    modal_load = np.asarray(force, dtype=complex) @ shapes
    return np.asarray((per_mode * modal_load) @ shapes.T, dtype=complex)


@checked(displacement="f n", amplitude="f a")
class SteadyState:
    """Steady motion on stiffnesses that depend on its own amplitude.

    - `displacement` (n_frequency, n): displacement of the body, complex amplitudes [m, rad].
    - `amplitude` (n_frequency, n_amplitude): amplitudes on which the stiffness depends [m].
    """

    displacement: ComplexArray
    amplitude: RealArray


def amplitude_dependent_response(
    mass_matrix: npt.ArrayLike,
    stiffness: Callable[[RealArray], npt.ArrayLike],
    force: npt.ArrayLike,
    frequency: npt.ArrayLike,
    motion: npt.ArrayLike,
    *,
    start: npt.ArrayLike = 1e-4,
    tolerance: float = 1e-9,
    relaxation: float = 1.0,
) -> SteadyState:
    """Return the displacement under harmonic loads when the stiffness depends on the amplitude.

    Raises InputError: an option out of range, or loads that do not fit; ConvergenceError, with the
    frequency of the line: no steady state within `MOST_ITERATIONS`, or a stiffness that is not
    finite.

    Parameters
    ----------
    mass_matrix, force, frequency
        Arguments as for `forced_response`.
    stiffness : callable
        Amplitudes (n_frequency, n_amplitude) [m] → complex stiffness (n_frequency, n, n), by line.
    motion : array, shape (n_amplitude, n)
        Displacement of the body → motions whose amplitudes the stiffness depends on, such as the
        forward matrices of the mounts.
    start : float or array, shape (n_frequency, n_amplitude) — amplitudes to begin with, above 0 [m]
    tolerance : float — largest change of the logarithm of an amplitude at the end [1]
    relaxation : float — share of each step, 0 to 1; below 1 calms an iteration that swings

    Notes
    -----
    Fixed point ``ln X ← ln |T q(K(X))|``. A line rests once it has converged, so that its result
    does not depend, but for rounding, on the lines solved beside it. The mild softening of rubber
    leaves one fixed point; a strongly nonlinear spring can have several, and `start` then decides
    which one is found. One harmonic stands for the motion.
    """
    if not 0 < relaxation <= 1:
        raise InputError(f"relaxation lies above 0 and up to 1, not {relaxation}")
    lines = np.asarray(frequency, dtype=float)
    to_motion = np.asarray(motion, dtype=float)
    load = np.asarray(force, dtype=complex)
    amplitude = np.broadcast_to(np.asarray(start, float), (lines.size, to_motion.shape[0]))
    if not np.all(amplitude > 0):
        raise InputError("the amplitudes to begin with must be above 0")
    logarithm = np.log(amplitude)
    displacement = np.zeros_like(load)
    moving = np.ones(lines.size, dtype=bool)
    for _ in range(MOST_ITERATIONS):
        matrices = np.asarray(stiffness(np.exp(logarithm)))
        solved = forced_response(mass_matrix, matrices, load, lines)
        displacement = np.where(moving[:, np.newaxis], solved, displacement)
        moved = np.maximum(np.abs(displacement @ to_motion.T), SMALLEST_AMPLITUDE)
        step = np.where(moving[:, np.newaxis], np.log(moved) - logarithm, 0.0)
        change = np.max(np.abs(step), axis=1)
        if not np.all(np.isfinite(change)):
            lost = lines[int(np.argmin(np.isfinite(change)))]
            raise ConvergenceError(f"stiffness or load is not finite at {lost:g} Hz")
        logarithm = logarithm + relaxation * step
        moving = change > tolerance
        if not moving.any():
            return SteadyState(displacement, moved)
    worst = int(np.argmax(change))
    raise ConvergenceError(
        f"no steady state at {lines[worst]:g} Hz after {MOST_ITERATIONS} iterations (amplitudes "
        f"still change by {change[worst]:.1g}): try a relaxation below {relaxation:g}"
    )
