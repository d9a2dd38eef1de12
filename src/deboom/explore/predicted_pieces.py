"""Pieces of a batch that nobody has measured, as the measured ones lead one to expect them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import invwishart

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.seeds import generator


def fewest_pieces(n_axes: int) -> int:
    """Return how many pieces a prediction of so many axes needs at least."""
    return n_axes + 2


def predicted_pieces(
    measured: npt.ArrayLike, n_processes: int, n_pieces: int, *, seed: int
) -> RealArray:
    """Draw pieces of processes that the measured pieces may have come from.

    Parameters
    ----------
    measured : array, shape (n, k)
        Characteristics of the measured pieces, such as stiffness factors per axis.
    n_processes : int
        Means and covariances that are drawn.
    n_pieces : int
        Pieces of each.
    seed : int
        From 1.

    Returns
    -------
    array, shape (n_processes, n_pieces, k)
        [units of the measured].

    Raises
    ------
    InputError
        Fewer than `fewest_pieces`, pieces that do not scatter in some combination of axes, seed 0.

    Notes
    -----
    Normal scatter with unknown mean and covariance, Jeffreys' prior: ``Σ ~ W⁻¹(S, n − 1)``,
    ``µ | Σ ~ N(x̄, Σ/n)`` with S the sum of squares about the mean (Gelman et al., "Bayesian Data
    Analysis", 3rd ed., section 3.6). Few pieces give wide tails, as they should.
    """
    pieces = np.asarray(measured, dtype=float)
    n, k = pieces.shape
    if n < fewest_pieces(k):
        raise InputError(
            f"{n} pieces with {k} axes say too little of the next ones: measure at least "
            f"{fewest_pieces(k)}"
        )
    centred = pieces - pieces.mean(axis=0)
    squares = centred.T @ centred
    if np.linalg.matrix_rank(squares, hermitian=True) < k:
        raise InputError(f"{n} pieces do not scatter in every axis: look for copied measurements")
    random = generator(seed, "predicted pieces")
    covariance = invwishart(df=n - 1, scale=squares).rvs(n_processes, random_state=random)
    roots = np.linalg.cholesky(np.reshape(covariance, (n_processes, k, k)))
    means = pieces.mean(axis=0) + np.einsum(
        "pij,pj->pi", roots, random.standard_normal((n_processes, k)) / np.sqrt(n)
    )
    normals = random.standard_normal((n_processes, n_pieces, k))
    return np.asarray(means[:, np.newaxis] + np.einsum("pij,pnj->pni", roots, normals))
