"""Tolerance allocation.

Cheapest tolerances against the closed form of Lagrange on linear responses, with bounds and with
axes of one hardness; exact derivatives against differences on the shipped platform; and
`studies/tolerance_allocation.py` with its default budget. Costs are 1 per direction at ±15 % and
reciprocal, an assumption: a ratio to one tolerance everywhere holds for such prices.
"""

import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from claims import Claim
from deboom.explore.robust import ControlVariate, RobustResponse
from deboom.explore.scatter import ToleranceStructure, batches, cut_normal_moments, sobol_sample
from deboom.explore.space import stiffness_factor_space
from deboom.explore.tolerance_allocation import (
    Allocator,
    SigmaTarget,
    ToleranceCost,
    ToleranceEffect,
    reciprocal_curves,
)
from deboom.files.platform import read_platform
from deboom.study.made_parts import made_parts
from deboom.study.options import factor_space
from deboom.study.platform_model import Motion, MountSource, motion_index, operation
from deboom.study.runner import load_study, run_study
from deboom.study.search import Budget
from deboom.study.tolerance_allocation import (
    AllocationStudy,
    WantedDesign,
    WantedTarget,
    cost_curves,
    design_of_search,
)

STUDIES = Path(__file__).parents[2] / "studies"
PLATFORM = STUDIES / "data" / "u06_f39_f45"
LOWER, UPPER = 0.05, 0.30
PROBLEMS = 50
SEEDS = 10


def claims() -> list[Claim]:
    """Compare with closed forms, then allocate on the shipped fleet."""
    return [*_closed_forms(), *_shipped(), _shares()]


class _Linear:
    response_names = ("level",)
    response_unit = "dB"

    def __init__(self, slope: np.ndarray) -> None:
        self.slope = slope
        self.variable_names = tuple(f"M x{k}" for k in range(slope.size))

    def __call__(self, designs: np.ndarray) -> np.ndarray:
        return np.asarray(designs @ self.slope)[:, np.newaxis]

    def gradient(self, designs: np.ndarray) -> np.ndarray:
        return np.tile(self.slope, (len(designs), 1, 1))


def _allocator(
    slope: np.ndarray, weight: np.ndarray, structure: ToleranceStructure | None = None
) -> Allocator:
    model = _Linear(slope)
    n_draws = structure.n_draws if structure else slope.size
    robust = RobustResponse(
        model,
        stiffness_factor_space(model.variable_names),
        sobol_sample(n_draws, 64, seed=1),
        estimator=ControlVariate(1),
        structure=structure,
    )
    curves = reciprocal_curves(
        model.variable_names, ToleranceCost(weight, np.full(slope.size, 0.15))
    )
    effect = ToleranceEffect(robust, np.ones(slope.size))
    return Allocator(effect, curves, np.asarray(LOWER), np.asarray(UPPER))


def _exact(slope: np.ndarray, weight: np.ndarray, sigma: float) -> float:
    """Cost of t = (w r / (2 λ a²))^(1/3) between the bounds, λ by bisection."""
    a = slope * np.sqrt(cut_normal_moments()[0]) / 3.0
    low, high = 1e-12, 1e12
    for _ in range(200):
        middle = np.sqrt(low * high)
        tolerance = np.clip(np.cbrt(weight * 0.15 / (2.0 * middle * a**2)), LOWER, UPPER)
        over = np.sum((a * tolerance) ** 2) > sigma**2
        low, high = (middle, high) if over else (low, middle)
    return float((weight * 0.15 / tolerance).sum())


def _closed_forms() -> list[Claim]:
    rng = np.random.default_rng(7)
    errors, ratios = [], []
    for _ in range(PROBLEMS):
        slope, weight = rng.uniform(0.1, 3.0, 12), rng.uniform(0.3, 3.0, 12)
        allocator = _allocator(slope, weight)
        target = SigmaTarget(allocator.at(allocator.today).sigma_sum)
        found = allocator.cheapest(target)
        errors.append(abs(found.total_cost / _exact(slope, weight, target.sigma_sum) - 1.0))
        ratios.append(found.total_cost / allocator.uniform(target).total_cost)
    hard = []
    for _ in range(PROBLEMS):
        slope, weight = rng.uniform(0.5, 1.5, 3), rng.uniform(0.5, 2.0, 3)
        names = tuple(f"M x{k}" for k in range(3))
        allocator = _allocator(slope, weight, batches(names, {"M": names}, 1.0))
        a = slope * np.sqrt(cut_normal_moments()[0]) / 3.0
        sigma = 0.12 * a.sum()
        exact = np.sqrt(weight / a) * sigma / (a * np.sqrt(weight / a)).sum()
        if exact.min() > LOWER and exact.max() < UPPER:
            found = allocator.cheapest(SigmaTarget(float(sigma)))
            hard.append(abs(found.total_cost / (weight * 0.15 / exact).sum() - 1.0))
    return [
        Claim(
            f"cost above Lagrange's closed form, {PROBLEMS} linear problems of 12 tolerances "
            "between bounds, largest [1]",
            "≤ 1e-6",
            f"{max(errors):.1e} (cost over that of one tolerance everywhere: "
            f"{min(ratios):.2f} to {max(ratios):.2f})",
            max(errors) <= 1e-6,
        ),
        Claim(
            f"the same where three axes share one hardness, {len(hard)} problems [1]",
            "≤ 1e-6",
            f"{max(hard):.1e}",
            max(hard) <= 1e-6,
        ),
    ]


