"""Static forces under wheel torque: closed forms, least energy, the bench's truth and its cells."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from deboom.bench.powertrain import load_bench, static_deflection, static_forces, with_mount_set
from deboom.measurement.campaign import StaticCurve
from deboom.mounts.mount import Mount
from deboom.physics.rigid_body import forward_matrices, mount_stiffness_matrix
from deboom.vehicles.powertrain import KinematicModel, MonotoneCurve

AXES = "xyz"
TORQUE = np.array([-300.0, 0.0, 200.0, 748.0, 1364.0, 3564.0])
REACH = np.linspace(-15e-3, 15e-3, 301)
LATERAL, CENTRAL = (0.15, 0.18, -0.25), (0.20, -0.02, -0.26)
BENCH = with_mount_set(load_bench(), "M1")


def model_of(positions, force_of):
    mounts = tuple(Mount(name, "", ("",), (tuple(r),), tuple(AXES)) for name, r in positions)
    curves = {
        f"{mount.name} {axis}": StaticCurve(
            mount.name, axis, "M1", REACH, force_of(k, a)(REACH), 0.03
        )
        for k, mount in enumerate(mounts)
        for a, axis in enumerate(AXES)
    }
    return KinematicModel(mounts, curves)


@pytest.fixture(scope="module")
def model():
    def force_of(mount, axis):
        return BENCH.powertrain.mounts[mount].laws[axis].static_force

    return model_of(zip(BENCH.mount_names, BENCH.positions, strict=True), force_of)


def test_linear_mounts_are_a_linear_system():
    positions = {"E": (0.05, 0.43, 0.2), "G": (-0.03, -0.45, 0.19), "S": (0.2, -0.06, -0.27)}
    stiffness = 1e5 * np.arange(1.0, 10.0).reshape(3, 3)
    linear = model_of(positions.items(), lambda k, a: lambda u: stiffness[k, a] * u)
    torque = np.array([-500.0, 40.0, 900.0])
    load = np.outer(torque, [0, 0, 0, 0, 1, 0])
    matrix = mount_stiffness_matrix(np.array(list(positions.values())), stiffness)
    motion = np.linalg.solve(matrix, load.T).T
    expected = motion @ forward_matrices(list(positions.values())).T
    deflection = linear.equilibrium(torque)
    assert deflection == pytest.approx(expected, abs=1e-12)
    assert linear.force(deflection) == pytest.approx(expected * stiffness.ravel(), abs=1e-6)


def test_a_curve_goes_on_with_its_last_secants():
    ends = MonotoneCurve(StaticCurve("E", "x", "M1", [-1e-3, 0, 2e-3], [-200.0, 0, 100.0], 0.0))
    np.testing.assert_allclose(ends.force(np.array([-2e-3, 4e-3])), [-400.0, 200.0])
    np.testing.assert_allclose(ends.slope(np.array([-2e-3, 4e-3])), [2e5, 5e4])


def test_equilibrium_is_the_least_energy(model):
    torque = 748.0
    springs = [MonotoneCurve(curve) for curve in model.curves.values()]
    nodes, weights = np.polynomial.legendre.leggauss(80)

    def energy(scaled):
        deflection = model.forward @ (scaled * 1e-3)
        path = np.outer((nodes + 1) / 2, deflection)
        forces = np.stack([s.force(path[:, k]) for k, s in enumerate(springs)], axis=1)
        return float(weights / 2 @ forces @ deflection - torque * scaled[4] * 1e-3)

    least = minimize(energy, np.zeros(6), method="BFGS", options={"gtol": 1e-9})
    equilibrium = model.equilibrium([torque])[0]
    assert model.forward @ (least.x * 1e-3) == pytest.approx(equilibrium, abs=2e-6)


def with_strut_at(model, position):
    *others, strut = model.mounts
    return replace(model, mounts=(*others, replace(strut, positions=(position,))))


@pytest.mark.parametrize("strut", [None, LATERAL, CENTRAL])
def test_against_the_truth_of_the_bench(model, strut):
    body = BENCH.powertrain
    if strut is not None:
        model = with_strut_at(model, strut)
    # a strut elsewhere takes the engine mount beyond its curve in first gear
    torque = TORQUE if strut is None else TORQUE[:-1]
    load = np.outer(torque, [0, 0, 0, 0, 1, 0])
    if strut is None:
        true = static_deflection(body, load)
        assert model.equilibrium(torque) == pytest.approx(true, abs=1e-7)
    else:
        # the bench's laws at the deflections found: its forces carry the torque
        forces = static_forces(body, model.equilibrium(torque))
        assert forces @ model.forward == pytest.approx(load, abs=0.05)
