"""Where there are measurements: the part of space in which a fitted model may be believed."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.mounts.named_arrays import freeze

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
