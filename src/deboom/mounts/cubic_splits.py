"""Where to cut the range of one variable so that complete cubics describe the pieces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from deboom.mounts.cubic_pieces import cubic_terms, fit_pieces, scaling
from deboom.mounts.training_region import TrainingRegion
from deboom.physics.arrays import RealArray

IntArray = npt.NDArray[np.int64]

COARSE_BLOCKS = 48
"""Blocks of equal size between which the first search chooses."""

ZOOM_CUTS = 16
"""Candidates on each side of a cut in every refinement."""

RIDGE = 1e-10
"""Keeps the search defined where rows cannot tell terms apart; far below any noise."""


class _Segments:
    """Rows sorted along the split variable, ready for the squares of any segment."""

    def __init__(
        self, X: RealArray, y: RealArray, weight: RealArray, split_feature: int, min_rows: int
    ) -> None:
        order = np.argsort(X[:, split_feature], kind="stable")
        position = X[order, split_feature]
        centre, half_range = scaling(X)
        root = np.sqrt(weight[order])[:, np.newaxis]
        spread = y.std(axis=0)
        self.output_scale = np.where(spread > 0, spread, 1.0)
        self.rows = root * np.hstack(
            [cubic_terms((X[order] - centre) / half_range), y[order] / self.output_scale]
        )
        self.n_outputs = y.shape[1]
        self.min_rows = min_rows
        # equal rows count once, so that a repeated row and a doubled weight mean the same
        first = np.unique(X[order], axis=0, return_index=True)[1]
        is_new = np.zeros(len(order), dtype=int)
        is_new[first] = 1
        self.n_distinct = np.concatenate([[0], np.cumsum(is_new)])
        inner = np.flatnonzero(np.diff(position)) + 1
        self.cuts = np.concatenate([[0], inner, [len(order)]])
        self._position = position
        self.weight_before = np.concatenate([[0.0], np.cumsum(weight[order])])
        size = weight[order, np.newaxis] * np.abs(y[order])
        self.size_before = np.vstack([np.zeros(self.n_outputs), np.cumsum(size, axis=0)])

    def split_points(self, cuts: IntArray) -> RealArray:
        """Values half way between the rows on both sides of each cut."""
        return np.asarray((self._position[cuts - 1] + self._position[cuts]) / 2)

    def coarse(self) -> IntArray:
        """Cuts that part the distinct rows into blocks of about the same size."""
        wanted = np.linspace(0, self.n_distinct[-1], COARSE_BLOCKS + 1)
        nearest = np.searchsorted(self.n_distinct[self.cuts], wanted)
        return np.unique(self.cuts[np.minimum(nearest, len(self.cuts) - 1)])

    def zoomed(self, edges: IntArray, chosen: IntArray) -> IntArray:
        """Cuts closer to the chosen ones, between their neighbours among `edges`."""
        fine = [self.cuts[[0, -1]], chosen]
        for cut in chosen:
            here = int(np.searchsorted(edges, cut))
            for low, high in ((edges[here - 1], cut), (cut, edges[here + 1])):
                between = self.cuts[(self.cuts >= low) & (self.cuts <= high)]
                picked = np.linspace(0, len(between) - 1, ZOOM_CUTS + 1).round().astype(int)
                fine.append(between[picked])
        return np.unique(np.concatenate(fine))

    def squares(self, edges: IntArray) -> RealArray:
        """Weighted squares that one cubic leaves on each segment between two edges.

        Shape (n_edges, n_edges, n_outputs), by first and last edge, in units of the outputs'
        variance; infinite where a segment has too few rows. Each block is reduced to its triangle
        once, then segments grow by stacking triangles (updating of a QR factorisation).
        """
        n_columns = self.rows.shape[1]
        n_terms = n_columns - self.n_outputs
        n_blocks = len(edges) - 1
        blocks = np.zeros((n_blocks, n_columns, n_columns))
        for block, (low, high) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
            triangle = np.linalg.qr(self.rows[low:high], mode="r")
            blocks[block, : len(triangle)] = triangle
        empty = np.diag(np.repeat([RIDGE, 0.0], [n_terms, self.n_outputs]))
        grown = np.repeat(empty[np.newaxis], n_blocks, axis=0)
        squares = np.full((n_blocks + 1, n_blocks + 1, self.n_outputs), np.inf)
        for last in range(n_blocks):
            begun = slice(0, last + 1)
            added = np.broadcast_to(blocks[last], (last + 1, n_columns, n_columns))
            grown[begun] = np.linalg.qr(np.concatenate([grown[begun], added], axis=1), mode="r")
            squares[begun, last + 1] = np.sum(grown[begun, n_terms:, n_terms:] ** 2, axis=1)
        counts = self.n_distinct[edges]
        squares[counts[np.newaxis, :] - counts[:, np.newaxis] < self.min_rows] = np.inf
        return squares


def least_squares_splits(
    X: RealArray,
    y: RealArray,
    weight: RealArray,
    split_feature: int,
    max_pieces: int,
    min_rows: int,
) -> list[RealArray]:
    """Split points of the best 1, 2, … `max_pieces` separate cubics.

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
    max_pieces : int
        At most so many pieces.
    min_rows : int
        Distinct rows that a piece holds at least.

    Returns
    -------
    list of array, shape (n_pieces - 1,)
        For 1, 2, … pieces, as far as there are rows for them.

    Notes
    -----
    Dynamic programming over the segments between blocks (Bellman; Bai and Perron, 2003), then the
    same between ever finer cuts about the chosen ones, down to single rows: the global optimum
    between blocks, and a local one inside of them.
    """
    segments = _Segments(X, y, weight, split_feature, min_rows)
    found = [np.empty(0)]
    possible = min(max_pieces, int(segments.n_distinct[-1]) // min_rows)
    if possible < 2:
        return found
    edges = segments.coarse()
    coarse_squares = segments.squares(edges)
    for n_pieces in range(2, possible + 1):
        first = _best_cuts(edges, coarse_squares, n_pieces)
        if first is None:
            break
        found.append(_zoom(segments, edges, first, lambda e, s, n=n_pieces: _best_cuts(e, s, n)))
    return found


def threshold_splits(
    X: RealArray,
    y: RealArray,
    weight: RealArray,
    split_feature: int,
    max_pieces: int,
    min_rows: int,
    threshold: float,
) -> RealArray | None:
    """Split points where a growing cubic's error passes a threshold (the thesis's rule).

    Parameters
    ----------
    X, y, weight, split_feature, max_pieces, min_rows
        As in `least_squares_splits`.
    threshold : float
        Largest rms error of a piece, relative to the mean absolute value of its rows [1].

    Returns
    -------
    array, shape (n_pieces - 1,), or None
        None when even the shortest piece is worse than the threshold.

    Notes
    -----
    Thesis, 3.5: from the low end, a piece reaches as far as its error allows; the last piece takes
    what is left.
    """
    segments = _Segments(X, y, weight, split_feature, min_rows)
    edges = segments.coarse()

    def choose(edges: IntArray, squares: RealArray) -> IntArray | None:
        weights = np.subtract.outer(segments.weight_before[edges], segments.weight_before[edges])
        size = segments.size_before[edges]
        sizes = size[np.newaxis] - size[:, np.newaxis]
        with np.errstate(invalid="ignore", divide="ignore"):
            rms = np.sqrt(squares * segments.output_scale**2 / np.abs(weights)[:, :, np.newaxis])
            error = np.max(rms / (sizes / np.abs(weights)[:, :, np.newaxis]), axis=2)
        begin, chosen = 0, []
        last = len(edges) - 1
        while len(chosen) < max_pieces - 1 and not error[begin, last] <= threshold:
            enough_behind = np.isfinite(squares[:, last, 0])
            good = np.flatnonzero((error[begin] <= threshold) & enough_behind)
            if not good.size:
                return None if not chosen else edges[chosen]
            begin = int(good[-1])
            chosen.append(begin)
        return edges[chosen]

    first = choose(edges, segments.squares(edges))
    return None if first is None else _zoom(segments, edges, first, choose)


def cross_validated_splits(
    X: RealArray,
    y: RealArray,
    weight: RealArray,
    split_feature: int,
    max_pieces: int,
    min_rows: int,
    overlap: float,
    fold: IntArray,
) -> RealArray:
    """Split points of the number of pieces that predicts rows left out best.

    Parameters
    ----------
    X, y, weight, split_feature, max_pieces, min_rows
        As in `least_squares_splits`.
    overlap : float
        As in `fit_pieces`.
    fold : array of int, shape (n,)
        Each row is left out together with the rows of the same number.

    Returns
    -------
    array, shape (n_pieces - 1,)

    Notes
    -----
    Scored on the rows left out that lie in the region of the others, so that no extrapolation
    decides. Of the numbers of pieces whose score is worse than the best by less than one standard
    error of that difference over the folds, the smallest is taken.
    """
    numbers = np.unique(fold)
    scores = np.full((max_pieces, len(numbers)), np.inf)
    spread = y.std(axis=0)
    scale = np.where(spread > 0, spread, 1.0)
    for column, number in enumerate(numbers):
        kept, left_out = fold != number, fold == number
        left_out &= TrainingRegion.around(X[kept]).contains(X)
        if not left_out.any():
            continue
        found = least_squares_splits(
            X[kept], y[kept], weight[kept], split_feature, max_pieces, min_rows
        )
        for row, split_points in enumerate(found):
            pieces = fit_pieces(
                X[kept], y[kept], weight[kept], split_feature, split_points, overlap
            )
            error = (pieces(X[left_out]) - y[left_out]) / scale
            scores[row, column] = np.average(
                np.sum(error**2, axis=1), weights=weight[left_out]
            )
    scores = scores[:, np.isfinite(scores[0])]
    everything = least_squares_splits(X, y, weight, split_feature, max_pieces, min_rows)
    possible = [k for k in range(len(everything)) if np.all(np.isfinite(scores[k]))]
    best = min(possible, key=lambda k: scores[k].mean())
    for k in possible:
        loss = scores[k] - scores[best]
        if loss.mean() <= loss.std(ddof=1) / np.sqrt(len(loss)):
            return everything[k]
    return everything[best]


def _zoom(
    segments: _Segments,
    edges: IntArray,
    chosen: IntArray,
    choose: Callable[[IntArray, RealArray], IntArray | None],
) -> RealArray:
    """Repeat the choice between ever closer cuts until there are no closer ones."""
    while chosen.size:
        finer = segments.zoomed(edges, chosen)
        again = choose(finer, segments.squares(finer))
        if again is None or (np.array_equal(again, chosen) and np.array_equal(finer, edges)):
            break
        edges, chosen = finer, again
    return segments.split_points(chosen)


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
    return edges[np.array(cuts[:0:-1])]
