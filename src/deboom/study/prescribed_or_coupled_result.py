"""Tables, figures, headline numbers and page of prescribed against coupled motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.explore.fronts import pareto_front
from deboom.explore.robust import RobustValues
from deboom.explore.selection import at_nominal, variables_without_effect
from deboom.report import figures
from deboom.report.figures import CurvePanel
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.prescribed_or_coupled import PrescribedOrCoupled, SameDesigns
from deboom.study.result import Scalar, StudyResult

TERMS = (
    "booming noise",
    "SPLV",
    "stiffness factor",
    "tolerance",
    "σ",
    "Pareto front",
    "prescribed motion",
)
WARNING = (
    "The truth here is a model too: mounts keep their stiffness per line while the motion "
    "answers, and the body stays at rest."
)


def prescribed_or_coupled_result(study: PrescribedOrCoupled) -> StudyResult:
    """Make tables, figures, headline numbers and page of the comparison.

    Parameters
    ----------
    study : PrescribedOrCoupled
        Searched with both motions.

    Returns
    -------
    StudyResult
        Tables ``agreement``, ``benefit``, ``vehicles``, ``optima``, ``fronts``.
    """
    tables = {
        "agreement": agreement_table(study),
        "benefit": benefit_table(study),
        "vehicles": study.benefits,
        "optima": optima_table(study),
        "fronts": front_table(study),
    }
    pictures = comparison_figures(study)
    summary = comparison_summary(study)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures),
        inputs=study.platform.input_files,
        facts={
            "truth": study.truth.motion,
            "kernel_prescribed": study.kernel(study.prescribed),
            "kernel_truth": study.kernel(study.truth),
            "tolerance_draws": study.truth.robust.sample.n_samples,
            "verification_draws": study.truth.verification.n_samples,
        },
    )


def agreement_table(study: PrescribedOrCoupled) -> pd.DataFrame:
    """One row per load case and vehicle: correlation, slope, largest effect."""
    parts = [
        pd.DataFrame(
            {
                "load case": same.load_case,
                "gear": same.gear,
                "vehicle": list(same.vehicles),
                "correlation [1]": same.correlation,
                "slope [1]": same.line[0],
                "largest change, prescribed [dB]": np.abs(same.prescribed).max(axis=0),
                "largest change, true [dB]": np.abs(same.truth).max(axis=0),
            }
        )
        for same in study.same_designs
    ]
    return pd.concat(parts, ignore_index=True)


def load_case_table(agreement: pd.DataFrame) -> pd.DataFrame:
    """One row per load case: the worst correlation and the range of the slopes over vehicles."""
    groups = agreement.groupby("load case", sort=False)
    return pd.DataFrame(
        {
            "load case": list(groups.groups),
            "gear": groups["gear"].first().to_numpy(),
            "smallest correlation [1]": groups["correlation [1]"].min().to_numpy(),
            "smallest slope [1]": groups["slope [1]"].min().to_numpy(),
            "largest slope [1]": groups["slope [1]"].max().to_numpy(),
        }
    )


def benefit_table(study: PrescribedOrCoupled) -> pd.DataFrame:
    """One row per optimum: what its own model promised, and what both models say."""
    promised, real = "as prescribed motion sees it [dB]", f"true ({study.truth.motion}) [dB]"
    return pd.DataFrame(
        [
            {
                "optimum found with": f"{found.motion} motion",
                promised: study.benefit(found, study.prescribed),
                real: study.benefit(found, study.truth),
            }
            for found in study.both
        ]
    )


def optima_table(study: PrescribedOrCoupled) -> pd.DataFrame:
    """One row per design variable: the factor of each optimum; no effect: nominal."""
    table: dict[str, object] = {"variable": list(study.truth.robust.space.names)}
    for found in study.both:
        space = found.robust.space
        without = variables_without_effect(found.robust.evaluate, space)
        design = at_nominal(found.design[np.newaxis], space, without)[0]
        table[f"{found.motion} motion [1]"] = design
    return pd.DataFrame(table)


def front_table(study: PrescribedOrCoupled) -> pd.DataFrame:
    """One row per design of each front: both objectives under both models."""
    parts = []
    for found in study.both:
        values = {judge.motion: study.under(found, judge) for judge in study.both}
        parts.append(
            pd.DataFrame(
                {
                    "found with": found.motion,
                    "point": np.arange(1, len(found.search.front) + 1),
                    "optimum": np.arange(len(found.search.front)) == found.optimum,
                    **{
                        f"{name}, {motion} [{unit}]": getattr(values[motion], column)
                        for motion in (study.prescribed.motion, study.truth.motion)
                        for name, column, unit in (
                            ("SPLV mean sum", "mean_sum", "dB(A)"),
                            ("SPLV sigma sum", "sigma_sum", "dB"),
                        )
                    },
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


def comparison_summary(study: PrescribedOrCoupled) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    correlation = np.concatenate([same.correlation for same in study.same_designs])
    slope = np.concatenate([same.line[0] for same in study.same_designs])
    return {
        "r_min": float(correlation.min()),
        "slope_min": float(slope.min()),
        "slope_max": float(slope.max()),
        "benefit_prescribed_db": study.benefit(study.prescribed, study.truth),
        "benefit_coupled_db": study.benefit(study.truth, study.truth),
        "promised_prescribed_db": study.benefit(study.prescribed, study.prescribed),
        "n_compared": slope.size,
        "seconds_search": round(sum(found.search.seconds for found in study.both), 3),
    }


def comparison_figures(study: PrescribedOrCoupled) -> dict[str, bytes]:
    """Draw both pictures of the page; file stem → PNG."""
    per_line = 1.0 / (study.n_lines * len(study.vehicles))

    def pair(values: RobustValues) -> tuple[RealArray, RealArray]:
        return values.mean_sum * per_line, values.sigma_sum * per_line

    today = pair(study.nominal(study.truth))
    curves = {
        f"found with {found.motion} motion": pair(pareto_front(study.under(found, study.truth)))
        for found in study.both
    }
    first = study.same_designs[0]
    shown = [first.vehicles.index(name) for name in study.vehicles]
    return {
        "prescribed_against_coupled": figures.curve_panels(
            [_panel(first, row) for row in shown],
            x_label="change, prescribed [dB]",
            y_label=f"change, {study.truth.motion} [dB]",
            dashed=("equal",),
        ),
        "fronts": figures.fronts(
            curves,
            {},
            {"today's mounts": (float(today[0][0]), float(today[1][0]))},
            mean_label=f"mean level over vehicles and lines, {study.truth.motion} motion [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
    }


def _panel(same: SameDesigns, row: int) -> CurvePanel:
    x, y = same.prescribed[:, row], same.truth[:, row]
    slope, offset = same.line[:, row]
    ends = np.array([x.min(), x.max()])
    return CurvePanel(
        f"{same.vehicles[row]}: slope {slope:.2f}, r {same.correlation[row]:.3f}",
        ends,
        {"fitted": slope * ends + offset, "equal": ends},
        {f"{len(x)} designs": (x, y)},
    )


def _page(
    study: PrescribedOrCoupled, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    summary = comparison_summary(study)
    first, truth = study.same_designs[0], study.truth.motion
    n_designs, half = len(first.prescribed), study.truth.robust.space.tolerance.max()
    n_group = len(study.vehicles)
    promised, real = summary["promised_prescribed_db"], summary["benefit_prescribed_db"]
    return Page(
        title="Prescribed or coupled motion",
        question=(
            "Does it matter for the choice of mounts whether the powertrain's motion stays as "
            "measured while stiffnesses change, or answers?"
        ),
        headlines=(
            Headline(f"{summary['r_min']:.3f}", "smallest correlation of SPLV"),
            Headline(
                f"{summary['slope_min']:.2f} … {summary['slope_max']:.2f}",
                f"{truth} over prescribed effect",
            ),
            Headline(f"{real:.2f} dB", "true benefit of the prescribed optimum"),
            Headline(
                f"{summary['benefit_coupled_db']:.2f} dB", f"true benefit of the {truth} optimum"
            ),
        ),
        terms=TERMS,
        warnings=(WARNING,),
        sections=(
            Section(
                "The same designs under both motions",
                f"{n_designs} designs in {len(study.same_designs)} load cases and "
                f"{len(first.vehicles)} vehicles. A slope above 1: prescribed motion understates "
                "what a change of stiffness does. A correlation near 1: it ranks designs alike.",
                figures=(
                    _picture(
                        pictures,
                        "prescribed_against_coupled",
                        f"Change of the mean level of the lines against today's mounts, "
                        f"{first.load_case}; each point is a design.",
                    ),
                ),
                tables=(
                    Table(
                        load_case_table(tables["agreement"]),
                        "Correlation and slope over the vehicles; agreement.csv has each.",
                        {"smallest correlation [1]": 3},
                    ),
                ),
            ),
            Section(
                "The two optima",
                f"Both searches had the same seed, budget and draws (tolerance ±{100 * half:.0f} "
                f"%). The optimum is the best mean of each front, judged with "
                f"{study.truth.verification.n_samples} draws that no search saw, as the fall of "
                f"the mean level over {n_group} vehicles and {study.n_lines} lines. The optimum of "
                f"prescribed motion promises {promised:.2f} dB and brings {real:.2f} dB.",
                figures=(
                    _picture(
                        pictures,
                        "fronts",
                        f"Both fronts as they truly are, that is with {truth} motion.",
                    ),
                ),
                tables=(
                    Table(tables["benefit"], "Benefit of each optimum under each motion."),
                    Table(tables["optima"], "Stiffness factors of the two optima."),
                    Table(tables["vehicles"], "The same by vehicle."),
                ),
            ),
        ),
    )


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
