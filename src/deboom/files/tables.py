"""Tables of CSV and Excel files: a dataclass states the columns, one reader serves them all."""

from __future__ import annotations

import csv
import gzip
import io
import math
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, TypeVar, get_type_hints
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
import pandas as pd
from openpyxl import Workbook, load_workbook
from openpyxl.cell import WriteOnlyCell
from openpyxl.styles import Alignment, Font
from openpyxl.utils import get_column_letter
from openpyxl.worksheet.properties import PageSetupProperties

from deboom.arrays import RealArray
from deboom.errors import InputError, naming
from deboom.files.disk import (
    MEBIBYTE,
    opened_zip,
    read_bytes,
    read_text,
    replace_bytes,
    replace_text,
    text_of,
)
from deboom.files.schema import Note, doubled, noting, refuse_all, telling
from deboom.files.units import Unit, is_label, is_unscaled, parse_unit, refuse_beyond
from deboom.files.workbook_parts import refuse_large_parts
from deboom.tabled import PACKED, csv_text, table_of, unescaped

MOST_ROWS, MOST_COLUMNS, MOST_CELLS = 200_000, 2_000, 4_000_000
"""Size of a table above which it is taken for a mistake."""
LARGEST_PACKED_TEXT = 256 * MEBIBYTE
"""Text of a compressed table that is read [bytes]."""
LARGEST_WORKBOOK = 512 * MEBIBYTE
"""Size of all parts of a workbook, unpacked [bytes]."""
_OLE2 = b"\xd0\xcf\x11\xe0"
_EXCEL_ERRORS = ("#DIV/0!", "#N/A", "#NAME?", "#NULL!", "#NUM!", "#REF!", "#VALUE!")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"^(\s*[+-]?\d+),(\d+(?:[eE][+-]?\d+)?\s*)$", re.ASCII)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""What may be a decimal comma as well as a separator of thousands."""
_REMARK_COLUMNS = {
    "remark",
    "remarks",
    "note",
    "notes",
    "comment",
    "comments",
    "description",
    "serial",
    "serial number",
    "serial no",
    "serial no.",
    "s/n",
    "sn",
    "no",
    "no.",
    "#",
    "date",
    "operator",
    "maker",
    "manufacturer",
    "calibrated",
    "calibration date",
    "bemerkung",
    "bemerkungen",
    "anmerkung",
    "seriennummer",
    "nr",
    "nr.",
    "datum",
}
"""Columns that may stand beside those of a table, in small letters."""
_REMARK = re.compile(r"(notes?|remarks?|comments?|bemerkung|anmerkung|hinweis)\s*:", re.IGNORECASE)
_LINES_ABOVE = 20
"""Lines in which the header is looked for: titles may stand above it."""
_IN_BRACKETS = re.compile(r"^[\[(](.*)[\])]$")
_WITH_UNIT = re.compile(r"(?P<name>[^\[\]]+?)\s*\[(?P<unit>[^\[\]]*)\]")
_NOT_A_NUMBER = "decimal point, no thousands separator"
_EXAMPLES = {"m": "[mm]' or [m]", "rad": "[deg]' or [rad]", "N/m": "[N/mm]' or [N/m]"}


@dataclass(frozen=True)
class Row:
    """One row of a table.

    - `path`: of the table.
    - `line`: in the file; the header is line 1.
    - `cells`: column name, without its unit, to text.
    - `units`: of the columns that have one.
    - `decimal_comma`: a number may be text with a decimal comma.
    """

    path: Path
    line: int
    cells: Mapping[str, str]
    units: Mapping[str, Unit]
    decimal_comma: bool = False

    def error(self, sentence: str) -> InputError:
        """Return an error that names file and line."""
        return InputError(f"{self.path} line {self.line}: {sentence}")

    def filled(self, column: str) -> str:
        """Return the text of a cell that must not be empty.

        - raises InputError: it is empty.
        """
        if not self.cells[column]:
            raise self.error(f"column '{column}' is empty: fill it in")
        return self.cells[column]

    def number(self, column: str) -> float:
        """Return a finite number, in SI where its column has a unit.

        - raises InputError: it is no number, or not finite.
        """
        text = self.cells[column]
        number = number_in(_with_point(text) if self.decimal_comma else text)
        if not math.isfinite(number):
            remedy = f" ({_NOT_A_NUMBER})" if text else ": fill it in"
            if _THOUSANDS.fullmatch(text):
                remedy = f": write {text.replace(',', '.')} or {text.replace(',', '')}"
            raise InputError(
                f"{self.path} line {self.line}, column '{column}': '{text}' is no finite number"
                f"{remedy}"
            )
        return number * (self.units[column].factor if column in self.units else 1.0)

    def node(self, column: str = "node") -> int:
        """Return the number of a UFF node.

        - raises InputError: it is no whole number from 1.
        """
        node = number_in(self.cells[column])
        if not (math.isfinite(node) and node.is_integer() and node >= 1):
            raise self.error(f"{column} '{self.cells[column]}' is no whole number from 1")
        return int(node)


def refuse_second(
    seen: dict[str, int], key: str, row: Row, remedy: str = "correct one of them"
) -> None:
    """Refuse what stands in an earlier line already; otherwise note its line in `seen`.

    - raises InputError: it does.
    """
    if key in seen:
        raise row.error(f"{key} already stands in line {seen[key]}: {remedy}")
    seen[key] = row.line


def read_rows(
    path: Path | pd.DataFrame,
    plain: Sequence[str],
    with_unit: Mapping[str, str],
    sheet: str | None = None,
    optional: Sequence[Sequence[str]] = (),
) -> tuple[Row, ...]:
    """Read a table from a CSV file, from one sheet of an Excel file, or from memory.

    - `path`: ``.csv`` or ``.xlsx``, or the table itself.
    - `plain`: columns without a unit; all must be there, in any order.
    - `with_unit`: columns with a unit in their header, and the SI unit of it.
    - `sheet`: of an Excel file; by default its first one. A CSV file has only one.
    - `optional`: groups of those columns that a table may lack as a whole.
    - returns: rows that are not empty.
    - raises InputError: the file is missing or no table, or has no such sheet; a column is missing,
      unknown or doubled, or one that needs a unit has none or another quantity's; no row.
    """
    with telling() as tell:
        rows = _rows(path, plain, with_unit, sheet, optional, tell)
    return rows


def _rows(
    path: Path | pd.DataFrame,
    plain: Sequence[str],
    with_unit: Mapping[str, str],
    sheet: str | None,
    optional: Sequence[Sequence[str]],
    tell: Note,
) -> tuple[Row, ...]:
    """Rows that are not empty, without those that are told to be no row."""
    if isinstance(path, pd.DataFrame):
        table = Columns.of(path)
        header, comma = list(table.texts), False
        below = dict(enumerate(map(list, zip(*table.texts.values(), strict=True)), 1))
        path = Path("DataFrame")
    else:
        header, below, comma = _cells(path, sheet, [*plain, *with_unit])
    excel = _is_excel(path)
    if sheet is not None and excel:
        path = path.with_name(f"{path.name}, sheet '{sheet}'")
    names: list[str] = []
    units: dict[str, Unit] = {}
    faults: list[InputError] = []
    for text in header:
        name, label = name_and_unit(text)
        names.append(name)
        if name in with_unit:
            with noting(faults.append):
                units[name] = _column_unit(f"{path}: column '{text}'", text, label, with_unit[name])
    absent = {name for group in optional if not set(group) & set(names) for name in group}
    wanted = [name for name in (*plain, *with_unit) if name not in absent]
    separated = "" if excel else ", separated by commas"
    for name in dict.fromkeys((*wanted, *names)):
        if not name:
            rows_below = below.values()
            if any(row[k] for k, each in enumerate(names) if not each for row in rows_below):
                k = names.index("")
                faults.append(
                    InputError(f"{path}: column {k + 1} has entries and no name: name it")
                )
        elif names.count(name) != 1 if name in wanted else not _remarks(name):
            state = "is missing" if name not in names else "is unknown or doubled"
            remedy = "" if name in wanted else "; begin the name of a remark with #"
            columns = f"the columns are {', '.join(wanted)}{separated}"
            sentence = f"column '{name}' {state}; {columns}{remedy}"
            faults.append(InputError(f"{path}: {sentence}"))
    refuse_all(map(str, faults))
    rows = []
    for line, texts in below.items():
        filled = [text for text in texts if text]
        if not filled or _is_remark(texts):
            continue
        if len(filled) == 1 < len(wanted) - 1 and _is_sentence(filled[0]):
            sentence = f"'{filled[0]}' stands alone: fill in the row, or begin a remark with '# '"
            tell(InputError(f"{path} line {line}: {sentence}"))
            continue
        rows.append(Row(path, line, dict(zip(names, texts, strict=True)), units, comma))
    if not rows:
        tell(InputError(f"{path} has a header and no rows: add one row per item"))
    return tuple(rows)


@dataclass(frozen=True)
class Columns:
    """Columns of a table that are not known beforehand.

    - `texts`: header, as it stands, to the texts below it.
    - `lines`: of these texts in the file.
    """

    texts: Mapping[str, Sequence[str]]
    lines: Sequence[int]

    @classmethod
    def of(cls, table: pd.DataFrame) -> Columns:
        """Return the columns of a table in memory; its rows count from 1."""
        texts = {
            str(header): tuple("" if pd.isna(entry) else str(entry) for entry in table[header])
            for header in table
        }
        return cls(texts, range(1, len(table) + 1))

    def numbers(self, *headers: str, with_holes: bool = False) -> RealArray:
        """Return columns as numbers, one row per header.

        - `with_holes`: cells that are empty or ``NaN`` become nan.
        - raises InputError: one is no finite number; names line and column.
        """
        numbers = np.array([[number_in(text) for text in self.texts[each]] for each in headers])
        holes = ("", "nan") if with_holes else ()
        texts = ((n, k, self.texts[headers[n]][k]) for n, k in np.argwhere(~np.isfinite(numbers)))
        refuse_all(
            f"line {self.lines[k]}, column '{headers[n]}': '{text}' is no finite number "
            f"({_NOT_A_NUMBER})"
            for n, k, text in texts
            if text.lower() not in holes
        )
        return numbers

    def by_name(self, path: Path) -> dict[str, str]:
        """Return the headers by their names without units.

        - `path`: of the table, for the error.
        - raises InputError: two headers differ in their units only.
        """
        pairs = [(name_and_unit(header)[0], header) for header in self.texts]
        names = [name for name, _ in pairs]
        refuse_all(f"{path}: {words}" for words in doubled("columns are named", names))
        return dict(pairs)


def read_columns(path: Path, first: str, sheet: str | None = None) -> Columns:
    """Read a table whose columns are not known beforehand, from CSV or Excel.

    - `first`: name of a column that it has, by which its header is known below a title.
    - `sheet`: of an Excel file; by default its first one.
    - returns: the columns; rows of remarks, and empty rows at the end, are left out.
    - raises InputError: the file is missing or no table, a header comes twice, or there is no row.
    """
    header, below, comma = _cells(path, sheet, (first,))
    if sheet is not None and _is_excel(path):
        path = path.with_name(f"{path.name}, sheet '{sheet}'")
    rows = {line: row for line, row in below.items() if not _is_remark(row)}
    filled = [line for line, row in rows.items() if any(row)]
    if not filled:
        raise InputError(f"{path} has a header and no rows: add one row per item")
    doubled = next((text for text in header if text and header.count(text) > 1), None)
    if doubled is not None:
        raise InputError(f"{path}: column '{doubled}' comes twice: keep one")
    lines = [line for line in rows if line <= filled[-1]]
    if comma:
        rows = {line: [_with_point(text) for text in row] for line, row in rows.items()}
    columns = zip(*(rows[line] for line in lines), strict=True)
    texts = {text: column for text, column in zip(header, columns, strict=True) if text}
    return Columns(texts, lines)


def _is_remark(texts: Sequence[str]) -> bool:
    """Tell whether a row is a remark: ``# ...``, or ``Remark: ...`` with nothing beside it."""
    first, *others = [text for text in texts if text] or [""]
    if first.startswith("# "):  # an item may be named so: then numbers stand beside it
        return not any(map(_NUMBER.fullmatch, others))
    return not others and bool(_REMARK.match(first))


