"""A lower sampling rate, before order tracking: the orders of interest lie far below the rate."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import signal

from deboom.arrays import RealArray
from deboom.errors import InputError

SAMPLES_PER_PERIOD = 10
"""Of the highest frequency of interest; keeps the angular resampling to 2e-6."""
LEAST_SAMPLES_PER_PERIOD = 4
"""Below this a record is refused."""
_RIPPLE = 110.0
"""Deviation of the passband from 1 and of the stopband from 0 that the filter is made for [dB]."""


def lower_rate(
    values: npt.ArrayLike, rate: float, highest_frequency: float
) -> tuple[RealArray, float]:
    """Every n-th sample of low-pass filtered records, without delay.

    Parameters
    ----------
    values : array, shape (n_sample, n_channel)
        [unit].
    rate : float
        Samples per second [Hz].
    highest_frequency : float
        Up to which the records must stay as they are [Hz].

    Returns
    -------
    values : array, shape (n_lower, n_channel)
        The first sample keeps its time [unit].
    rate : float
        A whole fraction of the old one, at least ten times the highest frequency, or the old one
        [Hz].

    Raises
    ------
    InputError
        Fewer than four samples per period of the highest frequency, or a record shorter than the
        filter.

    Notes
    -----
    Linear-phase Kaiser filter, flat within 1e-5 up to the highest frequency; what folds back lies
    above it. It reaches about four of the new samples beyond each end, where the record is
    continued by its odd reflection.
    """
    record = np.asarray(values, dtype=float)
    if rate < LEAST_SAMPLES_PER_PERIOD * highest_frequency:
        raise InputError(
            f"a sampling rate of {rate:g} Hz is too low for {highest_frequency:.4g} Hz: it needs "
            f"{LEAST_SAMPLES_PER_PERIOD * highest_frequency:.4g} Hz"
        )
    factor = int(rate // (SAMPLES_PER_PERIOD * highest_frequency))
    if factor < 2:
        return record, rate
    lower = rate / factor
    taps, beta = signal.kaiserord(_RIPPLE, (lower - 2 * highest_frequency) / (rate / 2))
    # a reach of whole new samples puts the first new sample on the first old one
    reach = factor * int(np.ceil(taps / (2 * factor)))
    if len(record) <= reach:
        raise InputError(f"{len(record)} samples are too few to lower the rate of {rate:g} Hz")
    kernel = signal.firwin(2 * reach + 1, lower / 2, window=("kaiser", beta), fs=rate)
    longer = np.pad(record, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    thinned = signal.upfirdn(kernel, longer, down=factor, axis=0)
    first, count = 2 * reach // factor, (len(record) - 1) // factor + 1
    return np.asarray(thinned[first : first + count], dtype=float), lower
