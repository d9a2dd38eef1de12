"""Reader and writer of Universal File Format (UFF): the only module that imports pyuff."""

from __future__ import annotations

import contextlib
import io
import os
import re
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import numpy as np
import pyuff
from pyuff.datasets.dataset_58 import _extract58

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError, naming
from deboom.files.disk import (
    LARGEST_FILE,
    LARGEST_TEXT,
    MEBIBYTE,
    blocks,
    decoded,
    kind_of,
    opened_file,
    read_bytes,
    replace_bytes,
)
from deboom.files.units import Unit, parse_unit

DIRECTIONS: dict[int, str] = {0: "scalar"} | {
    sign * (axis + 1): f"{'+' if sign > 0 else '-'}{name}"
    for axis, name in enumerate(("x", "y", "z", "rx", "ry", "rz"))
    for sign in (1, -1)
}
"""UFF direction codes and their words, ``+x`` … ``-rz``; 0 is ``scalar``."""


class _KeptAsGiven:
    """Values that keep the memory of single precision, and are doubles wherever they are used.

    Base of `UffFunction`, whose field `values` is set and read through this property.
    """

    _kept_values: Any

    @property
    def values(self) -> Any:
        """Values in double precision, not to be written to."""
        values = self._kept_values.astype(_double(self._kept_values), copy=False)
        values.setflags(write=False)
        return values

    @values.setter
    def values(self, given: Any) -> None:
        single = getattr(given, "dtype", None) in (np.float32, np.complex64)
        kept = _kept(given, given.dtype if single else _double(given))
        object.__setattr__(self, "_kept_values", kept)


@dataclass(frozen=True, eq=False)
class UffFunction(_KeptAsGiven):
    """One function at a nodal DoF: UFF data set 58, in SI.

    - `abscissa` (n,): increasing, n ≥ 2 [Hz] or [s].
    - `values` (n,): real or complex, finite [ordinate_unit, over denominator_unit where there is
      one]; always in double precision, made anew at each use where they are given in single.
    - `function_type`: UFF code: 0 general, 1 time, 2 auto spectrum, 3 cross spectrum, 4 frequency
      response, 6 coherence, 9 power spectral density, 12 spectrum, 27 order function.
    - `response_node`, `reference_node`: node numbers; 0 is none.
    - `response_direction`, `reference_direction`: ``+x -x +y … +rz -rz``, or ``scalar`` for none.
    - `ordinate`, `denominator`: quantity in a word: ``displacement``, ``velocity``,
      ``acceleration``, ``force``, ``pressure``, ``general``, ``unknown``, …; the denominator may be
      ``none``.
    - `ordinate_unit`, `denominator_unit`: SI label, such as ``m``, ``N``, ``Pa``. A function that
      was read keeps the file's own label where deboom does not know it, and has ``""`` where the
      file states no unit.
    - `id_lines`: up to five lines of text; filled up to five.
    - `response_name`, `reference_name`: entity names, at most 10 characters.
    - `abscissa_quantity`: ``frequency``, ``time``, …; left out, it is ``time`` for function type 1
      and ``frequency`` for the others.
    - `file_unit`: the unit label as it stood in the file, such as ``mm`` or ``Pa/N``; ``""`` for a
      function that was not read, or whose file states none.
    - raises InputError: arrays of different lengths, an abscissa that does not increase, a value
      that is not finite (node, direction and line are named), an unknown direction, more than five
      ID lines.
    """

    abscissa: RealArray = field(repr=False)
    values: RealArray | ComplexArray = field(repr=False)
    function_type: int
    response_node: int
    response_direction: str
    reference_node: int = 0
    reference_direction: str = "scalar"
    ordinate: str = "unknown"
    ordinate_unit: str = ""
    denominator: str = "none"
    denominator_unit: str = ""
    id_lines: tuple[str, ...] = ()
    response_name: str = ""
    reference_name: str = ""
    abscissa_quantity: str = ""
    file_unit: str = ""

    def __post_init__(self) -> None:
        for direction in (self.response_direction, self.reference_direction):
            if direction not in DIRECTIONS.values():
                raise InputError(
                    f"unknown direction {direction!r}: use one of {', '.join(DIRECTIONS.values())}"
                )
        if len(self.id_lines) > 5:
            raise InputError(f"{self.dof}: {len(self.id_lines)} ID lines, a function has five")
        abscissa, values = _kept(self.abscissa, np.float64), self._kept_values
        if abscissa.ndim != 1 or abscissa.shape != values.shape or abscissa.size < 2:
            raise InputError(
                f"{self.dof}: abscissa and values need one equal length of at least 2, they have "
                f"shapes {abscissa.shape} and {values.shape}"
            )
        for array, what in ((abscissa, "abscissa"), (values, "value")):
            for part in blocks(array.size):
                bad = part.start + np.flatnonzero(~np.isfinite(array[part]))
                if bad.size:
                    raise InputError(
                        f"{self.dof}: the {what} of line {bad[0] + 1} is {array[bad[0]]}; measure "
                        "or export it again, deboom does not fill gaps"
                    )
        for part in blocks(abscissa.size):
            near = abscissa[part.start : part.stop + 1]
            falling = part.start + np.flatnonzero(near[1:] <= near[:-1])
            if falling.size:
                raise InputError(
                    f"{self.dof}: the abscissa does not increase after line {falling[0] + 1} "
                    f"({abscissa[falling[0]]:g}, then {abscissa[falling[0] + 1]:g})"
                )
        for array in (abscissa, values):
            array.setflags(write=False)
        object.__setattr__(self, "abscissa", abscissa)
        object.__setattr__(self, "id_lines", (*self.id_lines, *[""] * (5 - len(self.id_lines))))
        if not self.abscissa_quantity:
            quantity = "time" if self.function_type == 1 else "frequency"
            object.__setattr__(self, "abscissa_quantity", quantity)

    @property
    def dof(self) -> str:
        """Response and reference in words, for messages."""
        text = f"node {self.response_node} {self.response_direction} {self.ordinate}"
        if self.reference_node or self.reference_direction != "scalar":
            text += f", reference node {self.reference_node} {self.reference_direction}"
        return text

    @property
    def unit(self) -> str:
        """SI unit of the values, such as ``m`` or ``Pa/N``."""
        return "/".join(filter(None, (self.ordinate_unit, self.denominator_unit)))


