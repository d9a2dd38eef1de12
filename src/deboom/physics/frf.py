"""Frequency response functions: their forms, their estimates with errors, and their likeness.

Which estimate to take is a question of where the noise is: H1 is right with noise in the outputs,
H2 with noise in the inputs, Hv with both in a stated ratio. None is right where the noise of an
input is correlated with that of an output, or where the resolution is too coarse for a resonance.
"""

from __future__ import annotations

from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import BoolArray, ComplexArray, RealArray, checked, checked_array
from deboom.errors import InputError

LARGEST_CONDITION = 1e10
"""Condition number of scaled spectra beyond which channels are taken for dependent."""
SILENT = 1e-24
"""Share of the power of the loudest line below which there is rounding and no signal (240 dB)."""
ROUNDING = 1e-6
"""Amount by which a coherence may come out above 1."""
LARGEST_VALID_ERROR = 0.2
"""Relative error of ``|H|`` up to which the first-order formulas hold within 10 %."""


class FrfForm(Enum):
    """What stands over what: motion per force, or its inverse (thesis, table 9).

    Each value is the pair (order of the time derivative of the displacement, inverse or not).
    """

    RECEPTANCE = (0, False)
    MOBILITY = (1, False)
    INERTANCE = (2, False)
    DYNAMIC_STIFFNESS = (0, True)
    IMPEDANCE = (1, True)
    APPARENT_MASS = (2, True)

    @property
    def derivative(self) -> int:
        """Order of the time derivative: 0 displacement, 1 velocity, 2 acceleration."""
        return self.value[0]

    @property
    def is_inverse(self) -> bool:
        """Whether it is force per motion."""
        return self.value[1]


def convert(
    values: npt.ArrayLike, frequency: npt.ArrayLike, source: FrfForm, target: FrfForm
) -> ComplexArray:
    """Convert a matrix of frequency response functions from one form to another.

    Raises InputError: shapes that disagree, 0 Hz where it is divided by, or a matrix without an
    inverse.

    Parameters
    ----------
    values : array, shape (n_frequency, n_output, n_input)
        Functions in the form `source`, factor e^{+jωt}, SI units.
    frequency : array, shape (n_frequency,)
        Lines [Hz]; above 0 where a power of ω has to be divided by.
    source, target : FrfForm
        Present and wanted form; outputs and inputs change places from one to its inverse.

    Notes
    -----
    Each derivative of the motion multiplies by jω. The inverse is that of the whole matrix, line by
    line: an element of an apparent mass is not one over the element of the inertance.
    """
    matrix = np.asarray(values, dtype=complex)
    lines = np.asarray(frequency, dtype=float)
    if matrix.ndim != 3 or lines.shape != matrix.shape[:1]:
        raise InputError(
            "frequency response functions have shape (n_frequency, n_output, n_input) = "
            f"({lines.size}, n, m), not {matrix.shape}"
        )
    power = target.derivative - source.derivative
    if source.is_inverse:
        power = -power
    if power < 0 and np.any(lines == 0):
        raise InputError(
            "the conversion divides by the frequency: leave the line at 0 Hz out first"
        )
    # j^power as an exact table: complex powers would leave rounding in the other component
    unit = (1, 1j, -1, -1j)[power % 4]
    factor = np.asarray(unit * (2 * np.pi * lines) ** float(power), dtype=complex)
    matrix = matrix * factor[:, np.newaxis, np.newaxis]
    return matrix if source.is_inverse == target.is_inverse else _inverse(matrix, lines)


