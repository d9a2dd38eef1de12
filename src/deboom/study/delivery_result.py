"""Tables, figures, headline numbers and page of a judged delivery."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.report import figures
from deboom.report.figures import CurvePanel
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.delivery import INTERVAL, Delivery, JudgedPart, Verdict
from deboom.study.result import Scalar, StudyResult

PERCENT, MILLI = 100.0, 1e-3
VERDICTS = ["batch", "parts", "passed", "failed", "undecided", "verdict", "reason"]
SHARES = [
    "batch",
    "pieces inside [%]",
    "at least [%]",
    "cars within the limit [%]",
    "from [%]",
    "to [%]",
]
TERMS = ("stiffness factor", "dynamic stiffness", "tolerance", "SPL")


def delivery_result(delivery: Delivery, inputs: tuple[Path, ...]) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    delivery : Delivery
    inputs : tuple of Path
        Every file that was read.

    Returns
    -------
    StudyResult
        Tables ``parts``, ``batches``, ``capability``; with a platform ``levels``.
    """
    tables = {
        "batches": batch_table(delivery),
        "parts": part_table(delivery),
        "capability": capability_table(delivery),
    }
    if any(batch.cars is not None for batch in delivery.batches):
        tables["levels"] = level_table(delivery)
    pictures = delivery_figures(delivery)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=delivery_summary(delivery),
        page=_page(delivery, tables, pictures),
        inputs=inputs,
    )


def part_table(delivery: Delivery) -> pd.DataFrame:
    """One row per part: stiffness, share of today's, verdict and reason."""
    axes = sorted({axis for one in delivery.parts for axis in one.factors})
    return pd.DataFrame(
        [
            {
                "part": one.part.name,
                "batch": one.part.batch,
                "mount": one.part.mount,
                **{f"{a} [N/mm]": _stiffness(delivery, one, a) for a in axes},
                **{f"{a} over today's [1]": one.factors.get(a, np.nan) for a in axes},
                "verdict": one.verdict.value,
                "reason": one.reason,
            }
            for one in delivery.parts
        ]
    )


def _stiffness(delivery: Delivery, one: JudgedPart, axis: str) -> float:
    """Return factor times today's stiffness [N/mm]; nan where either is not known."""
    today = delivery.box.variable(f"{one.part.mount} {axis}").reference_stiffness
    return MILLI * (np.nan if today is None else today) * one.factors.get(axis, np.nan)


