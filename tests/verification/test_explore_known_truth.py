"""The robust search against closed forms, other codes and a published front.

QUAD2 and EXP1 are sums over variables of functions whose mean and variance under the cut normal
scatter are known, so that samples, standard errors, searches and verification meet exact figures.
ZDT1 (Zitzler, Deb, Thiele, Evolutionary Computation 8, 2000) has the hypervolume 0.876667 up to
the reference point (1.1, 1.1).
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy import optimize, stats

from deboom.explore import scatter as tolerance_samples
from deboom.explore.front import nondominated, replicates, search_bias, unbeaten
from deboom.explore.front import verified as verified_values
from deboom.explore.moments import Estimator
from deboom.explore.robust import Robust
from deboom.explore.scatter import FreshGaussianSampler, gaussian_sample, sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.space import stiffness_factor_space
from samples import known_truth
from samples.known_truth import exact_front, exact_objectives, exp1, quad2

CUT_NORMAL = stats.truncnorm(-3.0, 3.0)
BOTH = pytest.mark.parametrize("make", [quad2, exp1])


def instance(make, n_variables=12, seed=1):
    problem = make(n_variables, seed=seed)
    return problem, stiffness_factor_space(problem.variable_names)


def designs_in(space, n, seed=1):
    fractions = np.random.default_rng(seed).random((n, space.n_variables))
    return space.lower + (space.upper - space.lower) * fractions


def test_draws_follow_the_cut_normal_distribution():
    for sampler, tolerance in (
        (sobol_sample(3, 2**12, seed=1), 0.0005),
        (gaussian_sample(3, 2**12, seed=1), 0.03),
        (FreshGaussianSampler(3, 2**12, seed=1), 0.03),
    ):
        draws = np.sort(sampler.normals(np.ones(3)), axis=0)
        reached = CUT_NORMAL.cdf(draws)
        expected = (np.arange(2**12)[:, None] + 0.5) / 2**12
        assert np.abs(reached - expected).max() < tolerance


def test_moments_of_the_cut_normal_distribution_against_scipy():
    moments = [CUT_NORMAL.moment(2), CUT_NORMAL.moment(4)]
    np.testing.assert_allclose(known_truth.cut_normal_moments(), moments, rtol=1e-9)
    np.testing.assert_allclose(tolerance_samples.cut_normal_moments(), moments, rtol=1e-12)
    arguments = np.array([0.0, 0.1, 0.5, 1.0])
    expected = [CUT_NORMAL.expect(lambda z, t=t: np.exp(t * z)) for t in arguments]
    np.testing.assert_allclose(known_truth.cut_normal_mgf(arguments), expected, rtol=1e-9)


@BOTH
def test_exact_mean_and_variance_against_numerical_integration(make):
    problem, space = instance(make, 1)
    for x in (0.8, 0.97, 1.2):
        mean, variance = problem.exact_terms(np.array([[x]]), space.relative_sigma)
        for response in range(mean.shape[1]):

            def y(z, x=x, response=response):
                return problem(np.array([[x * (1.0 + 0.05 * z)]]))[0, response]

            first = CUT_NORMAL.expect(np.vectorize(y))
            second = CUT_NORMAL.expect(np.vectorize(lambda z, m=first: (y(z) - m) ** 2))
            np.testing.assert_allclose(mean[0, response, 0], first, rtol=1e-9)
            np.testing.assert_allclose(variance[0, response, 0], second, rtol=1e-8)


@BOTH
def test_the_default_sample_gives_mean_and_sigma(make):
    """128 shared Sobol points: 0.1 % rms in the mean and 4 % rms in sigma; 2^14: 0.05 %."""
    problem, space = instance(make)
    designs = designs_in(space, 40)
    truth = exact_objectives(problem, space, designs)
    for n_samples, mean_error, sigma_error in ((128, 1e-3, 0.04), (2**14, 1e-5, 5e-4)):
        robust = Robust(problem, space, sobol_sample(12, n_samples, seed=1))
        error = robust(designs).objectives / truth - 1.0
        assert np.sqrt(np.mean(error[:, 0] ** 2)) < mean_error
        assert np.sqrt(np.mean(error[:, 1] ** 2)) < sigma_error


@pytest.mark.parametrize("degree", [0, 1])
@BOTH
def test_standard_errors_are_the_scatter_between_samples(make, degree):
    """Over 400 gaussian samples: mean and sigma sums scatter as the standard errors say, ±10 %."""
    problem, space = instance(make, 6)
    design, estimator = designs_in(space, 1), Estimator(degree)
    runs = [
        Robust(problem, space, gaussian_sample(6, 200, seed=seed), estimator=estimator)(design)
        for seed in range(1, 401)
    ]
    for figure, error in (
        ("mean_sum", "standard_error_mean_sum"),
        ("sigma_sum", "standard_error_sigma_sum"),
    ):
        scatter = np.std([getattr(run, figure)[0] for run in runs], ddof=1)
        stated = np.mean([getattr(run, error)[0] for run in runs])
        assert stated == pytest.approx(scatter, rel=0.1)


@BOTH
def test_for_sobol_points_the_standard_error_is_an_upper_bound(make):
    problem, space = instance(make, 6)
    design = designs_in(space, 1)
    truth = exact_objectives(problem, space, design)[0]
    runs = [
        Robust(problem, space, sobol_sample(6, 128, seed=seed))(design) for seed in range(1, 101)
    ]
    errors = np.array([run.objectives[0] - truth for run in runs])
    stated = np.array(
        [[run.standard_error_mean_sum[0], run.standard_error_sigma_sum[0]] for run in runs]
    )
    assert np.all(np.sqrt(np.mean(errors**2, axis=0)) < stated.mean(axis=0))


@BOTH
def test_the_exact_front_against_a_gradient_optimiser(make):
    """The front reaches what SLSQP finds for mean + weight · sigma, to 0.2 % of its range."""
    problem, space = instance(make, 5)
    front = exact_front(problem, space)
    span = np.ptp(front, axis=0)
    for weight in span[0] / span[1] * np.array([0.3, 1.0, 3.0]):

        def cost(x, weight=weight):
            return float(exact_objectives(problem, space, x[None, :])[0] @ [1.0, weight])

        best = min(
            optimize.minimize(
                cost,
                start,
                method="SLSQP",
                bounds=list(zip(space.lower, space.upper, strict=True)),
                options={"ftol": 1e-12},
            ).fun
            for start in designs_in(space, 3)
        )
        reached = np.min(front @ [1.0, weight])
        assert reached == pytest.approx(best, abs=2e-3 * span[0])


@BOTH
def test_verification_reports_the_true_bias(make):
    problem, space = instance(make, 6)
    for sampler in (sobol_sample(6, seed=1), FreshGaussianSampler(6, seed=1)):
        robust = Robust(problem, space, sampler)
        front = nsga2(robust, Search(40, 25, seed=1)).front
        verified = verified_values(front, replicates(robust, 1024, seed=1))
        mean_bias, sigma_bias = search_bias(front, verified)
        truth = exact_objectives(problem, space, front.designs)
        bias = front.objectives - truth
        assert mean_bias == pytest.approx(bias[:, 0].mean(), abs=0.002 * np.ptp(truth[:, 0]))
        true_bias = 100.0 * np.mean(bias[:, 1] / truth[:, 1])
        assert sigma_bias == pytest.approx(true_bias, abs=1.0)
    assert sigma_bias < -10.0  # fresh draws under-report
    assert np.mean(unbeaten(verified)) == pytest.approx(np.mean(nondominated(truth)), abs=0.3)


def test_without_tolerance_the_search_is_a_plain_minimisation():
    """Sigma is zero everywhere: the front is one design, at the minimum of the mean."""
    problem, space = instance(quad2, 4)
    exact = replace(space, tolerance=np.zeros(4))
    robust = Robust(problem, exact, sobol_sample(4, 2, seed=1))
    front = nsga2(robust, Search(40, 60, seed=1)).front
    w, c = problem.weights, problem.targets
    best = np.clip((w * c).sum(axis=0) / w.sum(axis=0), space.lower, space.upper)
    assert len(front) == 1
    np.testing.assert_allclose(front.designs[0], best, atol=2e-3)
    np.testing.assert_array_equal(front.sigma_sum, 0.0)


def test_verified_numbers_lie_within_their_intervals():
    """Of 400 verifications 95 % hold the truth, which ±1.96 standard errors do in 86 %."""
    model = quad2(4, seed=1)
    space = stiffness_factor_space(model.variable_names)
    robust = Robust(model, space, sobol_sample(4, 16, seed=1))
    designs = space.nominal[np.newaxis] * [[0.9], [1.1]]
    mean, _ = (part.sum(axis=(1, 2)) for part in model.exact_terms(designs, space.relative_sigma))
    held, short = 0, 0
    for seed in range(1, 201):
        judge = replicates(robust, 32, seed=seed)
        values = judge(designs)
        off = np.abs(values.mean_sum - mean)
        held += int(np.sum(off <= judge.interval * values.standard_error_mean_sum))
        short += int(np.sum(off <= 1.96 * values.standard_error_mean_sum))
    # three standard deviations of 400 independent ones are 13
    assert 367 <= held <= 393
    assert short < 360
