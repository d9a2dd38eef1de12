"""FRF estimates and correlation against an analyser, closed forms and the thesis."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from deboom.errors import InputError
from deboom.measurement.impact_test import ForceWindow, HammerOptions, hammer_frf
from deboom.physics import frf
from deboom.physics.frf import phase_error
from deboom.physics.sound_level import mean_level, spl, splv
from samples.struck_mass import DAMPING, NATURAL, POLES, fitted_pole, inertance, measured

DATA = Path(__file__).parents[1] / "data" / "vibrationtesting-analyzer"
BAND = slice(5, 1600)
"""Without what the analyzer's AC coupling does to the first lines."""


@pytest.fixture(scope="module", params=["case1", "case2"])
def export(request):
    with np.load(DATA / f"{request.param}.npz", allow_pickle=False) as file:
        return {name: np.asarray(file[name], dtype=file[name].dtype) for name in file.files}


def spectra(export, line_spacing):
    cross = export["Hf_Cross_Spec_chan_2"][:, np.newaxis, np.newaxis]
    auto = [
        export[f"PSD_chan_{i}"].astype(float)[:, np.newaxis, np.newaxis] * line_spacing
        for i in (1, 2)
    ]
    lines = export["Freq_domain"].astype(float)
    # the number of averages is not exported; two are enough to have a coherence
    return frf.CrossSpectra(lines, auto[0], cross, auto[1], 2)


def test_h1_of_the_analyzer(export):
    estimated = frf.h1(spectra(export, float(export["PSD_DeltaF"])))[BAND, 0, 0]
    assert np.abs(estimated / export["Hf_chan_2"][BAND] - 1).max() < 1e-6


def test_coherence_of_the_analyzer(export):
    measured = spectra(export, float(export["PSD_DeltaF"]))
    possible = (export["Hf_coh_chan_2"] <= 1) & (np.arange(1601) >= 5) & (np.arange(1601) < 1600)
    assert possible.sum() >= 1591
    coherence = frf.coherence(measured.on_lines(possible))[:, 0, 0]
    assert np.abs(coherence - export["Hf_coh_chan_2"][possible]).max() < 1e-6


def test_the_analyzer_prints_coherences_above_1():
    """Up to 1.05 in case 1: its auto and cross spectra are not of one average. Named, not cut."""
    with np.load(DATA / "case1.npz", allow_pickle=False) as file:
        export = dict(file)
    above = np.flatnonzero(export["Hf_coh_chan_2"] > 1)
    assert list(above) == [0, 11, 13, 28, 57]
    measured = spectra(export, float(export["PSD_DeltaF"]))
    line = measured.frequency[11]
    with pytest.raises(InputError, match=f"at {line:g} Hz is above 1: auto and cross spectra"):
        frf.coherence(measured.on_lines(np.arange(1601) >= 5))
    identity = np.abs(measured.output_input) ** 2 / (measured.input_auto * measured.output_auto)
    np.testing.assert_allclose(identity[above, 0, 0].real, export["Hf_coh_chan_2"][above], 1e-6)


def test_the_trap_of_the_line_spacing(export):
    """Density taken for power: H1 errs by 1/df = 3.2, coherence by 1/df² = 10.24."""
    assert float(export["PSD_DeltaF"]) == 0.3125
    mixed = spectra(export, 1.0)
    wrong = frf.h1(mixed)[BAND, 0, 0]
    assert np.abs(wrong / export["Hf_chan_2"][BAND] * 3.2 - 1).max() < 1e-6
    claimed = np.abs(mixed.output_input) ** 2 / (mixed.input_auto * mixed.output_auto)
    true = export["Hf_coh_chan_2"][BAND]
    assert np.abs(claimed[BAND, 0, 0].real * 10.24 / true - 1).max() < 1e-5


