"""Writes one electric car as a laboratory measures it, and the truth beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.compressor_functions import placed_sensors
from deboom.bench.compressor_laboratory import draw
from deboom.bench.compressor_operation import Operation, operation, speeds
from deboom.bench.compressor_operation_plan import PRESSURES, OperationPlan
from deboom.bench.compressor_operation_writer import (
    HAMMER,
    HAMMER_WITH_HOSES,
    SENSORS,
    SWEEPS,
    TACHO_NODE,
    drawn_hose_sections,
    stated_deviations,
)
from deboom.bench.compressor_plan import CalibrationLevel, CompressorCase, CompressorPlan
from deboom.bench.compressor_rig import NO_PLACEMENT_ERRORS, placement_errors
from deboom.bench.compressor_writer import write_compressor_test
from deboom.bench.electric_body import MOUNTS, POINTS, ElectricCarBody
from deboom.bench.electric_fleet import draw_fleet, frozen_fleet
from deboom.bench.electric_functions import accelerance_functions, pressure_functions
from deboom.bench.electric_hammer import CABIN_NOISE, body_plan, strike_body
from deboom.bench.electric_places import (
    EAR,
    EAR_NODE,
    FIRST_HOLDER_NODE,
    MICROPHONE,
    SHEET_DIGITS,
    Setup,
    draw_setup,
    point_sheets,
)
from deboom.bench.electric_readme import readme_text
from deboom.bench.electric_sweeps import CarSweep, draw_car_sensors, sweep_car, tracked
from deboom.bench.electric_truth import write_car_truth
from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.electric_car_file import (
    ELECTRIC_CAR_FILE,
    ElectricCarFile,
    PointSection,
    dump_electric_car_file,
)
from deboom.files.inertance_test_file import ToleranceSection
from deboom.files.inertance_test_tables import write_placed_sensors, write_positions
from deboom.files.operating_sweeps import SweepNodes, write_sweep
from deboom.files.operating_test_file import (
    OPERATING_TEST_FILE,
    HolderSection,
    MicrophoneSection,
    OperatingTestFile,
    SweepSection,
    dump_operating_test_file,
)
from deboom.files.uff import write_uff
from deboom.files.vehicle_file import EarEntry
from deboom.files.whole_folder import complete_or_not_at_all

POSITIONS, PRESSURE, ACCELERANCE = "ntf/positions.xlsx", "ntf/pressure.uff", "ntf/accelerance.uff"

CAR_PLAN = OperationPlan(compressor=CompressorPlan(CompressorCase.TABLE11))
"""The compressor that the body's points belong to, with scattered hoses."""

_BODY, _STRIKING, _CABIN, _RUNNING = range(100, 104)
"""Purposes with random numbers of their own, beside those of the compressor's laboratory."""


def write_electric_car(
    folder: Path,
    seed: int = 1,
    car: str = "EV-1",
    fleet: int | None = None,
    level: CalibrationLevel = CalibrationLevel.C2,
    plan: OperationPlan = CAR_PLAN,
    *,
    noise_free: bool = False,
) -> Path:
    """Measure one electric car and its compressor, and write their files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        From 1: hoses, errors and noise; the compressor and its hammer test are those of
        `write_compressor_test`.
    car : str
        Of the fleet.
    fleet : int, optional
        Seed of a drawn fleet; the frozen one if left out.
    level : CalibrationLevel
        How large the errors of placement and calibration are, on compressor and body.
    plan : OperationPlan
        By default the thesis's compressor, scattered hoses, mounts as under the hammer.
    noise_free : bool
        Everything is where it should be, and silent. The folder states the same tolerances.

    Returns
    -------
    Path
        The folder, with ``car.toml`` and ``operation.toml`` at its top and the exact truth in
        ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; no such car; a plan with softening mounts, a receiver or a record over time; a
        folder that is not empty or cannot be written.
    """
    if plan.softening or plan.time_record or plan.compressor.softening:
        raise InputError(
            "a car is written with mounts that do not soften and with order spectra only: leave "
            "softening and time record out"
        )
    bodies = frozen_fleet() if fleet is None else draw_fleet(fleet)
    body = bodies.car(car)
    there = operation(seed, level, plan, noise_free=noise_free)
    stated = placement_errors(level)
    errors = NO_PLACEMENT_ERRORS if noise_free else stated
    compressor = there.laboratory.compressor
    names = (*MOUNTS, *(hose.name for hose in compressor.hoses))
    places = [*compressor.positions, *(hose.end for hose in compressor.hoses)]
    sheets = point_sheets(dict(zip(POINTS, places, strict=True)))
    sensors = draw_car_sensors(errors, draw(seed, _CABIN))
    sweeps = tuple(
        sweep_car(body, there, sensors, speeds(), pressure, soft=soft)
        for soft in (False, True)
        for pressure in PRESSURES
    )
    session = _Session(
        seed=seed,
        title=f"virtual electric car {car}, level {level.value}, seed {seed}",
        body=body,
        there=there,
        setup=draw_setup(sheets, errors, draw(seed, _BODY)),
        microphone=sensors.microphone,
        sweeps=sweeps,
        names=names,
        # a virtual point is where somebody believes the centre of a mount to be
        stated=np.round(
            places + errors.position * draw(seed, _BODY, 1).standard_normal((len(places), 3)),
            10 if noise_free else SHEET_DIGITS,
        ),
        noise_free=noise_free,
    )
    degrees = float(np.round(np.rad2deg(stated.angle), 10))
    tolerances = ToleranceSection(
        sensor_gain=stated.gain,
        sensor_position_m=stated.position,
        sensor_angle_deg=degrees,
        hammer_gain=stated.hammer,
        impact_position_m=stated.position,
        impact_angle_deg=degrees,
    )
    with complete_or_not_at_all(Path(folder)) as unfinished:
        _write_operation(unfinished, session, level, plan)
        _write_body(unfinished, session, tolerances)
        write_car_truth(unfinished / "truth", body, session.setup, sensors.microphone, sweeps)
    return Path(folder)


