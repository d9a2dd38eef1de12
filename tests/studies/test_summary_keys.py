"""Keys of summaries and the docstrings that define them; conftest.py asks this of every run."""

from summary_keys import undefined

TEXT = """Keys of summary.json: mean_db, part_<mount>, peak_error_median_db|p90_db, held_*_share;
…_p10; the same with _held_out, and doe_ before it."""


def test_keys_that_are_not_defined_are_found():
    keys = ("mean_db", "part_TSM", "peak_error_p90_db", "held_lines_share", "mean_db_p10")
    assert undefined([*keys, "doe_mean_db", "mean_db_held_out"], TEXT) == []
    wrong = ["mean", "mean_dB", "part", "peak_error_db", "p10", "mean_db_p20", "other_mean_db"]
    assert undefined(wrong, TEXT) == wrong
