"""From voltage of the tacho and time records to order spectra of known amplitude and phase."""

import numpy as np
import pytest

from deboom.measurement.order_spectra import (
    computed_order_spectrum,
    quasi_static,
    vold_kalman_spectra,
)
from deboom.measurement.shaft_angle import shaft_angle
from deboom.measurement.tacho import pulse_times
from deboom.measurement.tacho_repair import repair_pulses
from deboom.measurement.time_record import TimeRecord
from deboom.physics.order_tracking_resolution import noise_amplitude

RATE = 16384.0
ORDERS = (0.5, 1.5, 3.0)
RPM = np.arange(1000.0, 2601.0, 50.0)


class Run:
    """A linear run between two speeds with a tacho of one pulse per revolution."""

    def __init__(self, first_rpm, last_rpm, duration):
        self.time = np.arange(int(duration * RATE)) / RATE
        slope = (last_rpm - first_rpm) / duration
        self.rpm = first_rpm + slope * self.time
        turned = (first_rpm * self.time + slope * self.time**2 / 2) / 60 - 0.4
        self.angle = 2 * np.pi * turned
        within = np.mod(turned + 0.5, 1.0) - 0.5
        edge = 2 * self.rpm / 60 / RATE
        rise = np.clip(within / edge + 0.5, 0, 1)
        self.tacho = 5 * rise * np.clip((0.2 - within) / edge + 0.5, 0, 1)

    def shaft(self, tacho=None):
        """Shaft angle as a laboratory would get it."""
        return shaft_angle(repair_pulses(pulse_times(self.tacho if tacho is None else tacho, RATE)))

    def record(self, *columns):
        """Make a record of some channels."""
        names = tuple(f"A{i} x" for i in range(len(columns)))
        return TimeRecord(np.column_stack(columns), RATE, names, "N")

    def order(self, order, amplitude):
        """Signal of one order."""
        return np.real(amplitude * np.exp(1j * order * self.angle))


def worst(spectrum, truth):
    """Largest error of the amplitude [%] and of the phase [deg]."""
    ratio = spectrum.spectrum.values[:, 0] / truth
    return 100 * np.abs(np.abs(ratio) - 1).max(), np.rad2deg(np.abs(np.angle(ratio)).max())


@pytest.mark.parametrize("speeds", [(700.0, 2900.0), (2900.0, 700.0)])
def test_three_orders_of_a_run(speeds):
    """Orders 0.5, 1.5 and 3 on a static force of 500 N that rises; up and down, 5 s."""
    run = Run(*speeds, 5.0)
    shaft = run.shaft()
    amplitudes = {0.5: 0.4 * np.exp(1j), 1.5: 3 * np.exp(-0.5j), 3.0: 1.2 * np.exp(2.5j)}
    static = 500 + 0.1 * run.rpm
    record = run.record(static + sum(run.order(q, a) for q, a in amplitudes.items()))
    computed = [computed_order_spectrum(record, shaft, q, RPM, revolutions=8) for q in ORDERS]
    filtered = vold_kalman_spectra(record, shaft, ORDERS, RPM, bandwidth=3.0)
    for spectra in (computed, filtered):
        for order, spectrum in zip(ORDERS, spectra, strict=True):
            percent, degrees = worst(spectrum, amplitudes[order])
            assert percent < 0.3
            assert degrees < 0.3
            np.testing.assert_allclose(spectrum.spectrum.frequency, order * RPM / 60)
            assert spectrum.spectrum.channels == ("A0 x",)
            assert spectrum.spectrum.unit == "N"
            np.testing.assert_allclose(np.interp(spectrum.time, run.time, run.rpm), RPM, rtol=1e-4)
    slow = quasi_static(record, shaft, RPM, bandwidth=2.0)
    np.testing.assert_allclose(slow[:, 0], 500 + 0.1 * RPM, rtol=1e-3)


