"""A mount characterisation as the result of a study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.files.platform import read_platform
from deboom.study.characterisation import CharacterisedBench
from deboom.study.characterisation_figures import characterisation_figures
from deboom.study.characterisation_motion import quality_of_motion
from deboom.study.characterisation_numbers import all_gears_numbers, direction_numbers
from deboom.study.characterisation_page import characterisation_page
from deboom.study.characterisation_tables import (
    all_gears_table,
    characterisation_summary,
    neighbour_table,
    r2_table,
    truth_table,
    uncertainty_table,
)
from deboom.study.characterisation_transfer import (
    force_transfer_figure,
    force_transfer_matrices,
    force_transfer_table,
    moment_cost_table,
    moment_transfer_matrices,
)
from deboom.study.result import StudyResult
from deboom.study.surface_check import PEAKS, RMS


def characterisation_result(
    benches: Sequence[CharacterisedBench],
    inputs: tuple[Path, ...] = (),
    *,
    all_gears: bool = False,
    with_figures: bool = True,
    platform: Path | None = None,
) -> StudyResult:
    """Make tables, figures, headline numbers and page of characterised benches.

    Parameters
    ----------
    benches : sequence of CharacterisedBench
        At least one; figures show the first, tables all.
    inputs : tuple of Path
        Files that stay; a bench that was measured for the study leaves none.
    all_gears : bool
        Whether surfaces over all gears, in pieces by cross-validation, are shown beside.
    with_figures : bool
        Whether to draw; the tables take a fraction of the time.
    platform : Path, optional
        Folder with ``platform.toml``, whose vehicles say what it costs to leave moments out; looked
        at where the first bench's campaign has pushes beside its virtual points.

    Returns
    -------
    StudyResult
        Tables ``r2``, ``truth`` (where the truth is known), ``uncertainty``, ``neighbour``,
        ``quality``, ``force_transfer``, ``moments`` (where known), ``all_gears`` (if asked for) and
        ``directions``, the numbers of every bench behind them.
    """
    with threadpool_limits(1):  # its matrices are too small to share
        numbers = direction_numbers(benches)
        beside = all_gears_numbers(benches) if all_gears else None
    tables = {
        "r2": r2_table(numbers),
        "uncertainty": uncertainty_table(numbers),
        "neighbour": neighbour_table(benches[0]),
        "quality": quality_of_motion(benches[0]),
        "directions": numbers.rename(columns=lambda name: _with_unit(str(name))),
    }
    if any(bench.truth is not None for bench in benches):
        tables["truth"] = truth_table(numbers)
    matrices = force_transfer_matrices(benches[0])
    known = [*matrices.values(), *moment_transfer_matrices(benches[0]).values()]
    tables["force_transfer"] = force_transfer_table(known)
    summary = characterisation_summary(benches, numbers)
    if platform is not None and benches[0].result.campaign.pushes:
        vehicles = read_platform(platform)
        tables["moments"] = moment_cost_table(benches[0], vehicles)
        summary["moments_cost_at_peaks_db"] = float(tables["moments"][PEAKS].max())
        summary["moments_cost_rms_db"] = float(tables["moments"][RMS].max())
        inputs = (*inputs, *vehicles.input_files)
    if beside is not None:
        tables["all_gears"] = all_gears_table(numbers, beside)
    figures = characterisation_figures(benches[0]) if with_figures else {}
    if with_figures and matrices:
        figures["cell_calibration"] = force_transfer_figure(matrices)
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=summary,
        page=characterisation_page(benches, tables, figures),
        inputs=inputs,
    )


def _with_unit(name: str) -> str:
    return name if name in ("bench", "direction") else f"{name} [1]"
