"""Compare the fronts of runs: is one really better, or is it noise?

The model of the runs evaluates all fronts with the same draws. If the runs have different models,
each model gives a verdict. Runs that differ only in their seed show the influence of chance; three
or more seeds of each configuration give a clear verdict. Runs of different platforms, and run
folders with edited files, are refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from deboom.errors import InputError
from deboom.explore.space import checked_seed
from deboom.files.front_run import ComparedRun
from deboom.pages.comparison import (
    Comparison,
    compared_report,
    configuration_names,
    judged,
    letters_in_words,
    sentences,
)
from deboom.progress import progress_bar
from deboom.report import Report
from deboom.runs.options import StudiesFolder
from deboom.runs.rebuilt import (
    check_same_platform,
    check_same_question,
    compared_run,
    distinct_models,
)

QUESTION = "Which of these fronts is better, and is the difference real?"
FEWEST = 1024
"""Draws of the common sample, at least."""


@dataclass(frozen=True)
class Options:
    """Which runs are compared, and with which draws."""

    runs: Annotated[list[Path], Argument(help="Run folders of front studies, two or more.")]
    seed: Annotated[int, Option(help="Seed of the common draws, 1 or higher.")] = 1
    samples: Annotated[
        int, Option(help="Number of common draws, a power of two, 1024 or higher.")
    ] = 2048
    studies: StudiesFolder = None


def prepare(options: Options) -> list[ComparedRun]:
    """Read the runs, build their models again, and refuse runs that cannot be compared."""
    # their order changes nothing
    folders, samples = sorted(options.runs, key=Path.as_posix), options.samples
    checked_seed(options.seed)
    n_different = len({folder.resolve() for folder in folders})
    if n_different < len(folders) or len(folders) < 2:
        raise InputError(
            f"{len(folders)} run folders, {n_different} of them different: give two different "
            "runs or more"
        )
    if samples < FEWEST or samples & (samples - 1):
        raise InputError(f"{samples} common draws: take a power of two from {FEWEST}")
    prepared: dict[str, object] = {}  # runs of one question share their model
    runs = sorted(
        (compared_run(folder, options.studies, prepared) for folder in folders),
        key=lambda run: (run.entry.study, run.entry.name, run.entry.folder.as_posix()),
    )
    check_same_platform(runs)
    check_same_question(runs)
    return runs


def run(runs: list[ComparedRun], options: Options) -> Report:
    """Judge the fronts by each of their models, report, and say the verdicts."""
    names = dict(zip((run.entry.folder for run in runs), configuration_names(runs), strict=True))
    models = distinct_models(runs)
    comparisons: list[Comparison] = []
    with progress_bar("common draws") as bar:
        for compared in models:
            name = names[compared.entry.folder] if len(models) > 1 else ""
            comparisons.append(
                judged(
                    runs,
                    options.samples,
                    options.seed,
                    bar,
                    judge=compared.model,
                    judge_name=name,
                )
            )
    for sentence in filter(None, (letters_in_words(comparisons[0]), *sentences(comparisons))):
        print(sentence)
    return compared_report(comparisons)
