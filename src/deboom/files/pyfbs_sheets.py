"""Position sheets of pyFBS: its workbook of sensors, channels, impacts and virtual points.

pyFBS states no units: positions are in mm and angles in degrees, which turn about the fixed axes
x, then y, then z (``Rotation.from_euler("xyz")``), as deboom's own sheets do. The columns are
``Name``, ``Position_1`` … ``Position_3`` and, of sensors, ``Orientation_1`` … ``Orientation_3``, of
channels, impacts and virtual points, ``Direction_1`` … ``Direction_3``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError, naming
from deboom.files.rows import PlacedImpact, PlacedSensor, Vector
from deboom.files.schema import noting, refuse_all, telling
from deboom.files.tables import Columns, Row, read_columns, rows_of, sheet_names
from deboom.files.units import Unit, parse_unit
from deboom.physics.rigid_body import rotation_angles

SENSORS, CHANNELS, IMPACTS, VIRTUAL_POINTS = "Sensors", "Channels", "Impacts", "VP_Channels"
"""How the names of the sheets begin; a suffix such as ``_AB`` names the structure."""
LARGEST_TURN = 1.0
"""Largest angle between a channel's direction and that of its sensor's angles [deg]."""
LARGEST_SHIFT = 0.1
"""Largest distance between the positions of a channel and its sensor [mm]."""

_Placed = TypeVar("_Placed", PlacedSensor, PlacedImpact)
_AXES = ("x", "y", "z")
_TURNS = ("rx", "ry", "rz")


def has_pyfbs_sheets(path: Path, kind: type[PlacedSensor] | type[PlacedImpact]) -> bool:
    """Tell whether a workbook holds pyFBS's sheets instead of deboom's.

    - raises InputError: a workbook that cannot be read.
    """
    if path.suffix.lower() != ".xlsx":
        return False
    names = sheet_names(path)
    begins = (SENSORS, CHANNELS) if kind is PlacedSensor else (IMPACTS,)
    return kind.sheet not in names and any(name.startswith(begins) for name in names)


def read_pyfbs_sheet(path: Path, kind: type[_Placed]) -> tuple[_Placed, ...]:
    """Read sensors or impacts from a workbook of pyFBS, in SI.

    Parameters
    ----------
    path : Path
        Workbook with one sheet ``Sensors…`` or, without it, ``Channels…`` in threes; for impacts,
        ``Impacts…``.
    kind : type
        `PlacedSensor` or `PlacedImpact`.

    Returns
    -------
    tuple
        One per row. UFF nodes are those of a column ``NodeNumber``; without it the first row has
        node 1, the second node 2, and so on.

    Raises
    ------
    InputError
        No such sheet, or several of them; a column that is missing, a cell that is no number; a
        channel that is not where, or not directed as, its sensor is; three channels that are no
        right-handed set of axes.
    """
    if kind is PlacedImpact:
        sheet = _only_sheet(path, IMPACTS)
        rows = _rows(path, sheet, "impact", {"Position": (_AXES, "mm"), "Direction": _ALONG})
        return rows_of(kind, rows)
    names = sheet_names(path)
    if not any(name.startswith(SENSORS) for name in names):
        return rows_of(kind, _sensors_of_channels(path, _only_sheet(path, CHANNELS)))
    sheet = _only_sheet(path, SENSORS)
    turned = {"Position": (_AXES, "mm"), "Orientation": (_TURNS, "deg")}
    sensors = rows_of(PlacedSensor, _rows(path, sheet, "sensor", turned))
    suffix = sheet.removeprefix(SENSORS)
    if f"{CHANNELS}{suffix}" in names:
        _hold_against_channels(path, f"{CHANNELS}{suffix}", sensors)
    return sensors  # type: ignore[return-value]


def read_virtual_points(path: Path) -> dict[str, Vector]:
    """Read the positions of the virtual points of a workbook of pyFBS.

    - `path`: workbook with one sheet ``VP_Channels…``.
    - returns: ``Grouping`` of each point to its position [m].
    - raises InputError: no such sheet, or several; a column that is missing; a point whose rows
      state two positions.
    """
    sheet = _only_sheet(path, VIRTUAL_POINTS)
    columns = _columns(path, sheet, ("Grouping", *_three("Position")))
    with naming(_where(path, sheet)):
        positions = columns.numbers(*_three("Position")).T
    points: dict[str, Vector] = {}
    with telling() as tell:
        for line, group, place in zip(
            columns.lines, columns.texts["Grouping"], positions, strict=True
        ):
            x, y, z = 1e-3 * place
            if points.setdefault(group, (x, y, z)) != (x, y, z):
                where = f"{_where(path, sheet)} line {line}"
                tell(InputError(f"{where}: virtual point {group} has two positions: correct one"))
    return points


def _three(stem: str) -> tuple[str, ...]:
    return tuple(f"{stem}_{number}" for number in (1, 2, 3))


_ALONG = (("dx", "dy", "dz"), "")


def _where(path: Path, sheet: str) -> Path:
    return path.with_name(f"{path.name}, sheet '{sheet}'")


def _only_sheet(path: Path, begin: str) -> str:
    sheets = [name for name in sheet_names(path) if name.startswith(begin)]
    if len(sheets) > 1:
        raise InputError(
            f"{path} has the sheets {', '.join(sheets)}: copy the one that belongs to these "
            "functions to a workbook of its own, with the sheets beside it"
        )
    if not sheets:
        raise InputError(f"{path} has no sheet whose name begins with '{begin}': add it")
    return sheets[0]


def _columns(path: Path, sheet: str, needed: Sequence[str]) -> Columns:
    columns = read_columns(path, "Name", sheet)
    refuse_all(
        f"{_where(path, sheet)}: column '{name}' is missing; a sheet of pyFBS has "
        f"{', '.join(needed)}"
        for name in needed
        if name not in columns.texts
    )
    return columns


def _rows(
    path: Path, sheet: str, item: str, vectors: Mapping[str, tuple[tuple[str, ...], str]]
) -> list[Row]:
    """Rows of a sheet under the names of deboom's columns."""
    needed = ("Name", *(name for stem in vectors for name in _three(stem)))
    columns = _columns(path, sheet, needed)
    names: dict[str, str] = {"Name": item}
    units: dict[str, Unit] = {}
    for stem, (axes, unit) in vectors.items():
        names |= dict(zip(_three(stem), axes, strict=True))
        units |= {axis: parse_unit(unit) for axis in axes if unit}
    cells = {new: columns.texts[old] for old, new in names.items()}
    cells["node"] = columns.texts.get("NodeNumber", [str(n + 1) for n in range(len(columns.lines))])
    return [
        Row(_where(path, sheet), line, {name: cells[name][n] for name in cells}, units)
        for n, line in enumerate(columns.lines)
    ]


