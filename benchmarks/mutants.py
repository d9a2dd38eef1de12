"""Plant single faults in rooms and see which the tests let through: ``make mutants ROOM=physics``.

A fault changes one sign, operator, comparison, constant or function. A sample is drawn by a seed.
Which test reaches which line is measured once and kept in ``build/mutants``. Each mutant lives in a
fork of a process that has collected the tests, and is shown those that reach its line until one
fails; a test that fails without the fault as well convicts nobody. A comparison that takes its
boundary along (``<`` for ``<=``) is counted apart.
"""

from __future__ import annotations

import argparse
import ast
import gc
import hashlib
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, FunctionType

import pytest
from _pytest.runner import runtestprotocol
from coverage import CoverageData
from scipy.stats import binomtest
from tqdm import tqdm

from deboom.files.run_folder import hash_sources

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src" / "deboom"
CACHE = ROOT / "build" / "mutants"
TEST_S, TESTS_S = 15.0, 12.0
"""CPU time of a test, and recorded time of all tests, that a mutant is shown to at most [s]."""
PATIENCE_S = 15.0
"""CPU time of a mutant, beside thrice the recorded time of its tests [s]; beyond, it hangs."""
IDLE = 10.0
"""Wait for a mutant, over its CPU time [1]: one that sleeps hangs, a busy machine does not."""

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
import json, os, pytest, signal
times = {}
def too_long(*_):
    pytest.fail("too long for mutants")
@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call():
    signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, float(os.environ["MUTANTS_TEST_S"]))
    yield
    signal.setitimer(signal.ITIMER_PROF, 0.0)
def pytest_runtest_logreport(report):
    times.setdefault(report.nodeid, {})[report.when] = report.duration
    if report.failed:
        times[report.nodeid]["failed"] = True
def pytest_sessionfinish():
    with open(os.environ["MUTANTS_TIMES"], "w") as file:
        json.dump(times, file)
"""


class Reach:
    """Which tests reach a line, and their times; files of tests that changed are measured again."""

    def __init__(self) -> None:
        CACHE.mkdir(parents=True, exist_ok=True)
        note = CACHE / "tests.json"
        known = json.loads(note.read_text()) if note.exists() else {}
        sources = hash_sources(SOURCES)
        if known.get("sources") != sources:
            known = {"sources": sources, "files": {}, "times": {}}
            (CACHE / "coverage").unlink(missing_ok=True)
        self.data = CoverageData(str(CACHE / "coverage"))
        self.data.read()
        changed: dict[str, dict[str, str]] = {}
        for kind in ("verification", "golden", "unit", "studies"):
            for path in sorted((ROOT / "tests" / kind).glob("test_*.py")):
                name, value = (
                    str(path.relative_to(ROOT)),
                    hashlib.sha256(path.read_bytes()).hexdigest(),
                )
                if known["files"].get(name) != value:
                    group = path.stem.split("_")[1] if kind != "studies" else kind
                    changed.setdefault(group, {})[name] = value
        for group, files in changed.items():
            print(f"which lines do the tests of {group} reach ...", flush=True)
            known["times"] |= self._measured(list(files))
            known["files"] |= files
            note.write_text(json.dumps(known))
        self.times = {name: t for name, t in known["times"].items() if "failed" not in t}
        self.setups: dict[str, float] = defaultdict(float)
        for name, phases in self.times.items():
            file = name.split("::")[0]
            self.setups[file] = max(phases.get("setup", 0.0), self.setups[file])

    def _measured(self, files: Sequence[str]) -> dict[str, dict[str, float]]:
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "mutants_times.py").write_text(PLUGIN)
            environment = {
                **os.environ,
                "COVERAGE_FILE": f"{folder}/coverage",
                "MUTANTS_TIMES": f"{folder}/times.json",
                "MUTANTS_TEST_S": str(TEST_S),
                "PYTHONPATH": os.pathsep.join([folder, os.environ.get("PYTHONPATH", "")]),
            }
            command = [sys.executable, "-m", "pytest", "-q", "-p", "mutants_times"]
            command += [f"--cov={SOURCES}", "--cov-context=test", "--cov-report=", *files]
            subprocess.run(command, cwd=ROOT, env=environment, check=False)
            fresh = CoverageData(f"{folder}/coverage")
            fresh.read()
            self.data.update(fresh)
            self.data.write()
            times: dict[str, dict[str, float]] = json.loads(
                Path(f"{folder}/times.json").read_text()
            )
            return times

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
        """Return the CPU time that some tests may take [s]."""
        setups = sum(self.setups[file] for file in {test.split("::")[0] for test in tests})
        return PATIENCE_S + 3.0 * (setups + sum(self.times[t].get("call", 0.0) for t in tests))


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from _codes(inner)


def swapped(mutant: Mutant) -> bool:
    """Give the functions of this process the mutant's code; False where that is not enough."""
    source, name = mutant.path.read_text(encoding="utf-8"), str(mutant.path)
    if "njit" in source:
        return False
    before, after = (compile(t, name, "exec", dont_inherit=True) for t in (source, mutant.text))
    changed = {a: b for a, b in zip(_codes(before), _codes(after), strict=True) if a != b}
    functions = [f for f in gc.get_objects() if isinstance(f, FunctionType)]
    functions = [f for f in functions if f.__code__.co_filename == name and f.__code__ in changed]
    for function in functions:
        function.__code__ = changed[function.__code__]
    return bool(functions)


