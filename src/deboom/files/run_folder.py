"""Run folders: the only place that studies write to; their list, who works in them, and searches.

A search's folder holds ``search.json`` with the facts about the search, ``evaluations/000001.npz``
with the first generation and ``inputs.json`` with the hashes of the files behind it. Nothing is
pickled.
"""

from __future__ import annotations

import glob
import hashlib
import io
import json
import os
import platform
import re
import secrets
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import numpy.typing as npt
from filelock import FileLock, Timeout
from pydantic import BaseModel, ConfigDict, Field, RootModel

from deboom import __version__
from deboom.answer import ANSWER, Answer
from deboom.errors import InputError
from deboom.files.disk import opened_file, read_arrays, read_json, replace_bytes, replace_text
from deboom.files.schema import wrong_entries
from deboom.files.shipped_studies import names_of
from deboom.names import is_inside, path_inside
from deboom.tabled import PACKED, json_text, table_file

if TYPE_CHECKING:
    import pandas as pd

    from deboom.explore.doe import Experiment
    from deboom.explore.result import Front
    from deboom.explore.sensitivity import Sensitivities
    from deboom.files.front_table import FrontTable

LATEST = "latest"
"""Name that stands for the last finished run of a study."""
UNFINISHED = ".unfinished"
_STARTED = re.compile(r"(\d{4}-\d\d-\d\d)_(\d\d)(\d\d)(\d\d)")
RECORD = "run.json"
DAMAGED = "it is damaged, start a new run"
SEARCH, INPUTS = "search.json", "inputs.json"
"""Facts about a search, and the hashes of its input files."""
EXAMPLE = "example"
"""Name of the finished run that a clone brings: it is read and never written to."""
DOE, SOBOL, MORRIS = "doe", "sobol", "morris"
"""Tables that a run keeps under the name of what they hold."""
TEXTS = ("doe", "plan", "failure", "variable", "response", "vehicle")
"""Columns of a run's tables with names and words, which may look like numbers."""
PACKAGES = (
    "deboom",
    "numpy",
    "scipy",
    "pandas",
    "scikit-learn",
    "pymoo",
    "moocore",
    "pyDOE3",
    "SALib",
    "numba",
    "matplotlib",
    "seaborn",
)
"""Packages whose versions a record names."""


@dataclass(frozen=True)
class Run:
    """A run that has started.

    - `folder`: ``<out>/<study>/<run>.unfinished``.
    - `seed`: Of the run.
    - `created`: Folders that did not exist before, outermost first; `discard` takes them away
      again.
    - `started`: When it began, UTC, such as ``2026-11-21 10:45:30``.
    """

    folder: Path
    seed: int
    created: tuple[Path, ...]
    started: str = ""

    def save_json(self, name: str, content: Mapping[str, Any]) -> None:
        """Save a mapping as JSON, UTF-8.

        - raises ValueError: A number that is not finite: JSON has no word for it.
        """
        self.save_text(name, json_text(content))

    def save_text(self, name: str, text: str) -> None:
        """Save text as UTF-8 with the line ends it has."""
        self.save_bytes(name, text.encode("utf-8"))

    def save_bytes(self, name: str, data: bytes) -> None:
        """Save a file, complete or not at all; folders such as ``figures/`` are made.

        - raises InputError: The name leaves the run folder, the run is finished, or the file cannot
          be written.
        """
        path = path_inside(self.folder, name)
        if not self.folder.is_dir():
            raise InputError(f"{self.folder} is gone: the run is finished or discarded")
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_bytes(path, data)

    def discard(self) -> None:
        """Remove the folder, and those above it that this run has made and nobody else uses."""
        shutil.rmtree(self.folder, ignore_errors=True)
        _remove_empty(self.created)


