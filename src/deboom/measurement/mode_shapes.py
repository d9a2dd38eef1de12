"""Mode shapes: alike or not, real or complex, and the phase in which they are largest."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics.correlation import mac


def mac_matrix(first: npt.ArrayLike, second: npt.ArrayLike) -> RealArray:
    """Compare every shape of one set with every shape of another.

    Parameters
    ----------
    first : array, shape (n_first, n_output)
        Real or complex, of any scale.
    second : array, shape (n_second, n_output)
        The same outputs in the same order; outputs of one unit, since the largest ones count.

    Returns
    -------
    array, shape (n_first, n_second)
        Modal assurance criterion [1].

    Raises
    ------
    InputError
        Other numbers of outputs, or a shape that is zero.
    """
    rows, columns = np.atleast_2d(first), np.atleast_2d(second)
    if rows.shape[1] != columns.shape[1]:
        raise InputError(
            f"shapes of {rows.shape[1]} and of {columns.shape[1]} outputs cannot be compared: give "
            "the same outputs in the same order"
        )
    return mac(rows.T[:, :, np.newaxis], columns.T[:, np.newaxis, :])


def phase_collinearity(shapes: npt.ArrayLike) -> RealArray:
    """Find how nearly the entries of each shape share one phase, or its opposite (MPC).

    Parameters
    ----------
    shapes : array, shape (..., n_output)
        Complex.

    Returns
    -------
    array, shape (...)
        1 for a real shape times any factor, 0 for a wave that only travels [1].

    Notes
    -----
    Without the mean removed, after Pappa, Elliott and Schenk (1993)::

        MPC = ((Sxx − Syy)² + 4 Sxy²) / (Sxx + Syy)²,  S of real and imaginary parts

    which equals ``|φᵀφ|² / (φᴴφ)²``. A body whose damping is spread like its mass and stiffness has
    real shapes; noise and modes that overlap lower it.
    """
    values = np.asarray(shapes, dtype=complex)
    alike = np.abs(np.sum(values**2, axis=-1)) ** 2
    return np.asarray(alike / np.sum(np.abs(values) ** 2, axis=-1) ** 2)


def in_common_phase(shapes: npt.ArrayLike) -> ComplexArray:
    """Turn each shape to the phase in which it is as real as it can be, largest entry positive.

    Parameters
    ----------
    shapes : array, shape (..., n_output)
        Complex.

    Returns
    -------
    array, shape (..., n_output)
        Largest entry of size 1; what stays imaginary is what travels.
    """
    values = np.asarray(shapes, dtype=complex)
    turned = values * np.exp(-0.5j * np.angle(np.sum(values**2, axis=-1, keepdims=True)))
    place = np.abs(turned).argmax(axis=-1)[..., np.newaxis]
    largest = np.take_along_axis(turned, place, axis=-1)
    sign = np.where(largest.real < 0, -1.0, 1.0)
    return np.asarray(sign * turned / np.abs(largest))
