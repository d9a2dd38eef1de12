"""Measure every claim again and rewrite docs/validation.md: ``make validate``."""

from __future__ import annotations

import importlib
import pkgutil
import platform
import sys
import time
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from types import ModuleType

import claims
from claims import Claim

PAGE = Path(__file__).parents[1] / "docs" / "validation.md"
HEAD = """# Validation

Every claim beside its measured figure. This page is written by a command; do not edit it:

```
make validate
```

Measured on {date} with Python {python}, {packages}. A claim that does not hold says **no**; the
reason stands in the section's text or in [decisions.md](decisions.md).
"""


def sections() -> list[ModuleType]:
    """Import the modules of claims, in the order of their names."""
    names = sorted(module.name for module in pkgutil.iter_modules(claims.__path__))
    return [importlib.import_module(f"claims.{name}") for name in names]


def section_text(module: ModuleType, rows: list[Claim], seconds: float) -> str:
    """Write one section: title, text, table, and the command that gives it."""
    title, _, text = (module.__doc__ or module.__name__).partition("\n")
    lines = [f"## {title.rstrip('.')}", ""]
    if text.strip():
        lines += [text.strip(), ""]
    lines += ["| claim | asked | measured | holds |", "|---|---|---|---|"]
    lines += [
        f"| {_cell(row.topic)} | {_cell(row.asked)} | {_cell(row.measured)} | "
        f"{'yes' if row.holds else '**no**'} |"
        for row in rows
    ]
    name = module.__name__.removeprefix("claims.")
    lines += ["", f"`python benchmarks/validate.py {name}` ({seconds:.0f} s)", ""]
    return "\n".join(lines)


def _cell(text: str) -> str:
    """Escape the bars of a cell, as in |K|, which would end it."""
    return text.replace("|", "\\|")


def main(wanted: list[str]) -> None:
    """Run the wanted sections, or all and rewrite the page."""
    texts = []
    for module in sections():
        name = module.__name__.removeprefix("claims.")
        if wanted and name not in wanted:
            continue
        print(f"{name} ...", file=sys.stderr, flush=True)
        begin = time.perf_counter()
        rows = module.claims()
        texts.append(section_text(module, rows, time.perf_counter() - begin))
    if wanted:
        print("\n".join(texts))
        return
    packages = ", ".join(
        f"{name} {metadata.version(name)}" for name in ("numpy", "scipy", "pymoo", "scikit-learn")
    )
    head = HEAD.format(
        date=f"{datetime.now(UTC):%Y-%m-%d}", python=platform.python_version(), packages=packages
    )
    PAGE.write_text("\n".join([head, *texts]), encoding="utf-8", newline="\n")
    print(PAGE)


if __name__ == "__main__":
    main(sys.argv[1:])