def batch_table(delivery: Delivery) -> pd.DataFrame:
    """One row per batch: parts by verdict, cars within the limit, verdict and reason."""
    rows = []
    for batch in delivery.batches:
        counts, pieces = batch.counts, batch.pieces
        cars = batch.cars.within if batch.cars else None
        rows.append(
            {
                "batch": f"{batch.mount} {batch.name}",
                "parts": len(batch.parts),
                "passed": counts[Verdict.passed],
                "failed": counts[Verdict.failed],
                "undecided": counts[Verdict.undecided],
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


def capability_table(delivery: Delivery) -> pd.DataFrame:
    """One row per batch and limited axis: mean, scatter, Cp and Cpk with their lower bounds."""
    rows: list[dict[str, object]] = []
    for batch in delivery.batches:
        for axis, found in batch.capabilities.items():
            variable = delivery.box.variable(f"{batch.mount} {axis}")
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


def level_table(delivery: Delivery) -> pd.DataFrame:
    """One row per batch and vehicle: levels of the predicted cars against the limit."""
    rows = []
    for batch in delivery.batches:
        if batch.cars is None:
            continue
        for place, response in enumerate(delivery.box.responses):
            levels = batch.cars.levels[..., place]
            low, middle, high = np.quantile(levels, [0.05, 0.5, 0.95])
            rows.append(
                {
                    "batch": f"{batch.mount} {batch.name}",
                    "vehicle": response.name,
                    "limit [dB(A)]": response.limit,
                    "median [dB(A)]": middle,
                    "5 % of the cars below [dB(A)]": low,
                    "95 % of the cars below [dB(A)]": high,
                    "cars within the limit [%]": PERCENT * float(np.mean(levels <= response.limit)),
                }
            )
    return pd.DataFrame(rows)


def delivery_summary(delivery: Delivery) -> dict[str, Scalar]:
    """Headline numbers; ``deboom accept --help`` explains them."""
    verdicts = [one.verdict for one in delivery.parts]
    bounds = [one.cpk_bound for batch in delivery.batches for one in batch.capabilities.values()]
    summary: dict[str, Scalar] = {
        "n_parts": len(verdicts),
        "n_passed": verdicts.count(Verdict.passed),
        "n_failed": verdicts.count(Verdict.failed),
        "n_undecided": verdicts.count(Verdict.undecided),
        "n_batches": len(delivery.batches),
        "n_batches_passed": sum(b.verdict is Verdict.passed for b in delivery.batches),
        "n_batches_failed": sum(b.verdict is Verdict.failed for b in delivery.batches),
        "share_stated": delivery.box.share_stated,
    }
    if bounds:
        summary["cpk_at_least_smallest"] = min(bounds)
    pieces = [batch.pieces.low for batch in delivery.batches if batch.pieces]
    if pieces:
        summary["pieces_inside_at_least_smallest"] = min(pieces)
    cars = [batch.cars.within.middle for batch in delivery.batches if batch.cars]
    if cars:
        summary["cars_within_limit_smallest"] = min(cars)
    return summary


def delivery_figures(delivery: Delivery) -> dict[str, bytes]:
    """Draw the parts in their intervals, and the predicted levels; file stem → PNG."""
    pictures = {"parts": figures.parts_in_intervals(_rows(delivery))}
    panels = []
    for batch in delivery.batches:
        if batch.cars is None:
            continue
        curves = {}
        share = np.linspace(0.0, PERCENT, 101)
        for place, response in enumerate(delivery.box.responses):
            over = batch.cars.levels[..., place].ravel() - response.limit
            curves[response.name] = np.quantile(over, share / PERCENT)
        panels.append(CurvePanel(f"{batch.mount} {batch.name}", share, curves))
    if panels:
        pictures["levels"] = figures.curve_panels(
            panels,
            x_label="share of the cars [%]",
            y_label="level less limit [dB]",
            columns=min(3, len(panels)),
            share_y=True,
        )
    return pictures


def _rows(delivery: Delivery) -> list[figures.PartsRow]:
    rows = []
    for batch in delivery.batches:
        axes = dict.fromkeys(axis for one in batch.parts for axis in one.factors)
        for axis in axes:
            variable = delivery.box.variable(f"{batch.mount} {axis}")
            rows.append(
                figures.PartsRow(
                    f"{batch.mount} {axis}, {batch.name}",
                    (variable.lower, variable.upper),
                    {
                        verdict.value: np.array(
                            [one.factors[axis] for one in batch.parts if one.axes[axis] is verdict]
                        )
                        for verdict in Verdict
                    },
                )
            )
    return rows


def _not_passed(parts: pd.DataFrame) -> tuple[Table, ...]:
    """Parts that need a look; all of them stand in ``parts.csv``."""
    shown = parts.loc[parts["verdict"] != Verdict.passed.value, ["part", "verdict", "reason"]]
    if shown.empty:
        return ()
    return (Table(shown, "Parts that do not pass; parts.csv has all of them."),)


def _page(
    delivery: Delivery, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    box, verdicts = delivery.box, [one.verdict for one in delivery.parts]
    passed = sum(batch.verdict is Verdict.passed for batch in delivery.batches)
    low, high = (f"{PERCENT * end:g}" for end in INTERVAL)
    conditions = dict.fromkeys(v.condition for v in box.variables if v.required)
    warnings = []
    if delivery.uncertainty == 0.0:
        warnings.append(
            "The uncertainty of the measured stiffnesses was not stated (--uncertainty): parts "
            "near to an end of their interval are decided as if they were known exactly."
        )
    if not delivery.predicted:
        warnings.append("No platform was given (--platform): the cars' levels are not predicted.")
    if not delivery.same_data:
        warnings.append(
            "The platform's files are not those that the box was found with: the predicted levels "
            "belong to today's files."
        )
    sections = [
        Section(
            "Batches",
            "A batch passes if every measured part passes and at least "
            f"{PERCENT * box.share_stated:g} % of its pieces, measured or not, lie inside beyond "
            "doubt: few measured parts leave much open. Beside it stand the cars that get their "
            "mounts from the batch, all other mounts anywhere in the box, with the interval from "
            f"{low} to {high} %. The box promises its share for parts all over it: a batch in a "
            "corner may keep every interval and still make loud cars.",
            tables=(
                Table(tables["batches"][VERDICTS], "One row per batch."),
                Table(tables["batches"][SHARES], "What the measured parts say of all."),
            ),
        ),
        Section(
            "Parts in their intervals",
            f"Stiffness over today's, {'; '.join(conditions)}. Measure deliveries there.",
            figures=(
                Picture(pictures["parts"], "Parts in their intervals", "The bar is the interval."),
            ),
            tables=_not_passed(tables["parts"]),
        ),
        Section(
            "Capability",
            "Cp compares the width of the interval with the scatter, Cpk also sees a mean off its "
            "middle. The bounds hold with 95 % confidence for a normal process; Cpk from about 20 "
            "parts upwards.",
            tables=(Table(tables["capability"], "One row per batch and limited axis."),),
        ),
    ]
    if "levels" in tables:
        sections.append(
            Section(
                "Predicted levels",
                f"{box.quantity.capitalize()} of the cars of each batch, with pieces that the "
                "measured ones lead one to expect; few pieces give a wide spread.",
                figures=(
                    Picture(
                        pictures["levels"],
                        "Levels of the predicted cars less the limit",
                        "Cars in the order of their level; above zero they miss the limit.",
                    ),
                ),
                tables=(Table(tables["levels"], "One row per batch and vehicle."),),
            )
        )
    return Page(
        title="Acceptance of a delivery",
        question=f"Do these parts keep the acceptance box of {box.title.partition(':')[0]}?",
        headlines=(
            Headline(f"{passed} of {len(delivery.batches)}", "batches pass"),
            Headline(f"{verdicts.count(Verdict.failed)}", f"of {len(verdicts)} parts fail"),
            Headline(f"{verdicts.count(Verdict.undecided)}", "parts undecided"),
        ),
        terms=TERMS,
        warnings=tuple(warnings),
        sections=tuple(sections),
    )
