"""Frozen dataclasses of numbers as named arrays and back, for files and databases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    D = TypeVar("D", bound=DataclassInstance)

NamedArrays = dict[str, npt.NDArray[Any]]


def to_arrays(value: DataclassInstance, prefix: str = "") -> NamedArrays:
    """Every constructor argument of a dataclass as an array named `prefix` + field."""
    return {
        prefix + field.name: np.asarray(getattr(value, field.name))
        for field in fields(value)
        if field.init
    }


def from_arrays(kind: type[D], arrays: Mapping[str, npt.NDArray[Any]], prefix: str = "") -> D:
    """Build a dataclass from the arrays of `to_arrays`.

    Parameters
    ----------
    kind : type
        A dataclass whose constructor takes arrays, scalars as arrays without dimension.
    arrays : mapping of str to array
        Others than those of `kind` are left alone.
    prefix : str
        Before each name.

    Returns
    -------
    object of `kind`

    Raises
    ------
    InputError
        An array is missing; named.
    """
    names = [field.name for field in fields(kind) if field.init]
    missing = [prefix + name for name in names if prefix + name not in arrays]
    if missing:
        raise InputError(f"a stored {kind.__name__} lacks the arrays {missing}: store it again")
    return kind(**{name: arrays[prefix + name] for name in names})


def freeze(value: DataclassInstance, *names: str) -> None:
    """Replace the named fields of a frozen dataclass by read-only float copies."""
    for name in names:
        array = np.array(getattr(value, name), dtype=float)
        array.setflags(write=False)
        object.__setattr__(value, name, array)
