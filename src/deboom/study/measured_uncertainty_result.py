"""Measured uncertainty as the result of a study: figures, page, tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.measurement.propagated_interval import Interval
from deboom.report import figures
from deboom.report.figures import IntervalPanel
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import signed
from deboom.study.measured_uncertainty import TODAY, MeasuredAgain
from deboom.study.measured_uncertainty_tables import (
    best_next,
    best_pick,
    front_table,
    next_table,
    pick_table,
    probability_table,
    ranking_table,
    source_table,
    uncertainty_summary,
    vehicle_table,
)
from deboom.study.motion_report import motion_report
from deboom.study.next_measurement import HERE, LEVEL, SERIES
from deboom.study.result import StudyResult
from deboom.vehicles.platform_uncertainty import PRIOR

TERMS = ("booming noise", "SPL", "SPLV", "noise transfer function", "dynamic stiffness", "σ")
_SHOWN = 25
_LABELS = {
    HERE: "change, here",
    SERIES: "change, anywhere",
    LEVEL: "level, here",
}


def uncertainty_result(found: MeasuredAgain, inputs: tuple[Path, ...] = ()) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    found : MeasuredAgain
        Drawn.
    inputs : tuple of Path
        Files read beside the platform's.

    Returns
    -------
    StudyResult
        Tables ``sources``, ``picks``, ``vehicles``, ``front``, ``quieter``, ``ranking``, ``next``.
    """
    design = best_pick(found)
    tables = {
        "sources": source_table(found, design),
        "picks": pick_table(found),
        "vehicles": vehicle_table(found),
        "front": front_table(found),
        "quieter": probability_table(found),
        "ranking": ranking_table(found),
        "next": next_table(found, design),
    }
    pictures = uncertainty_figures(found, tables["next"])
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=uncertainty_summary(found, design),
        page=_page(found, design, tables, pictures),
        inputs=(*found.study.uncertain.platform.input_files, *inputs),
        facts={"kernel": found.study.index.kernel.name, "draws": found.study.n_draws},
    )


def uncertainty_figures(found: MeasuredAgain, following: pd.DataFrame) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    names = found.study.names
    changed = {
        name: _bounds(found.change, place) for place, name in enumerate(names) if name != TODAY
    }
    picks = {name: row for row, name in enumerate(_front_names(found)) if name}
    columns = {
        label: f"{name}, ± [dB]"
        for name, label in _LABELS.items()
        if f"{name}, ± [dB]" in following
    }
    return {
        "changes": figures.interval_panels(
            found.study.vehicles,
            [
                IntervalPanel("mean level [dB(A)]", {TODAY: _bounds(found.level, 0)}),
                IntervalPanel("change against today's [dB]", changed),
            ],
        ),
        "front": figures.front_intervals(
            _whole(found.front_change),
            _whole(found.front_sigma),
            picks,
            mean_label="change of the mean level over vehicles and parts [dB]",
            sigma_label="σ of the mean level [dB]",
        ),
        "next": figures.interval_panels(
            following["measurement"].to_list(),
            [
                IntervalPanel("half width [dB]", {"expected": _from_zero(following[column])}, label)
                for label, column in columns.items()
            ],
        ),
    }


def _from_zero(values: pd.Series) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    own = values.to_numpy(dtype=float)
    return own, np.zeros_like(own), own


