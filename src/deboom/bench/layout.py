"""Where the bench is measured: names, nodes, load cases, places of sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.operating_run import SIDES
from deboom.bench.powertrain import AXES, VirtualBench
from deboom.bench.sensors import ACCELEROMETER_OFFSETS

NAME = "u06_f39_f45"
TITLE = "Compact platform, three bodies"
DESCRIPTION = (
    "Virtual platform: three-cylinder engine across the front axle, three powertrain mounts and "
    "two wishbone mounts, bodies U06, F39 and F45 with five vehicles each; U06-5 carries a "
    "high-voltage battery. Measured on the virtual bench, with sensor and calibration errors."
)
CYLINDERS = 3

FREQUENCY = np.linspace(20.0, 80.0, 241)
"""Lines of every file [Hz]: 800 to 3200 rpm in steps of 10 rpm at order 1.5."""
FREQUENCY.setflags(write=False)

MOUNT_DESCRIPTIONS = {
    "EnM": "engine mount, right side, hydraulic along z",
    "GeM": "gearbox mount, left side",
    "TSM": "torque strut mount, low at the rear",
    "Du": "wishbone mounts, left and right",
}

WISHBONE_POSITIONS = ((0.15, -0.38, -0.33), (0.15, 0.38, -0.33))
"""Left and right, from the powertrain's centre of gravity [m]; for the drawing only."""

FIRST_POINT_NODE = 101
WISHBONE_NODES = (111, 112)
BOTH_WISHBONES_NODE = 110
FIRST_EAR_NODE = 901
"""Node numbers in the UFF files; every vehicle has an ear node of its own."""


@dataclass(frozen=True)
class LoadCasePlan:
    """A run-up with wide open throttle.

    Parameters
    ----------
    gear : int
        From 1.
    torque_limit : float
        Of the engine [N m].
    """

    gear: int
    torque_limit: float

    @property
    def name(self) -> str:
        """Short key, such as ``g5_wot220``."""
        return f"g{self.gear}_wot{self.torque_limit:.0f}"

    @property
    def title(self) -> str:
        """Such as ``5th gear, full load, 220 Nm``."""
        ordinal = {1: "1st", 2: "2nd", 3: "3rd"}.get(self.gear, f"{self.gear}th")
        return f"{ordinal} gear, full load, {self.torque_limit:.0f} Nm"


LOAD_CASES = tuple(
    LoadCasePlan(gear, limit)
    for gear, limit in ((5, 120.0), (5, 220.0), (6, 120.0), (6, 160.0), (6, 220.0), (7, 220.0))
)
DEFAULT_LOAD_CASE = "g5_wot220"


@dataclass(frozen=True)
class Point:
    """A virtual point: where operating motion and force are measured.

    Parameters
    ----------
    mount, piece : str
        Such as ``Du``, ``left``; a mount of one piece has the piece ``""``.
    node : int
        In the UFF files.
    axes : tuple of str
        Measured there.
    """

    mount: str
    piece: str
    node: int
    axes: tuple[str, ...]

    def channel(self, axis: str) -> str:
        """Return the name of a channel, such as ``Du left x``."""
        return " ".join(filter(None, (self.mount, self.piece, axis)))


@dataclass(frozen=True)
class ForcePath:
    """A force into the body: reference degree of freedom of a noise transfer function.

    Parameters
    ----------
    mount, axis : str
        Such as ``TSM``, ``x``.
    node : int
        In the UFF files.
    """

    mount: str
    axis: str
    node: int

    @property
    def name(self) -> str:
        """Such as ``TSM x``."""
        return f"{self.mount} {self.axis}"


def points(mount_names: tuple[str, ...]) -> tuple[Point, ...]:
    """Return the virtual points of the powertrain mounts and of both wishbone mounts."""
    powertrain = [
        Point(name, "", node, AXES) for node, name in enumerate(mount_names, FIRST_POINT_NODE)
    ]
    sides = zip(SIDES, WISHBONE_NODES, strict=True)
    return (*powertrain, *(Point("Du", side, node, ("x",)) for side, node in sides))


def paths(mount_names: tuple[str, ...]) -> tuple[ForcePath, ...]:
    """Return the forces into the body: per mount and axis, both wishbone mounts as one."""
    powertrain = [
        ForcePath(name, axis, node)
        for node, name in enumerate(mount_names, FIRST_POINT_NODE)
        for axis in AXES
    ]
    return (*powertrain, ForcePath("Du", "x", BOTH_WISHBONES_NODE))


ACCELEROMETER_MODEL = "B&K 4321"
CELL_MODEL = "Kistler 9077C"

CELL_OFFSETS = {
    "EnM": ((0.0, -0.06, -0.05), (0.0, 0.06, -0.05)),
    "GeM": ((0.0, -0.06, -0.05), (0.0, 0.06, -0.05)),
    "TSM": ((0.0, -0.04, -0.04), (0.0, 0.04, -0.04)),
}
"""Where the force cells sit, from the virtual point of their mount [m]."""

