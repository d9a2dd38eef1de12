"""Manufacturing scatter: draws, structures and part numbers."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.front import verification_response
from deboom.explore.moments import Estimator
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import (
    FreshGaussianSampler,
    PartNumber,
    ToleranceSample,
    ToleranceStructure,
    cut_normal_moments,
    gaussian_sample,
    part_structure,
    sobol_sample,
)
from deboom.explore.space import ResponseFunction, generator, stiffness_factor_space

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


@pytest.mark.parametrize("make", [sobol_sample, gaussian_sample, FreshGaussianSampler])
def test_draws_that_cannot_be_are_refused(make):
    for seed in (0, -1, 1.5, True, None):
        with pytest.raises(InputError, match="seed"):
            make(5, seed=seed)
    with pytest.raises(InputError, match="at least 2 draws"):
        make(5, 1, seed=1)
    with pytest.raises(InputError, match="at least 1 variable"):
        make(0, seed=1)


def test_streams_of_different_purposes_share_nothing():
    search = sobol_sample(5, 128, seed=1).values
    verification = sobol_sample(5, 128, seed=1, purpose="verification sample").values
    assert not np.any(search == verification)
    assert generator(1, "a").random() != generator(1, "b").random()


NAMES = ("EnM x", "EnM z", "GeM x", "GeM z")


def batches(rho):
    """Two mounts whose axes share a batch and scatter on their own besides."""
    shared = np.kron(np.eye(2), [[1.0], [1.0]])
    loadings = np.hstack([np.sqrt(1.0 - rho) * np.eye(4), np.sqrt(rho) * shared])
    return ToleranceStructure(NAMES, loadings, (*NAMES, "batch EnM", "batch GeM"))


def sum_of_all(designs):
    return designs.sum(axis=1, keepdims=True)


def test_structures_that_do_not_fit_are_refused():
    structure = batches(0.5)
    space = stiffness_factor_space(NAMES)
    model = ResponseFunction(sum_of_all, NAMES, ("y",), "1")
    with pytest.raises(InputError, match="4 columns for 6 draws"):
        RobustResponse(model, space, sobol_sample(4, seed=1), structure=structure)
    wide = replace(space, tolerance=np.full(4, 0.75))
    with pytest.raises(InputError, match="could change its sign"):
        RobustResponse(model, wide, sobol_sample(6, seed=1), structure=structure)
    other = ToleranceStructure(tuple("abcd"), np.eye(4), tuple("abcd"))
    with pytest.raises(InputError, match="same names in the same order"):
        RobustResponse(model, space, sobol_sample(4, seed=1), structure=other)


SIX = tuple(f"{mount} {axis}" for mount in ("EnM", "GeM", "Du") for axis in "xz")
H, B = 0.6, 0.3
PARTS = (
    PartNumber("bush", ("EnM", "GeM"), 1, H, B),
    PartNumber("wishbone bush", ("Du",), 2, H, B),
)


def covariance(structure):
    return structure.loadings @ structure.loadings.T


def stated():
    """Correlation by hand: axes h, pieces of a batch b; left and right even out."""
    axes = np.array([[1.0, H], [H, 1.0]])
    two_places = np.array([[1.0, B], [B, 1.0]])
    found = np.zeros((6, 6))
    found[:4, :4] = np.kron(two_places, axes)
    found[4:, 4:] = (B + (1.0 - B) / 2.0) * axes
    return found


def test_covariance_is_that_of_the_hand_calculation():
    np.testing.assert_allclose(covariance(part_structure(SIX, PARTS)), stated(), atol=1e-12)


def test_sigma_of_a_linear_response_is_the_closed_form():
    structure = part_structure(SIX, PARTS)
    slope = np.array([1.0, -2.0, 0.5, 3.0, 2.0, -1.0])
    space = replace(stiffness_factor_space(SIX), tolerance=np.linspace(0.06, 0.18, 6))
    robust = RobustResponse(
        ResponseFunction(lambda designs: (designs @ slope)[:, None], SIX, ("level",), "dB"),
        space,
        sobol_sample(structure.n_draws, 128, seed=1),
        structure=structure,
        estimator=Estimator(1),
    )
    design = np.linspace(0.8, 1.2, 6)
    pull = slope * design * space.relative_sigma
    exact = np.sqrt(cut_normal_moments()[0] * pull @ stated() @ pull)
    assert robust(design[None]).sigma_sum[0] == pytest.approx(exact, rel=1e-9)
    # the verification draws as many columns as the structure has
    check = verification_response(robust, 256, seed=1)
    assert check.sample.n_variables == structure.n_draws == robust.n_draws
    assert check(design[None]).sigma_sum[0] == pytest.approx(exact, rel=1e-9)


def test_parts_without_anything_in_common_are_independent():
    structure = part_structure(SIX, ())
    assert structure.draw_names == SIX
    np.testing.assert_array_equal(structure.loadings, np.eye(6))


def test_the_batch_of_a_single_piece_adds_no_draw():
    alone = part_structure(SIX[:2], (PartNumber("bush", ("EnM",), 1, H, B),))
    assert alone.n_draws == 3
    np.testing.assert_allclose(covariance(alone), [[1.0, H], [H, 1.0]], atol=1e-12)


@pytest.mark.parametrize(("h", "b"), [(0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
def test_shares_at_their_ends(h, b):
    structure = part_structure(SIX[:4], (PartNumber("bush", ("EnM", "GeM"), 1, h, b),))
    expected = np.kron([[1.0, b], [b, 1.0]], [[1.0, h], [h, 1.0]])
    np.testing.assert_allclose(covariance(structure), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sobol_sample(5, 100, seed=1), "take 64 or 128"),
        (lambda: sobol_sample(5, 3, seed=1), "take 2 or 4"),
        (lambda: ToleranceSample(np.zeros((1, 3)), "measured", seed=1), "tolerance sample"),
        (lambda: ToleranceSample(np.zeros(3), "measured", seed=1), "ToleranceSample"),
        (lambda: ToleranceSample(np.full((4, 3), np.nan), "measured", seed=1), "ToleranceSample"),
        (lambda: ToleranceStructure(NAMES, np.eye(4) * np.nan, NAMES), "loadings: a number is not"),
        (lambda: part_structure(SIX, (PartNumber("a", ("TSM",)),)), "sits at 'TSM', which no"),
        (
            lambda: part_structure(SIX, (PartNumber("a", ("Du",)), PartNumber("b", ("Du",)))),
            "takes the part numbers 'a' and 'b': give it one",
        ),
    ],
)
def test_what_cannot_be_made_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
