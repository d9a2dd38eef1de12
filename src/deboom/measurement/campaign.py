"""A measurement campaign on the test bench: raw channels of many runs, and what calibrates them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Protocol

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.impacts import Impact
from deboom.measurement.sensor_catalogue import SensorModel
from deboom.measurement.sensors import Sensor, SensorKind
from deboom.measurement.tolerances import Tolerances

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
