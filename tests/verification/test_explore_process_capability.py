"""Capability against a textbook, and bounds and predictions against many samples."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.scatter import capability, predicted_pieces


def sample_of(n, mean, sigma):
    """Values with exactly this mean and standard deviation."""
    values = np.linspace(-1, 1, n)
    return mean + sigma * values / values.std(ddof=1)


def test_montgomery_example_of_cp():
    # Montgomery, Statistical Quality Control: limits 38 and 62, n = 20, s = 1.75, 95 % two-sided:
    # Cp = 2.29 with 1.57 as lower end, the one-sided bound of 97.5 %; the book rounds Cp on the way
    found = capability(sample_of(20, 50.0, 1.75), 38.0, 62.0, confidence=0.975)
    assert found.cp == pytest.approx(2.29, abs=0.005)
    assert found.cp_bound == pytest.approx(1.57, abs=0.006)
    assert found.cpk == pytest.approx(found.cp)


def test_cpk_of_a_mean_off_the_middle_and_outside():
    assert capability(sample_of(30, 1.02, 0.01), 0.94, 1.06).cpk == pytest.approx(4 / 3)
    outside = capability(sample_of(30, 1.10, 0.01), 0.94, 1.06)
    assert outside.cpk < 0
    assert outside.expected_outside > 0.99


def test_bounds_hold_as_often_as_they_say():
    random = np.random.default_rng(1)
    true_cp, true_cpk = 0.12 / 6 / 0.015, 0.05 / 3 / 0.015
    found = [capability(random.normal(1.01, 0.015, 30), 0.94, 1.06) for _ in range(2000)]
    cp = np.mean([one.cp_bound <= true_cp for one in found])
    cpk = np.mean([one.cpk_bound <= true_cpk for one in found])
    assert cp == pytest.approx(0.95, abs=0.015)
    assert cpk == pytest.approx(0.95, abs=0.02)


def test_predicted_pieces_cover_the_next_piece():
    random = np.random.default_rng(2)
    root = np.array([[0.03, 0.0], [0.02, 0.01]])
    inside = []
    for trial in range(300):
        pieces = 1.0 + random.standard_normal((9, 2)) @ root.T
        drawn = predicted_pieces(pieces[:8], 400, 1, seed=trial + 1)[:, 0, 1]
        low, high = np.quantile(drawn, [0.05, 0.95])
        inside.append(low <= pieces[8, 1] <= high)
    assert np.mean(inside) == pytest.approx(0.90, abs=0.05)


@pytest.mark.parametrize(
    ("values", "lower", "upper", "sentence"),
    [
        ([1.0], 0.9, 1.1, "at least 2 finite values"),
        ([1.0, np.nan], 0.9, 1.1, "at least 2 finite values"),
        ([1.0, 1.0, 1.0], 0.9, 1.1, "copied measurement"),
        ([1.0, 1.1], 1.1, 1.1, "no width"),
    ],
)
def test_refusals(values, lower, upper, sentence):
    with pytest.raises(InputError, match=sentence):
        capability(values, lower, upper)


def test_too_few_or_copied_pieces_are_refused():
    with pytest.raises(InputError, match="measure at least 4"):
        predicted_pieces(np.ones((3, 2)), 10, 10, seed=1)
    with pytest.raises(InputError, match="do not scatter in every axis"):
        predicted_pieces(np.outer(np.arange(6.0), [1.0, 1.0]), 10, 10, seed=1)
