"""A search's folder: what was searched, and every evaluation in chunks.

``search.json`` holds the facts about the search, ``evaluations/000001.npz`` the first generation.
``inputs.json`` holds the hashes of the files that all of it was computed from. Nothing is pickled.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.files.disk import read_json, replace_bytes, replace_text

AnyArray = npt.NDArray[Any]


@dataclass(frozen=True)
class CheckpointFolder:
    """Where one search keeps what must survive its process.

    Every file appears complete or not at all, whenever the process is killed. The folder is made
    with the first file.

    - `folder`: of this search alone; its parent exists.
    - `inputs_sha256`: input files of the search and their hashes, such as `hash_files` gives.
    - raises InputError: the folder holds a search with other inputs: the sentence names the first
      such file.
    """

    folder: Path
    inputs_sha256: Mapping[str, str]

    def __post_init__(self) -> None:
        path = self.folder / "inputs.json"
        if not path.exists():
            return
        then = read_json(path, "it is damaged, start a new run")
        for name in sorted({*then, *self.inputs_sha256}):
            if then.get(name) != self.inputs_sha256.get(name):
                raise InputError(
                    f"{name} has changed since the run began whose evaluations are in "
                    f"{self.folder}: bring the file back as it was or start a new run"
                )

    def save(self, facts: Mapping[str, Any]) -> None:
        """Replace the facts about the search, which JSON can hold, in one step."""
        self._write("search.json", (json.dumps(facts, allow_nan=False) + "\n").encode())

    def load(self) -> dict[str, Any] | None:
        """Return the facts about the search; None before they were first saved.

        - raises InputError: a damaged file.
        """
        path = self.folder / "search.json"
        return read_json(path, "it is damaged, start a new run") if path.exists() else None

    def keep(self, number: int, arrays: Mapping[str, AnyArray]) -> None:
        """Keep the evaluations of one generation, from number 1."""
        stream = io.BytesIO()
        np.savez(stream, allow_pickle=False, **arrays)
        self._write(f"evaluations/{number:06d}.npz", stream.getvalue())

    def kept(self, number: int) -> dict[str, AnyArray] | None:
        """Return the evaluations of one generation; None if they were not kept.

        - raises InputError: a damaged file.
        """
        return _read_npz(self.folder / "evaluations" / f"{number:06d}.npz")

    def _write(self, name: str, data: bytes) -> None:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        inputs = self.folder / "inputs.json"
        if not inputs.exists():
            replace_text(inputs, json.dumps(dict(self.inputs_sha256), indent=2) + "\n")
        replace_bytes(path, data)


def read_evaluations(folder: Path) -> dict[str, AnyArray]:
    """Return every evaluation of a search, in the order in which they were made.

    - `folder`: of a `CheckpointFolder`, such as ``<run>/search``, whether its run is finished or
      not.
    - returns: ``generation``, shape (n,), from 1, and the columns that the search kept, such as
      ``designs`` (n, k), ``mean`` and ``sigma`` (n, r).
    - raises InputError: no evaluations, or a damaged file.
    """
    paths = sorted((folder / "evaluations").glob("[0-9]*.npz"))
    if not paths:
        raise InputError(f"{folder}: there are no evaluations in this folder")
    chunks = [chunk for path in paths if (chunk := _read_npz(path)) is not None]
    sizes = [len(next(iter(chunk.values()))) for chunk in chunks]
    numbers = [int(path.stem) for path in paths]
    columns = {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}
    return {"generation": np.repeat(numbers, sizes), **columns}


def _read_npz(path: Path) -> dict[str, AnyArray] | None:
    try:
        # all at once: numpy leaves a damaged file open
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as archive:
            return dict(archive)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path} cannot be read ({error}): it is damaged; start a new run"
        ) from None
