"""A search on Gaussian processes against closed forms, within its budget of true rows."""

import numpy as np
import pytest

import deboom
from deboom.errors import InputError
from deboom.explore.front import common_box
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space
from samples.known_truth import exact_front, exp1, quad2

BUDGET = {"budget": 100, "draws": 32, "population": 24, "generations": 12}


class Counted:
    """A problem that counts its rows and may fail at some."""

    def __init__(self, problem, fails=None):
        self.problem, self.fails, self.n = problem, fails, 0
        self.variable_names, self.response_names = problem.variable_names, problem.response_names
        self.response_unit = problem.response_unit

    def __call__(self, designs):
        """Return the responses of one row."""
        self.n += len(designs)
        if self.fails is not None and self.fails(designs[0]):
            raise ArithmeticError("no solution")
        return self.problem(designs)


@pytest.mark.parametrize("problem", [quad2(2, seed=1), exp1(2, seed=1)])
def test_the_front_of_a_surrogate_is_that_of_the_closed_form(problem):
    space = stiffness_factor_space(problem.variable_names)
    counted = Counted(problem)
    result = deboom.surrogate_search(counted, space, **BUDGET | {"generations": 40})
    assert counted.n == len(result.designs) <= 100
    mean, variance = problem.exact_terms(result.front.values.designs, space.relative_sigma)
    sums = np.column_stack([mean.sum(axis=(1, 2)), np.sqrt(variance.sum(axis=2)).sum(axis=1)])
    truth = exact_front(problem, space)
    box = common_box([truth])
    assert box.hypervolume(sums) > 0.98 * box.hypervolume(truth)
    assert result.errors["share of the standard deviation [%]"].max() < 2.0
    assert "Gaussian processes" in result.front.note
    for _, pick in result.table.iterrows():
        row = result.front.picks[pick["pick"].split(" = ")[0]]
        for name, true, scale in (("mean", sums[row, 0], 1e-3), ("sigma", sums[row, 1], 2e-2)):
            judged, error = pick[f"{name} sum [1]"], pick[f"standard error of {name} sum [1]"]
            # the draws themselves err, by less than the scale
            assert abs(judged - true) < 4.0 * error + scale * abs(true)


class Kept(dict):
    """Rows by their number."""

    def keep(self, number, arrays):
        """Keep a row."""
        self[number] = arrays

    def kept(self, number):
        """Return a row, or None."""
        return self.get(number)


def test_failing_rows_are_left_out_and_a_kept_search_is_the_same():
    problem = quad2(2, seed=1)
    space = stiffness_factor_space(problem.variable_names)

    budget = BUDGET | {"population": 12, "generations": 3}
    first = Counted(problem, fails=lambda row: row[0] > 1.2)
    told, store = [], Kept()
    whole = deboom.surrogate_search(
        first, space, **budget, checkpoint=store, progress=lambda *step: told.append(step)
    )
    assert np.isnan(whole.responses).any()
    assert told[-1][:2] == (len(whole.designs), 100)
    for number in range(60, 101):
        store.pop(number, None)
    again = Counted(problem, fails=lambda row: row[0] > 1.2)
    resumed = deboom.surrogate_search(again, space, **budget, checkpoint=store)
    np.testing.assert_array_equal(resumed.designs, whole.designs)
    assert again.n == len(whole.designs) - 59
    with pytest.raises(InputError, match="no solution"):
        deboom.surrogate_search(Counted(problem, fails=np.any), space, **budget)


def test_what_has_no_surrogate_is_refused():
    model = ResponseFunction(lambda x: x[:, :1], ("part", "b"), ("y",), "1")
    whole = DesignSpace(("part", "b"), ("1",) * 2, [1, 1], [0, 0], [3, 2], [0, 0], [True, False])
    with pytest.raises(InputError, match="'part' takes whole numbers"):
        deboom.surrogate_search(model, whole)
    with pytest.raises(InputError, match="give at least 100"):
        deboom.surrogate_search(model, model.design_space(), budget=50)