def _is_sentence(text: str) -> bool:
    """Tell a remark without its mark from the name of an item whose row is to be filled in."""
    return ":" in text or len(text.split()) > 3


def _remarks(column: str) -> bool:
    return column.startswith("#") or column.lower() in _REMARK_COLUMNS


def _has_decimal_commas(rows: Iterable[Sequence[str]]) -> bool:
    """Tell whether a text of a table can only be a number with a decimal comma."""
    return any(
        _DECIMAL_COMMA.match(text) and not _THOUSANDS.fullmatch(text)
        for row in rows
        for text in row
        if "," in text
    )


def _with_point(text: str) -> str:
    return _DECIMAL_COMMA.sub(r"\1.\2", text)


def name_and_unit(header: str) -> tuple[str, str | None]:
    """Split ``x [mm]`` into ``x`` and ``mm``; None where there are no brackets."""
    match = _WITH_UNIT.fullmatch(header)
    return (match["name"], match["unit"]) if match else (header, None)


def _is_excel(path: Path) -> bool:
    return path.suffix.lower() == ".xlsx"


def number_in(text: str) -> float:
    """Return the number that a cell holds in plain ASCII digits; nan where it is none."""
    return float(text) if _NUMBER.fullmatch(text) else math.nan


def _cells(
    path: Path, sheet: str | None, names: Sequence[str]
) -> tuple[list[str], dict[int, list[str]], bool]:
    """Return the header with these names, the lines below it, and whether they have decimal commas.

    All are texts of one length. A row of units below the header becomes part of it.
    """
    excel = _is_excel(path)
    rows, comma = (_excel_cells(path, sheet), False) if excel else _text_cells(path, names)
    width = max(map(len, rows), default=0)
    if len(rows) > MOST_ROWS or width > MOST_COLUMNS or len(rows) * width > MOST_CELLS:
        raise _too_large(path, len(rows), width)
    if not width:
        raise InputError(f"{path} is empty: export it again")
    rows = [[text.strip() for text in row] + [""] * (width - len(row)) for row in rows]
    place = _header_place(rows, names)[0]
    header, below = rows[place], dict(enumerate(rows[place + 1 :], place + 2))
    if place + 1 < len(rows) and _are_units(rows[place + 1]):
        header = _with_units(path, header, below.pop(place + 2))
    return header, below, comma or _has_decimal_commas(below.values())


