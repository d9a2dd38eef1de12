"""Compare a driven prototype with its prediction, for each vehicle and booming peak.

FOLDER has one table per drive (csv, xlsx or mat): today*.csv with today's parts, new*.csv with the
new parts. The columns are frequency [Hz] and, for each vehicle, <vehicle> real [Pa] and <vehicle>
imag [Pa]: the complex peak amplitude of the order at the driver's ear, in the first load case of
the run. Two or more drives of a state show how certain the measured change is.

Keys of summary.json: n_peaks (booming peaks that were measured with today's parts),
n_as_predicted, n_not_decided (all peaks if each state has a single drive, else 0);
measured_change_db, predicted_change_db (means over the peaks).
"""

from __future__ import annotations

from dataclasses import dataclass
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
from deboom.physics.sound_level import spl
from deboom.plot.style import signed
from deboom.report import Report, Step, Table
from deboom.runs.options import StudiesFolder
from deboom.runs.rebuilt import supplier_study
from deboom.vehicles.booming_peaks import TOLERANCE, booming_peaks

QUESTION = "Did the prototype do what was predicted, at every booming peak?"
DRAWS = 64
"""Repeated measurements that the uncertainty of the prediction is drawn from."""
STATES = ("today", "new")
AS_PREDICTED, OTHERWISE, OPEN = "as predicted", "not as predicted", "not decided"


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
    kept, undecided = (int((table["verdict"] == word).sum()) for word in (AS_PREDICTED, OPEN))
    means = [float(table[f"{what} change [dB]"].mean()) for what in ("measured", "predicted")]
    drives = [len(model.measured[state]) for state in STATES]
    driven = (
        f"{drives[0]} drives with today's parts, {drives[1]} with {design_name(model.study.pick)}"
    )
    report = Report("The prototype, driven", QUESTION)
    average = f"{signed(means[0], 1)} dB", f"measured on average, {signed(means[1], 1)} predicted"
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
        sure = "How sure: both half widths hold 95 %; a difference within both is as predicted."
    report.assume(*model.study.run.assumed)
    report.tile(*average)
    report.answer(
        f"{decided} booming peaks changed as predicted: {' '.join(average)}.", sure, f"{driven}."
    )
    _panels(report, table, options)
    report.section(
        "Measured and predicted change",
        f"{driven}; highest level within {TOLERANCE:g} Hz of each measured peak. Both half widths "
        f"are for 95 %: of the drives by Student's t, of the prediction over {DRAWS} repeats of "
        "its measurements. A difference within both together is as predicted. Differences between "
        "prototype and drawing appear here as well: characterise the parts that were driven.",
    )
    report.table("driven", table, "Every booming peak with today's parts.")
    report.summary |= {"n_peaks": len(table), "n_as_predicted": kept, "n_not_decided": undecided}
    report.summary |= {"measured_change_db": means[0], "predicted_change_db": means[1]}
    report.inputs += sorted(path for path in folder.iterdir() if path.is_file())
    return report


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


def _panels(report: Report, table: pd.DataFrame, options: Options) -> None:
    """Show each booming peak, and what to do next."""
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
