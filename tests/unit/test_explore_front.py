"""Pareto fronts: made, verified, compared; picks, indifference intervals and polishing."""

from dataclasses import replace

import numpy as np
import pytest

import deboom
from deboom.errors import InputError
from deboom.explore import selection
from deboom.explore.descent import converged_front
from deboom.explore.front import (
    Contestant,
    FrontVerdict,
    JudgedFront,
    common_box,
    coverage,
    difference,
    front_difference,
    home_advantage,
    hypervolume,
    last_gain,
    level_gap,
    nondominated,
    pareto_front,
    replicates,
    search_bias,
    thinned,
    unbeaten,
)
from deboom.explore.front import (
    verified as verified_values,
)
from deboom.explore.moments import Estimator
from deboom.explore.robust import Robust, RobustValues
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.space import ResponseFunction, stiffness_factor_space
from samples.known_truth import WithSlopes, exp1, quad2


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
        kept = values(np.array(rows)[order], np.array(designs)[order])
        np.testing.assert_array_equal(pareto_front(kept).designs, expected)
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


SPACE = stiffness_factor_space(("a", "b"))


def rising(designs):
    """Return responses that scatter the more, the better their mean."""
    return -np.exp(3.0 * designs)


def robust(function=rising, sampler=None, nominal_mean=False):
    model = ResponseFunction(function, ("a", "b"), ("u", "v"), "dB")
    return Robust(model, SPACE, sampler or sobol_sample(2, 64, seed=1), nominal_mean)


def searched(response, n=200):
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((n, 2))
    return pareto_front(response(designs))


def test_verification_uses_draws_of_its_own_and_keeps_the_rows():
    front = searched(robust())
    verified = verified_values(front, replicates(robust(), 256, seed=1))
    np.testing.assert_array_equal(verified.designs, front.designs)
    purposes = ["verification sample", *(f"verification sample, set {n}" for n in (2, 3, 4))]
    sigma = np.stack(
        [
            replace(robust(), sample=sobol_sample(2, 256, seed=1, purpose=purpose))(
                front.designs
            ).sigma_sum
            for purpose in purposes
        ]
    )
    np.testing.assert_allclose(verified.sigma_sum, sigma.mean(axis=0), rtol=1e-12)
    error = sigma.std(axis=0, ddof=1) / 2.0
    np.testing.assert_allclose(verified.standard_error_sigma_sum, error, rtol=1e-9)
    relative = (front.sigma_sum - verified.sigma_sum) / verified.sigma_sum
    bias = (front.mean_sum - verified.mean_sum).mean(), 100.0 * relative.mean()
    assert search_bias(front, verified) == pytest.approx(bias)
    np.testing.assert_array_equal(unbeaten(verified), nondominated(verified.objectives))


def test_a_thinned_front_keeps_its_ends_and_most_of_its_volume():
    x = np.linspace(0.0, 1.0, 401) ** 3
    front = pareto_front(values(np.column_stack([x, 1.0 - x]), np.column_stack([x, x])))
    few = thinned(front, 11)
    np.testing.assert_allclose(few.objectives[[0, -1]], front.objectives[[0, -1]])
    # on a straight line no 11 points hold more than those that are evenly apart
    at = np.linspace(0.0, 1.0, 11)
    evenly = hypervolume(np.column_stack([at, front.objectives[0, 1] - at]), [1.0, 1.0])
    lost = 0.5 - (hypervolume(few.objectives, [1.0, 1.0]) - 0.0)
    assert len(few) == 11
    assert lost < 1.5 * (0.5 - evenly)
    assert thinned(front, 401) is front


def test_no_row_between_two_of_a_thinned_front_adds_more_than_the_one_that_stays():
    x = np.sort(np.random.default_rng(3).random(300))
    front = pareto_front(values(np.column_stack([x, (1.0 - x) ** 2]), np.column_stack([x, x])))
    whole, few = front.objectives, thinned(front, 20).objectives
    assert len(few) == 20
    for before, kept, after in zip(few, few[1:], few[2:], strict=False):
        between = whole[(whole[:, 0] > before[0]) & (whole[:, 0] < after[0])]
        adds = (after[0] - between[:, 0]) * (before[1] - between[:, 1])
        assert (after[0] - kept[0]) * (before[1] - kept[1]) == pytest.approx(adds.max())


