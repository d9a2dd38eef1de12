"""Tables as the sheets of one xlsx file."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from openpyxl import Workbook
from openpyxl.cell import WriteOnlyCell
from openpyxl.styles import Alignment, Font
from openpyxl.utils import get_column_letter

from deboom.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

SHEET_NAME = 31
"""Characters that a sheet's name may have."""
_WIDEST = 60


def workbook_bytes(sheets: Mapping[str, pd.DataFrame], title: str) -> bytes:
    """Write tables as an xlsx file for people: headers stay in view, columns are wide enough.

    Parameters
    ----------
    sheets : mapping of str to DataFrame
        Name of the sheet → table with columns ``name [unit]``; the index is not written.
    title : str
        In the properties of the file. No user name gets there.

    Returns
    -------
    bytes
        Missing values are empty cells, text that looks like a formula is text.

    Raises
    ------
    InputError
        No sheet, or a name that a sheet cannot have.
    """
    if not sheets:
        raise InputError("a workbook needs at least one sheet")
    workbook = Workbook(write_only=True)
    workbook.properties.creator = "deboom"
    workbook.properties.title = title
    for name, table in sheets.items():
        if len(name) > SHEET_NAME or not name.strip() or re.search(r"[\[\]:*?/\\]", name):
            raise InputError(f"'{name}' cannot be the name of a sheet")
        sheet = workbook.create_sheet(name)
        sheet.freeze_panes = "A2"
        plain = table.astype(object).where(table.notna(), None)
        rows = list(plain.itertuples(index=False, name=None))
        for place, label in enumerate(table.columns):
            texts = [str(label), *(str(row[place]) for row in rows if isinstance(row[place], str))]
            width = min(max(map(len, texts)) + 2, _WIDEST)
            sheet.column_dimensions[get_column_letter(place + 1)].width = width
        sheet.append([_header(sheet, str(label)) for label in table.columns])
        for row in rows:
            sheet.append([_cell(sheet, value) for value in row])
    buffer = io.BytesIO()
    workbook.save(buffer)
    return buffer.getvalue()


def _header(sheet: Any, label: str) -> Any:
    cell = _cell(sheet, label)
    if isinstance(cell, str):
        cell = WriteOnlyCell(sheet, cell)
    cell.font = Font(bold=True)
    cell.alignment = Alignment(wrap_text=True, vertical="top")
    return cell


def _cell(sheet: Any, value: Any) -> Any:
    if isinstance(value, str) and value.startswith("="):
        cell = WriteOnlyCell(sheet, value)
        cell.data_type = "s"
        return cell
    return value.item() if isinstance(value, np.generic) else value