def test_one_kind_of_spectrum_cannot_fall_into_it(export):
    """From time data, H1 is the same in both scalings, and each keeps the power or energy."""
    first, second = (export[f"Time_chan_{i}"].astype(float) for i in (1, 2))
    first, second = (x.reshape(4, 1024)[:, :, np.newaxis] for x in (first, second))
    rate = float(export["Time_Sample_Rate"])
    each = {s: frf.cross_spectra(first, second, rate, scaling=s) for s in frf.SpectrumScaling}
    density = each[frf.SpectrumScaling.POWER_DENSITY]
    for other in each.values():
        np.testing.assert_allclose(frf.h1(other)[1:], frf.h1(density)[1:], rtol=1e-10)
    # Parseval: the sum over the lines is the mean square of the record, and its energy
    assert density.input_power.sum() * rate / 1024 == pytest.approx(np.mean(first**2), rel=1e-12)
    energy = each[frf.SpectrumScaling.ENERGY_DENSITY].input_power.sum() * rate / 1024
    assert energy == pytest.approx(np.mean(first**2) * 1024 / rate, rel=1e-12)


def test_h2_and_hv_follow_from_the_coherence(export):
    """H1/H2 = γ², and Hv lies in the geometric middle, with one phase."""
    measured = spectra(export, float(export["PSD_DeltaF"]))
    gamma2 = export["Hf_coh_chan_2"][BAND, np.newaxis, np.newaxis].astype(float)
    part = measured.on_lines(np.arange(len(measured.frequency)) >= 5).on_lines(
        np.arange(1596) < 1595
    )
    np.testing.assert_allclose(frf.h1(part) / frf.h2(part), gamma2, rtol=2e-5)
    np.testing.assert_allclose(frf.hv(part), frf.h1(part) / np.sqrt(gamma2), rtol=2e-5)


TRUTH = np.array([[2.0 + 1j, -0.5 + 0.2j], [0.3j, 1.5], [-1.0 + 0.4j, 0.7 - 0.9j]])
AUTO = np.array([[2.0, 0.6 - 0.9j], [0.6 + 0.9j, 1.5]])
"""Two inputs that have something in common: coherence 0.39."""


def exact(truth, auto, input_noise=0.0, output_noise=0.0):
    """Spectra of infinitely many averages, with independent noise of stated power."""
    truth, auto = np.atleast_2d(truth), np.atleast_2d(auto)
    n_output, n_input = truth.shape
    return frf.CrossSpectra(
        np.array([10.0]),
        (auto + input_noise * np.eye(n_input))[np.newaxis],
        (truth @ auto)[np.newaxis],
        (truth @ auto @ truth.conj().T + output_noise * np.eye(n_output))[np.newaxis],
        1000,
    )


def test_h1_is_right_with_noise_in_the_outputs():
    noisy = exact(TRUTH, AUTO, output_noise=0.7)
    np.testing.assert_allclose(frf.h1(noisy)[0], TRUTH, atol=1e-12)
    assert np.abs(frf.h2(exact(TRUTH[:2], AUTO, output_noise=0.7))[0] - TRUTH[:2]).max() > 0.1


def test_h2_is_right_with_noise_in_the_inputs():
    noisy = exact(TRUTH[:2], AUTO, input_noise=0.4)
    np.testing.assert_allclose(frf.h2(noisy)[0], TRUTH[:2], atol=1e-12)
    assert np.abs(frf.h1(noisy)[0] - TRUTH[:2]).max() > 0.1


def test_bias_of_one_input():
    """H1 too small by S/(S + N), H2 too large by (S + N)/S, and 1/γ² between them."""
    noisy = exact(2.0 - 1j, 3.0, input_noise=0.3, output_noise=1.5)
    assert frf.h1(noisy)[0, 0, 0] == pytest.approx((2 - 1j) * 3 / 3.3)
    assert frf.h2(noisy)[0, 0, 0] == pytest.approx((2 - 1j) * 16.5 / 15)
    gamma2 = frf.coherence(noisy)[0, 0, 0]
    assert gamma2 == pytest.approx(225 * 3 / 15 / (3.3 * 16.5))
    assert frf.h1(noisy)[0, 0, 0] / frf.h2(noisy)[0, 0, 0] == pytest.approx(gamma2)


