"""Robust responses: moments, objectives and limits."""

import doctest
from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore import space as seam
from deboom.explore.front import nondominated, pareto_front, replicates
from deboom.explore.front import verified as verified_values
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM, Draws, Estimator, Limit, Objective
from deboom.explore.robust import Robust, sigma_shares
from deboom.explore.scatter import (
    FreshGaussianSampler,
    ToleranceSample,
    ToleranceStructure,
    cut_normal_moments,
    gaussian_sample,
    sobol_sample,
)
from deboom.explore.search import Search, nsga2
from deboom.explore.selection import pick
from deboom.explore.space import ResponseFunction, stiffness_factor_space
from samples.known_truth import quad2

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
    values = Robust(model(), SPACE, DRAWS)(design[None, :])
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
    response = ResponseFunction(lambda designs: designs, ("a",), ("u",), "1")
    values = Robust(response, space, draws)(np.array([[1.0]]))
    made = 1.0 + 0.1 * answers
    variance = made.var(ddof=1)
    influence = ((made - made.mean()) ** 2 - variance) / (2.0 * np.sqrt(variance))
    np.testing.assert_allclose(
        values.standard_error_sigma_sum[0], influence.std(ddof=1) / 2.0, rtol=1e-12
    )


@pytest.mark.parametrize("degree", [1, 2])
def test_the_standard_error_of_a_mean_is_that_of_what_each_draw_surprises_the_others_by(degree):
    """Few draws pull the fit towards themselves: least squares without each in turn do not."""
    random = np.random.default_rng(1)
    draws, responses = random.uniform(-2.0, 2.0, (9, 2)), random.standard_normal((9, 1))
    terms = np.hstack([np.ones((9, 1)), *(draws**power for power in range(1, degree + 1))])
    surprise = np.empty(9)
    for left_out in range(9):
        others = np.arange(9) != left_out
        fit = np.linalg.lstsq(terms[others], responses[others, 0], rcond=None)[0]
        surprise[left_out] = responses[left_out, 0] - terms[left_out] @ fit
    moments = Estimator(degree)(draws).moments(responses)
    assert moments.mean_error == pytest.approx(surprise.std(ddof=1) / 3.0, rel=1e-9)


def test_standard_errors_honour_the_correlation_of_the_responses():
    sample = sobol_sample(2, 64, seed=1)
    same = model(lambda designs: np.repeat(linear(designs)[:, :1], 2, axis=1))
    alone = model(lambda designs: linear(designs)[:, :1], responses=("u",))
    twice = Robust(same, SPACE, sample)(SPACE.nominal[None, :])
    once = Robust(alone, SPACE, sample)(SPACE.nominal[None, :])
    for name in ("standard_error_mean_sum", "standard_error_sigma_sum"):
        np.testing.assert_allclose(getattr(twice, name), 2.0 * getattr(once, name), rtol=1e-12)


def test_nominal_mean_is_the_response_of_the_design_itself():
    sample = sobol_sample(2, 64, seed=1)
    curved = model(lambda designs: 100.0 * designs**2)
    design = np.array([[0.9, 1.1]])
    over_sample = Robust(curved, SPACE, sample)(design)
    nominal = Robust(curved, SPACE, sample, nominal_mean=True)(design)
    np.testing.assert_allclose(nominal.mean, 100.0 * design**2, rtol=1e-15)
    assert np.all(over_sample.mean > nominal.mean)  # curvature lifts the mean
    np.testing.assert_array_equal(over_sample.sigma, nominal.sigma)
    np.testing.assert_array_equal(nominal.standard_error_mean_sum, 0.0)


