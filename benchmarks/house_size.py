"""Size of each package (``make size``), for information: no limit of lines steers the code.

Code lines hold a token that is neither comment nor docstring; blank lines count nowhere. Tests
count to the package that their file name has first; the others are tests of the whole.
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = ("files", "code", "docstrings")
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


def room_of(path: Path) -> str:
    """Return the room of a module: its package, or its top folder."""
    parts = path.relative_to(ROOT).parts
    if parts[0] != "src":
        return parts[0]
    return parts[2] if len(parts) > 3 else "face and cli"


def measured() -> tuple[dict[str, dict[str, int]], dict[str, int]]:
    """Return files, code and docstring lines of every room, and the test lines of each."""
    rooms: dict[str, dict[str, int]] = {}
    tests: dict[str, int] = defaultdict(int)
    names = {path.name for path in (ROOT / "src" / "deboom").iterdir() if path.is_dir()}
    for top in ("src", "studies", "tests", "benchmarks"):
        for path in sorted((ROOT / top).rglob("*.py")):
            code, docs = lines(path)
            room = rooms.setdefault(room_of(path), {**dict.fromkeys(COLUMNS, 0), "largest": 0})
            for column, size in zip(COLUMNS, (1, code, docs), strict=True):
                room[column] += size
            room["largest"] = max(room["largest"], code)
            if top == "tests":
                tests[next((n for n in path.stem.split("_") if n in names), "whole")] += code
    return rooms, tests


def main() -> None:
    rooms, tests = measured()
    columns = (*COLUMNS, "largest")
    print(f"{'package':14}" + "".join(f"{column:>12}" for column in columns) + f"{'tests':>8}")
    for name, room in rooms.items():
        cells = "".join(f"{room[column]:12}" for column in columns)
        print(f"{name:14}{cells}{tests.get(name, 0) or '':>8}")
    source = [room for name, room in rooms.items() if name not in ("tests", "benchmarks")]
    total = {column: sum(room[column] for room in source) for column in COLUMNS}
    print("src and studies: " + ", ".join(f"{column} {size}" for column, size in total.items()))


if __name__ == "__main__":
    main()
