"""How much may each direction of the mounts scatter, at the lowest cost, for a stated target?

The study takes one design of a front, of a finished run (--from-run) or of a quick search. It finds
the cheapest tolerances with which sigma of the mean level is exactly --sigma (default: today's
sigma), or with which exactly --share of all pairs of part and vehicle keep --limit. The cost of a
direction is 1 at ±15 % and inversely proportional to the tolerance; --cost-table states other
costs. --free-tolerances also searches with the tolerances of the mounts as variables, from this
design and today's on: what would another design be worth if its tolerances were tighter?

Keys of summary.json: design, target; cost_cheapest, cost_uniform (one tolerance everywhere for the
same target), cost_today; cost_ratio_to_uniform, cost_ratio_to_uniform_of_effective (uniform where a
direction has an effect, else free); sigma_today_db, sigma_cheapest_db (mean level, mean over
vehicles), sigma_verified_db, sigma_uniform_verified_db (new draws); share_stated,
share_verified, share_lower_bound; surface_difference_at_peaks_db (library against spectra).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from typer import Option

from deboom import plot
from deboom.arrays import RealArray
from deboom.choices import Pick
from deboom.common import PERCENT
from deboom.errors import InputError
from deboom.explore.doe import latin_hypercube
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.explore.tolerance_allocation import (
    Allocation,
    Allocator,
    FreeTolerances,
    ToleranceEffect,
)
from deboom.pages.front_answer import abbreviations
from deboom.pages.motion import motion_report, report_runs
from deboom.plot.style import mount_of, signed
from deboom.progress import progress_bar
from deboom.report import Report, Step, Table
from deboom.runs.made_parts import (
    MadeParts,
    ScatterOptions,
    ToleranceTask,
    Verified,
    report_parts,
    target_limits,
    tolerance_cost,
    with_draws,
)
from deboom.runs.options import Checks, CostTable, FrontRun, Seed
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.runs.rebuilt import supplier_study
from deboom.runs.result import RunContext, run_name
from deboom.runs.search import SearchOptions
from deboom.vehicles.platform import Platform, Runs

SEARCH_DRAWS = 128
"""Draws per design of a quick search."""
TIGHTEST = 3
"""Directions that the verdict names."""
TOLERANCE_BOUNDS = 0.05, 0.25
"""Of a tolerance as a variable [1]; judgement around the thesis's ±15 %."""


@dataclass(frozen=True)
class Options:
    """What is asked, of which design, and at which price."""

    seed: Seed = 1
    from_run: FrontRun = None
    pick: Annotated[Pick, Option(help="Design of the front.")] = Pick.best_mean
    point: Annotated[
        int | None, Option(help="Number of the design in the front, from 1, in place of --pick.")
    ] = None
    sigma: Annotated[
        float | None,
        Option(help="Target for sigma of the mean level [dB]; default: today's sigma."),
    ] = None
    limit: Annotated[
        list[str] | None,
        Option(help="Limit, as dB(A), as +dB over today, or as vehicle=dB(A); repeatable."),
    ] = None
    share: Annotated[float, Option(help="Share of parts within the limits [1].")] = 0.95
    tightest: Annotated[float, Option(help="Smallest allowed tolerance, half width [1].")] = 0.05
    widest: Annotated[float, Option(help="Largest allowed tolerance, half width [1].")] = 0.30
    cost_table: CostTable = None
    free_tolerances: Annotated[
        bool,
        Option(
            help="Search also with the tolerance of each mount, ±5 to ±25 %, as a variable; it "
            "does not go with limits of levels."
        ),
    ] = False
    search: SearchOptions = SearchOptions(generations=40, population=60)
    scatter: ScatterOptions = ScatterOptions(samples=256)
    checks: Checks = 8192
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()

    def __post_init__(self) -> None:
        if self.sigma is not None and self.limit:
            raise InputError("give either --sigma or --limit, not both")

    @property
    def design_name(self) -> str:
        """The asked design in words."""
        return self.pick.value if self.point is None else f"point {self.point}"


