"""Which vehicles of the platform can share which mounts, and what does sharing cost?

Each vehicle would be quietest with its own set of mounts, but a platform needs few part numbers.
The study finds the smallest number of part numbers, of all mounts together, with which every
vehicle keeps its limit. The limit is --allowed dB per line above the level with its own mounts, or
comes from a table. Levels include the energy that scatter adds to each line, so a notch that real
parts do not have counts for nothing. The study first tries one set per group. Then an integer
program chooses which vehicles share a part, and gradients improve the stiffness of each part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Option

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.commonality import fewest_part_numbers, separate_sets
from deboom.explore.scatter import sobol_sample
from deboom.explore.selection import variables_without_effect
from deboom.explore.sharing import Sharing, SharingProblem, check_together, separate_optima
from deboom.explore.space import DesignSpace, responses
from deboom.files.tables import row_of_each
from deboom.files.uncertain_index import uncertain_index
from deboom.pages.commonality import SharedMounts, commonality_report
from deboom.plot.style import mount_of
from deboom.progress import Progress, progress_bar
from deboom.report import Report
from deboom.runs.options import Bounds, Seed, Tolerance, at_least
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.runs.result import RunContext, run_name
from deboom.vehicles.design_factor import factor_space
from deboom.vehicles.expected_change import ExpectedChange, expected_or_why
from deboom.vehicles.limits import MeanLevel, ScatteredLevel
from deboom.vehicles.platform import Runs

DRAWS = 8192
"""Of the scatter: for the margin of the search, and others for the check."""
SURE = 3.0
"""Standard errors of the share of `DRAWS` by which the search asks for more than --share."""
ROUNDS = 5
"""Searches at most; each takes the margin that the sharing before it turned out to need."""


@dataclass(frozen=True)
class Options:
    """What sharing may cost, who may share, and for how long is searched."""

    seed: Seed = 1
    allowed: Annotated[
        float, Option(help="Allowed rise above the level with own mounts, per line [dB].")
    ] = 0.5
    limits: Annotated[
        Path | None,
        Option(help="Table with the columns vehicle and limit [dB(A)], in place of --allowed."),
    ] = None
    share: Annotated[float, Option(help="Share of cars that keep the limit [1].")] = 0.95
    together: Annotated[
        list[str] | None,
        Option(help="Vehicles that must share a mount, such as TSM=U06-1,U06-2; repeatable."),
    ] = None
    starts: Annotated[
        int,
        Option(
            help="Number of descents to find the best mounts of one vehicle.", callback=at_least(1)
        ),
    ] = 12
    bounds: Bounds = 0.20
    tolerance: Tolerance = 0.15
    platform: PlatformOptions = PlatformOptions(group=None)
    motion: MotionOptions = MotionOptions()

    def __post_init__(self) -> None:
        if not self.allowed >= 0.0:
            raise InputError(f"--allowed {self.allowed:g}: sharing costs 0 dB or more")
        if not 0.5 <= self.share < 1.0:
            raise InputError(f"--share {self.share:g}: ask for at least half of the cars, below 1")


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles, their design space, and who must share."""

    runs: Runs
    index: Any
    space: DesignSpace
    parts: dict[str, list[str]]
    together: dict[str, list[list[str]]]
    limits: RealArray | None

    @property
    def level(self) -> MeanLevel:
        """Mean level of the lines of each vehicle [dB(A)]."""
        return MeanLevel(self.index)

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Names, in the platform's order."""
        return tuple(self.index.response_names)