def test_of_three_objectives_the_best_of_each_stays_and_few_points_hold_the_volume():
    draw = np.random.default_rng(1).normal(size=(300, 3))
    points = 1.0 - np.abs(draw) / np.linalg.norm(draw, axis=1)[:, np.newaxis]
    sums = np.zeros(300)
    no_design = np.zeros((300, 1))
    every = RobustValues(
        points, no_design, no_design, sums, sums, sums, sums, np.zeros(300, bool), objectives=points
    )
    front = pareto_front(every)
    few = thinned(front, 40)
    assert len(few) == 40
    np.testing.assert_array_equal(few.objectives.min(axis=0), front.objectives.min(axis=0))
    drawn = np.random.default_rng(2).permutation(len(front))[:40]
    reference = np.full(3, 1.1)
    random = hypervolume(front.objectives[drawn], reference)
    whole = hypervolume(front.objectives, reference)
    assert whole - hypervolume(few.objectives, reference) < 0.8 * (whole - random)


def test_verification_keeps_the_meaning_of_the_mean():
    nominal = robust(nominal_mean=True)
    front = searched(nominal)
    assert search_bias(front, verified_values(front, replicates(nominal, 64, seed=1)))[0] == 0.0


def test_a_front_without_scatter_has_no_bias():
    response = replace(robust(), space=replace(SPACE, tolerance=np.zeros(2)))
    front = searched(response)
    assert search_bias(front, verified_values(front, replicates(response, 64, seed=1)))[1] == 0.0


def test_a_design_that_fails_under_the_new_draws_is_left_out_and_counted_as_beaten():
    def narrow(designs):
        return np.where(designs > [1.2 * 1.14, np.inf], np.nan, rising(designs))

    front = pareto_front(values([[1.0, 2.0], [2.0, 1.0]], [[0.9, 1.1], [1.2, 1.1]]))
    judge = replicates(robust(narrow), 1024, seed=1)
    verified = verified_values(front, judge)
    np.testing.assert_array_equal(verified.failed, [False, True])
    np.testing.assert_array_equal(unbeaten(verified), [True, False])
    assert np.all(np.isfinite(search_bias(front, verified)))
    assert 0.0 < judge.sets[0].survivors(front.designs[1])[0] < 1.0


def test_a_front_that_fails_altogether_is_refused():
    front = searched(robust())
    broken = robust(lambda designs: np.full((len(designs), 2), np.nan))
    with pytest.raises(InputError, match="none of the"):
        verified_values(front, replicates(broken, 64, seed=1))


STAIRS = np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0]])


def test_hypervolume_of_a_known_staircase():
    box = common_box([STAIRS, STAIRS + 1.0])
    assert box.ideal.tolist() == [0.0, 0.0]
    assert box.nadir.tolist() == [2.0, 2.0]
    assert box.reference_point == pytest.approx([2.2, 2.2])
    area = 2.2 * 0.2 + 1.2 * 1.0 + 0.2 * 1.0  # strips from the top to the bottom
    assert box.hypervolume(STAIRS) == pytest.approx(area / 2.2**2)
    assert box.hypervolume(np.array([[1.0, 1.0]])) == pytest.approx(1.2**2 / 2.2**2)
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
    # of 200 levels 100 lie on a step of height 2, 99 on one of 1
    assert level_gap(STAIRS * [2.0, 1.0], STAIRS) == pytest.approx((200 + 99) / 200)


