"""Objectives from options, several searches into one front, the last steps by gradient."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import deboom
from deboom.errors import InputError
from deboom.explore.front import pareto_front, replicates, verified
from deboom.explore.moments import STATISTICS, Objective, Statistic
from deboom.explore.result import Front
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import Search, Until, nsga2, searched
from deboom.explore.space import ResponseFunction, stiffness_factor_space
from deboom.pages.limits import _misses_in_words, report_limits
from deboom.report import Report
from deboom.runs.options import AimOptions, robust_response
from deboom.runs.search import SearchOptions, ThoroughSearchOptions
from samples.known_truth import WithSlopes, quad2

MODEL = quad2(5, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = Robust(MODEL, SPACE, sobol_sample(5, 32, seed=1))


def search_result(searches=1):
    return searched(ROBUST, Search(population=12, generations=5, searches=searches, seed=3))


def test_keywords_of_a_search_replace_those_of_its_settings():
    by_keywords = deboom.search(ROBUST, population=12, generations=3, seed=3, polish=False)
    settings = Search(population=12, generations=50, seed=3, polish=False)
    by_value = deboom.search(ROBUST, settings, generations=3)
    np.testing.assert_array_equal(by_value.values.objectives, by_keywords.values.objectives)
    assert by_value.search.n_evaluated == 36
    # what a search has no value for is that of the settings
    assert deboom.search(ROBUST, settings, until=Until(evaluations=24)).search.n_evaluated == 24


def verified_front(robust, search, draws):
    judge = replicates(robust, draws, seed=1)
    rows = search.front
    return Front(
        robust=robust, search=search, searched=rows, values=verified(rows, judge), judge=judge
    )


def test_one_search_is_that_of_nsga2():
    whole, alone = search_result(), nsga2(ROBUST, Search(12, 5, seed=3))
    np.testing.assert_array_equal(whole.front.designs, alone.front.designs)
    np.testing.assert_array_equal(whole.hypervolume, alone.hypervolume)


def test_several_searches_give_the_front_of_all():
    whole = search_result(searches=3)
    each = [nsga2(ROBUST, Search(12, 5, seed=seed)) for seed in (3, 4, 5)]
    expected = pareto_front(*(search.front for search in each))
    np.testing.assert_array_equal(whole.front.designs, expected.designs)
    np.testing.assert_array_equal(whole.hypervolume, each[0].hypervolume)
    assert whole.n_evaluated == 180


def test_a_verified_front_holds_its_picks_which_go_on_by_gradient():
    fronts = [
        ThoroughSearchOptions(population=12, generations=5, polish=polish, checks=64).verified(
            ROBUST, seed=3, run=None, inputs=()
        )
        for polish in (False, True)
    ]
    plain, polished = (front.values.mean_sum[front.picks["best-mean"]] for front in fronts)
    assert polished < plain
    assert "by gradient" in fronts[1].note
    assert "by gradient" not in fronts[0].note
    table = fronts[1].table
    assert set(" = ".join(table["pick"][table["pick"] != ""]).split(" = ")) == set(fronts[1].picks)


def test_levels_are_means_over_vehicles_and_lines():
    model = ResponseFunction(MODEL, MODEL.variable_names, MODEL.response_names, "dB(A)", 4)
    robust = replace(ROBUST, evaluate=model)
    front = verified_front(robust, nsga2(robust, Search(12, 2, seed=3)), 32)
    table = front.compared({"today": (front.baseline, 0), "first": (front.values, 0)})
    each = np.array([front.baseline.mean[0], front.values.mean[0]])
    assert each.shape[1] == len(MODEL.response_names) > 1
    levels = table["mean level [dB(A)]"].to_numpy()
    np.testing.assert_allclose(levels, each.mean(axis=1) / 4, rtol=1e-12)


def test_searches_begin_with_given_designs():
    best = nsga2(ROBUST, Search(24, 20, seed=1)).front.designs[:2]
    options = ThoroughSearchOptions(population=12, generations=1, polish=False, checks=64)
    front = options.verified(ROBUST, seed=3, run=None, inputs=(), begin=best)
    np.testing.assert_array_equal(front.search.evaluated.designs[:2], best)
    assert front.search.n_evaluated == 12


@pytest.mark.parametrize("end", ["until_gain", "until_seconds"])
def test_an_end_that_no_search_has_is_refused_before_any_work(end):
    with pytest.raises(InputError, match=r"positive seconds .* below a positive gain"):
        SearchOptions(**{end: 0.0})


def test_bad_budgets_are_refused():
    with pytest.raises(InputError, match="0 searches find nothing"):
        search_result(searches=0)


@dataclass(frozen=True)
class TwoVehicles:
    """One response is linear, the other quadratic in two factors."""

    variable_names: tuple[str, ...] = ("a x", "a y")
    response_names: tuple[str, ...] = ("one", "two")
    response_unit: str = "dB"

    def __call__(self, designs):
        """Return both responses, shape (n, 2)."""
        return np.column_stack([designs[:, 0], 3 * designs[:, 1] ** 2])


MODEL_2 = TwoVehicles()
SPACE_2 = stiffness_factor_space(MODEL_2.variable_names, 0.2, 0.15)
SAMPLE = sobol_sample(2, 128, seed=1)


def values(aim, **changes):
    return robust_response(MODEL_2, SPACE_2, SAMPLE, aims=AimOptions(objective=aim, **changes))(
        np.ones((1, 2))
    )


def test_each_aim_minimises_what_it_says():
    mean = values("mean")
    np.testing.assert_array_equal(mean.objectives, [[mean.mean_sum[0], mean.sigma_sum[0]]])
    worst = values("worst")
    np.testing.assert_array_equal(worst.objectives[0], [mean.mean.max(), mean.sigma.max()])
    quantile, tail = values("quantile").objectives[0], values("tail").objectives[0]
    assert mean.mean_sum[0] < quantile[0] < tail[0]
    assert quantile[1] == tail[1] == mean.sigma_sum[0]


def test_weights_and_further_objectives_are_read_from_their_texts():
    aims = AimOptions(weight=["two=3"], also=["sigma=one", "quantile"])
    weighted, plain = values("mean", weight=aims.weight, also=aims.also), values("mean")
    mean, sigma = plain.mean[0], plain.sigma[0]
    assert weighted.mean_sum[0] == pytest.approx((mean[0] + 3 * mean[1]) / 2, rel=1e-14)
    assert weighted.objectives[0, 2] == sigma[0]
    assert weighted.objectives[0, 3] > mean.max()
    names = [objective.name for objective in aims.objectives(MODEL_2)]
    assert names[2:] == ["sigma of SPLV, one", "95 % quantile of SPLV, worst vehicle"]
    ratios = robust_response(MODEL_2, SPACE_2, SAMPLE, aims=aims).weight_ratios
    np.testing.assert_array_equal(ratios, [1.0, 3.0])
    nothing = replace(MODEL_2, response_names=("one", "none"))
    aims = AimOptions(weight=["one=2", "none=0"])
    ratios = robust_response(nothing, SPACE_2, SAMPLE, aims=aims).weight_ratios
    np.testing.assert_array_equal(ratios, [1.0, 0.0])


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"weight": ["three=1"]}, "--weight three=1: write VEHICLE=WEIGHT with one of one, two"),
        ({"weight": ["one=much"]}, "--weight one=much: write VEHICLE=WEIGHT"),
        ({"weight": ["one"]}, "--weight one: write VEHICLE=WEIGHT"),
        ({"weight": ["one=1", "one=2"]}, "--weight one=2: one has a weight already"),
        ({"weight": ["one=-1"]}, "give each one of at least 0"),
        ({"also": ["median"]}, "--also median: write STATISTIC or STATISTIC=VEHICLE, with one of"),
        ({"also": ["mean="]}, "--also mean=: there is no vehicle ''"),
        ({"also": ["mean=three"]}, "--also mean=three: there is no vehicle 'three'"),
        ({"also": ["mean=one", "mean=one"]}, "two objectives are named"),
        ({"also": ["mean", "sigma", "tail", "quantile"]}, "take at most 5"),
    ],
)
def test_a_weight_or_an_objective_that_cannot_be_is_refused(wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        values("mean", **wrong)


def test_control_variate_knows_a_parabola_exactly():
    exact = 1 + 3 * (1 + 0.05**2 * 0.9733369246625415)  # variance of a normal cut at 3 sigma
    off = abs(values("mean").mean_sum[0] - exact)
    assert values("mean", control_variate=True).mean_sum[0] == pytest.approx(exact, abs=1e-12)
    assert off > 1e-7


def test_a_design_that_fails_in_few_draws_stays_in_the_table_and_is_no_pick():
    """Five failing draws among 1024 of the quietest design, and some of today's."""
    edge = np.inf

    def quieter_where_stiffer(designs):
        return np.where(designs[:, :1] > edge, np.nan, 100.0 - 20.0 * designs[:, :1])

    response = ResponseFunction(quieter_where_stiffer, MODEL_2.variable_names, ("A",), "dB")
    robust = Robust(response, SPACE_2, SAMPLE)
    search = nsga2(robust, Search(12, 5, seed=3))
    judge = replicates(robust, 1024, seed=1)
    edge = np.sort(judge.sets[0].made(search.front.designs[0])[:, 0])[-6]
    front = verified_front(robust, search, 1024)
    failed = front.values.failed
    assert failed[0]
    assert not failed.all()
    assert not front.nondominated[failed].any()
    assert not failed[list(front.picks.values())].any()
    table = front.table
    assert len(table) == len(search.front)
    assert table["failed draws [1]"][0] == pytest.approx(5 / 1024)
    others = table["mean sum of the other draws [dB]"]
    assert others[0] == pytest.approx(search.front.mean_sum[0], rel=1e-2)
    assert others.isna().tolist() == (~failed).tolist()
    assert "no picks and not on the verified front" in front.text
    front.picture()
    edge = 0.9
    assert "Today's design could not be computed in 97" in replace(front).text


