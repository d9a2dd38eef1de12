"""Tacho, order spectra, tracked runs and sweeps: refusals and options."""

import numpy as np
import pytest
from scipy.ndimage import percentile_filter

from deboom.errors import InputError
from deboom.measurement.campaign import TimeRun
from deboom.measurement.channels import TimeRecord
from deboom.measurement.order_tracking import (
    TrackingOptions,
    quasi_static,
    tracked_run,
    tracked_sweep,
    vold_kalman_spectra,
)
from deboom.measurement.tacho import (
    WINDOW,
    PulseTrain,
    is_speed,
    pulse_times,
    repair_pulses,
    shaft_angle,
)

RATE = 2048.0
TIME = np.arange(int(4 * RATE)) / RATE
REVOLUTION = 15 * TIME + 3 * TIME**2
SHAFT = shaft_angle(repair_pulses(np.interp(np.arange(108), REVOLUTION, TIME)))
SIGNAL = np.cos(2 * np.pi * 1.5 * REVOLUTION)
RECORD = TimeRecord(SIGNAL[:, np.newaxis], RATE, ("A1 x",), "m/s^2")


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


RATE_2 = 4096.0
STEADY = np.arange(60) / 25.0
RISING = np.cumsum(1 / np.linspace(13.0, 50.0, 150))


def square(n_pulse, per_second=25.0):
    time = np.arange(int((n_pulse + 0.5) / per_second * RATE_2)) / RATE_2
    return np.where(np.mod(time * per_second + 0.5, 1) < 0.3, 5.0, 0.0)


def test_a_bounce_counts_only_where_the_voltage_falls_far_enough():
    for bounce, count in ((2.0, 20), (1.0, 40)):
        signal = square(20)
        signal[np.flatnonzero(np.diff(signal) > 0) + 6] = bounce
        assert pulse_times(signal, RATE_2).size == count


def test_a_speed_channel_is_named_and_gives_the_same_orders():
    rpm = 60 * np.gradient(TURNS, 1 / RATE)
    noisy = rpm + np.random.default_rng(1).normal(0, 2.0, rpm.size)
    by_pulses = tracked_run(time_run()).run
    tracked = tracked_run(time_run(tacho=noisy))
    assert any("WARNING, the channel is a speed in 1/min" in line for line in tracked.report())
    ratio = tracked.run.cell_force.values / tracked.run.acceleration.values
    expected = by_pulses.cell_force.values / by_pulses.acceleration.values
    assert np.abs(ratio / expected - 1).max() < 0.01
    assert tracked.run.frequency[[0, -1]] == pytest.approx(by_pulses.frequency[[0, -1]], abs=0.5)
    assert is_speed(1400 + 5 * TIME_3)
    assert not is_speed(tacho())
    with pytest.raises(InputError, match=r"changes smoothly from .* as a speed does: export"):
        tracked_run(time_run(tacho=rpm / 60))


def test_a_tacho_on_a_raster_of_a_millisecond_is_named():
    passing = np.sin(2 * np.pi * 410 * np.arange(4000) / 1000.0) > 0
    with pytest.raises(InputError, match="2 samples from pulse to pulse at 1000 Hz, too few"):
        pulse_times(np.where(passing, 5.0, 0.0), 1000.0)


def test_teeth_that_a_wheel_has_not_are_not_missing():
    tooth = np.arange(60 * 40)
    times = np.interp(tooth[tooth % 60 < 58] / 60, REVOLUTION, TIME)
    damaged = np.delete(times, [300, 700])
    for pulses, missing in ((times, 0), (damaged, 2)):
        train = repair_pulses(pulses, 60)
        assert train.missing.size == missing
        assert train.number[-1] == 60 * 39 + 57
    assert "none repaired" in repair_pulses(times, 60).report()


def test_the_limit_of_a_coasting_run_is_its_drag():
    drag = {"engine_torque": -20.0 - 5.0 * TIME_3, "rising": True}
    good = tracked_run(time_run(torque_limit=-50.0, **drag)).report()
    assert not any("torque" in line and "WARNING" in line for line in good)
    bad = tracked_run(time_run(torque_limit=-20.0, **drag)).report()
    assert any("reaches -3" in line and "beyond the limit of -20" in line for line in bad)


def test_five_missing_in_a_row_are_counted():
    train = repair_pulses(np.delete(RISING, np.s_[60:65]))
    assert train.missing.size == 5
    assert train.number[-1] == RISING.size - 1


