"""Sigma from 128 draws.

The five U06 vehicles of the shipped platform: σ of each vehicle's SPLV at 8 designs drawn over the
bounds, from 128 shared Sobol points of 4 seeds, against 2^18 points. A control variate of degree 1
is a straight line in the draws, of degree 2 a parabola in each. What front it leads to is held by
tests on problems with a known one.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from claims import Claim, at_most
from deboom.explore.moments import Estimator
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.space import stiffness_factor_space
from deboom.files.platform import read_platform
from deboom.vehicles.booming_model import booming_model

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
ESTIMATORS = {
    "control variate, degree 1": Estimator(1),
    "control variate, degree 2": Estimator(2),
}
CHUNK = 2**13


def claims() -> list[Claim]:
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
    rows = []
    for name, estimator in ESTIMATORS.items():
        relative = [
            Robust(index, space, sobol_sample(space.n_variables, seed=seed), estimator=estimator)(
                designs
            ).sigma
            / truth
            - 1.0
            for seed in range(1, 5)
        ]
        error = 100.0 * float(np.sqrt(np.mean(np.square(relative))))
        rows.append(at_most(f"U06, {name}: rms error of σ [%]", 1.2, error))
    return rows
