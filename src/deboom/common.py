"""Names that every package shares: axes, degrees of freedom, scales of units, progress, words."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from enum import Enum
from pathlib import Path
from typing import Literal, TypeVar

from deboom.errors import InputError

AXES: tuple[Literal["x"], Literal["y"], Literal["z"]] = ("x", "y", "z")
"""Axes of a vehicle, a mount or a sensor, in the order of every array."""
DOFS = (*AXES, "rx", "ry", "rz")
"""Degrees of freedom of a rigid body, in the order of every matrix."""

PERCENT = 100.0
"""From a share to per cent."""
N_PER_MM = 1e-3
"""From N/m to N/mm."""

CONFIDENCE = 0.95
"""Confidence of an interval that a page shows [1]."""

MOST_LISTED = 24
"""Names that a sentence can still be read with."""

Progress = Callable[[int, int, str], None]
"""Called after each step with its number, the number of steps, and a line of text."""

_Choice = TypeVar("_Choice", bound=Enum)


def shipped_studies() -> Path:
    """Return the folder of deboom's own studies: in the package, in a clone beside ``src``."""
    package = Path(__file__).parent
    inside = package / "studies"
    return inside if inside.is_dir() else package.parents[1] / "studies"


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


def option_name(name: str) -> str:
    """Return how an option is typed, without its dashes; ``with_`` is ``with``, as in PEP 8."""
    return name.rstrip("_").replace("_", "-")
