"""Tables of text cells from CSV and Excel files, their columns and units checked.

A length or an angle carries its unit in the header of its column: ``x [mm]``, ``rz [deg]``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import pandas as pd

from deboom.errors import InputError
from deboom.files.faults import Note, noting, refuse
from deboom.files.units import Unit, parse_unit

_WITH_UNIT = re.compile(r"(?P<name>[^\[\]]+?)\s*\[(?P<unit>[^\[\]]*)\]")
_EXAMPLES = {"m": "[mm]' or [m]", "rad": "[deg]' or [rad]"}
_ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0}


@dataclass(frozen=True)
class Row:
    """One row of a table.

    Parameters
    ----------
    path : Path
        Of the table.
    line : int
        In the file; the header is line 1.
    cells : mapping of str to str
        Column name, without its unit, to text.
    units : mapping of str to Unit
        Of the columns that have one.
    """

    path: Path
    line: int
    cells: Mapping[str, str]
    units: Mapping[str, Unit]

    def error(self, sentence: str) -> InputError:
        """Return an error that names file and line."""
        return InputError(f"{self.path} line {self.line}: {sentence}")

    def filled(self, column: str) -> str:
        """Return the text of a cell that must not be empty.

        Raises
        ------
        InputError
            It is empty.
        """
        if not self.cells[column]:
            raise self.error(f"column '{column}' is empty: fill it in")
        return self.cells[column]

    def number(self, column: str) -> float:
        """Return a finite number, in SI where its column has a unit.

        Raises
        ------
        InputError
            It is no number, or not finite.
        """
        text = self.cells[column]
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            remedy = " (decimal point, no thousands separator)" if text else ": fill it in"
            raise InputError(
                f"{self.path} line {self.line}, column '{column}': '{text}' is no finite number"
                f"{remedy}"
            )
        return number * (self.units[column].factor if column in self.units else 1.0)

    def node(self) -> int:
        """Return the number of the column ``node``.

        Raises
        ------
        InputError
            It is no whole number from 1.
        """
        node = self.number("node")
        if node != int(node) or node < 1:
            raise self.error(f"node '{self.cells['node']}' is no whole number from 1")
        return int(node)


def refuse_second(seen: dict[str, int], key: str, row: Row) -> None:
    """Refuse what stands in an earlier line already; otherwise note its line in `seen`.

    Raises
    ------
    InputError
        It does.
    """
    if key in seen:
        raise row.error(f"{key} already stands in line {seen[key]}: correct one of them")
    seen[key] = row.line


def read_rows(
    path: Path,
    plain: Sequence[str],
    with_unit: Mapping[str, str],
    sheet: str | None = None,
    note: Note = refuse,
) -> tuple[Row, ...]:
    """Read a table from a CSV file or from one sheet of an Excel file.

    Parameters
    ----------
    path : Path
        ``.csv`` or ``.xlsx``.
    plain : sequence of str
        Columns without a unit; all must be there, in any order.
    with_unit : mapping of str to str
        Columns with a unit in their header, and the SI unit of it.
    sheet : str, optional
        Of an Excel file; by default its first one. A CSV file has only one.
    note : callable
        Gets every fault of the header; by default the first one is raised.

    Returns
    -------
    tuple of Row
        Rows that are not empty; none if the header is at fault.

    Raises
    ------
    InputError
        The file is missing or no table, or has no such sheet; a column is missing, unknown or
        doubled, or one that needs a unit has none or another quantity's; no row.
    """
    cells = _cells(path, sheet)
    if sheet is not None and _is_excel(path):
        path = path.with_name(f"{path.name}, sheet '{sheet}',")
    header = [text.strip() for text in cells.iloc[0]]
    names: list[str] = []
    units: dict[str, Unit] = {}
    faults: list[InputError] = []
    for text in header:
        name, label = name_and_unit(text)
        names.append(name)
        if name in with_unit:
            if label is None:
                example = _EXAMPLES.get(with_unit[name], f"[{with_unit[name]}]'")
                sentence = f"{path}: column '{text}' has no unit: write '{text} {example}"
                faults.append(InputError(sentence))
                continue
            with noting(faults.append):
                units[name] = _column_unit(path, text, label, with_unit[name])
    wanted = [*plain, *with_unit]
    separated = "" if _is_excel(path) else ", separated by commas"
    for name in dict.fromkeys((*wanted, *names)):
        if names.count(name) != 1 or name not in wanted:
            state = "is missing" if name not in names else "is unknown or doubled"
            sentence = f"column '{name}' {state}; the columns are {', '.join(wanted)}{separated}"
            faults.append(InputError(f"{path}: {sentence}"))
    for fault in faults:
        note(fault)
    if faults:
        return ()
    rows = []
    for line, row in enumerate(cells.iloc[1:].itertuples(index=False), 2):
        texts = [str(text).strip() for text in row]
        if any(texts):
            rows.append(Row(path, line, dict(zip(names, texts, strict=True)), units))
    if not rows:
        note(InputError(f"{path} has a header and no rows: add one row per item"))
    return tuple(rows)


def read_columns(path: Path) -> dict[str, tuple[str, ...]]:
    """Read a table whose columns are not known beforehand, from CSV or the first sheet of Excel.

    Returns
    -------
    dict of str to tuple of str
        Header, as it stands, to the texts below it; empty rows at the end are left out.

    Raises
    ------
    InputError
        The file is missing or no table, a header comes twice, or there is no row.
    """
    cells = _cells(path, None).map(lambda text: str(text).strip())
    filled = cells.index[(cells != "").any(axis=1)]
    if len(filled) < 2:
        raise InputError(f"{path} has a header and no rows: add one row per item")
    header = list(cells.iloc[0])
    doubled = next((text for text in header if text and header.count(text) > 1), None)
    if doubled is not None:
        raise InputError(f"{path}: column '{doubled}' comes twice: keep one")
    below = cells.iloc[1 : filled[-1] + 1]
    return {text: tuple(below.iloc[:, i]) for i, text in enumerate(header) if text}


def name_and_unit(header: str) -> tuple[str, str | None]:
    """Split ``x [mm]`` into ``x`` and ``mm``; None where there are no brackets."""
    match = _WITH_UNIT.fullmatch(header)
    return (match["name"], match["unit"]) if match else (header, None)


def _is_excel(path: Path) -> bool:
    return path.suffix.lower() == ".xlsx"


def _cells(path: Path, sheet: str | None) -> pd.DataFrame:
    try:
        if _is_excel(path):
            sheets = pd.read_excel(
                path, sheet_name=None, header=None, dtype=str, keep_default_na=False
            )
            if sheet is None:
                sheet = next(iter(sheets))
            table = sheets.get(sheet)
        else:
            # without a header, so that pandas neither renames doubled columns nor makes an index
            table = pd.read_csv(
                path,
                header=None,
                dtype=str,
                keep_default_na=False,
                skip_blank_lines=False,
                encoding="utf-8-sig",
            )
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check the path") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is not UTF-8 text: save it as UTF-8") from None
    except pd.errors.EmptyDataError:
        raise InputError(f"{path} is empty: export it again") from None
    except (pd.errors.ParserError, BadZipFile, ValueError) as error:
        kind = "Excel file" if _is_excel(path) else "comma-separated table"
        raise InputError(f"{path} is no {kind}: {str(error).strip()}") from None
    if table is None:
        known = ", ".join(map(str, sheets))
        raise InputError(f"{path} has no sheet '{sheet}', only {known}: add or rename it")
    if table.empty:
        raise InputError(f"{path} is empty: export it again")
    return table.fillna("")


def _column_unit(path: Path, column: str, label: str, si: str) -> Unit:
    if si == "rad":
        if label not in _ANGLES:
            raise InputError(f"{path}: column '{column}': an angle is in deg or rad")
        return Unit(label, "rad", _ANGLES[label])
    try:
        unit = parse_unit(label)
    except InputError as error:
        raise InputError(f"{path}: column '{column}': {error}") from None
    if unit.si != si:
        raise InputError(f"{path}: column '{column}' is not in {si} or a multiple of it")
    return unit
