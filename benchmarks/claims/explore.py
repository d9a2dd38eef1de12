"""Robust search on problems with a known front.

QUAD2 (two quadratic responses whose targets disagree) and EXP1 (one exponential response) have 12
stiffness factors in ±20 %, made with ±15 %. NSGA-II searches them with 100 designs x 100
generations; the designs it found are then judged by their exact mean and standard deviation. Kept
is the share of the true front's hypervolume, both scaled to the true ideal and nadir points, up
to the reference point (1.1, 1.1). Every figure is the median over the seeds, each of which
draws an instance, a sample and a search.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from claims import Claim, draws
from deboom.arrays import RealArray
from deboom.explore.front import hypervolume, verify
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import (
    FreshGaussianSampler,
    ToleranceSampler,
    gaussian_sample,
    sobol_sample,
)
from deboom.explore.search import nsga2
from deboom.explore.space import stiffness_factor_space
from known_truth import SeparableProblem, exact_front, exact_objectives, exp1, quad2

SEEDS = range(1, 1 + draws(1))
N_VARIABLES = 12


class Outcome(NamedTuple):
    """What one sampler made of one problem, medians over the seeds [%]."""

    kept: float
    """True hypervolume."""
    bias: float
    """Of sigma as the search saw it, against truth."""
    magnitude: float
    """Of the bias."""
    doubt: float
    """Distance between that bias and the one that verification reports."""


def outcome(
    problems: list[SeparableProblem],
    fronts: list[RealArray],
    make_sampler: Callable[[int], ToleranceSampler],
) -> Outcome:
    figures = []
    for seed, problem, best in zip(SEEDS, problems, fronts, strict=True):
        space = stiffness_factor_space(problem.variable_names)
        robust = RobustResponse(problem, space, make_sampler(seed))
        front = nsga2(robust, 100, 100, seed=seed).front
        truth = exact_objectives(problem, space, front.designs)
        ideal, nadir = best.min(axis=0), best.max(axis=0)
        kept, whole = (
            hypervolume((points - ideal) / (nadir - ideal), (1.1, 1.1)) for points in (truth, best)
        )
        bias = 100.0 * float(np.mean(front.sigma_sum / truth[:, 1] - 1.0))
        reported = verify(front, robust, seed=seed).sigma_bias_percent
        figures.append((100.0 * kept / whole, bias, abs(bias), abs(reported - bias)))
    return Outcome(*(float(figure) for figure in np.median(figures, axis=0)))


def claims() -> list[Claim]:
    lines = []
    for name, make in (("QUAD2", quad2), ("EXP1", exp1)):
        problems = [make(N_VARIABLES, seed=seed) for seed in SEEDS]
        fronts = [
            exact_front(problem, stiffness_factor_space(problem.variable_names))
            for problem in problems
        ]
        sobol, gaussian, fresh = (
            outcome(problems, fronts, make_sampler)
            for make_sampler in (
                lambda seed: sobol_sample(N_VARIABLES, seed=seed),
                lambda seed: gaussian_sample(N_VARIABLES, seed=seed),
                lambda seed: FreshGaussianSampler(N_VARIABLES, seed=seed),
            )
        )
        lines += [
            Claim(
                f"{name}, 128 shared Sobol points (default): hypervolume kept",
                "at least 90 %",
                f"{sobol.kept:.1f} %",
                sobol.kept >= 90.0,
            ),
            Claim(
                f"{name}, 128 shared Sobol points: size of the σ bias on the front",
                "at most 5 %",
                f"{sobol.magnitude:.1f} %",
                sobol.magnitude <= 5.0,
            ),
            Claim(
                f"{name}, 100 shared gaussian draws: hypervolume kept",
                "less than with Sobol points",
                f"{gaussian.kept:.1f} %, size of the σ bias {gaussian.magnitude:.1f} %",
                gaussian.kept < sobol.kept,
            ),
            Claim(
                f"{name}, 100 gaussian draws fresh for every design: hypervolume kept",
                "less than with shared draws",
                f"{fresh.kept:.1f} %",
                fresh.kept < gaussian.kept,
            ),
            Claim(
                f"{name}, fresh draws: σ under-reported by the search",
                "13 to 18 % (reported so by the warning, ± 3)",
                f"{-fresh.bias:.1f} %",
                10.0 <= -fresh.bias <= 21.0,
            ),
            Claim(
                f"{name}: σ bias printed by the verification against the exact bias",
                "within 1 % for each sampler",
                f"{max(sobol.doubt, gaussian.doubt, fresh.doubt):.2f} %",
                max(sobol.doubt, gaussian.doubt, fresh.doubt) <= 1.0,
            ),
        ]
    return lines
