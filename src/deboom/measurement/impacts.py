"""Where a hammer or a shaker pushes: one force channel of known position and direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError

UNIT_LENGTH_TOLERANCE = 1e-3
"""How far the length of a direction may be from 1: what the rounding in a table does."""


@dataclass(frozen=True, eq=False)
class Impact:
    """One point of excitation; its channel has the same name.

    Parameters
    ----------
    name : str
        Such as ``I07``.
    position : array, shape (3,)
        In vehicle axes, from the origin of the position sheet [m].
    direction : array, shape (3,)
        Unit vector along which a positive force pushes [1].

    Raises
    ------
    InputError
        Not three finite numbers, or a direction that is not of length 1.
    """

    name: str
    position: RealArray
    direction: RealArray

    def __post_init__(self) -> None:
        for name in ("position", "direction"):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != (3,) or not np.all(np.isfinite(array)):
                raise InputError(f"impact {self.name}: {name} needs three finite numbers")
            object.__setattr__(self, name, array)
        length = float(np.linalg.norm(self.direction))
        if abs(length - 1.0) > UNIT_LENGTH_TOLERANCE:
            raise InputError(
                f"impact {self.name}: its direction has length {length:.4g}, state a unit vector"
            )
        object.__setattr__(self, "direction", self.direction / length)
        for name in ("position", "direction"):
            getattr(self, name).setflags(write=False)