def _are_units(texts: Sequence[str]) -> bool:
    """Tell whether a row has labels of units, such as ``s`` or ``[m/s^2]``, and nothing else."""
    labels = [_IN_BRACKETS.sub(r"\1", text) for text in texts if text]
    return bool(labels) and not _NUMBER.fullmatch(labels[0]) and all(map(is_label, labels))


def _with_units(path: Path, header: Sequence[str], labels: Sequence[str]) -> list[str]:
    """Return a header whose columns have the units of the row below it.

    - raises InputError: a column has two units.
    """
    texts = []
    for text, label in zip(header, labels, strict=True):
        unit, stated = _IN_BRACKETS.sub(r"\1", label), name_and_unit(text)[1]
        if stated and unit and stated != unit:
            with naming(f"{path}: column '{text}'"):
                above, below = parse_unit(stated), parse_unit(unit)
                if (above.si, above.factor) != (below.si, below.factor):
                    raise InputError(f"the row below it says '{unit}': state one unit")
        texts.append(text if stated or not unit else f"{text} [{unit}]")
    return texts


def _header_place(rows: Sequence[Sequence[str]], names: Sequence[str]) -> tuple[int, int]:
    """Return the row that has most of the names, and how many; titles may stand above it."""
    counts = [
        len({name_and_unit(text.strip())[0] for text in row} & set(names))
        for row in rows[:_LINES_ABOVE]
    ]
    most = max(counts, default=0)
    return (counts.index(most) if most else 0), most


