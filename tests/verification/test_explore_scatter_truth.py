"""Scatter per variable, relative or absolute, of any distribution, against closed forms."""

import numpy as np
import pytest
from scipy.special import ndtr

import deboom
from deboom.errors import InputError
from deboom.explore.correlation import tolerance_scatter
from deboom.explore.scatter import PartNumber, cut_normal_moments, part_structure
from deboom.explore.sensitivity import tolerance_inputs

SECOND, FOURTH = cut_normal_moments()
INSIDE = 1.0 - 2.0 * ndtr(-3.0)
DRAWS = 65536
"""As many as it takes for tails that are not cut, which hold much of the fourth moment."""


def space(value, tolerance, distribution="normal", *, absolute=True):
    return deboom.DesignSpace(
        names=("offset",),
        units=("mm",),
        nominal=[value],
        lower=[value - 5.0],
        upper=[value + 5.0],
        tolerance=[tolerance],
        absolute=[absolute],
        distribution=(distribution,),
    )


def robust(function, of_space, **changes):
    model = deboom.ResponseFunction(function, of_space.names, ("y",), "dB")
    return deboom.Robust(model, of_space, draws=DRAWS, **changes)


def exponential(rate):
    """Return the mean of ``exp(rate z)`` under a standard normal draw cut at ±3."""
    return np.exp(rate**2 / 2.0) * (ndtr(3.0 - rate) - ndtr(-3.0 - rate)) / INSIDE


@pytest.mark.parametrize("value", [0.0, 2.0])
@pytest.mark.parametrize(
    ("distribution", "variance", "fourth"),
    [
        ("normal", SECOND, FOURTH),
        ("normal-uncut", 1.0, 3.0),
        # within ±3: third and fifth of the powers of the half width
        ("uniform", 3.0, 81.0 / 5.0),
    ],
)
def test_absolute_tolerances_of_a_line_and_a_parabola(value, distribution, variance, fourth):
    sigma = 0.4
    made = space(value, 3.0 * sigma, distribution)
    line = robust(lambda x: 2.0 * x, made)([[value]])
    assert line.mean[0, 0] == pytest.approx(2.0 * value, abs=1e-5)
    assert line.sigma[0, 0] == pytest.approx(2.0 * sigma * np.sqrt(variance), rel=1e-4)
    parabola = robust(np.square, made)([[value]])
    spread = 4.0 * value**2 * variance * sigma**2 + (fourth - variance**2) * sigma**4
    assert parabola.mean[0, 0] == pytest.approx(value**2 + variance * sigma**2, rel=1e-4)
    assert parabola.sigma[0, 0] == pytest.approx(np.sqrt(spread), rel=1e-3)


@pytest.mark.parametrize("distribution", ["lognormal", "lognormal-uncut"])
def test_a_lognormal_line_and_parabola(distribution):
    value, sigma = 2.0, 0.3
    made = space(value, 3.0 * sigma, distribution, absolute=False)

    def moment(power):
        rate = power * sigma
        mean = exponential(rate) if distribution == "lognormal" else np.exp(rate**2 / 2.0)
        return value**power * mean

    for power in (1, 2):
        values = robust(lambda x, power=power: x**power, made)([[value]])
        spread = np.sqrt(moment(2 * power) - moment(power) ** 2)
        assert values.mean[0, 0] == pytest.approx(moment(power), rel=1e-4)
        assert values.sigma[0, 0] == pytest.approx(spread, rel=1e-3)


def test_a_relative_uniform_tolerance_grows_with_the_value():
    made = space(2.0, 0.3, "uniform", absolute=False)
    sigma = robust(lambda x: x, made)([[1.0], [4.0]]).sigma[:, 0]
    np.testing.assert_allclose(sigma, np.array([1.0, 4.0]) * 0.3 / np.sqrt(3.0), rtol=1e-4)


def test_no_part_lies_beyond_a_tolerance_that_is_cut():
    for distribution in ("normal", "uniform"):
        made = robust(np.square, space(0.0, 3.0, distribution)).made(np.zeros(1))
        assert 2.9 < np.abs(made).max() <= 3.0 + 1e-12
    beyond = np.abs(robust(np.square, space(0.0, 3.0, "normal-uncut")).made(np.zeros(1))) > 3.0
    assert beyond.mean() == pytest.approx(2.0 * ndtr(-3.0), abs=5e-5)


