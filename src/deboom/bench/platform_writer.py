"""Writes the virtual platform: measurement files, the tables that name them, the truth apart."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.fleet import FROZEN_SEED, BenchFleet, load_fleet, noise_transfer
from deboom.bench.layout import (
    CYLINDERS,
    DEFAULT_LOAD_CASE,
    DESCRIPTION,
    FIRST_EAR_NODE,
    FREQUENCY,
    LOAD_CASES,
    MOUNT_DESCRIPTIONS,
    NAME,
    TITLE,
    WISHBONE_POSITIONS,
    LoadCasePlan,
    paths,
    points,
)
from deboom.bench.operating_run import OperatingRun, full_load_run
from deboom.bench.powertrain import AXES, VirtualBench, load_bench
from deboom.bench.sensors import (
    CENTRE_TOLERANCE,
    INERTIA_TOLERANCE,
    MASS_TOLERANCE,
    WHEEL_END_TOLERANCE,
    DataSheet,
    ErrorBudget,
    MeasuredRun,
    TransferErrors,
    draw_data_sheet,
    draw_instrumentation,
    draw_wheel_end_mass,
    evaluate,
    measure,
    measured_noise_transfer,
)
from deboom.errors import InputError
from deboom.files.folders import complete_or_not_at_all, replace_text
from deboom.files.platform import (
    NOISE_TRANSFER,
    QUANTITY_UNIT,
    ChannelRow,
    Engine,
    LoadCaseEntry,
    MountEntry,
    MountRow,
    PlatformFile,
    VehicleEntry,
    dump_platform_file,
    write_channel_table,
    write_mount_table,
)
from deboom.files.platform import PowertrainEntry as Powertrain
from deboom.files.tables import parse_unit, write_torque_table
from deboom.files.uff import UffFunction, write_uff

MOUNT_TABLE = "mounts.csv"
CHANNEL_TABLE = "channels.csv"


def noise_transfer_file(vehicle: str) -> str:
    """Return the file of a vehicle's noise transfer functions."""
    return f"noise_transfer/{vehicle}.uff"


def operating_file(load_case: LoadCasePlan) -> str:
    """Return the file of a load case's operating spectra."""
    return f"operating/{load_case.name}.uff"


def torque_file(load_case: LoadCasePlan) -> str:
    """Return the file of a load case's engine torque."""
    return f"operating/{load_case.name}_torque.csv"


def ear_nodes(fleet: BenchFleet) -> dict[str, int]:
    """Assign each vehicle the node of its driver's ear."""
    return {vehicle: FIRST_EAR_NODE + k for k, vehicle in enumerate(fleet.bodies)}


def operating_functions(
    measured: MeasuredRun,
    frequency: RealArray,
    load_case: LoadCasePlan,
    mount_names: tuple[str, ...],
    order: float,
) -> list[UffFunction]:
    """Return displacement and force of one run at every virtual point, UFF type 0."""
    columns = [(point, axis) for point in points(mount_names) for axis in point.axes]
    return [
        UffFunction(
            abscissa=frequency,
            values=values[:, column],
            function_type=0,
            response_node=point.node,
            response_direction=f"+{axis}",
            reference_node=0,
            reference_direction="scalar",
            ordinate=quantity,
            ordinate_unit=QUANTITY_UNIT[quantity],
            denominator="none",
            denominator_unit="",
            id_lines=(
                f"order {order:g}, {quantity} at the virtual point, {point.channel(axis)}",
                load_case.title,
                "complex peak amplitude, phase referred to the tacho",
            ),
            response_name=point.channel("").strip(),
        )
        for quantity, values in (("displacement", measured.displacement), ("force", measured.force))
        for column, (point, axis) in enumerate(columns)
    ]


def noise_transfer_functions(
    measured: ComplexArray,
    frequency: RealArray,
    vehicle: str,
    ear_node: int,
    mount_names: tuple[str, ...],
) -> list[UffFunction]:
    """Return the pressure at the driver's ear per force at every path, UFF type 4."""
    return [
        UffFunction(
            abscissa=frequency,
            values=measured[:, column],
            function_type=4,
            response_node=ear_node,
            response_direction="scalar",
            reference_node=path.node,
            reference_direction=f"+{path.axis}",
            ordinate="pressure",
            ordinate_unit="Pa",
            denominator="force",
            denominator_unit="N",
            id_lines=(
                f"noise transfer function, {vehicle}, {path.name}",
                "driver's ear; a mount of several pieces: per newton of their summed force",
            ),
            response_name="driver ear",
            reference_name=path.mount,
        )
        for column, path in enumerate(paths(mount_names))
    ]


