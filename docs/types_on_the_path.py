"""Write the table of the types that a reader of the page *From folder to page* meets.

``conf.py`` puts it into the page; ``python docs/types_on_the_path.py`` prints it.
"""

from __future__ import annotations

import dataclasses
import inspect
import typing
from collections.abc import Iterator
from enum import Enum
from typing import Any

from deboom.explore.search import search
from deboom.files.platform import read_platform
from deboom.pages.robust_front import front_report
from deboom.runs.runner import load_study, shipped_studies
from deboom.vehicles.fleet_front import FleetFront
from deboom.vehicles.platform import Platform, Runs

STUDY = load_study(shipped_studies() / "front.py").module
STEPS = (
    read_platform,
    Platform.runs,
    Platform.model,
    Runs.model,
    search,
    FleetFront,
    STUDY.prepare,
    STUDY.run,
    front_report,
)
"""Functions and classes that the steps of the page begin with."""


def types_on_the_path() -> dict[str, type]:
    """Collect the classes in the signatures of the steps, and in the fields of what they return."""
    waiting: list[Any] = list(STEPS)
    types: dict[str, type] = {}
    while waiting:
        for hint in _hints(waiting.pop()):
            for kind in _classes(hint):
                if kind.__name__ not in types:
                    types[kind.__name__] = kind
                    waiting.append(kind)
    return types


def table() -> str:
    """Write a row in Markdown per type, lists of words (Enum) left out, by module and name."""
    kinds = [kind for kind in types_on_the_path().values() if not issubclass(kind, Enum)]
    rows = [
        f"| `{kind.__name__}` | `{kind.__module__}` | {_first_sentence(kind)} |"
        for kind in sorted(kinds, key=lambda kind: (kind.__module__, kind.__name__))
    ]
    return "\n".join(["| type | module | what it is |", "|---|---|---|", *rows])


def _first_sentence(kind: type) -> str:
    return " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split()).removesuffix(".")


def _hints(thing: Any) -> list[Any]:
    """Return the annotations of a function, or of the public fields of a dataclass."""
    is_function = inspect.isfunction(thing)
    if not is_function and not dataclasses.is_dataclass(thing):
        return []
    hints = typing.get_type_hints(thing)
    names = list(hints) if is_function else [field.name for field in dataclasses.fields(thing)]
    return [hints[name] for name in names if not name.startswith("_")]


def _classes(hint: Any) -> Iterator[type]:
    """Yield the classes of deboom and of its studies in an annotation."""
    for part in typing.get_args(hint):
        yield from _classes(part)
    if inspect.isclass(hint) and hint.__module__.startswith("deboom"):
        yield hint


if __name__ == "__main__":
    print(table())
