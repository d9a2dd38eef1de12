"""A platform folder, read and checked: mounts, vehicles and load cases in SI."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.function_table import TABLE_ENDINGS, is_table, read_function_table
from deboom.files.rows import (
    NOISE_TRANSFER,
    QUANTITY_UNIT,
    ChannelRow,
    MountRow,
    read_table,
    table_columns,
)
from deboom.files.schema import (
    Note,
    StrictModel,
    dump_toml,
    has_name,
    load_toml,
    load_what_is_right,
    noting,
    refuse,
    refuse_doubled,
)
from deboom.files.tables import SAME_LINE, parse_unit, read_rows, read_torque_table
from deboom.files.uff import UffFunction, find, read_uff
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.mounts.mount import AXES, Mount
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.powertrain import Powertrain


def _named_channels(path: Path) -> frozenset[tuple[str, str]]:
    """Quantity and name of every row of a channel table, right or wrong."""
    rows = read_rows(path, *table_columns(ChannelRow), note=lambda _error: None)
    return frozenset((row.cells["quantity"], row.cells["channel"]) for row in rows)


_FRF = (4,)
_SPECTRA = (0, 12, 27)
"""UFF function types that hold complex spectra: general, spectrum, order function."""


_Choice = Callable[[ChannelRow], UffFunction]


@dataclass(frozen=True, eq=False)
class Columns:
    """Channels of one quantity from one file.

    Parameters
    ----------
    path : Path
        The file.
    rows : tuple of ChannelRow
        One per column.
    functions : tuple of UffFunction
        The same columns as they were read.
    """

    path: Path
    rows: tuple[ChannelRow, ...]
    functions: tuple[UffFunction, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Channel names."""
        return tuple(row.channel for row in self.rows)

    @property
    def values(self) -> npt.NDArray[np.complex128]:
        """Values along the positive axes, shape (n_frequency, n_channel), in SI."""
        signed = [row.sign * f.values for row, f in zip(self.rows, self.functions, strict=True)]
        return np.stack(signed, axis=-1).astype(np.complex128)


def noise_transfer_columns(
    path: Path,
    item: str,
    ear_node: int | None,
    rows: Sequence[ChannelRow],
    note: Note = refuse,
) -> Columns:
    """Choose the noise transfer functions of a vehicle.

    Parameters
    ----------
    path : Path
        UFF file, or a table (`deboom.files.function_table`).
    item : str
        Whose it is, for messages.
    ear_node : int or None
        Response node; not asked for in a table.
    rows : sequence of ChannelRow
        The paths, in the order wanted.
    note : callable
        Gets every path at fault, which is left out; by default the first one is raised.

    Raises
    ------
    InputError
        A path without its function, or with one of another type, unit or quantity; functions of
        different microphones (response names).
    """
    choose = _by_name(path) if is_table(path) else _by_path(path, ear_node)
    columns = _columns(path, item, rows, choose, _FRF, note)
    microphones = sorted({function.response_name for function in columns.functions})
    if len(microphones) > 1:
        note(
            InputError(
                f"{path}: {item}: noise transfer functions of different microphones "
                f"({', '.join(map(repr, microphones))}) are mixed at node {ear_node}: measure all "
                "paths with one, or correct the response names"
            )
        )
    return columns


def _by_path(path: Path, ear_node: int | None) -> _Choice:
    functions = read_uff(path)

    def choose(row: ChannelRow) -> UffFunction:
        return find(
            functions,
            response_node=ear_node,
            response_direction="scalar",
            reference_node=row.node,
            reference_direction=row.direction,
            ordinate="pressure",
        )

    return choose


def operating_columns(
    path: Path,
    item: str,
    order: float | None,
    rows: Sequence[ChannelRow],
    note: Note = refuse,
) -> tuple[Columns, ...]:
    """Choose the operating spectra of a load case: displacement, then force."""
    choose = _by_name(path) if is_table(path) else _by_node(path, order)
    return tuple(
        _columns(
            path, item, [row for row in rows if row.quantity == quantity], choose, _SPECTRA, note
        )
        for quantity in ("displacement", "force")
    )


