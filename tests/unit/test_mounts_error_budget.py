"""Stated tolerances become the uncertainty of the stiffness, against closed forms."""

import numpy as np
import pytest
from mounts_campaign_samples import EXACT, Rig, campaign_of, true_stiffness

from deboom.errors import InputError
from deboom.measurement.sensors import Tolerances
from deboom.mounts.characterise import CharacteriseOptions, characterise
from deboom.mounts.error_budget import IDENTIFIED, error_budget
from deboom.mounts.measuring_chain import ErrorSource
from deboom.mounts.operating_map import Preload

TWO_SIDED = 1.96


def characterised(draws=200, **tolerances):
    rig = Rig(tolerances=Tolerances(**{**EXACT.__dict__, **tolerances}))
    options = CharacteriseOptions(gears=None, self_calibration=False, draws=draws)
    return characterise(campaign_of(rig), "P1", options)


def budgets_of(draws=200, **tolerances):
    directions = characterised(draws, **tolerances).directions
    return {name: one.budget for name, one in directions.items()}


@pytest.fixture(scope="module")
def gains():
    return budgets_of(600, sensor_gain=0.01, cell_gain=0.02, shaker_gain=0.005)


def test_a_wishbone_mount_has_the_gains_of_two_sensors_and_two_cells(gains):
    # left and right are averaged; turned by 5°, the channels along x carry nearly everything
    expected = TWO_SIDED * np.sqrt((0.01**2 + 0.02**2) / 2)
    assert gains["W x"].half_width_95 == pytest.approx(expected, rel=0.06)
    assert set(gains["W x"].sources) == {
        ErrorSource.SENSOR_GAIN,
        ErrorSource.SENSOR_CROSS_AXIS,
        ErrorSource.SENSOR_ANGLE,
        ErrorSource.CELL_GAIN,
    }
    assert gains["W x"].sources[ErrorSource.CELL_GAIN] == pytest.approx(
        TWO_SIDED * 0.02 / np.sqrt(2), rel=0.08
    )


def test_shaker_gain_alone_is_the_gain_of_the_force(gains):
    for axis in "xyz":
        alone = gains[f"E {axis}"].sources[ErrorSource.SHAKER_GAIN]
        assert alone == pytest.approx(TWO_SIDED * 0.005, rel=0.08)


def test_all_together_are_each_alone_in_squares(gains):
    for one in gains.values():
        squares = np.sqrt(sum(width**2 for width in one.sources.values()))
        assert one.half_width_95 == pytest.approx(squares, rel=0.2)


def test_nothing_unknown_leaves_the_misfit():
    for name, one in budgets_of().items():
        # cubics in the wheel torque hold a stiffness that grows linearly with it
        assert one.misfit < 1e-9, name
        assert one.half_width_95 < 1e-8, name
        assert one.identified


def test_shaker_angle_leaks_the_large_forces_into_the_small_ones():
    result = characterised(shaker_angle=0.01)
    for axis, others in (("x", "yz"), ("y", "xz"), ("z", "xy")):
        own = np.abs(result.directions[f"G {axis}"].measured.force)
        across = [np.abs(result.directions[f"G {a}"].measured.force) for a in others]
        # what enters in phase counts, hence at most the squares of both
        upper = TWO_SIDED * 0.01 * np.median(np.sqrt(sum(a**2 for a in across)) / own)
        found = result.directions[f"G {axis}"].budget.half_width_95
        assert 0.3 * upper < found < 1.3 * upper
    assert not result.directions["G y"].budget.identified
    assert result.directions["G y"].budget.half_width_95 > IDENTIFIED


def test_noise_of_single_lines_shrinks_in_the_surface():
    rig = Rig(
        tolerances=Tolerances(**{**EXACT.__dict__, "acceleration_own": 0.02, "force_own": 0.02}),
        noise=0.02,
    )
    options = CharacteriseOptions(gears=None, self_calibration=False)
    one = characterise(campaign_of(rig), "P1", options).directions["W x"].budget
    # magnitude of a quotient of two; 492 lines for 40 coefficients
    assert one.half_width_95 < 0.6 * TWO_SIDED * 0.02
    assert max(one.sources.values()) < 1e-12


def test_torque_noise_counts_through_the_slope():
    widths = [budgets_of(torque=torque)["S x"].half_width_95 for torque in (1.0, 4.0)]
    assert widths[1] == pytest.approx(4 * widths[0], rel=0.1)


def test_the_band_is_about_the_surface_at_its_points(gains):
    one = gains["S x"]
    true = true_stiffness(one.points[:, 0])[:, 6]
    assert one.points.shape == (one.lower.size, 3)
    assert np.all(one.lower < 0)
    assert np.all(one.upper > 0)
    assert np.median(one.upper - one.lower) / 2 == one.half_width_95
    assert np.median(one.imag_half_width) == one.imag_half_width_95
    # gains turn no phase
    assert one.imag_half_width == pytest.approx((one.upper - one.lower) / 2, rel=0.2)
    assert np.all(np.abs(true) > 0)


def test_static_force_as_preload():
    rig = Rig(tolerances=Tolerances(**{**EXACT.__dict__, "static_force": 20.0}))
    options = CharacteriseOptions(gears=None, preload=Preload.STATIC_FORCE, self_calibration=False)
    budget = characterise(campaign_of(rig), "P1", options).directions["S x"].budget
    # 9e-4 per N m of wheel torque, 7 N per N m: 20 N are 0.26 %, less by the fit to many lines
    assert 1e-5 < budget.half_width_95 < 2.6e-3


def test_a_seed_of_zero_is_refused():
    with pytest.raises(InputError, match="seed 0 is refused"):
        error_budget([], [], {}, Preload.WHEEL_TORQUE, 0.0, seed=0)
