"""On which mount stiffnesses does the booming noise of the U06 vehicles depend?

Sobol indices of the stiffness factors (the thesis's figure 48) say which share of the variance of a
vehicle's level, 20 to 60 Hz, comes from each stiffness: alone, together with others, per mount, and
per frequency line. There are two analyses: design (uniform within a range, by default ±15 %, and
±20 % for comparison) and tolerance (Gaussian, truncated at 3 sigma). The page ranks the chosen
analysis and shows the other one for comparison.

On the virtual platform TSM x matters most in U06-1 to U06-4, then Du x. In U06-5, the vehicle with
the battery, GeM x matters most, then Du x and TSM x; with prescribed motion, which is the thesis's,
TSM x is second. Du y and z have no path to the cabin, so their indices are exactly 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from typer import Option

from deboom.pages.motion import report_runs
from deboom.pages.sensitivity import Analysis, SensitivityPlan, sensitivity, sensitivity_report
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.options import Seed, Tolerance, at_least
from deboom.runs.platform_options import MotionOptions, PlatformOptions
from deboom.runs.result import RunContext
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.platform import Runs


@dataclass(frozen=True)
class Options:
    """What varies and how far, and from how many points."""

    seed: Seed = 1
    n: Annotated[int, Option(help="Number of base points, a power of two.")] = 1024
    resamples: Annotated[
        int, Option(help="Number of bootstrap resamples for the intervals.", callback=at_least(2))
    ] = 100
    analysis: Annotated[
        Analysis,
        Option(help="Variation of the stiffnesses: design (uniform range) or tolerance (scatter)."),
    ] = Analysis.design
    bounds: Annotated[float, Option(help="Half width of the range of the design analysis [1].")] = (
        0.15
    )
    beside: Annotated[float, Option(help="Half width of a second range, for comparison [1].")] = (
        0.20
    )
    tolerance: Tolerance = 0.15
    pairs: Annotated[
        bool, Option(help="Also compute the second-order indices of pairs of stiffnesses.")
    ] = False
    platform: PlatformOptions = PlatformOptions()
    motion: MotionOptions = MotionOptions()


def prepare(options: Options) -> Runs:
    """Read the platform."""
    return options.platform.runs()


def run(runs: Runs, options: Options, context: RunContext | None = None) -> Report:  # noqa: ARG001
    """Evaluate, analyse and report."""
    plan = SensitivityPlan(
        options.analysis,
        options.bounds,
        options.beside,
        options.tolerance,
        n_base=options.n,
        n_resamples=options.resamples,
        seed=options.seed,
        pairs=options.pairs,
    )
    index, prescribed = options.motion.model(runs), None
    if index.motion is not Motion.prescribed:
        prescribed = MotionOptions(Motion.prescribed).model(runs)
    with progress_bar("sensitivity") as bar:
        analysis = sensitivity(runs.platform, index, plan, bar, prescribed=prescribed)
    report = sensitivity_report(analysis)
    report_runs(report, runs)
    return report
