"""The folder of a test on a running compressor: hammer tests, sweeps, hoses."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.errors import InputError
from deboom.files.inertance_test import read_inertance_test, read_placed_sensors
from deboom.files.platform import Positive, RelativePath, Row3
from deboom.files.rows import PlacedSensor
from deboom.files.schema import StrictModel, dump_toml, load_toml
from deboom.files.uff import UffFunction, read_uff, write_uff
from deboom.measurement.channels import Spectrum, TimeRecord
from deboom.measurement.compressor_test import (
    HoseDrawing,
    HoseState,
    InertanceTest,
    OperatingSweep,
    OperatingTest,
)
from deboom.measurement.order_tracking import tracked_sweep
from deboom.physics.rigid_body import rotation_matrix

SPEED_TOLERANCE = 0.5
"""Largest difference between a line and the tacho's speed, in line spacings."""

Row = tuple[str, int, str]
"""Name, node and direction of a channel."""


class SweepFile:
    """One UFF file of a sweep.

    Parameters
    ----------
    path : Path
        UFF file.
    types : tuple of int
        UFF function types that are accepted.
    is_complex : bool
        Whether its channels are spectra, or samples over time.

    Raises
    ------
    InputError
        The file cannot be read as UFF, or its functions have different axes.
    """

    def __init__(self, path: Path, types: tuple[int, ...], *, is_complex: bool) -> None:
        self.path = path
        self.types = types
        self.is_complex = is_complex
        self.functions = read_uff(path)
        self.axis: RealArray = self.functions[0].abscissa
        for function in self.functions:
            if not np.array_equal(function.abscissa, self.axis):
                raise self.error(
                    f"the axes of {self.functions[0].dof} and {function.dof} differ: export all on "
                    "the same lines"
                )

    def error(self, sentence: str) -> InputError:
        """Return an error that names the file."""
        return InputError(f"{self.path}: {sentence}")

    def columns(self, rows: Sequence[Row], ordinate: str, unit: str) -> ComplexArray:
        """Return channels along positive axes, shape (n_line, n_channel).

        Raises
        ------
        InputError
            A channel is missing, doubled, dead, real where it should be complex or the other way
            round, or of another type or unit.
        """
        found = [self._column(*row, ordinate, unit) for row in rows]
        return np.array(found, dtype=np.complex128).T

    def tacho(self, node: int, ordinate: str) -> RealOrComplexArray:
        """Return speed or pulses, which programs call by various quantities, shape (n_line,).

        Raises
        ------
        InputError
            The tacho is missing, doubled or complex.
        """
        found = [f for f in self.functions if f.response_node == node]
        if not found:
            raise self.error(
                f"there is no tacho (node {node} scalar, {ordinate}) in it: without its pulse the "
                "channels have no phase; export it, or correct tacho_node"
            )
        if len(found) > 1:
            raise self.error(f"the tacho (node {node}) is in it {len(found)} times: keep one")
        if np.iscomplexobj(found[0].values):
            raise self.error(f"the tacho (node {node}) is complex: correct tacho_node")
        return found[0].values

    def _column(
        self, name: str, node: int, direction: str, ordinate: str, unit: str
    ) -> RealOrComplexArray:
        what = f"{ordinate} '{name}' (node {node} {direction})"
        found = [
            function
            for function in self.functions
            if (function.response_node, function.ordinate) == (node, ordinate)
            and function.response_direction.lstrip("+-") == direction.lstrip("+-")
        ]
        if len(found) != 1:
            state = f"is in it {len(found)} times: keep one" if found else "is not in it: export it"
            raise self.error(f"{what} {state}, or correct the position sheet or operation.toml")
        function = found[0]
        if function.function_type not in self.types:
            known = " or ".join(map(str, self.types))
            raise self.error(
                f"{what} has UFF function type {function.function_type}: export it as {known}"
            )
        if np.iscomplexobj(function.values) != self.is_complex:
            kind, remedy = (
                ("real", "phase is needed, export both parts")
                if self.is_complex
                else ("complex", "export samples over time")
            )
            raise self.error(f"{what} is {kind}: {remedy}")
        if function.unit != unit:
            raise self.error(f"{what} is in '{function.unit}': export it in {unit}")
        if not np.any(function.values):
            raise self.error(f"{what} is dead, 0 throughout: repair the channel and measure again")
        values = function.values
        return -values if function.response_direction.startswith("-") else values

    def check_order(self) -> None:
        """Refuse spectra that say they are of another order than the first."""
        for function in self.functions:
            match = re.match(r"order\s+(\d+(?:\.\d+)?)", function.id_lines[0])
            if match and float(match[1]) != 1.0:
                raise self.error(
                    f"{function.dof} is of order {match[1]}: an unbalance is of order 1, export "
                    "that"
                )

    def check_speed(self, node: int) -> None:
        """Refuse lines that are not the tacho's speed."""
        speed = self.tacho(node, "speed in rpm")
        wrong = np.abs(speed / 60.0 - self.axis) > SPEED_TOLERANCE * np.diff(self.axis).min()
        if wrong.any():
            first = int(np.argmax(wrong))
            raise self.error(
                f"the tacho reads {speed[first]:.6g} rpm at {self.axis[first]:.6g} Hz, which is "
                "not order 1: a pulse may be missing; repair the tacho and track the order again"
            )