def test_the_noise_of_a_difference_by_hand():
    pair = Contestant("pair", np.ones((2, 3)), np.array([0.3, 0.4]), np.array([2.0, 3.0]))
    assert pair.search_noise == [(pytest.approx(np.sqrt((0.09 + 0.16) / 2 / 2)), 5.0)]
    assert last_gain(np.array([1.0, 3.0])) == 2.0
    first = Contestant("first", np.array([[1.1, 1.2, 1.3]]), np.zeros(1), np.full(1, np.inf))
    row = difference(first, replace(pair, noise=np.zeros(2))).table.iloc[0]
    # 0.1, 0.2 and 0.3 under three sets; Student's t of two degrees of freedom
    noise = 9.92484 * 10.0 / np.sqrt(3)
    assert row.tolist() == [pytest.approx(20.0), pytest.approx(noise, rel=1e-5), "not decided"]
    spread = np.arange(3.0)[:, None]
    thrice = [
        Contestant(side.name, side.merit[:1] + spread, np.zeros(3), np.full(3, np.inf))
        for side in (first, pair)
    ]
    assert difference(*thrice).verdict is FrontVerdict.noise
    assert thrice[0].search_noise[0] == (pytest.approx(1.0 / np.sqrt(3)), 2.0)
    assert replace(thrice[0], least=0.3).search_noise[1] == (
        pytest.approx(0.3 / np.sqrt(3)),
        np.inf,
    )
    assert difference(first, pair).too_few == ("first", "pair")
    assert difference(first, thrice[1]).too_few == ("first",)


CIRCLE = 1.0 - (1.0 - np.pi / 4.0) / 1.1**2
"""Share of its own box, up to the reference point, that the quarter circle dominates."""


def curve(*, n=1500, shift=0.0, converged=True, **changes):
    """Return a quarter circle from (0, 1) to (1, 0), under eight sets that differ a little."""
    angle = np.linspace(0.0, np.pi / 2, n)
    circle = 1.0 - np.column_stack([np.cos(angle), np.sin(angle)]) + shift
    by_set = circle + 1e-6 * np.arange(8.0)[:, None, None]
    return JudgedFront(by_set, np.zeros((n, 1)), converged=converged, **changes)


def compared(first, second, **changes):
    box = common_box([front.by_set.mean(axis=0) for front in (*first, *second)])
    return front_difference(
        first, second, box=box, names=("the first", "the second"), judge=None, **changes
    )


@pytest.mark.parametrize(
    ("first", "second", "verdict", "value"),
    [
        pytest.param([curve()], [curve()], FrontVerdict.equal, 0.0, id="equal"),
        pytest.param(
            [curve(converged=False)], [curve(converged=False)], FrontVerdict.equal, 0.0, id="single"
        ),
        pytest.param(
            [curve(), curve(shift=0.1)],
            [curve(shift=0.1), curve()],
            FrontVerdict.equal,
            0.0,
            id="in another order",
        ),
        pytest.param([curve()], [curve(shift=5.0)], FrontVerdict.real, CIRCLE, id="far away"),
        pytest.param(
            [curve()], [curve(shift=0.01)], FrontVerdict.real, 1 - (1.09 / 1.1) ** 2, id="shifted"
        ),
        pytest.param([curve()], [curve(shift=1e-5)], FrontVerdict.noise, 2e-5, id="hardly shifted"),
        pytest.param([curve()], [curve(n=1)], FrontVerdict.real, CIRCLE - 0.1 / 1.1, id="one end"),
        pytest.param(
            [curve(n=1)], [curve(n=1, shift=3e5)], FrontVerdict.real, 1 - 0.1**2 / 1.1**2, id="one"
        ),
    ],
)
def test_what_is_known_of_two_fronts_is_said(first, second, verdict, value):
    there, back = compared(first, second), compared(second, first)
    assert there.verdict is back.verdict is verdict
    assert there.value == pytest.approx(value, abs=1e-3)
    assert back.value == -there.value
    assert np.isfinite(there.noise)
    assert there.too_few == ()


