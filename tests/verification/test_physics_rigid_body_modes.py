"""Rigid-body modes against closed forms, and a torque roll axis against point masses."""

import numpy as np
import pytest
from scipy.linalg import eig

from deboom.physics.mass_properties import torque_roll_axis
from deboom.physics.rigid_body import (
    mass_matrix,
    mount_stiffness_matrix,
    rigid_body_modes,
    rotation_matrix,
    shift_stiffness,
)

TAU = 2 * np.pi


def test_symmetric_body_on_four_mounts_in_its_plane_of_gravity():
    """Nothing couples: √(Σk/m) for the translations, √(Σk·arm²/J) for the rotations."""
    mass, inertia = 193.5, np.array([11.0, 6.8, 9.6])
    a, b = 0.25, 0.45
    k = np.array([110e3, 90e3, 150e3])
    positions = np.array([[a, b, 0], [a, -b, 0], [-a, b, 0], [-a, -b, 0]])
    frequency, shapes = rigid_body_modes(
        mass_matrix(mass, np.diag(inertia)), mount_stiffness_matrix(positions, np.tile(k, (4, 1)))
    )
    translations = np.sqrt(4 * k / mass)
    arms = 4 * np.array([k[2] * b**2, k[2] * a**2, k[0] * b**2 + k[1] * a**2])
    expected = np.concatenate([translations, np.sqrt(arms / inertia)]) / TAU
    np.testing.assert_allclose(frequency, np.sort(expected), rtol=1e-12)
    moving = np.abs(shapes).argmax(axis=0)
    np.testing.assert_array_equal(moving, np.argsort(expected))
    modal_mass = np.array([mass, mass, mass, *inertia])[moving]
    np.testing.assert_allclose(shapes[moving, np.arange(6)], modal_mass**-0.5, rtol=1e-12)


def test_bounce_and_pitch_on_two_unequal_springs():
    """The closed form of vehicle dynamics for a beam on springs at distances a and b."""
    m, j, a, b, k_a, k_b = 200.0, 30.0, 0.6, 0.4, 8e4, 1.5e5
    frequency, _ = rigid_body_modes(
        mass_matrix(m, np.diag([5.0, j, 40.0])),
        mount_stiffness_matrix([[-a, 0, 0], [b, 0, 0]], [[0, 0, k_a], [0, 0, k_b]]),
    )
    bounce, pitch = (k_a + k_b) / m, (k_a * a**2 + k_b * b**2) / j
    coupling = (k_b * b - k_a * a) ** 2 / (m * j)
    half = np.sqrt((bounce - pitch) ** 2 / 4 + coupling)
    pair = np.sqrt((bounce + pitch) / 2 + np.array([-half, half])) / TAU
    np.testing.assert_allclose(frequency[4:], pair, rtol=1e-12)
    np.testing.assert_allclose(frequency[:4], 0.0, atol=1e-6)  # four free directions


def test_lateral_motion_and_roll_of_a_body_above_its_mounts():
    """Centre of gravity a height h above the mounts: sway couples with roll."""
    m, j, h, half_track = 150.0, 9.0, 0.3, 0.4
    k_y, k_z = 6e4, 1.1e5
    positions = [[0, half_track, -h], [0, -half_track, -h]]
    frequency, shapes = rigid_body_modes(
        mass_matrix(m, np.diag([j, 20.0, 25.0])),
        mount_stiffness_matrix(positions, [[1e9, k_y, k_z]] * 2),
    )
    sway = 2 * k_y / m
    roll = (2 * k_y * h**2 + 2 * k_z * half_track**2) / j
    coupling = (2 * k_y * h) ** 2 / (m * j)
    half = np.sqrt((sway - roll) ** 2 / 4 + coupling)
    low, high = np.sqrt((sway + roll) / 2 + np.array([-half, half])) / TAU
    for expected in (low, high):
        assert np.min(np.abs(frequency - expected)) < 1e-10 * expected
    # in the lower mode the body leans outwards: +y goes with rotation about -x
    lower = shapes[:, np.abs(frequency - low).argmin()]
    assert lower[1] * lower[3] < 0


def test_chain_of_two_equal_masses_has_the_golden_ratio():
    m, k = 2.0, 5e3
    frequency, _ = rigid_body_modes(m * np.eye(2), [[2 * k, -k], [-k, k]])
    golden = (1 + np.sqrt(5)) / 2
    np.testing.assert_allclose(TAU * frequency, np.sqrt(k / m) * np.array([1 / golden, golden]))


def test_modes_do_not_depend_on_point_axes_or_solver():
    """Shifted reference point, turned axes, and scipy's unsymmetric eigenvalue solver."""
    positions = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
    rates = 1e3 * np.array([[110, 90, 150], [190, 140, 220], [75, 50, 55]])
    inertia = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])
    mass, springs = mass_matrix(193.5, inertia), mount_stiffness_matrix(positions, rates)
    frequency, shapes = rigid_body_modes(mass, springs)

    squared = eig(springs, mass, right=False)
    np.testing.assert_allclose(np.sort(np.sqrt(squared.real)) / TAU, frequency, rtol=1e-10)
    residual = springs @ shapes - mass @ shapes * (TAU * frequency) ** 2
    assert np.max(np.abs(residual)) < 1e-10 * np.max(np.abs(springs @ shapes))

    point = np.array([0.4, -0.7, 0.2])
    moved = rigid_body_modes(shift_stiffness(mass, point), shift_stiffness(springs, point))[0]
    np.testing.assert_allclose(moved, frequency, rtol=1e-10)

    turn = rotation_matrix([0.3, -0.8, 1.9])
    turned = rigid_body_modes(
        mass_matrix(193.5, turn @ inertia @ turn.T),
        mount_stiffness_matrix(positions @ turn.T, rates, np.tile(turn, (3, 1, 1))),
    )[0]
    np.testing.assert_allclose(turned, frequency, rtol=1e-10)


def test_torque_roll_axis_of_point_masses():
    """The angular acceleration whose inertia forces balance the torque, solved without a tensor."""
    rng = np.random.default_rng(41)
    positions = rng.normal(size=(200, 3)) * [0.3, 0.2, 0.25]
    positions[:, 1] += 0.3 * positions[:, 2]
    positions -= positions.mean(axis=0)
    moment_per_rotation = np.array(
        [np.cross(positions, np.cross(axis, positions)).sum(0) for axis in np.eye(3)]
    ).T
    free = np.linalg.solve(moment_per_rotation, [0.0, 1.0, 0.0])
    inertia = np.sum(positions**2) * np.eye(3) - positions.T @ positions
    axis = torque_roll_axis(inertia)
    np.testing.assert_allclose(axis, free / np.linalg.norm(free), rtol=1e-10)


def test_torque_roll_axis_of_the_bench_powertrain_is_close_to_y():
    """The thesis: "a very small angle to the y axis"; 3.2° for the inertia of the study."""
    inertia = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])
    angle = np.degrees(np.arccos(torque_roll_axis(inertia)[1]))
    assert angle == pytest.approx(3.2, abs=0.05)
