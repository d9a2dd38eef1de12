"""The reports on a judged delivery: for the vehicle side, and for the supplier."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT
from deboom.files.supplier_words import label, said
from deboom.language import Language
from deboom.report import Link, Report, Step, Table
from deboom.report.sheet import Sheet
from deboom.supplier.delivery import INTERVAL, Delivery, Demand, PartVerdict
from deboom.supplier.page import show
from deboom.supplier.rules import acceptance_rules
from deboom.supplier.sheet import SHORT_HASH

MOST_SHOWN = 40
"""How many of the parts that do not pass the supplier's page lists at most."""
SUPPLIER_BATCHES = (
    "batch",
    "parts",
    "passed",
    "failed",
    "undecided",
    "verdict",
    "inside_at_least",
    "reason",
)
CAPABILITY = {
    "batch": "batch",
    "axis": "axis",
    "parts": "parts",
    "from_ratio": "from [1]",
    "to_ratio": "to [1]",
    "mean_ratio": "mean [1]",
    "sigma_of_mean": "sigma [%]",
    "cp": "Cp [1]",
    "cp_bound": "Cp at least [1]",
    "cpk_measured": "Cpk [1]",
    "cpk_bound": "Cpk at least [1]",
    "cpk_demanded": "Cpk demanded [1]",
    "cpk_verdict": "capability",
    "outside": "outside, normal law [%]",
}
"""Columns of the table of capabilities: key → label on the page of the vehicle side."""
CAPABILITIES = ("cp", "cp_bound", "cpk_measured", "cpk_bound")
"""Columns that a page shows rounded down: a bound just below the demanded Cpk is not at it."""
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
    _answer(report, delivery, passed, failed, open_)
    if delivery.uncertainty == 0.0:
        report.warn(
            "The uncertainty of the measured stiffnesses was not stated (--uncertainty): parts "
            "near to an end of their interval are decided as if they were known exactly."
        )
    if not delivery.predicted:
        report.warn("No platform was given (--platform): the cars' levels are not predicted.")
    for process in delivery.processes:
        if process.words(Language.en):
            report.warn(f"{process.words(Language.en)}.")
    report.assume(*delivery.assumed)
    if not delivery.same_data:
        report.warn(
            "The files of the platform have changed since the box was computed: the predicted "
            "levels belong to the files of today."
        )
    batches = delivery.batches
    report.number("n_batches", len(batches), "", "batches", headline="d")
    report.number("n_batches_passed", passed, "", "batches that pass", headline="d")
    n_batches_failed = sum(batch.verdict is PartVerdict.failed for batch in batches)
    report.number("n_batches_failed", n_batches_failed, "", "batches that fail")
    report.number("n_parts", len(verdicts), "", "parts that were measured")
    report.number("n_passed", verdicts.count(PartVerdict.passed), "", "parts that pass")
    report.number("n_failed", failed, "", "parts that fail", headline="d")
    report.number("n_undecided", open_, "", "parts that are undecided", headline="d")
    report.number("share_stated", demand.share_stated, "1", "share of the cars that the box states")
    if bounds := [c.cpk_bound for batch in batches for c in batch.capabilities.values()]:
        report.number(
            "cpk_at_least_smallest", min(bounds), "1", "smallest Cpk of a batch, at 95 % confidence"
        )
    if shares := [batch.pieces.low for batch in batches if batch.pieces]:
        report.number(
            "pieces_inside_at_least_smallest",
            min(shares),
            "1",
            "smallest share of a batch inside the box, lower end of its interval",
        )
    if within := [batch.cars.within.middle for batch in batches if batch.cars]:
        report.number(
            "cars_within_limit_smallest",
            min(within),
            "1",
            "smallest share of cars with the parts of a batch that keep their limit",
        )
    report.inputs += inputs

    _batches(report, delivery)
    _parts(report, delivery)
    _capability(report, delivery)
    if any(batch.cars is not None for batch in delivery.batches):
        _levels(report, delivery)
    return report


