"""Allocated tolerances as the result of a study."""

from __future__ import annotations

from pathlib import Path

from threadpoolctl import threadpool_limits

from deboom.study.result import StudyResult
from deboom.study.tolerance_allocation import DRAWS, AllocationStudy
from deboom.study.tolerance_allocation_figures import allocation_figures
from deboom.study.tolerance_allocation_page import allocation_page
from deboom.study.tolerance_allocation_tables import (
    allocation_summary,
    allocation_table,
    curve_table,
    front_marginal_table,
    marginal_table,
    verification_table,
)


def allocation_result(study: AllocationStudy, inputs: tuple[Path, ...] = ()) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    study : AllocationStudy
        What is asked.
    inputs : tuple of Path
        Files read beside those of the design.

    Returns
    -------
    StudyResult
        Tables ``allocation``, ``marginal_values``, ``front_marginal_values``, ``cost_of_target``,
        ``verification``.
    """
    with threadpool_limits(1):  # threads may change the last bit of an optimum
        tables = {
            "allocation": allocation_table(study),
            "marginal_values": marginal_table(study),
            "front_marginal_values": front_marginal_table(study),
            "cost_of_target": curve_table(study),
            "verification": verification_table(study),
        }
        figures = allocation_figures(study)
        return StudyResult(
            tables=tables,
            figures=figures,
            summary=allocation_summary(study),
            page=allocation_page(study, tables, figures),
            inputs=(*study.chosen.inputs, *inputs),
            facts={
                "kernel": study.index.kernel.name,
                "allocation_draws": study.n_samples,
                "verification_draws": DRAWS,
            },
        )
