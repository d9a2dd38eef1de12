"""Searches: NSGA-II, its archive, resume, first population and whole-number variables."""

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

from deboom.errors import InputError
from deboom.explore import problems
from deboom.explore.archive import Checkpoint, generator_state, restore_generator
from deboom.explore.front import hypervolume, nondominated, pareto_front, pareto_rank
from deboom.explore.known_truth import quad2
from deboom.explore.problems import FAILED_OBJECTIVE, RobustProblem, nsga2
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.scatter import sobol_sample
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space
from deboom.files.checkpoint import CheckpointFolder

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
SAMPLE = sobol_sample(4, 16, seed=1)
ROBUST = RobustResponse(MODEL, SPACE, SAMPLE)


def with_function(function):
    model = ResponseFunction(function, MODEL.variable_names, MODEL.response_names, "1")
    return RobustResponse(model, SPACE, SAMPLE)


def fails_where_it_is_best(designs):
    """NaN over the half of the space that holds the unconstrained optimum of x1."""
    best = designs[:, :1] < 1.0 if MODEL.targets[:, 0].mean() < 1.0 else designs[:, :1] > 1.0
    return np.where(best, np.nan, MODEL(designs))


FAILING = with_function(fails_where_it_is_best)


def test_five_lines_in_a_notebook():
    model = quad2(2, seed=1)
    space = stiffness_factor_space(model.variable_names)
    robust = RobustResponse(model, space, sobol_sample(space.n_variables, 16, seed=1))
    problem = RobustProblem(robust)
    result = minimize(problem, NSGA2(100), seed=1)

    np.testing.assert_array_equal(result.F, robust(result.X).objectives)
    np.testing.assert_array_equal(result.pop.get("mean"), robust(result.pop.get("X")).mean)
    np.testing.assert_array_equal(result.pop.get("sigma").sum(axis=1), result.pop.get("F")[:, 1])


def test_the_example_in_the_docstring_holds():
    results = doctest.testmod(problems)
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


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_failed_design_never_wins(seed):
    assert nsga2(ROBUST, 20, 10, seed=seed).n_failed == 0
    result = nsga2(FAILING, 20, 10, seed=seed)
    assert result.n_failed > 0
    assert FAILING(result.failed_designs).failed.all()
    assert not FAILING(result.front.designs).failed.any()
    plain = minimize(RobustProblem(FAILING), NSGA2(20), ("n_gen", 10), seed=seed)
    assert np.all(plain.F < FAILED_OBJECTIVE)


def test_a_first_generation_that_fails_altogether_is_said():
    hopeless = with_function(lambda designs: np.full((len(designs), 2), np.nan))
    with pytest.raises(InputError, match="none of the 20 designs of the first generation"):
        nsga2(hopeless, 20, 10, seed=1)


def arrays_of(result):
    yield from (getattr(result.front, field.name) for field in fields(result.front))
    yield from (result.failed_designs, result.hypervolume, result.reference_point)


def test_one_seed_gives_one_result_whatever_the_global_generators_do():
    first = nsga2(FAILING, 20, 8, seed=5)
    np.random.seed(123)  # noqa: NPY002 - the global generator is what must not matter
    random.seed(123)
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    second = nsga2(FAILING, 20, 8, seed=5)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002
    for one, other in zip(arrays_of(first), arrays_of(second), strict=True):
        np.testing.assert_array_equal(one, other)
    other_seed = nsga2(FAILING, 20, 8, seed=6)
    assert not np.array_equal(first.front.designs, other_seed.front.designs)


def test_the_search_is_pymoos_own_nsga2_and_its_archive_holds_more():
    plain = minimize(RobustProblem(ROBUST), NSGA2(20), ("n_gen", 12), seed=3)
    ours = nsga2(ROBUST, 20, 12, seed=3)
    assert ours.n_evaluated == plain.algorithm.evaluator.n_eval
    worse = hypervolume(plain.F, ours.reference_point)
    assert ours.hypervolume[-1] >= worse
    everything = np.vstack([ours.front.objectives, plain.F])
    assert nondominated(everything)[: len(ours.front)].all()
    on_both = {tuple(row) for row in plain.X} & {tuple(row) for row in ours.front.designs}
    assert len(on_both) > 0


