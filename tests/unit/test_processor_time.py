"""The suite stays quick: a test that takes long fails, unless it is marked slow."""

import processor_time

TESTS = """
import time
import pytest

def burn():
    until = time.process_time() + 0.3
    while time.process_time() < until:
        pass

@pytest.fixture
def alone():
    burn()

@pytest.fixture(scope="session")
def shared():
    burn()

def test_quick():
    pass

def test_long():
    burn()

def test_long_setup(alone):
    pass

def test_shared_setup(shared):
    pass

@pytest.mark.slow("burns on purpose")
def test_long_on_purpose():
    burn()
"""


def test_what_takes_long_fails_unless_it_is_shared_or_marked(pytester, monkeypatch):
    pytester.makeini("[pytest]\nmarkers = slow(reason): takes long")
    pytester.makepyfile(TESTS)
    with monkeypatch.context() as patch:
        patch.setattr(processor_time, "MOST_SECONDS", 0.2)
        done = pytester.runpytest_inprocess("-p", "processor_time", "-p", "no:xdist")
    done.assert_outcomes(passed=3, failed=1, errors=1)
    done.stdout.fnmatch_lines(["*test_long took 0.3 s of processor, 0.2 s are allowed: make it *"])
    done.stdout.fnmatch_lines(["*ERROR at setup of test_long_setup*"])
    done.stdout.re_match_lines([r"=+ \d+ processor seconds, ten slowest phases"])


def test_a_test_without_the_reason_why_it_is_slow_is_refused(pytester):
    pytester.makeini("[pytest]\nmarkers = slow(reason): takes long")
    pytester.makepyfile("import pytest\n@pytest.mark.slow\ndef test_any():\n    pass")
    done = pytester.runpytest_inprocess("-p", "processor_time", "-p", "no:xdist")
    done.stderr.fnmatch_lines(["*test_any: state the reason, slow('opens a browser')"])
