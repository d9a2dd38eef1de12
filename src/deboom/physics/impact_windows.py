"""Windows of an impact test, and what the exponential one does to poles.

A force window cuts the noise after the push. An exponential window lets the response of a lightly
damped body die out within the block; it does not just smooth: it measures another body.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


def force_window(
    n_sample: int, rate: float, begin: float, end: float, taper: float = 0.0
) -> RealArray:
    """1 while the hammer touches, 0 otherwise, with a cosine at both ends.

    Parameters
    ----------
    n_sample : int
        Samples of a block.
    rate : float
        Samples per second [Hz].
    begin, end : float
        Of the flat part, from the first sample of the block [s].
    taper : float
        Duration of the rise before `begin` and of the fall after `end` [s].

    Returns
    -------
    array, shape (n_sample,)
        0 … 1 [1].

    Raises
    ------
    InputError
        No sample in the flat part, or a taper that is negative.

    Notes
    -----
    For the force alone. It leaves the FRF unbiased if the force outside is nothing but noise; take
    the offset of the force out first, or the window makes a step of it.
    """
    time = np.arange(n_sample) / rate
    if taper < 0 or not np.any((time >= begin) & (time <= end)):
        raise InputError(
            f"a force window from {begin:g} s to {end:g} s with a taper of {taper:g} s holds no "
            f"sample of a block of {n_sample / rate:g} s"
        )
    outside = np.maximum(np.maximum(begin - time, time - end), 0.0)
    if taper == 0:
        return np.asarray(np.where(outside > 0, 0.0, 1.0))
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * np.minimum(outside / taper, 1.0)))


def exponential_window(
    n_sample: int, rate: float, time_constant: float, begin: float = 0.0
) -> RealArray:
    """``e^{−(t − begin)/τ}`` over the whole block.

    Parameters
    ----------
    n_sample : int
        Samples of a block.
    rate : float
        Samples per second [Hz].
    time_constant : float
        τ [s].
    begin : float
        Where it is 1, from the first sample of the block: when the hammer strikes [s].

    Returns
    -------
    array, shape (n_sample,)
        Above 1 before `begin` [1].

    Raises
    ------
    InputError
        A time constant that is not positive.

    Notes
    -----
    For force and response, both: then the measured function is exactly ``H(jω + 1/τ)`` in place of
    ``H(jω)``, that of a body whose every pole lies 1/τ further left. No formula brings H(jω) back
    from its values; poles that were fitted to it do come back, see `corrected_pole`. Between forms
    of such a function the factor is ``jω + 1/τ``: displacement is ``a/(jω + 1/τ)²``, not
    ``−a/ω²``.
    """
    if not time_constant > 0:
        raise InputError(
            f"the time constant of an exponential window is positive, not {time_constant} s"
        )
    time = np.arange(n_sample) / rate
    return np.asarray(np.exp(-(time - begin) / time_constant))


def corrected_pole(pole: npt.ArrayLike, time_constant: float) -> ComplexArray:
    """Pole of the body out of the one fitted to windowed data, ``s = s_fitted + 1/τ``.

    Parameters
    ----------
    pole : array, shape (...)
        Fitted, ``−ζω + jω√(1 − ζ²)`` [rad/s].
    time_constant : float
        Of the exponential window of force and response, τ [s].

    Returns
    -------
    array, shape (...)
        [rad/s].

    Raises
    ------
    InputError
        A time constant that is not positive, or a pole that the window alone would move further
        than it lies: no decay is left.

    Notes
    -----
    The damped frequency Im s is left as it is; the decay rate −Re s shrinks by 1/τ. An error of the
    fitted decay rate stays as it is, so its share of a small damping grows.
    """
    if not time_constant > 0:
        raise InputError(
            f"the time constant of an exponential window is positive, not {time_constant} s"
        )
    corrected = np.asarray(pole, dtype=complex) + 1.0 / time_constant
    growing = corrected.real >= 0
    if np.any(growing):
        worst = complex(np.asarray(pole).reshape(-1)[int(np.argmax(corrected.real))])
        raise InputError(
            f"a fitted pole at {worst:.6g} rad/s decays more slowly than the exponential window "
            f"alone, 1/{time_constant:g} s: the fit or the time constant is wrong"
        )
    return np.asarray(corrected, dtype=complex)


def corrected_damping_ratio(
    damping_ratio: npt.ArrayLike, frequency: npt.ArrayLike, time_constant: float
) -> RealArray:
    """Damping ratio of the body out of the one fitted to windowed data.

    Parameters
    ----------
    damping_ratio : array, shape (...)
        Fitted, ζ [1].
    frequency : array, broadcastable
        Fitted undamped natural frequency |s|/2π [Hz].
    time_constant : float
        Of the exponential window of force and response, τ [s].

    Returns
    -------
    array, shape (...)
        [1].

    Raises
    ------
    InputError
        As `corrected_pole`.

    Notes
    -----
    ``−Re s / |s|`` of the corrected pole; for small damping ``ζ − 1/(ω τ)``.
    """
    zeta, omega = np.broadcast_arrays(
        np.asarray(damping_ratio, dtype=float), 2 * np.pi * np.asarray(frequency, dtype=float)
    )
    pole = corrected_pole(omega * (-zeta + 1j * np.sqrt(1.0 - zeta**2)), time_constant)
    return np.asarray(-pole.real / np.abs(pole))
