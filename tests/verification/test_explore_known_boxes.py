"""Largest boxes against closed forms and quadrature."""

import numpy as np
import pytest
from scipy.optimize import brentq

from deboom.explore.box import Box, BoxQuestion, face_shares
from deboom.explore.largest_box import BoxEffort, largest_box
from deboom.explore.space import sobol_points
from samples import known_boxes

EFFORT = BoxEffort(calibration=2**18, verification=2**18)
SLOPE = np.array([0.7, 1.1, 1.6, 0.9])


def test_the_share_below_a_plane_is_exact_where_it_is_plain():
    zeros, ones = np.zeros(2), np.ones(2)
    assert known_boxes.linear_share(ones, 0.5, zeros, ones) == pytest.approx(0.125, abs=1e-14)
    assert known_boxes.linear_share(ones, 1.5, zeros, ones) == pytest.approx(0.875, abs=1e-14)
    assert known_boxes.linear_share(ones, 2.0, zeros, ones) == 1.0
    assert known_boxes.linear_share(ones, 0.6, zeros, np.array([0.0, 1.0])) == pytest.approx(0.6)


def test_a_disc_in_its_square_has_the_share_of_pi():
    ones = np.ones(2)
    assert known_boxes.quadratic_share(ones, ones, 0.25, 0.5 * ones, 1.5 * ones) == pytest.approx(
        np.pi / 4.0, abs=1e-4
    )


def test_the_closed_form_is_the_optimum_of_the_exact_share():
    bounds = Box(("x1", "x2", "x3", "x4"), np.zeros(4), np.full(4, 3.0))
    closed = known_boxes.largest_linear_box(SLOPE, 1.0, 0.95, bounds.lower)
    box = known_boxes.exact_largest_box(
        known_boxes.LinearProblem(SLOPE[np.newaxis]), np.ones(1), 0.95, bounds, np.full(4, 0.1)
    )
    assert box.upper == pytest.approx(closed.upper, rel=1e-3)


@pytest.mark.parametrize("instance", [("plane", 4, 1), ("bowl", 2, 1), ("QUAD2", 2, 1)])
def test_the_search_finds_the_exact_box(instance):
    ratio, kept, confirmed, off = known_boxes.ratio_of(*instance, EFFORT)
    assert ratio == pytest.approx(1.0, abs=0.02)
    assert kept
    assert confirmed
    assert off <= 4.0


def test_a_common_factor_leaves_the_width_that_its_integral_does():
    """Of ``f x ≤ 1`` with x even up to u and f even in 1 ± c, ``E[min(1, 1/(f u))]`` is kept."""
    common, share = 0.3, 0.9

    def kept(u):
        certain = 1 / u - (1 - common)
        return (certain + np.log((1 + common) * u) / u) / (2 * common)

    exact = brentq(lambda u: kept(u) - share, 1.0, 1.4)
    problem = known_boxes.LinearProblem(np.ones((1, 1)))
    question = BoxQuestion(problem, np.ones(1), share, np.zeros(1), np.full(1, 3.0), common=common)
    solution = largest_box(question, seed=1, effort=EFFORT)
    assert solution.box.lower == 0.0
    assert solution.box.upper == pytest.approx(exact, rel=0.01)
    assert solution.box.upper < 1 / share - 0.02


def test_at_the_optimum_all_free_faces_have_the_same_share():
    problem = known_boxes.LinearProblem(SLOPE[np.newaxis])
    question = BoxQuestion(problem, np.ones(1), 0.95, np.zeros(4), np.full(4, 3.0))
    box = largest_box(question, seed=1, effort=EFFORT).box
    upper = face_shares(question, box, sobol_points(4, 2**15, seed=2, purpose="faces"))[1]
    assert np.ptp(upper) < 0.02
    assert np.all(upper < 0.93)
