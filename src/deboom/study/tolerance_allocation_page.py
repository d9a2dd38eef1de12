"""The page of allocated tolerances."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.study.motion_report import motion_report
from deboom.study.tolerance_allocation import DRAWS, AllocationStudy
from deboom.study.tolerance_allocation_tables import PERCENT, allocation_summary

TERMS = ("booming noise", "SPLV", "stiffness factor", "tolerance", "σ", "Pareto front")


def allocation_page(
    study: AllocationStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    """Make the page from tables and figures."""
    summary = allocation_summary(study)
    ratio = float(summary["cost_ratio_to_uniform"])
    fair = float(summary["cost_ratio_to_uniform_of_effective"])
    vehicles = ", ".join(study.vehicles)
    return Page(
        title="Cheapest tolerances of a design",
        question=(
            f"How wide may each direction of the mounts scatter, so that {_asked(study)} in "
            f"{vehicles}, at the least cost? The design is {study.chosen.name} of its front."
        ),
        headlines=(
            Headline(f"{PERCENT * ratio:.0f} %", "of the cost of one tolerance everywhere"),
            Headline(
                f"{PERCENT * fair:.0f} %", "of it, where only directions that matter are held"
            ),
            _reached(study),
        ),
        terms=TERMS,
        warnings=(
            *_not_confirmed(study),
            "The price of a tolerance is an assumption unless you bring your own: by default "
            "every direction costs 1 at ±15 % and twice as much at half the width. Ratios of "
            "costs hold for prices without a fixed part.",
            *motion_report(study.index, study.chosen.design[None, :]).warnings,
        ),
        sections=(
            Section(
                "Allocation",
                "A direction at the widest tolerance needs no precision; one that is tighter than "
                "the rest is what the noise scatters by.",
                figures=(
                    _picture(
                        pictures,
                        "allocation",
                        "Tolerance and price of every direction: the cheapest ones, and one "
                        "tolerance everywhere for the same target.",
                    ),
                ),
                tables=(Table(tables["allocation"], "Half widths, three standard deviations."),),
            ),
            Section(
                "What a tolerance is worth",
                "σ is that of the mean level of the lines, mean over the vehicles. Where "
                "tolerances are the cheapest for a σ, a unit of cost takes the same σ away in "
                "every direction between its bounds.",
                figures=(
                    _picture(
                        pictures,
                        "marginal_values",
                        "Left: how much σ grows with each per cent of tolerance. Right: how much "
                        "σ a unit of cost takes away.",
                    ),
                ),
                tables=(
                    Table(
                        tables["marginal_values"],
                        "Exact derivatives at the draws of the search. A dash: a free tolerance. "
                        "Below 0: the axis makes up for another one of the same rubber.",
                        dict.fromkeys(tables["marginal_values"].columns[1:], 2),
                    ),
                ),
            ),
            Section(
                "What other targets cost",
                "The same design with more or less scatter.",
                figures=(
                    _picture(
                        pictures, "cost_of_target", "Least cost over the target, and uniform."
                    ),
                ),
                tables=(
                    Table(
                        tables["cost_of_target"],
                        "Cost by target.",
                        {tables["cost_of_target"].columns[0]: 3},
                    ),
                ),
            ),
            Section(
                "Verification",
                f"{DRAWS} draws of the parts that nothing was chosen by.",
                tables=(
                    Table(
                        tables["verification"],
                        "Cost and scatter of three sets of tolerances.",
                        {
                            "sigma of the level, chosen with [dB]": 3,
                            "sigma of the level, verified [dB]": 3,
                        },
                    ),
                ),
            ),
        ),
    )


def _asked(study: AllocationStudy) -> str:
    if study.limits is not None:
        return f"{PERCENT * study.wanted.share:g} % of parts × vehicles stay within their limits"
    target = float(study.wanted.sigma or study.today.sigma_sum * study.per_line)
    which = "" if study.wanted.sigma else ", today's"
    return f"the mean level scatters by no more than {target:.3f} dB (σ{which})"


def _not_confirmed(study: AllocationStudy) -> tuple[str, ...]:
    found, wanted = study.verified["cheapest"], study.wanted.share
    if study.limits is None or found.share >= wanted:
        return ()
    return (
        f"New draws find {PERCENT * found.share:.1f} % within the limits, not the "
        f"{PERCENT * wanted:g} % asked for: take more --samples.",
    )


def _reached(study: AllocationStudy) -> Headline:
    found = study.verified["cheapest"]
    if study.limits is None:
        return Headline(f"{found.sigma:.3f} dB", "σ of the mean level, verified")
    return Headline(f"{PERCENT * found.share:.1f} %", "within limits, verified")


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
