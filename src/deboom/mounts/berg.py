"""Berg's friction element: how rubber softens and loses energy with the amplitude."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray
from deboom.errors import InputError

SMALL = 1e-4
"""Relative amplitude below which the closed form cancels and its leading terms are exact enough."""


def friction_stiffness(relative_amplitude: npt.ArrayLike) -> ComplexArray:
    """First harmonic of Berg's friction force in the steady state.

    Parameters
    ----------
    relative_amplitude : array, shape (...)
        Displacement amplitude over the displacement at which half of the friction force is reached,
        at least 0 [1].

    Returns
    -------
    array, shape (...)
        Complex stiffness over the stiffness at vanishing amplitude [1]: from 1 without loss at rest
        to 0 at large amplitudes.

    Raises
    ------
    InputError
        A negative amplitude.

    Notes
    -----
    M. Berg, Vehicle System Dynamics 30 (1998), 197-212: from the turning point (x_s, F_s) on,
    ``F = F_s + (x - x_s) (F_max - F_s) / (x_2 (1 - F_s/F_max) + x - x_s)``. Over a cycle of
    amplitude ``r x_2`` the force at the turning points is ``m F_max`` with
    ``m = (√(1 + 6 r + r²) - 1 - r)/2``. With ``B = 1 + m``, ``c = B + r`` and ``q = √(c² - r²)``
    the first Fourier coefficients are::

        Re = 2 B² / (q (c + q))
        Im = 2/(π r²) [2 r - B² ln(1 + 2 r/B)]        (the loss of Berg's eq. 8)
    """
    r = np.asarray(relative_amplitude, dtype=float)
    if np.any(r < 0):
        raise InputError("a displacement amplitude is a peak value of at least 0")
    base = 1 + (np.sqrt(1 + 6 * r + r**2) - 1 - r) / 2
    middle = base + r
    root = np.sqrt(middle**2 - r**2)
    storage = 2 * base**2 / (root * (middle + root))
    # far from cancelling, then replaced by the leading term of the series
    safe = np.maximum(r, SMALL)
    loss = 2 / (np.pi * safe**2) * (2 * safe - base**2 * np.log1p(2 * safe / base))
    loss = np.where(r < SMALL, 8 * r / (3 * np.pi), loss)
    return np.asarray(storage + 1j * loss, dtype=complex)
