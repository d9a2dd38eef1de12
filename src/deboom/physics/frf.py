"""Frequency response functions: their forms, their estimates with errors,."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


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
    """Matrix of frequency response functions from one form to another.

    Parameters
    ----------
    values : array, shape (n_frequency, n_output, n_input)
        In the form `source`, factor e^{+jωt}, SI units.
    frequency : array, shape (n_frequency,)
        [Hz]; above 0 where a power of ω has to be divided by.
    source, target : FrfForm

    Returns
    -------
    array, shape (n_frequency, n_output, n_input)
        In the form `target`; outputs and inputs change places when it is an inverse of the source.

    Raises
    ------
    InputError
        Shapes that disagree, 0 Hz where it is divided by, or a matrix without an inverse.

    Notes
    -----
    Each derivative of the motion multiplies by jω. The inverse is that of the whole matrix, line
    by line: an element of an apparent mass is not one over the element of the inertance.
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
    matrix = matrix * _power_of_j_omega(lines, power)[:, np.newaxis, np.newaxis]
    return matrix if source.is_inverse == target.is_inverse else _inverse(matrix, lines)


def scaled_condition_number(values: npt.ArrayLike, form: FrfForm, length: float) -> RealArray:
    """Condition number of 6×6 functions, with rotations made comparable to translations.

    Parameters
    ----------
    values : array, shape (..., 6, 6)
        In the form `form`, order x y z rx ry rz, SI units.
    form : FrfForm
        Motions are multiplied, and loads divided, by `length` where they rotate.
    length : float
        Characteristic length, such as the radius of gyration [m]; to be printed with the result.

    Returns
    -------
    array, shape (...)
        [1].

    Raises
    ------
    InputError
        Not 6×6, or a length that is not positive.

    Notes
    -----
    Without the scaling the number depends on the unit of length: the thesis's 450 of a compressor
    in SI units is mass over smallest moment of inertia, and 2 when scaled by √(J/m).
    """
    matrix = np.asarray(values)
    if matrix.shape[-2:] != (6, 6):
        raise InputError(f"the scaling needs 6×6 functions, not shape {matrix.shape}")
    scale = _rotation_scale(length)
    factor = np.outer(scale, scale)
    scaled = matrix / factor if form.is_inverse else matrix * factor
    return np.asarray(np.linalg.cond(scaled))


def scaled_forward_condition_number(forward: npt.ArrayLike, length: float) -> float:
    """Condition number of a stack of forward matrices, per metre of motion at a stated distance.

    Parameters
    ----------
    forward : array, shape (n, 6)
        Motion of the body → motion at the sensors [1, m/rad].
    length : float
        Characteristic length, such as the mean distance of the sensors [m]; to be printed with the
        result.

    Returns
    -------
    float
        [1]; infinite or above 1e12 where the sensors do not determine the motion.

    Raises
    ------
    InputError
        Not six columns, or a length that is not positive.
    """
    matrix = np.asarray(forward, dtype=float)
    if matrix.ndim != 2 or matrix.shape[1] != 6:
        raise InputError(f"forward matrices have six columns, not shape {matrix.shape}")
    return float(np.linalg.cond(matrix / _rotation_scale(length)))


def _rotation_scale(length: float) -> RealArray:
    if not length > 0:
        raise InputError(f"a characteristic length is positive, not {length} m")
    return np.repeat([1.0, length], 3)


