"""Which unbalance turns inside a running compressor, and how reliable is the answer?

The load inside the compressor is the apparent mass from a hammer test without hoses, times the
accelerations of first order in operation (thesis, 4.2 and 4.4.1). Five routes are compared: a,
measured apparent mass (thesis); b, model at the virtual point; c, self-calibrated model; d,
measured apparent mass with self-calibrated sensors and impacts; e, route c with mounts updated by
the sweep. Without --test a virtual compressor is measured and compared with its truth.

Figure 61 of the thesis is disturbed at 20–50 Hz. On virtual compressors the reason is neither noise
nor conditioning: in operation the mounts have another state than in the hammer test. The sweep
shows this, and route e corrects it. docs/validation.md has the errors of many compressors.

Keys of summary.json: route (that counts), u_stat_g_mm, u_dyn_g_mm2, u_stat_deviation_g_mm,
u_dyn_deviation_g_mm2, sense, mounts_changed, reduced_chi (residuals over noise), remaining_chi (the
same, what mounts do beyond one common factor taken for noise), n_alarms, decision (with limits),
u_stat_first_error_percent, u_dyn_first_error_percent (of the fit, where the truth is known),
seconds (files to result).
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.bench.compressor_rig import OperationPlan
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_operating_test
from deboom.choices import CalibrationLevel, CompressorCase
from deboom.files.limits import read_component_limits
from deboom.pages.compressor_unbalance import STEPS, UnbalancePlan, measured_unbalance
from deboom.pages.unbalance import unbalance_report
from deboom.progress import counted, progress_bar
from deboom.report import Report
from deboom.runs.options import ComponentLimitsFile, Level, Seed


@dataclass(frozen=True)
class Options:
    """Which compressor runs, and by which limits it is judged."""

    seed: Seed = 1
    level: Level = CalibrationLevel.C2
    test: Annotated[Path | None, Option(help="Folder with operation.toml.")] = None
    limits: ComponentLimitsFile = None


def prepare(options: Options) -> UnbalancePlan:
    """Read the limits of the part."""
    limits = None if options.limits is None else read_component_limits(options.limits)
    return UnbalancePlan(limits=limits)


def run(plan: UnbalancePlan, options: Options) -> Report:
    """Measure, evaluate by five routes, compare and report."""
    with progress_bar("compressor unbalance") as bar:
        progress = counted(bar, STEPS)
        if options.test is not None:
            measured = measured_unbalance(options.test, plan, progress)
            return unbalance_report(measured, measured.input_files)
        case = CompressorCase.TABLE11 if options.seed == 1 else CompressorCase.RANDOM
        virtual = OperationPlan(CompressorPlan(case=case))
        with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
            folder = Path(scratch) / "test"
            write_operating_test(folder, options.seed, options.level, virtual)
            return unbalance_report(measured_unbalance(folder, replace(plan, truth=True), progress))
