"""A mount characterisation as the result of a study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.study.characterisation import CharacterisedBench
from deboom.study.characterisation_figures import characterisation_figures
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
from deboom.study.result import StudyResult


def characterisation_result(
    benches: Sequence[CharacterisedBench],
    inputs: tuple[Path, ...] = (),
    *,
    all_gears: bool = False,
    with_figures: bool = True,
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

    Returns
    -------
    StudyResult
        Tables ``r2``, ``truth`` (where the truth is known), ``uncertainty``, ``neighbour``,
        ``all_gears`` (if asked for) and ``directions``, the numbers of every bench behind them.
    """
    with threadpool_limits(1):  # its matrices are too small to share
        numbers = direction_numbers(benches)
        beside = all_gears_numbers(benches) if all_gears else None
    tables = {
        "r2": r2_table(numbers),
        "uncertainty": uncertainty_table(numbers),
        "neighbour": neighbour_table(benches[0]),
        "directions": numbers.rename(columns=lambda name: _with_unit(str(name))),
    }
    if any(bench.truth is not None for bench in benches):
        tables["truth"] = truth_table(numbers)
    if beside is not None:
        tables["all_gears"] = all_gears_table(numbers, beside)
    figures = characterisation_figures(benches[0]) if with_figures else {}
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=characterisation_summary(benches, numbers),
        page=characterisation_page(benches, tables, figures),
        inputs=inputs,
    )


def _with_unit(name: str) -> str:
    return name if name in ("bench", "direction") else f"{name} [1]"
