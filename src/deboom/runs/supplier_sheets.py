"""The supplier's sheets of a finished run: opened, written and kept."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from deboom.compressor.mounted_fleet import MountedFleet
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.files.acceptance import Programme, read_programme, read_specification
from deboom.files.front_run import ComparedRun, MountedModel
from deboom.files.run_folder import RunEntry, check_files, read_run
from deboom.language import Language
from deboom.runs.rebuilt import compared_run, study_of, supplier_study_of
from deboom.runs.runner import arguments_of
from deboom.supplier.compressor_sheet import CompressorParts, CompressorSheet
from deboom.supplier.importance import importance_sheets, is_sensitivity
from deboom.supplier.mount_sheet import MountSheet
from deboom.supplier.numbers import SupplierEffects
from deboom.supplier.page import NOTHING, STEM, WrittenSheets, documents, provenance, written_sheets
from deboom.supplier.sheet import PartSheet
from deboom.supplier.sources import (
    SheetFiles,
    bands,
    middle_design,
    refuse_leaks,
    secrets_of,
    sheet_sources,
)
from deboom.vehicles.platform import Runs


@dataclass(frozen=True, kw_only=True)
class SheetOrder:
    """What is ordered of a run's sheets; see `supplier_sheets`."""

    mount: str | None
    anonymous: bool
    pick: Pick | Path
    files: SheetFiles
    language: Language
    issued: str
    decibels: bool


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
    decibels: bool = True,
) -> WrittenSheets:
    """Write page and workbook of a sheet, for one mount or for each.

    Parameters
    ----------
    folder : Path
        Finished run of a front study, of a powertrain's or a compressor's mounts, or of a
        sensitivity study: then the sheets tell how much hangs on each direction.
    mount : str or None
        The part; None: every mount gets a sheet.
    anonymous : bool
        Show no vehicle, group or platform, no limit, level, run and command; refuse a sheet in
        which a name or path is left.
    out : Path or None
        Folder that gets the files, made when missing; None: ``supplier`` in the run's folder.
    studies : Path or None
        Folder with the script of the run; None: deboom's own.
    pick : Pick or Path
        Design of the front that is wanted, or a file that holds one.
    files : SheetFiles
        What the sheet rests on beside the run.
    language : Language
    decibels : bool
        Say what parts and tolerances bring in the cabin.

    Raises
    ------
    InputError
        A run that is no front study, misses a file or holds an edited one; an unknown mount; a
        file that belongs to something else; a leak; a sheet that is there already; a folder that
        cannot be written. Nothing is written then.
    """
    entry = read_run(folder)
    order = SheetOrder(
        mount=mount,
        anonymous=anonymous,
        pick=pick,
        files=files,
        language=language,
        issued=datetime.now(UTC).date().isoformat(),
        decibels=decibels,
    )
    if is_sensitivity(entry):
        return _importance(entry, order, out, studies)
    run = compared_run(folder, studies)
    if isinstance(run.prepared, MountedModel):
        sheets = _compressor_sheets(run, run.prepared.mounted, order)
    else:
        sheets = _mount_sheets(run, order)
    contents, missing = dict[str, bytes](), dict[str, None]()
    for content in sheets:
        part = re.sub(r"[^\w-]+", "-", content.part)
        stem = "_".join([STEM, part, *["anonymous"][: int(anonymous)]])
        page, workbook = documents(content, provenance(entry, content, files, pick))
        refuse_leaks(content.secrets, {"file names": stem})
        contents |= {f"{stem}.html": page.encode(), f"{stem}.xlsx": workbook}
        missing |= dict.fromkeys(content.missing)
    return written_sheets(entry, out, contents, tuple(missing))


def _mount_sheets(run: ComparedRun, order: SheetOrder) -> Iterator[PartSheet]:
    """Give the sheets of a powertrain's mounts."""
    front = supplier_study_of(run, order.pick)
    front.of(order.mount)
    sources = sheet_sources(front, order.files)
    effects = SupplierEffects(front, middle_design(front, bands(front, sources)))
    for each in front.platform.mounts:
        if order.mount in (None, each.name):
            yield MountSheet(
                study=front,
                sources=sources,
                effects=effects,
                mount=each,
                secrets=secrets_of(front) if order.anonymous else (),
                language=order.language,
                issued=order.issued,
                decibels=order.decibels,
            )


def _compressor_sheets(
    run: ComparedRun, mounted: MountedFleet, order: SheetOrder
) -> Iterator[PartSheet]:
    """Give the sheets of a compressor's mounts."""
    if any((order.files.box, order.files.tolerances, order.files.sharing)):
        raise InputError(
            f"run {run.entry.folder} is of a compressor's mounts: --box, --tolerances and "
            "--sharing belong to a platform's mounts"
        )
    folders = run.entry.record["arguments"].get("cars") or ()
    parts = CompressorParts(
        run=run,
        pick=order.pick,
        index=mounted.index,
        statics=mounted.statics,
        reference_line=mounted.reference_line,
        amplitude=mounted.amplitude_at_reference,
        deviation=mounted.deviation_at_reference,
        programme=Programme(),
        since=None if order.files.since is None else read_specification(order.files.since),
    )
    chosen = parts.of(order.mount)
    if folders:  # a programme lies beside the first car, which has the compressor
        programme = read_programme(Path(folders[0]), parts.parts)
        parts = replace(parts, programme=programme)
    for name in chosen:
        yield CompressorSheet(
            parts=parts,
            name=name,
            secrets=parts.secrets if order.anonymous else (),
            language=order.language,
            issued=order.issued,
            decibels=order.decibels,
        )


def _importance(
    entry: RunEntry, order: SheetOrder, out: Path | None, studies: Path | None
) -> WrittenSheets:
    """Write what a sensitivity study says of each mount."""
    if order.files != NOTHING or order.pick is not Pick.best_mean:
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
        entry,
        runs,
        mount=order.mount,
        anonymous=order.anonymous,
        language=order.language,
        stem=STEM,
        issued=order.issued,
        decibels=order.decibels,
    )
    return written_sheets(entry, out, pages, ())
