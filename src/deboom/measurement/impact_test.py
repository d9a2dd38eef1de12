"""Impact tests: hits checked, chosen, windowed and averaged to FRFs with their random error."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats
from scipy.signal import find_peaks, resample

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import DataWarning, InputError
from deboom.measurement.channels import Frf
from deboom.measurement.sensors import Impact, Sensor
from deboom.physics.frf import (
    SILENT,
    SpectrumScaling,
    coherence,
    cross_spectra,
    exponential_window,
    force_window,
    h1,
    magnitude_error,
)

USABLE_SHARE = 2.0 / 2.56
"""Share of the lines up to half the sampling rate: beyond, anti-aliasing filters work."""
NOISE_PEAKS = 5.0
"""Peaks of a noise reach this many times its rms; lower second peaks say nothing."""


DOUBLE_HIT = 0.05
"""Share of the main push from which on a second one makes a double hit [1]."""
FINE = 8
"""Values between two samples at which a push is looked for: its peak lies between samples."""
RINGING = 10
"""Samples of the force beside a second maximum, toward the main push, that show the ringing."""
ABOVE_RINGING = 1.25
"""A second push exceeds the deepest pull there by more than this; hammers only push [1]."""
OVERLOAD = 0.99
"""Share of a channel's range from which on it is overloaded [1]."""
LARGEST_REMAINDER = 0.05
"""Share of a response that its block may cut off; the peak of its mode is as much too low [1]."""
SAFE = 0.4
"""Part of it that a named remedy aims at: of close modes the slowest remains [1]."""
CHANCE = 1e-3
"""Probability with which noise alone passes for a response that is left [1]."""
PROMINENT = 2.0
"""Height of a peak over its surroundings from which on it is a mode's [1]."""
SMALLEST_PEAK = 0.01
"""Height of a peak over the highest in the band below which it is not judged [1]."""
REACH, INSTANTS = 16, 256
"""Half lines of the response to either side of a peak that are transformed back with it, and the
instants of the response and of the zeros behind it at which they are."""
FEWEST_SAMPLES = 64
"""Samples of a response that its decay is judged by."""
LATEST = 0.5
"""Time by which the main push has its peak, over the duration of the block [1]."""


@checked(force="h s", response="h s c", channels="c distinct", units="c", ranges="c")
class HammerMeasurement:
    """All hits on one point, each with one block of every channel.

    `force` (n_hit, n_sample) [N] and `response` (n_hit, n_sample, n_channel) with the units of the
    channels, at `rate` samples a second, `pretrigger` seconds of them before the trigger; ranges
    are the largest values that the channels can hold, infinite where not known. InputError: shapes
    that disagree, doubled names, a value not finite, no force, a pretrigger longer than a block.
    """

    impact: str
    force: RealArray
    response: RealArray
    channels: tuple[str, ...]
    units: tuple[str, ...]
    ranges: tuple[float, ...]
    rate: float
    pretrigger: float = 0.0
    force_range: float = math.inf

    def __post_init__(self) -> None:
        if not 0 <= self.pretrigger * self.rate < self.n_sample:
            raise InputError(
                f"{self.name}: a pretrigger of {self.pretrigger} s does not fit blocks of "
                f"{self.n_sample} samples at {self.rate} Hz"
            )
        if not np.any(self.force):
            raise InputError(
                f"{self.name}: no force in any hit: is the hammer's channel the right one?"
            )

    @property
    def name(self) -> str:
        """Name for messages."""
        return f"impact {self.impact}"

    @property
    def n_sample(self) -> int:
        """Samples of a block."""
        return int(self.force.shape[1])

    @property
    def n_before(self) -> int:
        """Samples that are surely before the push: a trigger comes on its rise."""
        return int(0.8 * self.pretrigger * self.rate)


