"""Third octaves by the edges of IEC 61260-1 and the power of known signals; Campbell diagrams."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import TimeRecord
from deboom.measurement.signal_views import campbell, third_octaves

RATE = 1024.0
TIME = np.arange(int(64 * RATE)) / RATE


def record(*signals):
    values = np.column_stack(signals)
    return TimeRecord(values, RATE, tuple(f"c{n}" for n in range(len(signals))), "Pa")


def test_bands_have_the_middles_and_names_of_the_standard():
    bands = third_octaves(record(np.sin(TIME)), 200.0)
    assert bands.nominal[:4] == (10.0, 12.5, 16.0, 20.0)
    assert bands.nominal[-1] == 160.0  # the band of 200 Hz ends above the highest line
    assert bands.midband[bands.nominal.index(100.0)] == pytest.approx(100.0)
    assert bands.midband[bands.nominal.index(31.5)] == pytest.approx(31.6228, abs=1e-4)


def test_a_tone_counts_in_its_own_band_and_noise_in_all_by_their_width():
    """White noise of variance σ² has ``2 σ² Δf / rate`` in a band of Δf."""
    tone = np.sqrt(2) * 3 * np.sin(2 * np.pi * 31.4 * TIME)
    noise = np.random.default_rng(1).normal(scale=2.0, size=TIME.size)
    bands = third_octaves(record(tone, noise), 400.0)
    own = bands.nominal.index(31.5)
    assert bands.rms[own, 0] == pytest.approx(3.0, rel=1e-3)
    assert np.delete(bands.rms[:, 0], own).max() < 0.01
    width = bands.midband * (10**0.05 - 10**-0.05)
    wide = width > 20  # of many lines, whose mean is told
    assert wide.any()
    np.testing.assert_allclose(bands.rms[wide, 1], 2.0 * np.sqrt(2 * width[wide] / RATE), rtol=0.04)


def test_the_mean_over_time_of_a_campbell_diagram_is_the_tone():
    tone = np.sqrt(2) * 3 * np.sin(2 * np.pi * 40 * TIME)
    spectrum = campbell(record(tone, 0 * tone), 100.0)
    line = int(np.argmax(spectrum.rms.mean(axis=1)))
    assert spectrum.frequency[line] == 40.0
    np.testing.assert_allclose(spectrum.rms[line], 3 / np.sqrt(2), rtol=1e-6)


def test_records_that_are_too_short_are_refused():
    short = TimeRecord(np.zeros((100, 1)), RATE, ("a",), "Pa")
    with pytest.raises(InputError, match="no third octave of 4 lines"):
        third_octaves(short, 200.0)
    with pytest.raises(InputError, match=r"of 0\.10 s is too short for a Campbell diagram"):
        campbell(short, 200.0)
