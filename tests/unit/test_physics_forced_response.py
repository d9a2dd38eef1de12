"""Shapes, warm start, independence of the lines and refusals of the forced response."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.forced_response import (
    SMALLEST_AMPLITUDE,
    ConvergenceError,
    amplitude_dependent_response,
    forced_response,
    modal_superposition,
)
from deboom.physics.rigid_body import forward_matrices, mass_matrix, mount_stiffness_matrix

FREQUENCY = np.linspace(20.0, 80.0, 13)
POSITIONS = np.array([[0.05, 0.43, 0.20], [-0.034, -0.45, 0.19], [0.20, -0.06, -0.27]])
STIFFNESS = np.array([110e3, 90e3, 150e3, 190e3, 140e3, 220e3, 75e3, 50e3, 55e3])
MASS = mass_matrix(193.5, np.array([[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]]))
FORWARD = forward_matrices(POSITIONS)
FORCE = np.zeros((FREQUENCY.size, 6), dtype=complex)
FORCE[:, 4] = 460 * np.exp(-1.4j)


def softening(amplitude):
    """Stiffness that falls with the amplitude, with a loss that rises and falls (Payne)."""
    z = (amplitude / 1e-4) ** 0.55
    factor = 1 + 0.45 / (1 + z**2) + 0.2j * z / (1 + z**2)
    return mount_stiffness_matrix(POSITIONS, STIFFNESS * factor)


def respond(frequency=FREQUENCY, force=FORCE, stiffness=softening, **options):
    return amplitude_dependent_response(MASS, stiffness, force, frequency, FORWARD, **options)


def test_loads_that_do_not_fit_are_refused():
    springs = mount_stiffness_matrix(POSITIONS, STIFFNESS)
    with pytest.raises(InputError, match="loads have shape"):
        forced_response(MASS, springs, FORCE[:, :3], FREQUENCY)
    with pytest.raises(InputError, match="loads have shape"):
        forced_response(MASS, springs, FORCE[:5], FREQUENCY)


def test_an_undamped_resonance_is_refused():
    line = np.array([20.0])
    with pytest.raises(InputError, match="resonance"):
        forced_response([[1.0]], [(2 * np.pi * line) ** 2], [[1.0]], line)


def test_modal_superposition_refuses_a_complex_static_stiffness():
    springs = mount_stiffness_matrix(POSITIONS, STIFFNESS * (1 + 0.1j))
    with pytest.raises(InputError, match="real part"):
        modal_superposition(MASS, springs, np.ones(13), FORCE, FREQUENCY)


def test_a_motionless_mount_does_not_stop_the_iteration():
    """Without load nothing moves, and the stiffness is asked for at the smallest amplitude."""
    asked = []

    def watched(amplitude):
        asked.append(amplitude.copy())
        return softening(amplitude)

    state = respond(force=0 * FORCE, stiffness=watched)
    np.testing.assert_array_equal(state.displacement, 0)
    np.testing.assert_allclose(asked[-1], SMALLEST_AMPLITUDE)


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
    state = solve(relaxation=0.4)
    x = state.amplitude[0, 0]
    assert (1e4 * (1 + (x / 1e-3) ** 2) - (2 * np.pi) ** 2) * x == pytest.approx(60.0, rel=1e-8)


def test_a_stiffness_that_turns_nan_is_reported_and_not_returned():
    def broken(amplitude):
        matrices = softening(amplitude)
        matrices[3] = np.nan
        return matrices

    with pytest.raises(ConvergenceError, match="not finite at 35 Hz"):
        respond(stiffness=broken)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"relaxation": 0.0}, "relaxation"),
        ({"relaxation": 1.5}, "relaxation"),
        ({"max_iterations": 0}, "max_iterations"),
        ({"start": 0.0}, "above 0"),
        ({"start": np.nan}, "above 0"),
        ({"start": np.append(np.full(8, 1e-4), 0.0)}, "above 0"),
    ],
)
def test_options_out_of_range_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        respond(**options)
