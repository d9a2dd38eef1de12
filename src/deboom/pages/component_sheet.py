"""Verdicts on a component and its limits, and the sheet for its supplier."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd

from deboom.compressor.acceptance import DYNAMIC, STATIC, ComponentVerdict, Decision, overall
from deboom.compressor.measured_unbalance import MeasuredUnbalance
from deboom.files.tables import workbook_bytes
from deboom.report import Report
from deboom.report.sheet import Sheet

AFFORDABLE = 20
"""Repetitions beyond which a part counts as lying on its limit."""
_PART_WORDS = {
    Decision.PASS: "accepted",
    Decision.FAIL: "rejected",
    Decision.UNDECIDED: "not decided",
}


def append_verdicts(report: Report, measured: MeasuredUnbalance, command: str) -> None:
    """Hold the part against its limits, and attach the sheet for its supplier."""
    report.section(
        "Does it keep its limits?",
        "Decided as ISO 14253-1 has it: a limit is kept where the value lies inside it by more "
        "than the guard band, broken where it lies outside by more; in between, nothing is proven. "
        "The guard band comes from the standard deviation, so that a part which breaks a limit "
        "passes with the stated risk at most. supplier_sheet.html is the page for the supplier.",
    )
    table, undecided = verdict_table(measured.verdicts), open_points(measured.verdicts)
    shown = shown_verdicts(table)
    report.table("verdicts", table, "Limits and verdicts.", shown=shown)
    if not undecided.empty:
        report.table(None, undecided, "Limits that are open.")
    conditions = _condition_table(measured, command)
    page = _supplier_sheet(measured, shown, undecided, conditions)
    sheets = {"verdicts": table, "not decided": undecided, "conditions": conditions}
    report.attach("supplier_sheet.html", page.html().encode())
    report.attach("supplier_sheet.xlsx", workbook_bytes(sheets, page.title))


def _supplier_sheet(
    measured: MeasuredUnbalance,
    shown: pd.DataFrame,
    undecided: pd.DataFrame,
    conditions: pd.DataFrame,
) -> Sheet:
    """Write the page for the supplier: verdicts, what is open, and how it was measured."""
    assert measured.limits is not None
    risk, verdicts = measured.limits.risk, measured.verdicts
    sheet = Sheet(f"Acceptance of {measured.test.name}")
    decisions = [verdict.decision for verdict in verdicts]
    counts = {
        f"limits: {decision.value}": f"{decisions.count(decision)} of {len(decisions)}"
        for decision in Decision
    }
    sheet.fields({"the part": _PART_WORDS[overall(verdicts)], **counts})
    sheet.section(
        "Limits and verdicts",
        "Decided as ISO 14253-1 has it. A limit is kept where the measured value lies inside it by "
        f"more than the guard band: a part that breaks it passes with at most {risk:.2g} "
        "probability. It is broken where the value lies outside by as much or more. In between, "
        "the measurement proves neither.",
    )
    sheet.table(
        shown,
        "The part lies above the value less its guard band with a probability of "
        f"{1 - risk:.2g}, and as surely below the value plus it.",
    )
    sheet.section("Not decided, and what would decide it")
    if undecided.empty:
        sheet.text("Every limit was decided.")
    else:
        sheet.table(undecided)
    sheet.section("Conditions")
    sheet.table(conditions)
    return sheet


def _condition_table(measured: MeasuredUnbalance, command: str) -> pd.DataFrame:
    """List under which conditions the values hold, and how they are computed again."""
    evaluation, chosen = measured.evaluation, measured.evaluation.chosen
    alarms = [*evaluation.identification.alarms, *evaluation.alarms]
    sweeps = ", ".join(sweep.sweep for sweep in chosen.sweeps)
    low = min(sweep.speed[0] for sweep in chosen.sweeps)
    high = max(sweep.speed[-1] for sweep in chosen.sweeps)
    hammer = measured.test.hammer
    weighed = "not weighed" if hammer.weighed_mass is None else f"{hammer.weighed_mass:.3f} kg"
    rows = {
        "sweeps": f"{sweeps}; {low:.0f}–{high:.0f} rpm; first order",
        "sense of rotation": evaluation.sense.statement,
        "method": f"in situ, mounted; route {chosen.route.letter}: {chosen.route.title}",
        "hammer test": f"{len(hammer.sensors)} triaxial accelerometers, {len(hammer.impacts)} "
        f"impacts; mass on the scales: {weighed}",
        "unbalance": "about the rotor's axis x, moments about the origin of the position sheet",
        "stiffness": "of the compressor on its mounts, at that origin, at the hammer's amplitude",
        "mounts in operation": measured.mount_state,
        "alarms": " ".join(a for a in alarms if a != evaluation.state.statement) or "none",
        "guard bands": "one-sided normal quantile times the standard deviation of noise, "
        "placement, calibration and state of the mounts together",
    }
    if command:
        rows["command"] = command
    return pd.DataFrame({"condition": list(rows), "in this test": list(rows.values())})


def verdict_table(verdicts: Sequence[ComponentVerdict]) -> pd.DataFrame:
    """Write one row per limit, in its unit; from and to are the value, guard band to each side."""
    rows = []
    for verdict in verdicts:
        unit, size = _unit_of(verdict)
        low, high = verdict.bounds.at_least, verdict.bounds.at_most
        rows.append(
            {
                "characteristic": _characteristic(verdict),
                "unit": unit,
                "at least": low / size if np.isfinite(low) else np.nan,
                "at most": high / size if np.isfinite(high) else np.nan,
                "measured": verdict.value / size,
                "guard band ±": verdict.pass_guard / size,
                "from": verdict.interval[0] / size,
                "to": verdict.interval[1] / size,
                "verdict": verdict.decision.value,
            }
        )
    return pd.DataFrame(rows)


def shown_verdicts(table: pd.DataFrame) -> pd.DataFrame:
    """Write the same for a page: characteristic, limit, value with its guard band, verdict."""
    rows = []
    for row in table.to_dict("records"):
        unit, guard = row["unit"], row["guard band ±"]
        digits = max(1 - math.floor(math.log10(guard)), 0)  # two digits of the guard band
        bounds = [
            f"{sign} {row[end]:.5g}"
            for sign, end in (("≥", "at least"), ("≤", "at most"))
            if np.isfinite(row[end])
        ]
        measured = f"{row['measured']:.{digits}f} ± {guard:.{digits}f} {unit}"
        rows.append(
            {
                "characteristic": row["characteristic"],
                "limit": f"{', '.join(bounds)} {unit}",
                "measured ± guard band": measured,
                "verdict": row["verdict"],
            }
        )
    return pd.DataFrame(rows)


def _characteristic(verdict: ComponentVerdict) -> str:
    """Name the characteristic, and the line that decides where it has several."""
    if not verdict.line or "–" not in verdict.name or verdict.doubt:
        return verdict.name
    return f"{verdict.name}; decided at {verdict.line:.3g} Hz"


def _unit_of(verdict: ComponentVerdict) -> tuple[str, float]:
    """Return the unit of a verdict's table, and its size in SI."""
    if verdict.name == STATIC:
        return "g mm", 1e-6
    if verdict.name == DYNAMIC:
        return "g mm²", 1e-9
    return ("N m/rad", 1.0) if "stiffness r" in verdict.name else ("N/mm", 1e3)


