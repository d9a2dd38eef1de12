"""Which of these fronts is better, and is the difference real?"""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from openpyxl.utils import get_column_letter

from deboom import plot
from deboom.arrays import PERCENT, RealArray
from deboom.errors import InputError, listed
from deboom.explore.front import (
    ENOUGH_SEEDS,
    LAST_PART,
    LEFT_BY_DESCENTS,
    REAL_FROM,
    SETS,
    CommonBox,
    Difference,
    FrontVerdict,
    JudgedFront,
    attainment,
    common_box,
    common_judges,
    coverage,
    front_difference,
    last_gain,
    level_gap,
    nondominated,
)
from deboom.explore.moments import MEAN_SUM, SIGMA_SUM
from deboom.explore.robust import Robust
from deboom.explore.selection import at_nominal, variables_without_effect
from deboom.files.front_run import NOT_THE_CONFIGURATION, ComparedRun
from deboom.files.run_folder import RunEntry
from deboom.names import option_name
from deboom.plot.style import signed
from deboom.progress import Progress
from deboom.report import Report, Step

CHUNK = 50
"""Designs between two signs of progress."""
QUESTION = "Which of these fronts is better, and is the difference real?"
SHOWN_PAIRS = 15
"""Pairs that a page shows of many."""
LONGEST_NAME = 60
"""Characters of a configuration's name; with more, names are `LETTERED`."""
LETTERED = "front "


@dataclass(frozen=True, eq=False, kw_only=True)
class JudgedRun(JudgedFront):
    """A run's front under the common draws; variables without effect are at nominal.

    Parameters
    ----------
    run : ComparedRun
        The run.
    name : str
        Of its configuration.
    n_failed : int
        Designs of the front that could not be computed.
    """

    run: ComparedRun
    name: str
    n_failed: int

    @cached_property
    def objectives(self) -> RealArray:
        """Mean over the sets, shape (n, 2) [unit of the objectives]."""
        return np.asarray(self.by_set.mean(axis=0))


@dataclass(frozen=True, eq=False)
class Comparison:
    """Fronts under one judge.

    Parameters
    ----------
    judge : Robust
        Model of one of the runs.
    judge_name : str
        Name of its configuration; empty where all runs have the same model.
    fronts : tuple of JudgedRun
        In the order of the runs.
    n_samples, seed : int
        Of the common draws.
    """

    judge: Robust
    judge_name: str
    fronts: tuple[JudgedRun, ...]
    n_samples: int
    seed: int

    @cached_property
    def box(self) -> CommonBox:
        """Of all fronts."""
        return common_box([judged.objectives for judged in self.fronts])

    @cached_property
    def groups(self) -> dict[str, list[JudgedRun]]:
        """Runs by configuration."""
        groups: dict[str, list[JudgedRun]] = {}
        for judged in self.fronts:
            groups.setdefault(judged.name, []).append(judged)
        return groups

    @cached_property
    def hypervolumes(self) -> dict[str, RealArray]:
        """By configuration: share of the box, shape (n_runs, n_sets) [1]."""
        return {
            name: np.array([judged.merit(self.box) for judged in runs])
            for name, runs in self.groups.items()
        }

    @cached_property
    def pairs(self) -> dict[tuple[str, str], Difference]:
        """Every configuration against every other, as shares of the box."""
        only_seeds = len({judged.run.configuration for judged in self.fronts}) == 1
        return {
            names: front_difference(
                self.groups[names[0]],
                self.groups[names[1]],
                box=self.box,
                names=names,
                judge=self.judge,
                may_cover_by_chance=only_seeds,
            )
            for names in combinations(self.groups, 2)
        }

    @property
    def best(self) -> str:
        """Configuration with the largest mean hypervolume."""
        return max(self.hypervolumes, key=lambda name: float(self.hypervolumes[name].mean()))

    @property
    def headline(self) -> str:
        """Which front is best, and which cannot be told from it, in a sentence."""
        best = self.best
        pairs = {
            (set(pair) - {best}).pop(): judged_pair
            for pair, judged_pair in self.pairs.items()
            if best in pair
        }
        verdicts = {judged_pair.verdict for judged_pair in pairs.values()}
        if verdicts == {FrontVerdict.equal}:
            return f"{listed([best, *pairs])} have the same front: there is nothing to choose."
        if verdicts == {FrontVerdict.real}:
            rest = next(iter(pairs)) if len(pairs) == 1 else "all others"
            return f"{best} is really better than {rest}."
        alike = [
            name
            for name, judged_pair in pairs.items()
            if judged_pair.verdict is not FrontVerdict.real
        ]
        if FrontVerdict.real not in verdicts:
            every = listed([best, *alike])
            return f"Chance can explain all differences between the fronts of {every}."
        return f"{best} has the best front, and chance can explain why it beats {listed(alike)}."

    def gap(self, first: str, second: str) -> float:
        """Mean difference of the first objective at equal second one [its unit]."""
        gaps = [
            level_gap(judged.objectives, other.objectives)
            for judged in self.groups[first]
            for other in self.groups[second]
        ]
        finite = [gap for gap in gaps if np.isfinite(gap)]
        return float(np.mean(finite)) if finite else float("nan")

    @cached_property
    def per_line(self) -> float:
        """Factor from sums over responses and lines to their mean; 1 for other objectives [1]."""
        n_lines = getattr(self.judge.evaluate, "n_lines", None)
        if self.judge.objectives != (MEAN_SUM, SIGMA_SUM) or n_lines is None:
            return 1.0
        return 1.0 / (int(n_lines) * len(self.judge.evaluate.response_names))


