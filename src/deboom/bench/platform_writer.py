"""Writes the virtual platform: measurement files, the tables that name them, the truth apart."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from deboom.arrays import AXES, BoolArray, ComplexArray, RealArray
from deboom.bench import layout, sensors, writing
from deboom.bench.families import BRACKETS, Family, draw_family
from deboom.bench.fleet import (
    FROZEN_SEED,
    BenchFleet,
    Body,
    BodySpread,
    ear_transfer,
    noise_transfer,
    path_receptance,
    receiver_transfer,
    scattered_body,
)
from deboom.bench.operating_run import PlannedIdle, PlannedRun, idle_run, true_run
from deboom.bench.powertrain import SIDES, VirtualBench, load_bench
from deboom.bench.signals import complex_normal
from deboom.errors import InputError
from deboom.files import platform, rows, tables
from deboom.files.disk import complete_or_not_at_all
from deboom.files.schema import dump_toml
from deboom.files.uff import UffFunction, write_uff
from deboom.files.units import parse_unit
from deboom.progress import Progress

NAME = "u06_f39_f45"
TITLE = "Compact platform, three bodies"
DESCRIPTION = (
    "Virtual platform: {cylinders}-cylinder engine across the front axle, three powertrain mounts "
    "and two wishbone mounts, bodies U06, F39 and F45 with five vehicles each; U06-5 carries a "
    "high-voltage battery. Measured on the virtual bench, with sensor and calibration errors."
)
RECEIVER_NODES = {"rear ear": 951, "seat rail z": 952, "wheel y": 953}
"""Response nodes of further receivers, in a file of their own for each vehicle."""
WEIGHTINGS: dict[str, Literal["Wk", "Wh"]] = {"seat rail z": "Wk", "wheel y": "Wh"}
FELT_FLOOR = 2e-7
"""Noise floor of an accelerance at seat or wheel, of real and imaginary part [(m/s²)/N]: as that of
the ear, some 1 % of the functions."""
IDLE = PlannedIdle()
"""The run at idle that goes with seats and wheel."""
MOUNT_TABLE, CHANNEL_TABLE = "mounts.csv", "channels.csv"
DEFAULT_LOAD_CASE = "g5_wot220"

RECEPTANCE_NOISE = 0.05
"""Rms of the complex error of a receptance, line by line [1]."""

TORQUE_NOISE, TORQUE_DIGITS = 1.0, 2
"""Standard deviation of the engine torque that the control unit states, per line [N m], and the
decimals to which it does."""


def write_platform(
    folder: Path,
    seed: int,
    progress: Progress | None = None,
    *,
    per_piece: bool = False,
    truth_seed: int = 1,
    tilt: float = 0.0,
    receptance: bool = False,
    driving_points: bool = False,
    receivers: bool = False,
    body_scatter: float = 1.0,
    family: str = "",
    load_cases: tuple[PlannedRun, ...] = layout.LOAD_CASES,
    groups: tuple[str, ...] = (),
) -> Path:
    """Measure the virtual platform and write its files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        Seed from 1 of all errors of measurement, and of every fleet but that of seed 1, which is
        frozen. The same seed gives the same bytes.
    progress : callable, optional
        Called with the files written so far, all files, and the name of the last one.
    per_piece : bool
        Measure noise transfer functions at each wishbone mount, not one for both.
    truth_seed : int
        1 is the frozen powertrain and its mounts; every other seed draws them.
    tilt : float
        Angle by which each powertrain mount stands away from the vehicle's axes, about an axis that
        `truth_seed` draws [deg].
    receptance : bool
        Measure the receptance of every body between its paths as well, on another day.
    driving_points : bool
        Measure it at the paths alone instead, along the force: the same numbers.
    receivers : bool
        Measure a rear ear, a seat rail and the wheel of every vehicle as well, and a run at idle;
        all other files stay, but for ``platform.toml``.
    body_scatter : float
        Factor on what cars of one drawing differ by [1], see `deboom.bench.fleet.load_fleet`; seed
        1, whose fleet is frozen, takes 1 alone.
    family : str
        Bodies, rubber and laboratory, see `deboom.bench.families.draw_family`; by default those of
        the bench's own prior.
    load_cases : tuple of PlannedRun
        Full-load runs on the bench, among them that of 220 N m in fifth gear.
    groups : tuple of str
        Groups of the vehicles that are measured; by default all.

    Returns
    -------
    Path
        The folder, with ``platform.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Receptances and driving points together; seed below 1; a tilt below 0 or above 90 degrees; a
        body scatter below 0, or another one than 1 with seed 1; a family that does not exist; a
        folder that is not empty or cannot be written.
    """
    writing.check_seed(seed)
    writing.check_seed(truth_seed)
    if receptance and driving_points:
        raise InputError("a receptance has the driving points in it: write one of both")
    body_file = "receptance" if receptance else "driving_points" if driving_points else ""
    drawn = draw_family(family, seed, truth_seed)
    fleet, bench = drawn.fleet(body_scatter), drawn.bench(load_bench(truth_seed, tilt))
    if groups:
        bodies = {name: b for name, b in fleet.bodies.items() if name.startswith(groups)}
        fleet = replace(fleet, bodies=bodies)
    n_file = len(load_cases) + len(fleet.bodies) + 1
    with complete_or_not_at_all(Path(folder)) as unfinished:
        files = _write_files(
            unfinished,
            drawn,
            fleet,
            bench,
            load_cases,
            per_piece=per_piece,
            body_file=body_file,
            receivers=receivers,
        )
        for done, name in enumerate(files, 1):
            if progress is not None:
                progress(done, n_file, name)
        if family:
            drawn.write_truth(unfinished / "truth")
    return Path(folder)


def mount_rows(bench: VirtualBench, sheet: sensors.DataSheet) -> list[rows.MountRow]:
    """Return the mount table: positions from the centre of gravity of the data sheet."""
    angles = dict(zip(bench.mount_names, bench.rotations, strict=True))
    return [
        rows.MountRow(
            point.mount,
            point.piece,
            writing.triple(point.position + sheet.centre_error, 4),
            writing.triple(angles.get(point.mount, np.zeros(3)), 12),
        )
        for point in layout.points(bench)
    ]


def engine_section(bench: VirtualBench) -> platform.Engine:
    """Return the engine of a TOML file."""
    return platform.Engine(
        cylinders=bench.cylinders,
        dominant_order=bench.order_torque.order,
        total_ratios=bench.total_ratios,
    )


def powertrain_section(
    sheet: sensors.DataSheet, *, exact: bool = False
) -> platform.PowertrainEntry:
    """Return the data sheet of a TOML file, with its tolerances."""
    return platform.PowertrainEntry(
        mass_kg=sheet.mass,
        mass_tolerance_kg=0.0 if exact else sensors.MASS_TOLERANCE,
        inertia_kg_m2=sheet.inertia.tolist(),
        inertia_tolerance=0.0 if exact else sensors.INERTIA_TOLERANCE,
        centre_of_gravity_tolerance_m=0.0 if exact else sensors.CENTRE_TOLERANCE,
    )


def mount_sections(
    bench: VirtualBench, wheel_end_mass: float | None = None
) -> tuple[platform.MountEntry, ...]:
    """Return the mounts of a TOML file, with the stated mass of a wheel end [kg]."""
    sections = []
    for mount in bench.mounts:
        pieces = tuple(point.piece for point in layout.points(bench) if point.mount == mount.name)
        mass = None if mount.name in bench.mount_names else wheel_end_mass
        sections.append(
            platform.MountEntry(
                name=mount.name,
                description=layout.MOUNT_DESCRIPTIONS[mount.name],
                pieces=pieces if len(pieces) > 1 else None,
                transfer_axes=AXES[: len(mount.laws)],
                body_mass_kg=mass,
                body_mass_tolerance_kg=None if mass is None else sensors.WHEEL_END_TOLERANCE,
            )
        )
    return tuple(sections)


def write_powertrain_truth(folder: Path, bench: VirtualBench) -> None:
    """Write what the data sheet only approximates, as ``powertrain.json``."""
    powertrain = {
        "mass_kg": bench.mass,
        "inertia_kg_m2": bench.inertia,
        "mount_position_m": dict(zip(bench.mount_names, bench.positions, strict=True)),
        "wheel_end_mass_kg": float(bench.wheel_end.mass_matrix[0, 0]),
    }
    writing.write_json(folder / "powertrain.json", powertrain)


def _write_files(
    folder: Path,
    family: Family,
    fleet: BenchFleet,
    bench: VirtualBench,
    load_cases: tuple[PlannedRun, ...],
    *,
    per_piece: bool,
    body_file: str,
    receivers: bool,
) -> Iterator[str]:
    """Draw everything, and write every file; give the name of the larger ones.

    - `body_file`: key of what is measured of the bodies; ``""``: nothing.
    """
    seed, budget = family.seed, family.budget(sensors.ErrorBudget())
    lines = family.measured(layout.FREQUENCY)
    # one child per purpose, so that a change of one draw leaves the others as they are
    children = np.random.SeedSequence(seed).spawn(6)
    for_sheet, for_sensors, for_runs, for_vehicles, for_wheel_end, for_torque = children
    sheet = sensors.draw_data_sheet(bench, np.random.default_rng(for_sheet))
    wheel_end_mass = sensors.draw_wheel_end_mass(bench, np.random.default_rng(for_wheel_end))
    instrumentation = sensors.draw_instrumentation(
        bench, budget, np.random.default_rng(for_sensors)
    )
    for name in ("operating", "noise_transfer", "truth"):
        (folder / name).mkdir()

    runs = {}
    torque_noise = np.random.default_rng(for_torque)
    dead = family.dead_sensor(len(instrumentation.sensor_forward) // len(AXES))
    for case, child in zip(load_cases, for_runs.spawn(len(load_cases)), strict=True):
        run = true_run(bench, case, layout.FREQUENCY)
        measured = sensors.measured_run(
            instrumentation, run, budget, np.random.default_rng(child), dead
        )
        name = f"operating/{case.name}.uff"
        write_uff(folder / name, _operating_functions(bench, measured, case, lines))
        torque = run.engine_torque + torque_noise.normal(0, TORQUE_NOISE, layout.FREQUENCY.size)
        table = folder / f"operating/{case.name}_torque.csv"
        stated = np.round(torque, TORQUE_DIGITS)
        rows.write_torque_table(table, layout.FREQUENCY[lines], stated[lines])
        runs[case.name] = run
        yield name

    if receivers:
        key = zlib.crc32(IDLE.name.encode())
        idle = idle_run(bench, IDLE, np.random.default_rng([family.truth_seed, key]))
        measured = sensors.measured_run(
            instrumentation, idle, budget, np.random.default_rng([seed, key]), dead
        )
        write_uff(
            folder / f"operating/{IDLE.name}.uff",
            _spectra(bench, measured, idle.frequency, "orders 0.5 to 6", IDLE.title),
        )

    listed = [(point, axis) for point in layout.paths(bench, per_piece) for axis in point.axes]
    transfers = {}
    children = for_vehicles.spawn(len(fleet.bodies))
    for node, (vehicle, child) in enumerate(
        zip(fleet.bodies, children, strict=True), layout.FIRST_EAR_NODE
    ):
        body = fleet.bodies[vehicle]
        true = noise_transfer(body, fleet.cabin, layout.FREQUENCY)
        if per_piece:
            sides = ear_transfer(body, fleet.cabin, layout.FREQUENCY)[:, 0, -len(SIDES) :, 0]
            true = np.hstack([true[:, :-1], sides])
        errors = sensors.TransferErrors()
        errors = replace(errors, floor=family.values["noise"] * errors.floor)
        heard = sensors.measured_noise_transfer(true, errors, np.random.default_rng(child))
        name = f"noise_transfer/{vehicle}.uff"
        write_uff(folder / name, _noise_transfer_functions(heard, vehicle, node, listed, lines))
        transfers[vehicle] = true
        if body_file:
            functions = _body_functions(family, vehicle, body, listed, lines, per_piece=per_piece)
            if body_file == "driving_points":
                functions = functions[:: len(listed) + 1]
            (folder / body_file).mkdir(exist_ok=True)
            # an abscissa with gaps is uneven, and binary files have even ones alone
            write_uff(folder / f"{body_file}/{vehicle}.uff", functions, binary=bool(lines.all()))
        if receivers:
            felt = _receiver_functions(
                family, vehicle, body, fleet, listed, lines, per_piece=per_piece
            )
            (folder / "receivers").mkdir(exist_ok=True)
            write_uff(folder / f"receivers/{vehicle}.uff", felt, binary=bool(lines.all()))
        yield name

    np.savez(
        folder / "truth/operating.npz",
        frequency=layout.FREQUENCY,
        load_cases=np.array(list(runs)),
        channels=np.array(next(iter(runs.values())).channels),
        **writing.stacked(runs.values(), "displacement", "force", "stiffness", "engine_torque"),
    )
    np.savez(
        folder / "truth/noise_transfer.npz",
        frequency=layout.FREQUENCY,
        vehicles=np.array(list(transfers)),
        paths=np.array([point.channel(axis) for point, axis in listed]),
        noise_transfer=np.array(list(transfers.values())),
    )
    write_powertrain_truth(folder / "truth", bench)
    tables.write_table(folder / MOUNT_TABLE, rows.MountRow, mount_rows(bench, sheet))
    tables.write_table(folder / CHANNEL_TABLE, rows.ChannelRow, _channel_rows(bench, listed))
    origin = "a fleet drawn from the prior"
    if family.kind != BRACKETS:
        origin = f"a fleet with bodies of the kind {family.kind}"
    elif seed == FROZEN_SEED:
        origin = "the frozen fleet"
    first, last = layout.FREQUENCY[[0, -1]]
    writing.write_readme(
        folder,
        TITLE,
        f"Written by deboom bench write FOLDER --seed {seed} ({origin}). All spectra: "
        f"{np.count_nonzero(lines)} lines from {first:g} to {last:g} Hz, engine order "
        f"{bench.order_torque.order:g}. {writing.VEHICLE_AXES} No study reads truth/, and "
        "deleting it changes no result.",
        "platform",
        "platform.toml",
    )
    file = _platform_file(
        bench, sheet, wheel_end_mass, fleet, load_cases, body_file=body_file, receivers=receivers
    )
    dump_toml(folder / "platform.toml", file)
    yield "platform.toml"


def _operating_functions(
    bench: VirtualBench, measured: sensors.MeasuredRun, case: PlannedRun, lines: BoolArray
) -> list[UffFunction]:
    """Return displacement and force of one run at every virtual point, UFF type 0."""
    return _spectra(
        bench,
        replace(measured, displacement=measured.displacement[lines], force=measured.force[lines]),
        layout.FREQUENCY[lines],
        f"order {bench.order_torque.order:g}",
        case.title,
    )


def _spectra(
    bench: VirtualBench,
    measured: sensors.MeasuredRun,
    frequency: RealArray,
    orders: str,
    title: str,
) -> list[UffFunction]:
    """Return displacement and force on their lines at every virtual point, UFF type 0."""
    columns = [(point, axis) for point in layout.points(bench) for axis in point.axes]
    return [
        writing.function(
            writing.SPECTRUM,
            frequency,
            values,
            writing.Dof(point.node, f"+{axis}", point.name, quantity),
            None,
            f"{orders}, {quantity} at the virtual point, {point.channel(axis)}",
            title,
            "complex peak amplitude, phase referred to the tacho",
        )
        for quantity, spectra in (
            ("displacement", measured.displacement),
            ("force", measured.force),
        )
        for values, (point, axis) in zip(spectra.T, columns, strict=True)
    ]


def _noise_transfer_functions(
    measured: ComplexArray,
    vehicle: str,
    ear_node: int,
    listed: Sequence[tuple[layout.Point, str]],
    lines: BoolArray,
) -> list[UffFunction]:
    """Return the pressure at the driver's ear per force at every path, UFF type 4."""
    return [
        writing.function(
            writing.FRF,
            layout.FREQUENCY[lines],
            values[lines],
            writing.Dof(ear_node, "scalar", "driver ear", "pressure"),
            writing.Dof(point.node, f"+{axis}", point.mount, "force"),
            f"noise transfer function, {vehicle}, {point.channel(axis)}",
            "driver's ear; a mount of several pieces: per newton of their summed force",
        )
        for values, (point, axis) in zip(measured.T, listed, strict=True)
    ]


