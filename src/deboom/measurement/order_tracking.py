"""Time records and a shaft angle to order spectra over speed, for runs and sweeps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.interpolate import CubicSpline

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.campaign import OperatingRun, TimeRun
from deboom.measurement.channels import Spectrum, TimeRecord
from deboom.measurement.tacho import (
    ShaftAngle,
    integrated_speed,
    is_speed,
    pulse_times,
    repair_pulses,
    shaft_angle,
)
from deboom.physics.order_tracking import (
    LEAST_SAMPLES_PER_PERIOD,
    SAMPLES_PER_PERIOD,
    frequency_of_order,
    lower_rate,
    smear,
    vold_kalman,
)
from deboom.tabled import Tabled

STATIC_BANDWIDTH = 1.0
"""Bandwidth of what counts as quasi-static: an order above 2 Hz passes by less than 1 % [Hz]."""
BESIDE = 0.25
"""Distance of an order that a four-stroke engine, with half orders alone, does not have."""
BARELY = 0.5
"""Share of the dominant order that shows beside it, above which it hardly stands out."""
TORQUE_OFF = 0.25
"""Share by which the measured torque may differ from the stated one before it is named."""
SWEEP_STEP = 1.0
"""Distance of the lines of a compressor's sweep [Hz]."""
SWEEP_BANDWIDTH = 3.0
"""Full half-power width of the Vold-Kalman filter of a compressor's sweep [Hz]."""
SWEEP_ORDERS = (1.0, 2.0, 3.0, 1.5)
"""Orders of a sweep: the first, two of the pulsation of the gas, and 1.5, where a rotor and what it
pumps have whole orders and all that shows is noise."""


@checked(rpm="f", time="f", bandwidth="f", sweep_rate="f", settled="f")
class OrderSpectrum:
    """One order over engine speed, with what it can resolve.

    - `rpm` (n_line,): speed of each line [1/min].
    - `time` (n_line,): when the run passes it [s].
    - `spectrum`: complex peak amplitudes, phase to the tacho's zero mark, over
      ``order · rpm / 60``.
    - `bandwidth` (n_line,): full half-power width about the order: what lies nearer is not
      separated [Hz].
    - `sweep_rate` (n_line,): change of the order's frequency [Hz/s].
    - `settled` (n_line,): False where the filter reached the end of the record and looked to one
      side only.
    """

    order: float
    rpm: RealArray
    time: RealArray
    spectrum: Spectrum
    bandwidth: RealArray
    sweep_rate: RealArray
    settled: BoolArray

    @property
    def smear(self) -> RealArray:
        """Finest ripple over frequency that is kept, at 1/√2 of its size, shape (n_line,) [Hz]."""
        return smear(self.sweep_rate, self.bandwidth)


def vold_kalman_spectra(
    record: TimeRecord,
    shaft: ShaftAngle,
    orders: Sequence[float],
    rpm: npt.ArrayLike,
    *,
    bandwidth: npt.ArrayLike,
) -> tuple[OrderSpectrum, ...]:
    """Return order spectra by a Vold-Kalman filter that solves all orders together, one per order.

    The quasi-static part of the record, such as the static force on a cell, is solved together with
    the orders, so that it does not leak into them. Raises InputError: a speed that the run does not
    pass, a bandwidth wider than the lowest frequency of an order, a sampling rate too low for the
    highest.

    - `rpm` (n_line,): speeds of the lines, increasing [1/min]; the run itself may rise or fall.
    - `orders`: cycles per revolution, each positive [1]; name every strong order, not only the
      wanted one.
    - `bandwidth` (n_order,) or (): full half-power width about each order, above 0 [Hz].
    """
    if len(orders) == 0 or min(orders) <= 0:
        raise InputError(f"orders {list(orders)} are not positive: give cycles per revolution")
    widths = np.asarray(bandwidth, dtype=float)
    if widths.shape not in {(), (len(orders),)} or not np.all(widths > 0):
        raise InputError(
            f"bandwidths {widths.tolist()} Hz for {len(orders)} orders: give one above 0 Hz, or "
            "one for each order"
        )
    widths = np.broadcast_to(widths, len(orders))
    speeds, time = _times_of_lines(shaft, rpm)
    highest = float(frequency_of_order(shaft.rpm_range()[1], max(orders)))
    samples, values, rate = _cut(record, shaft, highest + float(widths.max()))
    _refuse_lines_outside(shaft, speeds, time, samples)
    phase = shaft.angle(samples)[:, np.newaxis] * np.concatenate([[0.0], orders])
    all_widths = np.concatenate([[widths.min()], widths])
    envelopes = vold_kalman(values, phase, rate, all_widths)[:, 1:]
    amplitudes = CubicSpline(samples, envelopes)(time)
    from_end = np.minimum(time - samples[0], samples[-1] - time)
    return tuple(
        OrderSpectrum(
            order=order,
            rpm=speeds,
            time=time,
            spectrum=_spectrum(record, order, speeds, amplitudes[:, column]),
            bandwidth=np.full(speeds.size, width),
            sweep_rate=frequency_of_order(shaft.rpm_rate(time), order),
            settled=from_end >= 1 / width,
        )
        for column, (order, width) in enumerate(zip(orders, widths, strict=True))
    )


