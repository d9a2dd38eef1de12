"""A run over time becomes an operating run, or says why it cannot."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.time_run import TimeRun
from deboom.measurement.tracked_run import OrderTracking, TrackingOptions, tracked_run

RATE = 2048.0
TIME = np.arange(round(4 * RATE)) / RATE
SPEED = 1200.0 + 100.0 * TIME
TURNS = (1200.0 * TIME + 50.0 * TIME**2) / 60 - 0.25
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
        "engine_torque": 100.0 + 10.0 * TIME,
        "acceleration": np.real(AMPLITUDES[0] * ORDER)[:, np.newaxis],
        "acceleration_channels": ("A1 x",),
        "cell_force": np.real(AMPLITUDES[1] * ORDER)[:, np.newaxis],
        "cell_force_channels": ("C1 x",),
        "static_force": np.column_stack([-50.0 * TIME, np.full(TIME.size, 7.0)]),
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
    noise = np.random.default_rng(1).normal(0, 1.0, (TIME.size, 1))
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


def test_missing_pulses_are_repaired_and_reported():
    gone = tacho()
    gone[(TURNS > 20.9) & (TURNS < 21.4)] = 0
    tracked = tracked_run(time_run(tacho=gone))
    assert "1 missing (at 1.0" in tracked.report()[1]
    assert tracked.run.cell_force.values[:, 0] == pytest.approx(AMPLITUDES[1], rel=2e-3)


@pytest.mark.parametrize(
    ("new", "options", "message"),
    [
        ({"tacho": np.zeros(TIME.size)}, {}, "time run g5_time: tacho carries no pulses"),
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
