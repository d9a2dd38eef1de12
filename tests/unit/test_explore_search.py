"""Searches: NSGA-II through pymoo, resume, limits, and whole-number variables."""

import doctest
import itertools
import json
import random
import warnings
from dataclasses import fields, replace

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

import deboom
from deboom.errors import InputError
from deboom.explore import search as search_module
from deboom.explore.front import hypervolume, nondominated, pareto_front
from deboom.explore.moments import Limit, Objective
from deboom.explore.robust import Robust, RobustEvaluation
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import FAILED_OBJECTIVE, RobustProblem, Search, merge, nsga2
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space
from samples.known_truth import quad2

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
SAMPLE = sobol_sample(4, 16, seed=1)
ROBUST = Robust(MODEL, SPACE, SAMPLE)
FIRST = np.linspace(0.8, 1.2, 32).reshape(8, 4)


def with_function(function):
    model = ResponseFunction(function, MODEL.variable_names, MODEL.response_names, "1")
    return Robust(model, SPACE, SAMPLE)


def fails_where_it_is_best(designs):
    """NaN over the half of the space that holds the unconstrained optimum of x1."""
    best = designs[:, :1] < 1.0 if MODEL.targets[:, 0].mean() < 1.0 else designs[:, :1] > 1.0
    return np.where(best, np.nan, MODEL(designs))


FAILING = with_function(fails_where_it_is_best)


def total(designs):
    """Return the sum of all factors, and the first one."""
    return np.column_stack([designs.sum(axis=1), designs[:, 0]])


def limited(sum_at_most=4.1, first=(0.95, 1.05), function=total):
    names = ("sum", "first")
    numbers = [
        Objective(
            "nominal",
            response=ResponseFunction(lambda x, k=k: function(x)[:, k], SPACE.names, (name,), "kg"),
        )
        for k, name in enumerate(names)
    ]
    limits = [Limit(numbers[0], at_most=sum_at_most), Limit(numbers[1], *first)]
    return replace(ROBUST, limits=limits)


class _Recording(RobustEvaluation):
    """A robust response that remembers what it was asked, and stops when told to."""

    def __init__(self, robust, stop_at=None):
        self.robust, self.evaluated, self.stop_at = robust, [], stop_at

    @property
    def space(self):
        return self.robust.space

    @property
    def limits(self):
        return self.robust.limits

    def __call__(self, designs):
        if len(self.evaluated) == self.stop_at:
            raise Killed
        self.evaluated.append(designs.copy())
        return self.robust(designs)


class Killed(Exception):
    """Stands for the end of the process."""


class _Memory:
    """A store in this process that checks what it is given."""

    def __init__(self):
        self.facts, self.evaluations = None, {}

    def save(self, facts):
        self.facts = json.loads(json.dumps(facts, allow_nan=False))

    def load(self):
        return self.facts

    def keep(self, number, arrays):
        assert all(array.dtype != object for array in arrays.values())
        self.evaluations[number] = arrays

    def kept(self, number):
        return self.evaluations.get(number)


def same(first, other):
    for values, others in ((first.front, other.front), (first.evaluated, other.evaluated)):
        for field in fields(values):
            np.testing.assert_array_equal(getattr(values, field.name), getattr(others, field.name))
    for field in fields(first):
        if field.name not in ("front", "evaluated", "seconds"):
            np.testing.assert_array_equal(getattr(first, field.name), getattr(other, field.name))


def test_the_example_in_the_docstring_holds():
    results = doctest.testmod(search_module)
    assert (results.attempted > 0, results.failed) == (True, 0)


def test_objectives_of_the_problem_are_those_of_the_response():
    designs = 0.8 + 0.4 * np.random.default_rng(1).random((5, 4))
    problem = RobustProblem(ROBUST)
    out = problem.evaluate(designs, return_as_dictionary=True)
    np.testing.assert_array_equal(out["F"], ROBUST(designs).objectives)
    np.testing.assert_array_equal(out["G"], -np.ones((5, 1)))
    np.testing.assert_array_equal(
        out["standard_error_sigma_sum"], ROBUST(designs).standard_error_sigma_sum
    )
    np.testing.assert_array_equal(problem.xl, SPACE.lower)
    np.testing.assert_array_equal(problem.xu, SPACE.upper)


def test_failed_designs_reach_pymoo_finite_and_infeasible():
    designs = np.array([[0.85, 1, 1, 1], [1.15, 1, 1, 1]])
    failed = FAILING(designs).failed
    assert failed.sum() == 1
    out = RobustProblem(FAILING).evaluate(designs, return_as_dictionary=True)
    np.testing.assert_array_equal(out["F"][failed], FAILED_OBJECTIVE)
    np.testing.assert_array_equal(out["G"][:, 0] > 0.0, failed)
    assert np.all(np.isfinite(out["F"]))


