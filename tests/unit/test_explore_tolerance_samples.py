"""Tolerance draws: repeatable, cut at three sigma, shared or fresh as they say."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.seeds import generator
from deboom.explore.tolerance_samples import (
    FreshGaussianSampler,
    ToleranceSample,
    gaussian_sample,
    sobol_sample,
)

DESIGN = np.linspace(0.8, 1.2, 5)


def samplers(seed=1, n_samples=64):
    return [
        sobol_sample(5, n_samples, seed=seed),
        gaussian_sample(5, n_samples, seed=seed),
        FreshGaussianSampler(5, n_samples, seed=seed),
    ]


@pytest.mark.parametrize("index", range(3))
def test_draws_repeat_under_one_seed_and_change_with_it(index):
    first, again, other = (samplers(seed)[index].normals(DESIGN) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.any(first == other)


@pytest.mark.parametrize("index", range(3))
def test_no_draw_leaves_three_sigma_and_none_piles_up_there(index):
    draws = samplers(n_samples=2**14)[index].normals(DESIGN)
    assert np.abs(draws).max() <= 3.0
    assert np.abs(draws).max() > 2.9
    assert np.mean(np.abs(draws) > 2.99) < 2e-4  # the distribution itself has 8e-5 there


def test_shared_draws_are_the_same_for_every_design_and_fresh_ones_are_not():
    sobol, gaussian, fresh = samplers()
    for shared in (sobol, gaussian):
        np.testing.assert_array_equal(shared.normals(DESIGN), shared.normals(DESIGN + 0.01))
    assert not np.any(fresh.normals(DESIGN) == fresh.normals(DESIGN + 0.01))


def test_fresh_draws_follow_from_the_design_alone():
    fresh = FreshGaussianSampler(2, 10, seed=3)
    alone = fresh.normals(np.array([0.0, 1.0]))
    fresh.normals(np.array([0.9, 1.0]))
    strided = np.array([[0.0, 7.0, 1.0, 7.0], [2.0, 7.0, 2.0, 7.0]])[0, ::2]
    np.testing.assert_array_equal(alone, fresh.normals(strided))
    np.testing.assert_array_equal(alone, fresh.normals(np.array([-0.0, 1.0])))


@pytest.mark.parametrize("n_samples", [100, 1000, 3])
def test_a_sobol_count_that_is_no_power_of_two_is_refused_with_the_neighbours(n_samples):
    lower = 2 ** int(np.log2(n_samples))
    with pytest.raises(InputError, match=f"take {lower} or {2 * lower}"):
        sobol_sample(5, n_samples, seed=1)


@pytest.mark.parametrize("seed", [0, -1, 1.5, True, None])
def test_a_seed_that_is_no_integer_from_one_is_refused(seed):
    for make in (sobol_sample, gaussian_sample, FreshGaussianSampler):
        with pytest.raises(InputError, match="seed"):
            make(5, seed=seed)


@pytest.mark.parametrize("make", [sobol_sample, gaussian_sample, FreshGaussianSampler])
def test_too_few_draws_or_variables_are_refused(make):
    with pytest.raises(InputError, match="at least 2 draws"):
        make(5, 1, seed=1)
    with pytest.raises(InputError, match="at least 1 variable"):
        make(0, seed=1)


@pytest.mark.parametrize("values", [np.zeros((1, 3)), np.zeros(3), np.full((4, 3), np.nan)])
def test_a_sample_of_ones_own_is_checked(values):
    with pytest.raises(InputError, match="tolerance sample"):
        ToleranceSample(values, "measured", seed=1)


def test_streams_of_different_purposes_share_nothing():
    search = sobol_sample(5, 128, seed=1).values
    verification = sobol_sample(5, 128, seed=1, purpose="verification sample").values
    assert not np.any(search == verification)
    assert generator(1, "a").random() != generator(1, "b").random()


def test_only_fresh_draws_come_with_a_warning():
    sobol, gaussian, fresh = samplers()
    assert sobol.warning == gaussian.warning == ""
    assert "13 to 18 %" in fresh.warning


def test_samples_say_what_they_are():
    kinds = [sampler.kind for sampler in samplers()]
    assert kinds == [
        "scrambled Sobol, shared",
        "gaussian, shared",
        "gaussian, fresh for every design",
    ]
    assert [(s.n_samples, s.n_variables, s.seed) for s in samplers()] == [(64, 5, 1)] * 3
