"""Sensors and impacts: where each one sits, how it is turned, and how well that is known."""

from __future__ import annotations

import math
from enum import Enum

import numpy as np

from deboom.arrays import RealArray, checked
from deboom.errors import InputError
from deboom.measurement.sensor_classes import CLASS_DEFAULTS
from deboom.physics.rigid_body import ROTATION_ORDERS

SENSOR_AXES = ("x", "y", "z")

UNIT_LENGTH_TOLERANCE = 1e-3
"""Largest deviation of the length of a direction from 1: what the rounding in a table does."""


class SensorKind(Enum):
    """What a sensor measures."""

    ACCELEROMETER = "accelerometer"
    FORCE_CELL = "force cell"


@checked(position="3", orientation="3 3")
class Sensor:
    """One triaxial sensor; its channels are ``<name> x``, ``<name> y`` and ``<name> z``.

    Those of the thesis have data sheets in tables 4 and 5.

    - `position` (3,): in the axes and from the origin of the position sheet, in a vehicle the
      powertrain's centre of gravity [m].
    - `orientation` (3, 3): right-handed rotation, its columns the sensor's axes; else InputError.
    - `rotation_order`: of `ROTATION_ORDERS`, by which the position sheet states it as angles.
    """

    name: str
    kind: SensorKind
    model: str
    mount: str
    piece: str
    position: RealArray
    orientation: RealArray
    rotation_order: str = ROTATION_ORDERS[0]

    def __post_init__(self) -> None:
        turned = self.orientation.T @ self.orientation
        if not np.allclose(turned, np.eye(3), atol=1e-6) or np.linalg.det(self.orientation) < 0:
            raise InputError(
                f"sensor {self.name}: its orientation is not a right-handed rotation; check the "
                "angles or the direction of each channel"
            )

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the three channels."""
        return tuple(f"{self.name} {axis}" for axis in SENSOR_AXES)


@checked(position="3", direction="3")
class Impact:
    """One point of excitation by hammer or shaker; its channel has the same name.

    - `position` (3,): in the axes and from the origin of the position sheet [m].
    - `direction` (3,): unit vector along which a positive force pushes [1]; another length raises
      InputError.
    """

    name: str
    position: RealArray
    direction: RealArray

    def __post_init__(self) -> None:
        length = float(np.linalg.norm(self.direction))
        if abs(length - 1.0) > UNIT_LENGTH_TOLERANCE:
            raise InputError(
                f"impact {self.name}: its direction has length {length:.4g}, state a unit vector"
            )
        direction = self.direction / length
        direction.setflags(write=False)
        object.__setattr__(self, "direction", direction)


@checked(">=0 <inf")
class Tolerances:
    """Standard deviations (1 σ) of everything that a bench states only approximately.

    What nobody states is the default of the sensor's class.

    - `sensor_angle`: orientation of an accelerometer against the position sheet, per axis [rad].
    - `sensor_cross_axis`: sensitivity of an accelerometer channel to each of the other two axes
      [1]. A limit ± c of a data sheet has the standard deviation c/√3 where any value within is as
      likely.
    - `acceleration_own`, `acceleration_norm`: order-tracking noise per amplitude of the channel
      itself and per norm of its triaxial sensor, complex amplitude [1].
    - `force_own`, `force_norm`: order-tracking noise of a cell channel, as for the acceleration
      [1].

    None is negative. Position to cross-axis and shaker are drawn once per bench and stay the same
    in all its runs; noise, torque and static force differ from line to line.
    """

    sensor_position: float = CLASS_DEFAULTS["sensor_position"].value
    sensor_angle: float = CLASS_DEFAULTS["sensor_angle"].value
    sensor_gain: float = CLASS_DEFAULTS["sensor_gain"].value
    sensor_cross_axis: float = CLASS_DEFAULTS["sensor_cross_axis"].value
    acceleration_own: float = CLASS_DEFAULTS["acceleration_own"].value
    acceleration_norm: float = CLASS_DEFAULTS["acceleration_norm"].value
    acceleration_floor: float = CLASS_DEFAULTS["acceleration_floor"].value
    cell_gain: float = CLASS_DEFAULTS["cell_gain"].value
    force_own: float = CLASS_DEFAULTS["force_own"].value
    force_norm: float = CLASS_DEFAULTS["force_norm"].value
    force_floor: float = CLASS_DEFAULTS["force_floor"].value
    shaker_angle: float = CLASS_DEFAULTS["shaker_angle"].value
    shaker_gain: float = CLASS_DEFAULTS["shaker_gain"].value
    torque: float = CLASS_DEFAULTS["torque"].value
    static_force: float = CLASS_DEFAULTS["static_force"].value


@checked(">0 <inf")
class PlacementTolerances:
    """Standard deviations (1 σ) of what a hammer test states only approximately; none is 0."""

    sensor_gain: float = 0.02
    sensor_position: float = 0.0015
    sensor_angle: float = math.radians(1.5)
    hammer_gain: float = 0.01
    impact_position: float = 0.0015
    impact_angle: float = math.radians(1.5)
