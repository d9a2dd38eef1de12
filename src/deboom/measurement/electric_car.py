"""An electric car as it was measured: its running compressor, and what its body makes of loads."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.impacts import Impact
from deboom.measurement.inertance_test import (
    ACCELERATION_PER_FORCE,
    SMALLEST_IMPACTS,
    SMALLEST_SENSORS,
    freeze_field,
)
from deboom.measurement.noise_transfer import PRESSURE_PER_FORCE
from deboom.measurement.operating_sweep import OperatingSweep, OperatingTest
from deboom.measurement.placement_tolerances import PlacementTolerances
from deboom.measurement.sensors import SENSOR_AXES, Sensor


class PointKind(Enum):
    """What meets the body at a point."""

    MOUNT = "mount"
    HOSE = "hose"


@dataclass(frozen=True, eq=False)
class TransferPoint:
    """One place where the compressor or a hose meets the body.

    Parameters
    ----------
    name : str
        Such as ``mount 1``; a mount is called like the holder of the sweeps.
    kind : PointKind
    position : array, shape (3,)
        Elastic centre of the mount, or end of the hose, from the compressor's virtual point [m].
    sensors : tuple of Sensor
        Triaxial accelerometers on the body around it, at least three.
    impacts : tuple of Impact
        Of the hammer on the body around it, more than six to be overdetermined.

    Raises
    ------
    InputError
        Too few sensors or impacts for six motions, or a position of another shape.
    """

    name: str
    kind: PointKind
    position: RealArray
    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]

    def __post_init__(self) -> None:
        freeze_field(self, "position", (3,), self.name)
        if len(self.sensors) < SMALLEST_SENSORS:
            raise InputError(
                f"{self.name}: {len(self.sensors)} triaxial accelerometers do not see all six "
                "motions of the body there: use three that are not on a line"
            )
        if len(self.impacts) < SMALLEST_IMPACTS:
            raise InputError(
                f"{self.name}: {len(self.impacts)} impacts do not give all six loads: strike at "
                "least six of different places and directions, nine to see errors"
            )

    @property
    def channels(self) -> tuple[str, ...]:
        """Of its accelerometers."""
        return tuple(channel for sensor in self.sensors for channel in sensor.channels)

    @property
    def impact_names(self) -> tuple[str, ...]:
        """Of its impacts."""
        return tuple(impact.name for impact in self.impacts)


@dataclass(frozen=True, eq=False)
class ElectricCar:
    """Everything measured on one electric car and its compressor.

    Parameters
    ----------
    name : str
        Such as ``EV-1``.
    operation : OperatingTest
        The compressor struck on its rig, and run in the car with holders and ear.
    points : tuple of TransferPoint
        All mounts, and the hose ends that were measured.
    ear : str
        Name of the microphone, such as ``driver ear``.
    pressure : Frf
        Output is the ear, inputs are the impacts of all points, in their order; struck with the
        compressor taken out [Pa/N].
    coherence : array, shape (f, 1, n_impact)
        Ordinary, of the hits of every impact [1].
    n_averages : int
        Hits per impact.
    accelerance : Frf
        Outputs are the channels of all points' sensors, inputs as above [(m/s^2)/N].
    tolerances : PlacementTolerances
        Of everything on the body.
    input_files : tuple of Path

    Raises
    ------
    InputError
        Doubled points; a mount of sweeps or drawing without noise transfer functions, or the other
        way round; a sweep without the ear; names, units or lines that do not fit together.
    """

    name: str
    operation: OperatingTest
    points: tuple[TransferPoint, ...]
    ear: str
    pressure: Frf
    coherence: RealArray
    n_averages: int
    accelerance: Frf
    tolerances: PlacementTolerances
    input_files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        names = [point.name for point in self.points]
        if len(set(names)) < len(names):
            raise InputError(f"car {self.name}: two points have one name: {names}")
        impacts = tuple(name for point in self.points for name in point.impact_names)
        channels = tuple(name for point in self.points for name in point.channels)
        for frf, unit, outputs in (
            (self.pressure, PRESSURE_PER_FORCE, (self.ear,)),
            (self.accelerance, ACCELERATION_PER_FORCE, channels),
        ):
            if frf.unit != unit:
                raise InputError(
                    f"car {self.name}: functions in '{frf.unit}' where {unit} is needed: convert "
                    "them"
                )
            if frf.inputs != impacts or frf.outputs != outputs:
                raise InputError(
                    f"car {self.name}: the functions in {unit} are not those of the points' "
                    "sensors, impacts and ear"
                )
        if not np.array_equal(self.pressure.frequency, self.accelerance.frequency):
            raise InputError(f"car {self.name}: pressure and acceleration have different lines")
        freeze_field(self, "coherence", self.pressure.values.shape, f"car {self.name}: coherence")
        if np.any((self.coherence < 0) | (self.coherence > 1 + 1e-9)):
            raise InputError(f"car {self.name}: a coherence lies between 0 and 1")
        if self.n_averages < 1:
            raise InputError(f"car {self.name}: {self.n_averages} hits per impact, at least one")
        for sweep in self.operation.sweeps:
            self._check_sweep(sweep)

    def _check_sweep(self, sweep: OperatingSweep) -> None:
        name = sweep.name
        if sweep.sound is None or self.ear not in sweep.sound.channels:
            raise InputError(
                f"car {self.name}: sweep {name} has no pressure at '{self.ear}', where the noise "
                "transfer functions end: record that microphone, or name the right ear"
            )
        if sweep.holder is None:
            raise InputError(
                f"car {self.name}: sweep {name} has no accelerations on the body side of the "
                "mounts: the force of a mount needs both of its sides"
            )
        held = list(dict.fromkeys(c.rpartition(" ")[0] for c in sweep.holder.channels))
        struck = [point.name for point in self.mounts]
        drawing = self.operation.hammer.drawing
        if drawing is not None and len(drawing.mounts) > len(held):
            held = [mount.name for mount in drawing.mounts]
        without = [mount for mount in held if mount not in struck]
        if without:
            raise InputError(
                f"car {self.name}: noise transfer functions for {', '.join(struck) or 'no mount'}, "
                f"but the compressor stands on {', '.join(held)}: measure {', '.join(without)} as "
                "well, for a sum over some of the mounts is no cabin noise"
            )
        for mount in struck:
            missing = [a for a in SENSOR_AXES if f"{mount} {a}" not in sweep.holder.channels]
            if missing:
                raise InputError(
                    f"car {self.name}: sweep {name} has no body-side acceleration of {mount} along "
                    f"{', '.join(missing)}: record it"
                )

    @property
    def mounts(self) -> tuple[TransferPoint, ...]:
        """Points under the compressor."""
        return tuple(point for point in self.points if point.kind is PointKind.MOUNT)

    @property
    def hoses(self) -> tuple[TransferPoint, ...]:
        """Ends of the hoses."""
        return tuple(point for point in self.points if point.kind is PointKind.HOSE)

    def point(self, name: str) -> TransferPoint:
        """Return a point by its name.

        Raises
        ------
        InputError
            No such point.
        """
        for point in self.points:
            if point.name == name:
                return point
        raise InputError(
            f"car {self.name}: no point '{name}', there are {[one.name for one in self.points]}"
        )
