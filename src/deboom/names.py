"""Names from files: what they may be, which two are too alike, paths made of them; and options."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path, PurePosixPath

from deboom.errors import InputError

LONGEST_NAME = 60
"""Characters of a name; four bytes each and an ending fit into a file name."""
_FORBIDDEN = '"*,/:<>?\\|'
"""No file name may hold them on Windows, and no cell of a CSV table a comma."""
_DEVICES = {"con", "prn", "aux", "nul", "conin$", "conout$"}
_DEVICES |= {f"{port}{number}" for port in ("com", "lpt") for number in "123456789¹²³"}
_UNSEEN = (
    "\u034f\u115f\u1160\u17b4\u17b5\u2800\u3164\uffa0"  # the blank of Braille is one by its picture
    "\u180b\u180c\u180d\u180f"
    + "".join(map(chr, (*range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0))))
)
"""Default_Ignorable_Code_Point of Unicode 16, of which Python says that they can be printed."""
_TYPED_ALIKE = str.maketrans("_—", "--")


def name_fault(name: str) -> str:
    """Return what is wrong with a name, as the end of a sentence; ``""`` if nothing is.

    Files are called after vehicles, mounts and runs: a name must be a file's on every system.
    """
    if not name or any(c.isspace() or not c.isprintable() or c in _FORBIDDEN for c in name):
        marks = " ".join(_FORBIDDEN)
        return f"a name needs at least one character, no blanks, no controls and none of {marks}"
    unseen = next((c for c in name if c in _UNSEEN), "")
    if unseen:
        return f"a name is seen as it is: take the invisible U+{ord(unseen):04X} out"
    if len(name) > LONGEST_NAME:
        return f"a name has at most {LONGEST_NAME} characters, not {len(name)}"
    if not unicodedata.is_normalized("NFC", name):
        return "a letter and its accent are two characters (the name is not NFC): type it again"
    if name.startswith(".") or name.endswith("."):
        return "a name neither begins nor ends with a dot"
    if name.partition(".")[0].casefold() in _DEVICES:
        return "Windows keeps this name for a device: choose another"
    return ""


def look_alikes(what: str, names: Sequence[str]) -> Iterator[str]:
    """Give a sentence for each name that stands beside another which looks like it.

    - `what`: items of the names in the singular, such as ``vehicle``.
    - `names`: in any order; a name may come more than once.
    """
    first: dict[str, str] = {}
    for name in dict.fromkeys(names):
        plain = unicodedata.normalize("NFKC", name)
        keys = {plain.casefold(), _skeleton(plain)}
        twin = next((first[key] for key in sorted(keys) if key in first), None)
        if twin is not None:
            difference = "in capitals only" if twin.casefold() == name.casefold() else "hardly"
            yield f"{what} '{name}' beside '{twin}' differs {difference}: keep or rename one"
        for key in keys:
            first.setdefault(key, name)


def _skeleton(name: str) -> str:
    """Return a text that names have in common which are drawn alike [UTS #39, section 4]."""
    letters = unicodedata.normalize("NFD", name.translate(_TYPED_ALIKE))
    return unicodedata.normalize("NFD", "".join(map(_drawn_as, letters)))


@cache
def _drawn_as(letter: str) -> str:
    """Return one of the texts that a letter is drawn like; the longest, such as rn for m."""
    from confusable_homoglyphs.confusables import confusables_data  # 40 ms

    alike, new = {letter}, [letter]
    while new:
        pairs = confusables_data.get(new.pop(), ())
        new += {pair["c"] for pair in pairs} - alike
        alike.update(new)
    return min(alike, key=lambda text: (-len(text), text))


def is_inside(name: str) -> bool:
    """Tell whether a relative name with ``/`` between its parts stays in its folder."""
    parts = PurePosixPath(name)
    wrong = any(c in "\\:" or not c.isprintable() for c in name)
    return bool(parts.name) and not (parts.is_absolute() or ".." in parts.parts or wrong)


def path_inside(folder: Path, name: str) -> Path:
    """Return the path of a file or folder by its name in a folder, which it cannot leave.

    Parameters
    ----------
    folder : Path
        Holds the file, which need not exist.
    name : str
        Relative, with ``/`` between its parts.

    Raises
    ------
    InputError
        An absolute name, one with ``..``, a backslash, a colon or a control, or one that a link
        leads out of the folder.
    """
    if not is_inside(name):
        raise InputError(f"{name!r} is not a file name within {folder}: use / between its parts")
    path = folder / name
    # of links in a circle `Path.resolve` makes a RuntimeError until Python 3.12
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise InputError(f"{path} is a link out of {folder}: put what it leads to in its place")
    return path


def option_name(name: str) -> str:
    """Return how an option is typed, without its dashes; ``with_`` is ``with``, as in PEP 8."""
    return name.rstrip("_").replace("_", "-")