@pytest.mark.parametrize("sampler", [sobol_sample(2, 32, seed=1), FreshGaussianSampler(2, seed=1)])
def test_a_design_has_the_same_values_in_any_batch(sampler):
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((7, 2))
    robust = Robust(model(), SPACE, sampler)
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
    "function", [not_a_number, infinite_in_one_response, divides_by_zero, singular, overflows]
)
@pytest.mark.parametrize("nominal_mean", [False, True])
def test_a_design_that_cannot_be_computed_is_flagged_and_spoils_no_other(function, nominal_mean):
    designs = np.array([[0.8, 1.0], [1.2, 1.0], [0.82, 1.0]])
    sample = sobol_sample(2, 32, seed=1)
    values = Robust(model(function), SPACE, sample, nominal_mean)(designs)
    np.testing.assert_array_equal(values.failed, [False, True, False])
    good = Robust(model(), SPACE, sample, nominal_mean)(designs)
    for name in ("mean", "sigma", "mean_sum", "sigma_sum", "standard_error_sigma_sum"):
        column = getattr(values, name)
        assert np.all(np.isnan(column[1]))
        np.testing.assert_array_equal(column[[0, 2]], getattr(good, name)[[0, 2]])


def test_what_is_left_of_a_design_that_fails_in_some_draws():
    robust = Robust(model(not_a_number), SPACE, sobol_sample(2, 32, seed=1))
    design = np.array([0.99, 1.0])
    assert robust(design[np.newaxis]).failed[0]
    made = robust.made(design)
    computed = np.isfinite(not_a_number(made)).all(axis=1)
    assert 0 < computed.sum() < 32
    share, mean = robust.survivors(design)
    assert share == 1 - computed.mean()
    assert mean == pytest.approx(linear(made[computed]).mean(axis=0).sum())
    assert robust.survivors(np.array([0.7, 1.0]))[0] == 0.0
    for function in (singular, lambda designs: designs * np.nan):
        share, mean = Robust(model(function), SPACE, robust.sample).survivors(design + 0.2)
        assert share == 1.0
        assert np.isnan(mean)


def test_a_mistake_in_the_model_is_a_failed_design_that_says_so():
    def mistaken(designs):
        return designs["a"]

    values = Robust(model(mistaken), SPACE, DRAWS)(np.ones((1, 2)))
    assert values.failed.all()
    assert values.message[0].startswith("IndexError: only integers")


def test_the_example_of_the_seam_holds():
    assert doctest.testmod(seam).attempted > 0
    assert doctest.testmod(seam).failed == 0


NAMES = ("x1", "x2", "x3")
SPACE_2 = stiffness_factor_space(NAMES)
SLOPES = np.array([[3.0, -1.0], [0.5, 2.0], [0.0, 4.0]])
M2, M4 = cut_normal_moments()


def line(designs):
    return 7.0 + designs @ SLOPES


def parabola(designs):
    return 7.0 + designs**2 @ SLOPES


def response(function, sample, estimator, **changes):
    model = ResponseFunction(function, NAMES, ("y1", "y2"), "1")
    return Robust(model, SPACE_2, sample, estimator=estimator, **changes)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize(
    "sample", [gaussian_sample(3, 16, seed=1), FreshGaussianSampler(3, 16, seed=1)]
)
def test_of_a_line_the_moments_are_exact_from_a_few_draws(degree, sample):
    design = np.array([[0.9, 1.1, 1.0]])
    values = response(line, sample, Estimator(degree))(design)
    np.testing.assert_allclose(values.mean, line(design), rtol=1e-12)
    sigma = np.sqrt(M2 * ((0.05 * design.T * SLOPES) ** 2).sum(axis=0))
    np.testing.assert_allclose(values.sigma[0], sigma, rtol=1e-12)
    assert values.standard_error_mean_sum[0] < 1e-12
    assert values.standard_error_sigma_sum[0] < 1e-12


def test_of_a_parabola_degree_2_is_exact():
    design = np.array([[0.9, 1.1, 1.0]])
    values = response(parabola, gaussian_sample(3, 16, seed=1), Estimator(2))(design)
    scatter = 0.05 * design
    mean = 7.0 + (design**2 + M2 * scatter**2) @ SLOPES
    variance = (4.0 * design**2 * scatter**2 * M2 + scatter**4 * (M4 - M2**2)) @ SLOPES**2
    np.testing.assert_allclose(values.mean, mean, rtol=1e-12)
    np.testing.assert_allclose(values.sigma, np.sqrt(variance), rtol=1e-12)


