"""What a study found, as data: numbers with unit and meaning, and the first screen of its page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

Scalar = bool | int | float | str

ANSWER = "answer.json"
"""File of a run that holds its answer."""


@dataclass(frozen=True)
class Number:
    """A number, or a word, of ``summary.json`` with its unit and its meaning.

    - `key`: its name there, such as ``expected_change_db_U06-1``.
    - `value`: in `unit`; None where it is not known.
    - `unit`: empty for counts and words, ``1`` for ratios.
    - `label`: what it is.
    - `headline`: as lists of runs show it, such as ``−3.1 dB``; empty where they do not.
    """

    key: str
    value: Scalar | None
    unit: str
    label: str
    headline: str = ""


@dataclass(frozen=True)
class Step:
    """Something to do next: a command as it is typed, and what it is for."""

    command: str
    purpose: str


@dataclass(frozen=True)
class AnswerTable:
    """A table of a first screen.

    - `columns`: ``name [unit]``; the first one names the rows.
    - `rows`: None where a cell is empty.
    - `caption`: below it; may be empty.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Scalar | None, ...], ...]
    caption: str = ""

    @property
    def frame(self) -> pd.DataFrame:
        """The table for a notebook."""
        import pandas as pd

        return pd.DataFrame(list(self.rows), columns=list(self.columns))


@dataclass(frozen=True)
class Answer:
    """The first screen of a page without its sounds and pictures, and all numbers of its summary.

    - `title`, `question`, `verdict` (empty for pages without one), `remarks`, `warnings`: sentences
      in the order of reading.
    - `numbers`: of ``summary.json``.
    - `panels`: by their heading.
    """

    title: str
    question: str
    verdict: str = ""
    remarks: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    numbers: tuple[Number, ...] = ()
    panels: Mapping[str, tuple[str | Step | AnswerTable, ...]] = field(default_factory=dict)

    @property
    def headlines(self) -> dict[str, str]:
        """Numbers that lists of runs show: meaning → number with its unit."""
        return {number.label: number.headline for number in self.numbers if number.headline}