def test_a_pulse_within_six_standard_deviations_is_kept():
    """Jitter of 1 % of an interval: five deviations may come by chance, nine may not."""
    generator = np.random.default_rng(3)
    times = np.arange(400) + 0.01 * generator.normal(size=400)
    for deviations, dropped in ((5.0, []), (9.0, [200])):
        displaced = times.copy()
        displaced[200] = 200 + 0.01 * deviations
        assert np.flatnonzero(~np.isin(displaced, repaired(displaced).times)).tolist() == dropped


def test_vibration_recorded_too_slowly_is_refused_whatever_its_raster():
    with pytest.raises(InputError, match=r"recorded at 100 Hz, and order 1.5 at 1560 .* 168 Hz"):
        tracked_run(time_run(vibration_rate=100.0))
    tracked = tracked_run(time_run(vibration_rate=500.0, notes=("resampled from 500 Hz",)))
    assert "resampled from 500 Hz" in tracked.report()
    assert "the stated 2 pulses per revolution cannot be checked" in tracked.report()[2]


def test_statements_that_the_record_contradicts_are_named():
    with pytest.raises(InputError, match=r"rises from 12\d\d to 1[56]\d\d 1/min, but"):
        tracked_run(time_run(rising=False))
    assert not any("WARNING" in line for line in tracked_run(time_run()).report())
    wrong_count = tracked_run(time_run(pulses_per_revolution=3)).report()
    assert any("WARNING: order 1.5 hardly stands out" in line for line in wrong_count)
    weak = tracked_run(time_run(torque_limit=60.0)).report()
    assert any("WARNING: the engine torque reaches 13" in line for line in weak)
    slice_at = tracked_run(time_run(full_load=False)).report()
    assert any("WARNING: the engine torque is 120 N m" in line for line in slice_at)


def test_time_at_a_speed():
    rising = shaft_angle(repair_pulses(RISING, name="T1"))
    slowest, fastest = rising.rpm_range()
    assert 780 < slowest < 800
    assert 2990 < fastest < 3010
    falling = shaft_angle(repair_pulses(np.sort(RISING[-1] - RISING)))
    wanted = np.array([1000.0, 2000.0])
    np.testing.assert_allclose(falling.rpm(falling.time_at(wanted)), wanted, rtol=1e-4)


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


def test_amplitude_phase_torque_and_static_force_are_found():
    tracked = tracked_run(time_run(), TrackingOptions(other_orders=()), "g5")
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
    usual = tracked_run(time_run(), TrackingOptions(), "g5").run.acceleration.values
    spelt = TrackingOptions(other_orders=(0.5, 3.0, 6.0))
    assert np.array_equal(usual, tracked_run(time_run(), spelt, "g5").run.acceleration.values)


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


RATE_4 = 2000.0


def run(first, last, seconds):
    time = np.arange(round(seconds * RATE_4)) / RATE_4
    angle = 2 * np.pi * (first * time + (last - first) / seconds * time**2 / 2 - 0.25)
    # slow edges: their half-way time is known to a small part of a sample
    return angle, np.clip(0.5 + 3 * np.sin(angle), 0, 1)


def record(values, name="A1 x", unit="m/s^2"):
    return TimeRecord(values[:, None], RATE_4, (name,), unit)


def test_noise_of_a_sweep_is_that_of_each_part_of_its_complex_values():
    angle, tacho = run(30.0, 38.0, 8.0)
    tracked = tracked_sweep(tacho, (record(0.3 * np.cos(1.5 * angle)),))
    assert tracked.noise[0][0] == pytest.approx(0.3 / np.sqrt(2), rel=0.02)


def test_first_order_beside_other_orders_and_noise():
    angle, tacho = run(30.0, 38.0, 8.0)
    noise = np.random.default_rng(1).normal(0, 0.05, angle.size)
    signal = 2 * np.cos(angle + 0.8) + 0.7 * np.cos(2 * angle) + 0.4 * np.sin(3 * angle)
    pure = record(3 * np.cos(angle - 1), "driver", "Pa")
    tracked = tracked_sweep(tacho, (record(signal + noise), pure))
    moved, sound = tracked.spectra
    assert moved.frequency.tolist() == [31, 32, 33, 34, 35, 36, 37]
    np.testing.assert_allclose(moved.values[:, 0], 2 * np.exp(0.8j), atol=0.02)
    np.testing.assert_allclose(sound.values[:, 0], 3 * np.exp(-1j), atol=0.02)
    assert (sound.channels, sound.unit) == (("driver",), "Pa")
    # white noise of this size leaves about σ √(2 B/rate) in each part, B near 3 Hz
    assert 0.5 < tracked.noise[0][0] / (0.05 * np.sqrt(2 * 3 / RATE_4)) < 2
    assert tracked.noise[1][0] < tracked.noise[0][0]


