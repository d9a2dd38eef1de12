"""Computed order tracking against the discrete Fourier transform, closed forms and known chirps."""

import numpy as np
import pytest
from scipy import integrate, optimize, signal

from deboom.physics.order_tracking import angular_resample, order_amplitudes, samples_needed
from deboom.physics.order_tracking_rate import lower_rate
from deboom.physics.order_tracking_resolution import (
    HANN_HALF_POWER_WIDTH,
    HANN_NOISE_WIDTH,
    hann_bandwidth,
    hann_noise_bandwidth,
    noise_amplitude,
    smear,
)

RATE = 16384.0


def run_up(first_rpm, last_rpm, duration, rate=RATE):
    """Time, shaft angle [rad] and speed [1/min] of a linear run-up."""
    time = np.arange(round(duration * rate)) / rate
    slope = (last_rpm - first_rpm) / duration
    return time, 2 * np.pi / 60 * (first_rpm * time + slope * time**2 / 2), first_rpm + slope * time


def track(values, angle, order, centre, revolutions, rate=RATE, slowest_rpm=600.0):
    needed = samples_needed(rate, slowest_rpm, np.max(order))
    revolution, resampled = angular_resample(values, angle, needed)
    return order_amplitudes(revolution, resampled, order, centre, revolutions)


def test_constants_of_the_hann_window():
    def transform(bins):
        return np.sinc(bins) / (1 - bins**2)

    half = optimize.brentq(lambda bins: transform(bins) - np.sqrt(0.5), 0.5, 0.9)
    assert pytest.approx(2 * half, rel=1e-7) == HANN_HALF_POWER_WIDTH
    window = signal.windows.hann(1000, sym=False)
    noise = window.size * np.sum(window**2) / window.sum() ** 2
    assert pytest.approx(noise, rel=1e-9) == HANN_NOISE_WIDTH


@pytest.mark.parametrize("per_revolution", [100, 128])
def test_constant_speed_is_a_windowed_fourier_transform(per_revolution):
    """1800 1/min at 3 kHz: 100 samples in a revolution, so order lines are lines of the DFT."""
    rng = np.random.default_rng(1)
    orders = np.array([0.5, 1.0, 1.5, 3.0, 4.5])
    amplitudes = rng.normal(size=(5, 2)) + 1j * rng.normal(size=(5, 2))
    angle = 2 * np.pi * np.arange(3000) / 100
    record = np.real(np.exp(1j * np.outer(angle, orders)) @ amplitudes)
    found = order_amplitudes(
        *angular_resample(record, angle, per_revolution), orders, [12.0], revolutions=8
    )[0]
    window = signal.windows.hann(800, sym=False)[:, np.newaxis]
    spectrum = 2 * np.fft.fft(window * record[800:1600], axis=0) / window.sum()
    np.testing.assert_allclose(found, spectrum[(orders * 8).astype(int)], atol=1e-6)
    np.testing.assert_allclose(found, amplitudes, atol=1e-6)


@pytest.mark.parametrize("part", [0.1, 0.2, 0.25])
def test_resampling_loses_what_a_quintic_spline_must_lose(part):
    """Closed form of the cardinal spline's frequency response; order at a part of the rate."""
    angle = 2 * np.pi * np.arange(4000) / 100
    record = np.cos(100 * part * angle)[:, np.newaxis]
    found = order_amplitudes(*angular_resample(record, angle, 331), [100 * part], [20.0], 20)
    shifts = np.arange(-50, 51)
    kept = 1 / np.sum((part / (part + shifts)) ** 6)
    assert found[0, 0, 0] == pytest.approx(kept, abs=2e-8)