class Planted(SourceFileLoader):
    """Loads the mutant's text in the place of its file."""

    mutant: Mutant

    def get_code(self, fullname: str) -> CodeType | None:
        """Compile the mutant's text, or what the file says."""
        if self.path == str(self.mutant.path):
            return compile(self.mutant.text, self.path, "exec", dont_inherit=True)
        return super().get_code(fullname)


def tried_anew(mutant: Mutant, tests: Sequence[str], folder: str) -> str | None:
    """Import the project again with the mutant, and run tests; return the first that fails."""
    import numba

    numba.config.CACHE_DIR = folder
    Planted.mutant = mutant
    SourceFileLoader.get_code = Planted.get_code  # type: ignore[method-assign]
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None) or ""
        ours = file.startswith(f"{ROOT}{os.sep}") and not file.startswith(sys.prefix)
        if ours and name != "__main__":
            del sys.modules[name]
    failed: list[str] = []

    class First:
        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            if report.failed:
                failed.append(report.nodeid)

    code = pytest.main(["-q", "-x", "-s", "-p", "no:cacheprovider", *tests], plugins=[First()])
    return failed[0] if failed else ("import" if code else None)


class Court:
    """Tries each mutant, in the place of pytest's own loop over the tests."""

    def __init__(self, reach: Reach, cases: Sequence[tuple[Mutant, list[str]]]) -> None:
        self.reach, self.cases = reach, cases
        self.verdicts: list[str | None] = []
        self.trusted: dict[str, bool] = {"hang": True, "import": True}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Try every case."""
        self.items = {item.nodeid: item for item in session.items}
        for mutant, tests in tqdm(self.cases, mininterval=10.0):
            verdict = self._killer(mutant, tests)
            while verdict and not self._convicts(verdict):
                tests = [t for t in tests if self.trusted.get(t, True)]
                verdict = self._killer(mutant, tests)
            self.verdicts.append(verdict)
        return True

    def _convicts(self, test: str) -> bool:
        """Whether a test passes without any fault."""
        if test not in self.trusted:
            self.trusted[test] = self._killer(None, [test]) is None
        return self.trusted[test]

    def _killer(self, mutant: Mutant | None, tests: list[str]) -> str | None:
        """Return the first test that fails in a fork with the mutant, or ``hang``."""
        if not tests:
            return None
        patience = self.reach.patience(tests)
        with tempfile.TemporaryDirectory() as folder:
            child = os.fork()
            if child == 0:
                resource.setrlimit(resource.RLIMIT_CPU, (int(patience), int(patience)))
                self._child(mutant, tests, folder)
            end = time.monotonic() + IDLE * patience
            done = 0
            while not done and time.monotonic() < end:
                done, _ = os.waitpid(child, os.WNOHANG)
                time.sleep(0.01)
            if not done:
                os.killpg(child, signal.SIGKILL)
                os.waitpid(child, 0)
                return "hang"
            told = Path(folder) / "verdict"
            return (told.read_text() or None) if told.exists() else "hang"

    def _child(self, mutant: Mutant | None, tests: list[str], folder: str) -> None:
        try:
            os.setpgid(0, 0)
            quiet = os.open(os.devnull, os.O_WRONLY)
            os.dup2(quiet, 1)
            os.dup2(quiet, 2)
            tempfile.tempdir = folder
            verdict = None
            if mutant and not swapped(mutant):
                verdict = tried_anew(mutant, tests, folder)
            else:
                items = [self.items[test] for test in tests if test in self.items]
                for item, after in zip(items, [*items[1:], None], strict=True):
                    if any(r.failed for r in runtestprotocol(item, log=False, nextitem=after)):
                        verdict = item.nodeid
                        break
            (Path(folder) / "verdict").write_text(verdict or "")
        finally:
            os._exit(0)


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
        court = Court(reach, cases)
        files = sorted({test.split("::")[0] for _, tests in cases for test in tests})
        begin = time.monotonic()
        pytest.main(["-q", "-s", "-p", "no:cacheprovider", *files], plugins=[court])
        report(room, cases, court.verdicts)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(
            f"{time.monotonic() - begin:.0f} s, CPU of all so far "
            f"{used.ru_utime + used.ru_stime:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
