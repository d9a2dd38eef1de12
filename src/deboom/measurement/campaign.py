"""A measurement campaign on the test bench: raw channels of many runs, and what calibrates them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from deboom.arrays import RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.sensors import Sensor, SensorKind, Tolerances
from deboom.measurement.virtual_point import RIGID_LOADS
from deboom.physics.order_tracking import dominant_order

TORQUE_ALONE = ("my",)
UNBALANCED = ("fz", "mx", "my")


def excited_loads(cylinders: int | None, balancer_shafts: bool | None = None) -> tuple[str, ...]:
    """Return the loads that an engine across the car puts on itself at its firing order.

    - `cylinders`: in line, upright; None for an electric drive.
    - `balancer_shafts`: whether shafts balance its mass forces at this order; None: not known.
    - returns: of ``fx`` … ``mz``, those besides the forces of the mounts.

    Torque about the crankshaft acts in every engine. The mass force of a piston has the orders 1,
    2, 4, 6, …; it adds up over the cylinders where one of these is the firing order: two or four
    cylinders. Then it acts along z, beside the centre of gravity, and turns about x as well. Where
    nobody knows of balancer shafts, the force counts as unknown rather than as zero.
    """
    if cylinders is None or balancer_shafts:
        return TORQUE_ALONE
    order = dominant_order(cylinders)
    return UNBALANCED if order in (1.0, 2.0) else TORQUE_ALONE


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

    @property
    def rotations(self) -> tuple[tuple[float, float, float], ...]:
        """Turns of vehicle axes into the axes of each piece, ``Rz Ry Rx`` [rad]."""

    def channels(self, axis: str) -> tuple[str, ...]:
        """Names ``<mount> [<piece>] <axis>`` along one axis, one per piece."""


@checked(engine_torque="f", static_force="f n", static_force_names="n")
class OperatingRun:
    """One ramp or load slice along one engine order, as the sensors deliver it.

    - `full_load`: True for a ramp with wide open throttle; False for a slice at constant engine
      torque.
    - `engine_torque` (n_frequency,) [N m].
    - `acceleration`, `cell_force`: channels ``<sensor> <axis>`` in sensor axes, phase to the tacho
      [m/s^2], [N].
    - `static_force` (n_frequency, n): quasi-static force of each mount direction, all cells of a
      mount together [N].
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

    @property
    def frequency(self) -> RealArray:
        """Lines of the engine order, shape (n_frequency,) [Hz]."""
        return self.acceleration.frequency

    @property
    def wheel_torque(self) -> RealArray:
        """Engine torque times total ratio, shape (n_frequency,) [N m]."""
        return np.asarray(self.engine_torque * self.total_ratio)


