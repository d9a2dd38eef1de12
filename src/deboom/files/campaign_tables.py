"""The tables of a campaign: position sheet of the sensors, channels, force-deflection curves."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.disk import replace_bytes, replace_text
from deboom.files.tables import Row, Unit, parse_unit, read_rows
from deboom.files.uff import DIRECTIONS
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.physics.rigid_body import rotation_matrix

SENSOR_KINDS = ("accelerometer", "force cell")

CAMPAIGN_QUANTITIES = {
    "acceleration": ("acceleration", "m/s^2"),
    "cell force": ("force", "N"),
    "static force": ("force", "N"),
    "engine torque": ("force", "N m"),
    "engine speed": ("rpm", "rpm"),
    "tacho": ("general", "1"),
}
"""Quantities of the channel table: the word of the UFF ordinate and the SI unit.

The engine speed belongs to runs over an engine order, the tacho signal to runs over time.
"""

_AXES = ("x", "y", "z")
_ANGLES = ("rx", "ry", "rz")
_SENSOR_COLUMNS = ("sensor", "kind", "model", "mount", "piece")
_CHANNEL_COLUMNS = ("channel", "quantity", "node", "direction", "unit")


@dataclass(frozen=True)
class SensorRow:
    """One triaxial sensor of the position sheet.

    Parameters
    ----------
    sensor : str
        Name, such as ``A1``; its channels are ``A1 x``, ``A1 y``, ``A1 z``.
    kind : str
        ``accelerometer`` or ``force cell``.
    model : str
        Of the sensor catalogue.
    mount, piece : str
        What it belongs to; the piece of a single one is ``""``.
    position : (x, y, z)
        From the powertrain's centre of gravity [m].
    angles : (rx, ry, rz)
        That turn vehicle axes into sensor axes, about the fixed axes x, then y, then z [rad].
    """

    sensor: str
    kind: str
    model: str
    mount: str
    piece: str
    position: tuple[float, float, float]
    angles: tuple[float, float, float]


@dataclass(frozen=True)
class CampaignChannel:
    """One channel and the UFF DoF that holds it in every run.

    Parameters
    ----------
    channel : str
        ``<sensor> <axis>``; ``<mount> [<piece>] <axis>`` of a static force; else the quantity.
    quantity : str
        One of `CAMPAIGN_QUANTITIES`.
    node : int
        Response node.
    direction : str
        Along the sensor's axis, such as ``+x``; a negative one turns the sign.
    unit : Unit
        As the table states it.
    """

    channel: str
    quantity: str
    node: int
    direction: str
    unit: Unit

    @property
    def sign(self) -> float:
        """−1 for a channel recorded against its axis, else +1."""
        return -1.0 if self.direction.startswith("-") else 1.0


def read_sensor_table(path: Path) -> tuple[SensorRow, ...]:
    """Read the position sheet, CSV or Excel.

    Columns ``sensor, kind, model, mount, piece, x [mm], y [mm], z [mm], rx [deg], ry [deg],
    rz [deg]``; the unit of lengths and angles is the table's choice, and must be stated.

    Raises
    ------
    InputError
        No such table; a column or a unit is missing; units are mixed; a sensor comes twice or is
        of an unknown kind.
    """
    units = dict.fromkeys(_AXES, "m") | dict.fromkeys(_ANGLES, "rad")
    rows = read_rows(path, _SENSOR_COLUMNS, units)
    for columns in (_AXES, _ANGLES):
        _check_one_unit(rows[0], columns)
    sensors: dict[str, SensorRow] = {}
    for row in rows:
        name, kind = row.filled("sensor"), row.filled("kind")
        if name in sensors:
            raise row.error(f"sensor '{name}' comes twice: keep one")
        if kind not in SENSOR_KINDS:
            raise row.error(
                f"sensor '{name}' is of unknown kind '{kind}', use {' or '.join(SENSOR_KINDS)}"
            )
        x, y, z = (row.number(axis) for axis in _AXES)
        rx, ry, rz = (row.number(angle) for angle in _ANGLES)
        sensors[name] = SensorRow(
            sensor=name,
            kind=kind,
            model=row.filled("model"),
            mount=row.filled("mount"),
            piece=row.cells["piece"],
            position=(x, y, z),
            angles=(rx, ry, rz),
        )
    return tuple(sensors.values())


def write_sensor_table(path: Path, rows: Sequence[SensorRow]) -> None:
    """Write the position sheet in metres and degrees, as CSV or Excel by the suffix of `path`.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    table = pd.DataFrame(
        [
            (
                *(row.sensor, row.kind, row.model, row.mount, row.piece),
                *row.position,
                *np.round(np.rad2deg(row.angles), 10).tolist(),
            )
            for row in rows
        ],
        columns=[
            *_SENSOR_COLUMNS,
            *(f"{axis} [m]" for axis in _AXES),
            *(f"{angle} [deg]" for angle in _ANGLES),
        ],
    )
    if path.suffix.lower() == ".xlsx":
        sheet = io.BytesIO()
        table.to_excel(sheet, index=False)
        replace_bytes(path, sheet.getvalue())
    else:
        replace_text(path, table.to_csv(index=False, lineterminator="\n"))


