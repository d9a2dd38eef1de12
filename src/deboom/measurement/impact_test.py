"""Impact tests: hits checked, chosen, windowed and averaged to FRFs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.frf_estimate import (
    BlockRecord,
    Estimator,
    FrfEstimate,
    chosen_blocks,
    estimated,
    join_estimates,
    summary,
)
from deboom.measurement.sensors import Impact, Sensor
from deboom.physics.frf import SpectrumScaling, cross_spectra, exponential_window, force_window


@dataclass(frozen=True, eq=False)
class HammerMeasurement:
    """All hits on one point, each with one block of every channel.

    Parameters
    ----------
    impact : str
        Name of the point, such as ``I07`` or ``EnM x``: the input of the FRF.
    force : array, shape (n_hit, n_sample)
        Positive along the direction of the impact [N].
    response : array, shape (n_hit, n_sample, n_channel)
        [units].
    channels : sequence of str
        Name of each response.
    units : sequence of str
        SI unit of each response.
    rate : float
        Samples per second [Hz].
    pretrigger : float
        Time from the first sample to the trigger [s].
    force_range : float
        Largest force that the channel can hold; ``math.inf`` is not known [N].
    ranges : sequence of float
        The same of each response [units]; left out, not known.

    Raises
    ------
    InputError
        Blocks of different length, shapes that disagree, doubled names, a value that is not
        finite (impact, hit and channel are named), no force at all, a rate or range that is not
        positive, a pretrigger outside the block.
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
        doubled = sorted(name for name, count in Counter(channels).items() if count > 1)
        if doubled:
            raise self._error(f"duplicated channel {doubled}: every channel needs its own name")
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
        self._refuse_not_finite()
        if not np.any(self.force):
            raise self._error("no force in any hit: is the hammer's channel the right one?")

    @property
    def n_hit(self) -> int:
        """Number of hits."""
        return int(self.force.shape[0])

    @property
    def n_sample(self) -> int:
        """Samples of a block."""
        return int(self.force.shape[1])

    @property
    def n_before(self) -> int:
        """Samples that are surely before the push: a trigger comes on its rise."""
        return int(0.8 * self.pretrigger * self.rate)

    def select(self, channels: Sequence[str]) -> HammerMeasurement:
        """Return the measurement with the named responses only, in the order asked for.

        Raises
        ------
        InputError
            A name that is not there.
        """
        missing = [name for name in channels if name not in self.channels]
        if missing:
            raise self._error(f"no channel named {missing}; there are {list(self.channels)}")
        columns = [self.channels.index(name) for name in channels]
        return HammerMeasurement(
            impact=self.impact,
            force=self.force,
            response=self.response[:, :, columns],
            channels=tuple(channels),
            units=tuple(self.units[i] for i in columns),
            rate=self.rate,
            pretrigger=self.pretrigger,
            force_range=self.force_range,
            ranges=tuple(self.ranges[i] for i in columns),
        )

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

    def _refuse_not_finite(self) -> None:
        together = np.concatenate([self.force[:, :, np.newaxis], self.response], axis=2)
        bad = ~np.isfinite(together)
        if bad.any():
            hit, sample, column = (int(i) for i in np.argwhere(bad)[0])
            name = ("force", *self.channels)[column]
            raise self._error(
                f"hit {hit + 1}: channel '{name}' is not finite at sample {sample}: leave the hit "
                "out or export it again"
            )


