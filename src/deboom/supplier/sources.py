"""Demands on a mount supplier, from the finished run of a front study."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import unescape
from pathlib import Path

import numpy as np
import pandas as pd
from openpyxl import load_workbook

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.acceptance import (
    AcceptanceBox,
    Programme,
    SupplierSpecification,
    read_programme,
    read_solution_box,
    read_specification,
)
from deboom.files.front_run import design_name
from deboom.files.platform import platform_sha256
from deboom.files.run_folder import RunEntry, check_files, hash_files, read_run
from deboom.files.tables import read_frame
from deboom.pages.motion import factor_name
from deboom.pages.supplier_study import SupplierStudy
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.free_directions import Need
from deboom.vehicles.platform import Platform

ALLOCATION, PART_NUMBERS = "allocation.csv", "part_numbers.csv"


@dataclass(frozen=True)
class SheetFiles:
    """Files that a sheet may rest on beside the run of the front; each may be missing.

    Parameters
    ----------
    box : Path or None
        Acceptance box, or the run of ``solution_box`` that made it.
    tolerances : Path or None
        Run of ``tolerance_allocation`` for this front.
    sharing : Path or None
        Run of ``commonality`` for this platform.
    since : Path or None
        Workbook of an older sheet of the same mount.
    """

    box: Path | None = None
    tolerances: Path | None = None
    sharing: Path | None = None
    since: Path | None = None


@dataclass(frozen=True, eq=False)
class SheetSources:
    """Content of these files, and the programme of the platform.

    Parameters
    ----------
    programme : Programme
    box : AcceptanceBox or None
    tolerance : mapping of str to float
        Allocated half width by direction; empty if none was allocated [1].
    shared : DataFrame or None
        Table ``part_numbers`` of a run of ``commonality``.
    since : SupplierSpecification or None
    """

    programme: Programme
    box: AcceptanceBox | None
    tolerance: Mapping[str, float]
    shared: pd.DataFrame | None
    since: SupplierSpecification | None


def sheet_sources(study: SupplierStudy, files: SheetFiles) -> SheetSources:
    """Read what a sheet rests on, and refuse what belongs to something else.

    Raises
    ------
    InputError
        A file that cannot be read or was edited; a box of other vehicles, directions, data or of
        another kind of stiffness factor; tolerances of another front or design; shared parts of
        other data; an unknown field or mount of the programme.
    """
    mounts = tuple(mount.name for mount in study.platform.mounts)
    return SheetSources(
        read_programme(study.platform.folder, mounts),
        None if files.box is None else _box(study, files.box),
        {} if files.tolerances is None else _tolerances(study, files.tolerances),
        None if files.sharing is None else _shared(study, files.sharing),
        None if files.since is None else read_specification(files.since),
    )


def _box(study: SupplierStudy, path: Path) -> AcceptanceBox:
    box = read_solution_box(path)
    again = f"run solution_box --front {study.run.entry.folder.as_posix()}"
    for what, mine, theirs in (
        ("directions", [d.name for d in study.directions], [v.name for v in box.variables]),
        ("vehicles", list(study.vehicles), [response.name for response in box.responses]),
    ):
        if mine != theirs:
            raise InputError(
                f"--box {path}: its {what} are {', '.join(theirs)}, those of run "
                f"{study.run.entry.folder} {', '.join(mine)}: {again}"
            )
    if factor_name(study.index) == Factor.part.value:
        raise InputError(
            f"--box {path}: a box has intervals of the dynamic stiffness, run "
            f"{study.run.entry.folder} has factors of the part: search the front with --factor "
            "dynamic"
        )
    if box.platform_sha256 != platform_sha256(study.platform):
        raise InputError(f"--box {path}: it was found with other files of the platform: {again}")
    return box


def _tolerances(study: SupplierStudy, path: Path) -> dict[str, float]:
    entry = _run("--tolerances", path, ALLOCATION, "tolerance_allocation")
    front, arguments = study.run.entry, entry.record["arguments"]
    record = hash_files([front.folder / "run.json"], relative_to=front.folder)["run.json"]
    is_recorded, name = record in entry.record["inputs_sha256"].values(), design_name(study.pick)
    if not is_recorded or arguments["pick"] != name or arguments["point"] is not None:
        raise InputError(
            f"--tolerances {path}: its tolerances belong to another design: run "
            f"tolerance_allocation --from-run {front.folder.as_posix()} --pick {name}"
        )
    table = read_frame(entry.folder / ALLOCATION, ("variable",))
    return dict(zip(table["variable"], table["cheapest ± [%]"] / 100.0, strict=True))


def _shared(study: SupplierStudy, path: Path) -> pd.DataFrame:
    entry = _run("--sharing", path, PART_NUMBERS, "commonality")
    files = study.platform.input_files
    mine = hash_files(files, relative_to=study.platform.folder).values()
    if not set(mine) <= set(entry.record["inputs_sha256"].values()):
        raise InputError(
            f"--sharing {path}: it was found with other files of the platform: run commonality "
            f"--platform {study.platform.folder.as_posix()}"
        )
    return read_frame(entry.folder / PART_NUMBERS, ("vehicles",))


def _run(option: str, path: Path, file: str, study: str) -> RunEntry:
    entry = read_run(path)
    check_files(entry)
    if file not in entry.record["files_sha256"]:
        raise InputError(f"{option} {path} has no {file}: give a run folder of the study {study}")
    return entry


def bands(study: SupplierStudy, sources: SheetSources) -> dict[str, tuple[float, float] | None]:
    """Return the band of every direction as stiffness factors; None where nothing is asked.

    It is the box's; where no box was made, that of the tolerance allocation, or else that of the
    search, about the pick where that is wanted and about today's part where that will do.
    """
    band_of: dict[str, tuple[float, float] | None] = {}
    for direction in study.directions:
        band_of[direction.name] = None
        if direction.need is Need.nothing:
            continue
        if sources.box is not None:
            variable = sources.box.variable(direction.name)
            if direction.need is not Need.unknown or variable.set_by_limit:
                band_of[direction.name] = (variable.lower, variable.upper)
        elif direction.need is not Need.unknown:
            wanted = direction.need is Need.wanted
            middle = (study.wanted if wanted else study.space.nominal)[direction.column]
            half = float(study.space.tolerance[direction.column])
            half = sources.tolerance.get(direction.name, half)
            band_of[direction.name] = (float(middle * (1 - half)), float(middle * (1 + half)))
    return band_of


def middle_design(
    study: SupplierStudy, intervals: Mapping[str, tuple[float, float] | None]
) -> RealArray:
    """Return the design in the middle of all bands, today's where there is none, (k,) [1]."""
    design = np.array(study.wanted)
    for direction in study.directions:
        band = intervals[direction.name]
        design[direction.column] = 1.0 if band is None else 0.5 * sum(band)
    return design


