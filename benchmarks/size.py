"""Size of each package and what makes code hard to read, counted (``make size``).

Code lines hold a token that is neither comment nor docstring; blank lines count nowhere. Tests
count to the package that their file name has first; the others are tests of the whole. No limit of
lines steers the code. The counts below the table are meant to fall: identifiers that name nothing,
words of a house, starred tuples, long functions that compute, word and decide at once, and pinned
lines.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PINS = ROOT / "tests" / "golden" / "pages"
SOURCES = ("src", "studies")
TOPS = (*SOURCES, "tests", "benchmarks")
COLUMNS = ("files", "code", "docstrings")
EMPTY_NAMES = {"found", "asked", "known", "own", "one", "there"}
HOUSE = re.compile(r"\b(?:houses?|rooms?|doors?|faces?|walk(?:s|ed|ing)?)\b", re.IGNORECASE)
PLAIN_SENSE = re.compile(
    r"room (?:for|is left|to a limit|below|between)|(?:no|has|have|is|with|quiet) room|`room`|"
    r"face shares?|(?:mounting|upper|lower|each) face|(?:front|rear|of) doors|doors and seals",
    re.IGNORECASE,
)
"""Senses that stay: space that is left, faces of a body or box, doors of a vehicle."""
LONG_FUNCTION = 60  # code lines, without docstring
LONG_ON_PURPOSE = {
    "compiled loops: a call would cost more than it says": ("compiled_loops.py: *",),
    "writes the files of one folder, one after the other": (
        "campaign_writer.py: _campaign_file",
        "compressor_writer.py: write_operation",
        "electric_car_writer.py: write_electric_car",
        "platform_writer.py: _write_files",
        "vehicle_writer.py: _write_files",
    ),
    "draws one picture, from axes to legend": (
        "bars.py: stiffness_bars",
        "correlations.py: scatter_matrix",
        "fronts.py: pareto_front",
        "matrices.py: curve_matrix",
        "modal.py: stabilisation_chart",
    ),
    "one computation whose steps share their arrays": (
        "numbers.py: _state",
        "operating_run.py: drive",
        "hose_identification.py: _fit",
        "identify.py: identify",
        "modal.py: modal_model",
        "self_calibration.py: _equations",
        "coupled_motion.py: coupled_motion",
        "platform_uncertainty.py: force_sources",
        "surrogate.py: surrogate_search",
        "search.py: search",
        "unbalance.py: unbalance",
    ),
    "writes one page, section after section": (
        "comparison.py: comparison_report",
        "page.py: sheet_page",
        "sensitivity.py: sensitivity_report",
        "u06_platform.py: run",
        "unbalance.py: unbalance_report",
    ),
    "words of two languages, side by side": ("rules.py: acceptance_rules",),
    "declares the options of a command": ("cli_results.py: report",),
    "reads one file from its first key to its last": ("vehicle.py: read_vehicle",),
}
"""Long functions that read better whole, by reason; the others are to be divided."""
IDLE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


def lines(path: Path) -> tuple[int, int]:
    """Return the code lines and the docstring lines of a module."""
    text = path.read_text(encoding="utf-8")
    docs: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and isinstance(getattr(first.value, "value", None), str):
                docs.update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in IDLE:
            code.update(range(token.start[0], token.end[0] + 1))
    return len(code - docs), len(docs)


def package_of(path: Path) -> str:
    """Return the package of a module, or its top folder."""
    parts = path.relative_to(ROOT).parts
    if parts[0] != "src":
        return parts[0]
    return parts[2] if len(parts) > 3 else "command line"


def sizes() -> tuple[dict[str, dict[str, int]], dict[str, int]]:
    """Return files, code and docstring lines of every package, and the test lines of each."""
    packages: dict[str, dict[str, int]] = {}
    tests: dict[str, int] = defaultdict(int)
    names = {path.name for path in (ROOT / "src" / "deboom").iterdir() if path.is_dir()}
    for top in TOPS:
        for path in sorted((ROOT / top).rglob("*.py")):
            code, docs = lines(path)
            start = {**dict.fromkeys(COLUMNS, 0), "largest": 0}
            package = packages.setdefault(package_of(path), start)
            for column, size in zip(COLUMNS, (1, code, docs), strict=True):
                package[column] += size
            package["largest"] = max(package["largest"], code)
            if top == "tests":
                tests[next((n for n in path.stem.split("_") if n in names), "whole")] += code
    return packages, tests


def modules(*tops: str) -> Iterator[tuple[Path, ast.Module]]:
    """Yield each module below some folders, parsed."""
    for top in tops:
        for path in sorted((ROOT / top).rglob("*.py")):
            yield path.relative_to(ROOT), ast.parse(path.read_text(encoding="utf-8"))


def identifiers(tree: ast.Module) -> Iterator[str]:
    """Yield each name, argument, attribute, keyword, function and class of a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.arg | ast.keyword):
            yield node.arg or ""
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name


