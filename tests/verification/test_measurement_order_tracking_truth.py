"""Order tracking of simulated runs of known orders."""

import numpy as np
import pytest

from deboom.bench import campaign
from deboom.bench.powertrain import load_bench, with_mount_set
from deboom.errors import InputError
from deboom.measurement.channels import TimeRecord
from deboom.measurement.order_tracking import quasi_static, vold_kalman_spectra
from deboom.measurement.tacho import pulse_times, repair_pulses, shaft_angle

ORDERS = (0.5, 1.5, 3.0, 6.0)
RPM = np.arange(1560.0, 2041.0, 10.0)
PLAN = campaign.TimeRunPlan()


@pytest.fixture(scope="module")
def recorded():
    bench = load_bench()
    errors = campaign.CampaignErrors()
    sensors = campaign.draw_campaign_sensors(bench, errors, np.random.SeedSequence(1))
    on_bench = with_mount_set(bench, PLAN.mount_set)
    return campaign.record_over_time(on_bench, sensors, PLAN, errors, np.random.default_rng(1))


@pytest.fixture(scope="module")
def shaft(recorded):
    times = pulse_times(recorded[0]["tacho"][:, 0], PLAN.sample_rate)
    return shaft_angle(repair_pulses(times, PLAN.pulses_per_revolution))


def test_speed_is_the_true_one(recorded, shaft):
    time, speed = recorded[1]["time"], recorded[1]["speed"]
    inside = (time >= shaft.begin) & (time <= shaft.end)
    np.testing.assert_allclose(shaft.rpm(time[inside]), speed[inside], rtol=1e-4)


@pytest.mark.parametrize("quantity", ["acceleration", "cell force"])
def test_amplitude_within_one_percent_and_phase_within_one_degree(recorded, shaft, quantity):
    """Every channel above a tenth of the largest; order 1.5 sweeps 2.5 Hz/s beside 0.5, 3 and 6."""
    signals, steady = recorded
    values = signals[quantity]
    names = tuple(f"C{i}" for i in range(values.shape[1]))
    record = TimeRecord(values, PLAN.sample_rate, names, "N")
    true_rpm = steady["frequency"] * 60 / 1.5
    truth = steady[quantity.replace(" ", "_")][np.searchsorted(true_rpm, RPM - 0.1)]
    loud = np.abs(truth) > 0.1 * np.abs(truth).max()
    assert np.count_nonzero(loud) > 500
    spectrum = vold_kalman_spectra(record, shaft, ORDERS, RPM, bandwidth=3.0)[1]
    ratio = spectrum.spectrum.values[loud] / truth[loud]
    assert np.abs(np.abs(ratio) - 1).max() < 0.01
    assert np.rad2deg(np.abs(np.angle(ratio))).max() < 1.0
    assert np.median(np.abs(np.abs(ratio) - 1)) < 0.001
    assert spectrum.smear.max() < 1.8


RATE = 16384.0
ORDERS_2 = (0.5, 1.5, 3.0)
RPM_2 = np.arange(1000.0, 2601.0, 50.0)


class Run:
    """A linear run between two speeds with a tacho of one pulse per revolution."""

    def __init__(self, first_rpm, last_rpm, duration):
        self.time = np.arange(int(duration * RATE)) / RATE
        slope = (last_rpm - first_rpm) / duration
        self.rpm = first_rpm + slope * self.time
        turned = (first_rpm * self.time + slope * self.time**2 / 2) / 60 - 0.4
        self.angle = 2 * np.pi * turned
        within = np.mod(turned + 0.5, 1.0) - 0.5
        edge = 2 * self.rpm / 60 / RATE
        rise = np.clip(within / edge + 0.5, 0, 1)
        self.tacho = 5 * rise * np.clip((0.2 - within) / edge + 0.5, 0, 1)

    def shaft(self, tacho=None):
        """Shaft angle as a laboratory would get it."""
        return shaft_angle(repair_pulses(pulse_times(self.tacho if tacho is None else tacho, RATE)))

    def record(self, *columns):
        """Make a record of some channels."""
        names = tuple(f"A{i} x" for i in range(len(columns)))
        return TimeRecord(np.column_stack(columns), RATE, names, "N")

    def order(self, order, amplitude):
        """Signal of one order."""
        return np.real(amplitude * np.exp(1j * order * self.angle))


