"""Which lines count as measured under rising torque."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.rising_torque import RunDirection, rising_lines, rising_runs, torque_slope

TIME = np.linspace(0, 90, 241)


def test_the_slope_of_a_straight_line_is_exact_up_to_the_ends():
    uneven = np.sort(np.random.default_rng(1).uniform(0, 90, 241))
    slope, gain = torque_slope(uneven, 50 - 3.5 * uneven, 9.0)
    np.testing.assert_allclose(slope, -3.5, rtol=1e-9)
    assert np.all(gain > 0)


def test_the_noise_gain_is_the_scatter_of_the_slope():
    generator = np.random.default_rng(2)
    slopes = np.array([torque_slope(TIME, generator.normal(size=241), 9.0)[0] for _ in range(2000)])
    np.testing.assert_allclose(slopes.std(axis=0), torque_slope(TIME, TIME, 9.0)[1], rtol=0.1)


def test_runs_are_chosen_by_their_stated_direction():
    run = ["up"] * 3 + ["down"] * 2 + ["up again"]
    directions = {
        "up": RunDirection.RISING,
        "down": RunDirection.FALLING,
        "up again": RunDirection("rising"),
        "not measured": RunDirection.FALLING,
    }
    assert rising_runs(run, directions).tolist() == [True] * 3 + [False] * 2 + [True]


def test_runs_without_direction_or_with_falling_torque_only_are_refused():
    with pytest.raises(InputError, match=r"no direction stated for the runs \['b'\]"):
        rising_runs(["a", "b"], {"a": RunDirection.RISING})
    with pytest.raises(InputError, match="all have falling torque: measure a run with rising"):
        rising_runs(["a", "a"], {"a": RunDirection.FALLING})


def test_a_run_of_falling_torque_only_is_refused():
    with pytest.raises(InputError, match="only falls: measure a run with rising torque"):
        rising_lines(TIME, 220 - 2 * TIME, 9.0, 1.0)


@pytest.mark.parametrize(
    ("time", "torque", "window", "noise", "words"),
    [
        (TIME, TIME[:-1], 9.0, 1.0, "differ"),
        (TIME[::-1], TIME, 9.0, 1.0, "must increase"),
        (TIME, np.where(TIME == 0, np.nan, TIME), 9.0, 1.0, "not finite"),
        (TIME, TIME, 1.0, 1.0, "five are needed"),
        (TIME, TIME, 9.0, 0.0, "noise is above 0"),
        ([], [], 9.0, 1.0, "differ"),
    ],
)
def test_records_without_sense_are_refused(time, torque, window, noise, words):
    with pytest.raises(InputError, match=words):
        rising_lines(time, torque, window, noise)