@dataclass(frozen=True, eq=False)
class HammerTest:
    """An impact test: where the hammer struck, where sensors sit, and the hits.

    Raises InputError: other impacts, or another order of them, than measured; doubled names; a
    sensor of which no channel is measured.

    - `sensors`: sensors with a position; responses without one, such as ears, have no entry.
    """

    title: str
    impacts: tuple[Impact, ...]
    sensors: tuple[Sensor, ...]
    measurements: tuple[HammerMeasurement, ...]

    def __post_init__(self) -> None:
        struck = [impact.name for impact in self.impacts]
        measured = [measurement.impact for measurement in self.measurements]
        if struck != measured or len(set(struck)) != len(struck):
            raise InputError(
                f"{self.title}: impacts {struck} and measurements {measured} are not the same "
                "names, each once, in one order"
            )
        for measurement in self.measurements:
            silent = [
                sensor.name
                for sensor in self.sensors
                if not set(sensor.channels) & set(measurement.channels)
            ]
            if silent:
                raise InputError(
                    f"{self.title}: sensors {silent} have a position and no channel at impact "
                    f"{measurement.impact}: measure them or take them off the sheet"
                )


@dataclass(frozen=True)
class HitRecord:
    """What became of one hit: number from 1, peak [N], reasons why it is left out."""

    number: int
    peak: float
    reasons: tuple[str, ...] = ()

    @property
    def used(self) -> bool:
        """Whether it is part of the average."""
        return not self.reasons


def check_hits(measurement: HammerMeasurement) -> tuple[HitRecord, ...]:
    """Judge every hit, in their order.

    A double hit is a second maximum of the force of at least `DOUBLE_HIT`, in height and above its
    surroundings. Hammers only push, filters swing through zero: a maximum that hardly exceeds the
    pull beside it, on the side of the main push, is the filter's ringing. A hit whose own noise
    peaks, `NOISE_PEAKS` times its rms before the push, exceed that share is rejected unchecked.
    """
    loudest = float(np.abs(measurement.force).max())
    records = []
    for index, force in enumerate(measurement.force):
        before = force[: measurement.n_before]
        push = force - (before.mean() if before.size else 0.0)
        reasons = (*_force_faults(measurement, push, loudest), *_overloads(measurement, index))
        records.append(HitRecord(index + 1, float(push.max()), reasons))
    return tuple(records)


def _force_faults(measurement: HammerMeasurement, push: RealArray, loudest: float) -> Iterator[str]:
    peak, pull, main = float(push.max()), -float(push.min()), int(np.argmax(push))
    before = push[: measurement.n_before]
    noise = float(np.sqrt(np.mean(before**2))) if before.size else 0.0
    at, duration = main / measurement.rate, measurement.n_sample / measurement.rate
    if main < measurement.n_before and peak > pull:
        early = measurement.pretrigger - at
        yield f"early: its peak comes {early:.3g} s before the trigger: is the pretrigger right?"
        return
    # a hammer that was not used shows noise: far below the other hits, or no peak above its own
    if max(peak, pull) <= max(NOISE_PEAKS * noise, 1e-3 * loudest):
        yield f"no force: peak of {peak:.3g} N"
    elif pull > peak:
        yield (
            f"force reversed: it pulls with {pull:.3g} N and pushes with {peak:.3g} N; give its "
            "channel the other sign"
        )
    elif noise * NOISE_PEAKS > DOUBLE_HIT * peak:
        yield (
            f"too weak for its noise: {noise:.2g} N rms against a peak of {peak:.3g} N hides a "
            "double hit"
        )
    else:
        share, later = _second_push(push)
        if share:
            apart = later / measurement.rate
            yield f"double hit: {100 * share:.0f} % again, {1e3 * apart:.1f} ms from the main push"
    if at > LATEST * duration:
        yield f"late: its peak comes {at:.3g} s into a block of {duration:.3g} s"