def test_without_scatter_sigma_is_exactly_zero():
    values = np.full((16, 2), 0.1)
    normals = gaussian_sample(3, 16, seed=1).values
    for degree in (0, 2):
        moments = Estimator(degree)(normals).moments(values)
        np.testing.assert_array_equal(moments.sigma, 0.0)
        np.testing.assert_array_equal(moments.mean, 0.1)
        assert (moments.mean_error, moments.sigma_error) == (0.0, 0.0)


def test_shares_of_a_line_are_its_squared_slopes():
    robust = response(line, sobol_sample(3, 32, seed=1), Estimator())
    design = np.array([1.0, 0.8, 1.2])
    shares = sigma_shares(robust, design)
    part = (design[:, None] * SLOPES) ** 2
    np.testing.assert_allclose(shares.of_response, part / part.sum(axis=0), atol=1e-12)
    np.testing.assert_allclose(shares.rest, 0.0, atol=1e-12)
    sigma = np.sqrt(part.sum(axis=0))
    np.testing.assert_allclose(shares.of_sum, (part / sigma).sum(axis=1) / sigma.sum(), atol=1e-12)
    assert shares.names == NAMES
    weights = np.array([3.0, *np.ones(sigma.size - 1)])
    weighted = sigma_shares(replace(robust, weights=weights), design)
    expected = (weights * part / sigma).sum(axis=1) / (weights * sigma).sum()
    np.testing.assert_allclose(weighted.of_sum, expected, atol=1e-12)
    np.testing.assert_array_equal(weighted.of_response, shares.of_response)


def test_shares_leave_a_rest_and_know_shared_parts():
    def product(designs):
        return np.repeat(designs[:, :1] * designs[:, 1:2], 2, axis=1)

    robust = response(product, sobol_sample(3, 64, seed=1), Estimator())
    shares = sigma_shares(robust, np.ones(3), degree=2)
    np.testing.assert_allclose(shares.of_response.sum(axis=0) + shares.rest, 1.0)
    assert np.all(shares.rest > 1e-4)
    structure = ToleranceStructure(NAMES, np.array([[1, 0], [1, 0], [0, 1]]), ("bush", "x3"))
    together = replace(robust, structure=structure, sample=sobol_sample(2, 64, seed=1))
    shares = sigma_shares(together, np.ones(3), degree=2)
    assert shares.names == ("bush", "x3")
    np.testing.assert_allclose(shares.of_response[0], 1.0, atol=1e-3)


def test_shares_are_those_of_a_straight_line_by_default():
    squares = response(lambda x: x[:, :2] ** 2, sobol_sample(3, 64, seed=1), Estimator())
    assert np.all(sigma_shares(squares, np.ones(3)).rest > 1e-5)
    np.testing.assert_allclose(sigma_shares(squares, np.ones(3), degree=2).rest, 0.0, atol=1e-12)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_moments_have_exact_derivatives_by_every_response(degree):
    random = np.random.default_rng(1)
    normals, values, step = random.normal(size=(16, 3)), random.normal(size=(16, 2)), 1e-6
    estimator = Estimator(degree)(normals)
    derivatives = estimator.derivatives(values)
    mean, sigma = derivatives.by_mean, derivatives.by_sigma
    for row, column in np.ndindex(values.shape):
        change = np.zeros_like(values)
        change[row, column] = step
        up, down = (estimator.moments(values + sign * change) for sign in (1, -1))
        slopes = [(getattr(up, n) - getattr(down, n))[column] for n in ("mean", "sigma")]
        expected = [mean[row], sigma[row, column]]
        np.testing.assert_allclose(np.array(slopes) / (2 * step), expected, atol=1e-8)


