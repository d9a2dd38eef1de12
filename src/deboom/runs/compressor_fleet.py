"""Electric cars with one compressor: read from folders, or measured by a virtual laboratory."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.choices import CalibrationLevel
from deboom.bench.compressor_rig import Operation, draw, gas_factor, operation, placement_errors
from deboom.bench.electric_car import (
    CABIN_NOISE,
    ElectricCarBody,
    body_plan,
    design_pressure,
    draw_car_sensors,
    draw_fleet,
    draw_setup,
    frozen_fleet,
    point_sheets,
    strike_body,
)
from deboom.bench.electric_car_writer import CAR_PLAN, write_electric_car
from deboom.compressor.mounted_fleet import CompressorFleet
from deboom.errors import InputError
from deboom.files.electric_car import read_electric_car
from deboom.measurement.electric_car import ElectricCar
from deboom.physics.sound_level import spl

OTHER_CARS = 200
"""Purposes of random numbers from here on belong to the cars that are not written."""


@dataclass(frozen=True, eq=False)
class FleetTruth:
    """What is exactly so in a virtual fleet: compressor, hoses and source, and the bodies."""

    running: Operation
    bodies: tuple[ElectricCarBody, ...]

    def levels(
        self, factors: RealArray, frequency: RealArray, pressure: float, *, with_hoses: bool
    ) -> RealArray:
        """Return the exact coupled level for other mounts, shape (n, v, f) [dB(A)].

        - `factors` (n, 3 m): on the true stiffness of every mount [1].
        - `frequency` (f,): [Hz]; `pressure`: of the gas, one of the bench's [bar].
        """
        compressor = self.running.laboratory.compressor
        stiffness = factors.reshape(-1, *compressor.stiffness.shape) * compressor.stiffness
        hoses = compressor.hoses if with_hoses else ()
        gas = gas_factor(pressure)
        heard = [
            design_pressure(body, compressor, self.running.source, frequency, stiffness, hoses, gas)
            for body in self.bodies
        ]
        return spl(np.stack(heard, axis=1), frequency, axis=-1)


def measured_fleet(folders: Sequence[Path]) -> CompressorFleet:
    """Read cars from folders with ``car.toml``; the compressor is that of the first.

    InputError: a folder without a car, two cars of one name, cars with other mounts than the first.
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
    """Measure a fleet of the virtual bench: the first car through its files, others in memory.

    - `seed`: of the laboratory, from 1.
    - `fleet`: seed of a drawn fleet; the frozen one if left out.
    """
    bodies = frozen_fleet() if fleet is None else draw_fleet(fleet)
    names = list(bodies)
    with tempfile.TemporaryDirectory() as folder:
        written = write_electric_car(Path(folder) / "car", seed, names[0], fleet, level)
        first = replace(read_electric_car(written), input_files=())
    running = operation(seed, level, CAR_PLAN)
    others = [
        _struck(first, bodies[name], running, seed, level, number)
        for number, name in enumerate(names[1:])
    ]
    return CompressorFleet((first, *others), (), FleetTruth(running, tuple(bodies.values())))


def _struck(
    first: ElectricCar,
    body: ElectricCarBody,
    running: Operation,
    seed: int,
    level: CalibrationLevel,
    number: int,
) -> ElectricCar:
    """Strike another body where the first was struck, with new errors of placement and noise."""
    purpose, errors = OTHER_CARS + 3 * number, placement_errors(level)
    sheets = point_sheets(running.laboratory.compressor)
    setup = draw_setup(sheets, errors, draw(seed, purpose))
    _, microphone = draw_car_sensors(errors, draw(seed, purpose + 1))
    random = draw(seed, purpose + 2)
    measured = strike_body(body, setup, body_plan(), CABIN_NOISE, microphone, random)
    lines, pressure = measured.frequency, measured.pressure[:, np.newaxis]
    return replace(
        first,
        name=body.name,
        pressure=replace(first.pressure, frequency=lines, values=pressure),
        coherence=measured.coherence[:, np.newaxis],
        accelerance=replace(first.accelerance, frequency=lines, values=measured.acceleration),
    )