@dataclass(frozen=True, eq=False)
class Model:
    """A platform's robust model; with --from-run also the asked design."""

    platform: Platform
    robust: Robust
    inputs: tuple[Path, ...]
    assumed: tuple[str, ...] = ()
    runs: Runs | None = None
    made: MadeParts | None = None
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
        return Model(study.platform, study.model, inputs, study.run.assumed, picked=design)
    runs = options.platform.runs()
    index = options.motion.model(runs)
    made = scatter.made(index.variable_names)
    robust = made.response(index, sobol_sample(made.n_draws, SEARCH_DRAWS, seed=options.seed))
    return Model(runs.platform, robust, runs.platform.input_files, runs=runs, made=made)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Choose the design, allocate its tolerances, verify and report."""
    design = _chosen(model, options, context)
    sets = _allocated(model, options, design)
    report = Report(
        "Cheapest tolerances of a design",
        f"How wide may each direction of the mounts scatter, so that {_goal(sets, options)} in "
        f"{', '.join(sets.index.response_names)}, at the least cost? The design is "
        f"{options.design_name} of its front.",
    )
    report.explain("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")
    _answer(report, sets, options, abbreviations(model.platform.mounts))
    _panels(report, sets, run_name(context, "tolerance_allocation"))
    report.warn(
        "The price of a tolerance is an assumption unless you state your own prices. By default "
        "every direction costs 1 at ±15 % and twice as much at half the width. Ratios of costs "
        "are valid for prices without a fixed part.",
        *motion_report(sets.index, design[np.newaxis]).warnings,
    )
    report.assume(*model.assumed)
    report.summary |= _summary(sets, options)
    _allocation_section(report, sets)
    _verification_section(report, sets, options.checks)
    if options.free_tolerances:
        _free_tolerances(report, model.robust, design, options)
    report.facts |= {
        "kernel": sets.index.kernel,
        "allocation_draws": options.scatter.samples,
        "verification_draws": options.checks,
    }
    report.inputs += [*model.inputs, *((options.cost_table,) if options.cost_table else ())]
    if model.made is not None:
        report_parts(report, model.made)
    if model.runs is not None:
        report_runs(report, model.runs)
    return report


@dataclass(frozen=True, eq=False)
class _Sets:
    """Sets of tolerances of one design for one target, and what new draws say of each."""

    index: Any
    allocator: Allocator
    per_line: float
    by_sigma: bool
    today: Allocation
    cheapest: Allocation
    uniform: Allocation
    uniform_of_effective: Allocation
    verified: dict[str, Verified]

    @property
    def named(self) -> dict[str, Allocation]:
        """The sets that are verified, by the name that tables give them."""
        return {"today's": self.today, "cheapest": self.cheapest, "uniform": self.uniform}

    @property
    def ratio(self) -> float:
        """Cost of the cheapest tolerances over that of one tolerance everywhere [1]."""
        return self.cheapest.total_cost / self.uniform.total_cost

    @property
    def ratio_of_effective(self) -> float:
        """The same against one tolerance where a direction has an effect [1]."""
        return self.cheapest.total_cost / self.uniform_of_effective.total_cost

    @property
    def n_widest(self) -> int:
        """Directions that may be as wide as allowed."""
        return int(np.isclose(self.cheapest.tolerance, self.allocator.upper).sum())

    @property
    def bound(self) -> list[str]:
        """Which end of the allowed range each of the cheapest tolerances lies at."""
        tolerance, lower, upper = (
            self.cheapest.tolerance,
            self.allocator.lower,
            self.allocator.upper,
        )
        ends = [np.isclose(tolerance, lower), np.isclose(tolerance, upper)]
        return list(np.select(ends, ["tightest", "widest"], ""))


def _allocated(model: Model, options: Options, design: RealArray) -> _Sets:
    """Allocate tolerances to the design, (k,), and evaluate them with new draws."""
    index: Any = model.robust.evaluate
    space = model.robust.space
    scatters = [n for n, t in zip(space.names, space.tolerance, strict=True) if t > 0.0]
    draws = with_draws(model.robust, "allocation sample", options.scatter.samples, options.seed)
    allocator = Allocator(
        ToleranceEffect(draws, design),
        tolerance_cost(options.cost_table, scatters),
        lower=np.asarray(options.tightest),
        upper=np.asarray(options.widest),
    )
    levels = index(design[np.newaxis])[0] / index.n_lines
    limits = target_limits(options.limit, index.response_names, levels)
    task = ToleranceTask(
        robust=model.robust,
        allocator=allocator,
        limits=None if limits is None else limits * index.n_lines,
        sigma=options.sigma,
        share=options.share,
        draws=options.checks,
        seed=options.seed,
    )
    free = np.isin(allocator.names, variables_without_effect(index, space))
    held = replace(allocator, lower=np.where(free, allocator.upper, allocator.lower))
    sets = _Sets(
        index=index,
        allocator=allocator,
        per_line=task.per_line,
        by_sigma=limits is None,
        today=allocator.at(allocator.today),
        cheapest=task.reached(allocator.cheapest),
        uniform=task.reached(allocator.uniform),
        uniform_of_effective=task.reached(held.uniform),
        verified={},
    )
    purpose = "allocation verification"
    verified = {name: task.verified(each.tolerance, purpose) for name, each in sets.named.items()}
    return replace(sets, verified=verified)


def _goal(sets: _Sets, options: Options) -> str:
    """Return the target in words."""
    if not sets.by_sigma:
        return f"{PERCENT * options.share:g} % of parts × vehicles stay within their limits"
    sigma = options.sigma or sets.today.sigma_sum * sets.per_line
    which = "" if options.sigma else ", today's"
    return f"the mean level scatters by no more than {sigma:.3f} dB (σ{which})"


def _answer(report: Report, sets: _Sets, options: Options, names: str) -> None:
    """Say what to hold, what it costs, and what new draws confirm."""
    cheapest, allocator, new = sets.cheapest, sets.allocator, sets.verified["cheapest"]
    order = np.argsort(cheapest.tolerance, kind="stable")
    held = [f"{allocator.names[k]} ±{PERCENT * cheapest.tolerance[k]:.0f} %" for k in order]
    may_be_wide = f"{sets.n_widest} of {len(allocator.names)} directions may be as wide as allowed"
    ratio = f"{PERCENT * sets.ratio:.0f} %"
    ratio_of_effective = f"{PERCENT * sets.ratio_of_effective:.0f} %"
    report.tile(held[0], f"the tightest; {may_be_wide}")
    report.tile(ratio, "of the cost of one tolerance everywhere")
    report.tile(ratio_of_effective, "of the cost of one tolerance in the directions that matter")
    if sets.by_sigma:
        report.tile(f"{new.sigma:.3f} dB", "σ of the mean level, verified")
        reached = f"the same scatter (σ {new.sigma:.2f} dB, verified)"
    else:
        report.tile(f"{PERCENT * new.share:.1f} %", "within limits, verified")
        reached = f"{PERCENT * new.share:.1f} % within limits (verified)"
        if new.share < options.share:
            report.warn(
                f"New draws find {PERCENT * new.share:.1f} % within the limits, not the "
                f"{PERCENT * options.share:g} % asked for: take more --samples."
            )
    below_widest = np.count_nonzero(
        cheapest.tolerance[order[:TIGHTEST]] < allocator.upper[order[:TIGHTEST]]
    )
    tight = ", ".join(held[:below_widest])
    prices = (
        "those of --cost-table."
        if options.cost_table
        else "assumed: 1 per direction at ±15 %, 2 at half the width (--cost-table)."
    )
    report.answer(
        (f"Hold {tight}; " if tight else "Hold nothing tightly: ")
        + f"{may_be_wide}: {reached} at {ratio} of the cost of one tolerance everywhere.",
        "Against one tolerance in the directions that matter alone the cost is "
        f"{ratio_of_effective}. Prices are {prices}",
        names,
    )


def _panels(report: Report, sets: _Sets, name_of_run: str) -> None:
    """Show each direction, what each set is worth, and what to do next."""
    today, cheapest = sets.today, sets.cheapest
    each = pd.DataFrame(
        {
            "direction": list(cheapest.names),
            "hold ± [%]": PERCENT * cheapest.tolerance,
            "today ± [%]": PERCENT * today.tolerance,
            "cost [1]": cheapest.cost,
            "cost today [1]": today.cost,
            "bound": sets.bound,
        }
    )
    report.panel(
        "Each direction",
        Table(each, "", {"hold ± [%]": 0, "today ± [%]": 0, "cost [1]": 2, "cost today [1]": 2}),
        "Half widths, three standard deviations. Widest: needs no precision.",
        wide=True,
    )
    today_is_uniform = bool(np.allclose(sets.uniform.tolerance, today.tolerance))
    shown = {k: v for k, v in sets.named.items() if not (today_is_uniform and k == "uniform")}
    worth = pd.DataFrame(
        {
            "tolerances": list(shown),
            "cost [1]": [allocation.total_cost for allocation in shown.values()],
            "σ, verified [dB]": [sets.verified[name].sigma for name in shown],
        }
    )
    if not sets.by_sigma:
        worth["within limits [%]"] = [PERCENT * sets.verified[name].share for name in shown]
    report.panel(
        "What it is worth",
        Table(worth, "", {"cost [1]": 1, "σ, verified [dB]": 3}),
        "One tolerance for the same target is today's here." if today_is_uniform else "",
    )
    report.panel(
        "What to do next",
        Step(f"deboom report FRONT --supplier --tolerances {name_of_run}", "sheets with these"),
        Step("deboom run tolerance_allocation --cost-table FILE", "with your own prices"),
        Step("deboom run tolerance_allocation --limit LEVEL", "for a limit in place of a scatter"),
    )


def _summary(sets: _Sets, options: Options) -> dict[str, Any]:
    """Return the numbers of summary.json."""
    new = sets.verified["cheapest"]
    summary = {
        "design": options.design_name,
        "target": "sigma" if sets.by_sigma else "share",
        "cost_cheapest": sets.cheapest.total_cost,
        "cost_uniform": sets.uniform.total_cost,
        "cost_today": sets.today.total_cost,
        "cost_ratio_to_uniform": sets.ratio,
        "cost_ratio_to_uniform_of_effective": sets.ratio_of_effective,
        "sigma_today_db": sets.today.sigma_sum * sets.per_line,
        "sigma_cheapest_db": sets.cheapest.sigma_sum * sets.per_line,
        "sigma_verified_db": new.sigma,
        "sigma_uniform_verified_db": sets.verified["uniform"].sigma,
    }
    if not sets.by_sigma:
        summary |= {
            "share_stated": options.share,
            "share_verified": new.share,
            "share_lower_bound": new.share_lower,
        }
    return summary


def _allocation_section(report: Report, sets: _Sets) -> None:
    """Draw and list tolerance and price of every direction."""
    today, cheapest, uniform = sets.today, sets.cheapest, sets.uniform

    def panel(label: str, values: RealArray, everywhere: RealArray) -> plot.IntervalPanel:
        rows = {
            "cheapest": (values, np.zeros(len(values)), values),
            "one tolerance everywhere": (everywhere, everywhere, everywhere),
        }
        return plot.IntervalPanel(label, rows)

    report.section(
        "Allocation",
        "A direction at the widest tolerance needs no precision; the directions with the tightest "
        "tolerances make the noise scatter.",
    )
    panels = [
        panel("tolerance ± [%]", PERCENT * cheapest.tolerance, PERCENT * uniform.tolerance),
        panel("cost [1]", cheapest.cost, uniform.cost),
    ]
    report.figure(
        "allocation",
        lambda: plot.interval_panels(sets.allocator.names, panels),
        "Tolerance and price of every direction: the cheapest ones, and one "
        "tolerance everywhere for the same target.",
    )
    allocation = pd.DataFrame(
        {
            "variable": list(cheapest.names),
            "tolerance today ± [%]": PERCENT * today.tolerance,
            "uniform ± [%]": PERCENT * uniform.tolerance,
            "cheapest ± [%]": PERCENT * cheapest.tolerance,
            "cost today [1]": today.cost,
            "cost uniform [1]": uniform.cost,
            "cost cheapest [1]": cheapest.cost,
            "bound": sets.bound,
        }
    )
    report.table("allocation", allocation)


def _verification_section(report: Report, sets: _Sets, n_draws: int) -> None:
    """List cost and scatter of each set, as chosen and as new draws show it."""
    report.section("Verification", f"{n_draws} new draws of the parts.")
    chosen, check = "sigma of the level, chosen with [dB]", "sigma of the level, verified [dB]"
    allocations, verified = sets.named.values(), sets.verified.values()
    verification = pd.DataFrame(
        {
            "tolerances": list(sets.named),
            "cost [1]": [allocation.total_cost for allocation in allocations],
            chosen: [allocation.sigma_sum * sets.per_line for allocation in allocations],
            check: [row.sigma for row in verified],
        }
    )
    if not sets.by_sigma:
        verification["within limits [%]"] = [PERCENT * row.share for row in verified]
        verification["at least, with 95 % confidence [%]"] = [
            PERCENT * row.share_lower for row in verified
        ]
    report.table(
        "verification",
        verification,
        "Cost and scatter of three sets of tolerances.",
        {chosen: 3, check: 3},
    )


def _chosen(model: Model, options: Options, context: RunContext | None) -> RealArray:
    """Return the asked design, (k,); variables without effect at 1, except in --point of a run."""
    if model.picked is not None:
        return model.picked
    files = (*model.inputs, *(model.made.inputs if model.made else ()))
    front = options.search.searched(
        model.robust, seed=options.seed, run=context, inputs=files
    ).front
    nominal = model.robust.space.nominal
    row = pick(front, model.robust(nominal[np.newaxis])).get(options.pick)
    design = nominal if row is None else front.designs[row]
    if options.point is not None:
        design = _numbered(front.designs, options.point)
    space = model.robust.space
    free = variables_without_effect(model.robust.evaluate, space)
    return np.asarray(at_nominal(design[np.newaxis], space, free)[0])


def _numbered(designs: RealArray, point: int) -> RealArray:
    """Return the design of a number, from 1, of a front (n, k)."""
    if not 1 <= point <= len(designs):
        raise InputError(f"there is no point {point} on the front: it has 1 to {len(designs)}")
    return np.asarray(designs[point - 1])


def _tolerance_front(free: FreeTolerances, design: RealArray, options: Options) -> pd.DataFrame:
    """Search from today's and a design (k,) on; tabulate price, levels and tolerances by price."""
    robust, mounts = free.robust, tuple(free.groups)
    begin = np.array(
        [
            np.append(start, np.full(len(mounts), tolerance))
            for start in (robust.space.nominal, design)
            for tolerance in (TOLERANCE_BOUNDS[0], robust.space.tolerance.max())
        ]
    )
    population = max(options.search.population, len(begin))
    rest = latin_hypercube(free.space, population, seed=options.seed)[len(begin) :]
    with progress_bar("tolerances as variables") as bar:
        searched = nsga2(
            free,
            Search(population, options.search.generations, seed=options.seed),
            first_population=np.concatenate([begin, rest]),
            progress=bar,
        ).front
    today = free(free.space.nominal[np.newaxis])
    index: Any = robust.evaluate
    per_line = 1.0 / (len(index.response_names) * index.n_lines)
    tolerances = searched.designs[:, robust.space.n_variables :]
    columns = {
        "price over today's [1]": searched.objectives[:, -1],
        "mean level against today [dB]": (searched.mean_sum - today.mean_sum[0]) * per_line,
        "sigma against today [%]": PERCENT * (searched.sigma_sum / today.sigma_sum[0] - 1.0),
    }
    columns |= {
        f"tolerance {mount} ± [%]": PERCENT * values
        for mount, values in zip(mounts, tolerances.T, strict=True)
    }
    columns |= {
        f"{name} [1]": values
        for name, values in zip(free.space.names, searched.designs.T, strict=True)
        if name in robust.space.names
    }
    return pd.DataFrame(columns).sort_values("price over today's [1]", ignore_index=True)


