"""Rows of tables that studies share: mounts, sensors, impacts, panels, channels and curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError, naming
from deboom.files.function_table import Dof, first_difference, same_lines, starts_at_0_hz
from deboom.files.tables import (
    InUnitOfRow,
    MayBeEmpty,
    Numbers,
    Optional,
    TableRow,
    UnitOfFiles,
    ZeroWithoutColumns,
    read_rows,
    write_frame,
    write_sheets,
)
from deboom.files.uff import DIRECTIONS
from deboom.files.units import Unit, parse_unit, refuse_beyond
from deboom.measurement.sensors import Impact, Sensor, SensorKind
from deboom.names import is_inside
from deboom.physics.rigid_body import ROTATION_ORDERS, rotation_matrix

_AXES = ("x", "y", "z")
Vector = tuple[float, float, float]
Blank = Annotated[str, MayBeEmpty]
_Place = Annotated[Vector, Numbers(_AXES, "m")]
_PlaceInMillimetres = Annotated[Vector, Numbers(_AXES, "m", written="mm")]
_Angles = Annotated[Vector, Numbers(("rx", "ry", "rz"), "rad", written="deg")]
_Turn = Annotated[Vector, Numbers(("rx", "ry", "rz"), "rad", written="deg"), ZeroWithoutColumns]
_RotationOrder = Annotated[str, Optional(ROTATION_ORDERS[0])]
_Direction = Annotated[Vector, Numbers(("dx", "dy", "dz"))]


@dataclass(frozen=True)
class MountRow(TableRow):
    """Position of one piece of a mount, and how it stands.

    - `mount`, `piece`: names; the piece of a single one is ``""``.
    - `position`: virtual point in vehicle axes, from the powertrain's centre of gravity [m].
    - `angles`: turns of vehicle axes into the mount's axes, about the fixed axes x, then y, then z,
      as of sensors [rad]. A table without the columns has mounts along the vehicle's axes.
    """

    unique = ("'{0.name}'",)
    mount: str
    piece: Blank
    position: _Place
    angles: _Turn = (0.0, 0.0, 0.0)

    def _check(self) -> None:
        if any(abs(angle) > math.tau for angle in self.angles):
            turns = ", ".join(f"{math.degrees(angle):g}" for angle in self.angles)
            raise InputError(
                f"mount '{self.name}' is turned by {turns} deg: give at most a whole turn, in the "
                "unit of the columns"
            )

    @property
    def name(self) -> str:
        """Mount and piece in one."""
        return f"{self.mount} {self.piece}".strip()


@dataclass(frozen=True)
class SensorRow(TableRow):
    """Triaxial sensor of a position sheet.

    - `sensor`: name, such as ``A1``; its channels are ``A1 x``, ``A1 y``, ``A1 z``.
    - `kind`: ``accelerometer`` or ``force cell``.
    - `model`: what its maker calls it.
    - `mount`, `piece`: mount that it belongs to; the piece of a single one is ``""``.
    - `position`: from the powertrain's centre of gravity [m].
    - `angles`: turns of vehicle axes into sensor axes, ``Rz·Ry·Rx``: about the fixed axes x, then
      y, then z [rad].
    - `rotation_order`: another order of them, of `ROTATION_ORDERS`; the column may be absent.
    """

    unique = ("sensor '{0.sensor}'",)
    sensor: str
    kind: str
    model: str
    mount: str
    piece: Blank
    position: _Place
    angles: _Angles
    rotation_order: _RotationOrder = ROTATION_ORDERS[0]

    @property
    def orientation(self) -> RealArray:
        """Sensor axes in vehicle axes, its columns (3, 3) [1]."""
        return rotation_matrix(self.angles, self.rotation_order)

    def _check(self) -> None:
        _check_rotation_order(self.sensor, self.rotation_order)
        kinds = [kind.value for kind in SensorKind]
        if self.kind not in kinds:
            raise InputError(
                f"sensor '{self.sensor}' is of unknown kind '{self.kind}', use {' or '.join(kinds)}"
            )


def _check_rotation_order(sensor: str, order: str) -> None:
    if order not in ROTATION_ORDERS:
        raise InputError(
            f"sensor '{sensor}' has the rotation_order '{order}', use one of "
            f"{', '.join(ROTATION_ORDERS)}; without the column it is {ROTATION_ORDERS[0]}, about "
            "the fixed axes x, then y, then z"
        )


def sensor_of(row: SensorRow | PlacedSensor) -> Sensor:
    """Return the sensor, its angles made an orientation; a placed one is an accelerometer."""
    sheet = row if isinstance(row, SensorRow) else None
    return Sensor(
        name=row.sensor,
        kind=SensorKind(sheet.kind) if sheet else SensorKind.ACCELEROMETER,
        model=sheet.model if sheet else "",
        mount=sheet.mount if sheet else "",
        piece=sheet.piece if sheet else "",
        position=np.array(row.position),
        orientation=row.orientation,
        rotation_order=row.rotation_order,
    )


def impact_of(row: PlacedImpact | HammerPoint | ImpactRow) -> Impact:
    """Return the impact."""
    along = row.vector if isinstance(row, ImpactRow) else row.direction
    return Impact(row.impact, np.array(row.position), np.array(along))


@dataclass(frozen=True)
class PlacedSensor(TableRow):
    """Triaxial accelerometer with its node in the UFF files.

    - `sensor`: name, such as ``A1``; its channels are ``A1 x``, ``A1 y``, ``A1 z``.
    - `node`: in the UFF files, where directions are those of the sensor's own axes.
    - `position`: [m].
    - `angles`: turns of the sheet's axes into the sensor's, ``Rz·Ry·Rx``: about the fixed axes x,
      then y, then z [rad].
    - `rotation_order`: another order of them, of `ROTATION_ORDERS`; the column may be absent.
    """

    sheet = "sensors"
    unique = ("sensor '{0.sensor}'", "node {0.node}")
    sensor: str
    node: int
    position: _PlaceInMillimetres
    angles: _Angles
    rotation_order: _RotationOrder = ROTATION_ORDERS[0]

    @property
    def orientation(self) -> RealArray:
        """Sensor axes in those of the sheet, its columns (3, 3) [1]."""
        return rotation_matrix(self.angles, self.rotation_order)

    def _check(self) -> None:
        _check_rotation_order(self.sensor, self.rotation_order)


@dataclass(frozen=True)
class PlacedImpact(TableRow):
    """Place where the hammer strikes, and along which way.

    - `impact`: name, such as ``I07``.
    - `node`: in the UFF files; impacts of different directions may share one.
    - `position`: [m].
    - `direction`: unit vector along which a positive force pushes [1].
    """

    sheet = "impacts"
    unique = ("impact '{0.impact}'", "node {0.node} along {0.axis}")
    impact: str
    node: int
    position: _PlaceInMillimetres
    direction: _Direction

    @property
    def axis(self) -> str:
        """Axis of the direction without its sign."""
        return uff_direction(self.direction).lstrip("+-")


@dataclass(frozen=True)
class HammerPoint(TableRow):
    """Point that was struck, and the file of its hits.

    - `impact`: name, such as ``I07`` or ``EnM x``.
    - `node`: UFF node of the force.
    - `file`: UFF file of its hits, relative to the folder.
    - `position`: [m].
    - `direction`: unit vector along which a positive force pushes [1].
    """

    unique = ("impact '{0.impact}'", "node {0.node} along {0.direction}", "file '{0.file}'")
    impact: str
    node: int
    file: str
    position: _Place
    direction: _Direction

    def _check(self) -> None:
        if not is_inside(self.file):
            raise InputError(f"file '{self.file}' is not inside the folder: copy it there")


FARTHEST_DIRECTION = 25.0
"""Largest angle between the direction in a UFF file and that of the position sheet [deg]."""


def struck(point: PlacedImpact | HammerPoint, *, alone: bool) -> Dof:
    """Return the DoF of a hammer's force; files may state the nearest axis for its direction.

    - `point`: where it struck.
    - `alone`: no other impact has its node: a file may state no direction at all.
    """
    nearest = math.cos(math.radians(FARTHEST_DIRECTION))
    accepted = [
        f"{sign}{axis}"
        for axis, part in zip(_AXES, point.direction, strict=True)
        for sign in "+-"
        if _sign(sign) * part > nearest
    ]
    accepted += ["scalar"] if alone else []
    along = uff_direction(point.direction)
    return Dof(point.impact, point.node, along, accepted=tuple(accepted))


def uff_direction(vector: Vector) -> str:
    """Return ``+x`` … ``-z`` of a unit vector along an axis, else ``scalar``."""
    for axis, component in zip(_AXES, vector, strict=True):
        if abs(component) > 1.0 - 1e-6:
            return f"{'+' if component > 0 else '-'}{axis}"
    return "scalar"


@dataclass(frozen=True)
class ImpactRow(TableRow):
    """Blow of the hammer on a vehicle's body.

    - `impact`: name, such as ``I3 y``.
    - `mount`, `piece`: mount around which it lies; the piece of a single one is ``""``.
    - `node`: reference node in the UFF files.
    - `direction`: direction of a positive force, such as ``-y``: into the body.
    - `position`: from the powertrain's centre of gravity [m].
    """

    unique = ("impact '{0.impact}'", "DoF {0.node} {0.direction}")
    impact: str
    mount: str
    piece: Blank
    node: int
    direction: str
    position: _Place

    @property
    def vector(self) -> tuple[float, ...]:
        """Unit vector along `direction`."""
        return tuple(_sign(self.direction) * (axis == self.direction[1:]) for axis in _AXES)

    def _check(self) -> None:
        directions = [f"{sign}{axis}" for axis in _AXES for sign in "+-"]
        if self.direction not in directions:
            raise InputError(f"direction '{self.direction}': use one of {', '.join(directions)}")


@dataclass(frozen=True)
class PanelRow(TableRow):
    """Panel of the cabin.

    - `panel`: name, such as ``trunk floor``.
    - `node`: in the UFF files, of its accelerometer and of its microphone.
    - `normal`: unit vector into the cabin [1].
    - `position`: from the powertrain's centre of gravity [m].
    - `area`: area with which its motion changes the volume of the cabin [m²].
    """

    unique = ("panel '{0.panel}'", "node {0.node}")
    panel: str
    node: int
    normal: Annotated[Vector, Numbers(("nx", "ny", "nz"))]
    position: _Place
    area: Annotated[float, Numbers(("area",), "m^2")]

    def _check(self) -> None:
        if abs(np.linalg.norm(self.normal) - 1) > 1e-3:
            raise InputError(f"the normal of '{self.panel}' is no unit vector into the cabin")
        if self.area <= 0:
            raise InputError(f"the area of '{self.panel}' is not positive: turn its normal instead")


CAMPAIGN_QUANTITIES = {
    "acceleration": ("acceleration", "m/s^2"),
    "cell force": ("force", "N"),
    "static force": ("force", "N"),
    "engine torque": ("force", "N m"),
    "engine speed": ("rpm", "rpm"),
    "tacho": ("general", "1"),
}
"""Quantities of a campaign's channels: the word of the UFF ordinate and the SI unit.

