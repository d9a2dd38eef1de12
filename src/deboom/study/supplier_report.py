"""The page and the workbook for a mount supplier, made from the run of a front study."""

from __future__ import annotations

import re
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.errors import InputError
from deboom.files.atomic import replace_bytes
from deboom.files.run_folder import hash_files
from deboom.files.workbook import workbook_bytes
from deboom.report.page import render_page
from deboom.study.motion_report import motion_report
from deboom.study.specification_sheet import specification_sheet
from deboom.study.specification_sources import (
    SpecificationFiles,
    SpecificationSources,
    specification_sources,
)
from deboom.study.specification_tables import specification_tables
from deboom.study.supplier_curves import stiffness_curves
from deboom.study.supplier_effects import ALL, SupplierEffects, part_table
from deboom.study.supplier_figures import SupplierContent, supplier_figures
from deboom.study.supplier_names import (
    ShownNames,
    page_text,
    refuse_leaks,
    shown_names,
    workbook_text,
)
from deboom.study.supplier_page import supplier_page
from deboom.study.supplier_pick import Pick
from deboom.study.supplier_study import SupplierStudy, supplier_study
from deboom.study.supplier_tables import (
    condition_table,
    curve_table,
    data_sheet,
    importance_table,
    part_summary,
    quality_table,
    requirement_table,
    source_table,
    tolerance_table,
)

STEM = "supplier_report"
NOTHING = SpecificationFiles()


def supplier_report(
    folder: Path,
    *,
    mount: str | None,
    anonymous: bool,
    out: Path | None,
    studies: Path,
    pick: Pick = Pick.best_mean,
    pieces: SpecificationFiles = NOTHING,
) -> tuple[Path, Path]:
    """Write the page and the workbook for a mount supplier.

    Parameters
    ----------
    folder : Path
        Finished run of a front study.
    mount : str or None
        The part of this supplier; None: all mounts.
    anonymous : bool
        Call vehicles by letters, and refuse a report in which a name or path is left.
    out : Path or None
        Folder that gets both files, made when missing; None: ``supplier`` in the run's folder.
    studies : Path
        Folder with the study scripts.
    pick : Pick
        Design of the front that is wanted.
    pieces : SpecificationFiles
        Of the specification sheet, beside the run.

    Returns
    -------
    page, workbook : Path
        Written; older ones of the same name are replaced.

    Raises
    ------
    InputError
        A run that is no front study, misses a file or holds an edited one; an unknown mount; a
        piece of the sheet that belongs to something else; a leak; a folder that cannot be written.
        Nothing is written then.
    """
    study = supplier_study(folder, studies, pick)
    study.of(mount)
    names = shown_names(study, anonymous=anonymous)
    content = supplier_content(study, mount, names, specification_sources(study, pieces))
    # pictures cannot be searched: whatever they show stands in a table as well
    tables = {f"table of {name}": table.to_csv() for name, table in content.tables.items()}
    refuse_leaks(names.secrets, tables)
    html, workbook = supplier_documents(content, pieces)
    stem = "_".join(
        [
            STEM,
            *([re.sub(r"[^\w-]+", "-", mount)] if mount else []),
            *(["anonymous"] if anonymous else []),
        ]
    )
    texts = {"page": page_text(html), "workbook": workbook_text(workbook), "file names": stem}
    refuse_leaks(names.secrets, texts)
    place = study.run.entry.folder / "supplier" if out is None else out
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{place} cannot be made a folder ({error.strerror or error}): choose another --out"
        ) from None
    page_path, workbook_path = place / f"{stem}.html", place / f"{stem}.xlsx"
    replace_bytes(page_path, html.encode("utf-8"))
    replace_bytes(workbook_path, workbook)
    return page_path, workbook_path


def supplier_documents(content: SupplierContent, pieces: SpecificationFiles) -> tuple[str, bytes]:
    """Return the page as HTML and the workbook as xlsx."""
    page = supplier_page(content, supplier_figures(content), _provenance(content, pieces))
    what = f"mount {content.mount}" if content.mount else "the mounts"
    sheets = {name: table for name, table in content.tables.items() if len(table)}
    return render_page(page), workbook_bytes(sheets, f"What {what} should be")


def supplier_content(
    study: SupplierStudy, mount: str | None, names: ShownNames, sources: SpecificationSources
) -> SupplierContent:
    """Compute everything that page and workbook show.

    Parameters
    ----------
    study : SupplierStudy
        What is asked for.
    mount : str or None
        The part that it is about; None: all.
    names : ShownNames
        Of the vehicles.
    sources : SpecificationSources
        Of the sheet.
    """
    directions, effects = study.of(mount), SupplierEffects(study)
    curves = stiffness_curves(study, directions)
    parts = part_table(effects, names)
    shown = [f"only {one.name}" for one in study.platform.mounts if mount in (None, one.name)]
    parts = parts[parts["changed"].isin([*shown, ALL])]
    sheet = specification_sheet(study, sources, directions, curves, effects.certainty, names)
    tables: dict[str, pd.DataFrame] = {
        **specification_tables(sheet),
        "requirements": requirement_table(study, directions, curves, effects.certainty),
        "conditions": condition_table(curves),
        "curves": curve_table(study, curves),
        "part alone": parts,
        "part alone, summary": part_summary(effects, parts),
        "importance": importance_table(effects, directions, names),
        "tolerances": tolerance_table(effects, directions, names),
        "quality": quality_table(directions),
        "errors": source_table(effects.certainty),
        "data sheet": data_sheet(study, mount, names, datetime.now(UTC).date()),
    }
    designs = np.stack([study.space.nominal, study.wanted])
    checked = motion_report(study.motion_index, designs)
    return SupplierContent(effects, mount, directions, curves, names, tables, checked, sheet)


def _provenance(content: SupplierContent, pieces: SpecificationFiles) -> dict[str, object]:
    """Return the footer; an anonymous one has no command and no file names."""
    entry, study = content.study.run.entry, content.study
    facts: dict[str, object] = {
        "run": entry.name,
        "draws": content.study.check.sample.n_samples,
        "seed": study.run.seed,
    }
    if content.names.anonymous:
        return facts
    mount = f" --mount {content.mount}" if content.mount else ""
    design = "" if study.pick is Pick.best_mean else f" --design {study.pick.value}"
    given = "".join(
        f" --{field.name} {path.as_posix()}"
        for field in fields(pieces)
        if (path := getattr(pieces, field.name)) is not None
    )
    record = hash_files([entry.folder / "run.json"], relative_to=entry.folder)
    return {
        "command": f"deboom report {entry.folder.as_posix()} --supplier{mount}{design}{given}",
        **facts,
        "study": entry.study,
        "inputs": {**record, **entry.record["inputs_sha256"]},
    }
