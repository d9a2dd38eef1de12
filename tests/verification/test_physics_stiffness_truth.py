"""Dynamic stiffness and forced response against the thesis and time integration."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from thesis_samples import ORIENTATIONS, POSITIONS, complex_normal, deviation
from thesis_samples import STIFFNESS as STATIC

from deboom.physics import dynamic_stiffness, rigid_body
from deboom.physics.forced_response import (
    SMALLEST_AMPLITUDE,
    ConvergenceError,
    amplitude_dependent_response,
    dynamic_stiffness_matrix,
    forced_response,
    modal_superposition,
)
from deboom.physics.frf import FrfForm, convert, scaled_condition_number

EXACT = 1e-10

INERTIA = np.array([[158e-4, 2e-4, -1.5e-4], [2e-4, 291e-4, 1e-4], [-1.5e-4, 1e-4, 302e-4]])
MASS = rigid_body.mass_matrix(7.2, INERTIA, [1.5e-3, -2e-3, 1e-3])
STIFFNESS = rigid_body.mount_stiffness_matrix(POSITIONS, STATIC, ORIENTATIONS)
FREQUENCY = np.arange(10.0, 150.5, 0.5)


def gain(frequency):
    """Hyperbolic dynamic gain of the thesis's shape (eq. 52), loss included."""
    real = 1.85 - 1 / (0.06 * frequency + 2.2)
    return real + 1j * (0.42 - 1 / (0.15 * frequency + 2.5))


@pytest.fixture
def rng():
    return np.random.default_rng(31)


def test_eq_29_operating_forces_need_the_inverse(rng):
    """Cells that see 94 % of the force: multiplying, as printed, loses 12 %, no correction 6 %."""
    matrix = 0.94 * np.eye(3) + 0.002 * rng.normal(size=(3, 3))
    true = complex_normal(rng, 50, 3)
    measured = np.einsum("oi,fi->fo", matrix, true)
    printed = np.einsum("oi,fi->fo", matrix, measured)
    assert deviation(dynamic_stiffness.force_at_virtual_point(matrix, measured), true) < EXACT
    assert deviation(measured, true) == pytest.approx(1 - 0.94, abs=0.01)
    assert deviation(printed, true) == pytest.approx(1 - 0.94**2, abs=0.01)


def test_eq_30_is_force_over_displacement(rng):
    """The formula as printed, and its text, which has the quotient the other way round."""
    force, motion = complex_normal(rng, 2, 40)
    power = motion.real**2 + motion.imag**2
    printed = (force.real * motion.real + force.imag * motion.imag) / power + 1j * (
        force.imag * motion.real - force.real * motion.imag
    ) / power
    assert deviation(dynamic_stiffness.dynamic_stiffness(force, motion), printed) < EXACT
    assert deviation(motion / force, printed) > 0.1


def test_eq_30_with_measured_acceleration_of_a_known_spring():
    """s(t) = Re(s e^{jωt}) differentiated by hand: the sign of −a/ω² and of the loss."""
    frequency = np.array([20.0, 35.0])
    omega = 2 * np.pi * frequency
    amplitude, phase, spring, damper = 2e-4, 0.6, 1.2e5, 80.0
    # s = A cos(ωt + φ), v = −Aω sin(ωt + φ), a = −Aω² cos(ωt + φ), f = k s + c v; at e^{jωt}:
    acceleration = -amplitude * omega**2 * np.exp(1j * phase)
    cosine = spring * amplitude * np.exp(1j * phase)
    sine = -damper * amplitude * omega * np.exp(1j * (phase - np.pi / 2))
    motion = dynamic_stiffness.displacement_from_acceleration(acceleration, frequency)
    stiffness = dynamic_stiffness.dynamic_stiffness(cosine + sine, motion)
    np.testing.assert_allclose(
        stiffness, dynamic_stiffness.kelvin_voigt(frequency, spring, damper), rtol=1e-12
    )
    np.testing.assert_allclose(dynamic_stiffness.loss_factor(stiffness), omega * damper / spring)


@pytest.mark.parametrize("noise_in_force", [0.0, 0.1, 0.3])
def test_repeats_recover_the_stiffness_where_their_noise_model_holds(rng, noise_in_force):
    """20 000 records with stated noise: Hv has no bias; H1 is low by (1 + σ_s²/|s|²)."""
    true, n = 2e5 * np.exp(0.15j), 20_000
    noise_in_motion = 0.3
    motion = 1e-4 * np.exp(0.7j)
    force = true * motion + noise_in_force * abs(true * motion) * complex_normal(rng, n) / 2**0.5
    measured = motion + noise_in_motion * abs(motion) * complex_normal(rng, n) / 2**0.5
    ratio = max(noise_in_force, 1e-6) * abs(true) / noise_in_motion
    assert dynamic_stiffness.stiffness_hv(force, measured, ratio) == pytest.approx(true, rel=0.01)
    low = true / (1 + noise_in_motion**2)
    assert dynamic_stiffness.stiffness_h1(force, measured) == pytest.approx(low, rel=0.01)
    high = true * (1 + noise_in_force**2)
    assert dynamic_stiffness.stiffness_h2(force, measured) == pytest.approx(high, rel=0.01)


