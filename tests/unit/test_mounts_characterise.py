"""From raw channels of a small rig to what the library keeps, and every complaint on the way."""

from dataclasses import replace

import numpy as np
import pytest
from mounts_campaign_samples import (
    AXES,
    CARRIERS,
    EXACT,
    RAMPS,
    Ramp,
    Rig,
    campaign_of,
    true_stiffness,
)

from deboom.errors import InputError
from deboom.measurement.tolerances import Tolerances
from deboom.mounts.characterisation import CharacteriseOptions
from deboom.mounts.characterise import STEPS, characterise, measuring_chains, training_runs
from deboom.mounts.operating_map import Preload
from deboom.mounts.response_surface import DynamicStiffnessSurface

OPTIONS = CharacteriseOptions(folds=3)
QUICK = CharacteriseOptions(folds=0, self_calibration=False)
GOOD = Tolerances(
    **{**EXACT.__dict__, "sensor_gain": 0.01, "acceleration_own": 0.002, "force_own": 0.002}
)


@pytest.fixture(scope="module")
def steps():
    return []


@pytest.fixture(scope="module")
def result(steps):
    def progress(*step):
        steps.append(step)

    return characterise(campaign_of(Rig(tolerances=GOOD)), "P1", OPTIONS, progress)


def test_progress_names_each_step(result, steps):
    total = len(STEPS)
    assert steps == [*[(k, total, name) for k, name in enumerate(STEPS)], (total, total, "P1")]


def test_surfaces_are_the_true_stiffness(result):
    for column, name in enumerate([f"{m.name} {a}" for m in CARRIERS for a in AXES]):
        one = result.directions[name]
        samples = one.measured.samples(Preload.WHEEL_TORQUE)
        modelled = one.surface.predict_masked(*samples.points.T)[0]
        assert modelled == pytest.approx(true_stiffness(samples.preload)[:, column], rel=1e-6)
        assert one.complaint == ""
        assert one.training.n_lines == len(one.measured)


def test_every_fit_is_judged_by_lines_it_has_not_seen(result):
    for one in result.directions.values():
        assert one.held_out.r2_real > 0.99
        assert 0 < one.held_out.n_lines <= one.training.n_lines
    alone = characterise(campaign_of(), "P1", QUICK)
    assert alone.directions["E x"].held_out is None


def test_what_the_library_keeps(result):
    mounts = {part.mount.name: part for part in result.mounts}
    assert list(mounts) == ["E", "G", "S", "W"]
    strut = mounts["S"]
    assert (strut.identity.campaign, strut.identity.variant) == ("rig", "P1")
    assert strut.mount.positions == CARRIERS[2].positions
    assert [direction.axis for direction in strut.directions] == ["x", "y", "z"]
    assert [direction.axis for direction in mounts["W"].directions] == ["x"]
    assert set(strut.quality) == {
        "scatter of the force transfer matrix [1]",
        "misfit of rigid motion [1]",
        "misfit of Newton's law [1]",
    }
    along_x = strut.direction("x")
    assert along_x.static_curve.force_uncertainty == 0.03
    assert strut.direction("y").static_curve is None
    one = result.directions["S x"]
    assert along_x.quality.half_width_95 == one.budget.half_width_95
    assert along_x.quality.identified
    assert along_x.quality.r2_real == one.surface.r2_real
    assert along_x.map_points.preload == pytest.approx(one.measured.static_force)
    assert along_x.map_points.wheel_torque == pytest.approx(one.measured.wheel_torque)
    assert along_x.map_points.dynamic_stiffness == pytest.approx(one.measured.stiffness)
    assert len(mounts["W"].direction("x").map_points) == 2 * len(along_x.map_points)


def test_a_kept_surface_is_the_surface(result):
    surface = result.directions["S x"].surface
    kept = result.mounts[2].direction("x").surface
    assert kept.model == "DynamicStiffnessSurface"
    assert kept.variables == ("wheel_torque", "amplitude", "frequency")
    assert kept.units == ("N m", "m", "Hz")
    again = DynamicStiffnessSurface.from_arrays(kept.arrays)
    points = result.directions["S x"].budget.points
    expected = surface.predict_masked(*points.T)[0]
    assert again.predict_masked(*points.T)[0].tolist() == expected.tolist()


