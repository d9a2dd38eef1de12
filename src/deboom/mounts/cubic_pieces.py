"""Complete cubic polynomials in pieces along one variable: terms, least squares, values."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations_with_replacement

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.named_arrays import freeze

Exponents = npt.NDArray[np.int64]


@cache
def cubic_exponents(n_features: int) -> Exponents:
    """Exponents of the complete cubic polynomial.

    Parameters
    ----------
    n_features : int
        Number of variables.

    Returns
    -------
    array, shape (n_terms, n_features)
        One row per term, constant first, then by degree; ``n_terms = C(n_features + 3, 3)``.

    Notes
    -----
    Thesis, eq. 32, for three variables: 20 terms (it prints 19 of them).
    """
    exponents = np.array(
        [
            np.bincount(np.array(chosen, dtype=int), minlength=n_features)
            for degree in range(4)
            for chosen in combinations_with_replacement(range(n_features), degree)
        ]
    )
    exponents.setflags(write=False)
    return exponents


def cubic_terms(scaled: RealArray) -> RealArray:
    """Every term of the complete cubic polynomial.

    Parameters
    ----------
    scaled : array, shape (n, n_features)
        Variables, best scaled to [-1, 1].

    Returns
    -------
    array, shape (n, n_terms)
        In the order of `cubic_exponents`.
    """
    return _monomials(scaled, cubic_exponents(scaled.shape[1]))


def _monomials(scaled: RealArray, exponents: Exponents) -> RealArray:
    powers = np.stack([np.ones_like(scaled), scaled, scaled**2, scaled**3])
    terms = np.ones((len(scaled), len(exponents)))
    for feature in range(scaled.shape[1]):
        terms *= powers[exponents[:, feature], :, feature].T
    return terms


def scaling(X: RealArray) -> tuple[RealArray, RealArray]:
    """Centre and half range of each column; a constant column gets the half range 1."""
    low, high = X.min(axis=0), X.max(axis=0)
    half_range = (high - low) / 2
    return (low + high) / 2, np.where(half_range > 0, half_range, 1.0)


@dataclass(frozen=True, eq=False)
class PiecewiseCubic:
    """Complete cubics side by side along one variable, blended where they meet.

    Parameters
    ----------
    split_feature : int
        Column of the variable that is cut into pieces.
    split_points : array, shape (n_pieces - 1,)
        Increasing, in the unit of that variable.
    blend_width : float
        Width about each split point over which one piece hands over to the next, linearly, in
        the unit of that variable.
    centre, half_range : array, shape (n_pieces, n_features)
        Scaling of each piece's variables to [-1, 1] over its own rows.
    coefficients : array, shape (n_pieces, n_terms, n_outputs)
        Of the terms in scaled variables.
    directions : array, shape (n_pieces, n_terms, n_directions)
        Right singular vectors of the rows of terms fitted, zero columns beyond the rank.
    inverse_singular : array, shape (n_pieces, n_directions)
        Their inverse singular values, 0 beyond the rank [1].
    unseen_leverage : array, shape (n_pieces,)
        Leverage of a unit step across all directions: as good as infinite.
    leverage_limit : array, shape (n_pieces,)
        Largest leverage of a row that was fitted.
    variance : array, shape (n_pieces, n_outputs)
        Of the residuals at unit weight; not finite without degrees of freedom.
    degrees_of_freedom : array, shape (n_pieces,)
        Rows less independent terms, per piece.

    Notes
    -----
    Outside of the data the polynomials go on. `TrainingRegion` and :meth:`leverage_ratio` say where
    that is.
    """

    split_feature: int
    split_points: RealArray
    blend_width: float
    centre: RealArray
    half_range: RealArray
    coefficients: RealArray
    directions: RealArray
    inverse_singular: RealArray
    unseen_leverage: RealArray
    leverage_limit: RealArray
    variance: RealArray
    degrees_of_freedom: RealArray

    def __post_init__(self) -> None:
        freeze(self, "split_points", "centre", "half_range", "coefficients", "directions")
        freeze(self, "inverse_singular", "unseen_leverage", "leverage_limit")
        freeze(self, "variance", "degrees_of_freedom")
        object.__setattr__(self, "split_feature", int(self.split_feature))
        object.__setattr__(self, "blend_width", float(self.blend_width))

    @property
    def n_pieces(self) -> int:
        """Number of pieces."""
        return len(self.centre)

    @property
    def n_coefficients(self) -> int:
        """Number of coefficients of all pieces and outputs."""
        return self.coefficients.size

    def __call__(self, X: RealArray) -> RealArray:
        """Values at `X` (n, n_features), shape (n, n_outputs)."""
        share, _ = self._shares(X)
        values = np.zeros((len(X), self.coefficients.shape[2]))
        for k in range(self.n_pieces):
            values += share[k][:, np.newaxis] * (self._terms(X, k) @ self.coefficients[k])
        return values

    def gradient(self, X: RealArray) -> RealArray:
        """Differentiate by each variable at `X` (n, n_features): (n, n_features, n_outputs)."""
        share, slope = self._shares(X)
        exponents = cubic_exponents(X.shape[1])
        gradient = np.zeros((*X.shape, self.coefficients.shape[2]))
        for k in range(self.n_pieces):
            scaled = (X - self.centre[k]) / self.half_range[k]
            for feature in range(X.shape[1]):
                lowered = exponents.copy()
                lowered[:, feature] = np.maximum(lowered[:, feature] - 1, 0)
                power = exponents[:, feature] / self.half_range[k, feature]
                derived = _monomials(scaled, lowered) @ (
                    power[:, np.newaxis] * self.coefficients[k]
                )
                gradient[:, feature] += share[k][:, np.newaxis] * derived
            value = self._terms(X, k) @ self.coefficients[k]
            gradient[:, self.split_feature] += slope[k][:, np.newaxis] * value
        return gradient

    def leverage_ratio(self, X: RealArray) -> RealArray:
        """Leverage over the largest of the rows fitted, worst of the pieces in charge.

        Parameters
        ----------
        X : array, shape (n, n_features)
            Where.

        Returns
        -------
        array, shape (n,)
            Above 1 the polynomial is no longer held by data, even amid the ranges of all variables.

        Notes
        -----
        Hidden extrapolation: Montgomery, Peck and Vining, Introduction to Linear Regression
        Analysis, 3.8.
        """
        share, _ = self._shares(X)
        ratios = [
            np.where(share[k] > 0, self._leverage(X, k) / self.leverage_limit[k], 0.0)
            for k in range(self.n_pieces)
        ]
        return np.asarray(np.max(ratios, axis=0))

    def half_width(self, X: RealArray, coverage: float, weight: RealArray) -> RealArray:
        """Half width of the interval that covers one new observation.

        Parameters
        ----------
        X : array, shape (n, n_features)
            Where.
        coverage : float
            Probability, between 0 and 1.
        weight : array, shape (n,)
            Of the new observations; the variance of an observation is inverse to its weight.

        Returns
        -------
        array, shape (n, n_outputs)
            In the unit of the outputs.

        Raises
        ------
        InputError
            A coverage outside of ]0, 1[, or a fit without degrees of freedom.

        Notes
        -----
        ``t σ √(1/w + h)`` with Student's t and the leverage h, per piece, blended like the values
        (two pieces that share rows are taken as fully dependent).
        """
        if not 0 < coverage < 1:
            raise InputError(f"a coverage lies between 0 and 1, not {coverage}")
        if np.any(self.degrees_of_freedom < 1):
            raise InputError(
                "as many terms as rows leave no residuals: an interval needs more rows"
            )
        share, _ = self._shares(X)
        half_width = np.zeros((len(X), self.coefficients.shape[2]))
        for k in range(self.n_pieces):
            spread = np.sqrt(1 / weight + self._leverage(X, k))
            quantile = stdtrit(self.degrees_of_freedom[k], 0.5 + coverage / 2)
            half_width += np.outer(share[k] * quantile * spread, np.sqrt(self.variance[k]))
        return half_width

    def scaled(self, factor: float) -> PiecewiseCubic:
        """Multiply every value by `factor`."""
        return replace(
            self,
            coefficients=factor * self.coefficients,
            variance=factor**2 * self.variance,
        )

    def _terms(self, X: RealArray, piece: int) -> RealArray:
        return cubic_terms((X - self.centre[piece]) / self.half_range[piece])

    def _leverage(self, X: RealArray, piece: int) -> RealArray:
        return leverage(
            self._terms(X, piece),
            self.directions[piece],
            self.inverse_singular[piece],
            float(self.unseen_leverage[piece]),
        )

    def _shares(self, X: RealArray) -> tuple[RealArray, RealArray]:
        """Share of each piece at each row, and its slope along the split variable."""
        position = X[:, self.split_feature]
        # how far each split point lies behind: 0 before it, 1 beyond
        passed = np.zeros((self.n_pieces + 1, len(X)))
        slope = np.zeros_like(passed)
        passed[0] = 1.0
        for k, split in enumerate(self.split_points, start=1):
            if self.blend_width > 0:
                ramp = (position - split) / self.blend_width + 0.5
                passed[k] = np.clip(ramp, 0.0, 1.0)
                slope[k] = ((ramp > 0) & (ramp < 1)) / self.blend_width
            else:
                passed[k] = position > split
        return passed[:-1] - passed[1:], slope[:-1] - slope[1:]


def leverage(
    terms: RealArray, directions: RealArray, inverse_singular: RealArray, unseen: float
) -> RealArray:
    """Leverage of rows of terms in a least-squares fit, also where it has less than full rank.

    Parameters
    ----------
    terms : array, shape (n, n_terms)
        Rows ``a``.
    directions : array, shape (n_terms, n_directions)
        Right singular vectors ``v`` of the rows fitted.
    inverse_singular : array, shape (n_directions,)
        ``1/s`` [1].
    unseen : float
        Leverage of a unit step across all directions.

    Returns
    -------
    array, shape (n,)
        ``h = Σ (a·v/s)²``, and what the rows fitted never saw on top.
    """
    along = terms @ directions
    along_squared = np.sum((along * inverse_singular) ** 2, axis=1)
    if np.count_nonzero(inverse_singular) < len(directions):
        along_squared += unseen * np.sum((terms - along @ directions.T) ** 2, axis=1)
    return np.asarray(along_squared)
