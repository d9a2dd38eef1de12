"""Order tracking against known orders."""

from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from deboom.physics.order_tracking import (
    dominant_order,
    frequency_of_order,
    lower_rate,
    rpm_of_frequency,
    smear,
    vold_kalman,
)

RATE = 16384.0


def run_up(first_rpm, last_rpm, duration, rate=RATE):
    """Time, shaft angle [rad] and speed [1/min] of a linear run-up."""
    time = np.arange(round(duration * rate)) / rate
    slope = (last_rpm - first_rpm) / duration
    return time, 2 * np.pi / 60 * (first_rpm * time + slope * time**2 / 2), first_rpm + slope * time


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
    assert folded[np.fft.rfftfreq(len(values[inside]), 1 / rate) <= 160].max() < 2e-5
    np.testing.assert_array_equal(lower_rate(below, RATE, 1500.0)[0], below)


ROTA = Path(__file__).parents[1] / "data" / "rota-order" / "envelopes.csv"


def away_from_ends(time, bandwidth, times=2.0):
    return (time > times / bandwidth) & (time < time[-1] - times / bandwidth)


def test_against_dense_least_squares():
    """Two crossing orders in noise, the sum of squares written out as one dense matrix."""
    samples, rate, bandwidth = 250, 200.0, np.array([5.0, 3.0])
    time = np.arange(samples) / rate
    phase = 2 * np.pi * np.column_stack([20 * time, 15 * time + 2.5 * time**2])
    record = np.random.default_rng(1).normal(size=(samples, 2))
    weight = np.sqrt(np.sqrt(2) - 1) / (2 * np.sin(np.pi * bandwidth / 2 / rate)) ** 2
    difference = np.diff(np.eye(samples), n=2, axis=0)
    parts = [f(phase[:, k]) for k in range(2) for f in (np.cos, lambda angle: -np.sin(angle))]
    smooth = np.kron(np.diag(np.repeat(weight, 2) / np.sqrt(2)), difference)
    matrix = np.vstack([np.hstack([np.diag(part) for part in parts]), smooth])
    right = np.vstack([record, np.zeros((len(smooth), 2))])
    dense = np.linalg.lstsq(matrix, right, rcond=None)[0].reshape(4, samples, 2)
    envelope = vold_kalman(record, phase, rate, bandwidth)
    np.testing.assert_allclose(envelope[:, 0], dense[0] + 1j * dense[1], atol=1e-7)
    np.testing.assert_allclose(envelope[:, 1], dense[2] + 1j * dense[3], atol=1e-7)


def test_modulated_order_passes_by_the_transfer_function():
    """One sideband of an order, 0 to 2.5 times the half bandwidth away."""
    rate, bandwidth, order = 1024.0, 6.0, 3.0
    time, angle, _ = run_up(1800.0, 2400.0, 6.0, rate)
    rates = np.array([0.0, 1.0, 3.0, 5.0, 7.5])
    turning = np.exp(2j * np.pi * np.outer(time, rates))
    record = np.real(turning * np.exp(1j * order * angle)[:, np.newaxis])
    envelope = vold_kalman(record, order * angle[:, np.newaxis], rate, bandwidth)[:, 0]
    inside = away_from_ends(time, bandwidth)
    gain = np.mean((envelope / turning)[inside], axis=0)
    # H = 1/(1 + r² (2 sin(πf/rate))⁴), 1/√2 at half the bandwidth
    step = np.sin(np.pi * rates / rate) / np.sin(np.pi * bandwidth / 2 / rate)
    expected = 1 / (1 + (np.sqrt(2) - 1) * step**4)
    assert expected[2] == pytest.approx(np.sqrt(0.5), rel=1e-12)
    # the mirror image at twice the order's frequency averages out
    np.testing.assert_allclose(gain, expected, atol=1e-3)


def test_against_another_code():
    """Three orders, one through a resonance, and a tone that nobody tracks; ROTA 0.3.0."""
    table = np.loadtxt(ROTA, delimiter=",", skiprows=1)
    rate = 2048.0
    time, angle, rpm = run_up(900.0, 2700.0, 8.0, rate)
    frequency = 1.5 * rpm / 60
    main = 2j / (1 - (frequency / 42) ** 2 + 0.12j * frequency / 42)
    record = np.real(main * np.exp(1.5j * angle)) + 0.5 * np.cos(0.5 * angle + 1)
    record += np.cos(3 * angle - 0.4) + 0.3 * np.cos(2 * np.pi * 50 * time)
    phase = np.outer(angle, [0.5, 1.5, 3.0])
    envelope = vold_kalman(record[:, np.newaxis], phase, rate, 6.0)[::400, :, 0]
    np.testing.assert_allclose(time[::400], table[:, 0])
    np.testing.assert_allclose(envelope, table[:, 1:4] + 1j * table[:, 4:], atol=1e-10)


