"""Characterisation and measuring chains."""

from dataclasses import replace

import numpy as np
import pytest
from mounts_campaign_samples import (
    ACCELEROMETERS,
    AXES,
    CARRIERS,
    EXACT,
    MASS_MATRIX,
    RAMPS,
    Ramp,
    Rig,
    campaign_of,
    true_stiffness,
)
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from deboom.errors import InputError
from deboom.measurement.sensors import SensorKind
from deboom.measurement.virtual_point import sensor_geometry
from deboom.mounts import measuring_chain
from deboom.mounts.characterise import CharacteriseOptions, characterise, training_runs
from deboom.mounts.characterised_mount import FORCE_PER_TORQUE
from deboom.mounts.error_budget import IDENTIFIED, error_budget
from deboom.mounts.measuring_chain import NEWTON, RIGID_MOTION
from deboom.mounts.operating_map import Preload
from deboom.mounts.self_calibration import FreeBody, self_calibrated
from deboom.physics.rigid_body import rotation_matrix

QUICK = CharacteriseOptions(self_calibration=False)
GOOD = replace(EXACT, sensor_gain=0.01, acceleration_own=0.002, force_own=0.002)


@pytest.fixture(scope="module")
def result():
    return characterise(campaign_of(Rig(tolerances=GOOD)), "P1")


def test_surfaces_are_the_true_stiffness(result):
    for column, name in enumerate([f"{m.name} {a}" for m in CARRIERS for a in AXES]):
        direction = result.directions[name]
        samples = direction.measured.samples(Preload.WHEEL_TORQUE)
        modelled = direction.surface.predict(samples.points, extrapolate=True)
        assert modelled == pytest.approx(true_stiffness(samples.preload)[:, column], rel=1e-6)
        assert direction.complaint == ""


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
    direction_x = result.directions["S x"]
    assert along_x.quality.half_width_95 == direction_x.budget.half_width_95
    assert along_x.quality.identified
    assert along_x.surface is direction_x.surface
    # 7 N of static force per N m, see the samples
    assert along_x.settings[FORCE_PER_TORQUE] == pytest.approx(7.0)
    assert along_x.quality.r2_real == direction_x.surface.r2_real_
    assert along_x.map_points.preload == pytest.approx(direction_x.measured.static_force)
    assert along_x.map_points.wheel_torque == pytest.approx(direction_x.measured.wheel_torque)
    assert along_x.map_points.dynamic_stiffness == pytest.approx(direction_x.measured.stiffness)
    assert len(mounts["W"].direction("x").map_points) == 2 * len(along_x.map_points)


def test_record_states_tolerances_with_units(result):
    record = result.record({"campaign.toml": "0" * 64})
    assert record.name == "rig"
    assert record.runs == tuple(ramp.name for ramp in RAMPS)
    assert record.tolerances["sensor_gain [1]"] == 0.01
    assert {"sensor_position [m]", "shaker_angle [rad]", "torque [N m]"} < set(record.tolerances)
    assert record.inputs_sha256 == {"campaign.toml": "0" * 64}


def test_chains_of_a_campaign_serve_all_its_mount_sets(result):
    given = characterise(result.campaign, "P1", chains=result.chains)
    assert given.chains == result.chains
    for name, direction in given.directions.items():
        assert direction.measured.stiffness == pytest.approx(
            result.directions[name].measured.stiffness
        )


# ------------------------------------------------------------------ which runs


def test_only_rising_runs_of_the_chosen_gears_count():
    ramps = (*RAMPS, Ramp(90.0, rising=False), Ramp(90.0, gear=4))
    campaign = campaign_of(Rig(ramps=ramps))
    assert [run.name for run in training_runs(campaign, "P1")] == [ramp.name for ramp in RAMPS]
    every = training_runs(campaign, "P1", CharacteriseOptions(gears=None))
    assert [run.name for run in every] == [ramp.name for ramp in (*RAMPS, ramps[-1])]


FALLING = (Ramp(90.0, rising=False), Ramp(120.0, full_load=True, rising=False))


@pytest.mark.parametrize(
    ("rig", "mount_set", "gears", "words"),
    [
        (Rig(ramps=FALLING), "P1", (5,), "falling torque: measure a run with rising torque"),
        (Rig(), "P1", (7,), r"no run in the gears \(7,\), only in \[5\]"),
        (Rig(), "P9", (5,), "there is no mount set 'P9'"),
        (Rig(channel_gain={"A4 x": 0.0}), "P1", (5,), "acceleration channel 'A4 x' is dead"),
    ],
)
def test_runs_that_cannot_be_used_are_refused(rig, mount_set, gears, words):
    with pytest.raises(InputError, match=words):
        characterise(campaign_of(rig), mount_set, CharacteriseOptions(gears=gears))


