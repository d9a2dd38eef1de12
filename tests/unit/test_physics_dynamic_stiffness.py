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


def test_displacement_out_of_acceleration_keeps_trailing_axes():
    acceleration = np.full((2, 3, 4), 5.0 + 1j)
    displacement = displacement_from_acceleration(acceleration, FREQUENCY)
    assert displacement.shape == (2, 3, 4)
    np.testing.assert_allclose(displacement[1], -(5 + 1j) / (2 * np.pi * 40) ** 2)
    np.testing.assert_allclose(
        displacement_from_acceleration(acceleration[:, 0, 0], FREQUENCY), displacement[:, 0, 0]
    )


def test_displacement_refuses_zero_frequency_and_other_lines():
    with pytest.raises(InputError, match="above 0 Hz"):
        displacement_from_acceleration(np.ones(2), [0.0, 10.0])
    with pytest.raises(InputError, match="differ in lines"):
        displacement_from_acceleration(np.ones(3), FREQUENCY)


def test_a_motionless_line_is_named():
    displacement = np.array([[1e-4, 1e-4], [1e-4, 0.0]])
    with pytest.raises(InputError, match=r"displacement is 0 at index \(1, 1\)"):
        dynamic_stiffness(np.ones((2, 2)), displacement)


def test_all_estimates_agree_without_noise():
    _, displacement = _records()
    stiffness = np.array([[1e5 + 2e4j, 3e5, 2e6 - 1e5j]])
    force = stiffness[..., np.newaxis] * displacement
    for estimate in (
        stiffness_h1(force, displacement),
        stiffness_h2(force, displacement),
        stiffness_hv(force, displacement, 1e5),
    ):
        assert estimate.shape == (2, 3)
        np.testing.assert_allclose(estimate, np.broadcast_to(stiffness, (2, 3)), rtol=1e-12)


def test_hv_lies_between_its_limits_h1_and_h2():
    force, displacement = _records()
    h1, h2 = stiffness_h1(force, displacement), stiffness_h2(force, displacement)
    hv = stiffness_hv(force, displacement, np.full((2, 3), 2e5))
    assert np.all(np.abs(h1) < np.abs(hv))
    assert np.all(np.abs(hv) < np.abs(h2))
    np.testing.assert_allclose(stiffness_hv(force, displacement, 1e12), h1, rtol=1e-10)
    np.testing.assert_allclose(stiffness_hv(force, displacement, 1e-2), h2, rtol=1e-10)


def test_one_record_gives_the_quotient():
    force, displacement = _records()
    single = dynamic_stiffness(force[..., 0], displacement[..., 0])
    for estimate in (stiffness_h1, stiffness_h2):
        np.testing.assert_allclose(estimate(force[..., :1], displacement[..., :1]), single)


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
