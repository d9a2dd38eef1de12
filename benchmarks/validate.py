"""Measure claims again and write docs/validation.md: ``make validate``, or some of its sections.

``python benchmarks/validate.py mounts robust`` measures the section ``robust`` and all that rest
on the package ``mounts``; ``--mark`` measures nothing and marks what was measured on older sources.
``DRAWS=4`` takes four times as many draws. Every section is written as soon as it is measured.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import importlib
import io
import json
import re
import resource
import sys
import time
import tokenize
import traceback
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path

from claims import Claim

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "validation.md"
CLAIMS = ROOT / "benchmarks" / "claims"
HEAD = """# Validation

Every claim beside its measured figure. This page is written by a command; do not edit it:

```
make validate
```

What follows from an equation is not listed here; tests check it. A claim that fails says **no**;
the reason is in the text of its section or in [decisions.md](decisions.md). Rows without a claim
are for information; their last column is empty. Random cases are given as median (10th to 90th
percentile of at least 20 cases, and the worst if the claim is about all; the shipped case, which
is not among them). Each section ends with its command, its processor time and the hash of the code
behind it, without comments, docstrings and `deboom.plot`; a section that is older than this code
names the modules that have changed since. `DRAWS=4` draws four times as many.
"""
RELIED_ON = """## What you may rely on

Eleven numbers, of virtual cars, benches and compressors whose truth is known. Nothing here was
measured on a real car. A number *of older code* was measured before that code changed.

| in plain words | measured | code |
|---|---|---|
"""
OLDER_CODE = "[of older code](#{})"
PLAIN = (
    ("Of the 90 % intervals that a page states for the change in cars, so many contain it [%]",
     "bodies unknown, cars: held over all families"),
    ("The same in the kind of cars for which the intervals are worst [%]",
     "bodies unknown: held in the family"),
    ("Half width of such an interval for a change of 3 dB of one car, if nothing is known of the "
     "bodies, median of all kinds of cars (the mean of several cars is narrower) [dB]",
     "bodies unknown: median half width"),
    ("Largest error of a synthesised booming peak against the measured sound, median of 20 benches "
     "[dB]", "booming peaks,"),
    ("Error of the dynamic stiffness of an engine mount along x [%]",
     "true error, 3 cylinders, EnM x"),
    ("The same along z [%]", "true error, 3 cylinders, EnM z"),
    ("Error of the blocked forces of a source on trusted lines [%]", "blocked forces and moments"),
    ("Error of the sound that they predict in another car [dB]",
     "sound at the ears of another car"),
    ("Parts inside an acceptance box that keep today's level, in the worst of 20 fleets [%]",
     "20 boxes: parts that keep"),
    ("Error of the static unbalance of a compressor [%]", "mounts as struck, route d: static"),
    ("Mistakes in measurement folders, of 278, that `deboom check` names [%]",
     "mistakes named of 278"),
)  # fmt: skip
"""Sentence for readers, and the beginning of the claim whose first figure it shows."""
PICTURE = ROOT / "docs" / "pictures" / "claimed_against_true.svg"
SHOWN = """
![Stated coverage of intervals, and the share that contains the truth](pictures/{})
"""
COVERAGE = re.compile(r"(\d\d) % (?:intervals?|bands?)|intervals? of (\d\d) %")
"""Stated coverage in a claim on intervals."""
EXPECTED_CHANGE = re.compile(r"bodies .*: held (?:over all|in the)")
"""Claims on the intervals of a change in cars, which are all of 90 %."""
OVERVIEW = """## What holds, and what does not

A section *of older code* shows figures of that code.

