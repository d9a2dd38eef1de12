"""Two pressures beside each other: shape, scale, peaks."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.vehicles.pressure_comparison import PressureComparison, compare_pressure

FREQUENCY = np.arange(20.0, 60.25, 0.25)


def resonances(*frequencies, size=1.0):
    """Pressure of some modes with 2 % damping [Pa]."""
    ratio = FREQUENCY[:, np.newaxis] / np.array(frequencies)
    return size * np.sum(0.001 / (1 - ratio**2 + 0.04j * ratio), axis=1)


def test_a_common_factor_is_scale_and_no_shape():
    one = resonances(30.0)
    found = PressureComparison(FREQUENCY, 1.5, one, 1.25 * np.exp(0.3j) * one)
    assert found.corr_f == pytest.approx(0.0, abs=1e-12)
    assert found.corr_f_magnitude == pytest.approx(0.0, abs=1e-12)
    assert found.corr_s_magnitude == pytest.approx(1 - 1 / 1.25)
    assert found.corr_s_of_reference == pytest.approx(0.25)
    assert found.corr_s == pytest.approx(abs(1 - np.exp(-0.3j) / 1.25))
    level = 20 * np.log10(1.25)
    assert found.rms_difference == pytest.approx(level)
    assert found.peak_deviation == pytest.approx(level)


def test_peaks_are_paired_and_the_others_stay_alone():
    measured, synthesised = resonances(26.0, 40.0), resonances(26.5, 52.0, size=2.0)
    found = compare_pressure(FREQUENCY, 1.5, measured, synthesised, (22.0, 58.0))
    assert found.frequency[[0, -1]].tolist() == [22.0, 58.0]
    ((first, second),) = found.peaks.pairs
    assert (first.frequency, second.frequency) == (26.0, 26.5)
    assert [peak.frequency for peak in found.peaks.only_reference] == [40.0]
    assert [peak.frequency for peak in found.peaks.only_compared] == [52.0]
    assert found.peak_deviation == pytest.approx(second.level - first.level)


def test_without_a_pair_there_is_no_deviation():
    found = PressureComparison(FREQUENCY, 1.5, resonances(26.0), resonances(40.0))
    assert np.isnan(found.peak_deviation)


def test_bad_curves_are_refused_in_words():
    one = resonances(30.0)
    with pytest.raises(InputError, match="no line between 70 and 80 Hz"):
        compare_pressure(FREQUENCY, 1.5, one, one, (70.0, 80.0))
    with pytest.raises(InputError, match="one value per line"):
        compare_pressure(FREQUENCY, 1.5, one, one[1:], (20.0, 55.0))
    with pytest.raises(InputError, match="one value per line"):
        PressureComparison(FREQUENCY, 1.5, one, one[1:])
