"""Order spectra: what is refused by name, and what the result states about itself."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.order_spectra import (
    computed_order_spectrum,
    quasi_static,
    vold_kalman_spectra,
)
from deboom.measurement.shaft_angle import shaft_angle
from deboom.measurement.tacho_repair import repair_pulses
from deboom.measurement.time_record import TimeRecord

RATE = 2048.0
TIME = np.arange(int(4 * RATE)) / RATE
REVOLUTION = 15 * TIME + 3 * TIME**2
SHAFT = shaft_angle(repair_pulses(np.interp(np.arange(108), REVOLUTION, TIME)))
SIGNAL = np.cos(2 * np.pi * 1.5 * REVOLUTION)
RECORD = TimeRecord(SIGNAL[:, np.newaxis], RATE, ("A1 x",), "m/s^2")


def test_lines_that_the_record_does_not_hold():
    with pytest.raises(InputError, match="does not pass 850 1/min; it goes from 9"):
        computed_order_spectrum(RECORD, SHAFT, 1.5, [850.0, 1500.0])
    with pytest.raises(
        InputError, match=r"hold 8 revolutions about 950 1/min: lines from 99\d.\d to 22\d\d.\d"
    ):
        computed_order_spectrum(RECORD, SHAFT, 1.5, [950.0, 1500.0], revolutions=8)
    first_second = TimeRecord(RECORD.values[:2048], RATE, RECORD.channels, RECORD.unit)
    for track in (
        lambda: vold_kalman_spectra(first_second, SHAFT, [1.5], [1000.0, 2000.0], bandwidth=3.0),
        lambda: quasi_static(first_second, SHAFT, [1000.0, 2000.0], bandwidth=2.0),
    ):
        with pytest.raises(InputError, match="does not hold its line about 2000 1/min: lines from"):
            track()
    with pytest.raises(InputError, match="the record is shorter than 30 revolutions"):
        computed_order_spectrum(first_second, SHAFT, 1.5, [1000.0], revolutions=30)


def test_record_and_tacho_apart():
    later = TimeRecord(RECORD.values, RATE, RECORD.channels, RECORD.unit, start=100.0)
    with pytest.raises(InputError, match=r"and the tacho, 0.000 to 3.9.* s, do not overlap"):
        computed_order_spectrum(later, SHAFT, 1.5, [1500.0])


@pytest.mark.parametrize("rpm", [[1500.0, 1400.0], [], 1500.0])
def test_lines_must_increase(rpm):
    with pytest.raises(InputError, match="must be a list that increases"):
        computed_order_spectrum(RECORD, SHAFT, 1.5, rpm)


def test_rate_too_low_for_the_order():
    with pytest.raises(InputError, match=r"2048 Hz is too low for 1.* Hz: it needs"):
        computed_order_spectrum(RECORD, SHAFT, 30.0, [1500.0])


@pytest.mark.parametrize(
    ("orders", "bandwidth", "message"),
    [
        ([], 2.0, "are not positive"),
        ([1.5, 0.0], 2.0, "are not positive"),
        ([1.5], 0.0, r"bandwidths 0.0 Hz for 1 orders: give one above 0 Hz"),
        ([1.5], [2.0, 3.0], r"bandwidths \[2.0, 3.0\] Hz for 1 orders"),
        ([0.5, 1.5], 9.0, "wider than the lowest frequency of its order, 7.5"),
    ],
)
def test_orders_and_bandwidths(orders, bandwidth, message):
    with pytest.raises(InputError, match=message):
        vold_kalman_spectra(RECORD, SHAFT, orders, [1500.0], bandwidth=bandwidth)


def test_what_a_spectrum_states():
    lines = np.array([1000.0, 1500.0, 2000.0, 2300.0])
    half, main = vold_kalman_spectra(RECORD, SHAFT, [0.5, 1.5], lines, bandwidth=[2.0, 4.0])
    np.testing.assert_array_equal(half.bandwidth, 2.0)
    np.testing.assert_array_equal(main.bandwidth, 4.0)
    np.testing.assert_allclose(main.sweep_rate, 1.5 * 6, rtol=1e-3)
    np.testing.assert_allclose(main.smear, 2 * 9 / 4, rtol=1e-3)
    # 1000 1/min comes 0.28 s after the first pulse, 2300 1/min 0.11 s before the last
    np.testing.assert_array_equal(half.settled, [False, True, True, False])
    np.testing.assert_array_equal(main.settled, [True, True, True, False])
    computed = computed_order_spectrum(RECORD, SHAFT, 1.5, lines[1:3], revolutions=6)
    np.testing.assert_allclose(computed.bandwidth, 1.4406 * lines[1:3] / 360, rtol=1e-4)
    assert computed.settled.all()
    with pytest.raises(ValueError, match="read-only"):
        main.rpm[0] = 0


@pytest.mark.parametrize(
    ("values", "rate", "channels", "message"),
    [
        (np.zeros((5, 2)), 10.0, ("a",), r"1 channels has shape \(n_sample, 1\), not \(5, 2\)"),
        (np.zeros((0, 1)), 10.0, ("a",), "not"),
        (np.zeros((5, 1)), 0.0, ("a",), "a sampling rate of 0.0 Hz is not positive"),
        (np.array([[0.0], [np.nan]]), 10.0, ("a",), "channel a is not finite at sample 1"),
        (np.zeros((5, 2)), 10.0, ("a", "a"), r"duplicated channel \['a'\]"),
    ],
)
def test_time_record_refuses(values, rate, channels, message):
    with pytest.raises(InputError, match=message):
        TimeRecord(values, rate, channels, "N")


def test_time_record_is_a_value():
    values = np.zeros((5, 1))
    record = TimeRecord(values, 10.0, ["a"], "N")
    values[0] = 1
    assert record.values[0, 0] == 0
    assert record.channels == ("a",)
