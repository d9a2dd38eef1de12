"""Sensors, hammer and sweeps on a virtual electric car.

The body is struck and measured around every mount and hose end; the places around a point are those
around a mount of the bench's other vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.bench.compressor_operation import SCATTER, Operation, Sweep, floor, gas_factor
from deboom.bench.compressor_rig import (
    HitPlan,
    Placed,
    PlacementErrors,
    Sheet,
    first_estimate,
    hit_plan,
    place,
    without_noise,
)
from deboom.bench.electric_car import (
    MOUNTS,
    POINTS,
    CarRun,
    ElectricCarBody,
    columns_of,
    run_car,
)
from deboom.bench.signals import complex_normal
from deboom.bench.vehicle_acquisition import (
    BODY_SENSOR_ANGLES,
    BODY_SENSOR_OFFSETS,
    IMPACT_OFFSETS,
    PUSHES,
)
from deboom.bench.writing import triple
from deboom.files.rows import PlacedImpact, PlacedSensor
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

FIRST_SENSOR_NODE, FIRST_IMPACT_NODE, FIRST_HOLDER_NODE = 401, 501, 301
EAR, EAR_NODE, MICROPHONE = "driver ear", 901, "MIC2101"

SHEET_DIGITS = 4
"""Of the positions on the sheet [m]."""

BODY_IMPULSE, BODY_PULSE, BODY_BAND = 1.0, 0.005, (15.0, 150.0)
"""A usual hit on a body [N s], the half sine of a soft tip on sheet metal [s], the lines [Hz]."""

CABIN_NOISE = 1e-4
"""Amplitude spectral density of the background noise in a closed car in a quiet room [Pa/√Hz]."""

MICROPHONE_DB = 0.2
"""Deviation of a microphone's calibration [dB]."""

SOUND_FLOOR = 3e-5
"""Deviation of the real and of the imaginary part of a tracked pressure [Pa]: ten seconds per line
in a closed car in a quiet room."""


@dataclass(frozen=True, eq=False)
class PointSheet:
    """What is glued on and struck around one point.

    - `name`: name, such as ``mount 1``.
    - `position` (3,): place where the body truly takes its load, from the compressor's virtual
      point [m].
    - `sheet`: places as stated, from the true point.
    """

    name: str
    position: RealArray
    sheet: Sheet

    @property
    def short(self) -> str:
        """Short name, such as ``M1`` or ``H2``."""
        kind, number = self.name.split()
        return f"{kind[0].upper()}{number}"

    def sensors(self) -> tuple[PlacedSensor, ...]:
        """Return the rows of the position sheet of its accelerometers."""
        first = FIRST_SENSOR_NODE + len(BODY_SENSOR_OFFSETS) * POINTS.index(self.name)
        rows = zip(self.sheet.sensor_positions, self.sheet.sensor_angles, strict=True)
        return tuple(
            PlacedSensor(
                f"{self.short} S{number + 1}",
                first + number,
                triple(self.position + offset, SHEET_DIGITS),
                triple(angles),
            )
            for number, (offset, angles) in enumerate(rows)
        )

    def impacts(self) -> tuple[PlacedImpact, ...]:
        """Return the rows of the impacts around it; those of one place share a node."""
        first = FIRST_IMPACT_NODE + len(IMPACT_OFFSETS) * POINTS.index(self.name)
        rows = zip(self.sheet.impact_positions, self.sheet.impact_directions, strict=True)
        return tuple(
            PlacedImpact(
                f"{self.short} I{number // 3 + 1}{AXES[number % 3]}",
                first + number // 3,
                triple(self.position + offset, SHEET_DIGITS),
                triple(direction),
            )
            for number, (offset, direction) in enumerate(rows)
        )


def point_sheets(positions: dict[str, RealArray]) -> tuple[PointSheet, ...]:
    """Plan sensors and impacts around every one of `POINTS` at its position (3,) [m]."""
    pushes = np.concatenate([np.diag(signs) for signs in PUSHES]).astype(float)

    def on_sheet(point: RealArray, offsets: Sequence[tuple[float, ...]]) -> RealArray:
        """Offsets whose ends a sheet states without rounding."""
        return np.asarray(np.round(point + np.array(offsets), SHEET_DIGITS) - point)

    sheets = []
    for name in POINTS:
        point = positions[name]
        sheet = Sheet(
            sensor_positions=on_sheet(point, BODY_SENSOR_OFFSETS),
            sensor_angles=np.deg2rad(BODY_SENSOR_ANGLES),
            impact_positions=np.repeat(on_sheet(point, IMPACT_OFFSETS), 3, axis=0),
            impact_directions=pushes,
        )
        sheets.append(PointSheet(name, point, sheet))
    return tuple(sheets)


