"""Look for barriers on every kind of page with axe-core: ``make accessibility``.

A short front study is run; its report, its interactive page and its sheets for suppliers are opened
in Chromium at 1440 and at 400 px, beside the sheets of the sensitivity study that a clone has. The
table has the findings of axe and the texts with too little contrast. axe leaves the contrast of
texts open that are drawn in pictures or scrolled out of sight: `Browser.contrasts` measures all.

npm fetches axe-core, in the version below, and checks what it got; no page contains any of it.
"""

import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

import pandas as pd

from deboom.runs.interactive_page import write_interactive_page
from deboom.runs.runner import load_study, run_study
from deboom.runs.supplier_sheets import supplier_sheets

ROOT = Path(__file__).parents[1]
sys.path.append(str(ROOT / "tests"))

from browser_samples import Browser  # noqa: E402

AXE = "axe-core@4.14.1"
WIDTHS = (1440, 400)
"""Of a desk and of a phone [px]."""
BUDGET = {"generations": 2, "population": 12, "samples": 16, "checks": 128, "with_": "prescribed"}
SENSITIVITIES = ROOT / "results" / "sensitivity" / "example"
LONGEST = 120.0
"""Wait for one page [s]."""
RUN = """
window.found = null
axe.run(document, { resultTypes: ["violations"] }).then((result) => {
  window.found = result.violations.flatMap((rule) =>
    rule.nodes.map((node) => `${rule.id}: ${node.target.join(" ")}`))
})
0
"""


def main() -> int:
    """Print findings and texts of low contrast of every page; 1 if there are any."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        axe, rows, found = _axe(folder), [], []
        browser = Browser()
        try:
            for page in _pages(folder):
                for width in WIDTHS:
                    browser.open(page, width)
                    browser.wait("typeof live === 'undefined' || live.session.band?.fresh", LONGEST)
                    browser.value(axe + ";0")
                    browser.value(RUN)
                    browser.wait("window.found !== null", LONGEST)
                    findings = browser.value("window.found")
                    texts, low = browser.contrasts()
                    row = {"page": page.name, "width [px]": width, "findings": len(findings)}
                    rows.append(row | {"texts": texts, "low contrast": len(low)})
                    found += [f"{page.name}, {width} px: {each}" for each in (*findings, *low)]
        finally:
            browser.close()
    print(pd.DataFrame(rows).to_string(index=False))
    print("\n".join(found))
    return int(bool(found))


def _axe(folder: Path) -> str:
    """Return the script of axe-core from its package."""
    command = ["npm", "pack", AXE, "--silent", "--pack-destination", str(folder)]
    packed = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()[-1]
    with tarfile.open(folder / packed) as archive:
        script = archive.extractfile("package/axe.min.js")
        assert script is not None
        return script.read().decode()


def _pages(folder: Path) -> list[Path]:
    """Make a page of every kind."""
    front = run_study(load_study(ROOT / "studies" / "front.py"), folder / "results", BUDGET)
    sheets = [
        *supplier_sheets(front, mount="EnM", out=folder / "sheets").files,
        *supplier_sheets(SENSITIVITIES, mount="TSM", out=folder / "sheets").files,
    ]
    live = write_interactive_page(front, studies=None)
    return [front / "report.html", live, *(path for path in sheets if path.suffix == ".html")]


if __name__ == "__main__":
    sys.exit(main())
