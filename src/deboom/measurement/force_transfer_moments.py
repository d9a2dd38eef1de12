"""Force transfer matrix with moments, and what it costs to leave the moments out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import AXES, Campaign
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
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.measurement.virtual_point import virtual_point


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


def moment_transfer_matrix(
    campaign: Campaign, mount: str, piece: str = "", *, band: Band | None = None
) -> ForceTransferMatrix:
    """6×6 force transfer matrix of one mount out of a campaign's shaker runs and pushes.

    Parameters
    ----------
    campaign : Campaign
        Its shaker runs push at the virtual point, its pushes beside it.
    mount, piece : str
        Where.
    band : (float, float), optional
        Lines to average, from and to [Hz]; by default all.

    Raises
    ------
    InputError
        No such mount, no push beside its virtual point, repeats that differ in number, and as
        `force_transfer_matrix_with_moments`.
    """
    name = " ".join(filter(None, (mount, piece)))
    places = {
        (known.name, known_piece): position
        for known in campaign.mounts
        for known_piece, position in zip(known.pieces, known.positions, strict=True)
    }
    if (mount, piece) not in places:
        raise InputError(f"campaign {campaign.name}: there is no mount '{name}'")
    position = np.array(places[mount, piece])
    pushes: dict[str, Impact] = {}
    answers: dict[int, list[Frf]] = {}
    for run in campaign.shaker_runs:
        if (run.mount, run.piece) == (mount, piece):
            (point,) = run.response.inputs
            pushes[point] = Impact(point, position, np.eye(3)[AXES.index(run.axis)])
            answers.setdefault(run.repeat, []).append(run.response)
    beside = [run for run in campaign.pushes if (run.mount, run.piece) == (mount, piece)]
    if not beside:
        raise InputError(
            f"campaign {campaign.name}: there is no push beside the virtual point of mount {name}, "
            "without which no moment is known"
        )
    for one in beside:
        pushes[one.push.name] = one.push
        answers.setdefault(one.repeat, []).append(one.response)
    incomplete = [repeat for repeat, found in answers.items() if len(found) != len(pushes)]
    if incomplete:
        raise InputError(
            f"campaign {campaign.name}, mount {name}: repeats {incomplete} lack some of the pushes "
            f"{list(pushes)}: measure them as well, or leave these repeats out"
        )
    cells = campaign.sensors_of(SensorKind.FORCE_CELL, (mount,), piece)
    return force_transfer_matrix_with_moments(
        tuple(pushes.values()),
        [_side_by_side(found, name) for found in answers.values()],
        cells,
        mount,
        position,
        piece,
        band=band,
    )


def _side_by_side(answers: Sequence[Frf], name: str) -> Frf:
    """One matrix out of the columns of several pushes."""
    frequency = common_lines(answers, name)
    first = answers[0]
    return Frf(
        frequency,
        np.concatenate([one.select(outputs=first.outputs).values for one in answers], axis=2),
        first.outputs,
        tuple(name for one in answers for name in one.inputs),
        first.unit,
    )


def without_moments(transfer: ForceTransferMatrix) -> ForceTransferMatrix:
    """Leave the moments of a force transfer matrix out: its 3×3 block of forces.

    Raises
    ------
    InputError
        A matrix without moments.
    """
    if not transfer.has_moments:
        raise InputError(
            f"mount {transfer.mount}: its force transfer matrix has no moments to leave out"
        )
    forces = slice(3)
    matrix = transfer.matrix[forces, forces]
    return replace(
        transfer,
        response=transfer.response[:, forces, forces],
        matrix=matrix,
        frequency_dependence=transfer.frequency_dependence[forces, forces],
        drift=transfer.drift[forces, forces],
        repeats=transfer.repeats[forces],
        condition_number=float(np.linalg.cond(matrix)),
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
    without = operating_force(without_moments(transfer), cell_force).values
    force = operating_force(transfer, cell_force).values
    if np.any(force == 0) or np.any(without == 0):
        raise InputError(f"mount {transfer.mount}: a force of exactly 0 has no level")
    return np.asarray(20 * np.log10(np.abs(without / force)))
