"""Plant single faults in rooms and see which the tests let through: ``make mutants ROOM=physics``.

A fault changes one sign, operator, comparison, constant or function. A sample is drawn by a seed.
Which test reaches which line is measured once and kept in ``build/mutants``. Each mutant stands in
a copy of the sources and is shown the tests that reach its line until one fails. A comparison that
takes its boundary along (``<`` for ``<=``) is counted apart.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from coverage import CoverageData
from scipy.stats import binomtest
from tqdm import tqdm

from deboom.files.run_folder import hash_sources

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src" / "deboom"
CACHE = ROOT / "build" / "mutants"
TEST_S, TESTS_S = 15.0, 12.0
"""Time of a test, and recorded time of all tests, that a mutant is shown to at most [s]."""
PATIENCE_S = 60.0
"""Time of a mutant, beside thrice the recorded time of its tests [s]; beyond, it hangs."""

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
        elif isinstance(node, ast.keyword) and node.arg == "strict":
            parts = [node.value]  # lengths that agree by construction
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


PLUGIN = """
import json, os
times = {}
def pytest_runtest_logreport(report):
    times.setdefault(report.nodeid, {})[report.when] = report.duration
    if report.failed:
        times[report.nodeid]["failed"] = True
def pytest_sessionfinish():
    with open(os.environ["MUTANTS_TIMES"], "w") as file:
        json.dump(times, file)
