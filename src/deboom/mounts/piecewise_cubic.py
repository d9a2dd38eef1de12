"""Complete cubic polynomials in pieces along one variable, as a scikit-learn regressor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from itertools import combinations_with_replacement, pairwise
from math import comb
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree
from scipy.special import stdtrit
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import _check_sample_weight, check_is_fitted, validate_data

from deboom.arrays import RealArray
from deboom.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    D = TypeVar("D", bound=DataclassInstance)

NamedArrays = dict[str, npt.NDArray[Any]]


def to_arrays(value: DataclassInstance, prefix: str = "") -> NamedArrays:
    """Every constructor argument of a dataclass as an array named `prefix` + field."""
    return {
        prefix + field.name: np.asarray(getattr(value, field.name))
        for field in fields(value)
        if field.init
    }


def from_arrays(kind: type[D], arrays: Mapping[str, npt.NDArray[Any]], prefix: str = "") -> D:
    """Build a dataclass from the arrays of `to_arrays`.

    Parameters
    ----------
    kind : type
        A dataclass whose constructor takes arrays, scalars as arrays without dimension.
    arrays : mapping of str to array
        Others than those of `kind` are left alone.
    prefix : str
        Before each name.

    Returns
    -------
    object of `kind`

    Raises
    ------
    InputError
        An array is missing; named.
    """
    names = [field.name for field in fields(kind) if field.init]
    missing = [prefix + name for name in names if prefix + name not in arrays]
    if missing:
        raise InputError(f"a stored {kind.__name__} lacks the arrays {missing}: store it again")
    return kind(**{name: arrays[prefix + name] for name in names})


def freeze(value: DataclassInstance, *names: str) -> None:
    """Replace the named fields of a frozen dataclass by read-only float copies."""
    for name in names:
        array = np.array(getattr(value, name), dtype=float)
        array.setflags(write=False)
        object.__setattr__(value, name, array)


REACH = 0.1
"""How far a measured row vouches for its surroundings, as a fraction of the ranges."""

MARGIN = 0.02
"""How far beyond its range a variable may lie, as a fraction of the range: measuring noise."""

THINNING = 4
"""Rows closer together than a reach over this number, in every variable, are represented by one."""


@dataclass(frozen=True, eq=False)
class TrainingRegion:
    """The surroundings of the measured rows, holes left out.

    Parameters
    ----------
    points : array, shape (n_points, n_features)
        Measured rows, thinned.
    lower, upper : array, shape (n_features,)
        Range of each variable over all measured rows.
    reach : float
        Greatest distance from a measured row, each variable in fractions of its range [1].

    Notes
    -----
    A row belongs to the region if no variable leaves its range by more than 2 % of it and a
    measured row lies within the reach. A convex hull is no guard for runs: they are curves, and
    most of the hull about them was never visited: with 27 runs of the virtual bench a cubic surface
    is wrong by 13 to 27 % in the median at points inside of the hull, 0.2 to 0.3 of the ranges away
    from any row, and by 0.1 to 0.6 % within 0.025.
    """

    points: RealArray
    lower: RealArray
    upper: RealArray
    reach: float
    _tree: cKDTree = field(init=False, repr=False)

    def __post_init__(self) -> None:
        freeze(self, "points", "lower", "upper")
        object.__setattr__(self, "reach", float(self.reach))
        object.__setattr__(self, "_tree", cKDTree(self._fractions(self.points)))

    @classmethod
    def around(cls, X: RealArray, reach: float = REACH) -> TrainingRegion:
        """Region about the rows of `X` (n, n_features).

        Raises
        ------
        InputError
            A reach that is not positive.
        """
        if not reach > 0:
            raise InputError(f"the reach of measured rows is above 0, not {reach}")
        lower, upper = X.min(axis=0), X.max(axis=0)
        fractions = (X - lower) / np.where(upper > lower, upper - lower, 1.0)
        cells = np.floor(fractions * THINNING / reach)
        kept = np.sort(np.unique(cells, axis=0, return_index=True)[1])
        return cls(X[kept], lower, upper, reach)

    def distance(self, X: RealArray) -> RealArray:
        """Distance of each row of `X` (n, n_features) from the next measured one [1]."""
        return np.asarray(self._tree.query(self._fractions(X))[0], dtype=float)

    def in_range(self, X: RealArray) -> npt.NDArray[np.bool_]:
        """Which variables of `X` (n, n_features) lie in their range, same shape."""
        # rounding alone must not put a row of a constant variable outside
        slack = MARGIN * (self.upper - self.lower) + 1e-12 * np.abs(self.upper)
        return np.asarray((self.lower - slack <= X) & (self.upper + slack >= X))

    def contains(self, X: RealArray) -> npt.NDArray[np.bool_]:
        """Whether each row of `X` (n, n_features) lies in the region, shape (n,)."""
        return self.in_range(X).all(axis=1) & (self.distance(X) <= self.reach)

    def _fractions(self, X: RealArray) -> RealArray:
        return (X - self.lower) / np.where(self.upper > self.lower, self.upper - self.lower, 1.0)


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
    Orthogonal triangularisation and a singular value decomposition of the triangle, no normal
    equations. Terms that the rows cannot tell apart get the shortest coefficients, and their
    directions a very large leverage.
    """
    position = X[:, split_feature]
    blend_width = overlap * float(np.ptp(position))
    bounds = np.concatenate([[-np.inf], np.asarray(split_points, dtype=float), [np.inf]])
    pieces = []
    for low, high in pairwise(bounds):
        # a piece owns its upper end, as the shares do when nothing is blended
        rows = (position > low - blend_width / 2) & (position <= high + blend_width / 2)
        if not rows.any():
            raise InputError(f"no rows between the split points {low:g} and {high:g}")
        pieces.append(_fit_one(X[rows], y[rows], weight[rows]))
    return _joined(split_feature, bounds[1:-1], blend_width, pieces)


