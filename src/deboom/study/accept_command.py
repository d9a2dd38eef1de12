"""What ``deboom accept`` does: a box and a table of parts become a run folder."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import pandas as pd

from deboom.errors import InputError
from deboom.files.atomic import replace_bytes
from deboom.files.delivered_parts import AXES, read_delivered_parts
from deboom.files.platform import read_platform
from deboom.files.run_folder import environment_record
from deboom.files.solution_box import AcceptanceBox, read_solution_box
from deboom.files.workbook import workbook_bytes
from deboom.study.command_run import run_command
from deboom.study.delivery import judged_delivery, limited_axes
from deboom.study.delivery_result import delivery_result
from deboom.study.progress import Progress
from deboom.study.result import StudyResult
from deboom.study.runner import PACKAGES

COMMAND = "accept"
BOX_FILE = "acceptance_box.json"


def box_file(path: Path) -> Path:
    """Return the file of a box: the path itself, or the box of a run folder.

    Raises
    ------
    InputError
        A folder without one.
    """
    if not path.is_dir():
        return path
    if not (path / BOX_FILE).is_file():
        raise InputError(
            f"{path} holds no {BOX_FILE}: give a run folder of the study solution_box, or the file"
        )
    return path / BOX_FILE


def write_parts_template(box_path: Path, path: Path, *, over_today: bool = False) -> None:
    """Write an empty table of parts for a box, one line per mount.

    Parameters
    ----------
    box_path : Path
        As for `box_file`.
    path : Path
        New ``.xlsx``.
    over_today : bool
        For stiffnesses over those of today's part.

    Raises
    ------
    InputError
        The file is there, or is no ``.xlsx``.
    """
    box = read_solution_box(box_file(box_path))
    if path.suffix != ".xlsx" or path.exists():
        raise InputError(f"{path}: a template is a new .xlsx file, give another name")
    axes = limited_axes(box, over_today=over_today)
    unit = "1" if over_today else "N/mm"
    rows = [
        {"part": "", "batch": "", "mount": mount, **{f"{axis} [{unit}]": "" for axis in AXES}}
        for mount, names in axes.items()
        if names
    ]
    replace_bytes(
        path,
        workbook_bytes(
            {"parts": pd.DataFrame(rows), "measure": _measure(box)},
            "Parts of a delivery: one row per part",
        ),
    )


def accept_into_run(
    box_path: Path,
    parts_path: Path,
    out: Path,
    platform: Path | None,
    uncertainty: float,
    seed: int,
    progress: Progress,
    *,
    over_today: bool = False,
) -> Path:
    """Judge a delivery and write a run folder.

    Parameters
    ----------
    box_path : Path
        Box, or run folder of the study ``solution_box``.
    parts_path : Path
        Table of parts.
    out : Path
        Folder that gets ``accept/<run>/``.
    platform : Path or None
        Folder of the platform that the box was found for.
    uncertainty : float
        Of a measured stiffness, relative, expanded to 95 % [1].
    seed : int
        Of the predicted cars, from 1.
    progress : callable
    over_today : bool
        The table holds stiffnesses over those of today's part.

    Returns
    -------
    Path
        The finished run folder.

    Raises
    ------
    InputError
        A box, a table or a platform that cannot be read or do not fit together; nothing is left
        behind.
    """
    begin = time.perf_counter()
    progress(0, 3, "reading")
    path = box_file(box_path)
    box = read_solution_box(path)
    axes = limited_axes(box, over_today=over_today)
    parts = read_delivered_parts(parts_path, axes, over_today=over_today)
    data = read_platform(platform) if platform is not None else None
    record: dict[str, Any] = {
        "study": COMMAND,
        "command": f"deboom accept {path.as_posix()} {parts_path.as_posix()}",
        "question": "Do these parts keep the acceptance box?",
        "seed": seed,
        "arguments": {
            "platform": platform.as_posix() if platform is not None else None,
            "uncertainty": uncertainty,
            "over-today": over_today,
            "seed": seed,
        },
        "environment": environment_record(PACKAGES),
    }

    def work() -> StudyResult:
        progress(1, 3, "parts and cars")
        delivery = judged_delivery(box, parts, data, uncertainty, seed, over_today=over_today)
        progress(2, 3, "tables and figures")
        files = data.input_files if data is not None else ()
        return delivery_result(delivery, (path, parts_path, *files))

    run = run_command(out, record, work, relative_to=None, begin=begin)
    progress(3, 3, "done")
    return run


def _measure(box: AcceptanceBox) -> pd.DataFrame:
    """Say what to measure, and the interval of each direction."""
    return pd.DataFrame(
        [
            {
                "direction": variable.name,
                "from [N/mm]": _rounded(variable.lower_stiffness),
                "to [N/mm]": _rounded(variable.upper_stiffness),
                "from, over today's [1]": round(variable.lower, 4),
                "to, over today's [1]": round(variable.upper, 4),
                "condition": variable.condition,
            }
            for variable in box.variables
            if variable.required
        ]
    )


def _rounded(stiffness: float | None) -> float:
    """Return a stiffness in N/mm with one decimal; nan where it is not known."""
    return math.nan if stiffness is None else round(1e-3 * stiffness, 1)
