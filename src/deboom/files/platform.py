"""A platform folder, read and checked: mounts, vehicles and load cases in SI."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Annotated, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationInfo,
    field_validator,
    model_validator,
)

from deboom.arrays import AXES, RealArray
from deboom.errors import InputError, naming
from deboom.files.function_table import (
    ANY_REFERENCE,
    FRF,
    TABLE_ENDINGS,
    Dof,
    FunctionMatrix,
    FunctionTable,
    added_decay_line,
    first_difference,
    is_table,
    read_function_table,
    read_nodal,
    same_lines,
    with_their_tables,
)
from deboom.files.kinds import FolderKind
from deboom.files.library_export import read_library_json
from deboom.files.rows import NOISE_TRANSFER, QUANTITY_UNIT, ChannelRow, MountRow, read_torque_table
from deboom.files.run_folder import hash_files
from deboom.files.schema import (
    AtLeastOne,
    Axis,
    FolderRecord,
    Inertia,
    Matrix3,
    Name,
    Note,
    NotNegative,
    Number,
    Positive,
    RelativePath,
    Row3,
    Several,
    StrictModel,
    Temperature,
    Title,
    beyond_gears,
    doubled,
    inertia_faults,
    load_toml,
    noting,
    refuse_all,
    same_file,
    telling,
    within,
)
from deboom.files.shipped_studies import shipped_studies
from deboom.files.tables import read_columns, read_table
from deboom.files.uff import UffFunction
from deboom.files.units import refuse_beyond
from deboom.measurement.channels import Frf, LoadCase, Spectrum, refuse_window
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.mount import SIDES, Bracket, Mount, RubberInCar, Side
from deboom.mounts.surface_forces import as_mounted, change_per_kelvin
from deboom.names import is_inside, look_alikes
from deboom.physics.order_tracking import dominant_order
from deboom.vehicles.fleet import Fleet, Vehicle, paths_into
from deboom.vehicles.idle import IdleRun
from deboom.vehicles.platform import LIBRARY_FILE, PLATFORM_FILE, MissingLibrary, Platform
from deboom.vehicles.powertrain import Powertrain
from deboom.vehicles.receivers import EAR, SOUND, UNITS, Receiver

RECEPTANCE_UNIT = "m/N"
DRIVING_POINT = "driving point"
_ORDINATE = {NOISE_TRANSFER: "pressure", DRIVING_POINT: "displacement"}
"""Of functions per force; spectra are named by theirs."""
SOFTEST_BRACKET, STIFFEST_BRACKET = 50.0, 1e7
"""Bounds of the stiffness of any bracket [N/mm]."""
WEAKEST_PER_KELVIN, STRONGEST_PER_KELVIN = 0.05, 10.0
"""Bounds of what a kelvin changes of the stiffness of rubber [%]."""
LOWEST, HIGHEST = 15.0, 140.0
"""Where the model of a drive on its mounts holds [Hz]."""
SPECTRA = (0, 12, 27)
"""UFF function types that hold complex spectra: general, spectrum, order function."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Channels of one quantity from one file.

    - `path`: the file.
    - `item`: item that it holds, for messages.
    - `names`: channels, one per column.
    - `frequency` (f,): lines of the file [Hz].
    - `values` (f, n_channel): values along the positive axes, in SI.
    - `ear`: name of the microphone; ``""`` where the file states none.
    - `labels`: what its ID lines say, one below the other.
    """

    path: Path
    item: str
    names: tuple[str, ...]
    frequency: RealArray
    values: npt.NDArray[np.complex128]
    ear: str = ""
    labels: str = ""


def noise_transfer_columns(
    path: Path, item: str, ear_node: int | None, rows: Sequence[ChannelRow]
) -> Columns:
    """Read the noise transfer functions of a vehicle.

    - `path`: UFF file, or a table (`deboom.files.function_table`).
    - `item`: whose it is, for messages.
    - `ear_node`: response node; not asked for in a table.
    - `rows`: the paths, in the order wanted.
    - raises InputError: every path without its function, or with one of another type, unit or
      quantity; functions of different microphones (response names).
    """
    matrix = _opened(path, item, rows, (FRF,))
    node = 0 if is_table(path) else ear_node or 0
    ear = Dof("ear", node, "scalar", quantity=NOISE_TRANSFER)
    return _to_receiver(matrix, ear, rows, SOUND, "Pa/N")


def _to_receiver(
    matrix: FunctionMatrix, receiver: Dof, rows: Sequence[ChannelRow], ordinate: str, unit: str
) -> Columns:
    """Columns of the functions of one receiver; its name there is that of the microphone."""
    names = {f.response_name for f in matrix.functions if f.response_node == receiver.node}
    with telling() as tell:
        if ordinate == SOUND and len(names) > 1:
            different = ", ".join(map(repr, sorted(names)))
            sentence = f"noise transfer functions of different microphones ({different}) are mixed"
            remedy = "measure all paths with one, or correct the response names"
            tell(matrix.error(f"{sentence} at node {receiver.node}: {remedy}"))
        with noting(tell):
            refuse_window(matrix.added_decay_rate, f"{matrix.path}: {matrix.item}")
        # the channel table has the unit of noise transfer functions alone
        of_table = ordinate == SOUND
        dofs = [(receiver, row.dof if of_table else replace(row.dof, unit=None)) for row in rows]
        columns = _columns(matrix, rows, dofs, ordinate, tell, unit=unit)
    return replace(columns, ear="".join(sorted(names)[:1]))


def receiver_columns(
    path: Path, vehicle: str, entry: ReceiverEntry, rows: Sequence[ChannelRow]
) -> tuple[Receiver, Columns]:
    """Read the functions of a receiver per force at every path.

    - `path`: UFF file, or a table.
    - `vehicle`: its name, for messages.
    - `entry`: what ``platform.toml`` states.
    - `rows`: the paths, in the order wanted.
    - returns: the receiver with the quantity of its functions, and these.
    - raises InputError: a node and direction, or a channel, without functions, with those of the
      other kind or of two quantities; a path without its function, or with one of another type or
      unit; a weighting that is not for their quantity.
    """
    item = f"vehicle {vehicle}: receiver '{entry.name}'"
    channel = entry.channel or ""
    if is_table(path) != (entry.node is None):
        remedy = "names: state its channel" if is_table(path) else "node: state its node"
        raise InputError(f"{path}: {item}: the file has functions by {remedy}")
    if entry.kind == "vibration" and entry.direction is None and not is_table(path):
        raise InputError(f"{path}: {item}: state the direction of its accelerometer, such as '+z'")
    matrix = _opened(path, item, rows, (FRF,), channel=channel)
    node = entry.node or 0
    quantities = {
        function.ordinate: function.unit
        for function in matrix.functions
        if function.response_node == node
        and (entry.direction or "scalar")[1:] == function.response_direction[1:]
    }
    wanted = [each for each in quantities if (each == SOUND) == (entry.kind == "sound")]
    if not wanted and quantities:
        raise matrix.error(
            f'kind = "{entry.kind}", and its functions are in {", ".join(quantities.values())}: '
            "correct its kind, or its node and direction"
        )
    if len(wanted) > 1:
        raise matrix.error(f"it has functions of {' and '.join(wanted)}: keep one of them")
    quantity = wanted[0] if wanted else SOUND if entry.kind == "sound" else "acceleration"
    with naming(path):
        receiver = Receiver(
            name=entry.name,
            quantity=quantity,
            weighting=entry.weighting or "",
            weight=entry.usual_weight,
            target=entry.target_db,
        )
    direction = entry.direction or "scalar"
    dof = Dof(
        entry.name,
        node,
        direction,
        quantity=receiver.transfer_quantity,
        # along the axis either way, of which the sign is turned
        accepted=tuple(f"{sign}{direction[1:]}" for sign in "+-") if entry.direction else (),
    )
    columns = _to_receiver(matrix, dof, rows, quantity, receiver.transfer_unit)
    return receiver, replace(columns, ear=entry.name)


def receptance_frf(path: Path, item: str, rows: Sequence[ChannelRow]) -> Frf:
    """Read the receptance of a vehicle's body between its paths.

    - `path`: UFF file of displacement per force, UFF function type 4.
    - `item`: whose it is, for messages.
    - `rows`: the paths: response and reference are at the nodes and along the directions of their
      noise transfer functions.
    - raises InputError: a table; a function that is missing, doubled, or of another type or unit.
    """
    if is_table(path):
        raise InputError(
            f"{path}: {item}: a receptance has a response and a force for each function, which a "
            "table does not tell: export it as UFF"
        )
    dofs = [
        Dof(row.channel, row.node, row.direction, sign=row.dof.sign, quantity="receptance")
        for row in rows
    ]
    nodes = {row.node for row in rows}
    functions = [function for function in read_nodal(path) if function.reference_node in nodes]
    matrix = FunctionMatrix(path, item, (FRF,), functions)
    return matrix.frf(dofs, dofs, "displacement", RECEPTANCE_UNIT)


def driving_points_frf(path: Path, item: str, rows: Sequence[ChannelRow]) -> Frf:
    """Read the receptance of a vehicle's body at each of its paths, along the force there.

    - `path`: UFF file of displacement per force, UFF function type 4, or a table with a column per
      path.
    - `item`, `rows`: as for `receptance_frf`.
    - returns: from all paths to all paths, 0 between different ones (`Vehicle.receptance`).
    - raises InputError: a function that is missing, doubled, or of another type or unit; one
      between two paths, which a receptance takes.
    """
    matrix = _opened(path, item, rows, (FRF,), DRIVING_POINT)
    dofs = [Dof(row.channel, row.node, row.direction, quantity=DRIVING_POINT) for row in rows]
    name_of = {(dof.node, dof.direction): dof.name for dof in dofs}
    for each in matrix.functions:
        motion = name_of.get((each.response_node, each.response_direction))
        force = name_of.get((each.reference_node, each.reference_direction))
        if motion and force and motion != force:
            raise matrix.error(
                f"the file has {motion} per {force}, which is no driving point: give the functions "
                "between all paths with the key 'receptance', or the driving points alone"
            )
    values = np.zeros((matrix.axis.size, len(dofs), len(dofs)), dtype=np.complex128)
    with telling() as tell:
        for at, dof in enumerate(dofs):
            with noting(tell):
                values[:, at, at] = matrix.function(
                    dof, replace(dof, name=""), ordinate="displacement", unit=RECEPTANCE_UNIT
                )
    names = tuple(dof.name for dof in dofs)
    return Frf(matrix.axis, values, names, names, RECEPTANCE_UNIT, matrix.added_decay_rate)


def operating_columns(
    path: Path, item: str, order: float | None, rows: Sequence[ChannelRow]
) -> tuple[Columns, ...]:
    """Read the operating spectra of a load case: displacement, then force.

    - `path`, `item`: as for `noise_transfer_columns`.
    - `order`: engine order that the file may state; None of idle, which has several.
    - `rows`: channels, in the order wanted.
    - raises InputError: every channel without its spectrum, or with one of another type, unit or
      quantity; spectra of another order.
    """
    matrix = _opened(path, item, rows, SPECTRA)
    if order is not None:
        matrix.check_order(order, "correct it, or the dominant_order of the engine")
    columns = []
    with telling() as tell:
        for quantity in ("displacement", "force"):
            part = [row for row in rows if row.quantity == quantity]
            dofs = [(row.dof, ANY_REFERENCE) for row in part]
            columns.append(_columns(matrix, part, dofs, quantity, tell))
    return tuple(columns)


def _opened(
    path: Path,
    item: str,
    rows: Sequence[ChannelRow],
    types: tuple[int, ...],
    quantity: str = "",
    channel: str = "",
) -> FunctionMatrix:
    """Functions of a file at the nodes of the rows, by default of the quantity of each row.

    - `channel`: of a receiver, with which the names of its functions in a table begin.
    """
    if not is_table(path):
        nodes = {row.node for row in rows}
        functions = [
            function
            for function in read_nodal(path)
            if (function.reference_node if FRF in types else function.response_node) in nodes
        ]
        return FunctionMatrix(path, item, types, functions)
    table = read_function_table(path)
    functions = []
    with telling() as tell:
        for row in rows:
            of_row = quantity or row.quantity
            with noting(tell), naming(f"{path}: {item}: {of_row} '{row.channel}'"):
                functions.append(_of_table(table, row, of_row, channel))
    return FunctionMatrix(path, item, types, functions)


def _of_table(
    table: FunctionTable, row: ChannelRow, quantity: str, channel: str = ""
) -> UffFunction:
    """Make a function of the table's columns, at the degree of freedom of the channel table.

    - `channel`: see `_opened`; its functions may be of any quantity, which their unit tells.
    """
    to_ear, per_force = quantity == NOISE_TRANSFER, quantity in (NOISE_TRANSFER, DRIVING_POINT)
    name = f"{channel} {row.channel}".strip() if per_force else f"{row.channel} {quantity}"
    unit, values = table.spectrum(name)
    ordinate, _, denominator = unit.si.rpartition("/") if "/" in unit.si else (unit.si, "", "")
    of_unit = {unit: name for name, unit in UNITS.items()}
    return UffFunction(
        abscissa=table.frequency,
        values=values,
        function_type=FRF if per_force else SPECTRA[0],
        response_node=0 if to_ear else row.node,
        response_direction="scalar" if to_ear else row.direction,
        reference_node=row.node if per_force else 0,
        reference_direction=row.direction if per_force else "scalar",
        ordinate=of_unit.get(ordinate, "") if channel else _ORDINATE.get(quantity, quantity),
        ordinate_unit=ordinate,
        denominator="force" if denominator else "none",
        denominator_unit=denominator,
        response_name="ear" if to_ear else "",
        file_unit=unit.label,
        id_lines=added_decay_line(table.added_decay_rate),
    )


def _columns(
    matrix: FunctionMatrix,
    rows: Sequence[ChannelRow],
    dofs: Sequence[tuple[Dof, Dof]],
    ordinate: str,
    tell: Note,
    unit: str = "",
) -> Columns:
    """Columns of the rows; of one that is told to be at fault, zeros.

    - `unit`: of the functions, where it is not that of the quantity of each row.
    """
    values = np.zeros((matrix.axis.size, len(rows)), dtype=np.complex128)
    for column, (row, (response, reference)) in enumerate(zip(rows, dofs, strict=True)):
        with noting(tell):
            of_row = unit or QUANTITY_UNIT[row.quantity]
            values[:, column] = matrix.function(response, reference, ordinate=ordinate, unit=of_row)
            if row.quantity == NOISE_TRANSFER and not np.any(values[:, column]):
                raise matrix.error(
                    f"{row.quantity} '{row.channel}' is 0 at all lines: measure it again, or take "
                    "the axis out of transfer_axes"
                )
    labels = "\n".join(
        dict.fromkeys(line for each in matrix.functions for line in each.id_lines if line)
    )
    names = tuple(row.channel for row in rows)
    return Columns(matrix.path, matrix.item, names, matrix.axis, values, labels=labels)


def common_axis(files: Sequence[Columns], tell: Note) -> RealArray:
    """Return the frequency lines that all files share [Hz]; the first one sets them."""
    first = files[0]
    for columns in {each.path: each for each in files}.values():
        if not same_lines(first.frequency, columns.frequency):
            both = f"{first.path} ({first.item}) and {columns.path} ({columns.item})"
            where = first_difference(first.frequency, columns.frequency)
            sentence = f"the frequency axes of {both} differ: {where}; measure or export both "
            tell(InputError(f"{sentence}on the same lines"))
    return first.frequency


SMALLEST_RATIO, LARGEST_RATIO = 1.0, 100.0
"""Total ratios: wheels turn no faster than the engine of a car [1]."""


def _engine_torque(value: float) -> float:
    if not 5.0 <= abs(value) <= 5000.0:
        raise ValueError(
            "an engine gives 5 to 5000 N m, and a coasting one takes as much, with a minus: is it "
            "in kN m, or at the wheels?"
        )
    return value


EngineTorque = Annotated[float, AfterValidator(_engine_torque)]
"""Torque of the engine [N m]: positive where it drives the vehicle forward, negative where it is
dragged, as in a coasting run."""


class Engine(StrictModel):
    """The engine or electric drive and its gearbox."""

    cylinders: Number | None = None  # left out by an electric drive
    dominant_order: Positive  # of the operating spectra [cycles per revolution]
    total_ratios: AtLeastOne[Positive]  # engine speed over wheel speed, gear 1 first [1]

    @field_validator("total_ratios")
    @classmethod
    def _of_a_gearbox(cls, ratios: tuple[float, ...]) -> tuple[float, ...]:
        if min(ratios) < SMALLEST_RATIO or max(ratios) > LARGEST_RATIO:
            raise ValueError(
                "a total ratio is engine speed over wheel speed, final drive included, "
                f"{SMALLEST_RATIO:g} to {LARGEST_RATIO:g}: are they inverted, or without final "
                "drive?"
            )
        if sorted(ratios, reverse=True) != list(ratios):
            raise ValueError("the ratio falls from gear to gear: gear 1 comes first")
        return ratios

    def order_faults(self) -> Iterator[str]:
        """Give a sentence for a dominant order at which no cylinder fires."""
        order = self.dominant_order
        firing = dominant_order(self.cylinders) if self.cylinders else order
        if order < firing or order % firing:
            yield (
                f"[engine] has {self.cylinders} cylinders, which fire at order {firing:g}, and "
                f"dominant_order {order:g}: correct one of both"
            )


class PowertrainEntry(StrictModel):
    """Nominal rigid-body data from the data sheet, with half widths as tolerances."""

    mass_kg: Annotated[
        Positive, within(20.0, 1500.0, "a powertrain weighs 20 to 1500 kg: is it in g or t?")
    ]
    mass_tolerance_kg: NotNegative
    inertia_kg_m2: Inertia  # matrix entries about the centre of gravity, vehicle axes
    # relative to the diagonal [1]
    inertia_tolerance: Annotated[
        NotNegative,
        within(0.0, 0.5, "it is relative and below 0.5: is it in percent, or in kg m²?"),
    ]
    centre_of_gravity_tolerance_m: Annotated[  # per axis
        NotNegative, within(0.0, 0.1, "a data sheet knows better, in m: is it in mm?")
    ]

    @field_validator("mass_tolerance_kg")
    @classmethod
    def _below_the_mass(cls, tolerance: float, others: ValidationInfo) -> float:
        if tolerance >= others.data.get("mass_kg", math.inf):
            raise ValueError("a tolerance is below its mass: correct one of both")
        return tolerance

    @field_validator("inertia_kg_m2")
    @classmethod
    def _of_a_body(cls, inertia: Matrix3, others: ValidationInfo) -> Matrix3:
        if "mass_kg" in others.data:
            for sentence in inertia_faults(others.data["mass_kg"], inertia):
                raise ValueError(sentence)
        return inertia


def _of_brackets(stated: object) -> object:
    """Give one sentence for whatever is wrong; pydantic would give one for each kind of value."""
    key = "bracket_stiffness_n_per_mm"
    if not isinstance(stated, dict) or not stated or set(stated) - set(SIDES):
        raise ValueError(f"{key} is of the brackets engine and body: write {{engine = [x, y, z]}}")
    checked: dict[str, object] = {}
    for side, value in stated.items():
        checked[side] = value
        if isinstance(value, str):
            if not is_inside(value):
                raise ValueError(f"{key}: name the table of {side} relative to the platform folder")
            continue
        numbers = value if isinstance(value, list | tuple) else ()
        if [type(each) in (int, float) for each in numbers] != [True] * 3:
            raise ValueError(
                f"{key}: {side} has three numbers, along x, y and z of the mount, or the name of a "
                "table"
            )
        if not all(SOFTEST_BRACKET <= each <= STIFFEST_BRACKET for each in numbers):
            raise ValueError(
                f"{key}: a bracket has {SOFTEST_BRACKET:g} to {STIFFEST_BRACKET:g} N/mm along each "
                f"axis, not {list(numbers)}: is it in N/m or kN/mm?"
            )
        checked[side] = tuple(map(float, numbers))
    return checked


Brackets = Annotated[dict[Side, Row3 | RelativePath], BeforeValidator(_of_brackets)]
"""Stiffness by side, along x, y and z of the mount [N/mm], or a table of these over frequency."""


class MountEntry(StrictModel):
    """One mount."""

    name: Name  # short, such as TSM
    description: str  # in words, for the report
    description_de: str | None = None  # the same in German, for sheets in German
    pieces: Annotated[Several[Name], Field(min_length=2)] | None = None  # of one part number
    transfer_axes: Several[Axis]  # whose force reaches the cabin
    # mass of the body on each piece where that is not the powertrain, from the data sheet
    body_mass_kg: (
        Annotated[Positive, within(1.0, 1000.0, "a body mass is 1 to 1000 kg: is it in g or t?")]
        | None
    ) = None
    body_mass_tolerance_kg: NotNegative | None = Field(default=None, validate_default=True)

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


def _along_an_axis(direction: str) -> str:
    if direction not in [f"{sign}{axis}" for axis in AXES for sign in "+-"]:
        raise ValueError("a direction is one such as '+z'")
    return direction


class PlatformMount(MountEntry):
    """One mount of a platform, with the brackets that it has in the cars."""

    # between powertrain and rubber (engine), and between rubber and body with the sheet metal that
    # gives way about it (body), as far as they were not between the sensors of the mount's test
    bracket_stiffness_n_per_mm: Brackets | None = None

    @property
    def brackets(self) -> Mapping[Side, Row3 | str]:
        """Stiffness or file of each bracket that is stated."""
        return self.bracket_stiffness_n_per_mm or {}


def _receiver_name(name: str) -> str:
    if not name.strip() or name != name.strip() or "," in name:
        raise ValueError("a receiver is named in a few words without commas, such as 'seat rail z'")
    return name


class ReceiverEntry(StrictModel):
    """One place where somebody sits: an ear, or a point of a seat or of the wheel."""

    name: Annotated[str, AfterValidator(_receiver_name)]  # such as "seat rail z"
    kind: Literal["sound", "vibration"]
    node: Number | None = None  # response node in a UFF file
    # of the accelerometer at that node, such as "+z"
    direction: Annotated[str, AfterValidator(_along_an_axis)] | None = None
    channel: str | None = None  # in a table, with which its columns begin: "seat z EnM x [m/s²/N]"
    functions: RelativePath | None = None  # its file, where it is not that of noise_transfer
    weight: NotNegative | None = None  # of a sound in sums over receivers [1]; without, 1
    target_db: float | None = None  # mean level of the lines that is good enough
    # of an acceleration: "Wk", "Wd" (seat, ISO 2631-1) or "Wh" (hands, ISO 5349-1)
    weighting: Literal["Wk", "Wd", "Wh"] | None = None

    @model_validator(mode="after")
    def _of_its_kind(self) -> Self:
        if self.kind == "sound" and (self.weighting or self.direction):
            raise ValueError(
                "a sound is A-weighted and has no direction: leave out weighting and direction, or "
                'write kind = "vibration"'
            )
        if self.kind == "vibration" and self.weight is not None:
            raise ValueError(
                "a vibration is in no sum of levels of sound: leave its weight out, and limit it "
                "(--limits) or take it as a further objective (--also)"
            )
        if (self.node is None) == (self.channel is None):
            raise ValueError("state where it is: the node of a UFF file, or the channel of a table")
        if self.channel is not None and self.direction is not None:
            raise ValueError("a direction goes with a node: the channel of a table has its own")
        return self

    @property
    def usual_weight(self) -> float:
        """Weight in sums [1]."""
        return 1.0 if self.weight is None else self.weight


class VehicleEntry(StrictModel):
    """One vehicle and the file of its noise transfer functions."""

    name: Name  # such as U06-1
    group: Name  # vehicles of one body, such as U06
    noise_transfer: RelativePath  # UFF file, Nastran punch, or a table: CSV, xlsx, MATLAB's mat
    # several ears, seats, wheel, in place of ear_node; the first is the ear named by the vehicle
    receivers: AtLeastOne[ReceiverEntry] | None = None
    # response node of the driver's ear in a UFF file; a table has none
    ear_node: Number | None = Field(default=None, validate_default=True)
    # displacement per force of the trimmed body between all paths, UFF; without, it is at rest
    receptance: RelativePath | None = None
    # the same at each path along its force alone, UFF or a table
    driving_points: RelativePath | None = None

    @field_validator("ear_node")
    @classmethod
    def _node_of_a_uff_file(cls, node: int | None, others: ValidationInfo) -> int | None:
        name, receivers = others.data.get("noise_transfer", ""), others.data.get("receivers")
        if "receivers" not in others.data:
            return node  # they are refused already
        by_node = PurePosixPath(name).suffix.lower() not in ("", *TABLE_ENDINGS)
        if node is None and by_node and not receivers:
            raise ValueError("functions by node need the response node of the driver's ear: add it")
        if node is not None and receivers:
            raise ValueError("ear_node and receivers say the same: keep the receivers")
        return node

    @field_validator("receivers")
    @classmethod
    def _an_ear_first(
        cls, receivers: tuple[ReceiverEntry, ...] | None
    ) -> tuple[ReceiverEntry, ...] | None:
        if receivers and receivers[0].kind != "sound":
            raise ValueError(
                "the first receiver is the ear that has the vehicle's name: put a sound first"
            )
        return receivers

    @field_validator("driving_points")
    @classmethod
    def _without_receptance(cls, path: str | None, others: ValidationInfo) -> str | None:
        if path is not None and others.data.get("receptance") is not None:
            raise ValueError("the receptance has the driving points in it: keep one of both keys")
        return path

    @property
    def body(self) -> str | None:
        """File of what is known of the body; None: it is at rest."""
        return self.receptance or self.driving_points


class LoadCaseEntry(StrictModel):
    """One run and the file of its operating spectra."""

    name: Name  # short key, such as g5_wot220
    title: str  # in words, for the report
    # "idle": a fixed speed, and a line per engine order in place of one order over speed
    kind: Literal["idle"] | None = None
    speed_rpm: Positive | None = Field(default=None, validate_default=True)  # of idle
    gear: Number
    torque_limit_nm: EngineTorque  # of the engine
    order: Positive | None = None  # of this run's spectra, where it is not the dominant one
    operating: RelativePath  # UFF file, or a table: CSV, xlsx or MATLAB's mat
    torque_table: RelativePath | None = None  # engine torque at every line, where it was recorded

    @property
    def is_idle(self) -> bool:
        """Whether it is a run at idle, not over speed."""
        return self.kind is not None

    @field_validator("speed_rpm")
    @classmethod
    def _of_idle(cls, speed: float | None, others: ValidationInfo) -> float | None:
        if "kind" not in others.data:
            return speed  # it is refused already
        if others.data["kind"] is not None and speed is None:
            raise ValueError("idle has one speed: state it")
        if others.data["kind"] is None and speed is not None:
            raise ValueError('a run-up has no fixed speed: leave it out, or write kind = "idle"')
        return speed

    @model_validator(mode="after")
    def _several_orders_of_idle(self) -> Self:
        if self.is_idle and (self.order is not None or self.torque_table is not None):
            raise ValueError(
                "idle has several orders and one torque, torque_limit_nm: leave order and "
                "torque_table out"
            )
        return self


def _per_kelvin(bounds: tuple[float, float]) -> tuple[float, float]:
    low, high = bounds
    if low > high or max(map(abs, bounds)) > STRONGEST_PER_KELVIN:
        raise ValueError(
            f"state the least and the largest change, within ±{STRONGEST_PER_KELVIN:g} % per "
            "kelvin, with a minus where warm rubber is softer"
        )
    if max(map(abs, bounds)) < WEAKEST_PER_KELVIN:
        raise ValueError("rubber changes by more: is it a share instead of per cent?")
    return bounds


def _from_cold_to_warm(bounds: tuple[float, float]) -> tuple[float, float]:
    if bounds[0] > bounds[1]:
        raise ValueError("state the lowest temperature in use, then the highest")
    return bounds


Range = Annotated[tuple[float, float], Field(strict=False)]


class RubberEntry(StrictModel):
    """Rubber of one class: at which temperature it was tested and is used, and what that does."""

    mounts: AtLeastOne[Name]  # of this rubber
    test_temperature_c: Temperature
    use_temperature_c: Annotated[
        tuple[Temperature, Temperature], Field(strict=False), AfterValidator(_from_cold_to_warm)
    ]
    # change of the dynamic stiffness [%/K], least and largest; no default, compounds differ
    stiffness_percent_per_k: Annotated[Range, AfterValidator(_per_kelvin)] | None = None
    source: Title | None = None  # of these two numbers
    # or mount library of a campaign with these mounts at another temperature
    other_library: RelativePath | None = Field(default=None, validate_default=True)

    @field_validator("other_library")
    @classmethod
    def _stated_or_measured(cls, path: str | None, others: ValidationInfo) -> str | None:
        keys = ("stiffness_percent_per_k", "source")
        if not set(keys) <= set(others.data):
            return path  # what is wrong with these is told already
        stated = [others.data[key] for key in keys]
        if (path is None) != all(stated) or (path is not None and any(stated)):
            raise ValueError(
                "state stiffness_percent_per_k with its source, or name the library of another "
                "temperature"
            )
        return path

    def in_car(self, per_kelvin: tuple[float, float]) -> RubberInCar:
        """Return what a change per kelvin makes of the stiffness [1/K]."""
        cold, warm = self.use_temperature_c
        return RubberInCar(
            per_kelvin, (cold - self.test_temperature_c, warm - self.test_temperature_c)
        )


class PlatformFile(StrictModel):
    """The whole file ``platform.toml``."""

    format: Literal[1]
    name: Name  # short key of the platform
    title: str  # what a reader calls it
    description: str  # a paragraph for the report
    mount_table: RelativePath  # positions of the mounts, CSV or xlsx
    channel_table: RelativePath  # which UFF node and direction is which channel, CSV or xlsx
    default_load_case: Name  # meant when none is asked for
    engine: Engine
    powertrain: PowertrainEntry | None = None  # without, the motion is taken as measured
    mounts: AtLeastOne[PlatformMount]  # in the order of the design variables
    rubber: Several[RubberEntry] = ()  # of mounts whose temperatures are stated
    # car_factors.csv of a run of synthesis_validation: what cars say of the other mounts
    car_factors: RelativePath | None = None
    vehicles: AtLeastOne[VehicleEntry]  # in the order of the report
    load_cases: AtLeastOne[LoadCaseEntry]  # in the order of the report

    @property
    def run_ups(self) -> tuple[LoadCaseEntry, ...]:
        """Load cases over speed: all but idle."""
        return tuple(case for case in self.load_cases if not case.is_idle)

    def faults(self) -> Iterator[str]:
        """Give a sentence for names that come twice, gears and load cases that are not there."""
        for section in ("mounts", "vehicles", "load_cases"):
            names = [entry.name for entry in getattr(self, section)]
            yield from doubled(f"[[{section}]] are named", names)
            yield from look_alikes(section.removesuffix("s").replace("_", " "), names)
        yield from same_file("vehicles", "noise_transfer", self.vehicles)
        for vehicle in self.vehicles:
            receivers = [receiver.name for receiver in vehicle.receivers or ()]
            yield from doubled(f"receivers of vehicle {vehicle.name} are named", receivers)
            yield from look_alikes(f"receiver of vehicle {vehicle.name}", receivers)
        yield from same_file("load cases", "operating", self.load_cases)
        yield from look_alikes("group", [entry.group for entry in self.vehicles])
        yield from self.engine.order_faults()
        case_names = [case.name for case in self.load_cases]
        run_ups = [case.name for case in self.run_ups]
        if self.default_load_case not in run_ups:
            yield (
                f"default_load_case '{self.default_load_case}' is not among the load cases "
                f"{', '.join(run_ups)}: name one of them"
                if run_ups
                else f"all load cases ({', '.join(case_names)}) are at idle: add a run-up"
            )
        gears = [(case.name, case.gear) for case in self.load_cases]
        yield from beyond_gears("load case", gears, self.engine.total_ratios)
        for mount in self.mounts:
            yield from doubled(f"pieces of mount {mount.name} are named", mount.piece_names)
            yield from look_alikes(f"piece of mount {mount.name}", mount.piece_names)
            axes = f"transfer_axes of mount {mount.name} are named"
            yield from doubled(axes, mount.transfer_axes)
        rubber = [name for entry in self.rubber for name in entry.mounts]
        yield from doubled("mounts of [[rubber]] are named", rubber)
        names = [mount.name for mount in self.mounts]
        for name in rubber:
            if name not in names:
                yield (
                    f"[[rubber]] names mount '{name}', which is not among {', '.join(names)}: "
                    "correct its name"
                )
        struck = [vehicle.name for vehicle in self.vehicles if vehicle.body is not None]
        for mount in self.mounts:
            if struck and "body" in mount.brackets:
                yield (
                    f"mount {mount.name} has a bracket of the body, and the receptance or driving "
                    f"points of vehicle {struck[0]} hold it already: leave one of both out"
                )


def mounts_of(
    path: Path,
    entries: Sequence[MountEntry],
    table: Path,
    rows: Sequence[MountRow],
) -> tuple[Mount, ...]:
    """Put mounts and positions together.

    - `path`: file of the entries, for messages.
    - `entries`: in the order of the result.
    - `table`: file of the rows, for messages.
    - `rows`: one per mount and piece, in any order.
    - raises InputError: a row without its mount, a mount or piece without its row.
    """
    listed = {(entry.name, piece) for entry in entries for piece in entry.piece_names}
    positions = {(row.mount, row.piece): row.position for row in rows}
    angles = {(row.mount, row.piece): row.angles for row in rows}
    refuse_all(
        [
            *(
                f"{table}: mount '{mount}', piece '{piece}' is not in {path}: correct its name or "
                "add it there"
                for mount, piece in sorted(positions.keys() - listed)
            ),
            *(
                f"{table}: no row for mount '{mount}', piece '{piece}': add its position"
                for mount, piece in sorted(listed - positions.keys())
            ),
        ]
    )
    return tuple(
        Mount(
            name=entry.name,
            description=entry.description,
            description_de=entry.description_de or "",
            pieces=entry.piece_names,
            positions=tuple(positions[entry.name, piece] for piece in entry.piece_names),
            transfer_axes=entry.transfer_axes,
            body_mass=entry.body_mass_kg,
            body_mass_tolerance=entry.body_mass_tolerance_kg or 0.0,
            rotations=tuple(angles[entry.name, piece] for piece in entry.piece_names),
        )
        for entry in entries
    )


DEMONSTRATION = shipped_studies() / "data" / "u06_f39_f45"
"""The shipped virtual platform."""
CATALOGUE_FILE = "catalogue.library.json"
"""Further parts in a platform folder, an exported mount library."""


def platform_folder(name: str | Path) -> Path:
    """Return the folder of a platform: of ``u06`` that of the demonstration."""
    return DEMONSTRATION if str(name).lower() == "u06" else Path(name)


def read_platform(folder: str | Path) -> Platform:
    """Read a platform, the shipped demonstration or a folder of your own, and check that it fits.

    Parameters
    ----------
    folder : str or Path
        ``"u06"`` for the demonstration, a virtual platform of 15 vehicles in three groups on one
        powertrain with four mounts; otherwise a folder with ``platform.toml``.

    Returns
    -------
    Platform
        Mounts, vehicles and load cases in SI. A mount library that is missing or damaged is
        refused when it is needed.

    Raises
    ------
    InputError
        A file that is missing, damaged or truncated; a key, column, channel, unit or DoF that is
        missing, unknown or doubled; a vehicle without one of the paths; frequency axes that
        differ. The sentence names the file, the item and the remedy.

    See Also
    --------
    deboom.check_platform, deboom.Platform, deboom.BoomingModel

    Examples
    --------
    >>> import deboom
    >>> deboom.read_platform("u06").fleet.names[:2]
    ('U06-1', 'U06-2')
    """
    folder = platform_folder(folder)
    file = load_toml(folder / PLATFORM_FILE, PlatformFile)
    tables = read_tables(folder, file)
    return assembled(folder, file, tables, read_functions(folder, file, tables))


def platform_sha256(platform: Platform) -> str:
    """Return a hash over names and contents of every file that was read, in hexadecimal."""
    hashes = hash_files(platform.input_files, relative_to=platform.folder)
    joined = "\n".join(f"{name} {value}" for name, value in sorted(hashes.items()))
    return hashlib.sha256(joined.encode()).hexdigest()


@dataclass(frozen=True, eq=False)
class Tables:
    """What the tables of a platform hold.

    - `mounts`: in the order of ``platform.toml``.
    - `channels`: by quantity, each in the order mount, axis, piece.
    """

    mounts: tuple[Mount, ...]
    channels: Mapping[str, Sequence[ChannelRow]]


@dataclass(frozen=True, eq=False)
class Functions:
    """What the files of functions of a platform hold.

    - `frequency` (f,): lines that all functions share [Hz].
    - `noise_transfer`: by vehicle, to its ear.
    - `ear`: of each vehicle; `receivers`: further ones, with their functions.
    - `receptance`: by vehicle that has one, or driving points [m/N].
    - `brackets`: by mount that has any.
    - `operating`: displacement and force, by load case.
    - `engine_torque`: by load case, where it was recorded [N m].
    """

    frequency: RealArray
    noise_transfer: Mapping[str, Columns]
    ear: Mapping[str, Receiver]
    receivers: Mapping[str, Mapping[Receiver, Columns]]
    receptance: Mapping[str, Frf]
    brackets: Mapping[str, tuple[Bracket, ...]]
    operating: Mapping[str, tuple[Columns, ...]]
    engine_torque: Mapping[str, RealArray]


def read_tables(folder: Path, file: PlatformFile) -> Tables:
    """Read the tables that ``platform.toml`` names.

    - `folder`: of the platform.
    - `file`: its keys.
    - raises InputError: every row and column at fault; where there is none of these, every mount
      that one of file and table lacks; at last, every channel that is missing or fits no mount.
    """
    path, mount_table, channel_table = (
        folder / name for name in (PLATFORM_FILE, file.mount_table, file.channel_table)
    )
    with telling() as tell:
        with noting(tell):
            places = read_table(mount_table, MountRow)
        with noting(tell):
            rows = read_table(channel_table, ChannelRow)
    mounts = mounts_of(path, file.mounts, mount_table, places)
    refuse_all(_channel_faults(channel_table, rows, mounts))
    return Tables(mounts, _by_quantity(rows, mounts))


def read_functions(folder: Path, file: PlatformFile, tables: Tables) -> Functions:
    """Read the functions that ``platform.toml`` names.

    - `folder`: of the platform.
    - `file`: its keys.
    - `tables`: which functions are needed.
    - raises InputError: every file that is missing or damaged, and every function that is missing,
      doubled, or of another type, unit or quantity; where there is none of these, every file on
      other lines.
    """
    noise_transfer: dict[str, Columns] = {}
    ear: dict[str, Receiver] = {}
    receivers: dict[str, dict[Receiver, Columns]] = {}
    receptance: dict[str, Frf] = {}
    operating: dict[str, tuple[Columns, ...]] = {}
    engine_torque: dict[str, RealArray] = {}
    paths = tables.channels[NOISE_TRANSFER]
    channels = [*tables.channels["displacement"], *tables.channels["force"]]
    with telling() as tell:
        for vehicle in file.vehicles:
            item = f"vehicle {vehicle.name}"
            receivers[vehicle.name] = {}
            for number, entry in enumerate(vehicle.receivers or ()):
                file_of = folder / (entry.functions or vehicle.noise_transfer)
                with noting(tell):
                    receiver, columns = receiver_columns(file_of, vehicle.name, entry, paths)
                    if number == 0:
                        ear[vehicle.name] = replace(receiver, name="")
                        noise_transfer[vehicle.name] = columns
                    else:
                        receivers[vehicle.name][receiver] = columns
            with noting(tell):
                if not vehicle.receivers:
                    noise_transfer[vehicle.name] = noise_transfer_columns(
                        folder / vehicle.noise_transfer, item, vehicle.ear_node, paths
                    )
            if vehicle.body is not None:
                read = receptance_frf if vehicle.receptance else driving_points_frf
                with noting(tell):
                    receptance[vehicle.name] = read(folder / vehicle.body, item, paths)
        for case in file.load_cases:
            order = None if case.is_idle else case.order or file.engine.dominant_order
            with noting(tell):
                operating[case.name] = operating_columns(
                    folder / case.operating, f"load case {case.name}", order, channels
                )
    with telling() as tell:
        every = [
            *noise_transfer.values(),
            *(columns for of_vehicle in receivers.values() for columns in of_vehicle.values()),
            *(part for case in file.run_ups for part in operating[case.name]),
        ]
        frequency = common_axis(every, tell)
        electric = file.engine.cylinders is None
        if electric and (frequency[0] < LOWEST or frequency[-1] > HIGHEST):
            lines = f"lines of {frequency[0]:g} to {frequency[-1]:g} Hz of a rotor order"
            model = f"a drive on its mounts is modelled from {LOWEST:g} to {HIGHEST:g} Hz"
            remedy = "export these lines, or state a lower order"
            tell(InputError(f"{folder / PLATFORM_FILE}: {lines}, but {model}: {remedy}"))
        for case in file.load_cases:
            if case.torque_table is not None:
                with noting(tell):
                    engine_torque[case.name] = read_torque_table(
                        folder / case.torque_table, frequency
                    )
        for vehicle in file.vehicles:
            frf = receptance.get(vehicle.name)
            if frf is not None and not same_lines(frequency, frf.frequency):
                where = first_difference(frequency, frf.frequency)
                owner = f"{folder / str(vehicle.body)}: vehicle {vehicle.name}"
                sentence = f"{owner}: its lines are not those of the noise transfer functions"
                tell(InputError(f"{sentence}: {where}; export all on the same lines"))
        brackets = {}
        for mount in file.mounts:
            with noting(tell):
                brackets[mount.name] = tuple(
                    _bracket(folder, mount.name, side, stated, frequency)
                    for side, stated in mount.brackets.items()
                )
    return Functions(
        frequency=frequency,
        noise_transfer=noise_transfer,
        ear=ear,
        receivers=receivers,
        receptance=receptance,
        brackets=brackets,
        operating=operating,
        engine_torque=engine_torque,
    )


def _bracket(
    folder: Path,
    mount: str,
    side: Side,
    stated: Row3 | str,
    frequency: RealArray,
) -> Bracket:
    """Take a bracket from its numbers [N/mm], or read it from its file."""
    if not isinstance(stated, str):
        return Bracket(side, np.empty(0), np.array([stated], dtype=np.complex128) * 1e3)
    path = folder / stated
    item = f"{path}: {side} bracket of mount {mount}"
    if not is_table(path):
        raise InputError(f"{item}: write it as a table: CSV, xlsx or MATLAB's mat")
    table = read_function_table(path)
    if not same_lines(frequency, table.frequency):
        where = first_difference(frequency, table.frequency)
        raise InputError(
            f"{item}: its lines are not those of the noise transfer functions: {where}; export "
            "all on the same lines"
        )
    columns = []
    with telling() as tell:
        for axis in AXES:
            with noting(tell), naming(f"{item}, {axis}"):
                unit, values = table.spectrum(axis)
                if unit.si != "N/m":
                    raise InputError(f"'{unit.label}' is no unit of a stiffness: export it in N/mm")
                refuse_beyond("stiffness", values)
                if np.any(values.real <= 0.0):
                    raise InputError(
                        "the stiffness is negative: check its sign, and that it is force per "
                        "displacement"
                    )
                columns.append(values)
    return Bracket(side, frequency, np.stack(columns, axis=1))


def assembled(folder: Path, file: PlatformFile, tables: Tables, functions: Functions) -> Platform:
    """Put a platform together from what its files hold."""
    inputs = [folder / name for name in (PLATFORM_FILE, file.mount_table, file.channel_table)]
    for vehicle in file.vehicles:
        of_receivers = [receiver.functions for receiver in vehicle.receivers or ()]
        names = (vehicle.noise_transfer, *of_receivers, vehicle.body)
        inputs += [folder / name for name in names if name]
    for entry in file.load_cases:
        inputs += [folder / name for name in (entry.operating, entry.torque_table) if name]
    for mount in file.mounts:
        inputs += [folder / stated for stated in mount.brackets.values() if isinstance(stated, str)]
    rubber = {name: each for each in file.rubber for name in each.mounts}
    library, library_fault = _library(folder / LIBRARY_FILE, tables.mounts, rubber)
    in_car: dict[str, RubberInCar] = {}
    for each in file.rubber:
        in_car |= _rubber_in_car(folder, each, library, library_fault)
        inputs += [folder / name for name in (each.other_library,) if name]
    if file.car_factors is not None:
        inputs.append(folder / file.car_factors)
        on_the_road = _rubber_on_the_road(folder / file.car_factors, tables.mounts)
        if both := sorted(set(in_car) & set(on_the_road)):
            raise InputError(
                f"{folder / PLATFORM_FILE}: [[rubber]] and car_factors both say how stiff "
                f"{', '.join(both)} is in the car: keep one of both"
            )
        in_car |= on_the_road
    mounts = tuple(
        replace(mount, brackets=functions.brackets[mount.name], rubber=in_car.get(mount.name))
        for mount in tables.mounts
    )
    read = with_their_tables(inputs)
    return Platform(
        name=file.name,
        title=file.title,
        description=file.description,
        folder=folder,
        mounts=mounts,
        powertrain=_powertrain(file.powertrain),
        fleet=Fleet(tuple(_vehicle(entry, functions) for entry in file.vehicles)),
        load_cases=tuple(_load_case(entry, file.engine, functions) for entry in file.run_ups),
        idle=_idle_runs(folder, file, functions),
        default_load_case=file.default_load_case,
        input_files=read,
        cylinders=file.engine.cylinders,
        library=library,
        library_fault=library_fault,
        doubts=tuple(_doubts(folder, file, functions, read)),
    )


def _doubts(
    folder: Path, file: PlatformFile, functions: Functions, inputs: Sequence[Path]
) -> Iterator[str]:
    """Give a sentence for ID lines that name another item, and for files that nothing names."""
    vehicles = {entry.name: (entry.name,) for entry in file.vehicles}
    for entry in file.vehicles:
        columns = functions.noise_transfer[entry.name]
        for other in _others_in(columns.labels, vehicles, entry.name):
            yield (
                f"{columns.path}: vehicle {entry.name}: its ID lines name vehicle {other}: is it "
                "the right file?"
            )
    cases = {entry.name: (entry.name, entry.title) for entry in file.load_cases}
    for case in file.load_cases:
        columns = functions.operating[case.name][0]
        for other in _others_in(columns.labels, cases, case.name):
            yield (
                f"{columns.path}: load case {case.name}: its ID lines name load case {other}: is "
                "it the right file?"
            )
    beside = {path.parent for path in inputs} - {folder}
    for place in sorted(beside):
        for path in sorted(place.iterdir()):
            endings = {each.suffix.lower() for each in inputs if each.parent == place}
            if path.is_file() and path.suffix.lower() in endings and path not in inputs:
                yield (
                    f"{path}: {PLATFORM_FILE} does not name it: add its vehicle or load case, or "
                    "move it elsewhere"
                )


def _others_in(labels: str, names: Mapping[str, Sequence[str]], label: str) -> list[str]:
    """Name the items that labels name, where they do not name their own."""

    def stands(words: Sequence[str]) -> bool:
        return any(
            re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", labels) for word in words if word
        )

    if stands(names[label]):
        return []
    return [name for name, words in names.items() if stands(words)]


def _rubber_in_car(
    folder: Path,
    entry: RubberEntry,
    library: Sequence[CharacterisedMount],
    library_fault: InputError | None,
) -> dict[str, RubberInCar]:
    """Return the state of the rubber of an entry's mounts, from its numbers or two libraries."""
    if entry.stiffness_percent_per_k is not None:
        low, high = entry.stiffness_percent_per_k
        return dict.fromkeys(entry.mounts, entry.in_car((low / 100.0, high / 100.0)))
    path = folder / str(entry.other_library)
    if library_fault is not None:
        raise library_fault
    records, warm = read_library_json(path)
    temperatures = {record.test_temperature for record in records}
    (temperature, *others) = temperatures
    if temperature is None or others or temperature == entry.test_temperature_c:
        raise InputError(
            f"{path}: its campaign states no temperature other than the "
            f"{entry.test_temperature_c:g} °C of [[rubber]]: state test_temperature_c in its "
            "campaign.toml and characterise it again"
        )
    with naming(str(path)):
        measured = change_per_kelvin(library, warm, temperature - entry.test_temperature_c)
    if missing := [name for name in entry.mounts if name not in measured]:
        raise InputError(
            f"{path}: nothing is measured there and in {LIBRARY_FILE} at the same operating points "
            f"of {', '.join(missing)}: state stiffness_percent_per_k of them"
        )
    return {name: entry.in_car(measured[name]) for name in entry.mounts}


