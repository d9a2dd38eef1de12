"""The correlation of the vehicles of one group as the result of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from deboom.errors import InputError
from deboom.report import figures
from deboom.report.page import Headline, Page, Section
from deboom.study.correlation import CorrelationStudy, key_of
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


@dataclass(frozen=True)
class Apart:
    """One vehicle held against the others.

    Parameters
    ----------
    vehicle : str
        The one.
    others : tuple of str
        The others, at least two.
    """

    vehicle: str
    others: tuple[str, ...]


def vehicle_correlation_result(study: CorrelationStudy, apart: str | None) -> StudyResult:
    """Make tables, figures, headline numbers and page of the correlation of vehicles.

    Parameters
    ----------
    study : CorrelationStudy
        Of the vehicles of a group.
    apart : str or None
        Vehicle that is held against the others; None takes the one least like them.

    Returns
    -------
    StudyResult
        Tables ``doe``, ``matrix``, ``pairs``, ``vehicles``, ``families``; of the bench's platform
        ``rates``.

    Raises
    ------
    InputError
        An unknown vehicle.
    """
    both = _apart(study, apart)
    tables = {
        "doe": doe_table(study),
        "matrix": matrix_table(study.by_vehicle.designs),
        "pairs": pair_table(study.by_vehicle),
        "vehicles": vehicle_table(study),
        "families": family_table(study),
    }
    pictures = {
        "matrix": matrix_figure(study.by_vehicle),
        **scatter_figures(
            study,
            study.vehicles,
            study.by_vehicle,
            "vehicles",
            "mean level of the lines [dB(A)]",
        ),
        "families": family_figure(study),
    }
    summary: dict[str, Scalar] = {
        "n_designs": len(study.doe),
        "n_failed": study.doe.n_failed,
        "n_families": len(study.families.members),
        "r_vehicle_min": float(study.by_vehicle.designs.among(study.names).min()),
    }
    if both is not None:
        summary |= _summary(study, both)
        _fleet(study, both, tables, pictures, summary)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, both, tables, pictures, summary),
        inputs=(*study.runs.platform.input_files, *study.inputs),
        facts={
            "plan": study.plan,
            "kernel": study.index.kernel.name,
            "known_designs": study.n_known,
        },
    )


def _apart(study: CorrelationStudy, name: str | None) -> Apart | None:
    if name is not None and name not in study.names:
        raise InputError(f"--apart '{name}' is no vehicle of this study: use {list(study.names)}")
    if len(study.names) < 3:
        return None
    vehicle = name or study.least_alike()
    return Apart(vehicle, tuple(other for other in study.names if other != vehicle))


def _summary(study: CorrelationStudy, both: Apart) -> dict[str, Scalar]:
    others, one = f"r_{key_of(both.others)}_min", f"r_{key_of([both.vehicle])}_mean"
    summary: dict[str, Scalar] = {"apart": both.vehicle}
    suffixes = ("", "_means", "_tolerance")
    for suffix, found in zip(suffixes, study.by_vehicle.kinds.values(), strict=True):
        summary[others + suffix] = float(found.among(both.others).min())
        summary[one + suffix] = float(found.between(both.vehicle, both.others).mean())
    return summary


def _fleet(
    study: CorrelationStudy,
    both: Apart,
    tables: dict[str, pd.DataFrame],
    pictures: dict[str, bytes],
    summary: dict[str, Scalar],
) -> None:
    """Add how often unselected fleets show the same."""
    fleets = unselected(study)
    if fleets is None or (both.vehicle, both.others) != (fleets.battery, fleets.alike):
        return
    alike = float(study.by_vehicle.designs.among(both.others).min())
    mean = float(study.by_vehicle.designs.between(both.vehicle, both.others).mean())
    rates = fleets.rates()
    tables["rates"] = rate_table(
        rates,
        {
            "alike": f"least r {alike:.3f}",
            "alike_closely": f"least r {alike:.3f}",
            "battery": f"mean r {mean:.3f}",
        },
    )
    note = f"{len(fleets.fleets)} unselected fleets"
    pictures["unselected_fleets"] = figures.populations(
        [
            figures.PopulationPanel(
                f"least r, {both.others[0]} to {both.others[-1]} [1]",
                fleets.values("r_alike_min"),
                alike,
                (0.95,),
                note,
            ),
            figures.PopulationPanel(
                f"mean r of {both.vehicle} with them [1]",
                fleets.values("r_battery_mean"),
                mean,
                (0.3, 0.8),
            ),
        ]
    )
    for name in ("alike", "alike_closely", "battery"):
        summary[f"rate_{name}"] = rates[name].rate
    summary["n_unselected_fleets"] = len(fleets.fleets)


def _page(
    study: CorrelationStudy,
    both: Apart | None,
    tables: Mapping[str, pd.DataFrame],
    pictures: Mapping[str, bytes],
    summary: Mapping[str, Scalar],
) -> Page:
    n = len(study.families.members)
    headlines = [Headline(str(n), "family of vehicles" if n == 1 else "families of vehicles")]
    if both is None:
        r = f"{float(summary['r_vehicle_min']):.3f}"
        headlines.insert(0, Headline(r, "least correlation of two vehicles"))
    else:
        designs = study.by_vehicle.designs
        least = float(designs.among(both.others).min())
        mean = float(designs.between(both.vehicle, both.others).mean())
        headlines[:0] = [
            Headline(f"{least:.3f}", f"least correlation without {both.vehicle}"),
            Headline(f"{mean:.2f}", f"{both.vehicle} with the others, mean"),
        ]
    if "rate_battery" in summary:
        rate = f"{100 * float(summary['rate_battery']):.0f} %"
        headlines.append(Headline(rate, "of unselected fleets set it apart like this"))
    return Page(
        title="Correlation of vehicles",
        question=(
            f"Do {', '.join(study.names)} rise and fall together when mount stiffnesses change, so "
            "that one mount set can serve them all?"
        ),
        headlines=tuple(headlines),
        terms=TERMS,
        sections=(
            asked(study),
            _matrix_section(study, tables, pictures),
            family_section(study, tables, pictures),
            *fleet_section(tables, pictures),
        ),
    )


def _matrix_section(
    study: CorrelationStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Section:
    drawn = (
        ("vehicles_designs", "Designs: each dot is one design, two vehicles with the same mounts."),
        ("vehicles_tolerance", "Tolerance scatter: each dot is one design as made once."),
    )
    kinds = study.by_vehicle.kinds.values()
    apart = np.max([np.abs(found.pearson - study.by_vehicle.designs.pearson) for found in kinds])
    return Section(
        "Vehicle by vehicle",
        "A narrow cloud means that what quietens one vehicle quietens the other. The correlations "
        f"of means and of tolerance scatter differ from those of the designs by {apart:.2f} at "
        "most; the intervals say how much of that is chance.",
        figures=(
            picture(
                pictures, "matrix", "Pearson's correlation of the vehicles, below it its interval."
            ),
            *(picture(pictures, stem, words) for stem, words in drawn if stem in pictures),
        ),
        tables=(pair_words(tables["pairs"]),),
    )