def channel_rows(mount_names: tuple[str, ...]) -> list[ChannelRow]:
    """Return the channel table: operating channels first, then noise transfer functions."""
    operating = [
        ChannelRow(
            channel=point.channel(axis),
            quantity=quantity,
            mount=point.mount,
            piece=point.piece,
            axis=axis,
            node=point.node,
            direction=f"+{axis}",
            unit=parse_unit(QUANTITY_UNIT[quantity]),
        )
        for quantity in ("displacement", "force")
        for point in points(mount_names)
        for axis in point.axes
    ]
    transfer = [
        ChannelRow(
            channel=path.name,
            quantity=NOISE_TRANSFER,
            mount=path.mount,
            piece="",
            axis=path.axis,
            node=path.node,
            direction=f"+{path.axis}",
            unit=parse_unit(QUANTITY_UNIT[NOISE_TRANSFER]),
        )
        for path in paths(mount_names)
    ]
    return [*operating, *transfer]


def mount_rows(bench: VirtualBench, sheet: DataSheet) -> list[MountRow]:
    """Return the mount table: positions from the centre of gravity of the data sheet."""
    true = [*bench.positions, *np.array(WISHBONE_POSITIONS)]
    stated = np.round(np.array(true) + sheet.centre_error, 4).tolist()
    return [
        MountRow(point.mount, point.piece, (x, y, z))
        for point, (x, y, z) in zip(points(bench.mount_names), stated, strict=True)
    ]


def platform_file(
    bench: VirtualBench, sheet: DataSheet, wheel_end_mass: float, fleet: BenchFleet
) -> PlatformFile:
    """Return the content of ``platform.toml``, with the stated mass of a wheel end [kg]."""
    nodes = ear_nodes(fleet)
    (jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz) = sheet.inertia.tolist()
    return PlatformFile(
        format=1,
        name=NAME,
        title=TITLE,
        description=DESCRIPTION,
        mount_table=MOUNT_TABLE,
        channel_table=CHANNEL_TABLE,
        default_load_case=DEFAULT_LOAD_CASE,
        engine=Engine(
            cylinders=CYLINDERS,
            dominant_order=bench.order_torque.order,
            total_ratios=bench.total_ratios,
        ),
        powertrain=Powertrain(
            mass_kg=sheet.mass,
            mass_tolerance_kg=MASS_TOLERANCE,
            inertia_kg_m2=((jxx, jxy, jxz), (jyx, jyy, jyz), (jzx, jzy, jzz)),
            inertia_tolerance=INERTIA_TOLERANCE,
            centre_of_gravity_tolerance_m=CENTRE_TOLERANCE,
        ),
        mounts=(
            *(_mount_entry(name, bench) for name in bench.mount_names),
            _mount_entry("Du", bench, wheel_end_mass),
        ),
        vehicles=tuple(
            VehicleEntry(
                name=vehicle,
                group=vehicle.rpartition("-")[0],
                noise_transfer=noise_transfer_file(vehicle),
                ear_node=nodes[vehicle],
            )
            for vehicle in fleet.bodies
        ),
        load_cases=tuple(
            LoadCaseEntry(
                name=case.name,
                title=case.title,
                gear=case.gear,
                torque_limit_nm=case.torque_limit,
                operating=operating_file(case),
                torque_table=torque_file(case),
            )
            for case in LOAD_CASES
        ),
    )


def _mount_entry(name: str, bench: VirtualBench, body_mass: float | None = None) -> MountEntry:
    pieces = tuple(point.piece for point in points(bench.mount_names) if point.mount == name)
    axes = {path.axis for path in paths(bench.mount_names) if path.mount == name}
    return MountEntry(
        name=name,
        description=MOUNT_DESCRIPTIONS[name],
        pieces=pieces if len(pieces) > 1 else None,
        transfer_axes=tuple(axis for axis in AXES if axis in axes),
        body_mass_kg=body_mass,
        body_mass_tolerance_kg=None if body_mass is None else WHEEL_END_TOLERANCE,
    )