def prepare(options: Options) -> Model:
    """Read the platform, build its model and check who is to share."""
    runs = options.platform.runs()
    index = options.motion.model(runs)
    vehicles = tuple(index.response_names)
    if len(vehicles) < 2:
        raise InputError(f"only vehicle {vehicles[0]} was asked for: sharing needs two")
    space = factor_space(index.variable_names, options.bounds, options.tolerance)
    parts = {
        mount: [name for name in space.names if mount_of(name) == mount]
        for mount in dict.fromkeys(mount_of(name) for name in space.names)
    }
    together = _together(options.together)
    check_together(together, tuple(parts), vehicles)
    limits = None
    if options.limits is not None:
        rows = row_of_each(options.limits, ("vehicle",), {"limit": "dB(A)"}, vehicles)
        limits = np.array([row.number("limit") for row in rows])
    return Model(runs, index, space, parts, together, limits)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Search, verify and report."""
    with progress_bar("commonality") as progress:
        shared = _shared(model, options, progress)
    limits_in_words = f"its level with mounts of its own plus {options.allowed:g} dB"
    if options.limits is not None:
        limits_in_words = f"the limits of {options.limits.name}"
    of_limits = (options.limits,) if options.limits is not None else ()
    return commonality_report(
        shared,
        model.runs,
        model.index,
        limits_in_words=limits_in_words,
        inputs=(*model.runs.platform.input_files, *of_limits),
        run=run_name(context, "commonality"),
    )


def _shared(model: Model, options: Options, progress: Progress) -> SharedMounts:
    """Find the fewest mount part numbers with which every vehicle keeps its limit, and verify."""
    level, space, seed = model.level, model.space, options.seed
    silent = variables_without_effect(level, space)
    fixed = np.isin(space.names, silent)
    searched = replace(
        space,
        lower=np.where(fixed, space.nominal, space.lower),
        upper=np.where(fixed, space.nominal, space.upper),
    )
    progress(0, 3, "mounts of its own for each vehicle")
    drawn = ScatteredLevel(model.index, space.nominal, space.relative_sigma)
    optima = separate_optima(drawn, searched, starts=options.starts, seed=seed)
    draws = sobol_sample(space.n_variables, DRAWS, seed=seed).values
    made = _as_made(level, space, optima.designs, draws)
    limits = np.quantile(made, options.share, axis=1) + options.allowed
    if model.limits is not None:
        limits = model.limits
        _refuse_missed(options, model.vehicles, limits, np.quantile(made, options.share, axis=1))
    # draws are finite: ask for more than the share, as far as mounts of its own still keep it
    share_searched = options.share + SURE * np.sqrt(options.share * (1.0 - options.share) / DRAWS)
    room = limits - optima.levels
    margin = np.minimum(np.quantile(made, min(share_searched, 1.0), axis=1) - optima.levels, room)
    problem = SharingProblem(drawn, searched, model.parts, limits - margin, model.together)
    groups = _group_sets(model.runs, problem)
    guesses = [] if groups is None else [groups]
    for _ in range(ROUNDS):
        sharing = fewest_part_numbers(
            problem, optima, guesses, lambda _done, _all, text: progress(1, 3, text)
        )
        made = _as_made(level, space, sharing.fewest.designs, draws)
        needed = np.quantile(made, min(share_searched, 1.0), axis=1) - sharing.fewest.levels
        wider = np.clip(needed, margin, room)
        if np.all(sharing.fewest.levels + wider <= limits):
            break
        margin = wider
        problem = replace(problem, limits=limits - margin)
    progress(2, 3, "verification")
    by_group = None if groups is None else separate_sets(problem, optima, groups)
    check = sobol_sample(space.n_variables, DRAWS, seed=seed, purpose="verification sample").values
    made = _as_made(level, space, sharing.fewest.designs, check)
    kept = np.mean(made <= limits[:, np.newaxis], axis=1)
    today = np.asarray(responses(problem.evaluate, problem.space.nominal[np.newaxis])[0])
    progress(3, 3, "done")
    return SharedMounts(
        problem=problem,
        optima=optima,
        fewest=sharing.fewest,
        by_count=sharing.by_count,
        lower_bound=sharing.lower_bound,
        by_group=by_group,
        margin=margin,
        share=options.share,
        shares=kept,
        silent=silent,
        today=today,
        expected=_expected(model, sharing.fewest.designs, seed),
    )


def _expected(model: Model, designs: RealArray, seed: int) -> ExpectedChange | str:
    """State what is expected of designs (v, k), one for each vehicle; or why nothing is."""
    index, runs = model.index, model.runs
    return expected_or_why(
        index,
        lambda: (
            uncertain_index(index, runs.platform, runs.parts)
            .expected_change(designs[np.newaxis], seed=seed)
            .of(0)
        ),
    )


def _as_made(
    level: MeanLevel, space: DesignSpace, designs: RealArray, draws: RealArray
) -> RealArray:
    """Level of cars of each vehicle as they are made with its own design, shape (v, n) [dB(A)]."""
    scale = 1.0 + space.relative_sigma * draws
    return np.array([responses(level, row * scale)[:, v] for v, row in enumerate(designs)])


def _together(texts: Sequence[str] | None) -> dict[str, list[list[str]]]:
    """Read ``TSM=U06-1,U06-2``."""
    together: dict[str, list[list[str]]] = {}
    for text in texts or ():
        part, mark, names = text.partition("=")
        vehicles = [name.strip() for name in names.split(",") if name.strip()]
        if not mark or len(vehicles) < 2:
            raise InputError(
                f"--together '{text}': write a mount and at least two vehicles, TSM=U06-1,U06-2"
            )
        together.setdefault(part.strip(), []).append(vehicles)
    return together


def _refuse_missed(
    options: Options, vehicles: Sequence[str], limits: RealArray, kept: RealArray
) -> None:
    """Refuse limits that vehicles miss with mounts of their own, both (v,) [dB(A)]."""
    missed = kept - limits
    binding = int(np.argmax(missed))
    if missed[binding] > 0.0:
        raise InputError(
            f"{options.limits}: {vehicles[binding]} cannot keep its limit of {limits[binding]:.4g} "
            f"dB(A): with mounts of its own {options.share:.0%} of the cars reach "
            f"{kept[binding]:.4g} dB(A), {missed[binding]:.3g} dB too much; "
            f"{int((missed > 0.0).sum())} of {missed.size} vehicles miss theirs: raise the limits, "
            "or widen the bounds (--bounds)"
        )


def _group_sets(runs: Runs, problem: SharingProblem) -> Sharing | None:
    """Sharing of one set per group of the platform; None if there is one group."""
    group_of = {vehicle.name: vehicle.group for vehicle in runs.fleet.vehicles}
    groups = list(dict.fromkeys(group_of.values()))
    if len(groups) < 2:
        return None
    numbers = [groups.index(group_of[name]) for name in problem.vehicles]
    sets = np.tile(numbers, (len(problem.part_names), 1))
    return Sharing(problem.part_names, problem.vehicles, sets)
