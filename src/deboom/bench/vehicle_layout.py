"""Where a vehicle is hit and measured: names, places and nodes around every interface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.campaign_layout import accelerometer_places
from deboom.bench.ears import EARS
from deboom.bench.frozen import freeze_arrays
from deboom.bench.interfaces import interfaces
from deboom.bench.parameters import AXES, VirtualBench
from deboom.bench.platform_layout import FIRST_EAR_NODE
from deboom.physics.rigid_body import forward_matrices, rotation_matrix

FIRST_IMPACT_NODE = 301
FIRST_BODY_SENSOR_NODE = 401
EAR_NODES = {ear: FIRST_EAR_NODE + number for number, ear in enumerate(EARS)}
"""The driver's ear has the node of the first vehicle of a platform; a folder holds one vehicle."""

MICROPHONES = {"driver ear": "MIC2101", "passenger ear": "MIC2102"}
"""Serial numbers: one microphone per ear, the same in all of its functions."""

IMPACT_OFFSETS = ((0.05, 0.02, 0.0), (-0.03, 0.05, 0.02), (-0.02, -0.05, -0.03))
"""Three points around a mount that a hammer reaches, from the virtual point [m]."""

PUSHES = ((1, 1, -1), (-1, 1, -1), (1, -1, 1))
"""To which side each point is hit along x, y and z: the hammer comes from where there is room."""

BODY_SENSOR_OFFSETS = ((0.06, -0.02, 0.01), (-0.04, 0.05, -0.02), (-0.02, -0.06, 0.03))
"""Three triaxial accelerometers on the body around a mount, from the virtual point [m]."""

BODY_SENSOR_ANGLES = ((0.0, 0.0, 0.0), (0.0, 0.0, 90.0), (180.0, 0.0, 0.0))
"""How they are glued on, known: about the fixed axes x, then y, then z [deg]."""


@dataclass(frozen=True, eq=False)
class ImpactPlace:
    """One blow of the hammer.

    Parameters
    ----------
    name : str
        Such as ``I3 y``.
    mount, piece : str
        Around which it lies.
    node : int
        Of the point in the UFF files.
    direction : str
        Of a positive force, such as ``-y``.
    position : array, shape (3,)
        From the powertrain's centre of gravity [m].
    """

    name: str
    mount: str
    piece: str
    node: int
    direction: str
    position: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def vector(self) -> RealArray:
        """Unit vector along `direction`."""
        sign = -1.0 if self.direction.startswith("-") else 1.0
        return np.array([sign * (axis == self.direction[1:]) for axis in AXES])


@dataclass(frozen=True, eq=False)
class SensorPlace:
    """One triaxial accelerometer of the vehicle.

    Parameters
    ----------
    name : str
        Such as ``B4`` on the body, ``A2`` on the powertrain or a wheel end.
    mount, piece : str
        At which it sits.
    node : int
        In the UFF files.
    position : array, shape (3,)
        From the powertrain's centre of gravity [m].
    angles : (rx, ry, rz)
        That turn vehicle axes into its own, about the fixed axes x, then y, then z [deg].
    """

    name: str
    mount: str
    piece: str
    node: int
    position: RealArray
    angles: tuple[float, float, float]

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def channels(self) -> tuple[str, ...]:
        """Such as ``B4 x``."""
        return tuple(f"{self.name} {axis}" for axis in AXES)


def impact_places(bench: VirtualBench) -> tuple[ImpactPlace, ...]:
    """Return nine blows per interface: three points, three directions."""
    places = []
    for number, interface in enumerate(interfaces(bench)):
        for k, (offset, pushes) in enumerate(zip(IMPACT_OFFSETS, PUSHES, strict=True)):
            point = len(IMPACT_OFFSETS) * number + k
            for axis, push in zip(AXES, pushes, strict=True):
                places.append(
                    ImpactPlace(
                        name=f"I{point + 1} {axis}",
                        mount=interface.mount,
                        piece=interface.piece,
                        node=FIRST_IMPACT_NODE + point,
                        direction=f"{'+' if push > 0 else '-'}{axis}",
                        position=interface.position + np.array(offset),
                    )
                )
    return tuple(places)


def body_sensor_places(bench: VirtualBench) -> tuple[SensorPlace, ...]:
    """Return three triaxial accelerometers per interface, on the body."""
    glued = list(zip(BODY_SENSOR_OFFSETS, BODY_SENSOR_ANGLES, strict=True))
    where = [
        (interface, offset, angles) for interface in interfaces(bench) for offset, angles in glued
    ]
    return tuple(
        SensorPlace(
            name=f"B{number + 1}",
            mount=interface.mount,
            piece=interface.piece,
            node=FIRST_BODY_SENSOR_NODE + number,
            position=interface.position + np.array(offset),
            angles=angles,
        )
        for number, (interface, offset, angles) in enumerate(where)
    )


def source_sensor_places(bench: VirtualBench) -> tuple[SensorPlace, ...]:
    """Return two accelerometers per mount on the powertrain, one on each wheel end."""
    return tuple(
        SensorPlace(p.sensor, p.mount, p.piece, p.node, p.position, (0.0, 0.0, 0.0))
        for p in accelerometer_places(bench)
    )


def impact_rows(
    bench: VirtualBench, positions: RealArray, directions: RealArray
) -> tuple[RealArray, ...]:
    """Return per interface what the given blows push: rows ``dᵀ V``, shape (9, 6) each."""
    virtual_points = np.array([interface.position for interface in interfaces(bench)])
    levers = positions.reshape(len(virtual_points), -1, 3) - virtual_points[:, None]
    forward = forward_matrices(levers.reshape(-1, 3)).reshape(-1, 3, 6)
    rows = np.einsum("ca,cab->cb", directions, forward)
    return tuple(rows.reshape(len(virtual_points), -1, 6))


def sensor_rows(
    bench: VirtualBench, positions: RealArray, orientations: RealArray
) -> tuple[RealArray, ...]:
    """Return per interface what the given accelerometers see: rows ``Rᵀ V``, shape (9, 6) each."""
    virtual_points = np.array([interface.position for interface in interfaces(bench)])
    levers = positions.reshape(len(virtual_points), -1, 3) - virtual_points[:, None]
    rows = forward_matrices(levers.reshape(-1, 3), orientations)
    return tuple(rows.reshape(len(virtual_points), -1, 6))


def orientations(places: tuple[SensorPlace, ...]) -> RealArray:
    """Return the rotation of each sensor, columns are its axes, shape (n, 3, 3)."""
    return rotation_matrix(np.deg2rad([place.angles for place in places]))
