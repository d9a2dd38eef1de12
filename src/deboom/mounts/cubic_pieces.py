"""Complete cubic polynomials in pieces along one variable: terms, least squares, values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from itertools import combinations_with_replacement

import numpy as np
import numpy.typing as npt
from scipy.stats import t as student

from deboom.errors import InputError
from deboom.physics.arrays import RealArray

_FIELD_TYPES = {"split_feature": int, "blend_width": float}


def cubic_exponents(n_features: int) -> npt.NDArray[np.int64]:
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
    terms = [
        np.bincount(np.array(chosen, dtype=int), minlength=n_features)
        for degree in range(4)
        for chosen in combinations_with_replacement(range(n_features), degree)
    ]
    return np.array(terms, dtype=np.int64)


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


def _monomials(scaled: RealArray, exponents: npt.NDArray[np.int64]) -> RealArray:
    powers = np.stack([np.ones_like(scaled), scaled, scaled**2, scaled**3])
    terms = np.ones((len(scaled), len(exponents)))
    for feature in range(scaled.shape[1]):
        terms *= powers[exponents[:, feature], :, feature].T
    return terms


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
        Scaling of each piece's variables to [-1, 1] over its own data.
    coefficients : array, shape (n_pieces, n_terms, n_outputs)
        Of the terms in scaled variables.
    leverage_factor : array, shape (n_pieces, n_terms, n_terms)
        ``L`` with ``h = |a L|²`` the leverage of a row of terms ``a``.
    variance : array, shape (n_pieces, n_outputs)
        Of the residuals at unit weight; not finite without degrees of freedom.
    degrees_of_freedom : array, shape (n_pieces,)
        Rows less independent terms, per piece.

    Notes
    -----
    Outside of the data the polynomials go on; `deboom.mounts.training_region` says where that is.
    """

    split_feature: int
    split_points: RealArray
    blend_width: float
    centre: RealArray
    half_range: RealArray
    coefficients: RealArray
    leverage_factor: RealArray
    variance: RealArray
    degrees_of_freedom: RealArray

    def __post_init__(self) -> None:
        for field in fields(self):
            if field.name not in _FIELD_TYPES:
                array = np.array(getattr(self, field.name), dtype=float)
                array.setflags(write=False)
                object.__setattr__(self, field.name, array)

    @property
    def n_pieces(self) -> int:
        """Number of pieces."""
        return len(self.centre)

    def __call__(self, X: RealArray) -> RealArray:
        """Values at `X` (n, n_features), shape (n, n_outputs)."""
        share, _ = self._shares(X)
        pieces = np.stack(
            [
                cubic_terms(self._scaled(X, k)) @ self.coefficients[k]
                for k in range(self.n_pieces)
            ]
        )
        return np.asarray(np.einsum("kn,kno->no", share, pieces))

    def gradient(self, X: RealArray) -> RealArray:
        """Derivative by every variable at `X` (n, n_features), shape (n, n_features, n_outputs)."""
        share, slope = self._shares(X)
        exponents = cubic_exponents(X.shape[1])
        gradient = np.zeros((*X.shape, self.coefficients.shape[2]))
        for k in range(self.n_pieces):
            scaled = self._scaled(X, k)
            for feature in range(X.shape[1]):
                lowered = exponents.copy()
                lowered[:, feature] = np.maximum(lowered[:, feature] - 1, 0)
                weighted = exponents[:, feature, np.newaxis] * self.coefficients[k]
                by_scaled = _monomials(scaled, lowered) @ weighted
                gradient[:, feature] += share[k][:, None] * by_scaled / self.half_range[k, feature]
            value = _monomials(scaled, exponents) @ self.coefficients[k]
            gradient[:, self.split_feature] += slope[k][:, np.newaxis] * value
        return gradient

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
                "a fit with as many terms as rows has no residuals: an interval needs more data"
            )
        share, _ = self._shares(X)
        half_width = np.zeros((len(X), self.coefficients.shape[2]))
        for k in range(self.n_pieces):
            projected = cubic_terms(self._scaled(X, k)) @ self.leverage_factor[k]
            spread = np.sqrt(1 / weight + np.sum(projected**2, axis=1))
            quantile = student.ppf(0.5 + coverage / 2, self.degrees_of_freedom[k])
            half_width += np.outer(share[k] * quantile * spread, np.sqrt(self.variance[k]))
        return half_width

    def scaled(self, factor: float) -> PiecewiseCubic:
        """The same pieces with every value multiplied by `factor`."""
        return replace(
            self,
            coefficients=factor * self.coefficients,
            variance=factor**2 * self.variance,
        )

    def to_arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """Every field as a named array; `from_arrays` gives the same object back, bit for bit."""
        return {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[np.generic]]) -> PiecewiseCubic:
        """Build the object from the arrays of `to_arrays`; InputError names what is missing."""
        values = {}
        for field in fields(cls):
            if field.name not in arrays:
                raise InputError(f"no array {field.name}: a piecewise cubic needs all its arrays")
            kind = _FIELD_TYPES.get(field.name)
            values[field.name] = kind(arrays[field.name]) if kind else arrays[field.name]
        return cls(**values)

    def _scaled(self, X: RealArray, piece: int) -> RealArray:
        return (X - self.centre[piece]) / self.half_range[piece]

    def _shares(self, X: RealArray) -> tuple[RealArray, RealArray]:
        """Share of each piece at each row, and its slope along the split variable."""
        position = X[:, self.split_feature]
        # handed over from piece k to piece k + 1: 0 before the split point, 1 behind it
        behind = np.ones((self.n_pieces + 1, len(X)))
        slope = np.zeros_like(behind)
        behind[-1] = 0.0
        for k, split in enumerate(self.split_points, start=1):
            if self.blend_width > 0:
                ramp = (position - split) / self.blend_width + 0.5
                behind[k] = np.clip(ramp, 0.0, 1.0)
                slope[k] = ((ramp > 0) & (ramp < 1)) / self.blend_width
            else:
                behind[k] = position > split
        return behind[:-1] - behind[1:], slope[:-1] - slope[1:]


