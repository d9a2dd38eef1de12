"""Kinematics against actual rotations: scipy's, and their time derivatives by differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deboom.physics.rigid_body import forward_matrix, point_acceleration, rotation_matrix

POINT = np.array([0.31, -0.17, 0.23])
FIRST, SECOND = np.array([0.6, 0.0, 0.8]), np.array([0.0, 1.0, 0.0])


def test_rotation_matrix_is_scipys_extrinsic_xyz():
    angles = np.random.default_rng(21).uniform(-3, 3, size=(20, 3))
    np.testing.assert_allclose(
        rotation_matrix(angles), Rotation.from_euler("xyz", angles).as_matrix(), atol=1e-14
    )


def swing(t):
    return 0.7 * np.sin(3 * t), 2.1 * np.cos(3 * t), -6.3 * np.sin(3 * t)


def turn(t):
    return 1.3 * t**2, 2.6 * t, 2.6


def travel(t):
    return np.array([0.2 * t**3, np.sin(2 * t), np.exp(-t)])


def travel_acceleration(t):
    return np.array([1.2 * t, -4 * np.sin(2 * t), np.exp(-t)])


def place(t):
    """Path of a point of a body that swings about one axis and turns about a carried one."""
    rotation = Rotation.from_rotvec(swing(t)[0] * FIRST) * Rotation.from_rotvec(turn(t)[0] * SECOND)
    return travel(t) + rotation.apply(POINT)


def test_point_acceleration_is_the_second_derivative_of_the_path():
    t, h = 0.4, 2e-3
    differences = np.array([-1, 16, -30, 16, -1]) / (12 * h**2)
    measured = sum(w * place(t + i * h) for i, w in zip(range(-2, 3), differences, strict=True))

    _, rate_1, second_1 = swing(t)
    _, rate_2, second_2 = turn(t)
    carried = Rotation.from_rotvec(swing(t)[0] * FIRST)
    axis = carried.apply(SECOND)
    velocity = rate_1 * FIRST + rate_2 * axis
    acceleration = second_1 * FIRST + second_2 * axis + np.cross(rate_1 * FIRST, rate_2 * axis)
    arm = (carried * Rotation.from_rotvec(turn(t)[0] * SECOND)).apply(POINT)

    full = point_acceleration(arm, travel_acceleration(t), acceleration, velocity)
    np.testing.assert_allclose(full, measured, atol=2e-7)
    linear = forward_matrix(arm) @ np.concatenate([travel_acceleration(t), acceleration])
    assert np.max(np.abs(linear - measured)) > 0.1


@pytest.mark.parametrize("axis", np.eye(3))
def test_forward_matrix_is_the_limit_of_small_rotations(axis):
    """The error of the linear form falls with the square of the angle, so its sign is right."""
    errors = []
    for angle in (1e-2, 1e-3):
        moved = Rotation.from_rotvec(angle * axis).apply(POINT) - POINT
        linear = forward_matrix(POINT) @ np.concatenate([np.zeros(3), angle * axis])
        errors.append(np.linalg.norm(moved - linear))
    assert errors[0] < 1e-4 * np.linalg.norm(POINT)
    assert errors[0] / errors[1] == pytest.approx(100.0, rel=0.01)


def test_centripetal_term_of_a_harmonic_rotation_answers_at_twice_its_frequency():
    """Rotation amplitude of the powertrain, 2.8 mrad: leaving the term out costs 3e-6 in the line.

    The path of the point is sampled over one period; line 1 is what order tracking sees.
    """
    amplitude, omega, n = 2.8e-3, 2 * np.pi * 30, 64
    phase = 2 * np.pi * np.arange(n) / n
    angle = amplitude * np.cos(phase)
    paths = Rotation.from_rotvec(angle[:, np.newaxis] * [0, 1, 0]).apply(POINT)
    lines = np.fft.fft(paths, axis=0)[:3] / n * 2
    harmonic_acceleration = -((omega * np.arange(3)) ** 2)[:, np.newaxis] * lines
    linear = forward_matrix(POINT) @ np.array([0, 0, 0, 0, -(omega**2) * amplitude, 0])
    scale = np.linalg.norm(linear)
    assert np.linalg.norm(harmonic_acceleration[1] - linear) < 3e-6 * scale
    assert np.linalg.norm(harmonic_acceleration[2]) == pytest.approx(amplitude * scale, rel=0.01)
