"""A search's folder: its last state, and every evaluation in chunks.

``state.npz`` holds arrays by name and, as text of its own, JSON with the facts; one file, so that
both always belong together. ``evaluations/000001.npz`` holds the first generation, and so on.
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
FACTS = "facts.json"


@dataclass(frozen=True)
class CheckpointFolder:
    """Where one search keeps what must survive its process.

    Every file appears complete or not at all, whenever the process is killed. The folder is made
    with the first file.

    Parameters
    ----------
    folder : Path
        Of this search alone; its parent exists.
    inputs_sha256 : mapping of str to str
        Input files of the search and their hashes, such as `hash_files` gives.

    Raises
    ------
    InputError
        The folder holds a search with other inputs: the sentence names the first such file.
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

    def save(self, arrays: Mapping[str, AnyArray], facts: Mapping[str, Any]) -> None:
        """Replace the state in one step.

        Parameters
        ----------
        arrays : mapping of str to array
            Numbers, booleans or text.
        facts : mapping
            What JSON can hold.
        """
        text = json.dumps(facts, allow_nan=False)
        self._write("state.npz", {**arrays, FACTS: np.array(text)})

    def load(self) -> tuple[dict[str, AnyArray], dict[str, Any]] | None:
        """Return the arrays and the facts of the last state saved; None before the first.

        Raises
        ------
        InputError
            A damaged file.
        """
        arrays = _read_npz(self.folder / "state.npz")
        if arrays is None:
            return None
        return arrays, json.loads(str(arrays.pop(FACTS)))

    def keep(self, number: int, arrays: Mapping[str, AnyArray]) -> None:
        """Keep the evaluations of one generation, from number 1."""
        self._write(f"evaluations/{number:06d}.npz", arrays)

    def kept(self, number: int) -> dict[str, AnyArray] | None:
        """Return the evaluations of one generation; None if they were not kept.

        Raises
        ------
        InputError
            A damaged file.
        """
        return _read_npz(self.folder / "evaluations" / f"{number:06d}.npz")

    def _write(self, name: str, arrays: Mapping[str, AnyArray]) -> None:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        inputs = self.folder / "inputs.json"
        if not inputs.exists():
            replace_text(inputs, json.dumps(dict(self.inputs_sha256), indent=2) + "\n")
        stream = io.BytesIO()
        np.savez(stream, allow_pickle=False, **arrays)
        replace_bytes(path, stream.getvalue())


def read_evaluations(folder: Path) -> dict[str, AnyArray]:
    """Return every evaluation of a search, in the order in which they were made.

    Parameters
    ----------
    folder : Path
        Of a `CheckpointFolder`, such as ``<run>/search``, whether its run is finished or not.

    Returns
    -------
    dict of str to array
        ``generation``, shape (n,), from 1, and the columns that the search kept, such as
        ``designs`` (n, k), ``mean`` and ``sigma`` (n, r).

    Raises
    ------
    InputError
        No evaluations, or a damaged file.
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
