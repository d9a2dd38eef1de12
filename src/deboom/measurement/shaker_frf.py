"""FRFs out of continuous excitation, by Welch's average: shaker, shakers, or loudspeaker."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.signal.windows import hann

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.frf_estimate import (
    BlockRecord,
    Estimator,
    FrfEstimate,
    chosen_blocks,
    estimated,
    summary,
)
from deboom.physics.frf import (
    SpectrumScaling,
    cross_spectra,
    effective_averages,
    overlapping_blocks,
)


class BlockWindow(Enum):
    """Window of every block."""

    HANN = "for random excitation"
    NONE = "for bursts that begin and die out inside a block, and for periodic signals"


@dataclass(frozen=True, eq=False)
class ShakerRecord:
    """Inputs and outputs of one run, sampled together.

    Parameters
    ----------
    inputs : array, shape (n_sample, n_input)
        What excites: force [N], or volume acceleration of a loudspeaker [m³/s²].
    outputs : array, shape (n_sample, n_output)
        [output units].
    input_names, output_names : sequence of str
        Of the columns; inputs that are named together acted together.
    input_units, output_units : sequence of str
        SI units of the columns.
    rate : float
        Samples per second [Hz].
    input_ranges, output_ranges : sequence of float
        Largest value that each channel can hold; left out, not known.

    Raises
    ------
    InputError
        Records of different length, names or units that do not fit, a value that is not finite, a
        silent input, a rate or range that is not positive.
    """

    inputs: RealArray
    outputs: RealArray
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    rate: float
    input_ranges: tuple[float, ...] = ()
    output_ranges: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for side in ("input", "output"):
            self._check_side(side)
        if self.inputs.shape[0] != self.outputs.shape[0]:
            raise InputError(
                f"inputs of {self.inputs.shape[0]} samples and outputs of "
                f"{self.outputs.shape[0]} were not sampled together"
            )
        if not self.rate > 0:
            raise InputError(f"a sampling rate of {self.rate} Hz is not positive")
        silent = [
            name
            for name, values in zip(self.input_names, self.inputs.T, strict=True)
            if not np.any(values)
        ]
        if silent:
            raise InputError(f"no excitation in inputs {silent}: is it the right channel?")

    def _check_side(self, side: str) -> None:
        names = tuple(getattr(self, f"{side}_names"))
        units = tuple(getattr(self, f"{side}_units"))
        ranges = tuple(getattr(self, f"{side}_ranges")) or (math.inf,) * len(names)
        values = np.array(getattr(self, f"{side}s"), dtype=float)
        if values.ndim != 2 or values.shape[1] != len(names) or values.size == 0:
            raise InputError(
                f"{side}s {list(names)} have shape (n_sample, {len(names)}), not {values.shape}"
            )
        doubled = sorted(name for name, count in Counter(names).items() if count > 1)
        if doubled:
            raise InputError(f"duplicated {side} {doubled}: every channel needs its own name")
        if len(units) != len(names) or len(ranges) != len(names):
            raise InputError(
                f"{len(names)} {side}s, {len(units)} units and {len(ranges)} ranges: state one of "
                "each per channel"
            )
        if not all(limit > 0 for limit in ranges):
            raise InputError(f"a range of {side}s is positive, or infinite where it is not known")
        bad = ~np.isfinite(values)
        if bad.any():
            sample, column = (int(i) for i in np.argwhere(bad)[0])
            raise InputError(f"{side} '{names[column]}' is not finite at sample {sample}")
        values.setflags(write=False)
        object.__setattr__(self, f"{side}s", values)
        object.__setattr__(self, f"{side}_names", names)
        object.__setattr__(self, f"{side}_units", units)
        object.__setattr__(self, f"{side}_ranges", ranges)


@dataclass(frozen=True)
class WelchOptions:
    """How a record becomes an FRF.

    Parameters
    ----------
    block_length : int
        Samples of a block; lines are ``rate / block_length`` apart. For bursts, their period.
    overlap : float
        Of successive blocks, 0 … below 1 [1]; 0 for bursts.
    window : BlockWindow
        Hann by default.
    estimator : Estimator
        H1 by default.
    band : (float, float), optional
        First and last frequency of the result [Hz]; by default from above 0 to rate/2.56, above
        which anti-aliasing filters work.
    overload : float
        Largest value of a channel, over its range; blocks beyond are rejected [1].

    Raises
    ------
    InputError
        An overlap or an overload that makes no sense.
    """

    block_length: int
    overlap: float = 0.5
    window: BlockWindow = BlockWindow.HANN
    estimator: Estimator = Estimator.H1
    band: tuple[float, float] | None = None
    overload: float = 0.99

    def __post_init__(self) -> None:
        if not 0 <= self.overlap < 1 or not 0 < self.overload <= 1:
            raise InputError(
                f"an overlap is from 0 to below 1 and an overload above 0 to 1, not "
                f"{self.overlap} and {self.overload}"
            )


def shaker_frf(
    record: ShakerRecord,
    options: WelchOptions,
    *,
    blocks: Sequence[int] | None = None,
    count: int | None = None,
) -> FrfEstimate:
    """FRFs of all outputs to all inputs of a run.

    Parameters
    ----------
    record : ShakerRecord
        One run.
    options : WelchOptions
        Block length, overlap, window, estimator, band.
    blocks : sequence of int, optional
        Numbers of the blocks to choose from, 1 is the first; by default all.
    count : int, optional
        How many good ones of them to average, the first ones; by default all.

    Returns
    -------
    FrfEstimate
        `n_averages` is what the overlapping blocks are worth.

    Raises
    ------
    InputError
        A record shorter than a block, not more good blocks than inputs, dependent inputs, no line
        in the band.

    Notes
    -----
    The mean of each channel over the record is taken out first. A block must be long against the
    decay of the body, or resonances come out too low whatever the coherence says of noise; with
    Hann, some 2 % at four lines per half-power bandwidth (Bendat and Piersol, Random Data, 4th
    ed., 8.5).
    """
    n_input = len(record.input_names)
    step = max(1, round(options.block_length * (1.0 - options.overlap)))
    together = np.hstack([record.inputs, record.outputs])
    whole = overlapping_blocks(together - together.mean(axis=0), options.block_length, step)
    records = chosen_blocks(_checked(record, options, step, len(whole)), blocks, count)
    used = [one.number - 1 for one in records if one.used]
    if len(used) <= n_input:
        raise InputError(
            f"{len(used)} good blocks of {len(records)} for {n_input} input(s) "
            f"({summary(records)}): the coherence would be 1 whatever was measured; record longer "
            "or take shorter blocks"
        )
    window = np.ones(options.block_length)
    if options.window is BlockWindow.HANN:
        window = hann(options.block_length, sym=False)
    spectra = cross_spectra(
        whole[used][:, :, :n_input],
        whole[used][:, :, n_input:],
        record.rate,
        input_window=window,
        output_window=window,
        scaling=SpectrumScaling.POWER_DENSITY,
    )
    return estimated(
        spectra,
        outputs=record.output_names,
        inputs=record.input_names,
        output_units=record.output_units,
        input_units=record.input_units,
        estimator=options.estimator,
        band=options.band,
        n_averages=effective_averages(window, step, len(used)),
        added_decay_rate=0.0,
        records=records,
    )


def _checked(
    record: ShakerRecord, options: WelchOptions, step: int, n_block: int
) -> tuple[BlockRecord, ...]:
    names = (*record.input_names, *record.output_names)
    units = (*record.input_units, *record.output_units)
    ranges = np.array((*record.input_ranges, *record.output_ranges))
    size = np.abs(np.hstack([record.inputs, record.outputs]))
    records = []
    for index in range(n_block):
        peaks = size[index * step : index * step + options.block_length].max(axis=0)
        reasons = tuple(
            f"overload of '{names[i]}': {peaks[i]:.4g} {units[i]} in a range of "
            f"{ranges[i]:.4g} {units[i]}"
            for i in np.flatnonzero(peaks >= options.overload * ranges)
        )
        records.append(BlockRecord(index + 1, float(peaks[0]), not reasons, reasons))
    return tuple(records)
