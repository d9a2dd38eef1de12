"""Writes one vehicle of the fleet as a laboratory would deliver it, and the truth beside it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from deboom.arrays import AXES, ComplexArray
from deboom.bench import writing
from deboom.bench.families import Family, draw_family
from deboom.bench.fleet import (
    EARS,
    NO_SPREAD,
    BenchFleet,
    Body,
    BodySpread,
    ear_transfer,
    interface_shapes,
    scattered_body,
)
from deboom.bench.layout import (
    ACCELEROMETER_MODEL,
    FREQUENCY,
    LOAD_CASES,
    Place,
    accelerometer_places,
    points,
)
from deboom.bench.operating_run import (
    NO_CAR_ERRORS,
    CarErrors,
    CoupledRun,
    PlannedRun,
    at_ears,
    drive,
)
from deboom.bench.platform_writer import engine_section, mount_rows, mount_sections
from deboom.bench.powertrain import VirtualBench, load_bench, read_data, with_mount_set
from deboom.bench.sensors import ErrorBudget, draw_wheel_end_mass, exact_data_sheet
from deboom.bench.signals import order_noise
from deboom.bench.vehicle_acquisition import (
    EAR_NODES,
    MICROPHONES,
    NO_ACQUISITION_ERRORS,
    AcquisitionErrors,
    Setup,
    body_sensor_places,
    breathe,
    draw_setup,
    impact_places,
    listen_at_panels,
    strike,
)
from deboom.errors import InputError
from deboom.files.disk import complete_or_not_at_all
from deboom.files.inertance_test import ToleranceSection
from deboom.files.rows import (
    CampaignChannel,
    ImpactRow,
    MountRow,
    PanelRow,
    SensorRow,
    write_torque_table,
)
from deboom.files.schema import dump_toml
from deboom.files.tables import write_table
from deboom.files.uff import write_uff
from deboom.files.units import parse_unit
from deboom.files.vehicle import VEHICLE_FILE, EarEntry, PanelEntry, VehicleFile, VehicleRunEntry
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.progress import Progress

MOUNT_TABLE, SENSOR_TABLE, CHANNEL_TABLE, IMPACT_TABLE, PANEL_TABLE = (
    f"{name}.csv" for name in ("mounts", "sensors", "channels", "impacts", "panels")
)
DIRECT, RECIPROCAL, ACCELERANCE, PANEL_MOTION, PANEL_PRESSURE = (
    f"noise_transfer/{name}.uff"
    for name in ("direct", "reciprocal", "accelerance", "panel_motion", "panel_pressure")
)

FIRST_PANEL_NODE = 601
PANEL_PLACES = {
    "trunk floor": ((3.3, 0.0, -0.05), (0.0, 0.0, 1.0)),
    "rear bench": ((2.7, 0.0, 0.15), (-0.8, 0.0, 0.6)),
    "front floor": ((1.4, 0.0, -0.2), (0.0, 0.0, 1.0)),
    "front doors": ((1.5, -0.75, 0.25), (0.0, 1.0, 0.0)),
    "rear doors": ((2.4, -0.75, 0.25), (0.0, 1.0, 0.0)),
    "tailgate": ((3.7, 0.0, 0.45), (-1.0, 0.0, 0.0)),
    "roof": ((2.2, 0.0, 0.95), (0.0, 0.0, -1.0)),
    "windshield": ((0.9, 0.0, 0.7), (0.8, 0.0, -0.6)),
}
"""Accelerometer and inward normal of each panel [m], [1]; of doors, those of the left one."""

_SETUP, _HAMMER, _LOUDSPEAKER, _SHEET, _ROAD = range(5)
"""Purposes with random numbers of their own."""


@dataclass(frozen=True)
class VehicleErrors:
    """All errors of a vehicle's measurement.

    - `acquisition`: errors of hammer, loudspeaker, microphones and body sensors.
    - `car`: what makes the driven car another one than bench and transfer functions say.
    - `state`: differences of the body between hammer, loudspeaker and road.
    - `order_tracking`: noise of the order spectra; None for none.
    """

    acquisition: AcquisitionErrors = field(default_factory=AcquisitionErrors)
    car: CarErrors = field(default_factory=CarErrors)
    state: BodySpread = field(default_factory=BodySpread)
    order_tracking: ErrorBudget | None = field(default_factory=ErrorBudget)


NO_VEHICLE_ERRORS = VehicleErrors(
    NO_ACQUISITION_ERRORS, NO_CAR_ERRORS, NO_SPREAD, order_tracking=None
)
"""Everything as stated, for verification."""


def write_vehicle(
    folder: Path,
    seed: int,
    vehicle: str = "U06-1",
    parts: str = "M1",
    errors: VehicleErrors | None = None,
    load_cases: tuple[PlannedRun, ...] = LOAD_CASES,
    accelerance: bool = True,
    progress: Progress | None = None,
    truth_seed: int = 1,
    tilt: float = 0.0,
    body_scatter: float = 1.0,
    family: str = "",
) -> Path:
    """Measure one vehicle and write its files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        Seed of the errors, from 1; seed 1 takes the frozen fleet, every other one draws a fleet.
    vehicle : str
        Name in the fleet, such as ``U06-1``.
    parts : str
        Mount set under its powertrain, such as ``M1`` or ``EnM1-GeM2-TSM3-Du4``.
    errors : VehicleErrors, optional
        Sizes of the errors; by default those of a good laboratory.
    load_cases : tuple of PlannedRun
        Full-load runs on the road.
    accelerance : bool
        Write the acceleration on the body per blow too: 2025 functions, 8 MB.
    progress : callable, optional
        Called with the files written so far, all files, and the name of the last one.
    truth_seed : int
        1 is the frozen powertrain and its mounts; every other seed draws them.
    tilt : float
        Angle by which each powertrain mount stands away from the vehicle's axes, about an axis that
        `truth_seed` draws [deg].
    body_scatter : float
        Factor on what cars of one drawing differ by [1], see `deboom.bench.fleet.load_fleet`; seed
        1, whose fleet is frozen, takes 1 alone.
    family : str
        Bodies, rubber and laboratory, see `deboom.bench.families.draw_family`; by default those of
        the bench's own prior. Rubber that it names is in the car in place of that of `errors`.

    Returns
    -------
    Path
        The folder, with ``vehicle.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; a vehicle, mount set, gear or family that does not exist; a family with lines
        or sensors that are missing; a body scatter below 0, or another one than 1 with seed 1; a
        folder that is not empty or cannot be written.
    """
    writing.check_seed(seed)
    writing.check_seed(truth_seed)
    drawn = draw_family(family, seed, truth_seed)
    drawn.refuse(("gaps", "dead"), "a vehicle's measurement")
    fleet = drawn.fleet(body_scatter)
    bench = with_mount_set(drawn.bench(load_bench(truth_seed, tilt)), parts)
    if vehicle not in fleet.bodies:
        raise InputError(
            f"there is no vehicle '{vehicle}' in the fleet: use {', '.join(fleet.bodies)}"
        )
    with complete_or_not_at_all(Path(folder)) as unfinished:
        of_family = _of_family(errors or VehicleErrors(), drawn, len(bench.mount_names))
        session = _Session(unfinished, seed, vehicle, bench, fleet, of_family)
        files = _write_files(session, parts, load_cases, accelerance)
        for done, name in enumerate(files, 1):
            if progress is not None:
                progress(done, len(load_cases) + 4, name)
        if family:
            drawn.write_truth(unfinished / "truth")
    return Path(folder)


def _of_family(errors: VehicleErrors, family: Family, n_mount: int) -> VehicleErrors:
    """Return the errors with a family's noise, and its rubber in the car where it has any."""
    noise, acquisition, car = family.values["noise"], errors.acquisition, errors.car
    if noise != 1.0:
        floors = ("relative", "pressure_floor", "acceleration_floor", "accelerance_floor")
        noisy = {name: noise * getattr(acquisition, name) for name in floors}
        acquisition = replace(acquisition, **noisy)
        car = replace(car, microphone_floor=noise * car.microphone_floor)
    if family.values["stiffness"] != 1.0 or family.values["apart"] != 0.0:
        stiffness, loss = family.in_car(n_mount)
        car = replace(car, mount_stiffness=stiffness, mount_loss=loss)
    tracking = errors.order_tracking
    if tracking is not None:
        tracking = family.budget(tracking)
    return replace(errors, acquisition=acquisition, car=car, order_tracking=tracking)