def _body_functions(
    family: Family,
    vehicle: str,
    body: Body,
    listed: Sequence[tuple[layout.Point, str]],
    lines: BoolArray,
    *,
    per_piece: bool,
) -> list[UffFunction]:
    """Measure a body between its paths with a hammer, on another day, row by row, UFF type 4."""
    generator = np.random.default_rng([family.seed, zlib.crc32(f"receptance {vehicle}".encode())])
    struck = scattered_body(body, BodySpread(), generator)
    values = path_receptance(struck, layout.FREQUENCY, per_piece=per_piece)
    noise = complex_normal(values.shape, generator) / np.sqrt(2.0)
    values = values * (1.0 + family.values["noise"] * RECEPTANCE_NOISE * noise)
    return [
        writing.function(
            writing.FRF,
            layout.FREQUENCY[lines],
            values[lines, row, column],
            writing.Dof(point.node, f"+{axis}", point.mount, "displacement"),
            writing.Dof(struck_point.node, f"+{along}", struck_point.mount, "force"),
            f"receptance, {vehicle}, {point.channel(axis)} per {struck_point.channel(along)}",
        )
        for row, (point, axis) in enumerate(listed)
        for column, (struck_point, along) in enumerate(listed)
    ]


def _receiver_functions(
    family: Family,
    vehicle: str,
    body: Body,
    fleet: BenchFleet,
    listed: Sequence[tuple[layout.Point, str]],
    lines: BoolArray,
    *,
    per_piece: bool,
) -> list[UffFunction]:
    """Measure further receivers of a vehicle per force at every path, UFF type 4."""
    if per_piece:
        raise InputError("receivers are measured per mount: leave out --per-piece")
    generator = receiver_generator(family.seed, vehicle)
    true = receiver_transfer(body, fleet.cabin, layout.FREQUENCY, generator)
    functions = []
    for name, values in true.items():
        is_sound = name not in WEIGHTINGS
        errors = sensors.TransferErrors()
        floor = errors.floor if is_sound else FELT_FLOOR
        errors = replace(errors, floor=family.values["noise"] * floor)
        measured = sensors.measured_noise_transfer(values, errors, generator)
        direction = "scalar" if is_sound else f"+{name[-1]}"
        quantity = "pressure" if is_sound else "acceleration"
        # a UFF file names entities in ten characters
        response = writing.Dof(RECEIVER_NODES[name], direction, name[:10].strip(), quantity)
        functions += [
            writing.function(
                writing.FRF,
                layout.FREQUENCY[lines],
                of_path[lines],
                response,
                writing.Dof(point.node, f"+{axis}", point.mount, "force"),
                f"{name}, {vehicle}, per force at {point.channel(axis)}",
            )
            for of_path, (point, axis) in zip(measured.T, listed, strict=True)
        ]
    return functions


