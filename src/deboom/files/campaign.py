"""A campaign folder, read and checked: raw channels of many runs on one bench, in SI."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.function_table import IN_SI, Dof, FunctionMatrix
from deboom.files.platform import Engine, MountEntry, Name, NotNegative, Positive, RelativePath
from deboom.files.platform import PowertrainEntry as Powertrain
from deboom.files.rows import (
    CAMPAIGN_QUANTITIES,
    CampaignChannel,
    MountRow,
    SensorRow,
    read_curve,
    read_table,
    sensor_of,
)
from deboom.files.schema import StrictModel, append_toml, dump_toml, load_toml, refuse_doubled
from deboom.files.uff import UffFunction, write_uff
from deboom.measurement.campaign import (
    AXES,
    Campaign,
    OperatingRun,
    PushRun,
    ShakerRun,
    StaticCurve,
    TimeRun,
)
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import (
    Impact,
    Sensor,
    SensorKind,
    Tolerances,
)
from deboom.mounts.mount import Mount
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.rigid_body import mass_matrix

Axis = Literal["x", "y", "z"]
Gear = Annotated[int, Field(ge=1)]


class CampaignMount(MountEntry):
    """One mount."""

    on_powertrain: bool
    """Whether it carries the powertrain; else each piece carries a body of its own."""


class ToleranceEntry(StrictModel):
    """Standard deviations of what the bench states only approximately."""

    sensor_position_m: NotNegative
    """Of an accelerometer, per axis [m]."""
    sensor_angle_rad: NotNegative
    """Of an accelerometer, per axis [rad]."""
    sensor_gain: NotNegative
    """Of an accelerometer channel [1]."""
    sensor_cross_axis: NotNegative
    """Of an accelerometer channel [1]."""
    acceleration_own: NotNegative
    """Noise per amplitude of the channel [1]."""
    acceleration_norm: NotNegative
    """Noise per norm of the triaxial sensor [1]."""
    acceleration_floor_m_s2: NotNegative
    """Noise at rest [m/s²]."""
    cell_gain: NotNegative
    """Of a cell that no shaker calibrates [1]."""
    force_own: NotNegative
    """Noise per amplitude of the channel [1]."""
    force_norm: NotNegative
    """Noise per norm of the triaxial cell [1]."""
    force_floor_n: NotNegative
    """Noise at rest [N]."""
    shaker_angle_rad: NotNegative
    """Of the shaker against its nominal axis, per axis [rad]."""
    shaker_gain: NotNegative
    """Of the force the shaker states [1]."""
    torque_nm: NotNegative
    """Of the engine torque, per line [N m]."""
    static_force_n: NotNegative
    """Of the quasi-static cell force, per line [N]."""


class RunEntry(StrictModel):
    """One operating run and the file of its spectra."""

    name: Name
    """Such as ``g5_wot220``; a mount set has it once."""
    mount_set: Name
    """Parts on the bench."""
    gear: Gear
    """From 1."""
    full_load: bool
    """Ramp with wide open throttle; else a slice at constant torque."""
    torque_nm: Positive
    """Limit of a ramp, torque of a slice [N m]."""
    rising: bool
    """Direction of the engine speed."""
    file: RelativePath
    """UFF file."""


class ShakerEntry(StrictModel):
    """One run of the shaker at the virtual point of a mount."""

    mount: Name
    """Where."""
    piece: str
    """Piece of it; ``""`` for a single one."""
    axis: Axis
    """Nominal direction of the force."""
    repeat: Annotated[int, Field(ge=1)]
    """From 1."""
    file: RelativePath
    """UFF file."""


class PushEntry(ShakerEntry):
    """One push beside the virtual point of a mount: it makes a moment as well."""

    name: Name
    """Of the point and direction; repeats share it."""
    position_m: Annotated[tuple[float, float, float], Field(strict=False)]
    """From the origin of the position sheet [m]."""


class CurveEntry(StrictModel):
    """One force-deflection curve of a supplier."""

    mount: Name
    """Of the direction."""
    axis: Axis
    """Of the direction."""
    mount_set: Name
    """Part that was measured."""
    force_uncertainty: NotNegative
    """Standard deviation of the curve's scale [1]."""
    file: RelativePath
    """CSV file."""


