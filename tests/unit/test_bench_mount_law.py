"""The true mount law: what a rubber mount must do, whatever its parameters."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.mount_law import FluidBranch
from deboom.bench.parameters import load_bench

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
