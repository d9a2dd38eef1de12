"""Files made of characterised mounts: spreadsheet, UFF spectra, JSON; and JSON read back."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.files.disk import read_json, replace_bytes, replace_text
from deboom.files.tables import workbook_bytes
from deboom.files.uff import UffFunction, write_uff
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
    document = to_document(campaigns, mounts)
    replace_text(path, json.dumps(document, ensure_ascii=False, allow_nan=False) + "\n")


def read_library_json(
    path: Path,
) -> tuple[tuple[CampaignRecord, ...], tuple[CharacterisedMount, ...]]:
    """Read what `write_library_json` wrote.

    - raises InputError: the file is missing, no JSON, of another format or version, or lacks an
      entry.
    """
    document = read_json(path, "export it again")
    try:
        return from_document(document)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def write_library_uff(path: Path, mounts: Sequence[CharacterisedMount]) -> tuple[str, ...]:
    """Write the map points of mounts as spectra: UFF data sets 58, one node per mount.

    Per run and direction: the dynamic stiffness [N/m] as a frequency response (force per
    displacement), preload [N] and amplitude [m] as general functions, and the confidence [1] as a
    coherence, all over frequency. Surfaces and static curves are no spectra: xlsx and JSON hold
    them.

    - `path`: replaced if it is there.
    - `mounts`: nodes count from 1 in this order.
    - returns: runs left out because they have a single line, which UFF cannot hold: ``<mount> …
      <run>``.
    - raises InputError: no spectrum at all, a frequency twice in one run, a label that does not fit
      its field.
    """
    functions: list[UffFunction] = []
    left_out = []
    for node, value in enumerate(mounts, 1):
        for axis, run, lines in _runs(value):
            if lines.size < 2:
                left_out.append(f"{value.identity}, direction {axis}, run {run}")
            else:
                functions += _spectra(node, value, axis, run, lines)
    if not functions:
        raise InputError(f"{path}: the mounts have no spectra; export xlsx or JSON")
    write_uff(path, functions)
    return tuple(left_out)


def _runs(value: CharacterisedMount) -> Iterator[tuple[str, str, npt.NDArray[np.intp]]]:
    for direction in value.directions:
        points = direction.map_points
        for run in dict.fromkeys(points.run.tolist()):
            lines = np.flatnonzero(points.run == run)
            yield direction.axis, run, lines[np.argsort(points.frequency[lines], kind="stable")]


def _spectra(
    node: int, value: CharacterisedMount, axis: str, run: str, lines: npt.NDArray[np.intp]
) -> list[UffFunction]:
    identity, points = value.identity, value.direction(axis).map_points
    labels = (
        _ascii(f"run {run}"),
        _ascii(f"campaign {identity.campaign}, variant {identity.variant}"),
        _ascii(f"part number {identity.part_number or '-'}, serial {identity.serial or '-'}"),
        _ascii(f"supplier {identity.supplier or '-'}"),
    )

    def function(
        quantity: str, values: Any, kind: int, ordinate: str, unit: str, per: tuple[str, str]
    ) -> UffFunction:
        related = per[0] != "none"
        return UffFunction(
            abscissa=points.frequency[lines],
            values=values[lines],
            function_type=kind,
            response_node=node,
            response_direction=f"+{axis}",
            reference_node=node if related else 0,
            reference_direction=f"+{axis}" if related else "scalar",
            ordinate=ordinate,
            ordinate_unit=unit,
            denominator=per[0],
            denominator_unit=per[1],
            id_lines=(_ascii(f"{identity.mount} {axis} {quantity}"), *labels),
            response_name=_ascii(identity.mount)[:10].strip(),
        )

    alone = ("none", "")
    stiffness = points.dynamic_stiffness
    return [
        function("dynamic stiffness", stiffness, 4, "force", "N", ("displacement", "m")),
        function("preload", points.preload, 0, "force", "N", alone),
        function("amplitude", points.amplitude, 0, "displacement", "m", alone),
        function("confidence", points.confidence, 6, "general", "1", alone),
    ]


def _ascii(text: str) -> str:
    return text.encode("ascii", "backslashreplace").decode("ascii")