def _kept(given: Any, kind: type) -> Any:
    """Return an array that nobody writes to: a copy of what may be written to."""
    shared = isinstance(given, np.ndarray) and not given.flags.writeable
    return np.asarray(given, dtype=kind) if shared else np.array(given, dtype=kind)


def _double(given: Any) -> type:
    return np.complex128 if np.iscomplexobj(given) else np.float64


LARGEST_LINE_ERROR = 0.05
"""Largest error of a stored abscissa, in line spacings, of anything but time [1]."""
LARGEST_PHASE_ERROR = 1.0
"""Largest phase error at 140 Hz, the top of booming noise, of a stored time axis [deg]."""

_QUANTITY = {
    0: "unknown",
    1: "general",
    2: "stress",
    3: "strain",
    5: "temperature",
    6: "heat flux",
    8: "displacement",
    9: "force",
    11: "velocity",
    12: "acceleration",
    13: "force",
    15: "pressure",
    16: "mass",
    17: "time",
    18: "frequency",
    19: "rpm",
    20: "order",
}
QUANTITY_CODE = {word: code for code, word in _QUANTITY.items()} | {"none": 0}
DIRECTION_CODE = {word: code for code, word in DIRECTIONS.items()}
# SI unit along a translation (or scalar) and about a rotation, and the exponents of length and
# force in both cases, from the table "Unit Exponents" of data set 58
_SI = {
    "displacement": (("m", 1, 0), ("rad", 0, 0)),
    "velocity": (("m/s", 1, 0), ("rad/s", 0, 0)),
    "acceleration": (("m/s^2", 1, 0), ("rad/s^2", 0, 0)),
    "force": (("N", 0, 1), ("N m", 1, 1)),
    "pressure": (("Pa", -2, 1), ("Pa", -2, 1)),
    "mass": (("kg", -1, 1), ("kg", -1, 1)),
}
_AXIS_UNIT = {"frequency": "Hz", "time": "s", "rpm": "rpm", "order": "1"}
_VALUES_PER_ROW = {
    **{(2, 1): 6, (4, 1): 4, (5, 1): 3, (6, 1): 2},
    **{(2, 0): 3, (4, 0): 2, (5, 0): 2, (6, 0): 1},
}
"""Data type and spacing of the abscissa (1 even) → values in a row of numbers of data set 58."""
_WRITABLE_TYPES = (0, 1, 2, 3, 4, 6, 9, 12, 27)


class AxisDriftWarning(UserWarning):
    """The abscissa of a UFF file differs from the one given, within the allowed bound."""


