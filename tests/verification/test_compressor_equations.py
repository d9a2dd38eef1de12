"""Thesis, eq. 36-75 and tables 10, 11: the corrected form holds, the printed form fails.

The references are point masses, energies, roots of polynomials and single equations solved by
bracketing; they share no code with the equations. The page docs/compressor-physics.md names each.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from thesis_samples import complex_normal, deviation

from deboom.bench.choices import CompressorCase
from deboom.bench.compressor_truth import CompressorPlan, true_compressor
from deboom.compressor import model, thesis_parameter_fit
from deboom.compressor.unbalance_load import RotationSense, unbalance_load
from deboom.errors import InputError
from deboom.measurement.compressor_test import CompressorMount
from deboom.physics.forced_response import amplitude_dependent_response, modal_superposition
from deboom.physics.rigid_body import (
    forward_matrix,
    mass_matrix,
    mount_stiffness_matrix,
    rotation_matrix,
)

EXACT = 1e-10
LINES = np.arange(10.0, 150.5, 0.5)
OMEGA = 2 * np.pi * LINES

# thesis, tables 11 and 10, which is where table 11 starts from
STRUCK = true_compressor(CompressorPlan(CompressorCase.TABLE11), np.random.default_rng(1))
CENTRE, INERTIA = STRUCK.centre, STRUCK.inertia
TABLE_11_MM, TABLE_11_DEG = 1e3 * STRUCK.positions, np.rad2deg(STRUCK.rotations)
TABLE_11_N_MM = 1e-3 * STRUCK.stiffness
TABLE_10_MM = np.array([[-143.41, 0.10, 8.16], [-14.83, -67.94, 76.49], [-14.84, 67.09, 76.49]])
TABLE_10_DEG = np.array([[0.0, 0, 180], [0, 45, 90], [0, 135, 90]])
TABLE_10_N_MM = np.array([[23.0, 13, 13]] * 3)


def mounts_of(places, turns, stiffness):
    return tuple(map(CompressorMount, "123", 1e-3 * places, np.deg2rad(turns), 1e3 * stiffness))


GAIN = model.GainFactor(
    model.HyperbolicGain(1.85, 0.06, 2.2), model.HyperbolicGain(0.42, 0.15, 2.5)
)
MOUNTS = mounts_of(TABLE_11_MM, TABLE_11_DEG, TABLE_11_N_MM)
MODEL = model.CompressorModel(7.2, CENTRE, INERTIA, model.mounts_at_virtual_point(MOUNTS), GAIN)
SCALE = np.repeat([1.0, 0.055], 3)  # rotations as motions at the radius of gyration


@pytest.fixture
def rng():
    return np.random.default_rng(41)


# ------------------------------------------------------------------ 36-38: the rotor


def turning_masses(sense):
    """Load of two point masses on a shaft by the second derivative of their paths in time."""
    masses, radii = np.array([0.010, 0.006]), np.array([0.004, 0.007])
    arms, angles = np.array([0.05, -0.03]), np.array([0.3, 2.0])
    frequency, n = 31.0, 4096
    time = np.arange(n) / n / frequency
    phase = sense.value * 2 * np.pi * frequency * time[:, np.newaxis]
    phase = phase + sense.value * angles
    places = np.stack(
        [np.broadcast_to(arms, phase.shape), radii * np.cos(phase), radii * np.sin(phase)], axis=-1
    )
    spectrum = np.fft.fft(places, axis=0)
    rates = 2j * np.pi * frequency * np.fft.fftfreq(n, 1 / n)
    acceleration = np.fft.ifft(rates[:, np.newaxis, np.newaxis] ** 2 * spectrum, axis=0).real
    forces = -masses[:, np.newaxis] * acceleration
    # the shaft's axis carries the mean place of each mass, so levers are taken to the axis
    levers = np.stack([arms, 0 * arms, 0 * arms], axis=-1)
    load = np.concatenate([forces.sum(1), np.cross(levers, forces).sum(1)], axis=1)
    amplitude = 2 * np.fft.fft(load, axis=0)[1] / n
    return masses * radii * np.exp(1j * angles), arms, frequency, amplitude


@pytest.mark.parametrize("sense", list(RotationSense))
def test_eq_36_load_of_turning_masses(sense):
    """Signs and phases that eq. 36 leaves open, in both senses of rotation."""
    static, arms, frequency, expected = turning_masses(sense)
    load = unbalance_load(static, arms, [frequency], sense)[0]
    assert deviation(load, expected) < EXACT
    other = RotationSense(-sense.value)
    assert deviation(unbalance_load(static, arms, [frequency], other)[0], expected) > 0.5
    squared = (2 * np.pi * frequency) ** 2
    turn = 1j * sense.value
    assert load[1] / squared == pytest.approx(turn * load[2] / squared)  # u from y and from z
    assert load[5] / squared == pytest.approx(load[4] / (turn * squared))  # u_d


def test_eq_37_sums_over_sources_with_their_arms():
    """u_d is arm times u per source: kg m²; a pure couple has no static unbalance."""
    couple = unbalance_load([2e-5, -2e-5], [0.04, -0.02], LINES)
    np.testing.assert_allclose(couple[:, :3], 0, atol=1e-18)
    np.testing.assert_allclose(couple[:, 5], 2e-5 * 0.06 * OMEGA**2, rtol=EXACT)
    with pytest.raises(InputError, match="give each its own"):
        unbalance_load([2e-5, 1e-5], [0.04], LINES)


def test_eq_38_gas_does_not_scale_with_the_square_of_speed():
    """A rotating gas force of 0.05 N passes as unbalance in y and z alike, most at low speed."""
    unbalance = 2e-5
    seen = (unbalance_load(unbalance, 0.0, LINES) + 0.05 * np.eye(6)[1] - 0.05j * np.eye(6)[2]) / (
        OMEGA**2
    )[:, np.newaxis]
    np.testing.assert_allclose(seen[:, 1], 1j * seen[:, 2], rtol=EXACT)
    error = np.abs(seen[:, 1] / unbalance - 1)
    assert error[LINES == 17.0][0] == pytest.approx(0.22, abs=0.005)
    assert error[LINES == 100.0][0] == pytest.approx(0.0063, abs=1e-4)


# ------------------------------------------------------------------ 39-51: mass and stiffness


def test_eq_42_43_moment_of_a_mount_is_r_cross_f(rng):
    motion = 1e-4 * rng.normal(size=6)
    mount = MOUNTS[1]
    axes = mount.orientation
    travel = motion[:3] + np.cross(motion[3:], mount.position)
    force = axes @ (mount.stiffness * (axes.T @ travel))
    load = model.mounts_at_virtual_point([mount]) @ motion
    assert deviation(load[:3], force) < EXACT
    assert deviation(load[3:], np.cross(mount.position, force)) < EXACT
    assert deviation(load[3:], np.cross(force, mount.position)) > 1


def test_eq_51_60_61_the_gain_carries_all_that_is_complex(rng):
    """jωC + K + jD = v K with K real: a K_c that is complex itself counts the loss twice."""
    stiffness = MODEL.stiffness
    viscous, hysteretic = 2e-4, 0.08
    gain = 1 + 1j * (OMEGA * viscous + hysteretic)
    line = 40
    assembled = 1j * OMEGA[line] * viscous * stiffness + stiffness + 1j * hysteretic * stiffness
    assert deviation(gain[line] * stiffness, assembled) < EXACT
    assert deviation(gain[line] * (1 + 1j * hysteretic) * stiffness, assembled) > 0.05
    gains = GAIN.at(LINES)[:, np.newaxis, np.newaxis]
    squared = OMEGA[:, np.newaxis, np.newaxis] ** 2
    apparent = MODEL.apparent_mass(LINES)
    assert deviation(apparent, MODEL.mass_matrix - gains * stiffness / squared) < EXACT
    motion = complex_normal(rng, 6)
    force = (-squared[line] * MODEL.mass_matrix + gains[line] * stiffness) @ motion
    assert deviation(MODEL.inertance(LINES)[line] @ force, -squared[line, 0] * motion) < EXACT


# ------------------------------------------------------------------ 52-61: the rubber


def test_eq_52_53_56_57_gain_over_frequency():
    """Rises to its limit; frequency in hertz, offset without unit; others are refused."""
    written = 1.85 - 1 / (0.06 * LINES + 2.2) + 1j * (0.42 - 1 / (0.15 * LINES + 2.5))
    assert deviation(GAIN.at(LINES), written) < EXACT
    with_omega = model.HyperbolicGain(1.85, 0.06 / (2 * np.pi), 2.2).at(OMEGA)
    assert deviation(with_omega, GAIN.real.at(LINES)) < EXACT
    assert deviation(GAIN.real.at(OMEGA), GAIN.real.at(LINES)) > 0.01  # ω put where f belongs
    for slope, offset in ((-0.06, 2.2), (0.06, -2.2)):
        with pytest.raises(InputError, match="give a number above 0"):
            model.HyperbolicGain(1.85, slope, offset)


def test_eq_52_to_57_three_scales_are_one():
    """v_rel, the scale of the gain and that of K: one number, seen as their product only."""
    scaled_gain = model.GainFactor(
        model.HyperbolicGain(1.85 * 1.3, 0.06 / 1.3, 2.2 / 1.3),
        model.HyperbolicGain(0.42 * 1.3, 0.15 / 1.3, 2.5 / 1.3),
    )
    np.testing.assert_allclose(scaled_gain.at(LINES), 1.3 * GAIN.at(LINES), rtol=EXACT)
    other = model.CompressorModel(7.2, CENTRE, INERTIA, MODEL.stiffness / 1.3, scaled_gain)
    assert deviation(other.apparent_mass(LINES), MODEL.apparent_mass(LINES)) < EXACT


def test_eq_53_causality_ties_loss_to_stiffening():
    """(π/2) dv'/d ln f, exact for v' = a ln f (the logarithm's own imaginary part is π/2)."""
    step = 1e-6
    slope = (GAIN.real.at(LINES * (1 + step)) - GAIN.real.at(LINES * (1 - step))) / (2 * step)
    np.testing.assert_allclose(GAIN.expected_loss(LINES), np.pi / 2 * slope, rtol=1e-8)
    at_20 = LINES == 20.0
    assert GAIN.expected_loss(LINES)[at_20][0] == pytest.approx(0.163, abs=0.002)
    assert GAIN.at(LINES).imag[at_20][0] == pytest.approx(0.238, abs=0.002)  # plausible, not equal


def test_eq_54_55_one_mount_meets_the_root_of_its_equation():
    """A body on one mount at its centre moves along its axial direction: one equation for s."""
    force = np.zeros((LINES.size, 6), dtype=complex)
    force[:, 0] = 3.0 * np.exp(0.4j)
    gain = GAIN.at(LINES)

    def factor(gain, stroke):
        real, imaginary = 0.8 + 1 / (3e4 * stroke + 4.0), 0.5 + 1 / (1e4 * stroke + 2.0)
        return gain.real * real + 1j * gain.imag * imaginary

    def stiffness(strokes):
        softened = factor(gain, np.linalg.norm(strokes, axis=1))
        return softened[:, np.newaxis, np.newaxis] * np.diag([3e4, 1e4, 1e4, 1.0, 1.0, 1.0])

    rows = forward_matrix(np.zeros(3))
    answer = amplitude_dependent_response(
        mass_matrix(7.2, INERTIA), stiffness, force, LINES, rows, tolerance=1e-11, relaxation=0.5
    )
    static = np.diag([3e4, 1e4, 1e4, 1.0, 1.0, 1.0])
    # v_s∞ + 1/(m_s s + s_0) with its drop 1/s_0 and its scale s_0/m_s
    real, imaginary = (
        model.HyperbolicAmplitude(limit, 1 / offset, offset / slope)
        for limit, slope, offset in ((0.8, 3e4, 4.0), (0.5, 1e4, 2.0))
    )
    mounts = model.MountsOverStroke(np.zeros((1, 3)), static[np.newaxis], real, imaginary)
    softening = model.CompressorModel(7.2, np.zeros(3), INERTIA, static, GAIN, mounts)
    modelled = softening.motion(force, LINES)
    struck = softening.inertance(LINES) @ force[:, :, np.newaxis]
    without = replace(softening, mounts=None).motion(force, LINES)
    assert deviation(-(OMEGA**2)[:, np.newaxis] * without, struck[:, :, 0]) < 1e-9
    with pytest.raises(InputError, match="leave the strokes out"):
        replace(softening, mounts=None).apparent_mass(LINES, np.full((LINES.size, 1), 1e-5))
    for line in range(0, LINES.size, 20):

        def excess(log_stroke, gain=gain[line], line=line):
            stroke = np.exp(log_stroke)
            return abs(factor(gain, stroke) * 3e4 - OMEGA[line] ** 2 * 7.2) * stroke - 3.0

        root = np.exp(brentq(excess, np.log(1e-8), np.log(1.0), xtol=1e-14, rtol=1e-14))
        assert abs(answer.displacement[line, 0]) == pytest.approx(root, rel=1e-9)
        assert abs(modelled[line, 0]) == pytest.approx(root, rel=1e-7)


def test_eq_58_hysteretic_damping_has_no_time_domain():
    """One root of m s² + k (1 + jη) = 0 grows without end; none does with viscous damping."""
    m, k, loss = 7.2, 5e4, 0.1
    printed = np.roots([m, 0, k * (1 + 1j * loss)])
    assert printed.real.max() > 1
    viscous = np.roots([m, loss * np.sqrt(k * m), k])
    assert viscous.real.max() < 0


# ------------------------------------------------------------------ 62-75: modes


@pytest.fixture(scope="module")
def modes():
    squared, shapes = eigh(MODEL.stiffness, MODEL.mass_matrix)
    return squared, shapes


LINE = 24


def test_eq_62_to_75_the_printed_forms_fail(rng, modes):
    """Motion s = Ψ (S ∘ Ψᵀ f) with ΨᵀMΨ = I, and what the printed equations make of it."""
    squared, shapes = modes
    force, gain, omega = complex_normal(rng, 6), GAIN.at(LINES)[LINE], OMEGA[LINE]
    line = slice(LINE, LINE + 1)
    motion = modal_superposition(
        MODEL.mass_matrix, MODEL.stiffness, GAIN.at(LINES)[line], force[np.newaxis], LINES[line]
    )[0]
    impedance = gain * MODEL.stiffness - omega**2 * MODEL.mass_matrix
    assert deviation(motion, np.linalg.solve(impedance, force)) < EXACT
    modal, load = shapes.T @ impedance @ shapes, shapes.T @ force  # eq. 73
    off_diagonal = modal - np.diag(np.diag(modal))
    assert np.abs(off_diagonal).max() < EXACT * np.abs(modal).max()
    per_mode = 1 / (gain * squared - omega**2)
    resonance, loss = gain.real * squared - omega**2, gain.imag * squared
    size = resonance**2 + loss**2
    unit = shapes / np.linalg.norm(shapes, axis=0)
    mass = np.diag(unit.T @ MODEL.mass_matrix @ unit)  # of shapes of unit length
    stiffness = np.diag(unit.T @ MODEL.stiffness @ unit)
    per_unit = 1 / (gain * stiffness - omega**2 * mass)
    back = np.linalg.inv(shapes)
    parts = per_mode.real * load.imag + per_mode.imag * load.real
    for right in (
        shapes @ np.linalg.solve(modal, load),  # eq. 63
        shapes @ (per_mode * load),  # eq. 64, 74
        unit @ (per_unit * (unit.T @ force)),  # eq. 66 to 68
        shapes @ ((resonance / size - 1j * loss / size) * load),  # eq. 69
        np.einsum("ir,kr,r,k->i", shapes, shapes, per_mode, force),  # eq. 70, 71
        motion.real + 1j * (shapes @ parts),  # eq. 75
    ):
        assert deviation(right, motion) < EXACT
    for printed in (
        np.linalg.solve(modal @ shapes, shapes @ force),  # eq. 62: Ψ s and Ψ f
        back @ (per_mode * (shapes @ force)),  # eq. 65
        unit @ (per_mode * (unit.T @ force)),  # eq. 66 to 68 without modal mass
        np.einsum("ri,rk,r,k->i", shapes, shapes, per_mode, force),  # eq. 70, 71
        (shapes @ per_mode) * load,  # eq. 72
        motion.real + 1j * (shapes @ (2 * per_mode.real * load.imag)),  # eq. 75
    ):
        assert deviation(printed, motion) > 0.1
    assert deviation(back, shapes.T @ MODEL.mass_matrix) < EXACT
    assert deviation(shapes.T, back) > 0.1


def test_modal_superposition_is_the_direct_solution_of_a_common_gain():
    """All six loads, all lines, against the inertance of the model."""
    gains = GAIN.at(LINES)
    for number in range(6):
        force = np.zeros((LINES.size, 6))
        force[:, number] = 1
        motion = modal_superposition(MODEL.mass_matrix, MODEL.stiffness, gains, force, LINES)
        direct = MODEL.inertance(LINES)[:, :, number]
        assert deviation(-(OMEGA[:, np.newaxis] ** 2) * motion, direct) < EXACT


@pytest.mark.parametrize(
    ("factors", "near_modes", "mass_line"),
    [
        ([[1.2, 1, 1]] * 3, 0.08, 0.002),  # axial gain 1.2 times the radial one
        ([[0.85] * 3, [1.0] * 3, [1.15] * 3], 0.47, 0.005),  # mounts 15 % apart, by amplitude
    ],
    ids=["axial", "per mount"],
)
def test_modal_superposition_fails_without_a_common_gain(factors, near_modes, mass_line, modes):
    """How far static modes with their own modal stiffness are off, worst line of each band."""
    shapes = modes[1]
    static = 1e3 * TABLE_11_N_MM * np.array(factors)
    unequal = mount_stiffness_matrix(
        1e-3 * TABLE_11_MM, static, rotation_matrix(np.deg2rad(TABLE_11_DEG))
    )
    stiffness = GAIN.at(LINES)[:, np.newaxis, np.newaxis] * unequal
    direct = np.linalg.inv(stiffness - OMEGA[:, np.newaxis, np.newaxis] ** 2 * MODEL.mass_matrix)
    modal = np.einsum("ir,fij,jr->fr", shapes, stiffness, shapes)
    by_modes = np.einsum("ir,fr,jr->fij", shapes, 1 / (modal - OMEGA[:, np.newaxis] ** 2), shapes)
    weight = np.outer(SCALE, SCALE)
    error = np.linalg.norm(weight * (by_modes - direct), axis=(1, 2))
    error /= np.linalg.norm(weight * direct, axis=(1, 2))
    assert error[LINES <= 30].max() == pytest.approx(near_modes, rel=0.1)
    assert error[LINES >= 100].max() == pytest.approx(mass_line, rel=0.3)


# ------------------------------------------------------------------ tables and bounds


def test_natural_frequencies_of_table_11_and_table_10():
    """Six modes in 10-30 Hz, by the thesis; the values are those of an independent program."""
    table = model.modal_table(MODEL)
    np.testing.assert_allclose(table.frequency, [10.1, 11.0, 17.2, 21.4, 28.4, 30.0], atol=0.06)
    start = model.CompressorModel(
        6.8,
        np.zeros(3),
        np.diag([0.015, 0.030, 0.029]),
        model.mounts_at_virtual_point(mounts_of(TABLE_10_MM, TABLE_10_DEG, TABLE_10_N_MM)),
        GAIN,
    )
    modes = model.modal_table(start).frequency
    assert 9 < modes[0] < modes[-1] < 31  # with the drawing's values as well


def test_table_11_leaves_the_bounds_that_the_thesis_states():
    """0.25 N/mm and even 25 % are left; the bounds used hold table 11."""
    change = np.abs(TABLE_11_N_MM - TABLE_10_N_MM)
    assert change[:, 0].min() > 6
    assert np.all(change[:, 0] / TABLE_10_N_MM[:, 0] > 0.25)
    assert np.all(change / TABLE_10_N_MM <= thesis_parameter_fit.STIFFNESS_BOUND)
    moved = np.abs(TABLE_11_MM - TABLE_10_MM)
    assert moved.max() == pytest.approx(12.51)  # at the bound of 12.5 mm
    assert np.all(1e-3 * moved <= thesis_parameter_fit.POSITION_BOUND)
    turned = np.deg2rad(np.abs(TABLE_11_DEG - TABLE_10_DEG))
    assert np.all(turned <= thesis_parameter_fit.ROTATION_BOUND + 1e-12)


def test_inertia_of_300_is_kg_cm2():
    """A condition number of 450 belongs to 6.8-7.2 kg and 151-160 kg cm²; kg m² are absurd."""
    for mass in (6.8, 7.2):
        assert 0.015 < mass / 450 < 0.0161
        gyration = np.sqrt(300e-4 / mass)
        assert 0.05 < gyration < 0.08  # a body of a hand's size
        assert np.sqrt(300 / mass) > 6  # metres, if it were kg m²
    assert (
        2.5e-4 < thesis_parameter_fit.PRODUCT_BOUND < 0.1 * 300e-4
    )  # products of 2.5 kg cm² fit inside
    with pytest.raises(InputError, match="no body has the principal moments"):
        model.CompressorModel(7.2, CENTRE, np.diag([0.01, 0.02, 0.04]), MODEL.stiffness, GAIN)
