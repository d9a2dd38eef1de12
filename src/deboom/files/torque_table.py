"""The table of the engine torque at every line of an operating run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.files.atomic import replace_text
from deboom.files.table_cells import read_rows

SAME_LINE = 1e-3
"""How far two lines may differ and still be the same, as a fraction of the least spacing."""


def read_torque_table(path: Path, frequency: RealArray) -> RealArray:
    """Read the table ``frequency [Hz], engine torque [N m]``.

    Parameters
    ----------
    path : Path
        CSV, one row per line.
    frequency : array, shape (f,)
        Lines of the run's spectra [Hz]; nothing is interpolated.

    Returns
    -------
    array, shape (f,)
        Engine torque [N m].

    Raises
    ------
    InputError
        The file is missing or no such table, an entry is no finite number, or its lines are not
        those of the spectra.
    """
    rows = read_rows(path, (), {"frequency": "Hz", "engine torque": "N m"})
    lines = np.array([row.number("frequency") for row in rows])
    if lines.size != frequency.size:
        raise InputError(
            f"{path} has {lines.size} lines and the spectra have {frequency.size}: export the "
            "torque on the lines of the spectra"
        )
    spacing = np.diff(frequency).min() if frequency.size > 1 else frequency[0]
    other = np.flatnonzero(np.abs(lines - frequency) > SAME_LINE * spacing)
    if other.size:
        row = rows[other[0]]
        raise row.error(
            f"{lines[other[0]]:.9g} Hz, where the spectra have {frequency[other[0]]:.9g} Hz: "
            "export the torque on the lines of the spectra"
        )
    return np.array([row.number("engine torque") for row in rows])


def write_torque_table(path: Path, frequency: RealArray, engine_torque: RealArray) -> None:
    """Write the table that `read_torque_table` reads.

    Parameters
    ----------
    path : Path
        CSV; replaced if it is there.
    frequency : array, shape (f,)
        [Hz].
    engine_torque : array, shape (f,)
        [N m].

    Raises
    ------
    InputError
        The file cannot be written.
    """
    table = pd.DataFrame({"frequency [Hz]": frequency, "engine torque [N m]": engine_torque})
    replace_text(path, table.to_csv(index=False, lineterminator="\n"))
