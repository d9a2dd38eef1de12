"""Writes one electric car as a laboratory measures it, and the truth beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.bench import compressor_rig as rig
from deboom.bench import electric_car, writing
from deboom.bench.choices import CalibrationLevel, CompressorCase
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import (
    hammer_functions,
    impact_dof,
    tolerance_section,
    write_hammer_tests,
    write_operation,
)
from deboom.bench.families import KINDS, draw_family
from deboom.errors import InputError
from deboom.files.disk import complete_or_not_at_all
from deboom.files.electric_car import ELECTRIC_CAR_FILE, ElectricCarFile, PointSection
from deboom.files.rows import write_positions
from deboom.files.schema import dump_toml
from deboom.files.uff import write_uff
from deboom.files.vehicle import EarEntry

POSITIONS, PRESSURE, ACCELERANCE = "ntf/positions.xlsx", "ntf/pressure.uff", "ntf/accelerance.uff"

CAR_PLAN = rig.OperationPlan(compressor=CompressorPlan(CompressorCase.TABLE11))
"""The compressor that the body's points belong to, with scattered hoses."""

_BODY, _STRIKING, _CABIN, _RUNNING = range(100, 104)
"""Purposes with random numbers of their own, beside those of the compressor's laboratory."""


def write_electric_car(
    folder: Path,
    seed: int = 1,
    car: str = "EV-1",
    fleet: int | None = None,
    level: CalibrationLevel = CalibrationLevel.C2,
    plan: rig.OperationPlan = CAR_PLAN,
    *,
    noise_free: bool = False,
    family: str = "",
) -> Path:
    """Measure one electric car and its compressor, and write their files.

    Parameters
    ----------
    folder : Path
        A new or an empty folder; it appears complete or not at all.
    seed : int
        Seed, from 1, of hoses, errors and noise; the compressor and its hammer test are those of
        `deboom.bench.compressor_writer.write_compressor_test`.
    car : str
        Name in the fleet.
    fleet : int, optional
        Seed of a drawn fleet; the frozen one if left out.
    level : CalibrationLevel
        Sizes of the errors of placement and calibration, on compressor and body.
    plan : OperationPlan
        Plan; by default the thesis's compressor, scattered hoses, mounts as under the hammer.
    noise_free : bool
        Everything is where it should be, and silent. The folder states the same tolerances.
    family : str
        Bodies, rubber in the car and noise, see `deboom.bench.families.draw_family`; by default
        those of the bench's own prior. `fleet` draws the bodies, by default as seed 1.

    Returns
    -------
    Path
        The folder, with ``car.toml`` and ``operation.toml`` at its top and the exact truth in
        ``truth/``.

    Raises
    ------
    InputError
        Seed below 1; no such car or family; a family with mounts that differ or soften, or with
        missing lines or sensors; a plan with softening mounts, a receiver or a record over time; a
        folder that is not empty or cannot be written.
    """
    struck = plan.compressor
    if plan.softening or plan.time_record or struck.softening or struck.flexible_receiver:
        raise InputError(
            "a car is written with mounts that do not soften, on its own body, and with order "
            "spectra only: leave softening, receiver and time record out"
        )
    drawn = draw_family(family, seed, plan.truth_seed)
    drawn.refuse(("apart", "payne", "gaps", "dead"), "an electric car")
    kind = KINDS.get(drawn.kind)
    if fleet is None and kind is None:
        cars = electric_car.frozen_fleet()
    else:
        cars = electric_car.draw_fleet(1 if fleet is None else fleet, kind)
    stiffness, loss = (float(factors[0]) for factors in drawn.in_car(len(electric_car.MOUNTS)))
    plan = replace(
        plan,
        mount_storage=stiffness * plan.mount_storage,
        mount_loss=stiffness * loss * plan.mount_loss,
    )
    noise = drawn.values["noise"]
    if car not in cars:
        raise InputError(f"there is no car '{car}' in the fleet: use {', '.join(cars)}")
    body = cars[car]
    running_rig = rig.operation(seed, level, plan, noise_free=noise_free)
    errors = rig.NO_PLACEMENT_ERRORS if noise_free else rig.placement_errors(level)
    compressor = running_rig.laboratory.compressor
    names = (*electric_car.MOUNTS, *(hose.name for hose in compressor.hoses))
    sheets = electric_car.point_sheets(compressor)
    # a virtual point is where somebody believes the centre of a mount to be
    believed = errors.position * rig.draw(seed, _BODY, 1).standard_normal((len(sheets), 3))
    stated = [sheet.origin for sheet in sheets] + believed
    stated = np.round(stated, 10 if noise_free else electric_car.SHEET_DIGITS)
    setup = electric_car.draw_setup(sheets, errors, rig.draw(seed, _BODY))
    sensors = electric_car.draw_car_sensors(errors, rig.draw(seed, _CABIN))
    sweeps = tuple(
        electric_car.sweep_car(body, running_rig, sensors, rig.speeds(), pressure, soft=soft)
        for soft in (False, True)
        for pressure in rig.PRESSURES
    )
    channels = [
        sweep.channels
        if noise_free
        else electric_car.tracked(sweep, rig.draw(seed, _RUNNING, number), noise)
        for number, sweep in enumerate(sweeps)
    ]
    hits = electric_car.body_plan(noise_free=noise_free)
    hits = replace(
        hits,
        response_noise=noise * hits.response_noise,
        force_noise=noise * hits.force_noise,
    )
    cabin_noise = 0.0 if noise_free else noise * electric_car.CABIN_NOISE
    frfs = electric_car.strike_body(
        body, setup, hits, cabin_noise, sensors[1], rig.draw(seed, _STRIKING)
    )
    title = f"virtual electric car {car}, calibration level {level.value}, seed {seed}"
    holders = tuple(
        (mount, electric_car.FIRST_HOLDER_NODE + number)
        for number, mount in enumerate(electric_car.MOUNTS)
    )
    with complete_or_not_at_all(Path(folder)) as unfinished:
        write_hammer_tests(unfinished, seed, level, plan, noise_free=noise_free)
        write_operation(
            unfinished,
            title,
            plan,
            running_rig,
            sweeps,
            channels,
            holders=holders,
            microphones=((electric_car.EAR, electric_car.EAR_NODE),),
            sound_deviation=electric_car.SOUND_FLOOR,
        )
        _write_body(unfinished, sheets, frfs, car)
        _write_car_file(unfinished, car, title, level, sheets, names, stated)
        lines = hits.lines
        writing.write_readme(
            unfinished,
            title,
            "A refrigerant compressor in an electric car: struck on a rigid rig without hoses, run "
            "in the car with its own and with long soft hoses; and the body of the car, struck "
            "with the compressor taken out. Positions count from the virtual point of the "
            f"compressor, along its axes. Body: {lines.size} lines from {lines[0]:g} to "
            f"{lines[-1]:g} Hz, H1 of {hits.hits} hits of about {hits.impulse:g} N s. "
            "Sweeps: first order, phase to the pulse of the tacho.",
            "car",
            ELECTRIC_CAR_FILE,
        )
        _write_truth(unfinished / "truth", body, setup, sensors[1], sweeps)
        if family:
            drawn.write_truth(unfinished / "truth")
    return Path(folder)