def test_order_through_a_resonance_where_the_ramp_allows():
    """Mode at 42 Hz with 6 % damping; 8 s from 900 to 2700 1/min, order 1.5 sweeps 5.6 Hz/s."""
    run = Run(900.0, 2700.0, 8.0)
    shaft = run.shaft()

    def amplitude(rpm):
        frequency = 1.5 * rpm / 60
        return 2j / (1 - (frequency / 42) ** 2 + 0.12j * frequency / 42)

    record = run.record(run.order(1.5, amplitude(run.rpm)))
    lines = np.arange(1100.0, 2501.0, 25.0)
    found = [
        vold_kalman_spectra(record, shaft, [1.5], lines, bandwidth=bandwidth)[0]
        for bandwidth in (1.5, 4.0, 10.0)
    ]
    found.append(computed_order_spectrum(record, shaft, 1.5, lines, revolutions=4))
    errors = [worst(spectrum, amplitude(lines)) for spectrum in found]
    smears = [float(np.median(spectrum.smear)) for spectrum in found]
    np.testing.assert_allclose(smears[:3], 11.25 / np.array([1.5, 4.0, 10.0]), rtol=0.01)
    # half-power width of the mode: 5 Hz; smear below it keeps 1 % and 1 degree
    assert errors[0][0] > 3
    for percent, degrees in errors[2:]:
        assert percent < 1
        assert degrees < 1


def test_noise_of_the_spectrum_is_the_stated_one():
    rng = np.random.default_rng(7)
    sigma, channels = 0.8, 24
    run = Run(900.0, 2700.0, 6.0)
    record = run.record(*rng.normal(0, sigma, (channels, run.time.size)))
    shaft = run.shaft()
    density = 2 * sigma**2 / RATE
    for spectrum in (
        computed_order_spectrum(record, shaft, 1.5, RPM, revolutions=8),
        vold_kalman_spectra(record, shaft, [1.5], RPM, bandwidth=4.0)[0],
    ):
        stated = noise_amplitude(density, spectrum.noise_bandwidth)
        level = np.mean(np.abs(spectrum.spectrum.values / stated[:, np.newaxis]) ** 2)
        assert np.sqrt(level) == pytest.approx(1, rel=0.06)


def test_a_strong_neighbour_is_named_and_gone():
    """Order 2 beside order 1.5, 8 Hz away at 1000 1/min, with a filter 6 Hz wide."""
    run = Run(700.0, 2900.0, 6.0)
    record = run.record(run.order(2.0, 1.0) + run.order(1.5, 2.0))
    shaft = run.shaft()
    lines = np.arange(1000.0, 2601.0, 100.0)
    alone = vold_kalman_spectra(record, shaft, [1.5], lines, bandwidth=6.0)[0]
    both = vold_kalman_spectra(record, shaft, [1.5, 2.0], lines, bandwidth=6.0)[0]
    assert worst(both, 2.0)[0] < 0.1
    assert worst(alone, 2.0)[0] > 5 * worst(both, 2.0)[0]


def test_damaged_tacho_changes_nothing_that_counts():
    """Three pulses erased, a spike added: amplitude within 0.3 %, phase within 0.3 degrees."""
    run = Run(700.0, 2900.0, 5.0)
    tacho = run.tacho.copy()
    begin = np.flatnonzero(np.diff((tacho > 2.5).astype(int)) == 1)
    for pulse in (20, 60, 61):
        tacho[begin[pulse] - 20 : begin[pulse + 1] - 20] = 0
    tacho[begin[90] + 200 : begin[90] + 204] = 5
    record = run.record(run.order(1.5, 3 * np.exp(-0.5j)))
    shaft = run.shaft(tacho)
    assert shaft.pulses.dropped.size == 1
    assert shaft.pulses.missing.size == 3
    for spectrum in (
        computed_order_spectrum(record, shaft, 1.5, RPM),
        vold_kalman_spectra(record, shaft, [1.5], RPM, bandwidth=3.0)[0],
    ):
        percent, degrees = worst(spectrum, 3 * np.exp(-0.5j))
        assert percent < 0.3
        assert degrees < 0.3


def test_record_and_tacho_may_start_at_different_times():
    run = Run(700.0, 2900.0, 5.0)
    full = run.record(run.order(1.5, 2.0))
    later = TimeRecord(full.values[8000:], RATE, full.channels, "N", start=8000 / RATE)
    shaft = run.shaft()
    lines = np.array([1500.0, 2000.0])
    expected = computed_order_spectrum(full, shaft, 1.5, lines).spectrum.values
    found = computed_order_spectrum(later, shaft, 1.5, lines).spectrum.values
    np.testing.assert_allclose(found, expected, atol=1e-4)
