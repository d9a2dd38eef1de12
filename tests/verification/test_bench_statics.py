"""Statics of the bench against quadrature and against solvers that share no code with it."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize, root

from deboom.bench.parameters import load_bench
from deboom.bench.suspended_body import static_deflection, static_forces

BENCH = load_bench()
POWERTRAIN = BENCH.powertrain
GEARS = np.array([-300.0, 495.0, 748.0, 1364.0, 3564.0])  # wheel torque [N m]


def logistic(x):
    return 1 / (1 + np.exp(-x))


@pytest.mark.parametrize("index", range(9))
@pytest.mark.parametrize("deflection", [-9e-3, -2e-3, 1e-3, 6e-3])
def test_static_force_is_the_integral_of_the_printed_tangent(index, deflection):
    law = POWERTRAIN.laws[index]

    def tangent(u):
        return law.stiffness + sum(
            stage.stiffness * logistic((np.sign(stage.onset) * u - abs(stage.onset)) / stage.width)
            for stage in law.stages
        )

    onsets = sorted({s.onset for s in law.stages if 0 < s.onset / deflection < 1})
    force, _ = quad(tangent, 0.0, deflection, points=onsets or None, epsabs=1e-9, epsrel=1e-12)
    assert law.static_force(np.array([deflection])) == pytest.approx(force, rel=1e-9)


def pitch(torque):
    load = np.zeros((len(torque), 6))
    load[:, 4] = torque
    return load


def test_equilibrium_against_a_trust_region_solver():
    found = static_deflection(POWERTRAIN, pitch(GEARS))
    forward = POWERTRAIN.forward
    for line, load in enumerate(pitch(GEARS)):

        def unbalance(position, load=load):
            forces = static_forces(POWERTRAIN, (forward @ position)[None])[0]
            return forward.T @ forces - load

        # from the linear answer, in small steps of load
        position = np.zeros(6)
        for part in np.linspace(0.05, 1.0, 20):
            solution = root(
                lambda q, part=part, load=load: unbalance(q, part * load), position, tol=1e-12
            )
            position = solution.x
        assert solution.success
        assert forward @ position == pytest.approx(found[line], abs=1e-9)


def test_equilibrium_is_the_least_energy():
    load = pitch(np.array([748.0]))
    forward = POWERTRAIN.forward
    grid, weight = np.polynomial.legendre.leggauss(64)

    def energy(scaled):
        position = scaled * 1e-3
        deflection = forward @ position
        # work along the straight way from rest, one Gauss rule per direction
        along = static_forces(POWERTRAIN, np.outer((grid + 1) / 2, deflection))
        return float(weight / 2 @ along @ deflection - load[0] @ position)

    least = minimize(energy, np.zeros(6), method="BFGS", options={"gtol": 1e-9})
    found = static_deflection(POWERTRAIN, load)[0]
    # an energy is flat at its minimum: half of the digits
    assert forward @ (least.x * 1e-3) == pytest.approx(found, abs=2e-6)


def test_traction_preload_of_the_wishbone_mount():
    torque, wheel_radius = 220.0 * 3.40, 0.312
    load = BENCH.driveline.preload(np.array([torque]))
    # both wheels share the torque, half of a wheel's force goes through the rear mount
    assert load == pytest.approx(torque / 2 / wheel_radius / 2)
    found = static_deflection(BENCH.wheel_end, load[:, None])[0, 0]
    law = BENCH.wheel_end.laws[0]
    fine = np.linspace(0.0, 6e-3, 600001)
    assert found == pytest.approx(np.interp(load[0], law.static_force(fine), fine), abs=1e-9)
