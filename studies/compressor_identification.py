"""Does a roving-hammer test on the mounted compressor tell its mass, inertia and mounts?

Six accelerometers and 18 impacts, a rigid body on rubber mounts with a complex gain (thesis, 4.1 to
4.4). Mass, centre of gravity, inertia, the stiffness at the virtual point and the gain are fitted
to the raw FRFs together with all errors of gain, place and angle (self-calibration), the mass
weighed. Without --test virtual compressors are measured: the first has the mounts of the thesis's
table 11 and is shown in detail, the others are random; their truth is used for comparison alone.

What it showed on 20 virtual compressors: placement limits the result, not noise. The thesis's 44
numbers are 35 to any such test; positions, rotations and stiffnesses of single mounts are not seen
unless all mounts are one round part (--identical-mounts).

Keys of summary.json: mass_kg (first compressor); cog_error_mm, inertia_error_percent (worst
moment), k_vp_error_percent (90 % quantiles over the compressors); jacobian_rank (of the thesis's 44
numbers); reduced_chi2 (residuals over noise, squared; alarm above 2.25); condition_scaled_100hz (of
the measured inertance, rotations scaled by the radius of gyration); seconds (identification of one
compressor). Errors are left out where the truth is not known, the rank without a drawing.
"""

from pathlib import Path
from typing import Annotated

from typer import Option

from deboom.bench.compressor_truth import CalibrationLevel
from deboom.compressor.identify import IdentifyOptions
from deboom.study.compressor_identification import (
    Beside,
    compressor_result,
    identified_folder,
    identified_virtual,
)
from deboom.study.progress import progress_bar
from deboom.study.result import StudyResult
from deboom.study.runner import run_script


def main(
    seed: Annotated[int, Option(help="From 1: first compressor; 1 is that of table 11.")] = 1,
    cases: Annotated[int, Option(help="Virtual compressors; quantiles deserve twenty.")] = 4,
    level: Annotated[
        CalibrationLevel, Option(help="How well sensors are calibrated and placed.")
    ] = CalibrationLevel.C2,
    test: Annotated[Path | None, Option(help="Folder with compressor_test.toml.")] = None,
    identical_mounts: Annotated[bool, Option(help="All mounts are one round part.")] = False,
    reference: Annotated[bool, Option(help="Fit the 44 numbers by SLSQP as well.")] = True,
    figures: Annotated[bool, Option(help="Draw figures; without, tables alone.")] = True,
) -> StudyResult:
    """Measure, identify, compare and report."""
    options = IdentifyOptions()
    beside = Beside(reference=reference, identical_mounts=identical_mounts)
    with progress_bar("compressor identification") as progress:
        if test is not None:
            given = identified_folder(test, options, beside, progress)
            files = (
                *given.found.test.input_files,
                *(() if given.truth is None else (given.truth.path,)),
            )
            return compressor_result([given], files, with_figures=figures)
        seeds = range(seed, seed + cases)
        done = identified_virtual(seeds, level, options, beside, progress)
    return compressor_result(done, with_figures=figures)


if __name__ == "__main__":
    run_script(__file__)
