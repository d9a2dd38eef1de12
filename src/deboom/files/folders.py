"""Folders of measurements by kind: a new one to fill in, and what is wrong with one or in it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from deboom.arrays import AXES
from deboom.errors import InputError
from deboom.files.campaign import CAMPAIGN
from deboom.files.component_test import COMPONENT
from deboom.files.disk import complete_or_not_at_all, replace_bytes, replace_text
from deboom.files.electric_car import CAR
from deboom.files.hammer_test import HAMMER
from deboom.files.inertance_test import COMPRESSOR
from deboom.files.kinds import FolderKind, FunctionFiles
from deboom.files.operating_test import OPERATION
from deboom.files.platform import PLATFORM, MountEntry
from deboom.files.rows import NOISE_TRANSFER, QUANTITY_UNIT
from deboom.files.schema import FolderRecord, doubled, refuse_all
from deboom.files.tables import workbook_bytes, write_frame
from deboom.files.vehicle import VEHICLE
from deboom.names import look_alikes, name_fault

FOLDERS: Mapping[FolderKind, FolderRecord] = {
    record.kind: record
    for record in (
        PLATFORM,
        CAMPAIGN,
        VEHICLE,
        CAR,
        OPERATION,
        COMPRESSOR,
        COMPONENT,
        HAMMER,
    )
}
"""Kinds of folders; a car has the file of a running compressor, too, so it comes first."""


def kind_of_folder(folder: Path) -> FolderKind:
    """Return the kind of a folder by the file that it holds.

    - raises InputError: it holds none of them.
    """
    for kind, record in FOLDERS.items():
        if (folder / record.file).exists():
            return kind
    if not folder.is_dir():
        raise InputError(
            f"{folder}: there is no such folder: `deboom new KIND {folder}` writes one"
        )
    files = ", ".join(record.file for record in FOLDERS.values())
    raise InputError(f"{folder} holds none of {files}: name the folder of one of them")


def refuse_other_kind(folder: Path, kind: FolderKind) -> None:
    """Raise InputError for a folder of another kind, and name the command that takes it.

    A folder that is missing, or of no kind, is left to whoever reads it.
    """
    present = [record for record in FOLDERS.values() if (folder / record.file).exists()]
    if present and FOLDERS[kind] not in present:
        first = present[0]
        raise InputError(
            f"{folder} holds {first.file}, not {FOLDERS[kind].file}: "
            f"`{first.command.format(folder.as_posix())}` takes it"
        )


def first_steps(folder: Path, kind: FolderKind) -> tuple[str, ...]:
    """Return what to do with a new folder, line by line: fill in, check, go on, read."""
    record, where = FOLDERS[kind], folder.as_posix()
    return (
        f"fill in first: {where}/{record.file}, the lines with FILL IN; {where}/README.md has the "
        "order",
        f"then: deboom check {where}, which names what is missing, and "
        f"{record.command.format(where)}",
        f"guide: {record.guide}, in the documentation",
    )


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
    ("unit", "Unit in the file: m, mm or um; N or kN; Pa/N or Pa/kN. It must agree with the file; "
     "empty, each file's own counts."),
)  # fmt: skip


@dataclass(frozen=True)
class Names:
    """Names of what a new folder is for.

    - `mounts`: of platform, campaign and vehicle; ``name=piece,piece`` for pieces of one part
      number.
    - `vehicles`: of a platform, all in one group.
    - `group`: its name.
    - `load_cases`: runs of a platform; the first one is the default.
    - `files`: format of a platform's transfer functions and spectra.
    """

    mounts: Sequence[str] = ("engine", "gearbox", "strut")
    vehicles: Sequence[str] = ("car-1",)
    group: str = "cars"
    load_cases: Sequence[str] = ("run-1",)
    files: FunctionFiles = FunctionFiles.uff


TEMPLATES = Path(__file__).parent / "templates"
"""Files of a new folder by kind, as jinja templates."""


def new_folder(folder: Path, kind: FolderKind, names: Names = Names()) -> Path:
    """Write a folder of a kind, to fill in: commented TOML, tables with columns, a README.

    - `folder`: that does not exist; it appears complete or not at all.
    - `kind`, `names`: what it is for.
    - returns: the folder.
    - raises InputError: a folder that exists or cannot be written; a name that is empty, has blanks
      or characters that no file name may have, or comes twice; a mount of one named piece.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    if folder.exists():
        raise InputError(f"{folder} is there already: name a new folder, or fill this one in")
    entries = [_mount(text) for text in names.mounts]
    for what, given in (
        ("mount", [entry.name for entry in entries]),
        ("vehicle", names.vehicles),
        ("group", [names.group]),
        ("load case", names.load_cases),
        *((f"piece of {entry.name}", entry.pieces or ()) for entry in entries),
    ):
        _check_names(what, given)
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=False,
        keep_trailing_newline=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    # JSON's strings are TOML's, too
    environment.filters["quoted"] = lambda text: json.dumps(text, ensure_ascii=False)
    words = {
        "kind": kind.value,
        "file": FOLDERS[kind].file,
        "name": folder.name,
        "key": "".join("_" if c.isspace() else c for c in folder.name),
        "mounts": entries,
        "places": [(entry.name, piece) for entry in entries for piece in entry.piece_names],
        "vehicles": names.vehicles,
        "group": names.group,
        "load_cases": names.load_cases,
        "ending": names.files.value,
    }
    sources = {Path("README.md"): "README.md"}
    for inside, part in (*FOLDERS[kind].parts.items(), (".", kind)):
        for path in sorted((TEMPLATES / part.value).rglob("*.*")):
            place = Path(inside) / path.relative_to(TEMPLATES / part.value)
            sources[place] = path.relative_to(TEMPLATES).as_posix()
    with complete_or_not_at_all(folder) as unfinished:
        for name, source in sources.items():
            (unfinished / name).parent.mkdir(parents=True, exist_ok=True)
            text = environment.get_template(source).render(words)
            replace_text(unfinished / name, text)
        if kind is FolderKind.platform:
            _write_platform_tables(unfinished, entries, names)
    return folder