def set_58(function: UffFunction, binary: bool) -> dict[str, Any]:
    """Return the dictionary that pyuff writes for a function.

    - raises InputError: anything that would not read back as it was given; see
      `deboom.files.uff.write_uff`.
    """
    if function.function_type not in _WRITABLE_TYPES:
        raise InputError(
            f"{function.dof}: function type {function.function_type} cannot be written, only "
            f"{', '.join(map(str, _WRITABLE_TYPES))}"
        )
    for node in (function.response_node, function.reference_node):
        if not 0 <= node < 2**31:
            raise InputError(f"{function.dof}: node {node} is not between 0 and {2**31 - 1}")
    axis = _even_axis(function.abscissa)
    even = bool(np.max(np.abs(function.abscissa - axis)) <= 1e-6 * (axis[1] - axis[0]))
    if binary and not even:
        raise InputError(
            f"{function.dof}: an uneven abscissa cannot be written in binary; write ASCII"
        )
    _check_drift(function, even)
    return {
        "type": 58,
        "binary": int(binary),
        **{f"id{i}": _text(function, line, 80) for i, line in enumerate(function.id_lines, 1)},
        "func_type": function.function_type,
        "rsp_ent_name": _text(function, function.response_name, 10),
        "rsp_node": function.response_node,
        "rsp_dir": DIRECTION_CODE[function.response_direction],
        "ref_ent_name": _text(function, function.reference_name, 10),
        "ref_node": function.reference_node,
        "ref_dir": DIRECTION_CODE[function.reference_direction],
        "abscissa_spacing": int(even),
        "abscissa_spec_data_type": _quantity_code(function, function.abscissa_quantity),
        "abscissa_axis_lab": function.abscissa_quantity,
        "abscissa_axis_units_lab": _AXIS_UNIT.get(function.abscissa_quantity, "1"),
        "ordinate_spec_data_type": _quantity_code(function, function.ordinate),
        "ordinate_axis_lab": function.ordinate,
        "ordinate_axis_units_lab": _si_label(
            function, function.ordinate, function.ordinate_unit, function.response_direction
        ),
        "orddenom_spec_data_type": _quantity_code(function, function.denominator),
        "orddenom_axis_lab": "NONE" if function.denominator == "none" else function.denominator,
        "orddenom_axis_units_lab": _si_label(
            function, function.denominator, function.denominator_unit, function.reference_direction
        ),
        "data": function.values,
        "x": axis if even else function.abscissa,
    }


def _text(function: UffFunction, text: str, width: int) -> str:
    if len(text) > width or not text.isascii() or (text and not text.isprintable()):
        raise InputError(
            f"{function.dof}: {text!r} does not fit its field of {width} plain ASCII characters; "
            "shorten it"
        )
    if text != text.strip() or text == "NONE":
        raise InputError(
            f"{function.dof}: {text!r} would not read back: no blanks at its ends, and not 'NONE'"
        )
    return text or "NONE"


def _quantity_code(function: UffFunction, quantity: str) -> int:
    if quantity not in QUANTITY_CODE:
        raise InputError(
            f"{function.dof}: unknown quantity {quantity!r}, use one of "
            f"{', '.join(sorted(QUANTITY_CODE))}"
        )
    return QUANTITY_CODE[quantity]


def _si_label(function: UffFunction, quantity: str, unit: str, direction: str) -> str:
    if quantity == "none":
        if unit:
            raise InputError(f"{function.dof}: unit {unit!r} of a denominator that is 'none'")
        return "NONE"
    if quantity in _SI:
        expected = _SI[quantity]["r" in direction.removeprefix("scalar")][0]
        if unit != expected:
            raise InputError(
                f"{function.dof}: {quantity} is in {unit or 'no unit'}; convert it to {expected}"
            )
    elif not unit:
        raise InputError(f"{function.dof}: {quantity} has no unit; write '1' for a plain number")
    return _text(function, unit, 20)


def _even_axis(abscissa: RealArray) -> RealArray:
    step = (abscissa[-1] - abscissa[0]) / (abscissa.size - 1)
    return np.asarray(abscissa[0] + step * np.arange(abscissa.size), dtype=np.float64)


def _check_drift(function: UffFunction, even: bool) -> None:
    given = function.abscissa
    if even:
        start, step = (_six_digits(x) for x in (given[0], _even_axis(given)[1] - given[0]))
        stored = start + step * np.arange(given.size)
    else:
        stored = np.array([_six_digits(x) for x in given])
    drift = float(np.max(np.abs(stored - given)))
    spacing = float(np.min(np.diff(given)))
    if drift <= 1e-6 * spacing:
        return
    if function.abscissa_quantity == "time":
        error, bound = 360.0 * 140.0 * drift, LARGEST_PHASE_ERROR
        words = f"{drift:.3g} s, {error:.3g} deg at 140 Hz (bound {bound:g} deg)"
    else:
        error, bound = drift / spacing, LARGEST_LINE_ERROR
        words = f"{drift:.3g}, {error:.3g} of a line spacing (bound {bound:g})"
    message = f"{function.dof}: UFF keeps 6 digits of the abscissa, which then errs by {words}"
    if error > bound:
        raise InputError(f"{message}; choose a step of 6 digits or write shorter records")
    warnings.warn(message, AxisDriftWarning, stacklevel=5)


def _six_digits(number: float) -> float:
    return float(f"{number:.5e}")