def _answer(report: Report, delivery: Delivery, passed: int, failed: int, open_: int) -> None:
    """Fill the first screen: the verdict, each batch with its reason, and what comes next."""
    batches, n_parts = _batch_table(delivery), len(delivery.parts)
    count = len(delivery.batches)
    loud = [
        f" {batch.mount} {batch.name}: {batch.reason()}."
        for batch in delivery.batches
        if batch.verdict is PartVerdict.passed and batch.reason()
    ]
    report.answer(
        f"{passed} of {count} {'batch passes' if count == 1 else 'batches pass'}: of {n_parts} "
        f"parts {failed} fail and {open_} {'is' if open_ == 1 else 'are'} undecided."
        + "".join(loud),
        "How sure: a part passes where the measuring uncertainty leaves no doubt "
        f"(±{PERCENT * delivery.uncertainty:g} %, 95 %); a batch where its parts show at least "
        f"{PERCENT * delivery.demand.share_stated:g} % of all its pieces inside.",
        _parts_and_state(delivery.demand),
        _trend(delivery, Language.en),
    )
    reasons = batches.loc[batches["reason"] != "", ["batch", "reason"]].to_numpy()
    report.panel(
        "Each batch",
        Table(batches[VERDICTS[:-1]], ""),
        *(f"{batch}: {reason}" for batch, reason in reasons),
        wide=True,
    )
    if delivery.predicted:
        shown = ["batch", "cars within the limit [%]", "from [%]", "to [%]"]
        report.panel(
            "Cars with parts of each batch",
            Table(batches[shown], "", dict.fromkeys(shown[1:], 0)),
            "Within the noise limit, all other mounts anywhere in the box. The box promises "
            f"{PERCENT * delivery.demand.share_stated:g} % for parts all over it, not for each "
            "batch: this is reported and decides nothing.",
        )
    report.panel(
        "What to do next",
        Link("supplier.html", "The verdict for the supplier"),
        Step(
            "deboom accept SPECIFICATION PARTS",
            "judge again, after more measurements of undecided parts",
        ),
    )


def _parts_and_state(demand: Demand) -> str:
    """Name part number and test state."""
    sheet = demand.sheet
    states = "; ".join(dict.fromkeys(v.condition for v in demand.variables if v.required))
    if sheet is None:
        return (
            "No sheet was given, so part number, drawing, revision and machine state are not "
            f"stated. State of the box: {states}. Intervals and values are shares of today's "
            "stiffness there."
        )
    names = (
        ("Part number", sheet.part_number),
        ("drawing", sheet.drawing),
        ("revision", sheet.revision),
    )
    number = ", ".join(f"{name} {value or 'not stated'}" for name, value in names)
    return (
        f"{number}. Test state: {states}. Intervals and values are shares of today's stiffness "
        "there."
    )


def _trend(delivery: Delivery, language: Language) -> str:
    """Say how the mean of each limited axis moves from the first batch to the last."""
    means: dict[str, list[tuple[str, float]]] = {}
    for batch in delivery.batches:
        for axis in dict.fromkeys(axis for part in batch.parts for axis in part.factors):
            if not delivery.demand.variable(f"{batch.mount} {axis}").required:
                continue
            factors = [part.factors[axis] for part in batch.parts if axis in part.factors]
            means.setdefault(f"{batch.mount} {axis}", []).append(
                (batch.name, float(np.mean(factors)))
            )
    moves = [
        language.say("{} from {} ({}) to {} ({})", "{} von {} ({}) auf {} ({})").format(
            name,
            language.local(f"{series[0][1]:.3f}"),
            series[0][0],
            language.local(f"{series[-1][1]:.3f}"),
            series[-1][0],
        )
        for name, series in means.items()
        if len(series) > 1
    ]
    told = language.say(
        "Trend of the means over the batches, over today's",
        "Trend der Mittelwerte über die Chargen, über heute",
    )
    return f"{told}: {'; '.join(moves)}." if moves else ""


def _batches(report: Report, delivery: Delivery) -> None:
    """Say when a batch passes, and list the batches."""
    demand = delivery.demand
    low, high = (f"{PERCENT * end:g}" for end in INTERVAL)
    report.section(
        "Batches",
        "A batch passes if every measured part passes and at least "
        f"{PERCENT * demand.share_stated:g} % of its pieces, measured or not, lie inside beyond "
        "doubt: few measured parts leave much open. Beside it stand the cars that get their "
        "mounts from the batch, all other mounts anywhere in the box, with the interval from "
        f"{low} to {high} %. The share of the box is valid for parts spread over the whole box: a "
        "batch in a corner may keep every interval and still make loud cars.",
    )
    batches = _batch_table(delivery)
    report.table("batches", batches, "One row per batch.", shown=batches[VERDICTS])
    report.table(None, batches[SHARES], "What the measured parts say of all.")


