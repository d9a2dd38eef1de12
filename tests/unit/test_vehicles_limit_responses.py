"""Levels that can be limited: values against the index, derivatives against differences."""

from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.study.platform_model import Motion, MountSource, motion_index, operation
from deboom.vehicles.limit_responses import MeanLevel, PeakLevel, ScatteredLevel

PLATFORM = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"
BAND = (25.0, 40.0)


@pytest.fixture(scope="module")
def runs():
    cases = ["g5_wot220", "g6_wot160=0.5"]
    return operation(read_platform(PLATFORM), cases, MountSource.spectra, "F39", (20, 60))


@pytest.fixture(scope="module", params=[Motion.prescribed, Motion.coupled])
def index(request, runs):
    return motion_index(runs, request.param, None)


def designs(index, count):
    return np.random.default_rng(1).uniform(0.8, 1.2, (count, len(index.variable_names)))


def differences(response, rows):
    steps = 1e-6 * np.eye(rows.shape[1])
    return np.stack(
        [(response(rows + step) - response(rows - step)) / 2e-6 for step in steps], axis=-1
    )


def test_the_peak_is_the_loudest_line_of_all_load_cases(index):
    rows = designs(index, 7)
    inside = (index.frequency >= BAND[0]) & (index.frequency <= BAND[1])
    levels = [index.levels(rows, name)[:, :, inside] for name in index.load_case_names]
    expected = np.maximum(*(one.max(axis=-1) for one in levels))
    peak = PeakLevel(index, BAND)
    assert peak(rows) == pytest.approx(expected, abs=1e-10)
    lines = index.frequency[inside]
    loudest = np.concatenate(levels, axis=-1).argmax(axis=-1) % lines.size
    assert np.array_equal(peak.frequency(rows), lines[loudest])
    assert (peak.variable_names, peak.response_names) == (
        index.variable_names,
        index.response_names,
    )


def test_a_peak_has_the_derivative_of_its_line(index):
    peak, rows = PeakLevel(index, BAND), designs(index, 3)
    assert peak.gradient(rows) == pytest.approx(differences(peak, rows), abs=1e-5)


def test_the_mean_level_is_splv_over_the_lines(index):
    mean, rows = MeanLevel(index), designs(index, 3)
    assert mean(rows) == pytest.approx(index(rows) / 161, rel=1e-14)
    assert mean.gradient(rows) == pytest.approx(differences(mean, rows), abs=1e-5)
    assert mean.response_unit == "dB(A)"


def test_scatter_adds_its_mean_energy_to_each_line(index):
    today, sigma = np.ones(len(index.variable_names)), np.full(len(index.variable_names), 0.02)
    level = ScatteredLevel(index, today, sigma)
    draws = np.random.default_rng(2).standard_normal((1000, today.size))
    expected = np.zeros(len(index.response_names))
    for name, weight in zip(index.load_case_names, index.weights, strict=True):
        energy = np.mean(10.0 ** (index.levels(1.0 + sigma * draws, name) / 10.0), axis=0)
        expected += weight * 10.0 * np.log10(energy).mean(axis=-1)
    assert level(today[np.newaxis])[0] == pytest.approx(expected, abs=0.04)
    nothing = ScatteredLevel(index, today, 0.0 * sigma)
    rows = designs(index, 3)
    assert nothing(rows) == pytest.approx(MeanLevel(index)(rows), abs=1e-9)
    assert level.gradient(rows) == pytest.approx(differences(level, rows), abs=1e-5)


def test_a_band_without_lines_is_refused(index):
    with pytest.raises(InputError, match="no line between 70 and 80 Hz"):
        PeakLevel(index, (70.0, 80.0))


def test_a_motion_that_follows_the_amplitude_is_refused():
    runs = operation(read_platform(PLATFORM), None, MountSource.library, "F39", (20, 60))
    follows = motion_index(runs, Motion.amplitude, None)
    with pytest.raises(InputError, match="prescribed or coupled motion"):
        PeakLevel(follows, BAND)
    with pytest.raises(InputError, match="levels with scatter need prescribed"):
        ScatteredLevel(follows, np.ones(12), np.zeros(12))
