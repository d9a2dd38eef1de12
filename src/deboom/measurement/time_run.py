"""A run recorded over time, with the tacho that makes orders of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError


@dataclass(frozen=True, eq=False)
class TimeRun:
    """Raw channels of one run over time.

    Parameters
    ----------
    name, mount_set : str
        Of the run, and the parts on the bench.
    gear : int
        From 1.
    total_ratio : float
        Engine speed over wheel speed [1].
    full_load : bool
        True for a ramp with wide open throttle; False for a slice at constant engine torque.
    torque_limit : float
        Limit of a full-load ramp, torque of a slice [N m].
    rising : bool
        Whether the engine speed rose.
    order : float
        Dominant engine order [1].
    sample_rate : float
        [Hz].
    tacho : array, shape (n_sample,)
        Pulse train [1]; revolutions count from its first rising edge.
    pulses_per_revolution : int
        Of the tacho.
    engine_torque : array, shape (n_sample,)
        [N m].
    acceleration : array, shape (n_sample, n_channel)
        In sensor axes [m/s²].
    acceleration_channels : tuple of str
        ``<sensor> <axis>``.
    cell_force : array, shape (n_sample, n_channel)
        In sensor axes [N].
    cell_force_channels : tuple of str
        ``<sensor> <axis>``.
    static_force : array, shape (n_sample, n)
        Quasi-static force of each mount direction, all cells of a mount together [N].
    static_force_names : tuple of str
        ``<mount> [<piece>] <axis>``.

    Raises
    ------
    InputError
        Shapes that disagree, or a value that is not finite.
    """

    name: str
    mount_set: str
    gear: int
    total_ratio: float
    full_load: bool
    torque_limit: float
    rising: bool
    order: float
    sample_rate: float
    tacho: RealArray
    pulses_per_revolution: int
    engine_torque: RealArray
    acceleration: RealArray
    acceleration_channels: tuple[str, ...]
    cell_force: RealArray
    cell_force_channels: tuple[str, ...]
    static_force: RealArray
    static_force_names: tuple[str, ...]

    def __post_init__(self) -> None:
        for field, width in (
            ("tacho", None),
            ("engine_torque", None),
            ("acceleration", len(self.acceleration_channels)),
            ("cell_force", len(self.cell_force_channels)),
            ("static_force", len(self.static_force_names)),
        ):
            array = np.array(getattr(self, field), dtype=float)
            expected = (len(self.tacho),) if width is None else (len(self.tacho), width)
            if array.shape != expected:
                raise InputError(
                    f"time run {self.name}: {field} has shape {array.shape}, expected {expected}"
                )
            if not np.all(np.isfinite(array)):
                raise InputError(f"time run {self.name}: {field} holds a value that is not finite")
            array.setflags(write=False)
            object.__setattr__(self, field, array)
