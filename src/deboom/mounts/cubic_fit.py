"""Fit complete cubics in pieces: the choices, and the fit that follows them."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from numbers import Integral
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.cubic_least_squares import fit_pieces
from deboom.mounts.cubic_pieces import PiecewiseCubic
from deboom.mounts.cubic_segments import IntArray, Segments
from deboom.mounts.cubic_splits import (
    cross_validated_splits,
    least_squares_splits,
    threshold_splits,
)


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