def test_hv_is_the_smallest_singular_vector_of_the_whitened_records(rng):
    """Total least squares the textbook way, by SVD."""
    force, motion = 1e2 * complex_normal(rng, 12), 1e-3 * complex_normal(rng, 12)
    ratio = 4e4
    records = np.stack([force / ratio, motion], axis=1)
    normal = np.linalg.svd(records)[2][-1]  # records @ conj(normal) is smallest
    by_svd = -ratio * normal[1].conj() / normal[0].conj()
    assert dynamic_stiffness.stiffness_hv(force, motion, ratio) == pytest.approx(by_svd, rel=1e-9)


def test_table_9_of_an_oscillator():
    """All six forms of one degree of freedom, written out."""
    m, c, k = 2.0, 30.0, 5e4
    omega = 2 * np.pi * FREQUENCY
    stiffness = k - m * omega**2 + 1j * c * omega
    written = {
        FrfForm.RECEPTANCE: 1 / stiffness,
        FrfForm.MOBILITY: 1 / (c + 1j * (m * omega - k / omega)),
        FrfForm.INERTANCE: 1 / (m - k / omega**2 - 1j * c / omega),
        FrfForm.DYNAMIC_STIFFNESS: stiffness,
        FrfForm.IMPEDANCE: c + 1j * (m * omega - k / omega),
        FrfForm.APPARENT_MASS: m - k / omega**2 - 1j * c / omega,
    }
    for source, values in written.items():
        for target, expected in written.items():
            converted = convert(values[:, np.newaxis, np.newaxis], FREQUENCY, source, target)
            assert deviation(converted[:, 0, 0], expected) < EXACT
    still = convert(np.ones((2, 1, 3)), [0.0, 1.0], FrfForm.RECEPTANCE, FrfForm.INERTANCE)
    np.testing.assert_allclose(still[:, 0, 0], [0.0, -((2 * np.pi) ** 2)])


def test_table_9_inverse_is_that_of_the_matrix(rng):
    receptance = np.linalg.inv(dynamic_stiffness_matrix(MASS, 1.1j * STIFFNESS, FREQUENCY))
    converted = convert(receptance, FREQUENCY, FrfForm.RECEPTANCE, FrfForm.DYNAMIC_STIFFNESS)
    expected = dynamic_stiffness_matrix(MASS, 1.1j * STIFFNESS, FREQUENCY)
    assert deviation(converted, expected) < EXACT
    assert deviation(1 / receptance, expected) > 0.1


def test_eq_48_to_51_apparent_mass():
    """AM = M − (K + jωC)/ω², damping with a minus sign where eq. 48-50 print a plus."""
    damping = 3e-4 * STIFFNESS
    omega = (2 * np.pi * FREQUENCY)[:, np.newaxis, np.newaxis]
    complex_stiffness = dynamic_stiffness.kelvin_voigt(
        FREQUENCY[:, np.newaxis, np.newaxis], STIFFNESS, damping
    )
    apparent = convert(
        dynamic_stiffness_matrix(MASS, complex_stiffness, FREQUENCY),
        FREQUENCY,
        FrfForm.DYNAMIC_STIFFNESS,
        FrfForm.APPARENT_MASS,
    )
    assert deviation(apparent, MASS - STIFFNESS / omega**2 - 1j * damping / omega) < EXACT
    printed = MASS + 1j * damping / omega - STIFFNESS / omega**2
    assert deviation(apparent, printed) > 1e-3
    # by force balance in the directions of acceleration: F = M a + C v + K x
    x = np.linspace(1, 2, 6) * np.exp(0.3j)
    w = omega[40, 0, 0]
    force = MASS @ (-(w**2) * x) + damping @ (1j * w * x) + STIFFNESS @ x
    assert deviation(apparent[40] @ (-(w**2) * x), force) < EXACT