def receiver_generator(seed: int, vehicle: str) -> np.random.Generator:
    """Return the generator of the receivers of a vehicle: its own seat and wheel, then errors."""
    return np.random.default_rng([seed, zlib.crc32(f"receivers {vehicle}".encode())])


def _receiver_entries(vehicle: str, ear_node: int) -> tuple[platform.ReceiverEntry, ...]:
    """Return the receivers of a vehicle in ``platform.toml``."""
    entries = [platform.ReceiverEntry(name="driver ear", kind="sound", node=ear_node)]
    for name, node in RECEIVER_NODES.items():
        weighting = WEIGHTINGS.get(name)
        entries.append(
            platform.ReceiverEntry(
                name=name,
                kind="vibration" if weighting else "sound",
                node=node,
                direction=f"+{name[-1]}" if weighting else None,
                functions=f"receivers/{vehicle}.uff",
                weighting=weighting,
            )
        )
    return tuple(entries)


def _idle_entry() -> platform.LoadCaseEntry:
    """Return the run at idle in ``platform.toml``."""
    return platform.LoadCaseEntry(
        name=IDLE.name,
        title=IDLE.title,
        kind="idle",
        speed_rpm=IDLE.speed,
        gear=IDLE.gear,
        torque_limit_nm=IDLE.torque,
        operating=f"operating/{IDLE.name}.uff",
    )