def judged(
    runs: Sequence[ComparedRun],
    n_samples: int,
    seed: int,
    progress: Progress,
    judge: Robust | None = None,
    judge_name: str = "",
) -> Comparison:
    """Judge the fronts of runs by one model, by default that of the first run.

    Raises
    ------
    InputError
        A front that cannot be computed.
    """
    judge = judge or runs[0].model
    judges = common_judges(judge, n_samples, seed)
    free = variables_without_effect(judge.evaluate, judge.space)
    total = sum(len(run.designs) for run in runs)
    done, fronts, begin = 0, [], time.perf_counter()
    for run, name in zip(runs, configuration_names(runs), strict=True):
        parts = []
        for chunk in np.split(run.designs, range(CHUNK, len(run.designs), CHUNK)):
            parts.append(np.stack([values.objectives for values in judges.by_set(chunk)]))
            done += len(chunk)
            progress(done, total, f"designs judged, {time.perf_counter() - begin:.0f} s")
        by_set = np.concatenate(parts, axis=1)
        computed = np.isfinite(by_set).all(axis=(0, 2))
        if not computed.any():
            raise InputError(f"no design of {run.entry.folder} can be computed with common draws")
        designs = at_nominal(run.designs[computed], judge.space, free)
        fronts.append(
            JudgedRun(
                by_set=by_set[:, computed],
                gain=last_gain(run.front.convergence),
                converged=run.front.converged,
                found_with=run.model.sample,
                run=run,
                name=name,
                designs=designs,
                n_failed=int((~computed).sum()),
            )
        )
    return Comparison(judge, judge_name, tuple(fronts), n_samples, seed)


def configuration_names(runs: Sequence[ComparedRun]) -> list[str]:
    """Return the name of each run's configuration: the options in which they differ.

    Runs that differ in nothing but the seed, all of them, are configurations of their own. Where
    they differ in so much that a sentence could not hold it, names are ``front A`` and so on.
    """
    if len({run.configuration for run in runs}) == 1:
        seeds = [run.seed for run in runs]
        return [
            f"seed {run.seed}" if seeds.count(run.seed) == 1 else run.entry.name for run in runs
        ]
    table = pd.DataFrame([_options(run.entry) for run in runs])
    several = table["study"].nunique() > 1
    within = table.groupby("study").nunique(dropna=False).max() > 1
    differing = [*["study"] * several, *within.index[within]]
    names = [
        ", ".join(f"{name} {value}" for name, value in row.dropna().items())
        for _, row in table[differing].iterrows()
    ]
    if max(map(len, names)) <= LONGEST_NAME:
        return names
    letters = {name: get_column_letter(k) for k, name in enumerate(dict.fromkeys(names), 1)}
    return [f"{LETTERED}{letters[name]}" for name in names]