def test_crossing_orders_are_separated_only_together():
    """Order 2, modulated in amplitude, crosses a tone of 60 Hz, modulated in phase."""
    rate, bandwidth = 1638.4, 3.0
    time, angle, _ = run_up(1200.0, 2400.0, 6.0, rate)
    phase = np.column_stack([2 * angle, 2 * np.pi * 60 * time + 0.4])
    swelling = (1 + 0.3 * np.sin(np.pi * time / 2)) * np.exp(0.3j)
    turning = 0.8 * np.exp(-1j + 0.4j * np.cos(0.4 * np.pi * time))
    amplitudes = np.column_stack([swelling, turning])
    record = np.real(np.sum(amplitudes * np.exp(1j * phase), axis=1))[:, np.newaxis]
    inside = away_from_ends(time, bandwidth, 1.0)

    together = vold_kalman(record, phase, rate, bandwidth)[:, :, 0]
    ratio = together[inside] / amplitudes[inside]
    assert np.abs(np.abs(ratio) - 1).max() < 0.002
    assert np.rad2deg(np.abs(np.angle(ratio))).max() < 0.1

    alone = vold_kalman(record, phase[:, :1], rate, bandwidth)[:, 0, 0]
    assert np.abs((alone / swelling)[inside] - 1).max() > 0.3


def test_amplitude_that_follows_a_resonance_within_the_stated_smear():
    """Order 1.5 through a resonance at 30 Hz, 8 % damping: error against smear over its width."""
    rate = 1638.4
    time, angle, rpm = run_up(700.0, 1900.0, 10.0, rate)
    frequency = 1.5 * rpm / 60
    amplitude = 1 / (1 - (frequency / 30) ** 2 + 0.16j * frequency / 30)
    record = np.real(amplitude * np.exp(1.5j * angle))[:, np.newaxis]
    sweep = 1.5 / 60 * 120.0
    errors = []
    for bandwidth in (3.0, 6.0, 12.0):
        envelope = vold_kalman(record, 1.5 * angle[:, np.newaxis], rate, bandwidth)[:, 0, 0]
        inside = away_from_ends(time, bandwidth, 1.0) & (frequency > 22)
        errors.append(np.abs(envelope / amplitude - 1)[inside].max())
    stated = smear(sweep, np.array([3.0, 6.0, 12.0]))
    np.testing.assert_allclose(stated, [2.0, 1.0, 0.5])
    # two poles: the error falls with the fourth power of the smear
    assert errors[0] > 1e-3
    assert errors[1] < errors[0] / 10
    assert errors[2] < errors[1] / 10


@pytest.mark.parametrize("cylinders", [2, 3, 4, 6])
def test_firing_pulses_sound_at_the_dominant_order(cylinders):
    """Pulses 720°/n apart: the lowest line of the record is the firing frequency."""
    rpm, rate, duration = 1800.0, 3840, 2.0
    time = np.arange(int(rate * duration)) / rate
    crank_angle = 360 * rpm / 60 * time
    spacing = 720 / cylinders
    phase = np.mod(crank_angle, spacing) / spacing
    torque = np.where(phase < 0.2, np.sin(np.pi * phase / 0.2), 0.0)
    amplitude = np.abs(np.fft.rfft(torque - torque.mean())) / time.size
    lines = np.fft.rfftfreq(time.size, 1 / rate)
    strongest = lines[amplitude.argmax()]
    assert frequency_of_order(rpm, dominant_order(cylinders)) == pytest.approx(strongest, abs=1e-9)


def test_frequency_is_the_rate_of_the_order_phase_in_a_run_up():
    """The instantaneous frequency of cos(order · shaft angle) in a run-up."""
    order, rate = 1.5, 2000
    time = np.arange(20 * rate) / rate
    rpm = 800 + 120 * time
    revolutions = (800 * time + 60 * time**2) / 60
    phase = np.unwrap(np.angle(signal.hilbert(np.cos(2 * np.pi * order * revolutions))))
    measured = np.gradient(phase, time) / (2 * np.pi)
    inside = slice(2 * rate, -2 * rate)
    np.testing.assert_allclose(frequency_of_order(rpm, order)[inside], measured[inside], rtol=2e-3)
    np.testing.assert_allclose(rpm_of_frequency(measured, order)[inside], rpm[inside], rtol=2e-3)
