"""Frozen dataclasses that own their arrays."""

from __future__ import annotations

from dataclasses import Field, fields
from typing import Any, ClassVar, Protocol

import numpy as np


class _Dataclass(Protocol):
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


def freeze_arrays(value: _Dataclass) -> None:
    """Replace the array fields of a frozen dataclass with read-only copies.

    For its ``__post_init__``. The copy comes first: freezing in place would freeze the caller's
    array.
    """
    for field in fields(value):
        item = getattr(value, field.name)
        if isinstance(item, np.ndarray):
            copy = item.copy()
            copy.setflags(write=False)
            object.__setattr__(value, field.name, copy)