def test_exactly_the_generations_asked_for_are_run():
    result = nsga2(ROBUST, 10, 7, seed=1)
    assert result.n_evaluated == 70
    assert result.hypervolume.shape == (7,)


def test_the_archive_never_gets_worse_and_holds_every_design_that_was_best():
    seen = []

    class Recording:
        space = SPACE

        def __call__(self, designs):
            seen.append(designs.copy())
            return ROBUST(designs)

    result = nsga2(Recording(), 20, 10, seed=1)
    assert np.all(np.diff(result.hypervolume) >= 0.0)
    assert result.hypervolume[-1] > 1.05 * result.hypervolume[0]
    everything = ROBUST(np.vstack(seen))
    best = everything.objectives[nondominated(everything.objectives)]
    np.testing.assert_array_equal(result.front.objectives, best[np.argsort(best[:, 0])])
    first = ROBUST(seen[0]).objectives
    np.testing.assert_array_equal(result.reference_point, first.max(axis=0))


def test_progress_is_told_after_every_generation_and_nothing_is_printed(capfd):
    told = []
    nsga2(FAILING, 10, 4, seed=1, progress=lambda *report: told.append(report))
    assert [(number, total) for number, total, _ in told] == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert "hypervolume" in told[-1][2]
    assert "failed" in told[-1][2]
    assert capfd.readouterr() == ("", "")


def test_python_warnings_stay_as_they_were():
    before = list(warnings.filters)
    nsga2(FAILING, 10, 3, seed=1)
    assert warnings.filters == before


def test_the_model_is_never_copied():
    class Precious:
        variable_names = MODEL.variable_names
        response_names = MODEL.response_names
        response_unit = "1"

        def __call__(self, designs):
            return MODEL(designs)

        def __deepcopy__(self, memo):
            raise AssertionError("the model was copied")

    nsga2(RobustResponse(Precious(), SPACE, SAMPLE), 10, 3, seed=1)


def test_an_error_in_the_model_ends_the_search():
    def mistaken(designs):
        raise KeyError("gearbox")

    with pytest.raises(KeyError, match="gearbox"):
        nsga2(with_function(mistaken), 10, 3, seed=1)


def test_a_fixed_variable_stays_where_it_is():
    held = replace(
        SPACE, lower=np.array([1.0, 0.8, 0.8, 0.8]), upper=np.array([1.0, 1.2, 1.2, 1.2])
    )
    result = nsga2(replace(ROBUST, space=held), 10, 5, seed=1)
    np.testing.assert_array_equal(result.front.designs[:, 0], 1.0)
    assert result.n_evaluated == 50


def test_a_space_of_one_design_ends_early_with_that_design():
    point = replace(SPACE, lower=SPACE.nominal, upper=SPACE.nominal)
    result = nsga2(replace(ROBUST, space=point), 10, 5, seed=1)
    np.testing.assert_array_equal(result.front.designs, SPACE.nominal[None, :])


def test_designs_stay_within_the_bounds():
    result = nsga2(ROBUST, 20, 10, seed=1)
    assert np.all(result.front.designs >= SPACE.lower)
    assert np.all(result.front.designs <= SPACE.upper)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"seed": 0}, "seed 0"),
        ({"population": 3, "seed": 1}, "population of 3"),
        ({"generations": 0, "seed": 1}, "0 generations"),
    ],
)
def test_bad_budgets_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        nsga2(ROBUST, **arguments)


def test_anything_of_the_right_shape_can_be_searched():
    class ScaledObjectives:
        space = SPACE

        def __call__(self, designs):
            values = ROBUST(designs)
            columns = {f.name: getattr(values, f.name) for f in fields(RobustValues)}
            return RobustValues(**columns | {"mean_sum": 2.0 * values.mean_sum})

    result = nsga2(ScaledObjectives(), 10, 3, seed=1)
    np.testing.assert_allclose(result.front.mean_sum, 2.0 * result.front.mean.sum(axis=1))


ROBUST_2 = RobustResponse(MODEL, SPACE, sobol_sample(4, 16, seed=1))
FIRST = np.linspace(0.8, 1.2, 32).reshape(8, 4)


class _Seen:
    """A robust response that remembers what it was asked."""

    space = SPACE

    def __init__(self):
        self.designs = []

    def __call__(self, designs):
        self.designs.append(designs.copy())
        return ROBUST_2(designs)