def readme_text(
    fleet: BenchFleet, mount_names: tuple[str, ...], frequency: RealArray, order: float, seed: int
) -> str:
    """Return ``README.txt``: every file, and the map from nodes and directions to channels."""
    origin = "the frozen fleet" if seed == FROZEN_SEED else "a fleet drawn from the prior"
    lines = [
        TITLE,
        "=" * len(TITLE),
        "",
        "Virtual measurements of the deboom bench, with the errors of real sensors. Written by",
        f"    deboom bench write FOLDER --seed {seed}",
        f"({origin}). Nobody measured this in a car.",
        "",
        f"All spectra: {frequency.size} lines from {frequency[0]:g} to {frequency[-1]:g} Hz, "
        f"engine order {order:g}, SI units,",
        "complex peak amplitudes, time factor e^{+jwt}. x points rearward, y to the right, z up;",
        "positions count from the powertrain's centre of gravity. UFF files: ASCII, data set 58.",
        "",
        "platform.toml      names every other file; engine, gear ratios, data sheet",
        f"{MOUNT_TABLE:<18} position of the virtual point of every mount",
        f"{CHANNEL_TABLE:<18} which node and direction is which channel, and its unit",
        "truth/             the exact values behind the measurements, for verification only;",
        "                   no study reads it, and deleting it changes no result",
        "",
        "Operating displacement [m] and force on the body [N] at the virtual points, type 0:",
        *(f"    {operating_file(case):<28} {case.title}" for case in LOAD_CASES),
        "    node direction   channel",
        *(
            f"    {point.node}  +{axis}          {point.channel(axis)}"
            for point in points(mount_names)
            for axis in point.axes
        ),
        "",
        "Engine torque at every line [N m]:",
        *(f"    {torque_file(case)}" for case in LOAD_CASES),
        "",
        "Noise transfer functions [Pa/N], type 4; response = ear node, reference = path:",
        *(
            f"    {noise_transfer_file(vehicle):<28} driver's ear of {vehicle}: node {node}"
            for vehicle, node in ear_nodes(fleet).items()
        ),
        "    node direction   path",
        *(f"    {path.node}  +{path.axis}          {path.name}" for path in paths(mount_names)),
        "    Du x: the same force on both wishbone mounts in phase, per newton of their sum.",
    ]
    return "\n".join(lines) + "\n"


def write_truth(
    folder: Path,
    bench: VirtualBench,
    sheet: DataSheet,
    fleet: BenchFleet,
    frequency: RealArray,
    runs: Mapping[str, OperatingRun],
    noise_transfer: Mapping[str, ComplexArray],
) -> None:
    """Write what the measurement files only approximate.

    Parameters
    ----------
    folder : Path
        Exists and is empty.
    bench, sheet, fleet
        What was measured.
    frequency : array, shape (f,)
        Lines of all spectra [Hz].
    runs : mapping of str to OperatingRun
        Load case to its true run.
    noise_transfer : mapping of str to array, shape (f, n_path)
        Vehicle to its true noise transfer functions [Pa/N].
    """
    first = next(iter(runs.values()))
    np.savez(
        folder / "operating.npz",
        frequency=frequency,
        load_cases=np.array(list(runs)),
        channels=np.array(first.channels),
        displacement=np.array([run.displacement for run in runs.values()]),
        force=np.array([run.force for run in runs.values()]),
        stiffness=np.array([run.stiffness for run in runs.values()]),
        engine_torque=np.array([run.engine_torque for run in runs.values()]),
    )
    np.savez(
        folder / "noise_transfer.npz",
        frequency=frequency,
        vehicles=np.array(list(noise_transfer)),
        paths=np.array(fleet.paths),
        noise_transfer=np.array(list(noise_transfer.values())),
    )
    bodies = fleet.bodies.values()
    np.savez(
        folder / "body_modes.npz",
        vehicles=np.array(list(fleet.bodies)),
        frequencies=np.array([body.frequencies for body in bodies]),
        damping_ratios=np.array([body.damping_ratios for body in bodies]),
        shapes_at_paths=np.array([body.shapes_at_paths for body in bodies]),
        shapes_at_panels=np.array([body.shapes_at_panels for body in bodies]),
        local_stiffness=np.array([body.local_stiffness for body in bodies]),
    )
    write_powertrain_truth(folder, bench, sheet)