The engine speed belongs to runs over an engine order, the tacho signal to runs over time.
"""
HAMMER_QUANTITIES = {
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "displacement": "m",
    "pressure": "Pa",
    "force": "N",
}
"""Quantities of a response to the hammer, as the UFF ordinate says them, and their SI units."""
NOISE_TRANSFER = "noise transfer function"
QUANTITY_UNIT = {"displacement": "m", "force": "N", NOISE_TRANSFER: "Pa/N"}
"""Quantities of a platform's channels and their SI units."""


class _Channel(TableRow):
    """Channel of a table and the UFF DoF that holds it."""

    channel: str
    quantity: str
    node: int
    direction: str
    unit: Annotated[Unit, UnitOfFiles]

    @property
    def along(self) -> str:
        """Axis of the direction without its sign."""
        return self.direction.lstrip("+-")

    @property
    def sign(self) -> float:
        """−1 for a channel recorded against its axis, else +1."""
        return _sign(self.direction)

    @property
    def dof(self) -> Dof:
        """DoF of the files."""
        return Dof(
            self.channel,
            self.node,
            self.direction,
            sign=self.sign,
            quantity=self.quantity,
            unit=self.unit if self.unit.si else None,
        )

    def _check_dof(self, si: Mapping[str, str], axis: str) -> None:
        """Refuse an unknown quantity, and a direction or unit that does not fit the channel."""
        if self.quantity not in si:
            raise InputError(f"unknown quantity '{self.quantity}', use {', '.join(si)}")
        along = (f"+{axis}", f"-{axis}") if axis in _AXES else tuple(DIRECTIONS.values())
        if self.direction not in DIRECTIONS.values():
            raise InputError(
                f"channel '{self.channel}' has direction '{self.direction}', which is none: use "
                f"{', '.join(along)}"
            )
        if axis and self.direction not in along:
            raise InputError(
                f"{self.quantity} '{self.channel}' has direction '{self.direction}', which is not "
                f"along '{axis}': two axes may be swapped; correct the name or the direction"
            )
        if not self.unit.si:  # the files' own counts; of a tacho only pulses do
            if self.unit.label and self.quantity != "tacho":
                with naming(f"{self.quantity} '{self.channel}'"):
                    parse_unit(self.unit.label)
        elif self.unit.si != si[self.quantity]:
            raise InputError(
                f"{self.quantity} '{self.channel}' is in '{self.unit.label}', which is no unit of "
                f"it: use {si[self.quantity]} or a multiple"
            )