def test_record_states_tolerances_with_units(result):
    record = result.record({"campaign.toml": "0" * 64})
    assert record.name == "rig"
    assert record.runs == tuple(ramp.name for ramp in RAMPS)
    assert record.tolerances["sensor_gain [1]"] == 0.01
    assert {"sensor_position [m]", "shaker_angle [rad]", "torque [N m]"} < set(record.tolerances)
    assert record.inputs_sha256 == {"campaign.toml": "0" * 64}


def test_chains_of_a_campaign_serve_all_its_mount_sets():
    campaign = campaign_of(Rig(tolerances=GOOD))
    chains = measuring_chains(campaign, OPTIONS)
    first = characterise(campaign, "P1", replace(OPTIONS, folds=0), None, chains)
    again = characterise(campaign, "P1", replace(OPTIONS, folds=0))
    assert first.chains == chains
    for name, one in first.directions.items():
        assert one.measured.stiffness == pytest.approx(again.directions[name].measured.stiffness)


# ------------------------------------------------------------------ which runs


def test_only_rising_runs_of_the_chosen_gears_count():
    ramps = (*RAMPS, Ramp(90.0, rising=False), Ramp(90.0, gear=4))
    campaign = campaign_of(Rig(ramps=ramps))
    assert [run.name for run in training_runs(campaign, "P1")] == [ramp.name for ramp in RAMPS]
    every = training_runs(campaign, "P1", CharacteriseOptions(gears=None))
    assert [run.name for run in every] == [ramp.name for ramp in (*RAMPS, ramps[-1])]


def test_falling_runs_alone_are_refused():
    ramps = (Ramp(90.0, rising=False), Ramp(120.0, full_load=True, rising=False))
    with pytest.raises(InputError, match=r"falling torque: measure a run with rising torque"):
        characterise(campaign_of(Rig(ramps=ramps)), "P1")


def test_gears_that_are_not_there():
    with pytest.raises(InputError, match=r"no run in the gears \(7,\), only in \[5\]"):
        characterise(campaign_of(), "P1", CharacteriseOptions(gears=(7,)))


def test_unknown_mount_set():
    with pytest.raises(InputError, match="there is no mount set 'P9'"):
        characterise(campaign_of(), "P9")


# ------------------------------------------------------------------ bad channels


def test_dead_channel():
    campaign = campaign_of(Rig(channel_gain={"A4 x": 0.0}))
    with pytest.raises(InputError, match="acceleration channel 'A4 x' is dead"):
        characterise(campaign, "P1")


def test_reversed_channel_is_named_and_can_be_switched_off():
    rig = Rig(tolerances=GOOD, channel_gain={"A2 x": -1.0})
    with pytest.raises(InputError, match=r"A2 x: .*reversed|A2 x: .*sign"):
        characterise(campaign_of(rig), "P1")
    found = characterise(campaign_of(replace(rig, switched_off=("A2 x",))), "P1", QUICK)
    true = true_stiffness(found.directions["E x"].measured.wheel_torque)[:, 0]
    assert found.directions["E x"].measured.stiffness == pytest.approx(true, rel=1e-6)


def test_direction_that_was_never_loaded_leaves_the_others():
    # the floor lies above what moves along y, and below what moves along x
    tolerances = replace(EXACT, acceleration_floor=0.5)
    result = characterise(campaign_of(Rig(tolerances=tolerances)), "P1", QUICK)
    lost = [name for name, one in result.directions.items() if one.surface is None]
    assert lost
    for name in lost:
        assert "lines near the floor" in result.directions[name].complaint
        assert result.directions[name].budget is None
        kept = result.mounts["EGSW".index(name[0])].direction(name[2])
        assert not kept.quality.identified
        assert kept.surface is None
        masked = result.directions[name].measured.near_floor
        assert np.array_equal(kept.map_points.confidence == 0.0, masked)
    assert result.directions["S x"].surface is not None


def test_static_force_that_was_not_measured_is_asked_for():
    campaign = campaign_of()
    runs = tuple(
        replace(
            run, static_force=run.static_force[:, 1:], static_force_names=run.static_force_names[1:]
        )
        for run in campaign.runs
    )
    result = characterise(replace(campaign, runs=runs), "P1", QUICK)
    with pytest.raises(InputError, match="static force of E x was not measured"):
        _ = result.mounts


@pytest.mark.parametrize("folds", [1, -2])
def test_folds_that_hold_nothing_out(folds):
    with pytest.raises(InputError, match="leave nothing to fit"):
        CharacteriseOptions(folds=folds)
