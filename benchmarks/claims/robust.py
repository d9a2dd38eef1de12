"""Sigma from 128 draws, and the front it leads to.

The first figures belong to the five U06 vehicles of the shipped platform: σ of each vehicle's SPLV
at 8 designs drawn over the bounds, from 128 shared Sobol points of 4 seeds, against 2^18 points.
A control variate of degree 1 is a straight line in the draws, of degree 2 a parabola in each.

The others belong to instances of QUAD2 and EXP1, 12 variables in ±20 %, made with ±15 %:
NSGA-II with 100 designs × 150 generations and σ from 128 shared Sobol points, degree 2. Kept is the
true hypervolume of the designs found against that of the true front, both scaled to its ideal and
nadir, up to (1.1, 1.1). Both problems are sums over the variables, which a control variate of
degree 2 suits better than it will suit a real model: hence the first figures.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from claims import Claim, at_least, at_most, draws
from deboom.explore.front import hypervolume
from deboom.explore.moments import Estimator
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.space import stiffness_factor_space
from deboom.files.platform import read_platform
from deboom.vehicles.booming_model import booming_model
from known_truth import exact_front, exact_objectives, exp1, quad2

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
ESTIMATORS = {
    "control variate, degree 1": Estimator(1),
    "control variate, degree 2": Estimator(2),
}
PROBLEMS = {"QUAD2": quad2, "EXP1": exp1}
INSTANCES = draws(3)
CHUNK = 2**13


def fleet_errors() -> dict[str, float]:
    """Return the rms error of σ per vehicle, of each estimator [%]."""
    data = read_platform(PLATFORM)
    cases = [(data.load_case(data.default_load_case), 1.0)]
    index = booming_model(data.fleet.group("U06"), data.mounts, cases, (20, 60))
    space = stiffness_factor_space(index.variable_names)
    draw = np.random.default_rng(1).random((8, space.n_variables))
    designs = space.lower + draw * (space.upper - space.lower)
    many = sobol_sample(space.n_variables, 2**18, seed=1, purpose="truth").values
    truth = np.empty((len(designs), len(index.response_names)))
    for row, design in zip(truth, designs, strict=True):
        parts = [
            index(design * (1.0 + space.relative_sigma * many[start : start + CHUNK]))
            for start in range(0, len(many), CHUNK)
        ]
        row[:] = np.concatenate(parts).std(axis=0, ddof=1)
    errors = {}
    for name, estimator in ESTIMATORS.items():
        relative = [
            RobustResponse(
                index, space, sobol_sample(space.n_variables, seed=seed), estimator=estimator
            )(designs).sigma
            / truth
            - 1.0
            for seed in range(1, 5)
        ]
        errors[name] = 100.0 * float(np.sqrt(np.mean(np.square(relative))))
    return errors


def front_kept(task: tuple[str, int]) -> tuple[float, float]:
    """Return the true hypervolume kept and the mean bias of σ on the front of an instance [%]."""
    name, seed = task
    problem = PROBLEMS[name](12, seed=seed)
    space = stiffness_factor_space(problem.variable_names)
    sample = sobol_sample(12, seed=seed)
    robust = RobustResponse(problem, space, sample, estimator=Estimator(2))
    front = nsga2(robust, 100, 150, seed=seed).front
    truth = exact_objectives(problem, space, front.designs)
    best = exact_front(problem, space)
    ideal, nadir = best.min(axis=0), best.max(axis=0)
    kept, whole = (
        hypervolume((points - ideal) / (nadir - ideal), (1.1, 1.1)) for points in (truth, best)
    )
    bias = float(np.mean(front.sigma_sum / truth[:, 1] - 1.0))
    return 100.0 * kept / whole, 100.0 * bias


def claims() -> list[Claim]:
    errors = fleet_errors()
    lines = [
        at_most(f"U06, {name}: rms error of σ [%]", 1.2, error) for name, error in errors.items()
    ]
    tasks = [(name, seed) for name in PROBLEMS for seed in range(1, INSTANCES + 1)]
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        outcomes = dict(zip(tasks, pool.map(front_kept, tasks), strict=True))
    for name in PROBLEMS:
        figures = np.array([outcomes[name, seed] for seed in range(1, INSTANCES + 1)])
        kept, bias = figures.T
        lines += [
            at_least(
                f"{name}: true hypervolume kept, median of {INSTANCES} instances [%]",
                97,
                np.median(kept),
                1,
            ),
            at_most(
                f"{name}: size of the σ bias on the front, median [%]", 1, np.median(abs(bias))
            ),
        ]
    return lines
