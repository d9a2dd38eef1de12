"""Plant single faults in a room and see which its tests let through: ``make mutants ROOM=physics``.

A fault changes one sign, operator, comparison, constant or function. A sample is drawn by a seed;
each mutant runs the tests that reach its line, the quickest first, against a copy of the sources.
A comparison that takes its boundary along (``<`` for ``<=``) is counted apart.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from coverage import CoverageData
from scipy.stats import binomtest
from tqdm import tqdm

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src" / "deboom"
TIME_LIMIT_S = 120.0
"""Wait for the tests of one mutant [s]; a mutant that hangs is caught."""
MOST_TESTS = 25
"""Tests that a mutant is shown to at most, the quickest first."""

OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
COMPARISONS = {ast.Gt: ast.Lt, ast.Lt: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
BOUNDARIES = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
FUNCTIONS = {
    "sin": "cos",
    "cos": "sin",
    "mean": "median",
    "median": "mean",
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "argmin": "argmax",
    "argmax": "argmin",
    "all": "any",
    "any": "all",
}
DROPPED = ("sqrt", "abs", "conj", "arcsin", "log10", "log", "exp")
"""Functions of one argument, or methods of none, that a mutant forgets."""


@dataclass(frozen=True)
class Mutant:
    """One fault: where it is, what it says, and the text of its file."""

    path: Path
    line: int
    change: str
    boundary: bool
    text: str


def changes(node: ast.AST) -> Iterator[tuple[ast.AST, bool]]:
    """Yield what may stand in the place of a node, and whether only a boundary moves."""
    match node:
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            yield ast.BinOp(left, OPERATORS[type(op)](), right), False
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            yield operand, False
        case ast.Compare(left=left, ops=[op], comparators=right):
            for table, boundary in ((COMPARISONS, False), (BOUNDARIES, True)):
                if type(op) in table:
                    yield ast.Compare(left, [table[type(op)]()], right), boundary
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value), False
        case ast.Constant(value=int(value)):
            yield ast.Constant(value + 1), False
        case ast.Constant(value=float(value)) if value:
            yield ast.Constant(1.5 * value), False
        case ast.Call(func=ast.Attribute(value=value, attr=name) as function, args=args):
            if name in FUNCTIONS:
                other = ast.Attribute(value, FUNCTIONS[name], function.ctx)
                yield ast.Call(other, args, node.keywords), False
            elif name in DROPPED and len(args) <= 1 and not node.keywords:
                yield (args[0] if args else value), False


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield every mutant of a file; texts, annotations and messages stay."""
    source = path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    spared: set[int] = set()
    for node in ast.walk(tree):
        parts: list[ast.AST | None] = []
        if isinstance(node, ast.Raise | ast.JoinedStr):
            parts = [node]
        elif isinstance(node, ast.FunctionDef):
            parts = [node.returns, *node.decorator_list]
        elif isinstance(node, ast.ClassDef):
            parts = [*node.decorator_list]
        elif isinstance(node, ast.arg | ast.AnnAssign):
            parts = [node.annotation]
        spared |= {id(inner) for part in parts if part for inner in ast.walk(part)}
    for node in ast.walk(tree):
        if id(node) in spared:
            continue
        for other, boundary in changes(node):
            begin, end = node.lineno, node.end_lineno
            old = ast.get_source_segment(source, node) or ""
            new = f"({ast.unparse(other)})"
            lines = source.encode().splitlines(keepends=True)
            before = b"".join(lines[: begin - 1]) + lines[begin - 1][: node.col_offset]
            after = lines[end - 1][node.end_col_offset :] + b"".join(lines[end:])
            text = (before + new.encode() + after).decode()
            yield Mutant(path, begin, f"{' '.join(old.split())} → {new}", boundary, text)


