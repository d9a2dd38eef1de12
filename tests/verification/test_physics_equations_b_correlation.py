"""Thesis, eq. 33 to 35: comparing pressures, and one number per vehicle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deboom.physics.correlation import corr_f, corr_s, mac, msf
from deboom.physics.sound_level import energy_sum, mean_level, spl, splv

FREQUENCY = np.arange(20, 60.1, 0.25)


def pressure_of_modes(modes, residues):
    """Complex pressure of a few resonances [Pa]; damping 4 %."""
    omega = 2 * np.pi * FREQUENCY[:, np.newaxis]
    natural = 2 * np.pi * np.asarray(modes)
    return (residues / (natural**2 - omega**2 + 0.08j * natural * omega)).sum(axis=1)


MEASURED = pressure_of_modes([28.0, 41.0, 52.0], [36e3, -24e3, 16e3])
OTHER_CAR = pressure_of_modes([31.0, 37.0, 56.0], [20e3, 32e3, 36e3])

magnitudes = st.floats(0.05, 20)
phases = st.floats(-np.pi, np.pi)


@given(magnitudes, phases)
@settings(max_examples=50, deadline=None)
def test_msf_returns_the_complex_factor_itself(magnitude, phase):
    factor = magnitude * np.exp(1j * phase)
    assert abs(msf(factor * MEASURED, MEASURED) - factor) <= 1e-10 * magnitude
    assert abs(corr_s(factor * MEASURED, MEASURED) - abs(1 - factor)) <= 1e-10 * (1 + magnitude)


@given(magnitudes, phases, magnitudes, phases)
@settings(max_examples=50, deadline=None)
def test_mac_does_not_see_scale_or_phase(first, first_phase, second, second_phase):
    scaled = mac(
        first * np.exp(1j * first_phase) * MEASURED, second * np.exp(1j * second_phase) * OTHER_CAR
    )
    assert abs(scaled - mac(MEASURED, OTHER_CAR)) <= 1e-10
    assert 0 <= scaled <= 1


def test_against_least_squares():
    """MSF is the least-squares factor and 1 − MAC its unexplained share; real unknowns only."""

    def split(curve):
        return np.concatenate([curve.real, curve.imag])

    columns = np.column_stack([split(OTHER_CAR), split(1j * OTHER_CAR)])
    (real, imaginary), residual, *_ = np.linalg.lstsq(columns, split(MEASURED))
    assert msf(MEASURED, OTHER_CAR) == pytest.approx(real + 1j * imaginary, abs=1e-10)
    unexplained = residual[0] / np.sum(split(MEASURED) ** 2)
    assert corr_f(MEASURED, OTHER_CAR) == pytest.approx(unexplained, abs=1e-10)


def test_both_directions_of_msf_multiply_to_mac():
    product = msf(MEASURED, OTHER_CAR) * msf(OTHER_CAR, MEASURED)
    assert product == pytest.approx(mac(MEASURED, OTHER_CAR), abs=1e-10)


def test_without_the_conjugate_the_factor_is_lost():
    """A published code forms aᵀb / bᵀb and keeps the real part; on a shape with phase it fails."""
    factor = 0.318 + 0.624j
    curve = factor * MEASURED
    real_part = (np.dot(curve, MEASURED) / np.dot(MEASURED, MEASURED)).real
    assert abs(real_part - factor) > 0.6
    assert msf(curve, MEASURED) == pytest.approx(factor, abs=1e-10)
    # the scale of two different curves: a transpose in the place of the Hermitian transpose
    transposed = np.dot(OTHER_CAR, MEASURED) / np.dot(OTHER_CAR, OTHER_CAR)
    assert abs(transposed - msf(MEASURED, OTHER_CAR)) > 0.1
    # a conjugate on the wrong side returns the conjugate of the factor
    wrong_side = np.vdot(curve, MEASURED) / np.vdot(MEASURED, MEASURED)
    assert wrong_side == pytest.approx(np.conj(factor), abs=1e-10)


def test_magnitudes_forget_the_phase():
    turned = np.exp(0.3j) * MEASURED
    assert corr_s(turned, MEASURED) == pytest.approx(2 * np.sin(0.15), abs=1e-10)
    assert corr_s(abs(turned), abs(MEASURED)) == pytest.approx(0, abs=1e-10)


def test_on_decibels_two_different_cars_look_alike():
    """The thesis does not say of what MAC is taken; dB curves hide most of the difference."""
    levels = spl(MEASURED, FREQUENCY), spl(OTHER_CAR, FREQUENCY)
    assert corr_f(*levels) < 0.02
    assert corr_f(MEASURED, OTHER_CAR) > 0.5
    assert corr_f(abs(MEASURED), abs(OTHER_CAR)) > 0.1
    # and it depends on the unit: the same curves a thousand times as loud look more alike
    much_louder = spl(1e3 * MEASURED, FREQUENCY), spl(1e3 * OTHER_CAR, FREQUENCY)
    assert corr_f(*much_louder) < 0.5 * corr_f(*levels)


def test_splv_is_a_sum_over_lines():
    """Eq. 35: 6 dB on every line are 6 dB per line in SPLV, and the product of the lines."""
    level = spl(MEASURED, FREQUENCY)
    assert level.size == 161
    louder = splv(spl(2 * MEASURED, FREQUENCY)) - splv(level)
    assert louder == pytest.approx(161 * 20 * np.log10(2), abs=1e-10 * 161)
    # Σ 20 lg |p| = 20 lg Π |p|, by the product of 161 magnitudes in extended range
    mantissa, exponent = np.frexp(abs(MEASURED))
    product = 20 * (np.log10(np.prod(mantissa)) + exponent.sum() * np.log10(2))
    of_one_pascal = spl(np.ones(161), FREQUENCY).sum()
    assert splv(level) == pytest.approx(product + of_one_pascal, rel=1e-10)
    assert mean_level(level) == pytest.approx(splv(level) / 161, rel=1e-12)


def test_energy_sum_is_the_mean_square_of_a_record():
    """Lines that sound together: the level of their energy sum is that of the record."""
    rate = 400
    time = np.arange(4 * rate) / rate
    tones = MEASURED[:, np.newaxis] * np.exp(2j * np.pi * FREQUENCY[:, np.newaxis] * time)
    record = tones.sum(axis=0).real
    level = 20 * np.log10(np.sqrt(np.mean(record**2)) / 20e-6)
    unweighted = 20 * np.log10(abs(MEASURED) / np.sqrt(2) / 20e-6)
    assert energy_sum(unweighted) == pytest.approx(level, abs=1e-9)
