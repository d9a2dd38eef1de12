"""The classical designs against the tables that are printed in the literature."""

import numpy as np
import pytest

from deboom.explore.doe import (
    box_behnken,
    central_composite,
    fractional_factorial,
    full_factorial,
    resolution,
)


def signs(text):
    return np.array([[{"+": 1.0, "-": -1.0}[c] for c in row] for row in text.split()])


def same_rows(found, printed):
    """Whether two designs hold the same runs, in any order."""
    return np.array_equal(*(np.array(sorted(map(tuple, one))) for one in (found, printed)))


def test_two_level_factorial_is_in_yates_standard_order():
    # Box, Hunter and Hunter, 2nd ed., table 5.1: signs of the 2^3 factorial
    assert np.array_equal(full_factorial(3), signs("--- +-- -+- ++- --+ +-+ -++ +++"))


def test_half_fraction_of_four_variables():
    # NIST/SEMATECH e-Handbook, 5.3.3.4.2: the 2^(4-1) of resolution IV, 4 = 123
    printed = signs("---- +--+ -+-+ ++-- --++ +-+- -++- ++++")
    assert np.array_equal(fractional_factorial("a b c abc"), printed)
    assert resolution("a b c abc") == 4


def test_sixteenth_fraction_of_seven_variables():
    # Box, Hunter and Hunter, 2nd ed., table 6.3: the 2^(7-4) of resolution III (bicycle),
    # with generators 4 = 12, 5 = 13, 6 = 23, 7 = 123
    printed = signs("---+++- +----++ -+--+-+ ++-+--- --++--+ +-+-+-- -++--+- +++++++")
    assert np.array_equal(fractional_factorial("a b c ab ac bc abc"), printed)
    assert resolution("a b c ab ac bc abc") == 3


@pytest.mark.parametrize(
    ("generators", "expected"),
    [
        ("a b c d abcd", 5),  # 2^(5-1)
        ("a b c d abc bcd", 4),  # 2^(6-2)
        ("a b c d e abcd abde", 4),  # 2^(7-2)
        ("a b c d bcd acd abc abd", 4),  # 2^(8-4)
        ("a b c ab ac", 3),  # 2^(5-2)
        ("a b c", None),
    ],
)
def test_resolutions_of_the_nist_table(generators, expected):
    # NIST/SEMATECH e-Handbook, 5.3.3.4.7
    assert resolution(generators) == expected


def test_columns_of_a_fraction_are_orthogonal():
    plan = fractional_factorial("a b c d e abcd abde")
    assert np.array_equal(plan.T @ plan, 32.0 * np.eye(7))


def test_box_behnken_of_three_and_four_variables():
    # Box and Behnken 1960, table 1: the edges' midpoints of the cube
    printed = [
        *((a, b, 0) for a in (-1, 1) for b in (-1, 1)),
        *((a, 0, c) for a in (-1, 1) for c in (-1, 1)),
        *((0, b, c) for b in (-1, 1) for c in (-1, 1)),
        (0, 0, 0),
    ]
    assert same_rows(box_behnken(3), printed)
    four = box_behnken(4)
    assert four.shape == (25, 4)
    assert np.all(np.count_nonzero(four[:-1], axis=1) == 2)


@pytest.mark.parametrize(
    ("k", "runs", "in_a_block"),  # Box and Behnken 1960, table 1, without their centre runs
    [(3, 12, 2), (4, 24, 2), (5, 40, 2), (6, 48, 3), (7, 56, 3), (12, 192, 4)],
)
def test_box_behnken_sizes_and_balance(k, runs, in_a_block):
    plan, middle = box_behnken(k)[:-1], box_behnken(k)[-1]
    assert not middle.any()
    assert plan.shape == (runs, k)
    assert np.all(np.count_nonzero(plan, axis=1) == in_a_block)
    assert np.all(plan.sum(axis=0) == 0.0)
    assert len({int(np.count_nonzero(column)) for column in plan.T}) == 1
    pairs = (plan**2).T @ plan**2
    assert pairs[~np.eye(k, dtype=bool)].min() > 0  # every two-variable interaction is seen
    assert np.array_equal(plan.T @ plan, np.diag((plan**2).sum(axis=0)))
    assert len(np.unique(plan, axis=0)) == runs


def test_rotatable_central_composite_of_two_and_three_variables():
    # NIST/SEMATECH e-Handbook, 5.3.3.6.1: alpha = 1.414 and 1.682
    two = central_composite(full_factorial(2))
    star = 2.0**0.5
    printed = [
        *((a, b) for a in (-1, 1) for b in (-1, 1)),
        *((-star, 0), (star, 0), (0, -star), (0, star)),
        (0, 0),
    ]
    assert np.allclose(np.sort(two, axis=0), np.sort(printed, axis=0))
    assert central_composite(full_factorial(3)).max() == pytest.approx(1.682, abs=5e-4)


def test_the_default_star_makes_the_prediction_variance_the_same_in_all_directions():
    plan = central_composite(full_factorial(3))

    def model(x):
        i, j = np.triu_indices(3)
        return np.column_stack([np.ones(len(x)), x, x[:, i] * x[:, j]])

    directions = np.random.default_rng(1).normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    information = np.linalg.inv(model(plan).T @ model(plan))
    variance = np.einsum("ni,ij,nj->n", model(directions), information, model(directions))
    assert np.ptp(variance) < 1e-12
