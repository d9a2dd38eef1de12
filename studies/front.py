"""Which mount stiffnesses make a fleet quiet, also with parts that scatter?

NSGA-II varies the stiffness factors of all mounts. The objectives are the sums over the vehicles of
mean SPLV and of its sigma. The front then converges along gradients and is verified with draws that
the search never saw. If the data allow it, the motion of the powertrain is solved for each design
(coupled motion).

PLATFORM is a folder with platform.toml; without it the demonstration is searched, whose group U06
has twelve stiffness factors: engine mount, gearbox mount, torque strut (TSM) and wishbone mounts
(Du).

--with puts further questions to the same model, separated by commas. correlation: which vehicles
and groups go together, over a DOE? sensitivity: which stiffness matters (Sobol indices)?
prescribed: what does a search with the measured motion promise, which runs first, and whose picks
the search begins with? none: nothing further. The pages of the studies correlation and sensitivity
show more.

Result of the demonstration with seed 1: -3.1 to -3.6 dB per line in U06-1 to U06-4, and -2.0 in
U06-5. The thesis's figure 47 differs in two points: its fifth vehicle hardly changes, and its
fourth vehicle loses its peak at 37 Hz. Here each of today's peaks falls by 3.4 to 4.8 dB and
remains. The bodies of the shipped vehicles are random. The thesis searched with --motion
prescribed --sampler fresh --samples 100.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from typer import Option

from deboom.errors import InputError
from deboom.explore.robust import Robust
from deboom.files.design_limits import files_of_limits, read_level_limits, read_mount_limits
from deboom.files.made_parts import MadeParts
from deboom.pages.correlation import DoeRequest, Plan, correlation_report, correlation_study
from deboom.pages.front import report_parts
from deboom.pages.limits import report_limits
from deboom.pages.motion import report_runs
from deboom.pages.platform_front import PlatformFront
from deboom.pages.robust_front import Question, front_report, report_answers
from deboom.pages.sensitivity import Analysis, SensitivityPlan, sensitivity, sensitivity_report
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.options import (
    AimOptions,
    Sampler,
    ScatterOptions,
    Seed,
    at_least,
    robust_response,
    tolerance_sample,
)
from deboom.runs.platform_options import MotionOptions, PlatformOptions, in_all_load_cases
from deboom.runs.result import RunContext, run_name
from deboom.runs.search import (
    PeakRiseOption,
    ThoroughSearchOptions,
    check_peak_rise,
    peak_rise_limits,
)
from deboom.runs.second_process import begun
from deboom.vehicles.booming_model import BoomingModel, Motion
from deboom.vehicles.platform import Runs

FAMILY = 0.9
"""Least correlation within a family of vehicles [1]."""
SECOND_RANGE = 0.20
"""Half width of the second range of the sensitivities, for comparison [1]."""


@dataclass(frozen=True)
class FurtherOptions:
    """Options of the further questions."""

    with_: Annotated[
        str,
        Option(
            "--with",
            metavar="QUESTION,...",
            help=f"Further questions to the model: {', '.join(Question)}, or none.",
        ),
    ] = f"{Question.correlation},{Question.sensitivity}"
    doe: Annotated[
        int,
        Option(
            help="Number of designs of the correlation, a power of two.",
            callback=at_least(8, power_of_two=True),
        ),
    ] = 256
    draws: Annotated[
        int, Option(help="Number of draws of the scatter for each of them, a power of two.")
    ] = 16
    n: Annotated[
        int,
        Option(
            help="Number of base points of the sensitivities, a power of two.",
            callback=at_least(8, power_of_two=True),
        ),
    ] = 1024
    resamples: Annotated[
        int, Option(help="Number of bootstrap resamples for all intervals.", callback=at_least(100))
    ] = 200
    half_width: Annotated[
        float,
        Option(help="Half width of the range of factors around 1 in both [1]."),
    ] = 0.15

    @property
    def questions(self) -> frozenset[Question]:
        """What ``--with`` names.

        - raises InputError: a name that is no question.
        """
        names = [name.strip() for name in self.with_.split(",")]
        for name in names:
            if name not in {*Question, "none"}:
                raise InputError(
                    f"--with {self.with_}: {name or 'an empty name'} is no question; write "
                    f"{', '.join(Question)}, with commas between, or none"
                )
        return frozenset(Question(name) for name in names if name != "none")


@dataclass(frozen=True)
class Options:
    """What is searched for, under which scatter, and for how long."""

    COMMON: ClassVar[tuple[str, ...]] = (
        "group",
        "load_case",
        "band",
        "motion",
        "bounds",
        "tolerance",
        "parts",
        "limits",
        "peak_rise",
        "also",
        "with_",
        "generations",
        "workers",
        "seed",
    )
    """Options that ``--help`` shows; ``--help-all`` shows every one."""

    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()
    scatter: ScatterOptions = ScatterOptions()
    limits: Annotated[
        Path | None,
        Option(help="TOML file with limits of sag, travel, modes and levels of vehicles."),
    ] = None
    peak_rise: PeakRiseOption = None
    target: Annotated[
        float | None,
        Option(help="Target level of a car [dB(A)].", show_default="each vehicle's of today"),
    ] = None
    further: FurtherOptions = FurtherOptions()
    search: ThoroughSearchOptions = ThoroughSearchOptions(generations=30)
    aims: AimOptions = AimOptions()
    sampler: Annotated[
        Sampler,
        Option(help="Method of the draws of the scatter; fresh is the method of the thesis."),
    ] = Sampler.sobol
    loss_factors: Annotated[
        bool, Option(help="Take the loss factors, ±20 %, as further variables.")
    ] = False
    seed: Seed = 1

    def __post_init__(self) -> None:
        check_peak_rise(self.peak_rise)
        self.further.questions  # noqa: B018 - a name that is no question is refused before any work


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles under scattering parts, within limits.

    - `everyone`: all vehicles of the questions; `runs`: those that are searched for.
    """

    everyone: Runs
    runs: Runs
    index: BoomingModel
    made: MadeParts
    robust: Robust


