"""The true powertrain: statics, steady state and gas torque against independent solvers."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import root
from scipy.special import expit

from deboom.bench import powertrain
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.physics.rigid_body import rigid_body_modes

BENCH = powertrain.load_bench()
POWERTRAIN = BENCH.powertrain
GEARS = np.array([-300.0, 495.0, 748.0, 1364.0, 3564.0])  # wheel torque [N m]


@pytest.mark.parametrize("index", range(9))
@pytest.mark.parametrize("deflection", [-9e-3, -2e-3, 1e-3, 6e-3])
def test_static_force_is_the_integral_of_the_printed_tangent(index, deflection):
    law = POWERTRAIN.laws[index]

    def tangent(u):
        return law.stiffness + sum(
            stage.stiffness * expit((np.sign(stage.onset) * u - abs(stage.onset)) / stage.width)
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
    deflection = powertrain.static_deflection(POWERTRAIN, pitch(GEARS))
    forward = POWERTRAIN.forward
    for line, load in enumerate(pitch(GEARS)):

        def unbalance(position, load=load):
            forces = powertrain.static_forces(POWERTRAIN, (forward @ position)[None])[0]
            return forward.T @ forces - load

        # from the linear answer, in small steps of load
        position = np.zeros(6)
        for part in np.linspace(0.05, 1.0, 20):
            solution = root(
                lambda q, part=part, load=load: unbalance(q, part * load), position, tol=1e-12
            )
            position = solution.x
        assert solution.success
        assert forward @ position == pytest.approx(deflection[line], abs=1e-9)


def test_traction_preload_of_the_wishbone_mount():
    torque, wheel_radius = 220.0 * 3.40, 0.312
    load = BENCH.driveline.preload(np.array([torque]))
    # both wheels share the torque, half of a wheel's force goes through the rear mount
    assert load == pytest.approx(torque / 2 / wheel_radius / 2)
    preload = powertrain.static_deflection(BENCH.wheel_end, load[:, None])[0, 0]
    law = BENCH.wheel_end.laws[0]
    fine = np.linspace(0.0, 6e-3, 600001)
    assert preload == pytest.approx(np.interp(load[0], law.static_force(fine), fine), abs=1e-9)


FREQUENCY = np.linspace(20.0, 80.0, 61)
RUNS = {gear: true_run(BENCH, PlannedRun(gear, 220.0), FREQUENCY) for gear in (1, 3, 5, 7)}


def order_load(run):
    """Write the study's table of the order torque out again."""
    rpm = FREQUENCY * 40
    phase = np.deg2rad(-80 - 5 * np.exp(-(rpm - 800) / 700))
    load = np.zeros((FREQUENCY.size, 6), complex)
    load[:, 4] = (38 + 1.92 * run.engine_torque) * np.exp(1j * phase)
    return load


def printed_stiffness(mount, axis, static, amplitudes, frequency):
    """Evaluate the law of one direction as the study prints it, from the JSON file."""
    data = powertrain.read_data("powertrain.json")
    law = data["directions"][f"{mount} {'xyz'[axis]}"]
    tangent = law["stiffness"]
    for onset, width, stiffness in law["stages"]:
        side = 1 if onset > 0 else -1
        tangent += stiffness / (1 + np.exp(-(side * static[axis] - abs(onset)) / width))
    reach, half = abs(static[0]), data["cross_amplitude_m"][mount]
    grown = 1 / (1 + np.exp(-(reach - half) / 1e-3)) + 0.15 * reach / half
    variance = amplitudes[axis] ** 2
    felt = np.sqrt(variance + 0.15 * (np.sum(amplitudes**2) - variance))
    z = (felt / law["payne_amplitude"]) ** law["payne_exponent"]
    factor = (
        1
        + law["payne_storage"] / (1 + z**2)
        + 2j * law["payne_loss"] * z / (1 + z**2)
        + law["fractional_weight"] * (1j * frequency / 40) ** 0.25
    )
    if law["fluid"]:
        r = 1j * frequency / 13
        factor += 0.55 * r**2 / (r**2 + 0.6 * r + 1)
    return tangent * (1 + law["cross_stiffening"] * grown) * factor


