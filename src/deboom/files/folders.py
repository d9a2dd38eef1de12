"""Files and folders that appear complete or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from deboom.errors import InputError


def replace_bytes(path: Path, data: bytes) -> None:
    """Write a file through a temporary one beside it; an existing file is replaced in one step.

    Raises
    ------
    InputError
        The folder is missing or cannot be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=".write-", dir=path.parent) as folder:
            scratch = Path(folder) / path.name
            scratch.write_bytes(data)
            scratch.replace(path)
    except OSError as error:
        raise InputError(
            f"{path} cannot be written ({error.strerror or error}): choose a folder that exists "
            "and may be written to"
        ) from None


def replace_text(path: Path, text: str) -> None:
    """Write UTF-8 text with the line ends it has, as `replace_bytes` does.

    Raises
    ------
    InputError
        The folder is missing or cannot be written.
    """
    replace_bytes(path, text.encode("utf-8"))


@contextmanager
def complete_or_not_at_all(folder: Path) -> Iterator[Path]:
    """Give a sibling folder to write to, and rename it to `folder` at the end.

    Parameters
    ----------
    folder : Path
        A new or an empty folder.

    Yields
    ------
    Path
        ``<folder>.unfinished``; deleted if an error leaves the block.

    Raises
    ------
    InputError
        A folder that is not empty or cannot be written.
    """
    target = folder.resolve()
    if target.exists() and not target.is_dir():
        raise InputError(f"{folder} is a file: name a new or an empty folder")
    if target.is_dir() and any(target.iterdir()):
        raise InputError(f"{folder} is not empty: name a new or an empty folder")
    unfinished = target.with_name(f"{target.name}.unfinished")
    try:
        unfinished.mkdir(parents=True)
    except FileExistsError:
        raise InputError(f"{unfinished} is left from a run that was stopped: delete it") from None
    except OSError as error:
        raise InputError(
            f"{folder} cannot be written ({error.strerror or error}): name another folder"
        ) from None
    try:
        yield unfinished
        if target.is_dir():
            # a rename onto an existing folder is refused on Windows
            target.rmdir()
        unfinished.rename(target)
    except BaseException as error:
        shutil.rmtree(unfinished, ignore_errors=True)
        if isinstance(error, OSError):
            raise InputError(
                f"{folder} cannot be written ({error.strerror or error}): name another folder"
            ) from None
        raise
