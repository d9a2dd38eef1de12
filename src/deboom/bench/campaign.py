"""What a campaign measures, which errors it has, and what its sensors record."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray, checked
from deboom.bench.layout import (
    CELL_OFFSETS,
    CELL_SHARES,
    FREQUENCY,
    accelerometer_places,
    cell_places,
)
from deboom.bench.operating_run import OperatingRun, PlannedRun, static_direction_forces, true_run
from deboom.bench.powertrain import MIX, SIDES, VirtualBench, read_data
from deboom.bench.sensors import ErrorBudget, sensitivity_matrices
from deboom.bench.signals import order_noise, over_time, rotations, tacho_pulses
from deboom.physics.order_tracking import frequency_of_order
from deboom.physics.rigid_body import forward_matrices, rotation_matrix, skew

_LIMITS = (120.0, 160.0, 220.0)
_SLICES = (20.0, 60.0, 100.0, 140.0, 180.0, 220.0)

TRAINING_RUNS = tuple(
    PlannedRun(gear, torque, full_load)
    for gear in (5, 6, 7)
    for full_load, torques in ((True, _LIMITS), (False, _SLICES))
    for torque in torques
)
"""The 27 rising runs in gears 5 to 7 that mounts are characterised with."""

LOW_GEAR_RUNS = tuple(PlannedRun(gear, limit) for gear in (3, 4) for limit in _LIMITS)

FALLING_RUNS = tuple(
    PlannedRun(gear, torque, full_load, rising=False)
    for gear in (5, 6, 7)
    for torque, full_load in ((220.0, True), (100.0, False))
)


@dataclass(frozen=True)
class TimeRunPlan:
    """One run recorded over time: speeds [rpm], duration [s], sample rate [Hz], tacho pulses."""

    mount_set: str = "M1"
    run: PlannedRun = field(default_factory=lambda: PlannedRun(5, 220.0))
    first_speed: float = 1500.0
    last_speed: float = 2100.0
    duration: float = 6.0
    sample_rate: float = 16384.0
    pulses_per_revolution: int = 2


@checked(frequency="f", mount_sets="distinct")
class CampaignPlan:
    """Everything that is to be measured on one bench.

    - `mount_sets`, `runs`: names that `with_mount_set` understands, and the runs with every one of
      them.
    - `shaker_repeats`: repeats of every shaker run, between uses of the bench.
    - `time_run`: run recorded over time as well.
    - `frequency` (f,): lines of the dominant order [Hz].
    - raises InputError: a mount set that comes twice.
    """

    mount_sets: tuple[str, ...] = ("M1", "M2", "M3", "M4", "M5", MIX)
    runs: tuple[PlannedRun, ...] = (*LOW_GEAR_RUNS, *TRAINING_RUNS, *FALLING_RUNS)
    shaker_repeats: int = 3
    time_run: TimeRunPlan | None = None
    frequency: RealArray = field(default_factory=lambda: FREQUENCY)


FULL_PLAN = CampaignPlan(time_run=TimeRunPlan())
"""Five mount sets and a mix, gears 3 to 7, rising and falling, and one run over time."""


def training_plan(*mount_sets: str) -> CampaignPlan:
    """Return the plan of the 27 training runs alone, with the named mount sets."""
    return CampaignPlan(mount_sets=mount_sets, runs=TRAINING_RUNS)


def second_engine_plan(*mount_sets: str) -> CampaignPlan:
    """Return the plan of full-load ramps in gears 5 to 7 with the second engine."""
    data = read_data("second_engine.json")
    low, high, step = data["lines_Hz"]
    return CampaignPlan(
        mount_sets=mount_sets,
        runs=tuple(
            PlannedRun(gear, limit) for gear in (5, 6, 7) for limit in data["torque_limits_Nm"]
        ),
        frequency=np.linspace(low, high, round((high - low) / step) + 1),
    )


@dataclass(frozen=True)
class CampaignErrors:
    """Every error of a campaign; all are standard deviations unless said otherwise.

    - `chain`: errors of sensors, shaker and order tracking, and how the bench gives way.
    - `torque`, `static_force`: noise of the engine torque [N m] and of the quasi-static cell force
      [N], per line.
    - `side_cell_gain`, `side_cell_cross`: errors of the cells at the wishbone mounts, which no
      shaker calibrates [1]; the cross-talk is uniform within ± this.
    - `shaker_drift`, `shaker_noise`: relative change of a mount's cells from one shaker repeat to
      the next, and noise per line and channel relative to the answer of the cell [1].
    - `curve_scale`: scale error of a supplier's force-deflection curve, one per curve [1].
    - `data_sheet`: whether the powertrain's data are stated within their tolerances, or exactly.
    """

    chain: ErrorBudget = field(default_factory=ErrorBudget)
    torque: float = 1.0
    static_force: float = 5.0
    side_cell_gain: float = 0.005
    side_cell_cross: float = 0.005
    shaker_drift: float = 0.001
    shaker_noise: float = 0.001
    curve_scale: float = 0.03
    data_sheet: bool = True


_CALIBRATED = ("cell_gain", "cell_cross", "cell_shunt")
_NO_ERROR = ("bench_frequency", "bench_flexibility", "tilt", "chain", "data_sheet")


def _zeros(errors: type[ErrorBudget | CampaignErrors]) -> dict[str, Any]:
    """Return zeros for everything that is an error and is not calibrated."""
    kept = (*_CALIBRATED, *_NO_ERROR)
    return {field.name: 0.0 for field in fields(errors) if field.name not in kept}


NO_ERRORS = CampaignErrors(
    chain=replace(ErrorBudget(), **_zeros(ErrorBudget)),
    data_sheet=False,
    **_zeros(CampaignErrors),
)
"""Nothing is wrong or noisy; gain, cross-talk and shunt of cells stay, and the bench gives way."""


ANGLE_DIGITS = 1
"""The position sheet states angles to 0.1 degree."""

SIDE_CELL_ANGLES = (0.0, 8.0, 5.0)
"""The cells lie on the mounting face of the wishbone: about x, y, z [deg]."""

SPEED_STEP = 10.0
"""Between the steady states that a run over time passes through [rpm]."""

OTHER_ORDERS = ((0.5, 0.10, 0.7), (3.0, 0.30, -1.1), (6.0, 0.15, 2.0))
"""Engine order, amplitude per amplitude of the dominant order, and phase against it [rad]."""

PULSE_SHARE = 0.25
"""Share of a tacho period that its pulse takes [1]."""

EDGE_SAMPLES = 1.5
"""Width of a pulse's edges in samples [1]: the recorder's filter."""


@dataclass(frozen=True, eq=False)
class CampaignSensors:
    """What all sensors of a bench truly do, drawn once for all its runs.

    - `accelerometer_angles`, `cell_angles` (n_sensor, 3): known orientations, about the fixed axes
      x, then y, then z [deg].
    - `true_positions` (n_accelerometer, 3): positions of the accelerometers [m].
    - `true_orientations` (n_accelerometer, 3, 3): orientations; columns are the sensor's axes [1].
    - `sensitivity` (n_accelerometer, 3, 3): gain and cross-axis sensitivity [1].
    - `cells` (n_mount, n_cell, 3, 3): force at the virtual point of a powertrain mount → channels
      of each of its cells [1].
    - `side_cells` (n_side, 3, 3): force on a wishbone mount → channels of its cell [1].
    - `pushes` (n_mount, 3, 3): column a is the force at the virtual point per newton that the
      shaker states along a [1].
    - `drift` (n_mount,): relative change of the cells from one shaker repeat to the next [1].
    """

    accelerometer_angles: RealArray
    cell_angles: RealArray
    true_positions: RealArray
    true_orientations: RealArray
    sensitivity: RealArray
    cells: RealArray
    side_cells: RealArray
    pushes: RealArray
    drift: RealArray


def draw_campaign_sensors(
    bench: VirtualBench,
    errors: CampaignErrors,
    seed: np.random.SeedSequence,
) -> CampaignSensors:
    """Mount accelerometers, cells and shaker with their errors.

    The seed draws accelerometers, cells and shaker independently of each other.
    """
    chain = errors.chain
    for_accelerometers, for_cells, for_shaker = map(np.random.default_rng, seed.spawn(3))

    nominal = np.array([place.position for place in accelerometer_places(bench)])
    angles = _known_angles(len(nominal), chain.tilt, for_accelerometers)
    stated_orientations = Rotation.from_matrix(rotation_matrix(np.deg2rad(angles)))
    turned = Rotation.from_rotvec(for_accelerometers.normal(0, chain.angle, nominal.shape))
    placed = nominal + for_accelerometers.normal(0, chain.position, nominal.shape)
    sensitivity = sensitivity_matrices(
        chain.gain, chain.cross_axis, len(nominal), for_accelerometers
    )

    n_mount = len(bench.mount_names)
    n_cell = len(cell_places(bench)) - len(SIDES)
    side_angles = np.tile(SIDE_CELL_ANGLES, (len(SIDES), 1))
    cell_angles = np.vstack([_known_angles(n_cell, 0.0, for_cells), side_angles])
    turns = np.asarray(rotation_matrix(np.deg2rad(cell_angles))).swapaxes(1, 2)
    gains = sensitivity_matrices(chain.cell_gain, chain.cell_cross, n_cell, for_cells)
    in_parallel = (gains - chain.cell_shunt * np.eye(3)) @ turns[:n_cell]
    shares = [load_distribution(np.array(CELL_OFFSETS[name])) for name in bench.mount_names]
    cells = in_parallel.reshape(n_mount, -1, 3, 3) @ np.array(shares)
    side_gains = sensitivity_matrices(
        errors.side_cell_gain, errors.side_cell_cross, len(SIDES), for_cells
    )

    misaligned = Rotation.from_rotvec(for_shaker.normal(0, chain.shaker_angle, (3 * n_mount, 3)))
    directions = misaligned.apply(np.tile(np.eye(3), (n_mount, 1))).reshape(n_mount, 3, 3)
    stated = 1 + for_shaker.normal(0, chain.shaker_gain, (n_mount, 3))
    drift = for_shaker.normal(0, errors.shaker_drift, n_mount)
    return CampaignSensors(
        accelerometer_angles=angles,
        cell_angles=cell_angles,
        true_positions=placed,
        true_orientations=(stated_orientations * turned).as_matrix(),
        sensitivity=sensitivity,
        cells=cells,
        side_cells=side_gains @ turns[n_cell:],
        pushes=directions.swapaxes(1, 2) / stated[:, None, :],
        drift=drift,
    )


def load_distribution(offsets: RealArray) -> RealArray:
    """Distribute a force at a virtual point over the two cells below it.

    - `offsets` (2, 3): places of the cells from the virtual point [m].
    - returns (2, 3, 3): force → force on each cell; they add up to the identity [1].

    A rigid adapter on cells of the stiffness shares w_i, at d_i from their centre c, under the
    force f::

        F_i = w_i (f + θ × d_i),  θ = -(Σ w_i d̃_iᵀ d̃_i)⁺ (c × f)

    A moment about the line through two cells is carried inside the cells and not measured.
    """
    shares = np.array(CELL_SHARES)
    centre = shares @ offsets
    arms = skew(offsets - centre)
    turning = np.einsum("c,cba,cbd->ad", shares, arms, arms)
    by_moment = np.linalg.pinv(turning, rcond=1e-9, hermitian=True)
    by_force = -by_moment @ skew(centre)
    return np.asarray(shares[:, None, None] * (np.eye(3) - arms @ by_force))


def clean_channels(
    sensors: CampaignSensors, run: OperatingRun, chain: ErrorBudget
) -> tuple[ComplexArray, ComplexArray]:
    """Find what accelerometers [m/s²] and cells [N] deliver of a run without any noise."""
    n_line, n_side = run.frequency.size, len(SIDES)
    orientations, sensitivity = sensors.true_orientations, sensors.sensitivity
    felt = forward_matrices(sensors.true_positions[:-n_side], orientations[:-n_side])
    sensing = (sensitivity[:-n_side] @ felt.reshape(-1, 3, 6)).reshape(-1, 6)
    # a wheel end moves along x alone
    side_sensing = (sensitivity[-n_side:] @ orientations[-n_side:].swapaxes(1, 2))[:, :, 0]
    to_acceleration = -((2 * np.pi * run.frequency[:, None]) ** 2)
    powertrain = (to_acceleration * run.powertrain.motion) @ sensing.T
    sides = (to_acceleration * run.wheel_end.displacement) * side_sensing.reshape(1, -1)
    force = run.powertrain_force.reshape(n_line, -1, 3)
    cells = np.einsum("mcab,fmb->fmca", sensors.cells, force).reshape(n_line, -1)
    side_cells = run.wheel_end.force * sensors.side_cells[:, :, 0].reshape(1, -1)
    flexible = chain.flexibility(run.frequency)[:, None]
    return np.hstack([powertrain, sides]), np.hstack([flexible * cells, side_cells])


def record(
    sensors: CampaignSensors,
    run: OperatingRun,
    static_force: RealArray,
    errors: CampaignErrors,
    generator: np.random.Generator,
) -> dict[str, RealOrComplexArray]:
    """Record one run over the lines of its order; its static force is (f, n_direction) [N].

    - returns (f, n_channel): ``acceleration`` [m/s²] and ``cell force`` [N] in sensor axes,
      quasi-static ``static force`` of each direction, both wishbone mounts last [N], and ``engine
      torque`` [N m].
    """
    chain = errors.chain
    acceleration, cell_force = clean_channels(sensors, run, chain)
    torque = run.engine_torque[:, None]
    return {
        "acceleration": acceleration
        + order_noise(acceleration, 3, chain.acceleration_noise, generator),
        "cell force": cell_force + order_noise(cell_force, 3, chain.force_noise, generator),
        "static force": static_force + generator.normal(0, errors.static_force, static_force.shape),
        "engine torque": torque + generator.normal(0, errors.torque, torque.shape),
    }


def record_over_time(
    bench: VirtualBench,
    sensors: CampaignSensors,
    plan: TimeRunPlan,
    errors: CampaignErrors,
    generator: np.random.Generator,
) -> tuple[dict[str, RealArray], dict[str, Any]]:
    """Run up or down and record over time.

    The run is so slow that every speed is a steady state of its own; amplitude and phase of each
    channel change smoothly with the speed.

    - returns (n_sample, n_channel): channels as of `record`, and ``tacho`` pulses from 0 to 1 whose
      first rising edge is the origin of all phases.
    - returns: truth: ``time`` [s] and ``speed`` [rpm] of every sample; the steady states that it
      passes through, over their ``frequency`` of the dominant order, channels without noise.
    """
    chain, order = errors.chain, bench.order_torque.order
    low, high = sorted((plan.first_speed, plan.last_speed))
    rpm = np.arange(low, high + SPEED_STEP, SPEED_STEP)
    steady = true_run(bench, plan.run, frequency_of_order(rpm, order))
    acceleration, cell_force = clean_channels(sensors, steady, chain)

    time = np.arange(round(plan.duration * plan.sample_rate)) / plan.sample_rate
    slope = (plan.last_speed - plan.first_speed) / plan.duration
    speed = plan.first_speed + slope * time
    turns = (plan.first_speed * time + slope * time**2 / 2) / 60
    # the record starts between two pulses
    angle = 2 * np.pi * (turns - 0.5 / plan.pulses_per_revolution)
    period = 2 * np.pi / plan.pulses_per_revolution
    turning = rotations(angle, order, OTHER_ORDERS)

    def channels(spectra: ComplexArray, floor: float) -> RealArray:
        return over_time((rpm, spectra), speed, turning, floor, plan.sample_rate, generator)

    torque = CubicSpline(rpm, steady.engine_torque)(speed)
    torque = torque + generator.normal(0, errors.torque, time.shape)
    preload = CubicSpline(rpm, static_direction_forces(bench, steady))(speed)
    edge = EDGE_SAMPLES * np.gradient(angle) / period
    recorded = {
        "acceleration": channels(acceleration, chain.acceleration_floor),
        "cell force": channels(cell_force, chain.force_floor),
        "static force": preload + generator.normal(0, errors.static_force, preload.shape),
        "engine torque": torque[:, None],
        "tacho": tacho_pulses(angle / period, edge, PULSE_SHARE)[:, None],
    }
    truth = {
        "frequency": steady.frequency,
        "acceleration": acceleration,
        "cell_force": cell_force,
        "channels": np.array(steady.channels),
        "displacement": steady.displacement,
        "force": steady.force,
        "stiffness": steady.stiffness,
        "engine_torque": steady.engine_torque,
        "time": time,
        "speed": speed,
    }
    return recorded, truth


def push_answer(
    sensors: CampaignSensors,
    mount: int,
    load: RealArray,
    repeat: int,
    frequency: RealArray,
    errors: CampaignErrors,
    generator: np.random.Generator,
) -> ComplexArray:
    """Push with the shaker at the virtual point of one mount.

    The load per stated newton is a force (3,) of `sensors`; the cells drift from one repeat to the
    next.

    - returns (f, n_channel): channels of the mount's cells per stated newton [1].
    """
    answer = (sensors.cells[mount] @ load).reshape(-1)
    answer = answer * (1 + sensors.drift[mount] * (repeat - 1))
    clean = np.outer(errors.chain.flexibility(frequency), answer).astype(complex)
    return clean + order_noise(clean, 3, (0.0, errors.shaker_noise, 0.0), generator)


def _known_angles(n_sensor: int, tilt: float, generator: np.random.Generator) -> RealArray:
    """Quarter turns about z and a tilt [rad], as the position sheet states them [deg]."""
    angles = np.rad2deg(generator.normal(0, tilt, (n_sensor, 3)))
    angles[:, 2] += 90.0 * generator.integers(4, size=n_sensor)
    return np.asarray(np.round(angles, ANGLE_DIGITS))
