"""The two tables of a platform: where the mounts sit, and which UFF DoF is which channel.

Comma-separated UTF-8 text with one header line. A length carries its unit in the header
(``x [mm]``); a channel carries it in its row.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.uff_function import DIRECTIONS
from deboom.files.units import Unit, parse_unit

NOISE_TRANSFER = "noise transfer function"
QUANTITY_UNIT = {"displacement": "m", "force": "N", NOISE_TRANSFER: "Pa/N"}
"""Quantities of the channel table and their SI units."""

_AXES = ("x", "y", "z")
_CHANNEL_COLUMNS = ("channel", "quantity", "mount", "piece", "axis", "node", "direction", "unit")
_WITH_UNIT = re.compile(r"(?P<name>[^\[\]]+?)\s*\[(?P<unit>[^\[\]]*)\]")


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


def read_mount_table(path: Path) -> tuple[MountRow, ...]:
    """Read the table ``mount, piece, x [unit], y [unit], z [unit]``.

    Raises
    ------
    InputError
        The file is missing or no table; a column is missing, unknown, or a length without a unit;
        an entry is no finite number; a piece comes twice.
    """
    units, rows = _table(path, ("mount", "piece"), _AXES, "m")
    positions: dict[tuple[str, str], MountRow] = {}
    for line, row in rows:
        key = (_filled(path, line, row, "mount"), row["piece"])
        if key in positions:
            raise InputError(f"{path} line {line}: '{' '.join(key).strip()}' comes twice: keep one")
        x, y, z = (_number(path, line, axis, row[axis]) * units[axis].factor for axis in _AXES)
        positions[key] = MountRow(*key, (x, y, z))
    return tuple(positions.values())


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


def read_channel_table(path: Path) -> tuple[ChannelRow, ...]:
    """Read the table ``channel, quantity, mount, piece, axis, node, direction, unit``.

    Raises
    ------
    InputError
        The file is missing or no table; a column is missing or unknown; a channel or a DoF comes
        twice for one quantity; a unit is missing, unknown or of another quantity; a name, axis or
        direction does not fit the others.
    """
    _, rows = _table(path, _CHANNEL_COLUMNS, (), "")
    seen: dict[tuple[str, ...], int] = {}
    channels = []
    for line, row in rows:
        channel = _channel(path, line, row)
        for key, what in (
            ((channel.quantity, channel.channel), f"channel '{channel.channel}'"),
            (
                (channel.quantity, str(channel.node), channel.direction),
                f"node {channel.node} {channel.direction}",
            ),
        ):
            if key in seen:
                raise InputError(
                    f"{path} line {line}: {channel.quantity} {what} is duplicated, it stands in "
                    f"line {seen[key]} already: keep one"
                )
            seen[key] = line
        channels.append(channel)
    return tuple(channels)


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


def _channel(path: Path, line: int, row: Mapping[str, str]) -> ChannelRow:
    quantity = row["quantity"]
    if quantity not in QUANTITY_UNIT:
        raise InputError(
            f"{path} line {line}: unknown quantity '{quantity}', use {', '.join(QUANTITY_UNIT)}"
        )
    mount, axis = _filled(path, line, row, "mount"), row["axis"]
    if axis not in _AXES:
        raise InputError(f"{path} line {line}: unknown axis '{axis}', use {', '.join(_AXES)}")
    if quantity == NOISE_TRANSFER and row["piece"]:
        raise InputError(
            f"{path} line {line}: a noise transfer function is of all pieces together: leave "
            f"piece empty instead of '{row['piece']}'"
        )
    name = " ".join(filter(None, (mount, row["piece"], axis)))
    if row["channel"] != name:
        raise InputError(
            f"{path} line {line}: channel '{row['channel']}' of mount '{mount}', piece "
            f"'{row['piece']}', axis '{axis}' must be named '{name}'"
        )
    if row["direction"] not in (f"+{axis}", f"-{axis}"):
        wrong = "" if row["direction"] in DIRECTIONS.values() else ", which is no direction"
        raise InputError(
            f"{path} line {line}: channel '{name}' has direction '{row['direction']}'{wrong}: use "
            f"+{axis} or -{axis}"
        )
    node = _number(path, line, "node", row["node"])
    if node != int(node) or node < 1:
        raise InputError(f"{path} line {line}: node '{row['node']}' is no whole number from 1")
    try:
        unit = parse_unit(row["unit"])
    except InputError as error:
        raise InputError(f"{path} line {line}, {quantity} channel '{name}': {error}") from None
    if unit.si != QUANTITY_UNIT[quantity]:
        raise InputError(
            f"{path} line {line}: {quantity} channel '{name}' is in '{unit.label}', which is no "
            f"unit of it: use {QUANTITY_UNIT[quantity]} or a multiple"
        )
    return ChannelRow(name, quantity, mount, row["piece"], axis, int(node), row["direction"], unit)


def _table(
    path: Path, plain: Sequence[str], with_unit: Sequence[str], si: str
) -> tuple[dict[str, Unit], list[tuple[int, dict[str, str]]]]:
    """Return the units of the columns that need one, and per row its line number and its cells."""
    try:
        # without a header, so that pandas neither renames doubled columns nor makes one an index
        cells = pd.read_csv(
            path,
            header=None,
            dtype=str,
            keep_default_na=False,
            skip_blank_lines=False,
            encoding="utf-8-sig",
        ).fillna("")
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check the path") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is not UTF-8 text: save it as UTF-8") from None
    except pd.errors.EmptyDataError:
        raise InputError(f"{path} is empty: export it again") from None
    except pd.errors.ParserError as error:
        raise InputError(f"{path} is no comma-separated table: {str(error).strip()}") from None
    header = [text.strip() for text in cells.iloc[0]]
    names = []
    units = {}
    for text in header:
        match = _WITH_UNIT.fullmatch(text)
        name = match["name"] if match else text
        names.append(name)
        if name in with_unit:
            if not match:
                raise InputError(f"{path}: column '{text}' has no unit: write '{text} [mm]' or [m]")
            units[name] = _column_unit(path, text, match["unit"], si)
    wanted = [*plain, *with_unit]
    for name in (*wanted, *names):
        if names.count(name) != 1 or name not in wanted:
            state = "is missing" if name not in names else "is unknown or doubled"
            raise InputError(
                f"{path}: column '{name}' {state}; the columns are {', '.join(wanted)}, separated "
                "by commas"
            )
    rows = []
    for line, row in enumerate(cells.iloc[1:].itertuples(index=False), 2):
        texts = [text.strip() for text in row]
        if any(texts):
            rows.append((line, dict(zip(names, texts, strict=True))))
    if not rows:
        raise InputError(f"{path} has a header and no rows: add one row per item")
    return units, rows


def _column_unit(path: Path, column: str, label: str, si: str) -> Unit:
    try:
        unit = parse_unit(label)
    except InputError as error:
        raise InputError(f"{path}: column '{column}': {error}") from None
    if unit.si != si:
        raise InputError(f"{path}: column '{column}' is not in {si} or a multiple of it")
    return unit


def _filled(path: Path, line: int, row: Mapping[str, str], column: str) -> str:
    if not row[column]:
        raise InputError(f"{path} line {line}: column '{column}' is empty: fill it in")
    return row[column]


def _number(path: Path, line: int, column: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(
            f"{path} line {line}, column '{column}': '{text}' is no finite number (decimal point, "
            "no thousands separator)"
        )
    return number
