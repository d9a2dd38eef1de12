"""SALib's methods: what is refused, and what is left as it was."""

import warnings

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.sensitivity import (
    SensitivityInputs,
    design_inputs,
    fast_sobol_indices,
    morris_analysis,
    morris_designs,
    sobol_designs,
    sobol_indices,
    tolerance_inputs,
)
from deboom.explore.space import DesignSpace, stiffness_factor_space
from known_indices import SobolG

G = SobolG((0.0, 1.0, 9.0))
DESIGNS = sobol_designs(G.inputs, 16, seed=1)
VALUES = np.hstack([G(DESIGNS), -G(DESIGNS)])
OUTPUTS = ("sedan", "tourer")
PATHS = morris_designs(G.inputs, 8, seed=1)


@pytest.mark.parametrize("analyse", [sobol_indices, fast_sobol_indices])
def test_bad_responses_are_refused_by_name_and_number(analyse):
    broken = VALUES.copy()
    broken[17, 1] = np.nan
    with pytest.raises(InputError, match="design 17 has no finite tourer, and 1 of 80 designs"):
        analyse(broken, G.inputs.names, OUTPUTS, seed=1)
    constant = VALUES * [1.0, 0.0] - 7.0
    with pytest.raises(InputError, match="no variation over the designs in output 'tourer'"):
        analyse(constant, G.inputs.names, OUTPUTS, seed=1)
    with pytest.raises(InputError, match="a multiple of 5 rows"):
        analyse(VALUES[:-1], G.inputs.names, OUTPUTS, seed=1)
    with pytest.raises(InputError, match=r"12 base points .* take 8 or 16"):
        analyse(VALUES[:60], G.inputs.names, OUTPUTS, seed=1)
    with pytest.raises(InputError, match="seed 0 is not an integer from 1 upwards"):
        analyse(VALUES, G.inputs.names, OUTPUTS, seed=0)
    with pytest.raises(InputError, match="1 resamples cannot give an interval"):
        analyse(VALUES, G.inputs.names, OUTPUTS, seed=1, n_resamples=1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: sobol_indices(np.full((64, 5), 0.1 * 3.0), ["x"] * 6, "abcde", seed=1),
            "in output 'a', 'b', 'c' and 2 more: there is no variance",
        ),
        (
            lambda: sobol_indices(VALUES[:, :1] * 1e-14 + 60.0, G.inputs.names, ["y"], seed=1),
            "no variation",  # rounding is none
        ),
        *(
            (lambda n=n: sobol_designs(G.inputs, n, seed=1), f"{n} base points .* not a power of")
            for n in (0, 1, 4, 12, 100)
        ),
        (lambda: sobol_designs(G.inputs, 8, seed=0), "seed 0"),
        (lambda: morris_designs(G.inputs, 8, seed=0), "seed 0"),
        (lambda: morris_designs(G.inputs, 1, seed=1), "take at least 2"),
        (lambda: morris_analysis(G.inputs, PATHS, G(PATHS), ["y"], seed=0), "seed 0"),
        (
            lambda: morris_analysis(G.inputs, PATHS[:, :2], G(PATHS), ["y"], seed=1),
            "bring the designs that gave the responses",
        ),
        (lambda: design_inputs(stiffness_factor_space(["T x"], 0.0)), "'T x' does not vary"),
        (
            lambda: tolerance_inputs(stiffness_factor_space(["T x"], 0.2, 0.0)),
            "'T x' does not vary",
        ),
    ],
)
def test_what_cannot_be_analysed_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_the_global_state_and_the_inputs_stay_as_they_were():
    np.random.seed(4)  # noqa: NPY002
    before, layout, filters = np.random.get_state()[1], warnings.formatwarning, warnings.filters[:]  # noqa: NPY002
    sobol_indices(VALUES, G.inputs.names, OUTPUTS, seed=1, n_resamples=4)
    morris_analysis(G.inputs, PATHS, G(PATHS), ["y"], seed=1)
    assert np.array_equal(np.random.get_state()[1], before)  # noqa: NPY002
    assert warnings.formatwarning is layout
    assert warnings.filters == filters


def test_the_same_seed_gives_the_same_bits_and_more_points_begin_alike():
    assert np.array_equal(sobol_designs(G.inputs, 16, seed=1), DESIGNS)
    assert np.array_equal(sobol_designs(G.inputs, 64, seed=1)[: len(DESIGNS)], DESIGNS)
    assert not np.array_equal(sobol_designs(G.inputs, 16, seed=2), DESIGNS)
    one, two = (sobol_indices(VALUES, G.inputs.names, OUTPUTS, seed=3) for _ in range(2))
    assert np.array_equal(one.total_interval, two.total_interval)
    alone = sobol_indices(VALUES[:, :1], G.inputs.names, OUTPUTS[:1], seed=3)
    assert np.array_equal(alone.total[:, 0], one.total[:, 0])


def test_groups_are_factors_in_the_order_they_appear():
    inputs = G.inputs.grouped(["late", "early", "late"])
    assert inputs.factors == ("late", "early")
    assert len(sobol_designs(inputs, 8, seed=1)) == 8 * 4
    paths = morris_designs(inputs, 8, seed=1)
    effects = morris_analysis(inputs, paths, G(paths), ["y"], seed=1)
    assert effects.factors == ("late", "early")
    assert np.isnan(effects.sigma[0, 0])
    assert np.isfinite(effects.sigma[1, 0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"groups": ("a", "a", "a")}, "all variables are in the group 'a'"),
        ({"upper": np.array([1.0, 0.0, 1.0])}, "variable 'x2' does not vary"),
        ({"sigma": np.array([1.0, 1.0, 0.0])}, "variable 'x3' does not vary"),
        ({"sigma": np.array([1.0, 1.0])}, r"sigma: shape \(3\) is needed, not \(2,\)"),
        ({"lower": np.array([0.0, np.nan, 0.0])}, "lower: a number is not finite"),
    ],
)
def test_inputs_that_cannot_be_analysed_are_refused(change, message):
    good = {"names": ("x1", "x2", "x3"), "lower": np.zeros(3), "upper": np.ones(3)}
    with pytest.raises(InputError, match=message):
        SensitivityInputs(**{**good, **change})


def test_named_analyses_say_what_varies():
    space = stiffness_factor_space(["TSM x", "GeM x"], 0.15, 0.12)
    assert design_inputs(space).description == "uniform from 0.85 to 1.15"
    scatter = tolerance_inputs(space)
    assert scatter.description == "gaussian, cut at ±3 σ, from 0.88 to 1.12"
    assert scatter.sigma == pytest.approx([0.04, 0.04])
    below = DesignSpace(("z",), ("m",), *np.array([[-2.0], [-3.0], [-1.0], [0.05]]))
    assert tolerance_inputs(below).lower == pytest.approx([-2.1])


def test_an_index_within_its_interval_is_zero():
    random = np.random.default_rng(2)
    noise = np.hstack([G(DESIGNS) + 1e-3 * random.normal(size=(80, 1))])
    found = sobol_indices(VALUES, G.inputs.names, OUTPUTS, seed=1)
    assert not found.zero[:2].any()
    inert = sobol_indices(DESIGNS[:, :1], G.inputs.names, ["y"], seed=1)
    assert inert.zero[:, 0].tolist() == [False, True, True]
    assert inert.total[1:, 0].tolist() == [0.0, 0.0]
    assert sobol_indices(noise, G.inputs.names, ["y"], seed=1).total[0, 0] != found.total[0, 0]
