"""What the study of many virtual running compressors adds to the page of the first."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from deboom.compressor.component_acceptance import STATIC
from deboom.report.figures import DotPanel, MaskedPanel, dot_panels, masked_panels
from deboom.report.page import Section, Table
from deboom.report.style import VEHICLE_PALETTE
from deboom.study.compressor_unbalance_cases import CaseErrors, MountCase, VirtualRuns
from deboom.study.compressor_unbalance_figures import SIZES, TRUTH, curve_of, masks, true_curve
from deboom.study.compressor_unbalance_page import pictures
from deboom.study.compressor_unbalance_result import unbalance_result
from deboom.study.compressor_unbalance_tables import words
from deboom.study.compressor_unbalance_truth import BANDS
from deboom.study.result import Scalar, StudyResult

Errors = Callable[[CaseErrors], float]
COMPARED = "ade"
"""Routes that all compressors were evaluated by."""
LOW, HIGH = 0, 1
"""Places of the bands 20-50 and 50-150 Hz."""
BASE: dict[str, Errors] = {
    "u_stat_error_percent_50_150": lambda one: one.errors.static[HIGH],
    "u_stat_error_percent_20_50": lambda one: one.errors.static[LOW],
    "u_dyn_error_percent_50_150": lambda one: one.errors.dynamic[HIGH],
}


def virtual_result(runs: VirtualRuns, *, with_figures: bool = True) -> StudyResult:
    """Make the result of a study of virtual compressors.

    Parameters
    ----------
    runs : VirtualRuns
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        The first compressor in detail, errors of all.
    """
    table = case_table(runs.cases)
    shown = table.drop(columns=[name for name in table if "y/z" in str(name)])
    decimals = {name: 1 for name in map(str, shown) if name.endswith("[%]")}
    figures = {}
    if with_figures:
        figures = {"changed_state": changed_state(runs), "errors": errors(runs.cases)}
    section = Section(
        "All virtual compressors, against their truth",
        "Every compressor was measured twice: mounts in operation as struck, and with real part "
        "−10\u00a0%, imaginary part +10\u00a0% of their stiffness. The first one also with mounts "
        "that soften with their amplitude, under the hammer as in operation, and on a flexible "
        "receiver with a mode inside the band. Errors are rms over lines, sweeps, y and z, "
        "relative to the true unbalance; the truth includes the rotating gas force. Global: error "
        "of the fit over all lines and both pressures. Medians over the compressors.",
        figures=pictures(figures, "changed_state", "errors"),
        tables=(Table(shown, "Median errors by state and route.", decimals),),
    )
    return unbalance_result(
        runs.first,
        more_tables={"errors": table, "cases": all_cases(runs.cases)},
        more_figures=figures,
        more_sections=(section,),
        more_summary=error_summary(runs.cases),
        with_figures=with_figures,
    )


def error_summary(cases: Sequence[CaseErrors]) -> dict[str, Scalar]:
    """Headline errors, medians over the compressors [%]; the study's docstring has the keys."""
    summary: dict[str, Scalar] = {}
    for suffix, case, letter in (
        ("", MountCase.UNCHANGED, "d"),
        ("_changed_route_a", MountCase.CHANGED, "a"),
        ("_changed_route_e", MountCase.CHANGED, "e"),
    ):
        for name, of in BASE.items():
            summary[name + suffix] = _median(cases, case, letter, of)
    own: dict[str, Errors] = {
        "u_dyn_error_percent_20_50": lambda one: one.errors.dynamic[LOW],
        "u_stat_global_percent": lambda one: one.static,
        "u_dyn_global_percent": lambda one: one.dynamic,
        "gas_moment_percent": lambda one: one.gas_moment,
        "yz_mismatch_percent_50_150": lambda one: one.errors.static_mismatch[HIGH],
    }
    summary |= {name: _median(cases, MountCase.UNCHANGED, "d", of) for name, of in own.items()}
    for prefix, case, letter in (
        ("softening_route_a", MountCase.SOFTENING, "a"),
        ("softening_route_e", MountCase.SOFTENING, "e"),
        ("receiver_route_d", MountCase.RECEIVER, "d"),
        ("receiver_route_c", MountCase.RECEIVER, "c"),
    ):
        rows = _of(cases, case, letter)
        if rows:
            summary[f"{prefix}_u_stat_percent_20_50"] = 100 * rows[0].errors.static[LOW]
            summary[f"{prefix}_u_stat_percent_50_150"] = 100 * rows[0].errors.static[HIGH]
    receiver = _of(cases, MountCase.RECEIVER, "d")
    if receiver:
        summary["receiver_alarm"] = "yes" if receiver[0].alarmed else "no"
    return summary


