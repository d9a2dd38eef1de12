"""The generic regressor: scikit-learn's rules, shapes, options and refusals."""

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import parametrize_with_checks

from deboom.errors import InputError
from deboom.mounts.cubic_pieces import cubic_exponents, cubic_terms
from deboom.mounts.piecewise_cubic import PiecewiseCubicRegressor

GENERATOR = np.random.default_rng(1)
X = GENERATOR.uniform(-1, 1, (400, 2))
Y = np.tanh(4 * X[:, 0]) + 0.2 * X[:, 1]


@parametrize_with_checks(
    [
        PiecewiseCubicRegressor(),
        PiecewiseCubicRegressor(split="threshold"),
        PiecewiseCubicRegressor(pieces="cv", max_pieces=3),
    ]
)
def test_scikit_learn_estimator_rules(estimator, check):
    check(estimator)


@pytest.mark.parametrize(("n_features", "n_terms"), [(1, 4), (2, 10), (3, 20), (4, 35)])
def test_the_cubic_is_complete(n_features, n_terms):
    exponents = cubic_exponents(n_features)
    assert exponents.shape == (n_terms, n_features)
    assert len({tuple(row) for row in exponents.tolist()}) == n_terms
    assert exponents.sum(axis=1).max() == 3
    assert cubic_terms(np.ones((5, n_features))).shape == (5, n_terms)


def test_terms_are_the_products_that_the_exponents_say():
    rows = GENERATOR.normal(size=(7, 3))
    expected = [np.prod(rows**exponents, axis=1) for exponents in cubic_exponents(3)]
    np.testing.assert_allclose(cubic_terms(rows), np.transpose(expected), rtol=1e-14)


def test_one_and_several_outputs_keep_their_shape():
    one = PiecewiseCubicRegressor().fit(X, Y)
    two = PiecewiseCubicRegressor().fit(X, np.column_stack([Y, -2 * Y]))
    assert one.predict(X[:9]).shape == (9,)
    assert one.gradient(X[:9]).shape == (9, 2)
    assert two.predict(X[:9]).shape == (9, 2)
    assert two.gradient(X[:9]).shape == (9, 2, 2)
    lower, upper = two.prediction_interval(X[:9])
    assert lower.shape == upper.shape == (9, 2)
    # proportional outputs have one and the same best split
    np.testing.assert_allclose(two.split_points_, one.split_points_)
    np.testing.assert_allclose(two.predict(X)[:, 1], -2 * one.predict(X), rtol=1e-9, atol=1e-12)


def test_given_split_points_are_taken():
    model = PiecewiseCubicRegressor(split=[-0.5, 0.25]).fit(X, Y)
    assert model.n_pieces_ == 3
    np.testing.assert_array_equal(model.split_points_, [-0.5, 0.25])


def test_another_column_can_be_cut():
    model = PiecewiseCubicRegressor(split_feature=1).fit(X[:, ::-1], Y)
    straight = PiecewiseCubicRegressor().fit(X, Y)
    np.testing.assert_allclose(model.split_points_, straight.split_points_)
    np.testing.assert_allclose(model.predict(X[:, ::-1]), straight.predict(X), rtol=1e-9)


def test_too_few_rows_for_two_pieces_give_one():
    assert PiecewiseCubicRegressor().fit(X[:39], Y[:39]).n_pieces_ == 1
    assert PiecewiseCubicRegressor(min_rows=10).fit(X[:39], Y[:39]).n_pieces_ == 2


def test_a_constant_column_is_harmless_and_guarded():
    rows = np.column_stack([X, np.full(len(X), 7.0)])
    model = PiecewiseCubicRegressor().fit(rows, Y)
    np.testing.assert_allclose(
        model.predict(rows), PiecewiseCubicRegressor().fit(X, Y).predict(X), atol=1e-9
    )
    assert model.supported(rows).all()
    assert not model.supported(rows + np.array([0, 0, 1e-3])).any()


def test_rows_of_weight_zero_are_left_out():
    weight = np.ones(len(X))
    weight[::3] = 0
    spoilt = Y.copy()
    spoilt[::3] = 1e6
    kept = weight > 0
    expected = PiecewiseCubicRegressor().fit(X[kept], Y[kept])
    model = PiecewiseCubicRegressor().fit(X, spoilt, sample_weight=weight)
    np.testing.assert_allclose(model.predict(X), expected.predict(X), rtol=1e-9, atol=1e-12)


def test_it_works_in_a_pipeline_and_as_a_clone():
    model = clone(PiecewiseCubicRegressor(pieces=3, min_rows=25))
    assert model.get_params()["pieces"] == 3
    assert make_pipeline(StandardScaler(), model).fit(X, Y).score(X, Y) > 0.99


def test_as_many_terms_as_rows_leave_no_interval():
    model = PiecewiseCubicRegressor().fit(X[:10], Y[:10])
    with pytest.raises(InputError, match="needs more rows"):
        model.prediction_interval(X[:2])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"pieces": 0}, 'pieces is a whole number of at least 1 or "cv"'),
        ({"pieces": 2.5}, "pieces is a whole number"),
        ({"pieces": "many"}, "pieces is a whole number"),
        ({"split": "best"}, "split is"),
        ({"split": [0.5, 0.1]}, "must increase within the range"),
        ({"split": [3.0]}, "must increase within the range"),
        ({"split_feature": 2}, "there are 2 variables"),
        ({"split_feature": -1}, "split_feature is a whole number of at least 0"),
        ({"threshold": 0.0}, "threshold is a relative error above 0"),
        ({"overlap": 1.0}, "overlap is a fraction"),
        ({"overlap": -0.1}, "overlap is a fraction"),
        ({"max_pieces": 0}, "max_pieces is a whole number"),
        ({"folds": 1}, "folds is a whole number of at least 2"),
        ({"min_rows": 0}, "min_rows is a whole number"),
        ({"reach": 0.0}, "reach of measured rows is above 0"),
    ],
)
def test_options_without_sense_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        PiecewiseCubicRegressor(**options).fit(X, Y)


def test_group_labels_of_another_length_are_refused():
    with pytest.raises(InputError, match="3 group labels for 400 rows"):
        PiecewiseCubicRegressor(pieces="cv").fit(X, Y, groups=["a", "b", "c"])


def test_groups_that_say_nothing_about_each_other_are_refused():
    for groups in (np.zeros(len(X)), X[:, 0] > 0):
        with pytest.raises(InputError, match="cannot be cross-validated"):
            PiecewiseCubicRegressor(pieces="cv", reach=0.1).fit(
                X * [1 + 5 * (X[:, :1] > 0)][0], Y, groups=groups
            )


@pytest.mark.parametrize("coverage", [0.0, 1.0, 95.0])
def test_coverages_that_do_not_exist_are_refused(coverage):
    with pytest.raises(InputError, match="coverage lies between 0 and 1"):
        PiecewiseCubicRegressor().fit(X, Y).prediction_interval(X, coverage)


def test_a_split_that_leaves_a_piece_empty_is_refused():
    gap = X[np.abs(X[:, 0]) > 0.4]
    with pytest.raises(InputError, match="no rows between the split points"):
        PiecewiseCubicRegressor(split=[-0.2, 0.2]).fit(gap, gap[:, 0])
