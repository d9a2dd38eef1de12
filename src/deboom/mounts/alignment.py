"""Everything about one body's sensors and cells that is known only within tolerances."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.measurement.tolerances import Tolerances
from deboom.mounts.instrumented_body import InstrumentedBody, MountPoint
from deboom.mounts.named_arrays import freeze
from deboom.physics.rigid_body import skew


class ErrorSource(Enum):
    """What may be wrong with a measuring chain."""

    SENSOR_POSITION = "sensor position"
    SENSOR_ANGLE = "sensor angle"
    SENSOR_GAIN = "sensor gain"
    SENSOR_CROSS_AXIS = "sensor cross-axis sensitivity"
    SHAKER_ANGLE = "shaker angle"
    SHAKER_GAIN = "shaker gain"
    CELL_GAIN = "cell gain"


@dataclass(frozen=True, eq=False)
class Alignment:
    """Parameters that say how the measuring chain of a body differs from its position sheet.

    Parameters
    ----------
    body : InstrumentedBody
        As the position sheet has it.
    names : tuple of str
        One per parameter, for messages.
    sources : tuple of ErrorSource
        One per parameter.
    tolerance : array, shape (n,)
        Standard deviation of each parameter about 0 [1, m or rad].
    forward_change : array, shape (n, n_channel, n_motion)
        Change of the forward matrix of the accelerometers per parameter.
    force_change : array, shape (n, 3 n_point, n_cell_channel)
        Change of the force matrix per parameter.

    Notes
    -----
    Linear in the parameters, which are small: half a degree leaves a rest of 4e-5.
    """

    body: InstrumentedBody
    names: tuple[str, ...]
    sources: tuple[ErrorSource, ...]
    tolerance: RealArray
    forward_change: RealArray
    force_change: RealArray

    def __post_init__(self) -> None:
        freeze(self, "tolerance", "forward_change", "force_change")

    def forward(self, parameters: npt.ArrayLike) -> RealArray:
        """Motion of the body → channels, for parameters (..., n): (..., n_channel, n_motion)."""
        return self.body.forward + np.tensordot(np.asarray(parameters), self.forward_change, 1)

    def motion_matrix(self, parameters: npt.ArrayLike) -> RealArray:
        """Channels → motion of the points by least squares, (..., 3 n_point, n_channel)."""
        orthonormal, triangle = np.linalg.qr(self.forward(parameters))
        inverse = np.linalg.solve(triangle, np.swapaxes(orthonormal, -1, -2))
        return np.asarray(self.body.at_points @ inverse)

    def force_matrix(self, parameters: npt.ArrayLike) -> RealArray:
        """Cell channels → force at the points, (..., 3 n_point, n_cell_channel)."""
        change = np.tensordot(np.asarray(parameters), self.force_change, 1)
        return np.asarray(self.body.force_matrix + change)


def alignment(body: InstrumentedBody, tolerances: Tolerances) -> Alignment:
    """List what may be wrong with a body's accelerometers, cells and their calibration.

    Parameters
    ----------
    body : InstrumentedBody
        With its sensors.
    tolerances : Tolerances
        How large each error usually is.

    Notes
    -----
    Channel c of a sensor with the rows ``B = Rᵀ [I, r̃ᵀ]`` truly reads ``B_c``, changed by its gain
    ``γ B_c``, by cross-axis sensitivity ``κ B_c'``, by a turn ``-(θ̃ B)_c`` about the sensor's own
    axes and by an offset ``(Rᵀ [0, δ̃ᵀ])_c``. A shaker that pushes along ``e_a + θ × e_a`` with
    ``1/(1+γ)`` of the force it states makes the force at the virtual point ``P FTM⁻¹ F`` with these
    vectors as the columns of P.
    """
    n_motion = body.forward.shape[1]
    rows = list(body.channel_rows)
    n_full, n_force = 3 * len(body.accelerometers), body.force_matrix.shape
    names: list[str] = []
    sources: list[ErrorSource] = []
    tolerance: list[float] = []
    forward_change: list[RealArray] = []
    force_change: list[RealArray] = []

    def add(
        name: str,
        source: ErrorSource,
        deviation: float,
        forward: RealArray | None = None,
        force: RealArray | None = None,
    ) -> None:
        names.append(name)
        sources.append(source)
        tolerance.append(deviation)
        forward_change.append(np.zeros((n_full, n_motion)) if forward is None else forward)
        force_change.append(np.zeros(n_force) if force is None else force)

    for place, sensor in enumerate(body.accelerometers):
        lever = -skew(sensor.position) if body.is_rigid_body else np.zeros((3, 0))
        sees = sensor.orientation.T @ np.hstack([np.eye(3), lever])
        block = slice(3 * place, 3 * place + 3)

        def at_sensor(change: RealArray, block: slice = block) -> RealArray:
            matrix = np.zeros((n_full, n_motion))
            matrix[block] = change
            return matrix

        for channel, name in enumerate(sensor.channels):
            for axis in range(3):
                change = np.zeros((3, n_motion))
                change[channel] = sees[axis]
                if axis == channel:
                    source, deviation = ErrorSource.SENSOR_GAIN, tolerances.sensor_gain
                    what = f"{source.value} of channel {name}"
                else:
                    source = ErrorSource.SENSOR_CROSS_AXIS
                    deviation = tolerances.sensor_cross_axis
                    what = f"{source.value} of channel {name} to {'xyz'[axis]}"
                add(what, source, deviation, forward=at_sensor(change))
        for axis, unit in enumerate(np.eye(3)):
            add(
                f"angle of sensor {sensor.name} about its {'xyz'[axis]}",
                ErrorSource.SENSOR_ANGLE,
                tolerances.sensor_angle,
                forward=at_sensor(-skew(unit) @ sees),
            )
            if body.is_rigid_body:
                shifted = sensor.orientation.T @ np.hstack([np.zeros((3, 3)), -skew(unit)])
                add(
                    f"position of sensor {sensor.name} along {'xyz'[axis]}",
                    ErrorSource.SENSOR_POSITION,
                    tolerances.sensor_position,
                    forward=at_sensor(shifted),
                )
    first_cell = 0
    for place, point in enumerate(body.points):
        columns = slice(first_cell, first_cell + 3 * len(point.cells))
        first_cell = columns.stop
        for name, source, deviation, change in _force_errors(point, tolerances):
            matrix = np.zeros(n_force)
            matrix[3 * place : 3 * place + 3, columns] = change
            add(name, source, deviation, force=matrix)
    return Alignment(
        body=body,
        names=tuple(names),
        sources=tuple(sources),
        tolerance=np.array(tolerance),
        forward_change=np.array(forward_change)[:, rows],
        force_change=np.array(force_change),
    )


def _force_errors(
    point: MountPoint, tolerances: Tolerances
) -> list[tuple[str, ErrorSource, float, RealArray]]:
    errors: list[tuple[str, ErrorSource, float, RealArray]] = []
    if not point.calibrated:
        for column, name in enumerate(point.cell_channels):
            change = np.zeros_like(point.force_matrix)
            change[:, column] = -point.force_matrix[:, column]
            what = f"gain of cell channel {name}"
            errors.append((what, ErrorSource.CELL_GAIN, tolerances.cell_gain, change))
        return errors
    for pushed in range(3):
        for felt in range(3):
            change = np.zeros_like(point.force_matrix)
            change[felt] = point.force_matrix[pushed]
            # the mean of a matrix that is not quite constant stands for every line
            scatter = point.transfer_scatter[felt, pushed]
            if felt == pushed:
                what = f"force of the shaker at {point.name} along {'xyz'[pushed]}"
                deviation = np.hypot(tolerances.shaker_gain, scatter)
                errors.append((what, ErrorSource.SHAKER_GAIN, deviation, change))
            else:
                what = (
                    f"angle of the shaker at {point.name} along {'xyz'[pushed]} towards "
                    f"{'xyz'[felt]}"
                )
                deviation = np.hypot(tolerances.shaker_angle, scatter)
                errors.append((what, ErrorSource.SHAKER_ANGLE, deviation, change))
    return errors
