"""Conversions between the forms of frequency response functions, and their condition number."""

import itertools

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.frf import (
    FrfForm,
    convert,
    scaled_condition_number,
    scaled_forward_condition_number,
)
from deboom.physics.rigid_body import forward_matrices

FREQUENCY = np.array([15.0, 40.0, 140.0])


def _matrix(n_output=3, n_input=3):
    rng = np.random.default_rng(5)
    shape = (FREQUENCY.size, n_output, n_input)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


@pytest.mark.parametrize(("source", "target"), list(itertools.product(FrfForm, repeat=2)))
def test_every_pair_of_forms_round_trips(source, target):
    values = _matrix()
    there = convert(values, FREQUENCY, source, target)
    back = convert(there, FREQUENCY, target, source)
    np.testing.assert_allclose(back, values, rtol=1e-12, atol=1e-13)


def test_the_same_form_changes_nothing():
    values = _matrix()
    same = convert(values, FREQUENCY, FrfForm.MOBILITY, FrfForm.MOBILITY)
    np.testing.assert_array_equal(same, values)


def test_two_derivatives_leave_no_rounding_in_the_other_component():
    real = _matrix().real.astype(complex)
    inertance = convert(real, FREQUENCY, FrfForm.RECEPTANCE, FrfForm.INERTANCE)
    np.testing.assert_array_equal(inertance.imag, 0.0)


def test_rectangular_functions_have_derivatives_but_no_inverse():
    values = _matrix(4, 3)
    assert convert(values, FREQUENCY, FrfForm.MOBILITY, FrfForm.INERTANCE).shape == (3, 4, 3)
    with pytest.raises(InputError, match="4 outputs by 3 inputs"):
        convert(values, FREQUENCY, FrfForm.MOBILITY, FrfForm.IMPEDANCE)


def test_a_singular_line_is_named():
    values = _matrix()
    values[1] = np.outer([1, 2, 3], [1j, 2, 3])
    with pytest.raises(InputError, match=r"first at 40.0 Hz \(rank 1 of 3\)"):
        convert(values, FREQUENCY, FrfForm.INERTANCE, FrfForm.APPARENT_MASS)


def test_zero_frequency_is_refused_only_where_it_divides():
    lines = np.array([0.0, 10.0, 20.0])
    inertance = convert(_matrix(), lines, FrfForm.RECEPTANCE, FrfForm.INERTANCE)
    np.testing.assert_array_equal(inertance[0], 0)
    with pytest.raises(InputError, match="0 Hz"):
        convert(_matrix(), lines, FrfForm.INERTANCE, FrfForm.RECEPTANCE)


@pytest.mark.parametrize("values", [np.ones(3), np.ones((3, 3)), np.ones((2, 3, 3))])
def test_shapes_that_do_not_fit_the_frequency_are_refused(values):
    with pytest.raises(InputError, match="n_frequency, n_output, n_input"):
        convert(values, FREQUENCY, FrfForm.RECEPTANCE, FrfForm.MOBILITY)


def test_scaled_condition_number_is_the_same_in_both_units_and_for_the_inverse():
    """Millimetres in place of metres change the plain number, the scaled one not."""
    metres = _matrix(6, 6)
    units = np.repeat([1.0, 1e3], 3)
    millimetres = metres / np.outer(units, units)
    scaled = scaled_condition_number(metres, FrfForm.INERTANCE, 0.055)
    assert scaled.shape == (3,)
    np.testing.assert_allclose(
        scaled_condition_number(millimetres, FrfForm.INERTANCE, 55.0), scaled, rtol=1e-9
    )
    assert np.all(np.linalg.cond(millimetres) > 100 * np.linalg.cond(metres))
    inverse = convert(metres, FREQUENCY, FrfForm.INERTANCE, FrfForm.APPARENT_MASS)
    np.testing.assert_allclose(
        scaled_condition_number(inverse, FrfForm.APPARENT_MASS, 0.055), scaled, rtol=1e-9
    )


def test_scaled_condition_number_of_sensors():
    """Six sensors on the axes at one distance see all six motions alike at that distance."""
    positions = 0.1 * np.vstack([np.eye(3), -np.eye(3)])
    forward = forward_matrices(positions)
    # translations: 6 sensors each; rotations: 4 sensors each, at the distance 0.1 m
    assert scaled_forward_condition_number(forward, 0.1) == pytest.approx(np.sqrt(6 / 4))
    assert np.linalg.cond(forward) == pytest.approx(10 * np.sqrt(6 / 4))
    two = forward_matrices([[0, 0, 0], [0.1, 0, 0]])
    assert scaled_forward_condition_number(two, 0.1) > 1e12


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan])
def test_a_length_that_is_not_positive_is_refused(length):
    with pytest.raises(InputError, match="characteristic length"):
        scaled_condition_number(np.eye(6), FrfForm.APPARENT_MASS, length)


def test_condition_numbers_need_six_degrees_of_freedom():
    with pytest.raises(InputError, match="6×6"):
        scaled_condition_number(np.eye(3), FrfForm.INERTANCE, 0.1)
    with pytest.raises(InputError, match="six columns"):
        scaled_forward_condition_number(np.eye(3), 0.1)
