import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.sound_level import (
    REFERENCE_PRESSURE,
    a_weighting,
    band_energy_level,
    energy_sum,
    mean_level,
    peak_level,
    spl,
    splv,
    unweighted_level,
)

FREQUENCY = np.array([20.0, 30.0, 40.0])


def test_reference_pressure_is_zero_decibels():
    assert unweighted_level(np.sqrt(2) * REFERENCE_PRESSURE) == pytest.approx(0, abs=1e-12)


def test_silence_is_minus_infinity():
    np.testing.assert_array_equal(spl([0.0, 0.0, 0.0], FREQUENCY), -np.inf)
    assert energy_sum([-np.inf, -np.inf]) == -np.inf


def test_energy_sum_hears_the_lines_that_sound():
    assert energy_sum([-np.inf, 60.0]) == pytest.approx(60.0)
    assert energy_sum([60.0, 60.0]) == pytest.approx(60 + 10 * np.log10(2))


@pytest.mark.parametrize("axis", [0, 1, 2, -1])
def test_frequency_axis_can_stand_anywhere(axis):
    pressure = np.random.default_rng(1).normal(size=(3, 4, 3)) + 1j
    pressure_first = np.moveaxis(pressure, 0, axis)
    expected = unweighted_level(pressure) + a_weighting(FREQUENCY)[:, np.newaxis, np.newaxis]
    level = spl(pressure_first, FREQUENCY, axis=axis)
    np.testing.assert_allclose(np.moveaxis(level, axis, 0), expected)
    for reduce in (splv, mean_level, energy_sum, peak_level):
        np.testing.assert_allclose(reduce(level, axis=axis), reduce(expected))
    np.testing.assert_allclose(
        band_energy_level(level, FREQUENCY, (25.0, 40.0), axis=axis), energy_sum(expected[1:])
    )


def test_indices_of_one_curve_have_their_own_meanings():
    level = np.array([50.0, 70.0, 60.0])
    assert splv(level) == 180
    assert mean_level(level) == 60
    assert peak_level(level) == 70
    assert energy_sum(level) == pytest.approx(10 * np.log10(1e5 + 1e7 + 1e6))


def test_indices_do_not_rank_alike():
    notched, flat = np.array([20.0, 70.0, 60.0]), np.array([55.0, 60.0, 60.0])
    assert splv(notched) < splv(flat)
    assert energy_sum(notched) > energy_sum(flat)


def test_band_edges_belong_to_the_band():
    level = np.array([50.0, 70.0, 60.0])
    assert band_energy_level(level, FREQUENCY, (20.0, 40.0)) == pytest.approx(energy_sum(level))
    assert band_energy_level(level, FREQUENCY, (30.0, 30.0)) == pytest.approx(70)


@pytest.mark.parametrize("frequency", [0.0, -20.0, np.nan, np.inf])
def test_frequencies_without_a_weighting_are_refused(frequency):
    with pytest.raises(InputError, match="positive, finite frequencies"):
        a_weighting([30.0, frequency])


def test_a_band_without_lines_is_refused():
    with pytest.raises(InputError, match=r"no line between 100.0 and 200.0 Hz.*20.0 to 40.0 Hz"):
        band_energy_level([50.0, 70.0, 60.0], FREQUENCY, (100.0, 200.0))
    with pytest.raises(InputError, match="lower edge first"):
        band_energy_level([50.0, 70.0, 60.0], FREQUENCY, (40.0, 20.0))


def test_a_wrong_frequency_axis_is_refused():
    with pytest.raises(InputError, match=r"axis 0 of shape \(2, 3\)"):
        spl(np.ones((2, 3)), FREQUENCY)
    with pytest.raises(InputError, match="give the axis that holds the lines"):
        band_energy_level(np.ones(4), FREQUENCY, (20.0, 40.0))
