"""Engine orders out of time records by the Vold-Kalman filter."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import signal
from scipy.linalg import solve_banded

from deboom.arrays import ComplexArray, RealArray, checked_array
from deboom.errors import InputError

SAMPLES_PER_PERIOD = 10
"""Samples per period of the highest frequency of interest at which a lower rate ends."""
LEAST_SAMPLES_PER_PERIOD = 4
"""Samples per period below which a record is refused."""
_RIPPLE = 110.0
"""Deviation of the passband from 1 and of the stopband from 0 that the filter is made for [dB]."""
_STEEPEST = 1e13
"""Largest ratio of penalty to data at which the solution keeps about six digits."""


def frequency_of_order(rpm: npt.ArrayLike, order: float) -> RealArray:
    """Return the frequency of an order at a speed [1/min], ``f = order · rpm / 60`` [Hz]."""
    return np.asarray(_checked_order(order) * np.asarray(rpm, dtype=float) / 60)


def rpm_of_frequency(frequency: npt.ArrayLike, order: float) -> RealArray:
    """Return the speed [1/min] at which an order has a frequency [Hz], ``60 f / order``."""
    return np.asarray(60 * np.asarray(frequency, dtype=float) / _checked_order(order))


def dominant_order(cylinders: int) -> float:
    """Return the firing order of a four-stroke engine: 1.5 for three cylinders, 2 for four.

    Each cylinder fires once in two revolutions, hence ``cylinders / 2``; valid for evenly spaced
    firing.
    """
    if cylinders < 1 or not float(cylinders).is_integer():
        raise InputError(
            f"an engine with {cylinders} cylinders has no firing order: give a whole number of at "
            "least 1"
        )
    return cylinders / 2


def _checked_order(order: float) -> float:
    if not (order > 0 and np.isfinite(order)):
        raise InputError(f"order {order} is not positive and finite: give cycles per revolution")
    return order


def lower_rate(
    values: npt.ArrayLike, rate: float, highest_frequency: float
) -> tuple[RealArray, float]:
    """Return every n-th low-pass filtered sample (n_sample, n_channel), undelayed, and the rate.

    The rate is a whole fraction of the old one, at least ten times the highest frequency [Hz] up to
    which the records must stay as they are, or the old one; the first sample keeps its time. Raises
    InputError: fewer than four samples per period, or a record shorter than the filter.

    Linear-phase Kaiser filter, flat within 1e-5 up to the highest frequency; what folds back lies
    above it. It reaches five of the new samples beyond each end, where the record is
    continued by its odd reflection.
    """
    record = np.asarray(values, dtype=float)
    if rate < LEAST_SAMPLES_PER_PERIOD * highest_frequency:
        raise InputError(
            f"a sampling rate of {rate:g} Hz is too low for {highest_frequency:.4g} Hz: it needs "
            f"{LEAST_SAMPLES_PER_PERIOD * highest_frequency:.4g} Hz"
        )
    factor = int(rate // (SAMPLES_PER_PERIOD * highest_frequency))
    if factor < 2:
        return record, rate
    lower = rate / factor
    taps, beta = signal.kaiserord(_RIPPLE, (lower - 2 * highest_frequency) / (rate / 2))
    # a reach of whole new samples puts the first new sample on the first old one
    reach = factor * int(np.ceil(taps / (2 * factor)))
    if len(record) <= reach:
        raise InputError(f"{len(record)} samples are too few to lower the rate of {rate:g} Hz")
    kernel = signal.firwin(2 * reach + 1, lower / 2, window=("kaiser", beta), fs=rate)
    longer = np.pad(record, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    thinned = signal.upfirdn(kernel, longer, down=factor, axis=0)
    first, count = 2 * reach // factor, (len(record) - 1) // factor + 1
    return np.asarray(thinned[first : first + count], dtype=float), lower


def smear(sweep_rate: npt.ArrayLike, bandwidth: npt.ArrayLike) -> RealArray:
    """Return the finest detail over frequency that order tracking keeps in a run-up [Hz].

    - `sweep_rate` of the order's frequency [Hz/s]; `bandwidth`: full half-power width [Hz].

    A ripple of period P over frequency passes at ``sweep_rate / P`` ripples per second; the filter
    keeps half their power at ``bandwidth / 2``, hence ``P = 2 |sweep_rate| / bandwidth``: anything
    finer is smeared. A narrow filter separates neighbouring orders and smears the run-up. A lightly
    damped structure driven through its resonance lags behind its steady state; that is in the
    record.
    """
    return np.asarray(2 * np.abs(sweep_rate) / np.asarray(bandwidth, dtype=float))


def vold_kalman(
    values: npt.ArrayLike,
    phase: npt.ArrayLike,
    rate: float,
    bandwidth: npt.ArrayLike,
) -> ComplexArray:
    """Return complex amplitudes of one or several orders in time, all solved together.

    Raises InputError: shapes that disagree, values that are not finite, a shaft that turns back, a
    bandwidth that is not positive, exceeds the frequency of an order or is too narrow for the rate.

    - `values` (n_sample, n_channel): time record [unit].
    - `phase` (n_sample, n_order): angle of every order at each sample, ``order · shaft angle``
      [rad]. Any tone whose phase is known can stand beside the orders; a column of zeros takes up
      the quasi-static part.
    - `rate`: samples per second [Hz].
    - `bandwidth` (n_order,): full width between the half-power (−3 dB) points about each order
      [Hz]; one number stands for all.
    - returns (n_sample, n_order, n_channel): peak amplitudes A, so that the part of an order in the
      record is ``Re(A e^{j phase})`` [unit]; for a column of zeros the quasi-static part itself.

    Least squares over all envelopes (Vold and Leuridan, SAE 931288; Tůma, Int. J. Acoustics and
    Vibration 10, 2005), here for a real record with cosine and sine of every order as unknowns:

        ``Σ_n (y_n − Re Σ_k A_k(n) e^{jφ_k(n)})² + ½ Σ_k r_k² Σ_n |∇²A_k(n)|² → min``

    with two poles and r_k from the bandwidth (`penalty`); a quasi-static part is real and has no ½.
    A constant amplitude comes out exactly, up to the ends of the record; the usual form, complex
    envelopes on a real record, mistakes an order's mirror image for noise. The normal equations
    lose up to all digits at usual rates; here ``u = r ∇²A`` is an unknown of its own, the matrix
    is banded and its condition the square root of theirs.

    Away from the ends the envelope of one order is its demodulated record through the filter
    ``1 / (1 + r² (2 sin(πf/rate))⁴)``; at the ends it looks to one side only: within about one
    over the bandwidth the noise is up to twice as large. Two orders that run together for longer
    than one over the bandwidth share their energy in a way that no method can tell.
    """
    record, angle, widths = _checked_filter(values, phase, rate, bandwidth)
    static = np.ptp(angle, axis=0) == 0
    weight = penalty(widths, rate)
    cosine, sine = np.cos(angle), -np.sin(angle[:, ~static])
    weights = np.concatenate(
        [np.where(static, weight, weight / np.sqrt(2)), weight[~static] / np.sqrt(2)]
    )
    solved = _smoothest(np.hstack([cosine, sine]), weights, record)
    amplitude = solved[:, : static.size].astype(complex)
    amplitude[:, ~static] += 1j * solved[:, static.size :]
    return amplitude


def penalty(bandwidth: npt.ArrayLike, rate: float) -> RealArray:
    """Return the weight r of the differences that gives the filter its half-power bandwidth [1].

    ``r² = (√2 − 1) / (2 sin(πB/(2 rate)))⁴``, Tůma's polynomial in cosines for two poles.
    """
    step = 2 * np.sin(np.pi * np.asarray(bandwidth, dtype=float) / (2 * rate))
    return np.asarray(np.sqrt(np.sqrt(2) - 1) / step**2)


def _smoothest(basis: RealArray, weight: RealArray, record: RealArray) -> RealArray:
    """Coefficients of the basis functions, shape (n_sample, n_basis, n_channel).

    Solves ``basisᵀ basis c + ∇ᵀ r u = basisᵀ y`` and ``r ∇ c − u = 0``. A sample's unknowns stand
    together, each c with its u; u sits at the middle of the samples that its difference reaches.
    """
    samples, functions = basis.shape
    block = 2 * functions
    width = block + 1
    # row width + i − j of the flat storage holds element (i, j) in its column j
    band = np.zeros((2 * width + 1, samples, functions, 2))
    for row in range(functions):
        for column in range(functions):
            band[width + 2 * (row - column), :, column, 0] = basis[:, row] * basis[:, column]
    band[width, :, :, 1] = -1
    for shift, share in ((-1, 1), (0, -2), (1, 1)):
        band[width - shift * block + 1, 1 + shift : samples - 1 + shift, :, 0] = share * weight
        band[width + shift * block - 1, 1:-1, :, 1] = share * weight
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


def _checked_filter(
    values: npt.ArrayLike, phase: npt.ArrayLike, rate: float, bandwidth: npt.ArrayLike
) -> tuple[RealArray, RealArray, RealArray]:
    sizes: dict[str, int] = {}
    record: RealArray = checked_array(values, "s c", "time record", sizes)
    angle: RealArray = checked_array(phase, "s order", "phase of the orders", sizes)
    if len(record) <= 4 or angle.shape[1] == 0:
        raise InputError(f"{angle.shape} phases are too few for the filter")
    axes = "order" if np.ndim(bandwidth) else ""
    given: RealArray = checked_array(bandwidth, axes, "bandwidths of the orders", sizes)
    widths = np.broadcast_to(given, angle.shape[1])
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
    if np.max(penalty(widths, rate)) * 4 > _STEEPEST:
        raise InputError(
            f"a bandwidth of {widths.min():g} Hz is too narrow for {rate:g} Hz: lower the "
            "rate first"
        )
    return record, angle, widths
