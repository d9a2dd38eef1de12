"""Variances of independent causes together, and what one more measurement would leave of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import t as student

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.propagated_interval import COVERAGE


@dataclass(frozen=True)
class VariancePart:
    """Variance of a number by one cause.

    Parameters
    ----------
    name : str
        Of the cause.
    variance : float
        [unit²].
    degrees_of_freedom : float
        Behind that variance; infinite where it is stated.

    Raises
    ------
    InputError
        A variance that is negative or not finite, less than one degree of freedom.
    """

    name: str
    variance: float
    degrees_of_freedom: float = math.inf

    def __post_init__(self) -> None:
        if not (math.isfinite(self.variance) and self.variance >= 0.0):
            raise InputError(f"{self.name}: a variance of {self.variance}: give a number from 0")
        if not self.degrees_of_freedom >= 1.0:
            raise InputError(
                f"{self.name}: {self.degrees_of_freedom} degrees of freedom: at least 1 is needed"
            )


@dataclass(frozen=True)
class NextMeasurement:
    """What would be measured next, and what it would leave of each variance.

    Parameters
    ----------
    name : str
        In words.
    remaining : mapping of str to float
        Cause → share of its variance that would remain, 0 to 1; causes that are not named stay [1].
    more_degrees_of_freedom : mapping of str to float
        Cause → degrees of freedom that it would gain.
    """

    name: str
    remaining: Mapping[str, float]
    more_degrees_of_freedom: Mapping[str, float]


def half_width(parts: Sequence[VariancePart], coverage: float = COVERAGE) -> float:
    """Return the half width of the interval of a number with several causes of error.

    Parameters
    ----------
    parts : sequence of VariancePart
        Independent.
    coverage : float
        Of the interval [1].

    Returns
    -------
    float
        [unit].

    Notes
    -----
    ``t_ν √Σ u²`` with the effective degrees of freedom of Welch and Satterthwaite,
    ``ν = (Σ u²)² / Σ u⁴/ν_i`` (GUM, JCGM 100:2008, G.4).
    """
    total = sum(part.variance for part in parts)
    if total == 0.0:
        return 0.0
    spread = sum(part.variance**2 / part.degrees_of_freedom for part in parts)
    freedom = total**2 / spread if spread > 0.0 else math.inf
    return float(student.ppf((1.0 + coverage) / 2.0, freedom) * math.sqrt(total))


def half_width_after(
    parts: Sequence[VariancePart], measurement: NextMeasurement, coverage: float = COVERAGE
) -> float:
    """Return the half width that is to be expected after one more measurement.

    Parameters
    ----------
    parts : sequence of VariancePart
        As they are now.
    measurement : NextMeasurement
        What would be measured.
    coverage : float
        Of the interval [1].

    Returns
    -------
    float
        [unit].

    Raises
    ------
    InputError
        A cause that is not among the parts, a share outside of 0 to 1.

    Notes
    -----
    Pre-posterior analysis of normal errors: the variance after a measurement does not depend on
    what it will show, so its expectation is known before.
    """
    known = {part.name for part in parts}
    for name, share in measurement.remaining.items():
        if name not in known:
            raise InputError(
                f"{measurement.name}: there is no cause {name!r}, only {sorted(known)}"
            )
        if not 0.0 <= share <= 1.0:
            raise InputError(
                f"{measurement.name}: {share} of the variance of {name} would remain: give 0 to 1"
            )
    after = [
        VariancePart(
            part.name,
            part.variance * measurement.remaining.get(part.name, 1.0),
            part.degrees_of_freedom + measurement.more_degrees_of_freedom.get(part.name, 0.0),
        )
        for part in parts
    ]
    return half_width(after, coverage)


@dataclass(frozen=True, eq=False)
class CrossedSpread:
    """Components of variance of a table with one value per row and column.

    Parameters
    ----------
    rows, columns, rest : array, shape (...)
        Between rows, between columns, and what neither explains; not below 0 [unit²].
    n_row, n_column : int
        Of the table.
    """

    rows: RealArray
    columns: RealArray
    rest: RealArray
    n_row: int
    n_column: int


def crossed_spread(values: npt.ArrayLike) -> CrossedSpread:
    """Split the variance of a table such as vehicles × load cases.

    Parameters
    ----------
    values : array_like, shape (n_row, n_column, ...)
        At least two rows; with a single column the rows hold all the spread [unit].

    Returns
    -------
    CrossedSpread

    Raises
    ------
    InputError
        Fewer than two rows, or values that are not finite.

    Notes
    -----
    Random effects ``y_ij = µ + r_i + c_j + e_ij`` (Searle, Casella and McCulloch 1992, ch. 4):
    ``E MS_r = σ_e² + n_c σ_r²``, ``E MS_c = σ_e² + n_r σ_c²``, ``E MS_e = σ_e²``.
    """
    table = np.asarray(values, dtype=float)
    if table.ndim < 2 or table.shape[0] < 2:
        raise InputError(f"a spread needs at least two rows, not shape {table.shape}")
    if not np.isfinite(table).all():
        raise InputError("a spread needs finite values: leave out what was not measured")
    n_row, n_column = table.shape[:2]
    if n_column < 2:
        own = table[:, 0].var(axis=0, ddof=1)
        return CrossedSpread(own, np.zeros_like(own), np.zeros_like(own), n_row, n_column)
    mean = table.mean(axis=(0, 1))
    of_row, of_column = table.mean(axis=1), table.mean(axis=0)
    left = table - of_row[:, np.newaxis] - of_column[np.newaxis] + mean
    rest = np.sum(left**2, axis=(0, 1)) / ((n_row - 1) * (n_column - 1))
    rows = of_row.var(axis=0, ddof=1) - rest / n_column
    columns = of_column.var(axis=0, ddof=1) - rest / n_row
    return CrossedSpread(np.maximum(rows, 0.0), np.maximum(columns, 0.0), rest, n_row, n_column)
