"""A virtual design's motion against the root of its scalar equation, direction by direction."""

import numpy as np
import pytest
from scipy.optimize import brentq

from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.vehicles.amplitude_motion import resolve_design
from deboom.vehicles.coupled_motion import Body, CoupledMotion

FREQUENCY = np.array([20.0, 25.0, 30.0, 40.0])
TORQUE = np.full(FREQUENCY.size, 1500.0)
MASS = 0.5
NAMES = ("A x", "A y", "A z", "B x", "B y", "B z", "C x")
SOFTENING = 300.0
"""Relative loss of stiffness per metre of amplitude."""


def stiffness(amplitude):
    return (2e5 + 2e4j) * (1 - SOFTENING * amplitude)


@pytest.fixture(scope="module")
def surface():
    """Fit a stiffness that falls with the amplitude; a cubic holds it exactly."""
    torque, amplitude, frequency = (
        grid.ravel()
        for grid in np.meshgrid(
            np.linspace(500, 2500, 5), np.linspace(1e-5, 1e-3, 61), np.linspace(15, 45, 7)
        )
    )
    lines = np.column_stack([torque, amplitude, frequency])
    return DynamicStiffnessSurface(preload_unit="N m").fit(lines, stiffness(amplitude))


def reference():
    """Six directions that do not feel each other, and a body of its own, with other mounts."""
    n_line = FREQUENCY.size
    other = np.full((n_line, 6), 1.6e5 + 3e4j)
    powertrain = Body(
        forward=np.eye(6),
        mass_matrix=MASS * np.eye(6),
        stiffness=other,
        load=np.outer(np.linspace(30, 60, n_line), np.linspace(0.6, 1.2, 6)),
        variables=np.arange(6),
        transfer=np.full((1, n_line, 6), 1e-3),
    )
    wheel_end = Body(
        forward=np.ones((1, 1)),
        mass_matrix=np.full((1, 1), MASS),
        stiffness=other[:, :1],
        load=np.full((n_line, 1), 40.0),
        variables=np.array([6]),
        transfer=np.full((1, n_line, 1), 2e-3),
    )
    return CoupledMotion("run", FREQUENCY, (powertrain, wheel_end), ("V",), NAMES)


def root(load, omega_squared):
    """Amplitude at which the stiffness of that amplitude gives it."""

    def difference(amplitude):
        return abs(load / (stiffness(amplitude) - omega_squared * MASS)) - amplitude

    return brentq(difference, 1e-6, 9e-4, xtol=1e-16)


def test_every_amplitude_is_the_root_of_its_equation(surface):
    coupled = reference()
    resolved = resolve_design(coupled, dict.fromkeys(NAMES, surface), TORQUE)
    omega_squared = (2 * np.pi * FREQUENCY) ** 2
    loads = np.hstack([body.load for body in coupled.bodies]).real
    expected = [
        [root(load, squared) for load in row]
        for row, squared in zip(loads, omega_squared, strict=True)
    ]
    assert resolved.motion.nominal_amplitude == pytest.approx(np.array(expected), rel=1e-5)
    assert not resolved.outside.any()
    assert resolved.kept == ()
    forces = stiffness(np.array(expected)) * (
        loads / (stiffness(np.array(expected)) - omega_squared[:, np.newaxis] * MASS)
    )
    pressure = forces @ np.array([1e-3] * 6 + [2e-3])
    assert resolved.pressure[0] == pytest.approx(pressure, rel=1e-5)


def test_directions_without_surface_keep_what_was_measured(surface):
    coupled = reference()
    resolved = resolve_design(coupled, {"A x": surface}, TORQUE)
    assert resolved.kept == NAMES[1:]
    assert np.array_equal(resolved.motion.stiffness[:, 1:], coupled.stiffness[:, 1:])
    assert not np.array_equal(resolved.motion.stiffness[:, 0], coupled.stiffness[:, 0])


def test_lines_that_no_surface_speaks_of_are_counted_and_keep_their_stiffness(surface):
    coupled = reference()
    resolved = resolve_design(coupled, {"A x": surface}, TORQUE + 1e5)
    assert resolved.outside[:, 0].all()
    assert not resolved.outside[:, 1:].any()
    assert np.array_equal(resolved.motion.stiffness, coupled.stiffness)
