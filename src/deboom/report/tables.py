"""From a table with ``name [unit]`` columns to the words of an HTML table."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeGuard

import pandas as pd

from deboom.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

UNIT_DECIMALS: Mapping[str, int] = {
    "Hz": 2,
    "rpm": 0,
    "1": 3,
    "dB(A)": 1,
    "dB": 2,
    "%": 1,
    "mm": 2,
    "µm": 1,
    "s": 1,
}
"""Decimals that a unit deserves; other units show three digits of their median."""

_LABEL = re.compile(r"^(?P<name>.*\S)\s*\[(?P<unit>[^\[\]]+)\]$")
_MISSING = "–"
_GROUPED_FROM = 10_000


@dataclass(frozen=True)
class Column:
    """One column as text: heading, unit (empty for plain numbers and words) and cells."""

    name: str
    unit: str
    numeric: bool
    cells: tuple[str, ...]


def split_label(label: str) -> tuple[str, str]:
    """Split ``name [unit]``; the unit is empty where there is none."""
    match = _LABEL.match(label)
    if match is None:
        return label, ""
    return match["name"], match["unit"]


def text_columns(frame: pd.DataFrame, decimals: Mapping[str, int]) -> tuple[Column, ...]:
    """Write every cell of a table with the same number of decimals down each column.

    - `frame`: columns ``name [unit]``; the index is not shown.
    - `decimals`: by full column label, where the default does not serve.
    - returns columns with minus signs U+2212, a dash for missing values, and five digits and more
      grouped by thin spaces.
    - raises InputError: decimals for a column that does not exist.
    """
    unknown = sorted(set(decimals) - set(frame.columns))
    if unknown:
        raise InputError(f"decimals for unknown columns {unknown}; there are {list(frame.columns)}")
    columns = []
    for place, label in enumerate(frame.columns):
        series = frame.iloc[:, place]
        values = series.astype(object).where(series.notna(), None).tolist()
        columns.append(_column(str(label), values, decimals.get(label)))
    return tuple(columns)


def _column(label: str, values: Sequence[object], decimals: int | None) -> Column:
    name, unit = split_label(label)
    shown = "" if unit == "1" else unit
    present = [value for value in values if value is not None]
    numbers = [value for value in present if _is_number(value)]
    if not numbers or len(numbers) < len(present):
        return Column(name, shown, False, tuple(_word(value) for value in values))
    if decimals is None:
        decimals = _default_decimals(numbers, unit)
    cells = (_number(value, decimals) if _is_number(value) else _MISSING for value in values)
    return Column(name, shown, True, tuple(cells))


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _word(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return _MISSING if value is None else str(value)


def _default_decimals(numbers: Sequence[float], unit: str) -> int:
    if all(isinstance(number, int) for number in numbers):
        return 0
    if unit in UNIT_DECIMALS:
        return UNIT_DECIMALS[unit]
    sizes = sorted(abs(number) for number in numbers if number != 0.0)
    if not sizes:
        return 0
    return min(max(2 - math.floor(math.log10(sizes[len(sizes) // 2])), 0), 4)


def _number(value: float, decimals: int) -> str:
    text = f"{abs(value):.{decimals}f}"
    sign = "−" if value < 0 and float(text) != 0.0 else ""
    if abs(value) >= _GROUPED_FROM:
        text = f"{abs(value):,.{decimals}f}".replace(",", "\u202f")
    return sign + text


DIGITS = 4


def in_words(table: pd.DataFrame) -> pd.DataFrame:
    """Write numbers of different units in one column with equally many digits."""
    words = table.copy()
    for name in table.columns:
        if table[name].dtype.kind == "f" and not str(name).endswith("]"):
            digits = 2 if "deviation" in str(name) else DIGITS
            words[name] = [_digits(float(value), digits) for value in table[name]]
    return words


def _digits(value: float, digits: int) -> str:
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{min(decimals, 6)}f}".replace("-", "−")
