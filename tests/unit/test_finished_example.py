"""The finished run that a clone brings: whole, small, and named where readers look."""

import re
from pathlib import Path

import pandas as pd

from command_line import call
from deboom.files.run_folder import check_files, read_run
from deboom.runs.runner import load_study

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "results" / "sensitivity" / "example"


def test_a_clone_opens_a_finished_run_of_a_megabyte_at_most():
    entry = read_run(EXAMPLE)
    check_files(entry)
    assert entry.finished
    assert sum(path.stat().st_size for path in EXAMPLE.rglob("*") if path.is_file()) <= 1_000_000
    arguments = entry.record["arguments"]
    assert set(arguments) <= set(load_study(entry.study).parameters)
    assert not Path(arguments["platform"]).is_absolute()
    assert (ROOT / arguments["platform"] / "platform.toml").is_file()
    table = pd.read_csv(EXAMPLE / "sobol.csv")
    assert set(table.loc[table["rank"] == 1, "variable"]) == {"TSM x", "GeM x"}
    told = call("show", EXAMPLE).stdout
    assert "finished" in told
    assert "st_TSM_x_U06-1" in told


def test_it_is_as_new_as_the_last_release():
    # `make pictures` makes it, and the pictures of README and guides with it
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    version, date = re.search(r"^## \[([\d.]+)\] - (\S+)$", text, re.MULTILINE).groups()
    entry = read_run(EXAMPLE)
    assert entry.record["environment"]["packages"]["deboom"] == version
    assert entry.started[:10] >= date


def test_readers_are_led_to_it_and_git_keeps_it():
    for page in ("README.md", "results/README.md"):
        assert "sensitivity/example" in (ROOT / page).read_text(encoding="utf-8")
    assert "!results/sensitivity/example/" in (ROOT / ".gitignore").read_text()
