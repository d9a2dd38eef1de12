"""Mounts that vehicles share: against all partitions, and on the shipped platform.

On the platform motion is prescribed.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from claims import Claim, draws
from deboom.explore.commonality import fewest_part_numbers
from deboom.explore.sharing import Sharing, SharingProblem, own_optima, shared_design
from deboom.explore.space import DesignSpace
from deboom.study.platform_model import Motion
from deboom.study.runner import load_study

STUDY = Path(__file__).parents[2] / "studies" / "commonality.py"
PROBLEMS = draws(10)


@dataclass(frozen=True, eq=False)
class Bowls:
    """Level of a vehicle: squared distance of its design from a centre of its own."""

    centres: np.ndarray
    response_unit: str = "dB"

    @property
    def variable_names(self) -> tuple[str, ...]:
        """Of two parts with two axes."""
        return ("A x", "A z", "B x", "B z")

    @property
    def response_names(self) -> tuple[str, ...]:
        """One per centre."""
        return tuple(f"car {n}" for n in range(1, len(self.centres) + 1))

    def __call__(self, designs: np.ndarray) -> np.ndarray:
        """Return squared distances."""
        off = designs[:, np.newaxis] - self.centres
        return np.einsum("nvk,nvk->nv", off, off)

    def gradient(self, designs: np.ndarray) -> np.ndarray:
        """Return twice the distance."""
        return 2 * (designs[:, np.newaxis] - self.centres)


def claims() -> list[Claim]:
    """Measure."""
    return [_against_all_partitions(), *_shipped()]


def _against_all_partitions() -> Claim:
    right = 0
    for seed in range(1, PROBLEMS + 1):
        random = np.random.default_rng(seed)
        bowls = Bowls(random.uniform(-1, 1, (4, 4)))
        space = DesignSpace(
            bowls.variable_names,
            ("1",) * 4,
            np.zeros(4),
            -3 * np.ones(4),
            3 * np.ones(4),
            np.zeros(4),
        )
        parts = {"A": ["A x", "A z"], "B": ["B x", "B z"]}
        radius = random.uniform(0.5, 1.1)
        problem = SharingProblem(bowls, space, parts, np.full(4, radius**2))
        own = own_optima(bowls, space, starts=2, seed=1)
        found = fewest_part_numbers(problem, own)
        right += found.fewest.sharing.total == _fewest_of_all(problem, own.designs)
    return Claim(
        f"fewest part numbers of {PROBLEMS} problems (4 vehicles, 2 parts) equal to the fewest "
        "over all 225 partitions",
        "100 %",
        f"{100 * right / PROBLEMS:.0f} %",
        right == PROBLEMS,
    )


def _fewest_of_all(problem: SharingProblem, start: np.ndarray) -> int:
    rows = [
        row
        for row in product(range(4), repeat=4)
        if all(n <= max(row[:place], default=-1) + 1 for place, n in enumerate(row))
    ]
    best = 9
    for pair in product(rows, repeat=2):
        sharing = Sharing(problem.part_names, problem.vehicles, np.array(pair))
        if sharing.total < best and shared_design(problem, sharing, [start]).worst <= 1e-6:
            best = sharing.total
    return best


def _shipped() -> list[Claim]:
    begin = time.perf_counter()
    summary = load_study(STUDY).report({"motion": Motion.prescribed}).summary
    seconds = time.perf_counter() - begin
    total, bound = int(summary["part_numbers_min"]), int(summary["part_numbers_lower_bound"])
    price, worst = float(summary["price_db"]), float(summary["price_worst_db"])
    one_set = float(summary["one_set_price_worst_db"])
    groups = float(summary["group_sets_price_worst_db"])
    return [
        Claim(
            "part numbers for 15 vehicles within 0.5 dB of mounts of their own (60 would be their "
            "own); none fewer than the lower bound",
            f"at least {bound}",
            f"{total}",
            bound <= total < 60,
        ),
        Claim(
            "price of sharing them, mean and worst vehicle",
            "<= 0.5 dB",
            f"{price:.2f}, {worst:.2f} dB",
            worst <= 0.5 + 1e-6,
        ),
        Claim(
            "worst vehicle with one set for all (4 numbers), with one per group (12)",
            "more than that",
            f"{one_set:.2f}, {groups:.2f} dB",
            min(one_set, groups) > worst,
        ),
        Claim(
            "cars of the worst vehicle within its limit as mounts scatter by ±15 %",
            ">= 95 %",
            f"{100 * float(summary['share_verified_min']):.1f} %",
            float(summary["share_verified_min"]) >= 0.95,
        ),
        Claim("the study with its defaults", "<= 60 s", f"{seconds:.0f} s", seconds <= 60),
    ]