def _too_large(path: Path, row: int, width: int) -> InputError:
    return InputError(
        f"{path}: row {row} has {width} cells, at most {MOST_ROWS} rows, {MOST_COLUMNS} columns "
        f"and {MOST_CELLS} cells are read: delete stray cells far from the table, or split it"
    )


def _text_cells(path: Path, names: Sequence[str]) -> tuple[list[list[str]], bool]:
    """Return cells of a text between commas, tabs or semicolons.

    With semicolons its numbers have decimal commas, else where one can be nothing else.
    """
    text = text_of(path)
    rows: list[list[str]] = []
    try:
        separator, place = _text_format(text, names)
        lines = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
        width = 0
        for line, cells in enumerate(lines, 1):
            width = len(cells) if line <= place + 1 else width
            if len(cells) > width and _is_remark([cell.strip() for cell in cells]):
                cells = [" ".join(cells)]
            if line > MOST_ROWS or width > MOST_COLUMNS or line * width > MOST_CELLS:
                raise _too_large(path, line, width)
            if len(cells) > width:
                remedy = "; decimal commas need semicolons or tabs between the columns"
                raise InputError(
                    f"{path} is no comma-separated table: line {line} has {len(cells)} cells and "
                    f"the header {width}{remedy if separator == ',' else ''}"
                )
            rows.append([unescaped(cell) for cell in cells])
    except csv.Error as error:
        raise InputError(f"{path} is no comma-separated table: {error}") from None
    return rows, separator == ";"


