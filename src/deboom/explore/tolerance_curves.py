"""What tolerances cost: one curve per variable, falling with the width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.interpolate import PchipInterpolator

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.tolerance_variables import ToleranceCost


class CostCurve(Protocol):
    """The price of one variable's tolerance."""

    @property
    def name(self) -> str:
        """Of the variable."""

    @property
    def lower(self) -> float:
        """Tightest tolerance with a price, half width [1]."""

    @property
    def upper(self) -> float:
        """Widest one [1]."""

    def cost(self, tolerance: float) -> float:
        """Return the price [money]."""

    def slope(self, tolerance: float) -> float:
        """Return the derivative of the price by the tolerance, 0 or less [money]."""


@dataclass(frozen=True)
class ReciprocalCurve:
    """The price ``weight · reference / tolerance``.

    Parameters
    ----------
    name : str
        Of the variable.
    weight : float
        Price of the reference tolerance, 0 or more [money].
    reference : float
        Half width, above 0 [1].

    Raises
    ------
    InputError
        A weight below 0, a reference of 0 or less, or a value that is not finite.

    Notes
    -----
    K. W. Chase and W. H. Greenwood, "Design issues in mechanical tolerance analysis",
    Manufacturing Review 1, 1988. `deboom.explore.tolerance_variables.ToleranceCost` is the same law
    less the price of the reference.
    """

    name: str
    weight: float
    reference: float
    lower: float = 0.0
    upper: float = 1.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.weight < np.inf and 0.0 < self.reference < np.inf):
            raise InputError(
                f"the cost of '{self.name}' has the weight {self.weight:g} and the reference "
                f"{self.reference:g}: give a weight of at least 0 and a reference above 0"
            )

    def cost(self, tolerance: float) -> float:
        """Return the price [money]."""
        return self.weight * self.reference / tolerance

    def slope(self, tolerance: float) -> float:
        """Return the derivative of the price by the tolerance [money]."""
        return -self.weight * self.reference / tolerance**2


@dataclass(frozen=True, eq=False)
class TabulatedCurve:
    """A price known at some tolerances; between them a monotone curve, beyond them nothing.

    Parameters
    ----------
    name : str
        Of the variable.
    tolerance : array, shape (n,)
        At least two half widths, above 0, in any order, each once [1].
    costs : array, shape (n,)
        Their prices, 0 or more; none is dearer than a tighter one [money].

    Raises
    ------
    InputError
        Too few points, a tolerance twice or out of range, a price that rises with the width.

    Notes
    -----
    Piecewise cubic over the logarithm of the tolerance that keeps the points' monotony (F. N.
    Fritsch and J. Butland, SIAM Journal on Scientific and Statistical Computing 5, 1984).
    """

    name: str
    tolerance: RealArray
    costs: RealArray

    def __post_init__(self) -> None:
        tolerance = np.asarray(self.tolerance, dtype=float)
        costs = np.asarray(self.costs, dtype=float)
        if tolerance.ndim != 1 or tolerance.shape != costs.shape or tolerance.size < 2:
            raise InputError(f"the cost of '{self.name}' needs at least two tolerances with prices")
        order = np.argsort(tolerance)
        tolerance, costs = tolerance[order], costs[order]
        finite = np.isfinite(tolerance).all() and np.isfinite(costs).all()
        if not (finite and tolerance[0] > 0.0 and costs.min() >= 0.0):
            raise InputError(
                f"the cost of '{self.name}' needs tolerances above 0 and prices of at least 0"
            )
        if np.any(np.diff(tolerance) == 0.0):
            raise InputError(f"the cost of '{self.name}' names a tolerance twice: keep one")
        rising = np.flatnonzero(np.diff(costs) > 0.0)
        if rising.size:
            at = rising[0]
            raise InputError(
                f"the cost of '{self.name}' rises from {costs[at]:g} at ±{tolerance[at]:g} to "
                f"{costs[at + 1]:g} at ±{tolerance[at + 1]:g}: a wider tolerance never costs more, "
                "correct the table"
            )
        object.__setattr__(self, "tolerance", frozen_copy(tolerance))
        object.__setattr__(self, "costs", frozen_copy(costs))

    @property
    def lower(self) -> float:
        """Tightest tolerance with a price [1]."""
        return float(self.tolerance[0])

    @property
    def upper(self) -> float:
        """Widest one [1]."""
        return float(self.tolerance[-1])

    def cost(self, tolerance: float) -> float:
        """Return the price, nan beyond the points [money]."""
        return float(self._curve(np.log(tolerance)))

    def slope(self, tolerance: float) -> float:
        """Return the derivative of the price by the tolerance, nan beyond the points [money]."""
        return float(self._curve(np.log(tolerance), 1)) / tolerance

    @cached_property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(np.log(self.tolerance), self.costs, extrapolate=False)


@dataclass(frozen=True)
class CostCurves:
    """The price of all tolerances that can be chosen: the sum of their curves.

    Parameters
    ----------
    curves : tuple of CostCurve
        One per variable, each once.

    Raises
    ------
    InputError
        No curve, or two of one variable.
    """

    curves: tuple[CostCurve, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "curves", tuple(self.curves))
        twice = [name for name in self.names if self.names.count(name) > 1]
        if twice or not self.curves:
            raise InputError(f"every tolerance needs one cost curve: there are {twice or 'none'}")

    @property
    def names(self) -> tuple[str, ...]:
        """Variables, k of them."""
        return tuple(curve.name for curve in self.curves)

    def each(self, tolerance: RealArray) -> RealArray:
        """Return the price of each tolerance, shape (k,) → (k,) [money]."""
        return np.array([c.cost(float(t)) for c, t in zip(self.curves, tolerance, strict=True)])

    def slope(self, tolerance: RealArray) -> RealArray:
        """Return the derivative of each price by its tolerance, shape (k,) → (k,) [money]."""
        return np.array([c.slope(float(t)) for c, t in zip(self.curves, tolerance, strict=True)])

    def total(self, tolerance: RealArray) -> float:
        """Return the price of all tolerances, shape (k,) [money]."""
        return float(self.each(tolerance).sum())


def reciprocal_curves(names: Sequence[str], cost: ToleranceCost) -> CostCurves:
    """Return the curves of a reciprocal cost, one per variable in its order."""
    rows = zip(names, cost.weight, cost.reference, strict=True)
    return CostCurves(tuple(ReciprocalCurve(name, float(w), float(r)) for name, w, r in rows))
