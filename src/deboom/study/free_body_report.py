"""The report on a free or softly hung body: ``identify --free``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from deboom.measurement.compressor_test import InertanceTest, refuse_contradictions
from deboom.measurement.free_body import free_body
from deboom.measurement.virtual_point import (
    impact_geometry,
    sensor_geometry,
    virtual_point,
    virtual_point_frf,
)
from deboom.physics.rigid_body import mass_matrix
from deboom.report import Report
from deboom.study.compressor_identification import CompressorTruth, in_words, read_test
from deboom.study.identification_report import COMMAND, MODEL, SEED, inertance_figure
from deboom.study.runner import run_command


def free_body_into_run(
    folder: Path,
    out: Path,
    band: tuple[float, float] | None = None,
    *,
    hung: bool = False,
    from_hits: bool = False,
    with_truth: bool = False,
) -> Path:
    """Identify a free or softly hung body from its hammer test and write a run folder.

    - `folder`: holds ``compressor_test.toml``; its mounts, where drawn, are not looked at.
    - `out`: folder that gets ``identify/<run>/``.
    - `band`: lines of the fit [Hz]; chosen from the data by default.
    - `hung`: fit the cords as well.
    - returns the finished run folder.
    - raises InputError: a test that cannot be read; a channel or impact that contradicts all
      others, or functions of another sign or quantity; see also `deboom.free_body`.
    """
    begin = time.perf_counter()
    test, truth = read_test(folder, from_hits=from_hits, truth=with_truth)
    record: dict[str, Any] = {
        "study": COMMAND,
        "command": f"deboom identify {folder.as_posix()} --free",
        "question": "Which mass, centre of gravity and inertia has this free body?",
        "seed": SEED,
        "arguments": {
            "band": None if band is None else f"{band[0]:g}-{band[1]:g}",
            "hung": hung,
            "from-hits": from_hits,
            "truth": with_truth,
        },
    }
    return run_command(
        out,
        record,
        lambda: _free_report(test, truth, band, hung=hung),
        relative_to=folder,
        begin=begin,
    )


def _free_report(
    test: InertanceTest,
    truth: CompressorTruth | None,
    band: tuple[float, float] | None,
    *,
    hung: bool,
) -> Report:
    """Fit the mass lines of a free body and report them."""
    refuse_contradictions(test)
    inertance = virtual_point_frf(
        test.frf,
        response=virtual_point(sensor_geometry(test.sensors)),
        excitation=virtual_point(impact_geometry(test.impacts)),
    )
    lines, weighed = inertance.frequency, test.weighed_mass
    found = free_body(
        lines,
        inertance.values,
        band=band,
        hung=hung,
        weighed=None if weighed is None else (weighed, test.weighed_mass_deviation),
        gain_deviation=max(test.tolerances.sensor_gain, test.tolerances.hammer_gain),
    )
    report = Report(
        f"Free body: {test.name}", "Which mass, centre of gravity and inertia has this body?"
    )
    report.tile(f"{found.body.mass:.3f} ± {found.deviation[0]:.2g} kg", "mass, 1 σ")
    low, high = found.band
    report.tile(f"{low:g}–{high:g} Hz", "lines of the fit")
    if weighed is None:
        report.warn("Not weighed: a gain that all channels share looks like mass. Weigh it.")
    report.summary |= {
        "mass_kg": found.body.mass,
        "mass_deviation_kg": float(found.deviation[0]),
        "misfit": found.misfit,
        "n_alarms": 0,
    }
    report.inputs += test.input_files
    table = found.table
    if truth is not None:
        report.inputs.append(truth.path)
        true = truth.model
        inertia = true.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        table["truth"] = [true.mass, *true.centre, *inertia]
    report.section(
        "Mass, centre of gravity and inertia",
        "A constant and the foot of the flexible modes are fitted to the accelerance at the "
        "virtual point; the constant is the inverse mass matrix of a rigid body. Centre of gravity "
        "in the axes and from the origin of the position sheet, inertia about it.",
    )
    report.table("parameters", table, "1 σ of noise, model and gains.", shown=in_words(table))
    rigid = np.linalg.inv(mass_matrix(found.body.mass, found.body.inertia, found.body.centre))
    curves = {"measured": inertance.values, MODEL: np.broadcast_to(rigid, inertance.values.shape)}
    report.figure(
        "inertance",
        lambda: inertance_figure(lines, curves, (found.band,)),
        "Inertance at the virtual point, and that of the identified body.",
    )
    return report
