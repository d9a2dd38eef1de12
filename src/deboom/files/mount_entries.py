"""Mounts out of the entries of a TOML file and the table of their positions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from deboom.errors import InputError
from deboom.files.faults import Note, refuse
from deboom.files.platform_file import MountEntry
from deboom.files.platform_tables import MountRow
from deboom.mounts.mount import Mount


def mounts_of(
    path: Path,
    entries: Sequence[MountEntry],
    table: Path,
    rows: Sequence[MountRow],
    note: Note = refuse,
) -> tuple[Mount, ...]:
    """Put mounts and positions together.

    Parameters
    ----------
    path : Path
        File of the entries, for messages.
    entries : sequence of MountEntry
        In the order of the result.
    table : Path
        File of the rows, for messages.
    rows : sequence of MountRow
        One per mount and piece, in any order.
    note : callable
        Gets every fault; by default the first one is raised. A position at fault is nan.

    Raises
    ------
    InputError
        A row without its mount, a mount or piece without its row.
    """
    known = {(entry.name, piece) for entry in entries for piece in entry.piece_names}
    positions = {(row.mount, row.piece): row.position for row in rows}
    for key in positions:
        if key not in known:
            note(
                InputError(
                    f"{table}: mount '{key[0]}', piece '{key[1]}' is not in {path}: "
                    "correct its name or add it there"
                )
            )

    def position(entry: MountEntry, piece: str) -> tuple[float, float, float]:
        if (entry.name, piece) not in positions:
            note(
                InputError(
                    f"{table}: no row for mount '{entry.name}', piece '{piece}': add its position"
                )
            )
        return positions.get((entry.name, piece), (math.nan,) * 3)

    return tuple(
        Mount(
            name=entry.name,
            description=entry.description,
            pieces=entry.piece_names,
            positions=tuple(position(entry, piece) for piece in entry.piece_names),
            transfer_axes=entry.transfer_axes,
            body_mass=entry.body_mass_kg,
            body_mass_tolerance=entry.body_mass_tolerance_kg or 0.0,
        )
        for entry in entries
    )