def test_the_best_sigma_does_not_hide_at_an_offset_of_zero():
    """Of ``y = (x - 1)²/10 + x`` sigma vanishes where the slope does, at -4, not at 0."""
    made = space(0.0, 0.3)
    relative = deboom.DesignSpace(("offset",), ("mm",), [0.0], [-5.0], [5.0], [0.3])

    def best_sigma(of_space):
        model = deboom.ResponseFunction(
            lambda x: (x - 1.0) ** 2 / 10.0 + x, ("offset",), ("y",), "dB"
        )
        front = deboom.search(deboom.Robust(model, of_space), population=12, generations=12)
        return front.pick_designs["best-sigma"][0], front.values.sigma_sum.min()

    place, sigma = best_sigma(made)
    assert place == pytest.approx(-4.0, abs=0.05)
    # of a parabola at its vertex only its curvature is left
    assert sigma == pytest.approx(0.1 * 0.01 * np.sqrt(FOURTH - SECOND**2), rel=0.05)
    assert best_sigma(relative)[0] == pytest.approx(0.0, abs=0.05)


def test_variables_that_scatter_together_are_joined_by_the_gaussian_copula():
    """Two uniform variables whose draws correlate by h correlate by ``6/π asin(h/2)``."""
    share = 0.6
    names = ("TSM x", "TSM z")
    structure = part_structure(names, [PartNumber("TSM", ("TSM",), hardness_share=share)])
    made = deboom.DesignSpace(
        names=names,
        units=("1", "1"),
        nominal=[1.0, 1.0],
        lower=[0.8, 0.8],
        upper=[1.2, 1.2],
        tolerance=[0.15, 0.15],
        distribution=("uniform", "uniform"),
    )
    model = deboom.ResponseFunction(lambda x: x, names, names, "dB")
    parts = deboom.Robust(model, made, structure=structure, draws=16384).made(np.ones(2))
    correlation = np.corrcoef(parts.T)[0, 1]
    assert correlation == pytest.approx(6.0 / np.pi * np.arcsin(share / 2.0), abs=0.01)
    assert parts.std(axis=0) == pytest.approx(0.15 / np.sqrt(3.0), rel=0.01)


def test_the_mean_of_several_pieces_is_normal_only():
    names = ("Du x",)
    structure = part_structure(names, [PartNumber("bush", ("Du",), pieces=2)])
    made = deboom.DesignSpace(names, ("1",), [1.0], [0.8], [1.2], [0.15], distribution=("uniform",))
    model = deboom.ResponseFunction(np.square, names, ("y",), "dB")
    with pytest.raises(InputError, match="'Du x' is the mean of several pieces"):
        deboom.Robust(model, made, structure=structure)


def test_correlation_and_sensitivity_scatter_alike():
    made = space(0.0, 3.0, "uniform")
    model = deboom.ResponseFunction(lambda x: np.hstack([x, -x]), ("offset",), ("y", "z"), "dB")
    _, scatter = tolerance_scatter(model, made, np.zeros((1, 1)), n_draws=1024, seed=1)
    assert scatter[0, :, 0].std() == pytest.approx(np.sqrt(3.0), rel=1e-2)
    inputs = tolerance_inputs(made)
    assert inputs.stated == {"offset": ("unif", -3.0, 3.0)}
    assert tolerance_inputs(space(2.0, 3.0)).sigma.tolist() == [1.0]
    with pytest.raises(InputError, match="lognormal-uncut"):
        tolerance_inputs(space(2.0, 0.3, "lognormal", absolute=False))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"tolerance": 0.6, "distribution": "normal-uncut"}, "but not including 0.476"),
        ({"tolerance": 1.0}, "but not including 1"),
        ({"tolerance": -1.0, "absolute": True}, "has the tolerance -1"),
        ({"tolerance": 0.3, "distribution": "lognormal", "absolute": True}, "by its logarithm"),
        ({"tolerance": 0.3, "distribution": "triangular"}, "give each variable one of normal,"),
    ],
)
def test_scatter_that_cannot_be_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        space(2.0, **{"absolute": False, **changes})
