"""A sensitivity analysis as the result of a study."""

from __future__ import annotations

from deboom.study.motion_report import factor_name, motion_name
from deboom.study.result import StudyResult
from deboom.study.sensitivity import Sensitivity
from deboom.study.sensitivity_page import sensitivity_figures, sensitivity_page
from deboom.study.sensitivity_tables import (
    beside_table,
    convergence_table,
    index_table,
    line_table,
    pair_table,
    screening_table,
    sensitivity_summary,
)


def sensitivity_result(study: Sensitivity) -> StudyResult:
    """Make tables, figures, headline numbers and page of a sensitivity analysis.

    Parameters
    ----------
    study : Sensitivity
        Analysed.

    Returns
    -------
    StudyResult
        Tables ``sobol``, ``sobol_pairs``, ``sobol_beside``, ``sobol_lines``,
        ``sobol_convergence``, ``screening``; with several mounts also ``sobol_mounts``.
    """
    tables = {
        "sobol": index_table(study.indices, "variable"),
        "sobol_pairs": pair_table(study.indices),
        "sobol_beside": beside_table(study),
        "sobol_lines": line_table(study),
        "sobol_convergence": convergence_table(study),
        "screening": screening_table(study),
    }
    if study.by_mount is not None:
        tables["sobol_mounts"] = index_table(study.by_mount, "mount")
    pictures = sensitivity_figures(study)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=sensitivity_summary(study),
        page=sensitivity_page(study, tables, pictures),
        inputs=study.platform.input_files,
        facts={
            "motion": motion_name(study.index),
            "design_factor": factor_name(study.index),
            "kernel": study.index.kernel.name,
            "ranked": study.plan.ranked.words,
            "variables": f"{study.plan.analysis.value}: {study.inputs.description}",
        },
    )
