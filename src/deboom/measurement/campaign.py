"""A measurement campaign on the test bench: raw channels of many runs, and what calibrates them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Protocol

import numpy as np

from deboom.arrays import BoolArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import Impact, Sensor, SensorKind, SensorModel, Tolerances

AXES = ("x", "y", "z")


class MeasuredMount(Protocol):
    """What a campaign knows of a mount; `deboom.mounts.mount.Mount` is one."""

    @property
    def name(self) -> str:
        """Name, such as ``TSM``."""

    @property
    def description(self) -> str:
        """Description for the report."""

    @property
    def pieces(self) -> tuple[str, ...]:
        """Pieces that share the part number; ``("",)`` for a single one."""

    @property
    def positions(self) -> tuple[tuple[float, float, float], ...]:
        """Virtual point of each piece, from the powertrain's centre of gravity [m]."""

    @property
    def transfer_axes(self) -> tuple[str, ...]:
        """Axes whose force reaches the cabin."""

    def channels(self, axis: str) -> tuple[str, ...]:
        """Names ``<mount> [<piece>] <axis>`` along one axis, one per piece."""


@checked(engine_torque="f", static_force="f n")
class OperatingRun:
    """One ramp or load slice along one engine order, as the sensors deliver it.

    Parameters
    ----------
    name : str — name, such as ``M1_g5_wot220_rising``
    mount_set : str — parts on the bench, such as ``M1``
    gear : int — gear, from 1
    total_ratio : float — engine speed over wheel speed [1]
    full_load : bool
        True for a ramp with wide open throttle; False for a slice at constant engine torque.
    torque_limit : float — limit of a full-load ramp, torque of a slice [N m]
    rising : bool — whether the engine speed, and with it the torque of a full-load ramp, rose
    order : float — engine order of the spectra [1]
    engine_torque : array, shape (n_frequency,) — measured torque [N m]
    acceleration, cell_force : Spectrum
        Channels ``<sensor> <axis>`` in sensor axes, phase to the tacho [m/s^2], [N].
    static_force : array, shape (n_frequency, n)
        Quasi-static force of each mount direction, all cells of a mount together [N].
    static_force_names : sequence of str — column names ``<mount> [<piece>] <axis>``
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
        problem = ""
        shape = (self.frequency.size, len(self.static_force_names))
        if self.static_force.shape != shape:
            problem = f"static_force has shape {self.static_force.shape}, expected {shape}"
        elif not np.array_equal(self.frequency, self.cell_force.frequency):
            problem = "the frequency axes of acceleration and cell force differ"
        elif self.acceleration.unit != "m/s^2":
            problem = f"acceleration is in {self.acceleration.unit}, expected m/s^2"
        elif self.cell_force.unit != "N":
            problem = f"cell force is in {self.cell_force.unit}, expected N"
        if problem:
            raise InputError(f"run {self.name}: {problem}")

    @property
    def frequency(self) -> RealArray:
        """Lines of the engine order, shape (n_frequency,) [Hz]."""
        return self.acceleration.frequency

    @property
    def wheel_torque(self) -> RealArray:
        """Engine torque times total ratio, shape (n_frequency,) [N m]."""
        return np.asarray(self.engine_torque * self.total_ratio)


@checked(tacho="s", engine_torque="s", acceleration="s a", cell_force="s c", static_force="s n")
class TimeRun:
    """Raw channels of one run over time, with the tacho that makes orders of them.

    Parameters
    ----------
    name, mount_set, gear, total_ratio, full_load, torque_limit, rising, order
        As of `OperatingRun`.
    sample_rate : float — samples per second [Hz]
    tacho : array, shape (n_sample,) — pulse train [1]; revolutions count from its first rising edge
    pulses_per_revolution : int — pulses of the tacho
    engine_torque : array, shape (n_sample,) — torque [N m]
    acceleration, cell_force : array, shape (n_sample, n_channel)
        Channels in sensor axes [m/s²], [N].
    acceleration_channels, cell_force_channels : tuple of str — names ``<sensor> <axis>``
    static_force : array, shape (n_sample, n)
        Quasi-static force of each mount direction, all cells of a mount together [N].
    static_force_names : tuple of str — names ``<mount> [<piece>] <axis>``
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
        for item, array, names in (
            ("acceleration", self.acceleration, self.acceleration_channels),
            ("cell_force", self.cell_force, self.cell_force_channels),
            ("static_force", self.static_force, self.static_force_names),
        ):
            expected = (len(self.tacho), len(names))
            if array.shape != expected:
                raise InputError(
                    f"time run {self.name}: {item} has shape {array.shape}, expected {expected}"
                )


class RunDirection(Enum):
    """Course of the torque over a run, as the test log states it."""

    RISING = "rising"
    FALLING = "falling"