def _by_node(path: Path, order: float | None) -> _Choice:
    functions = read_uff(path)

    def choose(row: ChannelRow) -> UffFunction:
        function = find(
            functions,
            response_node=row.node,
            response_direction=row.direction,
            ordinate=row.quantity,
        )
        match = re.match(r"order\s+(\d+(?:\.\d+)?)", function.id_lines[0])
        if match and order is not None and float(match[1]) != order:
            raise InputError(
                f"it is of order {match[1]}, but the dominant_order of the engine is {order:g}: "
                "correct the wrong one"
            )
        return function

    return choose


def _by_name(path: Path) -> _Choice:
    """Make functions of the table's columns, at the degrees of freedom of the channel table."""
    table = read_function_table(path)

    def choose(row: ChannelRow) -> UffFunction:
        transfer = row.quantity == NOISE_TRANSFER
        name = row.channel if transfer else f"{row.channel} {row.quantity}"
        unit, values = table.spectrum(name)
        ordinate, _, denominator = unit.si.partition("/")
        return UffFunction(
            abscissa=table.frequency,
            values=values,
            function_type=_FRF[0] if transfer else _SPECTRA[0],
            response_node=0 if transfer else row.node,
            response_direction="scalar" if transfer else row.direction,
            reference_node=row.node if transfer else 0,
            reference_direction=row.direction if transfer else "scalar",
            ordinate="pressure" if transfer else row.quantity,
            ordinate_unit=ordinate,
            denominator="force" if denominator else "none",
            denominator_unit=denominator,
            response_name="ear" if transfer else "",
            file_unit=unit.label,
        )

    return choose


def common_axis(files: Sequence[Columns], note: Note = refuse) -> npt.NDArray[np.float64]:
    """Return the frequency lines that all functions share [Hz]; the first function sets them."""
    there = [columns for columns in files if columns.functions]
    if not there:
        return np.zeros(0)
    first = there[0].functions[0]
    lines = first.abscissa
    told: set[Path] = set()
    for columns in there:
        try:
            _check_axis(columns, there[0].path, first)
        except InputError as error:
            if columns.path not in told:
                note(error)
            told.add(columns.path)
    return lines


def _check_axis(columns: Columns, path: Path, first: UffFunction) -> None:
    lines = first.abscissa
    for function in columns.functions:
        if function.abscissa_quantity != "frequency":
            raise InputError(
                f"{columns.path} ({function.dof}): the abscissa is "
                f"{function.abscissa_quantity}: export it over frequency in Hz"
            )
        if not _same(lines, function.abscissa):
            raise InputError(
                f"the frequency axes of {path} ({first.dof}) and {columns.path} "
                f"({function.dof}) differ: {_first_difference(lines, function.abscissa)}; "
                "measure or export both on the same lines"
            )


