"""An electric car as it was measured, and its noise transfer functions of forces and moments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import Enum
from pathlib import Path

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import (
    Frf,
    SideUnits,
    load_units,
    motion_units,
    refuse_doubled,
    unit_sides,
)
from deboom.measurement.compressor_test import (
    OperatingSweep,
    OperatingTest,
    check_coherence,
    check_enough,
)
from deboom.measurement.driving_points import refuse_other_functions
from deboom.measurement.noise_transfer import POINT_LOADS, noise_transfer_at_points
from deboom.measurement.sensors import SENSOR_AXES, Impact, PlacementTolerances, Sensor
from deboom.measurement.virtual_point import (
    RIGID_MOTIONS,
    VirtualPoint,
    impact_geometry,
    sensor_geometry,
    virtual_point,
)

SAME_LINE = 1e-6
"""Largest relative distance of a line that was asked for from a measured one [1]."""


class PointKind(Enum):
    """What meets the body at a point."""

    MOUNT = "mount"
    HOSE = "hose"


@checked(position="3")
class TransferPoint:
    """One place where the compressor or a hose meets the body.

    - `position` (3,): elastic centre of the mount, or end of the hose, from the compressor's
      virtual point [m].
    - `impacts`: impacts of the hammer on the body around it, at least six, more to be
      overdetermined.
    """

    name: str
    kind: PointKind
    position: RealArray
    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of its accelerometers."""
        return tuple(channel for sensor in self.sensors for channel in sensor.channels)

    @property
    def impact_names(self) -> tuple[str, ...]:
        """Names of its impacts."""
        return tuple(impact.name for impact in self.impacts)

    def struck(self) -> VirtualPoint:
        """Return the virtual point of its impacts."""
        return virtual_point(impact_geometry(self.impacts, self.position))


