"""Broken inputs of every kind are answered with a sentence; `make fuzz` tries many more."""

import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).parents[2] / "benchmarks" / "fuzz.py"


def test_broken_inputs_of_every_kind_end_in_a_sentence():
    options = ("--cases", "40", "--seed", "1", "--seconds", "300")
    made = subprocess.run([sys.executable, FUZZ, *options], capture_output=True, text=True)
    ended = (made.returncode, "40 cases, seed 1: 0 faults" in made.stdout)
    assert ended == (0, True), made.stdout + made.stderr
