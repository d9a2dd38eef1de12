"""Compare a driven prototype with what was expected of it, for each vehicle and booming peak.

FOLDER has one table per drive (csv, xlsx or mat): today*.csv with today's parts, new*.csv with the
new parts. The columns are frequency [Hz] and, for each vehicle, <vehicle> real [Pa] and <vehicle>
imag [Pa]: the complex peak amplitude of the order at the driver's ear, in the first load case of
the run. Two or more drives of a state show how certain the measured change is.

Keys of summary.json: n_as_expected (vehicles whose mean level changed as expected);
measured_mean_change_db (of the mean level, mean of the vehicles); expected_change_db_<vehicle>,
expected_change_db_mean, expected_change_db_worst, the same with _low and _high (90 %); n_peaks
(booming peaks that were measured with today's parts), n_as_predicted, n_not_decided (all peaks if
each state has a single drive, else 0); measured_change_db, predicted_change_db (means over the
peaks, predicted by the model).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from scipy.stats import t
from typer import Argument, Option

from deboom.arrays import ComplexArray, RealArray
from deboom.choices import Pick, pick_or_file
from deboom.errors import InputError
from deboom.files.front_run import SupplierStudy, design_name
from deboom.files.function_table import TABLE_ENDINGS, read_function_table
from deboom.files.uncertain_index import uncertain_index
from deboom.measurement.booming_peaks import TOLERANCE, booming_peaks
from deboom.pages.front_answer import (
    expected_numbers,
    expected_on_average,
    expected_sentence,
)
from deboom.physics.sound_level import spl
from deboom.plot.style import signed
from deboom.report import Report, Step, Table
from deboom.runs.options import StudiesFolder
from deboom.runs.rebuilt import supplier_study
from deboom.vehicles.expected_change import ExpectedChange, expected_or_why

QUESTION = "Did the prototype do what was expected, in every vehicle and at every booming peak?"
DRAWS = 64
"""Repeated measurements that the uncertainty of the prediction is drawn from."""
STATES = ("today", "new")
AS_PREDICTED, OTHERWISE, OPEN = "as predicted", "not as predicted", "not decided"
AS_EXPECTED, NOT_AS_EXPECTED = "as expected", "not as expected"


@dataclass(frozen=True)
class Options:
    """Which run is compared with which drives."""

    run: Annotated[Path, Argument(help="Folder of a finished front study.")]
    folder: Annotated[
        Path, Argument(help="Folder with measured pressures, today*.csv and new*.csv.")
    ]
    design: Annotated[
        str,
        Option(
            metavar="PICK|FILE", help=f"The built design: {', '.join(Pick)}; or a file of designs."
        ),
    ] = Pick.best_mean.value
    studies: StudiesFolder = None
    seed: Annotated[int, Option(help="Seed of the draws, 1 or higher.")] = 1


@dataclass(frozen=True, eq=False)
class Model:
    """The front study of the run, and levels of every drive by state, (n_drive, v, f) [dB(A)]."""

    study: SupplierStudy
    measured: dict[str, RealArray]


def prepare(options: Options) -> Model:
    """Build the run's model again, and read what was measured."""
    try:
        pick = pick_or_file(options.design)
    except ValueError as error:
        raise InputError(f"--design {error}") from error
    study = supplier_study(options.run, options.studies, pick)
    return Model(study, {state: levels_of_drives(study, options.folder, state) for state in STATES})


def levels_of_drives(study: SupplierStudy, folder: Path, state: str) -> RealArray:
    """Levels of every drive with a state of the parts, shape (n_drive, v, f) [dB(A)]."""
    paths = [p for p in sorted(folder.glob(f"{state}*")) if p.suffix.lower() in TABLE_ENDINGS]
    if not paths:
        raise InputError(
            f"{folder} has no table {state}*: export the pressure at the driver's ear as "
            f"{state}.csv, one file per drive"
        )
    return np.stack([spl(_pressure(study, path), study.index.frequency, axis=-1) for path in paths])