class _Memory:
    """A store that keeps the last state."""

    state = None

    def save(self, arrays, facts):
        self.state = dict(arrays), dict(facts)

    def load(self):
        return self.state

    def keep(self, number, arrays):
        pass

    def kept(self, _number):
        return None


def test_the_first_generation_is_the_one_given_and_stays_as_it_was():
    seen, given = _Seen(), FIRST.copy()
    nsga2(seen, 8, 3, seed=1, first_population=given)
    assert np.array_equal(seen.designs[0], FIRST)
    assert np.array_equal(given, FIRST)
    assert not np.array_equal(seen.designs[1], FIRST)


def test_a_first_population_of_another_size_or_place_is_refused():
    with pytest.raises(InputError, match="8 designs does not fit a search with a population of 10"):
        nsga2(ROBUST_2, 10, 1, seed=1, first_population=FIRST)
    with pytest.raises(InputError, match=r"design 1 has 0\.3 .* outside its bounds"):
        nsga2(ROBUST_2, 8, 1, seed=1, first_population=FIRST - 0.5)


def test_a_search_goes_on_only_from_its_own_first_population():
    store = _Memory()
    asked = {"seed": 1, "checkpoint": Checkpoint(store, 1)}
    nsga2(ROBUST_2, 8, 2, **asked, first_population=FIRST)
    whole = nsga2(ROBUST_2, 8, 4, seed=1, first_population=FIRST)
    for other in (None, FIRST[::-1]):
        with pytest.raises(InputError, match="belongs to first_population_sha256"):
            nsga2(ROBUST_2, 8, 4, **asked, first_population=other)
    gone_on = nsga2(ROBUST_2, 8, 4, **asked, first_population=FIRST)
    assert np.array_equal(gone_on.front.designs, whole.front.designs)
    store.state = None
    nsga2(ROBUST_2, 8, 1, **asked)
    assert "first_population_sha256" not in store.state[1]


def test_ranks_peel_front_by_front():
    points = np.random.default_rng(1).random((40, 2))
    rank, left, number = pareto_rank(points), np.arange(40), 0
    while left.size:
        front = nondominated(points[left])
        assert (rank[left[front]] == number).all()
        left, number = left[~front], number + 1
    assert rank.max() == number - 1
    assert pareto_rank(np.empty((0, 2))).size == 0


OPTIONS = (5, 4, 6)
NAMES = ("a part", "b part", "c part", "x", "y")
TABLES = [np.random.default_rng(7 + k).random((count, 2)) for k, count in enumerate(OPTIONS)]


def levels(designs):
    """Two responses: a random number per option, and a valley in x and y."""
    chosen = [table[designs[:, k].astype(int)] for k, table in enumerate(TABLES)]
    valley = (designs[:, 3:] - [[0.9, 1.1]]) ** 2
    return 3.0 + sum(chosen) + 10.0 * valley


MODEL_3 = ResponseFunction(levels, NAMES, ("one", "two"), "1")
SPACE_3 = DesignSpace(
    names=NAMES,
    units=("1",) * 5,
    nominal=np.array([0, 0, 0, 1.0, 1.0]),
    lower=np.array([0, 0, 0, 0.8, 0.8]),
    upper=np.array([4, 3, 5, 1.2, 1.2]),
    tolerance=np.array([0, 0, 0, 0.15, 0.15]),
    integer=np.array([True, True, True, False, False]),
)
ROBUST_3 = RobustResponse(MODEL_3, SPACE_3, sobol_sample(5, 16, seed=1))


class _Recording:
    """Remembers every design that is asked for."""

    def __init__(self, robust):
        self.robust, self.space, self.asked = robust, robust.space, []

    def __call__(self, designs):
        self.asked.append(designs.copy())
        return self.robust(designs)


def test_every_design_of_a_search_has_whole_numbers_within_their_bounds():
    recording = _Recording(ROBUST_3)
    nsga2(recording, 20, 15, seed=1)
    asked = np.concatenate(recording.asked)
    whole = asked[:, :3]
    np.testing.assert_array_equal(whole, np.floor(whole))
    assert np.all((whole >= SPACE_3.lower[:3]) & (whole <= SPACE_3.upper[:3]))
    assert all(set(whole[:, k]) == set(range(count)) for k, count in enumerate(OPTIONS))
    assert len(np.unique(asked[:, 3])) > 100


