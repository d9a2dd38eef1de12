"""Writes hammer tests and operating tests on a virtual compressor, and the truth beside them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import ComplexArray, RealArray, RealOrComplexArray
from deboom.bench.compressor_operation import (
    PRESSURES,
    RATE,
    SCATTER,
    Operation,
    OperationPlan,
    TrueSweep,
    floor,
    grid,
    measured,
    operation,
    run_up,
    speeds,
    true_sweep,
)
from deboom.bench.compressor_rig import (
    Blows,
    HitPlan,
    Laboratory,
    Purpose,
    Sheet,
    averaged,
    draw,
    exact_inertance,
    hit_plan,
    laboratory,
    placement_errors,
    strike,
    without_noise,
)
from deboom.bench.compressor_truth import (
    COMPRESSOR_DATA,
    CalibrationLevel,
    CompressorPlan,
    drawn_hoses,
    end_loads,
    held_stiffness,
    inertia_tensor,
)
from deboom.bench.powertrain import AXES, read_data
from deboom.files.disk import complete_or_not_at_all, replace_text
from deboom.files.hammer_test import HammerChannel, HammerPoint, HammerSheet, write_hammer_test
from deboom.files.inertance_test import (
    INERTANCE_TEST_FILE,
    DrawingSection,
    DrawnMountSection,
    InertanceTestFile,
    PlacedImpact,
    PlacedSensor,
    ToleranceSection,
    dump_inertance_test_file,
    write_placed_sensors,
    write_positions,
)
from deboom.files.operating_test import (
    OPERATING_TEST_FILE,
    DeviationSection,
    HoseSection,
    OperatingTestFile,
    SweepNodes,
    SweepSection,
    dump_operating_test_file,
    write_sweep,
    write_sweep_record,
)
from deboom.files.tables import parse_unit
from deboom.files.uff import UffFunction, write_uff

FIRST_SENSOR_NODE, FIRST_IMPACT_NODE = 101, 201
FRF, COHERENCE = 4, 6
"""UFF function types."""


def placed_sensors(sheet: Sheet) -> tuple[PlacedSensor, ...]:
    """Return the rows of the accelerometers."""
    return tuple(
        PlacedSensor(name, FIRST_SENSOR_NODE + number, _three(position), _three(angles))
        for number, (name, position, angles) in enumerate(
            zip(sheet.sensors, sheet.sensor_positions, sheet.sensor_angles, strict=True)
        )
    )


def placed_impacts(sheet: Sheet) -> tuple[PlacedImpact, ...]:
    """Return the rows of the impacts."""
    return tuple(
        PlacedImpact(name, FIRST_IMPACT_NODE + number, _three(position), _three(direction))
        for number, (name, position, direction) in enumerate(
            zip(sheet.impacts, sheet.impact_positions, sheet.impact_directions, strict=True)
        )
    )


def frf_functions(sheet: Sheet, frequency: RealArray, inertance: ComplexArray) -> list[UffFunction]:
    """Return the FRFs from all impacts to all channels, UFF type 4.

    Parameters
    ----------
    sheet : Sheet
        What the nodes are.
    frequency : array, shape (f,)
        [Hz].
    inertance : array, shape (f, n_channel, n_impact)
        [m/s² per N].
    """
    return _functions(sheet, frequency, inertance, FRF)


def coherence_functions(
    sheet: Sheet, frequency: RealArray, coherence: RealArray
) -> list[UffFunction]:
    """Return the ordinary coherences of all channels and impacts, UFF type 6.

    Parameters
    ----------
    sheet : Sheet
        What the nodes are.
    frequency : array, shape (f,)
        [Hz].
    coherence : array, shape (f, n_channel, n_impact)
        [1].
    """
    return _functions(sheet, frequency, coherence, COHERENCE)


def write_hits(folder: Path, sheet: Sheet, blows: Blows, plan: HitPlan, title: str) -> None:
    """Write all hits over time as a hammer test.

    Parameters
    ----------
    folder : Path
        Of the hammer test; made if it is not there.
    sheet : Sheet
        Of sensors and impacts.
    blows, plan
        What was recorded, and how.
    title : str
        Of the test.
    """
    write_hammer_test(
        folder,
        HammerSheet(
            title=title,
            rate=plan.rate,
            pretrigger=plan.pretrigger,
            points=tuple(
                HammerPoint(row.impact, row.node, f"{row.impact}.uff", row.position, row.direction)
                for row in placed_impacts(sheet)
            ),
            channels=tuple(
                HammerChannel(
                    f"{row.sensor} {axis}",
                    "acceleration",
                    row.node,
                    f"+{axis}",
                    parse_unit("m/s^2"),
                )
                for row in placed_sensors(sheet)
                for axis in AXES
            ),
        ),
        {
            name: (force, response)
            for name, force, response in zip(
                sheet.impacts, blows.force, blows.response, strict=True
            )
        },
    )


def _functions(
    sheet: Sheet, frequency: RealArray, values: RealOrComplexArray, kind: int
) -> list[UffFunction]:
    channels = [(row, axis) for row in placed_sensors(sheet) for axis in AXES]
    # a coherence has no unit, but the quantities of its two channels
    ordinate, above, below = (
        ("acceleration", "m/s^2", "N") if kind == FRF else ("general", "1", "1")
    )
    return [
        UffFunction(
            abscissa=frequency,
            values=values[:, row, column],
            function_type=kind,
            response_node=sensor.node,
            response_direction=f"+{axis}",
            reference_node=impact.node,
            reference_direction=impact.uff_direction,
            ordinate=ordinate,
            ordinate_unit=above,
            denominator="force" if kind == FRF else "none",
            denominator_unit=below if kind == FRF else "",
            id_lines=(f"{sensor.sensor} {axis} per {impact.impact}", "roving hammer, H1"),
            response_name=sensor.sensor,
            reference_name=impact.impact,
        )
        for column, impact in enumerate(placed_impacts(sheet))
        for row, (sensor, axis) in enumerate(channels)
    ]


def _three(values: RealArray) -> tuple[float, float, float]:
    x, y, z = np.asarray(values).tolist()
    return x, y, z


def readme_text(title: str, plan: CompressorPlan, hits: HitPlan, sheet: Sheet) -> str:
    """Return ``README.txt``: every file, how it was measured, and the map of the nodes."""
    lines = hits.lines
    step = lines[1] - lines[0]
    text = [
        title,
        "=" * len(title),
        "",
        "A refrigerant compressor on its rubber mounts, struck with a roving hammer; with the",
        "errors of real sensors, of a real hammer and of a tape measure. Nobody measured this.",
        "",
        f"{lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, {step:g} Hz apart; SI units; "
        "time factor e^{+jwt}.",
        f"H1 of {hits.hits} hits per impact, half sine of {1e3 * hits.pulse:g} ms and about "
        f"{hits.impulse:g} N s; blocks of {hits.duration:g} s.",
        "Positions count from the virtual point. Directions of responses are those of the sensor's",
        "own axes, directions of forces those of the position sheet. UFF: binary, data set 58.",
        "",
        "compressor_test.toml   names every other file; tolerances, weighed mass, drawing",
        "positions.xlsx         sheets sensors and impacts",
        "frf.uff                acceleration per force of each impact (type 4)",
        "coherence.uff          ordinary coherence of the hits (type 6)",
    ]
    if plan.hits:
        text.append("hits/                  every hit over time, one file per impact")
    text += [
        "truth/                 the exact values behind, for verification only",
        "",
        "Sensors:",
        *(f"    node {row.node:<4} {row.sensor}" for row in placed_sensors(sheet)),
        "Impacts:",
        *(
            f"    node {row.node:<4} {row.impact} ({row.uff_direction})"
            for row in placed_impacts(sheet)
        ),
    ]
    return "\n".join(text) + "\n"


def operation_readme(title: str, file: OperatingTestFile) -> str:
    """Return ``README.txt`` of the test on a running compressor: every file."""
    with_hoses = file.hammer_with_hoses
    text = [
        title,
        "=" * len(title),
        "",
        "A refrigerant compressor on its rubber mounts, struck with a hammer at rest,",
        "then run from 1000 to 9000 1/min at two pressures, with the standard hoses and with long",
        "soft ones that have masses on them. Nobody measured this.",
        "",
        "SI units; time factor e^{+jwt}; complex peak amplitudes; phase from the tacho's pulse,",
        "once per revolution, when the rotor's mark is on the y axis. UFF: binary, data set 58;",
        "order spectra are type 0 over the frequency of rotation, with the tacho's speed; channels",
        "over time are type 1, with its pulses.",
        "",
        "operation.toml         names every other file; hoses as drawn, deviations",
        f"{file.sensor_table:22} where the accelerometers stood in the sweeps",
        f"{file.hammer + '/':22} hammer test without hoses: see its README.txt",
        *([f"{with_hoses + '/':22} the same with the standard hoses"] if with_hoses else []),
        "sweeps/                one file per sweep",
        "truth/                 the exact values behind, for verification only",
    ]
    return "\n".join(text) + "\n"


POSITIONS, FRF_FILE, COHERENCE_FILE, HITS = "positions.xlsx", "frf.uff", "coherence.uff", "hits"

SCALES = 1e-3
"""Standard deviation of the weighed mass: a kitchen scale [1]."""


@dataclass(frozen=True)
class _Measured:
    """One test, before it is written."""

    laboratory: Laboratory
    plan: HitPlan
    blows: Blows


def write_compressor_test(
    folder: Path,
    seed: int = 1,
    level: CalibrationLevel = CalibrationLevel.C2,
    plan: CompressorPlan | None = None,
    *,
    noise_free: bool = False,
) -> Path:
    """Strike a virtual compressor and write what the laboratory delivers.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        From 1. It draws a random compressor, the errors of placement and calibration, and noise,
        each with numbers of its own.
    level : CalibrationLevel
        How large the errors of placement and calibration are; the tolerances that the folder
        states.
    plan : CompressorPlan, optional
        Which compressor; by default a random one on rigid ground.
    noise_free : bool
        Everything is where it should be, and silent. The folder states the same tolerances.

    Returns
    -------
    Path
        The folder, with ``compressor_test.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; a folder that is not empty or cannot be written.
    """
    plan = plan or CompressorPlan()
    there = laboratory(seed, level, plan, noise_free=noise_free)
    hits = without_noise(hit_plan()) if noise_free else hit_plan()
    # who strikes a second time, now with hoses, makes other errors
    striking = Purpose.STRIKING if plan.hoses is None else Purpose.STRIKING_WITH_HOSES
    with complete_or_not_at_all(Path(folder)) as unfinished:
        blows = strike(there.compressor, there.sheet, there.placed, hits, draw(seed, striking))
        measured = _Measured(there, hits, blows)
        weighed = there.compressor.mass
        if not noise_free:
            off = SCALES * float(draw(seed, Purpose.WEIGHING).standard_normal())
            weighed = round(weighed * (1 + off), 3)
        title = f"virtual compressor, {plan.case.value}, level {level.value}, seed {seed}"
        if plan.hoses is not None:
            title += ", with hoses"
        _write_files(unfinished, measured, plan, level, weighed, title)
        _write_truth(unfinished / "truth", measured, plan, level)
    return Path(folder)


def _write_files(
    folder: Path,
    measured: _Measured,
    plan: CompressorPlan,
    level: CalibrationLevel,
    weighed: float,
    title: str,
) -> None:
    sheet, hits = measured.laboratory.sheet, measured.plan
    inertance, coherence = averaged(measured.blows, hits)
    write_uff(folder / FRF_FILE, frf_functions(sheet, hits.lines, inertance), binary=True)
    write_uff(
        folder / COHERENCE_FILE, coherence_functions(sheet, hits.lines, coherence), binary=True
    )
    write_positions(folder / POSITIONS, placed_sensors(sheet), placed_impacts(sheet))
    if plan.hits:
        write_hits(folder / HITS, sheet, measured.blows, hits, title)
    replace_text(folder / "README.txt", readme_text(title, plan, hits, sheet))
    drawing, mounts = _drawing()
    errors = placement_errors(level)
    degrees = float(np.round(np.rad2deg(errors.angle), 10))
    file = InertanceTestFile(
        format=1,
        title=title,
        sensor_table=POSITIONS,
        impact_table=POSITIONS,
        frf=FRF_FILE,
        coherence=COHERENCE_FILE,
        hits_per_impact=hits.hits,
        hits=HITS if plan.hits else None,
        band_hz=hits.band if plan.hits else None,
        weighed_mass_kg=weighed,
        weighed_mass_deviation_kg=round(SCALES * weighed, 4),
        tolerances=ToleranceSection(
            sensor_gain=errors.gain,
            sensor_position_m=errors.position,
            sensor_angle_deg=degrees,
            hammer_gain=errors.hammer,
            impact_position_m=errors.position,
            impact_angle_deg=degrees,
        ),
        drawing=drawing,
        mounts=mounts,
    )
    dump_inertance_test_file(folder / INERTANCE_TEST_FILE, file)


def _drawing() -> tuple[DrawingSection, tuple[DrawnMountSection, ...]]:
    """Table 10 of the thesis; it has the centre of gravity at the virtual point."""
    start = read_data(COMPRESSOR_DATA)["start_table10"]
    inertia = inertia_tensor(np.array(start["inertia_kg_m2_xx_yy_zz_xy_xz_yz"]))
    drawing = DrawingSection.model_validate(
        {
            "mass_kg": start["mass_kg"],
            "centre_of_gravity_m": (0.0, 0.0, 0.0),
            "inertia_kg_m2": inertia.tolist(),
        }
    )
    rows = zip(
        start["mount_position_m"],
        start["mount_rotation_deg"],
        start["mount_static_stiffness_N_per_m_axial_radial1_radial2"],
        strict=True,
    )
    mounts = tuple(
        DrawnMountSection(
            name=f"mount {number}",
            position_m=_three_3(position),
            rotation_deg=_three_3(rotation),
            stiffness_n_per_m=_three_3(stiffness),
        )
        for number, (position, rotation, stiffness) in enumerate(rows, 1)
    )
    return drawing, mounts


def _three_3(values: list[float]) -> tuple[float, float, float]:
    x, y, z = map(float, values)
    return x, y, z


def _write_truth(
    folder: Path, measured: _Measured, plan: CompressorPlan, level: CalibrationLevel
) -> None:
    folder.mkdir()
    there = measured.laboratory
    compressor, sheet, placed = there.compressor, there.sheet, there.placed
    lines, blows = measured.plan.lines, measured.blows
    factors = blows.factors.mean(axis=1)
    # of the rigid body at the amplitude of a usual hit: what a model with six motions can find
    inertance = replace(compressor, joint=None).inertance(lines)
    np.savez(
        folder / "truth.npz",
        frequency=lines,
        inertance=inertance,
        apparent_mass=np.linalg.inv(inertance),
        response_matrix=placed.response_rows(sheet),
        excitation_matrix=placed.excitation_rows(sheet) / (1 + placed.hammer_gain),
        frf=exact_inertance(compressor, sheet, placed, lines, factors),
        softening_factor=blows.factors,
        mount_amplitude=blows.amplitudes,
    )
    content: dict[str, Any] = {
        "case": plan.case.value,
        "level": level.value,
        "identical_mounts": plan.identical_mounts,
        "softening": plan.softening,
        "flexible_receiver": plan.flexible_receiver,
        "flexible_body_hz": plan.flexible_body,
        "mass_kg": compressor.mass,
        "centre_of_gravity_m": compressor.centre,
        "inertia_kg_m2": compressor.inertia,
        "mounts": [
            {
                "name": f"mount {number}",
                "position_m": position,
                "rotation_rad": rotation,
                "stiffness_n_per_m": stiffness,
            }
            for number, (position, rotation, stiffness) in enumerate(
                zip(compressor.positions, compressor.rotations, compressor.stiffness, strict=True),
                1,
            )
        ],
        "hoses": None if plan.hoses is None else plan.hoses.value,
        "gain": compressor.gain,
        "static_stiffness": compressor.static_stiffness,
        "sensor_gain": placed.sensor_gain,
        "sensor_offset_m": placed.sensor_offset,
        "sensor_angle_rad": placed.sensor_turn,
        "hammer_gain": placed.hammer_gain,
        "impact_offset_m": placed.impact_offset,
        "impact_direction": placed.impact_directions,
    }
    replace_text(folder / "truth.json", json.dumps(content, indent=1, default=_plain) + "\n")


def _plain(array: RealArray) -> Any:
    return array.tolist()


REACTION, END_LOAD = "hose_reaction", "end_load"


def write_operation_truth(
    folder: Path, there: Operation, plan: OperationPlan, sweeps: Sequence[TrueSweep]
) -> None:
    """Write ``operation.json``, ``operation.npz`` and one ``.npz`` per sweep.

    Parameters
    ----------
    folder : Path
        Made.
    there : Operation
        What ran.
    plan : OperationPlan
        What was asked for.
    sweeps : sequence of TrueSweep
        In the order of ``operation.toml``; a record over time has none.

    Notes
    -----
    ``<number>.npz`` of each sweep, from 0: ``frequency`` (f,) [Hz]; ``load`` of the source and
    ``displacement`` at the virtual point (f, 6); ``apparent_mass`` (f, 6, 6) with mounts as they
    were, hoses and the turning rotor; ``acceleration`` (f, n_channel) without noise; ``factors`` of
    softening and ``amplitudes`` at the mounts (f, n_mount); with hoses ``hose_reaction``, their
    load on the compressor at the virtual point (f, 6), and ``end_load``, their load on what holds
    the other ends (f, 6 n_hose). ``operation.npz``: ``response_matrix`` (n_channel, 6).
    """
    folder.mkdir()
    laboratory, source = there.laboratory, there.source
    rows = laboratory.placed.response_rows(laboratory.sheet)
    np.savez(folder / "operation.npz", response_matrix=rows)
    for number, sweep in enumerate(sweeps):
        np.savez(folder / f"{number}.npz", **_arrays(sweep))
    content: dict[str, Any] = {
        "case": plan.compressor.case.value,
        "sweeps": [sweep.name for sweep in sweeps],
        "sense": source.sense,
        "static_unbalance_kg_m": _pair(source.static_unbalance),
        "dynamic_unbalance_kg_m2": _pair(source.dynamic_unbalance),
        "unbalances": [asdict(part) for part in source.unbalances],
        "gas_force_n": _pair(source.gas_force),
        "gas_moment_n_m": _pair(source.gas_moment),
        "rotating_gas_force_n": _pair(source.rotating_gas_force),
        "rotor_inertia_kg_m2": source.rotor_inertia,
        "mount_storage": plan.mount_storage,
        "mount_loss": plan.mount_loss,
        "softening": plan.softening,
        "flexible_receiver": plan.compressor.flexible_receiver,
        "hose_case": plan.hoses.value,
        "hoses": [
            {
                "name": hose.name,
                "position": hose.position.tolist(),
                "direction": hose.direction.tolist(),
                **asdict(hose.beam),
            }
            for hose in laboratory.compressor.hoses
        ],
    }
    replace_text(folder / "operation.json", json.dumps(content, indent=1) + "\n")


def _arrays(sweep: TrueSweep) -> dict[str, Any]:
    run, frequency = sweep.running, sweep.frequency
    squared = ((2 * np.pi * frequency) ** 2)[:, None, None]
    arrays = {
        "frequency": frequency,
        "load": run.load,
        "displacement": run.displacement,
        "apparent_mass": -run.dynamic_stiffness / squared,
        "acceleration": sweep.acceleration,
        "factors": run.factors,
        "amplitudes": run.amplitudes,
    }
    if sweep.hoses:
        moved = run.displacement[:, :, None]
        arrays[REACTION] = -(held_stiffness(sweep.hoses, frequency) @ moved)[:, :, 0]
        arrays[END_LOAD] = (end_loads(sweep.hoses, frequency) @ moved)[:, :, 0]
    return arrays


def _pair(number: complex) -> list[float]:
    return [number.real, number.imag]


HAMMER, HAMMER_WITH_HOSES, SWEEPS, SENSORS = "hammer", "hammer_with_hoses", "sweeps", "sensors.csv"
TACHO_NODE = 1
RECORD_NAME = "soft 7.5 bar over time"


def write_operating_test(
    folder: Path,
    seed: int = 1,
    level: CalibrationLevel = CalibrationLevel.C2,
    plan: OperationPlan | None = None,
    *,
    noise_free: bool = False,
) -> Path:
    """Strike and run a virtual compressor and write what the laboratory delivers.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        From 1; compressor and laboratory are those of `write_compressor_test`.
    level : CalibrationLevel
        How large the errors of placement and calibration are.
    plan : OperationPlan, optional
        By default a random compressor, scattered hoses, mounts as under the hammer.
    noise_free : bool
        Everything is where it should be, and silent. The folder states the same tolerances.

    Returns
    -------
    Path
        The folder, with ``operation.toml`` at its top and the exact truth in ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; a folder that is not empty or cannot be written.
    """
    plan = plan or OperationPlan()
    there = operation(seed, level, plan, noise_free=noise_free)
    sweeps = tuple(
        true_sweep(there, pressure, soft=soft, frequency=speeds())
        for soft in (False, True)
        for pressure in PRESSURES
    )
    title = f"running compressor, {plan.compressor.case.value}, level {level.value}, seed {seed}"
    with complete_or_not_at_all(Path(folder)) as unfinished:
        struck = {HAMMER: plan.compressor}
        if plan.hammer_with_hoses:
            struck[HAMMER_WITH_HOSES] = plan.struck_with_hoses
        for name, compressor in struck.items():
            write_compressor_test(unfinished / name, seed, level, compressor, noise_free=noise_free)
        nodes = SweepNodes(placed_sensors(there.laboratory.sheet), TACHO_NODE)
        write_placed_sensors(unfinished / SENSORS, nodes.sensors)
        (unfinished / SWEEPS).mkdir()
        sections = []
        for number, sweep in enumerate(sweeps):
            section = _spectra_section(sweep)
            values = (
                sweep.acceleration
                if noise_free
                else measured(sweep, draw(seed, Purpose.RUNNING, number))
            )
            assert section.spectra is not None
            path = unfinished / section.spectra
            write_sweep(path, nodes, sweep.frequency, values, notes=(title, sweep.name))
            sections.append(section)
        if plan.time_record:
            generator = draw(seed, Purpose.RUNNING, len(sweeps))
            sections.append(
                _write_record(unfinished, there, nodes, None if noise_free else generator)
            )
        file = OperatingTestFile(
            format=1,
            title=title,
            hammer=HAMMER,
            hammer_with_hoses=HAMMER_WITH_HOSES if plan.hammer_with_hoses else None,
            sensor_table=SENSORS,
            tacho_node=TACHO_NODE,
            rotor_inertia_kg_m2=there.source.rotor_inertia,
            deviations=stated_deviations(),
            sweeps=tuple(sections),
            hoses=drawn_hose_sections(),
        )
        dump_operating_test_file(unfinished / OPERATING_TEST_FILE, file)
        write_operation_truth(unfinished / "truth", there, plan, sweeps)
        replace_text(unfinished / "README.txt", operation_readme(title, file))
    return Path(folder)


def _spectra_section(sweep: TrueSweep) -> SweepSection:
    return SweepSection(
        name=sweep.name,
        hoses="standard" if sweep.hoses else "soft",
        pressure_bar=sweep.pressure,
        spectra=f"{SWEEPS}/{sweep.name.replace(' ', '_')}.uff",
    )


def _write_record(
    folder: Path, there: Operation, nodes: SweepNodes, generator: np.random.Generator | None
) -> SweepSection:
    sweep = true_sweep(there, PRESSURES[0], soft=True, frequency=grid())
    record = run_up(sweep.acceleration, float(floor(grid()).mean()), generator)
    section = SweepSection(
        name=RECORD_NAME,
        hoses="soft",
        pressure_bar=PRESSURES[0],
        record=f"{SWEEPS}/{RECORD_NAME.replace(' ', '_')}.uff",
        sample_rate_hz=RATE,
    )
    assert section.record is not None
    write_sweep_record(
        folder / section.record,
        nodes,
        RATE,
        record.tacho,
        record.acceleration,
        notes=(RECORD_NAME,),
    )
    return section


def stated_deviations() -> DeviationSection:
    """Return those of one part of a complex number: 1/√2 of the number's."""
    recorder, part = hit_plan(), float(np.sqrt(0.5))
    return DeviationSection(
        relative=SCATTER * part,
        floor_m_s2=recorder.response_noise * part,
        corner_hz=float(recorder.corner),
    )


def drawn_hose_sections() -> tuple[HoseSection, ...]:
    """Return the hoses as drawn and catalogued, for ``operation.toml``."""
    return tuple(
        HoseSection(
            name=hose.name,
            position_m=tuple(hose.position.tolist()),
            direction=tuple(hose.direction.tolist()),
            length_m=hose.beam.length,
            tension_n=hose.beam.tension,
            torsion_n_m2=hose.beam.torsion,
            bending_n_m2=hose.beam.bending,
            line_mass_kg_per_m=hose.beam.line_mass,
            loss_factor=hose.beam.loss_factor,
            torsion_radius_m=hose.beam.torsion_radius,
        )
        for hose in drawn_hoses()
    )