_SPECTRA = (0, 12, 27)
"""UFF function types that hold complex spectra: general, spectrum, order function."""
_OVER_TIME = (1,)
ENTITY_NAME = 10
"""Characters of a channel's name that UFF keeps; the DoF is what counts."""
_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class SweepNodes:
    """What the nodes of the UFF files are.

    Parameters
    ----------
    sensors : tuple of PlacedSensor
        Triaxial accelerometers on the compressor, in their own axes.
    tacho : int
        Direction scalar.
    holders : tuple of (str, int)
        Name and node of each triaxial accelerometer on the body side of a mount, in the axes of
        the position sheet.
    microphones : tuple of (str, int)
        Name and node, direction scalar.
    """

    sensors: tuple[PlacedSensor, ...]
    tacho: int
    holders: tuple[tuple[str, int], ...] = ()
    microphones: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, eq=False)
class SweepSpectra:
    """What one file of order spectra holds.

    Parameters
    ----------
    acceleration : Spectrum
        Channels ``A1 x`` … of the compressor [m/s^2].
    holder, sound : Spectrum or None
        Channels ``mount 1 x`` … [m/s^2] and the microphones [Pa]; None where there are none.
    """

    acceleration: Spectrum
    holder: Spectrum | None
    sound: Spectrum | None


@dataclass(frozen=True, eq=False)
class SweepRecord:
    """What one file over time holds.

    Parameters
    ----------
    tacho : array, shape (n_sample,)
        [V or 1].
    acceleration : TimeRecord
        As in `SweepSpectra`.
    holder, sound : TimeRecord or None
    """

    tacho: RealArray
    acceleration: TimeRecord
    holder: TimeRecord | None
    sound: TimeRecord | None


