"""What every command does that leaves a run folder: carry out, keep, or leave nothing behind."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from deboom.files.run_folder import RECORD, finish_run, hash_files, start_run
from deboom.files.run_lock import LOCK, held
from deboom.study.result import StudyResult
from deboom.study.runner import save_result


def run_command(
    out: Path,
    record: Mapping[str, Any],
    work: Callable[[], StudyResult],
    *,
    relative_to: Path | None,
    begin: float,
) -> Path:
    """Carry out a command and keep its result in ``<out>/<command>/<run>/``.

    Parameters
    ----------
    out : Path
    record : mapping
        What is known before it begins; ``study`` is the command's name, ``seed`` its seed.
    work : callable
        Gives the result.
    relative_to : Path or None
        Folder that the names of the inputs count from; None: each from its own.
    begin : float
        `time.perf_counter` when the command was called [s].

    Returns
    -------
    Path
        The finished run folder.

    Raises
    ------
    InputError
        The folder cannot be written, or what `work` raises; nothing is left behind then.
    """
    run = start_run(out, record["study"], seed=record["seed"], record=dict(record))
    try:
        with held(run.folder):
            result = work()
            hashes: dict[str, str] = {}
            for path in result.inputs:
                hashes |= hash_files([path], relative_to=relative_to or path.parent)
            used = {
                "facts": dict(result.facts),
                "inputs_sha256": hashes,
                "wall_time_s": round(time.perf_counter() - begin, 3),
            }
            save_result(run, result, {**record, **used})
    except Exception:
        if {path.name for path in run.folder.iterdir()} <= {RECORD, LOCK}:
            run.discard()
        raise
    return finish_run(run)