def test_a_front_without_failing_draws_has_no_column_for_them():
    search = nsga2(ROBUST, Search(12, 5, seed=3))
    front = verified_front(ROBUST, search, 64)
    assert not any("draws" in column for column in front.table.columns)
    assert "could not be computed" not in front.text


class Kept:
    """A search's evaluations in memory."""

    def __init__(self):
        self.facts, self.generations = None, {}

    def save(self, facts):
        """Replace the facts."""
        self.facts = dict(facts)

    def load(self):
        """Return the facts."""
        return self.facts

    def keep(self, number, arrays):
        """Keep a generation."""
        self.generations[number] = dict(arrays)

    def kept(self, number):
        """Return a generation."""
        return self.generations.get(number)


def test_a_search_tells_its_progress_and_goes_on_from_what_is_kept_of_each_seed():
    told, stores = [], {3: Kept(), 4: Kept()}
    budget = {"population": 8, "generations": 3, "searches": 2, "seed": 3, "verified_with": 16}
    first = deboom.search(
        ROBUST, **budget, progress=lambda *step: told.append(step), checkpoint=stores.__getitem__
    )
    assert [done for done, total, _ in told if total == 3] == [1, 2, 3] * 2
    assert [len(store.generations) for store in stores.values()] == [3, 3]
    again = deboom.search(ROBUST, **budget, checkpoint=stores.__getitem__)
    np.testing.assert_array_equal(again.values.objectives, first.values.objectives)
    assert "2 searches" in first.note


