"""Comparing runs into a run folder of its own."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from deboom.errors import InputError
from deboom.explore.seeds import checked_seed
from deboom.files.run_folder import environment_record, finish_run, hash_files, start_run
from deboom.study.compare import comparison
from deboom.study.compare_page import QUESTION, sentences
from deboom.study.compare_result import compare_result
from deboom.study.overview import refresh_overview
from deboom.study.progress import progress_bar
from deboom.study.runner import PACKAGES, save_result

STUDY = "compare"


def compare(
    folders: Sequence[Path], *, out: Path, studies: Path, samples: int, seed: int
) -> tuple[Path, list[str]]:
    """Compare the fronts of runs and write ``<out>/compare/<run>/``.

    Parameters
    ----------
    folders : sequence of Path
        Two run folders or more.
    out : Path
        Folder of all results.
    studies : Path
        Folder with the study scripts.
    samples : int
        Common draws, a power of two from 1024.
    seed : int
        Of the common draws, from 1.

    Returns
    -------
    folder : Path
        The finished run folder.
    verdicts : list of str
        In words.

    Raises
    ------
    InputError
        See `deboom.study.compare.comparison`; nothing is left behind.
    """
    checked_seed(seed)
    begin = time.perf_counter()
    shown = [folder.as_posix() for folder in folders]
    record = {
        "study": STUDY,
        "question": QUESTION,
        "seed": seed,
        "runs": shown,
        "command": " ".join(["deboom compare", *shown]),
        "arguments": {"seed": seed, "samples": samples, "studies": studies.as_posix()},
        "environment": environment_record(PACKAGES),
    }
    run = start_run(out, STUDY, seed=seed, record=record)
    try:
        with progress_bar("common draws") as bar:
            study = comparison(folders, studies, samples, seed, bar)
        result = compare_result(study)
        used = {
            "facts": dict(result.facts),
            "inputs_sha256": hash_files(result.inputs, relative_to=Path.cwd()),
            "wall_time_s": round(time.perf_counter() - begin, 3),
        }
        save_result(run, result, {**record, **used})
    except InputError:
        run.discard()
        raise
    folder = finish_run(run)
    refresh_overview(out)
    return folder, sentences(study)
