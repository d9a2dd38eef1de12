"""Broken inputs of every kind are answered with a sentence; `make fuzz` tries many more."""

import subprocess
import sys
from pathlib import Path

FUZZ = Path(__file__).parents[2] / "benchmarks" / "fuzz.py"


def test_broken_inputs_of_every_kind_end_in_a_sentence():
    command = [sys.executable, str(FUZZ), "--cases", "40", "--seed", "1", "--seconds", "300"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "40 cases, seed 1: 0 faults" in done.stdout
