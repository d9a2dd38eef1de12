"""A measurement campaign on the test bench: raw channels of many runs,."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import Impact, Sensor, SensorKind, SensorModel, Tolerances

AXES = ("x", "y", "z")


class MeasuredMount(Protocol):
    """What a campaign knows of a mount; `deboom.mounts.mount.Mount` is one."""

    @property
    def name(self) -> str:
        """Such as ``TSM``."""

    @property
    def description(self) -> str:
        """In words, for the report."""

    @property
    def pieces(self) -> tuple[str, ...]:
        """Pieces that share the part number; ``("",)`` for a single one."""

    @property
    def positions(self) -> tuple[tuple[float, float, float], ...]:
        """Virtual point of each piece, from the powertrain's centre of gravity [m]."""

    @property
    def transfer_axes(self) -> tuple[str, ...]:
        """Axes whose force reaches the cabin."""

    @property
    def variables(self) -> tuple[str, ...]:
        """``<mount> <axis>`` for all three axes."""

    @property
    def paths(self) -> tuple[str, ...]:
        """``<mount> <axis>`` for the transfer axes."""

    def channels(self, axis: str) -> tuple[str, ...]:
        """Names ``<mount> [<piece>] <axis>`` along one axis, one per piece."""


def _frozen(
    owner: str, name: str, array: npt.ArrayLike, shape: tuple[int, ...] | None = None
) -> RealArray:
    copy = np.array(array, dtype=float)
    if shape is not None and copy.shape != shape:
        raise InputError(f"{owner}: {name} has shape {copy.shape}, expected {shape}")
    if not np.all(np.isfinite(copy)):
        raise InputError(f"{owner}: {name} holds a value that is not finite")
    copy.setflags(write=False)
    return copy


@dataclass(frozen=True, eq=False)
class OperatingRun:
    """One ramp or load slice along one engine order, as the sensors deliver it.

    Parameters
    ----------
    name : str
        Such as ``M1_g5_wot220_rising``.
    mount_set : str
        Parts on the bench, such as ``M1``.
    gear : int
        From 1.
    total_ratio : float
        Engine speed over wheel speed [1].
    full_load : bool
        True for a ramp with wide open throttle; False for a slice at constant engine torque.
    torque_limit : float
        Limit of a full-load ramp, torque of a slice [N m].
    rising : bool
        Whether the engine speed, and with it the torque of a full-load ramp, rose.
    order : float
        Engine order of the spectra [1].
    engine_torque : array, shape (n_frequency,)
        Measured [N m].
    acceleration : Spectrum
        Accelerometer channels ``<sensor> <axis>`` in sensor axes, phase to the tacho [m/s^2].
    cell_force : Spectrum
        Force-cell channels ``<sensor> <axis>`` in sensor axes, phase to the tacho [N].
    static_force : array, shape (n_frequency, n)
        Quasi-static force of each mount direction, all cells of a mount together [N].
    static_force_names : sequence of str
        Column names ``<mount> [<piece>] <axis>``.

    Raises
    ------
    InputError
        Shapes, units or frequency axes that disagree.
    """

    name: str
    mount_set: str
    gear: int
    total_ratio: float
    full_load: bool
    torque_limit: float
    rising: bool
    order: float
    engine_torque: RealArray
    acceleration: Spectrum
    cell_force: Spectrum
    static_force: RealArray
    static_force_names: tuple[str, ...]

    def __post_init__(self) -> None:
        owner = f"run {self.name}"
        names = tuple(self.static_force_names)
        shape = (self.frequency.size, len(names))
        object.__setattr__(self, "static_force_names", names)
        for name, wanted in (("engine_torque", shape[:1]), ("static_force", shape)):
            object.__setattr__(self, name, _frozen(owner, name, getattr(self, name), wanted))
        if not np.array_equal(self.frequency, self.cell_force.frequency):
            raise InputError(f"{owner}: the frequency axes of acceleration and cell force differ")
        for spectrum, unit, what in (
            (self.acceleration, "m/s^2", "acceleration"),
            (self.cell_force, "N", "cell force"),
        ):
            if spectrum.unit != unit:
                raise InputError(f"{owner}: {what} is in {spectrum.unit}, expected {unit}")

    @property
    def frequency(self) -> RealArray:
        """Lines of the engine order, shape (n_frequency,) [Hz]."""
        return self.acceleration.frequency

    @property
    def wheel_torque(self) -> RealArray:
        """Engine torque times total ratio, shape (n_frequency,) [N m]."""
        return np.asarray(self.engine_torque * self.total_ratio)


