"""The page of the thesis leaves nothing out, and what it names exists."""

import ast
import importlib
import re
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import pytest
from test_equation_tables import exists
from typer.main import get_command

from deboom.cli import app
from deboom.names import option_name
from deboom.runs.runner import load_study

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "deboom"
PAGE = (ROOT / "docs" / "thesis.md").read_text(encoding="utf-8")
LAST = {"eq.": 79, "table": 11, "figure": 67}
FILE = re.compile(r"`((?:src|examples)/[\w./-]+)`")
COMMAND = re.compile(r"`deboom ([^`]+)`")
FUNCTION = re.compile(r"`([a-z]\w*\.\w+)`")
LINK = re.compile(r"\]\(([\w/-]+\.md)(?:#([\w-]+))?\)")


def rows():
    """Kind and cells of each row of the page, under its table's head."""
    kind, every = "", []
    for line in PAGE.splitlines():
        if not line.startswith("| "):
            continue
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if cells[0] in LAST:
            kind = cells[0]
        else:
            every.append((kind, cells))
    return every


def numbers(cell):
    for part in cell.split(", "):
        first, _, last = part.partition("–")
        yield from range(int(first), int(last or first) + 1)


@pytest.mark.parametrize("kind", LAST)
def test_every_number_of_the_thesis_has_a_row(kind):
    named = [number for of, cells in rows() if of == kind for number in numbers(cells[0])]
    assert sorted(set(named)) == list(range(1, LAST[kind] + 1))


def test_every_row_says_where_it_is_shown_or_that_it_is_a_schematic():
    empty = [
        cells[0]
        for _, cells in rows()
        if not (LINK.search(text := "".join(cells)) or FUNCTION.search(text))
        and not ("schematic" in text or (COMMAND.search(text) and "*" in cells[3]))
    ]
    assert empty == []


def test_functions_files_and_links_exist():
    names = set(FUNCTION.findall(PAGE))
    assert len(names) > 40
    assert [name for name in sorted(names) if not exists(name)] == []
    files = FILE.findall(PAGE)
    assert len(files) > 15
    assert [name for name in files if not (ROOT / name).is_file()] == []
    for page, heading in LINK.findall(PAGE):
        text = (ROOT / "docs" / page).read_text(encoding="utf-8")
        heads = [
            re.sub(r"[^\w -]", "", head).lower().replace(" ", "-")
            for head in re.findall(r"^#+ (.+)$", text, re.M)
        ]
        assert not heading or heading in heads, f"{page}#{heading}"


@pytest.mark.parametrize("typed", sorted(set(COMMAND.findall(PAGE))))
def test_commands_have_their_options_and_pages_their_headings_and_files(typed):
    words = typed.split()
    if words[0] == "run":
        study = load_study(words[1])
        options = {f"--{option_name(name)}" for name in study.parameters}
        assert {word for word in words if word.startswith("--")} <= options
        shown = strings_behind(study.path)
    else:
        shown = strings_behind(command_file(words))
    of_command = [cells[3] for _, cells in rows() if cells[2:] and f"`deboom {typed}`" in cells[2]]
    assert of_command
    for cell in of_command:
        headings = re.findall(r"(?<![\w`])\*([^*`]+)\*(?![\w`])", cell)
        files = [name for name in re.findall(r"`([^`]+)`", cell) if "/" not in name]
        assert not files or headings
        assert [name for name in headings if name not in shown] == []
        assert [name for name in files if not drawn(name, shown)] == []


def drawn(name, shown):
    """Whether a file's name, or a form with holes that fits it, is among the strings."""
    forms = [text for text in shown if re.fullmatch(r"[\w*]*\w{5,}[\w*]*", text) and "*" in text]
    return name in shown or any(fnmatch(name, form) for form in forms)


def command_file(words):
    """File whose function carries a command out."""
    command = get_command(app)
    for name in words:
        command = command.commands[name]
    if hasattr(command, "loaded"):  # it is a study
        return command.path
    return Path(importlib.import_module(command.callback.__module__).__file__)


@cache
def strings_behind(path):
    """Strings in a file and in all modules of studies that it imports, holes of them as stars."""
    seen, waiting, strings = set(), [path], set()
    while waiting:
        file = waiting.pop()
        if file in seen:
            continue
        seen.add(file)
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                strings.add(node.value)
            elif isinstance(node, ast.JoinedStr):
                parts = (
                    part.value if isinstance(part, ast.Constant) else "*" for part in node.values
                )
                strings.add("".join(parts))
            elif isinstance(node, ast.ImportFrom) and node.module:
                of = node.module.removeprefix("deboom.").replace(".", "/")
                for name in (of, *(f"{of}/{alias.name}" for alias in node.names)):
                    if (
                        name.split("/")[0] in ("runs", "pages", "supplier")
                        and (SOURCE / f"{name}.py").is_file()
                    ):
                        waiting.append(SOURCE / f"{name}.py")
    return strings