def test_a_failed_design_never_wins():
    assert nsga2(ROBUST, Search(20, 10, seed=1)).n_failed == 0
    result = nsga2(FAILING, Search(20, 10, seed=1))
    assert result.n_failed > 0
    assert FAILING(result.evaluated.designs[result.evaluated.failed]).failed.all()
    assert not FAILING(result.front.designs).failed.any()
    plain = minimize(RobustProblem(FAILING), NSGA2(20), ("n_gen", 10), seed=1)
    assert np.all(plain.F < FAILED_OBJECTIVE)


def test_one_seed_gives_one_result_whatever_the_global_generators_do():
    first = nsga2(FAILING, Search(20, 8, seed=5))
    np.random.seed(123)  # noqa: NPY002 - the global generator is what must not matter
    random.seed(123)
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    second = nsga2(FAILING, Search(20, 8, seed=5))
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002
    same(first, second)
    other_seed = nsga2(FAILING, Search(20, 8, seed=6))
    assert not np.array_equal(first.front.designs, other_seed.front.designs)


def test_the_search_is_pymoos_own_nsga2_and_its_archive_holds_more():
    plain = minimize(RobustProblem(ROBUST), NSGA2(20), ("n_gen", 12), seed=3)
    ours = nsga2(ROBUST, Search(20, 12, seed=3))
    assert ours.n_evaluated == plain.algorithm.evaluator.n_eval == 240
    assert ours.hypervolume.shape == (12,)
    assert ours.hypervolume[-1] >= hypervolume(plain.F, ours.reference_point)
    everything = np.vstack([ours.front.objectives, plain.F])
    assert nondominated(everything)[: len(ours.front)].all()
    on_both = {tuple(row) for row in plain.X} & {tuple(row) for row in ours.front.designs}
    assert len(on_both) > 0


def test_the_archive_never_gets_worse_and_holds_every_design_that_was_best():
    recording = _Recording(ROBUST)
    result = nsga2(recording, Search(20, 10, seed=1))
    assert np.all(np.diff(result.hypervolume) >= 0.0)
    assert result.hypervolume[-1] > 1.05 * result.hypervolume[0]
    everything = ROBUST(np.vstack(recording.evaluated))
    best = everything.objectives[nondominated(everything.objectives)]
    np.testing.assert_array_equal(result.front.objectives, best[np.argsort(best[:, 0])])
    assert np.all(everything.designs >= SPACE.lower)
    assert np.all(everything.designs <= SPACE.upper)
    first = ROBUST(recording.evaluated[0]).objectives
    np.testing.assert_array_equal(result.reference_point, first.max(axis=0))


def test_progress_is_told_after_every_generation_and_nothing_else_happens(capfd):
    told, before = [], list(warnings.filters)
    nsga2(FAILING, Search(10, 4, seed=1), progress=lambda *report: told.append(report))
    assert [(number, total) for number, total, _ in told] == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert told[-1][2].startswith("generation 4 of 4, ")
    assert "failed" in told[-1][2]
    assert capfd.readouterr() == ("", "")
    assert warnings.filters == before


def test_progress_tells_the_change_of_the_best_mean_from_today():
    told = []
    result = nsga2(ROBUST, Search(10, 3, seed=1), progress=lambda *report: told.append(report[2]))
    today = ROBUST(ROBUST.space.nominal[np.newaxis]).mean_sum[0]
    change = (result.front.mean_sum.min() - today) / result.front.mean.shape[1]
    number = f"{change / getattr(ROBUST.evaluate, 'n_lines', 1):+.2g}".replace("-", "−")
    assert told[-1].startswith(f"generation 3 of 3, best mean {number}")


def test_the_record_of_a_search_says_what_ended_it():
    store = _Memory()
    until = search_module.Until(gain=0.02, over=3)
    result = nsga2(ROBUST, Search(10, 60, seed=1, until=until), checkpoint=store)
    assert result.stopped.endswith("generations, ended by a gain below 0.02 over 3 generations")
    assert store.load()["stopped"] == result.stopped
    # what is kept of it serves a search that goes further
    further = nsga2(ROBUST, Search(10, len(result.hypervolume) + 2, seed=1), checkpoint=store)
    assert store.load()["stopped"] == further.stopped
    np.testing.assert_array_equal(further.hypervolume[:-2], result.hypervolume)