@dataclass(frozen=True)
class _Session:
    """One vehicle in the laboratory, and where its files go."""

    folder: Path
    seed: int
    vehicle: str
    bench: VirtualBench
    fleet: BenchFleet
    errors: VehicleErrors

    @property
    def body(self) -> Body:
        """Body of the vehicle on average over its states."""
        return self.fleet.bodies[self.vehicle]

    @property
    def accelerometers(self) -> tuple[Place, ...]:
        """Accelerometers of the runs: source side, then body side."""
        return (*accelerometer_places(self.bench), *body_sensor_places(self.bench))

    def generator(self, purpose: int) -> np.random.Generator:
        """Give every purpose draws of its own, for every vehicle."""
        number = list(self.fleet.bodies).index(self.vehicle)
        return np.random.default_rng([self.seed, number, purpose])


def _write_files(
    session: _Session, parts: str, load_cases: tuple[PlannedRun, ...], accelerance: bool
) -> Iterable[str]:
    """Write every file; give the name of the larger ones as soon as they are there."""
    folder, bench, errors = session.folder, session.bench, session.errors
    for name in ("noise_transfer", "operating", "truth"):
        (folder / name).mkdir()
    setup = draw_setup(bench, errors.acquisition, session.generator(_SETUP))
    cabin = session.fleet.cabin

    generator = session.generator(_HAMMER)
    struck = scattered_body(session.body, errors.state, generator)
    pressure, per_blow = strike(setup, struck, cabin, FREQUENCY, errors.acquisition, generator)
    blows = [
        (writing.Dof(place.node, place.direction, place.point.mount, "force"), place.name)
        for place in impact_places(bench)
    ]
    ears = [(_ear(ear), ear) for ear in EARS]
    title = f"noise transfer function, {session.vehicle}, {{}}, hammer at {{}}"
    _write_frfs(folder / DIRECT, pressure, ears, blows, title)
    yield DIRECT
    channels = [
        (writing.Dof(place.node, f"+{axis}", place.name, "acceleration"), f"{place.name} {axis}")
        for place in body_sensor_places(bench)
        for axis in AXES
    ]
    if accelerance:
        title = f"accelerance, {session.vehicle}, hammer at {{1}}, {{0}}"
        _write_frfs(folder / ACCELERANCE, per_blow, channels, blows, title)
    yield ACCELERANCE

    generator = session.generator(_LOUDSPEAKER)
    moved = scattered_body(session.body, errors.state, generator)
    answer = breathe(setup, moved, cabin, FREQUENCY, errors.acquisition, generator)
    speakers = [
        (writing.Dof(EAR_NODES[ear], "scalar", "LOUDSP 1", "general", "m^3/s^2"), ear)
        for ear in EARS
    ]
    title = f"reciprocal measurement, {session.vehicle}, loudspeaker at {{1}}, {{0}}"
    _write_frfs(folder / RECIPROCAL, answer, channels, speakers, title)
    names = zip(read_data("body_prior.json")["panels"], cabin.panel_areas, strict=True)
    panels = [
        PanelRow(name, FIRST_PANEL_NODE + number, *PANEL_PLACES[name][::-1], float(area))
        for number, (name, area) in enumerate(names)
    ]
    heard = listen_at_panels(setup, moved, cabin, FREQUENCY, errors.acquisition, generator)
    for file, values, quantity in zip(
        (PANEL_MOTION, PANEL_PRESSURE), heard, ("acceleration", "pressure"), strict=True
    ):
        dofs = [
            (writing.Dof(panel.node, "scalar", f"P{number}", quantity), panel.panel)
            for number, panel in enumerate(panels, 1)
        ]
        title = f"{session.vehicle}, loudspeaker at {{1}}, {quantity}, {{0}}"
        _write_frfs(folder / file, values, dofs, speakers, title)
    write_table(folder / PANEL_TABLE, PanelRow, panels)
    yield RECIPROCAL

    for number, case in enumerate(load_cases):
        yield _write_run(session, setup, case, session.generator(_ROAD + number))
    _write_vehicle_truth(session)
    _write_tables(session, parts)
    dump_toml(folder / VEHICLE_FILE, _vehicle_file(session, parts, load_cases, accelerance))
    yield VEHICLE_FILE