def function_of(
    content: Mapping[str, Any],
    scale: tuple[float, float] | None,
    former: UffFunction | None = None,
) -> UffFunction:
    """Return the function, in SI, of a dictionary that pyuff read.

    - `former` or None: read before; functions with the same abscissa hold it once.
    """
    for code in (content["rsp_dir"], content["ref_dir"]):
        if code not in DIRECTIONS:
            raise InputError(f"direction {code} is not a UFF direction (-6 … 6); export it again")
    response, reference = DIRECTIONS[content["rsp_dir"]], DIRECTIONS[content["ref_dir"]]
    where = f"node {content['rsp_node']} {response}"
    axis_values, stored = _announced(where, content)
    quantity = _QUANTITY.get(content["abscissa_spec_data_type"], "unknown")
    axis = _axis_unit(where, quantity, _unless_none(content["abscissa_axis_units_lab"]))
    if quantity == "unknown":
        quantity = {"Hz": "frequency", "s": "time", "rpm": "rpm"}.get(axis.si, quantity)
    ordinate = _QUANTITY.get(content["ordinate_spec_data_type"], "unknown")
    denominator = _QUANTITY.get(content["orddenom_spec_data_type"], "unknown")
    labels = (content["ordinate_axis_units_lab"], content["orddenom_axis_units_lab"])
    labels = _parted(*labels, _si_of(ordinate, response), _si_of(denominator, reference))
    above = _unit(where, ordinate, labels[0], response, scale)
    below = _unit(where, denominator, labels[1], reference, scale)
    if denominator == "unknown" and not below.label:
        denominator = "none"
    with np.errstate(invalid="ignore", over="ignore"):  # refused with its line number below
        values = _scaled(stored, above.factor / below.factor)
    abscissa = _scaled(axis_values, axis.factor)
    if former is not None and np.array_equal(former.abscissa, abscissa):
        abscissa = former.abscissa
    return UffFunction(
        abscissa=abscissa,
        values=values,
        function_type=content["func_type"],
        response_node=content["rsp_node"],
        response_direction=response,
        reference_node=content["ref_node"],
        reference_direction=reference,
        ordinate=ordinate,
        ordinate_unit=above.si,
        denominator=denominator,
        denominator_unit=below.si,
        id_lines=tuple(_unless_none(content[f"id{i}"]) for i in range(1, 6)),
        response_name=_unless_none(content["rsp_ent_name"]),
        reference_name=_unless_none(content["ref_ent_name"]),
        abscissa_quantity=quantity,
        file_unit="/".join(filter(None, (above.label, below.label))),
    )


def _scaled(values: Any, factor: float) -> Any:
    """Return values times a factor, not to be written to."""
    scaled = np.asarray(values) if factor == 1.0 else np.asarray(values) * factor
    scaled.setflags(write=False)
    return scaled


def _announced(where: str, content: Mapping[str, Any]) -> tuple[Any, Any]:
    """Return abscissa and values without what fills up the last row: zeros, or its last value.

    - raises InputError: there are fewer values than announced, or more of them, or a row more.
    """
    announced, values = content["num_pts"], content["data"]
    beyond = values[announced:]
    key = (content["ord_data_type"], content["abscissa_spacing"])
    columns = 1 if content["binary"] else _VALUES_PER_ROW.get(key, 1)
    filled_up = len(beyond) < columns and len(values) % columns == 0 and 0 < announced < len(values)
    filler = () if not filled_up else (0.0, values[announced - 1])
    if announced != len(values) and not any(np.all(beyond == value) for value in filler):
        raise InputError(
            f"{where}: {announced} values are announced and {len(values)} are there; the file is "
            "truncated or damaged, export it again"
        )
    return content["x"][:announced], values[:announced]


def _si_of(quantity: str, direction: str) -> str:
    units = _SI.get(quantity)
    return units["r" in direction.removeprefix("scalar")][0] if units else ""


@lru_cache(maxsize=1024)
def _parted(above: str, below: str, si_above: str, si_below: str) -> tuple[str, str]:
    """Return both labels; an ordinate's such as m/s^2/N, which names the denominator, is parted.

    It stays whole where the denominator's own label is another one. Programs that leave out the
    denominator's quantity write so.
    """
    slashes = [k for k, character in enumerate(above) if character == "/"]
    for place in slashes if si_above else ():
        label, under = above[:place].strip(" ()"), above[place + 1 :].strip(" ()")
        with contextlib.suppress(InputError):
            units = parse_unit(label, si_above), parse_unit(under, si_below)
            if (units[0].si, units[1].si) != (si_above, si_below or units[1].si):
                continue
            again = parse_unit(_unless_none(below) or under, units[1].si)
            if (again.si, again.factor) != (units[1].si, units[1].factor):
                break
            return label, under
    return above, below


def _unless_none(text: str) -> str:
    return "" if text == "NONE" else text


def _axis_unit(where: str, quantity: str, label: str) -> Unit:
    """Return the unit of the abscissa.

    - raises InputError: time or frequency in another quantity's unit, or an unknown one.
    """
    si = _AXIS_UNIT.get(quantity, "")
    if not label:
        return Unit("", "", 1.0)
    try:
        unit = parse_unit(label, si)
    except InputError:
        unit = Unit(label, label, 1.0)
    if quantity in ("time", "frequency") and unit.si != si:
        raise InputError(f"{where}: its {quantity} is labelled {label!r}: export it in {si}")
    return unit


