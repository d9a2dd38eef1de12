"""A new platform folder to fill in: what is known is written, what is not stays empty."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from deboom.choices import FunctionFiles
from deboom.errors import InputError
from deboom.files.disk import complete_or_not_at_all, replace_bytes, replace_text
from deboom.files.platform import PLATFORM_FILE, MountEntry
from deboom.files.rows import NOISE_TRANSFER, QUANTITY_UNIT
from deboom.files.tables import write_frame
from deboom.mounts.mount import AXES

_TABLE = """\
First sheet (xlsx) or file (CSV): one row per line, the column `frequency [Hz]`, and two columns per
function, `NAME real [unit]` and `NAME imag [unit]`. Other columns are passed over.

| file | NAME | unit | example |
|---|---|---|---|
| noise_transfer | `mount axis` | Pa/N or Pa/kN | `{mount} x real [Pa/N]` |
| operating | `mount piece axis quantity` | m, mm, um or N, kN | `{mount} x force imag [N]` |
"""
_MAT = """\
MATLAB, saved with `save(file, ..., '-v7')`; with `-v7.3`, `pip install 'deboom[hdf5]'`. Variables:

| variable | size | what |
|---|---|---|
| `frequency` | n | lines [Hz] |
| `names` | k, cell array of text | noise_transfer: `{mount} x`; operating: `{mount} x force` |
| `values` | n × k, complex | one column per name |
| `units` | one text, or k | such as `Pa/N`, `mm`, `kN` |
"""
_UFF = """\
UFF data set 58 with a unit label, or with data set 164. Functions are found by node and direction:

| file | type | response | reference | quantity |
|---|---|---|---|---|
| noise_transfer | 4 (FRF) | `ear_node` of platform.toml, scalar | node and direction of the path \
| pressure Pa over force N |
| operating | 0, 12 or 27, complex | node and direction of the channel | none | displacement m, \
force N |

