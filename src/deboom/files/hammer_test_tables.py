"""What a folder of an impact test says in words: its file of facts and its two tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.platform_file import NotNegative, Positive, RelativePath
from deboom.files.strict_toml import StrictModel
from deboom.files.table_cells import Row, read_rows, refuse_second
from deboom.files.uff_function import DIRECTIONS
from deboom.files.units import Unit, parse_unit

HAMMER_TEST_FILE = "hammer_test.toml"
HAMMER_QUANTITIES = {
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "displacement": "m",
    "pressure": "Pa",
    "force": "N",
}
"""What a response may be, as the UFF ordinate says it, and its SI unit."""

_AXES = ("x", "y", "z")
_DIRECTION = ("dx", "dy", "dz")


class HammerTestFile(StrictModel):
    """The whole file ``hammer_test.toml``."""

    format: Literal[1]
    """Version of this format."""
    title: str
    """What a reader calls the test."""
    sample_rate_hz: Positive
    """Of every block; UFF itself keeps six digits of its inverse."""
    pretrigger_s: NotNegative
    """From the first sample to the trigger."""
    force_range_n: Positive | None = None
    """Largest force that the hammer's channel can hold; left out where it is not known."""
    impact_table: RelativePath
    """CSV: where the hammer struck, and the UFF file of its hits."""
    channel_table: RelativePath
    """CSV: which UFF node and direction is which response."""
    sensor_table: RelativePath | None = None
    """CSV: position sheet of triaxial sensors; left out where there is none."""


@dataclass(frozen=True)
class HammerPoint:
    """One point that was struck.

    Parameters
    ----------
    impact : str
        Name, such as ``I07`` or ``EnM x``.
    node : int
        UFF node of the force.
    file : str
        UFF file of its hits, relative to the folder.
    position : (x, y, z)
        [m].
    direction : (dx, dy, dz)
        Unit vector along which a positive force pushes [1].
    """

    impact: str
    node: int
    file: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]

    @property
    def uff_direction(self) -> str:
        """``+x`` … ``-z`` along an axis of the vehicle, else ``scalar``."""
        for axis, component in zip(_AXES, self.direction, strict=True):
            if abs(component) > 1.0 - 1e-6:
                return f"{'+' if component > 0 else '-'}{axis}"
        return "scalar"


@dataclass(frozen=True)
class HammerChannel:
    """One response and the UFF DoF that holds it.

    Parameters
    ----------
    channel : str
        Name, such as ``A1 x`` or ``driver ear``.
    quantity : str
        One of `HAMMER_QUANTITIES`.
    node : int
        Response node.
    direction : str
        ``+x`` … ``-z`` or ``scalar``; one against the axis in the name turns the sign.
    unit : Unit
        As the table states it.
    range : float
        Largest value that the channel can hold, in SI; infinite where it is not known.
    """

    channel: str
    quantity: str
    node: int
    direction: str
    unit: Unit
    range: float = math.inf

    @property
    def sign(self) -> float:
        """−1 for a channel recorded against its axis, else +1."""
        return -1.0 if self.direction.startswith("-") else 1.0


def read_hammer_points(path: Path) -> tuple[HammerPoint, ...]:
    """Read the table ``impact, node, file, x [mm], y [mm], z [mm], dx, dy, dz``.

    Raises
    ------
    InputError
        No such table; a column or a unit is missing; a name, file or DoF comes twice; no number.
    """
    seen: dict[str, int] = {}
    points = []
    columns = ("impact", "node", "file", *_DIRECTION)
    for row in read_rows(path, columns, dict.fromkeys(_AXES, "m")):
        x, y, z = (row.number(axis) for axis in _AXES)
        dx, dy, dz = (row.number(axis) for axis in _DIRECTION)
        point = HammerPoint(
            row.filled("impact"), row.node(), row.filled("file"), (x, y, z), (dx, dy, dz)
        )
        parts = Path(point.file)
        if parts.is_absolute() or ".." in parts.parts:
            raise row.error(f"file '{point.file}' is not inside the folder: copy it there")
        pushed = f"node {point.node} along {point.direction}"
        for key in (f"impact '{point.impact}'", pushed, f"file '{point.file}'"):
            refuse_second(seen, key, row)
        points.append(point)
    return tuple(points)


