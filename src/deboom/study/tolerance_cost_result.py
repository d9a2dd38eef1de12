"""Tables, figures, headline numbers and page of tolerances with a price."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.report import figures
from deboom.report.figures import CurvePanel
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import mount_of, signed
from deboom.study.motion_report import motion_report
from deboom.study.result import Scalar, StudyResult
from deboom.study.tolerance_cost import DRAWS, ToleranceStudy

TERMS = ("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")
PERCENT = 100.0


def tolerance_cost_result(study: ToleranceStudy, inputs: tuple[Path, ...] = ()) -> StudyResult:
    """Make tables, figures, headline numbers and page.

    Parameters
    ----------
    study : ToleranceStudy
        Searched.
    inputs : tuple of Path
        Files read beside the platform's.

    Returns
    -------
    StudyResult
        Tables ``front``, ``designs``, ``tolerances``, ``budgets``.
    """
    tables = {
        "front": front_table(study),
        "designs": design_table(study),
        "budgets": budget_table(study),
        "tolerances": tolerance_table(study),
    }
    pictures = tolerance_figures(study)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=tolerance_summary(study),
        page=_page(study, tables, pictures),
        inputs=(*study.platform.input_files, *inputs),
        facts={"kernel": study.index.kernel.name},
    )


def front_table(study: ToleranceStudy) -> pd.DataFrame:
    """One row per design of the front, in the draws of the search."""
    front = study.search.front
    return pd.DataFrame(
        {
            "point": np.arange(1, len(front) + 1),
            "SPLV mean sum [dB(A)]": front.mean_sum,
            "SPLV sigma sum [dB]": front.sigma_sum,
            "cost [1]": study.costs,
        }
    )


def design_table(study: ToleranceStudy) -> pd.DataFrame:
    """One row per design of the front: stiffness factors and tolerances."""
    designs, labels = study.search.front.designs, study.response.space.labels
    columns = {label: designs[:, place] for place, label in enumerate(labels)}
    return pd.DataFrame({"point": np.arange(1, len(designs) + 1), **columns})


def budget_table(study: ToleranceStudy) -> pd.DataFrame:
    """Today's design, then every quiet design with the least scatter for its cost, verified."""
    scale, base = study.per_line, study.baseline
    chosen, same = study.verified, study.uniform
    sigma = np.concatenate([base.sigma_sum, chosen.sigma_sum]) * scale
    mean = np.concatenate([base.mean_sum, chosen.mean_sum]) * scale
    cost = np.concatenate([[study.baseline_cost], study.costs[list(study.rows)]])
    return pd.DataFrame(
        {
            "design": ["today's", *(f"point {row + 1}" for row in study.rows)],
            "cost [1]": cost,
            "mean level [dB(A)]": mean,
            "sigma of the level [dB]": sigma,
            "change of sigma [%]": PERCENT * (sigma / sigma[0] - 1.0),
            "sigma, one tolerance everywhere [dB]": np.concatenate(
                [sigma[:1], same.sigma_sum * scale]
            ),
        }
    )


def tolerance_table(study: ToleranceStudy) -> pd.DataFrame:
    """One row per direction: tolerance at the cheapest, at today's and at twice that precision."""
    table: dict[str, object] = {"variable": list(study.variables)}
    for name, place in _shown(study).items():
        tolerances = study.response.split(study.verified.designs)[1]
        table[f"{name} [%]"] = PERCENT * tolerances[place]
    return pd.DataFrame(table)


def tolerance_summary(study: ToleranceStudy) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    base = float(study.baseline.sigma_sum[0])
    place = _shown(study)["at today's cost"]
    sigma, same = study.verified.sigma_sum[place], study.uniform.sigma_sum[place]
    mean = study.verified.mean_sum[place] - study.baseline.mean_sum[0]
    return {
        "sigma_change_percent_at_todays_cost": float(PERCENT * (sigma / base - 1.0)),
        "sigma_change_percent_by_allocation": float(PERCENT * (sigma / same - 1.0)),
        "mean_change_db_per_line_at_todays_cost": float(mean * study.per_line),
        "sigma_change_percent_most_precise": float(
            PERCENT * (study.verified.sigma_sum[-1] / base - 1.0)
        ),
        "cost_most_precise": float(study.costs[study.rows[-1]]),
        "cost_for_todays_sigma": _cost_for(study, base),
        "n_front": len(study.search.front),
        "n_evaluated": study.search.n_evaluated,
        "n_failed": study.search.n_failed,
        "seconds_search": round(study.search.seconds, 3),
    }


