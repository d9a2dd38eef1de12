"""The door to Universal File Format (UFF): the only module that imports pyuff, behind a guard.

What pyuff 2.5.8 does and what the guard does about it:

- mode ``overwrite`` doubles the ``-1`` between sets and destroys the first binary set: only ``add``
  to a fresh file is used, and the finished file replaces the old one in one step;
- every ``add`` reads the whole file again, so time grows with the square of the number of sets:
  each set is written to its own scratch file and appended, so time grows linearly;
- a name over 10 characters shifts its record, and node and direction read back as 0: refused;
- NaN and inf become 0 and 1.8e308: a ``UffFunction`` cannot hold them;
- unit fields and set 164 are optional: always written, and SI is insisted on;
- start and step of the abscissa (or each uneven abscissa) keep 6 digits: see `AxisDriftWarning`;
- binary complex sets announce half of their bytes: corrected in the set's header;
- a set without its end, or with fewer values than announced, is read without complaint: refused.
"""

from __future__ import annotations

import contextlib
import io
import re
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyuff

from deboom.errors import InputError
from deboom.files.uff_function import UffFunction, find
from deboom.files.uff_set58 import DIRECTION_CODE, AxisDriftWarning, function_of, set_58

__all__ = [
    "AxisDriftWarning",
    "UffFunction",
    "find",
    "read_uff",
    "set_types",
    "write_uff",
]

# the same rule as pyuff's: -1 in columns 5 and 6, then the end of the line or blanks to column 80
_SEPARATOR = re.compile(rb"    -1(?=\r|\n|\Z| {74})")
_SI_SET: dict[str, Any] = {
    "type": 164,
    "units_code": 1,
    "units_description": "Meter (newton)",
    "temp_mode": 1,
    "length": 1.0,
    "force": 1.0,
    "temp": 1.0,
    "temp_offset": 0.0,
}


def write_uff(path: Path | str, functions: Sequence[UffFunction], *, binary: bool = False) -> None:
    """Write functions to a UFF file: data set 164 (SI), then one data set 58 each.

    The file appears complete or not at all; an existing file is replaced.

    Parameters
    ----------
    path : path
        The file; its folder must exist.
    functions : sequence of UffFunction
        In SI.
    binary : bool
        Data sets 58b in double precision; ASCII keeps 12 digits.

    Raises
    ------
    InputError
        A name over 10 characters, text over its field, a unit that is missing or not SI, a function
        type or quantity that cannot be written, an uneven abscissa in binary, or an abscissa whose
        6 stored digits err by more than 0.05 of a line spacing (time: 1 deg at 140 Hz).

    Warns
    -----
    AxisDriftWarning
        The abscissa will read back changed, within these bounds.
    """
    path = Path(path)
    if not functions:
        raise InputError(f"{path}: no function to write; give at least one")
    try:
        sets = [_SI_SET, *(set_58(function, binary) for function in functions)]
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    try:
        with tempfile.TemporaryDirectory(prefix=".uff-", dir=path.parent) as folder:
            whole = Path(folder) / "whole.uff"
            with whole.open("wb") as out:
                for number, content in enumerate(sets):
                    out.write(_block(Path(folder) / f"{number}.uff", content))
            _check_written(path, whole, functions)
            whole.replace(path)
    except OSError as error:
        raise InputError(
            f"{path} cannot be written ({error.strerror or error}): choose a folder that exists "
            "and may be written to"
        ) from None


