"""Tables and headline numbers of a robust front."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom.study.result import Scalar
from deboom.study.robust_front import RobustFront

NO_REQUIREMENT = "no requirement"


def front_table(study: RobustFront) -> pd.DataFrame:
    """One row per design of the front: objectives as searched and as verified."""
    front, check = study.search.front, study.verification
    names = {row: name for name, row in reversed(study.picks.items())}
    return pd.DataFrame(
        {
            "point": np.arange(1, len(front) + 1),
            "pick": [names.get(row, "") for row in range(len(front))],
            "SPLV mean sum [dB(A)]": check.values.mean_sum,
            "SPLV sigma sum [dB]": check.values.sigma_sum,
            "standard error of mean sum [dB]": check.values.standard_error_mean_sum,
            "standard error of sigma sum [dB]": check.values.standard_error_sigma_sum,
            "SPLV mean sum in search [dB(A)]": front.mean_sum,
            "SPLV sigma sum in search [dB]": front.sigma_sum,
            "non-dominated when verified": check.nondominated,
        }
    )


def design_table(study: RobustFront) -> pd.DataFrame:
    """One row per design of the front: its stiffness factors."""
    designs = study.search.front.designs
    columns = {f"{name} [1]": designs[:, place] for place, name in enumerate(study.variables)}
    return pd.DataFrame({"point": np.arange(1, len(designs) + 1), **columns})


def convergence_table(study: RobustFront) -> pd.DataFrame:
    """One row per generation: hypervolume of the front so far, as the search saw it."""
    volume = study.search.hypervolume
    return pd.DataFrame({"generation": np.arange(1, len(volume) + 1), "hypervolume [dB²]": volume})


def per_vehicle_table(study: RobustFront) -> pd.DataFrame:
    """One row per design of the front and vehicle, verified."""
    values, n_lines = study.verification.values, study.index.n_lines
    points, vehicles = np.meshgrid(np.arange(1, len(values) + 1), study.vehicles, indexing="ij")
    return pd.DataFrame(
        {
            "point": points.ravel(),
            "vehicle": vehicles.ravel(),
            "SPLV mean [dB(A)]": values.mean.ravel(),
            "SPLV sigma [dB]": values.sigma.ravel(),
            "mean level of the lines [dB(A)]": values.mean.ravel() / n_lines,
            "sigma of that level [dB]": values.sigma.ravel() / n_lines,
        }
    )


def pick_table(study: RobustFront) -> pd.DataFrame:
    """Baseline and named designs: both objectives, per vehicle and line."""
    rows = []
    base, values = study.baseline, study.verification.values
    for name, source, row in [
        ("baseline", base, 0),
        *((name, values, row) for name, row in study.picks.items()),
    ]:
        sigma = source.sigma_sum[row]
        rows.append(
            {
                "design": name,
                "mean level [dB(A)]": source.mean_sum[row] * study.per_line,
                "change [dB]": (source.mean_sum[row] - base.mean_sum[0]) * study.per_line,
                "sigma of the level [dB]": sigma * study.per_line,
                "change of sigma [%]": 100.0 * (sigma / base.sigma_sum[0] - 1.0),
            }
        )
    return pd.DataFrame(rows)


def stiffness_table(study: RobustFront) -> pd.DataFrame:
    """One row per stiffness factor: today's stiffness and that of each pick."""
    nominal, variables = study.nominal_stiffness, study.stiffness_variables
    designs = {name: design[: len(variables)] for name, design in study.pick_designs.items()}
    interval = study.indifference[: len(variables)]
    free = np.isin(variables, study.without_effect)
    table = {
        "variable": list(variables),
        "nominal [N/mm]": nominal,
    }
    for name, design in designs.items():
        table[f"{name} factor [1]"] = design
        table[f"{name} [N/mm]"] = nominal * design
    for column, end in (("from", 0), ("to", 1)):
        table[f"best mean {column} [N/mm]"] = np.where(free, np.nan, nominal * interval[:, end])
    lower, upper = (
        bounds[: len(variables)] for bounds in (study.robust.space.lower, study.robust.space.upper)
    )
    anywhere = (interval[:, 0] <= lower) & (interval[:, 1] >= upper)
    table["requirement"] = np.select(
        [free, anywhere], [NO_REQUIREMENT, "any in bounds"], "as chosen"
    )
    return pd.DataFrame(table)


