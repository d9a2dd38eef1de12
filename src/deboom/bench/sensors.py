"""Sensors of the platform's bench with their errors, what the laboratory makes of them,."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.frozen import freeze_arrays
from deboom.bench.operating_run import SIDES, OperatingRun
from deboom.bench.powertrain import VirtualBench
from deboom.physics.dynamic_stiffness import displacement_from_acceleration
from deboom.physics.rigid_body import forward_matrices

ACCELEROMETER_OFFSETS = {
    "EnM": ((0.06, -0.05, 0.02), (-0.05, -0.03, -0.04)),
    "GeM": ((0.05, 0.05, 0.03), (-0.06, 0.04, -0.02)),
    "TSM": ((-0.07, 0.05, 0.03), (-0.05, -0.06, -0.03)),
}
"""Where the accelerometers sit, from the virtual point of their mount [m]."""


@dataclass(frozen=True)
class ErrorBudget:
    """Standard deviations of every error of the bench's measuring chain.

    Parameters
    ----------
    position, angle : float
        Of an accelerometer against its drawing [m], [rad].
    gain, cross_axis : float
        Of an accelerometer [1]; the cross-axis sensitivity is uniform within ± this.
    acceleration_own, acceleration_norm, acceleration_floor : float
        Order-tracking noise per own channel [1], per norm of the triaxial sensor [1], floor [m/s²].
    cell_gain, cell_cross, cell_shunt : float
        Of a force cell [1]: scatter, cross-talk (uniform within ±), force that bypasses it.
    force_own, force_norm, force_floor : float
        Order-tracking noise of a cell [1], [1], [N].
    shaker_angle, shaker_gain : float
        Of the shaker that calibrates the cells at the virtual point [rad], [1].
    bench_frequency, bench_flexibility : float
        First mode of the bench [Hz] and how much it adds to the force there [1].
    tilt : float
        Spread of the accelerometers' known orientations about right angles [rad].
    """

    position: float = 0.002
    angle: float = float(np.deg2rad(0.5))
    gain: float = 0.01
    cross_axis: float = 0.01
    acceleration_own: float = 0.002
    acceleration_norm: float = 0.00015
    acceleration_floor: float = 0.005
    cell_gain: float = 0.01
    cell_cross: float = 0.015
    cell_shunt: float = 0.06
    force_own: float = 0.002
    force_norm: float = 0.00015
    force_floor: float = 0.01
    shaker_angle: float = float(np.deg2rad(0.5))
    shaker_gain: float = 0.005
    bench_frequency: float = 248.0
    bench_flexibility: float = 0.05
    tilt: float = 0.15


@dataclass(frozen=True, eq=False)
class Instrumentation:
    """What the sensors truly do.

    Parameters
    ----------
    sensing : array, shape (n_channel, 6)
        Acceleration of the powertrain to the accelerometers' channels.
    cell_transfer : array, shape (n_mount, 3, 3)
        Force at the virtual point to the cell's channels.
    side_acceleration_gain, side_cell_gain : array, shape (n_side,)
        Of the sensors on the wishbone mounts.
    """

    sensing: RealArray
    cell_transfer: RealArray
    side_acceleration_gain: RealArray
    side_cell_gain: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True, eq=False)
class LaboratoryKnowledge:
    """What the laboratory believes of its sensors.

    Parameters
    ----------
    sensor_forward : array, shape (n_channel, 6)
        Nominal positions and orientations of the accelerometers.
    point_forward : array, shape (3 n_mount, 6)
        Virtual points of the mounts.
    force_transfer : array, shape (n_mount, 3, 3)
        Force transfer matrices, measured with the shaker.
    """

    sensor_forward: RealArray
    point_forward: RealArray
    force_transfer: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True, eq=False)
class RawChannels:
    """Order spectra of one run as the sensors deliver them.

    Parameters
    ----------
    frequency : array, shape (f,)
        [Hz].
    acceleration : array, shape (f, n_channel)
        Of the powertrain, three channels per accelerometer [m/s²].
    cell_force : array, shape (f, 3 n_mount)
        [N].
    side_acceleration, side_force : array, shape (f, n_side)
        At the wishbone mounts [m/s²], [N].
    """

    frequency: RealArray
    acceleration: ComplexArray
    cell_force: ComplexArray
    side_acceleration: ComplexArray
    side_force: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def draw_instrumentation(
    bench: VirtualBench, budget: ErrorBudget, generator: np.random.Generator
) -> tuple[Instrumentation, LaboratoryKnowledge]:
    """Mount the sensors with their errors.

    Parameters
    ----------
    bench : VirtualBench
        Where they sit.
    budget : ErrorBudget
        How large the errors are.
    generator : Generator
        Draws them.

    Returns
    -------
    Instrumentation, LaboratoryKnowledge
        The truth and what the laboratory works with.
    """
    nominal = np.array(
        [
            position + np.array(offset)
            for name, position in zip(bench.mount_names, bench.positions, strict=True)
            for offset in ACCELEROMETER_OFFSETS[name]
        ]
    )
    n_sensor, n_mount = len(nominal), len(bench.positions)
    quarter_turns = np.pi / 2 * generator.integers(4, size=n_sensor)
    upright = Rotation.from_rotvec(np.outer(quarter_turns, [0.0, 0.0, 1.0]))
    tilted = Rotation.from_rotvec(generator.normal(0, budget.tilt, (n_sensor, 3)))
    known = upright * tilted
    placed = nominal + generator.normal(0, budget.position, nominal.shape)
    true = known * Rotation.from_rotvec(generator.normal(0, budget.angle, (n_sensor, 3)))
    sensitivity = sensitivity_matrices(budget.gain, budget.cross_axis, n_sensor, generator)
    felt = forward_matrices(placed, true.as_matrix()).reshape(n_sensor, 3, 6)

    cells = sensitivity_matrices(budget.cell_gain, budget.cell_cross, n_mount, generator)
    cells = cells - budget.cell_shunt * np.eye(3)
    misaligned = Rotation.from_rotvec(generator.normal(0, budget.shaker_angle, (n_mount * 3, 3)))
    pushes = misaligned.apply(np.tile(np.eye(3), (n_mount, 1))).reshape(n_mount, 3, 3)
    shaker_gain = 1 + generator.normal(0, budget.shaker_gain, (n_mount, 3))
    # column a = what the cell answers to a push along a, per newton that the shaker states
    force_transfer = cells @ pushes.swapaxes(1, 2) / shaker_gain[:, None, :]

    n_side = len(SIDES)
    instrumentation = Instrumentation(
        sensing=(sensitivity @ felt).reshape(3 * n_sensor, 6),
        cell_transfer=cells,
        side_acceleration_gain=1 + generator.normal(0, budget.gain, n_side),
        side_cell_gain=1 + generator.normal(0, budget.shaker_gain, n_side),
    )
    knowledge = LaboratoryKnowledge(
        sensor_forward=forward_matrices(nominal, known.as_matrix()),
        point_forward=forward_matrices(bench.positions),
        force_transfer=force_transfer,
    )
    return instrumentation, knowledge


def sensitivity_matrices(
    gain: float, cross: float, n_sensor: int, generator: np.random.Generator
) -> RealArray:
    """Draw gains on the diagonal and cross-axis sensitivity beside it.

    Parameters
    ----------
    gain, cross : float
        Standard deviation of the gains; the cross-axis sensitivity is uniform within ± this [1].
    n_sensor : int
        Triaxial sensors.
    generator : Generator
        Draws both.

    Returns
    -------
    array, shape (n_sensor, 3, 3)
        What each axis of a sensor delivers per input along each axis [1].
    """
    diagonal = np.eye(3) * (1 + generator.normal(0, gain, (n_sensor, 1, 3)))
    beside = cross * generator.uniform(-1, 1, (n_sensor, 3, 3)) * (1 - np.eye(3))
    return np.asarray(diagonal + beside)


def measure(
    instrumentation: Instrumentation,
    run: OperatingRun,
    budget: ErrorBudget,
    generator: np.random.Generator,
) -> RawChannels:
    """Record one run with the bench's sensors.

    Parameters
    ----------
    instrumentation : Instrumentation
        The true sensors.
    run : OperatingRun
        What really happens.
    budget : ErrorBudget
        Noise and the flexibility of the bench.
    generator : Generator
        Draws the noise.
    """
    n_line = run.frequency.size
    to_acceleration = -((2 * np.pi * run.frequency[:, None]) ** 2)
    acceleration = (to_acceleration * run.powertrain.motion) @ instrumentation.sensing.T
    flexible = 1 + budget.bench_flexibility * (run.frequency / budget.bench_frequency) ** 2
    mount_force = run.powertrain.force.reshape(n_line, -1, 3)
    cell_force = np.einsum("mab,fmb->fma", instrumentation.cell_transfer, mount_force)
    cell_force = cell_force.reshape(n_line, -1) * flexible[:, None]
    side_acceleration = (
        to_acceleration * run.wheel_end.displacement * instrumentation.side_acceleration_gain
    )
    side_force = run.wheel_end.force * instrumentation.side_cell_gain
    of_acceleration = (
        budget.acceleration_own,
        budget.acceleration_norm,
        budget.acceleration_floor,
    )
    of_force = (budget.force_own, budget.force_norm, budget.force_floor)
    return RawChannels(
        frequency=run.frequency,
        acceleration=acceleration + order_noise(acceleration, 3, of_acceleration, generator),
        cell_force=cell_force + order_noise(cell_force, 3, of_force, generator),
        side_acceleration=side_acceleration
        + order_noise(side_acceleration, 1, of_acceleration, generator),
        side_force=side_force + order_noise(side_force, 1, of_force, generator),
    )


def order_noise(
    signal: ComplexArray,
    n_axis: int,
    levels: tuple[float, float, float],
    generator: np.random.Generator,
) -> ComplexArray:
    """Order-tracking leakage and floor of one kind of channel.

    Parameters
    ----------
    signal : array, shape (f, n_channel)
        Without noise, sensor after sensor.
    n_axis : int
        Channels per sensor.
    levels : (own, norm, floor)
        Noise per own amplitude [1], per norm of the sensor's axes [1], floor [unit of `signal`].
    generator : Generator
        Draws it.

    Returns
    -------
    array, shape (f, n_channel)
        Complex noise [unit of `signal`].

    Notes
    -----
    Neighbouring lines share part of their time window, hence the weights 1/2, 1, 1/2.
    """
    own, of_norm, floor = levels
    n_line, n_channel = signal.shape
    shape = (n_line + 2, n_channel)
    white = (generator.normal(size=shape) + 1j * generator.normal(size=shape)) / np.sqrt(2)
    leaked = (0.5 * white[:-2] + white[1:-1] + 0.5 * white[2:]) / np.sqrt(1.5)
    per_sensor = np.linalg.norm(signal.reshape(n_line, -1, n_axis), axis=2)
    norm = np.repeat(per_sensor, n_axis, axis=1)
    amplitude = np.sqrt((own * np.abs(signal)) ** 2 + (of_norm * norm) ** 2 + floor**2)
    return np.asarray(leaked * amplitude)


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """Measured spectra at the virtual points, in the channels of the operating run.

    Parameters
    ----------
    displacement : array, shape (f, n_channel)
        [m].
    force : array, shape (f, n_channel)
        [N].
    """

    displacement: ComplexArray
    force: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def evaluate(knowledge: LaboratoryKnowledge, raw: RawChannels) -> MeasuredRun:
    """Refer the raw channels to the virtual points.

    Parameters
    ----------
    knowledge : LaboratoryKnowledge
        Nominal geometry and measured force transfer matrices.
    raw : RawChannels
        Of one run.

    Returns
    -------
    MeasuredRun
        Powertrain mounts by axis, then the wishbone mounts by side.

    Notes
    -----
    The body's acceleration follows from all accelerometers by least squares, the force from
    ``F = FTM⁻¹ F_cell``; a wishbone mount has its own sensor and cell and needs neither.
    """
    body_acceleration = np.linalg.lstsq(knowledge.sensor_forward, raw.acceleration.T, rcond=None)[0]
    point_acceleration = (knowledge.point_forward @ body_acceleration).T
    acceleration = np.hstack([point_acceleration, raw.side_acceleration])
    n_line = raw.frequency.size
    cells = raw.cell_force.reshape(n_line, -1, 3)
    at_point = np.linalg.solve(knowledge.force_transfer, cells[..., None])[..., 0]
    return MeasuredRun(
        displacement=displacement_from_acceleration(acceleration, raw.frequency),
        force=np.hstack([at_point.reshape(n_line, -1), raw.side_force]),
    )


@dataclass(frozen=True)
class TransferErrors:
    """Errors of a reciprocal measurement of noise transfer functions.

    Parameters
    ----------
    calibration_db : float
        Standard deviation of the source's level, common to all paths of a vehicle [dB].
    relative : float
        RMS of the smooth complex error per path: position, direction [1].
    floor : float
        Of the real and of the imaginary part [Pa/N].
    n_ripple : int
        Cosines over the band that make up the smooth error.
    """

    calibration_db: float = 0.5
    relative: float = 0.05
    floor: float = 2e-5
    n_ripple: int = 6


def measured_noise_transfer(
    true: ComplexArray, errors: TransferErrors, generator: np.random.Generator
) -> ComplexArray:
    """Measure the noise transfer functions of one vehicle.

    Parameters
    ----------
    true : array, shape (f, n_path)
        [Pa/N].
    errors : TransferErrors
        How well it is measured.
    generator : Generator
        Draws the errors.

    Returns
    -------
    array, shape (f, n_path)
        [Pa/N].
    """
    n_line, n_path = true.shape
    calibration = 10 ** (generator.normal(0, errors.calibration_db) / 20)
    place = np.linspace(0, 1, n_line)
    ripples = np.cos(np.pi * np.outer(place, np.arange(errors.n_ripple)))
    smooth = ripples @ _complex_normal((errors.n_ripple, n_path), generator)
    smooth = smooth / np.sqrt(2 * errors.n_ripple)
    floor = errors.floor * _complex_normal((n_line, n_path), generator)
    measured: ComplexArray = true * calibration * (1 + errors.relative * smooth) + floor
    return measured


def _complex_normal(shape: tuple[int, int], generator: np.random.Generator) -> ComplexArray:
    """Draw standard-normal real and imaginary parts."""
    return np.asarray(generator.normal(size=shape) + 1j * generator.normal(size=shape))


MASS_TOLERANCE = 1.0
"""[kg]"""

INERTIA_TOLERANCE = 0.02
"""Of each entry, relative to the diagonal: of entry ij, relative to ``√(J_ii J_jj)`` [1]."""

CENTRE_TOLERANCE = 0.002
"""Of the centre of gravity, per axis [m]."""

WHEEL_END_TOLERANCE = 1.0
"""Of the mass of one wheel end [kg]."""

WITHIN = 0.9
"""Share of a tolerance that deviations fill, so that rounding stays inside."""


@dataclass(frozen=True, eq=False)
class DataSheet:
    """What the platform file states about the powertrain.

    Parameters
    ----------
    mass : float
        [kg].
    inertia : array, shape (3, 3)
        About the centre of gravity [kg m²].
    centre_error : array, shape (3,)
        True centre of gravity from the stated one [m]; every stated position is off by it.
    """

    mass: float
    inertia: RealArray
    centre_error: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def draw_data_sheet(bench: VirtualBench, generator: np.random.Generator) -> DataSheet:
    """Draw stated values within the tolerances around the true ones, rounded as on a sheet.

    Parameters
    ----------
    bench : VirtualBench
        With the true values.
    generator : Generator
        Draws the deviations, uniform within 90 % of the tolerances.
    """
    mass = bench.mass + WITHIN * MASS_TOLERANCE * generator.uniform(-1, 1)
    radii = np.sqrt(np.diag(bench.inertia))
    upper = np.triu(generator.uniform(-1, 1, (3, 3)))
    deviation = upper + np.triu(upper, 1).T
    inertia = bench.inertia + WITHIN * INERTIA_TOLERANCE * deviation * np.outer(radii, radii)
    return DataSheet(
        mass=round(mass, 1),
        inertia=np.round(inertia, 3),
        centre_error=np.round(WITHIN * CENTRE_TOLERANCE * generator.uniform(-1, 1, 3), 4),
    )


def draw_wheel_end_mass(bench: VirtualBench, generator: np.random.Generator) -> float:
    """Draw the stated mass of one wheel end [kg], within its tolerance around the true one."""
    true = float(bench.wheel_end.mass_matrix[0, 0])
    return round(true + WITHIN * WHEEL_END_TOLERANCE * generator.uniform(-1, 1), 1)
