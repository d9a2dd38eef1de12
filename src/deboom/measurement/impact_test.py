"""Impact tests: hits checked, chosen, windowed and averaged to FRFs with their random error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, refuse_doubled
from deboom.measurement.sensors import Impact, Sensor
from deboom.physics.frf import (
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


@dataclass(frozen=True, eq=False)
class HammerMeasurement:
    """All hits on one point, each with one block of every channel.

    Raises InputError: blocks of different length, shapes that disagree, doubled names, a value that
    is not finite (impact, hit and channel are named), no force at all, a rate or range that is not
    positive, a pretrigger outside the block.

    - `impact`.
    - `force` (n_hit, n_sample).
    - `response` (n_hit, n_sample, n_channel).
    - `channels`, `units`.
    - `rate`.
    - `pretrigger`.
    - `force_range`.
    - `ranges`.
    """

    impact: str
    force: RealArray
    response: RealArray
    channels: tuple[str, ...]
    units: tuple[str, ...]
    rate: float
    pretrigger: float = 0.0
    force_range: float = math.inf
    ranges: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        channels, units = tuple(self.channels), tuple(self.units)
        ranges = tuple(self.ranges) or (math.inf,) * len(channels)
        object.__setattr__(self, "force", self._stacked(self.force, 1, "force"))
        object.__setattr__(self, "response", self._stacked(self.response, 2, "response"))
        object.__setattr__(self, "channels", channels)
        object.__setattr__(self, "units", units)
        object.__setattr__(self, "ranges", ranges)
        expected = (*self.force.shape, len(channels))
        if self.force.ndim != 2 or self.response.shape != expected or 0 in expected:
            raise self._error(
                f"force of shape {self.force.shape} and response of shape {self.response.shape} "
                f"are no hits of {len(channels)} channels, shapes (n_hit, n_sample) and (n_hit, "
                "n_sample, n_channel)"
            )
        refuse_doubled(channels, f"channel of impact {self.impact}")
        if len(units) != len(channels) or len(ranges) != len(channels):
            raise self._error(
                f"{len(channels)} channels, {len(units)} units and {len(ranges)} ranges: state "
                "one of each per channel"
            )
        if not all(limit > 0 for limit in (self.force_range, *ranges)):
            raise self._error("a range is positive, or infinite where it is not known")
        if not self.rate > 0 or not 0 <= self.pretrigger * self.rate < self.n_sample:
            raise self._error(
                f"a rate of {self.rate} Hz and a pretrigger of {self.pretrigger} s do not fit "
                f"blocks of {self.n_sample} samples"
            )
        together = np.concatenate([self.force[:, :, np.newaxis], self.response], axis=2)
        bad = ~np.isfinite(together)
        if bad.any():
            hit, sample, column = (int(i) for i in np.argwhere(bad)[0])
            raise self._error(
                f"hit {hit + 1}: channel '{('force', *channels)[column]}' is not finite at sample "
                f"{sample}: leave the hit out or export it again"
            )
        if not np.any(self.force):
            raise self._error("no force in any hit: is the hammer's channel the right one?")

    @property
    def n_sample(self) -> int:
        """Samples of a block."""
        return int(self.force.shape[1])

    @property
    def n_before(self) -> int:
        """Samples that are surely before the push: a trigger comes on its rise."""
        return int(0.8 * self.pretrigger * self.rate)

    def _error(self, sentence: str) -> InputError:
        return InputError(f"impact {self.impact}: {sentence}")

    def _stacked(
        self, blocks: Sequence[npt.ArrayLike] | RealArray, ndim: int, what: str
    ) -> RealArray:
        arrays = [np.asarray(block, dtype=float) for block in blocks]
        for number, array in enumerate(arrays, 1):
            if array.ndim != ndim:
                raise self._error(f"hit {number}: {what} has {array.ndim} dimensions, not {ndim}")
            if array.shape != arrays[0].shape:
                raise self._error(
                    f"hit {number} has a {what} block of shape {array.shape}, hit 1 of "
                    f"{arrays[0].shape}: all blocks of an impact need one length"
                )
        stacked = np.array(arrays)
        stacked.setflags(write=False)
        return stacked


@dataclass(frozen=True, eq=False)
class HammerTest:
    """An impact test: where the hammer struck, where sensors sit, and the hits.

    Raises InputError: another impact than measured, doubled names, or a sensor whose channels are
    not measured.

    - `title`.
    - `impacts`.
    - `sensors`: sensors with a position; responses without one, such as ears, have no entry.
    - `measurements`.
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
class HitChecks:
    """Limits of a good hit.

    - `double_hit`.
    - `overload`.
    - `smallest_force`.
    - `latest`: time by which the main push has its peak, over the duration of the block, above 0 to
      1 [1].
    """

    double_hit: float = 0.05
    overload: float = 0.99
    smallest_force: float = 0.0
    latest: float = 0.5

    def __post_init__(self) -> None:
        fractions = (self.double_hit, self.overload, self.latest)
        if not all(0 < limit <= 1 for limit in fractions) or not self.smallest_force >= 0:
            raise InputError(
                "limits of hits: double_hit, overload and latest are above 0 and at most 1, "
                "smallest_force is not negative"
            )