_CONTEXT = 30


def secrets_of(study: SupplierStudy) -> tuple[str, ...]:
    """Return what nobody else may read: names of vehicles, groups, platform, study, and paths."""
    return platform_secrets(study.platform, study.run.entry)


def platform_secrets(platform: Platform, entry: RunEntry) -> tuple[str, ...]:
    """Return the same of any run on a platform."""
    vehicles = platform.fleet.vehicles
    names = [
        *(vehicle.name for vehicle in vehicles),
        *(vehicle.group for vehicle in vehicles),
        platform.name,
        platform.title,
        platform.description,
        *_spellings(platform.folder),
    ]
    return secrets_of_run(entry, names)


def secrets_of_run(entry: RunEntry, names: Sequence[str]) -> tuple[str, ...]:
    """Return names that nobody else may read with what a run tells: its name, study and paths."""
    of_run = (str(entry.record.get("question", "")), entry.study, entry.name)
    secrets = [*names, *of_run, *_spellings(entry.folder)]
    return tuple(dict.fromkeys(secret for secret in secrets if secret.strip()))


def refuse_leaks(secrets: Sequence[str], texts: Mapping[str, str]) -> None:
    """Refuse a report that holds a secret.

    Parameters
    ----------
    secrets : sequence of str
        Names and paths. A name counts where no letter or digit stands beside it, in upper or lower
        case.
    texts : mapping of str to str
        What the text is → all of it.

    Raises
    ------
    InputError
        Names the secret and the words around it.
    """
    for what, text in texts.items():
        for secret in secrets:
            leak = re.search(rf"(?<![^\W_]){re.escape(secret)}(?![^\W_])", text, re.IGNORECASE)
            if leak:
                start = max(leak.start() - _CONTEXT, 0)
                around = " ".join(text[start : leak.end() + _CONTEXT].split())
                raise InputError(
                    f"an anonymous report would show '{secret}' in its {what} (… {around} …): give "
                    "the load case, mount or campaign there a name that does not tell it; if the "
                    "name is an everyday word, give the vehicle, group or platform another one"
                )


_STYLE = re.compile(r"<style\b.*?</style>", re.DOTALL)
_SAID = re.compile(r'\s(?:alt|title|aria-label)="([^"]*)"')


def page_text(html: str) -> str:
    """Return all that can be read in a page, without markup, styles and bytes of pictures."""
    page = _STYLE.sub(" ", html)
    texts = [unescape(text) for text in (*_SAID.findall(page), *re.split(r"<[^>]*>", page))]
    return f"{' '.join(texts)}\n{''.join(texts)}"


def workbook_text(data: bytes) -> str:
    """Return all that can be read in an xlsx file: properties, names of sheets, and cells."""
    book = load_workbook(io.BytesIO(data), read_only=True)
    properties = book.properties
    texts = [properties.title, properties.creator, properties.description, *book.sheetnames]
    for sheet in book.worksheets:
        texts += [str(value) for row in sheet.iter_rows(values_only=True) for value in row if value]
    return "\n".join(filter(None, texts))


def _spellings(folder: Path) -> tuple[str, ...]:
    return (folder.as_posix(), str(folder), folder.resolve().as_posix(), str(folder.resolve()))
