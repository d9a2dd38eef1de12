"""Compare a driven prototype with what was expected of it, for each vehicle and booming peak.

FOLDER has one table per drive (csv, xlsx or mat): today*.csv with today's parts, new*.csv with the
new parts. The columns are frequency [Hz] and, for each vehicle, <vehicle> real [Pa] and <vehicle>
imag [Pa]: the complex peak amplitude of the order at the driver's ear, in the first load case of
the run; a further ear has its own, such as U06-1, rear ear real [Pa]. Two or more drives of a state
show how certain the measured change is.
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
from deboom.errors import InputError
from deboom.explore.choices import Pick, pick_or_file
from deboom.files.function_table import TABLE_ENDINGS, read_function_table
from deboom.files.uncertain_index import uncertain_index
from deboom.measurement.booming_peaks import TOLERANCE, booming_peaks
from deboom.pages.driven import (
    AS_EXPECTED,
    AS_PREDICTED,
    DRAWS,
    NOT_AS_EXPECTED,
    OPEN,
    OTHERWISE,
    STATES,
    Drives,
    driven_report,
)
from deboom.pages.supplier_study import SupplierStudy
from deboom.physics.sound_level import spl
from deboom.report import Report
from deboom.runs.options import StudiesFolder
from deboom.runs.rebuilt import supplier_study
from deboom.vehicles.expected_change import ExpectedChange, expected_or_why

QUESTION = "Did the prototype do what was expected, in every vehicle and at every booming peak?"


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


def prepare(options: Options) -> Drives:
    """Build the run's model again, and read what was measured."""
    try:
        pick = pick_or_file(options.design)
    except ValueError as error:
        raise InputError(f"--design {error}") from error
    study = supplier_study(options.run, options.studies, pick)
    return Drives(
        study, {state: levels_of_drives(study, options.folder, state) for state in STATES}
    )


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


def run(drives: Drives, options: Options) -> Report:
    """Compare the changes at every booming peak that was measured with today's parts."""
    folder, peaks = options.folder, _peak_table(drives, options.seed)
    if peaks.empty:
        raise InputError(f"{folder}: no vehicle has a booming peak with today's parts")
    expected = _expected(drives.study, options.seed)
    return driven_report(
        drives,
        expected,
        vehicles=_vehicle_table(drives, expected),
        peaks=peaks,
        question=QUESTION,
        run=options.run,
        folder=folder,
    )


def _expected(study: SupplierStudy, seed: int) -> ExpectedChange | str:
    """State what is expected of the design in the load case that was driven; or why nothing is."""
    first = replace(study.index, cases=study.index.cases[:1], weights=(1.0,))
    uncertain = uncertain_index(first, study.platform, study.parts)
    return expected_or_why(
        first,
        lambda: uncertain.expected_change(study.picked, seed=seed).at(study.ears).of(0),
    )


def _vehicle_table(drives: Drives, expected: ExpectedChange | str) -> pd.DataFrame:
    """Tabulate the change of each vehicle's mean level: measured, expected, and by the model.

    As expected is a change that lies in its interval, widened by the half width of the drives.
    """
    study = drives.study
    today, new = (drives.measured[state].mean(axis=-1) for state in STATES)
    change = new.mean(axis=0) - today.mean(axis=0)
    half = np.array([_half_width(*pair) for pair in zip(today.T, new.T, strict=True)])
    designs = np.stack([study.space.nominal, study.picked])
    levels = study.index.levels(designs)[:, study.ears].mean(axis=-1)
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


def _peak_table(drives: Drives, seed: int) -> pd.DataFrame:
    """Tabulate the measured and the predicted change of every booming peak, with half widths."""
    study, measured = drives.study, drives.measured
    index, frequency = study.index, np.asarray(study.index.frequency)
    both = np.stack([study.space.nominal, study.picked])
    predicted = index.levels(both)[:, study.ears]
    again = uncertain_index(index, study.platform, study.parts).draws(DRAWS, seed)
    drawn = np.stack([repeated.levels(both)[:, study.ears] for repeated in again])
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


def _half_width(first: RealArray, second: RealArray) -> float:
    """Half width of the difference of two means at 95 % by pooled repeats; nan without [dB]."""
    degrees = len(first) + len(second) - 2
    if degrees < 1:
        return float("nan")
    squares = sum(float(((levels - levels.mean()) ** 2).sum()) for levels in (first, second))
    error = np.sqrt(squares / degrees * (1 / len(first) + 1 / len(second)))
    return float(t.ppf(0.975, degrees) * error)
