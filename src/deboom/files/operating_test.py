"""The folder of a test on a running compressor: hammer tests, sweeps, hoses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from deboom.arrays import RealArray, RealOrComplexArray
from deboom.compressor.hammer_identification import hammer_test_doubts
from deboom.errors import InputError, naming
from deboom.files.function_table import (
    TIME_SIGNAL,
    Dof,
    FunctionMatrix,
    real_where_it_is,
    with_their_tables,
)
from deboom.files.inertance_test import (
    SAME_PLACE,
    read_inertance_test,
    read_placed,
    same_place,
    triaxial,
)
from deboom.files.kinds import FolderKind
from deboom.files.platform import SPECTRA
from deboom.files.rows import PlacedSensor
from deboom.files.schema import (
    AtLeastOne,
    FolderRecord,
    NotNegative,
    Number,
    Positive,
    RelativePath,
    Row3,
    Several,
    StrictModel,
    Title,
    assumed_lines,
    doubled,
    for_each,
    load_toml,
    refuse_all,
    same_file,
    values_of,
    warning_lines,
    within,
)
from deboom.files.uff import write_uff
from deboom.measurement.channels import Spectrum, TimeRecord
from deboom.measurement.compressor_test import (
    HoseDrawing,
    HoseState,
    InertanceTest,
    OperatingSweep,
    OperatingTest,
)
from deboom.measurement.order_tracking import tracked_sweep


def _channels(
    file: FunctionMatrix,
    dofs: Sequence[Dof],
    ordinate: str,
    unit: str,
    *,
    is_complex: bool = True,
) -> Any:
    """Channels along positive axes, none of them dead, shape (n_line, n_channel)."""
    values = file.values(dofs, ordinate=ordinate, unit=unit, is_complex=is_complex)[:, :, 0]
    for dof, column in zip(dofs, values.T, strict=True):
        if not np.any(column):
            raise file.error(
                f"{ordinate} '{dof.name}' (node {dof.node} {dof.direction}) is dead, 0 throughout: "
                "repair the channel and measure again"
            )
    return values


def _tacho(file: FunctionMatrix, node: int, ordinate: str) -> RealArray:
    """Speed or pulses, which programs call by various quantities, shape (n_line,)."""
    matches = [function for function in file.functions if function.response_node == node]
    if not matches:
        raise file.error(
            f"there is no tacho (node {node} scalar, {ordinate}) in it: without its pulse the "
            "channels have no phase; export it, or correct tacho_node"
        )
    if len(matches) > 1:
        raise file.error(f"the tacho (node {node}) is in it {len(matches)} times: keep one")
    values = real_where_it_is(matches[0].values)
    if np.iscomplexobj(values):
        raise file.error(f"the tacho (node {node}) is complex: correct tacho_node")
    return values.astype(np.float64)


@dataclass(frozen=True)
class SweepNodes:
    """What the nodes of the UFF files are.

    - `sensors`: triaxial accelerometers on the compressor, in their own axes.
    - `tacho`: its node, direction scalar.
    - `holders`: name and node of each triaxial accelerometer on the body side of a mount, in the
      axes of the position sheet.
    - `microphones`: name and node, direction scalar.
    """

    sensors: tuple[PlacedSensor, ...]
    tacho: int
    holders: tuple[tuple[str, int], ...] = ()
    microphones: tuple[tuple[str, int], ...] = ()

    @property
    def channels(self) -> tuple[tuple[str, tuple[Dof, ...], str, str], ...]:
        """What is measured, the DoF of its channels, their quantity and unit."""
        sensors = tuple(dof for s in self.sensors for dof in triaxial(s.sensor, s.node))
        holders = tuple(dof for name, node in self.holders for dof in triaxial(name, node))
        microphones = tuple(Dof(name, node, "scalar") for name, node in self.microphones)
        return (
            ("acceleration", sensors, "acceleration", "m/s^2"),
            ("holder", holders, "acceleration", "m/s^2"),
            ("sound", microphones, "pressure", "Pa"),
        )


def write_sweep(
    path: Path,
    nodes: SweepNodes,
    axis: RealArray,
    parts: Sequence[RealOrComplexArray],
    *,
    pulses: RealArray | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write order spectra with the speed of the tacho, or channels over time, as UFF functions.

    - `path`: UFF file.
    - `nodes`: what is written.
    - `axis` (n_line,): lines of the rotation, evenly spaced [Hz], or instants from 0 [s].
    - `parts` (n_line, n_channel): acceleration of the sensors and of the holders [m/s²], and sound
      [Pa], in this order; the last ones may be left out. Spectra are complex peak, phase from the
      tacho's pulse.
    - `pulses` (n_line,): tacho over time, one per revolution; its rising edge marks the angle [1].
    - `notes`: up to four lines on where it comes from.
    - raises InputError: a file that cannot be written.
    """
    tacho = Dof("tacho", nodes.tacho, "scalar")
    if pulses is None:
        kind, lines = 0, ("order 1", *notes)
        turning = tacho.function(axis, 60.0 * axis, kind, "rpm", "rpm", lines)
    else:
        # UFF keeps six digits of a step; ``operation.toml`` keeps the rate exactly
        axis = float(f"{axis[1]:.5e}") * np.arange(axis.size, dtype=np.float64)
        kind, lines = TIME_SIGNAL, tuple(notes)
        turning = tacho.function(axis, pulses, kind, "general", "1", lines)
    functions = [
        dof.function(axis, column, kind, ordinate, unit, lines)
        for (_, dofs, ordinate, unit), values in zip(nodes.channels, parts, strict=False)
        for dof, column in zip(dofs, values.T, strict=True)
    ]
    write_uff(path, [*functions, turning], binary=True)