def read_uff(path: Path | str) -> tuple[UffFunction, ...]:
    """Read every function (data set 58 or 58b) of a UFF file, in SI.

    Values are converted by their unit label; without one, by data set 164. Set types other than
    58 and 164 are skipped; `set_types` lists them.

    Parameters
    ----------
    path : path
        ASCII or binary.

    Returns
    -------
    tuple of UffFunction
        In the order of the file.

    Raises
    ------
    InputError
        The file is missing, empty, not UFF, truncated, damaged, holds no function, holds a value
        that is not finite, or its label and its data set 164 state different units.
    """
    path = Path(path)
    file = _opened(path)
    kinds = [int(kind) for kind in file.get_set_types()]
    scales = {_unit_scale(path, i, file) for i, kind in enumerate(kinds) if kind == 164}
    if len(scales) > 1:
        raise InputError(f"{path}: its data sets 164 state different units; export it in one")
    scale = scales.pop() if scales else None
    functions = []
    for index, kind in enumerate(kinds):
        if kind == 58:
            try:
                functions.append(function_of(_content(path, index, file), scale))
            except InputError as error:
                raise InputError(f"{path}: set {index + 1}: {error}") from None
    if not functions:
        there = ", ".join(str(kind) for kind in kinds)
        raise InputError(f"{path} holds no function (data set 58), only sets {there}")
    return tuple(functions)


def set_types(path: Path | str) -> tuple[int, ...]:
    """List the data set types of a UFF file in their order, such as ``(164, 58, 58)``.

    Raises
    ------
    InputError
        The file is missing, empty, not UFF or truncated.
    """
    return tuple(int(kind) for kind in _opened(Path(path)).get_set_types())


def _block(scratch: Path, content: dict[str, Any]) -> bytes:
    with _quiet():
        # a copy: pyuff fills in the dictionary it is given
        pyuff.UFF(str(scratch)).write_sets([dict(content)], mode="add")
    block = scratch.read_bytes()
    scratch.unlink()
    if content.get("binary"):
        first, header, rest = block.split(b"\n", 2)
        n_bytes = content["data"].nbytes
        block = b"\n".join((first, header[:31] + b"%12d" % n_bytes + header[43:], rest))
    return block


def _check_written(path: Path, whole: Path, functions: Sequence[UffFunction]) -> None:
    file = _opened(whole)
    kinds = [int(kind) for kind in file.get_set_types()]
    if kinds != [164] + [58] * len(functions):
        raise InputError(f"{path}: the sets read back as {kinds}; nothing was written")
    for index, function in enumerate(functions, 1):
        content = _content(path, index, file, header_only=True)
        expected = {
            "rsp_node": function.response_node,
            "rsp_dir": DIRECTION_CODE[function.response_direction],
            "ref_node": function.reference_node,
            "ref_dir": DIRECTION_CODE[function.reference_direction],
            "num_pts": function.values.size,
        }
        for key, value in expected.items():
            if content[key] != value:
                raise InputError(
                    f"{path}: {function.dof}: {key} {value} reads back as {content[key]}; nothing "
                    "was written"
                )


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep pyuff's prints and warnings away from the user; what matters is checked here."""
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        yield


def _opened(path: Path) -> Any:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check the path") from None
    if not data.strip():
        raise InputError(f"{path} is empty: export it again")
    n_separators = len(_SEPARATOR.findall(data))
    if n_separators == 0:
        raise InputError(f"{path} is not a UFF file: it has no line with -1 in columns 5 and 6")
    if n_separators % 2:
        raise InputError(f"{path} is truncated: its last set does not end; export it again")
    with _quiet():
        file = pyuff.UFF(str(path))
    bad = [index + 1 for index, kind in enumerate(file.get_set_types()) if kind <= 0]
    if bad:
        raise InputError(f"{path}: set {bad[0]} states no type; export the file again")
    return file


def _content(path: Path, index: int, file: Any, header_only: bool = False) -> Mapping[str, Any]:
    try:
        with _quiet():
            content: dict[str, Any] = file.read_sets(index, header_only=header_only)
    except Exception:  # pyuff raises bare Exception without a reason
        raise InputError(
            f"{path}: set {index + 1} is damaged: its header or its numbers cannot be read; "
            "export the file again"
        ) from None
    return content


def _unit_scale(path: Path, index: int, file: Any) -> tuple[float, float]:
    content = _content(path, index, file)
    length, force = float(content["length"]), float(content["force"])
    if not (np.isfinite([length, force]).all() and length > 0 and force > 0):
        raise InputError(f"{path}: data set 164 states length {length} and force {force} per SI")
    return length, force