@dataclass(frozen=True, eq=False)
class ShakerRun:
    """The cells' answer to a shaker at the virtual point of one mount, along one axis.

    Parameters
    ----------
    mount, piece : str
        Where; the piece of a single one is ``""``.
    axis : str
        Vehicle axis of the shaker.
    repeat : int
        From 1.
    response : Frf
        Outputs: channels of the cells below this mount, in sensor axes; one input
        ``<mount> [<piece>] <axis>``; unit ``N/N``.

    Raises
    ------
    InputError
        An unknown axis, another input or another unit.
    """

    mount: str
    piece: str
    axis: str
    repeat: int
    response: Frf

    def __post_init__(self) -> None:
        owner = f"shaker run {self.mount} {self.piece} {self.axis}, repeat {self.repeat}"
        if self.axis not in AXES:
            raise InputError(f"{owner}: unknown axis '{self.axis}', use {', '.join(AXES)}")
        pushed = " ".join(filter(None, (self.mount, self.piece, self.axis)))
        if self.response.inputs != (pushed,) or self.response.unit != "N/N":
            raise InputError(
                f"{owner}: input {list(self.response.inputs)} [{self.response.unit}], expected "
                f"['{pushed}'] [N/N]"
            )


@dataclass(frozen=True, eq=False)
class PushRun:
    """The cells' answer to a push beside the virtual point of one mount.

    Parameters
    ----------
    mount, piece : str
        Where; the piece of a single one is ``""``.
    push : Impact
        Point and direction of the force.
    repeat : int
        From 1.
    response : Frf
        Outputs: channels of the cells below this mount, in sensor axes; one input, named as the
        push; unit ``N/N``.

    Raises
    ------
    InputError
        Another input or another unit.
    """

    mount: str
    piece: str
    push: Impact
    repeat: int
    response: Frf

    def __post_init__(self) -> None:
        if self.response.inputs != (self.push.name,) or self.response.unit != "N/N":
            raise InputError(
                f"push {self.push.name} at {self.mount}, repeat {self.repeat}: input "
                f"{list(self.response.inputs)} [{self.response.unit}], expected "
                f"['{self.push.name}'] [N/N]"
            )


@dataclass(frozen=True, eq=False)
class StaticCurve:
    """Quasi-static force over deflection of one mount direction, as the supplier sends it.

    Parameters
    ----------
    mount, axis : str
        Direction.
    mount_set : str
        Part that was measured.
    deflection : array, shape (n,)
        Increasing, n ≥ 2 [m].
    force : array, shape (n,)
        [N].
    force_uncertainty : float
        Standard deviation relative to the force: one scale error of the whole curve [1].

    Raises
    ------
    InputError
        Shapes, or a deflection that does not increase.
    """

    mount: str
    axis: str
    mount_set: str
    deflection: RealArray
    force: RealArray
    force_uncertainty: float

    def __post_init__(self) -> None:
        owner = f"static curve {self.mount} {self.axis} of {self.mount_set}"
        deflection = _frozen(owner, "deflection", self.deflection)
        if deflection.ndim != 1 or deflection.size < 2 or np.any(np.diff(deflection) <= 0):
            raise InputError(f"{owner}: its deflection must increase over at least two points")
        object.__setattr__(self, "deflection", deflection)
        force = _frozen(owner, "force", self.force, deflection.shape)
        object.__setattr__(self, "force", force)