def _rubber_on_the_road(path: Path, mounts: Sequence[Mount]) -> dict[str, RubberInCar]:
    """Read how stiff mounts are in cars from the table of a validated synthesis, by mount.

    Rows that were not taken over there are left out. With one car the spread of others is unknown.
    """
    columns = read_columns(path, "taken over")
    texts = columns.texts
    if "taken over" not in texts:
        raise InputError(
            f"{path} has no column 'taken over': it is car_factors.csv of a run of "
            "synthesis_validation"
        )
    believed = np.array([text.lower() == "true" for text in texts["taken over"]])
    stated = {}
    for mount in mounts:
        header = f"{mount.name} in the car over bench [1]"
        if header not in texts:
            continue
        with naming(str(path)):
            (factors,) = columns.numbers(header)
        if not np.all(factors > 0.0):
            raise InputError(f"{path}: '{header}' is 0 or less: run synthesis_validation again")
        logarithms = np.log(factors[believed])
        if logarithms.size:
            spread = float(np.std(logarithms, ddof=1)) if logarithms.size > 1 else None
            middle = float(np.exp(logarithms.mean()))
            stated[mount.name] = RubberInCar(on_the_road=middle, spread=spread)
    if not stated:
        raise InputError(
            f"{path}: no row was taken over, or none names a mount of {PLATFORM_FILE}: leave "
            "car_factors out"
        )
    return stated


