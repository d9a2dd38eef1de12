"""Results that a notebook shows as a table; tables as CSV, records as JSON."""

from __future__ import annotations

import gzip
import io
import json
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

PACKED = ".gz"
"""Ending behind ``.csv`` of a table that is compressed; pandas and R read it as it is."""
MOST_ROWS = 100_000
"""Rows of a table that is kept as plain CSV; a longer one is compressed."""
SHOWN_ROWS = 12
"""Rows that a notebook shows of a longer table."""


class Tabled(ABC):
    """A result whose numbers stand in `table`, columns ``name [unit]``."""

    @property
    @abstractmethod
    def table(self) -> pd.DataFrame:
        """The result as a table."""

    def to_frame(self) -> pd.DataFrame:
        """Return `table`."""
        return self.table

    def _repr_html_(self) -> str:
        """Show `table` in a notebook."""
        return self.table.to_html(
            max_rows=SHOWN_ROWS, float_format=lambda value: f"{value:.5g}", index=False
        )


# directions, dashes and numbers are no formulas, though they begin like one
_FORMULA = re.compile(r"'*(?![+-]?(r?[xyz]|[\d.]+(e[+-]?\d+)?)?\Z)[=+\-@\t\r]", re.IGNORECASE)


def csv_text(table: pd.DataFrame) -> str:
    """Return a table as CSV; a text that a spreadsheet would take for a formula gets a quote."""
    plain = table.copy()
    for name in table.select_dtypes(include=["object", "string"]).columns:
        plain[name] = table[name].map(_escaped)
    plain.columns = pd.Index([_escaped(label) for label in table.columns])
    return str(plain.to_csv(index=False, lineterminator="\n"))


def table_file(stem: str, table: pd.DataFrame) -> tuple[str, bytes]:
    """Return name and content of a table's file; the same table gives the same bytes.

    A table of more than `MOST_ROWS` rows is compressed: ``<stem>.csv.gz``.
    """
    content = csv_text(table).encode()
    if len(table) > MOST_ROWS:
        return f"{stem}.csv{PACKED}", gzip.compress(content, compresslevel=6, mtime=0)
    return f"{stem}.csv", content


def json_text(content: Mapping[str, Any]) -> str:
    """Return a mapping as JSON; a number that is not finite is refused."""
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False, default=_json_form)
    return text + "\n"


def _json_form(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return value.as_posix()
    raise TypeError(f"{type(value).__name__} has no form in JSON")


# until 3.1 the parser of pandas loses the last digits of a number unless it is told not to
EXACT: dict[str, Any] = (
    {"float_precision": "round_trip"}
    if tuple(int(number) for number in pd.__version__.split(".")[:2]) < (3, 1)
    else {}
)


def table_of(text: str, texts: Sequence[str] = ()) -> pd.DataFrame:
    """Return the table that `csv_text` wrote: texts are as they were, and none is a number missing.

    - `texts`: columns of names, which may look like numbers; others that hold numbers only become
      numbers. An empty cell is nan.
    - raises ValueError: no table.
    """
    header = pd.read_csv(io.StringIO(text), nrows=0, keep_default_na=False).columns
    dtype = {label: str for label in header if unescaped(label) in texts}
    table: pd.DataFrame = pd.read_csv(
        io.StringIO(text),
        dtype=dtype,
        keep_default_na=False,
        na_values=[""],
        **EXACT,
    )
    table.columns = pd.Index([unescaped(label) for label in table.columns])
    for name in table.select_dtypes(include=["object", "string"]).columns:
        table[name] = table[name].map(
            lambda cell: unescaped(cell) if isinstance(cell, str) else cell
        )
    return table


def unescaped(cell: str) -> str:
    """Return the text of a cell that `csv_text` wrote."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def _escaped(value: Any) -> Any:
    return f"'{value}" if isinstance(value, str) and _FORMULA.match(value) else value
