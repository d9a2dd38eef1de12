"""Reciprocity p/F = -a/Qdot in closed form: a piston on a cavity, a piston on a tube of waves."""

from dataclasses import replace

import numpy as np
import pytest

from deboom.bench.body import noise_transfer
from deboom.bench.ears import ear_transfer, panel_pressure, source_motion
from deboom.bench.fleet import load_fleet
from deboom.bench.interfaces import interface_shapes
from deboom.measurement.channels import Frf
from deboom.measurement.noise_transfer import (
    ACCELERATION_PER_VOLUME_ACCELERATION,
    reciprocal_noise_transfer,
)

FREQUENCY = np.linspace(20.0, 80.0, 61)
OMEGA = 2 * np.pi * FREQUENCY


def as_reciprocal(ratio):
    """One channel, one ear."""
    return Frf(
        FREQUENCY, ratio[:, None, None], ("B1 x",), ("ear",), ACCELERATION_PER_VOLUME_ACCELERATION
    )


def test_sign_on_a_piston_that_the_air_pushes_back():
    # p = kappa (A u + q)/V;  m u'' + c u' + k u = F - A p: force and displacement inwards positive
    mass, damping, spring, area, air = 12.0, 40.0, 9e5, 0.4, 1.42e5 / 3.0
    blocked = spring - OMEGA**2 * mass + 1j * OMEGA * damping
    pressure_per_force = air * area / (blocked + air * area**2)
    displacement_per_volume = -area * air / (blocked + air * area**2)

    # accelerations per volume acceleration: both times -omega^2
    found = reciprocal_noise_transfer(as_reciprocal(displacement_per_volume))

    assert found.unit == "Pa/N"
    assert found.outputs == ("ear",)
    assert found.inputs == ("B1 x",)
    error = np.abs(found.values[:, 0, 0] - pressure_per_force) / np.abs(pressure_per_force)
    assert error.max() < 1e-12
    # the sign that is easily forgotten would give twice the size as error
    assert np.abs(found.values[:, 0, 0] + pressure_per_force).min() > 0


def test_sign_in_a_tube_of_standing_waves():
    # piston of mass m at 0, rigid end at L, ear at x; impedance of air and its own inertia together
    density, speed, area, mass, length, ear = 1.2, 343.0, 0.3, 2.0, 2.6, 1.1
    wave = OMEGA / speed * (1 - 0.02j)
    impedance = density * OMEGA / wave
    tube = -1j * impedance / np.tan(wave * length)  # p(0) per velocity of the piston
    at_ear = -1j * impedance * np.cos(wave * (length - ear)) / np.sin(wave * length)
    velocity_per_force = 1 / (1j * OMEGA * mass + area * tube)
    pressure_per_force = at_ear * velocity_per_force

    # a source Q at the ear: p = a e^-jkx + b e^jkx before it, c cos k(L-x) behind it, and the free
    # piston moves with v; velocity of the air u = -p'/(jw rho)
    ratio = []
    for k, z, w in zip(wave, impedance, OMEGA, strict=True):
        forth, back = np.exp(-1j * k * ear), np.exp(1j * k * ear)
        behind = k * (length - ear)
        matrix = np.array(
            [
                [forth, back, -np.cos(behind), 0],  # one pressure
                [-forth / z, back / z, 1j * np.sin(behind) / z, 0],  # velocity jumps by Q/S
                [1 / z, -1 / z, 0, -1],  # the air follows the piston
                [area, area, 0, 1j * w * mass],  # and pushes it out
            ]
        )
        ratio.append(np.linalg.solve(matrix, np.array([0, 1 / area, 0, 0], dtype=complex))[3])
    found = reciprocal_noise_transfer(as_reciprocal(np.array(ratio)))

    error = np.abs(found.values[:, 0, 0] - pressure_per_force) / np.abs(pressure_per_force)
    assert error.max() < 1e-10


@pytest.mark.parametrize("vehicle", ["U06-1", "U06-5", "F45-3"])
def test_the_bench_answers_the_loudspeaker_as_reciprocity_demands(vehicle):
    fleet = load_fleet(1)
    body = fleet.bodies[vehicle]
    direct = ear_transfer(body, fleet.cabin, FREQUENCY)
    breathing = source_motion(body, fleet.cabin, FREQUENCY).transpose(0, 3, 1, 2)
    assert np.abs(direct + breathing).max() < 1e-12 * np.abs(direct).max()


def test_the_drivers_old_noise_transfer_functions_are_untouched():
    fleet = load_fleet(1)
    for body in fleet.bodies.values():
        frozen = noise_transfer(body, fleet.cabin, FREQUENCY)
        driver = ear_transfer(body, fleet.cabin, FREQUENCY)[:, 0]
        mounts = driver[:, :3, :3].reshape(FREQUENCY.size, -1)
        wishbone = driver[:, 3:, 0].mean(axis=1, keepdims=True)
        error = np.abs(np.hstack([mounts, wishbone]) - frozen)
        assert error.max() < 1e-14 * np.abs(frozen).max()


def test_the_passenger_hears_another_cabin_than_the_driver_but_not_a_strange_one():
    fleet = load_fleet(1)
    ears = panel_pressure(fleet.cabin, FREQUENCY)
    np.testing.assert_array_equal(ears[:, 0], fleet.cabin.pressure(FREQUENCY))
    body = fleet.bodies["U06-1"]
    levels = 20 * np.log10(np.abs(ear_transfer(body, fleet.cabin, FREQUENCY)[:, :, :3, :3]))
    difference = np.abs(levels[:, 1] - levels[:, 0])
    assert 0.1 < np.median(difference) < 3.0


def test_rotations_follow_the_body_linearly():
    """Half the shapes, half the rotations: nothing is drawn per vehicle."""
    body = load_fleet(1).bodies["U06-2"]
    half = replace(body, shapes_at_paths=0.5 * body.shapes_at_paths)
    np.testing.assert_allclose(interface_shapes(half), 0.5 * interface_shapes(body), rtol=1e-13)
