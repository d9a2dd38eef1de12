"""Files made of characterised mounts: spreadsheet and JSON; and JSON read back."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from deboom.errors import InputError, naming
from deboom.files.disk import read_json, replace_bytes, replace_text
from deboom.files.tables import workbook_bytes
from deboom.mounts.characterised_mount import CampaignRecord, CharacterisedMount
from deboom.mounts.library_tables import export_tables, from_document, to_document

SHEET_ROWS = 1_048_576
"""Rows that a sheet of an xlsx file may have, its header included."""


def write_library_xlsx(
    path: Path, campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> None:
    """Write mounts as a spreadsheet: one sheet per kind of table, units in the headers, SI.

    Numbers keep 16 digits; JSON keeps them all.

    - `path`: replaced if it is there.
    - `campaigns`: those of the mounts.
    - `mounts`: what to write.
    - raises InputError: more points than a sheet has rows, a folder that cannot be written.
    """
    sheets = export_tables(campaigns, mounts)
    for name, table in sheets.items():
        if len(table) >= SHEET_ROWS:
            raise InputError(
                f"{path}: {name} would have {len(table)} rows and a sheet holds {SHEET_ROWS}: "
                "export fewer mounts, or JSON"
            )
    replace_bytes(path, workbook_bytes(sheets, "Mount library"))


def write_library_json(
    path: Path, campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> None:
    """Write mounts as JSON: complete, and `read_library_json` gives back the same.

    - `path`, `campaigns`, `mounts`: as for `write_library_xlsx`.
    - raises InputError: a folder that cannot be written.
    """
    replace_text(path, library_json(campaigns, mounts))


def library_json(campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]) -> str:
    """Return what `write_library_json` writes."""
    document = to_document(campaigns, mounts)
    return json.dumps(document, ensure_ascii=False, allow_nan=False) + "\n"


def read_library_json(
    path: Path,
) -> tuple[tuple[CampaignRecord, ...], tuple[CharacterisedMount, ...]]:
    """Read what `write_library_json` wrote.

    - raises InputError: the file is missing, no JSON, of another format or version, or lacks an
      entry.
    """
    document = read_json(path, "export it again")
    with naming(path):
        return from_document(document)


def library_parts(path: Path) -> Sequence[CharacterisedMount]:
    """Return all parts of a library: of its file, or of its export as JSON."""
    if path.suffix.lower() == ".json":
        return read_library_json(path)[1]
    from deboom.mounts.library import open_library  # sqlalchemy takes long to import

    with open_library(path) as library:
        return [library.load(identity) for identity in library.identities()]
