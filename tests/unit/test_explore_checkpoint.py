"""A search that stops anywhere and goes on is bit for bit the search that never stopped."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.checkpoint import Checkpoint, generator_state, restore_generator
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.known_truth import quad2
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import sobol_sample

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = RobustResponse(MODEL, SPACE, sobol_sample(4, 16, seed=1))


def half_fails(designs):
    """NaN over the half of the space that holds the unconstrained optimum of x1."""
    best = designs[:, :1] < 1.0 if MODEL.targets[:, 0].mean() < 1.0 else designs[:, :1] > 1.0
    return np.where(best, np.nan, MODEL(designs))


FAILING = replace(
    ROBUST,
    evaluate=ResponseFunction(half_fails, MODEL.variable_names, MODEL.response_names, "1"),
)


class _Memory:
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
    robust = ROBUST if request.param == "all computed" else FAILING
    return robust, nsga2(robust, 20, 12, seed=3)


@pytest.mark.parametrize("until", range(1, 13))
@pytest.mark.parametrize("keeps_evaluations", [True, False])
def test_killed_after_any_generation_the_front_is_the_same(case, until, keeps_evaluations):
    robust, whole = case
    store = _Memory(keeps_evaluations)
    with pytest.raises(Killed):
        search(robust, store, until=until)
    assert len(store.states) == until // 5 + (until == 12)
    again = _Counting(robust)
    same(search(again, store), whole)
    paid = until if keeps_evaluations else (12 if until == 12 else until // 5 * 5)
    assert again.count == 20 * (12 - paid)


def test_killed_twice(case):
    robust, whole = case
    store = _Memory()
    for until in (6, 11):
        with pytest.raises(Killed):
            search(robust, store, until=until)
    same(search(robust, store), whole)


def test_every_design_is_kept_with_its_responses(case):
    robust, whole = case
    store = _Memory()
    search(robust, store)
    designs = np.concatenate([store.evaluations[n]["designs"] for n in range(1, 13)])
    assert len(designs) == whole.n_evaluated
    values = robust(designs)
    sigma = np.concatenate([store.evaluations[n]["sigma"] for n in range(1, 13)])
    np.testing.assert_array_equal(sigma, values.sigma)


def test_kept_designs_that_are_not_those_asked_for_are_computed(case):
    robust, whole = case
    store = _Memory()
    store.evaluations[1] = {"designs": np.ones((20, 4))}
    same(search(robust, store), whole)


def test_a_search_goes_on_for_more_generations():
    store = _Memory()
    search(ROBUST, store, generations=7)
    longer = search(ROBUST, store, generations=12)
    same(longer, nsga2(ROBUST, 20, 12, seed=3))


def test_states_come_every_so_often_and_at_the_end():
    store = _Memory()
    search(ROBUST, store, generations=7, every=3)
    assert [len(arrays["hypervolume"]) for arrays, _ in store.states] == [3, 6, 7]
    with pytest.raises(InputError, match="every 0 generations"):
        Checkpoint(store, 0)


@pytest.mark.parametrize(
    ("population", "seed", "names", "words"),
    [(24, 3, "", "population 20, not 24"), (20, 4, "", "seed 3, not 4"), (20, 3, "z", "variables")],
)
def test_the_state_of_another_search_is_refused_by_name(population, seed, names, words):
    store = _Memory()
    search(ROBUST, store, generations=5)
    model = ResponseFunction(
        MODEL, tuple(n + names for n in MODEL.variable_names), MODEL.response_names, "1"
    )
    space = stiffness_factor_space(model.variable_names)
    robust = RobustResponse(model, space, ROBUST.sample)
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
