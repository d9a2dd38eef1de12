"""Fronts compared, as the result of a study."""

from __future__ import annotations

from deboom.study.compare import SETS, Comparison
from deboom.study.compare_page import comparison_figures, comparison_page
from deboom.study.compare_runs import differences
from deboom.study.compare_tables import (
    comparison_summary,
    front_table,
    pair_table,
    point_table,
    range_table,
)
from deboom.study.result import StudyResult


def compare_result(study: Comparison) -> StudyResult:
    """Make tables, figures, headline numbers and page of a comparison.

    Parameters
    ----------
    study : Comparison
        Judged.

    Returns
    -------
    StudyResult
        Tables ``pairs``, ``fronts``, ``designs``, ``points`` and ``differences``.
    """
    tables = {
        "pairs": pair_table(study),
        "fronts": front_table(study),
        "designs": range_table(study),
        "points": point_table(study),
        "differences": differences(
            [one.run for one in study.fronts], [one.name for one in study.fronts]
        ),
    }
    pictures = comparison_figures(study)
    inputs = tuple(path for one in study.fronts for path in one.run.files)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=comparison_summary(study),
        page=comparison_page(study, tables, pictures),
        inputs=inputs,
        facts={
            "judge": study.fronts[0].run.entry.folder.as_posix(),
            "common_draws": study.n_samples,
            "sets_of_draws": SETS,
        },
    )
