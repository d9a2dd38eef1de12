"""The cheapest tolerances of one design for a target: what is asked, found and verified."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.robust import RobustResponse
from deboom.explore.tolerance_allocation import (
    Allocation,
    Allocator,
    MarginalValues,
    ShareTarget,
    SigmaTarget,
    Target,
)
from deboom.explore.tolerance_curves import CostCurves
from deboom.explore.tolerance_effect import ToleranceEffect
from deboom.explore.tolerance_samples import sobol_sample
from deboom.study.front_design import ChosenDesign
from deboom.study.wanted_tolerances import WantedTarget

DRAWS = 8192
"""Independent draws with which tolerances are verified."""
ROUNDS = 5
"""How often a share that new draws do not confirm is asked for again, a little higher or lower."""
CLOSE = 0.002
"""How much more than the wanted share is not worth another round [1]."""
ONE_SIDED_95 = 1.644854
"""Lower 95 % bound in standard errors [1]."""
ON_CURVE = 8
"""Targets on the curve of cost over target."""
ALONG_FRONT = 12
"""Designs of the front whose marginal values are listed."""


@dataclass(frozen=True, eq=False)
class Verified:
    """Tolerances evaluated with draws that nothing was chosen by.

    Parameters
    ----------
    sigma : float
        Standard deviation of the mean level, mean over the vehicles [dB].
    share, share_lower : float
        Parts × vehicles within the limits, and its one-sided 95 % bound; nan without limits [1].
    """

    sigma: float
    share: float
    share_lower: float


@dataclass(frozen=True, eq=False)
class AllocationStudy:
    """The tolerances of one design.

    Parameters
    ----------
    chosen : ChosenDesign
        Which.
    curves : CostCurves
        Prices.
    wanted : WantedTarget
        What is to be reached.
    lower, upper : float
        Bounds of every tolerance, half widths [1].
    n_samples : int
        Draws with which tolerances are chosen, a power of two.
    seed : int
        Of all draws.
    """

    chosen: ChosenDesign
    curves: CostCurves
    wanted: WantedTarget
    lower: float
    upper: float
    n_samples: int
    seed: int

    @property
    def index(self) -> Any:
        """What is evaluated."""
        return self.chosen.model.evaluate

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return tuple(self.index.response_names)

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        return float(1.0 / (self.index.n_lines * len(self.vehicles)))

    @cached_property
    def allocator(self) -> Allocator:
        """Design and prices, with the draws that tolerances are chosen by."""
        effect = ToleranceEffect(self._with("allocation sample"), self.chosen.design)
        return Allocator(effect, self.curves, np.asarray(self.lower), np.asarray(self.upper))

    @cached_property
    def limits(self) -> RealArray | None:
        """Limit of SPLV of each vehicle, shape (r,) [dB(A)]; None if the target is a sigma."""
        if not self.wanted.limit:
            return None
        levels = self.index(self.chosen.design[None, :])[0] / self.index.n_lines
        return np.asarray(self.wanted.limits(self.vehicles, levels) * self.index.n_lines)

    @cached_property
    def today(self) -> Allocation:
        """Today's tolerances."""
        return self.allocator.at(self.allocator.today)

    @cached_property
    def target(self) -> Target:
        """What the cheapest tolerances were asked for; a share as `_checked` left it."""
        return self._cheapest[0]

    @cached_property
    def cheapest(self) -> Allocation:
        """The cheapest tolerances for the target."""
        return self._cheapest[1]

    @cached_property
    def uniform(self) -> Allocation:
        """One tolerance everywhere for the target."""
        return self._checked(self.allocator.uniform)[1]

    @cached_property
    def uniform_of_effective(self) -> Allocation:
        """One tolerance for the target where it has an effect, the widest elsewhere."""
        names = self.allocator.names
        free = np.isin(names, self.chosen.without_effect)
        lower = np.where(free, self.allocator.upper, self.allocator.lower)
        return self._checked(replace(self.allocator, lower=lower).uniform)[1]

    @cached_property
    def _cheapest(self) -> tuple[Target, Allocation]:
        return self._checked(self.allocator.cheapest)

    def _checked(self, find: Callable[[Target], Allocation]) -> tuple[Target, Allocation]:
        """Return a target and what is found for it.

        A share is asked for a little higher, or lower, until new draws show the wanted share with
        95 % confidence and hardly more: what is chosen by few draws suits these draws best.
        """
        if self.limits is None:
            wanted = self.wanted.sigma
            target = self._sigma(self.today.sigma_sum if wanted is None else wanted / self.per_line)
            return target, find(target)
        tried: list[tuple[float, ShareTarget, Allocation]] = []
        share = self._share(self.wanted.share)
        for _ in range(ROUNDS):
            try:
                found = find(share)
            except InputError:
                if not tried:
                    raise
                break
            lower = self._verified(found.tolerance, "allocation check").share_lower
            over = lower - self.wanted.share
            tried.append((over, share, found))
            if 0.0 <= over <= CLOSE or not 0.0 < share.share - over < 1.0:
                break
            share = replace(share, share=share.share - over + 0.5 * CLOSE)
        confirmed = [one for one in tried if one[0] >= 0.0]
        if confirmed:
            return min(confirmed, key=lambda one: one[2].total_cost)[1:]
        return max(tried, key=lambda one: one[0])[1:]

    @cached_property
    def verified(self) -> dict[str, Verified]:
        """Today's, the cheapest and the uniform tolerances with new draws."""
        rows = {"today's": self.today, "cheapest": self.cheapest, "uniform": self.uniform}
        return {
            name: self._verified(one.tolerance, "allocation verification")
            for name, one in rows.items()
        }

    @cached_property
    def marginal_today(self) -> MarginalValues:
        """What a little tolerance is worth today."""
        return self.allocator.marginal_values(self.allocator.today)

    @cached_property
    def marginal_cheapest(self) -> MarginalValues:
        """What a little tolerance is worth once it is allocated."""
        return self.allocator.marginal_values(self.cheapest.tolerance)

    @cached_property
    def curve(self) -> tuple[RealArray, RealArray, RealArray]:
        """Targets, and the cost of the cheapest and of uniform tolerances, shape (n,) each.

        The targets are σ of the mean level [dB], or shares [1].
        """
        targets = self._targets()
        costs = [
            [one.total_cost for one in (self.allocator.cheapest(t), self.allocator.uniform(t))]
            for t in targets
        ]
        asked = [
            t.sigma_sum * self.per_line if isinstance(t, SigmaTarget) else t.share for t in targets
        ]
        return (np.array(asked), *np.array(costs).T)

    @cached_property
    def along_front(self) -> dict[int, MarginalValues]:
        """Number of a design on the front → what a little tolerance is worth today."""
        count = len(self.chosen.designs)
        rows = np.unique(np.linspace(0, count - 1, min(count, ALONG_FRONT)).astype(int))
        found = {}
        for row in rows.tolist():
            effect = replace(self.allocator.effect, design=self.chosen.designs[row])
            one = replace(self.allocator, effect=effect)
            found[row + 1] = one.marginal_values(self.allocator.today)
        return found

    def _targets(self) -> list[SigmaTarget | ShareTarget]:
        """Targets between what the tightest and what the widest tolerances give."""
        tightest, widest = (
            self.allocator.at(np.asarray(bound))
            for bound in (self.allocator.lower, self.allocator.upper)
        )
        if self.limits is None:
            low, high = 1.02 * tightest.sigma_sum, 0.98 * widest.sigma_sum
            return [self._sigma(float(one)) for one in np.linspace(low, high, ON_CURVE)]
        shares = [
            float(one.scattered.soft_share(self.limits)[0].mean()) for one in (widest, tightest)
        ]
        low, high = shares[0] + 0.02 * np.ptp(shares), shares[1] - 0.02 * np.ptp(shares)
        return [self._share(float(one)) for one in np.linspace(low, high, ON_CURVE)]

    def _sigma(self, total: float) -> SigmaTarget:
        return SigmaTarget(total, self.per_line, "σ of the mean level [dB]")

    def _share(self, share: float) -> ShareTarget:
        limits = np.asarray(self.limits)
        return ShareTarget(limits, share, scale=1.0 / self.index.n_lines, unit="dB")

    def _with(self, purpose: str, n_samples: int | None = None) -> RobustResponse:
        model = self.chosen.model
        sample = sobol_sample(
            model.n_draws, n_samples or self.n_samples, seed=self.seed, purpose=purpose
        )
        return replace(model, sample=sample)

    def _verified(self, tolerance: RealArray, purpose: str) -> Verified:
        effect = self.allocator.effect.with_draws(self._with(purpose, DRAWS))
        whole = effect.today.copy()
        whole[[effect.names.index(name) for name in self.allocator.names]] = tolerance
        values = effect.values(whole)
        sigma = float(values.std(axis=0, ddof=1).sum() * self.per_line)
        if self.limits is None:
            return Verified(sigma, np.nan, np.nan)
        good = (values <= self.limits).mean(axis=1)
        error = float(good.std(ddof=1) / np.sqrt(DRAWS))
        share = float(good.mean())
        return Verified(sigma, share, share - ONE_SIDED_95 * error)