def start_run(out: Path, study: str, *, seed: int, record: Mapping[str, Any]) -> Run:
    """Create ``<out>/<study>/<run>.unfinished/`` with its record, before any work is done.

    The name of the run, such as ``2026-11-21_104530_seed1``, is the time (UTC) and the seed; a
    second run of the same second gets ``_2``.

    - `out`: Folder of all results; made when missing.
    - `study`: Name of the study: letters, digits, ``_`` and ``-``.
    - `seed`: From 1.
    - `record`: What the run was asked for; becomes ``run.json``. The folder never exists without
      it.
    - returns: Takes files until `finish_run`.
    - raises InputError: A seed below 1, a study name that is no folder name, or a folder that
      cannot be written or that a link leads out of `out`.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 1:
        raise InputError(f"seed {seed!r} of study {study}: choose a whole number from 1")
    if not re.fullmatch(r"[\w-]+", study, re.ASCII):
        raise InputError(f"study name '{study}': use letters, digits, _ and -")
    parent = path_inside(out, study)
    began = datetime.now(UTC)
    started = f"{began:%Y-%m-%d %H:%M:%S}"
    created = tuple(f for f in reversed((parent, *parent.parents)) if not f.exists())
    try:
        parent.mkdir(parents=True, exist_ok=True)
        name = f"{began:%Y-%m-%d_%H%M%S}_seed{seed}"
        folder = _new_folder(parent, name, json_text({**record, "started": started}))
    except OSError as error:
        _remove_empty(created)
        raise InputError(
            f"the output folder {out} cannot be written ({error.strerror or error}): choose "
            "another with --out"
        ) from None
    return Run(folder, seed, created, started)


def finish_run(run: Run) -> Path:
    """Rename ``<run>.unfinished`` to ``<run>`` and return the finished folder.

    - raises InputError: The folder cannot be renamed.
    """
    final = _final(run.folder)
    try:
        run.folder.rename(final)
    except OSError as error:
        raise InputError(
            f"{run.folder} is complete but cannot be renamed ({error.strerror or error}): close "
            "programs that use it and rename it by hand"
        ) from None
    return final


def environment_record(packages: Sequence[str]) -> dict[str, Any]:
    """Record what the numbers depend on beside input and seed.

    - `packages`: Distribution names.
    - returns: ``python``, ``platform``, ``packages`` (name → version, null when not installed),
      ``sources_sha256`` (see `hash_sources`) and ``git`` (``revision`` and ``dirty`` of deboom's
      own checkout; null for an installed package).
    """
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": {name: _version(name) for name in packages},
        "sources_sha256": hash_sources(Path(__file__).parents[1]),
        "git": _git_state(Path(__file__)),
    }


def hash_sources(package: Path) -> str:
    """Return one SHA-256 over names and bytes of a package's files.

    It is the same in a checkout, a tarball and an installed wheel of the same code. Studies are
    left out: the record of a run holds the text of its own.
    """
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*")):
        name = path.relative_to(package)
        if not path.is_file() or {"__pycache__", "studies"} & set(name.parts):
            continue
        digest.update(f"{name.as_posix()}\0{path.stat().st_size}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def hash_files(paths: Iterable[Path], relative_to: Path) -> dict[str, str]:
    """Return the SHA-256 of files under their path from a folder, in the order of these names.

    - raises InputError: A file cannot be read.
    """
    hashes = {}
    for path in paths:
        with opened_file(path) as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        hashes[_relative_name(path, relative_to)] = digest
    return dict(sorted(hashes.items()))


def _new_folder(parent: Path, name: str, record: str) -> Path:
    """Fill a folder under a passing name, then give it its own: it never exists without record."""
    scratch = parent / f".start-{secrets.token_hex(8)}"
    scratch.mkdir()
    try:
        (scratch / RECORD).write_bytes(record.encode("utf-8"))
        number = 1
        while True:
            folder = parent / f"{name}{'' if number == 1 else f'_{number}'}{UNFINISHED}"
            number += 1
            if folder.exists() or _final(folder).exists():
                continue
            try:
                return scratch.rename(folder)
            except OSError:  # another run took the name first: a folder that is not empty stays
                if not folder.exists():
                    raise
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        raise


def _remove_empty(folders: Sequence[Path]) -> None:
    for folder in reversed(folders):
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()


def _final(folder: Path) -> Path:
    return folder.with_name(folder.name.removesuffix(UNFINISHED))


def _relative_name(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive on Windows
        return path.name


def _version(name: str) -> str | None:
    if name == "deboom":  # an editable install keeps the version that it was installed with
        return __version__
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _git_state(file: Path) -> dict[str, Any] | None:
    """Ask the checkout that tracks a file; a surrounding, unrelated one does not count."""
    program = shutil.which("git")
    # Windows looks for programs in the working folder first, and that may be anybody's
    if program is None or Path(program).resolve().parent == Path.cwd():
        return None

    def git(*arguments: str) -> str:
        command = [program, "-C", str(file.parent), *arguments]
        result = subprocess.run(
            command, capture_output=True, text=True, encoding="utf-8", timeout=20, check=True
        )
        return result.stdout.strip()

    try:
        git("ls-files", "--error-unmatch", file.name)
        return {"revision": git("rev-parse", "HEAD"), "dirty": bool(git("status", "--porcelain"))}
    except (OSError, subprocess.SubprocessError):
        return None


LOCK = ".lock"


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Hold a run folder; when the work is done the lock's file goes as well.

    The lock belongs to the process: of one that was killed the file stays, and holds nothing.

    - raises InputError: Another process holds it, or the folder cannot be written.
    """
    path = folder / LOCK
    try:
        hold = FileLock(path, blocking=False).acquire()
    except Timeout:
        raise InputError(
            f"{folder} is being worked on by another process: wait for it or end it"
        ) from None
    except OSError as error:
        raise InputError(
            f"{path} cannot be locked ({error.strerror or error}): remove it"
        ) from None
    with hold:
        yield
    path.unlink(missing_ok=True)