def _ear(ear: str) -> writing.Dof:
    """Return the degree of freedom of a microphone."""
    return writing.Dof(EAR_NODES[ear], "scalar", MICROPHONES[ear], "pressure")


def _write_frfs(
    path: Path,
    values: ComplexArray,
    responses: list[tuple[writing.Dof, str]],
    references: list[tuple[writing.Dof, str]],
    title: str,
) -> None:
    """Write FRFs (f, n_response, n_reference), UFF type 4; volume acceleration is ``general``."""
    functions = [
        writing.function(
            writing.FRF,
            FREQUENCY,
            values[:, row, column],
            response,
            reference,
            title.format(response_name, reference_name),
        )
        for row, (response, response_name) in enumerate(responses)
        for column, (reference, reference_name) in enumerate(references)
    ]
    write_uff(path, functions, binary=True)


def _write_run(
    session: _Session, setup: Setup, case: PlannedRun, generator: np.random.Generator
) -> str:
    """Drive one load case and write its order spectra, UFF type 0, and its truth."""
    bench, errors = session.bench, session.errors
    rpm = rpm_of_frequency(FREQUENCY, bench.order_torque.order)
    torque = bench.ramp.torque(case.torque, rpm) * (1 + generator.normal(0, errors.car.torque))
    body = scattered_body(session.body, errors.state, generator)
    cabin, car = session.fleet.cabin, errors.car
    in_car = car.mount_stiffness, car.mount_loss
    run = drive(bench, body, cabin, case.gear, torque, FREQUENCY, *in_car)
    true, heard = at_ears(run, errors.car, generator)
    acceleration = road_acceleration(setup, run)
    if errors.order_tracking is not None:
        levels = errors.order_tracking.acceleration_noise
        acceleration = acceleration + order_noise(acceleration, 3, levels, generator)
    dofs = [_ear(ear) for ear in EARS]
    dofs += [
        writing.Dof(place.node, f"+{axis}", place.name, "acceleration")
        for place in session.accelerometers
        for axis in AXES
    ]
    functions = [
        writing.function(
            writing.SPECTRUM,
            FREQUENCY,
            values,
            dof,
            None,
            f"order {bench.order_torque.order:g}, {dof.quantity}, {dof.name}",
            case.title,
            "complex peak amplitude, phase referred to the tacho",
        )
        for dof, values in zip(dofs, np.hstack([heard, acceleration]).T, strict=True)
    ]
    name = f"operating/{case.name}.uff"
    write_uff(session.folder / name, functions, binary=True)
    stated = bench.ramp.torque(case.torque, rpm)
    write_torque_table(session.folder / _torque_table(case), FREQUENCY, stated)
    np.savez(
        session.folder / f"truth/{case.name}.npz",
        frequency=run.frequency,
        ears=np.array(EARS),
        channels=np.array([point.channel(axis) for point in points(bench) for axis in point.axes]),
        interfaces=np.array([point.name for point in points(bench)]),
        engine_torque=run.engine_torque,
        pressure=true,
        pressure_of_mounts=run.pressure,
        force=run.force,
        deflection=run.deflection,
        stiffness=run.stiffness,
        body_motion=run.body_motion,
    )
    return name


