"""Writes a roving-hammer test on the virtual compressor, and the truth beside it."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.bench.compressor_functions import (
    coherence_functions,
    frf_functions,
    placed_impacts,
    placed_sensors,
    write_hits,
)
from deboom.bench.compressor_hits import (
    Blows,
    HitPlan,
    averaged,
    exact_inertance,
    hit_plan,
    strike,
    without_noise,
)
from deboom.bench.compressor_laboratory import Laboratory, Purpose, draw, laboratory
from deboom.bench.compressor_plan import COMPRESSOR_DATA, CalibrationLevel, CompressorPlan
from deboom.bench.compressor_readme import readme_text
from deboom.bench.compressor_rig import placement_errors
from deboom.bench.compressor_truth import inertia_tensor
from deboom.bench.parameters import read_data
from deboom.files.atomic import replace_text
from deboom.files.inertance_test_file import (
    INERTANCE_TEST_FILE,
    DrawingSection,
    DrawnMountSection,
    InertanceTestFile,
    ToleranceSection,
    dump_inertance_test_file,
)
from deboom.files.inertance_test_tables import write_positions
from deboom.files.uff import write_uff
from deboom.files.whole_folder import complete_or_not_at_all

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
            position_m=_three(position),
            rotation_deg=_three(rotation),
            stiffness_n_per_m=_three(stiffness),
        )
        for number, (position, rotation, stiffness) in enumerate(rows, 1)
    )
    return drawing, mounts


def _three(values: list[float]) -> tuple[float, float, float]:
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