def is_held(folder: Path) -> bool:
    """Return whether a process works in a run folder now; of a folder that is read only: no."""
    if not (folder / LOCK).exists():
        return False
    try:
        with FileLock(folder / LOCK, blocking=False):
            return False
    except Timeout:
        return True
    except OSError:  # another's folder, or a link or folder of that name, which nobody locks
        return False


@dataclass(frozen=True, eq=False)
class RunEntry:
    """A run as it stands on disk.

    - `folder`: ``<out>/<study>/<run>`` or ``<out>/<study>/<run>.unfinished``, or wherever it was
      copied to.
    - `record`: Its ``run.json``.
    """

    folder: Path
    record: dict[str, Any]

    @property
    def study(self) -> str:
        """Name of the study, as its record says; that of the folder above where it says none."""
        return self.record.get("study") or self.folder.parent.name

    @property
    def name(self) -> str:
        """Name of the run, without the mark of an unfinished one."""
        return self.folder.name.removesuffix(UNFINISHED)

    @property
    def started(self) -> str:
        """When the run began, UTC, such as ``2026-11-21 10:45:30``; empty where nothing says it."""
        match = _STARTED.match(self.name)
        of_name = f"{match[1]} {match[2]}:{match[3]}:{match[4]}" if match else ""
        return str(self.record.get("started", of_name))

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

    @property
    def front(self) -> FrontTable:
        """The front of the run, with its designs and picks.

        - raises InputError: a run that is not finished or keeps no front; a file of it that is
          missing or edited.
        """
        from deboom.files import front_table

        check_files(self, front_table.FILES)
        if front_table.FRONT not in self.record["files_sha256"]:
            raise InputError(
                f"run {self.folder} is of {self.study}, which is no front study (no "
                f"{front_table.FRONT}): take a run of a front, such as those of front"
            )
        converged = front_table.CONVERGED in self.record.get("facts", {})
        return front_table.FrontTable.read(self.folder, converged=converged)

    @property
    def answer(self) -> Answer | None:
        """First screen of the run's page as data; None where the run keeps none, as in 0.3.

        - raises InputError: a run that is not finished; an answer that is missing or edited.
        """
        if ANSWER not in (self.record.get("files_sha256") or {}):
            return None
        check_files(self, (ANSWER,))
        path = self.folder / ANSWER
        return _Answer.model_validate(_checked_json(path, _Answer, "run the study again")).root

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that the run keeps, such as ``doe``; none of one that is going on."""
        hashed = self.record.get("files_sha256") or {}
        names = (name.removesuffix(PACKED) for name in hashed)
        return tuple(name.removesuffix(".csv") for name in names if name.endswith(".csv"))

    def table(self, name: str) -> pd.DataFrame:
        """Return a table of the run, columns ``name [unit]``.

        - raises InputError: a run that is not finished or has no such table; a table that is
          missing or edited.
        """
        from deboom.files.tables import read_frame

        file = f"{name}.csv"
        check_files(self, (file, file + PACKED))
        if name not in self.tables:
            raise InputError(
                f"run {self.folder} of {self.study} has no table '{name}': it has "
                f"{', '.join(self.tables) or 'none'}"
            )
        return read_frame(self.folder / file, TEXTS)

    @property
    def doe(self) -> Experiment:
        """Designs of the run with their responses, for `deboom.correlation` and ``.front()``.

        - raises InputError: as `table`; responses that have the unit of the variables.
        """
        from deboom.files.doe_table import experiment_of

        name = self._answer(DOE, "correlation")
        named = self.record.get("responses"), self.record.get("n_lines")
        return experiment_of(self.folder / f"{name}.csv", self.table(name), *named)

    @property
    def sobol(self) -> pd.DataFrame:
        """Sobol indices of the run, one row per variable and response; see `table`."""
        return self.table(self._answer(SOBOL, "sensitivity"))

    def _answer(self, table: str, question: str) -> str:
        """Return the name of a table, in the run of a front that of a further question."""
        further = f"{question}_{table}"
        return further if further in self.tables else table

    def run(self) -> Run:
        """Return the run, to be gone on with.

        Folders that a killed process left half written are taken away.
        """
        for scratch in self.folder.rglob(".write-*"):
            if scratch.is_dir() and not scratch.is_symlink():
                shutil.rmtree(scratch)
            else:
                scratch.unlink()
        return Run(self.folder, self.record["seed"], created=(), started=self.started)

    def writable(self, name: str = "") -> Path:
        """Return where a command writes further files of this run without ``--out``.

        - `name`: Of a folder in the run's own; by default that itself.
        - raises InputError: The run that a clone brings; a link that leads out of the run.
        """
        if self.name == EXAMPLE:
            raise InputError(
                f"{self.folder} is the example that comes with deboom, and nothing is written into "
                "it: name another folder with --out"
            )
        return path_inside(self.folder, name) if name else self.folder


def read_record(path: Path) -> dict[str, Any]:
    """Return what a ``run.json`` says; entries that are null or missing have their defaults.

    - raises InputError: a file that is damaged or gone.
    """
    record = _checked_json(path, _Record, "the record of this run is damaged")
    stated = {name: entry for name, entry in record.items() if entry is not None}
    return {**_Record().model_dump(exclude_none=True), **stated}


def _checked_json(path: Path, model: type[BaseModel], remedy: str) -> dict[str, Any]:
    """Return the object of a JSON file whose entries are as a model says.

    - raises InputError: the file is damaged, gone, or holds what no other JSON file can hold.
    """
    content = read_json(path, remedy)
    for sentence in wrong_entries(model, content):
        raise InputError(f"{path}: {sentence}; {remedy}")
    try:
        json.dumps(content, allow_nan=False, ensure_ascii=False).encode("utf-8")
    except ValueError:  # 1e999, and half of a letter of two
        raise InputError(f"{path} holds an endless number or half a letter; {remedy}") from None
    return content


def readable_runs(
    results: Path, read: Callable[[Path], dict[str, Any]] = read_record
) -> tuple[tuple[RunEntry, ...], tuple[InputError, ...]]:
    """Return all runs whose record can be read, and what is wrong with the others.

    - `read`: returns a record, such as one that reads only what has changed.
    - raises InputError: There is no such folder.
    """
    if not results.is_dir():
        raise InputError(f"{results}: there is no such folder; `deboom run` makes it")
    entries, damaged = [], []
    for path in sorted(results.glob(f"*/[!.]*/{RECORD}")):
        try:
            path_inside(results, path.relative_to(results).as_posix())
            entries.append(RunEntry(path.parent, read(path)))
        except InputError as error:
            damaged.append(error)
    return tuple(entries), tuple(damaged)


def read_run(folder: str | Path | RunEntry) -> RunEntry:
    """Return the run of a folder, or of a page or file in it, or by its name in ``results`` here.

    A name may be cut short where one run alone begins so.

    Parameters
    ----------
    folder : str or Path
        Folder of a run, a file in it, the name of a run, or ``<folder of a study>/latest`` for its
        run that began last and has finished; ``latest`` for that of any study in ``results``. What
        `save_run` gives is such a run already.

    Returns
    -------
    RunEntry
        ``run.record`` is what the run was asked, ``run.front`` its front: ``table``, ``designs``
        (n, k) [units of the variables], ``objectives`` (n, 2) [unit of the responses], ``picks``.
        ``run.answer`` is the first screen of its page as data. ``run.doe`` has its designs with
        responses as `deboom.doe`, ``run.sobol`` its indices, and
        ``run.table(name)`` any of ``run.tables``.

    Raises
    ------
    InputError
        The folder holds no run, its record is damaged, several runs have this name or begin so, or
        no run has finished yet where the latest is wanted.

    See Also
    --------
    deboom.save_run, deboom.explore.result.Front, deboom.CheckpointFolder, deboom.compare

    Examples
    --------
    >>> import deboom
    >>> deboom.read_run("nowhere")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    deboom.errors.InputError: nowhere is no run folder: ...
    """
    if isinstance(folder, RunEntry):
        return folder
    folder = latest_run(Path(folder))
    named = [] if folder.exists() else _runs_named(folder)
    if len(named) > 1:
        raise InputError(
            f"{folder} names {len(named)} runs: say {named[0].as_posix()} or {named[1].as_posix()}"
        )
    for place in (*named, folder, folder.parent):
        if (place / RECORD).is_file():
            return RunEntry(place, read_record(place / RECORD))
    raise InputError(f"{folder} is no run folder: it has no {RECORD}; `deboom list` shows all runs")


def save_run(
    result: Front | Experiment | Sensitivities,
    out: str | Path = "results",
    *,
    study: str = "notebook",
    seed: int = 1,
) -> RunEntry:
    """Save what a notebook computed as a run, for `read_run` and ``deboom list``.

    Parameters
    ----------
    result : Front, Experiment or Sensitivities
        As `deboom.search`, `deboom.doe`, `deboom.read_designs`, `deboom.sobol` and `deboom.morris`
        give it.
    out : str or Path
        Folder that gets ``<study>/<run>/``.
    study : str
        Name of the folder: letters, digits, ``_`` and ``-``.
    seed : int
        Seed of the result, from 1; a front has its own.

    Returns
    -------
    RunEntry
        What `read_run` of its ``folder`` gives: ``run.front``, ``run.doe`` or ``run.sobol``.

    Raises
    ------
    InputError
        Another result; a folder that cannot be written; a name or a seed that cannot be.

    See Also
    --------
    deboom.read_run, deboom.CheckpointFolder, deboom.write_designs

    Examples
    --------
    >>> import deboom, tempfile
    >>> square = deboom.ResponseFunction(lambda x: x**2, ("a",), ("y",), "dB")
    >>> experiment = deboom.doe(square, square.design_space(), n=16)
    >>> run = deboom.save_run(experiment, tempfile.mkdtemp())
    >>> deboom.read_run(run.folder).doe.table.equals(experiment.table)
    True
    """
    tables, facts = _kept_of(result)
    record = {
        "study": study,
        "question": "Saved from a notebook.",
        "command": "deboom.save_run(result)",
        "seed": facts.pop("seed", seed),
        "arguments": {},
        "environment": environment_record(PACKAGES),
        **facts,
    }
    run = start_run(Path(out), study, seed=record["seed"], record=record)
    record["started"] = run.started
    try:
        contents = dict(table_file(stem, table) for stem, table in tables.items())
        for name, content in contents.items():
            run.save_bytes(name, content)
        files = [run.folder / name for name in contents]
        record |= {"inputs_sha256": {}, "files_sha256": hash_files(files, relative_to=run.folder)}
        run.save_json(RECORD, record)
        return read_run(finish_run(run))
    except BaseException:
        run.discard()
        raise


def _kept_of(
    result: Front | Experiment | Sensitivities,
) -> tuple[dict[str, pd.DataFrame], dict[str, Any]]:
    """Return the tables of a result by name, and what a record says of it."""
    from deboom.explore.doe import Experiment, doe_frame
    from deboom.explore.result import Front
    from deboom.explore.sensitivity import Sensitivities, SobolIndices
    from deboom.files.front_table import facts_of, tables_of

    if isinstance(result, Front):
        search = result.search
        how = f"{search.algorithm}, {search.stopped}, {search.seconds:.1f} s"
        kept = {"search": how, "note": result.text} | facts_of(result)
        return tables_of(result), {"seed": search.seed, "facts": kept}
    if isinstance(result, Experiment):
        doe = result.doe
        said = {"responses": list(doe.response_names), "n_lines": result.n_lines}
        return {DOE: doe_frame(doe)}, said
    if isinstance(result, Sensitivities):
        kind = SOBOL if isinstance(result.indices, SobolIndices) else MORRIS
        pairs = {} if result.pairs is None else {f"{kind}_pairs": result.pair_table}
        return {kind: result.table, **pairs}, {}
    raise InputError(
        f"{type(result).__name__} cannot be saved as a run: give a front, an experiment or "
        "sensitivities"
    )


def _runs_named(folder: Path) -> list[Path]:
    """Return the runs in ``results`` here of a name, or else those whose names begin with it.

    A study's folder may stand before the name.
    """
    results, name = Path("results"), glob.escape(folder.name)
    if len(folder.parts) > 2 or not name:
        return []
    study = glob.escape(folder.parent.name) or "*"
    for pattern in (name, f"{name}*"):
        runs = [record.parent for record in results.glob(f"{study}/{pattern}/{RECORD}")]
        if runs:
            return [
                path_inside(results, run.relative_to(results).as_posix()) for run in sorted(runs)
            ]
    return []


def latest_run(folder: Path) -> Path:
    """Return the folder itself, or what ``<folder of a study>/latest`` stands for.

    The study's folder may also be named as it is in ``results`` here; ``latest`` alone is the run
    of any study there.

    - raises InputError: no run of the study has finished.
    """
    if folder.name != LATEST or folder.exists():
        return folder
    homes, alone = list(Path("results").glob("*")), len(folder.parts) == 1
    if not alone:
        # runs of a study lie in the folders of its former names as well
        named = [folder.parent.with_name(name) for name in names_of(folder.parent.name)]
        homes = [*named, *(Path("results") / name for name in named)]
    finished = [
        path_inside(home, record.parent.name)
        for home in homes
        for record in home.glob(f"[!.]*/{RECORD}")
        if not record.parent.name.endswith(UNFINISHED)
    ]
    if not finished:
        raise InputError(
            f"{folder}: no run has finished in {'results' if alone else folder.parent}; "
            "`deboom list` shows all"
        )
    return max(finished, key=_age)


def _age(run: Path) -> tuple[str, str]:
    """Return by what runs are ordered: their start, then their names; a damaged one by its name."""
    try:
        record = read_record(run / RECORD)
    except InputError:
        record = {}
    return RunEntry(run, record).started, run.name


def check_files(entry: RunEntry, names: Iterable[str] | None = None) -> None:
    """Refuse a run whose files are not those that it wrote.

    - `names`, optional: of the files that count, where the run has them; all by default.
    - raises InputError: A run that is not finished, one without hashes of its files, a file that is
      missing or that has been edited: names it.
    """
    if not entry.finished:
        raise InputError(f"run {entry.folder} is not finished: go on with it by --resume")
    hashes = entry.record.get("files_sha256")
    if not hashes:
        raise InputError(
            f"run {entry.folder} has no hashes of its files, an older deboom wrote it: run the "
            "study again"
        )
    for name in hashes if names is None else [name for name in names if name in hashes]:
        path, wanted = path_inside(entry.folder, name), hashes[name]
        if not path.is_file():
            raise InputError(f"{path} is missing from its run: bring it back or run again")
        if hash_files([path], relative_to=entry.folder)[name] != wanted:
            raise InputError(
                f"{path} has been edited since its run wrote it: bring it back or run again"
            )


def find_run(out: Path, study: str, wanted: str) -> RunEntry:
    """Return a run of a study by its name or folder.

    - `out`: Folder of all results.
    - `study`: Name of the study.
    - `wanted`: Name of the run or path of its folder, with or without the mark of an unfinished
      one, or ``latest`` for the unfinished one that began last. A run that has finished in the
      meantime is found as well.
    - raises InputError: No such run, none that is unfinished, a run of another study, or a
      damaged record.
    """
    plain, names = wanted.rstrip("/\\").removesuffix(UNFINISHED), names_of(study)
    if plain == LATEST:
        begun = [
            record.parent
            for name in names
            for record in (out / name).glob(f"*{UNFINISHED}/{RECORD}")
        ]
        if not begun:
            raise InputError(f"{out / study}: no run of {study} was interrupted")
        plain = max(begun, key=_age).name.removesuffix(UNFINISHED)
    candidates = [Path(f"{plain}{suffix}") for suffix in ("", UNFINISHED)]
    if is_inside(plain):
        named = (f"{name}/{plain}{suffix}" for name in names for suffix in ("", UNFINISHED))
        candidates += [path_inside(out, name) for name in named]
    for folder in candidates:
        if (folder / RECORD).is_file():
            entry = RunEntry(folder, read_record(folder / RECORD))
            if entry.record.get("study") not in names:
                raise InputError(
                    f"run {wanted} belongs to the study {entry.record.get('study')}, not to {study}"
                )
            return entry
    raise InputError(f"run {wanted}: there is none in {out / study}; `deboom list {out}` shows all")


class _Revision(BaseModel):
    """Commit of deboom's own checkout."""

    model_config = ConfigDict(strict=True)

    revision: str
    dirty: bool


