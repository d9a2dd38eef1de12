"""The command ``unbalance``: a running compressor evaluated into a run folder."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from deboom.common import Progress
from deboom.compressor.acceptance import overall
from deboom.pages.compressor_unbalance import (
    STEPS,
    UnbalancePlan,
    measured_unbalance,
)
from deboom.pages.unbalance import unbalance_report
from deboom.report import Report
from deboom.runs.overview import command_of
from deboom.runs.progress import counted
from deboom.runs.runner import run_command

COMMAND = "unbalance"


SEED = 1
"""Nothing is drawn; a run folder states a seed all the same."""


def unbalance_into_run(
    folder: Path,
    out: Path,
    plan: UnbalancePlan,
    progress: Progress,
) -> tuple[Path, str]:
    """Evaluate the test of a running compressor and write a run folder.

    - `folder`: holds ``operation.toml``.
    - `out`: folder that gets ``unbalance/<run>/``.
    - returns `run`: the finished run folder; `decision`: ``pass``, ``fail`` or ``undecided``; empty
      without limits.
    - raises InputError: a test that cannot be read or evaluated, an output folder that cannot be
      written; nothing is left behind.
    """
    begin = time.perf_counter()
    options, sense = plan.unbalance, plan.unbalance.expected_sense
    low, high = options.band
    record: dict[str, Any] = {
        "study": COMMAND,
        "command": f"deboom unbalance {folder.as_posix()}",
        "question": "Which unbalance turns inside this compressor?",
        "seed": SEED,
        "arguments": {
            "limits": None if plan.limits is None else plan.limits.path.as_posix(),
            "route": plan.route,
            "identified": None if plan.identified is None else plan.identified.as_posix(),
            "hoses": None if options.hoses is None else options.hoses.value,
            "sense": None if sense is None else sense.name.lower(),
            "band": f"{low:g}-{high:g}",
            "confidence": options.confidence,
            "softening": options.softening.value,
            "truth": plan.truth,
        },
    }
    decision = ""

    def work() -> Report:
        nonlocal decision
        measured = measured_unbalance(folder, plan, counted(progress, STEPS + 1))
        progress(STEPS, STEPS + 1, "tables and figures")
        decision = overall(measured.verdicts).value if measured.verdicts else ""
        return unbalance_report(measured, measured.input_files, command=command_of(record))

    run = run_command(out, record, work, relative_to=folder, begin=begin)
    progress(STEPS + 1, STEPS + 1, "done")
    return run, decision
