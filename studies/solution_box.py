"""Within which stiffness intervals may parts be delivered so that the vehicles keep their limits?

The study finds the largest box of intervals, one per mount and axis, in which a stated share of the
parts keeps the limits of all vehicles. About the design of a front, --front, each vehicle keeps 80
% of what the design brings it; where that is below 0.3 dB, the limit is 0.1 dB above the design.
Without a front the limit of each vehicle is its level today. New parts verify the box. On the
virtual platform with seed 1 and without a front, GeM x, TSM x and Du x need an upper end: the
limits set 3 of 20 ends, the others lie at the bounds of the search. U06-5 exceeds its limit most
often.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from typer import Option

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.box import BoxQuestion
from deboom.explore.choices import Pick
from deboom.explore.largest_box import NoBoxFound, largest_box
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import Search, searched
from deboom.explore.selection import pick
from deboom.explore.space import DesignSpace, sobol_points
from deboom.files.made_parts import tolerance_cost
from deboom.files.uncertain_index import uncertain_index
from deboom.measurement.uncertainty import Interval, pivotal_interval
from deboom.pages.solution_box import USUAL_SHARE, BoxStudy, box_report
from deboom.progress import Progress, announce, progress_bar
from deboom.report import Report
from deboom.runs.options import Bounds, CostTable, FrontRun, Seed
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.runs.rebuilt import supplier_study
from deboom.runs.result import RunContext, run_name
from deboom.vehicles.booming_model import BoomingModel
from deboom.vehicles.design_factor import factor_space
from deboom.vehicles.limits import LimitedLevel, MeanLevel, PeakLevel, limited_response
from deboom.vehicles.platform import Runs

POPULATION, GENERATIONS, SEARCH_DRAWS = 80, 60, 64
"""Of the quick search for a Pareto point."""
DRAWS, PARTS = 60, 2048
"""Measurements that are drawn again, and parts that each of them judges."""
STEP = 0.1
"""By which a smaller share of the gain is tried where no box keeps a larger one [1]."""
LITTLE, ABOVE = 0.3, 0.1
"""Gain below which a vehicle's limit lies that much above the design's level instead [dB]."""
BOX_PARTS, BESIDE_PARTS = 1_800_000, 1.5
"""Parts that the search for the default box evaluates, about, and time of all over theirs [1]."""


@dataclass(frozen=True)
class Options:
    """What must be kept, by how many parts, about which design."""

    seed: Seed = 1
    share: Annotated[
        float, Option(help="Share of the parts in the box that keep the limits [1].")
    ] = 0.95
    limit: Annotated[
        float | None, Option(help="One limit for all vehicles [dB(A)]; default: see below-today.")
    ] = None
    below_today: Annotated[
        float | None,
        Option(
            help="Demand that each vehicle becomes quieter by this value [dB]; default: 0, with "
            "--front 80 % of its gain."
        ),
    ] = None
    quantity: Annotated[LimitedLevel, Option(help="Limited quantity.")] = LimitedLevel.mean
    peak_from: Annotated[float, Option(help="First line of a peak level [Hz].")] = 25.0
    peak_to: Annotated[float, Option(help="Last line of a peak level [Hz].")] = 40.0
    worst_vehicle: Annotated[
        bool,
        Option(
            help="A part must keep the limits of all vehicles; otherwise pairs of part and "
            "vehicle are counted."
        ),
    ] = True
    common: Annotated[
        float,
        Option(
            help="By how much the rubber of all mounts together may be softer or harder in the "
            "cars than in the test of a part: temperature, age or a batch [1]."
        ),
    ] = 0.05
    cost_table: CostTable = None
    front: FrontRun = None
    pick: Annotated[Pick, Option(help="Design of the front.")] = Pick.best_mean
    bounds: Bounds = 0.20
    tolerance: Annotated[
        float, Option(help="Half width of the box around the design, for comparison [1].")
    ] = 0.15
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()
    workers: Annotated[
        int, Option(help="Number of processes; the result does not depend on it.")
    ] = 1

    def __post_init__(self) -> None:
        if self.limit is not None and self.below_today is not None:
            raise InputError("--limit and --below-today are two limits at once: give one of them")

    @property
    def limit_below_today(self) -> float | None:
        """How far each vehicle's limit lies below its level today [dB]; None: other limits."""
        if self.limit is not None or self.of_gain:
            return None
        return 0.0 if self.below_today is None else self.below_today

    @property
    def of_gain(self) -> bool:
        """Whether limits keep a share of what a front's design brings: nobody stated others."""
        return self.front is not None and self.limit is None and self.below_today is None


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles, what is limited of them, and where parts may lie."""

    runs: Runs
    index: BoomingModel
    space: DesignSpace
    response: MeanLevel | PeakLevel


def prepare(options: Options) -> Model:
    """Read the platform and build its model."""
    runs = options.platform.runs()
    if options.limit is not None:
        runs = runs.heard("--limit is a level of sound")
    index = options.motion.model(runs)
    space = factor_space(index.variable_names, options.bounds, options.tolerance)
    band = (options.peak_from, options.peak_to)
    return Model(runs, index, space, limited_response(options.quantity, index, band))


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Find the Pareto point and the box about it, verify and report."""
    parts = BOX_PARTS + DRAWS * PARTS
    if options.front is None:
        parts += POPULATION * GENERATIONS * SEARCH_DRAWS
    batch = np.tile(model.space.nominal, (PARTS, 1))
    announce("solution box", lambda: model.response(batch), BESIDE_PARTS * parts / PARTS)
    with progress_bar("Box") as bar:
        point = pareto_point(model, options, bar)
        study = box_about(model, point, options, bar)
    certainty = share_measured_again(study)
    prices = (options.cost_table,) if options.cost_table is not None else ()
    return box_report(
        study,
        certainty,
        softer_and_harder=shares_of_common_factors(study),
        inputs=(*model.runs.platform.input_files, *prices),
        run=run_name(context, "solution_box"),
    )


