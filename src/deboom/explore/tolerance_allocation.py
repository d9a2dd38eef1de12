"""The cheapest tolerances of a design for a target, and what each tolerance is worth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import brentq, minimize

from deboom.arrays import RealArray, frozen_copy
from deboom.errors import InputError
from deboom.explore.tolerance_curves import CostCurves
from deboom.explore.tolerance_effect import SOFTNESS, Scattered, ToleranceEffect

STEPS = 200
"""Largest number of steps of the search for tolerances."""
PRECISION = 1e-10
"""Steps end when they gain less than this part of the cost [1]."""
MET = 1e-7
"""A target missed by less than this counts as met [unit of the target's excess]."""


class Target(Protocol):
    """What tolerances must reach."""

    def excess(self, scattered: Scattered) -> tuple[float, RealArray]:
        """Return by how much it is missed, 0 or less if it is met, and the derivatives (k,)."""

    def missed(self, scattered: Scattered, names: tuple[str, ...]) -> str:
        """Say by how much it is missed, and by which response most."""


@dataclass(frozen=True)
class SigmaTarget:
    """A largest sum of standard deviations over the responses.

    Parameters
    ----------
    sigma_sum : float
        Above 0 [response unit].
    scale : float
        What messages multiply the sum with, such as from a sum to a mean [1].
    words : str
        What messages call it then.
    """

    sigma_sum: float
    scale: float = 1.0
    words: str = "the sum of sigmas"

    def __post_init__(self) -> None:
        if not 0.0 < self.sigma_sum < np.inf:
            raise InputError(f"a sum of sigmas of {self.sigma_sum:g} as target: give more than 0")

    def excess(self, scattered: Scattered) -> tuple[float, RealArray]:
        """Return the logarithm of the sum over its target, with derivatives (k,) [1]."""
        total = float(scattered.sigma.sum())
        if total == 0.0:
            return -np.inf, np.zeros(scattered.tolerance.size)
        slope = scattered.sigma_by_tolerance.sum(axis=0) / total
        return float(np.log(total / self.sigma_sum)), slope

    def missed(self, scattered: Scattered, names: tuple[str, ...]) -> str:
        """Say how large the sum still is, and which response has most of it."""
        total, worst = float(scattered.sigma.sum()), int(np.argmax(scattered.sigma))
        return (
            f"{self.words} is still {self.scale * total:.4g}, wanted is "
            f"{self.scale * self.sigma_sum:.4g}, {self.scale * (total - self.sigma_sum):.4g} less; "
            f"{names[worst]} binds with {100 * scattered.sigma[worst] / total:.0f} % of it"
        )


@dataclass(frozen=True, eq=False)
class ShareTarget:
    """A smallest share of parts × responses within a limit.

    Parameters
    ----------
    limit : array, shape (r,)
        Of each response [response unit].
    share : float
        Between 0 and 1 [1].
    softness : float
        See `Scattered.soft_share`: what is searched with. Count the parts afterwards.
    scale : float
        What messages multiply responses with, such as from a sum to a mean [1].
    unit : str
        That messages give responses then.
    """

    limit: RealArray
    share: float
    softness: float = SOFTNESS
    scale: float = 1.0
    unit: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "limit", frozen_copy(np.asarray(self.limit, dtype=float)))
        if not 0.0 < self.share < 1.0:
            raise InputError(f"a share of {self.share:g} of all parts: take one between 0 and 1")
        if not np.isfinite(self.limit).all():
            raise InputError("limits of the responses must be finite")

    def excess(self, scattered: Scattered) -> tuple[float, RealArray]:
        """Return by how much the share falls short, with derivatives (k,) [1]."""
        share, slope = scattered.soft_share(self.limit, self.softness)
        return float(self.share - share.mean()), -slope.mean(axis=0)

    def missed(self, scattered: Scattered, names: tuple[str, ...]) -> str:
        """Say how large the share is, and which response has the smallest."""
        share = scattered.share(self.limit)
        worst = int(np.argmin(share))
        beyond = self.scale * float(scattered.values[:, worst].mean() - self.limit[worst])
        side = "above" if beyond > 0.0 else "below"
        distance = f"{abs(beyond):.4g} {self.unit}".rstrip()
        return (
            f"only {100 * share.mean():.4g} % of parts × responses are within their limit, wanted "
            f"are {100 * self.share:.4g} %; {names[worst]} binds with {100 * share[worst]:.4g} %, "
            f"its mean is {distance} {side} the limit"
        )