def _options(entry: RunEntry) -> dict[str, str]:
    """Return what a run was asked, in words; `facts` know what a model took by default."""
    words = {"study": entry.study}
    for name, value in entry.record["arguments"].items():
        if name not in NOT_THE_CONFIGURATION:
            fact = f"{entry.record.get('facts', {}).get(name, '')} by default".strip()
            words[option_name(name)] = fact if value is None else str(value)
    return words


NOT_COMPARABLE = "not comparable: different models"


def compared_report(studies: Sequence[Comparison]) -> Report:
    """Report fronts under every judge: one verdict where there is one model, else one each."""
    if len(studies) == 1:
        return comparison_report(studies[0])
    report = Report("Fronts compared", QUESTION)
    (verdict,) = sentences(studies)
    report.answer(verdict, letters_in_words(studies[0]), _how_sure(studies[0]), NOT_TO_TRUST)
    _next(report, studies)
    report.section("The verdict", verdict)
    report.number(
        "verdict", overall(studies), "", "verdict over the fronts: over all models", headline="s"
    )
    report.number("n_judges", len(studies), "", "models that judge, each with keys judge_<n>_…")
    for number, study in enumerate(studies, start=1):
        part = _judged_report(study)
        names = {
            name: f"judge_{number}_{name}" for name in (*part.tables, *part.pictures, *part.summary)
        }
        report.include(part, f"Judged by the model of {study.judge_name}", names=names)
    _differences(report, studies[0])
    return report


NOT_TO_TRUST = (
    "What not to trust: a better front is one of the model. What it brings in cars is on its own "
    "page."
)


def letters_in_words(study: Comparison) -> str:
    """Say which runs the letters stand for; empty where names say it themselves."""
    if not study.best.startswith(LETTERED):
        return ""
    runs = {
        name: listed(tuple(judged.run.entry.name for judged in group))
        for name, group in study.groups.items()
    }
    words = "; ".join(f"{name} is of run {run}" for name, run in runs.items())
    return f"{words[0].upper()}{words[1:]}: the last table has all in which they differ."


def _how_sure(study: Comparison) -> str:
    """Say when a difference counts, and how the fronts were judged."""
    return (
        "How sure: a difference is real if chance gives it in less than "
        f"{PERCENT * (1 - REAL_FROM):g} % of all cases; every front was computed again with "
        f"{study.n_samples} common draws."
    )


def _next(report: Report, studies: Sequence[Comparison]) -> None:
    """Say what comes next: one model, more seeds where something is open, what a front says."""
    is_open = any(p.verdict is FrontVerdict.open for study in studies for p in study.pairs.values())
    more = Step("deboom run STUDY --seed SEED", f"{ENOUGH_SEEDS} seeds of each front decide")
    other = Step("deboom run STUDY", "one of the fronts again, with the model of the other")
    report.panel(
        "What to do next",
        *[other] * (overall(studies) == NOT_COMPARABLE),
        *[more] * is_open,
        Step("deboom show RUN", "what a front says to build"),
        wide=True,
    )


def overall(studies: Sequence[Comparison]) -> str:
    """Return the verdict over all judges: that of one model, or of several that agree."""
    verdicts = {(study.best, study.headline) for study in studies}
    return NOT_COMPARABLE if len(verdicts) > 1 else studies[0].headline


def comparison_report(study: Comparison) -> Report:
    """Report fronts compared under one judge."""
    report = _judged_report(study)
    _differences(report, study)
    return report