@dataclass(frozen=True, eq=False)
class _Session:
    seed: int
    title: str
    body: ElectricCarBody
    there: Operation
    setup: Setup
    microphone: float
    sweeps: tuple[CarSweep, ...]
    names: tuple[str, ...]
    stated: RealArray
    noise_free: bool


def _write_operation(
    folder: Path, session: _Session, level: CalibrationLevel, plan: OperationPlan
) -> None:
    there, struck = session.there, {HAMMER: plan.compressor}
    if plan.hammer_with_hoses:
        struck[HAMMER_WITH_HOSES] = plan.struck_with_hoses
    for name, compressor in struck.items():
        write_compressor_test(
            folder / name, session.seed, level, compressor, noise_free=session.noise_free
        )
    holders = tuple((mount, FIRST_HOLDER_NODE + number) for number, mount in enumerate(MOUNTS))
    nodes = SweepNodes(
        placed_sensors(there.laboratory.sheet), TACHO_NODE, holders, ((EAR, EAR_NODE),)
    )
    write_placed_sensors(folder / SENSORS, nodes.sensors)
    (folder / SWEEPS).mkdir()
    sections = []
    for number, sweep in enumerate(session.sweeps):
        acceleration, holder, sound = sweep.acceleration, sweep.holder, sweep.sound
        if not session.noise_free:
            acceleration, holder, sound = tracked(sweep, draw(session.seed, _RUNNING, number))
        spectra = f"{SWEEPS}/{sweep.name.replace(' ', '_')}.uff"
        write_sweep(
            folder / spectra,
            nodes,
            sweep.run.frequency,
            acceleration,
            holder=holder,
            sound=sound,
            notes=(session.title, sweep.name),
        )
        sections.append(
            SweepSection(
                name=sweep.name, hoses=sweep.state, pressure_bar=sweep.pressure, spectra=spectra
            )
        )
    file = OperatingTestFile(
        format=1,
        title=session.title,
        hammer=HAMMER,
        hammer_with_hoses=HAMMER_WITH_HOSES if plan.hammer_with_hoses else None,
        sensor_table=SENSORS,
        tacho_node=TACHO_NODE,
        rotor_inertia_kg_m2=there.source.rotor_inertia,
        deviations=stated_deviations(),
        sweeps=tuple(sections),
        hoses=drawn_hose_sections(),
        holders=tuple(HolderSection(name=name, node=node) for name, node in holders),
        microphones=(MicrophoneSection(name=EAR, node=EAR_NODE),),
    )
    dump_operating_test_file(folder / OPERATING_TEST_FILE, file)


def _write_body(folder: Path, session: _Session, tolerances: ToleranceSection) -> None:
    points, hits = session.setup.points, body_plan(noise_free=session.noise_free)
    frfs = strike_body(
        session.body,
        session.setup,
        hits,
        0.0 if session.noise_free else CABIN_NOISE,
        session.microphone,
        draw(session.seed, _STRIKING),
    )
    (folder / PRESSURE).parent.mkdir()
    sensors = [row for point in points for row in point.sensors()]
    impacts = [row for point in points for row in point.impacts()]
    write_positions(folder / POSITIONS, sensors, impacts)
    name = session.body.name
    write_uff(folder / PRESSURE, pressure_functions(points, frfs, name), binary=True)
    write_uff(folder / ACCELERANCE, accelerance_functions(points, frfs, name), binary=True)
    with_hoses = (folder / HAMMER_WITH_HOSES).is_dir()
    words = readme_text(session.title, points, session.names, hits, with_hoses=with_hoses)
    replace_text(folder / "README.txt", words)
    sections = []
    for point, called, position in zip(points, session.names, session.stated, strict=True):
        x, y, z = position.tolist()
        sections.append(
            PointSection(
                name=called,
                kind="mount" if point.name in MOUNTS else "hose",
                position_m=(x, y, z),
                sensors=tuple(row.sensor for row in point.sensors()),
                impacts=tuple(row.impact for row in point.impacts()),
            )
        )
    dump_electric_car_file(
        folder / ELECTRIC_CAR_FILE,
        ElectricCarFile(
            format=1,
            name=name,
            title=session.title,
            sensor_table=POSITIONS,
            impact_table=POSITIONS,
            pressure=PRESSURE,
            accelerance=ACCELERANCE,
            hits_per_impact=hits.hits,
            ear=EarEntry(name=EAR, node=EAR_NODE, microphone=MICROPHONE),
            tolerances=tolerances,
            points=tuple(sections),
        ),
    )