def _unit(
    where: str, quantity: str, label: str, direction: str, scale: tuple[float, float] | None
) -> Unit:
    """Take the unit of one axis from its label and data set 164, which must say the same."""
    label = _unless_none(label)
    units = _SI.get(quantity)
    si, length, force = units["r" in direction.removeprefix("scalar")] if units else ("", 0, 0)
    from_set = None
    if units and scale is not None:
        from_set = Unit(si, si, 1.0 / (scale[0] ** length * scale[1] ** force))
    if not label:
        if from_set is None:
            return Unit("", "", 1.0)
        if abs(from_set.factor - 1.0) > 1e-6:
            raise InputError(
                f"{where}: {quantity} has no unit label and data set 164 is not SI; export it in SI"
            )
        return from_set
    try:
        unit = parse_unit(label, si)
    except InputError:
        return Unit(label, label, 1.0)
    if units and unit.si != si:
        raise InputError(f"{where}: {quantity} is labelled {label!r}, which is no unit of it")
    if from_set is not None and abs(unit.factor / from_set.factor - 1.0) > 1e-6:
        raise InputError(
            f"{where}: {quantity} is labelled {label!r}, {unit.factor:g} {si}, but data set 164 "
            f"makes it {from_set.factor:g} {si}: correct the label if the numbers follow data set "
            "164, or take data set 164 out if they follow the label"
        )
    return unit


# -1 in columns 5 and 6 alone on its line: a row of data may end in -1, too
_SEPARATOR = re.compile(rb"(?:\A|(?<=[\r\n]))    -1 *(?=[\r\n]|\Z)")
# after binary numbers no line begins, and they may hold the same bytes
_AFTER_BINARY = re.compile(rb"    -1 *(?=[\r\n]|\Z)")
_BEFORE_NEXT_SET = re.compile(rb"    -1 *(?=\s*(?:\Z|    -1 *[\r\n]))")
_BLANKS_OF_ROW = re.compile(rb" +(?=[\r\n]|\Z)")
_EXPONENT_OF_FORTRAN = re.compile(rb"(\d)[dD]([+-]?\d)")
_LINES_OF_HEADER = re.compile(rb"(?:[^\r\n]*(?:\r\n|\r|\n)){13}")
MOST_SETS = 100_000
"""Data sets of a file that is read; each costs time, however small it is."""
_LONGEST_HEADER = 8192
"""Bytes within which the header of a set ends."""
_DATA_TYPES, _SINGLE, _COMPLEX = (2, 4, 5, 6), (2, 5), (5, 6)
"""Data types: all, those of single precision, and those of complex values."""
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

    - `path`: the file; its folder must exist.
    - `functions`: in SI.
    - `binary`: data sets 58b in double precision; ASCII keeps 12 digits.
    - raises InputError: a name over 10 characters, text over its field, a unit that is missing or
      not SI, a function type or quantity that cannot be written, an uneven abscissa in binary, or
      an abscissa whose 6 stored digits err by more than 0.05 of a line spacing (time: 1 deg at 140
      Hz).
    - warns AxisDriftWarning: the abscissa will read back changed, within these bounds.
    """
    path = Path(path)
    if not functions:
        raise InputError(f"{path}: no function to write; give at least one")
    with naming(path):
        sets = [_SI_SET, *(set_58(function, binary) for function in functions)]
    with tempfile.TemporaryDirectory(prefix="deboom-") as folder:
        whole = Path(folder) / "whole.uff"
        blocks = _blocks(whole, sets)
        content = b"".join(blocks)
        whole.write_bytes(content)
        _check_written(path, whole, blocks[1:], functions)
    replace_bytes(path, content)


def read_uff(path: Path | str) -> tuple[UffFunction, ...]:
    """Read every function (data set 58 or 58b) of a UFF file, in SI.

    Values are converted by their unit label; without one, data set 164 must state SI, and without
    both the unit stays ``""``. Set types other than 58 and 164 are skipped.

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
        The file is missing, empty, not UFF, truncated or damaged; it holds no function, or a value
        that is not finite; label and data set 164 differ, or a 164 without label is not SI.

    See Also
    --------
    deboom.Frf, deboom.sensor_geometry, deboom.read_component_test

    Examples
    --------
    >>> import deboom
    >>> deboom.read_uff("wagon.uff")[0].values.shape  # doctest: +SKIP
    """
    path = Path(path)
    file = _opened(path)
    kinds = [int(kind) for kind in file.get_set_types()]
    scale = _scale(path, file, kinds)
    functions: list[UffFunction] = []
    for index, kind in enumerate(kinds):
        if kind == 58:
            content = _content(path, index, file)
            with naming(f"{path}: set {index + 1}"):
                functions.append(function_of(content, scale, functions[-1] if functions else None))
    if not functions:
        sets = ", ".join(str(kind) for kind in kinds)
        raise InputError(f"{path} holds no function (data set 58), only sets {sets}")
    return tuple(functions)


def read_sets(
    path: Path, kinds: Sequence[int]
) -> tuple[tuple[Mapping[str, Any], ...], tuple[float, float] | None]:
    """Read data sets of other kinds than functions, as pyuff gives them.

    - `path`: UFF file.
    - `kinds`: numbers of the data sets, such as 15.
    - returns `sets`: in the order of the file; `scale`: length and force of data set 164 per SI,
      None where the file has none.
    - raises InputError: the file is missing, empty, not UFF, truncated or damaged.
    """
    file = _opened(path)
    sets_in_file = [int(kind) for kind in file.get_set_types()]
    size = sum(file.size_of(index) for index, kind in enumerate(sets_in_file) if kind in kinds)
    if size > LARGEST_TEXT:
        raise InputError(
            f"{path} has {size / MEBIBYTE:.0f} MiB of data sets {', '.join(map(str, kinds))}, at "
            f"most {LARGEST_TEXT / MEBIBYTE:.0f} MiB are read: export fewer nodes"
        )
    sets = [_content(path, index, file) for index, kind in enumerate(sets_in_file) if kind in kinds]
    return tuple(sets), _scale(path, file, sets_in_file)


@contextlib.contextmanager
def numbers_that_fit(path: Path) -> Iterator[None]:
    """Make one sentence of numbers in data sets that are of other length or range than stated.

    - raises InputError: the block fails on them.
    """
    try:
        yield
    except InputError:
        raise
    except (ValueError, OverflowError, IndexError, KeyError, TypeError):
        raise InputError(
            f"{path}: a data set is damaged: its numbers do not fit together; export the file again"
        ) from None


def write_sets(path: Path, sets: Sequence[Mapping[str, Any]]) -> None:
    """Write data set 164 (SI), then others as pyuff takes them; complete or not at all.

    - raises InputError: the file cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="deboom-") as folder:
        blocks = _blocks(Path(folder) / "whole.uff", (_SI_SET, *sets))
    replace_bytes(path, b"".join(blocks))


