"""SALib's methods: what is refused, and what is left as it was."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import deboom
from deboom.errors import InputError
from deboom.explore import sensitivity
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
from deboom.explore.space import DesignSpace, ResponseFunction, stiffness_factor_space
from samples.known_indices import SobolG

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
    first, second = (sobol_indices(VALUES, G.inputs.names, OUTPUTS, seed=3) for _ in range(2))
    assert np.array_equal(first.total_interval, second.total_interval)
    alone = sobol_indices(VALUES[:, :1], G.inputs.names, OUTPUTS[:1], seed=3)
    assert np.array_equal(alone.total[:, 0], first.total[:, 0])


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
    indices = sobol_indices(VALUES, G.inputs.names, OUTPUTS, seed=1)
    assert not indices.zero[:2].any()
    inert = sobol_indices(DESIGNS[:, :1], G.inputs.names, ["y"], seed=1)
    assert inert.zero[:, 0].tolist() == [False, True, True]
    assert inert.total[1:, 0].tolist() == [0.0, 0.0]
    assert sobol_indices(noise, G.inputs.names, ["y"], seed=1).total[0, 0] != indices.total[0, 0]


ISHIGAMI = ResponseFunction(
    lambda x: (np.sin(x[:, :1]) + 7.0 * np.sin(x[:, 1:2]) ** 2
               + 0.1 * x[:, 2:] ** 4 * np.sin(x[:, :1])),
    ("x1", "x2", "x3"), ("y",), "1",
)  # fmt: skip
CUBE = DesignSpace(
    ISHIGAMI.variable_names, ("1",) * 3, *np.array([[0.0], [-np.pi], [np.pi], [0.0]]) * np.ones(3)
)


def test_second_order_indices_and_groups_of_the_ishigami_function():
    indices = deboom.sobol(ISHIGAMI, CUBE, n=4096, second_order=True)
    pairs = indices.pair_table.set_index(["variable", "with"])["second [1]"]
    assert pairs["x1", "x3"] == pytest.approx(0.2437, abs=0.02)
    assert abs(pairs["x1", "x2"]) < 0.02
    assert indices.table["first [1]"].tolist() == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    assert indices.problem["names"] == ["x1", "x2", "x3"]
    grouped = deboom.sobol(ISHIGAMI, CUBE, n=4096, groups={"both": ["x1", "x3"]}).table
    assert grouped.set_index("variable")["total [1]"].to_dict() == pytest.approx(
        {"both": 0.5576, "x2": 0.4424}, abs=0.02
    )
    with pytest.raises(InputError, match="second_order=True"):
        _ = deboom.sobol(ISHIGAMI, CUBE, n=8).pair_table


def test_distributions_by_input_and_the_sum_of_responses():
    add = ResponseFunction(lambda x: np.hstack([x, 2.0 * x]), ("a", "b"), ("a", "b", "c", "d"), "1")
    space = add.design_space()
    inputs = {"a": ("norm", 1.0, 0.3), "b": ("triang", 0.8, 1.2, 0.5)}
    table = deboom.sobol(add, space, n=1024, inputs=inputs).table
    of_sum = table[table["response"] == sensitivity.SUM].set_index("variable")["first [1]"]
    variance = {"a": 0.09, "b": 0.4**2 / 24.0}
    shares = {name: value / sum(variance.values()) for name, value in variance.items()}
    assert of_sum.to_dict() == pytest.approx(shares, abs=0.02)
    three = ResponseFunction(lambda x: x.sum(axis=1), ("a", "b", "c"), ("y",), "1")
    effects = deboom.morris(three, three.design_space(), groups={"both": ["a", "b"]}).table
    # members of a group step up or down: together they move the sum by 0.8 or not at all
    both, alone = effects["mu* [1]"]
    assert (0.2 < both < 0.6, round(alone, 6)) == (True, 0.4)
    assert effects["sigma [1]"].isna().tolist() == [True, False]


def test_effects_of_a_distribution_without_ends_are_those_within_three_sigma():
    """Levels 0, 1/3, 2/3 and 1: a step of two of them over σ (Φ⁻¹(2/3) + 3) and 2/3."""
    two = ResponseFunction(lambda x: np.c_[x, 3.0 * x], ("a", "b"), ("a", "b", "c", "d"), "dB")
    inputs = {"a": ("norm", 1.0, 0.05), "b": ("lognorm", 0.0, 0.1)}
    effects = deboom.morris(two, two.design_space(), inputs=inputs)
    assert effects.problem["names"] == ["a", "b"]
    assert effects.problem["bounds"] == [[1.0, 0.05], [0.0, 0.1]]
    reach, inner = 3.0, norm.ppf(2.0 / 3.0)
    table = effects.table.set_index(["variable", "response"])["mu* [dB]"]
    step = 0.05 * (reach + inner) / (2.0 / 3.0)
    assert table["a"].to_dict() == pytest.approx(
        {"a": step, "b": 0.0, "c": 3.0 * step, "d": 0.0, sensitivity.SUM: 4.0 * step}, abs=1e-12
    )
    ends = np.exp(0.1 * np.array([[inner, -reach], [reach, -inner]])) @ [1.0, -1.0] / (2.0 / 3.0)
    assert ends.min() < table["b", "b"] < ends.max()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"groups": {"g": ["x9"]}}, "no variable 'x9'"),
        ({"groups": {"g": ["x1"], "h": ["x1"]}}, "in the groups 'g' and 'h'"),
        ({"groups": {"g": ["x1", "x2", "x3"]}}, "nothing to compare"),
        ({"inputs": {"x9": ("unif", 0, 1)}}, "no variable 'x9'"),
        ({"inputs": {"x1": ("cauchy", 0, 1)}}, "choose one of"),
        ({"inputs": {"x1": ("norm", 0, -1)}}, "stdev must be > 0"),
    ],
)
def test_groups_and_distributions_that_cannot_be_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        deboom.sobol(ISHIGAMI, CUBE, n=8, **arguments)


def test_counts_failures_and_fixed_variables_of_a_notebook():
    model = ResponseFunction(lambda x: x @ [[1.0], [2.0], [4.0]], tuple("abc"), ("y",), "dB")
    space = model.design_space()
    for explore, count, item in (
        (lambda n: deboom.sobol(model, space, n=n), "256", "n, the base points"),
        (lambda n: deboom.sobol(model, space, n=8, resamples=n), 10.5, "resamples"),
        (lambda n: deboom.morris(model, space, trajectories=n), 2.5, "trajectories"),
        (lambda n: deboom.doe(model, space, n=n), "256", "n, the number of designs"),
    ):
        with pytest.raises(InputError, match=f"{item}: {count!r} is not a whole number"):
            explore(count)
    whole, real = (deboom.sobol(model, space, n=n).table for n in (256, 256.0))
    assert whole.equals(real)

    def light(designs):
        if np.any(designs[:, 0] > 1.1):
            raise ZeroDivisionError("mass is zero in car 3")
        return designs[:, :1]

    for explore in (deboom.sobol, deboom.morris):
        with pytest.raises(InputError, match=r"mass is zero in car 3', .* \(a 1\.[12]"):
            explore(ResponseFunction(light, tuple("abc"), ("y",), "dB"), space)

    fixed = replace(space, lower=[0.8, 1.0, 0.8], upper=[1.2, 1.0, 1.2])
    for explore in (deboom.sobol, deboom.morris):
        result = explore(model, fixed)
        assert result.fixed == ("b",)
        assert list(result.table["variable"]) == ["a", "c"]
    assert deboom.sobol(model, fixed).table["total [1]"].round(2).tolist() == [0.06, 0.94]
    assert deboom.sobol(model, fixed, inputs={"b": ("unif", 0.8, 1.2)}).fixed == ()
    still = replace(space, lower=np.ones(3), upper=np.ones(3))
    with pytest.raises(InputError, match="no variable varies"):
        deboom.sobol(model, still)