def _library(
    path: Path, mounts: Sequence[Mount], rubber: Mapping[str, RubberEntry]
) -> tuple[tuple[CharacterisedMount, ...], InputError | None]:
    """Mounts of the library beside a platform, as they stand there, or why there are none."""
    if not path.is_file():
        return (), MissingLibrary(
            f"{path}: the platform has no mount library: export one there as JSON (deboom "
            "characterise, then deboom library export; a virtual platform: deboom bench write "
            "--library), or take the mounts from the measured spectra (--mounts spectra)"
        )
    try:
        records, parts = read_library_json(path)
        tested = {each.name: each.test_temperature for each in records}
        for part in parts:
            stated, measured = rubber.get(part.mount.name), tested.get(part.identity.campaign)
            if stated and measured not in (None, stated.test_temperature_c):
                raise InputError(
                    f"{path}: campaign {part.identity.campaign} tested {part.mount.name} at "
                    f"{measured:g} °C, and [[rubber]] of {PLATFORM_FILE} says "
                    f"{stated.test_temperature_c:g} °C: correct one of both"
                )
        return as_mounted(parts, mounts), None
    except InputError as error:
        return (), error


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


def _vehicle(entry: VehicleEntry, functions: Functions) -> Vehicle:
    columns = functions.noise_transfer[entry.name]
    ear, values = columns.ear or f"node {entry.ear_node}", columns.values[:, np.newaxis, :]
    frf = Frf(functions.frequency, values, (ear,), columns.names, "Pa/N")
    receptance = functions.receptance.get(entry.name)
    if receptance is not None:
        # lines that are the same within rounding
        receptance = replace(receptance, frequency=functions.frequency)
    receivers = {
        receiver: Frf(
            functions.frequency,
            columns.values[:, np.newaxis, :],
            (receiver.name,),
            columns.names,
            receiver.transfer_unit,
        )
        for receiver, columns in functions.receivers[entry.name].items()
    }
    return Vehicle(
        name=entry.name,
        group=entry.group,
        noise_transfer=frf,
        receptance=receptance,
        ear=functions.ear.get(entry.name, EAR),
        receivers=receivers,
    )


