"""A moving body as the position sheet describes it: its accelerometers, its mounts, their cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import AXES, Campaign
from deboom.measurement.channel_geometry import sensor_geometry
from deboom.measurement.force_transfer import ForceTransferMatrix, force_transfer_matrix
from deboom.measurement.sensors import SENSOR_AXES, Sensor, SensorKind
from deboom.measurement.virtual_point import virtual_point
from deboom.mounts.named_arrays import freeze
from deboom.physics.rigid_body import forward_matrices

POWERTRAIN = "powertrain"


@dataclass(frozen=True, eq=False)
class MountPoint:
    """Where one mount, or one piece of it, holds a body.

    Parameters
    ----------
    mount, piece : str
        Which; the piece of a single one is ``""``.
    position : array, shape (3,)
        Virtual point, from the powertrain's centre of gravity [m].
    axes : tuple of str
        Directions that are characterised here.
    cells : tuple of Sensor
        That carry its force together.
    force_matrix : array, shape (3, 3 n_cell)
        Cell channels → force at the virtual point [1].
    calibrated : bool
        Whether a shaker at the virtual point calibrated the cells.
    transfer_scatter : array, shape (3, 3)
        Standard deviation of the calibration over frequency and repeats, relative to it [1].
    """

    mount: str
    piece: str
    position: RealArray
    axes: tuple[str, ...]
    cells: tuple[Sensor, ...]
    force_matrix: RealArray
    calibrated: bool
    transfer_scatter: RealArray

    def __post_init__(self) -> None:
        freeze(self, "position", "force_matrix", "transfer_scatter")

    @property
    def name(self) -> str:
        """``<mount> [<piece>]``."""
        return " ".join(filter(None, (self.mount, self.piece)))

    @property
    def cell_channels(self) -> tuple[str, ...]:
        """Three per cell."""
        return tuple(channel for cell in self.cells for channel in cell.channels)


@dataclass(frozen=True, eq=False)
class InstrumentedBody:
    """A body, the accelerometers on it, and the points at which mounts hold it.

    Parameters
    ----------
    name : str
        ``powertrain``, or the piece of a mount that carries a body of its own, as ``Du left``.
    accelerometers : tuple of Sensor
        On the body.
    channels : tuple of str
        Their channels in use.
    forward : array, shape (n_channel, n_motion)
        Motion of the body → channels. Six motions; the three translations of a body with a single
        sensor, which is taken to move as its mount does [1, m].
    points : tuple of MountPoint
        Its mounts.
    """

    name: str
    accelerometers: tuple[Sensor, ...]
    channels: tuple[str, ...]
    forward: RealArray
    points: tuple[MountPoint, ...]

    def __post_init__(self) -> None:
        freeze(self, "forward")

    @property
    def is_rigid_body(self) -> bool:
        """Whether all six motions are measured."""
        return len(self.forward.T) == 6

    @property
    def channel_rows(self) -> tuple[int, ...]:
        """Place of each channel in use among the three of every accelerometer."""
        all_channels = [name for sensor in self.accelerometers for name in sensor.channels]
        return tuple(all_channels.index(name) for name in self.channels)

    @property
    def at_points(self) -> RealArray:
        """Motion of the body → motion of its points, x y z each, shape (3 n_point, n_motion)."""
        if not self.is_rigid_body:
            return np.eye(3)
        return forward_matrices([point.position for point in self.points])

    @property
    def cell_channels(self) -> tuple[str, ...]:
        """Of all points."""
        return tuple(channel for point in self.points for channel in point.cell_channels)

    @property
    def force_matrix(self) -> RealArray:
        """Cell channels → force at the points, x y z each, shape (3 n_point, n_cell_channel)."""
        return np.asarray(block_diag(*[point.force_matrix for point in self.points]))

    @property
    def directions(self) -> tuple[str, ...]:
        """``<mount> [<piece>] <axis>`` of all rows of `at_points`."""
        return tuple(f"{point.name} {axis}" for point in self.points for axis in AXES)


def instrumented_bodies(campaign: Campaign) -> tuple[InstrumentedBody, ...]:
    """Sort a campaign's sensors and mounts by the bodies that they belong to.

    Parameters
    ----------
    campaign : Campaign
        Its position sheet, mounts and shaker runs.

    Returns
    -------
    tuple of InstrumentedBody
        The powertrain, then each piece of every mount that carries a body of its own.

    Raises
    ------
    InputError
        Accelerometers that do not determine the motion of their body, a mount without cells, cell
        channels that are switched off, or shaker runs that do not determine the force.
    """
    powertrain = [m for m in campaign.mounts if m.name in campaign.powertrain_mounts]
    bodies = []
    if powertrain:
        points = tuple(
            _mount_point(campaign, mount.name, piece, np.array(position), AXES)
            for mount in powertrain
            for piece, position in zip(mount.pieces, mount.positions, strict=True)
        )
        bodies.append(_rigid_body(campaign, points))
    for mount in campaign.mounts:
        if mount.name in campaign.powertrain_mounts:
            continue
        for piece, position in zip(mount.pieces, mount.positions, strict=True):
            point = _mount_point(
                campaign, mount.name, piece, np.array(position), mount.transfer_axes
            )
            bodies.append(_single_sensor_body(campaign, point))
    return tuple(bodies)


def _rigid_body(campaign: Campaign, points: tuple[MountPoint, ...]) -> InstrumentedBody:
    sensors = campaign.sensors_of(SensorKind.ACCELEROMETER, campaign.powertrain_mounts)
    geometry = sensor_geometry(sensors, switched_off=_of(campaign.switched_off, sensors))
    point = virtual_point(geometry)
    return InstrumentedBody(POWERTRAIN, sensors, point.channels, point.forward, points)


def _single_sensor_body(campaign: Campaign, point: MountPoint) -> InstrumentedBody:
    sensors = campaign.sensors_of(SensorKind.ACCELEROMETER, (point.mount,), point.piece)
    off = _of(campaign.switched_off, sensors)
    if len(sensors) != 1 or off:
        raise InputError(
            f"campaign {campaign.name}: {point.name} carries a body of its own and needs one "
            f"accelerometer with three channels; it has {[sensor.name for sensor in sensors]}, "
            f"switched off are {off}"
        )
    sensor = sensors[0]
    return InstrumentedBody(point.name, sensors, sensor.channels, sensor.orientation.T, (point,))


def _mount_point(
    campaign: Campaign, mount: str, piece: str, position: RealArray, axes: tuple[str, ...]
) -> MountPoint:
    cells = campaign.sensors_of(SensorKind.FORCE_CELL, (mount,), piece)
    owner = " ".join(filter(None, (f"campaign {campaign.name}: mount {mount}", piece)))
    if not cells:
        raise InputError(f"{owner} has no force cell: its stiffness cannot be measured")
    off = _of(campaign.switched_off, cells)
    if off:
        raise InputError(
            f"{owner}: the cell channels {off} are switched off, but the cells carry the force "
            "together: repair them, or leave the mount out of the campaign"
        )
    summed = np.hstack([cell.orientation for cell in cells])
    if not any((run.mount, run.piece) == (mount, piece) for run in campaign.shaker_runs):
        return MountPoint(mount, piece, position, axes, cells, summed, False, np.zeros((3, 3)))
    transfer = force_transfer_matrix(campaign.shaker_runs, cells, mount, piece)
    force_matrix = np.asarray(np.linalg.solve(transfer.matrix.real, summed), dtype=float)
    scatter = _transfer_scatter(transfer)
    return MountPoint(mount, piece, position, axes, cells, force_matrix, True, scatter)


def _of(switched_off: tuple[str, ...], sensors: tuple[Sensor, ...]) -> list[str]:
    own = {f"{sensor.name} {axis}" for sensor in sensors for axis in SENSOR_AXES}
    return [name for name in switched_off if name in own]


def _transfer_scatter(transfer: ForceTransferMatrix) -> RealArray:
    """Systematic part of what a force transfer matrix does over frequency and repeats.

    Notes
    -----
    A parabola over frequency keeps the smooth part (the bench gives way) and leaves the noise of
    single lines, which is no error of the mean.
    """
    matrix = transfer.matrix.real
    relative = np.linalg.solve(matrix, transfer.response).reshape(transfer.frequency.size, -1)
    lines = transfer.frequency / transfer.frequency[-1]
    terms = np.vander(lines, min(3, lines.size))
    smooth = terms @ np.linalg.lstsq(terms, relative, rcond=None)[0]
    deviation = smooth.reshape(-1, 3, 3) - np.eye(3)
    variance = np.mean(np.abs(deviation) ** 2, axis=0) + transfer.drift**2
    return np.asarray(np.sqrt(variance), dtype=float)
