"""Orders against a torque record in time, built from crank angles alone."""

import numpy as np
import pytest
from scipy import signal

from deboom.physics.orders import dominant_order, frequency_of_order, rpm_of_frequency


@pytest.mark.parametrize("cylinders", [2, 3, 4, 6])
def test_firing_pulses_sound_at_the_dominant_order(cylinders):
    """Pulses 720°/n apart: the lowest line of the record is the firing frequency."""
    rpm, rate, duration = 1800.0, 3840, 2.0
    time = np.arange(int(rate * duration)) / rate
    crank_angle = 360 * rpm / 60 * time
    spacing = 720 / cylinders
    phase = np.mod(crank_angle, spacing) / spacing
    torque = np.where(phase < 0.2, np.sin(np.pi * phase / 0.2), 0.0)
    amplitude = np.abs(np.fft.rfft(torque - torque.mean())) / time.size
    lines = np.fft.rfftfreq(time.size, 1 / rate)
    strongest = lines[amplitude.argmax()]
    assert frequency_of_order(rpm, dominant_order(cylinders)) == pytest.approx(strongest, abs=1e-9)


def test_frequency_is_the_rate_of_the_order_phase_in_a_run_up():
    """The instantaneous frequency of cos(order · shaft angle) in a run-up."""
    order, rate = 1.5, 2000
    time = np.arange(20 * rate) / rate
    rpm = 800 + 120 * time
    revolutions = (800 * time + 60 * time**2) / 60
    phase = np.unwrap(np.angle(signal.hilbert(np.cos(2 * np.pi * order * revolutions))))
    measured = np.gradient(phase, time) / (2 * np.pi)
    inside = slice(2 * rate, -2 * rate)
    np.testing.assert_allclose(frequency_of_order(rpm, order)[inside], measured[inside], rtol=2e-3)
    np.testing.assert_allclose(rpm_of_frequency(measured, order)[inside], rpm[inside], rtol=2e-3)