def _torque_table(case: PlannedRun) -> str:
    return f"operating/{case.name}_torque.csv"


def road_acceleration(setup: Setup, run: CoupledRun) -> ComplexArray:
    """Return what all accelerometers show of a run, without noise, (f, n_channel) [m/s²].

    Source side, then body side, in sensor axes.
    """
    powertrain = run.powertrain @ setup.powertrain_rows.T
    wheel_ends = (run.wheel_ends[:, :, np.newaxis] * setup.wheel_rows).reshape(len(powertrain), -1)
    on_body = [run.body_motion[:, number] @ rows.T for number, rows in enumerate(setup.sensor_rows)]
    squared = (2 * np.pi * run.frequency[:, None]) ** 2
    return np.asarray(-squared * np.hstack([powertrain, wheel_ends, *on_body]))


def _write_vehicle_truth(session: _Session) -> None:
    """Write a vehicle as it truly is on average over its states."""
    body = session.body
    np.savez(
        session.folder / "truth/vehicle.npz",
        frequency=FREQUENCY,
        ears=np.array(EARS),
        interfaces=np.array([point.name for point in points(session.bench)]),
        noise_transfer=ear_transfer(body, session.fleet.cabin, FREQUENCY),
        natural_frequencies=body.frequencies,
        damping_ratios=body.damping_ratios,
        shapes_at_interfaces=interface_shapes(body),
        shapes_at_panels=body.shapes_at_panels,
    )