class _Environment(BaseModel):
    """What the numbers of a run depend on beside input and seed; see `environment_record`."""

    model_config = ConfigDict(strict=True)

    python: str = ""
    packages: dict[str, str | None] = {}
    sources_sha256: str = "unknown"
    git: _Revision | None = None


class _Record(BaseModel):
    """Entries of ``run.json`` that are relied on; studies add others."""

    model_config = ConfigDict(strict=True)

    study: str | None = None
    question: str | None = None
    command: str | None = None
    started: Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d$")] | None = None
    seed: Annotated[int, Field(ge=0)] = 0
    arguments: dict[str, Any] = {}
    positional: dict[str, Any] = {}
    environment: _Environment = _Environment()
    study_text: str = ""
    facts: dict[str, Any] = {}
    responses: list[str] | None = None
    n_lines: int | None = None
    headlines: dict[str, Any] | None = None
    verdict: str | None = None
    inputs_sha256: dict[str, str] = {}
    files_sha256: dict[str, str] | None = {}


class _SearchFacts(BaseModel):
    """Entries of ``search.json`` that are relied on."""

    model_config = ConfigDict(strict=True)

    variables: list[str]
    seconds: Annotated[float, Field(ge=0)]


class _Inputs(RootModel[dict[str, str]]):
    """Hashes of input files by name: ``inputs.json``."""

    model_config = ConfigDict(strict=True)


