"""The page of a study that does not write its own `deboom.report.Report` yet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from deboom.report.report import Picture, Report, Table, as_image

__all__ = ["Headline", "Page", "Picture", "Section", "Table", "as_image", "render_page"]


@dataclass(frozen=True, eq=False)
class Headline:
    """One number that a hurried reader takes away, with its unit, and what it is."""

    value: str
    label: str


@dataclass(frozen=True, eq=False)
class Section:
    """A part of the page: paragraphs, then figures, then tables."""

    title: str
    text: str
    figures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()


@dataclass(frozen=True, eq=False)
class Page:
    """Everything a page says."""

    title: str
    question: str
    sections: tuple[Section, ...]
    headlines: tuple[Headline, ...] = ()
    terms: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    provenance: Mapping[str, object] = field(default_factory=dict)
    compact: bool = False


def report_of(page: Page) -> Report:
    """Return the report of a page: its sections without any file."""
    report = Report(page.title, page.question, compact=page.compact)
    for headline in page.headlines:
        report.tile(headline.value, headline.label)
    report.explain(*page.terms)
    report.warn(*page.warnings)
    for section in page.sections:
        report.section(section.title, section.text)
        for picture in section.figures:
            report.figure(None, picture.png, picture.caption, alt=picture.alt)
        for table in section.tables:
            report.table(None, table.frame, table.caption, table.decimals)
    return report


def render_page(page: Page) -> str:
    """Render the page as one HTML file; see `deboom.report.Report.html`."""
    return report_of(page).html(page.provenance)