def _idle_runs(folder: Path, file: PlatformFile, functions: Functions) -> tuple[IdleRun, ...]:
    """Return the load cases at idle; InputError for lines that are not those of orders."""
    runs = []
    with telling() as tell:
        for entry in file.load_cases:
            if entry.speed_rpm is not None:
                with noting(tell), naming(str(folder / entry.operating)):
                    case = _load_case(entry, file.engine, functions)
                    torque = np.full(case.force.frequency.size, entry.torque_limit_nm)
                    runs.append(IdleRun(replace(case, engine_torque=torque), entry.speed_rpm))
    return tuple(runs)


def _load_case(entry: LoadCaseEntry, engine: Engine, functions: Functions) -> LoadCase:
    displacement, force = functions.operating[entry.name]
    lines = displacement.frequency if entry.is_idle else functions.frequency
    return LoadCase(
        name=entry.name,
        title=entry.title,
        gear=entry.gear,
        total_ratio=engine.total_ratios[entry.gear - 1],
        torque_limit=entry.torque_limit_nm,
        order=entry.order or engine.dominant_order,
        displacement=Spectrum(lines, displacement.values, displacement.names, "m"),
        force=Spectrum(lines, force.values, force.names, "N"),
        engine_torque=functions.engine_torque.get(entry.name),
    )


