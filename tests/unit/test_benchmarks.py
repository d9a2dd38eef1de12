"""Benchmarks and measured claims, which run seldom, import what they need."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MUTANTS = ROOT / "benchmarks" / "mutants.py"
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


def test_a_planted_fault_is_known_again_by_its_line_and_its_change(tmp_path, monkeypatch, capsys):
    """Lines come before it, its file is split, or its line is gone."""
    specification = importlib.util.spec_from_file_location("mutants", MUTANTS)
    mutants = importlib.util.module_from_spec(specification)
    monkeypatch.setitem(sys.modules, "mutants", mutants)  # as its data classes need it
    specification.loader.exec_module(mutants)
    monkeypatch.setattr(mutants, "SOURCES", tmp_path)
    first, second, third = (tmp_path / f"{name}.py" for name in ("first", "second", "third"))
    first.write_text("width = 2 * span\nheight = width + span\nheight = width + span\n")
    second.write_text("depth = 3 - span\nweight = depth / span\n")
    drawn = [fault for path in (first, second) for fault in mutants.mutants_of(path)]
    caught = [fault.path == first for fault in drawn]
    mutants.write_record(tmp_path / "record.json", drawn, caught)
    first.write_text('"""Sizes."""\n\n' + first.read_text())
    second.write_text("weight = 1.0\n")
    third.write_text("depth = 3 - span  # beside the others\ndepth = 3 - span\n")
    again = mutants.read_record(tmp_path / "record.json")
    assert [(fault.change, verdict) for fault, verdict in again] == [
        (fault.change, verdict)
        for fault, verdict in zip(drawn, caught, strict=True)
        if "depth / span" not in fault.change
    ]
    twice = [fault for fault, _ in again if fault.change == "width + span → (width - span)"]
    assert [(fault.line, fault.text.count("width - span")) for fault in twice] == [(4, 1), (5, 1)]
    said = capsys.readouterr().out
    assert "gone (survived before): second.py:2: weight = depth / span: " in said
    assert "moved to third.py: second.py:1: depth = 3 - span: 3 → (4)" in said