def _channel_rows(
    bench: VirtualBench, listed: Sequence[tuple[layout.Point, str]]
) -> list[rows.ChannelRow]:
    """Return the channel table: operating channels first, then noise transfer functions."""
    channels = [
        (quantity, point, axis)
        for quantity in ("displacement", "force")
        for point in layout.points(bench)
        for axis in point.axes
    ]
    channels += [(rows.NOISE_TRANSFER, *path) for path in listed]
    return [
        rows.ChannelRow(
            channel=point.channel(axis),
            quantity=quantity,
            mount=point.mount,
            piece=point.piece,
            axis=axis,
            node=point.node,
            direction=f"+{axis}",
            unit=parse_unit(rows.QUANTITY_UNIT[quantity]),
        )
        for quantity, point, axis in channels
    ]


def _platform_file(
    bench: VirtualBench,
    sheet: sensors.DataSheet,
    wheel_end_mass: float,
    fleet: BenchFleet,
    load_cases: tuple[PlannedRun, ...],
    *,
    body_file: str,
    receivers: bool,
) -> platform.PlatformFile:
    """Return the content of ``platform.toml``."""
    mounts = [entry.model_dump() for entry in mount_sections(bench, wheel_end_mass)]

    def of_body(vehicle: str) -> str:
        return f"{body_file}/{vehicle}.uff"

    return platform.PlatformFile(
        format=1,
        name=NAME,
        title=TITLE,
        description=DESCRIPTION.format(cylinders={3: "three", 4: "four"}[bench.cylinders]),
        mount_table=MOUNT_TABLE,
        channel_table=CHANNEL_TABLE,
        default_load_case=DEFAULT_LOAD_CASE,
        engine=engine_section(bench),
        powertrain=powertrain_section(sheet),
        mounts=tuple(platform.PlatformMount(**entry) for entry in mounts),
        vehicles=tuple(
            platform.VehicleEntry(
                name=vehicle,
                group=vehicle.rpartition("-")[0],
                noise_transfer=f"noise_transfer/{vehicle}.uff",
                ear_node=None if receivers else node,
                receivers=_receiver_entries(vehicle, node) if receivers else None,
                receptance=of_body(vehicle) if body_file == "receptance" else None,
                driving_points=of_body(vehicle) if body_file == "driving_points" else None,
            )
            for node, vehicle in enumerate(fleet.bodies, layout.FIRST_EAR_NODE)
        ),
        load_cases=(
            *(
                platform.LoadCaseEntry(
                    name=case.name,
                    title=case.title,
                    gear=case.gear,
                    torque_limit_nm=case.torque,
                    operating=f"operating/{case.name}.uff",
                    torque_table=f"operating/{case.name}_torque.csv",
                )
                for case in load_cases
            ),
            *((_idle_entry(),) if receivers else ()),
        ),
    )
