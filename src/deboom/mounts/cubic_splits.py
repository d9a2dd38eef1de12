"""Where to cut the range of one variable so that complete cubics describe the pieces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.cubic_least_squares import fit_pieces
from deboom.mounts.cubic_segments import ZOOM_CUTS, IntArray, Segments
from deboom.mounts.training_region import TrainingRegion

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
