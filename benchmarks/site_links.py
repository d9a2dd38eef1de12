"""Follow every link inside the built documentation site, and search it for words of the field.

Every file and anchor exists, and the search of the site finds what an engineer would type.
"""

from __future__ import annotations

import json
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

SOUGHT = (
    "unbalance",
    "mount stiffness",
    "Pareto",
    "acceptance box",
    "modeFRONTIER",
    "licence",
    "license",
    "supplier sheet",
)
"""What is typed into the search of the site."""


class Page(HTMLParser):
    """Links and anchors of one page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, _tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep what a tag points to and what it is called."""
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.links.append(value)
            elif name in ("id", "name") and value:
                self.anchors.add(value)


def broken(site: Path) -> list[str]:
    """Return a line per link that leads nowhere."""
    pages = {
        path: Page(path) for path in sorted(site.rglob("*.html")) if "_static" not in path.parts
    }
    faults = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            page_ids = pages.get(target)
            if not target.exists():
                faults.append(f"{path.relative_to(site)}: {link} is no file")
            elif "_modules" in path.parts:  # names a re-exported object by its module, not its page
                continue
            elif parts.fragment and page_ids and unquote(parts.fragment) not in page_ids.anchors:
                faults.append(f"{path.relative_to(site)}: {link} is no anchor")
    return faults


def not_found(site: Path) -> list[str]:
    """Return a line per word of `SOUGHT` that the search of the site knows no page for."""
    from sphinx.search.en import SearchEnglish

    text = (site / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(text[text.index("{") : text.rindex("}") + 1])
    stem = SearchEnglish({}).stem
    faults = []
    for words in SOUGHT:
        pages = [pages_of(index, stem(word)) for word in words.lower().split()]
        if not set.intersection(*pages):
            faults.append(f"search: '{words}' is on no page")
    return faults


def pages_of(index: dict[str, Any], stem: str) -> set[int]:
    """Return the numbers of the pages that hold a stem, in their text or their title."""
    pages_with = set[int]()
    for kind in ("terms", "titleterms"):
        pages = index[kind].get(stem, [])
        pages_with.update(pages if isinstance(pages, list) else [pages])
    return pages_with


if __name__ == "__main__":
    folder = Path(sys.argv[1]).resolve()
    faults = broken(folder) + not_found(folder)
    print(
        "\n".join(faults) or "all links lead somewhere, and the search finds the words of the field"
    )
    sys.exit(bool(faults))
