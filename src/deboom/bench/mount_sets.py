"""Mount sets: parts of one drawing that differ from unit to unit, and sets mixed from them."""

from __future__ import annotations

import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from deboom.bench.mount_law import DirectionLaw
from deboom.bench.parameters import VirtualBench
from deboom.bench.suspended_body import SuspendedBody
from deboom.errors import InputError

STIFFNESS_SPREAD = 0.05
"""Standard deviation of a direction's stiffness from unit to unit, cut at three of it [1]."""

LOSS_SPREAD = 0.08
LARGEST_LOSS_CHANGE = 0.20
"""Standard deviation of a direction's losses from unit to unit, and where it is cut [1]."""

DRAWING = "M0"
"""The set without spread: the parts that the virtual platform was measured with."""

MIX = "EnM1-GeM2-TSM3-Du4"
"""A virtual design whose parts all stand in the sets ``M1`` to ``M4``."""

_SET = re.compile(r"M(\d+)")
_UNIT = re.compile(r"([A-Za-z]+)(\d+)")


@dataclass(frozen=True)
class MountSet:
    """Which unit of every mount is on the bench.

    Parameters
    ----------
    name : str
        Such as ``M1`` or ``EnM1-GeM2-TSM3-Du4``.
    units : mapping of str to int
        Mount to the number of its unit; 0 is a part exactly as drawn. Left and right piece of a
        mount are alike.
    """

    name: str
    units: Mapping[str, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))


def mount_names(bench: VirtualBench) -> tuple[str, ...]:
    """Return the names of all mounts, those of the powertrain first."""
    return tuple(m.name for body in (bench.powertrain, bench.wheel_end) for m in body.mounts)


def mount_set(name: str, bench: VirtualBench) -> MountSet:
    """Return the set that a name means.

    Parameters
    ----------
    name : str
        ``M<unit>`` for the same unit number of all mounts, or ``<mount><unit>-…`` for a mix.
    bench : VirtualBench
        Whose mounts they are.

    Raises
    ------
    InputError
        A name of another form, or a mix that does not name every mount once.
    """
    names = mount_names(bench)
    if match := _SET.fullmatch(name):
        return MountSet(name, dict.fromkeys(names, int(match[1])))
    parts = [_UNIT.fullmatch(part) for part in name.split("-")]
    units = {part[1]: int(part[2]) for part in parts if part is not None}
    if len(parts) != len(names) or sorted(units) != sorted(names):
        example = "-".join(f"{mount}{unit}" for unit, mount in enumerate(names, 1))
        raise InputError(f"unknown mount set '{name}': name it M1, M2, … or a mix like {example}")
    return MountSet(name, units)


def with_mount_set(bench: VirtualBench, parts: MountSet) -> VirtualBench:
    """Put a mount set on the bench.

    Parameters
    ----------
    bench : VirtualBench
        With parts as drawn.
    parts : MountSet
        The units to take instead.

    Returns
    -------
    VirtualBench
        The same powertrain and wheel ends on these units.

    Notes
    -----
    A unit depends on its mount and number alone, never on a seed of the measurement: unit 1 of a
    mount is the same part in every campaign and in every mix.
    """
    return replace(
        bench,
        powertrain=_with_units(bench.powertrain, parts),
        wheel_end=_with_units(bench.wheel_end, parts),
    )


def _with_units(body: SuspendedBody, parts: MountSet) -> SuspendedBody:
    mounts = []
    for mount in body.mounts:
        unit = parts.units[mount.name]
        generator = np.random.default_rng([unit, zlib.crc32(mount.name.encode())])
        laws = tuple(_unit_law(law, generator) for law in mount.laws) if unit else mount.laws
        mounts.append(replace(mount, laws=laws))
    return replace(body, mounts=tuple(mounts))


def _unit_law(law: DirectionLaw, generator: np.random.Generator) -> DirectionLaw:
    largest = 3 * STIFFNESS_SPREAD
    change = np.clip(generator.normal(0, STIFFNESS_SPREAD), -largest, largest)
    stiffness = 1 + float(change)
    change = np.clip(generator.normal(0, LOSS_SPREAD), -LARGEST_LOSS_CHANGE, LARGEST_LOSS_CHANGE)
    loss = 1 + float(change)
    return replace(
        law,
        stiffness=stiffness * law.stiffness,
        stages=tuple(replace(stage, stiffness=stiffness * stage.stiffness) for stage in law.stages),
        payne_loss=loss * law.payne_loss,
        fractional_weight=loss * law.fractional_weight,
    )