def _study(parts: Path | None, wanted: WantedTarget, seed: int = 1) -> AllocationStudy:
    runs = operation(read_platform(PLATFORM), None, MountSource.library, "U06", band=(20, 60))
    index = motion_index(runs, Motion.prescribed, None)
    made = made_parts(parts, factor_space(index.variable_names, 0.20, 0.15))
    chosen = design_of_search(runs, index, made, Budget(40, 20), 1, WantedDesign(), None)
    curves, _ = cost_curves(None, None, chosen.variables)
    return AllocationStudy(chosen, curves, wanted, LOWER, UPPER, 256, seed)


def _shipped() -> list[Claim]:
    study = _study(STUDIES / "data" / "u06_parts.toml", WantedTarget())
    effect, tolerance, step = study.allocator.effect, np.full(12, 0.15), 1e-5
    here, errors = effect.at(tolerance), []
    for column in range(12):
        move = step * np.eye(12)[column]
        up, down = effect.at(tolerance + move).sigma, effect.at(tolerance - move).sigma
        errors.append(np.abs((up - down) / (2 * step) - here.sigma_by_tolerance[:, column]).max())
    error = max(errors) / np.abs(here.sigma_by_tolerance).max()
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        run = run_study(load_study(STUDIES / "tolerance_allocation.py"), Path(folder), {})
        summary = json.loads((run / "summary.json").read_text())
    seconds = time.perf_counter() - begin
    ratio, fair = (summary[f"cost_ratio_to_uniform{end}"] for end in ("", "_of_effective"))
    verified = summary["sigma_verified_db"] / summary["sigma_uniform_verified_db"] - 1.0
    return [
        Claim(
            "derivatives of σ by the tolerances against central differences, shipped fleet with "
            "batches and hardness, of the largest [1]",
            "≤ 1e-6",
            f"{error:.1e}",
            bool(error <= 1e-6),
        ),
        Claim(
            "cost of the cheapest tolerances over one tolerance everywhere, same σ, shipped fleet",
            "< 1",
            f"{ratio:.2f} ({fair:.2f} where directions without effect are free for both)",
            ratio < 1.0,
        ),
        Claim(
            "σ of both with new draws: cheapest over uniform [%]",
            "within ±2",
            f"{100 * verified:+.2f}",
            abs(verified) <= 0.02,
        ),
        Claim(
            "spread of the price of σ over the directions between their bounds [%]",
            "≤ 0.1",
            f"{summary['optimality_percent']:.4f}",
            summary["optimality_percent"] <= 0.1,
        ),
        Claim("time of the study with its defaults [s]", "≤ 60", f"{seconds:.0f}", seconds <= 60.0),
    ]


def _shares() -> Claim:
    wanted = WantedTarget(limit=["+0.4"], share=0.95)
    first = _study(STUDIES / "data" / "u06_parts.toml", wanted)
    shares, ratios = [], []
    for seed in range(1, SEEDS + 1):
        study = replace(first, seed=seed)
        shares.append(study.verified["cheapest"].share)
        ratios.append(study.cheapest.total_cost / study.uniform.total_cost)
    reached = sum(share >= wanted.share for share in shares)
    return Claim(
        f"95 % of parts × vehicles within +0.4 dB: {SEEDS} seeds that reach it with new draws",
        f"{SEEDS} of {SEEDS}",
        f"{reached} of {SEEDS} ({100 * min(shares):.1f} to {100 * max(shares):.1f} %; cost over "
        f"uniform {min(ratios):.2f} to {max(ratios):.2f})",
        reached == SEEDS,
    )
