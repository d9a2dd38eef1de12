"""How wide may each direction of the mounts scatter, at the least cost, for a stated target?

For one design of a front (of a finished run with --from-run, else of a quick search): the cheapest
tolerances that keep sigma of the mean level at --sigma (default: today's), or --share of all parts
x vehicles within --limit. A direction costs 1 at +-15 %, and its reciprocal, or see --cost-table.

Keys of summary.json: design, target; cost_cheapest, cost_uniform (one tolerance everywhere for the
same target), cost_today; cost_ratio_to_uniform, cost_ratio_to_uniform_of_effective (uniform where a
direction has an effect, else free); sigma_today_db, sigma_cheapest_db (mean level, mean over
vehicles), sigma_verified_db, sigma_uniform_verified_db (new draws); optimality_percent (spread of
the target's price over directions, 0: optimal); share_stated, share_verified, share_lower_bound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits
from typer import Option

from deboom import plot
from deboom.arrays import RealArray
from deboom.choices import Pick
from deboom.errors import InputError
from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.explore.tolerance_allocation import (
    Allocation,
    Allocator,
    CostCurve,
    CostCurves,
    ShareTarget,
    SigmaTarget,
    Target,
    ToleranceEffect,
    reciprocal_curves,
    tabulated_curve,
)
from deboom.files.platform import Platform
from deboom.files.tables import read_rows
from deboom.plot.style import mount_colours, mount_of
from deboom.report import Report
from deboom.study.made_parts import MadeParts, ScatterOptions, tolerance_cost
from deboom.study.options import Seed
from deboom.study.platform_model import MotionOptions, Operation, PlatformOptions, motion_report
from deboom.study.result import RunContext
from deboom.study.search import SearchOptions
from deboom.study.supplier_study import supplier_study

SEARCH_DRAWS = 128
"""Draws per design of a quick search."""
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
PERCENT, MILLI = 100.0, 1000.0


@dataclass(frozen=True)
class Options:
    """What is asked, of which design, and at which price."""

    seed: Seed = 1
    from_run: Annotated[Path | None, Option(help="Finished front study, not a search.")] = None
    pick: Annotated[Pick, Option(help="Design of the front.")] = Pick.best_mean
    point: Annotated[int | None, Option(help="Or its number there, from 1.")] = None
    sigma: Annotated[float | None, Option(help="Target of the mean level [dB].")] = None
    limit: Annotated[list[str] | None, Option(help="dB(A), +dB, vehicle=dB(A).")] = None
    share: Annotated[float, Option(help="Of parts x vehicles within limits [1].")] = 0.95
    tightest: Annotated[float, Option(help="Smallest tolerance, half width [1].")] = 0.05
    widest: Annotated[float, Option(help="Largest tolerance, half width [1].")] = 0.30
    cost_table: Annotated[Path | None, Option(help="variable, weight, reference tolerance")] = None
    cost_points: Annotated[Path | None, Option(help="variable, tolerance, cost")] = None
    search: SearchOptions = SearchOptions(generations=40, population=60)
    scatter: ScatterOptions = ScatterOptions(samples=256)
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()

    def __post_init__(self) -> None:
        if self.sigma is not None and self.limit:
            raise InputError("give either --sigma or --limit, not both")

    @property
    def design_name(self) -> str:
        """The asked design in words."""
        return self.pick.value.replace("-", " ") if self.point is None else f"point {self.point}"


@dataclass(frozen=True, eq=False)
class Model:
    """A platform's robust model; with --from-run also the run's front and the asked design."""

    platform: Platform
    robust: RobustResponse
    inputs: tuple[Path, ...]
    runs: Operation | None = None
    made: MadeParts | None = None
    front: RealArray | None = None
    picked: RealArray | None = None


def prepare(options: Options) -> Model:
    """Build the model: that of the finished run, or a new one to search with."""
    scatter = options.scatter
    if options.from_run is not None:
        if scatter.parts is not None:
            raise InputError(
                f"{scatter.parts}: run {options.from_run} has its own parts, leave --parts out"
            )
        study = supplier_study(options.from_run, None, options.pick)
        designs = study.run.designs
        design = study.wanted if options.point is None else _numbered(designs, options.point)
        inputs = (*study.platform.input_files, *study.run.files)
        return Model(study.platform, study.model, inputs, front=designs, picked=design)
    runs = options.platform.operation()
    index = options.motion.index(runs)
    made = scatter.made(index.variable_names)
    robust = made.response(index, sobol_sample(made.n_draws, SEARCH_DRAWS, seed=options.seed))
    return Model(runs.platform, robust, runs.platform.input_files, runs, made)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Choose the design, allocate its tolerances, verify and report."""
    designs, design = _chosen(model, options, context)
    with threadpool_limits(1):  # threads may change the last bit of an optimum
        return _allocated(model, options, designs, design)


