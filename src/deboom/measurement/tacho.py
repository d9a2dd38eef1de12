"""Tacho pulses to the angle and speed of a shaft, with missing and displaced pulses repaired.

A voltage gives the times of its pulses; the pulses are numbered by what is true of a shaft, whose
speed changes smoothly; a spline through them is the angle. No pulse is invented: a missing pulse is
a gap in the numbers, which the shaft angle bridges. What repeats with the revolution checks the
stated number of pulses, see `deboom.measurement.tacho_pattern`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import BSpline
from scipy.ndimage import maximum_filter1d, median_filter, percentile_filter

from deboom.arrays import BoolArray, IntArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.tacho_pattern import learn_pattern, smooth_course

LEAST_PULSES = 10
"""Fewest pulses that say enough about a speed that changes."""
HYSTERESIS = 0.2
"""Share of the swing by which the voltage must fall back to count anew."""
SLOWEST_RPM, FASTEST_RPM = 100.0, 30_000.0
"""Between which a smooth signal is a speed [1/min]: no tacho gives so many volts."""
SMOOTH_STEP, MIDDLE, STEADY = 0.2, 0.25, 0.2
"""Of a speed that changes: largest step from sample to sample over the swing, and least share of
the samples in the middle half of it, where pulses have few; of one that does not: swing over it."""
LEAST_SAMPLES = 3.0
"""Samples from pulse to pulse below which samples are counted and not pulses."""
TAIL = 0.001
"""Share of the samples beyond which low and high voltage are read, so that a spike sets neither."""
WINDOW = 9
"""Intervals (and pulses) over which a shaft's speed is compared with itself."""
UNEVEN, MOST_UNEVEN = 0.1, 0.15
"""Deviation from a whole number of intervals that weighs as much as one bad pulse: in a clean
signal, and in one whose every interval scatters because few samples make an interval."""
LEAST_TURNS, TOOTH_SEEN = 3.0, 0.2
"""Revolutions that tell gaps of a wheel from damage, and share of them that sees a tooth."""
LONGEST_GAP = 5
"""Pulses missing in a row that can still be counted."""
MOST_PASSES = 4
"""Two heal almost every signal; damage that lies close together takes a third."""
OUTLIER = 6.0
"""Robust standard deviations by which a displaced pulse is off."""
LEAST_OUTLIER = 0.005
"""Share of an interval: smaller displacements are left in."""
MISCOUNT = 0.35
"""Pulses by which a gap may differ from its count."""
MOST_REPAIRED = 0.2
"""Pulses dropped, and missing, per good one beyond which a signal is refused."""
FASTEST_CHANGE = 1.8
"""Ratio of the running medians nine intervals apart that is a stop and no run-up, once refused."""
LARGEST_DIP = 0.02
"""Share of the highest speed by which the speed of a run-up may fall in between."""


def pulse_times(
    voltage: npt.ArrayLike,
    rate: float,
    *,
    name: str = "tacho",
) -> RealArray:
    """Return the times at which a tacho signal crosses its trigger level, increasing [s].

    Raises InputError: a signal that is constant, not finite, a speed, recorded too slowly for its
    pulses, or has fewer than ten of them.

    - `voltage` (n_sample,): its first sample is at time 0 [V].

    A pulse is the rise through half-way between low and high voltage, the quantiles at 0.1 % and
    99.9 % of the samples, after a fall of `HYSTERESIS` below it. A straight line
    between the two samples about each crossing gives the time to a small part of a sample where the
    edge is as slow as the recorder's anti-aliasing filter makes it; a perfect step is known to ±
    half a sample.
    """
    signal = np.asarray(voltage, dtype=float)
    if signal.ndim != 1 or signal.size == 0:
        raise InputError(f"{name} is one channel of voltage, not an array of shape {signal.shape}")
    if not np.all(np.isfinite(signal)):
        raise InputError(
            f"{name}: the signal is not finite at sample {np.argmin(np.isfinite(signal))}"
        )
    low, high = np.quantile(signal, [TAIL, 1 - TAIL])
    if not high > low:
        raise InputError(
            f"{name} carries no pulses, it stays at {low:g} V: check the cable, or the name of the "
            "tacho channel"
        )
    trigger = (low + high) / 2
    above = signal - trigger
    # a comparator with hysteresis forgets what lies between; low then high is a pulse
    is_low, is_high = above < -HYSTERESIS * (high - low), above >= 0
    event = np.flatnonzero(is_low | is_high)
    first = event[1:][is_low[event[:-1]] & is_high[event[1:]]] - 1
    if first.size < LEAST_PULSES and _is_smooth(signal):
        raise InputError(
            f"{name} has no pulses, it changes smoothly from {signal[0]:.4g} to {signal[-1]:.4g}, "
            "as a speed does: export the tacho's pulses, or the speed in 1/min for orders whose "
            "phase to the shaft does not matter"
        )
    spacing = float(np.median(np.diff(first))) if first.size > 1 else np.inf
    if spacing < LEAST_SAMPLES:
        raise InputError(
            f"{name} has {spacing:g} samples from pulse to pulse at {rate:g} Hz, too few to tell "
            "pulses: export it at the rate of its recording, as a table of pulse times, or the "
            "speed in 1/min"
        )
    if first.size < LEAST_PULSES:
        raise InputError(
            f"{name} has {first.size} pulses at {trigger:.3g} V, {LEAST_PULSES} are needed: check "
            "the trigger level, or measure for longer"
        )
    part = above[first] / (above[first] - above[first + 1])
    return np.asarray((first + part) / rate)