def test_crossing_fronts_of_one_area_are_not_told_apart():
    share = np.linspace(0.0, 1.0, 101)
    steep = np.column_stack([0.5 * (1.0 - share) ** 2, share])
    fronts = [
        JudgedFront(np.tile(front, (8, 1, 1)), front, converged=True)
        for front in (steep, steep[:, ::-1])
    ]
    assert coverage(steep, steep[:, ::-1]) < 1.0 > coverage(steep[:, ::-1], steep)
    said = compared(fronts[:1], fronts[1:])
    assert said.verdict is FrontVerdict.noise
    assert said.value == pytest.approx(0.0, abs=1e-12)


def test_a_search_that_says_nothing_of_its_chance_is_not_decided_but_where_it_is_covered():
    """Its noise is the whole hypervolume; a converged front that covers all of it is better."""
    unknown, better = curve(n=60, shift=0.05, converged=False), curve(n=60)
    said = compared([better], [replace(unknown, by_set=unknown.by_set - [0.1, -0.2])])
    assert said.verdict is FrontVerdict.open
    assert said.too_few == ("the second",)
    assert "what would decide: 3 seeds of the second, searched with searches=3" in said.text
    assert compared([better], [unknown]).verdict is FrontVerdict.real
    single = replace(better, converged=False)
    assert compared([single], [unknown]).verdict is FrontVerdict.open
    assert compared([single], [unknown], may_cover_by_chance=False).verdict is FrontVerdict.real
    # beyond the box
    gained = replace(single, gain=1e9).noise(common_box([single.by_set[0]]))
    assert gained == single.noise(common_box([single.by_set[0]]))


def test_seeds_that_were_merged_say_how_far_a_search_scatters():
    """Three circles, one above the other: of their hypervolumes in the box the deviation counts."""
    seeds = tuple(curve(shift=shift).by_set[0] for shift in (0.0, 0.001, 0.002))
    merged, box = curve(converged=False, seeds=seeds), common_box([curve().by_set[0]])
    noise, freedom = merged.noise(box)
    assert freedom == 2.0
    assert noise == pytest.approx(np.std([box.hypervolume(each) for each in seeds], ddof=1))
    other = replace(curve(shift=0.05), converged=False, seeds=seeds)
    assert compared([merged], [other]).verdict is FrontVerdict.real
    assert compared([merged], [curve(shift=1e-3)]).verdict is FrontVerdict.noise


def test_the_last_gain_is_that_of_the_last_fifth_of_the_generations():
    assert last_gain(np.arange(10.0) ** 2) == 9.0**2 - 7.0**2
    assert last_gain(np.arange(100.0)) == 20.0
    assert np.isnan(last_gain(np.array([1.0])))


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
    assert selection.pick(rows(*objectives)) == dict(
        zip(("best-mean", "best-sigma"), expected, strict=True)
    )


def vehicles(*each):
    """Values of two responses, given as (mean, mean, sigma sum)."""
    numbers = np.array(each, float)
    zeros, sigma = np.zeros(len(numbers)), numbers[:, 2:] / 2.0
    return RobustValues(
        zeros[:, None],
        numbers[:, :2],
        np.hstack([sigma, sigma]),
        numbers[:, :2].sum(axis=1),
        numbers[:, 2],
        zeros,
        zeros,
        zeros > 0.0,
    )


def test_picks_that_keep_what_today_has():
    today = vehicles((10, 10, 4))
    picked = vehicles((2, 11, 5), (6, 9, 5), (7, 9, 4), (9, 9.5, 3), (12, 12, 1))
    assert selection.pick(picked, today) == {
        "best-mean": 0,
        "none-louder": 1,
        "sigma-kept": 2,
        "best-sigma": 4,
    }
    assert "none-louder" not in selection.pick(vehicles((2, 11, 5), (10, 10, 4)), today)