def case_table(cases: Sequence[CaseErrors]) -> pd.DataFrame:
    """Write medians by state and route."""
    rows = []
    for case in MountCase:
        for letter in sorted({one.letter for one in cases}):
            found = _of(cases, case, letter)
            if found:
                row: dict[str, str | int | float] = {
                    "mounts": case.value,
                    "route": letter,
                    "compressors": len(found),
                }
                for place, band in enumerate(BANDS):
                    for name, of in (
                        ("u", "static"),
                        ("u_d", "dynamic"),
                        ("y/z", "static_mismatch"),
                    ):
                        values = [getattr(one.errors, of)[place] for one in found]
                        row[f"{name} {words(band)} [%]"] = 100 * float(np.median(values))
                row["u, global [%]"] = 100 * float(np.median([one.static for one in found]))
                row["u_d, global [%]"] = 100 * float(np.median([one.dynamic for one in found]))
                rows.append(row)
    return pd.DataFrame(rows)


def all_cases(cases: Sequence[CaseErrors]) -> pd.DataFrame:
    """Write every case."""
    rows = []
    for one in cases:
        row: dict[str, str | int | float] = {
            "seed": one.seed,
            "mounts": one.case.value,
            "route": one.letter,
            "alarm": one.alarmed,
            "u, global [%]": 100 * one.static,
            "u_d, global [%]": 100 * one.dynamic,
            "gas moment, global [%]": 100 * one.gas_moment,
        }
        for place, band in enumerate(BANDS):
            row[f"u {words(band)} [%]"] = 100 * one.errors.static[place]
            row[f"u_d {words(band)} [%]"] = 100 * one.errors.dynamic[place]
        rows.append(row)
    return pd.DataFrame(rows)


def changed_state(runs: VirtualRuns) -> bytes:
    """Show changed mounts: the thesis's route against the one that follows."""
    panels = []
    label, unit = SIZES[STATIC]
    for letter in ("a", "e"):
        result = runs.changed.by_letter(letter)
        sweep = result.sweeps[0]
        curve = curve_of(sweep, STATIC)
        panels.append(
            MaskedPanel(
                f"Route {letter}: {result.route.title}",
                label,
                sweep.frequency,
                {
                    "from y": unit * np.abs(curve.from_y.value),
                    "from z": unit * np.abs(curve.from_z.value),
                }
                | true_curve(runs.changed_truth, sweep, STATIC),
                ranges={
                    "from y": (unit * curve.from_y.lower, unit * curve.from_y.upper),
                    "from z": (unit * curve.from_z.lower, unit * curve.from_z.upper),
                },
                masked=masks(curve),
                note=sweep.sweep,
            )
        )
    return masked_panels(panels, dashed=(TRUTH,))


def errors(cases: Sequence[CaseErrors]) -> bytes:
    """Dots of every compressor, by route and state."""
    states = {"as struck": MountCase.UNCHANGED, "changed": MountCase.CHANGED}
    colours = dict(zip(states, VEHICLE_PALETTE, strict=False))
    panels = []
    for name, of in (("u", "static"), ("u_d", "dynamic")):
        for place, band in enumerate(BANDS):
            values = {
                f"{letter}, {words_of}": {
                    words_of: [
                        100 * getattr(one.errors, of)[place] for one in _of(cases, state, letter)
                    ]
                }
                for letter in COMPARED
                for words_of, state in states.items()
            }
            panels.append(DotPanel(f"{name}, {words(band)} [%]", values))
    return dot_panels(panels, colours)


def _of(cases: Sequence[CaseErrors], case: MountCase, letter: str) -> list[CaseErrors]:
    return [one for one in cases if one.case is case and one.letter == letter]


def _median(cases: Sequence[CaseErrors], case: MountCase, letter: str, of: Errors) -> float:
    return 100 * float(np.median([of(one) for one in _of(cases, case, letter)]))
