"""The report on a free or softly hung body: ``identify --free``."""

from __future__ import annotations

import numpy as np

from deboom.measurement.compressor_test import InertanceTest, refuse_contradictions
from deboom.measurement.free_body import free_body
from deboom.measurement.virtual_point import (
    impact_geometry,
    sensor_geometry,
    virtual_point,
    virtual_point_frf,
)
from deboom.pages.compressor_identification import CompressorTruth, in_words
from deboom.pages.identification import MODEL, inertance_figure
from deboom.physics.rigid_body import mass_matrix
from deboom.report import Report


def free_report(
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
    free = free_body(
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
    report.tile(f"{free.body.mass:.3f} ± {free.deviation[0]:.2g} kg", "mass, 1 σ")
    low, high = free.band
    report.tile(f"{low:g}–{high:g} Hz", "lines of the fit")
    if weighed is None:
        report.warn("Not weighed: a gain that all channels share looks like mass. Weigh it.")
    report.summary |= {
        "mass_kg": free.body.mass,
        "mass_deviation_kg": float(free.deviation[0]),
        "misfit": free.misfit,
        "n_alarms": 0,
    }
    report.inputs += test.input_files
    table = free.table
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
    rigid = np.linalg.inv(mass_matrix(free.body.mass, free.body.inertia, free.body.centre))
    curves = {"measured": inertance.values, MODEL: np.broadcast_to(rigid, inertance.values.shape)}
    report.figure(
        "inertance",
        lambda: inertance_figure(lines, curves, (free.band,)),
        "Inertance at the virtual point, and that of the identified body.",
    )
    return report
