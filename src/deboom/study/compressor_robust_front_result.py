"""The robust front of a compressor's mounts as the result of a study."""

from __future__ import annotations

from deboom.study.compressor_mount_sheet import mount_sheet
from deboom.study.compressor_robust_front import CompressorFront
from deboom.study.compressor_robust_front_page import front_figures, front_page
from deboom.study.compressor_robust_front_tables import (
    agreement_table,
    car_table,
    convergence_table,
    front_summary,
    front_table,
    peak_table,
    pick_table,
    requirement_table,
    sobol_table,
    stiffness_table,
)
from deboom.study.result import StudyResult

SOURCE = "study compressor_robust_front; its options are in run.json beside this sheet"


def compressor_front_result(study: CompressorFront) -> StudyResult:
    """Make tables, figures, headline numbers, page and supplier sheet.

    Parameters
    ----------
    study : CompressorFront
        Searched and verified.

    Returns
    -------
    StudyResult
    """
    tables = {
        "front": front_table(study),
        "convergence": convergence_table(study),
        "picks": pick_table(study),
        "stiffness": stiffness_table(study),
        "cars": car_table(study),
        "peaks": peak_table(study),
        "sobol": sobol_table(study),
        "requirements": requirement_table(study),
        "agreement": agreement_table(study),
    }
    figures = front_figures(study)
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=front_summary(study),
        page=front_page(study, tables, figures),
        inputs=study.model.fleet.inputs,
        facts=study.facts,
        attachments=mount_sheet(study, SOURCE),
    )
