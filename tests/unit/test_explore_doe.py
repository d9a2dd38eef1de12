"""Designs of experiments."""

import numpy as np
import pytest
from scipy.stats import qmc

from deboom.errors import InputError
from deboom.explore.doe import (
    box_behnken,
    central_composite,
    fractional_factorial,
    full_factorial,
    latin_hypercube,
    run_doe,
    sobol_designs,
)
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space

NAMES = ("EnM x", "GeM x", "TSM x")
SPACE = stiffness_factor_space(NAMES, half_width=0.15)


class Counted:
    """A model that counts its designs, and fails where it is told to."""

    variable_names = NAMES
    response_names = ("sedan", "tourer")
    response_unit = "dB"

    def __init__(self, shift=0.0):
        self.n = 0
        self.shift = shift

    def __call__(self, designs):
        """Count and compute."""
        self.n += len(designs)
        if np.any(designs[:, 0] > 1.1):
            raise ZeroDivisionError("mass is zero in car 3")
        if np.any(designs[:, 1] > 1.1):
            raise np.linalg.LinAlgError
        values = designs @ np.array([[1.0, 2.0], [0.5, 0.1], [0.2, 0.3]]) + self.shift
        values[designs[:, 2] > 1.1] = np.inf
        return values


def inside(space, designs):
    return np.all((designs >= space.lower) & (designs <= space.upper))


def test_latin_hypercube_has_one_design_per_interval_and_fills_the_bounds_evenly():
    designs = latin_hypercube(SPACE, 40, seed=1)
    cells = np.floor((designs - 0.85) / 0.3 * 40 * (1 - 1e-12)).astype(int)
    assert all(sorted(column) == list(range(40)) for column in cells.T)
    plain = [qmc.discrepancy(qmc.LatinHypercube(3, rng=n).random(40)) for n in range(20)]
    assert qmc.discrepancy((designs - 0.85) / 0.3) < 0.8 * min(plain)
    assert np.array_equal(designs, latin_hypercube(SPACE, 40, seed=1))
    assert not np.array_equal(designs, latin_hypercube(SPACE, 40, seed=2))
    with pytest.raises(InputError, match="take at least 2"):
        latin_hypercube(SPACE, 1, seed=1)


def test_sobol_designs_need_a_power_of_two():
    designs = sobol_designs(SPACE, 64, seed=1)
    assert inside(SPACE, designs)
    cells = np.floor((designs - 0.85) / 0.3 * 64)
    assert all(len(set(column)) == 64 for column in cells.T)
    with pytest.raises(InputError, match=r"300 Sobol points .* take 256 or 512"):
        sobol_designs(SPACE, 300, seed=1)
    with pytest.raises(InputError, match="seed 0"):
        sobol_designs(SPACE, 64, seed=0)


def test_whole_numbers_stay_whole():
    space = DesignSpace(
        ("part", "factor"), ("1", "1"), np.array([1.0, 1.0]), np.array([1.0, 0.9]),
        np.array([4.0, 1.1]), np.zeros(2), np.array([True, False]),
    )  # fmt: skip
    designs = sobol_designs(space, 128, seed=1)
    assert np.array_equal(np.unique(designs[:, 0], return_counts=True)[1], [32] * 4)


def test_every_design_is_kept_with_its_responses_or_its_failure():
    designs = np.array([[1, 1, 1], [1.12, 1, 1], [1, 1.12, 1], [1, 1, 1.12], [0.9, 1, 1]])
    doe = run_doe(Counted(), SPACE, designs, name="n", plan="p")
    said = ("ZeroDivisionError: mass is zero in car 3", "LinAlgError")
    assert doe.failures == ("", *said, "not finite", "")
    assert np.array_equal(doe.designs, designs)
    assert np.isnan(doe.responses[1:4]).all()
    assert doe.computed == pytest.approx(Counted()(designs[[0, 4]]))
    assert np.array_equal(doe.computed_designs, designs[[0, 4]])
    assert doe.n_failed == 3


