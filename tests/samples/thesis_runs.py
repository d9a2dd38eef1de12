"""The page of the thesis against finished runs: what it names must be there and cite its number."""

import ast
import importlib
import re
from fnmatch import fnmatch
from functools import cache
from html import unescape
from pathlib import Path

import typer
from typer.main import get_command

from deboom.cli import StudyCommand, app
from deboom.errors import InputError
from deboom.pages.sensitivity import Analysis
from deboom.runs.thesis import typed
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.platform import MountSource

ROOT = Path(__file__).parents[2]
DOE = {"designs": 64, "draws": 4, "resamples": 100, "mounts": MountSource.spectra}
BUDGETS = {
    "groups": DOE,
    "vehicles": DOE,
    "sensitivity": {
        "n": 8,
        "resamples": 20,
        "mounts": MountSource.spectra,
        "analysis": Analysis.tolerance,
        "load_case": ["g5_wot220=1", "g6_wot220=1"],
        "motion": Motion.coupled,
    },
    "ranking": {"n": 64, "resamples": 20, "motion": Motion.prescribed},
    "cabin": {"draws": 20},
}
"""Options of the suite's runs of the thesis's commands, beside those that the command has."""
FURTHER = {"ranking": "deboom run sensitivity"}
"""Commands that the suite has runs of, and that are none of the page."""
IN_WORDS = ("groups", "sensitivity", "ranking", "cabin")
"""Runs whose pictures are pinned in words."""
SCHEMATIC = {
    "figure": {*range(1, 10), 11, 12, 13, 15, 17, 39, 46, 49, 50, 51, 60, 64},
    "table": {1, 2, 4, 5},
}
"""Drawings of the thesis that show no result."""
USAGE_ERROR = typer.BadParameter.__base__
"""What the command line raises for words that it does not take."""
LAST = {"equation": 79, "table": 11, "figure": 66}
APPENDIX = {66, 67}
"""Figures of the appendix, the first of which has the number of another one."""
NAME = re.compile(r"(equation|table|figure|section)s? ([\d.–, ]*\d)( of the appendix)?")
CITED = re.compile(r"(equation|eq\.|table|figure)s? (\d[\da-c]*(?:(?:,| to| and|–) ?\d+[a-c]?)*)")
LINK = re.compile(r"\]\(([\w/-]+\.md)(?:#([\w-]+))?\)")
BLOCK = re.compile(
    r'<h2 id="(?:section|title)-\d+">(?P<heading>.*?)</h2>'
    r'|<(?:figure|div) id="(?:figure|table)-(?P<stem>[^"]+)".*?'
    r"<(?:figcaption|caption)>(?P<caption>.*?)</(?:figcaption|caption)>",
    re.DOTALL,
)


def numbered(name):
    """Return the kind of an item, its numbers, and whether they are of the appendix."""
    kind, numbers, appendix = NAME.fullmatch(name).groups()
    return kind, list(_numbers(numbers)), bool(appendix)


def _numbers(text):
    for part in re.split(r", | and ", re.sub(r"(?<=\d)[a-c]", "", text)):
        first, _, last = part.replace(" to ", "–").partition("–")
        yield from range(int(first), int(last or first) + 1) if "." not in first else ()


def cited(text, kind):
    """Return the numbers of a kind that a text cites."""
    return {
        number
        for named, numbers in CITED.findall(text)
        if kind == named.replace("eq.", "equation")
        for number in _numbers(numbers)
    }


def wrong_names(thesis):
    """Give a sentence for what is missing, doubled, or a schematic by mistake."""
    seen = {kind: set() for kind in (*LAST, "section", "appendix")}
    for item in every_item(thesis):
        kind, numbers, appendix = numbered(item.name)
        seen["appendix" if appendix else kind] |= set(numbers)
        expected = kind in SCHEMATIC and set(numbers) <= SCHEMATIC[kind] and not appendix
        if item.schematic != expected:
            yield f"{item.name} is {'no ' if item.schematic else 'a '}schematic"
    expected = {kind: set(range(1, last + 1)) for kind, last in LAST.items()}
    for kind, numbers in {**expected, "appendix": APPENDIX}.items():
        if missing := numbers ^ seen[kind]:
            yield f"{kind} {missing} has no item, or does not exist"


def every_item(thesis):
    return [item for chapter in thesis.chapters for item in chapter.items]


def wrong_commands(thesis):
    """Give a sentence for each command, also in a text, that does not parse as printed."""
    texts = [text for item in every_item(thesis) for text in (item.see, item.differs)]
    texts += [statement.differs for statement in thesis.statements]
    commands = re.findall(r"`(deboom [^`]+)`", " ".join(texts))
    return list(filter(None, map(wrong_command, (*thesis.runs.values(), *commands))))


