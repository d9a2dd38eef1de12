"""How good a front is beside others: the figures of merit that comparisons are made of.

All objectives are to be minimised. Fronts are plain arrays of shape (n, m), finite.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import moocore
import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.fronts import hypervolume, nondominated

MARGIN = 0.1
"""The reference point lies this share of the box beyond its worst corner [1]."""


@dataclass(frozen=True, eq=False)
class CommonBox:
    """The box of the best front that several fronts make together.

    Figures of merit are taken in the units of this box, so that objectives of different size
    count alike.

    Parameters
    ----------
    ideal, nadir : array, shape (m,)
        Best and worst value of each objective on the common front [their units].
    front : array, shape (n, m)
        The common front: what no point of any front beats [their units].
    """

    ideal: RealArray
    nadir: RealArray
    front: RealArray

    def __post_init__(self) -> None:
        for name in ("ideal", "nadir", "front"):
            object.__setattr__(self, name, frozen_copy(np.asarray(getattr(self, name))))

    @property
    def span(self) -> RealArray:
        """Size of the box, shape (m,); 1 where the common front does not extend [their units]."""
        span = self.nadir - self.ideal
        return np.asarray(np.where(span > 0.0, span, 1.0))

    @property
    def reference_point(self) -> RealArray:
        """Of the hypervolume, shape (m,) [their units]: state it beside every figure."""
        return np.asarray(self.nadir + MARGIN * self.span)

    def scaled(self, objectives: RealArray) -> RealArray:
        """Return objectives with the ideal at 0 and the nadir at 1 [1]."""
        return np.asarray((objectives - self.ideal) / self.span)

    def hypervolume(self, objectives: RealArray) -> float:
        """Return the share of the box up to the reference point that a front dominates [1]."""
        m = len(self.ideal)
        volume = hypervolume(self.scaled(objectives), np.full(m, 1.0 + MARGIN))
        return volume / (1.0 + MARGIN) ** m

    def share(self, volume: float) -> float:
        """Return a hypervolume in the objectives' own units as a share of the same box [1]."""
        whole = np.prod(self.reference_point - self.ideal)
        return float(volume / whole)

    def igd_plus(self, objectives: RealArray) -> float:
        """Return the mean distance from the common front to what a front reaches of it [1].

        Notes
        -----
        IGD+: only objectives in which the front is worse count (H. Ishibuchi et al., "Modified
        distance calculation in generational distance and inverted generational distance", EMO
        2015).
        """
        return float(moocore.igd_plus(self.scaled(objectives), ref=self.scaled(self.front)))

    def epsilon(self, objectives: RealArray) -> float:
        """Return by how much a front must move in all objectives to cover the common front [1].

        Notes
        -----
        The additive ε indicator (E. Zitzler et al., "Performance assessment of multiobjective
        optimizers", IEEE Transactions on Evolutionary Computation 7, 2003).
        """
        scaled = self.scaled(objectives)
        return float(moocore.epsilon_additive(scaled, ref=self.scaled(self.front)))


def common_box(fronts: Sequence[RealArray]) -> CommonBox:
    """Return the box of the union of fronts.

    Raises
    ------
    InputError
        No front, an empty one, one that is not finite, or another number of objectives.
    """
    if not fronts:
        raise InputError("there are no fronts to compare: bring at least one")
    width = fronts[0].shape[1]
    for number, front in enumerate(fronts, start=1):
        if len(front) == 0 or front.shape[1] != width or not np.all(np.isfinite(front)):
            raise InputError(
                f"front {number} has shape {front.shape}: fronts to compare have at least one row "
                "of finite values and the same objectives"
            )
    union = np.concatenate(fronts)
    best = union[nondominated(union)]
    best = best[np.lexsort(best.T[::-1])]
    return CommonBox(best.min(axis=0), best.max(axis=0), best)


