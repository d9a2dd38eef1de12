"""What ``deboom identify`` does: a folder with a hammer test becomes a run folder."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from deboom.compressor.identify import IdentifyOptions
from deboom.files.run_folder import environment_record
from deboom.study.command_run import run_command
from deboom.study.compressor_identification import STEPS, Beside, identified_test, read_test
from deboom.study.compressor_identification_result import compressor_result
from deboom.study.progress import Progress
from deboom.study.result import StudyResult
from deboom.study.runner import PACKAGES

COMMAND = "identify"
SEED = 1
"""Identification draws nothing; a run folder states a seed all the same."""


def identify_into_run(
    folder: Path,
    out: Path,
    options: IdentifyOptions,
    beside: Beside,
    progress: Progress,
    *,
    from_hits: bool = False,
    with_figures: bool = True,
) -> Path:
    """Identify the compressor of a hammer test and write a run folder.

    Parameters
    ----------
    folder : Path
        Holds ``compressor_test.toml``.
    out : Path
        Folder that gets ``identify/<run>/``.
    options : IdentifyOptions
    beside : Beside
    progress : callable
    from_hits : bool
        Start from the blocks over time instead of the FRFs.
    with_figures : bool

    Returns
    -------
    Path
        The finished run folder.

    Raises
    ------
    InputError
        A test that cannot be read or identified, an output folder that cannot be written; nothing
        is left behind.
    """
    begin = time.perf_counter()
    progress(0, STEPS + 2, "reading")
    test, truth = read_test(folder, from_hits=from_hits)
    record = _record(folder, options, beside, from_hits=from_hits, with_figures=with_figures)
    done = 0

    def step(text: str) -> None:
        nonlocal done
        done += 1
        progress(min(done, STEPS), STEPS + 2, text)

    def work() -> StudyResult:
        identified = identified_test(test, truth, options, beside, step, folder)
        progress(STEPS + 1, STEPS + 2, "tables and figures")
        return compressor_result([identified], identified.input_files, with_figures=with_figures)

    run = run_command(out, record, work, relative_to=folder, begin=begin)
    progress(STEPS + 2, STEPS + 2, "done")
    return run


def _record(
    folder: Path,
    options: IdentifyOptions,
    beside: Beside,
    *,
    from_hits: bool,
    with_figures: bool,
) -> dict[str, Any]:
    """Gather what is known of a run before it begins."""
    return {
        "study": COMMAND,
        "command": f"deboom identify {folder.as_posix()}",
        "question": "Which compressor explains this hammer test?",
        "seed": SEED,
        "arguments": {
            "band": [f"{low:g}-{high:g}" for low, high in options.bands],
            "lines": options.largest_lines,
            "smallest-coherence": options.smallest_coherence,
            "held-out": options.held_out,
            "from-hits": from_hits,
            "thesis": beside.thesis,
            "reference": beside.reference,
            "identical-mounts": beside.identical_mounts,
            "figures": with_figures,
        },
        "environment": environment_record(PACKAGES),
    }
