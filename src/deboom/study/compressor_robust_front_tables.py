"""Tables and headline numbers of the robust front of a compressor's mounts."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom.study.compressor_robust_front import PLACES, TODAY, CompressorFront
from deboom.study.result import Scalar

N_PER_MM = 1e-3
"""From N/m to N/mm."""
PERCENT = 100.0


def front_table(study: CompressorFront) -> pd.DataFrame:
    """One row per design of the front: verified objectives, chosen factors, travel."""
    check, scale = study.verification.values, study.per_line
    names = {row: name for name, row in reversed(study.picks.items())}
    columns = {
        "point": np.arange(1, len(check) + 1),
        "pick": [names.get(row, "") for row in range(len(check))],
        "mean level [dB(A)]": check.mean_sum * scale,
        "sigma of the level [dB]": check.sigma_sum * scale,
        "standard error of the mean [dB]": check.standard_error_mean_sum * scale,
        "standard error of sigma [dB]": check.standard_error_sigma_sum * scale,
        "non-dominated when verified": study.verification.nondominated,
        "travel under 1 g [mm]": [study.travel(design) for design in check.designs],
    }
    for column, name in zip(study.chosen, study.chosen_names, strict=True):
        columns[f"{name} factor [1]"] = check.designs[:, column]
    return pd.DataFrame(columns)


def convergence_table(study: CompressorFront) -> pd.DataFrame:
    """One row per generation: hypervolume of the front so far, as the search saw it."""
    volume = study.search.hypervolume
    return pd.DataFrame({"generation": np.arange(1, len(volume) + 1), "hypervolume [dB²]": volume})


def pick_table(study: CompressorFront) -> pd.DataFrame:
    """One row per named design: objectives, travel, rigid-body modes."""
    rows = []
    base = study.baseline
    for name, design in study.designs.items():
        values, row = study.row(name)
        modes = study.model.statics.modes(design[np.newaxis])[0]
        rows.append(
            {
                "design": name,
                "mean level [dB(A)]": values.mean_sum[row] * study.per_line,
                "change [dB]": (values.mean_sum[row] - base.mean_sum[0]) * study.per_line,
                "sigma of the level [dB]": values.sigma_sum[row] * study.per_line,
                "change of sigma [%]": PERCENT * (values.sigma_sum[row] / base.sigma_sum[0] - 1),
                "travel under 1 g [mm]": study.travel(design),
                "lowest mode [Hz]": modes[0],
                "highest mode [Hz]": modes[-1],
            }
        )
    return pd.DataFrame(rows)


def stiffness_table(study: CompressorFront) -> pd.DataFrame:
    """One row per chosen stiffness: today's and that of each pick, and what is free."""
    today = study.chosen_stiffness(study.space.nominal) * N_PER_MM
    table: dict[str, object] = {"stiffness": list(study.chosen_names), "today [N/mm]": today}
    for name, design in study.designs.items():
        if name != TODAY:
            table[f"{name} [N/mm]"] = study.chosen_stiffness(design) * N_PER_MM
    low, high = study.indifference.T
    table["best mean from [N/mm]"] = today * low
    table["best mean to [N/mm]"] = today * high
    return pd.DataFrame(table)


def car_table(study: CompressorFront) -> pd.DataFrame:
    """One row per car: what best mean changes, and how far the tolerance scatters it."""
    values, row = study.row("best mean")
    base, n = study.baseline, study.n_lines
    return pd.DataFrame(
        {
            "car": list(study.cars),
            "level today [dB(A)]": base.mean[0] / n,
            "level then [dB(A)]": values.mean[row] / n,
            "change [dB]": study.level_change(study.best),
            "sigma today [dB]": base.sigma[0] / n,
            "sigma then [dB]": values.sigma[row] / n,
            "energy change [dB]": study.energy_change(study.best),
            "sigma of energy [dB]": study.energy_sigma(study.best),
        }
    )


def peak_table(study: CompressorFront) -> pd.DataFrame:
    """Peaks of the first case today, and what became of them in best mean."""
    rows = []
    for car, changes in study.peak_changes.items():
        for change in changes:
            rows.append(
                {
                    "car": car,
                    "frequency [Hz]": change.frequency,
                    "speed [rpm]": 60.0 * change.frequency,
                    "SPL today [dB(A)]": change.level_before,
                    "SPL then [dB(A)]": change.level_after,
                    "change [dB]": change.level_after - change.level_before,
                }
            )
    names = ("car", "frequency [Hz]", "speed [rpm]", "SPL today [dB(A)]", "SPL then [dB(A)]")
    return pd.DataFrame(rows, columns=[*names, "change [dB]"])


