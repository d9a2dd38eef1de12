"""What every study returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from deboom.report.page import Page

Scalar = float | int | str


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
