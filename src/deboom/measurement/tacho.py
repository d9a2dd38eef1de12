"""From a tacho's voltage to the times of its pulses."""

from __future__ import annotations

from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError

LEAST_PULSES = 10
"""Fewer say too little about a speed that changes."""
HYSTERESIS = 0.2
"""Of the swing, where none is given: what the voltage must fall back by to count anew."""
_TAIL = 0.001
"""Share of the samples beyond which low and high voltage are read, so that a spike sets neither."""


class Edge(Enum):
    """Which edge of a pulse marks the angle."""

    RISING = 1
    FALLING = -1


def pulse_times(
    voltage: npt.ArrayLike,
    rate: float,
    *,
    name: str = "tacho",
    start: float = 0.0,
    edge: Edge = Edge.RISING,
    level: float | None = None,
    hysteresis: float | None = None,
) -> RealArray:
    """Return the times at which a tacho signal crosses its trigger level.

    Parameters
    ----------
    voltage : array, shape (n_sample,)
        As recorded [V].
    rate : float
        Samples per second [Hz].
    name : str
        Of the channel, for messages.
    start : float
        Time of the first sample [s].
    edge : Edge
        The edge that marks the angle; the rising one unless the pulse is upside down.
    level : float, optional
        Trigger level [V]; half-way between low and high voltage where it is not given.
    hysteresis : float, optional
        Once triggered, the voltage must leave the level backwards by this much before it counts
        again [V]; a fifth of the swing where it is not given.

    Returns
    -------
    array, shape (n_pulse,)
        Increasing [s], by a straight line between the two samples about each crossing.

    Raises
    ------
    InputError
        A signal that is constant, not finite, or has fewer than ten pulses.

    Notes
    -----
    Low and high voltage are the quantiles at 0.1 % and 99.9 % of the samples. The straight line
    gives the time to a small part of a sample where the edge is as slow as the recorder's
    anti-aliasing filter makes it; a perfect step is known to ± half a sample only.
    """
    signal = np.asarray(voltage, dtype=float)
    if signal.ndim != 1 or signal.size == 0:
        raise InputError(f"{name} is one channel of voltage, not an array of shape {signal.shape}")
    if not np.all(np.isfinite(signal)):
        raise InputError(
            f"{name}: the signal is not finite at sample {np.argmin(np.isfinite(signal))}"
        )
    low, high = np.quantile(signal, [_TAIL, 1 - _TAIL])
    if not high > low:
        raise InputError(
            f"{name} carries no pulses, it stays at {low:g} V: check the cable, or the name of the "
            "tacho channel"
        )
    trigger = (low + high) / 2 if level is None else level
    band = HYSTERESIS * (high - low) if hysteresis is None else hysteresis
    above = edge.value * (signal - trigger)
    first = _crossings(above, band)
    if first.size < LEAST_PULSES:
        raise InputError(
            f"{name} has {first.size} pulses at {trigger:.3g} V, {LEAST_PULSES} are needed: check "
            "the trigger level, or measure for longer"
        )
    part = above[first] / (above[first] - above[first + 1])
    return np.asarray(start + (first + part) / rate)


def _crossings(above: RealArray, band: float) -> npt.NDArray[np.intp]:
    """Last sample before each rise through zero that follows a fall below −band."""
    low, high = above < -abs(band), above >= 0
    # a comparator with hysteresis forgets what lies between; low then high is a pulse
    event = np.flatnonzero(low | high)
    return event[1:][low[event[:-1]] & high[event[1:]]] - 1
