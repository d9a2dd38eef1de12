"""A characterised mount: everything the library keeps of one part, and nothing that it computes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

from deboom.errors import InputError
from deboom.mounts.characterised_direction import CharacterisedDirection
from deboom.mounts.mount import Mount
from deboom.mounts.stored_values import check_text, finite_number, numbers_with_units


@dataclass(frozen=True)
class CampaignRecord:
    """The measurement campaign that mounts were characterised from.

    Parameters
    ----------
    name : str
        Short key, unique in a library.
    order : float
        Engine order of its spectra [1].
    runs : tuple of str
        Names of its operating runs.
    tolerances : mapping of str to float
        What the error budget assumed of the bench, 1 σ, as ``name [unit]``, SI.
    inputs_sha256 : mapping of str to str
        Hash of every file that was read.

    Raises
    ------
    InputError
        No name, a tolerance that is not finite or lacks its unit.
    """

    name: str
    order: float
    runs: tuple[str, ...]
    tolerances: Mapping[str, float]
    inputs_sha256: Mapping[str, str]

    def __post_init__(self) -> None:
        check_text("campaign", self.name, needed=True)
        owner = f"campaign {self.name}"
        object.__setattr__(self, "order", finite_number(owner, "order", self.order))
        object.__setattr__(self, "runs", tuple(self.runs))
        object.__setattr__(self, "tolerances", numbers_with_units(owner, self.tolerances))
        object.__setattr__(self, "inputs_sha256", dict(self.inputs_sha256))


@dataclass(frozen=True, order=True)
class MountIdentity:
    """Which part was characterised, and from what.

    Parameters
    ----------
    campaign : str
        Name of its `CampaignRecord`.
    mount : str
        Where it sits: name of the mount in the vehicle, such as ``TSM``.
    variant : str
        Mount set or design level, such as ``M3``.
    part_number, supplier, serial : str
        Of the part; ``""`` is unknown.

    Raises
    ------
    InputError
        Campaign, mount or variant is empty; a control character in any of them.
    """

    campaign: str
    mount: str
    variant: str
    part_number: str = ""
    supplier: str = ""
    serial: str = ""

    def __post_init__(self) -> None:
        for field in fields(self):
            needed = field.name in ("campaign", "mount", "variant")
            check_text(field.name, getattr(self, field.name), needed)

    def __str__(self) -> str:
        known = {"part number": self.part_number, "supplier": self.supplier, "serial": self.serial}
        details = "".join(f", {name} {value}" for name, value in known.items() if value)
        return f"{self.mount} {self.variant} of campaign {self.campaign}{details}"


@dataclass(frozen=True, eq=False)
class CharacterisedMount:
    """One part, characterised: what the mount library takes and gives back unchanged.

    Parameters
    ----------
    identity : MountIdentity
        Which part, from which campaign.
    mount : Mount
        Pieces, virtual points and transfer axes on the bench.
    directions : tuple of CharacterisedDirection
        At least one, each axis once.
    quality : mapping of str to float
        Numbers of the whole mount as ``name [unit]``, such as the condition number of its force
        transfer matrix.

    Raises
    ------
    InputError
        Another mount in identity, mount and static curves; an axis twice; no axis at all.
    """

    identity: MountIdentity
    mount: Mount
    directions: tuple[CharacterisedDirection, ...]
    quality: Mapping[str, float]

    def __post_init__(self) -> None:
        owner = str(self.identity)
        object.__setattr__(self, "directions", tuple(self.directions))
        object.__setattr__(self, "quality", numbers_with_units(owner, self.quality))
        for text in (self.mount.name, self.mount.description, *self.mount.pieces):
            check_text(f"{owner}: text", text, needed=False)
        if self.mount.name != self.identity.mount:
            raise InputError(f"{owner}: its geometry is that of mount {self.mount.name}")
        axes = [direction.axis for direction in self.directions]
        if not axes or len(set(axes)) < len(axes):
            raise InputError(f"{owner}: it needs every axis once, it has {axes}")
        for direction in self.directions:
            curve = direction.static_curve
            if curve is not None and (curve.mount, curve.axis) != (self.mount.name, direction.axis):
                raise InputError(
                    f"{owner}: direction {direction.axis} has the static curve of {curve.mount} "
                    f"{curve.axis}"
                )

    def direction(self, axis: str) -> CharacterisedDirection:
        """Return one direction.

        Raises
        ------
        InputError
            The mount was not characterised along this axis.
        """
        for direction in self.directions:
            if direction.axis == axis:
                return direction
        there = ", ".join(direction.axis for direction in self.directions)
        raise InputError(f"{self.identity}: it has no direction {axis!r}, use {there}")