def test_a_run_down_has_the_same_spectra():
    angle, tacho = run(38.0, 30.0, 8.0)
    tracked = tracked_sweep(tacho, (record(2 * np.cos(angle + 0.8)),))
    assert tracked.spectra[0].frequency.tolist() == [31, 32, 33, 34, 35, 36, 37]
    np.testing.assert_allclose(tracked.spectra[0].values[:, 0], 2 * np.exp(0.8j), atol=0.02)


FIRST_SECOND = TimeRecord(RECORD.values[:2048], RATE, RECORD.channels, RECORD.unit)
LATER = TimeRecord(RECORD.values, RATE, RECORD.channels, RECORD.unit, start=100.0)
UP_AND_DOWN = np.cumsum(1 / np.concatenate([np.linspace(13, 50, 150), np.linspace(50, 30, 80)]))
COUNT = np.arange(20)
BACK = PulseTrain("T1", STEADY[:20], np.where(COUNT < 10, COUNT, 19 - COUNT), 1, [], [])
GAP = np.where((TURNS > 20) & (TURNS < 50), 0, tacho())


def filtered(orders=(1.5,), bandwidth=2.0, rpm=(1500.0,), of=RECORD):
    return vold_kalman_spectra(of, SHAFT, list(orders), list(rpm), bandwidth=bandwidth)


def time_record(values, rate=10.0, channels=("a",)):
    return TimeRecord(np.array(values), rate, channels, "N")


def repaired(times, per_revolution=1):
    return repair_pulses(times, per_revolution, name="T1")


def swept(first, last, seconds):
    angle, tacho = run(first, last, seconds)
    return tracked_sweep(tacho, (record(np.cos(angle)),))


