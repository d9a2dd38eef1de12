"""An electric car as it was measured, and its noise transfer functions of forces and moments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import (
    ACCELERATION_PER_FORCE,
    SMALLEST_IMPACTS,
    SMALLEST_SENSORS,
    OperatingSweep,
    OperatingTest,
    freeze_field,
)
from deboom.measurement.noise_transfer import (
    POINT_LOADS,
    PRESSURE_PER_FORCE,
    noise_transfer_at_points,
)
from deboom.measurement.quality import RigidConsistency, excitation_consistency
from deboom.measurement.sensors import SENSOR_AXES, Impact, PlacementTolerances, Sensor
from deboom.measurement.virtual_point import (
    RIGID_MOTIONS,
    ChannelGeometry,
    impact_geometry,
    sensor_geometry,
    virtual_point,
)


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


SAME_LINE = 1e-6
"""Largest relative distance of a line that was asked for from a measured one [1]."""


@dataclass(frozen=True, eq=False)
class WrenchNoiseTransfer:
    """Pressure at the ear per force and moment at every point.

    Parameters
    ----------
    transfer : Frf
        Output is the ear, inputs ``<point> x y z`` [Pa/N] and ``mx my mz`` [Pa/(N m)].
    deviation : array, shape (f, n_input)
        Root of the mean square modulus of the error, in the unit of each column.
    consistency : mapping of str to RigidConsistency
        Point to that of its impacts, by the accelerations around it: how well one rigid patch
        explains them.
    """

    transfer: Frf
    deviation: RealArray
    consistency: Mapping[str, RigidConsistency]

    def __post_init__(self) -> None:
        lines, _, inputs = self.transfer.values.shape
        freeze_field(self, "deviation", (lines, inputs), "wrench noise transfer")
        object.__setattr__(self, "consistency", MappingProxyType(dict(self.consistency)))

    def at(self, frequency: npt.ArrayLike) -> WrenchNoiseTransfer:
        """Return these lines only; the consistency is that of all.

        Raises
        ------
        InputError
            A line that was not measured: nothing is interpolated.
        """
        rows = measured_lines(self.transfer.frequency, np.asarray(frequency, dtype=float))
        chosen = Frf(
            np.asarray(frequency, dtype=float),
            self.transfer.values[rows],
            self.transfer.outputs,
            self.transfer.inputs,
            self.transfer.unit,
        )
        return WrenchNoiseTransfer(chosen, self.deviation[rows], self.consistency)


def wrench_noise_transfer(
    car: ElectricCar, points: Sequence[str] | None = None
) -> WrenchNoiseTransfer:
    """Refer the hammer's noise transfer functions to six loads at every point.

    Parameters
    ----------
    car : ElectricCar
    points : sequence of str, optional
        All of the car if left out.

    Returns
    -------
    WrenchNoiseTransfer

    Raises
    ------
    InputError
        No point at all, or no such one; impacts that do not determine all six loads.

    Notes
    -----
    ``Y_VP = Y (U⁺)ᵀ`` by least squares (van der Seijs et al., 2017). Errors to first order: the
    noise of a function has the mean square modulus ``|H|² (1 − γ²)/(n γ²)``; an impact that
    lies δr off pushes with the moment ``δr × d`` besides, one that leans by δd with ``δd`` and
    ``r × δd``; each of these is multiplied with the found functions of the point and goes through
    ``U⁺``. The gain of the hammer, and the place of the point itself, are common to its impacts.
    """
    chosen = _chosen(car, points)
    geometries = {point.name: impact_geometry(point.impacts, point.position) for point in chosen}
    transfer = noise_transfer_at_points(car.pressure, geometries)
    deviations, consistency = [], {}
    for number, point in enumerate(chosen):
        found = transfer.values[:, 0, len(POINT_LOADS) * number : len(POINT_LOADS) * (number + 1)]
        deviations.append(_deviation(car, point, geometries[point.name], found))
        consistency[point.name] = excitation_consistency(
            virtual_point(geometries[point.name]), car.accelerance.select(outputs=point.channels)
        )
    return WrenchNoiseTransfer(transfer, np.hstack(deviations), consistency)


def wrench_accelerance(car: ElectricCar, points: Sequence[str] | None = None) -> Frf:
    """Refer the accelerances of the free body to six motions and six loads at every point.

    Parameters
    ----------
    car : ElectricCar
    points : sequence of str, optional
        All of the car if left out.

    Returns
    -------
    Frf
        Outputs ``<point> x`` … ``rz``, inputs ``<point> x y z mx my mz`` [(m/s^2)/N], per metre for
        each rotation or moment.

    Raises
    ------
    InputError
        No point, or no such one; sensors or impacts that do not determine it.

    Notes
    -----
    ``Y_VP = V⁺ Y (U⁺)ᵀ``, block by block.
    """
    chosen = _chosen(car, points)
    seen = [virtual_point(sensor_geometry(point.sensors, point.position)) for point in chosen]
    struck = [virtual_point(impact_geometry(point.impacts, point.position)) for point in chosen]
    blocks = [
        [
            response.inverse
            @ car.accelerance.select(response.channels, load.channels).values
            @ load.inverse.T
            for load in struck
        ]
        for response in seen
    ]
    return Frf(
        car.accelerance.frequency,
        np.block(blocks),
        tuple(f"{point.name} {motion}" for point in chosen for motion in RIGID_MOTIONS),
        tuple(f"{point.name} {load}" for point in chosen for load in POINT_LOADS),
        car.accelerance.unit,
    )


def _chosen(car: ElectricCar, points: Sequence[str] | None) -> tuple[TransferPoint, ...]:
    if points is None:
        return car.points
    if not points:
        raise InputError(f"car {car.name}: no point to refer functions to: name at least one")
    return tuple(car.point(name) for name in points)


def _deviation(
    car: ElectricCar, point: TransferPoint, geometry: ChannelGeometry, found: ComplexArray
) -> RealArray:
    """Root mean square modulus of the error of six functions, shape (f, 6)."""
    columns = [car.pressure.inputs.index(name) for name in point.impact_names]
    measured = np.abs(car.pressure.values[:, 0, columns]) ** 2
    coherence = np.maximum(car.coherence[:, 0, columns], np.finfo(float).tiny)
    variance = measured * (1 - coherence) / (car.n_averages * coherence)
    force, moment = found[:, :3], found[:, 3:]
    tolerances = car.tolerances
    # what a force at the lever r gives: N_f + N_m × r, a vector over the direction of the force
    per_force = force[:, None] + np.cross(moment[:, None], geometry.levers)
    for across in _across(geometry.directions):
        leaning = np.einsum("fia,ia->fi", per_force, across)
        off = moment @ np.cross(across, geometry.directions).T
        variance = variance + np.abs(tolerances.impact_angle * leaning) ** 2
        variance = variance + np.abs(tolerances.impact_position * off) ** 2
    inverse = virtual_point(geometry).inverse
    common = np.abs(tolerances.hammer_gain * found) ** 2
    # a load that truly acts beside the stated point turns about it as well
    turning = np.abs(moment) ** 2
    common[:, :3] += tolerances.sensor_position**2 * (turning.sum(axis=1)[:, None] - turning)
    return np.asarray(np.sqrt(variance @ (inverse.T**2) + common))


def _across(directions: RealArray) -> tuple[RealArray, RealArray]:
    """Two unit vectors across each direction, shape (n, 3) each."""
    least = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    first = np.cross(directions, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(directions, first)


def measured_lines(measured: RealArray, wanted: RealArray) -> npt.NDArray[np.intp]:
    """Return the places of some lines among the measured ones.

    Parameters
    ----------
    measured : array, shape (n_frequency,)
        Lines of noise transfer functions [Hz].
    wanted : array, shape (n,)
        [Hz].

    Returns
    -------
    int array, shape (n,)

    Raises
    ------
    InputError
        A line that was not measured: nothing is interpolated.
    """
    nearest = np.argmin(np.abs(measured[:, None] - wanted), axis=0)
    far = np.abs(measured[nearest] - wanted) > SAME_LINE * wanted
    if far.any():
        raise InputError(
            f"the noise transfer functions have no line at {wanted[far][0]:g} Hz, they go from "
            f"{measured[0]:g} to {measured[-1]:g} Hz: measure it, nothing is interpolated"
        )
    return np.asarray(nearest, dtype=np.intp)