class TimeRunEntry(RunEntry):
    """One run recorded over time."""

    pulses_per_revolution: Annotated[int, Field(ge=1)]
    """Of the tacho."""


class CampaignFile(StrictModel):
    """The whole file ``campaign.toml``."""

    format: Literal[1]
    """Version of this format."""
    name: Name
    """Short key of the campaign."""
    title: str
    """What a reader calls it."""
    description: str
    """A paragraph for the report."""
    mount_table: RelativePath
    """CSV with the virtual points."""
    sensor_table: RelativePath
    """Position sheet, CSV or Excel."""
    channel_table: RelativePath
    """CSV that says which UFF node and direction is which channel."""
    switched_off: Annotated[tuple[str, ...], Field(strict=False)] = ()
    """Channels not to be used, such as ``A3 y``."""
    engine: Engine
    """Engine and gearbox."""
    powertrain: Powertrain
    """Nominal rigid-body data."""
    tolerances: ToleranceEntry
    """Of this bench."""
    mounts: Annotated[tuple[CampaignMount, ...], Field(strict=False, min_length=1)]
    """In the order of the platform."""
    runs: Annotated[tuple[RunEntry, ...], Field(strict=False)] = ()
    """Operating runs."""
    shaker_runs: Annotated[tuple[ShakerEntry, ...], Field(strict=False)] = ()
    """For the force transfer matrices."""
    static_curves: Annotated[tuple[CurveEntry, ...], Field(strict=False)] = ()
    """From suppliers."""
    time_runs: Annotated[tuple[TimeRunEntry, ...], Field(strict=False)] = ()
    """Recorded over time."""
    pushes: Annotated[tuple[PushEntry, ...], Field(strict=False)] = ()
    """For force transfer matrices with moments."""


def load_campaign_file(path: Path) -> CampaignFile:
    """Read and check ``campaign.toml``.

    Raises
    ------
    InputError
        The file is missing or no TOML; a key is unknown, missing, mistyped or out of range; two
        items share a name; a gear has no ratio; an item belongs to a mount or piece that is not
        there.
    """
    campaign = load_toml(path, CampaignFile)
    _check(path, campaign)
    return campaign


