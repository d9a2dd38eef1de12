"""Text, numbers and arrays that can be kept and given back unchanged."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.mounts.named_arrays import NamedArrays

Setting = str | int | float | bool | None
LONGEST_TEXT = 255
"""Characters that a name or a description may have."""


def check_text(what: str, text: str, needed: bool) -> None:
    """Refuse text that a database or a table could not hold.

    Raises
    ------
    InputError
        Empty where `needed`, longer than `LONGEST_TEXT`, or with control characters.
    """
    if (needed and not text) or len(text) > LONGEST_TEXT or not text.isprintable():
        raise InputError(
            f"{what} {text!r} cannot be kept: use {int(needed)} to {LONGEST_TEXT} printable "
            "characters"
        )


def finite_number(owner: str, name: str, value: float) -> float:
    """Return a plain finite number.

    Raises
    ------
    InputError
        It is not finite.
    """
    number = float(value)
    if not math.isfinite(number):
        raise InputError(f"{owner}: {name} is {number}; leave out what is not known")
    return number


def plain_setting(owner: str, name: str, value: object) -> Setting:
    """Return a setting as the plain value that text files and databases keep.

    Raises
    ------
    InputError
        It is neither text nor a finite number, bool or None.
    """
    plain = value.item() if isinstance(value, np.generic) else value
    if not (plain is None or isinstance(plain, str | int | float)):
        raise InputError(f"surface {owner}: setting {name} is of {type(value).__name__}, not plain")
    return finite_number(f"surface {owner}", name, plain) if isinstance(plain, float) else plain


def numbers_with_units(owner: str, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return finite numbers whose names end with their unit.

    Raises
    ------
    InputError
        A name without ``[unit]``, a number that is not finite.
    """
    for name in numbers:
        if not (name.endswith("]") and " [" in name):
            raise InputError(f"{owner}: {name!r} lacks its unit; write it as in 'position [m]'")
    return {name: finite_number(owner, name, value) for name, value in numbers.items()}


def freeze_finite(value: object, name: str, dtype: type[np.generic]) -> None:
    """Replace a field of a frozen dataclass by a read-only copy.

    Raises
    ------
    InputError
        A value that is not finite.
    """
    array = np.array(getattr(value, name), dtype=dtype)
    if not np.all(np.isfinite(array)):
        raise InputError(f"{type(value).__name__}: {name} holds a value that is not finite")
    array.setflags(write=False)
    object.__setattr__(value, name, array)


def frozen_arrays(owner: str, arrays: Mapping[str, npt.NDArray[Any]]) -> NamedArrays:
    """Return read-only copies of named arrays.

    Raises
    ------
    InputError
        An array of Python objects.
    """
    frozen = {name: np.array(array) for name, array in arrays.items()}
    for name, array in frozen.items():
        if array.dtype.kind not in "biufcU":
            raise InputError(f"surface {owner}: array {name} is of {array.dtype}, not of numbers")
        array.setflags(write=False)
    return frozen
