"""H1, H2, Hv and the coherences against spectra in closed form, and errors against repetition."""

import numpy as np
import pytest
import scipy.signal

from deboom.physics.cross_spectra import (
    CrossSpectra,
    cross_spectra,
    effective_averages,
    overlapping_blocks,
)
from deboom.physics.frf_estimators import (
    coherence,
    h1,
    h2,
    hv,
    multiple_coherence,
    partial_coherence,
)
from deboom.physics.frf_random_error import coherence_bias, magnitude_error, phase_error

TRUTH = np.array([[2.0 + 1j, -0.5 + 0.2j], [0.3j, 1.5], [-1.0 + 0.4j, 0.7 - 0.9j]])
AUTO = np.array([[2.0, 0.6 - 0.9j], [0.6 + 0.9j, 1.5]])
"""Two inputs that have something in common: coherence 0.39."""


def exact(truth, auto, input_noise=0.0, output_noise=0.0):
    """Spectra of infinitely many averages, with independent noise of stated power."""
    truth, auto = np.atleast_2d(truth), np.atleast_2d(auto)
    n_output, n_input = truth.shape
    return CrossSpectra(
        np.array([10.0]),
        (auto + input_noise * np.eye(n_input))[np.newaxis],
        (truth @ auto)[np.newaxis],
        (truth @ auto @ truth.conj().T + output_noise * np.eye(n_output))[np.newaxis],
        1000,
    )


def test_every_estimator_is_exact_without_noise():
    full = exact(TRUTH, AUTO)
    np.testing.assert_allclose(h1(full)[0], TRUTH, atol=1e-12)
    np.testing.assert_allclose(hv(full)[0], TRUTH, atol=1e-12)
    square = exact(TRUTH[:2], AUTO)
    np.testing.assert_allclose(h2(square)[0], TRUTH[:2], atol=1e-12)
    one = exact(TRUTH[:, :1], 2.0)
    for estimate in (h1, h2, hv):
        np.testing.assert_allclose(estimate(one)[0], TRUTH[:, :1], atol=1e-12)


def test_h1_is_right_with_noise_in_the_outputs():
    noisy = exact(TRUTH, AUTO, output_noise=0.7)
    np.testing.assert_allclose(h1(noisy)[0], TRUTH, atol=1e-12)
    assert np.abs(h2(exact(TRUTH[:2], AUTO, output_noise=0.7))[0] - TRUTH[:2]).max() > 0.1


def test_h2_is_right_with_noise_in_the_inputs():
    noisy = exact(TRUTH[:2], AUTO, input_noise=0.4)
    np.testing.assert_allclose(h2(noisy)[0], TRUTH[:2], atol=1e-12)
    assert np.abs(h1(noisy)[0] - TRUTH[:2]).max() > 0.1


def test_bias_of_one_input():
    """H1 too small by S/(S + N), H2 too large by (S + N)/S, and 1/γ² between them."""
    noisy = exact(2.0 - 1j, 3.0, input_noise=0.3, output_noise=1.5)
    assert h1(noisy)[0, 0, 0] == pytest.approx((2 - 1j) * 3 / 3.3)
    assert h2(noisy)[0, 0, 0] == pytest.approx((2 - 1j) * 16.5 / 15)
    gamma2 = coherence(noisy)[0, 0, 0]
    assert gamma2 == pytest.approx(225 * 3 / 15 / (3.3 * 16.5))
    assert h1(noisy)[0, 0, 0] / h2(noisy)[0, 0, 0] == pytest.approx(gamma2)


def test_hv_is_right_with_noise_in_the_stated_ratio():
    noisy = exact(TRUTH, AUTO, input_noise=0.2, output_noise=0.2 * 1.7**2)
    np.testing.assert_allclose(hv(noisy, 1.7)[0], TRUTH, atol=1e-12)
    assert np.abs(hv(noisy, 17.0)[0] - TRUTH).max() > 0.02
    np.testing.assert_allclose(hv(noisy, 1e6)[0], h1(noisy)[0], rtol=1e-6)
    # the same share of noise in both: the default, right without a word
    same = exact(2.0 - 1j, 3.0, input_noise=0.3, output_noise=1.5)
    assert hv(same)[0, 0, 0] == pytest.approx(2 - 1j)
    assert hv(same)[0, 0, 0] == pytest.approx(np.sqrt(h1(same) * h2(same))[0, 0, 0])


def test_coherences_of_two_inputs():
    """Given the other input, ``|h|² g / (|h|² g + N)``: g is what the other does not explain."""
    noise = 0.8
    noisy = exact(TRUTH, AUTO, output_noise=noise)
    share = np.real(np.einsum("oi,ij,oj->o", TRUTH, AUTO, TRUTH.conj()))
    np.testing.assert_allclose(multiple_coherence(noisy)[0], share / (share + noise))
    left = np.real(np.linalg.det(AUTO)) / np.diag(AUTO)[::-1].real
    alone = np.abs(TRUTH) ** 2 * left
    np.testing.assert_allclose(partial_coherence(noisy)[0], alone / (alone + noise))
    # the ordinary one also counts what reached the output through the other input
    assert coherence(noisy)[0, 1, 0] > 3 * partial_coherence(noisy)[0, 1, 0]
    one = exact(TRUTH[:, :1], 2.0, output_noise=noise)
    np.testing.assert_allclose(partial_coherence(one), coherence(one))
    np.testing.assert_allclose(multiple_coherence(one), coherence(one)[:, :, 0])