@dataclass(frozen=True, eq=False)
class Campaign:
    """Everything measured on one bench, in SI; positions are what the laboratory believes.

    Parameters
    ----------
    name : str
        Short key.
    mounts : tuple of Mount
        In the order of the platform.
    powertrain_mounts : tuple of str
        Mounts that carry the powertrain. Each piece of every other mount carries a body of its own
        with its own sensor, and needs no virtual point of the powertrain.
    sensors : tuple of Sensor
        Position sheet: accelerometers and force cells.
    switched_off : tuple of str
        Channels not to be used, such as ``A3 y``.
    mount_sets : tuple of str
        Parts that were on the bench.
    runs : tuple of OperatingRun
        Frequency axes may differ from run to run.
    shaker_runs : tuple of ShakerRun
        Three axes for each mount (piece) that occurs; cells of a mount without are taken as they
        read.
    static_curves : tuple of StaticCurve
        May be empty.
    mass_matrix : array, shape (6, 6)
        Of the powertrain at its centre of gravity, from the data sheet [kg, kg m²].
    mass_tolerance : float
        Half width [kg].
    inertia_tolerance : float
        Half width of entry ij relative to ``√(J_ii J_jj)`` [1].
    centre_of_gravity_tolerance : float
        Half width per axis [m].
    total_ratios : tuple of float
        Engine speed over wheel speed, gear 1 first [1].
    order : float
        Engine order of all spectra [1].
    sensor_catalogue : mapping of str to SensorModel
        Every model that occurs.
    tolerances : Tolerances
        Of this bench.
    input_files : tuple of Path
        Every file that was read.
    pushes : tuple of PushRun
        Beside the virtual points, for force transfer matrices with moments; may be empty.
    """

    name: str
    mounts: tuple[MeasuredMount, ...]
    powertrain_mounts: tuple[str, ...]
    sensors: tuple[Sensor, ...]
    switched_off: tuple[str, ...]
    mount_sets: tuple[str, ...]
    runs: tuple[OperatingRun, ...]
    shaker_runs: tuple[ShakerRun, ...]
    static_curves: tuple[StaticCurve, ...]
    mass_matrix: RealArray
    mass_tolerance: float
    inertia_tolerance: float
    centre_of_gravity_tolerance: float
    total_ratios: tuple[float, ...]
    order: float
    sensor_catalogue: Mapping[str, SensorModel]
    tolerances: Tolerances
    input_files: tuple[Path, ...]
    pushes: tuple[PushRun, ...] = ()

    def __post_init__(self) -> None:
        owner = f"campaign {self.name}"
        object.__setattr__(
            self, "mass_matrix", _frozen(owner, "mass_matrix", self.mass_matrix, (6, 6))
        )
        object.__setattr__(self, "sensor_catalogue", MappingProxyType(dict(self.sensor_catalogue)))

    def runs_of(self, mount_set: str) -> tuple[OperatingRun, ...]:
        """Return the runs with one mount set on the bench.

        Raises
        ------
        InputError
            No such mount set.
        """
        if mount_set not in self.mount_sets:
            raise InputError(
                f"campaign {self.name}: there is no mount set '{mount_set}', use "
                f"{', '.join(self.mount_sets)}"
            )
        return tuple(run for run in self.runs if run.mount_set == mount_set)

    def sensors_of(
        self, kind: SensorKind, mounts: Sequence[str], piece: str | None = None
    ) -> tuple[Sensor, ...]:
        """Return the sensors of one kind at some mounts, all pieces or one, in sheet order."""
        return tuple(
            sensor
            for sensor in self.sensors
            if sensor.kind is kind
            and sensor.mount in mounts
            and (piece is None or sensor.piece == piece)
        )


@dataclass(frozen=True, eq=False)
class TimeRun:
    """Raw channels of one run over time.

    Parameters
    ----------
    name, mount_set : str
        Of the run, and the parts on the bench.
    gear : int
        From 1.
    total_ratio : float
        Engine speed over wheel speed [1].
    full_load : bool
        True for a ramp with wide open throttle; False for a slice at constant engine torque.
    torque_limit : float
        Limit of a full-load ramp, torque of a slice [N m].
    rising : bool
        Whether the engine speed rose.
    order : float
        Dominant engine order [1].
    sample_rate : float
        [Hz].
    tacho : array, shape (n_sample,)
        Pulse train [1]; revolutions count from its first rising edge.
    pulses_per_revolution : int
        Of the tacho.
    engine_torque : array, shape (n_sample,)
        [N m].
    acceleration : array, shape (n_sample, n_channel)
        In sensor axes [m/s²].
    acceleration_channels : tuple of str
        ``<sensor> <axis>``.
    cell_force : array, shape (n_sample, n_channel)
        In sensor axes [N].
    cell_force_channels : tuple of str
        ``<sensor> <axis>``.
    static_force : array, shape (n_sample, n)
        Quasi-static force of each mount direction, all cells of a mount together [N].
    static_force_names : tuple of str
        ``<mount> [<piece>] <axis>``.

    Raises
    ------
    InputError
        Shapes that disagree, or a value that is not finite.
    """

    name: str
    mount_set: str
    gear: int
    total_ratio: float
    full_load: bool
    torque_limit: float
    rising: bool
    order: float
    sample_rate: float
    tacho: RealArray
    pulses_per_revolution: int
    engine_torque: RealArray
    acceleration: RealArray
    acceleration_channels: tuple[str, ...]
    cell_force: RealArray
    cell_force_channels: tuple[str, ...]
    static_force: RealArray
    static_force_names: tuple[str, ...]

    def __post_init__(self) -> None:
        for field, width in (
            ("tacho", None),
            ("engine_torque", None),
            ("acceleration", len(self.acceleration_channels)),
            ("cell_force", len(self.cell_force_channels)),
            ("static_force", len(self.static_force_names)),
        ):
            array = np.array(getattr(self, field), dtype=float)
            expected = (len(self.tacho),) if width is None else (len(self.tacho), width)
            if array.shape != expected:
                raise InputError(
                    f"time run {self.name}: {field} has shape {array.shape}, expected {expected}"
                )
            if not np.all(np.isfinite(array)):
                raise InputError(f"time run {self.name}: {field} holds a value that is not finite")
            array.setflags(write=False)
            object.__setattr__(self, field, array)