class _Answer(RootModel[Answer]):
    """The first screen of a page: ``answer.json``."""


AnyArray = npt.NDArray[Any]


@dataclass(frozen=True)
class CheckpointFolder:
    """Where one search keeps what must survive its process.

    Every file appears complete or not at all, whenever the process is killed. The folder is made
    with the first file.

    Parameters
    ----------
    folder : str or Path
        Of this search alone.
    inputs_sha256 : mapping of str to str, optional
        Input files of the search and their hashes, such as `hash_files` gives; None where there are
        none, as in a notebook, or where it is only looked at.

    Raises
    ------
    InputError
        The folder holds a search with other inputs: the sentence names the first such file; or a
        link leads out of it.

    See Also
    --------
    deboom.search, deboom.save_run, deboom.read_run

    Examples
    --------
    >>> import deboom, tempfile
    >>> model = deboom.ResponseFunction(lambda x: (x - 0.9) ** 2, ("a",), ("y",), "dB")
    >>> robust = deboom.Robust(model, model.design_space(), draws=64)
    >>> kept = deboom.CheckpointFolder(tempfile.mkdtemp())
    >>> front = deboom.search(robust, population=8, generations=4, checkpoint=kept)
    >>> (kept(1).folder / "search.json").is_file()
    True
    """

    folder: Path
    inputs_sha256: Mapping[str, str] | None = None

    def __call__(self, seed: int) -> CheckpointFolder:
        """Return the folder in this one of the search of a seed, as `deboom.search` asks for it."""
        return CheckpointFolder(self.folder / f"seed{seed}", self.inputs_sha256)

    def __post_init__(self) -> None:
        object.__setattr__(self, "folder", Path(self.folder))
        then, now = self._stated(INPUTS, _Inputs), self.inputs_sha256
        if then is None or now is None:
            return
        for name in sorted({*then, *now}):
            if then.get(name) != now.get(name):
                raise InputError(
                    f"{name} has changed since the run began whose evaluations are in "
                    f"{self.folder}: bring the file back as it was or start a new run"
                )

    def save(self, facts: Mapping[str, Any]) -> None:
        """Replace the facts about the search, which JSON can hold, in one step."""
        self._write(SEARCH, (json.dumps(facts, allow_nan=False) + "\n").encode())

    def load(self) -> dict[str, Any] | None:
        """Return the facts about the search; None before they were first saved.

        - raises InputError: a damaged file.
        """
        return self._stated(SEARCH, _SearchFacts)

    def keep(self, number: int, arrays: Mapping[str, AnyArray]) -> None:
        """Keep the evaluations of one generation, from number 1; 0 is what descents found."""
        stream = io.BytesIO()
        np.savez(stream, allow_pickle=False, **arrays)
        self._write(f"evaluations/{number:06d}.npz", stream.getvalue())

    def kept(self, number: int) -> dict[str, AnyArray] | None:
        """Return the evaluations of one generation; None if they were not kept.

        - raises InputError: a damaged file, or arrays without a row for each design.
        """
        path = path_inside(self.folder, f"evaluations/{number:06d}.npz")
        if not path.exists():
            return None
        arrays = read_arrays(path, "start a new run")
        designs = arrays.get("designs", np.empty(0))
        if designs.ndim != 2 or any(a.ndim < 1 or len(a) != len(designs) for a in arrays.values()):
            raise InputError(f"{path} has no row for each design: {DAMAGED}")
        return arrays

    def _stated(self, name: str, model: type[BaseModel]) -> dict[str, Any] | None:
        path = path_inside(self.folder, name)
        return _checked_json(path, model, DAMAGED) if path.exists() else None

    def _write(self, name: str, data: bytes) -> None:
        path = path_inside(self.folder, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        inputs = self.folder / INPUTS
        if not inputs.exists():
            replace_text(inputs, json.dumps(dict(self.inputs_sha256 or {}), indent=2) + "\n")
        replace_bytes(path, data)