def test_first_draws_are_even_over_the_options():
    recording = _Recording(ROBUST_3)
    nsga2(recording, 600, 1, seed=1)
    for k, count in enumerate(OPTIONS):
        share = np.bincount(recording.asked[0][:, k].astype(int), minlength=count) / 600
        np.testing.assert_allclose(share, 1 / count, atol=4 * np.sqrt(1 / count / 600))


def test_the_front_of_options_alone_is_that_of_all_sets():
    fixed = replace(SPACE_3, lower=np.array([0, 0, 0, 1, 1]), upper=np.array([4, 3, 5, 1, 1]))
    robust = replace(ROBUST_3, space=fixed)
    sets = np.array(list(itertools.product(*map(range, OPTIONS))), dtype=float)
    truth = pareto_front(robust(np.hstack([sets, np.ones((len(sets), 2))])))
    found = nsga2(robust, 20, 40, seed=1).front
    np.testing.assert_array_equal(found.designs, truth.designs)


def test_options_and_factors_are_found_together():
    found = nsga2(ROBUST_3, 40, 40, seed=1).front.designs[0]
    sets = np.array(list(itertools.product(*map(range, OPTIONS))), dtype=float)
    best = min(sets, key=lambda row: levels(np.array([[*row, 0.9, 1.1]])).sum())
    np.testing.assert_array_equal(found[:3], best)
    np.testing.assert_allclose(found[3:], [0.9, 1.1], atol=0.02)


