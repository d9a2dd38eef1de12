"""Designs of experiments as tables: a user's own designs in, and a whole DOE out.

CSV or Excel. A column per design variable with its unit in the header, such as ``TSM x [1]``; a
whole DOE has the columns ``doe, design, plan``, its responses and ``failure`` beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.doe import SAME, Doe
from deboom.explore.space import DesignSpace
from deboom.files.tables import Row, parse_unit, read_rows

_RESERVED = ("doe", "design", "plan", "failure")


def read_designs(path: Path, space: DesignSpace) -> RealArray:
    """Read a user's table of designs.

    - `path`: ``.csv`` or ``.xlsx`` (first sheet), one column per design variable, in any order.
    - `space`: its variables.
    - returns (n, k): [units of the space].
    - raises InputError: the file is missing or no table, a column is missing, unknown or without
      its unit, an entry is no number or outside its bounds: names line and column.
    """
    plain, with_unit = _columns(space)
    return _designs(read_rows(path, plain, with_unit), space)


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
            "plan": list(doe.plans),
            **dict(zip(doe.space.labels, doe.designs.T, strict=True)),
            **{
                f"{name} [{doe.response_unit}]": column
                for name, column in zip(doe.response_names, doe.responses.T, strict=True)
            },
            "failure": [failure.value for failure in doe.failures],
        }
    )


def _columns(space: DesignSpace) -> tuple[tuple[str, ...], dict[str, str]]:
    """Columns without and with a unit that we can check, the latter with their SI unit."""
    with_unit = {}
    for name, unit in zip(space.names, space.units, strict=True):
        try:
            with_unit[name] = parse_unit(unit).si
        except InputError:  # a foreign model's own unit
            continue
    return tuple(name for name in space.names if name not in with_unit), with_unit


def _designs(rows: Sequence[Row], space: DesignSpace) -> RealArray:
    designs = np.empty((len(rows), space.n_variables))
    _, with_unit = _columns(space)
    for column, (name, unit) in enumerate(zip(space.names, space.units, strict=True)):
        factor = parse_unit(unit).factor if name in with_unit else 1.0
        lower, upper = float(space.lower[column]), float(space.upper[column])
        slack = SAME * (upper - lower)
        for place, row in enumerate(rows):
            value = row.number(name) / factor
            if not lower - slack <= value <= upper + slack:
                raise row.error(
                    f"'{name}' is {value:g}, outside its bounds {lower:g} to {upper:g} [{unit}]: "
                    "correct it or widen the bounds"
                )
            designs[place, column] = value
    return designs
