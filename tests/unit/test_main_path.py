"""The two pages that lead through the code, from a platform's folder to a page: followed."""

import dataclasses
import inspect
import re
import typing
from enum import Enum
from importlib import import_module
from pathlib import Path

from deboom.explore.search import search
from deboom.files.platform import read_platform
from deboom.pages.robust_front import front_report
from deboom.runs.runner import load_study, shipped_studies
from deboom.vehicles.fleet_front import FleetFront
from deboom.vehicles.platform import Platform, Runs

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "from-folder-to-page.md").read_text(encoding="utf-8")
STUDY = load_study(shipped_studies() / "u06_robust_front.py").module
ROOTS = (
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
LISTED = dict(re.findall(r"^\| `(\w+)` \| `(deboom[\w.]*|studies[\w.]*)` \|", PAGE, flags=re.M))


def classes_in(hint):
    """Classes of deboom and of the study in an annotation."""
    for part in typing.get_args(hint):
        yield from classes_in(part)
    if inspect.isclass(hint) and hint.__module__.startswith("deboom"):
        yield hint


def hints_of(thing):
    """Annotations of a function, or of the fields of a class."""
    function = inspect.isfunction(thing)
    if not function and not dataclasses.is_dataclass(thing):
        return ()
    hints = typing.get_type_hints(thing)
    names = hints if function else [field.name for field in dataclasses.fields(thing)]
    return [hints[name] for name in names if not name.startswith("_")]


def types_on_the_path():
    """All types that a reader meets, by name."""
    waiting, kinds = list(ROOTS), {}
    while waiting:
        for hint in hints_of(waiting.pop()):
            for kind in classes_in(hint):
                if kind.__name__ not in kinds:
                    kinds[kind.__name__] = kind
                    waiting.append(kind)
    return kinds


def test_the_types_on_the_way_from_a_folder_to_a_page_are_those_listed():
    types = types_on_the_path()
    met = {name: kind.__module__ for name, kind in types.items() if not issubclass(kind, Enum)}
    assert met == LISTED


def test_every_function_on_the_page_is_there():
    named = re.findall(r"`(deboom(?:\.\w+)+)\(\)`", PAGE)
    assert len(named) >= 10
    for name in named:
        module, _, function = name.rpartition(".")
        try:
            home = import_module(module)
        except ModuleNotFoundError:
            module, _, kind = module.rpartition(".")
            home = getattr(import_module(module), kind)
        assert callable(getattr(home, function)), name
