"""Frequency response functions out of averaged spectra, and how much of the output they explain.

Which one to take is a question of where the noise is: H1 is right with noise in the outputs, H2
with noise in the inputs, Hv with both in a stated ratio. None is right where the noise of an input
is correlated with that of an output, or where the resolution is too coarse for a resonance.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics.cross_spectra import CrossSpectra

LARGEST_CONDITION = 1e10
"""Of spectra scaled to equal size; beyond it, channels are taken for dependent."""
SILENT = 1e-24
"""Of the power of the loudest line: 240 dB below it there is rounding and no signal."""
ROUNDING = 1e-6
"""By which a coherence may come out above 1."""


def h1(spectra: CrossSpectra) -> ComplexArray:
    """Frequency response functions for noise in the outputs, ``H = G_yx G_xx⁻¹``.

    Parameters
    ----------
    spectra : CrossSpectra
        Of one input or of several that acted together.

    Returns
    -------
    array, shape (n_frequency, n_output, n_input)
        [output unit / input unit].

    Raises
    ------
    InputError
        A line without input, fewer averages than inputs, or inputs that depend on each other.

    Notes
    -----
    Least squares over the averages (Bendat and Piersol, Random Data, 4th ed., eq. 6.37 and 7.26).
    Noise in an input, independent of all else, makes it too small: by S/(S + N) with one input.
    """
    return _solved(spectra.output_input, spectra)


def h2(spectra: CrossSpectra) -> ComplexArray:
    """Frequency response functions for noise in the inputs, ``H = G_yy G_xy⁻¹``.

    Parameters
    ----------
    spectra : CrossSpectra
        Of one input; or of several, with as many outputs.

    Returns
    -------
    array, shape (n_frequency, n_output, n_input)
        [output unit / input unit].

    Raises
    ------
    InputError
        Several inputs and another number of outputs, outputs or inputs that depend on each other,
        or output and input without anything in common at a line.

    Notes
    -----
    With one input each output stands for itself, ``G_yy / G_xy``: noise in the output makes it too
    large by (S + N)/S. With several inputs the outputs form one square matrix, and a quiet
    output spoils all columns.
    """
    cross = np.conj(np.swapaxes(spectra.output_input, 1, 2))
    n_input, n_output = cross.shape[1:]
    if n_input == 1:
        _refuse_zero(np.abs(cross[:, 0]), spectra, "nothing in common with the input")
        return np.asarray((spectra.output_power / cross[:, 0])[:, :, np.newaxis])
    if n_input != n_output:
        raise InputError(
            f"H2 of {n_input} inputs needs as many outputs, not {n_output}: use H1 or Hv"
        )
    _check_inputs(spectra)
    _refuse_zero(spectra.output_power, spectra, "no output")
    _refuse_dependent(spectra.output_auto, spectra, "outputs")
    return np.asarray(spectra.output_auto @ np.linalg.inv(cross), dtype=np.complex128)


def hv(spectra: CrossSpectra, noise_ratio: npt.ArrayLike | None = None) -> ComplexArray:
    """Frequency response functions for noise in inputs and outputs.

    Parameters
    ----------
    spectra : CrossSpectra
        Of one input or of several that acted together.
    noise_ratio : float or array, broadcastable to (n_frequency, n_output, n_input), optional
        Standard deviation of the noise of the output over that of the input [output unit / input
        unit]. By default noise is taken to be the same fraction of each channel.

    Returns
    -------
    array, shape (n_frequency, n_output, n_input)
        [output unit / input unit].

    Raises
    ------
    InputError
        A noise ratio that is not positive and finite, a line without input or output, fewer
        averages than inputs, or inputs that depend on each other.

    Notes
    -----
    Total least squares, output by output: the eigenvector of the smallest eigenvalue of
    ``[[G_xx, G_xy], [G_yx, G_yy]]`` with every channel over its noise (Leuridan, Rost, Brown,
    1986). With one input and the default ratio it is ``√(|H1| |H2|)`` with the phase of ``G_yx``.
    """
    _check_inputs(spectra)
    _refuse_zero(spectra.output_power, spectra, "no output")
    shape = spectra.output_input.shape
    if noise_ratio is None:
        root_in = np.sqrt(spectra.input_power)[:, np.newaxis, :]
        ratio = np.sqrt(spectra.output_power)[:, :, np.newaxis] / root_in
    else:
        ratio = np.broadcast_to(np.asarray(noise_ratio, dtype=float), shape)
    if not np.all(np.isfinite(ratio) & (ratio > 0)):
        raise InputError("a noise ratio is positive and finite: use h1 or h2 otherwise")
    n_line, n_output, n_input = shape
    result = np.empty(shape, dtype=complex)
    for o in range(n_output):
        # inputs in units of the output's noise: x' = r x, so that H = H' r
        scale = ratio[:, o]
        joint = np.empty((n_line, n_input + 1, n_input + 1), dtype=complex)
        joint[:, :-1, :-1] = spectra.input_auto * scale[:, :, np.newaxis] * scale[:, np.newaxis]
        joint[:, -1, :-1] = spectra.output_input[:, o] * scale
        joint[:, :-1, -1] = joint[:, -1, :-1].conj()
        joint[:, -1, -1] = spectra.output_auto[:, o, o]
        smallest = np.linalg.eigh(joint).eigenvectors[:, :, 0]
        if np.any(np.abs(smallest[:, -1]) < 1e-12):
            raise InputError(f"Hv: output {o + 1} has nothing in common with the inputs at a line")
        # v† (x', y) is as small as can be: y = −Σ v_i* x'_i / v_y*
        result[:, o] = np.conj(-smallest[:, :-1] / smallest[:, -1:]) * scale
    return result


def coherence(spectra: CrossSpectra) -> RealArray:
    """Ordinary coherence of each output with each input, ``|G_yx|² / G_xx G_yy``.

    Parameters
    ----------
    spectra : CrossSpectra
        At least two averages.

    Returns
    -------
    array, shape (n_frequency, n_output, n_input)
        0 … 1 [1]; 0 where input or output is silent.

    Raises
    ------
    InputError
        One average only, whose coherence is 1 whatever was measured; a coherence above 1.
    """
    _needs_averages(spectra, 1)
    power = spectra.output_power[:, :, np.newaxis] * spectra.input_power[:, np.newaxis]
    return _coherent(_quotient(np.abs(spectra.output_input) ** 2, power), spectra)


def multiple_coherence(spectra: CrossSpectra) -> RealArray:
    """Share of each output's power that all inputs together explain.

    Parameters
    ----------
    spectra : CrossSpectra
        More averages than inputs.

    Returns
    -------
    array, shape (n_frequency, n_output)
        0 … 1 [1]; 0 where the output is silent. With one input, its ordinary coherence.

    Raises
    ------
    InputError
        Not more averages than inputs, inputs that depend on each other, a coherence above 1.

    Notes
    -----
    ``G_yx G_xx⁻¹ G_xy / G_yy`` (Bendat and Piersol, Random Data, 4th ed., eq. 7.35).
    """
    _needs_averages(spectra, spectra.input_auto.shape[1])
    explained = np.sum(h1(spectra) * np.conj(spectra.output_input), axis=2).real
    return _coherent(_quotient(explained, spectra.output_power), spectra)


def partial_coherence(spectra: CrossSpectra) -> RealArray:
    """Coherence of each output with one input after removing what the other inputs explain.

    Parameters
    ----------
    spectra : CrossSpectra
        More averages than inputs.

    Returns
    -------
    array, shape (n_frequency, n_output, n_input)
        0 … 1 [1]. With one input, its ordinary coherence.

    Raises
    ------
    InputError
        Not more averages than inputs, or inputs that depend on each other.

    Notes
    -----
    Ordinary coherence of the conditioned spectra ``G_ab·r = G_ab − G_ar G_rr⁻¹ G_rb`` with the
    other inputs r (Bendat and Piersol, Random Data, 4th ed., section 7.3).
    """
    n_input = spectra.input_auto.shape[1]
    if n_input == 1:
        return coherence(spectra)
    _needs_averages(spectra, n_input)
    _check_inputs(spectra)
    result = np.empty(spectra.output_input.shape)
    for i in range(n_input):
        rest = [j for j in range(n_input) if j != i]
        by_rest = spectra.output_input[:, :, rest]
        others = spectra.input_auto[:, rest][:, :, rest]
        # what the others predict of input i, and of each output
        of_input = np.linalg.solve(others, spectra.input_auto[:, rest, i : i + 1])
        of_output = _hermitian(np.linalg.solve(others, _hermitian(by_rest)))
        to_rest = spectra.input_auto[:, i, rest]
        auto = spectra.input_power[:, i] - np.einsum("fr,fr->f", to_rest, of_input[:, :, 0]).real
        cross = spectra.output_input[:, :, i] - (by_rest @ of_input)[:, :, 0]
        explained = np.einsum("for,for->fo", of_output, by_rest.conj()).real
        left = spectra.output_power - explained
        result[:, :, i] = _quotient(np.abs(cross) ** 2, left * auto[:, np.newaxis])
    # multiple coherence is the judge of the spectra; differences of near equals only round
    return np.clip(result, 0.0, 1.0)


def _hermitian(matrix: npt.ArrayLike) -> ComplexArray:
    return np.asarray(np.conj(np.swapaxes(matrix, 1, 2)), dtype=np.complex128)


def _solved(cross: ComplexArray, spectra: CrossSpectra) -> ComplexArray:
    """``cross G_xx⁻¹``, each input scaled to size 1 first."""
    _check_inputs(spectra)
    size = np.sqrt(spectra.input_power)
    auto = spectra.input_auto / (size[:, :, np.newaxis] * size[:, np.newaxis])
    # H G = C  ⇔  G† H† = C†, and G is Hermitian
    solution = np.linalg.solve(auto, _hermitian(cross / size[:, np.newaxis]))
    return np.asarray(_hermitian(solution) / size[:, np.newaxis], dtype=np.complex128)


def _check_inputs(spectra: CrossSpectra) -> None:
    n_input = spectra.input_auto.shape[1]
    if spectra.n_averages < n_input:
        raise InputError(
            f"{n_input} inputs that acted together need at least as many averages, not "
            f"{spectra.n_averages}: average more blocks"
        )
    _refuse_zero(spectra.input_power, spectra, "no input")
    if n_input > 1:
        _refuse_dependent(spectra.input_auto, spectra, "inputs")


def _refuse_dependent(auto: ComplexArray, spectra: CrossSpectra, what: str) -> None:
    size = np.sqrt(np.einsum("faa->fa", auto).real)
    condition = np.linalg.cond(auto / (size[:, :, np.newaxis] * size[:, np.newaxis]))
    worst = int(np.argmax(condition))
    if not condition[worst] < LARGEST_CONDITION:
        raise InputError(
            f"the {what} depend on each other at {spectra.frequency[worst]:g} Hz: excite with "
            "independent signals, or one input at a time"
        )


def _refuse_zero(power: RealArray, spectra: CrossSpectra, what: str) -> None:
    silent = ~(power > SILENT * power.max(axis=0, initial=0.0))
    if silent.any():
        line, channel = (int(i) for i in np.argwhere(silent)[0])
        raise InputError(
            f"{what} at {spectra.frequency[line]:g} Hz in channel {channel + 1}: choose a band in "
            "which there is some"
        )


def _needs_averages(spectra: CrossSpectra, n_input: int) -> None:
    if spectra.n_averages <= n_input:
        raise InputError(
            f"the coherence of {n_input} input(s) over {spectra.n_averages} average(s) is 1 "
            "whatever was measured: average more"
        )


def _quotient(part: RealArray, whole: RealArray) -> RealArray:
    silent = ~(whole > 0)
    return np.asarray(np.where(silent, 0.0, part / np.where(silent, 1.0, whole)))


def _coherent(values: RealArray, spectra: CrossSpectra) -> RealArray:
    """Take rounding off; more than that cannot come out of one average."""
    above = values > 1.0 + ROUNDING
    if above.any():
        line = int(np.argwhere(above)[0][0])
        raise InputError(
            f"a coherence of {float(values[above].max()):.4g} at {spectra.frequency[line]:g} Hz is "
            "above 1: auto and cross spectra are not of the same blocks, or not of one scaling"
        )
    return np.clip(values, 0.0, 1.0)
