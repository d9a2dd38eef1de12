"""Tables, figures, headline numbers and page of a mount selection."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.explore.robust import RobustValues
from deboom.report import figures
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import signed
from deboom.study.motion_report import motion_report
from deboom.study.mount_selection import MountSelection
from deboom.study.result import Scalar, StudyResult

TERMS = ("booming noise", "SPLV", "dynamic stiffness", "tolerance", "σ", "Pareto front", "knee")
WARNING = (
    "A direction that a part's characterisation could not identify keeps the force of today's "
    "part, and so does a line outside of the region that the part was measured in."
)


def mount_selection_result(study: MountSelection) -> StudyResult:
    """Make tables, figures, headline numbers and page of a mount selection.

    Parameters
    ----------
    study : MountSelection
        Searched and verified.

    Returns
    -------
    StudyResult
        Tables ``front``, ``designs``, ``picks``, ``vehicles`` and, if enumerated, ``part_sets``.
    """
    tables = {
        "front": front_table(study),
        "designs": design_table(study),
        "picks": pick_table(study),
        "vehicles": vehicle_table(study),
    }
    if study.sets is not None:
        tables["part_sets"] = set_table(study, study.sets)
    pictures = selection_figures(study)
    summary = selection_summary(study)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=summary,
        page=_page(study, tables, pictures),
        inputs=(*study.platform.input_files, *study.catalogue.inputs),
        facts={"kernel": study.index.levels[0].kernel.name},
    )


def front_table(study: MountSelection) -> pd.DataFrame:
    """One row per design of the front: parts, and both objectives as verified."""
    front, check = study.search.front, study.verification
    names = {row: name for name, row in reversed(study.picks.items())}
    return pd.DataFrame(
        {
            "point": np.arange(1, len(front) + 1),
            "pick": [names.get(row, "") for row in range(len(front))],
            **_parts(study, front.designs),
            "SPLV mean sum [dB(A)]": check.values.mean_sum,
            "SPLV sigma sum [dB]": check.values.sigma_sum,
            "SPLV mean sum in search [dB(A)]": front.mean_sum,
            "SPLV sigma sum in search [dB]": front.sigma_sum,
            "non-dominated when verified": check.nondominated,
        }
    )


def design_table(study: MountSelection) -> pd.DataFrame:
    """One row per design of the front: its stiffness factors."""
    factors = study.search.front.designs[:, study.n_mounts :]
    names = study.index.variable_names[study.n_mounts :]
    columns = {f"{name} [1]": factors[:, place] for place, name in enumerate(names)}
    return pd.DataFrame({"point": np.arange(1, len(factors) + 1), **columns})


def pick_table(study: MountSelection) -> pd.DataFrame:
    """Today's set, the quietest set as it is, and the named designs, verified."""
    base, values = study.baseline, study.verification.values
    rows = [("today's parts", base, 0)]
    if study.best_set is not None:
        rows.append(("quietest parts as they are", study.best_set, 0))
    rows += [(name, values, row) for name, row in study.picks.items()]
    designs = np.stack([source.designs[row] for _, source, row in rows])
    sigma = np.array([source.sigma_sum[row] for _, source, row in rows])
    mean = np.array([source.mean_sum[row] for _, source, row in rows])
    return pd.DataFrame(
        {
            "design": [name for name, *_ in rows],
            **_parts(study, designs),
            "mean level [dB(A)]": mean * study.per_line,
            "change [dB]": (mean - base.mean_sum[0]) * study.per_line,
            "sigma of the level [dB]": sigma * study.per_line,
            "change of sigma [%]": 100.0 * (sigma / base.sigma_sum[0] - 1.0),
        }
    )


def vehicle_table(study: MountSelection) -> pd.DataFrame:
    """One row per vehicle: what the parts of best mean change, without scatter."""
    design = study.verification.values.designs[study.picks["best mean"]]
    table = {"vehicle": list(study.index.response_names)}
    if study.best_set is not None:
        change = study.splv_change(study.best_set.designs[0])
        table["change, quietest parts as they are [dB]"] = change.tolist()
    return pd.DataFrame(table | {"change, best mean [dB]": study.splv_change(design)})


def set_table(study: MountSelection, sets: RobustValues) -> pd.DataFrame:
    """One row per set of parts as they are, in the draws of the search."""
    assert study.set_front is not None
    on_front = {tuple(row) for row in study.set_front.designs.tolist()}
    return pd.DataFrame(
        {
            **_parts(study, sets.designs),
            "SPLV mean sum [dB(A)]": sets.mean_sum,
            "SPLV sigma sum [dB]": sets.sigma_sum,
            "on the front": [tuple(row) in on_front for row in sets.designs.tolist()],
        }
    )


