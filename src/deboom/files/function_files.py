"""Formats in which noise transfer functions and operating spectra are read."""

from __future__ import annotations

from enum import Enum


class FunctionFiles(Enum):
    """Endings of the files.

    ``uff`` chooses functions by node and direction, the others by name: see
    `deboom.files.function_table`.
    """

    uff = "uff"
    csv = "csv"
    xlsx = "xlsx"
    mat = "mat"


TABLE_ENDINGS = tuple(f".{one.value}" for one in FunctionFiles if one is not FunctionFiles.uff)
"""Files of functions that are tables; any other is read as UFF."""
