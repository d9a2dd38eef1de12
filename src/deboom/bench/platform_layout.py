"""What the virtual platform is called and where it is measured: names, nodes, load cases."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.bench.operating_run import SIDES
from deboom.bench.parameters import AXES

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
