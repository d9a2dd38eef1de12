"""The cheapest tolerances of one design for a target: what is asked, found and verified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

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
from deboom.explore.tolerance_curves import (
    CostCurve,
    CostCurves,
    TabulatedCurve,
    reciprocal_curves,
)
from deboom.explore.tolerance_effect import ToleranceEffect
from deboom.explore.tolerance_samples import sobol_sample
from deboom.files.table_cells import read_rows
from deboom.physics.arrays import RealArray
from deboom.study.front_design import ChosenDesign
from deboom.study.tolerance_cost import tolerance_cost

DRAWS = 8192
"""Independent draws with which tolerances are verified."""
ROUNDS = 4
"""How often a share that was missed by new draws is asked for again, a little higher."""
ONE_SIDED_95 = 1.644854
"""Lower 95 % bound in standard errors [1]."""
ON_CURVE = 8
"""Targets on the curve of cost over target."""
ALONG_FRONT = 12
"""Designs of the front whose marginal values are listed."""


@dataclass(frozen=True, eq=False)
class WantedTarget:
    """What a user asks of the scatter.

    Parameters
    ----------
    sigma : float or None
        Standard deviation of the mean level, mean over the vehicles [dB]; None: today's.
    limit : sequence of str or None
        Largest mean level of a vehicle's lines: ``52.5`` or ``U06-1=52.5`` [dB(A)], or ``+0.5``
        above that of the design without scatter [dB]. With limits the target is a share of
        parts × vehicles within them, and `sigma` stays None.
    share : float
        That share [1].

    Raises
    ------
    InputError
        Both a sigma and a limit.
    """

    sigma: float | None = None
    limit: Sequence[str] | None = None
    share: float = 0.95

    def __post_init__(self) -> None:
        if self.sigma is not None and self.limit:
            raise InputError("give either --sigma or --limit, not both")

    def limits(self, vehicles: Sequence[str], levels: RealArray) -> RealArray:
        """Return the limit of each vehicle, shape (r,) [dB(A)], from its own level (r,).

        Raises
        ------
        InputError
            An unknown vehicle, one without a limit or with two, or no number.
        """
        found: dict[str, float] = {}
        for text in self.limit or ():
            name, has_name, number = text.rpartition("=")
            try:
                value = float(number)
            except ValueError:
                value = np.nan
            if not np.isfinite(value) or (has_name and name not in vehicles):
                raise InputError(
                    f"limit '{text}': write a level in dB(A), +dB above the design's own, or "
                    f"vehicle=level with one of {', '.join(vehicles)}"
                )
            for vehicle, level in zip(vehicles, levels, strict=True):
                if has_name and vehicle != name:
                    continue
                if vehicle in found:
                    raise InputError(f"limit '{text}': {vehicle} has one already, give it one")
                found[vehicle] = value + float(level) * number.startswith("+")
        missing = [vehicle for vehicle in vehicles if vehicle not in found]
        if missing:
            raise InputError(f"there is no limit of {', '.join(missing)}: give every vehicle one")
        return np.array([found[vehicle] for vehicle in vehicles])


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
        """What was asked for; a share with what `ROUNDS` of checking added to it."""
        if self.limits is None:
            wanted = self.wanted.sigma
            return self._sigma(self.today.sigma_sum if wanted is None else wanted / self.per_line)
        target = self._share(self.wanted.share)
        for _ in range(ROUNDS):
            found = self.allocator.cheapest(target).tolerance
            short = self.wanted.share - self._verified(found, "allocation check").share_lower
            if short <= 0.0 or target.share + short >= 1.0:
                break
            target = replace(target, share=target.share + short)
        return target

    @cached_property
    def cheapest(self) -> Allocation:
        """The cheapest tolerances for the target."""
        return self.allocator.cheapest(self.target)

    @cached_property
    def uniform(self) -> Allocation:
        """One tolerance everywhere for the target."""
        return self.allocator.uniform(self.target)

    @cached_property
    def uniform_of_effective(self) -> Allocation:
        """One tolerance for the target where it has an effect, the widest elsewhere."""
        names = self.allocator.names
        free = np.isin(names, self.chosen.without_effect)
        lower = np.where(free, self.allocator.upper, self.allocator.lower)
        return replace(self.allocator, lower=lower).uniform(self.target)

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
    def along_front(self) -> tuple[RealArray, RealArray]:
        """Rows of the front, and σ of the mean level per % of each tolerance, (n, k) [dB]."""
        count = len(self.chosen.designs)
        rows = np.unique(np.linspace(0, count - 1, min(count, ALONG_FRONT)).astype(int))
        found = []
        for row in rows:
            effect = replace(self.allocator.effect, design=self.chosen.designs[row])
            one = replace(self.allocator, effect=effect).marginal_values(self.allocator.today)
            found.append(one.sigma_per_percent * self.per_line)
        return rows, np.array(found)

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
        return ShareTarget(limits, share, scale=1.0 / self.index.n_lines)

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


def cost_curves(
    table: Path | None, points: Path | None, variables: Sequence[str]
) -> tuple[CostCurves, tuple[Path, ...]]:
    """Return the prices of tolerances, and the files they were read from.

    Parameters
    ----------
    table : Path or None
        As for `deboom.study.tolerance_cost.tolerance_cost`: a reciprocal law per variable.
    points : Path or None
        Table with the columns ``variable, tolerance, cost``, at least two rows for each of some
        variables, whose law these points replace.
    variables : sequence of str
        All that scatter.

    Raises
    ------
    InputError
        A table that cannot be read, an unknown variable, a price that rises with the width.
    """
    curves: dict[str, CostCurve] = {
        curve.name: curve
        for curve in reciprocal_curves(variables, tolerance_cost(table, variables)).curves
    }
    known: dict[str, list[tuple[float, float]]] = {}
    if points is not None:
        for row in read_rows(points, ("variable", "tolerance", "cost"), {}):
            name = row.filled("variable")
            if name not in curves:
                raise row.error(f"'{name}' is none of {list(variables)}")
            known.setdefault(name, []).append((row.number("tolerance"), row.number("cost")))
    for name, pairs in known.items():
        try:
            curves[name] = TabulatedCurve(name, *np.array(pairs).T)
        except InputError as error:
            raise InputError(f"{points}: {error}") from None
    files = tuple(path for path in (table, points) if path is not None)
    return CostCurves(tuple(curves.values())), files
