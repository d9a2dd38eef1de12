"""The campaign's tables and ``campaign.toml``: what the laboratory states of bench and runs."""

from __future__ import annotations

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.campaign_layout import (
    ACCELEROMETER_MODEL,
    CELL_MODEL,
    Place,
    PushPlace,
    accelerometer_places,
    cell_places,
    push_places,
)
from deboom.bench.campaign_plan import CampaignErrors, CampaignPlan, PlannedRun
from deboom.bench.campaign_sensors import CampaignSensors
from deboom.bench.data_sheet import (
    CENTRE_TOLERANCE,
    INERTIA_TOLERANCE,
    MASS_TOLERANCE,
    DataSheet,
)
from deboom.bench.mount_sets import mount_names
from deboom.bench.parameters import AXES, VirtualBench
from deboom.bench.platform_layout import MOUNT_DESCRIPTIONS, paths, points
from deboom.files.campaign_file import (
    Axis,
    CampaignFile,
    CampaignMount,
    CurveEntry,
    PushEntry,
    RunEntry,
    ShakerEntry,
    TimeRunEntry,
    ToleranceEntry,
)
from deboom.files.campaign_tables import SensorRow
from deboom.files.platform_file import Engine, Powertrain

MOUNT_TABLE = "mounts.csv"
SENSOR_TABLE = "sensors.csv"
CHANNEL_TABLE = "channels.csv"


def run_file(mount_set: str, run: PlannedRun) -> str:
    """Return the file of a run."""
    return f"runs/{mount_set}/{run.name}.uff"


def shaker_file(mount: str, axis: str, repeat: int) -> str:
    """Return the file of a run of the shaker."""
    return f"shaker/{mount}_{axis}_{repeat}.uff"


def push_file(push: PushPlace, repeat: int) -> str:
    """Return the file of a push beside a virtual point."""
    return f"shaker/{push.mount}_{push.name}_{repeat}.uff"


def curve_file(mount_set: str, mount: str, axis: str) -> str:
    """Return the file of a supplier's curve."""
    return f"static_curves/{mount_set}/{mount}_{axis}.csv"


def time_run_name(run: PlannedRun) -> str:
    """Return the name of a run over time."""
    return f"{run.name}_time"


def time_run_file(run: PlannedRun) -> str:
    """Return the file of a run over time."""
    return f"time/{time_run_name(run)}.uff"


def curve_directions(bench: VirtualBench) -> list[tuple[str, Axis]]:
    """Return mount and axis of every direction that has a law, powertrain first."""
    return [
        (mount.name, axis)
        for body in (bench.powertrain, bench.wheel_end)
        for mount in body.mounts
        for axis, _ in zip(AXES, mount.laws, strict=False)
    ]


def sensor_rows(bench: VirtualBench, sensors: CampaignSensors, sheet: DataSheet) -> list[SensorRow]:
    """Return the position sheet: nominal places from the stated centre of gravity."""
    rows = []
    for kind, model, places, all_angles in (
        (
            "accelerometer",
            ACCELEROMETER_MODEL,
            accelerometer_places(bench),
            sensors.accelerometer_angles,
        ),
        (
            "force cell",
            CELL_MODEL,
            cell_places(bench, sensors.third_cell),
            sensors.cell_angles,
        ),
    ):
        for place, angles in zip(places, all_angles, strict=True):
            rows.append(_sensor_row(place, kind, model, angles, sheet))
    return rows


def _sensor_row(
    place: Place, kind: str, model: str, angles: RealArray, sheet: DataSheet
) -> SensorRow:
    x, y, z = np.round(place.position + sheet.centre_error, 4).tolist()
    rx, ry, rz = np.deg2rad(angles).tolist()
    return SensorRow(place.sensor, kind, model, place.mount, place.piece, (x, y, z), (rx, ry, rz))


