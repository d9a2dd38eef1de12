"""The page on mounts whose stiffness follows from runs of the car alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError, listed
from deboom.files.library_export import library_json
from deboom.measurement.channels import LoadCase
from deboom.mounts.mounts_in_car import IDENTIFIED, UNEXPLAINED, MountsInCar, RunInCar
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.physics.sound_level import spl
from deboom.plot import CurvePanel
from deboom.report import Report, Step, Table

HALF_WIDTH, ERROR = "90 % half width of |K| [%]", "error of |K| [%]"
LIBRARY = "mounts.library.json"
MEASURED, SYNTHESISED = "measured at the ear", "forces times hammer functions"
TRUTH_EVERY = 20
"""Of the lines, whose truth is a dot."""


@dataclass(frozen=True, eq=False)
class MeasuredInCar:
    """What a car says of its mounts.

    - `truth`: by run (f, n_direction) [N/m]; empty for a real car.
    - `hashes`: of every input file, for the library; `inputs`: files that stay.
    """

    result: MountsInCar
    truth: Mapping[str, ComplexArray]
    hashes: Mapping[str, str]
    inputs: tuple[Path, ...] = ()


def mounts_in_car_report(measured: MeasuredInCar) -> Report:
    """Report on the mounts of one car."""
    result = measured.result
    vehicle = result.vehicle
    report = Report(
        "Mounts from the car alone",
        f"How stiff are the mounts of {vehicle.name} in operation, found on the road and with a "
        "hammer, without a test bench and without force cells?",
    )
    report.explain("dynamic stiffness", "noise transfer function", "SPL")
    report.inputs += measured.inputs
    report.assume(*vehicle.assumed)
    report.warn(
        f"{100 * result.unexplained:.0f} % of the motion of the body is explained by no force of a "
        "mount: shafts, exhaust or hoses pass force by, a sensor is turned or mistaken, or the "
        "hammer did not find the body without its powertrain. So no direction is identified."
        if result.unexplained > UNEXPLAINED
        else "",
        "Load cases have the powertrain's motion as it is in this car, whose body gives way, and "
        "the forces that its mounts would make of it on a body at rest. On a test bench the motion "
        "is another one by some per cent.",
        f"The car says nothing of {listed(result.assumed)}: in the load cases they are as stiff as "
        "the identified directions of their mount are on average."
        if result.assumed
        else "",
    )
    directions = result.table
    if measured.truth:
        directions[ERROR] = 100 * _errors(measured)
    complete = _files(report, measured)
    _answer(report, directions, complete)
    _numbers(report, result, directions)
    report.table("directions", directions)
    _stiffness(report, measured)
    _ears(report, result)
    return report


def _errors(measured: MeasuredInCar) -> RealArray:
    """Return the median error of |K| of each direction against the truth [1]."""
    truth = np.vstack([measured.truth[run.name] for run in measured.result.runs])
    ratio = np.abs(measured.result.stiffness) / np.abs(truth)
    return np.asarray(np.median(np.abs(ratio - 1), axis=0))


def _files(report: Report, measured: MeasuredInCar) -> bool:
    """Keep what a platform goes on from; say whether it is complete."""
    result = measured.result
    try:
        for case in result.load_cases:
            report.table(f"operating_{case.name}", load_case_table(case))
        mounts = result.mounts
    except InputError as error:
        report.warn(f"{error}.")
        return False
    document = library_json([result.record(measured.hashes)], mounts)
    report.attach(LIBRARY, document.encode())
    return True


def load_case_table(case: LoadCase) -> pd.DataFrame:
    """Return a load case as the table ``operating`` of a platform reads it."""
    columns = {"frequency [Hz]": case.force.frequency}
    for quantity, spectrum in (("displacement", case.displacement), ("force", case.force)):
        for channel, values in zip(spectrum.channels, spectrum.values.T, strict=True):
            columns[f"{channel} {quantity} real [{spectrum.unit}]"] = values.real
            columns[f"{channel} {quantity} imag [{spectrum.unit}]"] = values.imag
    return pd.DataFrame(columns)


def _answer(report: Report, directions: pd.DataFrame, complete: bool) -> None:
    """Say whether the stiffnesses may be used, how sure they are, and what comes next."""
    sure = directions[directions["identified"]]
    others = tuple(directions.loc[~directions["identified"], "direction"])
    if sure.empty:
        verdict = "Use no stiffness of this car: no direction is identified"
    else:
        verdict = (
            f"{len(sure)} of {len(directions)} directions are identified, within "
            f"{sure[HALF_WIDTH].median():.0f} % in the median and {sure[HALF_WIDTH].max():.0f} % "
            "at most: go on with these"
        )
    wrong = ""
    if ERROR in directions and len(sure):
        wrong = (
            f" Against the truth of the virtual car they are wrong by {sure[ERROR].median():.1f} "
            f"% in the median, {sure[ERROR].max():.1f} % at most."
        )
    report.answer(
        f"{verdict}.",
        "How sure: within means the half width of the 90 % interval of |K|, with sensors and blows "
        f"placed anew within the stated tolerances, median over lines.{wrong}",
        f"What not to trust: {listed(others)}; they move too little, or beside larger motion."
        if others
        else "",
    )
    shown = directions.assign(identified=directions["identified"].map({True: "yes", False: "no"}))
    report.panel("Each direction", Table(shown, ""), wide=True)
    report.panel(
        "What to do next",
        f"Put {LIBRARY} and operating_*.csv of this run into the folder of a platform, and name "
        "these tables, and the torque tables of the car, in its load cases."
        if complete
        else "Measure what the warning names, and repeat this run.",
        Step("deboom run front PLATFORM", "which stiffnesses make the fleet quiet"),
    )


def _numbers(report: Report, result: MountsInCar, directions: pd.DataFrame) -> None:
    """Keep the numbers that a hurried reader takes away."""
    others, n_directions = directions.loc[~directions["identified"], "direction"], len(directions)
    report.number(
        "n_identified",
        n_directions - len(others),
        "",
        f"directions identified of {n_directions}",
        headline="d",
    )
    report.number(
        "not_identified", ", ".join(others), "", "directions not identified", headline="s"
    )
    report.number(
        "unexplained_percent",
        100 * result.unexplained,
        "%",
        "motion of the body that no force of a mount explains, the worst run",
        headline=".1f",
    )
    for _, row in directions.iterrows():
        direction = str(row["direction"]).replace(" ", "_")
        report.number(
            f"median_stiffness_{direction}",
            float(row["median |K| [N/mm]"]),
            "N/mm",
            f"median |K| of {direction} in operation",
        )
        report.number(
            f"half_width_90_percent_{direction}",
            float(row[HALF_WIDTH]),
            "%",
            "half width of the 90 % interval of |K|, median over lines",
        )
        if ERROR in directions:
            report.number(
                f"truth_error_percent_{direction}",
                float(row[ERROR]),
                "%",
                "median error of |K| against the truth of the virtual car",
            )


def _stiffness(report: Report, measured: MeasuredInCar) -> None:
    """Draw each direction over frequency."""
    result = measured.result
    report.section(
        "Stiffness of each direction",
        "Accelerometers on both sides of a mount give its deflection. Those on the body answer the "
        "forces of all mounts at once; what the hammer says of each force separates them. The "
        "stiffness is complex and linear between a few frequencies; no rate of a supplier is "
        "needed.",
    )
    report.figure(
        "stiffness",
        lambda: plot.curve_panels(
            [_panel(measured, column) for column in range(len(result.directions))],
            columns=3,
            y_label="|K| [N/mm]",
        ),
        "Magnitude of the stiffness in every run, with its 90 % interval"
        + ("; dots: the truth." if measured.truth else ".")
        + f" A direction whose interval is wider than ± {100 * IDENTIFIED:.0f} % in the median is "
        "not identified.",
    )


def _panel(measured: MeasuredInCar, column: int) -> CurvePanel:
    result = measured.result
    identified = list(result.identified.values())[column]
    curves, ranges, points = {}, {}, {}
    for run in result.runs:
        name, lines = run.name, run.force.frequency
        size = N_PER_MM * np.abs(run.stiffness[:, column])
        curves[name] = size
        if identified:
            width = np.minimum(run.half_width[:, column], 1.0)
            ranges[name] = size * (1 - width), size * (1 + width)
        if measured.truth:
            some = slice(TRUTH_EVERY // 2, None, TRUTH_EVERY)
            points[name] = (
                lines[some],
                N_PER_MM * np.abs(measured.truth[name][some, column]),
            )
    return CurvePanel(
        result.directions[column],
        result.runs[0].force.frequency,
        curves,
        points=points,
        ranges=ranges,
        note="" if identified else "not identified",
    )


def _ears(report: Report, result: MountsInCar) -> None:
    """Compare the sound that the forces make with the microphone, which took no part."""
    ear = result.vehicle.ears[0]
    report.section(
        "The sound of these forces",
        f"Forces times hammer functions against the microphone of the {ear}, which took no part: "
        "it hears other paths as well, which lead where the mounts are quiet.",
    )
    levels = {run.name: _levels(result, run) for run in result.runs}
    loudest = [int(np.argmax(measured)) for measured, _ in levels.values()]
    off = [
        float(synthesised[line] - measured[line])
        for (measured, synthesised), line in zip(levels.values(), loudest, strict=True)
    ]
    table = pd.DataFrame(
        {
            "run": list(levels),
            "unexplained motion [%]": [100 * run.unexplained for run in result.runs],
            "loudest line [Hz]": result.runs[0].force.frequency[loudest],
            "synthesised less measured there [dB]": off,
        }
    )
    report.number(
        "loudest_line_error_db",
        max(off, key=abs),
        "dB",
        "level of the loudest line from these forces less that of the microphone, the worst run",
        headline="+.1f",
    )
    report.figure(
        "ear",
        lambda: plot.curve_panels(
            [
                CurvePanel(
                    run.name,
                    run.force.frequency,
                    dict(zip((MEASURED, SYNTHESISED), levels[run.name], strict=True)),
                )
                for run in result.runs
            ],
            columns=3,
            y_label="SPL [dB(A)]",
            order=result.vehicle.runs[0].order,
            depth=45.0,
        ),
        "Level at the ear, measured and from the forces of the mounts.",
    )
    report.table("runs", table, "Each run.")


def _levels(result: MountsInCar, run: RunInCar) -> tuple[RealArray, RealArray]:
    """Return measured and synthesised level at the first ear, (f,) [dB(A)]."""
    lines = run.force.frequency
    measured, synthesised = (np.asarray(spl(each, lines)) for each in result.at_ear(run))
    return measured, synthesised
