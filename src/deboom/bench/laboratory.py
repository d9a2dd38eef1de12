"""What the laboratory makes of the raw channels: motion and force at the virtual points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray
from deboom.bench.frozen import freeze_arrays
from deboom.bench.sensors import LaboratoryKnowledge, RawChannels
from deboom.physics.dynamic_stiffness import displacement_from_acceleration


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """Measured spectra at the virtual points, in the channels of the operating run.

    Parameters
    ----------
    displacement : array, shape (f, n_channel)
        [m].
    force : array, shape (f, n_channel)
        [N].
    """

    displacement: ComplexArray
    force: ComplexArray

    def __post_init__(self) -> None:
        freeze_arrays(self)


def evaluate(knowledge: LaboratoryKnowledge, raw: RawChannels) -> MeasuredRun:
    """Refer the raw channels to the virtual points.

    Parameters
    ----------
    knowledge : LaboratoryKnowledge
        Nominal geometry and measured force transfer matrices.
    raw : RawChannels
        Of one run.

    Returns
    -------
    MeasuredRun
        Powertrain mounts by axis, then the wishbone mounts by side.

    Notes
    -----
    The body's acceleration follows from all accelerometers by least squares, the force from
    ``F = FTM⁻¹ F_cell``; a wishbone mount has its own sensor and cell and needs neither.
    """
    body_acceleration = np.linalg.lstsq(knowledge.sensor_forward, raw.acceleration.T, rcond=None)[0]
    point_acceleration = (knowledge.point_forward @ body_acceleration).T
    acceleration = np.hstack([point_acceleration, raw.side_acceleration])
    n_line = raw.frequency.size
    cells = raw.cell_force.reshape(n_line, -1, 3)
    at_point = np.linalg.solve(knowledge.force_transfer, cells[..., None])[..., 0]
    return MeasuredRun(
        displacement=displacement_from_acceleration(acceleration, raw.frequency),
        force=np.hstack([at_point.reshape(n_line, -1), raw.side_force]),
    )