def read_campaign_channels(path: Path) -> tuple[CampaignChannel, ...]:
    """Read the table ``channel, quantity, node, direction, unit``.

    Raises
    ------
    InputError
        No such table; a channel or a DoF comes twice; a quantity, direction or unit is unknown, or
        fits neither the channel nor its neighbours.
    """
    seen: dict[tuple[str, ...], int] = {}
    units: dict[str, CampaignChannel] = {}
    channels = []
    for row in read_rows(path, _CHANNEL_COLUMNS, {}):
        channel = _channel(row)
        ordinate = CAMPAIGN_QUANTITIES[channel.quantity][0]
        for key, what in (
            ((channel.quantity, channel.channel), f"{channel.quantity} '{channel.channel}'"),
            (
                (ordinate, str(channel.node), channel.direction.lstrip("+-")),
                f"{ordinate} at node {channel.node} along {channel.direction.lstrip('+-')}",
            ),
        ):
            if key in seen:
                raise row.error(f"{what} already stands in line {seen[key]}: correct one of them")
            seen[key] = row.line
        first = units.setdefault(channel.quantity, channel)
        if first.unit.factor != channel.unit.factor:
            raise row.error(
                f"units are mixed: {channel.quantity} '{first.channel}' is in "
                f"{first.unit.label} and '{channel.channel}' in {channel.unit.label}; use one"
            )
        channels.append(channel)
    return tuple(channels)


def write_campaign_channels(path: Path, channels: Sequence[CampaignChannel]) -> None:
    """Write the table that `read_campaign_channels` reads.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    table = pd.DataFrame(
        [(c.channel, c.quantity, c.node, c.direction, c.unit.label) for c in channels],
        columns=list(_CHANNEL_COLUMNS),
    )
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))


def read_curve(path: Path) -> tuple[RealArray, RealArray]:
    """Read the table ``deflection [mm], force [N]`` of a supplier.

    Returns
    -------
    deflection, force : array, shape (n,)
        [m], [N].

    Raises
    ------
    InputError
        No such table, or no finite numbers.
    """
    rows = read_rows(path, (), {"deflection": "m", "force": "N"})
    values = np.array([[row.number("deflection"), row.number("force")] for row in rows])
    return values[:, 0], values[:, 1]


def write_curve(path: Path, deflection: RealArray, force: RealArray) -> None:
    """Write the table that `read_curve` reads, in mm and N.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    table = pd.DataFrame({"deflection [mm]": 1e3 * deflection, "force [N]": force})
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))


def _check_one_unit(row: Row, columns: Sequence[str]) -> None:
    first, *others = columns
    for other in others:
        if row.units[other].factor != row.units[first].factor:
            raise InputError(
                f"{row.path}: units are mixed: '{first}' is in {row.units[first].label} and "
                f"'{other}' in {row.units[other].label}; use one for both"
            )


def _channel(row: Row) -> CampaignChannel:
    name, quantity = row.filled("channel"), row.filled("quantity")
    if quantity not in CAMPAIGN_QUANTITIES:
        raise row.error(f"unknown quantity '{quantity}', use {', '.join(CAMPAIGN_QUANTITIES)}")
    direction = row.cells["direction"]
    if direction not in DIRECTIONS.values():
        raise row.error(
            f"channel '{name}' has direction '{direction}', which is none: use "
            f"{', '.join(DIRECTIONS.values())}"
        )
    axis = name.rpartition(" ")[2]
    if quantity.endswith(("acceleration", "force")) and direction not in (f"+{axis}", f"-{axis}"):
        raise row.error(
            f"{quantity} '{name}' has direction '{direction}', which is not along '{axis}': two "
            "axes may be swapped; correct the name or the direction"
        )
    node = row.number("node")
    if node != int(node) or node < 1:
        raise row.error(f"node '{row.cells['node']}' is no whole number from 1")
    try:
        unit = parse_unit(row.cells["unit"])
    except InputError as error:
        raise row.error(f"{quantity} '{name}': {error}") from None
    si = CAMPAIGN_QUANTITIES[quantity][1]
    if unit.si != si:
        raise row.error(
            f"{quantity} '{name}' is in '{unit.label}', which is no unit of it: use {si} or a "
            "multiple"
        )
    return CampaignChannel(name, quantity, int(node), direction, unit)


def sensor_of(row: SensorRow) -> Sensor:
    """Return the sensor, its angles made an orientation.

    Raises
    ------
    InputError
        As `Sensor`.
    """
    return Sensor(
        name=row.sensor,
        kind=SensorKind(row.kind),
        model=row.model,
        mount=row.mount,
        piece=row.piece,
        position=np.array(row.position),
        orientation=rotation_matrix(row.angles),
    )
