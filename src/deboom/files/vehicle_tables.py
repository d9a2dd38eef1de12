"""Position sheet of the hammer's blows on a vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from deboom.files.atomic import replace_text
from deboom.files.table_cells import read_rows

_AXES = ("x", "y", "z")
_DIRECTIONS = tuple(f"{sign}{axis}" for axis in _AXES for sign in "+-")
_COLUMNS = ("impact", "mount", "piece", "node", "direction")


@dataclass(frozen=True)
class ImpactRow:
    """One blow.

    Parameters
    ----------
    impact : str
        Name, such as ``I3 y``.
    mount, piece : str
        Around which it lies; the piece of a single one is ``""``.
    node : int
        Reference node in the UFF files.
    direction : str
        Of a positive force, such as ``-y``: into the body.
    position : (x, y, z)
        From the powertrain's centre of gravity [m].
    """

    impact: str
    mount: str
    piece: str
    node: int
    direction: str
    position: tuple[float, float, float]

    @property
    def vector(self) -> tuple[float, ...]:
        """Unit vector along `direction`."""
        sign = -1.0 if self.direction.startswith("-") else 1.0
        return tuple(sign * (axis == self.direction[1:]) for axis in _AXES)


def read_impact_table(path: Path) -> tuple[ImpactRow, ...]:
    """Read the table ``impact, mount, piece, node, direction, x [unit], y [unit], z [unit]``.

    Raises
    ------
    InputError
        No such table; a column or a unit is missing; a blow or its DoF comes twice; an unknown
        direction; a node that is no number.
    """
    seen: dict[str, int] = {}
    impacts = []
    for row in read_rows(path, _COLUMNS, dict.fromkeys(_AXES, "m")):
        name, direction, node = (row.filled(c) for c in ("impact", "direction", "node"))
        if direction not in _DIRECTIONS:
            raise row.error(f"direction '{direction}': use one of {', '.join(_DIRECTIONS)}")
        if not node.isdecimal() or int(node) < 1:
            raise row.error(f"node '{node}' is no whole number from 1: correct it")
        for key, what in (
            (name, f"impact '{name}'"),
            (node + direction, f"DoF {node} {direction}"),
        ):
            if key in seen:
                raise row.error(f"{what} stands in line {seen[key]} already: keep one")
            seen[key] = row.line
        x, y, z = (row.number(axis) for axis in _AXES)
        impacts.append(
            ImpactRow(
                name, row.filled("mount"), row.cells["piece"], int(node), direction, (x, y, z)
            )
        )
    return tuple(impacts)


def write_impact_table(path: Path, rows: Sequence[ImpactRow]) -> None:
    """Write the table that `read_impact_table` reads, in metres."""
    table = pd.DataFrame(
        [(r.impact, r.mount, r.piece, r.node, r.direction, *r.position) for r in rows],
        columns=[*_COLUMNS, *(f"{axis} [m]" for axis in _AXES)],
    )
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))
