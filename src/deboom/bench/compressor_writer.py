"""Writes hammer tests and tests in operation of a virtual compressor, and the truth beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import AXES, ComplexArray, RealArray, RealOrComplexArray
from deboom.bench import compressor_rig as rig
from deboom.bench import compressor_truth, writing
from deboom.bench.choices import CalibrationLevel, CompressorCase
from deboom.bench.powertrain import read_data
from deboom.files import operating_test, rows, tables
from deboom.files.disk import complete_or_not_at_all
from deboom.files.hammer_test import HammerTestFile, write_hammer_test
from deboom.files.inertance_test import (
    INERTANCE_TEST_FILE,
    DrawingSection,
    DrawnMountSection,
    InertanceTestFile,
    ToleranceSection,
)
from deboom.files.schema import dump_toml
from deboom.files.uff import UffFunction, write_uff
from deboom.files.units import parse_unit

TACHO_NODE = 1

POSITIONS, FRF_FILE, COHERENCE_FILE, HITS = "positions.xlsx", "frf.uff", "coherence.uff", "hits"
HAMMER, HAMMER_WITH_HOSES, SWEEPS, SENSORS = "hammer", "hammer_with_hoses", "sweeps", "sensors.csv"
RECORD_NAME = "soft 7.5 bar over time"
ORIGIN = {
    CompressorCase.TABLE11: "of the thesis's table 11",
    CompressorCase.RANDOM: "drawn at random",
}
"""In names of tests."""

SCALES = 1e-3
"""Standard deviation of the weighed mass: a kitchen scale [1]."""


def impact_dof(impact: rows.PlacedImpact) -> writing.Dof:
    """Return the degree of freedom of an impact."""
    return writing.Dof(impact.node, rows.uff_direction(impact.direction), impact.impact, "force")


def hammer_functions(
    kind: int,
    frequency: RealArray,
    values: RealOrComplexArray,
    sheet: rig.Sheet,
    title: str,
) -> list[UffFunction]:
    """Return FRFs or coherences (f, n_channel, n_impact) of a roving hammer.

    Channel and impact fill the title, the first line of each function.
    """
    channels = [(row, axis) for row in sheet.sensors for axis in AXES]
    return [
        writing.function(
            kind,
            frequency,
            values[:, row, column],
            writing.Dof(sensor.node, f"+{axis}", sensor.sensor, "acceleration"),
            impact_dof(impact),
            title.format(f"{sensor.sensor} {axis}", impact.impact),
            "roving hammer, H1",
        )
        for column, impact in enumerate(sheet.impacts)
        for row, (sensor, axis) in enumerate(channels)
    ]


def tolerance_section(level: CalibrationLevel) -> ToleranceSection:
    """Return the stated tolerances of a level."""
    errors = rig.placement_errors(level)
    degrees = float(np.round(np.rad2deg(errors.angle), 10))
    return ToleranceSection(
        sensor_gain=errors.gain,
        sensor_position_m=errors.position,
        sensor_angle_deg=degrees,
        hammer_gain=errors.hammer,
        impact_position_m=errors.position,
        impact_angle_deg=degrees,
    )


def write_compressor_test(
    folder: Path,
    seed: int = 1,
    level: CalibrationLevel = CalibrationLevel.C2,
    plan: compressor_truth.CompressorPlan | None = None,
    *,
    noise_free: bool = False,
) -> Path:
    """Strike a virtual compressor and write what the laboratory delivers.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        Seed, from 1, of a random compressor, the errors of placement and calibration, and noise,
        each with numbers of its own.
    level : CalibrationLevel
        Sizes of the errors of placement and calibration; the tolerances that the folder states.
    plan : CompressorPlan, optional
        Wanted compressor; by default a random one on rigid ground.
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
    plan = plan or compressor_truth.CompressorPlan()
    lab = rig.laboratory(seed, level, plan, noise_free=noise_free)
    hits = rig.without_noise(rig.hit_plan()) if noise_free else rig.hit_plan()
    # who strikes a second time, now with hoses, makes other errors
    striking = rig.STRIKING if plan.hoses is None else rig.STRIKING_WITH_HOSES
    title = f"virtual compressor {ORIGIN[plan.case]}, calibration level {level.value}, seed {seed}"
    if plan.hoses is not None:
        title += ", with hoses"
    weighed = lab.compressor.mass
    if not noise_free:
        off = SCALES * float(rig.draw(seed, rig.WEIGHING).standard_normal())
        weighed = round(weighed * (1 + off), 3)
    with complete_or_not_at_all(Path(folder)) as unfinished:
        blows = rig.strike(lab.compressor, lab.placed, hits, rig.draw(seed, striking))
        sheet = lab.placed.sheet
        inertance, coherence = rig.averaged(blows, hits)
        for file, kind, values in (
            (FRF_FILE, writing.FRF, inertance),
            (COHERENCE_FILE, writing.COHERENCE, coherence),
        ):
            functions = hammer_functions(kind, hits.lines, values, sheet, "{} per {}")
            write_uff(unfinished / file, functions, binary=True)
        rows.write_positions(unfinished / POSITIONS, sheet.sensors, sheet.impacts)
        if plan.hits:
            _write_hits(unfinished / HITS, sheet, blows, hits, title)
        _write_test_file(unfinished, level, plan, hits, weighed, title)
        lines = hits.lines
        writing.write_readme(
            unfinished,
            title,
            "A refrigerant compressor on its rubber mounts, struck with a roving hammer: "
            f"{lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, {lines[1] - lines[0]:g} Hz "
            f"apart; H1 of {hits.hits} hits per impact, half sine of {1e3 * hits.pulse:g} ms and "
            f"about {hits.impulse:g} N s; blocks of {hits.duration:g} s. Positions count from the "
            "virtual point. Directions of responses are those of the sensor's own axes, directions "
            "of forces those of the position sheet.",
            "compressor",
            INERTANCE_TEST_FILE,
        )
        _write_test_truth(unfinished / "truth", lab, plan, level, hits, blows)
    return Path(folder)