def worst(spectrum, truth):
    """Largest error of the amplitude [%] and of the phase [deg]."""
    ratio = spectrum.spectrum.values[:, 0] / truth
    return 100 * np.abs(np.abs(ratio) - 1).max(), np.rad2deg(np.abs(np.angle(ratio)).max())


@pytest.mark.parametrize("speeds", [(700.0, 2900.0), (2900.0, 700.0)])
def test_three_orders_of_a_run(speeds):
    """Orders 0.5, 1.5 and 3 on a static force of 500 N that rises; up and down, 5 s."""
    run = Run(*speeds, 5.0)
    shaft = run.shaft()
    amplitudes = {0.5: 0.4 * np.exp(1j), 1.5: 3 * np.exp(-0.5j), 3.0: 1.2 * np.exp(2.5j)}
    static = 500 + 0.1 * run.rpm
    record = run.record(static + sum(run.order(q, a) for q, a in amplitudes.items()))
    spectra = vold_kalman_spectra(record, shaft, ORDERS_2, RPM_2, bandwidth=3.0)
    for order, spectrum in zip(ORDERS_2, spectra, strict=True):
        percent, degrees = worst(spectrum, amplitudes[order])
        assert percent < 0.3
        assert degrees < 0.3
        np.testing.assert_allclose(spectrum.spectrum.frequency, order * RPM_2 / 60)
        assert spectrum.spectrum.channels == ("A0 x",)
        assert spectrum.spectrum.unit == "N"
        np.testing.assert_allclose(np.interp(spectrum.time, run.time, run.rpm), RPM_2, rtol=1e-4)
    slow = quasi_static(record, shaft, RPM_2, bandwidth=2.0)
    np.testing.assert_allclose(slow[:, 0], 500 + 0.1 * RPM_2, rtol=1e-3)


def test_damaged_tacho_changes_nothing_that_counts():
    """Three pulses erased, a spike added: amplitude within 0.3 %, phase within 0.3 degrees."""
    run = Run(700.0, 2900.0, 5.0)
    tacho = run.tacho.copy()
    begin = np.flatnonzero(np.diff((tacho > 2.5).astype(int)) == 1)
    for pulse in (20, 60, 61):
        tacho[begin[pulse] - 20 : begin[pulse + 1] - 20] = 0
    tacho[begin[90] + 200 : begin[90] + 204] = 5
    record = run.record(run.order(1.5, 3 * np.exp(-0.5j)))
    shaft = run.shaft(tacho)
    assert shaft.pulses.dropped.size == 1
    assert shaft.pulses.missing.size == 3
    (spectrum,) = vold_kalman_spectra(record, shaft, [1.5], RPM_2, bandwidth=3.0)
    percent, degrees = worst(spectrum, 3 * np.exp(-0.5j))
    assert percent < 0.3
    assert degrees < 0.3


def test_record_and_tacho_may_start_at_different_times():
    run = Run(700.0, 2900.0, 5.0)
    full = run.record(run.order(1.5, 2.0))
    later = TimeRecord(full.values[8000:], RATE, full.channels, "N", start=8000 / RATE)
    shaft = run.shaft()
    lines = np.array([1500.0, 2000.0])
    expected, shifted = (
        vold_kalman_spectra(record, shaft, [1.5], lines, bandwidth=3.0)[0].spectrum.values
        for record in (full, later)
    )
    np.testing.assert_allclose(shifted, expected, atol=1e-4)


START, SLOPE, DURATION, LATE = 12.0, 7.6, 5.0, 1 / 3
"""Linear run-up [rev/s, rev/s², s]; the first pulse comes a third of a revolution late."""


def revolution(time):
    return START * time + SLOPE * time**2 / 2 - LATE


def speed(time):
    return 60 * (START + SLOPE * time)


