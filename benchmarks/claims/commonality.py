"""Mounts that vehicles share, on the shipped platform.

On the platform motion is prescribed.
"""

from __future__ import annotations

import time

from claims import Claim, at_least, at_most, between
from deboom.runs.runner import load_study
from deboom.vehicles.booming_model import Motion


def claims() -> list[Claim]:
    """Measure."""
    begin = time.perf_counter()
    summary = load_study("commonality").report({"motion": Motion.prescribed}).summary
    seconds = time.perf_counter() - begin
    total, bound = int(summary["part_numbers_min"]), int(summary["part_numbers_lower_bound"])
    price, worst = float(summary["price_db"]), float(summary["price_worst_db"])
    one_set = float(summary["one_set_price_worst_db"])
    groups = float(summary["group_sets_price_worst_db"])
    return [
        between(
            "part numbers for 15 vehicles within 0.5 dB of mounts of their own (60 would be their "
            "own); none fewer than the lower bound",
            (bound, 59),
            total,
            0,
        ),
        at_most("price of sharing them, mean and worst vehicle [dB]", 0.5 + 1e-6, [price, worst]),
        at_least(
            "worst vehicle with one set for all (4 numbers), with one per group (12) [dB]",
            worst,
            [one_set, groups],
        ),
        at_least(
            "cars of the worst vehicle within its limit as mounts scatter by ±15 % [%]",
            95,
            100 * float(summary["share_verified_min"]),
            1,
        ),
        at_most("the study with its defaults [s]", 60, seconds, 0),
    ]
