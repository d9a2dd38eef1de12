"""Force transfer matrix: what the cells below a mount show of a force at its virtual point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deboom.arrays import AXES, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.campaign import ShakerRun
from deboom.measurement.channels import Frf
from deboom.measurement.sensors import Sensor


@checked(
    frequency="f",
    response="f 3 3",
    matrix="3 3",
    frequency_dependence="3 3",
    drift="3 3",
)
class ForceTransferMatrix:
    """Force on the cells per force at the virtual point, and how constant it is.

    Measured with a shaker at that point: thesis, section 3.3 and figure 17.

    - `frequency` (n_frequency,): lines [Hz].
    - `response` (n_frequency, 3, 3): mean over the repeats, line by line [1].
    - `matrix` (3, 3): mean of `response` over the lines, complex [1].
    - `frequency_dependence` (3, 3): largest deviation of `response` from `matrix` over the lines,
      relative to the norm of the matrix's column [1].
    - `drift` (3, 3): largest deviation of one repeat's mean over the lines from `matrix`, relative
      to the same norm [1]; 0 for a single repeat, which cannot show any.
    - `residual`: rms over columns, lines and repeats of the norm of the deviation from `matrix`,
      each column relative to its own norm [1].
    """

    mount: str
    piece: str
    cells: tuple[Sensor, ...]
    frequency: RealArray
    response: ComplexArray
    matrix: ComplexArray
    frequency_dependence: RealArray
    drift: RealArray
    repeats: tuple[int, ...]
    residual: float
    condition_number: float

    def channels(self) -> tuple[str, ...]:
        """Names of the force at the virtual point, ``<mount> [<piece>] <axis>``."""
        return tuple(_name(self.mount, self.piece, axis) for axis in AXES)


def force_transfer_matrix(
    runs: Sequence[ShakerRun],
    cells: Sequence[Sensor],
    mount: str,
    piece: str = "",
) -> ForceTransferMatrix:
    """Return the 3×3 force transfer matrix of one mount out of its shaker runs.

    Raises InputError: an axis without a run, a doubled repeat, runs on different lines, a cell that
    a run lacks, or a matrix without an inverse.

    Parameters
    ----------
    runs : sequence of ShakerRun
        Shaker runs, one or more repeats per axis; other mounts and pieces are not looked at.
    cells : sequence of Sensor — all force cells below the mount (piece)
    mount, piece : str — mount and piece

    Notes
    -----
    Column a holds the summed cell forces per force of the shaker along a (thesis, eq. 29 and figure
    17). A tilted shaker or a wrong force of it is part of the result: its effect belongs into the
    error budget. Moments are left out: no noise transfer function hears them.
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
    columns = [
        [
            _cell_force(run.response, cells, name)
            for run in sorted(chosen, key=lambda run: run.repeat)
            if run.axis == axis
        ]
        for axis in AXES
    ]
    frequency = _common_lines([run.response for run in chosen], name)
    stacks = [np.stack(repeats) for repeats in columns]
    response = np.stack([stack.mean(axis=0) for stack in stacks], axis=2)
    matrix = response.mean(axis=0)
    singular = np.linalg.svd(matrix, compute_uv=False)
    if singular[-1] <= singular[0] * np.finfo(float).eps * len(columns):
        raise InputError(
            f"mount {name}: the force transfer matrix has no inverse, the cells do not tell the "
            "directions of its shaker runs apart"
        )
    relative = 1 / np.linalg.norm(matrix, axis=0)
    scatter, drift = [], []
    for column, stack in enumerate(stacks):
        deviation = relative[column] * (stack - matrix[:, column])
        scatter.append(np.mean(np.sum(np.abs(deviation) ** 2, axis=2)))
        drift.append(np.abs(deviation.mean(axis=1)).max(axis=0))
    return ForceTransferMatrix(
        mount=mount,
        piece=piece,
        cells=tuple(cells),
        frequency=frequency,
        response=response,
        matrix=matrix,
        frequency_dependence=np.abs(response - matrix).max(axis=0) * relative,
        drift=np.stack(drift, axis=1),
        repeats=tuple(len(stack) for stack in stacks),
        residual=float(np.sqrt(np.mean(scatter))),
        condition_number=float(singular[0] / singular[-1]),
    )


def _cell_force(response: Frf, cells: Sequence[Sensor], name: str) -> ComplexArray:
    """Sum of the cells' forces in vehicle axes, shape (n_frequency, 3)."""
    if not cells:
        raise InputError(f"mount {name}: there is no force cell below it")
    channels = tuple(channel for cell in cells for channel in cell.channels)
    missing = [channel for channel in channels if channel not in response.outputs]
    if missing:
        raise InputError(f"mount {name}: a shaker run lacks the cell channels {missing}")
    values = response.select(outputs=channels).values[:, :, 0]
    return np.asarray(values @ np.vstack([cell.orientation.T for cell in cells]))


def _common_lines(responses: Sequence[Frf], name: str) -> RealArray:
    """Frequency axis that all responses share [Hz]."""
    frequency = responses[0].frequency
    if any(not np.array_equal(frequency, response.frequency) for response in responses):
        raise InputError(f"mount {name}: its shaker runs have different frequency lines")
    return frequency


def _name(*parts: str) -> str:
    return " ".join(filter(None, parts))