def open_points(verdicts: Sequence[ComponentVerdict]) -> pd.DataFrame:
    """Say what was not decided, and which measurement would decide it: a row per open limit."""
    rows = [
        {"not decided": _characteristic(verdict), "what would decide it": _remedy(verdict)}
        for verdict in verdicts
        if verdict.decision is Decision.UNDECIDED
    ]
    return pd.DataFrame(rows, columns=["not decided", "what would decide it"])


def _remedy(verdict: ComponentVerdict) -> str:
    """Say which measurement would decide a limit that is open."""
    if verdict.doubt:
        return f"{verdict.doubt[:1].upper()}{verdict.doubt[1:].rstrip('.')}."
    if verdict.repetitions > AFFORDABLE:
        return (
            "The value lies on its limit: no affordable measurement will decide it. Agree on the "
            "limit, or on who bears the uncertainty."
        )
    unit, size = _unit_of(verdict)
    guard = verdict.pass_guard / size
    return (
        f"A guard band of ± {verdict.shrinkage * guard:.2g} {unit} instead of ± {guard:.2g}, if "
        f"the value stays: the mean of {verdict.repetitions} set-ups, sensors glued and impacts "
        f"placed anew, or sensors and impacts {1 / verdict.shrinkage:.2g} times better calibrated "
        "and placed."
    )