def pulses(per_revolution=1):
    turned = np.arange(int(revolution(DURATION) * per_revolution) + 1) / per_revolution + LATE
    return (np.sqrt(START**2 + 2 * SLOPE * turned) - START) / SLOPE


def worst_angle(shaft):
    """Largest error of the angle [deg]."""
    time = np.linspace(shaft.begin, shaft.end, 3001)
    return np.rad2deg(np.abs(shaft.angle(time) - 2 * np.pi * revolution(time)).max())


def voltage(turned, *, width=0.2, edge=0.0):
    """Pulses of 5 V over 0.2 V; the rising edge is straight and `edge` revolutions wide."""
    within = np.mod(turned + 0.5, 1.0) - 0.5
    if np.all(edge == 0.0):
        return 0.2 + 4.8 * ((within >= 0) & (within < width))
    rise = np.clip(within / edge + 0.5, 0, 1)
    return 0.2 + 4.8 * rise * np.clip((width - within) / edge + 0.5, 0, 1)


def test_clean_pulses_give_angle_and_speed():
    shaft = shaft_angle(repair_pulses(pulses()))
    assert worst_angle(shaft) < 1e-3
    time = np.linspace(shaft.begin, shaft.end, 101)
    np.testing.assert_allclose(shaft.rpm(time), speed(time), rtol=1e-5)
    np.testing.assert_allclose(shaft.rpm_rate(time), 60 * SLOPE, rtol=2e-3)
    wanted = np.array([900.0, 1500.0, 2800.0])
    np.testing.assert_allclose(speed(shaft.time_at(wanted)), wanted, rtol=1e-5)


@pytest.mark.parametrize(
    ("samples", "noise", "late", "degrees"),
    [
        (2, 0.0, 0.01, 0.02),  # straight between the samples about its middle
        (0, 0.0, 0.5 + 1e-9, 0.6),  # half a sample at 50 rev/s is 0.55 degrees
        (4, 0.1, 0.6, 0.2),
    ],
)
def test_voltages_are_read_between_samples(samples, noise, late, degrees):
    """Edges of so many samples, noise [V] and an offset: delay [samples] and angle."""
    time = np.arange(int(DURATION * RATE)) / RATE
    edge = samples * speed(time) / 60 / RATE
    rough = np.random.default_rng(2).normal(0, noise, time.size)
    times = pulse_times(-3 + voltage(revolution(time), edge=edge) + rough, RATE)
    expected = pulses()[pulses() < time[-1]]
    assert times.size == expected.size
    assert np.abs(times - expected).max() <= late / RATE
    assert worst_angle(shaft_angle(repair_pulses(times))) < degrees


def test_missing_doubled_and_displaced_pulses_are_named():
    true = pulses()
    damaged = np.delete(true, [20, 50, 51, 52, 100])
    damaged[70] += 0.2 * (true[75] - true[74])
    stray = [0.5 * (true[10] + true[11]), true[30] + 0.0007]
    train = repair_pulses(np.sort(np.append(damaged, stray)))
    np.testing.assert_allclose(train.dropped, np.sort([*stray, damaged[70]]))
    assert train.times.size == true.size - 6
    np.testing.assert_allclose(train.times, np.delete(true, [20, 50, 51, 52, 74, 100]))
    np.testing.assert_array_equal(
        np.setdiff1d(np.arange(true.size), train.number), [20, 50, 51, 52, 74, 100]
    )
    np.testing.assert_allclose(train.missing, true[[20, 50, 51, 52, 74, 100]], atol=2e-3)
    assert "3 dropped" in train.report()
    assert "6 missing" in train.report()
    assert worst_angle(shaft_angle(train)) < 1e-3


def test_sixty_teeth_with_two_left_out():
    true = pulses(60)
    tooth = np.arange(true.size) % 60
    train = repair_pulses(true[tooth < 58], 60)
    assert train.dropped.size == 0
    assert train.missing.size == 0
    assert np.array_equal(train.number, np.flatnonzero(tooth < 58))
    assert worst_angle(shaft_angle(train)) < 1e-3