def test_reversed_channel_is_named_and_can_be_switched_off():
    rig = Rig(tolerances=GOOD, channel_gain={"A2 x": -1.0})
    with pytest.raises(InputError, match=r"A2 x: .*reversed|A2 x: .*sign"):
        characterise(campaign_of(rig), "P1")
    steps = []
    mended = campaign_of(replace(rig, switched_off=("A2 x",)))
    result = characterise(mended, "P1", QUICK, lambda *step: steps.append(step))
    assert [step[:2] for step in steps] == [(done, 4) for done in range(5)]
    true = true_stiffness(result.directions["E x"].measured.wheel_torque)[:, 0]
    assert result.directions["E x"].measured.stiffness == pytest.approx(true, rel=1e-6)


def test_another_order_of_the_angles_is_named():
    """The sheet says RxRyRz, the sensors are turned by RzRyRx: five sensors disagree."""

    def misread(sensor):
        if sensor.kind is not SensorKind.ACCELEROMETER:
            return sensor
        angles = Rotation.from_matrix(sensor.orientation).as_euler("xyz")
        turned = rotation_matrix(angles, "RxRyRz")
        return replace(sensor, orientation=turned, rotation_order="RxRyRz")

    sensors = tuple(map(misread, Rig().sensors))
    with pytest.raises(
        InputError,
        match=r"were read as RxRyRz; read as RzRyRx the disagreement "
        r"falls from .* %: write a column rotation_order with RzRyRx into it",
    ):
        characterise(campaign_of(Rig(tolerances=GOOD, sensors=sensors)), "P1")
    rig = Rig(tolerances=GOOD, channel_gain={"A2 x": -1.0})
    with pytest.raises(InputError, match="read as RzRyRx, and no other order fits better"):
        characterise(campaign_of(rig), "P1")


def test_direction_that_was_never_loaded_leaves_the_others():
    # the floor lies above what moves along y, and below what moves along x
    tolerances = replace(EXACT, acceleration_floor=0.5)
    result = characterise(campaign_of(Rig(tolerances=tolerances)), "P1", QUICK)
    lost = [name for name, direction in result.directions.items() if direction.surface is None]
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
    with pytest.raises(InputError, match="static force of E x was not measured in all runs"):
        characterise(replace(campaign, runs=runs), "P1", QUICK)


GOOD_2 = replace(
    EXACT,
    sensor_position=0.002,
    sensor_angle=0.01,
    sensor_gain=0.01,
    sensor_cross_axis=0.006,
    shaker_angle=0.01,
    shaker_gain=0.005,
    cell_gain=0.005,
    acceleration_own=0.002,
    acceleration_norm=1e-4,
    force_own=0.002,
    force_norm=1e-4,
)
NOISY = replace(GOOD, acceleration_own=0.02, force_own=0.02)
FREE = FreeBody(MASS_MATRIX, 0.6, 0.01, 0.001, ("my",), 0.003)


@pytest.fixture(autouse=True)
def one_thread():
    """Matrices too small to share: threads would only wait for each other."""
    with threadpool_limits(1):
        yield


def chain_of(rig):
    campaign = campaign_of(rig)
    body = measuring_chain.instrumented_bodies(campaign)[0]
    stated = measuring_chain.alignment(body, campaign.tolerances)
    return stated, [measuring_chain.body_record(body, campaign.runs, campaign.tolerances)]


@pytest.fixture(scope="module")
def stated():
    return chain_of(Rig(tolerances=GOOD_2))[0]


def one_parameter(stated, name, value):
    parameters = np.zeros(len(stated.names))
    parameters[stated.names.index(name)] = value
    return parameters


def test_forward_matrix_of_a_moved_and_a_turned_sensor(stated):
    small = 1e-6
    moved = list(ACCELEROMETERS)
    moved[2] = replace(moved[2], position=moved[2].position + np.array([0.0, small, 0.0]))
    name = "position of sensor A3 along y"
    forward = stated.forward(one_parameter(stated, name, small))
    assert forward == pytest.approx(sensor_geometry(moved).forward, abs=1e-11)

    turn = rotation_matrix(np.array([0.0, 0.0, small]))
    moved[2] = replace(ACCELEROMETERS[2], orientation=ACCELEROMETERS[2].orientation @ turn)
    forward = stated.forward(one_parameter(stated, "angle of sensor A3 about its z", small))
    assert forward == pytest.approx(sensor_geometry(moved).forward, abs=1e-11)


