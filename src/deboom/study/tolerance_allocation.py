"""The cheapest tolerances of one design for a target."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom import plot as figures
from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.explore.tolerance_allocation import (
    Allocation,
    Allocator,
    CostCurve,
    CostCurves,
    MarginalValues,
    ShareTarget,
    SigmaTarget,
    TabulatedCurve,
    Target,
    ToleranceEffect,
    reciprocal_curves,
)
from deboom.files.platform import Platform
from deboom.files.tables import read_rows
from deboom.plot import CurvePanel, MarkedPanel
from deboom.plot.style import mount_colours, mount_of
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.cost_of_tolerance import tolerance_cost
from deboom.study.made_parts import MadeParts
from deboom.study.options import Sampler, tolerance_sample
from deboom.study.platform_model import Operation, motion_report
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext, Scalar, StudyResult
from deboom.study.search import Budget, robust_search
from deboom.study.supplier_study import Pick, supplier_study

SEARCH_DRAWS = 128
"""Draws per design of a quick search."""


@dataclass(frozen=True)
class WantedDesign:
    """Which design of a front.

    Parameters
    ----------
    pick : Pick
        By its name.
    point : int or None
        Or by its number on the front, from 1.
    """

    pick: Pick = Pick.best_mean
    point: int | None = None

    @property
    def name(self) -> str:
        """In words."""
        return self.pick.value.replace("-", " ") if self.point is None else f"point {self.point}"

    def row(self, designs: RealArray) -> RealArray:
        """Return the design of this number, shape (k,), of a front (n, k).

        Raises
        ------
        InputError
            There is none.
        """
        if self.point is None or not 1 <= self.point <= len(designs):
            raise InputError(
                f"there is no point {self.point} on the front: it has 1 to {len(designs)}"
            )
        return np.asarray(designs[self.point - 1])


@dataclass(frozen=True, eq=False)
class ChosenDesign:
    """A design of a front with its model.

    Parameters
    ----------
    platform : Platform
        As measured.
    model : RobustResponse
        Of the front.
    designs : array, shape (n, k)
        The front, sorted by mean level [1].
    design : array, shape (k,)
        The chosen one [1].
    name : str
        What it is called.
    without_effect : tuple of str
        Variables that no vehicle depends on.
    inputs : tuple of Path
        Files read, those of the platform among them.
    runs : Operation or None
        What was searched for; None if the front is that of a finished run.
    made : MadeParts or None
        How the parts scatter; None likewise.
    """

    platform: Platform
    model: RobustResponse
    designs: RealArray
    design: RealArray
    name: str
    without_effect: tuple[str, ...]
    inputs: tuple[Path, ...]
    runs: Operation | None = None
    made: MadeParts | None = None

    @property
    def variables(self) -> tuple[str, ...]:
        """Variables that scatter."""
        space = self.model.space
        return tuple(n for n, t in zip(space.names, space.tolerance, strict=True) if t > 0.0)

    def reported(self, result: StudyResult) -> StudyResult:
        """Add to a study's result how parts scatter and surfaces agree, if it has searched."""
        if self.made is not None:
            result = self.made.reported(result)
        return result if self.runs is None else self.runs.checked(result)


def design_of_run(
    folder: Path, studies: Path, wanted: WantedDesign, parts: Path | None = None
) -> ChosenDesign:
    """Return a design of the front of a finished run, with the run's model built again.

    Parameters
    ----------
    folder : Path
        Of the run.
    studies : Path
        Folder with the study scripts.
    wanted : WantedDesign
        Which one; a pick as a supplier would be asked for it.
    parts : Path or None
        Must be None: the run knows how its parts scatter.

    Raises
    ------
    InputError
        As `deboom.study.supplier_study.supplier_study`; a point that there is not; parts.
    """
    if parts is not None:
        raise InputError(f"{parts}: run {folder} has its own parts, leave --parts out")
    study = supplier_study(folder, studies, wanted.pick)
    run = study.run
    return ChosenDesign(
        platform=study.platform,
        model=run.model,
        designs=run.designs,
        design=study.wanted if wanted.point is None else wanted.row(run.designs),
        name=wanted.name,
        without_effect=study.without_effect,
        inputs=(*study.platform.input_files, *run.files),
    )


