"""Descents inside a search: when they apply, what joins the archive, the same bits for anybody."""

from dataclasses import replace

import numpy as np
import pytest

import deboom
from deboom.errors import InputError
from deboom.explore import descent
from deboom.explore import search as search_module
from deboom.explore.descent import (
    Gradients,
    converged_front,
    gradients_of,
    objectives_and_gradients,
)
from deboom.explore.front import common_box
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM, Objective
from deboom.explore.robust import Robust
from deboom.explore.scatter import FreshGaussianSampler, sobol_sample
from deboom.explore.search import Search, nsga2, searched
from deboom.explore.space import stiffness_factor_space
from samples.known_truth import WithSlopes, quad2

MODEL = WithSlopes(quad2(4, seed=1))
SPACE = stiffness_factor_space(MODEL.variable_names)
ROBUST = Robust(MODEL, SPACE, sobol_sample(4, 16, seed=1))
BUDGET = {"population": 8, "generations": 2, "seed": 3, "verified_with": 16}


def fixed(*columns):
    lower, upper = SPACE.lower.copy(), SPACE.upper.copy()
    lower[list(columns)] = upper[list(columns)] = 1.0
    return replace(SPACE, lower=lower, upper=upper)


@pytest.mark.parametrize(
    "changes",
    [
        {"evaluate": quad2(4, seed=1)},
        {"evaluate": WithSlopes(quad2(4, seed=1), is_linearisable=False)},
        {"sample": FreshGaussianSampler(4, 16, seed=1)},
        {"nominal_mean": True},
        {"objectives": (Objective("mean"), Objective("quantile"))},
        {"space": replace(SPACE, integer=[True, False, False, False], tolerance=[0, 0, 0, 0],
                          lower=[0.0] * 4, upper=[2.0] * 4)},
        {"space": fixed(0, 1, 2, 3)},
    ],
)  # fmt: skip
def test_without_exact_gradients_nothing_descends(changes):
    assert gradients_of(ROBUST) is Gradients.exact
    assert gradients_of(replace(ROBUST, **changes)) is not Gradients.exact


def test_the_population_of_nsga2_is_part_of_the_archive_of_a_converged_front():
    whole = deboom.search(ROBUST, **BUDGET)
    pure = nsga2(ROBUST, Search(8, 2, seed=3))
    np.testing.assert_array_equal(whole.search.evaluated.designs[:16], pure.evaluated.designs)
    np.testing.assert_array_equal(whole.search.hypervolume, pure.hypervolume)
    assert whole.search.n_evaluated > 100
    assert "exact gradients" in whole.note
    best = whole.search.front.objectives.min(axis=0)
    assert np.all(best <= pure.front.objectives.min(axis=0))


def test_the_gap_that_a_generation_leaves_is_a_mean_over_sigma_in_decibel():
    """Staircases on a fine grid of sigma share nothing with the hypervolume behind the gap."""
    model = WithSlopes(replace(quad2(4, seed=1), response_unit="dB(A)"))
    budget = {**BUDGET, "population": 12, "generations": 6, "polish": False}
    front = deboom.search(replace(ROBUST, evaluate=model), **budget)
    result, table = front.search, front.convergence()
    worst_mean, worst_sigma = result.reference_point
    levels = np.linspace(result.front.objectives[:, 1].min(), worst_sigma, 20_001)[1:]

    def lowest_mean(objectives):
        reached = objectives[:, :1] + np.where(objectives[:, 1:] <= levels, 0.0, np.inf)
        return np.minimum(reached.min(axis=0), worst_mean)

    seen = [result.evaluated.objectives[: 12 * n] for n in range(1, 7)]
    gap = [np.mean(lowest_mean(rows) - lowest_mean(result.front.objectives)) for rows in seen]
    expected = np.array(gap) / len(model.response_names)
    # a step of the grid is 5e-5 of the range
    np.testing.assert_allclose(table["gap [dB]"], expected, atol=5e-4 * expected[0])
    assert table["gap [dB]"].iloc[0] > 0.0
    assert front.convergence_picture().axes[0].get_ylabel() == "gap left [dB]"