@dataclass(frozen=True)
class CampaignChannel(_Channel):
    """Channel of a campaign; it is at the same DoF in every run.

    - `channel`: ``<sensor> <axis>``; ``<mount> [<piece>] <axis>`` of a static force; else the
      quantity.
    - `quantity`: key of `CAMPAIGN_QUANTITIES`.
    - `node`: response node.
    - `direction`: direction along the sensor's axis, such as ``+x``; a negative one turns the sign.
    - `unit`: unit as the table states it; without label and SI unit, each file's own counts.
    """

    unique = ("{0.quantity} '{0.channel}'", "{0.ordinate} at node {0.node} along {0.along}")
    channel: str
    quantity: str
    node: int
    direction: str
    unit: Annotated[Unit, UnitOfFiles]

    @property
    def ordinate(self) -> str:
        """Word of the quantity in the UFF file."""
        return CAMPAIGN_QUANTITIES[self.quantity][0]

    def _check(self) -> None:
        si = {quantity: unit for quantity, (_, unit) in CAMPAIGN_QUANTITIES.items()}
        axis = self.channel.rpartition(" ")[2]
        self._check_dof(si, axis if self.quantity.endswith(("acceleration", "force")) else "")


@dataclass(frozen=True)
class HammerChannel(_Channel):
    """Response to the hammer.

    - `channel`: name, such as ``A1 x`` or ``driver ear``.
    - `quantity`: key of `HAMMER_QUANTITIES`.
    - `node`: response node.
    - `direction`: ``+x`` … ``-z`` or ``scalar``; one against the axis in the name turns the sign.
    - `unit`: unit as the table states it; without label and SI unit, each file's own counts.
    - `range`: largest value that the channel can hold, in SI; infinite where it is not known.
    """

    unique = ("channel '{0.channel}'", "{0.quantity} at node {0.node} along {0.along}")
    channel: str
    quantity: str
    node: int
    direction: str
    unit: Annotated[Unit, UnitOfFiles]
    range: Annotated[float, InUnitOfRow] = math.inf

    def _check(self) -> None:
        axis = self.channel.rpartition(" ")[2]
        has_axis = axis in _AXES and self.quantity != "pressure"
        self._check_dof(HAMMER_QUANTITIES, axis if has_axis else "")
        if not self.range > 0:
            raise InputError(
                f"channel '{self.channel}': a range is positive; leave it empty if unknown"
            )


