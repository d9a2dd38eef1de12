"""Vold-Kalman filter against dense least squares, its transfer function and known chirps."""

from math import comb
from pathlib import Path

import numpy as np
import pytest
from scipy import integrate, linalg

from deboom.physics.order_tracking import angular_resample, order_amplitudes, samples_needed
from deboom.physics.order_tracking_resolution import noise_amplitude, smear
from deboom.physics.vold_kalman import envelope_response, noise_bandwidth, penalty, vold_kalman

POLES = [1, 2, 3]
ROTA = Path(__file__).parents[1] / "data" / "rota-order" / "envelopes.csv"


def run_up(first_rpm, last_rpm, duration, rate):
    """Time, shaft angle [rad] and speed [1/min] of a linear run-up."""
    time = np.arange(round(duration * rate)) / rate
    slope = (last_rpm - first_rpm) / duration
    return time, 2 * np.pi / 60 * (first_rpm * time + slope * time**2 / 2), first_rpm + slope * time


def away_from_ends(time, bandwidth, times=2.0):
    return (time > times / bandwidth) & (time < time[-1] - times / bandwidth)


@pytest.mark.parametrize("poles", POLES)
def test_against_dense_least_squares(poles):
    """Two crossing orders in noise, the sum of squares written out as one dense matrix."""
    samples, rate, bandwidth = 250, 200.0, np.array([5.0, 3.0])
    time = np.arange(samples) / rate
    phase = 2 * np.pi * np.column_stack([20 * time, 15 * time + 2.5 * time**2])
    record = np.random.default_rng(1).normal(size=(samples, 2))
    weight = np.sqrt(np.sqrt(2) - 1) / (2 * np.sin(np.pi * bandwidth / 2 / rate)) ** poles
    difference = np.diff(np.eye(samples), n=poles, axis=0)
    parts = [f(phase[:, k]) for k in range(2) for f in (np.cos, lambda angle: -np.sin(angle))]
    smooth = np.kron(np.diag(np.repeat(weight, 2) / np.sqrt(2)), difference)
    matrix = np.vstack([np.hstack([np.diag(part) for part in parts]), smooth])
    right = np.vstack([record, np.zeros((len(smooth), 2))])
    dense = np.linalg.lstsq(matrix, right, rcond=None)[0].reshape(4, samples, 2)
    found = vold_kalman(record, phase, rate, bandwidth, poles)
    np.testing.assert_allclose(found[:, 0], dense[0] + 1j * dense[1], atol=1e-7)
    np.testing.assert_allclose(found[:, 1], dense[2] + 1j * dense[3], atol=1e-7)


@pytest.mark.parametrize("poles", POLES)
def test_modulated_order_passes_by_the_transfer_function(poles):
    """One sideband of an order, 0 to 2.5 times the half bandwidth away."""
    rate, bandwidth, order = 1024.0, 6.0, 3.0
    time, angle, _ = run_up(1800.0, 2400.0, 6.0, rate)
    rates = np.array([0.0, 1.0, 3.0, 5.0, 7.5])
    turning = np.exp(2j * np.pi * np.outer(time, rates))
    record = np.real(turning * np.exp(1j * order * angle)[:, np.newaxis])
    found = vold_kalman(record, order * angle[:, np.newaxis], rate, bandwidth, poles)[:, 0]
    inside = away_from_ends(time, bandwidth)
    gain = np.mean((found / turning)[inside], axis=0)
    expected = envelope_response(rates, bandwidth, rate, poles)
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
    found = vold_kalman(record[:, np.newaxis], phase, rate, 6.0)[::400, :, 0]
    np.testing.assert_allclose(time[::400], table[:, 0])
    np.testing.assert_allclose(found, table[:, 1:4] + 1j * table[:, 4:], atol=1e-10)


def test_weights_are_those_of_tuma():
    """The polynomials in cosines that are printed for one, two and three poles.

    They cancel: at a bandwidth of 1/400 of the rate the printed form has lost 0.5 %.
    """
    bandwidth, rate = np.array([5.0, 10.0, 60.0]), 400.0
    cosine = [np.cos(k * np.pi * bandwidth / rate) for k in range(4)]
    printed = [
        2 - 2 * cosine[1],
        6 - 8 * cosine[1] + 2 * cosine[2],
        20 - 30 * cosine[1] + 12 * cosine[2] - 2 * cosine[3],
    ]
    for poles, polynomial in zip(POLES, printed, strict=True):
        expected = np.sqrt((np.sqrt(2) - 1) / polynomial)
        np.testing.assert_allclose(penalty(bandwidth, rate, poles), expected, rtol=1e-6)


@pytest.mark.parametrize("poles", POLES)
def test_noise_bandwidth_is_the_integral_of_the_transfer_function(poles):
    rate, bandwidth = 4096.0, 2.0
    power = integrate.quad(
        lambda f: envelope_response(f, bandwidth, rate, poles) ** 2,
        -rate / 2,
        rate / 2,
        points=[-10, -1, 1, 10],
        limit=500,
    )[0]
    assert float(noise_bandwidth(bandwidth, poles)) == pytest.approx(power, rel=1e-4)