def test_what_decides_between_few_and_many_designs_is_what_the_text_says():
    """Single searches do not; three seeds do, merged or in a list; a converged front does alone."""

    def searches(n, **changes):
        return deboom.search(
            ROBUST, population=n, generations=n, verified_with=16, polish=False, **changes
        )

    few, many = searches(16), searches(40)
    verdict = deboom.compare(few, many, draws=512)
    assert verdict.verdict.value == "not decided"
    assert verdict.noise > abs(verdict.value) > 0.0
    advice = "what would decide: 3 seeds of the first and the second, searched with searches=3"
    assert advice in verdict.text
    thrice = [searches(n, searches=3) for n in (16, 40)]
    seeds = [[searches(n, seed=seed) for seed in (1, 2, 3)] for n in (16, 40)]
    converged = deboom.search(ROBUST, population=8, generations=2, verified_with=16)
    for first, second in (thrice, seeds):
        decided = deboom.compare(first, second, draws=512)
        assert decided.verdict.value == "within noise"
        assert decided.noise < 1.0
    best = deboom.compare(converged, searches(8), draws=512)
    assert best.verdict.value == "real difference"
    assert best.value > 0.0


def test_several_searches_descend_from_starts_of_each_seed():
    both = deboom.search(ROBUST, **BUDGET, searches=2).search
    alone = [converged_front(ROBUST, seed=seed) for seed in (3, 4)]
    designs = {design.tobytes() for design in both.evaluated.designs}
    for front in alone:
        assert {design.tobytes() for design in front.designs} <= designs
    box = common_box([both.front.objectives, *(front.objectives for front in alone)])
    volume = box.hypervolume(both.front.objectives)
    assert all(volume >= box.hypervolume(front.objectives) for front in alone)


def test_a_search_of_a_notebook_goes_on_where_it_was_interrupted(tmp_path, monkeypatch):
    """Nothing that was computed is computed again: neither a generation nor the descents."""
    whole = deboom.search(ROBUST, **BUDGET)
    kept = deboom.CheckpointFolder(str(tmp_path / "search"))

    def interrupted(*_args, **_changes):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(search_module, "replicates", interrupted)
        with pytest.raises(KeyboardInterrupt):
            deboom.search(ROBUST, **BUDGET, checkpoint=kept)
    with monkeypatch.context() as patch:
        patch.setattr(search_module, "converged_front", interrupted)
        again = deboom.search(ROBUST, **BUDGET, checkpoint=kept)
        other = replace(ROBUST, sample=sobol_sample(4, 16, seed=2))
        with pytest.raises(InputError, match="by another model or with other draws"):
            deboom.search(other, **BUDGET, checkpoint=kept)
    for mine, theirs in ((again.values, whole.values), (again.searched, whole.searched)):
        np.testing.assert_array_equal(mine.designs, theirs.designs)
        np.testing.assert_array_equal(mine.objectives, theirs.objectives)


def test_a_saved_run_is_compared_like_the_front_that_it_keeps(tmp_path):
    front = deboom.search(ROBUST, population=8, generations=2, verified_with=16)
    run = deboom.save_run(front, tmp_path)
    assert run.front.converged
    assert deboom.compare(front, run, draws=64).verdict.value == "equal fronts"
    assert deboom.compare([run], [front], draws=64).verdict.value == "equal fronts"
    with pytest.raises(InputError, match="one of them from deboom"):
        deboom.compare(run, run)
    with pytest.raises(InputError, match="needs a front on each side"):
        deboom.compare(front, [])


