"""A campaign folder, read and checked: raw channels of many runs on one bench, in SI.

``campaign.toml`` names the other files: the virtual points, the position sheet, the channel table,
one UFF file per run and per push of the shaker, and the suppliers' curves. Functions are chosen by
node, direction and quantity, never by their place in a file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.errors import InputError
from deboom.files.campaign_channels import ChannelFile
from deboom.files.campaign_checks import check_channels, check_sensors, check_shaker_directions
from deboom.files.campaign_file import (
    CampaignFile,
    SensorModelEntry,
    ToleranceEntry,
    load_campaign_file,
)
from deboom.files.campaign_runs import (
    names_of,
    of_quantity,
    read_operating_run,
    read_push,
    read_shaker_run,
)
from deboom.files.campaign_tables import (
    CampaignChannel,
    read_campaign_channels,
    read_curve,
    read_sensor_table,
)
from deboom.files.sensor_rows import sensor_of
from deboom.files.platform_tables import read_mount_table
from deboom.measurement.campaign import Campaign, StaticCurve
from deboom.measurement.sensor_catalogue import SENSOR_CATALOGUE, SensorModel
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.measurement.time_run import TimeRun
from deboom.measurement.tolerances import Tolerances
from deboom.mounts.mount import Mount
from deboom.physics.rigid_body import mass_matrix

CAMPAIGN_FILE = "campaign.toml"
_TIME = (1,)


@dataclass(frozen=True, eq=False)
class _Tables:
    """What all runs of a campaign share."""

    folder: Path
    file: CampaignFile
    mounts: tuple[Mount, ...]
    sensors: tuple[Sensor, ...]
    channels: tuple[CampaignChannel, ...]
    switched_off: tuple[str, ...]
    models: dict[str, SensorModel]

    @property
    def paths(self) -> list[Path]:
        tables = (self.file.mount_table, self.file.sensor_table, self.file.channel_table)
        return [self.folder / CAMPAIGN_FILE, *(self.folder / name for name in tables)]


def read_campaign(
    folder: Path, mount_sets: Sequence[str] | None = None, switched_off: Sequence[str] = ()
) -> Campaign:
    """Read a campaign folder and check that its files fit together.

    Parameters
    ----------
    folder : Path
        Holds ``campaign.toml``.
    mount_sets : sequence of str, optional
        Mount sets whose runs and curves are read; by default all.
    switched_off : sequence of str
        Channels not to be used, besides those that the file names.

    Returns
    -------
    Campaign
        In SI; `Campaign.input_files` names every file that was read.

    Raises
    ------
    InputError
        A file is missing or wrong in itself; files do not fit together; a mount set is not there.
    """
    tables = _read_tables(Path(folder), switched_off)
    file, path = tables.file, tables.folder / CAMPAIGN_FILE
    there = tuple(dict.fromkeys(run.mount_set for run in file.runs))
    if not there:
        raise InputError(f"{path}: no [[runs]]: add at least one")
    wanted = there if mount_sets is None else tuple(dict.fromkeys(mount_sets))
    unknown = [name for name in wanted if name not in there]
    if unknown or not wanted:
        raise InputError(
            f"{path}: there is no mount set '{', '.join(unknown)}', use {', '.join(there)}"
        )
    check_shaker_directions(path, file.shaker_runs)
    run_entries = [entry for entry in file.runs if entry.mount_set in wanted]
    curve_entries = [entry for entry in file.static_curves if entry.mount_set in wanted]
    cells = of_quantity(tables.channels, "cell force")

    def cells_below(mount: str, piece: str) -> tuple[CampaignChannel, ...]:
        names = [
            name
            for sensor in tables.sensors
            if sensor.kind is SensorKind.FORCE_CELL
            and (sensor.mount, sensor.piece) == (mount, piece)
            for name in sensor.channels
        ]
        return tuple(channel for channel in cells if channel.channel in names)

    read = [entry.file for entry in run_entries]
    read += [entry.file for entry in file.shaker_runs]
    read += [entry.file for entry in file.pushes]
    read += [entry.file for entry in curve_entries]
    return Campaign(
        name=file.name,
        mounts=tables.mounts,
        powertrain_mounts=tuple(mount.name for mount in file.mounts if mount.on_powertrain),
        sensors=tables.sensors,
        switched_off=tables.switched_off,
        mount_sets=wanted,
        runs=tuple(
            read_operating_run(tables.folder, entry, file, tables.channels, tables.switched_off)
            for entry in run_entries
        ),
        shaker_runs=tuple(
            read_shaker_run(tables.folder, entry, cells_below(entry.mount, entry.piece))
            for entry in file.shaker_runs
        ),
        pushes=tuple(
            read_push(tables.folder, entry, cells_below(entry.mount, entry.piece))
            for entry in file.pushes
        ),
        static_curves=tuple(
            StaticCurve(
                entry.mount,
                entry.axis,
                entry.mount_set,
                *read_curve(tables.folder / entry.file),
                entry.force_uncertainty,
            )
            for entry in curve_entries
        ),
        mass_matrix=mass_matrix(file.powertrain.mass_kg, file.powertrain.inertia_kg_m2),
        mass_tolerance=file.powertrain.mass_tolerance_kg,
        inertia_tolerance=file.powertrain.inertia_tolerance,
        centre_of_gravity_tolerance=file.powertrain.centre_of_gravity_tolerance_m,
        total_ratios=file.engine.total_ratios,
        order=file.engine.dominant_order,
        sensor_catalogue=tables.models,
        tolerances=_tolerances(file.tolerances),
        input_files=(*tables.paths, *(tables.folder / name for name in read)),
    )


def read_time_run(folder: Path, name: str) -> TimeRun:
    """Read one run over time of a campaign folder.

    Parameters
    ----------
    folder : Path
        Holds ``campaign.toml``.
    name : str
        Of an entry of ``[[time_runs]]``.

    Raises
    ------
    InputError
        No such run; its file is wrong in itself or does not fit the tables.
    """
    tables = _read_tables(Path(folder), ())
    entries = {entry.name: entry for entry in tables.file.time_runs}
    if name not in entries:
        raise InputError(
            f"{tables.folder / CAMPAIGN_FILE}: there is no time run '{name}', use "
            f"{', '.join(entries) or 'a campaign that has one'}"
        )
    entry = entries[name]
    file = ChannelFile(tables.folder / entry.file, f"time run '{name}'", _TIME)
    time = file.abscissa
    accelerations = of_quantity(tables.channels, "acceleration")
    cells = of_quantity(tables.channels, "cell force")
    slow = of_quantity(tables.channels, "static force")
    engine = tables.file.engine
    return TimeRun(
        name=entry.name,
        mount_set=entry.mount_set,
        gear=entry.gear,
        total_ratio=engine.total_ratios[entry.gear - 1],
        full_load=entry.full_load,
        torque_limit=entry.torque_nm,
        rising=entry.rising,
        order=engine.dominant_order,
        sample_rate=(time.size - 1) / float(time[-1] - time[0]),
        tacho=file.real(of_quantity(tables.channels, "tacho"))[:, 0],
        pulses_per_revolution=entry.pulses_per_revolution,
        engine_torque=file.real(of_quantity(tables.channels, "engine torque"))[:, 0],
        acceleration=file.real(accelerations),
        acceleration_channels=names_of(accelerations),
        cell_force=file.real(cells),
        cell_force_channels=names_of(cells),
        static_force=file.real(slow) if slow else np.empty((time.size, 0)),
        static_force_names=names_of(slow),
    )


def _read_tables(folder: Path, switched_off: Sequence[str]) -> _Tables:
    file = load_campaign_file(folder / CAMPAIGN_FILE)
    off = tuple(dict.fromkeys((*file.switched_off, *switched_off)))
    sheet, table = folder / file.sensor_table, folder / file.channel_table
    sensors = tuple(map(sensor_of, read_sensor_table(sheet)))
    channels = read_campaign_channels(table)
    check_sensors(sheet, file, sensors, off)
    check_channels(table, file, sensors, channels, off)
    models = dict(SENSOR_CATALOGUE) | {entry.name: _model(entry) for entry in file.sensor_models}
    for sensor in sensors:
        if sensor.model not in models:
            raise InputError(
                f"{sheet}: sensor '{sensor.name}' is of model '{sensor.model}', which is not in "
                f"the catalogue ({', '.join(models)}): correct it, or add [[sensor_models]] to "
                f"{CAMPAIGN_FILE}"
            )
    return _Tables(folder, file, _mounts(folder, file), sensors, channels, off, models)


def _model(entry: SensorModelEntry) -> SensorModel:
    return SensorModel(
        name=entry.name,
        quantity_unit=entry.quantity_unit,
        signal_unit=entry.signal_unit,
        sensitivity=entry.sensitivity,
        gain_tolerance=entry.gain_tolerance,
        cross_axis=entry.cross_axis,
        noise_floor=entry.noise_floor,
        frequency_range=entry.frequency_range_hz,
        source=entry.source,
    )


def _tolerances(entry: ToleranceEntry) -> Tolerances:
    return Tolerances(
        sensor_position=entry.sensor_position_m,
        sensor_angle=entry.sensor_angle_rad,
        sensor_gain=entry.sensor_gain,
        sensor_cross_axis=entry.sensor_cross_axis,
        acceleration_own=entry.acceleration_own,
        acceleration_norm=entry.acceleration_norm,
        acceleration_floor=entry.acceleration_floor_m_s2,
        cell_gain=entry.cell_gain,
        force_own=entry.force_own,
        force_norm=entry.force_norm,
        force_floor=entry.force_floor_n,
        shaker_angle=entry.shaker_angle_rad,
        shaker_gain=entry.shaker_gain,
        torque=entry.torque_nm,
        static_force=entry.static_force_n,
    )


def _mounts(folder: Path, file: CampaignFile) -> tuple[Mount, ...]:
    path = folder / file.mount_table
    positions = {(row.mount, row.piece): row.position for row in read_mount_table(path)}
    pieces = [(mount.name, piece) for mount in file.mounts for piece in mount.piece_names]
    for key in (*positions, *pieces):
        if key not in pieces or key not in positions:
            where = path if key not in positions else folder / CAMPAIGN_FILE
            raise InputError(
                f"{where}: mount '{key[0]}', piece '{key[1]}' is missing: add it there or take it "
                "out of the other file"
            )
    return tuple(
        Mount(
            name=mount.name,
            description=mount.description,
            pieces=mount.piece_names,
            positions=tuple(positions[mount.name, piece] for piece in mount.piece_names),
            transfer_axes=mount.transfer_axes,
        )
        for mount in file.mounts
    )
