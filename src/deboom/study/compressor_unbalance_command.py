"""What ``deboom unbalance`` does: a folder with an operating test becomes a run folder."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from deboom.compressor.acceptance import overall
from deboom.files.run_folder import RECORD, environment_record, finish_run, hash_files, start_run
from deboom.files.run_lock import LOCK, held
from deboom.study.compressor_unbalance import STEPS, UnbalancePlan, measured_unbalance
from deboom.study.compressor_unbalance_result import unbalance_result
from deboom.study.progress import Progress, counted
from deboom.study.runner import PACKAGES, command_of, save_result

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
    run = start_run(out, COMMAND, seed=SEED, record=record)
    try:
        with held(run.folder):
            measured = measured_unbalance(folder, plan, counted(progress, STEPS + 1))
            progress(STEPS, STEPS + 1, "tables and figures")
            inputs = measured.input_files
            result = unbalance_result(
                measured, command=command_of(record), inputs=inputs, with_figures=with_figures
            )
            used = {
                "facts": dict(result.facts),
                "inputs_sha256": hash_files(inputs, relative_to=folder),
                "wall_time_s": round(time.perf_counter() - begin, 3),
            }
            save_result(run, result, {**record, **used})
    except Exception:
        if {path.name for path in run.folder.iterdir()} <= {RECORD, LOCK}:
            run.discard()
        raise
    progress(STEPS + 1, STEPS + 1, "done")
    decision = overall(measured.verdicts).value if measured.verdicts else ""
    return finish_run(run), decision


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
