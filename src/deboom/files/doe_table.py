"""Designs of experiments as tables: a user's own designs in, and a whole DOE out.

CSV or Excel. A column per design variable with its unit in the header, such as ``TSM x [1]``; a
whole DOE has the columns ``doe, design, plan``, its responses and ``failure`` beside them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.doe import SAME, Doe
from deboom.explore.space import DesignSpace
from deboom.files.tables import read_rows
from deboom.files.units import Unit, parse_unit

_RESERVED = ("doe", "design", "plan", "failure")


def read_designs(path: Path, space: DesignSpace) -> RealArray:
    """Read a user's table of designs.

    - `path`: ``.csv`` or ``.xlsx`` (first sheet), one column per design variable, in any order.
    - `space`: its variables.
    - returns (n, k): [units of the space].
    - raises InputError: the file is missing or no table, a column is missing, unknown or without
      its unit, an entry is no number or outside its bounds: names line and column.
    """
    units = {name: _unit(unit) for name, unit in zip(space.names, space.units, strict=True)}
    known = {name: unit.si for name, unit in units.items() if unit.si}
    rows = read_rows(path, [name for name in units if name not in known], known)
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


def doe_frame(doe: Doe) -> pd.DataFrame:
    """Return a DOE as a table.

    - raises InputError: a response with the name of a variable or of one of the table's own
      columns.
    """
    taken = [*_RESERVED, *doe.space.names]
    for name in doe.response_names:
        if name in taken:
            raise InputError(f"response '{name}' has the name of another column: rename it")
    return pd.DataFrame(
        {
            "doe": doe.name,
            "design": np.arange(1, len(doe) + 1),
            "plan": doe.plan,
            **dict(zip(doe.space.labels, doe.designs.T, strict=True)),
            **{
                f"{name} [{doe.response_unit}]": column
                for name, column in zip(doe.response_names, doe.responses.T, strict=True)
            },
            "failure": list(doe.failures),
        }
    )
