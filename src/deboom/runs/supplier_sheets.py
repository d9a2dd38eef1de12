"""The supplier's sheets of a finished run: opened, written and kept."""

from __future__ import annotations

import re
from pathlib import Path

from deboom.choices import Language, Pick
from deboom.errors import InputError
from deboom.files.run_folder import check_files, read_run
from deboom.runs.rebuilt import study_of, supplier_study
from deboom.runs.runner import arguments_of
from deboom.supplier.importance import importance_sheets, is_sensitivity
from deboom.supplier.numbers import SupplierEffects
from deboom.supplier.page import (
    NOTHING,
    STEM,
    WrittenSheets,
    documents,
    middle_design,
    provenance,
    written_sheets,
)
from deboom.supplier.sheet import MountSheet
from deboom.supplier.sources import (
    SheetFiles,
    bands,
    refuse_leaks,
    secrets_of,
    sheet_sources,
)
from deboom.vehicles.platform import Runs


def supplier_sheets(
    folder: Path,
    *,
    mount: str | None = None,
    anonymous: bool = False,
    out: Path | None = None,
    studies: Path | None = None,
    pick: Pick | Path = Pick.best_mean,
    files: SheetFiles = NOTHING,
    language: Language = Language.en,
) -> WrittenSheets:
    """Write page and workbook of a sheet, for one mount or for each.

    Parameters
    ----------
    folder : Path
        Finished run of a front study, or of a sensitivity study: then the sheets tell how much
        hangs on each direction.
    mount : str or None
        The part; None: every mount gets a sheet.
    anonymous : bool
        Show no vehicle, group or platform, no limit and no command; refuse a sheet in which a name
        or path is left.
    out : Path or None
        Folder that gets the files, made when missing; None: ``supplier`` in the run's folder.
    studies : Path or None
        Folder with the script of the run; None: deboom's own.
    pick : Pick or Path
        Design of the front that is wanted, or a file that holds one.
    files : SheetFiles
        What the sheet rests on beside the run.
    language : Language

    Raises
    ------
    InputError
        A run that is no front study, misses a file or holds an edited one; an unknown mount; a
        file that belongs to something else; a leak; a sheet that is there already; a folder that
        cannot be written. Nothing is written then.
    """
    entry = read_run(folder)
    if is_sensitivity(entry):
        if files != NOTHING or pick is not Pick.best_mean:
            raise InputError(
                f"run {entry.folder} has sensitivities and no front: --box, --tolerances, "
                "--sharing, --since and --design belong to a front's sheet"
            )
        check_files(entry)
        study = study_of(entry, studies)
        runs = study.model(arguments_of(entry, study))
        if not isinstance(runs, Runs):
            raise InputError(f"run {entry.folder}: its study {entry.study} is not about a platform")
        pages = importance_sheets(
            entry, runs.platform, mount=mount, anonymous=anonymous, language=language, stem=STEM
        )
        return written_sheets(entry, out, pages, ())
    front = supplier_study(folder, studies, pick)
    front.of(mount)
    sources = sheet_sources(front, files)
    effects = SupplierEffects(front, middle_design(front, bands(front, sources)))
    secrets = secrets_of(front) if anonymous else ()
    chosen = [one for one in front.platform.mounts if mount in (None, one.name)]
    contents, missing = dict[str, bytes](), dict[str, None]()
    for one in chosen:
        content = MountSheet(front, sources, effects, one, secrets, language)
        stem = "_".join([STEM, re.sub(r"[^\w-]+", "-", one.name), *["anonymous"][: int(anonymous)]])
        page, workbook = documents(content, provenance(content, files))
        refuse_leaks(secrets, {"file names": stem})
        contents |= {f"{stem}.html": page.encode(), f"{stem}.xlsx": workbook}
        missing |= dict.fromkeys(content.missing)
    return written_sheets(entry, out, contents, tuple(missing))