@pytest.mark.parametrize("poles", POLES)
def test_noise_floor(poles):
    """White noise in 40 channels: the rms amplitude of an order that is not there."""
    rng = np.random.default_rng(5)
    rate, bandwidth, sigma = 512.0, 4.0, 0.7
    time, angle, _ = run_up(1500.0, 2100.0, 8.0, rate)
    record = rng.normal(0, sigma, (time.size, 40))
    found = vold_kalman(record, 1.5 * angle[:, np.newaxis], rate, bandwidth, poles)[:, 0]
    measured = np.sqrt(np.mean(np.abs(found[away_from_ends(time, bandwidth)]) ** 2))
    expected = noise_amplitude(2 * sigma**2 / rate, noise_bandwidth(bandwidth, poles))
    assert measured == pytest.approx(float(expected), rel=0.05)


def test_noise_at_the_ends_is_at_most_twice_as_large():
    rng = np.random.default_rng(6)
    rate, bandwidth = 512.0, 4.0
    time, angle, _ = run_up(1500.0, 2100.0, 4.0, rate)
    record = rng.normal(size=(time.size, 200))
    found = vold_kalman(record, 1.5 * angle[:, np.newaxis], rate, bandwidth)[:, 0]
    level = np.sqrt(np.mean(np.abs(found) ** 2, axis=1))
    usual = np.median(level)
    assert 1.5 * usual < level[[0, -1]].max() < 2.2 * usual
    assert level[away_from_ends(time, bandwidth, 1.0)].max() < 1.2 * usual


def test_three_orders_of_a_run_up_are_exact_to_its_ends():
    """Orders 0.5, 1.5 and 3 from 900 to 2700 1/min in 5 s, a static force beside them."""
    rate = 4096.0
    _, angle, _ = run_up(900.0, 2700.0, 5.0, rate)
    orders = np.array([0.0, 0.5, 1.5, 3.0])
    amplitudes = np.array([150.0, 0.4 * np.exp(1j), 2 * np.exp(-0.5j), np.exp(2.5j)])
    phase = np.outer(angle, orders)
    record = np.real(np.exp(1j * phase) @ amplitudes)[:, np.newaxis]
    found = vold_kalman(record, phase, rate, 2.0)[:, :, 0]
    np.testing.assert_allclose(found, np.tile(amplitudes, (angle.size, 1)), atol=1e-6)


def test_crossing_orders_are_separated_where_order_tracking_cannot():
    """Order 2, modulated in amplitude, crosses a tone of 60 Hz, modulated in phase."""
    rate, bandwidth = 1638.4, 3.0
    time, angle, rpm = run_up(1200.0, 2400.0, 6.0, rate)
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

    needed = samples_needed(rate, 1200.0, 2.0)
    resampled = angular_resample(record, angle, needed)
    line = np.searchsorted(rpm, np.arange(1600.0, 2001.0, 5.0))
    computed = order_amplitudes(*resampled, [2.0], angle[line] / (2 * np.pi), 16)[:, 0, 0]
    assert np.abs(computed / swelling[line] - 1).max() > 0.3


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
        found = vold_kalman(record, 1.5 * angle[:, np.newaxis], rate, bandwidth)[:, 0, 0]
        inside = away_from_ends(time, bandwidth, 1.0) & (frequency > 22)
        errors.append(np.abs(found / amplitude - 1)[inside].max())
    stated = smear(sweep, np.array([3.0, 6.0, 12.0]))
    np.testing.assert_allclose(stated, [2.0, 1.0, 0.5])
    # two poles: the error falls with the fourth power of the smear
    assert errors[0] > 1e-3
    assert errors[1] < errors[0] / 10
    assert errors[2] < errors[1] / 10


def test_normal_equations_would_lose_all_digits():
    """Constant order at 16384 Hz and 1 Hz: condition 5e15; the filter keeps eight digits."""
    rate, bandwidth = 16384.0, 1.0
    time, angle, _ = run_up(1500.0, 1800.0, 3.0, rate)
    amplitude = 2 * np.exp(0.7j)
    record = np.real(amplitude * np.exp(1.5j * angle))[:, np.newaxis]
    found = vold_kalman(record, 1.5 * angle[:, np.newaxis], rate, bandwidth)[:, 0, 0]
    assert np.abs(found - amplitude).max() < 1e-7

    weight = float(penalty(bandwidth, rate, 2)) ** 2
    binomial = [(-1) ** k * comb(2, k) for k in range(3)]
    band = np.zeros((3, time.size))
    for one in range(3):
        for other in range(one, 3):
            end = time.size - 2 + other
            band[2 - (other - one), other:end] += weight * binomial[one] * binomial[other]
    band[2] += 1
    demodulated = np.exp(-1.5j * angle) * record[:, 0]
    try:
        normal = 2 * linalg.solveh_banded(band, demodulated)
    except linalg.LinAlgError:
        return
    assert np.abs(normal - amplitude).max() > 1e-3