def test_of_three_objectives_the_best_of_each_is_that_of_a_search_of_two():
    third = Objective("mean", response="y2")
    whole = deboom.search(replace(ROBUST, objectives=(MEAN_SUM, SIGMA_SUM, third)), **BUDGET)
    best = whole.search.front.objectives.min(axis=0)
    for column, other in ((1, SIGMA_SUM), (2, third)):
        pair = converged_front(replace(ROBUST, objectives=(MEAN_SUM, other)), seed=3).objectives
        np.testing.assert_allclose(best[[0, column]], pair.min(axis=0), rtol=1e-7)
    assert "then brought the best of each objective to convergence." in whole.note
    worst = replace(ROBUST, objectives=(MEAN_SUM, SIGMA_SUM, Objective("mean", worst=True)))
    assert deboom.search(worst, **BUDGET).search.n_evaluated < whole.search.n_evaluated
    plain = nsga2(worst, Search(8, 2, seed=3)).evaluated
    alone = deboom.search(worst, **BUDGET).search.evaluated
    np.testing.assert_array_equal(alone.designs[:16], plain.designs)


def test_unpolished_the_search_is_nsga2_alone():
    front = deboom.search(ROBUST, **BUDGET, polish=False)
    alone = nsga2(ROBUST, Search(8, 2, seed=3)).evaluated
    np.testing.assert_array_equal(front.search.evaluated.designs, alone.designs)
    assert front.note == ""


class First:
    """The first variable as a limited number."""

    variable_names = SPACE.names
    response_names = ("first",)

    def __call__(self, designs):
        """Return the first column."""
        return designs[:, :1]


class FirstWithSlope(First):
    """The same with its derivatives, of which only the first is not 0."""

    def gradient(self, designs):
        """Return a row of the unit matrix for every design."""
        return np.tile(np.eye(1, SPACE.n_variables), (len(designs), 1, 1))


AT_LEAST = Objective("nominal", response=FirstWithSlope(), unit="1").at_least(1.10)


def test_an_algorithm_ends_early_only_where_descents_own_the_whole_front(monkeypatch):
    monkeypatch.setattr(search_module, "BEFORE_DESCENTS", 20)
    budget = {**BUDGET, "generations": 4}
    front = deboom.search(ROBUST, **budget)
    assert front.search.stopped == "3 generations, ended after 24 evaluations"
    for others in ({"polish": False}, {"until": deboom.Until(seconds=1e6)}):
        assert deboom.search(ROBUST, **budget, **others).search.stopped == "4 generations"
    limited = replace(ROBUST, limits=[AT_LEAST])
    assert deboom.search(limited, **budget).search.stopped == "4 generations"


def test_limits_of_the_worst_drawn_part_leave_the_search_to_nsga2():
    smallest = Objective("smallest", response=FirstWithSlope(), unit="1").at_least(0.8)
    every_part = replace(ROBUST, limits=[smallest])
    assert deboom.search(every_part, **BUDGET).search.n_evaluated == 16
    assert gradients_of(every_part) is not Gradients.exact
    assert gradients_of(replace(ROBUST, limits=[AT_LEAST])) is Gradients.exact


def price_of(variables, *, smooth=True):
    """Return a price without gradient: what is off 1 costs."""
    cost = np.arange(1.0, 1.0 + len(variables))
    return deboom.ResponseFunction(
        lambda x: (cost * (x - 1.0) ** 2).sum(axis=1),
        variables,
        ("price",),
        "EUR",
        smooth=smooth,
    )


@pytest.mark.parametrize("statistic", ["nominal", "mean"])
def test_a_function_without_gradient_is_a_limit_that_descents_keep(statistic):
    """They end where those of the same function with its gradient end, and the search says so."""

    class Exact:
        variable_names, response_names, response_unit = SPACE.names, ("price",), "EUR"

        def __call__(self, x):
            return price_of(SPACE.names)(x)

        def gradient(self, x):
            cost = np.arange(1.0, 1.0 + SPACE.n_variables)
            slope = 2.0 * cost * (x - 1.0)
            return slope[:, np.newaxis]

    budget = {"population": 12, "generations": 4, "seed": 1, "verified_with": 16}
    price = price_of(SPACE.names)
    robust = replace(ROBUST, limits=[Objective(statistic, response=price).at_most(0.06)])
    assert gradients_of(robust) is Gradients.exact
    front = deboom.search(robust, **budget)
    assert front.note.endswith(
        f"Gradients of '{robust.limits.limits[0].number.name}' came from differences."
    )
    assert front.search.front.excess.max() <= 0.0
    assert front.search.front.excess.min() > -0.06
    best = front.search.front.objectives.min(axis=0)
    left = replace(
        robust,
        limits=[Objective(statistic, response=price_of(SPACE.names, smooth=False)).at_most(0.06)],
    )
    alone = deboom.search(left, **budget)
    name = left.limits.limits[0].number.name
    assert f"Limits of '{name}' have no gradient" in alone.note
    assert alone.search.n_evaluated == 48
    assert np.all(best < alone.search.front.objectives.min(axis=0))
    if statistic == "nominal":
        exact = deboom.search(
            replace(ROBUST, limits=[Objective("nominal", response=Exact()).at_most(0.06)]), **budget
        )
        assert "differences" not in exact.note
        np.testing.assert_allclose(best, exact.search.front.objectives.min(axis=0), rtol=1e-5)
        box = common_box([front.search.front.objectives, exact.search.front.objectives])
        volumes = [box.hypervolume(each.search.front.objectives) for each in (front, exact)]
        assert volumes[0] == pytest.approx(volumes[1], rel=5e-4)


