"""How alike two complex curves are: in shape (MAC, corr_f) and in scale (MSF, corr_s)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


def mac(a: npt.ArrayLike, b: npt.ArrayLike) -> RealArray:
    """Return the modal assurance criterion of two curves.

    Parameters
    ----------
    a, b : array_like, shape (n_frequency, ...)
        Complex values to compare along the first axis; the other axes broadcast. Mode shapes have
        their degrees of freedom in the place of the lines.

    Returns
    -------
    array, shape (...)
        0 (nothing in common) to 1 (one is a complex multiple of the other) [1].

    Raises
    ------
    InputError
        Different numbers of lines, or a curve that is zero on all lines.

    Notes
    -----
    ``MAC = |aᴴ b|² / (aᴴ a · bᴴ b)``. Give complex pressures or their magnitudes, never decibels:
    two dB curves share a large mean, which makes MAC close to 1 for any pair.
    """
    first, second = _checked_pair(a, b)
    cross = np.abs(_inner(first, second)) ** 2
    return np.asarray(cross / (_energy(first) * _energy(second)))


def msf(a: npt.ArrayLike, reference: npt.ArrayLike) -> ComplexArray:
    """Return the modal scale factor, the complex factor that brings a reference closest to a curve.

    Parameters
    ----------
    a, reference : array_like, shape (n_frequency, ...)
        Complex values to compare along the first axis; the other axes broadcast.

    Returns
    -------
    array, shape (...)
        Complex c of the least-squares fit ``a = c · reference`` [1].

    Raises
    ------
    InputError
        Different numbers of lines, or a curve that is zero on all lines.

    Notes
    -----
    ``MSF = refᴴ a / (refᴴ ref)``. Without the conjugate, or with the real part alone, a difference
    in phase comes back as a difference in scale. ``msf(a, b) · msf(b, a) = mac(a, b)``.
    """
    compared, base = _checked_pair(a, reference)
    return np.asarray(_inner(base, compared) / _energy(base))


def corr_f(a: npt.ArrayLike, b: npt.ArrayLike) -> RealArray:
    """Return the difference in shape of two curves.

    Parameters
    ----------
    a, b : array_like, shape (n_frequency, ...)
        Complex pressures, or their magnitudes; see `mac`.

    Returns
    -------
    array, shape (...)
        0 (same shape) to 1 [1].

    Raises
    ------
    InputError
        As `mac`.

    Notes
    -----
    ``corr_f = |1 − MAC|``, thesis, eq. 33.
    """
    return np.abs(1 - mac(a, b))


def corr_s(a: npt.ArrayLike, reference: npt.ArrayLike) -> RealArray:
    """Return the difference in scale of a curve from a reference.

    Parameters
    ----------
    a, reference : array_like, shape (n_frequency, ...)
        Complex pressures (the difference then includes a common phase), or their magnitudes; see
        `msf`.

    Returns
    -------
    array, shape (...)
        0 for the same scale [1].

    Raises
    ------
    InputError
        As `msf`.

    Notes
    -----
    ``corr_s = |1 − MSF|``, thesis, eq. 34. Not symmetric: it is relative to the reference.
    """
    return np.abs(1 - msf(a, reference))


def _inner(a: ComplexArray, b: ComplexArray) -> ComplexArray:
    """Return the Hermitian product aᴴ b over the first axis."""
    return np.asarray(np.sum(a.conj() * b, axis=0))


def _energy(a: ComplexArray) -> RealArray:
    return np.asarray(np.sum(np.abs(a) ** 2, axis=0))


def _checked_pair(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    first, second = np.asarray(a, dtype=complex), np.asarray(b, dtype=complex)
    if first.ndim == 0 or second.ndim == 0 or len(first) != len(second):
        raise InputError(
            f"curves of shapes {first.shape} and {second.shape} cannot be compared: give the same "
            "lines along the first axis"
        )
    for curve in (first, second):
        if np.any(_energy(curve) == 0):
            raise InputError("a curve that is zero on all lines has neither shape nor scale")
    return first, second
