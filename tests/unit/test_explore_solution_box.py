"""Acceptance boxes: what is asked, what is refused, and that a seed decides everything."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore import largest_box
from deboom.explore.box import (
    Box,
    BoxQuestion,
    bernstein_gap,
    lower_bound,
    smooth_share,
    verified_share,
)
from deboom.explore.space import ResponseFunction, sobol_points
from samples.known_boxes import LinearProblem, QuadraticProblem
from samples.known_truth import quad2

QUICK = largest_box.BoxEffort(
    starts=1, coarse=((0.5, 256),), fine=((0.15, 512),), calibration=8192, verification=8192
)


def linear(limit=1.0, share=0.9, **others):
    """Two rising responses of three variables; the third has no effect."""
    problem = LinearProblem(np.array([[1.0, 0.5, 0.0], [0.4, 0.8, 0.0]]))
    bounds = {"lower": np.zeros(3), "upper": np.full(3, 2.0)}
    return BoxQuestion(problem, np.full(2, limit), share, **{**bounds, **others})


def bowls(**others):
    problem = QuadraticProblem(*(getattr(quad2(2, seed=1), n) for n in ("weights", "targets")))
    bounds = {"lower": np.full(2, 0.4), "upper": np.full(2, 1.6)}
    return BoxQuestion(problem, np.full(2, 0.15), 0.9, **{**bounds, **others})


@pytest.mark.parametrize(("together", "common"), [(False, 0.0), (True, 0.0), (True, 0.1)])
def test_the_smooth_share_has_exact_derivatives(together, common):
    question = bowls(together=together, common=common)
    unit = sobol_points(question.n_draws, 1024, seed=1, purpose="derivatives")
    ends = np.array([[0.7, 0.8], [1.1, 1.2]])

    def share(moved):
        return smooth_share(question, moved, unit, 0.05)[0]

    gradient = smooth_share(question, ends, unit, 0.05)[1]
    step = 1e-6
    for place in np.ndindex(2, 2):
        change = np.zeros((2, 2))
        change[place] = step
        difference = (share(ends + change) - share(ends - change)) / (2.0 * step)
        assert gradient[place] == pytest.approx(difference, rel=2e-4, abs=1e-6)


@pytest.mark.parametrize("lost", [0, 7])
def test_a_pull_back_gives_the_derivatives_of_a_gradient(lost):
    """A part whose sum is lost counts with those of its derivatives that are not."""
    question, unit = bowls(), sobol_points(2, 1024, seed=1, purpose="derivatives")
    ends = np.array([[0.7, 0.8], [1.1, 1.2]])
    pulled = replace(question, response=_PulledBack(question.response, lost))
    share, by_end = smooth_share(question, ends, unit, 0.05)
    share_of_sums, by_end_of_sums = smooth_share(pulled, ends, unit, 0.05)
    assert share_of_sums == share
    assert by_end_of_sums == pytest.approx(by_end, rel=1e-12)
    assert pulled.response.n_gradients == lost


def test_a_hard_step_is_the_limit_of_the_smooth_share():
    question = bowls()
    unit = sobol_points(2, 4096, seed=1, purpose="limit")
    box = Box(question.names, np.full(2, 0.7), np.full(2, 1.2))
    ends = np.array([box.lower, box.upper])
    assert smooth_share(question, ends, unit, 1e-9)[0] == question.share_of(box, unit)
    assert question.log_volume(box) == pytest.approx(2 * np.log(0.5))


def test_a_variable_without_effect_gets_its_bounds_and_one_that_is_held_stays():
    said = []
    ask = partial(largest_box.largest_box, seed=1, effort=QUICK)
    largest = ask(linear(), progress=lambda *step: said.append(step[:2]))
    assert said == [(number, 4) for number in (1, 2, 3, 4)]
    assert largest.box.lower[2] == 0.0
    assert largest.box.upper[2] == pytest.approx(2.0)
    assert largest.box.lower[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert np.all(largest.start_log_volumes > largest.question.log_volume(largest.box))
    held = linear(lower=np.array([0.0, 0.3, 0.0]), upper=np.array([2.0, 0.3, 2.0]))
    box = ask(held).box
    assert (box.lower[1], box.upper[1]) == (0.3, 0.3)
    assert box.width[0] > 0.1


def test_a_dear_interval_is_wider():
    questions = (linear(weight=np.array([w, 1.0, 1.0])) for w in (1.0, 4.0))
    even, dear = (largest_box.largest_box(q, seed=1, effort=QUICK).box.width[0] for q in questions)
    assert dear > 1.2 * even


def test_together_is_stricter():
    each, together = (
        question.log_volume(largest_box.largest_box(question, seed=1, effort=QUICK).box)
        for question in (bowls(), bowls(together=True))
    )
    assert together < each


@pytest.mark.slow("begins processes")
def test_the_same_seed_gives_the_same_box_whoever_computes():
    ask = partial(largest_box.largest_box, bowls(), effort=QUICK)
    alone, shared = ask(seed=3), ask(seed=3, workers=2)
    assert shared.box.lower.tobytes() == alone.box.lower.tobytes()
    assert shared.box.upper.tobytes() == alone.box.upper.tobytes()
    assert shared.verified.share == alone.verified.share
    assert ask(seed=4).box.lower[0] != alone.box.lower[0]


def test_the_bound_counts_parts_and_not_responses():
    twins = replace(bowls(), response=_Twins(bowls().response), limit=np.full(8, 0.15))
    box = Box(twins.names, np.full(2, 0.75), np.full(2, 1.15))
    single, many = (verified_share(q, box, seed=1, n_parts=8192) for q in (bowls(), twins))
    assert many.share == pytest.approx(single.share, abs=1e-12)
    assert many.bound == pytest.approx(single.bound, abs=1e-12)
    both = verified_share(bowls(together=True), box, seed=1, n_parts=64)
    error = np.sqrt(both.share * (1.0 - both.share) / 63)
    assert both.standard_error == pytest.approx(error)


def test_a_start_box_is_the_bounds_shrunk_about_its_design():
    half = largest_box._box_around(bowls(), np.array([0.6, 1.2]), 0.5)
    assert np.concatenate([half.lower, half.upper]) == pytest.approx([0.5, 0.8, 1.1, 1.4])


class _PulledBack:
    """Responses with a pull-back whose first sums are not finite."""

    response_unit = "1"

    def __init__(self, model, lost):
        self.model, self.lost, self.n_gradients = model, lost, 0
        self.variable_names, self.response_names = model.variable_names, model.response_names

    def __call__(self, designs):
        return self.model(designs)

    def gradient(self, designs):
        self.n_gradients += len(designs)
        return self.model.gradient(designs)

    def linearised(self, designs):
        def pull_back(weights):
            slopes = np.einsum("onr,nrk->onk", weights, self.model.gradient(designs))
            slopes[:, : self.lost, 0] = np.nan
            return slopes

        return self.model(designs), pull_back


class _Twins:
    """Every response four times: nothing more is known of a part."""

    response_unit = "1"

    def __init__(self, model):
        self.model, self.variable_names = model, model.variable_names
        self.response_names = tuple(f"{n} {i}" for i in range(4) for n in model.response_names)

    def __call__(self, designs):
        return np.tile(self.model(designs), 4)

    def gradient(self, designs):
        return np.tile(self.model.gradient(designs), (1, 4, 1))


def test_a_bound_from_parts_that_all_keep_the_limit_stays_below_one():
    assert 0.99 < lower_bound(np.ones(2000), 0.95) < 1.0
    assert lower_bound(np.array([0.0, 1.0]), 0.95) == 0.0
    with pytest.raises(InputError, match="at least 2 parts"):
        lower_bound(np.ones(1), 0.95)


def test_an_unreachable_limit_says_by_how_much_and_who_binds():
    with pytest.raises(largest_box.UnreachableLimit, match="misses it by") as caught:
        largest_box.largest_box(bowls(together=True).lowered(0.149), seed=1, effort=QUICK)
    error = caught.value
    assert error.binding in ("y1", "y2")
    assert f"'{error.binding}', which binds" in str(error)
    axis = np.linspace(0.4, 1.6, 1201)
    every = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    closest = bowls(together=True).lowered(0.149).excess(every).max(axis=1).min()
    assert error.missed == pytest.approx(closest, rel=1e-3)


def test_a_share_that_one_response_can_miss_needs_only_the_other():
    question = replace(bowls().lowered(0.14), share=0.45)
    design = largest_box.reachable_designs(question, seed=1, count=2)[0]
    assert question.excess(design[np.newaxis]).min() < 0.0
    assert question.least_kept == replace(question, share=0.5).least_kept == 1


def test_a_box_with_no_interior_names_the_variable():
    question = linear(limit=1e-4, lower=np.zeros(3))
    with pytest.raises(InputError, match="no interior: 'x1'"):
        largest_box.largest_box(question, seed=1, effort=QUICK)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"share": 1.0}, "above 0 and below 1"),
        ({"limit": np.zeros(3)}, r"limits of a box: shape \(2\)"),
        ({"lower": np.full(3, 3.0)}, "reversed"),
        ({"weight": np.array([1.0, 0.0, 1.0])}, "shrink to nothing"),
        ({"lower": np.ones(3), "upper": np.ones(3)}, "holds? every variable fixed"),
        ({"upper": np.array([1.0, np.nan, 1.0])}, "upper: a number is not finite"),
        (
            {"response": ResponseFunction(lambda x: x[:, :2], ("a", "b", "c"), ("y", "z"), "1")},
            "no gradient",
        ),
    ],
)
def test_questions_without_an_answer_are_refused(change, sentence):
    with pytest.raises(InputError, match=sentence):
        replace(linear(), **change)


def test_boxes_and_points_that_are_none_are_refused():
    with pytest.raises(InputError, match="lower: a number is not finite"):
        Box(("a",), np.array([np.inf]), np.ones(1))
    with pytest.raises(InputError, match="outside the bounds"):
        largest_box.largest_box(linear(), seed=1, points=[[3.0, 0.0, 0.0]], effort=QUICK)
    with pytest.raises(InputError, match="seed 0"):
        largest_box.largest_box(linear(), seed=0)
    with pytest.raises(InputError, match="workers"):
        largest_box.largest_box(linear(), seed=1, effort=QUICK, workers=0)


def test_a_part_that_cannot_be_computed_keeps_no_limit():
    class Broken(LinearProblem):
        def __call__(self, designs):
            return np.where(designs[:, :1] > 0.5, np.nan, super().__call__(designs))

    question = replace(linear(9.0), response=Broken(linear().response.slopes))
    box = largest_box.largest_box(question, seed=1, effort=QUICK)
    assert box.verified.share >= 0.9
    assert box.box.upper[0] < 0.65


def test_peers_keep_the_share_at_their_limit():
    question = bowls()
    about = largest_box.tolerance_box(question.names, np.ones(2), 0.15)
    unit = sobol_points(2, 65536, seed=1, purpose="kept limit")
    excess = question.excess(about.at(unit))
    raised = question.lowered(-np.quantile(excess, question.share, method="higher"))
    assert raised.share_of(about, unit) == pytest.approx(0.9, abs=2e-4)
    box = largest_box.largest_box(raised, seed=1, points=[np.ones(2)], effort=QUICK)
    assert box.box.width.prod() > 1.1 * about.width.prod()


def test_boxes_grow_with_the_limit():
    question = bowls(together=True)
    strict, mild = (
        largest_box.largest_box(question.lowered(s), seed=1, effort=QUICK) for s in (0.0, -0.1)
    )
    assert question.log_volume(mild.box) > question.log_volume(strict.box)
    assert 0.0 < strict.room < 0.149


def test_resizing_moves_no_end_that_is_a_bound():
    question = linear()
    box = Box(question.names, np.array([0.0, 0.5, 0.0]), np.array([1.0, 2.0, 2.0]))
    grown = largest_box.resized(question, box, 0.2)
    assert grown.lower.tolist() == pytest.approx([0.0, 0.35, 0.0])
    assert grown.upper.tolist() == pytest.approx([1.1, 2.0, 2.0])


def test_bernsteins_bound_of_equal_shares():
    assert bernstein_gap(0.0, 10, 0.95) == pytest.approx(7 * np.log(40) / 27, rel=1e-14)
