"""Sobol indices of many outputs at once, from the designs of Saltelli's scheme.

The designs come from `deboom.explore.sensitivity.sobol_designs`. Estimators and resampling are
those of SALib, which takes one output at a time; here one matrix product serves all resamples of
all indices of an output.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.special import ndtri
from threadpoolctl import threadpool_limits

from deboom.arrays import BoolArray, RealArray
from deboom.errors import InputError
from deboom.explore.seeds import checked_seed

CONFIDENCE = 0.95
"""Share of cases in which an interval is to hold the true index [1]."""
NO_VARIATION = 64.0 * np.finfo(float).eps
"""An output that varies by less than this part of its size is constant but for rounding [1]."""
FEWEST = 8  # base points; with fewer a resample may have no variance at all
FLAT = 1e-2  # part of the variance of all designs that a resample may have by difference
BLOCK = 16  # outputs that are laid out at a time


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Shares of the variance of each output, with half widths of their intervals; all [1].

    Parameters
    ----------
    factors : tuple of str, length d
        Variables or groups.
    outputs : tuple of str, length r
        What was analysed.
    first, total : array, shape (d, r)
        Share of a factor alone, and with all that it does together with others.
    coupled : array, shape (d, r)
        Total minus first.
    first_interval, total_interval, coupled_interval : array, shape (d, r)
        Half widths at the confidence `CONFIDENCE`.
    pairs : tuple of (int, int)
        Places of the factors of each pair; empty without second order.
    second, second_interval : array, shape (len(pairs), r)
        Share of a pair beyond what both do alone.
    n_base : int
        Base points N of the scheme.
    n_resamples : int
        Bootstrap resamples behind the intervals.
    """

    factors: tuple[str, ...]
    outputs: tuple[str, ...]
    first: RealArray
    first_interval: RealArray
    total: RealArray
    total_interval: RealArray
    coupled: RealArray
    coupled_interval: RealArray
    pairs: tuple[tuple[int, int], ...]
    second: RealArray
    second_interval: RealArray
    n_base: int
    n_resamples: int

    @property
    def zero(self) -> BoolArray:
        """Whether a total index is not above its own interval, shape (d, r)."""
        return np.less_equal(self.total, self.total_interval)

    @property
    def pair_names(self) -> tuple[tuple[str, str], ...]:
        """Factors of each pair by name."""
        return tuple((self.factors[j], self.factors[k]) for j, k in self.pairs)

    def difference(self, other: SobolIndices) -> float:
        """Return the largest difference of any index or interval from those of the same outputs.

        Relative to one plus the number's size: intervals of a handful of points may be large.
        """
        columns = ("first", "total", "coupled", "second")
        names = [*columns, *(f"{column}_interval" for column in columns)]
        pairs = [(getattr(self, name), getattr(other, name)) for name in names]
        gaps = [np.abs(one - two) / (1.0 + np.abs(two)) for one, two in pairs]
        return max(float(gap.max(initial=0.0)) for gap in gaps)


def n_rows(n_factors: int, second_order: bool) -> int:
    """Return how many designs belong to one base point."""
    return (2 * n_factors if second_order else n_factors) + 2


def first_and_total(values: RealArray, n_factors: int) -> RealArray:
    """Return of second-order values, shape (n, r), those that first and total indices need."""
    rows = values.reshape(-1, n_rows(n_factors, True), values.shape[1])
    keep = [*range(n_factors + 1), -1]
    return np.ascontiguousarray(rows[:, keep]).reshape(-1, values.shape[1])


def base_rows(values: RealArray, n_factors: int, second_order: bool) -> RealArray:
    """Return the values at the 2N independent points of the scheme, shape (2N, r)."""
    rows = values.reshape(-1, n_rows(n_factors, second_order), values.shape[1])
    return np.concatenate([rows[:, 0], rows[:, -1]])


