"""Tables of a correlation study."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom.bench.unselected_fleets import Rate, UnselectedFleets, load_unselected
from deboom.explore.correlation_study import Correlations
from deboom.files.doe_table import doe_frame
from deboom.study.correlation import CorrelationSet, CorrelationStudy


def doe_table(study: CorrelationStudy) -> pd.DataFrame:
    """Every design with its responses and failure code; a later run can go on from it."""
    return doe_frame(study.doe)


def pair_table(sets: CorrelationSet) -> pd.DataFrame:
    """One row per pair and kind: both coefficients with their intervals."""
    return pd.concat([_pairs(kind, found) for kind, found in sets.kinds.items()], ignore_index=True)


def matrix_table(found: Correlations) -> pd.DataFrame:
    """Pearson's coefficients as a square: one row and one column per name."""
    columns = {f"{name} [1]": found.pearson[:, i] for i, name in enumerate(found.names)}
    return pd.DataFrame({"name": list(found.names), **columns})


def vehicle_table(study: CorrelationStudy) -> pd.DataFrame:
    """One row per vehicle: level, how far designs and scatter move it, family."""
    levels, names = study.vehicles, study.names
    families = study.families
    inside = [
        [other for other in families.members[families.number(name) - 1] if other != name]
        for name in names
    ]
    designs = study.by_vehicle.designs
    return pd.DataFrame(
        {
            "vehicle": list(names),
            "group": [study.group_of[name] for name in names],
            "family": [families.number(name) for name in names],
            "least r within its family [1]": [
                float(designs.between(name, others).min()) if others else np.nan
                for name, others in zip(names, inside, strict=True)
            ],
            "mean r with all others [1]": [study.mean_with_others(name) for name in names],
            "mean level [dB(A)]": levels.designs.mean(axis=0),
            "sigma over designs [dB]": levels.designs.std(axis=0, ddof=1),
            "sigma over the tolerance [dB]": levels.scatter.std(axis=(0, 1)),
        }
    )


def family_table(study: CorrelationStudy) -> pd.DataFrame:
    """One row per family: who belongs to it, and its worst pair."""
    rows = []
    for number, members in enumerate(study.families.members, 1):
        inside = {kind: found.among(members) for kind, found in study.by_vehicle.kinds.items()}
        worst = {
            f"least r, {kind} [1]": float(r.min()) if r.size else np.nan
            for kind, r in inside.items()
        }
        rows.append({"family": number, "vehicles": ", ".join(members), **worst})
    return pd.DataFrame(rows)


def rate_table(rates: dict[str, Rate], own: dict[str, str]) -> pd.DataFrame:
    """One row per phenomenon: what this platform shows, and how often unselected fleets do."""
    return pd.DataFrame(
        [
            {
                "phenomenon": rates[name].phenomenon,
                "this platform": figure,
                "rate in unselected fleets [1]": rates[name].rate,
                "standard error [1]": rates[name].standard_error,
                "fleets": rates[name].n_fleets,
            }
            for name, figure in own.items()
        ]
    )


def unselected(study: CorrelationStudy) -> UnselectedFleets | None:
    """Return the bench's unselected fleets, if the platform is the bench's."""
    fleets = load_unselected()
    return fleets if fleets.platform == study.runs.platform.name else None


def _pairs(kind: str, found: Correlations) -> pd.DataFrame:
    rows, columns = (np.array(side) for side in zip(*found.pairs, strict=True))
    table: dict[str, object] = {
        "correlated": kind,
        "first": [found.names[row] for row in rows],
        "second": [found.names[column] for column in columns],
    }
    for name in ("pearson", "spearman"):
        for end, words in (("", ""), ("_low", " from"), ("_high", " to")):
            table[f"{name}{words} [1]"] = getattr(found, name + end)[rows, columns]
    return pd.DataFrame(table)
