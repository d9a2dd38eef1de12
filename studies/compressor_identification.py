"""Does a roving-hammer test on the mounted compressor tell its mass, inertia and mounts?

The model is a rigid body on rubber mounts with a complex gain (thesis, 4.1 to 4.4), measured with
six accelerometers and 18 impacts. Centre of gravity, inertia, the stiffness at the virtual point
and the gain are fitted to the raw FRFs, together with all errors of gain, position and angle
(self-calibration). The mass is weighed. Without --test a virtual compressor is measured: seed 1 has
the mounts of the thesis's table 11, other seeds have random mounts. Its truth is used only for
comparison.

On virtual compressors the placement of sensors limits the accuracy, not noise (docs/validation.md).
Such a test can identify only 35 combinations of the thesis's 44 parameters. Position, rotation and
stiffness of single mounts cannot be identified, unless all mounts are one round part
(--identical-mounts).

Keys of summary.json: mass_kg; cog_error_mm, inertia_error_percent (worst moment),
k_vp_error_percent; jacobian_rank (of the thesis's 44 numbers); reduced_chi2 (residuals over noise,
squared; alarm above 2.25); n_alarms; condition_scaled_100hz (of the measured inertance, rotations
scaled by the radius of gyration); seconds (of the identification). Errors are left out where the
truth is not known, the rank without a drawing.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.choices import CalibrationLevel
from deboom.compressor.identification import IdentifyOptions
from deboom.measurement.compressor_test import InertanceTest
from deboom.pages.compressor_identification import (
    STEPS,
    Beside,
    CompressorTruth,
    identified_test,
    identified_virtual,
    read_test,
)
from deboom.pages.identification import identification_report
from deboom.progress import counted, progress_bar
from deboom.report import Report
from deboom.runs.options import IdenticalMounts, Level, Seed
from deboom.runs.result import RunContext


@dataclass(frozen=True)
class Options:
    """Which compressor is identified, and what is fitted beside."""

    seed: Seed = 1
    level: Level = CalibrationLevel.C2
    test: Annotated[Path | None, Option(help="Folder with compressor_test.toml.")] = None
    identical_mounts: IdenticalMounts = False


def prepare(options: Options) -> tuple[InertanceTest, CompressorTruth | None] | None:
    """Read the given test; None where a virtual compressor is to be measured."""
    return None if options.test is None else read_test(options.test)


def run(
    given: tuple[InertanceTest, CompressorTruth | None] | None,
    options: Options,
    context: RunContext | None = None,  # noqa: ARG001
) -> Report:
    """Measure, identify, compare and report."""
    beside = Beside(identical_mounts=options.identical_mounts)
    with progress_bar("compressor identification") as progress:
        step = counted(progress, STEPS)
        if given is None:
            test = identified_virtual(options.seed, options.level, beside, step)
            return identification_report(test)
        test = identified_test(*given, IdentifyOptions(), beside, step, options.test)
        return identification_report(test, test.input_files)
