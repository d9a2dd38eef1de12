"""The two tables of a platform: where the mounts sit, and which UFF DoF is which channel.

CSV (comma-separated UTF-8 text) or the first sheet of an xlsx file, with one header line. A length
carries its unit in the header (``x [mm]``); a channel carries it in its row.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.faults import Note, noting, refuse
from deboom.files.table_cells import Row, read_rows
from deboom.files.uff_function import DIRECTIONS
from deboom.files.units import Unit, parse_unit

NOISE_TRANSFER = "noise transfer function"
QUANTITY_UNIT = {"displacement": "m", "force": "N", NOISE_TRANSFER: "Pa/N"}
"""Quantities of the channel table and their SI units."""

_AXES = ("x", "y", "z")
_CHANNEL_COLUMNS = ("channel", "quantity", "mount", "piece", "axis", "node", "direction", "unit")


@dataclass(frozen=True)
class MountRow:
    """Position of one piece of a mount.

    Parameters
    ----------
    mount, piece : str
        Names; the piece of a single one is ``""``.
    position : (x, y, z)
        Virtual point in vehicle axes, from the powertrain's centre of gravity [m].
    """

    mount: str
    piece: str
    position: tuple[float, float, float]


@dataclass(frozen=True)
class ChannelRow:
    """One measured channel and the UFF DoF that holds it.

    Parameters
    ----------
    channel : str
        ``<mount> [<piece>] <axis>``, such as ``Du left x``.
    quantity : str
        One of `QUANTITY_UNIT`.
    mount, piece, axis : str
        What the name is made of; noise transfer functions have no piece.
    node : int
        Response node; of a noise transfer function, the reference node.
    direction : str
        ``+x`` … ``-z``, along the axis; a negative one turns the sign of the channel.
    unit : Unit
        As the table states it.
    """

    channel: str
    quantity: str
    mount: str
    piece: str
    axis: str
    node: int
    direction: str
    unit: Unit

    @property
    def sign(self) -> float:
        """−1 for a channel measured against its axis, else +1."""
        return -1.0 if self.direction.startswith("-") else 1.0


def read_mount_table(path: Path, note: Note = refuse) -> tuple[MountRow, ...]:
    """Read the table ``mount, piece, x [unit], y [unit], z [unit]``.

    Parameters
    ----------
    path : Path
        CSV or xlsx.
    note : callable
        Gets every fault; by default the first one is raised. A number at fault is nan.

    Raises
    ------
    InputError
        The file is missing or no table; a column is missing, unknown, or a length without a unit;
        an entry is no finite number; a piece comes twice.
    """
    rows = read_rows(path, ("mount", "piece"), dict.fromkeys(_AXES, "m"), note=note)
    positions: dict[tuple[str, str], MountRow] = {}
    for row in rows:
        with noting(note):
            key = (row.filled("mount"), row.cells["piece"])
            if key in positions:
                raise row.error(f"'{' '.join(key).strip()}' comes twice: keep one")
            x, y, z = (_coordinate(row, axis, note) for axis in _AXES)
            positions[key] = MountRow(*key, (x, y, z))
    return tuple(positions.values())


def _coordinate(row: Row, axis: str, note: Note) -> float:
    try:
        return row.number(axis)
    except InputError as error:
        note(error)
        return math.nan


def write_mount_table(path: Path, rows: Sequence[MountRow]) -> None:
    """Write the table that `read_mount_table` reads, in metres.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    table = pd.DataFrame(
        [(row.mount, row.piece, *row.position) for row in rows],
        columns=["mount", "piece", *(f"{axis} [m]" for axis in _AXES)],
    )
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))


def read_channel_table(path: Path, note: Note = refuse) -> tuple[ChannelRow, ...]:
    """Read the table ``channel, quantity, mount, piece, axis, node, direction, unit``.

    Parameters
    ----------
    path : Path
        CSV or xlsx.
    note : callable
        Gets every fault; by default the first one is raised. A row at fault is left out.

    Raises
    ------
    InputError
        The file is missing or no table; a column is missing or unknown; a channel or a DoF comes
        twice for one quantity; a unit is missing, unknown or of another quantity; a name, axis or
        direction does not fit the others.
    """
    seen: dict[tuple[str, ...], int] = {}
    channels = []
    for row in read_rows(path, _CHANNEL_COLUMNS, {}, note=note):
        with noting(note):
            channel = _channel(row)
            _refuse_doubled(row, channel, seen)
            channels.append(channel)
    return tuple(channels)


def named_channels(path: Path) -> frozenset[tuple[str, str]]:
    """Return quantity and name of every row of a channel table, right or wrong."""
    rows = read_rows(path, _CHANNEL_COLUMNS, {}, note=lambda _error: None)
    return frozenset((row.cells["quantity"], row.cells["channel"]) for row in rows)


def _refuse_doubled(row: Row, channel: ChannelRow, seen: dict[tuple[str, ...], int]) -> None:
    for key, what in (
        ((channel.quantity, channel.channel), f"channel '{channel.channel}'"),
        (
            (channel.quantity, str(channel.node), channel.direction),
            f"node {channel.node} {channel.direction}",
        ),
    ):
        if key in seen:
            raise row.error(
                f"{channel.quantity} {what} is duplicated, it stands in line {seen[key]} "
                "already: keep one"
            )
        seen[key] = row.line


def write_channel_table(path: Path, rows: Sequence[ChannelRow]) -> None:
    """Write the table that `read_channel_table` reads.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    table = pd.DataFrame(
        [
            (r.channel, r.quantity, r.mount, r.piece, r.axis, r.node, r.direction, r.unit.label)
            for r in rows
        ],
        columns=list(_CHANNEL_COLUMNS),
    )
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))


def _channel(row: Row) -> ChannelRow:
    quantity = row.cells["quantity"]
    if quantity not in QUANTITY_UNIT:
        raise row.error(f"unknown quantity '{quantity}', use {', '.join(QUANTITY_UNIT)}")
    mount, piece, axis = row.filled("mount"), row.cells["piece"], row.cells["axis"]
    if axis not in _AXES:
        raise row.error(f"unknown axis '{axis}', use {', '.join(_AXES)}")
    if quantity == NOISE_TRANSFER and piece:
        raise row.error(
            "a noise transfer function is of all pieces together: leave piece empty instead of "
            f"'{piece}'"
        )
    name = " ".join(filter(None, (mount, piece, axis)))
    if row.cells["channel"] != name:
        raise row.error(
            f"channel '{row.cells['channel']}' of mount '{mount}', piece '{piece}', axis '{axis}' "
            f"must be named '{name}'"
        )
    direction = row.cells["direction"]
    if direction not in (f"+{axis}", f"-{axis}"):
        wrong = "" if direction in DIRECTIONS.values() else ", which is no direction"
        raise row.error(
            f"channel '{name}' has direction '{direction}'{wrong}: use +{axis} or -{axis}"
        )
    node = row.number("node")
    if node != int(node) or node < 1:
        raise row.error(f"node '{row.cells['node']}' is no whole number from 1")
    try:
        unit = parse_unit(row.cells["unit"])
    except InputError as error:
        raise InputError(
            f"{row.path} line {row.line}, {quantity} channel '{name}': {error}"
        ) from None
    if unit.si != QUANTITY_UNIT[quantity]:
        raise row.error(
            f"{quantity} channel '{name}' is in '{unit.label}', which is no unit of it: use "
            f"{QUANTITY_UNIT[quantity]} or a multiple"
        )
    return ChannelRow(name, quantity, mount, piece, axis, int(node), direction, unit)
