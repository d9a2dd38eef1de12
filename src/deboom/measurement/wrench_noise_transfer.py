"""Noise transfer functions of forces and moments at the points of an electric car's body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channel_geometry import (
    RIGID_MOTIONS,
    ChannelGeometry,
    impact_geometry,
    sensor_geometry,
)
from deboom.measurement.channels import Frf
from deboom.measurement.consistency import RigidConsistency, excitation_consistency
from deboom.measurement.electric_car import ElectricCar, TransferPoint
from deboom.measurement.inertance_test import freeze_field
from deboom.measurement.noise_transfer import POINT_LOADS, noise_transfer_at_points
from deboom.measurement.virtual_point import virtual_point

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
