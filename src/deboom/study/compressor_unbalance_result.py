"""A running compressor as the result of a study, or of ``deboom unbalance``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import pandas as pd

from deboom.compressor.acceptance import overall
from deboom.files.compressor_model import compressor_document
from deboom.report.page import Section
from deboom.study.component_sheet import component_sheet
from deboom.study.component_verdicts import verdict_table
from deboom.study.compressor_unbalance import MODEL_FILE
from deboom.study.compressor_unbalance_figures import figures_of
from deboom.study.compressor_unbalance_page import page_of
from deboom.study.compressor_unbalance_tables import tables_of
from deboom.study.result import Scalar, StudyResult

if TYPE_CHECKING:
    from pathlib import Path

    from deboom.study.compressor_unbalance import MeasuredUnbalance


def unbalance_result(
    measured: MeasuredUnbalance,
    *,
    command: str = "",
    inputs: tuple[Path, ...] = (),
    more_tables: Mapping[str, pd.DataFrame] | None = None,
    more_figures: Mapping[str, bytes] | None = None,
    more_sections: Sequence[Section] = (),
    more_summary: Mapping[str, Scalar] | None = None,
    with_figures: bool = True,
) -> StudyResult:
    """Make tables, figures, headline numbers and page of one compressor.

    Parameters
    ----------
    measured : MeasuredUnbalance
        Shown in detail.
    command : str
        Among the conditions of the supplier's sheet, which is written where there are limits.
    inputs : tuple of Path
        Files that stay; a test that was measured for the study leaves none.
    more_tables, more_figures, more_sections, more_summary
        Of a study of several compressors.
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
    """
    tables = {**tables_of(measured), **(more_tables or {})}
    attachments: dict[str, bytes] = {}
    if measured.limits is not None:
        tables["verdicts"] = verdict_table(measured.verdicts)
        attachments = component_sheet(measured, command)
    figures = {**figures_of(measured), **(more_figures or {})} if with_figures else {}
    return StudyResult(
        tables=tables,
        figures=figures,
        summary={**summary_of(measured), **(more_summary or {})},
        page=page_of(measured, tables, figures, more_sections),
        inputs=inputs,
        facts={"route": measured.found.chosen.route.letter},
        documents={MODEL_FILE: compressor_document(measured.kept)},
        attachments=attachments,
    )


def summary_of(measured: MeasuredUnbalance) -> dict[str, Scalar]:
    """Headline numbers of one compressor."""
    found, sources = measured.found, measured.found.chosen.sources
    summary: dict[str, Scalar] = {
        "route": found.chosen.route.letter,
        "u_stat_g_mm": 1e6 * abs(sources.static.value),
        "u_stat_deviation_g_mm": 1e6 * sources.static.deviation,
        "u_dyn_g_mm2": 1e9 * abs(sources.dynamic.value),
        "u_dyn_deviation_g_mm2": 1e9 * sources.dynamic.deviation,
        "sense": found.sense.sense.name.lower(),
        "mounts_changed": measured.mounts_changed,
        "reduced_chi": sources.reduced_chi,
        "remaining_chi": sources.remaining_chi,
        "n_alarms": len(found.alarms) + len(measured.kept.alarms),
    }
    if measured.truth is not None:
        summary["u_stat_first_error_percent"] = 100 * abs(
            sources.static.value / measured.truth.static - 1
        )
        summary["u_dyn_first_error_percent"] = 100 * abs(
            sources.dynamic.value / measured.truth.dynamic - 1
        )
    if measured.limits is not None:
        summary["decision"] = overall(measured.verdicts).value
    return summary | {"seconds": measured.seconds}
