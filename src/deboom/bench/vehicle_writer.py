"""Writes the measurement of one virtual vehicle, and the truth beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.coupled_car import (
    NO_CAR_ERRORS,
    CarErrors,
    CoupledRun,
    at_ears,
    drive,
    write_run_truth,
    write_vehicle_truth,
)
from deboom.bench.fleet import NO_STATE_SPREAD, BenchFleet, Body, StateSpread, in_state, load_fleet
from deboom.bench.interfaces import EARS
from deboom.bench.layout import ACCELEROMETER_MODEL, FREQUENCY, LOAD_CASES, LoadCasePlan
from deboom.bench.platform_writer import mount_rows, platform_file
from deboom.bench.powertrain import AXES, VirtualBench, load_bench, mount_set, with_mount_set
from deboom.bench.sensors import DataSheet, ErrorBudget, draw_wheel_end_mass, order_noise
from deboom.bench.vehicle_acquisition import (
    EAR_NODES,
    MICROPHONES,
    NO_ACQUISITION_ERRORS,
    AcquisitionErrors,
    BlowPlan,
    SensorPlace,
    Setup,
    body_sensor_places,
    breathe,
    draw_setup,
    impact_places,
    listen_at_panels,
    panel_functions,
    panel_table,
    source_sensor_places,
    strike,
    write_blows,
)
from deboom.errors import InputError
from deboom.files.campaign_tables import (
    CampaignChannel,
    SensorRow,
    write_campaign_channels,
    write_sensor_table,
)
from deboom.files.folders import complete_or_not_at_all, replace_text
from deboom.files.platform import write_mount_table
from deboom.files.tables import parse_unit
from deboom.files.uff import UffFunction, write_uff
from deboom.files.vehicle import (
    VEHICLE_FILE,
    EarEntry,
    ImpactRow,
    PanelEntry,
    VehicleFile,
    VehicleRunEntry,
    dump_vehicle_file,
    write_impact_table,
    write_panel_table,
)
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.rigid_body import forward_matrices

SPECTRUM, FRF = 0, 4
"""UFF function types."""


def impact_table(bench: VirtualBench) -> list[ImpactRow]:
    """Return the position sheet of the blows."""
    return [
        ImpactRow(
            place.name, place.mount, place.piece, place.node, place.direction, _at(place.position)
        )
        for place in impact_places(bench)
    ]


def sensor_table(bench: VirtualBench) -> list[SensorRow]:
    """Return the position sheet of the accelerometers: source side, then body side."""
    return [
        SensorRow(
            sensor=place.name,
            kind="accelerometer",
            model=ACCELEROMETER_MODEL,
            mount=place.mount,
            piece=place.piece,
            position=_at(place.position),
            angles=_at(np.deg2rad(place.angles), digits=12),
        )
        for place in (*source_sensor_places(bench), *body_sensor_places(bench))
    ]


def channel_table(bench: VirtualBench) -> list[CampaignChannel]:
    """Return the nodes of all accelerometer channels."""
    return [
        CampaignChannel(
            f"{place.name} {axis}", "acceleration", place.node, f"+{axis}", parse_unit("m/s^2")
        )
        for place in (*source_sensor_places(bench), *body_sensor_places(bench))
        for axis in AXES
    ]


def direct_functions(
    bench: VirtualBench, pressure: ComplexArray, frequency: RealArray, vehicle: str
) -> list[UffFunction]:
    """Return pressure at the ears per force of every blow, UFF type 4.

    Parameters
    ----------
    pressure : array, shape (f, n_ear, n_impact)
        [Pa/N].
    """
    return [
        _frf(
            frequency,
            pressure[:, row, column],
            response=(EAR_NODES[ear], "scalar", MICROPHONES[ear], "pressure", "Pa"),
            reference=(place.node, place.direction, place.mount, "force", "N"),
            title=f"noise transfer function, {vehicle}, {ear}, hammer at {place.name}",
        )
        for row, ear in enumerate(EARS)
        for column, place in enumerate(impact_places(bench))
    ]


def reciprocal_functions(
    bench: VirtualBench, acceleration: ComplexArray, frequency: RealArray, vehicle: str
) -> list[UffFunction]:
    """Return acceleration on the body per volume acceleration at the ears, UFF type 4.

    Parameters
    ----------
    acceleration : array, shape (f, n_channel, n_ear)
        [(m/s²)/(m³/s²)].

    Notes
    -----
    Data set 58 knows no volume acceleration: it is a ``general`` quantity in ``m^3/s^2``.
    """
    return [
        _frf(
            frequency,
            acceleration[:, row, column],
            response=(place.node, f"+{axis}", place.name, "acceleration", "m/s^2"),
            reference=(EAR_NODES[ear], "scalar", "LOUDSP 1", "general", "m^3/s^2"),
            title=f"reciprocal measurement, {vehicle}, loudspeaker at {ear}, {place.name} {axis}",
        )
        for row, (place, axis) in enumerate(_channels(body_sensor_places(bench)))
        for column, ear in enumerate(EARS)
    ]


def accelerance_functions(
    bench: VirtualBench, acceleration: ComplexArray, frequency: RealArray, vehicle: str
) -> list[UffFunction]:
    """Return acceleration on the body per force of every blow, UFF type 4.

    Parameters
    ----------
    acceleration : array, shape (f, n_channel, n_impact)
        [m/s² per N].
    """
    return [
        _frf(
            frequency,
            acceleration[:, row, column],
            response=(place.node, f"+{axis}", place.name, "acceleration", "m/s^2"),
            reference=(blow.node, blow.direction, blow.mount, "force", "N"),
            title=f"accelerance, {vehicle}, hammer at {blow.name}, {place.name} {axis}",
        )
        for row, (place, axis) in enumerate(_channels(body_sensor_places(bench)))
        for column, blow in enumerate(impact_places(bench))
    ]


def run_functions(
    bench: VirtualBench,
    pressure: ComplexArray,
    acceleration: ComplexArray,
    frequency: RealArray,
    title: str,
) -> list[UffFunction]:
    """Return order spectra of one run, UFF type 0.

    Parameters
    ----------
    pressure : array, shape (f, n_ear)
        [Pa].
    acceleration : array, shape (f, n_channel)
        Source side, then body side [m/s²].
    title : str
        Of the run.
    """
    sensors = (*source_sensor_places(bench), *body_sensor_places(bench))
    columns = [
        (EAR_NODES[ear], "scalar", MICROPHONES[ear], "pressure", "Pa", pressure[:, k])
        for k, ear in enumerate(EARS)
    ]
    columns += [
        (place.node, f"+{axis}", place.name, "acceleration", "m/s^2", acceleration[:, k])
        for k, (place, axis) in enumerate(_channels(sensors))
    ]
    return [
        UffFunction(
            abscissa=frequency,
            values=values,
            function_type=SPECTRUM,
            response_node=node,
            response_direction=direction,
            reference_node=0,
            reference_direction="scalar",
            ordinate=quantity,
            ordinate_unit=unit,
            denominator="none",
            denominator_unit="",
            id_lines=(
                f"order {bench.order_torque.order:g}, {quantity}, {name}",
                title,
                "complex peak amplitude, phase referred to the tacho",
            ),
            response_name=name,
        )
        for node, direction, name, quantity, unit, values in columns
    ]


def _frf(
    frequency: RealArray,
    values: ComplexArray,
    response: tuple[int, str, str, str, str],
    reference: tuple[int, str, str, str, str],
    title: str,
) -> UffFunction:
    return UffFunction(
        abscissa=frequency,
        values=values,
        function_type=FRF,
        response_node=response[0],
        response_direction=response[1],
        reference_node=reference[0],
        reference_direction=reference[1],
        ordinate=response[3],
        ordinate_unit=response[4],
        denominator=reference[3],
        denominator_unit=reference[4],
        id_lines=(title,),
        response_name=response[2],
        reference_name=reference[2],
    )


def _channels(places: Sequence[SensorPlace]) -> list[tuple[SensorPlace, str]]:
    return [(place, axis) for place in places for axis in AXES]


def _at(position: RealArray, digits: int = 4) -> tuple[float, float, float]:
    x, y, z = np.round(position, digits).tolist()
    return x, y, z


def readme_text(bench: VirtualBench, vehicle: str, parts: str, seed: int) -> str:
    """Return ``README.txt``: every file, and the map from nodes to ears, blows and sensors."""
    title = f"Virtual vehicle {vehicle} with mount set {parts}, seed {seed}"
    blows: dict[int, list[str]] = {}
    for place in impact_places(bench):
        blows.setdefault(place.node, [f"{place.mount} {place.piece}".strip()]).append(
            f"{place.name} ({place.direction})"
        )
    text = [
        title,
        "=" * len(title),
        "",
        "Virtual measurements with the errors of real sensors, hammer and loudspeaker. Nobody",
        "measured this.",
        "",
        f"{FREQUENCY.size} lines from {FREQUENCY[0]:g} to {FREQUENCY[-1]:g} Hz, SI units, complex",
        "peak amplitudes, time factor e^{+jwt}; runs along the engine order "
        f"{bench.order_torque.order:g},",
        "phase to the tacho. x points rearward, y to the right, z up; positions count from the",
        "powertrain's centre of gravity. UFF files: binary, data set 58.",
        "",
        "vehicle.toml                    names every other file; ears, mounts, runs",
        "mounts.csv                      virtual point of every mount",
        "sensors.csv, channels.csv       accelerometers: position sheet, nodes",
        "impacts.csv                     blows of the hammer: position sheet, nodes, directions",
        "noise_transfer/direct.uff       pressure at the ears per force of each blow [Pa/N]",
        "noise_transfer/reciprocal.uff   acceleration on the body per volume acceleration of a",
        "                                loudspeaker at each ear [m/s^2 per m^3/s^2], out of it",
        "                                positive; pressure per force is its negative",
        "noise_transfer/accelerance.uff  acceleration on the body per force of each blow",
        "panels.csv                      panels of the cabin: node, place, inward normal, area",
        "noise_transfer/panel_*.uff      acceleration of the panels inwards, and pressure at them,",
        "                                per volume acceleration at the ears",
        "operating/RUN.uff               the driven car: pressure at the ears, acceleration on",
        "                                both sides of every mount (type 0)",
        "hammer/                         blows around one mount over time, where asked for",
        "truth/                          the exact values behind, for verification only",
        "",
        "Hammer and loudspeaker found the trimmed body without its powertrain, on different days;",
        "the runs are those of the complete car on its flexible body, mounts warmer than on the",
        "bench, with other paths.",
        "",
        *(f"    node {node:<4} {ear}, {MICROPHONES[ear]}" for ear, node in EAR_NODES.items()),
        "Blows:",
        *(f"    node {node:<4} {what[0]:<9} {', '.join(what[1:])}" for node, what in blows.items()),
        "Accelerometers on powertrain and wheel ends:",
        *_table(source_sensor_places(bench)),
        "Accelerometers on the body:",
        *_table(body_sensor_places(bench)),
    ]
    return "\n".join(text) + "\n"


def _table(places: tuple[SensorPlace, ...]) -> list[str]:
    return [
        f"    node {place.node:<4} {place.name:<4} {f'{place.mount} {place.piece}'.strip()}"
        for place in places
    ]


Progress = Callable[[int, int, str], None]

MOUNT_TABLE, SENSOR_TABLE, CHANNEL_TABLE, IMPACT_TABLE, PANEL_TABLE = (
    f"{name}.csv" for name in ("mounts", "sensors", "channels", "impacts", "panels")
)
DIRECT, RECIPROCAL, ACCELERANCE, PANEL_MOTION, PANEL_PRESSURE = (
    f"noise_transfer/{name}.uff"
    for name in ("direct", "reciprocal", "accelerance", "panel_motion", "panel_pressure")
)


@dataclass(frozen=True)
class VehicleErrors:
    """All errors of a vehicle's measurement.

    Parameters
    ----------
    acquisition : AcquisitionErrors
        Of hammer, loudspeaker, microphones and body sensors.
    car : CarErrors
        What makes the driven car another one than bench and transfer functions say.
    state : StateSpread
        How the body differs between hammer, loudspeaker and road.
    order_tracking : ErrorBudget or None
        Noise of the order spectra; None for none.
    blows : BlowPlan
        Blows over time, with their noise.
    """

    acquisition: AcquisitionErrors = field(default_factory=AcquisitionErrors)
    car: CarErrors = field(default_factory=CarErrors)
    state: StateSpread = field(default_factory=StateSpread)
    order_tracking: ErrorBudget | None = field(default_factory=ErrorBudget)
    blows: BlowPlan = field(default_factory=BlowPlan)


NO_VEHICLE_ERRORS = VehicleErrors(
    NO_ACQUISITION_ERRORS,
    NO_CAR_ERRORS,
    NO_STATE_SPREAD,
    order_tracking=None,
    blows=BlowPlan(force_noise=0.0, pressure_noise=0.0),
)
"""Everything as stated, for verification."""


def write_vehicle(
    folder: Path,
    seed: int,
    vehicle: str = "U06-1",
    parts: str = "M1",
    errors: VehicleErrors | None = None,
    load_cases: tuple[LoadCasePlan, ...] = LOAD_CASES,
    blows_at: str = "",
    accelerance: bool = True,
    progress: Progress | None = None,
) -> Path:
    """Measure one vehicle and write its files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        From 1. It draws the errors; seed 1 takes the frozen fleet, every other one draws a fleet.
    vehicle : str
        Of the fleet, such as ``U06-1``.
    parts : str
        Mount set under its powertrain, such as ``M1`` or ``EnM1-GeM2-TSM3-Du4``.
    errors : VehicleErrors, optional
        How large the errors are; by default those of a good laboratory.
    load_cases : tuple of LoadCasePlan
        Runs on the road.
    blows_at : str
        Mount around which the hammer's blocks over time are written as well, such as ``TSM``, to
        ``hammer/``; none if empty.
    accelerance : bool
        Write the acceleration on the body per blow too: 2025 functions, 8 MB.
    progress : callable, optional
        Called with the files written so far, all files, and the name of the last one.

    Returns
    -------
    Path
        The folder, with ``vehicle.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; a vehicle, mount set or gear that does not exist; a folder that is not empty
        or cannot be written.
    """
    if seed < 1:
        raise InputError(f"seed {seed} is refused: seeds are whole numbers from 1")
    drawn, fleet = load_bench(), load_fleet(seed)
    bench = with_mount_set(drawn, mount_set(parts, drawn))
    if vehicle not in fleet.bodies:
        raise InputError(
            f"there is no vehicle '{vehicle}' in the fleet: use {', '.join(fleet.bodies)}"
        )
    report = progress or _silent
    with complete_or_not_at_all(Path(folder)) as unfinished:
        session = _Session(unfinished, seed, vehicle, bench, fleet, errors or VehicleErrors())
        plan = _Plan(parts, load_cases, blows_at, accelerance)
        _write_files(session, plan, report)
    return Path(folder)


def _silent(done: int, total: int, text: str) -> None:
    """Tell nobody."""


@dataclass(frozen=True)
class _Session:
    folder: Path
    seed: int
    vehicle: str
    bench: VirtualBench
    fleet: BenchFleet
    errors: VehicleErrors

    @property
    def body(self) -> Body:
        return self.fleet.bodies[self.vehicle]

    def generator(self, purpose: int) -> np.random.Generator:
        """Give every purpose draws of its own, for every vehicle."""
        number = list(self.fleet.bodies).index(self.vehicle)
        return np.random.default_rng([self.seed, number, purpose])


@dataclass(frozen=True)
class _Plan:
    parts: str
    load_cases: tuple[LoadCasePlan, ...]
    blows_at: str
    accelerance: bool


_SETUP, _HAMMER, _LOUDSPEAKER, _SHEET, _ROAD = range(5)


def _write_files(session: _Session, plan: _Plan, report: Progress) -> None:
    folder, bench, errors = session.folder, session.bench, session.errors
    total = len(plan.load_cases) + 4
    for name in ("noise_transfer", "operating", "truth"):
        (folder / name).mkdir()
    setup = draw_setup(bench, errors.acquisition, session.generator(_SETUP))
    cabin = session.fleet.cabin

    generator = session.generator(_HAMMER)
    struck = in_state(session.body, errors.state, generator)
    pressure, accelerance = strike(setup, struck, cabin, FREQUENCY, errors.acquisition, generator)
    write_uff(
        folder / DIRECT, direct_functions(bench, pressure, FREQUENCY, session.vehicle), binary=True
    )
    if plan.blows_at:
        hammer = folder / "hammer"
        write_blows(hammer, bench, setup, struck, cabin, plan.blows_at, generator, errors.blows)
    report(1, total, DIRECT)
    if plan.accelerance:
        functions = accelerance_functions(bench, accelerance, FREQUENCY, session.vehicle)
        write_uff(folder / ACCELERANCE, functions, binary=True)
    report(2, total, ACCELERANCE)
    generator = session.generator(_LOUDSPEAKER)
    moved = in_state(session.body, errors.state, generator)
    answer = breathe(setup, moved, cabin, FREQUENCY, errors.acquisition, generator)
    functions = reciprocal_functions(bench, answer, FREQUENCY, session.vehicle)
    write_uff(folder / RECIPROCAL, functions, binary=True)
    heard = listen_at_panels(setup, moved, cabin, FREQUENCY, errors.acquisition, generator)
    _write_panels(session, *heard)
    report(3, total, RECIPROCAL)

    for number, case in enumerate(plan.load_cases):
        _write_run(session, setup, case, session.generator(_ROAD + number))
        report(4 + number, total, f"operating/{case.name}.uff")
    write_vehicle_truth(folder / "truth/vehicle.npz", bench, session.body, cabin, FREQUENCY)
    exact = DataSheet(bench.mass, bench.inertia, np.zeros(3))
    write_mount_table(folder / MOUNT_TABLE, mount_rows(bench, exact))
    write_sensor_table(folder / SENSOR_TABLE, sensor_table(bench))
    write_campaign_channels(folder / CHANNEL_TABLE, channel_table(bench))
    write_impact_table(folder / IMPACT_TABLE, impact_table(bench))
    replace_text(
        folder / "README.txt", readme_text(bench, session.vehicle, plan.parts, session.seed)
    )
    mass = draw_wheel_end_mass(bench, session.generator(_SHEET))
    dump_vehicle_file(folder / VEHICLE_FILE, _vehicle_file(session, exact, mass, plan))
    report(total, total, VEHICLE_FILE)


def _write_panels(session: _Session, motion: ComplexArray, pressure: ComplexArray) -> None:
    panels = panel_table(session.fleet.cabin)
    for name, values, quantity in (
        (PANEL_MOTION, motion, ("acceleration", "m/s^2")),
        (PANEL_PRESSURE, pressure, ("pressure", "Pa")),
    ):
        functions = panel_functions(panels, values, FREQUENCY, quantity, session.vehicle)
        write_uff(session.folder / name, functions, binary=True)
    write_panel_table(session.folder / PANEL_TABLE, panels)


def _write_run(
    session: _Session, setup: Setup, case: LoadCasePlan, generator: np.random.Generator
) -> None:
    bench, errors = session.bench, session.errors
    rpm = rpm_of_frequency(FREQUENCY, bench.order_torque.order)
    torque = bench.ramp.torque(case.torque_limit, rpm)
    torque = torque * (1 + generator.normal(0, errors.car.torque))
    body = in_state(session.body, errors.state, generator)
    run = drive(
        bench, body, session.fleet.cabin, case.gear, torque, FREQUENCY, errors.car.mount_stiffness
    )
    true, heard = at_ears(run, errors.car, generator)
    acceleration = road_acceleration(bench, setup, run)
    if errors.order_tracking is not None:
        noise = errors.order_tracking
        levels = noise.acceleration_own, noise.acceleration_norm, noise.acceleration_floor
        acceleration = acceleration + order_noise(acceleration, 3, levels, generator)
    functions = run_functions(bench, heard, acceleration, FREQUENCY, case.title)
    write_uff(session.folder / f"operating/{case.name}.uff", functions, binary=True)
    write_run_truth(session.folder / f"truth/{case.name}.npz", bench, run, true)


def road_acceleration(bench: VirtualBench, setup: Setup, run: CoupledRun) -> ComplexArray:
    """Return what all accelerometers show of a run, without noise.

    Returns
    -------
    array, shape (f, n_channel)
        Source side, then body side, in sensor axes [m/s²]. Sensors on the source side are exact.
    """
    places = source_sensor_places(bench)
    on_powertrain = [place.position for place in places if place.mount in bench.mount_names]
    powertrain = run.powertrain @ forward_matrices(on_powertrain).T
    wheel_ends = np.zeros((run.frequency.size, 3 * run.wheel_ends.shape[1]), dtype=complex)
    wheel_ends[:, ::3] = run.wheel_ends
    on_body = [run.body_motion[:, number] @ rows.T for number, rows in enumerate(setup.sensor_rows)]
    squared = (2 * np.pi * run.frequency[:, None]) ** 2
    return np.asarray(-squared * np.hstack([powertrain, wheel_ends, *on_body]))


def _vehicle_file(
    session: _Session,
    sheet: DataSheet,
    wheel_end_mass: float,
    plan: _Plan,
) -> VehicleFile:
    bench = session.bench
    platform = platform_file(bench, sheet, wheel_end_mass, session.fleet)
    return VehicleFile(
        format=1,
        name=session.vehicle,
        group=session.vehicle.rpartition("-")[0],
        title=f"Virtual vehicle {session.vehicle}, mount set {plan.parts}",
        mount_table=MOUNT_TABLE,
        sensor_table=SENSOR_TABLE,
        channel_table=CHANNEL_TABLE,
        impact_table=IMPACT_TABLE,
        source_sensors=tuple(place.name for place in source_sensor_places(bench)),
        direct=DIRECT,
        reciprocal=RECIPROCAL,
        accelerance=ACCELERANCE if plan.accelerance else None,
        panels=PanelEntry(table=PANEL_TABLE, motion=PANEL_MOTION, pressure=PANEL_PRESSURE),
        engine=platform.engine,
        ears=tuple(
            EarEntry(name=ear, node=EAR_NODES[ear], microphone=MICROPHONES[ear]) for ear in EARS
        ),
        mounts=platform.mounts,
        runs=tuple(
            VehicleRunEntry(
                name=case.name,
                gear=case.gear,
                torque_limit_nm=case.torque_limit,
                file=f"operating/{case.name}.uff",
            )
            for case in plan.load_cases
        ),
    )