def write_sweep(
    path: Path,
    nodes: SweepNodes,
    frequency: RealArray,
    acceleration: RealOrComplexArray,
    *,
    holder: RealOrComplexArray | None = None,
    sound: RealOrComplexArray | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write order spectra, and the speed of the tacho, as UFF functions of type 0.

    Parameters
    ----------
    path : Path
        UFF file.
    nodes : SweepNodes
        What is written.
    frequency : array, shape (f,)
        Of the rotation, evenly spaced [Hz].
    acceleration : array, shape (f, 3 n_sensor)
        Complex peak, phase from the tacho's pulse [m/s²].
    holder : array, shape (f, 3 n_holder), optional
        [m/s²].
    sound : array, shape (f, n_microphone), optional
        [Pa].
    notes : sequence of str
        Up to four lines on where it comes from.

    Raises
    ------
    InputError
        Columns that are not the channels of the nodes, or a file that cannot be written.
    """
    lines = ("order 1", *notes)
    columns = _columns(path, nodes, acceleration, holder, sound)
    columns.append(("tacho", nodes.tacho, "scalar", "rpm", "rpm", np.asarray(60.0 * frequency)))
    write_uff(path, _functions(frequency, columns, 0, lines), binary=True)


def write_sweep_record(
    path: Path,
    nodes: SweepNodes,
    rate: float,
    tacho: RealArray,
    acceleration: RealArray,
    *,
    holder: RealArray | None = None,
    sound: RealArray | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write channels over time as UFF functions of type 1.

    Parameters
    ----------
    path, nodes, notes
        As for `write_sweep`.
    rate : float
        Samples per second; ``operation.toml`` keeps it exactly [Hz].
    tacho : array, shape (n_sample,)
        One pulse per revolution; its rising edge marks the angle [1].
    acceleration, holder, sound : array, shape (n_sample, ...)
        As for `write_sweep`, over time.

    Raises
    ------
    InputError
        As `write_sweep`.
    """
    # UFF keeps six digits of a step
    step = float(f"{1 / rate:.5e}")
    time = np.asarray(step * np.arange(len(tacho)), dtype=np.float64)
    columns = _columns(path, nodes, acceleration, holder, sound)
    columns.append(("tacho", nodes.tacho, "scalar", "general", "1", tacho))
    write_uff(path, _functions(time, columns, 1, notes), binary=True)


def read_sweep(path: Path, nodes: SweepNodes) -> SweepSpectra:
    """Read order spectra.

    Raises
    ------
    InputError
        The file cannot be read as UFF; the tacho is missing or does not fit the lines; a channel is
        missing, doubled, dead, real, or of another order, type or unit.
    """
    file = SweepFile(path, _SPECTRA, is_complex=True)
    frequency = file.axis
    file.check_order()
    file.check_speed(nodes.tacho)

    def spectrum(rows: list[Row], ordinate: str, unit: str) -> Spectrum | None:
        if not rows:
            return None
        return Spectrum(frequency, file.columns(rows, ordinate, unit), _names(rows), unit)

    acceleration = spectrum(_sensor_rows(nodes), "acceleration", "m/s^2")
    assert acceleration is not None
    return SweepSpectra(
        acceleration,
        spectrum(_holder_rows(nodes), "acceleration", "m/s^2"),
        spectrum(_microphone_rows(nodes), "pressure", "Pa"),
    )


def read_sweep_record(path: Path, nodes: SweepNodes, rate: float) -> SweepRecord:
    """Read channels over time.

    Parameters
    ----------
    path : Path
        UFF file.
    nodes : SweepNodes
        What is read.
    rate : float
        Samples per second [Hz].

    Raises
    ------
    InputError
        As `read_sweep`; a rate that is not the file's.
    """
    file = SweepFile(path, _OVER_TIME, is_complex=False)
    stated = (file.axis.size - 1) / (file.axis[-1] - file.axis[0])
    if abs(stated / rate - 1) > 1e-4:
        raise InputError(
            f"{path}: its samples are {1 / stated:.6g} s apart, but sample_rate_hz says "
            f"{rate:g}: correct the wrong one"
        )
    tacho = file.tacho(nodes.tacho, "general").astype(np.float64)

    def record(rows: list[Row], ordinate: str, unit: str) -> TimeRecord | None:
        if not rows:
            return None
        return TimeRecord(file.columns(rows, ordinate, unit).real, rate, _names(rows), unit)

    acceleration = record(_sensor_rows(nodes), "acceleration", "m/s^2")
    assert acceleration is not None
    return SweepRecord(
        tacho,
        acceleration,
        record(_holder_rows(nodes), "acceleration", "m/s^2"),
        record(_microphone_rows(nodes), "pressure", "Pa"),
    )


_Column = tuple[str, int, str, str, str, RealOrComplexArray]
"""Name, node, direction, quantity, unit and values."""


def _sensor_rows(nodes: SweepNodes) -> list[Row]:
    return [(f"{s.sensor} {axis}", s.node, f"+{axis}") for s in nodes.sensors for axis in _AXES]


def _holder_rows(nodes: SweepNodes) -> list[Row]:
    return [(f"{name} {axis}", node, f"+{axis}") for name, node in nodes.holders for axis in _AXES]


def _microphone_rows(nodes: SweepNodes) -> list[Row]:
    return [(name, node, "scalar") for name, node in nodes.microphones]


def _names(rows: list[Row]) -> tuple[str, ...]:
    return tuple(name for name, *_ in rows)


def _columns(
    path: Path,
    nodes: SweepNodes,
    acceleration: RealOrComplexArray,
    holder: RealOrComplexArray | None,
    sound: RealOrComplexArray | None,
) -> list[_Column]:
    columns: list[_Column] = []
    for what, rows, values, ordinate, unit in (
        ("acceleration", _sensor_rows(nodes), acceleration, "acceleration", "m/s^2"),
        ("holder", _holder_rows(nodes), holder, "acceleration", "m/s^2"),
        ("sound", _microphone_rows(nodes), sound, "pressure", "Pa"),
    ):
        width = 0 if values is None else values.shape[1]
        if width != len(rows):
            raise InputError(
                f"{path}: {what} has {width} columns, the nodes have {len(rows)} channels"
            )
        if values is not None:
            columns += [
                (*row, ordinate, unit, column) for row, column in zip(rows, values.T, strict=True)
            ]
    return columns


def _functions(
    axis: RealArray, columns: Sequence[_Column], kind: int, notes: Sequence[str]
) -> list[UffFunction]:
    return [
        UffFunction(
            abscissa=axis,
            values=values,
            function_type=kind,
            response_node=node,
            response_direction=direction,
            reference_node=0,
            reference_direction="scalar",
            ordinate=ordinate,
            ordinate_unit=unit,
            denominator="none",
            denominator_unit="",
            id_lines=tuple(notes),
            response_name=name.replace(" ", "")[:ENTITY_NAME],
        )
        for name, node, direction, ordinate, unit, values in columns
    ]


OPERATING_TEST_FILE = "operation.toml"

Title = Annotated[str, Field(min_length=1)]
Node = Annotated[int, Field(ge=1)]


class DeviationSection(StrictModel):
    """Standard deviation of the real and of the imaginary part of an order spectrum.

    Both add as squares: what scatters from run to run with the amplitude, and the floor
    ``floor √(1 + (corner/f)²)`` of the channels.
    """

    relative: Positive
    """Over the amplitude [1]."""
    floor_m_s2: Positive
    """Far above the corner."""
    corner_hz: Positive
    """Below it the floor grows as 1/f."""


class SweepSection(StrictModel):
    """One run-up at one pressure, as spectra of first order or over time."""

    name: Title
    """Such as ``standard 7.5 bar``."""
    hoses: Literal["standard", "soft"]
    """Those of the vehicle, or long soft ones with masses on them."""
    pressure_bar: Positive
    """Of the gas at the outlet."""
    spectra: RelativePath | None = None
    """UFF file of the order spectra."""
    record: RelativePath | None = None
    """UFF file of the channels over time, with the tacho; instead of `spectra`."""
    sample_rate_hz: Positive | None = None
    """Of the record, exact; UFF keeps six digits of it."""


class HoseSection(StrictModel):
    """A hose as drawn and catalogued: start values, not truth."""

    name: Title
    """Such as ``suction hose``."""
    position_m: Row3
    """Of the port on the compressor, from the origin of the position sheet."""
    direction: Row3
    """From the port to the body, of any length."""
    length_m: Positive
    """Between its ends."""
    tension_n: Positive
    """EA."""
    torsion_n_m2: Positive
    """GJ."""
    bending_n_m2: Positive
    """EI."""
    line_mass_kg_per_m: Positive
    """With what flows in it."""
    loss_factor: Positive
    """Of all three stiffnesses."""
    torsion_radius_m: Positive
    """Radius of gyration of the section about its axis."""


class HolderSection(StrictModel):
    """A triaxial accelerometer on the body side of a mount, along the axes of the position sheet.

    An accelerometer under an angle is turned before it is delivered.
    """

    name: Title
    """Of the mount, such as ``mount 1``; its channels are ``mount 1 x`` and so on."""
    node: Node
    """In the UFF files."""


class MicrophoneSection(StrictModel):
    """A microphone."""

    name: Title
    """Such as ``driver``."""
    node: Node
    """In the UFF files, direction scalar."""


class OperatingTestFile(StrictModel):
    """The whole file ``operation.toml``."""

    format: Literal[1]
    """Version of this format."""
    title: Title
    """What a reader calls the test."""
    hammer: RelativePath
    """Folder of the hammer test without hoses, with its ``compressor_test.toml``."""
    hammer_with_hoses: RelativePath | None = None
    """Folder of the one with the standard hoses, compressor off."""
    sensor_table: RelativePath
    """Position sheet of the accelerometers as they stood in the sweeps, CSV or Excel."""
    tacho_node: Node
    """In the UFF files, direction scalar; one pulse per revolution, where the rotor's mark is on
    the y axis."""
    rotor_inertia_kg_m2: Positive | None = None
    """Polar moment of the rotor, from its data sheet."""
    deviations: DeviationSection
    """How well the spectra of the accelerometers are known."""
    sweeps: Annotated[tuple[SweepSection, ...], Field(strict=False, min_length=1)]
    """All run-ups."""
    hoses: Annotated[tuple[HoseSection, ...], Field(strict=False)] = ()
    """Left out where there is no drawing."""
    holders: Annotated[tuple[HolderSection, ...], Field(strict=False)] = ()
    """Left out where there were none."""
    microphones: Annotated[tuple[MicrophoneSection, ...], Field(strict=False)] = ()
    """Left out where there were none."""


def load_operating_test_file(path: Path) -> OperatingTestFile:
    """Read and check ``operation.toml``.

    Raises
    ------
    InputError
        The file is missing or is not TOML; a key is unknown, missing, mistyped or out of range; a
        sweep without a file, with two, or with a record of unknown rate; doubled names or nodes.
    """
    file = load_toml(path, OperatingTestFile)
    _check(path, file)
    return file


def dump_operating_test_file(path: Path, file: OperatingTestFile) -> None:
    """Write ``operation.toml``; what is written is read back and compared first.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    _check(path, file)
    dump_toml(path, file)


def _check(path: Path, file: OperatingTestFile) -> None:
    for sweep in file.sweeps:
        where = f"{path}: [[sweeps]] '{sweep.name}'"
        if (sweep.spectra is None) == (sweep.record is None):
            raise InputError(
                f"{where}: name its order spectra with the key 'spectra', or its channels over "
                "time with the key 'record', one of both"
            )
        if (sweep.record is None) != (sweep.sample_rate_hz is None):
            raise InputError(f"{where}: the keys 'record' and 'sample_rate_hz' come together")
    for section, entries in (
        ("sweeps", file.sweeps),
        ("hoses", file.hoses),
        ("holders", file.holders),
        ("microphones", file.microphones),
    ):
        names = [entry.name for entry in entries]
        doubled = next((name for name in names if names.count(name) > 1), None)
        if doubled is not None:
            raise InputError(f"{path}: two [[{section}]] are named '{doubled}': keep or rename one")
    nodes = [file.tacho_node]
    nodes += [holder.node for holder in file.holders]
    nodes += [microphone.node for microphone in file.microphones]
    twice = next((node for node in nodes if nodes.count(node) > 1), None)
    if twice is not None:
        raise InputError(
            f"{path}: node {twice} stands for two of tacho, holders and microphones: give each its "
            "own"
        )


SAME_PLACE = 1e-4
"""Largest difference of a place between two position sheets [m]: rounding."""
SAME_ANGLE = 2e-4
"""Largest difference of a direction between two position sheets [rad]: rounding."""

_BAR = 1e5
_HAMMER = "the hammer test"

__all__ = ["OPERATING_TEST_FILE", "read_operating_test"]


def read_operating_test(folder: Path | str) -> OperatingTest:
    """Read hammer tests, sweeps and what is stated besides.

    Parameters
    ----------
    folder : path
        Holds ``operation.toml`` and what it names.

    Returns
    -------
    OperatingTest
        In SI, along positive axes. A sweep over time has been tracked.

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a sweep without its tacho; sensors that stand
        elsewhere than in the hammer test. The sentence names file, item and remedy.

    Notes
    -----
    The deviation of a tracked sweep is the stated share of the amplitude and, instead of the stated
    floor, what the filter lets through at order 1.5.
    """
    folder = Path(folder)
    path = folder / OPERATING_TEST_FILE
    file = load_operating_test_file(path)
    table = folder / file.sensor_table
    sensors = read_placed_sensors(table)
    hammer = read_inertance_test(folder / file.hammer)
    _check_sensors(table, sensors, hammer)
    with_hoses = None
    if file.hammer_with_hoses is not None:
        with_hoses = read_inertance_test(folder / file.hammer_with_hoses)
        _check_sensors(table, sensors, with_hoses, "the hammer test with hoses")
        _check_impacts(folder / file.hammer_with_hoses, with_hoses, hammer)
    nodes = SweepNodes(
        sensors,
        file.tacho_node,
        tuple((entry.name, entry.node) for entry in file.holders),
        tuple((entry.name, entry.node) for entry in file.microphones),
    )
    sweeps = tuple(_sweep(folder, entry, file.deviations, nodes) for entry in file.sweeps)
    read = [path, table, *hammer.input_files, *(with_hoses.input_files if with_hoses else ())]
    read += [folder / (entry.spectra or entry.record or "") for entry in file.sweeps]
    try:
        return OperatingTest(
            name=file.title,
            hammer=hammer,
            hammer_with_hoses=with_hoses,
            sweeps=sweeps,
            rotor_inertia=file.rotor_inertia_kg_m2,
            hoses=_hoses(file),
            input_files=tuple(dict.fromkeys(read)),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _sweep(
    folder: Path, entry: SweepSection, stated: DeviationSection, nodes: SweepNodes
) -> OperatingSweep:
    try:
        if entry.spectra is not None:
            found = read_sweep(folder / entry.spectra, nodes)
            acceleration, holder, sound = found.acceleration, found.holder, found.sound
            corner = stated.corner_hz / acceleration.frequency
            floor = (stated.floor_m_s2 * np.sqrt(1 + corner**2))[:, np.newaxis]
        else:
            # loading made sure that a record and its rate are there
            assert entry.record is not None
            assert entry.sample_rate_hz is not None
            record = read_sweep_record(folder / entry.record, nodes, entry.sample_rate_hz)
            parts = [one for one in (record.acceleration, record.holder, record.sound) if one]
            try:
                tracked = tracked_sweep(record.tacho, parts)
            except InputError as error:
                raise InputError(f"{folder / entry.record}: {error}") from None
            acceleration, *rest = tracked.spectra
            holder = rest.pop(0) if record.holder else None
            sound = rest.pop(0) if record.sound else None
            floor = np.maximum(tracked.noise[0], np.finfo(float).tiny)
        return OperatingSweep(
            name=entry.name,
            hoses=HoseState(entry.hoses),
            pressure=_BAR * entry.pressure_bar,
            acceleration=acceleration,
            deviation=np.hypot(stated.relative * np.abs(acceleration.values), floor),
            holder=holder,
            sound=sound,
        )
    except InputError as error:
        raise InputError(f"sweep '{entry.name}': {error}") from None


def _hoses(file: OperatingTestFile) -> tuple[HoseDrawing, ...]:
    return tuple(
        HoseDrawing(
            name=hose.name,
            position=np.array(hose.position_m),
            direction=np.array(hose.direction),
            length=hose.length_m,
            tension=hose.tension_n,
            torsion=hose.torsion_n_m2,
            bending=hose.bending_n_m2,
            line_mass=hose.line_mass_kg_per_m,
            loss_factor=hose.loss_factor,
            torsion_radius=hose.torsion_radius_m,
        )
        for hose in file.hoses
    )


def _check_sensors(
    table: Path, sensors: tuple[PlacedSensor, ...], test: InertanceTest, which: str = _HAMMER
) -> None:
    """Refuse sensors that were moved, turned, added or left out between the tests."""
    there = tuple(sensor.sensor for sensor in sensors)
    struck = tuple(sensor.name for sensor in test.sensors)
    if there != struck:
        raise InputError(
            f"{table}: the sensors {', '.join(there)} are not those of {which}, "
            f"{', '.join(struck)}, in their order: leave the sensors where they were struck"
        )
    for placed, sensor in zip(sensors, test.sensors, strict=True):
        off = float(np.abs(np.array(placed.position) - sensor.position).max())
        turned = _largest_turn(rotation_matrix(placed.angles), sensor.orientation)
        if off > SAME_PLACE or turned > SAME_ANGLE:
            raise InputError(
                f"{table}: sensor {placed.sensor} stands {1e3 * off:.3g} mm and "
                f"{np.rad2deg(turned):.3g}° from where it stood in {which}: errors of placement no "
                "longer cancel; strike again with the sensors as they are, or correct the sheet"
            )


def _check_impacts(folder: Path, test: InertanceTest, hammer: InertanceTest) -> None:
    # other names are refused with the operating test itself
    for impact, other in zip(test.impacts, hammer.impacts, strict=False):
        off = np.abs([impact.position - other.position, impact.direction - other.direction])
        if impact.name == other.name and off.max() > SAME_PLACE:
            raise InputError(
                f"{folder}: {impact.name} has another place or direction than in {_HAMMER}: strike "
                "the same points with hoses and without, or correct the sheet"
            )


def _largest_turn(one: RealArray, other: RealArray) -> float:
    """Angle between two orientations [rad]."""
    # ‖A − B‖ = 2√2 sin(θ/2), which is exact for small angles where the trace is not
    half = min(float(np.linalg.norm(one - other)) / np.sqrt(8), 1.0)
    return float(2 * np.arcsin(half))
