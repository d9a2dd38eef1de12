"""From a run over time to an operating run: the dominant order's spectra, torque, static force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import OperatingRun
from deboom.measurement.order_spectra import (
    OrderSpectrum,
    computed_order_spectrum,
    quasi_static,
    vold_kalman_spectra,
)
from deboom.measurement.shaft_angle import ShaftAngle, shaft_angle
from deboom.measurement.tacho import pulse_times
from deboom.measurement.tacho_repair import repair_pulses
from deboom.measurement.time_record import TimeRecord
from deboom.measurement.time_run import TimeRun

STATIC_BANDWIDTH = 1.0
"""Of what counts as quasi-static: an order above 4 Hz passes by less than 1 % [Hz]."""

BESIDE = 0.25
"""A four-stroke engine has half orders alone: a quarter order beside one there is none."""


class OrderTracking(Enum):
    """How an order is taken out of a time record."""

    VOLD_KALMAN = "vold-kalman"
    RESAMPLING = "resampling"


@dataclass(frozen=True)
class TrackingOptions:
    """How a run over time is tracked.

    Parameters
    ----------
    method : OrderTracking
        Vold-Kalman filter, or angular resampling with a Hann window.
    bandwidth : float
        Of the Vold-Kalman filter, full half-power width [Hz].
    revolutions : float
        Length of the Hann window [rev]; a multiple of 4 separates half orders.
    other_orders : tuple of float or None
        Strong orders that the filter solves together with the dominant one [1]; by default 0.5,
        twice and four times the dominant order.
    lowest_rpm, highest_rpm : float or None
        Range of the lines [1/min]; by default all that the record holds with a settled filter.
    rpm_step : float
        Between the lines [1/min].

    Raises
    ------
    InputError
        A width, window, step or order that is not positive, or an empty range.
    """

    method: OrderTracking = OrderTracking.VOLD_KALMAN
    bandwidth: float = 3.0
    revolutions: float = 12.0
    other_orders: tuple[float, ...] | None = None
    lowest_rpm: float | None = None
    highest_rpm: float | None = None
    rpm_step: float = 10.0

    def __post_init__(self) -> None:
        for name in ("bandwidth", "revolutions", "rpm_step"):
            if not getattr(self, name) > 0:
                raise InputError(
                    f"order tracking: {name.replace('_', ' ')} {getattr(self, name):g} is not "
                    "positive"
                )
        if self.other_orders is not None and min(self.other_orders, default=1.0) <= 0:
            raise InputError(f"order tracking: orders {list(self.other_orders)} are not positive")
        low, high = self.lowest_rpm, self.highest_rpm
        if low is not None and high is not None and not low < high:
            raise InputError(f"order tracking: no engine speed lies between {low:g} and {high:g}")


DEFAULT_TRACKING = TrackingOptions()


@dataclass(frozen=True, eq=False)
class TrackedRun:
    """An operating run that was a run over time, and how far its spectra may be believed.

    Parameters
    ----------
    run : OperatingRun
        Spectra of the dominant order, engine torque and static force over its lines.
    order : OrderSpectrum
        Of the accelerations: lines, bandwidth, smear.
    shaft : ShaftAngle
        From the repaired tacho.
    acceleration_beside, force_beside : float
        Amplitude that shows a quarter order beside the dominant one, where a four-stroke engine has
        none, relative to the dominant one (rms over lines, median over channels) [1]: what noise
        and neighbours pretend.
    """

    run: OperatingRun
    order: OrderSpectrum
    shaft: ShaftAngle
    acceleration_beside: float
    force_beside: float

    def report(self) -> tuple[str, ...]:
        """Lines, resolution and uncertainty in words."""
        spectrum, frequency = self.order, self.run.frequency
        sweep = np.abs(spectrum.sweep_rate)
        lines = [
            f"{frequency.size} lines of order {spectrum.order:g}, {spectrum.rpm[0]:g} to "
            f"{spectrum.rpm[-1]:g} 1/min ({frequency[0]:g} to {frequency[-1]:g} Hz)",
            f"{self.shaft.pulses.report()}; jitter {np.rad2deg(self.shaft.jitter):.2g}°",
            f"bandwidth {spectrum.bandwidth.max():.3g} Hz; at up to {sweep.max():.2g} Hz/s it "
            f"smears what is finer than {spectrum.smear.max():.2g} Hz",
            f"noise and neighbouring orders: {100 * self.acceleration_beside:.2g} % of the "
            f"acceleration, {100 * self.force_beside:.2g} % of the force (rms, median channel)",
        ]
        unsettled = int(np.count_nonzero(~spectrum.settled))
        if unsettled:
            lines.append(
                f"{unsettled} lines lie so near the ends of the record that the filter saw one "
                "side only: narrow the range to leave them out"
            )
        return tuple(lines)


def tracked_run(
    time_run: TimeRun, options: TrackingOptions = DEFAULT_TRACKING, name: str | None = None
) -> TrackedRun:
    """Make an operating run of a run over time.

    Parameters
    ----------
    time_run : TimeRun
        Channels, tacho, torque and static forces over time.
    options : TrackingOptions
        How.
    name : str, optional
        Of the operating run; that of the time run if left out.

    Returns
    -------
    TrackedRun

    Raises
    ------
    InputError
        A tacho that cannot be repaired, a speed outside of the run, a record too short or sampled
        too slowly.

    Notes
    -----
    Phases refer to the first pulse of the tacho, as those of all channels of the run do. A dynamic
    stiffness does not depend on which pulse that is.
    """
    try:
        return _tracked(time_run, options, time_run.name if name is None else name)
    except InputError as error:
        raise InputError(f"time run {time_run.name}: {error}") from None


def _tracked(time_run: TimeRun, options: TrackingOptions, name: str) -> TrackedRun:
    rate = time_run.sample_rate
    shaft = shaft_angle(
        repair_pulses(pulse_times(time_run.tacho, rate), time_run.pulses_per_revolution)
    )
    rpm = _lines(shaft, options)
    acceleration = TimeRecord(time_run.acceleration, rate, time_run.acceleration_channels, "m/s^2")
    force = TimeRecord(time_run.cell_force, rate, time_run.cell_force_channels, "N")
    of_motion, beside_motion = _spectra(acceleration, shaft, time_run.order, rpm, options)
    of_force, beside_force = _spectra(force, shaft, time_run.order, rpm, options)
    slow = TimeRecord(
        np.column_stack([time_run.engine_torque, time_run.static_force]),
        rate,
        ("engine torque", *time_run.static_force_names),
        "1",
    )
    torque, *static = quasi_static(slow, shaft, rpm, bandwidth=STATIC_BANDWIDTH).T
    run = OperatingRun(
        name=name,
        mount_set=time_run.mount_set,
        gear=time_run.gear,
        total_ratio=time_run.total_ratio,
        full_load=time_run.full_load,
        torque_limit=time_run.torque_limit,
        rising=time_run.rising,
        order=time_run.order,
        engine_torque=torque,
        acceleration=of_motion.spectrum,
        cell_force=of_force.spectrum,
        static_force=np.reshape(static, (len(static), rpm.size)).T,
        static_force_names=time_run.static_force_names,
    )
    return TrackedRun(
        run,
        of_motion,
        shaft,
        _share(beside_motion, of_motion),
        _share(beside_force, of_force),
    )


def _lines(shaft: ShaftAngle, options: TrackingOptions) -> RealArray:
    """Speeds at multiples of the step, within the range asked for or that the filter settles in."""
    step = options.rpm_step
    if options.method is OrderTracking.VOLD_KALMAN:
        ends = np.array([shaft.begin + 1 / options.bandwidth, shaft.end - 1 / options.bandwidth])
    else:
        turned = shaft.angle([shaft.begin, shaft.end]) / (2 * np.pi)
        # half a window, and one revolution for the ends of the resampling
        reach = options.revolutions / 2 + 1
        times = np.linspace(shaft.begin, shaft.end, 1000)
        ends = np.interp(
            [turned[0] + reach, turned[1] - reach], shaft.angle(times) / (2 * np.pi), times
        )
    if not ends[0] < ends[1]:
        raise InputError(
            f"its {shaft.end - shaft.begin:.2f} s are too short for the filter: take a larger "
            "bandwidth, fewer revolutions, or measure for longer"
        )
    # an uneven speed may lie beyond that of the first or the last pulse for a while
    low, high = np.clip(np.sort(shaft.rpm(ends)), *np.sort(shaft.rpm([shaft.begin, shaft.end])))
    low = low if options.lowest_rpm is None else options.lowest_rpm
    high = high if options.highest_rpm is None else options.highest_rpm
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    if last <= first:
        raise InputError(
            f"fewer than two lines lie between {low:.1f} and {high:.1f} 1/min in steps of "
            f"{step:g}: take a smaller step, or a wider range"
        )
    return np.asarray(step * np.arange(first, last + 1))


def _spectra(
    record: TimeRecord,
    shaft: ShaftAngle,
    order: float,
    rpm: RealArray,
    options: TrackingOptions,
) -> tuple[OrderSpectrum, OrderSpectrum]:
    """Spectrum of the order, and of what shows beside it."""
    beside = order + BESIDE
    if options.method is OrderTracking.RESAMPLING:
        found, empty = (
            computed_order_spectrum(record, shaft, q, rpm, revolutions=options.revolutions)
            for q in (order, beside)
        )
        return found, empty
    others = options.other_orders
    if others is None:
        others = (0.5, 2 * order, 4 * order)
    rest: Sequence[float] = [q for q in dict.fromkeys(others) if q not in (order, beside)]
    found, *_, empty = vold_kalman_spectra(
        record, shaft, (order, *rest, beside), rpm, bandwidth=options.bandwidth
    )
    return found, empty


def _share(beside: OrderSpectrum, order: OrderSpectrum) -> float:
    """Rms of one order over that of another, median over the channels that show anything."""
    rms = [np.sqrt(np.mean(np.abs(s.spectrum.values) ** 2, axis=0)) for s in (beside, order)]
    alive = rms[1] > 0
    return float(np.median(rms[0][alive] / rms[1][alive])) if alive.any() else 0.0
