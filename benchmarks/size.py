"""Print the size of each package, long functions and pinned lines (``make size``).

Code lines hold a token that is neither comment nor docstring; blank lines count nowhere. Tests
count to the package that their file name has first; the others are tests of the whole. The figures
inform; none is a limit, and nothing fails by them.
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PINS = ROOT / "tests" / "golden" / "pages"
SOURCES = ("src", "studies")
TOPS = (*SOURCES, "tests", "benchmarks")
COLUMNS = ("files", "code", "docstrings")
LONG_FUNCTION = 60  # code lines, without docstring
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
    print(f"starred tuples: {sum(starred_tuples(tree) for _, tree in modules(*TOPS))}")
    long = [
        f"  {size:4} {path}: {name}"
        for path, tree in modules(*SOURCES)
        for size, name in long_functions(tree)
    ]
    print(f"functions beyond {LONG_FUNCTION} lines: {len(long)}", *long, sep="\n")
    pins = [len(path.read_text("utf-8").splitlines()) for path in PINS.rglob("*.txt")]
    print(f"pinned lines of {len(pins)} runs, pages and sets of pictures: {sum(pins)}")


if __name__ == "__main__":
    main()