@checked(
    tacho="s",
    engine_torque="s",
    acceleration="s a",
    acceleration_channels="a",
    cell_force="s c",
    cell_force_channels="c",
    static_force="s n",
    static_force_names="n",
)
class TimeRun:
    """Raw channels of one run over time, with the tacho that makes orders of them.

    - `name`, `mount_set`, `gear`, `total_ratio`, `full_load`, `torque_limit`, `rising`, `order`:
      fields as of `OperatingRun`.
    - `tacho` (n_sample,): voltage, its pulses rising [V]; `sample_rate` of all channels [Hz].
    - `engine_torque` (n_sample,) [N m].
    - `acceleration`, `cell_force` (n_sample, n_channel): channels in sensor axes [m/s²], [N].
    - `static_force` (n_sample, n): quasi-static force of each mount direction, all cells of a mount
      together [N].
    - `pulses_per_revolution`: pitches of the tacho's wheel or tape, missing teeth included.
    - `vibration_rate`: lowest rate at which an acceleration or cell force was recorded, before it
      was resampled [Hz]; None where it is `sample_rate`.
    - `notes`: what was resampled or chosen when it was read.
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
    vibration_rate: float | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class ShakerRun:
    """The cells' answer to a shaker at the virtual point of one mount, along one axis.

    - `response`: outputs: channels of the cells below this mount, in sensor axes; one input
      ``<mount> [<piece>] <axis>``; unit ``N/N``.
    """

    mount: str
    piece: str
    axis: str
    repeat: int
    response: Frf


@checked(deflection="n increasing", force="n")
class StaticCurve:
    """Quasi-static force over deflection of one mount direction, as the supplier sends it.

    - `deflection` (n,) [m].
    - `force` (n,) [N].
    - `force_uncertainty`: standard deviation relative to the force: one scale error of the whole
      curve [1].
    """

    mount: str
    axis: str
    mount_set: str
    deflection: RealArray
    force: RealArray
    force_uncertainty: float

    @property
    def name(self) -> str:
        """Name for messages."""
        return f"static curve {self.mount} {self.axis} of {self.mount_set}"


@checked(mass_matrix="6 6")
class Campaign:
    """Everything measured on one bench, in SI; positions are what the laboratory believes.

    - `powertrain_mounts`: mounts that carry the powertrain. Each piece of every other mount carries
      a body of its own with its own sensor, and needs no virtual point of the powertrain.
    - `shaker_runs`: at the virtual points, three axes for each mount (piece) that occurs.
    - `mass_matrix` (6, 6): mass matrix of the powertrain at its centre of gravity, from the data
      sheet [kg, kg m²]; None where it is not stated.
    - `excited`: loads ``fx`` … ``mz`` of unknown size that act on the powertrain besides its mounts
      at this order, see `excited_loads`.
    - `mass_tolerance`, `inertia_tolerance`, `centre_of_gravity_tolerance`: half widths [kg], of
      entry ij relative to ``√(J_ii J_jj)`` [1], per axis [m].
    - `assumed`: sentences on what nobody stated and defaults stand in for.
    - `test_temperature`: of the mounts [°C]; None where it is not stated.
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
    mass_matrix: RealArray | None
    mass_tolerance: float
    inertia_tolerance: float
    centre_of_gravity_tolerance: float
    total_ratios: tuple[float, ...]
    order: float
    tolerances: Tolerances
    input_files: tuple[Path, ...]
    excited: tuple[str, ...] = TORQUE_ALONE
    assumed: tuple[str, ...] = ()
    test_temperature: float | None = None

    def __post_init__(self) -> None:
        unknown = [name for name in self.excited if name not in RIGID_LOADS]
        if unknown or not 0 < len(set(self.excited)) < len(RIGID_LOADS):
            raise InputError(
                f"campaign {self.name}: the powertrain is excited by {list(self.excited)}: name "
                f"one to five of {', '.join(RIGID_LOADS)}; the rest balances the mounts"
            )

    def needed_mass_matrix(self, purpose: str) -> RealArray:
        """Return the mass matrix for what cannot do without; InputError: it is not stated."""
        if self.mass_matrix is None:
            raise InputError(
                f"campaign {self.name}: {purpose} needs the powertrain's mass and inertia, which "
                "no default stands in for: add a section [powertrain] with mass_kg, inertia_kg_m2 "
                "and their tolerances to campaign.toml"
            )
        return self.mass_matrix

    def runs_of(self, mount_set: str) -> tuple[OperatingRun, ...]:
        """Return the runs with one mount set on the bench; an unknown one raises InputError."""
        if mount_set not in self.mount_sets:
            raise InputError(
                f"campaign {self.name}: there is no mount set '{mount_set}', use "
                f"{', '.join(self.mount_sets)}"
            )
        return tuple(run for run in self.runs if run.mount_set == mount_set)

    def sensors_of(
        self, kind: SensorKind, mounts: Sequence[str] | None = None, piece: str | None = None
    ) -> tuple[Sensor, ...]:
        """Return the sensors of one kind, at all mounts and pieces or at some, in sheet order."""
        return tuple(
            sensor
            for sensor in self.sensors
            if sensor.kind is kind
            and (mounts is None or sensor.mount in mounts)
            and (piece is None or sensor.piece == piece)
        )
