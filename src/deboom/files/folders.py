"""Folders of measurements by kind: a new one to fill in, and what is wrong with one or in it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from deboom.choices import FolderKind, FunctionFiles
from deboom.common import AXES
from deboom.compressor.identify import hammer_test_doubts
from deboom.errors import InputError, naming
from deboom.files.campaign import CAMPAIGN_FILE, CampaignFile, read_campaign
from deboom.files.component_test import (
    COMPONENT_FILE,
    RECEIVER_FILE,
    ComponentTestFile,
    read_component_test,
    read_receiver,
)
from deboom.files.disk import complete_or_not_at_all, replace_bytes, replace_text
from deboom.files.electric_car import ELECTRIC_CAR_FILE, ElectricCarFile, read_electric_car
from deboom.files.hammer_test import HAMMER_TEST_FILE, HammerTestFile, read_hammer_test
from deboom.files.inertance_test import INERTANCE_TEST_FILE, InertanceTestFile, read_inertance_test
from deboom.files.operating_test import OPERATING_TEST_FILE, OperatingTestFile, read_operating_test
from deboom.files.platform import MountEntry, PlatformFile
from deboom.files.rows import NOISE_TRANSFER, QUANTITY_UNIT
from deboom.files.schema import StrictModel, doubled, refuse_all
from deboom.files.tables import workbook_bytes, write_frame
from deboom.files.vehicle import VEHICLE_FILE, VehicleFile, read_vehicle
from deboom.measurement.component_findings import component_findings
from deboom.measurement.compressor_test import OperatingTest
from deboom.measurement.driving_points import fault_of_hammer_test
from deboom.measurement.electric_car import refuse_contradictions_of_car
from deboom.measurement.impact_test import HammerOptions, hammer_frfs
from deboom.names import look_alikes, name_fault
from deboom.vehicles.platform import PLATFORM_FILE

FILES: Mapping[FolderKind, tuple[str, type[StrictModel]]] = {
    FolderKind.platform: (PLATFORM_FILE, PlatformFile),
    FolderKind.campaign: (CAMPAIGN_FILE, CampaignFile),
    FolderKind.vehicle: (VEHICLE_FILE, VehicleFile),
    FolderKind.car: (ELECTRIC_CAR_FILE, ElectricCarFile),
    FolderKind.operation: (OPERATING_TEST_FILE, OperatingTestFile),
    FolderKind.compressor: (INERTANCE_TEST_FILE, InertanceTestFile),
    FolderKind.component: (COMPONENT_FILE, ComponentTestFile),
    FolderKind.hammer: (HAMMER_TEST_FILE, HammerTestFile),
}
"""Kind of folder → the file that makes it one, and its keys; a car has ``operation.toml``, too."""
NEXT: Mapping[FolderKind, tuple[str, str]] = {
    FolderKind.platform: ("deboom run front {}", "your-own-platform"),
    FolderKind.campaign: ("deboom characterise {} --library mounts.db", "your-own-data"),
    FolderKind.vehicle: ("deboom run synthesis_validation --vehicle {}", "your-own-data"),
    FolderKind.car: ("deboom run compressor_noise --car {}", "your-own-data"),
    FolderKind.operation: ("deboom unbalance {}", "your-own-data"),
    FolderKind.compressor: ("deboom identify {}", "your-own-data"),
    FolderKind.component: ("deboom run component_tpa --test {}", "component-tpa"),
    FolderKind.hammer: ("deboom look {}", "your-own-data"),
}
"""Kind of folder → the command that takes it, and the guide that explains it."""
CHECKED_LINES = 200.0
"""Last line of the functions that the check of a hammer test makes of its hits [Hz]."""


def kind_of_folder(folder: Path) -> FolderKind:
    """Return the kind of a folder by the file that it holds.

    - raises InputError: it holds none of them.
    """
    for kind, (file, _) in FILES.items():
        if (folder / file).exists():
            return kind
    if not folder.is_dir():
        raise InputError(
            f"{folder}: there is no such folder: `deboom new KIND {folder}` writes one"
        )
    files = ", ".join(file for file, _ in FILES.values())
    raise InputError(f"{folder} holds none of {files}: name the folder of one of them")


def refuse_other_kind(folder: Path, kind: FolderKind) -> None:
    """Raise InputError for a folder of another kind, and name the command that takes it.

    A folder that is missing, or of no kind, is left to whoever reads it.
    """
    held = [other for other, (file, _) in FILES.items() if (folder / file).exists()]
    if held and kind not in held:
        command, _ = NEXT[held[0]]
        raise InputError(
            f"{folder} holds {FILES[held[0]][0]}, not {FILES[kind][0]}: "
            f"`{command.format(folder.as_posix())}` takes it"
        )


def first_steps(folder: Path, kind: FolderKind) -> tuple[str, ...]:
    """Return what to do with a new folder, line by line: fill in, check, go on, read."""
    (file, _), (command, guide) = FILES[kind], NEXT[kind]
    where = folder.as_posix()
    return (
        f"fill in first: {where}/{file}, the lines with FILL IN; {where}/README.md has the order",
        f"then: deboom check {where}, which names what is missing, and {command.format(where)}",
        f"guide: docs/guides/{guide}.md",
    )


def summary_of(folder: Path, kind: FolderKind) -> list[tuple[str, str]]:
    """Read a folder of any kind but a platform, and say what it holds.

    - returns: name and text of each line.
    - raises InputError: something is missing or wrong.
    """
    return list(_HELD[kind](folder))


def _campaign(folder: Path) -> Iterator[tuple[str, str]]:
    held = read_campaign(folder)
    lines = held.runs[0].acceleration.frequency
    yield "campaign", held.name
    yield "mounts", ", ".join(mount.name for mount in held.mounts)
    yield "sensors", f"{len(held.sensors)}, switched off: {', '.join(held.switched_off) or 'none'}"
    yield "runs", f"{len(held.runs)} of mount sets {', '.join(held.mount_sets)}"
    yield "lines", f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz of order {held.order:g}"
    yield "shaker", f"{len(held.shaker_runs)} runs"
    yield "curves", f"{len(held.static_curves)} of suppliers"
    yield from _assumed(held.assumed)


def _vehicle(folder: Path) -> Iterator[tuple[str, str]]:
    held = read_vehicle(folder)
    lines = held.direct.frequency
    yield "vehicle", f"{held.name} in group {held.group}"
    yield "ears", ", ".join(held.ears)
    yield "mounts", ", ".join(mount.name for mount in held.mounts)
    yield "blows", f"{len(held.direct.inputs)} beside {len(held.impacts)} virtual points"
    yield "lines", f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz"
    yield "runs", ", ".join(run.name for run in held.runs) or "none"


def _compressor(folder: Path) -> Iterator[tuple[str, str]]:
    held = read_inertance_test(folder)
    with naming(folder):
        doubts = hammer_test_doubts(held)
    lines = held.frf.frequency
    weighed = "not weighed" if held.weighed_mass is None else f"weighed {held.weighed_mass:g} kg"
    yield "test", f"{held.name}, {weighed}"
    yield "sensors", f"{len(held.sensors)} triaxial, {len(held.impacts)} impacts"
    if rate := held.frf.added_decay_rate:
        yield (
            "window",
            f"decay of {rate:g} 1/s: for a free body only, identify refuses it on mounts",
        )
    yield "lines", f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz"
    yield from _warned(doubts)
    yield from _assumed(held.assumed)


def _operation(folder: Path) -> Iterator[tuple[str, str]]:
    held = read_operating_test(folder)
    yield from _running(folder, held)
    yield from _assumed(held.hammer.assumed)


def _running(folder: Path, held: OperatingTest) -> Iterator[tuple[str, str]]:
    yield "test", held.name
    with naming(folder):
        for hammer in filter(None, (held.hammer, held.hammer_with_hoses)):
            yield from _warned(f"{hammer.name}: {doubt}" for doubt in hammer_test_doubts(hammer))
    for sweep in held.sweeps:
        lines = sweep.acceleration.frequency
        yield "sweep", f"{sweep.name}: {60 * lines[0]:.0f} to {60 * lines[-1]:.0f} rpm"
    yield "hoses", ", ".join(hose.name for hose in held.hoses) or "no drawing"


def _car(folder: Path) -> Iterator[tuple[str, str]]:
    held = read_electric_car(folder)
    with naming(folder):
        refuse_contradictions_of_car(held)
    yield "car", f"{held.name}, {held.ear}"
    yield "points", ", ".join(f"{point.name} ({point.kind.value})" for point in held.points)
    yield from _running(folder, held.operation)
    yield from _assumed(held.assumed)


def _component(folder: Path) -> Iterator[tuple[str, str]]:
    held = read_component_test(folder)
    others = sorted(folder.glob(f"*/{RECEIVER_FILE}"))
    receivers = [read_receiver(path.parent) for path in others]
    lines = held.accelerance.frequency
    yield "test", held.name
    points = (f"{point.name} ({len(point.motions)} degrees of freedom)" for point in held.points)
    yield "points", ", ".join(points)
    yield (
        "channels",
        f"{len(held.indicator_channels)} indicators, {len(held.on_board_channels)} left out",
    )
    yield "ears", ", ".join(held.ears)
    yield "hits on the source", f"{len(held.source_hits)}"
    yield "free source", "measured" if held.free is not None else "not measured"
    yield "lines", f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz"
    yield "runs", ", ".join(run.name for run in held.runs)
    for receiver in receivers:
        yield "receiver", receiver.name
    doubts = [s for each in receivers or (None,) for s in component_findings(held, each)]
    yield from _warned(dict.fromkeys(doubts))
    yield from _assumed(held.assumed)


def _warned(sentences: Iterable[str]) -> Iterator[tuple[str, str]]:
    for sentence in sentences:
        yield "WARNING", sentence


def _assumed(sentences: Sequence[str]) -> Iterator[tuple[str, str]]:
    for sentence in sentences:
        yield "ASSUMED", sentence


def _hammer(folder: Path) -> Iterator[tuple[str, str]]:
    held = read_hammer_test(folder)
    first = held.measurements[0]
    # lines of a car; beyond them a push may have zeros
    options = HammerOptions(band=(0.0, CHECKED_LINES), minimum_hits=1)
    with naming(folder):
        estimate = hammer_frfs(held, options)
    if fault := fault_of_hammer_test(held, estimate):
        raise InputError(f"{folder}: {fault}")
    yield "test", held.title
    yield "impacts", f"{len(held.impacts)}, {sum(len(m.force) for m in held.measurements)} hits"
    yield "channels", f"{len(first.channels)}, {first.rate:g} samples per second"


_HELD: Mapping[FolderKind, Callable[[Path], Iterator[tuple[str, str]]]] = {
    FolderKind.campaign: _campaign,
    FolderKind.vehicle: _vehicle,
    FolderKind.car: _car,
    FolderKind.operation: _operation,
    FolderKind.compressor: _compressor,
    FolderKind.component: _component,
    FolderKind.hammer: _hammer,
}


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
_PARTS = {
    FolderKind.operation: {"hammer": FolderKind.compressor},
    FolderKind.car: {".": FolderKind.operation, "hammer": FolderKind.compressor},
}
"""Kind → folders inside it, and the kind of what they hold."""


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
        "file": FILES[kind][0],
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
    for inside, part in (*_PARTS.get(kind, {}).items(), (".", kind)):
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
