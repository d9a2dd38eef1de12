"""Tolerance allocation.

`studies/tolerance_allocation.py` with its default budget, motion prescribed. Costs are 1 per
direction at ±15 % and reciprocal, an assumption: a ratio to one tolerance everywhere holds for such
prices. That derivatives are exact and the cheapest tolerances those of Lagrange is held by
`tests/unit/test_explore_tolerance_allocation.py`.
"""

from dataclasses import replace
from pathlib import Path

from claims import Claim, at_most, between, draws
from deboom.runs.options import ScatterOptions
from deboom.runs.platform_options import MotionOptions
from deboom.runs.runner import load_study
from deboom.runs.search import SearchOptions
from deboom.vehicles.booming_model import Motion

STUDIES = Path(__file__).parents[2] / "studies"
STUDY = load_study(STUDIES / "tolerance_allocation.py")
PARTS = STUDIES / "data" / "u06_parts.toml"
SEEDS = draws(3)


def claims() -> list[Claim]:
    """Allocate on the shipped fleet."""
    return [*_shipped(), _shares()]


def _shipped() -> list[Claim]:
    summary = STUDY.report({"motion": Motion.prescribed}).summary
    ratio, fair = (summary[f"cost_ratio_to_uniform{end}"] for end in ("", "_of_effective"))
    verified = summary["sigma_verified_db"] / summary["sigma_uniform_verified_db"] - 1.0
    return [
        at_most(
            "cost of the cheapest tolerances over one tolerance everywhere, same σ, shipped fleet; "
            "where directions without effect are free for both",
            1,
            [ratio, fair],
        ),
        between("σ of both with new draws: cheapest over uniform [%]", (-2, 2), 100 * verified),
    ]


def _shares() -> Claim:
    module = STUDY.module
    options = module.Options(
        motion=MotionOptions(Motion.prescribed),
        search=SearchOptions(generations=20, population=40),
        scatter=ScatterOptions(samples=256, parts=PARTS),
        limit=["+0.4"],
        share=0.95,
    )
    model = module.prepare(options)
    # a short search chooses the design once and for all
    model = replace(model, picked=module._chosen(model, options, None))
    shares, ratios = [], []
    for seed in range(1, SEEDS + 1):
        summary = module.run(model, replace(options, seed=seed)).summary
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