@dataclass(frozen=True, eq=False)
class _Piece:
    """One cubic, as `PiecewiseCubic` stacks them."""

    centre: RealArray
    half_range: RealArray
    coefficients: RealArray
    directions: RealArray
    inverse_singular: RealArray
    unseen_leverage: float
    leverage_limit: float
    variance: RealArray
    degrees_of_freedom: int


def _fit_one(X: RealArray, y: RealArray, weight: RealArray) -> _Piece:
    centre, half_range = scaling(X)
    terms = cubic_terms((X - centre) / half_range)
    root = np.sqrt(weight)[:, np.newaxis]
    n_rows, n_terms = terms.shape
    triangle = np.asarray(np.linalg.qr(np.hstack([root * terms, root * y]), mode="r"))
    left, singular, right = np.linalg.svd(triangle[:, :n_terms], full_matrices=False)
    smallest = float(singular[0]) * max(n_rows, n_terms) * np.finfo(float).eps
    rank = int(np.sum(singular > smallest))
    directions, inverse_singular = right[:rank].T, 1 / singular[:rank]
    on_directions = left[:, :rank].T @ triangle[:, n_terms:]
    coefficients = directions @ (inverse_singular[:, np.newaxis] * on_directions)
    squares = np.sum((root * (y - terms @ coefficients)) ** 2, axis=0)
    freedom = n_rows - rank
    unseen = smallest**-2
    return _Piece(
        centre=centre,
        half_range=half_range,
        coefficients=coefficients,
        directions=directions,
        inverse_singular=inverse_singular,
        unseen_leverage=unseen,
        leverage_limit=float(leverage(terms, directions, inverse_singular, unseen).max()),
        variance=squares / freedom if freedom else np.full_like(squares, np.nan),
        degrees_of_freedom=freedom,
    )


def _joined(
    split_feature: int, split_points: RealArray, blend_width: float, pieces: list[_Piece]
) -> PiecewiseCubic:
    most = max(piece.directions.shape[1] for piece in pieces)

    def padded(array: RealArray) -> RealArray:
        missing = most - array.shape[-1]
        return np.pad(array, [(0, 0)] * (array.ndim - 1) + [(0, missing)])

    return PiecewiseCubic(
        split_feature=split_feature,
        split_points=split_points,
        blend_width=blend_width,
        centre=np.stack([piece.centre for piece in pieces]),
        half_range=np.stack([piece.half_range for piece in pieces]),
        coefficients=np.stack([piece.coefficients for piece in pieces]),
        directions=np.stack([padded(piece.directions) for piece in pieces]),
        inverse_singular=np.stack([padded(piece.inverse_singular) for piece in pieces]),
        unseen_leverage=np.array([piece.unseen_leverage for piece in pieces]),
        leverage_limit=np.array([piece.leverage_limit for piece in pieces]),
        variance=np.stack([piece.variance for piece in pieces]),
        degrees_of_freedom=np.array([piece.degrees_of_freedom for piece in pieces]),
    )


