"""What tests of every kind share: a finished run of the front study, and pictures in words.

The suite prints its processor seconds and its slowest phases. A test that takes more than
`MOST_SECONDS` fails unless it is marked slow: what a maintainer waits for stays short.
"""

import gc
import os
from collections import Counter
from copy import deepcopy
from functools import cache
from pathlib import Path

import pytest
from filelock import FileLock
from numba.core.event import Listener, register

from browser_samples import Browser
from deboom.files import platform
from deboom.mounts import characterise
from deboom.report import Report
from deboom.runs import runner, second_process
from deboom.runs.runner import load_study, run_study
from deboom.vehicles import booming_model
from pinned_pages import pictures_described

STUDIES = Path(__file__).parents[1] / "studies"
MOST_SECONDS = 5.0
"""Of processor, for a test with its own fixtures; what several tests share is not counted [s]."""
SERVICES = {
    "browser": "opens a browser",
    "cluster": "starts a cluster of Dask",
    "postgres_server": "starts a PostgreSQL server",
}
"""Fixtures that make every test with them slow, and why."""
SECONDS = pytest.StashKey[Counter]()
"""Processor seconds of a test: when its last phase ended, and its own ones until then."""
# thousands of tests stay in memory, and every round of the garbage collector passes all of them
gc.set_threshold(50_000, 20, 50)


def processor_seconds():
    """Return what this process has used, and its children that have ended [s]."""
    return sum(os.times()[:4])


class SharedSeconds(Listener):
    """Time of a phase that no test answers for: fixtures of several tests, and compiled loops."""

    seconds, depth, began = 0.0, 0, 0.0

    def on_start(self, _event=None):
        """Begin, unless something shared around it has."""
        if self.depth == 0:
            self.began = processor_seconds()
        self.depth += 1

    def on_end(self, _event=None):
        """Count what ends, with all that was inside."""
        self.depth -= 1
        if self.depth == 0:
            self.seconds += processor_seconds() - self.began


SHARED = SharedSeconds()
register("numba:compile", SHARED)  # once for a machine: the loops stay on disk


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef):
    if fixturedef.scope == "function":
        return (yield)
    SHARED.on_start()
    try:
        return (yield)
    finally:
        SHARED.on_end()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item, nextitem):
    item.stash[SECONDS] = Counter(until=processor_seconds())
    SHARED.seconds = 0.0
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report, now, spent = (yield), processor_seconds(), item.stash[SECONDS]
    report.processor_seconds = now - spent["until"]
    spent["until"] = now
    before = spent["alone"]
    spent["alone"] += report.processor_seconds - SHARED.seconds
    SHARED.seconds = 0.0
    slow = item.get_closest_marker("slow")
    if report.passed and before <= MOST_SECONDS < spent["alone"] and slow is None:
        report.outcome = "failed"
        report.longrepr = (
            f"{item.nodeid} took {spent['alone']:.1f} s of processor, {MOST_SECONDS:g} s are "
            "allowed: make it quicker, or mark it slow and state the reason"
        )
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    for item in items:
        for fixture in SERVICES.keys() & set(item.fixturenames):
            item.add_marker(pytest.mark.slow(SERVICES[fixture]))
        for mark in item.iter_markers("slow"):
            if len(mark.args) != 1 or not isinstance(mark.args[0], str):
                raise pytest.UsageError(f"{item.nodeid}: state the reason, slow('opens a browser')")


def pytest_terminal_summary(terminalreporter):
    phases = [
        phase
        for of_outcome in terminalreporter.stats.values()
        for phase in of_outcome
        if hasattr(phase, "processor_seconds")
    ]
    slowest = sorted(phases, key=lambda phase: -phase.processor_seconds)[:10]
    terminalreporter.section(f"{processor_seconds():.0f} processor seconds, ten slowest phases")
    for phase in slowest:
        seconds = f"{phase.processor_seconds:6.1f} s"
        terminalreporter.write_line(f"{seconds} {phase.when:8} {phase.nodeid}")


@pytest.fixture(scope="session")
def made_once(tmp_path_factory):
    """Return a function that makes a folder once for all workers; nobody changes what is in it."""
    top = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        top = top.parent

    def made(name, make):
        """Return the folder that ``make(folder)`` returned, to whichever worker called it."""
        answer = top / f"{name}.path"
        with FileLock(top / f"{name}.lock"):
            if not answer.exists():
                folder = make(top / name)
                answer.write_text(os.fspath(folder), encoding="utf-8")
        return Path(answer.read_text(encoding="utf-8"))

    return made


@pytest.fixture(scope="session", autouse=True)
def shipped_files_once():
    # studies read the shipped platform, and describe their environment, again and again
    read = platform.read_nodal
    kept = cache(read)
    with pytest.MonkeyPatch.context() as patch:
        shipped = STUDIES / "data"
        patch.setattr(
            platform, "read_nodal", lambda path: (kept if shipped in path.parents else read)(path)
        )
        record = cache(runner.environment_record)
        patch.setattr(runner, "environment_record", lambda packages: deepcopy(record(packages)))
        yield


@pytest.fixture(scope="session", autouse=True)
def first_process_alone():
    # a second one of each run takes longer to start than a test's study, and would draw for real
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(second_process, "cpu_count", lambda: 1)
        yield


@pytest.fixture(scope="module")
def browser():
    """Open a real browser; tests are skipped where there is none."""
    opened = Browser()
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def few_chains():
    """Draw fewer measuring chains for the error budgets of mounts, which nobody looks at."""
    budget = characterise.error_budget
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            characterise, "error_budget", lambda *a, **k: budget(*a, **k | {"n_draws": 20})
        )
        yield


@pytest.fixture(scope="module")
def described_pictures():
    """See `pictures_described`."""
    with pictures_described():
        yield


@pytest.fixture(scope="module")
def no_pictures():
    """Draw nothing where tests look at numbers alone: pictures take longer than they do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Report, "figure", lambda *_, **__: None)
        yield


@pytest.fixture
def plain_loops(monkeypatch):
    """Sum levels in numpy: compiling for one small platform takes longer than its search."""
    summed = booming_model.level_sum
    monkeypatch.setattr(booming_model, "level_sum", lambda case, **_: summed(case, compiled=False))


@pytest.fixture(scope="session")
def front_run(made_once):
    """Folder of a finished run of the front study on a tiny budget, which nobody changes."""
    budget = {"generations": 2, "population": 12, "samples": 16}

    def run(out):
        with pictures_described():
            return run_study(load_study(STUDIES / "u06_robust_front.py"), out, budget)

    return made_once("front", run)
