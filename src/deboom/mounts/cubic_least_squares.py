"""Least squares for complete cubics on both sides of given split points."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.cubic_pieces import PiecewiseCubic, cubic_terms, leverage, scaling


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
