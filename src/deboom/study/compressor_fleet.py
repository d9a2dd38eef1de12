"""A fleet of electric cars for one compressor: measured folders, or the virtual bench."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.compressor_laboratory import draw
from deboom.bench.compressor_operation import Operation, gas_factor, operation
from deboom.bench.compressor_operation_plan import PRESSURES
from deboom.bench.compressor_plan import CalibrationLevel
from deboom.bench.compressor_rig import placement_errors
from deboom.bench.electric_body import POINTS, ElectricCarBody
from deboom.bench.electric_car import design_pressure
from deboom.bench.electric_car_writer import CAR_PLAN, write_electric_car
from deboom.bench.electric_fleet import draw_fleet, frozen_fleet
from deboom.bench.electric_hammer import CABIN_NOISE, body_plan, strike_body
from deboom.bench.electric_places import draw_setup, point_sheets
from deboom.bench.electric_sweeps import draw_car_sensors
from deboom.errors import InputError
from deboom.files.electric_car import read_electric_car
from deboom.measurement.channels import Frf
from deboom.measurement.electric_car import ElectricCar
from deboom.physics.sound_level import spl

OTHER_CARS = 200
"""Purposes of random numbers from here on belong to the cars that are not written."""


@dataclass(frozen=True, eq=False)
class FleetTruth:
    """What is exactly so in a virtual fleet.

    Parameters
    ----------
    there : Operation
        Compressor, hoses and source.
    bodies : tuple of ElectricCarBody
    """

    there: Operation
    bodies: tuple[ElectricCarBody, ...]

    def levels(
        self, factors: RealArray, frequency: RealArray, pressure: float, *, with_hoses: bool
    ) -> RealArray:
        """Return the sound pressure level for other mounts, coupled and exact.

        Parameters
        ----------
        factors : array, shape (n, 3 m)
            On the true stiffness of every mount [1].
        frequency : array, shape (f,)
            [Hz]
        pressure : float
            Of the gas, one of the bench's [bar].
        with_hoses : bool

        Returns
        -------
        array, shape (n, v, f)
            [dB(A)]
        """
        compressor = self.there.laboratory.compressor
        stiffness = factors.reshape(-1, *compressor.stiffness.shape) * compressor.stiffness
        hoses = compressor.hoses if with_hoses else ()
        heard = [
            design_pressure(
                body,
                compressor,
                self.there.source,
                frequency,
                stiffness,
                hoses,
                gas_factor(pressure),
            )
            for body in self.bodies
        ]
        return spl(np.stack(heard, axis=1), frequency, axis=-1)


@dataclass(frozen=True, eq=False)
class CompressorFleet:
    """Cars whose bodies were struck; in the first one the compressor was struck and run.

    Parameters
    ----------
    cars : tuple of ElectricCar
    inputs : tuple of Path
        Every file that was read.
    truth : FleetTruth or None
        None where cars were measured.
    """

    cars: tuple[ElectricCar, ...]
    inputs: tuple[Path, ...]
    truth: FleetTruth | None = None


def measured_fleet(folders: Sequence[Path]) -> CompressorFleet:
    """Read the folders of cars.

    Parameters
    ----------
    folders : sequence of Path
        Each with ``car.toml``; the compressor is that of the first.

    Raises
    ------
    InputError
        A folder that holds no car, two cars of one name, cars with other mounts than the first.
    """
    cars = tuple(read_electric_car(folder) for folder in folders)
    first = cars[0]
    mounts = {point.name for point in first.mounts}
    for car in cars[1:]:
        if {point.name for point in car.mounts} != mounts:
            raise InputError(
                f"car {car.name} has the mounts {[point.name for point in car.mounts]}, car "
                f"{first.name} {sorted(mounts)}: one compressor stands on mounts of the same names"
            )
    names = [car.name for car in cars]
    if len(set(names)) < len(names):
        raise InputError(f"two cars have one name: {names}")
    files = dict.fromkeys(path for car in cars for path in car.input_files)
    return CompressorFleet(cars, tuple(files))


def virtual_fleet(seed: int, level: CalibrationLevel, fleet: int | None = None) -> CompressorFleet:
    """Measure a fleet of the virtual bench.

    Parameters
    ----------
    seed : int
        Of the laboratory, from 1.
    level : CalibrationLevel
    fleet : int, optional
        Seed of a drawn fleet; the frozen one if left out.

    Returns
    -------
    CompressorFleet
        The first car goes through its files, the others are struck in memory.
    """
    bodies = (frozen_fleet() if fleet is None else draw_fleet(fleet)).cars
    names = list(bodies)
    with tempfile.TemporaryDirectory() as folder:
        first = read_electric_car(
            write_electric_car(Path(folder) / "car", seed, names[0], fleet, level)
        )
    there = operation(seed, level, CAR_PLAN)
    others = [
        _struck(first, bodies[name], there, seed, level, number)
        for number, name in enumerate(names[1:])
    ]
    truth = FleetTruth(there, tuple(bodies.values()))
    return CompressorFleet((replace(first, input_files=()), *others), (), truth)


def bar_of(case: str) -> float:
    """Return the bench's pressure of a case [bar].

    Raises
    ------
    InputError
        A pressure that the bench does not have.
    """
    known = {f"{pressure:g} bar": pressure for pressure in PRESSURES}
    if case not in known:
        raise InputError(f"the bench has no sweep at {case}, only at {', '.join(known)}")
    return known[case]


def _struck(
    first: ElectricCar,
    body: ElectricCarBody,
    there: Operation,
    seed: int,
    level: CalibrationLevel,
    number: int,
) -> ElectricCar:
    """Strike another body where the first was struck, with new errors of placement and noise."""
    compressor = there.laboratory.compressor
    places = [*compressor.positions, *(hose.end for hose in compressor.hoses)]
    sheets = point_sheets(dict(zip(POINTS, places, strict=True)))
    purpose, errors = OTHER_CARS + 3 * number, placement_errors(level)
    setup = draw_setup(sheets, errors, draw(seed, purpose))
    microphone = draw_car_sensors(errors, draw(seed, purpose + 1)).microphone
    found = strike_body(body, setup, body_plan(), CABIN_NOISE, microphone, draw(seed, purpose + 2))
    pressure, accelerance = first.pressure, first.accelerance
    return replace(
        first,
        name=body.name,
        pressure=Frf(
            found.frequency,
            found.pressure[:, np.newaxis],
            pressure.outputs,
            pressure.inputs,
            pressure.unit,
        ),
        coherence=found.coherence[:, np.newaxis],
        accelerance=Frf(
            found.frequency,
            found.acceleration,
            accelerance.outputs,
            accelerance.inputs,
            accelerance.unit,
        ),
        input_files=(),
    )
