"""What a hammer test states only approximately: gains, places and directions."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from deboom.errors import InputError


@dataclass(frozen=True)
class PlacementTolerances:
    """Standard deviations (1 σ) of what a hammer test states only approximately.

    Parameters
    ----------
    sensor_gain : float
        Of each accelerometer channel [1].
    sensor_position, impact_position : float
        Against the position sheet, per axis [m].
    sensor_angle, impact_angle : float
        Against the position sheet, per axis [rad].
    hammer_gain : float
        Of the hammer, common to all impacts [1].

    Raises
    ------
    InputError
        A tolerance that is not positive and finite: a perfect placement is no statement about a
        real one.
    """

    sensor_gain: float = 0.02
    sensor_position: float = 0.0015
    sensor_angle: float = math.radians(1.5)
    hammer_gain: float = 0.01
    impact_position: float = 0.0015
    impact_angle: float = math.radians(1.5)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"tolerance {field.name} is {value}: use a number above 0")
