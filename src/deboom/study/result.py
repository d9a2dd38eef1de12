"""What a study gets from its runner, and what it returns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from deboom.explore.robust import RobustResponse
from deboom.files.checkpoint import CheckpointFolder
from deboom.files.run_folder import Run, hash_files
from deboom.report import Report
from deboom.report import Scalar as Scalar
from deboom.report.page import Page, report_of


@dataclass(frozen=True, eq=False)
class StudyResult:
    """Everything a run folder holds, apart from its provenance.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        File stem → table with columns ``name [unit]``; each becomes ``<stem>.csv``.
    figures : mapping of str to bytes
        File stem → PNG; each becomes ``figures/<stem>.png``.
    summary : mapping of str to float, int or str
        Flat headline numbers; becomes ``summary.json``. The study's docstring explains the keys.
    page : Page
        The report, without its provenance, which the runner adds.
    inputs : tuple of Path
        Every file the study read; their hashes go into ``run.json``.
    facts : mapping of str to float, int or str
        What the study settled itself, such as the kernel it used; goes into ``run.json``.
    documents : mapping of str to mapping
        File stem → what other studies load, such as an identified model; becomes ``<stem>.json``.
    attachments : mapping of str to bytes
        File name → content of further documents, such as a page for a supplier.
    """

    tables: Mapping[str, pd.DataFrame]
    figures: Mapping[str, bytes]
    summary: Mapping[str, Scalar]
    page: Page
    inputs: tuple[Path, ...]
    facts: Mapping[str, Scalar] = field(default_factory=dict)
    documents: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    attachments: Mapping[str, bytes] = field(default_factory=dict)

    def report(self) -> Report:
        """Return the report with all of these files."""
        report = report_of(self.page)
        report.tables = dict(self.tables)
        report.figures = dict(self.figures)
        report.documents = dict(self.documents)
        report.attachments = dict(self.attachments)
        report.summary = dict(self.summary)
        report.facts = dict(self.facts)
        report.inputs = list(self.inputs)
        return report


def as_report(result: Report | StudyResult) -> Report:
    """Return the report of a study that is not yet in two phases."""
    return result.report() if isinstance(result, StudyResult) else result


@dataclass(frozen=True)
class RunContext:
    """The run that a study is part of.

    The runner gives it to ``run(model, options, context)``; without a runner it is None.

    Parameters
    ----------
    run : Run
        Its folder.
    relative_to : Path
        Input files are named by their path from here.
    """

    run: Run
    relative_to: Path

    def search_begins(self, model: RobustResponse) -> None:
        """Learn what a search for a front is about to evaluate.

        A run goes on; `deboom.study.rebuilt` wants no more than the model.

        Parameters
        ----------
        model : RobustResponse
            Model, design space and draws of the search.
        """

    def checkpoint(self, inputs: Iterable[Path], name: str = "search") -> CheckpointFolder:
        """Return where a search of this run is kept.

        Parameters
        ----------
        inputs : iterable of Path
            Every file that the search depends on.
        name : str
            Folder within the run; each search of a run has its own.

        Raises
        ------
        InputError
            An input file that has changed since the run began, or cannot be read.
        """
        hashes = hash_files(inputs, relative_to=self.relative_to)
        return CheckpointFolder(self.run.folder / name, hashes)
