"""The array type of this room, and how a value object keeps its arrays."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

RealArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
_T = TypeVar("_T", bound=np.generic)


def frozen_copy(array: npt.NDArray[_T]) -> npt.NDArray[_T]:
    """Return a read-only copy; freezing in place would freeze the caller's array."""
    copy = array.copy()
    copy.setflags(write=False)
    return copy
