"""A user's own designs: a table, CSV or Excel, or the state that the interactive page saves.

A table has a column per design variable with its unit in the header, such as ``TSM x [1]``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.doe import SAME
from deboom.explore.space import DesignSpace
from deboom.files.disk import read_text
from deboom.files.tables import read_rows
from deboom.files.units import Unit, parse_unit


def read_designs(path: Path, space: DesignSpace) -> RealArray:
    """Read a user's designs.

    - `path`: ``.csv`` or ``.xlsx`` (first sheet), one column per design variable, in any order; or
      ``.json`` as the interactive page saves it: its design first, then those that are pinned.
    - `space`: its variables.
    - returns (n, k): [units of the space].
    - raises InputError: the file is missing or no table, a column is missing, unknown or without
      its unit, an entry is no number or outside its bounds: names line and column. A saved state
      of other variables.
    """
    if path.suffix.lower() == ".json":
        return _saved_designs(path, space)
    units = {name: _unit(unit) for name, unit in zip(space.names, space.units, strict=True)}
    si_units = {name: unit.si for name, unit in units.items() if unit.si}
    rows = read_rows(path, [name for name in units if name not in si_units], si_units)
    designs = np.empty((len(rows), space.n_variables))
    for column, (name, unit) in enumerate(units.items()):
        lower, upper = float(space.lower[column]), float(space.upper[column])
        slack = SAME * (upper - lower)
        for place, row in enumerate(rows):
            value = row.number(name) / unit.factor
            if not lower - slack <= value <= upper + slack:
                raise row.error(
                    f"'{name}' is {value:g}, outside its bounds {lower:g} to {upper:g} "
                    f"[{unit.label}]: correct it or widen the bounds"
                )
            designs[place, column] = value
    return designs


def _unit(label: str) -> Unit:
    """Return the unit of a variable; one that only a foreign model knows has no SI unit."""
    try:
        return parse_unit(label)
    except InputError:
        return Unit(label, "", 1.0)


def _saved_designs(path: Path, space: DesignSpace) -> RealArray:
    """Read the designs of a state that the interactive page saved, (n, k)."""
    try:
        content: Any = json.loads(read_text(path))
        names = [str(name) for name in content["variables"]]
        designs = {"its design": content["design"]}
        designs |= {f"its pin {pin['name']}": pin["design"] for pin in content["pinned"]}
        rows = [np.asarray(design, dtype=float).reshape(len(names)) for design in designs.values()]
    except InputError:
        raise
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path} is no state that the interactive page saved ({error}): save one with its "
            "button “Save”"
        ) from None
    if sorted(names) != sorted(space.names):
        odd = sorted(set(names) ^ set(space.names))[0]
        raise InputError(
            f"{path} has designs of other variables: '{odd}' is in only one of both; save a design "
            "on the page of a run with the same variables"
        )
    table = np.stack(rows)[:, [names.index(name) for name in space.names]]
    for name, row in zip(designs, table, strict=True):
        slack = SAME * (space.upper - space.lower)
        outside = ~((row >= space.lower - slack) & (row <= space.upper + slack))
        if outside.any():
            k = int(np.argmax(outside))
            raise InputError(
                f"{path}: {name} has '{space.names[k]}' {row[k]:g}, outside its bounds "
                f"{space.lower[k]:g} to {space.upper[k]:g}: widen the bounds or save another design"
            )
    return np.asarray(np.clip(table, space.lower, space.upper))
