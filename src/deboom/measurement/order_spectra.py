"""Time records and a shaft angle to complex order spectra over engine speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.shaft_angle import ShaftAngle
from deboom.measurement.time_record import TimeRecord
from deboom.physics.order_tracking import angular_resample, order_amplitudes, samples_needed
from deboom.physics.order_tracking_rate import SAMPLES_PER_PERIOD, lower_rate
from deboom.physics.order_tracking_resolution import hann_bandwidth, hann_noise_bandwidth, smear
from deboom.physics.orders import frequency_of_order
from deboom.physics.vold_kalman import noise_bandwidth, vold_kalman

STATIC_SHARE = 8.0
"""Lowest frequency of an order over the bandwidth of what counts as quasi-static beside it."""


@dataclass(frozen=True, eq=False)
class OrderSpectrum:
    """One order over engine speed, with what it can resolve.

    Parameters
    ----------
    order : float
        Cycles per revolution [1].
    rpm : array, shape (n_line,)
        Speed of each line [1/min].
    time : array, shape (n_line,)
        When the run passed it [s].
    spectrum : Spectrum
        Complex peak amplitudes, phase to the tacho's zero mark, over ``order · rpm / 60``.
    bandwidth : array, shape (n_line,)
        Full half-power width about the order: what lies nearer is not separated [Hz].
    noise_bandwidth : array, shape (n_line,)
        For `order_tracking_resolution.noise_amplitude` [Hz].
    sweep_rate : array, shape (n_line,)
        Rate of change of the order's frequency [Hz/s].
    settled : array of bool, shape (n_line,)
        False where the filter reached the end of the record and looked to one side only.
    """

    order: float
    rpm: RealArray
    time: RealArray
    spectrum: Spectrum
    bandwidth: RealArray
    noise_bandwidth: RealArray
    sweep_rate: RealArray
    settled: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        for field in ("rpm", "time", "bandwidth", "noise_bandwidth", "sweep_rate", "settled"):
            array = np.array(getattr(self, field))
            array.setflags(write=False)
            object.__setattr__(self, field, array)

    @property
    def smear(self) -> RealArray:
        """Finest ripple over frequency that is kept, at 1/√2 of its size, shape (n_line,) [Hz]."""
        return smear(self.sweep_rate, self.bandwidth)


def computed_order_spectrum(
    record: TimeRecord,
    shaft: ShaftAngle,
    order: float,
    rpm: npt.ArrayLike,
    *,
    revolutions: float = 8.0,
) -> OrderSpectrum:
    """Order spectrum by computed order tracking: angular resampling and a Hann window.

    Parameters
    ----------
    record : TimeRecord
    shaft : ShaftAngle
        On the same clock.
    order : float
        Cycles per revolution [1].
    rpm : array, shape (n_line,)
        Speeds of the lines, increasing [1/min]; the run itself may rise or fall.
    revolutions : float
        Length of the window [rev]; a multiple of 4 separates half orders.

    Returns
    -------
    OrderSpectrum

    Raises
    ------
    InputError
        A speed that the run does not pass, a window that leaves the record, or a sampling rate too
        low for the order.

    Notes
    -----
    A force that rises with the torque would leak into the windows, so the quasi-static part is
    taken out first; 4e-5 of the order goes with it.
    """
    speeds, time = _lines(shaft, rpm)
    samples, values, rate = _prepared(record, shaft, order, 0.0)
    angle = shaft.angle(samples) / (2 * np.pi)
    reach = revolutions / 2
    possible = (angle >= angle[0] + reach) & (angle <= angle[-1] - reach)
    _refuse_lines_outside(shaft, speeds, time, samples[possible], f"{revolutions:g} revolutions")
    centre = shaft.angle(time) / (2 * np.pi)
    # one revolution more than the windows need keeps the ends of the spline away from them
    used = (angle > centre.min() - reach - 1) & (angle < centre.max() + reach + 1)
    slowest = float(shaft.rpm(samples[used]).min())
    needed = samples_needed(rate, slowest, order)
    static_width = float(frequency_of_order(slowest, order)) / STATIC_SHARE
    slow = vold_kalman(values, np.zeros((samples.size, 1)), rate, static_width)[:, 0].real
    revolution, resampled = angular_resample((values - slow)[used], 2 * np.pi * angle[used], needed)
    amplitudes = order_amplitudes(revolution, resampled, [order], centre, revolutions)[:, 0]
    return OrderSpectrum(
        order=order,
        rpm=speeds,
        time=time,
        spectrum=_spectrum(record, order, speeds, amplitudes),
        bandwidth=hann_bandwidth(speeds, revolutions),
        noise_bandwidth=hann_noise_bandwidth(speeds, revolutions),
        sweep_rate=frequency_of_order(shaft.rpm_rate(time), order),
        settled=np.ones(speeds.size, dtype=bool),
    )


def vold_kalman_spectra(
    record: TimeRecord,
    shaft: ShaftAngle,
    orders: Sequence[float],
    rpm: npt.ArrayLike,
    *,
    bandwidth: npt.ArrayLike,
    poles: int = 2,
) -> tuple[OrderSpectrum, ...]:
    """Order spectra by a Vold-Kalman filter that solves all orders together.

    Parameters
    ----------
    record : TimeRecord
    shaft : ShaftAngle
        On the same clock.
    orders : sequence of float
        Cycles per revolution, each positive [1]; name every strong order, not only the wanted one.
    rpm : array, shape (n_line,)
        Speeds of the lines, increasing [1/min]; the run itself may rise or fall.
    bandwidth : float or array, shape (n_order,)
        Full half-power width about each order [Hz].
    poles : int
        1, 2 or 3.

    Returns
    -------
    tuple of OrderSpectrum
        One per order.

    Raises
    ------
    InputError
        A speed that the run does not pass, a bandwidth wider than the lowest frequency of an order,
        or a sampling rate too low for the highest.

    Notes
    -----
    The quasi-static part of the record, such as the static force on a cell, is solved together with
    the orders, so that it does not leak into them.
    """
    widths = _widths(orders, bandwidth)
    speeds, time = _lines(shaft, rpm)
    samples, values, rate = _prepared(record, shaft, max(orders), widths.max())
    _refuse_lines_outside(shaft, speeds, time, samples, "its line")
    phase = shaft.angle(samples)[:, np.newaxis] * np.concatenate([[0.0], orders])
    all_widths = np.concatenate([[widths.min()], widths])
    envelopes = vold_kalman(values, phase, rate, all_widths, poles)[:, 1:]
    amplitudes = CubicSpline(samples, envelopes)(time)
    from_end = np.minimum(time - samples[0], samples[-1] - time)
    return tuple(
        OrderSpectrum(
            order=order,
            rpm=speeds,
            time=time,
            spectrum=_spectrum(record, order, speeds, amplitudes[:, column]),
            bandwidth=np.full(speeds.size, width),
            noise_bandwidth=np.full(speeds.size, float(noise_bandwidth(width, poles))),
            sweep_rate=frequency_of_order(shaft.rpm_rate(time), order),
            settled=from_end >= 1 / width,
        )
        for column, (order, width) in enumerate(zip(orders, widths, strict=True))
    )


def quasi_static(
    record: TimeRecord, shaft: ShaftAngle, rpm: npt.ArrayLike, *, bandwidth: float
) -> RealArray:
    """Slow part of a record at the lines of an order spectrum: static force, torque.

    Parameters
    ----------
    record : TimeRecord
    shaft : ShaftAngle
        On the same clock.
    rpm : array, shape (n_line,)
        Speeds of the lines, increasing [1/min].
    bandwidth : float
        Half of it is the highest frequency that counts as slow; far below the lowest order [Hz].

    Returns
    -------
    array, shape (n_line, n_channel)
        [unit of the record].

    Raises
    ------
    InputError
        A speed that the run does not pass or the record does not hold.

    Notes
    -----
    The Vold-Kalman filter at order 0, two poles: what oscillates at f passes by
    ``1/(1 + 0.41 (2f/bandwidth)⁴)``.
    """
    speeds, time = _lines(shaft, rpm)
    samples, values, rate = _cut(record, shaft, SAMPLES_PER_PERIOD * bandwidth)
    _refuse_lines_outside(shaft, speeds, time, samples, "its line")
    slow = vold_kalman(values, np.zeros((samples.size, 1)), rate, bandwidth)[:, 0].real
    return np.asarray(CubicSpline(samples, slow)(time))


def _widths(orders: Sequence[float], bandwidth: npt.ArrayLike) -> RealArray:
    if len(orders) == 0 or min(orders) <= 0:
        raise InputError(f"orders {list(orders)} are not positive: give cycles per revolution")
    widths = np.asarray(bandwidth, dtype=float)
    if widths.shape not in {(), (len(orders),)} or not np.all(widths > 0):
        raise InputError(
            f"bandwidths {widths.tolist()} Hz for {len(orders)} orders: give one above 0 Hz, or "
            "one for each order"
        )
    return np.broadcast_to(widths, len(orders))


def _lines(shaft: ShaftAngle, rpm: npt.ArrayLike) -> tuple[RealArray, RealArray]:
    speeds = np.asarray(rpm, dtype=float)
    if speeds.ndim != 1 or speeds.size == 0 or np.any(np.diff(speeds) <= 0):
        raise InputError("the speeds of an order spectrum must be a list that increases")
    return speeds, shaft.time_at(speeds)


def _prepared(
    record: TimeRecord, shaft: ShaftAngle, highest_order: float, bandwidth: float
) -> tuple[RealArray, RealArray, float]:
    """Cut the record for the orders up to the highest one, at the highest speed."""
    highest = float(frequency_of_order(shaft.rpm_range()[1], highest_order))
    return _cut(record, shaft, highest + bandwidth)


def _cut(
    record: TimeRecord, shaft: ShaftAngle, highest: float
) -> tuple[RealArray, RealArray, float]:
    """Lower the rate and cut to where the shaft is known; times, values and rate."""
    values, rate = lower_rate(record.values, record.rate, highest)
    times = record.start + np.arange(len(values)) / rate
    known = (times >= shaft.begin) & (times <= shaft.end)
    if np.count_nonzero(known) < 2:
        raise InputError(
            f"the record, {times[0]:.3f} to {times[-1]:.3f} s, and the tacho, {shaft.begin:.3f} to "
            f"{shaft.end:.3f} s, do not overlap"
        )
    return times[known], values[known], rate


def _refuse_lines_outside(
    shaft: ShaftAngle, rpm: RealArray, time: RealArray, possible: RealArray, needed: str
) -> None:
    if possible.size == 0:
        raise InputError(f"the record is shorter than {needed}")
    outside = (time < possible[0]) | (time > possible[-1])
    if outside.any():
        low, high = np.sort(shaft.rpm(possible[[0, -1]]))
        raise InputError(
            f"the record does not hold {needed} about {rpm[outside][0]:g} 1/min: lines from "
            f"{low:.1f} to {high:.1f} 1/min are possible"
        )


def _spectrum(
    record: TimeRecord, order: float, rpm: RealArray, amplitudes: ComplexArray
) -> Spectrum:
    return Spectrum(frequency_of_order(rpm, order), amplitudes, record.channels, record.unit)