def prepare(options: Options) -> Model:
    """Read the platform and build its model."""
    platform = options.platform
    if Question.correlation in options.further.questions:
        platform = replace(platform, group=None)
    everyone = platform.runs()
    runs = replace(everyone, fleet=options.platform.served(everyone.fleet))
    index = options.motion.model(runs, loss_factors=options.loss_factors)
    made = options.scatter.made(index.variable_names)
    samples = options.scatter.samples
    sample = tolerance_sample(options.sampler, made.n_draws, samples, seed=options.seed)
    limits = (
        *read_level_limits(options.limits, index),
        *read_mount_limits(options.limits, runs, made.space, options.motion.factor),
        *peak_rise_limits(options.peak_rise, index, made.space.nominal),
    )
    robust = robust_response(
        index, made.space, sample, aims=options.aims, structure=made.structure, limits=limits
    )
    return Model(everyone, runs, index, made, robust)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Search, verify, answer the further questions, and report."""
    questions, runs = options.further.questions, model.runs
    # the second process compiles slopes, ranks stiffnesses and draws clouds while this one searches
    second = context.second if context is not None else None
    if options.search.polish:
        begun(second, model.index.compile_slopes)
    rank = partial(sensitivity, runs.platform, model.index, _plan(options))
    ranking = begun(second, rank) if Question.sensitivity in questions else None
    parts: dict[str, Report] = {}
    if Question.correlation in questions:
        parts |= _correlations(model, options)
    if second is not None:
        second.draw(picture for part in parts.values() for picture in part.every_picture)

    front = _searched(model, options, context)
    report = front_report(front)
    begin = (options.search.begin,) if options.search.begin else ()
    inputs = (*files_of_limits(options.limits, runs), *begin)
    report.inputs += [path for path in dict.fromkeys(inputs) if path not in report.inputs]
    report_limits(report, front.front)
    if ranking is not None:
        with progress_bar("sensitivity") as bar:
            parts[Question.sensitivity] = sensitivity_report(ranking.result(partial(rank, bar)))
    report_answers(report, parts, questions)
    report_parts(report, model.made)
    report_runs(report, model.everyone)
    return report


def _searched(model: Model, options: Options, context: RunContext | None) -> PlatformFront:
    """Search with prescribed motion where that is a question, then with the motion of the model."""
    runs = model.runs
    of_limits = files_of_limits(options.limits, runs)
    search = partial(
        options.search.verified,
        seed=options.seed,
        run=context,
        inputs=(*runs.platform.input_files, *of_limits, *model.made.inputs),
    )
    prescribed, begin = None, None
    if (
        Question.prescribed in options.further.questions
        and model.index.motion is not Motion.prescribed
    ):
        motion = MotionOptions(Motion.prescribed)
        as_measured = motion.model(runs, loss_factors=options.loss_factors)
        # of a model with other levels, limits of levels could leave no design
        limits = model.robust.limits.of_designs.stated
        robust = robust_response(
            as_measured,
            model.made.space,
            model.robust.sample,
            aims=options.aims,
            structure=model.made.structure,
            limits=limits,
        )
        prescribed = search(robust, name="prescribed")
        begin = np.unique(np.stack(list(prescribed.pick_designs.values())), axis=0)
    return PlatformFront(
        front=search(model.robust, begin=begin),
        runs=runs,
        every=in_all_load_cases(
            options.platform, runs, options.motion, loss_factors=options.loss_factors
        ),
        prescribed=prescribed,
        target=options.target,
        run=run_name(context, "front"),
    )


def _plan(options: Options) -> SensitivityPlan:
    """Return what the sensitivities vary."""
    return SensitivityPlan(
        analysis=Analysis.design,
        half_width=options.further.half_width,
        beside=SECOND_RANGE,
        tolerance=options.scatter.tolerance,
        n_base=options.further.n,
        n_resamples=options.further.resamples,
        seed=options.seed,
    )


def _correlations(model: Model, options: Options) -> Iterator[tuple[str, Report]]:
    """Yield which vehicles of the platform go together, and which of those that are searched."""
    everyone = options.motion.model(model.everyone, loss_factors=options.loss_factors)
    if len(everyone.response_names) < 2:
        return
    study = correlation_study(
        model.everyone,
        everyone,
        DoeRequest(Plan.sobol, options.further.doe, options.seed),
        half_width=options.further.half_width,
        tolerance=options.scatter.tolerance,
        draws=options.further.draws,
        resamples=options.further.resamples,
        cut=FAMILY,
    )
    yield Question.correlation, correlation_report(study)
    within = study.within(model.runs, model.index)
    if within is not None:
        yield f"{Question.correlation}_within_group", correlation_report(within)
