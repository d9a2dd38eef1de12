"""Tables and headline numbers of compared fronts."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.explore.front_quality import attainment, coverage
from deboom.explore.front_verdict import Verdict
from deboom.explore.fronts import nondominated
from deboom.study.compare import Comparison
from deboom.study.result import Scalar

PERCENT = 100.0


def pair_table(study: Comparison) -> pd.DataFrame:
    """One row per pair of configurations: difference, noise, verdict, and what it means."""
    rows = []
    for (first, second), found in study.pairs.items():
        better, other = _median_front(study, first), _median_front(study, second)
        rows.append(
            {
                "first": first,
                "second": second,
                "verdict": found.verdict.value,
                "hypervolume, first - second [%]": PERCENT * found.value,
                "noise, 99 % [%]": PERCENT * found.noise,
                "error from draws [%]": PERCENT * found.draw_error,
                "error from searches [%]": PERCENT * found.search_error,
                f"level at equal σ, first - second {unit_label(study)}": study.gap(first, second)
                * study.per_line,
                "first covers second [%]": PERCENT * coverage(better, other),
                "second covers first [%]": PERCENT * coverage(other, better),
                "distance of designs [%]": PERCENT * study.distance(first, second),
            }
        )
    return pd.DataFrame(rows)


def front_table(study: Comparison) -> pd.DataFrame:
    """One row per run: figures of merit of its front under the common draws."""
    rows = []
    for one in study.fronts:
        front = one.objectives
        volumes = [study.box.hypervolume(part) for part in one.by_set]
        rows.append(
            {
                "run": one.run.entry.name,
                "configuration": one.name,
                "seed": one.run.seed,
                "designs": len(front),
                "failed": one.n_failed,
                "still non-dominated [%]": PERCENT * float(np.mean(nondominated(front))),
                "hypervolume [%]": PERCENT * float(np.mean(volumes)),
                "last gain [%]": PERCENT * study.progress(one),
                "IGD+ [%]": PERCENT * study.box.igd_plus(front),
                "additive ε [%]": PERCENT * study.box.epsilon(front),
                f"best mean {unit_label(study)}": front[:, 0].min() * study.per_line,
                f"best σ {unit_label(study)}": front[:, 1].min() * study.per_line,
            }
        )
    return pd.DataFrame(rows)


def range_table(study: Comparison) -> pd.DataFrame:
    """One row per variable: smallest, median and largest value on the fronts."""
    space = study.judge.space
    table: dict[str, object] = {"variable": list(space.names)}
    for name, ranges in design_values(study).items():
        for column, word in enumerate(("smallest", "median", "largest")):
            table[f"{name}, {word}"] = ranges[:, column]
    return pd.DataFrame(table)


def point_table(study: Comparison) -> pd.DataFrame:
    """One row per design of each run: its objectives under the common draws."""
    parts = [
        pd.DataFrame(
            {
                "run": one.run.entry.name,
                "configuration": one.name,
                f"{objective_labels(study)[0]} {unit_label(study)}": one.objectives[:, 0]
                * study.per_line,
                f"{objective_labels(study)[1]} {unit_label(study)}": one.objectives[:, 1]
                * study.per_line,
            }
        )
        for one in study.fronts
    ]
    return pd.concat(parts, ignore_index=True)


def objective_labels(study: Comparison) -> tuple[str, str]:
    """Return what the two objectives are."""
    if study.per_line != 1.0:
        return "mean level over vehicles and lines", "its σ over the tolerance"
    first, second = (objective.name for objective in study.judge.objectives)
    return first, second


def unit_label(study: Comparison) -> str:
    """Return the unit of the objectives in brackets; levels differ in dB."""
    return f"[{study.judge.evaluate.response_unit.replace('dB(A)', 'dB')}]"


def unit_word(study: Comparison) -> str:
    """Return the unit as it stands behind a number."""
    unit = unit_label(study).strip("[]")
    return "" if unit == "1" else unit


def design_values(study: Comparison) -> dict[str, RealArray]:
    """Return smallest, median and largest value of each variable by configuration, (k, 3)."""
    ranges = {}
    for name, runs in study.groups.items():
        designs = np.concatenate([one.designs for one in runs])
        ranges[name] = np.column_stack(
            [designs.min(axis=0), np.median(designs, axis=0), designs.max(axis=0)]
        )
    return ranges


def _median_front(study: Comparison, name: str) -> RealArray:
    """Return what the median run of a configuration attains."""
    runs = [one.objectives for one in study.groups[name]]
    return np.asarray(attainment(runs, [0.5])[0.5])


def comparison_summary(study: Comparison) -> dict[str, Scalar]:
    """Headline numbers; those of a single pair are of the first one."""
    verdicts = [found.verdict for found in study.pairs.values()]
    (first, second), found = next(iter(study.pairs.items()))
    summary: dict[str, Scalar] = {
        "n_runs": len(study.fronts),
        "n_configurations": len(study.groups),
        "n_pairs": len(verdicts),
        "n_real": verdicts.count(Verdict.real),
        "n_within_noise": verdicts.count(Verdict.noise),
        "n_not_decided": verdicts.count(Verdict.open),
        "first": first,
        "second": second,
        "verdict": found.verdict.value,
        "hypervolume_difference_percent": PERCENT * found.value,
    }
    numbers = {
        "noise_percent": PERCENT * found.noise,
        "level_difference": study.gap(first, second) * study.per_line,
        "design_distance_percent": PERCENT * study.distance(first, second),
    }
    summary |= {name: value for name, value in numbers.items() if np.isfinite(value)}
    for name, volumes in study.hypervolumes.items():
        summary[f"hypervolume_percent_{name.replace(' ', '_')}"] = PERCENT * float(volumes.mean())
    return summary