def test_gain_and_cross_axis_sensitivity_of_a_channel(stated):
    nominal = stated.body.forward
    name = "sensor gain of channel A1 x"
    assert stated.forward(one_parameter(stated, name, 0.01))[0] == pytest.approx(1.01 * nominal[0])
    for row, axis in ((1, "y"), (2, "z")):
        name = f"sensor cross-axis sensitivity of channel A1 x to {axis}"
        forward = stated.forward(one_parameter(stated, name, 0.01))[0]
        assert forward == pytest.approx(nominal[0] + 0.01 * nominal[row])


def test_a_tilted_shaker_changes_the_force_as_its_definition_says(stated):
    tilt, gain = 0.02, 0.01
    parameters = one_parameter(stated, "angle of the shaker at G along x towards y", tilt)
    parameters += one_parameter(stated, "force of the shaker at G along z", gain)
    pushes = np.eye(3)
    pushes[1, 0], pushes[2, 2] = tilt, 1 + gain
    expected = pushes @ stated.body.force_matrix[3:6]
    assert stated.force_matrix(parameters)[3:6] == pytest.approx(expected)
    assert stated.force_matrix(parameters)[:3] == pytest.approx(stated.body.force_matrix[:3])


def test_draws_have_the_stated_tolerances(stated):
    draws = measuring_chain.stated_alignment(stated).draw(4000, np.random.default_rng(2))
    assert draws.std(axis=0) == pytest.approx(stated.tolerance, rel=0.06, abs=1e-12)
    assert draws.mean(axis=0) == pytest.approx(0.0, abs=5e-4)


# ------------------------------------------------------------------ self-calibration


def test_newtons_law_ties_the_cells_to_the_sensors():
    """A cell that reads 2 % of its x force along y is found through the balance of forces."""
    chain, (record,) = chain_of(Rig(tolerances=GOOD_2))
    leaked = record.cell_force.copy()
    # what a shaker tilted by 0.02 while it pushed along x would have made of cell C1
    tilt = np.linalg.inv(np.eye(3) + 0.02 * np.outer([0, 1, 0], [1, 0, 0]))
    to_point = chain.body.points[0].force_matrix
    leaked[:, :3] = leaked[:, :3] @ to_point.T @ tilt.T @ np.linalg.inv(to_point).T
    name = "angle of the shaker at E along x towards y"
    place = chain.names.index(name)
    assert self_calibrated(chain, [replace(record, cell_force=leaked)]).mean[place] == 0.0
    calibrated = self_calibrated(chain, [replace(record, cell_force=leaked)], FREE)
    deviation = np.sqrt(calibrated.covariance[place, place])
    assert deviation < 0.8 * 0.01
    assert 0.006 < calibrated.mean[place] < 0.02
    assert abs(calibrated.mean[place] - 0.02) < 3 * deviation


@pytest.mark.parametrize("free_body", [None, FREE])
def test_errors_are_as_large_as_the_covariance_says(free_body):
    """Drawn gains and noise of the stated sizes: χ² of the errors is their number."""
    names = [channel for sensor in ACCELEROMETERS for channel in sensor.channels]
    squares = []
    for seed in range(1, 13):
        gains = 0.01 * np.random.default_rng(seed).standard_normal(len(names))
        wrong = dict(zip(names, 1 + gains, strict=True))
        chain, records = chain_of(Rig(NOISY, channel_gain=wrong, noise=0.02, seed=seed))
        calibrated = self_calibrated(chain, records, free_body)
        places = [chain.names.index(f"sensor gain of channel {name}") for name in names]
        error = calibrated.mean[places] - gains
        # and each sensor learnt from the others
        assert np.median(np.diag(calibrated.covariance)[places]) < 0.8 * 0.01**2
        squares.append(
            error @ np.linalg.solve(calibrated.covariance[np.ix_(places, places)], error)
        )
    assert 0.7 < np.mean(squares) / len(names) < 1.5


def test_exact_channels_stay_as_they_are():
    chain, records = chain_of(Rig(tolerances=GOOD_2))
    calibrated = self_calibrated(chain, records, FREE)
    assert np.all(np.abs(calibrated.mean) < 1e-6 + 1e-3 * chain.tolerance)
    assert dict(calibrated.misfit).keys() == {RIGID_MOTION, NEWTON}
    assert all(value < 1e-3 for _, value in calibrated.misfit)