def design_of_search(
    runs: Operation,
    index: Any,
    made: MadeParts,
    budget: Budget,
    seed: int,
    wanted: WantedDesign,
    run: RunContext | None,
) -> ChosenDesign:
    """Search a front and return a design of it; variables without effect are at nominal.

    Parameters
    ----------
    runs : Operation
        Platform, vehicles and load cases.
    index : LoadCaseIndex
        Their model.
    made : MadeParts
        How the parts scatter.
    budget : Budget
        Of the search.
    seed : int
        From 1.
    wanted : WantedDesign
        Which one.
    run : RunContext or None
        Where the search is kept.

    Raises
    ------
    InputError
        As the search; a point that there is not.
    """
    sample = tolerance_sample(Sampler.sobol, made.n_draws, SEARCH_DRAWS, seed=seed)
    model = made.response(index, sample)
    files = (*runs.platform.input_files, *made.inputs)
    with progress_bar("NSGA-II") as bar:
        front = robust_search(model, model, budget, seed, bar, run, files).front
    rows = pick(front)
    named = {
        Pick.best_mean: rows.best_mean,
        Pick.best_sigma: rows.best_sigma,
        Pick.knee: rows.knee,
    }
    design = front.designs[named[wanted.pick]]
    if wanted.point is not None:
        design = wanted.row(front.designs)
    free = variables_without_effect(index, model.space)
    return ChosenDesign(
        platform=runs.platform,
        model=model,
        designs=front.designs,
        design=at_nominal(design[np.newaxis], model.space, free)[0],
        name=wanted.name,
        without_effect=free,
        inputs=runs.platform.input_files,
        runs=runs,
        made=made,
    )


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


def cost_curves(
    table: Path | None, points: Path | None, variables: Sequence[str]
) -> tuple[CostCurves, tuple[Path, ...]]:
    """Return the prices of tolerances, and the files they were read from.

    Parameters
    ----------
    table : Path or None
        As for `deboom.study.cost_of_tolerance.tolerance_cost`: a reciprocal law per variable.
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


PERCENT = 100.0
MILLI = 1000.0


def allocation_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per direction: its tolerance and price today, uniform and allocated."""
    today, uniform, cheapest = study.today, study.uniform, study.cheapest
    bounds = study.allocator
    lower = np.isclose(cheapest.tolerance, bounds.lower)
    upper = np.isclose(cheapest.tolerance, bounds.upper)
    return pd.DataFrame(
        {
            "variable": list(cheapest.names),
            "tolerance today ± [%]": PERCENT * today.tolerance,
            "uniform ± [%]": PERCENT * uniform.tolerance,
            "cheapest ± [%]": PERCENT * cheapest.tolerance,
            "cost today [1]": today.cost,
            "cost uniform [1]": uniform.cost,
            "cost cheapest [1]": cheapest.cost,
            "bound": np.select([lower, upper], ["tightest", "widest"], ""),
        }
    )


def marginal_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per direction: what a little tolerance is worth, today and once allocated."""
    table: dict[str, object] = {"variable": list(study.allocator.names)}
    for name, values in (
        ("today", study.marginal_today),
        ("cheapest", study.marginal_cheapest),
    ):
        scale = MILLI * study.per_line
        table[f"sigma per % of tolerance, {name} [0.001 dB]"] = scale * values.sigma_per_percent
        table[f"sigma per unit of cost, {name} [0.001 dB]"] = scale * values.sigma_per_cost
    return pd.DataFrame(table)


def front_marginal_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per design of the front and direction: what a little tolerance is worth today."""
    scale = MILLI * study.per_line
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "point": point,
                    "variable": list(values.names),
                    "sigma per % of tolerance [0.001 dB]": scale * values.sigma_per_percent,
                    "sigma per unit of cost [0.001 dB]": scale * values.sigma_per_cost,
                }
            )
            for point, values in study.along_front.items()
        ],
        ignore_index=True,
    )


