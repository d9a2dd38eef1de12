"""An acceptance box as the result of a study: page, tables, figures and the box itself."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.measurement.propagated_interval import Interval
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.motion_report import motion_report
from deboom.study.result import StudyResult
from deboom.study.solution_box import BoxStudy
from deboom.study.solution_box_certainty import share_measured_again
from deboom.study.solution_box_figures import box_figures
from deboom.study.solution_box_tables import (
    PERCENT,
    box_documents,
    box_summary,
    box_table,
    compared_table,
    curve_table,
    vehicle_table,
)

TERMS = (
    "booming noise",
    "SPL",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "Pareto front",
)
SHOWN = (
    "variable",
    "Pareto point [1]",
    "from [1]",
    "to [1]",
    "half width [%]",
    "from [N/mm]",
    "to [N/mm]",
    "lower end: parts that keep the limit [%]",
    "upper end: parts that keep the limit [%]",
)


def solution_box_result(study: BoxStudy, inputs: tuple[Path, ...] = ()) -> StudyResult:
    """Make tables, figures, headline numbers, page and box document.

    Parameters
    ----------
    study : BoxStudy
        Found and verified.
    inputs : tuple of Path
        Files read beside the platform's.

    Returns
    -------
    StudyResult
        Tables ``box``, ``boxes``, ``vehicles``, ``curve``; document ``acceptance_box``.
    """
    tables = {
        "box": box_table(study),
        "boxes": compared_table(study),
        "vehicles": vehicle_table(study),
        "curve": curve_table(study),
    }
    pictures = box_figures(study)
    check = study.found.verified
    certainty = share_measured_again(study)
    summary = box_summary(study) | {
        "share_measured_from": float(certainty.lower),
        "share_measured_to": float(certainty.upper),
    }
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures, certainty),
        inputs=(*study.runs.platform.input_files, *inputs),
        facts={
            "kernel": study.index.kernel.name,
            "law": study.question.law.name,
            "verification_parts": check.n_parts,
        },
        documents=box_documents(study),
    )


def _page(
    study: BoxStudy,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
    certainty: Interval,
) -> Page:
    question, found = study.question, study.found
    check = found.verified
    what = "parts" if question.together else "parts and vehicles"
    motion = motion_report(study.index, np.stack([study.space.nominal, study.point]))
    warnings = list(motion.warnings)
    if not found.confirmed:
        warnings.insert(
            0,
            f"The verification does not confirm the stated share: {_percent(check.bound, 2)} with "
            f"confidence against {_percent(question.share, 2)}.",
        )
    sections = [
        Section("The box", _box_text(study), (_picture(pictures, "box", _BOX),), (_box(tables),)),
        Section(
            "Levels inside the box",
            f"{check.n_parts} parts, {question.law.name}, that the search has not seen: "
            f"{_percent(check.share, 2)} of {what} keep the limit, at least "
            f"{_percent(check.bound, 2)} with {_percent(check.confidence, 0)} confidence (the "
            "vehicles of one part are not independent, so each part counts once). Most often "
            f"{study.binding} misses its limit: it binds. {_each(study)}\n\nThat is the share in "
            "the cars as they were measured. With every measurement drawn again with its errors "
            f"it lies between {_percent(float(certainty.lower), 0)} and "
            f"{_percent(float(certainty.upper), 0)}, with 90 % confidence: the level of a car is "
            "known to half a decibel only.",
            (
                _picture(
                    pictures, "levels", "Levels of the parts of the box; dark: above the limit."
                ),
            ),
            (Table(tables["vehicles"], f"Limits and levels: {study.response.quantity}."),),
        ),
        Section(
            "Against other boxes",
            f"Over the {study.over_plain.n_variables} directions that a vehicle depends on, the "
            f"intervals are {study.over_plain.width:.3g} times as wide (geometric mean) as those "
            f"of ±{PERCENT * study.tolerance:g} % about the Pareto point, "
            f"{study.over_plain.volume:.3g} times the volume. {_bisection(study)} "
            "With wider bounds the intervals that lie on them would be wider still.",
            tables=(_shares(tables["boxes"], "Shares are of the same independent parts."),),
        ),
    ]
    if "trade_off" in pictures:
        sections.append(
            Section(
                "What the limit costs",
                f"The limit could be lowered by {found.room:.2f} dB at most, where the box shrinks "
                "to a point. Each box of the curve is verified as the one above.",
                (_picture(pictures, "trade_off", _CURVE),),
                (_shares(_narrow(tables["curve"]), "Boxes over the limit."),),
            )
        )
    return Page(
        title="Acceptance box of the mounts",
        question=(
            "Within which stiffnesses may parts be delivered, each direction independent of all "
            f"others, so that {_percent(question.share, 1)} of {what} keep their limit?"
        ),
        headlines=(
            Headline(
                f"{study.over_plain.width:.2f} ×", f"as wide as ±{PERCENT * study.tolerance:g} %"
            ),
            Headline(_percent(check.share, 2), f"of {what} keep the limit"),
            Headline(study.binding, "binds"),
        ),
        sections=tuple(sections),
        terms=TERMS,
        warnings=tuple(warnings),
    )


_FINE = (
    "share that keeps the limit [%]",
    "at least, with confidence [%]",
    "share [%]",
    "share at least [%]",
    "limit of the first vehicle [dB(A)]",
)
_BOX = "Interval of every direction, with today's stiffness and its ends beside it."
_CURVE = (
    "Width of the box, what one tolerance keeps, and which vehicle's limit the parts of the box "
    "miss, over the limit."
)


def _box_text(study: BoxStudy) -> str:
    found, limit = study.found, study.question.limit
    low, high = study.band
    limits = (
        f"{limit[0]:.2f} dB(A) in every vehicle"
        if np.ptp(limit) == 0.0
        else f"{limit.min():.2f} to {limit.max():.2f} dB(A), by vehicle"
    )
    return (
        f"Limit: {limits}, {study.response.quantity}, {low:g} to {high:g} Hz. A part is accepted "
        "if every direction lies in its interval, whatever the others are. The largest box, by the "
        "sum of weight times logarithm of width, was found from "
        f"{len(found.start_log_volumes)} starts in {found.seconds:.1f} s; stiffness in N/mm is the "
        f"{study.condition}. {study.ends_on_bounds} of the {2 * study.over_plain.n_variables} ends "
        "lie on the bounds that were searched: there the limit asks for nothing.\n\n"
        "The last two columns say what the ends are worth: of parts exactly at that end, so many "
        "keep the limit. At the optimum all ends that are not bounds cost the same share per "
        "weight; an end well above the share lies on its bound."
    )


def _each(study: BoxStudy) -> str:
    if study.question.together:
        return ""
    worst = _percent(float(study.missed.max()), 1)
    return (
        f"The share is one over all vehicles: in {study.binding} alone {worst} of the parts miss. "
        "--worst-vehicle asks every part to keep the limit in all vehicles."
    )


def _bisection(study: BoxStudy) -> str:
    if not np.isfinite(study.over_bisection.width):
        return (
            "About the Pareto point itself the limit is not kept, so bisection finds no box there."
        )
    return (
        f"They are {study.over_bisection.width:.3g} times as wide as those of one tolerance that "
        "bisection finds about the Pareto point at the same limit and share."
    )


def _box(tables: Mapping[str, pd.DataFrame]) -> Table:
    wanted = tables["box"]["requirement"] == "interval"
    frame = tables["box"].loc[wanted, list(SHOWN)]
    return Table(
        frame,
        "Directions that a vehicle depends on; the others have no requirement.",
        {"from [N/mm]": 0, "to [N/mm]": 0},
    )


def _shares(frame: pd.DataFrame, caption: str) -> Table:
    return Table(frame, caption, {name: 2 for name in frame.columns if name in _FINE})


def _narrow(table: pd.DataFrame) -> pd.DataFrame:
    return table[[name for name in table.columns if not name.endswith("missed by [%]")]]


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


def _percent(value: float, decimals: int) -> str:
    return f"{PERCENT * value:.{decimals}f} %"
