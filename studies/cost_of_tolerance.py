"""Which mount directions deserve tight tolerances, and what does less scatter cost?

Stiffness factor and tolerance of every direction are variables (24 of them) and the tolerances have
a price: NSGA-II for three objectives, the sums over the vehicles of mean SPLV and of its standard
deviation, and the cost ``weight (reference / tolerance - 1)``, summed over the directions. Weight 1
and reference 15 % are assumptions; --cost-table takes your own. `tolerance_allocation` answers the
narrower question, the cheapest tolerances of one design for one target, exactly.

What it showed, with seed 1 on the virtual platform: for today's money the scatter halves while the
mean falls by 2.1 dB per line; x of all four mounts deserves the precision, TSM x first, and y of
none. A quiet design with today's scatter saves the price of four halved tolerances.
Keys of summary.json, of designs no louder than the quietest one by more than the margin, verified
with 1024 draws: sigma_change_percent_at_todays_cost (against today's design),
sigma_change_percent_by_allocation (against one tolerance everywhere at that cost and stiffness),
mean_change_db_per_line_at_todays_cost; cost_for_todays_sigma (negative is a saving);
cost_most_precise, sigma_change_percent_most_precise; n_front, n_evaluated, n_failed (designs).
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
from deboom.explore.front import verification_response
from deboom.explore.robust import RobustValues
from deboom.explore.scatter import sobol_sample
from deboom.explore.tolerance_allocation import ToleranceResponse
from deboom.plot.style import mount_of, signed
from deboom.report import Report
from deboom.study.made_parts import MadeParts, ScatterOptions, tolerance_cost
from deboom.study.options import Seed
from deboom.study.platform_model import MotionOptions, Operation, PlatformOptions, motion_report
from deboom.study.result import RunContext
from deboom.study.search import SearchOptions

DRAWS = 1024
"""Draws behind every verified number."""
SHOWN = 12
"""Designs that a table or a curve shows."""
PERCENT = 100.0


@dataclass(frozen=True)
class Options:
    """Which tolerances are possible, at which price, and for how long is searched."""

    seed: Seed = 1
    search: SearchOptions = SearchOptions(generations=200)
    scatter: ScatterOptions = ScatterOptions()
    tightest: Annotated[float, Option(help="Smallest tolerance, half width [1].")] = 0.05
    widest: Annotated[float, Option(help="Largest tolerance, half width [1].")] = 0.30
    mean_margin: Annotated[float, Option(help="Above the quietest design [dB].")] = 0.5
    cost_table: Annotated[Path | None, Option(help="variable, weight, reference tolerance.")] = None
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles under scattering parts, and the price of the tolerances."""

    runs: Operation
    made: MadeParts
    priced: ToleranceResponse


def prepare(options: Options) -> Model:
    """Read the platform, build its model and put a price on tolerances."""
    runs = options.platform.operation()
    index = options.motion.index(runs)
    made = options.scatter.made(index.variable_names)
    sample = sobol_sample(made.n_draws, options.scatter.samples, seed=options.seed)
    cost = tolerance_cost(options.cost_table, index.variable_names)
    bounds = (options.tightest, options.widest)
    return Model(runs, made, ToleranceResponse(made.response(index, sample), *bounds, cost))


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Search, verify and report."""
    priced, robust = model.priced, model.priced.robust
    index: Any = robust.evaluate
    tables = (*((options.cost_table,) if options.cost_table else ()), *model.made.inputs)
    files = (*model.runs.platform.input_files, *tables)
    search = options.search.front(priced, options.seed, context, files)
    front = search.front
    per_line = float(1.0 / (index.n_lines * len(index.response_names)))
    costs = np.asarray(front.objectives[:, -1])
    rows = _cheapest_quiet(front, costs, per_line, options.mean_margin)
    cost = costs[rows]

    checked = replace(priced, robust=verification_response(robust, DRAWS, seed=options.seed))
    chosen = checked(front.designs[rows])
    same = checked(_uniform(priced, front.designs[rows], cost))
    today = checked(priced.space.nominal[np.newaxis, :])
    today_cost = float(priced.cost(robust.space.tolerance))
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
        "The price of a tolerance is an assumption: weight × (reference / tolerance − 1) per "
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
    report.inputs += [*model.runs.platform.input_files, *tables]

    report.section(
        "What scatter costs",
        f"Of all designs within {options.mean_margin:g} dB of the quietest one, those with "
        f"the least scatter for their cost; evaluated with {DRAWS} independent draws. "
        "Beside them the same stiffnesses at the same cost, with one tolerance "
        "everywhere.",
    )
    report.figure(
        "cost_of_scatter",
        plot.fronts(
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
    report.figure(
        "tolerances",
        plot.curve_panels(
            _panels(robust.space.names, cost, tolerances),
            x_label="cost [1]",
            y_label="tolerance ± [%]",
            columns=2,
            share_y=True,
        ),
        "Tolerance of each direction.",
    )
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
    report.figure(
        "front",
        plot.map_panels(
            [
                plot.MapPanel(
                    "every design of the front",
                    costs,
                    front.sigma_sum * per_line,
                    front.mean_sum * per_line,
                )
            ],
            x_label="cost of the tolerances [1]",
            y_label="σ of the mean level [dB]",
            value_label="mean level over vehicles and lines [dB(A)]",
            columns=1,
        ),
        "Cost, scatter and mean level.",
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
    same = (weight * reference).sum() / (costs + float(weight.sum()))
    return np.hstack([inner, np.broadcast_to(same[:, np.newaxis], tolerances.shape)])


def _panels(
    variables: tuple[str, ...], cost: RealArray, tolerances: RealArray
) -> list[plot.CurvePanel]:
    """Return a panel per mount with the tolerances (n, k) of its directions over the cost [%]."""
    few = _few(len(cost))
    panels = []
    for mount in dict.fromkeys(mount_of(name) for name in variables):
        curves = {
            name.removeprefix(f"{mount} "): tolerances[few, place]
            for place, name in enumerate(variables)
            if mount_of(name) == mount
        }
        panels.append(plot.CurvePanel(mount, cost[few], curves))
    return panels


def _few(count: int) -> list[int]:
    """Return about `SHOWN` rows, evenly over all, first and last among them."""
    return sorted({int(row) for row in np.linspace(0, count - 1, min(SHOWN, count))})


def _span(values: RealArray) -> str:
    """Write the range of some values."""
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"