def write_powertrain_truth(folder: Path, bench: VirtualBench, sheet: DataSheet) -> None:
    """Write what the data sheet only approximates, as ``powertrain.json``.

    Parameters
    ----------
    folder : Path
        Exists.
    bench, sheet
        The truth, and what is stated of it.
    """
    powertrain = {
        "mass_kg": bench.mass,
        "inertia_kg_m2": bench.inertia.tolist(),
        "mount_position_m": dict(zip(bench.mount_names, bench.positions.tolist(), strict=True)),
        "centre_of_gravity_from_stated_one_m": sheet.centre_error.tolist(),
        "wheel_end_mass_kg": float(bench.wheel_end.mass_matrix[0, 0]),
    }
    replace_text(folder / "powertrain.json", json.dumps(powertrain, indent=1) + "\n")


Progress = Callable[[int, int, str], None]

TORQUE_NOISE = 1.0
"""Standard deviation of the engine torque that the control unit states, per line [N m]."""

TORQUE_DIGITS = 2
"""Decimals to which it does."""


def write_platform(folder: Path, seed: int, progress: Progress | None = None) -> Path:
    """Measure the virtual platform and write its files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        From 1. It draws all errors of measurement, and every fleet but that of seed 1, which is
        frozen. The same seed gives the same bytes.
    progress : callable, optional
        Called with the files written so far, all files, and the name of the last one.

    Returns
    -------
    Path
        The folder, with ``platform.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; a folder that is not empty or cannot be written.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    with complete_or_not_at_all(Path(folder)) as unfinished:
        _write_files(unfinished, seed, progress or _silent)
    return Path(folder)


def _silent(done: int, total: int, text: str) -> None:
    """Tell nobody."""


def _write_files(folder: Path, seed: int, progress: Progress) -> None:
    bench, fleet, budget = load_bench(), load_fleet(seed), ErrorBudget()
    names, order = bench.mount_names, bench.order_torque.order
    # one child per purpose, so that a change of one draw leaves the others as they are
    children = np.random.SeedSequence(seed).spawn(6)
    for_sheet, for_sensors, for_runs, for_vehicles, for_wheel_end, for_torque = children
    sheet = draw_data_sheet(bench, np.random.default_rng(for_sheet))
    wheel_end_mass = draw_wheel_end_mass(bench, np.random.default_rng(for_wheel_end))
    instrumentation, knowledge = draw_instrumentation(
        bench, budget, np.random.default_rng(for_sensors)
    )
    total = len(LOAD_CASES) + len(fleet.bodies) + 1
    for name in ("operating", "noise_transfer", "truth"):
        (folder / name).mkdir()

    runs = {}
    torque_noise = np.random.default_rng(for_torque)
    for case, child in zip(LOAD_CASES, for_runs.spawn(len(LOAD_CASES)), strict=True):
        run = full_load_run(bench, case.gear, case.torque_limit, FREQUENCY)
        raw = measure(instrumentation, run, budget, np.random.default_rng(child))
        measured = evaluate(knowledge, raw)
        functions = operating_functions(measured, FREQUENCY, case, names, order)
        write_uff(folder / operating_file(case), functions)
        torque = run.engine_torque + torque_noise.normal(0, TORQUE_NOISE, FREQUENCY.size)
        write_torque_table(folder / torque_file(case), FREQUENCY, np.round(torque, TORQUE_DIGITS))
        runs[case.name] = run
        progress(len(runs), total, operating_file(case))

    transfers = {}
    nodes = ear_nodes(fleet)
    children = for_vehicles.spawn(len(fleet.bodies))
    for (vehicle, body), child in zip(fleet.bodies.items(), children, strict=True):
        true = noise_transfer(body, fleet.cabin, FREQUENCY)
        found = measured_noise_transfer(true, TransferErrors(), np.random.default_rng(child))
        functions = noise_transfer_functions(found, FREQUENCY, vehicle, nodes[vehicle], names)
        write_uff(folder / noise_transfer_file(vehicle), functions)
        transfers[vehicle] = true
        progress(len(runs) + len(transfers), total, noise_transfer_file(vehicle))

    write_truth(folder / "truth", bench, sheet, fleet, FREQUENCY, runs, transfers)
    write_mount_table(folder / MOUNT_TABLE, mount_rows(bench, sheet))
    write_channel_table(folder / CHANNEL_TABLE, channel_rows(names))
    replace_text(folder / "README.txt", readme_text(fleet, names, FREQUENCY, order, seed))
    dump_platform_file(folder / "platform.toml", platform_file(bench, sheet, wheel_end_mass, fleet))
    progress(total, total, "platform.toml")
