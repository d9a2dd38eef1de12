"""The thesis beside its re-run: one page in the order of its chapters, also as Markdown.

What the page says is in ``thesis.toml``; its numbers are those of finished runs.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pandas as pd

from deboom.files.run_folder import RunEntry
from deboom.files.schema import Several, StrictModel, load_toml
from deboom.report import Report, Scalar

DATA = Path(__file__).with_name("thesis.toml")
TITLE = "The thesis, item by item"
PREFACE = (
    "This page says where each equation, table and figure of the thesis is in deboom, and has the "
    "numbers of the runs beside those that the thesis prints. Equations have their own pages, with "
    "the form used, the function and the proof. The command draws the figure or table. The report "
    "has it under the heading in italics, the run folder under the file name given (figures as "
    "PNG). A star stands for the name of an axis. *Schematic* is a drawing "
    "that shows no result; what it explains is named with it. `deboom thesis` runs all commands "
    "and writes this page, also with the pictures."
)
MISPRINTS = (
    "What the thesis prints and cannot mean, beside its equations, whose misprints stand with "
    "them. A test holds what has one."
)
STATEMENTS = (
    "What the thesis says in numbers of its own results and of the cars that it measured, and the "
    "same here."
)
PIPE = "\\|"
"""A bar in a cell of a Markdown table."""
NOT_KNOWN = "not known"
FIGURES = "figures/{}.png"
_LINK = re.compile(r"\[([^\]]+)\]\(([^)#]+)[^)]*\)")
_BRACES = re.compile(r"\{([^{}]+)\}")
_MARKED = re.compile(r"`([^`]*)`|\*([^*`]+)\*")


class ThesisNumber(StrictModel):
    """A number of the thesis: what it is with its unit, its value there, its key in the run."""

    what: str
    thesis: str
    key: str


class Item(StrictModel):
    """A figure, table, equation or section of the thesis, and where it is shown.

    - `run`: name of the command that shows it, under the headings `sections`, in `files` (stems).
    - `code`: functions, and files of examples, that explain it; `see`: Markdown.
    - `differs`: completes "It differs because …".
    """

    name: str
    subject: str
    schematic: bool = False
    run: str = ""
    sections: Several[str] = ()
    files: Several[str] = ()
    code: Several[str] = ()
    see: str = ""
    differs: str = ""
    numbers: Several[ThesisNumber] = ()


class Chapter(StrictModel):
    """Items of a chapter in their order."""

    title: str
    items: Several[Item]


class Misprint(StrictModel):
    """What the thesis prints where, what is right, and the test that holds it; empty for none."""

    place: str
    printed: str
    right: str
    proof: str = ""


class Statement(StrictModel):
    """What the thesis states in numbers, and the same here.

    - `place`: section; `printed`: in the thesis.
    - `here`: the same in words, with keys of the answer of a command, `run`, in braces.
    - `differs`: completes "It differs because …".
    """

    place: str
    printed: str
    run: str
    here: str
    differs: str = ""

    @property
    def keys(self) -> list[str]:
        """Keys of the numbers in `here`."""
        return _BRACES.findall(self.here)


class Thesis(StrictModel):
    """Commands by their names, chapters, statements and misprints."""

    runs: dict[str, str]
    chapters: Several[Chapter]
    statements: Several[Statement]
    misprints: Several[Misprint]


def read_thesis(path: Path = DATA) -> Thesis:
    """Read what stands where; raises InputError: a key that is unknown, missing or mistyped."""
    return load_toml(path, Thesis)


def numbers_of(entry: RunEntry) -> Mapping[str, Scalar | None]:
    """Return the numbers of a run by their keys."""
    answer = entry.answer
    return {} if answer is None else {number.key: number.value for number in answer.numbers}


def thesis_report(thesis: Thesis, runs: Mapping[str, RunEntry]) -> Report:
    """Show every item with its pictures, and its numbers beside the thesis's.

    - `runs`: finished runs by the names of their commands.
    """
    report, shown = Report(TITLE, _plain(PREFACE)), set()
    for chapter in thesis.chapters:
        report.section(chapter.title)
        for item in chapter.items:
            report.text(_plain(_paragraph(thesis, item)))
            for path in _pictures(item, runs):
                if path not in shown:  # one picture may show several figures
                    caption = f"Thesis, {item.name}: {item.subject} ({path.stem})."
                    report.figure(None, path.read_bytes(), caption)
                shown.add(path)
        numbers = _numbers(chapter.items, runs)
        if len(numbers):
            report.table(None, numbers, "The thesis's numbers and those of the runs.")
    report.section(f"{len(thesis.statements)} statements in numbers", STATEMENTS)
    report.table(None, _statements(thesis, runs), "Statements of the thesis, and the same here.")
    report.section("Misprints", MISPRINTS)
    misprints = _misprints(thesis)
    tested = misprints["proof"].ne("").map({True: "yes", False: ""})
    misprints = misprints.drop(columns="proof").assign(tested=tested)
    report.table(None, misprints, "Corrected misprints; docs/thesis.md names their tests.")
    return report


def thesis_markdown(thesis: Thesis, runs: Mapping[str, RunEntry]) -> str:
    """Write the same as Markdown, without pictures; numbers of the runs are bold."""
    lines = [f"# {TITLE}", "", *_wrapped(PREFACE)]
    for chapter in thesis.chapters:
        lines += ["", f"## {chapter.title}", "", *_markdown(_items(thesis, chapter.items))]
        numbers = _numbers(chapter.items, runs)
        if len(numbers):
            numbers["here"] = "**" + numbers["here"] + "**"
            lines += ["", *_markdown(numbers)]
    statements = _statements(thesis, runs, mark="**")
    heading = f"## {len(statements)} statements in numbers"
    lines += ["", heading, "", *_wrapped(STATEMENTS), "", *_markdown(statements)]
    misprints = _misprints(thesis).replace({"proof": {r"^(?=.)|(?<=.)$": "`"}}, regex=True)
    lines += ["", "## Misprints", "", *_wrapped(MISPRINTS), "", *_markdown(misprints)]
    return "\n".join(lines) + "\n"


def _items(thesis: Thesis, items: Sequence[Item]) -> pd.DataFrame:
    """Write where items are shown, as Markdown."""
    rows = [
        {
            "item": item.name,
            "subject": item.subject,
            "command": f"`{thesis.runs[item.run]}`" if item.run else "",
            "heading and files": _place(item),
            "functions, examples": ", ".join(f"`{name}`" for name in item.code),
            "differs because": item.differs,
        }
        for item in items
    ]
    table = pd.DataFrame(rows)
    return table.loc[:, (table != "").any()]


def _place(item: Item) -> str:
    """Say under which headings and in which files an item is shown, as Markdown."""
    headings = "; ".join(f"*{heading}*" for heading in item.sections)
    files = ", ".join(f"`{stem}`" for stem in item.files)
    shown = ", ".join(filter(None, (headings, files)))
    return "; ".join(filter(None, ("schematic" if item.schematic else "", shown, item.see)))


def _paragraph(thesis: Thesis, item: Item) -> str:
    """Say what an item is, what shows it and why it differs, as Markdown."""
    sentences = [f"{_capital(item.name)}: {item.subject}"]
    if item.schematic:
        sentences.append("It is schematic")
    if item.sections:
        headings, files = ", ".join(item.sections), ", ".join(item.files)
        sentences.append(f"{thesis.runs[item.run]} shows it under {headings} ({files})")
    if item.see:
        sentences.append(_capital(item.see))
    if item.code:
        sentences.append(f"See {', '.join(item.code)}")
    if item.differs:
        sentences.append(f"It differs because {item.differs}")
    return ". ".join(sentences) + "."


def _numbers(items: Sequence[Item], runs: Mapping[str, RunEntry]) -> pd.DataFrame:
    """Put the numbers of items beside those of their runs."""
    rows = [
        {
            "item": item.name,
            "number": number.what,
            "thesis": number.thesis,
            "here": _written(numbers_of(runs[item.run]).get(number.key)),
        }
        for item in items
        for number in item.numbers
    ]
    return pd.DataFrame(rows)


def _statements(thesis: Thesis, runs: Mapping[str, RunEntry], mark: str = "") -> pd.DataFrame:
    """Put statements beside what runs say, with a mark on both sides of each number of a run."""

    def filled(statement: Statement) -> str:
        numbers = numbers_of(runs[statement.run])
        return _BRACES.sub(
            lambda key: f"{mark}{_written(numbers.get(key[1]))}{mark}", statement.here
        )

    rows = [
        {
            "where": statement.place,
            "the thesis": statement.printed,
            "here": filled(statement),
            "differs because": statement.differs,
        }
        for statement in thesis.statements
    ]
    return pd.DataFrame(rows)


def _misprints(thesis: Thesis) -> pd.DataFrame:
    return pd.DataFrame([misprint.model_dump() for misprint in thesis.misprints])


def _pictures(item: Item, runs: Mapping[str, RunEntry]) -> Iterator[Path]:
    """Yield the pictures of an item in its run."""
    if item.run:
        for stem in item.files:
            yield from sorted(runs[item.run].folder.glob(FIGURES.format(stem)))


def _written(value: Scalar | None) -> str:
    """Write a number with five digits, as the thesis does."""
    if value is None:
        return NOT_KNOWN
    return f"{value:.5g}".replace("-", "−") if isinstance(value, float) else str(value)


def _markdown(table: pd.DataFrame) -> Iterator[str]:
    """Write a table of words as Markdown."""
    yield f"| {' | '.join(table.columns)} |"
    yield "|---" * len(table.columns) + "|"
    for row in table.itertuples(index=False):
        yield f"| {' | '.join(str(cell).replace('|', PIPE) for cell in row)} |"


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, 120)


def _plain(markdown: str) -> str:
    """Leave out the marks of Markdown, and name linked files; a star inside of code is a star."""
    return _MARKED.sub(r"\1\2", _LINK.sub(r"\1 (docs/\2)", markdown))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