def is_speed(signal: npt.ArrayLike) -> bool:
    """Return whether a tacho channel is a speed in 1/min and no pulses."""
    values = np.asarray(signal, dtype=float)
    if values.size < 2 or not (values.min() > SLOWEST_RPM and values.max() < FASTEST_RPM):
        return False
    low, high = np.quantile(values, [TAIL, 1 - TAIL])
    return bool(high - low < STEADY * low or _is_smooth(values))


def _is_smooth(signal: RealArray) -> bool:
    low, high = np.quantile(signal, [TAIL, 1 - TAIL])
    in_middle = np.abs(signal - (low + high) / 2) < (high - low) / 4
    return bool(
        np.abs(np.diff(signal)).max() < SMOOTH_STEP * (high - low) and in_middle.mean() > MIDDLE
    )


def integrated_speed(rpm: npt.ArrayLike, rate: float, *, name: str = "tacho") -> PulseTrain:
    """Return one pulse per revolution of a shaft whose speed was recorded.

    Raises InputError: fewer than ten revolutions.

    - `rpm` (n_sample,): its first sample is at time 0 [1/min]; see `is_speed`.

    The angle is zero at the first sample: phases between channels of a run hold, those to a mark on
    the shaft do not.
    """
    turned = cumulative_trapezoid(np.asarray(rpm, dtype=float) / 60, dx=1 / rate, initial=0)
    number = np.arange(int(turned[-1]) + 1)
    if number.size < LEAST_PULSES:
        raise InputError(f"{name} has {turned[-1]:.1f} revolutions: measure for longer")
    nothing = np.empty(0)
    note = (
        f"{name}: WARNING, the channel is a speed in 1/min and no pulses: it was integrated, so "
        "phases to a mark on the shaft do not hold, and pulses_per_revolution has no say"
    )
    times = np.interp(number, turned, np.arange(turned.size) / rate)
    return PulseTrain(name, times, number, 1, nothing, nothing, note=note)


@checked(times="n", number="n", dropped="d", missing="m", correction="n")
class PulseTrain:
    """The pulses of a tacho that can be trusted, and what was done to get there.

    - `times` (n_pulse,): times of the pulses kept [s].
    - `number` (n_pulse,): count of each pulse from the first that was triggered, which may itself
      be dropped; a step above 1 bridges missing pulses.
    - `dropped` (n_dropped,): times of the pulses left out [s].
    - `pulses_per_revolution`: pitches on the circumference, missing teeth included.
    - `missing` (n_missing,): times at which a pulse was due and none was trusted [s]. A displaced
      pulse counts here and among the dropped; teeth that the wheel has not do not.
    - `correction` (n_pulse,), optional: angle of each pulse beyond even pitches, from the seam of a
      tape [revolutions].
    - `note`: what checks the pulses per revolution, or that nothing does.
    """

    name: str
    times: RealArray
    number: IntArray
    pulses_per_revolution: int
    dropped: RealArray
    missing: RealArray
    correction: RealArray | None = None
    note: str = ""

    @property
    def revolution(self) -> RealArray:
        """Angle of each pulse from number 0, seam corrected, shape (n_pulse,) [revolutions]."""
        even = self.number / self.pulses_per_revolution
        return np.asarray(even if self.correction is None else even + self.correction)

    def report(self) -> str:
        """One sentence on the repair, for the log of a measurement."""
        if not (self.dropped.size or self.missing.size):
            return f"{self.name}: {self.times.size} pulses, none repaired"
        return (
            f"{self.name}: {self.times.size} pulses trusted, {self.dropped.size} dropped"
            f"{_at(self.dropped)}, {self.missing.size} missing{_at(self.missing)}"
        )


