"""Count what is in the parts of a workbook before a library makes objects of it.

openpyxl keeps every element of a part that it reads, and tells the size of a sheet last. Here the
XML is only counted while it streams by: no part is held as a whole.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.parsers import expat
from zipfile import ZipFile

from deboom.errors import InputError

MOST_SHEET_ROWS, MOST_SHEET_COLUMNS = 2**20, 2**14
"""Rows and columns that a sheet of Excel has."""
MOST_ELEMENTS = 10_000_000
"""Elements of all parts together: rows, cells, values and others."""
MOST_TEXTS = 1_000_000
"""Different texts of a workbook."""
MOST_OTHERS = 200_000
"""Elements of all parts that are neither rows, cells nor their content, such as formats."""
LONGEST_ELEMENT = 2**20
"""Bytes from the start of an element to that of the next; a cell of Excel has 32 767 letters."""
_CHUNK = 2**16
_CONTENT = frozenset({"row", "c", "v", "f", "is", "t", "si"})


class _Count:
    """Elements of a workbook so far."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.elements = self.texts = self.others = 0

    def part(self, name: str, file: Any) -> None:
        """Count the elements of one part; a part that is no XML has none."""
        parser = expat.ParserCreate()
        rows = cells = last = 0

        def start(tag: str, _: Any) -> None:
            nonlocal rows, cells, last
            tag = tag.rpartition(":")[2]
            self.elements += 1
            if tag == "c":
                cells += 1
            elif tag == "row":
                rows, cells = rows + 1, 0
            elif tag == "si":
                self.texts += 1
            elif tag not in _CONTENT:
                self.others += 1
            here = parser.CurrentByteIndex
            wide, last = here - last, here
            if (
                self.elements > MOST_ELEMENTS
                or self.texts > MOST_TEXTS
                or self.others > MOST_OTHERS
                or rows > MOST_SHEET_ROWS
                or cells > MOST_SHEET_COLUMNS
                or wide > LONGEST_ELEMENT
            ):
                raise self.error(name, f"row {rows} with {cells} cells" if rows else "its elements")

        def doctype(*_: Any) -> None:
            raise self.error(name, "a document type, which no workbook has")

        parser.StartElementHandler = start
        parser.StartDoctypeDeclHandler = doctype
        fed = 0
        try:
            while chunk := file.read(_CHUNK):
                parser.Parse(chunk)
                fed += len(chunk)
                if fed - last > LONGEST_ELEMENT + _CHUNK:
                    raise self.error(name, "a text without an end")
        except expat.ExpatError:
            return  # a picture, or damaged: the library that reads it says so

    def error(self, name: str, what: str) -> InputError:
        """Return an error that names the part."""
        return InputError(
            f"{self.path}: {name} goes on and on ({what}): delete empty rows, stray cells and "
            "formats far from the table, or save the table alone as a new workbook"
        )


def refuse_large_parts(path: Path, parts: ZipFile) -> None:
    """Refuse a workbook whose parts would take more memory or time than is given to a file.

    - raises InputError: more rows or columns than Excel has, too many elements or texts, a text
      without an end, or a document type, which could define what it likes.
    """
    count = _Count(path)
    for part in parts.infolist():
        with parts.open(part) as file:
            count.part(part.filename, file)
