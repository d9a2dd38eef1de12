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
softening_route_…, receiver_route_…, receiver_alarm. First compressor, or that of --test: route
(that counts), u_stat_g_mm, u_dyn_g_mm2, u_stat_deviation_g_mm, u_dyn_deviation_g_mm2, sense,
mounts_changed, reduced_chi (residuals over noise), remaining_chi (the same, what mounts do beyond
one common factor taken for noise), n_alarms, decision (with limits), u_stat_first_error_percent,
u_dyn_first_error_percent (of the fit, where the truth is known), seconds (files to result).
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
from typer import Option

from deboom import plot
from deboom.choices import CalibrationLevel
from deboom.compressor.routes import (
    CALIBRATED_MEASUREMENT,
    CALIBRATED_MODEL,
    MEASURED,
    UPDATED,
)
from deboom.compressor.unbalance import UnbalanceOptions
from deboom.errors import InputError
from deboom.files.limits import read_component_limits
from deboom.report import Report
from deboom.study.compressor_unbalance import (
    BANDS,
    STEPS,
    CompressorTask,
    MeasuredUnbalance,
    MountCase,
    UnbalancePlan,
    band_words,
    case_errors,
    evaluated_case,
    measured_unbalance,
    task_errors,
    write_case,
)
from deboom.study.options import Seed
from deboom.study.progress import Progress, counted, in_processes, progress_bar
from deboom.study.result import RunContext
from deboom.study.unbalance_report import unbalance_report

ROUTES = UnbalanceOptions(routes=(MEASURED, CALIBRATED_MEASUREMENT, UPDATED))
"""Routes a, d and e, by which all compressors are evaluated; the first one by all five."""
SPECIAL_ROUTES = replace(ROUTES, routes=(*ROUTES.routes, CALIBRATED_MODEL))
"""Those of softening mounts and a flexible receiver: route c as well."""
LOW, HIGH = map(band_words, BANDS)
BOTH_STATES = (MountCase.UNCHANGED, MountCase.CHANGED)


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

    def __post_init__(self) -> None:
        if self.cases < 1:
            raise InputError(f"--cases {self.cases}: ask for at least one compressor")


def prepare(options: Options) -> UnbalancePlan:
    """Read the limits of the part."""
    limits = None if options.limits is None else read_component_limits(options.limits)
    return UnbalancePlan(limits=limits)


def run(plan: UnbalancePlan, options: Options, context: RunContext | None = None) -> Report:
    """Measure, evaluate by five routes, compare and report."""
    del context  # nothing here can be resumed
    with progress_bar("compressor unbalance") as progress:
        if options.test is not None:
            measured = measured_unbalance(options.test, plan, counted(progress, STEPS))
            return unbalance_report(measured, measured.input_files)
        first, errors = _measured(plan, options, progress)
    report = unbalance_report(first)
    report.section(
        "All virtual compressors, against their truth",
        "Every compressor was measured twice: mounts in operation as struck, and with real part "
        "−10\u00a0%, imaginary part +10\u00a0% of their stiffness. The first one also with mounts "
        "that soften with their amplitude, under the hammer as in operation, and on a flexible "
        "receiver with a mode inside the band. Errors are rms over lines, sweeps, y and z, "
        "relative to the true unbalance; the truth includes the rotating gas force. Global: error "
        "of the fit over all lines and both pressures. Medians over the compressors.",
        folded=True,
    )
    report.figure(
        "errors",
        lambda: _error_figure(errors),
        "Errors of static and dynamic unbalance, line by line: median, smallest and largest of all "
        "virtual compressors.",
    )
    medians = _medians(errors)
    mismatches = [f"y/z {band} [%]" for band in (LOW, HIGH)]
    shown = medians.drop(columns=mismatches)
    report.table("errors", medians, "Median errors by state and route.", shown=shown)
    report.table("cases", errors.drop(columns=mismatches))
    report.summary |= error_summary(errors)
    return report


