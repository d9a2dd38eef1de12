"""A characterised mount: everything that the mount library keeps of one part."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import numpy as np
import numpy.typing as npt

from deboom.arrays import AXES, ComplexArray, RealArray, checked, frozen_copy, short_repr
from deboom.errors import InputError
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.mount import Mount
from deboom.mounts.response_surface import DynamicStiffnessSurface

Setting = str | int | float | bool | None
FORCE_PER_TORQUE = "static force per wheel torque [N/(N m)]"
"""Setting of a surface: static force of one piece per wheel torque, over all lines of its runs."""
ASSUMED = "assumed"
"""Setting of a surface that rests on defaults nobody stated: which ones, in words."""
LONGEST_TEXT = 255
"""Characters that a name or a description may have."""


@checked(
    preload="n",
    wheel_torque="n",
    amplitude="n",
    frequency="n",
    dynamic_stiffness="n",
    confidence="n",
)
class MapPoints:
    """Measured dynamic stiffness of one direction, point by point; arrays (n,).

    Static force in the direction [N], wheel torque [N m], peak displacement at the virtual point
    [m], frequency [Hz], complex ``f / s`` [N/m], confidence from 0 (masked: not to be used) to 1
    [1], and the run of each point, with the piece where a mount has several.

    - raises InputError: unequal lengths, a value that is not finite, a confidence outside of 0 … 1.
    """

    preload: RealArray
    wheel_torque: RealArray
    amplitude: RealArray
    frequency: RealArray
    dynamic_stiffness: ComplexArray
    confidence: RealArray
    run: npt.NDArray[np.str_]

    def __post_init__(self) -> None:
        runs = np.array([str(run) for run in self.run], dtype=np.str_)
        object.__setattr__(self, "run", frozen_copy(runs))
        if len(runs) != len(self):
            raise InputError(f"map points: {len(runs)} runs for {len(self)} points, one each")
        if np.any((self.confidence < 0) | (self.confidence > 1)):
            raise InputError("map points: a confidence lies between 0 and 1")

    def __len__(self) -> int:
        return self.frequency.size

    @classmethod
    def none(cls) -> MapPoints:
        """Return no points at all, as of a mount that was never loaded."""
        empty = np.zeros(0)
        return cls(empty, empty, empty, empty, empty.astype(complex), empty, empty.astype(str))


@dataclass(frozen=True)
class DirectionQuality:
    """How far the stiffness of one direction may be believed; None is not known.

    `identified` is False where the error budget leaves the direction unknown; `half_width_95` is
    the half width of the 95 % band of K, relative to |K|; R² of the surface for Re K, Im K and the
    force [1]. InputError: a number that is not finite.
    """

    identified: bool
    half_width_95: float | None = None
    r2_real: float | None = None
    r2_imag: float | None = None
    r2_force: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "identified", bool(self.identified))
        for name in (item.name for item in fields(self)[1:]):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _finite("quality", name, value))


@dataclass(frozen=True, eq=False)
class CharacterisedDirection:
    """One direction of a characterised mount.

    Without map points where the mount was never loaded along it, without a surface where none could
    be fitted; the static curve is the supplier's, `settings` are those of the fit.

    - raises InputError: an unknown axis; identified, and yet without a surface.
    """

    axis: str
    map_points: MapPoints
    quality: DirectionQuality
    surface: DynamicStiffnessSurface | None = None
    static_curve: StaticCurve | None = None
    settings: Mapping[str, Setting] = field(default_factory=dict)

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.axis not in AXES:
            raise InputError(f"unknown axis {self.axis!r}, use {', '.join(AXES)}")
        if self.quality.identified and self.surface is None:
            raise InputError(f"direction {self.axis} is identified, but it has no surface")


@dataclass(frozen=True)
class CampaignRecord:
    """Measurement campaign that mounts were characterised from.

    A short name, unique in a library, the engine order of its spectra, the names of its runs,
    assumptions of the error budget about the bench (1 σ, ``name [unit]``, SI), a hash of every
    file that was read, and the temperature of the mounts [°C], None where it is not stated.

    - raises InputError: no name, a number that is not finite, a tolerance that lacks its unit.
    """

    name: str
    order: float
    runs: tuple[str, ...]
    tolerances: Mapping[str, float]
    inputs_sha256: Mapping[str, str]
    test_temperature: float | None = None

    def __post_init__(self) -> None:
        _check_text("campaign", self.name, needed=True)
        owner = f"campaign {self.name}"
        object.__setattr__(self, "order", _finite(owner, "order", self.order))
        object.__setattr__(self, "runs", tuple(self.runs))
        object.__setattr__(self, "tolerances", _with_units(owner, self.tolerances))
        object.__setattr__(self, "inputs_sha256", dict(self.inputs_sha256))


@dataclass(frozen=True, order=True)
class MountIdentity:
    """Which part was characterised, and from what.

    Campaign, name of the mount in the vehicle and mount set or design level (`variant`) are needed;
    labels of the part may be unknown, ``""``.

    - raises InputError: campaign, mount or variant is empty; any is not printable or too long.
    """

    campaign: str
    mount: str
    variant: str
    part_number: str = ""
    supplier: str = ""
    serial: str = ""

    def __post_init__(self) -> None:
        for name in (item.name for item in fields(self)):
            needed = name in ("campaign", "mount", "variant")
            _check_text(name, getattr(self, name), needed)

    def __str__(self) -> str:
        entries = {
            "part number": self.part_number,
            "supplier": self.supplier,
            "serial": self.serial,
        }
        details = "".join(f", {name} {value}" for name, value in entries.items() if value)
        return f"{self.mount} {self.variant} of campaign {self.campaign}{details}"


@dataclass(frozen=True, eq=False)
class CharacterisedMount:
    """One part, characterised: the mount library takes it and gives it back unchanged.

    Which part it is, its geometry on the bench, at least one direction, each axis once, and numbers
    of the whole mount as ``name [unit]``, such as the condition number of its force transfer
    matrix.

    - raises InputError: an axis twice; no axis; a text that cannot be kept; a quality without unit.
    """

    identity: MountIdentity
    mount: Mount
    directions: tuple[CharacterisedDirection, ...]
    quality: Mapping[str, float]

    __repr__ = short_repr

    def __post_init__(self) -> None:
        owner = str(self.identity)
        object.__setattr__(self, "directions", tuple(self.directions))
        object.__setattr__(self, "quality", _with_units(owner, self.quality))
        for text in (self.mount.name, self.mount.description, *self.mount.pieces):
            _check_text(f"{owner}: text", text, needed=False)
        axes = [direction.axis for direction in self.directions]
        if not axes or len(set(axes)) < len(axes):
            raise InputError(f"{owner}: it needs every axis once, it has {axes}")

    def direction(self, axis: str) -> CharacterisedDirection:
        """Return one direction.

        - raises InputError: the mount was not characterised along this axis.
        """
        direction = self.find(axis)
        if direction is None:
            axes = ", ".join(direction.axis for direction in self.directions)
            raise InputError(f"{self.identity}: it has no direction {axis!r}, use {axes}")
        return direction

    def find(self, axis: str) -> CharacterisedDirection | None:
        """Return one direction, None if the mount was not characterised along it."""
        return next((d for d in self.directions if d.axis == axis), None)


def _check_text(what: str, text: str, needed: bool) -> None:
    """Refuse text that a database or a table could not hold."""
    plain = isinstance(text, str) and len(text) <= LONGEST_TEXT and text.isprintable()
    if (needed and not text) or not plain:
        raise InputError(
            f"{what} {text!r} cannot be kept: use {int(needed)} to {LONGEST_TEXT} printable "
            "characters"
        )


def _finite(owner: str, name: str, value: float) -> float:
    """Return a plain finite number, or refuse it."""
    number = float(value)
    if not math.isfinite(number):
        raise InputError(f"{owner}: {name} is {number}; leave out what is not known")
    return number


def _with_units(owner: str, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return finite numbers whose names end with their unit."""
    for name in numbers:
        if not (name.endswith("]") and " [" in name):
            raise InputError(f"{owner}: {name!r} lacks its unit; write it as in 'position [m]'")
    return {name: _finite(owner, name, value) for name, value in numbers.items()}