def _page(
    found: MeasuredAgain,
    design: str,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
) -> Page:
    study = found.study
    place = study.names.index(design)
    change, level = found.mean_change, found.mean_level
    following, gain = best_next(tables["next"], HERE)
    vehicles = tables["vehicles"]
    priors = tables["sources"].loc[tables["sources"]["from"] == PRIOR, "source"]
    assumed = (
        (
            f"Stated, not measured: {', '.join(priors)}. Measure some vehicles in two ways "
            "(--vehicle) to replace what concerns transfer functions.",
        )
        if len(priors)
        else ()
    )
    return Page(
        title="How surely we know what the mounts bring",
        question=(
            "With the errors of all measurements: how sure are levels, changes, the front and the "
            f"order of its designs in {', '.join(study.vehicles)}, and what should be measured "
            "next?"
        ),
        headlines=(
            Headline(
                f"{signed(float(change.value[place]), 2)} ± {change.half_width[place]:.2f} dB",
                f"change of the mean level, {design}",
            ),
            Headline(
                f"{level.value[0]:.1f} ± {level.half_width[0]:.1f} dB(A)", "mean level, today's"
            ),
            Headline(f"{100 * found.quieter[place, 0]:.0f} %", f"{design} is quieter than today's"),
            Headline(f"−{gain:.0f} %", f"of the change's interval by: {following}"),
        ),
        terms=TERMS,
        warnings=(*assumed, *motion_report(study.index, study.rows[:1]).warnings),
        sections=(
            Section(
                "Levels and changes",
                "Every measurement is drawn again with its errors, the same for all designs and "
                f"vehicles, {study.n_draws} times, and everything is computed from what comes out. "
                "A wrong calibration moves all levels of a vehicle and no change; so changes are "
                "known much better. Intervals hold the truth in 90 % of all cases; they need not "
                "lie evenly about the measured value, because noise fills notches.",
                figures=(_picture(pictures, "changes", "Measured values and 90 % intervals."),),
                tables=(
                    Table(
                        tables["picks"],
                        "Mean of the vehicles; σ is the scatter of parts within their tolerance.",
                        _decimals(tables["picks"]),
                    ),
                    *(
                        Table(
                            vehicles.loc[vehicles["design"] == name, list(columns)],
                            f"Vehicle by vehicle, {name}.",
                            {c: 2 for c in columns if c.endswith("dB]")},
                        )
                        for name, columns in (
                            (TODAY, ["vehicle", *_of_level(vehicles)]),
                            (
                                design,
                                ["vehicle", *(c for c in map(str, vehicles) if "change" in c)],
                            ),
                        )
                    ),
                ),
            ),
            Section(
                "Where it comes from",
                f"Each source alone; the change is that of {design}, mean of the vehicles.",
                tables=(Table(tables["sources"], "Sources, independent of each other."),),
            ),
            Section(
                "The front and the order of designs",
                "The intervals of neighbours move together: the share of draws in which a point "
                "stays on the front, and the probability that one design is quieter than another, "
                "count with that.",
                figures=(_picture(pictures, "front", "The front against today's design."),),
                tables=(
                    Table(tables["quieter"], "Probability that the row is quieter, mean level."),
                    Table(
                        tables["front"].iloc[_few(len(tables["front"]))],
                        "Designs of the front.",
                        _decimals(tables["front"]),
                    ),
                ),
            ),
            Section(
                "Which direction scatters a vehicle most",
                "Share of each direction in the variance by its tolerance, to first order at "
                "today's design, and how often the order stays when everything is measured again.",
                tables=(Table(tables["ranking"], "The two leading directions."),),
            ),
            Section(
                "What to measure next",
                "Half widths of 90 % intervals that are to be expected after one more measurement, "
                "computed from the variances as they are. “Any vehicle and load case” takes those "
                "measured for a sample of all; their choice then counts, with Student's t for so "
                "few.",
                figures=(
                    _picture(
                        pictures,
                        "next",
                        "Expected half widths of 90 % intervals, shorter is better; here: these "
                        "vehicles and load cases, anywhere: any.",
                    ),
                ),
                tables=(
                    Table(
                        tables["next"],
                        "Sorted by what they are worth for the first question.",
                        {n: 3 for n in map(str, tables["next"]) if n.endswith("[dB]")},
                    ),
                ),
            ),
        ),
    )


def _of_level(table: pd.DataFrame) -> list[str]:
    return [name for name in map(str, table) if name.startswith(("mean level", "loudest line"))]


def _front_names(found: MeasuredAgain) -> list[str]:
    """Name of each point of the front that is a named design."""
    return [
        next((n for n, x in found.study.designs.items() if np.array_equal(x, row)), "")
        for row in found.study.front
    ]


def _bounds(interval: Interval, place: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return interval.value[place], interval.lower[place], interval.upper[place]


def _whole(interval: Interval) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return interval.value, interval.lower, interval.upper


def _few(count: int) -> list[int]:
    return sorted({int(row) for row in np.linspace(0, count - 1, min(_SHOWN, count))})


def _decimals(table: pd.DataFrame) -> dict[str, int]:
    names = [name for name in map(str, table) if name.endswith("dB]")]
    return {name: 3 if name.startswith("sigma") else 2 for name in names}


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
