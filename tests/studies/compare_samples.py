"""Runs compared by the study ``compare``, with what it says on the terminal."""

from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

from deboom.runs.runner import load_study, run_study

COMPARE = load_study(Path(__file__).parents[2] / "studies" / "compare.py")


def compare_runs(runs, *, out, **options):
    """Return the folder of the comparison, and its verdicts in words."""
    with redirect_stdout(StringIO()) as said:
        folder = run_study(COMPARE, out, {"runs": runs, **options})
    return folder, said.getvalue().splitlines()
