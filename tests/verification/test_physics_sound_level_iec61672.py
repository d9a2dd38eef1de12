"""A-weighting against IEC 61672-1: its table, its analogue filter, and a real meter's readings."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from scipy.io import wavfile

from deboom.errors import InputError
from deboom.files.sound import run_up_files
from deboom.physics.sound_level import (
    a_weighting,
    band_energy_level,
    energy_sum,
    full_scale,
    hearing_threshold,
    mean_level,
    peak_level,
    run_up_sound,
    spl,
    splv,
    unweighted_level,
)

DATA = Path(__file__).parents[1] / "data" / "iec61672-cirrus"

# The standard's table starts at 10 Hz. Below it the meter weights by these two, the values at the
# nominal frequencies.
BELOW_THE_TABLE = {6.3: -85.4, 8.0: -77.6}


@pytest.fixture(scope="module")
def table():
    with (DATA / "iec_61672_1_2013.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {key: np.array([float(row[key]) for row in rows]) for key in ("n", "nominal", "A")}
    assert columns["n"].size == 34
    return columns


def meter(name):
    """Band's nominal frequency [Hz] and its Z, A and C levels [dB]."""
    bands, levels = [], []
    with (DATA / name).open(newline="") as file:
        for row in csv.DictReader(file):
            if not row["Band"].endswith("Hz"):
                continue
            number = row["Band"].removesuffix("Hz")
            bands.append(
                1000 * float(number.removesuffix("k")) if number.endswith("k") else float(number)
            )
            levels.append([float(row[key].removesuffix(" dB")) for key in ("Value", "A", "C")])
    return np.array(bands), np.array(levels).T


def test_table_at_exact_mid_band_frequencies(table):
    exact = 1000 * 10 ** (table["n"] / 10)
    # half a digit of the printed table is 0.05 dB: all of the difference is rounding
    np.testing.assert_allclose(a_weighting(exact), table["A"], rtol=0, atol=0.05)


@pytest.mark.parametrize(
    ("name", "sums"),
    [
        ("overall_oct_zac_comma_2dec.csv", (41.68, 36.07, 40.76)),
        ("overall_third_zac_comma_2dec.csv", (54.58, 35.17, 43.75)),
    ],
)
def test_readings_of_a_sound_level_meter(table, name, sums):
    bands, (z_level, a_level, c_level) = meter(name)
    printed = dict(zip(table["nominal"], table["A"], strict=True)) | BELOW_THE_TABLE
    weighting = np.array([printed[band] for band in bands])
    np.testing.assert_allclose(a_level, z_level + weighting, rtol=0, atol=0.01)

    exact = dict(zip(table["nominal"], 1000 * 10 ** (table["n"] / 10), strict=True))
    frequency = np.array([exact.get(band, band) for band in bands])
    ours = z_level + a_weighting(frequency)
    np.testing.assert_allclose(a_level, ours, rtol=0, atol=0.06)

    totals = [energy_sum(level) for level in (z_level, a_level, c_level)]
    np.testing.assert_allclose(totals, sums, rtol=0, atol=0.005)
    assert energy_sum(ours) == pytest.approx(sums[1], abs=0.03)


def test_one_pascal_peak_at_one_kilohertz():
    time = np.arange(48000) / 48000
    record = 1.0 * np.cos(2 * np.pi * 1000 * time + 0.4)
    level_of_record = 20 * np.log10(np.sqrt(np.mean(record**2)) / 20e-6)
    assert level_of_record == pytest.approx(90.97, abs=0.005)
    assert spl([1.0 * np.exp(0.4j)], [1000.0])[0] == pytest.approx(level_of_record, abs=1e-9)
    assert unweighted_level(1j) == pytest.approx(level_of_record, abs=1e-9)


@pytest.mark.parametrize("frequency", [25.0, 37.5, 60.0, 140.0])
def test_weighted_level_of_a_tone_in_time(frequency):
    """An A-weighting filter runs over the record; its rms gives the level without our formula."""
    rate = 48000
    time = np.arange(3 * rate) / rate
    record = 0.2 * np.cos(2 * np.pi * frequency * time)
    poles = -2 * np.pi * np.array([20.598997, 20.598997, 107.65265, 737.86223, 12194.22, 12194.22])
    gain = 1 / np.abs(signal.freqs_zpk(np.zeros(4), poles, 1.0, [2 * np.pi * 1000])[1][0])
    digital = signal.bilinear_zpk(np.zeros(4), poles, gain, rate)
    filtered = signal.sosfilt(signal.zpk2sos(*digital), record)[rate:]
    level = 20 * np.log10(np.sqrt(np.mean(filtered**2)) / 20e-6)
    assert spl([0.2], [frequency])[0] == pytest.approx(level, abs=0.01)


