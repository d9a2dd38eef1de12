"""The folder of a roving-hammer test on a mounted body, as a laboratory delivers it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
from pydantic import Field

from deboom.arrays import RealArray
from deboom.compressor.hammer_identification import hammer_test_doubts
from deboom.errors import InputError, naming
from deboom.files.function_table import FRF, Dof, FunctionMatrix
from deboom.files.hammer_test import read_hammer_test
from deboom.files.kinds import FolderKind
from deboom.files.pyfbs_sheets import has_pyfbs_sheets, read_pyfbs_sheet
from deboom.files.rows import PlacedImpact, PlacedSensor, impact_of, sensor_of, struck
from deboom.files.schema import (
    FolderRecord,
    GainTolerance,
    Matrix3,
    Number,
    PlaceTolerance,
    Positive,
    RelativePath,
    Row3,
    Several,
    StrictModel,
    Title,
    assumed_lines,
    doubled,
    load_toml,
    noting,
    refuse_all,
    telling,
    values_of,
    warning_lines,
)
from deboom.files.sensor_classes import completed
from deboom.files.tables import read_table
from deboom.files.uff import read_uff
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import (
    ACCELERATION_PER_FORCE,
    CompressorMount,
    Drawing,
    InertanceTest,
    check_enough,
)
from deboom.measurement.impact_test import FrfEstimate, HammerOptions, HammerTest, hammer_frfs
from deboom.measurement.sensors import Impact, PlacementTolerances

SMALLEST_SPAN, LARGEST_SPAN = 0.01, 10.0
"""Of the points of one sheet [m]: beyond, its unit is wrong."""


_Placed = TypeVar("_Placed", PlacedSensor, PlacedImpact)


def read_placed(path: Path, kind: type[_Placed]) -> tuple[_Placed, ...]:
    """Read a position sheet of accelerometers or impacts, of deboom or of pyFBS.

    - raises InputError: as `read_table`, or positions that no machine on mounts has: their unit is
      wrong by a factor of a thousand.
    """
    rows = read_pyfbs_sheet(path, kind) if has_pyfbs_sheets(path, kind) else read_table(path, kind)
    points = np.array([row.position for row in rows])
    span = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    if len(points) > 1 and not SMALLEST_SPAN <= span <= LARGEST_SPAN:
        raise InputError(
            f"{path}: the {kind.sheet} lie within {span:.3g} m: is the unit in the header of x, y "
            "and z the one of the numbers? mm and m are mixed up easily"
        )
    return rows


COHERENCE = 6
"""UFF function type."""
_NAMES = {FRF: "FRF", COHERENCE: "coherence"}


@dataclass(frozen=True)
class Places:
    """The position sheets that give the nodes of a UFF file a meaning.

    - `sensors`: rows: three channels each.
    - `impacts`: columns.
    """

    sensors: tuple[PlacedSensor, ...]
    impacts: tuple[PlacedImpact, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Such as ``A1 x``."""
        return tuple(dof.name for dof in self.responses)

    @property
    def responses(self) -> tuple[Dof, ...]:
        """DoF of the channels; a file may hold them against their axes."""
        return tuple(dof for sensor in self.sensors for dof in triaxial(sensor.sensor, sensor.node))

    @property
    def references(self) -> tuple[Dof, ...]:
        """DoF of the impacts."""
        nodes = [impact.node for impact in self.impacts]
        return tuple(struck(impact, alone=nodes.count(impact.node) == 1) for impact in self.impacts)


def triaxial(name: str, node: int) -> tuple[Dof, ...]:
    """Return the DoF of an accelerometer's channels along its own axes."""
    return tuple(
        Dof(f"{name} {axis}", node, f"+{axis}", accepted=(f"+{axis}", f"-{axis}")) for axis in "xyz"
    )


