"""The guide from a front to a specification: its commands, options, files and pictures exist."""

import re
import shlex
from pathlib import Path

import pytest
from typer.main import get_command

from deboom.cli import app
from deboom.files.acceptance import read_delivered_parts
from deboom.study.runner import load_study

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "guides" / "from-front-to-specification.md"
TEXT = GUIDE.read_text(encoding="utf-8")
FENCED = re.findall(r"```(?:sh)?\n(.*?)```", TEXT, flags=re.S)
COMMANDS = [line for block in FENCED for line in block.splitlines() if line.startswith("deboom ")]
COMMANDS = [line for line in COMMANDS if not line.startswith("deboom: ")]
STUDIES = (
    "u06_robust_front",
    "solution_box",
    "tolerance_allocation",
    "commonality",
    "measured_uncertainty",
)


def options_of(words):
    """Return the options that a command of deboom has, those of its study included."""
    command = get_command(app).commands[words[1]]
    own = {name for parameter in command.params for name in parameter.opts}
    if words[1] != "run":
        return own
    study = load_study(ROOT / words[2])
    return own | {"--" + name.replace("_", "-") for name in study.parameters}


@pytest.mark.parametrize("line", COMMANDS)
def test_every_command_has_its_options(line):
    words = shlex.split(line)
    used = {word for word in words if word.startswith("--")}
    assert used <= options_of(words)


def test_every_option_in_the_text_exists_somewhere():
    known = set().union(*(options_of(["deboom", "run", f"studies/{s}.py"]) for s in STUDIES))
    known |= options_of(["deboom", "report"]) | options_of(["deboom", "accept"])
    named = set(re.findall(r"`(--[a-z-]+)", TEXT))
    assert len(named) > 8
    assert named <= known


def test_every_key_in_the_text_is_explained_by_its_study():
    docs = " ".join(load_study(ROOT / f"studies/{name}.py").description for name in STUDIES)
    keys = set(re.findall(r"`([a-z0-9]+_[a-z0-9_]+)`", TEXT)) - set(STUDIES)
    assert len(keys) > 6
    assert {key for key in keys if key not in docs} == set()


def test_the_filled_sheet_is_the_delivery_that_the_guide_tells_of():
    required = {
        "EnM": ("x", "y", "z"),
        "GeM": ("x", "y", "z"),
        "TSM": ("x", "y", "z"),
        "Du": ("x",),
    }
    parts = read_delivered_parts(GUIDE.with_name("delivered_parts.csv"), required)
    counts = {}
    for part in parts:
        name = f"{part.mount} {part.batch}"
        counts[name] = counts.get(name, 0) + 1
    told = dict(re.findall(r"^\| ((?:TSM|Du) \w\d) \| (\d+) \|", TEXT, flags=re.M))
    assert {name: str(count) for name, count in counts.items()} == told
