"""Figures and page of a sensitivity study."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.explore.sobol_indices import SobolIndices
from deboom.report import figures
from deboom.report.figures import IndexBars, IndexGrowth, IndexMap
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import mount_colours
from deboom.study.motion_report import motion_report
from deboom.study.sensitivity import (
    AGREEMENT,
    TRAJECTORIES,
    Analysis,
    Sensitivity,
    ranking,
)
from deboom.study.sensitivity_tables import MATTERS, NEGLIGIBLE, matters, negligible
from deboom.vehicles.booming_peaks import booming_peaks

TERMS = (
    "booming noise",
    "SPL",
    "SPLV",
    "booming peak",
    "sensitivity index",
    "stiffness factor",
    "dynamic stiffness",
    "tolerance",
    "noise transfer function",
    "prescribed motion",
)
TOTAL = "share of the variance [1]"


def sensitivity_figures(study: Sensitivity) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    mounts = mount_colours([mount.name for mount in study.platform.mounts])
    owner = {name: mount.name for mount in study.platform.mounts for name in mount.variables}
    colours = [mounts[owner[name]] for name in study.variables]
    order = study.platform.load_case(study.index.load_case_names[0]).order
    shown = matters(study)
    pictures = {
        "sobol": figures.index_bars(study.variables, colours, _bars(study.indices), x_label=TOTAL),
        "sobol_lines": figures.index_map(
            study.index.frequency,
            order,
            study.variables,
            [
                IndexMap(vehicle, total, peaks)
                for vehicle, total, peaks in zip(
                    study.vehicles, study.total_of_lines, _peaks(study, order), strict=True
                )
            ],
            value_label="total index of the level of a line [1]",
        ),
        "convergence": figures.index_growth(
            [found.n_base for found in study.convergence],
            [study.variables[row] for row in shown],
            [colours[row] for row in shown],
            [
                IndexGrowth(
                    vehicle,
                    np.stack([found.total[shown, at] for found in study.convergence], axis=1),
                    np.stack(
                        [found.total_interval[shown, at] for found in study.convergence], axis=1
                    ),
                )
                for at, vehicle in enumerate(study.vehicles)
            ],
            x_label="base points N",
            y_label="total index [1]",
        ),
    }
    if study.by_mount is not None:
        names = study.by_mount.factors
        pictures["sobol_mounts"] = figures.index_bars(
            names, [mounts[name] for name in names], _bars(study.by_mount), x_label=TOTAL
        )
    return pictures


def _bars(found: SobolIndices) -> list[IndexBars]:
    columns = (found.first.T, found.total.T, found.total_interval.T, found.zero.T)
    return [IndexBars(*rows) for rows in zip(found.outputs, *columns, strict=True)]


def _peaks(study: Sensitivity, order: float) -> list[list[float]]:
    """Frequencies of today's booming peaks in the first load case."""
    level = study.index.levels(np.ones((1, len(study.variables))))[0]
    lines = study.index.frequency
    return [[peak.frequency for peak in booming_peaks(row, lines, order)] for row in level]