def dump_campaign_file(path: Path, campaign: CampaignFile) -> None:
    """Write ``campaign.toml``.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    _check(path, campaign)
    dump_toml(path, campaign)


def _check(path: Path, campaign: CampaignFile) -> None:
    pieces = {(mount.name, piece) for mount in campaign.mounts for piece in mount.piece_names}
    unique: list[tuple[str, Sequence[Hashable]]] = [
        ("[[mounts]] are named", [mount.name for mount in campaign.mounts]),
        ("[[runs]] of one mount set are named", [(r.mount_set, r.name) for r in campaign.runs]),
        (
            "[[shaker_runs]] are of",
            [(r.mount, r.piece, r.axis, r.repeat) for r in campaign.shaker_runs],
        ),
        (
            "[[static_curves]] are of",
            [(c.mount_set, c.mount, c.axis) for c in campaign.static_curves],
        ),
        ("[[time_runs]] are named", [run.name for run in campaign.time_runs]),
        ("[[pushes]] are of", [(p.mount, p.piece, p.name, p.repeat) for p in campaign.pushes]),
        ("switched_off are named", campaign.switched_off),
    ]
    for what, keys in unique:
        refuse_doubled(path, what, keys)
    gears = len(campaign.engine.total_ratios)
    for run in (*campaign.runs, *campaign.time_runs):
        if run.gear > gears:
            raise InputError(
                f"{path}: run '{run.name}' is in gear {run.gear}, but total_ratios in [engine] "
                f"has {gears} gears: add the ratio"
            )
    for shaker in (*campaign.shaker_runs, *campaign.pushes):
        if (shaker.mount, shaker.piece) not in pieces:
            raise InputError(
                f"{path}: shaker run at mount '{shaker.mount}', piece '{shaker.piece}', which is "
                "not among the mounts: correct its name"
            )
    for curve in campaign.static_curves:
        if curve.mount not in {mount for mount, _ in pieces}:
            raise InputError(
                f"{path}: static curve of mount '{curve.mount}', which is not among the mounts: "
                "correct its name"
            )


_SPECTRA = (0, 12, 27)
"""UFF function types that hold complex spectra: general, spectrum, order function."""

_FRF = (4,)


def names_of(channels: Sequence[CampaignChannel]) -> tuple[str, ...]:
    """Return the names of channels."""
    return tuple(channel.channel for channel in channels)


def of_quantity(channels: Sequence[CampaignChannel], quantity: str) -> tuple[CampaignChannel, ...]:
    """Return the channels of one quantity, in the order of the table."""
    return tuple(channel for channel in channels if channel.quantity == quantity)


def _columns(
    file: FunctionMatrix, channels: Sequence[CampaignChannel], *, is_complex: bool = True
) -> ComplexArray:
    """Channels of one quantity along the positive axes, in SI, shape (n_line, n_channel)."""
    ordinate, unit = CAMPAIGN_QUANTITIES[channels[0].quantity]
    dofs = [
        Dof(c.channel, c.node, c.direction, sign=c.sign, quantity=c.quantity, unit=c.unit)
        for c in channels
    ]
    return file.values(dofs, ordinate=ordinate, unit=unit, is_complex=is_complex)[:, :, 0]


def _real(file: FunctionMatrix, channels: Sequence[CampaignChannel]) -> RealArray:
    """Real channels of one quantity, shape (n_line, n_channel); there may be none."""
    if not channels:
        return np.empty((file.axis.size, 0))
    return _columns(file, channels, is_complex=False).real


def read_operating_run(
    folder: Path,
    entry: RunEntry,
    campaign: CampaignFile,
    channels: Sequence[CampaignChannel],
    switched_off: Sequence[str],
) -> OperatingRun:
    """Read one operating run."""
    file = FunctionMatrix(folder / entry.file, f"run '{entry.name}' of {entry.mount_set}", _SPECTRA)
    frequency = file.axis
    order = campaign.engine.dominant_order
    file.check_order(order, "correct it, or the dominant_order of the engine")
    speed = _real(file, of_quantity(channels, "engine speed"))[:, 0]
    file.check_speed(speed, order)
    accelerations = of_quantity(channels, "acceleration")
    cells = of_quantity(channels, "cell force")
    slow = of_quantity(channels, "static force")
    acceleration = _columns(file, accelerations)
    for name, column in zip(names_of(accelerations), acceleration.T, strict=True):
        if name not in switched_off and not np.any(column):
            raise file.error(
                f"acceleration '{name}' is dead, 0 at all lines: name it in switched_off, or "
                "measure again"
            )
    torque = _real(file, of_quantity(channels, "engine torque"))[:, 0]
    return OperatingRun(
        name=entry.name,
        mount_set=entry.mount_set,
        gear=entry.gear,
        total_ratio=campaign.engine.total_ratios[entry.gear - 1],
        full_load=entry.full_load,
        torque_limit=entry.torque_nm,
        rising=entry.rising,
        order=order,
        engine_torque=torque,
        acceleration=Spectrum(frequency, acceleration, names_of(accelerations), "m/s^2"),
        cell_force=Spectrum(frequency, _columns(file, cells), names_of(cells), "N"),
        static_force=_real(file, slow),
        static_force_names=names_of(slow),
    )


def read_shaker_run(
    folder: Path, entry: ShakerEntry, cells: Sequence[CampaignChannel]
) -> ShakerRun:
    """Read one run of the shaker."""
    pushed = " ".join(filter(None, (entry.mount, entry.piece, entry.axis)))
    file = FunctionMatrix(folder / entry.file, f"shaker run '{pushed}' {entry.repeat}", _FRF)
    values = _columns(file, cells)
    references = {(f.reference_direction, f.denominator) for f in file.functions}
    for direction, denominator in references:
        if direction.lstrip("+-") != entry.axis or denominator != "force" or len(references) > 1:
            raise file.error(
                f"its reference is {denominator} along '{direction}', expected one force along "
                f"'{entry.axis}': the file or the axis may be swapped"
            )
    sign = -1.0 if references.pop()[0].startswith("-") else 1.0
    response = Frf(file.axis, sign * values[:, :, None], names_of(cells), (pushed,), "N/N")
    return ShakerRun(entry.mount, entry.piece, entry.axis, entry.repeat, response)


def read_push(folder: Path, entry: PushEntry, cells: Sequence[CampaignChannel]) -> PushRun:
    """Read one push beside the virtual point of a mount."""
    run = read_shaker_run(folder, entry, cells)
    direction = np.eye(len(AXES))[AXES.index(entry.axis)]
    response = Frf(
        run.response.frequency, run.response.values, run.response.outputs, (entry.name,), "N/N"
    )
    push = Impact(entry.name, np.array(entry.position_m), direction)
    return PushRun(entry.mount, entry.piece, push, entry.repeat, response)


AXES_4 = ("x", "y", "z")

FEWEST_ACCELEROMETERS = 3
"""On a rigid body: two leave the rotation about the line through them open."""


def check_sensors(
    path: Path, campaign: CampaignFile, sensors: Sequence[Sensor], switched_off: Sequence[str]
) -> None:
    """Check that every body and every mount has the sensors it needs."""
    pieces = [(mount.name, piece) for mount in campaign.mounts for piece in mount.piece_names]
    for sensor in sensors:
        if (sensor.mount, sensor.piece) not in pieces:
            raise InputError(
                f"{path}: sensor '{sensor.name}' is at mount '{sensor.mount}', piece "
                f"'{sensor.piece}', which is not among the mounts: correct it"
            )
    known = {channel: sensor for sensor in sensors for channel in sensor.channels}
    for name in switched_off:
        if name not in known:
            raise InputError(
                f"switched_off names '{name}', which is no channel of {path}: use <sensor> <axis>"
            )
        if known[name].kind is SensorKind.FORCE_CELL:
            raise InputError(
                f"switched_off names '{name}', a force cell: the force of mount "
                f"'{known[name].mount}' needs all its channels; repair the cell and measure again"
            )
    on_powertrain = {mount.name for mount in campaign.mounts if mount.on_powertrain}
    usable = [
        sensor
        for sensor in sensors
        if sensor.kind is SensorKind.ACCELEROMETER
        and any(channel not in switched_off for channel in sensor.channels)
    ]
    n_usable = sum(sensor.mount in on_powertrain for sensor in usable)
    if on_powertrain and n_usable < FEWEST_ACCELEROMETERS:
        raise InputError(
            f"{path}: {n_usable} usable accelerometers on the powertrain, fewer than three: three "
            "that are not on one line are needed to know its motion"
        )
    cells = {(s.mount, s.piece) for s in sensors if s.kind is SensorKind.FORCE_CELL}
    moved = {(sensor.mount, sensor.piece) for sensor in usable}
    for mount, piece in pieces:
        name = " ".join(filter(None, (mount, piece)))
        if (mount, piece) not in cells:
            raise InputError(f"{path}: mount '{name}' has no force cell: add it")
        if mount not in on_powertrain and (mount, piece) not in moved:
            raise InputError(
                f"{path}: mount '{name}' carries a body of its own, which has no usable "
                "accelerometer: add one"
            )


def check_channels(
    path: Path,
    campaign: CampaignFile,
    sensors: Sequence[Sensor],
    channels: Sequence[CampaignChannel],
    switched_off: Sequence[str],
) -> None:
    """Check that every channel belongs to something, and that none is missing."""
    directions = [
        " ".join(filter(None, (mount.name, piece, axis)))
        for mount in campaign.mounts
        for piece in mount.piece_names
        for axis in AXES_4
    ]
    by_kind = {
        kind: [name for s in sensors if s.kind is kind for name in s.channels]
        for kind in SensorKind
    }
    for quantity, expected, belongs in (
        ("acceleration", by_kind[SensorKind.ACCELEROMETER], "accelerometer of the position sheet"),
        ("cell force", by_kind[SensorKind.FORCE_CELL], "force cell of the position sheet"),
        ("static force", directions, "mount, piece and axis"),
    ):
        there = names_of(of_quantity(channels, quantity))
        for name in there:
            if name not in expected:
                raise InputError(
                    f"{path}: {quantity} channel '{name}' fits no {belongs}: correct its name"
                )
        for name in expected:
            if quantity != "static force" and name not in (*there, *switched_off):
                raise InputError(
                    f"{path}: there is no {quantity} channel '{name}': add its row, or name it in "
                    "switched_off"
                )
    needed = [("engine torque", "no preload"), ("engine speed", "no phase: export the tacho")]
    if not campaign.runs:
        needed = needed[:1]
    if campaign.time_runs:
        needed.append(("tacho", "no order"))
    for quantity, without in needed:
        count = len(of_quantity(channels, quantity))
        if count != 1:
            raise InputError(
                f"{path}: {count} channels of quantity '{quantity}', expected one: a run without "
                f"it has {without}"
            )


def check_shaker_directions(path: Path, entries: Sequence[ShakerEntry]) -> None:
    """Check that every mount that was pushed was pushed along all three axes."""
    for mount, piece in dict.fromkeys((entry.mount, entry.piece) for entry in entries):
        pushed = [e.axis for e in entries if (e.mount, e.piece) == (mount, piece)]
        missing = [axis for axis in AXES_4 if axis not in pushed]
        if missing:
            raise InputError(
                f"{path}: mount '{' '.join(filter(None, (mount, piece)))}' has shaker runs along "
                f"{', '.join(dict.fromkeys(pushed))} only: add {', '.join(missing)}; a force "
                "transfer matrix needs all three"
            )


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

    Examples
    --------
    >>> import deboom
    >>> deboom.read_campaign("my_campaign").mount_sets  # doctest: +SKIP
    ('M1', 'M2')
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
        Name of an entry of ``[[time_runs]]``.

    Returns
    -------
    TimeRun
        Tacho, accelerations [m/s²], forces [N] and engine torque [N m] over time,
        (n_sample, n_channel).

    Raises
    ------
    InputError
        No such run; its file is wrong in itself or does not fit the tables.

    Examples
    --------
    >>> import deboom
    >>> deboom.read_time_run("my_campaign", "g5_wot220_time").sample_rate  # doctest: +SKIP
    16384.0
    """
    tables = _read_tables(Path(folder), ())
    entries = {entry.name: entry for entry in tables.file.time_runs}
    if name not in entries:
        raise InputError(
            f"{tables.folder / CAMPAIGN_FILE}: there is no time run '{name}', use "
            f"{', '.join(entries) or 'a campaign that has one'}"
        )
    entry = entries[name]
    file = FunctionMatrix(tables.folder / entry.file, f"time run '{name}'", _TIME)
    time = file.axis
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
        tacho=_real(file, of_quantity(tables.channels, "tacho"))[:, 0],
        pulses_per_revolution=entry.pulses_per_revolution,
        engine_torque=_real(file, of_quantity(tables.channels, "engine torque"))[:, 0],
        acceleration=_real(file, accelerations),
        acceleration_channels=names_of(accelerations),
        cell_force=_real(file, cells),
        cell_force_channels=names_of(cells),
        static_force=_real(file, slow),
        static_force_names=names_of(slow),
    )


