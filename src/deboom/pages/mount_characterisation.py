"""The page on mounts that were characterised on a bench."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import AXES
from deboom.errors import listed
from deboom.mounts.characterised_bench import (
    CharacterisedBench,
    direction_numbers,
    force_transfer_matrices,
    force_transfer_table,
    percent,
    quality_of_motion,
    r2_table,
    shown_run,
    truth_table,
    uncertainty_table,
    usable_maps,
)
from deboom.mounts.error_budget import IDENTIFIED
from deboom.mounts.operating_map import OperatingMap, Preload
from deboom.pages.mount_figures import append_maps, append_runs, append_sensors, transfer_panels
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.plot import CurvePanel
from deboom.report import Report, Step, Table

SHOWN_POINTS = 2000
"""Of a panel; more hide each other."""
ALONE = " alone [%]"
"""Ends the names of the columns that take one source of error alone."""


def characterisation_report(
    first: CharacterisedBench, models: pd.DataFrame | None, inputs: Sequence[Path] = ()
) -> Report:
    """Report on a bench.

    - `models` or None: `model_table`, where other models are wanted.
    - `inputs`: files that stay.
    """
    result, has_truth = first.result, first.truth is not None
    numbers = direction_numbers(first)
    report = Report(
        "Mounts from raw sensors",
        f"How stiff are {', '.join(mount.name for mount in result.campaign.mounts)} in "
        "operation, and how reliable is the answer?",
    )
    report.explain("dynamic stiffness")
    report.inputs += inputs
    report.warn(
        "A high R² does not prove accuracy. It compares the surface with measured values, and a "
        "measuring chain with an error of half a degree has this error in every run. The error "
        "budget says how reliable a direction is.",
        "The errors against the truth are those of the virtual test bench, whose noise and "
        "alignment errors are stated, not those of a particular laboratory."
        if has_truth
        else "",
        *result.alarms,
    )
    report.assume(*result.campaign.assumed)
    uncertainty = uncertainty_table(numbers)
    maps = usable_maps(first)
    stiffness = {
        name: N_PER_MM * np.median(np.abs(operating_map.stiffness))
        for name, operating_map in maps.items()
    }
    uncertainty.insert(2, "median |K| [N/mm]", uncertainty["direction"].map(stiffness))
    truth = truth_table(numbers) if has_truth else None
    _answer(report, uncertainty, truth, result.alarms)
    _headlines(report, uncertainty, truth)
    _numbers(report, numbers)
    report.number(
        "seconds", round(first.seconds, 3), "s", "time for one mount set, with its budget"
    )
    _procedure(report, first)
    _accuracy(report, numbers, uncertainty, truth)
    if models is not None:
        report.table(
            "models",
            models,
            "Other models of the stiffness beside the surface, which is two cubics by least "
            "squares: all fitted without the check runs and judged on those.",
            {name: 2 for name in models.columns if name.endswith("[%]")},
        )
    labels = {n: n if n == "direction" else f"{n} [1]" for n in map(str, numbers)}
    report.table("directions", numbers.rename(columns=labels))

    few = {name: _thinned(operating_map) for name, operating_map in maps.items()}
    report.section(
        "Characteristic curves",
        "The dynamic stiffness over the static force, as suppliers specify it, measured and by the "
        "response surface.",
    )
    _static(report, first, few)
    append_maps(report, first)
    append_runs(report, first, numbers)
    _transfer(report, first)
    _motion(report, first)
    append_sensors(report, first)
    return report


HALF_WIDTH = "95 % half width of |K| [%]"


def _answer(
    report: Report,
    uncertainty: pd.DataFrame,
    truth: pd.DataFrame | None,
    alarms: Sequence[str],
) -> None:
    """Say whether the library may be used, for which directions, and what comes next."""
    sure = uncertainty["identified"] == "identified"
    good, others = uncertainty[sure], tuple(uncertainty.loc[~sure, "direction"])
    if good.empty:
        verdict = "No direction is identified: do not use this library"
    else:
        within = f"within {good[HALF_WIDTH].max():.0f} %"
        verdict = (
            f"Use {len(good)} directions of the library, which are known {within}; do not use "
            f"{listed(others)}, which {'is' if len(others) == 1 else 'are'} not identified"
            if others
            else f"All {len(good)} directions are known {within}: use the library"
        )
    if alarms:
        verdict += f", after a look at {len(alarms)} alarm{'s' if len(alarms) > 1 else ''}"
    wrong = ""
    if truth is not None and len(good):
        errors = truth.set_index("direction").loc[good["direction"], "error of |K| [%]"]
        wrong = (
            f" Against the truth of the bench they are wrong by {errors.median():.1f} % in the "
            f"median, {errors.max():.1f} % at most (rms)."
        )
    report.answer(
        f"{verdict}.",
        "How sure: within means the half width of the 95 % band of |K|, with all errors of the "
        f"measuring chain, the largest of these directions.{wrong}",
        f"What not to trust: a direction beyond {100 * IDENTIFIED:.0f} % is not identified; a "
        "front keeps its measured force and today's part.",
    )
    shown = [name for name in ("median |K| [N/mm]", HALF_WIDTH) if name in uncertainty]
    table = uncertainty[["direction", "identified", *shown]]
    report.panel("Each direction", Table(table, ""), wide=True)
    report.panel(
        "What to do next",
        Step("deboom library show LIBRARY --mount NAME", "how reliable each direction is"),
        Step("deboom run mount_selection PLATFORM", "choose parts of the library for a platform"),
        Step("deboom run front PLATFORM", "which stiffnesses make the fleet quiet"),
    )


def _headlines(report: Report, uncertainty: pd.DataFrame, truth: pd.DataFrame | None) -> None:
    """Show the stiffest directions, how many are identified, and how well."""
    sure = uncertainty["identified"] == "identified"
    names, others = uncertainty.loc[sure, "direction"], uncertainty.loc[~sure, "direction"]
    n_directions = len(uncertainty)
    for _, row in uncertainty[sure].nlargest(2, "median |K| [N/mm]").iterrows():
        name = row["direction"]
        direction = _key(name)
        report.number(
            f"median_stiffness_{direction}",
            float(row["median |K| [N/mm]"]),
            "N/mm",
            f"median |K| of {name} in operation",
            headline=".0f",
        )
    report.number(
        "n_identified", len(names), "", f"directions identified of {n_directions}", headline="d"
    )
    if len(others):
        report.number(
            "not_identified", ", ".join(others), "", "directions not identified", headline="s"
        )
    if truth is not None and len(names):
        errors = truth.set_index("direction").loc[names, "error of |K| [%]"]
        report.number(
            "truth_error_percent_median",
            float(errors.median()),
            "%",
            "rms error of an identified direction against the truth, median",
            headline=".1f",
        )
        report.number(
            "truth_error_percent_largest",
            float(errors.max()),
            "%",
            "rms error of an identified direction against the truth, the largest",
            headline=".1f",
        )


def _procedure(report: Report, bench: CharacterisedBench) -> None:
    """Say what was asked, and with which data."""
    first = bench.result
    gears = sorted({run.gear for run in first.runs})
    report.section(
        "What was asked, and with which data",
        f"Mount set {first.mount_set} on {bench.title}: {len(first.runs)} runs with rising torque "
        f"in the gears {', '.join(map(str, gears))}, engine order {first.campaign.order:g}. "
        f"Preload variable: {first.options.preload.name.lower().replace('_', ' ')}.",
        folded=True,
    )
    calibration = (
        " Before that the measuring chain calibrates itself: sensors on a rigid body must "
        "agree, and the forces of the mounts must be mass times acceleration."
    )
    report.text(
        "Accelerometers give the motion of the rigid powertrain and with it of the virtual point "
        "in each mount; cells below the mounts, calibrated by a shaker at the virtual point, give "
        "its force. Force over displacement is the operating dynamic stiffness. Complete cubics "
        "in preload, displacement amplitude and frequency, in pieces of the preload, are fitted "
        "to real and imaginary part." + (calibration if first.options.self_calibration else "")
    )
    for direction in first.directions.values():
        report.text(direction.complaint or "")


def _accuracy(
    report: Report,
    numbers: pd.DataFrame,
    uncertainty: pd.DataFrame,
    truth: pd.DataFrame | None,
) -> None:
    """Say how far to believe the surfaces."""
    shared = ""
    if truth is not None:
        shared = (
            " All lines of one bench share its errors, so the band may contain all of them or "
            "hardly any. Over many benches it should contain 95 %."
        )
    report.section(
        "How far to believe it",
        "Uncertainty from the measuring chain, error against the truth (if the truth is known), "
        "and fit of the surface to the measured values.",
    )
    alone = [name for name in uncertainty.columns if name.endswith(ALONE)]
    report.table(
        "uncertainty",
        uncertainty,
        f"Half width of the 95 % band of the surface, median over its lines. Beyond "
        f"{100 * IDENTIFIED:.0f} % a direction is not identified.{shared}",
        shown=uncertainty.drop(columns=alone),
    )
    if truth is not None:
        report.table(
            "truth",
            truth,
            "Rms error of the surface against the truth. Held-out: a surface fitted without the "
            "check runs, on those.",
        )
    r2 = r2_table(numbers)
    report.table(
        "r2",
        r2,
        "Coefficient of determination, beside tables 6 to 8 of the thesis. Held-out as above; a "
        "dash: not known.",
        {name: 2 for name in r2.columns if name.endswith("[%]")},
    )


def _transfer(report: Report, bench: CharacterisedBench) -> None:
    """Show how the cells below the mounts are calibrated."""
    report.section(
        "Force transfer matrices",
        "A shaker at the virtual point of each mount shows how the cells below measure a force at "
        "that point. The force in operation is the inverse of this matrix times the force of the "
        "cells.",
        folded=True,
    )
    matrices = force_transfer_matrices(bench)
    table = force_transfer_table(list(matrices.values()))
    report.table(
        "force_transfer",
        table,
        "Mean over frequency and repeats. Deviations are relative to the matrix's column.",
    )
    if matrices:
        report.number(
            "force_transfer_change_percent",
            float(table["largest change over frequency [%]"].max()),
            "%",
            "largest change of the force transfer over frequency",
        )
        report.figure(
            "force_transfer",
            partial(transfer_panels, list(matrices.values())),
            "What the cells show of a force at the virtual point, over frequency: constant, so "
            "that its mean stands for all lines (thesis, figure 18).",
        )


def _key(direction: str) -> str:
    """Write a direction in a key, ``TSM_x``."""
    return direction.replace(" ", "_")


def _numbers(report: Report, numbers: pd.DataFrame) -> None:
    """Say of each direction how well its surface fits, and how sure its stiffness is."""

    def of_each(column: str) -> Iterator[tuple[str, float]]:
        for name, value in percent(numbers, column).dropna().items():
            yield _key(str(name)), float(value)

    for direction, value in of_each("r2_real"):
        report.number(
            f"r2_real_{direction}",
            value,
            "%",
            "R² of the surface's real part against its own lines",
        )
    for direction, value in of_each("r2_imag"):
        report.number(
            f"r2_imag_{direction}",
            value,
            "%",
            "R² of the surface's imaginary part against its own lines",
        )
    for direction, value in of_each("r2_force_real"):
        report.number(
            f"r2_force_real_{direction}",
            value,
            "%",
            "R² of the real part of the force against its own lines",
        )
    for direction, value in of_each("r2_force_imag"):
        report.number(
            f"r2_force_imag_{direction}",
            value,
            "%",
            "R² of the imaginary part of the force against its own lines",
        )
    for direction, value in of_each("check_r2_real"):
        report.number(
            f"r2_real_held_out_{direction}",
            value,
            "%",
            "R² of the real part against check runs, which were not fitted",
        )
    for direction, value in of_each("check_r2_imag"):
        report.number(
            f"r2_imag_held_out_{direction}",
            value,
            "%",
            "R² of the imaginary part against check runs, which were not fitted",
        )
    for direction, value in of_each("error"):
        report.number(
            f"truth_error_percent_{direction}",
            value,
            "%",
            "rms error of |K| against the bench's truth",
        )
    for direction, value in of_each("check_error"):
        report.number(
            f"truth_error_percent_held_out_{direction}",
            value,
            "%",
            "rms error of |K| against the bench's truth on check runs, which were not fitted",
        )
    for direction, value in of_each("half_width"):
        report.number(
            f"half_width_95_percent_{direction}",
            value,
            "%",
            "half width of |K|, 95 %, by the error budget",
        )
    for direction, value in of_each("coverage"):
        report.number(
            f"coverage_95_percent_{direction}",
            value,
            "%",
            "lines whose truth lies inside the stated band",
        )


def _static(report: Report, bench: CharacterisedBench, maps: Mapping[str, OperatingMap]) -> None:
    """Draw the stiffness over the static force: real parts of all mounts, then imaginary parts."""
    for axis in AXES:
        panels = []
        for part, of in (("Re", np.real), ("Im", np.imag)):
            for name, surface in bench.surfaces.items():
                lines = maps[name]
                if lines.axis != axis or not np.isfinite(lines.static_force).all():
                    continue
                preload = lines.preload(Preload.STATIC_FORCE)
                points = {
                    "measured": (preload, of(lines.stiffness) * N_PER_MM),
                    "response surface": (preload, of(bench.modelled(surface, lines)) * N_PER_MM),
                }
                panels.append(CurvePanel(f"{part} K, {name}", preload, {}, points))
        if panels:
            report.figure(
                f"static_{axis}",
                partial(
                    plot.curve_panels,
                    panels,
                    x_label="static force [N]",
                    y_label="K [N/mm]",
                    columns=len(panels) // 2,
                ),
                f"Axis {axis}. Real parts above, imaginary parts below, over the quasi-static "
                "force of the cells (thesis, figures 33 to 35). The scatter of both is the "
                "projection of amplitude and frequency.",
            )


def _motion(report: Report, bench: CharacterisedBench) -> None:
    """Show how well the rigid body's motion fits its sensors."""
    report.section(
        "Motion of the powertrain",
        f"Run {shown_run(bench).name}. The motion of the rigid body comes from all accelerometers "
        "together; each of them can be computed from it again.",
        folded=True,
    )
    report.table(
        "quality",
        quality_of_motion(bench),
        "Checks whether the sensors agree, in the order in which a laboratory corrects errors: "
        "the first check needs only the position sheet, the last leaves out one sensor at a time "
        "and names the faulty sensor.",
    )


def _thinned(measured: OperatingMap) -> OperatingMap:
    return measured.select(slice(None, None, max(1, len(measured) // SHOWN_POINTS)))