def _write_hits(
    folder: Path, sheet: rig.Sheet, blows: rig.Blows, plan: rig.HitPlan, title: str
) -> None:
    """Write all hits over time as a hammer test."""
    unit = parse_unit("m/s^2")
    facts = HammerTestFile(
        format=1,
        title=title,
        sample_rate_hz=plan.rate,
        pretrigger_s=plan.pretrigger,
        impact_table="impacts.csv",
        channel_table="channels.csv",
    )
    points = [
        rows.HammerPoint(row.impact, row.node, f"{row.impact}.uff", row.position, row.direction)
        for row in sheet.impacts
    ]
    channels = [
        rows.HammerChannel(f"{row.sensor} {axis}", "acceleration", row.node, f"+{axis}", unit)
        for row in sheet.sensors
        for axis in AXES
    ]
    names = [row.impact for row in sheet.impacts]
    hits = dict(zip(names, zip(blows.force, blows.response, strict=True), strict=True))
    write_hammer_test(folder, facts, points, channels, hits)


def _write_test_file(
    folder: Path,
    level: CalibrationLevel,
    plan: compressor_truth.CompressorPlan,
    hits: rig.HitPlan,
    weighed: float,
    title: str,
) -> None:
    """Write ``compressor_test.toml`` with the drawing, whose centre is at the virtual point."""
    start = read_data(compressor_truth.COMPRESSOR_DATA)["start_table10"]
    inertia = compressor_truth.inertia_tensor(np.array(start["inertia_kg_m2_xx_yy_zz_xy_xz_yz"]))
    mounts = zip(
        start["mount_position_m"],
        start["mount_rotation_deg"],
        start["mount_static_stiffness_N_per_m_axial_radial1_radial2"],
        strict=True,
    )
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
        tolerances=tolerance_section(level),
        drawing=DrawingSection(
            mass_kg=start["mass_kg"],
            centre_of_gravity_m=(0.0, 0.0, 0.0),
            inertia_kg_m2=inertia.tolist(),
        ),
        mounts=tuple(
            DrawnMountSection(
                name=f"mount {number}",
                position_m=writing.triple(np.array(position, dtype=float)),
                rotation_deg=writing.triple(np.array(rotation, dtype=float)),
                stiffness_n_per_m=writing.triple(np.array(stiffness, dtype=float)),
            )
            for number, (position, rotation, stiffness) in enumerate(mounts, 1)
        ),
    )
    dump_toml(folder / INERTANCE_TEST_FILE, file)


