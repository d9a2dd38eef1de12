"""Pareto fronts: made, verified, compared."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.front import (
    Contestant,
    ParetoFront,
    Verdict,
    common_box,
    coverage,
    design_distance,
    difference,
    last_gain,
    level_gap,
    nondominated,
    pareto_front,
    pareto_rank,
    thinned,
    verify,
)
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.scatter import sobol_sample
from deboom.explore.space import ResponseFunction, stiffness_factor_space


def values(objectives, designs=None, failed=None):
    objectives = np.asarray(objectives, dtype=float)
    n = len(objectives)
    designs = np.arange(float(n))[:, None] if designs is None else np.asarray(designs, dtype=float)
    return RobustValues(
        designs=designs,
        mean=objectives[:, :1],
        sigma=objectives[:, 1:],
        mean_sum=objectives[:, 0],
        sigma_sum=objectives[:, 1],
        standard_error_mean_sum=np.zeros(n),
        standard_error_sigma_sum=np.zeros(n),
        failed=np.zeros(n, dtype=bool) if failed is None else np.asarray(failed),
    )


def test_a_front_keeps_what_no_other_beats_sorted_by_the_mean():
    front = pareto_front(values([[3, 1], [1, 3], [2, 2], [2.5, 2.5], [1, 4], [2, 3]]))
    np.testing.assert_array_equal(front.objectives, [[1, 3], [2, 2], [3, 1]])
    np.testing.assert_array_equal(front.designs[:, 0], [1, 2, 0])


def test_failed_designs_are_never_on_a_front():
    front = pareto_front(values([[1, 1], [np.nan, np.nan], [0, 0]], failed=[False, True, True]))
    np.testing.assert_array_equal(front.objectives, [[1, 1]])
    assert len(pareto_front(values([[np.nan, np.nan]], failed=[True]))) == 0


def test_equal_designs_leave_one_and_order_does_not_matter():
    rows = [[1.0, 2.0], [1.0, 2.0], [2.0, 1.0], [1.5, 1.5], [1.5, 1.5]]
    designs = [[5.0], [4.0], [3.0], [1.0], [2.0]]
    expected = [[4.0], [1.0], [3.0]]
    for order in ([0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [1, 4, 0, 3, 2]):
        one = values(np.array(rows)[order], np.array(designs)[order])
        np.testing.assert_array_equal(pareto_front(one).designs, expected)
        parts = [values(np.array(rows)[[i]], np.array(designs)[[i]]) for i in order]
        np.testing.assert_array_equal(pareto_front(*parts).designs, expected)
        np.testing.assert_array_equal(
            pareto_front(pareto_front(*parts[:3]), *parts[3:]).designs, expected
        )


def test_nondominated_against_the_definition():
    points = np.random.default_rng(3).integers(0, 12, (80, 2)).astype(float)
    brute = np.array(
        [
            not any(
                (np.all(other <= point) and np.any(other < point))
                or (np.all(other == point) and j < i)
                for j, other in enumerate(points)
            )
            for i, point in enumerate(points)
        ]
    )
    np.testing.assert_array_equal(nondominated(points), brute)
    assert nondominated(np.empty((0, 2))).shape == (0,)


def test_ranks_peel_front_by_front():
    points = np.random.default_rng(1).random((40, 2))
    rank, left, number = pareto_rank(points), np.arange(40), 0
    while left.size:
        front = nondominated(points[left])
        assert (rank[left[front]] == number).all()
        left, number = left[~front], number + 1
    assert rank.max() == number - 1
    assert pareto_rank(np.empty((0, 2))).size == 0


def test_only_a_sorted_front_is_called_one():
    good = pareto_front(values([[1, 3], [2, 2]]))
    columns = {name: getattr(good, name)[::-1] for name in good.__dataclass_fields__}
    with pytest.raises(InputError, match="not a sorted Pareto front"):
        ParetoFront(**columns)


SPACE = stiffness_factor_space(("a", "b"))


def rising(designs):
    """Return responses that scatter the more, the better their mean."""
    return -np.exp(3.0 * designs)


def robust(function=rising, sampler=None, nominal_mean=False):
    model = ResponseFunction(function, ("a", "b"), ("u", "v"), "dB")
    return RobustResponse(model, SPACE, sampler or sobol_sample(2, 64, seed=1), nominal_mean)


def searched(response, n=200):
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((n, 2))
    return pareto_front(response(designs))


def test_verification_uses_draws_of_its_own_and_keeps_the_rows():
    front = searched(robust())
    check = verify(front, robust(), 256, seed=1)
    np.testing.assert_array_equal(check.values.designs, front.designs)
    purposes = ["verification sample", *(f"verification sample, set {n}" for n in (2, 3, 4))]
    sigma = np.stack(
        [
            replace(robust(), sample=sobol_sample(2, 256, seed=1, purpose=purpose))(
                front.designs
            ).sigma_sum
            for purpose in purposes
        ]
    )
    np.testing.assert_allclose(check.values.sigma_sum, sigma.mean(axis=0), rtol=1e-12)
    error = sigma.std(axis=0, ddof=1) / 2.0
    np.testing.assert_allclose(check.values.standard_error_sigma_sum, error, rtol=1e-9)
    np.testing.assert_array_equal(check.searched.designs, front.designs)
    relative = (front.sigma_sum - check.values.sigma_sum) / check.values.sigma_sum
    assert check.sigma_bias_percent == pytest.approx(100.0 * relative.mean())
    assert check.mean_bias == pytest.approx((front.mean_sum - check.values.mean_sum).mean())
    np.testing.assert_array_equal(check.nondominated, nondominated(check.values.objectives))
    assert (check.n_samples, check.seed) == (256, 1)


def test_a_thinned_front_keeps_its_ends_and_its_spacing():
    x = np.linspace(0.0, 1.0, 401) ** 3
    front = pareto_front(values(np.column_stack([x, 1.0 - x]), np.column_stack([x, x])))
    few = thinned(front, 11)
    np.testing.assert_allclose(few.objectives[[0, -1]], front.objectives[[0, -1]])
    np.testing.assert_allclose(few.objectives[:, 0], np.linspace(0, 1, 11), atol=0.01)
    assert thinned(front, 401) is front


def test_verification_keeps_the_meaning_of_the_mean():
    nominal = robust(nominal_mean=True)
    check = verify(searched(nominal), nominal, 64, seed=1)
    assert check.mean_bias == 0.0


def test_a_front_without_scatter_has_no_bias():
    response = replace(robust(), space=replace(SPACE, tolerance=np.zeros(2)))
    check = verify(searched(response), response, 64, seed=1)
    assert check.sigma_bias_percent == 0.0


def test_a_design_that_fails_under_the_new_draws_is_left_out_and_counted_as_beaten():
    def narrow(designs):
        return np.where(designs[:, :1] > 1.2 * 1.14, np.nan, rising(designs))

    front = pareto_front(values([[1.0, 2.0], [2.0, 1.0]], [[0.9, 1.1], [1.2, 1.1]]))
    check = verify(front, robust(narrow), 1024, seed=1)
    np.testing.assert_array_equal(check.values.failed, [False, True])
    np.testing.assert_array_equal(check.nondominated, [True, False])
    assert np.isfinite(check.sigma_bias_percent)


def test_a_front_that_fails_altogether_is_refused():
    front = searched(robust())
    broken = robust(lambda designs: np.full((len(designs), 2), np.nan))
    with pytest.raises(InputError, match="none of the"):
        verify(front, broken, 64, seed=1)


STAIRS = np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0]])


def test_hypervolume_of_a_known_staircase():
    box = common_box([STAIRS, STAIRS + 1.0])
    assert box.ideal.tolist() == [0.0, 0.0]
    assert box.nadir.tolist() == [2.0, 2.0]
    assert box.reference_point == pytest.approx([2.2, 2.2])
    area = 2.2 * 0.2 + 1.2 * 1.0 + 0.2 * 1.0  # strips from the top to the bottom
    assert box.hypervolume(STAIRS) == pytest.approx(area / 2.2**2)
    only = np.array([[1.0, 1.0]])
    assert box.hypervolume(only) == pytest.approx(1.2**2 / 2.2**2)
    assert box.hypervolume(np.array([[3.0, 3.0]])) == 0.0
    assert box.share(area) == pytest.approx(box.hypervolume(STAIRS))


def test_objectives_of_any_size_count_alike():
    factor, shift = np.array([1e4, 1e-3]), np.array([41000.0, -2.0])
    fronts = [STAIRS, STAIRS + 0.3]
    box = common_box(fronts)
    other = common_box([front * factor + shift for front in fronts])
    for front in fronts:
        scaled = front * factor + shift
        assert other.hypervolume(scaled) == pytest.approx(box.hypervolume(front), rel=1e-9)


def test_coverage_counts_what_is_equalled_or_beaten():
    assert coverage(STAIRS, STAIRS) == 1.0
    assert coverage(STAIRS, STAIRS + 0.1) == 1.0
    assert coverage(STAIRS + 0.1, STAIRS) == 0.0
    assert coverage(STAIRS[1:2], STAIRS) == pytest.approx(1 / 3)


def test_level_gap_is_the_shift_in_the_first_objective():
    quiet = STAIRS - np.array([0.4, 0.0])
    assert level_gap(quiet, STAIRS) == pytest.approx(-0.4)
    assert level_gap(STAIRS, quiet) == pytest.approx(0.4)
    assert np.isnan(level_gap(STAIRS, STAIRS + np.array([0.0, 5.0])))


def test_design_distance_runs_from_0_to_1_and_leaves_fixed_variables_out():
    low, high = np.array([0.8, 0.8, 1.0]), np.array([1.2, 1.2, 1.0])
    corner, opposite = np.array([[0.8, 0.8, 1.0]]), np.array([[1.2, 1.2, 1.0]])
    assert design_distance(corner, corner, low, high) == 0.0
    assert design_distance(corner, opposite, low, high) == pytest.approx(1.0)
    beside = np.array([[0.8, 1.2, 1.0]])
    assert design_distance(corner, beside, low, high) == pytest.approx(np.sqrt(0.5))
    both = np.vstack([corner, opposite])  # one has a partner, the other lies at distance 1
    assert design_distance(corner, both, low, high) == pytest.approx((0.0 + 0.5) / 2)
    assert design_distance(corner, opposite, low, low) == 0.0


def test_bad_fronts_are_refused():
    torn = np.where(STAIRS < 2.0, np.nan, STAIRS)
    for fronts in ([], [STAIRS, np.empty((0, 2))], [STAIRS, torn]):
        with pytest.raises(InputError, match="front"):
            common_box(fronts)
    with pytest.raises(InputError, match="same objectives"):
        common_box([STAIRS, np.ones((1, 3))])


def test_a_front_of_one_point_has_a_box_of_its_own_unit():
    point = np.array([[3.0, 4.0]])
    box = common_box([point])
    assert box.span.tolist() == [1.0, 1.0]
    assert box.hypervolume(point) == pytest.approx(1.0)
    assert box.hypervolume(point + np.array([0.0, 0.1])) == pytest.approx(1.0 / 1.1)


NORMAL_99 = 2.5758293035489004


def contestant(name, merit, progress=np.nan):
    merit = np.atleast_2d(merit)
    return Contestant(name, merit, np.full(len(merit), progress))


def test_single_runs_are_as_sure_as_their_searches_had_come_to_rest():
    moving = [contestant(n, [level, level], 0.01) for n, level in (("a", 0.80), ("b", 0.78))]
    found = difference(*moving)
    assert found.value == pytest.approx(0.02)
    assert found.draw_error == pytest.approx(0.0)
    assert found.search_error == pytest.approx(0.01 * np.sqrt(2))
    assert found.noise == pytest.approx(NORMAL_99 * 0.01 * np.sqrt(2))
    assert found.verdict is Verdict.noise
    resting = [contestant(n, [level, level], 0.001) for n, level in (("a", 0.80), ("b", 0.78))]
    assert difference(*resting).verdict is Verdict.real


def test_what_all_fronts_have_in_common_is_no_noise():
    common = np.array([0.0, 0.1, -0.1, 0.05])
    found = difference(contestant("a", 0.80 + common, 1e-4), contestant("b", 0.79 + common, 1e-4))
    assert found.draw_error == pytest.approx(0.0, abs=1e-15)
    assert found.verdict is Verdict.real
    alone = difference(contestant("a", 0.80 + common, 1e-4), contestant("b", [0.79] * 4, 1e-4))
    assert alone.draw_error == pytest.approx(common.std(ddof=1) / 2)
    assert alone.verdict is Verdict.noise


def test_from_three_seeds_on_their_own_spread_counts_and_progress_does_not():
    seeds = np.array([0.80, 0.81, 0.82])[:, None] * np.ones(4)
    found = difference(contestant("a", seeds, 9.9), contestant("b", seeds - 0.2, 9.9))
    assert found.search_error == pytest.approx(0.01 / np.sqrt(3) * np.sqrt(2))
    assert found.noise == pytest.approx(4.604094871349992 * found.search_error)  # t, 4 degrees
    assert found.verdict is Verdict.real


def test_nothing_known_nothing_decided():
    found = difference(contestant("a", [0.9, 0.9]), contestant("b", [0.1, 0.1], 0.01))
    assert found.verdict is Verdict.open
    assert np.isnan(found.noise)


def test_last_gain_is_that_of_the_last_fifth():
    assert last_gain(np.arange(1.0, 11.0)) == pytest.approx(2.0)  # generation 8 to 10
    assert last_gain(np.array([1.0, 4.0])) == pytest.approx(3.0)
    assert np.isnan(last_gain(np.array([1.0])))


def test_contestants_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="two sets"):
        contestant("a", [[0.8]])
    with pytest.raises(InputError, match="progress"):
        Contestant("a", np.ones((2, 3)), np.ones(3))
    with pytest.raises(InputError, match="same draws"):
        difference(contestant("a", [1.0, 1.0]), contestant("b", [1.0, 1.0, 1.0]))
