"""The folder of a roving-hammer test on a mounted body, as a laboratory delivers it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.files.hammer_test import read_hammer_test
from deboom.files.platform import Matrix3, Positive, RelativePath, Row3
from deboom.files.rows import PlacedImpact, PlacedSensor, Vector, read_table
from deboom.files.schema import StrictModel, dump_toml, load_toml, refuse_doubled
from deboom.files.uff import UffFunction, read_uff
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import (
    ACCELERATION_PER_FORCE,
    CompressorMount,
    Drawing,
    InertanceTest,
    check_enough,
)
from deboom.measurement.impact_test import HammerOptions, HammerTest, hammer_frfs
from deboom.measurement.sensors import Impact, PlacementTolerances, Sensor, SensorKind
from deboom.physics.rigid_body import rotation_matrix

SMALLEST_SPAN, LARGEST_SPAN = 0.01, 10.0
"""Of the points of one sheet [m]: beyond, its unit is wrong."""

_AXES = ("x", "y", "z")


def read_placed_sensors(path: Path) -> tuple[PlacedSensor, ...]:
    """Read the table ``sensor, node, x [mm], y [mm], z [mm], rx [deg], ry [deg], rz [deg]``.

    Raises
    ------
    InputError
        As `read_table`, or positions that no machine on mounts has.
    """
    sensors = read_table(path, PlacedSensor)
    _check_span(path, "sensors", [sensor.position for sensor in sensors])
    return sensors


def read_placed_impacts(path: Path) -> tuple[PlacedImpact, ...]:
    """Read the table ``impact, node, x [mm], y [mm], z [mm], dx, dy, dz``.

    Raises
    ------
    InputError
        As `read_table`, or positions that no machine on mounts has.
    """
    impacts = read_table(path, PlacedImpact)
    _check_span(path, "impacts", [impact.position for impact in impacts])
    return impacts


def _check_span(path: Path, what: str, positions: Sequence[Vector]) -> None:
    """Refuse a unit that is wrong by a factor of a thousand."""
    points = np.array(positions)
    span = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    if len(points) > 1 and not SMALLEST_SPAN <= span <= LARGEST_SPAN:
        raise InputError(
            f"{path}: the {what} lie within {span:.3g} m: is the unit in the header of x, y and z "
            "the one of the numbers? mm and m are mixed up easily"
        )


FRF, COHERENCE = 4, 6
"""UFF function types."""

FARTHEST_DIRECTION = 25.0
"""Between the direction in a UFF file and the one of the position sheet [deg]."""
_NAMES = {FRF: "FRF", COHERENCE: "coherence"}


@dataclass(frozen=True)
class Places:
    """The position sheets that give the nodes of a UFF file a meaning.

    Parameters
    ----------
    sensors : tuple of PlacedSensor
        Rows: three channels each.
    impacts : tuple of PlacedImpact
        Columns.
    """

    sensors: tuple[PlacedSensor, ...]
    impacts: tuple[PlacedImpact, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Such as ``A1 x``."""
        return tuple(f"{sensor.sensor} {axis}" for sensor in self.sensors for axis in _AXES)


def read_inertances(path: Path, places: Places) -> tuple[RealArray, ComplexArray]:
    """Read the FRFs from all impacts to all channels.

    Parameters
    ----------
    path : Path
        UFF file; functions of other types in it are left alone.
    places : Places
        Which node is what.

    Returns
    -------
    frequency : array, shape (f,)
        [Hz].
    values : array, shape (f, n_channel, n_impact)
        Along positive axes of the sensors [m/s² per N].

    Raises
    ------
    InputError
        An FRF that is missing, doubled, at an unknown node, of other lines, real, or of another
        unit than acceleration over force.
    """
    frequency, found = _matrix(path, places, FRF)
    for function, _ in found.values():
        if function.ordinate != "acceleration" or function.unit != "m/s^2/N":
            raise InputError(
                f"{path}: {function.dof}: it is {function.ordinate} in '{function.unit}': export "
                "acceleration per force with its units"
            )
        if not np.iscomplexobj(function.values):
            raise InputError(f"{path}: {function.dof}: it is real: phase is needed, export both")
    return frequency, np.asarray(_stacked(found, places, with_sign=True), dtype=np.complex128)


