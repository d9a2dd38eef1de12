"""Any algorithm of pymoo for several objectives behind the one search, and the user's model."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.rvea import RVEA
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.optimize import minimize
from pymoo.util.ref_dirs import get_reference_directions
from scipy.optimize import OptimizeResult
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import deboom
from deboom.errors import DataWarning, InputError
from deboom.explore.front import common_box
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM, Estimator, Objective
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import ALGORITHMS, RobustProblem, Search, Until, nsga2, searched
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space
from samples.known_truth import exact_front, quad2

MODEL = quad2(4, seed=1)
SPACE = stiffness_factor_space(MODEL.variable_names)
SAMPLE = sobol_sample(4, 16, seed=1)
ROBUST = Robust(MODEL, SPACE, SAMPLE)
BUDGET = Search(population=20, generations=15, seed=2)


def of(function):
    model = ResponseFunction(function, MODEL.variable_names, MODEL.response_names, "1")
    return Robust(model, SPACE, SAMPLE)


def fails_beyond(designs):
    """Fail so often that NSGA-III compares failed designs, which pymoo leaves to chance."""
    return np.where(designs[:, :1] > 0.95, np.nan, MODEL(designs))


COMPILED = pytest.param("age-moea", marks=pytest.mark.slow("pymoo compiles it in each process"))


@pytest.mark.parametrize("name", [COMPILED, *(name for name in ALGORITHMS if name != "age-moea")])
def test_every_algorithm_nears_the_closed_form_also_where_designs_fail(name):
    parabola = Robust(MODEL, SPACE, SAMPLE, estimator=Estimator(2))
    whole = searched(parabola, Search(population=20, generations=40, seed=2, algorithm=name))
    exact = exact_front(MODEL, SPACE)
    box = common_box([exact])
    assert box.hypervolume(whole.front.objectives) > 0.8 * box.hypervolume(exact)
    first, again = (searched(of(fails_beyond), replace(BUDGET, algorithm=name)) for _ in range(2))
    assert first.n_failed > 0
    assert not first.front.failed.any()
    np.testing.assert_array_equal(first.evaluated.designs, again.evaluated.designs)


def test_an_object_of_pymoo_searches_as_in_pymoo_and_is_left_as_it_was():
    directions = get_reference_directions("das-dennis", 2, n_partitions=19)
    algorithm = RVEA(directions)
    first, again = (searched(ROBUST, replace(BUDGET, algorithm=algorithm)) for _ in range(2))
    np.testing.assert_array_equal(first.evaluated.designs, again.evaluated.designs)
    alone = minimize(RobustProblem(ROBUST), NSGA2(20), ("n_gen", 15), seed=2)
    ours = searched(ROBUST, replace(BUDGET, algorithm=NSGA2(20)))
    last = ours.evaluated.designs[-20:]
    assert {tuple(x) for x in alone.pop.get("X")} <= {tuple(x) for x in ours.evaluated.designs}
    assert last.shape == (20, 4)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"algorithm": GA(20)}, "GA minimises one objective, and this problem has 2"),
        ({"algorithm": "nsga4"}, "no algorithm 'nsga4': take one of nsga2"),
        ({"algorithm": "moead", "first_population": SPACE.nominal + np.zeros((25, 1))}, "MOEA/D"),
    ],
)
def test_what_cannot_search_is_refused_by_name(changes, words):
    with pytest.raises(InputError, match=words):
        deboom.search(ROBUST, BUDGET, **changes)


def test_what_is_no_robust_response_and_limits_of_a_search_are_refused_with_the_remedy():
    with pytest.raises(InputError, match="Quad2 cannot be verified"):
        deboom.search(MODEL, BUDGET)
    with pytest.raises(
        InputError, match=r"takes no limits: .*deboom\.Robust\(model, space, limits="
    ):
        deboom.search(ROBUST, BUDGET, limits=[Objective("mean").at_most(1.0)])


def test_any_number_of_designs_and_a_front_begin_a_search():
    many = 0.8 + 0.4 * np.random.default_rng(1).random((33, 4))
    front = deboom.search(ROBUST, BUDGET, first_population=many, polish=False)
    np.testing.assert_array_equal(front.search.evaluated.designs[:33], many)
    after = deboom.search(ROBUST, BUDGET, first_population=front, polish=False)
    begun = after.search.evaluated.designs[: len(front.values)]
    np.testing.assert_array_equal(begun, front.values.designs)
    alone = deboom.search(ROBUST, BUDGET, first_population=SPACE.nominal, polish=False)
    np.testing.assert_array_equal(alone.search.evaluated.designs[0], SPACE.nominal)


def test_a_search_ends_where_it_stands_still_and_says_so():
    long = Search(population=20, generations=60, seed=1)
    whole = searched(ROBUST, long)
    assert whole.stopped == "60 generations"
    still = searched(ROBUST, replace(long, until=Until(gain=0.02, over=5)))
    n = len(still.hypervolume)
    assert 5 < n < 60
    np.testing.assert_array_equal(still.hypervolume, whole.hypervolume[:n])
    assert 1 - still.hypervolume[-6] / still.hypervolume[-1] < 0.02
    assert 1 - still.hypervolume[-7] / still.hypervolume[-2] >= 0.02
    assert still.stopped == f"{n} generations, ended by a gain below 0.02 over 5 generations"
    short = searched(ROBUST, replace(long, generations=10**6, until=Until(seconds=0.2)))
    assert short.stopped.endswith("ended after 0.2 s")
    few = searched(ROBUST, replace(long, until=Until(evaluations=50)))
    assert few.stopped == "3 generations, ended after 60 evaluations"
    np.testing.assert_array_equal(few.hypervolume, whole.hypervolume[:3])
    for wrong in ({}, {"seconds": 0.0}, {"evaluations": 0}, {"gain": 0.1, "over": 0}):
        with pytest.raises(InputError, match="positive"):
            Until(**wrong)


# what a user's model does


def test_any_exception_of_a_function_is_a_failed_design_with_its_message():
    def mistaken(designs):
        if designs[:, 0].max() > 1.1:
            raise KeyError("no licence")
        return (designs - 0.9) ** 2 @ np.ones((4, 2))

    front = deboom.search(of(mistaken), BUDGET)
    result = front.search
    assert 0 < result.n_failed < result.n_evaluated
    assert result.failures == {"KeyError: 'no licence'": result.n_failed}
    assert f"{result.n_failed} failed ({result.n_failed} of them with 'KeyError" in front.text
    spread = searched(ROBUST, BUDGET)
    assert spread.failures == {}


@pytest.mark.parametrize(
    ("gives", "words"),
    [
        (lambda x: MODEL(x) * (1 + 1j), r"gives .*j.* for 'y1', and a response is a real number"),
        (lambda x: MODEL(x).astype(str), r"gives .* for 'y1', and a response is a real number"),
        (lambda x: np.column_stack([MODEL(x)[:, :1], np.full(len(x), None)]), "None for 'y2'"),
    ],
    ids=["complex", "text", "none"],
)
def test_what_is_no_real_number_is_refused_by_the_name_of_the_response(gives, words):
    for explore in (deboom.sobol, deboom.morris, deboom.doe):
        with pytest.raises(InputError, match=words):
            explore(of(gives).evaluate, SPACE)
    with pytest.raises(InputError, match=words):
        deboom.search(of(gives), BUDGET)


def test_whole_numbers_and_objects_of_numbers_are_responses():
    whole = of(lambda x: np.ones((len(x), 2), dtype=object))([np.ones(4)])
    assert whole.mean.tolist() == [[1.0, 1.0]]


def test_a_model_that_does_not_repeat_is_told_by_response_and_size():
    random = np.random.default_rng(1)
    noisy = of(lambda x: MODEL(x) + [0.0, 0.05] * random.standard_normal((len(x), 2)))
    for explore in (
        lambda: deboom.search(noisy, Search(8, 2)),
        lambda: deboom.doe(noisy.evaluate, SPACE, n=4),
        lambda: deboom.sobol(noisy.evaluate, SPACE, n=8),
        lambda: deboom.morris(noisy.evaluate, SPACE, trajectories=2),
    ):
        with pytest.warns(DataWarning, match=r"'y2' differs by 0\.\d+; .* fixed seed"):
            explore()


def test_what_is_not_finite_is_named():
    """A response, a limited one, and a limited number of the design."""
    nan = of(lambda x: MODEL(x) * [1.0, np.nan])
    assert nan([np.ones(4)]).message[0] == "not finite of 16 parts: 'y2' in 16"
    price = ResponseFunction(
        lambda x: np.full(len(x), np.nan), MODEL.variable_names, ("price",), "1"
    )
    limited = Robust(MODEL, SPACE, SAMPLE, limits=[Objective("mean", response=price).at_most(5.0)])
    with pytest.raises(InputError, match="'mean, price at most 5 1' could not be computed"):
        deboom.search(limited, BUDGET)


def test_a_level_and_a_mass_are_responses_of_one_model():
    def car(designs):
        return np.column_stack([60.0 + ((designs - 0.9) ** 2).sum(axis=1), designs.sum(axis=1)])

    names = MODEL.variable_names
    model = ResponseFunction(car, names, ("level", "mass"), "dB(A), kg")
    aims = [Objective("mean", response=name) for name in model.response_names]
    robust = Robust(model, SPACE, SAMPLE, objectives=aims, limits=[aims[1].at_most(4.0)])
    assert robust.objective_labels == ("mean, level [dB(A)]", "mean, mass [kg]")
    front = deboom.search(robust, BUDGET, verified_with=16)
    assert {"mean, level [dB(A)]", "mean, mass [kg]"} <= set(front.table)
    assert not [name for name in front.table if "sum" in name]
    assert (front.table["mean, mass [kg]"] <= 4.01).all()
    assert front.hypervolume_label == "hypervolume [dB·kg]"
    with pytest.raises(
        InputError, match=r"'mean, sum' adds or compares responses in dB\(A\) and kg"
    ):
        Robust(model, SPACE, SAMPLE)
    table = deboom.doe(model, SPACE, n=8).table
    assert list(table)[-3:] == ["level [dB(A)]", "mass [kg]", "failure"]
    effects = deboom.morris(model, SPACE, trajectories=2).table
    assert effects["unit"].tolist() == ["dB(A)", "kg"] * 4
    assert set(deboom.sobol(model, SPACE, n=8).table["response"]) == {"level", "mass"}
    with pytest.raises(InputError, match="3 units 'm, s, kg' of the responses"):
        deboom.doe(replace(model, response_unit="m, s, kg"), SPACE, n=8)


def test_a_front_of_pymoo_is_verified_and_a_table_of_designs_begins_a_search():
    result = minimize(RobustProblem(ROBUST), NSGA2(20), ("n_gen", 5), seed=1)
    front = deboom.verify(result, draws=64, seed=2)
    assert len(front.table) == len(np.unique(result.X, axis=0))
    assert np.sort(front.searched.objectives[:, 0]) == pytest.approx(np.sort(result.F[:, 0]))
    assert front.judge.n_samples == 64
    with pytest.raises(InputError, match="OptimizeResult is no front: give what"):
        deboom.verify(OptimizeResult(), seed=1)
    table = front.designs()
    again = deboom.search(ROBUST, BUDGET, generations=1, first_population=table, polish=False)
    first = again.search.evaluated.designs[: len(table)]
    np.testing.assert_array_equal(first, front.values.designs)
    with pytest.raises(InputError, match=r"has no column 'x2 \[1\]'"):
        deboom.search(ROBUST, BUDGET, first_population=table.drop(columns="x2 [1]"))


def test_a_regressor_that_was_fitted_on_a_table_gets_tables(recwarn):
    rows = np.random.default_rng(1).random((30, 4))
    names = MODEL.variable_names
    frame = pd.DataFrame(rows, columns=list(names))[list(names[::-1])]
    fitted = make_pipeline(StandardScaler(), LinearRegression()).fit(frame, MODEL(rows))
    model = ResponseFunction(fitted.predict, names, MODEL.response_names, "1")
    assert model(rows) == pytest.approx(fitted.predict(frame))
    with_units = LinearRegression().fit(frame.add_suffix(" [1]"), MODEL(rows))
    again = replace(model, function=with_units.predict)
    assert again(rows) == pytest.approx(with_units.predict(frame.add_suffix(" [1]")))
    assert not [entry for entry in recwarn if "feature names" in str(entry.message)]
    with pytest.raises(InputError, match="give both the same names"):
        replace(model, variable_names=tuple("abcd"))(rows)


def test_a_comparison_leaves_out_designs_that_fail_under_new_draws_and_counts_them():
    """Between the optima 0.9 and 1.1 of two responses, parts above 1.15 fail: at 0.9 none is."""

    def fails(designs):
        squares = (designs[:, np.newaxis] - np.array([[0.9], [1.1]])) ** 2
        return np.where(designs[:, :1] > 1.15, np.nan, squares.sum(axis=2))

    aims = [Objective("mean", response=name) for name in MODEL.response_names]
    robust = replace(of(fails), sample=sobol_sample(4, 2, seed=1), objectives=aims)
    budget = {"population": 20, "generations": 15, "verified_with": 16}
    fronts = [deboom.search(robust, **budget, seed=seed) for seed in (1, 2)]
    compared = deboom.compare(*fronts, draws=256)
    sizes = [len(front.search.front) for front in fronts]
    assert all(0 < n < size for n, size in zip(compared.left_out, sizes, strict=True))
    first, second = compared.left_out
    assert f"{first} designs of the first and {second} of the second fail" in compared.text
    assert np.isfinite(compared.value)
    everywhere = replace(fronts[0], robust=of(lambda designs: np.full((len(designs), 2), np.nan)))
    with pytest.raises(InputError, match="designs of a front fail under the common draws"):
        deboom.compare(everywhere, fronts[1], draws=16)


def test_if_the_whole_first_generation_fails_the_exception_is_shown():
    def mistaken(designs):
        return designs["a"]

    with pytest.raises(InputError, match="the first one with 'IndexError: only integers"):
        searched(of(mistaken), BUDGET)


def test_a_wrong_shape_is_no_failed_design():
    with pytest.raises(InputError, match="gave an array of shape"):
        of(lambda designs: designs[:, :1])(np.ones((1, 4)))


def test_a_function_that_writes_into_its_argument_changes_no_design():
    def scaled(designs):
        designs *= 400.0
        return MODEL(designs / 400.0)

    model = ResponseFunction(scaled, MODEL.variable_names, MODEL.response_names, "1")
    made = deboom.doe(model, SPACE, n=16)
    assert made.doe.designs.max() <= 1.2
    np.testing.assert_allclose(model(made.doe.designs), MODEL(made.doe.designs), rtol=1e-12)
    front = searched(of(scaled), BUDGET)
    assert front.evaluated.designs.max() <= 1.2


class Scaling:
    """A model of a user's own class that works in the array that it gets."""

    variable_names, response_names, response_unit = SPACE.names, MODEL.response_names, "1"

    def __call__(self, designs):
        """Compute levels."""
        designs *= 400.0
        return MODEL(designs / 400.0)