def test_a_fixed_variable_stays_where_it_is():
    lower, upper = SPACE.lower.copy(), SPACE.upper.copy()
    lower[0] = upper[0] = 1.0
    result = nsga2(
        replace(ROBUST, space=replace(SPACE, lower=lower, upper=upper)), Search(10, 5, seed=1)
    )
    np.testing.assert_array_equal(result.front.designs[:, 0], 1.0)
    assert result.n_evaluated == 50
    point = replace(SPACE, lower=SPACE.nominal, upper=SPACE.nominal)
    result = nsga2(
        replace(ROBUST, space=point), Search(10, 5, seed=1)
    )  # ends early with that design
    np.testing.assert_array_equal(result.front.designs, SPACE.nominal[None, :])


def test_the_first_generation_is_the_one_given_and_stays_as_it_was():
    recording, given = _Recording(ROBUST), FIRST.copy()
    nsga2(recording, Search(8, 3, seed=1), first_population=given)
    assert np.array_equal(recording.evaluated[0], FIRST)
    assert np.array_equal(given, FIRST)
    assert not np.array_equal(recording.evaluated[1], FIRST)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"seed": 0}, "seed 0"),
        ({"population": 3}, "population of 3"),
        ({"generations": 0}, "0 generations"),
        ({"population": 10, "first_population": FIRST}, "8 designs does not fit a search with a p"),
        ({"population": 8, "first_population": FIRST - 0.5}, r"design 1 has 0\.3 .* outside its b"),
        (
            {"robust": with_function(lambda designs: np.full((len(designs), 2), np.nan))},
            "none of the 100 designs of the first generation",
        ),
    ],
)
def test_searches_that_cannot_be_are_refused(arguments, words):
    others = {name: arguments[name] for name in ("robust", "first_population") if name in arguments}
    settings = {name: value for name, value in arguments.items() if name not in others}
    with pytest.raises(InputError, match=words):
        nsga2(**{"robust": ROBUST, **others}, settings=Search(**settings))


@pytest.mark.parametrize("robust", [ROBUST, FAILING, limited()])
def test_killed_after_any_generation_the_result_is_the_same(robust):
    whole = nsga2(robust, Search(20, 12, seed=3))
    for until in (0, 1, 6, 11):
        store = _Memory()
        with pytest.raises(Killed):
            nsga2(_Recording(robust, until), Search(20, 12, seed=3), checkpoint=store)
        assert len(store.evaluations) == until
        again = _Recording(robust)
        same(nsga2(again, Search(20, 12, seed=3), checkpoint=store), whole)
        # one design says that it is the same response
        assert len(again.evaluated) == 12 - until + (until > 0)


def test_every_design_is_kept_with_its_responses_and_more_generations_follow():
    store = _Memory()
    search = nsga2(FAILING, Search(20, 7, seed=3), checkpoint=store)
    designs = np.concatenate([store.evaluations[n]["designs"] for n in range(1, 8)])
    assert len(designs) == search.n_evaluated
    sigma = np.concatenate([store.evaluations[n]["sigma"] for n in range(1, 8)])
    np.testing.assert_array_equal(sigma, FAILING(designs).sigma)
    whole = nsga2(FAILING, Search(20, 12, seed=3))
    resumed = nsga2(FAILING, Search(20, 12, seed=3), checkpoint=store)
    same(resumed, whole)
    assert resumed.seconds > search.seconds
    store.evaluations[1] = {"designs": np.ones((20, 4))}  # not those that are asked for
    same(nsga2(FAILING, Search(20, 12, seed=3), checkpoint=store), whole)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"population": 24}, "population 8, not 24"),
        ({"seed": 4}, "seed 3, not 4"),
        ({"names": ("a", "b", "c", "d")}, "variables"),
        ({"first_population": FIRST[::-1]}, "belongs to first_population_sha256"),
        ({"first_population": None}, "belongs to first_population_sha256"),
    ],
)
def test_what_was_kept_of_another_search_is_refused_by_name(changes, words):
    store = _Memory()
    settings, options = Search(8, 4, seed=3), {"first_population": FIRST, "checkpoint": store}
    nsga2(ROBUST, Search(8, 2, seed=3), **options)
    names = changes.pop("names", SPACE.names)
    model = ResponseFunction(MODEL, names, MODEL.response_names, "1")
    robust = Robust(model, stiffness_factor_space(names), SAMPLE)
    first = {"first_population": changes.pop("first_population", np.tile(FIRST, (3, 1)))}
    with pytest.raises(InputError, match=words):
        nsga2(robust, replace(settings, **changes), **{**options, **first})
    whole = nsga2(ROBUST, Search(8, 4, seed=3), first_population=FIRST)
    same(nsga2(ROBUST, settings, **options), whole)