def test_hv_is_right_with_noise_in_the_stated_ratio():
    noisy = exact(TRUTH, AUTO, input_noise=0.2, output_noise=0.2 * 1.7**2)
    np.testing.assert_allclose(frf.hv(noisy, 1.7)[0], TRUTH, atol=1e-12)
    assert np.abs(frf.hv(noisy, 17.0)[0] - TRUTH).max() > 0.02
    np.testing.assert_allclose(frf.hv(noisy, 1e6)[0], frf.h1(noisy)[0], rtol=1e-6)
    # the same share of noise in both: the default, right without a word
    same = exact(2.0 - 1j, 3.0, input_noise=0.3, output_noise=1.5)
    assert frf.hv(same)[0, 0, 0] == pytest.approx(2 - 1j)
    assert frf.hv(same)[0, 0, 0] == pytest.approx(np.sqrt(frf.h1(same) * frf.h2(same))[0, 0, 0])


def test_coherences_of_two_inputs():
    """Given the other input, ``|h|² g / (|h|² g + N)``: g is what the other does not explain."""
    noise = 0.8
    noisy = exact(TRUTH, AUTO, output_noise=noise)
    share = np.real(np.einsum("oi,ij,oj->o", TRUTH, AUTO, TRUTH.conj()))
    np.testing.assert_allclose(frf.multiple_coherence(noisy)[0], share / (share + noise))
    left = np.real(np.linalg.det(AUTO)) / np.diag(AUTO)[::-1].real
    alone = np.abs(TRUTH) ** 2 * left
    np.testing.assert_allclose(frf.partial_coherence(noisy)[0], alone / (alone + noise))
    # the ordinary one also counts what reached the output through the other input
    assert frf.coherence(noisy)[0, 1, 0] > 3 * frf.partial_coherence(noisy)[0, 1, 0]
    single = exact(TRUTH[:, :1], 2.0, output_noise=noise)
    np.testing.assert_allclose(frf.partial_coherence(single), frf.coherence(single))
    np.testing.assert_allclose(frf.multiple_coherence(single), frf.coherence(single)[:, :, 0])


def test_an_input_without_effect_has_no_partial_coherence():
    truth = np.array([[1.0, 0.0]])
    noisy = exact(truth, AUTO, output_noise=0.5)
    assert frf.partial_coherence(noisy)[0, 0, 1] == pytest.approx(0, abs=1e-12)
    assert frf.coherence(noisy)[0, 0, 1] > 0.2
    assert frf.coherence(frf.CrossSpectra([1.0], [[[0.0]]], [[[0.0]]], [[[2.0]]], 3)) == 0


def test_scaling_against_scipy():
    generator = np.random.default_rng(3)
    record = generator.normal(size=(4000, 2))
    window = scipy.signal.windows.hann(512, sym=False)
    blocks = frf.overlapping_blocks(record, 512, 128)
    spectra_of_blocks = frf.cross_spectra(
        blocks[..., :1], blocks[..., 1:], 800.0, input_window=window, output_window=window
    )
    keywords = {"fs": 800.0, "window": "hann", "nperseg": 512, "noverlap": 384, "detrend": False}
    frequency, density = scipy.signal.welch(record[:, 1], **keywords)
    np.testing.assert_allclose(spectra_of_blocks.frequency, frequency)
    np.testing.assert_allclose(spectra_of_blocks.output_power[:, 0], density, rtol=1e-10)
    # scipy conjugates the first argument, as Bendat and Piersol do
    _, cross = scipy.signal.csd(record[:, 0], record[:, 1], **keywords)
    np.testing.assert_allclose(spectra_of_blocks.output_input[:, 0, 0], cross, rtol=1e-9)
    _, gamma2 = scipy.signal.coherence(record[:, 0], record[:, 1], **keywords)
    np.testing.assert_allclose(frf.coherence(spectra_of_blocks)[:, 0, 0], gamma2, rtol=1e-9)


