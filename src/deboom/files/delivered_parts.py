"""Measured parts of a delivery: one row per part, one column per axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from deboom.errors import InputError
from deboom.files.table_cells import read_rows, refuse_second

PLAIN = ("part", "batch", "mount")
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class DeliveredPart:
    """One measured part.

    Parameters
    ----------
    name : str
        Serial number.
    batch : str
    mount : str
    stiffness : mapping of str to float
        Axis → magnitude of the dynamic stiffness [N/m], or over that of today's part at the same
        state [1]; axes that were not measured are missing.
    """

    name: str
    batch: str
    mount: str
    stiffness: Mapping[str, float]


def read_delivered_parts(
    path: Path, required: Mapping[str, tuple[str, ...]], *, over_today: bool = False
) -> tuple[DeliveredPart, ...]:
    """Read the parts of a delivery.

    Parameters
    ----------
    path : Path
        ``.xlsx`` or ``.csv`` with the columns ``part, batch, mount, x [N/mm], y [N/mm], z [N/mm]``
        in any order; N/m is read as well. A cell may be empty where the axis is not required.
    required : mapping of str to tuple of str
        Mount → axes that must be measured.
    over_today : bool
        The columns are ``x [1], y [1], z [1]``: stiffness over that of today's part, both measured
        at one state on one machine.

    Returns
    -------
    tuple of DeliveredPart
        In the order of the table.

    Raises
    ------
    InputError
        A column that is missing, or in another quantity's unit; a part named twice, of an unknown
        mount, without a required axis, or with a stiffness that is not positive.
    """
    parts, seen = [], dict[str, int]()
    for row in read_rows(path, PLAIN, dict.fromkeys(AXES, "1" if over_today else "N/m")):
        name, mount = row.filled("part"), row.filled("mount")
        refuse_second(seen, f"part '{name}'", row)
        if mount not in required:
            raise row.error(
                f"part '{name}': the box knows no mount '{mount}', only {', '.join(required)}"
            )
        stiffness = {}
        for axis in AXES:
            if not row.cells[axis] and axis not in required[mount]:
                continue
            if not row.cells[axis]:
                raise row.error(
                    f"part '{name}': {mount} {axis} was not measured, and the box limits it: "
                    "measure it"
                )
            stiffness[axis] = row.number(axis)
            if not stiffness[axis] > 0.0:
                raise row.error(
                    f"part '{name}': {mount} {axis} is {stiffness[axis]:g} N/m, a stiffness is "
                    "above 0: correct the measurement"
                )
        parts.append(DeliveredPart(name, row.filled("batch"), mount, stiffness))
    if not parts:
        raise InputError(f"{path} holds no part: one row per part")
    return tuple(parts)
