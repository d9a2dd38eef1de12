"""Tolerances as variables: the same response with other tolerances, and their price."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import sobol_sample
from deboom.explore.tolerance_variables import ToleranceCost, ToleranceResponse

SLOPE = np.array([[1.0, 4.0, 0.5, 0.0]])
SPACE = stiffness_factor_space(("a", "b", "c", "d"))


def line(designs):
    return designs @ SLOPE.T


ROBUST = RobustResponse(
    ResponseFunction(line, SPACE.names, ("level",), "dB"), SPACE, sobol_sample(4, 64, seed=1)
)
COST = ToleranceCost(np.array([1.0, 1.0, 2.0, 1.0]), np.full(4, 0.15))
RESPONSE = ToleranceResponse(ROBUST, 0.02, 0.30, COST)


def test_values_are_those_of_a_response_with_these_tolerances():
    designs = np.array(
        [[1, 1, 1, 1, 0.15, 0.15, 0.15, 0.15], [0.9, 1.1, 1, 1, 0.05, 0.3, 0.1, 0.2]]
    )
    values = RESPONSE(designs)
    for row, design in enumerate(designs):
        space = replace(SPACE, tolerance=design[4:])
        alone = replace(ROBUST, space=space)(design[None, :4])
        np.testing.assert_array_equal(values.objectives[row, :2], alone.objectives[0])
        np.testing.assert_array_equal(values.mean[row], alone.mean[0])
    np.testing.assert_array_equal(values.designs, designs)
    expected = [0.0, 2.0 - 0.5 + 2 * 0.5 - 0.25]
    np.testing.assert_allclose(values.objectives[:, 2], expected, atol=1e-12)


def test_space_has_both_kinds_of_variables():
    space = RESPONSE.space
    assert space.names == ("a", "b", "c", "d", *(f"{n} tolerance" for n in "abcd"))
    np.testing.assert_array_equal(space.nominal, [1, 1, 1, 1, 0.15, 0.15, 0.15, 0.15])
    np.testing.assert_array_equal(space.upper, [1.2] * 4 + [0.3] * 4)
    assert RESPONSE.n_objectives == 3


def test_the_search_finds_the_cheapest_way_to_little_scatter():
    """Linear response: at the least cost for a scatter, t ∝ (w r / (slope x)²)^(1/3)."""
    fixed = replace(SPACE, lower=np.ones(4), upper=np.ones(4))
    robust = replace(ROBUST, space=fixed, nominal_mean=True)
    response = ToleranceResponse(robust, 0.02, 0.30, COST)
    front = nsga2(response, 40, 80, seed=1).front
    cost, sigma = front.objectives[:, 2], front.sigma_sum
    for wanted in (0.0, 2.0, 5.0):
        best = sigma[cost <= wanted].min()
        assert 0.99 < best / _least_scatter(wanted) < 1.08
    # without effect: as wide as allowed
    assert np.median(front.designs[:, 7]) > 0.25


def _least_scatter(cost):
    weight, slope = COST.weight * COST.reference, SLOPE[0]
    shape = np.cbrt(weight / np.maximum(slope, 1e-9) ** 2)
    low, high = 1e-3, 10.0
    for _ in range(80):
        middle = (low + high) / 2
        tolerance = np.clip(middle * shape, 0.02, 0.30)
        low, high = (middle, high) if COST(tolerance) > cost else (low, middle)
    return float(np.sqrt(((slope * tolerance / 3) ** 2).sum())) * 0.9867  # cut at three sigma


def test_failed_designs_fail_here_too():
    def broken(designs):
        return np.where(designs[:, :1] > 1.0, np.nan, line(designs))

    model = ResponseFunction(broken, SPACE.names, ("level",), "dB")
    response = ToleranceResponse(replace(ROBUST, evaluate=model), 0.02, 0.30, COST)
    values = response(response.space.nominal[None, :])
    assert values.failed.all()
    assert np.isnan(values.objectives).all()


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ToleranceCost(np.ones(4), np.zeros(4)), "references above 0"),
        (lambda: ToleranceCost(np.ones(4), np.ones(3)), "one weight and one reference"),
        (lambda: ToleranceResponse(ROBUST, 0.0, 0.3, COST), "cannot be made"),
        (lambda: ToleranceResponse(ROBUST, 0.2, 0.3, COST), "nominal value"),
        (
            lambda: ToleranceResponse(ROBUST, 0.1, 0.3, ToleranceCost(np.ones(3), np.ones(3))),
            "knows 3 tolerances",
        ),
    ],
)
def test_what_does_not_fit_is_refused(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()