def test_limits_are_kept_by_every_design_and_picks_stay_where_they_were_found():
    first = ResponseFunction(lambda x: x[:, 0], SPACE.names, ("first",), "1")
    limited = replace(ROBUST, limits=[Objective("nominal", response=first).at_least(1.05)])
    front = deboom.search(limited, population=12, generations=4, seed=1, verified_with=16)
    assert front.values.designs[:, 0].min() >= 1.05
    assert "by gradient" not in front.note
    assert front.search.infeasible.any()


def test_a_study_without_the_option_polish_leaves_its_front_as_it_was_searched():
    robust = replace(ROBUST, evaluate=WithSlopes(MODEL))
    options = SearchOptions(population=8, generations=3)
    front = options.front(robust, seed=3, run=None, inputs=(), verified_with=16)
    assert front.search.n_evaluated == 24
    np.testing.assert_array_equal(front.searched.designs, front.search.front.designs)


def test_every_pick_that_misses_a_limit_at_nominal_is_named():
    """No response depends on the second factor: picks have it at 1, where its limit is missed."""
    model = ResponseFunction(lambda x: (x[:, :1] - 0.9) ** 2, ("a", "b"), ("level",), "dB")
    second = ResponseFunction(lambda x: x[:, 1:], ("a", "b"), ("b",), "1")
    space = stiffness_factor_space(("a", "b"), 0.2, 0.15)
    limit = Objective("nominal", response=second).at_least(1.05)
    robust = Robust(model, space, draws=16, limits=[limit])
    front = deboom.search(robust, population=8, generations=3, verified_with=16)
    report = Report("Limits", "Are they kept?")
    report_limits(report, front)
    for name in front.picks:
        sentence = f"The design '{name}' misses a limit: the closest one misses 'b at least 1.05 1'"
        assert sum(sentence in warning for warning in report.warnings) == 1
    assert len(report.warnings) == len(front.picks)
    assert report.summary["n_beyond_limits"] == front.search.infeasible.sum() > 0


