"""Rigid bodies: kinematics, mass properties, refusals."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.elastic_centre import (
    centre_of_compliance,
    centre_of_stiffness,
    residual_coupling,
)
from deboom.physics.rigid_body import (
    characteristic_length,
    forward_matrices,
    mass_matrix,
    mass_properties,
    mount_stiffness_matrix,
    rigid_body_modes,
    shift_stiffness,
)

POSITIONS = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
STIFFNESS = np.array([[110e3, 90e3, 150e3], [190e3, 140e3, 220e3], [75e3, 50e3, 55e3]])
INERTIA = np.diag([11.0, 6.8, 9.6])


@pytest.mark.parametrize("positions", [np.zeros(3), np.zeros((2, 2))])
def test_positions_of_another_shape_are_refused(positions):
    with pytest.raises(InputError, match=r"positions have shape \(n, 3\)"):
        forward_matrices(positions)


def test_one_orientation_for_all_mounts_is_refused():
    with pytest.raises(InputError, match="orientations of 3 points"):
        forward_matrices(POSITIONS, np.eye(3))


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


INERTIA_2 = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])
CENTRE = np.array([0.02, -0.11, 0.3])
SUSPENSION = mount_stiffness_matrix(
    [[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]],
    [[110e3, 90e3, 150e3], [190e3, 140e3, 220e3], [75e3, 50e3, 55e3]],
)


def test_mass_properties_of_a_measured_matrix_need_a_tolerance():
    noise = np.random.default_rng(4).normal(size=(6, 6)) * 0.02
    measured = mass_matrix(193.5, INERTIA_2, CENTRE) + noise
    with pytest.raises(InputError, match="deviates by"):
        mass_properties(measured)
    body = mass_properties(measured, tolerance=0.05)
    size = np.max(np.abs(measured - measured.T)) + 1.0
    assert mass_properties(measured, deviation=np.full((6, 6), size)).mass == body.mass
    with pytest.raises(InputError, match="standard deviations of an entry"):
        mass_properties(measured, deviation=np.full((6, 6), 1e-6))
    assert body.mass == pytest.approx(193.5, abs=0.05)
    np.testing.assert_allclose(body.centre, CENTRE, atol=5e-4)


def test_mass_properties_do_not_depend_on_the_unit_of_length():
    """A deviation counts the same whether the matrix was written in metres or in millimetres."""
    units = np.repeat([1.0, 1e3], 3)
    bent = mass_matrix(193.5, INERTIA_2, CENTRE)
    bent[0, 0] *= 1.01
    messages = []
    for matrix in (bent, bent * np.outer(units, units)):
        with pytest.raises(InputError) as refused:
            mass_properties(matrix)
        messages.append(str(refused.value))
    assert messages[0] == messages[1]


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(3), "shape"),
        (mass_matrix(-1.0, INERTIA_2), "not positive definite"),
        (mass_matrix(193.5, INERTIA_2) + np.diag([0, 0, 0, -20.0, 0, 0]), "not positive definite"),
    ],
)
def test_what_is_no_mass_matrix_is_refused(matrix, message):
    with pytest.raises(InputError, match=message):
        mass_properties(matrix)


def test_characteristic_length_of_a_solid_sphere():
    assert characteristic_length(3.0, 0.4 * 3.0 * 0.2**2 * np.eye(3)) == pytest.approx(
        0.2 * np.sqrt(0.4)
    )


def test_elastic_centres_move_with_the_reference_point():
    shift = np.array([0.1, -0.05, 0.2])
    for find in (centre_of_stiffness, centre_of_compliance):
        here, there = find(SUSPENSION), find(shift_stiffness(SUSPENSION, shift))
        np.testing.assert_allclose(here.position - shift, there.position, atol=1e-12)
        assert there.coupling == pytest.approx(here.coupling, rel=1e-9)


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (SUSPENSION[:3, :3], "shape"),
        (SUSPENSION * (1 + 0.1j), "real part"),
        (SUSPENSION + np.eye(6, k=1) * 1e5, "not symmetric"),
        (np.diag([1e5, 1e5, 1e5, 1e3, 1e3, 0.0]), "not positive definite"),
    ],
)
@pytest.mark.parametrize("ask", [centre_of_stiffness, centre_of_compliance, residual_coupling])
def test_a_stiffness_without_an_elastic_centre_is_refused(ask, matrix, message):
    with pytest.raises(InputError, match=message):
        ask(matrix)
