"""Intervals from measurements that were drawn again, and what they say about differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError

COVERAGE = 0.90
"""Of an interval, unless said otherwise [1]."""

LEAST_DRAWS = 40
"""Below which 5 % on either side are fewer than two draws."""


@dataclass(frozen=True, eq=False)
class Interval:
    """A number, or an array of them, with the interval of the truth.

    Parameters
    ----------
    value : array, shape (...)
        As measured [unit].
    lower, upper : array, shape (...)
        Where the truth lies [unit]. The value need not lie in the middle, and in data whose errors
        push to one side not even inside.
    coverage : float
        Of the interval [1].
    """

    value: RealArray
    lower: RealArray
    upper: RealArray
    coverage: float

    @property
    def half_width(self) -> RealArray:
        """Half of the width, shape (...) [unit]."""
        return np.asarray((self.upper - self.lower) / 2.0)

    def about(self, value: npt.ArrayLike) -> Interval:
        """Return the interval of the same errors about a value that was computed otherwise.

        Parameters
        ----------
        value : array_like, shape (...)
            [unit].
        """
        other = np.asarray(value, dtype=float)
        moved = other - self.value
        return Interval(other, self.lower + moved, self.upper + moved, self.coverage)

    def holds(self, truth: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Say whether it holds the truth, shape (...)."""
        where = np.asarray(truth, dtype=float)
        return np.asarray((self.lower <= where) & (where <= self.upper))


def pivotal_interval(
    value: npt.ArrayLike, again: npt.ArrayLike, coverage: float = COVERAGE
) -> Interval:
    """Return the interval of the truth behind a measured value.

    Parameters
    ----------
    value : array_like, shape (...)
        From the data as measured [unit].
    again : array_like, shape (n_draws, ...)
        From data that were measured again by drawing their errors [unit].
    coverage : float
        Between 0 and 1 [1].

    Returns
    -------
    Interval

    Raises
    ------
    InputError
        Too few draws, shapes that differ, values that are not finite, a coverage outside of ]0, 1[.

    Notes
    -----
    ``[2 v - q_(1-α/2), 2 v - q_(α/2)]`` with the quantiles q of the values measured again, which
    lie about the measured value as it lies about the truth (basic bootstrap interval, Davison and
    Hinkley 1997, eq. 5.6). A percentile interval would take the bias of the noise, which fills
    every notch, a second time instead of away. Quantiles are those with (n + 1) p draws below.
    """
    measured, drawn = np.asarray(value, dtype=float), np.asarray(again, dtype=float)
    if not 0.0 < coverage < 1.0:
        raise InputError(f"a coverage of {coverage}: give a number between 0 and 1, such as 0.9")
    if drawn.ndim < 1 or drawn.shape[1:] != measured.shape:
        raise InputError(
            f"draws of shape {drawn.shape} for values of shape {measured.shape}: one row per draw"
        )
    if len(drawn) < LEAST_DRAWS:
        raise InputError(f"{len(drawn)} draws do not give an interval: take at least {LEAST_DRAWS}")
    if not (np.isfinite(drawn).all() and np.isfinite(measured).all()):
        raise InputError("an interval needs finite values: a draw silences a line or fails")
    tails = [(1.0 - coverage) / 2.0, (1.0 + coverage) / 2.0]
    low, high = np.quantile(drawn, tails, axis=0, method="weibull")
    return Interval(measured, 2.0 * measured - high, 2.0 * measured - low, coverage)


def probability_below(value: npt.ArrayLike, again: npt.ArrayLike, bound: float = 0.0) -> RealArray:
    """Return the probability that the truth behind a measured value lies below a bound.

    Parameters
    ----------
    value : array_like, shape (...)
        As measured, such as the level of design A minus that of design B [unit].
    again : array_like, shape (n_draws, ...)
        Measured again, with the same errors for A and B [unit].
    bound : float
        [unit].

    Returns
    -------
    array, shape (...)
        From 0 to 1; a difference that is 0 in every draw gives one half [1].

    Notes
    -----
    Of the same pivot as `pivotal_interval`.
    """
    truth = 2.0 * np.asarray(value, dtype=float) - np.asarray(again, dtype=float)
    below, at = (truth < bound).mean(axis=0), (truth == bound).mean(axis=0)
    return np.asarray(below + at / 2.0)
