from __future__ import annotations

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.mass_properties import mass_properties
from deboom.vehicles.powertrain import Powertrain

INERTIA = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])
SHEET = Powertrain(
    193.5, INERTIA, mass_tolerance=1.0, inertia_tolerance=0.02, centre_tolerance=0.002
)


def test_mass_matrix_at_the_centre_of_gravity():
    matrix = SHEET.mass_matrix
    np.testing.assert_array_equal(matrix[:3, :3], 193.5 * np.eye(3))
    np.testing.assert_array_equal(matrix[3:, 3:], INERTIA)
    assert not matrix[:3, 3:].any()


def test_mass_matrix_off_the_centre_of_gravity():
    moved = Powertrain(193.5, INERTIA, np.array([0.01, -0.02, 0.03]))
    found = mass_properties(moved.mass_matrix)
    np.testing.assert_allclose(found.centre, [0.01, -0.02, 0.03])
    np.testing.assert_allclose(found.inertia, INERTIA)


def test_draws_fill_the_tolerances_and_stay_inside():
    rng = np.random.default_rng(1)
    draws = [SHEET.within_tolerance(rng) for _ in range(200)]
    radii = np.sqrt(np.diag(INERTIA))
    mass = np.array([draw.mass for draw in draws]) - 193.5
    inertia = np.array([draw.inertia - INERTIA for draw in draws]) / np.outer(radii, radii)
    centre = np.array([draw.centre for draw in draws])
    for deviation, tolerance in ((mass, 1.0), (inertia, 0.02), (centre, 0.002)):
        assert 0.95 * tolerance < np.abs(deviation).max() <= tolerance * (1 + 1e-12)
    assert {draw.mass_tolerance for draw in draws} == {0.0}


def test_values_are_copied_and_read_only():
    inertia = INERTIA.copy()
    sheet = Powertrain(193.5, inertia)
    inertia[0, 0] = 0.0
    assert sheet.inertia[0, 0] == 11.0
    with pytest.raises(ValueError, match="read-only"):
        sheet.inertia[0, 0] = 1.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"mass": 0.0}, "a mass of 0.0 kg"),
        ({"inertia": np.eye(2)}, "inertia needs"),
        ({"inertia": -np.eye(3)}, "not symmetric and positive definite"),
        ({"inertia": np.triu(np.ones((3, 3))) + np.eye(3)}, "not symmetric"),
        ({"centre": np.array([0.0, np.nan, 0.0])}, "centre needs"),
        ({"mass_tolerance": -1.0}, "a tolerance is negative"),
    ],
)
def test_refuses(values, message):
    with pytest.raises(InputError, match=message):
        Powertrain(**{"mass": 193.5, "inertia": INERTIA, **values})
