"""The guide to one's own data: all of its commands and lines run as they stand."""

import re
import shlex
from functools import partial
from pathlib import Path

import pytest
from typer.testing import CliRunner

from deboom.bench.campaign import TRAINING_RUNS, CampaignPlan
from deboom.cli import app
from deboom.files.rows import read_table
from deboom.files.time_data import WavChannel

GUIDE = Path(__file__).parents[2] / "docs" / "guides" / "your-own-data.md"
SECTIONS = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", GUIDE.read_text("utf-8"), re.M | re.S))


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.S)


@pytest.mark.parametrize("section", [name for name in SECTIONS if name != "Modal test"])
def test_every_command_of_the_guide_runs(tmp_path, monkeypatch, section):
    monkeypatch.chdir(tmp_path)
    few = partial(CampaignPlan, runs=TRAINING_RUNS[::9], shaker_repeats=1)
    monkeypatch.setattr("deboom.bench.campaign.CampaignPlan", few)
    commands = "".join(blocks(SECTIONS[section], "sh")).splitlines()
    assert commands
    for command in commands:
        _, *arguments = shlex.split(command)
        done = CliRunner().invoke(app, arguments)
        to_fill_in = arguments[0] == "check" and arguments[1].startswith("my_")
        assert done.exit_code == (2 if to_fill_in else 0), (command, done.output)
        if arguments[0] == "check":
            assert ("faults in my_" in done.stderr) == to_fill_in
    if section == "Hammer test":
        lines = "".join(blocks(SECTIONS[section] + SECTIONS["Modal test"], "python"))
        values = {}
        exec(lines, values)
        assert values["estimate"].frf.values.shape[1:] == (18, 18)
        assert len(values["clusters"]) >= 4  # rubber damps the modes of the rigid body alike
        assert all(0.05 < mode.damping < 0.12 for mode in values["clusters"])
        assert len(values["modes"].table) == len(values["clusters"])


def test_the_calibration_of_the_guide_is_read(tmp_path):
    (tmp_path / "run.csv").write_text(blocks(SECTIONS["Campaign"], "text")[0])
    rows = read_table(tmp_path / "run.csv", WavChannel)
    assert [(row.channel, row.full_scale) for row in rows] == [
        ("A1 x", 500.0),
        ("driver ear", 20.0),
    ]
