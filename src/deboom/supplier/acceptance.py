"""The command that judges a delivery: its reports for the vehicle side and for the supplier."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from deboom import plot
from deboom.common import PERCENT
from deboom.report import Report
from deboom.report.sheet import Sheet
from deboom.supplier.delivery import (
    INTERVAL,
    Delivery,
    PartVerdict,
)

MOST_SHOWN = 40
"""How many of the parts that do not pass the supplier's page lists at most."""
ENGLISH: Literal["en", "de"] = "en"
_CAPABILITY_DE = [
    *("Charge", "Richtung", "Teile", "von [1]", "bis [1]", "Mittel [1]", "σ [%]"),
    *("Cp [1]", "Cp mindestens [1]", "Cpk [1]", "Cpk mindestens [1]"),
]
_COUNTS = ["passed", "failed", "undecided"]
VERDICTS = ["batch", "parts", *_COUNTS, "verdict", "reason"]
SHARES = [
    "batch",
    "pieces inside [%]",
    "at least [%]",
    "cars within the limit [%]",
    "from [%]",
    "to [%]",
]


def delivery_report(delivery: Delivery, inputs: Sequence[Path]) -> Report:
    """Report a judged delivery to the vehicle side; `inputs` are the files that were read."""
    demand, verdicts = delivery.demand, [judged.verdict for judged in delivery.parts]
    passed = sum(batch.verdict is PartVerdict.passed for batch in delivery.batches)
    failed, open_ = verdicts.count(PartVerdict.failed), verdicts.count(PartVerdict.undecided)
    report = Report(
        "Acceptance of a delivery", f"Do these parts keep the intervals of {demand.title}?"
    )
    report.explain("stiffness factor", "dynamic stiffness", "tolerance", "SPL")
    report.tile(f"{passed} of {len(delivery.batches)}", "batches pass")
    report.tile(f"{failed}", f"of {len(verdicts)} parts fail")
    report.tile(f"{open_}", "parts undecided")
    if delivery.uncertainty == 0.0:
        report.warn(
            "The uncertainty of the measured stiffnesses was not stated (--uncertainty): parts "
            "near to an end of their interval are decided as if they were known exactly."
        )
    if not delivery.predicted:
        report.warn("No platform was given (--platform): the cars' levels are not predicted.")
    if not delivery.same_data:
        report.warn(
            "The platform's files are not those that the box was found with: the predicted levels "
            "belong to today's files."
        )
    report.summary |= {
        "n_parts": len(verdicts),
        "n_passed": verdicts.count(PartVerdict.passed),
        "n_failed": failed,
        "n_undecided": open_,
        "n_batches": len(delivery.batches),
        "n_batches_passed": passed,
        "n_batches_failed": sum(b.verdict is PartVerdict.failed for b in delivery.batches),
        "share_stated": demand.share_stated,
    }
    bounds = [c.cpk_bound for batch in delivery.batches for c in batch.capabilities.values()]
    smallest = {
        "cpk_at_least_smallest": bounds,
        "pieces_inside_at_least_smallest": [b.pieces.low for b in delivery.batches if b.pieces],
        "cars_within_limit_smallest": [b.cars.within.middle for b in delivery.batches if b.cars],
    }
    report.summary |= {name: min(values) for name, values in smallest.items() if values}
    report.inputs += inputs

    low, high = (f"{PERCENT * end:g}" for end in INTERVAL)
    report.section(
        "Batches",
        "A batch passes if every measured part passes and at least "
        f"{PERCENT * demand.share_stated:g} % of its pieces, measured or not, lie inside beyond "
        "doubt: few measured parts leave much open. Beside it stand the cars that get their "
        "mounts from the batch, all other mounts anywhere in the box, with the interval from "
        f"{low} to {high} %. The box promises its share for parts all over it: a batch in a "
        "corner may keep every interval and still make loud cars.",
    )
    batches = _batch_table(delivery)
    report.table("batches", batches, "One row per batch.", shown=batches[VERDICTS])
    report.table(None, batches[SHARES], "What the measured parts say of all.")

    conditions = dict.fromkeys(v.condition for v in demand.variables if v.required)
    report.section(
        "Parts in their intervals",
        f"Stiffness over today's, {'; '.join(conditions)}. Measure deliveries there.",
    )
    rows = {
        f"{batch.mount} {axis}, {batch.name}": (
            demand.variable(f"{batch.mount} {axis}"),
            np.quantile([one.factors[axis] for one in batch.parts], [0.5, 0.0, 1.0]),
        )
        for batch in delivery.batches
        for axis in dict.fromkeys(axis for one in batch.parts for axis in one.factors)
    }
    panel = plot.IntervalPanel(
        "dynamic stiffness over today's [1]",
        {"": tuple(np.transpose([measured for _, measured in rows.values()]))},
        allowed=tuple(np.transpose([(asked.lower, asked.upper) for asked, _ in rows.values()])),
    )
    report.figure(
        "parts",
        lambda: plot.interval_panels(list(rows), [panel]),
        "Median, smallest and largest part of each batch; grey: the interval.",
    )
    parts = delivery.table
    others = parts.loc[parts["verdict"] != PartVerdict.passed.value, ["part", "verdict", "reason"]]
    caption = "" if others.empty else "Parts that do not pass; parts.csv has all of them."
    report.table("parts", parts, caption, shown=others)

    report.section(
        "Capability",
        "Cp compares the width of the interval with the scatter, Cpk also sees a mean off its "
        "middle. The bounds hold with 95 % confidence for a normal process; Cpk from about 20 "
        "parts upwards.",
    )
    report.table("capability", _capability_table(delivery), "One row per batch and limited axis.")
    if any(batch.cars is not None for batch in delivery.batches):
        _levels(report, delivery)
    return report


