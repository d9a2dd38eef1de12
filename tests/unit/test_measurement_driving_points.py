"""What functions at driving points say of their sign, convention and quantity, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.measurement.driving_points import (
    DrivingPoints,
    fault_of_driving_points,
    fault_of_hammer_test,
)
from deboom.measurement.impact_test import FrfEstimate, HammerMeasurement, HammerTest
from deboom.measurement.sensors import Impact, Sensor, SensorKind
from deboom.physics.frf import FrfForm

LINES = np.arange(5.0, 150.0, 0.5)
OMEGA = 2 * np.pi * LINES[:, None]
JW = 1j * OMEGA


def inertance(frequencies, masses, damping, ground=0.0):
    """Sum of modes at one point, and the stiffness of those above; masses in kg."""
    natural = 2 * np.pi * np.array(frequencies)
    modes = -(OMEGA**2) / (natural**2 - OMEGA**2 + 2j * damping * natural * OMEGA)
    return (modes / np.array(masses)).sum(axis=1, keepdims=True) - ground * OMEGA**2


BODIES = {
    "on mounts": inertance([12.0, 25.0], [7.0, 20.0], 0.05),
    "car body": inertance([28.0, 41.0, 66.0, 97.0], [900.0, 600.0, 500.0, 400.0], 0.04, 1e-7),
    "heavily damped": inertance([20.0, 45.0, 80.0], [30.0, 20.0, 20.0], 0.2, 1e-6),
    "stiff place": inertance([300.0], [100.0], 0.02),
    "free": inertance([1e-3, 400.0], [5.0, 8.0], 0.01),
    "light plate": inertance([30.0, 55.0, 90.0], [0.02, 0.02, 0.02], 0.01),
}
STATEMENTS = {
    "conjugated": lambda a: a.conj(),
    "reversed": lambda a: -a,
    "mobility (": lambda a: a / JW,
    "receptance (": lambda a: a / JW**2,
    "apparent mass (": lambda a: 1 / a,
    "impedance (": lambda a: JW / a,
    "dynamic stiffness (": lambda a: JW**2 / a,
}


def fault(values, stated=FrfForm.INERTANCE):
    return fault_of_driving_points(DrivingPoints(LINES, values, ("A1 z at I1",)), stated)


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_true_inertance_is_accused_of_nothing(body, noise):
    generator = np.random.default_rng(1)
    spread = generator.normal(size=(2, *OMEGA.shape))
    values = BODIES[body] * (1 + noise * (spread[0] + 1j * spread[1]))
    assert fault(values) == ""
    assert fault(values / JW, FrfForm.MOBILITY) == ""
    assert fault(values / JW**2, FrfForm.RECEPTANCE) == ""


@pytest.mark.parametrize("likely", STATEMENTS)
@pytest.mark.parametrize("body", ["on mounts", "car body"])
def test_a_wrong_statement_is_named_with_what_the_function_likely_is(body, likely):
    sentence = fault(STATEMENTS[likely](BODIES[body]))
    assert f"They are {likely}" in sentence or f"They are likely {likely}" in sentence


def test_a_displacement_stated_as_velocity_is_named():
    assert "likely receptance" in fault(BODIES["on mounts"] / JW**2, FrfForm.MOBILITY)


def test_noise_alone_says_nothing():
    generator = np.random.default_rng(2)
    for _ in range(20):
        real, imaginary = generator.normal(size=(2, *OMEGA.shape))
        assert fault(real + 1j * imaginary) == ""
    assert fault(np.zeros_like(JW)) == ""
    assert fault_of_driving_points(DrivingPoints(LINES[:3], BODIES["free"][:3], ("x",))) == ""


def hammer(impact_at, direction, unit="m/s^2"):
    """One triaxial sensor at the origin and one blow."""
    sensor = Sensor("A1", SensorKind.ACCELEROMETER, "", "", "", np.zeros(3), np.eye(3))
    force = np.zeros((2, 8))
    force[:, 2] = 1.0
    measured = HammerMeasurement(
        "I1", force, np.zeros((2, 8, 3)), sensor.channels, (unit,) * 3, (np.inf,) * 3, 256.0
    )
    impact = Impact("I1", np.array(impact_at), np.array(direction))
    return HammerTest("plate", (impact,), (sensor,), (measured,))


def estimated(values, unit="m/s^2"):
    """Functions of the three channels, of which z is the driving point."""
    columns = np.stack([np.ones_like(values), np.ones_like(values), values], axis=1)
    unknown = np.full(columns.shape, np.nan)
    channels, units = ("A1 x", "A1 y", "A1 z"), (unit,) * 3
    return FrfEstimate(LINES, columns, channels, ("I1",), units, unknown, unknown, (2,), 0.0, ())


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_blow_beside_a_channel_is_a_driving_point(sign):
    test = hammer([0.0, 0.0, 0.01], [0.0, 0.0, sign])
    right = sign * BODIES["on mounts"]
    assert fault_of_hammer_test(test, estimated(right)) == ""
    sentence = fault_of_hammer_test(test, estimated(-right))
    assert sentence.startswith("the functions are no inertance (acceleration over force): at the ")
    assert "(A1 z at I1)" in sentence
    assert "They are reversed" in sentence
    velocity = estimated(right / JW**2, "m/s")
    assert "likely receptance" in fault_of_hammer_test(test, velocity)


def test_blows_elsewhere_or_across_are_no_driving_point():
    wrong = estimated(-BODIES["on mounts"])
    assert fault_of_hammer_test(hammer([0.0, 0.0, 0.05], [0.0, 0.0, 1.0]), wrong) == ""
    across = hammer([0.0, 0.0, 0.01], [np.sqrt(0.5), 0.0, np.sqrt(0.5)])
    assert fault_of_hammer_test(across, wrong) == ""
    assert fault_of_hammer_test(replace(across, sensors=()), wrong) == ""
