"""What the rigid body makes of its sensors: re-projected channels, and a sensor beside a mount."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.measurement.campaign import AXES, OperatingRun
from deboom.measurement.sensors import Sensor
from deboom.mounts.alignment_estimate import AlignmentEstimate
from deboom.physics.arrays import ComplexArray, RealArray
from deboom.study.characterisation import CharacterisedBench


@dataclass(frozen=True, eq=False)
class Reprojection:
    """One accelerometer, and what the motion of the whole body makes of it.

    Parameters
    ----------
    sensor : Sensor
        Beside one mount.
    measured, reprojected : array, shape (n_frequency, 3)
        In sensor axes [m/s²].
    """

    sensor: Sensor
    measured: ComplexArray
    reprojected: ComplexArray


@dataclass(frozen=True, eq=False)
class Neighbour:
    """A sensor in the place of the virtual point beside it, along one axis.

    Parameters
    ----------
    mount, axis, sensor : str
        Direction, and the sensor beside it.
    at_point, at_sensor : array, shape (n_frequency,)
        Acceleration at the virtual point and of the sensor, in vehicle axes [m/s²].
    """

    mount: str
    axis: str
    sensor: str
    at_point: ComplexArray
    at_sensor: ComplexArray

    @property
    def direction(self) -> str:
        """``<mount> <axis>``."""
        return f"{self.mount} {self.axis}"

    @property
    def error(self) -> RealArray:
        """Relative error of the stiffness magnitude by the sensor's motion, shape (n,)."""
        return np.asarray(np.abs(self.at_point) / np.abs(self.at_sensor) - 1)


def shown_run(bench: CharacterisedBench) -> OperatingRun:
    """Return the run that motions are shown of: of the check runs the one of most torque."""
    return max(bench.check_runs, key=lambda run: (run.torque_limit, -run.gear))


def reprojections(bench: CharacterisedBench) -> tuple[Reprojection, ...]:
    """Re-project the first sensor beside each mount of each rigid body, in the run shown."""
    run = shown_run(bench)
    found = []
    for chain in _rigid(bench):
        body = chain.alignment.body
        measured = run.acceleration.select(body.channels).values
        forward = chain.alignment.forward(chain.mean)
        again = np.asarray(measured @ np.linalg.pinv(forward).T @ forward.T, dtype=complex)
        for sensor in _beside_mounts(chain).values():
            columns = [body.channels.index(name) for name in sensor.channels]
            found.append(Reprojection(sensor, measured[:, columns], again[:, columns]))
    return tuple(found)


def neighbours(bench: CharacterisedBench) -> tuple[Neighbour, ...]:
    """Compare each virtual point of a rigid body with the first sensor beside it."""
    run = shown_run(bench)
    found = []
    for chain in _rigid(bench):
        body = chain.alignment.body
        at_points = run.acceleration.select(body.channels).values @ chain.motion_matrix.T
        beside = _beside_mounts(chain)
        for place, point in enumerate(body.points):
            if point.name not in beside:
                continue
            sensor = beside[point.name]
            turned = run.acceleration.select(sensor.channels).values @ sensor.orientation.T
            for row, axis in enumerate(AXES):
                if axis in point.axes:
                    column = at_points[:, 3 * place + row]
                    found.append(Neighbour(point.name, axis, sensor.name, column, turned[:, row]))
    return tuple(found)


def _rigid(bench: CharacterisedBench) -> list[AlignmentEstimate]:
    return [chain for chain in bench.result.chains if chain.alignment.body.is_rigid_body]


def _beside_mounts(chain: AlignmentEstimate) -> dict[str, Sensor]:
    """First sensor beside each point of a body whose three channels are all in use."""
    body = chain.alignment.body
    beside: dict[str, Sensor] = {}
    for point in body.points:
        for sensor in body.accelerometers:
            own = (sensor.mount, sensor.piece) == (point.mount, point.piece)
            if own and set(sensor.channels) <= set(body.channels):
                beside.setdefault(point.name, sensor)
    return beside
