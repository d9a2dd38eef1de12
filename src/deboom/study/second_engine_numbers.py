"""Predicted against measured forces of a second engine, direction by direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray
from deboom.mounts.agreement import r_squared
from deboom.mounts.mount_state import MountState
from deboom.study.result import Scalar
from deboom.study.second_engine import Prediction, SecondEngine

BY_KINEMATICS = "static force by the kinematic model"


def direction_numbers(engines: Sequence[SecondEngine]) -> pd.DataFrame:
    """Return a row per bench and direction; ratios as such, errors [1], levels [dB], forces [N]."""
    return pd.DataFrame([_row(one, name) for one in engines for name in one.directions])


def preload_numbers(engines: Sequence[SecondEngine]) -> pd.DataFrame:
    """Return rms error of the force [1] per bench, direction and preload variable."""
    rows = []
    for one in engines:
        by_state = {state.value: found for state, found in one.predictions.items()}
        for label, found in (*by_state.items(), (BY_KINEMATICS, one.by_kinematics)):
            rows += [
                {
                    "bench": one.title,
                    "direction": name,
                    "preload": label,
                    "error": force_error(prediction),
                    "inside": float(np.mean(prediction.inside)),
                }
                for name, prediction in found.items()
            ]
    return pd.DataFrame(rows)


def force_error(prediction: Prediction) -> float:
    """Rms of the force error over that of the force, at the lines inside [1]; nan if none is."""
    if not prediction.inside.any():
        return float("nan")
    error = np.mean(np.abs(prediction.force - prediction.measured) ** 2)
    return float(np.sqrt(error / np.mean(np.abs(prediction.measured) ** 2)))


def peak_difference(prediction: Prediction) -> float:
    """Largest difference of the highest force of a run, predicted over measured [dB].

    With its sign, at the lines inside; nan if there is none.
    """
    runs = prediction.lines.run[prediction.inside]
    differences = [
        20
        * np.log10(
            np.abs(prediction.force[runs == run]).max()
            / np.abs(prediction.measured[runs == run]).max()
        )
        for run in np.unique(runs)
    ]
    return float(max(differences, key=abs, default=np.nan))


def force_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """List what came out per direction, median over the benches."""
    by = numbers.groupby("direction", sort=False)
    table = pd.DataFrame(
        {
            "identified": np.where(by["identified"].mean() > 0.5, "identified", "not identified"),
            "lines inside [%]": 100 * by["inside"].median(),
            "R² of Re F [%]": 100 * by["r2_real"].median(),
            "R² of Im F [%]": 100 * by["r2_imag"].median(),
            "rms error of F [%]": 100 * by["error"].median(),
            "peak of F [dB]": by["peak"].median(),
            "95 % half width of library K [%]": 100 * by["half_width"].median(),
            "rms error of K against truth [%]": 100 * by["truth_error"].median(),
            "static force, model against cells [N]": by["static_difference"].median(),
        },
        index=list(by.groups),
    )
    return table.rename_axis("direction").reset_index().dropna(axis="columns", how="all")


def preload_table(numbers: pd.DataFrame) -> pd.DataFrame:
    """List the rms error of the force by preload variable, median over the benches."""
    median = numbers.groupby(["direction", "preload"], sort=False)["error"].median().unstack()
    order = [*(state.value for state in MountState), BY_KINEMATICS]
    directions = numbers["direction"].drop_duplicates()
    table = 100 * median.reindex(index=directions, columns=[c for c in order if c in median])
    return table.rename(columns=lambda name: f"{name} [%]").rename_axis("direction").reset_index()


def second_engine_summary(
    engines: Sequence[SecondEngine], numbers: pd.DataFrame
) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    keys: Mapping[str, tuple[str, float]] = {
        "r2_force_real": ("r2_real", 100.0),
        "r2_force_imag": ("r2_imag", 100.0),
        "rms_force_percent": ("error", 100.0),
        "peak_db": ("peak", 1.0),
        "inside_percent": ("inside", 100.0),
        "truth_error_percent": ("truth_error", 100.0),
        "static_difference_n": ("static_difference", 1.0),
    }
    by = numbers.groupby("direction", sort=False)
    summary: dict[str, Scalar] = {"n_benches": len(engines)}
    for key, (column, factor) in keys.items():
        for name, value in by[column].median().dropna().items():
            summary[f"{key}_{str(name).replace(' ', '_')}"] = float(factor * value)
    summary["seconds"] = round(float(np.median([one.seconds for one in engines])), 3)
    return summary


def _row(engine: SecondEngine, name: str) -> dict[str, object]:
    prediction = engine.predictions[MountState.MAIN_FORCE][name]
    quality = engine.mount_of(name).direction(name.rpartition(" ")[2]).quality
    measured, force = prediction.measured, prediction.force
    several = measured.size > 1
    half_width = np.nan if quality.half_width_95 is None else quality.half_width_95
    return {
        "bench": engine.title,
        "direction": name,
        "identified": float(quality.identified),
        "inside": float(np.mean(prediction.inside)),
        "r2_real": r_squared(measured.real, force.real) if several else np.nan,
        "r2_imag": r_squared(measured.imag, force.imag) if several else np.nan,
        "error": force_error(prediction),
        "peak": peak_difference(prediction),
        "half_width": half_width,
        "truth_error": _truth_error(engine, prediction),
        "static_difference": _static_difference(engine, name),
    }


def _truth_error(engine: SecondEngine, prediction: Prediction) -> float:
    if engine.truth is None or not prediction.inside.any():
        return float("nan")
    lines = prediction.lines.select(prediction.inside)
    true: ComplexArray = engine.truth.at(lines)
    ratio = np.abs(prediction.stiffness[prediction.inside]) / np.abs(true)
    return float(np.sqrt(np.mean((ratio - 1) ** 2)))


def _static_difference(engine: SecondEngine, name: str) -> float:
    """Rms difference between model and cells along the main axis of the mount [N]."""
    measured = engine.maps[name].static_force
    main = name in engine.static_force and name == engine.main_direction(name)
    return (
        float(np.sqrt(np.mean((engine.static_force[name] - measured) ** 2)))
        if main
        else float("nan")
    )