def test_differences_of_a_function_stay_within_the_bounds_and_ask_for_one_more_than_variables():
    asked = []

    def priced(x):
        assert np.all((x >= SPACE.lower) & (x <= SPACE.upper))
        asked.append(len(x))
        return (x**2).sum(axis=1)

    price = deboom.ResponseFunction(priced, SPACE.names, ("price",), "EUR")
    robust = replace(ROBUST, limits=[Objective("nominal", response=price).at_most(9.0)])
    design = np.array([1.2, 0.8, 1.0, 1.1])
    values, gradients = descent._Problem(robust)(design)
    np.testing.assert_allclose(gradients()[2], 2.0 * design, rtol=1e-5)
    assert values[2] == pytest.approx((design**2).sum() - 9.0)
    assert asked == [1, SPACE.n_variables]


@pytest.mark.parametrize(
    ("limit", "smooth"),
    [
        (Objective("mean", response="y2").at_most("today"), True),
        (Objective("sigma").at_least(0.01), True),
        (Objective("mean", worst=True).at_most(2.0), True),
        (Objective("mean", worst=True).at_least(0.0), False),
        (Objective("quantile").at_most(9.0), False),
        (Objective("mean", response=lambda y: y[:, 0]).at_most(9.0), False),
    ],
)
def test_limits_of_means_and_sigmas_have_gradients(limit, smooth):
    assert (gradients_of(replace(ROBUST, limits=[limit])) is Gradients.exact) is smooth


def test_descents_keep_the_limits_of_the_response_and_of_the_design():
    """Beside both limits the front reaches what it reaches in a space cut where the limit is."""
    bound = 0.18
    kept = Objective("mean", response="y2").at_most(bound)
    begin = {"seed": 1, "begin": np.array([[1.15, 1.0, 1.0, 1.0]])}
    values = converged_front(replace(ROBUST, limits=[kept, AT_LEAST]), **begin)
    assert values.feasible.all()
    assert values.excess.shape[1] == 2
    assert values.mean[:, 1].max() == pytest.approx(bound, abs=1e-6)
    assert values.designs[:, 0].min() == pytest.approx(1.10, abs=1e-4)
    lower, middle = np.array([1.10, 0.8, 0.8, 0.8]), np.array([1.15, 1.0, 1.0, 1.0])
    cut = replace(SPACE, lower=lower, nominal=middle)
    alone = converged_front(replace(ROBUST, limits=[kept], space=cut), **begin)
    other = alone.objectives
    box = common_box([values.objectives, other])
    assert box.hypervolume(values.objectives) == pytest.approx(box.hypervolume(other), rel=1e-4)
    best = values.objectives.min(axis=0)
    np.testing.assert_allclose(best, other.min(axis=0), rtol=1e-4)


def test_two_means_have_a_converged_front_of_their_own():
    aims = [Objective("mean", response=name) for name in ("y1", "y2")]
    robust = replace(ROBUST, objectives=tuple(aims))
    reached = converged_front(robust, seed=1)
    alone = nsga2(robust, Search(40, 40, seed=1)).front
    best, expected = reached.objectives.min(axis=0), alone.objectives.min(axis=0)
    assert np.all(best <= expected + 1e-9)