def _read_tables(folder: Path, switched_off: Sequence[str]) -> _Tables:
    file = load_campaign_file(folder / CAMPAIGN_FILE)
    off = tuple(dict.fromkeys((*file.switched_off, *switched_off)))
    sheet, table = folder / file.sensor_table, folder / file.channel_table
    sensors = tuple(map(sensor_of, read_table(sheet, SensorRow)))
    channels = read_table(table, CampaignChannel)
    check_sensors(sheet, file, sensors, off)
    check_channels(table, file, sensors, channels, off)
    return _Tables(folder, file, _mounts(folder, file), sensors, channels, off)


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
    positions = {(row.mount, row.piece): row.position for row in read_table(path, MountRow)}
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


ORDER_SPECTRUM = 0
"""UFF function type; the order stands in the first ID line."""

ENTITY_NAME = 10
"""Characters of a channel's name that UFF keeps; the DoF is what counts."""

ID_LINE = 80
"""Characters of an ID line."""


def new_run_file(folder: Path, mount_set: str, name: str) -> Path:
    """Return where the file of a new operating run goes.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    mount_set, name : str
        Of the run.

    Raises
    ------
    InputError
        The run is there already, or a file in its place; a name with a blank or a slash.
    """
    path = Path(folder) / CAMPAIGN_FILE
    file = load_campaign_file(path)
    if not name or any(c.isspace() or c in '/\\:*?"<>|' for c in name) or name.startswith("."):
        raise InputError(f"'{name}' is no name of a run: use letters, digits, _ and -")
    if (mount_set, name) in [(run.mount_set, run.name) for run in file.runs]:
        raise InputError(
            f"{path}: run '{name}' of mount set {mount_set} is there already: choose another name"
        )
    place = path.parent / _relative(mount_set, name)
    if place.exists():
        raise InputError(
            f"{place} is there already, though no run of {CAMPAIGN_FILE} has it: move it away, or "
            "choose another name"
        )
    return place


