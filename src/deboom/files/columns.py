"""Channels of a platform, chosen from its files and checked against the channel table.

From a UFF file by their DoF, from a table by their name.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.files.faults import Note, refuse
from deboom.files.function_table import is_table, read_function_table
from deboom.files.platform_tables import NOISE_TRANSFER, QUANTITY_UNIT, ChannelRow
from deboom.files.torque_table import SAME_LINE
from deboom.files.uff import UffFunction, find, read_uff
from deboom.files.units import parse_unit

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
    """Choose the operating spectra of a load case: displacement, then force.

    Parameters
    ----------
    path : Path
        UFF file, or a table (`deboom.files.function_table`).
    item : str
        Whose it is, for messages.
    order : float or None
        Engine order of the spectra [1]; a UFF file's first ID line ``order <number> …`` must
        agree, unless None.
    rows : sequence of ChannelRow
        The channels of both quantities, each in the order wanted.
    note : callable
        Gets every channel at fault, which is left out; by default the first one is raised.

    Raises
    ------
    InputError
        A channel without its function, or with one of another type, unit, quantity or order.
    """
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
    """Return the frequency lines that all functions share [Hz]; the first function sets them.

    Parameters
    ----------
    files : sequence of Columns
    note : callable
        Gets the fault of every file; by default the first one is raised.

    Raises
    ------
    InputError
        Axes that differ (both files and the first differing value are named), or no frequency.
    """
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