def _same(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> bool:
    """Tell whether lines are the same, but for the digits that a file keeps."""
    return a.size == b.size and not _differing(a, b).size


def _differing(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> npt.NDArray[np.intp]:
    return np.flatnonzero(np.abs(a - b) > SAME_LINE * np.diff(a).min())


def _first_difference(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> str:
    n = min(a.size, b.size)
    different = _differing(a[:n], b[:n])
    if not different.size:
        return f"{a.size} and {b.size} lines"
    i = int(different[0])
    return f"line {i + 1} is {a[i]:.9g} Hz and {b[i]:.9g} Hz"


def _columns(
    path: Path,
    item: str,
    rows: Sequence[ChannelRow],
    choose: _Choice,
    types: tuple[int, ...],
    note: Note,
) -> Columns:
    found: dict[ChannelRow, UffFunction] = {}
    for row in rows:
        try:
            function = choose(row)
            _check(function, row, types)
        except InputError as error:
            what = f"{item}, {row.quantity} of '{row.channel}'"
            note(InputError(f"{path}: {what}: {error}"))
        else:
            found[row] = function
    return Columns(path, tuple(found), tuple(found.values()))


def _check(function: UffFunction, row: ChannelRow, types: tuple[int, ...]) -> None:
    if function.function_type not in types:
        known = " or ".join(map(str, types))
        raise InputError(f"UFF function type {function.function_type}: export it as type {known}")
    if not np.iscomplexobj(function.values):
        raise InputError("its values are real: export real and imaginary part, phase is needed")
    if not function.ordinate_unit:
        raise InputError(
            "it has no unit: write a unit label or a data set 164 into the file (the channel table "
            f"says '{row.unit.label}')"
        )
    if function.unit != QUANTITY_UNIT[row.quantity]:
        raise InputError(f"it is in '{function.unit}': export it in {QUANTITY_UNIT[row.quantity]}")
    if not np.isclose(parse_unit(function.file_unit).factor, row.unit.factor, rtol=1e-9, atol=0):
        raise InputError(
            f"it is in '{function.file_unit}', but the channel table says '{row.unit.label}': "
            "correct the wrong one"
        )


def _plain_name(name: str) -> str:
    if not name or any(character.isspace() for character in name):
        raise ValueError("a name needs at least one character and no blanks")
    return name


def _inside(name: str) -> str:
    path = PurePosixPath(name)
    if not name or path.is_absolute() or ".." in path.parts or "\\" in name or ":" in name:
        raise ValueError("a file is named relative to the platform folder, with / and without ..")
    return name


def _symmetric_positive(rows: Matrix3) -> Matrix3:
    matrix = np.array(rows)
    if not np.array_equal(matrix, matrix.T) or np.any(np.linalg.eigvalsh(matrix) <= 0):
        raise ValueError("an inertia tensor is symmetric and positive definite")
    return rows


Name = Annotated[str, AfterValidator(_plain_name)]
RelativePath = Annotated[str, AfterValidator(_inside)]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
# TOML has arrays only, no tuples: the container is converted, its items stay strict
Row3 = Annotated[tuple[float, float, float], Field(strict=False)]
Matrix3 = Annotated[tuple[Row3, Row3, Row3], Field(strict=False)]


class Engine(StrictModel):
    """The engine and its gearbox."""

    cylinders: Annotated[int, Field(ge=1)]
    """Number of cylinders."""
    dominant_order: Positive
    """Engine order of the operating spectra [cycles per revolution]."""
    total_ratios: Annotated[tuple[Positive, ...], Field(strict=False, min_length=1)]
    """Engine speed over wheel speed, gear 1 first [1]."""


class PowertrainEntry(StrictModel):
    """Nominal rigid-body data from the data sheet, with tolerances."""

    mass_kg: Positive
    """Mass [kg]."""
    mass_tolerance_kg: NotNegative
    """Half width [kg]."""
    inertia_kg_m2: Annotated[Matrix3, AfterValidator(_symmetric_positive)]
    """Matrix entries about the centre of gravity, vehicle axes [kg m²]."""
    inertia_tolerance: NotNegative
    """Half width relative to the diagonal [1]."""
    centre_of_gravity_tolerance_m: NotNegative
    """Half width per axis [m]."""


class MountEntry(StrictModel):
    """One mount."""

    name: Name
    """Short, such as ``TSM``."""
    description: str
    """In words, for the report."""
    pieces: Annotated[tuple[Name, ...], Field(strict=False, min_length=2)] | None = None
    """Pieces that share the part number; left out for a single piece."""
    transfer_axes: Annotated[tuple[Literal["x", "y", "z"], ...], Field(strict=False)]
    """Axes whose force reaches the cabin."""
    body_mass_kg: Positive | None = None
    """Mass of the body on each piece where that is not the powertrain, from the data sheet [kg]."""
    body_mass_tolerance_kg: NotNegative | None = Field(default=None, validate_default=True)
    """Half width [kg]; stated with the mass."""

    @field_validator("body_mass_tolerance_kg")
    @classmethod
    def _mass_and_tolerance(cls, tolerance: float | None, others: ValidationInfo) -> float | None:
        mass = others.data.get("body_mass_kg")
        if mass is None and tolerance is not None:
            raise ValueError("a tolerance needs the key 'body_mass_kg' beside it")
        if mass is not None and (tolerance is None or tolerance >= mass):
            raise ValueError("a body mass needs a tolerance below it; state 0.0 for a weighed one")
        return tolerance

    @property
    def piece_names(self) -> tuple[str, ...]:
        """Names of the pieces; ``("",)`` for a single one."""
        return self.pieces or ("",)


class VehicleEntry(StrictModel):
    """One vehicle and the file of its noise transfer functions."""

    name: Name
    """Such as ``U06-1``."""
    group: Name
    """Vehicles of one body, such as ``U06``."""
    noise_transfer: RelativePath
    """UFF file, or a table: CSV, xlsx or MATLAB's mat."""
    ear_node: Annotated[int, Field(ge=1)] | None = Field(default=None, validate_default=True)
    """Response node of the driver's ear in a UFF file; a table has none."""

    @field_validator("ear_node")
    @classmethod
    def _node_of_a_uff_file(cls, node: int | None, others: ValidationInfo) -> int | None:
        name = others.data.get("noise_transfer", "")
        if node is None and PurePosixPath(name).suffix.lower() not in ("", *TABLE_ENDINGS):
            raise ValueError("a UFF file needs the response node of the driver's ear: add it")
        return node


class LoadCaseEntry(StrictModel):
    """One run and the file of its operating spectra."""

    name: Name
    """Short key, such as ``g5_wot220``."""
    title: str
    """In words, for the report."""
    gear: Annotated[int, Field(ge=1)]
    """Gear of the run."""
    torque_limit_nm: Positive
    """Engine torque limit [N m]."""
    operating: RelativePath
    """UFF file, or a table: CSV, xlsx or MATLAB's mat."""
    torque_table: RelativePath | None = None
    """CSV or xlsx with the engine torque at every line; left out where it was not recorded."""


class PlatformFile(StrictModel):
    """The whole file ``platform.toml``."""

    format: Literal[1]
    """Version of this format."""
    name: Name
    """Short key of the platform."""
    title: str
    """What a reader calls it."""
    description: str
    """A paragraph for the report."""
    mount_table: RelativePath
    """CSV or xlsx with the positions of the mounts."""
    channel_table: RelativePath
    """CSV or xlsx that says which UFF node and direction is which channel."""
    default_load_case: Name
    """Name of the load case that is meant when none is asked for."""
    engine: Engine
    """Engine and gearbox."""
    powertrain: PowertrainEntry | None = None
    """Nominal rigid-body data; without them the motion is taken as measured."""
    mounts: Annotated[tuple[MountEntry, ...], Field(strict=False, min_length=1)]
    """In the order of the design variables."""
    vehicles: Annotated[tuple[VehicleEntry, ...], Field(strict=False, min_length=1)]
    """In the order of the report."""
    load_cases: Annotated[tuple[LoadCaseEntry, ...], Field(strict=False, min_length=1)]
    """In the order of the report."""


def load_platform_file(path: Path) -> PlatformFile:
    """Read and check ``platform.toml``.

    Parameters
    ----------
    path : Path
        The TOML file.

    Returns
    -------
    PlatformFile
        Every key checked for its name, type and range.

    Raises
    ------
    InputError
        The file is missing or is not TOML; a key is unknown, missing, mistyped or out of range; two
        items share a name; a gear has no ratio; the default load case does not exist.
    """
    platform = load_toml(path, PlatformFile)
    _check_names(path, platform)
    return platform


def load_right_platform_file(path: Path, note: Note) -> PlatformFile:
    """Read ``platform.toml``, tell all its faults, and return what is right of it.

    Raises
    ------
    InputError
        The file is missing or is not TOML; see also
        `deboom.files.schema.load_what_is_right`.
    """
    platform = load_what_is_right(path, PlatformFile, note)
    _check_names(path, platform, note)
    return platform


def dump_platform_file(path: Path, platform: PlatformFile) -> None:
    """Write ``platform.toml``; what is written is read back and compared first.

    Raises
    ------
    InputError
        The content would be refused on reading, or the file cannot be written.
    """
    _check_names(path, platform)
    dump_toml(path, platform)


def _check_names(path: Path, platform: PlatformFile, note: Note = refuse) -> None:
    """Compare the entries with each other; keys at fault, which may be missing, are passed over."""
    named: list[tuple[str, list[str]]] = [
        ("[[mounts]]", [mount.name for mount in platform.mounts]),
        ("[[vehicles]]", [vehicle.name for vehicle in platform.vehicles]),
        ("[[load_cases]]", [case.name for case in platform.load_cases]),
    ]
    for mount in platform.mounts:
        named.append((f"pieces of mount {mount.name}", list(mount.piece_names)))
        axes = list(getattr(mount, "transfer_axes", ()))
        named.append((f"transfer_axes of mount {mount.name}", axes))
    for section, names in named:
        refuse_doubled(path, f"{section} are named", names, note)
    ratios = getattr(getattr(platform, "engine", None), "total_ratios", None)
    for case in platform.load_cases:
        if ratios is not None and getattr(case, "gear", 0) > len(ratios):
            note(
                InputError(
                    f"{path}: load case '{case.name}' is in gear {case.gear}, but total_ratios in "
                    f"[engine] has {len(ratios)} gears: add the ratio"
                )
            )
    known = [case.name for case in platform.load_cases]
    default = getattr(platform, "default_load_case", None)
    if default is not None and default not in known:
        note(
            InputError(
                f"{path}: default_load_case '{default}' is not among the load cases "
                f"{', '.join(known)}: name one of them"
            )
        )


def mounts_of(
    path: Path,
    entries: Sequence[MountEntry],
    table: Path,
    rows: Sequence[MountRow],
    note: Note = refuse,
) -> tuple[Mount, ...]:
    """Put mounts and positions together.

    Parameters
    ----------
    path : Path
        File of the entries, for messages.
    entries : sequence of MountEntry
        In the order of the result.
    table : Path
        File of the rows, for messages.
    rows : sequence of MountRow
        One per mount and piece, in any order.
    note : callable
        Gets every fault; by default the first one is raised. A position at fault is nan.

    Raises
    ------
    InputError
        A row without its mount, a mount or piece without its row.
    """
    known = {(entry.name, piece) for entry in entries for piece in entry.piece_names}
    positions = {(row.mount, row.piece): row.position for row in rows}
    for key in positions:
        if key not in known:
            note(
                InputError(
                    f"{table}: mount '{key[0]}', piece '{key[1]}' is not in {path}: "
                    "correct its name or add it there"
                )
            )

    def position(entry: MountEntry, piece: str) -> tuple[float, float, float]:
        if (entry.name, piece) not in positions:
            note(
                InputError(
                    f"{table}: no row for mount '{entry.name}', piece '{piece}': add its position"
                )
            )
        return positions.get((entry.name, piece), (math.nan,) * 3)

    return tuple(
        Mount(
            name=entry.name,
            description=entry.description,
            pieces=entry.piece_names,
            positions=tuple(position(entry, piece) for piece in entry.piece_names),
            transfer_axes=entry.transfer_axes,
            body_mass=entry.body_mass_kg,
            body_mass_tolerance=entry.body_mass_tolerance_kg or 0.0,
        )
        for entry in entries
    )


PLATFORM_FILE = "platform.toml"
_OF_A_MOUNT = ("name", "description", "transfer_axes", "body_mass_kg", "body_mass_tolerance_kg")


@dataclass(frozen=True, eq=False)
class Platform:
    """Everything measured on one platform.

    Parameters
    ----------
    name, title, description : str
        Short key, a name for readers, a paragraph.
    folder : Path
        Where it was read from.
    mounts : tuple of Mount
        In the order of the design variables.
    powertrain : Powertrain or None
        Nominal mass and inertia, with tolerances, as the data sheet states them; None: not stated.
    fleet : Fleet
        The vehicles, each with its noise transfer functions from a force at each path, inputs
        ``<mount> <axis>``, to the pressure at the driver's ear.
    load_cases : tuple of LoadCase
        All on the same frequency lines as the noise transfer functions.
    default_load_case : str
        Name of the load case that is meant when none is asked for.
    input_files : tuple of Path
        Every file that was read.
    """

    name: str
    title: str
    description: str
    folder: Path
    mounts: tuple[Mount, ...]
    powertrain: Powertrain | None
    fleet: Fleet
    load_cases: tuple[LoadCase, ...]
    default_load_case: str
    input_files: tuple[Path, ...]

    def load_case(self, name: str) -> LoadCase:
        """Return a load case by its name.

        Raises
        ------
        InputError
            No such load case.
        """
        for case in self.load_cases:
            if case.name == name:
                return case
        known = ", ".join(case.name for case in self.load_cases)
        raise InputError(
            f"{self.folder / PLATFORM_FILE}: there is no load case '{name}': use {known}"
        )


def read_platform(folder: Path) -> Platform:
    """Read a platform folder and check that its files fit together.

    Parameters
    ----------
    folder : Path
        Holds ``platform.toml``.

    Returns
    -------
    Platform
        In SI.

    Raises
    ------
    InputError
        A file that is missing, damaged or truncated; a key, column, channel, unit or DoF that is
        missing, unknown or doubled; a vehicle without one of the paths; frequency axes that
        differ. The sentence names the file, the item and the remedy.
    """
    file = load_platform_file(folder / PLATFORM_FILE)
    return assembled(folder, file, read_contents(folder, file))


@dataclass(frozen=True, eq=False)
class Contents:
    """What the files of a platform hold, as far as they are right.

    Parameters
    ----------
    mounts : tuple of Mount
        In the order of ``platform.toml``; None if one of its entries is at fault.
    channels : tuple of ChannelRow
        In the order of their table; empty if it cannot be read.
    frequency : array, shape (f,)
        Lines that all functions share [Hz].
    noise_transfer : dict of str to Columns
        By vehicle.
    operating : dict of str to (Columns, Columns)
        Displacement and force, by load case.
    engine_torque : dict of str to array
        By load case, where it was recorded [N m].
    """

    mounts: tuple[Mount, ...] | None
    channels: tuple[ChannelRow, ...]
    frequency: RealArray
    noise_transfer: Mapping[str, Columns]
    operating: Mapping[str, tuple[Columns, ...]]
    engine_torque: Mapping[str, RealArray]


def read_contents(folder: Path, file: PlatformFile, note: Note = refuse) -> Contents:
    """Read all files that ``platform.toml`` names.

    Parameters
    ----------
    folder : Path
        Holds them.
    file : PlatformFile
        Keys at fault are absent, see `deboom.files.platform.load_right_platform_file`.
    note : callable
        Gets every fault; by default the first one is raised.
    """
    mounts: tuple[Mount, ...] | None = None
    mount_rows: tuple[MountRow, ...] | None = None
    rows: tuple[ChannelRow, ...] = ()
    row_faults: list[InputError] = []
    if hasattr(file, "mount_table"):
        with noting(note):
            mount_rows = read_table(folder / file.mount_table, MountRow, note)
    if mount_rows and all(
        has_name(entry.name) and all(hasattr(entry, key) for key in _OF_A_MOUNT)
        for entry in file.mounts
    ):
        with noting(note):
            mounts = mounts_of(
                folder / PLATFORM_FILE, file.mounts, folder / file.mount_table, mount_rows, note
            )
    if hasattr(file, "channel_table"):
        with noting(row_faults.append):
            rows = read_table(folder / file.channel_table, ChannelRow, row_faults.append)
        for fault in row_faults:
            note(fault)
        if rows and mounts:
            # a row at fault has been told: its channel is not missing as well
            named = _named_channels(folder / file.channel_table) if row_faults else frozenset()
            _check_channels(folder / file.channel_table, rows, mounts, note, named)
    wanted = _by_quantity(rows, mounts) if mounts else _in_table_order(rows)
    order = getattr(getattr(file, "engine", None), "dominant_order", None)
    noise_transfer: dict[str, Columns] = {}
    operating: dict[str, tuple[Columns, ...]] = {}
    for vehicle in (one for one in file.vehicles if hasattr(one, "noise_transfer")):
        path, item = folder / vehicle.noise_transfer, f"vehicle {vehicle.name}"
        node = getattr(vehicle, "ear_node", None)
        with noting(note):
            noise_transfer[vehicle.name] = noise_transfer_columns(
                path, item, node, wanted[NOISE_TRANSFER], note
            )
    for case in (one for one in file.load_cases if hasattr(one, "operating")):
        path, item = folder / case.operating, f"load case {case.name}"
        with noting(note):
            operating[case.name] = operating_columns(
                path, item, order, [*wanted["displacement"], *wanted["force"]], note
            )
    frequency = common_axis(
        [*noise_transfer.values(), *(c for pair in operating.values() for c in pair)], note
    )
    engine_torque = {}
    for case in file.load_cases:
        if case.torque_table:
            with noting(note):
                engine_torque[case.name] = read_torque_table(folder / case.torque_table, frequency)
    return Contents(mounts, rows, frequency, noise_transfer, operating, engine_torque)


def assembled(folder: Path, file: PlatformFile, contents: Contents) -> Platform:
    """Put a platform together from files without a fault.

    Parameters
    ----------
    folder : Path
    file : PlatformFile
        Complete.
    contents : Contents
        Complete.
    """
    inputs = [folder / name for name in (PLATFORM_FILE, file.mount_table, file.channel_table)]
    inputs += [folder / entry.noise_transfer for entry in file.vehicles]
    for entry in file.load_cases:
        inputs += [folder / name for name in (entry.operating, entry.torque_table) if name]
    return Platform(
        name=file.name,
        title=file.title,
        description=file.description,
        folder=folder,
        mounts=contents.mounts or (),
        powertrain=_powertrain(file.powertrain),
        fleet=Fleet(
            tuple(
                _vehicle(entry, contents.noise_transfer[entry.name], contents.frequency)
                for entry in file.vehicles
            )
        ),
        load_cases=tuple(_load_case(entry, file.engine, contents) for entry in file.load_cases),
        default_load_case=file.default_load_case,
        input_files=tuple(dict.fromkeys(inputs)),
    )


def _powertrain(entry: PowertrainEntry | None) -> Powertrain | None:
    if entry is None:
        return None
    return Powertrain(
        mass=entry.mass_kg,
        inertia=np.array(entry.inertia_kg_m2),
        mass_tolerance=entry.mass_tolerance_kg,
        inertia_tolerance=entry.inertia_tolerance,
        centre_tolerance=entry.centre_of_gravity_tolerance_m,
    )


def _vehicle(entry: VehicleEntry, columns: Columns, frequency: RealArray) -> Vehicle:
    ear = columns.functions[0].response_name or f"node {entry.ear_node}"
    values = columns.values[:, np.newaxis, :]
    return Vehicle(entry.name, entry.group, Frf(frequency, values, (ear,), columns.names, "Pa/N"))


def _load_case(entry: LoadCaseEntry, engine: Engine, contents: Contents) -> LoadCase:
    displacement, force = contents.operating[entry.name]
    return LoadCase(
        name=entry.name,
        title=entry.title,
        gear=entry.gear,
        total_ratio=engine.total_ratios[entry.gear - 1],
        torque_limit=entry.torque_limit_nm,
        order=engine.dominant_order,
        displacement=Spectrum(contents.frequency, displacement.values, displacement.names, "m"),
        force=Spectrum(contents.frequency, force.values, force.names, "N"),
        engine_torque=contents.engine_torque.get(entry.name),
    )


def _in_table_order(rows: Sequence[ChannelRow]) -> dict[str, list[ChannelRow]]:
    return {name: [row for row in rows if row.quantity == name] for name in QUANTITY_UNIT}


def _by_quantity(
    rows: Sequence[ChannelRow], mounts: Sequence[Mount]
) -> dict[str, list[ChannelRow]]:
    """Order the rows of each quantity as mount, axis, piece."""
    there = {(row.quantity, row.channel): row for row in rows}
    operating = [name for m in mounts for axis in AXES for name in m.channels(axis)]
    paths = [name for mount in mounts for name in mount.paths]
    return {
        quantity: [there[quantity, name] for name in names if (quantity, name) in there]
        for quantity, names in (
            ("displacement", operating),
            ("force", operating),
            (NOISE_TRANSFER, paths),
        )
    }


def _check_channels(
    path: Path,
    rows: Sequence[ChannelRow],
    mounts: Sequence[Mount],
    note: Note,
    named: frozenset[tuple[str, str]],
) -> None:
    """Every row belongs to a mount, and every path has all that its force and motion need."""
    paths = [name for mount in mounts for name in mount.paths]
    operating = [name for mount in mounts for axis in AXES for name in mount.channels(axis)]
    for row in rows:
        if row.channel not in (paths if row.quantity == NOISE_TRANSFER else operating):
            note(
                InputError(
                    f"{path}: {row.quantity} channel '{row.channel}' fits no mount, piece and "
                    f"transfer axis of {PLATFORM_FILE}: correct one of them"
                )
            )
    if not paths:
        note(InputError(f"{path}: no mount of {PLATFORM_FILE} has a transfer axis: name one"))
    there = {(row.quantity, row.channel) for row in rows} | named
    measured = [channel for quantity, channel in there if quantity != NOISE_TRANSFER]
    needed = [(NOISE_TRANSFER, name) for name in paths]
    for mount in mounts:
        names = [name for axis in AXES for name in mount.channels(axis)]
        through = [name for axis in mount.transfer_axes for name in mount.channels(axis)]
        if not any(name in measured for name in names):
            note(InputError(f"{path}: mount '{mount.name}' has no channel: add '{names[0]}', ..."))
        for name in names:
            if name in through or name in measured:
                needed += [("displacement", name), ("force", name)]
    for quantity, name in needed:
        if (quantity, name) not in there:
            note(
                InputError(
                    f"{path}: there is no {quantity} channel '{name}': add its row, or take the "
                    f"axis out of transfer_axes in {PLATFORM_FILE}"
                )
            )
