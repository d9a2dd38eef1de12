"""One page for a platform study: what came out on top, then the parts in the order of the work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from deboom.report.page import Headline, Page, Section, Table
from deboom.study.platform_study import SEARCHED, PlatformStudy
from deboom.study.result import StudyResult

NOTHING = "There is one vehicle only: nothing to correlate, and no DOE was run."


def platform_page(
    study: PlatformStudy,
    by_group: StudyResult | None,
    by_vehicle: StudyResult | None,
    front: StudyResult,
    sensitivities: StudyResult,
) -> Page:
    """Compose the page of the pages of the parts.

    Parameters
    ----------
    study : PlatformStudy
        Done.
    by_group, by_vehicle : StudyResult or None
        Correlation of groups, and of the vehicles of the group; None if there is nothing to
        correlate.
    front, sensitivities : StudyResult
        The other parts.
    """
    groups = () if by_group is None else by_group.page.headlines
    vehicles = () if by_vehicle is None else by_vehicle.page.headlines
    found, ranked = front.page.headlines, sensitivities.page.headlines
    parts = [part.page for part in (by_group, by_vehicle, front, sensitivities) if part is not None]
    alone = f"{study.front.vehicles[0]} is the only vehicle: there is none to compare it with."
    return Page(
        title=f"{study.front.platform.title}: one study",
        question=(
            "Which vehicles go together, which mount stiffnesses make those of group "
            f"{study.group} quiet and keep them so, and which stiffness matters?"
        ),
        headlines=(*groups[:1], *vehicles[:2], *found[:3], *ranked[:2]),
        terms=tuple(dict.fromkeys(term for part in parts for term in part.terms)),
        warnings=tuple(dict.fromkeys(warning for part in parts for warning in part.warnings)),
        sections=(
            _in_short(study, groups, vehicles, found, ranked),
            *_part(study, "DOE and groups", by_group, NOTHING),
            *_part(study, f"Vehicles of {study.group}", by_vehicle, alone, first=1),
            *_part(study, "Front", front),
            *_part(study, "Sensitivity", sensitivities),
        ),
    )


def _part(
    study: PlatformStudy, name: str, part: StudyResult | None, otherwise: str = "", first: int = 0
) -> tuple[Section, ...]:
    """Return the sections of a part, from the `first` one, under its name.

    The platform is described once, by the section in short.
    """
    if part is None:
        return (Section(name, otherwise),)
    said = _platform(study)
    return tuple(
        replace(
            section,
            title=f"{name} · {section.title}",
            text=section.text.removeprefix(f"{said}\n\n"),
        )
        for section in part.page.sections[first:]
    )


def _platform(study: PlatformStudy) -> str:
    platform = study.front.platform
    return f"{platform.title}: {platform.description}"


def _in_short(
    study: PlatformStudy,
    groups: Sequence[Headline],
    vehicles: Sequence[Headline],
    found: Sequence[Headline],
    ranked: Sequence[Headline],
) -> Section:
    """Say what was done in which step, and what came out."""
    front, sensitivity, doe = study.front, study.sensitivity, study.fleet
    tried = "no DOE"
    if doe is not None:
        tried = (
            f"{len(doe.doe)} designs ({doe.plan}), each as it is and made {study.plan.draws} "
            f"times, heard in {len(doe.names)} vehicles"
        )
    space, search = front.robust.space, front.search
    steps = (
        ("DOE and groups", tried, groups, NOTHING),
        (
            f"Vehicles of {study.group}",
            f"the same designs in {len(front.vehicles)} vehicles",
            vehicles,
            "one vehicle",
        ),
        (
            "Front",
            f"NSGA-II, {search.n_evaluated} designs with {front.robust.sample.n_samples} draws "
            f"each, within {space.lower.min():g} to {space.upper.max():g}; "
            f"{front.verification.n_samples} draws to verify",
            found,
            "",
        ),
        (
            "Sensitivity",
            f"{sensitivity.n_runs} designs, {sensitivity.label}, {sensitivity.indices.n_base} base "
            "points",
            ranked,
            "",
        ),
    )
    table = pd.DataFrame(
        [
            {"step": name, "what was done": done, "what came out": _answer(headlines) or otherwise}
            for name, done, headlines, otherwise in steps
        ]
    )
    return Section(
        "In short",
        f"{_platform(study)}\n\n"
        "All steps ask one model: the same forces, motion, lines and kernel. Every vehicle of the "
        f"platform hears the DOE; front and sensitivities are those of group {study.group}. DOE "
        f"and sensitivities keep within ±{100 * study.plan.half_width:g} %, the search within "
        f"±{100 * SEARCHED:g} %. {front.note}",
        tables=(Table(table, "The steps in the order of the work, which is that of this page."),),
    )


def _answer(headlines: Sequence[Headline]) -> str:
    return "; ".join(f"{headline.value} {headline.label}" for headline in headlines)
