"""Write the table of the keys of ``summary.json``, from the calls of ``Report.number`` in the code.

``conf.py`` puts it into the page; ``python docs/keys_of_summaries.py`` prints it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from html import escape
from pathlib import Path

from deboom.files.shipped_studies import shipped_studies

ROOT = Path(__file__).parents[1]


def numbers_of(text: str, name: str) -> Iterator[tuple[str, str, str]]:
    """Yield key, unit and meaning of each number that a module says; names of things in ``<>``.

    - raises ValueError: a key or a meaning that only a run would tell; names the line.
    """
    for call in ast.walk(ast.parse(text)):
        match call:
            case ast.Call(func=ast.Attribute(attr="number"), args=[key, _, unit, label]):
                key_text, label_text = _words(key), _words(label)
                if not key_text or not label_text:
                    raise ValueError(f"{name}, line {call.lineno}: write key and meaning as text")
                yield key_text, _words(unit), label_text


def _words(node: ast.expr) -> str:
    """Return a text as it is written; what a run fills in by its name; empty for anything else."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.JoinedStr(values=parts):
            words = [_words(part) for part in parts]
            return "".join(words) if all(words) else ""
        case ast.FormattedValue(value=ast.Name(id=name) | ast.Attribute(attr=name)):
            return f"<{name}>"
    return ""


def _cell(text: str) -> str:
    """Return a text as a cell of a table in Markdown shows it."""
    return escape(text, quote=False).replace("|", "&#124;")


def table() -> str:
    """Write a row in Markdown per key of every page, by key."""
    modules = [*(ROOT / "src" / "deboom").rglob("*.py"), *shipped_studies().glob("*.py")]
    rows = {
        f"| `{key}` | {unit} | {_cell(label)} | `{path.stem}` |"
        for path in modules
        for key, unit, label in numbers_of(path.read_text(encoding="utf-8"), path.name)
    }
    return "\n".join(["| key | unit | meaning | said by |", "|---|---|---|---|", *sorted(rows)])


if __name__ == "__main__":
    print(table())