def _levels(report: Report, delivery: Delivery) -> None:
    """Show the predicted levels of the cars of each batch against the limits."""
    box = delivery.demand.box
    assert box is not None
    share = np.linspace(0.0, PERCENT, 101)
    panels, rows = [], []
    for batch in delivery.batches:
        if batch.cars is None:
            continue
        name, curves = f"{batch.mount} {batch.name}", {}
        for place, response in enumerate(box.responses):
            levels = batch.cars.levels[..., place]
            over = levels.ravel() - response.limit
            curves[response.name] = np.quantile(over, share / PERCENT)
            low, middle, high = np.quantile(levels, [0.05, 0.5, 0.95])
            rows.append(
                {
                    "batch": name,
                    "vehicle": response.name,
                    "limit [dB(A)]": response.limit,
                    "median [dB(A)]": middle,
                    "5 % of the cars below [dB(A)]": low,
                    "95 % of the cars below [dB(A)]": high,
                    "cars within the limit [%]": PERCENT * float(np.mean(levels <= response.limit)),
                }
            )
        panels.append(plot.CurvePanel(name, share, curves))
    report.section(
        "Predicted levels",
        f"{box.quantity.capitalize()} of the cars of each batch, with pieces that the "
        "measured ones lead one to expect; few pieces give a wide spread.",
    )
    report.figure(
        "levels",
        lambda: plot.curve_panels(
            panels,
            x_label="share of the cars [%]",
            y_label="level less limit [dB]",
            columns=min(3, len(panels)),
            share_y=True,
        ),
        "Cars in the order of their level; above zero they miss the limit.",
    )
    report.table("levels", pd.DataFrame(rows), "One row per batch and vehicle.")


def _batch_table(delivery: Delivery) -> pd.DataFrame:
    """One row per batch: parts by verdict, shares of pieces and cars, verdict and reason."""
    rows = []
    for batch in delivery.batches:
        counts, pieces = batch.counts, batch.pieces
        cars = batch.cars.within if batch.cars else None
        rows.append(
            {
                "batch": f"{batch.mount} {batch.name}",
                "parts": len(batch.parts),
                "passed": counts[PartVerdict.passed],
                "failed": counts[PartVerdict.failed],
                "undecided": counts[PartVerdict.undecided],
                "verdict": batch.verdict.value,
                "pieces inside [%]": PERCENT * pieces.middle if pieces else np.nan,
                "at least [%]": PERCENT * pieces.low if pieces else np.nan,
                "cars within the limit [%]": PERCENT * cars.middle if cars else np.nan,
                "from [%]": PERCENT * cars.low if cars else np.nan,
                "to [%]": PERCENT * cars.high if cars else np.nan,
                "reason": batch.reason,
            }
        )
    return pd.DataFrame(rows)