def read_sweep(path: Path, nodes: SweepNodes) -> tuple[Spectrum | None, ...]:
    """Read order spectra.

    - returns `acceleration`, `holder`, `sound`: of the compressor [m/s^2], of the body side of its
      mounts [m/s^2], of the microphones [Pa]; None where the nodes have none.
    - raises InputError: the file cannot be read as UFF; the tacho is missing or does not fit the
      lines; a channel is missing, doubled, dead, real, or of another order, type or unit.
    """
    file = FunctionMatrix(path, "", SPECTRA)
    file.check_order(1.0, "an unbalance is of order 1, export that")
    file.check_speed(_tacho(file, nodes.tacho, "speed in rpm"), 1.0)
    return tuple(
        Spectrum(file.axis, _channels(file, dofs, *of), tuple(dof.name for dof in dofs), of[1])
        if dofs
        else None
        for _, dofs, *of in nodes.channels
    )


def read_sweep_record(
    path: Path, nodes: SweepNodes, rate: float
) -> tuple[RealArray, tuple[TimeRecord | None, ...]]:
    """Read tacho (n_sample,) [V or 1] and channels over time, see `read_sweep`; `rate` is in Hz."""
    file = FunctionMatrix(path, "", (TIME_SIGNAL,))
    stated = (file.axis.size - 1) / (file.axis[-1] - file.axis[0])
    if abs(stated / rate - 1) > 1e-4:
        raise InputError(
            f"{path}: its samples are {1 / stated:.6g} s apart, but sample_rate_hz says "
            f"{rate:g}: correct the wrong one"
        )
    tacho = _tacho(file, nodes.tacho, "general")
    records = []
    for _, dofs, ordinate, unit in nodes.channels:
        values = _channels(file, dofs, ordinate, unit, is_complex=False) if dofs else None
        names = tuple(dof.name for dof in dofs)
        records.append(None if values is None else TimeRecord(values, rate, names, unit))
    return tacho, tuple(records)


OPERATING_TEST_FILE = "operation.toml"


