"""Lines measured while the torque rose: a mount in a falling run sits on another branch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError

SIGNIFICANT = 3.0
"""Standard errors by which a slope must be negative to count as falling."""


class RunDirection(Enum):
    """How the torque went over a run, as the test log states it."""

    RISING = "rising"
    FALLING = "falling"


def rising_runs(run: Sequence[str], direction: Mapping[str, RunDirection]) -> npt.NDArray[np.bool_]:
    """Lines of the runs with rising torque.

    Parameters
    ----------
    run : sequence of str, length n
        Name of the run that each line belongs to.
    direction : mapping of str to RunDirection
        Of every run that occurs.

    Returns
    -------
    array of bool, shape (n,)

    Raises
    ------
    InputError
        A run without direction, or no rising run at all.

    Notes
    -----
    To be preferred to `rising_lines`: at constant torque the slope says nothing, yet the mount
    still remembers from which side it came there.
    """
    unknown = sorted(set(run) - set(direction))
    if unknown:
        raise InputError(f"no direction stated for the runs {unknown}: add rising or falling")
    rising = np.array([direction[name] is RunDirection.RISING for name in run], dtype=bool)
    if not rising.any():
        raise InputError(
            f"the runs {sorted(set(run))} all have falling torque: measure a run with rising torque"
        )
    return rising


def torque_slope(
    time: npt.ArrayLike, torque: npt.ArrayLike, window: float
) -> tuple[RealArray, RealArray]:
    """Slope of the torque over a moving window, and how noise in the torque enters it.

    Parameters
    ----------
    time : array, shape (n,)
        Increasing; the steps may differ [s].
    torque : array, shape (n,)
        [N m].
    window : float
        Width of the window about each line [s]; cut at the ends of the record.

    Returns
    -------
    slope : array, shape (n,)
        Of the straight line of least squares through the window [N m/s].
    noise_gain : array, shape (n,)
        Standard deviation of the slope per standard deviation of independent torque noise [1/s].

    Raises
    ------
    InputError
        Shapes that differ, values that are not finite, time that does not increase, or a window
        with fewer than five lines.
    """
    t, torques = np.asarray(time, dtype=float), np.asarray(torque, dtype=float)
    if t.ndim != 1 or t.shape != torques.shape or t.size == 0:
        raise InputError(f"time of shape {t.shape} and torque of shape {torques.shape} differ")
    if not (np.all(np.isfinite(t)) and np.all(np.isfinite(torques))):
        raise InputError("time or torque of a run is not finite: remove those lines first")
    if np.any(np.diff(t) <= 0):
        raise InputError("the time of a run must increase from line to line")
    begin = np.searchsorted(t, t - window / 2, side="left")
    end = np.searchsorted(t, t + window / 2, side="right")
    count = end - begin
    if count.min() < 5:
        raise InputError(
            f"a window of {window:g} s holds only {count.min()} lines: five are needed for a slope"
        )

    def window_sum(values: RealArray) -> RealArray:
        before = np.concatenate([[0.0], np.cumsum(values)])
        return np.asarray(before[end] - before[begin])

    # about the record's middle, so that the running sums do not cancel
    t = t - t.mean()
    torques = torques - torques.mean()
    mean_time = window_sum(t) / count
    spread = window_sum(t**2) - count * mean_time**2
    slope = (window_sum(t * torques) - mean_time * window_sum(torques)) / spread
    return slope, 1 / np.sqrt(spread)


def rising_lines(
    time: npt.ArrayLike, torque: npt.ArrayLike, window: float, torque_noise: float
) -> npt.NDArray[np.bool_]:
    """Lines of one run at which the torque does not fall.

    Parameters
    ----------
    time : array, shape (n,)
        Increasing [s].
    torque : array, shape (n,)
        As read [N m].
    window : float
        Over which the slope is taken; some seconds of a run-up [s].
    torque_noise : float
        Standard deviation of one torque reading [N m].

    Returns
    -------
    array of bool, shape (n,)

    Raises
    ------
    InputError
        As `torque_slope`; a noise that is not positive; or a run in which the torque only falls.

    Notes
    -----
    A line is left out if its slope is negative by more than three standard errors of the slope, so
    a plateau at the torque limit stays. The sign of the difference between neighbouring readings
    discards almost every second line of a good run instead.
    """
    if not torque_noise > 0:
        raise InputError(f"the torque noise is above 0 N m, not {torque_noise}")
    slope, noise_gain = torque_slope(time, torque, window)
    rising = slope > -SIGNIFICANT * noise_gain * torque_noise
    if not rising.any():
        raise InputError("the torque of this run only falls: measure a run with rising torque")
    return np.asarray(rising)
