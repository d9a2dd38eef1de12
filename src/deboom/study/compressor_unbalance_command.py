"""What ``deboom unbalance`` does: a folder with an operating test becomes a run folder."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from deboom.compressor.acceptance import overall
from deboom.files.run_folder import environment_record
from deboom.study.command_run import run_command
from deboom.study.compressor_unbalance import STEPS, UnbalancePlan, measured_unbalance
from deboom.study.compressor_unbalance_result import unbalance_result
from deboom.study.progress import Progress, counted
from deboom.study.result import StudyResult
from deboom.study.runner import PACKAGES, command_of

COMMAND = "unbalance"
SEED = 1
"""Nothing is drawn; a run folder states a seed all the same."""


def unbalance_into_run(
    folder: Path,
    out: Path,
    plan: UnbalancePlan,
    progress: Progress,
    *,
    with_figures: bool = True,
) -> tuple[Path, str]:
    """Evaluate the test of a running compressor and write a run folder.

    Parameters
    ----------
    folder : Path
        Holds ``operation.toml``.
    out : Path
        Folder that gets ``unbalance/<run>/``.
    plan : UnbalancePlan
    progress : callable
    with_figures : bool

    Returns
    -------
    run : Path
        The finished run folder.
    decision : str
        ``pass``, ``fail`` or ``undecided``; empty without limits.

    Raises
    ------
    InputError
        A test that cannot be read or evaluated, an output folder that cannot be written; nothing
        is left behind.
    """
    begin = time.perf_counter()
    record = _record(folder, plan, with_figures=with_figures)
    decision = ""

    def work() -> StudyResult:
        nonlocal decision
        measured = measured_unbalance(folder, plan, counted(progress, STEPS + 1))
        progress(STEPS, STEPS + 1, "tables and figures")
        decision = overall(measured.verdicts).value if measured.verdicts else ""
        return unbalance_result(
            measured,
            command=command_of(record),
            inputs=measured.input_files,
            with_figures=with_figures,
        )

    run = run_command(out, record, work, relative_to=folder, begin=begin)
    progress(STEPS + 1, STEPS + 1, "done")
    return run, decision


def _record(folder: Path, plan: UnbalancePlan, *, with_figures: bool) -> dict[str, Any]:
    """Gather what is known of a run before it begins."""
    options = plan.unbalance
    low, high = options.band
    return {
        "study": COMMAND,
        "command": f"deboom unbalance {folder.as_posix()}",
        "question": "Which unbalance turns inside this compressor?",
        "seed": SEED,
        "arguments": {
            "limits": None if plan.limits is None else plan.limits.path.as_posix(),
            "route": plan.route,
            "identified": None if plan.identified is None else plan.identified.as_posix(),
            "hoses": None if options.hoses is None else options.hoses.value,
            "sense": None
            if options.expected_sense is None
            else options.expected_sense.name.lower(),
            "band": f"{low:g}-{high:g}",
            "confidence": options.confidence,
            "figures": with_figures,
        },
        "environment": environment_record(PACKAGES),
    }
