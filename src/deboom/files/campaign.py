"""A campaign folder, read and checked: raw channels of many runs on one bench, in SI; new runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.function_table import (
    FRF,
    IN_SI,
    TIME_SIGNAL,
    Dof,
    FunctionMatrix,
    with_their_tables,
)
from deboom.files.kinds import FolderKind
from deboom.files.platform import SPECTRA, Engine, EngineTorque, MountEntry, mounts_of
from deboom.files.platform import PowertrainEntry as Powertrain
from deboom.files.rows import (
    CAMPAIGN_QUANTITIES,
    CampaignChannel,
    MountRow,
    SensorRow,
    read_curve,
    sensor_of,
)
from deboom.files.schema import (
    AtLeastOne,
    Axis,
    FolderRecord,
    Name,
    NotNegative,
    Number,
    RelativePath,
    Several,
    StrictModel,
    Temperature,
    append_toml,
    assumed_lines,
    beyond_gears,
    doubled,
    for_each,
    load_toml,
    noting,
    refuse_all,
    same_file,
    telling,
    values_of,
    within,
)
from deboom.files.sensor_classes import completed
from deboom.files.tables import read_table
from deboom.files.time_data import time_functions
from deboom.files.uff import UffFunction, write_uff
from deboom.measurement.campaign import (
    Campaign,
    OperatingRun,
    ShakerRun,
    StaticCurve,
    TimeRun,
    excited_loads,
)
from deboom.measurement.channels import Frf
from deboom.measurement.sensors import Sensor, SensorKind, Tolerances
from deboom.measurement.virtual_point import RIGID_LOADS
from deboom.mounts.mount import Mount
from deboom.names import look_alikes, name_fault
from deboom.physics.order_tracking import dominant_order, rpm_of_frequency
from deboom.physics.rigid_body import mass_matrix


class CampaignMount(MountEntry):
    """One mount."""

    on_powertrain: bool  # it carries the powertrain; else each piece carries a body of its own


Load = Literal["fx", "fy", "fz", "mx", "my", "mz"]


class CampaignEngine(Engine):
    """The engine of a campaign, and what excites it at its dominant order."""

    # four cylinders: whether shafts balance their vertical mass force
    balancer_shafts: bool | None = None
    # loads of the engine on itself besides the mounts, where cylinders and shafts do not say it
    excited: AtLeastOne[Load] | None = None

    @property
    def loads(self) -> tuple[str, ...]:
        """Loads on the powertrain besides the mounts."""
        return self.excited or excited_loads(self.cylinders, self.balancer_shafts)

    def load_faults(self) -> Iterator[str]:
        """Give a sentence for loads that are stated twice, and for those that nobody can know."""
        if self.excited is not None:
            yield from doubled("[engine] excited names", self.excited)
            if len(set(self.excited)) == len(RIGID_LOADS):
                yield (
                    "[engine] excited names all six loads: nothing would be left that the mounts "
                    "must balance; leave out those that the engine does not make"
                )
            if self.balancer_shafts is not None:
                yield (
                    "[engine] has both excited and balancer_shafts: excited stands for what the "
                    "shafts leave, take balancer_shafts out"
                )
        elif self.cylinders and self.dominant_order != dominant_order(self.cylinders):
            yield (
                f"[engine] has {self.cylinders} cylinders, which fire at order "
                f"{dominant_order(self.cylinders):g}, and dominant_order {self.dominant_order:g}: "
                "correct one of both, or say with excited which loads act at this order, such as "
                'excited = ["mx", "my", "mz"]'
            )


class ToleranceEntry(StrictModel):
    """Standard deviations of what the bench states only approximately.

    What is left out is the default of its sensor's class.
    """

    # of an accelerometer, per axis
    sensor_position_m: (
        Annotated[NotNegative, within(0.0, 0.1, "nothing is placed that badly, in m: is it in mm?")]
        | None
    ) = None
    # of an accelerometer, per axis
    sensor_angle_rad: (
        Annotated[
            NotNegative, within(0.0, 0.35, "no angle is off by 20 degrees: is it in degrees?")
        ]
        | None
    ) = None
    # of an accelerometer channel [1]
    sensor_gain: (
        Annotated[
            NotNegative, within(0.0, 0.5, "a relative tolerance is below 0.5: is it in percent?")
        ]
        | None
    ) = None
    sensor_cross_axis: NotNegative | None = None  # of an accelerometer channel [1]
    acceleration_own: NotNegative | None = None  # noise per amplitude of the channel [1]
    acceleration_norm: NotNegative | None = None  # noise per norm of the triaxial sensor [1]
    acceleration_floor_m_s2: NotNegative | None = None  # noise at rest
    cell_gain: NotNegative | None = None  # of a cell that no shaker calibrates [1]
    force_own: NotNegative | None = None  # noise per amplitude of the channel [1]
    force_norm: NotNegative | None = None  # noise per norm of the triaxial cell [1]
    force_floor_n: NotNegative | None = None  # noise at rest
    # of the shaker against its nominal axis, per axis
    shaker_angle_rad: NotNegative | None = None
    shaker_gain: NotNegative | None = None  # of the force the shaker states [1]
    torque_nm: NotNegative | None = None  # of the engine, per line
    static_force_n: NotNegative | None = None  # of the quasi-static cell force, per line


class RunEntry(StrictModel):
    """One operating run and the file of its spectra."""

    name: Name  # such as g5_wot220; a mount set has it once
    mount_set: Name  # parts on the bench
    gear: Number
    full_load: bool  # ramp with wide open throttle; else a slice at constant torque
    torque_nm: EngineTorque  # limit of a ramp, torque of a slice
    rising: bool  # direction of the engine speed
    file: RelativePath


class ShakerEntry(StrictModel):
    """One run of the shaker at the virtual point of a mount."""

    mount: Name
    piece: str  # "" for a single one
    axis: Axis  # nominal direction of the force
    repeat: Number
    file: RelativePath


class CurveEntry(StrictModel):
    """One force-deflection curve of a supplier."""

    mount: Name
    axis: Axis
    mount_set: Name  # part that was measured
    force_uncertainty: NotNegative  # standard deviation of the curve's scale [1]
    file: RelativePath  # CSV


class TimeRunEntry(RunEntry):
    """One run recorded over time."""

    pulses_per_revolution: Number  # of the tacho: pitches, missing teeth included


class CampaignFile(StrictModel):
    """The whole file ``campaign.toml``."""

    format: Literal[1]
    name: Name  # short key of the campaign
    title: str  # what a reader calls it
    description: str  # a paragraph for the report
    mount_table: RelativePath  # virtual points, CSV or Excel
    sensor_table: RelativePath  # position sheet, CSV or Excel
    channel_table: RelativePath  # which UFF node and direction is which channel
    switched_off: Several[str] = ()  # channels not to be used, such as "A3 y"
    test_temperature_c: Temperature | None = None  # of the mounts
    engine: CampaignEngine
    powertrain: Powertrain | None = None  # nominal rigid-body data
    tolerances: ToleranceEntry = ToleranceEntry()
    mounts: AtLeastOne[CampaignMount]  # in the order of the platform
    runs: Several[RunEntry] = ()  # operating runs
    shaker_runs: Several[ShakerEntry] = ()  # for the force transfer matrices
    static_curves: Several[CurveEntry] = ()  # from suppliers
    time_runs: Several[TimeRunEntry] = ()

    @property
    def untracked_runs(self) -> tuple[TimeRunEntry, ...]:
        """Runs over time of which there is no operating run of the same name and mount set."""
        tracked = [(run.mount_set, run.name) for run in self.runs]
        return tuple(run for run in self.time_runs if (run.mount_set, run.name) not in tracked)

    @property
    def pieces(self) -> tuple[tuple[str, str], ...]:
        """Mount and piece of every virtual point."""
        return tuple((mount.name, piece) for mount in self.mounts for piece in mount.piece_names)

    def faults(self) -> Iterator[str]:
        """Give a sentence for what comes twice, and for gears and mounts that are not there."""
        for section, verb, keys in _UNIQUE:
            rows = [tuple(getattr(entry, key) for key in keys) for entry in getattr(self, section)]
            yield from doubled(f"[[{section}]] {verb}", rows)
        for what, section, key in (
            ("mount", "mounts", "name"),
            ("run", "runs", "name"),
            ("mount set", "runs", "mount_set"),
            ("time run", "time_runs", "name"),
        ):
            yield from look_alikes(what, [getattr(entry, key) for entry in getattr(self, section)])
        yield from doubled("switched_off are named", self.switched_off)
        yield from same_file("runs", "file", self.runs)
        yield from self.engine.load_faults()
        gears = [(run.name, run.gear) for run in (*self.runs, *self.time_runs)]
        yield from beyond_gears("run", gears, self.engine.total_ratios)
        for shaker in self.shaker_runs:
            if (shaker.mount, shaker.piece) not in self.pieces:
                yield (
                    f"shaker run at mount '{shaker.mount}', piece '{shaker.piece}', which is not "
                    "among the mounts: correct its name"
                )
        for curve in self.static_curves:
            if curve.mount not in {mount for mount, _ in self.pieces}:
                yield (
                    f"static curve of mount '{curve.mount}', which is not among the mounts: "
                    "correct its name"
                )


_UNIQUE = (
    ("mounts", "are named", ("name",)),
    ("runs", "of one mount set are named", ("mount_set", "name")),
    ("shaker_runs", "are of", ("mount", "piece", "axis", "repeat")),
    ("static_curves", "are of", ("mount_set", "mount", "axis")),
    ("time_runs", "are named", ("name",)),
)
"""Sections, the verb of the sentence, and the keys that no other entry of the section repeats."""


Channels = Mapping[str, tuple[Dof, ...]]
"""Quantity, a key of `CAMPAIGN_QUANTITIES` → DoF of its channels, in the order of the table."""


def _by_quantity(rows: Sequence[CampaignChannel]) -> Channels:
    return {
        quantity: tuple(row.dof for row in rows if row.quantity == quantity)
        for quantity in CAMPAIGN_QUANTITIES
    }


def names_of(dofs: Sequence[Dof]) -> tuple[str, ...]:
    """Return the names of channels."""
    return tuple(dof.name for dof in dofs)


def _facts(entry: RunEntry, engine: Engine) -> dict[str, Any]:
    """Return what is stated of a run."""
    return {
        "total_ratio": engine.total_ratios[entry.gear - 1],
        "torque_limit": entry.torque_nm,
        "order": engine.dominant_order,
        **entry.model_dump(include={"name", "mount_set", "gear", "full_load", "rising"}),
    }


def _operating_run(tables: _Tables, entry: RunEntry) -> OperatingRun:
    what = f"run '{entry.name}' of {entry.mount_set}"
    file = FunctionMatrix(tables.folder / entry.file, what, SPECTRA)
    engine, channels, of = tables.file.engine, tables.channels, CAMPAIGN_QUANTITIES
    facts = _facts(entry, engine)
    file.check_order(engine.dominant_order, "correct it, or the dominant_order of the engine")
    speed = file.real(channels["engine speed"], *of["engine speed"])[:, 0]
    file.check_speed(speed, engine.dominant_order)
    acceleration = file.spectrum(channels["acceleration"], *of["acceleration"])
    for name, column in zip(acceleration.channels, acceleration.values.T, strict=True):
        if name not in tables.switched_off and not np.any(column):
            raise file.error(
                f"acceleration '{name}' is dead, 0 at all lines: name it in switched_off, or "
                "measure again"
            )
    return OperatingRun(
        **facts,
        engine_torque=file.real(channels["engine torque"], *of["engine torque"])[:, 0],
        acceleration=acceleration,
        cell_force=file.spectrum(channels["cell force"], *of["cell force"]),
        static_force=file.real(channels["static force"], *of["static force"]),
        static_force_names=names_of(channels["static force"]),
    )


def _shaker_run(tables: _Tables, entry: ShakerEntry) -> ShakerRun:
    at = entry.mount, entry.piece
    below = {name for s in tables.sensors if (s.mount, s.piece) == at for name in s.channels}
    cells = [dof for dof in tables.channels["cell force"] if dof.name in below]
    pushed = " ".join(filter(None, (entry.mount, entry.piece, entry.axis)))
    what = f"shaker run '{pushed}' {entry.repeat}"
    file = FunctionMatrix(tables.folder / entry.file, what, (FRF,))
    references = {(f.reference_direction, f.denominator) for f in file.functions}
    for direction, denominator in references:
        if direction.lstrip("+-") != entry.axis or denominator != "force" or len(references) > 1:
            raise file.error(
                f"its reference is {denominator} along '{direction}', expected one force along "
                f"'{entry.axis}': the file or the axis may be swapped"
            )
    force = file.spectrum(cells, "force", "N/N")
    sign = -1.0 if references.pop()[0].startswith("-") else 1.0
    response = Frf(file.axis, sign * force.values[:, :, None], force.channels, (pushed,), "N/N")
    return ShakerRun(entry.mount, entry.piece, entry.axis, entry.repeat, response)


def _static_curve(folder: Path, entry: CurveEntry) -> StaticCurve:
    curve = read_curve(folder / entry.file)
    return StaticCurve(entry.mount, entry.axis, entry.mount_set, *curve, entry.force_uncertainty)


FEWEST_ACCELEROMETERS = 3
"""On a rigid body: two leave the rotation about the line through them open."""


def _sensor_faults(
    path: Path, campaign: CampaignFile, sensors: Sequence[Sensor], switched_off: Sequence[str]
) -> Iterator[str]:
    """Give a sentence for every body and mount that lacks sensors, and for unknown names."""
    for sensor in sensors:
        if (sensor.mount, sensor.piece) not in campaign.pieces:
            yield (
                f"{path}: sensor '{sensor.name}' is at mount '{sensor.mount}', piece "
                f"'{sensor.piece}', which is not among the mounts: correct it"
            )
    sensor_of_channel = {channel: sensor for sensor in sensors for channel in sensor.channels}
    for name in switched_off:
        if name not in sensor_of_channel:
            yield f"switched_off names '{name}', which is no channel of {path}: use <sensor> <axis>"
        elif sensor_of_channel[name].kind is SensorKind.FORCE_CELL:
            yield (
                f"switched_off names '{name}', a force cell: the force of mount "
                f"'{sensor_of_channel[name].mount}' needs all its channels; repair the cell and "
                "measure again"
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
        yield (
            f"{path}: {n_usable} usable accelerometers on the powertrain, fewer than three: three "
            "that are not on one line are needed to know its motion"
        )
    cells = {(s.mount, s.piece) for s in sensors if s.kind is SensorKind.FORCE_CELL}
    moved = {(sensor.mount, sensor.piece) for sensor in usable}
    for mount, piece in campaign.pieces:
        name = " ".join(filter(None, (mount, piece)))
        if (mount, piece) not in cells:
            yield f"{path}: mount '{name}' has no force cell: add it"
        if mount not in on_powertrain and (mount, piece) not in moved:
            yield (
                f"{path}: mount '{name}' carries a body of its own, which has no usable "
                "accelerometer: add one"
            )


def _channel_faults(
    path: Path,
    campaign: CampaignFile,
    sensors: Sequence[Sensor],
    channels: Channels,
    switched_off: Sequence[str],
) -> Iterator[str]:
    """Give a sentence for every channel that belongs to nothing, and for every missing one."""
    directions = [
        " ".join(filter(None, (*piece, axis))) for piece in campaign.pieces for axis in AXES
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
        listed = names_of(channels[quantity])
        for name in listed:
            if name not in expected:
                yield f"{path}: {quantity} channel '{name}' fits no {belongs}: correct its name"
        for name in expected:
            if quantity != "static force" and name not in (*listed, *switched_off):
                yield (
                    f"{path}: there is no {quantity} channel '{name}': add its row, or name it in "
                    "switched_off"
                )
    for quantity, runs, without in (
        ("engine torque", True, "no preload"),
        ("engine speed", campaign.runs, "no phase: export the tacho"),
        ("tacho", campaign.time_runs, "no order"),
    ):
        count = len(channels[quantity])
        if runs and count != 1:
            yield (
                f"{path}: {count} channels of quantity '{quantity}', expected one: a run without "
                f"it has {without}"
            )


def _direction_faults(path: Path, entries: Sequence[ShakerEntry]) -> Iterator[str]:
    """Give a sentence for every mount that was pushed, but not along all three axes."""
    for mount, piece in dict.fromkeys((entry.mount, entry.piece) for entry in entries):
        pushed = [e.axis for e in entries if (e.mount, e.piece) == (mount, piece)]
        missing = [axis for axis in AXES if axis not in pushed]
        if missing:
            yield (
                f"{path}: mount '{' '.join(filter(None, (mount, piece)))}' has shaker runs along "
                f"{', '.join(dict.fromkeys(pushed))} only: add {', '.join(missing)}; a force "
                "transfer matrix needs all three"
            )


CAMPAIGN_FILE = "campaign.toml"

UNWEIGHED = (
    f"{CAMPAIGN_FILE} states no [powertrain]: without mass and inertia Newton's law cannot hold "
    "forces against motion, so that intervals are wider and a faulty cell may pass; add "
    "[powertrain] as `deboom new campaign` shows it."
)


@dataclass(frozen=True, eq=False)
class _Tables:
    """What all runs of a campaign share."""

    folder: Path
    file: CampaignFile
    mounts: tuple[Mount, ...]
    sensors: tuple[Sensor, ...]
    rows: tuple[CampaignChannel, ...]
    channels: Channels
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

    See Also
    --------
    deboom.characterise, deboom.read_time_run, deboom.virtual_point

    Examples
    --------
    >>> import deboom
    >>> deboom.read_campaign("my_campaign").mount_sets  # doctest: +SKIP
    ('M1', 'M2')
    """
    tables = _read_tables(Path(folder), switched_off)
    folder, file, path = tables.folder, tables.file, tables.folder / CAMPAIGN_FILE
    sets = tuple(dict.fromkeys(run.mount_set for run in file.runs))
    if not sets:
        raise InputError(f"{path}: no [[runs]]: add at least one")
    wanted = sets if mount_sets is None else tuple(dict.fromkeys(mount_sets))
    unknown = [name for name in wanted if name not in sets]
    if unknown or not wanted:
        raise InputError(
            f"{path}: there is no mount set '{', '.join(unknown)}', use {', '.join(sets)}"
        )
    refuse_all(_direction_faults(path, file.shaker_runs))
    runs = [entry for entry in file.runs if entry.mount_set in wanted]
    curves = [entry for entry in file.static_curves if entry.mount_set in wanted]
    read = [run.file for run in runs]
    read += [shaker.file for shaker in file.shaker_runs]
    read += [curve.file for curve in curves]
    with telling() as tell:
        with noting(tell):
            operating_runs = for_each(lambda entry: _operating_run(tables, entry), runs)
        with noting(tell):
            shaker_runs = for_each(lambda entry: _shaker_run(tables, entry), file.shaker_runs)
        with noting(tell):
            static_curves = for_each(lambda entry: _static_curve(folder, entry), curves)
    tolerances, defaults = completed(file.tolerances, CAMPAIGN_FILE)
    powertrain = file.powertrain
    return Campaign(
        name=file.name,
        mounts=tables.mounts,
        powertrain_mounts=tuple(mount.name for mount in file.mounts if mount.on_powertrain),
        sensors=tables.sensors,
        switched_off=tables.switched_off,
        mount_sets=wanted,
        runs=operating_runs,
        shaker_runs=shaker_runs,
        static_curves=static_curves,
        mass_matrix=mass_matrix(powertrain.mass_kg, powertrain.inertia_kg_m2)
        if powertrain
        else None,
        mass_tolerance=powertrain.mass_tolerance_kg if powertrain else 0.0,
        inertia_tolerance=powertrain.inertia_tolerance if powertrain else 0.0,
        centre_of_gravity_tolerance=powertrain.centre_of_gravity_tolerance_m if powertrain else 0.0,
        total_ratios=file.engine.total_ratios,
        order=file.engine.dominant_order,
        tolerances=Tolerances(**values_of(tolerances)),
        input_files=(*tables.paths, *with_their_tables(folder / name for name in read)),
        excited=file.engine.loads,
        assumed=defaults if powertrain else (*defaults, UNWEIGHED),
        test_temperature=file.test_temperature_c,
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
        Tacho [1] and engine torque [N m] over time, (n_sample,); accelerations [m/s²], cell forces
        and static forces [N], (n_sample, n_channel).

    Raises
    ------
    InputError
        No such run; its file is wrong in itself or does not fit the tables.

    See Also
    --------
    deboom.tracked_run, deboom.read_campaign

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
    path = tables.folder / entry.file
    recorded = [row for row in tables.rows if row.quantity != "engine speed"]
    read = time_functions(path, recorded)
    file = FunctionMatrix(path, f"time run '{name}'", (TIME_SIGNAL,), read.functions)
    vibration = [
        rate
        for function, rate in zip(read.functions, read.rates, strict=True)
        if (function.response_node, function.ordinate)
        in {
            (row.node, row.ordinate)
            for row in recorded
            if row.quantity in ("acceleration", "cell force")
        }
    ]
    time, channels, of = file.axis, tables.channels, CAMPAIGN_QUANTITIES
    return TimeRun(
        **_facts(entry, tables.file.engine),
        sample_rate=(time.size - 1) / float(time[-1] - time[0]),
        tacho=file.real(channels["tacho"], *of["tacho"])[:, 0],
        pulses_per_revolution=entry.pulses_per_revolution,
        engine_torque=file.real(channels["engine torque"], *of["engine torque"])[:, 0],
        acceleration=file.real(channels["acceleration"], *of["acceleration"]),
        acceleration_channels=names_of(channels["acceleration"]),
        cell_force=file.real(channels["cell force"], *of["cell force"]),
        cell_force_channels=names_of(channels["cell force"]),
        static_force=file.real(channels["static force"], *of["static force"]),
        static_force_names=names_of(channels["static force"]),
        vibration_rate=min(vibration, default=None),
        notes=read.notes,
    )


def _read_tables(folder: Path, switched_off: Sequence[str]) -> _Tables:
    file = load_toml(folder / CAMPAIGN_FILE, CampaignFile)
    off = tuple(dict.fromkeys((*file.switched_off, *switched_off)))
    sheet, table, positions = (
        folder / name for name in (file.sensor_table, file.channel_table, file.mount_table)
    )
    with telling() as tell:
        with noting(tell):
            sensors = tuple(map(sensor_of, read_table(sheet, SensorRow)))
        with noting(tell):
            rows = read_table(table, CampaignChannel)
        with noting(tell):
            places = read_table(positions, MountRow)
    mounts = mounts_of(folder / CAMPAIGN_FILE, file.mounts, positions, places)
    # on the bench, the body of a mount is the one of its platform
    mounts = tuple(replace(mount, body_mass=None, body_mass_tolerance=0.0) for mount in mounts)
    channels = _by_quantity(rows)
    faults = [*_sensor_faults(sheet, file, sensors, off)]
    faults += _channel_faults(table, file, sensors, channels, off)
    refuse_all(faults)
    return _Tables(folder, file, mounts, sensors, rows, channels, off)


ORDER_SPECTRUM = 0
"""UFF function type; the order stands in the first ID line."""

ID_LINE = 80
"""Characters of an ID line."""


def new_run_file(folder: Path, mount_set: str, name: str) -> Path:
    """Return where the file of a new operating run goes.

    - `folder`: of the campaign.
    - `mount_set`, `name`: of the run.
    - raises InputError: the run is there already, or a file in its place; a name that is empty,
      begins with a dot, or has a blank or a character that file names may not have.
    """
    path = Path(folder) / CAMPAIGN_FILE
    file = load_toml(path, CampaignFile)
    if fault := name_fault(name):
        raise InputError(f"'{name}' is no name of a run: {fault}")
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

    - `folder`: of the campaign.
    - `run`: with the channels of the campaign's channel table.
    - `notes`: up to two lines on where it comes from, for the ID lines of the file; they are cut at
      80 characters.
    - returns: the file of its spectra.
    - raises InputError: as `new_run_file`; a channel of the table that the run does not have; a
      table without engine speed; files that cannot be written.
    """
    place = new_run_file(folder, run.mount_set, run.name)
    tables = _read_tables(Path(folder), ())
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
    write_uff(place, _functions(tables, run, notes), binary=True)
    try:
        # the campaign must be able to read it
        _operating_run(tables, entry)
        append_toml(tables.folder / CAMPAIGN_FILE, tables.file, "runs", entry)
    except BaseException:
        place.unlink(missing_ok=True)
        raise
    return place


def _relative(mount_set: str, name: str) -> str:
    return f"runs/{mount_set}/{name}.uff"


def _functions(tables: _Tables, run: OperatingRun, notes: Sequence[str]) -> list[UffFunction]:
    channels, table = tables.channels, tables.folder / tables.file.channel_table
    if len(channels["engine speed"]) != 1:
        raise InputError(
            f"{table}: an operating run needs one channel of quantity 'engine speed': add its row "
            "with a node of its own, direction scalar and unit rpm"
        )
    speed = rpm_of_frequency(run.frequency, run.order)
    by_quantity: dict[str, dict[str, RealArray | ComplexArray]] = {
        "acceleration": dict(
            zip(run.acceleration.channels, run.acceleration.values.T, strict=True)
        ),
        "cell force": dict(zip(run.cell_force.channels, run.cell_force.values.T, strict=True)),
        "static force": dict(zip(run.static_force_names, run.static_force.T, strict=True)),
        "engine torque": dict.fromkeys(names_of(channels["engine torque"]), run.engine_torque),
        "engine speed": dict.fromkeys(names_of(channels["engine speed"]), speed),
    }
    title = f"{run.name}, mount set {run.mount_set}"
    lines = [f"order {run.order:g}", title, *[*notes, "", ""][:2], IN_SI]
    id_lines = tuple(line[:ID_LINE] for line in lines)
    functions = []
    for quantity, values in by_quantity.items():
        for dof in channels[quantity]:
            if dof.name not in values:
                raise InputError(
                    f"run {run.name} has no {quantity} '{dof.name}', which {table} asks for"
                )
            of = CAMPAIGN_QUANTITIES[quantity]
            functions.append(
                dof.function(run.frequency, values[dof.name], ORDER_SPECTRUM, *of, id_lines)
            )
    return functions


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Give name and text of each line on what a folder holds."""
    campaign = read_campaign(folder)
    lines = campaign.runs[0].acceleration.frequency
    yield "campaign", campaign.name
    yield "mounts", ", ".join(mount.name for mount in campaign.mounts)
    yield (
        "sensors",
        f"{len(campaign.sensors)}, switched off: {', '.join(campaign.switched_off) or 'none'}",
    )
    yield "runs", f"{len(campaign.runs)} of mount sets {', '.join(campaign.mount_sets)}"
    yield "lines", f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz of order {campaign.order:g}"
    yield "shaker", f"{len(campaign.shaker_runs)} runs"
    yield "curves", f"{len(campaign.static_curves)} of suppliers"
    yield from assumed_lines(campaign.assumed)


CAMPAIGN: FolderRecord = FolderRecord(
    kind=FolderKind.campaign,
    file=CAMPAIGN_FILE,
    keys=CampaignFile,
    command="deboom characterise {} --library mounts.db",
    guide="Your own data",
    lines=_lines,
)