def _write_platform_tables(folder: Path, entries: Sequence[MountEntry], names: Names) -> None:
    """Write its workbooks, and the headers of functions that are tables."""
    channels = _channel_rows(entries)
    for name, table, explained in (
        ("mounts", _mount_rows(entries), _MOUNT_HELP),
        ("channels", channels, _CHANNEL_HELP),
    ):
        explained_table = pd.DataFrame(explained, columns=["column", "what goes there"])
        # the first sheet is read
        sheets = {"table": table, "help": explained_table}
        replace_bytes(folder / f"{name}.xlsx", workbook_bytes(sheets, name))
    for inside, files in (("noise_transfer", names.vehicles), ("operating", names.load_cases)):
        (folder / inside).mkdir()
        for name in files if names.files in (FunctionFiles.csv, FunctionFiles.xlsx) else ():
            path = folder / inside / f"{name}.{names.files.value}"
            _write_header(path, channels, transfer=inside == "noise_transfer")


def _mount(text: str) -> MountEntry:
    name, has_pieces, pieces = text.partition("=")
    names = tuple(pieces.split(",")) if has_pieces else None
    if names is not None and len(names) < 2:
        raise InputError(f"mount '{text}': name two pieces or more, such as {name}=left,right")
    return MountEntry.model_construct(name=name, description="", pieces=names, transfer_axes=AXES)


def _check_names(what: str, names: Sequence[str]) -> None:
    for name in names:
        if fault := name_fault(name):
            raise InputError(f"{what} '{name}': {fault}")
    refuse_all((*doubled(f"of {what} are named", names), *look_alikes(what, names)))


def _mount_rows(mounts: Sequence[MountEntry]) -> pd.DataFrame:
    rows = [(entry.name, piece) for entry in mounts for piece in entry.piece_names]
    table = pd.DataFrame(rows, columns=["mount", "piece"])
    return table.assign(**{f"{axis} [m]": "" for axis in AXES})


def _channel_rows(mounts: Sequence[MountEntry]) -> pd.DataFrame:
    """One node per piece, and one of its own for the force on all pieces of a mount."""
    rows = []
    node = 101  # a proposal; UFF files of other ones are as good
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
        replace_bytes(path, workbook_bytes({"table": table}, path.stem))