def test_a_page_has_lower_bounds_of_levels_and_says_what_new_statistics_are_of(monkeypatch):
    first = Statistic("first part", lambda draws, _: draws.values[0], is_estimate=False)
    monkeypatch.setitem(STATISTICS, "first", first)
    model = ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("level",), "dB")
    limits = [Objective("mean").at_least(0.004), Objective("first").at_most(1.0)]
    space = stiffness_factor_space(("a",), 0.2, 0.15)
    robust = Robust(model, space, draws=16, limits=limits)
    front = deboom.search(robust, population=8, generations=3, verified_with=16)
    report = Report("Limits", "Are they kept?")
    report_limits(report, front)
    (row,) = report.tables["level_limits"].to_dict("records")
    assert row["at least"] == 0.004
    assert np.isnan(row["at most"])
    words = str(report.sections[0].blocks)
    assert "by the levels over the scatter and by every drawn part: " in words


def test_no_more_than_the_shown_designs_are_verified_beside_the_picks():
    budget = {"population": 24, "generations": 10, "verified_with": 16, "polish": False}
    few, many = (deboom.search(ROBUST, **budget, shown=shown) for shown in (2, 100))
    assert len(few.values) <= 2 + len(few.picks)
    assert len(few.values) < len(many.values)
    np.testing.assert_array_equal(few.search.front.designs, many.search.front.designs)
    whole = deboom.search(ROBUST, **budget, shown=None)
    np.testing.assert_array_equal(whole.searched.designs, whole.search.front.designs)


def test_a_report_says_how_many_verified_designs_miss_a_level_and_by_how_much():
    assert _misses_in_words(np.array([-0.2, -0.1])).startswith("All designs of the front keep")
    sentence = _misses_in_words(np.array([0.012, -0.1, 0.004]))
    assert sentence.startswith("There 2 of 3 designs of the front miss a limit, by 0.012 dB at")