class DeviationSection(StrictModel):
    """Standard deviation of the real and of the imaginary part of an order spectrum.

    Both add as squares: what scatters from run to run with the amplitude, and the floor
    ``floor √(1 + (corner/f)²)`` of the channels.
    """

    relative: Positive  # over the amplitude [1]
    floor_m_s2: Positive  # far above the corner
    corner_hz: Positive  # below it the floor grows as 1/f


class SweepSection(StrictModel):
    """One run-up at one pressure, as spectra of first order or over time."""

    name: Title  # such as standard 7.5 bar
    hoses: Literal["standard", "soft"]  # the vehicle's, or long soft ones with masses on them
    pressure_bar: Annotated[  # of the gas at the outlet
        Positive, within(0.1, 300.0, "a compressor makes up to 300 bar: is it in kPa?")
    ]
    spectra: RelativePath | None = None  # UFF of the order spectra
    record: RelativePath | None = None  # instead: UFF of the channels over time, with the tacho
    sample_rate_hz: Positive | None = None  # of the record, exact; UFF keeps six digits of it


class HoseSection(StrictModel):
    """A hose as drawn and catalogued: start values, not truth."""

    name: Title  # such as suction hose
    position_m: Row3  # of the port on the compressor, from the origin of the position sheet
    direction: Row3  # from the port to the body, of any length
    length_m: Annotated[  # between its ends
        Positive, within(0.01, 20.0, "a hose is 0.01 to 20 m long: is it in mm?")
    ]
    tension_n: Positive  # EA
    torsion_n_m2: Positive  # GJ
    bending_n_m2: Positive  # EI
    line_mass_kg_per_m: Annotated[  # with what flows in it
        Positive, within(0.001, 20.0, "a hose has 0.001 to 20 kg/m: is it in g/m?")
    ]
    loss_factor: Positive  # of all three stiffnesses
    torsion_radius_m: Positive  # radius of gyration of the section about its axis


class HolderSection(StrictModel):
    """A triaxial accelerometer on the body side of a mount, along the axes of the position sheet.

    An accelerometer under an angle is turned before it is delivered.
    """

    name: Title  # of the mount, such as mount 1; its channels are mount 1 x and so on
    node: Number  # in the UFF files


class MicrophoneSection(StrictModel):
    """A microphone."""

    name: Title  # such as driver
    node: Number  # in the UFF files, direction scalar
    deviation_pa: NotNegative = 0.0  # of each part of a tracked pressure, by noise of the cabin


class OperatingTestFile(StrictModel):
    """The whole file ``operation.toml``."""

    format: Literal[1]
    title: Title  # what a reader calls the test
    hammer: RelativePath  # folder of the hammer test without hoses
    hammer_with_hoses: RelativePath | None = None  # the same with standard hoses, compressor off
    sensor_table: RelativePath  # accelerometers as they stood in the sweeps, CSV or Excel
    tacho_node: Number  # scalar; one pulse per revolution, where the rotor's mark is on the y axis
    # polar moment, from its data sheet
    rotor_inertia_kg_m2: (
        Annotated[Positive, within(1e-7, 1.0, "a rotor has 1e-7 to 1 kg m²: is it in kg mm²?")]
        | None
    ) = None
    deviations: DeviationSection  # how well the spectra of the accelerometers are known
    sweeps: AtLeastOne[SweepSection]
    hoses: Several[HoseSection] = ()  # left out where there is no drawing
    holders: Several[HolderSection] = ()
    microphones: Several[MicrophoneSection] = ()

    def faults(self) -> Iterator[str]:
        """Give a sentence for sweeps without their file, and for what comes twice."""
        for sweep in self.sweeps:
            if (sweep.spectra is None) == (sweep.record is None):
                yield (
                    f"[[sweeps]] '{sweep.name}': name its order spectra with the key 'spectra', or "
                    "its channels over time with the key 'record', one of both"
                )
            if (sweep.record is None) != (sweep.sample_rate_hz is None):
                yield (
                    f"[[sweeps]] '{sweep.name}': the keys 'record' and 'sample_rate_hz' come "
                    "together"
                )
        yield from same_file("sweeps", "spectra", self.sweeps)
        for section in ("sweeps", "hoses", "holders", "microphones"):
            names = [entry.name for entry in getattr(self, section)]
            yield from doubled(f"[[{section}]] are named", names)
        nodes = [self.tacho_node, *(holder.node for holder in self.holders)]
        nodes += [microphone.node for microphone in self.microphones]
        for node in dict.fromkeys(node for node in nodes if nodes.count(node) > 1):
            yield (
                f"node {node} stands for two of tacho, holders and microphones: give each its own"
            )