@dataclass(frozen=True)
class ChannelRow(_Channel):
    """Measured channel of a platform.

    - `channel`: ``<mount> [<piece>] <axis>``, such as ``Du left x``.
    - `quantity`: key of `QUANTITY_UNIT`.
    - `mount`, `piece`, `axis`: parts of the name; noise transfer functions have no piece.
    - `node`: response node; of a noise transfer function, the reference node.
    - `direction`: ``+x`` … ``-z``, along the axis; a negative one turns the sign of the channel.
    - `unit`: unit as the table states it; without label and SI unit, each file's own counts.
    """

    unique = ("{0.quantity} '{0.channel}'", "{0.quantity} at node {0.node} {0.direction}")
    channel: str
    quantity: str
    mount: str
    piece: Blank
    axis: str
    node: int
    direction: str
    unit: Annotated[Unit, UnitOfFiles]

    def _check(self) -> None:
        if self.axis not in _AXES:
            raise InputError(f"unknown axis '{self.axis}', use {', '.join(_AXES)}")
        name = " ".join(filter(None, (self.mount, self.piece, self.axis)))
        if self.channel != name:
            raise InputError(
                f"channel '{self.channel}' of mount '{self.mount}', piece '{self.piece}', axis "
                f"'{self.axis}' must be named '{name}'"
            )
        self._check_dof(QUANTITY_UNIT, self.axis)