def _free_tolerances(report: Report, robust: Robust, design: RealArray, options: Options) -> None:
    """Search with the tolerance of each mount as a variable, and show its front by price."""
    mounts: dict[str, list[str]] = {}
    for name, tolerance in zip(robust.space.names, robust.space.tolerance, strict=True):
        if tolerance > 0.0:
            mounts.setdefault(mount_of(name), []).append(name)
    free = FreeTolerances(robust, mounts, *TOLERANCE_BOUNDS)
    whole = _tolerance_front(free, design, options)
    affordable = np.flatnonzero(whole["price over today's [1]"] <= 1.0)
    steadiest = affordable[int(whole["sigma against today [%]"].to_numpy()[affordable].argmin())]
    best = whole.loc[steadiest]
    low, high = (f"{PERCENT * bound:g}" for bound in TOLERANCE_BOUNDS)
    report.section(
        "Tolerances as variables",
        f"The tolerance of each mount lies between ±{low} and ±{high} %, as a variable beside the "
        "stiffness factors, and its price, today's tolerance over it, is a third objective. The "
        "tighter ones cost most, the front says what they buy. At no higher price than today's it "
        f"has a design with {signed(best['sigma against today [%]'], 0)} % of sigma and "
        f"{signed(best['mean level against today [dB]'], 1)} dB; its tolerances are "
        + ", ".join(f"{mount} ±{best[f'tolerance {mount} ± [%]']:.0f} %" for mount in mounts)
        + ".",
        folded=True,
    )
    report.table("free_tolerances", whole)
    shown = list(whole.columns[: 3 + len(mounts)])
    values = whole[shown].to_numpy()
    report.figure(
        "free_tolerances",
        lambda: plot.parallel_coordinates(
            [name.replace(" against today", "") for name in shown],
            values,
            np.stack([values.min(axis=0), values.max(axis=0)]),
            whole["price over today's [1]"],
            {
                "today": np.array([1.0, 0.0, 0.0, *(PERCENT * free.space.nominal[-len(mounts) :])]),
                "least sigma at no higher price": values[steadiest],
            },
            value_label="price over today's [1]",
            share_label="from smallest to largest [%]",
        ),
        "Every design of the front over both levels, the price and the tolerance of each mount, "
        "from the smallest to the largest of each.",
    )
