"""The gate before any identification: FRFs without coherence do not pass."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.frf_estimate import FrfEstimate
from deboom.physics.frf_random_error import magnitude_error

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
