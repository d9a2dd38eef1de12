"""A user's own designs as a table, CSV or Excel.

A column per design variable with its unit in the header, such as ``TSM x [1]``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.doe import SAME
from deboom.explore.space import DesignSpace
from deboom.files.tables import read_rows
from deboom.files.units import Unit, parse_unit


def read_designs(path: Path, space: DesignSpace) -> RealArray:
    """Read a user's table of designs.

    - `path`: ``.csv`` or ``.xlsx`` (first sheet), one column per design variable, in any order.
    - `space`: its variables.
    - returns (n, k): [units of the space].
    - raises InputError: the file is missing or no table, a column is missing, unknown or without
      its unit, an entry is no number or outside its bounds: names line and column.
    """
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
