"""Identified compressors as the result of a study, or of ``deboom identify``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from deboom.files.compressor_model import compressor_document
from deboom.study.compressor_identification import IdentifiedTest
from deboom.study.compressor_identification_figures import condition_numbers, figures_of
from deboom.study.compressor_identification_page import page_of
from deboom.study.compressor_identification_tables import tables_of
from deboom.study.compressor_identification_truth import errors_of
from deboom.study.result import Scalar, StudyResult

MODEL_FILE = "compressor_model"
"""Stem of the file that other studies load."""
SHARE = 90
"""Percentile of the errors over the compressors."""


def compressor_result(
    tests: Sequence[IdentifiedTest],
    inputs: tuple[Path, ...] = (),
    *,
    with_figures: bool = True,
) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    tests : sequence of IdentifiedTest
        At least one; it is shown in detail, the others by their errors.
    inputs : tuple of Path
        Files that stay; tests that were measured for the study leave none.
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        Among its documents the first compressor, for `read_compressor_model`.
    """
    first = tests[0]
    condition = _condition(first)
    tables = tables_of(tests)
    figures = figures_of(first) if with_figures else {}
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=summary_of(tests),
        page=page_of(tests, tables, figures, condition),
        inputs=inputs,
        facts={"characteristic_length_m": first.found.length},
        documents={MODEL_FILE: compressor_document(first.kept)},
    )


def summary_of(tests: Sequence[IdentifiedTest]) -> dict[str, Scalar]:
    """Headline numbers: of the first compressor; errors as 90 % quantile over all of them.

    Returns
    -------
    dict
        Errors only where the truth is known, the rank only with a drawing.
    """
    first = tests[0]
    summary: dict[str, Scalar] = {"mass_kg": first.found.calibrated.model.mass}
    errors = [errors_of(test.found, test.truth) for test in tests if test.truth is not None]
    if errors:
        summary |= {
            "cog_error_mm": _quantile([1e3 * error.centre for error in errors]),
            "inertia_error_percent": _quantile([100 * error.inertia for error in errors]),
            "k_vp_error_percent": _quantile([100 * error.stiffness for error in errors]),
        }
    if first.thesis is not None:
        summary["jacobian_rank"] = first.thesis.seen.rank
    return summary | {
        "reduced_chi2": first.found.calibrated.reduced_chi**2,
        "condition_scaled_100hz": _condition(first),
        "seconds": first.seconds,
    }


def _quantile(values: Sequence[float]) -> float:
    return float(np.percentile(values, SHARE))


def _condition(test: IdentifiedTest) -> float:
    """Scaled condition number at the line nearest to 100 Hz [1]."""
    inertance = test.found.inertance
    nearest = int(np.argmin(np.abs(inertance.frequency - 100.0)))
    return float(condition_numbers(inertance.values[[nearest]], test.found.length)[0])