def starred_tuples(tree: ast.Module) -> int:
    """Count tuples and lists that are written out only to be unpacked."""
    return sum(
        isinstance(node, ast.Starred) and isinstance(node.value, ast.Tuple | ast.List)
        for node in ast.walk(tree)
    )


def long_functions(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield lines and name of functions beyond `LONG_FUNCTION`, the longest of a module first."""
    longest = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            text = ast.get_docstring(node) or ""
            size = (node.end_lineno or node.lineno) - node.lineno + 1 - len(text.splitlines())
            if size > LONG_FUNCTION:
                longest.append((size, node.name))
    yield from sorted(longest, reverse=True)


def empty_names() -> Counter[str]:
    """Count the identifiers of `EMPTY_NAMES` in all code, tests included."""
    return Counter(
        name for _, tree in modules(*TOPS) for name in identifiers(tree) if name in EMPTY_NAMES
    )


def texts() -> Iterator[tuple[Path, str]]:
    """Yield what people read: documents, docstrings, sentences of the code, and pages."""
    documents = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    for path in sorted([*documents, *(ROOT / "src").rglob("*.html")]):
        yield path.relative_to(ROOT), path.read_text(encoding="utf-8")
    for path, tree in modules(*SOURCES):
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield path, node.value


def house_words() -> Iterator[str]:
    """Yield file and word of each word of a house that has no plain sense."""
    for path, text in texts():
        for word in HOUSE.findall(PLAIN_SENSE.sub("", " ".join(text.split()))):
            yield f"{path}: {word}"


def main() -> None:
    """Print the table of sizes and the counts."""
    packages, tests = sizes()
    columns = (*COLUMNS, "largest")
    print(f"{'package':14}" + "".join(f"{column:>12}" for column in columns) + f"{'tests':>8}")
    for name, package in packages.items():
        cells = "".join(f"{package[column]:12}" for column in columns)
        print(f"{name:14}{cells}{tests.get(name, 0) or '':>8}")
    source = [package for name, package in packages.items() if name not in ("tests", "benchmarks")]
    total = {column: sum(package[column] for package in source) for column in COLUMNS}
    print("src and studies: " + ", ".join(f"{column} {size}" for column, size in total.items()))
    names = empty_names()
    print("names that name nothing: " + (", ".join(f"{n} {c}" for n, c in names.items()) or "none"))
    words = list(house_words())
    print("words of a house: " + (", ".join(words) or "none"))
    print(f"starred tuples: {sum(starred_tuples(tree) for _, tree in modules(*TOPS))}")
    whole = [name for names in LONG_ON_PURPOSE.values() for name in names]
    divide = []
    for path, tree in modules(*SOURCES):
        for size, name in long_functions(tree):
            if not any(fnmatch(f"{path.name}: {name}", pattern) for pattern in whole):
                divide.append(f"  {size:4} {path}: {name}")
    print(f"functions beyond {LONG_FUNCTION} lines that are not long on purpose: {len(divide)}")
    print(*divide, sep="\n", end="\n" if divide else "")
    pins = [len(path.read_text("utf-8").splitlines()) for path in PINS.glob("*.txt")]
    print(f"pinned lines of {len(pins)} runs, pages and sets of pictures: {sum(pins)}")


if __name__ == "__main__":
    main()
