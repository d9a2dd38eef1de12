"""Scaled parts at their own static position: closed forms and direct solutions."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.response_surface import operating_points
from deboom.mounts.surface_forces import identified_surfaces
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.design_factor import StaticPosition, part_ratio
from deboom.vehicles.powertrain import KinematicModel, library_model
from samples import resolved_truth as truth

PLATFORM = read_platform(truth.PLATFORM)
PARTS = truth.platform_parts(PLATFORM)
MODEL = library_model([part for part in PARTS if part.mount.name != "Du"])
CASE = PLATFORM.load_case("g6_wot160")
MOTION = coupled_motion(
    PLATFORM.fleet.group("U06"), PLATFORM.mounts, PLATFORM.powertrain, CASE, (20.0, 60.0)
)
TORQUE = CASE.wheel_torque[:161]
DESIGNS = np.random.default_rng(4).uniform(0.7, 1.3, (6, 12))


@pytest.fixture(scope="module")
def ratio():
    return part_ratio(MODEL, MOTION, identified_surfaces(PARTS), CASE)


def test_today_s_parts_ride_where_they_ride(ratio):
    np.testing.assert_allclose(ratio(np.ones((1, 12))), 1.0, rtol=1e-14)
    assert not ratio.clipped(np.ones((1, 12))).any()


def stiffness(surface, torque, column):
    points = operating_points(torque, MOTION.nominal_amplitude[:, column], MOTION.frequency)
    return surface.predict(points, extrapolate=True)


@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_all_parts_alike_ride_as_today_s_under_torque_over_factor(ratio, factor):
    """``x F(u) = T`` has the solution ``u(T/x)``: the surface speaks at that torque."""
    designs = np.full((1, 12), factor)
    deflection = ratio.position.deflection(designs[:, :9])
    expected = MODEL.equilibrium(TORQUE / factor)
    np.testing.assert_allclose(deflection[0], expected, atol=2e-6)
    surface = identified_surfaces(PARTS)["TSM x"]
    column = 6
    assert [MOTION.variable_names[k] for k in MOTION.variables][column] == "TSM x"
    under_torque, here = (
        stiffness(surface, torque, column) for torque in (TORQUE / factor, TORQUE)
    )
    inside = ~ratio.clipped(designs)[0, :, column]
    assert inside.mean() > 0.5
    ratios = ratio(designs)[0, inside, column]
    np.testing.assert_allclose(ratios, (under_torque / here)[inside], rtol=3e-3)
    surface = identified_surfaces(PARTS)["Du x"]
    of_end, base = (stiffness(surface, torque, 9) for torque in (TORQUE / factor, TORQUE))
    inside = ~ratio.clipped(designs)[0, :, 9]
    np.testing.assert_allclose(ratio(designs)[0, inside, 9], (of_end / base)[inside], rtol=1e-3)


def test_linear_curves_without_surfaces_leave_the_stiffness_alone():
    """A straight curve has one slope, wherever the mount rides."""
    reach = np.linspace(-0.05, 0.05, 11)
    curves = {
        name: StaticCurve(*name.split(), "M0", reach, 2e5 * reach, 0.03) for name in MODEL.curves
    }
    straight = part_ratio(KinematicModel(MODEL.mounts, curves), MOTION, {}, CASE)
    np.testing.assert_allclose(straight(DESIGNS)[..., :9], 1.0, rtol=1e-9)


def test_softer_struts_ride_deeper_into_their_stop(ratio):
    """The strut carries its share of the torque whatever its stiffness: hardly softer there."""
    design = np.ones((1, 12))
    design[0, 6] = 0.8
    left = 0.8 * np.abs(ratio(design)[0, :, 6])
    assert 0.90 < left[TORQUE > 200.0].mean() < 1.02


def test_interpolation_over_the_torque_is_checked(ratio):
    direct = MODEL.deflections(TORQUE, DESIGNS[:, :9])
    deflection = ratio.position.deflection(DESIGNS[:, :9])
    slope = MODEL.slope
    assert np.abs(slope(deflection) / slope(direct) - 1).max() < 1e-3
    assert ratio.position.rises.all()


def test_a_design_gets_the_same_bits_in_any_company(ratio):
    whole = ratio(DESIGNS)
    np.testing.assert_array_equal(ratio(DESIGNS[2:3]), whole[2:3])
    np.testing.assert_array_equal(ratio(DESIGNS[::-1]), whole[::-1])


def test_one_torque_at_all_lines_needs_no_interpolation():
    torque = np.full(5, 300.0)
    position = StaticPosition.of(MODEL, torque, 300.0)
    deflection = position.deflection(DESIGNS[:, :9])
    np.testing.assert_allclose(deflection, MODEL.deflections(torque, DESIGNS[:, :9]), atol=1e-12)


def test_refuses_another_powertrain_and_a_run_beyond_the_measurements():
    fewer = KinematicModel(MODEL.mounts[::-1], MODEL.curves)
    with pytest.raises(InputError, match="take the same mounts in the same order"):
        part_ratio(fewer, MOTION, {}, CASE)
    position = StaticPosition.of(MODEL, TORQUE, 500.0)
    with pytest.raises(InputError, match=r"deflects by .* mm"):
        position.deflection(np.full((1, 9), 0.02))
