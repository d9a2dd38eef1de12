"""Channels as they were sampled, with names and a unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError


@dataclass(frozen=True, eq=False)
class TimeRecord:
    """Channels of one unit, sampled together.

    Parameters
    ----------
    values : array, shape (n_sample, n_channel)
        [unit].
    rate : float
        Samples per second [Hz].
    channels : sequence of str
        Name of each column.
    unit : str
        SI unit of all columns.
    start : float
        Time of the first sample on the clock of the tacho [s].

    Raises
    ------
    InputError
        Shapes that disagree, duplicated names, a rate that is not positive, or a value that is not
        finite.
    """

    values: RealArray
    rate: float
    channels: tuple[str, ...]
    unit: str
    start: float = 0.0

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=float)
        channels = tuple(self.channels)
        if values.ndim != 2 or values.shape[1] != len(channels) or values.size == 0:
            raise InputError(
                f"a time record of {len(channels)} channels has shape (n_sample, "
                f"{len(channels)}), not {values.shape}"
            )
        doubled = sorted({name for name in channels if channels.count(name) > 1})
        if doubled:
            raise InputError(f"duplicated channel {doubled}: every channel needs a name of its own")
        if not self.rate > 0:
            raise InputError(f"a sampling rate of {self.rate} Hz is not positive")
        bad = ~np.isfinite(values)
        if bad.any():
            sample, channel = (int(i) for i in np.argwhere(bad)[0])
            raise InputError(f"channel {channels[channel]} is not finite at sample {sample}")
        values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "channels", channels)