def _judged_report(study: Comparison) -> Report:
    """Report what one judge says of fronts, without what the runs do not have in common."""
    (first, second), judged_pair = next(iter(study.pairs.items()))
    verdicts = [pair.verdict for pair in study.pairs.values()]
    gap, beside = study.gap(first, second) * study.per_line, ""
    report = Report("Fronts compared", QUESTION)
    report.explain(
        "Pareto front",
        "hypervolume",
        "attainment band",
        "within noise",
        "tolerance",
        "σ",
    )
    told = any(
        study.best in pair and entry.verdict is FrontVerdict.real
        for pair, entry in study.pairs.items()
    )
    report.number(
        "best",
        study.best if told else "none",
        "",
        "front that is better by more than chance may make it",
        headline="s",
    )
    if len(study.pairs) == 1 and np.isfinite(gap):
        level = f"{abs(gap):.3f} {unit_word(study)}".strip()
        side = "above" if gap > 0.0 else "below"
        beside = f"At equal σ the mean level of {first} is {level} {side} that of {second}."
    verdict = " ".join(sentences([study]))
    report.answer(
        f"{verdict[0].upper()}{verdict[1:]}",
        beside,
        letters_in_words(study),
        _how_sure(study),
        NOT_TO_TRUST,
    )
    _next(report, [study])
    report.number("n_runs", len(study.fronts), "", "runs that are compared")
    report.number("n_configurations", len(study.groups), "", "configurations of these runs")
    report.number("n_pairs", len(verdicts), "", "pairs of configurations")
    report.number("n_real", verdicts.count(FrontVerdict.real), "", "pairs that really differ")
    report.number(
        "n_within_noise", verdicts.count(FrontVerdict.noise), "", "pairs that differ within noise"
    )
    report.number("n_not_decided", verdicts.count(FrontVerdict.open), "", "pairs not decided")
    report.number("n_equal", verdicts.count(FrontVerdict.equal), "", "pairs that are equal")
    report.number("first", first, "", "first configuration of the first pair")
    report.number("second", second, "", "second configuration of the first pair")
    report.number(
        "verdict", judged_pair.verdict.value, "", "verdict over the first pair", headline="s"
    )
    report.number(
        "hypervolume_difference_percent",
        PERCENT * judged_pair.value,
        "%",
        "hypervolume of the first pair, first minus second",
        headline="+.2f",
    )
    report.number(
        "noise_percent",
        PERCENT * judged_pair.noise,
        "%",
        "difference of hypervolume that chance alone may give, ±",
        headline=".2f",
    )
    if np.isfinite(gap):
        report.number(
            "level_difference",
            gap,
            unit_word(study),
            "mean level of the first pair at equal σ, first minus second",
            headline="+.3f",
        )
    for name, volumes in study.hypervolumes.items():
        configuration = re.sub(r"\W+", "_", name).strip("_")
        report.number(
            f"hypervolume_percent_{configuration}",
            PERCENT * float(volumes.mean()),
            "%",
            "hypervolume of the configuration's fronts, mean of its runs",
        )
    report.facts |= {
        "judge": study.judge_name or "the model of all runs",
        "common_draws": study.n_samples,
        "sets_of_draws": SETS,
    }
    report.inputs += [path for judged in study.fronts for path in judged.run.files]
    report.assume(*(said for judged in study.fronts for said in judged.run.assumed))

    _verdict(report, study)
    report.section("How it was decided", _method(study))
    _fronts(report, study)
    return report


def _differences(report: Report, study: Comparison) -> None:
    """List what the runs do not have in common."""
    differ = differences([f.run for f in study.fronts], [f.name for f in study.fronts])
    report.section(
        "What the runs do not have in common",
        "Beside these items the runs are equal: the study's options, the versions of all "
        "packages, and the hashes of the platform's files."
        if len(differ)
        else "Nothing.",
    )
    caption = "Only what differs is shown." if len(differ) else ""
    report.table("differences", differ, caption)