def test_one_seed_gives_one_front_and_another_another_way():
    first, again, other = (nsga2(ROBUST_3, 20, 6, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.front.designs, again.front.designs)
    assert not np.array_equal(first.hypervolume, other.hypervolume)


def test_a_stopped_search_goes_on_bit_for_bit_from_its_folder(tmp_path):
    class Stop(Exception):
        pass

    class Stopping(_Recording):
        def __call__(self, designs):
            if len(self.asked) == 7:
                raise Stop
            return super().__call__(designs)

    whole = nsga2(ROBUST_3, 20, 12, seed=5)
    kept = Checkpoint(CheckpointFolder(tmp_path / "search", {}), every=3)
    with pytest.raises(Stop):
        nsga2(Stopping(ROBUST_3), 20, 12, seed=5, checkpoint=kept)
    again = nsga2(ROBUST_3, 20, 12, seed=5, checkpoint=kept)
    np.testing.assert_array_equal(again.front.designs, whole.front.designs)
    np.testing.assert_array_equal(again.hypervolume, whole.hypervolume)


@pytest.mark.parametrize(
    "changes",
    [
        {"upper": np.array([4, 3, 5.5, 1.2, 1.2])},
        {"nominal": np.array([0.5, 0, 0, 1, 1])},
        {"tolerance": np.array([0.1, 0, 0, 0.15, 0.15])},
    ],
)
def test_a_fraction_or_a_tolerance_is_refused(changes):
    with pytest.raises(InputError, match="takes whole numbers"):
        replace(SPACE_3, **changes)


ROBUST_4 = RobustResponse(MODEL, SPACE, sobol_sample(4, 16, seed=1))


def half_fails(designs):
    """NaN over the half of the space that holds the unconstrained optimum of x1."""
    best = designs[:, :1] < 1.0 if MODEL.targets[:, 0].mean() < 1.0 else designs[:, :1] > 1.0
    return np.where(best, np.nan, MODEL(designs))


FAILING_4 = replace(
    ROBUST_4,
    evaluate=ResponseFunction(half_fails, MODEL.variable_names, MODEL.response_names, "1"),
)


class _Memory_4:
    """A store that forgets nothing but what it is told to forget, and checks what it is given."""

    def __init__(self, keeps_evaluations=True):
        self.keeps_evaluations = keeps_evaluations
        self.states = []
        self.evaluations = {}

    def save(self, arrays, facts):
        assert all(array.dtype != object for array in arrays.values())
        copies = {name: array.copy() for name, array in arrays.items()}
        self.states.append((copies, json.loads(json.dumps(facts, allow_nan=False))))

    def load(self):
        return self.states[-1] if self.states else None

    def keep(self, number, arrays):
        if self.keeps_evaluations:
            self.evaluations[number] = arrays

    def kept(self, number):
        return self.evaluations.get(number)


class _Counting:
    """Counts the designs that are really computed."""

    def __init__(self, robust):
        self.robust, self.space, self.count = robust, robust.space, 0

    def __call__(self, designs):
        self.count += len(designs)
        return self.robust(designs)


class Killed(Exception):
    """Stands for the end of the process."""


def search(robust, store, generations=12, every=5, until=None):
    def progress(number, total, text):
        if number == until:
            raise Killed

    return nsga2(
        robust, 20, generations, seed=3, progress=progress, checkpoint=Checkpoint(store, every)
    )


def same(one, other):
    for field in fields(one.front):
        np.testing.assert_array_equal(
            getattr(one.front, field.name), getattr(other.front, field.name)
        )
    for name in ("failed_designs", "hypervolume", "reference_point", "n_evaluated", "seed"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.fixture(scope="module", params=["all computed", "half fails"])
def case(request):
    """Give a response and its search without any interruption."""
    robust = ROBUST_4 if request.param == "all computed" else FAILING_4
    return robust, nsga2(robust, 20, 12, seed=3)


@pytest.mark.parametrize("until", range(1, 13))
@pytest.mark.parametrize("keeps_evaluations", [True, False])
def test_killed_after_any_generation_the_front_is_the_same(case, until, keeps_evaluations):
    robust, whole = case
    store = _Memory_4(keeps_evaluations)
    with pytest.raises(Killed):
        search(robust, store, until=until)
    assert len(store.states) == until // 5 + (until == 12)
    again = _Counting(robust)
    same(search(again, store), whole)
    paid = until if keeps_evaluations else (12 if until == 12 else until // 5 * 5)
    assert again.count == 20 * (12 - paid)


def test_killed_twice(case):
    robust, whole = case
    store = _Memory_4()
    for until in (6, 11):
        with pytest.raises(Killed):
            search(robust, store, until=until)
    same(search(robust, store), whole)


def test_every_design_is_kept_with_its_responses(case):
    robust, whole = case
    store = _Memory_4()
    search(robust, store)
    designs = np.concatenate([store.evaluations[n]["designs"] for n in range(1, 13)])
    assert len(designs) == whole.n_evaluated
    values = robust(designs)
    sigma = np.concatenate([store.evaluations[n]["sigma"] for n in range(1, 13)])
    np.testing.assert_array_equal(sigma, values.sigma)


def test_kept_designs_that_are_not_those_asked_for_are_computed(case):
    robust, whole = case
    store = _Memory_4()
    store.evaluations[1] = {"designs": np.ones((20, 4))}
    same(search(robust, store), whole)


def test_a_search_goes_on_for_more_generations():
    store = _Memory_4()
    search(ROBUST_4, store, generations=7)
    longer = search(ROBUST_4, store, generations=12)
    same(longer, nsga2(ROBUST_4, 20, 12, seed=3))


def test_states_come_every_so_often_and_at_the_end():
    store = _Memory_4()
    search(ROBUST_4, store, generations=7, every=3)
    assert [len(arrays["hypervolume"]) for arrays, _ in store.states] == [3, 6, 7]
    with pytest.raises(InputError, match="every 0 generations"):
        Checkpoint(store, 0)


@pytest.mark.parametrize(
    ("population", "seed", "names", "words"),
    [(24, 3, "", "population 20, not 24"), (20, 4, "", "seed 3, not 4"), (20, 3, "z", "variables")],
)
def test_the_state_of_another_search_is_refused_by_name(population, seed, names, words):
    store = _Memory_4()
    search(ROBUST_4, store, generations=5)
    model = ResponseFunction(
        MODEL, tuple(n + names for n in MODEL.variable_names), MODEL.response_names, "1"
    )
    space = stiffness_factor_space(model.variable_names)
    robust = RobustResponse(model, space, ROBUST_4.sample)
    with pytest.raises(InputError, match=words):
        nsga2(robust, population, 8, seed=seed, checkpoint=Checkpoint(store))


def test_generators_go_on_and_other_kinds_are_refused():
    random = np.random.default_rng(1)
    random.random(7)
    state = json.loads(json.dumps(generator_state(random)))
    expected = random.random(5)
    other = np.random.default_rng(2)
    restore_generator(other, state)
    np.testing.assert_array_equal(other.random(5), expected)
    with pytest.raises(InputError, match="PCG64"):
        restore_generator(other, {**state, "bit_generator": "MT19937"})