SAME_ANGLE = 2e-4
"""Largest difference of a direction between two position sheets [rad]: rounding."""

_BAR = 1e5


def read_operating_test(folder: Path | str) -> OperatingTest:
    """Read hammer tests, sweeps and what is stated besides.

    Parameters
    ----------
    folder : path
        Holds ``operation.toml`` and what it names.

    Returns
    -------
    OperatingTest
        In SI, along positive axes. A sweep over time has been tracked.

    Raises
    ------
    InputError
        A file is missing, damaged or wrong in itself; a sweep without its tacho; sensors that stand
        elsewhere than in the hammer test. The sentence names file, item and remedy.

    See Also
    --------
    deboom.unbalance, deboom.identify_hoses, deboom.read_inertance_test

    Notes
    -----
    The deviation of a tracked sweep is the stated share of the amplitude and, instead of the stated
    floor, what the filter lets through at order 1.5.

    Examples
    --------
    >>> import deboom
    >>> deboom.read_operating_test("running").sweeps[0].name  # doctest: +SKIP
    """
    folder = Path(folder)
    path = folder / OPERATING_TEST_FILE
    file = load_toml(path, OperatingTestFile)
    table = folder / file.sensor_table
    sensors = read_placed(table, PlacedSensor)
    hammer = read_inertance_test(folder / file.hammer)
    refuse_all(_moved_sensors(table, sensors, hammer, "the hammer test"))
    with_hoses = None
    if file.hammer_with_hoses is not None:
        with_hoses = read_inertance_test(folder / file.hammer_with_hoses)
        which = "the hammer test with hoses"
        refuse_all(_moved_sensors(table, sensors, with_hoses, which))
        refuse_all(_other_impacts(folder / file.hammer_with_hoses, with_hoses, hammer))
    nodes = SweepNodes(
        sensors,
        file.tacho_node,
        tuple((entry.name, entry.node) for entry in file.holders),
        tuple((entry.name, entry.node) for entry in file.microphones),
    )
    sweeps = for_each(lambda entry: _sweep(folder, entry, file.deviations, nodes), file.sweeps)
    read = [path, table, *hammer.input_files, *(with_hoses.input_files if with_hoses else ())]
    read += [folder / (entry.spectra or entry.record or "") for entry in file.sweeps]
    with naming(path):
        return OperatingTest(
            name=file.title,
            hammer=hammer,
            hammer_with_hoses=with_hoses,
            sweeps=sweeps,
            rotor_inertia=file.rotor_inertia_kg_m2,
            hoses=tuple(HoseDrawing(**values_of(hose)) for hose in file.hoses),
            input_files=with_their_tables(read),
            sound_deviation={entry.name: entry.deviation_pa for entry in file.microphones},
        )