@pytest.mark.parametrize("gear", RUNS)
def test_equation_of_motion_with_the_printed_law(gear):
    run = RUNS[gear]
    state = run.powertrain
    remembered = powertrain.play_operator(state.static_deflection, BENCH.powertrain.play)
    motion, load = state.motion, order_load(run)
    for line in range(0, FREQUENCY.size, 6):
        mass_force = (2 * np.pi * FREQUENCY[line]) ** 2 * (
            BENCH.powertrain.mass_matrix @ motion[line]
        )
        restoring = np.zeros(6, complex)
        for k, (mount, position) in enumerate(zip(BENCH.mount_names, BENCH.positions, strict=True)):
            at_mount = motion[line, :3] + np.cross(motion[line, 3:], position)
            static = remembered[line, 3 * k : 3 * k + 3]
            force = np.array(
                [
                    printed_stiffness(mount, a, static, np.abs(at_mount), FREQUENCY[line])
                    * at_mount[a]
                    for a in range(3)
                ]
            )
            restoring[:3] += force
            restoring[3:] += np.cross(position, force)
        residual = restoring - mass_force - load[line]
        assert np.abs(residual).max() < 1e-8 * np.abs(load[line]).max()


def test_wheel_end_against_its_closed_form():
    for gear, run in RUNS.items():
        data = powertrain.read_data("powertrain.json")
        ratio, omega = BENCH.total_ratios[gear - 1], 2 * np.pi * FREQUENCY
        r = FREQUENCY / 14
        push = order_load(run)[:, 4] * ratio * 0.40 / (1 - r**2 + 2j * 0.12 * r) / (2 * 0.312)
        state = run.wheel_end
        moved = push / (state.stiffness[:, 0] - omega**2 * data["wheel_end_mass_kg"])
        assert state.displacement[:, 0] == pytest.approx(moved, rel=1e-9)
        law = BENCH.wheel_end.laws[0]
        static = state.static_deflection[:, 0]
        stiffness = law.tangent_stiffness(static) * law.dynamic_factor(np.abs(moved), FREQUENCY)
        assert state.stiffness[:, 0] == pytest.approx(stiffness, rel=1e-9)


@pytest.mark.parametrize(
    ("wheel_torque", "printed"),
    [
        (0.0, [6.5, 7.3, 9.5, 11.2, 15.8, 18.5]),  # idle
        (748.0, [9.1, 11.3, 13.9, 18.5, 21.1, 23.7]),  # 5th gear, 220 Nm
    ],
)
def test_rigid_body_modes(wheel_torque, printed):
    # storage stiffness at 0.1 mm and 20 Hz, at the static equilibrium
    load = wheel_torque * powertrain.TORQUE_AXIS[None]
    deflection = powertrain.static_deflection(BENCH.powertrain, load)
    amplitude, line = np.full((1, 9), 1e-4), np.array([20.0])
    stiffness = powertrain.operating_stiffness(BENCH.powertrain, deflection, amplitude, line)[
        0
    ].real
    forward = BENCH.powertrain.forward
    matrix = forward.T @ (stiffness[:, None] * forward)
    frequencies, _ = rigid_body_modes(BENCH.powertrain.mass_matrix, matrix)
    assert frequencies == pytest.approx(printed, abs=0.051)


def test_a_truth_seed_draws_around_the_frozen_truth_and_one_is_it():
    assert powertrain.load_bench(1).mass == BENCH.mass
    assert powertrain.load_bench(7).mass == powertrain.load_bench(7).mass
    drawn = [powertrain.load_bench(seed) for seed in range(2, 42)]
    assert {bench.cylinders for bench in drawn} == {3, 4}
    assert {bench.order_torque.order for bench in drawn} == {1.5, 2.0}
    for bench in drawn:
        near = {3: 193.5, 4: 208.0}[bench.cylinders]
        assert 0.9 <= bench.mass / near <= 1.1
        assert np.all(np.linalg.eigvalsh(bench.inertia) > 0)
    stiffness = [[law.stiffness for law in bench.powertrain.laws] for bench in (*drawn, BENCH)]
    spread = np.log(np.array(stiffness[:-1]) / stiffness[-1])
    assert np.abs(spread.mean(axis=0)).max() < 0.15
    assert spread.std() == pytest.approx(0.2, abs=0.03)
