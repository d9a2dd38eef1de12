"""DOE and correlation.

Groups and vehicles of the shipped platform over 300 designs within ±15 %, several seeds of the
designs. That the intervals cover the truth is held by a test. The shipped fleet was selected; what
fleets show that nobody chose stands under "Figures over unselected draws of the bench".
"""

from __future__ import annotations

import time
from typing import Any

from claims import Claim, at_least, at_most, between, draws
from deboom.pages.correlation import Plan
from deboom.runs.runner import load_study

SEEDS = tuple(range(1, 1 + draws(2)))
MANY = {"designs": 4096, "plan": Plan.sobol, "draws": 2, "resamples": 100}


def claims() -> list[Claim]:
    """Run the study."""
    groups = _summaries({"group": None})
    begin = time.perf_counter()
    vehicles = _summaries({"group": ("U06",)})
    seconds = (time.perf_counter() - begin) / len(SEEDS)
    sobol = _summaries({"group": ("U06",)} | MANY, seeds=(1,))[0]
    r_group = [summary["r_group_min"] for summary in groups]
    alike = [summary["r_u06_1_4_min"] for summary in vehicles]
    apart = [summary["r_u06_5_mean"] for summary in vehicles]
    seeds = f"seeds {', '.join(map(str, SEEDS))} [1]"
    return [
        at_least(f"least correlation of two groups, {seeds}", 0.9, r_group, 3),
        at_least(f"least correlation among U06-1 to U06-4, {seeds}", 0.95, alike, 3),
        between(f"U06-5 with the others, mean, {seeds}", (0.3, 0.8), apart),
        at_most(
            "300 designs against 4096 (Sobol): U06-5 with the others, difference [1]; half an "
            "interval is 0.08",
            0.08,
            abs(apart[0] - sobol["r_u06_5_mean"]),
            3,
        ),
        at_most("a run of correlation [s]", 60, seconds, 1),
    ]


def _summaries(changes: dict[str, Any], seeds: tuple[int, ...] = SEEDS) -> list[dict[str, Any]]:
    study = load_study("correlation")
    return [study.report({"seed": seed, **changes}).summary for seed in seeds]