def _text_format(text: str, names: Sequence[str]) -> tuple[str, int]:
    """Return the separator that parts the names, and the row in which these stand."""
    begin = io.StringIO("\n".join(text.split("\n", _LINES_ABOVE)[:_LINES_ABOVE]), newline="")
    places, counts = {}, {}
    for separator in ",;\t":
        begin.seek(0)
        rows = list(csv.reader(begin, delimiter=separator))
        places[separator], counts[separator] = _header_place(rows, names)
    first = text.partition("\n")[0]
    separator = max(",;\t", key=counts.__getitem__)
    if counts[","] == counts[";"] >= counts["\t"] and ";" in first and "," not in first:
        separator = ";"
    return separator, places[separator]


def sheet_names(path: Path) -> list[str]:
    """Return the names of the sheets of an Excel file.

    Raises
    ------
    InputError
        The file is missing or no workbook.
    """
    with _workbook(path) as book:
        return list(book.sheetnames)


@contextmanager
def _workbook(path: Path) -> Iterator[Any]:
    """Open an Excel file; whatever fails meanwhile is one sentence."""
    data = read_bytes(path)
    if data.startswith(_OLE2):
        raise InputError(
            f"{path} is an old .xls workbook or has a password: save it as .xlsx without one"
        )
    try:
        with opened_zip(path, data, LARGEST_WORKBOOK) as parts:
            refuse_large_parts(path, parts)
        yield load_workbook(io.BytesIO(data), read_only=True, data_only=True, keep_links=False)
    except InputError:
        raise
    except Exception as error:  # openpyxl raises a dozen kinds on a damaged workbook
        raise InputError(
            f"{path} is no Excel file ({str(error).strip() or 'damaged'}): save it as .xlsx once "
            "more; if it is text, name it .csv"
        ) from None


def _excel_cells(path: Path, sheet: str | None) -> list[list[str]]:
    with _workbook(path) as book:
        names = book.sheetnames
        if sheet is not None and sheet not in names:
            raise InputError(
                f"{path} has no sheet '{sheet}', only {', '.join(names)}: add or rename it"
            )
        chosen = book[names[0] if sheet is None else sheet]
        if chosen.sheet_state != "visible":
            raise InputError(
                f"{path}: sheet '{chosen.title}', which would be read, is hidden: show it if it is "
                "the right one, or delete it"
            )
        rows = _sheet_cells(path, chosen)
    while rows and not any(rows[-1]):
        rows.pop()
    return rows


def _sheet_cells(path: Path, sheet: Any) -> list[list[str]]:
    sheet.reset_dimensions()  # what the file states of its size may be anything
    rows: list[list[str]] = []
    for number, cells in enumerate(sheet.iter_rows(values_only=True), 1):
        if number * len(cells) > MOST_CELLS or number > MOST_ROWS or len(cells) > MOST_COLUMNS:
            raise _too_large(path, number, len(cells))
        rows.append([_cell_text(value) for value in cells])
    return rows


def _cell_text(value: Any) -> str:
    if value is None or (isinstance(value, str) and value in _EXCEL_ERRORS):
        return ""
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    return str(value)


def _column_unit(what: str, column: str, label: str | None, si: str) -> Unit:
    if label is None:
        example = _EXAMPLES.get(si, f"[{si}]'")
        raise InputError(f"{what} has no unit: write '{column} {example}")
    with naming(what):
        unit = parse_unit(label, si)
    if unit.si != si:
        raise InputError(f"{what} is not in {si} or a multiple of it")
    return unit


_WRONG = object()
"""Stands for a cell that has been told to be wrong."""
_ANY_TIME = re.compile(rb"(<dcterms:(?:created|modified)[^>]*>)[^<]*")


class MayBeEmpty:
    """Mark of a text that may be empty."""


class ZeroWithoutColumns:
    """Mark beside `Numbers`: their columns may all be left out, which means zeros."""


@dataclass(frozen=True)
class Optional:
    """Mark of a text whose column may be absent, and whose cell may be empty: then `default`."""

    default: str


class UnitOfFiles:
    """Mark of a unit that a table may leave to the files, each its own: an empty cell."""


class InUnitOfRow:
    """Mark of a number in the unit of its row; empty is infinite."""


