"""Writes the measurement of a virtual electric car, and the truth beside it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray, RealOrComplexArray
from deboom.bench.compressor_operation import PRESSURES, Operation, OperationPlan, operation, speeds
from deboom.bench.compressor_rig import NO_PLACEMENT_ERRORS, HitPlan, draw, placement_errors
from deboom.bench.compressor_truth import CalibrationLevel, CompressorCase, CompressorPlan
from deboom.bench.compressor_writer import (
    HAMMER,
    HAMMER_WITH_HOSES,
    SENSORS,
    SWEEPS,
    TACHO_NODE,
    drawn_hose_sections,
    placed_sensors,
    stated_deviations,
    write_compressor_test,
)
from deboom.bench.electric_car import MOUNTS, POINTS, ElectricCarBody, draw_fleet, frozen_fleet
from deboom.bench.electric_recording import (
    CABIN_NOISE,
    EAR,
    EAR_NODE,
    FIRST_HOLDER_NODE,
    MICROPHONE,
    SHEET_DIGITS,
    BodyFrfs,
    CarSweep,
    PointSheet,
    Setup,
    body_plan,
    draw_car_sensors,
    draw_setup,
    point_sheets,
    strike_body,
    sweep_car,
    tracked,
)
from deboom.bench.powertrain import AXES
from deboom.errors import InputError
from deboom.files.disk import complete_or_not_at_all, replace_text
from deboom.files.electric_car import (
    ELECTRIC_CAR_FILE,
    ElectricCarFile,
    PointSection,
    dump_electric_car_file,
)
from deboom.files.inertance_test import ToleranceSection, write_placed_sensors, write_positions
from deboom.files.operating_test import (
    OPERATING_TEST_FILE,
    HolderSection,
    MicrophoneSection,
    OperatingTestFile,
    SweepNodes,
    SweepSection,
    dump_operating_test_file,
    write_sweep,
)
from deboom.files.uff import UffFunction, write_uff
from deboom.files.vehicle import EarEntry

FRF, COHERENCE = 4, 6
"""UFF function types."""


def pressure_functions(points: Sequence[PointSheet], frfs: BodyFrfs, car: str) -> list[UffFunction]:
    """Return pressure at the ear per force of every impact, type 4, and its coherence, type 6.

    Parameters
    ----------
    points : sequence of PointSheet
        In the order of the impacts.
    frfs : BodyFrfs
        What the hammer found.
    car : str
        Its name.
    """
    impacts = [row for point in points for row in point.impacts()]
    functions = []
    for column, impact in enumerate(impacts):
        title = f"noise transfer function, {car}, {EAR}, hammer at {impact.impact}"
        reference = (impact.node, impact.uff_direction, impact.impact)
        ear = (EAR_NODE, "scalar", MICROPHONE)
        functions.append(
            _function(frfs, frfs.pressure[:, column], ear, reference, ("pressure", "Pa"), title)
        )
        title = f"coherence of the {title}"
        functions.append(_function(frfs, frfs.coherence[:, column], ear, reference, None, title))
    return functions


def accelerance_functions(
    points: Sequence[PointSheet], frfs: BodyFrfs, car: str
) -> list[UffFunction]:
    """Return acceleration at every sensor on the body per force of every impact, type 4.

    Parameters
    ----------
    points, frfs, car
        As for `pressure_functions`.
    """
    channels = [(row, axis) for point in points for row in point.sensors() for axis in AXES]
    impacts = [row for point in points for row in point.impacts()]
    return [
        _function(
            frfs,
            frfs.acceleration[:, row, column],
            (sensor.node, f"+{axis}", sensor.sensor),
            (impact.node, impact.uff_direction, impact.impact),
            ("acceleration", "m/s^2"),
            f"accelerance, {car}, hammer at {impact.impact}, {sensor.sensor} {axis}",
        )
        for column, impact in enumerate(impacts)
        for row, (sensor, axis) in enumerate(channels)
    ]


def _function(
    frfs: BodyFrfs,
    values: RealOrComplexArray,
    response: tuple[int, str, str],
    reference: tuple[int, str, str],
    quantity: tuple[str, str] | None,
    title: str,
) -> UffFunction:
    # a coherence has no unit, but the quantities of its two channels
    ordinate, unit = quantity or ("general", "1")
    return UffFunction(
        abscissa=frfs.frequency,
        values=values,
        function_type=FRF if quantity else COHERENCE,
        response_node=response[0],
        response_direction=response[1],
        reference_node=reference[0],
        reference_direction=reference[1],
        ordinate=ordinate,
        ordinate_unit=unit,
        denominator="force" if quantity else "none",
        denominator_unit="N" if quantity else "",
        id_lines=(title, "roving hammer, H1"),
        response_name=response[2],
        reference_name=reference[2],
    )


def readme_text(
    title: str,
    points: Sequence[PointSheet],
    names: Sequence[str],
    hits: HitPlan,
    *,
    with_hoses: bool,
) -> str:
    """Return ``README.txt``: every file, how it was measured, and the map of the nodes.

    Parameters
    ----------
    title : str
    points : sequence of PointSheet
        On the body.
    names : sequence of str
        Of the points in the files.
    hits : HitPlan
        On the body.
    with_hoses : bool
        Whether the compressor was struck with its hoses as well.
    """
    lines = hits.lines
    text = [
        title,
        "=" * len(title),
        "",
        "A refrigerant compressor in an electric car: struck on a rigid rig without hoses, run in",
        "the car with its own and with long soft hoses; and the body of the car, struck with the",
        "compressor taken out. With the errors of real sensors and hammers. Nobody measured this.",
        "",
        "SI units, complex peak amplitudes, time factor e^{+jwt}; positions count from the virtual",
        "point of the compressor, along its axes. UFF: binary, data set 58.",
        f"Body: {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, H1 of {hits.hits} hits",
        f"of about {hits.impulse:g} N s. Sweeps: first order, phase to the pulse of the tacho.",
        "",
        "car.toml                names the files of the body; points, tolerances",
        "operation.toml          names those of the compressor",
        "hammer/                 the compressor under the hammer, see its README.txt",
        *(["hammer_with_hoses/      the same with its hoses"] if with_hoses else []),
        "sensors.csv             accelerometers on the compressor while it ran",
        "sweeps/                 first order over speed: compressor, body side of every mount, ear",
        "ntf/positions.xlsx      sensors and impacts on the body",
        "ntf/pressure.uff        pressure at the ear per force (type 4), coherence (type 6)",
        "ntf/accelerance.uff     acceleration on the body per force (type 4)",
        "truth/                  the exact values behind, for verification only",
        "",
        f"    node {EAR_NODE:<4} {EAR}, {MICROPHONE}",
    ]
    for number, (point, name) in enumerate(zip(points, names, strict=True)):
        text.append(f"{name}:")
        if point.name.startswith("mount"):
            text.append(f"    node {FIRST_HOLDER_NODE + number:<4} accelerometer of the sweeps")
        text += [f"    node {row.node:<4} {row.sensor}" for row in point.sensors()]
        text += [
            f"    node {row.node:<4} {row.impact} ({row.uff_direction})" for row in point.impacts()
        ]
    return "\n".join(text) + "\n"


def write_car_truth(
    folder: Path,
    car: ElectricCarBody,
    setup: Setup,
    microphone: float,
    sweeps: Sequence[CarSweep],
) -> None:
    """Write ``car.json``, ``body.npz`` and one ``.npz`` per sweep.

    Parameters
    ----------
    folder : Path
        Made.
    car : ElectricCarBody
    setup : Setup
        Of the hammer on the body.
    microphone : float
        Stated over true pressure [1].
    sweeps : sequence of CarSweep
        In the order of ``operation.toml``.

    Notes
    -----
    ``body.npz``: ``frequency`` (f,); ``noise_transfer`` (f, 30) per load at the true points and
    ``point_receptance`` (f, 5, 6, 6). ``0.npz`` … of the sweeps:
    ``frequency``, ``load`` and ``displacement`` (f, 6) of the compressor, ``body_motion`` and
    ``body_load`` (f, 30), ``pressure`` (f,) at the ear.
    """
    folder.mkdir()
    lines = body_plan().lines
    blocks = car.receptance(lines).reshape(lines.size, len(POINTS), 6, len(POINTS), 6)
    np.savez(
        folder / "body.npz",
        frequency=lines,
        noise_transfer=car.noise_transfer(lines),
        point_receptance=np.einsum("fpapb->fpab", blocks),
    )
    for number, sweep in enumerate(sweeps):
        np.savez(
            folder / f"{number}.npz",
            frequency=sweep.run.frequency,
            load=sweep.run.load,
            displacement=sweep.run.displacement,
            body_motion=sweep.run.body_motion,
            body_load=sweep.run.body_load,
            pressure=sweep.run.pressure,
        )
    content = {
        "car": car.name,
        "sweeps": [sweep.name for sweep in sweeps],
        "points": POINTS,
        "positions_m": [point.position.tolist() for point in setup.points],
        "microphone": microphone,
        "hammer_gain": setup.hammer_gain,
    }
    replace_text(folder / "car.json", json.dumps(content, indent=1) + "\n")


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
