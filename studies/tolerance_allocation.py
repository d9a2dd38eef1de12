"""How much may each direction of the mounts scatter, at the lowest cost, for a stated target?

The study takes one design of a front, of a finished run (--from-run) or of a quick search. It finds
the cheapest tolerances with which sigma of the mean level is exactly --sigma (default: today's
sigma), or with which exactly --share of all pairs of part and vehicle keep --limit. The cost of a
direction is 1 at ±15 % and inversely proportional to the tolerance; --cost-table states other
costs. --free-tolerances also searches with the tolerances of the mounts as variables, from this
design and today's on: what would another design be worth if its tolerances were tighter?
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
from typer import Option

from deboom.arrays import PERCENT, RealArray
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.doe import latin_hypercube
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import Search, nsga2
from deboom.explore.selection import at_nominal, pick, variables_without_effect
from deboom.explore.tolerance_allocation import (
    Allocator,
    FreeTolerances,
    ToleranceEffect,
    ToleranceTask,
    with_draws,
)
from deboom.files.made_parts import MadeParts, tolerance_cost
from deboom.pages.front import report_parts
from deboom.pages.motion import report_runs
from deboom.pages.tolerance_allocation import ToleranceFront, ToleranceSets, tolerance_report
from deboom.plot.style import mount_of
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.options import (
    Checks,
    CostTable,
    FrontRun,
    ScatterOptions,
    Seed,
    robust_response,
    target_limits,
)
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.runs.rebuilt import supplier_study
from deboom.runs.result import RunContext, run_name
from deboom.runs.search import SearchOptions
from deboom.vehicles.platform import Platform, Runs

SEARCH_DRAWS = 128
"""Draws per design of a quick search."""
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
    sample = sobol_sample(made.n_draws, SEARCH_DRAWS, seed=options.seed)
    robust = robust_response(index, made.space, sample, structure=made.structure)
    return Model(runs.platform, robust, runs.platform.input_files, runs=runs, made=made)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Choose the design, allocate its tolerances, verify and report."""
    design = _chosen(model, options, context)
    sets = _allocated(model, options, design)
    free = _free_tolerances(model.robust, design, options) if options.free_tolerances else None
    prices = (options.cost_table,) if options.cost_table else ()
    report = tolerance_report(
        sets,
        free,
        mounts=model.platform.mounts,
        assumed=model.assumed,
        inputs=(*model.inputs, *prices),
        run=run_name(context, "tolerance_allocation"),
    )
    if model.made is not None:
        report_parts(report, model.made)
    if model.runs is not None:
        report_runs(report, model.runs)
    return report


def _allocated(model: Model, options: Options, design: RealArray) -> ToleranceSets:
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
    sets = ToleranceSets(
        index=index,
        design=design,
        design_name=options.design_name,
        sigma=options.sigma,
        share=options.share,
        samples=options.scatter.samples,
        checks=options.checks,
        cost_table=options.cost_table,
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


def _free_tolerances(robust: Robust, design: RealArray, options: Options) -> ToleranceFront:
    """Search from today's and a design (k,) on, with the tolerance of each mount as a variable."""
    groups: dict[str, list[str]] = {}
    for name, tolerance in zip(robust.space.names, robust.space.tolerance, strict=True):
        if tolerance > 0.0:
            groups.setdefault(mount_of(name), []).append(name)
    free, mounts = FreeTolerances(robust, groups, *TOLERANCE_BOUNDS), tuple(groups)
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
    table = pd.DataFrame(columns).sort_values("price over today's [1]", ignore_index=True)
    return ToleranceFront(free, TOLERANCE_BOUNDS, table)
