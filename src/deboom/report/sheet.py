"""Sheets: two pages of A4 that somebody quotes from, signs or files, in one of two languages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from deboom.errors import InputError
from deboom.language import Language
from deboom.plot.style import as_png
from deboom.report.report import Picture, rendered
from deboom.report.tables import Column, split_label, text_columns

if TYPE_CHECKING:
    import pandas as pd

    from deboom.plot.style import Drawing


@dataclass(frozen=True, eq=False)
class Grid:
    """A table: columns as text, caption, and what stood in a cell before, by row and column."""

    columns: tuple[Column, ...]
    caption: str
    before: Mapping[tuple[int, int], str]


class Sheet:
    """A sheet, written top to bottom.

    Parameters
    ----------
    title, subtitle : str
        Head of the first page.
    language : Language
        Numbers have a decimal comma in German.

    Examples
    --------
    >>> sheet = Sheet("Mount TSM", "Dynamic stiffness")
    >>> sheet.fields({"Drawing": "A 123", "Revision": ""})
    >>> sheet.section("Test", "Measure each part once.")
    >>> "to be agreed" in sheet.html()
    True
    """

    def __init__(self, title: str, subtitle: str = "", language: Language = Language.en) -> None:
        self.title, self.subtitle, self.language = title, subtitle, language
        self.foot = ""
        self.blocks: list[tuple[str, object]] = []

    def number(self, value: float, decimals: int, unit: str = "") -> str:
        """Write a number with its unit for a sentence."""
        text = f"{value:.{decimals}f}".replace("-", "−")
        return f"{self.local(text)} {unit}".strip()

    def fields(self, pairs: Mapping[str, str]) -> None:
        """Show labels with values; where a value is empty, it is to be agreed."""
        due = self.language.say("to be agreed", "noch zu vereinbaren")
        self.blocks.append(("fields", {label: value or due for label, value in pairs.items()}))

    def section(self, title: str, text: str = "") -> None:
        """Begin a part with its heading and first paragraph."""
        self.blocks.append(("heading", title))
        self.text(text)

    def text(self, text: str) -> None:
        """Write a paragraph; nothing if it is empty."""
        if text:
            self.blocks.append(("text", text))

    def table(
        self,
        frame: pd.DataFrame,
        caption: str = "",
        decimals: Mapping[str, int] | None = None,
        before: Mapping[tuple[int, str], str] | None = None,
    ) -> None:
        """Show a table, and in its cells what stood there before.

        - `frame`: columns ``name [unit]``, of which the unit 1 is shown, too; `decimals`: by column
          label.
        - `caption`: what to see in it.
        - `before`: number of the row from 0 and column label → former value as text.
        """
        columns = tuple(
            Column(
                c.name,
                split_label(str(label))[1],
                c.numeric,
                tuple(map(self.local, c.cells)) if c.numeric else c.cells,
            )
            for label, c in zip(frame, text_columns(frame, decimals or {}), strict=True)
        )
        labels = list(frame.columns)
        moved = {
            (row, labels.index(label)): was
            for (row, label), was in (before or {}).items()
            if label in labels
        }
        self.blocks.append(("table", Grid(columns, caption, moved)))

    def rules(self, rules: Sequence[str]) -> None:
        """Write sentences with numbers, which others may refer to."""
        if rules:
            self.blocks.append(("rules", tuple(rules)))

    def figure(self, drawing: Drawing, caption: str, *, aside: bool = False) -> None:
        """Show a figure of `deboom.plot`, which is closed afterwards; it needs a caption.

        - `aside`: small, on the right of the paragraphs that follow.
        """
        if not caption.strip():
            raise InputError("a picture needs a caption")
        picture = Picture(as_png(drawing), caption, caption)
        self.blocks.append(("aside" if aside else "figure", picture))

    def signatures(self, *parties: str) -> None:
        """Leave room for date and signature of each party."""
        self.blocks.append(("signatures", parties))

    def new_page(self) -> None:
        """Go on with the next page."""
        self.blocks.append(("page", ""))

    def html(self) -> str:
        """Render the sheet as one HTML file without scripts, links or outside references."""
        return rendered("sheet.html", sheet=self, was=self.language.say("was", "vorher"))

    def local(self, number: str | float) -> str:
        """Write a number with the decimal sign of the language."""
        return self.language.local(number if isinstance(number, str) else f"{number:.4g}")