def read_coherences(path: Path, places: Places) -> tuple[RealArray, RealArray]:
    """Read the ordinary coherences of all channels and impacts."""
    frequency, found = _matrix(path, places, COHERENCE)
    for function, _ in found.values():
        values = function.values
        if np.iscomplexobj(values) or np.any((values < 0) | (values > 1 + 1e-6)):
            raise InputError(
                f"{path}: {function.dof}: a coherence is real and lies between 0 and 1; export it "
                "again"
            )
    values = np.minimum(_stacked(found, places, with_sign=False).real, 1.0)
    return frequency, np.asarray(values, dtype=np.float64)


_Found = dict[tuple[str, str], tuple[UffFunction, float]]


def _matrix(path: Path, places: Places, kind: int) -> tuple[RealArray, _Found]:
    """Find every function of one type; by channel and impact, with the sign of its direction."""
    functions = [function for function in read_uff(path) if function.function_type == kind]
    if not functions:
        raise InputError(f"{path} holds no {_NAMES[kind]} (UFF function type {kind}): export it")
    frequency = functions[0].abscissa
    found: _Found = {}
    for function in functions:
        if not np.array_equal(function.abscissa, frequency):
            raise InputError(f"{path}: {function.dof} has other lines than {functions[0].dof}")
        try:
            channel, sign = _channel(function, places)
            key = (channel, _impact(function, places))
            if key in found:
                raise InputError(
                    f"the {_NAMES[kind]} of {key[0]} to {key[1]} comes twice: keep one"
                )
        except InputError as error:
            raise InputError(f"{path}: {function.dof}: {error}") from None
        found[key] = function, sign
    for impact in places.impacts:
        for channel in places.channels:
            if (channel, impact.impact) not in found:
                raise InputError(
                    f"{path}: the {_NAMES[kind]} of {channel} to {impact.impact} (reference node "
                    f"{impact.node} {impact.uff_direction}) is missing: export it, or take the "
                    "sensor or the impact out of the position sheet"
                )
    return frequency, found


def _stacked(found: _Found, places: Places, *, with_sign: bool) -> ComplexArray:
    rows = []
    for channel in places.channels:
        pairs = [found[channel, impact.impact] for impact in places.impacts]
        rows.append([f.values * (sign if with_sign else 1.0) for f, sign in pairs])
    return np.moveaxis(np.array(rows, dtype=np.complex128), 2, 0)


def _channel(function: UffFunction, places: Places) -> tuple[str, float]:
    """Name of the response channel, and −1 where it was recorded against its axis."""
    direction = function.response_direction
    for sensor in places.sensors:
        if sensor.node == function.response_node:
            if direction[1:] not in _AXES:
                raise InputError(
                    f"its direction is {direction}: export the sensor's axis, such as +x"
                )
            return f"{sensor.sensor} {direction[1:]}", -1.0 if direction[0] == "-" else 1.0
    raise InputError(
        f"node {function.response_node} is no sensor of the position sheet: add it there, or "
        "export without it"
    )


def _impact(function: UffFunction, places: Places) -> str:
    direction = function.reference_direction
    there = [one for one in places.impacts if one.node == function.reference_node]
    if not there:
        raise InputError(
            f"reference node {function.reference_node} is no impact of the position sheet: add it "
            "there, or export without it"
        )
    if direction == "scalar" and len(there) == 1:
        return there[0].impact
    for impact in there:
        if _agree(direction, impact.direction):
            return impact.impact
    stated = " or ".join(str(one.direction) for one in there)
    raise InputError(
        f"the force is recorded along {direction}, the position sheet says {stated}: correct the "
        "wrong one"
    )


def _agree(direction: str, vector: Sequence[float]) -> bool:
    if direction[1:] not in _AXES:
        return False
    along = (-1.0 if direction[0] == "-" else 1.0) * vector[_AXES.index(direction[1:])]
    return along > math.cos(math.radians(FARTHEST_DIRECTION))


INERTANCE_TEST_FILE = "compressor_test.toml"


class ToleranceSection(StrictModel):
    """Standard deviations of what is stated only approximately."""

    sensor_gain: Positive
    """Of each channel, relative [1]."""
    sensor_position_m: Positive
    """Per axis."""
    sensor_angle_deg: Positive
    """Per axis."""
    hammer_gain: Positive
    """Common to all impacts, relative [1]."""
    impact_position_m: Positive
    """Per axis."""
    impact_angle_deg: Positive
    """Per axis."""