def selection_summary(study: MountSelection) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    picks = pick_table(study).set_index("design")
    best = study.verification.values.designs[study.picks["best mean"]]
    parts = study.catalogue.labels(best[: study.n_mounts])
    summary: dict[str, Scalar] = {
        f"part_{mount}": part for mount, part in zip(study.catalogue.parts, parts, strict=True)
    }
    summary["change_db_per_line"] = float(picks["change [dB]"]["best mean"])
    summary["sigma_change_percent_best_sigma"] = float(picks["change of sigma [%]"]["best sigma"])
    if study.set_front is not None and study.best_set is not None:
        change = picks["change [dB]"]["quietest parts as they are"]
        summary["change_parts_as_they_are_db_per_line"] = float(change)
        summary["n_set_front"] = len(study.set_front)
        summary["set_front_found_percent"] = study.found_percent
    summary["n_sets"] = study.catalogue.n_sets
    summary["n_front"] = len(study.search.front)
    summary["n_evaluated"] = study.search.n_evaluated
    summary["sigma_bias_percent"] = study.verification.sigma_bias_percent
    summary["seconds_search"] = round(study.search.seconds, 3)
    return summary


def selection_figures(study: MountSelection) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    scale, front = study.per_line, study.search.front
    curves = {"front of the search": (front.mean_sum * scale, front.sigma_sum * scale)}
    points = {}
    if study.sets is not None and study.set_front is not None:
        sets, best = study.sets, study.set_front
        points["every set of parts as they are"] = (sets.mean_sum * scale, sets.sigma_sum * scale)
        curves["front of these sets"] = (best.mean_sum * scale, best.sigma_sum * scale)
    labels = [
        [study.catalogue.label(mount, number) for number in range(count)]
        for mount, count in zip(study.catalogue.parts, study.catalogue.n_parts, strict=True)
    ]
    base = study.robust(study.robust.space.nominal[np.newaxis, :])
    today = (float(base.mean_sum[0]) * scale, float(base.sigma_sum[0]) * scale)
    return {
        "fronts": figures.fronts(
            curves,
            points,
            {"today's parts": today},
            mean_label="mean level over vehicles and lines [dB(A)]",
            sigma_label="its σ over the tolerance [dB]",
        ),
        "parts": figures.part_choices(
            tuple(study.catalogue.parts),
            labels,
            front.designs[:, : study.n_mounts].astype(int),
            point_label="design of the front, quietest first",
        ),
        "convergence": figures.convergence(
            np.arange(1, study.search.hypervolume.size + 1),
            study.search.hypervolume * scale**2,
            hypervolume_label="hypervolume [dB²]",
        ),
    }


def _parts(study: MountSelection, designs: np.ndarray) -> dict[str, list[str]]:
    mounts = list(study.catalogue.parts)
    return {
        f"{mount} part": [study.catalogue.label(mount, int(row[place])) for row in designs]
        for place, mount in enumerate(mounts)
    }


def _page(
    study: MountSelection, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    summary, search, check = selection_summary(study), study.search, study.verification
    counts = ", ".join(
        f"{count} of {mount}"
        for mount, count in zip(study.catalogue.parts, study.catalogue.n_parts, strict=True)
    )
    headlines = [
        Headline(f"{signed(float(summary['change_db_per_line']), 2)} dB", "mean level, best mean")
    ]
    compared = f"{study.catalogue.n_sets} sets are too many to evaluate one by one."
    if "set_front_found_percent" in summary:
        as_they_are = float(summary["change_parts_as_they_are_db_per_line"])
        found = float(summary["set_front_found_percent"])
        headlines += [
            Headline(f"{signed(as_they_are, 2)} dB", "mean level, quietest parts as they are"),
            Headline(f"{found:.0f} %", "of the best sets found or beaten by the search"),
        ]
        compared = (
            f"All {study.catalogue.n_sets} sets were evaluated as they are: "
            f"{summary['n_set_front']} are on their front, and the search found or beat "
            f"{found:.0f} % of these."
        )
    tuned = (
        f"Each part may be re-tuned within ±{100 * study.retuning:.0f} % per axis."
        if study.retuning
        else "Parts are taken as they are."
    )
    level = study.index.levels[0]
    motion = motion_report(level, np.ones((1, len(level.variable_names)))).warnings
    half = float(study.robust.space.tolerance.max())
    return Page(
        title="Mounts from the catalogue",
        question=(
            "Which parts of the catalogue make "
            f"{', '.join(study.index.response_names)} quiet, and keep them quiet when stiffnesses "
            f"scatter within ±{100 * half:.0f} %?"
        ),
        headlines=tuple(headlines),
        terms=TERMS,
        warnings=(WARNING, *motion),
        sections=(
            Section(
                "What to order",
                f"Parts to choose from: {counts}. {tuned}",
                tables=(
                    Table(
                        tables["picks"],
                        "Today's and the named designs, per vehicle and line, evaluated with "
                        f"{check.n_samples} independent draws.",
                        {"mean level [dB(A)]": 2, "change [dB]": 2, "sigma of the level [dB]": 3},
                    ),
                    Table(tables["vehicles"], "Change of the mean level without scatter."),
                ),
            ),
            Section(
                "The front",
                f"{search.n_evaluated} designs were evaluated, {search.n_failed} failed; "
                f"{len(search.front)} are on the front. {compared}",
                figures=(
                    _picture(pictures, "fronts", "Both objectives, in the draws of the search."),
                    _picture(pictures, "parts", "Which part each design of the front has."),
                ),
            ),
            Section(
                "How the search went",
                f"NSGA-II over part numbers and stiffness factors, {search.hypervolume.size} "
                f"generations, {search.seconds:.1f} s.",
                figures=(
                    _picture(pictures, "convergence", "Hypervolume of the front over generations."),
                ),
            ),
        ),
    )


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)