@dataclass(frozen=True)
class Numbers:
    """Columns of one number or vector; with a unit, they carry it in their header."""

    names: tuple[str, ...]
    si: str = ""
    written: str = ""

    @property
    def labels(self) -> list[str]:
        """Headers with the unit that is written."""
        unit = self.written or self.si
        return [f"{name} [{unit}]" if unit else name for name in self.names]

    def scaled(self, values: Sequence[float]) -> list[float]:
        """Return values in the unit that is written, without the digits that the scaling made."""
        if not self.written:
            return list(values)
        factor = 1.0 / parse_unit(self.written).factor
        rounded: list[float] = np.round(factor * np.array(values), 10).tolist()
        return rounded


class TableRow:
    """Row of a table: a frozen dataclass whose fields are its columns, in the order written.

    A ``str`` is a text, an ``int`` a whole number from 1, a `Unit` the label of a unit.
    """

    sheet: ClassVar[str | None] = None
    """Sheet of an Excel file; None is the first."""
    unique: ClassVar[tuple[str, ...]] = ()
    """What no other row may repeat, in words with the row's entries."""

    def _check(self) -> None:
        """Refuse what does not fit together in this row."""


_Row = TypeVar("_Row", bound=TableRow)


def read_table(path: Path, kind: type[_Row]) -> tuple[_Row, ...]:
    """Read a table of rows of one kind, in SI.

    - `path`: CSV or xlsx; its columns may stand in any order.
    - `kind`: states the columns.
    - raises InputError: the file is missing or no table; a column is missing, unknown or without
      its unit; an entry is empty or no finite number; a row does not fit together, or repeats
      another.
    """
    plain, with_unit = _headers(_columns(kind))
    with telling() as tell:
        rows = _rows(path, plain, with_unit, kind.sheet, _optional(kind), tell)
        with noting(tell):
            items = rows_of(kind, rows)
    return items


def rows_of(kind: type[_Row], rows: Sequence[Row]) -> tuple[_Row, ...]:
    """Return rows of one kind, in SI.

    - `rows`: cells under the names of the kind's columns.
    - raises InputError: an entry is empty or no finite number; a row does not fit together, or
      repeats another.
    """
    columns = _columns(kind)
    items: list[_Row] = []
    seen: dict[str, int] = {}
    with telling() as tell:
        for row in rows:
            values = {field: _value(row, field, columns[field], tell) for field in columns}
            if _WRONG in values.values():
                continue
            with noting(tell):
                item = kind(**values)
                with naming(f"{row.path} line {row.line}"):
                    item._check()
                for words in item.unique:
                    refuse_second(seen, words.format(item), row)
                items.append(item)
    return tuple(items)


def write_table(path: Path, kind: type[_Row], rows: Sequence[_Row]) -> None:
    """Write the table that `read_table` reads, as CSV or Excel by the suffix of `path`."""
    if path.suffix.lower() == ".xlsx":
        write_sheets(path, {kind: rows})
    else:
        write_frame(path, _frame(kind, rows))


def write_sheets(path: Path, tables: Mapping[type[Any], Sequence[Any]]) -> None:
    """Write one Excel file that carries no time of writing."""
    book, fixed = io.BytesIO(), io.BytesIO()
    with pd.ExcelWriter(book) as writer:
        for kind, rows in tables.items():
            _frame(kind, rows).to_excel(writer, sheet_name=kind.sheet or "Sheet1", index=False)
    with ZipFile(book) as timed, ZipFile(fixed, "w", ZIP_DEFLATED) as out:
        for name in timed.namelist():
            content = _ANY_TIME.sub(rb"\g<1>2000-01-01T00:00:00Z", timed.read(name))
            out.writestr(ZipInfo(name), content, ZIP_DEFLATED)
    replace_bytes(path, fixed.getvalue())


def _columns(kind: type[TableRow]) -> dict[str, Any]:
    """Fields of a row, each with its mark, or else its type."""
    hints = get_type_hints(kind, include_extras=True)
    return {
        field.name: getattr(hints[field.name], "__metadata__", (hints[field.name],))[0]
        for field in fields(kind)  # type: ignore[arg-type]
    }


def _optional(kind: type[TableRow]) -> list[tuple[str, ...]]:
    """Return the groups of columns that a table may lack."""
    hints = get_type_hints(kind, include_extras=True)
    marks: list[tuple[Any, ...]] = [getattr(hint, "__metadata__", ()) for hint in hints.values()]
    numbers = [mark[0].names for mark in marks if ZeroWithoutColumns in mark]
    texts = [(field,) for field, column in _columns(kind).items() if isinstance(column, Optional)]
    return numbers + texts


