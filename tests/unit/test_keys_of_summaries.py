"""The page of keys: what the calls in the code say, and a refusal of what only a run would tell."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def keys(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    yield import_module("keys_of_summaries")
    sys.modules.pop("keys_of_summaries")


def test_every_key_of_the_code_stands_with_unit_and_meaning(keys):
    rows = keys.table().splitlines()[2:]
    expected = (
        "| `expected_change_db_<vehicle>` | dB | expected change of the mean level in the vehicle; "
        "worst: in that which gains least | `front_answer` |"
    )
    assert expected in rows
    # a bar would end a cell, and a name in angle brackets would be an element of HTML
    assert all(row.count("|") == 5 for row in rows)
    assert not any("<" in cell for row in rows for cell in row.split("`")[::2])


def test_a_key_that_only_a_run_would_tell_is_refused(keys):
    (number,) = keys.numbers_of('report.number(f"rise_{car}", x, "dB", "rise", headline="d")', "a")
    assert number == ("rise_<car>", "dB", "rise")
    with pytest.raises(ValueError, match="a, line 2: write key and meaning as text"):
        list(keys.numbers_of('\nreport.number(key, x, "dB", "rise")', "a"))