def _write_body(
    folder: Path, points: Sequence[rig.Sheet], frfs: electric_car.BodyFrfs, car: str
) -> None:
    """Write what the hammer finds: pressure with its coherence, acceleration, positions."""
    (folder / PRESSURE).parent.mkdir()
    sensors = tuple(row for point in points for row in point.sensors)
    impacts = tuple(row for point in points for row in point.impacts)
    write_positions(folder / POSITIONS, sensors, impacts)
    ear, functions = (
        writing.Dof(electric_car.EAR_NODE, "scalar", electric_car.MICROPHONE, "pressure"),
        [],
    )
    for column, impact in enumerate(impacts):
        title = f"noise transfer function, {car}, {electric_car.EAR}, hammer at {impact.impact}"
        for kind, values, line in (
            (writing.FRF, frfs.pressure, title),
            (writing.COHERENCE, frfs.coherence, f"coherence of the {title}"),
        ):
            lines = (line, "roving hammer, H1")
            dof = impact_dof(impact)
            functions.append(
                writing.function(kind, frfs.frequency, values[:, column], ear, dof, *lines)
            )
    write_uff(folder / PRESSURE, functions, binary=True)
    title = f"accelerance, {car}, hammer at {{1}}, {{0}}"
    whole = rig.Sheet(sensors, impacts)
    functions = hammer_functions(writing.FRF, frfs.frequency, frfs.acceleration, whole, title)
    write_uff(folder / ACCELERANCE, functions, binary=True)


def _write_car_file(
    folder: Path,
    car: str,
    title: str,
    level: CalibrationLevel,
    points: Sequence[rig.Sheet],
    names: Sequence[str],
    stated: RealArray,
) -> None:
    """Write ``car.toml`` with the points where somebody believes them to be."""
    file = ElectricCarFile(
        format=1,
        name=car,
        title=title,
        sensor_table=POSITIONS,
        impact_table=POSITIONS,
        pressure=PRESSURE,
        accelerance=ACCELERANCE,
        hits_per_impact=electric_car.body_plan().hits,
        ear=EarEntry(
            name=electric_car.EAR, node=electric_car.EAR_NODE, microphone=electric_car.MICROPHONE
        ),
        tolerances=tolerance_section(level),
        points=tuple(
            PointSection(
                name=name,
                kind="mount" if name in electric_car.MOUNTS else "hose",
                position_m=writing.triple(position),
                sensors=tuple(row.sensor for row in point.sensors),
                impacts=tuple(row.impact for row in point.impacts),
            )
            for point, name, position in zip(points, names, stated, strict=True)
        ),
    )
    dump_toml(folder / ELECTRIC_CAR_FILE, file)


def _write_truth(
    folder: Path,
    car: electric_car.ElectricCarBody,
    setup: Sequence[rig.Placed],
    microphone: float,
    sweeps: Sequence[electric_car.CarSweep],
) -> None:
    """Write ``car.json``, ``body.npz`` and one ``.npz`` per sweep.

    ``body.npz``: ``frequency`` (f,); ``noise_transfer`` (f, 30) per load at the true points and
    ``point_receptance`` (f, 5, 6, 6). ``0.npz`` … of the sweeps: ``frequency``, ``load`` and
    ``displacement`` (f, 6) of the compressor, ``body_motion`` and ``body_load`` (f, 30),
    ``pressure`` (f,) at the ear.
    """
    folder.mkdir()
    lines = electric_car.body_plan().lines
    blocks = car.receptance(lines).reshape(
        lines.size, len(electric_car.POINTS), 6, len(electric_car.POINTS), 6
    )
    np.savez(
        folder / "body.npz",
        frequency=lines,
        noise_transfer=car.noise_transfer(lines),
        point_receptance=np.einsum("fpapb->fpab", blocks),
    )
    for number, sweep in enumerate(sweeps):
        np.savez(folder / f"{number}.npz", **vars(sweep.run))
    content = {
        "car": car.name,
        "sweeps": [sweep.name for sweep in sweeps],
        "points": electric_car.POINTS,
        "microphone": microphone,
        "hammer_gain": setup[0].hammer_gain,
    }
    writing.write_json(folder / "car.json", content)