def test_a_class_that_writes_into_its_argument_changes_no_design():
    made = deboom.doe(Scaling(), SPACE, n=16).doe
    assert made.designs.max() <= 1.2
    np.testing.assert_allclose(made.responses, MODEL(made.designs), rtol=1e-12)
    model = Scaling()
    objectives = (MEAN_SUM, Objective("mean", response=MODEL, label="of the parts as made"))
    values = Robust(model, SPACE, SAMPLE, objectives=objectives)(SPACE.nominal[np.newaxis])
    np.testing.assert_allclose(values.objectives[0, 1], values.objectives[0, 0], rtol=1e-12)


def parts(designs):
    """Noise of a stiffness and of a part, of which only whole numbers exist."""
    assert np.all(designs[:, 0] == np.round(designs[:, 0]))
    size = np.array([3.0, 0.0, 5.0, 1.0])[designs[:, 0].astype(int)]
    return np.column_stack([size + designs[:, 1], designs[:, 1] ** 2])


CATALOGUE = DesignSpace(
    ("part", "x"), ("1", "1"), [0, 1], [0, 0.8], [3, 1.2], [0, 0.15], integer=[True, False]
)
OF_PARTS = ResponseFunction(parts, ("part", "x"), ("noise", "square"), "dB")


def test_pymoos_own_operators_get_whole_numbers_and_keep_them():
    problem = RobustProblem(Robust(OF_PARTS, CATALOGUE, draws=16))
    result = minimize(problem, NSGA2(12), ("n_gen", 6), seed=1)
    part = result.pop.get("X")[:, 0]
    np.testing.assert_array_equal(part, np.round(part))
    assert set(result.X[:, 0]) == {1.0}


