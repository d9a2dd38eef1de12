"""Missing, doubled and displaced tacho pulses: numbered by what is true of a shaft, and reported.

No pulse is invented. A missing pulse is a gap in the numbers, which the shaft angle bridges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from deboom.errors import InputError
from deboom.measurement.tacho import LEAST_PULSES
from deboom.physics.arrays import RealArray

WINDOW = 9
"""Intervals (and pulses) over which a shaft's speed is compared with itself."""
WHOLE = 0.25
"""How far an interval may be from a whole number of local intervals."""
LONGEST_GAP = 5
"""Pulses missing in a row that can still be counted."""
MOST_REPAIRED = 0.2
"""Share of pulses beyond which a signal is refused."""
LARGEST_CHANGE = 1.5
"""Ratio of neighbouring intervals beyond which a shaft stops or turns back."""
OUTLIER = 6.0
"""Robust standard deviations by which a displaced pulse is off."""
LEAST_OUTLIER = 0.005
"""Of an interval: smaller displacements are left in."""

_IntArray = npt.NDArray[np.int64]


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
        Count of each pulse from the first; a step above 1 bridges missing pulses.
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
    number: _IntArray
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
        Fewer than eight pulses, times that do not increase, intervals that no smooth speed
        explains, a gap of more than five pulses, more than a fifth of the pulses bad, or a speed
        that changes by more than half between two pulses: the shaft stops or turns back, which one
        tacho cannot tell apart.

    Notes
    -----
    Intervals are compared with their running median over nine. From the steadiest place outwards a
    pulse is taken if it lies within a quarter of an interval of a whole number of intervals after
    the last one taken. Then each is compared with the cubic through its eight neighbours, and
    dropped if it is off by six robust standard deviations and 0.5 % of an interval.
    """
    raw = _checked_times(times, pulses_per_revolution, name)
    number = _numbers(raw, name)
    taken = _without_displaced(raw, number, number >= 0)
    count = number[taken]
    if count.size < LEAST_PULSES:
        raise InputError(_scattered(name))
    kept = raw[taken]
    absent = np.setdiff1d(np.arange(count[0], count[-1] + 1), count)
    missing = np.interp(absent, count, kept)
    train = PulseTrain(name, kept, count - count[0], pulses_per_revolution, raw[~taken], missing)
    _refuse_hopeless(train)
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


def _numbers(times: RealArray, name: str) -> _IntArray:
    """Count from the steadiest place outwards; negative where a pulse does not fit."""
    interval = np.diff(times)
    usual = median_filter(interval, size=WINDOW, mode="mirror")
    unsteady = np.abs(interval / usual - 1)
    worst_of_three = np.max([unsteady[:-2], unsteady[1:-1], unsteady[2:]], axis=0)
    anchor = int(np.argmin(worst_of_three))
    if worst_of_three[anchor] > WHOLE:
        raise InputError(_scattered(name))
    period = np.concatenate([usual[:1], (usual[1:] + usual[:-1]) / 2, usual[-1:]])
    after = _follow(times[anchor:], period[anchor:])
    before = _follow(-times[anchor::-1], period[anchor::-1])[::-1]
    lost = np.iinfo(np.int64).min
    number = np.concatenate(
        [np.where(before >= 0, -before, lost)[:-1], np.where(after >= 0, after, lost)]
    )
    fits = number > lost
    return np.where(fits, number - number[fits].min(), -1)


def _follow(times: RealArray, period: RealArray) -> _IntArray:
    """Count onwards from the first pulse; −1 for a pulse that is not whole periods away."""
    number = np.full(times.size, -1, dtype=np.int64)
    number[0] = last = 0
    for i in range(1, times.size):
        step = 2 * (times[i] - times[last]) / (period[i] + period[last])
        whole = round(step)
        if whole >= 1 and abs(step - whole) <= WHOLE:
            number[i] = number[last] + whole
            last = i
    return number


def _without_displaced(
    times: RealArray, number: _IntArray, taken: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """Drop the worst pulse of each neighbourhood until all lie on a smooth course."""
    taken = taken.copy()
    while np.count_nonzero(taken) > WINDOW:
        position = np.flatnonzero(taken)
        deviation, interval = _deviation(times[position], number[position])
        bad = deviation > np.maximum(OUTLIER * _spread(deviation), LEAST_OUTLIER * interval)
        worst = deviation >= _largest_nearby(deviation)
        if not np.any(bad & worst):
            break
        taken[position[bad & worst]] = False
    return taken


def _spread(deviation: RealArray) -> float:
    """Robust standard deviation of unsigned, normally distributed deviations."""
    return 1.4826 * float(np.median(deviation))


def _largest_nearby(deviation: RealArray) -> RealArray:
    padded = np.pad(deviation, WINDOW // 2, constant_values=0)
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, WINDOW).max(axis=1))


def _deviation(times: RealArray, number: _IntArray) -> tuple[RealArray, RealArray]:
    """Studentised distance of each pulse from the cubic about it, and its interval."""
    begin = np.clip(np.arange(times.size) - WINDOW // 2, 0, times.size - WINDOW)
    neighbours = begin[:, np.newaxis] + np.arange(WINDOW)
    # few patterns of gaps occur: one small least-squares problem for each, not for each pulse
    near, pattern = np.unique(
        number[neighbours] - number[:, np.newaxis], axis=0, return_inverse=True
    )
    cubic = (near / np.abs(near).max(axis=1, keepdims=True))[:, :, np.newaxis] ** np.arange(4)
    # at the pulse itself the cubic has the value of its constant term
    own_row = np.linalg.pinv(cubic)[pattern, 0]
    fitted = np.sum(own_row * (times[neighbours] - times[:, np.newaxis]), axis=1)
    leverage = own_row[np.arange(times.size), np.arange(times.size) - begin]
    span = np.ptp(times[neighbours], axis=1) / np.ptp(number[neighbours], axis=1)
    return np.abs(fitted) / np.sqrt(1 - np.minimum(leverage, 0.999)), span


def _refuse_hopeless(train: PulseTrain) -> None:
    name, times = train.name, train.times
    step = np.diff(train.number)
    gap = int(np.argmax(step))
    if step[gap] > LONGEST_GAP + 1:
        raise InputError(
            f"{name}: about {step[gap] - 1} pulses are missing between {times[gap]:.3f} and "
            f"{times[gap + 1]:.3f} s, too many to count: cut the record there"
        )
    bad = train.dropped.size + train.missing.size
    if bad > MOST_REPAIRED * times.size:
        raise InputError(
            f"{name}: {train.dropped.size} pulses do not fit and {train.missing.size} are missing "
            f"beside {times.size} good ones: check the trigger level and the hysteresis"
        )
    interval = np.diff(times) / step
    change = np.maximum(interval[1:] / interval[:-1], interval[:-1] / interval[1:])
    # intervals of a few samples scatter by rounding alone
    scatter = OUTLIER * _spread(_deviation(times, train.number)[0])
    change[np.abs(np.diff(interval)) < scatter] = 1.0
    if change.max() > LARGEST_CHANGE:
        where = int(np.argmax(change)) + 1
        raise InputError(
            f"{name}: the speed changes by a factor of {change.max():.2g} from pulse to pulse at "
            f"{times[where]:.3f} s: the shaft stops or turns back, or the pulses are false; cut "
            "the record there"
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