@dataclass(frozen=True, eq=False)
class MarginalValues:
    """What a little more or less tolerance does, one value per variable with a cost curve.

    Parameters
    ----------
    names : tuple of str, length k
        The variables.
    tolerance : array, shape (k,)
        Where the values hold, half widths [1].
    sigma_by_tolerance : array, shape (k,)
        Sum of standard deviations per unit of tolerance [response unit].
    cost_by_tolerance : array, shape (k,)
        Price per unit of tolerance, 0 or less [money].
    """

    names: tuple[str, ...]
    tolerance: RealArray
    sigma_by_tolerance: RealArray
    cost_by_tolerance: RealArray

    @property
    def sigma_per_percent(self) -> RealArray:
        """Sum of standard deviations per per cent of tolerance, shape (k,) [response unit]."""
        return self.sigma_by_tolerance / 100.0

    @property
    def sigma_per_cost(self) -> RealArray:
        """Sigma that one unit of money takes away, shape (k,) [response unit per money].

        Equal for all variables between their bounds when the tolerances are the cheapest; nan
        where a tolerance is free.
        """
        spent = -self.cost_by_tolerance
        nothing = np.full(spent.shape, np.nan)
        return np.asarray(np.divide(self.sigma_by_tolerance, spent, out=nothing, where=spent > 0))


@dataclass(frozen=True, eq=False)
class Allocation:
    """Tolerances that reach a target.

    Parameters
    ----------
    names : tuple of str, length k
        Variables with a cost curve.
    tolerance : array, shape (k,)
        Half widths [1].
    cost : array, shape (k,)
        Price of each [money].
    scattered : Scattered
        The responses there, in the draws of the search; of all variables of the space.
    """

    names: tuple[str, ...]
    tolerance: RealArray
    cost: RealArray
    scattered: Scattered

    @property
    def total_cost(self) -> float:
        """Price of all of them [money]."""
        return float(self.cost.sum())

    @property
    def sigma_sum(self) -> float:
        """Sum of standard deviations over the responses [response unit]."""
        return float(self.scattered.sigma.sum())