def checked_values(
    values: RealArray, outputs: Sequence[str], step: int
) -> tuple[RealArray, tuple[str, ...]]:
    """Return responses that an analysis can use, or say which design or output it cannot.

    Parameters
    ----------
    values : array, shape (n, r)
        Responses, in the order of the designs.
    outputs : sequence of str, length r
    step : int
        n is a multiple of this; of the scheme of Saltelli, ``n / step`` is a power of two.

    Raises
    ------
    InputError
        Another shape; a value that is not finite, by the number of its design; an output that does
        not vary, by name.
    """
    array, names = np.asarray(values, dtype=float), tuple(outputs)
    if array.ndim != 2 or array.shape[1] != len(names) or len(array) == 0 or len(array) % step:
        raise InputError(
            f"responses of shape {array.shape} for {len(names)} outputs: give one column per "
            f"output and one row per design, a multiple of {step} rows"
        )
    bad = np.argwhere(~np.isfinite(array))
    if bad.size:
        raise InputError(
            f"design {bad[0, 0]} has no finite {names[bad[0, 1]]}, and {len(set(bad[:, 0]))} of "
            f"{len(array)} designs are like that: one is enough to make every index wrong, so "
            "narrow the range or repair the model"
        )
    spread, size = np.ptp(array, axis=0), np.abs(array).max(axis=0)
    constant = [names[place] for place in np.flatnonzero(spread <= NO_VARIATION * size)]
    if constant:
        raise InputError(
            f"no variation over the designs in output {_named(constant)}: there is no variance to "
            "share out, leave it out"
        )
    return array, names


def sobol_indices(
    values: RealArray,
    factors: Sequence[str],
    outputs: Sequence[str],
    *,
    seed: int,
    second_order: bool = True,
    n_resamples: int = 100,
) -> SobolIndices:
    """Return the Sobol indices of all outputs, with bootstrap intervals.

    Parameters
    ----------
    values : array, shape (n, r)
        Responses to the designs of `deboom.explore.sensitivity.sobol_designs`, in their order;
        ``n = N (2d + 2)``, without second order ``N (d + 2)``.
    factors : sequence of str, length d
        Variables, or groups of them.
    outputs : sequence of str, length r
    seed : int
        Of the resampling, from 1 upwards; the resamples are those of SALib with this seed, and all
        outputs share them.
    second_order : bool
        Whether the designs are those for second order.
    n_resamples : int
        At least 2.

    Raises
    ------
    InputError
        See `checked_values`; N not a power of two, fewer than two resamples, seed 0.

    Notes
    -----
    With ``f_A``, ``f_B``, ``f_AB,j``, ``f_BA,j`` the output at the base points A and B and with
    factor j taken from the other, ``V`` the variance of ``f_A`` and ``f_B`` together and all values
    centred: ``S_j = mean(f_B (f_AB,j - f_A)) / V`` and ``ST_j = mean((f_A - f_AB,j)²) / 2V``
    (Saltelli et al., Computer Physics Communications 181, 2010),
    ``S_jk = mean(f_BA,j f_AB,k - f_A f_B) / V - S_j - S_k`` (Saltelli, ibid. 145, 2002). An
    interval is the standard deviation over the resamples times the gaussian quantile.
    """
    d = len(factors)
    array, names = checked_values(values, outputs, n_rows(d, second_order))
    n_base = len(array) // n_rows(d, second_order)
    checked_base(n_base)
    weights = resample_weights(n_base, n_resamples, seed)
    pairs = tuple(combinations(range(d), 2)) if second_order else ()
    parts: list[tuple[RealArray, RealArray]] = []
    with threadpool_limits(1, user_api="blas"):  # threads may change the last bit
        for start in range(0, len(names), BLOCK):
            block = array[:, start : start + BLOCK].reshape(n_base, n_rows(d, second_order), -1)
            laid = np.ascontiguousarray(block.transpose(2, 1, 0))
            parts += [_one_output(rows, weights, d, pairs) for rows in laid]
    index, interval = (np.stack(column, axis=1) for column in zip(*parts, strict=True))
    cuts = (d, 2 * d, 3 * d)
    first, total, coupled, second = np.split(index, cuts)
    first_i, total_i, coupled_i, second_i = np.split(interval, cuts)
    return SobolIndices(
        tuple(factors),
        names,
        *(first, first_i, total, total_i, coupled, coupled_i),
        pairs,
        *(second, second_i),
        n_base,
        n_resamples,
    )


