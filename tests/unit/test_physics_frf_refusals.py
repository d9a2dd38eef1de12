"""What spectra, estimators, windows and errors refuse, in words."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.cross_spectra import (
    CrossSpectra,
    cross_spectra,
    effective_averages,
    overlapping_blocks,
)
from deboom.physics.frf_estimators import coherence, h1, h2, hv, multiple_coherence
from deboom.physics.frf_random_error import coherence_bias, magnitude_error, phase_error
from deboom.physics.impact_windows import (
    corrected_damping_ratio,
    corrected_pole,
    exponential_window,
    force_window,
)

BLOCKS = np.random.default_rng(1).normal(size=(4, 8, 3))


def spectra(n_input=1, n_block=4):
    return cross_spectra(BLOCKS[:n_block, :, :n_input], BLOCKS[:n_block, :, n_input:], 8.0)


@pytest.mark.parametrize(
    ("inputs", "outputs", "rate", "words"),
    [
        (BLOCKS[0], BLOCKS, 8.0, "input blocks have shape"),
        (BLOCKS, BLOCKS[:2], 8.0, "differ in number or length"),
        (BLOCKS, BLOCKS[:, :7], 8.0, "differ in number or length"),
        (BLOCKS[:, :1], BLOCKS[:, :1], 8.0, "at least two samples"),
        (BLOCKS, BLOCKS, 0.0, "is not positive"),
        (BLOCKS, np.where(BLOCKS[2, 3, 1] == BLOCKS, np.nan, BLOCKS), 8.0, "output 2 of block 3"),
    ],
)
def test_blocks(inputs, outputs, rate, words):
    with pytest.raises(InputError, match=words):
        cross_spectra(inputs, outputs, rate)


def test_windows_of_blocks():
    for window in (np.ones(7), np.zeros(8), np.full(8, np.nan)):
        with pytest.raises(InputError, match="as many finite values, not all 0"):
            cross_spectra(BLOCKS, BLOCKS, 8.0, input_window=window)
    with pytest.raises(InputError, match="do not fit a record"):
        overlapping_blocks(BLOCKS[0], 9, 1)
    for step in (0, 5):
        with pytest.raises(InputError, match="start 1 to 4 apart"):
            overlapping_blocks(BLOCKS[0], 4, step)
    with pytest.raises(InputError, match="average nothing"):
        effective_averages(np.ones(8), 4, 0)


def test_shapes_of_spectra():
    one = np.ones((2, 1, 1))
    with pytest.raises(InputError, match="at least one average"):
        CrossSpectra(np.arange(2), one, one, one, 0)
    with pytest.raises(InputError, match="input_auto has shape"):
        CrossSpectra(np.arange(2), np.ones((2, 2, 2)), one, one, 3)


def test_one_average_has_no_coherence():
    for judge in (coherence, multiple_coherence):
        with pytest.raises(InputError, match=r"1 average.*is 1 whatever was measured"):
            judge(spectra(n_block=1))
    with pytest.raises(InputError, match=r"coherence of 2 input.* over 2 average"):
        multiple_coherence(spectra(2, 2))


def test_estimators():
    with pytest.raises(InputError, match="at least as many averages, not 1"):
        h1(spectra(2, 1))
    with pytest.raises(InputError, match="H2 of 2 inputs needs as many outputs, not 1"):
        h2(spectra(2))
    with pytest.raises(InputError, match="noise ratio is positive"):
        hv(spectra(), 0.0)
    silent = cross_spectra(0 * BLOCKS[..., :1], BLOCKS, 8.0)
    with pytest.raises(InputError, match="no input at 0 Hz in channel 1"):
        h1(silent)
    with pytest.raises(InputError, match="nothing in common with the input at 0 Hz"):
        h2(silent)
    with pytest.raises(InputError, match="no output at 0 Hz in channel 1"):
        hv(cross_spectra(BLOCKS, 0 * BLOCKS, 8.0))
    np.testing.assert_array_equal(coherence(silent), 0)
    apart = CrossSpectra([1.0], [[[1.0]]], [[[0.0]]], [[[2.0]]], 3)
    with pytest.raises(InputError, match="output 1 has nothing in common"):
        hv(apart, 0.5)


def test_outputs_that_depend_on_each_other():
    same = cross_spectra(BLOCKS[..., :2], np.repeat(BLOCKS[..., 2:], 2, axis=2), 8.0)
    with pytest.raises(InputError, match="the outputs depend on each other"):
        h2(same)


def test_errors():
    for wrong in (-0.1, 1.1, np.nan):
        with pytest.raises(InputError, match="a coherence is from 0 to 1"):
            magnitude_error(wrong, 5)
    with pytest.raises(InputError, match="no random error that could be told"):
        magnitude_error(0.5, 2, 2)
    with pytest.raises(InputError, match="average more"):
        coherence_bias(0.5, 1)
    assert magnitude_error(0.0, 5) == np.inf
    assert magnitude_error(1.0, 5) == 0
    # a phase that can be anything: evenly over a turn
    assert phase_error(0.0, 5) == pytest.approx(np.pi / np.sqrt(3))


def test_impact_windows():
    with pytest.raises(InputError, match="holds no sample"):
        force_window(8, 8.0, 2.0, 3.0)
    with pytest.raises(InputError, match="taper of -1"):
        force_window(8, 8.0, 0.0, 1.0, -1.0)
    np.testing.assert_array_equal(force_window(8, 8.0, 0.25, 0.5), [0, 0, 1, 1, 1, 0, 0, 0])
    np.testing.assert_allclose(
        force_window(8, 8.0, 0.25, 0.5, 0.25), [0, 0.5, 1, 1, 1, 0.5, 0, 0], atol=1e-15
    )
    for call in (
        lambda: exponential_window(8, 8.0, 0.0),
        lambda: corrected_pole(-1 + 9j, 0.0),
        lambda: corrected_damping_ratio(0.1, 5.0, -1.0),
    ):
        with pytest.raises(InputError, match="time constant of an exponential window is positive"):
            call()
    with pytest.raises(InputError, match="decays more slowly than the exponential window"):
        corrected_pole([-20 + 300j, -5 + 100j], 0.1)
