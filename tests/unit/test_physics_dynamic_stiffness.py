"""Dynamic stiffness of single records and over repeats: shapes, limits, refusals."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.dynamic_stiffness import (
    displacement_from_acceleration,
    dynamic_stiffness,
    force_at_virtual_point,
    kelvin_voigt,
    loss_factor,
    stiffness_h1,
    stiffness_h2,
    stiffness_hv,
)

FREQUENCY = np.array([20.0, 40.0])


def _records():
    rng = np.random.default_rng(6)
    noise = rng.normal(size=(4, 2, 3, 8))
    displacement = 1e-4 * (1 + 0.2 * noise[0] + 0.2j * noise[1])
    force = (2e5 + 3e4j) * 1e-4 * (1 + 0.2 * noise[2] + 0.2j * noise[3])
    return force, displacement


def test_displacement_refuses_zero_frequency_and_other_lines():
    with pytest.raises(InputError, match="above 0 Hz"):
        displacement_from_acceleration(np.ones(2), [0.0, 10.0])
    with pytest.raises(InputError, match="differ in lines"):
        displacement_from_acceleration(np.ones(3), FREQUENCY)


def test_a_motionless_line_is_named():
    displacement = np.array([[1e-4, 1e-4], [1e-4, 0.0]])
    with pytest.raises(InputError, match=r"displacement is 0 at index \(1, 1\)"):
        dynamic_stiffness(np.ones((2, 2)), displacement)


@pytest.mark.parametrize("ratio", [0.0, -1.0, np.inf, np.nan])
def test_a_noise_ratio_without_meaning_is_refused(ratio):
    with pytest.raises(InputError, match="noise ratio"):
        stiffness_hv(*_records(), ratio)


def test_records_that_do_not_belong_together_are_refused():
    force, displacement = _records()
    with pytest.raises(InputError, match="differ"):
        stiffness_h1(force[..., 1:], displacement)
    with pytest.raises(InputError, match="displacement is 0"):
        stiffness_h1(force, np.zeros_like(displacement))
    with pytest.raises(InputError, match="product of force and displacement is 0"):
        stiffness_h2([1.0, 1.0], [1.0, -1.0])
    with pytest.raises(InputError, match="product of force and displacement is 0"):
        stiffness_hv([1.0, 1.0], [1.0, -1.0], 1.0)


def test_loss_factor_of_a_spring_with_a_damper():
    omega = 2 * np.pi * FREQUENCY
    np.testing.assert_allclose(loss_factor(kelvin_voigt(FREQUENCY, 1e5, 40.0)), omega * 40 / 1e5)
    with pytest.raises(InputError, match="real part"):
        loss_factor([1e5, 1e3j])


def test_a_force_transfer_matrix_without_inverse_is_refused():
    with pytest.raises(InputError, match="no inverse"):
        force_at_virtual_point(np.diag([0.95, 0.0, 0.95]), np.ones(3))
    with pytest.raises(InputError, match=r"shape \(3, 3\)"):
        force_at_virtual_point(np.eye(6), np.ones(6))
