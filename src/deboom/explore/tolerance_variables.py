"""Tolerances as design variables: what tighter manufacturing buys, and what it costs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.design_space import DesignSpace
from deboom.explore.robust import RobustResponse, RobustValues, joined

SUFFIX = " tolerance"
"""What the name of a tolerance's variable adds to that of its design variable."""


@dataclass(frozen=True, eq=False)
class ToleranceCost:
    """Price of tolerances, ``Σ_k w_k (reference_k / tolerance_k − 1)``.

    Parameters
    ----------
    weight : array, shape (k,)
        Price of halving the reference tolerance of each variable, 0 or more [1].
    reference : array, shape (k,)
        Tolerance that costs nothing more than today, above 0 [1].

    Raises
    ------
    InputError
        Shapes that differ, a negative weight, a reference of 0 or less.

    Notes
    -----
    The reciprocal law is the oldest of the customary ones (Chase and Greenwood, "Design issues in
    mechanical tolerance analysis", Manufacturing Review 1, 1988). A tolerance wider than its
    reference saves money, at most its weight.
    """

    weight: RealArray
    reference: RealArray

    def __post_init__(self) -> None:
        for name in ("weight", "reference"):
            object.__setattr__(self, name, frozen_copy(np.asarray(getattr(self, name), float)))
        finite = np.isfinite(self.weight).all() and np.isfinite(self.reference).all()
        if self.weight.shape != self.reference.shape or self.weight.ndim != 1 or not finite:
            raise InputError("a cost of tolerances needs one weight and one reference per variable")
        if np.any(self.weight < 0.0) or np.any(self.reference <= 0.0):
            raise InputError(
                "a cost of tolerances needs weights of at least 0 and references above 0"
            )

    def __call__(self, tolerances: RealArray) -> RealArray:
        """Return the cost of tolerances, shape (..., k) → (...) [unit of the weights]."""
        return np.asarray(((self.reference / tolerances - 1.0) * self.weight).sum(axis=-1))


@dataclass(frozen=True, eq=False)
class ToleranceResponse:
    """Mean, scatter and cost of designs that choose their tolerances; itself a `Robust`.

    Parameters
    ----------
    robust : RobustResponse
        Its model, draws and objectives; the tolerances of its space are the nominal ones here.
    lower, upper : float
        Bounds of every tolerance, half widths as a fraction of the design's value [1].
    cost : ToleranceCost
        The last objective.

    Raises
    ------
    InputError
        Bounds that do not enclose the nominal tolerances or are not above 0, a space with
        whole-number variables, a cost of another number of variables.
    """

    robust: RobustResponse
    lower: float
    upper: float
    cost: ToleranceCost

    def __post_init__(self) -> None:
        if not self.lower > 0.0:
            raise InputError(f"a tolerance of {self.lower:g} cannot be made: give more than 0")
        if self.robust.space.integer.any():
            raise InputError("whole-number variables have no tolerance that could be chosen")
        if self.cost.weight.size != self.robust.space.n_variables:
            raise InputError(
                f"the cost knows {self.cost.weight.size} tolerances, the design space has "
                f"{self.robust.space.n_variables} variables"
            )
        self.space  # noqa: B018  refuses what does not fit

    @property
    def space(self) -> DesignSpace:
        """Design variables, then their tolerances."""
        inner = self.robust.space
        k = inner.n_variables
        return DesignSpace(
            names=(*inner.names, *(f"{name}{SUFFIX}" for name in inner.names)),
            units=(*inner.units, *("1",) * k),
            nominal=np.concatenate([inner.nominal, inner.tolerance]),
            lower=np.concatenate([inner.lower, np.full(k, self.lower)]),
            upper=np.concatenate([inner.upper, np.full(k, self.upper)]),
            tolerance=np.concatenate([inner.tolerance, np.zeros(k)]),
        )

    @property
    def n_objectives(self) -> int:
        """Those of the response, and the cost."""
        return self.robust.n_objectives + 1

    def split(self, designs: RealArray) -> tuple[RealArray, RealArray]:
        """Return design variables and tolerances of designs (n, 2 k), each of shape (n, k)."""
        k = self.robust.space.n_variables
        return designs[:, :k], designs[:, k:]

    def with_tolerances(self, tolerances: RealArray) -> RobustResponse:
        """Return the response with given tolerances, shape (k,)."""
        return replace(self.robust, space=replace(self.robust.space, tolerance=tolerances))

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, 2 k); the cost is their last objective."""
        designs = self.space.checked(designs)
        inner, tolerances = self.split(designs)
        rows = [
            self.with_tolerances(tolerance)(design[np.newaxis, :])
            for design, tolerance in zip(inner, tolerances, strict=True)
        ]
        values = joined(rows)
        cost = np.where(values.failed, np.nan, self.cost(tolerances))
        return replace(
            values, designs=designs, objectives=np.column_stack([values.objectives, cost])
        )