def repeated(generator, n_average, gamma2, n_line=6000):
    """H1, coherence of n_line independent lines; the truth is 1."""
    shape = (n_line, n_average)
    draw = generator.normal(size=(2, *shape)) + 1j * generator.normal(size=(2, *shape))
    x, y = draw[0], draw[0] + draw[1] * np.sqrt(1 / gamma2 - 1)
    spectra = frf.CrossSpectra(
        np.arange(1.0, n_line + 1),
        np.mean(np.abs(x) ** 2, axis=1)[:, np.newaxis, np.newaxis],
        np.mean(y * x.conj(), axis=1)[:, np.newaxis, np.newaxis],
        np.mean(np.abs(y) ** 2, axis=1)[:, np.newaxis, np.newaxis],
        n_average,
    )
    return frf.h1(spectra)[:, 0, 0], frf.coherence(spectra)[:, 0, 0]


@pytest.mark.parametrize(("n_average", "gamma2"), [(32, 0.5), (16, 0.8), (4, 0.95), (64, 0.3)])
def test_random_error_against_repetition(n_average, gamma2):
    repeated_error, estimated = repeated(np.random.default_rng(n_average), n_average, gamma2)
    assert np.abs(repeated_error).std() == pytest.approx(
        frf.magnitude_error(gamma2, n_average), rel=0.06
    )
    assert np.angle(repeated_error).std() == pytest.approx(
        frf.phase_error(gamma2, n_average), rel=0.06
    )
    # and read from the measured coherence, as one has to
    stated = np.sqrt(np.mean(frf.magnitude_error(estimated, n_average) ** 2))
    assert stated == pytest.approx(frf.magnitude_error(gamma2, n_average), rel=0.06)
    bias = estimated.mean() - gamma2
    assert bias == pytest.approx(frf.coherence_bias(gamma2, n_average), abs=0.004)
    # a phase that can be anything: evenly over a turn
    assert (frf.magnitude_error(0.0, 5), frf.magnitude_error(1.0, 5)) == (np.inf, 0)
    assert frf.phase_error(0.0, 5) == pytest.approx(np.pi / np.sqrt(3))


def test_random_error_of_two_inputs_against_repetition():
    """Partial coherence, and each input takes an average."""
    generator = np.random.default_rng(5)
    n_average, n_line = 12, 6000
    mixing = np.linalg.cholesky(AUTO)
    draw = generator.normal(size=(3, n_line, n_average)) + 1j * generator.normal(
        size=(3, n_line, n_average)
    )
    x = np.einsum("ij,jfn->fin", mixing, draw[:2]) / np.sqrt(2)
    y = np.einsum("oi,fin->fon", TRUTH[:1], x) + 0.5 * draw[2][:, np.newaxis]
    spectra = frf.CrossSpectra(
        np.arange(1.0, n_line + 1),
        x @ np.conj(np.swapaxes(x, 1, 2)) / n_average,
        y @ np.conj(np.swapaxes(x, 1, 2)) / n_average,
        y @ np.conj(np.swapaxes(y, 1, 2)) / n_average,
        n_average,
    )
    true = frf.partial_coherence(exact(TRUTH[:1], AUTO, output_noise=0.5))[0, 0]
    scatter = np.abs(frf.h1(spectra)[:, 0]).std(axis=0) / np.abs(TRUTH[0])
    np.testing.assert_allclose(scatter, frf.magnitude_error(true, n_average, 2), rtol=0.05)


def test_blocks_that_overlap_count_for_less():
    """Welch: variance of the auto spectrum of white noise over 1/n."""
    window = scipy.signal.windows.hann(64, sym=False)
    assert frf.effective_averages(window, 32, 1000) / 1000 == pytest.approx(0.947, abs=1e-3)
    assert frf.effective_averages(np.ones(64), 64, 7) == 7
    # two blocks that share half of a flat window: 1 + 2 (1 - 1/2) (1/2)² = 5/4
    assert frf.effective_averages(np.ones(4), 2, 2) == pytest.approx(2 / 1.25)
    record = np.random.default_rng(7).normal(size=(64 * 9, 3000))
    for step in (16, 32):
        powers = np.stack(
            [
                np.abs(np.fft.rfft(window[:, np.newaxis] * record[i : i + 64], axis=0)[8:24:4]) ** 2
                for i in range(0, 64 * 8 + 1, step)
            ]
        )
        mean = powers.mean(axis=0)
        worth = np.mean(mean, axis=1) ** 2 / np.var(mean, axis=1)
        expected = frf.effective_averages(window, step, len(powers))
        assert np.mean(worth) == pytest.approx(expected, rel=0.06)


