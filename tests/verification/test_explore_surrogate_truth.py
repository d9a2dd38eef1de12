"""A search on Gaussian processes against closed forms, within its budget of true rows."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor

import deboom
from deboom.arrays import derivatives
from deboom.errors import InputError
from deboom.explore.descent import Gradients, gradients_of, objectives_and_gradients
from deboom.explore.front import common_box
from deboom.explore.robust import Robust
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space
from deboom.explore.surrogate import RESTARTS, _process
from deboom.files.front_table import FrontTable
from samples.known_truth import exact_front, exp1, quad2

BUDGET = {"budget": 100, "draws": 32, "population": 24, "generations": 12}


class Counted:
    """A problem that counts its rows and may fail at some."""

    def __init__(self, problem, fails=None):
        self.problem, self.fails, self.n, self.killed_at = problem, fails, 0, None
        self.variable_names, self.response_names = problem.variable_names, problem.response_names
        self.response_unit = problem.response_unit

    def __call__(self, designs):
        """Return the responses of one row."""
        self.n += len(designs)
        if self.n == self.killed_at:
            raise KeyboardInterrupt
        if self.fails is not None and self.fails(designs[0]):
            raise ArithmeticError("no solution")
        return self.problem(designs)


class InUnits:
    """A problem whose variables are stiffnesses in N/mm instead of factors."""

    def __init__(self, problem, size):
        self.problem, self.size = problem, np.asarray(size)
        self.variable_names, self.response_names = problem.variable_names, problem.response_names
        self.response_unit = problem.response_unit

    def __call__(self, designs):
        """Return the responses."""
        return self.problem(designs / self.size)

    def exact_terms(self, designs, sigma):
        """Return the terms of mean and variance; relative scatter is the same in any unit."""
        return self.problem.exact_terms(designs / self.size, sigma)

    def space(self):
        """Return the space of factors times the stiffnesses."""
        factors = stiffness_factor_space(self.variable_names)
        bounds = {name: getattr(factors, name) * self.size for name in BOUNDS}
        return replace(factors, units=("N/mm", "N/mm"), **bounds)


BOUNDS = ("nominal", "lower", "upper")


@pytest.fixture(scope="module", params=["QUAD2", "EXP1", "QUAD2 in N/mm"])
def searched(request):
    """Return a problem, its space, the calls of its model and what was searched."""
    problem = exp1(2, seed=1) if request.param == "EXP1" else quad2(2, seed=1)
    space = stiffness_factor_space(problem.variable_names)
    truth = exact_front(problem, space)
    if "N/mm" in request.param:
        problem = InUnits(problem, [180.0, 1500.0])
        space = problem.space()
    counted = Counted(problem)
    return problem, space, truth, counted, deboom.surrogate_search(counted, space, **BUDGET)


def test_the_front_of_a_surrogate_is_that_of_the_closed_form(searched):
    problem, space, truth, counted, result = searched
    assert counted.n == len(result.designs) <= 100
    mean, variance = problem.exact_terms(result.front.values.designs, space.relative_sigma)
    sums = np.column_stack([mean.sum(axis=(1, 2)), np.sqrt(variance.sum(axis=2)).sum(axis=1)])
    box = common_box([truth])
    assert box.hypervolume(sums) > 0.99 * box.hypervolume(truth)
    assert sums[:, 0].min() < truth[:, 0].min() + 0.02 * np.ptp(truth[:, 0])
    for _, pick in result.table.iterrows():
        row = result.front.picks[pick["pick"].split(" = ")[0]]
        for name, true, scale in (("mean", sums[row, 0], 1e-3), ("sigma", sums[row, 1], 2e-2)):
            judged = pick[f"{name} sum by the model [1]"]
            # the draws themselves err, by less than the scale
            error = pick[f"standard error of {name} sum [1]"]
            assert abs(judged - true) < 4.0 * error + scale * abs(true)


def test_the_errors_of_a_surrogate_are_those_at_new_rows(searched):
    problem, space, _, _, result = searched
    assert result.errors["response"].tolist() == list(problem.response_names)
    assert result.errors["share of the standard deviation [%]"].max() < 2.0
    random = np.random.default_rng(5)
    rows = space.lower + random.random((400, 2)) * (space.upper - space.lower)
    beyond = np.sqrt(np.mean((result.surrogate(rows) - problem(rows)) ** 2, axis=0))
    # rows at the edges are harder to predict from others than those between them
    assert np.all(beyond < result.errors["cross-validated error [1]"])


def test_the_slopes_of_a_surrogate_are_those_of_differences(searched):
    _, space, _, _, result = searched
    robust = Robust(result.surrogate, space, draws=32, seed=2)
    assert gradients_of(robust) is Gradients.exact
    assert "exact gradients" in result.front.note
    design, step = 0.3 * space.lower + 0.7 * space.upper, 2e-2 * space.nominal
    slopes = objectives_and_gradients(robust, design)[1]
    # a prediction is the small sum of large terms, whose rounding the long step still shows
    bound = 1e-5 * np.abs(slopes * space.nominal).max(axis=1)
    expected = derivatives(lambda rows: robust(rows).objectives, design, step).T
    assert np.all(np.abs(slopes - expected) * space.nominal < bound[:, np.newaxis])


def test_a_surrogate_front_says_who_judged_it(searched, tmp_path):
    front = searched[-1].front
    words = f"Gaussian processes of {searched[-1].surrogate.n_rows} rows"
    assert set(front.table["judged by"]) == {words}
    assert words in front.text
    assert "The model itself judged the picks with" in front.text
    assert words in front._repr_html_()
    saved = deboom.save_run(front, tmp_path)
    assert set(FrontTable.read(saved.folder).table["judged by"]) == {words}
    assert "by the surrogate [" in searched[-1]._repr_html_()
    again = deboom.verify(front, draws=64, seed=3)
    assert again.judged_by == words


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")
def test_the_likelihood_has_several_starts_and_goes_on_where_it_was_with_more_rows(monkeypatch):
    starts = []
    climb = GaussianProcessRegressor._constrained_optimization

    def counted(self, function, start, bounds):
        starts.append(start)
        return climb(self, function, start, bounds)

    monkeypatch.setattr(GaussianProcessRegressor, "_constrained_optimization", counted)
    at = np.random.default_rng(1).random((30, 2))
    values = np.sin(9.0 * at[:, 0]) + 0.1 * at[:, 1]
    process, error = _process(at, values, 1)
    assert len(starts) == 1 + RESTARTS >= 3
    # each variable has a length of its own
    lengths = process.kernel_.k2.length_scale
    assert 10.0 * lengths[0] < lengths[1]
    assert error < 1e-2
    _process(at, values, 1, process.kernel_)
    assert len(starts) == 2 + RESTARTS
    np.testing.assert_allclose(starts[-1], process.kernel_.theta)


class Kept(dict):
    """Rows by their number."""

    def keep(self, number, arrays):
        """Keep a row."""
        self[number] = arrays

    def kept(self, number):
        """Return a row, or None."""
        return self.get(number)


FAILING, SPACE = quad2(2, seed=1), stiffness_factor_space(quad2(2, seed=1).variable_names)
SMALL = BUDGET | {"population": 12, "generations": 3}


def failing():
    return Counted(FAILING, lambda row: row[0] > 1.2)


@pytest.fixture(scope="module")
def told_and_whole():
    told = []
    search = deboom.surrogate_search(
        failing(), SPACE, **SMALL, progress=lambda *step: told.append(step)
    )
    return told, search


def assert_same_search(search, whole):
    np.testing.assert_array_equal(search.designs, whole.designs)
    np.testing.assert_array_equal(search.front.values.objectives, whole.front.values.objectives)


def test_failing_rows_are_left_out(told_and_whole):
    told, whole = told_and_whole
    assert np.isnan(whole.responses).any()
    assert told[-1][:2] == (len(whole.designs), 100)
    with pytest.raises(InputError, match="no solution"):
        deboom.surrogate_search(Counted(FAILING, np.any), SPACE, **SMALL)


@pytest.mark.slow("begins two processes that import scikit-learn")
def test_two_workers_find_the_same_bits(told_and_whole):
    spread = deboom.surrogate_search(failing(), SPACE, **SMALL, workers=2)
    assert_same_search(spread, told_and_whole[1])


@pytest.mark.slow("searches with a surrogate three times")
def test_a_killed_search_goes_on_with_the_same_bits(told_and_whole):
    _, whole = told_and_whole
    store, first, again = Kept(), failing(), failing()
    first.killed_at = 60
    with pytest.raises(KeyboardInterrupt):
        deboom.surrogate_search(first, SPACE, **SMALL, checkpoint=store)
    assert len(store) == 59  # kept after every call
    resumed = deboom.surrogate_search(again, SPACE, **SMALL, checkpoint=store)
    assert again.n == len(whole.designs) - 59
    assert_same_search(resumed, whole)
    pd.testing.assert_frame_equal(resumed.table, whole.table)


def test_all_rows_may_train_where_a_few_dozen_are_all_there_is():
    search = deboom.surrogate_search(FAILING, SPACE, **SMALL | {"budget": 30}, judged=0, seed=2)
    assert search.surrogate.n_rows == len(search.designs) == 30
    assert search.table["mean sum by the model [1]"].isna().all()
    assert (search.table["rows"] == 0).all()
    assert search.front.note.endswith("The surrogate alone judged the picks.")
    mean, _ = FAILING.exact_terms(search.front.values.designs, SPACE.relative_sigma)
    truth = exact_front(FAILING, SPACE)[:, 0]
    assert mean.sum(axis=(1, 2)).min() < truth.min() + 0.01 * np.ptp(truth)


def test_what_has_no_surrogate_is_refused():
    model = ResponseFunction(lambda x: x[:, :1], ("part", "b"), ("y",), "1")
    whole = DesignSpace(("part", "b"), ("1",) * 2, [1, 1], [0, 0], [3, 2], [0, 0], [True, False])
    with pytest.raises(InputError, match="'part' takes whole numbers"):
        deboom.surrogate_search(model, whole)
    with pytest.raises(InputError, match="give at least 100, or judged=0"):
        deboom.surrogate_search(model, model.design_space(), budget=50)
    with pytest.raises(InputError, match="judged=1: a share"):
        deboom.surrogate_search(model, model.design_space(), judged=1.0)
