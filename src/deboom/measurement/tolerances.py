"""How well a test bench is aligned, calibrated and read: the input of every error budget."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from deboom.errors import InputError


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations (1 σ) of everything that a bench states only approximately.

    Parameters
    ----------
    sensor_position : float
        Of an accelerometer against the position sheet, per axis [m].
    sensor_angle : float
        Of an accelerometer against the position sheet, per axis [rad].
    sensor_gain : float
        Of an accelerometer channel [1].
    sensor_cross_axis : float
        Sensitivity of an accelerometer channel to each of the other two axes [1]. A limit ± c of a
        data sheet has the standard deviation c/√3 where any value within is as likely.
    acceleration_own, acceleration_norm : float
        Order-tracking noise per amplitude of the channel itself and per norm of its triaxial
        sensor, complex amplitude [1].
    acceleration_floor : float
        Noise of an accelerometer channel at rest, complex amplitude [m/s²].
    cell_gain : float
        Of a force cell that no shaker calibrates in place [1].
    force_own, force_norm : float
        Order-tracking noise of a cell channel, as for the acceleration [1].
    force_floor : float
        Noise of a cell channel at rest, complex amplitude [N].
    shaker_angle : float
        Of the shaker against its nominal axis, per axis [rad].
    shaker_gain : float
        Of the force that the shaker states [1].
    torque : float
        Of the engine torque, per line [N m].
    static_force : float
        Of the quasi-static cell force, per line [N].

    Raises
    ------
    InputError
        A tolerance that is negative or not finite.

    Notes
    -----
    Position to cross-axis and shaker are drawn once per bench and stay the same in all its runs;
    noise, torque and static force differ from line to line.
    """

    sensor_position: float = 0.002
    sensor_angle: float = math.radians(0.5)
    sensor_gain: float = 0.01
    sensor_cross_axis: float = 0.01
    acceleration_own: float = 0.002
    acceleration_norm: float = 0.00015
    acceleration_floor: float = 0.005
    cell_gain: float = 0.005
    force_own: float = 0.002
    force_norm: float = 0.00015
    force_floor: float = 0.01
    shaker_angle: float = math.radians(0.5)
    shaker_gain: float = 0.005
    torque: float = 1.0
    static_force: float = 5.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"tolerance {field.name} is {value}: use a number from 0")
