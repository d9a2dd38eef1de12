"""Is one front really better than another, or could it be chance?

Two things are left to chance in a front: the tolerance draws that judge it, and the search, which
another seed would have taken elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy import stats

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError

CONFIDENCE = 0.99
"""How sure a difference must be to be called real [1]."""
LAST_PART = 0.2
"""Of the generations: what they gained says how far a single search can be trusted [1]."""
ENOUGH_SEEDS = 3
"""Runs from which on their own spread is taken."""


class Verdict(Enum):
    """What a comparison says."""

    real = "real difference"
    noise = "within noise"
    open = "not decided"


@dataclass(frozen=True, eq=False)
class Contestant:
    """The runs of one configuration, which differ in nothing but their seed.

    Parameters
    ----------
    name : str
        Of the configuration.
    merit : array, shape (n_runs, n_sets)
        Figure of merit, such as the hypervolume, of each run under each of several independent
        sets of draws, which all contestants share.
    progress : array, shape (n_runs,)
        What the last part of each search has gained in the same figure; NaN: not known.

    Raises
    ------
    InputError
        Fewer than two sets of draws, or arrays that do not fit.
    """

    name: str
    merit: RealArray
    progress: RealArray

    def __post_init__(self) -> None:
        for field in ("merit", "progress"):
            object.__setattr__(self, field, frozen_copy(np.asarray(getattr(self, field), float)))
        if self.merit.ndim != 2 or self.merit.shape[1] < 2:
            raise InputError(f"{self.name}: noise of the draws needs at least two sets of them")
        if self.progress.shape != self.merit.shape[:1]:
            raise InputError(f"{self.name}: give one progress per run")

    @property
    def search_noise(self) -> tuple[float, float]:
        """Standard error of the mean merit from seed to seed, and its degrees of freedom."""
        n = len(self.merit)
        if n >= ENOUGH_SEEDS:
            return float(self.merit.mean(axis=1).std(ddof=1) / np.sqrt(n)), float(n - 1)
        return float(np.sqrt(np.mean(self.progress**2) / n)), np.inf


@dataclass(frozen=True)
class Difference:
    """Of two contestants, first minus second.

    Parameters
    ----------
    value : float
        Of the mean merit.
    draw_error, search_error : float
        Standard errors from the draws and from the searches.
    noise : float
        Largest difference that `CONFIDENCE` still calls chance; NaN: not known.
    verdict : Verdict
        What follows.
    """

    value: float
    draw_error: float
    search_error: float
    noise: float
    verdict: Verdict


def difference(first: Contestant, second: Contestant) -> Difference:
    """Compare two contestants.

    Raises
    ------
    InputError
        Different numbers of sets of draws.

    Notes
    -----
    The difference is real when it exceeds ``t s``. ``s²`` adds up the variance from the draws and
    that from the searches. The draws: the difference is taken under each of n_sets independent
    scrambled sets, and its mean has the standard error of their spread (A. B. Owen, "Scrambled net
    variance for integrals of smooth functions", Annals of Statistics 25, 1997); what all fronts
    have in common cancels. The searches: from three seeds on the standard error over the seeds;
    with fewer, what the last fifth of a search's generations has gained stands for its standard
    deviation, since a search that still moved by so much could as well have ended elsewhere by so
    much. ``t`` is Student's, two-sided at `CONFIDENCE`, with the degrees of freedom of B. L. Welch
    (Biometrika 34, 1947).
    """
    if first.merit.shape[1] != second.merit.shape[1]:
        raise InputError(f"{first.name} and {second.name} are not judged by the same draws")
    by_set = first.merit.mean(axis=0) - second.merit.mean(axis=0)
    value, n_sets = float(by_set.mean()), by_set.size
    draw_error = float(by_set.std(ddof=1) / np.sqrt(n_sets))
    parts = [(draw_error, n_sets - 1.0), first.search_noise, second.search_noise]
    search_error = float(np.hypot(parts[1][0], parts[2][0]))
    error = float(np.hypot(draw_error, search_error))
    if not np.isfinite(error):
        return Difference(value, draw_error, search_error, float("nan"), Verdict.open)
    noise = _student(parts, error) * error
    verdict = Verdict.real if abs(value) > noise else Verdict.noise
    return Difference(value, draw_error, search_error, noise, verdict)


def _student(parts: list[tuple[float, float]], error: float) -> float:
    """Return the quantile for errors of different degrees of freedom."""
    spread = sum(part**4 / freedom for part, freedom in parts)
    freedom = error**4 / spread if spread > 0.0 else np.inf
    quantile = 0.5 + CONFIDENCE / 2.0
    t = stats.t.ppf(quantile, freedom) if np.isfinite(freedom) else stats.norm.ppf(quantile)
    return float(t)


def last_gain(hypervolumes: RealArray) -> float:
    """Return what the last part of a search's generations has gained [unit of the hypervolume].

    NaN for a search of fewer than two generations.
    """
    n = len(hypervolumes)
    if n < 2:
        return float("nan")
    before = min(max(round((1.0 - LAST_PART) * n), 1), n - 1)
    return float(hypervolumes[-1] - hypervolumes[before - 1])
