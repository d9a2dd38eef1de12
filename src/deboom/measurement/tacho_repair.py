"""Missing, doubled and displaced tacho pulses: numbered by what is true of a shaft, and reported.

No pulse is invented. A missing pulse is a gap in the numbers, which the shaft angle bridges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.tacho import LEAST_PULSES
from deboom.measurement.tacho_numbering import (
    LONGEST_GAP,
    UNEVEN,
    WINDOW,
    IntArray,
    local_period,
    number_pulses,
    without_displaced,
)

MISCOUNT = 0.35
"""Pulses by which a gap may differ from its count."""
MOST_REPAIRED = 0.2
"""Pulses dropped, and missing, per good one beyond which a signal is refused."""
FASTEST_CHANGE = 1.8
"""Ratio of the running medians nine intervals apart that is a stop and no run-up, once refused."""


@dataclass(frozen=True, eq=False)
class PulseTrain:
    """The pulses of a tacho that can be trusted, and what was done to get there.

    Parameters
    ----------
    name : str
        Of the tacho channel.
    times : array, shape (n_pulse,)
        Increasing [s].
    number : array of int, shape (n_pulse,)
        Count of each pulse from the one nearest to the first that was triggered; a step above 1
        bridges missing pulses.
    pulses_per_revolution : int
        Of the tacho.
    dropped : array, shape (n_dropped,)
        Times of pulses left out: doubled, stray or displaced [s].
    missing : array, shape (n_missing,)
        Times at which a pulse was due and none was trusted [s]. A displaced pulse counts here and
        among the dropped.
    """

    name: str
    times: RealArray
    number: IntArray
    pulses_per_revolution: int
    dropped: RealArray
    missing: RealArray

    def __post_init__(self) -> None:
        for field in ("times", "number", "dropped", "missing"):
            array = np.array(getattr(self, field))
            array.setflags(write=False)
            object.__setattr__(self, field, array)

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

    Parameters
    ----------
    times : array, shape (n,)
        Of the pulses as triggered, increasing [s].
    pulses_per_revolution : int
        At least 1.
    name : str
        Of the tacho channel.

    Returns
    -------
    PulseTrain

    Raises
    ------
    InputError
        Fewer than ten pulses, times that do not increase, intervals that no smooth speed
        explains, a gap that cannot be counted, too many bad pulses, or a shaft that stops or turns
        back.

    Notes
    -----
    Intervals are compared with their running median over nine. Out of all chains of pulses that
    are about whole numbers of intervals apart, the one that needs the fewest repairs is taken. Then
    each pulse is compared with the cubic through its eight neighbours, and dropped if it is off by
    six robust standard deviations and 0.5 % of an interval; near an end the outermost goes.
    """
    raw = _checked_times(times, pulses_per_revolution, name)
    number = number_pulses(raw)
    taken = without_displaced(raw, number)
    count, kept = number[taken], raw[taken]
    if count.size < LEAST_PULSES:
        raise InputError(_stop(raw, name) or _scattered(name))
    absent = np.setdiff1d(np.arange(count[0], count[-1] + 1), count)
    missing = np.interp(absent, count, kept)
    # the first pulse triggered is the zero mark, even if it is displaced and left out
    count = count - count[0] + round((kept[0] - raw[0]) / local_period(kept, count)[0])
    train = PulseTrain(name, kept, count, pulses_per_revolution, raw[~taken], missing)
    problem = (
        _too_many(train, train.dropped) or _miscounted(train) or _too_many(train, train.missing)
    )
    if problem:
        raise InputError(_stop(raw, name) or problem)
    return train


def _checked_times(times: npt.ArrayLike, pulses_per_revolution: int, name: str) -> RealArray:
    raw = np.asarray(times, dtype=float)
    if pulses_per_revolution < 1:
        raise InputError(f"{name}: {pulses_per_revolution} pulses per revolution; give at least 1")
    if raw.ndim != 1 or raw.size < LEAST_PULSES:
        raise InputError(
            f"{name} has {raw.size} pulses, {LEAST_PULSES} are needed: measure for longer"
        )
    if not np.all(np.isfinite(raw)) or np.any(np.diff(raw) <= 0):
        raise InputError(f"{name}: pulse times must be finite and increase from pulse to pulse")
    return raw


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
    usual = local_period(train.times, train.number)
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


def _scattered(name: str) -> str:
    return (
        f"{name}: the intervals between pulses fit no smooth speed: check the sensor, the trigger "
        "level and the hysteresis"
    )


def _at(times: RealArray) -> str:
    if times.size == 0:
        return ""
    shown = ", ".join(f"{time:.3f}" for time in times[:5])
    return f" (at {shown}{', …' if times.size > 5 else ''} s)"
