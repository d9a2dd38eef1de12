"""Sensors and impacts: where each one sits, how it is turned, and how well that is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import Enum
from types import MappingProxyType

import numpy as np

from deboom.arrays import RealArray, checked
from deboom.errors import InputError

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

    - `name`.
    - `kind`.
    - `model`.
    - `mount`, `piece`.
    - `position` (3,): position in vehicle axes, from the powertrain's centre of gravity [m].
    - `orientation` (3, 3): right-handed rotation; columns are the sensor's axes in vehicle axes
      [1].
    """

    name: str
    kind: SensorKind
    model: str
    mount: str
    piece: str
    position: RealArray
    orientation: RealArray

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

    - `name`.
    - `position` (3,): position in vehicle axes, from the origin of the position sheet [m].
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


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations (1 σ) of everything that a bench states only approximately.

    - `sensor_position`.
    - `sensor_angle`: orientation of an accelerometer against the position sheet, per axis [rad].
    - `sensor_gain`.
    - `sensor_cross_axis`: sensitivity of an accelerometer channel to each of the other two axes
      [1]. A limit ± c of a data sheet has the standard deviation c/√3 where any value within is as
      likely.
    - `acceleration_own`, `acceleration_norm`: order-tracking noise per amplitude of the channel
      itself and per norm of its triaxial sensor, complex amplitude [1].
    - `acceleration_floor`.
    - `cell_gain`.
    - `force_own`, `force_norm`: order-tracking noise of a cell channel, as for the acceleration
      [1].
    - `force_floor`.
    - `shaker_angle`.
    - `shaker_gain`.
    - `torque`.
    - `static_force`.

    None is negative. Position to cross-axis and shaker are drawn once per bench and stay the same
    in all its runs; noise, torque and static force differ from line to line.
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
            _check_deviation(f"tolerance {field.name}", getattr(self, field.name), "from 0")


@dataclass(frozen=True)
class PlacementTolerances:
    """Standard deviations (1 σ) of what a hammer test states only approximately; none is 0.

    - `sensor_gain`.
    - `sensor_position`, `impact_position`.
    - `sensor_angle`, `impact_angle`.
    - `hammer_gain`.
    """

    sensor_gain: float = 0.02
    sensor_position: float = 0.0015
    sensor_angle: float = math.radians(1.5)
    hammer_gain: float = 0.01
    impact_position: float = 0.0015
    impact_angle: float = math.radians(1.5)

    def __post_init__(self) -> None:
        for field in fields(self):
            # a perfect placement is no statement about a real one
            _check_deviation(f"tolerance {field.name}", getattr(self, field.name), "above 0")


def _check_deviation(what: str, value: float, wanted: str) -> None:
    if not (math.isfinite(value) and value >= 0) or (value == 0 and wanted == "above 0"):
        raise InputError(f"{what} is {value}: use a number {wanted}")


@dataclass(frozen=True)
class SensorModel:
    """What the maker states of every sensor of one model.

    - `name`.
    - `quantity_unit`.
    - `signal_unit`.
    - `sensitivity`: nominal sensitivity, per axis; one for a single-axis sensor
      [signal_unit/quantity_unit].
    - `gain_tolerance`: half width about the nominal sensitivity, before the single sensor is
      calibrated [1].
    - `cross_axis`.
    - `noise_floor`.
    - `frequency_range` (float, float) — usable range [Hz]; ``(0, inf)`` where the maker states
      none.
    - `source`.
    """

    name: str
    quantity_unit: str
    signal_unit: str
    sensitivity: tuple[float, ...]
    gain_tolerance: float
    cross_axis: tuple[float, ...]
    noise_floor: float
    frequency_range: tuple[float, float]
    source: str

    def __post_init__(self) -> None:
        owner = f"sensor model {self.name}"
        if len(self.sensitivity) != len(self.cross_axis):
            raise InputError(
                f"{owner}: {len(self.sensitivity)} sensitivities, but {len(self.cross_axis)} "
                "cross-axis limits: state both for every axis"
            )
        _check_deviation(f"{owner}: gain_tolerance", self.gain_tolerance, "from 0")
        _check_deviation(f"{owner}: noise_floor", self.noise_floor, "from 0")
        for limit in self.cross_axis:
            _check_deviation(f"{owner}: cross_axis", limit, "from 0")

    @property
    def cross_axis_deviation(self) -> tuple[float, ...]:
        """Standard deviation of the cross-axis sensitivity, any value within ± the limit alike."""
        return tuple(limit / math.sqrt(3) for limit in self.cross_axis)


_G = 9.80665
_PICO = 1e-12

SENSOR_CATALOGUE: Mapping[str, SensorModel] = MappingProxyType(
    {
        model.name: model
        for model in (
            SensorModel(
                name="B&K 4321",
                quantity_unit="m/s^2",
                signal_unit="C",
                sensitivity=(9.81 * _PICO / _G,) * 3,
                gain_tolerance=0.02,
                cross_axis=(0.010, 0.012, 0.004),
                noise_floor=0.005,
                frequency_range=(0.1, 12000.0),
                source="Thesis, table 4; noise floor: bench",
            ),
            SensorModel(
                name="B&K 4326",
                quantity_unit="m/s^2",
                signal_unit="C",
                sensitivity=(3.0 * _PICO / _G,) * 3,
                gain_tolerance=0.15,
                cross_axis=(0.05, 0.05, 0.05),
                noise_floor=0.005,
                frequency_range=(0.1, 12000.0),
                source="Thesis, table 4; noise floor: bench",
            ),
            SensorModel(
                # a piezoelectric cell delivers charge: the table's mV/N belongs to its amplifier
                name="Kistler 9077C",
                quantity_unit="N",
                signal_unit="C",
                sensitivity=(-4.2 * _PICO, -4.2 * _PICO, -2.0 * _PICO),
                gain_tolerance=0.02,
                cross_axis=(0.03, 0.03, 0.03),
                noise_floor=0.01,
                frequency_range=(0.0, math.inf),
                source="Thesis, table 5; gain and cross-talk: usual for three-axis piezo cells",
            ),
            SensorModel(
                name="PCB 356A",
                quantity_unit="m/s^2",
                signal_unit="V",
                sensitivity=(10.2e-3,) * 3,
                gain_tolerance=0.10,
                cross_axis=(0.05, 0.05, 0.05),
                noise_floor=0.002,
                frequency_range=(2.0, 5000.0),
                source="Thesis, section 4.4; gain, cross-axis and floor: usual for the series",
            ),
            SensorModel(
                name="PCB 086D05",
                quantity_unit="N",
                signal_unit="V",
                sensitivity=(0.23e-3,),
                gain_tolerance=0.15,
                cross_axis=(0.0,),
                noise_floor=0.1,
                frequency_range=(0.0, math.inf),
                source="Thesis, section 4.4; gain and floor: usual for the series",
            ),
        )
    }
)
"""Sensors of the thesis, by the name of their model.

Figures that the thesis does not state are marked as usual ones in `SensorModel.source`: replace
them by the calibration sheets of the sensors in use.
"""
