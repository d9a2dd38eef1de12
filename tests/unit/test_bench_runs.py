"""Suspended bodies, excitation and runs: the pieces, and what they refuse."""

import numpy as np
import pytest

from deboom.bench.excitation import FULL_LOAD_RAMP, THREE_CYLINDER_TORQUE
from deboom.bench.operating_run import full_load_run, operate
from deboom.bench.parameters import load_bench
from deboom.bench.suspended_body import play_operator, static_deflection
from deboom.errors import InputError

BENCH = load_bench()
FREQUENCY = np.linspace(20.0, 80.0, 25)


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


def test_no_play_remembers_everything():
    path = np.random.default_rng(1).normal(size=(20, 3))
    assert np.array_equal(play_operator(path, 0.0), path)


def test_directions_are_stacked_by_mount_then_axis():
    powertrain = BENCH.powertrain
    assert powertrain.forward.shape == (9, 6)
    assert [(b.start, b.stop) for b in powertrain.blocks] == [(0, 3), (3, 6), (6, 9)]
    # pitch +ry: a point above the centre of gravity goes to +x, one below to -x
    assert np.all(np.sign(powertrain.forward[[0, 3, 6], 4]) == [1, 1, -1])


def test_an_unloaded_body_rests_and_a_driven_one_tips_rearward_at_the_top():
    load = np.zeros((2, 6))
    load[1, 4] = 748.0
    rest, driven = static_deflection(BENCH.powertrain, load)
    assert np.all(rest == 0)
    assert driven[0] > 0
    assert driven[3] > 0
    assert driven[6] < 0


def test_a_load_beyond_all_reach_is_an_error():
    load = np.full((1, 6), 1e9)
    with pytest.raises(ArithmeticError, match="no static equilibrium"):
        static_deflection(BENCH.powertrain, load)


def test_full_load_ramp_builds_up_from_zero_to_its_limit():
    rpm = np.array([700.0, 790.0, 1000.0, 1600.0, 4000.0])
    torque = FULL_LOAD_RAMP.torque(220.0, rpm)
    assert np.all(torque[:2] == 0)
    assert np.all(np.diff(torque[1:]) > 0)
    assert torque[3] > 0.9 * 220
    assert torque[4] == pytest.approx(220.0, rel=1e-3)


def test_order_torque_grows_with_load_and_overrun_counts_as_no_load():
    rpm = np.full(3, 2000.0)
    none, overrun, loaded = THREE_CYLINDER_TORQUE.torque(np.array([0.0, -50.0, 100.0]), rpm)
    assert overrun == none
    assert abs(none) == pytest.approx(38.0)
    assert abs(loaded) == pytest.approx(38 + 192.0)


def test_driveline_passes_its_factor_at_low_frequency_and_isolates_above_its_mode():
    low, mode, high = BENCH.driveline.transmission(np.array([1e-3, 14.0, 80.0]))
    assert low == pytest.approx(0.40, rel=1e-3)
    assert mode == pytest.approx(0.40 / (2j * 0.12))
    assert abs(high) < 0.05 * 0.40


def test_channels_and_paths_of_a_run():
    run = full_load_run(BENCH, 5, 220.0, FREQUENCY)
    assert run.channels[:3] == ("EnM x", "EnM y", "EnM z")
    assert run.channels[-2:] == ("Du left x", "Du right x")
    assert run.displacement.shape == run.force.shape == run.stiffness.shape == (25, 11)
    assert run.path_force.shape == (25, 10)
    assert np.array_equal(run.path_force[:, 9], run.force[:, 9] + run.force[:, 10])


def test_truth_is_read_only_and_does_not_freeze_the_callers_array():
    frequency = FREQUENCY.copy()
    run = full_load_run(BENCH, 5, 220.0, frequency)
    with pytest.raises(ValueError, match="read-only"):
        run.powertrain.displacement[0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        run.frequency[0] = 1
    frequency[0] = 19.0


@pytest.mark.parametrize("gear", [0, 8, -1])
def test_a_gear_that_does_not_exist_is_refused(gear):
    with pytest.raises(InputError, match=f"gear {gear}: the gearbox has the gears 1 to 7"):
        operate(BENCH, gear, np.full(25, 100.0), FREQUENCY)


def test_a_line_does_not_depend_on_the_lines_beside_it():
    torque = np.full(25, 150.0)
    whole = operate(BENCH, 6, torque, FREQUENCY)
    part = operate(BENCH, 6, torque[:5], FREQUENCY[10:15])
    assert part.force == pytest.approx(whole.force[10:15], rel=1e-9)