@dataclass(frozen=True, eq=False)
class HammerTest:
    """An impact test: where the hammer struck, where sensors sit, and the hits.

    Parameters
    ----------
    title : str
        Of the test.
    impacts : sequence of Impact
        Points that were struck.
    sensors : sequence of Sensor
        With a position; responses without one, such as ears, have no entry.
    measurements : sequence of HammerMeasurement
        One per impact, in the order of the impacts.

    Raises
    ------
    InputError
        Another impact than measured, doubled names, or a sensor whose channels are not measured.
    """

    title: str
    impacts: tuple[Impact, ...]
    sensors: tuple[Sensor, ...]
    measurements: tuple[HammerMeasurement, ...]

    def __post_init__(self) -> None:
        for name in ("impacts", "sensors", "measurements"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
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

    def measurement(self, impact: str) -> HammerMeasurement:
        """Return the hits of one impact.

        Raises
        ------
        InputError
            No such impact.
        """
        for measurement in self.measurements:
            if measurement.impact == impact:
                return measurement
        known = [measurement.impact for measurement in self.measurements]
        raise InputError(f"{self.title}: no impact named '{impact}'; there are {known}")


NOISE_PEAKS = 5.0
"""Peaks of a noise reach this many times its rms; lower second peaks say nothing."""


@dataclass(frozen=True)
class HitChecks:
    """Limits of a good hit.

    Parameters
    ----------
    double_hit : float
        Largest second push, over the main one [1].
    overload : float
        Largest value of a channel, over its range [1].
    smallest_force : float
        Least peak force; a hit is never accepted without any [N].
    latest : float
        Time by which the main push has its peak, over the duration of the block [1].

    Raises
    ------
    InputError
        A limit that makes no sense.
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


def check_hits(
    measurement: HammerMeasurement, checks: HitChecks | None = None
) -> tuple[BlockRecord, ...]:
    """Judge every hit.

    Parameters
    ----------
    measurement : HammerMeasurement
        n hits.
    checks : HitChecks, optional
        Limits; by default `HitChecks()`.

    Returns
    -------
    tuple of BlockRecord
        One per hit, in their order.

    Notes
    -----
    A double hit is a second maximum of the force of more than the stated share, in height and
    above its surroundings; pulls do not count, since filters and amplifiers swing through zero. A
    hit whose own noise before the push reaches that share cannot be checked, and is rejected.
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
        records.append(BlockRecord(index + 1, float(push.max()), not reasons, tuple(reasons)))
    return tuple(records)


def _force_faults(
    measurement: HammerMeasurement, push: RealArray, loudest: float, limits: HitChecks
) -> list[str]:
    peak = float(push.max())
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
        others = [int(i) - 1 for i in peaks if i - 1 != int(np.argmax(push))]
        if others:
            second = max(others, key=lambda i: push[i])
            apart = (second - int(np.argmax(push))) / measurement.rate
            faults.append(
                f"double hit: {100 * push[second] / peak:.0f} % again, {1e3 * apart:.1f} ms from "
                "the main push"
            )
    at = int(np.argmax(push)) / measurement.rate
    duration = measurement.n_sample / measurement.rate
    if at > limits.latest * duration:
        faults.append(f"late: its peak comes {at:.3g} s into a block of {duration:.3g} s")
    return faults


def _overloads(measurement: HammerMeasurement, index: int, limit: float) -> list[str]:
    peaks = np.concatenate(
        [
            [np.abs(measurement.force[index]).max()],
            np.abs(measurement.response[index]).max(axis=0),
        ]
    )
    names = ("force", *measurement.channels)
    units = ("N", *measurement.units)
    ranges = (measurement.force_range, *measurement.ranges)
    return [
        f"overload of '{name}': {peak:.4g} {unit} in a range of {bound:.4g} {unit}"
        for name, unit, bound, peak in zip(names, units, ranges, peaks, strict=True)
        if peak >= limit * bound
    ]


@dataclass(frozen=True)
class ForceWindow:
    """Part of the block in which the hammer may touch; the force outside is taken for noise.

    Parameters
    ----------
    before, after : float
        Flat from so long before the trigger until so long after it [s].
    taper : float
        Cosine at both ends [s].
    """

    before: float
    after: float
    taper: float = 0.0


@dataclass(frozen=True)
class HammerOptions:
    """How hits become an FRF.

    Parameters
    ----------
    estimator : Estimator
        H1 by default: a hammer's force cell is quieter than the responses.
    force_window : ForceWindow, optional
        By default none.
    time_constant : float, optional
        τ of an exponential window on force and response; by default none [s]. It moves every pole
        by 1/τ; the result states it as `added_decay_rate`, and the values are left as measured.
    band : (float, float), optional
        First and last frequency of the result [Hz]; by default from above 0 to rate/2.56, above
        which anti-aliasing filters work.
    minimum_hits : int
        Fewer good hits are refused. With 1, allow an FRF whose coherence is not known.
    checks : HitChecks
        Limits of a good hit.

    Raises
    ------
    InputError
        Less than one hit.
    """

    estimator: Estimator = Estimator.H1
    force_window: ForceWindow | None = None
    time_constant: float | None = None
    band: tuple[float, float] | None = None
    minimum_hits: int = 2
    checks: HitChecks = field(default_factory=HitChecks)

    def __post_init__(self) -> None:
        if self.minimum_hits < 1:
            raise InputError(f"an FRF needs at least one hit, not {self.minimum_hits}")


def hammer_frf(
    measurement: HammerMeasurement,
    options: HammerOptions | None = None,
    *,
    hits: Sequence[int] | None = None,
    count: int | None = None,
) -> FrfEstimate:
    """FRFs of all responses to one impact.

    Parameters
    ----------
    measurement : HammerMeasurement
        Hits on one point.
    options : HammerOptions, optional
        By default `HammerOptions()`.
    hits : sequence of int, optional
        Numbers of the hits to choose from, 1 is the first; by default all.
    count : int, optional
        How many good ones of them to average, the first ones; by default all.

    Returns
    -------
    FrfEstimate
        One column; `records` says which hits were rejected and why.

    Raises
    ------
    InputError
        Too few good hits, one hit without having allowed it, a push outside the force window, no
        line in the band.

    Notes
    -----
    The mean of each channel before the push is taken out of the block first; a window would make
    a step of it. Spectra are energy densities: an impact has energy, no power.
    """
    options = HammerOptions() if options is None else options
    records = chosen_blocks(check_hits(measurement, options.checks), hits, count)
    used = [record.number - 1 for record in records if record.used]
    if len(used) < options.minimum_hits:
        why = ""
        if len(used) == 1:
            why = "; the coherence of one hit is 1 whatever was measured, and says nothing"
        raise InputError(
            f"impact {measurement.impact}: {len(used)} of {len(records)} hits can be averaged, "
            f"{options.minimum_hits} are needed ({summary(records)}){why}: strike again"
        )
    force = _without_offset(measurement.force[used][:, :, np.newaxis], measurement)
    response = _without_offset(measurement.response[used], measurement)
    decay = np.ones(measurement.n_sample)
    if options.time_constant is not None:
        decay = exponential_window(
            measurement.n_sample, measurement.rate, options.time_constant, measurement.pretrigger
        )
    spectra = cross_spectra(
        force,
        response,
        measurement.rate,
        input_window=decay * _touching(measurement, used, options.force_window),
        output_window=decay,
        scaling=SpectrumScaling.ENERGY_DENSITY,
    )
    return estimated(
        spectra,
        outputs=measurement.channels,
        inputs=(measurement.impact,),
        output_units=measurement.units,
        input_units=("N",),
        estimator=options.estimator,
        band=options.band,
        n_averages=len(used),
        added_decay_rate=0.0 if options.time_constant is None else 1.0 / options.time_constant,
        records=records,
    )


def hammer_frfs(test: HammerTest, options: HammerOptions | None = None) -> FrfEstimate:
    """FRFs of all responses to all impacts of a test, one column per impact.

    Parameters
    ----------
    test : HammerTest
        With the same responses at each impact.
    options : HammerOptions, optional
        By default `HammerOptions()`.

    Returns
    -------
    FrfEstimate
        All good hits averaged.

    Raises
    ------
    InputError
        As `hammer_frf` and `join_estimates`; the impact is named.
    """
    return join_estimates([hammer_frf(one, options) for one in test.measurements])


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
