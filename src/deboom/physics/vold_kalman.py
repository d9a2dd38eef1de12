"""Vold-Kalman filter, second generation: orders followed as slowly changing complex amplitudes."""

from __future__ import annotations

from math import comb

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_banded

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

POLES = (1, 2, 3)
"""Orders of the difference that the filter keeps small; 2 unless there is a reason."""
_STEEPEST = 1e13
"""Largest ratio of penalty to data at which the solution keeps about six digits."""


def vold_kalman(
    values: npt.ArrayLike,
    phase: npt.ArrayLike,
    rate: float,
    bandwidth: npt.ArrayLike,
    poles: int = 2,
) -> ComplexArray:
    """Complex amplitudes of one or several orders in time, all solved together.

    Parameters
    ----------
    values : array, shape (n_sample, n_channel)
        Time records at a constant rate [unit].
    phase : array, shape (n_sample, n_order)
        Angle of every order at each sample, ``order · shaft angle`` [rad]. Any tone whose phase is
        known can stand beside the orders; a column of zeros takes up the quasi-static part.
    rate : float
        Samples per second [Hz].
    bandwidth : float or array, shape (n_order,)
        Full width between the half-power (−3 dB) points about each order [Hz]; an amplitude that
        changes faster than half of it is smoothed.
    poles : int
        1, 2 or 3: how steeply the filter falls beyond its bandwidth.

    Returns
    -------
    array, shape (n_sample, n_order, n_channel)
        Peak amplitudes A, so that the part of an order in the record is ``Re(A e^{j phase})``
        [unit]; for a column of zeros the quasi-static part itself.

    Raises
    ------
    InputError
        Shapes that disagree, values that are not finite, a shaft that turns back, a bandwidth
        that is not positive, exceeds the frequency of an order or is too narrow for the rate, or a
        number of poles other than 1, 2 and 3.

    Notes
    -----
    Least squares over all envelopes (Vold and Leuridan, SAE 931288; Tůma, Int. J. Acoustics and
    Vibration 10, 2005), here for a real record with cosine and sine of every order as unknowns:

        ``Σ_n (y_n − Re Σ_k A_k(n) e^{jφ_k(n)})² + ½ Σ_k r_k² Σ_n |∇^p A_k(n)|² → min``

    with p poles and r_k from the bandwidth (`penalty`); a quasi-static part is real and has no ½. A
    constant amplitude comes out exactly, up to the ends of the record; the usual form, complex
    envelopes on a real record, mistakes an order's mirror image for noise and errs by some percent
    there.

    The normal equations lose up to all digits at usual rates (condition 3e14 at 16384 Hz and 2 Hz).
    Here ``u = r ∇^p A`` is an unknown of its own; the matrix is banded and its condition is the
    square root of that.

    Away from the ends the envelope of one order is its demodulated record through
    `envelope_response`. At the ends the filter looks to one side only: within about one over the
    bandwidth the noise is up to twice as large. Two orders that run together for longer than one
    over the bandwidth share their energy in a way that no method can tell.
    """
    record, angle, widths = _checked(values, phase, rate, bandwidth, poles)
    static = np.ptp(angle, axis=0) == 0
    weight = penalty(widths, rate, poles)
    cosine, sine = np.cos(angle), -np.sin(angle[:, ~static])
    weights = np.concatenate(
        [np.where(static, weight, weight / np.sqrt(2)), weight[~static] / np.sqrt(2)]
    )
    solved = _smoothest(np.hstack([cosine, sine]), weights, record, poles)
    amplitude = solved[:, : static.size].astype(complex)
    amplitude[:, ~static] += 1j * solved[:, static.size :]
    return amplitude


def penalty(bandwidth: npt.ArrayLike, rate: float, poles: int) -> RealArray:
    """Weight of the differences that gives the filter its half-power bandwidth.

    Parameters
    ----------
    bandwidth : array_like, any shape
        Full width between the half-power points [Hz].
    rate : float
        Samples per second [Hz].
    poles : int
        Order of the difference.

    Returns
    -------
    array, same shape
        r [1].

    Notes
    -----
    ``r² = (√2 − 1) / (2 sin(πB/(2 rate)))^{2p}``; Tůma's polynomials in cosines for one, two and
    three poles are this expression written out.
    """
    step = 2 * np.sin(np.pi * np.asarray(bandwidth, dtype=float) / (2 * rate))
    return np.asarray(np.sqrt(np.sqrt(2) - 1) / step**poles)


def envelope_response(
    modulation: npt.ArrayLike, bandwidth: float, rate: float, poles: int = 2
) -> RealArray:
    """Factor by which the filter of one order passes a modulation of its amplitude.

    Parameters
    ----------
    modulation : array_like, any shape
        Frequency at which the complex amplitude changes [Hz].
    bandwidth, rate, poles
        As for `vold_kalman`.

    Returns
    -------
    array, same shape
        Between 0 and 1, without phase; exact away from the ends of a record.

    Notes
    -----
    ``H(f) = 1 / (1 + r² (2 sin(πf/rate))^{2p})``, so ``H(B/2) = 1/√2``.
    """
    step = 2 * np.sin(np.pi * np.asarray(modulation, dtype=float) / rate)
    return np.asarray(1 / (1 + (penalty(bandwidth, rate, poles) * step**poles) ** 2))


