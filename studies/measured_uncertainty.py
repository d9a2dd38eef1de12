"""How surely do we know what the mounts bring, and what should be measured next?

The errors of noise transfer functions, stiffnesses, motions and forces are drawn (shared by all
designs and vehicles), the model is built again from every draw: 90 % intervals of levels, of
changes against today's, of scatter and front, probabilities, the order of directions, and what one
more measurement would narrow. Sizes come from the mount library's error budget, from vehicles that
were measured in two ways (--vehicle), or are stated priors; a table names the origin of each.

On the virtual platform the mean level is known to 0.5 dB and a change to 0.08 dB: calibrations
cancel. For any vehicle and load case it is 0.6 dB: five vehicles are few, one more brings most.

Keys of summary.json: level_db, level_half_width_db (today's, mean of the vehicles); change_db with
change_lower_db, change_upper_db, change_half_width_db, and per vehicle (best mean against today's);
probability_quieter; front_half_width_db (median); front_kept_share (points not dominated, mean over
draws); next_measurement, next_narrower_percent, and with _series for any vehicle and load case;
least_leading_share (of the directions that scatter a vehicle most).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from typer import Option

from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.report import Report
from deboom.study.made_parts import ScatterOptions
from deboom.study.measured_uncertainty import (
    MeasuredUncertainty,
    front_designs,
    measured_transfer,
    uncertainty_result,
)
from deboom.study.options import Seed, band_of
from deboom.study.platform_model import MotionOptions, Operation, PlatformOptions
from deboom.study.progress import progress_bar
from deboom.study.result import RunContext
from deboom.study.uncertain_index import UncertainIndex, uncertain_index


@dataclass(frozen=True)
class Options:
    """Which designs, and how often measurements are drawn again."""

    seed: Seed = 1
    draws: Annotated[int, Option(help="Measurements that are drawn, at least 40.")] = 200
    front: Annotated[Path | None, Option(help="Run of a front study; none: a search.")] = None
    generations: Annotated[int, Option(help="Generations of that search.")] = 40
    population: Annotated[int, Option(help="Designs per generation.")] = 60
    scatter: ScatterOptions = ScatterOptions(samples=64)
    vehicle: Annotated[list[Path] | None, Option(help="Measured in two ways; repeatable.")] = None
    ear: Annotated[str | None, Option(help="Of these vehicles; default the first.")] = None
    averaged: Annotated[bool, Option(help="The platform has means of both ways.")] = False
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()


@dataclass(frozen=True, eq=False)
class Model:
    """Levels of the vehicles, their errors, and the same in all load cases."""

    runs: Operation
    robust: RobustResponse
    uncertain: UncertainIndex
    cases: Any
    files: tuple[Path, ...]


def prepare(options: Options) -> Model:
    """Read the platform and what is known of its errors, and build its models."""
    runs = options.platform.operation()
    names = [case.name for case in runs.platform.load_cases]
    every = replace(options.platform, load_case=names).operation()
    index = options.motion.index(runs)
    made = options.scatter.made(index.variable_names)
    sample = sobol_sample(made.n_draws, options.scatter.samples, seed=options.seed)
    band = band_of(options.platform.band)
    transfer, files = measured_transfer(
        options.vehicle or [], options.ear, band, averaged=options.averaged
    )
    uncertain = uncertain_index(index, runs.platform, runs.parts, transfer)
    cases = options.motion.index(every)
    return Model(runs, made.response(index, sample), uncertain, cases, (*files, *made.inputs))


def run(model: Model, options: Options, context: RunContext | None = None) -> Report:  # noqa: ARG001
    """Choose designs, draw the measurements again and report."""
    budget = (options.population, options.generations)
    with progress_bar("NSGA-II") as bar:
        designs, points = front_designs(options.front, model.robust, *budget, options.seed, bar)
    study = MeasuredUncertainty(
        *(model.uncertain, model.robust, designs, points, model.cases, options.draws, options.seed)
    )
    with progress_bar("measuring again") as bar:
        found = study.measure_again(bar)
    report = uncertainty_result(found, model.files).report()
    model.runs.append_to(report)
    return report