IntArray = npt.NDArray[np.int64]

COARSE_BLOCKS = 48
"""Blocks of about the same number of rows in the first search."""

ZOOM_CUTS = 16
"""Candidates on each side of a cut in every refinement of the search."""

RIDGE = 1e-10
"""Keeps the squares defined where rows cannot tell terms apart; far below any noise."""


class Segments:
    """Rows sorted along the split variable. A cut is the index of the first row behind it.

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
    min_rows : int
        Distinct rows that a segment holds at least.

    Attributes
    ----------
    cuts : array of int, shape (n_cuts,)
        Every place where the split variable changes, and both ends.
    divisible : bool
        Whether there are rows for two segments.
    total : float
        Weighted squares of the observations about 0, in units of each output's variance.
    """

    def __init__(
        self, X: RealArray, y: RealArray, weight: RealArray, split_feature: int, min_rows: int
    ) -> None:
        order = np.argsort(X[:, split_feature], kind="stable")
        self._position = X[order, split_feature]
        self._min_rows = min_rows
        self._n_outputs = y.shape[1]
        centre, half_range = scaling(X)
        spread = y.std(axis=0)
        self._output_scale = np.where(spread > 0, spread, 1.0)
        terms = cubic_terms((X[order] - centre) / half_range)
        root = np.sqrt(weight[order])[:, np.newaxis]
        self.total = float(np.sum((root * y[order] / self._output_scale) ** 2))
        self._rows = root * np.hstack([terms, y[order] / self._output_scale])
        # equal rows count once, so that a repeated row and a doubled weight mean the same
        is_new = np.zeros(len(order), dtype=np.int64)
        is_new[np.unique(X[order], axis=0, return_index=True)[1]] = 1
        self._distinct_before = np.concatenate([[0], np.cumsum(is_new)])
        self._weight_before = np.concatenate([[0.0], np.cumsum(weight[order])])
        sizes = np.cumsum(weight[order, np.newaxis] * np.abs(y[order]), axis=0)
        self._size_before = np.vstack([np.zeros(self._n_outputs), sizes])
        inner = np.flatnonzero(np.diff(self._position)) + 1
        self.cuts = np.concatenate([[0], inner, [len(order)]])
        self.divisible = int(self._distinct_before[-1]) >= 2 * min_rows

    def split_points(self, cuts: IntArray) -> RealArray:
        """Values of the split variable half way between the rows on both sides of each cut."""
        return np.asarray((self._position[cuts - 1] + self._position[cuts]) / 2)

    def coarse_edges(self) -> IntArray:
        """Cuts that part the distinct rows into blocks of about the same size, with both ends."""
        wanted = np.linspace(0, self._distinct_before[-1], COARSE_BLOCKS + 1)
        nearest = np.searchsorted(self._distinct_before[self.cuts], wanted)
        return np.unique(self.cuts[np.minimum(nearest, len(self.cuts) - 1)])

    def edges_near(self, chosen: IntArray, radius: int) -> IntArray:
        """Pick up to 32 cuts within `radius` cuts of each chosen one, with both ends."""
        steps = np.linspace(-radius, radius, 2 * ZOOM_CUTS + 1).round().astype(np.int64)
        places = np.searchsorted(self.cuts, chosen)[:, np.newaxis] + steps
        inside = np.clip(places, 0, len(self.cuts) - 1).ravel()
        return np.unique(np.concatenate([self.cuts[[0, -1]], self.cuts[inside]]))

    def squares(self, edges: IntArray) -> RealArray:
        """Weighted squares that one cubic leaves between two edges.

        Parameters
        ----------
        edges : array of int, shape (n_edges,)
            Increasing cuts.

        Returns
        -------
        array, shape (n_edges, n_edges, n_outputs)
            By first and last edge, in units of each output's variance; infinite where a segment
            has too few rows.

        Notes
        -----
        Each block is reduced to its triangle once; a segment grows by one block when the two
        triangles are stacked and triangularised again (updating of a QR factorisation).
        """
        n_columns = self._rows.shape[1]
        n_terms = n_columns - self._n_outputs
        n_blocks = len(edges) - 1
        blocks = np.zeros((n_blocks, n_columns, n_columns))
        for block in range(n_blocks):
            triangle = np.linalg.qr(self._rows[edges[block] : edges[block + 1]], mode="r")
            blocks[block, : len(triangle)] = triangle
        empty = np.diag(np.repeat([RIDGE, 0.0], [n_terms, self._n_outputs]))
        grown = np.repeat(empty[np.newaxis], n_blocks, axis=0)
        squares = np.full((n_blocks + 1, n_blocks + 1, self._n_outputs), np.inf)
        for last in range(n_blocks):
            begun = slice(0, last + 1)
            added = np.broadcast_to(blocks[last], (last + 1, n_columns, n_columns))
            grown[begun] = np.linalg.qr(np.concatenate([grown[begun], added], axis=1), mode="r")
            squares[begun, last + 1] = np.sum(grown[begun, n_terms:, n_terms:] ** 2, axis=1)
        counts = self._distinct_before[edges]
        squares[counts[np.newaxis, :] - counts[:, np.newaxis] < self._min_rows] = np.inf
        return squares

    def left_over(self, cuts: IntArray) -> float:
        """Weighted squares that separate cubics leave between the given cuts, as `squares`."""
        edges = np.concatenate([self.cuts[:1], cuts, self.cuts[-1:]])
        squares = self.squares(edges)
        return float(sum(squares[k, k + 1].sum() for k in range(len(edges) - 1)))

    def relative_error(self, edges: IntArray, squares: RealArray) -> RealArray:
        """Rms error over mean absolute value between two edges, the worst of the outputs.

        Parameters
        ----------
        edges : array of int, shape (n_edges,)
            Increasing cuts.
        squares : array, shape (n_edges, n_edges, n_outputs)
            Of the same edges.

        Returns
        -------
        array, shape (n_edges, n_edges)
            [1]; infinite where the squares are.
        """
        weights = np.subtract.outer(self._weight_before[edges], self._weight_before[edges]).T
        size = self._size_before[edges]
        sizes = size[np.newaxis, :] - size[:, np.newaxis]
        error = np.full(squares.shape, np.inf)
        done = np.isfinite(squares)
        weights = np.broadcast_to(weights[:, :, np.newaxis], squares.shape)[done]
        rms = np.sqrt((squares * self._output_scale**2)[done] / weights)
        mean = np.maximum(sizes[done] / weights, np.finfo(float).tiny)
        error[done] = rms / mean
        return np.asarray(error.max(axis=2))