def _directions(path: Path, sheet: str) -> tuple[Columns, RealArray, RealArray]:
    """Columns of channels, their positions (n, 3) [mm] and directions (n, 3) [1]."""
    columns = _columns(path, sheet, ("Name", *_three("Position"), *_three("Direction")))
    with naming(_where(path, sheet)):
        numbers = columns.numbers(*_three("Position"), *_three("Direction")).T
    return columns, numbers[:, :3], numbers[:, 3:]


def _hold_against_channels(path: Path, sheet: str, sensors: Sequence[PlacedSensor]) -> None:
    """Refuse channels that do not lie where the angles and positions of their sensors say."""
    columns, places, directions = _directions(path, sheet)
    stated = {
        f"{sensor.sensor}{axis}": (1e3 * np.array(sensor.position), sensor.orientation[:, number])
        for sensor in sensors
        for number, axis in enumerate(_AXES)
    }
    with telling() as tell:
        for line, name, place, along in zip(
            columns.lines, columns.texts["Name"], places, directions, strict=True
        ):
            if name not in stated:
                continue  # a microphone, or a sensor with a single axis
            position, axis = stated[name]
            turn = float(np.degrees(np.arccos(np.clip(along @ axis / _length(along), -1.0, 1.0))))
            shift = float(np.linalg.norm(place - position))
            if turn > LARGEST_TURN or shift > LARGEST_SHIFT:
                tell(
                    InputError(
                        f"{_where(path, sheet)} line {line}: channel '{name}' lies {shift:.2f} mm "
                        f"and {turn:.1f}° from what its sensor's position and angles say: correct "
                        "one of both sheets"
                    )
                )


def _length(vector: RealArray) -> float:
    return float(np.linalg.norm(vector)) or 1.0


def _sensors_of_channels(path: Path, sheet: str) -> list[Row]:
    """Make triaxial sensors of each three channels with one name but for their last letter."""
    columns, places, directions = _directions(path, sheet)
    names, where = columns.texts["Name"], _where(path, sheet)
    node = columns.texts.get("NodeNumber")
    units = {axis: parse_unit("mm") for axis in _AXES} | {
        turn: parse_unit("deg") for turn in _TURNS
    }
    rows = []
    with telling() as tell:
        for first in range(0, len(names), 3):
            with noting(tell):
                three = names[first : first + 3]
                line, place = columns.lines[first], places[first]
                if [name[-1:].lower() for name in three] != list(_AXES) or len(
                    {name[:-1] for name in three}
                ) > 1:
                    raise InputError(
                        f"{where} line {line}: the channels {', '.join(three)} are no triaxial "
                        "sensor: list x, y and z of each below each other, or add a sheet Sensors"
                    )
                axes = directions[first : first + 3].T
                if np.abs(axes.T @ axes - np.eye(3)).max() > 1e-3 or np.linalg.det(axes) < 0:
                    raise InputError(
                        f"{where} line {line}: the directions of {', '.join(three)} are no "
                        "right-handed set of unit vectors at right angles: correct one of them"
                    )
                turns = np.rad2deg(rotation_angles(axes))
                cells = dict(zip((*_AXES, *_TURNS), map(str, (*place, *turns)), strict=True))
                cells |= {"sensor": three[0][:-1].strip()}
                cells["node"] = node[first] if node else str(first // 3 + 1)
                rows.append(Row(where, line, cells, units))
    return rows
