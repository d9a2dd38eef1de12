"""The folders of component TPA: an assembly of source and receiver, and another receiver."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.errors import InputError, naming
from deboom.files.function_table import (
    FRF,
    Dof,
    FunctionMatrix,
    first_difference,
    read_function_table,
    same_lines,
    with_their_tables,
)
from deboom.files.inertance_test import (
    Places,
    ToleranceSection,
    functions_of_type,
    read_coherences,
    read_inertances,
    read_placed,
)
from deboom.files.kinds import FolderKind
from deboom.files.platform import SPECTRA
from deboom.files.rows import PlacedImpact, PlacedSensor, impact_of, sensor_of
from deboom.files.schema import (
    AtLeastOne,
    FolderRecord,
    NotNegative,
    Number,
    Positive,
    RelativePath,
    Row3,
    Several,
    StrictModel,
    Title,
    assumed_lines,
    doubled,
    load_toml,
    refuse_all,
    same_file,
    warning_lines,
    within,
)
from deboom.files.vehicle import EarEntry, far_from_its_point
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.component_findings import component_findings
from deboom.measurement.component_test import (
    ComponentTest,
    InterfacePoint,
    MountJoint,
    ReceiverTest,
    SourceRun,
    refuse_other_functions_of_points,
    refuse_undetermined,
    refuse_wrong_sheets,
)
from deboom.measurement.noise_transfer import PRESSURE_PER_FORCE
from deboom.measurement.uncertainty import DB_PER_NEPER
from deboom.measurement.virtual_point import RIGID_MOTIONS

COMPONENT_FILE = "component.toml"
RECEIVER_FILE = "receiver.toml"


class PointSection(StrictModel):
    """One place where source and receiver are joined."""

    name: Title  # such as mount 1
    position_m: Row3  # virtual point, from the origin of the position sheets
    # 6 with rotations and moments, 3 with translations and forces alone
    degrees_of_freedom: Literal[3, 6]
    sensors: AtLeastOne[Title]  # accelerometers of the position sheet around it
    impacts: AtLeastOne[Title]  # hits of the position sheet around it


class SpectrumDeviations(StrictModel):
    """Standard deviation of the real and of the imaginary part of a spectrum."""

    relative: NotNegative  # over the amplitude [1]
    floor_m_s2: Positive  # of the accelerometers
    # of the calibration of a microphone, in functions and spectra alike
    microphone_db: Annotated[NotNegative, within(0.0, 6.0, "no microphone is that far off, in dB")]


class SourceRunSection(StrictModel):
    """One state of operation."""

    name: Title  # such as 3000 rpm
    spectra: RelativePath  # UFF: accelerations and pressures with one phase reference
    order: Positive | None = None  # engine order of its lines; left out for a spectrum


class ComponentTestFile(StrictModel):
    """The whole file ``component.toml``."""

    format: Literal[1]
    title: Title  # what a reader calls the test
    sensor_table: RelativePath  # CSV, or sheet "sensors" of an Excel file
    impact_table: RelativePath  # CSV, or sheet "impacts" of an Excel file
    accelerance: RelativePath  # UFF: acceleration per force of every hit
    coherence: RelativePath  # UFF of their ordinary coherence; may be the same file
    pressure: RelativePath  # UFF: pressure per force of every hit, and its coherence
    hits_per_impact: Number  # how many hits the functions average
    on_board: Several[Title] = ()  # accelerometers that inversions leave out, for validation
    source_impacts: Several[Title] = ()  # hits on the source, away from its interface
    free_accelerance: RelativePath | None = None  # UFF: the source alone, hung up freely
    tolerances: ToleranceSection = ToleranceSection()  # of everything placed and struck
    deviations: SpectrumDeviations  # how well the spectra in operation are known
    points: AtLeastOne[PointSection]  # interface, complete
    ears: AtLeastOne[EarEntry]  # targets
    runs: AtLeastOne[SourceRunSection]

    def faults(self) -> Iterator[str]:
        """Give a sentence for what comes twice or belongs to two things."""
        yield from doubled("[[points]] are named", [point.name for point in self.points])
        sensors = [n for point in self.points for n in point.sensors]
        impacts = [n for point in self.points for n in point.impacts]
        yield from doubled("[[points]] and on_board have the sensor", [*sensors, *self.on_board])
        yield from doubled(
            "[[points]] and source_impacts have the impact", [*impacts, *self.source_impacts]
        )
        yield from doubled("[[ears]] are named", [ear.name for ear in self.ears])
        yield from doubled("[[runs]] are named", [run.name for run in self.runs])
        yield from same_file("runs", "spectra", self.runs)


def read_component_test(folder: Path | str) -> ComponentTest:
    """Read a test of component TPA and check that it fits together.

    Parameters
    ----------
    folder : path
        Holds ``component.toml`` and what it names.

    Returns
    -------
    ComponentTest
        In SI, along positive axes.

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a function or spectrum that is missing,
        doubled, or of another type or unit; unlike lines; a sensor or hit that no point names or no
        table has; sensors whose angles follow another order of rotations than stated, which is
        named. The sentence names file, item and remedy.

    See Also
    --------
    deboom.component_tpa, deboom.measurement.component_test.ComponentTest, deboom.read_receiver

    Examples
    --------
    >>> import deboom
    >>> deboom.read_component_test("drive").points[0].name  # doctest: +SKIP
    'point 1'
    """
    folder = Path(folder)
    path = folder / COMPONENT_FILE
    file = load_toml(path, ComponentTestFile)
    tables = [folder / file.sensor_table, folder / file.impact_table]
    sheets = _Sheets(path, tables, file.points, file.on_board, file.source_impacts)
    refuse_all(sheets.unplaced_impacts())
    points = sheets.points()
    refuse_undetermined(points, str(path))
    places = Places(tuple(sheets.sensors.values()), tuple(sheets.impacts.values()))
    files = [folder / file.accelerance, folder / file.coherence, folder / file.pressure]
    accelerance = read_inertances(files[0], places)
    coherence = _coherence(files[1], accelerance, places.responses, places.references)
    ears = [Dof(ear.name, ear.node, "scalar", ear.microphone) for ear in file.ears]
    pressure = pressure_functions(files[2], ears, places.references)
    pressure_coherence = _coherence(files[2], pressure, ears, places.references)
    runs = tuple(_run(folder, entry, file.deviations, places, ears) for entry in file.runs)
    free = None
    if file.free_accelerance is not None:
        at_points = Places(
            tuple(sheets.sensors[name] for point in file.points for name in point.sensors),
            tuple(sheets.impacts[name] for point in file.points for name in point.impacts),
        )
        files.append(folder / file.free_accelerance)
        free = read_inertances(files[-1], at_points)
    read = [path, *tables, *files, *(folder / entry.spectra for entry in file.runs)]
    tolerances, assumed = file.tolerances.placement(COMPONENT_FILE)
    with naming(path):
        test = ComponentTest(
            name=file.title,
            points=points,
            indicators=tuple(map(sensor_of, sheets.other_sensors())),
            on_board=tuple(sensor_of(sheets.sensors[name]) for name in file.on_board),
            source_hits=tuple(impact_of(sheets.impacts[name]) for name in file.source_impacts),
            accelerance=accelerance,
            coherence=coherence,
            pressure=pressure,
            pressure_coherence=pressure_coherence,
            n_averages=file.hits_per_impact,
            runs=runs,
            tolerances=tolerances,
            assumed=assumed,
            microphone=file.deviations.microphone_db / DB_PER_NEPER,
            free=free,
            input_files=with_their_tables(read),
        )
    refuse_other_functions_of_points(points, accelerance, str(files[0]))
    if free is not None:
        refuse_other_functions_of_points(points, free, str(files[-1]))
    refuse_wrong_sheets(points, accelerance, tolerances, str(tables[0]))
    return test


class _Sheets:
    """Position sheets whose sensors and impacts belong to points, or stand for themselves."""

    def __init__(
        self,
        path: Path,
        tables: Sequence[Path],
        points: Sequence[PointSection],
        on_board: Sequence[str] = (),
        source_impacts: Sequence[str] = (),
    ) -> None:
        self.path, self.tables, self.sections = path, tables, points
        self.on_board, self.source_impacts = on_board, source_impacts
        self.sensors = {row.sensor: row for row in read_placed(tables[0], PlacedSensor)}
        self.impacts = {row.impact: row for row in read_placed(tables[1], PlacedImpact)}
        named = (
            (tables[0], "sensor", self.sensors, [n for p in points for n in p.sensors], on_board),
            (tables[1], "impact", self.impacts, [n for p in points for n in p.impacts],
             source_impacts),
        )  # fmt: skip
        refuse_all(
            f"{path}: {what} '{name}' is not in {table.name}: add it there, or correct the name"
            for table, what, rows, at_points, others in named
            for name in (*at_points, *others)
            if name not in rows
        )
        refuse_all(
            far_from_its_point(
                {point.name: point.position_m for point in points},
                [
                    (table, point.name, name, rows[name].position)
                    for point in points
                    for table, rows, names in (
                        (tables[0], self.sensors, point.sensors),
                        (tables[1], self.impacts, point.impacts),
                    )
                    for name in names
                ],
            )
        )

    def unplaced_impacts(self) -> Iterator[str]:
        """Give a sentence for each impact that neither a point nor the source has."""
        at_points = [name for point in self.sections for name in point.impacts]
        for name in self.impacts:
            if name not in (*at_points, *self.source_impacts):
                yield (
                    f"{self.tables[1]}: impact '{name}' belongs to no point and is not among the "
                    f"source_impacts of {self.path.name}: name it there, or take it out of the "
                    "sheet"
                )

    def other_sensors(self) -> list[PlacedSensor]:
        """Return the sensors that belong to no point and are not kept for validation."""
        at_points = [name for point in self.sections for name in point.sensors]
        return [r for n, r in self.sensors.items() if n not in (*at_points, *self.on_board)]

    def points(self) -> tuple[InterfacePoint, ...]:
        """Return the points."""
        return tuple(
            InterfacePoint(
                name=point.name,
                position=np.array(point.position_m),
                motions=RIGID_MOTIONS[: point.degrees_of_freedom],
                sensors=tuple(sensor_of(self.sensors[name]) for name in point.sensors),
                impacts=tuple(impact_of(self.impacts[name]) for name in point.impacts),
            )
            for point in self.sections
        )


def pressure_functions(path: Path, ears: Sequence[Dof], blows: Sequence[Dof]) -> Frf:
    """Read pressure at ears per force of hits; functions of other types are left alone [Pa/N]."""
    return functions_of_type(path, FRF).frf(ears, blows, "pressure", PRESSURE_PER_FORCE)


def _coherence(
    path: Path, functions: Frf, responses: Sequence[Dof], references: Sequence[Dof]
) -> RealArray:
    lines, coherence = read_coherences(path, responses, references)
    if not np.array_equal(lines, functions.frequency):
        raise InputError(
            f"{path}: coherences and functions have unlike lines: export both with the same"
        )
    return coherence


def _run(
    folder: Path,
    entry: SourceRunSection,
    stated: SpectrumDeviations,
    places: Places,
    ears: Sequence[Dof],
) -> SourceRun:
    file = FunctionMatrix(folder / entry.spectra, f"run '{entry.name}'", SPECTRA)
    file.check_known([*places.responses, *ears])
    if entry.order is not None:
        file.check_order(entry.order, f"{COMPONENT_FILE} says order {entry.order:g}")
    acceleration = file.spectrum(places.responses, "acceleration", "m/s^2")
    sound = file.spectrum(ears, "pressure", "Pa")

    # of the modulus: both parts add as squares
    deviation = np.sqrt(2.0) * np.hypot(
        stated.relative * np.abs(acceleration.values), stated.floor_m_s2
    )
    return SourceRun(
        name=entry.name,
        acceleration=acceleration,
        sound=sound,
        acceleration_deviation=np.asarray(deviation),
        order=entry.order or 0.0,
    )


_Stiffness = Annotated[Positive, within(1e3, 1e9, "a mount has 1e3 to 1e9 N/m: is it in N/mm?")]


class ReceiverPointSection(PointSection):
    """One place where the source will stand, named as in ``component.toml``.

    Without a stiffness source and receiver are bolted together.
    """

    # of the mount between, along x, y, z of the position sheets
    stiffness_n_per_m: Annotated[
        tuple[_Stiffness, _Stiffness, _Stiffness] | None, Field(strict=False)
    ] = None
    # of that stiffness
    loss_factor: (
        Annotated[
            NotNegative,
            within(0.0, 2.0, "a mount loses less than twice what it stores: in percent?"),
        ]
        | None
    ) = None
    # instead: CSV of the measured 3 x 3 dynamic stiffness, such as one of a mount library
    stiffness_table: RelativePath | None = None


class ReceiverRunSection(StrictModel):
    """What was heard with the source in place, in a run of ``component.toml``."""

    name: Title  # of that run
    spectra: RelativePath  # UFF: pressure at the ears


class ReceiverFile(StrictModel):
    """The whole file ``receiver.toml``."""

    format: Literal[1]
    title: Title  # what a reader calls the receiver
    sensor_table: RelativePath  # CSV, or sheet "sensors" of an Excel file
    impact_table: RelativePath  # CSV, or sheet "impacts" of an Excel file
    accelerance: RelativePath  # UFF: acceleration per force of every hit, source taken out
    pressure: RelativePath  # UFF: pressure per force of every hit, source taken out
    tolerances: ToleranceSection = ToleranceSection()  # of everything placed and struck
    points: AtLeastOne[ReceiverPointSection]
    ears: AtLeastOne[EarEntry]
    runs: Several[ReceiverRunSection] = ()  # with the source in place, for comparison only

    def faults(self) -> Iterator[str]:
        """Give a sentence for what comes twice, and for mounts that are not stated as one."""
        for point in self.points:
            where = f"[[points]] '{point.name}'"
            if (point.stiffness_n_per_m is None) != (point.loss_factor is None):
                yield f"{where}: the keys 'stiffness_n_per_m' and 'loss_factor' come together"
            if point.stiffness_n_per_m is not None and point.stiffness_table is not None:
                yield f"{where}: state 'stiffness_n_per_m' or 'stiffness_table', not both"
        yield from doubled("[[points]] are named", [point.name for point in self.points])
        yield from doubled(
            "[[points]] have the sensor", [n for p in self.points for n in p.sensors]
        )
        yield from doubled(
            "[[points]] have the impact", [n for p in self.points for n in p.impacts]
        )
        yield from doubled("[[ears]] are named", [ear.name for ear in self.ears])
        yield from doubled("[[runs]] are named", [run.name for run in self.runs])
        yield from same_file("runs", "spectra", self.runs)


def read_receiver(folder: Path | str) -> ReceiverTest:
    """Read another receiver, its functions without the source, and the mounts between them.

    Parameters
    ----------
    folder : path
        Holds ``receiver.toml`` and what it names.

    Returns
    -------
    ReceiverTest
        Functions of its points [(m/s²)/N] and to its ears [Pa/N] over frequency, along positive
        axes; each joint to the source is rigid, parametric or measured [N/m].

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a function that is missing, doubled, or of
        another type or unit; unlike lines; a sensor or hit that no point names or no table has; a
        mount that is neither parametric nor measured. The sentence names file, item and remedy.

    See Also
    --------
    deboom.in_receiver, deboom.component_tpa

    Examples
    --------
    >>> import deboom
    >>> deboom.read_receiver("drive/receiver").joints["point 1"].stiffness.shape  # doctest: +SKIP
    (1, 3, 3)
    """
    folder = Path(folder)
    path = folder / RECEIVER_FILE
    file = load_toml(path, ReceiverFile)
    tables = [folder / file.sensor_table, folder / file.impact_table]
    sheets = _Sheets(path, tables, file.points)
    refuse_all(sheets.unplaced_impacts())
    points = sheets.points()
    refuse_undetermined(points, str(path))
    places = Places(tuple(sheets.sensors.values()), tuple(sheets.impacts.values()))
    files = [folder / file.accelerance, folder / file.pressure]
    accelerance = read_inertances(files[0], places)
    ears = [Dof(ear.name, ear.node, "scalar", ear.microphone) for ear in file.ears]
    pressure = pressure_functions(files[1], ears, places.references)
    joints = {p.name: _joint(folder, p, accelerance.frequency) for p in file.points}
    stiffness = [point.stiffness_table for point in file.points]
    measured: dict[str, Spectrum] = {}
    for entry in file.runs:
        spectra = FunctionMatrix(folder / entry.spectra, f"run '{entry.name}'", SPECTRA)
        measured[entry.name] = spectra.spectrum(ears, "pressure", "Pa")
    read = [path, *tables, *files, *(folder / name for name in stiffness if name)]
    read += [folder / entry.spectra for entry in file.runs]
    with naming(path):
        receiver = ReceiverTest(
            name=file.title,
            points=points,
            accelerance=accelerance,
            pressure=pressure,
            joints=joints,
            measured=measured,
            input_files=with_their_tables(read),
        )
    tolerances, _ = file.tolerances.placement(RECEIVER_FILE)
    refuse_other_functions_of_points(points, accelerance, str(files[0]))
    refuse_wrong_sheets(points, accelerance, tolerances, str(tables[0]))
    return receiver


def _joint(folder: Path, point: ReceiverPointSection, frequency: RealArray) -> MountJoint:
    if point.stiffness_table is not None:
        path = folder / point.stiffness_table
        lines, stiffness = read_stiffness(path)
        if not same_lines(frequency, lines):
            raise InputError(
                f"{path}: its lines are not those of the functions: "
                f"{first_difference(frequency, lines)}; measure both on the same, nothing is "
                "interpolated"
            )
        with naming(path):
            return MountJoint(stiffness)
    if point.stiffness_n_per_m is None or point.loss_factor is None:
        return MountJoint()
    along = np.array(point.stiffness_n_per_m) * (1 + 1j * point.loss_factor)
    return MountJoint(np.diag(along)[np.newaxis])


def read_stiffness(path: Path) -> tuple[RealArray, ComplexArray]:
    """Read ``frequency [Hz], xx real [N/mm], xx imag [N/mm], xy real …``, such as of a rig.

    - returns lines (f,) [Hz] and stiffness (f, 3, 3): force along the first per motion along the
      second axis [N/m].
    - raises InputError: no such table, no finite numbers, another unit, or lines that do not rise.
    """
    table = read_function_table(path)
    stiffness = np.zeros((table.frequency.size, len(AXES), len(AXES)), complex)
    with naming(path):
        for row, a in enumerate(AXES):
            for column, b in enumerate(AXES):
                unit, stiffness[:, row, column] = table.spectrum(f"{a}{b}")
                if unit.si != "N/m":
                    raise InputError(f"'{a}{b}' is in '{unit.label}': export it in N/m or N/mm")
    return table.frequency, stiffness


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Give name and text of each line on what a folder holds."""
    test = read_component_test(folder)
    others = sorted(folder.glob(f"*/{RECEIVER_FILE}"))
    receivers = [read_receiver(path.parent) for path in others]
    lines = test.accelerance.frequency
    yield "test", test.name
    points = (f"{point.name} ({len(point.motions)} degrees of freedom)" for point in test.points)
    yield "points", ", ".join(points)
    yield (
        "channels",
        f"{len(test.indicator_channels)} indicators, {len(test.on_board_channels)} left out",
    )
    yield "ears", ", ".join(test.ears)
    yield "hits on the source", f"{len(test.source_hits)}"
    yield "free source", "measured" if test.free is not None else "not measured"
    yield "lines", f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz"
    yield "runs", ", ".join(run.name for run in test.runs)
    for receiver in receivers:
        yield "receiver", receiver.name
    doubts = [s for each in receivers or (None,) for s in component_findings(test, each)]
    yield from warning_lines(dict.fromkeys(doubts))
    yield from assumed_lines(test.assumed)


COMPONENT: FolderRecord = FolderRecord(
    kind=FolderKind.component,
    file=COMPONENT_FILE,
    keys=ComponentTestFile,
    command="deboom run component_tpa --test {}",
    guide="Component TPA",
    lines=_lines,
)