def _second_push(push: RealArray) -> tuple[float, float]:
    """Share of the largest push beside the main one, and how many samples later; 0 if none."""
    fine = resample(push, FINE * push.size)
    main, reach = int(np.argmax(fine)), FINE * RINGING
    least = DOUBLE_HIT * fine[main]
    # zeros around it: a push at the block's edge is a peak, too
    places = find_peaks(np.pad(fine, 1), height=least, prominence=least)[0] - 1
    seconds = []
    for place in places[places != main]:
        beside = fine[max(place - reach, 0) : place] if place > main else fine[place:][:reach]
        if fine[place] > -ABOVE_RINGING * beside.min():
            seconds.append((fine[place] / fine[main], (place - main) / FINE))
    return max(seconds, default=(0.0, 0.0))


def _overloads(measurement: HammerMeasurement, index: int) -> Iterator[str]:
    force, responses = measurement.force[index], measurement.response[index]
    peaks = (np.abs(force).max(), *np.abs(responses).max(axis=0))
    names = ("force", *measurement.channels)
    units = ("N", *measurement.units)
    ranges = (measurement.force_range, *measurement.ranges)
    for name, unit, bound, peak in zip(names, units, ranges, peaks, strict=True):
        if peak >= OVERLOAD * bound:
            yield f"overload of '{name}': {peak:.4g} {unit} in a range of {bound:.4g} {unit}"


def _summary(records: Sequence[HitRecord]) -> str:
    """One sentence on which hits were rejected and why."""
    rejected = [
        f"hit {record.number}: {', '.join(record.reasons)}" for record in records if not record.used
    ]
    return "; ".join(rejected) if rejected else f"all {len(records)} hits are good"


@dataclass(frozen=True)
class ForceWindow:
    """Seconds `before` and `after` the trigger of the push, `taper` beyond; the rest is noise."""

    before: float
    after: float
    taper: float = 0.0


@checked(minimum_hits=">=1")
class HammerOptions:
    """How hits become an FRF.

    - `time_constant`, optional: τ of an exponential window on force and response; by default none
      [s]. It moves every pole by 1/τ; result and functions state it as `added_decay_rate`, their
      values are left as measured, and modal analysis takes it off.
    - `band` (float, float), optional, optional: first and last frequency of the result [Hz]; by
      default from above 0 to rate/2.56, above which anti-aliasing filters work.
    - `minimum_hits`: fewest good hits, at least 1. With 1, allow an FRF whose coherence is not
      known.
    """

    force_window: ForceWindow | None = None
    time_constant: float | None = None
    band: tuple[float, float] | None = None
    minimum_hits: int = 2


@dataclass(frozen=True)
class Remainder:
    """What is left of a mode at the end of its block: that of which most is left.

    - `share`: amplitude at the end over that after the push, window included; 0 where nothing is
      seen [1].
    - `frequency`: near which [Hz].
    - `seconds`: from the push to the end of the block [s].
    """

    channel: str
    share: float
    frequency: float
    seconds: float

    @property
    def decay_rate(self) -> float:
        """Decay rate of the mode, that of a window included [1/s]."""
        return -math.log(self.share) / self.seconds if self.share > 0 else math.inf


