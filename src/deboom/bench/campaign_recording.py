"""What the campaign's sensors record: runs over lines and over time, shaker runs and pushes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.bench.campaign_plan import CampaignErrors, TimeRunPlan
from deboom.bench.layout import (
    CELL_SHARES,
    THREE_CELL_SHARES,
    accelerometer_places,
    cell_offsets,
    cell_places,
    push_places,
)
from deboom.bench.operating_run import SIDES, OperatingRun, static_direction_forces, true_run
from deboom.bench.powertrain import VirtualBench
from deboom.bench.sensors import ErrorBudget, sensitivity_matrices
from deboom.bench.signals import order_noise, over_time, rotations, tacho_pulses
from deboom.physics.order_tracking import frequency_of_order
from deboom.physics.rigid_body import forward_matrices, rotation_matrix, skew

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
    - `cells` (n_mount, n_cell, 3, 3 or 6): force at the virtual point of a powertrain mount →
      channels of each of its cells; with a third cell the moment as well [1, 1/m].
    - `side_cells` (n_side, 3, 3): force on a wishbone mount → channels of its cell [1].
    - `pushes` (n_mount, 3, 3): column a is the force at the virtual point per newton that the
      shaker states along a [1].
    - `drift` (n_mount,): relative change of the cells from one shaker repeat to the next [1].
    - `moment_pushes` (n_mount, n_push, 6): force and moment at the virtual point per newton that is
      stated of each push beside it, in the order of `deboom.bench.layout.push_places`; none without
      a third cell [1, m].
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
    moment_pushes: RealArray

    @property
    def third_cell(self) -> bool:
        """Whether the cells of a mount show moments."""
        return bool(self.cells.shape[-1] == 6)


def draw_campaign_sensors(
    bench: VirtualBench,
    errors: CampaignErrors,
    seed: np.random.SeedSequence,
    third_cell: bool = False,
) -> CampaignSensors:
    """Mount accelerometers, cells and shaker with their errors.

    The seed draws accelerometers, cells and shaker independently of each other. With a third cell,
    three cells are below every powertrain mount, and there are pushes beside its virtual point.
    """
    chain = errors.chain
    for_accelerometers, for_cells, for_shaker = map(np.random.default_rng, seed.spawn(3))

    nominal = np.array([place.position for place in accelerometer_places(bench)])
    angles = _known_angles(len(nominal), chain.tilt, for_accelerometers)
    known = Rotation.from_matrix(rotation_matrix(np.deg2rad(angles)))
    turned = Rotation.from_rotvec(for_accelerometers.normal(0, chain.angle, nominal.shape))
    placed = nominal + for_accelerometers.normal(0, chain.position, nominal.shape)
    sensitivity = sensitivity_matrices(
        chain.gain, chain.cross_axis, len(nominal), for_accelerometers
    )

    n_mount = len(bench.mount_names)
    n_cell = len(cell_places(bench, third_cell)) - len(SIDES)
    side_angles = np.tile(SIDE_CELL_ANGLES, (len(SIDES), 1))
    cell_angles = np.vstack([_known_angles(n_cell, 0.0, for_cells), side_angles])
    turns = np.asarray(rotation_matrix(np.deg2rad(cell_angles))).swapaxes(1, 2)
    gains = sensitivity_matrices(chain.cell_gain, chain.cell_cross, n_cell, for_cells)
    in_parallel = (gains - chain.cell_shunt * np.eye(3)) @ turns[:n_cell]
    n_load = 6 if third_cell else 3
    shares = [
        load_distribution(cell_offsets(name, third_cell))[:, :, :n_load]
        for name in bench.mount_names
    ]
    cells = in_parallel.reshape(n_mount, -1, 3, 3) @ np.array(shares)
    side_gains = sensitivity_matrices(
        errors.side_cell_gain, errors.side_cell_cross, len(SIDES), for_cells
    )

    misaligned = Rotation.from_rotvec(for_shaker.normal(0, chain.shaker_angle, (3 * n_mount, 3)))
    directions = misaligned.apply(np.tile(np.eye(3), (n_mount, 1))).reshape(n_mount, 3, 3)
    stated = 1 + for_shaker.normal(0, chain.shaker_gain, (n_mount, 3))
    drift = for_shaker.normal(0, errors.shaker_drift, n_mount)
    beside = _pushed_loads(bench, chain, for_shaker) if third_cell else np.zeros((n_mount, 0, 6))
    return CampaignSensors(
        accelerometer_angles=angles,
        cell_angles=cell_angles,
        true_positions=placed,
        true_orientations=(known * turned).as_matrix(),
        sensitivity=sensitivity,
        cells=cells,
        side_cells=side_gains @ turns[n_cell:],
        pushes=directions.swapaxes(1, 2) / stated[:, None, :],
        drift=drift,
        moment_pushes=beside,
    )


def load_distribution(offsets: RealArray) -> RealArray:
    """Distribute force and moment at a virtual point over the cells below it.

    - `offsets` (n_cell, 3): places of two or three cells from the virtual point [m].
    - returns (n_cell, 3, 6): three forces and three moments → force on each cell; the forces add up
      to the identity [1, 1/m].

    A rigid adapter on cells of the stiffness shares w_i, at d_i from their centre c, under the
    force f and the moment m::

        F_i = w_i (f + θ × d_i),  θ = (Σ w_i d̃_iᵀ d̃_i)⁺ (m - c × f)

    A moment about the line through two cells is carried inside the cells and not measured.
    """
    shares = np.array(CELL_SHARES if len(offsets) == len(CELL_SHARES) else THREE_CELL_SHARES)
    centre = shares @ offsets
    arms = skew(offsets - centre)
    turning = np.einsum("c,cba,cbd->ad", shares, arms, arms)
    by_moment = np.linalg.pinv(turning, rcond=1e-9, hermitian=True)
    by_force = -by_moment @ skew(centre)
    of_force = shares[:, None, None] * (np.eye(3) - arms @ by_force)
    of_moment = -shares[:, None, None] * (arms @ by_moment)
    return np.concatenate([of_force, of_moment], axis=2)


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
    force = run.powertrain.force.reshape(n_line, -1, 3)
    if sensors.third_cell:
        force = np.concatenate([force, run.moment], axis=2)
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
    """Push with the shaker at or beside the virtual point of one mount.

    The load per stated newton is a force (3,), or force and moment (6,), of `sensors`; the cells
    drift from one repeat to the next.

    - returns (f, n_channel): channels of the mount's cells per stated newton [1].
    """
    answer = (sensors.cells[mount, ..., : load.size] @ load).reshape(-1)
    answer = answer * (1 + sensors.drift[mount] * (repeat - 1))
    clean = np.outer(errors.chain.flexibility(frequency), answer).astype(complex)
    return clean + order_noise(clean, 3, (0.0, errors.shaker_noise, 0.0), generator)


def _pushed_loads(
    bench: VirtualBench, chain: ErrorBudget, generator: np.random.Generator
) -> RealArray:
    """Load at the virtual point per newton stated, of a shaker that is a little askew and off."""
    pushes = push_places(bench)
    size = (len(pushes), 3)
    turned = Rotation.from_rotvec(generator.normal(0, chain.shaker_angle, size))
    directions = turned.apply([push.vector for push in pushes])
    arms = np.array([push.offset for push in pushes]) + generator.normal(0, chain.position, size)
    stated = 1 + generator.normal(0, chain.shaker_gain, (len(pushes), 1))
    loads = np.hstack([directions, np.cross(arms, directions)]) / stated
    return np.asarray(loads.reshape(len(bench.mount_names), -1, 6))


def _known_angles(n_sensor: int, tilt: float, generator: np.random.Generator) -> RealArray:
    """Quarter turns about z and a tilt [rad], as the position sheet states them [deg]."""
    angles = np.rad2deg(generator.normal(0, tilt, (n_sensor, 3)))
    angles[:, 2] += 90.0 * generator.integers(4, size=n_sensor)
    return np.asarray(np.round(angles, ANGLE_DIGITS))