def test_the_front_keeps_all_limits_and_the_others_are_kept_with_their_excess():
    response = limited()
    search = nsga2(response, Search(24, 12, seed=1))
    assert np.all(search.front.excess <= 0.0)
    assert np.all(total(search.front.designs)[:, 0] <= 4.1)
    assert 0 < search.infeasible.sum() < search.n_evaluated == 24 * 12
    beyond = response(search.evaluated.designs).excess
    np.testing.assert_array_equal(search.evaluated.excess, beyond)
    np.testing.assert_array_equal(beyond.max(axis=1) > 0.0, search.infeasible)


@pytest.mark.parametrize(
    ("response", "words"),
    [
        (
            limited(3.0, (0.0, 9.0)),
            r"none of the 40 designs of this search keeps all limits: the closest one misses 'sum "
            r"at most 3 kg' by 0\.\d+ kg .*; relax that limit",
        ),
        (limited(1.0, (1.5, 9.0)), r"none keeps 'first at least 1\.5 kg' either"),
    ],
)
def test_limits_out_of_reach_say_which_and_by_how_much(response, words):
    with pytest.raises(InputError, match=words):
        nsga2(response, Search(20, 2, seed=1))


def test_a_limit_that_some_design_keeps_is_not_named():
    words = limited().limits.closest(np.array([[1.0, 0.1, -1.0], [2.0, -0.1, -1.0]]))
    assert words == "the closest one misses 'sum at most 4.1 kg' by 1 kg (it has 5.1 kg)"


def test_a_number_that_cannot_be_computed_keeps_no_limit():
    def half(designs):
        return np.where(designs[:, :1] > 1.0, np.nan, total(designs))

    search = nsga2(limited(9.0, (0.0, 9.0), half), Search(20, 8, seed=1))
    assert np.all(search.front.designs[:, 0] <= 1.0)
    assert np.isinf(search.evaluated.excess[search.infeasible]).any(axis=1).all()
    out = RobustProblem(limited(function=half)).evaluate(
        np.full((1, 4), 1.1), return_as_dictionary=True
    )
    assert np.isfinite(out["G"]).all()


@pytest.mark.parametrize("algorithm", ["nsga2", "nsga3", "moead", NSGA2(20)])
def test_within_limits_todays_design_is_the_first_of_all_and_elsewhere_nothing_changes(algorithm):
    """No vehicle may be louder than today, by a thousandth: only today's design is near that."""
    tight = [
        Objective(statistic, response=name).at_most("today")
        for name in MODEL.response_names
        for statistic in ("mean", "sigma")
    ]
    settings = Search(20, 2, seed=1, algorithm=algorithm)
    limited, free = (
        nsga2(response, settings).evaluated.designs
        for response in (replace(ROBUST, limits=tight), ROBUST)
    )
    np.testing.assert_array_equal(limited[0], SPACE.nominal)
    np.testing.assert_array_equal(limited[1:20], free[1:20])
    assert not np.array_equal(free[0], SPACE.nominal)


def test_limits_that_todays_design_alone_keeps_give_a_front():
    first = ResponseFunction(lambda x: np.abs(x - 1.0).max(axis=1), SPACE.names, ("far",), "1")
    robust = replace(ROBUST, limits=[Objective("nominal", response=first).at_most("today")])
    front = nsga2(robust, Search(20, 2, seed=1)).front
    np.testing.assert_array_equal(front.designs, SPACE.nominal[np.newaxis])
    begun = deboom.search(robust, Search(8, 1, seed=1, polish=False), first_population=FIRST[:3])
    np.testing.assert_array_equal(begun.search.evaluated.designs[:3], FIRST[:3])
    assert begun.search.front.designs.tolist() == [SPACE.nominal.tolist()]


@pytest.mark.parametrize("statistic", ["mean", "nominal"])
def test_a_limited_number_that_no_design_has_is_named_and_not_the_model(statistic):
    own = ResponseFunction(lambda x: np.full(len(x), np.nan), SPACE.names, ("price",), "EUR")
    limit = replace(Objective(statistic, response=own).at_most(5.0), source="offer.csv")
    robust = replace(ROBUST, limits=[limit])
    assert not robust(SPACE.nominal[np.newaxis]).failed.any()
    words = r"'.*price at most 5 EUR' \(offer\.csv\) could not be computed for any"
    with pytest.raises(InputError, match=words):
        nsga2(robust, Search(8, 1, seed=1))