def quasi_static(
    record: TimeRecord, shaft: ShaftAngle, rpm: npt.ArrayLike, *, bandwidth: float
) -> RealArray:
    """Return the slow part of a record, such as torque, at the lines of an order spectrum.

    Shape (n_line, n_channel) [unit of the record]; arguments and errors as for
    `vold_kalman_spectra`. The Vold-Kalman filter at order 0, two poles: what oscillates at f
    passes by ``1/(1 + 0.41 (2f/bandwidth)⁴)``.
    """
    speeds, time = _times_of_lines(shaft, rpm)
    samples, values, rate = _cut(record, shaft, SAMPLES_PER_PERIOD * bandwidth)
    _refuse_lines_outside(shaft, speeds, time, samples)
    slow = vold_kalman(values, np.zeros((samples.size, 1)), rate, bandwidth)[:, 0].real
    return np.asarray(CubicSpline(samples, slow)(time))


def _times_of_lines(shaft: ShaftAngle, rpm: npt.ArrayLike) -> tuple[RealArray, RealArray]:
    speeds = np.asarray(rpm, dtype=float)
    if speeds.ndim != 1 or speeds.size == 0 or np.any(np.diff(speeds) <= 0):
        raise InputError("the speeds of an order spectrum must be a list that increases")
    return speeds, shaft.time_at(speeds)


def _cut(
    record: TimeRecord, shaft: ShaftAngle, highest: float
) -> tuple[RealArray, RealArray, float]:
    """Lower the rate and cut to where the shaft is known; times, values and rate."""
    values, rate = lower_rate(record.values, record.rate, highest)
    times = record.start + np.arange(len(values)) / rate
    inside = (times >= shaft.begin) & (times <= shaft.end)
    if np.count_nonzero(inside) < 2:
        raise InputError(
            f"the record, {times[0]:.3f} to {times[-1]:.3f} s, and the tacho, {shaft.begin:.3f} to "
            f"{shaft.end:.3f} s, do not overlap"
        )
    return times[inside], values[inside], rate


def _refuse_lines_outside(
    shaft: ShaftAngle, rpm: RealArray, time: RealArray, samples: RealArray
) -> None:
    outside = (time < samples[0]) | (time > samples[-1])
    if outside.any():
        low, high = np.sort(shaft.rpm(samples[[0, -1]]))
        raise InputError(
            f"the record does not hold the line at {rpm[outside][0]:g} 1/min: lines from "
            f"{low:.1f} to {high:.1f} 1/min are possible"
        )


def _spectrum(
    record: TimeRecord, order: float, rpm: RealArray, amplitudes: ComplexArray
) -> Spectrum:
    return Spectrum(frequency_of_order(rpm, order), amplitudes, record.channels, record.unit)