def _write_tables(session: _Session, parts: str) -> None:
    """Write the tables of mounts, sensors, channels and blows, and ``README.txt``."""
    folder, bench, places = session.folder, session.bench, session.accelerometers
    write_table(folder / MOUNT_TABLE, MountRow, mount_rows(bench, exact_data_sheet(bench)))
    rows = [
        writing.sensor_row(
            place,
            "accelerometer",
            ACCELEROMETER_MODEL,
            place.position,
            np.round(np.deg2rad(place.angles), 12),
        )
        for place in places
    ]
    write_table(folder / SENSOR_TABLE, SensorRow, rows)
    unit = parse_unit("m/s^2")
    channels = [
        CampaignChannel(f"{place.name} {axis}", "acceleration", place.node, f"+{axis}", unit)
        for place in places
        for axis in AXES
    ]
    write_table(folder / CHANNEL_TABLE, CampaignChannel, channels)
    impacts = [
        ImpactRow(
            place.name,
            place.point.mount,
            place.point.piece,
            place.node,
            place.direction,
            writing.triple(place.position, 4),
        )
        for place in impact_places(bench)
    ]
    write_table(folder / IMPACT_TABLE, ImpactRow, impacts)
    first, last = FREQUENCY[[0, -1]]
    writing.write_readme(
        folder,
        f"Virtual vehicle {session.vehicle} with mount set {parts}, seed {session.seed}",
        f"{FREQUENCY.size} lines from {first:g} to {last:g} Hz; runs along the engine order "
        f"{bench.order_torque.order:g}, phase to the tacho. {writing.VEHICLE_AXES} Hammer and "
        "loudspeaker found the trimmed body without its powertrain, on different days; the runs "
        "are those of the complete car on its flexible body, mounts warmer than on the bench, with "
        "other paths.",
        "vehicle",
        VEHICLE_FILE,
    )


def _vehicle_file(
    session: _Session, parts: str, load_cases: tuple[PlannedRun, ...], accelerance: bool
) -> VehicleFile:
    """Return the content of ``vehicle.toml``."""
    bench = session.bench
    wheel_end_mass = draw_wheel_end_mass(bench, session.generator(_SHEET))
    return VehicleFile(
        format=1,
        name=session.vehicle,
        group=session.vehicle.rpartition("-")[0],
        title=f"Virtual vehicle {session.vehicle}, mount set {parts}",
        mount_table=MOUNT_TABLE,
        sensor_table=SENSOR_TABLE,
        channel_table=CHANNEL_TABLE,
        impact_table=IMPACT_TABLE,
        source_sensors=tuple(place.name for place in accelerometer_places(bench)),
        direct=DIRECT,
        reciprocal=RECIPROCAL,
        accelerance=ACCELERANCE if accelerance else None,
        panels=PanelEntry(table=PANEL_TABLE, motion=PANEL_MOTION, pressure=PANEL_PRESSURE),
        engine=engine_section(bench),
        ears=tuple(
            EarEntry(name=ear, node=EAR_NODES[ear], microphone=MICROPHONES[ear]) for ear in EARS
        ),
        mounts=mount_sections(bench, wheel_end_mass),
        runs=tuple(
            VehicleRunEntry(
                name=case.name,
                gear=case.gear,
                torque_limit_nm=case.torque,
                file=f"operating/{case.name}.uff",
                torque_table=_torque_table(case),
            )
            for case in load_cases
        ),
        tolerances=_tolerances(session.errors.acquisition),
    )


def _tolerances(errors: AcquisitionErrors) -> ToleranceSection:
    """State how well sensors and hammer are placed and calibrated; nothing where they are exact."""
    stated = {
        "sensor_gain": errors.accelerometer_gain,
        "sensor_position_m": errors.sensor_position,
        "sensor_angle_deg": round(np.rad2deg(errors.sensor_angle), 3),
        "hammer_gain": errors.hammer_gain,
        "impact_position_m": errors.impact_position,
        "impact_angle_deg": round(np.rad2deg(errors.impact_angle), 3),
    }
    return ToleranceSection(**{key: value for key, value in stated.items() if value > 0})
