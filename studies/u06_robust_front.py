"""Which mount stiffnesses make the U06 vehicles quiet, and keep them so as parts scatter?

NSGA-II over the 12 stiffness factors of engine, gearbox, strut (TSM), wishbone (Du): sums over the
vehicles of mean SPLV, 20 to 60 Hz, and of its sigma. Softer TSM and Du take 2.5 to 3 dB per line
off (seed 1). Keys of summary.json: splv_change_db_per_line_<vehicle>,
energy_25_40hz_change_db_<vehicle> (best mean, no scatter); sigma_change_percent_best_sigma;
sigma_bias_percent, mean_bias_db_per_line (search - verification); surface_difference_at_peaks_db;
design_factor; held_*_share (beyond data); n_front, n_evaluated, n_failed,
n_beyond_limits, seconds_search.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.explore.front import verify
from deboom.explore.robust import RobustResponse
from deboom.report import Report
from deboom.study.made_parts import MadeParts, ScatterOptions
from deboom.study.options import Aim, Sampler, Seed, tolerance_sample
from deboom.study.platform_model import MotionOptions, Operation, PlatformOptions
from deboom.study.result import RunContext
from deboom.study.robust_front import RobustFront, front_report
from deboom.study.search import MountLimits, ThoroughSearchOptions, mount_limits

VERIFIED = 1024
"""Draws behind every verified number."""


@dataclass(frozen=True)
class Options:
    """What is searched for, under which scatter, and for how long."""

    seed: Seed = 1
    search: ThoroughSearchOptions = ThoroughSearchOptions()
    scatter: ScatterOptions = ScatterOptions()
    sampler: Annotated[Sampler, Option(help="Tolerance draws; fresh: the thesis.")] = Sampler.sobol
    objective: Annotated[Aim, Option(help="What is minimised.")] = Aim.mean
    nominal_mean: Annotated[bool, Option(help="Level of the design itself as mean.")] = False
    control_variate: Annotated[bool, Option(help="Mean and sigma by regression.")] = False
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()
    loss_factors: Annotated[bool, Option(help="Loss factors ±20 % are variables too.")] = False
    limits: Annotated[Path | None, Option(help="TOML: sag, travel, modes to keep.")] = None


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles under scattering parts, and what designs must keep."""

    runs: Operation
    made: MadeParts
    robust: RobustResponse
    limits: MountLimits


def prepare(options: Options) -> Model:
    """Read the platform and build its model."""
    runs = options.platform.operation()
    index = options.motion.index(runs, loss_factors=options.loss_factors)
    made = options.scatter.made(index.variable_names)
    samples = options.scatter.samples
    sample = tolerance_sample(options.sampler, made.n_draws, samples, seed=options.seed)
    aims = (options.objective, options.nominal_mean, options.control_variate)
    robust = made.response(index, sample, *aims)
    limits = mount_limits(options.limits, runs, robust, options.motion.factor)
    return Model(runs, made, robust, limits)


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:
    """Search, verify and report."""
    platform = model.runs.platform
    search = options.search.front(
        model.robust,
        options.seed,
        context,
        (*platform.input_files, *model.limits.inputs, *model.made.inputs),
        limits=model.limits,
    )
    check = verify(search.front, model.robust, n_samples=VERIFIED, seed=options.seed)
    front = RobustFront(model.robust, search, check, options.search.budget.note, platform=platform)
    report = front_report(front)
    model.limits.append_to(report, search, front.named_designs)
    model.made.append_to(report)
    model.runs.append_to(report)
    return report
