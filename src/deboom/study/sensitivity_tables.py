"""Tables and headline numbers of a sensitivity study."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt
import pandas as pd

from deboom.explore.sobol_indices import SobolIndices
from deboom.study.result import Scalar
from deboom.study.sensitivity import Sensitivity

_T = TypeVar("_T", bound=np.generic)
MATTERS = 0.02
"""Total index from which a variable is shown where there is no room for all [1]."""
NEGLIGIBLE = 0.005
"""Total index, with its interval, below which a variable may be left out [1]."""


def index_table(found: SobolIndices, factor: str) -> pd.DataFrame:
    """One row per vehicle and factor: first, total and coupled share with their intervals.

    Parameters
    ----------
    found : SobolIndices
        Of the vehicles.
    factor : str
        Heading of the column of factors, such as ``variable``.
    """
    rank = 1 + np.argsort(np.argsort(-found.total, axis=0, kind="stable"), axis=0, kind="stable")
    return pd.DataFrame(
        {
            **_keys(found.outputs, **{factor: found.factors}),
            "first order [1]": _long(found.first),
            "first order interval ± [1]": _long(found.first_interval),
            "total [1]": _long(found.total),
            "total interval ± [1]": _long(found.total_interval),
            "coupled [1]": _long(found.coupled),
            "coupled interval ± [1]": _long(found.coupled_interval),
            "rank": _long(rank),
            "zero": _zeros(found),
        }
    )


def _zeros(found: SobolIndices) -> list[str]:
    """Name the indices of each row that are not above their intervals."""
    kinds = {
        "first order": _long(found.first <= found.first_interval),
        "total": _long(found.zero),
        "coupled": _long(found.coupled <= found.coupled_interval),
    }
    return [
        ", ".join(name for name, flag in zip(kinds, flags, strict=True) if flag)
        for flags in zip(*kinds.values(), strict=True)
    ]


def pair_table(found: SobolIndices) -> pd.DataFrame:
    """One row per vehicle and pair of variables: what both do only together."""
    names = found.pair_names
    vehicles = np.repeat(found.outputs, len(names))
    zero = _long(np.abs(found.second) <= found.second_interval)
    return pd.DataFrame(
        {
            "vehicle": vehicles,
            "variable": [name for name, _ in names] * len(found.outputs),
            "and": [name for _, name in names] * len(found.outputs),
            "second order [1]": _long(found.second),
            "interval ± [1]": _long(found.second_interval),
            "zero": np.where(zero, "second order", ""),
        }
    )


def beside_table(study: Sensitivity) -> pd.DataFrame:
    """One row per vehicle and variable: the total index in every analysis."""
    every = {f"{study.label}, {study.plan.ranked.words}": study.indices, **study.beside}
    columns = {}
    for label, found in every.items():
        columns[f"total, {label} [1]"] = _long(found.total)
        columns[f"interval ±, {label} [1]"] = _long(found.total_interval)
    return pd.DataFrame({**_keys(study.vehicles, variable=study.variables), **columns})


def line_table(study: Sensitivity) -> pd.DataFrame:
    """One row per vehicle and line: the total index of its level by every variable."""
    frequency = study.index.frequency
    columns = {
        f"{name} [1]": row for name, row in zip(study.variables, study.lines.total, strict=True)
    }
    return pd.DataFrame(
        {
            "vehicle": np.repeat(study.vehicles, frequency.size),
            "frequency [Hz]": np.tile(frequency, len(study.vehicles)),
            **columns,
            "largest interval ± [1]": study.lines.total_interval.max(axis=0),
        }
    )


def convergence_table(study: Sensitivity) -> pd.DataFrame:
    """One row per number of base points, vehicle and variable."""
    parts = [
        pd.DataFrame(
            {
                "base points": found.n_base,
                **_keys(study.vehicles, variable=study.variables),
                "total [1]": _long(found.total),
                "total interval ± [1]": _long(found.total_interval),
            }
        )
        for found in study.convergence
    ]
    return pd.concat(parts, ignore_index=True)


def screening_table(study: Sensitivity) -> pd.DataFrame:
    """One row per vehicle and variable: what other methods say."""
    lines = study.index.n_lines if study.plan.ranked.is_sum else 1
    return pd.DataFrame(
        {
            **_keys(study.vehicles, variable=study.variables),
            "total [1]": _long(study.indices.total),
            "Morris mean effect [dB]": _long(study.morris.mu) / lines,
            "Morris mean size of effect [dB]": _long(study.morris.mu_star) / lines,
            "its interval ± [dB]": _long(study.morris.mu_star_interval) / lines,
            "Morris sigma [dB]": _long(study.morris.sigma) / lines,
            "PAWN [1]": _long(study.pawn.index),
        }
    )


def negligible(study: Sensitivity) -> tuple[str, ...]:
    """Variables whose total index with its interval stays below `NEGLIGIBLE` in every vehicle."""
    highest = (study.indices.total + study.indices.total_interval).max(axis=1)
    return tuple(study.variables[place] for place in np.flatnonzero(highest < NEGLIGIBLE))


def matters(study: Sensitivity) -> list[int]:
    """Places of the variables that matter in some vehicle; of many small ones the largest."""
    highest = study.indices.total.max(axis=1)
    return np.flatnonzero(highest >= min(MATTERS, highest.max())).tolist()


def sensitivity_summary(study: Sensitivity) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    summary: dict[str, Scalar] = {
        f"st_{_key(variable)}_{vehicle}": float(study.indices.total[row, column])
        for column, vehicle in enumerate(study.vehicles)
        for row, variable in enumerate(study.variables)
    }
    if study.by_mount is not None:
        summary |= {
            f"st_mount_{_key(mount)}_{vehicle}": float(study.by_mount.total[row, column])
            for column, vehicle in enumerate(study.vehicles)
            for row, mount in enumerate(study.by_mount.factors)
        }
    return {
        **summary,
        "largest_interval": float(study.indices.total_interval.max()),
        "largest_coupled": float(study.indices.coupled.max()),
        "n_zero": int(study.indices.zero.sum()),
        "salib_difference": study.salib_difference,
        "n_runs": study.n_runs,
    }


def _key(name: str) -> str:
    return name.replace(" ", "_")


def _keys(vehicles: tuple[str, ...], **factors: tuple[str, ...]) -> dict[str, object]:
    """Return the columns that name vehicle and factor of each row."""
    ((heading, names),) = factors.items()
    return {
        "vehicle": np.repeat(vehicles, len(names)),
        heading: list(names) * len(vehicles),
    }


def _long(values: npt.NDArray[_T]) -> npt.NDArray[_T]:
    """Turn (d, r) into one column, vehicle by vehicle."""
    return values.T.ravel()