def scaled_condition_number(values: npt.ArrayLike, form: FrfForm, length: float) -> RealArray:
    """Return the condition number of 6×6 functions, with rotations made comparable to translations.

    Raises InputError: another shape, or a length that is not positive.

    Parameters
    ----------
    values : array, shape (..., 6, 6) — functions in the order x y z rx ry rz, SI units
    form : FrfForm
        Their form: motions are multiplied, and loads divided, by `length` where they rotate.
    length : float
        Characteristic length, such as the radius of gyration [m]; to be printed with the result.

    Notes
    -----
    Without the scaling the number depends on the unit of length: the thesis's 450 of a compressor
    in SI units is mass over smallest moment of inertia, and 2 when scaled by √(J/m).
    """
    matrix = np.asarray(values)
    if matrix.shape[-2:] != (6, 6):
        raise InputError(f"the scaling needs 6×6 functions, not shape {matrix.shape}")
    if not length > 0:
        raise InputError(f"a characteristic length is positive, not {length} m")
    scale = np.repeat([1.0, length], 3)
    factor = np.outer(scale, scale)
    return np.asarray(np.linalg.cond(matrix / factor if form.is_inverse else matrix * factor))


def _inverse(matrix: ComplexArray, frequency: RealArray) -> ComplexArray:
    if matrix.shape[1] != matrix.shape[2]:
        raise InputError(
            f"only square matrices have an inverse, not {matrix.shape[1]} outputs by "
            f"{matrix.shape[2]} inputs"
        )
    rank = np.linalg.matrix_rank(matrix)
    singular = np.flatnonzero(rank < matrix.shape[1])
    if singular.size:
        raise InputError(
            f"the matrix has no inverse at {singular.size} lines, the first at "
            f"{frequency[singular[0]]} Hz (rank {rank[singular[0]]} of {matrix.shape[1]})"
        )
    return np.asarray(np.linalg.inv(matrix), dtype=complex)


def mac(a: npt.ArrayLike, b: npt.ArrayLike) -> RealArray:
    """Return the modal assurance criterion of two curves, ``|aᴴ b|² / (aᴴ a · bᴴ b)``.

    0 (nothing in common) to 1 (one is a complex multiple of the other) [1], along the first axis;
    the other axes broadcast. Raises InputError: different numbers of lines, a curve that is zero on
    all.

    Notes
    -----
    Mode shapes have their degrees of freedom in the place of the lines. Give complex pressures or
    their magnitudes, never decibels: two dB curves share a large mean, which makes MAC close to 1
    for any pair.
    """
    first, second = _checked_pair(a, b)
    cross = np.abs(np.sum(first.conj() * second, axis=0)) ** 2
    return np.asarray(cross / (_energy(first) * _energy(second)))


def msf(a: npt.ArrayLike, reference: npt.ArrayLike) -> ComplexArray:
    """Return the modal scale factor, the complex factor that brings a reference closest to a curve.

    Notes
    -----
    ``MSF = refᴴ a / (refᴴ ref)``, the c of the least-squares fit ``a = c · reference`` [1]; shapes
    and errors as of `mac`. Without the conjugate, or with the real part alone, a difference in
    phase comes back as a difference in scale. ``msf(a, b) · msf(b, a) = mac(a, b)``.
    """
    compared, base = _checked_pair(a, reference)
    return np.asarray(np.sum(base.conj() * compared, axis=0) / _energy(base))


def corr_f(a: npt.ArrayLike, b: npt.ArrayLike) -> RealArray:
    """Return the difference in shape, ``|1 − MAC|`` (thesis, eq. 33), 0 (same shape) to 1 [1]."""
    return np.abs(1 - mac(a, b))


def corr_s(a: npt.ArrayLike, reference: npt.ArrayLike) -> RealArray:
    """Return the difference in scale from a reference, ``|1 − MSF|`` (thesis, eq. 34) [1].

    Of complex pressures it includes a common phase. Not symmetric.
    """
    return np.abs(1 - msf(a, reference))


def _energy(a: ComplexArray) -> RealArray:
    return np.asarray(np.sum(np.abs(a) ** 2, axis=0))


