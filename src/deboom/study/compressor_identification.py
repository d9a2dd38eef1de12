"""From hammer tests to identified compressors: one folder, or several virtual compressors."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.bench.compressor_plan import CalibrationLevel, CompressorCase, CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.compressor.identical_fit import IdenticalFit, fit_identical_mounts
from deboom.compressor.identified import IdentifiedCompressor, identified_compressor
from deboom.compressor.identify import Identification, IdentifyOptions, identify
from deboom.compressor.thesis_fit import ThesisFit, fit_thesis_parameters
from deboom.errors import InputError
from deboom.files.inertance_test import read_inertance_test
from deboom.files.run_folder import hash_files
from deboom.measurement.inertance_test import InertanceTest
from deboom.study.compressor_identification_truth import CompressorTruth, read_compressor_truth
from deboom.study.progress import Progress, counted

STEPS = 7
"""Of `identified_test`, for progress."""


@dataclass(frozen=True)
class Beside:
    """What is fitted beside the identification itself.

    Parameters
    ----------
    thesis : bool
        The thesis's 44 numbers, where there is a drawing.
    reference : bool
        These by sequential quadratic programming as well.
    identical_mounts : bool
        Identical round mounts.
    """

    thesis: bool = True
    reference: bool = False
    identical_mounts: bool = False


@dataclass(frozen=True, eq=False)
class IdentifiedTest:
    """One test, identified.

    Parameters
    ----------
    found : Identification
    options : IdentifyOptions
        How.
    thesis : ThesisFit or None
        None without a drawing, or where it was not asked for.
    identical : IdenticalFit or None
        None where it was not asked for.
    truth : CompressorTruth or None
        None where it is not known.
    seconds : float
        Of the identification alone [s].
    kept : IdentifiedCompressor
        What other studies load.
    """

    found: Identification
    options: IdentifyOptions
    thesis: ThesisFit | None
    identical: IdenticalFit | None
    truth: CompressorTruth | None
    seconds: float
    kept: IdentifiedCompressor

    @property
    def input_files(self) -> tuple[Path, ...]:
        """Every file that was read, the truth included."""
        truth = () if self.truth is None else (self.truth.path,)
        return (*self.found.test.input_files, *truth)


def read_test(
    folder: Path, *, from_hits: bool = False
) -> tuple[InertanceTest, CompressorTruth | None]:
    """Read a test and, where it is virtual, its truth.

    Raises
    ------
    InputError
        A folder that holds no test that can be read.
    """
    if not folder.is_dir():
        raise InputError(
            f"{folder}: there is no such folder; `deboom bench compressor {folder}` writes a "
            "virtual test"
        )
    return read_inertance_test(folder, from_hits=from_hits), read_compressor_truth(folder)


def identified_test(
    test: InertanceTest,
    truth: CompressorTruth | None,
    options: IdentifyOptions,
    beside: Beside,
    step: Callable[[str], None],
    relative_to: Path | None = None,
) -> IdentifiedTest:
    """Identify a test and fit what was asked for beside.

    Parameters
    ----------
    test : InertanceTest
    truth : CompressorTruth or None
        Kept for comparison.
    options : IdentifyOptions
    beside : Beside
    step : callable of str
        Told what is being done.
    relative_to : Path, optional
        Folder from which input files are named in the saved compressor; without it they leave no
        hashes, since they do not stay.

    Returns
    -------
    IdentifiedTest

    Raises
    ------
    InputError
        As `identify`; identical mounts without a drawing.
    """
    if beside.identical_mounts and test.drawing is None:
        raise InputError(
            f"{test.name}: identical mounts are counted from a drawing, and the test has none: add "
            "its [drawing] and [[mounts]], or leave out --identical-mounts"
        )
    hashes = {} if relative_to is None else hash_files(test.input_files, relative_to)
    with threadpool_limits(1):  # its matrices are too small to share
        begin = time.perf_counter()
        found = identify(test, options, step)
        seconds = time.perf_counter() - begin
        thesis, identical = None, None
        if beside.thesis and test.drawing is not None:
            step("the thesis's 44 numbers")
            thesis = fit_thesis_parameters(found, test.drawing, with_reference=beside.reference)
        if beside.identical_mounts and test.drawing is not None:
            step("identical mounts")
            identical = fit_identical_mounts(found, test.drawing)
    kept = identified_compressor(found, options.bands, hashes)
    return IdentifiedTest(found, options, thesis, identical, truth, seconds, kept)


def identified_folder(
    folder: Path,
    options: IdentifyOptions,
    beside: Beside,
    progress: Progress,
    *,
    from_hits: bool = False,
) -> IdentifiedTest:
    """Read and identify the test of a folder; see `read_test` and `identified_test`."""
    test, truth = read_test(folder, from_hits=from_hits)
    return identified_test(test, truth, options, beside, counted(progress, STEPS), folder)


def identified_virtual(
    seeds: Sequence[int],
    level: CalibrationLevel,
    options: IdentifyOptions,
    beside: Beside,
    progress: Progress,
) -> list[IdentifiedTest]:
    """Measure virtual compressors and identify each.

    Parameters
    ----------
    seeds : sequence of int
        One compressor each; seed 1 has the mounts of the thesis's table 11, others are random.
    level : CalibrationLevel
        Of sensors and impacts.
    options : IdentifyOptions
    beside : Beside
        For the first one; the others are identified only.
    progress : callable

    Returns
    -------
    list of IdentifiedTest
    """
    total = len(seeds) * STEPS
    done = []
    for place, seed in enumerate(seeds):
        step = counted(progress, total, place * STEPS, f"compressor {place + 1}: ")
        step("hammer test")
        plan = CompressorPlan(
            case=CompressorCase.TABLE11 if seed == 1 else CompressorCase.RANDOM,
            identical_mounts=beside.identical_mounts,
        )
        with tempfile.TemporaryDirectory(prefix="deboom-") as scratch:
            folder = write_compressor_test(Path(scratch) / "test", seed, level, plan)
            test, truth = read_test(folder)
        own = beside if place == 0 else Beside(thesis=False)
        done.append(identified_test(test, truth, options, own, step))
    return done
