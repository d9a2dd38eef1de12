"""Several searches into one front, and the last steps by gradient."""

from __future__ import annotations

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.fronts import pareto_front
from deboom.explore.known_truth import quad2
from deboom.explore.problems import nsga2
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import sobol_sample
from deboom.study.robust_search import Budget, robust_search

MODEL = quad2(5, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = RobustResponse(MODEL, SPACE, sobol_sample(5, 32, seed=1))


def silent(*_):
    """Show no progress."""


def found(budget, seed=3, robust=ROBUST):
    return robust_search(robust, ROBUST, budget, seed, silent, None, ())


def test_one_search_is_that_of_nsga2():
    whole, alone = found(Budget(12, 5)), nsga2(ROBUST, 12, 5, seed=3)
    np.testing.assert_array_equal(whole.front.designs, alone.front.designs)
    np.testing.assert_array_equal(whole.hypervolume, alone.hypervolume)
    assert Budget(12, 5).note == ""


def test_several_searches_give_the_front_of_all():
    whole = found(Budget(12, 5, searches=3))
    each = [nsga2(ROBUST, 12, 5, seed=seed) for seed in (3, 4, 5)]
    expected = pareto_front(*(search.front for search in each))
    np.testing.assert_array_equal(whole.front.designs, expected.designs)
    np.testing.assert_array_equal(whole.hypervolume, each[0].hypervolume)
    assert whole.n_evaluated == 180
    assert "3 searches" in Budget(12, 5, searches=3).note


def test_a_polish_only_improves_and_is_said():
    budget = Budget(12, 5, polished=True)
    before, after = found(Budget(12, 5)).front, found(budget).front
    assert after.mean_sum.min() < before.mean_sum.min()
    joined = pareto_front(before, after)
    np.testing.assert_array_equal(joined.designs, after.designs)
    assert "by gradient" in budget.note


def test_bad_budgets_are_refused():
    with pytest.raises(InputError, match="0 searches find nothing"):
        found(Budget(12, 5, searches=0))

    class Limited:
        space, limits = SPACE, object()

    with pytest.raises(InputError, match="a polish knows no limits"):
        found(Budget(12, 5, polished=True), robust=Limited())