def write_hammer_points(path: Path, points: Sequence[HammerPoint]) -> None:
    """Write the table that `read_hammer_points` reads, in metres.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    table = pd.DataFrame(
        [(p.impact, p.node, p.file, *p.position, *p.direction) for p in points],
        columns=["impact", "node", "file", *(f"{axis} [m]" for axis in _AXES), *_DIRECTION],
    )
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))


def read_hammer_channels(path: Path) -> tuple[HammerChannel, ...]:
    """Read the table ``channel, quantity, node, direction, unit, range``.

    The range is in the unit of its row; empty, it is not known.

    Raises
    ------
    InputError
        No such table; a channel or a DoF comes twice; a quantity, direction, unit or range that
        makes no sense.
    """
    seen: dict[str, int] = {}
    channels = []
    columns = ("channel", "quantity", "node", "direction", "unit", "range")
    for row in read_rows(path, columns, {}):
        channel = _channel(row)
        refuse_second(seen, f"channel '{channel.channel}'", row)
        axis = channel.direction.lstrip("+-")
        refuse_second(seen, f"{channel.quantity} at node {channel.node} along {axis}", row)
        channels.append(channel)
    return tuple(channels)


def write_hammer_channels(path: Path, channels: Sequence[HammerChannel]) -> None:
    """Write the table that `read_hammer_channels` reads.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    table = pd.DataFrame(
        [
            (
                *(c.channel, c.quantity, c.node, c.direction, c.unit.label),
                "" if math.isinf(c.range) else repr(c.range / c.unit.factor),
            )
            for c in channels
        ],
        columns=["channel", "quantity", "node", "direction", "unit", "range"],
    )
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))


def check_force_direction(point: HammerPoint, direction: str) -> None:
    """Compare the UFF direction of a recorded force with the table.

    Raises
    ------
    InputError
        They are more than 25° apart: two axes, or a sign, are mixed up.
    """
    if direction == "scalar":
        return
    axis = np.zeros(3)
    axis[_AXES.index(direction[-1])] = -1.0 if direction.startswith("-") else 1.0
    if not axis @ np.array(point.direction) > np.cos(np.deg2rad(25.0)):
        raise InputError(
            f"the force is recorded along {direction}, the table says {point.direction}: correct "
            "the wrong one"
        )


def _channel(row: Row) -> HammerChannel:
    name, quantity = row.filled("channel"), row.filled("quantity")
    if quantity not in HAMMER_QUANTITIES:
        raise row.error(f"unknown quantity '{quantity}', use {', '.join(HAMMER_QUANTITIES)}")
    direction, axis = row.cells["direction"], name.rpartition(" ")[2]
    if direction not in DIRECTIONS.values():
        raise row.error(
            f"channel '{name}' has direction '{direction}', which is none: use "
            f"{', '.join(DIRECTIONS.values())}"
        )
    if axis in _AXES and quantity != "pressure" and direction not in (f"+{axis}", f"-{axis}"):
        raise row.error(
            f"{quantity} '{name}' has direction '{direction}', which is not along '{axis}': two "
            "axes may be swapped; correct the name or the direction"
        )
    try:
        unit = parse_unit(row.cells["unit"])
    except InputError as error:
        raise row.error(f"{quantity} '{name}': {error}") from None
    if unit.si != HAMMER_QUANTITIES[quantity]:
        raise row.error(
            f"{quantity} '{name}' is in '{unit.label}', which is no unit of it: use "
            f"{HAMMER_QUANTITIES[quantity]} or a multiple"
        )
    limit = math.inf
    if row.cells["range"]:
        limit = row.number("range") * unit.factor
        if not limit > 0:
            raise row.error(f"channel '{name}': a range is positive; leave it empty if unknown")
    return HammerChannel(name, quantity, row.node(), direction, unit, limit)