def test_sensitivities_of_whole_numbers_are_those_of_their_options():
    """Four parts of equal chance beside a stiffness: variances 3.69 and 0.4² / 12."""
    of_part, of_x = np.var([3.0, 0.0, 5.0, 1.0]), 0.4**2 / 12
    table = deboom.sobol(OF_PARTS, CATALOGUE, n=1024).table.set_index(["variable", "response"])
    assert table.loc[("part", "noise"), "first [1]"] == pytest.approx(
        of_part / (of_part + of_x), abs=0.02
    )
    effects = deboom.morris(OF_PARTS, CATALOGUE, trajectories=20).table
    assert np.isfinite(effects["mu* [dB]"]).all()


def test_three_objectives_are_searched_and_merged():
    robust = replace(ROBUST, objectives=(MEAN_SUM, SIGMA_SUM, Objective("quantile")))
    result = searched(robust, replace(BUDGET, algorithm="nsga3", searches=2))
    assert result.front.objectives.shape[1] == 3


def test_the_default_is_nsga2_bit_for_bit():
    assert Search().algorithm == "nsga2"
    default, other = (
        nsga2(ROBUST, Search(12, 3, seed=1)),
        searched(ROBUST, Search(population=12, generations=3)),
    )
    np.testing.assert_array_equal(default.evaluated.objectives, other.evaluated.objectives)