def test_a_force_that_newton_does_not_know_loses_its_say():
    """A fourth path to ground must not be taken for a tilted shaker."""
    clean = self_calibrated(*chain_of(Rig(tolerances=GOOD_2)), FREE)
    calibrated = self_calibrated(*chain_of(Rig(tolerances=GOOD_2, extra_force=60.0)), FREE)
    assert dict(calibrated.misfit)[NEWTON] > 100
    assert dict(calibrated.misfit)[RIGID_MOTION] < 0.01
    tolerance = chain_of(Rig(tolerances=GOOD_2))[0].tolerance
    shakers = [k for k, source in enumerate(clean.alignment.sources) if "SHAKER" in source.name]
    assert np.all(np.abs(calibrated.mean[shakers]) < 3 * tolerance[shakers])
    # next to nothing was learnt
    gained = np.sqrt(np.diag(calibrated.covariance)[shakers]) / tolerance[shakers]
    learnt = np.sqrt(np.diag(clean.covariance)[shakers]) / tolerance[shakers]
    assert np.median(gained) > np.median(learnt)
    # unless it is named among the excitations
    told = replace(FREE, excited=("fz", "mx", "my"))
    calibrated = self_calibrated(*chain_of(Rig(tolerances=GOOD_2, extra_force=60.0)), told)
    assert dict(calibrated.misfit)[NEWTON] < 100


def test_impossible_channel_is_refused_by_name():
    chain, records = chain_of(Rig(tolerances=GOOD_2, channel_gain={"A2 x": 1.25}))
    with pytest.raises(
        InputError, match=r"powertrain contradict each other: .*A2 x.* times its tolerance"
    ):
        self_calibrated(chain, records, FREE)


def test_single_sensor_has_nothing_to_contradict_it():
    campaign = campaign_of(Rig(tolerances=GOOD_2))
    side = measuring_chain.instrumented_bodies(campaign)[1]
    stated = measuring_chain.alignment(side, GOOD_2)
    calibrated = self_calibrated(
        stated, [measuring_chain.body_record(side, campaign.runs, GOOD_2)], FREE
    )
    assert calibrated.mean.tolist() == [0.0] * len(stated.names)
    assert np.diag(calibrated.covariance) == pytest.approx(stated.tolerance**2)
    assert measuring_chain.ErrorSource.SENSOR_POSITION not in stated.sources
    assert measuring_chain.ErrorSource.CELL_GAIN in stated.sources


TWO_SIDED = 1.96


def characterised(draws=200, **tolerances):
    rig = Rig(tolerances=replace(EXACT, **tolerances))
    options = CharacteriseOptions(gears=None, self_calibration=False, draws=draws)
    return characterise(campaign_of(rig), "P1", options)


def budgets_of(draws=200, **tolerances):
    directions = characterised(draws, **tolerances).directions
    return {name: direction.budget for name, direction in directions.items()}


@pytest.fixture(scope="module")
def gains():
    return budgets_of(600, sensor_gain=0.01, cell_gain=0.02, shaker_gain=0.005)


def test_a_wishbone_mount_has_the_gains_of_two_sensors_and_two_cells(gains):
    # left and right are averaged; turned by 5°, the channels along x carry nearly everything
    expected = TWO_SIDED * np.sqrt((0.01**2 + 0.02**2) / 2)
    assert gains["W x"].half_width_95 == pytest.approx(expected, rel=0.06)
    assert set(gains["W x"].sources) == {
        measuring_chain.ErrorSource.SENSOR_GAIN,
        measuring_chain.ErrorSource.SENSOR_CROSS_AXIS,
        measuring_chain.ErrorSource.SENSOR_ANGLE,
        measuring_chain.ErrorSource.CELL_GAIN,
    }
    assert gains["W x"].sources[measuring_chain.ErrorSource.CELL_GAIN] == pytest.approx(
        TWO_SIDED * 0.02 / np.sqrt(2), rel=0.08
    )


def test_shaker_gain_alone_is_the_gain_of_the_force(gains):
    for axis in "xyz":
        alone = gains[f"E {axis}"].sources[measuring_chain.ErrorSource.SHAKER_GAIN]
        assert alone == pytest.approx(TWO_SIDED * 0.005, rel=0.08)


