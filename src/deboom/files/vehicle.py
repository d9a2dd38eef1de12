"""A vehicle's folder, read and checked: noise transfer functions both ways, runs on the road."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deboom.errors import InputError
from deboom.files.campaign_tables import (
    CampaignChannel,
    SensorRow,
    read_campaign_channels,
    read_sensor_table,
)
from deboom.files.function_matrix import Dof, FunctionMatrix
from deboom.files.mount_entries import mounts_of
from deboom.files.sensor_rows import sensor_of
from deboom.files.platform_tables import read_mount_table
from deboom.files.vehicle_file import (
    VEHICLE_FILE,
    VehicleFile,
    VehicleRunEntry,
    load_vehicle_file,
)
from deboom.files.vehicle_panels import read_panels
from deboom.files.vehicle_tables import ImpactRow, read_impact_table
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.impacts import Impact
from deboom.measurement.measured_vehicle import MeasuredVehicle, VehicleRun
from deboom.measurement.noise_transfer import (
    ACCELERATION_PER_VOLUME_ACCELERATION,
    PRESSURE_PER_FORCE,
)

_FRF = (4,)
_SPECTRA = (0, 12, 27)
_VOLUME_ACCELERATION_UNIT = "m/s^2/m^3/s^2"
_ACCELERANCE = "(m/s^2)/N"


def read_vehicle(folder: Path) -> MeasuredVehicle:
    """Read a vehicle's folder and check that its files fit together.

    Parameters
    ----------
    folder : Path
        Holds ``vehicle.toml``.

    Returns
    -------
    MeasuredVehicle
        In SI.

    Raises
    ------
    InputError
        A file that is missing or damaged; a blow, channel or ear without its function, with two of
        them, or with one of another microphone, type or unit; a mount without blows or sensors. The
        sentence names the file, the item and the remedy.
    """
    file = load_vehicle_file(folder / VEHICLE_FILE)
    mount_table = folder / file.mount_table
    rows = read_mount_table(mount_table)
    mounts = mounts_of(folder / VEHICLE_FILE, file.mounts, mount_table, rows)
    points = [f"{mount.name} {piece}".strip() for mount in mounts for piece in mount.pieces]
    impact_rows = read_impact_table(folder / file.impact_table)
    sensor_rows = read_sensor_table(folder / file.sensor_table)
    _check_places(folder, file, points, impact_rows, sensor_rows)
    on_body = [row for row in sensor_rows if row.sensor not in file.source_sensors]
    channels = _channels(folder, file, sensor_rows)
    body_names = [f"{row.sensor} {axis}" for row in on_body for axis in "xyz"]
    body_dofs = [channels[name] for name in body_names]
    ears = [Dof(ear.name, ear.node, "scalar", ear.microphone) for ear in file.ears]
    sources = [Dof(ear.name, ear.node, "scalar") for ear in file.ears]
    blows = [Dof(row.impact, row.node, row.direction) for row in impact_rows]
    ear_names = tuple(ear.name for ear in ears)
    blow_names = tuple(row.impact for row in impact_rows)

    direct = FunctionMatrix(folder / file.direct, "hammer", _FRF)
    reciprocal = FunctionMatrix(folder / file.reciprocal, "loudspeaker", _FRF)
    accelerance = None
    if file.accelerance:
        accelerances = FunctionMatrix(folder / file.accelerance, "hammer", _FRF)
        accelerance = Frf(
            accelerances.frequency,
            accelerances.values(body_dofs, blows, ordinate="acceleration", unit="m/s^2/N"),
            tuple(body_names),
            blow_names,
            _ACCELERANCE,
        )
    return MeasuredVehicle(
        name=file.name,
        group=file.group,
        ears=ear_names,
        mounts=mounts,
        body_sensors={
            point: tuple(sensor_of(row) for row in on_body if _point(row) == point)
            for point in points
        },
        source_sensors=tuple(
            sensor_of(row) for row in sensor_rows if row.sensor in file.source_sensors
        ),
        powertrain_mounts=tuple(mount.name for mount in mounts if mount.body_mass is None),
        impacts={
            point: tuple(
                Impact(row.impact, np.array(row.position), np.array(row.vector))
                for row in impact_rows
                if _point(row) == point
            )
            for point in points
        },
        direct=Frf(
            direct.frequency,
            direct.values(ears, blows, ordinate="pressure", unit=PRESSURE_PER_FORCE),
            ear_names,
            blow_names,
            PRESSURE_PER_FORCE,
        ),
        reciprocal=Frf(
            reciprocal.frequency,
            reciprocal.values(
                body_dofs, sources, ordinate="acceleration", unit=_VOLUME_ACCELERATION_UNIT
            ),
            tuple(body_names),
            ear_names,
            ACCELERATION_PER_VOLUME_ACCELERATION,
        ),
        accelerance=accelerance,
        runs=tuple(_run(folder, file, entry, ears, list(channels.values())) for entry in file.runs),
        panels=None if file.panels is None else read_panels(folder, file.panels, sources),
    )


def _run(
    folder: Path,
    file: VehicleFile,
    entry: VehicleRunEntry,
    ears: Sequence[Dof],
    channels: Sequence[Dof],
) -> VehicleRun:
    matrix = FunctionMatrix(folder / entry.file, f"run '{entry.name}'", _SPECTRA)
    pressure = matrix.values(ears, ordinate="pressure", unit="Pa")[:, :, 0]
    acceleration = matrix.values(channels, ordinate="acceleration", unit="m/s^2")[:, :, 0]
    return VehicleRun(
        name=entry.name,
        gear=entry.gear,
        total_ratio=file.engine.total_ratios[entry.gear - 1],
        torque_limit=entry.torque_limit_nm,
        order=file.engine.dominant_order,
        pressure=Spectrum(matrix.frequency, pressure, tuple(ear.name for ear in ears), "Pa"),
        acceleration=Spectrum(
            matrix.frequency, acceleration, tuple(dof.name for dof in channels), "m/s^2"
        ),
    )


def _channels(folder: Path, file: VehicleFile, sensors: Sequence[SensorRow]) -> dict[str, Dof]:
    """Return the DoF of every accelerometer channel, in the order of the position sheet."""
    path = folder / file.channel_table
    table = {row.channel: row for row in read_campaign_channels(path)}
    wanted = [f"{row.sensor} {axis}" for row in sensors for axis in "xyz"]
    missing = [name for name in wanted if name not in table]
    if missing:
        raise InputError(f"{path}: no row for channel {missing[0]}: add its node and direction")
    return {name: _dof(table[name]) for name in wanted}


def _dof(row: CampaignChannel) -> Dof:
    return Dof(row.channel, row.node, row.direction, sign=row.sign)


def _check_places(
    folder: Path,
    file: VehicleFile,
    points: Sequence[str],
    impacts: Sequence[ImpactRow],
    sensors: Sequence[SensorRow],
) -> None:
    """Every blow and sensor belongs to a mount, and every mount has both."""
    names = [row.sensor for row in sensors]
    unknown = [name for name in file.source_sensors if name not in names]
    if unknown:
        raise InputError(
            f"{folder / VEHICLE_FILE}: source_sensors {unknown} are not in {file.sensor_table}"
        )
    on_body = [row for row in sensors if row.sensor not in file.source_sensors]
    for table, what, places in (
        (file.impact_table, "blow of the hammer", [_point(row) for row in impacts]),
        (file.sensor_table, "accelerometer on the body", [_point(row) for row in on_body]),
    ):
        for place in places:
            if place not in points:
                raise InputError(
                    f"{folder / table}: '{place}' is no mount or piece of {VEHICLE_FILE}, there "
                    f"are {', '.join(points)}: correct one of them"
                )
        for point in points:
            if point not in places:
                raise InputError(
                    f"{folder / table}: {point} has no {what}: a path without noise transfer "
                    "function cannot be judged; measure it, or leave the mount out"
                )


def _point(row: ImpactRow | SensorRow) -> str:
    return f"{row.mount} {row.piece}".strip()
