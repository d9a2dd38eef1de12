"""Data set 58 as the dictionary that pyuff reads and writes: to and from a `UffFunction`.

Everything pyuff would take without a word and give back changed is refused here.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.uff_function import DIRECTIONS, UffFunction
from deboom.files.units import Unit, parse_unit

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
_QUANTITY_CODE = {word: code for code, word in _QUANTITY.items()} | {"none": 0}
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
_WRITABLE_TYPES = (0, 1, 2, 3, 4, 6, 9)


class AxisDriftWarning(UserWarning):
    """The abscissa of a UFF file differs from the one given, within the allowed bound."""


def set_58(function: UffFunction, binary: bool) -> dict[str, Any]:
    """Return the dictionary that pyuff writes for a function.

    Raises
    ------
    InputError
        Anything that would not read back as it was given; see `deboom.files.uff.write_uff`.
    """
    if function.function_type not in _WRITABLE_TYPES:
        raise InputError(
            f"{function.dof}: function type {function.function_type} cannot be written, only "
            f"{', '.join(map(str, _WRITABLE_TYPES))}"
        )
    for node in (function.response_node, function.reference_node):
        if not 0 <= node < 2**31:
            raise InputError(f"{function.dof}: node {node} is not between 0 and {2**31 - 1}")
    even = _is_even(function.abscissa)
    if binary and not even:
        raise InputError(
            f"{function.dof}: an uneven abscissa cannot be written in binary; write ASCII"
        )
    _check_drift(function, even)
    has_denominator = function.denominator != "none"
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
        "orddenom_axis_lab": function.denominator if has_denominator else "NONE",
        "orddenom_axis_units_lab": _si_label(
            function, function.denominator, function.denominator_unit, function.reference_direction
        ),
        "data": function.values,
        "x": _even_axis(function.abscissa) if even else function.abscissa,
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
    if quantity not in _QUANTITY_CODE:
        raise InputError(
            f"{function.dof}: unknown quantity {quantity!r}, use one of "
            f"{', '.join(sorted(_QUANTITY_CODE))}"
        )
    return _QUANTITY_CODE[quantity]


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


def _is_even(abscissa: RealArray) -> bool:
    step = (abscissa[-1] - abscissa[0]) / (abscissa.size - 1)
    return bool(np.max(np.abs(abscissa - _even_axis(abscissa))) <= 1e-6 * step)


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


def function_of(content: Mapping[str, Any], scale: tuple[float, float] | None) -> UffFunction:
    """Return the function, in SI, of a dictionary that pyuff read.

    Parameters
    ----------
    content : mapping
        pyuff's dictionary of one data set 58.
    scale : (length, force), optional
        File units per metre and per newton, from the file's data set 164.

    Raises
    ------
    InputError
        Fewer or more values than announced, an unknown direction, a label that contradicts the
        quantity or data set 164, a value that is not finite.
    """
    response, reference = (_direction(content[key]) for key in ("rsp_dir", "ref_dir"))
    where = f"node {content['rsp_node']} {response}"
    n_found = len(content["data"])
    if n_found != content["num_pts"]:
        raise InputError(
            f"{where}: {content['num_pts']} values are announced and {n_found} are there; the file "
            "is truncated or damaged, export it again"
        )
    quantity = _QUANTITY.get(content["abscissa_spec_data_type"], "unknown")
    axis = _unit(where, quantity, content["abscissa_axis_units_lab"], "scalar", None)
    ordinate = _QUANTITY.get(content["ordinate_spec_data_type"], "unknown")
    above = _unit(where, ordinate, content["ordinate_axis_units_lab"], response, scale)
    denominator = _QUANTITY.get(content["orddenom_spec_data_type"], "unknown")
    below = _unit(where, denominator, content["orddenom_axis_units_lab"], reference, scale)
    if denominator == "unknown" and not below.label:
        denominator = "none"
    with np.errstate(invalid="ignore", over="ignore"):  # refused with its line number below
        values = content["data"] * (above.factor / below.factor)
    return UffFunction(
        abscissa=content["x"] * axis.factor,
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
        abscissa_quantity=_axis_quantity(quantity, axis),
        file_unit="/".join(filter(None, (above.label, below.label))),
    )


def _axis_quantity(quantity: str, axis: Unit) -> str:
    if quantity != "unknown":
        return quantity
    return {"Hz": "frequency", "s": "time", "rpm": "rpm"}.get(axis.si, "unknown")


def _direction(code: int) -> str:
    if code not in DIRECTIONS:
        raise InputError(f"direction {code} is not a UFF direction (-6 … 6); export it again")
    return DIRECTIONS[code]


def _unless_none(text: str) -> str:
    return "" if text == "NONE" else text


def _unit(
    where: str, quantity: str, label: str, direction: str, scale: tuple[float, float] | None
) -> Unit:
    """Take the unit of one axis from its label and data set 164, which must say the same."""
    label = _unless_none(label)
    known = _SI.get(quantity)
    si, length, force = known["r" in direction.removeprefix("scalar")] if known else ("", 0, 0)
    from_set = None
    if known and scale is not None:
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
        unit = parse_unit(label)
    except InputError:
        return Unit(label, label, 1.0)
    if known and unit.si != si:
        raise InputError(f"{where}: {quantity} is labelled {label!r}, which is no unit of it")
    if from_set is not None and abs(unit.factor / from_set.factor - 1.0) > 1e-6:
        raise InputError(
            f"{where}: the label says {label!r}, but data set 164 states another unit (factor "
            f"{from_set.factor:g} to {si}); export it in SI"
        )
    return unit
