"""Computed order tracking: resample in shaft angle, then a Fourier sum over whole revolutions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError

INTERPOLATION_DEGREE = 5
"""Of the spline through the samples."""


def angular_resample(
    values: npt.ArrayLike, angle: npt.ArrayLike, samples_per_revolution: int
) -> tuple[RealArray, RealArray]:
    """Time records at equal steps of shaft angle instead of time.

    Parameters
    ----------
    values : array, shape (n_sample, n_channel)
        [unit].
    angle : array, shape (n_sample,)
        Shaft angle at each sample, increasing [rad].
    samples_per_revolution : int
        `samples_needed` says how many.

    Returns
    -------
    revolution : array, shape (n_angle,)
        Shaft angle of the new samples, in whole steps of one over `samples_per_revolution` from the
        zero mark [rev].
    resampled : array, shape (n_angle, n_channel)
        [unit].

    Raises
    ------
    InputError
        Shapes that disagree, values that are not finite, a shaft that turns back, fewer than one
        sample per revolution, or a record too short to interpolate.

    Notes
    -----
    A quintic spline over the angle. An order at ``x = f/rate`` keeps the share
    ``1 / Σ_k (x/(x + k))⁶`` of its amplitude: 2e-6 are missing at ten samples per period, 1.5e-3 at
    four.
    """
    record, turned = np.asarray(values, dtype=float), np.asarray(angle, dtype=float)
    if record.ndim != 2 or turned.shape != record.shape[:1]:
        raise InputError(
            f"records of shape {record.shape} and shaft angles of shape {turned.shape} are not "
            "(n_sample, n_channel) and (n_sample,)"
        )
    if turned.size <= INTERPOLATION_DEGREE:
        raise InputError(f"{turned.size} samples are too few to interpolate")
    if not (np.all(np.isfinite(record)) and np.all(np.isfinite(turned))):
        raise InputError("a time record or the shaft angle is not finite")
    if np.any(np.diff(turned) <= 0):
        raise InputError("the shaft angle stands still or falls: the shaft must not turn back")
    if samples_per_revolution < 1:
        raise InputError(f"{samples_per_revolution} samples per revolution: give at least 1")
    per_radian = samples_per_revolution / (2 * np.pi)
    number = np.arange(np.ceil(turned[0] * per_radian), np.floor(turned[-1] * per_radian) + 1)
    spline = make_interp_spline(turned, record, k=INTERPOLATION_DEGREE)
    # rounding must not carry the outermost angles beyond the record
    new_angle = np.clip(number / per_radian, turned[0], turned[-1])
    return number / samples_per_revolution, np.asarray(spline(new_angle))


def samples_needed(rate: float, slowest_rpm: float, highest_order: float) -> int:
    """Return the samples per revolution at which nothing in a record folds onto the orders wanted.

    Parameters
    ----------
    rate : float
        Samples per second of the record [Hz].
    slowest_rpm : float
        Lowest shaft speed in the record [1/min].
    highest_order : float
        Cycles per revolution [1].

    Returns
    -------
    int

    Notes
    -----
    All content up to the rate, the images of the interpolation included, stays above the highest
    order: ``N ≥ order + 60 rate / rpm``.
    """
    return int(np.ceil(highest_order + 60 * rate / slowest_rpm))


def order_amplitudes(
    revolution: npt.ArrayLike,
    resampled: npt.ArrayLike,
    order: npt.ArrayLike,
    centre: npt.ArrayLike,
    revolutions: float,
) -> ComplexArray:
    """Complex amplitudes of orders, each over a Hann window about a shaft angle.

    Parameters
    ----------
    revolution : array, shape (n_angle,)
        Equidistant [rev], as `angular_resample` gives it.
    resampled : array, shape (n_angle, n_channel)
        [unit].
    order : array, shape (n_order,)
        Cycles per revolution [1].
    centre : array, shape (n_line,)
        Middle of the window of each line [rev].
    revolutions : float
        Length of the window [rev].

    Returns
    -------
    array, shape (n_line, n_order, n_channel)
        Peak amplitudes A, so that an order is ``Re(A e^{j order · angle})`` [unit].

    Raises
    ------
    InputError
        An order that is not positive, a window that leaves the record or is too short for an order.

    Notes
    -----
    ``A = 2/Σw · Σ w(θ) y(θ) e^{−j order θ}``. Constant orders that are whole multiples of
    ``1/revolutions`` apart, two or more of them, do not disturb each other: four revolutions
    separate the half orders of a four-stroke engine. The amplitude is averaged over the window with
    the weight w; see `order_tracking_resolution`.
    """
    position, record = np.asarray(revolution, dtype=float), np.asarray(resampled, dtype=float)
    orders, centres = np.atleast_1d(order).astype(float), np.atleast_1d(centre).astype(float)
    step = (position[-1] - position[0]) / (position.size - 1)
    lowest = orders.min()
    if not lowest > 0:
        raise InputError(f"order {lowest:g} is not positive: give cycles per revolution")
    if not revolutions * lowest >= 2:
        raise InputError(
            f"a window of {revolutions:g} revolutions is too short for order {lowest:g}: give at "
            f"least {2 / lowest:g}"
        )
    outside = (centres - revolutions / 2 < position[0] - step) | (
        centres + revolutions / 2 > position[-1] + step
    )
    if outside.any():
        raise InputError(
            f"the window of {revolutions:g} revolutions about revolution {centres[outside][0]:.2f} "
            f"leaves the record, which has {position[0]:.2f} to {position[-1]:.2f}"
        )
    amplitudes = np.empty((centres.size, orders.size, record.shape[1]), dtype=complex)
    for line, middle in enumerate(centres):
        inside = slice(
            *np.searchsorted(position, [middle - revolutions / 2, middle + revolutions / 2])
        )
        weight = np.cos(np.pi * (position[inside] - middle) / revolutions) ** 2
        kernel = weight * np.exp(-2j * np.pi * orders[:, np.newaxis] * position[inside])
        amplitudes[line] = 2 / weight.sum() * (kernel @ record[inside])
    return amplitudes