@dataclass(frozen=True, eq=False)
class Allocator:
    """A design, the price of its tolerances, and how far they may go.

    Parameters
    ----------
    effect : ToleranceEffect
        The design. Variables without a cost curve keep their tolerance.
    curves : CostCurves
        Prices.
    lower, upper : float or array, shape (k,)
        Bounds of the tolerances that have a price, half widths above 0 and below 1 [1]; a curve
        that ends before narrows them.

    Raises
    ------
    InputError
        A curve of a variable that there is not, bounds that leave nothing.
    """

    effect: ToleranceEffect
    curves: CostCurves
    lower: RealArray
    upper: RealArray

    def __post_init__(self) -> None:
        unknown = [name for name in self.curves.names if name not in self.effect.names]
        if unknown:
            raise InputError(
                f"there is a cost of {unknown}, and the design has {list(self.effect.names)}"
            )
        ends = np.array([[curve.lower, curve.upper] for curve in self.curves.curves])
        lower = np.maximum(np.asarray(self.lower, dtype=float), ends[:, 0])
        upper = np.minimum(np.asarray(self.upper, dtype=float), ends[:, 1])
        for name, low, high in zip(self.curves.names, lower, upper, strict=True):
            if not 0.0 < low <= high < 1.0:
                raise InputError(
                    f"the tolerance of '{name}' could only be chosen from {low:g} to {high:g}: "
                    "give bounds above 0 and below 1 within its cost curve"
                )
        object.__setattr__(self, "lower", frozen_copy(lower))
        object.__setattr__(self, "upper", frozen_copy(upper))

    @property
    def names(self) -> tuple[str, ...]:
        """Variables whose tolerance can be chosen, k of them."""
        return self.curves.names

    @property
    def today(self) -> RealArray:
        """Tolerances of the design space, shape (k,) [1]."""
        return self.effect.today[self._columns]

    def at(self, tolerance: RealArray) -> Allocation:
        """Return what given tolerances cost and do, shape (k,)."""
        whole = self.effect.today.copy()
        whole[self._columns] = tolerance
        cost = self.curves.each(tolerance)
        return Allocation(self.names, frozen_copy(tolerance), cost, self.effect.at(whole))

    def marginal_values(self, tolerance: RealArray) -> MarginalValues:
        """Return what each tolerance is worth at given tolerances, shape (k,)."""
        slope = self.at(tolerance).scattered.sigma_by_tolerance.sum(axis=0)
        return MarginalValues(
            self.names, frozen_copy(tolerance), slope[self._columns], self.curves.slope(tolerance)
        )

    def cheapest(self, target: Target) -> Allocation:
        """Return the cheapest tolerances that reach a target.

        Raises
        ------
        InputError
            Even the tightest tolerances do not reach it: says by how much, and which response
            binds.

        Notes
        -----
        Sequential quadratic programming (SLSQP) over the logarithms of the tolerances, started at
        one tolerance everywhere that reaches the target. For a linear response of independent
        tolerances with reciprocal costs this is a geometric program: there is one optimum, where
        ``-C_k' = λ ∂σ/∂t_k`` for every tolerance between its bounds.
        """
        start = self.uniform(target)
        scale = start.total_cost or 1.0
        known: dict[bytes, tuple[float, RealArray]] = {}

        def excess(place: RealArray) -> tuple[float, RealArray]:
            key = place.tobytes()
            if key not in known:
                known.clear()
                known[key] = self._excess(target, self._within(np.exp(place)))
            return known[key]

        def cost(place: RealArray) -> tuple[float, RealArray]:
            tolerance = self._within(np.exp(place))
            slope = self.curves.slope(tolerance) * tolerance
            return self.curves.total(tolerance) / scale, slope / scale

        found = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
            cost,
            np.log(start.tolerance),
            jac=True,
            method="SLSQP",
            bounds=list(zip(np.log(self.lower), np.log(self.upper), strict=True)),
            constraints={
                "type": "ineq",
                "fun": lambda place: -excess(place)[0],
                "jac": lambda place: -excess(place)[1] * np.exp(place),
            },
            options={"maxiter": STEPS, "ftol": PRECISION},
        )
        best = self.at(self._within(np.exp(found.x)))
        missed = target.excess(best.scattered)[0] > MET
        return start if missed or best.total_cost > start.total_cost else best

    def price_spread(self, found: Allocation, target: Target) -> float:
        """Return how far tolerances are from the cheapest: 0 at the optimum [1].

        Parameters
        ----------
        found : Allocation
            Tolerances.
        target : Target
            What they reach.

        Returns
        -------
        float
            Largest minus smallest price of the target, ``-C_k' / (∂e/∂t_k)`` with its excess
            ``e``, over the tolerances between their bounds, by its mean; 0 of fewer than two.
        """
        by_tolerance = target.excess(found.scattered)[1][self._columns]
        inside = (found.tolerance > 1.0001 * self.lower) & (found.tolerance < 0.9999 * self.upper)
        inside &= by_tolerance > 0.0
        if inside.sum() < 2:
            return 0.0
        price = -self.curves.slope(found.tolerance)[inside] / by_tolerance[inside]
        return float(np.ptp(price) / price.mean())

    def uniform(self, target: Target) -> Allocation:
        """Return the widest one tolerance everywhere, within the bounds, that reaches a target.

        Raises
        ------
        InputError
            As `cheapest`.
        """

        def everywhere(place: float) -> RealArray:
            return self._within(np.full(len(self.names), np.exp(place)))

        def excess(place: float) -> float:
            return self._excess(target, everywhere(place))[0]

        low, high = np.log(self.lower.min()), np.log(self.upper.max())
        if excess(high) <= 0.0:
            return self.at(everywhere(high))
        if excess(low) > 0.0:
            tightest = self.at(everywhere(low)).scattered
            raise InputError(
                "the target cannot be reached with the tightest tolerances "
                f"({100 * self.lower.min():.3g} %): "
                f"{target.missed(tightest, self.effect.response_names)}; allow tighter tolerances, "
                "a wider target or another design"
            )
        return self.at(everywhere(_reached(excess, low, high)))

    def _excess(self, target: Target, tolerance: RealArray) -> tuple[float, RealArray]:
        value, slope = target.excess(self.at(tolerance).scattered)
        return value, slope[self._columns]

    def _within(self, tolerance: RealArray) -> RealArray:
        return np.clip(tolerance, self.lower, self.upper)

    @property
    def _columns(self) -> list[int]:
        return [self.effect.names.index(name) for name in self.names]


def _reached(excess: Callable[[float], float], low: float, high: float) -> float:
    """Return the end of the last interval around a root at which the target is met."""
    root = float(brentq(excess, low, high, xtol=1e-13, rtol=1e-13))
    step = 1e-13
    while excess(root) > 0.0:
        root -= step
        step *= 2.0
    return max(root, low)