def fit_pieces(
    X: RealArray,
    y: RealArray,
    weight: RealArray,
    split_feature: int,
    split_points: RealArray,
    overlap: float,
) -> PiecewiseCubic:
    """Least-squares cubics on both sides of given split points.

    Parameters
    ----------
    X : array, shape (n, n_features)
        Variables.
    y : array, shape (n, n_outputs)
        Observations.
    weight : array, shape (n,)
        Positive; inverse to the variance of each row.
    split_feature : int
        Column that is cut.
    split_points : array, shape (n_pieces - 1,)
        Increasing, in the unit of that column.
    overlap : float
        Fraction of the column's range over which neighbours share rows and are blended.

    Returns
    -------
    PiecewiseCubic

    Raises
    ------
    InputError
        A piece without rows.

    Notes
    -----
    Orthogonal triangularisation and a singular value decomposition of the triangle; terms that the
    rows cannot tell apart get the shortest coefficients. No normal equations.
    """
    position = X[:, split_feature]
    blend_width = overlap * float(np.ptp(position))
    bounds = np.concatenate([[-np.inf], np.asarray(split_points, dtype=float), [np.inf]])
    pieces = []
    for low, high in zip(bounds[:-1], bounds[1:], strict=True):
        # a piece owns its upper end, as the shares do when nothing is blended
        rows = (position > low - blend_width / 2) & (position <= high + blend_width / 2)
        if not rows.any():
            raise InputError(f"no rows between the split points {low:g} and {high:g}")
        pieces.append(_fit_one(X[rows], y[rows], weight[rows]))
    stacked = (np.stack(column) for column in zip(*pieces, strict=True))
    return PiecewiseCubic(split_feature, bounds[1:-1], blend_width, *stacked)


def scaling(X: RealArray) -> tuple[RealArray, RealArray]:
    """Centre and half range of each column; a constant column gets the half range 1."""
    low, high = X.min(axis=0), X.max(axis=0)
    half_range = (high - low) / 2
    return (low + high) / 2, np.where(half_range > 0, half_range, 1.0)


def _fit_one(X: RealArray, y: RealArray, weight: RealArray) -> tuple[RealArray, ...]:
    centre, half_range = scaling(X)
    terms = cubic_terms((X - centre) / half_range)
    root = np.sqrt(weight)[:, np.newaxis]
    n_rows, n_terms = terms.shape
    triangle = np.linalg.qr(np.hstack([root * terms, root * y]), mode="r")
    left, singular, right = np.linalg.svd(triangle[:, :n_terms], full_matrices=False)
    rank = int(np.sum(singular > singular[0] * max(n_rows, n_terms) * np.finfo(float).eps))
    leverage_factor = np.zeros((n_terms, n_terms))
    leverage_factor[:, :rank] = right[:rank].T / singular[:rank]
    coefficients = leverage_factor[:, :rank] @ (left[:, :rank].T @ triangle[:, n_terms:])
    degrees_of_freedom = n_rows - rank
    squares = np.sum((root * (y - terms @ coefficients)) ** 2, axis=0)
    variance = squares / degrees_of_freedom if degrees_of_freedom else np.full_like(squares, np.nan)
    return (
        centre,
        half_range,
        coefficients,
        leverage_factor,
        variance,
        np.array(float(degrees_of_freedom)),
    )