def add_operating_run(folder: Path, run: OperatingRun, notes: Sequence[str] = ()) -> Path:
    """Add an operating run to a campaign, in SI; the campaign has all of it or stays as it was.

    Parameters
    ----------
    folder : Path
        Of the campaign.
    run : OperatingRun
        With the channels of the campaign's channel table.
    notes : sequence of str
        Up to two lines on where it comes from, for the ID lines of the file; they are cut at 80
        characters.

    Returns
    -------
    Path
        The file of its spectra.

    Raises
    ------
    InputError
        As `new_run_file`; a channel of the table that the run does not have; a table without
        engine speed; files that cannot be written.
    """
    place = new_run_file(folder, run.mount_set, run.name)
    path = Path(folder) / CAMPAIGN_FILE
    file = load_campaign_file(path)
    table = path.parent / file.channel_table
    channels = read_table(table, CampaignChannel)
    entry = RunEntry(
        name=run.name,
        mount_set=run.mount_set,
        gear=run.gear,
        full_load=run.full_load,
        torque_nm=run.torque_limit,
        rising=run.rising,
        file=_relative(run.mount_set, run.name),
    )
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{place.parent} cannot be made ({error.strerror or error})") from None
    functions = _functions(table, channels, run, notes)
    write_uff(place, functions, binary=True)
    try:
        _check_new_run(path, file, entry, channels)
        append_toml(path, file, "runs", entry)
    except BaseException:
        place.unlink(missing_ok=True)
        raise
    return place


