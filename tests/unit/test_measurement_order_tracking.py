"""Tacho, order spectra, tracked runs and sweeps: refusals and options."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.campaign import TimeRun
from deboom.measurement.channels import TimeRecord
from deboom.measurement.order_tracking import (
    OrderTracking,
    TrackingOptions,
    computed_order_spectrum,
    quasi_static,
    tracked_run,
    tracked_sweep,
    vold_kalman_spectra,
)
from deboom.measurement.tacho import PulseTrain, pulse_times, repair_pulses, shaft_angle

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


@pytest.mark.parametrize(
    ("values", "rate", "channels", "message"),
    [
        (np.zeros((5, 2)), 10.0, ("a",), "channels: 2 are needed, not 1"),
        (np.zeros((0, 1)), 10.0, ("a",), "has no samples"),
        (np.zeros((5, 1)), 0.0, ("a",), "a sampling rate of 0.0 Hz is not positive"),
        (np.array([[0.0], [np.nan]]), 10.0, ("a",), r"not finite at index \(1, 0\)"),
        (np.zeros((5, 2)), 10.0, ("a", "a"), r"duplicated channel \['a'\]"),
    ],
)
def test_time_record_refuses(values, rate, channels, message):
    with pytest.raises(InputError, match=message):
        TimeRecord(values, rate, channels, "N")


RATE_2 = 4096.0
STEADY = np.arange(60) / 25.0
RISING = np.cumsum(1 / np.linspace(13.0, 50.0, 150))


def square(n_pulse, per_second=25.0):
    time = np.arange(int((n_pulse + 0.5) / per_second * RATE_2)) / RATE_2
    return np.where(np.mod(time * per_second + 0.5, 1) < 0.3, 5.0, 0.0)


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        (np.full(5000, 0.2), "T1 carries no pulses, it stays at 0.2 V"),
        (np.zeros((10, 2)), "T1 is one channel of voltage"),
        (np.zeros(0), "T1 is one channel of voltage"),
        (np.append(square(20), np.nan), "T1: the signal is not finite at sample 3358"),
        (square(5), "T1 has 5 pulses at 2.5 V, 10 are needed"),
    ],
)
def test_a_signal_without_enough_pulses(signal, message):
    with pytest.raises(InputError, match=message):
        pulse_times(signal, RATE_2, name="T1")


def test_a_bounce_counts_only_where_the_voltage_falls_far_enough():
    for bounce, count in ((2.0, 20), (1.0, 40)):
        signal = square(20)
        signal[np.flatnonzero(np.diff(signal) > 0) + 6] = bounce
        assert pulse_times(signal, RATE_2).size == count


@pytest.mark.parametrize(
    ("times", "per_revolution", "message"),
    [
        (STEADY[:9], 1, "T1 has 9 pulses, 10 are needed"),
        (STEADY.reshape(2, -1), 1, "10 are needed"),
        (STEADY[::-1], 1, "increase from pulse to pulse"),
        (np.append(STEADY, np.inf), 1, "increase from pulse to pulse"),
        (STEADY, 0, "0 pulses per revolution"),
        (np.delete(RISING, np.s_[60:80]), 1, r"about (19|20)\.\d pulses are missing between 3.096"),
        (np.delete(RISING, np.s_[60:66]), 1, "about 6.0 pulses are missing between"),
        (np.sort(np.append(RISING, RISING + 0.0008)), 1, "fit no smooth speed"),
        (np.random.default_rng(1).uniform(0, 6, 150).cumsum(), 1, "fit no smooth speed"),
        (np.sort(np.append(STEADY, STEADY[::3] + 0.013)), 1, "do not fit and 0 are missing"),
        (np.append(STEADY, STEADY[-1] + np.arange(1, 60) / 40), 1, "104 pulses do not fit"),
    ],
)
def test_pulses_that_make_no_shaft(times, per_revolution, message):
    with pytest.raises(InputError, match=message):
        repair_pulses(times, per_revolution, name="T1")


def test_five_missing_in_a_row_are_counted():
    train = repair_pulses(np.delete(RISING, np.s_[60:65]))
    assert train.missing.size == 5
    assert train.number[-1] == RISING.size - 1


def test_shaft_angle_refuses():
    train = repair_pulses(STEADY, name="T1")
    shaft = shaft_angle(train)
    with pytest.raises(
        InputError, match=r"T1: the shaft angle is known from 0.000 to 2.360 s only"
    ):
        shaft.angle([1.0, 2.5])


def test_pulses_that_were_not_checked_can_still_turn_back():
    count = np.arange(20)
    back = PulseTrain("T1", STEADY[:20], np.where(count < 10, count, 19 - count), 1, [], [])
    with pytest.raises(InputError, match="T1: the shaft stands still or turns back"):
        shaft_angle(back)


def test_time_at_a_speed():
    rising = shaft_angle(repair_pulses(RISING, name="T1"))
    slowest, fastest = rising.rpm_range()
    assert 780 < slowest < 800
    assert 2990 < fastest < 3010
    with pytest.raises(InputError, match="T1: the run does not pass 700 1/min; it goes from"):
        rising.time_at([700.0, 900.0])
    falling = shaft_angle(repair_pulses(np.sort(RISING[-1] - RISING)))
    wanted = np.array([1000.0, 2000.0])
    np.testing.assert_allclose(falling.rpm(falling.time_at(wanted)), wanted, rtol=1e-4)
    speed = np.concatenate([np.linspace(13, 50, 150), np.linspace(50, 30, 80)])
    both = shaft_angle(repair_pulses(np.cumsum(1 / speed), name="T1"))
    with pytest.raises(InputError, match=r"T1: the speed turns back by 1\d\d\d 1/min before"):
        both.time_at([1500.0])


TIME_3 = np.arange(round(4 * RATE)) / RATE
TURNS = (1200.0 * TIME_3 + 50.0 * TIME_3**2) / 60 - 0.25
ORDER = np.exp(2j * np.pi * 1.5 * TURNS)
AMPLITUDES = 3 * np.exp(0.7j), 40 * np.exp(-2j)


def tacho():
    within = np.mod(2 * TURNS + 0.5, 1.0) - 0.5
    return np.clip(20 * np.minimum(within, 0.4 - within) + 0.5, 0, 1)


def time_run(**new):
    fields = {
        "name": "g5_time",
        "mount_set": "M1",
        "gear": 5,
        "total_ratio": 3.4,
        "full_load": True,
        "torque_limit": 220.0,
        "rising": True,
        "order": 1.5,
        "sample_rate": RATE,
        "tacho": tacho(),
        "pulses_per_revolution": 2,
        "engine_torque": 100.0 + 10.0 * TIME_3,
        "acceleration": np.real(AMPLITUDES[0] * ORDER)[:, np.newaxis],
        "acceleration_channels": ("A1 x",),
        "cell_force": np.real(AMPLITUDES[1] * ORDER)[:, np.newaxis],
        "cell_force_channels": ("C1 x",),
        "static_force": np.column_stack([-50.0 * TIME_3, np.full(TIME_3.size, 7.0)]),
        "static_force_names": ("TSM x", "TSM y"),
    }
    return TimeRun(**fields | new)


@pytest.mark.parametrize("method", OrderTracking)
def test_amplitude_phase_torque_and_static_force_are_found(method):
    tracked = tracked_run(time_run(), TrackingOptions(method, other_orders=()), "g5")
    run = tracked.run
    assert (run.name, run.gear, run.order, run.static_force_names[1]) == ("g5", 5, 1.5, "TSM y")
    rpm = run.frequency * 40
    assert rpm[0] % 10 == pytest.approx(0)
    assert rpm[0] >= 1210
    assert rpm[-1] <= 1590
    for spectrum, amplitude in zip((run.acceleration, run.cell_force), AMPLITUDES, strict=True):
        assert spectrum.values[:, 0] == pytest.approx(amplitude, rel=2e-3)
    passed = (rpm - 1200) / 100
    assert run.engine_torque == pytest.approx(100 + 10 * passed, abs=0.05)
    assert run.static_force[:, 0] == pytest.approx(-50 * passed, abs=0.3)
    assert run.static_force[:, 1] == pytest.approx(7)
    assert run.wheel_torque == pytest.approx(3.4 * run.engine_torque)
    assert tracked.order.settled.all()
    assert tracked.force_beside < 1e-3


def test_noise_is_seen_beside_the_order():
    noise = np.random.default_rng(1).normal(0, 1.0, (TIME_3.size, 1))
    quiet = tracked_run(time_run())
    loud = tracked_run(time_run(acceleration=time_run().acceleration + noise))
    error = np.std(loud.run.acceleration.values - AMPLITUDES[0]) / 3
    assert loud.acceleration_beside == pytest.approx(error, rel=0.6)
    assert loud.acceleration_beside > 10 * quiet.acceleration_beside


def test_lines_asked_for_are_given_and_unsettled_ones_counted():
    options = TrackingOptions(lowest_rpm=1215.0, highest_rpm=1300.0, rpm_step=5.0)
    tracked = tracked_run(time_run(), options)
    assert tracked.run.frequency * 40 == pytest.approx(np.arange(1215, 1301, 5))
    assert "lie so near the ends of the record" in tracked.report()[-1]
    assert "18 lines of order 1.5, 1215 to 1300 1/min" in tracked.report()[0]


@pytest.mark.parametrize(
    ("new", "options", "message"),
    [
        ({"tacho": np.zeros(TIME_3.size)}, {}, "time run g5_time: tacho carries no pulses"),
        (
            {"tacho": np.where((TURNS > 20) & (TURNS < 50), 0, tacho())},
            {},
            "pulses are missing between|check the trigger level",
        ),
        ({}, {"highest_rpm": 1700.0}, "the run does not pass 16.0 1/min; it goes from 12"),
        ({}, {"lowest_rpm": 1390.0, "highest_rpm": 1395.0}, "fewer than two lines lie between"),
        ({}, {"bandwidth": 0.4}, "too short for the filter"),
        ({}, {"bandwidth": 12.0, "other_orders": (0.5,)}, "12 Hz"),
    ],
)
def test_what_cannot_be_tracked_is_refused_in_words(new, options, message):
    with pytest.raises(InputError, match=message):
        tracked_run(time_run(**new), TrackingOptions(**options))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bandwidth": 0.0}, "bandwidth 0 is not positive"),
        ({"rpm_step": -1.0}, "rpm step -1 is not positive"),
        ({"other_orders": (0.0,)}, "orders .* are not positive"),
        ({"lowest_rpm": 1500.0, "highest_rpm": 1400.0}, "no engine speed lies between"),
    ],
)
def test_options_without_meaning_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        TrackingOptions(**options)


RATE_4 = 2000.0


def run(first, last, seconds):
    time = np.arange(round(seconds * RATE_4)) / RATE_4
    angle = 2 * np.pi * (first * time + (last - first) / seconds * time**2 / 2 - 0.25)
    # slow edges: their half-way time is known to a small part of a sample
    return angle, np.clip(0.5 + 3 * np.sin(angle), 0, 1)


def record(values, name="A1 x", unit="m/s^2"):
    return TimeRecord(values[:, None], RATE_4, (name,), unit)


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
    assert 0.5 < found.noise[0][0] / (0.05 * np.sqrt(2 * 3 / RATE_4)) < 2
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