def rising_runs(run: Sequence[str], direction: Mapping[str, RunDirection]) -> BoolArray:
    """Mark the lines of the runs with rising torque: a falling run is on another branch.

    Parameters
    ----------
    run : sequence of str, length n — name of the run that each line belongs to
    direction : mapping of str to RunDirection — direction of every run that occurs

    Returns
    -------
    array of bool, shape (n,) — a run without direction, or no rising run at all, raises InputError
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


@dataclass(frozen=True, eq=False)
class ShakerRun:
    """The cells' answer to a shaker at the virtual point of one mount, along one axis.

    Parameters
    ----------
    mount, piece : str — mount and piece; the piece of a single one is ``""``
    axis : str — vehicle axis of the shaker
    repeat : int — number of the repeat, from 1
    response : Frf
        Outputs: channels of the cells below this mount, in sensor axes; one input
        ``<mount> [<piece>] <axis>``; unit ``N/N``.
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
        _check_input(
            self.response, " ".join(filter(None, (self.mount, self.piece, self.axis))), owner
        )


@dataclass(frozen=True, eq=False)
class PushRun:
    """The cells' answer to a push beside the virtual point of one mount.

    Parameters
    ----------
    mount, piece : str — mount and piece; the piece of a single one is ``""``
    push : Impact — point and direction of the force
    repeat : int — number of the repeat, from 1
    response : Frf
        Outputs: channels of the cells below this mount, in sensor axes; one input, named as the
        push; unit ``N/N``.
    """

    mount: str
    piece: str
    push: Impact
    repeat: int
    response: Frf

    def __post_init__(self) -> None:
        owner = f"push {self.push.name} at {self.mount}, repeat {self.repeat}"
        _check_input(self.response, self.push.name, owner)


def _check_input(response: Frf, pushed: str, owner: str) -> None:
    if response.inputs != (pushed,) or response.unit != "N/N":
        raise InputError(
            f"{owner}: input {list(response.inputs)} [{response.unit}], expected ['{pushed}'] [N/N]"
        )


@checked(deflection="n", force="n")
class StaticCurve:
    """Quasi-static force over deflection of one mount direction, as the supplier sends it.

    Parameters
    ----------
    mount, axis : str — direction
    mount_set : str — measured part
    deflection : array, shape (n,) — increasing deflection, n ≥ 2 [m]
    force : array, shape (n,) — force [N]
    force_uncertainty : float
        Standard deviation relative to the force: one scale error of the whole curve [1].
    """

    mount: str
    axis: str
    mount_set: str
    deflection: RealArray
    force: RealArray
    force_uncertainty: float

    def __post_init__(self) -> None:
        if self.deflection.size < 2 or np.any(np.diff(self.deflection) <= 0):
            raise InputError(f"{self.name}: its deflection must increase over at least two points")

    @property
    def name(self) -> str:
        """Name for messages."""
        return f"static curve {self.mount} {self.axis} of {self.mount_set}"


@checked(mass_matrix="6 6")
class Campaign:
    """Everything measured on one bench, in SI; positions are what the laboratory believes.

    Parameters
    ----------
    name : str — short key
    mounts : tuple of Mount — mounts in the order of the platform
    powertrain_mounts : tuple of str
        Mounts that carry the powertrain. Each piece of every other mount carries a body of its own
        with its own sensor, and needs no virtual point of the powertrain.
    sensors : tuple of Sensor — position sheet: accelerometers and force cells
    switched_off : tuple of str — channels not to be used, such as ``A3 y``
    mount_sets : tuple of str — parts that were on the bench
    runs : tuple of OperatingRun — frequency axes may differ from run to run
    shaker_runs, pushes : tuple of ShakerRun, PushRun
        At the virtual points, three axes for each mount (piece) that occurs, and beside them.
    static_curves : tuple of StaticCurve — curves of the supplier; may be empty
    mass_matrix : array, shape (6, 6)
        Mass matrix of the powertrain at its centre of gravity, from the data sheet [kg, kg m²].
    mass_tolerance, inertia_tolerance, centre_of_gravity_tolerance : float
        Half widths [kg], of entry ij relative to ``√(J_ii J_jj)`` [1], per axis [m].
    total_ratios : tuple of float — engine speed over wheel speed, gear 1 first [1]
    order : float — engine order of all spectra [1]
    sensor_catalogue : mapping of str to SensorModel — every model that occurs
    tolerances : Tolerances — tolerances of this bench
    input_files : tuple of Path — every file that was read
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
        object.__setattr__(self, "sensor_catalogue", MappingProxyType(dict(self.sensor_catalogue)))

    def runs_of(self, mount_set: str) -> tuple[OperatingRun, ...]:
        """Return the runs with one mount set on the bench; an unknown one raises InputError."""
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