def read_inertances(path: Path, places: Places) -> Frf:
    """Read the FRFs from all impacts to all channels.

    - `path`: UFF file; functions of other types in it are left alone.
    - `places`: nodes of sensors and impacts.
    - returns: along positive axes of the sensors [m/s² per N].
    - raises InputError: an FRF that is missing, doubled, at an unknown node, of other lines, real,
      or of another unit than acceleration over force.
    """
    matrix = functions_of_type(path, FRF)
    matrix.check_known(places.responses, places.references)
    dofs = (places.responses, places.references)
    return matrix.frf(*dofs, "acceleration", "m/s^2/N", ACCELERATION_PER_FORCE)


def read_coherences(
    path: Path, responses: Sequence[Dof], references: Sequence[Dof]
) -> tuple[RealArray, RealArray]:
    """Read lines (f,) [Hz] and ordinary coherences (f, n_response, n_reference), 0 to 1 [1]."""
    matrix = functions_of_type(path, COHERENCE)
    values = matrix.values(responses, references, ordinate="", unit="", is_complex=False).real
    values = np.abs(values)  # a channel against its axis turns the sign, which a coherence has not
    raw = [function.values for function in matrix.functions]
    if min(map(np.min, raw)) < 0 or values.max() > 1 + 1e-6:
        raise matrix.error("a coherence lies between 0 and 1: export it again")
    return matrix.axis, np.minimum(values, 1.0)


def functions_of_type(path: Path, kind: int) -> FunctionMatrix:
    """Functions of one type."""
    functions = [function for function in read_uff(path) if function.function_type == kind]
    if not functions:
        raise InputError(f"{path} holds no {_NAMES[kind]} (UFF function type {kind}): export it")
    return FunctionMatrix(path, _NAMES[kind], (kind,), functions)


INERTANCE_TEST_FILE = "compressor_test.toml"


class ToleranceSection(StrictModel):
    """Standard deviations of what is stated only approximately.

    What is left out is the default of its sensor's class.
    """

    sensor_gain: GainTolerance | None = None  # of each channel, relative [1]
    sensor_position_m: PlaceTolerance | None = None  # per axis
    sensor_angle_deg: Positive | None = None  # per axis
    hammer_gain: GainTolerance | None = None  # common to all impacts, relative [1]
    impact_position_m: PlaceTolerance | None = None  # per axis
    impact_angle_deg: Positive | None = None  # per axis

    def placement(self, file: str) -> tuple[PlacementTolerances, tuple[str, ...]]:
        """Return the tolerances, in SI, and a sentence on those that are defaults.

        - `file`: name of the file, for the sentence.
        """
        section, defaults = completed(self, file)
        return PlacementTolerances(**values_of(section)), defaults


class DrawingSection(StrictModel):
    """The body as drawn, without its mounts."""

    mass_kg: Positive
    centre_of_gravity_m: Row3  # from the origin of the position sheet
    inertia_kg_m2: Matrix3  # about the centre of gravity, products as matrix elements


class DrawnMountSection(StrictModel):
    """One mount as drawn."""

    name: Title  # such as mount 1
    position_m: Row3  # elastic centre, from the origin of the position sheet
    rotation_deg: Row3  # of its axes about the fixed axes x, then y, then z; local x is axial
    stiffness_n_per_m: Row3  # static: axial, radial, radial


class InertanceTestFile(StrictModel):
    """The whole file ``compressor_test.toml``."""

    format: Literal[1]
    title: Title  # what a reader calls the test
    sensor_table: RelativePath  # CSV, or sheet "sensors" of an Excel file
    impact_table: RelativePath  # CSV, or sheet "impacts" of an Excel file
    frf: RelativePath | None = None  # UFF; left out where only hits are delivered
    coherence: RelativePath | None = None  # UFF of the ordinary coherence; may be the same file
    hits_per_impact: Number | None = None  # how many hits the FRFs average
    hits: RelativePath | None = None  # folder with the hits over time
    # first and last line of FRFs that are made of hits
    band_hz: Annotated[tuple[Positive, Positive], Field(strict=False)] | None = None
    weighed_mass_kg: Positive | None = None  # sensors and brackets included
    weighed_mass_deviation_kg: Positive | None = None  # 1 σ of it
    tolerances: ToleranceSection = ToleranceSection()
    drawing: DrawingSection | None = None  # nominal values
    mounts: Several[DrawnMountSection] = ()  # of the drawing

    def faults(self) -> Iterator[str]:
        """Give a sentence for keys that do not go together, and for mounts of one name."""
        for key, needed, why in _NEEDS:
            if getattr(self, key) and not getattr(self, needed):
                yield f"key '{key}' needs the key '{needed}': {why}"
        if not (self.frf or self.hits):
            yield "neither key 'frf' nor 'hits': name what was measured"
        if self.band_hz is not None and not self.band_hz[0] < self.band_hz[1]:
            yield f"key 'band_hz' is {list(self.band_hz)}: first line, then last"
        yield from doubled("[[mounts]] are named", [mount.name for mount in self.mounts])


