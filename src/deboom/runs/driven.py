"""Did the prototype do what was predicted? Pressures of a drive with today's and new parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import t

from deboom.arrays import ComplexArray, RealArray
from deboom.choices import Pick
from deboom.errors import InputError
from deboom.files.front_run import SupplierStudy
from deboom.files.function_table import TABLE_ENDINGS, read_function_table
from deboom.files.uncertain_index import uncertain_index
from deboom.physics.sound_level import spl
from deboom.plot.style import signed
from deboom.report import Report
from deboom.runs.rebuilt import supplier_study
from deboom.runs.runner import run_command
from deboom.vehicles.booming_peaks import TOLERANCE, booming_peaks

QUESTION = "Did the prototype do what was predicted, at every booming peak?"
DRAWS = 64
"""Repeated measurements that the uncertainty of the prediction is drawn from."""
STATES = ("today", "new")
AS_PREDICTED, OTHERWISE = "as predicted", "not as predicted"


def driven_into_run(
    run: Path, folder: Path, *, pick: Pick, out: Path, studies: Path | None, seed: int
) -> Path:
    """Hold the measured change of a prototype against the predicted one, and write its run folder.

    Parameters
    ----------
    run : Path
        Finished run of a front study.
    folder : Path
        ``today*`` and ``new*``: pressure tables of one drive each (csv, xlsx, mat), with the lines
        ``frequency [Hz]`` and for each vehicle ``<vehicle> real [Pa]``, ``<vehicle> imag [Pa]``,
        complex peak of the order at the driver's ear in the run's first load case.
    pick : Pick
        Design that was built.
    out, studies
        As for every command.
    seed : int
        Of the draws of the prediction's uncertainty, from 1.

    Returns
    -------
    Path
        The run folder, ``<out>/driven/<run>/``.

    Raises
    ------
    InputError
        No table of a state; lines or vehicles that are missing; another unit than Pa; no booming
        peak with today's parts; the run, as `supplier_study`.
    """
    study = supplier_study(run, studies, pick)
    measured = {state: _levels(study, folder, state) for state in STATES}
    record = {
        "study": "driven",
        "question": QUESTION,
        "seed": seed,
        "command": f"deboom driven {run.as_posix()} {folder.as_posix()}",
        "arguments": {"design": pick.value, "seed": seed},
    }
    return run_command(
        out, record, lambda: _report(study, measured, folder, seed), relative_to=Path.cwd()
    )


def _levels(study: SupplierStudy, folder: Path, state: str) -> RealArray:
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


def _report(
    study: SupplierStudy, measured: dict[str, RealArray], folder: Path, seed: int
) -> Report:
    """Compare the changes at every booming peak that was measured with today's parts."""
    index, frequency = study.index, np.asarray(study.index.frequency)
    both = np.stack([study.space.nominal, study.picked])
    predicted = index.levels(both)
    again = uncertain_index(index, study.platform, study.parts).draws(DRAWS, seed)
    drawn = np.stack([model.levels(both) for model in again])
    order = study.load_cases[0][0].order
    rows = []
    for row, vehicle in enumerate(study.vehicles):
        mean = measured["today"][:, row].mean(axis=0)
        for peak in booming_peaks(mean, frequency, order):
            found = {s: _at_peak(measured[s][:, row], frequency, peak.frequency) for s in STATES}
            old, new = _at_peak(predicted[:, row], frequency, peak.frequency)
            spread = np.diff(_at_peak(drawn[:, :, row], frequency, peak.frequency), axis=1)
            change = float(found["new"].mean() - found["today"].mean())
            limits = (_half_width(*found.values()), 1.96 * float(spread.std(ddof=1)))
            allowed = float(np.hypot(*np.nan_to_num(limits)))
            rows.append(
                {
                    "vehicle": vehicle,
                    "frequency [Hz]": peak.frequency,
                    "measured today [dB(A)]": float(found["today"].mean()),
                    "predicted today [dB(A)]": float(old),
                    "measured change [dB]": change,
                    "± measured [dB]": limits[0],
                    "predicted change [dB]": float(new - old),
                    "± predicted [dB]": limits[1],
                    "verdict": AS_PREDICTED if abs(change - new + old) <= allowed else OTHERWISE,
                }
            )
    if not rows:
        raise InputError(f"{folder}: no vehicle has a booming peak with today's parts")
    table = pd.DataFrame(rows)
    kept = int((table["verdict"] == AS_PREDICTED).sum())
    means = [float(table[f"{what} change [dB]"].mean()) for what in ("measured", "predicted")]
    report = Report("The prototype, driven", QUESTION)
    report.tile(f"{kept} of {len(table)}", "booming peaks changed as predicted")
    report.tile(
        f"{signed(means[0], 1)} dB", f"measured on average, {signed(means[1], 1)} predicted"
    )
    drives = [len(measured[state]) for state in STATES]
    if min(drives) == 1 and sum(drives) < 3:
        report.warn("One drive each: the uncertainty of the measured change is not known.")
    report.section(
        "Measured and predicted change",
        f"{drives[0]} drives with today's parts, {drives[1]} with {study.pick.value}; highest "
        f"level within {TOLERANCE:g} Hz of each measured peak. Both half widths are for 95 %: of "
        f"the drives by Student's t, of the prediction over {DRAWS} repeats of its measurements. "
        "A difference within both together is as predicted. Prototypes that differ from their "
        "drawing show here too: characterise the parts that were driven.",
    )
    report.table("driven", table, "Every booming peak with today's parts.")
    report.summary |= {"n_peaks": len(table), "n_as_predicted": kept}
    report.summary |= {"measured_change_db": means[0], "predicted_change_db": means[1]}
    report.inputs += sorted(path for path in folder.iterdir() if path.is_file())
    return report


def _half_width(first: RealArray, second: RealArray) -> float:
    """Half width of the difference of two means at 95 % by pooled repeats; nan without [dB]."""
    degrees = len(first) + len(second) - 2
    if degrees < 1:
        return float("nan")
    squares = sum(float(((one - one.mean()) ** 2).sum()) for one in (first, second))
    error = np.sqrt(squares / degrees * (1 / len(first) + 1 / len(second)))
    return float(t.ppf(0.975, degrees) * error)