def _power_of_j_omega(frequency: RealArray, power: int) -> ComplexArray:
    if power < 0 and np.any(frequency == 0):
        raise InputError(
            "the conversion divides by the frequency: leave the line at 0 Hz out first"
        )
    # j^power as an exact table: complex powers would leave rounding in the other component
    unit = (1, 1j, -1, -1j)[power % 4]
    return np.asarray(unit * (2 * np.pi * frequency) ** float(power), dtype=complex)


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
    """Return the modal assurance criterion of two curves.

    Parameters
    ----------
    a, b : array_like, shape (n_frequency, ...)
        Complex values to compare along the first axis; the other axes broadcast. Mode shapes have
        their degrees of freedom in the place of the lines.

    Returns
    -------
    array, shape (...)
        0 (nothing in common) to 1 (one is a complex multiple of the other) [1].

    Raises
    ------
    InputError
        Different numbers of lines, or a curve that is zero on all lines.

    Notes
    -----
    ``MAC = |aᴴ b|² / (aᴴ a · bᴴ b)``. Give complex pressures or their magnitudes, never decibels:
    two dB curves share a large mean, which makes MAC close to 1 for any pair.
    """
    first, second = _checked_pair(a, b)
    cross = np.abs(_inner(first, second)) ** 2
    return np.asarray(cross / (_energy(first) * _energy(second)))


def msf(a: npt.ArrayLike, reference: npt.ArrayLike) -> ComplexArray:
    """Return the modal scale factor, the complex factor that brings a reference closest to a curve.

    Parameters
    ----------
    a, reference : array_like, shape (n_frequency, ...)
        Complex values to compare along the first axis; the other axes broadcast.

    Returns
    -------
    array, shape (...)
        Complex c of the least-squares fit ``a = c · reference`` [1].

    Raises
    ------
    InputError
        Different numbers of lines, or a curve that is zero on all lines.

    Notes
    -----
    ``MSF = refᴴ a / (refᴴ ref)``. Without the conjugate, or with the real part alone, a difference
    in phase comes back as a difference in scale. ``msf(a, b) · msf(b, a) = mac(a, b)``.
    """
    compared, base = _checked_pair(a, reference)
    return np.asarray(_inner(base, compared) / _energy(base))


def corr_f(a: npt.ArrayLike, b: npt.ArrayLike) -> RealArray:
    """Return the difference in shape of two curves.

    Parameters
    ----------
    a, b : array_like, shape (n_frequency, ...)
        Complex pressures, or their magnitudes; see `mac`.

    Returns
    -------
    array, shape (...)
        0 (same shape) to 1 [1].

    Raises
    ------
    InputError
        As `mac`.

    Notes
    -----
    ``corr_f = |1 − MAC|``, thesis, eq. 33.
    """
    return np.abs(1 - mac(a, b))


def corr_s(a: npt.ArrayLike, reference: npt.ArrayLike) -> RealArray:
    """Return the difference in scale of a curve from a reference.

    Parameters
    ----------
    a, reference : array_like, shape (n_frequency, ...)
        Complex pressures (the difference then includes a common phase), or their magnitudes; see
        `msf`.

    Returns
    -------
    array, shape (...)
        0 for the same scale [1].

    Raises
    ------
    InputError
        As `msf`.

    Notes
    -----
    ``corr_s = |1 − MSF|``, thesis, eq. 34. Not symmetric: it is relative to the reference.
    """
    return np.abs(1 - msf(a, reference))


def _inner(a: ComplexArray, b: ComplexArray) -> ComplexArray:
    """Return the Hermitian product aᴴ b over the first axis."""
    return np.asarray(np.sum(a.conj() * b, axis=0))


def _energy(a: ComplexArray) -> RealArray:
    return np.asarray(np.sum(np.abs(a) ** 2, axis=0))


