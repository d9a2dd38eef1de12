"""A measured matrix of FRFs with what it is worth: coherence, random error, blocks used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.block_records import BlockRecord
from deboom.measurement.channels import Frf
from deboom.physics.cross_spectra import CrossSpectra
from deboom.physics.frf_estimators import (
    h1,
    h2,
    hv,
    multiple_coherence,
    partial_coherence,
)
from deboom.physics.frf_random_error import magnitude_error

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
