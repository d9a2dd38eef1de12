"""Shapes, broadcasting and refusals of the rigid-body equations."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.rigid_body import (
    forward_matrices,
    forward_matrix,
    mass_matrix,
    mount_stiffness_matrix,
    point_acceleration,
    rigid_body_modes,
    rotation_matrix,
    shift_load,
    shift_matrix,
    shift_stiffness,
    skew,
)

POSITIONS = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
STIFFNESS = np.array([[110e3, 90e3, 150e3], [190e3, 140e3, 220e3], [75e3, 50e3, 55e3]])
INERTIA = np.diag([11.0, 6.8, 9.6])


def test_skew_is_the_cross_product_over_leading_axes():
    rng = np.random.default_rng(1)
    left, right = rng.normal(size=(2, 4, 5, 3))
    crossed = np.einsum("...ij,...j->...i", skew(left), right)
    np.testing.assert_allclose(crossed, np.cross(left, right), atol=1e-15)


def test_rotations_over_leading_axes_equal_the_single_ones():
    angles = np.random.default_rng(2).uniform(-3, 3, size=(2, 3, 3))
    together = rotation_matrix(angles)
    assert together.shape == (2, 3, 3, 3)
    np.testing.assert_array_equal(together[1, 2], rotation_matrix(angles[1, 2]))


def test_forward_matrices_stack_the_single_ones_in_mount_order():
    stacked = forward_matrices(POSITIONS)
    assert stacked.shape == (9, 6)
    for i, position in enumerate(POSITIONS):
        np.testing.assert_array_equal(stacked[3 * i : 3 * i + 3], forward_matrix(position))


def test_inputs_stay_as_they_were():
    positions, stiffness = POSITIONS.copy(), STIFFNESS.copy()
    mount_stiffness_matrix(positions, stiffness, rotation_matrix(np.zeros((3, 3))))
    np.testing.assert_array_equal(positions, POSITIONS)
    np.testing.assert_array_equal(stiffness, STIFFNESS)


@pytest.mark.parametrize("positions", [np.zeros(3), np.zeros((2, 2)), np.zeros((1, 2, 3))])
def test_positions_of_another_shape_are_refused(positions):
    with pytest.raises(InputError, match=r"positions have shape \(n, 3\)"):
        forward_matrices(positions)


def test_one_orientation_for_all_mounts_is_refused():
    with pytest.raises(InputError, match="orientations of 3 points"):
        forward_matrices(POSITIONS, np.eye(3))


def test_both_layouts_of_mount_stiffness_agree():
    matrix = mount_stiffness_matrix(POSITIONS, STIFFNESS)
    assert matrix.shape == (6, 6)
    np.testing.assert_array_equal(matrix, mount_stiffness_matrix(POSITIONS, STIFFNESS.ravel()))


def test_mount_stiffness_keeps_the_frequency_axis_and_the_loss():
    factor = np.linspace(1.0, 1.5, 5)[:, np.newaxis, np.newaxis] * (1 + 0.2j)
    lines = mount_stiffness_matrix(POSITIONS, factor * STIFFNESS)
    assert lines.shape == (5, 6, 6)
    expected = factor * mount_stiffness_matrix(POSITIONS, STIFFNESS)
    np.testing.assert_allclose(lines, expected, rtol=1e-13, atol=1e-9)
    flat = mount_stiffness_matrix(POSITIONS, (factor * STIFFNESS).reshape(5, 9))
    np.testing.assert_array_equal(flat, lines)


@pytest.mark.parametrize("stiffness", [1.0, np.ones(3), np.ones((3, 2)), np.ones((4, 3))])
def test_stiffness_that_does_not_fit_the_mounts_is_refused(stiffness):
    with pytest.raises(InputError, match="3 mounts need stiffnesses"):
        mount_stiffness_matrix(POSITIONS, stiffness)


def test_shifting_there_and_back_changes_nothing():
    position = np.array([0.3, -0.2, 0.5])
    matrix = mount_stiffness_matrix(POSITIONS, STIFFNESS)
    back = shift_stiffness(shift_stiffness(matrix, position), -position)
    np.testing.assert_allclose(back, matrix, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(
        shift_matrix(position) @ shift_matrix(-position), np.eye(6), atol=1e-15
    )


def test_loads_shift_line_by_line():
    loads = np.random.default_rng(3).normal(size=(4, 6)) * (1 + 1j)
    position = np.array([0.3, -0.2, 0.5])
    shifted = shift_load(loads, position)
    np.testing.assert_allclose(shifted[:, :3], loads[:, :3])
    moments = loads[:, 3:] - np.cross(position, loads[:, :3])
    np.testing.assert_allclose(shifted[:, 3:], moments, atol=1e-14)


def test_a_point_on_the_axis_of_rotation_feels_no_rotation():
    spin = np.array([0.0, 0.0, 30.0])
    acceleration = point_acceleration([0, 0, 0.2], [1.0, 2.0, 3.0], 2 * spin, spin)
    np.testing.assert_allclose(acceleration, [1.0, 2.0, 3.0])


def test_modes_are_mass_normalised_and_increase_on_every_leading_axis():
    mass = mass_matrix(193.5, INERTIA)
    factor = np.array([1.0, 2.0])[:, np.newaxis, np.newaxis]
    frequency, shapes = rigid_body_modes(
        mass, mount_stiffness_matrix(POSITIONS, factor * STIFFNESS)
    )
    assert frequency.shape == (2, 6)
    assert shapes.shape == (2, 6, 6)
    assert np.all(np.diff(frequency, axis=1) > 0)
    np.testing.assert_allclose(frequency[1], np.sqrt(2) * frequency[0], rtol=1e-12)
    for shape in shapes:
        np.testing.assert_allclose(shape.T @ mass @ shape, np.eye(6), atol=1e-12)
        weighted = shape * np.sqrt(np.diag(mass))[:, np.newaxis]
        assert np.all(weighted[np.abs(weighted).argmax(axis=0), np.arange(6)] > 0)


def test_modes_refuse_what_has_no_undamped_modes():
    mass = mass_matrix(193.5, INERTIA)
    springs = mount_stiffness_matrix(POSITIONS, STIFFNESS)
    with pytest.raises(InputError, match="real part"):
        rigid_body_modes(mass, springs * (1 + 0.1j))
    with pytest.raises(InputError, match="mass matrix is not positive definite"):
        rigid_body_modes(mass_matrix(193.5, np.diag([11.0, -6.8, 9.6])), springs)
    with pytest.raises(InputError, match="negative direction"):
        rigid_body_modes(mass, mount_stiffness_matrix(POSITIONS, -STIFFNESS))
    tilted = springs.copy()
    tilted[0, 4] += 1e3
    with pytest.raises(InputError, match="stiffness is not symmetric"):
        rigid_body_modes(mass, tilted)
