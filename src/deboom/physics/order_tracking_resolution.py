"""What an order spectrum can resolve: neighbours, changes over a run-up, and noise."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray

HANN_HALF_POWER_WIDTH = 1.4405826
"""Full width of a Hann window's transform between its half-power points, times its length [1]."""
HANN_NOISE_WIDTH = 1.5
"""Noise bandwidth of a Hann window, times its length [1]."""


def hann_bandwidth(rpm: npt.ArrayLike, revolutions: float) -> RealArray:
    """Full width between the half-power points of computed order tracking.

    Parameters
    ----------
    rpm : array_like, any shape
        Shaft speed in the middle of the window [1/min].
    revolutions : float
        Length of the Hann window [rev].

    Returns
    -------
    array, same shape
        [Hz].

    Notes
    -----
    ``B = 1.44 / (duration of the window)``; in orders ``1.44 / revolutions`` at every speed.
    """
    return np.asarray(HANN_HALF_POWER_WIDTH * np.asarray(rpm, dtype=float) / (60 * revolutions))


def hann_noise_bandwidth(rpm: npt.ArrayLike, revolutions: float) -> RealArray:
    """Width of the ideal filter that passes as much white noise as the window.

    Parameters
    ----------
    rpm, revolutions
        As for `hann_bandwidth`.

    Returns
    -------
    array, same shape as rpm
        [Hz].
    """
    return np.asarray(HANN_NOISE_WIDTH * np.asarray(rpm, dtype=float) / (60 * revolutions))


def smear(sweep_rate: npt.ArrayLike, bandwidth: npt.ArrayLike) -> RealArray:
    """Finest detail over frequency that order tracking keeps in a run-up.

    Parameters
    ----------
    sweep_rate : array_like
        Rate of change of the order's frequency, either sign [Hz/s].
    bandwidth : array_like, broadcasts with sweep_rate
        Full width of the filter between its half-power points [Hz].

    Returns
    -------
    array
        Period over frequency of a ripple of the amplitude that comes out at 1/√2 of its size;
        anything finer is smeared [Hz]. 0 at constant speed.

    Notes
    -----
    A ripple of period P over frequency passes at ``sweep_rate / P`` ripples per second; the filter
    keeps half their power at ``bandwidth / 2``, hence ``P = 2 |sweep_rate| / bandwidth``. A narrow
    filter separates neighbouring orders and smears the run-up, a wide one the other way round; no
    window escapes that product.

    It speaks of the record only. A lightly damped structure driven through its resonance lags
    behind the steady state that the same speeds would bring; that is in the record, not in the
    order tracking.
    """
    return np.asarray(2 * np.abs(sweep_rate) / np.asarray(bandwidth, dtype=float))


def noise_amplitude(density: npt.ArrayLike, noise_bandwidth: npt.ArrayLike) -> RealArray:
    """Root mean square of the peak amplitude that noise alone pretends.

    Parameters
    ----------
    density : array_like
        One-sided power density of the noise about the order [unit²/Hz].
    noise_bandwidth : array_like, broadcasts with density
        [Hz].

    Returns
    -------
    array
        ``√(2 G B)``: the noise passes with power ``G B`` and an amplitude has twice its power
        [unit].
    """
    return np.asarray(np.sqrt(2 * np.asarray(density, dtype=float) * noise_bandwidth))