def repair_pulses(
    times: npt.ArrayLike, pulses_per_revolution: int = 1, *, name: str = "tacho"
) -> PulseTrain:
    """Give each pulse its number, for a shaft whose speed changes smoothly.

    Raises InputError: fewer than ten pulses, times that do not increase, intervals that no smooth
    speed explains, a gap that cannot be counted, too many bad pulses, a shaft that stops or turns
    back, a number of pulses per revolution that the pattern of gaps contradicts, or a seam that too
    few revolutions show.

    - `times` (n,): times of the pulses, such as from `pulse_times` [s].
    - `pulses_per_revolution`: pitches on the circumference, missing teeth included: 60 for a 60-2
      wheel, 12 for a tape of 12 stripes whatever the width of its butt joint.

    A gap or seam that comes back with the revolution confirms or contradicts the number; without
    one, or with fewer than six pulses per revolution, `PulseTrain.note` says that nothing checks
    it. A seam is taken out of the times before pulses are numbered and judged, and is in
    `PulseTrain.correction`. Nothing else of the pattern is corrected: what repeats with the
    revolution may be the shaft's own unevenness.

    Intervals are compared with their running median over nine. Out of all chains of pulses that are
    about whole numbers of intervals apart, the one that needs the fewest repairs is taken. Then
    each pulse is compared with a cubic fitted to it and its eight neighbours, and dropped if it is
    off by six robust standard deviations and 0.5 % of an interval; near an end the outermost goes.
    """
    raw = np.asarray(times, dtype=float)
    if pulses_per_revolution < 1:
        raise InputError(f"{name}: {pulses_per_revolution} pulses per revolution; give at least 1")
    if raw.ndim != 1 or raw.size < LEAST_PULSES:
        raise InputError(
            f"{name} has {raw.size} pulses, {LEAST_PULSES} are needed: measure for longer"
        )
    if not np.all(np.isfinite(raw)) or np.any(np.diff(raw) <= 0):
        raise InputError(f"{name}: pulse times must be finite and increase from pulse to pulse")
    pattern = learn_pattern(raw, pulses_per_revolution, name)
    if isinstance(pattern, str):
        return replace(_trusted(raw, pulses_per_revolution, name), note=pattern)
    even = pattern.even_times
    train = _trusted(even, pulses_per_revolution, name)
    taken = np.isin(even, train.times)
    place = np.rint(pattern.pitch[taken]).astype(int) % pulses_per_revolution
    zero = (place[0] - train.number[0]) % pulses_per_revolution
    correction = pattern.correction[place] - pattern.correction[zero]
    return replace(
        train,
        times=raw[taken],
        dropped=raw[~taken],
        missing=np.interp(train.missing, even, raw),
        correction=correction if np.any(correction) else None,
        note=pattern.note,
    )


