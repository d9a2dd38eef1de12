"""True mounts, suspended bodies, excitation and runs: the pieces, and what they refuse."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.operating_run import operate
from deboom.bench.powertrain import load_bench, play_operator, static_deflection
from deboom.errors import InputError

BENCH = load_bench()
LAWS = dict(
    zip(
        [f"{mount} {axis}" for mount in BENCH.mount_names for axis in "xyz"] + ["Du x"],
        BENCH.powertrain.laws + BENCH.wheel_end.laws,
        strict=True,
    )
)
AMPLITUDE = np.geomspace(1e-7, 5e-3, 40)[:, None]
FREQUENCY = np.linspace(5.0, 150.0, 30)


def test_dynamic_ratio_scales_the_dynamic_stiffness_and_not_the_static_curve():
    law = LAWS["EnM x"]
    softer = replace(law, dynamic_ratio=0.8)
    factor = softer.dynamic_factor(AMPLITUDE, FREQUENCY)
    assert factor == pytest.approx(0.8 * law.dynamic_factor(AMPLITUDE, FREQUENCY))
    deflection = np.linspace(-5e-3, 5e-3, 11)
    assert np.array_equal(softer.static_force(deflection), law.static_force(deflection))


FREQUENCY_2 = np.linspace(20.0, 80.0, 25)


def test_play_follows_a_load_that_rises_and_falls():
    there = np.linspace(0, 2e-3, 41)
    path = np.concatenate([there, there[::-1]])[:, None]
    remembered = play_operator(path, 0.25e-3)[:, 0]
    rising, falling = remembered[:41], remembered[41:]
    assert np.all(rising[there <= 0.25e-3] == 0)
    assert rising[there > 0.25e-3] == pytest.approx(there[there > 0.25e-3] - 0.25e-3)
    back = there[::-1]
    assert falling[back >= 1.5e-3 + 1e-9] == pytest.approx(1.75e-3)
    assert falling[back < 1.5e-3] == pytest.approx(back[back < 1.5e-3] + 0.25e-3)


def test_a_load_beyond_all_reach_is_an_error():
    load = np.full((1, 6), 1e9)
    with pytest.raises(ArithmeticError, match="no static equilibrium"):
        static_deflection(BENCH.powertrain, load)


def test_full_load_ramp_builds_up_from_zero_to_its_limit():
    rpm = np.array([700.0, 790.0, 1000.0, 1600.0, 4000.0])
    torque = BENCH.ramp.torque(220.0, rpm)
    assert np.all(torque[:2] == 0)
    assert np.all(np.diff(torque[1:]) > 0)
    assert torque[3] > 0.9 * 220
    assert torque[4] == pytest.approx(220.0, rel=1e-3)


def test_order_torque_grows_with_load_and_overrun_counts_as_no_load():
    rpm = np.full(3, 2000.0)
    none, overrun, loaded = BENCH.order_torque.torque(np.array([0.0, -50.0, 100.0]), rpm)
    assert overrun == none
    assert abs(none) == pytest.approx(38.0)
    assert abs(loaded) == pytest.approx(38 + 192.0)


@pytest.mark.parametrize("gear", [0, 8, -1])
def test_a_gear_that_does_not_exist_is_refused(gear):
    with pytest.raises(InputError, match=f"gear {gear}: the gearbox has the gears 1 to 7"):
        operate(BENCH, gear, np.full(25, 100.0), FREQUENCY_2)