def _is_absent(
    field: str, column: Any, optional: Sequence[tuple[str, ...]], rows: Sequence[_Row]
) -> bool:
    """Say whether a column that a table may lack says no more than its absence."""
    if isinstance(column, Optional):
        return all(getattr(row, field) == column.default for row in rows)
    if isinstance(column, Numbers) and column.names in optional:
        return not any(any(getattr(row, field)) for row in rows)
    return False


def _headers(columns: Mapping[str, Any]) -> tuple[list[str], dict[str, str]]:
    plain: list[str] = []
    with_unit: dict[str, str] = {}
    for field, column in columns.items():
        names = column.names if isinstance(column, Numbers) else (field,)
        if isinstance(column, Numbers) and column.si:
            with_unit |= dict.fromkeys(names, column.si)
        else:
            plain += names
    return plain, with_unit


def _value(row: Row, field: str, column: Any, tell: Note) -> Any:
    """One field of a row; a fault of it is told."""
    if isinstance(column, Numbers):
        if not set(column.names) & set(row.cells):
            return (0.0,) * len(column.names)
        numbers = [math.nan] * len(column.names)
        for place, name in enumerate(column.names):
            with noting(tell):
                numbers[place] = row.number(name)
        if column.si == "m":
            with noting(tell), naming(f"{row.path} line {row.line}"):
                refuse_beyond("position", np.nan_to_num(numbers))
        return tuple(numbers) if len(numbers) > 1 else numbers[0]
    try:
        if column is int:
            return row.node(field)
        if column is UnitOfFiles and (not row.cells[field] or is_unscaled(row.cells[field])):
            return Unit(row.cells[field], "", 1.0)
        if column in (Unit, UnitOfFiles):
            return _stated(row, field)
        if column is InUnitOfRow:
            return row.number(field) * _stated(row, "unit").factor if row.cells[field] else math.inf
        if isinstance(column, Optional):
            return row.cells.get(field) or column.default
        return row.cells[field] if column is MayBeEmpty else row.filled(field)
    except InputError as error:
        tell(error)
        return _WRONG


def _stated(row: Row, column: str) -> Unit:
    try:
        return parse_unit(row.cells[column])
    except InputError as error:
        item = " ".join(filter(None, (row.cells.get("quantity"), f"'{row.cells['channel']}'")))
        raise row.error(f"{item}: {error}") from None


def _frame(kind: type[_Row], rows: Sequence[_Row]) -> pd.DataFrame:
    """Table of rows in the units that are written."""
    groups = _optional(kind)
    absent = {
        field for field, column in _columns(kind).items() if _is_absent(field, column, groups, rows)
    }
    pairs = [(field, column) for field, column in _columns(kind).items() if field not in absent]
    labels = [
        label
        for field, column in pairs
        for label in (column.labels if isinstance(column, Numbers) else [field])
    ]
    cells = [[cell for pair in pairs for cell in _written(row, *pair)] for row in rows]
    return pd.DataFrame(cells, columns=labels)


def _written(row: Any, field: str, column: Any) -> list[Any]:
    """Cells that one field of a row fills."""
    value = getattr(row, field)
    if isinstance(column, Numbers):
        return column.scaled(value if len(column.names) > 1 else (value,))
    if column in (Unit, UnitOfFiles):
        return [value.label]
    if column is InUnitOfRow:
        return ["" if math.isinf(value) else repr(value / row.unit.factor)]
    return [value]


SHEET_NAME = 31
"""Characters that a sheet's name may have."""
_WIDEST = 60


def read_frame(path: Path, texts: Sequence[str] = ()) -> pd.DataFrame:
    """Read a table that deboom wrote, such as one of a run folder, see `deboom.tabled.table_of`.

    - `path`: ``<stem>.csv``; a long table lies beside as ``<stem>.csv.gz``.
    - `texts`: columns of names, which may look like numbers; one that is not there is no fault.
    - raises InputError: the file is missing, too large or no table.
    """
    try:
        packed = path.with_name(path.name + PACKED)
        plain = path.exists() or not packed.exists()
        return table_of(read_text(path) if plain else _unpacked(packed), texts)
    except InputError:
        raise
    except (ValueError, OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path} is no table ({error}): run the study again") from None