def _trusted(raw: RealArray, pulses_per_revolution: int, name: str) -> PulseTrain:
    """Pulses with their numbers, displaced ones left out; what cannot be counted is refused."""
    number = _numbered(raw)
    taken = _without_displaced(raw, number)
    count, kept = number[taken], raw[taken]
    if count.size < LEAST_PULSES:
        raise InputError(
            _stop(raw, name)
            or f"{name}: the intervals between pulses fit no smooth speed: check the sensor, the "
            "trigger level and the hysteresis"
        )
    absent = np.setdiff1d(np.arange(count[0], count[-1] + 1), count)
    # no pulse is due where the wheel has no tooth
    place = count % pulses_per_revolution
    turns = (count[-1] - count[0]) / pulses_per_revolution
    passed = np.bincount(place, minlength=pulses_per_revolution)
    if turns >= LEAST_TURNS:
        absent = absent[passed[absent % pulses_per_revolution] >= TOOTH_SEEN * turns]
    missing = np.interp(absent, count, kept)
    # the first pulse triggered is the zero mark, even if it is displaced and left out
    count = count - count[0] + round((kept[0] - raw[0]) / _local_period(kept, count)[0])
    train = PulseTrain(name, kept, count, pulses_per_revolution, raw[~taken], missing)
    problem = (
        _too_many(train, train.dropped) or _miscounted(train) or _too_many(train, train.missing)
    )
    if problem:
        raise InputError(_stop(raw, name) or problem)
    return train


