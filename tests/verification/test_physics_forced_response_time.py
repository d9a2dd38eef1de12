"""Complex steady states against time integration of the real equations of motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from deboom.physics.dynamic_stiffness import kelvin_voigt, structural
from deboom.physics.forced_response import (
    amplitude_dependent_response,
    dynamic_stiffness_matrix,
    forced_response,
)
from deboom.physics.frf import FrfForm, convert
from deboom.physics.rigid_body import forward_matrices, mass_matrix, mount_stiffness_matrix

TIGHT = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-14}


def harmonic(time, values, omega):
    """Complex amplitude of ``Re(X e^{jωt})`` sampled over whole periods."""
    return 2 * np.mean(values * np.exp(-1j * omega * time), axis=-1)


def last_period(derivative, start, omega, n_periods):
    """Integrate over whole periods and sample the last one."""
    duration = 2 * np.pi / omega
    time = (n_periods - 1 + np.arange(64) / 64) * duration
    solution = solve_ivp(derivative, (0, n_periods * duration), start, t_eval=time, **TIGHT)
    return solution.t, solution.y


@pytest.mark.parametrize("frequency", [6.0, 12.0, 25.0])
def test_damped_oscillator_from_rest_settles_on_the_complex_solution(frequency):
    """Below, at and above resonance: +jωc in K, and a lag of the motion behind the force."""
    m, c, k, force = 2.0, 60.0, 2 * (2 * np.pi * 12) ** 2, 3.0 * np.exp(0.4j)
    omega = 2 * np.pi * frequency

    def derivative(t, state):
        push = (force * np.exp(1j * omega * t)).real
        return [state[1], (push - c * state[1] - k * state[0]) / m]

    time, states = last_period(derivative, [0.0, 0.0], omega, 50)
    measured = harmonic(time, states[0], omega)
    stiffness = kelvin_voigt([frequency], k, c).reshape(1, 1, 1)
    solved = forced_response([[m]], stiffness, [[force]], [frequency])[0, 0]
    assert solved == pytest.approx(measured, rel=1e-7)
    assert stiffness[0, 0, 0].imag > 0
    assert -np.pi < np.angle(solved / force) < 0
    conjugate = forced_response([[m]], stiffness.conj(), [[force]], [frequency])[0, 0]
    assert abs(conjugate - measured) > 0.1 * abs(measured)


def test_energy_lost_per_period_is_pi_times_imaginary_stiffness():
    """∮ f ds = π Im(K) |s|² for a spring with structural loss, by quadrature of the loop."""
    stiffness, amplitude = structural(1.2e5, 0.2), 3e-4
    phase = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    motion = amplitude * np.exp(1j * phase)
    force, speed = (stiffness * motion).real, (1j * motion).real
    assert np.mean(force * speed) * 2 * np.pi == pytest.approx(np.pi * 0.2 * 1.2e5 * amplitude**2)


def test_powertrain_on_damped_mounts_stays_on_the_complex_solution():
    """Newton's law of a rigid body, mount by mount with cross products, started on the orbit.

    Were amplitude or phase of any motion wrong, the body would leave the orbit within periods.
    """
    positions = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
    springs = 1e3 * np.array([[110, 90, 150], [190, 140, 220], [75, 50, 55]])
    dampers = 1e-3 * springs
    inertia = np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]])
    mass, frequency = 193.5, 22.0
    omega = 2 * np.pi * frequency
    torque = 460 * np.exp(-1.4j) * np.array([0.03, 1.0, -0.05])

    stiffness = mount_stiffness_matrix(positions, kelvin_voigt(frequency, springs, dampers))
    load = np.concatenate([np.zeros(3), torque])
    motion = forced_response(
        mass_matrix(mass, inertia), stiffness[np.newaxis], load[np.newaxis], [frequency]
    )[0]

    inverse = np.linalg.inv(inertia)

    def derivative(t, state):
        place, angle, velocity, spin = state.reshape(4, 3)
        travel = place + np.cross(angle, positions)
        rate = velocity + np.cross(spin, positions)
        force = -springs * travel - dampers * rate
        moment = np.cross(positions, force).sum(0) + (torque * np.exp(1j * omega * t)).real
        return np.concatenate([velocity, spin, force.sum(0) / mass, inverse @ moment])

    start = np.concatenate([motion.real, (1j * omega * motion).real])
    time, states = last_period(derivative, start, omega, 6)
    measured = harmonic(time, states[:6], omega)
    np.testing.assert_allclose(measured, motion, rtol=1e-6, atol=1e-12)


def test_all_six_forms_of_a_two_mass_system_against_its_time_response():
    """Thesis, table 9: displacement, velocity and acceleration per force, measured in time."""
    mass = np.diag([3.0, 1.5])
    damping = np.array([[80.0, -30.0], [-30.0, 30.0]])
    springs = np.array([[6e4, -2e4], [-2e4, 2e4]])
    frequency = np.array([18.0])
    omega = 2 * np.pi * frequency[0]
    complex_stiffness = (springs + 1j * omega * damping)[np.newaxis]
    forms = {FrfForm.RECEPTANCE: [], FrfForm.MOBILITY: [], FrfForm.INERTANCE: []}
    for loaded in np.eye(2):

        def derivative(t, state, loaded=loaded):
            push = loaded * np.cos(omega * t) - damping @ state[2:] - springs @ state[:2]
            return np.concatenate([state[2:], np.linalg.solve(mass, push)])

        time, states = last_period(derivative, np.zeros(4), omega, 120)
        rates = np.array([derivative(t, y) for t, y in zip(time, states.T, strict=True)]).T
        forms[FrfForm.RECEPTANCE].append(harmonic(time, states[:2], omega))
        forms[FrfForm.MOBILITY].append(harmonic(time, states[2:], omega))
        forms[FrfForm.INERTANCE].append(harmonic(time, rates[2:], omega))
    stiffness = dynamic_stiffness_matrix(mass, complex_stiffness, frequency)
    inverse_of = {
        FrfForm.RECEPTANCE: FrfForm.DYNAMIC_STIFFNESS,
        FrfForm.MOBILITY: FrfForm.IMPEDANCE,
        FrfForm.INERTANCE: FrfForm.APPARENT_MASS,
    }
    for form, columns in forms.items():
        measured = np.stack(columns, axis=-1)[np.newaxis]
        converted = convert(stiffness, frequency, FrfForm.DYNAMIC_STIFFNESS, form)
        np.testing.assert_allclose(converted, measured, rtol=1e-6)
        inverse = convert(stiffness, frequency, FrfForm.DYNAMIC_STIFFNESS, inverse_of[form])
        np.testing.assert_allclose(inverse[0], np.linalg.inv(measured[0]), rtol=1e-6)


def test_stiffening_spring_meets_the_cubic_of_harmonic_balance_and_the_time_response():
    """Duffing: K(X) = k (1 + jη) + ¾ k₃ X²; the amplitude is the root of a cubic in X²."""
    m, c, k, k3 = 1.0, 4.0, (2 * np.pi * 10) ** 2, 2e6
    frequency, force = 8.0, 12.0
    omega = 2 * np.pi * frequency
    linear = k + 1j * omega * c

    def stiffness(amplitude):
        return (linear + 0.75 * k3 * amplitude**2)[:, :, np.newaxis]

    state = amplitude_dependent_response(
        [[m]], stiffness, [[force]], [frequency], [[1.0]], relaxation=0.7
    )
    reduced, loss, cubic = k - m * omega**2, omega * c, 0.75 * k3
    roots = np.roots([cubic**2, 2 * cubic * reduced, reduced**2 + loss**2, -(force**2)])
    real = roots[np.abs(roots.imag) < 1e-12 * np.abs(roots)].real
    assert real.size == 1
    assert state.amplitude[0, 0] == pytest.approx(np.sqrt(real[0]), rel=1e-8)
    assert state.amplitude[0, 0] < 0.99 * force / abs(linear - m * omega**2)

    def derivative(t, y):
        push = force * np.cos(omega * t)
        return [y[1], (push - c * y[1] - k * y[0] - k3 * y[0] ** 3) / m]

    time, states = last_period(derivative, [0.0, 0.0], omega, 40)
    measured = harmonic(time, states[0], omega)
    # one harmonic stands for the motion: the neglected third one is worth a few per mille
    assert state.displacement[0, 0] == pytest.approx(measured, rel=0.01)


def test_dry_friction_meets_den_hartogs_approximation():
    """K(X) = k + j 4 F_c/(π X): X = √(F² − (4 F_c/π)²) / |k − mω²|."""
    m, k, friction = 2.0, 2 * (2 * np.pi * 12) ** 2, 1.5
    frequency = np.array([5.0, 9.0, 16.0, 30.0])
    force = np.full((4, 1), 4.0)

    def stiffness(amplitude):
        return (k + 4j * friction / (np.pi * amplitude))[:, :, np.newaxis]

    state = amplitude_dependent_response([[m]], stiffness, force, frequency, [[1.0]])
    rest = np.sqrt(force[:, 0] ** 2 - (4 * friction / np.pi) ** 2)
    expected = rest / np.abs(k - m * (2 * np.pi * frequency) ** 2)
    np.testing.assert_allclose(state.amplitude[:, 0], expected, rtol=1e-8)


def test_amplitudes_are_those_at_the_mounts_of_a_body():
    """Every mount softens with its own travel: the balance of forces closes mount by mount."""
    positions = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
    static = 1e3 * np.array([[110, 90, 150], [190, 140, 220], [75, 50, 55]])
    inertia = np.diag([11.0, 6.8, 9.6])
    frequency = np.linspace(20, 60, 9)
    force = np.zeros((9, 6), dtype=complex)
    force[:, 4] = 460.0

    def law(amplitude):
        z = (amplitude / 1e-4) ** 0.55
        return static.ravel() * (1 + 0.45 / (1 + z**2) + 0.1j + 0.2j * z / (1 + z**2))

    state = amplitude_dependent_response(
        mass_matrix(193.5, inertia),
        lambda amplitude: mount_stiffness_matrix(positions, law(amplitude)),
        force,
        frequency,
        forward_matrices(positions),
    )
    place, angle = state.displacement[:, np.newaxis, :3], state.displacement[:, np.newaxis, 3:]
    travel = place + np.cross(angle, positions)
    reaction = law(np.abs(travel).reshape(9, 9)).reshape(9, 3, 3) * travel
    omega_squared = (2 * np.pi * frequency[:, np.newaxis]) ** 2
    forces = reaction.sum(1) - 193.5 * omega_squared * place[:, 0]
    moments = np.cross(positions, reaction).sum(1) - omega_squared * (angle[:, 0] @ inertia)
    np.testing.assert_allclose(forces, 0, atol=1e-5)
    np.testing.assert_allclose(moments, force[:, 3:], atol=1e-5)
