"""How wide may each direction of the mounts scatter, at the least cost, for a stated target?

For one design of a front (of a finished run with --from-run, else of a quick search): the cheapest
tolerances that keep sigma of the mean level at --sigma (default: today's), or --share of all parts
x vehicles within --limit, exactly. A direction costs 1 at +-15 %, and its reciprocal, or see
--cost-table. With --stiffness the premise is wider: stiffnesses are chosen together with the
tolerances, by NSGA-II over three objectives (mean, sigma, cost; give it --generations 200
--population 100), so that its designs are near the best, not the exact ones of one design.

What it showed with --stiffness, seed 1, prescribed motion on the virtual platform: for today's
money the scatter halves while the mean falls by 2.1 dB per line; x of all four mounts deserves the
precision, TSM x first, and y of none.

Keys of summary.json: design, target; cost_cheapest, cost_uniform (one tolerance everywhere for the
same target), cost_today; cost_ratio_to_uniform, cost_ratio_to_uniform_of_effective (uniform where a
direction has an effect, else free); sigma_today_db, sigma_cheapest_db (mean level, mean over
vehicles), sigma_verified_db, sigma_uniform_verified_db (new draws); optimality_percent (spread of
the target's price over directions, 0: optimal); share_stated, share_verified, share_lower_bound;
surface_difference_at_peaks_db (library against spectra).
With --stiffness instead, of designs no louder than the quietest one by more than the margin,
verified with 1024 draws: sigma_change_percent_at_todays_cost (against today's design),
sigma_change_percent_by_allocation (against one tolerance everywhere at that cost and stiffness),
mean_change_db_per_line_at_todays_cost; cost_for_todays_sigma, cost_most_precise,
sigma_change_percent_most_precise; n_front, n_evaluated, n_failed, seconds_search.
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
from deboom.errors import InputError
from deboom.explore.front import verification_response
from deboom.explore.robust import RobustResponse, RobustValues
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.explore.tolerance_allocation import (
    Allocator,
    ToleranceEffect,
    ToleranceResponse,
)
from deboom.files.platform import Platform
from deboom.plot.style import signed
from deboom.report import Report
from deboom.study.made_parts import (
    MadeParts,
    ScatterOptions,
    ToleranceTask,
    cost_curves,
    target_limits,
    tolerance_cost,
    with_draws,
)
from deboom.study.options import Seed
from deboom.study.platform_model import MotionOptions, Operation, PlatformOptions, motion_report
from deboom.study.result import RunContext
from deboom.study.search import SearchOptions
from deboom.study.supplier_study import supplier_study

SEARCH_DRAWS = 128
"""Draws per design of a quick search."""
DRAWS = 8192
"""Independent draws with which tolerances are verified."""
CHECKED = 1024
"""Draws behind every verified number of a search for stiffnesses."""
SHOWN = 12
"""Designs that a table or a curve shows."""
ON_CURVE = 8
"""Targets on the curve of cost over target."""
PERCENT = 100.0


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
    cost_points: Annotated[Path | None, Option(help="variable, tolerance, cost")] = None
    stiffness: Annotated[bool, Option(help="Choose stiffnesses, too, by search.")] = False
    mean_margin: Annotated[float, Option(help="Then above the quietest design [dB].")] = 0.5
    search: SearchOptions = SearchOptions(generations=40, population=60)
    scatter: ScatterOptions = ScatterOptions(samples=256)
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()

    def __post_init__(self) -> None:
        if self.sigma is not None and self.limit:
            raise InputError("give either --sigma or --limit, not both")
        if self.stiffness and (self.from_run or self.sigma or self.limit or self.cost_points):
            raise InputError(
                "--stiffness searches designs of its own: leave out --from-run, --sigma, --limit "
                "and --cost-points"
            )

    @property
    def design_name(self) -> str:
        """The asked design in words."""
        return self.pick.value.replace("-", " ") if self.point is None else f"point {self.point}"


@dataclass(frozen=True, eq=False)
class Model:
    """A platform's robust model; with --from-run also the asked design."""

    platform: Platform
    robust: RobustResponse
    inputs: tuple[Path, ...]
    runs: Operation | None = None
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
    runs = options.platform.operation()
    index = options.motion.index(runs)
    made = scatter.made(index.variable_names)
    draws = scatter.samples if options.stiffness else SEARCH_DRAWS
    robust = made.response(index, sobol_sample(made.n_draws, draws, seed=options.seed))
    return Model(runs.platform, robust, runs.platform.input_files, runs, made)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Choose the design, allocate its tolerances, verify and report."""
    if options.stiffness:
        return _searched(model, options, context)
    return _allocated(model, options, _chosen(model, options, context))


def _chosen(model: Model, options: Options, context: RunContext | None) -> RealArray:
    """Return the asked design of the front, shape (k,); variables without effect at 1."""
    if model.picked is not None:
        return model.picked
    files = (*model.inputs, *(model.made.inputs if model.made else ()))
    front = options.search.front(model.robust, options.seed, context, files).front
    nominal = model.robust.space.nominal
    row = pick(front, model.robust(nominal[np.newaxis])).get(options.pick.value.replace("-", " "))
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


def _allocated(model: Model, options: Options, design: RealArray) -> Report:
    """Allocate the tolerances of a design and report."""
    index: Any = model.robust.evaluate
    space = model.robust.space
    scatters = [n for n, t in zip(space.names, space.tolerance, strict=True) if t > 0.0]
    curves, price_files = cost_curves(options.cost_table, options.cost_points, scatters)
    effect = ToleranceEffect(
        with_draws(model.robust, "allocation sample", options.scatter.samples, options.seed), design
    )
    lower, upper = np.asarray(options.tightest), np.asarray(options.widest)
    allocator = Allocator(effect, curves, lower, upper)
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
    tightest = int(np.argmin(cheapest.tolerance))
    widest = int(np.isclose(cheapest.tolerance, allocator.upper).sum())
    report.tile(
        f"{allocator.names[tightest]} ±{PERCENT * cheapest.tolerance[tightest]:.0f} %",
        f"the tightest; {widest} of {len(allocator.names)} directions may be as wide as allowed",
    )
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

    report.section(
        "Allocation",
        "A direction at the widest tolerance needs no precision; one that is tighter than "
        "the rest is what the noise scatters by.",
    )
    report.figure(
        "allocation",
        plot.interval_panels(
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

    report.section("What other targets cost", "The same design with more or less scatter.")
    curve = task.cost_of_targets(ON_CURVE)
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
    report.table("cost_of_target", curve)

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


def _searched(model: Model, options: Options, context: RunContext | None) -> Report:
    """Search stiffnesses and tolerances together, verify and report."""
    robust = model.robust
    index: Any = robust.evaluate
    assert model.made is not None
    assert model.runs is not None
    price = tolerance_cost(options.cost_table, robust.space.names)
    priced = ToleranceResponse(robust, options.tightest, options.widest, price)
    base = float(price.weight.sum())  # the response counts from today's, the page from nothing
    tables = (*((options.cost_table,) if options.cost_table else ()), *model.made.inputs)
    files = (*model.inputs, *tables)
    search = options.search.front(priced, options.seed, context, files)
    front = search.front
    per_line = float(1.0 / (index.n_lines * len(index.response_names)))
    costs = np.asarray(front.objectives[:, -1]) + base
    rows = _cheapest_quiet(front, costs, per_line, options.mean_margin)
    cost = costs[rows]

    checked = replace(priced, robust=verification_response(robust, CHECKED, seed=options.seed))
    chosen = checked(front.designs[rows])
    same = checked(_uniform(priced, front.designs[rows], cost))
    today = checked(priced.space.nominal[np.newaxis, :])
    today_cost = float(priced.cost(robust.space.tolerance)) + base
    affordable = np.flatnonzero(cost <= today_cost)
    place = int(affordable[-1]) if affordable.size else 0
    today_sigma = float(today.sigma_sum[0])
    enough = np.flatnonzero(chosen.sigma_sum <= today_sigma)

    def change(sigma: float, against: float) -> float:
        return float(PERCENT * (sigma / against - 1.0))

    at_today = change(chosen.sigma_sum[place], today_sigma)
    allocated = change(chosen.sigma_sum[place], same.sigma_sum[place])
    louder = float((chosen.mean_sum[place] - today.mean_sum[0]) * per_line)
    report = Report(
        "What tighter tolerances buy",
        "Which directions of the mounts deserve tight tolerances, and what does less scatter "
        f"of the noise in {', '.join(index.response_names)} cost?",
    )
    report.explain("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")
    report.tile(f"{signed(at_today, 0)} %", "σ at today's cost")
    report.tile(f"{signed(allocated, 0)} %", "σ against one tolerance everywhere")
    report.tile(f"{signed(louder, 2)} dB", "mean level of that design")
    report.warn(
        "The price of a tolerance is an assumption: weight × reference / tolerance per "
        f"direction, weights {_span(priced.cost.weight)}, references "
        f"{_span(priced.cost.reference)}. Give your own with --cost-table.",
        *motion_report(index, robust.space.nominal[np.newaxis]).warnings,
    )
    report.summary |= {
        "sigma_change_percent_at_todays_cost": at_today,
        "sigma_change_percent_by_allocation": allocated,
        "mean_change_db_per_line_at_todays_cost": louder,
        "sigma_change_percent_most_precise": change(chosen.sigma_sum[-1], today_sigma),
        "cost_most_precise": float(cost[-1]),
        "cost_for_todays_sigma": float(cost[enough[0]]) if enough.size else float("nan"),
        "n_front": len(front),
        "n_evaluated": search.n_evaluated,
        "n_failed": search.n_failed,
        "seconds_search": round(search.seconds, 3),
    }
    report.facts["kernel"] = index.kernel
    report.inputs += [*model.inputs, *tables]

    report.section(
        "What scatter costs",
        f"Of all designs within {options.mean_margin:g} dB of the quietest one, those with "
        f"the least scatter for their cost; evaluated with {CHECKED} independent draws. "
        "Beside them the same stiffnesses at the same cost, with one tolerance "
        "everywhere.",
    )
    report.figure(
        "cost_of_scatter",
        lambda: plot.fronts(
            {
                "tolerances chosen": (cost, chosen.sigma_sum * per_line),
                "one tolerance everywhere": (cost, same.sigma_sum * per_line),
            },
            {},
            {"today's": (today_cost, today_sigma * per_line)},
            mean_label="cost of the tolerances [1]",
            sigma_label="σ of the mean level [dB]",
        ),
        "Scatter over cost.",
    )
    sigma = np.concatenate([today.sigma_sum, chosen.sigma_sum]) * per_line
    budgets = pd.DataFrame(
        {
            "design": ["today's", *(f"point {row + 1}" for row in rows)],
            "cost [1]": np.concatenate([[today_cost], cost]),
            "mean level [dB(A)]": np.concatenate([today.mean_sum, chosen.mean_sum]) * per_line,
            "sigma of the level [dB]": sigma,
            "change of sigma [%]": PERCENT * (sigma / sigma[0] - 1.0),
            "sigma, one tolerance everywhere [dB]": np.concatenate(
                [sigma[:1], same.sigma_sum * per_line]
            ),
        }
    )
    report.table(
        "budgets",
        budgets,
        "Today's design and designs of the chosen tolerances, per line.",
        {
            "mean level [dB(A)]": 2,
            "sigma of the level [dB]": 3,
            "cost [1]": 2,
            "sigma, one tolerance everywhere [dB]": 3,
        },
        shown=budgets.iloc[_few(len(budgets))],
    )

    report.section(
        "Where to be precise",
        "A direction at the widest tolerance needs none; one that goes down first is what "
        "scatter comes from.",
    )
    tolerances = PERCENT * priced.split(chosen.designs)[1]
    places = {"cheapest": 0, "at today's cost": place, "most precise": len(rows) - 1}
    listed = {f"{name} [%]": tolerances[at] for name, at in places.items()}
    table = pd.DataFrame({"variable": list(robust.space.names), **listed})
    report.table("tolerances", table, "Half widths, three standard deviations.")

    report.section(
        "The front",
        f"NSGA-II over {priced.space.n_variables} variables and three objectives: "
        f"{search.n_evaluated} designs were evaluated, {search.n_failed} failed, "
        f"{len(front)} are on the front, {search.seconds:.1f} s.",
    )
    point = np.arange(1, len(front) + 1)
    objectives = {
        "SPLV mean sum [dB(A)]": front.mean_sum,
        "SPLV sigma sum [dB]": front.sigma_sum,
        "cost [1]": costs,
    }
    report.table("front", pd.DataFrame({"point": point, **objectives}))
    designs = dict(zip(priced.space.labels, front.designs.T, strict=True))
    report.table("designs", pd.DataFrame({"point": point, **designs}))
    model.made.append_to(report)
    model.runs.append_to(report)
    return report


def _cheapest_quiet(
    front: RobustValues, costs: RealArray, per_line: float, margin: float
) -> list[int]:
    """Return rows near the quietest, within the margin [dB], that scatter least for their cost."""
    mean = front.mean_sum * per_line
    quiet = np.flatnonzero(mean <= mean.min() + margin)
    order = quiet[np.argsort(costs[quiet], kind="stable")]
    sigma = front.sigma_sum[order]
    best = np.concatenate([[True], sigma[1:] < np.minimum.accumulate(sigma)[:-1]])
    return [int(row) for row in order[best]]


def _uniform(priced: ToleranceResponse, designs: RealArray, costs: RealArray) -> RealArray:
    """Return the same stiffnesses, each with one tolerance everywhere at the same cost."""
    inner, tolerances = priced.split(designs.copy())
    weight, reference = priced.cost.weight, priced.cost.reference
    same = (weight * reference).sum() / costs
    return np.hstack([inner, np.broadcast_to(same[:, np.newaxis], tolerances.shape)])


def _few(count: int) -> list[int]:
    """Return about `SHOWN` rows, evenly over all, first and last among them."""
    return sorted({int(row) for row in np.linspace(0, count - 1, min(SHOWN, count))})


def _span(values: RealArray) -> str:
    """Write the range of some values."""
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