def sensitivity_page(
    study: Sensitivity, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    """Compose the page from the study's tables and figures."""
    found, plan, frequency = study.indices, study.plan, study.index.frequency
    motion = motion_report(study.index, np.ones((1, len(study.variables))))
    first, last = frequency[0], frequency[-1]
    order = study.platform.load_case(study.index.load_case_names[0]).order
    return Page(
        title="Which stiffness matters",
        question=(
            f"On which mount stiffnesses does the booming noise of {_listed(study.vehicles)} "
            f"between {first:g} and {last:g} Hz depend?"
        ),
        headlines=(
            *_leaders(study),
            Headline(f"{found.coupled.max():.3f}", "largest coupled share of any stiffness"),
            Headline(f"{found.total_interval.max():.3f}", "widest 95 % interval (half width)"),
        ),
        terms=tuple(motion.terms.get(term, term) for term in TERMS),
        warnings=motion.warnings,
        sections=(
            Section(
                "What was asked, and with which data",
                f"{study.platform.title}: {study.platform.description}\n\n"
                f"Ranked is the {plan.ranked.words}. A sum of decibels counts a notch like a peak; "
                "an energy level follows the loud lines: the two may rank stiffnesses differently, "
                "see below.\n\n"
                f"Analysis: {plan.analysis.value}. {_meaning(study)} Vehicles: "
                f"{_listed(study.vehicles)}. Load cases: {', '.join(study.index.load_case_names)}. "
                f"Lines: {frequency.size}, engine order {order:g}.\n\n"
                f"{found.n_base} base points of a scrambled Sobol sequence, {study.n_runs} designs "
                f"evaluated in all; intervals from {found.n_resamples} bootstrap resamples. The "
                f"tables are SALib's. The vectorised estimator behind lines and convergence gave "
                f"the same numbers within {study.salib_difference:.0e} (asked {AGREEMENT:.0e}).",
            ),
            Section(
                "Stiffness by stiffness",
                "The share of the variance that each stiffness is behind: alone (solid) and "
                "together with others (hatched). "
                f"{_without(study)}",
                figures=(
                    _picture(
                        pictures,
                        "sobol",
                        f"Sensitivity indices of every vehicle, {study.label}; numbers are total "
                        "indices.",
                    ),
                ),
                tables=(
                    Table(
                        _mattering(tables["sobol"], study),
                        f"Stiffnesses with a total index of {MATTERS:g} and more in some vehicle; "
                        "sobol.csv has all, sobol_pairs.csv every pair.",
                    ),
                ),
            ),
            *_mounts(tables, pictures),
            Section(
                "Line by line",
                "The same for the level of every single line. A stiffness that matters at a "
                "booming peak (▼) is one the passenger hears; in the notches between, paths cancel "
                "and several stiffnesses share the variance.",
                figures=(
                    _picture(
                        pictures,
                        "sobol_lines",
                        f"Total index of the level of each line, {study.lines.n_base} base points, "
                        f"largest half interval {study.lines.total_interval.max():.2f}; ▼ today's "
                        "booming peaks in the first load case.",
                    ),
                ),
            ),
            Section(
                "Other ranges, the tolerance, another measure",
                "How far the ranking depends on what was asked. A share says nothing of the size "
                f"of the variance, which grows with the range.\n\n{_other_leaders(study)}",
                tables=(
                    Table(
                        _mattering(tables["sobol_beside"], study).filter(regex="^(?!interval)"),
                        "Total indices. sobol_beside.csv has all, with intervals.",
                    ),
                ),
            ),
            Section(
                "How sure this is",
                "Total indices of the first base points, more and more of them. An index that is "
                "not above its own interval reads zero. The intervals are those of random points; "
                "Sobol points are spread more evenly, and other seeds differ by much less.",
                figures=(
                    _picture(
                        pictures,
                        "convergence",
                        "Total indices over the number of base points, with 95 % intervals.",
                    ),
                ),
                tables=(
                    Table(
                        _mattering(tables["screening"], study),
                        f"Other methods on the same model. Morris: change of the level (of the "
                        f"mean level of the lines, for SPLV) over the whole range of a stiffness, "
                        f"from {TRAJECTORIES} paths. PAWN: distance between the distributions of "
                        f"the level with and without the stiffness held, from "
                        f"{2 * found.n_base} designs; a stiffness without effect has up to "
                        f"{_noise(study):.2f}.",
                    ),
                ),
            ),
        ),
    )


def _meaning(study: Sensitivity) -> str:
    """Say what varies, and how."""
    what = f"Each of {len(study.variables)} stiffness factors is {study.inputs.description}, "
    if study.plan.analysis is Analysis.design:
        return f"{what}on its own: what a designer may choose."
    return f"{what}on its own: what manufacturing does to today's parts."


def _without(study: Sensitivity) -> str:
    """Name the variables without effect, and those with next to none."""
    zero = np.flatnonzero(study.indices.zero.all(axis=1))
    sentences = (
        ("Zero in every vehicle", tuple(study.variables[place] for place in zero)),
        (f"Below {NEGLIGIBLE:g} in every vehicle, interval included", negligible(study)),
    )
    found = [f"{words}: {_listed(names)}." for words, names in sentences if names]
    return " ".join(found) or "Every stiffness has an effect in some vehicle."


def _leaders(study: Sensitivity) -> tuple[Headline, ...]:
    """One headline for each pair of leading variables, with the vehicles that have it."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for vehicle, names in study.ranking.items():
        groups.setdefault(names[:2], []).append(vehicle)
    return tuple(
        Headline(", then ".join(names), f"lead in {_listed(tuple(vehicles))}")
        for names, vehicles in sorted(groups.items(), key=lambda item: -len(item[1]))[:3]
    )


def _other_leaders(study: Sensitivity) -> str:
    """Name the vehicles in which another question has other leading variables."""
    lines = []
    for label, found in study.beside.items():
        other = {
            vehicle: names[:2]
            for vehicle, names in ranking(found).items()
            if names[:2] != study.ranking[vehicle][:2]
        }
        listed = "; ".join(f"{vehicle}: {', then '.join(two)}" for vehicle, two in other.items())
        lines.append(f"{label}: {listed or 'the same two lead in every vehicle'}.")
    return "\n\n".join(lines)


def _noise(study: Sensitivity) -> float:
    """Largest PAWN index of a variable that the total index finds to be zero."""
    zero = study.indices.zero
    return float(study.pawn.index[zero].max()) if zero.any() else 0.0


def _mounts(
    tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> tuple[Section, ...]:
    if "sobol_mounts" not in tables:
        return ()
    return (
        Section(
            "Mount by mount",
            "All stiffnesses of a mount vary as one: how much hangs on each part.",
            figures=(_picture(pictures, "sobol_mounts", "Sensitivity indices of whole mounts."),),
            tables=(Table(tables["sobol_mounts"], "Indices of whole mounts."),),
        ),
    )


def _mattering(table: pd.DataFrame, study: Sensitivity) -> pd.DataFrame:
    names = [study.variables[row] for row in matters(study)]
    return table[table["variable"].isin(names)]


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


def _listed(names: tuple[str, ...]) -> str:
    if len(names) == 1:
        return names[0]
    return f"{', '.join(names[:-1])} and {names[-1]}"
