"""Writes the test of a running virtual compressor: hammer tests, sweeps, and the truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from deboom.bench.compressor_functions import placed_sensors
from deboom.bench.compressor_hits import hit_plan
from deboom.bench.compressor_laboratory import Purpose, draw
from deboom.bench.compressor_operation import (
    SCATTER,
    Operation,
    TrueSweep,
    floor,
    measured,
    operation,
    speeds,
    true_sweep,
)
from deboom.bench.compressor_operation_plan import PRESSURES, OperationPlan
from deboom.bench.compressor_operation_truth import write_operation_truth
from deboom.bench.compressor_plan import CalibrationLevel
from deboom.bench.compressor_readme import operation_readme
from deboom.bench.compressor_run_up import RATE, grid, run_up
from deboom.bench.compressor_writer import write_compressor_test
from deboom.bench.hoses import drawn_hoses
from deboom.files.atomic import replace_text
from deboom.files.inertance_test_tables import write_placed_sensors
from deboom.files.operating_sweeps import SweepNodes, write_sweep, write_sweep_record
from deboom.files.operating_test_file import (
    OPERATING_TEST_FILE,
    DeviationSection,
    HoseSection,
    OperatingTestFile,
    SweepSection,
    dump_operating_test_file,
)
from deboom.files.whole_folder import complete_or_not_at_all

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