"""


def _measured(coverage: Path) -> dict[str, dict[str, float]]:
    """Run all tests, keep the lines that each reaches, and return the times of each [s]."""
    print("which lines do the tests reach ...", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "mutants_times.py").write_text(PLUGIN)
        environment = {
            **os.environ,
            "COVERAGE_FILE": str(coverage),
            "MUTANTS_TIMES": f"{folder}/times.json",
            "PYTHONPATH": os.pathsep.join([folder, os.environ.get("PYTHONPATH", "")]),
        }
        command = [sys.executable, "-m", "pytest", "-q", "-p", "mutants_times"]
        command += [f"--cov={SOURCES}", "--cov-context=test", "--cov-report="]
        subprocess.run(command, cwd=ROOT, env=environment, check=False)
        times: dict[str, dict[str, float]] = json.loads(Path(f"{folder}/times.json").read_text())
        return times


class Reach:
    """Which tests reach a line, and their times; measured again when sources or tests changed."""

    def __init__(self) -> None:
        CACHE.mkdir(parents=True, exist_ok=True)
        note, kept = CACHE / "tests.json", CACHE / "coverage"
        stamp = [hash_sources(SOURCES), hash_sources(ROOT / "tests")]
        known = json.loads(note.read_text()) if note.exists() else {}
        if known.get("stamp") != stamp:
            known = {"stamp": stamp, "times": _measured(kept)}
            note.write_text(json.dumps(known))
        self.data = CoverageData(str(kept))
        self.data.read()
        self.times = {
            name: phases
            for name, phases in known["times"].items()
            if "failed" not in phases and phases.get("call", 0.0) <= TEST_S
        }
        self.setups: dict[str, float] = defaultdict(float)
        for name, phases in self.times.items():
            file = name.split("::")[0]
            self.setups[file] = max(phases.get("setup", 0.0), self.setups[file])

    def tests(self, mutant: Mutant) -> list[str]:
        """Return the tests of a line, those of a file together, the quickest first.

        What a fixture reaches is seen by all tests of its file. What no test reaches by itself (a
        constant of the module, a compiled loop) is seen by the tests that reach the module.
        """
        module = self.data.contexts_by_lineno(str(mutant.path))
        contexts = {c for c in module.get(mutant.line, ()) if c}
        contexts = contexts or {c for line in module.values() for c in line if c}
        seen = {c.partition("|")[0] for c in contexts if not c.endswith("|setup")}
        fixtures = {c.split("::")[0] for c in contexts if c.endswith("|setup")}
        seen |= {t for t in self.times if t.split("::")[0] in fixtures}
        chosen: list[str] = []
        spent = 0.0
        for test in sorted(seen & self.times.keys(), key=self._cost):
            spent += self.times[test].get("call", 0.0)
            if chosen and spent > TESTS_S:
                break
            chosen.append(test)
        files = list(dict.fromkeys(test.split("::")[0] for test in chosen))
        return sorted(chosen, key=lambda test: files.index(test.split("::")[0]))

    def _cost(self, test: str) -> float:
        return self.times[test].get("call", 0.0) + self.setups[test.split("::")[0]]

    def patience(self, tests: Sequence[str]) -> float:
        """Return the time that some tests may take [s]."""
        setups = sum(self.setups[file] for file in {test.split("::")[0] for test in tests})
        return PATIENCE_S + 3.0 * (setups + sum(self.times[t].get("call", 0.0) for t in tests))


def killer(mutant: Mutant, tests: Sequence[str], patience: float, tree: Path) -> str | None:
    """Return the first test that fails with the mutant in a copy of the sources, or ``hang``."""
    if not tests:
        return None
    place = tree / mutant.path.relative_to(SOURCES.parent)
    source = place.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(tree), os.environ.get("PYTHONPATH", "")]),
            "PYTHONDONTWRITEBYTECODE": "1",
            "TMPDIR": folder,
        }
        if "njit" in source:
            environment["NUMBA_CACHE_DIR"] = folder
        command = [sys.executable, "-m", "pytest", "-qx", "-rfE", "-p", "no:cacheprovider", *tests]
        place.write_text(mutant.text, encoding="utf-8")
        try:
            done = subprocess.run(
                command,
                cwd=ROOT,
                env=environment,
                capture_output=True,
                text=True,
                timeout=patience,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return "hang"
        finally:
            place.write_text(source, encoding="utf-8")
    if not done.returncode:
        return None
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, flags=re.M)
    return failed[1] if failed else "import"


def report(
    room: str, cases: Sequence[tuple[Mutant, list[str]]], verdicts: list[str | None]
) -> None:
    """Print the survivors and the score of a room."""
    tried = [(m, len(t), v) for (m, t), v in zip(cases, verdicts, strict=True)]
    for mutant, number, verdict in tried:
        if not verdict:
            where = f"{mutant.path.relative_to(ROOT)}:{mutant.line}"
            kind = "boundary" if mutant.boundary else f"{number} tests"
            print(f"survived ({kind}): {where}: {mutant.change}")
    for boundary, what in ((False, "faults"), (True, "boundaries")):
        group = [bool(verdict) for mutant, _, verdict in tried if mutant.boundary == boundary]
        if group:
            caught, low, high = (
                100.0 * share
                for share in (
                    sum(group) / len(group),
                    *binomtest(sum(group), len(group)).proportion_ci(0.95, method="wilson"),
                )
            )
            print(
                f"{room}: {sum(group)} of {len(group)} {what} caught, {caught:.0f} % "
                f"(95 %: {low:.0f} to {high:.0f} %)"
            )


def main() -> None:
    """Draw mutants of rooms, try them, and print the survivors and the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rooms", nargs="+")
    parser.add_argument("--number", type=int, default=160, help="Mutants that are drawn of a room.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="Mutants whose place and change hold this text.")
    given = parser.parse_args()
    reach = Reach()
    for room in given.rooms:
        every = [m for path in sorted((SOURCES / room).rglob("*.py")) for m in mutants_of(path)]
        drawn = random.Random(given.seed).sample(every, min(given.number, len(every)))
        drawn = [m for m in drawn if given.only in f"{m.path}:{m.line}: {m.change}"]
        cases = [(mutant, reach.tests(mutant)) for mutant in drawn]
        begin = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            tree = Path(folder)
            shutil.copytree(SOURCES, tree / SOURCES.name)
            verdicts = [
                killer(mutant, tests, reach.patience(tests), tree)
                for mutant, tests in tqdm(cases, mininterval=10.0)
            ]
        report(room, cases, verdicts)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(
            f"{time.monotonic() - begin:.0f} s, CPU of all so far "
            f"{used.ru_utime + used.ru_stime:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