@checked(coherence="f e i")
class ElectricCar:
    """Everything measured on one electric car and its compressor.

    Raises InputError: doubled points; too few sensors or impacts at one; a mount without noise
    transfer functions, or without motion in a sweep; a sweep without the ear; lines that differ.

    - `pressure`: output is the ear, inputs are the impacts of all points, in their order; struck
      with the compressor taken out [Pa/N].
    - `coherence` (n_frequency, 1, n_impact): ordinary coherence of `pressure`, 0 … 1 [1].
    - `assumed`: sentences on what nobody stated and defaults stand in for.
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
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        refuse_doubled([point.name for point in self.points], f"point of car {self.name}")
        for point in self.points:
            check_enough(point.sensors, point.impacts, point.name)
        if not np.array_equal(self.pressure.frequency, self.accelerance.frequency):
            raise self._error("pressure and acceleration have different lines")
        check_coherence(self.coherence, self.pressure, f"car {self.name}")
        for sweep in self.operation.sweeps:
            self._check_sweep(sweep)

    def _check_sweep(self, sweep: OperatingSweep) -> None:
        name = sweep.name
        if sweep.sound is None or self.ear not in sweep.sound.channels:
            raise self._error(
                f"sweep {name} has no pressure at '{self.ear}', where the noise transfer "
                "functions end: record that microphone, or name the right ear"
            )
        if sweep.holder is None:
            raise self._error(
                f"sweep {name} has no accelerations on the body side of the mounts: the force of "
                "a mount needs both of its sides"
            )
        held = list(dict.fromkeys(c.rpartition(" ")[0] for c in sweep.holder.channels))
        struck = [point.name for point in self.mounts]
        drawing = self.operation.hammer.drawing
        if drawing is not None and len(drawing.mounts) > len(held):
            held = [mount.name for mount in drawing.mounts]
        without = [mount for mount in held if mount not in struck]
        if without:
            raise self._error(
                f"noise transfer functions for {', '.join(struck) or 'no mount'}, but the "
                f"compressor stands on {', '.join(held)}: measure {', '.join(without)} as "
                "well, for a sum over some of the mounts is no cabin noise"
            )
        for mount in struck:
            missing = [a for a in SENSOR_AXES if f"{mount} {a}" not in sweep.holder.channels]
            if missing:
                raise self._error(
                    f"sweep {name} has no body-side acceleration of {mount} along "
                    f"{', '.join(missing)}: record it"
                )

    def _error(self, sentence: str) -> InputError:
        return InputError(f"car {self.name}: {sentence}")

    @property
    def mounts(self) -> tuple[TransferPoint, ...]:
        """Points under the compressor."""
        return tuple(point for point in self.points if point.kind is PointKind.MOUNT)

    @property
    def hoses(self) -> tuple[TransferPoint, ...]:
        """Ends of the hoses."""
        return tuple(point for point in self.points if point.kind is PointKind.HOSE)

    def chosen(self, names: Sequence[str] | None) -> tuple[TransferPoint, ...]:
        """Return points by their names, all of them for None; an unknown one raises InputError."""
        if names is None:
            return self.points
        point_by_name = {point.name: point for point in self.points}
        if not names:
            raise self._error("no point to refer functions to: name at least one")
        missing = [name for name in names if name not in point_by_name]
        if missing:
            raise self._error(f"no point '{', '.join(missing)}', there are {list(point_by_name)}")
        return tuple(point_by_name[name] for name in names)


def refuse_contradictions_of_car(car: ElectricCar) -> None:
    """Refuse accelerances of the body whose sign, form or quantity is not the stated one."""
    bodies = [
        (
            sensor_geometry(point.sensors, point.position),
            impact_geometry(point.impacts, point.position),
        )
        for point in car.points
    ]
    refuse_other_functions(car.accelerance, bodies, f"accelerance of car {car.name}")


@checked(noise="f i", by_error="e f i")
class WrenchNoiseTransfer:
    """Pressure at the ear per force and moment at every point.

    - `noise` (n_frequency, n_input): root of the mean square modulus of the noise, independent from
      line to line, in the unit of each column.
    - `by_error` (n_error, n_frequency, n_input): change by each of independent errors of unit
      standard deviation, the same at every line: hammer, places and angles of points and impacts.
    """

    transfer: Frf
    noise: RealArray
    by_error: ComplexArray

    @property
    def deviation(self) -> RealArray:
        """Root of the mean square modulus of all errors, shape (n_frequency, n_input)."""
        return np.asarray(np.sqrt(self.noise**2 + np.sum(np.abs(self.by_error) ** 2, axis=0)))

    def drawn(self, generator: np.random.Generator) -> ComplexArray:
        """Draw the functions that the measurement allows, shape (n_frequency, n_input)."""
        values = self.transfer.values[:, 0]
        noise = generator.standard_normal((2, *values.shape)) / np.sqrt(2)
        errors = generator.standard_normal(len(self.by_error))
        by_error = np.tensordot(errors, self.by_error, axes=1)
        return np.asarray(values + self.noise * (noise[0] + 1j * noise[1]) + by_error)

    def at(self, frequency: npt.ArrayLike) -> WrenchNoiseTransfer:
        """Return these measured lines only [Hz]; another one raises InputError."""
        wanted, whole = np.asarray(frequency, dtype=float), self.transfer
        rows = measured_lines(whole.frequency, wanted)
        chosen = replace(whole, frequency=wanted, values=whole.values[rows])
        return WrenchNoiseTransfer(chosen, self.noise[rows], self.by_error[:, rows])


def wrench_noise_transfer(
    car: ElectricCar, points: Sequence[str] | None = None
) -> WrenchNoiseTransfer:
    """Refer the hammer's noise transfer functions to six loads at points, by default all.

    Thesis, section 4.5.2 and figure 64.

    Raises InputError: no point at all, or no such one; impacts that do not determine all six loads.

    ``Y_VP = Y (U⁺)ᵀ`` by least squares (van der Seijs et al., 2017). Errors to first order: the
    noise of a function has the mean square modulus ``|H|² (1 − γ²)/(n γ²)``; an impact that lies δr
    off pushes with the moment ``δr × d`` besides, one that leans by δd with ``δd`` and ``r × δd``;
    each of these is multiplied with the functions of the point and goes through ``U⁺``. The place
    of a point is common to its impacts, the gain of the hammer to all points; none of them changes
    from line to line, so that nothing averages out over lines or paths.
    """
    chosen = car.chosen(points)
    geometries = {point.name: impact_geometry(point.impacts, point.position) for point in chosen}
    transfer = noise_transfer_at_points(car.pressure, geometries)
    per_point = np.split(transfer.values[:, 0], len(chosen), axis=1)
    errors = [_errors(car, point, values) for point, values in zip(chosen, per_point, strict=True)]
    of_points = sum(len(part) for _, part in errors)
    by_error = np.zeros((1 + of_points, *transfer.values[:, 0].shape), dtype=complex)
    by_error[0] = car.tolerances.hammer_gain * transfer.values[:, 0]
    first = 1
    for number, (_, part) in enumerate(errors):
        by_error[first : first + len(part), :, 6 * number : 6 * number + 6] = part
        first += len(part)
    return WrenchNoiseTransfer(transfer, np.hstack([noise for noise, _ in errors]), by_error)


def wrench_accelerance(car: ElectricCar, points: Sequence[str] | None = None) -> Frf:
    """Refer the accelerances of the body, compressor taken out, to six motions and loads at points.

    ``Y_VP = V⁺ Y (U⁺)ᵀ``, block by block, at all points of the car by default: outputs
    ``<point> x`` … ``rz`` [m/s², rad/s²], inputs ``<point> x y z mx my mz`` [N, N m]. Errors as of
    `wrench_noise_transfer`.
    """
    chosen = car.chosen(points)
    seen = [virtual_point(sensor_geometry(point.sensors, point.position)) for point in chosen]
    struck = [point.struck() for point in chosen]
    blocks = [
        [
            response.inverse
            @ car.accelerance.select(response.channels, load.channels).values
            @ load.inverse.T
            for load in struck
        ]
        for response in seen
    ]
    motions = tuple(f"{point.name} {motion}" for point in chosen for motion in RIGID_MOTIONS)
    loads = tuple(f"{point.name} {load}" for point in chosen for load in POINT_LOADS)
    above, below = unit_sides(car.accelerance.unit)
    unit = SideUnits(motion_units(motions, above), load_units(loads, below))
    return replace(
        car.accelerance, values=np.block(blocks), outputs=motions, inputs=loads, unit=unit
    )


def _errors(
    car: ElectricCar, point: TransferPoint, functions: ComplexArray
) -> tuple[RealArray, ComplexArray]:
    """Errors of the six functions (n_frequency, 6) of a point.

    Returns the root mean square modulus of the noise (n_frequency, 6), and the change by each error
    of places and angles in its standard deviation (n_error, n_frequency, 6).
    """
    columns = [car.pressure.inputs.index(name) for name in point.impact_names]
    measured = np.abs(car.pressure.values[:, 0, columns]) ** 2
    coherence = np.maximum(car.coherence[:, 0, columns], np.finfo(float).tiny)
    variance = measured * (1 - coherence) / (car.n_averages * coherence)
    force, moment = functions[:, :3], functions[:, 3:]
    struck, tolerances = point.struck(), car.tolerances
    directions, inverse = struck.geometry.directions, struck.inverse.T
    # what a force at the lever r gives: N_f + N_m × r, a vector over the direction of the force
    per_force = force[:, None] + np.cross(moment[:, None], struck.geometry.levers)
    by_error = []
    for across in tangents(directions):
        leaning = np.einsum("fia,ia->fi", per_force, across)
        off = moment @ np.cross(across, directions).T
        by_error += [
            np.einsum("fi,ip->ifp", size * change, inverse)
            for size, change in (
                (tolerances.impact_angle, leaning),
                (tolerances.impact_position, off),
            )
        ]
    # a load that truly acts beside the stated point turns about it as well
    turning = np.zeros((3, *functions.shape), dtype=complex)
    turning[..., :3] = tolerances.sensor_position * np.cross(moment[None], np.eye(3)[:, None])
    return np.sqrt(variance @ inverse**2), np.concatenate([*by_error, turning])


def tangents(directions: RealArray) -> tuple[RealArray, RealArray]:
    """Two unit vectors across each direction, shape (n, 3) each."""
    first = np.cross(directions, np.eye(3)[np.argmin(np.abs(directions), axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(directions, first)


def measured_lines(measured: RealArray, wanted: RealArray) -> npt.NDArray[np.intp]:
    """Return the places of wanted lines (n,) among the measured ones (n_frequency,) [Hz].

    A line that was not measured raises InputError: nothing is interpolated.
    """
    nearest = np.argmin(np.abs(measured[:, None] - wanted), axis=0)
    far = np.abs(measured[nearest] - wanted) > SAME_LINE * wanted
    if far.any():
        raise InputError(
            f"the noise transfer functions have no line at {wanted[far][0]:g} Hz, they go from "
            f"{measured[0]:g} to {measured[-1]:g} Hz: measure it, nothing is interpolated"
        )
    return np.asarray(nearest, dtype=np.intp)
