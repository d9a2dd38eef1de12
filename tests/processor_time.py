"""How many processor seconds the suite and its slowest phases take; a test has a few at most.

A test beyond `MOST_SECONDS` fails unless it is marked slow with its reason, so that what a
maintainer waits for stays short.
"""

import os
from contextlib import suppress
from pathlib import Path

import pytest
from numba.core.event import Listener, register

MOST_SECONDS = 5.0
"""Of processor, for a test with its own fixtures; what several tests share is not counted [s]."""
SERVICES = {
    "browser": "opens a browser",
    "cluster": "starts a cluster of Dask",
    "postgres_server": "starts a PostgreSQL server",
}
"""Fixtures that make every test with them slow, and why."""
ENDED, ALONE = pytest.StashKey[float](), pytest.StashKey[float]()
"""Of a test: processor seconds when its last phase ended, and those of its own until then."""


def processor_seconds():
    """Return what this process and its children have used, also those that have not ended [s]."""
    seconds = sum(os.times()[:4])
    for path in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):  # a thread or a child that has just ended
            for child in path.read_text().split():
                fields = Path("/proc", child, "stat").read_text().rpartition(")")[2].split()
                seconds += sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
    return seconds


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
    item.stash[ENDED], item.stash[ALONE] = processor_seconds(), 0.0
    SHARED.seconds = 0.0
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report, now, before = (yield), processor_seconds(), item.stash[ALONE]
    report.processor_seconds = now - item.stash[ENDED]
    alone = before + report.processor_seconds - SHARED.seconds
    item.stash[ENDED], item.stash[ALONE], SHARED.seconds = now, alone, 0.0
    unmarked = item.get_closest_marker("slow") is None
    if report.passed and before <= MOST_SECONDS < alone and unmarked:
        report.outcome = "failed"
        report.longrepr = (
            f"{item.nodeid} took {alone:.1f} s of processor, {MOST_SECONDS:g} s are "
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