def _pressure(study: SupplierStudy, path: Path) -> ComplexArray:
    """Pressure of the vehicles at the lines of the run, shape (v, f) [Pa]."""
    table, lines = read_function_table(path), np.asarray(study.index.frequency)
    at = np.abs(table.frequency - lines[:, np.newaxis]).argmin(axis=1)
    far = np.flatnonzero(np.abs(table.frequency[at] - lines) > 1e-6 * lines)
    if far.size:
        raise InputError(
            f"{path}: the line {lines[far[0]]:g} Hz of run {study.run.entry.name} is missing: "
            "track the order at the lines of the platform, nothing is interpolated here"
        )
    rows = []
    for vehicle in study.vehicles:
        if vehicle not in table.functions:
            raise InputError(
                f"{path}: there are no columns '{vehicle} real [Pa]' and '{vehicle} imag [Pa]'"
            )
        unit, values = table.spectrum(vehicle)
        if unit.label != "Pa":
            raise InputError(f"{path}: {vehicle} is in {unit.label}: give a pressure in Pa")
        rows.append(values[at])
    return np.stack(rows)


def _at_peak(levels: RealArray, frequency: RealArray, peak: float) -> RealArray:
    """Highest level near a peak of levels (..., f), shape (...) [dB(A)]."""
    return np.asarray(levels[..., np.abs(frequency - peak) <= TOLERANCE].max(axis=-1))


def run(model: Model, options: Options) -> Report:
    """Compare the changes at every booming peak that was measured with today's parts."""
    folder, table = options.folder, _peak_table(model, options.seed)
    if table.empty:
        raise InputError(f"{folder}: no vehicle has a booming peak with today's parts")
    expected = _expected(model.study, options.seed)
    vehicles = _vehicle_table(model, expected)
    kept, undecided = (int((table["verdict"] == word).sum()) for word in (AS_PREDICTED, OPEN))
    means = [float(table[f"{what} change [dB]"].mean()) for what in ("measured", "predicted")]
    changes = [float(vehicles[f"{what} [dB]"].mean()) for what in ("measured change", "model")]
    drives = [len(model.measured[state]) for state in STATES]
    driven = (
        f"{drives[0]} drives with today's parts, {drives[1]} with {design_name(model.study.pick)}"
    )
    report = Report("The prototype, driven", QUESTION)
    average = (
        f"{signed(means[0], 1)} dB",
        f"measured on average, {signed(means[1], 1)} in the model",
    )
    count = f"{kept} of {len(table)}"
    if undecided:
        report.warn("One drive each: the uncertainty of the measured change is not known.")
        report.tile("not decided", "one drive of each state does not say how far drives differ")
        decided = "Not decided whether"
        sure = (
            "One drive of each state does not say how far drives differ: drive each twice or more."
        )
    else:
        report.tile(count, "booming peaks changed as predicted")
        decided = count
        sure = (
            "Peaks: both half widths hold 95 %; a difference within both is as predicted by the "
            "model."
        )
    of_vehicles = ""
    if not isinstance(expected, str):
        verdicts = vehicles["verdict"]
        as_expected = int((verdicts == AS_EXPECTED).sum())
        how_many = decided if undecided else f"{as_expected} of {len(vehicles)}"
        of_vehicles = (
            f"{how_many} vehicles changed as expected: {signed(changes[0], 1)} dB measured on "
            f"average, {expected_on_average(expected, changes[1])}. "
        )
        report.summary["n_as_expected"] = as_expected
    report.assume(*model.study.run.assumed)
    report.tile(*average)
    report.answer(
        f"{of_vehicles}{decided} booming peaks changed as predicted: {' '.join(average)}.",
        expected_sentence(expected, changes[1]),
        sure,
        f"{driven}.",
    )
    _panels(report, vehicles, table, options)
    report.section(
        "Measured and predicted change",
        f"{driven}; highest level within {TOLERANCE:g} Hz of each measured peak. Both half widths "
        f"are for 95 %: of the drives by Student's t, of the prediction over {DRAWS} repeats of "
        "its measurements. A difference within both together is as predicted. Differences between "
        "prototype and drawing appear here as well: characterise the parts that were driven.",
    )
    report.table("driven", table, "Every booming peak with today's parts.")
    report.table("vehicles", vehicles)
    report.summary |= {"n_peaks": len(table), "n_as_predicted": kept, "n_not_decided": undecided}
    report.summary |= {"measured_change_db": means[0], "predicted_change_db": means[1]}
    report.summary["measured_mean_change_db"] = changes[0]
    report.summary |= expected_numbers(expected, model.study.vehicles)
    report.inputs += sorted(path for path in folder.iterdir() if path.is_file())
    return report


def _expected(study: SupplierStudy, seed: int) -> ExpectedChange | str:
    """State what is expected of the design in the load case that was driven; or why nothing is."""
    first = replace(study.index, cases=study.index.cases[:1], weights=(1.0,))
    uncertain = uncertain_index(first, study.platform, study.parts)
    return expected_or_why(first, lambda: uncertain.expected_change(study.picked, seed=seed).of(0))