@checked(frequency="f", values="f o i", coherence="f o i ?", random_error="f o i ?")
class FrfEstimate:
    """FRFs as measured with a hammer, with coherence and random error entry by entry.

    - `frequency` (n_frequency,): lines [Hz].
    - `values` (n_frequency, n_output, n_input): output per force [unit of the output per N].
    - `coherence`, `random_error` (n_frequency, n_output, n_input): ordinary coherence, and relative
      standard deviation of |H| by chance [1]. NaN is not known: one hit only. Bias is not in the
      error.
    - `added_decay_rate`: 1/τ of an exponential window: the values are those of a body whose poles
      lie this much further left, and stay so until poles are corrected [1/s].
    - `remainders`: what is left of each impact's responses at the end of their blocks.
    """

    frequency: RealArray
    values: ComplexArray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    units: tuple[str, ...]
    coherence: RealArray
    random_error: RealArray
    n_averages: tuple[int, ...]
    added_decay_rate: float
    records: tuple[tuple[HitRecord, ...], ...]
    remainders: tuple[Remainder, ...] = ()

    @property
    def not_decayed(self) -> str:
        """Words on responses that their blocks cut off; empty where all have decayed."""
        cut_off = [
            (remainder, impact)
            for remainder, impact in zip(self.remainders, self.inputs, strict=False)
            if remainder.share > LARGEST_REMAINDER
        ]
        if not cut_off:
            return ""
        worst, impact = max(cut_off, key=lambda pair: pair[0].share)
        needed = -math.log(SAFE * LARGEST_REMAINDER)
        rate = self.added_decay_rate + needed / worst.seconds - worst.decay_rate
        longer = f"blocks of {needed / worst.decay_rate:.3g} s" if worst.share < 1 else "a rest"
        return (
            f"{100 * worst.share:.0f} % of the response of '{worst.channel}' near "
            f"{worst.frequency:.1f} Hz is left at the end of the block, {worst.seconds:.3g} s "
            f"after the push at {impact} (more than {100 * LARGEST_REMAINDER:g} % at "
            f"{len(cut_off)} of {len(self.inputs)} impacts): peaks are too low by as much and "
            f"damping is too high; {longer} would do, or, for modal analysis, an exponential "
            f"window with time_constant={1 / rate:.2g} [s]"
        )

    @property
    def frf(self) -> Frf:
        """The values as a matrix of one unit, with the window's decay rate.

        Outputs of several units raise InputError.
        """
        units = sorted(set(self.units))
        if len(units) > 1:
            raise InputError(f"FRFs in units {units}: select outputs of one unit first")
        above = f"({units[0]})" if "/" in units[0] else units[0]
        unit, rate = f"{above}/N", self.added_decay_rate
        return Frf(self.frequency, self.values, self.outputs, self.inputs, unit, rate)

    def select(
        self, outputs: Sequence[str] | None = None, inputs: Sequence[str] | None = None
    ) -> FrfEstimate:
        """Return the named rows and columns, in the order asked for; None keeps them all."""
        part = Frf(self.frequency, self.values, self.outputs, self.inputs, "").select(
            outputs, inputs
        )
        rows = [self.outputs.index(name) for name in part.outputs]
        columns = [self.inputs.index(name) for name in part.inputs]
        return replace(
            self,
            values=part.values,
            outputs=part.outputs,
            inputs=part.inputs,
            units=tuple(self.units[i] for i in rows),
            coherence=self.coherence[:, rows][:, :, columns],
            random_error=self.random_error[:, rows][:, :, columns],
            n_averages=tuple(self.n_averages[i] for i in columns),
            records=tuple(self.records[i] for i in columns),
            remainders=tuple(self.remainders[i] for i in columns) if self.remainders else (),
        )


def hammer_frf(measurement: HammerMeasurement, options: HammerOptions | None = None) -> FrfEstimate:
    """Estimate the FRFs of all responses to one impact.

    Raises InputError: fewer good hits than `minimum_hits`, a push outside the force window, no line
    in the band, a time constant that is not positive. Warns with `FrfEstimate.not_decayed`.

    The mean of each channel before the push is taken out of the block first; a window would make a
    step of it. Spectra are energy densities: an impact has energy, no power.
    """
    estimate = _estimate(measurement, options)
    _warn_of(estimate)
    return estimate


def _warn_of(estimate: FrfEstimate) -> None:
    if words := estimate.not_decayed:
        warnings.warn(words, DataWarning, stacklevel=3)


