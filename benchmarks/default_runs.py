"""Default runs of the studies, in processor seconds and memory, against a fixed work in numpy.

Every study that needs no folder runs once, as `deboom run STUDY` does. Its user and system seconds,
those of its processes too, are divided by those of the fixed work beside it: ratios carry over to
other machines, and `x recorded` shows a study that grew slower.

`python benchmarks/default_runs.py [STUDY ...]` records ratios in `default_runs.csv`: of all studies
in some minutes, on cores that do nothing else. Loops must be compiled before, by any run of
`deboom run front`, or the first study counts that as well.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.runs.runner import load_study

STUDIES = Path(__file__).parents[1] / "studies"
RECORD = Path(__file__).with_suffix(".csv")
MEGABYTE = 1024
"""Kilobytes, in which Linux counts the memory of a process."""


def report() -> str:
    """Run every study beside the fixed work and return the table as text."""
    table = measured(default_studies())
    recorded = pd.read_csv(RECORD, index_col="study")["x reference"]
    table["x recorded"] = table["x reference"] / recorded.reindex(table.index)
    return str(table.to_string(float_format="{:.2f}".format))


def default_studies() -> list[str]:
    """Names of the studies that run without an argument."""
    studies = (load_study(path.stem) for path in sorted(STUDIES.glob("[!_]*.py")))
    return [
        study.name
        for study in studies
        if all(option.default is not option.empty for option in study.parameters.values())
    ]


def measured(names: list[str]) -> pd.DataFrame:
    """Return processor seconds, their ratio to the fixed work, and peak memory of each study."""
    rows = {}
    for name in names:
        before = _reference()
        seconds, megabytes = _run(name)
        reference = 0.5 * (before + _reference())
        rows[name] = (seconds, seconds / reference, megabytes)
    columns = ["processor [s]", "x reference", "largest process [MB]"]
    return pd.DataFrame(rows, columns).T.rename_axis("study")


def _run(name: str) -> tuple[float, float]:
    """Processor seconds of a default run with its processes, and memory of the largest [MB]."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "deboom", "run", name, "--out", out]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        print(f"{name} …", file=sys.stderr)
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as process:
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"deboom run {name} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / MEGABYTE


def _reference() -> float:
    """Processor seconds of a fixed work: small solutions, large arrays and plain Python."""
    draws = np.random.default_rng(1)
    matrices, load = draws.random((20000, 6, 6)) + 6.0 * np.eye(6), draws.random((20000, 6, 1))
    long = draws.random(2_000_000)
    begin = time.process_time()
    for _ in range(20):
        np.linalg.solve(matrices, load)
        np.sort(long)
        sum(number % 7 for number in range(1_000_000))
    return time.process_time() - begin


if __name__ == "__main__":
    new = measured(sys.argv[1:] or default_studies())
    if RECORD.exists():
        new = new.combine_first(pd.read_csv(RECORD, index_col="study"))
    new.round(2).to_csv(RECORD)
    print(new.to_string(float_format="{:.2f}".format))
