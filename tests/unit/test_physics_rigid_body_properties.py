"""Mass properties, characteristic length and elastic centre: values in, values out, refusals."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.elastic_centre import (
    ElasticCentre,
    centre_of_compliance,
    centre_of_stiffness,
    residual_coupling,
)
from deboom.physics.mass_properties import (
    RigidBody,
    characteristic_length,
    mass_properties,
    torque_roll_axis,
)
from deboom.physics.rigid_body import mass_matrix, mount_stiffness_matrix, shift_stiffness

INERTIA = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])
CENTRE = np.array([0.02, -0.11, 0.3])
SUSPENSION = mount_stiffness_matrix(
    [[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]],
    [[110e3, 90e3, 150e3], [190e3, 140e3, 220e3], [75e3, 50e3, 55e3]],
)


def test_mass_properties_undo_the_mass_matrix():
    body = mass_properties(mass_matrix(193.5, INERTIA, CENTRE))
    assert body.mass == pytest.approx(193.5, rel=1e-14)
    np.testing.assert_allclose(body.centre, CENTRE, rtol=1e-12)
    np.testing.assert_allclose(body.inertia, INERTIA, rtol=1e-12, atol=1e-13)


def test_mass_properties_of_a_measured_matrix_need_a_tolerance():
    noise = np.random.default_rng(4).normal(size=(6, 6)) * 0.02
    measured = mass_matrix(193.5, INERTIA, CENTRE) + noise
    with pytest.raises(InputError, match="deviates by"):
        mass_properties(measured)
    body = mass_properties(measured, tolerance=0.05)
    assert body.mass == pytest.approx(193.5, abs=0.05)
    np.testing.assert_allclose(body.centre, CENTRE, atol=5e-4)


def test_mass_properties_do_not_depend_on_the_unit_of_length():
    """A deviation counts the same whether the matrix was written in metres or in millimetres."""
    units = np.repeat([1.0, 1e3], 3)
    bent = mass_matrix(193.5, INERTIA, CENTRE)
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
        (mass_matrix(-1.0, INERTIA), "not positive definite"),
        (mass_matrix(193.5, INERTIA) + np.diag([0, 0, 0, -20.0, 0, 0]), "not positive definite"),
    ],
)
def test_what_is_no_mass_matrix_is_refused(matrix, message):
    with pytest.raises(InputError, match=message):
        mass_properties(matrix)


def test_a_body_is_a_value():
    inertia = INERTIA.copy()
    body = RigidBody(193.5, CENTRE, inertia)
    inertia[0, 0] = 0.0
    assert body.inertia[0, 0] == 11.0
    with pytest.raises(ValueError, match="read-only"):
        body.centre[0] = 1.0


def test_characteristic_length_of_a_solid_sphere():
    assert characteristic_length(3.0, 0.4 * 3.0 * 0.2**2 * np.eye(3)) == pytest.approx(
        0.2 * np.sqrt(0.4)
    )


def test_torque_roll_axis_of_a_principal_axis_is_that_axis():
    np.testing.assert_allclose(torque_roll_axis(np.diag([11.0, 6.8, 9.6])), [0, 1, 0])
    axis = torque_roll_axis(INERTIA, [0.1, 1.0, 0.0])
    assert np.linalg.norm(axis) == pytest.approx(1.0)
    np.testing.assert_allclose(np.cross(INERTIA @ axis, [0.1, 1.0, 0.0]), 0, atol=1e-14)


def test_elastic_centres_move_with_the_reference_point():
    shift = np.array([0.1, -0.05, 0.2])
    for find in (centre_of_stiffness, centre_of_compliance):
        here, there = find(SUSPENSION), find(shift_stiffness(SUSPENSION, shift))
        np.testing.assert_allclose(here.position - shift, there.position, atol=1e-12)
        assert there.coupling == pytest.approx(here.coupling, rel=1e-9)


def test_an_elastic_centre_is_a_value():
    centre = centre_of_stiffness(SUSPENSION)
    assert isinstance(centre, ElasticCentre)
    with pytest.raises(ValueError, match="read-only"):
        centre.position[0] = 1.0


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