@dataclass(frozen=True)
class HitRecord:
    """What became of one hit.

    - `number`.
    - `peak`.
    - `reasons`.
    """

    number: int
    peak: float
    reasons: tuple[str, ...] = ()

    @property
    def used(self) -> bool:
        """Whether it is part of the average."""
        return not self.reasons


def check_hits(
    measurement: HammerMeasurement, checks: HitChecks | None = None
) -> tuple[HitRecord, ...]:
    """Judge every hit, in their order.

    - `measurement`.
    - `checks`, optional.

    A double hit is a second maximum of the force of more than the stated share, in height and above
    its surroundings; pulls do not count, since filters and amplifiers swing through zero. A hit
    whose own noise before the push reaches that share cannot be checked, and is rejected.
    """
    limits = HitChecks() if checks is None else checks
    loudest = float(measurement.force.max())
    records = []
    for index, force in enumerate(measurement.force):
        before = force[: measurement.n_before]
        push = force - (before.mean() if before.size else 0.0)
        reasons = [
            *_force_faults(measurement, push, loudest, limits),
            *_overloads(measurement, index, limits.overload),
        ]
        records.append(HitRecord(index + 1, float(push.max()), tuple(reasons)))
    return tuple(records)


def _force_faults(
    measurement: HammerMeasurement, push: RealArray, loudest: float, limits: HitChecks
) -> list[str]:
    peak, main = float(push.max()), int(np.argmax(push))
    before = push[: measurement.n_before]
    noise = float(np.sqrt(np.mean(before**2))) if before.size else 0.0
    # a hammer that was not used shows noise: far below the other hits, or no peak above its own
    if peak <= max(limits.smallest_force, NOISE_PEAKS * noise, 1e-3 * loudest):
        return [f"no force: peak of {peak:.3g} N"]
    faults = []
    threshold = limits.double_hit * peak
    if noise * NOISE_PEAKS > threshold:
        faults.append(
            f"too weak for its noise: {noise:.2g} N rms against a peak of {peak:.3g} N hides a "
            "double hit"
        )
    else:
        # zeros around it: a push at the block's edge is a peak, too
        peaks, _ = find_peaks(np.pad(push, 1), height=threshold, prominence=threshold)
        others = [int(i) - 1 for i in peaks if i - 1 != main]
        if others:
            second = max(others, key=lambda i: push[i])
            apart = (second - main) / measurement.rate
            faults.append(
                f"double hit: {100 * push[second] / peak:.0f} % again, {1e3 * apart:.1f} ms from "
                "the main push"
            )
    at, duration = main / measurement.rate, measurement.n_sample / measurement.rate
    if at > limits.latest * duration:
        faults.append(f"late: its peak comes {at:.3g} s into a block of {duration:.3g} s")
    return faults


def _overloads(measurement: HammerMeasurement, index: int, limit: float) -> list[str]:
    force, responses = measurement.force[index], measurement.response[index]
    peaks = (np.abs(force).max(), *np.abs(responses).max(axis=0))
    names = ("force", *measurement.channels)
    units = ("N", *measurement.units)
    ranges = (measurement.force_range, *measurement.ranges)
    return [
        f"overload of '{name}': {peak:.4g} {unit} in a range of {bound:.4g} {unit}"
        for name, unit, bound, peak in zip(names, units, ranges, peaks, strict=True)
        if peak >= limit * bound
    ]


def _summary(records: Sequence[HitRecord]) -> str:
    """One sentence on which hits were rejected and why."""
    rejected = [
        f"hit {record.number}: {', '.join(record.reasons)}" for record in records if not record.used
    ]
    return "; ".join(rejected) if rejected else f"all {len(records)} hits are good"


