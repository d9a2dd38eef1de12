"""The overview of runs: what a run has that others of its study do not."""

from pathlib import Path

from deboom.files.run_folder import RunEntry
from deboom.runs.overview import run_cards


def entry(folder, **options):
    return RunEntry(folder, {"study": "front", "arguments": options})


def test_a_card_says_only_the_options_in_which_runs_of_a_study_differ():
    home = Path("results")
    runs = [
        entry(home / "front" / "2026-01-02_030405_seed1", seed=1, generations=4, population=12),
        entry(home / "front" / "2026-01-02_030406_seed2", seed=2, generations=9, population=12),
    ]
    cards = run_cards(runs, home)
    assert [card.special for card in cards] == ["generations 4", "generations 9"]
    (alone,) = run_cards(runs[:1], home)
    assert alone.special == ""
