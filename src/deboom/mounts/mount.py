"""What a mount is: where it sits, of how many pieces, and through which axes it transmits."""

from __future__ import annotations

import math
from dataclasses import dataclass

from deboom.errors import InputError

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Mount:
    """One mount of the platform.

    Parameters
    ----------
    name : str
        Such as ``TSM``.
    description : str
        In words, for the report.
    pieces : tuple of str
        Names of the pieces that share the part number, such as ``("left", "right")``; one piece
        has the name ``""``.
    positions : tuple of (x, y, z)
        Virtual point of each piece in vehicle axes, from the powertrain's centre of gravity [m].
    transfer_axes : tuple of str
        Axes whose force reaches the cabin. The other axes stay design variables without effect.
    body_mass : float, optional
        Mass of the body that each piece carries where that is not the powertrain, such as the
        wheel end on a wishbone mount [kg]; None for a powertrain mount.
    body_mass_tolerance : float
        Half width of the body mass [kg].

    Raises
    ------
    InputError
        Unknown axes, not one position per piece, or a body mass that is no mass.
    """

    name: str
    description: str
    pieces: tuple[str, ...]
    positions: tuple[tuple[float, float, float], ...]
    transfer_axes: tuple[str, ...]
    body_mass: float | None = None
    body_mass_tolerance: float = 0.0

    def __post_init__(self) -> None:
        unknown = [axis for axis in self.transfer_axes if axis not in AXES]
        if unknown:
            raise InputError(f"mount {self.name}: unknown axes {unknown}, use {list(AXES)}")
        if len(self.positions) != len(self.pieces):
            raise InputError(
                f"mount {self.name}: {len(self.positions)} positions for {len(self.pieces)} pieces"
            )
        tolerance = self.body_mass_tolerance
        if self.body_mass is None and tolerance != 0.0:
            raise InputError(f"mount {self.name}: a body mass tolerance without a body mass")
        if self.body_mass is not None and not 0.0 <= tolerance < self.body_mass < math.inf:
            raise InputError(
                f"mount {self.name}: a body of {self.body_mass} ± {tolerance} kg: give a mass "
                "above 0 and a smaller tolerance of at least 0"
            )

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the design variables, ``<mount> <axis>`` for all three axes."""
        return tuple(f"{self.name} {axis}" for axis in AXES)

    @property
    def paths(self) -> tuple[str, ...]:
        """Names of the paths into the body, ``<mount> <axis>`` for the transfer axes."""
        return tuple(f"{self.name} {axis}" for axis in self.transfer_axes)

    def channels(self, axis: str) -> tuple[str, ...]:
        """Names of the channels measured along one axis, one per piece."""
        return tuple(" ".join(filter(None, (self.name, piece, axis))) for piece in self.pieces)
