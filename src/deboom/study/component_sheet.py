"""One page for the supplier of a component: what was asked, measured and decided, and what not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from deboom.compressor.acceptance import Decision, overall
from deboom.files.workbook import workbook_bytes
from deboom.report.page import Headline, Page, Section, Table, render_page
from deboom.study.component_verdicts import open_points, shown_verdicts, verdict_table

if TYPE_CHECKING:
    from deboom.study.compressor_unbalance import MeasuredUnbalance

STEM = "supplier_sheet"
WORDS = {
    Decision.PASS: "accepted",
    Decision.FAIL: "rejected",
    Decision.UNDECIDED: "not decided",
}


def component_sheet(measured: MeasuredUnbalance, command: str) -> dict[str, bytes]:
    """Write the page and the workbook for the supplier.

    Parameters
    ----------
    measured : MeasuredUnbalance
        With limits.
    command : str
        That makes the sheet again; empty where the page of a study states it.

    Returns
    -------
    dict of str to bytes
        File name → content.
    """
    assert measured.limits is not None
    conditions = condition_table(measured, command)
    undecided = open_points(measured.verdicts)
    page = Page(
        title=f"Acceptance of {measured.test.name}",
        question=rule(measured),
        headlines=_headlines(measured),
        sections=(
            Section(
                "Limits and verdicts",
                "",
                tables=(
                    Table(
                        shown_verdicts(measured.verdicts),
                        "The part lies above the value less its guard band with a probability of "
                        f"{1 - measured.limits.risk:.2g}, and as surely below the value plus it.",
                    ),
                ),
            ),
            _not_decided(undecided),
            Section(
                "Conditions",
                "",
                tables=(Table(conditions, "How it was measured."),),
            ),
        ),
        compact=True,
    )
    sheets = {
        "verdicts": verdict_table(measured.verdicts),
        "not decided": undecided,
        "conditions": conditions,
    }
    return {
        f"{STEM}.html": render_page(page).encode("utf-8"),
        f"{STEM}.xlsx": workbook_bytes(sheets, page.title),
    }


def _not_decided(undecided: pd.DataFrame) -> Section:
    title = "Not decided, and what would decide it"
    if undecided.empty:
        return Section(title, "Every limit was decided.")
    return Section(title, "", tables=(Table(undecided, "Limits that are open."),))


def rule(measured: MeasuredUnbalance) -> str:
    """State the decision rule with its risk."""
    assert measured.limits is not None
    risk = measured.limits.risk
    return (
        "Decided as ISO 14253-1 has it. A limit is kept where the measured value lies inside it by "
        f"more than the guard band: a part that breaks it passes with at most {risk:.2g} "
        "probability. It is broken where the value lies outside by as much or more. In between, "
        "the measurement proves neither."
    )


def condition_table(measured: MeasuredUnbalance, command: str) -> pd.DataFrame:
    """List under which conditions the values hold, and how they are computed again."""
    found, test = measured.found, measured.test
    alarms = [*measured.kept.alarms, *found.alarms]
    chosen = found.chosen
    sweeps = ", ".join(sweep.sweep for sweep in chosen.sweeps)
    low = min(sweep.speed[0] for sweep in chosen.sweeps)
    high = max(sweep.speed[-1] for sweep in chosen.sweeps)
    hammer = test.hammer
    weighed = "not weighed" if hammer.weighed_mass is None else f"{hammer.weighed_mass:.3f} kg"
    rows = {
        "sweeps": f"{sweeps}; {low:.0f}–{high:.0f} rpm; first order",
        "sense of rotation": found.sense.statement,
        "method": f"in situ, mounted; route {chosen.route.letter}: {chosen.route.title}",
        "hammer test": f"{len(hammer.sensors)} triaxial accelerometers, {len(hammer.impacts)} "
        f"impacts; mass on the scales: {weighed}",
        "unbalance": "about the rotor's axis x, moments about the origin of the position sheet",
        "stiffness": "of the compressor on its mounts, at that origin, at the hammer's amplitude",
        "mounts in operation": measured.mount_state,
        "alarms": " ".join(one for one in alarms if one != found.state.statement) or "none",
        "guard bands": "one-sided normal quantile times the standard deviation of noise, "
        "placement, calibration and state of the mounts together",
    }
    if command:
        rows["command"] = command
    return pd.DataFrame({"condition": list(rows), "in this test": list(rows.values())})


def _headlines(measured: MeasuredUnbalance) -> tuple[Headline, ...]:
    decisions = [verdict.decision for verdict in measured.verdicts]
    return (
        Headline(WORDS[overall(measured.verdicts)], "the part"),
        *(
            Headline(
                f"{decisions.count(decision)} of {len(decisions)}", f"limits: {decision.value}"
            )
            for decision in Decision
        ),
    )
