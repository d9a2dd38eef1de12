"""Which number of a design is the stiffness or the place of which mount."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.inertance_test import CompressorMount

AXES = ("axial", "radial", "radial")
"""Of the three stiffnesses of a round mount, as part numbers know them."""
COORDINATES = ("x", "y", "z")
DATUM = 100.0
"""A mount that stands where it is drawn has this coordinate: places are counted from a plane so far
before it, so that a tolerance can be a fraction of them [mm]."""
MILLI = 1e-3


@dataclass(frozen=True, eq=False)
class MountVariables:
    """Columns of a design of m mounts.

    Parameters
    ----------
    names, units : tuple of str, length k
    scaled : bool array, shape (k, 3 m)
        Stiffnesses (axial and two radial of each mount) that each variable multiplies.
    moved : bool array, shape (k, 3 m)
        Coordinates (x, y, z of each mount) that each variable is; at most one of each.

    Raises
    ------
    InputError
        Not one row per variable, doubled names, a variable of no or of both kinds, a coordinate
        with two variables.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    scaled: npt.NDArray[np.bool_]
    moved: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        count = len(self.names)
        if len(set(self.names)) < count or len(self.units) != count:
            raise InputError(f"the variables {list(self.names)} need a name and a unit each")
        for name in ("scaled", "moved"):
            mask = np.array(getattr(self, name), dtype=bool)
            if mask.ndim != 2 or len(mask) != count or mask.shape[1] % 3:
                raise InputError(
                    f"'{name}' of {count} variables has shape {mask.shape}: give one row per "
                    "variable and three columns per mount"
                )
            mask.setflags(write=False)
            object.__setattr__(self, name, mask)
        does = np.stack([self.scaled.any(axis=1), self.moved.any(axis=1)])
        if self.scaled.shape != self.moved.shape or not np.all(does.sum(axis=0) == 1):
            raise InputError("a variable either multiplies stiffnesses or is a coordinate")
        if np.any(self.moved.sum(axis=0) > 1) or np.any(self.moved.sum(axis=1) > 1):
            raise InputError("a coordinate has one variable, and a variable one coordinate")

    @property
    def places(self) -> npt.NDArray[np.intp]:
        """Columns of a design that are coordinates, shape (n_place,)."""
        return np.flatnonzero(self.moved.any(axis=1))

    @property
    def coordinates(self) -> npt.NDArray[np.intp]:
        """Which of the 3 m coordinates these are, shape (n_place,)."""
        return np.asarray(np.argmax(self.moved[self.places], axis=1), dtype=np.intp)

    def factors(self, designs: RealArray) -> RealArray:
        """Return the factor on every stiffness, (n, k) → (n, 3 m) [1]."""
        return np.asarray(np.where(self.scaled, designs[:, :, np.newaxis], 1.0).prod(axis=1))

    def offsets(self, designs: RealArray) -> RealArray:
        """Return how far mounts stand off along `coordinates`, (n, k) → (n, n_place) [m]."""
        return np.asarray(MILLI * (designs[:, self.places] - DATUM))

    def checked(self, designs: npt.ArrayLike) -> RealArray:
        """Return the designs as a finite array of shape (n, k), stiffness factors above 0.

        Raises
        ------
        InputError
            Anything else.
        """
        array = np.asarray(designs, dtype=float)
        if array.ndim != 2 or array.shape[1] != len(self.names):
            raise InputError(
                f"designs have shape {array.shape}, expected (n, {len(self.names)}) with the "
                f"columns {list(self.names)}"
            )
        if not np.all(np.isfinite(array)):
            raise InputError("a design has a number that is not finite")
        if not np.all(array[:, self.scaled.any(axis=1)] > 0):
            raise InputError("a design has a stiffness factor that is not positive")
        return array


@dataclass
class _Rows:
    """Variables as they are put together."""

    n_mounts: int
    names: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    scaled: list[npt.NDArray[np.bool_]] = field(default_factory=list)
    moved: list[npt.NDArray[np.bool_]] = field(default_factory=list)

    def add(self, name: str, unit: str, *, scaled: Sequence[int] = (), moved: int = -1) -> None:
        self.names.append(name)
        self.units.append(unit)
        columns = np.arange(3 * self.n_mounts)
        self.scaled.append(np.isin(columns, scaled))
        self.moved.append(columns == moved)

    def variables(self) -> MountVariables:
        return MountVariables(
            tuple(self.names), tuple(self.units), np.array(self.scaled), np.array(self.moved)
        )


def mount_variables(
    mounts: Sequence[CompressorMount], *, identical: bool, pieces: bool, places: bool
) -> MountVariables:
    """Return the variables of round mounts: axial and radial stiffness factors, and places.

    Parameters
    ----------
    mounts : sequence of CompressorMount
        At least one.
    identical : bool
        One part number for all: the factors ``mounts axial`` and ``mounts radial`` are common.
        Otherwise every mount has its own, ``mount 1 axial`` ….
    pieces : bool
        With identical mounts, one more factor per mount and axis, ``mount 1 axial piece`` …: what
        pieces of one part number differ by.
    places : bool
        Coordinates of every mount, ``mount 1 x`` … [mm], counted from `DATUM`.

    Returns
    -------
    MountVariables
    """
    rows = _Rows(len(mounts))
    axes = list(dict.fromkeys(AXES))
    columns = {
        (number, axis): [3 * number + place for place, name in enumerate(AXES) if name == axis]
        for number in range(len(mounts))
        for axis in axes
    }
    if identical:
        for axis in axes:
            both = [column for (_, name), own in columns.items() if name == axis for column in own]
            rows.add(f"mounts {axis}", "1", scaled=both)
    if pieces or not identical:
        for (number, axis), own in columns.items():
            name = f"{mounts[number].name} {axis}"
            rows.add(f"{name} piece" if identical else name, "1", scaled=own)
    if places:
        for number, mount in enumerate(mounts):
            for place, coordinate in enumerate(COORDINATES):
                rows.add(f"{mount.name} {coordinate}", "mm", moved=3 * number + place)
    return rows.variables()