def test_jitter_is_averaged_and_stated():
    """Gaussian jitter of 20 µs; the angle errs by 0.7 of it, and the residual tells its size."""
    rng = np.random.default_rng(4)
    true = pulses()
    jitter = rng.normal(0, 20e-6, true.size)
    shaft = shaft_angle(repair_pulses(true + jitter))
    in_angle = 2 * np.pi * speed(true) / 60 * jitter
    assert shaft.jitter == pytest.approx(np.sqrt(np.mean(in_angle**2)), rel=0.25)
    time = np.linspace(shaft.begin, shaft.end, 3001)
    error = shaft.angle(time) - 2 * np.pi * revolution(time)
    assert np.sqrt(np.mean(error**2)) < 0.7 * np.sqrt(np.mean(in_angle**2))


def test_unevenness_within_a_cycle_does_not_bend_the_angle():
    """Torsion of 1 degree at order 1.5 on a wheel with 60 teeth: the mean rotation comes out."""
    time = np.arange(int(DURATION * 65536)) / 65536
    smooth = revolution(time)
    shaken = smooth + np.sin(2 * np.pi * 1.5 * smooth) / 360
    count = np.arange(int(shaken[-1] * 60))
    shaft = shaft_angle(repair_pulses(np.interp(count / 60, shaken, time), 60))
    assert np.rad2deg(shaft.jitter) == pytest.approx(1 / np.sqrt(2), rel=0.05)
    inside = np.linspace(shaft.begin + 0.3, shaft.end - 0.1, 2001)
    error = np.rad2deg(shaft.angle(inside) - 2 * np.pi * revolution(inside))
    assert np.abs(error - error.mean()).max() < 0.15


@pytest.mark.parametrize("shift", [-0.3, 0.1, 0.3])
def test_a_first_pulse_that_is_left_out_keeps_the_zero_mark(shift):
    true = pulses()
    displaced = true.copy()
    displaced[0] -= shift * (true[1] - true[0])
    train = repair_pulses(displaced)
    assert train.dropped[0] == displaced[0]
    assert train.number[0] == 1
    assert worst_angle(shaft_angle(train)) < 1e-3


@pytest.mark.parametrize("seed", range(1, 13))
def test_damage_at_random_is_repaired_or_refused_but_never_wrong(seed):
    """Up to 5 % missing, 4 % stray and 2 % displaced pulses, jitter of 0.2 % of an interval."""
    rng = np.random.default_rng(seed)
    per_revolution = int(rng.choice([1, 2, 60]))
    true = pulses(per_revolution)
    interval = np.gradient(true)
    times = true + 0.002 * interval * rng.normal(size=true.size)
    moved = rng.random(true.size) < rng.uniform(0, 0.02)
    times[moved] += rng.uniform(-0.4, 0.4, moved.sum()) * interval[moved]
    times = times[rng.random(true.size) >= rng.uniform(0, 0.05)]
    stray = rng.uniform(times[0], times[-1], int(rng.uniform(0, 0.04) * true.size))
    try:
        train = repair_pulses(np.unique(np.append(times, stray)), per_revolution)
    except InputError:
        pytest.fail("this much damage is to be repaired")
    shaft = shaft_angle(train)
    time = np.linspace(shaft.begin, shaft.end, 3001)
    pulses_off = per_revolution * (shaft.angle(time) / (2 * np.pi) - revolution(time))
    assert np.ptp(pulses_off) < 0.06


@pytest.mark.parametrize("seed", range(1, 31))
def test_a_shaft_that_turns_back_is_refused(seed):
    """Slows down evenly, stops anywhere between two pulses and turns back."""
    rng = np.random.default_rng(seed)
    fast, braking = rng.uniform(8, 40), rng.uniform(2, 20)
    turned = np.arange(int(fast**2 / 2 / braking)) + rng.uniform(0, 1)
    away = np.sqrt(2 * turned / braking)
    times = np.unique(np.concatenate([-away, away]))
    with pytest.raises(InputError, match=r"turns back|fit no smooth speed|are needed"):
        shaft_angle(repair_pulses(times))
