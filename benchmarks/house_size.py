"""Size of the house per room, against limits that only ever fall (``make size``).

Code lines hold a token that is neither comment nor docstring; blank lines count nowhere. Tests
count to the room that their file name has first; the others are tests of the whole.
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import sys
import tokenize
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LIMITS = Path(__file__).with_suffix(".toml")
COLUMNS = ("files", "code", "docstrings")
NOTE = """\
# Limits of the house, in files and lines per room; `largest` is the largest module. They only fall:
# `python benchmarks/house_size.py --lower` after a room has shrunk.

"""
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


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--lower", action="store_true", help="lower the limits to what is there")
    options = parser.parse_args()
    rooms, tests = measured()
    limits = tomllib.loads(LIMITS.read_text(encoding="utf-8"))
    columns = (*COLUMNS, "largest")
    print(f"{'room':14}" + "".join(f"{c:>11}{'limit':>7}" for c in columns) + f"{'tests':>8}")
    over = []
    for name, room in rooms.items():
        limit = limits.get(name, dict.fromkeys(columns, 0))
        cells = "".join(f"{room[c]:11}{limit[c]:7}" for c in columns)
        print(f"{name:14}{cells}{tests.get(name, 0) or '':>8}")
        over += [
            f"{name}: {c} {room[c]}, {limit[c]} allowed" for c in columns if room[c] > limit[c]
        ]
    source = [room for name, room in rooms.items() if name not in ("tests", "benchmarks")]
    total = {c: sum(room[c] for room in source) for c in COLUMNS}
    print("src and studies: " + ", ".join(f"{c} {size}" for c, size in total.items()))
    if options.lower:
        limits = {
            name: {c: min(room[c], limits.get(name, room)[c]) for c in columns}
            for name, room in rooms.items()
        }
        text = "".join(
            f"[{json.dumps(name)}]\n" + "".join(f"{c} = {v}\n" for c, v in limit.items()) + "\n"
            for name, limit in limits.items()
        )
        LIMITS.write_text(NOTE + text.rstrip("\n") + "\n", encoding="utf-8")
        return 0
    print("\n".join(over) or "no room exceeds its limit")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