def _sign(direction: str) -> float:
    return -1.0 if direction.startswith("-") else 1.0


def write_positions(
    path: Path, sensors: Sequence[PlacedSensor], impacts: Sequence[PlacedImpact]
) -> None:
    """Write both position sheets into one Excel file, in mm and degrees."""
    write_sheets(path, {PlacedSensor: sensors, PlacedImpact: impacts})


def read_curve(path: Path) -> tuple[RealArray, RealArray]:
    """Read the table ``deflection [mm], force [N]`` of a supplier.

    - returns (n,) `deflection, force`: [m], [N].
    - raises InputError: no such table, or no finite numbers.
    """
    rows = read_rows(path, (), {"deflection": "m", "force": "N"})
    values = np.array([[row.number("deflection"), row.number("force")] for row in rows])
    return values[:, 0], values[:, 1]


def read_torque_table(path: Path, frequency: RealArray) -> RealArray:
    """Read the table ``frequency [Hz], engine torque [N m]``.

    - `path`: CSV or xlsx, one row per line.
    - `frequency` (f,): lines of the run's spectra [Hz]; nothing is interpolated.
    - returns (f,): engine torque [N m].
    - raises InputError: the file is missing or no such table, an entry is no finite number or
      beyond what a car has, or its lines are not those of the spectra.
    """
    rows = read_rows(path, (), {"frequency": "Hz", "engine torque": "N m"})
    lines = np.array([row.number("frequency") for row in rows])
    if frequency[0] > 0 and starts_at_0_hz(lines, path):
        rows, lines = rows[1:], lines[1:]
    if not same_lines(frequency, lines):
        raise InputError(
            f"{path}: the lines of the spectra and of this table differ: "
            f"{first_difference(frequency, lines)}; export the torque on the lines of the spectra"
        )
    torque = np.array([row.number("engine torque") for row in rows])
    with naming(path):
        refuse_beyond("engine torque", torque)
    return torque


def write_torque_table(path: Path, frequency: RealArray, engine_torque: RealArray) -> None:
    """Write the table that `read_torque_table` reads."""
    table = {"frequency [Hz]": frequency, "engine torque [N m]": engine_torque}
    write_frame(path, pd.DataFrame(table))


def write_curve(path: Path, deflection: RealArray, force: RealArray) -> None:
    """Write the table that `read_curve` reads, in mm and N."""
    write_frame(path, pd.DataFrame({"deflection [mm]": 1e3 * deflection, "force [N]": force}))
