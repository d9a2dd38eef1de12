"""A campaign on the virtual bench in memory, with its truth: many seeds without any file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.campaign import (
    CampaignErrors,
    CampaignSensors,
    draw_campaign_sensors,
    push_answer,
    record,
)
from deboom.bench.layout import (
    ACCELEROMETER_MODEL,
    CELL_MODEL,
    FREQUENCY,
    WISHBONE_POSITIONS,
    Place,
    accelerometer_places,
    cell_places,
)
from deboom.bench.operating_run import OperatingRun as TrueRun
from deboom.bench.operating_run import PlannedRun, static_direction_forces, true_run
from deboom.bench.powertrain import AXES, load_bench, with_mount_set
from deboom.bench.sensors import CENTRE_TOLERANCE, INERTIA_TOLERANCE, MASS_TOLERANCE
from deboom.measurement.campaign import Campaign, OperatingRun, ShakerRun, StaticCurve
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import Sensor, SensorKind, Tolerances
from deboom.mounts.mount import Mount
from deboom.physics.rigid_body import rotation_matrix

BENCH = load_bench()
REPEATS = 3
CURVE = np.linspace(-0.015, 0.015, 301)


@cache
def truth(parts: str, planned: PlannedRun) -> tuple[TrueRun, RealArray]:
    """Run the bench as it truly is, with one mount set; also the static force of every channel."""
    bench = with_mount_set(BENCH, parts)
    run = true_run(bench, planned, FREQUENCY)
    return run, static_direction_forces(bench, run)


def virtual_campaign(
    seed: int, parts: str, runs: Sequence[PlannedRun], errors: CampaignErrors
) -> Campaign:
    """Measure a campaign with one mount set; positions count from the true centre of gravity."""
    generator = np.random.default_rng(seed)
    true = draw_campaign_sensors(BENCH, errors, np.random.SeedSequence(seed))
    accelerometers = _sensors(
        accelerometer_places(BENCH),
        true.accelerometer_angles,
        SensorKind.ACCELEROMETER,
        ACCELEROMETER_MODEL,
    )
    cells = _sensors(cell_places(BENCH), true.cell_angles, SensorKind.FORCE_CELL, CELL_MODEL)
    mounts = [
        Mount(name, "", ("",), (tuple(position.tolist()),), AXES)
        for name, position in zip(BENCH.mount_names, BENCH.positions, strict=True)
    ]
    return Campaign(
        name=f"bench {seed}",
        mounts=(*mounts, Mount("Du", "", ("left", "right"), WISHBONE_POSITIONS, ("x",))),
        powertrain_mounts=BENCH.mount_names,
        sensors=(*accelerometers, *cells),
        switched_off=(),
        mount_sets=(parts,),
        runs=tuple(
            _run(true, accelerometers, cells, parts, planned, errors, generator) for planned in runs
        ),
        shaker_runs=_shaker_runs(true, cells, errors, generator),
        static_curves=_curves(parts, errors, generator),
        mass_matrix=BENCH.powertrain.mass_matrix,
        mass_tolerance=MASS_TOLERANCE,
        inertia_tolerance=INERTIA_TOLERANCE,
        centre_of_gravity_tolerance=CENTRE_TOLERANCE,
        total_ratios=BENCH.total_ratios,
        order=BENCH.order_torque.order,
        tolerances=_tolerances(errors),
        input_files=(),
    )


def _sensors(
    places: Sequence[Place], angles: RealArray, kind: SensorKind, model: str
) -> tuple[Sensor, ...]:
    return tuple(
        Sensor(
            place.name,
            kind,
            model,
            place.point.mount,
            place.point.piece,
            place.position,
            rotation_matrix(np.deg2rad(turned)),
        )
        for place, turned in zip(places, angles, strict=True)
    )


def _run(
    true: CampaignSensors,
    accelerometers: Sequence[Sensor],
    cells: Sequence[Sensor],
    parts: str,
    planned: PlannedRun,
    errors: CampaignErrors,
    generator: np.random.Generator,
) -> OperatingRun:
    run, static_force = truth(parts, planned)
    read = record(true, run, static_force, errors, generator)
    return OperatingRun(
        name=planned.name,
        mount_set=parts,
        gear=planned.gear,
        total_ratio=BENCH.total_ratios[planned.gear - 1],
        full_load=planned.full_load,
        torque_limit=planned.torque,
        rising=planned.rising,
        order=BENCH.order_torque.order,
        engine_torque=read["engine torque"][:, 0].real,
        acceleration=Spectrum(FREQUENCY, read["acceleration"], _channels(accelerometers), "m/s^2"),
        cell_force=Spectrum(FREQUENCY, read["cell force"], _channels(cells), "N"),
        static_force=read["static force"].real,
        static_force_names=run.channels,
    )


def _channels(sensors: Sequence[Sensor]) -> tuple[str, ...]:
    return tuple(channel for sensor in sensors for channel in sensor.channels)


def _shaker_runs(
    true: CampaignSensors,
    cells: Sequence[Sensor],
    errors: CampaignErrors,
    generator: np.random.Generator,
) -> tuple[ShakerRun, ...]:
    runs = []
    for place, mount in enumerate(BENCH.mount_names):
        channels = _channels([cell for cell in cells if cell.mount == mount])
        for column, axis in enumerate(AXES):
            for repeat in range(1, REPEATS + 1):
                answer = push_answer(
                    true, place, true.pushes[place, :, column], repeat, FREQUENCY, errors, generator
                )
                response = Frf(
                    FREQUENCY, answer[:, :, np.newaxis], channels, (f"{mount} {axis}",), "N/N"
                )
                runs.append(ShakerRun(mount, "", axis, repeat, response))
    return tuple(runs)


def _curves(
    parts: str, errors: CampaignErrors, generator: np.random.Generator
) -> tuple[StaticCurve, ...]:
    bench = with_mount_set(BENCH, parts)
    curves = []
    for mount in bench.powertrain.mounts:
        for axis, law in zip(AXES, mount.laws, strict=True):
            scale = 1 + generator.normal(0, errors.curve_scale)
            force = scale * law.static_force(CURVE)
            curves.append(StaticCurve(mount.name, axis, parts, CURVE, force, errors.curve_scale))
    return tuple(curves)


def _tolerances(errors: CampaignErrors) -> Tolerances:
    chain = errors.chain
    return Tolerances(
        sensor_position=chain.position,
        sensor_angle=chain.angle,
        sensor_gain=chain.gain,
        # any value within ± the limit is as likely
        sensor_cross_axis=chain.cross_axis / np.sqrt(3),
        acceleration_own=chain.acceleration_own,
        acceleration_norm=chain.acceleration_norm,
        acceleration_floor=chain.acceleration_floor,
        cell_gain=errors.side_cell_gain,
        force_own=chain.force_own,
        force_norm=chain.force_norm,
        force_floor=chain.force_floor,
        shaker_angle=chain.shaker_angle,
        shaker_gain=chain.shaker_gain,
        torque=errors.torque,
        static_force=errors.static_force,
    )
