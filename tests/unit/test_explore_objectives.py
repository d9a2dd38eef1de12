"""Other questions than mean and sigma, and searches with more than two of them."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.archive import merge
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.fronts import ParetoFront, nondominated, pareto_front, verify
from deboom.explore.known_truth import quad2
from deboom.explore.objectives import (
    MEAN_SUM,
    SIGMA_SUM,
    Mean,
    Quantile,
    Sigma,
    TailMean,
    Total,
    Worst,
)
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.selection import compromise, pick, pseudo_weight_pick
from deboom.explore.tolerance_samples import sobol_sample

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = RobustResponse(MODEL, SPACE, sobol_sample(4, 64, seed=1))
VALUES = np.column_stack([np.arange(1.0, 101.0), np.arange(100.0, 0.0, -1.0) * 2.0])
MOMENTS = (VALUES.mean(axis=0), VALUES.std(axis=0))


@pytest.mark.parametrize(
    ("objective", "expected"),
    [
        (MEAN_SUM, 50.5 + 101.0),
        (Worst(Mean()), 101.0),
        (Worst(Sigma()), 2.0 * np.std(np.arange(100))),
        (SIGMA_SUM, 3.0 * np.std(np.arange(100))),
        (Total(Quantile(0.5)), 50.5 + 101.0),
        (Total(TailMean(0.95)), 98.0 + 196.0),  # the mean of the five largest
        (Worst(TailMean(0.9)), 2.0 * 95.5),
    ],
)
def test_objectives_by_hand(objective, expected):
    assert objective(VALUES, *MOMENTS) == pytest.approx(expected)
    assert objective.name


def test_a_tail_mean_lies_beyond_its_quantile_and_between_draws_it_is_weighted():
    values = np.arange(10.0)[:, None]
    assert TailMean(0.75)(values, *MOMENTS)[0] == pytest.approx((9 + 8 + 0.5 * 7) / 2.5)
    for share in (0.1, 0.5, 0.99):
        assert TailMean(share)(values, *MOMENTS) >= Quantile(share)(values, *MOMENTS)


@pytest.mark.parametrize("share", [0.0, 1.0, -1.0, float("nan")])
def test_shares_that_are_none_are_refused(share):
    for kind in (Quantile, TailMean):
        with pytest.raises(InputError, match="between 0 and 1"):
            kind(share)


def test_the_default_is_mean_and_sigma():
    values = ROBUST(np.ones((2, 4)))
    np.testing.assert_array_equal(
        values.objectives, np.column_stack([values.mean_sum, values.sigma_sum])
    )
    with pytest.raises(InputError, match="at least two objectives"):
        replace(ROBUST, objectives=(MEAN_SUM,))


def test_a_search_minimises_what_it_is_asked_for():
    robust = replace(ROBUST, objectives=(Worst(Mean()), Worst(TailMean(0.9))))
    front = nsga2(robust, 20, 15, seed=1).front
    np.testing.assert_array_equal(front.objectives[:, 0], front.mean.max(axis=1))
    default = nsga2(ROBUST, 20, 15, seed=1).front
    assert front.objectives[:, 0].min() < default.mean.max(axis=1).min()
    check = verify(front, robust, 256, seed=1)
    np.testing.assert_array_equal(check.values.objectives[:, 0], check.values.mean.max(axis=1))


def test_three_objectives():
    robust = replace(ROBUST, objectives=(MEAN_SUM, SIGMA_SUM, Worst(Quantile(0.9))))
    result = nsga2(robust, 20, 10, seed=1)
    assert result.front.objectives.shape[1] == 3
    assert nondominated(result.front.objectives).all()
    assert np.all(np.diff(result.front.objectives[:, 0]) >= 0.0)
    assert np.all(np.diff(result.hypervolume) >= 0.0)
    with pytest.raises(InputError, match="belong to two objectives, not to 3"):
        pick(result.front)
    assert 0 <= compromise(result.front, [1, 1, 1]) < len(result.front)
    columns = {name: getattr(result.front, name) for name in result.front.__dataclass_fields__}
    with pytest.raises(InputError, match="not a sorted Pareto front"):
        ParetoFront(**{name: column[::-1] for name, column in columns.items()})


def front_of(points):
    """Return values with these two objectives."""
    points = np.asarray(points, dtype=float)
    values = ROBUST(0.8 + 0.4 * np.random.default_rng(1).random((len(points), 4)))
    return replace(
        values,
        mean_sum=points[:, 0],
        sigma_sum=points[:, 1],
        failed=np.isnan(points[:, 0]),
        objectives=points,
    )


def test_compromise_and_pseudo_weights_on_a_quarter_circle():
    angle = np.linspace(0.0, np.pi / 2, 19)
    front = front_of(np.column_stack([5.0 - 5.0 * np.cos(angle), 100.0 - 100.0 * np.sin(angle)]))
    assert compromise(front, [1, 1]) == 9
    assert pseudo_weight_pick(front, [2.0, 2.0]) == 9
    assert compromise(front, [100, 1]) < 4
    assert pseudo_weight_pick(front, [1000, 1]) == 0
    assert pseudo_weight_pick(front, [1, 1000]) == 18
    assert compromise(front, [1, 100]) > 14


def test_picks_pass_over_failures_and_flat_objectives():
    front = front_of([[np.nan, np.nan], [1.0, 3.0], [2.0, 1.5], [3.0, 1.0]])
    assert compromise(front, [1, 1]) == 2
    assert pseudo_weight_pick(front, [1, 1]) == 2
    flat = front_of([[1.0, 2.0], [1.0, 2.0]])
    assert compromise(flat, [1, 1]) == 0
    assert pseudo_weight_pick(flat, [1, 1]) == 0
    nothing = front_of([[np.nan, np.nan]])
    for choose in (compromise, pseudo_weight_pick):
        with pytest.raises(InputError, match="nothing to pick"):
            choose(nothing, [1, 1])
        for weights in ([1], [1, 0], [1, -1], [1, np.nan], [1, np.inf], 1.0):
            with pytest.raises(InputError, match="do not weigh 2 objectives"):
                choose(front, weights)


def test_searches_of_several_seeds_merge_into_one_front():
    searches = [nsga2(ROBUST, 20, 10, seed=seed) for seed in (1, 2, 3)]
    merged = merge(searches)
    expected = pareto_front(*(search.front for search in searches))
    np.testing.assert_array_equal(merged.front.designs, expected.designs)
    assert merged.n_evaluated == 600
    assert merged.seed == 1
    np.testing.assert_array_equal(merge(searches[::-1]).front.objectives, merged.front.objectives)
    reference = np.max([search.reference_point for search in searches], axis=0)
    np.testing.assert_array_equal(merged.reference_point, reference)
    assert merged.hypervolume[-1] >= max(search.hypervolume[-1] for search in searches)
    with pytest.raises(InputError, match="no searches to merge"):
        merge([])
