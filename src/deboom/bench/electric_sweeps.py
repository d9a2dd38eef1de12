"""Sweeps in an electric car: what its sensors show while the compressor runs up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_operation import SCATTER, Operation, floor, gas_factor
from deboom.bench.compressor_rig import PlacementErrors
from deboom.bench.electric_body import MOTIONS, MOUNTS, ElectricCarBody, columns_of
from deboom.bench.electric_car import CarRun, run_car
from deboom.bench.frozen import freeze_arrays
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

MICROPHONE_DB = 0.2
"""Deviation of a microphone's calibration [dB]."""

SOUND_FLOOR = 3e-5
"""Deviation of the real and of the imaginary part of a tracked pressure [Pa]: ten seconds per line
in a closed car in a quiet room."""


@dataclass(frozen=True, eq=False)
class CarSensors:
    """What the sheets do not say about the sensors of a running car.

    Parameters
    ----------
    holder_rows : tuple of array, shape (3, 6)
        Per mount: six motions of the body there to the triaxial accelerometer on its side.
    microphone : float
        Stated over true pressure [1].
    """

    holder_rows: tuple[RealArray, ...]
    microphone: float

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True, eq=False)
class CarSweep:
    """One run-up in the car.

    Parameters
    ----------
    soft : bool
        Long soft hoses instead of the car's own ones.
    pressure : float
        Of the gas [bar].
    run : CarRun
        What truly happens.
    acceleration, holder, sound : array, shape (f, n_channel)
        What the sensors show without noise [m/s²], [m/s²], [Pa].
    """

    soft: bool
    pressure: float
    run: CarRun
    acceleration: ComplexArray
    holder: ComplexArray
    sound: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def state(self) -> Literal["soft", "standard"]:
        """Of the hoses, as the files call it."""
        return "soft" if self.soft else "standard"

    @property
    def name(self) -> str:
        """Such as ``standard 7.5 bar``."""
        return f"{self.state} {self.pressure:g} bar"


def draw_car_sensors(errors: PlacementErrors, generator: np.random.Generator) -> CarSensors:
    """Glue one accelerometer on the body side of every mount, and set up the microphone."""
    rows = []
    for _ in MOUNTS:
        offset = errors.position * generator.standard_normal(3)
        turn = rotation_matrix(errors.angle * generator.standard_normal(3))
        gain = 1 + errors.gain * generator.standard_normal(3)
        rows.append(gain[:, None] * forward_matrices(offset[None], turn[None]))
    # a laboratory without errors has an exact microphone
    decibel = MICROPHONE_DB * float(generator.standard_normal()) if errors.gain else 0.0
    return CarSensors(tuple(rows), float(10 ** (decibel / 20)))


def sweep_car(
    car: ElectricCarBody,
    there: Operation,
    sensors: CarSensors,
    frequency: RealArray,
    pressure: float,
    *,
    soft: bool,
) -> CarSweep:
    """Run up the compressor in the car.

    Parameters
    ----------
    car : ElectricCarBody
    there : Operation
        Compressor with its hoses, what shakes it, and the accelerometers on it.
    sensors : CarSensors
        On the body, and in the cabin.
    frequency : array, shape (f,)
        Of the rotation [Hz].
    pressure : float
        One of `deboom.bench.compressor_operation_plan.PRESSURES` [bar].
    soft : bool
        Long soft hoses with masses on them, which are mechanically absent.
    """
    laboratory = there.laboratory
    compressor = laboratory.compressor
    run = run_car(
        car,
        compressor,
        there.source,
        frequency,
        () if soft else compressor.hoses,
        gas_factor(pressure),
    )
    squared = (2 * np.pi * frequency[:, None]) ** 2
    motion = run.body_motion[:, columns_of(MOUNTS)].reshape(len(squared), -1, len(MOTIONS))
    holder = [motion[:, number] @ rows.T for number, rows in enumerate(sensors.holder_rows)]
    seen = run.displacement @ laboratory.placed.response_rows(laboratory.sheet).T
    return CarSweep(
        soft=soft,
        pressure=pressure,
        run=run,
        acceleration=-squared * seen,
        holder=np.asarray(-squared * np.hstack(holder), dtype=np.complex128),
        sound=sensors.microphone * run.pressure[:, None],
    )


def tracked(
    sweep: CarSweep, generator: np.random.Generator
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return the delivered spectra: acceleration, holder and sound with scatter and noise."""
    channel_floor = floor(sweep.run.frequency)[:, None]

    def noisy(exact: ComplexArray, deviation: RealArray | float) -> ComplexArray:
        own, flat = generator.standard_normal((2, *exact.shape, 2)) @ [1, 1j] / np.sqrt(2)
        return np.asarray(exact * (1 + SCATTER * own) + deviation * flat)

    return (
        noisy(sweep.acceleration, channel_floor),
        noisy(sweep.holder, channel_floor),
        noisy(sweep.sound, np.sqrt(2) * SOUND_FLOOR),
    )