CELL_SHARES = (0.55, 0.45)
"""Share of the mount force that each of its cells carries: their stiffnesses differ [1]."""

THIRD_CELL_OFFSETS = {
    "EnM": (0.08, 0.0, -0.05),
    "GeM": (0.08, 0.0, -0.05),
    "TSM": (0.06, 0.0, -0.04),
}
"""Where a third cell sits, off the line through the others [m]."""

THREE_CELL_SHARES = (0.40, 0.33, 0.27)
"""The same of three cells [1]."""

PUSH_ARM = 0.05
"""How far beside the virtual point the shaker pushes [m]."""

SIDE_ACCELEROMETER_OFFSET = np.array([0.04, 0.0, 0.03])
SIDE_CELL_OFFSET = np.array([-0.03, 0.0, -0.02])
"""From the virtual point of a wishbone mount [m]."""

SIDE_CELL_ANGLES = (0.0, 8.0, 5.0)
"""The cells lie on the mounting face of the wishbone: about x, y, z [deg]."""

FIRST_ACCELEROMETER_NODE = 1
FIRST_CELL_NODE = 31
FIRST_PUSH_NODE = 301
"""Of the pushes beside the virtual points."""
ENGINE_NODE = 201
"""Engine torque about +ry and engine speed as a scalar."""

TACHO_NODE = 202


@dataclass(frozen=True, eq=False)
class Place:
    """The place of one sensor.

    Parameters
    ----------
    sensor : str
        Such as ``A1`` or ``C1``.
    mount, piece : str
        What it belongs to.
    node : int
        In the UFF files.
    position : array, shape (3,)
        From the true centre of gravity of the powertrain [m].
    """

    sensor: str
    mount: str
    piece: str
    node: int
    position: RealArray


@dataclass(frozen=True, eq=False)
class PushPlace:
    """A push of the shaker beside the virtual point of a mount.

    Parameters
    ----------
    name : str
        Such as ``P1``.
    mount : str
        Of the powertrain.
    node : int
        In the UFF files.
    position, offset : array, shape (3,)
        From the true centre of gravity, and from the virtual point [m].
    axis : int
        Along which it pushes.
    """

    name: str
    mount: str
    node: int
    position: RealArray
    offset: RealArray
    axis: int


def push_places(bench: VirtualBench) -> tuple[PushPlace, ...]:
    """Return the pushes across the ends of three arms, mount by mount: moments about all axes."""
    where = [
        (mount, position, PUSH_ARM * np.eye(3)[arm], axis)
        for mount, position in zip(bench.mount_names, bench.positions, strict=True)
        for arm in range(3)
        for axis in range(3)
        if axis != arm
    ]
    return tuple(
        PushPlace(f"P{n}", mount, FIRST_PUSH_NODE + n - 1, position + offset, offset, axis)
        for n, (mount, position, offset, axis) in enumerate(where, 1)
    )


def accelerometer_places(bench: VirtualBench) -> tuple[Place, ...]:
    """Return two accelerometers per powertrain mount, then one per wishbone mount."""
    return _places(
        bench, "A", FIRST_ACCELEROMETER_NODE, ACCELEROMETER_OFFSETS, SIDE_ACCELEROMETER_OFFSET
    )


def cell_offsets(mount: str, third_cell: bool = False) -> RealArray:
    """Return where the cells of a powertrain mount sit from its virtual point, (n_cell, 3) [m]."""
    third = (THIRD_CELL_OFFSETS[mount],) if third_cell else ()
    return np.array((*CELL_OFFSETS[mount], *third))


def cell_places(bench: VirtualBench, third_cell: bool = False) -> tuple[Place, ...]:
    """Return the cells under the powertrain mounts, then one per wishbone mount."""
    offsets = {
        mount: tuple(tuple(offset) for offset in cell_offsets(mount, third_cell).tolist())
        for mount in bench.mount_names
    }
    return _places(bench, "C", FIRST_CELL_NODE, offsets, SIDE_CELL_OFFSET)


def _places(
    bench: VirtualBench,
    letter: str,
    first_node: int,
    offsets: Mapping[str, tuple[tuple[float, ...], ...]],
    side_offset: RealArray,
) -> tuple[Place, ...]:
    where = [
        (mount, "", position + np.array(offset))
        for mount, position in zip(bench.mount_names, bench.positions, strict=True)
        for offset in offsets[mount]
    ]
    where += [
        ("Du", side, np.array(position) + side_offset)
        for side, position in zip(SIDES, WISHBONE_POSITIONS, strict=True)
    ]
    return tuple(
        Place(f"{letter}{number}", mount, piece, first_node + number - 1, position)
        for number, (mount, piece, position) in enumerate(where, 1)
    )