def _scale(path: Path, file: Any, kinds: Sequence[int]) -> tuple[float, float] | None:
    scales = {_unit_scale(path, index, file) for index, kind in enumerate(kinds) if kind == 164}
    if len(scales) > 1:
        raise InputError(f"{path}: its data sets 164 state different units; export it in one")
    return scales.pop() if scales else None


class _Added(pyuff.UFF):
    """File to which pyuff adds sets, without looking for all sets in it after each."""

    def refresh(self) -> bool:
        """Do nothing: nothing is read from it."""
        return True


def _blocks(scratch: Path, sets: Sequence[Mapping[str, Any]]) -> list[bytes]:
    """Return the bytes of each set, which pyuff adds to a file that is not there yet."""
    file, ends = _Added(str(scratch)), [0]
    with _quiet():
        for content in sets:
            # a copy: pyuff fills in the dictionary it is given; it writes no type above 9
            copy = {**content, "func_type": min(content.get("func_type", 0), 9)}
            if content.get("binary"):  # pyuff writes number by number: it gets two, all follow
                copy |= {name: content[name][:2] for name in ("x", "data")}
            file.write_sets([copy], mode="add")
            ends.append(scratch.stat().st_size)
    data = scratch.read_bytes()
    return [
        _completed(data[start:end], content)
        for start, end, content in zip(ends, ends[1:], sets, strict=False)
    ]


def _completed(block: bytes, content: Mapping[str, Any]) -> bytes:
    """Put the type of the function, and all its binary numbers, into what pyuff wrote."""
    stated, values = content.get("func_type", 0), content.get("data", np.empty(0))
    *header, body = block.split(b"\n", 13)
    if stated > 9:
        header[7] = b"%5i" % stated + header[7][5:]
    if content.get("binary"):
        header[1] = header[1][:31] + b"%12d" % values.nbytes + header[1][43:]
        header[8] = header[8][:10] + b"%10d" % values.size + header[8][20:]
        body = values.tobytes() + body[2 * values.itemsize :]
    return b"\n".join((*header, body))


def _check_written(
    path: Path, whole: Path, blocks: Sequence[bytes], functions: Sequence[UffFunction]
) -> None:
    kinds = [int(kind) for kind in _opened(whole).get_set_types()]
    if kinds != [164] + [58] * len(functions):
        raise InputError(f"{path}: the sets read back as {kinds}; nothing was written")
    for block, function in zip(blocks, functions, strict=True):
        record, numbers = block.split(b"\n", 9)[7:9]
        expected = {
            "rsp_node": (record[41:51], function.response_node),
            "rsp_dir": (record[51:55], DIRECTION_CODE[function.response_direction]),
            "ref_node": (record[66:76], function.reference_node),
            "ref_dir": (record[76:], DIRECTION_CODE[function.reference_direction]),
            "num_pts": (numbers[10:20], function.values.size),
            "func_type": (record[:5], function.function_type),
        }
        for key, (written, value) in expected.items():
            if written.split() != [b"%d" % value]:
                raise InputError(
                    f"{path}: {function.dof}: {key} {value} reads back as "
                    f"{written.decode().strip()}; nothing was written"
                )


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep pyuff's prints and warnings away from the user; what matters is checked here."""
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        yield


