"""How far a measured FRF may be off by chance, from its coherence and its number of averages.

Random error only. Bias is not in it: noise in the input (H1 too small, at most by the coherence),
a resolution too coarse for a resonance, nonlinearity, and a second source that follows the first.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError

LARGEST_VALID_ERROR = 0.2
"""Relative error of |H| up to which the first-order formulas hold within 10 %."""


def magnitude_error(coherence: npt.ArrayLike, n_averages: float, n_inputs: int = 1) -> RealArray:
    """Relative standard deviation of |H|.

    Parameters
    ----------
    coherence : array, shape (...)
        Ordinary with one input, partial with several, 0 … 1 [1].
    n_averages : float
        Independent averages, above `n_inputs` [1].
    n_inputs : int
        Inputs that acted together.

    Returns
    -------
    array, shape (...)
        [1]; infinite where the coherence is 0. Beyond `LARGEST_VALID_ERROR` it says "large" and no
        more.

    Raises
    ------
    InputError
        A coherence outside 0 … 1, or not more averages than inputs.

    Notes
    -----
    ``√(1 − γ²) / (|γ| √(2 n))`` with ``n = n_averages − n_inputs``. Bendat and Piersol (Random
    Data, 4th ed., eq. 9.90 and section 9.3) have one more in n; what is taken here is the standard
    error of the least squares that H1 is, right from the third hit on, and the same with many.
    First order in the noise; gaussian noise, independent of the input; averages that do not
    overlap, or are counted by their worth. For H2 and Hv at high coherence.
    """
    gamma2 = _checked(coherence, n_averages, n_inputs)
    free = n_averages - n_inputs
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt((1.0 - gamma2) / (2.0 * free * gamma2)))


def phase_error(coherence: npt.ArrayLike, n_averages: float, n_inputs: int = 1) -> RealArray:
    """Return the standard deviation of the phase of H [rad].

    Parameters
    ----------
    coherence, n_averages, n_inputs
        As of `magnitude_error`.

    Returns
    -------
    array, shape (...)
        [rad]; at most π/√3, the value of a phase that can be anything.

    Raises
    ------
    InputError
        As `magnitude_error`.

    Notes
    -----
    ``arcsin`` of the relative error of |H| (Bendat and Piersol, Random Data, 4th ed., eq. 9.91).
    """
    error = magnitude_error(coherence, n_averages, n_inputs)
    anything = np.pi / np.sqrt(3.0)
    known = np.arcsin(np.minimum(error, 1.0))
    return np.asarray(np.where(error < 1.0, known, anything))


def coherence_bias(coherence: npt.ArrayLike, n_averages: float) -> RealArray:
    """Return by how much an estimated ordinary coherence is too large on average [1].

    Parameters
    ----------
    coherence : array, shape (...)
        True, 0 … 1 [1].
    n_averages : float
        Independent averages, above 1 [1].

    Returns
    -------
    array, shape (...)
        [1]; 1/n where nothing is common.

    Raises
    ------
    InputError
        A coherence outside 0 … 1, or fewer than two averages.

    Notes
    -----
    ``(1 − γ²)² / n`` (Bendat and Piersol, Random Data, 4th ed., eq. 9.75), to first order in 1/n
    and exact at both ends.
    """
    gamma2 = _checked(coherence, n_averages, 1)
    return np.asarray((1.0 - gamma2) ** 2 / n_averages)


def _checked(coherence: npt.ArrayLike, n_averages: float, n_inputs: int) -> RealArray:
    gamma2 = np.asarray(coherence, dtype=float)
    if not np.all((gamma2 >= 0) & (gamma2 <= 1)):
        raise InputError("a coherence is from 0 to 1")
    if not n_averages > n_inputs:
        raise InputError(
            f"{n_averages:g} averages of {n_inputs} input(s) have no random error that could be "
            "told from them: average more"
        )
    return gamma2
