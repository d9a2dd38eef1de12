"""Picks, indifference intervals and polishing."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.moments import Estimator
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.selection import (
    at_nominal,
    improved,
    indifference_intervals,
    pick,
    variables_without_effect,
)
from deboom.explore.space import ResponseFunction, stiffness_factor_space
from known_truth import exp1, quad2


def rows(*objectives):
    """Values with the objectives given as (mean_sum, sigma_sum); None is a failed design."""
    failed = np.array([pair is None for pair in objectives])
    pairs = np.array([(np.nan, np.nan) if pair is None else pair for pair in objectives], float)
    zeros = np.zeros(len(pairs))
    return RobustValues(
        zeros[:, None], pairs[:, :1], pairs[:, 1:], pairs[:, 0], pairs[:, 1], zeros, zeros, failed
    )


@pytest.mark.parametrize(
    ("objectives", "expected"),
    [
        ([(0, 10), (1, 3), (5, 2), (10, 0)], (0, 3)),
        ([None, (10, 0), (1, 3), None, (0, 10)], (4, 1)),  # failures, in no order
        ([(0, 10), (0, 9), (4, 1), (6, 1)], (1, 2)),  # equal: the better in the other
        ([(3, 2)], (0, 0)),
    ],
)
def test_picks_by_hand(objectives, expected):
    assert pick(rows(*objectives)) == dict(zip(("best mean", "best sigma"), expected, strict=True))


def vehicles(*each):
    """Values of two responses, given as (mean, mean, sigma sum)."""
    numbers = np.array(each, float)
    zeros, sigma = np.zeros(len(numbers)), numbers[:, 2:] / 2.0
    return RobustValues(
        *(zeros[:, None], numbers[:, :2], np.hstack([sigma, sigma]), numbers[:, :2].sum(axis=1)),
        *(numbers[:, 2], zeros, zeros, zeros > 0.0),
    )


def test_picks_that_keep_what_today_has():
    today = vehicles((10, 10, 4))
    found = vehicles((2, 11, 5), (6, 9, 5), (7, 9, 4), (9, 9.5, 3), (12, 12, 1))
    assert pick(found, today) == {
        "best mean": 0,
        "none louder": 1,
        "sigma kept": 2,
        "best sigma": 4,
    }
    assert "none louder" not in pick(vehicles((2, 11, 5), (10, 10, 4)), today)


def test_nothing_to_pick_is_said():
    with pytest.raises(InputError, match="nothing to pick"):
        pick(rows(None, None))


SPACE = stiffness_factor_space(("a", "b", "c", "d"))


def model(function, n_responses=2):
    names = tuple(f"u{r}" for r in range(n_responses))
    return ResponseFunction(function, SPACE.names, names, "dB")


WEIGHTS = np.array([[1.0, 2.0], [0.0, 0.0], [0.0, 1e-12], [0.0, 0.0]])
HELD = {"lower": np.array([0.8, 1.0, 0.8, 0.8]), "upper": np.array([1.2, 1.0, 1.2, 1.2])}


@pytest.mark.parametrize(
    ("function", "changes", "expected"),
    [
        (lambda x: x @ WEIGHTS, {}, "bd"),  # weak ones have an effect
        (lambda x: np.column_stack([(x[:, 0] - 1.0) * x[:, 1], x[:, 2]]), {}, "d"),  # away from 1
        (lambda x: np.ones((len(x), 2)), HELD, "acd"),  # what cannot move has shown nothing
        (lambda x: np.full((len(x), 2), np.nan), {}, ""),  # nor has a model that fails
    ],
)
def test_variables_without_effect(function, changes, expected):
    space = replace(SPACE, **changes)
    assert variables_without_effect(model(function), space) == tuple(expected)


def test_back_to_nominal():
    designs = np.array([[0.9, 0.9, 0.9, 0.9], [1.1, 1.1, 1.1, 1.1]])
    np.testing.assert_array_equal(
        at_nominal(designs, SPACE, ("b", "d")), [[0.9, 1, 0.9, 1], [1.1, 1, 1.1, 1]]
    )
    assert designs[0, 1] == 0.9
    with pytest.raises(InputError, match="no design variable 'e'"):
        at_nominal(designs, SPACE, ("e",))


def robust(function, n_responses=2):
    exact = replace(SPACE, tolerance=np.zeros(4))
    return RobustResponse(model(function, n_responses), exact, sobol_sample(4, 2, seed=1))


def steep_flat_none_oneway(designs):
    a, b, _, d = designs.T
    one = 10.0 * a + 0.1 * b + np.where(d > 1.0, 20.0 * (d - 1.0), 0.0)
    return np.column_stack([one, one])


def test_indifference_intervals_in_closed_form():
    lower, upper = indifference_intervals(
        robust(steep_flat_none_oneway), np.ones(4), change=0.5, n_points=17
    )
    np.testing.assert_allclose(lower, [0.95, 0.8, 0.8, 0.8], atol=1e-12)
    np.testing.assert_allclose(upper, [1.05, 1.2, 1.2, 1.025], atol=1e-12)


def test_the_change_is_counted_per_response():
    one = robust(lambda designs: 10.0 * designs[:, :1], n_responses=1)
    three = robust(lambda designs: np.repeat(10.0 * designs[:, :1], 3, axis=1), n_responses=3)
    for response in (one, three):
        lower, upper = indifference_intervals(response, np.full(4, 1.013), change=0.7)
        np.testing.assert_allclose([lower[0], upper[0]], [0.943, 1.083], atol=1e-12)


def test_only_the_interval_around_the_design_counts():
    wave = robust(lambda designs: np.repeat(np.sin(40.0 * designs[:, :1]), 2, axis=1))
    lower, upper = indifference_intervals(wave, np.ones(4), change=0.3, n_points=401)
    crossings = np.linspace(0.8, 1.2, 100_001)
    within = np.abs(np.sin(40.0 * crossings) - np.sin(40.0)) < 0.3
    centre = 50_000
    expected_lower = crossings[centre - np.argmin(within[centre::-1])]
    expected_upper = crossings[centre + np.argmin(within[centre:])]
    np.testing.assert_allclose([lower[0], upper[0]], [expected_lower, expected_upper], atol=2e-4)
    assert within[:20_000].any()  # it comes back further out, which must not count


def test_a_failed_design_ends_the_interval():
    def narrow(designs):
        return np.where(designs[:, :1] > 1.1, np.nan, np.ones((len(designs), 2)))

    lower, upper = indifference_intervals(robust(narrow), np.ones(4), 1.0, n_points=9)
    np.testing.assert_allclose([lower[0], upper[0]], [0.8, 1.1])


@pytest.mark.parametrize(
    ("design", "change", "n_points", "words"),
    [
        (np.full(4, 1.3), 0.1, 21, "within the bounds"),
        (np.ones(4), 0.0, 21, "positive change"),
        (np.ones(4), 0.1, 1, "at least 2 points"),
    ],
)
def test_bad_questions_are_refused(design, change, n_points, words):
    with pytest.raises(InputError, match=words):
        indifference_intervals(robust(steep_flat_none_oneway), design, change, n_points)


def test_a_design_that_fails_has_no_intervals():
    broken = robust(lambda designs: np.full((len(designs), 2), np.nan))
    with pytest.raises(InputError, match="fails itself"):
        indifference_intervals(broken, np.ones(4), 0.1)


BOTH = pytest.mark.parametrize("make", [quad2, exp1])


def robust_of(make, **changes):
    problem = make(6, seed=1)
    space = stiffness_factor_space(problem.variable_names)
    sample = changes.pop("sample", sobol_sample(6, 64, seed=1))
    return RobustResponse(problem, space, sample, **changes)


@BOTH
def test_improved_picks_reach_the_optimum_and_keep_what_they_must(make):
    robust = robust_of(make, estimator=Estimator(2))
    search = nsga2(robust, 40, 10, seed=1)
    today = robust(robust.space.nominal[None, :])
    before = pick(search.evaluated, today)
    better = improved(robust, search.evaluated, today)
    after = pick(better, today)
    assert after.keys() >= before.keys()
    drawn = robust(0.8 + 0.4 * np.random.default_rng(2).random((3000, 6)))
    best = pick(drawn, today)
    for name, row in after.items():
        column = 1 if name == "best sigma" else 0
        reached = better.objectives[row, column]
        if name in before:
            assert reached <= search.evaluated.objectives[before[name], column]
        if name in best:
            assert reached <= drawn.objectives[best[name], column] + 1e-3 * today.sigma_sum[0]
    assert np.all(better.designs >= robust.space.lower)
    assert np.all(better.designs <= robust.space.upper)


def test_a_fixed_variable_stays_where_it_is():
    robust = robust_of(quad2)
    lower, upper = robust.space.lower.copy(), robust.space.upper.copy()
    lower[0] = upper[0] = 1.0
    robust = replace(robust, space=replace(robust.space, lower=lower, upper=upper))
    search, today = nsga2(robust, 8, 3, seed=1), robust(robust.space.nominal[None, :])
    better = improved(robust, search.evaluated, today)
    assert (better.designs[:, 0] == 1.0).all()
    assert better.mean_sum.min() < search.front.mean_sum.min()