def test_condition_number_450_is_an_artefact_of_units():
    """Mass line of the compressor: mass over smallest inertia in SI, 2 with a length of √(J/m)."""
    free = rigid_body.mass_matrix(7.2, INERTIA)
    assert np.linalg.cond(free) == pytest.approx(7.2 / np.linalg.eigvalsh(INERTIA)[0])
    assert np.linalg.cond(free) == pytest.approx(455, abs=5)
    units = np.repeat([1.0, 1e3], 3)
    in_millimetres = free * np.outer(units, units)
    assert np.linalg.cond(in_millimetres) > 4000
    length = rigid_body.characteristic_length(7.2, INERTIA)
    assert length == pytest.approx(0.055, abs=0.005)
    scaled = scaled_condition_number(free, FrfForm.APPARENT_MASS, length)
    assert scaled == pytest.approx(2, abs=0.1)
    for matrix, form, unit in (
        (in_millimetres, FrfForm.APPARENT_MASS, 1e3),
        (np.linalg.inv(free), FrfForm.INERTANCE, 1.0),
    ):
        assert scaled_condition_number(matrix, form, unit * length) == pytest.approx(scaled)


def test_eq_68_69_standard_functions():
    """Real and imaginary part of 1/(v k_r − ω² m_r), with m_r as the thesis keeps it."""
    v, k_r, m_r, omega = 1.3 + 0.2j, 4e4, 0.7, 180.0
    resonance = v.real * k_r - omega**2 * m_r
    below = resonance**2 + (v.imag * k_r) ** 2
    printed = resonance / below - 1j * v.imag * k_r / below
    solved = modal_superposition([[m_r]], [[k_r]], [v], [[1.0]], [omega / (2 * np.pi)])
    assert deviation(solved[0, 0], printed) < EXACT


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

    stiffness = rigid_body.mount_stiffness_matrix(
        positions, dynamic_stiffness.kelvin_voigt(frequency, springs, dampers)
    )
    load = np.concatenate([np.zeros(3), torque])
    motion = forced_response(
        rigid_body.mass_matrix(mass, inertia), stiffness[np.newaxis], load[np.newaxis], [frequency]
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


def test_amplitudes_are_those_at_the_mounts_of_a_body():
    """Every mount softens with its own travel: the balance of forces closes mount by mount.

    Without load nothing moves, and the stiffness is asked for at the smallest amplitude; one that
    is not finite is reported with its line.
    """
    positions = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
    static = 1e3 * np.array([[110, 90, 150], [190, 140, 220], [75, 50, 55]])
    inertia = np.diag([11.0, 6.8, 9.6])
    frequency = np.linspace(20, 60, 9)
    force = np.zeros((9, 6), dtype=complex)
    force[:, 4] = 460.0

    def law(amplitude):
        z = (amplitude / 1e-4) ** 0.55
        return static.ravel() * (1 + 0.45 / (1 + z**2) + 0.1j + 0.2j * z / (1 + z**2))

    amplitudes = []

    def solve(force, spoil=1.0):
        def springs(amplitude):
            amplitudes.append(amplitude)
            matrices = rigid_body.mount_stiffness_matrix(positions, law(amplitude))
            matrices[3] *= spoil
            return matrices

        mass, forward = (
            rigid_body.mass_matrix(193.5, inertia),
            rigid_body.forward_matrices(positions),
        )
        return amplitude_dependent_response(mass, springs, force, frequency, forward)

    assert not solve(0 * force).displacement.any()
    np.testing.assert_allclose(amplitudes[-1], SMALLEST_AMPLITUDE)
    with pytest.raises(ConvergenceError, match="not finite at 35 Hz"):
        solve(force, np.nan)
    state = solve(force)
    place, angle = state.displacement[:, np.newaxis, :3], state.displacement[:, np.newaxis, 3:]
    travel = place + np.cross(angle, positions)
    reaction = law(np.abs(travel).reshape(9, 9)).reshape(9, 3, 3) * travel
    omega_squared = (2 * np.pi * frequency[:, np.newaxis]) ** 2
    forces = reaction.sum(1) - 193.5 * omega_squared * place[:, 0]
    moments = np.cross(positions, reaction).sum(1) - omega_squared * (angle[:, 0] @ inertia)
    np.testing.assert_allclose(forces, 0, atol=1e-5)
    np.testing.assert_allclose(moments, force[:, 3:], atol=1e-5)


def test_relaxation_calms_a_swinging_iteration():
    """Below its resonance a stiffening spring swings between two amplitudes."""

    def stiffening(amplitude):
        return 1e4 * (1 + (amplitude / 1e-3) ** 2)[:, :, np.newaxis]

    def solve(**options):
        return amplitude_dependent_response(
            [[1.0]], stiffening, [[60.0]], [1.0], [[1.0]], start=1e-3, **options
        )

    with pytest.raises(ConvergenceError, match="at 1 Hz after 200 iterations"):
        solve()
    x = solve(relaxation=0.4).amplitude[0, 0]
    assert (1e4 * (1 + (x / 1e-3) ** 2) - (2 * np.pi) ** 2) * x == pytest.approx(60.0, rel=1e-8)
