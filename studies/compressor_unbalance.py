"""Which unbalance turns inside a running compressor, and how far may the answer be believed?

The apparent mass of a hammer test without hoses, times the accelerations of first order of the
running compressor, is the load inside (thesis, 4.2 and 4.4.1). Five routes are compared: a,
measured apparent mass (thesis); b, model at the virtual point; c, self-calibrated model; d,
measured with self-calibrated sensors and impacts; e, c with mounts updated by the sweep itself.
Without --test virtual compressors are measured twice, mounts in operation as struck and changed
(−10 % real, +10 % imaginary part); the first also with mounts that soften with their amplitude and
on a flexible receiver. It is shown in detail, all are compared with their truth.

What it showed on 10 virtual compressors: what disturbs figure 61 of the thesis at 20–50 Hz is
neither noise nor conditioning but mounts that run in another state than they were struck in; the
sweep itself tells, and route e follows. See docs/validation.md for figures.

Keys of summary.json. Errors line by line, rms over lines, sweeps, y and z, medians over compressors
[%]: u_stat_error_percent_50_150, u_stat_error_percent_20_50, u_dyn_error_percent_50_150 (mounts as
struck, route d), the same with _changed_route_a and _changed_route_e (mounts changed),
u_dyn_error_percent_20_50; yz_mismatch_percent_50_150 (of u, route d). Of the fit over all lines and
pressures: u_stat_global_percent, u_dyn_global_percent, gas_moment_percent. Special cases:
softening_route_a|e_u_stat_percent_20_50|50_150, receiver_route_c|d_…, receiver_alarm. First
compressor, or that of --test: route (that counts), u_stat_g_mm, u_dyn_g_mm2 and their deviations,
sense, mounts_changed, reduced_chi (residuals over noise), remaining_chi (the same, what mounts do
beyond one common factor taken for noise), n_alarms, decision (with limits),
u_stat|u_dyn_first_error_percent (of the fit, where the truth is known), seconds (files to result).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.bench.compressor_truth import CalibrationLevel
from deboom.files.limits import read_component_limits
from deboom.report import Report
from deboom.study.compressor_unbalance import (
    STEPS,
    UnbalancePlan,
    measured_unbalance,
    unbalance_result,
    virtual_result,
    virtual_runs,
)
from deboom.study.options import Seed
from deboom.study.progress import counted, progress_bar
from deboom.study.result import RunContext

FIGURES = True
"""Whether the report has pictures."""


@dataclass(frozen=True)
class Options:
    """Which compressors run, and what they are held against."""

    seed: Seed = 1
    cases: Annotated[int, Option(help="Virtual compressors; medians deserve ten.")] = 10
    special: Annotated[bool, Option(help="Softening mounts and a flexible receiver too.")] = True
    level: Annotated[
        CalibrationLevel, Option(help="How well sensors are calibrated and placed.")
    ] = CalibrationLevel.C2
    test: Annotated[Path | None, Option(help="Folder with operation.toml.")] = None
    limits: Annotated[Path | None, Option(help="TOML file of limits of the part.")] = None
    workers: Annotated[int, Option(help="Processes beside this one; same result.")] = 2


def prepare(options: Options) -> UnbalancePlan:
    """Read the limits of the part."""
    limits = None if options.limits is None else read_component_limits(options.limits)
    return UnbalancePlan(limits=limits)


def run(plan: UnbalancePlan, options: Options, context: RunContext | None = None) -> Report:  # noqa: ARG001
    """Measure, evaluate by five routes, compare and report."""
    with progress_bar("compressor unbalance") as progress:
        if options.test is not None:
            given = measured_unbalance(options.test, plan, counted(progress, STEPS))
            inputs = given.input_files
            return unbalance_result(given, inputs=inputs, with_figures=FIGURES).report()
        seeds = range(options.seed, options.seed + options.cases)
        runs = virtual_runs(
            seeds,
            options.level,
            plan,
            progress,
            workers=options.workers,
            special=options.special,
        )
    return virtual_result(runs, with_figures=FIGURES).report()