def test_shares_of_nothing():
    constant = response(
        lambda designs: np.ones((len(designs), 2)), sobol_sample(3, 32, seed=1), Estimator()
    )
    shares = sigma_shares(constant, np.ones(3))
    for figures in (shares.of_response, shares.rest, shares.of_sum):
        np.testing.assert_array_equal(figures, 0.0)


MODEL = quad2(4, seed=1)
SPACE_3 = stiffness_factor_space(MODEL.variable_names)
ROBUST = Robust(MODEL, SPACE_3, sobol_sample(4, 64, seed=1))
VALUES = np.column_stack([np.arange(1.0, 101.0), np.arange(100.0, 0.0, -1.0) * 2.0])
DRAWN = Draws(VALUES, VALUES.mean(axis=0), VALUES.std(axis=0), lambda: VALUES[3])


@pytest.mark.parametrize(
    ("objective", "expected"),
    [
        (MEAN_SUM, 50.5 + 101.0),
        (Objective("mean", worst=True), 101.0),
        (Objective("sigma", worst=True), 2.0 * np.std(np.arange(100))),
        (SIGMA_SUM, 3.0 * np.std(np.arange(100))),
        (Objective("quantile", share=0.5), 50.5 + 101.0),
        (Objective("tail mean"), 98.0 + 196.0),  # the mean of the five largest
        (Objective("tail mean", worst=True, share=0.9), 2.0 * 95.5),
        (Objective("nominal"), 4.0 + 194.0),
        (Objective("smallest"), 1.0 + 2.0),
        (Objective("largest", worst=True), 200.0),
    ],
)
def test_objectives_by_hand(objective, expected):
    assert objective(DRAWN) == pytest.approx(expected)
    assert objective.name


def test_a_tail_mean_lies_beyond_its_quantile_and_between_draws_it_is_weighted():
    values = np.arange(10.0)[:, None]
    tail = Objective("tail mean", share=0.75)
    assert tail(DRAWN._replace(values=values)) == pytest.approx((9 + 8 + 0.5 * 7) / 2.5)


def test_a_search_minimises_what_it_is_asked_for():
    robust = replace(
        ROBUST,
        objectives=(
            Objective("mean", worst=True),
            Objective("tail mean", worst=True, share=0.9),
        ),
    )
    front = nsga2(robust, Search(20, 15, seed=1)).front
    np.testing.assert_array_equal(front.objectives[:, 0], front.mean.max(axis=1))
    default = nsga2(ROBUST, Search(20, 15, seed=1)).front
    assert front.objectives[:, 0].min() < default.mean.max(axis=1).min()
    verified = verified_values(front, replicates(robust, 256, seed=1))
    np.testing.assert_array_equal(verified.objectives[:, 0], verified.mean.max(axis=1))


def test_a_model_of_its_own_counts_by_the_sum_or_the_worst_of_its_responses():
    both = ResponseFunction(total, SPACE_3.names, ("sum", "first"), "kg")
    numbers = [Objective("mean", response=both, worst=worst) for worst in (False, True)]
    assert [number.name for number in numbers] == [
        "mean, own number, sum",
        "mean, own number, worst",
    ]
    robust = replace(ROBUST, objectives=tuple(numbers))
    assert robust.objective_labels[1] == "mean, own number, worst [kg]"
    made = total(robust.made(np.ones(4)))
    values = robust(np.ones((1, 4))).objectives[0]
    np.testing.assert_allclose(values, [made.sum(axis=1).mean(), made[:, 0].mean()])