def coverage(front: RealArray, other: RealArray) -> float:
    """Return the share of another front's points that a front equals or beats [1].

    Notes
    -----
    C(front, other) of E. Zitzler and L. Thiele, "Multiobjective evolutionary algorithms: a
    comparative case study", IEEE Transactions on Evolutionary Computation 3, 1999. Both directions
    belong together: they need not add up to 1.
    """
    beaten = np.all(front[:, None, :] <= other[None, :, :], axis=2).any(axis=0)
    return float(np.mean(beaten))


def attainment(fronts: Sequence[RealArray], shares: Sequence[float]) -> Mapping[float, RealArray]:
    """Return what a share of all fronts attains.

    Parameters
    ----------
    fronts : sequence of array, shape (n_i, m)
        Such as of several seeds; two or three objectives.
    shares : sequence of float
        Above 0, up to 1 [1]; 0.5 is the median.

    Returns
    -------
    mapping of float to array, shape (n, m)
        Share → the points that at least this share of all fronts equals or beats, themselves a
        front, sorted by the first objective.

    Notes
    -----
    Levels of the empirical attainment function (C. M. Fonseca, V. Grunert da Fonseca, L. Paquete,
    "Exploring the performance of stochastic multiobjective optimisers with the second-order
    attainment function", EMO 2005).
    """
    if any(not 0.0 < share <= 1.0 for share in shares):
        raise InputError(f"attainment of {list(shares)} of all fronts: take shares up to 1")
    points = np.concatenate(fronts)
    sets = np.repeat(np.arange(1, len(fronts) + 1), [len(front) for front in fronts])
    levels = {}
    for share in shares:
        # whole fronts: an attainment of 2.5 of 5 fronts is one of 3
        needed = 100.0 * np.ceil(share * len(fronts) - 1e-9) / len(fronts)
        surface = moocore.eaf(points, sets, percentiles=[needed])[:, :-1]
        levels[share] = np.asarray(surface[np.lexsort(surface.T[::-1])])
    return levels


def level_gap(front: RealArray, other: RealArray, n_points: int = 200) -> float:
    """Return how much better a front is in the first objective at equal second objective.

    Parameters
    ----------
    front, other : array, shape (n, 2)
        Two objectives.
    n_points : int
        Values of the second objective, evenly over the range that both fronts have.

    Returns
    -------
    float
        Mean over that range of ``front - other``, negative if the front is better; NaN if the
        ranges do not meet [unit of the first objective].
    """
    low = max(front[:, 1].min(), other[:, 1].min())
    high = min(front[:, 1].max(), other[:, 1].max())
    if not low < high:
        return float("nan")
    levels = np.linspace(low, high, n_points)
    return float(np.mean(_best_first(front, levels) - _best_first(other, levels)))


def _best_first(front: RealArray, levels: RealArray) -> RealArray:
    """Return the smallest first objective that stays below each level of the second."""
    order = np.argsort(front[:, 1], kind="stable")
    best = np.minimum.accumulate(front[order, 0])
    return np.asarray(best[np.searchsorted(front[order, 1], levels, side="right") - 1])


def design_distance(
    designs: RealArray, others: RealArray, lower: npt.ArrayLike, upper: npt.ArrayLike
) -> float:
    """Return how far two sets of designs lie apart.

    Parameters
    ----------
    designs, others : array, shape (n, k), (p, k)
        [units of the bounds].
    lower, upper : array, shape (k,)
        Bounds of the search; variables that cannot move do not count.

    Returns
    -------
    float
        Root mean square over the variables of the distance to the closest design of the other set,
        in shares of the bounds, averaged over both sets [1]: 0 for equal sets, 1 from corner to
        opposite corner.
    """
    span = np.asarray(upper, dtype=float) - np.asarray(lower, dtype=float)
    moves = span > 0.0
    if not moves.any():
        return 0.0
    first, second = (np.asarray(x)[:, moves] / span[moves] for x in (designs, others))
    square = np.mean((first[:, None, :] - second[None, :, :]) ** 2, axis=2)
    nearest = np.sqrt(square.min(axis=1)).mean(), np.sqrt(square.min(axis=0)).mean()
    return float(np.mean(nearest))