def _vehicle_table(model: Model, expected: ExpectedChange | str) -> pd.DataFrame:
    """Tabulate the change of each vehicle's mean level: measured, expected, and by the model.

    As expected is a change that lies in its interval, widened by the half width of the drives.
    """
    study = model.study
    today, new = (model.measured[state].mean(axis=-1) for state in STATES)
    change = new.mean(axis=0) - today.mean(axis=0)
    half = np.array([_half_width(*pair) for pair in zip(today.T, new.T, strict=True)])
    levels = study.index.levels(np.stack([study.space.nominal, study.picked])).mean(axis=-1)
    table = pd.DataFrame(
        {"vehicle": study.vehicles, "measured change [dB]": change, "± measured [dB]": half}
    )
    if not isinstance(expected, str):
        cars = expected.cars
        table = table.assign(
            **{"expected [dB]": cars.expected, "from [dB]": cars.low, "to [dB]": cars.high}
        )
        beyond = np.maximum(cars.low - change, change - cars.high)
        verdicts = np.where(beyond <= half, AS_EXPECTED, NOT_AS_EXPECTED)
        table["verdict"] = np.where(np.isnan(half), OPEN, verdicts)
    table["model [dB]"] = levels[1] - levels[0]
    return table


def _peak_table(model: Model, seed: int) -> pd.DataFrame:
    """Tabulate the measured and the predicted change of every booming peak, with half widths."""
    study, measured = model.study, model.measured
    index, frequency = study.index, np.asarray(study.index.frequency)
    both = np.stack([study.space.nominal, study.picked])
    predicted = index.levels(both)
    again = uncertain_index(index, study.platform, study.parts).draws(DRAWS, seed)
    drawn = np.stack([repeated.levels(both) for repeated in again])
    order = study.load_cases[0][0].order
    rows = []
    for row, vehicle in enumerate(study.vehicles):
        mean = measured["today"][:, row].mean(axis=0)
        for peak in booming_peaks(mean, frequency, order):
            today, new = (_at_peak(measured[s][:, row], frequency, peak.frequency) for s in STATES)
            before, after = _at_peak(predicted[:, row], frequency, peak.frequency)
            spread = np.diff(_at_peak(drawn[:, :, row], frequency, peak.frequency), axis=1)
            change = float(new.mean() - today.mean())
            limits = (_half_width(today, new), 1.96 * float(spread.std(ddof=1)))
            rows.append(
                {
                    "vehicle": vehicle,
                    "frequency [Hz]": peak.frequency,
                    "measured today [dB(A)]": float(today.mean()),
                    "predicted today [dB(A)]": float(before),
                    "measured change [dB]": change,
                    "± measured [dB]": limits[0],
                    "predicted change [dB]": float(after - before),
                    "± predicted [dB]": limits[1],
                    "verdict": _verdict(change - after + before, *limits),
                }
            )
    return pd.DataFrame(rows)


def _verdict(difference: float, measured: float, predicted: float) -> str:
    """Judge a difference by both half widths [dB]; that of the drives is nan where none tells."""
    if np.isnan(measured):
        return OPEN
    return AS_PREDICTED if abs(difference) <= np.hypot(measured, predicted) else OTHERWISE


def _panels(report: Report, vehicles: pd.DataFrame, table: pd.DataFrame, options: Options) -> None:
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
    decimals = {name: 1 for name in shown if name.endswith("[dB]")} | {"frequency [Hz]": 0}
    report.panel("Each booming peak", Table(table[shown], "", decimals), wide=True)
    run_of = options.run.as_posix()
    again = f"deboom driven {run_of} {options.folder.as_posix()}"
    report.panel(
        "What to do next",
        Step(again, "again, with a table of each drive"),
        Step("deboom characterise CAMPAIGN", "the parts that were driven, where they differ"),
        Step(f"deboom listen {run_of}", "hear what was predicted"),
    )


def _half_width(first: RealArray, second: RealArray) -> float:
    """Half width of the difference of two means at 95 % by pooled repeats; nan without [dB]."""
    degrees = len(first) + len(second) - 2
    if degrees < 1:
        return float("nan")
    squares = sum(float(((levels - levels.mean()) ** 2).sum()) for levels in (first, second))
    error = np.sqrt(squares / degrees * (1 / len(first) + 1 / len(second)))
    return float(t.ppf(0.975, degrees) * error)