BAND_3 = (10.0, 150.0)


def test_inertance_with_its_sign():
    """τ of the body is 0.2 s: after 2 s nothing is left but e⁻⁹ of it."""
    estimate = hammer_frf(measured(), HammerOptions(band=BAND_3))
    s = 2j * np.pi * estimate.frequency
    inertances, truth = estimate.values[:, 0, 0], inertance(s)
    assert np.abs(inertances - truth).max() < 3e-4 * np.abs(truth).max()
    # e^{+jωt}: at resonance the acceleration leads the force by 90°, below it opposes it, above not
    assert inertances[np.argmin(np.abs(estimate.frequency - 37.0))].imag > 0
    assert inertances[np.argmin(np.abs(estimate.frequency - 15.0))].real < 0
    assert inertances[np.argmin(np.abs(estimate.frequency - 120.0))].real > 0
    assert estimate.frf.unit == "(m/s^2)/N"
    np.testing.assert_allclose(estimate.coherence, 1, atol=1e-12)


def test_exponential_window_moves_every_pole():
    """The windowed function is H(jω + 1/τ), to the aliasing of the push, and H(jω) not at all."""
    time_constant = 0.1
    options = HammerOptions(time_constant=time_constant, band=BAND_3)
    estimate = hammer_frf(measured(), options)
    assert estimate.added_decay_rate == 10.0
    s = 2j * np.pi * estimate.frequency
    inertances = estimate.values[:, 0, 0]
    largest = np.abs(inertance(s)).max()
    assert np.abs(inertances - inertance(s + 10.0)).max() < 5e-6 * largest
    assert np.abs(inertances - inertance(s)).max() > 0.5 * largest


def test_pole_and_damping_are_corrected_after_the_fit():
    estimate = hammer_frf(measured(), HammerOptions(time_constant=0.1, band=BAND_3))
    pole = fitted_pole(estimate.frequency, estimate.values[:, 0, 0])
    # three times the body's own damping
    assert -pole.real / abs(pole) > 3 * DAMPING
    assert abs(frf.corrected_pole(pole, 0.1) - POLES[0]) < 1e-5 * NATURAL
    frequency = abs(pole) / (2 * np.pi)
    damping = frf.corrected_damping_ratio(-pole.real / abs(pole), frequency, 0.1)
    assert damping == pytest.approx(DAMPING, rel=1e-3)
    # the first-order rule ζ − 1/(ωτ) is close, not exact
    assert -pole.real / abs(pole) - 1 / (abs(pole) * 0.1) == pytest.approx(DAMPING, rel=0.02)


def test_force_window_leaves_the_function_and_takes_the_noise():
    """2 s of block, 8 ms of push: the noise of the rest goes."""
    window = ForceWindow(before=0.001, after=0.006, taper=0.001)
    clean = hammer_frf(measured(), HammerOptions(band=BAND_3, force_window=window))
    s = 2j * np.pi * clean.frequency
    assert np.abs(clean.values[:, 0, 0] - inertance(s)).max() < 3e-4 * np.abs(inertance(s)).max()
    noisy = measured(n_hit=8, force_noise=1.0)
    error = {
        w: np.abs(
            hammer_frf(noisy, HammerOptions(band=BAND_3, force_window=w)).values[:, 0, 0]
            - inertance(s)
        ).max()
        for w in (None, window)
    }
    assert error[None] > 0.01 * np.abs(inertance(s)).max()
    assert error[window] < 0.1 * error[None]
    np.testing.assert_allclose(
        frf.force_window(8, 8.0, 0.25, 0.5, 0.25), [0, 0.5, 1, 1, 1, 0.5, 0, 0], atol=1e-15
    )
    np.testing.assert_array_equal(frf.force_window(8, 8.0, 0.25, 0.5), [0, 0, 1, 1, 1, 0, 0, 0])


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
    assert abs(frf.msf(factor * MEASURED, MEASURED) - factor) <= 1e-10 * magnitude
    assert abs(frf.corr_s(factor * MEASURED, MEASURED) - abs(1 - factor)) <= 1e-10 * (1 + magnitude)
    # MAC sees neither scale nor phase, of either curve
    alike = frf.mac(MEASURED, OTHER_CAR)
    assert 0 <= alike <= 1
    assert abs(frf.mac(factor * MEASURED, OTHER_CAR) - alike) <= 1e-10
    assert abs(frf.mac(MEASURED, factor * OTHER_CAR) - alike) <= 1e-10


