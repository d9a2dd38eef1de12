"""What the rigid body makes of its sensors: re-projected channels, and a sensor beside a mount."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray, RealArray
from deboom.measurement.campaign import AXES, OperatingRun
from deboom.measurement.channel_geometry import sensor_geometry
from deboom.measurement.quality import quality_in_operation
from deboom.measurement.quality_check import quality_table
from deboom.measurement.sensors import Sensor
from deboom.measurement.virtual_point import virtual_point
from deboom.mounts.alignment_estimate import AlignmentEstimate
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


def quality_of_motion(bench: CharacterisedBench) -> pd.DataFrame:
    """Judge the virtual points of each rigid body in the run shown, in the order of repair.

    Columns as of `deboom.measurement.quality_check.quality_table`; ``worst`` names a channel,
    sensor or motion, and leave-one-out the culprit with its likely fault.
    """
    run = shown_run(bench)
    tolerances = bench.result.campaign.tolerances
    rows: list[dict[str, object]] = []
    for chain in _rigid(bench):
        body = chain.alignment.body
        channels = {name for one in body.accelerometers for name in one.channels}
        off = sorted(channels - set(body.channels))
        point = virtual_point(sensor_geometry(body.accelerometers, switched_off=off))
        rows += quality_table(quality_in_operation(point, run.acceleration, tolerances=tolerances))
    return pd.DataFrame(rows, columns=["check", "number [1]", "limit", "verdict", "worst"])


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
