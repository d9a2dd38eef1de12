"""Identify the unbalance of a running compressor, and judge it by limits.

FOLDER contains operation.toml, the hammer test of the compressor at rest (hammer/) and speed
sweeps, as spectra of first order or as time data with a tacho. `deboom bench operation FOLDER`
writes a virtual test. Without FOLDER a virtual compressor is measured and compared with its truth:
--seed 1 has the mounts of the thesis's table 11, other seeds have random mounts.

Results: static and dynamic unbalance with their intervals, gas forces, sense of rotation, the load
inside over speed with its confidence band, the lines that cannot be trusted with the reason, the
results of five routes, tables, figures and report.html.

Check three things before you trust the result: the residuals over noise, the state of the mounts
(if it changed since the hammer test, use route e), and the hatched speeds. Agreement of y and z
proves nothing: a gas force that rotates with the rotor agrees as well.

Routes. a: measured apparent mass (thesis); b: model at the virtual point; c: self-calibrated
model; d: measured, self-calibrated; e: c with mounts brought up to date by the sweep. auto: d, or e
if the mounts have changed, no hoses are detected and the hammer test gave no alarm. --identified
takes only a run with the same hammer test. With --limits the run folder contains
supplier_sheet.html and .xlsx.

A file of limits:

\b
format = 1
risk_percent = 5.0
[static_unbalance]
at_most_g_mm = 25.0
[dynamic_unbalance]
at_most_g_mm2 = 1500.0
[[stiffness]]
direction = "x"
from_hz = 20.0
to_hz = 60.0
at_least_n_per_mm = 60.0
at_most_n_per_mm = 90.0

[[stiffness]] is |K| of the compressor on its mounts at the origin of the position sheet;
[[rotational_stiffness]] has directions rx, ry, rz and at_most_n_m_per_rad. A part passes if its
value is inside the limit by a guard band, so that a bad part passes with a probability of at most
risk_percent. It fails if its value is outside. Between the two it is undecided, and the sheet says
what would decide.

Figure 61 of the thesis is disturbed at 20–50 Hz. On virtual compressors the reason is neither noise
nor conditioning: in operation the mounts have another state than in the hammer test. The sweep
shows this, and route e corrects it. docs/validation.md has the errors of many compressors.

The last line of the output is the run folder; before it, with limits, the verdict.

Try: deboom bench operation test, then deboom unbalance test --limits limits.toml
"""  # noqa: D301 - a real backspace keeps the lines of the file apart in the help

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, Option

from deboom.bench.choices import CalibrationLevel, CompressorCase
from deboom.bench.compressor_rig import OperationPlan
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_operating_test
from deboom.compressor.acceptance import overall
from deboom.compressor.unbalance import SofteningLaw, UnbalanceOptions
from deboom.compressor.unbalance_load import RotationSense
from deboom.files.limits import read_component_limits
from deboom.measurement.compressor_test import HoseState
from deboom.pages.unbalance import unbalance_report
from deboom.progress import counted, progress_bar
from deboom.report import Report
from deboom.runs.compressor_tests import UNBALANCE_STEPS, UnbalancePlan, measured_unbalance
from deboom.runs.options import BAND, ComponentLimitsFile, Level, WithTruth, band_of
from deboom.runs.result import RunContext

QUESTION = "Which unbalance turns inside this compressor?"


@dataclass(frozen=True)
class Options:
    """Which sweeps are evaluated, how, and by which limits the part is judged."""

    folder: Annotated[
        Path | None, Argument(help="Folder with operation.toml; default: a virtual compressor.")
    ] = None
    seed: Annotated[int, Option(help="Seed of the virtual compressor, 1 or higher.")] = 1
    level: Level = CalibrationLevel.C2
    limits: ComponentLimitsFile = None
    route: Annotated[
        Literal["auto", "a", "b", "c", "d", "e"], Option(help="Route of the result.")
    ] = "auto"
    identified: Annotated[
        Path | None, Option(help="Run of `deboom identify`; its bands are fitted again.")
    ] = None
    hoses: Annotated[
        Literal["soft", "standard"] | None,
        Option(help="Hoses of the evaluated sweeps; default: soft."),
    ] = None
    sense: Annotated[
        Literal["positive", "negative"] | None,
        Option(help="Sense of rotation about x that the sweeps must show; default: any."),
    ] = None
    band: Annotated[str, Option(metavar=BAND, help="Band of the fit over all sweeps [Hz].")] = (
        "17-150"
    )
    confidence: Annotated[float, Option(help="Confidence of bands and intervals.")] = 0.95
    softening: Annotated[
        SofteningLaw, Option(help="Law of softening over the stroke of each mount, for route e.")
    ] = SofteningLaw.PARABOLA
    truth: WithTruth = False


def prepare(options: Options) -> UnbalancePlan:
    """Read the limits of the part, and say how the sweeps are evaluated."""
    how = UnbalanceOptions(
        hoses=None if options.hoses is None else HoseState(options.hoses),
        expected_sense=None if options.sense is None else RotationSense[options.sense.upper()],
        band=band_of(options.band),
        confidence=options.confidence,
        softening=options.softening,
    )
    return UnbalancePlan(
        route=options.route,
        unbalance=how,
        limits=None if options.limits is None else read_component_limits(options.limits),
        identified=options.identified,
        truth=options.truth,
    )


def run(plan: UnbalancePlan, options: Options, context: RunContext | None = None) -> Report:
    """Evaluate by five routes, report, and say the verdict on the part."""
    command = "" if context is None else context.command
    with progress_bar("unbalance") as progress:
        step = counted(progress, UNBALANCE_STEPS)
        if options.folder is not None:
            measured = measured_unbalance(options.folder, plan, step)
            if measured.verdicts:
                print(overall(measured.verdicts).value)
            return unbalance_report(measured, measured.input_files, command=command)
        print(f"no FOLDER: the virtual compressor of seed {options.seed}", file=sys.stderr)
        case = CompressorCase.TABLE11 if options.seed == 1 else CompressorCase.RANDOM
        virtual = OperationPlan(CompressorPlan(case=case))
        with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
            folder = write_operating_test(
                Path(scratch) / "test", options.seed, options.level, virtual
            )
            measured = measured_unbalance(folder, replace(plan, truth=True), step)
            return unbalance_report(measured, command=command)
