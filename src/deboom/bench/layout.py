"""Where the bench is measured: names, nodes, load cases, places of sensors and pushes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import AXES, RealArray
from deboom.bench.operating_run import PlannedRun
from deboom.bench.powertrain import SIDES, VirtualBench

FREQUENCY = np.linspace(20.0, 80.0, 241)
"""Lines of every file [Hz]: 800 to 3200 rpm in steps of 10 rpm at order 1.5."""
FREQUENCY.setflags(write=False)

LOAD_CASES = tuple(
    PlannedRun(gear, limit)
    for gear, limit in ((5, 120.0), (5, 220.0), (6, 120.0), (6, 160.0), (6, 220.0), (7, 220.0))
)

MOUNT_DESCRIPTIONS = {
    "EnM": "engine mount, right side, hydraulic along z",
    "GeM": "gearbox mount, left side",
    "TSM": "torque strut mount, low at the rear",
    "Du": "wishbone mounts, left and right",
}

WISHBONE_POSITIONS = ((0.15, -0.38, -0.33), (0.15, 0.38, -0.33))
"""Left and right, from the powertrain's centre of gravity [m]; for the drawing only."""

FIRST_POINT_NODE, WISHBONE_NODES, BOTH_WISHBONES_NODE, FIRST_EAR_NODE = 101, (111, 112), 110, 901
FIRST_ACCELEROMETER_NODE, FIRST_CELL_NODE = 1, 31
ENGINE_NODE, TACHO_NODE = 201, 202
"""Node numbers in the UFF files. Every vehicle has an ear node of its own; the engine's node has
the torque about +ry and the speed as a scalar."""

ACCELEROMETER_MODEL, CELL_MODEL = "B&K 4321", "Kistler 9077C"

ACCELEROMETER_OFFSETS = {
    "EnM": ((0.06, -0.05, 0.02), (-0.05, -0.03, -0.04)),
    "GeM": ((0.05, 0.05, 0.03), (-0.06, 0.04, -0.02)),
    "TSM": ((-0.07, 0.05, 0.03), (-0.05, -0.06, -0.03)),
}
CELL_OFFSETS = {
    "EnM": ((0.0, -0.06, -0.05), (0.0, 0.06, -0.05)),
    "GeM": ((0.0, -0.06, -0.05), (0.0, 0.06, -0.05)),
    "TSM": ((0.0, -0.04, -0.04), (0.0, 0.04, -0.04)),
}
SIDE_ACCELEROMETER_OFFSET = (0.04, 0.0, 0.03)
SIDE_CELL_OFFSET = (-0.03, 0.0, -0.02)
"""Where the sensors sit, from the virtual point of their mount [m]."""

CELL_SHARES = (0.55, 0.45)
"""Share of the mount force that each of its cells carries: their stiffnesses differ [1]."""


@dataclass(frozen=True, eq=False)
class Point:
    """A virtual point: where a mount, or one piece of it, meets the body.

    - `mount`, `piece`: names, such as ``Du``, ``left``; a mount of one piece has the piece ``""``.
    - `node`: node in the UFF files.
    - `axes`: axes along which operating motion and force are measured.
    - `position` (3,): position from the true centre of gravity of the powertrain [m].
    """

    mount: str
    piece: str
    node: int
    axes: tuple[str, ...]
    position: RealArray

    @property
    def name(self) -> str:
        """Name, such as ``TSM`` or ``Du left``."""
        return f"{self.mount} {self.piece}".strip()

    def channel(self, axis: str) -> str:
        """Return the name of a channel, such as ``Du left x``."""
        return f"{self.name} {axis}"


@dataclass(frozen=True, eq=False)
class Place:
    """Where a triaxial sensor sits near a virtual point, or where a push or blow acts.

    - `name`: name, such as ``A1`` on the powertrain, ``C1`` of a cell, ``B4`` on the body, ``P2``
      of a push or ``I3 y`` of a blow.
    - `point`: virtual point that it belongs to.
    - `node`: node in the UFF files.
    - `offset` (3,): from the virtual point [m].
    - `angles` (rx, ry, rz): angles that turn vehicle axes into a sensor's own, about the fixed axes
      x, then y, then z [deg].
    - `direction`: direction of a positive force, such as ``-y``; none of a sensor.
    """

    name: str
    point: Point
    node: int
    offset: RealArray
    angles: tuple[float, float, float] = (0.0, 0.0, 0.0)
    direction: str = ""

    @property
    def position(self) -> RealArray:
        """Position from the true centre of gravity of the powertrain, shape (3,) [m]."""
        return self.point.position + self.offset

    @property
    def vector(self) -> RealArray:
        """Unit vector along `direction`."""
        sign = -1.0 if self.direction.startswith("-") else 1.0
        return np.array([sign * (axis == self.direction[1:]) for axis in AXES])


def points(bench: VirtualBench) -> tuple[Point, ...]:
    """Return the virtual points of the powertrain mounts, then those of both wishbone mounts."""
    powertrain = [
        Point(mount, "", node, AXES, position)
        for node, (mount, position) in enumerate(
            zip(bench.mount_names, bench.positions, strict=True), FIRST_POINT_NODE
        )
    ]
    sides = zip(SIDES, WISHBONE_NODES, WISHBONE_POSITIONS, strict=True)
    return (
        *powertrain,
        *(Point("Du", side, node, ("x",), np.array(position)) for side, node, position in sides),
    )


def paths(bench: VirtualBench, per_piece: bool) -> tuple[Point, ...]:
    """Return where forces enter the body; both wishbone mounts are one path, or one each."""
    *powertrain, left, right = points(bench)
    sides = (left, right) if per_piece else (replace(left, piece="", node=BOTH_WISHBONES_NODE),)
    return (*powertrain, *sides)


def accelerometer_places(bench: VirtualBench) -> tuple[Place, ...]:
    """Return two accelerometers per powertrain mount, then one per wishbone mount."""
    offsets = [ACCELEROMETER_OFFSETS[mount] for mount in bench.mount_names]
    return _places(bench, "A", FIRST_ACCELEROMETER_NODE, offsets, SIDE_ACCELEROMETER_OFFSET)


def cell_places(bench: VirtualBench) -> tuple[Place, ...]:
    """Return the cells under the powertrain mounts, then one per wishbone mount."""
    offsets = [CELL_OFFSETS[mount] for mount in bench.mount_names]
    return _places(bench, "C", FIRST_CELL_NODE, offsets, SIDE_CELL_OFFSET)


def _places(
    bench: VirtualBench,
    letter: str,
    first_node: int,
    offsets: Sequence[RealArray | tuple[tuple[float, ...], ...]],
    side_offset: tuple[float, ...],
) -> tuple[Place, ...]:
    """Return the numbered sensors at their offsets from the virtual points."""
    around = (*offsets, *[(side_offset,)] * len(SIDES))
    where = [
        (point, np.array(offset))
        for point, of_point in zip(points(bench), around, strict=True)
        for offset in of_point
    ]
    return tuple(
        Place(f"{letter}{number}", point, first_node + number - 1, offset)
        for number, (point, offset) in enumerate(where, 1)
    )
