"""Mean and standard deviation over the scatter, counted by hand; failures kept apart."""

import doctest
import pickle
from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore import evaluate as seam
from deboom.explore import known_truth
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import FreshGaussianSampler, ToleranceSample, sobol_sample

SPACE = stiffness_factor_space(("a", "b"))
DRAWS = ToleranceSample(np.array([[-1.0, 0.5], [0.0, -2.0], [1.0, 1.0]]), "by hand", seed=1)


def linear(designs):
    return designs @ np.array([[100.0, 10.0], [20.0, 50.0]])


def model(function=linear, responses=("u", "v")):
    return ResponseFunction(function, ("a", "b"), responses, "dB")


def test_statistics_by_hand():
    design = np.array([0.9, 1.1])
    made = design * (1.0 + 0.05 * DRAWS.values)
    answers = np.array([linear(row[None, :])[0] for row in made])
    values = RobustResponse(model(), SPACE, DRAWS)(design[None, :])
    np.testing.assert_allclose(values.mean[0], answers.mean(axis=0), rtol=1e-14)
    np.testing.assert_allclose(values.sigma[0], answers.std(axis=0, ddof=1), rtol=1e-13)
    np.testing.assert_allclose(values.mean_sum[0], answers.mean(axis=0).sum(), rtol=1e-14)
    np.testing.assert_allclose(values.sigma_sum, values.sigma.sum(axis=1), rtol=1e-14)
    total = answers.sum(axis=1)
    np.testing.assert_allclose(
        values.standard_error_mean_sum[0], total.std(ddof=1) / np.sqrt(3.0), rtol=1e-12
    )
    np.testing.assert_array_equal(values.designs, design[None, :])
    np.testing.assert_array_equal(values.objectives[0], [values.mean_sum[0], values.sigma_sum[0]])
    assert not values.failed.any()


def test_standard_error_of_sigma_by_hand():
    answers = np.array([1.0, 2.0, 4.0, 9.0])
    draws = ToleranceSample(answers[:, None], "by hand", seed=1)
    space = stiffness_factor_space(("a",), tolerance=0.3)
    one = ResponseFunction(lambda designs: designs, ("a",), ("u",), "1")
    values = RobustResponse(one, space, draws)(np.array([[1.0]]))
    made = 1.0 + 0.1 * answers
    variance = made.var(ddof=1)
    influence = ((made - made.mean()) ** 2 - variance) / (2.0 * np.sqrt(variance))
    np.testing.assert_allclose(
        values.standard_error_sigma_sum[0], influence.std(ddof=1) / 2.0, rtol=1e-12
    )


def test_standard_errors_honour_the_correlation_of_the_responses():
    sample = sobol_sample(2, 64, seed=1)
    same = model(lambda designs: np.repeat(linear(designs)[:, :1], 2, axis=1))
    alone = model(lambda designs: linear(designs)[:, :1], responses=("u",))
    twice = RobustResponse(same, SPACE, sample)(SPACE.nominal[None, :])
    once = RobustResponse(alone, SPACE, sample)(SPACE.nominal[None, :])
    for name in ("standard_error_mean_sum", "standard_error_sigma_sum"):
        np.testing.assert_allclose(getattr(twice, name), 2.0 * getattr(once, name), rtol=1e-12)


def test_nominal_mean_is_the_response_of_the_design_itself():
    sample = sobol_sample(2, 64, seed=1)
    curved = model(lambda designs: 100.0 * designs**2)
    design = np.array([[0.9, 1.1]])
    over_sample = RobustResponse(curved, SPACE, sample)(design)
    nominal = RobustResponse(curved, SPACE, sample, nominal_mean=True)(design)
    np.testing.assert_allclose(nominal.mean, 100.0 * design**2, rtol=1e-15)
    assert np.all(over_sample.mean > nominal.mean)  # curvature lifts the mean
    np.testing.assert_array_equal(over_sample.sigma, nominal.sigma)
    np.testing.assert_array_equal(nominal.standard_error_mean_sum, 0.0)


def test_without_tolerance_sigma_is_exactly_zero():
    space = replace(SPACE, tolerance=np.zeros(2))
    values = RobustResponse(model(), space, sobol_sample(2, 64, seed=1))(np.array([[0.9, 1.1]]))
    np.testing.assert_array_equal(values.sigma, 0.0)
    np.testing.assert_array_equal(values.standard_error_sigma_sum, 0.0)
    np.testing.assert_array_equal(values.mean, linear(np.array([[0.9, 1.1]])))