def test_searches_of_several_seeds_merge_into_one_front():
    searches = [nsga2(limited(), Search(20, 10, seed=seed)) for seed in (1, 2, 3)]
    merged = merge(searches)
    expected = pareto_front(*(search.front for search in searches))
    np.testing.assert_array_equal(merged.front.designs, expected.designs)
    assert merged.n_evaluated == 600
    assert merged.seed == 1
    assert merged.infeasible.sum() == sum(search.infeasible.sum() for search in searches)
    np.testing.assert_array_equal(merge(searches[::-1]).front.objectives, merged.front.objectives)
    reference = np.max([search.reference_point for search in searches], axis=0)
    np.testing.assert_array_equal(merged.reference_point, reference)
    assert merged.hypervolume[-1] >= max(search.hypervolume[-1] for search in searches)
    with pytest.raises(InputError, match="no searches to merge"):
        merge([])


OPTIONS = (5, 4, 6)
TABLES = [np.random.default_rng(7 + k).random((count, 2)) for k, count in enumerate(OPTIONS)]
SETS = np.array(list(itertools.product(*map(range, OPTIONS))), dtype=float)


def levels(designs):
    """Two responses: a random number per option, and a valley in x and y."""
    chosen = [table[designs[:, k].astype(int)] for k, table in enumerate(TABLES)]
    valley = (designs[:, 3:] - [[0.9, 1.1]]) ** 2
    return 3.0 + sum(chosen) + 10.0 * valley


MIXED_SPACE = DesignSpace(
    names=("a part", "b part", "c part", "x", "y"),
    units=("1",) * 5,
    nominal=np.array([0, 0, 0, 1.0, 1.0]),
    lower=np.array([0, 0, 0, 0.8, 0.8]),
    upper=np.array([4, 3, 5, 1.2, 1.2]),
    tolerance=np.array([0, 0, 0, 0.15, 0.15]),
    integer=np.array([True, True, True, False, False]),
)
MIXED = Robust(
    ResponseFunction(levels, MIXED_SPACE.names, ("one", "two"), "1"),
    MIXED_SPACE,
    sobol_sample(5, 16, seed=1),
)


def test_every_design_has_whole_numbers_within_their_bounds_evenly_drawn_at_first():
    recording = _Recording(MIXED)
    nsga2(recording, Search(600, 2, seed=1))
    nsga2(recording, Search(20, 15, seed=1))
    designs = np.concatenate(recording.evaluated)
    whole = designs[:, :3]
    np.testing.assert_array_equal(whole, np.floor(whole))
    assert np.all((whole >= MIXED_SPACE.lower[:3]) & (whole <= MIXED_SPACE.upper[:3]))
    assert all(set(whole[:, k]) == set(range(count)) for k, count in enumerate(OPTIONS))
    assert len(np.unique(designs[:, 3])) > 100
    for k, count in enumerate(OPTIONS):
        share = np.bincount(recording.evaluated[0][:, k].astype(int), minlength=count) / 600
        np.testing.assert_allclose(share, 1 / count, atol=4 * np.sqrt(1 / count / 600))


def test_the_front_of_options_alone_is_that_of_all_sets():
    fixed = replace(MIXED_SPACE, lower=np.array([0, 0, 0, 1, 1]), upper=np.array([4, 3, 5, 1, 1]))
    robust = replace(MIXED, space=fixed)
    truth = pareto_front(robust(np.hstack([SETS, np.ones((len(SETS), 2))])))
    front = nsga2(robust, Search(20, 40, seed=1)).front
    np.testing.assert_array_equal(front.designs, truth.designs)


def test_every_pair_of_parents_exchanges_its_own_options():
    parents = np.ones((2, 400, 5))
    parents[0, :, :3] = 0.0
    crossover = search_module._algorithm(MIXED, Search(20), None)[0].mating.crossover
    random = np.random.default_rng(1)
    children = crossover._do(RobustProblem(MIXED), parents, random_state=random)[:, :, :3]
    assert np.all(children.sum(axis=0) == 1.0)
    np.testing.assert_allclose(children[0].mean(axis=0), 0.5, atol=0.1)


def test_a_front_that_fails_when_verified_keeps_its_evaluations(monkeypatch):
    def fail(rows, judge):
        raise InputError("none of the designs could be computed with the verification sample")

    monkeypatch.setattr(search_module, "verified", fail)
    with pytest.raises(InputError, match="16 evaluated designs are kept") as error:
        search_module.search(ROBUST, population=8, generations=2, shown=None, polish=False)
    assert len(error.value.search.evaluated) == 16
