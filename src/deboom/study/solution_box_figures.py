"""Figures of an acceptance box."""

from __future__ import annotations

import numpy as np

from deboom.explore.solution_box_reach import UnreachableLimit
from deboom.report import figures
from deboom.report.figures import Intervals
from deboom.report.style import mount_colours, vehicle_colours
from deboom.study.solution_box import BoxStudy
from deboom.study.solution_box_tables import N_PER_MM, PERCENT, curve_table, vehicle_table


def box_figures(study: BoxStudy) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    colours = vehicle_colours(study.runs.platform.fleet.names)
    quantity = study.response.quantity
    vehicles = vehicle_table(study)
    pictures = {
        "box": _intervals(study),
        "levels": figures.levels_in_box(
            study.vehicles,
            study.shown_excess + study.question.limit,
            study.question.limit,
            vehicles["today [dB(A)]"],
            PERCENT * study.missed,
            colours,
            level_label=f"{quantity} [dB(A)]",
        ),
    }
    if len(study.curve) > 1:
        pictures["trade_off"] = _trade_off(study, colours)
    return pictures


def _intervals(study: BoxStudy) -> bytes:
    question = study.question
    return figures.box_intervals(
        study.variables,
        Intervals("acceptance box", study.box.lower, study.box.upper),
        [
            Intervals(f"±{PERCENT * study.tolerance:g} %", study.plain.lower, study.plain.upper),
            Intervals(
                f"bisection, ±{PERCENT * study.bisection.tolerance:.3g} %",
                study.bisection.box.lower,
                study.bisection.box.upper,
            ),
        ],
        Intervals("bounds", question.lower, question.upper),
        study.point,
        study.reference_stiffness * N_PER_MM,
        [not one for one in study.effective],
        mount_colours([mount.name for mount in study.runs.platform.mounts]),
    )


def _trade_off(study: BoxStudy, colours: dict[str, str]) -> bytes:
    table = curve_table(study)
    table = table[table["box"] == "found"]
    common = bool(np.ptp(study.question.limit) == 0.0)
    column = "limit of the first vehicle [dB(A)]" if common else "limit against the stated one [dB]"
    asked = table[table["limit against the stated one [dB]"] == 0.0].iloc[0]
    width = "geometric mean half width [%]"
    lowest = -study.found.room + (float(study.question.limit[0]) if common else 0.0)
    unreachable = any(isinstance(one, UnreachableLimit) for _, one in study.curve)
    near = unreachable or table[column].min() - lowest < np.ptp(table[column])
    return figures.box_trade_off(
        table[column],
        table[width],
        table["share of one tolerance [%]"],
        {name: table[f"{name} missed by [%]"] for name in study.vehicles},
        colours,
        stated=(float(asked[column]), float(asked[width])),
        unreachable=lowest if near else None,
        limit_label="limit [dB(A)]" if common else "limit against the stated one [dB]",
        width_label="mean half width of the box [%]",
        plain_label=f"share that ±{PERCENT * study.tolerance:g} % keeps [%]",
    )
