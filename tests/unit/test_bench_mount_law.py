"""True mounts, suspended bodies, excitation and runs: the pieces, and what they refuse."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.operating_run import PlannedRun, operate, true_run
from deboom.bench.powertrain import FluidBranch, load_bench, play_operator, static_deflection
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


@pytest.mark.parametrize("name", LAWS)
def test_static_force_vanishes_at_rest_and_grows_with_deflection(name):
    law = LAWS[name]
    deflection = np.linspace(-15e-3, 15e-3, 601)
    assert law.static_force(np.zeros(1)) == pytest.approx(0.0, abs=1e-12)
    assert np.all(np.diff(law.static_force(deflection)) > 0)
    assert np.all(law.tangent_stiffness(deflection) >= law.stiffness)


def test_a_stage_adds_its_stiffness_on_its_own_side_only():
    law = replace(LAWS["TSM x"], stages=LAWS["TSM x"].stages[:1])
    far = np.array([-20e-3, 20e-3])
    stage = law.stages[0]
    assert stage.onset < 0
    assert law.tangent_stiffness(far) == pytest.approx(
        [law.stiffness + stage.stiffness, law.stiffness], rel=1e-9
    )
    half = law.tangent_stiffness(np.array([stage.onset]))
    assert half == pytest.approx(law.stiffness + stage.stiffness / 2)


@pytest.mark.parametrize("name", LAWS)
def test_every_mount_dissipates(name):
    assert np.all(LAWS[name].dynamic_factor(AMPLITUDE, FREQUENCY).imag > 0)


@pytest.mark.parametrize("name", LAWS)
def test_rubber_softens_with_amplitude(name):
    storage = LAWS[name].dynamic_factor(AMPLITUDE, FREQUENCY).real
    assert np.all(np.diff(storage, axis=0) < 0)


def test_payne_effect_has_its_loss_maximum_at_the_critical_amplitude():
    law = replace(LAWS["TSM x"], fractional_weight=0.0)
    fine = np.geomspace(1e-6, 1e-2, 4001)
    loss = law.dynamic_factor(fine, np.array(40.0)).imag
    assert fine[np.argmax(loss)] == pytest.approx(law.payne_amplitude, rel=1e-3)
    assert loss.max() == pytest.approx(law.payne_loss)


def test_limits_of_the_dynamic_factor():
    law = replace(LAWS["GeM x"], fractional_weight=0.0)
    tiny, huge = (law.dynamic_factor(np.array(x), np.array(40.0)) for x in (1e-30, 1e10))
    assert tiny == pytest.approx(1 + law.payne_storage)
    assert huge == pytest.approx(1, abs=1e-5)


def test_dynamic_ratio_scales_the_dynamic_stiffness_and_not_the_static_curve():
    law = LAWS["EnM x"]
    softer = replace(law, dynamic_ratio=0.8)
    factor = softer.dynamic_factor(AMPLITUDE, FREQUENCY)
    assert factor == pytest.approx(0.8 * law.dynamic_factor(AMPLITUDE, FREQUENCY))
    deflection = np.linspace(-5e-3, 5e-3, 11)
    assert np.array_equal(softer.static_force(deflection), law.static_force(deflection))


def test_fluid_branch_is_absent_at_rest_and_stiff_above_its_resonance():
    fluid = FluidBranch(stiffness_ratio=0.55, frequency=13.0, damping_ratio=0.3)
    assert abs(fluid.factor(np.array(1e-3))) < 1e-8
    assert fluid.factor(np.array(1e5)) == pytest.approx(0.55, rel=1e-3)
    # at resonance r² = -1 and only the damper is left in the denominator
    assert fluid.factor(np.array(13.0)) == pytest.approx(-0.55 / (2j * 0.3))


def test_transverse_directions_stiffen_with_the_main_deflection_and_the_main_one_does_not():
    reach = np.array([0.0, 3e-3, 6e-3, 12e-3])
    main, cross = LAWS["TSM x"], LAWS["TSM y"]
    assert np.all(main.cross_factor(reach, 6e-3) == 1)
    assert np.all(np.diff(cross.cross_factor(reach, 6e-3)) > 0)
    assert np.array_equal(cross.cross_factor(-reach, 6e-3), cross.cross_factor(reach, 6e-3))
    assert cross.cross_factor(reach, 6e-3)[2] == pytest.approx(1 + 1.2 * (0.5 + 0.15))


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


def test_driveline_passes_its_factor_at_low_frequency_and_isolates_above_its_mode():
    low, mode, high = BENCH.driveline.transmission(np.array([1e-3, 14.0, 80.0]))
    assert low == pytest.approx(0.40, rel=1e-3)
    assert mode == pytest.approx(0.40 / (2j * 0.12))
    assert abs(high) < 0.05 * 0.40


def test_channels_and_paths_of_a_run():
    run = true_run(BENCH, PlannedRun(5, 220.0), FREQUENCY_2)
    assert run.channels[:3] == ("EnM x", "EnM y", "EnM z")
    assert run.channels[-2:] == ("Du left x", "Du right x")
    assert run.displacement.shape == run.force.shape == run.stiffness.shape == (25, 11)
    assert run.path_force.shape == (25, 10)
    assert np.array_equal(run.path_force[:, 9], run.force[:, 9] + run.force[:, 10])


@pytest.mark.parametrize("gear", [0, 8, -1])
def test_a_gear_that_does_not_exist_is_refused(gear):
    with pytest.raises(InputError, match=f"gear {gear}: the gearbox has the gears 1 to 7"):
        operate(BENCH, gear, np.full(25, 100.0), FREQUENCY_2)


def test_a_line_does_not_depend_on_the_lines_beside_it():
    torque = np.full(25, 150.0)
    whole = operate(BENCH, 6, torque, FREQUENCY_2)
    part = operate(BENCH, 6, torque[:5], FREQUENCY_2[10:15])
    assert part.force == pytest.approx(whole.force[10:15], rel=1e-9)