def _write_test_truth(
    folder: Path,
    lab: rig.Laboratory,
    plan: compressor_truth.CompressorPlan,
    level: CalibrationLevel,
    hits: rig.HitPlan,
    blows: rig.Blows,
) -> None:
    """Write ``truth.npz`` and ``truth.json``."""
    folder.mkdir()
    compressor, placed = lab.compressor, lab.placed
    factors = blows.factors.mean(axis=1)
    # of the rigid body at the amplitude of a usual hit: what a model with six motions can find
    inertance = replace(compressor, joint=None).inertance(hits.lines)
    np.savez(
        folder / "truth.npz",
        frequency=hits.lines,
        inertance=inertance,
        apparent_mass=np.linalg.inv(inertance),
        response_matrix=placed.response_rows(),
        excitation_matrix=placed.excitation_rows() / (1 + placed.hammer_gain),
        frf=rig.exact_inertance(compressor, placed, hits.lines, factors),
    )
    mounts = zip(compressor.positions, compressor.rotations, compressor.stiffness, strict=True)
    content = {
        "case": plan.case.value,
        "level": level.value,
        "identical_mounts": plan.identical_mounts,
        "softening": plan.softening,
        "flexible_receiver": plan.flexible_receiver,
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
            for number, (position, rotation, stiffness) in enumerate(mounts, 1)
        ],
        "hoses": None if plan.hoses is None else plan.hoses.value,
        "gain": compressor.gain,
        "static_stiffness": compressor.static_stiffness,
        "sensor_gain": placed.sensor_gain,
        "hammer_gain": placed.hammer_gain,
        "impact_direction": placed.impact_directions,
    }
    writing.write_json(folder / "truth.json", content)


