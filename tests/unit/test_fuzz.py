"""Broken inputs of every kind are answered with a sentence; `make fuzz` tries many more."""

import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).parents[2] / "benchmarks" / "fuzz.py"


@pytest.mark.slow("breaks forty inputs in a process of its own")
def test_broken_inputs_of_every_kind_end_in_a_sentence():
    options = ("--cases", "40", "--seed", "1", "--seconds", "300")
    made = subprocess.run([sys.executable, FUZZ, *options], capture_output=True, text=True)
    ended = (made.returncode, "40 cases, seed 1: 0 faults" in made.stdout)
    assert ended == (0, True), made.stdout + made.stderr
