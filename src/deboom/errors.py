"""Exceptions for users: faults of input that a user can correct, and words of their sentences."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TypeVar

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

    See Also
    --------
    deboom.check_platform
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


MOST_LISTED = 24
"""Names that a sentence can still be read with."""
_Choice = TypeVar("_Choice", bound=Enum)


def word_of(word: str, words: Sequence[str], item: str) -> str:
    """Return a word that is one of several, or refuse it with the nearest one.

    - `item`: what the word names, for the message.
    - raises InputError: another word.
    """
    if word in words:
        return word
    close = difflib.get_close_matches(word, words, n=1)
    choices = ", ".join(dict.fromkeys(words))
    hint = f"did you mean '{close[0]}'?" if close else f"use one of {choices}"
    raise InputError(f"{item} '{word}' is unknown: {hint}")


def choice(kind: type[_Choice], word: str | _Choice, item: str) -> _Choice:
    """Return the member of an Enum that a word names; see `word_of`."""
    if isinstance(word, kind):
        return word
    return kind(word_of(str(word), [str(member.value) for member in kind], item))


def listed(names: Sequence[str]) -> str:
    """Write names with commas and an ``and``; of very many the first three and how many more."""
    if len(names) > MOST_LISTED:
        return f"{', '.join(names[:3])} and {len(names) - 3} others"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
