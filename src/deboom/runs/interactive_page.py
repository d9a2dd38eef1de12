"""The interactive page of a finished run: opened, gathered and written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from deboom.explore.choices import Pick
from deboom.files.disk import made_folder, replace_bytes
from deboom.files.front_table import FRONT
from deboom.files.run_folder import check_files, read_run
from deboom.pages.interactive_front import (
    DOE,
    interactive_doe,
    interactive_front,
    overlaid,
    with_evaluated,
)
from deboom.report.interactive import render_interactive
from deboom.runs.overview import INTERACTIVE
from deboom.runs.rebuilt import prepared_again, study_of, supplier_study
from deboom.tabled import PACKED


def write_interactive_page(
    folder: Path,
    *,
    studies: Path | None,
    out: Path | None = None,
    beside: Path | None = None,
    vehicles: Sequence[str] = (),
) -> Path:
    """Write the interactive page of a run.

    Parameters
    ----------
    folder : Path
        Finished run of a front study, or of designs of an experiment.
    studies : Path or None
        Folder with the script of the run; None: deboom's own.
    out : Path or None
        Folder that gets the page, made when missing; None: the run's.
    beside : Path or None
        Another run of a front study, whose front lies over this one.
    vehicles : sequence of str
        Vehicles whose levels the page computes; none: all that the run served.

    Returns
    -------
    Path
        ``interactive.html``; an older one is replaced.

    Raises
    ------
    InputError
        A run that is neither, misses a file or holds an edited one; two runs of other variables,
        vehicles or lines; a vehicle that the run did not serve; a folder that cannot be written.
        Nothing is written then.
    """
    entry = read_run(folder)
    kept = {name.removesuffix(PACKED) for name in entry.record["files_sha256"]}
    if beside is None and {DOE, FRONT} & kept == {DOE}:
        check_files(entry)
        model = prepared_again(entry, study_of(entry, studies))
        page = interactive_doe(entry, model, vehicles)
    else:
        study = supplier_study(folder, studies, Pick.best_mean)
        page = interactive_front(study, vehicles)
        if beside is not None:
            page = overlaid(page, interactive_front(supplier_study(beside, studies, study.pick)))
        page = with_evaluated(page, study)
    html = render_interactive(page)
    place = made_folder(entry.writable() if out is None else out)
    path = place / INTERACTIVE
    replace_bytes(path, html.encode("utf-8"))
    return path
