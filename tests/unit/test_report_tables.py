"""Tables as a reader wants them: units apart, sensible digits, words for what is missing."""

import numpy as np
import pandas as pd
import pytest

from deboom.errors import InputError
from deboom.report.tables import split_label, text_columns


def cells(label, values, **decimals):
    return text_columns(pd.DataFrame({label: values}), decimals)[0].cells


@pytest.mark.parametrize(
    ("label", "parts"),
    [
        ("stiffness [N/mm]", ("stiffness", "N/mm")),
        ("SPL [dB(A)]", ("SPL", "dB(A)")),
        ("vehicle", ("vehicle", "")),
        ("K[N/mm]", ("K", "N/mm")),
        ("range [20, 60]  [Hz]", ("range [20, 60]", "Hz")),
    ],
)
def test_label_is_split_into_name_and_unit(label, parts):
    assert split_label(label) == parts


def test_unit_gives_the_decimals():
    assert cells("f [Hz]", [24.0, 30.25]) == ("24.00", "30.25")
    assert cells("n [rpm]", [960.4, 1210.0]) == ("960", "1210")
    assert cells("L [dB(A)]", [73.449]) == ("73.4",)


def test_other_units_show_three_digits_of_the_median():
    assert cells("k [N/mm]", [14.6, 326.4, 2148.3]) == ("15", "326", "2148")
    assert cells("d [m]", [0.0123, 0.0456]) == ("0.0123", "0.0456")
    assert cells("d [m]", [0.0, 0.0]) == ("0", "0")


def test_decimals_can_be_asked_for():
    frame = pd.DataFrame({"k [N/mm]": [14.6]})
    assert text_columns(frame, {"k [N/mm]": 2})[0].cells == ("14.60",)


def test_decimals_for_an_unknown_column_are_refused():
    with pytest.raises(InputError, match="unknown columns \\['k'\\]"):
        text_columns(pd.DataFrame({"k [N/mm]": [1.0]}), {"k": 2})


def test_minus_sign_zero_and_thousands():
    assert cells("L [dB]", [-2.849, -0.001, 43216.5]) == ("−2.85", "0.00", "43\u202f216.50")
    assert cells("n", [12, 12000]) == ("12", "12\u202f000")


def test_plain_numbers_have_three_decimals_and_no_unit():
    column = text_columns(pd.DataFrame({"factor [1]": [0.8, 1.197]}), {})[0]
    assert (column.name, column.unit, column.cells) == ("factor", "", ("0.800", "1.197"))


def test_missing_values_are_dashes_and_keep_the_column_numeric():
    frame = pd.DataFrame({"k [N/mm]": [310.0, np.nan], "remark": ["soft", None], "n": [1, pd.NA]})
    columns = text_columns(frame, {})
    assert [column.cells[1] for column in columns] == ["–", "–", "–"]
    assert [column.numeric for column in columns] == [True, False, True]


def test_words_and_flags_stay_words():
    columns = text_columns(pd.DataFrame({"a": [True, False], "b": ["x", 3.0]}), {})
    assert columns[0].cells == ("yes", "no")
    assert not columns[0].numeric
    assert columns[1].cells == ("x", "3.0")


def test_columns_of_the_same_name_stay_apart():
    frame = pd.DataFrame([[1.0, 2.0]], columns=["k [m]", "k [m]"])
    assert [column.cells for column in text_columns(frame, {})] == [("1.00",), ("2.00",)]
