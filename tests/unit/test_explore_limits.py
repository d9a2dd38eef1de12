"""Limits: which designs a search may offer, what it keeps of the others, what if there is none."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.archive import merge
from deboom.explore.checkpoint import Checkpoint
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.fronts import pareto_front
from deboom.explore.known_truth import quad2
from deboom.explore.limits import Limit, LimitedResponse, Limits
from deboom.explore.problems import RobustProblem, nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import sobol_sample

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = RobustResponse(MODEL, SPACE, sobol_sample(4, 16, seed=1))


def total(designs):
    """Return the sum of all factors, and the first one."""
    return np.column_stack([designs.sum(axis=1), designs[:, 0]])


def limited(sum_at_most=4.1, first=(0.95, 1.05), function=total, **changes):
    response = ResponseFunction(function, SPACE.names, ("sum", "first"), "kg")
    limits = Limits(
        (Limit("sum", "kg", at_most=sum_at_most), Limit("first", "kg", *first)),
    )
    return LimitedResponse(ROBUST, response, limits, **changes)


def test_excess_is_signed_and_one_column_per_bound():
    limits = limited().limits
    assert limits.names == (
        "sum at most 4.1 kg",
        "first at least 0.95 kg",
        "first at most 1.05 kg",
    )
    excess = limits.excess(np.array([[4.3, 1.0], [4.0, 0.9], [np.nan, 1.1]]))
    expected = [[0.2, -0.05, -0.05], [-0.1, 0.05, -0.15], [np.inf, -0.15, 0.05]]
    np.testing.assert_allclose(excess, expected, atol=1e-12)


def test_the_front_keeps_all_limits_and_the_others_are_kept_with_their_excess():
    response = limited()
    search = nsga2(response, 24, 12, seed=1)
    assert np.all(response.excess(search.front.designs) <= 0.0)
    assert np.all(total(search.front.designs)[:, 0] <= 4.1)
    assert 0 < search.n_infeasible < search.n_evaluated == 24 * 12
    beyond = response.excess(search.infeasible_designs)
    np.testing.assert_array_equal(search.infeasible_excess, beyond)
    assert np.all(beyond.max(axis=1) > 0.0)


def test_limits_that_never_bind_change_nothing():
    free, plain = nsga2(limited(9.0, (0.0, 9.0)), 20, 8, seed=2), nsga2(ROBUST, 20, 8, seed=2)
    for field in fields(plain.front):
        if field.name != "excess":
            there, here = getattr(free.front, field.name), getattr(plain.front, field.name)
            np.testing.assert_array_equal(there, here)
    assert free.n_infeasible == 0


def test_the_best_of_the_kept_designs_is_found():
    """With the bound on the sum active, the best mean within it beats every drawn design."""
    search = nsga2(limited(3.9, (0.8, 1.2)), 40, 40, seed=1)
    drawn = 0.8 + 0.4 * np.random.default_rng(1).random((3000, 4))
    drawn = drawn[drawn.sum(axis=1) <= 3.9]
    best = ROBUST(drawn).mean_sum.min()
    assert search.front.mean_sum.min() < best


def test_a_limit_out_of_reach_says_which_and_by_how_much():
    with pytest.raises(InputError) as raised:
        nsga2(limited(3.0, (0.0, 9.0)), 20, 10, seed=1)
    text = str(raised.value)
    assert "none of the 200 designs of this search keeps all limits" in text
    assert "the closest one misses 'sum at most 3 kg' by 0.2" in text
    assert "relax that limit" in text


def test_limits_that_none_keeps_are_all_named():
    with pytest.raises(InputError, match=r"none keeps 'first at least 1\.5 kg' either"):
        nsga2(limited(1.0, (1.5, 9.0)), 20, 2, seed=1)


def test_a_number_that_cannot_be_computed_keeps_no_limit():
    def half(designs):
        return np.where(designs[:, :1] > 1.0, np.nan, total(designs))

    search = nsga2(limited(9.0, (0.0, 9.0), half), 20, 8, seed=1)
    assert np.all(search.front.designs[:, 0] <= 1.0)
    assert np.isinf(search.infeasible_excess).any(axis=1).all()
    out = RobustProblem(limited(function=half)).evaluate(
        np.full((1, 4), 1.1), return_as_dictionary=True
    )
    assert np.isfinite(out["G"]).all()


def test_the_worst_drawn_part_may_have_to_keep_the_limits():
    strict = limited(4.1, (0.0, 9.0), made=ROBUST.made)
    design = np.array([[1.0, 1.0, 1.0, 1.05]])
    worst = ROBUST.made(design[0]).sum(axis=1).max()
    np.testing.assert_allclose(strict.excess(design)[0, 0], worst - 4.1, atol=1e-12)
    assert limited().excess(design)[0, 0] < 0.0 < strict.excess(design)[0, 0]


class _Memory:
    """A store that can be taken back to an earlier state."""

    def __init__(self):
        self.states, self.evaluations = [], {}

    def save(self, arrays, facts):
        copies = {name: array.copy() for name, array in arrays.items()}
        self.states.append((copies, json.loads(json.dumps(facts))))

    def load(self):
        return self.states[-1] if self.states else None

    def keep(self, number, arrays):
        self.evaluations[number] = arrays

    def kept(self, number):
        return self.evaluations.get(number)


@pytest.mark.parametrize("kept", [1, 3])
def test_a_search_within_limits_goes_on_bit_for_bit(kept):
    store = _Memory()
    whole = nsga2(limited(), 16, 10, seed=3, checkpoint=Checkpoint(store, every=2))
    del store.states[kept:]
    store.evaluations = {}
    again = nsga2(limited(), 16, 10, seed=3, checkpoint=Checkpoint(store, every=2))
    for name in ("infeasible_designs", "infeasible_excess", "hypervolume"):
        np.testing.assert_array_equal(getattr(again, name), getattr(whole, name))
    np.testing.assert_array_equal(again.front.designs, whole.front.designs)


def test_merged_searches_keep_what_each_one_refused():
    one, two = (nsga2(limited(), 16, 4, seed=seed) for seed in (1, 2))
    both = merge([one, two])
    assert both.n_infeasible == one.n_infeasible + two.n_infeasible
    assert np.all(limited().excess(both.front.designs) <= 0.0)


def test_fronts_leave_out_what_misses_a_limit():
    values = limited()(np.array([[0.8, 0.8, 0.8, 0.8], [1.0, 1.0, 1.0, 1.0]]))
    assert values.feasible.tolist() == [False, True]
    np.testing.assert_array_equal(pareto_front(values).designs, [[1.0, 1.0, 1.0, 1.0]])


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Limit("sum", "kg", 2.0, 1.0), "exclude each other"),
        (lambda: Limit("sum", "kg"), "give at_least, at_most or both"),
        (lambda: Limits(()), "no limit to keep"),
        (lambda: replace(limited(), limits=Limits((Limit("sum", "kg", 1.0),))), "responses"),
    ],
)
def test_bad_limits_are_refused(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()