def checked_base(n_base: int) -> int:
    """Return the number of base points, or refuse one that is not a power of two from 8 upwards."""
    exponent = max(n_base, 1).bit_length() - 1
    if n_base < FEWEST or n_base != 2**exponent:
        low = max(2**exponent, FEWEST)
        raise InputError(
            f"{n_base} base points of a Sobol analysis are not a power of two from {FEWEST} "
            f"upwards and would be unbalanced or too few: take {low} or {2 * low}"
        )
    return n_base


def checked_resamples(n_resamples: int) -> int:
    """Return the number of resamples, or refuse fewer than two."""
    if n_resamples < 2:
        raise InputError(
            f"{n_resamples} resamples cannot give an interval: take at least 2, better 100"
        )
    return n_resamples


def resample_weights(n_base: int, n_resamples: int, seed: int) -> RealArray:
    """Return how often each base point is drawn, the point itself first, (1 + n_resamples, N).

    Raises
    ------
    InputError
        Fewer than two resamples, seed 0.
    """
    checked_resamples(n_resamples)
    drawn = np.random.default_rng(checked_seed(seed)).integers(n_base, size=(n_base, n_resamples))
    offset = drawn + n_base * np.arange(n_resamples)
    counts = np.bincount(offset.ravel(), minlength=n_base * n_resamples)
    return np.vstack([np.ones(n_base), counts.reshape(n_resamples, n_base)])


def _one_output(
    rows: RealArray, weights: RealArray, d: int, pairs: tuple[tuple[int, int], ...]
) -> tuple[RealArray, RealArray]:
    """Return indices and intervals of one output: first, total, coupled, second in a row.

    ``rows``: shape (rows of a base point, N).
    """
    scaled = (rows - rows.mean()) / rows.std()
    a, b = scaled[0], scaled[-1]
    ab, ba = scaled[1 : d + 1], scaled[d + 1 : 2 * d + 1]
    terms = np.empty((2 * d + len(pairs) + 2, rows.shape[1]))
    np.subtract(ab, a, out=terms[:d])
    np.multiply(0.5 * terms[:d], terms[:d], out=terms[d : 2 * d])
    terms[:d] *= b
    for term, (j, k) in zip(terms[2 * d : -2], pairs, strict=True):
        np.multiply(ba[j], ab[k], out=term)
    terms[2 * d : -2] -= a * b
    terms[-2], terms[-1] = 0.5 * (a + b), 0.5 * (a * a + b * b)
    means = weights @ terms.T / rows.shape[1]
    variance = means[:, -1] - means[:, -2] ** 2
    for row in np.flatnonzero(variance < FLAT):  # the difference has lost its digits
        centred = (a - means[row, -2]) ** 2 + (b - means[row, -2]) ** 2
        variance[row] = 0.5 * np.mean(weights[row] * centred)
    shares = means[:, :-2] / variance[:, None]
    first, total, both = shares[:, :d], shares[:, d : 2 * d], shares[:, 2 * d :]
    if pairs:
        j, k = np.array(pairs).T
        both = both - first[:, j] - first[:, k]
    every = np.hstack([first, total, total - first, both])
    return every[0], interval_of(every[1:])


def interval_of(resampled: RealArray) -> RealArray:
    """Return the half widths of the intervals from resampled indices, shape (n_resamples, ...)."""
    return np.asarray(ndtri(0.5 + CONFIDENCE / 2.0) * resampled.std(axis=0, ddof=1))


def _named(names: Sequence[str]) -> str:
    """Write a few names out and count the rest."""
    shown = ", ".join(f"'{name}'" for name in names[:3])
    return shown if len(names) <= 3 else f"{shown} and {len(names) - 3} more"
