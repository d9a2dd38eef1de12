"""How wide may each direction of the mounts scatter, at the least cost, for a stated target?

For one design of a front (of a finished run with --from-run, else of a quick search): the cheapest
tolerances that keep sigma of the mean level at --sigma (default: today's), or --share of all parts
x vehicles within --limit, exactly. A direction costs 1 at +-15 %, and its reciprocal, or see
--cost-table.

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
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.explore.tolerance_allocation import Allocator, ToleranceEffect
from deboom.pages.front_answer import abbreviations
from deboom.pages.motion import motion_report, report_runs
from deboom.report import Report, Step, Table
from deboom.runs.made_parts import (
    MadeParts,
    ScatterOptions,
    ToleranceTask,
    report_parts,
    target_limits,
    tolerance_cost,
    with_draws,
)
from deboom.runs.options import Seed
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.runs.rebuilt import supplier_study
from deboom.runs.result import RunContext, run_name
from deboom.runs.search import SearchOptions
from deboom.vehicles.platform import Platform, Runs

SEARCH_DRAWS = 128
"""Draws per design of a quick search."""
DRAWS = 8192
"""Independent draws with which tolerances are verified."""


TIGHTEST = 3
"""Directions that the verdict names."""


@dataclass(frozen=True)
class Options:
    """What is asked, of which design, and at which price."""

    seed: Seed = 1
    from_run: Annotated[Path | None, Option(help="Finished front study, not a search.")] = None
    pick: Annotated[Pick, Option(help="Design of the front.")] = Pick.best_mean
    point: Annotated[int | None, Option(help="Its number there, from 1.")] = None
    sigma: Annotated[float | None, Option(help="Target of the mean level [dB].")] = None
    limit: Annotated[list[str] | None, Option(help="dB(A), +dB, vehicle=dB(A).")] = None
    share: Annotated[float, Option(help="Share of parts within limits [1].")] = 0.95
    tightest: Annotated[float, Option(help="Smallest tolerance, half width [1].")] = 0.05
    widest: Annotated[float, Option(help="Largest tolerance, half width [1].")] = 0.30
    cost_table: Annotated[Path | None, Option(help="variable, weight, reference tolerance")] = None
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
        return self.pick.value if self.point is None else f"point {self.point}"


@dataclass(frozen=True, eq=False)
class Model:
    """A platform's robust model; with --from-run also the asked design."""

    platform: Platform
    robust: Robust
    inputs: tuple[Path, ...]
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
        return Model(study.platform, study.model, inputs, picked=design)
    runs = options.platform.runs()
    index = options.motion.model(runs)
    made = scatter.made(index.variable_names)
    robust = made.response(index, sobol_sample(made.n_draws, SEARCH_DRAWS, seed=options.seed))
    return Model(runs.platform, robust, runs.platform.input_files, runs, made)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Choose the design, allocate its tolerances, verify and report."""
    design = _chosen(model, options, context)
    index: Any = model.robust.evaluate
    space = model.robust.space
    scatters = [n for n, t in zip(space.names, space.tolerance, strict=True) if t > 0.0]
    price = tolerance_cost(options.cost_table, scatters)
    effect = ToleranceEffect(
        with_draws(model.robust, "allocation sample", options.scatter.samples, options.seed), design
    )
    lower, upper = np.asarray(options.tightest), np.asarray(options.widest)
    allocator = Allocator(effect, price, lower, upper)
    levels = index(design[np.newaxis])[0] / index.n_lines
    limits = target_limits(options.limit, index.response_names, levels)
    task = ToleranceTask(
        robust=model.robust,
        allocator=allocator,
        limits=None if limits is None else limits * index.n_lines,
        sigma=options.sigma,
        share=options.share,
        draws=DRAWS,
        seed=options.seed,
    )

    today = allocator.at(allocator.today)
    cheapest = task.reached(allocator.cheapest)
    uniform = task.reached(allocator.uniform)
    free = np.isin(allocator.names, variables_without_effect(index, space))
    held = replace(allocator, lower=np.where(free, allocator.upper, allocator.lower))
    uniform_of_effective = task.reached(held.uniform)
    sets = {"today's": today, "cheapest": cheapest, "uniform": uniform}
    verified = {
        name: task.verified(allocated.tolerance, "allocation verification")
        for name, allocated in sets.items()
    }
    by_sigma = limits is None
    new = verified["cheapest"]

    vehicles = ", ".join(index.response_names)
    if by_sigma:
        goal = options.sigma or today.sigma_sum * task.per_line
        which = "" if options.sigma else ", today's"
        goal_in_words = f"the mean level scatters by no more than {goal:.3f} dB (σ{which})"
    else:
        goal_in_words = (
            f"{PERCENT * options.share:g} % of parts × vehicles stay within their limits"
        )
    report = Report(
        "Cheapest tolerances of a design",
        f"How wide may each direction of the mounts scatter, so that {goal_in_words} in "
        f"{vehicles}, at the least cost? The design is {options.design_name} of its front.",
    )
    report.explain("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")
    ratio = cheapest.total_cost / uniform.total_cost
    fair = cheapest.total_cost / uniform_of_effective.total_cost
    tightest = int(np.argmin(cheapest.tolerance))
    widest = int(np.isclose(cheapest.tolerance, allocator.upper).sum())
    report.tile(
        f"{allocator.names[tightest]} ±{PERCENT * cheapest.tolerance[tightest]:.0f} %",
        f"the tightest; {widest} of {len(allocator.names)} directions may be as wide as allowed",
    )
    report.tile(f"{PERCENT * ratio:.0f} %", "of the cost of one tolerance everywhere")
    report.tile(
        f"{PERCENT * fair:.0f} %", "of the cost of one tolerance in the directions that matter"
    )
    if by_sigma:
        report.tile(f"{new.sigma:.3f} dB", "σ of the mean level, verified")
    else:
        report.tile(f"{PERCENT * new.share:.1f} %", "within limits, verified")
        if new.share < options.share:
            report.warn(
                f"New draws find {PERCENT * new.share:.1f} % within the limits, not the "
                f"{PERCENT * options.share:g} % asked for: take more --samples."
            )
    spread = (
        f"the same scatter (σ {new.sigma:.2f} dB, verified)"
        if by_sigma
        else f"{PERCENT * new.share:.1f} % within limits (verified)"
    )
    tight = ", ".join(
        f"{allocator.names[k]} ±{PERCENT * cheapest.tolerance[k]:.0f} %"
        for k in np.argsort(cheapest.tolerance, kind="stable")[:TIGHTEST]
        if cheapest.tolerance[k] < allocator.upper[k]
    )
    report.answer(
        (f"Hold {tight}; " if tight else "Hold nothing tightly: ")
        + f"{widest} of {len(allocator.names)} directions may be as wide as allowed: {spread} at "
        f"{PERCENT * ratio:.0f} % of the cost of one tolerance everywhere.",
        f"Against one tolerance in the directions that matter alone the cost is "
        f"{PERCENT * fair:.0f} %. Prices are "
        + (
            "those of --cost-table."
            if options.cost_table
            else "assumed: 1 per direction at ±15 %, 2 at half the width (--cost-table)."
        ),
        abbreviations(model.platform.mounts),
    )
    even = bool(np.allclose(uniform.tolerance, today.tolerance))
    at_bound = np.select(
        [
            np.isclose(cheapest.tolerance, allocator.lower),
            np.isclose(cheapest.tolerance, allocator.upper),
        ],
        ["tightest", "widest"],
        "",
    )
    each = pd.DataFrame(
        {
            "direction": list(cheapest.names),
            "hold ± [%]": PERCENT * cheapest.tolerance,
            "today ± [%]": PERCENT * today.tolerance,
            "cost [1]": cheapest.cost,
            "cost today [1]": today.cost,
            "bound": at_bound,
        }
    )
    report.panel(
        "Each direction",
        Table(each, "", {"hold ± [%]": 0, "today ± [%]": 0, "cost [1]": 2, "cost today [1]": 2}),
        "Half widths, three standard deviations. Widest: needs no precision.",
        wide=True,
    )
    sets_shown = {name: result for name, result in sets.items() if not (even and name == "uniform")}
    worth = pd.DataFrame(
        {
            "tolerances": list(sets_shown),
            "cost [1]": [result.total_cost for result in sets_shown.values()],
            "σ, verified [dB]": [verified[name].sigma for name in sets_shown],
        }
    )
    if not by_sigma:
        worth["within limits [%]"] = [PERCENT * verified[name].share for name in sets_shown]
    report.panel(
        "What it is worth",
        Table(worth, "", {"cost [1]": 1, "σ, verified [dB]": 3}),
        "One tolerance for the same target is today's here." if even else "",
    )
    run_of = run_name(context, "tolerance_allocation")
    report.panel(
        "What to do next",
        Step(f"deboom report FRONT --supplier --tolerances {run_of}", "sheets with these"),
        Step("deboom run tolerance_allocation --cost-table FILE", "with your own prices"),
        Step("deboom run tolerance_allocation --limit LEVEL", "for a limit in place of a scatter"),
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
    }
    if not by_sigma:
        report.summary |= {
            "share_stated": options.share,
            "share_verified": new.share,
            "share_lower_bound": new.share_lower,
        }

    report.section(
        "Allocation",
        "A direction at the widest tolerance needs no precision; one that is tighter than "
        "the rest is what the noise scatters by.",
    )
    report.figure(
        "allocation",
        lambda: plot.interval_panels(
            allocator.names,
            [
                plot.IntervalPanel(
                    label,
                    {
                        "cheapest": (values, np.zeros(len(values)), values),
                        "one tolerance everywhere": (even, even, even),
                    },
                )
                for label, values, even in (
                    (
                        "tolerance ± [%]",
                        PERCENT * cheapest.tolerance,
                        PERCENT * uniform.tolerance,
                    ),
                    ("cost [1]", cheapest.cost, uniform.cost),
                )
            ],
        ),
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
            "bound": at_bound,
        }
    )
    report.table("allocation", allocation)

    report.section("Verification", f"{DRAWS} draws of the parts that nothing was chosen by.")
    chosen, check = "sigma of the level, chosen with [dB]", "sigma of the level, verified [dB]"
    verification = pd.DataFrame(
        {
            "tolerances": list(sets),
            "cost [1]": [allocated.total_cost for allocated in sets.values()],
            chosen: [allocated.sigma_sum * task.per_line for allocated in sets.values()],
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
    report.inputs += [*model.inputs, *((options.cost_table,) if options.cost_table else ())]
    if model.made is not None:
        report_parts(report, model.made)
    if model.runs is not None:
        report_runs(report, model.runs)
    return report


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
