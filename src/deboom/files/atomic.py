"""Files that appear complete or not at all."""

from __future__ import annotations

import tempfile
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
