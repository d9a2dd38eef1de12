"""Panels around a cabin as files hold them: position sheet, motion and pressure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.function_matrix import Dof, FunctionMatrix
from deboom.files.platform_file import RelativePath
from deboom.files.strict_toml import StrictModel
from deboom.files.table_cells import read_rows
from deboom.measurement.channels import Frf
from deboom.measurement.noise_transfer import ACCELERATION_PER_VOLUME_ACCELERATION
from deboom.measurement.panels import PRESSURE_PER_VOLUME_ACCELERATION, PanelMeasurement

_NORMAL = ("nx", "ny", "nz")
_PLACE = {"x": "m", "y": "m", "z": "m", "area": "m^2"}
_FRF = (4,)


class PanelEntry(StrictModel):
    """``[panels]`` in ``vehicle.toml``: what was measured at the panels of the cabin."""

    table: RelativePath
    """Position sheet, CSV."""
    motion: RelativePath
    """UFF: acceleration of the panels inwards per volume acceleration at the ears."""
    pressure: RelativePath
    """UFF: pressure at the panels per volume acceleration at the ears."""


@dataclass(frozen=True)
class PanelRow:
    """One panel.

    Parameters
    ----------
    panel : str
        Such as ``trunk floor``.
    node : int
        In the UFF files, of its accelerometer and of its microphone.
    position : (x, y, z)
        From the powertrain's centre of gravity [m].
    normal : (x, y, z)
        Unit vector into the cabin [1].
    area : float
        With which its motion changes the volume of the cabin [m²].
    """

    panel: str
    node: int
    position: tuple[float, float, float]
    normal: tuple[float, float, float]
    area: float


def read_panel_table(path: Path) -> tuple[PanelRow, ...]:
    """Read ``panel, node, nx, ny, nz, x [unit], y [unit], z [unit], area [unit]``.

    Raises
    ------
    InputError
        No such table; a column or unit is missing; a panel or node comes twice; a normal that is no
        unit vector; an area that is not positive.
    """
    panels: list[PanelRow] = []
    for row in read_rows(path, ("panel", "node", *_NORMAL), _PLACE):
        name, node = row.filled("panel"), row.filled("node")
        if not node.isdecimal() or int(node) < 1:
            raise row.error(f"node '{node}' is no whole number from 1: correct it")
        if any(name == other.panel or int(node) == other.node for other in panels):
            raise row.error(f"panel '{name}' or its node {node} comes twice: keep one")
        x, y, z = (row.number(axis) for axis in "xyz")
        nx, ny, nz = (row.number(axis) for axis in _NORMAL)
        if abs(np.hypot(np.hypot(nx, ny), nz) - 1) > 1e-3:
            raise row.error(f"the normal of '{name}' is no unit vector into the cabin")
        if row.number("area") <= 0:
            raise row.error(f"the area of '{name}' is not positive: turn its normal instead")
        panels.append(PanelRow(name, int(node), (x, y, z), (nx, ny, nz), row.number("area")))
    return tuple(panels)


def write_panel_table(path: Path, rows: Sequence[PanelRow]) -> None:
    """Write the table that `read_panel_table` reads, in metres."""
    table = pd.DataFrame(
        [(r.panel, r.node, *r.normal, *r.position, r.area) for r in rows],
        columns=["panel", "node", *_NORMAL, *(f"{name} [{unit}]" for name, unit in _PLACE.items())],
    )
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))


def read_panels(folder: Path, entry: PanelEntry, ears: Sequence[Dof]) -> PanelMeasurement:
    """Read what was measured at the panels.

    Parameters
    ----------
    folder : Path
        Of the vehicle.
    entry : PanelEntry
        Names the files.
    ears : sequence of Dof
        Where the loudspeaker stood.

    Raises
    ------
    InputError
        A file or function that is missing, doubled, or of another type or unit; other lines.
    """
    rows = read_panel_table(folder / entry.table)
    names = tuple(row.panel for row in rows)
    dofs = [Dof(row.panel, row.node, "scalar") for row in rows]
    ear_names = tuple(ear.name for ear in ears)
    motion = FunctionMatrix(folder / entry.motion, "panels", _FRF)
    pressure = FunctionMatrix(folder / entry.pressure, "panels", _FRF)
    if not np.array_equal(motion.frequency, pressure.frequency):
        raise InputError(f"{pressure.path} and {motion.path} have different lines: export alike")
    return PanelMeasurement(
        names=names,
        positions=np.array([row.position for row in rows]),
        normals=np.array([row.normal for row in rows]),
        areas=np.array([row.area for row in rows]),
        motion=Frf(
            motion.frequency,
            motion.values(dofs, ears, ordinate="acceleration", unit="m/s^2/m^3/s^2"),
            names,
            ear_names,
            ACCELERATION_PER_VOLUME_ACCELERATION,
        ),
        pressure=Frf(
            pressure.frequency,
            pressure.values(dofs, ears, ordinate="pressure", unit="Pa/m^3/s^2"),
            names,
            ear_names,
            PRESSURE_PER_VOLUME_ACCELERATION,
        ),
    )