def _checked_pair(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    first, second = np.asarray(a, dtype=complex), np.asarray(b, dtype=complex)
    if first.ndim == 0 or second.ndim == 0 or len(first) != len(second):
        raise InputError(
            f"curves of shapes {first.shape} and {second.shape} cannot be compared: give the same "
            "lines along the first axis"
        )
    for curve in (first, second):
        if np.any(_energy(curve) == 0):
            raise InputError("a curve that is zero on all lines has neither shape nor scale")
    return first, second


class SpectrumScaling(Enum):
    """What one-sided auto spectra are scaled to; a quotient of two of the same kind is free of it.

    A package that mixes kinds errs by the line spacing: an H1 of cross *power* over *density* is
    wrong by the factor df, its coherence by df².
    """

    POWER = "mean square per line [unit²]"
    POWER_DENSITY = "mean square per hertz [unit²/Hz], for random signals"
    ENERGY_DENSITY = "energy per hertz [unit² s/Hz], for impacts"


@dataclass(frozen=True, eq=False)
class CrossSpectra:
    """One-sided spectra of inputs and outputs, averaged over blocks.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        From 0 [Hz].
    input_auto : array, shape (n_frequency, n_input, n_input)
        ``E[X_a X_b*]``.
    output_input : array, shape (n_frequency, n_output, n_input)
        ``E[Y_a X_b*]``.
    output_auto : array, shape (n_frequency, n_output, n_output)
        ``E[Y_a Y_b*]``.
    n_averages : int
        Blocks that were averaged.

    Raises
    ------
    InputError
        Shapes that disagree, or no average.

    Notes
    -----
    With this order of the conjugate, ``Y = H X`` gives ``E[Y X*] = H E[X X*]`` for e^{+jωt}.
    Bendat and Piersol's ``G_xy = E[X* Y]`` is the entry (y, x).
    """

    frequency: RealArray
    input_auto: ComplexArray
    output_input: ComplexArray
    output_auto: ComplexArray
    n_averages: int

    def __post_init__(self) -> None:
        cross = np.array(self.output_input, dtype=complex)
        if cross.ndim != 3 or self.n_averages < 1:
            raise InputError(
                "cross spectra have shape (n_frequency, n_output, n_input) and at least one "
                f"average, not {cross.shape} and {self.n_averages}"
            )
        n_line, n_output, n_input = cross.shape
        expected = {
            "frequency": (n_line,),
            "input_auto": (n_line, n_input, n_input),
            "output_input": cross.shape,
            "output_auto": (n_line, n_output, n_output),
        }
        for name, shape in expected.items():
            kind = float if name == "frequency" else complex
            array = np.array(getattr(self, name), dtype=kind)
            if array.shape != shape:
                raise InputError(f"cross spectra: {name} has shape {array.shape}, expected {shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def input_power(self) -> RealArray:
        """Auto spectrum of each input, shape (n_frequency, n_input)."""
        return np.asarray(np.einsum("fii->fi", self.input_auto).real)

    @property
    def output_power(self) -> RealArray:
        """Auto spectrum of each output, shape (n_frequency, n_output)."""
        return np.asarray(np.einsum("foo->fo", self.output_auto).real)

    def on_lines(self, lines: npt.NDArray[np.bool_]) -> CrossSpectra:
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
    """Averaged one-sided spectra of blocks that were sampled together.

    Parameters
    ----------
    inputs : array, shape (n_block, n_sample, n_input)
        Such as force [N].
    outputs : array, shape (n_block, n_sample, n_output)
        Such as acceleration [m/s²].
    rate : float
        Samples per second [Hz].
    input_window, output_window : array, shape (n_sample,), optional
        Multiply every block; by default 1.
    scaling : SpectrumScaling
        Powers are divided by the mean of the product of both windows squared; energies are not, a
        window there cuts noise and not signal.

    Returns
    -------
    CrossSpectra
        ``n_sample // 2 + 1`` lines, ``rate / n_sample`` apart.

    Raises
    ------
    InputError
        Shapes that disagree, fewer than two samples, a value that is not finite, or a rate that is
        not positive.

    Notes
    -----
    ``G_ab = 2 c E[X_a X_b*]`` with ``X = Σ_n w_n x_n e^{−j2πkn/N}``, and ``c = 1/N²`` for power,
    ``1/(N rate)`` for power density, ``1/rate²`` for energy density; the lines at 0 Hz and at
    rate/2 have no mirror image and no 2 (Bendat and Piersol, Random Data, 4th ed., 5.2 and 11.5).
    """
    pushed, answered = _blocks(inputs, "input"), _blocks(outputs, "output")
    if pushed.shape[:2] != answered.shape[:2]:
        raise InputError(
            f"input blocks of shape {pushed.shape} and output blocks of shape {answered.shape} "
            "differ in number or length"
        )
    if not rate > 0:
        raise InputError(f"a sampling rate of {rate} Hz is not positive")
    n_block, n_sample = pushed.shape[:2]
    window_in = _window(input_window, n_sample)
    window_out = _window(output_window, n_sample)
    x = np.fft.rfft(pushed * window_in[:, np.newaxis], axis=1)
    y = np.fft.rfft(answered * window_out[:, np.newaxis], axis=1)
    sides = np.full(x.shape[1], 2.0)
    sides[0] = 1.0
    if n_sample % 2 == 0:
        sides[-1] = 1.0

    def averaged(a: ComplexArray, b: ComplexArray, *windows: RealArray) -> ComplexArray:
        # blocks are the summed axis of one matrix product per line
        product = a.transpose(1, 2, 0) @ b.conj().transpose(1, 0, 2) / n_block
        scale = sides * _scale(scaling, windows[0], windows[1], rate)
        return np.asarray(product * scale[:, np.newaxis, np.newaxis], dtype=complex)

    return CrossSpectra(
        np.asarray(np.fft.rfftfreq(n_sample, 1.0 / rate), dtype=np.float64),
        averaged(x, x, window_in, window_in),
        averaged(y, x, window_out, window_in),
        averaged(y, y, window_out, window_out),
        n_block,
    )


def overlapping_blocks(record: npt.ArrayLike, length: int, step: int) -> RealArray:
    """Blocks of a long record for Welch's average; samples after the last whole block are left.

    Parameters
    ----------
    record : array, shape (n_sample, n_channel)
        [unit].
    length : int
        Samples of a block.
    step : int
        Samples from one block's begin to the next one's; `length` is no overlap.

    Returns
    -------
    array, shape (n_block, length, n_channel)
        [unit].

    Raises
    ------
    InputError
        A record shorter than one block, or a step outside 1 … `length`.
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
    """Independent averages that overlapping blocks of a random signal are worth.

    Parameters
    ----------
    window : array, shape (n_sample,)
        Of every block.
    step : int
        Samples from one block's begin to the next one's.
    n_block : int
        Number of blocks.

    Returns
    -------
    float
        From 1 to `n_block` [1].

    Raises
    ------
    InputError
        No block, or a step below 1.

    Notes
    -----
    Welch (1967): ``n / (1 + 2 Σ_k (1 − k/n) ρ_k²)`` with
    ``ρ_k = Σ_m w_m w_{m+k·step} / Σ w²``, for white noise. Hann blocks that overlap by half are
    worth 0.947 n, where the same record without overlap gives 0.5 n.
    """
    shape = np.asarray(window, dtype=float)
    if n_block < 1 or step < 1:
        raise InputError(f"{n_block} blocks with a step of {step} samples average nothing")
    total = 1.0
    for k in range(1, min(n_block, -(-shape.size // step))):
        shared = np.sum(shape[: -k * step] * shape[k * step :]) / np.sum(shape**2)
        total += 2.0 * (1.0 - k / n_block) * float(shared) ** 2
    return n_block / total


def _blocks(blocks: npt.ArrayLike, what: str) -> RealArray:
    array = np.asarray(blocks, dtype=float)
    if array.ndim != 3 or array.shape[1] < 2 or 0 in array.shape:
        raise InputError(
            f"{what} blocks have shape (n_block, n_sample, n_{what}) with at least two samples, "
            f"not {array.shape}"
        )
    bad = ~np.isfinite(array)
    if bad.any():
        block, sample, channel = (int(i) for i in np.argwhere(bad)[0])
        raise InputError(
            f"{what} {channel + 1} of block {block + 1} is not finite at sample {sample}"
        )
    return array


def _window(window: npt.ArrayLike | None, n_sample: int) -> RealArray:
    if window is None:
        return np.ones(n_sample)
    shape = np.asarray(window, dtype=float)
    if shape.shape != (n_sample,) or not np.all(np.isfinite(shape)) or not np.any(shape):
        raise InputError(
            f"a window of blocks of {n_sample} samples has as many finite values, not all 0"
        )
    return shape


def _scale(scaling: SpectrumScaling, first: RealArray, second: RealArray, rate: float) -> float:
    n_sample = first.size
    if scaling is SpectrumScaling.ENERGY_DENSITY:
        return 1.0 / rate**2
    # roots of the mean squares, so that quotients do not depend on the windows' sizes
    size = float(np.sqrt(np.mean(first**2) * np.mean(second**2)))
    if scaling is SpectrumScaling.POWER_DENSITY:
        return 1.0 / (n_sample * rate * size)
    return 1.0 / (n_sample**2 * size)


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


LARGEST_VALID_ERROR = 0.2
"""Relative error of |H| up to which the first-order formulas hold within 10 %."""


def magnitude_error(coherence: npt.ArrayLike, n_averages: float, n_inputs: int = 1) -> RealArray:
    """Relative standard deviation of |H|.

    Parameters
    ----------
    coherence : array, shape (...)
        Ordinary with one input, partial with several, 0 … 1 [1].
    n_averages : float
        Independent averages, above `n_inputs` [1].
    n_inputs : int
        Inputs that acted together.

    Returns
    -------
    array, shape (...)
        [1]; infinite where the coherence is 0. Beyond `LARGEST_VALID_ERROR` it says "large" and no
        more.

    Raises
    ------
    InputError
        A coherence outside 0 … 1, or not more averages than inputs.

    Notes
    -----
    ``√(1 − γ²) / (|γ| √(2 n))`` with ``n = n_averages − n_inputs``. Bendat and Piersol (Random
    Data, 4th ed., eq. 9.90 and section 9.3) have one more in n; what is taken here is the standard
    error of the least squares that H1 is, right from the third hit on, and the same with many.
    First order in the noise; gaussian noise, independent of the input; averages that do not
    overlap, or are counted by their worth. For H2 and Hv at high coherence.
    """
    gamma2 = _checked(coherence, n_averages, n_inputs)
    free = n_averages - n_inputs
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt((1.0 - gamma2) / (2.0 * free * gamma2)))


def phase_error(coherence: npt.ArrayLike, n_averages: float, n_inputs: int = 1) -> RealArray:
    """Return the standard deviation of the phase of H [rad].

    Parameters
    ----------
    coherence, n_averages, n_inputs
        As of `magnitude_error`.

    Returns
    -------
    array, shape (...)
        [rad]; at most π/√3, the value of a phase that can be anything.

    Raises
    ------
    InputError
        As `magnitude_error`.

    Notes
    -----
    ``arcsin`` of the relative error of |H| (Bendat and Piersol, Random Data, 4th ed., eq. 9.91).
    """
    error = magnitude_error(coherence, n_averages, n_inputs)
    anything = np.pi / np.sqrt(3.0)
    known = np.arcsin(np.minimum(error, 1.0))
    return np.asarray(np.where(error < 1.0, known, anything))


def coherence_bias(coherence: npt.ArrayLike, n_averages: float) -> RealArray:
    """Return by how much an estimated ordinary coherence is too large on average [1].

    Parameters
    ----------
    coherence : array, shape (...)
        True, 0 … 1 [1].
    n_averages : float
        Independent averages, above 1 [1].

    Returns
    -------
    array, shape (...)
        [1]; 1/n where nothing is common.

    Raises
    ------
    InputError
        A coherence outside 0 … 1, or fewer than two averages.

    Notes
    -----
    ``(1 − γ²)² / n`` (Bendat and Piersol, Random Data, 4th ed., eq. 9.75), to first order in 1/n
    and exact at both ends.
    """
    gamma2 = _checked(coherence, n_averages, 1)
    return np.asarray((1.0 - gamma2) ** 2 / n_averages)


def _checked(coherence: npt.ArrayLike, n_averages: float, n_inputs: int) -> RealArray:
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
    """1 while the hammer touches, 0 otherwise, with a cosine at both ends.

    Parameters
    ----------
    n_sample : int
        Samples of a block.
    rate : float
        Samples per second [Hz].
    begin, end : float
        Of the flat part, from the first sample of the block [s].
    taper : float
        Duration of the rise before `begin` and of the fall after `end` [s].

    Returns
    -------
    array, shape (n_sample,)
        0 … 1 [1].

    Raises
    ------
    InputError
        No sample in the flat part, or a taper that is negative.

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
    """``e^{−(t − begin)/τ}`` over the whole block.

    Parameters
    ----------
    n_sample : int
        Samples of a block.
    rate : float
        Samples per second [Hz].
    time_constant : float
        τ [s].
    begin : float
        Where it is 1, from the first sample of the block: when the hammer strikes [s].

    Returns
    -------
    array, shape (n_sample,)
        Above 1 before `begin` [1].

    Raises
    ------
    InputError
        A time constant that is not positive.

    Notes
    -----
    For force and response, both: then the measured function is exactly ``H(jω + 1/τ)`` in place of
    ``H(jω)``, that of a body whose every pole lies 1/τ further left. No formula brings H(jω) back
    from its values; poles that were fitted to it do come back, see `corrected_pole`. Between forms
    of such a function the factor is ``jω + 1/τ``: displacement is ``a/(jω + 1/τ)²``, not
    ``−a/ω²``.
    """
    if not time_constant > 0:
        raise InputError(
            f"the time constant of an exponential window is positive, not {time_constant} s"
        )
    time = np.arange(n_sample) / rate
    return np.asarray(np.exp(-(time - begin) / time_constant))


def corrected_pole(pole: npt.ArrayLike, time_constant: float) -> ComplexArray:
    """Pole of the body out of the one fitted to windowed data, ``s = s_fitted + 1/τ``.

    Parameters
    ----------
    pole : array, shape (...)
        Fitted, ``−ζω + jω√(1 − ζ²)`` [rad/s].
    time_constant : float
        Of the exponential window of force and response, τ [s].

    Returns
    -------
    array, shape (...)
        [rad/s].

    Raises
    ------
    InputError
        A time constant that is not positive, or a pole that the window alone would move further
        than it lies: no decay is left.

    Notes
    -----
    The damped frequency Im s is left as it is; the decay rate −Re s shrinks by 1/τ. An error of the
    fitted decay rate stays as it is, so its share of a small damping grows.
    """
    if not time_constant > 0:
        raise InputError(
            f"the time constant of an exponential window is positive, not {time_constant} s"
        )
    corrected = np.asarray(pole, dtype=complex) + 1.0 / time_constant
    growing = corrected.real >= 0
    if np.any(growing):
        worst = complex(np.asarray(pole).reshape(-1)[int(np.argmax(corrected.real))])
        raise InputError(
            f"a fitted pole at {worst:.6g} rad/s decays more slowly than the exponential window "
            f"alone, 1/{time_constant:g} s: the fit or the time constant is wrong"
        )
    return np.asarray(corrected, dtype=complex)


def corrected_damping_ratio(
    damping_ratio: npt.ArrayLike, frequency: npt.ArrayLike, time_constant: float
) -> RealArray:
    """Damping ratio of the body out of the one fitted to windowed data.

    Parameters
    ----------
    damping_ratio : array, shape (...)
        Fitted, ζ [1].
    frequency : array, broadcastable
        Fitted undamped natural frequency |s|/2π [Hz].
    time_constant : float
        Of the exponential window of force and response, τ [s].

    Returns
    -------
    array, shape (...)
        [1].

    Raises
    ------
    InputError
        As `corrected_pole`.

    Notes
    -----
    ``−Re s / |s|`` of the corrected pole; for small damping ``ζ − 1/(ω τ)``.
    """
    zeta, omega = np.broadcast_arrays(
        np.asarray(damping_ratio, dtype=float), 2 * np.pi * np.asarray(frequency, dtype=float)
    )
    pole = corrected_pole(omega * (-zeta + 1j * np.sqrt(1.0 - zeta**2)), time_constant)
    return np.asarray(-pole.real / np.abs(pole))