@cache
def wrong_command(typed_words):
    """Return why a command cannot be typed so; empty if it can. It is parsed, not carried out."""
    _, *words = typed_words.split()
    command = get_command(app)
    try:
        while hasattr(command, "commands"):
            command = command.commands[words.pop(0)]
        if isinstance(command, StudyCommand) or command.name == "run":
            study, options = typed(typed_words)
            study.effective(options)
            if "group" in options:
                study.model(options)  # reads which groups there are
        else:
            command.make_context(command.name, words)
    except (InputError, USAGE_ERROR, KeyError) as error:
        return f"{typed_words}: {error}"
    return ""


def wrong_code(thesis):
    """Give a sentence for each function, example or file that is not there or cites no number."""
    for item in every_item(thesis):
        kind, numbers, _ = numbered(item.name)
        for name in item.code:
            text = example(name) if "/" in name else docstring(name)
            if text is None:
                yield f"{item.name}: {name} does not exist"
            elif kind in ("figure", "table") and not cited(text, kind) & set(numbers):
                yield f"{item.name}: {name} does not cite it"
        for path in re.findall(r"`((?:src|examples)/[^`]+)`", item.see):
            if not (ROOT / path).is_file():
                yield f"{item.name}: there is no {path}"


def wrong_links(thesis):
    """Give a sentence for each link to a page, or a heading of it, that is not there."""
    for item in every_item(thesis):
        for name, heading in LINK.findall(f"{item.see} {item.differs}"):
            path = ROOT / "docs" / name
            text = path.read_text(encoding="utf-8") if path.is_file() else ""
            heads = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
            anchors = {re.sub(r"[^\w -]", "", head).lower().replace(" ", "-") for head in heads}
            if not text or (heading and heading not in anchors):
                yield f"{item.name}: there is no {name}#{heading}"


@cache
def example(name):
    path = ROOT / name
    return " ".join(path.read_text(encoding="utf-8").split()) if path.is_file() else None


@cache
def docstring(name):
    """Return the docstring of ``module.name``, that of its module where a value has none."""
    module, attribute = name.split(".")
    for path in (ROOT / "src" / "deboom").glob(f"*/{module}.py"):
        found = importlib.import_module(f"deboom.{path.parent.name}.{module}")
        if hasattr(found, attribute):
            return ast.get_docstring(_node(path, attribute)) or ""
    return None


def _node(path, name):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    kinds = ast.FunctionDef | ast.ClassDef
    return next(n for n in tree.body if isinstance(n, kinds) and n.name == name)


def wrong_in_run(thesis, name, folder, keys):
    """Give a sentence for each item of a command that its finished run does not show.

    - `folder`: the run, with its page; `keys`: of the numbers of its answer.
    """
    shown = blocks(folder)
    files = {path.name.partition(".")[0] for path in folder.rglob("*.*")}
    for item in every_item(thesis):
        if item.run != name:
            continue
        kind, numbers, _ = numbered(item.name)
        of_item = {
            stem: block
            for stem, block in shown.items()
            if any(fnmatch(stem, form) for form in item.files)
        }
        for form in item.files:
            if not any(fnmatch(stem, form) for stem in files):
                yield f"{item.name}: the run has no file {form}"
        for heading, _ in of_item.values():
            if heading not in item.sections:
                yield f"{item.name} is shown under {heading}"
        headings = {heading for heading, _ in shown.values()}
        for heading in set(item.sections) - headings:
            yield f"{item.name}: nothing is shown under {heading}"
        captions = " ".join(caption for _, caption in of_item.values())
        if kind != "section" and (missing := set(numbers) - cited(captions, kind)):
            yield f"{item.name}: no caption of its files cites {kind} {missing}"
        for number in item.numbers:
            if number.key not in keys:
                yield f"{item.name}: the answer has no number {number.key}"
    for statement in thesis.statements:
        if statement.run == name and (missing := set(statement.keys) - set(keys)):
            yield f"{statement.printed}: the answer has no number {missing}"


@cache
def blocks(folder):
    """Return heading and caption of every figure and table that is a file, by its stem."""
    page, heading, shown = (folder / "report.html").read_text(encoding="utf-8"), "", {}
    for match in BLOCK.finditer(page):
        if match["heading"] is not None:
            heading = unescape(match["heading"])
            continue
        caption = unescape(re.sub(r"<[^>]*>", "", match["caption"]))
        _, before = shown.get(match["stem"], (heading, ""))
        shown[match["stem"]] = heading, f"{before} {caption}"
    return shown