def _unpacked(path: Path) -> str:
    """Return the text of a compressed file; InputError if it is too large."""
    with gzip.open(io.BytesIO(read_bytes(path))) as file:
        content = file.read(LARGEST_PACKED_TEXT + 1)
    if len(content) > LARGEST_PACKED_TEXT:
        raise InputError(
            f"{path} has more than {LARGEST_PACKED_TEXT / MEBIBYTE:.0f} MiB of text: read it with "
            "pandas.read_csv"
        )
    return content.decode("utf-8")


def write_frame(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV, without its index."""
    replace_text(path, csv_text(table))


def workbook_bytes(sheets: Mapping[str, pd.DataFrame], title: str) -> bytes:
    """Write tables as an xlsx file for people: headers stay in view, columns fit screen and page.

    - `sheets`: name of the sheet → table with columns ``name [unit]``; the index is not written.
    - `title`: in the properties of the file. No user name gets there.
    - returns: missing values are empty cells, text that looks like a formula is text.
    - raises InputError: a name that a sheet cannot have.
    """
    workbook = Workbook(write_only=True)
    workbook.properties.creator = "deboom"
    workbook.properties.title = title
    for name, table in sheets.items():
        if len(name) > SHEET_NAME or not name.strip() or re.search(r"[\[\]:*?/\\]", name):
            raise InputError(f"'{name}' cannot be the name of a sheet")
        sheet = workbook.create_sheet(name)
        sheet.freeze_panes = "A2"
        sheet.sheet_properties.pageSetUpPr = PageSetupProperties(fitToPage=True)
        sheet.page_setup.orientation, sheet.page_setup.fitToHeight = "landscape", 0
        plain = table.astype(object).where(table.notna(), None)
        rows = list(plain.itertuples(index=False, name=None))
        for place, label in enumerate(table.columns):
            texts = [str(label), *(str(row[place]) for row in rows if isinstance(row[place], str))]
            width = min(max(map(len, texts)) + 2, _WIDEST)
            sheet.column_dimensions[get_column_letter(place + 1)].width = width
        sheet.append([_header(sheet, str(label)) for label in table.columns])
        formats = [_number_format(name_and_unit(str(label))[1]) for label in table.columns]
        for row in rows:
            pairs = zip(row, formats, strict=True)
            sheet.append([_cell(sheet, value, number_format) for value, number_format in pairs])
    buffer = io.BytesIO()
    workbook.save(buffer)
    return buffer.getvalue()


def _header(sheet: Any, label: str) -> Any:
    cell = _cell(sheet, label)
    if isinstance(cell, str):
        cell = WriteOnlyCell(sheet, cell)
    cell.font = Font(name="Calibri", bold=True)
    cell.alignment = Alignment(wrap_text=True, vertical="top")
    return cell


def _cell(sheet: Any, value: Any, number_format: str = "") -> Any:
    if isinstance(value, str) and value.startswith("="):
        cell = WriteOnlyCell(sheet, value)
        cell.data_type = "s"
        return cell
    plain = value.item() if isinstance(value, np.generic) else value
    if number_format and (plain is None or isinstance(plain, float)):
        cell = WriteOnlyCell(sheet, plain)
        cell.number_format = number_format
        return cell
    return plain


def _number_format(unit: str | None) -> str:
    """Return how numbers of a unit are shown; they are kept whole."""
    decimals = {"N": 0, "mm": 3, "N/mm": 1, "Hz": 1, "%": 1, "dB": 2, "dB(A)": 1, "°": 1, "1": 3}
    digits = decimals.get(re.sub(r"^[\d.,]+ ", "", unit or ""))  # "0.001 dB" as dB
    return "" if digits is None else f"{0:.{digits}f}"


def row_of_each(
    path: Path, plain: Sequence[str], with_unit: Mapping[str, str], names: Sequence[str]
) -> list[Row]:
    """Return the row of each name in a table, whose first plain column names them.

    - raises InputError: as `read_rows`; a name that is unknown, comes twice or has no row.
    """
    rows: dict[str, Row] = {}
    for row in read_rows(path, plain, with_unit):
        name = row.filled(plain[0])
        if name in rows or name not in names:
            raise row.error(f"'{name}' is named twice or is none of {list(names)}")
        rows[name] = row
    missing = [name for name in names if name not in rows]
    if missing:
        raise InputError(f"{path}: there is no row for {missing}: give every {plain[0]} one")
    return [rows[name] for name in names]
