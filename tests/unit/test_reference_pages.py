"""The generated reference leaves nothing out, and each page of the site has one name."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

from deboom.cli import COMMANDS
from deboom.files.acceptance import Programme
from deboom.files.component_test import ReceiverFile
from deboom.files.folders import FOLDERS, Names, new_folder
from deboom.files.kinds import FolderKind
from deboom.files.shipped_studies import shipped_studies
from deboom.runs.runner import study_files

DOCS = Path(__file__).parents[2] / "docs"
sys.path.append(str(DOCS))  # the pages are written from there

import reference_pages  # noqa: E402


def test_every_command_has_its_help_and_every_study_its_options_and_keys():
    commands = dict(reference_pages.command_pages())
    assert {name for names in COMMANDS.values() for name in names} <= commands.keys()
    assert "Usage: deboom bench write" in commands["bench-write"]
    studies = dict(reference_pages.study_pages())
    assert studies.keys() == {path.stem for path in study_files(shipped_studies())}
    assert "--generations" in studies["front"]
    assert "| `share_verified` | 1 |" in studies["solution_box"]


def keys_of(text):
    """Names of all keys of a commented TOML file, those behind a # included."""
    plain = re.sub(r"^# (\[.*|\w+ = .*)", r"\1", text, flags=re.MULTILINE)
    waiting, names = [tomllib.loads(plain)], set()
    while waiting:
        for key, value in waiting.pop().items():
            inside = value if isinstance(value, list) else [value]
            tables = [each for each in inside if isinstance(each, dict)]
            waiting += tables
            names |= set() if tables else {key}
    return names


@pytest.mark.parametrize("kind", FolderKind)
def test_every_key_of_a_new_folder_is_listed(kind, tmp_path):
    folder = new_folder(tmp_path / "new", kind, Names(mounts=("TSM", "Du=left,right")))
    path = folder / FOLDERS[kind].file
    shown = re.findall(r"^`(.*)`", reference_pages.key_list(path), flags=re.MULTILINE)
    listed = {key for line in shown for key in re.findall(r"(\w+)(?= =|$)", line)}
    assert keys_of(path.read_text(encoding="utf-8")) <= listed


def test_a_file_without_a_template_has_the_keys_of_its_model():
    text = reference_pages.keys_of_model(ReceiverFile)
    head, _, points = text.partition("## [points]")
    assert "`title`, to fill in\n: what a reader calls the receiver" in head
    assert "`stiffness_n_per_m`, may be left out" in points
    assert "`format`, by default `1`" in reference_pages.keys_of_model(Programme)


def test_a_page_has_one_name():
    for path in DOCS.rglob("*.md"):
        for tree in re.findall(r"```\{toctree\}\n(.*?)```", path.read_text("utf-8"), flags=re.S):
            assert "<" not in tree, path