@dataclass(frozen=True, eq=False)
class Setup:
    """How the body is instrumented and struck, as stated and as it is, with one hammer."""

    points: tuple[PointSheet, ...]
    placed: tuple[Placed, ...]

    @property
    def response_rows(self) -> RealArray:
        """Motions of all points → all channels, shape (n_channel, 6 n_point) [1, m]."""
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
    return Setup(tuple(points), tuple(replace(point, hammer_gain=gain) for point in placed))


@dataclass(frozen=True, eq=False)
class BodyFrfs:
    """FRFs over the hits of every impact on the body.

    - `frequency` (f,) [Hz].
    - `pressure`, `coherence` (f, m): pressure at the driver's ear per stated force of every impact,
      and its ordinary coherence [Pa/N], [1].
    - `acceleration` (f, n_channel, m): acceleration at the channels of all sensors on the body
      [m/s² per N].
    """

    frequency: RealArray
    pressure: ComplexArray
    coherence: RealArray
    acceleration: ComplexArray


def body_plan(*, noise_free: bool = False) -> HitPlan:
    """Return how a body is struck: the compressor's sensors and hits, a larger and softer hammer.

    Without noise, every hit is where it should be, and channels and cabin are silent.
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

    The noise in the cabin is an amplitude spectral density [Pa/√Hz], the microphone's gain the
    stated over the true pressure [1].
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
        columns = slice(len(AXES) * number, len(AXES) * (number + 1))
        answer = np.concatenate([seen[:, :, columns], transfer[:, None, columns]], axis=1)
        n_impact = len(point.sheet.impact_positions)
        wrenches = placed.scattered_wrenches(point.sheet, plan.hits, plan.scatter, generator)
        impulses = plan.impulse * generator.uniform(*plan.spread, (plan.hits, n_impact))
        for impact in range(n_impact):
            push = impulses[:, impact, None] * pulse
            response = np.einsum("fca,ha,hf->hfc", answer, wrenches[:, impact], push)
            response = response + deviation * complex_normal(response.shape, generator)
            force = (1 + placed.hammer_gain) * push + (
                plan.force_noise * plan.impulse * complex_normal(push.shape, generator)
            )
            estimate, coherence = first_estimate(force, response)
            functions.append(estimate)
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


@dataclass(frozen=True, eq=False)
class CarSensors:
    """What the sheets do not say about the sensors of a running car.

    Per mount, six motions of the body there → triaxial accelerometer on its side, shape (3, 6);
    stated over true pressure of the microphone [1].
    """

    holder_rows: tuple[RealArray, ...]
    microphone: float


@dataclass(frozen=True, eq=False)
class CarSweep(Sweep):
    """One run-up in the car: the truth, and its channels without noise [m/s²], [m/s²], [Pa]."""

    run: CarRun
    acceleration: ComplexArray
    holder: ComplexArray
    sound: ComplexArray


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
    running_rig: Operation,
    sensors: CarSensors,
    frequency: RealArray,
    pressure: float,
    *,
    soft: bool,
) -> CarSweep:
    """Run up the compressor in the car at one of `PRESSURES` [bar] over `frequency` (f,) [Hz]."""
    rig, source = running_rig.laboratory, running_rig.source
    hoses = () if soft else rig.compressor.hoses
    run = run_car(car, rig.compressor, source, frequency, hoses, gas_factor(pressure))
    squared = (2 * np.pi * frequency[:, None]) ** 2
    motion = run.body_motion[:, columns_of(MOUNTS)].reshape(len(squared), -1, len(AXES))
    holder: ComplexArray = np.hstack(
        [motion[:, number] @ rows.T for number, rows in enumerate(sensors.holder_rows)]
    )
    seen = run.displacement @ rig.placed.response_rows(rig.sheet).T
    return CarSweep(
        pressure,
        hoses,
        run,
        acceleration=-squared * seen,
        holder=-squared * holder,
        sound=sensors.microphone * run.pressure[:, None],
    )


def tracked(
    sweep: CarSweep, generator: np.random.Generator
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return the delivered spectra: acceleration, holder and sound with scatter and noise."""
    channel_floor = floor(sweep.run.frequency)[:, None]

    def noisy(exact: ComplexArray, deviation: RealArray | float) -> ComplexArray:
        scatter, noise = generator.standard_normal((2, *exact.shape, 2)) @ [1, 1j] / np.sqrt(2)
        return np.asarray(exact * (1 + SCATTER * scatter) + deviation * noise)

    return (
        noisy(sweep.acceleration, channel_floor),
        noisy(sweep.holder, channel_floor),
        noisy(sweep.sound, np.sqrt(2) * SOUND_FLOOR),
    )