def _estimate(measurement: HammerMeasurement, options: HammerOptions | None) -> FrfEstimate:
    options = HammerOptions() if options is None else options
    records = check_hits(measurement)
    used = [record.number - 1 for record in records if record.used]
    if len(used) < options.minimum_hits:
        why = ""
        if len(used) == 1:
            why = "; the coherence of one hit is 1 whatever was measured, and says nothing"
        raise InputError(
            f"impact {measurement.impact}: {len(used)} of {len(records)} hits can be averaged, "
            f"{options.minimum_hits} are needed ({_summary(records)}){why}: strike again"
        )
    decay, added_decay_rate = np.ones(measurement.n_sample), 0.0
    if options.time_constant is not None:
        decay = exponential_window(
            measurement.n_sample, measurement.rate, options.time_constant, measurement.pretrigger
        )
        added_decay_rate = 1.0 / options.time_constant
    force = _without_offset(measurement.force[used][:, :, np.newaxis], measurement)
    response = _without_offset(measurement.response[used], measurement)
    spectra = cross_spectra(
        force,
        response,
        measurement.rate,
        input_window=decay * _touching(measurement, used, options.force_window),
        output_window=decay,
        scaling=SpectrumScaling.ENERGY_DENSITY,
    )
    low, high = options.band or (0.0, USABLE_SHARE * spectra.frequency[-1])
    # sensors do not measure 0 Hz, and a quotient of two offsets is no FRF
    lines = (spectra.frequency >= low) & (spectra.frequency <= high) & (spectra.frequency > 0)
    if not lines.any():
        raise InputError(
            f"no line from {low:g} Hz to {high:g} Hz: the blocks give "
            f"{spectra.frequency[1]:g} Hz to {spectra.frequency[-1]:g} Hz"
        )
    part = spectra.on_lines(lines)
    values = h1(part)
    coherent = error = np.full(values.shape, np.nan)
    if len(used) > 1:
        coherent = coherence(part)
        error = magnitude_error(coherent, len(used))
    return FrfEstimate(
        frequency=part.frequency,
        values=values,
        outputs=measurement.channels,
        inputs=(measurement.impact,),
        units=measurement.units,
        coherence=coherent,
        random_error=error,
        n_averages=(len(used),),
        added_decay_rate=added_decay_rate,
        records=(records,),
        remainders=(_remainder(measurement, force, response, (low, high), added_decay_rate),),
    )


def _remainder(
    measurement: HammerMeasurement,
    force: RealArray,
    response: RealArray,
    band: tuple[float, float],
    added_decay_rate: float,
) -> Remainder:
    """Find the mode in the band of which most is left, from hits (n_hit, n_sample, n_channel).

    The lines around each peak of a function, transformed back, are the response of its modes over
    time. Its energy falls by ``e^{−2δD}`` between two parts that are D apart, a decay rate δ leaves
    ``e^{−δT}`` of the amplitude at the end of the time T after the push. The scatter of the hits
    says what of it is noise; one hit has none, and is not judged.
    """
    n_hit, n_sample, rate = len(force), measurement.n_sample, measurement.rate
    n_after = n_sample - int(np.argmax(np.abs(force[:, :, 0]), axis=1).max()) - 1
    nothing = Remainder(measurement.channels[0], 0.0, 0.0, n_after / rate)
    if n_hit < 2 or n_after < FEWEST_SAMPLES:
        return nothing
    pushed, answered = np.fft.rfft(force, axis=1), np.fft.rfft(response, axis=1)
    power = np.sum(np.abs(pushed) ** 2, axis=0)
    power = np.where(power > SILENT * power.max(), power, np.inf)
    functions = np.sum(answered * pushed.conj(), axis=0) / power
    scatter = np.sum(np.abs(answered - functions * pushed) ** 2, axis=0) / (n_hit - 1) / power
    # as many zeros behind the response: what a narrow filter rings beyond its ends falls there
    impulse = np.fft.irfft(functions, n_sample, axis=0)[:n_after]
    frequency = np.fft.rfftfreq(2 * n_after, 1.0 / rate)
    spectra = np.fft.rfft(impulse, 2 * n_after, axis=0)
    inside = np.flatnonzero((frequency >= band[0]) & (frequency <= band[1]))
    inside = inside[(inside >= REACH) & (inside < frequency.size - REACH)]
    if not inside.size:
        return nothing
    lines = np.fft.rfftfreq(n_sample, 1.0 / rate)
    taper = np.hanning(2 * REACH + 3)[1:-1]
    beyond_chance = float(stats.f.isf(CHANCE, 2, 2 * (n_hit - 1)))
    # the ends, where a narrow filter blurs what begins and is cut off, take no part
    edge, middle, end = INSTANTS // 32, INSTANTS // 4, INSTANTS // 2
    part = middle - edge
    modes = []
    for channel, function, spread in zip(measurement.channels, spectra.T, scatter.T, strict=True):
        noise = np.interp(frequency, lines, spread) * n_after / n_sample
        level = np.convolve(np.abs(function) ** 2, taper, "same")[inside]
        low = max(SMALLEST_PEAK**2 * level.max(), np.finfo(float).tiny)
        tops = find_peaks(np.log(np.maximum(level, low)), prominence=2 * math.log(PROMINENT))[0]
        for peak in inside[tops]:
            near = slice(peak - REACH, peak + REACH + 1)
            energy = np.abs(np.fft.ifft(taper * function[near], INSTANTS)) ** 2
            begun, left = (float(energy[begin : begin + part].sum()) for begin in (edge, middle))
            # noise is as strong in both parts
            chance = float(np.sum(taper**2 * noise[near])) / INSTANTS * part / end
            if min(begun, left) > beyond_chance * chance:
                share = min((left - chance) / begun, 1.0) ** (end / (2 * part))
                share *= math.exp(-added_decay_rate * nothing.seconds)
                remainder = Remainder(channel, share, float(frequency[peak]), nothing.seconds)
                # of modes that are cut off the strongest counts, of others the slowest
                cut_off = share > LARGEST_REMAINDER
                modes.append((cut_off, left if cut_off else share, remainder))
    return max(modes, key=lambda mode: mode[:2], default=(False, 0.0, nothing))[2]


