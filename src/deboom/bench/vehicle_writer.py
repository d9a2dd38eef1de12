"""Writes one vehicle of the fleet as a laboratory would deliver it, and the truth beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from deboom.arrays import ComplexArray
from deboom.bench.body import Body
from deboom.bench.coupled_car import NO_CAR_ERRORS, CarErrors, CoupledRun, at_ears, drive
from deboom.bench.data_sheet import DataSheet, draw_wheel_end_mass
from deboom.bench.ears import EARS
from deboom.bench.fleet import BenchFleet, load_fleet
from deboom.bench.hammer_blows import BlowPlan, write_blows
from deboom.bench.measurement_files import mount_rows, platform_file
from deboom.bench.mount_sets import mount_set, with_mount_set
from deboom.bench.parameters import VirtualBench, load_bench
from deboom.bench.platform_layout import FREQUENCY, LOAD_CASES, LoadCasePlan
from deboom.bench.sensors import ErrorBudget, order_noise
from deboom.bench.vehicle_acquisition import (
    NO_ACQUISITION_ERRORS,
    AcquisitionErrors,
    Setup,
    breathe,
    draw_setup,
    strike,
)
from deboom.bench.vehicle_functions import (
    accelerance_functions,
    channel_table,
    direct_functions,
    impact_table,
    reciprocal_functions,
    run_functions,
    sensor_table,
)
from deboom.bench.vehicle_layout import EAR_NODES, MICROPHONES, source_sensor_places
from deboom.bench.vehicle_panels import listen_at_panels, panel_functions, panel_table
from deboom.bench.vehicle_readme import readme_text
from deboom.bench.vehicle_state import NO_STATE_SPREAD, StateSpread, in_state
from deboom.bench.vehicle_truth import write_run_truth, write_vehicle_truth
from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.campaign_tables import write_campaign_channels, write_sensor_table
from deboom.files.platform_tables import write_mount_table
from deboom.files.uff import write_uff
from deboom.files.vehicle_file import (
    VEHICLE_FILE,
    EarEntry,
    VehicleFile,
    VehicleRunEntry,
    dump_vehicle_file,
)
from deboom.files.vehicle_panels import PanelEntry, write_panel_table
from deboom.files.vehicle_tables import write_impact_table
from deboom.files.whole_folder import complete_or_not_at_all
from deboom.physics.orders import rpm_of_frequency
from deboom.physics.rigid_body import forward_matrices

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
