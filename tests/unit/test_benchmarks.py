"""Benchmarks and measured claims, which run seldom, import what they need."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted((ROOT / "benchmarks").rglob("*.py"))
IMPORT_ALL = """
import runpy, sys

benchmarks, tests, *scripts = sys.argv[1:]
plain = [benchmarks, *sys.path]  # where PYTHONSAFEPATH is set, Python does not add it by itself
for script in scripts:
    sys.path[:] = plain  # each script finds its samples by itself
    for name, module in list(sys.modules.items()):
        if (getattr(module, "__file__", None) or "").startswith((benchmarks, tests)):
            del sys.modules[name]
    runpy.run_path(script, run_name="imported")
    print(script)
"""


@pytest.mark.slow("imports all scripts in a process of its own")
def test_every_script_and_every_claim_imports_what_it_needs():
    words = [str(path) for path in (ROOT / "benchmarks", ROOT / "tests", *SCRIPTS)]
    done = subprocess.run(
        [sys.executable, "-c", IMPORT_ALL, *words],
        cwd=ROOT / "benchmarks",
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines() == words[2:]