def _parts(report: Report, delivery: Delivery) -> None:
    """Draw the parts of each batch in their intervals, and list those that do not pass."""
    demand = delivery.demand
    conditions = dict.fromkeys(v.condition for v in demand.variables if v.required)
    report.section(
        "Parts in their intervals",
        f"Stiffness over today's, {'; '.join(conditions)}. Measure deliveries there.",
    )
    rows = {
        f"{batch.mount} {axis}, {batch.name}": (
            demand.variable(f"{batch.mount} {axis}"),
            np.quantile([part.factors[axis] for part in batch.parts], [0.5, 0.0, 1.0]),
        )
        for batch in delivery.batches
        for axis in dict.fromkeys(axis for part in batch.parts for axis in part.factors)
    }
    panel = plot.IntervalPanel(
        "dynamic stiffness over today's [1]",
        {"": tuple(np.transpose([measured for _, measured in rows.values()]))},
        allowed=tuple(
            np.transpose([(direction.lower, direction.upper) for direction, _ in rows.values()])
        ),
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


def _capability(report: Report, delivery: Delivery) -> None:
    """Say what Cp and Cpk tell, and list them."""
    demand = delivery.demand
    report.section(
        "Capability",
        "Cp compares the width of the interval with the scatter, Cpk also sees a mean off its "
        "middle. The bounds hold with 95 % confidence for a normal process; Cpk from about 20 "
        "parts upwards."
        + (
            f" The sheet demands a Cpk of {demand.cpk:g} [1]: shown where the lower bound reaches "
            "it, missed where the sample's own value is below."
            if demand.cpk is not None
            else ""
        ),
    )
    table = _capability_table(delivery)
    shown = rounded_down(table, [CAPABILITY[key] for key in CAPABILITIES], decimals=3)
    report.table(
        "capability",
        table,
        "One row per batch and limited axis, and one for all batches of a mount, whose scatter is "
        "overall: what batches differ by is in it. Cp and Cpk are rounded down.",
        shown=shown,
    )


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
                "reason": batch.reason(),
            }
        )
    return pd.DataFrame(rows)


def _capabilities(delivery: Delivery, language: Language) -> pd.DataFrame:
    """One row per batch and limited axis, by keys, and one for all batches of a mount.

    Mean, scatter, Cp and Cpk with lower bounds. Where a Cpk was demanded, it stands there with
    what the sample says of it.
    """
    measured_of = [
        (batch.mount, batch.name, axis, measured)
        for batch in delivery.batches
        for axis, measured in batch.capabilities.items()
    ]
    measured_of += [
        (each.mount, said("all batches", language, n=each.n_batches), each.axis, each.overall)
        for each in delivery.processes
    ]
    rows: list[dict[str, object]] = []
    for mount, name, axis, measured in measured_of:
        variable = delivery.demand.variable(f"{mount} {axis}")
        row: dict[str, object] = {
            "batch": f"{mount} {name}",
            "axis": axis,
            "parts": measured.n,
            "from_ratio": variable.lower,
            "to_ratio": variable.upper,
            "mean_ratio": measured.mean,
            "sigma_of_mean": PERCENT * measured.sigma / measured.mean,
            "cp": measured.cp,
            "cp_bound": measured.cp_bound,
            "cpk_measured": measured.cpk,
            "cpk_bound": measured.cpk_bound,
        }
        verdict = delivery.demand.capability_verdict(measured)
        if verdict is not None:
            row |= {"cpk_demanded": delivery.demand.cpk}
            row |= {"cpk_verdict": said(verdict.value, language)}
        rows.append(row | {"outside": PERCENT * measured.expected_outside})
    return pd.DataFrame(rows, columns=None if rows else ["batch", "axis"])


def rounded_down(table: pd.DataFrame, columns: Sequence[str], decimals: int) -> pd.DataFrame:
    """Round capabilities down to the decimals that are shown."""
    if table.empty:
        return table
    size = 10.0**decimals
    # what binary numbers lose of a decimal one must not cost a digit
    return table.assign(**{key: np.floor(size * table[key] + 1e-9) / size for key in columns})


def _capability_table(delivery: Delivery) -> pd.DataFrame:
    """Give the same with the labels of the page of the vehicle side."""
    return _capabilities(delivery, Language.en).rename(columns=CAPABILITY)


