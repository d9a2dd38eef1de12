"""A run-up of a compressor over time: its first order, and records that hold none."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.time_record import TimeRecord
from deboom.measurement.tracked_sweep import tracked_sweep

RATE = 2000.0


def run(first, last, seconds):
    time = np.arange(round(seconds * RATE)) / RATE
    angle = 2 * np.pi * (first * time + (last - first) / seconds * time**2 / 2 - 0.25)
    # slow edges: their half-way time is known to a small part of a sample
    return angle, np.clip(0.5 + 3 * np.sin(angle), 0, 1)


def record(values, name="A1 x", unit="m/s^2"):
    return TimeRecord(values[:, None], RATE, (name,), unit)


def test_first_order_beside_other_orders_and_noise():
    angle, tacho = run(30.0, 38.0, 8.0)
    noise = np.random.default_rng(1).normal(0, 0.05, angle.size)
    signal = 2 * np.cos(angle + 0.8) + 0.7 * np.cos(2 * angle) + 0.4 * np.sin(3 * angle)
    pure = record(3 * np.cos(angle - 1), "driver", "Pa")
    found = tracked_sweep(tacho, (record(signal + noise), pure))
    moved, sound = found.spectra
    assert moved.frequency.tolist() == [31, 32, 33, 34, 35, 36, 37]
    np.testing.assert_allclose(moved.values[:, 0], 2 * np.exp(0.8j), atol=0.02)
    np.testing.assert_allclose(sound.values[:, 0], 3 * np.exp(-1j), atol=0.02)
    assert (sound.channels, sound.unit) == (("driver",), "Pa")
    # white noise of this size leaves about σ √(2 B/rate) in each part, B near 3 Hz
    assert 0.5 < found.noise[0][0] / (0.05 * np.sqrt(2 * 3 / RATE)) < 2
    assert found.noise[1][0] < found.noise[0][0]


def test_a_run_down_has_the_same_spectra():
    angle, tacho = run(38.0, 30.0, 8.0)
    found = tracked_sweep(tacho, (record(2 * np.cos(angle + 0.8)),))
    assert found.spectra[0].frequency.tolist() == [31, 32, 33, 34, 35, 36, 37]
    np.testing.assert_allclose(found.spectra[0].values[:, 0], 2 * np.exp(0.8j), atol=0.02)


@pytest.mark.parametrize(
    ("speeds", "seconds", "words"),
    [
        ((30.0, 31.0), 0.5, "s are too short"),
        ((30.2, 30.7), 8.0, "fewer than two lines"),
    ],
)
def test_records_that_hold_no_lines_are_named(speeds, seconds, words):
    angle, tacho = run(*speeds, seconds)
    with pytest.raises(InputError, match=words):
        tracked_sweep(tacho, (record(np.cos(angle)),))


def test_a_tacho_without_pulses_is_named():
    angle, _ = run(30.0, 38.0, 8.0)
    with pytest.raises(InputError, match="carries no pulses"):
        tracked_sweep(np.zeros_like(angle), (record(np.cos(angle)),))