def _chosen(
    model: Model, options: Options, context: RunContext | None
) -> tuple[RealArray, RealArray]:
    """Return the front, shape (n, k), and its asked design, (k,); variables without effect at 1."""
    if model.front is not None and model.picked is not None:
        return model.front, model.picked
    files = (*model.inputs, *(model.made.inputs if model.made else ()))
    front = options.search.front(model.robust, options.seed, context, files).front
    rows = pick(front)
    named = {
        Pick.best_mean: rows.best_mean,
        Pick.best_sigma: rows.best_sigma,
        Pick.knee: rows.knee,
    }
    design = front.designs[named[options.pick]]
    if options.point is not None:
        design = _numbered(front.designs, options.point)
    space = model.robust.space
    free = variables_without_effect(model.robust.evaluate, space)
    return front.designs, at_nominal(design[np.newaxis], space, free)[0]


def _numbered(designs: RealArray, point: int) -> RealArray:
    """Return the design of a number, from 1, of a front (n, k)."""
    if not 1 <= point <= len(designs):
        raise InputError(f"there is no point {point} on the front: it has 1 to {len(designs)}")
    return np.asarray(designs[point - 1])


def _allocated(model: Model, options: Options, designs: RealArray, design: RealArray) -> Report:
    """Allocate the tolerances of a design and report."""
    index: Any = model.robust.evaluate
    space = model.robust.space
    scatters = [n for n, t in zip(space.names, space.tolerance, strict=True) if t > 0.0]
    curves, price_files = cost_curves(options.cost_table, options.cost_points, scatters)
    effect = ToleranceEffect(_with_draws(model, options, "allocation sample"), design)
    lower, upper = np.asarray(options.tightest), np.asarray(options.widest)
    allocator = Allocator(effect, curves, lower, upper)
    levels = index(design[np.newaxis])[0] / index.n_lines
    limits = target_limits(options.limit, index.response_names, levels)
    task = _Task(model, options, allocator, None if limits is None else limits * index.n_lines)

    today = allocator.at(allocator.today)
    target, cheapest = task.reached(allocator.cheapest)
    uniform = task.reached(allocator.uniform)[1]
    free = np.isin(allocator.names, variables_without_effect(index, space))
    held = replace(allocator, lower=np.where(free, allocator.upper, allocator.lower))
    uniform_of_effective = task.reached(held.uniform)[1]
    sets = {"today's": today, "cheapest": cheapest, "uniform": uniform}
    verified = {
        name: task.verified(found.tolerance, "allocation verification")
        for name, found in sets.items()
    }
    by_sigma = limits is None
    scale = MILLI * task.per_line
    worth_today = allocator.marginal_values(allocator.today)
    worth = allocator.marginal_values(cheapest.tolerance)
    new = verified["cheapest"]

    vehicles = ", ".join(index.response_names)
    if by_sigma:
        goal = options.sigma or today.sigma_sum * task.per_line
        which = "" if options.sigma else ", today's"
        asked = f"the mean level scatters by no more than {goal:.3f} dB (σ{which})"
    else:
        asked = f"{PERCENT * options.share:g} % of parts × vehicles stay within their limits"
    report = Report(
        "Cheapest tolerances of a design",
        f"How wide may each direction of the mounts scatter, so that {asked} in {vehicles}, at the "
        f"least cost? The design is {options.design_name} of its front.",
    )
    report.explain("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")
    ratio = cheapest.total_cost / uniform.total_cost
    fair = cheapest.total_cost / uniform_of_effective.total_cost
    report.tile(f"{PERCENT * ratio:.0f} %", "of the cost of one tolerance everywhere")
    report.tile(f"{PERCENT * fair:.0f} %", "of it, where only directions that matter are held")
    if by_sigma:
        report.tile(f"{new.sigma:.3f} dB", "σ of the mean level, verified")
    else:
        report.tile(f"{PERCENT * new.share:.1f} %", "within limits, verified")
        if new.share < options.share:
            report.warn(
                f"New draws find {PERCENT * new.share:.1f} % within the limits, not the "
                f"{PERCENT * options.share:g} % asked for: take more --samples."
            )
    report.warn(
        "The price of a tolerance is an assumption unless you bring your own: by default "
        "every direction costs 1 at ±15 % and twice as much at half the width. Ratios of "
        "costs hold for prices without a fixed part.",
        *motion_report(index, design[np.newaxis]).warnings,
    )
    report.summary |= {
        "design": options.design_name,
        "target": "sigma" if by_sigma else "share",
        "cost_cheapest": cheapest.total_cost,
        "cost_uniform": uniform.total_cost,
        "cost_today": today.total_cost,
        "cost_ratio_to_uniform": ratio,
        "cost_ratio_to_uniform_of_effective": fair,
        "sigma_today_db": today.sigma_sum * task.per_line,
        "sigma_cheapest_db": cheapest.sigma_sum * task.per_line,
        "sigma_verified_db": new.sigma,
        "sigma_uniform_verified_db": verified["uniform"].sigma,
        "optimality_percent": PERCENT * allocator.price_spread(cheapest, target),
    }
    if not by_sigma:
        report.summary |= {
            "share_stated": options.share,
            "share_verified": new.share,
            "share_lower_bound": new.share_lower,
        }

    colours = mount_colours([mount.name for mount in model.platform.mounts])
    of_rows = [colours[mount_of(name)] for name in allocator.names]
    report.section(
        "Allocation",
        "A direction at the widest tolerance needs no precision; one that is tighter than "
        "the rest is what the noise scatters by.",
    )
    report.figure(
        "allocation",
        plot.marked_bars(
            allocator.names,
            of_rows,
            [
                plot.MarkedPanel(
                    "tolerance ± [%]", PERCENT * cheapest.tolerance, PERCENT * uniform.tolerance
                ),
                plot.MarkedPanel("cost [1]", cheapest.cost, uniform.cost),
            ],
            bar_label="cheapest",
            mark_label="one tolerance everywhere",
        ),
        "Tolerance and price of every direction: the cheapest ones, and one "
        "tolerance everywhere for the same target.",
    )
    at_lower = np.isclose(cheapest.tolerance, allocator.lower)
    at_upper = np.isclose(cheapest.tolerance, allocator.upper)
    allocation = pd.DataFrame(
        {
            "variable": list(cheapest.names),
            "tolerance today ± [%]": PERCENT * today.tolerance,
            "uniform ± [%]": PERCENT * uniform.tolerance,
            "cheapest ± [%]": PERCENT * cheapest.tolerance,
            "cost today [1]": today.cost,
            "cost uniform [1]": uniform.cost,
            "cost cheapest [1]": cheapest.cost,
            "bound": np.select([at_lower, at_upper], ["tightest", "widest"], ""),
        }
    )
    report.table("allocation", allocation, "Half widths, three standard deviations.")

    report.section(
        "What a tolerance is worth",
        "σ is that of the mean level of the lines, mean over the vehicles. Where "
        "tolerances are the cheapest for a σ, a unit of cost takes the same σ away in "
        "every direction between its bounds.",
    )
    report.figure(
        "marginal_values",
        plot.marked_bars(
            allocator.names,
            of_rows,
            [
                plot.MarkedPanel(
                    "σ per % of tolerance [0.001 dB]",
                    scale * worth_today.sigma_per_percent,
                    scale * worth.sigma_per_percent,
                ),
                plot.MarkedPanel(
                    "σ that one unit of cost takes away [0.001 dB]",
                    scale * np.nan_to_num(worth_today.sigma_per_cost),
                    scale * np.nan_to_num(worth.sigma_per_cost),
                ),
            ],
            bar_label="at today's tolerances",
            mark_label="at the cheapest tolerances",
        ),
        "Left: how much σ grows with each per cent of tolerance. Right: how much "
        "σ a unit of cost takes away.",
    )
    values: dict[str, object] = {"variable": list(allocator.names)}
    for name, worths in (("today", worth_today), ("cheapest", worth)):
        values[f"sigma per % of tolerance, {name} [0.001 dB]"] = scale * worths.sigma_per_percent
        values[f"sigma per unit of cost, {name} [0.001 dB]"] = scale * worths.sigma_per_cost
    report.table(
        "marginal_values",
        pd.DataFrame(values),
        "Exact derivatives at the draws of the search. A dash: a free tolerance. "
        "Below 0: the axis makes up for another one of the same rubber.",
        dict.fromkeys(list(values)[1:], 2),
    )
    report.table("front_marginal_values", _along_front(allocator, designs, scale))

    report.section("What other targets cost", "The same design with more or less scatter.")
    curve = task.cost_of_targets()
    label = "σ of the mean level [dB]" if by_sigma else "parts × vehicles within limits [%]"
    column = curve.columns[0]
    report.figure(
        "cost_of_target",
        plot.curve_panels(
            [
                plot.CurvePanel(
                    "same design, same target",
                    (1.0 if by_sigma else PERCENT) * curve[column],
                    {
                        "cheapest tolerances": curve["cost cheapest [1]"],
                        "one tolerance everywhere": curve["cost uniform [1]"],
                    },
                )
            ],
            x_label=label,
            y_label="cost of the tolerances [1]",
            columns=1,
        ),
        "Least cost over the target, and uniform.",
    )
    report.table("cost_of_target", curve, "Cost by target.", {column: 3})

    report.section("Verification", f"{DRAWS} draws of the parts that nothing was chosen by.")
    chosen, check = "sigma of the level, chosen with [dB]", "sigma of the level, verified [dB]"
    verification = pd.DataFrame(
        {
            "tolerances": list(sets),
            "cost [1]": [found.total_cost for found in sets.values()],
            chosen: [found.sigma_sum * task.per_line for found in sets.values()],
            check: [row.sigma for row in verified.values()],
        }
    )
    if not by_sigma:
        verification["within limits [%]"] = [PERCENT * row.share for row in verified.values()]
        verification["at least, with 95 % confidence [%]"] = [
            PERCENT * row.share_lower for row in verified.values()
        ]
    report.table(
        "verification",
        verification,
        "Cost and scatter of three sets of tolerances.",
        {chosen: 3, check: 3},
    )
    report.facts |= {
        "kernel": index.kernel,
        "allocation_draws": options.scatter.samples,
        "verification_draws": DRAWS,
    }
    report.inputs += [*model.inputs, *price_files]
    if model.made is not None:
        model.made.append_to(report)
    if model.runs is not None:
        model.runs.append_to(report)
    return report


