"""Runs that stand in a results folder: finding one again, and listing all of them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from deboom.errors import InputError
from deboom.files.run_folder import RECORD, UNFINISHED, Run, hash_files
from deboom.files.run_lock import is_held


@dataclass(frozen=True, eq=False)
class RunEntry:
    """A run as it stands on disk.

    Parameters
    ----------
    folder : Path
        ``<out>/<study>/<run>`` or ``<out>/<study>/<run>.unfinished``.
    record : dict
        Its ``run.json``.
    """

    folder: Path
    record: dict[str, Any]

    @property
    def study(self) -> str:
        """Name of the study."""
        return self.folder.parent.name

    @property
    def name(self) -> str:
        """Name of the run, without the mark of an unfinished one."""
        return self.folder.name.removesuffix(UNFINISHED)

    @property
    def finished(self) -> bool:
        """Whether the folder is complete."""
        return not self.folder.name.endswith(UNFINISHED)

    @property
    def state(self) -> str:
        """Return ``finished``, ``running`` (a process works on it) or ``unfinished``."""
        if self.finished:
            return "finished"
        return "running" if is_held(self.folder) else "unfinished"

    def run(self) -> Run:
        """Return the run, to be gone on with.

        Folders that a killed process left half written are taken away.
        """
        for scratch in self.folder.rglob(".write-*"):
            for file in scratch.iterdir():
                file.unlink()
            scratch.rmdir()
        return Run(self.folder, self.record["seed"], created=())


def list_runs(results: Path) -> tuple[RunEntry, ...]:
    """Return all runs of a results folder, by study and time.

    Raises
    ------
    InputError
        There is no such folder, or a run's record is damaged.
    """
    entries, damaged = readable_runs(results)
    if damaged:
        raise damaged[0]
    return entries


def readable_runs(results: Path) -> tuple[tuple[RunEntry, ...], tuple[InputError, ...]]:
    """Return all runs whose record can be read, and what is wrong with the others.

    Raises
    ------
    InputError
        There is no such folder.
    """
    if not results.is_dir():
        raise InputError(f"{results}: there is no such folder; `deboom run` makes it")
    entries, damaged = [], []
    for path in filter(_shown, sorted(results.glob(f"*/*/{RECORD}"))):
        try:
            entries.append(RunEntry(path.parent, _read(path)))
        except InputError as error:
            damaged.append(error)
    return tuple(entries), tuple(damaged)


def read_run(folder: Path) -> RunEntry:
    """Return the run of a folder, or of a page or file in it.

    Raises
    ------
    InputError
        The folder holds no run, or its record is damaged.
    """
    for place in (folder, folder.parent):
        if (place / RECORD).is_file():
            return RunEntry(place, _read(place / RECORD))
    raise InputError(f"{folder} is no run folder: it has no {RECORD}; `deboom list` shows all runs")


def check_files(entry: RunEntry) -> None:
    """Refuse a run whose files are not those that it wrote.

    Raises
    ------
    InputError
        A run that is not finished, one without hashes of its files, a file that is missing or
        that has been edited: names it.
    """
    if not entry.finished:
        raise InputError(f"run {entry.folder} is not finished: go on with it by --resume")
    hashes = entry.record.get("files_sha256")
    if not hashes:
        raise InputError(
            f"run {entry.folder} has no hashes of its files, an older deboom wrote it: run the "
            "study again"
        )
    for name, wanted in hashes.items():
        path = entry.folder / name
        if not path.is_file():
            raise InputError(f"{path} is missing from its run: bring it back or run again")
        if hash_files([path], relative_to=entry.folder)[name] != wanted:
            raise InputError(
                f"{path} has been edited since its run wrote it: bring it back or run again"
            )


def find_run(out: Path, study: str, wanted: str) -> RunEntry:
    """Return a run of a study by its name or folder.

    Parameters
    ----------
    out : Path
        Folder of all results.
    study : str
        Name of the study.
    wanted : str
        Name of the run or path of its folder, with or without the mark of an unfinished one. A
        run that has finished in the meantime is found as well.

    Raises
    ------
    InputError
        No such run, a run of another study, or a damaged record.
    """
    plain = wanted.rstrip("/\\").removesuffix(UNFINISHED)
    candidates = [
        Path(f"{place}{suffix}")
        for place in (plain, out / study / plain)
        for suffix in ("", UNFINISHED)
    ]
    for folder in candidates:
        if (folder / RECORD).is_file():
            entry = RunEntry(folder, _read(folder / RECORD))
            if entry.record.get("study") != study:
                raise InputError(
                    f"run {wanted} belongs to the study {entry.record.get('study')}, not to {study}"
                )
            return entry
    raise InputError(f"run {wanted}: there is none in {out / study}; `deboom list {out}` shows all")


def _shown(record: Path) -> bool:
    return not record.parent.name.startswith(".")


def _read(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read ({error}): it is damaged") from None
