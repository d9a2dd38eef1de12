"""Force transfer matrix: what the cells below a mount show of a force at its virtual point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.campaign import AXES, Campaign, ShakerRun
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import Impact, Sensor, SensorKind
from deboom.measurement.virtual_point import (
    RIGID_LOADS,
    conditioning,
    impact_geometry,
    load_at_point,
    sensor_geometry,
    virtual_point,
)
from deboom.physics.dynamic_stiffness import force_at_virtual_point

Band = tuple[float, float]
NO_LENGTH = 1.0
"""Characteristic length of a matrix without moments: it has nothing to scale [m]."""


@checked(
    position="3",
    frequency="f",
    response="f n n",
    matrix="n n",
    frequency_dependence="n n",
    drift="n n",
)
class ForceTransferMatrix:
    """Load on the cells per load at the virtual point, and how constant it is.

    - `position` (3,): virtual point about which moments are taken; without moments the middle of
      the cells [m].
    - `length`: characteristic length that makes moments comparable with forces [m]; 1 without
      moments.
    - `frequency` (n_frequency,).
    - `response` (n_frequency, n, n): mean over the repeats, line by line, n = 3 (forces) or 6 (with
      moments) [1, m, 1/m].
    - `matrix` (n, n).
    - `frequency_dependence` (n, n): largest deviation of `response` from `matrix` over the lines,
      relative to the norm of the matrix's column [1].
    - `drift` (n, n): largest deviation of one repeat's mean over the lines from `matrix`, relative
      to the same norm [1]; 0 for a single repeat, which cannot show any.
    - `residual`: rms deviation of all lines and repeats from `matrix`, relative to its rms column
      norm [1].
    """

    mount: str
    piece: str
    cells: tuple[Sensor, ...]
    position: RealArray
    length: float
    frequency: RealArray
    response: ComplexArray
    matrix: ComplexArray
    frequency_dependence: RealArray
    drift: RealArray
    repeats: tuple[int, ...]
    residual: float
    condition_number: float

    @property
    def has_moments(self) -> bool:
        """Whether moments are part of it."""
        return self.matrix.shape == (6, 6)

    def channels(self) -> tuple[str, ...]:
        """Names of the force at the virtual point, ``<mount> [<piece>] <axis>``."""
        return tuple(_name(self.mount, self.piece, axis) for axis in AXES)


def force_transfer_matrix(
    runs: Sequence[ShakerRun],
    cells: Sequence[Sensor],
    mount: str,
    piece: str = "",
    *,
    band: Band | None = None,
) -> ForceTransferMatrix:
    """Return the 3×3 force transfer matrix of one mount out of its shaker runs.

    Raises InputError: an axis without a run, a doubled repeat, runs on different lines, a cell that
    a run lacks, no line in the band, or a matrix without an inverse.

    Parameters
    ----------
    runs : sequence of ShakerRun
        Shaker runs, one or more repeats per axis; other mounts and pieces are not looked at.
    cells : sequence of Sensor — all force cells below the mount (piece)
    mount, piece : str — mount and piece
    band : (float, float), optional — lines to average, from and to [Hz]; by default all

    Notes
    -----
    Column a holds the summed cell forces per force of the shaker along a (thesis, eq. 29 and figure
    17). A tilted shaker or a wrong force of it is part of the result: its effect belongs into the
    error budget. Moments are left out; what that costs shows `moment_transfer_matrix`.
    """
    name = _name(mount, piece)
    chosen = [run for run in runs if (run.mount, run.piece) == (mount, piece)]
    missing = [axis for axis in AXES if axis not in {run.axis for run in chosen}]
    if missing:
        raise InputError(
            f"mount {name}: there is no shaker run along {', '.join(missing)}; a force transfer "
            "matrix needs x, y and z, measure the missing direction"
        )
    numbers = [(run.axis, run.repeat) for run in chosen]
    doubled = sorted({number for number in numbers if numbers.count(number) > 1})
    if doubled:
        raise InputError(f"mount {name}: shaker runs {doubled} (axis, repeat) occur twice")
    middle = np.mean([cell.position for cell in cells], axis=0) if cells else np.zeros(3)
    columns = [
        [
            _cell_load(run.response, cells, middle, name)[:, :3, 0]
            for run in sorted(chosen, key=lambda run: run.repeat)
            if run.axis == axis
        ]
        for axis in AXES
    ]
    frequency = _common_lines([run.response for run in chosen], name)
    return _averaged(columns, frequency, cells, (mount, piece), middle, NO_LENGTH, band)


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
    """Return the 6×6 force transfer matrix of one mount out of pushes about its virtual point.

    Raises InputError: pushes that do not make up, or cells that do not show, all six loads; no
    repeat, a missing channel, runs on different lines, no line in the band, or a matrix without an
    inverse.

    - `cells`: all force cells below the mount; three or more that are not on one line.
    - `mount`, `piece`, `band`: arguments as for `force_transfer_matrix`.
    - `position` (3,).

    ``FTM = S Y (U⁺)ᵀ``: S adds the cells' forces and moments about the virtual point, U⁺ is the
    virtual point transformation of the pushes. Only the force block is dimensionless.
    """
    name = _name(mount, piece)
    if not repeats:
        raise InputError(f"mount {name}: there is no measurement for its force transfer matrix")
    shown = conditioning(sensor_geometry(cells, position))
    if not shown.complete:
        raise InputError(
            f"mount {name}: the cells {[cell.name for cell in cells]} show {shown.rank} of six "
            "loads; three triaxial cells that are not on one line show all moments"
        )
    pushed = virtual_point(impact_geometry(pushes, position))
    loads = [
        _cell_load(repeat.select(inputs=pushed.channels), cells, position, name) @ pushed.inverse.T
        for repeat in repeats
    ]
    columns = [[load[:, :, column] for load in loads] for column in range(len(RIGID_LOADS))]
    frequency, length = _common_lines(repeats, name), pushed.conditioning.length
    place = np.asarray(position, dtype=float)
    return _averaged(columns, frequency, cells, (mount, piece), place, length, band)


def moment_transfer_matrix(
    campaign: Campaign, mount: str, piece: str = "", *, band: Band | None = None
) -> ForceTransferMatrix:
    """Return the 6×6 force transfer matrix of one mount out of a campaign.

    Raises InputError: no such mount, no push beside its virtual point, repeats that differ in
    number, and as `force_transfer_matrix_with_moments`.

    - `campaign`: campaign whose shaker runs push at the virtual point, and whose pushes do beside
      it.
    - `mount`, `piece`, `band`: arguments as for `force_transfer_matrix`.
    """
    name = _name(mount, piece)
    places = {
        (known.name, known_piece): position
        for known in campaign.mounts
        for known_piece, position in zip(known.pieces, known.positions, strict=True)
    }
    if (mount, piece) not in places:
        raise InputError(f"campaign {campaign.name}: there is no mount '{name}'")
    position = np.array(places[mount, piece])
    beside = [run for run in campaign.pushes if (run.mount, run.piece) == (mount, piece)]
    if not beside:
        raise InputError(
            f"campaign {campaign.name}: there is no push beside the virtual point of mount {name}, "
            "without which no moment is known"
        )
    pushes: dict[str, Impact] = {}
    answers: dict[int, list[Frf]] = {}
    for run in campaign.shaker_runs:
        if (run.mount, run.piece) == (mount, piece):
            (point,) = run.response.inputs
            pushes[point] = Impact(point, position, np.eye(3)[AXES.index(run.axis)])
            answers.setdefault(run.repeat, []).append(run.response)
    for push in beside:
        pushes[push.push.name] = push.push
        answers.setdefault(push.repeat, []).append(push.response)
    incomplete = [repeat for repeat, parts in answers.items() if len(parts) != len(pushes)]
    if incomplete:
        raise InputError(
            f"campaign {campaign.name}, mount {name}: repeats {incomplete} lack some of the pushes "
            f"{list(pushes)}: measure them as well, or leave these repeats out"
        )
    return force_transfer_matrix_with_moments(
        tuple(pushes.values()),
        [_side_by_side(parts, name) for parts in answers.values()],
        campaign.sensors_of(SensorKind.FORCE_CELL, (mount,), piece),
        mount,
        position,
        piece,
        band=band,
    )


def without_moments(transfer: ForceTransferMatrix) -> ForceTransferMatrix:
    """Leave the moments of a 6×6 force transfer matrix out: its 3×3 block of forces."""
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


def operating_force(transfer: ForceTransferMatrix, cell_force: Spectrum) -> Spectrum:
    """Return the force ``<mount> [<piece>] <axis>`` at the virtual point, ``FTM⁻¹ F_cells`` [N].

    A matrix with moments gives the same three, freed from the moments' share. A missing cell
    channel raises InputError.
    """
    load = load_at_point(transfer.cells, cell_force, transfer.position).values
    if transfer.has_moments:
        scale = _load_scale(transfer.length)
        scaled = transfer.matrix * np.outer(scale, 1 / scale)
        solved = np.linalg.solve(scaled, (load * scale)[..., np.newaxis])
        force = np.asarray(solved[:, :3, 0], dtype=complex)
    else:
        force = force_at_virtual_point(transfer.matrix, load[:, :3])
    return Spectrum(cell_force.frequency, force, transfer.channels(), cell_force.unit)


def _averaged(
    columns: Sequence[Sequence[ComplexArray]],
    frequency: RealArray,
    cells: Sequence[Sensor],
    place: tuple[str, str],
    position: RealArray,
    length: float,
    band: Band | None,
) -> ForceTransferMatrix:
    """Average the repeats (n_frequency, n) of n loads over lines and repeats, and judge them."""
    name = _name(*place)
    lower, upper = band or (-np.inf, np.inf)
    used = (frequency >= lower) & (frequency <= upper)
    if not np.any(used):
        raise InputError(f"mount {name}: no line of its shaker runs lies in {lower}–{upper} Hz")
    stacks = [np.stack(repeats)[:, used] for repeats in columns]
    response = np.stack([stack.mean(axis=0) for stack in stacks], axis=2)
    matrix = response.mean(axis=0)
    scale = _load_scale(length)[: len(columns)]
    singular = np.linalg.svd(matrix * np.outer(scale, 1 / scale), compute_uv=False)
    if singular[-1] <= singular[0] * np.finfo(float).eps * len(columns):
        raise InputError(
            f"mount {name}: the force transfer matrix has no inverse, the cells do not tell the "
            "directions of its shaker runs apart"
        )
    relative = scale[:, np.newaxis] / np.linalg.norm(scale[:, np.newaxis] * matrix, axis=0)
    scatter, drift = [], []
    for column, stack in enumerate(stacks):
        deviation = relative[:, column] * (stack - matrix[:, column])
        scatter.append(np.mean(np.sum(np.abs(deviation) ** 2, axis=2)))
        drift.append(np.abs(deviation.mean(axis=1)).max(axis=0))
    return ForceTransferMatrix(
        mount=place[0],
        piece=place[1],
        cells=tuple(cells),
        position=position,
        length=length,
        frequency=frequency[used],
        response=response,
        matrix=matrix,
        frequency_dependence=np.abs(response - matrix).max(axis=0) * relative,
        drift=np.stack(drift, axis=1),
        repeats=tuple(len(stack) for stack in stacks),
        residual=float(np.sqrt(np.mean(scatter))),
        condition_number=float(singular[0] / singular[-1]),
    )


def _cell_load(
    response: Frf, cells: Sequence[Sensor], position: npt.ArrayLike, name: str
) -> ComplexArray:
    """Sum of the cells' forces and moments per input, shape (n_frequency, 6, n_input)."""
    if not cells:
        raise InputError(f"mount {name}: there is no force cell below it")
    geometry = sensor_geometry(cells, position)
    missing = [channel for channel in geometry.channels if channel not in response.outputs]
    if missing:
        raise InputError(f"mount {name}: a shaker run lacks the cell channels {missing}")
    return np.asarray(geometry.forward.T @ response.select(outputs=geometry.channels).values)


def _common_lines(responses: Sequence[Frf], name: str) -> RealArray:
    """Frequency axis that all responses share [Hz]."""
    frequency = responses[0].frequency
    if any(not np.array_equal(frequency, response.frequency) for response in responses):
        raise InputError(f"mount {name}: its shaker runs have different frequency lines")
    return frequency


def _side_by_side(answers: Sequence[Frf], name: str) -> Frf:
    """One matrix out of the columns of several pushes."""
    first = answers[0]
    return Frf(
        _common_lines(answers, name),
        np.concatenate([part.select(outputs=first.outputs).values for part in answers], axis=2),
        first.outputs,
        tuple(name for part in answers for name in part.inputs),
        first.unit,
    )


def _load_scale(length: float) -> RealArray:
    """Weight of three forces and three moments at which they are comparable [1, 1/m]."""
    return np.array([1.0] * 3 + [1 / length] * 3)


def _name(*parts: str) -> str:
    return " ".join(filter(None, parts))