def _measured(
    plan: UnbalancePlan, options: Options, progress: Progress
) -> tuple[MeasuredUnbalance, pd.DataFrame]:
    """Return the first virtual compressor in detail, and the errors of all in their states."""
    seed, level = options.seed, options.level
    others = range(seed + 1, seed + options.cases)
    tasks = [CompressorTask(other, level, BOTH_STATES, ROUTES) for other in others]
    if options.special:
        tasks += [
            CompressorTask(seed, level, (case,), SPECIAL_ROUTES)
            for case in (MountCase.SOFTENING, MountCase.RECEIVER)
        ]
    total = len(tasks) + len(BOTH_STATES)
    with (
        in_processes(task_errors, tasks, options.workers) as results,
        tempfile.TemporaryDirectory(prefix="deboom-") as scratch,
    ):
        struck, moved = (
            write_case(Path(scratch) / case.name.lower(), seed, level, case) for case in BOTH_STATES
        )
        progress(0, total, "first compressor")
        first = measured_unbalance(struck, replace(plan, truth=True), lambda _: None)
        assert first.truth is not None
        progress(1, total, "first compressor, mounts changed")
        hammer = first.evaluation.identification
        rows = case_errors(seed, MountCase.UNCHANGED, first.evaluation, first.truth)
        changed, truth = evaluated_case(moved, hammer, plan.unbalance)
        rows += case_errors(seed, MountCase.CHANGED, changed, truth)
        for number, more in enumerate(results, start=len(BOTH_STATES)):
            progress(number, total, "other compressors")
            rows += more
    progress(total, total, "done")
    return first, pd.DataFrame(rows)


def error_summary(errors: pd.DataFrame) -> dict[str, float | str]:
    """Headline errors, medians over the compressors [%]; the docstring above has the keys."""

    def median(case: MountCase, letter: str, column: str) -> float:
        return float(_rows(errors, case, letter)[f"{column} [%]"].median())

    summary: dict[str, float | str] = {}
    for suffix, case, letter in (
        ("", MountCase.UNCHANGED, "d"),
        ("_changed_route_a", MountCase.CHANGED, "a"),
        ("_changed_route_e", MountCase.CHANGED, "e"),
    ):
        summary |= {
            f"u_stat_error_percent_50_150{suffix}": median(case, letter, f"u {HIGH}"),
            f"u_stat_error_percent_20_50{suffix}": median(case, letter, f"u {LOW}"),
            f"u_dyn_error_percent_50_150{suffix}": median(case, letter, f"u_d {HIGH}"),
        }
    for name, column in {
        "u_dyn_error_percent_20_50": f"u_d {LOW}",
        "u_stat_global_percent": "u, global",
        "u_dyn_global_percent": "u_d, global",
        "gas_moment_percent": "gas moment, global",
        "yz_mismatch_percent_50_150": f"y/z {HIGH}",
    }.items():
        summary[name] = median(MountCase.UNCHANGED, "d", column)
    for prefix, case, letter in (
        ("softening_route_a", MountCase.SOFTENING, "a"),
        ("softening_route_e", MountCase.SOFTENING, "e"),
        ("receiver_route_d", MountCase.RECEIVER, "d"),
        ("receiver_route_c", MountCase.RECEIVER, "c"),
    ):
        if not _rows(errors, case, letter).empty:
            summary[f"{prefix}_u_stat_percent_20_50"] = median(case, letter, f"u {LOW}")
            summary[f"{prefix}_u_stat_percent_50_150"] = median(case, letter, f"u {HIGH}")
    receiver = _rows(errors, MountCase.RECEIVER, "d")
    if not receiver.empty:
        summary["receiver_alarm"] = "yes" if receiver["alarm"].any() else "no"
    return summary


def _medians(errors: pd.DataFrame) -> pd.DataFrame:
    """Write medians by state and route."""
    columns = [f"{name} {band} [%]" for band in (LOW, HIGH) for name in ("u", "u_d", "y/z")]
    columns += ["u, global [%]", "u_d, global [%]"]
    groups = errors.groupby(["mounts", "route"])
    medians = groups[columns].median()
    medians.insert(0, "compressors", groups.size())
    places = {case.value: place for place, case in enumerate(MountCase)}
    medians = medians.reset_index()  # by route
    return medians.sort_values("mounts", key=lambda names: names.map(places), kind="stable")


def _error_figure(errors: pd.DataFrame) -> plot.Figure:
    """Draw the errors of every compressor, by route and state."""
    states = {"as struck": MountCase.UNCHANGED, "changed": MountCase.CHANGED}
    panels = []
    for name in ("u", "u_d"):
        for band in (LOW, HIGH):
            groups = {
                state: tuple(
                    np.transpose(
                        [
                            _rows(errors, case, letter)[f"{name} {band} [%]"].quantile([0.5, 0, 1])
                            for letter in "ade"
                        ]
                    )
                )
                for state, case in states.items()
            }
            panels.append(plot.IntervalPanel(f"{name}, {band} [%]", groups))
    return plot.interval_panels([f"route {letter}" for letter in "ade"], panels)


def _rows(errors: pd.DataFrame, case: MountCase, letter: str) -> pd.DataFrame:
    """Errors of all compressors in one state by one route."""
    return errors[(errors["mounts"] == case.value) & (errors["route"] == letter)]