REFUSED = [
    # lines that a record does not hold
    ("does not pass 850 1/min; it goes from 9", lambda: filtered(rpm=(850.0, 1500.0))),
    (
        "does not hold the line at 2000 1/min: lines from",
        lambda: filtered((1.5,), 3.0, (1000.0, 2000.0), FIRST_SECOND),
    ),
    (
        "does not hold the line at 2000 1/min: lines from",
        lambda: quasi_static(FIRST_SECOND, SHAFT, [1000.0, 2000.0], bandwidth=2.0),
    ),
    (r"the tacho, 0.000 to 3.9.* s, do not overlap", lambda: filtered(of=LATER)),
    ("must be a list that increases", lambda: filtered(rpm=(1500.0, 1400.0))),
    ("must be a list that increases", lambda: filtered(rpm=())),
    (r"2048 Hz is too low for 1.* Hz: it needs", lambda: filtered((30.0,))),
    ("are not positive", lambda: filtered(())),
    ("are not positive", lambda: filtered((1.5, 0.0))),
    (r"bandwidths 0.0 Hz for 1 orders: give one above 0 Hz", lambda: filtered(bandwidth=0.0)),
    (r"bandwidths \[2.0, 3.0\] Hz for 1 orders", lambda: filtered(bandwidth=[2.0, 3.0])),
    ("wider than the lowest frequency of its order, 7.5", lambda: filtered((0.5, 1.5), 9.0)),
    # time records and pulses
    ("channels: 2 are needed, not 1", lambda: time_record(np.zeros((5, 2)))),
    ("values: give at least one", lambda: time_record(np.zeros((0, 1)))),
    ("rate is 0.0: give a number above 0", lambda: time_record([[0.0]], 0.0)),
    (r"not finite at index \(1, 0\)", lambda: time_record([[0.0], [np.nan]])),
    (r"channels: duplicated \['a'\]", lambda: time_record([[0.0, 0.0]], 10.0, ("a", "a"))),
    *(
        (words, lambda signal=signal: pulse_times(signal, RATE_2, name="T1"))
        for words, signal in (
            ("T1 carries no pulses, it stays at 0.2 V", np.full(5000, 0.2)),
            ("T1 is one channel of voltage", np.zeros((10, 2))),
            ("T1 is one channel of voltage", np.zeros(0)),
            ("T1: the signal is not finite at sample 3358", np.append(square(20), np.nan)),
            ("T1 has 5 pulses at 2.5 V, 10 are needed", square(5)),
        )
    ),
    *(
        (words, lambda times=times: repaired(times))
        for words, times in (
            ("T1 has 9 pulses, 10 are needed", STEADY[:9]),
            ("10 are needed", STEADY.reshape(2, -1)),
            ("increase from pulse to pulse", STEADY[::-1]),
            ("increase from pulse to pulse", np.append(STEADY, np.inf)),
            (r"about (19|20)\.\d pulses are missing betw", np.delete(RISING, np.s_[60:80])),
            ("about 6.0 pulses are missing between", np.delete(RISING, np.s_[60:66])),
            ("fit no smooth speed", np.sort(np.append(RISING, RISING + 0.0008))),
            ("fit no smooth", np.random.default_rng(1).uniform(0, 6, 150).cumsum()),
            ("not fit and 0 are missing", np.sort(np.append(STEADY, STEADY[::3] + 0.013))),
            ("104 pulses do not fit", np.append(STEADY, STEADY[-1] + np.arange(1, 60) / 40)),
        )
    ),
    ("0 pulses per revolution", lambda: repaired(STEADY, 0)),
    ("T1: .* known from 0.000 to 2.360 s only", lambda: shaft_angle(repaired(STEADY)).angle(2.5)),
    ("T1: the shaft stands still or turns back", lambda: shaft_angle(BACK)),
    (
        "T1: the run does not pass 700 1/min; it goes from",
        lambda: shaft_angle(repaired(RISING)).time_at([700.0, 900.0]),
    ),
    (
        r"T1: the speed turns back by 1\d\d\d 1/min before",
        lambda: shaft_angle(repaired(UP_AND_DOWN)).time_at([1500.0]),
    ),
    # runs, sweeps and options
    (r"g5_time: engine_torque: shape", lambda: time_run(engine_torque=np.zeros(3))),
    ("cell_force_channels: 1 are needed, not 2", lambda: time_run(cell_force_channels=("a", "b"))),
    ("tacho: a number is not finite", lambda: time_run(tacho=np.full(TIME_3.size, np.inf))),
    ("tacho carries no pulses", lambda: tracked_run(time_run(tacho=np.zeros(TIME_3.size)))),
    ("missing between|check the trigger level", lambda: tracked_run(time_run(tacho=GAP))),
    *(
        (words, lambda options=options: tracked_run(time_run(), TrackingOptions(**options)))
        for words, options in (
            ("does not pass 16.0 1/min; it goes from 12", {"highest_rpm": 1700.0}),
            ("fewer than two lines lie", {"lowest_rpm": 1390.0, "highest_rpm": 1395.0}),
            ("too short for the filter", {"bandwidth": 0.4}),
            ("12 Hz", {"bandwidth": 12.0, "other_orders": (0.5,)}),
            ("bandwidth is 0.0: give a number above 0", {"bandwidth": 0.0}),
            ("rpm_step is -1.0: give a number above 0", {"rpm_step": -1.0}),
            ("other_orders is 0.0: give", {"other_orders": (0.0,)}),
            ("fewer than two lines lie", {"lowest_rpm": 1500.0, "highest_rpm": 1400.0}),
        )
    ),
    ("s are too short", lambda: swept(30.0, 31.0, 0.5)),
    ("fewer than two lines", lambda: swept(30.2, 30.7, 8.0)),
]


@pytest.mark.parametrize(("sentence", "call"), REFUSED)
def test_what_cannot_be_tracked_is_refused(sentence, call):
    with pytest.raises(InputError, match=sentence):
        call()


@pytest.mark.parametrize("size", [WINDOW, 4 * WINDOW])
def test_running_medians_are_those_of_sorted_windows(size):
    """SciPy before 1.15.3 wrote beyond the array, and before 1.16.1 short ones came out wrong."""
    generator = np.random.default_rng(1)
    for n in (10, 11, 13, 16, 20, 60):
        values = generator.random(n)
        around = np.pad(values, size // 2, mode="reflect")
        windows = np.sort([around[k : k + size] for k in range(n)], axis=1)
        for percent in (50, 75):
            filtered = percentile_filter(values, percent, size=size, mode="mirror")
            np.testing.assert_array_equal(filtered, windows[:, size * percent // 100])


def test_pulses_with_normal_jitter_are_all_kept():
    """The farthest of 20 000 from its cubic: 4.5 deviations, 6.7 medians of unsigned deviations."""
    even = np.arange(20_000)
    jitter = np.random.default_rng(2).standard_normal(even.size)
    train = repair_pulses(1e-2 * (even + 0.004 * jitter))
    np.testing.assert_array_equal(train.number, even)
    assert train.dropped.size == 0