| section | claims that hold | claims that do not | without a claim | code |
|---|---|---|---|---|
"""
NO_CLAIM = "no claim"
NAMED = 2
"""How many claims of a section that do not hold stand on the first screen."""
OLDER = "*Measured on older sources"
MEASURED = CLAIMS / "measured.json"
"""Hash of each module that a section rested on when it was measured, by section."""
CHANGED = 6
"""How many changed modules a section names."""
FOOT = re.compile(r"`python benchmarks/validate\.py (\w+)`.*?(?:sources `(\w+)`)?$", re.M)


def section_names() -> list[str]:
    """Return the names of all sections."""
    return sorted(path.stem for path in CLAIMS.glob("[!_]*.py"))


@cache
def code(path: Path) -> str:
    """Return a module's text without comments, docstrings and blank lines."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column]
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                lines[node.lineno - 1 : node.end_lineno] = [""] * (
                    node.end_lineno - node.lineno + 1
                )
    return "\n".join(line.rstrip() for line in lines if line.strip())


@cache
def imported(path: Path) -> tuple[Path, ...]:
    """Return the project's modules that a module imports, and the studies it loads by name."""
    names: set[str] = set()
    studies = {study.stem: study for study in (ROOT / "studies").glob("[!_]*.py")}
    paths: set[Path] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Import(names=aliases):
                names |= {alias.name for alias in aliases}
            case ast.ImportFrom(module=str(module), names=aliases):
                names |= {module, *(f"{module}.{alias.name}" for alias in aliases)}
            case ast.Call(func=ast.Name(id="load_study"), args=[argument, *_]):
                inside = (getattr(part, "value", "") for part in ast.walk(argument))
                stems = {text.removesuffix(".py") for text in inside if isinstance(text, str)}
                paths |= {studies[stem] for stem in stems & studies.keys()}
    for name in names:
        place = name.removeprefix("deboom.studies.").replace(".", "/")
        base = ROOT / "studies" if name.startswith("deboom.studies.") else ROOT / "src"
        for folder in (base, ROOT / "benchmarks", ROOT / "tests"):
            paths |= {p for p in (folder / f"{place}.py", folder / place / "__init__.py")}
    return tuple(sorted(p for p in paths if p.exists()))


def sources(name: str) -> list[Path]:
    """Return every module that a section rests on, its own among them.

    Drawing moves no number, nor does the package's first module, which holds the version.
    """
    seen, waiting = set(), [CLAIMS / f"{name}.py"]
    while waiting:
        path = waiting.pop()
        if path not in seen:
            seen.add(path)
            waiting += [
                p
                for p in imported(path)
                if not p.is_relative_to(ROOT / "src/deboom/plot")
                and p != ROOT / "src/deboom/__init__.py"
            ]
    return sorted(seen)


@cache
def hashes(name: str) -> dict[str, str]:
    """Return the hash of each module that a section rests on, by its path."""
    return {
        path.relative_to(ROOT).as_posix(): hashlib.sha256(code(path).encode()).hexdigest()[:12]
        for path in sources(name)
    }


def fingerprint(modules: dict[str, str]) -> str:
    """Return the hash of the code that a section rests on."""
    return hashlib.sha256(json.dumps(modules, sort_keys=True).encode()).hexdigest()[:12]


def older(name: str, measured: str) -> str:
    """Say that a section is older than its code, and what has changed; nothing of a fresh one."""
    now = hashes(name)
    if measured == fingerprint(now):
        return ""
    then = json.loads(MEASURED.read_text(encoding="utf-8")).get(name, {})
    if measured != fingerprint(then):
        return f"{OLDER}: the code has changed since.*\n\n"
    changed = [path for path in sorted({*then, *now}) if then.get(path) != now.get(path)]
    names = [path.removeprefix("src/deboom/").removesuffix(".py") for path in changed[:CHANGED]]
    more = [f"{len(changed) - CHANGED} more"] if len(changed) > CHANGED else []
    return f"{OLDER}: since then {', '.join([*names, *more])} changed.*\n\n"


def sections_of(page: str) -> dict[str, str]:
    """Split a page into its sections, by name."""
    sections = {}
    for text in re.split(r"^(?=## )", page, flags=re.M)[1:]:
        if foot := FOOT.search(text):
            sections[foot[1]] = f"{text.strip()}\n"
    return sections


