"""Follow every link inside the built documentation site: its file and its anchor exist."""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


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
            elif parts.fragment and page_ids and unquote(parts.fragment) not in page_ids.anchors:
                faults.append(f"{path.relative_to(site)}: {link} is no anchor")
    return faults


if __name__ == "__main__":
    folder = Path(sys.argv[1]).resolve()
    faults = broken(folder)
    print("\n".join(faults) or "all links inside the site lead somewhere")
    sys.exit(bool(faults))
