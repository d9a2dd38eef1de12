"""The seam for the compressor's mounts: right about mounts never built.

The whole way in laboratories (level C2: gains of 2 %, places of 1.5 mm, angles of 1.5°), the
shipped one with the five shipped cars, each drawn one with a car of a drawn fleet: compressor and
sweeps identified, bodies struck with the compressor out, and 20 designs that nobody measured
predicted at the local maxima of the exact curves, 20 to 140 Hz. Then the study itself with its own
budget: what best-mean does in the exact cars.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from unittest.mock import patch

import numpy as np
from threadpoolctl import threadpool_limits

from claims import CASES, Claim, at_most, in_processes, over_draws
from deboom.arrays import RealArray
from deboom.bench.choices import CalibrationLevel
from deboom.compressor.hammer_identification import identify
from deboom.compressor.mounted_fleet import exact_levels, mounted_fleet
from deboom.explore.space import generator
from deboom.runs.compressor_fleet import virtual_fleet
from deboom.runs.runner import load_study

STUDY = load_study("compressor_front")
N_DESIGNS = 20
LEVEL = CalibrationLevel.C2
LINES = np.arange(20.0, 141.0, 2.0)


def claims() -> list[Claim]:
    """Measure all of it; two processes for the laboratories."""
    with threadpool_limits(1):
        return [*_laboratories(), *_study()]


def _laboratories() -> list[Claim]:
    bare, hosed, changes = zip(*in_processes(_laboratory, CASES), strict=True)
    return [
        *(
            over_draws(
                f"Unbuilt mounts {words}, error at peaks, {share:g} % of a laboratory's peaks [dB]",
                [np.percentile(error, share) for error in errors],
                {1.0: most},
            )
            for words, errors in (("without hoses", bare), ("with identified hoses", hosed))
            for share, most in ((50, 0.5), (90, 3.0))
        ),
        over_draws("Change of the mean level by other mounts, rms error [dB]", changes, {1.0: 0.2}),
    ]


def _laboratory(seed: int) -> tuple[RealArray, RealArray, float]:
    study = STUDY.module
    options = study.Options(parts=study.Parts.separate, place_tolerance=0.0)
    fleet = virtual_fleet(seed, LEVEL, None if seed == CASES[0] else seed)
    if seed != CASES[0]:
        assert fleet.truth is not None
        alone = slice(seed % 5, seed % 5 + 1)
        truth = replace(fleet.truth, bodies=fleet.truth.bodies[alone])
        fleet = replace(fleet, cars=fleet.cars[alone], truth=truth)
    identify_once = cache(identify)
    errors = []
    for hoses in (True, False):
        with patch("deboom.compressor.mounted_fleet.identify", identify_once):
            model = mounted_fleet(
                fleet, LINES, {}, lambda _: None, identical=False, with_hoses=hoses, places=False
            )
        space = study.design_space(model.index.variables, options)
        size = (N_DESIGNS, space.n_variables)
        drawn = generator(seed, "agreement").uniform(space.lower, space.upper, size)
        designs = np.vstack([space.nominal, drawn])
        exact = exact_levels(model, designs, model.index.case_names[0])
        assert exact is not None
        predicted = model.index.levels(designs)
        middle = exact[..., 1:-1]
        peaks = (middle > exact[..., :-2]) & (middle >= exact[..., 2:])
        errors.append(np.abs((predicted - exact)[..., 1:-1][peaks]))
    change, true = ((x[1:] - x[:1]).mean(axis=-1) for x in (predicted, exact))
    return errors[1], errors[0], float(np.sqrt(np.mean((change - true) ** 2)))


def _study() -> list[Claim]:
    summary = STUDY.report({"seed": 1}).summary
    model, exact = float(summary["mean_change_db"]), float(summary["exact_mean_change_db"])
    sigma = float(summary["sigma_change_percent_best_mean"])
    return [
        Claim(
            "Best-mean of the study within 1.2 times the travel: mean level, model and exact cars",
            "a fall; within 0.3 dB of each other",
            f"{model:.2f} dB, {exact:.2f} dB",
            exact < 0 and abs(model - exact) <= 0.3,
        ),
        at_most("Its scatter against today's mounts [%]", 0, sigma, 0),
    ]