@pytest.mark.parametrize("falling", [False, True])
def test_chirp_of_known_amplitude_and_phase(falling):
    """800 to 3000 1/min in 5 s, constant complex amplitudes: no smear, whatever the ramp."""
    time, angle, rpm = run_up(*((3000.0, 800.0) if falling else (800.0, 3000.0)), 5.0)
    amplitude = 2.5 * np.exp(0.7j)
    record = np.real(amplitude * np.exp(1.5j * angle))[:, np.newaxis]
    wanted = np.arange(1000.0, 2801.0, 100.0)
    instant = np.interp(wanted, rpm[::-1], time[::-1]) if falling else np.interp(wanted, rpm, time)
    centre = np.interp(instant, time, angle) / (2 * np.pi)
    found = track(record, angle, [1.5], centre, 8)[:, 0, 0]
    np.testing.assert_allclose(np.abs(found / amplitude), 1, atol=1e-5)
    np.testing.assert_allclose(np.rad2deg(np.angle(found / amplitude)), 0, atol=1e-3)


def test_fixed_window_of_the_study_smears_and_orders_do_not():
    """A ramp of 0.67 Hz/s read for 8 s: 5 Hz wide in frequency, a line in order."""
    rate = 1024.0
    rpm_per_second = 0.67 * 60 / 1.5
    time, angle, _ = run_up(1600 - 15 * rpm_per_second, 1600 + 15 * rpm_per_second, 30.0, rate)
    record = np.cos(1.5 * angle + 0.2)
    about = np.abs(time - 15) < 4
    window = np.cos(np.pi * (time[about] - 15) / 8) ** 2
    spectrum = 2 * np.abs(np.fft.rfft(window * record[about])) / window.sum()
    assert spectrum.max() < 0.7
    lines = np.fft.rfftfreq(about.sum(), 1 / rate)
    wide = lines[spectrum > spectrum.max() / np.sqrt(2)]
    assert np.ptp(wide) > 1.5
    middle = np.interp(15, time, angle) / (2 * np.pi)
    found = track(record[:, np.newaxis], angle, [1.5], [middle], 8 * 1600 / 60, rate)[0, 0, 0]
    assert abs(found - np.exp(0.2j)) < 1e-5


def test_four_revolutions_separate_half_orders_and_three_do_not():
    _, angle, _ = run_up(900.0, 2400.0, 4.0)
    orders = np.array([0.5, 1.0, 1.5, 2.0, 3.0])
    amplitudes = np.array([0.3, 5.0, 1.0, 4.0, 2.0]) * np.exp(1j * np.arange(5.0))
    record = np.real(np.exp(1j * np.outer(angle, orders)) @ amplitudes)[:, np.newaxis] + 100
    four = track(record, angle, orders, [20.0, 50.0, 80.0], 4)[:, :, 0]
    np.testing.assert_allclose(four, np.tile(amplitudes, (3, 1)), atol=1e-4)
    three = track(record, angle, [1.5], [20.0, 50.0, 80.0], 3)[:, 0, 0]
    assert np.abs(three - amplitudes[2]).max() > 0.5


def test_a_changing_amplitude_is_averaged_over_the_window():
    """A(θ) quadratic: the window adds half its curvature times the window's variance."""
    _, angle, _ = run_up(1500.0, 1800.0, 3.0)
    revolutions, centre = 10, 40.0
    from_centre = angle / (2 * np.pi) - centre
    curvature = 0.02 * np.exp(0.4j)
    amplitude = 1 + (0.03 - 0.01j) * from_centre + curvature / 2 * from_centre**2
    record = np.real(amplitude * np.exp(3j * angle))[:, np.newaxis]
    found = track(record, angle, [3.0], [centre], revolutions)[0, 0, 0]
    variance = revolutions**2 * (1 / 12 - 1 / (2 * np.pi**2))
    # the mirror image of the changing order leaks by 2e-4
    assert abs(found - (1 + curvature / 2 * variance)) < 3e-4