class Well:
    """Both responses fall towards one bound of x1; the first is far lower just at the other."""

    variable_names, response_names, response_unit = ("x1", "x2"), ("y1", "y2"), "1"

    def __call__(self, designs):
        """Return the responses."""
        x, y = designs.T
        deep = np.maximum(0.804 - x, 0.0) / 0.004
        return np.column_stack([1.2 - x - deep**2 + (y - 0.8) ** 2, 1.2 - x + (y - 1.2) ** 2])

    def gradient(self, designs):
        """Return the derivatives of the responses."""
        x, y = designs.T
        slope = 2.0 * np.maximum(0.804 - x, 0.0) / 0.004**2 - 1.0
        first = np.stack([slope, 2.0 * (y - 0.8)], axis=1)
        return np.stack([first, np.stack([0.0 * x - 1.0, 2.0 * (y - 1.2)], axis=1)], axis=1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_end_in_a_small_basin_is_reached_from_the_other_bound(seed):
    model = WithSlopes(Well())
    space = replace(stiffness_factor_space(model.variable_names), tolerance=[0.0, 0.0])
    aims = tuple(Objective("mean", response=name) for name in model.response_names)
    robust = Robust(model, space, sobol_sample(2, 16, seed=1), objectives=aims)
    assert converged_front(robust, seed=seed).objectives[:, 0].min() == pytest.approx(0.4 - 1.0)


def test_designs_of_one_valley_count_once():
    places = [np.array([0.1]), np.array([0.9]), np.array([0.5])]
    ends = [
        descent._Point(at, np.array([0.0, v]), 0.0)
        for at, v in zip(places, (0.0, 0.002, 0.1), strict=True)
    ]
    assert descent._valleys(ends, 1) == [ends[0], ends[2]]


@pytest.mark.slow("begins processes")
def test_a_converged_front_is_the_same_bits_for_any_number_of_workers():
    alone, spread = (deboom.search(ROBUST, **BUDGET, workers=workers) for workers in (1, 2))
    np.testing.assert_array_equal(alone.values.designs, spread.values.designs)
    np.testing.assert_array_equal(alone.values.objectives, spread.values.objectives)


def test_progress_names_the_stages():
    told = []
    designs = converged_front(ROBUST, seed=1, progress=lambda *step: told.append(step)).designs
    assert [step[:2] for step in told] == [(n, 5) for n in (1, 2, 3, 4, 5)]
    np.testing.assert_array_equal(designs, converged_front(ROBUST, seed=1).designs)


def test_a_fixed_variable_stays_where_it_is():
    designs = converged_front(replace(ROBUST, space=fixed(1)), seed=1).designs
    assert np.all(designs[:, 1] == 1.0)
    assert np.ptp(designs[:, 0]) > 0.02


class Breaks(WithSlopes):
    """Gives no number where the first variable is large."""

    def __call__(self, designs):
        """Return the responses, NaN beyond 1.1."""
        return np.where(designs[:, :1] > 1.1, np.nan, super().__call__(designs))

    def linearised(self, designs):
        """Return the responses with the slopes of the whole problem."""
        _, pull_back = super().linearised(designs)
        return self(designs), pull_back


def test_descents_step_back_from_designs_that_fail():
    """They cannot follow the edge of what fails, but stay on this side; NSGA-II has the rest."""
    robust = replace(ROBUST, evaluate=Breaks(quad2(4, seed=1)))
    assert not converged_front(robust, seed=1).failed.any()
    result = searched(robust, Search(population=12, generations=6, seed=1))
    assert result.n_failed > 0


def test_slopes_of_each_mean_add_up_to_those_of_the_sum():
    sums, slopes = objectives_and_gradients(ROBUST, SPACE.nominal, each_mean=True)
    assert sums[2:].sum() == pytest.approx(sums[0])
    np.testing.assert_allclose(slopes[2:].sum(axis=0), slopes[0], rtol=1e-12)
