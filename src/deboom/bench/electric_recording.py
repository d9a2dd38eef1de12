"""Sensors, hammer and sweeps on a virtual electric car."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_operation import SCATTER, Operation, floor, gas_factor
from deboom.bench.compressor_rig import (
    HitPlan,
    Placed,
    PlacementErrors,
    Sheet,
    hit_plan,
    place,
    without_noise,
)
from deboom.bench.electric_car import (
    MOTIONS,
    MOUNTS,
    POINTS,
    CarRun,
    ElectricCarBody,
    columns_of,
    run_car,
)
from deboom.bench.frozen import freeze_arrays
from deboom.bench.powertrain import AXES
from deboom.bench.vehicle_acquisition import (
    BODY_SENSOR_ANGLES,
    BODY_SENSOR_OFFSETS,
    IMPACT_OFFSETS,
    PUSHES,
)
from deboom.files.inertance_test import PlacedImpact, PlacedSensor
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

FIRST_SENSOR_NODE, FIRST_IMPACT_NODE, FIRST_HOLDER_NODE = 401, 501, 301
EAR, EAR_NODE, MICROPHONE = "driver ear", 901, "MIC2101"

SHEET_DIGITS = 4
"""Of the positions on the sheet [m]."""


@dataclass(frozen=True, eq=False)
class PointSheet:
    """What is glued on and struck around one point.

    Parameters
    ----------
    name : str
        Such as ``mount 1``.
    position : array, shape (3,)
        Where the body truly takes its load, from the compressor's virtual point [m].
    sheet : Sheet
        Places as stated, from the true point.
    """

    name: str
    position: RealArray
    sheet: Sheet

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def short(self) -> str:
        """Such as ``M1`` or ``H2``."""
        kind, number = self.name.split()
        return f"{kind[0].upper()}{number}"

    def sensors(self) -> tuple[PlacedSensor, ...]:
        """Rows of the position sheet of its accelerometers."""
        first = FIRST_SENSOR_NODE + len(BODY_SENSOR_OFFSETS) * POINTS.index(self.name)
        return tuple(
            PlacedSensor(
                f"{self.short} S{number + 1}",
                first + number,
                _stated(self.position + offset),
                _three(angles),
            )
            for number, (offset, angles) in enumerate(
                zip(self.sheet.sensor_positions, self.sheet.sensor_angles, strict=True)
            )
        )

    def impacts(self) -> tuple[PlacedImpact, ...]:
        """Rows of the position sheet of the impacts around it; those of one place share a node."""
        first = FIRST_IMPACT_NODE + len(IMPACT_OFFSETS) * POINTS.index(self.name)
        rows = []
        for number, (offset, direction) in enumerate(
            zip(self.sheet.impact_positions, self.sheet.impact_directions, strict=True)
        ):
            place_number, axis = divmod(number, len(AXES))
            rows.append(
                PlacedImpact(
                    f"{self.short} I{place_number + 1}{AXES[axis]}",
                    first + place_number,
                    _stated(self.position + offset),
                    _three(direction),
                )
            )
        return tuple(rows)


def point_sheets(positions: dict[str, RealArray]) -> tuple[PointSheet, ...]:
    """Plan sensors and impacts around every point.

    Parameters
    ----------
    positions : dict of str to array, shape (3,)
        Every one of `POINTS`, from the compressor's virtual point [m].
    """
    sheets = []
    for name in POINTS:
        at = positions[name]
        pushes = np.concatenate([np.diag(signs) for signs in PUSHES]).astype(float)
        sheet = Sheet(
            sensor_positions=_on_sheet(at, BODY_SENSOR_OFFSETS),
            sensor_angles=np.deg2rad(BODY_SENSOR_ANGLES),
            impact_positions=np.repeat(_on_sheet(at, IMPACT_OFFSETS), len(AXES), axis=0),
            impact_directions=pushes,
        )
        sheets.append(PointSheet(name, at, sheet))
    return tuple(sheets)


@dataclass(frozen=True, eq=False)
class Setup:
    """How the body is truly instrumented and struck.

    Parameters
    ----------
    points : tuple of PointSheet
        As stated.
    placed : tuple of Placed
        As it is, per point; the gain of the one hammer in all of them.
    """

    points: tuple[PointSheet, ...]
    placed: tuple[Placed, ...]

    @property
    def hammer_gain(self) -> float:
        """Relative error of the force that the hammer states [1]."""
        return self.placed[0].hammer_gain

    @property
    def response_rows(self) -> RealArray:
        """Motions of all points to all channels, shape (n_channel, 6 n_point) [1, m]."""
        blocks = [
            placed.response_rows(point.sheet)
            for point, placed in zip(self.points, self.placed, strict=True)
        ]
        return np.asarray(block_diag(*blocks), dtype=np.float64)


def draw_setup(
    points: Sequence[PointSheet], errors: PlacementErrors, generator: np.random.Generator
) -> Setup:
    """Instrument the body with the errors of a laboratory, one hammer for all points."""
    placed = [place(point.sheet, errors, generator) for point in points]
    gain = placed[0].hammer_gain
    return Setup(tuple(points), tuple(replace(one, hammer_gain=gain) for one in placed))


def _on_sheet(at: RealArray, offsets: Sequence[tuple[float, float, float]]) -> RealArray:
    """Offsets whose ends a sheet states without rounding."""
    return np.asarray(np.round(at + np.array(offsets), SHEET_DIGITS) - at)


def _stated(position: RealArray) -> tuple[float, float, float]:
    return _three(np.round(position, SHEET_DIGITS))


def _three(values: RealArray) -> tuple[float, float, float]:
    x, y, z = np.asarray(values).tolist()
    return x, y, z


BODY_IMPULSE = 1.0
"""Of a usual hit on a body [N s]."""

BODY_PULSE = 0.005
"""Duration of the half sine of a soft tip on sheet metal [s]."""

BODY_BAND = (15.0, 150.0)
"""First and last line [Hz]."""

CABIN_NOISE = 1e-4
"""Amplitude spectral density of the background noise in a closed car in a quiet room [Pa/√Hz]."""


@dataclass(frozen=True, eq=False)
class BodyFrfs:
    """What the hammer finds, FRFs over the hits of every impact.

    Parameters
    ----------
    frequency : array, shape (f,)
        [Hz].
    pressure : array, shape (f, m)
        At the driver's ear per stated force of every impact [Pa/N].
    coherence : array, shape (f, m)
        Ordinary, of the pressure [1].
    acceleration : array, shape (f, n_channel, m)
        At the channels of all sensors on the body [m/s² per N].
    """

    frequency: RealArray
    pressure: ComplexArray
    coherence: RealArray
    acceleration: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def body_plan(*, noise_free: bool = False) -> HitPlan:
    """Return how a body is struck: the compressor's sensors and hits, a larger and softer hammer.

    Parameters
    ----------
    noise_free : bool
        Every hit where it should be, silent channels and a silent cabin.
    """
    plan = replace(hit_plan(), impulse=BODY_IMPULSE, pulse=BODY_PULSE, band=BODY_BAND)
    return without_noise(plan) if noise_free else plan


def strike_body(
    car: ElectricCarBody,
    setup: Setup,
    plan: HitPlan,
    cabin_noise: float,
    microphone: float,
    generator: np.random.Generator,
) -> BodyFrfs:
    """Strike the body around every point; the compressor and its hoses are taken out.

    Parameters
    ----------
    car : ElectricCarBody
        The truth.
    setup : Setup
        Where sensors and impacts should be, and are.
    plan : HitPlan
        How.
    cabin_noise : float
        Amplitude spectral density in the cabin [Pa/√Hz].
    microphone : float
        Stated over true pressure [1].
    generator : Generator
        Draws strength, scatter and noise.

    Returns
    -------
    BodyFrfs
        ``H₁ = Σ a f* / Σ |f|²`` over the hits.
    """
    lines = plan.lines
    transfer = microphone * car.noise_transfer(lines)
    accelerance = -((2 * np.pi * lines) ** 2)[:, None, None] * car.receptance(lines)
    seen = setup.response_rows @ accelerance
    pulse = _pulse(plan.pulse, lines)
    noise = np.full(len(setup.response_rows), plan.response_noise)
    colour = np.outer(np.sqrt(1 + (plan.corner / lines) ** 2), np.append(noise, 0.0))
    colour[:, -1] = cabin_noise
    deviation = colour * np.sqrt(plan.duration) / 2

    functions, coherences = [], []
    for number, (point, placed) in enumerate(zip(setup.points, setup.placed, strict=True)):
        columns = slice(len(MOTIONS) * number, len(MOTIONS) * (number + 1))
        answer = np.concatenate([seen[:, :, columns], transfer[:, None, columns]], axis=1)
        n_impact = len(point.sheet.impact_positions)
        off = plan.scatter * generator.standard_normal((plan.hits, n_impact, 2))
        scatter = np.einsum("hmt,mta->hma", off, point.sheet.across)
        wrenches = placed.excitation_rows(point.sheet, scatter)
        impulses = plan.impulse * generator.uniform(*plan.spread, (plan.hits, n_impact))
        for impact in range(n_impact):
            push = impulses[:, impact, None] * pulse
            response = np.einsum("fca,ha,hf->hfc", answer, wrenches[:, impact], push)
            response = response + deviation * _complex_normal(response.shape, generator)
            force = (1 + placed.hammer_gain) * push + (
                plan.force_noise * plan.impulse * _complex_normal(push.shape, generator)
            )
            function, coherence = _h1(force, response)
            functions.append(function)
            coherences.append(coherence[:, -1])
    matrix = np.stack(functions, axis=2)
    return BodyFrfs(
        frequency=lines,
        pressure=matrix[:, -1],
        coherence=np.stack(coherences, axis=1),
        acceleration=matrix[:, :-1],
    )


def _pulse(duration: float, frequency: RealArray) -> RealArray:
    """Spectrum of a half sine of impulse 1 about its middle [1]."""
    half_waves = 2 * frequency * duration
    sum_of_sincs = np.sinc((1 + half_waves) / 2) + np.sinc((1 - half_waves) / 2)
    return np.asarray(np.pi / 4 * sum_of_sincs)


def _h1(force: ComplexArray, response: ComplexArray) -> tuple[ComplexArray, RealArray]:
    cross: ComplexArray = np.einsum("hfc,hf->fc", response, force.conj())
    of_force = np.einsum("hf,hf->f", force, force.conj()).real[:, None]
    of_response = np.einsum("hfc,hfc->fc", response, response.conj()).real
    coherence = np.minimum(np.abs(cross) ** 2 / (of_force * of_response), 1.0)
    return np.asarray(cross / of_force), coherence


def _complex_normal(shape: tuple[int, ...], generator: np.random.Generator) -> ComplexArray:
    real, imaginary = generator.standard_normal((2, *shape))
    return np.asarray(real + 1j * imaginary)


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
        One of `deboom.bench.compressor_operation.PRESSURES` [bar].
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
