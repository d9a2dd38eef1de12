"""A measured matrix of FRFs with its coherence and random error,."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.physics.frf import (
    CrossSpectra,
    h1,
    h2,
    hv,
    magnitude_error,
    multiple_coherence,
    partial_coherence,
)


@dataclass(frozen=True)
class BlockRecord:
    """What became of one block.

    Parameters
    ----------
    number : int
        From 1, in the order measured.
    peak : float
        Largest excitation; of several inputs, of the first one [its unit].
    used : bool
        Whether it is part of the average.
    reasons : tuple of str
        Why not; empty when used.
    """

    number: int
    peak: float
    used: bool
    reasons: tuple[str, ...] = ()


def chosen_blocks(
    records: Sequence[BlockRecord],
    numbers: Sequence[int] | None = None,
    count: int | None = None,
) -> tuple[BlockRecord, ...]:
    """Mark what a choice by number or by count leaves out; what was rejected stays rejected.

    Parameters
    ----------
    records : sequence of BlockRecord
        One per block.
    numbers : sequence of int, optional
        Of the blocks to keep, from 1; by default all.
    count : int, optional
        How many of the good ones to keep, the first ones; by default all.

    Returns
    -------
    tuple of BlockRecord
        In their order.

    Raises
    ------
    InputError
        A number that is not there or doubled, a count below 1, or above the number of good hits.
    """
    known = [record.number for record in records]
    wanted = known if numbers is None else list(numbers)
    missing = sorted(set(wanted) - set(known))
    if missing or len(set(wanted)) != len(wanted):
        raise InputError(f"hits {list(wanted)}: choose among {known}, each once")
    if count is not None and count < 1:
        raise InputError(f"{count} hits cannot be averaged: choose at least 1")
    chosen, n_used = [], 0
    for record in records:
        reason = ""
        if record.number not in wanted:
            reason = "not chosen"
        elif record.used and count is not None and n_used == count:
            reason = f"after the first {count} good hits"
        if reason:
            reasons = (*record.reasons, reason)
            record = BlockRecord(record.number, record.peak, False, reasons)
        n_used += record.used
        chosen.append(record)
    if count is not None and n_used < count:
        raise InputError(
            f"{count} good hits were asked for, there are {n_used}: {summary(records)}"
        )
    return tuple(chosen)


def summary(records: Sequence[BlockRecord]) -> str:
    """Return one sentence on which hits were rejected and why."""
    rejected = [
        f"hit {record.number}: {', '.join(record.reasons)}" for record in records if not record.used
    ]
    return "; ".join(rejected) if rejected else f"all {len(records)} hits are good"


USABLE_SHARE = 2.0 / 2.56
"""Of the lines up to half the sampling rate: beyond, anti-aliasing filters work."""
_WORTH = ("coherence", "multiple_coherence", "random_error")


class Estimator(Enum):
    """How spectra become an FRF: where the noise is decides."""

    H1 = "noise in the responses"
    H2 = "noise in the excitation"
    HV = "noise in both, the same share of each"


@dataclass(frozen=True, eq=False)
class FrfEstimate:
    """FRFs as measured, with coherence and random error entry by entry.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        Increasing, above 0 [Hz].
    values : array, shape (n_frequency, n_output, n_input)
        e^{+jωt} [output unit / input unit].
    outputs, inputs : sequence of str
        Names of the rows and of the columns.
    output_units, input_units : sequence of str
        SI units of the rows and of the columns.
    coherence : array, shape (n_frequency, n_output, n_input)
        Ordinary where one input acted at a time; partial, given the other inputs, where several
        did. NaN is not known: one average only [1].
    multiple_coherence : array, shape (n_frequency, n_output, n_input)
        Share of the response explained by all inputs of the run of that column [1], or NaN.
    random_error : array, shape (n_frequency, n_output, n_input)
        Relative standard deviation of |H| by chance [1], or NaN. Bias is not in it.
    n_averages : sequence of float, one per input
        Independent averages.
    added_decay_rate : float
        1/τ of an exponential window: the values are those of a body whose poles lie this much
        further left, and stay so until poles are corrected [1/s].
    records : tuple of tuple of BlockRecord, one per input
        Blocks used and rejected.

    Raises
    ------
    InputError
        Shapes that disagree, doubled names, a value that is not finite, a line at 0 Hz.
    """

    frequency: RealArray
    values: ComplexArray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    output_units: tuple[str, ...]
    input_units: tuple[str, ...]
    coherence: RealArray
    multiple_coherence: RealArray
    random_error: RealArray
    n_averages: tuple[float, ...]
    added_decay_rate: float
    records: tuple[tuple[BlockRecord, ...], ...]

    def __post_init__(self) -> None:
        checked = Frf(self.frequency, self.values, self.outputs, self.inputs, "")
        if not checked.frequency[0] > 0:
            raise InputError("an estimate has no line at 0 Hz: leave it out")
        for name in ("frequency", "values", "outputs", "inputs"):
            object.__setattr__(self, name, getattr(checked, name))
        for name in ("output_units", "input_units", "n_averages", "records"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in _WORTH:
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != self.values.shape:
                raise InputError(f"{name} has shape {array.shape}, the FRFs {self.values.shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        counts = (len(self.output_units), *map(len, (self.input_units, self.n_averages)))
        n_in = len(self.inputs)
        if counts != (len(self.outputs), n_in, n_in) or len(self.records) != n_in:
            raise InputError(
                "an estimate has a unit per output, and unit, averages and records per input"
            )

    @property
    def frf(self) -> Frf:
        """The values as a matrix of one unit.

        Raises
        ------
        InputError
            Outputs or inputs of several units: `select` those of one first.
        """
        units = sorted({(o, i) for o in self.output_units for i in self.input_units})
        if len(units) > 1:
            raise InputError(f"FRFs in units {units}: select outputs and inputs of one unit first")
        above, below = (f"({unit})" if "/" in unit else unit for unit in units[0])
        return Frf(self.frequency, self.values, self.outputs, self.inputs, f"{above}/{below}")

    def select(
        self, outputs: Sequence[str] | None = None, inputs: Sequence[str] | None = None
    ) -> FrfEstimate:
        """Return the named rows and columns, in the order asked for; None keeps them all.

        Raises
        ------
        InputError
            A name that is not there.
        """
        checked = Frf(self.frequency, self.values, self.outputs, self.inputs, "")
        part = checked.select(outputs, inputs)
        rows = [self.outputs.index(name) for name in part.outputs]
        columns = [self.inputs.index(name) for name in part.inputs]
        return replace(
            self,
            values=part.values,
            outputs=part.outputs,
            inputs=part.inputs,
            output_units=tuple(self.output_units[i] for i in rows),
            input_units=tuple(self.input_units[i] for i in columns),
            n_averages=tuple(self.n_averages[i] for i in columns),
            records=tuple(self.records[i] for i in columns),
            **{name: getattr(self, name)[:, rows][:, :, columns] for name in _WORTH},
        )

    def on_lines(self, frequency: npt.ArrayLike) -> FrfEstimate:
        """Return the estimate on some of its own lines; nothing is interpolated.

        Raises
        ------
        InputError
            A frequency that is no line of it.
        """
        wanted = np.atleast_1d(np.asarray(frequency, dtype=float))
        lines = np.abs(self.frequency[:, np.newaxis] - wanted).argmin(axis=0)
        spacing = self.frequency[1] - self.frequency[0] if self.frequency.size > 1 else 1.0
        off = np.abs(self.frequency[lines] - wanted) > 1e-6 * spacing
        if off.any():
            raise InputError(
                f"{wanted[off][0]:g} Hz is no line of the estimate, whose lines are {spacing:g} Hz "
                "apart: choose the block length so that it is one"
            )
        return replace(
            self,
            **{
                name: getattr(self, name)[lines]
                for name in (
                    "frequency",
                    "values",
                    "coherence",
                    "multiple_coherence",
                    "random_error",
                )
            },
        )


def join_estimates(estimates: Sequence[FrfEstimate]) -> FrfEstimate:
    """One matrix out of runs in which different inputs acted on the same outputs.

    Parameters
    ----------
    estimates : sequence of FrfEstimate
        Such as one per impact; columns keep their order.

    Returns
    -------
    FrfEstimate

    Raises
    ------
    InputError
        None at all, or outputs, lines or windows that differ.
    """
    if not estimates:
        raise InputError("no estimate to join: give at least one")
    first = estimates[0]
    for other in estimates[1:]:
        name = f"input {other.inputs[0]} and input {first.inputs[0]}"
        if (other.outputs, other.output_units) != (first.outputs, first.output_units):
            raise InputError(f"{name} have other outputs: select the same ones first")
        if not np.array_equal(other.frequency, first.frequency):
            raise InputError(f"{name} have other frequency lines: use one rate and block length")
        if other.added_decay_rate != first.added_decay_rate:
            raise InputError(f"{name} have other exponential windows: use one for all")

    def side_by_side(name: str) -> RealArray:
        return np.concatenate([getattr(estimate, name) for estimate in estimates], axis=2)

    return replace(
        first,
        values=np.concatenate([estimate.values for estimate in estimates], axis=2),
        coherence=side_by_side("coherence"),
        multiple_coherence=side_by_side("multiple_coherence"),
        random_error=side_by_side("random_error"),
        inputs=tuple(name for e in estimates for name in e.inputs),
        input_units=tuple(unit for e in estimates for unit in e.input_units),
        n_averages=tuple(n for e in estimates for n in e.n_averages),
        records=tuple(records for e in estimates for records in e.records),
    )


def estimated(
    spectra: CrossSpectra,
    *,
    outputs: Sequence[str],
    inputs: Sequence[str],
    output_units: Sequence[str],
    input_units: Sequence[str],
    estimator: Estimator,
    band: tuple[float, float] | None,
    n_averages: float,
    added_decay_rate: float,
    records: tuple[BlockRecord, ...],
) -> FrfEstimate:
    """FRFs, coherence and random error out of averaged spectra.

    Parameters
    ----------
    spectra : CrossSpectra
        Of all lines.
    outputs, inputs, output_units, input_units : sequence of str
        Names and units of the channels.
    estimator : Estimator
        H1, H2 or Hv.
    band : (float, float), optional
        First and last frequency [Hz]; by default from above 0 to `USABLE_SHARE` of the last line.
    n_averages : float
        Independent averages that the blocks are worth.
    added_decay_rate : float
        Of an exponential window [1/s].
    records : tuple of BlockRecord
        Blocks used and rejected.

    Returns
    -------
    FrfEstimate

    Raises
    ------
    InputError
        No line in the band, or what the estimators refuse.
    """
    low, high = (0.0, USABLE_SHARE * spectra.frequency[-1]) if band is None else band
    # sensors do not measure 0 Hz, and a quotient of two offsets is no FRF
    lines = (spectra.frequency >= low) & (spectra.frequency <= high) & (spectra.frequency > 0)
    if not lines.any():
        raise InputError(
            f"no line from {low:g} Hz to {high:g} Hz: the blocks give "
            f"{spectra.frequency[1]:g} Hz to {spectra.frequency[-1]:g} Hz"
        )
    part = spectra.on_lines(lines)
    values = _ESTIMATE[estimator](part)
    n_input = len(inputs)
    unknown = np.full(values.shape, np.nan)
    coherent = explained = error = unknown
    if min(spectra.n_averages, n_averages) > n_input:
        coherent = partial_coherence(part)
        explained = np.broadcast_to(multiple_coherence(part)[:, :, np.newaxis], values.shape)
        error = magnitude_error(coherent, n_averages, n_input)
    return FrfEstimate(
        frequency=part.frequency,
        values=values,
        outputs=tuple(outputs),
        inputs=tuple(inputs),
        output_units=tuple(output_units),
        input_units=tuple(input_units),
        coherence=coherent,
        multiple_coherence=explained,
        random_error=error,
        n_averages=(n_averages,) * n_input,
        added_decay_rate=added_decay_rate,
        records=(records,) * n_input,
    )


_ESTIMATE = {Estimator.H1: h1, Estimator.H2: h2, Estimator.HV: hv}


SMALLEST_COHERENCE = 0.8
"""Median over the band: five hits then err by 18 % at random, close to where the formula ends."""


def imported_estimate(
    frf: Frf,
    coherence: npt.ArrayLike | None = None,
    n_averages: float | None = None,
) -> FrfEstimate:
    """FRFs that another system has averaged, with what it says of them.

    Parameters
    ----------
    frf : Frf
        One input acted at a time; the line at 0 Hz, if any, is left out.
    coherence : array, shape (n_frequency, n_output, n_input), optional
        Ordinary [1]; left out, not known.
    n_averages : float, optional
        Left out, not known, and so is the random error.

    Returns
    -------
    FrfEstimate
        Nothing is known of blocks and windows.

    Raises
    ------
    InputError
        A coherence of another shape or outside 0 … 1.
    """
    lines = frf.frequency > 0
    unknown = np.full(frf.values[lines].shape, np.nan)
    coherent = error = unknown
    if coherence is not None:
        given = np.asarray(coherence, dtype=float)
        if given.shape != frf.values.shape:
            raise InputError(
                f"a coherence of shape {given.shape} does not belong to FRFs of shape "
                f"{frf.values.shape}"
            )
        outside = np.argwhere(~((given >= 0) & (given <= 1)))
        if outside.size:
            line, o, i = outside[0]
            raise InputError(
                f"output '{frf.outputs[o]}' to input '{frf.inputs[i]}': a coherence of "
                f"{given[line, o, i]:.4g} at {frf.frequency[line]:g} Hz is not from 0 to 1; leave "
                "such lines out, and ask how auto and cross spectra were averaged"
            )
        coherent = given[lines]
        if n_averages is not None and n_averages > 1:
            error = magnitude_error(coherent, n_averages)
    above, below = _parts(frf.unit)
    n_input = len(frf.inputs)
    return FrfEstimate(
        frequency=frf.frequency[lines],
        values=frf.values[lines],
        outputs=frf.outputs,
        inputs=frf.inputs,
        output_units=(above,) * len(frf.outputs),
        input_units=(below,) * n_input,
        coherence=coherent,
        multiple_coherence=coherent,
        random_error=error,
        n_averages=(np.nan if n_averages is None else n_averages,) * n_input,
        added_decay_rate=0.0,
        records=((),) * n_input,
    )


def _parts(unit: str) -> tuple[str, str]:
    """Split ``Pa/N``, ``(m/s^2)/N`` or ``(m/s^2)/(m^3/s^2)`` into numerator and denominator."""
    if unit.endswith(")"):
        above, _, below = unit[:-1].rpartition("/(")
    else:
        above, _, below = unit.rpartition("/")
    return above.removeprefix("(").removesuffix(")"), below


def require_coherence(
    estimate: FrfEstimate,
    band: tuple[float, float],
    smallest: float = SMALLEST_COHERENCE,
) -> None:
    """Refuse to go on with FRFs that are not a response to their input.

    Parameters
    ----------
    estimate : FrfEstimate
        To be identified from.
    band : (float, float)
        First and last frequency that the identification uses [Hz].
    smallest : float
        Least median of the multiple coherence over the band, of every output and input [1]. The
        median: dips at antiresonances and at nodes are no fault.

    Raises
    ------
    InputError
        The worst output and input and its coherence, or which of them have none; no line in the
        band.
    """
    low, high = band
    lines = (estimate.frequency >= low) & (estimate.frequency <= high)
    if not lines.any():
        raise InputError(f"no line from {low:g} Hz to {high:g} Hz to judge the coherence by")
    known = estimate.multiple_coherence[lines]
    missing = np.argwhere(np.isnan(known).any(axis=0))
    if missing.size:
        o, i = missing[0]
        raise InputError(
            f"output '{estimate.outputs[o]}' to input '{estimate.inputs[i]}' has no coherence (one "
            "average, or exported without it), so nothing tells it from noise: average at least "
            "two blocks, or export the coherence beside it"
        )
    median = np.median(known, axis=0)
    o, i = np.unravel_index(int(np.argmin(median)), median.shape)
    if median[o, i] < smallest:
        n_low = int(np.sum(median < smallest))
        raise InputError(
            f"output '{estimate.outputs[o]}' to input '{estimate.inputs[i]}': median coherence "
            f"{median[o, i]:.2f} from {low:g} to {high:g} Hz is below {smallest:g}, most of it is "
            f"no response to this input ({n_low} of {median.size} functions): find the cable, the "
            "range or the second source and measure again, nothing is identified from it"
        )