def marked(page: str) -> str:
    """Write a page anew, each section that rests on changed code marked, sections in order."""
    texts = []
    kept = sections_of(page)
    rows, older_sections = [], {}
    for name in section_names():
        if name not in kept:
            continue
        title, about = _about(name)
        foot = FOOT.search(kept[name])
        age = older(name, foot[2] if foot else "")
        texts.append(f"## {title}\n\n{age}{about}{kept[name][kept[name].index('| claim |') :]}")
        rows.append(_overview_row(title, kept[name], fresh=not age))
        if age:
            older_sections |= {row[0]: title for row in claims_of(kept[name])}
    rows.append(_total_row("".join(texts)))
    plain = RELIED_ON + "\n".join(plain_rows("".join(texts), older_sections)) + "\n"
    plain += SHOWN.format(PICTURE.name)
    return "\n".join([HEAD, plain, OVERVIEW + "\n".join(rows) + "\n", *texts])


def claims_of(text: str) -> list[tuple[str, str, str, bool]]:
    """Return the rows of sections: claim, bound, measured, and if it holds.

    A row without a claim holds.
    """
    rows = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 4 and (cells[3] in ("yes", "**no**") or cells[1] == NO_CLAIM):
            rows.append((cells[0], cells[1], cells[2], cells[3] != "**no**"))
    return rows


def plain_rows(sections: str, older_sections: dict[str, str]) -> list[str]:
    """Return the numbers that a reader may rely on, of the sections that have been measured.

    - `older_sections`: title of the section of each claim that was measured on older code.
    """
    rows = []
    for sentence, begin in PLAIN:
        measured = [row for row in claims_of(sections) if row[0].startswith(begin)]
        for claim, _, figure, _ in measured[:1]:
            title = older_sections.get(claim)
            age = OLDER_CODE.format(_anchor(title)) if title else ""
            rows.append(f"| {sentence} | {re.split(r'[ ,]', figure)[0]} | {age} |")
    return rows


def coverages(sections: str) -> list[tuple[float, float]]:
    """Return stated and measured coverage [%] of the claims on intervals."""
    pairs = []
    for claim, _, figure, _ in claims_of(sections):
        stated, first = COVERAGE.search(claim), re.match(r"[\d.]+", figure)
        if first and EXPECTED_CHANGE.match(claim):
            pairs.append((90.0, float(first[0])))
        elif stated and first and ("cover" in claim or "truth" in claim or "hold" in claim):
            pairs.append((float(stated[1] or stated[2]), float(first[0])))
    return pairs


def draw_coverages(page: str) -> None:
    """Draw measured over stated coverage into the picture that the page shows."""
    import matplotlib as mpl

    mpl.use("agg")
    mpl.rcParams["svg.hashsalt"] = "deboom"  # the same page, the same bytes
    import matplotlib.pyplot as plt

    pairs = coverages(page)
    _, axes = plt.subplots(figsize=(5.0, 3.6), layout="constrained")
    axes.plot([60, 100], [60, 100], color="0.6", linewidth=1.0, label="as stated")
    axes.plot(*zip(*pairs, strict=True), "o", alpha=0.6, label="measured")
    axes.set(xlabel="stated coverage [%]", ylabel="intervals that contain the truth [%]")
    axes.set(xlim=(60, 100), ylim=(60, 100))
    axes.legend(loc="upper left", frameon=False)
    plt.savefig(PICTURE, metadata={"Date": None})
    plt.close()


def _overview_row(title: str, section: str, *, fresh: bool) -> str:
    """Count the claims of a section that hold, and name those that do not."""
    rows = claims_of(section)
    claims = [row for row in rows if row[1] != NO_CLAIM]
    missed = [claim for claim, _, _, holds in claims if not holds]
    more = [f"and {len(missed) - NAMED} more"] if len(missed) > NAMED else []
    cells = (
        f"[{title}](#{_anchor(title)})",
        f"{len(claims) - len(missed)} of {len(claims)}",
        "; ".join(missed[:NAMED] + more),
        str(len(rows) - len(claims) or ""),
        "" if fresh else "of older code",
    )
    return f"| {' | '.join(cells)} |"


