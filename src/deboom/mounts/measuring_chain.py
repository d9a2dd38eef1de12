"""Measuring chains: sensors and cells of one body, their tolerances, and what they recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import Enum

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag
from scipy.signal import savgol_filter

from deboom.arrays import AXES, BoolArray, ComplexArray, IntArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.campaign import Campaign, MeasuredMount, OperatingRun
from deboom.measurement.channels import Spectrum
from deboom.measurement.force_transfer import ForceTransferMatrix, force_transfer_matrix
from deboom.measurement.sensors import SENSOR_AXES, Sensor, SensorKind, Tolerances
from deboom.measurement.virtual_point import VirtualPoint, sensor_geometry, virtual_point
from deboom.physics.rigid_body import forward_matrices, rotation_matrix, skew

POWERTRAIN = "powertrain"
RIGID_MOTION, NEWTON = "rigid motion", "Newton's law"
"""Groups of equations that a measuring chain calibrates itself by."""

LARGEST_MISFIT = 100.0
"""Reduced χ² of a group beyond which it is contradicted: ten times what noise, calibration and
tolerances explain. Right statements give 0.9 to 1.2, wrong loads of an engine 1e5 [1]."""

APART = 1.0
"""Distance of lines whose noise is compared: closer ones share most of their time window, farther
ones differ by their motion [Hz]."""
MORE_NOISE = 1.1
"""Noise over the stated one from which on the noise that is seen counts [1]."""

CONSTANT = 0.004
"""Rms change of a force transfer matrix over frequency up to which it is a constant, as in the
thesis (figure 17) [1]: a bench whose first mode is at 250 Hz has 0.002 up to 80 Hz, one with a mode
at 120 Hz 0.006 and more."""
COURSE_WIDTH = 5.0
"""Width of the parabolas that follow a force transfer matrix over frequency [Hz]: they keep the
height of a mode of a bench with 2 % damping at 80 Hz within a twentieth."""

DEAD = 1e-3
"""Share of the median of its neighbours, over all lines, below which a channel may be dead [1]."""


@checked(
    position="3",
    force_matrix="3 c",
    transfer_scatter="3 3",
    transfer_lines="f",
    transfer_course="f 3 3",
)
class MountPoint:
    """Point at which one mount, or one piece of it, carries a body; a single piece is ``""``.

    `position` (3,) is the virtual point from the powertrain's centre of gravity [m], `axes` are the
    directions that are characterised, along the mount, whose axes in vehicle axes are the columns
    of `orientation` (3, 3), `cells` carry the force together, `force_matrix` (3, 3 n_cell) takes
    their channels to the force at the virtual point in vehicle axes [1]. `transfer_scatter` (3, 3)
    is the standard deviation of the calibration by a shaker over frequency and repeats, relative to
    it [1]. Where a mode of the test bench makes the calibration change over frequency,
    `transfer_course` (n_frequency, 3, 3) is the force at the virtual point by `force_matrix` over
    the one that the shaker pushed with, complex, at its lines `transfer_lines` [Hz]; without lines
    the calibration is a constant.
    """

    mount: str
    piece: str
    position: RealArray
    axes: tuple[str, ...]
    cells: tuple[Sensor, ...]
    force_matrix: RealArray
    calibrated: bool
    transfer_scatter: RealArray
    orientation: RealArray | None = None
    transfer_lines: RealArray = field(default_factory=lambda: np.empty(0))
    transfer_course: ComplexArray = field(default_factory=lambda: np.empty((0, 3, 3), complex))

    def corrected(self, cell_force: ComplexArray, frequency: RealArray) -> ComplexArray:
        """Divide channels of the cells (n, n_channel) at some lines [Hz] by the course over them.

        Lines beyond those of the shaker have the course of its first or last line.
        """
        if not self.transfer_lines.size:
            return cell_force
        lines = np.clip(frequency, self.transfer_lines[0], self.transfer_lines[-1])
        flat = self.transfer_course.reshape(self.transfer_lines.size, -1)
        columns = [np.interp(lines, self.transfer_lines, column) for column in flat.T]
        course = np.stack(columns, axis=1).reshape(-1, 3, 3)
        force = (cell_force @ self.force_matrix.T)[:, :, np.newaxis]
        change = (np.linalg.solve(course, force) - force)[:, :, 0]
        # the cells of a mount share what their sum is changed by
        return np.asarray(cell_force + change @ np.linalg.pinv(self.force_matrix).T)

    def beyond_shaker(self, frequency: RealArray) -> bool:
        """Say whether a course over frequency does not reach all lines [Hz]."""
        lines = self.transfer_lines
        return bool(lines.size and (frequency.min() < lines[0] or frequency.max() > lines[-1]))

    def along_mount(self, rows: RealArray) -> RealArray:
        """Turn rows (3, n) in vehicle axes into rows along the axes of the mount."""
        return rows if self.orientation is None else np.asarray(self.orientation.T @ rows)

    @property
    def name(self) -> str:
        """``<mount> [<piece>]``."""
        return " ".join(filter(None, (self.mount, self.piece)))

    @property
    def cell_channels(self) -> tuple[str, ...]:
        """Channels, three per cell."""
        return tuple(channel for cell in self.cells for channel in cell.channels)


@checked(forward="c k")
class InstrumentedBody:
    """A body, the accelerometers on it, and the points at which mounts carry it.

    It is called ``powertrain``, or as the piece of a mount that carries a body of its own, such as
    ``Du left``. `forward` (n_channel, n_motion) takes its motion to the channels in use [1, m]: six
    motions; of a body with a single sensor, without a virtual point, the three of its mount.
    """

    name: str
    accelerometers: tuple[Sensor, ...]
    channels: tuple[str, ...]
    forward: RealArray
    points: tuple[MountPoint, ...]
    virtual_point: VirtualPoint | None = None

    @property
    def is_rigid_body(self) -> bool:
        """Whether all six motions are measured."""
        return self.virtual_point is not None

    @property
    def channels_off(self) -> list[str]:
        """Channels of the accelerometers that are not in use."""
        all_channels = [name for sensor in self.accelerometers for name in sensor.channels]
        return [name for name in all_channels if name not in self.channels]

    @property
    def channel_rows(self) -> list[int]:
        """Place of each channel in use among the three of every accelerometer."""
        all_channels = [name for sensor in self.accelerometers for name in sensor.channels]
        return [all_channels.index(name) for name in self.channels]

    @property
    def at_points(self) -> RealArray:
        """Motion of the body → motion of its points, shape (3 n_point, n_motion).

        Three rows per point, along the axes of its mount.
        """
        if not self.is_rigid_body:
            return self.points[0].along_mount(np.eye(3))
        forward = forward_matrices([point.position for point in self.points])
        for place, point in enumerate(self.points):
            rows = slice(3 * place, 3 * place + 3)
            forward[rows] = point.along_mount(forward[rows])
        return forward

    @property
    def cell_channels(self) -> tuple[str, ...]:
        """Cell channels of all points."""
        return tuple(channel for point in self.points for channel in point.cell_channels)

    @property
    def force_matrix(self) -> RealArray:
        """Cell channels → force at the points, shape (3 n_point, n_cell_channel).

        Three rows per point, along the axes of its mount.
        """
        return np.asarray(block_diag(*[p.along_mount(p.force_matrix) for p in self.points]))

    @property
    def measured_directions(self) -> tuple[tuple[MountPoint, str, int], ...]:
        """Point, axis and row of `at_points` of every direction that is characterised."""
        return tuple(
            (point, axis, 3 * place + AXES.index(axis))
            for place, point in enumerate(self.points)
            for axis in point.axes
        )


def instrumented_bodies(campaign: Campaign) -> tuple[InstrumentedBody, ...]:
    """Sort a campaign's sensors and mounts by bodies: the powertrain, then those on mounts alone.

    - raises InputError: accelerometers that do not determine the motion of their body, a mount
      without cells, cell channels that are switched off, or shaker runs that do not determine the
      force.
    """
    accelerometers = campaign.sensors_of(SensorKind.ACCELEROMETER)
    cells = campaign.sensors_of(SensorKind.FORCE_CELL)
    on_powertrain, bodies = [], []
    for mount in campaign.mounts:
        for piece in mount.pieces:
            at = mount.name, piece
            below = tuple(cell for cell in cells if (cell.mount, cell.piece) == at)
            point = _mount_point(campaign, mount, piece, below)
            if mount.name in campaign.powertrain_mounts:
                on_powertrain.append(point)
            else:
                carried = tuple(s for s in accelerometers if (s.mount, s.piece) == at)
                bodies.append(_single_sensor_body(campaign, point, carried))
    if on_powertrain:
        sensors = tuple(s for s in accelerometers if s.mount in campaign.powertrain_mounts)
        off = _channels_of(sensors, campaign.switched_off)
        motion = virtual_point(sensor_geometry(sensors, switched_off=off))
        powertrain = InstrumentedBody(
            name=POWERTRAIN,
            accelerometers=sensors,
            channels=motion.channels,
            forward=motion.forward,
            points=tuple(on_powertrain),
            virtual_point=motion,
        )
        bodies.insert(0, powertrain)
    return tuple(bodies)


def _single_sensor_body(
    campaign: Campaign, point: MountPoint, sensors: tuple[Sensor, ...]
) -> InstrumentedBody:
    """Body on a mount of its own, such as a wheel end, with one accelerometer."""
    off = _channels_of(sensors, campaign.switched_off)
    if len(sensors) != 1 or off:
        raise InputError(
            f"campaign {campaign.name}: {point.name} carries a body of its own and needs one "
            f"accelerometer with three channels; it has {[sensor.name for sensor in sensors]}, "
            f"switched off are {off}"
        )
    sensor = sensors[0]
    return InstrumentedBody(point.name, sensors, sensor.channels, sensor.orientation.T, (point,))


def _mount_point(
    campaign: Campaign, mount: MeasuredMount, piece: str, cells: tuple[Sensor, ...]
) -> MountPoint:
    """Point of one piece, with its force transfer matrix where shaker runs give one."""
    at = mount.name, piece
    position = np.array(mount.positions[mount.pieces.index(piece)])
    angles = mount.rotations[mount.pieces.index(piece)]
    turn = rotation_matrix(angles) if any(angles) else None
    # the motion along any axis of a tilted mount is made of all three vehicle axes
    every = mount.name in campaign.powertrain_mounts or turn is not None
    axes = AXES if every else mount.transfer_axes
    owner = f"campaign {campaign.name}: mount {' '.join(filter(None, at))}"
    if not cells:
        raise InputError(f"{owner} has no force cell: its stiffness cannot be measured")
    off = _channels_of(cells, campaign.switched_off)
    if off:
        raise InputError(
            f"{owner}: the cell channels {off} are switched off, but the cells carry the force "
            "together: repair them, or leave the mount out of the campaign"
        )
    summed = np.hstack([cell.orientation for cell in cells])
    if not any((run.mount, run.piece) == at for run in campaign.shaker_runs):
        return MountPoint(*at, position, axes, cells, summed, False, np.zeros((3, 3)), turn)
    transfer = force_transfer_matrix(campaign.shaker_runs, cells, *at)
    force_matrix = np.asarray(np.linalg.solve(transfer.matrix.real, summed), dtype=float)
    lines, course, scatter = _transfer_course(transfer)
    return MountPoint(*at, position, axes, cells, force_matrix, True, scatter, turn, lines, course)


def bench_mode(points: Sequence[MountPoint], frequency: RealArray) -> Iterator[tuple[str, bool]]:
    """Name mounts whose force transfer matrix a mode of the test bench changes over frequency.

    - `frequency` (n,): lines of the runs [Hz].
    - returns: a sentence per kind of case, and whether it denies the forces of its mounts, since
      the shaker's lines do not reach those of the runs.
    """
    for beyond in (False, True):
        seen = [
            point
            for point in points
            if point.transfer_lines.size and point.beyond_shaker(frequency) == beyond
        ]
        if not seen:
            continue
        change = [np.abs(point.transfer_course - np.eye(3)).max(axis=(1, 2)) for point in seen]
        worst = max(range(len(seen)), key=lambda place: float(change[place].max()))
        lines = seen[worst].transfer_lines
        at = lines[int(change[worst].argmax())]
        remedy = (
            f"the runs have lines from {frequency.min():g} to {frequency.max():g} Hz, which the "
            f"shaker's from {lines[0]:g} to {lines[-1]:g} Hz do not reach: repeat the shaker runs "
            "there, or stiffen the bench"
            if beyond
            else "forces are divided by what the shaker showed, line by line"
        )
        yield (
            f"the force transfer matrix of {', '.join(point.name for point in seen)} changes by up "
            f"to {100 * change[worst].max():.1f} % over the shaker's lines, most at {at:g} Hz, as "
            f"a mode of the test bench does; {remedy}",
            beyond,
        )


def _channels_of(sensors: tuple[Sensor, ...], names: tuple[str, ...]) -> list[str]:
    """Those of the names that are channels of the sensors."""
    channels = {f"{sensor.name} {axis}" for sensor in sensors for axis in SENSOR_AXES}
    return [name for name in names if name in channels]


def _transfer_course(
    transfer: ForceTransferMatrix,
) -> tuple[RealArray, ComplexArray, RealArray]:
    """Return lines, course and scatter of a force transfer matrix as a `MountPoint` has them.

    The scatter is without noise: of a constant, a parabola over all lines; else what parabolas over
    `COURSE_WIDTH` leave.
    """
    matrix, lines = transfer.matrix.real, transfer.frequency
    relative = np.linalg.solve(matrix, transfer.response)
    terms = np.vander(lines / lines[-1], min(3, lines.size))
    flat = relative.reshape(lines.size, -1)
    smooth = terms @ np.linalg.lstsq(terms, flat, rcond=None)[0]
    change = np.mean(np.abs(smooth.reshape(-1, 3, 3) - np.eye(3)) ** 2, axis=0)
    width = _odd(COURSE_WIDTH, lines)
    if np.sqrt(change.max()) <= CONSTANT or width <= 3:
        no_lines, no_course = np.empty(0), np.empty((0, 3, 3), dtype=complex)
        return no_lines, no_course, np.asarray(np.sqrt(change + transfer.drift**2), dtype=float)
    real, imaginary = savgol_filter([relative.real, relative.imag], width, 2, axis=1)
    course = real + 1j * imaginary
    left = np.mean(np.abs(relative - course) ** 2, axis=0)
    return lines, course, np.asarray(np.sqrt(left + transfer.drift**2), dtype=float)


def _odd(width: float, lines: RealArray) -> int:
    """Return the odd number of lines, all of them at most, that lie within a width [Hz]."""
    spacing = np.ptp(lines) / max(1, lines.size - 1)
    number = min(lines.size, round(width / spacing)) if spacing else 1
    return number - 1 + number % 2


class ErrorSource(Enum):
    """Kind of error of a measuring chain."""

    SENSOR_POSITION = "sensor position"
    SENSOR_ANGLE = "sensor angle"
    SENSOR_GAIN = "sensor gain"
    SENSOR_CROSS_AXIS = "sensor cross-axis sensitivity"
    SHAKER_ANGLE = "shaker angle"
    SHAKER_GAIN = "shaker gain"
    CELL_GAIN = "cell gain"


@checked(tolerance="n", forward_change="n c k", force_change="n f s")
class Alignment:
    """Parameters by which the measuring chain of a body differs from its position sheet.

    Each of the n parameters has a name, a source and a standard deviation `tolerance` (n,) about 0
    [1, m or rad], and changes the forward matrix by `forward_change` (n, n_channel, n_motion), the
    force matrix by `force_change` (n, 3 n_point, n_cell_channel). They are small, so the changes
    are linear: half a degree leaves a rest of 4e-5.
    """

    body: InstrumentedBody
    names: tuple[str, ...]
    sources: tuple[ErrorSource, ...]
    tolerance: RealArray
    forward_change: RealArray
    force_change: RealArray

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


_Error = tuple[str, ErrorSource, float, RealArray]
"""Name, source and tolerance of an error, change of a sensor's or a point's matrix per unit."""


def alignment(body: InstrumentedBody, tolerances: Tolerances) -> Alignment:
    """List what may be wrong with a body's accelerometers, cells and their calibration.

    Channel c of a sensor with the rows ``B = Rᵀ [I, r̃ᵀ]`` truly reads ``B_c``, changed by its gain
    ``γ B_c``, by cross-axis sensitivity ``κ B_c'``, by a turn ``-(θ̃ B)_c`` about the sensor's own
    axes and by an offset ``(Rᵀ [0, δ̃ᵀ])_c``. A shaker that pushes along ``e_a + θ × e_a`` with
    ``1/(1+γ)`` of the force it states makes the force at the virtual point ``P FTM⁻¹ F`` with these
    vectors as the columns of P.
    """
    n_channels, n_motion = 3 * len(body.accelerometers), body.forward.shape[1]
    no_forward, no_force = np.zeros(body.forward.shape), np.zeros(body.force_matrix.shape)
    errors = []
    for place, sensor in enumerate(body.accelerometers):
        for *error, change in _sensor_errors(sensor, body.is_rigid_body, tolerances):
            forward = np.zeros((n_channels, n_motion))
            forward[3 * place : 3 * place + 3] = change
            errors.append((*error, forward[body.channel_rows], no_force))
    first_cell = 0
    for place, point in enumerate(body.points):
        columns = slice(first_cell, first_cell + 3 * len(point.cells))
        first_cell = columns.stop
        for *error, change in _force_errors(point, tolerances):
            force = no_force.copy()
            force[3 * place : 3 * place + 3, columns] = point.along_mount(change)
            errors.append((*error, no_forward, force))
    names, sources, *numbers = zip(*errors, strict=True)
    return Alignment(body, names, sources, *map(np.array, numbers))


def _sensor_errors(sensor: Sensor, rigid: bool, tolerances: Tolerances) -> Iterator[_Error]:
    """Errors of one accelerometer, with the change of its three rows of the forward matrix."""
    lever = -skew(sensor.position) if rigid else np.zeros((3, 0))
    rows = sensor.orientation.T @ np.hstack([np.eye(3), lever])
    for channel, name in enumerate(sensor.channels):
        for axis in range(3):
            change = np.zeros_like(rows)
            change[channel] = rows[axis]
            if axis == channel:
                source, tolerance = ErrorSource.SENSOR_GAIN, tolerances.sensor_gain
                what = f"{source.value} of channel {name}"
            else:
                source, tolerance = ErrorSource.SENSOR_CROSS_AXIS, tolerances.sensor_cross_axis
                what = f"{source.value} of channel {name} to {'xyz'[axis]}"
            yield what, source, tolerance, change
    for letter, unit in zip("xyz", np.eye(3), strict=True):
        name = f"angle of sensor {sensor.name} about its {letter}"
        turned = -skew(unit) @ rows
        yield name, ErrorSource.SENSOR_ANGLE, tolerances.sensor_angle, turned
        if rigid:
            name = f"position of sensor {sensor.name} along {letter}"
            moved = sensor.orientation.T @ np.hstack([np.zeros((3, 3)), -skew(unit)])
            yield name, ErrorSource.SENSOR_POSITION, tolerances.sensor_position, moved


def _force_errors(point: MountPoint, tolerances: Tolerances) -> Iterator[_Error]:
    """Errors of the cells below one point, with the change of its force matrix."""
    if not point.calibrated:
        for column, channel in enumerate(point.cell_channels):
            change = np.zeros_like(point.force_matrix)
            change[:, column] = -point.force_matrix[:, column]
            name = f"gain of cell channel {channel}"
            yield name, ErrorSource.CELL_GAIN, tolerances.cell_gain, change
        return
    for pushed in range(3):
        for felt in range(3):
            change = np.zeros_like(point.force_matrix)
            change[felt] = point.force_matrix[pushed]
            # the mean of a matrix that is not quite constant stands for every line
            scatter = point.transfer_scatter[felt, pushed]
            along = f"at {point.name} along {'xyz'[pushed]}"
            if felt == pushed:
                name, source = f"force of the shaker {along}", ErrorSource.SHAKER_GAIN
                tolerance = np.hypot(tolerances.shaker_gain, scatter)
            else:
                name = f"angle of the shaker {along} towards {'xyz'[felt]}"
                source = ErrorSource.SHAKER_ANGLE
                tolerance = np.hypot(tolerances.shaker_angle, scatter)
            yield name, source, tolerance, change


@checked(mean="n", covariance="n n")
class AlignmentEstimate:
    """Knowledge of a measuring chain: a normal distribution of its n parameters.

    `misfit` is the reduced χ² of each group of equations that they follow from; empty for stated
    tolerances.
    """

    alignment: Alignment
    mean: RealArray
    covariance: RealArray
    misfit: tuple[tuple[str, float], ...] = ()

    @property
    def enlargement(self) -> float:
        """Factor on all half widths: root of the largest χ² over `LARGEST_MISFIT`, from 1 [1].

        Birge's ratio: what contradicts the measurement is unknown, so is what it does to it.
        """
        largest = max((value for _, value in self.misfit), default=0.0)
        return math.sqrt(max(1.0, largest / LARGEST_MISFIT))

    def alarms(self, excited: Sequence[str]) -> Iterator[str]:
        """Give a sentence for each group that is contradicted, `excited` being the stated loads."""
        remedies = {
            NEWTON: "check the loads of the engine on itself (stated: "
            f"{', '.join(excited)}; keys balancer_shafts and excited of [engine]), mass and "
            "inertia, and that no hose, shaft or exhaust carries force past the cells",
            RIGID_MOTION: "the body is not rigid in this band, or the position sheet is wrong: "
            "check places, angles and rotation_order of the sensors",
        }
        for group, value in self.misfit:
            if value > LARGEST_MISFIT:
                yield (
                    f"{group} of the {self.alignment.body.name} is contradicted: reduced χ² "
                    f"{value:.3g}, at most {LARGEST_MISFIT:g}. Its directions do not count as "
                    f"identified, half widths are {self.enlargement:.1f} times as wide; "
                    f"{remedies[group]}"
                )

    def draw(self, n_draws: int, generator: np.random.Generator) -> RealArray:
        """Draw parameters, shape (n_draws, n)."""
        values, vectors = np.linalg.eigh(self.covariance)
        factor = vectors * np.sqrt(np.maximum(values, 0.0))
        normals = generator.standard_normal((n_draws, self.mean.size))
        return np.asarray(self.mean + normals @ factor.T)


def stated_alignment(alignment: Alignment) -> AlignmentEstimate:
    """Take a chain as its position sheet states it, within the tolerances."""
    mean, covariance = np.zeros_like(alignment.tolerance), np.diag(alignment.tolerance**2)
    return AlignmentEstimate(alignment, mean, covariance)


@dataclass(frozen=True, eq=False)
class BodyRecord:
    """Lines of several operating runs of one body, one below the other; all arrays (n, …).

    Lines of repeated runs (same gear, torque limit, kind and direction) share a `load_case`. Wheel
    torque with its noise [N m]; static force per direction, nan where it was not measured [N];
    acceleration per channel [m/s²] and force per cell channel [N], complex peak, with the standard
    deviation of their noise by the stated tolerances.
    """

    run: npt.NDArray[np.str_]
    load_case: IntArray
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

    def part(self, rows: slice | IntArray | BoolArray) -> BodyRecord:
        """Return some of the lines."""
        names = [field.name for field in fields(self)]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def repeated_lines(self) -> list[IntArray]:
        """Lines of equal load case and frequency: one array (n, n_repeat) per number of repeats."""
        cases = np.column_stack([self.load_case, self.frequency])
        _, group, count = np.unique(cases, axis=0, return_inverse=True, return_counts=True)
        rows = np.argsort(group, kind="stable")
        return [rows[count[group[rows]] == n].reshape(-1, n) for n in np.unique(count)]

    def mean_over_repeats(self) -> BodyRecord:
        """Average repeated lines; one line per load case and frequency, in their order."""
        lines = self.repeated_lines()
        mean = self.part(np.concatenate([repeats[:, 0] for repeats in lines]))
        averaged = {
            name: np.concatenate([getattr(self, name)[r].mean(axis=1) for r in lines])
            for name in ("wheel_torque", "static_force", "acceleration", "cell_force")
        }
        root = np.sqrt(np.concatenate([np.full(len(r), r.shape[1]) for r in lines]))
        for name in ("wheel_torque_noise", "acceleration_noise", "cell_noise"):
            averaged[name] = (getattr(mean, name).T / root).T
        mean = replace(mean, **averaged)
        return mean.part(np.lexsort((mean.frequency, mean.load_case)))


def body_record(
    body: InstrumentedBody, runs: Sequence[OperatingRun], tolerances: Tolerances
) -> BodyRecord:
    """Collect what one body's channels recorded in several runs, with its noise.

    - raises InputError: a run without one of the channels, no run at all, or a channel that is
      dead.

    The noise of accelerometers is the stated one, or what a rigid body shows from line to line
    where that is more.

    Repeated lines are turned into the phase of the first, so that their mean is not left to chance:
    which pulse of the tacho is the zero mark differs from run to run, and a half order has two
    phases half a turn apart. All channels of a line turn together: no stiffness depends on it.
    """
    if not runs:
        raise InputError(f"there is no operating run for the {body.name}: measure one")
    kinds = [(r.gear, r.torque_limit, r.full_load, r.rising) for r in runs]
    cases = list(dict.fromkeys(kinds))
    lines = [run.frequency.size for run in runs]
    acceleration = np.vstack([_channels(r, r.acceleration, body.channels) for r in runs])
    frequency = np.concatenate([run.frequency for run in runs])
    cell_force = np.hstack(
        [
            point.corrected(
                np.vstack([_channels(r, r.cell_force, point.cell_channels) for r in runs]),
                frequency,
            )
            for point in body.points
        ]
    )
    t = tolerances
    of_motion = (t.acceleration_own, t.acceleration_norm, t.acceleration_floor)
    of_force = (t.force_own, t.force_norm, t.force_floor)
    record = BodyRecord(
        run=np.repeat([run.name for run in runs], lines),
        load_case=np.repeat([cases.index(kind) for kind in kinds], lines),
        frequency=frequency,
        wheel_torque=np.concatenate([run.wheel_torque for run in runs]),
        wheel_torque_noise=np.repeat([t.torque * run.total_ratio for run in runs], lines),
        static_force=np.vstack([_static_force(run, body.points) for run in runs]),
        acceleration=acceleration,
        acceleration_noise=_noise(acceleration, np.array(body.channel_rows) // 3, *of_motion),
        cell_force=cell_force,
        cell_noise=_noise(cell_force, np.arange(cell_force.shape[1]) // 3, *of_force),
    )
    seen = _noise_seen(body, record)
    if seen > MORE_NOISE:
        record = replace(record, acceleration_noise=seen * record.acceleration_noise)
    motion_share, force_share = _least_shares(body, tolerances)
    one_group = np.zeros(len(body.channels), dtype=int)
    points = np.repeat(np.arange(len(body.points)), [3 * len(p.cells) for p in body.points])
    motion_noise = record.acceleration_noise
    _refuse_dead_channels(
        "acceleration", body.channels, acceleration, motion_noise, one_group, motion_share
    )
    _refuse_dead_channels(
        "cell force", body.cell_channels, cell_force, record.cell_noise, points, force_share
    )
    turn = np.ones(len(record), dtype=complex)
    for repeats in record.repeated_lines():
        moved = record.acceleration[repeats]
        common = np.sum(moved[:, :1] * moved.conj(), axis=2)
        turn[repeats[:, 1:]] = np.exp(1j * np.angle(common[:, 1:]))
    return replace(
        record,
        acceleration=acceleration * turn[:, np.newaxis],
        cell_force=cell_force * turn[:, np.newaxis],
    )


def _channels(run: OperatingRun, spectrum: Spectrum, names: tuple[str, ...]) -> ComplexArray:
    """Channels of a run, or a refusal that names those it lacks."""
    missing = [name for name in names if name not in spectrum.channels]
    if missing:
        raise InputError(
            f"run {run.name} lacks the channels {missing}: record them, or name them in "
            "switched_off for all runs"
        )
    return spectrum.select(names).values


def _static_force(run: OperatingRun, points: Sequence[MountPoint]) -> RealArray:
    """Take the static force along the axes of the mounts, nan where it was not measured."""
    force_by_name = dict(zip(run.static_force_names, run.static_force.T, strict=True))
    unknown = np.full(run.frequency.size, np.nan)
    in_vehicle = (
        np.stack([force_by_name.get(f"{point.name} {axis}", unknown) for axis in AXES])
        for point in points
    )
    forces = zip(points, in_vehicle, strict=True)
    along = np.vstack([point.along_mount(force) for point, force in forces])
    return np.ascontiguousarray(along.T)


def _noise(
    values: ComplexArray, sensor: IntArray, channel_share: float, norm: float, floor: float
) -> RealArray:
    """Noise of channels by their own amplitude, the norm of their sensor, and at rest."""
    squared = np.abs(values) ** 2
    same_sensor = (sensor[:, np.newaxis] == sensor).astype(float)
    return np.asarray(
        np.sqrt(channel_share**2 * squared + norm**2 * squared @ same_sensor + floor**2)
    )


def _noise_seen(body: InstrumentedBody, record: BodyRecord) -> float:
    """Noise of the accelerometers over the stated one, 0 where it does not show [1].

    Second differences over lines of a run of what is not the motion of a rigid body: errors of the
    position sheet are as smooth over the lines as the motion itself.
    """
    if not body.is_rigid_body or not np.all(record.acceleration_noise > 0):
        return 0.0
    rest = np.eye(len(body.channels)) - body.forward @ np.linalg.pinv(body.forward)
    weights = np.array([1.0, -2.0, 1.0])
    seen, expected = 0.0, 0.0
    for run in dict.fromkeys(record.run.tolist()):
        rows = np.flatnonzero(record.run == run)
        rows = rows[np.argsort(record.frequency[rows])]
        spacing = np.ptp(record.frequency[rows]) / max(1, rows.size - 1)
        lag = max(1, round(APART / spacing)) if spacing else 1
        if rows.size <= 2 * lag:
            continue
        three = np.stack([rows[: -2 * lag], rows[lag:-lag], rows[2 * lag :]], axis=1)
        bent = weights @ (record.acceleration[three] @ rest.T)
        noise = weights**2 @ (record.acceleration_noise[three] ** 2 @ rest.T**2)
        seen += float(np.sum(np.abs(bent) ** 2 / noise))
        expected += bent.size
    return math.sqrt(seen / expected) if expected else 0.0


def _refuse_dead_channels(
    what: str,
    names: tuple[str, ...],
    values: ComplexArray,
    noise: RealArray,
    groups: IntArray,
    shares: RealArray,
) -> None:
    """Refuse a channel below `DEAD` of its group and half of its least share with its noise."""
    level = np.sqrt(np.mean(np.abs(values) ** 2, axis=0))
    noise_level = np.sqrt(np.mean(noise**2, axis=0))
    others = np.array([np.median(level[groups == group]) for group in groups])
    largest = np.array([level[groups == group].max() for group in groups])
    low = (level <= DEAD * others) | (level == 0)
    dead = low & ((level < 0.5 * np.hypot(shares * largest, noise_level)) | (largest == 0))
    if dead.any():
        place = int(np.argmax(dead))
        raise InputError(
            f"{what} channel '{names[place]}' is dead: over {len(values)} lines it shows "
            f"{level[place]:.2g}, the others {others[place]:.2g}; repair it, or name it in "
            "switched_off if enough others are left"
        )


def _least_shares(body: InstrumentedBody, tolerances: Tolerances) -> tuple[RealArray, RealArray]:
    """Share of the largest motion, and of the force, that each channel must show at least [1].

    All of it on a rigid body, whose mounts load every axis. A body with one sensor may move along
    the axes of its mount alone; a channel across them shows what tilt and cross-talk leave it.
    """
    if body.is_rigid_body:
        return np.ones(len(body.channels)), np.ones(len(body.cell_channels))
    (point,) = body.points
    used = [AXES.index(axis) for axis in point.axes]

    def shares(sensors: tuple[Sensor, ...], *askew: float) -> RealArray:
        along = np.concatenate([np.linalg.norm(s.orientation[used], axis=0) for s in sensors])
        return np.asarray(np.sqrt(along**2 + np.sum(np.square(askew))))

    motion = shares(body.accelerometers, tolerances.sensor_angle, tolerances.sensor_cross_axis)
    return motion[body.channel_rows], shares(point.cells, tolerances.cell_gain)
