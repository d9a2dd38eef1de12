"""Booming peaks and the comparison of two pressures."""

from __future__ import annotations

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement import booming_peaks

LINES = np.arange(20.0, 61.0)


def _curve(*corners):
    """Level curve through (Hz, dB) corners."""
    frequency, level = zip(*corners, strict=True)
    return np.interp(LINES, frequency, level)


BEFORE = _curve((20, 50), (30, 70), (35, 60), (45, 75), (50, 70), (55, 74), (60, 55))


def test_prominence_is_the_rise_above_the_higher_valley():
    first, second = booming_peaks.booming_peaks(BEFORE, LINES, 1.5)
    # 30 Hz falls to 60 before 45 Hz rises higher; 45 Hz is the summit, 55 dB the higher end
    assert first == booming_peaks.BoomingPeak(30.0, 1200.0, 70.0, 10.0)
    assert second == booming_peaks.BoomingPeak(45.0, 1800.0, 75.0, 20.0)


def test_the_ends_of_the_band_are_no_peaks():
    assert booming_peaks.booming_peaks(_curve((20, 80), (40, 50), (60, 80)), LINES, 2.0) == ()


def test_peaks_are_paired_by_frequency_and_not_line_by_line():
    after = _curve((20, 50), (31, 66), (35, 58), (45, 72), (49, 71), (60, 55))
    first, second = booming_peaks.compare_peaks(BEFORE, after, LINES, 1.5)
    assert (first.before.frequency, first.after.frequency) == (30.0, 31.0)
    assert (first.frequency, first.level_before, first.level_after) == (30.0, 70.0, 66.0)
    assert (second.before.frequency, second.after.frequency) == (45.0, 45.0)


def test_a_peak_that_is_gone_shows_the_highest_level_near_it():
    after = _curve((20, 70), (28, 50), (45, 75), (60, 55))
    gone, stays = booming_peaks.compare_peaks(BEFORE, after, LINES, 1.5)
    assert gone.after is None
    assert gone.level_after == after[LINES == 31.0][0]
    assert stays.after.level == 75.0


def test_a_new_peak_is_listed_at_its_own_frequency():
    before = _curve((20, 78), (60, 55))  # louder below
    new, _ = booming_peaks.compare_peaks(before, BEFORE, LINES, 1.5)
    assert new.before is None
    assert (new.frequency, new.level_after) == (30.0, 70.0)
    assert new.level_before == before[LINES == 29.0][0]


def test_each_peak_is_paired_once_the_closest_first():
    fine = np.arange(20.0, 60.1, 0.5)
    before = np.interp(fine, [20, 40, 60], [40, 70, 40])
    after = np.interp(fine, [20, 38.5, 39.5, 41, 60], [40, 70, 60, 72, 40])
    new, kept = booming_peaks.compare_peaks(before, after, fine, 1.5)
    assert (new.frequency, new.before) == (38.5, None)
    assert (kept.before.frequency, kept.after.frequency) == (40.0, 41.0)


def test_refuses():
    with pytest.raises(InputError, match="level at 33 Hz is not finite"):
        booming_peaks.booming_peaks(np.where(LINES == 33.0, -np.inf, 60.0), LINES, 1.5)
    with pytest.raises(InputError, match=r"shape \(2, 41\) are no curve over 41 lines"):
        booming_peaks.booming_peaks(np.full((2, LINES.size), 60.0), LINES, 1.5)
    curve = resonances(30.0)
    with pytest.raises(InputError, match="no line between 70 and 80 Hz"):
        booming_peaks.compare_pressure(FREQUENCY, 1.5, curve, curve, (70.0, 80.0))


DEEPER = _curve((20, 50), (30, 70), (35, 60), (45, 75), (50, 66), (55, 74), (60, 55))


def test_peaks_of_two_curves_are_matched_and_the_others_reported():
    measured = booming_peaks.booming_peaks(DEEPER, LINES, 1.5)
    finer = np.arange(20.0, 60.1, 0.25)
    synthesised = np.interp(finer, [20, 30.5, 35, 40, 43, 46.25, 60], [50, 68, 58, 67, 60, 74, 50])
    match = booming_peaks.match_peaks(
        measured, booming_peaks.booming_peaks(synthesised, finer, 1.5)
    )
    assert [(first.frequency, second.frequency) for first, second in match.pairs] == [
        (30, 30.5),
        (45, 46.25),
    ]
    np.testing.assert_allclose(match.level_deviations, [-2.0, -1.0])
    assert [peak.frequency for peak in match.only_reference] == [55.0]
    assert [peak.frequency for peak in match.only_compared] == [40.0]


FREQUENCY = np.arange(20.0, 60.25, 0.25)


def resonances(*frequencies, size=1.0):
    """Pressure of some modes with 2 % damping [Pa]."""
    ratio = FREQUENCY[:, np.newaxis] / np.array(frequencies)
    return size * np.sum(0.001 / (1 - ratio**2 + 0.04j * ratio), axis=1)


def test_a_common_factor_is_scale_and_no_shape():
    curve = resonances(30.0)
    comparison = booming_peaks.PressureComparison(
        FREQUENCY, 1.5, curve, 1.25 * np.exp(0.3j) * curve
    )
    assert comparison.corr_f == pytest.approx(0.0, abs=1e-12)
    assert comparison.corr_s == pytest.approx(0.25)
    assert comparison.peak_deviation == pytest.approx(20 * np.log10(1.25))


def test_peaks_are_paired_and_the_others_stay_alone():
    measured, synthesised = resonances(26.0, 40.0), resonances(26.5, 52.0, size=2.0)
    comparison = booming_peaks.compare_pressure(FREQUENCY, 1.5, measured, synthesised, (22.0, 58.0))
    assert comparison.frequency[[0, -1]].tolist() == [22.0, 58.0]
    ((first, second),) = comparison.peaks.pairs
    assert (first.frequency, second.frequency) == (26.0, 26.5)
    assert [peak.frequency for peak in comparison.peaks.only_reference] == [40.0]
    assert [peak.frequency for peak in comparison.peaks.only_compared] == [52.0]
    assert comparison.peak_deviation == pytest.approx(second.level - first.level)


def test_without_a_pair_there_is_no_deviation():
    comparison = booming_peaks.PressureComparison(
        FREQUENCY, 1.5, resonances(26.0), resonances(40.0)
    )
    assert np.isnan(comparison.peak_deviation)
