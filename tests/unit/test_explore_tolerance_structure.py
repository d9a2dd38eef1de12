"""Parts that have something in common scatter together."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.design_space import stiffness_factor_space
from deboom.explore.evaluate import ResponseFunction
from deboom.explore.moments import ControlVariate
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_samples import cut_normal_moments, sobol_sample
from deboom.explore.tolerance_structure import (
    ToleranceStructure,
    batches,
    correlated,
    shared_parts,
)

NAMES = ("EnM x", "EnM z", "GeM x", "GeM z")
MOUNTS = {"EnM": NAMES[:2], "GeM": NAMES[2:]}


def correlation_of(structure):
    return structure.loadings @ structure.loadings.T


def test_shared_parts_scatter_as_one():
    structure = shared_parts(NAMES, {"bush": ("EnM x", "GeM x")})
    assert structure.draw_names == ("part bush", "EnM z", "GeM z")
    draws = sobol_sample(3, 64, seed=1).values
    scatter = structure.scatter(draws)
    np.testing.assert_array_equal(scatter[:, 0], scatter[:, 2])
    np.testing.assert_array_equal(scatter[:, [0, 1, 3]], draws)


def test_a_part_may_be_called_like_a_variable():
    structure = shared_parts(NAMES, {"EnM x": ("EnM z", "GeM x")})
    np.testing.assert_array_equal(
        correlation_of(structure), [[1, 0, 0, 0], [0, 1, 1, 0], [0, 1, 1, 0], [0, 0, 0, 1]]
    )


def test_axes_of_a_mount_share_a_batch():
    structure = batches(NAMES, MOUNTS, 0.8)
    expected = np.kron(np.eye(2), [[1.0, 0.8], [0.8, 1.0]])
    np.testing.assert_allclose(correlation_of(structure), expected, atol=1e-12)
    assert structure.draw_names == (*NAMES, "batch EnM", "batch GeM")
    alone = batches(NAMES, {"EnM": NAMES[:2]}, 1.0)
    np.testing.assert_allclose(
        correlation_of(alone), [[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], atol=1e-12
    )


@pytest.mark.parametrize("rho", [-0.9, 0.0, 0.6, 1.0])
def test_any_correlation_matrix(rho):
    matrix = np.eye(4)
    matrix[0, 3] = matrix[3, 0] = rho
    structure = correlated(NAMES, matrix)
    np.testing.assert_allclose(correlation_of(structure), matrix, atol=1e-12)
    assert structure.n_draws == 4


def sum_of_all(designs):
    return designs.sum(axis=1, keepdims=True)


@pytest.mark.parametrize(("rho", "variance"), [(0.0, 4.0), (0.5, 6.0), (1.0, 8.0)])
def test_sigma_of_a_sum_is_the_textbooks(rho, variance):
    """Var of the sum of two pairs: 4 + 4 rho, times the variance of a draw."""
    structure = batches(NAMES, MOUNTS, rho)
    model = ResponseFunction(sum_of_all, NAMES, ("y",), "1")
    space = stiffness_factor_space(NAMES)
    robust = RobustResponse(
        model,
        space,
        sobol_sample(structure.n_draws, 64, seed=1),
        structure=structure,
        estimator=ControlVariate(1),
    )
    second = cut_normal_moments()[0]
    sigma = robust(np.ones((1, 4))).sigma_sum[0]
    assert sigma == pytest.approx(0.05 * np.sqrt(variance * second), rel=1e-9)


def test_structures_that_do_not_fit_are_refused():
    structure = batches(NAMES, MOUNTS, 0.5)
    space = stiffness_factor_space(NAMES)
    model = ResponseFunction(sum_of_all, NAMES, ("y",), "1")
    with pytest.raises(InputError, match="4 columns for a structure of 6 draws"):
        RobustResponse(model, space, sobol_sample(4, seed=1), structure=structure)
    wide = replace(space, tolerance=np.full(4, 0.75))
    with pytest.raises(InputError, match="could change its sign"):
        RobustResponse(model, wide, sobol_sample(6, seed=1), structure=structure)
    other = shared_parts(tuple("abcd"), {})
    with pytest.raises(InputError, match="same names in the same order"):
        RobustResponse(model, space, sobol_sample(4, seed=1), structure=other)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: shared_parts(NAMES, {"a": ("TSM x",)}), "'TSM x', which the design space has not"),
        (lambda: shared_parts(NAMES, {"a": NAMES[:2], "b": NAMES[1:]}), "part of 'a' and of 'b'"),
        (lambda: batches(NAMES, MOUNTS, 1.5), "take one from 0 to 1"),
        (lambda: batches(NAMES, MOUNTS, float("nan")), "take one from 0 to 1"),
        (lambda: correlated(NAMES, np.eye(3)), "symmetric 4 x 4 matrix"),
        (lambda: correlated(NAMES, 2.0 * np.eye(4)), "ones on its diagonal"),
        (
            lambda: correlated(NAMES, np.kron(np.eye(2), [[1, -2], [-2, 1]])),
            "no parts scatter like that",
        ),
        (lambda: ToleranceStructure(NAMES, np.eye(3), NAMES), "one row per variable"),
        (lambda: ToleranceStructure(NAMES, 2.0 * np.eye(4), NAMES), "'EnM x' have the length 2"),
        (lambda: ToleranceStructure(NAMES, np.eye(4) * np.nan, NAMES), "have the length nan"),
    ],
)
def test_what_no_parts_can_be_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
