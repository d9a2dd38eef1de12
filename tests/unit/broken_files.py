"""Broken files: ways to break one, and what its refusal must be like."""

from dataclasses import replace

import pytest

from deboom.errors import InputError
from deboom.files.uff import read_uff, write_uff


def edited(name, old, new, count=1):
    """Change a text in one file."""

    def fault(folder):
        data = (folder / name).read_bytes()
        assert old.encode() in data, f"{old!r} is not in {name}"
        put(folder / name, data.replace(old.encode(), new.encode(), count))

    return fault


def edits(table, name=None):
    """Return faults and what they say, of a table `[file |] old | new | words ... more words`.

    Without the cell of the new text, the lines that begin with the old one go.
    """
    rows = []
    for line in table.strip().splitlines():
        *cells, words = (cell.strip(" ").replace("\\n", "\n") for cell in line.split(" | "))
        cells = cells if name is None else [name, *cells]
        rows.append(((edited if len(cells) == 3 else without)(*cells), words))
    return rows


def without(name, *starts):
    """Leave out the lines that begin so."""

    def fault(folder):
        lines = (folder / name).read_bytes().splitlines(keepends=True)
        kept = [
            line for line in lines if not line.startswith(tuple(start.encode() for start in starts))
        ]
        assert len(kept) < len(lines)
        put(folder / name, b"".join(kept))

    return fault


def without_sections(name, *starts):
    """Leave out the sections of a TOML file that begin so."""

    def fault(folder):
        sections = (folder / name).read_text(encoding="utf-8").split("\n\n")
        kept = [section for section in sections if not section.startswith(starts)]
        assert len(kept) < len(sections)
        put(folder / name, ("\n\n".join(kept) + "\n").encode())

    return fault


def content(name, data):
    """Give the file another content; None: it is gone."""

    def fault(folder):
        (folder / name).unlink(missing_ok=True)
        if data is not None:
            (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())

    return fault


def functions(name, change, *, binary=True):
    """Write the functions of a UFF file anew, as `change` makes them of those that are there."""

    def fault(folder):
        changed = change(list(read_uff(folder / name)))
        (folder / name).unlink()
        write_uff(folder / name, changed, binary=binary)

    return fault


def function(name, wanted, **changes):
    """Change the functions at a place of a UFF file, or at a node and direction.

    A callable among the changes gets the function.
    """

    def hit(place, function):
        return wanted in (
            place,
            function.response_node,
            (function.response_node, function.response_direction),
        )

    def change(functions):
        assert any(hit(place, function) for place, function in enumerate(functions))
        return [
            replace(function, **{k: v(function) if callable(v) else v for k, v in changes.items()})
            if hit(place, function)
            else function
            for place, function in enumerate(functions)
        ]

    return functions(name, change)


def all_of(*faults):
    """Break several things."""

    def fault(folder):
        for step in faults:
            step(folder)

    return fault


def put(path, data):
    """Replace a file; one that is linked elsewhere stays there as it was."""
    path.unlink()
    path.write_bytes(data)


def files(folder):
    """Return the content of every file but Python's own."""
    paths = [path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc"]
    return {path: path.read_bytes() for path in paths}


def refused(read, folder, *words):
    """Assert that a reader says all words, in ten sentences at most, and writes nothing."""
    before = files(folder)
    with pytest.raises(InputError) as caught:
        read(folder)
    text = str(caught.value)
    for word in " ... ".join(words).split(" ... "):
        assert word in text, text
    lines = text.splitlines()
    assert 1 <= len(lines) <= 11
    assert all(len(line) < 1200 for line in lines)
    assert files(folder) == before
    return text