_NEEDS = (
    ("frf", "coherence", "without it the noise of the FRFs is not known; export it, type 6"),
    ("frf", "hits_per_impact", "a coherence says nothing without the number of averages"),
    ("coherence", "frf", "name the FRFs that it belongs to"),
    ("hits", "band_hz", "state the first and the last line that the FRFs shall have"),
    ("weighed_mass_kg", "weighed_mass_deviation_kg", "state how well the scales know it"),
    ("weighed_mass_deviation_kg", "weighed_mass_kg", "state the mass that it belongs to"),
    ("drawing", "mounts", "add a section [[mounts]] for each, or leave the drawing out"),
    ("mounts", "drawing", "add a section [drawing], or leave the mounts out"),
)
"""Which key needs which other one, and why."""


SAME_PLACE = 1e-4
"""Largest difference of an impact between position sheet and hits [m, 1]: rounding."""


def read_inertance_test(folder: Path | str, *, from_hits: bool = False) -> InertanceTest:
    """Read FRFs, coherences, position sheets and what is stated besides.

    Parameters
    ----------
    folder : path
        Holds ``compressor_test.toml`` and what it names.
    from_hits : bool
        Make the FRFs of the hits over time, although FRFs are there as well. Where only hits are
        there, they are taken anyway.

    Returns
    -------
    InertanceTest
        In SI, along positive axes.

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a length without a unit; an unknown node; an
        FRF or a coherence that is missing or doubled; fewer than three sensors or six impacts;
        hits that do not belong to the position sheet. The sentence names file, item and remedy.

    Warns
    -----
    DataWarning
        A line at 0 Hz was left out; hits had not decayed at the end of their blocks.

    See Also
    --------
    deboom.identify, deboom.read_operating_test

    Examples
    --------
    >>> import deboom, tempfile
    >>> folder = f"{tempfile.mkdtemp()}/hammer"
    >>> path = deboom.bench.write_compressor_test(folder, seed=1)
    >>> deboom.read_inertance_test(folder).frf.values.shape[1:]
    (18, 18)
    """
    folder = Path(folder)
    path = folder / INERTANCE_TEST_FILE
    file = load_toml(path, InertanceTestFile)
    tables = [folder / file.sensor_table, folder / file.impact_table]
    with telling() as tell:
        with noting(tell):
            sensor_rows = read_placed(tables[0], PlacedSensor)
        with noting(tell):
            impact_rows = read_placed(tables[1], PlacedImpact)
    places = Places(sensor_rows, impact_rows)
    with naming(" and ".join(dict.fromkeys(map(str, tables)))):
        sensors = tuple(map(sensor_of, places.sensors))
        impacts = tuple(map(impact_of, places.impacts))
        check_enough(sensors, impacts)
    if from_hits and file.hits is None:
        raise InputError(f"{path}: key 'hits' is missing: name the folder of the hits over time")
    if from_hits or file.frf is None:
        estimate, read = _from_hits(folder, file, impacts, places.channels)
        frf, coherence, n_averages = estimate.frf, estimate.coherence, min(estimate.n_averages)
        doubts = tuple(filter(None, (estimate.not_decayed,)))
    else:
        frf, coherence, n_averages, read = _from_frfs(folder, file, places)
        doubts = ()
    tolerances, assumed = file.tolerances.placement(INERTANCE_TEST_FILE)
    with naming(folder):
        drawing = None
        if file.drawing is not None:
            drawing = Drawing(
                mass=file.drawing.mass_kg,
                centre=np.array(file.drawing.centre_of_gravity_m),
                inertia=np.array(file.drawing.inertia_kg_m2),
                mounts=tuple(CompressorMount(**values_of(mount)) for mount in file.mounts),
            )
        return InertanceTest(
            name=file.title,
            sensors=sensors,
            impacts=impacts,
            frf=frf,
            coherence=coherence,
            n_averages=n_averages,
            tolerances=tolerances,
            weighed_mass=file.weighed_mass_kg,
            weighed_mass_deviation=file.weighed_mass_deviation_kg or 0.0,
            drawing=drawing,
            input_files=tuple(dict.fromkeys([path, *tables, *read])),
            doubts=doubts,
            assumed=assumed,
        )


