"""Figures, page and words of compared fronts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.explore.front_quality import attainment
from deboom.explore.front_verdict import CONFIDENCE, ENOUGH_SEEDS, LAST_PART, Verdict
from deboom.explore.fronts import nondominated
from deboom.report import figures
from deboom.report.figures import AttainedFront
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import signed
from deboom.study.compare import SETS, Comparison, JudgedRun
from deboom.study.compare_tables import (
    PERCENT,
    design_values,
    objective_labels,
    unit_label,
    unit_word,
)

QUESTION = "Which of these fronts is better, and is the difference real?"
TERMS = ("Pareto front", "hypervolume", "attainment band", "within noise", "tolerance", "σ")
SHOWN_PAIRS = 15
"""Pairs that a page shows of many."""


def verdict_sentence(study: Comparison, pair: tuple[str, str]) -> str:
    """Say in one sentence what came out for two configurations."""
    first, second = pair
    found = study.pairs[pair]
    if found.verdict is Verdict.open:
        return (
            f"{first} against {second}: not decided, a single run that keeps no convergence.csv "
            f"does not say how far to trust it; run {ENOUGH_SEEDS} seeds of each."
        )
    value, noise = PERCENT * found.value, PERCENT * found.noise
    if found.verdict is Verdict.noise:
        return (
            f"{first} against {second}: within noise ({signed(value, 2)} % hypervolume; chance "
            f"alone may give ±{noise:.2f} %)."
        )
    better, worse = (first, second) if found.value > 0.0 else (second, first)
    return (
        f"{better} is really better than {worse}: its front dominates {abs(value):.2f} % more of "
        f"the box; chance alone may give ±{noise:.2f} %."
    )


def _attained(study: Comparison, runs: list[JudgedRun]) -> AttainedFront:
    fronts = [one.objectives * study.per_line for one in runs]
    if len(fronts) == 1:
        front = fronts[0][nondominated(fronts[0])]
        return AttainedFront(front[np.argsort(front[:, 0])])
    any_run = 1.0 / len(fronts)
    levels = attainment(fronts, [any_run, 0.5, 1.0])
    return AttainedFront(levels[0.5], best=levels[any_run], worst=levels[1.0])


def _shown(study: Comparison) -> list[tuple[str, str]]:
    """Return the pairs that a page shows: all, or of many those with the best configuration."""
    pairs = list(study.pairs)
    if len(pairs) <= SHOWN_PAIRS:
        return pairs
    best = max(study.hypervolumes, key=lambda name: study.hypervolumes[name].mean())
    return [pair for pair in pairs if best in pair][:SHOWN_PAIRS]


def comparison_figures(study: Comparison) -> dict[str, bytes]:
    """Draw all pictures of the page; file stem → PNG."""
    scale, unit = study.per_line, unit_label(study)
    shown = _shown(study)
    found = [study.pairs[pair] for pair in shown]
    corner = study.box.reference_point * scale
    lower, upper = study.bounds
    mean_label, sigma_label = objective_labels(study)
    return {
        "fronts": figures.attained_fronts(
            {name: _attained(study, runs) for name, runs in study.groups.items()},
            (float(corner[0]), float(corner[1])),
            mean_label=f"{mean_label} {unit}",
            sigma_label=f"{sigma_label} {unit}",
        ),
        "noise": figures.noise_bars(
            [f"{first} − {second}" for first, second in shown],
            PERCENT * np.array([one.value for one in found]),
            PERCENT * np.array([one.noise for one in found]),
            difference_label="difference of hypervolume [% of the box]",
        ),
        "designs": figures.design_ranges(
            study.judge.space.names,
            design_values(study),
            np.column_stack([lower, upper]),
            value_label=f"value on the front [{study.judge.space.units[0]}]",
        ),
    }


def _headlines(study: Comparison) -> tuple[Headline, ...]:
    (first, second), found = next(iter(study.pairs.items()))
    if len(study.pairs) > 1:
        real = sum(one.verdict is Verdict.real for one in study.pairs.values())
        return (
            Headline(f"{real} of {len(study.pairs)}", "pairs with a real difference"),
            Headline(str(len(study.fronts)), "runs judged by the same draws"),
        )
    heads = [
        Headline(found.verdict.value, f"{first} against {second}"),
        Headline(f"{signed(PERCENT * found.value, 2)} %", "hypervolume, first minus second"),
    ]
    if np.isfinite(found.noise):
        heads.append(Headline(f"±{PERCENT * found.noise:.2f} %", "what chance alone may give"))
    gap = study.gap(first, second) * study.per_line
    if np.isfinite(gap):
        heads.append(
            Headline(
                f"{signed(gap, 3)} {unit_word(study)}".strip(),
                "level at equal σ, first minus second",
            )
        )
    return tuple(heads)


def comparison_page(
    study: Comparison, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
    """Compose the page from tables and figures."""
    shown = _shown(study)
    pairs = tables["pairs"]
    rows = [(row.first, row.second) in shown for row in pairs.itertuples()]
    more = "" if all(rows) else f"All {len(pairs)} pairs are in pairs.csv."
    differ = tables["differences"]
    warnings = tuple(
        f"The model of {folder} is not the one that judges here ({study.fronts[0].run.entry.name}):"
        " its options or code give other figures, so its front is judged outside of its own world."
        for folder in study.foreign
    )
    return Page(
        title="Fronts compared",
        question=QUESTION,
        headlines=_headlines(study),
        terms=TERMS,
        warnings=warnings,
        sections=(
            Section(
                "The verdict",
                "\n\n".join(
                    [*(verdict_sentence(study, pair) for pair in shown), more, _seeds_only(study)]
                ),
                figures=(
                    Picture(
                        pictures["noise"],
                        "Difference of hypervolume of each pair beside its band of noise.",
                        "Difference of hypervolume, and what other draws and other seeds could "
                        "give as well.",
                    ),
                ),
                tables=(
                    Table(
                        pairs[rows].drop(
                            columns=["error from draws [%]", "error from searches [%]"]
                        ),
                        "Level at equal σ is the mean over the range of σ that both fronts have; "
                        "negative: the first is quieter. Covers: share of the other's points that "
                        "a front equals or beats.",
                        {"hypervolume, first - second [%]": 2, "noise, 99 % [%]": 2},
                    ),
                ),
            ),
            Section("How it was decided", _method(study)),
            Section(
                "The fronts",
                "All designs under the common draws. A step line encloses what a front dominates.",
                figures=(
                    Picture(
                        pictures["fronts"],
                        "Fronts of all configurations under the common draws.",
                        "Down and left is better. Of several runs the line is what half of them "
                        "attain, the band reaches from the best to the worst.",
                    ),
                ),
                tables=(
                    Table(
                        tables["fronts"].drop(columns=_hidden(tables["fronts"])),
                        "Every run. Hypervolume, IGD+ and ε are in the units of the common box; "
                        "last gain is what the last generations of the search have gained of it.",
                        {
                            "hypervolume [%]": 2,
                            "last gain [%]": 2,
                            "IGD+ [%]": 2,
                            "additive ε [%]": 2,
                        },
                    ),
                ),
            ),
            Section(
                "What would be built",
                "The values that the designs of each front have. Two fronts can be equally good "
                "and yet ask for other parts.",
                figures=(
                    Picture(
                        pictures["designs"],
                        "Range and median of every variable on each front.",
                        "Line: from the smallest to the largest value on the front; mark: median; "
                        "grey: bounds of the search. Variables without effect stand at nominal.",
                    ),
                ),
            ),
            Section(
                "What the runs do not have in common",
                "Beside these items the runs are equal: the study's options, the versions of all "
                "packages, and the hashes of the platform's files."
                if len(differ)
                else "Nothing.",
                tables=(Table(differ, "Only what differs is shown."),) if len(differ) else (),
            ),
        ),
    )


def _seeds_only(study: Comparison) -> str:
    """Say what a real difference means between runs that differ in their seed only."""
    asked = {one.run.configuration for one in study.fronts}
    if len(asked) > 1 or not any(d.verdict is Verdict.real for d in study.pairs.values()):
        return ""
    return (
        "These runs differ in nothing but their seed. A real difference between them says that the "
        "search of the worse one had come to rest elsewhere: give it more generations, or several "
        "searches (--searches)."
    )


def _hidden(fronts: pd.DataFrame) -> list[str]:
    """Return columns that a page does without."""
    hidden = ["seed", *(name for name in fronts.columns if name.startswith("best "))]
    return hidden if fronts["failed"].any() else [*hidden, "failed"]


def _method(study: Comparison) -> str:
    scale, box = study.per_line, study.box
    unit = unit_word(study)
    ideal, nadir, corner = (
        ", ".join(f"{value * scale:.4g} {unit}".strip() for value in point)
        for point in (box.ideal, box.nadir, box.reference_point)
    )
    return (
        f"The model of the first run judges all fronts with {study.n_samples} draws that no search "
        f"has seen: {SETS} independent scrambled Sobol sets, seed {study.seed}.\n\n"
        f"The best front of all runs together spans a box from its ideal ({ideal}) to its nadir "
        f"({nadir}). The reference point of the hypervolume ({corner}) lies a tenth of the box "
        "beyond the nadir; the hypervolume is given as the share of the box up to there, IGD+ and "
        "ε in units of the box from ideal to nadir.\n\n"
        f"A difference is called real when chance gives it in less than "
        f"{PERCENT * (1 - CONFIDENCE):g} % of all cases. Chance is in the draws (spread of the "
        f"difference over the {SETS} sets) and in the searches: with {ENOUGH_SEEDS} seeds or more "
        "of a configuration their own spread counts; with fewer, what the last "
        f"{PERCENT * LAST_PART:g} % of the generations have gained stands for it, since a search "
        "that still moved by so much could as well have ended elsewhere by so much."
    )


def sentences(study: Comparison) -> list[str]:
    """Return the verdicts in words, for a terminal."""
    return [verdict_sentence(study, pair) for pair in _shown(study)]