def noise_bandwidth(bandwidth: npt.ArrayLike, poles: int = 2) -> RealArray:
    """Width of the ideal filter that passes as much white noise.

    Parameters
    ----------
    bandwidth : array_like, any shape
        Full width between the half-power points [Hz].
    poles : int
        As for `vold_kalman`.

    Returns
    -------
    array, same shape
        [Hz].

    Notes
    -----
    ``∫ H² df = B (√2 − 1)^{−1/(2p)} · (π/2p) (1 − 1/2p) / sin(π/2p)``, for a bandwidth far below
    the rate.
    """
    share = 1 / (2 * poles)
    factor = np.pi * share * (1 - share) / np.sin(np.pi * share) / (np.sqrt(2) - 1) ** share
    return np.asarray(factor * np.asarray(bandwidth, dtype=float))


def _smoothest(basis: RealArray, weight: RealArray, record: RealArray, poles: int) -> RealArray:
    """Coefficients of the basis functions, shape (n_sample, n_basis, n_channel).

    Solves ``basisᵀ basis c + ∇ᵀ r u = basisᵀ y`` and ``r ∇ c − u = 0``. A sample's unknowns stand
    together, each c with its u; u sits at the middle of the samples that its difference reaches.
    """
    samples, functions = basis.shape
    before, after = poles // 2, poles - poles // 2
    block = 2 * functions
    width = max(after * block - 1, before * block + 1, block - 2)
    # row width + i − j of the flat storage holds element (i, j) in its column j
    band = np.zeros((2 * width + 1, samples, functions, 2))
    for one in range(functions):
        for other in range(functions):
            band[width + 2 * (one - other), :, other, 0] = basis[:, one] * basis[:, other]
    band[width, :, :, 1] = -1
    inside = slice(before, samples - after)
    for reach in range(poles + 1):
        shift = reach - before
        shifted = slice(before + shift, samples - after + shift)
        coefficient = (-1) ** (poles - reach) * comb(poles, reach) * weight
        band[width - shift * block + 1, shifted, :, 0] = coefficient
        band[width + shift * block - 1, inside, :, 1] = coefficient
    right = np.zeros((samples, functions, 2, record.shape[1]))
    right[:, :, 0] = basis[:, :, np.newaxis] * record[:, np.newaxis, :]
    solved = solve_banded(
        (width, width),
        band.reshape(2 * width + 1, samples * block),
        right.reshape(samples * block, -1),
        overwrite_ab=True,
        overwrite_b=True,
        check_finite=False,
    )
    return np.asarray(solved.reshape(samples, functions, 2, -1)[:, :, 0])


def _checked(
    values: npt.ArrayLike,
    phase: npt.ArrayLike,
    rate: float,
    bandwidth: npt.ArrayLike,
    poles: int,
) -> tuple[RealArray, RealArray, RealArray]:
    record, angle = np.asarray(values, dtype=float), np.asarray(phase, dtype=float)
    if poles not in POLES:
        raise InputError(f"a Vold-Kalman filter has 1, 2 or 3 poles, not {poles}")
    if record.ndim != 2 or angle.ndim != 2 or len(record) != len(angle) or angle.shape[1] == 0:
        raise InputError(
            f"records of shape {record.shape} and phases of shape {angle.shape} are not "
            "(n_sample, n_channel) and (n_sample, n_order)"
        )
    if len(record) <= 2 * poles:
        raise InputError(f"{len(record)} samples are too few for a filter of {poles} poles")
    if not (np.all(np.isfinite(record)) and np.all(np.isfinite(angle))):
        raise InputError("a time record or the phase of an order is not finite")
    try:
        widths = np.broadcast_to(np.asarray(bandwidth, dtype=float), angle.shape[1])
    except ValueError:
        raise InputError(
            f"bandwidths of shape {np.shape(bandwidth)} for {angle.shape[1]} orders: give one, or "
            "one for each order"
        ) from None
    turning = np.ptp(angle, axis=0) > 0
    steps = np.diff(angle[:, turning], axis=0)
    if np.any(steps <= 0):
        raise InputError(
            "the phase of an order stands still or falls: the shaft must not turn back"
        )
    if not (np.all(widths > 0) and np.all(widths < rate)):
        raise InputError(f"bandwidths {widths} Hz are not between 0 and the rate, {rate:g} Hz")
    slowest = steps.min(axis=0) * rate / (2 * np.pi)
    for width, lowest in zip(widths[turning], slowest, strict=True):
        if width > lowest:
            raise InputError(
                f"a bandwidth of {width:g} Hz is wider than the lowest frequency of its order, "
                f"{lowest:.3g} Hz: the order could not be told from a slow drift; narrow it"
            )
    steepest = float(np.max(penalty(widths, rate, poles))) * 2**poles
    if steepest > _STEEPEST:
        raise InputError(
            f"a bandwidth of {widths.min():g} Hz is too narrow for {rate:g} Hz and {poles} poles: "
            "lower the rate first"
        )
    return record, angle, widths