# objectives, limits and weights of a user


def test_every_kind_of_objective_is_what_it_says():
    peak = ResponseFunction(lambda x: x.max(axis=1), SPACE.names, ("peak",), "mm")
    objectives = (
        Objective("mean", response="y2"),
        Objective("share above", above=0.12, response="y1"),
        Objective("sigma", response=lambda y: y[:, 0] - y[:, 1], label="difference"),
        Objective("mean", response=peak),
        Objective("quantile", share=0.9, worst=True),
    )
    robust = replace(ROBUST, objectives=objectives)
    design = np.full(4, 1.03)
    made, values = robust.made_responses(design)
    expected = [
        values[:, 1].mean(),
        (values[:, 0] > 0.12).mean(),
        (values[:, 0] - values[:, 1]).std(ddof=1),
        made.max(axis=1).mean(),
        np.quantile(values, 0.9, axis=0).max(),
    ]
    np.testing.assert_allclose(robust(design[np.newaxis]).objectives[0], expected, rtol=1e-12)
    assert robust.objective_labels[1:4] == (
        "share above 0.12, y1 [1]", "difference [1]", "mean, peak [mm]")  # fmt: skip


def test_weights_count_the_responses_and_keep_the_size_of_a_sum():
    whole = replace(ROBUST, weights=[3.0, 1.0])
    values, plain = (response(SPACE.nominal[np.newaxis]) for response in (whole, ROBUST))
    np.testing.assert_allclose(values.mean_sum, plain.mean @ [1.5, 0.5])
    np.testing.assert_allclose(values.sigma_sum, plain.sigma @ [1.5, 0.5])
    np.testing.assert_allclose(values.objectives[0], [values.mean_sum[0], values.sigma_sum[0]])
    same = replace(ROBUST, weights=[2.0, 2.0])(SPACE.nominal[np.newaxis])
    np.testing.assert_allclose(same.standard_error_sigma_sum, plain.standard_error_sigma_sum)
    with pytest.raises(InputError, match="give each one of at least 0"):
        replace(ROBUST, weights=[1.0, -1.0])


