"""The design space refuses what an engineer would not mean, and names the variable."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space


def space() -> DesignSpace:
    return DesignSpace(
        names=("TSM x", "gap"),
        units=("1", "m"),
        nominal=np.array([1.0, 0.004]),
        lower=np.array([0.8, 0.002]),
        upper=np.array([1.2, 0.006]),
        tolerance=np.array([0.15, 0.0]),
    )


def test_tolerance_is_three_sigma_of_the_design_itself():
    np.testing.assert_allclose(space().relative_sigma, [0.05, 0.0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"lower": [1.3, 0.002]}, "'TSM x' has its bounds reversed"),
        ({"nominal": [1.0, 0.007]}, "'gap' has the nominal value 0.007 outside its bounds"),
        ({"names": ("gap", "gap")}, "'gap' appears 2 times"),
        ({"units": ("1", " ")}, "'gap' has no unit"),
        ({"tolerance": [-0.1, 0.0]}, "'TSM x' has the tolerance -0.1"),
        ({"tolerance": [0.0, 1.0]}, "'gap' has the tolerance 1"),
        ({"upper": [1.2, np.inf]}, "'gap' has .* not finite"),
        ({"nominal": [1.0]}, r"lower: shape \(1\) is needed, not \(2,\)"),
        ({"units": ("1",)}, "names 2 variables, but has 1 units"),
        ({"integer": [True, False]}, "'TSM x' takes whole numbers"),
        ({"integer": [False, True], "lower": [0.8, 0.0]}, "'gap' takes whole numbers"),
        (
            {"integer": [True, False], "lower": [0, 0], "upper": [2, 1], "names": ("part", "gap")},
            "'part' takes whole numbers",
        ),
    ],
)
def test_bad_spaces_are_refused_by_variable(change, words):
    with pytest.raises(InputError, match=words):
        replace(space(), **change)


def test_a_space_without_variables_is_refused():
    with pytest.raises(InputError, match="at least one variable"):
        DesignSpace((), (), *[np.empty(0)] * 4)


def test_stiffness_factors():
    assert ResponseFunction(np.square, ("a",), ("y",), "dB").design_space().lower == [0.8]
    factors = stiffness_factor_space(("a", "b", "c"))
    np.testing.assert_allclose(factors.lower, 0.8)
    np.testing.assert_allclose(factors.upper, 1.2)
    np.testing.assert_allclose(factors.nominal, 1.0)
    np.testing.assert_allclose(factors.relative_sigma, 0.05)
    assert factors.units == ("1", "1", "1")
    one_sigma = stiffness_factor_space(("a",), tolerance=0.45)
    np.testing.assert_allclose(one_sigma.relative_sigma, 0.15)


def test_a_half_width_that_reaches_zero_stiffness_is_refused():
    with pytest.raises(InputError, match="half width"):
        stiffness_factor_space(("a",), half_width=1.0)


@pytest.mark.parametrize(
    ("designs", "words"),
    [
        (np.ones(2), r"shape \(2,\)"),
        (np.ones((3, 1)), "2 columns"),
        (np.array([[1.0, 0.004], [1.0, np.nan]]), "design 1: gap is nan"),
    ],
)
def test_designs_of_another_shape_or_not_finite_are_refused(designs, words):
    with pytest.raises(InputError, match=words):
        space().checked(designs)