@dataclass(frozen=True)
class ForceWindow:
    """Part of the block in which the hammer may touch; the force outside is taken for noise.

    - `before`, `after`.
    - `taper`.
    """

    before: float
    after: float
    taper: float = 0.0


@dataclass(frozen=True)
class HammerOptions:
    """How hits become an FRF.

    - `force_window`, optional.
    - `time_constant`, optional: τ of an exponential window on force and response; by default none
      [s]. It moves every pole by 1/τ; the result states it as `added_decay_rate`, and the values
      are left as measured.
    - `band` (float, float), optional, optional: first and last frequency of the result [Hz]; by
      default from above 0 to rate/2.56, above which anti-aliasing filters work.
    - `minimum_hits`: fewest good hits, at least 1. With 1, allow an FRF whose coherence is not
      known.
    - `checks`.
    """

    force_window: ForceWindow | None = None
    time_constant: float | None = None
    band: tuple[float, float] | None = None
    minimum_hits: int = 2
    checks: HitChecks = field(default_factory=HitChecks)

    def __post_init__(self) -> None:
        if self.minimum_hits < 1:
            raise InputError(f"an FRF needs at least one hit, not {self.minimum_hits}")


@checked(frequency="f", values="f o i", coherence="f o i ?", random_error="f o i ?")
class FrfEstimate:
    """FRFs as measured with a hammer, with coherence and random error entry by entry.

    - `frequency` (n_frequency,).
    - `values` (n_frequency, n_output, n_input).
    - `outputs`, `inputs`.
    - `units`.
    - `coherence`, `random_error` (n_frequency, n_output, n_input): ordinary coherence, and relative
      standard deviation of |H| by chance [1]. NaN is not known: one hit only. Bias is not in the
      error.
    - `n_averages`.
    - `added_decay_rate`: 1/τ of an exponential window: the values are those of a body whose poles
      lie this much further left, and stay so until poles are corrected [1/s].
    - `records`.
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

    @property
    def frf(self) -> Frf:
        """The values as a matrix of one unit; outputs of several units raise InputError."""
        units = sorted(set(self.units))
        if len(units) > 1:
            raise InputError(f"FRFs in units {units}: select outputs of one unit first")
        above = f"({units[0]})" if "/" in units[0] else units[0]
        return Frf(self.frequency, self.values, self.outputs, self.inputs, f"{above}/N")

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
        )


def hammer_frf(measurement: HammerMeasurement, options: HammerOptions | None = None) -> FrfEstimate:
    """Estimate the FRFs of all responses to one impact.

    Raises InputError: too few good hits, one hit without having allowed it, a push outside the
    force window, no line in the band.

    - `measurement`.
    - `options`, optional.

    The mean of each channel before the push is taken out of the block first; a window would make a
    step of it. Spectra are energy densities: an impact has energy, no power.
    """
    options = HammerOptions() if options is None else options
    records = check_hits(measurement, options.checks)
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
    spectra = cross_spectra(
        _without_offset(measurement.force[used][:, :, np.newaxis], measurement),
        _without_offset(measurement.response[used], measurement),
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
    )


def hammer_frfs(test: HammerTest, options: HammerOptions | None = None) -> FrfEstimate:
    """Estimate the FRFs of all responses to all impacts of a test, one column per impact.

    Errors as of `hammer_frf`, with the impact; outputs, lines or windows that differ from impact to
    impact raise InputError.
    """
    estimates = [hammer_frf(measurement, options) for measurement in test.measurements]
    if not estimates:
        raise InputError(f"{test.title}: no impact to estimate functions of: give at least one")
    first = estimates[0]
    for other in estimates[1:]:
        name = f"{test.title}: input {other.inputs[0]} and input {first.inputs[0]}"
        if (other.outputs, other.units) != (first.outputs, first.units):
            raise InputError(f"{name} have other outputs: measure the same ones")
        if not np.array_equal(other.frequency, first.frequency):
            raise InputError(f"{name} have other frequency lines: use one rate and block length")
    return replace(
        first,
        values=np.concatenate([estimate.values for estimate in estimates], axis=2),
        coherence=np.concatenate([estimate.coherence for estimate in estimates], axis=2),
        random_error=np.concatenate([estimate.random_error for estimate in estimates], axis=2),
        inputs=tuple(estimate.inputs[0] for estimate in estimates),
        n_averages=tuple(estimate.n_averages[0] for estimate in estimates),
        records=tuple(estimate.records[0] for estimate in estimates),
    )


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