_Measured = tuple[Frf, RealArray, int, list[Path]]


def _from_frfs(folder: Path, file: InertanceTestFile, places: Places) -> _Measured:
    # loading made sure that the three come together
    assert file.frf is not None
    assert file.coherence is not None
    assert file.hits_per_impact is not None
    paths = [folder / file.frf, folder / file.coherence]
    frf = read_inertances(paths[0], places)
    lines, coherence = read_coherences(paths[1], places.responses, places.references)
    if not np.array_equal(lines, frf.frequency):
        raise InputError(f"{paths[1]} has other lines than {paths[0]}: export both with the same")
    return frf, coherence, file.hits_per_impact, paths


def _from_hits(
    folder: Path, file: InertanceTestFile, impacts: tuple[Impact, ...], channels: tuple[str, ...]
) -> tuple[FrfEstimate, list[Path]]:
    assert file.hits is not None
    hits = folder / file.hits
    test = read_hammer_test(hits)
    refuse_all(_other_places(hits, test, impacts))
    estimate = hammer_frfs(test, HammerOptions(band=file.band_hz))
    estimate = estimate.select(channels, tuple(impact.name for impact in impacts))
    return estimate, sorted(path for path in hits.rglob("*") if path.is_file())


def _other_places(hits: Path, test: HammerTest, impacts: tuple[Impact, ...]) -> Iterator[str]:
    by_name = {impact.name: impact for impact in test.impacts}
    for impact in impacts:
        if impact.name not in by_name:
            yield (
                f"{hits}: no hits on {impact.name} of the position sheet: deliver them, or take it "
                "out of the sheet"
            )
        elif not same_place(impact, by_name[impact.name]):
            yield (
                f"{hits}: {impact.name} has another place or direction than in the position "
                "sheet: correct the wrong one"
            )


def same_place(impact: Impact, other: Impact) -> bool:
    """Tell whether impacts have one place and direction, but for rounding."""
    off = np.abs([impact.position - other.position, impact.direction - other.direction])
    return bool(off.max() <= SAME_PLACE)


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Give name and text of each line on what a folder holds."""
    test = read_inertance_test(folder)
    with naming(folder):
        doubts = hammer_test_doubts(test)
    lines = test.frf.frequency
    weighed = "not weighed" if test.weighed_mass is None else f"weighed {test.weighed_mass:g} kg"
    yield "test", f"{test.name}, {weighed}"
    yield "sensors", f"{len(test.sensors)} triaxial, {len(test.impacts)} impacts"
    if rate := test.frf.added_decay_rate:
        yield (
            "window",
            f"decay of {rate:g} 1/s: for a free body only, identify refuses it on mounts",
        )
    yield "lines", f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz"
    yield from warning_lines(doubts)
    yield from assumed_lines(test.assumed)


COMPRESSOR: FolderRecord = FolderRecord(
    kind=FolderKind.compressor,
    file=INERTANCE_TEST_FILE,
    keys=InertanceTestFile,
    command="deboom identify {}",
    guide="Your own data",
    lines=_lines,
)