FREQUENCY = np.array([20.0, 30.0, 40.0])


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


def test_numbers_of_one_curve_have_their_own_meanings():
    level = np.array([50.0, 70.0, 60.0])
    energy = 10 * np.log10(1e5 + 1e7 + 1e6)
    assert (splv(level), mean_level(level), peak_level(level)) == (180, 60, 70)
    assert energy_sum(level) == pytest.approx(energy)
    # band edges belong to the band
    assert band_energy_level(level, FREQUENCY, (20.0, 40.0)) == pytest.approx(energy)
    assert band_energy_level(level, FREQUENCY, (30.0, 30.0)) == pytest.approx(70)
    # silence is minus infinity and adds nothing
    np.testing.assert_array_equal(spl([0.0, 0.0, 0.0], FREQUENCY), -np.inf)
    assert energy_sum([-np.inf, -np.inf]) == -np.inf
    assert energy_sum([-np.inf, 60.0]) == pytest.approx(60.0)


def test_a_run_up_holds_the_level_of_a_steady_order():
    """Of 1 Pa at all lines: the analytic signal is 1 Pa long, its frequency rises evenly."""
    lines = np.arange(20.0, 61.0)
    sound = run_up_sound(np.exp(0.7j) * np.ones(41), lines, 8.0, 2048.0)
    analytic = signal.hilbert(sound)[800:-800]
    assert np.abs(analytic) == pytest.approx(np.ones(analytic.size), abs=0.01)
    frequency = np.diff(np.unwrap(np.angle(analytic))) * 2048.0 / (2 * np.pi)
    time = (800 + 0.5 + np.arange(frequency.size)) / 2048.0
    assert frequency == pytest.approx(20.0 + 5.0 * time, abs=0.2)
    assert sound[0] == pytest.approx(np.cos(0.7), rel=1e-12)


def test_a_run_up_passes_each_pressure_at_its_line():
    lines, pressure = np.array([20.0, 30.0, 60.0]), np.array([[0.1], [0.5], [0.2]])
    sound = run_up_sound(pressure, lines, 40.0, 4096.0)
    assert sound.shape == (163840, 1)
    length = np.abs(signal.hilbert(sound[:, 0]))
    at = np.array([5, 10, 25]) * 4096
    assert length[at] == pytest.approx([0.3, 0.5, 0.35], rel=0.01)


def test_a_run_up_file_fades_in_and_out_over_50_ms_by_a_cosine():
    lines, pressure, rate = np.array([20.0, 60.0]), np.array([[0.2, 0.3]]), 8000
    scale = full_scale(pressure)
    (file,) = run_up_files(pressure, lines, 1.0, rate, scale)
    heard = wavfile.read(io.BytesIO(file))[1] / 32767
    unfaded = run_up_sound(pressure.T, lines, 1.0, rate)[:, 0] / scale
    time = np.arange(rate) / rate
    to_end = np.minimum(time, time[::-1])
    fade = np.where(to_end < 0.05, np.sin(np.pi * to_end / 0.1) ** 2, 1.0)
    # steps of 16 bit, and a window whose last sample is its end
    np.testing.assert_allclose(heard, fade * unfaded, rtol=0, atol=2e-4)


def test_the_threshold_of_hearing_is_that_of_iso_226_and_near_terhardts_formula():
    lines = np.array([20.0, 31.5, 50.0, 100.0, 200.0, 1000.0])
    unweighted = hearing_threshold(lines) - a_weighting(lines)
    np.testing.assert_allclose(unweighted, [78.5, 59.5, 44.0, 26.5, 14.4, 2.4], atol=1e-9)
    # 44.0 dB at 50 Hz, 37.5 dB at 63 Hz: half way on the axis of octaves
    middle = np.sqrt([50.0 * 63.0])
    assert hearing_threshold(middle) - a_weighting(middle) == pytest.approx([40.75], abs=1e-9)
    # E. Terhardt, Hearing Research 1, 1979: 3.64 f^-0.8 - 6.5 exp(-0.6 (f - 3.3)²), f in kHz
    between = np.geomspace(20.0, 1000.0, 60)
    kilo = between / 1000.0
    formula = 3.64 * kilo**-0.8 - 6.5 * np.exp(-0.6 * (kilo - 3.3) ** 2) + 1e-3 * kilo**4
    assert np.abs(hearing_threshold(between) - a_weighting(between) - formula).max() < 6.0
    assert np.all(np.diff(hearing_threshold(between)) < 0.6)
    with pytest.raises(InputError, match="known here up to 1000 Hz, not at 1200 Hz"):
        hearing_threshold(1200.0)
