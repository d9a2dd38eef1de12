"""The page that leads through the code, from a platform's folder to a page: followed."""

import re
import sys
from importlib import import_module
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "from-folder-to-page.md").read_text(encoding="utf-8")


def test_the_table_of_types_has_arguments_results_and_their_fields(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    rows = import_module("types_on_the_path").table().splitlines()[2:]
    sys.modules.pop("types_on_the_path")
    platform = (
        "| `Platform` | `deboom.vehicles.platform` | Everything measured on one platform, and the "
        "model of its noise; made by `read_platform` |"
    )
    assert platform in rows
    meets = {re.match(r"\| `(\w+)`", row)[1] for row in rows}
    assert {"Robust", "Front", "Report"} <= meets  # an argument, a field and a result
    assert "Motion" not in meets  # a list of words
    assert all(row.count("|") == 4 and not row.endswith("|  |") for row in rows)


def test_every_function_on_the_page_is_there():
    named = re.findall(r"`(deboom(?:\.\w+)+)\(\)`", PAGE)
    assert named
    for name in named:
        module, _, function = name.rpartition(".")
        try:
            home = import_module(module)
        except ModuleNotFoundError:
            module, _, kind = module.rpartition(".")
            home = getattr(import_module(module), kind)
        assert callable(getattr(home, function)), name