def _verdict(report: Report, study: Comparison) -> None:
    """Say which front is better, and show the difference beside its noise."""
    pairs, shown = pair_table(study), _shown(study)
    report.section("The verdict", study.headline)
    for pair in shown:
        report.text(verdict_sentence(study, pair))
    rows = [(row.first, row.second) in shown for row in pairs.itertuples()]
    if not all(rows):
        report.text(f"All {len(pairs)} pairs are in pairs.csv.")
    configurations = {judged.run.configuration for judged in study.fronts}
    if len(configurations) == 1 and any(
        d.verdict is FrontVerdict.real for d in study.pairs.values()
    ):
        report.text(
            "These runs differ in nothing but their seed. A real difference between them says that "
            "the search of the worse one had come to rest elsewhere: give it more generations, or "
            "several searches (--searches)."
        )
    differences = [study.pairs[pair] for pair in shown]
    value = PERCENT * np.array([judged_pair.value for judged_pair in differences])
    noise = PERCENT * np.array([judged_pair.noise for judged_pair in differences])
    panel = plot.IntervalPanel(
        "difference of hypervolume [% of the box]", {"": (value, value - noise, value + noise)}
    )
    report.figure(
        "noise",
        lambda: plot.interval_panels([f"{first} − {second}" for first, second in shown], [panel]),
        "Difference of hypervolume, with the interval that other draws and other seeds can "
        "explain (99 %).",
    )
    report.table(
        "pairs",
        pairs,
        "Level at equal σ is the mean over the range of σ that both fronts have; "
        "negative: the first is quieter. Covers: share of the other's points that "
        "a front equals or beats.",
        {"hypervolume, first minus second [%]": 2, "noise, 99 % [%]": 2},
        shown=pairs[rows].drop(columns=["error from draws [%]", "error from searches [%]"]),
    )


def _fronts(report: Report, study: Comparison) -> None:
    """Show all fronts under the common draws."""
    unit, (mean_label, sigma_label) = unit_label(study), objective_labels(study)
    corner = study.box.reference_point * study.per_line
    report.section(
        "The fronts",
        "All designs under the common draws. A step line encloses what a front dominates.",
    )
    report.figure(
        "fronts",
        lambda: plot.fronts(
            {name: tuple((_median_front(study, name) * study.per_line).T) for name in study.groups},
            {},
            {"reference point": (float(corner[0]), float(corner[1]))},
            mean_label=f"{mean_label} {unit}",
            sigma_label=f"{sigma_label} {unit}",
        ),
        "Down and left is better. Of several runs the line is what half of them attain.",
    )
    table = front_table(study)
    hidden = ["seed", *(name for name in table.columns if name.startswith("best "))]
    if not table["failed"].any():
        hidden.append("failed")
    fine = ("hypervolume [%]", "noise of the search [%]")
    report.table(
        "fronts",
        table,
        "Every run. The hypervolume is a share of the common box; noise of the search is what the "
        "run alone says of its standard deviation over seeds.",
        dict.fromkeys(fine, 2),
        shown=table.drop(columns=hidden),
    )
    points = [
        pd.DataFrame(
            {
                "run": judged.run.entry.name,
                "configuration": judged.name,
                f"{mean_label} {unit}": judged.objectives[:, 0] * study.per_line,
                f"{sigma_label} {unit}": judged.objectives[:, 1] * study.per_line,
            }
        )
        for judged in study.fronts
    ]
    report.table("points", pd.concat(points, ignore_index=True))


def pair_table(study: Comparison) -> pd.DataFrame:
    """One row per pair of configurations: difference, noise, verdict, and what it means."""
    rows = []
    for (first, second), judged_pair in study.pairs.items():
        better, other = _median_front(study, first), _median_front(study, second)
        rows.append(
            {
                "first": first,
                "second": second,
                "verdict": judged_pair.verdict.value,
                "hypervolume, first minus second [%]": PERCENT * judged_pair.value,
                "noise, 99 % [%]": PERCENT * judged_pair.noise,
                "error from draws [%]": PERCENT * judged_pair.draw_error,
                "error from searches [%]": PERCENT * judged_pair.search_error,
                f"level at equal σ, first minus second {unit_label(study)}": study.gap(
                    first, second
                )
                * study.per_line,
                "first covers second [%]": PERCENT * coverage(better, other),
                "second covers first [%]": PERCENT * coverage(other, better),
            }
        )
    return pd.DataFrame(rows)