def hammer_frfs(test: HammerTest, options: HammerOptions | None = None) -> FrfEstimate:
    """Estimate the FRFs of all responses to all impacts of a test, one column per impact.

    Errors and warning as of `hammer_frf`, with the impact; no impact, or outputs, units or lines
    that differ from impact to impact, raise InputError.
    """
    estimates = [_estimate(measurement, options) for measurement in test.measurements]
    if not estimates:
        raise InputError(f"{test.title}: no impact to estimate functions of: give at least one")
    first = estimates[0]
    for other in estimates[1:]:
        name = f"{test.title}: input {other.inputs[0]} and input {first.inputs[0]}"
        if (other.outputs, other.units) != (first.outputs, first.units):
            raise InputError(f"{name} have other outputs: measure the same ones")
        if not np.array_equal(other.frequency, first.frequency):
            raise InputError(f"{name} have other frequency lines: use one rate and block length")
    joined = replace(
        first,
        values=np.concatenate([estimate.values for estimate in estimates], axis=2),
        coherence=np.concatenate([estimate.coherence for estimate in estimates], axis=2),
        random_error=np.concatenate([estimate.random_error for estimate in estimates], axis=2),
        inputs=tuple(estimate.inputs[0] for estimate in estimates),
        n_averages=tuple(estimate.n_averages[0] for estimate in estimates),
        records=tuple(estimate.records[0] for estimate in estimates),
        remainders=tuple(estimate.remainders[0] for estimate in estimates),
    )
    _warn_of(joined)
    return joined


def _without_offset(blocks: RealArray, measurement: HammerMeasurement) -> RealArray:
    if measurement.n_before == 0:
        return blocks
    return np.asarray(blocks - blocks[:, : measurement.n_before].mean(axis=1, keepdims=True))


def _touching(
    measurement: HammerMeasurement, used: list[int], window: ForceWindow | None
) -> RealArray:
    if window is None:
        return np.ones(measurement.n_sample)
    begin = measurement.pretrigger - window.before
    end = measurement.pretrigger + window.after
    for index in used:
        peak = int(np.argmax(measurement.force[index])) / measurement.rate
        if not begin <= peak <= end:
            raise InputError(
                f"impact {measurement.impact}, hit {index + 1}: the push peaks "
                f"{peak - measurement.pretrigger:.3g} s after the trigger, outside the force "
                "window: widen the window or leave the hit out"
            )
    return force_window(measurement.n_sample, measurement.rate, begin, end, window.taper)