def test_limits_of_numbers_are_kept_by_the_whole_front():
    best = replace(
        ROBUST,
        limits=(
            Objective("mean", response="y2").at_most("today"),
            Objective("sigma").at_most(0.07),
        ),
    )
    front = deboom.search(best, BUDGET, verified_with=64)
    today = best(SPACE.nominal[np.newaxis]).mean[0, 1]
    assert np.all(front.search.front.mean[:, 1] <= today)
    assert np.all(front.search.front.sigma_sum <= 0.07)
    assert front.search.infeasible.any()
    assert "sigma, sum at most 0.07 1" in best.limits.names
    with pytest.raises(InputError, match="'tomorrow' is no bound"):
        replace(ROBUST, limits=(Objective("mean").at_most("tomorrow"),))
    with pytest.raises(InputError, match="no response 'y9'"):
        replace(ROBUST, objectives=(MEAN_SUM, Objective("mean", response="y9")))


def test_objectives_that_say_the_same_are_the_same():
    """A user's mean and sigma are those of the default, with its picks, columns and gradients."""
    default = deboom.search(ROBUST, BUDGET, verified_with=64)
    stated = replace(ROBUST, objectives=[deboom.Objective("mean"), deboom.Objective("sigma")])
    front = deboom.search(stated, BUDGET, verified_with=64)
    assert front.note == default.note == "Its picks then went on by gradient."
    assert front.table.equals(default.table)
    assert Objective("mean") != Objective("mean", worst=True)
    with pytest.raises(InputError, match="two objectives are named 'mean, <lambda>'"):
        replace(ROBUST, objectives=[Objective("mean", response=lambda y: y[:, 0])] * 2)