def front_table(study: Comparison) -> pd.DataFrame:
    """One row per run: figures of merit of its front under the common draws."""
    rows = []
    for judged in study.fronts:
        front = judged.objectives
        volumes = [study.box.hypervolume(part) for part in judged.by_set]
        rows.append(
            {
                "run": judged.run.entry.name,
                "configuration": judged.name,
                "seed": judged.run.seed,
                "designs": len(front),
                "failed": judged.n_failed,
                "still non-dominated [%]": PERCENT * float(np.mean(nondominated(front))),
                "hypervolume [%]": PERCENT * float(np.mean(volumes)),
                "noise of the search [%]": PERCENT * judged.noise(study.box)[0],
                f"best mean {unit_label(study)}": front[:, 0].min() * study.per_line,
                f"best σ {unit_label(study)}": front[:, 1].min() * study.per_line,
            }
        )
    return pd.DataFrame(rows)


def objective_labels(study: Comparison) -> tuple[str, str]:
    """Return what the two objectives are."""
    if study.per_line != 1.0:
        return "mean level over vehicles and lines", "its σ over the tolerance"
    first, second = (objective.name for objective in study.judge.objectives)
    return first, second


def unit_label(study: Comparison) -> str:
    """Return the unit of the objectives in brackets; levels differ in dB."""
    return f"[{study.judge.evaluate.response_unit.replace('dB(A)', 'dB')}]"


def unit_word(study: Comparison) -> str:
    """Return the unit as it stands behind a number."""
    unit = unit_label(study).strip("[]")
    return "" if unit == "1" else unit


def _median_front(study: Comparison, name: str) -> RealArray:
    """Return what the median run of a configuration attains."""
    runs = [judged.objectives for judged in study.groups[name]]
    return np.asarray(attainment(runs, [0.5])[0.5])


def verdict_sentence(study: Comparison, pair: tuple[str, str]) -> str:
    """Say in one sentence what came out for two configurations."""
    first, second = pair
    judged_pair = study.pairs[pair]
    value, noise = PERCENT * judged_pair.value, PERCENT * judged_pair.noise
    if judged_pair.verdict is FrontVerdict.equal:
        one, other = (
            np.unique(np.concatenate([run.designs for run in study.groups[name]]), axis=0)
            for name in pair
        )
        alike = "the same designs" if np.array_equal(one, other) else "other designs"
        return f"{first} and {second} have the same front: {alike} with the same values."
    if judged_pair.verdict is FrontVerdict.open:
        lacking = judged_pair.too_few
        return (
            f"{first} against {second} is not decided: the hypervolume differs by "
            f"{signed(value, 2)} %, and with so few seeds chance may give ±{noise:.2f} %. Run "
            f"{ENOUGH_SEEDS} seeds of {lacking[0] if len(lacking) == 1 else 'each'}"
            f"{_apart(study, lacking)}."
        )
    if judged_pair.verdict is FrontVerdict.noise:
        return (
            f"{first} and {second} differ by no more than chance: the hypervolume differs by "
            f"{signed(value, 2)} %, and chance alone may give ±{noise:.2f} %."
        )
    better, worse = (first, second) if judged_pair.value > 0.0 else (second, first)
    if abs(judged_pair.value) <= judged_pair.noise:
        return (
            f"{better} is really better than {worse}: under all draws its front equals or beats "
            f"every design of the other ({abs(value):.2f} % hypervolume)."
        )
    return (
        f"{better} is really better than {worse}: its front dominates {abs(value):.2f} % more of "
        f"the box; chance alone may give ±{noise:.2f} %."
    )