def sobol_table(study: CompressorFront) -> pd.DataFrame:
    """One row per chosen stiffness and car: Sobol indices with the half widths of intervals."""
    found = study.sobol
    return pd.DataFrame(
        [
            {
                "stiffness": factor,
                "car": car,
                "total [1]": found.total[row, place],
                "total ± 95 % [1]": found.total_interval[row, place],
                "alone [1]": found.first[row, place],
                "alone ± 95 % [1]": found.first_interval[row, place],
            }
            for row, factor in enumerate(found.factors)
            for place, car in enumerate(found.outputs)
        ]
    )


def requirement_table(study: CompressorFront) -> pd.DataFrame:
    """One row per chosen stiffness, and the places: what is wanted, and what its tolerance costs.

    Importance is the mean total index over the cars. The share of sigma is that of the tolerance of
    all that belongs to the row, at best mean.
    """
    tolerance = study.model.question.tolerance
    today = study.chosen_stiffness(study.space.nominal) * N_PER_MM
    wanted = study.chosen_stiffness(study.best) * N_PER_MM
    total = study.sobol.total.mean(axis=1)
    rows = []
    for name, columns in study.groups.items():
        share = PERCENT * float(study.shares.of_sum[columns].sum())
        gain = study.worth[name]
        if name == PLACES:
            row = dict.fromkeys(("today", "wanted", "at least", "at most"), np.nan)
            row |= {"factor": np.nan, "tolerance": np.nan, "importance": np.nan}
        else:
            place = study.chosen_names.index(name)
            row = {
                "today": today[place],
                "wanted": wanted[place],
                "factor": wanted[place] / today[place],
                "tolerance": PERCENT * tolerance,
                "at least": wanted[place] * (1 - tolerance),
                "at most": wanted[place] * (1 + tolerance),
                "importance": total[place],
            }
        rows.append(
            {
                "requirement": name,
                "today [N/mm]": row["today"],
                "wanted [N/mm]": row["wanted"],
                "wanted / today [1]": row["factor"],
                "tolerance ± [%]": row["tolerance"],
                "at least [N/mm]": row["at least"],
                "at most [N/mm]": row["at most"],
                "importance [1]": row["importance"],
                "share of sigma [%]": share,
                "sigma with half the tolerance [%]": gain,
            }
        )
    return pd.DataFrame(rows)


def agreement_table(study: CompressorFront) -> pd.DataFrame:
    """One row per design and car: predicted and exact change of the level; empty without truth."""
    columns = ["design", "car", "predicted change [dB]", "exact change [dB]"]
    if study.agreement is None:
        return pd.DataFrame(columns=columns)
    predicted, exact = study.agreement.changes
    return pd.DataFrame(
        [
            [number + 1, car, predicted[number, place], exact[number, place]]
            for number in range(len(exact))
            for place, car in enumerate(study.cars)
        ],
        columns=columns,
    )


def front_summary(study: CompressorFront) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    check, base = study.verification.values, study.baseline
    summary: dict[str, Scalar] = {"n_front": len(check)}
    for car, change in zip(study.cars, study.level_change(study.best), strict=True):
        summary[f"level_change_db_{car}"] = float(change)
    summary["mean_change_db"] = study.mean_change
    for pick in ("best mean", "best sigma"):
        sigma = check.sigma_sum[study.picks[pick]] / base.sigma_sum[0]
        summary[f"sigma_change_percent_{pick.replace(' ', '_')}"] = float(PERCENT * (sigma - 1))
    summary["leading_stiffness"] = study.leading
    summary["leading_total_index"] = float(study.sobol.total.mean(axis=1).max())
    summary["travel_ratio"] = study.travel(study.best) / study.travel(study.space.nominal)
    summary["travel_limit_reached"] = str(study.limit_reached).lower()
    summary["at_bound"] = ", ".join(study.at_bound)
    rigid = np.abs(study.rigid_difference)
    summary["rigid_holders_median_db"] = float(np.median(rigid))
    summary["rigid_holders_p90_db"] = float(np.quantile(rigid, 0.9))
    if study.agreement is not None and study.exact_change is not None:
        errors = np.abs(study.agreement.peak_errors)
        predicted, exact = study.agreement.changes
        summary["peak_error_median_db"] = float(np.median(errors))
        summary["peak_error_p90_db"] = float(np.quantile(errors, 0.9))
        summary["exact_mean_change_db"] = float(np.mean(study.exact_change))
        summary["change_error_rms_db"] = float(np.sqrt(np.mean((predicted - exact) ** 2)))
    summary["sigma_bias_percent"] = study.verification.sigma_bias_percent
    summary["mean_bias_db"] = study.verification.mean_bias * study.per_line
    summary["n_evaluated"] = study.search.n_evaluated
    summary["n_failed"] = study.search.n_failed
    summary["seconds_search"] = round(study.search.seconds, 3)
    return summary