def _relative(mount_set: str, name: str) -> str:
    return f"runs/{mount_set}/{name}.uff"


def _check_new_run(
    path: Path, file: CampaignFile, entry: RunEntry, channels: Sequence[CampaignChannel]
) -> None:
    """Read the new file as the campaign will be read."""
    read_operating_run(path.parent, entry, file, channels, file.switched_off)


def _functions(
    table: Path,
    channels: Sequence[CampaignChannel],
    run: OperatingRun,
    notes: Sequence[str],
) -> list[UffFunction]:
    if len(of_quantity(channels, "engine speed")) != 1:
        raise InputError(
            f"{table}: an operating run needs one channel of quantity 'engine speed': add its row "
            "with a node of its own, direction scalar and unit rpm"
        )
    speed = rpm_of_frequency(run.frequency, run.order)
    slow = dict(zip(run.static_force_names, run.static_force.T, strict=True))
    columns: dict[str, dict[str, RealArray | ComplexArray]] = {
        "acceleration": dict(
            zip(run.acceleration.channels, run.acceleration.values.T, strict=True)
        ),
        "cell force": dict(zip(run.cell_force.channels, run.cell_force.values.T, strict=True)),
        "static force": slow,
        "engine torque": dict.fromkeys(
            names_of(of_quantity(channels, "engine torque")), run.engine_torque
        ),
        "engine speed": dict.fromkeys(names_of(of_quantity(channels, "engine speed")), speed),
    }
    title = f"{run.name}, mount set {run.mount_set}"
    lines = [f"order {run.order:g}", title, *[*notes, "", ""][:2], IN_SI]
    functions = []
    for quantity, of_channel in columns.items():
        ordinate, unit = CAMPAIGN_QUANTITIES[quantity]
        for channel in of_quantity(channels, quantity):
            if channel.channel not in of_channel:
                raise InputError(
                    f"run {run.name} has no {quantity} '{channel.channel}', which {table} asks for"
                )
            values = of_channel[channel.channel]
            functions.append(
                UffFunction(
                    abscissa=run.frequency,
                    values=values if channel.sign > 0 else -values,
                    function_type=ORDER_SPECTRUM,
                    response_node=channel.node,
                    response_direction=channel.direction,
                    reference_node=0,
                    reference_direction="scalar",
                    ordinate=ordinate,
                    ordinate_unit=unit,
                    denominator="none",
                    denominator_unit="",
                    id_lines=tuple(line[:ID_LINE] for line in lines),
                    response_name=channel.channel.replace(" ", "")[:ENTITY_NAME],
                )
            )
    return functions