def _sweep(
    folder: Path, entry: SweepSection, stated: DeviationSection, nodes: SweepNodes
) -> OperatingSweep:
    with naming(f"sweep '{entry.name}'"):
        if entry.spectra is not None:
            parts = read_sweep(folder / entry.spectra, nodes)
            floor = None
        else:
            # loading made sure that a record and its rate are there
            assert entry.record is not None
            assert entry.sample_rate_hz is not None
            tacho, records = read_sweep_record(folder / entry.record, nodes, entry.sample_rate_hz)
            with naming(folder / entry.record):
                tracked = tracked_sweep(tacho, [record for record in records if record])
            spectra = iter(tracked.spectra)
            parts = tuple(next(spectra) if record else None for record in records)
            floor = np.maximum(tracked.noise[0], np.finfo(float).tiny)
        acceleration, holder, sound = parts
        assert acceleration is not None
        if floor is None:
            corner = stated.corner_hz / acceleration.frequency
            floor = (stated.floor_m_s2 * np.sqrt(1 + corner**2))[:, np.newaxis]
        return OperatingSweep(
            name=entry.name,
            hoses=HoseState(entry.hoses),
            pressure=_BAR * entry.pressure_bar,
            acceleration=acceleration,
            deviation=np.hypot(stated.relative * np.abs(acceleration.values), floor),
            holder=holder,
            sound=sound,
        )


def _moved_sensors(
    table: Path, sensors: tuple[PlacedSensor, ...], test: InertanceTest, which: str
) -> Iterator[str]:
    """Give a sentence for sensors that were moved, turned, added or left out between the tests."""
    names = tuple(sensor.sensor for sensor in sensors)
    struck = tuple(sensor.name for sensor in test.sensors)
    if names != struck:
        raise InputError(
            f"{table}: the sensors {', '.join(names)} are not those of {which}, "
            f"{', '.join(struck)}, in their order: leave the sensors where they were struck"
        )
    for placed, sensor in zip(sensors, test.sensors, strict=True):
        off = float(np.abs(np.array(placed.position) - sensor.position).max())
        turn = Rotation.from_matrix(placed.orientation.T @ sensor.orientation)
        turned = float(turn.magnitude())
        if off > SAME_PLACE or turned > SAME_ANGLE:
            yield (
                f"{table}: sensor {placed.sensor} stands {1e3 * off:.3g} mm and "
                f"{np.rad2deg(turned):.3g}° from where it stood in {which}: errors of placement no "
                "longer cancel; strike again with the sensors as they are, or correct the sheet"
            )


def _other_impacts(folder: Path, test: InertanceTest, hammer: InertanceTest) -> Iterator[str]:
    # other names are refused with the operating test itself
    for impact, other in zip(test.impacts, hammer.impacts, strict=False):
        if impact.name == other.name and not same_place(impact, other):
            yield (
                f"{folder}: {impact.name} has another place or direction than in the hammer test: "
                "strike the same points with hoses and without, or correct the sheet"
            )


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Give name and text of each line on what a folder holds."""
    test = read_operating_test(folder)
    yield from sweep_lines(folder, test)
    yield from assumed_lines(test.hammer.assumed)


def sweep_lines(folder: Path, test: OperatingTest) -> Iterator[tuple[str, str]]:
    """Give name and text of each line on a test of a running compressor."""
    yield "test", test.name
    with naming(folder):
        for hammer in filter(None, (test.hammer, test.hammer_with_hoses)):
            yield from warning_lines(
                f"{hammer.name}: {doubt}" for doubt in hammer_test_doubts(hammer)
            )
    for sweep in test.sweeps:
        lines = sweep.acceleration.frequency
        yield "sweep", f"{sweep.name}: {60 * lines[0]:.0f} to {60 * lines[-1]:.0f} rpm"
    yield "hoses", ", ".join(hose.name for hose in test.hoses) or "no drawing"


OPERATION: FolderRecord = FolderRecord(
    kind=FolderKind.operation,
    file=OPERATING_TEST_FILE,
    keys=OperatingTestFile,
    command="deboom unbalance {}",
    guide="Your own data",
    lines=_lines,
    parts={"hammer": FolderKind.compressor},
)
