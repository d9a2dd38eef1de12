"""Names that an anonymous report shows, and those it refuses."""

import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.files.tables import workbook_bytes
from deboom.supplier.sources import page_text, refuse_leaks, workbook_text


@pytest.mark.parametrize(
    "text", ["level in X7-1", "x7 at 30 Hz", "file x7_f1.csv", "<td>X7</td>", "a/b/X7/c"]
)
def test_a_name_is_found_in_any_case_and_beside_any_sign(text):
    with pytest.raises(InputError, match=r"would show '(?i:x7)' in its page"):
        refuse_leaks(["X7", "X7-1"], {"page": text})


@pytest.mark.parametrize("text", ["MaX72", "0x7f", "X 7", ""])
def test_a_name_within_another_word_is_none(text):
    refuse_leaks(["X7"], {"page": text})


def test_a_page_is_read_without_markup_styles_and_bytes_of_pictures():
    html = (
        "<style>p { font-family: X1; }</style>"
        '<img src="data:image/png;base64,AX7+/X7=" alt="in&#32;X8"><b>X</b>9'
    )

    text = page_text(html)

    assert "X7" not in text
    assert "X1" not in text
    assert "in X8" in text
    assert "X 9" in text
    assert "X9" in text


def test_a_workbook_is_read_with_sheets_cells_and_properties():
    data = workbook_bytes({"sheet S1": pd.DataFrame({"head H1": ["cell C&1"]})}, "title T1")

    text = workbook_text(data)

    refuse_leaks(["A1", "A2", "family"], {"workbook": text})  # neither places nor fonts are names
    assert all(word in text for word in ("sheet S1", "head H1", "cell C&1", "title T1"))
