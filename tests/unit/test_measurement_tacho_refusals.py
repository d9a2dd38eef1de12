"""What cannot be made into a shaft angle is refused by name."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.shaft_angle import shaft_angle
from deboom.measurement.tacho import pulse_times
from deboom.measurement.tacho_repair import PulseTrain, repair_pulses

RATE = 4096.0
STEADY = np.arange(60) / 25.0
RISING = np.cumsum(1 / np.linspace(13.0, 50.0, 150))


def square(n_pulse, per_second=25.0):
    time = np.arange(int((n_pulse + 0.5) / per_second * RATE)) / RATE
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
        pulse_times(signal, RATE, name="T1")


def test_level_and_hysteresis_can_be_set():
    """A bounce behind each edge counts only if the hysteresis lets it."""
    signal = square(20)
    edges = np.flatnonzero(np.diff(signal) > 0)
    signal[edges + 6] = 2.0
    assert pulse_times(signal, RATE, hysteresis=1.0).size == 20
    assert pulse_times(signal, RATE, hysteresis=0.2).size == 40
    assert pulse_times(signal, RATE, level=1.9, hysteresis=0.2).size == 20


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


def test_a_train_is_a_value():
    times = STEADY.copy()
    train = repair_pulses(times)
    times[0] = -1
    assert train.times[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        train.times[0] = 1
    assert train.report() == "tacho: 60 pulses, none repaired"


def test_a_long_list_of_repairs_is_cut():
    train = repair_pulses(np.delete(RISING, np.s_[10:130:12]))
    assert "10 missing (at " in train.report()
    assert train.report().endswith(", … s)")


def test_shaft_angle_refuses():
    train = repair_pulses(STEADY, name="T1")
    with pytest.raises(InputError, match="knot spacing of -1"):
        shaft_angle(train, knot_spacing=-1)
    with pytest.raises(InputError, match=r"T1: the zero mark at 9.000 s is not within"):
        shaft_angle(train, zero_time=9.0)
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
