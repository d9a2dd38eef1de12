"""What a specification sheet is made of besides the front: a box, tolerances, shared parts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from deboom.errors import InputError
from deboom.files.run_folder import hash_files
from deboom.files.run_list import RunEntry, check_files, read_run
from deboom.files.solution_box import AcceptanceBox, read_solution_box
from deboom.study.accept_command import box_file
from deboom.study.motion import Factor
from deboom.study.motion_report import factor_name
from deboom.study.platform_hash import platform_sha256
from deboom.study.supplier_study import SupplierStudy

BOX_TABLE, SET_BY_LIMIT = "box.csv", "set by the limit"
MEASURED_AGAIN = ("share_measured_from", "share_measured_to")
ALLOCATION, MARGINAL, VERIFICATION = "allocation.csv", "marginal_values.csv", "verification.csv"
PART_NUMBERS = "part_numbers.csv"


@dataclass(frozen=True)
class SpecificationFiles:
    """Where the pieces of a sheet are; each may be missing.

    Parameters
    ----------
    box : Path or None
        Acceptance box, or the run of ``solution_box`` that found it.
    tolerances : Path or None
        Run of ``tolerance_allocation`` for this front.
    sharing : Path or None
        Run of ``commonality`` for this platform.
    """

    box: Path | None = None
    tolerances: Path | None = None
    sharing: Path | None = None


@dataclass(frozen=True, eq=False)
class BoxSource:
    """An acceptance box.

    Parameters
    ----------
    box : AcceptanceBox
    sha256 : str
        Of its file, in hexadecimal.
    set_by_limit : mapping of str to str
        Variable → ``from``, ``to``, both or ``neither``; empty where only the box is known.
    measured_again : (float, float) or None
        Share within the limit if all measurements were made again, 90 % interval; None where only
        the box is known [1].
    """

    box: AcceptanceBox
    sha256: str
    set_by_limit: Mapping[str, str]
    measured_again: tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class ToleranceSource:
    """Allocated tolerances.

    Parameters
    ----------
    run : RunEntry
    directions : DataFrame
        Indexed by variable: the tables ``allocation`` and ``marginal_values`` side by side.
    summary : mapping of str
        Headline numbers of the run.
    """

    run: RunEntry
    directions: pd.DataFrame
    summary: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class SharingSource:
    """Part numbers that vehicles share.

    Parameters
    ----------
    run : RunEntry
    part_numbers : DataFrame
        Table ``part_numbers`` of the run.
    summary : mapping of str
        Headline numbers of the run.
    """

    run: RunEntry
    part_numbers: pd.DataFrame
    summary: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class SpecificationSources:
    """The pieces that were given."""

    box: BoxSource | None
    tolerances: ToleranceSource | None
    sharing: SharingSource | None


def specification_sources(study: SupplierStudy, files: SpecificationFiles) -> SpecificationSources:
    """Read the pieces of a sheet and refuse those that belong to something else.

    Parameters
    ----------
    study : SupplierStudy
        The front.
    files : SpecificationFiles

    Returns
    -------
    SpecificationSources

    Raises
    ------
    InputError
        A file that cannot be read, an edited run, a run of another study; a box of other
        vehicles, directions, data or of another kind of stiffness factor; tolerances of another
        front or design; shared parts of other data.
    """
    return SpecificationSources(
        None if files.box is None else _box(study, files.box),
        None if files.tolerances is None else _tolerances(study, files.tolerances),
        None if files.sharing is None else _sharing(study, files.sharing),
    )


def _box(study: SupplierStudy, path: Path) -> BoxSource:
    file = box_file(path)
    box = read_solution_box(file)
    again = f"run solution_box --front {study.run.entry.folder.as_posix()}"
    for what, mine, theirs in (
        ("directions", [one.name for one in study.directions], [v.name for v in box.variables]),
        ("vehicles", list(study.vehicles), [response.name for response in box.responses]),
    ):
        if mine != theirs:
            raise InputError(
                f"--box {path}: its {what} are {', '.join(theirs)}, those of run "
                f"{study.run.entry.folder} {', '.join(mine)}: {again}"
            )
    if factor_name(study.motion_index) == Factor.part.value:
        raise InputError(
            f"--box {path}: a box has intervals of the dynamic stiffness, run "
            f"{study.run.entry.folder} has factors of the part: search the front with --factor "
            "dynamic"
        )
    if box.platform_sha256 != platform_sha256(study.platform):
        raise InputError(f"--box {path}: it was found with other files of the platform: {again}")
    set_by_limit: dict[str, str] = {}
    measured_again = None
    if path.is_dir():
        entry = read_run(path)
        check_files(entry)
        table = pd.read_csv(entry.folder / BOX_TABLE)
        summary = _summary(entry)
        if SET_BY_LIMIT not in table or not set(MEASURED_AGAIN) <= set(summary):
            raise InputError(f"--box {path}: an older deboom wrote it: {again}")
        set_by_limit = dict(zip(table["variable"], table[SET_BY_LIMIT], strict=True))
        measured_again = (summary[MEASURED_AGAIN[0]], summary[MEASURED_AGAIN[1]])
    sha256 = hash_files([file], relative_to=file.parent)[file.name]
    return BoxSource(box, sha256, set_by_limit, measured_again)


def _tolerances(study: SupplierStudy, path: Path) -> ToleranceSource:
    entry = _run("--tolerances", path, ALLOCATION, "tolerance_allocation")
    front, arguments = study.run.entry, entry.record["arguments"]
    record = hash_files([front.folder / "run.json"], relative_to=front.folder)["run.json"]
    known = record in entry.record["inputs_sha256"].values()
    if not known or arguments["pick"] != study.pick.value or arguments["point"] is not None:
        raise InputError(
            f"--tolerances {path}: its tolerances belong to another design: run "
            f"tolerance_allocation --from-run {front.folder.as_posix()} --pick {study.pick.value}"
        )
    tables = [
        pd.read_csv(entry.folder / name, keep_default_na=False).set_index("variable")
        for name in (ALLOCATION, MARGINAL)
    ]
    return ToleranceSource(entry, pd.concat(tables, axis=1), _summary(entry))


def _sharing(study: SupplierStudy, path: Path) -> SharingSource:
    entry = _run("--sharing", path, PART_NUMBERS, "commonality")
    files = study.platform.input_files
    mine = hash_files(files, relative_to=study.platform.folder).values()
    if not set(mine) <= set(entry.record["inputs_sha256"].values()):
        raise InputError(
            f"--sharing {path}: it was found with other files of the platform: run commonality "
            f"--platform {study.platform.folder.as_posix()}"
        )
    table = pd.read_csv(entry.folder / PART_NUMBERS, dtype={"vehicles": str})
    unknown = set(table["direction"]) ^ {one.name for one in study.directions}
    if unknown:
        raise InputError(
            f"--sharing {path}: its directions are not those of run {study.run.entry.folder} "
            f"({sorted(unknown)[0]}): run commonality for the same platform"
        )
    return SharingSource(entry, table, _summary(entry))


def _run(option: str, path: Path, file: str, study: str) -> RunEntry:
    entry = read_run(path)
    check_files(entry)
    if file not in entry.record["files_sha256"]:
        raise InputError(f"{option} {path} has no {file}: give a run folder of the study {study}")
    return entry


def _summary(entry: RunEntry) -> Mapping[str, Any]:
    found: dict[str, Any] = json.loads((entry.folder / "summary.json").read_text(encoding="utf-8"))
    return found