Chooser = Callable[[IntArray, RealArray], IntArray | None]

EXACT = 1e-18
"""Squares left over squares of the observations, below which more pieces describe only rounding."""


def least_squares_splits(segments: Segments, max_pieces: int) -> list[RealArray]:
    """Split points of the best 1, 2, … `max_pieces` separate cubics.

    Parameters
    ----------
    segments : Segments
        The rows.
    max_pieces : int
        At most so many pieces.

    Returns
    -------
    list of array, shape (n_pieces - 1,)
        For 1, 2, … pieces, as far as there are rows for them and errors to describe.

    Notes
    -----
    Dynamic programming over the segments between blocks (Bai and Perron, J. Applied Econometrics
    18, 2003), then the same between ever closer cuts about the chosen ones, down to single rows:
    the global optimum between blocks, a local one inside of them.
    """
    found = [np.empty(0, dtype=np.int64)]
    if max_pieces == 1 or not segments.divisible:
        return [np.empty(0)]
    edges = segments.coarse_edges()
    squares = segments.squares(edges)
    for n_pieces in range(2, max_pieces + 1):

        def choose(edges: IntArray, squares: RealArray, n: int = n_pieces) -> IntArray | None:
            return _best_cuts(edges, squares, n)

        chosen = choose(edges, squares)
        if chosen is None or segments.left_over(found[-1]) <= EXACT * segments.total:
            break
        found.append(_refined(segments, edges, chosen, choose))
    return [segments.split_points(cuts) for cuts in found]