def _head(page: Sheet, delivery: Delivery, judged_on: str) -> dict[str, str]:
    """Return what stands above the verdicts, by its label: sheet, day, counts and limits."""
    demand, sheet = delivery.demand, delivery.demand.sheet
    verdicts = [judged.verdict for judged in delivery.parts]
    stated = f"± {page.local(PERCENT * delivery.uncertainty)} %" if delivery.uncertainty else ""
    checksum = "checksum" if sheet is not None else "box_checksum"
    head = {
        "part_number": "" if sheet is None else sheet.part_number,
        "drawing": "" if sheet is None else sheet.drawing,
        "revision": "" if sheet is None else sheet.revision,
        "issued": "" if sheet is None else sheet.issued,
        checksum: demand.checksum[:SHORT_HASH],
        "judged_on": judged_on,
        "measured_parts": str(len(verdicts)),
        **{verdict.name: str(verdicts.count(verdict)) for verdict in PartVerdict},
        "stated_uncertainty": stated,
        "stated_share": f"{page.local(PERCENT * demand.share_stated)} %",
    }
    not_given = ("part_number", "drawing", "revision", "issued")
    return {label(k, page.language): v for k, v in head.items() if v or k not in not_given}


def _demanded(page: Sheet, demand: Demand) -> None:
    """Say at which state parts were judged, and what is accepted there."""
    say = page.language.say
    if demand.sheet is None:
        states = dict.fromkeys(each.condition for each in demand.variables if each.required)
        page.section(say("State of the box", "Zustand der Box"), f"{'; '.join(states)}.")
        return
    page.section(say("State of the test", "Zustand der Prüfung"))
    rows = [
        {
            "direction": d.name,
            "preload_n": d.preload_n,
            "amplitude_mm": d.amplitude_mm,
            "frequency_hz": d.frequency_hz,
            "lower_share": None if d.lower is None else PERCENT * d.lower,
            "upper_share": None if d.upper is None else PERCENT * d.upper,
            "today": d.today_n_per_mm,
        }
        for d in demand.sheet.musts.values()
    ]
    show(page, pd.DataFrame(rows))


def supplier_verdict(delivery: Delivery, language: Language, judged_on: str) -> Sheet:
    """Write the page that the supplier gets: verdicts, reasons and rules, nothing of the vehicles.

    - `judged_on`: day, YYYY-MM-DD.
    """
    demand, sheet = delivery.demand, delivery.demand.sheet
    page = Sheet("", "", language)
    say = page.language.say
    page.title = say("Acceptance of a delivery", "Abnahme einer Lieferung")
    page.subtitle = say(demand.title, demand.title.replace("mount ", "Lager ", 1))
    words = {verdict: said(verdict.name, language) for verdict in PartVerdict}
    page.fields(_head(page, delivery, judged_on))
    _demanded(page, demand)
    page.section(say("Batches", "Chargen"))
    batches = [
        {
            "batch": f"{batch.mount} {batch.name}",
            "parts": len(batch.parts),
            **{verdict.name: batch.counts[verdict] for verdict in PartVerdict},
            "verdict": words[batch.verdict],
            "inside_at_least": PERCENT * batch.pieces.low if batch.pieces else np.nan,
            "reason": batch.reason(language) or "–",
        }
        for batch in delivery.batches
    ]
    show(page, pd.DataFrame(batches, columns=list(SUPPLIER_BATCHES)))
    if any(batch.capabilities for batch in delivery.batches):
        page.section(say("Capability", "Prozessfähigkeit"))
        table = _capabilities(delivery, language).drop(columns="outside")
        show(page, rounded_down(table, CAPABILITIES, decimals=2))
        page.text(_trend(delivery, language))
        drifts = [process.words(language) for process in delivery.processes]
        page.text(" ".join(f"{words}." for words in drifts if words))
    others = [judged for judged in delivery.parts if judged.verdict is not PartVerdict.passed]
    if others:
        page.section(say("Parts that do not pass", "Teile, die nicht bestehen"))
        rows = [
            {
                "part": judged.part.name,
                "verdict": words[judged.verdict],
                "reason": judged.reason(language),
            }
            for judged in others[:MOST_SHOWN]
        ]
        show(page, pd.DataFrame(rows))
    page.section(say("How it was judged", "Wie beurteilt wurde"))
    page.rules(
        acceptance_rules(
            language,
            share=demand.share_stated,
            uncertainty=delivery.uncertainty or None,
            cpk=demand.cpk,
            of_sheet=sheet is not None,
        )
    )
    return page
