"""FRFs: forms, correlation and refusals."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.frf import (
    CrossSpectra,
    FrfForm,
    coherence,
    coherence_bias,
    convert,
    corr_f,
    corr_s,
    corrected_damping_ratio,
    corrected_pole,
    cross_spectra,
    effective_averages,
    exponential_window,
    force_window,
    h1,
    h2,
    hv,
    mac,
    magnitude_error,
    msf,
    multiple_coherence,
    overlapping_blocks,
    phase_error,
    scaled_condition_number,
)

FREQUENCY = np.array([15.0, 40.0, 140.0])


def _matrix(n_output=3, n_input=3):
    rng = np.random.default_rng(5)
    shape = (FREQUENCY.size, n_output, n_input)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def test_rectangular_functions_have_derivatives_but_no_inverse():
    values = _matrix(4, 3)
    assert convert(values, FREQUENCY, FrfForm.MOBILITY, FrfForm.INERTANCE).shape == (3, 4, 3)
    with pytest.raises(InputError, match="4 outputs by 3 inputs"):
        convert(values, FREQUENCY, FrfForm.MOBILITY, FrfForm.IMPEDANCE)


def test_a_singular_line_is_named():
    values = _matrix()
    values[1] = np.outer([1, 2, 3], [1j, 2, 3])
    with pytest.raises(InputError, match=r"first at 40.0 Hz \(rank 1 of 3\)"):
        convert(values, FREQUENCY, FrfForm.INERTANCE, FrfForm.APPARENT_MASS)


def test_zero_frequency_is_refused_only_where_it_divides():
    lines = np.array([0.0, 10.0, 20.0])
    inertance = convert(_matrix(), lines, FrfForm.RECEPTANCE, FrfForm.INERTANCE)
    np.testing.assert_array_equal(inertance[0], 0)
    with pytest.raises(InputError, match="0 Hz"):
        convert(_matrix(), lines, FrfForm.INERTANCE, FrfForm.RECEPTANCE)


@pytest.mark.parametrize("values", [np.ones(3), np.ones((3, 3)), np.ones((2, 3, 3))])
def test_shapes_that_do_not_fit_the_frequency_are_refused(values):
    with pytest.raises(InputError, match="n_frequency, n_output, n_input"):
        convert(values, FREQUENCY, FrfForm.RECEPTANCE, FrfForm.MOBILITY)


def test_scaled_condition_number_is_the_same_in_both_units_and_for_the_inverse():
    """Millimetres in place of metres change the plain number, the scaled one not."""
    metres = _matrix(6, 6)
    units = np.repeat([1.0, 1e3], 3)
    millimetres = metres / np.outer(units, units)
    scaled = scaled_condition_number(metres, FrfForm.INERTANCE, 0.055)
    assert scaled.shape == (3,)
    np.testing.assert_allclose(
        scaled_condition_number(millimetres, FrfForm.INERTANCE, 55.0), scaled, rtol=1e-9
    )
    assert np.all(np.linalg.cond(millimetres) > 100 * np.linalg.cond(metres))
    inverse = convert(metres, FREQUENCY, FrfForm.INERTANCE, FrfForm.APPARENT_MASS)
    np.testing.assert_allclose(
        scaled_condition_number(inverse, FrfForm.APPARENT_MASS, 0.055), scaled, rtol=1e-9
    )


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan])
def test_a_length_that_is_not_positive_is_refused(length):
    with pytest.raises(InputError, match="characteristic length"):
        scaled_condition_number(np.eye(6), FrfForm.APPARENT_MASS, length)


def test_condition_numbers_need_six_degrees_of_freedom():
    with pytest.raises(InputError, match="6×6"):
        scaled_condition_number(np.eye(3), FrfForm.INERTANCE, 0.1)


BLOCKS = np.random.default_rng(1).normal(size=(4, 8, 3))


def spectra(n_input=1, n_block=4):
    return cross_spectra(BLOCKS[:n_block, :, :n_input], BLOCKS[:n_block, :, n_input:], 8.0)


@pytest.mark.parametrize(
    ("inputs", "outputs", "rate", "words"),
    [
        (BLOCKS[0], BLOCKS, 8.0, "input blocks: shape"),
        (BLOCKS, BLOCKS[:2], 8.0, "output blocks: shape"),
        (BLOCKS, BLOCKS[:, :7], 8.0, "output blocks: shape"),
        (BLOCKS[:, :1], BLOCKS[:, :1], 8.0, "at least two samples"),
        (BLOCKS, BLOCKS, 0.0, "is not positive"),
        (
            BLOCKS,
            np.where(BLOCKS[2, 3, 1] == BLOCKS, np.nan, BLOCKS),
            8.0,
            "output blocks: a number is not finite",
        ),
    ],
)
def test_blocks(inputs, outputs, rate, words):
    with pytest.raises(InputError, match=words):
        cross_spectra(inputs, outputs, rate)


def test_windows_of_blocks():
    for window in (np.ones(7), np.zeros(8), np.full(8, np.nan)):
        with pytest.raises(InputError, match="window"):
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
    with pytest.raises(InputError, match="output_input: shape"):
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


CURVES = np.random.default_rng(1).normal(size=(40, 3, 2)) @ np.array([1, 1j])


def test_curves_of_several_channels_are_compared_column_by_column():
    other = CURVES[:, ::-1]
    for function in (mac, msf, corr_f, corr_s):
        together = function(CURVES, other)
        one_by_one = [function(CURVES[:, i], other[:, i]) for i in range(3)]
        assert together.shape == (3,)
        np.testing.assert_allclose(together, one_by_one)


@pytest.mark.parametrize("function", [mac, msf, corr_f, corr_s])
def test_curves_that_cannot_be_compared_are_refused(function):
    with pytest.raises(InputError, match=r"\(40, 3\) and \(39, 3\) cannot be compared"):
        function(CURVES, CURVES[1:])
    with pytest.raises(InputError, match="cannot be compared"):
        function(1.0, 2.0)
    with pytest.raises(InputError, match="zero on all lines"):
        function(CURVES[:, 0], np.zeros(40))
    with pytest.raises(InputError, match="zero on all lines"):
        function(np.zeros(40), CURVES[:, 0])
