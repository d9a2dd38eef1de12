"""Exceptions for users: faults of input that a user can correct."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

LONGEST_LINE = 1000
"""Characters of a line of a message; of a longer one the middle is left out."""
MOST_SENTENCES = 10
"""Faults that a message lists; of the others it says how many there are."""


class InputError(ValueError):
    """Something the user brought is missing or wrong.

    The message is a sentence that names the file, the item and the remedy, or a line for each of
    the first ten faults and the number of the others. The command line prints it alone, without a
    traceback, and exits with code 2.

    - `sentences`: one for each fault, all of them.
    """

    def __init__(self, message: object = "") -> None:
        self.sentences = tuple(dict.fromkeys(map(_readable, str(message).split("\n"))))
        lines = list(self.sentences[:MOST_SENTENCES])
        if more := len(self.sentences) - len(lines):
            lines.append(f"and {more} more")
        super().__init__("\n".join(lines))


def _readable(line: str) -> str:
    if not line.isprintable():
        line = "".join(c if c.isprintable() else "?" for c in line)
    if len(line) > LONGEST_LINE:
        line = f"{line[: LONGEST_LINE // 2]} ... {line[-LONGEST_LINE // 2 :]}"
    return line


class DataWarning(UserWarning):
    """Something about the user's data that changes what a result is worth; the result stands.

    The message is a sentence that names the file and the item. The command line prints it alone.
    """


@dataclass(frozen=True)
class Finding:
    """What is wrong in data or likely to be, with the item and the remedy.

    - `certain`: nothing right looks like it, and studies refuse it.
    - `alarm`: if it is so, it denies what follows from the data; else it is worth a look.
    """

    sentence: str
    certain: bool = False
    alarm: bool = False

    @property
    def word(self) -> str:
        """The word before the sentence."""
        return "ALARM" if self.alarm else "WARNING"


@contextmanager
def naming(item: object) -> Iterator[None]:
    """Begin each sentence of a refusal with the item that it is about, such as its file."""
    try:
        yield
    except InputError as error:
        raise InputError("\n".join(f"{item}: {line}" for line in error.sentences)) from None


class IncompleteReport(Exception):
    """A run whose numbers are saved but whose page lacks a figure; `folder` is that of the run."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.folder = folder