class DrawingSection(StrictModel):
    """The body as drawn, without its mounts."""

    mass_kg: Positive
    """Nominal mass."""
    centre_of_gravity_m: Row3
    """From the origin of the position sheet."""
    inertia_kg_m2: Matrix3
    """About the centre of gravity, products with their sign as matrix elements."""


class DrawnMountSection(StrictModel):
    """One mount as drawn."""

    name: Annotated[str, Field(min_length=1)]
    """Such as ``mount 1``."""
    position_m: Row3
    """Elastic centre, from the origin of the position sheet."""
    rotation_deg: Row3
    """Of the mount's axes about the fixed axes x, then y, then z; local x is axial."""
    stiffness_n_per_m: Row3
    """Static: axial, radial, radial."""


class InertanceTestFile(StrictModel):
    """The whole file ``compressor_test.toml``."""

    format: Literal[1]
    """Version of this format."""
    title: Annotated[str, Field(min_length=1)]
    """What a reader calls the test."""
    sensor_table: RelativePath
    """Position sheet of the accelerometers, CSV or sheet ``sensors`` of an Excel file."""
    impact_table: RelativePath
    """Position sheet of the impacts, CSV or sheet ``impacts`` of an Excel file."""
    frf: RelativePath | None = None
    """UFF file of the FRFs; left out where only hits are delivered."""
    coherence: RelativePath | None = None
    """UFF file of the ordinary coherence; comes with `frf`, and may be the same file."""
    hits_per_impact: Annotated[int, Field(ge=1)] | None = None
    """How many hits the FRFs average; comes with `frf`."""
    hits: RelativePath | None = None
    """Folder with the hits over time."""
    band_hz: Annotated[tuple[Positive, Positive], Field(strict=False)] | None = None
    """First and last line of FRFs that are made of hits; comes with `hits`."""
    weighed_mass_kg: Positive | None = None
    """From a pair of scales, sensors and brackets included; left out if it was not weighed."""
    weighed_mass_deviation_kg: Positive | None = None
    """1 σ of it; comes with it."""
    tolerances: ToleranceSection
    """How well everything is placed and calibrated."""
    drawing: DrawingSection | None = None
    """Nominal values; left out where there is no drawing."""
    mounts: Annotated[tuple[DrawnMountSection, ...], Field(strict=False)] = ()
    """Mounts of the drawing."""


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


def load_inertance_test_file(path: Path) -> InertanceTestFile:
    """Read and check ``compressor_test.toml``."""
    file = load_toml(path, InertanceTestFile)
    _check(path, file)
    return file


