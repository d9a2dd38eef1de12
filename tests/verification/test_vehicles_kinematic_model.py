"""Static forces under wheel torque: closed forms, least energy, the bench's truth and its cells."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from deboom.bench.campaign import CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.bench.powertrain import load_bench, static_deflection, static_forces, with_mount_set
from deboom.files.campaign import read_campaign
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
    state = linear.equilibrium(torque)
    assert state.deflection == pytest.approx(expected, abs=1e-12)
    assert state.force == pytest.approx(expected * stiffness.ravel(), abs=1e-6)


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
    found = model.equilibrium([torque]).deflection[0]
    assert model.forward @ (least.x * 1e-3) == pytest.approx(found, abs=2e-6)


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
        assert model.equilibrium(torque).deflection == pytest.approx(true, abs=1e-7)
    else:
        # the bench's laws at the deflections found: its forces carry the torque
        found = static_forces(body, model.equilibrium(torque).deflection)
        assert found @ model.forward == pytest.approx(load, abs=0.05)


def force_deviation(model, torque, seed):
    """Scale errors of the curves, as stated, in the static forces (n, n_direction) [N]."""
    rng = np.random.default_rng(seed)
    forces = []
    for _ in range(40):
        curves = {
            name: replace(curve, force=curve.force * np.exp(curve.force_uncertainty * z))
            for (name, curve), z in zip(
                model.curves.items(), rng.standard_normal(len(model.curves)), strict=True
            )
        }
        forces.append(replace(model, curves=curves).equilibrium(torque).force)
    return np.std(forces, axis=0)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    plan = CampaignPlan(
        mount_sets=("M1",),
        runs=(PlannedRun(3, 220.0, True), PlannedRun(5, 220.0, True)),
        shaker_repeats=1,
        frequency=np.linspace(20.0, 80.0, 61),
    )
    folder = tmp_path_factory.mktemp("bench") / "campaign"
    write_campaign(folder, 5, plan)
    return read_campaign(folder)


def test_suppliers_curves_against_the_static_cell_force(campaign):
    """Curves with 3 % scale errors, cells with 5 N, engine torque with 1 N m noise."""
    carriers = tuple(m for m in campaign.mounts if m.name in campaign.powertrain_mounts)
    curves = {f"{c.mount} {c.axis}": c for c in campaign.static_curves}
    model = KinematicModel(
        carriers, {name: c for name, c in curves.items() if name[:3] in ("EnM", "GeM", "TSM")}
    )
    run = campaign.runs[0]
    state = model.equilibrium(run.wheel_torque)
    deviation = force_deviation(model, run.wheel_torque[::20], 1)[-1]
    more = model.equilibrium(run.wheel_torque + run.total_ratio)
    by_torque = np.sqrt(np.mean((more.force - state.force) ** 2, axis=0))
    for place, name in enumerate(state.names):
        cells = run.static_force[:, run.static_force_names.index(name)]
        difference = state.force[:, place] - cells
        allowed = np.sqrt(5.0**2 + (2.5 * deviation[place]) ** 2 + by_torque[place] ** 2)
        # 61 readings of the noise
        assert np.sqrt(np.mean(difference**2)) < 1.2 * allowed, name
