"""A test of component TPA: source and receiver joined, struck at their interface, and run.

The source meets the receiver at points of three or six degrees of freedom. Functions of the
assembly go from hits around every point, and on the source, to accelerometers and ears; the same
channels are recorded while the source runs. Positions of all count from one origin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError, naming
from deboom.measurement.channels import (
    Frf,
    SideUnits,
    Spectrum,
    load_units,
    motion_units,
    refuse_doubled,
    refuse_window,
    unit_sides,
)
from deboom.measurement.compressor_test import check_coherence
from deboom.measurement.culprit import refuse_other_rotation_order, refuse_sheet_faults
from deboom.measurement.driving_points import refuse_other_functions
from deboom.measurement.noise_transfer import POINT_LOADS
from deboom.measurement.sensors import Impact, PlacementTolerances, Sensor
from deboom.measurement.virtual_point import (
    VirtualPoint,
    conditioning,
    impact_geometry,
    sensor_geometry,
    virtual_point,
)

SAME_LINE = 1e-6
"""Largest relative distance of lines that are the same [1]."""


@checked(position="3")
class InterfacePoint:
    """One place where source and receiver are joined.

    - `position` (3,): virtual point, from the origin of the position sheets [m].
    - `motions`: all six of a rigid body, or x, y and z where nothing is turned.
    - `sensors`: accelerometers around it; three triaxial ones determine six motions.
    - `impacts`: hits around it; six determine six loads, nine show whether they agree.
    """

    name: str
    position: RealArray
    motions: tuple[str, ...]
    sensors: tuple[Sensor, ...]
    impacts: tuple[Impact, ...]

    @property
    def motion_names(self) -> tuple[str, ...]:
        """Such as ``mount 1 rx``."""
        return tuple(f"{self.name} {motion}" for motion in self.motions)

    @property
    def load_names(self) -> tuple[str, ...]:
        """Such as ``mount 1 mx``; forces are named as the translations."""
        return tuple(f"{self.name} {load}" for load in POINT_LOADS[: len(self.motions)])

    @property
    def impact_names(self) -> tuple[str, ...]:
        """Names of its hits."""
        return tuple(impact.name for impact in self.impacts)

    def seen(self) -> VirtualPoint:
        """Return the virtual point of its sensors; too few of them raise InputError."""
        return virtual_point(sensor_geometry(self.sensors, self.position), motions=self.motions)

    def struck(self) -> VirtualPoint:
        """Return the virtual point of its hits; too few of them raise InputError."""
        return virtual_point(impact_geometry(self.impacts, self.position), motions=self.motions)

    @property
    def determined(self) -> bool:
        """Whether sensors and hits determine all six motions, so that their quality is known."""
        sheets = (
            sensor_geometry(self.sensors, self.position),
            impact_geometry(self.impacts, self.position),
        )
        return all(len(sheet.channels) >= 6 and conditioning(sheet).complete for sheet in sheets)


def functions_at_points(measured: Frf, points: Sequence[InterfacePoint]) -> Frf:
    """Refer functions per hit to the loads of all points, ``Y (U⁺)ᵀ`` point by point.

    Inputs of the result are ``<point> x`` … ``mz``: per N, and per N m for moments.
    """
    blocks = []
    for point in points:
        struck = point.struck()
        blocks.append(measured.select(inputs=struck.channels).values @ struck.inverse.T)
    loads = tuple(name for point in points for name in point.load_names)
    unit = measured.unit
    above = unit.outputs if isinstance(unit, SideUnits) else ()
    above = above or (unit_sides(unit)[0],) * len(measured.outputs)
    sides = SideUnits(above, load_units(loads, "N"))
    return replace(measured, values=np.concatenate(blocks, axis=2), inputs=loads, unit=sides)


def motions_at_points(measured: Frf, points: Sequence[InterfacePoint]) -> Frf:
    """Refer accelerations at the sensors of all points to their motions, ``V⁺ Y``; see above."""
    blocks = []
    for point in points:
        seen = point.seen()
        blocks.append(seen.inverse @ measured.select(outputs=seen.channels).values)
    motions = tuple(name for point in points for name in point.motion_names)
    unit = measured.unit
    below = (
        unit.inputs
        if isinstance(unit, SideUnits)
        else (unit_sides(unit)[1],) * len(measured.inputs)
    )
    sides = SideUnits(motion_units(motions, "m/s^2"), tuple(below))
    return replace(measured, values=np.concatenate(blocks, axis=1), outputs=motions, unit=sides)


@checked(acceleration_deviation="f c >0")
class SourceRun:
    """Spectra of one state of operation, all with one phase reference.

    - `acceleration`, `sound`: at all accelerometers [m/s²] and ears [Pa], complex peak.
    - `order`: engine order of the lines, per revolution; 0 for a spectrum [1].
    - `acceleration_deviation` (n_frequency, n_channel): root mean square modulus of the noise of
      `acceleration` [m/s²].
    """

    name: str
    acceleration: Spectrum
    sound: Spectrum
    acceleration_deviation: RealArray
    order: float = 0.0


@checked(coherence="f o i", pressure_coherence="f e i")
class ComponentTest:
    """Everything measured on an assembly of source and receiver.

    Raises InputError: no point or run; doubled names; an accelerometer or hit without function;
    functions of other lines, or with the decay of a window; lines of a run that have no function.

    - `points`: interface between source and receiver.
    - `indicators`: further accelerometers on the receiver, which inversions use as well.
    - `on_board`: accelerometers on the receiver that inversions leave out.
    - `source_hits`: hits on the source beside its interface: loads that are known.
    - `accelerance`: all accelerometers per hit [(m/s²)/N]; `pressure`: ears per hit [Pa/N].
    - `coherence`, `pressure_coherence` (n_frequency, n_output, n_impact): 0 … 1 [1].
    - `n_averages`: hits behind each function.
    - `microphone`: standard deviation of the gain of each microphone [1].
    - `free`: accelerance at the points of the source alone, hung up freely; None where it was not
      measured [(m/s²)/N].

    See Also
    --------
    deboom.read_component_test, deboom.component_tpa
    """

    name: str
    points: tuple[InterfacePoint, ...]
    indicators: tuple[Sensor, ...]
    on_board: tuple[Sensor, ...]
    source_hits: tuple[Impact, ...]
    accelerance: Frf
    coherence: RealArray
    pressure: Frf
    pressure_coherence: RealArray
    n_averages: int
    runs: tuple[SourceRun, ...]
    tolerances: PlacementTolerances
    microphone: float = 0.0
    free: Frf | None = None
    input_files: tuple[Path, ...] = ()
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_points(self.points, self.accelerance, self.name)
        for functions, coherence in (
            (self.accelerance, self.coherence),
            (self.pressure, self.pressure_coherence),
        ):
            check_coherence(coherence, functions, self.name)
            refuse_window(functions.added_decay_rate, self.name)
        if not np.array_equal(self.accelerance.frequency, self.pressure.frequency):
            raise InputError(
                f"{self.name}: accelerance and pressure have unlike lines: export both on the same"
            )
        if not self.runs:
            raise InputError(f"{self.name}: no run of the source: record at least one")
        for run in self.runs:
            self.lines_of(run)
        n_load = sum(len(point.motions) for point in self.points)
        if n_load >= len(self.indicator_channels):
            raise InputError(
                f"{self.name}: {n_load} loads at the interface and {len(self.indicator_channels)} "
                "indicators: more channels than loads are needed, better twice as many; add "
                "accelerometers on the receiver"
            )

    @property
    def indicator_channels(self) -> tuple[str, ...]:
        """Channels that inversions use: at the points and beside them."""
        at_points = [sensor for point in self.points for sensor in point.sensors]
        return tuple(c for sensor in (*at_points, *self.indicators) for c in sensor.channels)

    @property
    def on_board_channels(self) -> tuple[str, ...]:
        """Channels that inversions leave out."""
        return tuple(channel for sensor in self.on_board for channel in sensor.channels)

    @property
    def all_channels(self) -> tuple[str, ...]:
        """Indicators, then channels that inversions leave out."""
        return (*self.indicator_channels, *self.on_board_channels)

    @property
    def ears(self) -> tuple[str, ...]:
        """Targets."""
        return self.pressure.outputs

    def lines_of(self, run: SourceRun) -> slice:
        """Return the lines of a run among those of the functions; others raise InputError."""
        functions, lines = self.accelerance.frequency, run.acceleration.frequency
        begin = int(np.searchsorted(functions, lines[0] * (1 - SAME_LINE)))
        rows = slice(begin, begin + lines.size)
        here = functions[rows]
        if here.size != lines.size or np.any(np.abs(here - lines) > SAME_LINE * lines):
            step = np.diff(functions).mean() if functions.size > 1 else 0.0
            raise InputError(
                f"{self.name}: run {run.name} has unlike lines, {lines.size} from {lines[0]:g} to "
                f"{lines[-1]:g} Hz, where the functions have one each {step:g} Hz from "
                f"{functions[0]:g} to {functions[-1]:g} Hz: export both on the same lines, nothing "
                "is interpolated"
            )
        return rows


def check_points(points: Sequence[InterfacePoint], accelerance: Frf, whose: str) -> None:
    """Refuse points that are doubled or lack sensors or hits, and names without a function."""
    if not points:
        raise InputError(f"{whose}: no point where source and receiver meet: name at least one")
    refuse_doubled([point.name for point in points], f"point of {whose}")
    for point in points:
        missing = [
            channel
            for sensor in point.sensors
            for channel in sensor.channels
            if channel not in accelerance.outputs
        ]
        if missing:
            raise InputError(
                f"{whose}: point {point.name}: no functions of {', '.join(missing)}: measure these "
                "sensors, or take them off the point"
            )
    refuse_undetermined(points, whose)


def refuse_undetermined(points: Sequence[InterfacePoint], whose: str) -> None:
    """Refuse points whose sensors or hits do not determine their motions or loads."""
    for point in points:
        with naming(f"{whose}: point {point.name}"):
            point.seen()
            point.struck()


def refuse_other_functions_of_points(
    points: Sequence[InterfacePoint], accelerance: Frf, whose: str
) -> None:
    """Refuse functions that are conjugated, reversed or of another quantity, at six motions."""
    bodies = [
        (
            sensor_geometry(point.sensors, point.position),
            impact_geometry(point.impacts, point.position),
        )
        for point in points
        if point.determined
    ]
    refuse_other_functions(accelerance, bodies, whose)


def refuse_wrong_sheets(
    points: Sequence[InterfacePoint],
    accelerance: Frf,
    tolerances: PlacementTolerances,
    whose: str,
) -> None:
    """Refuse position sheets that the functions contradict, of points that can be judged.

    Raises InputError: angles that were stated by another order of rotations, which is named; a
    channel or hit that is reversed, swapped or exchanged.
    """
    for point in points:
        if point.determined:
            response = virtual_point(sensor_geometry(point.sensors, point.position))
            excitation = virtual_point(impact_geometry(point.impacts, point.position))
            used = accelerance.select(response.channels, excitation.channels)
            where = f"{whose}: point {point.name}"
            refuse_other_rotation_order(point.sensors, used, tolerances, where)
            refuse_sheet_faults(used, response, excitation, tolerances, where, point.sensors)


MOST_ANISOTROPY = 1e9
"""Largest over smallest stiffness of a mount in its directions [1]; beyond it is free in some."""


@dataclass(frozen=True, eq=False)
class MountJoint:
    """What joins source and receiver at one point.

    - `stiffness` (n_frequency or 1, n, n), optional: dynamic stiffness of a massless mount, n = 3
      along x, y and z, or 6 with rotations [N/m, N/rad, N m/rad]; None is rigid. Directions that
      it has not are not joined.
    - raises InputError: a stiffness that leaves a direction free, at some line.
    """

    stiffness: ComplexArray | None = None

    def __post_init__(self) -> None:
        if self.stiffness is None:
            return
        free = np.flatnonzero(~(np.linalg.cond(self.stiffness) < MOST_ANISOTROPY))
        if free.size:
            raise InputError(
                f"the stiffness of line {free[0] + 1} leaves a direction free, so that it has no "
                "compliance: measure all axes, or state fewer directions"
            )


@checked()
class ReceiverTest:
    """Another receiver on its own, with the mounts through which the source will stand on it.

    Raises InputError: as `ComponentTest` for points and functions.

    - `accelerance`: accelerometers at the points per hit [(m/s²)/N]; `pressure`: ears per hit
      [Pa/N].
    - `joints`: name of each point to what joins the source there.
    - `measured`: name of a run to the pressure at the ears with the source in place, for comparison
      [Pa].
    """

    name: str
    points: tuple[InterfacePoint, ...]
    accelerance: Frf
    pressure: Frf
    joints: Mapping[str, MountJoint]
    measured: Mapping[str, Spectrum] = field(default_factory=dict)
    input_files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        check_points(self.points, self.accelerance, self.name)
        for functions in (self.accelerance, self.pressure):
            refuse_window(functions.added_decay_rate, self.name)
        if not np.array_equal(self.accelerance.frequency, self.pressure.frequency):
            raise InputError(
                f"{self.name}: accelerance and pressure have unlike lines: export both on the same"
            )