def test_one_call_per_design_with_all_its_draws():
    shapes = []

    def counting(designs):
        shapes.append(designs.shape)
        return linear(designs)

    RobustResponse(model(counting), SPACE, sobol_sample(2, 32, seed=1))(np.ones((5, 2)))
    assert shapes == [(32, 2)] * 5


@pytest.mark.parametrize("sampler", [sobol_sample(2, 32, seed=1), FreshGaussianSampler(2, seed=1)])
def test_a_design_has_the_same_values_in_any_batch(sampler):
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((7, 2))
    robust = RobustResponse(model(), SPACE, sampler)
    whole = robust(designs)
    backwards = robust(designs[::-1])
    for name in ("mean", "sigma", "standard_error_sigma_sum"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(backwards, name)[::-1])


def not_a_number(designs):
    return np.where(designs[:, :1] > 1.0, np.nan, linear(designs))


def infinite_in_one_response(designs):
    values = linear(designs)
    values[designs[:, 0] > 1.0, 1] = np.inf
    return values


def divides_by_zero(designs):
    if np.any(designs[:, 0] > 1.0):
        raise ZeroDivisionError
    return linear(designs)


def singular(designs):
    if np.any(designs[:, 0] > 1.0):
        np.linalg.inv(np.zeros((2, 2)))
    return linear(designs)


def overflows(designs):
    return np.where(designs[:, :1] > 1.0, 1e300 * designs, linear(designs))


@pytest.mark.parametrize(
    "function",
    [not_a_number, infinite_in_one_response, divides_by_zero, singular, overflows],
)
@pytest.mark.parametrize("nominal_mean", [False, True])
def test_a_design_that_cannot_be_computed_is_flagged_and_spoils_no_other(function, nominal_mean):
    designs = np.array([[0.8, 1.0], [1.2, 1.0], [0.82, 1.0]])
    sample = sobol_sample(2, 32, seed=1)
    values = RobustResponse(model(function), SPACE, sample, nominal_mean)(designs)
    np.testing.assert_array_equal(values.failed, [False, True, False])
    good = RobustResponse(model(), SPACE, sample, nominal_mean)(designs)
    for name in ("mean", "sigma", "mean_sum", "sigma_sum", "standard_error_sigma_sum"):
        column = getattr(values, name)
        assert np.all(np.isnan(column[1]))
        np.testing.assert_array_equal(column[[0, 2]], getattr(good, name)[[0, 2]])


def test_a_mistake_in_the_model_is_not_taken_for_a_failed_design():
    def mistaken(designs):
        return designs["a"]

    with pytest.raises(IndexError):
        RobustResponse(model(mistaken), SPACE, DRAWS)(np.ones((1, 2)))


def test_a_model_that_breaks_its_promised_shape_is_named():
    with pytest.raises(InputError, match=r"ResponseFunction gave .* \(3,\) .* return shape \(3, 2"):
        RobustResponse(model(lambda designs: designs[:, 0]), SPACE, DRAWS)(np.ones((1, 2)))


def test_variables_that_differ_are_refused():
    with pytest.raises(InputError, match="same names in the same order"):
        RobustResponse(model(), stiffness_factor_space(("b", "a")), DRAWS)
    with pytest.raises(InputError, match="3 columns for 2 design variables"):
        RobustResponse(model(), SPACE, sobol_sample(3, 32, seed=1))


def test_no_designs_give_no_values():
    values = RobustResponse(model(), SPACE, DRAWS)(np.empty((0, 2)))
    assert len(values) == 0
    assert values.mean.shape == (0, 2)


def test_a_process_pool_can_carry_the_robust_response():
    quad = known_truth.quad2(3, seed=1)
    space = stiffness_factor_space(quad.variable_names)
    robust = RobustResponse(quad, space, sobol_sample(3, 32, seed=1))
    carried = pickle.loads(pickle.dumps(robust))
    designs = np.full((2, 3), 0.9)
    np.testing.assert_array_equal(carried(designs).sigma, robust(designs).sigma)


def test_the_example_of_the_seam_holds():
    assert doctest.testmod(seam).attempted > 0
    assert doctest.testmod(seam).failed == 0
