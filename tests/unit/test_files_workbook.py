"""Tables as an xlsx file."""

import io

import numpy as np
import openpyxl
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.files.tables import workbook_bytes


def test_a_workbook_reads_back_with_units_and_empty_cells():
    table = pd.DataFrame({"direction": ["A x", "=1+1"], "today [N/mm]": [np.float64(2.5), np.nan]})

    book = openpyxl.load_workbook(io.BytesIO(workbook_bytes({"one": table}, "A title")))

    rows = list(book["one"].iter_rows(values_only=True))
    assert rows == [("direction", "today [N/mm]"), ("A x", 2.5), ("=1+1", None)]
    assert book["one"]["A3"].data_type == "s"
    assert (book.properties.title, book.properties.creator) == ("A title", "deboom")
    assert book["one"].freeze_panes == "A2"


@pytest.mark.parametrize("sheets", [{}, {"a/b": 1}, {"n" * 32: 1}, {" ": 1}])
def test_sheets_that_cannot_be_are_refused(sheets):
    with pytest.raises(InputError, match="sheet"):
        workbook_bytes({name: pd.DataFrame({"a": [1]}) for name in sheets}, "title")