@dataclass(frozen=True, eq=False)
class _Verified:
    """σ of the mean level [dB], share within the limits and its lower 95 % bound, nan without."""

    sigma: float
    share: float
    share_lower: float


@dataclass(frozen=True, eq=False)
class _Task:
    """One design whose tolerances shall reach a σ, or a share within limits (v,) of SPLV."""

    model: Model
    options: Options
    allocator: Allocator
    limits: RealArray | None

    @property
    def per_line(self) -> float:
        """Factor from a sum over vehicles and lines to the mean over both [1]."""
        index: Any = self.model.robust.evaluate
        return float(1.0 / (index.n_lines * len(index.response_names)))

    def reached(self, find: Callable[[Target], Allocation]) -> tuple[Target, Allocation]:
        """Return a target and what is found for it.

        A share is asked for a little higher, or lower, until new draws show the wanted share with
        95 % confidence and hardly more: what is chosen by few draws suits these draws best.
        """
        if self.limits is None:
            wanted = self.options.sigma
            today = self.allocator.at(self.allocator.today).sigma_sum
            target = self._sigma(today if wanted is None else wanted / self.per_line)
            return target, find(target)
        tried: list[tuple[float, ShareTarget, Allocation]] = []
        share = self._share(self.options.share)
        for _ in range(ROUNDS):
            try:
                found = find(share)
            except InputError:
                if not tried:
                    raise
                break
            lower = self.verified(found.tolerance, "allocation check").share_lower
            over = lower - self.options.share
            tried.append((over, share, found))
            if 0.0 <= over <= CLOSE or not 0.0 < share.share - over < 1.0:
                break
            share = replace(share, share=share.share - over + 0.5 * CLOSE)
        confirmed = [row for row in tried if row[0] >= 0.0]
        if confirmed:
            return min(confirmed, key=lambda row: row[2].total_cost)[1:]
        return max(tried, key=lambda row: row[0])[1:]

    def verified(self, tolerance: RealArray, purpose: str) -> _Verified:
        """Evaluate tolerances, shape (k,), with draws that nothing was chosen by."""
        robust = _with_draws(self.model, self.options, purpose, DRAWS)
        effect = self.allocator.effect.with_draws(robust)
        whole = effect.today.copy()
        whole[[effect.names.index(name) for name in self.allocator.names]] = tolerance
        values = effect.values(whole)
        sigma = float(values.std(axis=0, ddof=1).sum() * self.per_line)
        if self.limits is None:
            return _Verified(sigma, np.nan, np.nan)
        good = (values <= self.limits).mean(axis=1)
        error = float(good.std(ddof=1) / np.sqrt(DRAWS))
        share = float(good.mean())
        return _Verified(sigma, share, share - ONE_SIDED_95 * error)

    def cost_of_targets(self) -> pd.DataFrame:
        """Tabulate the cost of targets between those of the tightest and the widest tolerances."""
        bounds = (self.allocator.lower, self.allocator.upper)
        tightest, widest = (self.allocator.at(np.asarray(bound)) for bound in bounds)
        targets: Sequence[SigmaTarget | ShareTarget]
        if self.limits is None:
            label = "sigma of the level [dB]"
            steps = np.linspace(1.02 * tightest.sigma_sum, 0.98 * widest.sigma_sum, ON_CURVE)
            targets = [self._sigma(float(step)) for step in steps]
            asked = steps * self.per_line
        else:
            label = "share within limits [1]"
            low, high = (
                float(found.scattered.soft_share(self.limits)[0].mean())
                for found in (widest, tightest)
            )
            margin = 0.02 * np.ptp([low, high])
            asked = np.linspace(low + margin, high - margin, ON_CURVE)
            targets = [self._share(float(step)) for step in asked]
        cheapest = np.array([self.allocator.cheapest(target).total_cost for target in targets])
        uniform = np.array([self.allocator.uniform(target).total_cost for target in targets])
        return pd.DataFrame(
            {
                label: asked,
                "cost cheapest [1]": cheapest,
                "cost uniform [1]": uniform,
                "ratio [1]": cheapest / uniform,
            }
        )

    def _sigma(self, total: float) -> SigmaTarget:
        return SigmaTarget(total, self.per_line, "σ of the mean level [dB]")

    def _share(self, share: float) -> ShareTarget:
        index: Any = self.model.robust.evaluate
        return ShareTarget(np.asarray(self.limits), share, scale=1.0 / index.n_lines, unit="dB")