def test_stated_smear_is_what_a_ripple_loses():
    """A ripple with the stated period comes out at 1/√2; one four times as long stays."""
    order, revolutions, middle = 3.0, 12.0, 1500.0
    time, angle, rpm = run_up(1200.0, 1800.0, 12.0)
    sweep = order / 60 * np.gradient(rpm, time)[0]
    stated = float(smear(sweep, hann_bandwidth(middle, revolutions)))
    lines = middle + 60 / order * stated * np.linspace(-0.5, 0.5, 9)[:-1]
    centre = np.interp(np.interp(lines, rpm, time), time, angle) / (2 * np.pi)
    for factor, kept in ((1.0, np.sqrt(0.5)), (4.0, 0.98)):
        spacing = stated * factor * 60 / order
        ripple = 1 + 0.2 * np.cos(2 * np.pi * (rpm - middle) / spacing)
        record = (ripple * np.cos(order * angle))[:, np.newaxis]
        found = track(record, angle, [order], centre, revolutions)[:, 0, 0]
        expected = 0.2 * np.cos(2 * np.pi * (lines - middle) / spacing)
        gain = np.linalg.lstsq(expected[:, np.newaxis], found.real - 1, rcond=None)[0][0]
        assert gain == pytest.approx(kept, rel=0.01)


def test_noise_floor():
    """White noise in 60 channels at 1500 1/min: the rms amplitude of an order that is not there."""
    rng = np.random.default_rng(3)
    rate, revolutions, sigma = 2048.0, 8.0, 0.7
    _, angle, _ = run_up(1500.0, 1500.0, 4.0, rate)
    record = rng.normal(0, sigma, (angle.size, 60))
    centre = np.arange(5.0, 96.0, 4.0)
    found = track(record, angle, [1.5], centre, revolutions, rate, 1500.0)
    measured = np.sqrt(np.mean(np.abs(found) ** 2))
    expected = noise_amplitude(2 * sigma**2 / rate, hann_noise_bandwidth(1500.0, revolutions))
    assert measured == pytest.approx(float(expected), rel=0.05)


def test_lower_rate_keeps_orders_and_removes_what_would_fold():
    """Up to 160 Hz unchanged to 1e-5; at 1500 Hz, which would fold to 11 Hz, nothing is left."""
    time = np.arange(16384 * 3) / RATE
    below = np.cos(2 * np.pi * np.array([0.0, 17.0, 100.0, 160.0]) * time[:, np.newaxis] + 0.3)
    above = np.cos(2 * np.pi * np.array([1500.0, 4000.0]) * time[:, np.newaxis])
    values, rate = lower_rate(np.hstack([below, above]), RATE, 160.0)
    assert rate == RATE / 10
    inside = slice(10, -10)
    np.testing.assert_allclose(values[inside, :4], below[::10][inside], atol=2e-5)
    folded = np.abs(2 * np.fft.rfft(values[inside, 4:], axis=0)) / len(values[inside])
    lines = np.fft.rfftfreq(len(values[inside]), 1 / rate)
    assert folded[lines <= 160].max() < 2e-5


def test_hann_amplitude_against_an_integral_in_time():
    """∫ w(θ) y e^{−jqθ} dθ with dθ = θ' dt needs no resampling: another way to the same number."""
    time, angle, rpm = run_up(1000.0, 2500.0, 3.0)
    record = np.cos(1.5 * angle + 1) * (1 + 0.3 * np.sin(2 * time)) + np.cos(2.2 * angle)
    revolutions, centre = 6.0, 40.0
    turn = angle / (2 * np.pi) - centre
    weight = np.where(np.abs(turn) < revolutions / 2, np.cos(np.pi * turn / revolutions) ** 2, 0)
    turned = weight * record * np.exp(-1.5j * angle)
    expected = 4 / revolutions * integrate.trapezoid(turned * rpm / 60, time)
    found = track(record[:, np.newaxis], angle, [1.5], [centre], revolutions)[0, 0, 0]
    assert abs(found - expected) < 1e-6
