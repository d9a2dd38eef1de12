"""Complete cubic polynomials in pieces along the first variable, as a scikit-learn regressor."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import cache, cached_property
from itertools import pairwise
from math import comb
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree
from scipy.special import stdtrit
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.linear_model import LinearRegression
from sklearn.preprocessing import PolynomialFeatures
from sklearn.utils import check_consistent_length
from sklearn.utils.validation import _check_sample_weight, check_is_fitted, validate_data

from deboom.arrays import BoolArray, IntArray, RealArray, checked, frozen_copy
from deboom.errors import InputError

FOLDS = 5
"""Groups of the cross-validation."""

REACH = 0.1
"""Distance that a measured row vouches for, as a fraction of the ranges [1]."""

MARGIN = 0.02
"""Distance beyond its range that a variable may lie at, as a fraction of it: noise [1]."""

THINNING = 4
"""Rows closer together than the reach over this number, in every variable, count as one."""

BESIDE = 0.025
"""A measured row so near, in fractions of the ranges, is the same state measured again [1]."""

LEVERAGE_BESIDE = 4.0
"""Leverage allowed there, over the largest of the rows fitted: twice their standard error [1]."""

COARSE_BLOCKS = 48
"""Blocks of about the same number of rows in the first search for split points."""

ZOOM_CUTS = 16
"""Candidates on each side of a cut in every refinement of the search."""

LEVEL = 0.01
"""Values of a variable nearer than this fraction of its range are one level, such as one
temperature of a chamber [1]."""

RIDGE = 1e-10
"""Keeps the squares defined where rows cannot tell terms apart; far below any noise."""

EXACT = 1e-18
"""Squares left over squares of the observations, below which more pieces describe only rounding."""

ROUNDING = 1e-13
"""Distance of scaled terms from those of the fit that is rounding [1]."""

NARROW = 1e-9
"""Range of a piece over that of all rows, below which a variable counts as constant there [1]."""


class FewLevelsWarning(UserWarning):
    """A variable takes fewer levels than a cubic needs: its degree is lower, the fit is sound."""


@checked(points="n k", lower="k", upper="k")
class TrainingRegion:
    """Surroundings of the measured rows, holes left out.

    `points` (n, k) are the measured rows, thinned, `lower` and `upper` (k,) the range of each
    variable; a row belongs to the region if no variable leaves its range by more than 2 % of it and
    a measured row lies within the `reach`, each variable in fractions of its range [1].

    A convex hull is no guard for runs: they are curves that leave most of it unvisited. Inside the
    hull, 0.2 to 0.3 of the ranges away from any row, a cubic surface errs by 13 to 27 % (median).
    """

    points: RealArray
    lower: RealArray
    upper: RealArray
    reach: float = REACH

    @classmethod
    def around(cls, X: RealArray) -> TrainingRegion:
        """Return the region about the rows of `X` (n, n_features)."""
        lower, upper = X.min(axis=0), X.max(axis=0)
        fractions = (X - lower) / np.where(upper > lower, upper - lower, 1.0)
        cells = np.floor(fractions * THINNING / REACH)
        kept = np.sort(np.unique(cells, axis=0, return_index=True)[1])
        return cls(X[kept], lower, upper)

    def distance(self, X: RealArray) -> RealArray:
        """Return the distance of each row of `X` (n, n_features) from the next measured one [1]."""
        return np.asarray(self._tree.query(self._fractions(X))[0], dtype=float)

    def in_range(self, X: RealArray) -> BoolArray:
        """Say which variables of `X` (n, n_features) lie in their range, same shape."""
        # rounding alone must not put a row of a constant variable outside
        slack = MARGIN * (self.upper - self.lower) + 1e-12 * np.abs(self.upper)
        return np.asarray((self.lower - slack <= X) & (self.upper + slack >= X))

    def contains(self, X: RealArray) -> BoolArray:
        """Say whether each row of `X` (n, n_features) lies in the region, shape (n,)."""
        return self.in_range(X).all(axis=1) & (self.distance(X) <= self.reach)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._fractions(self.points))

    def _fractions(self, X: RealArray) -> RealArray:
        return (X - self.lower) / np.where(self.upper > self.lower, self.upper - self.lower, 1.0)


class PiecewiseCubicRegressor(RegressorMixin, BaseEstimator):
    """Complete cubic polynomials in pieces along the first variable, blended where they meet.

    - `pieces`: number of pieces, fewer if the rows or the threshold do not call for them; "cv"
      chooses between 1 and `max_pieces` by cross-validation.
    - `split`, optional: the split points (then `pieces` has no say); by default the best ones in
      the sense of least squares.
    - `overlap`: fraction of the range of the first variable over which neighbours share rows and
      are blended linearly [1].
    - `max_pieces`: most pieces of the cross-validation.
    - `logarithmic`: columns after the first that enter as their logarithm, as a frequency over
      several decades should; above 0.
    - `split_points_` (n_pieces - 1,): split points in the unit of the first variable, increasing.
    - `centre_`, `half_range_` (n_pieces, n_features): scaling of each piece's variables to [-1, 1]
      over its own rows.
    - `coefficients_` (n_pieces, n_terms, n_outputs): factors of the terms of
      ``PolynomialFeatures(3)`` in scaled variables.
    - `region_`: region in which rows were fitted.

    A piece that is looked for holds at least twice as many distinct rows as it has terms. Thesis,
    eq. 32, with all 20 terms for three variables (it prints 19). `predict` follows the
    polynomials everywhere, as scikit-learn expects; `supported` says where that is extrapolation.
    Several outputs share their split points.

    Least squares by orthogonal triangularisation and a singular value decomposition of the
    triangle, no normal equations. Terms that the rows cannot tell apart get the shortest
    coefficients, and their directions a very large leverage. A piece with fewer distinct rows than
    terms gets a polynomial of the degree that they determine, and a warning that names it. So does
    a variable that takes fewer than four levels in a piece, such as a temperature: k levels
    determine the powers up to k − 1, and a cubic through them errs by half or more between them.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.linspace(0, 1, 200)[:, np.newaxis]
    >>> y = np.maximum(X[:, 0] - 0.6, 0) ** 3
    >>> model = PiecewiseCubicRegressor().fit(X, y)
    >>> bool(abs(model.split_points_[0] - 0.6) < 0.02)
    True
    """

    split_points_: RealArray
    blend_width_: RealArray
    centre_: RealArray
    half_range_: RealArray
    coefficients_: RealArray
    directions_: RealArray
    inverse_singular_: RealArray
    unseen_leverage_: RealArray
    leverage_limit_: RealArray
    variance_: RealArray
    degrees_of_freedom_: RealArray
    region_: TrainingRegion
    n_features_in_: int

    def __init__(
        self,
        *,
        pieces: int | Literal["cv"] = 2,
        split: npt.ArrayLike | None = None,
        overlap: float = 0.02,
        max_pieces: int = 5,
        logarithmic: tuple[int, ...] = (),
    ) -> None:
        self.pieces = pieces
        self.split = split
        self.overlap = overlap
        self.max_pieces = max_pieces
        self.logarithmic = logarithmic

    def fit(
        self,
        X: npt.ArrayLike,
        y: npt.ArrayLike,
        sample_weight: npt.ArrayLike | None = None,
        groups: npt.ArrayLike | None = None,
    ) -> Self:
        """Fit the pieces.

        - `X` (n, n_features): variables.
        - `y` (n,) or (n, n_outputs): observations.
        - `sample_weight` (n,), optional: inverse to the variance of each row; rows of weight 0 are
          left out.
        - `groups` (n,), optional: rows of one group (one run) are left out together in the
          cross-validation; without it every fifth row along the first variable is, which suits
          independent rows only.
        - raises InputError: parameters without sense, split points outside of the range, a piece
          without rows, groups that cannot be cross-validated.
        """
        counts = [count for count in (self.max_pieces, self.pieces) if count != "cv"]
        if not all(isinstance(count, int | np.integer) and count >= 1 for count in counts):
            raise InputError(
                f"pieces {self.pieces!r}, max_pieces {self.max_pieces!r}: whole numbers of at "
                'least 1, or "cv" pieces'
            )
        if not 0 <= self.overlap < 1:
            raise InputError(f"overlap is a fraction of at least 0 and below 1: {self.overlap!r}")
        rows: RealArray
        rows, observed = validate_data(
            self, X, y, dtype=np.float64, multi_output=True, y_numeric=True
        )
        weight = _check_sample_weight(
            sample_weight, rows, dtype=np.float64, ensure_non_negative=True
        )
        kept = weight > 0
        check_consistent_length(rows, groups)
        labels = None if groups is None else np.asarray(groups)[kept]
        outputs = np.asarray(observed, dtype=float).reshape(len(rows), -1)
        rows, outputs, weight = rows[kept], outputs[kept], weight[kept]
        split_points = self._choose_split_points(rows, outputs, weight, labels)
        blend_width = self.overlap * float(np.ptp(rows[:, 0]))
        self._one_output = np.ndim(observed) == 1
        return self._fit_pieces(rows, outputs, weight, split_points, blend_width)

    def refitted(self, X: RealArray, y: RealArray) -> Self:
        """Fit cubics with the same split points to other rows, all of one weight.

        - raises InputError: a piece without rows.
        """
        same: Self = clone(self)
        same.n_features_in_ = self.n_features_in_
        same._one_output = y.ndim == 1
        outputs, weight = y.reshape(len(X), -1), np.ones(len(X))
        return same._fit_pieces(X, outputs, weight, self.split_points_, float(self.blend_width_))

    def predict(self, X: npt.ArrayLike) -> RealArray:
        """Return the values at `X` (n, n_features), shaped like the `y` of the fit."""
        return self._shaped(self._values(self._checked(X)))

    def gradient(self, X: npt.ArrayLike) -> RealArray:
        """Differentiate at `X` (n, n_features): (n, n_features), or (…, n_outputs) for several."""
        rows = self._checked(X)
        share, slope = self._shares(rows)
        gradient = np.zeros((*rows.shape, self.coefficients_.shape[2]))
        for k, coefficients in enumerate(self.coefficients_):
            terms = self._terms(rows, k)
            for feature, derivative in enumerate(_derivatives(rows.shape[1])):
                by_scaled = terms @ (derivative @ coefficients)
                gradient[:, feature] += share[k] * by_scaled / self.half_range_[k, feature]
            gradient[:, 0] += slope[k] * (terms @ coefficients)
        for feature in self.logarithmic:
            gradient[:, feature] /= rows[:, [feature]]
        return self._shaped(gradient)

    def predict_interval(
        self,
        X: npt.ArrayLike,
        coverage: float = 0.95,
        sample_weight: npt.ArrayLike | None = None,
    ) -> tuple[RealArray, RealArray]:
        """Return lower and upper bounds for one new observation at each row of `X`.

        - `X` (n, n_features): variables.
        - `coverage`: probability, between 0 and 1 [1].
        - `sample_weight` (n,), optional: weights of the new observations, 1 if not given.
        - raises InputError: a coverage outside of ]0, 1[, or a fit without degrees of freedom.

        ``t σ √(1/w + h)`` with Student's t and the leverage h, per piece, blended like the values
        (two pieces that share rows are taken as fully dependent). It holds for independent errors
        of equal (or by weight equal) variance inside of `supported`.
        """
        rows = self._checked(X)
        weight = _check_sample_weight(sample_weight, rows, dtype=np.float64)
        if not 0 < coverage < 1:
            raise InputError(f"a coverage lies between 0 and 1, not {coverage}")
        if np.any(self.degrees_of_freedom_ < 1):
            raise InputError(
                "as many terms as rows leave no residuals: an interval needs more rows"
            )
        share = self._shares(rows)[0]
        half_width = np.zeros((len(rows), self.coefficients_.shape[2]))
        for k, freedom in enumerate(self.degrees_of_freedom_):
            spread = np.sqrt(1 / weight + self._leverage(rows, k))
            quantile = stdtrit(freedom, 0.5 + coverage / 2)
            half_width += share[k] * quantile * spread[:, np.newaxis] * np.sqrt(self.variance_[k])
        middle = self._values(rows)
        return self._shaped(middle - half_width), self._shaped(middle + half_width)

    def leverage_ratio(self, X: npt.ArrayLike) -> RealArray:
        """Return the leverage over the largest of the rows fitted, worst of the pieces in charge.

        Above 1 the polynomial is no longer backed by data, even amid the ranges of all variables:
        hidden extrapolation (Montgomery, Peck and Vining, Introduction to Linear Regression
        Analysis, 3.8).
        """
        rows = self._checked(X)
        share = self._shares(rows)[0][..., 0]
        ratios = [
            np.where(share[k] > 0, self._leverage(rows, k) / limit, 0.0)
            for k, limit in enumerate(self.leverage_limit_)
        ]
        return np.asarray(np.max(ratios, axis=0))

    def supported(self, X: npt.ArrayLike) -> BoolArray:
        """Say whether each row of `X` lies where rows were fitted, shape (n,).

        False where a variable leaves its range, where no fitted row is near, and where the leverage
        exceeds that of all fitted rows. Beside a fitted row it may do so four times: noise moves
        the end of a ramp beyond every leverage of the fit.
        """
        rows = self._checked(X)
        distance = self.region_.distance(rows)
        inside = self.region_.in_range(rows).all(axis=1) & (distance <= self.region_.reach)
        ratio = self.leverage_ratio(rows)
        backed = (ratio <= 1 + 1e-9) | ((distance <= BESIDE) & (ratio <= LEVERAGE_BESIDE))
        return np.asarray(inside & backed)

    def to_arrays(self, prefix: str = "") -> dict[str, npt.NDArray[Any]]:
        """Return the fitted pieces as named arrays; the region stays with its owner."""
        check_is_fitted(self)
        arrays = {name: np.asarray(getattr(self, f"{name}_")) for name in _ARRAYS}
        if self.logarithmic:
            arrays["logarithmic"] = np.asarray(self.logarithmic)
        return {prefix + name: array for name, array in arrays.items()}

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, npt.NDArray[Any]], region: TrainingRegion, prefix: str = ""
    ) -> Self:
        """Build a fitted regressor of one output from `to_arrays`, bit for bit.

        - raises InputError: a missing array or coefficients of another shape; ValueError: text.
        """
        stored = named_arrays(arrays, prefix, _ARRAYS)
        logarithmic = arrays.get(f"{prefix}logarithmic", np.empty(0))
        regressor = cls(logarithmic=tuple(int(column) for column in logarithmic))
        for name in _ARRAYS:
            setattr(regressor, f"{name}_", frozen_copy(np.asarray(stored[name], dtype=float)))
        n_pieces, n_features = len(regressor.split_points_) + 1, region.lower.size
        shape = (n_pieces, comb(n_features + 3, 3), 1)
        if regressor.coefficients_.shape != shape:
            raise InputError(
                f"stored coefficients {prefix.strip('_')} of shape "
                f"{regressor.coefficients_.shape}, expected {shape}: store the surface again"
            )
        regressor.region_ = region
        regressor.n_features_in_ = n_features
        regressor._one_output = True
        return regressor

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    def _choose_split_points(
        self, X: RealArray, y: RealArray, weight: RealArray, groups: npt.NDArray[Any] | None
    ) -> RealArray:
        """Return the split points that the parameters ask for, shape (n_pieces - 1,)."""
        position = X[:, 0]
        if self.split is not None:
            return _given_points(self.split, position)
        segments = _Segments(self._entered(X), y, weight)
        if self.pieces == "cv":
            ranks = np.argsort(np.argsort(position, kind="stable"))
            labels = ranks if groups is None else groups
            fold = np.unique(labels, return_inverse=True)[1] % FOLDS
            return self._cross_validated_splits(X, y, weight, fold, segments)
        return _least_squares_splits(segments, int(self.pieces))[-1]

    def _cross_validated_splits(
        self, X: RealArray, y: RealArray, weight: RealArray, fold: IntArray, segments: _Segments
    ) -> RealArray:
        """Return the splits of the fewest pieces within one standard error of the best score."""
        candidates = _least_squares_splits(segments, self.max_pieces)
        if len(candidates) == 1:
            return candidates[0]
        spread = y.std(axis=0)
        scale = np.where(spread > 0, spread, 1.0)
        scores = []
        for number in np.unique(fold):
            kept, left_out = fold != number, fold == number
            if not kept.any():
                continue
            rows = X[kept], y[kept], weight[kept]
            left_out &= TrainingRegion.around(rows[0]).contains(X)
            if not left_out.any():
                continue
            segments = _Segments(self._entered(X[kept]), *rows[1:])
            fits = [
                clone(self).set_params(split=split_points).fit(*rows)
                for split_points in _least_squares_splits(segments, len(candidates))
            ]
            left_out &= np.all([pieces.leverage_ratio(X) <= 1 for pieces in fits], axis=0)
            if not left_out.any():
                continue
            score = [np.inf] * len(candidates)
            for k, pieces in enumerate(fits):
                error = np.sum(((pieces._values(X[left_out]) - y[left_out]) / scale) ** 2, axis=1)
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
                return candidates[k]
        return candidates[best]

    def _fit_pieces(
        self,
        X: RealArray,
        y: RealArray,
        weight: RealArray,
        split_points: RealArray,
        blend_width: float,
    ) -> Self:
        """Fit a cubic on both sides of each split point."""
        entered = self._entered(X)
        position, half_range = X[:, 0], np.ptp(entered, axis=0) / 2
        pieces = []
        for low, high in pairwise([-np.inf, *split_points, np.inf]):
            # a piece owns its upper end, as the shares do when nothing is blended
            rows = (position > low - blend_width / 2) & (position <= high + blend_width / 2)
            if not rows.any():
                raise InputError(f"no rows between the split points {low:g} and {high:g}")
            name = f"piece from {position[rows].min():g} to {position[rows].max():g}"
            pieces.append(_fitted_cubic(entered[rows], y[rows], weight[rows], half_range, name))
        rank = max(piece["inverse_singular"].size for piece in pieces)
        for piece in pieces:
            missing = rank - piece["inverse_singular"].size
            piece["inverse_singular"] = np.pad(piece["inverse_singular"], (0, missing))
            piece["directions"] = np.pad(piece["directions"], ((0, 0), (0, missing)))
        stacked = {name: np.stack([piece[name] for piece in pieces]) for name in pieces[0]}
        stacked |= {"split_points": split_points, "blend_width": np.asarray(blend_width)}
        for name, array in stacked.items():
            setattr(self, f"{name}_", frozen_copy(np.asarray(array, dtype=float)))
        self.region_ = TrainingRegion.around(X)
        return self

    def _values(self, X: RealArray) -> RealArray:
        """Values at checked rows, shape (n, n_outputs)."""
        share = self._shares(X)[0]
        values = np.zeros((len(X), self.coefficients_.shape[2]))
        for k, coefficients in enumerate(self.coefficients_):
            values += share[k] * (self._terms(X, k) @ coefficients)
        return values

    def _terms(self, X: RealArray, piece: int) -> RealArray:
        return _cubic_terms((self._entered(X) - self.centre_[piece]) / self.half_range_[piece])

    def _entered(self, X: RealArray) -> RealArray:
        """Rows as the polynomials see them, some columns by their logarithm."""
        columns = list(self.logarithmic)
        if columns and not (min(columns) > 0 and max(columns) < X.shape[1]):
            raise InputError(
                f"logarithmic names columns from 1 to {X.shape[1] - 1}, not {self.logarithmic}: "
                "the first is split in its own unit"
            )
        if np.any(X[:, columns] <= 0):
            raise InputError("what enters as its logarithm lies above 0: leave such rows out")
        entered = X.copy()
        entered[:, columns] = np.log(X[:, columns])
        return entered

    def _leverage(self, X: RealArray, piece: int) -> RealArray:
        fitted = self.directions_, self.inverse_singular_, self.unseen_leverage_
        return _leverage(self._terms(X, piece), *(array[piece] for array in fitted))

    def _shares(self, X: RealArray) -> tuple[RealArray, RealArray]:
        """Share of each piece at each row and its slope along the first variable, (k, n, 1)."""
        position = X[:, 0]
        # how far each split point lies behind: 0 before it, 1 beyond
        passed = np.zeros((len(self.split_points_) + 2, len(X), 1))
        slope = np.zeros_like(passed)
        passed[0] = 1.0
        for k, split in enumerate(self.split_points_, start=1):
            if self.blend_width_ > 0:
                ramp = (position - split) / self.blend_width_ + 0.5
                passed[k, :, 0] = np.clip(ramp, 0.0, 1.0)
                slope[k, :, 0] = ((ramp > 0) & (ramp < 1)) / self.blend_width_
            else:
                passed[k, :, 0] = position > split
        return passed[:-1] - passed[1:], slope[:-1] - slope[1:]

    def _checked(self, X: npt.ArrayLike) -> RealArray:
        check_is_fitted(self)
        return np.asarray(validate_data(self, X, dtype=np.float64, reset=False))

    def _shaped(self, values: RealArray) -> RealArray:
        return values[..., 0] if self._one_output else values


# everything that `fit` leaves but the region: what is stored
_ARRAYS = tuple(
    name.removesuffix("_")
    for name, kind in PiecewiseCubicRegressor.__annotations__.items()
    if kind == "RealArray"
)


def named_arrays(
    arrays: Mapping[str, npt.NDArray[Any]], prefix: str, names: tuple[str, ...]
) -> dict[str, npt.NDArray[Any]]:
    """Take the arrays `prefix` + name out of stored ones; InputError names what is missing."""
    missing = [prefix + name for name in names if prefix + name not in arrays]
    if missing:
        raise InputError(f"what is stored lacks the arrays {missing}: store it again")
    return {name: arrays[prefix + name] for name in names}


def _cubic_terms(scaled: RealArray) -> RealArray:
    """Every term of the complete cubic polynomial, shape (n, n_terms)."""
    return np.asarray(_polynomials(scaled.shape[1]).transform(scaled))


@cache
def _polynomials(n_features: int) -> PolynomialFeatures:
    """Complete cubic polynomials of this many variables, checked once."""
    polynomials = PolynomialFeatures(3)
    polynomials.fit(np.zeros((1, n_features)))
    return polynomials


@cache
def _derivatives(n_features: int) -> RealArray:
    """Matrices from coefficients to those of the derivative by each variable, (k, terms, terms)."""
    powers = _polynomials(n_features).powers_
    lowered = powers - np.eye(n_features, dtype=int)[:, np.newaxis]
    same_term = np.all(powers[:, np.newaxis] == lowered[:, np.newaxis], axis=-1)
    return np.asarray(same_term * powers.T[:, np.newaxis], dtype=float)


def _scaling(X: RealArray, whole: RealArray | None = None) -> tuple[RealArray, RealArray]:
    """Centre and half range of each column; that of all rows where only rounding moves it, or 1."""
    low, high = X.min(axis=0), X.max(axis=0)
    half_range = (high - low) / 2
    instead = half_range if whole is None else whole
    half_range = np.where(half_range > NARROW * instead, half_range, instead)
    return (low + high) / 2, np.where(half_range > 0, half_range, 1.0)


def _fitted_cubic(
    X: RealArray, y: RealArray, weight: RealArray, whole: RealArray, name: str
) -> dict[str, RealArray]:
    """Arrays of one piece, by the names of the regressor's attributes."""
    centre, half_range = _scaling(X, whole)
    terms = _cubic_terms((X - centre) / half_range)
    n_rows, n_terms = terms.shape
    n_distinct = len(np.unique(X, axis=0))
    degree = max(d for d in range(4) if comb(X.shape[1] + d, d) <= n_distinct)
    used = np.arange(n_terms) < comb(X.shape[1] + degree, degree)
    if not used.all():
        warnings.warn(
            f"{name}: {n_distinct} distinct rows do not determine a cubic of {n_terms} terms, it "
            f"is a polynomial of degree {degree}: measure more, or ask for fewer pieces",
            stacklevel=4,
        )
    # what stands still in a piece is scaled by its whole range, and its powers are 0
    for feature in np.flatnonzero(np.ptp(X, axis=0) / 2 > NARROW * whole):
        powers = _polynomials(X.shape[1]).powers_[:, feature]
        n_level = _levels(X[:, feature], 2 * whole[feature])
        if powers[used].max() >= n_level:
            warnings.warn(
                f"{name}: variable {feature + 1} takes {n_level} of the 4 levels that a cubic "
                f"needs, its powers above {n_level - 1} are left out: measure more levels, or ask "
                "for fewer pieces",
                FewLevelsWarning,
                stacklevel=4,
            )
            used &= powers < n_level
    root = np.sqrt(weight)[:, np.newaxis]
    weighted = root * terms * used
    triangle = np.asarray(np.linalg.qr(np.hstack([weighted, root * y]), mode="r"))
    _, singular, right = np.linalg.svd(triangle[:, :n_terms], full_matrices=False)
    smallest = float(singular[0]) * max(n_rows, n_terms) * np.finfo(float).eps
    rank = int(np.sum(singular > smallest))
    directions, inverse_singular = right[:rank].T, 1 / singular[:rank]
    regression = LinearRegression(fit_intercept=False, tol=smallest / float(singular[0]))
    regression.fit(triangle[:, :n_terms], triangle[:, n_terms:])
    coefficients = np.where(used[:, np.newaxis], np.atleast_2d(regression.coef_).T, 0.0)
    squares = np.sum((root * (y - terms @ coefficients)) ** 2, axis=0)
    freedom = n_rows - rank
    # terms left out are no terms that the rows have never seen
    unseen = 0.0 if rank == np.sum(used) < n_terms else smallest**-2
    return {
        "centre": centre,
        "half_range": half_range,
        "coefficients": coefficients,
        "directions": directions,
        "inverse_singular": inverse_singular,
        "unseen_leverage": np.asarray(unseen),
        "leverage_limit": _leverage(terms, directions, inverse_singular, unseen).max(),
        "variance": squares / freedom if freedom else np.full_like(squares, np.nan),
        "degrees_of_freedom": np.asarray(freedom),
    }


def _levels(values: RealArray, whole: float) -> int:
    """Count the levels of a variable in a piece, 4 at most: a cubic needs no more.

    `whole`: its range over all rows. What varies within a level is noise, not another level.
    """
    ordered, count, place = np.sort(values), 0, 0
    span = float(ordered[-1] - ordered[0])
    apart = LEVEL * (span if span > LEVEL * whole else whole)
    while place < ordered.size and count <= 3:
        count += 1
        place = int(np.searchsorted(ordered, ordered[place] + apart))
    return count


def _leverage(
    terms: RealArray, directions: RealArray, inverse_singular: RealArray, unseen: float
) -> RealArray:
    """Leverage ``h = Σ (a·v/s)²`` of rows of terms, and what the rows fitted never saw on top."""
    along = terms @ directions
    leverage = np.sum((along * inverse_singular) ** 2, axis=1)
    if np.count_nonzero(inverse_singular) < len(directions):
        beside = np.sum((terms - along @ directions.T) ** 2, axis=1)
        leverage += unseen * np.where(beside > ROUNDING**2, beside, 0.0)
    return np.asarray(leverage)


class _Segments:
    """Rows sorted along the first variable. A cut is the index of the first row behind it."""

    def __init__(self, X: RealArray, y: RealArray, weight: RealArray) -> None:
        order = np.argsort(X[:, 0], kind="stable")
        self._position = X[order, 0]
        self._min_rows = 2 * comb(X.shape[1] + 3, 3)
        self._n_outputs = y.shape[1]
        centre, half_range = _scaling(X)
        spread = y.std(axis=0)
        outputs = y[order] / np.where(spread > 0, spread, 1.0)
        terms = _cubic_terms((X[order] - centre) / half_range)
        root = np.sqrt(weight[order])[:, np.newaxis]
        self.total = float(np.sum((root * outputs) ** 2))
        self._rows = root * np.hstack([terms, outputs])
        # equal rows count once, so that a repeated row and a doubled weight mean the same
        is_new = np.zeros(len(order), dtype=int)
        is_new[np.unique(X[order], axis=0, return_index=True)[1]] = 1
        self._distinct_before = np.concatenate([[0], np.cumsum(is_new)])
        inner = np.flatnonzero(np.diff(self._position)) + 1
        self.cuts = np.concatenate([[0], inner, [len(order)]])
        self.divisible = int(self._distinct_before[-1]) >= 2 * self._min_rows

    def split_points(self, cuts: IntArray) -> RealArray:
        """Values of the first variable half way between the rows on both sides of each cut."""
        return np.asarray((self._position[cuts - 1] + self._position[cuts]) / 2)

    def coarse_edges(self) -> IntArray:
        """Cuts that part the distinct rows into blocks of about the same size, with both ends."""
        wanted = np.linspace(0, self._distinct_before[-1], COARSE_BLOCKS + 1)
        nearest = np.searchsorted(self._distinct_before[self.cuts], wanted)
        return np.unique(self.cuts[np.minimum(nearest, len(self.cuts) - 1)])

    def squares(self, edges: IntArray) -> RealArray:
        """Weighted squares that one cubic leaves, over the variance, (first, last, output)."""
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

    def refined(self, edges: IntArray, chosen: IntArray) -> IntArray:
        """Repeat a choice between ever closer cuts about the chosen ones, down to single rows."""
        radius = int(np.max(np.diff(np.searchsorted(self.cuts, edges))))
        while True:
            steps = np.linspace(-radius, radius, 2 * ZOOM_CUTS + 1).round().astype(int)
            places = np.searchsorted(self.cuts, chosen)[:, np.newaxis] + steps
            inside = np.clip(places, 0, len(self.cuts) - 1).ravel()
            near = np.unique(np.concatenate([self.cuts[[0, -1]], self.cuts[inside]]))
            closer = _best_cuts(near, self.squares(near), chosen.size + 1)
            chosen = chosen if closer is None else closer
            if radius <= ZOOM_CUTS:
                return chosen
            radius = max(radius // 8, ZOOM_CUTS)


def _least_squares_splits(segments: _Segments, max_pieces: int) -> list[RealArray]:
    """Split points of the best 1, 2, … `max_pieces` separate cubics, as far as rows allow.

    Dynamic programming over the segments between blocks (Bai and Perron, J. Applied Econometrics
    18, 2003), then the same between ever closer cuts about the chosen ones, down to single rows:
    the global optimum between blocks, a local one inside of them.
    """
    if max_pieces == 1 or not segments.divisible:
        return [np.empty(0)]
    best = [np.empty(0, dtype=int)]
    edges = segments.coarse_edges()
    squares = segments.squares(edges)
    for n_pieces in range(2, max_pieces + 1):
        chosen = _best_cuts(edges, squares, n_pieces)
        if chosen is None or segments.left_over(best[-1]) <= EXACT * segments.total:
            break
        best.append(segments.refined(edges, chosen))
    return [segments.split_points(cuts) for cuts in best]


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


def _given_points(split: npt.ArrayLike, position: RealArray) -> RealArray:
    """Check split points that the user gave."""
    points = np.atleast_1d(np.asarray(split, dtype=float))
    inside = np.all((points > position.min()) & (points < position.max()))
    if points.ndim != 1 or not inside or np.any(np.diff(points) <= 0):
        raise InputError(
            f"split points {points.tolist()} must increase within the range "
            f"{position.min():g} to {position.max():g} of the first variable"
        )
    return points