def test_against_least_squares():
    """MSF is the least-squares factor and 1 − MAC its unexplained share; real unknowns only."""

    def split(curve):
        return np.concatenate([curve.real, curve.imag])

    columns = np.column_stack([split(OTHER_CAR), split(1j * OTHER_CAR)])
    (real, imaginary), residual, *_ = np.linalg.lstsq(columns, split(MEASURED))
    assert frf.msf(MEASURED, OTHER_CAR) == pytest.approx(real + 1j * imaginary, abs=1e-10)
    unexplained = residual[0] / np.sum(split(MEASURED) ** 2)
    assert frf.corr_f(MEASURED, OTHER_CAR) == pytest.approx(unexplained, abs=1e-10)
    # several channels are compared column by column
    pair = np.column_stack([MEASURED, OTHER_CAR]), np.column_stack([OTHER_CAR, OTHER_CAR])
    assert frf.corr_f(*pair) == pytest.approx([unexplained, 0.0], abs=1e-10)
    assert frf.msf(*pair) == pytest.approx([real + 1j * imaginary, 1.0], abs=1e-10)


def test_without_the_conjugate_the_factor_is_lost():
    """A published code forms aᵀb / bᵀb and keeps the real part; on a shape with phase it fails."""
    factor = 0.318 + 0.624j
    curve = factor * MEASURED
    assert abs((np.dot(curve, MEASURED) / np.dot(MEASURED, MEASURED)).real - factor) > 0.6
    assert frf.msf(curve, MEASURED) == pytest.approx(factor, abs=1e-10)
    # the scale of two different curves: a transpose in the place of the Hermitian transpose
    transposed = np.dot(OTHER_CAR, MEASURED) / np.dot(OTHER_CAR, OTHER_CAR)
    assert abs(transposed - frf.msf(MEASURED, OTHER_CAR)) > 0.1
    # a conjugate on the wrong side returns the conjugate of the factor
    wrong_side = np.vdot(curve, MEASURED) / np.vdot(MEASURED, MEASURED)
    assert wrong_side == pytest.approx(np.conj(factor), abs=1e-10)


def test_on_decibels_two_different_cars_look_alike():
    """The thesis does not say of what MAC is taken; dB curves hide most of the difference."""
    levels = spl(MEASURED, FREQUENCY), spl(OTHER_CAR, FREQUENCY)
    assert frf.corr_f(*levels) < 0.02
    assert frf.corr_f(MEASURED, OTHER_CAR) > 0.5
    assert frf.corr_f(abs(MEASURED), abs(OTHER_CAR)) > 0.1
    # and it depends on the unit: the same curves a thousand times as loud look more alike
    much_louder = spl(1e3 * MEASURED, FREQUENCY), spl(1e3 * OTHER_CAR, FREQUENCY)
    assert frf.corr_f(*much_louder) < 0.5 * frf.corr_f(*levels)


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


def test_a_phase_error_is_the_angle_and_not_its_sine():
    """Coherence 2/3 of two hits: half the magnitude by chance, so 30 degrees."""
    assert phase_error(2 / 3, 2) == pytest.approx(np.pi / 6, rel=1e-12)