def write_operating_test(
    folder: Path,
    seed: int = 1,
    level: CalibrationLevel = CalibrationLevel.C2,
    plan: rig.OperationPlan | None = None,
    *,
    noise_free: bool = False,
) -> Path:
    """Strike and run a virtual compressor and write what the laboratory delivers.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        Seed, from 1; compressor and laboratory are those of `write_compressor_test`.
    level : CalibrationLevel
        Sizes of the errors of placement and calibration.
    plan : OperationPlan, optional
        Plan; by default a random compressor, scattered hoses, mounts as under the hammer.
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
    plan = plan or rig.OperationPlan()
    running_lab = rig.operation(seed, level, plan, noise_free=noise_free)
    sweeps = tuple(
        rig.true_sweep(running_lab, pressure, soft=soft, frequency=rig.speeds())
        for soft in (False, True)
        for pressure in rig.PRESSURES
    )
    channels = [
        (
            sweep.acceleration
            if noise_free
            else rig.measured(sweep, rig.draw(seed, rig.RUNNING, number)),
        )
        for number, sweep in enumerate(sweeps)
    ]
    record = None
    if plan.time_record:
        noise = None if noise_free else rig.draw(seed, rig.RUNNING, len(sweeps))
        record = rig.run_up(running_lab, rig.PRESSURES[0], noise)
    title = (
        f"running compressor {ORIGIN[plan.compressor.case]}, calibration level {level.value}, "
        f"seed {seed}"
    )
    with complete_or_not_at_all(Path(folder)) as unfinished:
        write_hammer_tests(unfinished, seed, level, plan, noise_free=noise_free)
        write_operation(unfinished, title, plan, running_lab, sweeps, channels, record=record)
        _write_operation_truth(unfinished / "truth", running_lab, plan, sweeps)
        writing.write_readme(
            unfinished,
            title,
            "A refrigerant compressor on its rubber mounts, struck with a hammer at rest, then run "
            "from 1000 to 9000 1/min at two pressures, with the standard hoses and with long soft "
            "ones that have masses on them. Phase from the tacho's pulse, once per revolution, "
            "when the rotor's mark is on the y axis. Order spectra are type 0 over the frequency "
            "of rotation, with the tacho's speed; channels over time are type 1, with its pulses.",
            "operation",
            operating_test.OPERATING_TEST_FILE,
        )
    return Path(folder)


def write_hammer_tests(
    folder: Path, seed: int, level: CalibrationLevel, plan: rig.OperationPlan, *, noise_free: bool
) -> None:
    """Write the hammer test without hoses and, where the plan asks for it, that with hoses."""
    struck = {HAMMER: plan.compressor}
    if plan.hammer_with_hoses:
        struck[HAMMER_WITH_HOSES] = replace(plan.compressor, hoses=plan.hoses)
    for name, compressor in struck.items():
        write_compressor_test(folder / name, seed, level, compressor, noise_free=noise_free)


def write_operation(
    folder: Path,
    title: str,
    plan: rig.OperationPlan,
    running_lab: rig.Operation,
    sweeps: Sequence[rig.Sweep],
    channels: Sequence[tuple[ComplexArray, ...]],
    *,
    record: tuple[RealArray, RealArray] | None = None,
    holders: tuple[tuple[str, int], ...] = (),
    microphones: tuple[tuple[str, int], ...] = (),
    sound_deviation: float = 0.0,
) -> None:
    """Write ``sweeps/``, the sensors on the compressor and ``operation.toml``.

    - `title`, `plan`, `running_lab`: title of the test; wanted operation; compressor and source.
    - `sweeps`: sweeps over `speeds`.
    - `channels`: order spectra of each sweep: on the compressor, in a car also of holders and ears.
    - `record` (tacho, acceleration), optional: run-up over time.
    - `holders`, `microphones`: name and node of the sensors beside those on the compressor.
    - `sound_deviation`: noise of each part of a tracked pressure, 1 σ [Pa].
    """
    sheet = running_lab.laboratory.placed.sheet
    nodes = operating_test.SweepNodes(sheet.sensors, TACHO_NODE, holders, microphones)
    tables.write_table(folder / SENSORS, rows.PlacedSensor, nodes.sensors)
    (folder / SWEEPS).mkdir()
    sections = []
    for sweep, parts in zip(sweeps, channels, strict=True):
        file, notes = f"{SWEEPS}/{sweep.name.replace(' ', '_')}.uff", (title, sweep.name)
        operating_test.write_sweep(folder / file, nodes, rig.speeds(), parts, notes=notes)
        sections.append(
            operating_test.SweepSection(
                name=sweep.name, hoses=sweep.state, pressure_bar=sweep.pressure, spectra=file
            )
        )
    if record is not None:
        file = f"{SWEEPS}/{RECORD_NAME.replace(' ', '_')}.uff"
        pulses, acceleration = record
        time = np.arange(pulses.size) / rig.RATE
        operating_test.write_sweep(
            folder / file, nodes, time, (acceleration,), pulses=pulses, notes=[RECORD_NAME]
        )
        sections.append(
            operating_test.SweepSection(
                name=RECORD_NAME,
                hoses="soft",
                pressure_bar=rig.PRESSURES[0],
                record=file,
                sample_rate_hz=rig.RATE,
            )
        )
    # of one part of a complex number: 1/√2 of the number's
    recorder, part = rig.hit_plan(), float(np.sqrt(0.5))
    file_content = operating_test.OperatingTestFile(
        format=1,
        title=title,
        hammer=HAMMER,
        hammer_with_hoses=HAMMER_WITH_HOSES if plan.hammer_with_hoses else None,
        sensor_table=SENSORS,
        tacho_node=TACHO_NODE,
        rotor_inertia_kg_m2=running_lab.source.rotor_inertia,
        deviations=operating_test.DeviationSection(
            relative=rig.SCATTER * part,
            floor_m_s2=recorder.response_noise * part,
            corner_hz=float(recorder.corner),
        ),
        sweeps=tuple(sections),
        hoses=tuple(
            operating_test.HoseSection(
                name=hose.name,
                position_m=writing.triple(hose.position),
                direction=writing.triple(hose.direction),
                length_m=hose.beam.length,
                tension_n=hose.beam.tension,
                torsion_n_m2=hose.beam.torsion,
                bending_n_m2=hose.beam.bending,
                line_mass_kg_per_m=hose.beam.line_mass,
                loss_factor=hose.beam.loss_factor,
                torsion_radius_m=hose.beam.torsion_radius,
            )
            for hose in compressor_truth.drawn_hoses()
        ),
        holders=tuple(operating_test.HolderSection(name=name, node=node) for name, node in holders),
        microphones=tuple(
            operating_test.MicrophoneSection(name=name, node=node, deviation_pa=sound_deviation)
            for name, node in microphones
        ),
    )
    dump_toml(folder / operating_test.OPERATING_TEST_FILE, file_content)


def _write_operation_truth(
    folder: Path,
    running_lab: rig.Operation,
    plan: rig.OperationPlan,
    sweeps: Sequence[rig.TrueSweep],
) -> None:
    """Write ``operation.json``, ``operation.npz`` and one ``.npz`` per sweep, but of no record.

    ``<number>.npz`` of each sweep, from 0: ``frequency`` (f,) [Hz]; ``load`` of the source and
    ``displacement`` at the virtual point (f, 6); ``apparent_mass`` (f, 6, 6) with mounts as they
    were, hoses and the turning rotor; ``acceleration`` (f, n_channel) without noise; ``factors`` of
    softening and ``amplitudes`` at the mounts (f, n_mount); with hoses ``hose_reaction``, their
    load on the compressor at the virtual point (f, 6), and ``end_load``, their load on what holds
    the other ends (f, 6 n_hose). ``operation.npz``: ``response_matrix`` (n_channel, 6).
    """
    folder.mkdir()
    lab, source = running_lab.laboratory, running_lab.source
    np.savez(folder / "operation.npz", response_matrix=lab.placed.response_rows())
    for number, sweep in enumerate(sweeps):
        run = sweep.running
        squared = ((2 * np.pi * sweep.frequency) ** 2)[:, None, None]
        arrays: dict[str, Any] = {
            "frequency": sweep.frequency,
            "load": run.load,
            "displacement": run.displacement,
            "apparent_mass": -run.dynamic_stiffness / squared,
            "acceleration": sweep.acceleration,
            "factors": run.factors,
            "amplitudes": run.amplitudes,
        }
        if sweep.hoses:
            moved = run.displacement[:, :, None]
            reaction = -(compressor_truth.held_stiffness(sweep.hoses, sweep.frequency) @ moved)[
                :, :, 0
            ]
            at_ends = (compressor_truth.end_loads(sweep.hoses, sweep.frequency) @ moved)[:, :, 0]
            arrays |= {"hose_reaction": reaction, "end_load": at_ends}
        np.savez(folder / f"{number}.npz", **arrays)
    content = {
        "case": plan.compressor.case.value,
        "sweeps": [sweep.name for sweep in sweeps],
        "sense": source.sense,
        "static_unbalance_kg_m": source.static_unbalance,
        "dynamic_unbalance_kg_m2": source.dynamic_unbalance,
        "unbalances": [asdict(part) for part in source.unbalances],
        "hoses": [
            {
                "name": hose.name,
                "position": hose.position,
                "direction": hose.direction,
                **asdict(hose.beam),
            }
            for hose in lab.compressor.hoses
        ],
    }
    writing.write_json(folder / "operation.json", content)