@checked(bandwidth=">0", other_orders=">0", rpm_step=">0")
class TrackingOptions:
    """How a run over time is tracked; bandwidth, step and orders are positive.

    - `other_orders`: strong orders that the filter solves together with the dominant one [1]; by
      default 0.5, twice and four times the dominant order.
    - `lowest_rpm`, `highest_rpm`: range of the lines [1/min]; by default all that the record holds
      with a settled filter.
    """

    bandwidth: float = 3.0
    other_orders: tuple[float, ...] | None = None
    lowest_rpm: float | None = None
    highest_rpm: float | None = None
    rpm_step: float = 10.0


DEFAULT_TRACKING = TrackingOptions()


@dataclass(frozen=True, eq=False)
class TrackedRun(Tabled):
    """An operating run that was a run over time, and how far its spectra may be believed.

    - `run`: spectra of the dominant order, engine torque and static force over its lines.
    - `notes`: what was resampled or chosen when the run was read, and statements that the record
      makes unlikely.
    - `acceleration_beside`, `force_beside`: amplitude that shows a quarter order beside the
      dominant one, where a four-stroke engine has none, relative to the dominant one (rms over
      lines, median over channels) [1]: what noise and neighbours pretend.

    See Also
    --------
    deboom.tracked_run, deboom.read_time_run
    """

    run: OperatingRun
    order: OrderSpectrum
    shaft: ShaftAngle
    acceleration_beside: float
    force_beside: float
    notes: tuple[str, ...] = ()

    @property
    def table(self) -> pd.DataFrame:
        """Complex accelerations of the order over frequency and engine speed."""
        table = self.run.acceleration.table
        table.insert(1, "engine speed [1/min]", self.order.rpm)
        return table

    def report(self) -> tuple[str, ...]:
        """Lines, resolution and uncertainty in words."""
        spectrum, frequency = self.order, self.run.frequency
        sweep = np.abs(spectrum.sweep_rate)
        lines = [
            f"{frequency.size} lines of order {spectrum.order:g}, {spectrum.rpm[0]:g} to "
            f"{spectrum.rpm[-1]:g} 1/min ({frequency[0]:g} to {frequency[-1]:g} Hz)",
            f"{self.shaft.pulses.report()}; jitter {np.rad2deg(self.shaft.jitter):.2g}°",
            self.shaft.pulses.note,
            *self.notes,
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
    """Make an operating run of a run over time: spectra of its dominant order.

    Phases refer to the first pulse of the tacho, as those of all channels of the run do; a dynamic
    stiffness does not depend on which pulse that is.

    Parameters
    ----------
    time_run : TimeRun
        Tacho, accelerations [m/s²], forces of the cells [N], engine torque [N m] over time.
    options : TrackingOptions
        Step of the engine speed [1/min], bandwidth [Hz] and range.
    name : str, optional
        Name of the operating run; by default that of the time run.

    Returns
    -------
    TrackedRun
        ``run`` with accelerations and forces, (n_frequency, n_channel), complex peak, and how far
        they may be believed.

    Raises
    ------
    InputError
        A tacho that cannot be repaired or contradicts the stated pulses per revolution, a run that
        falls where it should rise, a speed outside of the run, a record too short or sampled too
        slowly.

    See Also
    --------
    deboom.read_time_run, deboom.measurement.order_tracking.TrackedRun, deboom.characterise

    Examples
    --------
    >>> import deboom
    >>> run = deboom.read_time_run("my_campaign", "g5_wot220_time")  # doctest: +SKIP
    >>> deboom.tracked_run(run).table  # doctest: +SKIP
    """
    try:
        return _tracked(time_run, options, time_run.name if name is None else name)
    except InputError as error:
        raise InputError(f"time run {time_run.name}: {error}") from None


def _tracked(time_run: TimeRun, options: TrackingOptions, name: str) -> TrackedRun:
    rate = time_run.sample_rate
    shaft = shaft_of(time_run.tacho, rate, time_run.pulses_per_revolution)
    _refuse_other_sense(time_run, shaft)
    rpm = settled_lines(shaft, options)
    _refuse_slow_vibration(time_run, float(rpm[-1]), options)
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
    beside = _share(beside_motion, of_motion), _share(beside_force, of_force)
    notes = (*time_run.notes, *_doubts(time_run, torque, beside))
    return TrackedRun(run, of_motion, shaft, *beside, notes=notes)


def shaft_of(tacho: RealArray, rate: float, pulses_per_revolution: int) -> ShaftAngle:
    """Return the shaft's angle from a tacho's voltage [V], or from a channel of speed [1/min].

    - `tacho` (n_sample,), `rate` samples per second [Hz]; `pulses_per_revolution`: pitches, missing
      teeth included.
    - raises InputError: a tacho that cannot be repaired, or contradicts its pulses per revolution.
    """
    if is_speed(tacho):
        return shaft_angle(integrated_speed(tacho, rate))
    return shaft_angle(repair_pulses(pulse_times(tacho, rate), pulses_per_revolution))


def _refuse_other_sense(time_run: TimeRun, shaft: ShaftAngle) -> None:
    first, last = shaft.rpm([shaft.begin, shaft.end])
    if (last > first) != time_run.rising:
        sense = "rises" if last > first else "falls"
        stated = "true" if time_run.rising else "false"
        raise InputError(
            f"the speed {sense} from {first:.0f} to {last:.0f} 1/min, but rising says {stated}: "
            "correct it"
        )


def _doubts(time_run: TimeRun, torque: RealArray, beside: tuple[float, float]) -> Iterator[str]:
    """Give a sentence for every statement that the record makes unlikely."""
    if min(beside) > BARELY:
        yield (
            f"WARNING: order {time_run.order:g} hardly stands out, {100 * min(beside):.0f} % of it "
            f"is at order {time_run.order + BESIDE:g} as well: are pulses_per_revolution, "
            "dominant_order and the tacho's channel right?"
        )
    # a coasting engine is dragged, by a negative torque
    extreme = np.max if time_run.torque_limit > 0 else np.min
    reached = float((extreme if time_run.full_load else np.median)(torque))
    stated, off = time_run.torque_limit, reached / time_run.torque_limit - 1
    if time_run.full_load and off > TORQUE_OFF:
        yield (
            f"WARNING: the engine torque reaches {reached:.0f} N m, beyond the limit of {stated:g} "
            "N m that torque_nm states: are its unit and torque_nm right?"
        )
    if not time_run.full_load and abs(off) > TORQUE_OFF:
        yield (
            f"WARNING: the engine torque is {reached:.0f} N m, and torque_nm states a slice at "
            f"{stated:g} N m: are its unit and torque_nm right?"
        )


def _refuse_slow_vibration(time_run: TimeRun, rpm: float, options: TrackingOptions) -> None:
    """Refuse vibration that was recorded too slowly, whatever raster it is on now."""
    slowest = time_run.vibration_rate
    needed = LEAST_SAMPLES_PER_PERIOD * float(frequency_of_order(rpm, time_run.order))
    needed += LEAST_SAMPLES_PER_PERIOD * options.bandwidth
    if slowest is not None and slowest < needed:
        raise InputError(
            f"an acceleration or a cell force was recorded at {slowest:.6g} Hz, and order "
            f"{time_run.order:g} at {rpm:g} 1/min needs {needed:.4g} Hz: record it faster, or "
            "narrow the range of speeds"
        )


def settled_lines(shaft: ShaftAngle, options: TrackingOptions) -> RealArray:
    """Return speeds at multiples of the step, in the stated range or that of a settled filter.

    Shape (n_line,) [1/min]. Raises InputError: a run too short for the filter, a step that leaves
    fewer than two lines, or more than `MOST_LINES`.
    """
    ends = _settled(shaft, options.bandwidth)
    _refuse_too_short(shaft, ends)
    # an uneven speed may lie beyond that of the first or the last pulse for a while
    low, high = np.clip(np.sort(shaft.rpm(ends)), *np.sort(shaft.rpm([shaft.begin, shaft.end])))
    low = low if options.lowest_rpm is None else options.lowest_rpm
    high = high if options.highest_rpm is None else options.highest_rpm
    return _multiples(low, high, options.rpm_step, "1/min")


def _settled(shaft: ShaftAngle, bandwidth: float) -> RealArray:
    """First and last time at which a Vold-Kalman filter has settled [s]."""
    return np.array([shaft.begin + 1 / bandwidth, shaft.end - 1 / bandwidth])


def _refuse_too_short(shaft: ShaftAngle, ends: RealArray) -> None:
    if not ends[0] < ends[1]:
        raise InputError(
            f"its {shaft.end - shaft.begin:.2f} s are too short for the filter: take a larger "
            "bandwidth, or measure for longer"
        )


MOST_LINES = 20_000
"""Lines of an order spectrum above which its step is taken for a mistake."""


def _multiples(low: float, high: float, step: float, unit: str) -> RealArray:
    """Whole multiples of a step from low to high, at least two of them."""
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    if last - first > MOST_LINES:
        raise InputError(
            f"{last - first:.3g} lines lie between {low:.1f} and {high:.1f} {unit} in steps of "
            f"{step:g}: take a larger step"
        )
    if last <= first:
        raise InputError(
            f"fewer than two lines lie between {low:.1f} and {high:.1f} {unit} in steps of "
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
    others = options.other_orders
    if others is None:
        others = (0.5, 2 * order, 4 * order)
    rest: Sequence[float] = [q for q in dict.fromkeys(others) if q not in (order, beside)]
    of_order, *_, of_beside = vold_kalman_spectra(
        record, shaft, (order, *rest, beside), rpm, bandwidth=options.bandwidth
    )
    return of_order, of_beside


def _share(beside: OrderSpectrum, order: OrderSpectrum) -> float:
    """Rms of one order over that of another, median over the channels that show anything."""
    rms = [np.sqrt(np.mean(np.abs(s.spectrum.values) ** 2, axis=0)) for s in (beside, order)]
    alive = rms[1] > 0
    return float(np.median(rms[0][alive] / rms[1][alive])) if alive.any() else 0.0


@dataclass(frozen=True, eq=False)
class TrackedSweep:
    """First order of several records of one run-up of a compressor.

    - `spectra`: spectra of the records, on common lines of the rotational frequency; phase from the
      pulse.
    - `noise`: of each record (n_channel,), standard deviation of the real and of the imaginary
      part: what the filter lets through at order 1.5, where there is nothing [unit of the record].
    """

    spectra: tuple[Spectrum, ...]
    noise: tuple[RealArray, ...]


def tracked_sweep(tacho: RealArray, records: Sequence[TimeRecord]) -> TrackedSweep:
    """Track the first order of a run-up or run-down with one tacho pulse per revolution.

    Lines at whole multiples of `SWEEP_STEP` where the Vold-Kalman filter has settled. The tacho is
    sampled with the records, all at one rate; its rising edge marks the angle. Raises InputError: a
    tacho without pulses or that cannot be repaired, a record too short or sampled too slowly.

    With one pulse per revolution it does not matter for the phase of a whole order which pulse is
    the first. Valid for slow runs: within the filter's third of a second the speed must change by
    less than a resonance is wide, and lines that are passed within it share their noise. 1 Hz/s is
    slow.
    """
    shaft = shaft_angle(repair_pulses(pulse_times(tacho, records[0].rate), 1))
    ends = _settled(shaft, SWEEP_BANDWIDTH)
    _refuse_too_short(shaft, ends)
    low, high = np.sort(shaft.rpm(ends)) / 60.0
    rpm = 60.0 * _multiples(low, high, SWEEP_STEP, "Hz")
    tracked = [
        vold_kalman_spectra(record, shaft, SWEEP_ORDERS, rpm, bandwidth=SWEEP_BANDWIDTH)
        for record in records
    ]
    noise = [
        np.sqrt(np.mean(np.abs(beside.spectrum.values) ** 2, axis=0) / 2) for *_, beside in tracked
    ]
    return TrackedSweep(tuple(first.spectrum for first, *_ in tracked), tuple(noise))
