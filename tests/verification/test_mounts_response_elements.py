"""Kelvin-Voigt and Berg elements: closed form against the force over time, parameters back."""

import numpy as np
import pytest

from deboom.mounts.berg import friction_stiffness
from deboom.mounts.element_models import BergModel, BergShape, KelvinVoigtModel
from deboom.mounts.regression_model import RegressionModel, gaussian_process
from deboom.physics.dynamic_stiffness import kelvin_voigt


def steady_friction_force(displacement):
    """Berg's friction force over a displacement record, by his rule from turning point to point.

    Displacement over x_2, force over F_max; two cycles are enough to settle.
    """
    force = np.zeros_like(displacement)
    turned_at, turned_with, direction = displacement[0], 0.0, 0.0
    for k in range(1, displacement.size):
        step = displacement[k] - displacement[k - 1]
        if step * direction < 0:
            turned_at, turned_with = displacement[k - 1], force[k - 1]
        if step:
            direction = np.sign(step)
        travel = abs(displacement[k] - turned_at)
        gap = 1 - direction * turned_with
        force[k] = turned_with + direction * travel * gap / (gap + travel)
    return force


@pytest.mark.parametrize("amplitude", [1e-3, 0.05, 0.4, 1.0, 3.0, 30.0])
def test_the_closed_form_is_the_first_harmonic_of_the_force_over_time(amplitude):
    per_cycle, cycles = 20000, 12
    phase = 2 * np.pi * np.arange(cycles * per_cycle) / per_cycle
    force = steady_friction_force(amplitude * np.sin(phase))[-per_cycle:]
    last = phase[-per_cycle:]
    # x = Im(X e^{jωt}) with X real, so F e^{jωt} has the harmonic 2j <F e^{-jωt}>
    harmonic = 2j * np.mean(force * np.exp(-1j * last)) / amplitude
    # stiffness at rest is F_max/x_2, here 1
    np.testing.assert_allclose(friction_stiffness(amplitude), harmonic, atol=3e-4)


def test_small_and_large_amplitudes():
    assert friction_stiffness(0.0) == 1.0
    around = friction_stiffness(np.array([0.99e-4, 1.01e-4]))
    np.testing.assert_allclose(around[0].imag / 0.99, around[1].imag / 1.01, rtol=1e-3)
    far = friction_stiffness(1e4)
    # a dry friction force of amplitude F_max: first harmonic 4/π, purely dissipative
    assert far.imag * 1e4 == pytest.approx(4 / np.pi, rel=2e-3)
    assert abs(far.real) < 0.05 * far.imag
    everywhere = friction_stiffness(np.geomspace(1e-6, 1e4, 200))
    assert np.all(np.diff(everywhere.real) < 0)
    assert np.all(everywhere.imag > 0)


def lines(count=500):
    generator = np.random.default_rng(1)
    return (
        generator.uniform(0, 800, count),
        generator.uniform(2e-5, 6e-4, count),
        generator.uniform(20, 80, count),
    )


def test_a_kelvin_voigt_element_is_given_back():
    preload, amplitude, frequency = lines()
    z = preload / 800
    spring, damper = 1e5 * (1 + z + 2 * z**3), 40 * (2 + z)
    truth = kelvin_voigt(frequency, spring, damper)
    model = KelvinVoigtModel.fit(preload, amplitude, frequency, truth)
    np.testing.assert_allclose(model.predict(preload, amplitude, frequency), truth, rtol=1e-9)


def test_a_berg_element_is_given_back():
    preload, amplitude, frequency = lines()
    shape = BergShape(0.4, 1.5e-4, 0.6, 55.0)
    z = preload / 800
    truth = 1e5 * (1 + z - z**2 + 2 * z**3) * shape(amplitude, frequency)
    model = BergModel.fit(preload, amplitude, frequency, truth)
    np.testing.assert_allclose(model.predict(preload, amplitude, frequency), truth, rtol=1e-5)
    found = model.shape
    assert found.friction == pytest.approx(0.4, rel=1e-3)
    assert found.friction_amplitude == pytest.approx(1.5e-4, rel=1e-3)
    assert found.viscous == pytest.approx(0.6, rel=1e-3)
    assert found.corner_frequency == pytest.approx(55.0, rel=1e-3)


def test_a_gaussian_process_interpolates_a_smooth_law():
    preload, amplitude, frequency = lines(200)
    truth = 2e5 * (1.5 + np.tanh((preload - 400) / 200)) * (1 - 300 * amplitude + 0.1j)
    model = RegressionModel.fit(
        preload, amplitude, frequency, truth, regressor=gaussian_process(), max_lines=150
    )
    fitted = model.predict(preload, amplitude, frequency)
    np.testing.assert_allclose(fitted, truth, rtol=0.02)