Which node and direction is which channel stands in `channels.xlsx`: change the numbers there to
those of your files. A first ID line `order 1.5 ...` is held against `dominant_order`.
"""


def readme_text(
    name: str,
    group: str,
    transfer: Sequence[tuple[str, str]],
    operating: Sequence[tuple[str, str]],
    files: FunctionFiles,
) -> str:
    """Return ``README.md``.

    - `name`: of the folder.
    - `group`: of the vehicles.
    - `transfer`, `operating`: files of noise transfer functions with their vehicle, and of
      operating spectra with their load case.
    - `files`: their format.
    """
    header_only = files in (FunctionFiles.csv, FunctionFiles.xlsx)
    state = "there, with its columns: add the lines" if header_only else "put it here"
    rows = [
        ("platform.toml", "engine, powertrain, names", "keys marked FILL IN"),
        ("mounts.xlsx", "where each mount sits", "x, y, z of each row"),
        (
            "channels.xlsx",
            "which channel is what, and its unit",
            "unit, and for UFF node and direction",
        ),
        *((file, f"noise transfer functions of {vehicle}", state) for file, vehicle in transfer),
        *((file, f"displacement and force in {case}", state) for file, case in operating),
    ]
    table = [f"| `{file}` | {what} | {todo} |" for file, what, todo in rows]
    formats = {
        FunctionFiles.uff: _UFF,
        FunctionFiles.csv: _TABLE,
        FunctionFiles.xlsx: _TABLE,
        FunctionFiles.mat: _MAT,
    }
    others = {
        FunctionFiles.uff: "a table (CSV, xlsx) or MATLAB file",
        FunctionFiles.csv: "a UFF, xlsx or MATLAB file",
        FunctionFiles.xlsx: "a UFF, CSV or MATLAB file",
        FunctionFiles.mat: "a UFF, CSV or xlsx file",
    }
    return "\n".join(
        [
            f"# {name}",
            "",
            "A platform for deboom: fill in the files below, in this order, and run",
            "",
            f"    deboom check {name}",
            "",
            "It lists everything that is missing or wrong, each with its remedy, until nothing is.",
            "Then:",
            "",
            f"    deboom run studies/u06_robust_front.py --platform {name} --group {group} "
            "--mounts spectra",
            "",
            "| file | what | to do |",
            "|---|---|---|",
            *table,
            "",
            "`channels.xlsx` and `mounts.xlsx`: the first sheet is read; the second one explains",
            "its columns. Rows of an axis that was not measured go out, and the axis out of",
            "`transfer_axes` in `platform.toml`.",
            "",
            "## What must be measured",
            "",
            "- **Operating spectra**: displacement of the powertrain relative to the body, and",
            "  force on the body, at every mount; complex **peak** amplitudes along the dominant",
            "  engine order, phase referred to the tacho, time factor e^(+jwt).",
            "- **Noise transfer functions**: pressure at the driver's ear per force on the body,",
            "  complex. For a mount of several pieces: the same force on all of them in phase, per",
            "  newton of their sum.",
            "- All of them on the **same frequency lines**; studies sum over 20 to 60 Hz.",
            "- Axes: x rearward, y to the right, z up; a force acts on the body.",
            "",
            f"## Format: {files.value}",
            "",
            formats[files].format(mount="TSM"),
            f"A single file may as well be {others[files]}: name it in `platform.toml`;",
            "its ending tells how it is read. deboom's guide `docs/guides/your-own-platform.md`",
            "shows all of them, and the way to the first front.",
        ]
    ) + "\n"  # fmt: skip


MOUNT_TABLE = "mounts.xlsx"
CHANNEL_TABLE = "channels.xlsx"
FIRST_NODE = 101
FIRST_EAR_NODE = 901
"""Proposed node numbers; UFF files of other ones are as good."""

_FORBIDDEN = set('<>:"/\\|?*')
"""No file name may hold them on Windows."""

_MOUNT_HELP = (
    ("mount", "Name, as in platform.toml."),
    ("piece", "Name of the piece; empty for a mount of one piece."),
    ("x [m], y [m], z [m]", "Where its force acts, from the powertrain's centre of gravity: x "
     "rearward, y to the right, z up. [mm] in all three headers is as good."),
)  # fmt: skip
_CHANNEL_HELP = (
    ("channel", "'mount piece axis', such as 'Du left x'; 'mount axis' for a mount of one piece, "
     "and for every noise transfer function."),
    ("quantity", "displacement or force at the mount in operation, or noise transfer function."),
    ("mount, piece, axis", "What the channel's name is made of."),
    ("node", "UFF: response node; of a noise transfer function, reference node. In a table "
     "(CSV, xlsx, mat) any number that no other row of the quantity has."),
    ("direction", "UFF direction of the channel, such as +x. -x turns the sign; in a table, too."),
    ("unit", "Unit in the file: m, mm or um; N or kN; Pa/N or Pa/kN. It must agree with the file."),
)  # fmt: skip


def new_platform(
    folder: Path,
    *,
    mounts: Sequence[str],
    vehicles: Sequence[str],
    group: str,
    load_cases: Sequence[str],
    files: FunctionFiles,
) -> Path:
    """Write the folder of a new platform, to fill in.

    - `folder`: that does not exist; it appears complete or not at all.
    - `mounts`: names; ``name=piece,piece`` for pieces of one part number.
    - `vehicles`: names, all in one group.
    - `group`: its name.
    - `load_cases`: names of the runs; the first one is the default.
    - `files`: format of transfer functions and spectra.
    - returns: the folder.
    - raises InputError: a folder that exists or cannot be written; a name that is empty, has blanks
      or characters that no file name may have, or comes twice; a mount of one named piece.
    """
    if folder.exists():
        raise InputError(f"{folder} is there already: name a new folder, or fill this one in")
    entries = [_mount(text) for text in mounts]
    for what, names in (
        ("mount", [entry.name for entry in entries]),
        ("vehicle", vehicles),
        ("group", [group]),
        ("load case", load_cases),
        *((f"piece of {entry.name}", entry.pieces or ()) for entry in entries),
    ):
        _check_names(what, names)
    table = None if files is FunctionFiles.uff else files
    transfer = [(f"noise_transfer/{name}.{files.value}", name) for name in vehicles]
    operating = [(f"operating/{name}.{files.value}", name) for name in load_cases]
    with complete_or_not_at_all(folder) as unfinished:
        for name in ("noise_transfer", "operating"):
            (unfinished / name).mkdir()
        channels = _channel_rows(entries)
        replace_bytes(unfinished / MOUNT_TABLE, _workbook(_mount_rows(entries), _MOUNT_HELP))
        replace_bytes(unfinished / CHANNEL_TABLE, _workbook(channels, _CHANNEL_HELP))
        if table in (FunctionFiles.csv, FunctionFiles.xlsx):
            for name, _ in transfer:
                _write_header(unfinished / name, channels, transfer=True)
            for name, _ in operating:
                _write_header(unfinished / name, channels, transfer=False)
        text = _platform_text(folder.name, entries, transfer, group, operating, files)
        replace_text(unfinished / PLATFORM_FILE, text)
        readme = readme_text(folder.name, group, transfer, operating, files)
        replace_text(unfinished / "README.md", readme)
    return folder


def _mount(text: str) -> MountEntry:
    name, has_pieces, pieces = text.partition("=")
    names = tuple(pieces.split(",")) if has_pieces else None
    if names is not None and len(names) < 2:
        raise InputError(f"mount '{text}': name two pieces or more, such as {name}=left,right")
    return MountEntry.model_construct(name=name, description="", pieces=names, transfer_axes=AXES)


def _check_names(what: str, names: Sequence[str]) -> None:
    for name in names:
        if not name or any(c.isspace() or not c.isprintable() or c in _FORBIDDEN for c in name):
            raise InputError(
                f"{what} '{name}': a name needs at least one character, no blanks and none of "
                f"{' '.join(sorted(_FORBIDDEN))}"
            )
        # two files of one name where capitals do not count
        if [one.casefold() for one in names].count(name.casefold()) > 1:
            raise InputError(f"two of {what} are named '{name}': keep or rename one")


def _mount_rows(mounts: Sequence[MountEntry]) -> pd.DataFrame:
    rows = [(entry.name, piece) for entry in mounts for piece in entry.piece_names]
    table = pd.DataFrame(rows, columns=["mount", "piece"])
    return table.assign(**{f"{axis} [m]": "" for axis in AXES})


def _channel_rows(mounts: Sequence[MountEntry]) -> pd.DataFrame:
    """One node per piece, and one of its own for the force on all pieces of a mount."""
    rows = []
    node = FIRST_NODE
    for entry in mounts:
        nodes = {piece: node + k for k, piece in enumerate(entry.piece_names)}
        both = node if len(nodes) == 1 else node + len(nodes)
        node = both + 1
        for quantity in ("displacement", "force"):
            for piece in entry.piece_names:
                rows += [(quantity, entry.name, piece, axis, nodes[piece]) for axis in AXES]
        rows += [(NOISE_TRANSFER, entry.name, "", axis, both) for axis in AXES]
    return pd.DataFrame(
        [
            {
                "channel": " ".join(filter(None, (mount, piece, axis))),
                "quantity": quantity,
                "mount": mount,
                "piece": piece,
                "axis": axis,
                "node": node,
                "direction": f"+{axis}",
                "unit": QUANTITY_UNIT[quantity],
            }
            for quantity, mount, piece, axis, node in rows
        ]
    )


def _workbook(table: pd.DataFrame, explained: Sequence[tuple[str, str]]) -> bytes:
    """Return an Excel file: the table first, which is read, then what its columns mean."""
    memory = io.BytesIO()
    with pd.ExcelWriter(memory, engine="openpyxl") as book:
        table.to_excel(book, sheet_name="table", index=False)
        help_sheet = pd.DataFrame(explained, columns=["column", "what goes there"])
        help_sheet.to_excel(book, sheet_name="help", index=False)
        for sheet, widths in (("table", [16] * table.shape[1]), ("help", [24, 110])):
            for column, width in zip("ABCDEFGH", widths, strict=False):
                book.sheets[sheet].column_dimensions[column].width = width
            book.sheets[sheet].freeze_panes = "A2"
    return memory.getvalue()


def _write_header(path: Path, channels: pd.DataFrame, *, transfer: bool) -> None:
    """Write a table of functions with its columns and without a line."""
    header = ["frequency [Hz]"]
    for row in channels[(channels["quantity"] == NOISE_TRANSFER) == transfer].itertuples():
        name = str(row.channel) if transfer else f"{row.channel} {row.quantity}"
        header += [f"{name} {part} [{row.unit}]" for part in ("real", "imag")]
    table = pd.DataFrame(columns=header)
    if path.suffix == ".csv":
        write_frame(path, table)
    else:
        memory = io.BytesIO()
        table.to_excel(memory, index=False)
        replace_bytes(path, memory.getvalue())


def _platform_text(
    name: str,
    mounts: Sequence[MountEntry],
    transfer: Sequence[tuple[str, str]],
    group: str,
    operating: Sequence[tuple[str, str]],
    files: FunctionFiles,
) -> str:
    key = "".join("_" if c.isspace() else c for c in name)
    lines = [
        "# A platform: engine, mounts, vehicles and runs. Lines that begin with # are not read:",
        "# fill in what stands behind '# FILL IN', and take the # in front of the key away.",
        "# `deboom check FOLDER` lists everything that is still missing or wrong.",
        "",
        "format = 1  # of this file; leave it",
        f"name = {_quoted(key)}  # short key, without blanks",
        f"title = {_quoted(name)}  # what a reader calls it",
        'description = ""  # a paragraph for the report',
        f'mount_table = "{MOUNT_TABLE}"  # where the mounts sit; CSV or xlsx',
        f'channel_table = "{CHANNEL_TABLE}"  # which channel is what; CSV or xlsx',
        f"default_load_case = {_quoted(operating[0][1])}  # taken when a study is asked for none",
        "",
        "[engine]",
        "# cylinders = 3  # FILL IN: number of cylinders",
        "# dominant_order = 1.5  # FILL IN: engine order of the spectra, half the cylinders of a "
        "four-stroke",
        "# total_ratios = [16.2, 9.6, 6.2]  # FILL IN: engine speed over wheel speed, gear 1 first",
        "",
        "[powertrain]  # with all that moves on its mounts; from the data sheet",
        "# mass_kg = 190.0  # FILL IN",
        "# mass_tolerance_kg = 2.0  # FILL IN: half width; 0.0 if weighed",
        "# inertia_kg_m2 = [[11.0, 0.0, 0.0], [0.0, 7.0, 0.0], [0.0, 0.0, 10.0]]  # FILL IN: about",
        "#     the centre of gravity, in vehicle axes; entries of the matrix (products of inertia",
        "#     are its negative off-diagonal entries)",
        "# inertia_tolerance = 0.02  # FILL IN: half width relative to the diagonal",
        "# centre_of_gravity_tolerance_m = 0.002  # FILL IN: half width per axis",
        "",
        "# One [[mounts]] per mount, in the order of the design variables; all three axes of each",
        "# are variables.",
    ]
    for entry in mounts:
        lines += ["", "[[mounts]]", f"name = {_quoted(entry.name)}"]
        lines += ['description = ""  # in words, for the report']
        if entry.pieces:
            lines += [f"pieces = [{', '.join(map(_quoted, entry.pieces))}]"]
        lines += [
            'transfer_axes = ["x", "y", "z"]  # whose force reaches the cabin; an axis that was '
            "not measured",
            f"#     goes out, and its rows in {CHANNEL_TABLE}",
            "# body_mass_kg = 40.0  # only where each piece carries another body than the "
            "powertrain,",
            "# body_mass_tolerance_kg = 1.0  #     such as the wheel end on a wishbone mount",
        ]
    lines += ["", "# One [[vehicles]] per vehicle. A study serves the vehicles of one --group."]
    for node, (file, vehicle) in enumerate(transfer, FIRST_EAR_NODE):
        lines += ["", "[[vehicles]]", f"name = {_quoted(vehicle)}", f"group = {_quoted(group)}"]
        lines += [f"noise_transfer = {_quoted(file)}  # UFF, CSV, xlsx or mat: see README.md"]
        if files is FunctionFiles.uff:
            lines += [f"ear_node = {node}  # response node of the driver's ear in this file"]
    lines += ["", "# One [[load_cases]] per run: spectra along the dominant order."]
    for file, case in operating:
        lines += [
            "",
            "[[load_cases]]",
            f"name = {_quoted(case)}",
            f"title = {_quoted(case)}  # what a reader calls it, such as 5th gear, full load",
            "# gear = 3  # FILL IN: picks the ratio above",
            "# torque_limit_nm = 220.0  # FILL IN: of the engine in this run",
            f"operating = {_quoted(file)}  # UFF, CSV, xlsx or mat: see README.md",
            f'# torque_table = "operating/{case}_torque.csv"  # optional: frequency [Hz],engine '
            "torque [N m];",
            "#     needed to take the mounts from a library (--mounts library)",
        ]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    # JSON's strings are TOML's, too
    return json.dumps(text, ensure_ascii=False)