def _stop(raw: RealArray, name: str) -> str:
    """Name a stop or a reversal: the intervals themselves grow too fast for a run-up."""
    # over two intervals at a time: a pulse that bounces is no stop
    pair = raw[2:] - raw[:-2]
    erratic = np.median(np.abs(np.diff(np.log(pair)))) > UNEVEN
    usual = np.log(median_filter(pair, size=WINDOW, mode="mirror"))
    change = np.abs(usual[WINDOW:] - usual[:-WINDOW])
    if erratic or change.size == 0 or change.max() < np.log(FASTEST_CHANGE):
        return ""
    where = raw[int(np.argmax(change)) + WINDOW // 2]
    return (
        f"{name}: the shaft stops or turns back near {where:.3f} s, which one tacho cannot tell "
        "apart, or most pulses there are false: cut the record there"
    )


def _miscounted(train: PulseTrain) -> str:
    step = np.diff(train.number)
    usual = _local_period(train.times, train.number)
    expected = 2 * np.diff(train.times) / (usual[1:] + usual[:-1])
    unsafe = (step > LONGEST_GAP + 1) | ((step > 1) & (np.abs(expected - step) > MISCOUNT))
    if not unsafe.any():
        return ""
    gap = int(np.argmax(np.where(unsafe, expected, 0)))
    return (
        f"{train.name}: about {expected[gap] - 1:.1f} pulses are missing between "
        f"{train.times[gap]:.3f} and {train.times[gap + 1]:.3f} s, which cannot be counted safely: "
        "cut the record there"
    )


def _too_many(train: PulseTrain, bad: RealArray) -> str:
    if bad.size <= MOST_REPAIRED * train.times.size:
        return ""
    return (
        f"{train.name}: {train.dropped.size} pulses do not fit and {train.missing.size} are "
        f"missing beside {train.times.size} good ones: check the trigger level and the hysteresis"
    )


def _at(times: RealArray) -> str:
    if times.size == 0:
        return ""
    shown = ", ".join(f"{time:.3f}" for time in times[:5])
    return f" (at {shown}{', …' if times.size > 5 else ''} s)"


def _numbered(times: RealArray) -> IntArray:
    """Count the pulses from 0, −1 for a pulse that is better left out; skipped numbers are missing.

    Leaving a pulse out costs 1 and so does a missing one; from one pulse kept to the next, a step
    that is not a whole number of intervals costs the square of its excess over what is usual. The
    cheapest chain is found as a shortest path: first with the running median of all intervals, then
    with that of the pulses kept, until nothing changes.
    """
    number = _cheapest_chain(times, _local_period(times, np.arange(times.size)))
    for _ in range(MOST_PASSES):
        kept = number >= 0
        if np.count_nonzero(kept) <= WINDOW:
            break
        period = _local_period(times[kept], number[kept])
        before, number = number, _cheapest_chain(times, np.interp(times, times[kept], period))
        if np.array_equal(number, before):
            break
    return number


def _local_period(times: RealArray, number: IntArray) -> RealArray:
    """Time from number to number about each pulse, a running median over nine intervals [s]."""
    usual = median_filter(np.diff(times) / np.diff(number), size=WINDOW, mode="mirror")
    return np.concatenate([usual[:1], (usual[1:] + usual[:-1]) / 2, usual[-1:]])


def _without_displaced(times: RealArray, number: IntArray) -> BoolArray:
    """Drop the worst pulses until all lie within six deviations or 0.5 % of a local cubic."""
    taken = number >= 0
    while np.count_nonzero(taken) > WINDOW:
        position = np.flatnonzero(taken)
        deviation, interval = _deviation_from_neighbours(times[position], number[position])
        # the median of unsigned normal deviations is 1/1.4826 of their standard deviation
        spread = 1.4826 * np.median(deviation)
        bad = deviation > np.maximum(OUTLIER * spread, LEAST_OUTLIER * interval)
        worst = np.flatnonzero(bad & (deviation >= maximum_filter1d(deviation, WINDOW)))
        if worst.size == 0:
            break
        # near an end a cubic cannot tell which pulse is off: the outermost goes
        worst[worst < WINDOW // 2] = 0
        worst[worst >= deviation.size - WINDOW // 2] = -1
        taken[position[worst]] = False
    return taken


def _deviation_from_neighbours(times: RealArray, number: IntArray) -> tuple[RealArray, RealArray]:
    """Studentised distance of each pulse from the cubic about it, and the interval there [s]."""
    begin = np.clip(np.arange(times.size) - WINDOW // 2, 0, times.size - WINDOW)
    neighbours = begin[:, np.newaxis] + np.arange(WINDOW)
    # few patterns of gaps occur: one small least-squares problem for each, not for each pulse
    near, pattern = np.unique(
        number[neighbours] - number[:, np.newaxis], axis=0, return_inverse=True
    )
    cubic = (near / np.abs(near).max(axis=1, keepdims=True))[:, :, np.newaxis] ** np.arange(4)
    # at the pulse itself the cubic has the value of its constant term
    weights = np.linalg.pinv(cubic)[pattern.reshape(-1), 0]
    fitted = np.sum(weights * (times[neighbours] - times[:, np.newaxis]), axis=1)
    leverage = weights[np.arange(times.size), np.arange(times.size) - begin]
    interval = np.ptp(times[neighbours], axis=1) / np.ptp(number[neighbours], axis=1)
    return np.abs(fitted) / np.sqrt(1 - np.minimum(leverage, 0.999)), interval


def _cheapest_chain(times: RealArray, period: RealArray) -> IntArray:
    """Numbers of the pulses on the cheapest chain, −1 for those beside it."""
    price, whole = _step_prices(times, period)
    cost, chosen = [0.0], [-1]
    for i, prices in enumerate(price.tolist()[1:], start=1):
        totals = [cost[i - 1 - skipped] + prices[skipped] for skipped in range(min(i, WINDOW))]
        best = min(totals)
        # to leave out all pulses before this one costs i
        cost.append(min(best, float(i)))
        chosen.append(totals.index(best) if best < i else -1)
    chain = [int(np.argmin(np.array(cost) - np.arange(times.size)))]
    while chosen[chain[-1]] >= 0:
        chain.append(chain[-1] - 1 - chosen[chain[-1]])
    chain.reverse()
    number = np.full(times.size, -1, dtype=np.int64)
    number[chain[0]] = 0
    number[chain[1:]] = np.cumsum([whole[i, chosen[i]] for i in chain[1:]])
    return number


def _step_prices(times: RealArray, period: RealArray) -> tuple[RealArray, IntArray]:
    """Price and count of the step to each pulse (row) if so many are skipped before it (column)."""
    unevenness = np.abs(np.diff(times, prepend=times[0] - period[0]) / period - 1)
    scatter = percentile_filter(unevenness, 75, size=4 * WINDOW, mode="mirror")
    uneven = np.clip(scatter, UNEVEN, MOST_UNEVEN)[:, np.newaxis]
    skipped = np.arange(WINDOW)
    before = np.maximum(np.arange(times.size)[:, np.newaxis] - 1 - skipped, 0)
    step = 2 * (times[:, np.newaxis] - times[before]) / (period[:, np.newaxis] + period[before])
    whole = np.maximum(1, np.rint(step)).astype(np.int64)
    missing = np.minimum(whole - 1, LONGEST_GAP + 1)
    return skipped + missing + ((step - whole) / uneven) ** 2, whole


@dataclass(frozen=True, eq=False)
class ShaftAngle:
    """A shaft's angle as a smooth function of time, zero at the tacho's zero mark.

    Made by `shaft_angle`; it holds from its first to its last pulse and is not continued beyond:
    other times raise InputError.

    - `jitter`: root mean square distance of the pulses from the smooth course [rad]; it contains
      what the shaft itself turns unevenly within a few revolutions.
    """

    begin: float
    end: float
    jitter: float
    pulses: PulseTrain
    _revolution: BSpline[np.float64] = field(repr=False)

    def angle(self, time: npt.ArrayLike) -> RealArray:
        """Angle at the times [s], any shape [rad]."""
        return np.asarray(2 * np.pi * self._revolution(self._inside(time)))

    def rpm(self, time: npt.ArrayLike) -> RealArray:
        """Speed at the times [s], any shape [1/min]."""
        return np.asarray(60 * self._revolution(self._inside(time), nu=1))

    def rpm_rate(self, time: npt.ArrayLike) -> RealArray:
        """Change of speed at the times [s], any shape [1/(min s)]."""
        return np.asarray(60 * self._revolution(self._inside(time), nu=2))

    def rpm_range(self) -> tuple[float, float]:
        """Lowest and highest speed of the run [1/min]."""
        speed = self.rpm(self._fine_times())
        return float(speed.min()), float(speed.max())

    def time_at(self, rpm: npt.ArrayLike) -> RealArray:
        """Time at which a run-up or run-down first passes each speed, shape (n,) [s].

        A speed [1/min] that the run does not reach, or a run that turns from up to down or back by
        more than 2 % of its highest speed, raises InputError.
        """
        wanted = np.atleast_1d(np.asarray(rpm, dtype=float))
        time = self._fine_times()
        speed = self.rpm(time)
        sense = 1.0 if speed[-1] >= speed[0] else -1.0
        reached = np.maximum.accumulate(sense * speed)
        dip = reached - sense * speed
        if dip.max() > LARGEST_DIP * speed.max():
            raise InputError(
                f"{self.pulses.name}: the speed turns back by {dip.max():.0f} 1/min before "
                f"{time[np.argmax(dip)]:.2f} s: cut it into runs that rise or fall throughout"
            )
        outside = (sense * wanted < reached[0]) | (sense * wanted > reached[-1])
        if outside.any():
            raise InputError(
                f"{self.pulses.name}: the run does not pass {wanted[outside][0]:g} 1/min; it goes "
                f"from {speed[0]:.1f} to {sense * reached[-1]:.1f} 1/min"
            )
        first = np.concatenate([[True], np.diff(reached) > 0])
        return np.asarray(np.interp(sense * wanted, reached[first], time[first]))

    def _inside(self, time: npt.ArrayLike) -> RealArray:
        times = np.asarray(time, dtype=float)
        if np.any(times < self.begin) or np.any(times > self.end):
            raise InputError(
                f"{self.pulses.name}: the shaft angle is known from {self.begin:.3f} to "
                f"{self.end:.3f} s only, not at {times.min():.3f} to {times.max():.3f} s"
            )
        return times

    def _fine_times(self) -> RealArray:
        """Eight times per mean pulse interval; the spline is almost straight in between."""
        return np.linspace(self.begin, self.end, 8 * int(np.ptp(self.pulses.number)) + 1)


def shaft_angle(pulses: PulseTrain) -> ShaftAngle:
    """Lay a smooth course through the pulses of a tacho.

    Raises InputError: pulses whose course stands still or turns back.

    Cubic spline of least squares, exact for a linear run-up. Averaging over the knots takes out
    jitter and the unevenness within an engine cycle, so the angle is that of the mean rotation. A
    half order has two phases a half turn apart in one revolution, so whether 1.5 leads or lags by
    180° depends on which pulse is zero: the first of the record.
    """
    times, revolution = pulses.times, pulses.revolution
    course = smooth_course(times, revolution)
    jitter = 2 * np.pi * float(np.sqrt(np.mean((course(times) - revolution) ** 2)))
    shaft = ShaftAngle(float(times[0]), float(times[-1]), jitter, pulses, course)
    slowest, _ = shaft.rpm_range()
    if slowest <= 0:
        raise InputError(
            f"{pulses.name}: the shaft stands still or turns back: cut the record there"
        )
    return shaft