def dump_inertance_test_file(path: Path, file: InertanceTestFile) -> None:
    """Write ``compressor_test.toml``; what is written is read back and compared first.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    _check(path, file)
    dump_toml(path, file)


def _check(path: Path, file: InertanceTestFile) -> None:
    for key, needed, why in _NEEDS:
        if getattr(file, key) and not getattr(file, needed):
            raise InputError(f"{path}: key '{key}' needs the key '{needed}': {why}")
    if not (file.frf or file.hits):
        raise InputError(f"{path}: neither key 'frf' nor 'hits': name what was measured")
    if file.band_hz is not None and not file.band_hz[0] < file.band_hz[1]:
        raise InputError(f"{path}: key 'band_hz' is {list(file.band_hz)}: first line, then last")
    refuse_doubled(path, "[[mounts]] are named", [mount.name for mount in file.mounts])


SAME_PLACE = 1e-4
"""Largest difference of an impact between position sheet and hits [m, 1]: rounding."""

__all__ = ["INERTANCE_TEST_FILE", "read_inertance_test"]


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
        FRF or a coherence that is missing or doubled; fewer than three sensors or six impacts; a
        line at 0 Hz; hits that do not belong to the position sheet. The sentence names file, item
        and remedy.

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
    file = load_inertance_test_file(path)
    tables = [folder / file.sensor_table, folder / file.impact_table]
    places = Places(read_placed_sensors(tables[0]), read_placed_impacts(tables[1]))
    try:
        sensors, impacts = _sensors(places), _impacts(places)
        check_enough(sensors, impacts)
    except InputError as error:
        where = " and ".join(dict.fromkeys(map(str, tables)))
        raise InputError(f"{where}: {error}") from None
    if from_hits and file.hits is None:
        raise InputError(f"{path}: key 'hits' is missing: name the folder of the hits over time")
    if from_hits or file.frf is None:
        frf, coherence, n_averages, read = _from_hits(folder, file, impacts, places.channels)
    else:
        frf, coherence, n_averages, read = _from_frfs(folder, file, places)
    try:
        return InertanceTest(
            name=file.title,
            sensors=sensors,
            impacts=impacts,
            frf=frf,
            coherence=coherence,
            n_averages=n_averages,
            tolerances=_tolerances(file),
            weighed_mass=file.weighed_mass_kg,
            weighed_mass_deviation=file.weighed_mass_deviation_kg or 0.0,
            drawing=_drawing(file),
            input_files=tuple(dict.fromkeys([path, *tables, *read])),
        )
    except InputError as error:
        raise InputError(f"{folder}: {error}") from None


def _sensors(places: Places) -> tuple[Sensor, ...]:
    return tuple(
        Sensor(
            name=row.sensor,
            kind=SensorKind.ACCELEROMETER,
            model="",
            mount="",
            piece="",
            position=np.array(row.position),
            orientation=rotation_matrix(row.angles),
        )
        for row in places.sensors
    )


def _impacts(places: Places) -> tuple[Impact, ...]:
    return tuple(
        Impact(row.impact, np.array(row.position), np.array(row.direction))
        for row in places.impacts
    )


_Measured = tuple[Frf, RealArray, int, list[Path]]


def _from_frfs(folder: Path, file: InertanceTestFile, places: Places) -> _Measured:
    # loading made sure that the three come together
    assert file.frf is not None
    assert file.coherence is not None
    assert file.hits_per_impact is not None
    paths = [folder / file.frf, folder / file.coherence]
    frequency, values = read_inertances(paths[0], places)
    lines, coherence = read_coherences(paths[1], places)
    if not np.array_equal(lines, frequency):
        raise InputError(f"{paths[1]} has other lines than {paths[0]}: export both with the same")
    impacts = tuple(impact.impact for impact in places.impacts)
    frf = Frf(frequency, values, places.channels, impacts, ACCELERATION_PER_FORCE)
    return frf, coherence, file.hits_per_impact, paths


def _from_hits(
    folder: Path, file: InertanceTestFile, impacts: tuple[Impact, ...], channels: tuple[str, ...]
) -> _Measured:
    assert file.hits is not None
    hits = folder / file.hits
    test = read_hammer_test(hits)
    _check_same_places(hits, test, impacts)
    estimate = hammer_frfs(test, HammerOptions(band=file.band_hz))
    estimate = estimate.select(channels, tuple(impact.name for impact in impacts))
    read = sorted(path for path in hits.rglob("*") if path.is_file())
    return estimate.frf, estimate.coherence, int(min(estimate.n_averages)), read


def _check_same_places(hits: Path, test: HammerTest, impacts: tuple[Impact, ...]) -> None:
    struck = {impact.name: impact for impact in test.impacts}
    for impact in impacts:
        if impact.name not in struck:
            raise InputError(
                f"{hits}: no hits on {impact.name} of the position sheet: deliver them, or take it "
                "out of the sheet"
            )
        other = struck[impact.name]
        off = np.abs([impact.position - other.position, impact.direction - other.direction])
        if off.max() > SAME_PLACE:
            raise InputError(
                f"{hits}: {impact.name} has another place or direction than in the position "
                "sheet: correct the wrong one"
            )


def _tolerances(file: InertanceTestFile) -> PlacementTolerances:
    stated = file.tolerances
    return PlacementTolerances(
        sensor_gain=stated.sensor_gain,
        sensor_position=stated.sensor_position_m,
        sensor_angle=math.radians(stated.sensor_angle_deg),
        hammer_gain=stated.hammer_gain,
        impact_position=stated.impact_position_m,
        impact_angle=math.radians(stated.impact_angle_deg),
    )


def _drawing(file: InertanceTestFile) -> Drawing | None:
    if file.drawing is None:
        return None
    return Drawing(
        mass=file.drawing.mass_kg,
        centre=np.array(file.drawing.centre_of_gravity_m),
        inertia=np.array(file.drawing.inertia_kg_m2),
        mounts=tuple(
            CompressorMount(
                mount.name,
                np.array(mount.position_m),
                np.deg2rad(mount.rotation_deg),
                np.array(mount.stiffness_n_per_m),
            )
            for mount in file.mounts
        ),
    )
