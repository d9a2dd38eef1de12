"""Indices, correlations, capabilities and verdicts on fronts against closed forms and counts."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import spearmanr

import deboom
from deboom.errors import InputError
from deboom.explore import front, sensitivity
from deboom.explore.correlation import correlations, families, tolerance_scatter
from deboom.explore.descent import converged_front
from deboom.explore.result import merge
from deboom.explore.robust import Robust
from deboom.explore.scatter import capability, predicted_pieces, sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.space import ResponseFunction, stiffness_factor_space
from samples.known_indices import Ishigami, SobolG
from samples.known_truth import WithSlopes, quad2


def analysed(inputs, model, n_base, seed=1, **options):
    values = model(sensitivity.sobol_designs(inputs, n_base, seed=seed))
    names = [f"y{place}" for place in range(values.shape[1])]
    return sensitivity.fast_sobol_indices(values, inputs.factors, names, seed=seed, **options)


@pytest.mark.parametrize("model", [Ishigami(), SobolG()], ids=["Ishigami", "Sobol G"])
def test_indices_reach_the_closed_form(model):
    indices, exact = analysed(model.inputs, model, 4096), model.exact
    assert indices.first[:, 0] == pytest.approx(exact.first, abs=0.005)
    assert indices.total[:, 0] == pytest.approx(exact.total, abs=0.005)
    assert np.all(np.abs(indices.total[:, 0] - exact.total) <= indices.total_interval[:, 0])


def test_ishigami_as_published():
    exact = Ishigami().exact  # Saltelli et al., "Global Sensitivity Analysis. The Primer", 2008
    assert exact.first == pytest.approx([0.3139, 0.4424, 0.0], abs=5e-5)
    assert exact.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=5e-5)


@pytest.mark.parametrize("model", [Ishigami(), SobolG()], ids=["Ishigami", "Sobol G"])
def test_pair_indices_reach_the_closed_form(model):
    designs = sensitivity.sobol_designs(model.inputs, 4096, seed=1, pairs=True)
    names = model.inputs.factors
    pairs = sensitivity.pair_indices(model(designs), names, ["y"], seed=1)
    if isinstance(model, Ishigami):  # only x1 and x3 act together, with all of x3's total index
        exact = np.zeros((3, 3))
        exact[0, 2] = exact[2, 0] = model.exact.total[2]
    else:
        alone = 1.0 / (3.0 * (1.0 + np.array(model.a)) ** 2)
        exact = np.outer(alone, alone) / (np.prod(1.0 + alone) - 1.0)
        np.fill_diagonal(exact, 0.0)
    assert pairs.second[:, :, 0] == pytest.approx(exact, abs=0.02)
    assert pairs.first[:, 0] == pytest.approx(model.exact.first, abs=0.005)
    assert np.array_equal(pairs.second, pairs.second.transpose(1, 0, 2))
    with pytest.raises(InputError, match="two factors"):
        sensitivity.pair_indices(model(designs), names[:1], ["y"], seed=1)


def test_a_pair_of_two_factors_is_all_that_they_do_together():
    """Of the product of two uniform factors about 0, all variance is that of the pair."""
    inputs = sensitivity.SensitivityInputs(("a", "b"), -np.ones(2), np.ones(2))
    designs = sensitivity.sobol_designs(inputs, 2048, seed=1, pairs=True)
    product = np.prod(designs, axis=1, keepdims=True)
    pairs = sensitivity.pair_indices(product, ("a", "b"), ["y"], seed=1)
    assert pairs.second[0, 1, 0] == pytest.approx(1.0, abs=0.02)


def test_groups_reach_the_closed_form():
    model = SobolG((0.0, 0.5, 3.0, 9.0))
    inputs = model.inputs.grouped(["a", "a", "b", "b"])
    alone = 1.0 / (3.0 * (1.0 + np.array(model.a)) ** 2)
    both = np.array([np.prod(1.0 + alone[:2]), np.prod(1.0 + alone[2:])]) - 1.0
    variance = np.prod(1.0 + both) - 1.0
    indices = analysed(inputs, model, 4096)
    assert indices.factors == ("a", "b")
    assert indices.first[:, 0] == pytest.approx(both / variance, abs=0.01)


def test_both_named_analyses_weigh_a_sum_by_its_variances():
    weights, space = np.array([1.0, 2.0, 3.0]), stiffness_factor_space(["a", "b", "c"], 0.15, 0.30)
    for inputs in (sensitivity.design_inputs(space), sensitivity.tolerance_inputs(space)):
        designs = sensitivity.sobol_designs(inputs, 1024, seed=3)
        assert designs.min() >= inputs.lower.min()
        assert designs.max() <= inputs.upper.max()
        indices = analysed(inputs, lambda x: x @ weights[:, None], 1024, seed=3)
        share = weights**2 / (weights**2).sum()
        assert indices.total[:, 0] == pytest.approx(share, abs=0.002)
        assert indices.first[:, 0] == pytest.approx(share, abs=0.005)
    drawn = designs[::5]  # gaussian, σ = 0.1, cut at ±3 σ
    assert drawn.std(axis=0) == pytest.approx([0.0986578] * 3, rel=2e-3)
    assert np.abs(drawn - 1.0).max() <= 0.3


def test_every_number_is_salibs():
    random = np.random.default_rng(7)
    inputs = sensitivity.SensitivityInputs(tuple("abcde"), np.zeros(5), np.ones(5))
    designs = sensitivity.sobol_designs(inputs, 128, seed=5)
    weights = random.normal(size=(5, 20))
    values = 1e3 + np.exp(designs @ weights) + (designs[:, :1] - 0.5) * designs[:, 1:2] ** 2
    names = [f"y{place}" for place in range(20)]
    ours, salib = (
        analyse(values, inputs.names, names, seed=9, n_resamples=30)
        for analyse in (sensitivity.fast_sobol_indices, sensitivity.sobol_indices)
    )
    for name in ("first", "total", "interaction"):
        for kind in (name, f"{name}_interval"):
            np.testing.assert_allclose(
                getattr(ours, kind), getattr(salib, kind), rtol=1e-9, atol=1e-12
            )


def test_elementary_effects_of_ishigami():
    model, inputs = Ishigami(), Ishigami().inputs
    paths = sensitivity.morris_designs(inputs, 100, seed=1)
    morris = sensitivity.morris_analysis(inputs, paths, model(paths), ["y"], seed=1)
    # x2 alone is symmetric: its effects cancel in the mean and not in their size; four levels of x2
    # from -π to π give sin² 0 or 3/4, hence effects of ±7·3/4 over a step of 2/3
    assert morris.mu_star[1, 0] == pytest.approx(7.0 * 0.75 * 1.5)
    assert abs(morris.mu[1, 0]) < 0.5 * morris.mu_star[1, 0]


def binormal(random, n, r):
    x = random.normal(size=(n, 2))
    return np.column_stack([x[:, 0], r * x[:, 0] + np.sqrt(1 - r**2) * x[:, 1]])


def test_coefficients_are_those_of_numpy_and_scipy_also_with_ties():
    random = np.random.default_rng(1)
    values = random.normal(size=(80, 4)) @ random.normal(size=(4, 4))
    values[:, 1] = np.round(values[:, 1])
    computed = correlations(values, list("abcd"), seed=1, resamples=100)
    assert computed.pearson == pytest.approx(np.corrcoef(values.T), abs=1e-13)
    assert computed.spearman == pytest.approx(spearmanr(values).statistic, abs=1e-13)


def test_intervals_cover_the_truth_as_often_as_they_say():
    random, r = np.random.default_rng(4), 0.6
    hits, n_sets = 0, 150
    for number in range(n_sets):
        computed = correlations(binormal(random, 150, r), "ab", seed=number + 1, resamples=200)
        hits += computed.pearson_low[0, 1] <= r <= computed.pearson_high[0, 1]
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
    computed = correlations(scatter, "ab", seed=1, resamples=100)
    assert computed.pearson[0, 1] == pytest.approx(0.8, abs=0.02)
    assert computed.pearson_low[0, 1] < 0.8 < computed.pearson_high[0, 1]


def test_families_of_a_block_matrix_are_its_blocks():
    r = np.full((5, 5), 0.2)
    r[:2, :2], r[2:, 2:] = 0.95, 0.97
    np.fill_diagonal(r, 1.0)
    grouped = families("abcde", r, cut=0.9)
    assert grouped.members == (("c", "d", "e"), ("a", "b"))
    assert grouped.merges[-1, 2] == pytest.approx(0.8)
    assert families("abcde", r, cut=0.96).members == (("c", "d", "e"), ("a",), ("b",))


def test_every_pair_of_a_family_keeps_the_cut():
    # a chain: neighbours correlate by 0.92, ends by 0.7; single linkage would join them all
    r = np.array([[1, 0.92, 0.7], [0.92, 1, 0.92], [0.7, 0.92, 1]])
    assert sorted(map(len, families("abc", r, cut=0.9).members)) == [1, 2]


def sample_of(n, mean, sigma):
    """Values with exactly this mean and standard deviation."""
    values = np.linspace(-1, 1, n)
    return mean + sigma * values / values.std(ddof=1)


def test_montgomery_example_of_cp():
    # Montgomery, Statistical Quality Control: limits 38 and 62, n = 20, s = 1.75, 95 % two-sided:
    # Cp = 2.29 with 1.57 as lower end, the one-sided bound of 97.5 %; the book rounds Cp on the way
    index = capability(sample_of(20, 50.0, 1.75), 38.0, 62.0, confidence=0.975)
    assert index.cp == pytest.approx(2.29, abs=0.005)
    assert index.cp_bound == pytest.approx(1.57, abs=0.006)
    assert index.cpk == pytest.approx(index.cp)


def test_cpk_of_a_mean_off_the_middle_and_outside():
    for mean in (0.98, 1.02):
        assert capability(sample_of(30, mean, 0.01), 0.94, 1.06).cpk == pytest.approx(4 / 3)
    outside = capability(sample_of(30, 1.10, 0.01), 0.94, 1.06)
    assert outside.cpk < 0
    assert outside.expected_outside > 0.99


def test_bounds_hold_as_often_as_they_say():
    random = np.random.default_rng(1)
    true_cp, true_cpk = 0.12 / 6 / 0.015, 0.05 / 3 / 0.015
    capabilities = [capability(random.normal(1.01, 0.015, 30), 0.94, 1.06) for _ in range(2000)]
    cp = np.mean([index.cp_bound <= true_cp for index in capabilities])
    cpk = np.mean([index.cpk_bound <= true_cpk for index in capabilities])
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


def random_front(random, size):
    points = random.random((size, 2))
    return points[front.nondominated(points)]


@pytest.mark.parametrize("n_fronts", [2, 5, 8])
def test_attainment_is_what_counting_says(n_fronts):
    random = np.random.default_rng(n_fronts)
    fronts = [random_front(random, 12) for _ in range(n_fronts)]
    grid = random.random((4000, 2))
    attained = sum(
        np.all(curve[None] <= grid[:, None], axis=2).any(axis=1).astype(int) for curve in fronts
    )
    shares = [1.0 / n_fronts, 0.25, 0.5, 1.0]
    for share, surface in front.attainment(fronts, shares).items():
        inside = np.all(surface[None] <= grid[:, None], axis=2).any(axis=1)
        assert np.array_equal(inside, attained >= np.ceil(share * n_fronts - 1e-9))
        assert front.nondominated(surface).all()
        assert np.all(np.diff(surface[:, 0]) > 0.0)


def test_hypervolume_of_a_dense_quarter_circle():
    angle = np.linspace(0.0, np.pi / 2, 20001)
    circle = 1.0 - np.column_stack([np.cos(angle), np.sin(angle)])
    box = front.common_box([circle])
    # the corner up to 1.1 less the corner that the circle leaves free
    assert box.hypervolume(circle) == pytest.approx((1.21 - (1.0 - np.pi / 4.0)) / 1.21, abs=1e-4)


@pytest.mark.parametrize("n_runs", [3, 10])
def test_equal_configurations_are_called_different_in_one_case_of_a_hundred(n_runs):
    random = np.random.default_rng(1)
    trials, alarms = 2000, 0
    for _ in range(trials):
        draws = 0.002 * random.standard_normal((1, 8))
        both = [
            front.Contestant(
                name,
                0.8
                + draws
                + 0.01 * random.standard_normal((n_runs, 1))
                + 0.0005 * random.standard_normal((1, 8)),
                np.ones(n_runs),
                np.full(n_runs, np.inf),
            )
            for name in "ab"
        ]
        alarms += front.difference(*both).verdict is front.FrontVerdict.real
    # 20 expected; three standard deviations are 13, and Welch's t is careful with three runs
    assert alarms <= 33
    assert alarms >= 2


def test_a_difference_of_five_standard_errors_is_found():
    random = np.random.default_rng(2)
    successes = 0
    for _ in range(300):
        seeds = 0.01 * random.standard_normal((2, 10, 1)) + np.zeros((1, 1, 8))
        shift = 5.0 * 0.01 * np.sqrt(2.0 / 10.0)
        pair = (
            front.Contestant("a", 0.8 + shift + seeds[0], *np.ones((2, 10))),
            front.Contestant("b", 0.8 + seeds[1], *np.ones((2, 10))),
        )
        successes += front.difference(*pair).verdict is front.FrontVerdict.real
    assert successes >= 270


SHAPE_OF_SEEDS = WithSlopes(quad2(4, seed=1))
SPACE_OF_SEEDS = stiffness_factor_space(SHAPE_OF_SEEDS.variable_names)


def seeded(seed):
    """Return a robust problem of closed form with draws of its own."""
    return Robust(SHAPE_OF_SEEDS, SPACE_OF_SEEDS, sobol_sample(4, 64, seed=seed))


def judged(values, robust, judges, **changes):
    few = front.thinned(values, 40)
    by_set = np.stack([each.objectives for each in judges.by_set(few.designs)])
    return front.JudgedFront(by_set, few.designs, found_with=robust.sample, **changes)


def verdicts(pairs):
    """Return the verdicts of pairs of lists of fronts, each in its own box."""
    judge = seeded(1)
    for first, second in pairs:
        box = front.common_box([each.by_set.mean(axis=0) for each in (*first, *second)])
        yield front.front_difference(first, second, box=box, names=("a", "b"), judge=judge).verdict


def share_of_real(pairs):
    said = list(verdicts(pairs))
    return np.mean([each is front.FrontVerdict.real for each in said])


def test_seeds_of_one_search_are_hardly_ever_called_different():
    """At most 5 % of pairs of seeds: single searches, three of each, three that were merged."""
    judges, pool, searches = front.common_judges(seeded(1), 128, 1), [], []
    for seed in range(1, 31):
        robust = seeded(seed)
        found = nsga2(robust, Search(12, 10, seed=seed))
        searches.append(found)
        gain = front.last_gain(found.hypervolume)
        pool.append(judged(found.front, robust, judges, gain=gain))
    single = [([pool[i]], [pool[j]]) for i, j in itertools.combinations(range(30), 2)]
    random = np.random.default_rng(1)
    drawn = [[pool[k] for k in random.permutation(30)[:6]] for _ in range(400)]
    merged = [merge(searches[k : k + 3]) for k in range(0, 30, 3)]
    unions = [judged(each.front, seeded(1), judges, seeds=each.seeds) for each in merged]
    assert len(single) == 435
    assert share_of_real(single) <= 0.05
    assert share_of_real([(six[:3], six[3:]) for six in drawn]) <= 0.05
    both = [([one], [other]) for one, other in itertools.combinations(unions, 2)]
    assert share_of_real(both) <= 0.05
    assert front.FrontVerdict.open not in set(verdicts(both))


def test_converged_fronts_differ_really_when_they_do():
    """Of pairs of seeds at most 5 %; of pairs 0.5 and 1 % of the hypervolume apart all.

    Of pairs 0.2 % apart all are found with three seeds that do not scatter.

    The eight searches have draws of their own, to which descents fit them: with 64 draws their
    hypervolumes scatter by 0.6 %, twenty times what descents leave under the same draws.
    """
    judges = front.common_judges(seeded(1), 512, 1)
    own = [
        judged(converged_front(seeded(seed), seed=seed), seeded(seed), judges, converged=True)
        for seed in range(1, 9)
    ]
    pairs = [([one], [other]) for one, other in itertools.combinations(own, 2)]
    assert share_of_real(pairs) <= 0.05
    box = front.common_box([own[0].by_set.mean(axis=0)])
    volume = own[0].merit(box).mean()

    def shifted(each, step):
        return replace(each, by_set=each.by_set + step * box.span)

    def lost(step, share):
        return shifted(own[0], step).merit(box).mean() - (1.0 - share) * volume

    for share, seeds in ((0.005, 1), (0.01, 1), (0.002, 3)):
        step = brentq(lost, 0.0, 1.0, args=(share,))
        alike = [[one] * seeds for one in own]
        moved = [[shifted(one, step)] * seeds for one in own]
        assert share_of_real(list(zip(alike, moved, strict=True))) == 1.0


def test_variables_correlate_with_a_line_by_their_share_of_its_slope():
    """Of ``2 a - b`` with independent variables of one width: 2/√5 and -1/√5; c has no part."""
    model = deboom.ResponseFunction(
        lambda x: np.c_[2.0 * x[:, 0] - x[:, 1], x[:, 2]], tuple("abc"), ("line", "c alone"), "1"
    )
    rows = deboom.doe(model, model.design_space(), n=1024)
    correlated = deboom.correlation(rows, inputs=True, resamples=100)
    expected = {"a": 2.0 / np.sqrt(5.0), "b": -1.0 / np.sqrt(5.0), "c": 0.0, "line": 1.0}
    assert list(correlated.matrix.index) == [*"abc", "line", "c alone"]
    assert correlated.matrix["line"][list(expected)].to_list() == pytest.approx(
        list(expected.values()), abs=0.01
    )
    plain = deboom.correlation(rows, resamples=100)
    np.testing.assert_array_equal(plain.matrix, plain.pearson)
    assert correlated.matrix.loc["line", "c alone"] == plain.pearson[0, 1]


def test_bissells_bound_counts_every_piece():
    cpk = 2.0 / 3.0  # of 1, 2, 3 between 0 and 4
    bound = cpk - 1.6448536269514722 * np.sqrt(1 / 27 + cpk**2 / 4)
    assert capability([1.0, 2.0, 3.0], 0.0, 4.0).cpk_bound == pytest.approx(bound, rel=1e-12)
