"""Sensors of the platform's bench with their errors, what a laboratory makes of them, data sheets.

Six triaxial accelerometers on the powertrain (two at each mount), a triaxial force cell under each
mount, and one accelerometer and one cell on each wishbone mount.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.layout import accelerometer_places
from deboom.bench.operating_run import OperatingRun
from deboom.bench.powertrain import SIDES, VirtualBench
from deboom.bench.signals import complex_normal, order_noise, ripple
from deboom.physics.dynamic_stiffness import displacement_from_acceleration
from deboom.physics.rigid_body import forward_matrices

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


@dataclass(frozen=True)
class ErrorBudget:
    """Standard deviations of every error of the bench's measuring chain.

    - `position`, `angle`: place and direction of an accelerometer against its drawing [m], [rad].
    - `gain`, `cross_axis`: gain of an accelerometer [1]; its cross-axis sensitivity is uniform
      within ± this.
    - `acceleration_own`, `acceleration_norm`, `acceleration_floor`: order-tracking noise per own
      channel [1], per norm of the triaxial sensor [1], floor [m/s²].
    - `cell_gain`, `cell_cross`, `cell_shunt`: scatter of a force cell, cross-talk (uniform within
      ±), force that bypasses it [1].
    - `force_own`, `force_norm`, `force_floor`: order-tracking noise of a cell [1], [1], [N].
    - `shaker_angle`, `shaker_gain`: errors of the shaker that calibrates the cells at the virtual
      point [rad], [1].
    - `bench_frequency`, `bench_flexibility`: first mode of the bench [Hz] and how much it adds to
      the force there [1].
    - `tilt`: spread of the accelerometers' known orientations about right angles [rad].
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

    @property
    def acceleration_noise(self) -> tuple[float, float, float]:
        """Levels of `order_noise` for accelerometers."""
        return self.acceleration_own, self.acceleration_norm, self.acceleration_floor

    @property
    def force_noise(self) -> tuple[float, float, float]:
        """Levels of `order_noise` for force cells."""
        return self.force_own, self.force_norm, self.force_floor

    def flexibility(self, frequency: RealArray) -> RealArray:
        """Return the force on the cells per force on a rigid bench, below its first mode [1]."""
        return np.asarray(1 + self.bench_flexibility * (frequency / self.bench_frequency) ** 2)


@dataclass(frozen=True, eq=False)
class Instrumentation:
    """What the sensors truly do, and what the laboratory believes of them.

    - `sensing` (n_channel, 6): acceleration of the powertrain → channels of the accelerometers.
    - `cell_transfer` (n_mount, 3, 3): force at the virtual point → channels of the cell.
    - `side_acceleration_gain`, `side_cell_gain` (n_side,): gains of the sensors on the wishbone
      mounts.
    - `sensor_forward` (n_channel, 6): forward matrix of the accelerometers' nominal positions and
      orientations.
    - `point_forward` (3 n_mount, 6): forward matrix of the mounts' virtual points.
    - `force_transfer` (n_mount, 3, 3): force transfer matrices, measured with the shaker.
    """

    sensing: RealArray
    cell_transfer: RealArray
    side_acceleration_gain: RealArray
    side_cell_gain: RealArray
    sensor_forward: RealArray
    point_forward: RealArray
    force_transfer: RealArray


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """Measured displacement [m] and force [N] at the virtual points, in the true channels."""

    displacement: ComplexArray
    force: ComplexArray


def draw_instrumentation(
    bench: VirtualBench, budget: ErrorBudget, generator: np.random.Generator
) -> Instrumentation:
    """Mount the sensors with errors as large as a budget says."""
    sides = len(SIDES)
    nominal = np.array([place.position for place in accelerometer_places(bench)])[:-sides]
    n_sensor, n_mount = len(nominal), len(bench.positions)
    quarter_turns = np.pi / 2 * generator.integers(4, size=n_sensor)
    upright = Rotation.from_rotvec(np.outer(quarter_turns, [0.0, 0.0, 1.0]))
    tilted = Rotation.from_rotvec(generator.normal(0, budget.tilt, (n_sensor, 3)))
    stated = upright * tilted
    placed = nominal + generator.normal(0, budget.position, nominal.shape)
    true = stated * Rotation.from_rotvec(generator.normal(0, budget.angle, (n_sensor, 3)))
    sensitivity = sensitivity_matrices(budget.gain, budget.cross_axis, n_sensor, generator)
    felt = forward_matrices(placed, true.as_matrix()).reshape(n_sensor, 3, 6)

    cells = sensitivity_matrices(budget.cell_gain, budget.cell_cross, n_mount, generator)
    cells = cells - budget.cell_shunt * np.eye(3)
    misaligned = Rotation.from_rotvec(generator.normal(0, budget.shaker_angle, (n_mount * 3, 3)))
    pushes = misaligned.apply(np.tile(np.eye(3), (n_mount, 1))).reshape(n_mount, 3, 3)
    shaker_gain = 1 + generator.normal(0, budget.shaker_gain, (n_mount, 3))
    return Instrumentation(
        sensing=(sensitivity @ felt).reshape(3 * n_sensor, 6),
        cell_transfer=cells,
        side_acceleration_gain=1 + generator.normal(0, budget.gain, sides),
        side_cell_gain=1 + generator.normal(0, budget.shaker_gain, sides),
        sensor_forward=forward_matrices(nominal, stated.as_matrix()),
        point_forward=forward_matrices(bench.positions),
        # column a = what the cell answers to a push along a, per newton that the shaker states
        force_transfer=cells @ pushes.swapaxes(1, 2) / shaker_gain[:, None, :],
    )


