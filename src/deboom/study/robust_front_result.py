"""A robust front as the result of a study."""

from __future__ import annotations

from deboom.study.result import StudyResult
from deboom.study.robust_front import RobustFront
from deboom.study.robust_front_page import front_figures, front_page
from deboom.study.robust_front_tables import (
    convergence_table,
    design_table,
    front_summary,
    front_table,
    loss_factor_table,
    peak_table,
    per_vehicle_table,
    pick_table,
    stiffness_table,
    vehicle_change_table,
)


def robust_front_result(study: RobustFront) -> StudyResult:
    """Make tables, figures, headline numbers and page of a robust front.

    Parameters
    ----------
    study : RobustFront
        Searched and verified.

    Returns
    -------
    StudyResult
        Tables ``front``, ``designs``, ``convergence``, ``per_vehicle``, ``picks``, ``stiffness``,
        ``vehicles``, ``peaks``; with loss factors as variables also ``loss_factors``.
    """
    tables = {
        "front": front_table(study),
        "designs": design_table(study),
        "convergence": convergence_table(study),
        "per_vehicle": per_vehicle_table(study),
        "picks": pick_table(study),
        "stiffness": stiffness_table(study),
        "vehicles": vehicle_change_table(study),
        "peaks": peak_table(study),
    }
    if len(study.variables) > len(study.stiffness_variables):
        tables["loss_factors"] = loss_factor_table(study)
    figures = front_figures(study)
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=front_summary(study),
        page=front_page(study, tables, figures),
        inputs=study.platform.input_files,
        facts=study.facts,
    )