def campaign_file(
    bench: VirtualBench,
    sheet: DataSheet,
    plan: CampaignPlan,
    errors: CampaignErrors,
    cylinders: int,
    seed: int,
) -> CampaignFile:
    """Return the content of ``campaign.toml``.

    Parameters
    ----------
    bench : VirtualBench
        What was measured.
    sheet : DataSheet
        What is stated of its powertrain.
    plan : CampaignPlan
        The runs.
    errors : CampaignErrors
        Whose sizes are the stated tolerances.
    cylinders : int
        Of the engine.
    seed : int
        Of the errors.
    """
    (jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz) = sheet.inertia.tolist()
    exact = not errors.data_sheet
    return CampaignFile(
        format=1,
        name=f"virtual_bench_{seed}",
        title=f"Virtual bench, seed {seed}",
        description=(
            "Virtual measurements of the deboom bench, with the errors of real sensors; nobody "
            "measured this. The exact truth lies in truth/."
        ),
        mount_table=MOUNT_TABLE,
        sensor_table=SENSOR_TABLE,
        channel_table=CHANNEL_TABLE,
        engine=Engine(
            cylinders=cylinders,
            dominant_order=bench.order_torque.order,
            total_ratios=bench.total_ratios,
        ),
        powertrain=Powertrain(
            mass_kg=sheet.mass,
            mass_tolerance_kg=0.0 if exact else MASS_TOLERANCE,
            inertia_kg_m2=((jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz)),
            inertia_tolerance=0.0 if exact else INERTIA_TOLERANCE,
            centre_of_gravity_tolerance_m=0.0 if exact else CENTRE_TOLERANCE,
        ),
        tolerances=_tolerances(errors),
        mounts=tuple(_mount(name, bench) for name in mount_names(bench)),
        runs=tuple(
            RunEntry(
                name=run.name,
                mount_set=mount_set,
                gear=run.gear,
                full_load=run.full_load,
                torque_nm=run.torque,
                rising=run.rising,
                file=run_file(mount_set, run),
            )
            for mount_set in plan.mount_sets
            for run in plan.runs
        ),
        shaker_runs=tuple(
            ShakerEntry(
                mount=mount, piece="", axis=axis, repeat=n, file=shaker_file(mount, axis, n)
            )
            for mount in bench.mount_names
            for axis in AXES
            for n in range(1, plan.shaker_repeats + 1)
        ),
        static_curves=tuple(
            CurveEntry(
                mount=mount,
                axis=axis,
                mount_set=mount_set,
                force_uncertainty=errors.curve_scale,
                file=curve_file(mount_set, mount, axis),
            )
            for mount_set in plan.mount_sets
            for mount, axis in curve_directions(bench)
        ),
        time_runs=_time_runs(plan),
        pushes=_pushes(bench, sheet, plan) if plan.third_cell else (),
    )


def _pushes(bench: VirtualBench, sheet: DataSheet, plan: CampaignPlan) -> tuple[PushEntry, ...]:
    entries = []
    for push in push_places(bench):
        x, y, z = np.round(push.position + sheet.centre_error, 4).tolist()
        for repeat in range(1, plan.shaker_repeats + 1):
            file = push_file(push, repeat)
            entries.append(
                PushEntry(
                    name=push.name,
                    mount=push.mount,
                    piece="",
                    position_m=(x, y, z),
                    axis=AXES[push.axis],
                    repeat=repeat,
                    file=file,
                )
            )
    return tuple(entries)


def _time_runs(plan: CampaignPlan) -> tuple[TimeRunEntry, ...]:
    if plan.time_run is None:
        return ()
    run = plan.time_run.run
    return (
        TimeRunEntry(
            name=time_run_name(run),
            mount_set=plan.time_run.mount_set,
            gear=run.gear,
            full_load=run.full_load,
            torque_nm=run.torque,
            rising=run.rising,
            file=time_run_file(run),
            pulses_per_revolution=plan.time_run.pulses_per_revolution,
        ),
    )


def _mount(name: str, bench: VirtualBench) -> CampaignMount:
    pieces = tuple(point.piece for point in points(bench.mount_names) if point.mount == name)
    axes = {path.axis for path in paths(bench.mount_names) if path.mount == name}
    return CampaignMount(
        name=name,
        description=MOUNT_DESCRIPTIONS[name],
        pieces=pieces if len(pieces) > 1 else None,
        transfer_axes=tuple(axis for axis in AXES if axis in axes),
        on_powertrain=name in bench.mount_names,
    )


def _tolerances(errors: CampaignErrors) -> ToleranceEntry:
    chain = errors.chain
    return ToleranceEntry(
        sensor_position_m=chain.position,
        sensor_angle_rad=chain.angle,
        sensor_gain=chain.gain,
        sensor_cross_axis=chain.cross_axis,
        acceleration_own=chain.acceleration_own,
        acceleration_norm=chain.acceleration_norm,
        acceleration_floor_m_s2=chain.acceleration_floor,
        cell_gain=errors.side_cell_gain,
        force_own=chain.force_own,
        force_norm=chain.force_norm,
        force_floor_n=chain.force_floor,
        shaker_angle_rad=chain.shaker_angle,
        shaker_gain=chain.shaker_gain,
        torque_nm=errors.torque,
        static_force_n=errors.static_force,
    )