def _total_row(sections: str) -> str:
    """Count the claims of all sections that hold."""
    rows = claims_of(sections)
    claims = [holds for _, bound, _, holds in rows if bound != NO_CLAIM]
    held = f"{sum(claims)} of {len(claims)}"
    return f"| **all** | {held} | {len(claims) - sum(claims)} | {len(rows) - len(claims)} |  |"


def _anchor(title: str) -> str:
    """Return the name by which pages link to a heading."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def _about(name: str) -> tuple[str, str]:
    """Title and text of a section: the docstring of its module."""
    module = ast.parse((CLAIMS / f"{name}.py").read_text(encoding="utf-8"))
    title, _, text = (ast.get_docstring(module) or "").partition("\n")
    return title.rstrip("."), f"{text.strip()}\n\n" if text.strip() else ""


def section_text(name: str, rows: list[Claim], seconds: float) -> str:
    """Write one section: title, text, table, and where it comes from."""
    title, about = _about(name)
    lines = [f"## {title}\n\n{about}| claim | asked | measured | holds |", "|---|---|---|---|"]
    lines += [
        f"| {_cell(row.topic)} | {_cell(row.bound)} | {_cell(row.measured)} | {_verdict(row)} |"
        for row in rows
    ]
    packages = ", ".join(f"{p} {metadata.version(p)}" for p in ("numpy", "scipy", "pymoo"))
    foot = (
        f"`python benchmarks/validate.py {name}`: {seconds:.0f} s on {datetime.now(UTC):%Y-%m-%d}"
    )
    return "\n".join([*lines, "", f"{foot}, {packages}, sources `{fingerprint(hashes(name))}`", ""])


def _verdict(row: Claim) -> str:
    if row.bound == NO_CLAIM:
        return ""
    return "yes" if row.holds else "**no**"


def _keep_hashes(name: str) -> None:
    """Keep the hashes of the modules that a section has been measured with."""
    kept = {**json.loads(MEASURED.read_text(encoding="utf-8")), name: hashes(name)}
    MEASURED.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _cell(text: str) -> str:
    """Escape the bars of a cell, as in |K|, which would end it."""
    return text.replace("|", "\\|")


def _cpu() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def _wanted(wanted: list[str]) -> Iterator[str]:
    for name in section_names():
        text = (CLAIMS / f"{name}.py").read_text(encoding="utf-8")
        if not wanted or any(
            name_wanted == name or f"deboom.{name_wanted}." in text for name_wanted in wanted
        ):
            yield name


def main() -> int:
    """Measure the wanted sections and write each into the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("wanted", nargs="*", help="sections or packages; all if none is named")
    parser.add_argument("--mark", action="store_true", help="only mark what is older")
    arguments = parser.parse_args()
    page = PAGE.read_text(encoding="utf-8")
    names = [] if arguments.mark else list(_wanted(arguments.wanted))
    failed = []
    begin = time.perf_counter()
    for number, name in enumerate(names, 1):
        print(f"{number} of {len(names)}: {name} ...", file=sys.stderr, flush=True)
        before = _cpu()
        try:
            module = importlib.import_module(f"claims.{name}")
            rows = module.claims()
        except Exception:
            traceback.print_exc()
            failed.append(name)
            continue
        text = section_text(name, rows, _cpu() - before)
        _keep_hashes(name)
        page = marked("\n".join([page, text]))
        PAGE.write_text(page, encoding="utf-8", newline="\n")
        print(text if arguments.wanted else f"{_cpu() - before:.0f} s of processor", flush=True)
    PAGE.write_text(marked(page), encoding="utf-8", newline="\n")
    draw_coverages(marked(page))
    print(f"{PAGE}: {time.perf_counter() - begin:.0f} s, {_cpu():.0f} s of processor")
    if failed:
        print(f"not measured, they failed: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
