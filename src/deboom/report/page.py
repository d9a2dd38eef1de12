"""One self-contained HTML page: text, figures and tables in, a string out."""

from __future__ import annotations

import base64
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from typing import TYPE_CHECKING

from deboom.errors import InputError
from deboom.report.glossary import GLOSSARY
from deboom.report.tables import Column, text_columns

if TYPE_CHECKING:
    import pandas as pd

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_PIXELS_PER_CSS_PIXEL = 1.5
_CONTENTS_FROM = 4  # sections


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure with its words.

    Parameters
    ----------
    png : bytes
        The picture.
    alt : str
        What it shows, for a reader who cannot see it.
    caption : str
        What to see in it.
    """

    png: bytes
    alt: str
    caption: str


@dataclass(frozen=True, eq=False)
class Table:
    """A table with its words.

    Parameters
    ----------
    frame : DataFrame
        Columns ``name [unit]``; the first one names the rows, the index is not shown.
    caption : str
        What to see in it.
    decimals : mapping of str to int
        Decimals by column label, where the unit's default does not serve.
    """

    frame: pd.DataFrame
    caption: str
    decimals: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Headline:
    """One number that a hurried reader takes away.

    Parameters
    ----------
    value : str
        With its unit, such as ``−3.1 dB``.
    label : str
        What it is.
    """

    value: str
    label: str


@dataclass(frozen=True, eq=False)
class Section:
    """A part of the page: paragraphs, then figures, then tables.

    Parameters
    ----------
    title : str
        Heading.
    text : str
        Paragraphs, separated by empty lines.
    figures : tuple of Picture
        Narrow ones share a row.
    tables : tuple of Table
        Below the figures.
    """

    title: str
    text: str
    figures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()


@dataclass(frozen=True, eq=False)
class Page:
    """Everything a page says.

    Parameters
    ----------
    title : str
        Of the page.
    question : str
        What was asked, in one or two sentences.
    sections : tuple of Section
        In reading order.
    headlines : tuple of Headline
        Shown on top.
    terms : tuple of str
        Words of `deboom.report.glossary.GLOSSARY` that the page explains.
    warnings : tuple of str
        What the reader must know before trusting the numbers.
    provenance : mapping of str
        How the numbers came about: ``command`` [text], ``inputs`` [file → SHA-256] and any
        further facts; mappings inside are written out.
    compact : bool
        Print with close spacing, for a sheet that shall fit on one page.
    """

    title: str
    question: str
    sections: tuple[Section, ...]
    headlines: tuple[Headline, ...] = ()
    terms: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    provenance: Mapping[str, object] = field(default_factory=dict)
    compact: bool = False


def render_page(page: Page) -> str:
    """Render the page as one HTML file without scripts, links or outside references.

    Parameters
    ----------
    page : Page
        Its texts are escaped: no input can add markup.

    Returns
    -------
    str
        HTML; save as UTF-8.

    Raises
    ------
    InputError
        An unknown term, a picture that is not a PNG or has no words, or decimals for a column
        that does not exist.
    """
    from jinja2 import Environment, StrictUndefined

    unknown = [term for term in page.terms if term not in GLOSSARY]
    if unknown:
        raise InputError(f"the glossary does not explain {unknown}; it has {list(GLOSSARY)}")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["paragraphs"] = _paragraphs
    environment.filters["columns"] = _columns
    environment.filters["image"] = as_image
    template = environment.from_string(
        files("deboom.report").joinpath("page.html").read_text(encoding="utf-8")
    )
    return template.render(
        page=page,
        terms={term: GLOSSARY[term] for term in page.terms},
        contents=len(page.sections) >= _CONTENTS_FROM,
        command=page.provenance.get("command"),
        inputs=page.provenance.get("inputs") or {},
        facts=_facts(page.provenance),
    )


@dataclass(frozen=True)
class Image:
    """A picture as a page takes it: data URI, width and height [CSS pixel]."""

    source: str
    width: int
    height: int


def as_image(picture: Picture) -> Image:
    """Turn the PNG into a data URI with its size on screen.

    Raises
    ------
    InputError
        No PNG, or one without words.
    """
    if not picture.png.startswith(_PNG_SIGNATURE):
        raise InputError(f"the picture '{picture.caption}' is not a PNG")
    if not picture.alt.strip() or not picture.caption.strip():
        raise InputError("a picture needs an alt text and a caption")
    width, height = struct.unpack(">II", picture.png[16:24])
    return Image(
        source="data:image/png;base64," + base64.b64encode(picture.png).decode("ascii"),
        width=round(width / _PIXELS_PER_CSS_PIXEL),
        height=round(height / _PIXELS_PER_CSS_PIXEL),
    )


def _columns(table: Table) -> tuple[Column, ...]:
    return text_columns(table.frame, table.decimals)


def _paragraphs(text: str) -> list[str]:
    blocks = (" ".join(block.split()) for block in re.split(r"\n\s*\n", text))
    return [block for block in blocks if block]


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