def _with_draws(
    model: Model, options: Options, purpose: str, n_samples: int | None = None
) -> RobustResponse:
    """Return the model with other draws, for choosing tolerances or for checking them."""
    count = n_samples or options.scatter.samples
    sample = sobol_sample(model.robust.n_draws, count, seed=options.seed, purpose=purpose)
    return replace(model.robust, sample=sample)


def _along_front(allocator: Allocator, designs: RealArray, scale: float) -> pd.DataFrame:
    """Tabulate what a little tolerance is worth today, by design of the front and direction."""
    count = len(designs)
    tables = []
    for row in np.unique(np.linspace(0, count - 1, min(count, ALONG_FRONT)).astype(int)).tolist():
        effect = replace(allocator.effect, design=designs[row])
        values = replace(allocator, effect=effect).marginal_values(allocator.today)
        columns = {
            "point": row + 1,
            "variable": list(values.names),
            "sigma per % of tolerance [0.001 dB]": scale * values.sigma_per_percent,
            "sigma per unit of cost [0.001 dB]": scale * values.sigma_per_cost,
        }
        tables.append(pd.DataFrame(columns))
    return pd.concat(tables, ignore_index=True)


def target_limits(
    wanted: Sequence[str] | None, vehicles: Sequence[str], levels: RealArray
) -> RealArray | None:
    """Return the limit of each vehicle, shape (v,) [dB(A)], from its own level; None if none.

    ``52.5`` is a limit for all, ``U06-1=52.5`` for one [dB(A)], ``+0.5`` above the own level [dB].

    - raises InputError: an unknown vehicle, one without a limit or with two, or no number.
    """
    if not wanted:
        return None
    limits: dict[str, float] = {}
    for text in wanted:
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
            if vehicle in limits:
                raise InputError(f"limit '{text}': {vehicle} has one already, give it one")
            limits[vehicle] = value + float(level) * number.startswith("+")
    missing = [vehicle for vehicle in vehicles if vehicle not in limits]
    if missing:
        raise InputError(f"there is no limit of {', '.join(missing)}: give every vehicle one")
    return np.array([limits[vehicle] for vehicle in vehicles])


def cost_curves(
    table: Path | None, points: Path | None, variables: Sequence[str]
) -> tuple[CostCurves, tuple[Path, ...]]:
    """Return the prices of tolerances, and the files they were read from.

    - `table` or None: as for `deboom.study.made_parts.tolerance_cost`: a reciprocal law per
      variable.
    - `points` or None: table with the columns ``variable, tolerance, cost``, at least two rows for
      each of some variables, whose law these points replace.
    - `variables`: all that scatter.
    - raises InputError: a table that cannot be read, an unknown variable, a price that rises with
      the width.
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
            curves[name] = tabulated_curve(name, *np.array(pairs).T)
        except InputError as error:
            raise InputError(f"{points}: {error}") from None
    files = tuple(path for path in (table, points) if path is not None)
    return CostCurves(tuple(curves.values())), files