def threshold_splits(segments: Segments, max_pieces: int, threshold: float) -> RealArray | None:
    """Split points where a growing cubic's error passes a threshold.

    Parameters
    ----------
    segments : Segments
        The rows.
    max_pieces : int
        At most so many pieces.
    threshold : float
        Largest rms error of a piece over the mean absolute value of its rows [1].

    Returns
    -------
    array, shape (n_pieces - 1,), or None
        None if even the shortest first piece is worse than the threshold.

    Notes
    -----
    Thesis, 3.5: from the low end, a piece reaches as far as its error allows; the last piece takes
    what is left, whatever its error.
    """

    def choose(edges: IntArray, squares: RealArray) -> IntArray | None:
        error = segments.relative_error(edges, squares)
        room_behind = np.isfinite(squares[:, -1, 0])
        begin = 0
        chosen: list[int] = []
        while len(chosen) < max_pieces - 1 and not error[begin, -1] <= threshold:
            reached = np.flatnonzero((error[begin] <= threshold) & room_behind)
            if not reached.size:
                break
            begin = int(reached[-1])
            chosen.append(begin)
        good = bool(chosen) or bool(error[0, -1] <= threshold) or max_pieces == 1
        return edges[np.array(chosen, dtype=np.int64)] if good else None

    if not segments.divisible:
        return np.empty(0)
    edges = segments.coarse_edges()
    chosen = choose(edges, segments.squares(edges))
    if chosen is None:
        return None
    return segments.split_points(_refined(segments, edges, chosen, choose))


def cross_validated_splits(
    X: RealArray,
    y: RealArray,
    weight: RealArray,
    fold: IntArray,
    split_feature: int,
    min_rows: int,
    max_pieces: int,
    overlap: float,
) -> RealArray:
    """Split points of as many pieces as predict rows left out.

    Parameters
    ----------
    X : array, shape (n, n_features)
        Variables.
    y : array, shape (n, n_outputs)
        Observations.
    weight : array, shape (n,)
        Positive; inverse to the variance of each row.
    fold : array of int, shape (n,)
        Each row is left out together with the rows of the same number.
    split_feature, min_rows : int
        As in `Segments`.
    max_pieces : int
        At most so many pieces.
    overlap : float
        As in `fit_pieces`.

    Returns
    -------
    array, shape (n_pieces - 1,)

    Raises
    ------
    InputError
        Fewer than two folds that lie in the region of the others.

    Notes
    -----
    Scored on the rows left out that the others hold for every number of pieces (region and
    leverage), so that no extrapolation decides. Of the numbers of pieces whose score is worse than
    the best by less than one standard error of that difference over the folds, the smallest is
    taken. Neighbouring lines of one run are no independent witnesses: leave out whole runs, or too
    many pieces win.
    """
    found = least_squares_splits(Segments(X, y, weight, split_feature, min_rows), max_pieces)
    if len(found) == 1:
        return found[0]
    spread = y.std(axis=0)
    scale = np.where(spread > 0, spread, 1.0)
    scores = []
    for number in np.unique(fold):
        kept, left_out = fold != number, fold == number
        if kept.any():
            left_out &= TrainingRegion.around(X[kept]).contains(X)
        if not (kept.any() and left_out.any()):
            continue
        segments = Segments(X[kept], y[kept], weight[kept], split_feature, min_rows)
        fits = [
            fit_pieces(X[kept], y[kept], weight[kept], split_feature, split_points, overlap)
            for split_points in least_squares_splits(segments, len(found))
        ]
        held = [pieces.leverage_ratio(X) <= 1 for pieces in fits]
        left_out &= np.all(held, axis=0)
        if not left_out.any():
            continue
        score = np.full(len(found), np.inf)
        for k, pieces in enumerate(fits):
            error = np.sum(((pieces(X[left_out]) - y[left_out]) / scale) ** 2, axis=1)
            score[k] = np.average(error, weights=weight[left_out])
        scores.append(score)
    if len(scores) < 2:
        raise InputError(
            "the number of pieces cannot be cross-validated: the runs left out lie where the "
            "others were not measured; ask for a number of pieces"
        )
    by_fold = np.array(scores)
    best = int(np.argmin(by_fold.mean(axis=0)))
    for k in range(best):
        loss = by_fold[:, k] - by_fold[:, best]
        if np.all(np.isfinite(loss)) and loss.mean() <= loss.std(ddof=1) / np.sqrt(len(loss)):
            return found[k]
    return found[best]


