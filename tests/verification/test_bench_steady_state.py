"""The amplitude-dependent steady state against the printed law, the time domain and energy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from deboom.bench.operating_run import full_load_run
from deboom.bench.parameters import load_bench, read_data
from deboom.bench.suspended_body import operating_stiffness, play_operator
from deboom.physics.forced_response import amplitude_dependent_response

BENCH = load_bench()
FREQUENCY = np.linspace(20.0, 80.0, 61)
RUNS = {gear: full_load_run(BENCH, gear, 220.0, FREQUENCY) for gear in (1, 3, 5, 7)}


def order_load(run):
    """Write the study's table of the order torque out again."""
    rpm = FREQUENCY * 40
    phase = np.deg2rad(-80 - 5 * np.exp(-(rpm - 800) / 700))
    load = np.zeros((FREQUENCY.size, 6), complex)
    load[:, 4] = (38 + 1.92 * run.engine_torque) * np.exp(1j * phase)
    return load


def printed_stiffness(mount, axis, static, amplitudes, frequency):
    """Evaluate the law of one direction as the study prints it, from the JSON file."""
    data = read_data("powertrain.json")
    law = data["directions"][f"{mount} {'xyz'[axis]}"]
    tangent = law["k0_N_per_m"]
    for onset, width, stiffness in law["stages_u_m_w_m_dk_N_per_m"]:
        side = 1 if onset > 0 else -1
        tangent += stiffness / (1 + np.exp(-(side * static[axis] - abs(onset)) / width))
    reach, half = abs(static[0]), data["cross_amplitude_m"][mount]
    grown = 1 / (1 + np.exp(-(reach - half) / 1e-3)) + 0.15 * reach / half
    own = amplitudes[axis] ** 2
    felt = np.sqrt(own + 0.15 * (np.sum(amplitudes**2) - own))
    z = (felt / law["payne_amplitude_m"]) ** law["payne_exponent"]
    factor = (
        1
        + law["payne_storage"] / (1 + z**2)
        + 2j * law["payne_loss"] * z / (1 + z**2)
        + law["fractional_weight"] * (1j * frequency / 40) ** 0.25
    )
    if law["hydraulic"]:
        r = 1j * frequency / 13
        factor += 0.55 * r**2 / (r**2 + 0.6 * r + 1)
    return tangent * (1 + law["cross_stiffening"] * grown) * factor


@pytest.mark.parametrize("gear", RUNS)
def test_equation_of_motion_with_the_printed_law(gear):
    run = RUNS[gear]
    state = run.powertrain
    remembered = play_operator(state.static_deflection, BENCH.powertrain.play)
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


@pytest.mark.parametrize("line", [5, 20])
def test_one_line_against_integration_in_time(line):
    # the operating stiffness of the line as springs and dashpots: c = K''/ω
    state, omega = RUNS[5].powertrain, 2 * np.pi * FREQUENCY[line]
    forward, stiffness = BENCH.powertrain.forward, state.stiffness[line]
    spring = forward.T @ (stiffness.real[:, None] * forward)
    dashpot = forward.T @ (stiffness.imag[:, None] * forward) / omega
    inverse_mass = np.linalg.inv(BENCH.powertrain.mass_matrix)
    load = order_load(RUNS[5])[line]

    def rate(t, state):
        position, speed = state[:6], state[6:]
        push = (load * np.exp(1j * omega * t)).real
        return np.concatenate([speed, inverse_mass @ (push - spring @ position - dashpot @ speed)])

    # only the steady state starts without a transient and stays what it is
    t = np.linspace(0.0, 10 * 2 * np.pi / omega, 401)
    begin = np.concatenate([state.motion[line].real, (1j * omega * state.motion[line]).real])
    solved = solve_ivp(rate, (0.0, t[-1]), begin, method="DOP853", t_eval=t, rtol=1e-9, atol=1e-13)
    steady = np.outer(state.displacement[line], np.exp(1j * omega * t)).real
    largest = np.abs(steady).max(axis=1, keepdims=True)
    assert np.max(np.abs(forward @ solved.y[:6] - steady) / largest) < 1e-5


@pytest.mark.parametrize("gear", RUNS)
def test_the_engine_feeds_what_the_mounts_dissipate(gear):
    state, load = RUNS[gear].powertrain, order_load(RUNS[gear])
    omega = 2 * np.pi * FREQUENCY
    fed = 0.5 * np.real(np.sum(load * np.conj(1j * omega[:, None] * state.motion), axis=1))
    lost = 0.5 * omega * np.sum(state.stiffness.imag * np.abs(state.displacement) ** 2, axis=1)
    assert fed == pytest.approx(lost, rel=1e-8)
    assert np.all(lost > 0)


@pytest.mark.parametrize("gear", RUNS)
def test_the_steady_state_does_not_depend_on_the_start(gear):
    body = BENCH.powertrain
    forward, load = body.forward, order_load(RUNS[gear])
    remembered = play_operator(RUNS[gear].powertrain.static_deflection, body.play)

    def matrix(amplitude):
        stiffness = operating_stiffness(body, remembered, amplitude, FREQUENCY)
        return np.einsum("ka,fk,kb->fab", forward, stiffness, forward)

    found = [
        amplitude_dependent_response(
            body.mass_matrix, matrix, load, FREQUENCY, forward, start=start, tolerance=1e-11
        ).amplitude
        for start in (1e-6, 1e-4, 5e-3)
    ]
    assert np.max(np.abs(np.log(found[0] / found[2]))) < 1e-9
    assert np.max(np.abs(np.log(found[1] / found[2]))) < 1e-9


def test_wheel_end_against_its_closed_form():
    for gear, run in RUNS.items():
        data = read_data("powertrain.json")["wishbone"]
        ratio, omega = BENCH.total_ratios[gear - 1], 2 * np.pi * FREQUENCY
        r = FREQUENCY / 14
        push = order_load(run)[:, 4] * ratio * 0.40 / (1 - r**2 + 2j * 0.12 * r) / (2 * 0.312)
        state = run.wheel_end
        moved = push / (state.stiffness[:, 0] - omega**2 * data["wheel_end_mass_kg"])
        assert state.displacement[:, 0] == pytest.approx(moved, rel=1e-9)
        law = BENCH.wheel_end.laws[0]
        static = state.static_deflection[:, 0]
        own = law.tangent_stiffness(static) * law.dynamic_factor(np.abs(moved), FREQUENCY)
        assert state.stiffness[:, 0] == pytest.approx(own, rel=1e-9)
