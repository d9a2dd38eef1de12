import numpy as np
import pytest
from scipy.signal import hilbert

from deboom.errors import InputError
from deboom.physics.sound_level import (
    a_weighting,
    band_energy_level,
    energy_sum,
    mean_level,
    peak_level,
    run_up_sound,
    spl,
    splv,
    unweighted_level,
)

FREQUENCY = np.array([20.0, 30.0, 40.0])


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


def test_a_run_up_holds_the_level_of_a_steady_order():
    """Of 1 Pa at all lines: the analytic signal is 1 Pa long, its frequency rises evenly."""
    lines = np.arange(20.0, 61.0)
    sound = run_up_sound(np.exp(0.7j) * np.ones(41), lines, 8.0, 2048.0)
    analytic = hilbert(sound)[800:-800]
    assert np.abs(analytic) == pytest.approx(np.ones(analytic.size), abs=0.01)
    frequency = np.diff(np.unwrap(np.angle(analytic))) * 2048.0 / (2 * np.pi)
    time = (800 + 0.5 + np.arange(frequency.size)) / 2048.0
    assert frequency == pytest.approx(20.0 + 5.0 * time, abs=0.2)
    assert sound[0] == pytest.approx(np.cos(0.7), rel=1e-12)


def test_a_run_up_passes_each_pressure_at_its_line():
    lines, pressure = np.array([20.0, 30.0, 60.0]), np.array([[0.1], [0.5], [0.2]])
    sound = run_up_sound(pressure, lines, 40.0, 4096.0)
    assert sound.shape == (163840, 1)
    length = np.abs(hilbert(sound[:, 0]))
    at = np.array([5, 10, 25]) * 4096
    assert length[at] == pytest.approx([0.3, 0.5, 0.35], rel=0.01)


@pytest.mark.parametrize(
    ("lines", "seconds", "rate", "words"),
    [
        ([20.0], 1.0, 1e3, "two lines or more"),
        ([30.0, 20.0], 1.0, 1e3, "in rising order"),
        ([20.0, 30.0], 0.0, 1e3, "give a time above 0"),
        ([20.0, 30.0], 1.0, 120.0, "more than 120 samples"),
    ],
)
def test_a_run_up_that_cannot_be_is_refused(lines, seconds, rate, words):
    with pytest.raises(InputError, match=words):
        run_up_sound(np.ones(len(lines)), lines, seconds, rate)
