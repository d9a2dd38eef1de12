"""Tables and headline numbers of a mount characterisation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from deboom.mounts.alignment import ErrorSource
from deboom.study.characterisation import CharacterisedBench
from deboom.study.characterisation_motion import neighbours
from deboom.study.characterisation_numbers import identified, over_benches
from deboom.study.result import Scalar

THESIS_R2 = {
    "EnM x": (99.978, 99.665, 99.975, 99.614),
    "EnM y": (60.865, 69.366, 87.228, 68.713),
    "EnM z": (99.249, 88.197, 99.518, 82.635),
    "GeM x": (99.654, 99.441, 99.794, 99.612),
    "GeM y": (92.474, 74.168, 92.146, 85.348),
    "GeM z": (99.441, 98.691, 99.612, 98.726),
    "TSM x": (99.976, 99.828, 99.975, 99.874),
    "TSM y": (99.912, 97.146, 99.949, 94.955),
    "TSM z": (99.969, 99.204, 99.976, 99.710),
}
"""Thesis, tables 6 to 8: R² of Re K, Im K, Re F, Im F [%]."""


def r2_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """R² of the surfaces per direction and part, median over benches, beside the thesis."""
    rows = []
    for place, (part, column) in enumerate((("real", "real"), ("imaginary", "imag"))):
        own, force, check, check_force = (
            over_benches(numbers, f"{prefix}_{column}")
            for prefix in ("r2", "r2_force", "check_r2", "check_r2_force")
        )
        for name in own.index:
            thesis = THESIS_R2.get(name, (np.nan,) * 4)
            rows.append(
                {
                    "direction": name,
                    "part": part,
                    "R² of stiffness [%]": own[name],
                    "thesis, stiffness [%]": thesis[place],
                    "R² of force [%]": force[name],
                    "thesis, force [%]": thesis[2 + place],
                    "held-out R² of stiffness [%]": check[name],
                    "held-out R² of force [%]": check_force[name],
                }
            )
    order = {name: place for place, name in enumerate(numbers["direction"].drop_duplicates())}
    return pd.DataFrame(rows).sort_values(
        "direction", key=lambda names: names.map(order), kind="stable", ignore_index=True
    )


def truth_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """Rms error of the surfaces against the bench's truth, over the benches."""
    columns = {
        "error of |K|, median [%]": over_benches(numbers, "error"),
        "error of |K|, 90 % [%]": over_benches(numbers, "error", 0.9),
        "error of Im K, median [%]": over_benches(numbers, "error_imag"),
        "held-out error of |K|, median [%]": over_benches(numbers, "check_error"),
        "held-out error of |K|, 90 % [%]": over_benches(numbers, "check_error", 0.9),
        "without self-calibration, median [%]": over_benches(numbers, "error_stated"),
        "without self-calibration, 90 % [%]": over_benches(numbers, "error_stated", 0.9),
    }
    return _by_direction(columns)


def uncertainty_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """List what the error budget makes of every direction, median over the benches."""
    columns = {
        "95 % half width of |K| [%]": over_benches(numbers, "half_width"),
        "95 % half width of Im K [%]": over_benches(numbers, "half_width_imag"),
        "without self-calibration [%]": over_benches(numbers, "half_width_stated"),
        "misfit of the surface [%]": over_benches(numbers, "misfit"),
        "repeatability of a line [%]": over_benches(numbers, "repeatability"),
        "truth inside the band [%]": _mean(numbers, "coverage"),
    }
    for source in ErrorSource:
        columns[f"{source.value} alone [%]"] = over_benches(numbers, source.value)
    table = _by_direction(columns)
    found = identified(numbers).to_numpy()
    table.insert(1, "identified", np.where(found, "identified", "not identified"))
    return table


def all_gears_table(numbers: pd.DataFrame, all_gears: pd.DataFrame) -> pd.DataFrame:
    """Surfaces over the chosen gears beside those over all gears with cross-validated pieces."""
    pieces = over_benches(all_gears, "pieces") / 100.0
    columns = {"pieces over all gears": pieces}
    for label, column in (
        ("R² of Re K", "r2_real"),
        ("R² of Im K", "r2_imag"),
        ("error of |K|", "error"),
    ):
        columns[f"{label}, chosen gears [%]"] = over_benches(numbers, column)
        columns[f"{label}, all gears [%]"] = over_benches(all_gears, column)
    return _by_direction(columns)


def neighbour_table(bench: CharacterisedBench) -> pd.DataFrame:
    """Stiffness error where a sensor beside the mount stands for its virtual point."""
    rows = [
        {
            "direction": one.direction,
            "sensor": one.sensor,
            "rms error of |K| [%]": 100.0 * float(np.sqrt(np.mean(one.error**2))),
            "median error of |K| [%]": 100.0 * float(np.median(one.error)),
        }
        for one in neighbours(bench)
    ]
    columns = ["direction", "sensor", "rms error of |K| [%]", "median error of |K| [%]"]
    return pd.DataFrame(rows, columns=columns)


def characterisation_summary(
    benches: Sequence[CharacterisedBench], numbers: pd.DataFrame
) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    by_key = {
        "r2_real": over_benches(numbers, "r2_real"),
        "r2_imag": over_benches(numbers, "r2_imag"),
        "r2_force_real": over_benches(numbers, "r2_force_real"),
        "r2_force_imag": over_benches(numbers, "r2_force_imag"),
        "r2_real_held_out": over_benches(numbers, "check_r2_real"),
        "r2_imag_held_out": over_benches(numbers, "check_r2_imag"),
        "truth_error_percent": over_benches(numbers, "error"),
        "truth_error_percent_90": over_benches(numbers, "error", 0.9),
        "truth_error_percent_held_out": over_benches(numbers, "check_error"),
        "truth_error_percent_stated": over_benches(numbers, "error_stated"),
        "half_width_95_percent": over_benches(numbers, "half_width"),
        "coverage_95_percent": _mean(numbers, "coverage"),
    }
    summary: dict[str, Scalar] = {"n_benches": len(benches)}
    for key, values in by_key.items():
        for name, value in values.dropna().items():
            summary[f"{key}_{str(name).replace(' ', '_')}"] = float(value)
    summary["n_identified"] = int(identified(numbers).sum())
    summary["seconds"] = round(float(np.median([bench.seconds for bench in benches])), 3)
    return summary


def _mean(numbers: pd.DataFrame, column: str) -> pd.Series[float]:
    """Mean over the benches in percent: that of a share of lines."""
    names = numbers["direction"].drop_duplicates().tolist()
    if column not in numbers:
        return pd.Series(np.nan, index=names)
    return 100.0 * numbers.groupby("direction", sort=False)[column].mean().reindex(names)


def _by_direction(columns: dict[str, pd.Series[float]]) -> pd.DataFrame:
    """Columns without a single known value are left out."""
    table = pd.DataFrame(columns).rename_axis("direction").reset_index()
    return table.dropna(axis="columns", how="all")
