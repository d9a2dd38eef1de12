"""The command ``identify``: a compressor or a free body identified into a run folder."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from deboom.common import Progress
from deboom.compressor.identify import IdentifyOptions
from deboom.pages.compressor_identification import (
    STEPS,
    Beside,
    identified_test,
    read_test,
)
from deboom.pages.free_body import free_report
from deboom.pages.identification import identification_report
from deboom.report import Report
from deboom.runs.progress import counted
from deboom.runs.runner import run_command

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
    with_truth: bool = False,
) -> tuple[Path, tuple[str, ...]]:
    """Identify the compressor of a hammer test and write a run folder.

    - `folder`: holds ``compressor_test.toml``.
    - `out`: folder that gets ``identify/<run>/``.
    - `from_hits`: start from the blocks over time instead of the FRFs.
    - `with_truth`: compare with the truth of a virtual test.
    - returns `run`: the finished run folder; `alarms`: reasons not to trust the model, in words.
    - raises InputError: a test that cannot be read or identified, an output folder that cannot be
      written; nothing is left behind.
    """
    begin = time.perf_counter()
    progress(0, STEPS + 2, "reading")
    test, truth = read_test(folder, from_hits=from_hits, truth=with_truth)
    record: dict[str, Any] = {
        "study": COMMAND,
        "command": f"deboom identify {folder.as_posix()}",
        "question": "Which compressor explains this hammer test?",
        "seed": SEED,
        "arguments": {
            "band": [f"{low:g}-{high:g}" for low, high in options.bands],
            "lines": options.largest_lines,
            "smallest-coherence": options.smallest_coherence,
            "from-hits": from_hits,
            "thesis": beside.thesis,
            "identical-mounts": beside.identical_mounts,
            "truth": with_truth,
        },
    }
    alarms: tuple[str, ...] = ()

    def work() -> Report:
        nonlocal alarms
        step = counted(progress, STEPS + 2, 1)
        identified = identified_test(test, truth, options, beside, step, folder)
        progress(STEPS + 1, STEPS + 2, "tables and figures")
        alarms = identified.identification.alarms
        return identification_report(identified, identified.input_files)

    run = run_command(out, record, work, relative_to=folder, begin=begin)
    progress(STEPS + 2, STEPS + 2, "done")
    return run, alarms


def free_body_into_run(
    folder: Path,
    out: Path,
    band: tuple[float, float] | None = None,
    *,
    hung: bool = False,
    from_hits: bool = False,
    with_truth: bool = False,
) -> Path:
    """Identify a free or softly hung body from its hammer test and write a run folder.

    - `folder`: holds ``compressor_test.toml``; its mounts, where drawn, are not looked at.
    - `out`: folder that gets ``identify/<run>/``.
    - `band`: lines of the fit [Hz]; chosen from the data by default.
    - `hung`: fit the cords as well.
    - returns the finished run folder.
    - raises InputError: a test that cannot be read; a channel or impact that contradicts all
      others, or functions of another sign or quantity; see also `deboom.free_body`.
    """
    begin = time.perf_counter()
    test, truth = read_test(folder, from_hits=from_hits, truth=with_truth)
    record: dict[str, Any] = {
        "study": COMMAND,
        "command": f"deboom identify {folder.as_posix()} --free",
        "question": "Which mass, centre of gravity and inertia has this free body?",
        "seed": SEED,
        "arguments": {
            "band": None if band is None else f"{band[0]:g}-{band[1]:g}",
            "hung": hung,
            "from-hits": from_hits,
            "truth": with_truth,
        },
    }
    return run_command(
        out,
        record,
        lambda: free_report(test, truth, band, hung=hung),
        relative_to=folder,
        begin=begin,
    )
