"""What the channels of one body recorded over several runs, line below line, and their noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.campaign import AXES, OperatingRun
from deboom.measurement.channels import Spectrum
from deboom.measurement.tolerances import Tolerances
from deboom.mounts.instrumented_body import InstrumentedBody

DEAD = 1e-3
"""A channel below this share of the median of its neighbours, over all lines, is dead [1]."""


@dataclass(frozen=True, eq=False)
class BodyRecord:
    """Lines of several operating runs of one body, one below the other.

    Parameters
    ----------
    run : array of str, shape (n,)
        Name of the run of each line.
    load_case : array of int, shape (n,)
        Lines of repeated runs (same gear, torque limit, kind and direction) share a number.
    frequency : array, shape (n,)
        [Hz].
    wheel_torque : array, shape (n,)
        [N m].
    wheel_torque_noise : array, shape (n,)
        Standard deviation of the reading [N m].
    static_force : array, shape (n, 3 n_point)
        Per direction of the body; nan where it was not measured [N].
    acceleration, acceleration_noise : array, shape (n, n_channel)
        Complex peak, and standard deviation of its noise by the stated tolerances [m/s²].
    cell_force, cell_noise : array, shape (n, n_cell_channel)
        The same of the cells [N].
    """

    run: npt.NDArray[np.str_]
    load_case: npt.NDArray[np.int64]
    frequency: RealArray
    wheel_torque: RealArray
    wheel_torque_noise: RealArray
    static_force: RealArray
    acceleration: ComplexArray
    acceleration_noise: RealArray
    cell_force: ComplexArray
    cell_noise: RealArray

    def __len__(self) -> int:
        return self.frequency.size

    @property
    def squared_omega(self) -> RealArray:
        """``ω²`` of each line, shape (n,) [1/s²]."""
        return (2 * np.pi * self.frequency) ** 2

    def part(self, rows: slice | npt.NDArray[np.intp] | npt.NDArray[np.bool_]) -> BodyRecord:
        """Return some of the lines."""
        names = [field.name for field in fields(self)]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def repeated_lines(self) -> list[npt.NDArray[np.intp]]:
        """Lines of equal load case and frequency: one array (n, n_repeat) per number of repeats."""
        cases = np.column_stack([self.load_case, self.frequency])
        _, group, count = np.unique(cases, axis=0, return_inverse=True, return_counts=True)
        rows = np.argsort(group, kind="stable")
        repeats = count[group[rows]]
        return [rows[repeats == n].reshape(-1, n) for n in np.unique(count)]

    def mean_over_repeats(self) -> BodyRecord:
        """Average repeated lines; one line per load case and frequency, in their order."""
        lines = self.repeated_lines()
        mean = self.part(np.concatenate([repeats[:, 0] for repeats in lines]))
        averaged = {}
        for name in ("wheel_torque", "static_force", "acceleration", "cell_force"):
            averaged[name] = np.concatenate([getattr(self, name)[r].mean(axis=1) for r in lines])
        for name in ("wheel_torque_noise", "acceleration_noise", "cell_noise"):
            noise = [getattr(self, name)[r[:, 0]] / np.sqrt(r.shape[1]) for r in lines]
            averaged[name] = np.concatenate(noise)
        mean = replace(mean, **averaged)
        return mean.part(np.lexsort((mean.frequency, mean.load_case)))


def body_record(
    body: InstrumentedBody, runs: Sequence[OperatingRun], tolerances: Tolerances
) -> BodyRecord:
    """Collect what one body's channels recorded.

    Parameters
    ----------
    body : InstrumentedBody
        Whose channels.
    runs : sequence of OperatingRun
        At least one.
    tolerances : Tolerances
        How noisy the channels are.

    Raises
    ------
    InputError
        A run without one of the channels, no run at all, or a channel that is dead.
    """
    if not runs:
        raise InputError(f"there is no operating run for the {body.name}: measure one")
    kinds = [(r.gear, r.torque_limit, r.full_load, r.rising) for r in runs]
    cases = list(dict.fromkeys(kinds))
    acceleration = [_channels(run, run.acceleration, body.channels) for run in runs]
    cell_force = [_channels(run, run.cell_force, body.cell_channels) for run in runs]
    accelerations, forces = np.vstack(acceleration), np.vstack(cell_force)
    sensors = np.array(body.channel_rows) // 3
    acceleration_noise = _noise(
        accelerations,
        sensors,
        tolerances.acceleration_own,
        tolerances.acceleration_norm,
        tolerances.acceleration_floor,
    )
    cells = np.arange(forces.shape[1]) // 3
    cell_noise = _noise(
        forces, cells, tolerances.force_own, tolerances.force_norm, tolerances.force_floor
    )
    points = np.repeat(np.arange(len(body.points)), [3 * len(p.cells) for p in body.points])
    motion_share, force_share = _least_shares(body, tolerances)
    _refuse_dead_channels(
        accelerations,
        body.channels,
        np.zeros_like(sensors),
        motion_share,
        acceleration_noise,
        "acceleration",
    )
    _refuse_dead_channels(forces, body.cell_channels, points, force_share, cell_noise, "cell force")
    lines = [run.frequency.size for run in runs]
    record = BodyRecord(
        run=np.repeat([run.name for run in runs], lines),
        load_case=np.repeat([cases.index(kind) for kind in kinds], lines),
        frequency=np.concatenate([run.frequency for run in runs]),
        wheel_torque=np.concatenate([run.wheel_torque for run in runs]),
        wheel_torque_noise=np.repeat([tolerances.torque * r.total_ratio for r in runs], lines),
        static_force=np.vstack([_static_force(run, body.directions) for run in runs]),
        acceleration=accelerations,
        acceleration_noise=acceleration_noise,
        cell_force=forces,
        cell_noise=cell_noise,
    )
    return _in_one_phase(record)


def _in_one_phase(record: BodyRecord) -> BodyRecord:
    """Turn repeated lines into the phase of the first, so that their mean is none of chance.

    Which pulse of the tacho is the zero mark differs from run to run; a half order has two phases
    half a turn apart. All channels of a line turn together: no stiffness depends on it.
    """
    turn = np.ones(len(record), dtype=complex)
    for repeats in record.repeated_lines():
        moved = record.acceleration[repeats]
        common = np.sum(moved[:, :1] * moved.conj(), axis=2)
        turn[repeats[:, 1:]] = np.exp(1j * np.angle(common[:, 1:]))
    return replace(
        record,
        acceleration=record.acceleration * turn[:, np.newaxis],
        cell_force=record.cell_force * turn[:, np.newaxis],
    )


def _channels(run: OperatingRun, spectrum: Spectrum, names: tuple[str, ...]) -> ComplexArray:
    missing = [name for name in names if name not in spectrum.channels]
    if missing:
        raise InputError(
            f"run {run.name} lacks the channels {missing}: record them, or name them in "
            "switched_off for all runs"
        )
    return spectrum.select(names).values


def _static_force(run: OperatingRun, directions: tuple[str, ...]) -> RealArray:
    columns = np.full((run.frequency.size, len(directions)), np.nan)
    for place, name in enumerate(directions):
        if name in run.static_force_names:
            columns[:, place] = run.static_force[:, run.static_force_names.index(name)]
    return columns


def _noise(
    values: ComplexArray, sensor: npt.NDArray[np.int64], own: float, norm: float, floor: float
) -> RealArray:
    squared = np.abs(values) ** 2
    same_sensor = (sensor[:, np.newaxis] == sensor).astype(float)
    return np.asarray(np.sqrt(own**2 * squared + norm**2 * squared @ same_sensor + floor**2))


def _least_shares(body: InstrumentedBody, tolerances: Tolerances) -> tuple[RealArray, RealArray]:
    """Share of the largest motion, and of the force, that each channel must show at least [1].

    All of it on a rigid body, whose mounts load every axis. A body with one sensor may move along
    the axes of its mount alone; a channel across them shows what tilt and cross-talk leave it.
    """
    if body.is_rigid_body:
        return np.ones(len(body.channels)), np.ones(len(body.cell_channels))
    (point,) = body.points
    used = [AXES.index(axis) for axis in point.axes]
    shares = []
    for sensors, askew in (
        (body.accelerometers, (tolerances.sensor_angle, tolerances.sensor_cross_axis)),
        (point.cells, (tolerances.cell_gain,)),
    ):
        along = np.concatenate([np.linalg.norm(one.orientation[used], axis=0) for one in sensors])
        shares.append(np.sqrt(along**2 + np.sum(np.square(askew))))
    of_motion, of_force = shares
    return of_motion[list(body.channel_rows)], of_force


def _refuse_dead_channels(
    values: ComplexArray,
    names: tuple[str, ...],
    group: npt.NDArray[np.int64],
    least_share: RealArray,
    noise: RealArray,
    what: str,
) -> None:
    """Refuse a channel far below its neighbours, unless there is nothing that it could show.

    It is below what physics allows if it shows less than half of the least share of its group's
    largest channel and of its own stated noise.
    """
    level = np.sqrt(np.mean(np.abs(values) ** 2, axis=0))
    own_noise = np.sqrt(np.mean(noise**2, axis=0))
    for place, name in enumerate(names):
        neighbours = level[group == group[place]]
        others = np.median(neighbours)
        least = np.hypot(least_share[place] * neighbours.max(), own_noise[place])
        low = level[place] <= DEAD * others or level[place] == 0
        nothing_moves = neighbours.max() == 0
        if low and (level[place] < 0.5 * least or nothing_moves):
            raise InputError(
                f"{what} channel '{name}' is dead: over {len(values)} lines it shows "
                f"{level[place]:.2g}, the others {others:.2g}; repair it, or name it in "
                "switched_off if enough others are left"
            )
