"""Tolerance allocation.

Cheapest tolerances against the closed form of Lagrange on linear responses, with bounds and with
axes of one hardness; exact derivatives against differences on the shipped platform; and
`studies/tolerance_allocation.py` with its default budget, motion prescribed. Costs are 1 per
direction at ±15 % and reciprocal, an assumption: a ratio to one tolerance everywhere holds for such
prices.
"""

import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from claims import Claim, draws
from deboom.explore.moments import Estimator
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import ToleranceStructure, cut_normal_moments, sobol_sample
from deboom.explore.space import stiffness_factor_space
from deboom.explore.tolerance_allocation import (
    Allocator,
    SigmaTarget,
    ToleranceCost,
    ToleranceEffect,
    reciprocal_curves,
)
from deboom.study.made_parts import ScatterOptions
from deboom.study.platform_model import Motion, MotionOptions
from deboom.study.runner import load_study, run_study
from deboom.study.search import SearchOptions

STUDIES = Path(__file__).parents[2] / "studies"
STUDY = load_study(STUDIES / "tolerance_allocation.py")
PARTS = STUDIES / "data" / "u06_parts.toml"
LOWER, UPPER = 0.05, 0.30
PROBLEMS = draws(20)
SEEDS = draws(3)


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
        estimator=Estimator(1),
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
        allocator = _allocator(
            slope, weight, ToleranceStructure(names, np.ones((len(names), 1)), ("batch M",))
        )
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


def _model(**asked: object) -> tuple[Any, Any]:
    """Options, and a model whose design a short search has chosen once and for all."""
    module = STUDY.module
    options = module.Options(
        motion=MotionOptions(Motion.prescribed),
        search=SearchOptions(generations=20, population=40),
        scatter=ScatterOptions(samples=256, parts=PARTS),
        **asked,
    )
    model = module.prepare(options)
    return options, replace(model, picked=module._chosen(model, options, None))


def _shipped() -> list[Claim]:
    options, model = _model()
    effect = ToleranceEffect(
        STUDY.module.with_draws(
            model.robust, "allocation sample", options.scatter.samples, options.seed
        ),
        model.picked,
    )
    tolerance, step = np.full(12, 0.15), 1e-5
    here, errors = effect.at(tolerance), []
    for column in range(12):
        move = step * np.eye(12)[column]
        up, down = effect.at(tolerance + move).sigma, effect.at(tolerance - move).sigma
        errors.append(np.abs((up - down) / (2 * step) - here.sigma_by_tolerance[:, column]).max())
    error = max(errors) / np.abs(here.sigma_by_tolerance).max()
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        run = run_study(STUDY, Path(folder), {"motion": Motion.prescribed})
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
    options, model = _model(limit=["+0.4"], share=0.95)
    shares, ratios = [], []
    for seed in range(1, SEEDS + 1):
        summary = STUDY.module.run(model, replace(options, seed=seed)).summary
        shares.append(summary["share_verified"])
        ratios.append(summary["cost_ratio_to_uniform"])
    reached = sum(share >= options.share for share in shares)
    return Claim(
        f"95 % of parts × vehicles within +0.4 dB: {SEEDS} seeds that reach it with new draws",
        f"{SEEDS} of {SEEDS}",
        f"{reached} of {SEEDS} ({100 * min(shares):.1f} to {100 * max(shares):.1f} %; cost over "
        f"uniform {min(ratios):.2f} to {max(ratios):.2f})",
        reached == SEEDS,
    )
