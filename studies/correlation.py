"""Which vehicles, and which groups of a platform, respond alike to a change of the mounts?

300 designs within ±15 % are evaluated in all vehicles, or in the vehicles of one --group (thesis,
figures 44 and 45). Correlations are computed for the designs themselves, for means over the
manufacturing tolerance, and for the scatter alone. The level of a group is the mean over its
vehicles. Vehicles whose levels correlate form families, which can share one mount set. Within one
group, one vehicle is compared with all others.

On the virtual platform the three groups correlate above 0.97. U06-1 to U06-4 correlate above 0.99
and form a family; U06-5, with its battery, correlates with them by 0.4 to 0.6 only. This fleet was
selected to show the effect; docs/validation.md says how many of 300 random fleets show it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from typer import Option

from deboom.pages.correlation import DoeRequest, Plan, correlation_report, correlation_study
from deboom.pages.motion import report_runs
from deboom.report import Report
from deboom.runs.options import Bounds, Draws, Seed, Tolerance, at_least
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.vehicles.platform import Runs


@dataclass(frozen=True)
class Options:
    """Which designs are evaluated in which vehicles."""

    seed: Seed = 1
    designs: Annotated[int, Option(help="Number of designs of a space-filling plan.")] = 300
    plan: Annotated[Plan, Option(help="Plan of the experiment.")] = Plan.latin_hypercube
    generators: Annotated[
        str | None, Option(help="Generators of a fractional plan, such as 'a b c abc'.")
    ] = None
    table: Annotated[
        Path | None, Option(help="Table of your own designs, CSV or xlsx, in place of a plan.")
    ] = None
    bounds: Bounds = 0.15
    tolerance: Tolerance = 0.15
    draws: Draws = 16
    resamples: Annotated[
        int, Option(help="Number of bootstrap resamples.", callback=at_least(100))
    ] = 1000
    cut: Annotated[float, Option(help="Smallest correlation of vehicles in one family [1].")] = 0.9
    apart: Annotated[
        str | None,
        Option(help="Vehicle to compare with all others; default: the least similar one."),
    ] = None
    platform: PlatformOptions = PlatformOptions(group=None)
    motion: MotionOptions = MotionOptions()


@dataclass(frozen=True, eq=False)
class Model:
    """The vehicles that listen, and their booming index."""

    runs: Runs
    index: Any


def prepare(options: Options) -> Model:
    """Read the platform and build its model."""
    runs = options.platform.runs()
    return Model(runs, options.motion.model(runs))


def run(model: Model, options: Options) -> Report:
    """Evaluate, correlate and report."""
    study = correlation_study(
        model.runs,
        model.index,
        DoeRequest(options.plan, options.designs, options.seed, options.generators, options.table),
        half_width=options.bounds,
        tolerance=options.tolerance,
        draws=options.draws,
        resamples=options.resamples,
        cut=options.cut,
    )
    report = correlation_report(study, options.apart)
    report_runs(report, model.runs)
    return report
