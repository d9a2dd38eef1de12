"""Sobol indices against closed forms, against SALib, and on the virtual test bench."""

import numpy as np
import pytest

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
from deboom.explore.space import stiffness_factor_space
from known_indices import Ishigami, SobolG


def analysed(inputs, model, n_base, seed=1, **options):
    values = model(sobol_designs(inputs, n_base, seed=seed))
    names = [f"y{place}" for place in range(values.shape[1])]
    return fast_sobol_indices(values, inputs.factors, names, seed=seed, **options)


@pytest.mark.parametrize("model", [Ishigami(), SobolG()], ids=["Ishigami", "Sobol G"])
def test_indices_reach_the_closed_form(model):
    found, exact = analysed(model.inputs, model, 4096), model.exact
    assert found.first[:, 0] == pytest.approx(exact.first, abs=0.005)
    assert found.total[:, 0] == pytest.approx(exact.total, abs=0.005)
    assert np.all(np.abs(found.total[:, 0] - exact.total) <= found.total_interval[:, 0])


def test_ishigami_as_published():
    exact = Ishigami().exact  # Saltelli et al., "Global Sensitivity Analysis. The Primer", 2008
    assert exact.first == pytest.approx([0.3139, 0.4424, 0.0], abs=5e-5)
    assert exact.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=5e-5)


def test_groups_reach_the_closed_form():
    model = SobolG((0.0, 0.5, 3.0, 9.0))
    inputs = model.inputs.grouped(["a", "a", "b", "b"])
    alone = 1.0 / (3.0 * (1.0 + np.array(model.a)) ** 2)
    both = np.array([np.prod(1.0 + alone[:2]), np.prod(1.0 + alone[2:])]) - 1.0
    variance = np.prod(1.0 + both) - 1.0
    found = analysed(inputs, model, 4096)
    assert found.factors == ("a", "b")
    assert found.first[:, 0] == pytest.approx(both / variance, abs=0.01)


def test_both_named_analyses_weigh_a_sum_by_its_variances():
    weights, space = np.array([1.0, 2.0, 3.0]), stiffness_factor_space(["a", "b", "c"], 0.15, 0.30)
    for inputs in (design_inputs(space), tolerance_inputs(space)):
        designs = sobol_designs(inputs, 1024, seed=3)
        assert designs.min() >= inputs.lower.min()
        assert designs.max() <= inputs.upper.max()
        found = analysed(inputs, lambda x: x @ weights[:, None], 1024, seed=3)
        share = weights**2 / (weights**2).sum()
        assert found.total[:, 0] == pytest.approx(share, abs=0.002)
        assert found.first[:, 0] == pytest.approx(share, abs=0.005)
    drawn = designs[::5]  # gaussian, σ = 0.1, cut at ±3 σ
    assert drawn.std(axis=0) == pytest.approx([0.0986578] * 3, rel=2e-3)
    assert np.abs(drawn - 1.0).max() <= 0.3


def test_every_number_is_salibs():
    random = np.random.default_rng(7)
    inputs = SensitivityInputs(tuple("abcde"), np.zeros(5), np.ones(5))
    designs = sobol_designs(inputs, 128, seed=5)
    weights = random.normal(size=(5, 20))
    values = 1e3 + np.exp(designs @ weights) + (designs[:, :1] - 0.5) * designs[:, 1:2] ** 2
    names = [f"y{place}" for place in range(20)]
    own, salib = (
        analyse(values, inputs.names, names, seed=9, n_resamples=30)
        for analyse in (fast_sobol_indices, sobol_indices)
    )
    for name in ("first", "total", "interaction"):
        for kind in (name, f"{name}_interval"):
            np.testing.assert_allclose(
                getattr(own, kind), getattr(salib, kind), rtol=1e-9, atol=1e-12
            )


def test_elementary_effects_of_ishigami():
    model, inputs = Ishigami(), Ishigami().inputs
    paths = morris_designs(inputs, 100, seed=1)
    morris = morris_analysis(inputs, paths, model(paths), ["y"], seed=1)
    # x2 alone is symmetric: its effects cancel in the mean and not in their size; four levels of x2
    # from -π to π give sin² 0 or 3/4, hence effects of ±7·3/4 over a step of 2/3
    assert morris.mu_star[1, 0] == pytest.approx(7.0 * 0.75 * 1.5)
    assert abs(morris.mu[1, 0]) < 0.5 * morris.mu_star[1, 0]
