"""Space-filling designs within the bounds of a design space."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist, pdist
from scipy.stats import qmc

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace
from deboom.explore.seeds import generator

DRAWS = 50
"""Latin hypercubes that are drawn; the one with the largest smallest distance is improved."""
SWAPS = 2000
"""Exchanges that are tried to improve it."""


def sobol_designs(space: DesignSpace, n_designs: int, *, seed: int) -> RealArray:
    """Return scrambled Sobol points.

    Parameters
    ----------
    space : DesignSpace
        Its bounds.
    n_designs : int
        A power of two, which keeps the balance of the points.
    seed : int
        From 1 upwards.

    Returns
    -------
    array, shape (n_designs, k)
        [units of the space].

    Raises
    ------
    InputError
        A count that is not a power of two, seed 0.
    """
    exponent = max(n_designs, 1).bit_length() - 1
    if n_designs != 2**exponent:
        raise InputError(
            f"{n_designs} Sobol points are not a power of two and would be unbalanced: take "
            f"{2**exponent} or {2 ** (exponent + 1)}, or another plan"
        )
    points = qmc.Sobol(space.n_variables, rng=generator(seed, "designs")).random_base2(exponent)
    return _within(space, points)


def latin_hypercube(space: DesignSpace, n_designs: int, *, seed: int) -> RealArray:
    """Return a Latin hypercube whose closest designs are far apart (maximin).

    Parameters
    ----------
    space : DesignSpace
        Its bounds.
    n_designs : int
        At least 2.
    seed : int
        From 1 upwards.

    Returns
    -------
    array, shape (n_designs, k)
        Every variable has exactly one design in each of `n_designs` equal intervals
        [units of the space].

    Raises
    ------
    InputError
        Fewer than two designs, seed 0.

    Notes
    -----
    The best of `DRAWS` hypercubes, then `SWAPS` exchanges: one of the two closest designs trades
    one coordinate with a third design, and keeps it if the smallest distance does not fall. After
    Morris and Mitchell, J. Stat. Plan. Inference 43 (1995) 381-402, without their annealing. Each
    trade keeps the hypercube.
    """
    if n_designs < 2:
        raise InputError(f"a Latin hypercube of {n_designs} designs: take at least 2")
    random = generator(seed, "designs")
    sampler = qmc.LatinHypercube(space.n_variables, rng=random)
    draws = [sampler.random(n_designs) for _ in range(DRAWS)]
    best = draws[int(np.argmax([pdist(points).min() for points in draws]))]
    return _within(space, _spread(best, random))


def _spread(points: RealArray, random: np.random.Generator) -> RealArray:
    """Exchange coordinates of close designs until they are further apart."""
    points = points.copy()
    n, k = points.shape
    distances = cdist(points, points)
    np.fill_diagonal(distances, np.inf)
    for _ in range(SWAPS):
        smallest = distances.min()
        pair = np.unravel_index(int(np.argmin(distances)), distances.shape)
        one, other = int(pair[random.integers(2)]), int(random.integers(n))
        column = int(random.integers(k))
        rows = [one, other]
        if one == other:
            continue
        points[rows, column] = points[rows[::-1], column]
        moved = cdist(points[rows], points)
        moved[[0, 1], rows] = np.inf
        if moved.min() < smallest:
            points[rows, column] = points[rows[::-1], column]
        else:
            distances[rows], distances[:, rows] = moved, moved.T
    return points


def _within(space: DesignSpace, points: RealArray) -> RealArray:
    """Map points of the unit cube to the bounds; whole numbers all get the same share."""
    width = space.upper - space.lower
    whole = np.floor(space.lower + points * (width + 1.0))
    return np.where(space.integer, whole, space.lower + points * width)