def test_picks_of_three_objectives_by_hand():
    """Distances to the ideal point (0, 0, 0) in a box of 10: 1.04, 0.44, 0.93, 0.62 and 1.41."""

    def values(*points):
        objectives, zeros = np.array(points, float), np.zeros(len(points))
        each = zeros[:, None]
        return RobustValues(
            objectives, each, each, *[zeros] * 4, zeros > 0.0, objectives=objectives
        )

    front = values((0, 3, 10), (2, 2, 3.4), (4, 0, 8.4), (6, 1, 1), (10, 10, 0))
    names = {0: "mean a", 1: "mean b", 2: "sigma"}
    picked = {"best-mean a": 0, "best-mean b": 2, "best-sigma": 4, "nearest-to-ideal": 1}
    assert selection.pick_of_any(front, names) == picked
    today = values((6, 3, 3.4))  # designs 1 and 3 are nowhere worse
    assert selection.pick_of_any(front, names, today) == picked | {"none-worse": 1}
    without = values((1, 3, 3.4))
    assert "none-worse" not in selection.pick_of_any(front, names, without)


def test_nothing_to_pick_is_said():
    with pytest.raises(InputError, match="nothing to pick"):
        selection.pick(rows(None, None))


FOUR = stiffness_factor_space(("a", "b", "c", "d"))


def model(function, n_responses=2):
    names = tuple(f"u{r}" for r in range(n_responses))
    return ResponseFunction(function, FOUR.names, names, "dB")


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
    space = replace(FOUR, **changes)
    assert selection.variables_without_effect(model(function), space) == tuple(expected)


def test_back_to_nominal():
    designs = np.array([[0.9, 0.9, 0.9, 0.9], [1.1, 1.1, 1.1, 1.1]])
    np.testing.assert_array_equal(
        selection.at_nominal(designs, FOUR, ("b", "d")), [[0.9, 1, 0.9, 1], [1.1, 1, 1.1, 1]]
    )
    assert designs[0, 1] == 0.9
    with pytest.raises(InputError, match="no design variable 'e'"):
        selection.at_nominal(designs, FOUR, ("e",))


def exact(function, n_responses=2):
    exact = replace(FOUR, tolerance=np.zeros(4))
    return Robust(model(function, n_responses), exact, sobol_sample(4, 2, seed=1))


def steep_flat_none_oneway(designs):
    a, b, _, d = designs.T
    response_1 = 10.0 * a + 0.1 * b + np.where(d > 1.0, 20.0 * (d - 1.0), 0.0)
    return np.column_stack([response_1, response_1])


def test_indifference_intervals_in_closed_form():
    lower, upper = selection.indifference_intervals(
        exact(steep_flat_none_oneway), np.ones(4), change=0.5, n_points=17
    )
    np.testing.assert_allclose(lower, [0.95, 0.8, 0.8, 0.8], atol=1e-12)
    np.testing.assert_allclose(upper, [1.05, 1.2, 1.2, 1.025], atol=1e-12)


def test_the_change_is_counted_per_response():
    single = exact(lambda designs: 10.0 * designs[:, :1], n_responses=1)
    three = exact(lambda designs: np.repeat(10.0 * designs[:, :1], 3, axis=1), n_responses=3)
    for response in (single, three):
        lower, upper = selection.indifference_intervals(response, np.full(4, 1.013), change=0.7)
        np.testing.assert_allclose([lower[0], upper[0]], [0.943, 1.083], atol=1e-12)


def test_only_the_interval_around_the_design_counts():
    wave = exact(lambda designs: np.repeat(np.sin(40.0 * designs[:, :1]), 2, axis=1))
    lower, upper = selection.indifference_intervals(wave, np.ones(4), change=0.3, n_points=401)
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

    lower, upper = selection.indifference_intervals(exact(narrow), np.ones(4), 1.0, n_points=9)
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
        selection.indifference_intervals(exact(steep_flat_none_oneway), design, change, n_points)


def test_a_design_that_fails_has_no_intervals():
    broken = exact(lambda designs: np.full((len(designs), 2), np.nan))
    with pytest.raises(InputError, match="fails itself"):
        selection.indifference_intervals(broken, np.ones(4), 0.1)


BOTH = pytest.mark.parametrize("make", [quad2, exp1])


def robust_of(make, **changes):
    problem = make(6, seed=1)
    space = stiffness_factor_space(problem.variable_names)
    sample = changes.pop("sample", sobol_sample(6, 64, seed=1))
    return Robust(problem, space, sample, **changes)


