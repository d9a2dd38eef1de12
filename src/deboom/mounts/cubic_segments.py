"""Squares that one complete cubic leaves on any stretch of the rows, sorted along one variable."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.mounts.cubic_pieces import cubic_terms, scaling

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
