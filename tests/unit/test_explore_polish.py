"""Gradient steps never make a design worse and end on the front."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.known_truth import exact_front, exact_objectives, exp1, quad2
from deboom.explore.moments import SAMPLE_MOMENTS, ControlVariate
from deboom.explore.objectives import MEAN_SUM, Quantile, Total
from deboom.explore.polish import polish, sums_and_gradient
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import FreshGaussianSampler, sobol_sample
from deboom.explore.tolerance_structure import batches

BOTH = pytest.mark.parametrize("make", [quad2, exp1])


def robust_of(make, **changes):
    problem = make(6, seed=1)
    space = stiffness_factor_space(problem.variable_names)
    sample = changes.pop("sample", sobol_sample(6, 64, seed=1))
    return RobustResponse(problem, space, sample, **changes)


@BOTH
@pytest.mark.parametrize(
    "changes",
    [
        {"estimator": SAMPLE_MOMENTS},
        {"estimator": ControlVariate(1)},
        {"estimator": ControlVariate(2)},
        {"nominal_mean": True},
        {
            "structure": batches([f"x{i}" for i in range(1, 7)], {"a": ("x1", "x2")}, 0.5),
            "sample": sobol_sample(7, 64, seed=1),
        },
    ],
)
def test_gradients_are_those_of_differences(make, changes):
    robust = robust_of(make, **changes)
    design = 0.8 + 0.4 * np.random.default_rng(1).random(6)
    sums, gradient = sums_and_gradient(robust, design)
    values = robust(design[None, :])
    np.testing.assert_allclose(sums, values.objectives[0], rtol=1e-12)
    for place in (0, 1):
        difference = approx_fprime(design, lambda x, p=place: robust(x[None, :]).objectives[0, p])
        np.testing.assert_allclose(gradient[place], difference, rtol=2e-5, atol=1e-6)


@BOTH
def test_polished_designs_dominate_and_the_front_nears_the_truth(make):
    robust = robust_of(make, estimator=ControlVariate(2))
    front = nsga2(robust, 40, 25, seed=1).front
    polished = polish(robust, front, range(len(front)))
    before = front.objectives
    better = np.any(polished.objectives < before, axis=1)
    assert np.all(better | np.all(polished.objectives == before, axis=1))
    assert np.mean(polished.mean_sum < before[:, 0]) > 0.9
    assert np.all(polished.designs >= robust.space.lower)
    assert np.all(polished.designs <= robust.space.upper)
    best = exact_front(robust.evaluate, robust.space)
    gaps = []
    for values in (front, polished):
        truth = exact_objectives(robust.evaluate, robust.space, values.designs)
        least = np.interp(truth[:, 1], best[::-1, 1], best[::-1, 0])
        gaps.append(np.median(truth[:, 0] - least) / np.ptp(best[:, 0]))
    assert gaps[0] > 0.01
    assert -0.002 < gaps[1] < 0.2 * gaps[0]


def test_a_design_that_cannot_be_improved_stays():
    robust = robust_of(quad2)
    start = robust(nsga2(robust, 8, 2, seed=1).front.designs[:1])
    once = polish(robust, start, [0], steps=100)
    twice = polish(robust, once, [0], steps=100)
    np.testing.assert_allclose(twice.objectives, once.objectives, rtol=1e-5)
    none = polish(robust, start, [0], steps=1)
    assert np.any(none.objectives <= start.objectives)


def test_a_fixed_variable_stays_where_it_is():
    robust = robust_of(quad2)
    lower, upper = robust.space.lower.copy(), robust.space.upper.copy()
    lower[0] = upper[0] = 1.0
    robust = replace(robust, space=replace(robust.space, lower=lower, upper=upper))
    front = nsga2(robust, 8, 3, seed=1).front
    polished = polish(robust, front, [0])
    assert polished.designs[0, 0] == 1.0
    assert polished.mean_sum[0] < front.mean_sum[0]


def test_what_cannot_be_polished_is_refused():
    robust = robust_of(quad2)
    values = robust(np.ones((2, 6)))
    plain = ResponseFunction(
        robust.evaluate.__call__, robust.evaluate.variable_names, ("y1", "y2"), "1"
    )
    for changes, words in (
        ({"evaluate": plain}, "ResponseFunction offers no gradient"),
        ({"objectives": (MEAN_SUM, Total(Quantile(0.9)))}, "90 % quantile, sum"),
        ({"sample": FreshGaussianSampler(6, seed=1)}, "draws that they share"),
    ):
        with pytest.raises(InputError, match=words):
            polish(replace(robust, **changes), values, [0])
    with pytest.raises(InputError, match="at least one design"):
        polish(robust, values, [])
