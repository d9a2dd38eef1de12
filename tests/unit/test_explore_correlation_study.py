"""What the correlation study refuses, and what it does with failures."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.correlation import correlations, families, tolerance_scatter
from deboom.explore.space import ResponseFunction, generator, stiffness_factor_space

VALUES = np.random.default_rng(1).normal(size=(30, 3))
NAMES = ("sedan", "tourer", "van")


def changed(place, value):
    values = VALUES.copy()
    values[place] = value
    return values


@pytest.mark.parametrize(
    ("values", "options", "sentence"),
    [
        (changed((slice(None), 1), -58.1), {}, "'tourer' is the same in all 30 designs"),
        (changed((4, 2), np.nan), {}, "design 5 has no finite value of 'van'"),
        (VALUES[:9], {}, r"from 9 design\(s\) says nothing"),
        (VALUES[:, :2], {}, r"shape \(30, 2\) for 3 responses"),
        (VALUES[:, :1], {"names": ("a",)}, "at least two responses"),
        (VALUES, {"resamples": 99}, "take at least 100"),
        (VALUES, {"seed": 0}, "seed 0"),
    ],
)
def test_correlations_refuse_bad_input(values, options, sentence):
    with pytest.raises(InputError, match=sentence):
        correlations(values, **{"names": NAMES, "seed": 1, **options})


def test_the_interval_is_that_of_resampled_designs():
    few_resamples = correlations(VALUES, NAMES, seed=1, resamples=100)
    times = generator(1, "correlation bootstrap").multinomial(30, np.full(30, 1 / 30), size=100)
    each = [np.corrcoef(np.repeat(VALUES, n, axis=0), rowvar=False) for n in times]
    low, high = np.quantile(each, [0.025, 0.975], axis=0)
    np.testing.assert_allclose(
        [few_resamples.pearson_low, few_resamples.pearson_high], [low, high], atol=1e-12
    )


def test_a_design_that_cannot_be_made_in_all_draws_has_no_scatter():
    def fragile(designs):
        if np.any(designs > 1.14):
            raise ZeroDivisionError
        return np.column_stack([designs[:, 0], designs[:, 1]])

    evaluate = ResponseFunction(fragile, ("x", "y"), ("a", "b"), "dB")
    space = stiffness_factor_space(("x", "y"), half_width=0.15)
    designs = np.array([[0.9, 0.9], [1.1, 1.1]])
    mean, scatter = tolerance_scatter(evaluate, space, designs, n_draws=16, seed=1)
    assert np.isfinite(scatter[0]).all()
    assert np.isnan(scatter[1]).all()
    assert np.isnan(mean[1]).all()
    with pytest.raises(InputError, match="12 Sobol points are not a power of two"):
        tolerance_scatter(evaluate, space, designs, n_draws=12, seed=1)


def test_families_refuse_bad_input_and_number_their_members():
    with pytest.raises(InputError, match="at least two responses"):
        families("a", np.ones((1, 1)))
    with pytest.raises(InputError, match="a correlation between 0 and 1"):
        families("ab", np.eye(2), cut=1.0)
    grouped = families("abc", np.array([[1, 0.2, 0.95], [0.2, 1, 0.1], [0.95, 0.1, 1]]))
    assert [grouped.number(name) for name in "abc"] == [1, 2, 1]
