"""Where each sensor sits and how it is turned: the table that makes channels mean something."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.physics.rigid_body import forward_matrices

SENSOR_AXES = ("x", "y", "z")


class SensorKind(Enum):
    """What a sensor measures."""

    ACCELEROMETER = "accelerometer"
    FORCE_CELL = "force cell"


@dataclass(frozen=True, eq=False)
class Sensor:
    """One triaxial sensor; its channels are ``<name> x``, ``<name> y`` and ``<name> z``.

    Parameters
    ----------
    name : str
        Such as ``A1``.
    kind : SensorKind
        What it measures: acceleration [m/s²] or force [N].
    model : str
        Type in the sensor catalogue, such as ``Kistler 9077C``.
    mount, piece : str
        The mount it belongs to and its piece; empty where there is none.
    position : array, shape (3,)
        In vehicle axes, from the powertrain's centre of gravity [m].
    orientation : array, shape (3, 3)
        Columns are the sensor's axes in vehicle axes [1].

    Raises
    ------
    InputError
        Shapes, or an orientation that is not a right-handed rotation.
    """

    name: str
    kind: SensorKind
    model: str
    mount: str
    piece: str
    position: npt.NDArray[np.float64]
    orientation: npt.NDArray[np.float64]

    def __post_init__(self) -> None:
        for name, shape in (("position", (3,)), ("orientation", (3, 3))):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise InputError(f"sensor {self.name}: {name} needs {shape} finite numbers")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        turned = self.orientation.T @ self.orientation
        if not np.allclose(turned, np.eye(3), atol=1e-6) or np.linalg.det(self.orientation) < 0:
            raise InputError(
                f"sensor {self.name}: its orientation is not a right-handed rotation; check the "
                "angles or the direction of each channel"
            )

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the three channels."""
        return tuple(f"{self.name} {axis}" for axis in SENSOR_AXES)


def forward_matrix_of(sensors: Sequence[Sensor]) -> npt.NDArray[np.float64]:
    """Forward matrix of several sensors: body motion at the origin → their channels.

    Parameters
    ----------
    sensors : sequence of Sensor
        n of them, with names of their own.

    Returns
    -------
    array, shape (3 n, 6)
        Row blocks ``R_iᵀ V_i`` (thesis, eq. 23 and 26) [1 and m].

    Raises
    ------
    InputError
        Duplicated names.
    """
    doubled = [name for name, count in Counter(s.name for s in sensors).items() if count > 1]
    if doubled:
        raise InputError(f"duplicated sensor {doubled}: every sensor needs a name of its own")
    positions = np.array([sensor.position for sensor in sensors])
    orientations = np.array([sensor.orientation for sensor in sensors])
    return np.asarray(forward_matrices(positions, orientations))
