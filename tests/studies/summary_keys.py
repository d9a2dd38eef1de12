"""Which keys of a summary a study's docstring defines."""

import ast
import re
from pathlib import Path

STUDIES = Path(__file__).parents[2] / "studies"


def described(name):
    """Return a study's docstring, with those of the studies whose keys it takes over."""
    text = ast.get_docstring(ast.parse((STUDIES / f"{name}.py").read_text(encoding="utf-8")))
    text = " ".join(text.split())
    keys = re.split(r"Keys? of summary\.json", text, maxsplit=1)[-1]
    others = re.search(r"those of ([\w, ]+)", keys)
    names = {path.stem for path in STUDIES.glob("*.py")} - {name}
    mentioned = sorted(names & set(re.findall(r"\w+", others[1]))) if others else []
    return " ".join([keys, *map(described, mentioned)])


def undefined(keys, text):
    """Return the keys that a text does not define.

    ``<name>``, ``…`` and ``*`` stand for anything; a word that begins with ``_``
    or ``…`` is added to a key that is defined, one that ends with ``_`` is put before it.
    """
    words = {word.strip(".,;:()") for word in text.split()}
    whole = [p for word in words if word[:1].isalpha() for p in _patterns(word)]
    ends = [p for w in words if w.startswith(("_", "…_")) for p in _patterns(w.lstrip("…"))]
    begins = [word for word in words if word.endswith("_")]

    def defined(key):
        if any(pattern.fullmatch(key) for pattern in whole):
            return True
        if any(key.startswith(word) and defined(key.removeprefix(word)) for word in begins):
            return True
        places = [place for place in range(1, len(key)) if key[place] == "_"]
        return any(
            pattern.fullmatch(key[place:]) and defined(key[:place])
            for place in places
            for pattern in ends
        )

    return [key for key in keys if not defined(key)]


def _patterns(word):
    """Return what a word of the docstring stands for; ``x_a|b`` is ``x_a`` and ``x_b``."""
    first, *others = word.split("|")
    chunks = first.split("_")
    every = [first, *("_".join([*chunks[: -len(o.split("_"))], o]) for o in others)]
    return [
        re.compile(".+".join(map(re.escape, re.split(r"<\w+>|…|\*", pattern)))) for pattern in every
    ]
