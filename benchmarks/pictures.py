"""Make again what README and guides show: ``make pictures``.

Pictures, the run in results/, and what pages say that guides quote: ``tests/golden/quoted``.
"""

import contextlib
import json
import re
import shutil
import sys
import tempfile
import time
from html import unescape
from pathlib import Path

from deboom.bench.compressor_writer import write_operating_test
from deboom.bench.example import DATA
from deboom.language import Language
from deboom.runs.interactive_page import write_interactive_page
from deboom.runs.runner import load_study, run_study
from deboom.runs.supplier_sheets import supplier_sheets
from deboom.supplier.sources import SheetFiles

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))

from browser_samples import Browser  # noqa: E402

PLATFORM = ROOT / "studies" / "data" / "u06_f39_f45"
PARTS = DATA / "delivered_parts.csv"
EXAMPLE = ROOT / "results" / "sensitivity" / "example"
QUOTED = ROOT / "tests" / "golden" / "quoted"
SCREEN, A4, NUMBERED_SHEET = (1440, 900), (820, 1160), (820, 1250)
"""Width and height of photographed pages [px]."""
PAINTED_S = 5.0
"""Wait until a page has computed what it shows [s]."""
NUMBERED = (
    "h1",
    "dl div:first-child",
    "table th:nth-child(2)",
    "table th:nth-child(3)",
    "table th:nth-child(7)",
    "main > div:nth-of-type(2) th:nth-child(2)",
    "main > div:nth-of-type(2) th:nth-child(6)",
    "main > div:nth-of-type(2) th:nth-child(10)",
    "main > div:nth-of-type(2) th:nth-child(11)",
    "figure.aside img",
    "figure:not(.aside) img",
    "main > div:nth-of-type(4) th:nth-child(7)",
)
"""Parts of a sheet that the guides for mount suppliers explain, in the order of their list."""
NUMBER = """
(selectors => selectors.forEach((selector, k) => {
  const place = document.querySelector(selector).getBoundingClientRect()
  const badge = document.createElement("b")
  badge.textContent = k + 1
  badge.style.cssText = `position:absolute;left:${place.left + scrollX - 9}px;` +
    `top:${place.top + scrollY - 9}px;width:20px;height:20px;border-radius:10px;color:white;` +
    "background:#c55a11;font:bold 12px/20px sans-serif;text-align:center"
  document.body.append(badge)
}))(%s)
"""
"""Script that puts a number on each part of a sheet."""
PICTURES = {
    "spl_curves": "spl_curves",
    "pareto_front": "pareto_front",
    "stiffness_bars": "stiffness_bars",
    "sensitivity_sobol": "sobol",
}
"""Figures of a run that README and guides show, and their names there."""


def main() -> None:
    """Run the study with its default budget, and copy its best figures."""
    target = ROOT / "docs" / "pictures"
    target.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path("results")  # commands on the pages name it, as a user's do
        _finished_run(folder)
        front = run_study(load_study(ROOT / "studies" / "front.py"), folder, {"seed": 1})
        for stem, name in PICTURES.items():
            _keep(front, stem, target, name)
        box = run_study(load_study(ROOT / "studies/solution_box.py"), folder, {"front": front})
        _keep(box, "box", target, "acceptance_box")
        _first_pages(front, box, target)
        _quote("solution_box", box / "report.html", box / "summary.json")
        files = SheetFiles(box=box)
        sheets = supplier_sheets(front, mount="TSM", files=files, out=folder / "sheet")
        _quote("supplier_sheet", next(p for p in sheets.files if p.suffix == ".html"))
        given = {"box": box, "parts": PARTS, "platform": PLATFORM, "uncertainty": 0.02}
        delivery = run_study(load_study(ROOT / "studies" / "accept.py"), folder, given)
        _keep(delivery, "parts", target, "delivery")
        _quote("accept", delivery / "supplier.html", delivery / "report.html")
        test = write_operating_test(folder / "compressor", 1)
        study = load_study(ROOT / "studies" / "unbalance.py")
        unbalance = run_study(study, folder, {"folder": test})
        _keep(unbalance, "figure_61a_static", target, "unbalance")


def _first_pages(front: Path, box: Path, target: Path) -> None:
    """Photograph what README shows first: a first screen, a sheet, the page that computes."""
    sheets = {}
    for language in Language:
        out = front / f"sheets_{language}"
        files = SheetFiles(box=box)
        written = supplier_sheets(front, mount="TSM", files=files, language=language, out=out)
        sheets[language] = next(path for path in written.files if path.suffix == ".html")
    live = write_interactive_page(front, studies=None)
    pages = (
        ("first_screen", front / "report.html", SCREEN),
        ("supplier_sheet", sheets[Language.en], A4),
        ("live_page", live, SCREEN),
    )
    browser = Browser()
    try:
        for name, page, (width, height) in pages:
            browser.open(page, width, height)
            time.sleep(PAINTED_S)
            (target / f"{name}.png").write_bytes(browser.picture())
            print(target / f"{name}.png")
        for language, name in (
            (Language.en, "supplier_sheet_numbered"),
            (Language.de, "supplier_sheet_numbered_de"),
        ):
            _number_sheet(browser, sheets[language], target / f"{name}.png")
    finally:
        browser.close()


def _number_sheet(browser: Browser, sheet: Path, picture: Path) -> None:
    """Photograph a sheet with a number on each part that the guide explains."""
    browser.open(sheet, *NUMBERED_SHEET)
    browser.value(NUMBER % json.dumps(NUMBERED))
    picture.write_bytes(browser.picture())
    print(picture)


def _finished_run(folder: Path) -> None:
    """Make the small finished run that a clone can open, under a name that stays."""
    options = {"seed": 1, "n": 256, "pairs": True}
    folder = folder.resolve()
    with contextlib.chdir(ROOT):  # a record names its files from here, and a clone has them here
        run = run_study(load_study(ROOT / "studies" / "sensitivity.py"), folder, options)
    if EXAMPLE.exists():
        shutil.rmtree(EXAMPLE)
    shutil.copytree(run, EXAMPLE)
    print(EXAMPLE)


def _quote(name: str, *files: Path) -> None:
    """Keep the text of pages that a guide quotes; `tests/unit/test_guides.py` holds the guide."""
    texts = []
    for path in files:
        text = path.read_text(encoding="utf-8").partition('<h2 id="provenance">')[0]
        text = unescape(re.sub(r"(?s)<(script|style)\b.*?</\1>|<[^>]*>", "\n", text))
        texts += [" ".join(line.split()) for line in text.split("\n") if line.strip()]
    QUOTED.mkdir(exist_ok=True)
    (QUOTED / f"{name}.txt").write_text("\n".join(texts) + "\n", encoding="utf-8")


def _keep(run: Path, stem: str, target: Path, name: str) -> None:
    shutil.copyfile(run / "figures" / f"{stem}.png", target / f"{name}.png")
    print(target / f"{name}.png")


if __name__ == "__main__":
    main()