def test_three_objectives():
    robust = replace(
        ROBUST,
        objectives=(MEAN_SUM, SIGMA_SUM, Objective("quantile", worst=True, share=0.9)),
    )
    result = nsga2(robust, Search(20, 10, seed=1))
    assert result.front.objectives.shape[1] == 3
    assert nondominated(result.front.objectives).all()
    assert np.all(np.diff(result.front.objectives[:, 0]) >= 0.0)
    assert np.all(np.diff(result.hypervolume) >= 0.0)
    rows = pick(result.front)
    best = result.front.objectives[list(rows.values())]
    assert np.all(best[[0, 1], [0, 1]] == result.front.objectives[:, :2].min(axis=0))
    with pytest.raises(InputError, match="there is one objective"):
        pick(replace(result.front, objectives=result.front.objectives[:, :1]))


def total(designs):
    """Return the sum of all factors, and the first one."""
    return np.column_stack([designs.sum(axis=1), designs[:, 0]])


def limited(sum_at_most=4.1, first=(0.95, 1.05), function=total, statistic="nominal"):
    total, single = (
        Objective(
            statistic,
            response=ResponseFunction(
                lambda x, k=k: function(x)[:, k], SPACE_3.names, (name,), "kg"
            ),
        )
        for k, name in enumerate(("sum", "first"))
    )
    limits = [Limit(total, at_most=sum_at_most), Limit(single, *first)]
    return replace(ROBUST, limits=limits)


def test_excess_is_signed_and_one_column_per_bound():
    limits = limited().limits
    assert limits.names == ("sum at most 4.1 kg", "first at least 0.95 kg", "first at most 1.05 kg")
    excess = limits.excess(np.array([[4.3, 1.0], [4.0, 0.9], [np.nan, 1.1]]))
    expected = [[0.2, -0.05, -0.05], [-0.1, 0.05, -0.15], [np.inf, -0.15, 0.05]]
    np.testing.assert_allclose(excess, expected, atol=1e-12)


def test_the_worst_drawn_part_may_have_to_keep_the_limits():
    strict = limited(4.1, (0.0, 9.0), statistic="largest")
    design = np.array([[1.0, 1.0, 1.0, 1.05]])
    worst = ROBUST.made(design[0]).sum(axis=1).max()
    np.testing.assert_allclose(strict(design).excess[0, 0], worst - 4.1, atol=1e-12)
    assert limited()(design).excess[0, 0] < 0.0 < strict(design).excess[0, 0]


def test_fronts_leave_out_what_misses_a_limit():
    values = limited()(np.array([[0.8, 0.8, 0.8, 0.8], [1.0, 1.0, 1.0, 1.0]]))
    assert values.feasible.tolist() == [False, True]
    np.testing.assert_array_equal(pareto_front(values).designs, [[1.0, 1.0, 1.0, 1.0]])


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: Robust(model(lambda x: x[:, 0]), SPACE, DRAWS)(np.ones((1, 2))),
            r"ResponseFunction gave .* \(3,\) .* return shape \(3, 2",
        ),
        (
            lambda: Robust(model(), stiffness_factor_space(("b", "a")), DRAWS),
            "same names in the same order",
        ),
        (
            lambda: Robust(model(), SPACE, sobol_sample(3, 32, seed=1)),
            "3 columns for 2 draws of 2 design variables",
        ),
        (lambda: Estimator(3), "degree is 3"),
        (
            lambda: response(line, gaussian_sample(3, 7, seed=1), Estimator(2))(np.ones((1, 3))),
            "take at least 8",
        ),
        *(
            (lambda share=share: Objective("quantile", share=share), "above 0 and below 1")
            for share in (0.0, 1.0, -1.0, float("nan"))
        ),
        (lambda: Limit(MEAN_SUM, 2.0, 1.0, "f.toml, 1"), "f.toml, 1: .* exclude each other"),
        (lambda: Limit(MEAN_SUM), "give at_least, at_most or both"),
        (lambda: replace(ROBUST, objectives=(MEAN_SUM,)), "at least two objectives"),
        (lambda: replace(ROBUST, objectives=(MEAN_SUM,) * 6), "take at most 5"),
        (
            lambda: Robust(model(), SPACE, DRAWS, limits=limited().limits),
            "'sum' is of the variables .* same names in the same order",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()
