"""A vehicle's folder, read and checked: noise transfer functions both ways, runs on the road."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from deboom.errors import InputError, naming
from deboom.files.function_table import FRF, Dof, FunctionMatrix
from deboom.files.inertance_test import ToleranceSection
from deboom.files.kinds import FolderKind
from deboom.files.platform import SPECTRA, Engine, EngineTorque, MountEntry, mounts_of
from deboom.files.rows import (
    CampaignChannel,
    ImpactRow,
    MountRow,
    PanelRow,
    SensorRow,
    impact_of,
    read_torque_table,
    sensor_of,
)
from deboom.files.schema import (
    AtLeastOne,
    FolderRecord,
    Name,
    Number,
    RelativePath,
    Several,
    StrictModel,
    Title,
    assumed_lines,
    beyond_gears,
    doubled,
    for_each,
    load_toml,
    noting,
    refuse_all,
    telling,
)
from deboom.files.tables import read_table
from deboom.measurement.channels import refuse_window
from deboom.measurement.measured_vehicle import (
    MeasuredVehicle,
    VehicleRun,
    refuse_contradictions_of_vehicle,
)
from deboom.measurement.modal import PRESSURE_PER_VOLUME_ACCELERATION, PanelMeasurement
from deboom.measurement.noise_transfer import (
    ACCELERATION_PER_VOLUME_ACCELERATION,
    PRESSURE_PER_FORCE,
)
from deboom.mounts.mounts_in_car import refuse_unusable
from deboom.names import look_alikes

VEHICLE_FILE = "vehicle.toml"
LARGEST_LEVER = 1.0
"""Largest distance of an accelerometer or a blow from the virtual point that it is beside [m]."""
_MOTION = ("m/s^2/m^3/s^2", ACCELERATION_PER_VOLUME_ACCELERATION)
"""Unit of acceleration per volume acceleration, as UFF has it and as we write it."""


class PanelEntry(StrictModel):
    """``[panels]`` in ``vehicle.toml``: what was measured at the panels of the cabin."""

    table: RelativePath  # position sheet, CSV
    motion: RelativePath  # UFF: acceleration inwards per volume acceleration at the ears
    pressure: RelativePath  # UFF: pressure at the panels per volume acceleration at the ears


class EarEntry(StrictModel):
    """One ear and the one microphone that stands for it."""

    name: Title  # such as driver ear
    node: Number  # in the UFF files: of the microphone, and of the loudspeaker in its place
    # serial number, the response name of all of its functions
    microphone: Annotated[str, Field(min_length=1, max_length=10)]


class VehicleRunEntry(StrictModel):
    """One run of the assembled vehicle."""

    name: Name  # such as g5_wot220
    gear: Number
    torque_limit_nm: EngineTorque
    file: RelativePath  # UFF: pressure at the ears and acceleration, over the dominant order
    torque_table: RelativePath | None = None  # engine torque at every line, where it was recorded


class VehicleFile(StrictModel):
    """Keys of ``vehicle.toml``."""

    format: Literal[1]
    name: Name  # such as U06-1
    group: Name  # vehicles of one body, such as U06
    title: str  # in words, for the report
    mount_table: RelativePath  # virtual points, CSV
    sensor_table: RelativePath  # position sheet of all accelerometers, CSV or Excel
    channel_table: RelativePath  # nodes of their channels, CSV
    impact_table: RelativePath  # position sheet of the blows, CSV
    source_sensors: Several[Name]  # on the powertrain and on wheel ends; others are on the body
    direct: RelativePath  # UFF: pressure at the ears per force of the hammer
    reciprocal: RelativePath  # UFF: acceleration on the body per volume acceleration at the ears
    accelerance: RelativePath | None = None  # UFF: acceleration on the body per hammer force
    panels: PanelEntry | None = None  # left out where not measured
    engine: Engine  # for the order of the runs
    ears: AtLeastOne[EarEntry]  # in the order of the results
    mounts: AtLeastOne[MountEntry]  # one without body mass carries the powertrain
    runs: Several[VehicleRunEntry] = ()
    tolerances: ToleranceSection = ToleranceSection()

    def faults(self) -> Iterator[str]:
        """Give a sentence for names and nodes that come twice, and for gears without a ratio."""
        for section in ("ears", "mounts", "runs"):
            names = [entry.name for entry in getattr(self, section)]
            yield from doubled(f"[[{section}]] are named", names)
            yield from look_alikes(section.removesuffix("s"), names)
        yield from doubled("[[ears]] have the node", [ear.node for ear in self.ears])
        yield from self.engine.order_faults()
        gears = [(run.name, run.gear) for run in self.runs]
        yield from beyond_gears("run", gears, self.engine.total_ratios)


def read_panels(folder: Path, entry: PanelEntry, ears: Sequence[Dof]) -> PanelMeasurement:
    """Read what was measured at the panels."""
    rows = read_table(folder / entry.table, PanelRow)
    dofs = [Dof(row.panel, row.node, "scalar") for row in rows]
    motion = FunctionMatrix(folder / entry.motion, "panels", (FRF,))
    pressure = FunctionMatrix(folder / entry.pressure, "panels", (FRF,))
    if not np.array_equal(motion.axis, pressure.axis):
        raise InputError(f"{pressure.path} and {motion.path} have different lines: export alike")
    return PanelMeasurement(
        names=tuple(row.panel for row in rows),
        positions=np.array([row.position for row in rows]),
        normals=np.array([row.normal for row in rows]),
        areas=np.array([row.area for row in rows]),
        motion=motion.frf(dofs, ears, "acceleration", *_MOTION),
        pressure=pressure.frf(
            dofs, ears, "pressure", "Pa/m^3/s^2", PRESSURE_PER_VOLUME_ACCELERATION
        ),
    )


def read_vehicle(folder: Path | str) -> MeasuredVehicle:
    """Read a vehicle's folder and check that its files fit together.

    Parameters
    ----------
    folder : path
        Holds ``vehicle.toml`` and what it names.

    Returns
    -------
    MeasuredVehicle
        In SI: functions of hammer and loudspeaker, runs over the engine order, places of sensors
        and blows.

    Raises
    ------
    InputError
        A file that is missing or damaged; a blow, channel or ear without its function, with two of
        them, or with one of another microphone, type or unit; a mount without blows or sensors;
        functions whose sign, convention or quantity others deny. The sentence names the file, the
        item and the remedy.

    See Also
    --------
    deboom.mounts_in_car, deboom.read_platform, deboom.analyse_paths

    Examples
    --------
    >>> import deboom
    >>> deboom.read_vehicle("my_car").points  # doctest: +SKIP
    """
    folder = Path(folder)
    file = load_toml(folder / VEHICLE_FILE, VehicleFile)
    mount_table = folder / file.mount_table
    with telling() as tell:
        with noting(tell):
            rows = read_table(mount_table, MountRow)
        with noting(tell):
            impact_rows = read_table(folder / file.impact_table, ImpactRow)
        with noting(tell):
            sensor_rows = read_table(folder / file.sensor_table, SensorRow)
        with noting(tell):
            channel_rows = read_table(folder / file.channel_table, CampaignChannel)
    mounts = mounts_of(folder / VEHICLE_FILE, file.mounts, mount_table, rows)
    points = [f"{mount.name} {piece}".strip() for mount in mounts for piece in mount.pieces]
    refuse_all(_misplaced(folder, file, points, impact_rows, sensor_rows))
    on_body = [row for row in sensor_rows if row.sensor not in file.source_sensors]
    places = {
        f"{mount.name} {piece}".strip(): place
        for mount in mounts
        for piece, place in zip(mount.pieces, mount.positions, strict=True)
    }
    beside = [
        (folder / file.sensor_table, _point(row), row.sensor, row.position) for row in on_body
    ]
    beside += [
        (folder / file.impact_table, _point(row), row.impact, row.position) for row in impact_rows
    ]
    refuse_all(far_from_its_point(places, beside))
    channels = _channels(folder / file.channel_table, channel_rows, sensor_rows)
    body_dofs = [channels[f"{row.sensor} {axis}"] for row in on_body for axis in "xyz"]
    ears = [Dof(ear.name, ear.node, "scalar", ear.microphone) for ear in file.ears]
    sources = [Dof(ear.name, ear.node, "scalar") for ear in file.ears]
    blows = [Dof(row.impact, row.node, row.direction) for row in impact_rows]
    direct = FunctionMatrix(folder / file.direct, "hammer", (FRF,))
    refuse_window(direct.added_decay_rate, str(direct.path))
    reciprocal = FunctionMatrix(folder / file.reciprocal, "loudspeaker", (FRF,))
    accelerance = None
    if file.accelerance:
        matrix = FunctionMatrix(folder / file.accelerance, "hammer", (FRF,))
        accelerance = matrix.frf(body_dofs, blows, "acceleration", "m/s^2/N", "(m/s^2)/N")
    tolerances, defaults = file.tolerances.placement(VEHICLE_FILE)
    vehicle = MeasuredVehicle(
        name=file.name,
        group=file.group,
        ears=tuple(ear.name for ear in ears),
        mounts=mounts,
        body_sensors={
            point: tuple(sensor_of(row) for row in on_body if _point(row) == point)
            for point in points
        },
        source_sensors=tuple(
            sensor_of(row) for row in sensor_rows if row.sensor in file.source_sensors
        ),
        powertrain_mounts=tuple(mount.name for mount in mounts if mount.carries_powertrain),
        impacts={
            point: tuple(impact_of(row) for row in impact_rows if _point(row) == point)
            for point in points
        },
        direct=direct.frf(ears, blows, "pressure", PRESSURE_PER_FORCE),
        reciprocal=reciprocal.frf(body_dofs, sources, "acceleration", *_MOTION),
        accelerance=accelerance,
        runs=for_each(
            lambda entry: _run(folder, file, entry, ears, list(channels.values())), file.runs
        ),
        panels=None if file.panels is None else read_panels(folder, file.panels, sources),
        tolerances=tolerances,
        assumed=defaults,
    )
    with naming(folder):
        refuse_contradictions_of_vehicle(vehicle)
    return vehicle


def _run(
    folder: Path,
    file: VehicleFile,
    entry: VehicleRunEntry,
    ears: Sequence[Dof],
    channels: Sequence[Dof],
) -> VehicleRun:
    matrix = FunctionMatrix(folder / entry.file, f"run '{entry.name}'", SPECTRA)
    matrix.check_order(
        file.engine.dominant_order, "correct it, or the dominant_order of the engine"
    )
    pressure = matrix.spectrum(ears, "pressure", "Pa")
    torque = None
    if entry.torque_table is not None:
        torque = read_torque_table(folder / entry.torque_table, pressure.frequency)
    return VehicleRun(
        name=entry.name,
        gear=entry.gear,
        total_ratio=file.engine.total_ratios[entry.gear - 1],
        torque_limit=entry.torque_limit_nm,
        order=file.engine.dominant_order,
        pressure=pressure,
        acceleration=matrix.spectrum(channels, "acceleration", "m/s^2"),
        engine_torque=torque,
    )


def _channels(
    path: Path, rows: Sequence[CampaignChannel], sensors: Sequence[SensorRow]
) -> dict[str, Dof]:
    """Return the DoF of every accelerometer channel, in the order of the position sheet."""
    # the unit that a file states counts, whatever the table says
    table = {row.channel: replace(row.dof, unit=None) for row in rows}
    wanted = [f"{row.sensor} {axis}" for row in sensors for axis in "xyz"]
    refuse_all(
        f"{path}: no row for channel {name}: add its node and direction"
        for name in wanted
        if name not in table
    )
    return {name: table[name] for name in wanted}


def _misplaced(
    folder: Path,
    file: VehicleFile,
    points: Sequence[str],
    impacts: Sequence[ImpactRow],
    sensors: Sequence[SensorRow],
) -> Iterator[str]:
    """Give a sentence for a blow or sensor without its mount, and a mount without either."""
    names = [row.sensor for row in sensors]
    unknown = [name for name in file.source_sensors if name not in names]
    on_body = [row for row in sensors if row.sensor not in file.source_sensors]
    if unknown:
        yield (
            f"{folder / VEHICLE_FILE}: source_sensors {unknown} are not in {file.sensor_table}: "
            "add them there, or correct their names"
        )
    for table, what, places in (
        (file.impact_table, "blow of the hammer", [_point(row) for row in impacts]),
        (file.sensor_table, "accelerometer on the body", [_point(row) for row in on_body]),
    ):
        for place in dict.fromkeys(places):
            if place not in points:
                yield (
                    f"{folder / table}: '{place}' is no mount or piece of {VEHICLE_FILE}, there "
                    f"are {', '.join(points)}: correct one of them"
                )
        for point in points:
            if point not in places:
                yield (
                    f"{folder / table}: {point} has no {what}: a path without noise transfer "
                    "function cannot be judged; measure it, or leave the mount out"
                )


def far_from_its_point(
    places: Mapping[str, Sequence[float]],
    beside: Iterable[tuple[Path, str, str, Sequence[float]]],
) -> Iterator[str]:
    """Give a sentence for a sensor or blow that lies nowhere near the point that it is beside.

    - `places`: name of each point to its position [m].
    - `beside`: file, point, name and position [m] of each sensor and blow.
    """
    for path, point, name, position in beside:
        off = float(np.linalg.norm(np.subtract(position, places[point])))
        if off > LARGEST_LEVER:
            yield (
                f"{path}: {name} lies {off:.3g} m from {point}, which it is beside: correct the "
                "sign, the axis or the unit of one of the two positions, or the point"
            )


def _point(row: ImpactRow | SensorRow) -> str:
    return f"{row.mount} {row.piece}".strip()


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Give name and text of each line on what a folder holds."""
    vehicle = read_vehicle(folder)
    lines = vehicle.direct.frequency
    yield "vehicle", f"{vehicle.name} in group {vehicle.group}"
    yield "ears", ", ".join(vehicle.ears)
    yield "mounts", ", ".join(mount.name for mount in vehicle.mounts)
    yield "blows", f"{len(vehicle.direct.inputs)} beside {len(vehicle.impacts)} virtual points"
    yield "lines", f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz"
    yield "runs", ", ".join(run.name for run in vehicle.runs) or "none"
    try:
        refuse_unusable(vehicle)
    except InputError as error:
        yield "stiffness", f"of the mounts does not follow from this car: {error}"
    else:
        yield "stiffness", "of the mounts: deboom run mounts_in_car --vehicle " + folder.as_posix()
        silent = [run.name for run in vehicle.runs if run.engine_torque is None]
        if silent:
            yield "library", f"none of {', '.join(silent)}: no torque_table"
    yield from assumed_lines(vehicle.assumed)


VEHICLE: FolderRecord = FolderRecord(
    kind=FolderKind.vehicle,
    file=VEHICLE_FILE,
    keys=VehicleFile,
    command="deboom run synthesis_validation --vehicle {}",
    guide="Your own data",
    lines=_lines,
)
