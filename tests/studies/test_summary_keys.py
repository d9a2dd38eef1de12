"""Keys of summaries and the docstrings that define them; conftest.py asks this of every run."""

import pytest
from summary_keys import STUDIES, described, undefined

TEXT = """Keys of summary.json: mean_db, part_<mount>, peak_error_median_db|p90_db, held_*_share;
…_p10; the same with _held_out, and doe_ before it."""


def test_keys_that_are_not_defined_are_found():
    keys = ("mean_db", "part_TSM", "peak_error_p90_db", "held_lines_share", "mean_db_p10")
    assert undefined([*keys, "doe_mean_db", "mean_db_held_out"], TEXT) == []
    wrong = ["mean", "mean_dB", "part", "peak_error_db", "p10", "mean_db_p20", "other_mean_db"]
    assert undefined(wrong, TEXT) == wrong


@pytest.mark.parametrize("path", sorted(STUDIES.glob("[!_]*.py")), ids=lambda path: path.stem)
def test_every_study_says_what_its_keys_are(path):
    assert len(described(path.stem)) > len("Keys of summary.json")
    assert undefined(["surely_not_a_key"], described(path.stem)) == ["surely_not_a_key"]
