"""The piecewise cubic against known truth: closed forms, exhaustive search, drawn data."""

import itertools

import numpy as np
import pytest
from scipy import stats

from deboom.mounts.cubic_fit import PieceOptions, fit_piecewise_cubic
from deboom.mounts.cubic_pieces import cubic_terms
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor


def cubic(X, coefficients):
    return cubic_terms(X) @ coefficients


def test_data_of_one_cubic_are_given_back():
    generator = np.random.default_rng(1)
    # ranges of a mount: N m, m, Hz
    X = generator.uniform([10, 2e-5, 20], [900, 7e-4, 80], (600, 3))
    scaled = X / [900, 7e-4, 80]
    truth = cubic(scaled, generator.normal(size=20))
    for pieces in (1, 2, 4):
        model = PiecewiseCubicRegressor(pieces=pieces).fit(X, truth)
        np.testing.assert_allclose(model.predict(X), truth, rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", range(1, 6))
def test_the_split_between_two_cubics_is_found_to_the_row(seed):
    generator = np.random.default_rng(seed)
    X = generator.uniform(-1, 1, (1500, 3))
    split = generator.uniform(-0.6, 0.6)
    low, high = generator.normal(size=(2, 20))
    truth = np.where(X[:, 0] > split, cubic(X, high), cubic(X, low))
    model = PiecewiseCubicRegressor(overlap=0.0).fit(X, truth)
    position = np.sort(X[:, 0])
    behind = np.searchsorted(position, split)
    assert position[behind - 1] < model.split_points_[0] < position[behind]
    np.testing.assert_allclose(model.predict(X), truth, rtol=0, atol=1e-9)


def test_the_splits_between_four_cubics_are_found():
    generator = np.random.default_rng(2)
    X = generator.uniform(0, 10, (3000, 2))
    splits = np.array([2.3, 4.1, 8.05])
    which = np.searchsorted(splits, X[:, 0])
    each = [cubic(X / 10, generator.normal(size=10)) for _ in range(4)]
    model = PiecewiseCubicRegressor(pieces=4, overlap=0.0).fit(X, np.choose(which, each))
    np.testing.assert_allclose(model.split_points_, splits, atol=0.01)


def test_the_split_is_the_best_of_all():
    """Dynamic programming between triangles against trying every cut with plain least squares."""
    generator = np.random.default_rng(3)
    x = np.sort(generator.uniform(0, 1, 90))
    y = np.sin(9 * x**2) + generator.normal(0, 0.05, 90)
    least = 8

    def squares(low, high):
        polynomial = np.polynomial.Polynomial.fit(x[low:high], y[low:high], 3)
        return np.sum((y[low:high] - polynomial(x[low:high])) ** 2)

    for n_pieces in (2, 3):
        cuts = [
            (0, *inner, 90)
            for inner in itertools.combinations(range(least, 90 - least + 1), n_pieces - 1)
            if np.all(np.diff((0, *inner, 90)) >= least)
        ]
        sums = [sum(squares(*pair) for pair in itertools.pairwise(cut)) for cut in cuts]
        best = np.array(cuts[int(np.argmin(sums))][1:-1])
        model = PiecewiseCubicRegressor(pieces=n_pieces, overlap=0.0, min_rows=least)
        model.fit(x[:, np.newaxis], y)
        np.testing.assert_allclose(model.split_points_, (x[best - 1] + x[best]) / 2)


def test_the_threshold_split_is_the_farthest_that_keeps_the_error():
    x = np.linspace(0, 1, 300)
    y = 1 + np.exp(-(((x - 0.8) / 0.1) ** 2))

    def error(count):
        polynomial = np.polynomial.Polynomial.fit(x[:count], y[:count], 3)
        rms = np.sqrt(np.mean((y[:count] - polynomial(x[:count])) ** 2))
        return rms / np.mean(np.abs(y[:count]))

    good = [count for count in range(8, 293) if error(count) <= 0.03]
    assert error(300) > 0.03
    model = PiecewiseCubicRegressor(split="threshold").fit(x[:, np.newaxis], y)
    np.testing.assert_allclose(model.split_points_, [(x[max(good) - 1] + x[max(good)]) / 2])
    # a looser threshold needs no split, and one that nothing meets falls back on least squares
    loose = PiecewiseCubicRegressor(split="threshold", threshold=0.5).fit(x[:, np.newaxis], y)
    assert loose.n_pieces_ == 1
    noisy = y + np.random.default_rng(4).normal(0, 0.3, 300)
    strict = PiecewiseCubicRegressor(split="threshold", threshold=1e-3)
    best = PiecewiseCubicRegressor()
    np.testing.assert_array_equal(
        strict.fit(x[:, np.newaxis], noisy).split_points_,
        best.fit(x[:, np.newaxis], noisy).split_points_,
    )


def test_the_blend_is_continuous_and_hands_over_linearly():
    generator = np.random.default_rng(5)
    x = np.sort(generator.uniform(0, 1, 800))[:, np.newaxis]
    y = np.where(x[:, 0] > 0.5, 2.0, 1.0)
    model = PiecewiseCubicRegressor(overlap=0.2).fit(x, y)
    split, width = model.split_points_[0], 0.2 * np.ptp(x)
    ends = np.array([split - width / 2, split + width / 2])
    for at in (*ends, split):
        around = np.array([[at - 1e-9], [at + 1e-9]])
        assert abs(np.diff(model.predict(around))[0]) < 1e-6
    share, _ = model.model_._shares(np.array([[split - 0.6 * width], [split], [split + width / 4]]))
    np.testing.assert_allclose(share, [[1.0, 0.5, 0.25], [0.0, 0.5, 0.75]])


def test_the_gradient_is_the_limit_of_differences():
    generator = np.random.default_rng(6)
    X = generator.uniform([0, 1e-5, 20], [800, 6e-4, 80], (900, 3))
    y = 1e5 * np.tanh((X[:, 0] - 300) / 120) * (1 - 500 * X[:, 1]) + 40 * X[:, 2] ** 1.5
    model = PiecewiseCubicRegressor(overlap=0.1).fit(X, y)
    rows = X[:200]
    assert np.any(np.abs(rows[:, 0] - model.split_points_[0]) < 30)
    for feature, step in enumerate([1e-3, 1e-9, 1e-4]):
        shift = np.zeros(3)
        shift[feature] = step
        difference = (model.predict(rows + shift) - model.predict(rows - shift)) / (2 * step)
        scale = np.abs(difference).max()
        np.testing.assert_allclose(model.gradient(rows)[:, feature], difference, atol=1e-5 * scale)


def test_weights_are_repeated_rows():
    generator = np.random.default_rng(7)
    X = generator.uniform(-1, 1, (300, 2))
    y = np.sin(5 * X[:, 0]) + X[:, 1] ** 2
    repeats = generator.integers(1, 4, 300)
    weighted = PiecewiseCubicRegressor().fit(X, y, sample_weight=repeats)
    repeated = PiecewiseCubicRegressor().fit(np.repeat(X, repeats, axis=0), np.repeat(y, repeats))
    np.testing.assert_allclose(weighted.split_points_, repeated.split_points_)
    np.testing.assert_allclose(weighted.predict(X), repeated.predict(X), rtol=1e-9, atol=1e-11)


def test_the_interval_is_that_of_the_textbook():
    """Against ``t σ √(1 + a (AᵀA)⁻¹ aᵀ)`` written out for one cubic in one variable."""
    generator = np.random.default_rng(8)
    x = generator.uniform(-1, 1, 40)
    y = 1 + x - 2 * x**3 + generator.normal(0, 0.3, 40)
    model = PiecewiseCubicRegressor(pieces=1).fit(x[:, np.newaxis], y)
    at = np.linspace(-1, 1, 11)
    lower, upper = model.prediction_interval(at[:, np.newaxis], 0.9)
    A, a = np.vander(x, 4), np.vander(at, 4)
    coefficients = np.linalg.solve(A.T @ A, A.T @ y)
    sigma = np.sqrt(np.sum((y - A @ coefficients) ** 2) / 36)
    leverage = np.einsum("ni,ij,nj->n", a, np.linalg.inv(A.T @ A), a)
    expected = stats.t.ppf(0.95, 36) * sigma * np.sqrt(1 + leverage)
    np.testing.assert_allclose((upper - lower) / 2, expected, rtol=1e-9)
    np.testing.assert_allclose((upper + lower) / 2, a @ coefficients, rtol=1e-9)


@pytest.mark.parametrize("coverage", [0.5, 0.95])
def test_the_interval_covers_as_often_as_it_says(coverage):
    """Fresh observations of two joined cubics, small and noisy fits, within 4 standard errors."""
    generator = np.random.default_rng(9)

    def draw(count):
        X = generator.uniform(-1, 1, (count, 2))
        truth = X[:, 0] - X[:, 0] ** 3 + X[:, 1] + 2 * np.maximum(X[:, 0] - 0.2, 0) ** 3
        weight = generator.uniform(0.3, 3.0, count)
        return X, truth + generator.normal(0, 0.2, count) / np.sqrt(weight), weight

    covered = []
    for _ in range(40):
        X, y, weight = draw(150)
        model = PiecewiseCubicRegressor(split=[0.2]).fit(X, y, sample_weight=weight)
        X, y, weight = draw(300)
        lower, upper = model.prediction_interval(X, coverage, sample_weight=weight)
        covered.append(np.mean(((lower <= y) & (y <= upper))[model.supported(X)]))
    standard_error = np.std(covered) / np.sqrt(len(covered))
    assert abs(np.mean(covered) - coverage) < 4 * standard_error < 0.03


def test_cross_validation_over_runs_finds_the_number_of_pieces():
    """Lines of a run share their error: runs left out find three pieces, single lines do not."""
    generator = np.random.default_rng(10)
    run = np.repeat(np.arange(24), 40)
    x = np.linspace(0, 1, 40)[np.newaxis] * generator.uniform(0.6, 1, (24, 1))
    second = generator.uniform(-1, 1, (24, 1)) + 0.3 * np.sin(9 * x)
    X = np.column_stack([x.ravel(), second.ravel()])
    truth = X[:, 1] + 200 * np.maximum(X[:, 0] - 0.3, 0) ** 3
    truth -= 600 * np.maximum(X[:, 0] - 0.6, 0) ** 3
    y = truth + 0.03 * np.sin(25 * X[:, 0] + generator.uniform(0, 7, 24)[run])
    by_run = PiecewiseCubicRegressor(pieces="cv").fit(X, y, groups=run)
    by_line = PiecewiseCubicRegressor(pieces="cv").fit(X, y)
    assert by_run.n_pieces_ == 3
    assert by_line.n_pieces_ > 3
    np.testing.assert_allclose(by_run.split_points_, [0.3, 0.6], atol=0.1)


def test_a_refit_with_known_splits_takes_many_outputs_at_once():
    """What an error budget does: one triangularisation for all draws, equal to single fits."""
    generator = np.random.default_rng(11)
    X = generator.uniform(-1, 1, (500, 3))
    y = np.tanh(3 * X[:, 0]) + X[:, 1] * X[:, 2]
    first = PiecewiseCubicRegressor().fit(X, y)
    draws = y[:, np.newaxis] + generator.normal(0, 0.1, (500, 30))
    options = PieceOptions(split=first.split_points_)
    together = fit_piecewise_cubic(X, draws, np.ones(500), options)
    single = PiecewiseCubicRegressor(split=first.split_points_).fit(X, draws[:, 17])
    np.testing.assert_allclose(together(X)[:, 17], single.predict(X), rtol=1e-10, atol=1e-12)
