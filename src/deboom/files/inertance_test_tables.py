"""The position sheets of a roving-hammer test: sensors and impacts, CSV or one Excel file."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
import pandas as pd

from deboom.errors import InputError
from deboom.files.atomic import replace_bytes, replace_text
from deboom.files.table_cells import Row, read_rows, refuse_second

SENSOR_SHEET, IMPACT_SHEET = "sensors", "impacts"
SMALLEST_SPAN, LARGEST_SPAN = 0.01, 10.0
"""Of the points of one sheet [m]: beyond, its unit is wrong."""

_AXES = ("x", "y", "z")
_ANGLES = ("rx", "ry", "rz")
_DIRECTION = ("dx", "dy", "dz")
_ANY_TIME = re.compile(rb"(<dcterms:(?:created|modified)[^>]*>)[^<]*")

Three = tuple[float, float, float]


@dataclass(frozen=True)
class PlacedSensor:
    """One triaxial accelerometer of the position sheet.

    Parameters
    ----------
    sensor : str
        Name, such as ``A1``; its channels are ``A1 x``, ``A1 y``, ``A1 z``.
    node : int
        In the UFF files, where directions are those of the sensor's own axes.
    position : (x, y, z)
        [m].
    angles : (rx, ry, rz)
        That turn the axes of the sheet into the sensor's, about the fixed axes x, then y, then z
        [rad].
    """

    sensor: str
    node: int
    position: Three
    angles: Three


@dataclass(frozen=True)
class PlacedImpact:
    """One place where the hammer strikes, and along which way.

    Parameters
    ----------
    impact : str
        Name, such as ``I07``.
    node : int
        In the UFF files; impacts of different directions may share one.
    position : (x, y, z)
        [m].
    direction : (dx, dy, dz)
        Unit vector along which a positive force pushes [1].
    """

    impact: str
    node: int
    position: Three
    direction: Three

    @property
    def uff_direction(self) -> str:
        """``+x`` … ``-z`` along an axis, else ``scalar``."""
        for axis, component in zip(_AXES, self.direction, strict=True):
            if abs(component) > 1.0 - 1e-6:
                return f"{'+' if component > 0 else '-'}{axis}"
        return "scalar"


def read_placed_sensors(path: Path) -> tuple[PlacedSensor, ...]:
    """Read the table ``sensor, node, x [mm], y [mm], z [mm], rx [deg], ry [deg], rz [deg]``.

    Raises
    ------
    InputError
        No such table; a column or a unit is missing; a name or node comes twice; no number;
        positions that no machine on mounts has.
    """
    units = dict.fromkeys(_AXES, "m") | dict.fromkeys(_ANGLES, "rad")
    seen: dict[str, int] = {}
    sensors = []
    for row in read_rows(path, ("sensor", "node"), units, SENSOR_SHEET):
        sensor = PlacedSensor(
            row.filled("sensor"), row.node(), _three(row, _AXES), _three(row, _ANGLES)
        )
        for key in (f"sensor '{sensor.sensor}'", f"node {sensor.node}"):
            refuse_second(seen, key, row)
        sensors.append(sensor)
    _check_span(path, "sensors", [sensor.position for sensor in sensors])
    return tuple(sensors)


def read_placed_impacts(path: Path) -> tuple[PlacedImpact, ...]:
    """Read the table ``impact, node, x [mm], y [mm], z [mm], dx, dy, dz``.

    Raises
    ------
    InputError
        No such table; a column or a unit is missing; a name, or a node with its direction, comes
        twice; no number; positions that no machine on mounts has.
    """
    seen: dict[str, int] = {}
    impacts = []
    columns = ("impact", "node", *_DIRECTION)
    for row in read_rows(path, columns, dict.fromkeys(_AXES, "m"), IMPACT_SHEET):
        impact = PlacedImpact(
            row.filled("impact"), row.node(), _three(row, _AXES), _three(row, _DIRECTION)
        )
        pushed = f"node {impact.node} along {impact.uff_direction.lstrip('+-')}"
        for key in (f"impact '{impact.impact}'", pushed):
            refuse_second(seen, key, row)
        impacts.append(impact)
    _check_span(path, "impacts", [impact.position for impact in impacts])
    return tuple(impacts)


def write_positions(
    path: Path, sensors: Sequence[PlacedSensor], impacts: Sequence[PlacedImpact]
) -> None:
    """Write both tables as the sheets of one Excel file, in mm and degrees.

    The same rows give the same bytes: the file carries no time.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    book = io.BytesIO()
    with pd.ExcelWriter(book) as writer:
        _sensor_frame(sensors).to_excel(writer, sheet_name=SENSOR_SHEET, index=False)
        _impact_frame(impacts).to_excel(writer, sheet_name=IMPACT_SHEET, index=False)
    replace_bytes(path, _without_times(book.getvalue()))


def write_placed_sensors(path: Path, sensors: Sequence[PlacedSensor]) -> None:
    """Write the table that `read_placed_sensors` reads as CSV, in mm and degrees.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    replace_text(path, _sensor_frame(sensors).to_csv(index=False, lineterminator="\n"))


def write_placed_impacts(path: Path, impacts: Sequence[PlacedImpact]) -> None:
    """Write the table that `read_placed_impacts` reads as CSV, in mm.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    replace_text(path, _impact_frame(impacts).to_csv(index=False, lineterminator="\n"))


def _sensor_frame(sensors: Sequence[PlacedSensor]) -> pd.DataFrame:
    return pd.DataFrame(
        [
            (s.sensor, s.node, *_rounded(s.position, 1e3), *_rounded(s.angles, 180 / math.pi))
            for s in sensors
        ],
        columns=[
            *("sensor", "node"),
            *(f"{axis} [mm]" for axis in _AXES),
            *(f"{angle} [deg]" for angle in _ANGLES),
        ],
    )


def _impact_frame(impacts: Sequence[PlacedImpact]) -> pd.DataFrame:
    return pd.DataFrame(
        [(i.impact, i.node, *_rounded(i.position, 1e3), *i.direction) for i in impacts],
        columns=["impact", "node", *(f"{axis} [mm]" for axis in _AXES), *_DIRECTION],
    )


def _rounded(values: Three, factor: float) -> list[float]:
    """Scaled, and without the digits that the scaling made."""
    rounded: list[float] = np.round(factor * np.array(values), 10).tolist()
    return rounded


def _without_times(data: bytes) -> bytes:
    """Return an Excel file whose entries and properties state no time of writing."""
    fixed = io.BytesIO()
    with ZipFile(io.BytesIO(data)) as book, ZipFile(fixed, "w", ZIP_DEFLATED) as out:
        for name in book.namelist():
            content = _ANY_TIME.sub(rb"\g<1>2000-01-01T00:00:00Z", book.read(name))
            out.writestr(ZipInfo(name), content, ZIP_DEFLATED)
    return fixed.getvalue()


def _three(row: Row, columns: Sequence[str]) -> Three:
    first, second, third = (row.number(column) for column in columns)
    return first, second, third


def _check_span(path: Path, what: str, positions: Sequence[Three]) -> None:
    """Refuse a unit that is wrong by a factor of a thousand."""
    points = np.array(positions)
    span = float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))
    if len(points) > 1 and not SMALLEST_SPAN <= span <= LARGEST_SPAN:
        raise InputError(
            f"{path}: the {what} lie within {span:.3g} m: is the unit in the header of x, y and z "
            "the one of the numbers? mm and m are mixed up easily"
        )