def _capability_table(delivery: Delivery) -> pd.DataFrame:
    """One row per batch and limited axis: mean, scatter, Cp and Cpk with their lower bounds."""
    rows: list[dict[str, object]] = []
    for batch in delivery.batches:
        for axis, found in batch.capabilities.items():
            variable = delivery.demand.variable(f"{batch.mount} {axis}")
            rows.append(
                {
                    "batch": f"{batch.mount} {batch.name}",
                    "axis": axis,
                    "parts": found.n,
                    "from [1]": variable.lower,
                    "to [1]": variable.upper,
                    "mean [1]": found.mean,
                    "sigma [%]": PERCENT * found.sigma / found.mean,
                    "Cp [1]": found.cp,
                    "Cp at least [1]": found.cp_bound,
                    "Cpk [1]": found.cpk,
                    "Cpk at least [1]": found.cpk_bound,
                    "outside, normal law [%]": PERCENT * found.expected_outside,
                }
            )
    return pd.DataFrame(rows, columns=None if rows else ["batch", "axis"])


def supplier_verdict(delivery: Delivery, language: Literal["en", "de"]) -> Sheet:
    """Write the page that the supplier gets: verdicts and capability, nothing of the vehicles."""
    page = Sheet("", "", language)
    say, verdicts = page.say, [judged.verdict for judged in delivery.parts]
    page.title = say("Acceptance of a delivery", "Abnahme einer Lieferung")
    title = delivery.demand.title
    page.subtitle = say(title, title.replace("mount ", "Lager ", 1))
    german = {
        PartVerdict.passed: "bestanden",
        PartVerdict.failed: "nicht bestanden",
        PartVerdict.undecided: "unentschieden",
    }
    words = {verdict: say(verdict.value, german[verdict]) for verdict in PartVerdict}
    stated = f"± {page.local(PERCENT * delivery.uncertainty)} %" if delivery.uncertainty else ""
    page.fields(
        {
            say("measured parts", "gemessene Teile"): str(len(verdicts)),
            **{words[verdict]: str(verdicts.count(verdict)) for verdict in PartVerdict},
            say("measuring uncertainty, 95 %", "Messunsicherheit, 95 %"): stated,
            say("asked share of the pieces", "geforderter Anteil der Stücke"): (
                f"{page.local(PERCENT * delivery.demand.share_stated)} %"
            ),
        }
    )
    page.section(
        say("Batches", "Chargen"),
        say(
            "A batch passes if every measured part passes and the asked share of its pieces, "
            "measured or not, lies inside beyond doubt. A batch in a corner of the box, near the "
            "ends of several bands at once, is named where cars are known: it does not decide.",
            "Eine Charge besteht, wenn jedes gemessene Teil besteht und der geforderte Anteil "
            "ihrer Stücke, gemessen oder nicht, zweifelsfrei innen liegt. Liegt eine Charge in "
            "einer Ecke der Box, nahe den Enden mehrerer Bänder zugleich, wird das genannt, wenn "
            "die Fahrzeuge bekannt sind: es entscheidet nicht.",
        ),
    )
    table = _batch_table(delivery)[
        ["batch", "parts", *_COUNTS, "verdict", "at least [%]", "reason"]
    ]
    table = table.assign(
        verdict=[words[batch.verdict] for batch in delivery.batches],
        reason=[say(batch.reason, batch.reason_de) or "–" for batch in delivery.batches],
    )
    ends = (
        say("verdict", "Urteil"),
        say("pieces inside at least [%]", "innen mindestens [%]"),
        say("reason", "Grund"),
    )
    first = (say("batch", "Charge"), say("parts", "Teile"), *words.values())
    page.table(table.set_axis([*first, *ends], axis=1))
    if any(batch.capabilities for batch in delivery.batches):
        page.section(say("Capability", "Prozessfähigkeit"))
        table = _capability_table(delivery).drop(columns=["outside, normal law [%]"])
        page.table(table.set_axis(_CAPABILITY_DE, axis=1) if language == "de" else table)
    others = [judged for judged in delivery.parts if judged.verdict is not PartVerdict.passed]
    if others:
        page.section(say("Parts that do not pass", "Teile, die nicht bestehen"))
        columns = [say("part", "Teil"), say("verdict", "Urteil"), say("reason", "Grund")]
        rows = [
            (one.part.name, words[one.verdict], say(one.reason, one.reason_de))
            for one in others[:MOST_SHOWN]
        ]
        page.table(pd.DataFrame(rows, columns=columns))
    return page