def _apart(study: Comparison, names: Sequence[str]) -> str:
    """Say how far apart new seeds must be where each run has taken several."""
    runs = [judged.run for name in names for judged in study.groups[name]]
    most = max(int(run.entry.record["arguments"].get("searches") or 1) for run in runs)
    return f", {most} apart, since --searches {most} takes so many" if most > 1 else ""


def _shown(study: Comparison) -> list[tuple[str, str]]:
    """Return the pairs that a page shows: all, or of many those with the best configuration."""
    pairs = list(study.pairs)
    if len(pairs) <= SHOWN_PAIRS:
        return pairs
    return [pair for pair in pairs if study.best in pair][:SHOWN_PAIRS]


def _method(study: Comparison) -> str:
    scale, box = study.per_line, study.box
    unit = unit_word(study)
    ideal, nadir, corner = (
        ", ".join(f"{value * scale:.4g} {unit}".strip() for value in point)
        for point in (box.ideal, box.nadir, box.reference_point)
    )
    return (
        f"One model judges all fronts with {study.n_samples} draws that no search "
        f"has seen: {SETS} independent scrambled Sobol sets, seed {study.seed}.\n\n"
        f"The best front of all runs together spans a box from its ideal ({ideal}) to its nadir "
        f"({nadir}). The reference point of the hypervolume ({corner}) lies a tenth of the box "
        "beyond the nadir; the hypervolume is given as the share of the box up to there.\n\n"
        f"A difference is real if chance gives such a difference in less than "
        f"{PERCENT * (1 - REAL_FROM):g} % of all cases. Chance is in the draws (spread of the "
        f"difference over the {SETS} sets) and in the searches: with {ENOUGH_SEEDS} seeds or more "
        "of a configuration their own spread counts. Fewer fronts that descents have brought to "
        f"convergence scatter by {PERCENT * LEFT_BY_DESCENTS:g} %. Of other runs what the last "
        f"{PERCENT * LAST_PART:g} % of the generations have gained stands for the scatter, since a "
        "search that still moved by so much could as well have ended elsewhere by so much; without "
        "convergence.csv the whole hypervolume does."
    )


def sentences(studies: Sequence[Comparison]) -> list[str]:
    """Return the verdicts in words, for a terminal."""
    if len(studies) == 1:
        return [verdict_sentence(studies[0], pair) for pair in _shown(studies[0])]
    verdict = overall(studies)
    if verdict == NOT_COMPARABLE:
        return [f"{verdict[0].upper()}{verdict[1:]}, which do not agree on the better front."]
    return [f"{verdict[0].upper()}{verdict[1:]} Each of the {len(studies)} models says so."]


def differences(runs: Sequence[ComparedRun], names: Sequence[str]) -> pd.DataFrame:
    """Return what the runs do not have in common, one row per item and a column per name.

    - `names`: of the configuration of each run; runs of one name share a column.
    """
    facts = [dict(_facts(run)) for run in runs]
    rows = []
    for item in dict.fromkeys(name for record in facts for name in record):
        values = [str(record.get(item, "–")) for record in facts]
        if len(set(values)) > 1:
            cells: dict[str, list[str]] = {}
            for name, value in zip(names, values, strict=True):
                kept = cells.setdefault(name, [])
                if value not in kept:
                    kept.append(value)
            rows.append({"what differs": item, **{n: ", ".join(v) for n, v in cells.items()}})
    return pd.DataFrame(rows, columns=["what differs", *dict.fromkeys(names)])


def _facts(run: ComparedRun) -> Mapping[str, Any]:
    record = run.entry.record
    environment = record["environment"]
    git = environment.get("git") or {}
    revision = git.get("revision")
    return {
        "study": run.entry.study,
        **{option_name(name): value for name, value in record["arguments"].items()},
        **{name.replace("_", " "): value for name, value in record.get("facts", {}).items()},
        "Python": environment.get("python"),
        **environment.get("packages", {}),
        "revision": f"{revision[:10]}{', changed' if git['dirty'] else ''}" if revision else None,
        "script as it is today": "no" if run.text_changed else "yes",
        "input files": len(record["inputs_sha256"]),
    }
