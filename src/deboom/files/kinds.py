"""Kinds of folders and files; a light module, so that help starts at once."""

from __future__ import annotations

from enum import Enum


class FolderKind(Enum):
    """Kinds of folders with measurements."""

    platform = "platform"
    campaign = "campaign"
    vehicle = "vehicle"
    compressor = "compressor"
    operation = "operation"
    car = "car"
    component = "component"
    hammer = "hammer"


class FunctionFiles(Enum):
    """Endings of the files.

    ``uff`` chooses functions by node and direction, the others by name: see
    `deboom.files.function_table`.
    """

    uff = "uff"
    csv = "csv"
    xlsx = "xlsx"
    mat = "mat"
