"""Force transfer matrix with moments, and what it costs to leave the moments out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.measurement.channel_geometry import RIGID_LOADS, impact_geometry, sensor_geometry
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.conditioning import conditioning
from deboom.measurement.force_transfer import (
    Band,
    ForceTransferMatrix,
    averaged_matrix,
    cell_load,
    common_lines,
    operating_force,
)
from deboom.measurement.impacts import Impact
from deboom.measurement.sensors import Sensor
from deboom.measurement.virtual_point import load_at_point, virtual_point
from deboom.physics.arrays import RealArray
from deboom.physics.dynamic_stiffness import force_at_virtual_point


def force_transfer_matrix_with_moments(
    pushes: Sequence[Impact],
    repeats: Sequence[Frf],
    cells: Sequence[Sensor],
    mount: str,
    position: npt.ArrayLike,
    piece: str = "",
    *,
    band: Band | None = None,
) -> ForceTransferMatrix:
    """6×6 force transfer matrix of one mount out of pushes about its virtual point.

    Parameters
    ----------
    pushes : sequence of Impact
        At least six points and directions of the shaker, or of a hammer, that make up every force
        and every moment.
    repeats : sequence of Frf
        Outputs: channels of the cells; inputs: names of the pushes; all on the same lines [N/N].
    cells : sequence of Sensor
        All force cells below the mount; three or more that are not on one line. Two do not show
        the moment about the line that joins them.
    mount, piece : str
        Where.
    position : array, shape (3,)
        The virtual point [m].
    band : (float, float), optional
        Lines to average, from and to [Hz]; by default all.

    Raises
    ------
    InputError
        Pushes that do not make up, or cells that do not show, all six loads; no repeat, a missing
        channel, runs on different lines, no line in the band, or a matrix without an inverse.

    Notes
    -----
    ``FTM = S Y (U⁺)ᵀ``: S adds the cells' forces and moments about the virtual point, U⁺ is the
    virtual point transformation of the pushes. Only the force block is dimensionless.
    """
    name = " ".join(filter(None, (mount, piece)))
    if not repeats:
        raise InputError(f"mount {name}: there is no measurement for its force transfer matrix")
    frequency = common_lines(repeats, name)
    shown = conditioning(sensor_geometry(cells, position))
    if not shown.complete:
        raise InputError(
            f"mount {name}: the cells {[cell.name for cell in cells]} show {shown.rank} of six "
            "loads; three triaxial cells that are not on one line show all moments"
        )
    pushed = virtual_point(impact_geometry(pushes, position))
    loads = [
        cell_load(repeat.select(inputs=pushed.channels), cells, position, name) @ pushed.inverse.T
        for repeat in repeats
    ]
    return averaged_matrix(
        [[load[:, :, column] for load in loads] for column in range(len(RIGID_LOADS))],
        frequency,
        cells,
        mount,
        piece,
        position=np.asarray(position, dtype=float),
        length=pushed.conditioning.length,
        band=band,
    )


def level_without_moments(transfer: ForceTransferMatrix, cell_force: Spectrum) -> RealArray:
    """Level that leaving the moments out adds to the force of each path.

    Parameters
    ----------
    transfer : ForceTransferMatrix
        With moments.
    cell_force : Spectrum
        In operation [N].

    Returns
    -------
    array, shape (n_frequency, 3)
        ``20 lg |F_3×3 / F_6×6|`` along x, y, z [dB]: so much the path's contribution to the sound
        pressure changes as well.

    Raises
    ------
    InputError
        A matrix without moments, a missing cell channel, or a force of exactly 0.
    """
    if not transfer.has_moments:
        raise InputError(
            f"mount {transfer.mount}: its force transfer matrix has no moments to leave out"
        )
    load = load_at_point(transfer.cells, cell_force, transfer.position).values
    without = force_at_virtual_point(transfer.matrix[:3, :3], load[:, :3])
    force = operating_force(transfer, cell_force).values
    if np.any(force == 0) or np.any(without == 0):
        raise InputError(f"mount {transfer.mount}: a force of exactly 0 has no level")
    return np.asarray(20 * np.log10(np.abs(without / force)))