class _Sets(pyuff.UFF):
    """File of which pyuff reads the sets that stand between separators of their own lines."""

    _last_axis: tuple[tuple[float, float, int], RealArray] = (0.0, 0.0, 0), np.zeros(0)

    def refresh(self) -> bool:
        """Find the sets; pyuff's own search takes any row that ends in -1 for a separator."""
        self._data = data = _mapped(Path(self._filename))
        ends, self.is_whole = _set_ends(data)
        heads = [data[start : start + 200].splitlines()[1:2] for start, _ in ends]
        blocks: Any = np.array([(start, end - 1) for start, end in ends], dtype=np.int64)
        self._block_ind = blocks
        kinds = [re.match(rb" *(\d+)(b?)", head[0] if head else b"") for head in heads]
        self._set_types = np.array([int(kind[1]) if kind else 0 for kind in kinds], dtype=int)
        self._set_formats = np.array([float(bool(kind and kind[2])) for kind in kinds])
        self._n_sets = len(ends)
        self._refreshed = True
        return True

    def size_of(self, index: int) -> int:
        """Return the size of a set [bytes]."""
        start, last = self._block_ind[index]
        return int(last) + 1 - int(start)

    def _read_set(self, n: int, header_only: bool = False) -> Any:
        # from the bytes at hand: pyuff opens the file again for each set
        if self._set_types[n] == 58:
            return _extract58(self._bytes_of(n), header_only=header_only)
        return super()._read_set(n, header_only=header_only)

    def _bytes_of(self, index: int) -> bytes:
        start, last = self._block_ind[index]
        return bytes(self._data[start : last + 1])

    def _begin_of(self, index: int) -> bytes:
        """Return the bytes of a set within which its header ends."""
        start, last = self._block_ind[index]
        return bytes(self._data[start : min(start + _LONGEST_HEADER, last + 1)])

    def header(self, index: int) -> list[bytes]:
        """Return the lines of a set's header, empty where it is longer than headers are."""
        return [*self._begin_of(index).splitlines(), *[b""] * _HEADER_LINES][:_HEADER_LINES]

    def read_binary(self, index: int) -> Any:
        """Read the header of a binary set by pyuff, and its numbers without one object for each."""
        if not self._set_formats[index]:
            raise ValueError("a text has no binary numbers")
        header = _LINES_OF_HEADER.match(self._begin_of(index))
        if header is None:
            raise ValueError("the header has no 13 lines")
        content: dict[str, Any] = _extract58(header[0], header_only=True)
        kind = content["ord_data_type"]
        if kind not in _DATA_TYPES:
            raise ValueError(f"{kind} is no type of data")
        order = "<" if content["byte_ordering"] == 1 else ">"
        stored = np.dtype(f"{order}f{4 if kind in _SINGLE else 8}")
        count = (self.size_of(index) - header.end()) // stored.itemsize
        begin = int(self._block_ind[index][0]) + header.end()
        numbers = np.frombuffer(self._data, stored, count, begin)
        numbers = numbers.astype(stored.newbyteorder("="))  # a copy: the file is let go
        even = content["abscissa_spacing"] != 0
        width = (2 if kind in _COMPLEX else 1) + (not even)
        rows = numbers[: numbers.size // width * width].reshape(-1, width)
        axis = self._even_axis(content, len(rows)) if even else rows[:, 0].astype(float)
        values = rows if even else np.ascontiguousarray(rows[:, 1:])
        if kind in _COMPLEX:
            values = values.view(np.complex64 if kind in _SINGLE else np.complex128)
        return {**content, "x": axis, "data": values[:, 0]}

    def _even_axis(self, content: Mapping[str, Any], count: int) -> RealArray:
        """Return the abscissa of a set; functions of one raster share it."""
        stated = content["abscissa_min"], content["abscissa_inc"], count
        if stated != self._last_axis[0]:
            axis = np.arange(count, dtype=float)
            axis *= content["abscissa_inc"]
            axis += content["abscissa_min"]
            axis.setflags(write=False)
            self._last_axis = stated, axis
        return self._last_axis[1]

    def read_respelled(self, index: int) -> Any:
        """Read an ASCII set whose rows end in blanks or whose exponents are written with a D."""
        if self._set_formats[index]:
            raise ValueError("binary numbers have one spelling")
        block = self._bytes_of(index)
        header = _LINES_OF_HEADER.match(block)
        n = header.end() if header else 0
        rows = _EXPONENT_OF_FORTRAN.sub(rb"\1E\2", _BLANKS_OF_ROW.sub(b"", block[n:]))
        with tempfile.TemporaryDirectory(prefix="deboom-") as folder:
            copy = Path(folder) / "copy.uff"
            copy.write_bytes(block[:n] + rows.rstrip() + b"\n    -1\n")
            return _Sets(str(copy)).read_sets(0)


def _mapped(path: Path) -> Any:
    """Return the bytes of a file that is not empty, of which only the pages looked at are read."""
    with path.open("rb") as file:
        return mmap(file.fileno(), 0, access=ACCESS_READ)


def _set_ends(data: Any) -> tuple[list[tuple[int, int]], bool]:
    """Return where every set begins and ends, and whether the last one does end."""
    ends: list[tuple[int, int]] = []
    start = _SEPARATOR.search(data)
    while start:
        end = _end_of_set(data, start.start())
        if end is None:
            return ends, False
        if len(ends) == MOST_SETS:
            raise InputError(
                f"there are more than {MOST_SETS} data sets: export fewer functions to a file"
            )
        ends.append((start.start(), end.start()))
        start = _SEPARATOR.search(data, end.end())
    return ends, True


def _end_of_set(data: Any, start: int) -> re.Match[bytes] | None:
    """Return the separator that ends a set; a binary one ends behind the bytes it announces."""
    kind = data[start : start + 200].splitlines()[1:2]
    header = _LINES_OF_HEADER.match(data, start) if kind and kind[0][:7] == b"    58b" else None
    if header is None:
        return _SEPARATOR.search(data, start + 6)
    stated = kind[0][31:43].strip()
    behind = header.end() + (int(stated) if stated.isdigit() else 0)
    end = _AFTER_BINARY.search(data, behind)
    if end and not data[behind : end.start()].strip(b"\r\n"):
        return end
    # programs that announce too few bytes or too many are read as well
    return _BEFORE_NEXT_SET.search(data, header.end())


def _opened(path: Path) -> Any:
    with opened_file(path) as opened:
        size = os.fstat(opened.fileno()).st_size
        begin = opened.read(_LONGEST_HEADER)
    if size > LARGEST_FILE:
        raise InputError(
            f"{path} has {size / MEBIBYTE:.0f} MiB, at most {LARGEST_FILE / MEBIBYTE:.0f} MiB are "
            "read: check that it is the right file"
        )
    if not begin.strip() and (size <= len(begin) or not read_bytes(path).strip()):
        raise InputError(f"{path} is empty: export it again")
    if not _SEPARATOR.search(_mapped(path)):
        raise InputError(
            f"{path} is not a UFF file: it has no line with -1 in columns 5 and 6, it is "
            f"{kind_of(path)}; export it as UFF, data set 58"
        )
    with naming(path), _quiet():
        file = _Sets(str(path))
    if not file.is_whole:
        raise InputError(f"{path} is truncated: its last set does not end; export it again")
    bad = [index + 1 for index, kind in enumerate(file.get_set_types()) if kind <= 0]
    if bad:
        raise InputError(f"{path}: set {bad[0]} states no type; export the file again")
    return file


def _content(path: Path, index: int, file: Any) -> Mapping[str, Any]:
    for read in (file.read_binary, file.read_sets, file.read_respelled):
        # pyuff raises bare Exception without a reason, and leaves out data of another type
        with contextlib.suppress(Exception), _quiet():
            content: dict[str, Any] = read(index)
            if content["type"] != 58:
                return content
            if {"data", "x"} <= content.keys():
                break
    else:
        raise InputError(
            f"{path}: set {index + 1} is damaged: its header or its numbers cannot be read; export "
            "the file again"
        )
    header = file.header(index)
    _check_nodes(path, index, header[_NODES])
    return content | _texts_of_windows(header)


_HEADER_LINES, _NODES = 13, 7
"""Lines of the header of data set 58, with both that begin a set, and which has the nodes."""
_NAMES = {"response": (30, 41, 51, 55), "reference": (55, 66, 76, 80)}
"""Columns of that line where name, node and direction begin, and the last one ends."""
_INTEGER = re.compile(r" *([-+]?\d+)? *", re.ASCII)
_TEXTS = {
    **{f"id{k}": (k + 1, 0, 80) for k in range(1, 6)},
    **{"rsp_ent_name": (_NODES, 30, 41), "ref_ent_name": (_NODES, 55, 66)},
    "abscissa_axis_units_lab": (9, 46, 67),
    "ordinate_axis_units_lab": (10, 46, 67),
    "orddenom_axis_units_lab": (11, 46, 67),
}
"""Texts of the header: line, first column, and the one behind the last."""


def _check_nodes(path: Path, index: int, line: bytes) -> None:
    """Refuse a line whose numbers a long name has moved: pyuff reads nodes and directions as 0.

    - raises InputError: a node or direction is no integer, or stands where the name should end.
    """
    text = decoded(line)
    for which, (name, node, direction, end) in _NAMES.items():
        numbers = text[node:direction], text[direction:end]
        moved = numbers[0][:1].strip() and numbers[0][-1:] == " "
        if moved or not all(map(_INTEGER.fullmatch, numbers)):
            raise InputError(
                f"{path}: set {index + 1}: node and direction of its {which} do not stand in their "
                f"columns behind '{text[name:end].strip()}': a name has at most 10 characters; "
                "shorten it, or export without names"
            )


def _texts_of_windows(header: Sequence[bytes]) -> dict[str, str]:
    """Return texts that are not UTF-8, which pyuff reads without their characters."""
    texts = {}
    for key, (number, begin, end) in _TEXTS.items():
        line = header[number]
        if not line.isascii():
            texts[key] = decoded(line)[begin:end].strip()
    return texts


def _unit_scale(path: Path, index: int, file: Any) -> tuple[float, float]:
    content = _content(path, index, file)
    length, force = float(content["length"]), float(content["force"])
    if not (np.isfinite([length, force]).all() and length > 0 and force > 0):
        raise InputError(f"{path}: data set 164 states length {length} and force {force} per SI")
    return length, force
