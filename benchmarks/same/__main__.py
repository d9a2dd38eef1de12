"""Run the scenarios on a base commit and on this tree, and list every difference.

``python -m same BASE [--only PATTERN] [--list] [--cache FOLDER] [-j N]`` in ``benchmarks/``, or
``make same BASE=…``. The base's results are kept per commit. Exit code 1: a difference that the map
of deliberate ones (``same/map.toml``) does not name.
"""

from __future__ import annotations

import argparse
import importlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from fnmatch import fnmatch
from pathlib import Path

from same.compare import Comparison, Difference, Map, Side
from same.scenario import Scenario, run_in_child
from same.scenarios import read_scenarios

ROOT = Path(__file__).resolve().parents[2]
KINDS = ("number", "name", "words", "picture", "code")
PRELOADED = (
    "matplotlib.figure",
    "matplotlib.backends.backend_agg",
    "numba",
    "openpyxl",
    "pandas",
    "pydantic",
    "pymoo.algorithms.moo.nsga2",
    "pyuff",
    "SALib.analyze.sobol",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
    "sqlalchemy",
    "typer",
)
"""Libraries that every scenario would import again; deboom itself is never imported here."""


def main() -> int:
    options = _options()
    scenarios = read_scenarios()
    chosen = [s for s in scenarios if any(fnmatch(s.name, p) for p in options.only)]
    if options.list:
        print("\n".join(scenario.name for scenario in chosen))
        return 0
    wanted = _with_needed(chosen, scenarios)
    for name in PRELOADED:
        importlib.import_module(name)
    revision = _git("rev-parse", options.base)
    cache = options.cache.resolve()
    base = cache / revision[:12]
    tree = _base_tree(base, revision)
    new = cache / "trees" / ROOT.as_posix().strip("/").replace("/", "_")
    missing = [s for s in wanted if not _is_kept(base / "runs", s)]
    _run(missing, "steps", tree, base / "runs", base / "runs", options.jobs)
    own = [s for s in wanted if s in chosen or any(("%", s.name) in c.needs for c in wanted)]
    _run(own, "new", ROOT, new / "runs", base / "runs", options.jobs)
    return _report(chosen, tree, base, new, Map(Path(__file__).with_name("map.toml")), options.kind)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="same", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("base", nargs="?", default="main", help="commit to compare with")
    parser.add_argument("--only", action="append", help="pattern of scenarios; repeatable")
    parser.add_argument("--list", action="store_true", help="names of the scenarios")
    parser.add_argument("--kind", action="append", choices=KINDS, help="only such differences")
    parser.add_argument("--cache", type=Path, default=ROOT / "build" / "same")
    parser.add_argument("-j", dest="jobs", type=int, default=2, help="processes")
    options = parser.parse_args()
    options.only = options.only or ["*"]
    options.kind = options.kind or list(KINDS)
    return options


def _git(*words: str) -> str:
    done = subprocess.run(["git", "-C", ROOT, *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def _with_needed(chosen: Iterable[Scenario], scenarios: Sequence[Scenario]) -> list[Scenario]:
    """Return the scenarios and what they refer to, in the order of the list."""
    by_name = {scenario.name: scenario for scenario in scenarios}
    names: set[str] = set()
    waiting = [scenario.name for scenario in chosen]
    while waiting:
        name = waiting.pop()
        if name not in names:
            names.add(name)
            waiting += [needed for _, needed in by_name[name].needs]
    return [scenario for scenario in scenarios if scenario.name in names]


def _base_tree(base: Path, revision: str) -> Path:
    """Unpack the base commit once."""
    tree = base / "tree"
    if not tree.is_dir():
        part = base / f"tree.{os.getpid()}"
        part.mkdir(parents=True)
        packed = subprocess.run(
            ["git", "-C", ROOT, "archive", revision], capture_output=True, check=True
        )
        subprocess.run(["tar", "-x", "-C", part], input=packed.stdout, check=True)
        part.rename(tree)
    return tree


def _is_kept(runs: Path, scenario: Scenario) -> bool:
    """Say whether the base's results are there, of the same steps and of what they refer to."""
    kept = runs / scenario.name / "log" / "steps.txt"
    if not kept.is_file() or kept.read_text(encoding="utf-8") != "\n".join(scenario.steps):
        return False
    needed = (runs / name / "log" / "steps.txt" for _, name in scenario.needs)
    return all(p.is_file() and p.stat().st_mtime <= kept.stat().st_mtime for p in needed)


def _run(
    scenarios: Sequence[Scenario], which: str, tree: Path, side: Path, base: Path, jobs: int
) -> None:
    """Run scenarios, each in a process of its own, those they need first."""
    waiting, running, ready = list(scenarios), {}, set()
    names = {scenario.name for scenario in scenarios}
    started = time.monotonic()
    while waiting or running:
        able = [
            s
            for s in waiting
            if all(
                needed not in names or needed in ready or (mark == "@" and side != base)
                for mark, needed in s.needs
            )
        ]
        if able and len(running) < jobs:
            scenario = able[0]
            waiting.remove(scenario)
            other = which == "new" and scenario.new is not None
            steps = scenario.new if other else scenario.steps
            folder = side / scenario.name
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            sys.stdout.flush()
            running[run_in_child(steps, tree, folder, base)] = scenario
            continue
        if not running:
            raise RuntimeError(f"these scenarios wait for each other: {waiting}")
        child, _ = os.wait()
        if child in running:
            done = running.pop(child)
            ready.add(done.name)
            seconds = side / done.name / "log" / "cpu.txt"
            said = f"{seconds.read_text()} s" if seconds.is_file() else "BROKEN"
            print(
                f"{done.name:32} {said:>10}  {time.monotonic() - started:6.0f} s", file=sys.stderr
            )


def _report(
    chosen: Sequence[Scenario], tree: Path, base: Path, new: Path, known: Map, kinds: Sequence[str]
) -> int:
    """Print the differences that the map does not name; 1 if there is any."""
    found: list[Difference] = []
    allowed = 0
    for scenario in chosen:
        sides = []
        for runs, source in ((base / "runs", tree), (new / "runs", ROOT)):
            folder = runs / scenario.name
            places = {
                (folder / "work").as_posix(): "HERE",
                (base / "runs").as_posix(): "RUNS",
                runs.as_posix(): "RUNS",
                source.as_posix(): "TREE",  # last: the runs may lie within it
            }
            places |= {place.lstrip("/"): name for place, name in places.items()}
            sides.append(Side(folder, places))
        for difference in Comparison(scenario.name, scenario.absolute, *sides, known).differences():
            if known.allows(difference):
                allowed += 1
            elif difference.kind in kinds:
                found.append(difference)
                print(difference)
    counts = ", ".join(f"{kind} {sum(d.kind == kind for d in found)}" for kind in KINDS)
    print(f"{len(chosen)} scenarios, {len(found)} differences ({counts}), {allowed} in the map")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
