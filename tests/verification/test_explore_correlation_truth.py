"""Correlations against scipy, against known populations, and the coverage of their intervals."""

import numpy as np
import pytest
from scipy.stats import spearmanr

from deboom.explore.correlation import correlations, families, tolerance_scatter
from deboom.explore.space import ResponseFunction, stiffness_factor_space


def binormal(random, n, r):
    x = random.normal(size=(n, 2))
    return np.column_stack([x[:, 0], r * x[:, 0] + np.sqrt(1 - r**2) * x[:, 1]])


def test_coefficients_are_those_of_numpy_and_scipy_also_with_ties():
    random = np.random.default_rng(1)
    values = random.normal(size=(80, 4)) @ random.normal(size=(4, 4))
    values[:, 1] = np.round(values[:, 1])
    found = correlations(values, list("abcd"), seed=1, resamples=100)
    assert found.pearson == pytest.approx(np.corrcoef(values.T), abs=1e-13)
    assert found.spearman == pytest.approx(spearmanr(values).statistic, abs=1e-13)


def test_intervals_cover_the_truth_as_often_as_they_say():
    random, r = np.random.default_rng(4), 0.6
    hits, n_sets = 0, 150
    for number in range(n_sets):
        found = correlations(binormal(random, 150, r), "ab", seed=number + 1, resamples=200)
        hits += found.pearson_low[0, 1] <= r <= found.pearson_high[0, 1]
    # 95 % asked; 150 sets of data leave ±5.4 % at three standard errors
    assert 0.88 < hits / n_sets < 1.0


def test_values_of_one_design_are_resampled_together():
    random = np.random.default_rng(5)
    means = binormal(random, 60, 0.5)
    draws = np.repeat(means[:, np.newaxis], 8, axis=1)
    pooled = correlations(draws, "ab", seed=1, resamples=300)
    alone = correlations(means, "ab", seed=1, resamples=300)
    assert pooled.pearson == pytest.approx(alone.pearson)
    assert pooled.pearson_low == pytest.approx(alone.pearson_low)  # not √8 times as narrow


def test_design_and_tolerance_correlation_of_linear_responses():
    # two responses of two variables, a = 3 x + y, b = 3 x - y: with variances v of x and w of y
    # r = (9 v - w) / (9 v + w), and both designs and scatter have v = w
    def both(designs):
        x, y = designs.T
        return np.column_stack([3 * x + y, 3 * x - y])

    evaluate = ResponseFunction(both, ("x", "y"), ("a", "b"), "dB")
    space = stiffness_factor_space(("x", "y"), half_width=0.15)
    designs = np.random.default_rng(6).uniform(0.85, 1.15, (400, 2))
    mean, scatter = tolerance_scatter(evaluate, space, designs, n_draws=32, seed=1)
    assert mean == pytest.approx(both(designs), abs=0.02)
    whole = correlations(mean, "ab", seed=1, resamples=100)
    assert whole.pearson[0, 1] == pytest.approx(0.8, abs=0.04)
    found = correlations(scatter, "ab", seed=1, resamples=100)
    assert found.pearson[0, 1] == pytest.approx(0.8, abs=0.02)
    assert found.pearson_low[0, 1] < 0.8 < found.pearson_high[0, 1]


def test_families_of_a_block_matrix_are_its_blocks():
    r = np.full((5, 5), 0.2)
    r[:2, :2], r[2:, 2:] = 0.95, 0.97
    np.fill_diagonal(r, 1.0)
    found = families("abcde", r, cut=0.9)
    assert found.members == (("c", "d", "e"), ("a", "b"))
    assert found.merges[-1, 2] == pytest.approx(0.8)
    assert families("abcde", r, cut=0.96).members == (("c", "d", "e"), ("a",), ("b",))


def test_every_pair_of_a_family_keeps_the_cut():
    # a chain: neighbours correlate by 0.92, ends by 0.7; single linkage would join them all
    r = np.array([[1, 0.92, 0.7], [0.92, 1, 0.92], [0.7, 0.92, 1]])
    assert sorted(map(len, families("abc", r, cut=0.9).members)) == [1, 2]
