"""Tables and headline numbers of allocated tolerances."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom.study.result import Scalar
from deboom.study.tolerance_allocation import AllocationStudy

PERCENT = 100.0
MILLI = 1000.0


def allocation_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per direction: its tolerance and price today, uniform and allocated."""
    today, uniform, cheapest = study.today, study.uniform, study.cheapest
    bounds = study.allocator
    lower = np.isclose(cheapest.tolerance, bounds.lower)
    upper = np.isclose(cheapest.tolerance, bounds.upper)
    return pd.DataFrame(
        {
            "variable": list(cheapest.names),
            "tolerance today ± [%]": PERCENT * today.tolerance,
            "uniform ± [%]": PERCENT * uniform.tolerance,
            "cheapest ± [%]": PERCENT * cheapest.tolerance,
            "cost today [1]": today.cost,
            "cost uniform [1]": uniform.cost,
            "cost cheapest [1]": cheapest.cost,
            "bound": np.select([lower, upper], ["tightest", "widest"], ""),
        }
    )


def marginal_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per direction: what a little tolerance is worth, today and once allocated."""
    table: dict[str, object] = {"variable": list(study.allocator.names)}
    for name, values in (
        ("today", study.marginal_today),
        ("cheapest", study.marginal_cheapest),
    ):
        scale = MILLI * study.per_line
        table[f"sigma per % of tolerance, {name} [0.001 dB]"] = scale * values.sigma_per_percent
        table[f"sigma per unit of cost, {name} [0.001 dB]"] = scale * values.sigma_per_cost
    return pd.DataFrame(table)


def front_marginal_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per design of the front and direction: what a little tolerance is worth today."""
    scale = MILLI * study.per_line
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "point": point,
                    "variable": list(values.names),
                    "sigma per % of tolerance [0.001 dB]": scale * values.sigma_per_percent,
                    "sigma per unit of cost [0.001 dB]": scale * values.sigma_per_cost,
                }
            )
            for point, values in study.along_front.items()
        ],
        ignore_index=True,
    )


def curve_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per target: what the cheapest and what uniform tolerances cost."""
    asked, cheapest, uniform = study.curve
    label = "sigma of the level [dB]" if study.limits is None else "share within limits [1]"
    return pd.DataFrame(
        {
            label: asked,
            "cost cheapest [1]": cheapest,
            "cost uniform [1]": uniform,
            "ratio [1]": cheapest / uniform,
        }
    )


def verification_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per set of tolerances: cost, and what new draws give."""
    costs = {"today's": study.today, "cheapest": study.cheapest, "uniform": study.uniform}
    rows = []
    for name, one in study.verified.items():
        row: dict[str, object] = {
            "tolerances": name,
            "cost [1]": costs[name].total_cost,
            "sigma of the level, chosen with [dB]": costs[name].sigma_sum * study.per_line,
            "sigma of the level, verified [dB]": one.sigma,
        }
        if study.limits is not None:
            row["within limits [%]"] = PERCENT * one.share
            row["at least, with 95 % confidence [%]"] = PERCENT * one.share_lower
        rows.append(row)
    return pd.DataFrame(rows)


def allocation_summary(study: AllocationStudy) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    cheapest, uniform = study.cheapest, study.uniform
    found = study.verified["cheapest"]
    summary: dict[str, Scalar] = {
        "design": study.chosen.name,
        "target": "sigma" if study.limits is None else "share",
        "cost_cheapest": cheapest.total_cost,
        "cost_uniform": uniform.total_cost,
        "cost_today": study.today.total_cost,
        "cost_ratio_to_uniform": cheapest.total_cost / uniform.total_cost,
        "cost_ratio_to_uniform_of_effective": (
            cheapest.total_cost / study.uniform_of_effective.total_cost
        ),
        "sigma_today_db": study.today.sigma_sum * study.per_line,
        "sigma_cheapest_db": cheapest.sigma_sum * study.per_line,
        "sigma_verified_db": found.sigma,
        "sigma_uniform_verified_db": study.verified["uniform"].sigma,
        "optimality_percent": PERCENT * study.allocator.price_spread(cheapest, study.target),
    }
    if study.limits is not None:
        summary |= {
            "share_stated": study.wanted.share,
            "share_verified": found.share,
            "share_lower_bound": found.share_lower,
        }
    return summary