def tests_by_line(room: str) -> tuple[dict[Path, dict[int, list[str]]], dict[str, float]]:
    """Run the tests of a room once; who reaches which line, and how long each test takes [s]."""
    tests = [p for kind in ("unit", "verification") for p in (ROOT / "tests" / kind).glob("*.py")]
    files = sorted(str(p) for p in tests if f"deboom.{room}" in p.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        data, times = Path(folder) / "coverage", Path(folder) / "times.json"
        environment = {
            **os.environ,
            "COVERAGE_FILE": str(data),
            "MUTANTS_TIMES": str(times),
        }
        command = [sys.executable, "-m", "pytest", "-q", "-p", "mutants_times"]
        command += [f"--cov={SOURCES / room}", "--cov-context=test", "--cov-report="]
        place = Path(folder) / "mutants_times.py"
        place.write_text(TIMES_PLUGIN)
        environment["PYTHONPATH"] = os.pathsep.join(
            [str(ROOT / "src"), folder, environment.get("PYTHONPATH", "")]
        )
        done = subprocess.run([*command, *files], cwd=ROOT, env=environment, check=False)
        if done.returncode:
            sys.exit("the tests of the room fail without any fault")
        seen = CoverageData(str(data))
        seen.read()
        durations = json.loads(times.read_text())
        reached = {
            Path(name): {
                line: sorted(set().union(*(_shown(context, durations) for context in contexts)))
                for line, contexts in seen.contexts_by_lineno(name).items()
            }
            for name in seen.measured_files()
        }
        return reached, durations


def _seen_by(module: dict[int, list[str]], line: int) -> list[str]:
    """Return the tests that reach a line; of a compiled loop, which nobody traces, the module's."""
    return module.get(line) or sorted(set().union(*module.values()))


def _shown(context: str, durations: dict[str, float]) -> set[str]:
    """Return the tests that see a line: all of a file whose fixture reaches it for the first."""
    test, _, phase = context.partition("|")
    if phase != "setup":
        return {test} if test else set()
    file = test.split("::")[0]
    return {name for name in durations if name.startswith(f"{file}::")}


TIMES_PLUGIN = """
import json, os
times = {}
def pytest_runtest_logreport(report):
    times[report.nodeid] = times.get(report.nodeid, 0.0) + report.duration
def pytest_sessionfinish():
    with open(os.environ["MUTANTS_TIMES"], "w") as file:
        json.dump(times, file)
"""


def survives(mutant: Mutant, tests: list[str]) -> bool:
    """Run the tests against a copy of the sources that has the fault."""
    if not tests:
        return True
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "src"
        shutil.copytree(ROOT / "src", copy, ignore=shutil.ignore_patterns("__pycache__"))
        (copy / mutant.path.relative_to(ROOT / "src")).write_text(mutant.text, encoding="utf-8")
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(copy), os.environ.get("PYTHONPATH", "")]),
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
        try:
            done = subprocess.run(
                command, cwd=ROOT, env=environment, capture_output=True, timeout=TIME_LIMIT_S
            )
        except subprocess.TimeoutExpired:
            return False
        return done.returncode == 0


def main() -> None:
    """Draw a sample of mutants of a room, run it and print the survivors and the score."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("room")
    parser.add_argument("--number", type=int, default=150, help="Mutants that are drawn.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    reached, times = tests_by_line(given.room)
    every = [m for path in sorted((SOURCES / given.room).rglob("*.py")) for m in mutants_of(path)]
    drawn = random.Random(given.seed).sample(every, min(given.number, len(every)))
    tests = [
        sorted(_seen_by(reached.get(m.path, {}), m.line), key=lambda t: times.get(t, 9.0))
        for m in drawn
    ]
    with ThreadPoolExecutor(given.jobs) as pool:
        alive = list(
            tqdm(
                pool.map(
                    lambda pair: survives(pair[0], pair[1][:MOST_TESTS]),
                    zip(drawn, tests, strict=True),
                ),
                total=len(drawn),
            )
        )
    for mutant, tried, lives in zip(drawn, tests, alive, strict=True):
        if lives:
            where = f"{mutant.path.relative_to(ROOT)}:{mutant.line}"
            kind = "boundary" if mutant.boundary else f"{len(tried)} tests"
            print(f"survived ({kind}): {where}: {mutant.change}")
    for boundary in (False, True):
        group = [lives for m, lives in zip(drawn, alive, strict=True) if m.boundary == boundary]
        if group:
            killed = len(group) - sum(group)
            low, high = binomtest(killed, len(group)).proportion_ci(0.95, method="wilson")
            what = "boundaries" if boundary else "faults"
            print(
                f"{given.room}: {killed} of {len(group)} {what} caught, "
                f"{100 * killed / len(group):.0f} % (95 %: {100 * low:.0f} to {100 * high:.0f} %)"
            )


if __name__ == "__main__":
    main()
