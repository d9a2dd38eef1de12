"""The page on a prototype that was driven, against what was predicted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import listed
from deboom.files.front_run import design_name
from deboom.measurement.booming_peaks import TOLERANCE
from deboom.pages.front_answer import (
    certainty_sentence,
    expected_on_average,
    model_sentence,
    report_expected_numbers,
)
from deboom.pages.supplier_study import SupplierStudy
from deboom.plot.style import signed
from deboom.report import Report, Step, Table
from deboom.vehicles.expected_change import ExpectedChange

DRAWS = 64
"""Repeated measurements that the uncertainty of the prediction is drawn from."""
STATES = ("today", "new")
AS_PREDICTED, OTHERWISE, OPEN = "as predicted", "not as predicted", "not decided"
NEAR = 0.1
"""Distance from the end of an interval at which a mean lies at its end [dB]."""
AS_EXPECTED, NOT_AS_EXPECTED = "as expected", "not as expected"


@dataclass(frozen=True, eq=False)
class Drives:
    """The front study of the run, and levels of every drive by state, (n_drive, v, f) [dB(A)]."""

    study: SupplierStudy
    measured: dict[str, RealArray]


def driven_report(
    drives: Drives,
    expected: ExpectedChange | str,
    *,
    vehicles: pd.DataFrame,
    peaks: pd.DataFrame,
    question: str,
    run: Path,
    folder: Path,
) -> Report:
    """Report whether the prototype did what was expected.

    - `expected`: change of the design, or why none is stated.
    - `vehicles`: change of each vehicle with its verdict; `peaks`: of each booming peak.
    - `question`: of the study.
    - `run`: folder of the run that predicted; `folder`: of what was measured.
    """
    kept, undecided = (int((peaks["verdict"] == word).sum()) for word in (AS_PREDICTED, OPEN))
    means = [float(peaks[f"{what} change [dB]"].mean()) for what in ("measured", "predicted")]
    changes = [float(vehicles[f"{what} [dB]"].mean()) for what in ("measured change", "model")]
    counts = [len(drives.measured[state]) for state in STATES]
    driven = (
        f"{counts[0]} drives with today's parts, {counts[1]} with {design_name(drives.study.pick)}"
    )
    report = Report("The prototype, driven", question)
    average = (
        f"{signed(means[0], 1)} dB",
        f"measured on average, {signed(means[1], 1)} in the model",
    )
    count = f"{kept} of {len(peaks)}"
    if undecided:
        report.warn("One drive each: the uncertainty of the measured change is not known.")
        decided = "Not decided whether"
        sure = (
            "One drive of each state does not say how far drives differ: drive each twice or more."
        )
    else:
        decided = count
        sure = (
            "A peak is as predicted where measured and predicted change differ by no more than "
            "the root of the sum of both half widths squared (95 %)."
        )
    of_vehicles = one_side = ""
    if not isinstance(expected, str):
        verdicts = vehicles["verdict"]
        as_expected = int((verdicts == AS_EXPECTED).sum())
        how_many = decided if undecided else f"{as_expected} of {len(vehicles)}"
        of_vehicles = (
            f"{how_many} vehicles changed as expected: {signed(changes[0], 1)} dB measured on "
            f"average, {expected_on_average(expected, changes[1])}. "
        )
        one_side = one_sided_sentence(vehicles, expected)
        report.number(
            "n_as_expected", as_expected, "", "vehicles that changed as expected", headline="d"
        )
    report.assume(*drives.study.run.assumed)
    index, ears = drives.study.index, drives.study.ears
    felt = [name for row, name in enumerate(index.response_names) if row not in ears]
    if felt:
        report.warn(
            f"Not compared: {listed(tuple(felt))}, because the table of a drive has pressures."
        )
    report.answer(
        f"{of_vehicles}{decided} booming peaks changed as predicted: {' '.join(average)}.",
        one_side,
        certainty_sentence(expected),
        model_sentence(expected, changes[1]),
        sure,
        "What not to trust: parts that differ from their drawing change the result as well; "
        "characterise those that were driven.",
        f"{driven}.",
    )
    _panels(report, vehicles, peaks, run=run, folder=folder)
    report.section(
        "Measured and predicted change",
        f"{driven}; highest level within {TOLERANCE:g} Hz of each measured peak. Both half widths "
        f"are for 95 %: of the drives by Student's t, of the prediction over {DRAWS} repeats of "
        "its measurements. A difference up to the root of the sum of their squares "
        "is as predicted.",
    )
    report.table("driven", peaks, "Every booming peak with today's parts.")
    report.table("vehicles", vehicles)
    report.number("n_peaks", len(peaks), "", "booming peaks measured with today's parts")
    report.number(
        "n_as_predicted", kept, "", "booming peaks that changed as predicted", headline="d"
    )
    report.number(
        "n_not_decided",
        undecided,
        "",
        "booming peaks not decided: all where each state has a single drive",
    )
    report.number(
        "measured_change_db",
        means[0],
        "dB",
        "measured change of the booming peaks, mean",
        headline="+.1f",
    )
    report.number(
        "predicted_change_db",
        means[1],
        "dB",
        "change of the booming peaks in the model, mean",
        headline="+.1f",
    )
    report.number(
        "measured_mean_change_db",
        changes[0],
        "dB",
        "measured change of the mean level, mean of the vehicles",
    )
    report_expected_numbers(report, expected, drives.study.vehicles)
    report.inputs += sorted(path for path in folder.iterdir() if path.is_file())
    return report


def one_sided_sentence(vehicles: pd.DataFrame, expected: ExpectedChange) -> str:
    """Say that all vehicles gained more, or all less, than expected; empty where some did each.

    - `vehicles`: with measured and expected change of each.
    """
    difference = vehicles["measured change [dB]"] - vehicles["expected [dB]"]
    more = bool((difference < 0.0).all())
    if len(vehicles) < 2 or not (more or (difference > 0.0).all()):
        return ""
    mean = float(vehicles["measured change [dB]"].mean())
    end = float(expected.mean.low if more else expected.mean.high)
    beyond = end - mean if more else mean - end
    where = "inside" if beyond < -NEAR else "beyond" if beyond > NEAR else "at"
    return (
        f"All {len(vehicles)} vehicles gained {'more' if more else 'less'} than expected: their "
        f"mean of {signed(mean, 1)} dB lies {where} the interval's end of {signed(end, 1)} dB."
    )


def _panels(
    report: Report, vehicles: pd.DataFrame, peaks: pd.DataFrame, *, run: Path, folder: Path
) -> None:
    """Show each vehicle and booming peak, and what to do next."""
    of_levels = {name: 1 for name in map(str, vehicles) if name.endswith("[dB]")}
    report.panel(
        "Each vehicle",
        Table(vehicles, "", of_levels),
        "Change of the mean level. As expected: inside the interval (90 %), widened by what drives "
        "differ.",
        wide=True,
    )
    shown = ["vehicle", "frequency [Hz]", "measured change [dB]", "± measured [dB]"]
    shown += ["predicted change [dB]", "± predicted [dB]", "verdict"]
    # a verdict rests on hundredths
    decimals = {name: 2 for name in shown if name.endswith("[dB]")} | {"frequency [Hz]": 0}
    report.panel("Each booming peak", Table(peaks[shown], "", decimals), wide=True)
    run_of = run.as_posix()
    again = f"deboom driven {run_of} {folder.as_posix()}"
    report.panel(
        "What to do next",
        Step(again, "again, with a table of each drive"),
        Step("deboom characterise CAMPAIGN", "the parts that were driven, where they differ"),
        Step(f"deboom listen {run_of}", "hear what was predicted"),
    )