def loss_factor_table(study: RobustFront) -> pd.DataFrame:
    """One row per loss factor that is a variable: its factor in each pick."""
    first = len(study.stiffness_variables)
    columns = {f"{name} factor [1]": x[first:] for name, x in study.pick_designs.items()}
    interval = study.indifference[first:]
    free = np.isin(study.variables[first:], study.without_effect)
    for column, end in (("from", 0), ("to", 1)):
        columns[f"best mean {column} [1]"] = np.where(free, np.nan, interval[:, end])
    return pd.DataFrame({"variable": list(study.variables[first:]), **columns})


def vehicle_change_table(study: RobustFront) -> pd.DataFrame:
    """One row per vehicle: what best mean changes, and how far the tolerance scatters it."""
    design = study.pick_designs["best mean"]
    row = study.picks["best mean"]
    values, n_lines = study.verification.values, study.index.n_lines
    return pd.DataFrame(
        {
            "vehicle": list(study.vehicles),
            "level before [dB(A)]": study.baseline.mean[0] / n_lines,
            "level after [dB(A)]": values.mean[row] / n_lines,
            "change [dB]": study.splv_change(design),
            "sigma before [dB]": study.baseline.sigma[0] / n_lines,
            "sigma after [dB]": values.sigma[row] / n_lines,
            "energy change [dB]": study.energy_change(design),
            "sigma of energy [dB]": study.energy_sigma(design),
        }
    )


def peak_table(study: RobustFront) -> pd.DataFrame:
    """Booming peaks at nominal and what became of them in best mean."""
    rows = []
    for vehicle, changes in study.peak_changes(study.pick_designs["best mean"]).items():
        for change in changes:
            before, after = change.before, change.after
            rows.append(
                {
                    "vehicle": vehicle,
                    "frequency before [Hz]": before.frequency if before else np.nan,
                    "speed before [rpm]": before.rpm if before else np.nan,
                    "SPL before [dB(A)]": change.level_before,
                    "prominence before [dB]": before.prominence if before else np.nan,
                    "frequency after [Hz]": after.frequency if after else np.nan,
                    "speed after [rpm]": after.rpm if after else np.nan,
                    "SPL after [dB(A)]": change.level_after,
                    "prominence after [dB]": after.prominence if after else np.nan,
                    "change [dB]": change.level_after - change.level_before,
                }
            )
    return pd.DataFrame(rows)


def front_summary(study: RobustFront) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    design = study.pick_designs["best mean"]
    changes = zip(
        study.vehicles, study.splv_change(design), study.energy_change(design), strict=True
    )
    summary: dict[str, Scalar] = {"n_front": len(study.search.front)}
    for vehicle, splv, energy in changes:
        summary[f"splv_change_db_per_line_{vehicle}"] = float(splv)
        summary[f"energy_25_40hz_change_db_{vehicle}"] = float(energy)
    check = study.verification
    best = study.picks["best sigma"]
    summary["sigma_change_percent_best_sigma"] = float(
        100.0 * (check.values.sigma_sum[best] / study.baseline.sigma_sum[0] - 1.0)
    )
    summary["sigma_bias_percent"] = check.sigma_bias_percent
    summary["mean_bias_db_per_line"] = check.mean_bias * study.per_line
    summary |= study.motion_report.summary
    summary["n_evaluated"] = study.search.n_evaluated
    summary["n_failed"] = study.search.n_failed
    summary["seconds_search"] = round(study.search.seconds, 3)
    return summary
