"""Names that every package shares: axes, degrees of freedom, scales of units, progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

AXES: tuple[Literal["x"], Literal["y"], Literal["z"]] = ("x", "y", "z")
"""Axes of a vehicle, a mount or a sensor, in the order of every array."""
DOFS = (*AXES, "rx", "ry", "rz")
"""Degrees of freedom of a rigid body, in the order of every matrix."""

PERCENT = 100.0
"""From a share to per cent."""
N_PER_MM = 1e-3
"""From N/m to N/mm."""

CONFIDENCE = 0.95
"""Confidence of an interval that a page shows [1]."""

Progress = Callable[[int, int, str], None]
"""Called after each step with its number, the number of steps, and a line of text."""