def tolerance_figures(study: ToleranceStudy) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    scale, cost = study.per_line, study.costs[list(study.rows)]
    tolerances = PERCENT * study.response.split(study.verified.designs)[1]
    few = _few(len(cost))
    mounts = dict.fromkeys(mount_of(name) for name in study.variables)
    panels = [
        CurvePanel(
            mount,
            cost[few],
            {
                name.removeprefix(f"{mount} "): tolerances[few, place]
                for place, name in enumerate(study.variables)
                if mount_of(name) == mount
            },
        )
        for mount in mounts
    ]
    return {
        "cost_of_scatter": figures.fronts(
            {
                "tolerances chosen": (cost, study.verified.sigma_sum * scale),
                "one tolerance everywhere": (cost, study.uniform.sigma_sum * scale),
            },
            {},
            {"today's": (study.baseline_cost, float(study.baseline.sigma_sum[0]) * scale)},
            mean_label="cost of the tolerances [1]",
            sigma_label="σ of the mean level [dB]",
        ),
        "tolerances": figures.curve_panels(
            panels, x_label="cost [1]", y_label="tolerance ± [%]", columns=2, share_y=True
        ),
        "front": figures.map_panels(
            [
                figures.MapPanel(
                    "every design of the front",
                    study.costs,
                    study.search.front.sigma_sum * scale,
                    study.search.front.mean_sum * scale,
                )
            ],
            x_label="cost of the tolerances [1]",
            y_label="σ of the mean level [dB]",
            value_label="mean level over vehicles and lines [dB(A)]",
            columns=1,
        ),
    }


def _shown(study: ToleranceStudy) -> dict[str, int]:
    """Places of the designs whose tolerances are listed; the cheapest one where none affords."""
    budgets = {"at today's cost": study.baseline_cost}
    return {
        "cheapest": 0,
        **{name: max(study.at_budget(budget), 0) for name, budget in budgets.items()},
        "most precise": len(study.rows) - 1,
    }


def _cost_for(study: ToleranceStudy, sigma: float) -> float:
    """Return the least cost of a quiet design with no more scatter; nan if there is none."""
    enough = np.flatnonzero(study.verified.sigma_sum <= sigma)
    return float(study.costs[study.rows[enough[0]]]) if enough.size else float("nan")


def _page(
    study: ToleranceStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    summary, search, cost = tolerance_summary(study), study.search, study.response.cost
    at_today = float(summary["sigma_change_percent_at_todays_cost"])
    allocated = float(summary["sigma_change_percent_by_allocation"])
    louder = float(summary["mean_change_db_per_line_at_todays_cost"])
    return Page(
        title="What tighter tolerances buy",
        question=(
            "Which directions of the mounts deserve tight tolerances, and what does less scatter "
            f"of the noise in {', '.join(study.index.response_names)} cost?"
        ),
        headlines=(
            Headline(f"{signed(at_today, 0)} %", "σ at today's cost"),
            Headline(f"{signed(allocated, 0)} %", "σ against one tolerance everywhere"),
            Headline(f"{signed(louder, 2)} dB", "mean level of that design"),
        ),
        terms=TERMS,
        warnings=(
            "The price of a tolerance is an assumption: weight × (reference / tolerance − 1) per "
            f"direction, weights {_span(cost.weight)}, references {_span(cost.reference)}. Give "
            "your own with --cost-table.",
            *motion_report(study.index, study.response.robust.space.nominal[np.newaxis]).warnings,
        ),
        sections=(
            Section(
                "What scatter costs",
                f"Of all designs within {study.mean_margin:g} dB of the quietest one, those with "
                f"the least scatter for their cost; evaluated with {DRAWS} independent draws. "
                "Beside them the same stiffnesses at the same cost, with one tolerance "
                "everywhere.",
                figures=(_picture(pictures, "cost_of_scatter", "Scatter over cost."),),
                tables=(
                    Table(
                        tables["budgets"].iloc[_few(len(tables["budgets"]))],
                        "Today's design and designs of the chosen tolerances, per line.",
                        {
                            "mean level [dB(A)]": 2,
                            "sigma of the level [dB]": 3,
                            "cost [1]": 2,
                            "sigma, one tolerance everywhere [dB]": 3,
                        },
                    ),
                ),
            ),
            Section(
                "Where to be precise",
                "A direction at the widest tolerance needs none; one that goes down first is what "
                "scatter comes from.",
                figures=(_picture(pictures, "tolerances", "Tolerance of each direction."),),
                tables=(Table(tables["tolerances"], "Half widths, three standard deviations."),),
            ),
            Section(
                "The front",
                f"NSGA-II over {study.response.space.n_variables} variables and three objectives: "
                f"{search.n_evaluated} designs were evaluated, {search.n_failed} failed, "
                f"{len(search.front)} are on the front, {search.seconds:.1f} s.",
                figures=(_picture(pictures, "front", "Cost, scatter and mean level."),),
            ),
        ),
    )


def _few(count: int, wanted: int = 12) -> list[int]:
    """Return about `wanted` rows, evenly over all, first and last among them."""
    return sorted({int(row) for row in np.linspace(0, count - 1, min(wanted, count))})


def _span(values: np.ndarray) -> str:
    low, high = values.min(), values.max()
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
