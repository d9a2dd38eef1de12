"""Attainment against counting, hypervolume against an integral, false alarms against their rate."""

import numpy as np
import pytest

from deboom.explore.front import (
    Contestant,
    Verdict,
    attainment,
    common_box,
    difference,
    nondominated,
)


def random_front(random, size):
    points = random.random((size, 2))
    return points[nondominated(points)]


@pytest.mark.parametrize("n_fronts", [2, 5, 8])
def test_attainment_is_what_counting_says(n_fronts):
    random = np.random.default_rng(n_fronts)
    fronts = [random_front(random, 12) for _ in range(n_fronts)]
    grid = random.random((4000, 2))
    attained = sum(
        np.all(front[None] <= grid[:, None], axis=2).any(axis=1).astype(int) for front in fronts
    )
    shares = [1.0 / n_fronts, 0.25, 0.5, 1.0]
    for share, surface in attainment(fronts, shares).items():
        inside = np.all(surface[None] <= grid[:, None], axis=2).any(axis=1)
        assert np.array_equal(inside, attained >= np.ceil(share * n_fronts - 1e-9))
        assert nondominated(surface).all()
        assert np.all(np.diff(surface[:, 0]) > 0.0)


def test_hypervolume_of_a_dense_quarter_circle():
    angle = np.linspace(0.0, np.pi / 2, 20001)
    front = 1.0 - np.column_stack([np.cos(angle), np.sin(angle)])
    box = common_box([front])
    # the corner up to 1.1 less the corner that the circle leaves free
    assert box.hypervolume(front) == pytest.approx((1.21 - (1.0 - np.pi / 4.0)) / 1.21, abs=1e-4)


@pytest.mark.parametrize("n_runs", [3, 10])
def test_equal_configurations_are_called_different_in_one_case_of_a_hundred(n_runs):
    random = np.random.default_rng(1)
    trials, alarms = 2000, 0
    for _ in range(trials):
        draws = 0.002 * random.standard_normal((1, 8))
        both = [
            Contestant(
                name,
                0.8
                + draws
                + 0.01 * random.standard_normal((n_runs, 1))
                + 0.0005 * random.standard_normal((1, 8)),
                np.full(n_runs, np.nan),
            )
            for name in "ab"
        ]
        alarms += difference(*both).verdict is Verdict.real
    # 20 expected; three standard deviations are 13, and Welch's t is careful with three runs
    assert alarms <= 33
    assert alarms >= 2


def test_a_difference_of_five_standard_errors_is_found():
    random = np.random.default_rng(2)
    found = 0
    for _ in range(300):
        seeds = 0.01 * random.standard_normal((2, 10, 1)) + np.zeros((1, 1, 8))
        shift = 5.0 * 0.01 * np.sqrt(2.0 / 10.0)
        pair = (
            Contestant("a", 0.8 + shift + seeds[0], np.full(10, np.nan)),
            Contestant("b", 0.8 + seeds[1], np.full(10, np.nan)),
        )
        found += difference(*pair).verdict is Verdict.real
    assert found >= 270
