"""Reports: what a study found, written top to bottom, as one page and as files beside it."""

from __future__ import annotations

import base64
import re
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from html import escape
from importlib.resources import files
from itertools import groupby
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from deboom.answer import ANSWER, Answer, AnswerTable, Number, Scalar, Step
from deboom.errors import InputError
from deboom.names import path_inside
from deboom.plot.style import as_png, signed
from deboom.report.glossary import GLOSSARY
from deboom.report.tables import text_columns
from deboom.tabled import json_text, table_file

if TYPE_CHECKING:
    import pandas as pd
    from jinja2 import Environment

    from deboom.plot.style import Drawing

SUMMARY, PAGE = "summary.json", "report.html"

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_PIXELS_PER_CSS_PIXEL = 1.5
_OPTION = re.compile(r"(?<![\w-])(--[a-z][\w-]*)")
_CONTENTS_FROM = 4  # sections


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure of the page, drawn when its PNG is first read: what it shows, and what to see in it.

    - `drawing`: an Axes or a Figure of `deboom.plot`, a PNG, or a function that returns such a
      thing.
    - `alt`, `caption`: for a reader who cannot see it, and below it.
    """

    drawing: Drawing | Callable[[], Drawing]
    alt: str
    caption: str

    @property
    def png(self) -> bytes:
        """The PNG; empty where it could not be drawn."""
        return self._drawn[0]

    @property
    def failure(self) -> str:
        """Why it could not be drawn; empty if it could."""
        return self._drawn[1]

    def keep(self, png: bytes, failure: str = "") -> None:
        """Keep what another process has drawn, or why it could not: as `png` and `failure` say."""
        self.__dict__["_drawn"] = png, failure

    @cached_property
    def _drawn(self) -> tuple[bytes, str]:
        if isinstance(self.drawing, bytes):
            return self.drawing, ""
        try:
            png = as_png(self.drawing() if callable(self.drawing) else self.drawing)
            _check_png(png, self.caption)
        except Exception as error:
            return b"", str(error)
        return png, ""


@dataclass(frozen=True, eq=False)
class Table:
    """A table of the page: its first column names the rows, the index is not shown."""

    frame: pd.DataFrame
    caption: str
    decimals: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Sound:
    """A sound of the page, played where it is asked for.

    - `name`: what is heard, such as ``today``.
    - `wav`: the whole WAV file.
    """

    name: str
    wav: bytes


@dataclass(frozen=True)
class Link:
    """A page beside this one: its file, and what the link says."""

    file: str
    words: str


@dataclass(frozen=True, eq=False)
class Panel:
    """A part of the first screen: a heading with tables, sounds, steps, links, pictures or texts.

    - `wide`: whether it stands in the wider column, above and left of those that do not.
    """

    title: str
    blocks: tuple[str | Picture | Table | Sound | Step | Link, ...]
    wide: bool = False


@dataclass(frozen=True, eq=False)
class Section:
    """A part of the page: texts, pictures and tables in the order of reading."""

    title: str
    blocks: list[str | Picture | Table]
    folded: bool = False


class Report:
    """What a study found: numbers on top, sections below, and every file of its run folder.

    Methods add to the page in the order of their calls. What is named by a stem is also a file:
    a table ``<stem>.csv``, a figure ``figures/<stem>.png``, a document ``<stem>.json``.

    Parameters
    ----------
    title : str
        Title of the page.
    question : str
        What was asked, in one or two sentences.

    Attributes
    ----------
    numbers : dict of str to Number
        Numbers of ``summary.json`` by their key.
    facts : dict of str to float, int or str
        What the study settled beside its options, for ``run.json`` and the foot of the page.
    inputs : list of Path
        Files that were read.
    shown_tables : dict of Table to str
        Tables of the page that are files, with the stem of the file.
    pictures : dict of str to Picture
        Figures that are kept, by the stem of their file. They are drawn by `figures`, `html` and
        `write`, not before, so that `results` can be saved first.
    pages : dict of str to Report
        Further pages of the run, ``<name>.html``.

    Examples
    --------
    >>> report = Report("Cheapest tolerances", "How wide may each direction scatter?")
    >>> report.number("cost", 66.0, "%", "cost over that of one tolerance", headline=".0f")
    >>> report.section("Allocation", "A direction at the widest tolerance needs no precision.")
    >>> report.headlines
    {'cost over that of one tolerance': '66 %'}
    """

    def __init__(self, title: str, question: str = "") -> None:
        self.title = title
        self.question = question
        self.verdict = ""
        self.remarks: list[str] = []
        self.panels: list[Panel] = []
        self.warnings: list[str] = []
        self.terms: list[str] = []
        self.sections: list[Section] = []
        self.tables: dict[str, pd.DataFrame] = {}
        self.shown_tables: dict[Table, str] = {}
        self.pictures: dict[str, Picture] = {}
        self.documents: dict[str, Mapping[str, Any]] = {}
        self.attachments: dict[str, bytes] = {}
        self.pages: dict[str, Report] = {}
        self.numbers: dict[str, Number] = {}
        self.facts: dict[str, Scalar] = {}
        self.inputs: list[Path] = []

    @property
    def summary(self) -> Mapping[str, Scalar | None]:
        """Content of ``summary.json``: key → value, to be read only."""
        return MappingProxyType({key: number.value for key, number in self.numbers.items()})

    @property
    def headlines(self) -> dict[str, str]:
        """Numbers that lists of runs show: meaning → number with its unit."""
        return {
            number.label: number.headline for number in self.numbers.values() if number.headline
        }

    @property
    def first_screen(self) -> Answer:
        """The answer as data, without sounds and pictures."""
        panels: dict[str, tuple[str | Step | AnswerTable, ...]] = {}
        for panel in self.panels:
            blocks = (_as_data(block) for block in panel.blocks)
            panels[panel.title] = tuple(block for block in blocks if block is not None)
        return Answer(
            title=self.title,
            question=self.question,
            verdict=self.verdict,
            remarks=tuple(self.remarks),
            warnings=tuple(self.warnings),
            numbers=tuple(self.numbers.values()),
            panels={title: blocks for title, blocks in panels.items() if blocks},
        )

    @property
    def figures(self) -> dict[str, bytes]:
        """PNG of every figure that is kept, by its stem; one that cannot be drawn is left out."""
        return {stem: picture.png for stem, picture in self.pictures.items() if picture.png}

    @property
    def every_picture(self) -> list[Picture]:
        """Pictures that are kept, then those that the page alone shows."""
        parts: list[Panel | Section] = [*self.panels, *self.sections]
        shown = [b for part in parts for b in part.blocks if isinstance(b, Picture)]
        of_pages = [picture for page in self.pages.values() for picture in page.every_picture]
        return list(dict.fromkeys((*self.pictures.values(), *shown, *of_pages)))

    @property
    def failures(self) -> list[str]:
        """What could not be drawn, and why."""
        names = {picture: stem for stem, picture in self.pictures.items()}
        return [
            f"the figure {names.get(p, p.caption)} could not be drawn ({p.failure})"
            for p in self.every_picture
            if p.failure
        ]

    def number(
        self,
        key: str,
        value: Scalar | None,
        unit: str,
        label: str,
        *,
        headline: str = "",
    ) -> None:
        """Say a number or a word once, for ``summary.json``, lists of runs, terminal and page.

        Parameters
        ----------
        key : str
            Its name in ``summary.json``.
        value : float, int, bool, str or None
            The number in `unit`; one that is not finite, and None, are not known.
        unit : str
            Empty for counts and words, ``1`` for ratios.
        label : str
            What it is; the page of keys in the documentation has it, too.
        headline : str
            Format of a number that lists of runs show, such as ``+.1f`` or ``.0f``, ``s`` for a
            word; empty for all others.

        Raises
        ------
        InputError
            A key, or the meaning of a headline, that is taken.
        """
        self._free(key, self.numbers)
        value = _plain(value)
        text = _headline(value, unit, headline) if headline else ""
        if text:
            self._free(label, self.headlines)
        self.numbers[key] = Number(key, value, unit, label, text)

    def answer(self, verdict: str, *remarks: str) -> None:
        """Begin the first screen with its verdict, which says on the page what headlines say.

        Parameters
        ----------
        verdict : str
            The answer in a sentence, for a reader who reads no other.
        *remarks : str
            What belongs beside it, such as how sure it is; empty ones are left out.
        """
        self.verdict = verdict
        self.remarks = [remark for remark in remarks if remark]

    def panel(
        self, title: str, *blocks: str | Picture | Table | Sound | Step | Link, wide: bool = False
    ) -> None:
        """Add a part of the first screen; one without blocks is left out.

        Parameters
        ----------
        title : str
            Heading.
        *blocks : str, Picture, Table, Sound, Step or Link
            What it shows, in the order of reading; no table of it is a file.
        wide : bool
            Whether it stands in the wider column.

        Raises
        ------
        InputError
            No verdict before it; a title that is taken; decimals for a column that a table does
            not have.
        """
        if not self.verdict:
            raise InputError("a first screen begins with its verdict: call `answer` first")
        for block in blocks:
            if isinstance(block, Table):
                text_columns(block.frame, block.decimals)
        self._free(title, {panel.title: panel for panel in self.panels})
        if blocks:
            self.panels.append(Panel(title, blocks, wide))

    def warn(self, *sentences: str) -> None:
        """Say what the reader must know before trusting the numbers; empty sentences are left out.

        A sentence that was said before is not said again.
        """
        new = [sentence for sentence in sentences if sentence]
        self.warnings = list(dict.fromkeys((*self.warnings, *new)))

    def assume(self, *sentences: str) -> None:
        """Say what nobody stated and defaults stand in for: as `warn`, and in the run's record."""
        self.warn(*sentences)
        for sentence in filter(None, sentences):
            said = str(self.facts.get("assumed", ""))
            if sentence not in said:
                self.facts["assumed"] = f"{said} {sentence}".strip()

    def explain(self, *terms: str) -> None:
        """Explain words on the page.

        Raises
        ------
        InputError
            A word that `deboom.report.glossary.GLOSSARY` does not explain.
        """
        unknown = [term for term in terms if term not in GLOSSARY]
        if unknown:
            raise InputError(f"the glossary does not explain {unknown}; it has {list(GLOSSARY)}")
        self.terms = list(dict.fromkeys((*self.terms, *terms)))

    def section(self, title: str, text: str = "", *, folded: bool = False) -> None:
        """Begin a part of the page with its heading and first paragraphs; `folded`: closed."""
        self.sections.append(Section(title, [], folded))
        self.text(text)

    def text(self, text: str) -> None:
        """Write paragraphs, separated by empty lines."""
        if text:
            self._show(text)

    def figure(
        self,
        stem: str | None,
        drawing: Drawing | Callable[[], Drawing],
        caption: str,
    ) -> None:
        """Show a figure, and keep it as ``figures/<stem>.png``.

        A figure that cannot be drawn costs nothing but itself: the page says why, `failures` too.

        Parameters
        ----------
        stem : str or None
            Name of the file; None shows the figure and keeps none.
        drawing : Axes, Figure, bytes or callable
            From `deboom.plot`, which is closed afterwards; a PNG; or a function that returns such a
            thing. A function is called last, when all results are saved: prefer it.
        caption : str
            What to see in it, also for a reader who cannot see it.

        Raises
        ------
        InputError
            A name that is taken, no PNG, no caption, or no section before it.
        """
        if isinstance(drawing, bytes):
            _check_png(drawing, caption)
        if not caption.strip():
            raise InputError("a picture needs a caption")
        picture = Picture(drawing, caption, caption)
        if stem is not None:
            self._free(stem, self.pictures)
            self.pictures[stem] = picture
        self._show(picture)

    def table(
        self,
        stem: str | None,
        frame: pd.DataFrame,
        caption: str = "",
        decimals: Mapping[str, int] | None = None,
        *,
        shown: pd.DataFrame | None = None,
    ) -> None:
        """Show a table, and keep it as ``<stem>.csv``.

        Parameters
        ----------
        stem : str or None
            Name of the file; None shows the table and keeps none.
        frame : DataFrame
            Columns ``name [unit]``; the first one names the rows, the index counts for nothing.
        caption : str
            What to see in it; a table without a caption is kept and not shown.
        decimals : mapping of str to int, optional
            Decimals by column label, where the unit's default does not serve.
        shown : DataFrame, optional
            What the page shows of it: fewer rows or columns.

        Raises
        ------
        InputError
            A name that is taken, decimals for a column that does not exist, no section before it.
        """
        if stem is not None:
            self._free(stem, self.tables)
            self.tables[stem] = frame
        if caption:
            table = Table(frame if shown is None else shown, caption, decimals or {})
            text_columns(table.frame, table.decimals)
            self._show(table)
            if stem is not None:
                self.shown_tables[table] = stem

    def document(self, stem: str, content: Mapping[str, Any]) -> None:
        """Keep a mapping as ``<stem>.json``."""
        self._free(stem, self.documents)
        self.documents[stem] = content

    def attach(self, name: str, content: bytes) -> None:
        """Keep a file under its whole name, such as a workbook."""
        self._free(name, self.attachments)
        self.attachments[name] = content

    def include(
        self,
        part: Report,
        title: str = "",
        *,
        names: Mapping[str, str] | None = None,
        page: str = "",
    ) -> None:
        """Add another report as a part of this one; its numbers are no headlines.

        - `title`: stands before the title of each of its sections.
        - `page`: name of a page of its own, on which its sections stand instead of here.
        - `names`: new names of its files and numbers, where they are taken here; an empty one
          leaves the file or number out.
        - raises InputError: a name that is taken.
        """
        if page:
            self._free(page, self.pages)
            self.pages[page] = part
        else:
            self.sections += [
                replace(section, title=f"{title} · {section.title}") for section in part.sections
            ]
            self.explain(*part.terms)
        self.warn(*part.warnings)
        new = names or {}
        kinds: tuple[tuple[dict[str, Any], Mapping[str, Any]], ...] = (
            (self.tables, part.tables),
            (self.pictures, part.pictures),
            (self.documents, part.documents),
            (self.attachments, part.attachments),
        )
        for mine, theirs in kinds:
            for name, value in theirs.items():
                if wanted := new.get(name, name):
                    self._free(wanted, mine)
                    mine[wanted] = value
        for key, number in part.numbers.items():
            if wanted := new.get(key, key):
                self._free(wanted, self.numbers)
                self.numbers[wanted] = replace(number, key=wanted, headline="")
        self.shown_tables |= {t: new.get(stem, stem) for t, stem in part.shown_tables.items()}
        self.facts = {**part.facts, **self.facts}
        self.inputs = list(dict.fromkeys((*self.inputs, *part.inputs)))

    def contents(self) -> dict[str, bytes]:
        """Return every file of the report but its page; name → bytes."""
        return self.results() | {f"figures/{stem}.png": png for stem, png in self.figures.items()}

    def results(self) -> dict[str, bytes]:
        """Return every file of the report but its page and its figures; name → bytes.

        Tables are UTF-8 with Unix line ends and floats that read back exactly, long ones are
        compressed, see `deboom.tabled.table_file`; a number of the summary that is not known is
        null. Nothing is drawn for it.
        """
        contents = dict(table_file(stem, frame) for stem, frame in self.tables.items())
        contents |= {f"{s}.json": json_text(c).encode() for s, c in self.documents.items()}
        contents |= self.attachments
        contents[SUMMARY] = json_text(dict(self.summary)).encode()
        contents[ANSWER] = json_text(asdict(self.first_screen)).encode()
        return contents

    def write(self, folder: Path) -> Path:
        """Write all files and the page into a folder, which is made; return the page's path."""
        for part in (self.results, self.contents, self.html_pages):
            for name, content in part().items():
                path = path_inside(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        return folder / PAGE

    def html_pages(self, provenance: Mapping[str, Any] | None = None) -> dict[str, bytes]:
        """Return the page and its further pages by their file, see `html`."""
        pages = {PAGE: self, **{f"{name}.html": page for name, page in self.pages.items()}}
        return {name: page.html(provenance).encode() for name, page in pages.items()}

    def html(self, provenance: Mapping[str, Any] | None = None) -> str:
        """Render the page as one HTML file without scripts or references to anything outside of it.

        With a verdict its first screen is the answer, which prints on pages of its own.

        - `provenance`: how the numbers came about: ``command``, ``inputs`` (file → SHA-256) and
          further facts; mappings inside are written out. Texts are escaped: no input can add
          markup.
        """
        given, contents = provenance or {}, len(self.sections) >= _CONTENTS_FROM
        return rendered(
            "page.html",
            paragraphs=_paragraphs,
            groups=_groups,
            anchor=self._anchors().get,
            text_columns=lambda table: text_columns(table.frame, table.decimals),
            page=self,
            terms={term: GLOSSARY[term] for term in self.terms},
            classes=" ".join(["answered"] * bool(self.verdict) + ["with-contents"] * contents),
            contents=contents,
            provenance=given,
            command=given.get("command"),
            inputs=given.get("inputs") or {},
            facts=_facts(given),
        )

    def _anchors(self) -> dict[Picture | Table, str]:
        """Return the anchor on the page of every figure and table that is a file."""
        stems: dict[Picture | Table, str] = {
            picture: f"figure-{stem}" for stem, picture in self.pictures.items()
        }
        stems |= {table: f"table-{stem}" for table, stem in self.shown_tables.items() if stem}
        return {block: stem.replace(" ", "-") for block, stem in stems.items()}

    def _show(self, block: str | Picture | Table) -> None:
        """Add a block to the last section."""
        if not self.sections:
            raise InputError("a report begins with a section: call `section` first")
        self.sections[-1].blocks.append(block)

    def _free(self, name: str, taken: Mapping[str, object]) -> None:
        """Refuse a name that is taken."""
        if name in taken:
            raise InputError(f"report '{self.title}' has two things of the name '{name}'")


def rendered(name: str, **content: Any) -> str:
    """Render a template of this package; texts are escaped, a name without a value is an error."""
    return _templates().get_template(name).render(**content)


@cache
def _templates() -> Environment:
    """Return what compiles each template of this package once, which takes longer than a page."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    environment = Environment(
        loader=FunctionLoader(
            lambda name: files("deboom.report").joinpath(name).read_text(encoding="utf-8")
        ),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"image": as_image, "audio": as_audio, "escaped": _escaped}
    return environment


def as_image(picture: Picture) -> dict[str, str | int]:
    """Turn the PNG into ``source``, a data URI, with ``width`` and ``height`` on screen [px]."""
    width, height = struct.unpack(">II", picture.png[16:24])
    return {
        "source": "data:image/png;base64," + base64.b64encode(picture.png).decode("ascii"),
        "width": round(width / _PIXELS_PER_CSS_PIXEL),
        "height": round(height / _PIXELS_PER_CSS_PIXEL),
    }


def as_audio(sound: Sound) -> str:
    """Return the WAV as a data URI."""
    return "data:audio/wav;base64," + base64.b64encode(sound.wav).decode("ascii")


_KINDS: Mapping[type, str] = {
    str: "texts",
    Picture: "figures",
    Table: "tables",
    Sound: "sounds",
    Step: "steps",
    Link: "links",
}


def _groups(part: Section | Panel) -> Iterator[tuple[str, list[Any]]]:
    """Yield blocks of one kind that follow each other: narrow figures share a row."""
    shown = [
        f"This figure could not be drawn: {block.failure}."
        if isinstance(block, Picture) and block.failure
        else block
        for block in part.blocks
    ]
    for kind, blocks in groupby(shown, key=type):
        yield _KINDS[kind], list(blocks)


def _plain(value: Any) -> Scalar | None:
    """Return a number or a word as JSON has it; None for a number that is not known."""
    plain = value.item() if isinstance(value, np.generic) else value
    if plain is None or (isinstance(plain, float) and not isfinite(plain)):
        return None
    return plain if isinstance(plain, Scalar) else str(plain)


def _headline(value: Scalar | None, unit: str, form: str) -> str:
    """Write a number with its unit, a change with its sign."""
    if value is None:
        return "not known"
    if isinstance(value, str):
        return format(value, form)
    changes = form.startswith("+")
    text = signed(value, int(form[2:-1])) if changes else f"{value:{form}}".replace("-", "−")
    return f"{text} {unit}" if unit not in ("", "1") else text


def _as_data(block: str | Picture | Table | Sound | Step | Link) -> str | Step | AnswerTable | None:
    """Return a block of the first screen as data; None for what is seen and heard alone."""
    if isinstance(block, str | Step):
        return block
    if not isinstance(block, Table):
        return None
    rows = block.frame.astype(object).to_numpy().tolist()
    return AnswerTable(
        columns=tuple(map(str, block.frame.columns)),
        rows=tuple(tuple(map(_plain, row)) for row in rows),
        caption=block.caption,
    )


def _check_png(png: bytes, caption: str) -> None:
    """Refuse bytes that are no PNG."""
    if not png.startswith(_PNG_SIGNATURE):
        raise InputError(f"the picture '{caption}' is not a PNG")


def _paragraphs(texts: Sequence[str]) -> list[str]:
    blocks = (" ".join(b.split()) for text in texts for b in re.split(r"\n\s*\n", text))
    return [block for block in blocks if block]


def _escaped(text: str) -> str:
    """Escape a text for the page; its lines break before or behind ``--option``, not inside."""
    return _OPTION.sub(r'<span class="option">\1</span>', escape(text))


def _facts(provenance: Mapping[str, object]) -> dict[str, str]:
    """Flatten the facts beside command and inputs: one line each, mappings one level down."""
    facts: dict[str, str] = {}
    for name, value in provenance.items():
        if name in ("command", "inputs"):
            continue
        inner = value.items() if isinstance(value, Mapping) else [(name, value)]
        facts.update({_fact_name(str(key)): _fact(item) for key, item in inner})
    return facts


def _fact_name(key: str) -> str:
    return re.sub(r"_s$", " [s]", key).replace("_", " ")


def _fact(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_fact(item)}" for key, item in value.items())
    if value is None:
        return "none"
    return ("yes" if value else "no") if isinstance(value, bool) else str(value)
