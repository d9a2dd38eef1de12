"""Control variates: exact where the model is what they explain, better elsewhere, never wrong."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.known_truth import exact_objectives, exp1, quad2
from deboom.explore.moments import SAMPLE_MOMENTS, ControlVariate, sample_statistics
from deboom.explore.robust import RobustResponse
from deboom.explore.sigma_shares import sigma_shares
from deboom.explore.tolerance_samples import (
    FreshGaussianSampler,
    cut_normal_moments,
    gaussian_sample,
    sobol_sample,
)
from deboom.explore.tolerance_structure import shared_parts

NAMES = ("x1", "x2", "x3")
SPACE = stiffness_factor_space(NAMES)
SLOPES = np.array([[3.0, -1.0], [0.5, 2.0], [0.0, 4.0]])
M2, M4 = cut_normal_moments()


def line(designs):
    return 7.0 + designs @ SLOPES


def parabola(designs):
    return 7.0 + designs**2 @ SLOPES


def response(function, sample, estimator, **changes):
    model = ResponseFunction(function, NAMES, ("y1", "y2"), "1")
    return RobustResponse(model, SPACE, sample, estimator=estimator, **changes)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize(
    "sample", [gaussian_sample(3, 16, seed=1), FreshGaussianSampler(3, 16, seed=1)]
)
def test_of_a_line_the_moments_are_exact_from_a_few_draws(degree, sample):
    design = np.array([[0.9, 1.1, 1.0]])
    values = response(line, sample, ControlVariate(degree))(design)
    np.testing.assert_allclose(values.mean, line(design), rtol=1e-12)
    sigma = np.sqrt(M2 * ((0.05 * design.T * SLOPES) ** 2).sum(axis=0))
    np.testing.assert_allclose(values.sigma[0], sigma, rtol=1e-12)
    assert values.standard_error_mean_sum[0] < 1e-12
    assert values.standard_error_sigma_sum[0] < 1e-12


def test_of_a_parabola_degree_2_is_exact():
    design = np.array([[0.9, 1.1, 1.0]])
    values = response(parabola, gaussian_sample(3, 16, seed=1), ControlVariate(2))(design)
    scatter = 0.05 * design
    mean = 7.0 + (design**2 + M2 * scatter**2) @ SLOPES
    variance = (4.0 * design**2 * scatter**2 * M2 + scatter**4 * (M4 - M2**2)) @ SLOPES**2
    np.testing.assert_allclose(values.mean, mean, rtol=1e-12)
    np.testing.assert_allclose(values.sigma, np.sqrt(variance), rtol=1e-12)


@pytest.mark.parametrize("make", [quad2, exp1])
def test_the_error_of_sigma_falls_with_the_degree(make):
    """128 gaussian draws, 30 seeds, against the exact sigma."""
    problem = make(6, seed=1)
    space = stiffness_factor_space(problem.variable_names)
    design = np.full((1, 6), 0.95)
    truth = exact_objectives(problem, space, design)[0, 1]
    errors = [
        np.sqrt(
            np.mean(
                [
                    (
                        RobustResponse(
                            problem, space, gaussian_sample(6, 128, seed=seed), estimator=estimator
                        )(design).sigma_sum[0]
                        / truth
                        - 1.0
                    )
                    ** 2
                    for seed in range(1, 31)
                ]
            )
        )
        for estimator in (SAMPLE_MOMENTS, ControlVariate(1), ControlVariate(2))
    ]
    assert errors[0] > 3.0 * errors[1] > 6.0 * errors[2]


def test_standard_errors_are_those_of_repeated_draws():
    """Over 300 samples both sums scatter as stated, ±15 %."""
    problem = exp1(4, seed=1)
    space = replace(stiffness_factor_space(problem.variable_names), tolerance=np.full(4, 0.45))
    design = np.ones((1, 4))
    runs = [
        RobustResponse(
            problem, space, gaussian_sample(4, 100, seed=seed), estimator=ControlVariate(1)
        )(design)
        for seed in range(1, 301)
    ]
    for figure, error in (
        ("mean_sum", "standard_error_mean_sum"),
        ("sigma_sum", "standard_error_sigma_sum"),
    ):
        scatter = np.std([getattr(run, figure)[0] for run in runs], ddof=1)
        stated = np.mean([getattr(run, error)[0] for run in runs])
        assert stated == pytest.approx(scatter, rel=0.15)


def test_without_scatter_sigma_is_exactly_zero():
    values = np.full((16, 2), 0.1)
    normals = gaussian_sample(3, 16, seed=1).values
    for moments in (sample_statistics(values), ControlVariate(2)(normals)(values)):
        np.testing.assert_array_equal(moments.sigma, 0.0)
        np.testing.assert_array_equal(moments.mean, 0.1)
        assert (moments.mean_error, moments.sigma_error) == (0.0, 0.0)


def test_what_cannot_be_fitted_is_refused():
    with pytest.raises(InputError, match="degree 3"):
        ControlVariate(3)
    with pytest.raises(InputError, match="take at least 8"):
        response(line, gaussian_sample(3, 7, seed=1), ControlVariate(2))(np.ones((1, 3)))
    assert "degree 2" in ControlVariate(2).kind
    assert SAMPLE_MOMENTS.kind


def test_shares_of_a_line_are_its_squared_slopes():
    robust = response(line, sobol_sample(3, 32, seed=1), SAMPLE_MOMENTS)
    design = np.array([1.0, 0.8, 1.2])
    shares = sigma_shares(robust, design)
    part = (design[:, None] * SLOPES) ** 2
    np.testing.assert_allclose(shares.of_response, part / part.sum(axis=0), atol=1e-12)
    np.testing.assert_allclose(shares.rest, 0.0, atol=1e-12)
    sigma = np.sqrt(part.sum(axis=0))
    np.testing.assert_allclose(shares.of_sum, (part / sigma).sum(axis=1) / sigma.sum(), atol=1e-12)
    assert shares.names == NAMES


def test_shares_leave_a_rest_and_know_shared_parts():
    def product(designs):
        return np.repeat(designs[:, :1] * designs[:, 1:2], 2, axis=1)

    robust = response(product, sobol_sample(3, 64, seed=1), SAMPLE_MOMENTS)
    shares = sigma_shares(robust, np.ones(3), degree=2)
    np.testing.assert_allclose(shares.of_response.sum(axis=0) + shares.rest, 1.0)
    assert np.all(shares.rest > 1e-4)
    structure = shared_parts(NAMES, {"bush": ("x1", "x2")})
    together = replace(robust, structure=structure, sample=sobol_sample(2, 64, seed=1))
    shares = sigma_shares(together, np.ones(3), degree=2)
    assert shares.names == ("part bush", "x3")
    np.testing.assert_allclose(shares.of_response[0], 1.0, atol=1e-3)


def test_shares_of_nothing_and_of_a_failed_design():
    constant = response(
        lambda designs: np.ones((len(designs), 2)), sobol_sample(3, 32, seed=1), SAMPLE_MOMENTS
    )
    shares = sigma_shares(constant, np.ones(3))
    for figures in (shares.of_response, shares.rest, shares.of_sum):
        np.testing.assert_array_equal(figures, 0.0)
    broken = response(
        lambda designs: np.full((len(designs), 2), np.nan),
        sobol_sample(3, 32, seed=1),
        SAMPLE_MOMENTS,
    )
    with pytest.raises(InputError, match="fails itself"):
        sigma_shares(broken, np.ones(3))
