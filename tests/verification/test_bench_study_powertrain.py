"""The bench against the printed figures of its feasibility study (parameters, sections 1, 2, 4)."""

import numpy as np
import pytest

from deboom.bench.operating_run import TORQUE_AXIS, full_load_run, operate
from deboom.bench.parameters import load_bench
from deboom.bench.suspended_body import operating_stiffness, static_deflection
from deboom.physics.rigid_body import forward_matrix, rigid_body_modes

BENCH = load_bench()
FREQUENCY = np.linspace(20.0, 80.0, 241)
COLUMN = {name: 3 * k for k, name in enumerate(BENCH.mount_names)}
AT = [0, 40, 80, 160, 240]  # 20, 30, 40, 60, 80 Hz


@pytest.fixture(scope="module")
def fifth_gear():
    return full_load_run(BENCH, 5, 220.0, FREQUENCY)


@pytest.mark.parametrize(
    ("wheel_torque", "printed"),
    [
        (0.0, [6.5, 7.3, 9.5, 11.2, 15.8, 18.5]),  # idle
        (748.0, [9.1, 11.3, 13.9, 18.5, 21.1, 23.7]),  # 5th gear, 220 Nm
    ],
)
def test_rigid_body_modes(wheel_torque, printed):
    # storage stiffness at 0.1 mm and 20 Hz, at the static equilibrium
    deflection = static_deflection(BENCH.powertrain, wheel_torque * TORQUE_AXIS[None])
    amplitude, line = np.full((1, 9), 1e-4), np.array([20.0])
    stiffness = operating_stiffness(BENCH.powertrain, deflection, amplitude, line)[0].real
    forward = BENCH.powertrain.forward
    matrix = forward.T @ (stiffness[:, None] * forward)
    frequencies, _ = rigid_body_modes(BENCH.powertrain.mass_matrix, matrix)
    assert frequencies == pytest.approx(printed, abs=0.051)


def test_torque_roll_axis_is_3_2_degrees_off_y():
    axis = np.linalg.solve(BENCH.inertia, [0.0, 1.0, 0.0])
    angle = np.rad2deg(np.arccos(axis[1] / np.linalg.norm(axis)))
    assert angle == pytest.approx(3.2, abs=0.05)


def test_strut_stiffness_over_all_gears():
    strut = COLUMN["TSM"]
    stiffness = np.abs(
        [
            full_load_run(BENCH, gear, 220.0, FREQUENCY).powertrain.stiffness[:, strut]
            for gear in range(1, 8)
        ]
    )
    assert stiffness.min() == pytest.approx(103e3, rel=0.01)
    assert stiffness.max() == pytest.approx(2148e3, rel=0.001)


def test_strut_curve_has_seven_inflections_over_its_preload():
    law = BENCH.powertrain.laws[COLUMN["TSM"]]
    full = full_load_run(BENCH, 1, 220.0, FREQUENCY).powertrain.static_deflection
    deflection = np.linspace(0.0, full[:, COLUMN["TSM"]].min(), 20001)
    preload, tangent = law.static_force(deflection), law.tangent_stiffness(deflection)
    curvature = np.gradient(np.gradient(tangent, preload), preload)[5:-5]
    assert np.sum(np.diff(np.sign(curvature)) != 0) == 7


def test_loss_factors_over_gears_5_to_7():
    slices = (20.0, 60.0, 100.0, 140.0, 180.0, 220.0)
    states = []
    for gear in (5, 6, 7):
        states += [full_load_run(BENCH, gear, limit, FREQUENCY) for limit in (120.0, 160.0, 220.0)]
        states += [operate(BENCH, gear, np.full(241, torque), FREQUENCY) for torque in slices]
    stiffness = np.array([state.powertrain.stiffness for state in states])
    loss = stiffness.imag / stiffness.real
    assert loss.min() == pytest.approx(0.085, abs=0.001)
    assert loss.max() == pytest.approx(0.313, abs=0.001)


# The play of the hysteresis is a play operator here and a shift there, which jumps where the
# deflection leaves the play; they differ below 0.25 mm, at the first lines of the ramp.
@pytest.mark.parametrize(
    ("mount", "micrometres", "newtons"),
    [
        ("TSM", [163, 647, 355, 144, 78], [17, 322, 203, 91, 53]),
        ("EnM", [144, 547, 296, 119, 64], [23, 161, 100, 45, 26]),
        ("GeM", [144, 377, 210, 87, 47], [40, 175, 111, 51, 29]),
    ],
)
def test_displacement_and_force_in_5th_gear(fifth_gear, mount, micrometres, newtons):
    column = COLUMN[mount]
    displacement = 1e6 * np.abs(fifth_gear.displacement[AT, column])
    force = np.abs(fifth_gear.force[AT, column])
    assert displacement[1:] == pytest.approx(micrometres[1:], abs=0.51)
    assert force[1:] == pytest.approx(newtons[1:], abs=0.51)
    assert displacement[0] == pytest.approx(micrometres[0], rel=0.01)
    assert force[0] == pytest.approx(newtons[0], rel=0.02)


def test_wishbone_force_of_both_sides_in_5th_gear(fifth_gear):
    both = np.abs(fifth_gear.path_force[[40, 80, 160], 9])
    assert both == pytest.approx([352, 108, 20], abs=0.51)


def test_motion_along_y_is_nearly_nothing_at_the_upper_mounts(fifth_gear):
    motion = np.abs(fifth_gear.powertrain.displacement)
    for mount, percent in (("EnM", 1.0), ("GeM", 2.4), ("TSM", 5.5)):
        ratio = motion[:, COLUMN[mount] + 1] / motion[:, COLUMN[mount]]
        assert 100 * np.median(ratio) == pytest.approx(percent, abs=0.051)
    lowest = motion[:, COLUMN["EnM"] + 1]
    assert lowest.min() == pytest.approx(0.7e-6, abs=0.05e-6)
    assert FREQUENCY[lowest.argmin()] == pytest.approx(45, abs=0.5)


def test_a_sensor_60_mm_away_does_not_feel_the_virtual_point(fifth_gear):
    line = 80  # 1600 rpm
    acceleration = (2 * np.pi * FREQUENCY[line]) ** 2 * fifth_gear.powertrain.motion[line]
    assert np.abs(fifth_gear.powertrain.displacement[line, [0, 3, 6]]) * (
        2 * np.pi * FREQUENCY[line]
    ) ** 2 == pytest.approx(20, abs=7)
    differences = [
        np.linalg.norm(
            (forward_matrix(position + offset) - forward_matrix(position)) @ acceleration
        )
        for position in BENCH.positions
        for offset in 0.06 * np.eye(3)
    ]
    assert 1.0 < max(differences) < 5.0
