"""Hits of an impact test as they were sampled, with names, units and ranges."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.impacts import Impact
from deboom.measurement.sensors import Sensor


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
