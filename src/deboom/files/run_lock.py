"""Who works in a run folder: one process at a time.

The lock belongs to the operating system, which takes it back when a process ends, however it ends:
a killed run leaves nothing behind that would have to be cleaned up by hand.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from deboom.errors import InputError

LOCK = ".lock"

if sys.platform == "win32":
    import msvcrt

    def _take(file: BinaryIO) -> None:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _take(file: BinaryIO) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Hold a run folder; when the work is done the lock's file goes as well.

    Raises
    ------
    InputError
        Another process holds it.
    """
    path = folder / LOCK
    with path.open("ab") as file:
        try:
            _take(file)
        except OSError:
            raise InputError(
                f"{folder} is being worked on by another process: wait for it or end it"
            ) from None
        yield
    path.unlink(missing_ok=True)


def is_held(folder: Path) -> bool:
    """Return whether a process works in a run folder now."""
    try:
        file = (folder / LOCK).open("rb+")
    except FileNotFoundError:
        return False
    with file:
        try:
            _take(file)
        except OSError:
            return True
    return False
