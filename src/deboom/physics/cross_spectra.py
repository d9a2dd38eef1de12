"""Auto and cross spectra of blocks of time, averaged: what every estimate of an FRF starts from."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError


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