def sensitivity_matrices(
    gain: float, cross: float, n_sensor: int, generator: np.random.Generator
) -> RealArray:
    """Draw gains on the diagonal, and uniform cross-axis sensitivity beside it, (n, 3, 3)."""
    diagonal = np.eye(3) * (1 + generator.normal(0, gain, (n_sensor, 1, 3)))
    beside = cross * generator.uniform(-1, 1, (n_sensor, 3, 3)) * (1 - np.eye(3))
    return np.asarray(diagonal + beside)


def measured_run(
    instrumentation: Instrumentation,
    run: OperatingRun,
    budget: ErrorBudget,
    generator: np.random.Generator,
    dead: int | None = None,
) -> MeasuredRun:
    """Record one run with the bench's sensors and refer the channels to the virtual points.

    The body's acceleration follows from all accelerometers but a `dead` one by least squares, the
    force from ``F = FTM⁻¹ F_cell``; a wishbone mount has its own sensor and cell and needs neither.
    """
    n_line = run.frequency.size
    to_acceleration = -((2 * np.pi * run.frequency[:, None]) ** 2)
    clean = (to_acceleration * run.powertrain.motion) @ instrumentation.sensing.T
    mount_force = run.powertrain_force.reshape(n_line, -1, 3)
    cells = np.einsum("mab,fmb->fma", instrumentation.cell_transfer, mount_force)
    cells = cells.reshape(n_line, -1) * budget.flexibility(run.frequency)[:, None]
    side_clean = (
        to_acceleration * run.wheel_end.displacement * instrumentation.side_acceleration_gain
    )
    side_force = run.wheel_end.force * instrumentation.side_cell_gain
    acceleration = clean + order_noise(clean, 3, budget.acceleration_noise, generator)
    cells = cells + order_noise(cells, 3, budget.force_noise, generator)
    side = side_clean + order_noise(side_clean, 1, budget.acceleration_noise, generator)
    side_force = side_force + order_noise(side_force, 1, budget.force_noise, generator)

    kept = np.arange(clean.shape[1] // 3) != (-1 if dead is None else dead)
    alive = np.repeat(kept, 3)
    forward, seen = instrumentation.sensor_forward[alive], acceleration[:, alive]
    body = np.linalg.lstsq(forward, seen.T, rcond=None)[0]
    at_points = np.hstack([(instrumentation.point_forward @ body).T, side])
    by_mount = cells.reshape(n_line, -1, 3)[..., None]
    force = np.linalg.solve(instrumentation.force_transfer, by_mount)[..., 0]
    return MeasuredRun(
        displacement=displacement_from_acceleration(at_points, run.frequency),
        force=np.hstack([force.reshape(n_line, -1), side_force]),
    )


@dataclass(frozen=True)
class TransferErrors:
    """Errors of a reciprocal measurement of noise transfer functions.

    Deviation of the source's level, common to all paths of a vehicle [dB]; rms of the smooth
    complex error per path [1], made of cosines over the band; floor of real and imaginary part
    [Pa/N].
    """

    calibration_db: float = 0.5
    relative: float = 0.05
    floor: float = 2e-5
    n_ripple: int = 6


def measured_noise_transfer(
    true: ComplexArray, errors: TransferErrors, generator: np.random.Generator
) -> ComplexArray:
    """Measure the noise transfer functions of one vehicle, shape (f, n_path) [Pa/N]."""
    n_line, n_path = true.shape
    calibration = 10 ** (generator.normal(0, errors.calibration_db) / 20)
    smooth = ripple(n_line, errors.n_ripple, n_path, generator)
    floor = errors.floor * complex_normal((n_line, n_path), generator)
    measured: ComplexArray = true * calibration * (1 + errors.relative * smooth) + floor
    return measured


@dataclass(frozen=True, eq=False)
class DataSheet:
    """What a data sheet states: mass [kg], and inertia about the centre of gravity [kg m²].

    Every stated position is off by the error of the centre: the true one from the stated one [m].
    """

    mass: float
    inertia: RealArray
    centre_error: RealArray


def exact_data_sheet(bench: VirtualBench) -> DataSheet:
    """Return the data sheet that states the truth."""
    return DataSheet(bench.mass, bench.inertia, np.zeros(3))


def draw_data_sheet(bench: VirtualBench, generator: np.random.Generator) -> DataSheet:
    """Draw stated values within 90 % of the tolerances around the true ones, and round them."""
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
