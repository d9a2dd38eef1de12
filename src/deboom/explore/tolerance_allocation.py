"""Tolerances: their effect, their cost, and the cheapest ones for a target."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.optimize import brentq, minimize
from scipy.special import ndtr

from deboom.arrays import RealArray, checked, frozen_copy
from deboom.errors import InputError
from deboom.explore.choices import Distribution
from deboom.explore.robust import Robust, RobustEvaluation, RobustValues, joined
from deboom.explore.scatter import ToleranceSample, sobol_sample
from deboom.explore.space import SIGMAS_PER_TOLERANCE, DesignSpace, check_gradient
from deboom.tabled import Tabled

_SOFTNESS = 0.2  # step with which parts within a limit are counted, in standard deviations
_STEPS = 200  # of the search for tolerances
_PRECISION = 1e-10  # gain, as a part of the cost, at which steps end
_MET = 1e-7  # excess of a target that counts as met


@checked(weight="k >=0", reference="k >0")
class ToleranceCost:
    """Price of tolerances, ``Σ_k w_k reference_k / tolerance_k``.

    - `names`: variables whose tolerance has a price.
    - `weight`, `reference` (k,): price of the reference tolerance of each variable, 0 or more, and
      that tolerance, above 0 [1].

    The reciprocal law is the oldest of the customary ones (Chase and Greenwood, "Design issues in
    mechanical tolerance analysis", Manufacturing Review 1, 1988).
    """

    names: tuple[str, ...]
    weight: RealArray
    reference: RealArray

    def each(self, tolerance: RealArray) -> RealArray:
        """Return the price of each tolerance, shape (k,) → (k,) [money]."""
        return np.asarray(self.weight * self.reference / tolerance)

    def slope(self, tolerance: RealArray) -> RealArray:
        """Return the derivative of each price by its tolerance, shape (k,) → (k,) [money]."""
        return np.asarray(-self.weight * self.reference / tolerance**2)


@dataclass(frozen=True, eq=False)
class Scattered:
    """Responses of one design over its scatter, and their derivatives by the tolerances.

    - `tolerance` (k,): half widths [1].
    - `values` (n_samples, r), `by_tolerance` (n_samples, r, k): responses, draw by draw, and their
      derivatives [response unit (per unit tolerance)].
    - `sigma` (r,), `sigma_by_tolerance` (r, k): standard deviations and their derivatives [response
      unit (per unit tolerance)].
    """

    tolerance: RealArray
    values: RealArray
    by_tolerance: RealArray
    sigma: RealArray
    sigma_by_tolerance: RealArray

    def share(self, limit: RealArray) -> RealArray:
        """Return the share of parts within the limits, shape (r,) → (r,) [1]."""
        return np.asarray((self.values <= limit).mean(axis=0))

    def soft_share(self, limit: RealArray) -> tuple[RealArray, RealArray]:
        """Return a share that can be differentiated, shape (r,), with its derivatives (r, k).

        ``mean Φ((limit − y) / w)`` with a width ``w`` of a fifth of the standard deviation: the
        share of responses with a further normal scatter ``w``. Of more than half it is slightly
        less than the share itself.
        """
        scatters = self.sigma > 0.0
        width = np.where(scatters, _SOFTNESS * self.sigma, 1.0)
        place = (limit - self.values) / width
        soft = np.where(scatters, ndtr(place), self.values <= limit)
        density = np.where(scatters, np.exp(-0.5 * place**2) / np.sqrt(2.0 * np.pi), 0.0) / width
        by_width = place * density * np.where(scatters, _SOFTNESS, 0.0)
        slope = -np.einsum("tr,trk->rk", density, self.by_tolerance)
        slope -= by_width.sum(axis=0)[:, None] * self.sigma_by_tolerance
        return np.asarray(soft.mean(axis=0)), np.asarray(slope / len(self.values))


@dataclass(frozen=True, eq=False)
class ToleranceEffect:
    """One design, (k,), whose tolerances can be chosen.

    Its response has a gradient of its model, draws that all tolerances share and no whole-number
    variables, or it is refused.
    """

    robust: Robust
    design: RealArray

    def __post_init__(self) -> None:
        design = self.robust.space.checked(np.atleast_2d(self.design))[0]
        object.__setattr__(self, "design", frozen_copy(design))
        check_gradient(self.robust.evaluate, "tolerances can be chosen only with one")
        if not isinstance(self.robust.sample, ToleranceSample):
            raise InputError("tolerances are chosen with draws that they share: take sobol_sample")
        if self.robust.space.integer.any():
            raise InputError("whole-number variables have no tolerance that could be chosen")
        if not self.robust.space.is_relative_normal:
            raise InputError(
                "tolerances are chosen as fractions of the design's value with normal scatter: "
                "leave out absolute and distribution of the space"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return self.robust.space.names

    @property
    def response_names(self) -> tuple[str, ...]:
        """Names of the responses."""
        return self.robust.evaluate.response_names

    @property
    def today(self) -> RealArray:
        """Tolerances of the space, shape (k,) [1]."""
        return self.robust.space.tolerance

    def at(self, tolerance: RealArray) -> Scattered:
        """Return responses and derivatives at tolerances (k,), or refuse a design that fails.

        A made design is ``x (1 + t/3 s)`` with the scatter ``s`` of the draws, so that
        ``∂y/∂t = ∂y/∂x · x s / 3``; the standard deviation's derivatives follow by the chain rule
        through its estimator and are exact for these draws.
        """
        space = replace(self.robust.space, tolerance=np.asarray(tolerance, float))
        robust = replace(self.robust, space=space)
        model: Any = robust.evaluate
        made, values = robust.made_responses(self.design)
        derivatives = self.robust.prepared(self.design).derivatives(values)
        made_by_tolerance = self.design * robust.scatter(self.design) / SIGMAS_PER_TOLERANCE
        by_tolerance = model.gradient(made) * made_by_tolerance[:, None]
        slope = np.einsum("tr,trk->rk", derivatives.by_sigma, by_tolerance)
        return Scattered(np.asarray(tolerance), values, by_tolerance, derivatives.sigma, slope)


@checked(sigma_sum=">0 <inf")
class SigmaTarget:
    """A largest sum of standard deviations over the responses, above 0 [response unit].

    Messages multiply it with ``scale``, such as from a sum to a mean, and call it ``words``.
    """

    sigma_sum: float
    scale: float = 1.0
    words: str = "the sum of sigmas"

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


@checked(limit="r", share=">0 <1")
class ShareTarget:
    """A smallest share of parts × responses within a limit, (r,); a search takes its soft share.

    Messages multiply responses with ``scale``, such as from a sum to a mean, and give ``unit``.
    """

    limit: RealArray
    share: float
    scale: float = 1.0
    unit: str = ""

    def excess(self, scattered: Scattered) -> tuple[float, RealArray]:
        """Return by how much the soft share falls short, with derivatives (k,) [1]."""
        share, slope = scattered.soft_share(self.limit)
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


Target: TypeAlias = SigmaTarget | ShareTarget
"""What tolerances must reach."""


@dataclass(frozen=True, eq=False)
class Allocation(Tabled):
    """Tolerances of the variables that have a price, with that price and their effect.

    - `names`, `tolerance`, `cost` (k,): the variables, their half widths [1] and the price of each
      [money].
    - `scattered`: responses in the draws of the search; of all variables of the space.

    See Also
    --------
    deboom.allocate_tolerances, deboom.explore.largest_box.LargestBox
    """

    names: tuple[str, ...]
    tolerance: RealArray
    cost: RealArray
    scattered: Scattered

    @property
    def table(self) -> pd.DataFrame:
        """Tolerance and price of each variable."""
        return pd.DataFrame(
            {
                "variable": self.names,
                "tolerance [%]": 100 * self.tolerance,
                "price [money]": self.cost,
            }
        )

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

    - `effect`, `price`: the design and the prices of some of its variables; the others keep their
      tolerance.
    - `lower`, `upper` (k,): bounds of the tolerances that have a price, half widths above 0 and
      below 1 [1].
    """

    effect: ToleranceEffect
    price: ToleranceCost
    lower: RealArray
    upper: RealArray

    def __post_init__(self) -> None:
        shape = (len(self.names),)
        lower, upper = (np.broadcast_to(end, shape) for end in (self.lower, self.upper))
        for name, low, high in zip(self.names, lower, upper, strict=True):
            if not 0.0 < low <= high < 1.0:
                raise InputError(
                    f"the tolerance of '{name}' could only be chosen from {low:g} to {high:g}: "
                    "give bounds above 0 and below 1"
                )
        object.__setattr__(self, "lower", frozen_copy(lower))
        object.__setattr__(self, "upper", frozen_copy(upper))

    @property
    def names(self) -> tuple[str, ...]:
        """Variables whose tolerance can be chosen, k of them."""
        return self.price.names

    @property
    def today(self) -> RealArray:
        """Tolerances of the design space, shape (k,) [1]."""
        return self.effect.today[self._columns]

    def at(self, tolerance: RealArray) -> Allocation:
        """Return what given tolerances, shape (k,), cost and do, see `ToleranceEffect.at`."""
        whole = self.effect.today.copy()
        whole[self._columns] = tolerance
        cost = self.price.each(tolerance)
        return Allocation(self.names, frozen_copy(tolerance), cost, self.effect.at(whole))

    def cheapest(self, target: Target) -> Allocation:
        """Return the cheapest tolerances that reach a target.

        - raises InputError: even the tightest tolerances do not reach it: says by how much, and
          which response binds.

        Sequential quadratic programming (SLSQP) over the logarithms of the tolerances, started at
        one tolerance everywhere that reaches the target. For a linear response of independent
        tolerances with reciprocal costs this is a geometric program: there is one optimum, where
        ``-C_k' = λ ∂σ/∂t_k`` for every tolerance between its bounds.
        """
        start = self.uniform(target)
        scale = start.total_cost or 1.0
        excess_of_tolerances: dict[bytes, tuple[float, RealArray]] = {}

        def excess(place: RealArray) -> tuple[float, RealArray]:
            key = place.tobytes()
            if key not in excess_of_tolerances:
                excess_of_tolerances.clear()
                value, slope = target.excess(self.at(self._within(np.exp(place))).scattered)
                excess_of_tolerances[key] = value, slope[self._columns]
            return excess_of_tolerances[key]

        def cost(place: RealArray) -> tuple[float, RealArray]:
            tolerance = self._within(np.exp(place))
            slope = self.price.slope(tolerance) * tolerance
            return float(self.price.each(tolerance).sum()) / scale, slope / scale

        end = minimize(  # type: ignore[call-overload]  # the stubs know no array of any length
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
            options={"maxiter": _STEPS, "ftol": _PRECISION},
        )
        best = self.at(self._within(np.exp(end.x)))
        missed = target.excess(best.scattered)[0] > _MET
        return start if missed or best.total_cost > start.total_cost else best

    def uniform(self, target: Target) -> Allocation:
        """Return the widest single tolerance within the bounds that reaches a target, or refuse."""

        def everywhere(place: float) -> RealArray:
            return self._within(np.full(len(self.names), np.exp(place)))

        def excess(place: float) -> float:
            return target.excess(self.at(everywhere(place)).scattered)[0]

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

    def _within(self, tolerance: RealArray) -> RealArray:
        return np.clip(tolerance, self.lower, self.upper)

    @cached_property
    def _columns(self) -> list[int]:
        return [self.effect.names.index(name) for name in self.names]


def _reached(excess: Callable[[float], float], low: float, high: float) -> float:
    """Return the place next to the root, on the tighter side, at which the target is met."""
    root = float(brentq(excess, low, high, xtol=1e-13, rtol=1e-13))
    step = 1e-13
    while excess(root) > 0.0:
        root -= step
        step *= 2.0
    return max(root, low)


@dataclass(frozen=True, eq=False, init=False)
class FreeTolerances(RobustEvaluation):
    """Designs whose tolerances are variables beside their values, and what those cost.

    The thesis's bounds ``σ_l ≤ σ_k ≤ σ_u`` of section 3.8.2 by the letter: each design says how
    well its parts are made. Without a price every tolerance at its tightest would win; it is an
    objective besides those of the response.

    Parameters
    ----------
    robust : Robust
        Response with tolerances of today, without limits of its own.
    groups : mapping of str to sequence of str
        Name of each tolerance, such as ``EnM``, to the variables that it is of; variables of no
        group keep theirs.
    lower, upper : float
        Bounds of every tolerance, half widths of three standard deviations [1].

    Raises
    ------
    InputError
        A variable that there is not, in two groups or without scatter; bounds that do not hold
        today's tolerances; a response with limits.

    Notes
    -----
    Variables of a group scatter by the tolerance of their design, ``x (1 + t z/3)``, with the draws
    of the response. The price is that of `ToleranceCost`: today's tolerance over the design's, mean
    over the variables of the groups; 1 for today's.
    """

    robust: Robust
    groups: Mapping[str, tuple[int, ...]]
    widened: DesignSpace

    def __init__(
        self, robust: Robust, groups: Mapping[str, Sequence[str]], lower: float, upper: float
    ) -> None:
        base = robust.space
        if robust.limits:
            raise InputError("tolerances as variables go without limits of the response's numbers")
        grouped = [name for names in groups.values() for name in names]
        for name in grouped:
            scatters = name in base.names and base.tolerance[base.names.index(name)] > 0.0
            if not scatters or grouped.count(name) > 1:
                raise InputError(
                    f"tolerance of '{name}': name variables that scatter, each in one group"
                )
        columns = {
            name: tuple(base.names.index(each) for each in names) for name, names in groups.items()
        }
        today = np.array([base.tolerance[list(places)].mean() for places in columns.values()])
        if not (0.0 < lower < upper < 1.0 and np.all((lower <= today) & (today <= upper))):
            raise InputError(
                f"tolerances from {lower:g} to {upper:g}: give bounds above 0 and below 1 that "
                f"hold today's, {', '.join(f'{each:g}' for each in today)}"
            )
        names = tuple(f"tolerance {name}" for name in columns)
        space = DesignSpace(
            names=(*base.names, *names),
            units=(*base.units, *("1" for _ in names)),
            nominal=np.append(base.nominal, today),
            lower=np.append(base.lower, np.full(len(names), lower)),
            upper=np.append(base.upper, np.full(len(names), upper)),
            tolerance=np.append(base.tolerance, np.zeros(len(names))),
            integer=np.append(base.integer, np.zeros(len(names), dtype=bool)),
            absolute=np.append(base.absolute, np.zeros(len(names), dtype=bool)),
            distribution=base.distribution + (Distribution.normal,) * len(names),
        )
        for field_name, value in (("robust", robust), ("groups", columns), ("widened", space)):
            object.__setattr__(self, field_name, value)

    @property
    def space(self) -> DesignSpace:
        """The variables of the response, then the tolerance of each group."""
        return self.widened

    @property
    def n_objectives(self) -> int:
        """Objectives of the response, and the price."""
        return self.robust.n_objectives + 1

    def tolerance(self, design: RealArray) -> RealArray:
        """Return the tolerances of all variables of the response under a design, shape (k,) [1]."""
        tolerance = self.robust.space.tolerance.copy()
        for value, places in zip(
            design[self.robust.space.n_variables :], self.groups.values(), strict=True
        ):
            tolerance[list(places)] = value
        return tolerance

    def price(self, design: RealArray) -> float:
        """Return the price of a design's tolerances over that of today's [1]."""
        places = [place for group in self.groups.values() for place in group]
        today, tolerance = self.robust.space.tolerance[places], self.tolerance(design)[places]
        cost = ToleranceCost(
            tuple(self.robust.space.names[place] for place in places), np.ones(len(places)), today
        )
        return float(cost.each(tolerance).mean())

    def __call__(self, designs: RealArray) -> RobustValues:
        """Return the values of the designs, shape (n, k + number of groups)."""
        rows = self.space.checked(designs)
        k = self.robust.space.n_variables
        parts = []
        for row in rows:
            space = replace(self.robust.space, tolerance=self.tolerance(row))
            values = replace(self.robust, space=space)(row[np.newaxis, :k])
            objectives = np.column_stack([values.objectives, [self.price(row)]])
            parts.append(replace(values, designs=row[np.newaxis], objectives=objectives))
        return joined(parts)


def allocate_tolerances(
    robust: Robust,
    design: npt.ArrayLike,
    *,
    sigma: float | None = None,
    tightest: float = 0.05,
    widest: float = 0.30,
) -> Allocation:
    """Return the cheapest tolerances of a design that keep the scatter of its responses.

    Parameters
    ----------
    robust : Robust
        Model with a gradient, and draws of the scatter.
    design : array, shape (k,)
        Design that is made [units of the space].
    sigma : float, optional
        Sum of the standard deviations that is kept [unit of the responses]; by default that of
        today's tolerances.
    tightest, widest : float
        Bounds of every tolerance, half widths of three standard deviations [1].

    Returns
    -------
    Allocation
        ``tolerance``, shape (k,) [1]; the price of each is today's tolerance over it, so that
        today's costs 1.

    Raises
    ------
    InputError
        A model without gradient; bounds that cannot be; a scatter that the tightest ones miss.

    See Also
    --------
    deboom.explore.tolerance_allocation.Allocation, deboom.largest_box, deboom.Robust

    Examples
    --------
    >>> import deboom
    >>> model = deboom.read_platform("u06").model(vehicles="U06", motion="prescribed")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> table = deboom.allocate_tolerances(robust, robust.space.nominal).table
    >>> table.loc[table["tolerance [%]"].idxmin(), "variable"]
    'TSM x'
    """
    space = robust.space
    cost = ToleranceCost(space.names, np.ones(space.n_variables), space.tolerance)
    effect = ToleranceEffect(robust, np.asarray(design, dtype=float))
    allocator = Allocator(effect, cost, np.asarray(tightest), np.asarray(widest))
    kept = allocator.at(allocator.today).sigma_sum if sigma is None else sigma
    return allocator.cheapest(SigmaTarget(kept))


ROUNDS = 5
"""Searches at most: if new draws do not confirm a share, the next search asks for another one."""
CLOSE = 0.002
"""How much more than the wanted share is not worth another round [1]."""
ONE_SIDED_95 = 1.644854
"""Lower 95 % bound in standard errors [1]."""


@dataclass(frozen=True, eq=False)
class Verified:
    """σ of the mean level [dB], share within the limits and its lower 95 % bound, nan without."""

    sigma: float
    share: float
    share_lower: float


@dataclass(frozen=True, eq=False)
class ToleranceTask:
    """One design whose tolerances shall reach a σ, or a share within limits (v,) of SPLV.

    `sigma`: of the mean level [dB], today's by default; `share`: of parts × vehicles within the
    limits [1]; `draws`: with which tolerances are verified; `seed`: from 1.
    """

    robust: Robust
    allocator: Allocator
    limits: RealArray | None
    sigma: float | None
    share: float
    draws: int
    seed: int

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        index: Any = self.robust.evaluate
        return float(1.0 / (index.n_lines * len(index.response_names)))

    def reached(self, find: Callable[[Target], Allocation]) -> Allocation:
        """Return what is found for the target.

        A share is asked for a little higher, or lower, until new draws show the wanted share with
        95 % confidence and hardly more: what is chosen by few draws suits these draws best.
        """
        if self.limits is None:
            wanted = self.sigma
            today = self.allocator.at(self.allocator.today).sigma_sum
            return find(self._sigma(today if wanted is None else wanted / self.per_line))
        tried: list[tuple[float, Allocation]] = []
        share = self._share(self.share)
        for _ in range(ROUNDS):
            try:
                allocation = find(share)
            except InputError:
                if not tried:
                    raise
                break
            lower = self.verified(allocation.tolerance, "allocation check").share_lower
            over = lower - self.share
            tried.append((over, allocation))
            if 0.0 <= over <= CLOSE or not 0.0 < share.share - over < 1.0:
                break
            share = replace(share, share=share.share - over + 0.5 * CLOSE)
        confirmed = [row for row in tried if row[0] >= 0.0]
        if confirmed:
            return min(confirmed, key=lambda row: row[1].total_cost)[1]
        return max(tried, key=lambda row: row[0])[1]

    def verified(self, tolerance: RealArray, purpose: str) -> Verified:
        """Evaluate tolerances, shape (k,), with draws that nothing was chosen by."""
        robust = with_draws(self.robust, purpose, self.draws, self.seed)
        whole = robust.space.tolerance.copy()
        whole[[robust.space.names.index(name) for name in self.allocator.names]] = tolerance
        robust = replace(robust, space=replace(robust.space, tolerance=whole))
        values = robust.made_responses(self.allocator.effect.design)[1]
        sigma = float(values.std(axis=0, ddof=1).sum() * self.per_line)
        if self.limits is None:
            return Verified(sigma, np.nan, np.nan)
        good = (values <= self.limits).mean(axis=1)
        error = float(good.std(ddof=1) / np.sqrt(self.draws))
        share = float(good.mean())
        return Verified(sigma, share, share - ONE_SIDED_95 * error)

    def _sigma(self, total: float) -> SigmaTarget:
        return SigmaTarget(total, self.per_line, "σ of the mean level [dB]")

    def _share(self, share: float) -> ShareTarget:
        index: Any = self.robust.evaluate
        return ShareTarget(np.asarray(self.limits), share, scale=1.0 / index.n_lines, unit="dB")


def with_draws(robust: Robust, purpose: str, n_samples: int, seed: int) -> Robust:
    """Return a model with other draws, for choosing tolerances or for checking them."""
    sample = sobol_sample(robust.n_draws, n_samples, seed=seed, purpose=purpose)
    return replace(robust, sample=sample)