def _refined(segments: Segments, edges: IntArray, chosen: IntArray, choose: Chooser) -> IntArray:
    """Repeat the choice between ever closer cuts about the chosen ones, down to single rows."""
    places = np.searchsorted(segments.cuts, edges)
    radius = int(np.max(np.diff(places)))
    while chosen.size:
        near = segments.edges_near(chosen, radius)
        again = choose(near, segments.squares(near))
        chosen = chosen if again is None else again
        if radius <= ZOOM_CUTS:
            break
        radius = max(radius // 8, ZOOM_CUTS)
    return chosen


def _best_cuts(edges: IntArray, squares: RealArray, n_pieces: int) -> IntArray | None:
    """Cuts of the segmentation into `n_pieces` with the least squares, None if there is none."""
    cost = squares.sum(axis=2)
    reached = cost[0]
    came_from = []
    for _ in range(n_pieces - 1):
        through = reached[:, np.newaxis] + cost
        came_from.append(np.argmin(through, axis=0))
        reached = np.min(through, axis=0)
    if not np.isfinite(reached[-1]):
        return None
    cuts = [len(edges) - 1]
    for step in reversed(came_from):
        cuts.append(int(step[cuts[-1]]))
    inner: IntArray = edges[np.array(cuts[:0:-1])]
    return inner


@dataclass(frozen=True, eq=False)
class PieceOptions:
    """How many pieces, and where they meet.

    Parameters
    ----------
    split_feature : int
        Column that is cut.
    pieces : int or "cv"
        Number of pieces at most; "cv" chooses between 1 and `max_pieces` by cross-validation.
    split : "least-squares", "threshold" or sequence of float
        The best split points in the sense of least squares; where the error of a growing piece
        passes `threshold` (thesis, 3.5), or least squares if even the shortest piece does; or the
        split points themselves.
    threshold : float
        Relative rms error that a piece may have [1].
    overlap : float
        Fraction of the range of the split variable over which neighbours share rows and are
        blended [1].
    max_pieces, folds : int
        For "cv".
    min_rows : int or None
        Distinct rows that a piece holds at least; None is twice the number of terms.

    Raises
    ------
    InputError
        A value that makes no sense; named.
    """

    split_feature: int = 0
    pieces: int | Literal["cv"] = 2
    split: Literal["least-squares", "threshold"] | npt.ArrayLike = "least-squares"
    threshold: float = 0.03
    overlap: float = 0.02
    max_pieces: int = 5
    folds: int = 5
    min_rows: int | None = None

    def __post_init__(self) -> None:
        for name, least in (("split_feature", 0), ("max_pieces", 1), ("folds", 2)):
            _whole_number(name, getattr(self, name), least)
        if self.pieces != "cv":
            _whole_number("pieces", self.pieces, 1, ' or "cv"')
        if self.min_rows is not None:
            _whole_number("min_rows", self.min_rows, 1)
        if not self.threshold > 0:
            raise InputError(f"threshold is a relative error above 0, not {self.threshold!r}")
        if not 0 <= self.overlap < 1:
            raise InputError(f"overlap is a fraction of at least 0 and below 1: {self.overlap!r}")
        if isinstance(self.split, str) and self.split not in ("least-squares", "threshold"):
            raise InputError(
                f'split is "least-squares", "threshold" or split points, not {self.split!r}'
            )


def fit_piecewise_cubic(
    X: RealArray,
    y: RealArray,
    weight: RealArray,
    options: PieceOptions,
    groups: npt.ArrayLike | None = None,
) -> PiecewiseCubic:
    """Fit complete cubics in pieces along one variable.

    Parameters
    ----------
    X : array, shape (n, n_features)
        Variables, finite.
    y : array, shape (n, n_outputs)
        Observations, finite.
    weight : array, shape (n,)
        Positive; inverse to the variance of each row.
    options : PieceOptions
        How many pieces and where they meet.
    groups : array, shape (n,), optional
        Rows of one group (one run) are left out together in the cross-validation. Without it,
        every `folds`-th row along the split variable is, which suits independent rows only.

    Returns
    -------
    PiecewiseCubic

    Raises
    ------
    InputError
        A split variable that does not exist, split points that do not increase within its range.
    """
    n_features = X.shape[1]
    if options.split_feature >= n_features:
        raise InputError(
            f"split_feature {options.split_feature} does not exist: there are {n_features} "
            "variables, counted from 0"
        )
    min_rows = options.min_rows or 2 * comb(n_features + 3, 3)
    if not isinstance(options.split, str):
        split_points = _given_points(options.split, X[:, options.split_feature])
    elif options.pieces == "cv":
        fold = _folds(X[:, options.split_feature], options.folds, groups)
        split_points = cross_validated_splits(
            X,
            y,
            weight,
            fold,
            options.split_feature,
            min_rows,
            options.max_pieces,
            options.overlap,
        )
    else:
        segments = Segments(X, y, weight, options.split_feature, min_rows)
        by_threshold = None
        if options.split == "threshold":
            by_threshold = threshold_splits(segments, options.pieces, options.threshold)
        split_points = (
            least_squares_splits(segments, options.pieces)[-1]
            if by_threshold is None
            else by_threshold
        )
    return fit_pieces(X, y, weight, options.split_feature, split_points, options.overlap)


def _folds(position: RealArray, n_folds: int, groups: npt.ArrayLike | None) -> IntArray:
    if groups is not None:
        number = np.unique(np.asarray(groups), return_inverse=True)[1]
        return np.asarray(number % n_folds, dtype=np.int64)
    fold = np.empty(len(position), dtype=np.int64)
    fold[np.argsort(position, kind="stable")] = np.arange(len(position)) % n_folds
    return fold


def _given_points(split: npt.ArrayLike, position: RealArray) -> RealArray:
    points = np.atleast_1d(np.asarray(split, dtype=float))
    inside = np.all((points > position.min()) & (points < position.max()))
    if points.ndim != 1 or not inside or np.any(np.diff(points) <= 0):
        raise InputError(
            f"split points {points.tolist()} must increase within the range "
            f"{position.min():g} to {position.max():g} of the split variable"
        )
    return points


def _whole_number(name: str, value: Any, least: int, others: str = "") -> None:
    if not isinstance(value, Integral) or value < least:
        raise InputError(f"{name} is a whole number of at least {least}{others}, not {value!r}")


class PiecewiseCubicRegressor(RegressorMixin, BaseEstimator):
    """Complete cubic polynomials in pieces along one variable.

    Parameters
    ----------
    split_feature : int, default 0
        Column that is cut into pieces.
    pieces : int or "cv", default 2
        Number of pieces, fewer if the rows or the threshold do not call for them (`n_pieces_`
        tells); "cv" chooses between 1 and `max_pieces` by cross-validation.
    split : "least-squares", "threshold" or sequence of float, default "least-squares"
        How split points are found, or the split points themselves (then `pieces` has no say).
    threshold : float, default 0.03
        For "threshold": relative rms error that a piece may have.
    overlap : float, default 0.02
        Fraction of the range of the split variable over which neighbours share rows and are
        blended.
    max_pieces : int, default 5
        For "cv".
    folds : int, default 5
        For "cv".
    min_rows : int or None, default None
        Distinct rows that a piece holds at least; None is twice the number of terms.
    reach : float, default 0.1
        How far a row vouches for its surroundings, see `TrainingRegion`.

    Attributes
    ----------
    model_ : PiecewiseCubic
        The fitted polynomials.
    region_ : TrainingRegion
        Where there were rows.
    split_points_ : array, shape (n_pieces_ - 1,)
        In the unit of the split variable.
    n_pieces_ : int
        Number of pieces.

    Notes
    -----
    `predict` follows the polynomials everywhere, as scikit-learn expects; ask `supported` where
    that is extrapolation. `fit` takes several outputs; they share their split points.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.linspace(0, 1, 200)[:, np.newaxis]
    >>> y = np.maximum(X[:, 0] - 0.6, 0) ** 3
    >>> model = PiecewiseCubicRegressor().fit(X, y)
    >>> bool(abs(model.split_points_[0] - 0.6) < 0.02)
    True
    """

    def __init__(
        self,
        *,
        split_feature: int = 0,
        pieces: int | Literal["cv"] = 2,
        split: Literal["least-squares", "threshold"] | npt.ArrayLike = "least-squares",
        threshold: float = 0.03,
        overlap: float = 0.02,
        max_pieces: int = 5,
        folds: int = 5,
        min_rows: int | None = None,
        reach: float = REACH,
    ) -> None:
        self.split_feature = split_feature
        self.pieces = pieces
        self.split = split
        self.threshold = threshold
        self.overlap = overlap
        self.max_pieces = max_pieces
        self.folds = folds
        self.min_rows = min_rows
        self.reach = reach

    def fit(
        self,
        X: npt.ArrayLike,
        y: npt.ArrayLike,
        sample_weight: npt.ArrayLike | None = None,
        groups: npt.ArrayLike | None = None,
    ) -> Self:
        """Fit the pieces.

        Parameters
        ----------
        X : array, shape (n, n_features)
            Variables.
        y : array, shape (n,) or (n, n_outputs)
            Observations.
        sample_weight : array, shape (n,), optional
            Inverse to the variance of each row; rows of weight 0 are left out.
        groups : array, shape (n,), optional
            Rows of one group (one run) are left out together in the cross-validation; without
            it, rows count as independent of their neighbours.

        Returns
        -------
        self
        """
        rows: RealArray
        rows, observed = validate_data(
            self, X, y, dtype=np.float64, multi_output=True, y_numeric=True
        )
        weight = _check_sample_weight(
            sample_weight, rows, dtype=np.float64, ensure_non_negative=True
        )
        kept = weight > 0
        outputs = np.asarray(observed, dtype=float).reshape(len(rows), -1)
        options = PieceOptions(
            split_feature=self.split_feature,
            pieces=self.pieces,
            split=self.split,
            threshold=self.threshold,
            overlap=self.overlap,
            max_pieces=self.max_pieces,
            folds=self.folds,
            min_rows=self.min_rows,
        )
        labels = None
        if groups is not None:
            labels = np.asarray(groups)
            if labels.shape != weight.shape:
                raise InputError(f"{labels.size} group labels for {weight.size} rows: one each")
            labels = labels[kept]
        self.model_ = fit_piecewise_cubic(rows[kept], outputs[kept], weight[kept], options, labels)
        self.region_ = TrainingRegion.around(rows[kept], self.reach)
        self.split_points_ = self.model_.split_points
        self.n_pieces_ = self.model_.n_pieces
        self._one_output = np.ndim(observed) == 1
        return self

    def predict(self, X: npt.ArrayLike) -> RealArray:
        """Values at `X` (n, n_features), shaped like the `y` of the fit."""
        rows = self._checked(X)
        return self._shaped(self.model_(rows))

    def gradient(self, X: npt.ArrayLike) -> RealArray:
        """Differentiate at `X` (n, n_features): (n, n_features), or (…, n_outputs) for several."""
        rows = self._checked(X)
        return self._shaped(self.model_.gradient(rows))

    def prediction_interval(
        self,
        X: npt.ArrayLike,
        coverage: float = 0.95,
        sample_weight: npt.ArrayLike | None = None,
    ) -> tuple[RealArray, RealArray]:
        """Interval that covers one new observation at each row.

        Parameters
        ----------
        X : array, shape (n, n_features)
            Where.
        coverage : float
            Probability.
        sample_weight : array, shape (n,), optional
            Of the new observations, 1 if not given.

        Returns
        -------
        lower, upper : array
            Shaped like the `y` of the fit.

        Raises
        ------
        InputError
            A coverage outside of ]0, 1[, or a fit without degrees of freedom.

        Notes
        -----
        From the variance of each piece's residuals and the leverage of the row. It holds for
        independent errors of equal (or by weight equal) variance inside of `supported`.
        """
        rows = self._checked(X)
        weight = _check_sample_weight(sample_weight, rows, dtype=np.float64)
        half_width = self.model_.half_width(rows, coverage, weight)
        middle = self.model_(rows)
        return self._shaped(middle - half_width), self._shaped(middle + half_width)

    def supported(self, X: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether each row of `X` lies where rows were fitted, shape (n,).

        False where a variable leaves its range, where no fitted row is near, and where the
        polynomial is held less than at any fitted row (leverage).
        """
        rows = self._checked(X)
        held = self.model_.leverage_ratio(rows) <= 1 + 1e-9
        return self.region_.contains(rows) & held

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    def _checked(self, X: npt.ArrayLike) -> RealArray:
        check_is_fitted(self)
        return np.asarray(validate_data(self, X, dtype=np.float64, reset=False))

    def _shaped(self, values: RealArray) -> RealArray:
        return values[..., 0] if self._one_output else values
