"""What finished runs say: the words of each page, and two numbers for each column of each table.

A page is pinned as text in `tests/golden/pages`, so that a change of it is read as a difference.
`DEBOOM_PIN=1 make test` writes the pages anew; do so only when a change is meant, and say in the
changelog why.
"""

import json
import os
import re
from html import unescape
from itertools import zip_longest
from pathlib import Path
from zlib import crc32

import numpy as np
import pandas as pd

PAGES = Path(__file__).parent / "golden" / "pages"
NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
PASSING = re.compile(
    r"(\d+(?:\.\d+)? s\b|\d{4}-\d\d-\d\d\w*|(?<![\w.])[0-9a-f]{12,}|(?<![\w.])/\S+|.*seconds.*)"
)
"""Seconds, dates, hashes and paths, which differ from run to run."""


def hold(folder, name):
    """Compare a run, or one page, with what was pinned; write it where that is asked for."""
    said, path = pinned_text(Path(folder)), PAGES / f"{name}.txt"
    if os.environ.get("DEBOOM_PIN"):
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join(said) + "\n", encoding="utf-8")
    lines = path.read_text(encoding="utf-8").split("\n")[:-1]
    for number, (line, pinned) in enumerate(zip_longest(said, lines, fillvalue=""), 1):
        same = line == pinned or (
            NUMBER.sub("#", line) == NUMBER.sub("#", pinned)
            and all(map(_equal, NUMBER.findall(line), NUMBER.findall(pinned)))
        )
        assert same, f"{path.name}, line {number}: {line!r} was {pinned!r}"


def pinned_text(folder):
    """Return the lines of a run: its files, what its record says, its tables, texts and page."""
    files = [folder] if folder.is_file() else sorted(folder.rglob("*"))
    lines = [f"== {p.relative_to(folder).as_posix()}" for p in files if "." in p.name]
    for path in files:
        if path.suffix in (".csv", ".html", ".json") and "evaluations" not in path.parts:
            lines.append(f"== {path.name}")
        if path.name == "run.json":
            record = json.loads(path.read_text(encoding="utf-8"))
            lines += [f"{name}: {fact}" for name, fact in record["facts"].items()]
            lines += [f"read {name}" for name in sorted({*map(_last, record["inputs_sha256"])})]
        elif path.suffix == ".csv":
            lines += _columns(pd.read_csv(path))
        elif path.suffix in (".html", ".json") and "evaluations" not in path.parts:
            text = path.read_text(encoding="utf-8").partition('<h2 id="provenance">')[0]
            text = re.sub(r"(?s)<(script|style)\b.*?</\1>|<[^>]*>", "\n", text)
            lines += PASSING.sub("…", unescape(text)).split("\n")
    return [short for line in lines if (short := " ".join(line.split()))]


def _last(path):
    return path.rpartition("/")[2]


def _columns(table):
    """Yield a line for each column: how large its numbers are, and where the large ones stand."""
    for name, column in table.items():
        if "[s]" in name:
            continue
        if column.dtype.kind not in "fiu":
            said = PASSING.sub("…", " ".join(map(str, column)))
            yield f"{name}: {column.size} words, {crc32(said.encode()):x}"
            continue
        values = np.nan_to_num(column.to_numpy(float)) + 0.0
        size = np.linalg.norm(values)
        place = 1.0 + np.cos(np.arange(values.size)) @ values / max(size, 1e-12)
        yield f"{name}: {values.size} numbers, {size:.6g}, {place:.5f}"


def _equal(one, other):
    """Say whether two numbers agree to their last digit but one step, as rounding has it."""
    decimals = len(one.partition("e")[0].partition(".")[2])
    exponent = float(f"1e{one.partition('e')[2] or 0}")
    first, second = (float(text.replace("−", "-")) for text in (one, other))
    step = 1.001 * exponent * 10.0**-decimals
    return abs(first - second) <= max(step, 1e-6 * abs(second), 1e-12)