def test_any_error_of_a_model_is_a_failed_design_until_all_fail():
    def broken(designs):
        if np.any(designs[:, 0] > 1.1):
            raise KeyError("mesh")
        return designs[:, :1]

    designs = np.array([[1, 1, 1], [1.12, 1, 1], [0.9, 1, 1]])
    model = ResponseFunction(broken, NAMES, ("van",), "dB")
    doe = run_doe(model, SPACE, designs, name="n", plan="p")
    assert doe.failures == ("", "KeyError: 'mesh'", "")
    with pytest.raises(InputError, match=r"fails at every design .* 'KeyError"):
        run_doe(model, SPACE, designs[1:2], name="n", plan="p")


def test_a_design_is_evaluated_once():
    model = Counted()
    designs = np.array([[1, 1, 1], [0.9, 1, 1], [1, 1, 1 + 1e-13], [0.9, 1, 1]])
    doe = run_doe(model, SPACE, designs, name="n", plan="p")
    assert model.n == 2
    assert np.array_equal(doe.designs, designs[:2])
    with pytest.raises(InputError, match=r"1\.3 for 'GeM x', outside its bounds 0\.85"):
        run_doe(model, SPACE, np.array([[1.0, 1.3, 1.0]]), name="n", plan="p")


def test_other_variables_are_refused():
    turned = ResponseFunction(lambda x: x[:, :1], NAMES[::-1], ("van",), "dB")
    with pytest.raises(InputError, match="same names in the same order"):
        run_doe(turned, SPACE, np.ones((1, 3)), name="n", plan="p")
    with pytest.raises(InputError, match="has no design"):
        run_doe(Counted(), SPACE, np.empty((0, 3)), name="n", plan="p")


def coded(plan, n_variables, *arguments):
    """Return a plan as coded levels; the bounds lie at 1 and 5, so 3 is the middle."""
    names = tuple("abcdefghijklmnopqrst"[:n_variables])
    ends = np.ones(n_variables)
    space = DesignSpace(names, ("1",) * len(names), 3 * ends, ends, 5 * ends, 0 * ends)
    return (plan(space, *arguments) - 3.0) / 2.0


def test_plans_of_fixed_levels_are_those_of_the_textbooks():
    assert np.unique(coded(full_factorial, 3), axis=0).shape == (8, 3)
    half = coded(fractional_factorial, 4, "a b c abc")
    assert np.array_equal(half[:, 3], half[:, 0] * half[:, 1] * half[:, 2])
    assert np.array_equal(half.T @ half, 8 * np.eye(4))
    edges = coded(box_behnken, 3)
    assert len(edges) == 13
    assert np.array_equal(np.sort(np.count_nonzero(edges, axis=1)), [0] + [2] * 12)
    rotatable = coded(central_composite, 3)
    assert len(rotatable) == 8 + 6 + 1
    distance = np.linalg.norm(rotatable, axis=1)
    assert distance[:8] == pytest.approx(np.sqrt(3) / 8**0.25)
    assert distance[8:] == pytest.approx([1.0] * 6 + [0.0])
    assert coded(central_composite, 4, "a b c abc")[:8] * 8**0.25 == pytest.approx(half)


@pytest.mark.parametrize(
    ("plan", "arguments", "sentence"),
    [
        (full_factorial, (17,), "131,072 designs: take a fractional factorial"),
        (box_behnken, (2,), "at least 3 variables"),
        (fractional_factorial, (4, "a b ab -ab"), "not unique"),
        (fractional_factorial, (3, "a b ?"), "make no plan"),
        (fractional_factorial, (4, "a b ab"), "3 columns for 4 design variables"),
    ],
)
def test_a_plan_that_cannot_be_is_refused(plan, arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        coded(plan, *arguments)


def test_levels_between_whole_numbers_are_refused():
    ends = np.full(3, 2.0)
    space = DesignSpace(("a", "b", "c"), ("1",) * 3, 0 * ends, -ends, ends, 0 * ends, ends > 0)
    assert len(box_behnken(space)) == 13
    with pytest.raises(InputError, match="'a' takes whole numbers"):
        central_composite(space)