def _checked_pair(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    first, second = np.asarray(a, dtype=complex), np.asarray(b, dtype=complex)
    if first.ndim == 0 or second.ndim == 0 or len(first) != len(second):
        raise InputError(
            f"curves of shapes {first.shape} and {second.shape} cannot be compared: give the same "
            "lines along the first axis"
        )
    if np.any(_energy(first) == 0) or np.any(_energy(second) == 0):
        raise InputError("a curve that is zero on all lines has neither shape nor scale")
    return first, second


class SpectrumScaling(Enum):
    """What one-sided auto spectra are scaled to; a quotient of two of the same kind is free of it.

    A package that mixes kinds errs by the line spacing: an H1 of cross *power* over *density* is
    wrong by the factor df, its coherence by df².
    """

    POWER_DENSITY = "mean square per hertz [unit²/Hz], for random signals"
    ENERGY_DENSITY = "energy per hertz [unit² s/Hz], for impacts"


@checked(
    frequency="f", input_auto="f i i", output_input="f o i", output_auto="f o o", n_averages=">=1"
)
class CrossSpectra:
    """One-sided spectra of inputs and outputs, averaged over blocks.

    - `frequency` (n_frequency,): lines [Hz].
    - `input_auto` (n_frequency, n_input, n_input).
    - `output_input` (n_frequency, n_output, n_input).
    - `output_auto` (n_frequency, n_output, n_output).
    - `n_averages`: number of blocks.

    With this order of the conjugate, ``Y = H X`` gives ``E[Y X*] = H E[X X*]`` for e^{+jωt}. Bendat
    and Piersol's ``G_xy = E[X* Y]`` is the entry (y, x).
    """

    frequency: RealArray
    input_auto: ComplexArray
    output_input: ComplexArray
    output_auto: ComplexArray
    n_averages: int

    @property
    def input_power(self) -> RealArray:
        """Auto spectrum of each input, shape (n_frequency, n_input)."""
        return np.asarray(np.einsum("fii->fi", self.input_auto).real)

    @property
    def output_power(self) -> RealArray:
        """Auto spectrum of each output, shape (n_frequency, n_output)."""
        return np.asarray(np.einsum("foo->fo", self.output_auto).real)

    def on_lines(self, lines: BoolArray) -> CrossSpectra:
        """Return the spectra on the lines for which the mask is true."""
        return CrossSpectra(
            self.frequency[lines],
            self.input_auto[lines],
            self.output_input[lines],
            self.output_auto[lines],
            self.n_averages,
        )


def cross_spectra(
    inputs: npt.ArrayLike,
    outputs: npt.ArrayLike,
    rate: float,
    *,
    input_window: npt.ArrayLike | None = None,
    output_window: npt.ArrayLike | None = None,
    scaling: SpectrumScaling = SpectrumScaling.POWER_DENSITY,
) -> CrossSpectra:
    """Average the one-sided spectra of blocks that were sampled together.

    ``n_sample // 2 + 1`` lines, ``rate / n_sample`` apart. Raises InputError: shapes that disagree,
    fewer than two samples, a value that is not finite, a rate that is not positive, or a window of
    zeros.

    Parameters
    ----------
    inputs, outputs : array, shape (n_block, n_sample, n_channel) — excitation and response
    rate : float — samples per second [Hz]
    input_window, output_window : array, shape (n_sample,), optional — factors of every block
    scaling : SpectrumScaling
        Densities are divided by the root of the product of both windows' mean squares; energies
        are not, a window there cuts noise and not signal.

    Notes
    -----
    ``G_ab = 2 c E[X_a X_b*]`` with ``X = Σ_n w_n x_n e^{−j2πkn/N}``, and ``c = 1/(N rate)`` for
    power density without windows, ``1/rate²`` for energy density; the lines at 0 Hz and at rate/2
    have no mirror image and no 2 (Bendat and Piersol, Random Data, 4th ed., 5.2 and 11.5).
    """
    sizes: dict[str, int] = {}
    pushed = checked_array(inputs, "b s i", "input blocks", sizes)
    answered = checked_array(outputs, "b s o", "output blocks", sizes)
    n_block, n_sample = pushed.shape[:2]
    if n_sample < 2 or 0 in (pushed.size, answered.size):
        raise InputError(f"blocks of shape {pushed.shape}: give at least two samples of each")
    if not rate > 0:
        raise InputError(f"a sampling rate of {rate} Hz is not positive")
    windows = [
        np.ones(n_sample) if window is None else checked_array(window, "s", "window", sizes)
        for window in (input_window, output_window)
    ]
    if not all(np.any(window) for window in windows):
        raise InputError("a window of zeros leaves nothing of the blocks")
    x, y = (
        np.fft.rfft(blocks * window[:, np.newaxis], axis=1)
        for blocks, window in zip((pushed, answered), windows, strict=True)
    )
    sides = np.full(x.shape[1], 2.0)
    sides[0] = 1.0
    if n_sample % 2 == 0:
        sides[-1] = 1.0

    def averaged(a: ComplexArray, b: ComplexArray, *pair: RealArray) -> ComplexArray:
        # blocks are the summed axis of one matrix product per line
        product = a.transpose(1, 2, 0) @ b.conj().transpose(1, 0, 2) / n_block
        # roots of the mean squares, so that quotients do not depend on the windows' sizes
        size = float(np.sqrt(np.mean(pair[0] ** 2) * np.mean(pair[1] ** 2)))
        density = scaling is SpectrumScaling.POWER_DENSITY
        scale = sides * (1.0 / (n_sample * rate * size if density else rate**2))
        return np.asarray(product * scale[:, np.newaxis, np.newaxis], dtype=complex)

    window_in, window_out = windows
    return CrossSpectra(
        np.asarray(np.fft.rfftfreq(n_sample, 1.0 / rate), dtype=np.float64),
        averaged(x, x, window_in, window_in),
        averaged(y, x, window_out, window_in),
        averaged(y, y, window_out, window_out),
        n_block,
    )


def overlapping_blocks(record: npt.ArrayLike, length: int, step: int) -> RealArray:
    """Cut a record (n_sample, n_channel) into blocks (n_block, length, n_channel) to average.

    Blocks begin `step` samples apart, 1 to `length`, else InputError; a last part block is left.
    """
    values = np.asarray(record, dtype=float)
    if values.ndim != 2 or not 2 <= length <= values.shape[0]:
        raise InputError(
            f"blocks of {length} samples do not fit a record of shape {values.shape}: choose from "
            "2 to its number of samples"
        )
    if not 1 <= step <= length:
        raise InputError(f"blocks of {length} samples start 1 to {length} apart, not {step}")
    windows = np.lib.stride_tricks.sliding_window_view(values, length, axis=0)[::step]
    return np.ascontiguousarray(windows.transpose(0, 2, 1))


def effective_averages(window: npt.ArrayLike, step: int, n_block: int) -> float:
    """Return the number of independent averages that overlapping random blocks are worth.

    Notes
    -----
    Welch (1967): ``n / (1 + 2 Σ_k (1 − k/n) ρ_k²)`` with ``ρ_k = Σ_m w_m w_{m+k·step} / Σ w²``, for
    white noise and n blocks of a window w that begin `step` samples apart. Hann blocks that overlap
    by half are worth 0.947 n, where the same record without overlap gives 0.5 n.
    """
    shape = np.asarray(window, dtype=float)
    if n_block < 1 or step < 1:
        raise InputError(f"{n_block} blocks with a step of {step} samples average nothing")
    total = 1.0
    for k in range(1, min(n_block, -(-shape.size // step))):
        shared = np.sum(shape[: -k * step] * shape[k * step :]) / np.sum(shape**2)
        total += 2.0 * (1.0 - k / n_block) * float(shared) ** 2
    return n_block / total


def h1(spectra: CrossSpectra) -> ComplexArray:
    """Estimate frequency response functions for noise in the outputs, ``H = G_yx G_xx⁻¹``.

    Shape (n_frequency, n_output, n_input) [output unit / input unit], for one input or several that
    acted together. Raises InputError: a line without input, fewer averages than inputs, or inputs
    that depend on each other.

    Notes
    -----
    Least squares over the averages (Bendat and Piersol, Random Data, 4th ed., eq. 6.37 and 7.26).
    Noise in an input, independent of all else, makes it too small: by S/(S + N) with one input.
    """
    _check_inputs(spectra)
    size = np.sqrt(spectra.input_power)
    auto = spectra.input_auto / (size[:, :, np.newaxis] * size[:, np.newaxis])
    # H G = C  ⇔  G† H† = C†, and G is Hermitian
    solution = np.linalg.solve(auto, _hermitian(spectra.output_input / size[:, np.newaxis]))
    return np.asarray(_hermitian(solution) / size[:, np.newaxis], dtype=np.complex128)


def h2(spectra: CrossSpectra) -> ComplexArray:
    """Estimate frequency response functions for noise in the inputs, ``H = G_yy G_xy⁻¹``.

    Raises InputError: one input with nothing in common with an output; of several inputs another
    number of outputs, fewer averages, a silent line, inputs or outputs that depend on each other.

    Notes
    -----
    With one input each output stands for itself, ``G_yy / G_xy``: noise in the output makes it too
    large by (S + N)/S. With several inputs the outputs form one square matrix, and a quiet output
    spoils all columns.
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
    """Estimate frequency response functions for noise in inputs and outputs.

    Raises InputError: a noise ratio that is not positive and finite, a line without input, output
    or, unless the ratio is large, anything in common, fewer averages than inputs, dependent inputs.

    Parameters
    ----------
    spectra : CrossSpectra — spectra of one input or of several that acted together
    noise_ratio : float or array, broadcastable to (n_frequency, n_output, n_input), optional
        Standard deviation of the noise of the output over that of the input [output unit / input
        unit]. By default noise is taken to be the same fraction of each channel.

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
    """Return the ordinary coherence of each output with each input, ``|G_yx|² / G_xx G_yy`` [1].

    0 where input or output is silent. Raises InputError: one average only, whose coherence is 1
    whatever was measured; a coherence above 1.
    """
    _needs_averages(spectra, 1)
    power = spectra.output_power[:, :, np.newaxis] * spectra.input_power[:, np.newaxis]
    return _coherent(_quotient(np.abs(spectra.output_input) ** 2, power), spectra)


def multiple_coherence(spectra: CrossSpectra) -> RealArray:
    """Return the share of each output's power that all inputs explain, (n_frequency, n_output) [1].

    ``G_yx G_xx⁻¹ G_xy / G_yy`` (Bendat and Piersol, Random Data, 4th ed., eq. 7.35). Errors as of
    `h1`, and as many averages as inputs, whose coherence is 1; a coherence above 1.
    """
    _needs_averages(spectra, spectra.input_auto.shape[1])
    explained = np.sum(h1(spectra) * np.conj(spectra.output_input), axis=2).real
    return _coherent(_quotient(explained, spectra.output_power), spectra)


def partial_coherence(spectra: CrossSpectra) -> RealArray:
    """Return the coherence of each output with one input, less what the other inputs explain [1].

    Notes
    -----
    ``|H|² g / (|H|² g + G_vv)`` with H of `h1`, ``g = 1/(G_xx⁻¹)_ii``, what the other inputs leave
    of the input, and the unexplained output ``G_vv = G_yy − G_yx G_xx⁻¹ G_xy``: the ordinary
    coherence of the conditioned spectra (Bendat and Piersol, Random Data, 4th ed., section 7.3).
    Errors as of `multiple_coherence`.
    """
    if spectra.input_auto.shape[1] == 1:
        return coherence(spectra)
    unexplained = (1.0 - multiple_coherence(spectra)) * spectra.output_power
    left = 1.0 / np.einsum("fii->fi", np.linalg.inv(spectra.input_auto)).real
    alone = np.abs(h1(spectra)) ** 2 * left[:, np.newaxis]
    return _quotient(alone, alone + unexplained[:, :, np.newaxis])


def _hermitian(matrix: npt.ArrayLike) -> ComplexArray:
    return np.asarray(np.conj(np.swapaxes(matrix, 1, 2)), dtype=np.complex128)


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
    """Cut to 0 … 1; a value above 1 by more than `ROUNDING` raises InputError."""
    above = values > 1.0 + ROUNDING
    if above.any():
        line = int(np.argwhere(above)[0][0])
        raise InputError(
            f"a coherence of {float(values[above].max()):.4g} at {spectra.frequency[line]:g} Hz is "
            "above 1: auto and cross spectra are not of the same blocks, or not of one scaling"
        )
    return np.clip(values, 0.0, 1.0)


def magnitude_error(coherence: npt.ArrayLike, n_averages: float, n_inputs: int = 1) -> RealArray:
    """Return the relative standard deviation of ``|H|`` by chance [1].

    Infinite where the coherence is 0; beyond `LARGEST_VALID_ERROR` it says "large" and no more.
    Raises InputError: a coherence outside 0 … 1, or not more averages than inputs.

    Parameters
    ----------
    coherence : array, shape (...) — ordinary with one input, partial with several [1]
    n_averages : float — independent averages, above `n_inputs` [1]
    n_inputs : int — number of inputs that acted together

    Notes
    -----
    ``√(1 − γ²) / (|γ| √(2 n))`` with ``n = n_averages − n_inputs``. Bendat and Piersol (Random
    Data, 4th ed., eq. 9.90 and section 9.3) have one more in n; what is taken here is the standard
    error of the least squares that H1 is, right from the third hit on. First order in the noise;
    gaussian noise, independent of the input; averages that do not overlap, or are counted by their
    worth. Bias is not in it: noise in the input, a resolution too coarse for a resonance, a second
    source.
    """
    gamma2 = _checked_coherence(coherence, n_averages, n_inputs)
    free = n_averages - n_inputs
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt((1.0 - gamma2) / (2.0 * free * gamma2)))


def phase_error(coherence: npt.ArrayLike, n_averages: float, n_inputs: int = 1) -> RealArray:
    """Return the standard deviation of the phase of H [rad], arguments as of `magnitude_error`.

    Notes
    -----
    ``arcsin`` of the relative error of ``|H|`` (Bendat and Piersol, Random Data, 4th ed., eq.
    9.91), at most π/√3, the value of a phase that can be anything.
    """
    error = magnitude_error(coherence, n_averages, n_inputs)
    arcsine = np.arcsin(np.minimum(error, 1.0))
    return np.asarray(np.where(error < 1.0, arcsine, np.pi / np.sqrt(3.0)))


def coherence_bias(coherence: npt.ArrayLike, n_averages: float) -> RealArray:
    """Return by how much an ordinary coherence is estimated too large on average [1].

    Notes
    -----
    ``(1 − γ²)² / n`` of the true coherence (Bendat and Piersol, Random Data, 4th ed., eq. 9.75), to
    first order in 1/n and exact at both ends. Errors as of `magnitude_error` with one input.
    """
    gamma2 = _checked_coherence(coherence, n_averages, 1)
    return np.asarray((1.0 - gamma2) ** 2 / n_averages)


def _checked_coherence(coherence: npt.ArrayLike, n_averages: float, n_inputs: int) -> RealArray:
    gamma2 = np.asarray(coherence, dtype=float)
    if not np.all((gamma2 >= 0) & (gamma2 <= 1)):
        raise InputError("a coherence is from 0 to 1")
    if not n_averages > n_inputs:
        raise InputError(
            f"{n_averages:g} averages of {n_inputs} input(s) have no random error that could be "
            "told from them: average more"
        )
    return gamma2


def force_window(
    n_sample: int, rate: float, begin: float, end: float, taper: float = 0.0
) -> RealArray:
    """Return a window of 1 while the hammer touches and 0 otherwise, with a cosine at both ends.

    Flat from `begin` to `end` after the first sample of the block, with a taper before and after
    [s]; a flat part without a sample, or a negative taper, raises InputError.

    Notes
    -----
    For the force alone. It leaves the FRF unbiased if the force outside is nothing but noise; take
    the offset of the force out first, or the window makes a step of it.
    """
    time = np.arange(n_sample) / rate
    if taper < 0 or not np.any((time >= begin) & (time <= end)):
        raise InputError(
            f"a force window from {begin:g} s to {end:g} s with a taper of {taper:g} s holds no "
            f"sample of a block of {n_sample / rate:g} s"
        )
    outside = np.maximum(np.maximum(begin - time, time - end), 0.0)
    if taper == 0:
        return np.asarray(np.where(outside > 0, 0.0, 1.0))
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * np.minimum(outside / taper, 1.0)))


def exponential_window(
    n_sample: int, rate: float, time_constant: float, begin: float = 0.0
) -> RealArray:
    """Return the window ``e^{−(t − begin)/τ}`` over the whole block, 1 at the time of the blow [s].

    Notes
    -----
    For force and response, both: then the measured function is exactly ``H(jω + 1/τ)`` in place of
    ``H(jω)``, that of a body whose every pole lies 1/τ further left. No formula brings H(jω) back
    from its values; poles that were fitted to it do come back, see `corrected_pole`. Between forms
    of such a function the factor is ``jω + 1/τ``: displacement is ``a/(jω + 1/τ)²``, not ``−a/ω²``.
    A time constant that is not positive raises InputError.
    """
    _check_time_constant(time_constant)
    time = np.arange(n_sample) / rate
    return np.asarray(np.exp(-(time - begin) / time_constant))


def corrected_pole(pole: npt.ArrayLike, time_constant: float) -> ComplexArray:
    """Return the pole of the body out of the one fitted to windowed data, ``s = s_fitted + 1/τ``.

    Raises InputError: a time constant that is not positive, or a pole that the window alone would
    move further than it lies: no decay is left.

    Notes
    -----
    Poles are ``−ζω + jω√(1 − ζ²)`` [rad/s]. The damped frequency Im s is left as it is; the decay
    rate −Re s shrinks by 1/τ. An error of the fitted decay rate stays as it is, so its share of a
    small damping grows.
    """
    _check_time_constant(time_constant)
    corrected = np.asarray(pole, dtype=complex) + 1.0 / time_constant
    if np.any(corrected.real >= 0):
        worst = complex(np.asarray(pole).reshape(-1)[int(np.argmax(corrected.real))])
        raise InputError(
            f"a fitted pole at {worst:.6g} rad/s decays more slowly than the exponential window "
            f"alone, 1/{time_constant:g} s: the fit or the time constant is wrong"
        )
    return np.asarray(corrected, dtype=complex)


def corrected_damping_ratio(
    damping_ratio: npt.ArrayLike, frequency: npt.ArrayLike, time_constant: float
) -> RealArray:
    """Return the damping ratio of the body out of the one fitted to windowed data [1].

    ``−Re s / |s|`` of the corrected pole, for small damping ``ζ − 1/(ω τ)``; from fitted ζ [1] and
    undamped natural frequency ``|s|/2π`` [Hz], and τ of the window [s].
    """
    zeta, omega = np.broadcast_arrays(
        np.asarray(damping_ratio, dtype=float), 2 * np.pi * np.asarray(frequency, dtype=float)
    )
    pole = corrected_pole(omega * (-zeta + 1j * np.sqrt(1.0 - zeta**2)), time_constant)
    return np.asarray(-pole.real / np.abs(pole))


def _check_time_constant(time_constant: float) -> None:
    if not time_constant > 0:
        raise InputError(
            f"the time constant of an exponential window is positive, not {time_constant} s"
        )
