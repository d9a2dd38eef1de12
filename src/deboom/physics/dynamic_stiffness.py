"""Dynamic stiffness of a mount out of force and displacement, and the simplest model of it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

N_PER_MM = 1e-3
"""From N/m to N/mm."""


def displacement_from_acceleration(
    acceleration: npt.ArrayLike, frequency: npt.ArrayLike
) -> ComplexArray:
    """Return the displacement of a harmonic motion, ``s = −a/ω²`` [m].

    Parameters
    ----------
    acceleration : array, shape (n_frequency, ...) — complex amplitudes [m/s²]
    frequency : array, shape (n_frequency,) — lines above 0 Hz, else InputError [Hz]
    """
    values = np.asarray(acceleration, dtype=complex)
    lines = np.asarray(frequency, dtype=float)
    if lines.ndim != 1 or values.shape[:1] != lines.shape:
        raise InputError(
            f"acceleration of shape {values.shape} and {lines.shape} frequencies differ in lines"
        )
    if not np.all(lines > 0):
        raise InputError("displacement out of acceleration needs frequencies above 0 Hz")
    omega = (2 * np.pi * lines).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(-values / omega**2, dtype=complex)


def dynamic_stiffness(force: npt.ArrayLike, displacement: npt.ArrayLike) -> ComplexArray:
    """Return the dynamic stiffness per line, ``K = f/s = f s*/|s|²`` [N/m].

    Parameters
    ----------
    force : array, shape (...) — force on the receiver at the virtual point, complex amplitudes [N]
    displacement : array, shape (...)
        Displacement of the source relative to the receiver there, nowhere 0, else InputError [m].

    Notes
    -----
    Thesis, eq. 30 (its text has force and displacement the wrong way round); a loss is a positive
    imaginary part. Where the motion is near zero the quotient is noise over noise; several records
    are better joined by `stiffness_hv`.
    """
    motion = np.asarray(displacement, dtype=complex)
    _refuse_zero(motion, "displacement")
    return np.asarray(np.asarray(force) / motion, dtype=complex)


def stiffness_h1(force: npt.ArrayLike, displacement: npt.ArrayLike) -> ComplexArray:
    """Return the dynamic stiffness over repeats with noise in the force, ``Σ f s* / Σ |s|²``.

    Noise in the displacement, independent of the motion, makes it too small by the factor signal
    energy / (signal + noise energy). Arguments and errors as for `stiffness_hv`.
    """
    moved, _, cross = _energies(force, displacement)
    _refuse_zero(moved, "displacement")
    return cross / moved


def stiffness_h2(force: npt.ArrayLike, displacement: npt.ArrayLike) -> ComplexArray:
    """Return the dynamic stiffness over repeats with noise in the displacement.

    ``Σ |f|² / Σ s f*``: noise in the force makes it too large. Arguments and errors as for
    `stiffness_hv`.
    """
    _, pushed, cross = _energies(force, displacement)
    _refuse_zero(cross, "product of force and displacement")
    return pushed / cross.conj()


def stiffness_hv(
    force: npt.ArrayLike, displacement: npt.ArrayLike, noise_ratio: npt.ArrayLike
) -> ComplexArray:
    """Return the dynamic stiffness over repeats with noise in both: the default [N/m].

    Raises InputError: shapes that differ, a noise ratio that is not positive and finite, or force
    and displacement that have nothing in common.

    - `force`, `displacement` (..., n_repeat): complex amplitudes, phase referred to the same event
      in each record [N, m].
    - `noise_ratio` (...): standard deviation of the force noise over that of the displacement
      noise, above 0 [N/m]. Far above ``|K|`` the result is that of `stiffness_h1`, far below that
      of `stiffness_h2`.

    Total least squares: the K that minimises ``Σ |f − K s₀|²/σ_f² + |s − s₀|²/σ_s²`` over K and the
    true motions s₀. With r = σ_f/σ_s, ``K = (d + √(d² + 4 r² |S_fs|²)) / 2 S_sf`` where
    ``d = S_ff − r² S_ss``. Without bias for white noise of that ratio, as the records grow in
    number.
    """
    ratio = np.asarray(noise_ratio, dtype=float)
    if not np.all(np.isfinite(ratio) & (ratio > 0)):
        raise InputError("a noise ratio is positive and finite; use stiffness_h1 or _h2 otherwise")
    moved, pushed, cross = _energies(force, displacement)
    _refuse_zero(cross, "product of force and displacement")
    difference = pushed - ratio**2 * moved
    root = np.hypot(difference, 2 * ratio * np.abs(cross))
    # the two forms are equal; each is taken where it subtracts nothing
    larger = np.abs(difference) + root
    from_force = larger / (2 * cross.conj())
    from_displacement = 2 * ratio**2 * cross / larger
    return np.asarray(np.where(difference >= 0, from_force, from_displacement), dtype=complex)


def loss_factor(stiffness: npt.ArrayLike) -> RealArray:
    """Return the loss factor ``η = Im K / Re K`` [1]; a real part of 0 raises InputError."""
    values = np.asarray(stiffness, dtype=complex)
    _refuse_zero(values.real, "real part of the stiffness")
    return np.asarray(values.imag / values.real, dtype=float)


def force_at_virtual_point(
    force_transfer_matrix: npt.ArrayLike, measured_force: npt.ArrayLike
) -> ComplexArray:
    """Return the force at the virtual point out of the summed load cells, ``FTM⁻¹ F`` [N].

    Parameters
    ----------
    force_transfer_matrix : array, shape (3, 3)
        Cells' force per force at the virtual point, averaged over frequency [1]; without an inverse
        it raises InputError.
    measured_force : array, shape (..., 3) — complex amplitudes [N]

    Notes
    -----
    Thesis, eq. 29, defines ``F_cells = FTM F``; its text then multiplies operating forces by the
    matrix, which makes every stiffness 12 % too small where the cells see 94 % of the force.
    """
    matrix = np.asarray(force_transfer_matrix)
    if matrix.shape != (3, 3):
        raise InputError(f"a force transfer matrix has shape (3, 3), not {matrix.shape}")
    if np.linalg.matrix_rank(matrix) < 3:
        raise InputError("the force transfer matrix has no inverse: was each axis excited?")
    force = np.asarray(measured_force, dtype=complex)
    return np.linalg.solve(matrix, force[..., np.newaxis])[..., 0]


def kelvin_voigt(
    frequency: npt.ArrayLike, stiffness: npt.ArrayLike, damping: npt.ArrayLike
) -> ComplexArray:
    """Return the stiffness of a spring and a viscous damper side by side, ``K = k + jωc`` [N/m].

    - `frequency` (...) [Hz]; `stiffness` k [N/m]; `damping` c [N s/m].
    """
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    loss = omega * np.asarray(damping, dtype=float)
    return np.asarray(np.asarray(stiffness, dtype=float) + 1j * loss, dtype=complex)


def _energies(
    force: npt.ArrayLike, displacement: npt.ArrayLike
) -> tuple[RealArray, RealArray, ComplexArray]:
    """``Σ|s|²``, ``Σ|f|²`` and ``Σ f s*`` over the records on the last axis."""
    pushed = np.asarray(force, dtype=complex)
    moved = np.asarray(displacement, dtype=complex)
    if pushed.shape != moved.shape or pushed.ndim == 0:
        raise InputError(
            f"force of shape {pushed.shape} and displacement of shape {moved.shape} differ"
        )
    return (
        np.sum(np.abs(moved) ** 2, axis=-1),
        np.sum(np.abs(pushed) ** 2, axis=-1),
        np.sum(pushed * moved.conj(), axis=-1),
    )


def _refuse_zero(values: npt.NDArray[np.inexact], what: str) -> None:
    zero = values == 0
    if np.any(zero):
        where = tuple(int(i) for i in np.argwhere(zero)[0])
        raise InputError(f"the {what} is 0 at index {where}: leave it out, it gives no stiffness")
