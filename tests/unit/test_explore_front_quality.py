"""Figures of merit of fronts against closed forms."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.explore.front_quality import (
    attainment,
    common_box,
    coverage,
    design_distance,
    level_gap,
)

STAIRS = np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0]])


def test_hypervolume_of_a_known_staircase():
    box = common_box([STAIRS, STAIRS + 1.0])
    assert box.ideal.tolist() == [0.0, 0.0]
    assert box.nadir.tolist() == [2.0, 2.0]
    assert box.reference_point == pytest.approx([2.2, 2.2])
    area = 2.2 * 0.2 + 1.2 * 1.0 + 0.2 * 1.0  # strips from the top to the bottom
    assert box.hypervolume(STAIRS) == pytest.approx(area / 2.2**2)
    only = np.array([[1.0, 1.0]])
    assert box.hypervolume(only) == pytest.approx(1.2**2 / 2.2**2)
    assert box.hypervolume(np.array([[3.0, 3.0]])) == 0.0
    assert box.share(area) == pytest.approx(box.hypervolume(STAIRS))


def test_objectives_of_any_size_count_alike():
    factor, shift = np.array([1e4, 1e-3]), np.array([41000.0, -2.0])
    fronts = [STAIRS, STAIRS + 0.3]
    box = common_box(fronts)
    other = common_box([front * factor + shift for front in fronts])
    for front in fronts:
        scaled = front * factor + shift
        assert other.hypervolume(scaled) == pytest.approx(box.hypervolume(front), rel=1e-9)
        assert other.igd_plus(scaled) == pytest.approx(box.igd_plus(front), abs=1e-9)
        assert other.epsilon(scaled) == pytest.approx(box.epsilon(front), abs=1e-9)


def test_igd_plus_and_epsilon_of_a_shifted_front():
    worse = STAIRS + 0.5
    box = common_box([STAIRS, worse])
    assert box.igd_plus(STAIRS) == 0.0
    assert box.epsilon(STAIRS) == 0.0
    assert box.epsilon(worse) == pytest.approx(0.25)  # 0.5 of a box of 2
    assert box.igd_plus(worse) == pytest.approx(np.hypot(0.25, 0.25))
    # a single point: the others of the common front are 1 away in one objective each
    point = STAIRS[1:2]
    assert box.igd_plus(point) == pytest.approx((0.5 + 0.0 + 0.5) / 3)
    assert box.epsilon(point) == pytest.approx(0.5)


def test_coverage_counts_what_is_equalled_or_beaten():
    assert coverage(STAIRS, STAIRS) == 1.0
    assert coverage(STAIRS, STAIRS + 0.1) == 1.0
    assert coverage(STAIRS + 0.1, STAIRS) == 0.0
    assert coverage(STAIRS[1:2], STAIRS) == pytest.approx(1 / 3)


def test_attainment_of_three_single_points():
    fronts = [STAIRS[i : i + 1] for i in range(3)]
    levels = attainment(fronts, [1 / 3, 0.5, 2 / 3, 1.0])
    assert levels[1 / 3].tolist() == STAIRS.tolist()
    assert levels[2 / 3].tolist() == [[1.0, 2.0], [2.0, 1.0]]
    assert levels[0.5].tolist() == levels[2 / 3].tolist()  # 1.5 of 3 fronts are 2
    assert levels[1.0].tolist() == [[2.0, 2.0]]
    with pytest.raises(InputError, match="shares"):
        attainment(fronts, [0.0])


def test_level_gap_is_the_shift_in_the_first_objective():
    quiet = STAIRS - np.array([0.4, 0.0])
    assert level_gap(quiet, STAIRS) == pytest.approx(-0.4)
    assert level_gap(STAIRS, quiet) == pytest.approx(0.4)
    assert np.isnan(level_gap(STAIRS, STAIRS + np.array([0.0, 5.0])))


def test_design_distance_runs_from_0_to_1_and_leaves_fixed_variables_out():
    low, high = np.array([0.8, 0.8, 1.0]), np.array([1.2, 1.2, 1.0])
    corner, opposite = np.array([[0.8, 0.8, 1.0]]), np.array([[1.2, 1.2, 1.0]])
    assert design_distance(corner, corner, low, high) == 0.0
    assert design_distance(corner, opposite, low, high) == pytest.approx(1.0)
    beside = np.array([[0.8, 1.2, 1.0]])
    assert design_distance(corner, beside, low, high) == pytest.approx(np.sqrt(0.5))
    both = np.vstack([corner, opposite])  # one has a partner, the other lies at distance 1
    assert design_distance(corner, both, low, high) == pytest.approx((0.0 + 0.5) / 2)
    assert design_distance(corner, opposite, low, low) == 0.0


def test_bad_fronts_are_refused():
    for fronts in ([], [STAIRS, np.empty((0, 2))], [STAIRS, np.full((1, 2), np.nan)]):
        with pytest.raises(InputError, match="front"):
            common_box(fronts)
    with pytest.raises(InputError, match="same objectives"):
        common_box([STAIRS, np.ones((1, 3))])


def test_a_front_of_one_point_has_a_box_of_its_own_unit():
    point = np.array([[3.0, 4.0]])
    box = common_box([point])
    assert box.span.tolist() == [1.0, 1.0]
    assert box.hypervolume(point) == pytest.approx(1.0)
    assert box.hypervolume(point + np.array([0.0, 0.1])) == pytest.approx(1.0 / 1.1)