def test_an_input_without_effect_has_no_partial_coherence():
    truth = np.array([[1.0, 0.0]])
    noisy = exact(truth, AUTO, output_noise=0.5)
    assert partial_coherence(noisy)[0, 0, 1] == pytest.approx(0, abs=1e-12)
    assert coherence(noisy)[0, 0, 1] > 0.2


def test_scaling_against_scipy():
    generator = np.random.default_rng(3)
    record = generator.normal(size=(4000, 2))
    window = scipy.signal.windows.hann(512, sym=False)
    blocks = overlapping_blocks(record, 512, 128)
    found = cross_spectra(
        blocks[..., :1], blocks[..., 1:], 800.0, input_window=window, output_window=window
    )
    keywords = {"fs": 800.0, "window": "hann", "nperseg": 512, "noverlap": 384, "detrend": False}
    frequency, density = scipy.signal.welch(record[:, 1], **keywords)
    np.testing.assert_allclose(found.frequency, frequency)
    np.testing.assert_allclose(found.output_power[:, 0], density, rtol=1e-10)
    # scipy conjugates the first argument, as Bendat and Piersol do
    _, cross = scipy.signal.csd(record[:, 0], record[:, 1], **keywords)
    np.testing.assert_allclose(found.output_input[:, 0, 0], cross, rtol=1e-9)
    _, gamma2 = scipy.signal.coherence(record[:, 0], record[:, 1], **keywords)
    np.testing.assert_allclose(coherence(found)[:, 0, 0], gamma2, rtol=1e-9)


def repeated(generator, n_average, gamma2, n_line=6000):
    """H1, coherence of n_line independent lines; the truth is 1."""
    shape = (n_line, n_average)
    draw = generator.normal(size=(2, *shape)) + 1j * generator.normal(size=(2, *shape))
    x, y = draw[0], draw[0] + draw[1] * np.sqrt(1 / gamma2 - 1)
    spectra = CrossSpectra(
        np.arange(1.0, n_line + 1),
        np.mean(np.abs(x) ** 2, axis=1)[:, np.newaxis, np.newaxis],
        np.mean(y * x.conj(), axis=1)[:, np.newaxis, np.newaxis],
        np.mean(np.abs(y) ** 2, axis=1)[:, np.newaxis, np.newaxis],
        n_average,
    )
    return h1(spectra)[:, 0, 0], coherence(spectra)[:, 0, 0]


@pytest.mark.parametrize(("n_average", "gamma2"), [(32, 0.5), (16, 0.8), (4, 0.95), (64, 0.3)])
def test_random_error_against_repetition(n_average, gamma2):
    found, estimated = repeated(np.random.default_rng(n_average), n_average, gamma2)
    assert np.abs(found).std() == pytest.approx(magnitude_error(gamma2, n_average), rel=0.06)
    assert np.angle(found).std() == pytest.approx(phase_error(gamma2, n_average), rel=0.06)
    # and read from the measured coherence, as one has to
    stated = np.sqrt(np.mean(magnitude_error(estimated, n_average) ** 2))
    assert stated == pytest.approx(magnitude_error(gamma2, n_average), rel=0.06)
    bias = estimated.mean() - gamma2
    assert bias == pytest.approx(coherence_bias(gamma2, n_average), abs=0.004)


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
    spectra = CrossSpectra(
        np.arange(1.0, n_line + 1),
        x @ np.conj(np.swapaxes(x, 1, 2)) / n_average,
        y @ np.conj(np.swapaxes(x, 1, 2)) / n_average,
        y @ np.conj(np.swapaxes(y, 1, 2)) / n_average,
        n_average,
    )
    true = partial_coherence(exact(TRUTH[:1], AUTO, output_noise=0.5))[0, 0]
    scatter = np.abs(h1(spectra)[:, 0]).std(axis=0) / np.abs(TRUTH[0])
    np.testing.assert_allclose(scatter, magnitude_error(true, n_average, 2), rtol=0.05)


def test_blocks_that_overlap_count_for_less():
    """Welch: variance of the auto spectrum of white noise over 1/n."""
    window = scipy.signal.windows.hann(64, sym=False)
    assert effective_averages(window, 32, 1000) / 1000 == pytest.approx(0.947, abs=1e-3)
    assert effective_averages(np.ones(64), 64, 7) == 7
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
        expected = effective_averages(window, step, len(powers))
        assert np.mean(worth) == pytest.approx(expected, rel=0.06)