def _by_quantity(
    rows: Sequence[ChannelRow], mounts: Sequence[Mount]
) -> dict[str, list[ChannelRow]]:
    """Order the rows of each quantity as mount, axis, piece."""
    row_of = {(row.quantity, row.channel): row for row in rows}
    operating = [name for m in mounts for axis in AXES for name in m.channels(axis)]
    names = dict.fromkeys(QUANTITY_UNIT, operating) | {NOISE_TRANSFER: _paths(mounts, set(row_of))}
    return {
        quantity: [row_of[quantity, name] for name in names[quantity] if (quantity, name) in row_of]
        for quantity in names
    }


def _paths(mounts: Sequence[Mount], channels: set[tuple[str, str]]) -> list[str]:
    """Name the paths: the pieces of a mount where each has a noise transfer function."""
    heard = [name for quantity, name in channels if quantity == NOISE_TRANSFER]
    return list(paths_into(mounts, heard)) if any(mount.transfer_axes for mount in mounts) else []


def _channel_faults(
    path: Path, rows: Sequence[ChannelRow], mounts: Sequence[Mount]
) -> Iterator[str]:
    """Give a sentence for a row without mount, and for what force or motion of a path lacks."""
    channels = {(row.quantity, row.channel) for row in rows}
    paths = _paths(mounts, channels)
    operating = [name for mount in mounts for axis in AXES for name in mount.channels(axis)]
    for row in rows:
        if row.channel not in (paths if row.quantity == NOISE_TRANSFER else operating):
            yield (
                f"{path}: {row.quantity} channel '{row.channel}' fits no mount, piece and transfer "
                f"axis of {PLATFORM_FILE}: correct one of them"
            )
    if not paths:
        yield f"{path}: no mount of {PLATFORM_FILE} has a transfer axis: name one"
    measured = [channel for quantity, channel in channels if quantity != NOISE_TRANSFER]
    needed = [(NOISE_TRANSFER, name) for name in paths]
    for mount in mounts:
        names = [name for axis in AXES for name in mount.channels(axis)]
        through = [name for axis in mount.transfer_axes for name in mount.channels(axis)]
        if not any(name in measured for name in names):
            yield f"{path}: mount '{mount.name}' has no channel: add '{names[0]}', ..."
        for name in names:
            if name in through or name in measured:
                needed += [("displacement", name), ("force", name)]
    for quantity, name in needed:
        if (quantity, name) not in channels:
            yield (
                f"{path}: there is no {quantity} channel '{name}': add its row, or take the axis "
                f"out of transfer_axes in {PLATFORM_FILE}"
            )


PLATFORM: FolderRecord = FolderRecord(
    kind=FolderKind.platform,
    file=PLATFORM_FILE,
    keys=PlatformFile,
    command="deboom run front {} --mounts spectra",
    guide="Your own platform",
)
