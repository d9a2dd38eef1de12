"""The correlation of vehicle groups as the result of a study."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from deboom.report import figures
from deboom.report.page import Headline, Page, Section
from deboom.study.correlation import CorrelationSet, CorrelationStudy
from deboom.study.correlation_page import (
    TERMS,
    asked,
    family_figure,
    family_section,
    fleet_section,
    matrix_figure,
    pair_words,
    picture,
    scatter_figures,
)
from deboom.study.correlation_tables import (
    doe_table,
    family_table,
    matrix_table,
    pair_table,
    rate_table,
    unselected,
    vehicle_table,
)
from deboom.study.result import Scalar, StudyResult


def group_correlation_result(study: CorrelationStudy) -> StudyResult:
    """Make tables, figures, headline numbers and page of the correlation of groups.

    Parameters
    ----------
    study : CorrelationStudy
        Of all vehicles of a platform.

    Returns
    -------
    StudyResult
        Tables ``doe``, ``vehicle_matrix``, ``vehicle_pairs``, ``vehicles``, ``families``; with two
        groups or more ``group_matrix`` and ``group_pairs``; of the bench's platform ``rates``.
    """
    by_group, by_vehicle = study.by_group, study.by_vehicle
    tables = {
        "doe": doe_table(study),
        "vehicle_matrix": matrix_table(by_vehicle.designs),
        "vehicle_pairs": pair_table(by_vehicle),
        "vehicles": vehicle_table(study),
        "families": family_table(study),
    }
    groups = [study.group_of[name] for name in study.names]
    designs = by_vehicle.designs
    pictures = {
        "vehicle_matrix": figures.correlation_matrices(
            study.names,
            [
                figures.CorrelationPanel(
                    "designs", designs.pearson, designs.pearson_low, designs.pearson_high
                )
            ],
            groups,
        ),
        "families": family_figure(study),
    }
    summary: dict[str, Scalar] = {
        "n_designs": len(study.doe),
        "n_failed": study.doe.n_failed,
        "n_families": len(study.families.members),
        "r_vehicle_min": float(designs.among(study.names).min()),
    }
    if by_group is not None:
        tables |= {
            "group_matrix": matrix_table(by_group.designs),
            "group_pairs": pair_table(by_group),
        }
        pictures["group_matrix"] = matrix_figure(by_group)
        pictures |= scatter_figures(
            study,
            study.group_levels,
            by_group,
            "groups",
            "mean level of the lines, summed over the vehicles of a group [dB(A)]",
        )
        summary |= _group_summary(by_group)
        _fleet(study, float(summary["r_group_min"]), tables, pictures, summary)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures, summary),
        inputs=(*study.runs.platform.input_files, *study.inputs),
        facts={
            "plan": study.plan,
            "kernel": study.index.kernel.name,
            "known_designs": study.n_known,
        },
    )


def _group_summary(by_group: CorrelationSet) -> dict[str, Scalar]:
    names = by_group.designs.names
    worst = min(by_group.designs.pairs, key=lambda pair: by_group.designs.pearson[pair])
    return {
        "r_group_min": float(by_group.designs.among(names).min()),
        "r_group_min_from": float(by_group.designs.pearson_low[worst]),
        "r_group_min_to": float(by_group.designs.pearson_high[worst]),
        "r_group_min_means": float(by_group.means.among(names).min()),
        "r_group_min_tolerance": float(by_group.scatter.among(names).min()),
    }


def _fleet(
    study: CorrelationStudy,
    r_min: float,
    tables: dict[str, pd.DataFrame],
    pictures: dict[str, bytes],
    summary: dict[str, Scalar],
) -> None:
    """Add how often unselected fleets show the same."""
    fleets = unselected(study)
    if fleets is None:
        return
    rates = fleets.rates()
    tables["rates"] = rate_table(rates, {"groups": f"least r {r_min:.3f}"})
    pictures["unselected_fleets"] = figures.populations(
        [
            figures.PopulationPanel(
                "least correlation of two groups [1]",
                fleets.values("r_groups_min"),
                r_min,
                (0.9,),
                f"{len(fleets.fleets)} unselected fleets",
            )
        ]
    )
    summary["rate_groups"] = rates["groups"].rate
    summary["n_unselected_fleets"] = rates["groups"].n_fleets


def _page(
    study: CorrelationStudy,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
    summary: Mapping[str, Scalar],
) -> Page:
    n = len(study.families.members)
    headlines = [
        Headline(f"{float(summary['r_vehicle_min']):.3f}", "least correlation of two vehicles"),
        Headline(str(n), "family of vehicles" if n == 1 else "families of vehicles"),
    ]
    if "r_group_min" in summary:
        r = f"{float(summary['r_group_min']):.3f}"
        headlines.insert(0, Headline(r, "least correlation of two groups"))
    if "rate_groups" in summary:
        rate = f"{100 * float(summary['rate_groups']):.0f} %"
        headlines.append(Headline(rate, "of unselected fleets: groups above 0.9"))
    return Page(
        title="Correlation of vehicle groups",
        question=(
            "Do the groups of a platform, and their vehicles, rise and fall together when mount "
            "stiffnesses change, so that one group can stand for the others?"
        ),
        headlines=tuple(headlines),
        terms=TERMS,
        sections=(
            asked(study),
            *_groups(study, tables, pictures),
            Section(
                "Vehicles",
                "Every vehicle with every other one, over the designs; the intervals, Spearman's "
                "coefficients and those of means and tolerance scatter stand in "
                "vehicle_pairs.csv.",
                figures=(
                    picture(
                        pictures,
                        "vehicle_matrix",
                        "Pearson's correlation of all vehicles; white lines part the groups.",
                    ),
                ),
            ),
            family_section(study, tables, pictures),
            *fleet_section(tables, pictures),
        ),
    )


def _groups(
    study: CorrelationStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> tuple[Section, ...]:
    if "group_pairs" not in tables:
        group = next(iter(study.groups))
        text = f"All vehicles are of group {group}: there are no groups to compare."
        return (Section("Groups", text),)
    sizes = ", ".join(f"{name} ({len(members)})" for name, members in study.groups.items())
    drawn = (
        ("groups_designs", "Designs: each dot is one design, the sums of two groups."),
        ("groups_tolerance", "Tolerance scatter: each dot is one design as made once."),
    )
    return (
        Section(
            "Groups",
            f"The index of a group is the sum over its vehicles: {sizes}.",
            figures=(
                picture(
                    pictures,
                    "group_matrix",
                    "Pearson's correlation of the groups, below it its interval.",
                ),
                *(picture(pictures, stem, words) for stem, words in drawn if stem in pictures),
            ),
            tables=(pair_words(tables["group_pairs"]),),
        ),
    )
