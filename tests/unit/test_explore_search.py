"""NSGA-II through the door to pymoo, with each known trap of pymoo 0.6.2 kept shut."""

import doctest
import random
import warnings
from dataclasses import fields, replace

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize

from deboom.errors import InputError
from deboom.explore import problems
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.fronts import hypervolume, nondominated
from deboom.explore.known_truth import quad2
from deboom.explore.problems import FAILED_OBJECTIVE, RobustProblem, nsga2
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.tolerance_samples import sobol_sample

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
