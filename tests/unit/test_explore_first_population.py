"""A search may begin with designs that are there already, and remembers which."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.checkpoint import Checkpoint
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.fronts import nondominated, pareto_rank
from deboom.explore.known_truth import quad2
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import sobol_sample

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = RobustResponse(MODEL, SPACE, sobol_sample(4, 16, seed=1))
FIRST = np.linspace(0.8, 1.2, 32).reshape(8, 4)


class _Seen:
    """A robust response that remembers what it was asked."""

    space = SPACE

    def __init__(self):
        self.designs = []

    def __call__(self, designs):
        self.designs.append(designs.copy())
        return ROBUST(designs)


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
        nsga2(ROBUST, 10, 1, seed=1, first_population=FIRST)
    with pytest.raises(InputError, match=r"design 1 has 0\.3 .* outside its bounds"):
        nsga2(ROBUST, 8, 1, seed=1, first_population=FIRST - 0.5)


def test_a_search_goes_on_only_from_its_own_first_population():
    store = _Memory()
    asked = {"seed": 1, "checkpoint": Checkpoint(store, 1)}
    nsga2(ROBUST, 8, 2, **asked, first_population=FIRST)
    whole = nsga2(ROBUST, 8, 4, seed=1, first_population=FIRST)
    for other in (None, FIRST[::-1]):
        with pytest.raises(InputError, match="belongs to first_population_sha256"):
            nsga2(ROBUST, 8, 4, **asked, first_population=other)
    gone_on = nsga2(ROBUST, 8, 4, **asked, first_population=FIRST)
    assert np.array_equal(gone_on.front.designs, whole.front.designs)
    store.state = None
    nsga2(ROBUST, 8, 1, **asked)
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
