"""Where the body of an electric car is struck and measured: around every mount and hose end.

The places around a point are those around a mount of the bench's other vehicles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import RealArray
from deboom.bench.compressor_rig import Placed, PlacementErrors, Sheet, place
from deboom.bench.electric_body import POINTS
from deboom.bench.frozen import freeze_arrays
from deboom.bench.parameters import AXES
from deboom.bench.vehicle_layout import (
    BODY_SENSOR_ANGLES,
    BODY_SENSOR_OFFSETS,
    IMPACT_OFFSETS,
    PUSHES,
)
from deboom.files.inertance_test_tables import PlacedImpact, PlacedSensor

FIRST_SENSOR_NODE, FIRST_IMPACT_NODE, FIRST_HOLDER_NODE = 401, 501, 301
EAR, EAR_NODE, MICROPHONE = "driver ear", 901, "MIC2101"

SHEET_DIGITS = 4
"""Of the positions on the sheet [m]."""


@dataclass(frozen=True, eq=False)
class PointSheet:
    """What is glued on and struck around one point.

    Parameters
    ----------
    name : str
        Such as ``mount 1``.
    position : array, shape (3,)
        Where the body truly takes its load, from the compressor's virtual point [m].
    sheet : Sheet
        Places as stated, from the true point.
    """

    name: str
    position: RealArray
    sheet: Sheet

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def short(self) -> str:
        """Such as ``M1`` or ``H2``."""
        kind, number = self.name.split()
        return f"{kind[0].upper()}{number}"

    def sensors(self) -> tuple[PlacedSensor, ...]:
        """Rows of the position sheet of its accelerometers."""
        first = FIRST_SENSOR_NODE + len(BODY_SENSOR_OFFSETS) * POINTS.index(self.name)
        return tuple(
            PlacedSensor(
                f"{self.short} S{number + 1}",
                first + number,
                _stated(self.position + offset),
                _three(angles),
            )
            for number, (offset, angles) in enumerate(
                zip(self.sheet.sensor_positions, self.sheet.sensor_angles, strict=True)
            )
        )

    def impacts(self) -> tuple[PlacedImpact, ...]:
        """Rows of the position sheet of the impacts around it; those of one place share a node."""
        first = FIRST_IMPACT_NODE + len(IMPACT_OFFSETS) * POINTS.index(self.name)
        rows = []
        for number, (offset, direction) in enumerate(
            zip(self.sheet.impact_positions, self.sheet.impact_directions, strict=True)
        ):
            place_number, axis = divmod(number, len(AXES))
            rows.append(
                PlacedImpact(
                    f"{self.short} I{place_number + 1}{AXES[axis]}",
                    first + place_number,
                    _stated(self.position + offset),
                    _three(direction),
                )
            )
        return tuple(rows)


def point_sheets(positions: dict[str, RealArray]) -> tuple[PointSheet, ...]:
    """Plan sensors and impacts around every point.

    Parameters
    ----------
    positions : dict of str to array, shape (3,)
        Every one of `POINTS`, from the compressor's virtual point [m].
    """
    sheets = []
    for name in POINTS:
        at = positions[name]
        pushes = np.concatenate([np.diag(signs) for signs in PUSHES]).astype(float)
        sheet = Sheet(
            sensor_positions=_on_sheet(at, BODY_SENSOR_OFFSETS),
            sensor_angles=np.deg2rad(BODY_SENSOR_ANGLES),
            impact_positions=np.repeat(_on_sheet(at, IMPACT_OFFSETS), len(AXES), axis=0),
            impact_directions=pushes,
        )
        sheets.append(PointSheet(name, at, sheet))
    return tuple(sheets)


@dataclass(frozen=True, eq=False)
class Setup:
    """How the body is truly instrumented and struck.

    Parameters
    ----------
    points : tuple of PointSheet
        As stated.
    placed : tuple of Placed
        As it is, per point; the gain of the one hammer in all of them.
    """

    points: tuple[PointSheet, ...]
    placed: tuple[Placed, ...]

    @property
    def hammer_gain(self) -> float:
        """Relative error of the force that the hammer states [1]."""
        return self.placed[0].hammer_gain

    @property
    def response_rows(self) -> RealArray:
        """Motions of all points to all channels, shape (n_channel, 6 n_point) [1, m]."""
        blocks = [
            placed.response_rows(point.sheet)
            for point, placed in zip(self.points, self.placed, strict=True)
        ]
        return np.asarray(block_diag(*blocks), dtype=np.float64)


def draw_setup(
    points: Sequence[PointSheet], errors: PlacementErrors, generator: np.random.Generator
) -> Setup:
    """Instrument the body with the errors of a laboratory, one hammer for all points."""
    placed = [place(point.sheet, errors, generator) for point in points]
    gain = placed[0].hammer_gain
    return Setup(tuple(points), tuple(replace(one, hammer_gain=gain) for one in placed))


def _on_sheet(at: RealArray, offsets: Sequence[tuple[float, float, float]]) -> RealArray:
    """Offsets whose ends a sheet states without rounding."""
    return np.asarray(np.round(at + np.array(offsets), SHEET_DIGITS) - at)


def _stated(position: RealArray) -> tuple[float, float, float]:
    return _three(np.round(position, SHEET_DIGITS))


def _three(values: RealArray) -> tuple[float, float, float]:
    x, y, z = np.asarray(values).tolist()
    return x, y, z