def test_two_objectives_of_a_user_are_no_mean_and_sigma():
    objectives = (Objective("mean", response="y1"), Objective("mean", response="y2"))
    front = deboom.search(replace(ROBUST, objectives=objectives), BUDGET, verified_with=64)
    assert list(front.picks)[:2] == ["best-mean, y1", "best-mean, y2"]
    best = front.pick_designs["best-mean, y2"]
    mean = front.judge(front.values.designs).mean[:, 1]
    np.testing.assert_array_equal(best, front.values.designs[mean.argmin()])
    panels = front.picture().axes
    below = {axes.get_xlabel().replace("\n", " ") for axes in panels}
    assert {"mean, y1 [1]", "mean, y2 [1]"} <= below
    assert "mean, y2 [1]" in {axes.get_ylabel().replace("\n", " ") for axes in panels}


@pytest.mark.parametrize("n", [4, 5])
def test_a_front_of_up_to_five_objectives_has_table_picks_and_pictures(n):
    objectives = (
        MEAN_SUM,
        SIGMA_SUM,
        Objective("quantile", share=0.9, response="y2"),
        Objective("share above", above=0.1, worst=True),
        Objective("mean", response=lambda y: y.max(axis=1), label="peak", unit="dB(A)"),
    )[:n]
    robust = replace(ROBUST, objectives=objectives)
    front = deboom.search(robust, BUDGET, algorithm="nsga3", verified_with=64)
    table, values = front.table, front.values.objectives
    assert values.shape[1] == n
    further = [f"best-{objective.name}" for objective in objectives[2:]]
    picked = ["best-mean", "best-sigma", *further]
    for column, (label, name) in enumerate(zip(robust.objective_labels, picked, strict=True)):
        np.testing.assert_array_equal(table[label], values[:, column])
        row = front.picks[name]
        assert values[row, column] == values[:, column].min()
    assert robust.objective_labels[3] == "share above 0.1, worst response [1]"
    assert len(front.picture().axes) >= n * (n - 1) // 2
    assert len(front.parallel_picture().get_xticklabels()) == n
    shown = front._repr_html_()
    assert all(f"<th>{label}</th>" in shown for label in robust.objective_labels)
    six = [Objective("quantile", share=share) for share in (0.4, 0.5, 0.6, 0.7, 0.8, 0.9)]
    with pytest.raises(InputError, match="take at most 5, and limits for the others"):
        replace(ROBUST, objectives=six)


def test_a_front_of_three_objectives_has_table_picks_and_picture():
    objectives = (MEAN_SUM, SIGMA_SUM, Objective("quantile", share=0.9, response="y2"))
    front = deboom.search(replace(ROBUST, objectives=objectives), BUDGET, verified_with=64)
    table = front.table
    last = "90 % quantile, y2"
    np.testing.assert_array_equal(table[f"{last} [1]"], front.values.objectives[:, 2])
    assert table[f"{last} [1]"].idxmin() == front.picks[f"best-{last}"]
    assert {"best-mean", "best-sigma", "nearest-to-ideal"} <= set(front.picks)
    compared = front.compared({"today": (front.baseline, 0)})
    assert compared[f"{last} [1]"].item() == front.baseline.objectives[0, 2]
    if "none-worse" in front.picks:
        row = front.values.objectives[front.picks["none-worse"]]
        assert np.all(row <= front.baseline.objectives[0])
    figure = front.picture()
    assert len([axes for axes in figure.axes if axes is not None]) >= 6
    lines = front.parallel_picture()
    assert lines.get_ylabel() == "share of the range [%]"
    labels = [text.get_text().split("\n") for text in lines.get_xticklabels()]
    assert [name for name, _ in labels] == list(front.robust.objective_labels)
    low = front.values.objectives[front.nondominated].min(axis=0)
    assert [ends.split(" to ")[0] for _, ends in labels] == [f"{value:.5g}" for value in low]
    drawn = {line.get_label(): line.get_ydata() for line in lines.get_lines()}
    best = drawn["best-mean"]
    assert best[0] == 0.0
    assert set(front.picks) | {"today's"} <= set(drawn)
    assert "<table" in front._repr_html_()
