"""A reader of functions from npz files, as it would stand in deboom.files.function_table."""

from functools import partial
from pathlib import Path

import numpy as np

from deboom.errors import InputError
from deboom.files.disk import read_arrays
from deboom.files.function_table import FunctionTable

VARIABLES = ("frequency", "names", "values", "units")


def from_npz(path: Path) -> FunctionTable:
    """Read frequency [Hz], names (n,), complex values (n_frequency, n) and units (n,)."""
    content = read_arrays(path, "save it again")
    missing = [name for name in VARIABLES if name not in content]
    if missing:
        raise InputError(f"{path}: there is no array '{missing[0]}': save {', '.join(VARIABLES)}")
    frequency, names, values, units = (content[name] for name in VARIABLES)
    if values.shape != (frequency.size, names.size) or units.shape != names.shape:
        raise InputError(
            f"{path}: {frequency.size} frequencies, {names.size} names, {units.size} units and "
            f"values of shape {values.shape} do not fit together: one row per frequency, one "
            "column per name"
        )
    columns = {
        str(name): (str(unit), np.asarray(values[:, column], dtype=complex))
        for column, (name, unit) in enumerate(zip(names, units, strict=True))
    }
    # a table reads a function when it is asked for, so that a fault of one leaves the others
    functions = {name: partial(columns.__getitem__, name) for name in columns}
    return FunctionTable(np.asarray(frequency, dtype=float), functions)
