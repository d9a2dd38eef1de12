"""Complete cubics in pieces along one variable, as a scikit-learn regressor."""

from __future__ import annotations

from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import _check_sample_weight, check_is_fitted, validate_data

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.cubic_fit import PieceOptions, fit_piecewise_cubic
from deboom.mounts.training_region import REACH, TrainingRegion


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