def test_all_together_are_each_alone_in_squares(gains):
    for gain in gains.values():
        squares = np.sqrt(sum(width**2 for width in gain.sources.values()))
        assert gain.half_width_95 == pytest.approx(squares, rel=0.2)


def test_nothing_unknown_leaves_the_misfit():
    for name, budget in budgets_of().items():
        # cubics in the wheel torque hold a stiffness that grows linearly with it
        assert budget.misfit < 1e-9, name
        assert budget.half_width_95 < 1e-8, name
        assert budget.identified


def test_shaker_angle_leaks_the_large_forces_into_the_small_ones():
    result = characterised(shaker_angle=0.01)
    for axis, others in (("x", "yz"), ("y", "xz"), ("z", "xy")):
        force = np.abs(result.directions[f"G {axis}"].measured.force)
        across = [np.abs(result.directions[f"G {a}"].measured.force) for a in others]
        # what enters in phase counts, hence at most the squares of both
        upper = TWO_SIDED * 0.01 * np.median(np.sqrt(sum(a**2 for a in across)) / force)
        half_width = result.directions[f"G {axis}"].budget.half_width_95
        assert 0.3 * upper < half_width < 1.3 * upper
    assert not result.directions["G y"].budget.identified
    assert result.directions["G y"].budget.half_width_95 > IDENTIFIED


def test_noise_of_single_lines_shrinks_in_the_surface():
    rig = Rig(tolerances=replace(EXACT, acceleration_own=0.02, force_own=0.02), noise=0.02)
    options = CharacteriseOptions(gears=None, self_calibration=False)
    budget = characterise(campaign_of(rig), "P1", options).directions["W x"].budget
    # magnitude of a quotient of two; 492 lines for 40 coefficients
    assert budget.half_width_95 < 0.6 * TWO_SIDED * 0.02
    assert max(budget.sources.values()) < 1e-12


def test_noise_beyond_what_is_stated_is_misfit():
    """Stated is 0.01 of force and of motion, hence of the magnitude of their quotient."""
    stated = {"acceleration_own": 0.01, "force_own": 0.01}
    rig = Rig(tolerances=replace(EXACT, **stated), noise=0.02)
    options = CharacteriseOptions(gears=None, self_calibration=False)
    direction = characterise(campaign_of(rig), "P1", options).directions["W x"]
    budget, measured = direction.budget, direction.measured.stiffness
    fitted = direction.surface.predict(budget.points)
    squares = np.mean((np.abs(measured / fitted) - 1) ** 2) - 0.01**2
    assert budget.misfit == pytest.approx(np.sqrt(squares), rel=0.05)
    of_imag = (measured - fitted).imag ** 2 - (0.01 * np.abs(fitted)) ** 2
    half_width = TWO_SIDED * np.sqrt(np.mean(of_imag / fitted.imag**2))
    assert budget.imag_half_width_95 == pytest.approx(half_width, rel=0.05)


def test_torque_noise_counts_through_the_slope():
    widths = [budgets_of(torque=torque)["S x"].half_width_95 for torque in (1.0, 4.0)]
    assert widths[1] == pytest.approx(4 * widths[0], rel=0.1)


def test_the_band_is_about_the_surface_at_its_points(gains):
    gain = gains["S x"]
    true = true_stiffness(gain.points[:, 0])[:, 6]
    assert gain.points.shape == (gain.lower.size, 3)
    assert np.all(gain.lower < 0)
    assert np.all(gain.upper > 0)
    assert np.median(gain.upper - gain.lower) / 2 == gain.half_width_95
    assert np.median(gain.imag_half_width) == gain.imag_half_width_95
    # gains turn no phase
    assert gain.imag_half_width == pytest.approx((gain.upper - gain.lower) / 2, rel=0.2)
    assert np.all(np.abs(true) > 0)


def test_static_force_as_preload():
    rig = Rig(tolerances=replace(EXACT, static_force=20.0))
    options = CharacteriseOptions(gears=None, preload=Preload.STATIC_FORCE, self_calibration=False)
    budget = characterise(campaign_of(rig), "P1", options).directions["S x"].budget
    # 9e-4 per N m of wheel torque, 7 N per N m: 20 N are 0.26 %, less by the fit to many lines
    assert 1e-5 < budget.half_width_95 < 2.6e-3


def test_a_seed_of_zero_is_refused():
    with pytest.raises(InputError, match="seed 0 is refused"):
        error_budget([], [], {}, Preload.WHEEL_TORQUE, 0.0, seed=0)