SIGNIFICANT = 3.0
"""Standard errors by which a slope must be negative to count as falling."""


class RunDirection(Enum):
    """How the torque went over a run, as the test log states it."""

    RISING = "rising"
    FALLING = "falling"


def rising_runs(run: Sequence[str], direction: Mapping[str, RunDirection]) -> npt.NDArray[np.bool_]:
    """Lines of the runs with rising torque.

    Parameters
    ----------
    run : sequence of str, length n
        Name of the run that each line belongs to.
    direction : mapping of str to RunDirection
        Of every run that occurs.

    Returns
    -------
    array of bool, shape (n,)

    Raises
    ------
    InputError
        A run without direction, or no rising run at all.

    Notes
    -----
    To be preferred to `rising_lines`: at constant torque the slope says nothing, yet the mount
    still remembers from which side it came there.
    """
    unknown = sorted(set(run) - set(direction))
    if unknown:
        raise InputError(f"no direction stated for the runs {unknown}: add rising or falling")
    rising = np.array([direction[name] is RunDirection.RISING for name in run], dtype=bool)
    if not rising.any():
        raise InputError(
            f"the runs {sorted(set(run))} all have falling torque: measure a run with rising torque"
        )
    return rising


def torque_slope(
    time: npt.ArrayLike, torque: npt.ArrayLike, window: float
) -> tuple[RealArray, RealArray]:
    """Slope of the torque over a moving window, and how noise in the torque enters it.

    Parameters
    ----------
    time : array, shape (n,)
        Increasing; the steps may differ [s].
    torque : array, shape (n,)
        [N m].
    window : float
        Width of the window about each line [s]; cut at the ends of the record.

    Returns
    -------
    slope : array, shape (n,)
        Of the straight line of least squares through the window [N m/s].
    noise_gain : array, shape (n,)
        Standard deviation of the slope per standard deviation of independent torque noise [1/s].

    Raises
    ------
    InputError
        Shapes that differ, values that are not finite, time that does not increase, or a window
        with fewer than five lines.
    """
    t, torques = np.asarray(time, dtype=float), np.asarray(torque, dtype=float)
    if t.ndim != 1 or t.shape != torques.shape or t.size == 0:
        raise InputError(f"time of shape {t.shape} and torque of shape {torques.shape} differ")
    if not (np.all(np.isfinite(t)) and np.all(np.isfinite(torques))):
        raise InputError("time or torque of a run is not finite: remove those lines first")
    if np.any(np.diff(t) <= 0):
        raise InputError("the time of a run must increase from line to line")
    begin = np.searchsorted(t, t - window / 2, side="left")
    end = np.searchsorted(t, t + window / 2, side="right")
    count = end - begin
    if count.min() < 5:
        raise InputError(
            f"a window of {window:g} s holds only {count.min()} lines: five are needed for a slope"
        )

    def window_sum(values: RealArray) -> RealArray:
        before = np.concatenate([[0.0], np.cumsum(values)])
        return np.asarray(before[end] - before[begin])

    # about the record's middle, so that the running sums do not cancel
    t = t - t.mean()
    torques = torques - torques.mean()
    mean_time = window_sum(t) / count
    spread = window_sum(t**2) - count * mean_time**2
    slope = (window_sum(t * torques) - mean_time * window_sum(torques)) / spread
    return slope, 1 / np.sqrt(spread)


def rising_lines(
    time: npt.ArrayLike, torque: npt.ArrayLike, window: float, torque_noise: float
) -> npt.NDArray[np.bool_]:
    """Lines of one run at which the torque does not fall.

    Parameters
    ----------
    time : array, shape (n,)
        Increasing [s].
    torque : array, shape (n,)
        As read [N m].
    window : float
        Over which the slope is taken; some seconds of a run-up [s].
    torque_noise : float
        Standard deviation of one torque reading [N m].

    Returns
    -------
    array of bool, shape (n,)

    Raises
    ------
    InputError
        As `torque_slope`; a noise that is not positive; or a run in which the torque only falls.

    Notes
    -----
    A line is left out if its slope is negative by more than three standard errors of the slope, so
    a plateau at the torque limit stays. The sign of the difference between neighbouring readings
    discards almost every second line of a good run instead.
    """
    if not torque_noise > 0:
        raise InputError(f"the torque noise is above 0 N m, not {torque_noise}")
    slope, noise_gain = torque_slope(time, torque, window)
    rising = slope > -SIGNIFICANT * noise_gain * torque_noise
    if not rising.any():
        raise InputError("the torque of this run only falls: measure a run with rising torque")
    return np.asarray(rising)
