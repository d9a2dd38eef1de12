"""Read the list of scenarios, ``scenarios.toml``."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from same.scenario import Scenario

LIST = Path(__file__).with_name("scenarios.toml")
_WORD = re.compile(r"[$]([A-Z_]+)")


def read_scenarios(path: Path = LIST) -> tuple[Scenario, ...]:
    """Return the scenarios.

    Raises
    ------
    ValueError
        A scenario refers to one that is not in the list, or two have one name.
    """
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    words = content.pop("words")
    spoilt = content.pop("spoilt")
    moved = content.pop("moved")
    scenarios = [
        _scenario(name, entry, words) for part in content.values() for name, entry in part.items()
    ]
    scenarios += [_spoilt(f"refused-{name}", entry, words) for name, entry in spoilt.items()]
    scenarios = [_moved(scenario, moved) for scenario in scenarios]
    names = [scenario.name for scenario in scenarios]
    for scenario in scenarios:
        unknown = {needed for _, needed in scenario.needs} - set(names)
        if unknown or names.count(scenario.name) > 1:
            raise ValueError(f"{path}: {scenario.name} comes twice or needs {sorted(unknown)}")
    return tuple(scenarios)


def _scenario(name: str, entry: Any, words: Mapping[str, str]) -> Scenario:
    """Return a scenario from its steps, or from a table with ``steps``, ``new``, ``absolute``."""
    table = entry if isinstance(entry, dict) else {"steps": entry}
    new = table.get("new")
    return Scenario(
        name,
        tuple(_filled(step, words) for step in table["steps"]),
        None if new is None else tuple(_filled(step, words) for step in new),
        table.get("absolute", 0.0),
    )


def _moved(scenario: Scenario, moved: Mapping[str, str]) -> Scenario:
    """Give a scenario the names that its studies have on the work tree."""
    steps = scenario.steps if scenario.new is None else scenario.new
    for old, new in moved.items():
        steps = tuple(step.replace(old, new) for step in steps)
    return replace(scenario, new=None if steps == scenario.steps else steps)


def _spoilt(name: str, entry: Mapping[str, Any], words: Mapping[str, str]) -> Scenario:
    """Return a scenario that puts every fault into a fresh copy, which a command must refuse."""
    steps = []
    for fault in entry["faults"]:
        steps += [f"cp {entry['source']} {entry['copy']}", fault]
        steps += [entry["command"], f"rm {entry['copy']}"]
    return Scenario(name, tuple(_filled(step, words) for step in steps))


def _filled(step: str, words: Mapping[str, str]) -> str:
    """Put texts in place of ``$NAME``, also within them."""
    while _WORD.search(step):
        step = _WORD.sub(lambda match: words[match[1]], step)
    return step
