"""The overview of runs: what a run has that others of its study do not."""

import json
import os
from pathlib import Path

import pytest

from deboom.files.run_folder import RunEntry, read_run
from deboom.runs.overview import list_lines, refresh_overview, run_cards, show_lines


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


FULL = {
    "study": "front",
    "question": "Which?",
    "command": "deboom front",
    "started": "2026-01-02 03:04:05",
    "seed": 1,
    "arguments": {"population": 12},
    "positional": {},
    "environment": {"python": "3", "packages": {"numpy": "2"}, "git": None},
    "study_text": "",
    "facts": {"n": 1},
    "headlines": {"gain": "1 dB"},
    "verdict": "Good.",
    "inputs_sha256": {},
    "files_sha256": {},
}
WRONG = ["1e999", '"\\ud800"', '"x"', "7", "[]", "[1]", '{"a": {"b": 1e999}}', "true", "null"]


@pytest.mark.parametrize("key", FULL)
def test_a_record_with_a_wrong_or_missing_entry_spoils_no_other(tmp_path, key):
    """Whatever one record says, the others are listed and it is shown or told as damaged."""
    home = tmp_path / "front"
    whole = json.dumps(FULL)
    without = json.dumps({name: entry for name, entry in FULL.items() if name != key})
    texts = [without, *(f'{without[:-1]}, "{key}": {wrong}}}' for wrong in WRONG)]
    for number, text in enumerate((whole, *texts)):
        (home / str(number)).mkdir(parents=True)
        (home / str(number) / "run.json").write_text(text, encoding="utf-8")
    told = "\n".join(list_lines(tmp_path))
    assert told.encode()
    assert told.count("finished  ") + told.count("damaged  ") == len(texts) + 1
    assert f"finished    front  {(home / '0').as_posix()}" in told
    page = refresh_overview(tmp_path)
    assert page is not None
    assert "Good." in page.read_text(encoding="utf-8")
    for number in range(len(texts) + 1):
        if f"{home / str(number)}/run.json" not in told:
            assert list(show_lines(read_run(home / str(number))))


@pytest.mark.skipif(os.name != "posix", reason="names of files are text on this system")
def test_a_folder_whose_name_is_no_text_spoils_no_other(tmp_path):
    for name in (b"good", b"a\xff", b"a\x1b[2J"):
        folder = tmp_path / "front" / os.fsdecode(name)
        folder.mkdir(parents=True)
        (folder / "run.json").write_text('{"study": "front"}')
    told = "\n".join(list_lines(tmp_path))
    assert told.encode()
    assert "\x1b" not in told
    assert told.count("damaged  ") == 2
    assert told.count("finished  ") == 1
    assert refresh_overview(tmp_path) is not None


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
def test_pipes_and_links_in_a_run_are_no_pages_of_it(tmp_path):
    (tmp_path / "secret.html").write_text("secret")
    folder = tmp_path / "results" / "front" / "run"
    (folder / "figures").mkdir(parents=True)
    (folder / "run.json").write_text('{"study": "front"}')
    os.mkfifo(folder / "report.html")
    os.mkfifo(folder / "figures" / "box.png")
    for name in ("interactive.html", "supplier_sheet.html"):
        (folder / name).symlink_to(tmp_path / "secret.html")
    (card,) = run_cards([read_run(folder)], tmp_path / "results")
    assert (card.report, card.interactive, card.thumbnail, card.sheets) == ("", "", "", {})
