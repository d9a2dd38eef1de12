"""Plant single faults and see which the tests let through: ``make mutants PACKAGE=physics``.

Without a package the draw is one over all sources and leaves boundaries out. ``--record`` keeps its
verdicts, and ``--again`` plants the same faults in another state of sources and tests: a fault is
known by its file, the text of its line and its change. What is no longer caught is printed.

A fault changes one sign, operator, comparison, constant or function. A sample is drawn by a seed.
Which test reaches which line is measured once and kept in ``build/mutants``. Each mutant stands in
a copy of the sources and is shown the tests that reach its line until one fails; a test that fails
without a fault, too, gives no verdict. What a test starts as a process of its own, such as a
server, is not in the map: its faults survive unless another test reaches them. A comparison that
takes its boundary along (``<`` for ``<=``) is counted apart.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import json
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from coverage import CoverageData
from scipy.stats import binomtest
from tqdm import tqdm

from deboom.files.run_folder import hash_files

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "src" / "deboom"
CACHE = ROOT / "build" / "mutants"
DECLARED = "tests/golden/test_declared_options.py"
"""Tests of what runs at import; of a constant or a field, those that name it are shown too."""
TEST_S, TESTS_S, PINS_S = 20.0, 30.0, 90.0
"""Time of a test, and recorded time of all tests and all pins, that see a mutant at most [s]."""
OPTIONS = (
    "-qx",
    "-p",
    "no:cacheprovider",
    "-p",
    "no:xdist",
    "-W",
    "ignore::pytest.PytestAssertRewriteWarning",  # a library of deboom may be a plugin, too
)
PATIENCE_S = 60.0
"""Processor time of a mutant, beside thrice that of its tests [s]; beyond, it hangs."""
WAITING = 10.0
"""Time over processor time of a mutant, beyond which it hangs without computing [1]."""

OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
COMPARISONS = {ast.Gt: ast.Lt, ast.Lt: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
BOUNDARIES = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
PAIRS = [
    name.split("/")
    for name in ("sin/cos", "mean/median", "min/max", "minimum/maximum", "argmin/argmax", "all/any")
]
FUNCTIONS = dict([*PAIRS, *(pair[::-1] for pair in PAIRS)])
RECORD = ("path", "line", "text", "change", "occurrence", "caught")
"""Columns of a record of verdicts."""
DROPPED = ("sqrt", "abs", "conj", "arcsin", "log10", "log", "exp")
"""Functions of one argument, or methods of none, that a mutant forgets."""


@dataclass(frozen=True)
class Mutant:
    """One fault: where it is, what it says, and which bytes of its file it replaces by what."""

    path: Path
    line: int
    change: str
    boundary: bool
    begin: int
    end: int
    new: str

    @property
    def text(self) -> str:
        """Text of its file with the fault."""
        source = self.path.read_bytes()
        return (source[: self.begin] + self.new.encode() + source[self.end :]).decode()


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
    source = path.read_bytes()
    starts = [0, *(newline.end() for newline in re.finditer(rb"\n", source))]
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
            begin = starts[node.lineno - 1] + node.col_offset
            end = starts[node.end_lineno - 1] + node.end_col_offset
            old, new = source[begin:end].decode(), f"({ast.unparse(other)})"
            change = f"{' '.join(old.split())} → {new}"
            yield Mutant(path, node.lineno, change, boundary, begin, end, new)


@cache
def _definitions(path: Path) -> list[tuple[str, range]]:
    """Name that each line defines, and the lines that run with it: none of a constant."""
    text = path.read_text(encoding="utf-8")
    definitions = [("", range(0))] * (text.count("\n") + 2)
    for node in ast.walk(ast.parse(text)):  # outer nodes come first
        match node:
            case ast.FunctionDef(name=name):
                body = range(node.body[0].lineno, node.end_lineno + 1)
                for line in range(node.lineno, body.stop):
                    definitions[line] = name, range(line, line + 1) if line in body else body
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                for line in range(node.lineno, node.end_lineno + 1):
                    definitions[line] = (
                        definitions[line] if definitions[line][1] else (name, range(0))
                    )
    return definitions


@cache
def _places_of(name: str, module: str, folder: Path = SOURCES) -> list[tuple[Path, int]]:
    """Lines of a folder that name something of a module, in it or where it is imported."""
    word, home = re.compile(rf"\b{name}\b"), re.compile(rf"\b{module}\b")
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))}
    return [
        (path, number)
        for path, text in texts.items()
        if path.stem == module or home.search(text)
        for number, line in enumerate(text.splitlines(), 1)
        if word.search(line)
    ]


@cache
def _pins(test: str) -> bool:
    """Say whether a test holds numbers or a page as they were."""
    file, _, name = test.partition("::")
    after = (ROOT / file).read_text(encoding="utf-8").partition(f"def {name.partition('[')[0]}(")[2]
    return "/golden/" in test or "hold(" in after.partition("\ndef ")[0]


class _Times(dict[str, dict[str, float]]):
    """Time of each phase of each test [s], as pytest reports them."""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.setdefault(report.nodeid, {})[report.when or ""] = report.duration
        if report.failed:
            self[report.nodeid]["failed"] = 1.0


def _measured(coverage: Path) -> _Times:
    """Run all tests, keep the lines that each reaches, and return the times of each [s].

    They are processor times on average: a busy machine must not leave less tests to a mutant.
    """
    print("which lines do the tests reach ...", flush=True)
    os.environ["COVERAGE_FILE"] = str(coverage)
    times = _Times()
    options = ["-q", "-n2", f"--cov={SOURCES}", "--cov-context=test", "--cov-report="]
    pytest.main([*options, str(ROOT / "tests")], plugins=[times])
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = used.ru_utime + used.ru_stime
    passed = sum(seconds for phases in times.values() for seconds in phases.values())
    for phases in times.values():
        phases |= {when: seconds * min(processor / passed, 1.0) for when, seconds in phases.items()}
    return times


class Reach:
    """Which tests reach a line, and their times; measured again when sources or tests changed."""

    def __init__(self) -> None:
        CACHE.mkdir(parents=True, exist_ok=True)
        note, kept = CACHE / "tests.json", CACHE / "coverage"
        code = sorted(path for top in (SOURCES, ROOT / "tests") for path in top.rglob("*.py"))
        stamp = hash_files(code, ROOT)
        record = json.loads(note.read_text()) if note.exists() else {}
        if record.get("stamp") != stamp:
            record = {"stamp": stamp, "times": _measured(kept)}
            note.write_text(json.dumps(record))
        self.data = CoverageData(str(kept))
        self.data.read()
        self.times = {
            name: phases
            for name, phases in record["times"].items()
            if "failed" not in phases and (phases.get("call", 0.0) <= TEST_S or _pins(name))
        }
        self.setups: dict[str, float] = defaultdict(float)
        for name, phases in self.times.items():
            file = name.split("::")[0]
            self.setups[file] = max(phases.get("setup", 0.0), self.setups[file])

    def tests(self, mutant: Mutant) -> list[str]:
        """Return the tests of a line, those of a file together; those of its package first."""
        contexts = self._contexts(mutant.path, mutant.line)
        seen = {c.partition("|")[0] for c in contexts if not c.endswith("|setup")}
        # what a fixture reaches is seen by all tests of its file
        fixtures = {c.split("::")[0] for c in contexts if c.endswith("|setup")}
        name, lines = _definitions(mutant.path)[mutant.line]
        if lines != range(mutant.line, mutant.line + 1):  # it runs at import, in no test's context
            named = _places_of(name, name, ROOT / "tests") if name and not lines else []
            fixtures |= {DECLARED, *(path.relative_to(ROOT).as_posix() for path, _ in named)}
        seen |= {t for t in self.times if t.split("::")[0] in fixtures}
        chosen: list[str] = []
        package = f"test_{mutant.path.relative_to(SOURCES).parts[0]}"
        order = sorted(seen & self.times.keys(), key=lambda t: (package not in t, self._cost(t)))
        for pinned, most in ((False, TESTS_S), (True, PINS_S)):  # pins are the sharpest, and last
            spent = 0.0
            for test in order:
                if _pins(test) == pinned:
                    spent += self.times[test].get("call", 0.0)
                    if chosen and spent > most:
                        break
                    chosen.append(test)
        files = list(dict.fromkeys(test.split("::")[0] for test in chosen))
        return sorted(chosen, key=lambda test: files.index(test.split("::")[0]))

    def _contexts(self, path: Path, line: int) -> set[str]:
        """Contexts that reach a line, or name what it defines: a constant, a compiled loop."""
        waiting, seen, contexts = [(path, line)], set(), set()
        while waiting:
            place, number = waiting.pop()
            name, lines = _definitions(place)[number]
            reached = {c for line in lines for c in self._reached(place).get(line, ()) if c}
            contexts |= reached
            if name and name not in seen and not reached and place == path:
                seen.add(name)
                waiting += _places_of(name, path.stem)
        return contexts

    @cache  # noqa: B019 - one instance, for the life of the command
    def _reached(self, path: Path) -> dict[int, list[str]]:
        return self.data.contexts_by_lineno(str(path))

    def _cost(self, test: str) -> float:
        return self.times[test].get("call", 0.0) + self.setups[test.split("::")[0]]

    def patience(self, tests: Sequence[str]) -> float:
        """Return the processor time that some tests may take [s]."""
        setups = sum(self.setups[file] for file in {test.split("::")[0] for test in tests})
        return PATIENCE_S + 3.0 * (setups + sum(self.times[t].get("call", 0.0) for t in tests))


def _show(mutant: Mutant, tests: Sequence[str], patience: int, folder: str, output: Path) -> None:
    """Show a mutant, in a copy of the sources, to tests, and end with pytest's verdict."""
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (patience, patience))
    tree = Path(folder) / "copy" / "src"
    shutil.copytree(SOURCES, tree / SOURCES.name)
    for path in ROOT.iterdir():  # sources find what lies beside them
        if path.name != "src":
            (tree.parent / path.name).symlink_to(path)
    (tree / mutant.path.relative_to(SOURCES.parent)).write_text(mutant.text, encoding="utf-8")
    ours = (str(SOURCES), str(ROOT / "tests"))  # tests of this process hold sources of their own
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None)).startswith(ours):
            del sys.modules[name]
    sys.path.insert(0, str(tree))
    sys.dont_write_bytecode = True
    tempfile.tempdir = folder
    os.environ |= {
        "PYTHONPATH": os.pathsep.join([str(tree), os.environ.get("PYTHONPATH", "")]),
        "PYTHONDONTWRITEBYTECODE": "1",
        "TMPDIR": folder,
    }
    os.chdir(ROOT)
    # pinned records name the studies' data as they lie here, not in the copy
    own = importlib.import_module("deboom.files.shipped_studies")
    own.shipped_studies = lambda: ROOT / "studies"  # type: ignore[attr-defined]
    for stream in (1, 2):
        os.dup2(os.open(output, os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
    code = 1
    try:
        code = int(pytest.main([*OPTIONS, *tests]))
    except Exception:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def caught(cases: Sequence[tuple[Mutant, list[str], float]]) -> list[bool]:
    """Say of each mutant whether a test fails, or hangs beyond its patience [s]; two at a time."""
    verdicts = [False] * len(cases)
    running: dict[int, tuple[int, float, str]] = {}
    waiting = [number for number, (_, tests, _) in enumerate(cases) if tests]
    bar = tqdm(total=len(waiting), mininterval=10.0)
    shutil.rmtree(CACHE / "output", ignore_errors=True)
    (CACHE / "output").mkdir()
    while waiting or running:
        while waiting and len(running) < 2:
            number, folder = waiting.pop(0), tempfile.mkdtemp()
            mutant, tests, patience = cases[number]
            if not (child := os.fork()):
                _show(mutant, tests, int(patience), folder, CACHE / "output" / f"{number}.txt")
            running[child] = number, time.monotonic() + WAITING * patience, folder
        time.sleep(0.02)
        for child, (number, deadline, folder) in list(running.items()):
            done, status = os.waitpid(child, os.WNOHANG)
            if not done and time.monotonic() < deadline:
                continue
            with suppress(ProcessLookupError):
                os.killpg(child, signal.SIGKILL)
            verdicts[number] = bool(status) if done else bool(os.waitpid(child, 0)[1])
            shutil.rmtree(folder, ignore_errors=True)
            del running[child]
            bar.update()
    bar.close()
    return verdicts


def caught_for_good(cases: Sequence[tuple[Mutant, list[str], float]]) -> list[bool]:
    """Say of each mutant whether a test fails that passes in a copy without a fault."""
    unfit: set[str] = set()
    fit: set[str] = set()
    verdicts = [False] * len(cases)
    waiting = list(range(len(cases)))
    while waiting:
        shown = [
            (mutant, [t for t in tests if not unfit & {t, t.partition("::")[0]}], patience)
            for mutant, tests, patience in (cases[number] for number in waiting)
        ]
        failed: dict[int, str] = {}
        for place, (number, verdict) in enumerate(zip(waiting, caught(shown), strict=True)):
            verdicts[number] = verdict
            output = CACHE / "output" / f"{place}.txt"
            text = output.read_text(errors="replace") if verdict else ""
            if line := re.search(r"^(?:FAILED|ERROR) (tests/.*)", text, flags=re.M):
                names = [test for test in shown[place][1] if line[1].startswith(test)]
                # a file whose import fails has no test's name
                failed[number] = max(names, key=len, default=line[1].split()[0])
        doubtful = sorted({*failed.values()} - fit)
        mutant, patience = cases[0][0], max(patience for _, _, patience in cases)
        whole = replace(mutant, begin=0, end=0, new="")
        verdicts_without = caught([(whole, [test], patience) for test in doubtful])
        for test, fails in zip(doubtful, verdicts_without, strict=True):
            (unfit if fails else fit).add(test)
            if fails:
                print(f"no verdict: {test} fails without a fault")
        waiting = [number for number, test in failed.items() if test in unfit]
    return verdicts


def identified(path: Path) -> dict[tuple[str, str, int], Mutant]:
    """Return the mutants of a file by the text of their line, their change and its occurrence."""
    lines = path.read_text(encoding="utf-8").splitlines()
    occurrences: Counter[tuple[str, str]] = Counter()
    mutants = {}
    for mutant in sorted(mutants_of(path), key=lambda mutant: mutant.begin):
        key = lines[mutant.line - 1].strip(), mutant.change
        mutants[*key, occurrences[key]] = mutant
        occurrences[key] += 1
    return mutants


def write_record(file: Path, mutants: Sequence[Mutant], verdicts: Sequence[bool]) -> None:
    """Write mutants and their verdicts for `read_record`."""
    rows = []
    for mutant, verdict in zip(mutants, verdicts, strict=True):
        (key,) = (key for key, other in identified(mutant.path).items() if other == mutant)
        facts = mutant.path.relative_to(SOURCES).as_posix(), mutant.line, *key, verdict
        rows.append(dict(zip(RECORD, facts, strict=True)))
    file.write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read_record(file: Path) -> list[tuple[Mutant, bool]]:
    """Return the mutants of a record in these sources, and whether they were caught then.

    A line that moved to another file is followed where it stands in one only; what is gone is
    printed.
    """
    everywhere = {path: identified(path) for path in sorted(SOURCES.rglob("*.py"))}
    mutants = []
    for row in json.loads(file.read_text(encoding="utf-8")):
        name, line, *key, verdict = (row[name] for name in RECORD)
        where = f"{name}:{line}: {key[0]}: {key[1]}"
        homes = [path for path, mutants_there in everywhere.items() if tuple(key) in mutants_there]
        if SOURCES / name in homes:
            homes = [SOURCES / name]
        elif len(homes) == 1:
            print(f"moved to {homes[0].relative_to(SOURCES)}: {where}")
        if len(homes) == 1:
            mutants.append((everywhere[homes[0]][tuple(key)], verdict))
        else:
            print(f"gone ({'caught' if verdict else 'survived'} before): {where}")
    return mutants


def report(
    package: str, cases: Sequence[tuple[Mutant, list[str], float]], verdicts: list[bool]
) -> None:
    """Print the survivors and the score of a package."""
    tried = [(m, len(t), v) for (m, t, _), v in zip(cases, verdicts, strict=True)]
    for mutant, number, verdict in tried:
        if not verdict:
            where = f"{mutant.path.relative_to(ROOT)}:{mutant.line}"
            kind = "boundary" if mutant.boundary else f"{number} tests"
            print(f"survived ({kind}): {where}: {mutant.change}")
    for boundary, what in ((False, "faults"), (True, "boundaries")):
        group = [verdict for mutant, _, verdict in tried if mutant.boundary == boundary]
        if group:
            share = binomtest(sum(group), len(group)).proportion_ci(0.95, method="wilson")
            print(
                f"{package}: {sum(group)} of {len(group)} {what} caught, {np.mean(group):.0%} "
                f"(95 %: {share.low:.0%} to {share.high:.0%})"
            )


def drawn_of(package: str, number: int, seed: int) -> list[Mutant]:
    """Draw mutants of a folder, or of modules by their begin; of all, leave boundaries out."""
    paths = sorted({*(SOURCES / package).rglob("*.py"), *SOURCES.glob(f"{package}*.py")})
    every = [m for path in paths for m in mutants_of(path) if package or not m.boundary]
    return random.Random(seed).sample(every, min(number, len(every)))


def main() -> None:
    """Draw mutants of packages, try them, and print the survivors and the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("packages", nargs="*", help="Folders of the sources, or begins of modules.")
    parser.add_argument("--number", type=int, default=160, help="Mutants drawn of a package.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="Mutants whose place and change hold this text.")
    parser.add_argument("--record", type=Path, help="File for the verdicts.")
    parser.add_argument("--again", type=Path, help="Record whose mutants are planted again.")
    given = parser.parse_args()
    reach = Reach()
    for path in SOURCES.rglob("[!_]*.py"):  # forked processes have imported the libraries
        importlib.import_module(".".join(path.relative_to(SOURCES.parent).with_suffix("").parts))
    before = read_record(given.again) if given.again else []
    draws = {str(given.again): [mutant for mutant, _ in before]}
    if not given.again:
        packages = given.packages or [""]
        draws = {name or "all": drawn_of(name, given.number, given.seed) for name in packages}
    tried: dict[Mutant, bool] = {}
    for package, drawn in draws.items():
        drawn = [m for m in drawn if given.only in f"{m.path}:{m.line}: {m.change}"]
        cases = [(m, tests := reach.tests(m), reach.patience(tests)) for m in drawn]
        verdicts = caught_for_good(cases)
        report(package, cases, verdicts)
        tried |= dict(zip(drawn, verdicts, strict=True))
    for mutant, verdict in before:
        if verdict and not tried.get(mutant, True):
            where = f"{mutant.path.relative_to(ROOT)}:{mutant.line}"
            print(f"no longer caught: {where}: {mutant.change}")
    if given.record:
        write_record(given.record, list(tried), list(tried.values()))


if __name__ == "__main__":
    main()
