"""Photograph the first screens of pages, and say which of ten questions they answer.

``python benchmarks/first_screens.py OUT NAME=RUN …`` writes ``OUT/NAME-1440.png`` and
``OUT/NAME-400.png`` of each finished run. NAME is a page of ``tests/ten_questions.toml``, perhaps
with a hyphen and more behind it, as ``front-receivers``.
"""

import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))

import ten_questions  # noqa: E402
from browser_samples import Browser  # noqa: E402

SCREENS = ((1440, 900), (400, 800))
"""Width and height [px]."""
PAINTED_S = 0.3
"""Wait until pictures are decoded [s]."""
SEEN = """
[...document.querySelectorAll(
  "header > *, header li, .panel h2, .panel p, .panel tr, .panel .sounds li, .panel dt"
)].filter(element => element.getBoundingClientRect().top < innerHeight)
  .map(element => element.outerHTML).join(" ")
"""
"""Script that returns what begins above the lower edge of the window."""


def main(out: Path, runs: dict[str, Path]) -> None:
    """Write the pictures, and print a line per page: its length, and what is below the edge."""
    out.mkdir(parents=True, exist_ok=True)
    browser = Browser()
    try:
        for name, run in runs.items():
            answers = ten_questions.PAGES[name.partition("-")[0]]
            asked = {number: text for number, text in answers.items() if isinstance(text, str)}
            facts = []
            for width, height in SCREENS:
                browser.open(run / "report.html", width, height)
                time.sleep(PAINTED_S)
                (out / f"{name}-{width}.png").write_bytes(browser.picture())
                screens = browser.value("document.documentElement.scrollHeight") / height
                below = ten_questions.missing(browser.value(SEEN), asked)
                facts.append(f"{width} px: {screens:.1f} screens, below the edge {below or 'none'}")
            facts.append(f"{browser.printed_pages()} pages on paper")
            print(f"{name}: {len(asked)} questions; {'; '.join(facts)}", flush=True)
    finally:
        browser.close()


if __name__ == "__main__":
    main(
        Path(sys.argv[1]), {n: Path(r) for n, _, r in (arg.partition("=") for arg in sys.argv[2:])}
    )
