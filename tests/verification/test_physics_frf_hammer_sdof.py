"""Hammer on one mass: estimates against the closed form of its inertance."""

import numpy as np
import pytest

from deboom.measurement.frf_estimate import Estimator
from deboom.measurement.hammer_frf import ForceWindow, HammerOptions, hammer_frf
from deboom.physics.impact_windows import corrected_damping_ratio, corrected_pole
from struck_mass import (
    DAMPING,
    MASS,
    NATURAL,
    POLES,
    PUSH,
    fitted_pole,
    force,
    inertance,
    measured,
    motion,
)

BAND = (10.0, 150.0)


def test_the_record_obeys_newton():
    """The judge itself: m a + c v + k x = f, term by term."""
    time = np.linspace(-0.01, 0.5, 4001)
    left = MASS * motion(time, 2) + 2 * MASS * DAMPING * NATURAL * motion(time, 1)
    left += MASS * NATURAL**2 * motion(time, 0)
    np.testing.assert_allclose(left, force(time), atol=1e-9 * PUSH)


def test_inertance_with_its_sign():
    """τ of the body is 0.2 s: after 2 s nothing is left but e⁻⁹ of it."""
    estimate = hammer_frf(measured(), HammerOptions(band=BAND))
    s = 2j * np.pi * estimate.frequency
    found, truth = estimate.values[:, 0, 0], inertance(s)
    assert np.abs(found - truth).max() < 3e-4 * np.abs(truth).max()
    # e^{+jωt}: at resonance the acceleration leads the force by 90°, below it opposes it, above not
    assert found[np.argmin(np.abs(estimate.frequency - 37.0))].imag > 0
    assert found[np.argmin(np.abs(estimate.frequency - 15.0))].real < 0
    assert found[np.argmin(np.abs(estimate.frequency - 120.0))].real > 0
    assert estimate.frf.unit == "(m/s^2)/N"
    np.testing.assert_allclose(estimate.coherence, 1, atol=1e-12)


@pytest.mark.parametrize("estimator", list(Estimator))
def test_exponential_window_moves_every_pole(estimator):
    """The windowed function is H(jω + 1/τ), to the aliasing of the push, and H(jω) not at all."""
    time_constant = 0.1
    options = HammerOptions(estimator, time_constant=time_constant, band=BAND)
    estimate = hammer_frf(measured(), options)
    assert estimate.added_decay_rate == 10.0
    s = 2j * np.pi * estimate.frequency
    found = estimate.values[:, 0, 0]
    largest = np.abs(inertance(s)).max()
    assert np.abs(found - inertance(s + 10.0)).max() < 5e-6 * largest
    assert np.abs(found - inertance(s)).max() > 0.5 * largest


def test_pole_and_damping_are_corrected_after_the_fit():
    estimate = hammer_frf(measured(), HammerOptions(time_constant=0.1, band=BAND))
    pole = fitted_pole(estimate.frequency, estimate.values[:, 0, 0])
    # three times the body's own damping
    assert -pole.real / abs(pole) > 3 * DAMPING
    assert abs(corrected_pole(pole, 0.1) - POLES[0]) < 1e-5 * NATURAL
    frequency = abs(pole) / (2 * np.pi)
    damping = corrected_damping_ratio(-pole.real / abs(pole), frequency, 0.1)
    assert damping == pytest.approx(DAMPING, rel=1e-3)
    # the first-order rule ζ − 1/(ωτ) is close, not exact
    assert -pole.real / abs(pole) - 1 / (abs(pole) * 0.1) == pytest.approx(DAMPING, rel=0.02)


def test_force_window_leaves_the_function_and_takes_the_noise():
    """2 s of block, 8 ms of push: the noise of the rest goes."""
    window = ForceWindow(before=0.001, after=0.006, taper=0.001)
    clean = hammer_frf(measured(), HammerOptions(band=BAND, force_window=window))
    s = 2j * np.pi * clean.frequency
    assert np.abs(clean.values[:, 0, 0] - inertance(s)).max() < 3e-4 * np.abs(inertance(s)).max()
    noisy = measured(n_hit=8, force_noise=1.0)
    error = {
        w: np.abs(
            hammer_frf(noisy, HammerOptions(band=BAND, force_window=w)).values[:, 0, 0]
            - inertance(s)
        ).max()
        for w in (None, window)
    }
    assert error[None] > 0.01 * np.abs(inertance(s)).max()
    assert error[window] < 0.1 * error[None]