@BOTH
def test_improved_picks_reach_the_optimum_and_keep_what_they_must(make):
    exact = robust_of(make, estimator=Estimator(2))
    search = nsga2(exact, Search(40, 10, seed=1))
    today = exact(exact.space.nominal[None, :])
    before = selection.pick(search.evaluated, today)
    better = selection.improved(exact, search.evaluated, today)
    after = selection.pick(better, today)
    assert after.keys() >= before.keys()
    drawn = exact(0.8 + 0.4 * np.random.default_rng(2).random((3000, 6)))
    best = selection.pick(drawn, today)
    for name, row in after.items():
        column = 1 if name == "best-sigma" else 0
        reached = better.objectives[row, column]
        if name in before:
            assert reached <= search.evaluated.objectives[before[name], column]
        if name in best:
            assert reached <= drawn.objectives[best[name], column] + 1e-3 * today.sigma_sum[0]
    assert np.all(better.designs >= exact.space.lower)
    assert np.all(better.designs <= exact.space.upper)


def test_a_fixed_variable_stays_where_it_is():
    exact = robust_of(quad2)
    lower, upper = exact.space.lower.copy(), exact.space.upper.copy()
    lower[0] = upper[0] = 1.0
    exact = replace(exact, space=replace(exact.space, lower=lower, upper=upper))
    search, today = nsga2(exact, Search(8, 3, seed=1)), exact(exact.space.nominal[None, :])
    better = selection.improved(exact, search.evaluated, today)
    assert (better.designs[:, 0] == 1.0).all()
    assert better.mean_sum.min() < search.front.mean_sum.min()


def test_a_front_is_thinned_in_its_box_and_not_in_the_units_of_its_objectives():
    """Whatever the units are, the same designs stay."""
    x = np.linspace(0.0, 1.0, 17)
    arc = np.c_[x, (1.0 - x) ** 3]
    designs = np.zeros((17, 1))
    stay = [
        thinned(
            RobustValues(arc, designs, designs, *sums.T, *sums.T, np.zeros(17, bool)), 5
        ).designs
        for sums in (arc * scale for scale in ((1.0, 1.0), (1.0, 1024.0), (1024.0, 1.0)))
    ]
    assert len(stay[0]) == 5
    np.testing.assert_array_equal(stay[0][[0, -1]], arc[[0, -1]])
    np.testing.assert_array_equal(stay[1], stay[0])
    np.testing.assert_array_equal(stay[2], stay[0])


def test_a_front_of_three_objectives_is_thinned_in_its_box_too():
    """The reference point lies beyond the box: numbers far above 1 would all lie outside."""
    x, y = np.random.default_rng(1).uniform(size=(2, 40))
    plane = np.c_[x, y, 2.0 - x - y]
    zeros = np.zeros(40)
    stay = [
        thinned(
            RobustValues(
                plane, plane, plane, *[zeros] * 4, np.zeros(40, bool), objectives=plane * scale
            ),
            9,
        ).designs
        for scale in ((1.0, 1.0, 1.0), (1024.0, 1.0, 1.0), (1.0, 1024.0, 1024.0))
    ]
    np.testing.assert_array_equal(stay[1], stay[0])
    np.testing.assert_array_equal(stay[2], stay[0])


L_SHAPE = np.array(
    [[0.0, 10.0], [0.2, 6.0], [0.4, 2.0], [1.0, 1.6], [2.0, 1.0], [3.0, 0.5], [4.0, 0]]
)
"""A front in two units whose third design is its corner."""