def curve_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per target: what the cheapest and what uniform tolerances cost."""
    asked, cheapest, uniform = study.curve
    label = "sigma of the level [dB]" if study.limits is None else "share within limits [1]"
    return pd.DataFrame(
        {
            label: asked,
            "cost cheapest [1]": cheapest,
            "cost uniform [1]": uniform,
            "ratio [1]": cheapest / uniform,
        }
    )


def verification_table(study: AllocationStudy) -> pd.DataFrame:
    """One row per set of tolerances: cost, and what new draws give."""
    costs = {"today's": study.today, "cheapest": study.cheapest, "uniform": study.uniform}
    rows = []
    for name, one in study.verified.items():
        row: dict[str, object] = {
            "tolerances": name,
            "cost [1]": costs[name].total_cost,
            "sigma of the level, chosen with [dB]": costs[name].sigma_sum * study.per_line,
            "sigma of the level, verified [dB]": one.sigma,
        }
        if study.limits is not None:
            row["within limits [%]"] = PERCENT * one.share
            row["at least, with 95 % confidence [%]"] = PERCENT * one.share_lower
        rows.append(row)
    return pd.DataFrame(rows)


def allocation_summary(study: AllocationStudy) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    cheapest, uniform = study.cheapest, study.uniform
    found = study.verified["cheapest"]
    summary: dict[str, Scalar] = {
        "design": study.chosen.name,
        "target": "sigma" if study.limits is None else "share",
        "cost_cheapest": cheapest.total_cost,
        "cost_uniform": uniform.total_cost,
        "cost_today": study.today.total_cost,
        "cost_ratio_to_uniform": cheapest.total_cost / uniform.total_cost,
        "cost_ratio_to_uniform_of_effective": (
            cheapest.total_cost / study.uniform_of_effective.total_cost
        ),
        "sigma_today_db": study.today.sigma_sum * study.per_line,
        "sigma_cheapest_db": cheapest.sigma_sum * study.per_line,
        "sigma_verified_db": found.sigma,
        "sigma_uniform_verified_db": study.verified["uniform"].sigma,
        "optimality_percent": PERCENT * study.allocator.price_spread(cheapest, study.target),
    }
    if study.limits is not None:
        summary |= {
            "share_stated": study.wanted.share,
            "share_verified": found.share,
            "share_lower_bound": found.share_lower,
        }
    return summary


def allocation_figures(study: AllocationStudy) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    names = study.allocator.names
    colours = mount_colours([mount.name for mount in study.chosen.platform.mounts])
    of_rows = [colours[mount_of(name)] for name in names]
    scale = MILLI * study.per_line
    today, cheapest = study.marginal_today, study.marginal_cheapest
    asked, cost, uniform = study.curve
    by_sigma = study.limits is None
    return {
        "marginal_values": figures.marked_bars(
            names,
            of_rows,
            [
                MarkedPanel(
                    "σ per % of tolerance [0.001 dB]",
                    scale * today.sigma_per_percent,
                    scale * cheapest.sigma_per_percent,
                ),
                MarkedPanel(
                    "σ that one unit of cost takes away [0.001 dB]",
                    scale * np.nan_to_num(today.sigma_per_cost),
                    scale * np.nan_to_num(cheapest.sigma_per_cost),
                ),
            ],
            bar_label="at today's tolerances",
            mark_label="at the cheapest tolerances",
        ),
        "allocation": figures.marked_bars(
            names,
            of_rows,
            [
                MarkedPanel(
                    "tolerance ± [%]",
                    PERCENT * study.cheapest.tolerance,
                    PERCENT * study.uniform.tolerance,
                ),
                MarkedPanel("cost [1]", study.cheapest.cost, study.uniform.cost),
            ],
            bar_label="cheapest",
            mark_label="one tolerance everywhere",
        ),
        "cost_of_target": figures.curve_panels(
            [
                CurvePanel(
                    "same design, same target",
                    asked if by_sigma else PERCENT * asked,
                    {"cheapest tolerances": cost, "one tolerance everywhere": uniform},
                )
            ],
            x_label="σ of the mean level [dB]"
            if by_sigma
            else "parts × vehicles within limits [%]",
            y_label="cost of the tolerances [1]",
            columns=1,
        ),
    }


TERMS = ("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")


def allocation_page(
    study: AllocationStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    """Make the page from tables and figures."""
    summary = allocation_summary(study)
    ratio = float(summary["cost_ratio_to_uniform"])
    fair = float(summary["cost_ratio_to_uniform_of_effective"])
    vehicles = ", ".join(study.vehicles)
    return Page(
        title="Cheapest tolerances of a design",
        question=(
            f"How wide may each direction of the mounts scatter, so that {_asked(study)} in "
            f"{vehicles}, at the least cost? The design is {study.chosen.name} of its front."
        ),
        headlines=(
            Headline(f"{PERCENT * ratio:.0f} %", "of the cost of one tolerance everywhere"),
            Headline(
                f"{PERCENT * fair:.0f} %", "of it, where only directions that matter are held"
            ),
            _reached(study),
        ),
        terms=TERMS,
        warnings=(
            *_not_confirmed(study),
            "The price of a tolerance is an assumption unless you bring your own: by default "
            "every direction costs 1 at ±15 % and twice as much at half the width. Ratios of "
            "costs hold for prices without a fixed part.",
            *motion_report(study.index, study.chosen.design[None, :]).warnings,
        ),
        sections=(
            Section(
                "Allocation",
                "A direction at the widest tolerance needs no precision; one that is tighter than "
                "the rest is what the noise scatters by.",
                figures=(
                    _picture(
                        pictures,
                        "allocation",
                        "Tolerance and price of every direction: the cheapest ones, and one "
                        "tolerance everywhere for the same target.",
                    ),
                ),
                tables=(Table(tables["allocation"], "Half widths, three standard deviations."),),
            ),
            Section(
                "What a tolerance is worth",
                "σ is that of the mean level of the lines, mean over the vehicles. Where "
                "tolerances are the cheapest for a σ, a unit of cost takes the same σ away in "
                "every direction between its bounds.",
                figures=(
                    _picture(
                        pictures,
                        "marginal_values",
                        "Left: how much σ grows with each per cent of tolerance. Right: how much "
                        "σ a unit of cost takes away.",
                    ),
                ),
                tables=(
                    Table(
                        tables["marginal_values"],
                        "Exact derivatives at the draws of the search. A dash: a free tolerance. "
                        "Below 0: the axis makes up for another one of the same rubber.",
                        dict.fromkeys(tables["marginal_values"].columns[1:], 2),
                    ),
                ),
            ),
            Section(
                "What other targets cost",
                "The same design with more or less scatter.",
                figures=(
                    _picture(
                        pictures, "cost_of_target", "Least cost over the target, and uniform."
                    ),
                ),
                tables=(
                    Table(
                        tables["cost_of_target"],
                        "Cost by target.",
                        {tables["cost_of_target"].columns[0]: 3},
                    ),
                ),
            ),
            Section(
                "Verification",
                f"{DRAWS} draws of the parts that nothing was chosen by.",
                tables=(
                    Table(
                        tables["verification"],
                        "Cost and scatter of three sets of tolerances.",
                        {
                            "sigma of the level, chosen with [dB]": 3,
                            "sigma of the level, verified [dB]": 3,
                        },
                    ),
                ),
            ),
        ),
    )


def _asked(study: AllocationStudy) -> str:
    if study.limits is not None:
        return f"{PERCENT * study.wanted.share:g} % of parts × vehicles stay within their limits"
    target = float(study.wanted.sigma or study.today.sigma_sum * study.per_line)
    which = "" if study.wanted.sigma else ", today's"
    return f"the mean level scatters by no more than {target:.3f} dB (σ{which})"


def _not_confirmed(study: AllocationStudy) -> tuple[str, ...]:
    found, wanted = study.verified["cheapest"], study.wanted.share
    if study.limits is None or found.share >= wanted:
        return ()
    return (
        f"New draws find {PERCENT * found.share:.1f} % within the limits, not the "
        f"{PERCENT * wanted:g} % asked for: take more --samples.",
    )


def _reached(study: AllocationStudy) -> Headline:
    found = study.verified["cheapest"]
    if study.limits is None:
        return Headline(f"{found.sigma:.3f} dB", "σ of the mean level, verified")
    return Headline(f"{PERCENT * found.share:.1f} %", "within limits, verified")


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


def allocation_result(study: AllocationStudy, inputs: tuple[Path, ...] = ()) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    study : AllocationStudy
        What is asked.
    inputs : tuple of Path
        Files read beside those of the design.

    Returns
    -------
    StudyResult
        Tables ``allocation``, ``marginal_values``, ``front_marginal_values``, ``cost_of_target``,
        ``verification``.
    """
    with threadpool_limits(1):  # threads may change the last bit of an optimum
        tables = {
            "allocation": allocation_table(study),
            "marginal_values": marginal_table(study),
            "front_marginal_values": front_marginal_table(study),
            "cost_of_target": curve_table(study),
            "verification": verification_table(study),
        }
        figures = allocation_figures(study)
        return StudyResult(
            tables=tables,
            figures=figures,
            summary=allocation_summary(study),
            page=allocation_page(study, tables, figures),
            inputs=(*study.chosen.inputs, *inputs),
            facts={
                "kernel": study.index.kernel.name,
                "allocation_draws": study.n_samples,
                "verification_draws": DRAWS,
            },
        )
