"""Fronts compared, as the result of a study: tables, figures, headline numbers and page."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from deboom.explore.front_quality import attainment, coverage
from deboom.explore.front_verdict import (
    CONFIDENCE,
    ENOUGH_SEEDS,
    LAST_PART,
    Verdict,
)
from deboom.explore.fronts import nondominated
from deboom.report import figures
from deboom.report.figures import AttainedFront
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import signed
from deboom.study.compare import SETS, Comparison, JudgedRun
from deboom.study.compare_runs import differences
from deboom.study.result import Scalar, StudyResult

QUESTION = "Which of these fronts is better, and is the difference real?"
TERMS = ("Pareto front", "hypervolume", "attainment band", "within noise", "tolerance", "σ")
SHOWN_PAIRS = 15
PERCENT = 100.0


def compare_result(study: Comparison) -> StudyResult:
    """Make tables, figures, headline numbers and page of a comparison.

    Parameters
    ----------
    study : Comparison
        Judged.

    Returns
    -------
    StudyResult
        Tables ``pairs``, ``fronts``, ``designs``, ``points`` and ``differences``.
    """
    tables = {
        "pairs": pair_table(study),
        "fronts": front_table(study),
        "designs": range_table(study),
        "points": point_table(study),
        "differences": differences(
            [one.run for one in study.fronts], [one.name for one in study.fronts]
        ),
    }
    pictures = _figures(study)
    inputs = tuple(path for one in study.fronts for path in one.run.files)
    return StudyResult(
        tables=tables,
        figures=pictures,
        summary=_summary(study),
        page=_page(study, tables, pictures),
        inputs=inputs,
        facts={
            "judge": study.fronts[0].run.entry.folder.as_posix(),
            "common_draws": study.n_samples,
            "sets_of_draws": SETS,
        },
    )


def pair_table(study: Comparison) -> pd.DataFrame:
    """One row per pair of configurations: difference, noise, verdict, and what it means."""
    rows = []
    for (first, second), found in study.pairs.items():
        better, other = _fronts(study, first), _fronts(study, second)
        rows.append(
            {
                "first": first,
                "second": second,
                "verdict": found.verdict.value,
                "hypervolume, first - second [%]": PERCENT * found.value,
                "noise, 99 % [%]": PERCENT * found.noise,
                "error from draws [%]": PERCENT * found.draw_error,
                "error from searches [%]": PERCENT * found.search_error,
                f"level at equal σ, first - second {_unit(study)}": study.gap(first, second)
                * study.per_line,
                "first covers second [%]": PERCENT * coverage(better, other),
                "second covers first [%]": PERCENT * coverage(other, better),
                "distance of designs [%]": PERCENT * study.distance(first, second),
            }
        )
    return pd.DataFrame(rows)


def front_table(study: Comparison) -> pd.DataFrame:
    """One row per run: figures of merit of its front under the common draws."""
    rows = []
    for one in study.fronts:
        front = one.objectives
        volumes = [study.box.hypervolume(part) for part in one.by_set]
        rows.append(
            {
                "run": one.run.entry.name,
                "configuration": one.name,
                "seed": one.run.seed,
                "designs": len(front),
                "failed": one.n_failed,
                "still non-dominated [%]": PERCENT * float(np.mean(nondominated(front))),
                "hypervolume [%]": PERCENT * float(np.mean(volumes)),
                "last gain [%]": PERCENT * study.progress(one),
                "IGD+ [%]": PERCENT * study.box.igd_plus(front),
                "additive ε [%]": PERCENT * study.box.epsilon(front),
                f"best mean {_unit(study)}": front[:, 0].min() * study.per_line,
                f"best σ {_unit(study)}": front[:, 1].min() * study.per_line,
            }
        )
    return pd.DataFrame(rows)


def range_table(study: Comparison) -> pd.DataFrame:
    """One row per variable: smallest, median and largest value on the fronts."""
    space = study.judge.space
    table: dict[str, object] = {"variable": list(space.names)}
    for name, ranges in _ranges(study).items():
        for column, word in enumerate(("smallest", "median", "largest")):
            table[f"{name}, {word}"] = ranges[:, column]
    return pd.DataFrame(table)


def point_table(study: Comparison) -> pd.DataFrame:
    """One row per design of each run: its objectives under the common draws."""
    parts = [
        pd.DataFrame(
            {
                "run": one.run.entry.name,
                "configuration": one.name,
                f"{_labels(study)[0]} {_unit(study)}": one.objectives[:, 0] * study.per_line,
                f"{_labels(study)[1]} {_unit(study)}": one.objectives[:, 1] * study.per_line,
            }
        )
        for one in study.fronts
    ]
    return pd.concat(parts, ignore_index=True)


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


def _fronts(study: Comparison, name: str) -> np.ndarray:
    """Return what the median run of a configuration attains."""
    runs = [one.objectives for one in study.groups[name]]
    return np.asarray(attainment(runs, [0.5])[0.5])


def _labels(study: Comparison) -> tuple[str, str]:
    if study.per_line != 1.0:
        return "mean level over vehicles and lines", "its σ over the tolerance"
    first, second = (objective.name for objective in study.judge.objectives)
    return first, second


def _unit(study: Comparison) -> str:
    return f"[{study.judge.evaluate.response_unit.replace('dB(A)', 'dB')}]"


def _word(study: Comparison) -> str:
    """Return the unit as it stands behind a number."""
    unit = _unit(study).strip("[]")
    return "" if unit == "1" else unit


def _ranges(study: Comparison) -> dict[str, np.ndarray]:
    ranges = {}
    for name, runs in study.groups.items():
        designs = np.concatenate([one.designs for one in runs])
        ranges[name] = np.column_stack(
            [designs.min(axis=0), np.median(designs, axis=0), designs.max(axis=0)]
        )
    return ranges


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


def _figures(study: Comparison) -> dict[str, bytes]:
    scale, unit = study.per_line, _unit(study)
    shown = _shown(study)
    found = [study.pairs[pair] for pair in shown]
    corner = study.box.reference_point * scale
    lower, upper = study.bounds
    mean_label, sigma_label = _labels(study)
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
            _ranges(study),
            np.column_stack([lower, upper]),
            value_label=f"value on the front [{study.judge.space.units[0]}]",
        ),
    }


def _summary(study: Comparison) -> dict[str, Scalar]:
    verdicts = [found.verdict for found in study.pairs.values()]
    (first, second), found = next(iter(study.pairs.items()))
    summary: dict[str, Scalar] = {
        "n_runs": len(study.fronts),
        "n_configurations": len(study.groups),
        "n_pairs": len(verdicts),
        "n_real": verdicts.count(Verdict.real),
        "n_within_noise": verdicts.count(Verdict.noise),
        "n_not_decided": verdicts.count(Verdict.open),
        "first": first,
        "second": second,
        "verdict": found.verdict.value,
        "hypervolume_difference_percent": PERCENT * found.value,
    }
    numbers = {
        "noise_percent": PERCENT * found.noise,
        "level_difference": study.gap(first, second) * study.per_line,
        "design_distance_percent": PERCENT * study.distance(first, second),
    }
    summary |= {name: value for name, value in numbers.items() if np.isfinite(value)}
    for name, volumes in study.hypervolumes.items():
        summary[f"hypervolume_percent_{name.replace(' ', '_')}"] = PERCENT * float(volumes.mean())
    return summary


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
                f"{signed(gap, 3)} {_word(study)}".strip(), "level at equal σ, first minus second"
            )
        )
    return tuple(heads)


def _page(
    study: Comparison, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Page:
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
    unit = _word(study)
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