def test_decisions_on_a_front_by_hand():
    assert selection.knee(L_SHAPE) == 2
    assert selection.nearest_to_ideal(L_SHAPE) == 2
    assert selection.nearest_to_ideal(L_SHAPE * [1e6, 1e-6]) == 2
    with pytest.raises(InputError, match="no knee"):
        selection.knee(L_SHAPE[:2])
    # it misses by 0.2 of 4 and 1 of 10, of which the worse is the least of all
    assert selection.nearest_to_reference(L_SHAPE, np.array([0.8, 0.6])) == 3
    # it can be beaten: the margins 0.3/4 and 1/10 of the ranges are the largest least ones
    assert selection.nearest_to_reference(L_SHAPE, np.array([0.7, 3.0])) == 2
    # the first alone, the second alone, both alike
    ends = [selection.nearest_to_weights(L_SHAPE, np.array(each)) for each in ([1.0, 0], [0, 1.0])]
    assert ends == [0, 6]
    # 0.75 and 0.84 of the ranges from the worst are shares of 0.47 and 0.53
    assert selection.nearest_to_weights(L_SHAPE, np.array([2.0, 2.0])) == 3
    # of the columns that count, one design may have the worst of all
    assert selection.nearest_to_weights(np.vstack([L_SHAPE, [4.0, 10.0]]), np.ones(2)) == 3
    assert selection.nearest_to_weights(L_SHAPE[:1], np.ones(2)) == 0
    # desirabilities of the third: 0.8 and 0.8; of the fifth 0 in the first
    desired, unacceptable = np.array([0.0, 0.0]), np.array([2.0, 10.0])
    assert selection.most_desirable(L_SHAPE, desired, unacceptable) == 2
    with pytest.raises(InputError, match=r"not acceptable .*: ease"):
        selection.most_desirable(L_SHAPE, desired - 9.0, desired)


def test_a_front_is_asked_for_a_design_by_columns_of_its_table():
    model = quad2(4, seed=1)
    robust = Robust(model, stiffness_factor_space(model.variable_names), draws=16)
    front = deboom.search(robust, population=20, generations=10, verified_with=16, polish=False)
    mean, sigma = "mean sum [1]", "sigma sum [1]"
    shown = front.table[front.nondominated]
    assert front.pick("best-mean") == front.picks["best-mean"]
    assert front.pick(weights={mean: 1, sigma: 0}) == shown[mean].idxmin()
    assert front.pick(reference={mean: shown[mean].max(), sigma: 0.0}) == shown[sigma].idxmin()
    ends = {name: (shown[name].min(), shown[name].max()) for name in (mean, sigma)}
    compromise = front.table.loc[front.pick(desired=ends)]
    assert all(low < compromise[name] < high for name, (low, high) in ends.items())
    assert front.nondominated[front.pick("nearest")]
    for words, question in (
        ("one of: 'knee', 'nearest'", {}),
        ("one of: 'knee', 'nearest'", {"rule": "knee", "weights": {mean: 1.0}}),
        ("there is no pick 'best'", {"rule": "best"}),
        ("has no column 'mean' with numbers", {"weights": {"mean": 1.0}}),
    ):
        with pytest.raises(InputError, match=words):
            front.pick(**question)


def test_a_front_is_better_at_home_where_descents_fitted_it_to_its_draws():
    """Sixteen draws are few: each of two fronts is ahead under its own, where it was fitted."""
    model = WithSlopes(quad2(4, seed=1))
    space = stiffness_factor_space(model.variable_names)
    robusts = [Robust(model, space, sobol_sample(4, 16, seed=seed)) for seed in (1, 2)]
    fronts = [
        JudgedFront(
            values.objectives[np.newaxis],
            values.designs,
            converged=True,
            found_with=robust.sample,
        )
        for robust in robusts
        for values in [thinned(converged_front(robust, seed=1), 30)]
    ]
    first, second = ([front] for front in fronts)
    advantage = home_advantage(first, second, robusts[0])
    assert advantage == home_advantage(second, first, robusts[1]) > 0.01
    assert home_advantage(first, first, robusts[0]) == 0.0
    foreign = [replace(fronts[1], found_with=sobol_sample(5, 16, seed=2))]
    unknown, single = ([replace(fronts[1], found_with=None)], [replace(fronts[1], converged=False)])
    for other in (foreign, unknown, single, second * 3):
        mine = first * 3 if other == second * 3 else first
        assert home_advantage(mine, other, robusts[0]) == 0.0