def pareto_point(model: Model, options: Options, progress: Progress) -> RealArray:
    """Return the design that the box lies about, shape (k,) [1]: of a run, or of a quick search.

    Today's where the search has no such pick. InputError: a run that cannot be read, has no such
    pick or other variables.
    """
    space = model.space
    if options.front is not None:
        study = supplier_study(options.front, None, options.pick)
        if study.space.names != space.names:
            raise InputError(
                f"run {options.front} has the variables {list(study.space.names)}, this study "
                f"{list(space.names)}: take a front of the same platform without loss factors"
            )
        return np.asarray(study.picked)
    sample = sobol_sample(space.n_variables, SEARCH_DRAWS, seed=options.seed)
    robust = Robust(model.index, space, sample)
    search = searched(
        robust,
        Search(population=POPULATION, generations=GENERATIONS, seed=options.seed),
        progress=progress,
    )
    today = robust(space.nominal[np.newaxis])
    row = pick(search.front, today).get(options.pick)
    return np.asarray(space.nominal if row is None else search.front.designs[row])


def box_about(model: Model, point: RealArray, options: Options, progress: Progress) -> BoxStudy:
    """Find the box about a design for the limits that were stated, or for a share of its gain.

    Of the shares of the gain, `USUAL_SHARE` first, the largest that has a box.

    - raises InputError: see `box_study`.
    """
    today, new = model.response(np.stack([model.space.nominal, point]))
    if not options.of_gain:
        below = options.limit_below_today
        limit = np.full_like(today, options.limit) if below is None else today - below
        return box_study(model, point, question(model, limit, options), options, progress)
    kept, gain = USUAL_SHARE, today - new
    while True:
        limit = np.where(gain < LITTLE, new + ABOVE, today - kept * gain)
        of_gain = question(model, limit, options)
        try:
            study = box_study(model, point, of_gain, options, progress)
        except NoBoxFound:
            if kept == 0.0:
                raise
            kept = max(round(kept - STEP, 2), 0.0)
        else:
            return replace(study, gain_kept=kept)


def question(model: Model, limit: RealArray, options: Options) -> BoxQuestion:
    """Return what is asked of the box; `limit` (v,): of each vehicle [dB(A)]."""
    response, space = model.response, model.space
    return BoxQuestion(
        response,
        limit,
        options.share,
        lower=space.lower * (1.0 - space.tolerance),
        upper=space.upper * (1.0 + space.tolerance),
        weight=tolerance_cost(options.cost_table, space.names).weight,
        together=options.worst_vehicle,
        common=options.common,
    )


def box_study(
    model: Model, point: RealArray, question: BoxQuestion, options: Options, progress: Progress
) -> BoxStudy:
    """Find the box of a question, and what it is compared with.

    - raises InputError: variables that are not the mounts' stiffness factors, a share or limit that
      no box keeps.
    """
    variables = tuple(name for mount in model.runs.platform.mounts for name in mount.variables)
    if question.names != variables:
        raise InputError(
            f"the model has the variables {list(question.names)}, the mounts {list(variables)}: an "
            "acceptance box needs exactly the stiffness factors of the mounts"
        )
    seed, workers = options.seed, options.workers
    solution = largest_box(question, seed=seed, points=[point], workers=workers, progress=progress)
    return BoxStudy(
        model.runs, model.index, model.space, point, solution, seed, options.limit_below_today
    )


def share_measured_again(study: BoxStudy) -> Interval:
    """Return the share that keeps the limit, and its 90 % interval over all measurements [1].

    - raises InputError: measurements without a stated uncertainty, see `uncertain_index`.

    Noise transfer functions, stiffnesses, motions and forces are drawn again with their errors and
    the box stays as it is. The interval is pivotal, then cut to 0 and 1.
    """
    question = study.question
    places = sobol_points(
        question.n_draws, PARTS, seed=study.seed, purpose="parts of a box measured again"
    )
    parts = question.parts(study.box.ends, places)

    def share(response: MeanLevel | PeakLevel) -> float:
        within = np.asarray(response(parts)) <= question.limit
        return float(within.all(axis=1).mean() if question.together else within.mean())

    uncertain = uncertain_index(study.index, study.runs.platform, study.runs.parts)
    again = [
        share(replace(study.response, model=drawn))
        for drawn in uncertain.draws(DRAWS, seed=study.seed)
    ]
    interval = pivotal_interval(share(study.response), np.array(again), coverage=0.9)
    return replace(
        interval, lower=np.clip(interval.lower, 0.0, 1.0), upper=np.clip(interval.upper, 0.0, 1.0)
    )


def shares_of_common_factors(study: BoxStudy) -> tuple[float, float]:
    """Return the shares that keep the limit where all rubber is softer, and harder, together [1].

    Parts lie in the box; in the cars all their stiffnesses are `--common` lower, or higher.
    """
    parts = study.box.at(
        sobol_points(
            len(study.variables), PARTS, seed=study.seed, purpose="parts of a box, rubber in common"
        )
    )
    softer, harder = (
        float(study.question.part_shares(study.question.excess(factor * parts)).mean())
        for factor in (1.0 - study.question.common, 1.0 + study.question.common)
    )
    return softer, harder
