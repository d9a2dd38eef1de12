"""Break every kind of input that deboom reads, and see that it answers with a sentence.

``python benchmarks/fuzz.py --seconds 600`` (``make fuzz``). Each case is a small valid folder with
one or two things broken, read in a process of its own with 60 s of processor and 2 GB. Cases of the
kind ``valid files`` are 25 files of other programs instead, with features of their formats drawn by
chance and nothing broken. A case ends as

- sentence: refused with an `InputError`; accepted: read without complaint;
- traceback, hang, crash, half-written: a fault of deboom, printed with the seed that repeats it.
"""

from __future__ import annotations

import argparse
import atexit
import contextlib
import importlib
import io
import itertools
import json
import os
import pkgutil
import random
import re
import resource
import shutil
import signal
import sqlite3
import sys
import tempfile
import time
import traceback
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import openpyxl
import pandas as pd

import deboom
from deboom.errors import InputError

LARGEST_MEMORY, LONGEST, LONGEST_SENTENCE = 2 * 2**30, 60.0, 2000
LONGEST_WAIT = 10 * LONGEST  # by the clock: other work on the machine is no fault of a reader
FAULTS = ("traceback", "hang", "crash", "half-written")
DRAWN, DRAWN_FILES = "valid files", 25
"""Kind whose files are drawn anew for every case, and how many there are in one."""
NAMES = ("", " ", "$x$", "<b>", '"', "'", ";", "../..", "a\0b", "=1+1", "ü", "x" * 100_000, "nan")
PATHS = (
    "../../../../X",
    "..",
    "a/b",
    "/tmp/X",
    "a\\\\b",
    "C:X",
    "CON",
    "nul.uff",
    ".a",
    "a.",
    "NA",
    "=1+1",
    "u06",
    "\\u0410",
    "a\\u200bb",
    "Du\\u0308",
    "x" * 61,
    "U06-l",
    "$x$",
)
"""Names that would be another file, another name or nothing on some system."""
NUMBERS = ("0", "-1", "1e308", "1e-308", "1e999", "nan", "inf", "-0", "1_0", "１", "9" * 5000)
VALUES = (None, True, -1, 1e308, 2**70, "", "x", [], {}, [[[[]]]], {"a": {}}, "9" * 99_999)


DATA = Path(__file__).parents[1] / "studies" / "data"
TEST_DATA = Path(__file__).parents[1] / "tests" / "data"
sys.path += [str(Path(__file__).parents[1] / "tests" / name) for name in ("", "unit", "studies")]
"""Valid files of some kinds come from the tests."""


def reader(name: str, file: str = "", *more: object) -> Callable[[Path], object]:
    """Return a function of deboom, such as ``files.campaign:read_campaign``, of a file."""
    module, function = name.split(":")
    module = f"deboom.{module}"
    return lambda path: getattr(importlib.import_module(module), function)(path / file, *more)


def shipped(name: str) -> Callable[[Path], None]:
    """Return what makes a folder with a copy of one of the shipped files."""

    def build(folder: Path) -> None:
        folder.mkdir()
        shutil.copy(DATA / name, folder)

    return build


def of_tests(name: str, file: str, form: Callable[[Any], str] = str) -> Callable[[Path], None]:
    """Return what makes a folder with a file whose content a module of tests holds."""
    module, content = name.split(":")

    def build(folder: Path) -> None:
        folder.mkdir()
        (folder / file).write_text(form(getattr(importlib.import_module(module), content)))

    return build


def command(*words: str) -> Callable[[Path], object]:
    """Return a command; the folder of the case stands for ``@``."""

    def call(folder: Path) -> None:
        from deboom.cli import app

        arguments = [word.replace("@", str(folder)) for word in words]
        raise SystemExit(app(arguments, standalone_mode=False))

    return call


def _platform(folder: Path) -> None:
    from foreign_platform_samples import write_foreign_platform

    write_foreign_platform(folder)


def _platform_uff(folder: Path) -> None:
    from test_cli_platform import filled, made

    filled(made(folder))


def _campaign(folder: Path) -> None:
    import numpy as np

    from deboom.bench.campaign import CampaignPlan, TimeRunPlan
    from deboom.bench.campaign_writer import write_campaign
    from deboom.bench.operating_run import PlannedRun

    time_run = TimeRunPlan(last_speed=1700.0, duration=2.0, sample_rate=2048.0)
    runs = (PlannedRun(5, 220.0, full_load=True),)
    plan = CampaignPlan(("M1",), runs, 1, frequency=np.arange(30.0, 41.0), time_run=time_run)
    write_campaign(folder, 1, plan)


def _written(function: str, *arguments: object, **keywords: object) -> Callable[[Path], None]:
    def build(folder: Path) -> None:
        module, name = function.split(":")
        getattr(importlib.import_module(f"deboom.bench.{module}"), name)(
            folder, *arguments, **keywords
        )
        shutil.rmtree(folder / "truth", ignore_errors=True)

    return build


def _hits(folder: Path) -> None:
    from deboom.bench.choices import CalibrationLevel
    from deboom.bench.compressor_truth import CompressorPlan
    from deboom.bench.compressor_writer import write_compressor_test

    whole = folder.with_name("whole_compressor")
    write_compressor_test(whole, 1, CalibrationLevel.C2, CompressorPlan(hits=True))
    shutil.copytree(whole / "hits", folder)
    lines = (folder / "impacts.csv").read_text().splitlines(keepends=True)
    (folder / "impacts.csv").write_text("".join(lines[:2]))


def _results(folder: Path) -> None:
    from deboom.files.run_folder import finish_run, start_run

    record = {"study": "s", "question": "q?", "arguments": {"seed": 1}, "seed": 1, "command": "c"}
    run = start_run(folder, "s", seed=1, record=record)
    run.save_json("summary.json", {"a": 1.0})
    run.save_text("front.csv", "a [1],b\n1,2\n")
    finish_run(run)


def _library(folder: Path) -> None:
    from deboom.files.library_export import read_library_json, write_library_json
    from deboom.mounts.library import open_library

    campaigns, mounts = read_library_json(DATA / "u06_f39_f45" / "mounts.library.json")
    folder.mkdir()
    names = {mounts[0].identity.campaign}
    campaigns = tuple(record for record in campaigns if record.name in names)
    write_library_json(folder / "a.json", campaigns, mounts[:1])
    with open_library(str(folder / "a.db"), create=True) as library:
        library.add(campaigns, mounts[:1])


def _time_data(folder: Path) -> None:
    from test_files_time_data import SIGNALS, TIME, WRITERS

    for number, (write, name, _) in enumerate(WRITERS.values()):
        # each in a folder of its own: a WAV file has a table of the same name as a CSV
        (folder / str(number)).mkdir(parents=True)
        write(folder / str(number) / name, SIGNALS, TIME)


def _read_search(folder: Path) -> None:
    from deboom.files.run_folder import CheckpointFolder

    store = CheckpointFolder(folder, {"a.toml": "0"})
    store.load()
    for generation in (1, 2):
        store.kept(generation)


def _read_time_data(folder: Path) -> None:
    from deboom.files.time_data import read_time_signals

    for inside in sorted(folder.iterdir()):
        for path in sorted(inside.glob("run.*")):
            if path.suffix != ".csv" or not path.with_suffix(".wav").exists():
                read_time_signals(path, ["A1 x", "TSM z", "driver ear"])


def _other_programs(folder: Path) -> None:
    from test_files_pyfbs_sheets import published_sheets, workbook
    from test_files_sdynpy_npz import delivered

    folder.mkdir()
    for name in ("two_masses_sort1.pch", "two_masses_sort1.csv"):
        shutil.copy(TEST_DATA / "nastran-punch" / name, folder)
    for name in ("TestLab_161_164_18_15_82.uff", "uff55_translation_rotation.uff"):
        shutil.copy(TEST_DATA / "pyuff-vendor-files" / name, folder)
    delivered(folder)
    workbook(folder / "pyfbs.xlsx", published_sheets())


def _read_other_programs(folder: Path) -> None:
    from deboom.files.function_table import read_nodal
    from deboom.files.inertance_test import read_placed
    from deboom.files.rows import PlacedSensor
    from deboom.files.uff_geometry import read_uff_geometry
    from deboom.files.uff_modes import read_uff_modes

    for path in sorted(folder.iterdir()):
        if path.suffix in (".pch", ".npz"):
            read_nodal(path)
        elif path.name.startswith("TestLab"):
            read_uff_geometry(path)
        elif path.suffix == ".uff":
            read_uff_modes(path)
        elif path.suffix == ".xlsx":
            read_placed(path, PlacedSensor)


def _delivery(folder: Path) -> None:
    from test_accept import box_of, table_of

    from deboom.files.acceptance import write_solution_box

    folder.mkdir()
    write_solution_box(folder / "box.json", box_of())
    table_of(folder, [0.85, 0.9, 0.95])


def _designs(folder: Path) -> None:
    folder.mkdir()
    table = pd.DataFrame({"EnM x [1]": [0.9, 1.1], "mass [kg]": [3.0, 4.0]})
    table.to_excel(folder / "a.xlsx", index=False)
    saved = {"variables": ["mass", "EnM x"], "design": [3.0, 0.9]}
    saved |= {"pinned": [{"name": "P1", "design": [4.0, 1.1]}]}
    (folder / "saved.json").write_text(json.dumps(saved))


def _read_designs(folder: Path) -> None:
    from deboom.files.doe_table import read_designs, read_plan

    for path in (folder / "a.xlsx", folder / "saved.json"):
        read_plan(path, SPACE)
    read_designs(folder / "a.xlsx", ["mass"])


def _rig(folder: Path) -> None:
    from test_files_mount_rig import write_rig

    write_rig(folder, "indirect")


def _component(folder: Path) -> None:
    from deboom.bench.component import ComponentPlan
    from deboom.bench.component_writer import write_component_test

    write_component_test(folder, 3, plan=ComponentPlan(points=1, line_step=4.0), truth_seed=2)
    shutil.rmtree(folder / "truth", ignore_errors=True)


def _read_component(folder: Path) -> None:
    from deboom.files.component_test import read_component_test, read_receiver

    read_component_test(folder)
    read_receiver(folder / "receiver")


def _front(folder: Path) -> None:
    """Write the run of a tiny front; its platform lies beside the cases."""
    import foreign_platform_samples

    from deboom.runs.platform_options import Motion, MountSource
    from deboom.runs.runner import load_study, run_study

    place = Path(tempfile.mkdtemp(prefix="fuzz-platform-")) / "any"
    atexit.register(shutil.rmtree, place.parent, ignore_errors=True)
    platform = foreign_platform_samples.write_foreign_platform(place)
    study = load_study(DATA.parent / "front.py")
    options = {"seed": 1, "band": (30.0, 33.0), "generations": 2, "population": 8, "samples": 4}
    options |= {"polish": False, "checks": 64, "with_": "none", "platform": platform}
    options |= {"motion": Motion.prescribed, "mounts": MountSource.spectra}
    run = run_study(study, folder.with_name("results"), options)
    run.rename(folder)
    shutil.rmtree(folder.with_name("results"))


def _search(folder: Path) -> None:
    import numpy as np

    from deboom.files.run_folder import CheckpointFolder

    store = CheckpointFolder(folder, {"a.toml": "0"})
    store.save({"seed": 1, "variables": ["a", "b"], "seconds": 0.0})
    for generation in (1, 2):
        store.keep(generation, {"designs": np.ones((3, 2)), "failed": np.zeros(3)})


def _read_valid_files(folder: Path) -> None:
    from valid_files import read

    for path in sorted(folder.glob("[0-9]*")):
        if path.suffix not in (".csv", ".tdms_index"):
            with contextlib.suppress(InputError):
                read(path)


PARTS = "u06_parts.toml"
SPACE = deboom.DesignSpace(("EnM x", "mass"), ("1", "kg"), [1, 3], [0.8, 2], [1.2, 5], [0, 0])
KINDS: dict[str, tuple[Callable[[Path], None], Callable[[Path], object]]] = {
    "platform": (_platform, command("check", "@")),
    "platform of UFF": (_platform_uff, command("check", "@")),
    "campaign": (_campaign, reader("files.campaign:read_campaign")),
    "orders": (_campaign, command("orders", "@", "g5_wot220_time", "--name", "again")),
    "vehicle": (
        _written("vehicle_writer:write_vehicle", 1, load_cases=(), accelerance=False),
        reader("files.vehicle:read_vehicle"),
    ),
    "compressor": (
        _written("compressor_writer:write_compressor_test", 1),
        reader("files.inertance_test:read_inertance_test"),
    ),
    "operation": (
        _written("compressor_writer:write_operating_test", 1),
        reader("files.operating_test:read_operating_test"),
    ),
    "electric car": (
        _written("electric_car_writer:write_electric_car", 1),
        reader("files.electric_car:read_electric_car"),
    ),
    "hammer test": (_hits, reader("files.hammer_test:read_hammer_test")),
    "limits": (
        of_tests("test_files_limits:WHOLE", "a.toml"),
        reader("files.limits:read_component_limits", "a.toml"),
    ),
    "part numbers": (shipped(PARTS), reader("files.limits:load_parts", PARTS)),
    "study": (
        of_tests("test_files_hard_cases:STUDY", "a.py", lambda text: text.format("seed: int = 1")),
        command("run", "@/a.py", "--help"),
    ),
    "list of runs": (_results, command("list", "@")),
    "library": (_library, command("library", "show", "@/a.db")),
    "import": (_library, command("library", "import", "@/new.db", "@/a.json")),
    "time data": (_time_data, _read_time_data),
    "other programs": (_other_programs, _read_other_programs),
    "compressor model": (
        of_tests("test_files_compressor_model:DOCUMENT", "a.json", json.dumps),
        reader("files.compressor_model:read_fitted_bands", "a.json"),
    ),
    "delivery": (_delivery, command("accept", "@/box.json", "@/parts.csv", "--out", "@.out")),
    "programme": (
        shipped("u06_f39_f45/programme.toml"),
        reader("files.acceptance:read_programme", "", ("EnM", "GeM", "TSM", "Du")),
    ),
    "designs": (_designs, _read_designs),
    "mount on a rig": (_rig, reader("files.mount_rig:read_mount_rig")),
    "component": (_component, _read_component),
    "search": (_search, _read_search),
    DRAWN: (lambda folder: folder.mkdir(), _read_valid_files),
    "front": (_front, command("listen", "@", "--seconds", "1", "--out", "@.out")),
}
SELDOM = dict.fromkeys(("orders", "electric car", "hammer test", "delivery", "component"), 8)
SELDOM |= {"platform": 2, "operation": 4, "front": 6, DRAWN: 8}
"""Kinds whose cases take long come only every so many rounds."""
OUTPUTS = ("index.html", "new.db", "again.uff", "campaign.toml")
"""Files that a command may write."""


def broken(folder: Path, chance: random.Random) -> str:
    """Break one file of a folder; return what was done."""
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    if not files:
        return "nothing left"
    path = chance.choice(files)
    ways: list[Callable[[Path, random.Random], None]] = [_bytes, _cut, _other_file]
    special = {".xlsx": _cells, ".json": _json, ".db": _rows, ".mat": _bytes, ".uff": _text}
    ways += [special.get(path.suffix, _text)] * 5
    endless = {".xlsx": _endless, ".npz": _announced, ".db": _programs, ".toml": _names}
    endless |= {".csv": _names, ".json": _names}
    ways += [endless[path.suffix]] * 4 if path.suffix in endless else []
    way = chance.choice(ways)
    try:
        way(path, chance)
    except Exception:  # already so broken that only bytes can be changed
        way = _bytes
        way(path, chance)
    return f"{way.__name__.strip('_')} {path.relative_to(folder)}"


def _bytes(path: Path, chance: random.Random) -> None:
    data = bytearray(path.read_bytes() or b"\0")
    for _ in range(chance.choice((1, 3, 30))):
        data[chance.randrange(len(data))] = chance.randrange(256)
    path.write_bytes(data)


def _cut(path: Path, chance: random.Random) -> None:
    data = path.read_bytes()
    at = chance.randrange(len(data) + 1)
    path.write_bytes(chance.choice((data[:at], data[at:], data[:at] * 2, data + b"\0" * at, b"")))


def _other_file(path: Path, chance: random.Random) -> None:
    path.unlink()
    way = chance.randrange(5)
    if way == 0:
        os.mkfifo(path)
    elif way == 1:
        path.symlink_to(chance.choice(("/dev/zero", "/dev/null", path.name)))
    elif way == 2:
        path.mkdir()
    elif way == 3:
        path.write_bytes(chance.choice((b"\xff\xfe", b"\xd0\xcf\x11\xe0" * 200, b"PK\x03\x04")))


def _text(path: Path, chance: random.Random) -> None:
    text = path.read_bytes().decode("latin-1")
    words = list(re.finditer(r"[^\s,;\"'=\[\]{}]+", text))
    way = chance.randrange(6)
    if way == 0 or not words:
        lines = text.splitlines(keepends=True) or [""]
        place = chance.randrange(len(lines))
        lines[place : place + 1] = lines[place : place + 1] * chance.choice((0, 2))
        text = "".join(lines)
    elif way == 1:
        text += chance.choice(("[" * 5000, "a = " + "[" * 5000, '{"a":' * 5000, "\n,,,,,,,,,\n"))
    else:
        word = chance.choice(words)
        number = re.fullmatch(r"[+-]?[\d.]+(e[+-]?\d+)?", word[0])
        new = chance.choice(NUMBERS if number and way < 5 else NAMES)
        text = text[: word.start()] + new + text[word.end() :]
    path.write_bytes(text.encode("utf-8" if "ü" in text else "latin-1", "replace"))


def _json(path: Path, chance: random.Random) -> None:
    document = json.loads(path.read_text())
    inside, trail = document, []
    while isinstance(inside, dict | list) and inside and (len(trail) < 2 or chance.random() < 0.7):
        key = chance.choice(list(inside) if isinstance(inside, dict) else range(len(inside)))
        trail.append((inside, key))
        inside = inside[key]
    holder, key = trail[-1]
    if isinstance(holder, dict) and chance.random() < 0.2:
        del holder[key]
    else:
        holder[key] = chance.choice((*VALUES, float("nan"), "os.system", "DELETE FROM mount"))
    path.write_text(json.dumps(document))


def _cells(path: Path, chance: random.Random) -> None:
    book = openpyxl.load_workbook(path)
    sheet = chance.choice(book.worksheets)
    if chance.random() < 0.2:
        sheet.cell(*chance.choice(((1_048_576, 16_384), (1, 16_384), (1_048_576, 1)))).value = "x"
    else:
        cell = sheet.cell(chance.randint(1, sheet.max_row), chance.randint(1, sheet.max_column))
        new = chance.choice((None, True, -1, 1e308, "=1/0", "nan", "x" * 30_000, "$", "1,5"))
        cell.value = new
    book.save(path)


def _rows(path: Path, chance: random.Random) -> None:
    with contextlib.closing(sqlite3.connect(path)) as base, base:
        tables = [
            row[0] for row in base.execute("SELECT name FROM sqlite_master WHERE type='table'")
        ]
        table = chance.choice(tables)
        columns = [row[1] for row in base.execute(f'PRAGMA table_info("{table}")')]
        value = chance.choice((None, "x", -1, 1e308, b"\0\1", "DELETE FROM mount", "os.system"))
        with contextlib.suppress(sqlite3.Error):
            base.execute(f'UPDATE "{table}" SET "{chance.choice(columns)}" = ?', (value,))


_SHEET = '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
_BOOK = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
_PARTS = (
    ("xl/worksheets/sheet1.xml", _SHEET, ("<row/>", '<row r="1"/>', "<row><c/><c/></row>")),
    ("xl/worksheets/sheet1.xml", f"{_SHEET}<row>", ("<c/>", "<c><v>1</v></c>")),
    ("xl/worksheets/sheet1.xml", f"{_SHEET}<row><c><v>", ("1", "ü", "&lt;")),
    ("xl/worksheets/sheet1.xml", f'{_SHEET}<row r="', ("1",)),
    (
        "xl/worksheets/sheet1.xml",
        f"{_SHEET}</sheetData><mergeCells>",
        ('<mergeCell ref="A1:B2"/>',),
    ),
    ("xl/worksheets/sheet1.xml", "", ("<a>",)),
    ("xl/styles.xml", f"<styleSheet {_BOOK}><cellXfs>", ('<xf numFmtId="1"/>', "<xf/>")),
    ("xl/styles.xml", f"<styleSheet {_BOOK}><fonts>", ("<font><b/></font>",)),
    ("xl/sharedStrings.xml", f"<sst {_BOOK}>", ("<si><t>a</t></si>", "<si><r><t>a</t></r></si>")),
    ("xl/sharedStrings.xml", f"<sst {_BOOK}><si>", ("<r><t>a</t></r>",)),
    ("xl/workbook.xml", f"<workbook {_BOOK}><sheets>", ('<sheet name="a" sheetId="1"/>',)),
    ("[Content_Types].xml", "<Types>", ('<Override PartName="/a" ContentType="b"/>',)),
    ("a/b.xml", '<!DOCTYPE a [<!ENTITY b "c">]><a>', ("&b;",)),
)
"""Part of a workbook, how it begins, and what it then repeats."""


def _endless(path: Path, chance: random.Random) -> None:
    """Let a part of a workbook go on for up to 200 MB; what it announces never ends properly."""
    part, start, repeated = chance.choice(_PARTS)
    each = chance.choice(repeated).encode()
    block = each * (2**16 // len(each))
    book = zipfile.ZipFile(io.BytesIO(path.read_bytes()))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name in {*book.namelist(), part}:
            if name != part:
                new.writestr(name, book.read(name))
                continue
            with new.open(name, "w", force_zip64=True) as file:
                file.write(start.encode())
                for _ in range(chance.choice((3, 30, 300, 3000))):
                    file.write(block)
                if chance.random() < 0.5 and "sheetData" in start:
                    file.write(b"</sheetData></worksheet>")


def _announced(path: Path, chance: random.Random) -> None:
    """Let the header of an array announce another shape or type."""
    book = zipfile.ZipFile(io.BytesIO(path.read_bytes()))
    part = chance.choice(book.namelist())
    shape = chance.choice(("6000000000000,", "-1,", "2**70,", "1e9,", "'a',", "0,", "", "3, 2, 1"))
    kind = chance.choice(("<f8", "<c16", "|O", "|V0", "<U0", "<U2000000000", "|b1", "x", "<m8[s]"))
    order = chance.choice(("False", "True", "None"))
    header = f"{{'descr': '{kind}', 'fortran_order': {order}, 'shape': ({shape})}}"
    text = chance.choice((header, header[:-2], "[" * 9000, "__import__('os')")).encode() + b"\n"
    version = chance.choice((b"\x01\0", b"\x02\0", b"\x03\0", b"\x09\0"))
    length = len(text).to_bytes(2 if version == b"\x01\0" else 4, "little")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name in book.namelist():
            if name != part:
                new.writestr(name, book.read(name))
            else:
                with new.open(name, "w", force_zip64=True) as file:
                    file.write(b"\x93NUMPY" + version + length + text)
                    for _ in range(chance.choice((1, 100, 3000))):
                        file.write(bytes(2**18))


_ALL = (
    "'c' campaign, 'm' mount, 'v' variant, 'p' part_number, 's' serial, 'x' supplier, "
    "'' document, '' sha256"
)
_RECURSIVE = "WITH RECURSIVE r(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM r)"


def _programs(path: Path, chance: random.Random) -> None:
    """Give a library what computes, or values and tables without end."""
    big = chance.choice((60_000_000, 20_000_000, 1_000_000, 300))
    filler = f"{_RECURSIVE.replace('FROM r)', 'FROM r LIMIT 3000)')}"
    script = chance.choice(
        (
            f"CREATE VIEW deboom_mount AS {_RECURSIVE} SELECT {_ALL} FROM r",
            f"CREATE VIEW deboom_version AS {_RECURSIVE} SELECT 2 version, 'x' written_by FROM r",
            f"CREATE VIEW a AS {_RECURSIVE} SELECT n FROM r",
            "CREATE TRIGGER a AFTER INSERT ON deboom_mount BEGIN DELETE FROM deboom_mount; END",
            "CREATE VIRTUAL TABLE a USING fts5(b)",
            "CREATE TABLE deboom_campaign (name, sha256, "
            f"document AS (printf('%.*c', {big}, 'x')))",
            f"UPDATE deboom_mount SET supplier = zeroblob({big})",
            f"UPDATE deboom_mount SET document = printf('%.*c', {big}, '[')",
            f"UPDATE deboom_campaign SET document = printf('%.*c', {big}, 'x')",
            f"INSERT INTO deboom_mount {filler} SELECT campaign, mount, variant, n, serial, "
            f"printf('%.*c', {min(big, 300_000)}, 'x'), document, sha256 FROM deboom_mount, r",
            f"INSERT INTO deboom_version {filler} SELECT n + 9, 'x' FROM r",
            "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = 'CREATE TABLE x (y'",
            "PRAGMA writable_schema = ON; UPDATE sqlite_master SET rootpage = 1",
        )
    )
    made = re.match(r"CREATE (?:VIEW|TABLE) (deboom_\w+)", script)
    with contextlib.closing(sqlite3.connect(path)) as base, base:
        base.execute("PRAGMA foreign_keys = OFF")
        if made:
            base.execute(f"DROP TABLE {made[1]}")
        with contextlib.suppress(sqlite3.Error):
            base.executescript(script)


def _names(path: Path, chance: random.Random) -> None:
    """Give an item a name that would be another file, another name or nothing somewhere."""
    text = path.read_text(encoding="utf-8")
    quoted = list(
        re.finditer(r'(?:name|group|mount|file|set|study|table)"?\s*[=:]\s*"([^"]*)"', text)
    )
    cells = list(re.finditer(r"(?<=[,\n])([^,\n\"]+)(?=[,\n])", text))
    quoted_text = chance.choice(quoted or cells)
    new = chance.choice(
        (*PATHS, quoted_text[1].swapcase(), f"{quoted_text[1]}/../{quoted_text[1]}")
    )
    if path.suffix == ".csv":
        new = new.encode().decode("unicode_escape") if "\\" in new else new
    path.write_text(
        text[: quoted_text.start(1)] + new + text[quoted_text.end(1) :], encoding="utf-8"
    )


def outcome(read: Callable[[Path], object], folder: Path) -> tuple[str, str]:
    """Read a folder in a process of its own; return the class and what it said."""
    before = {p: p.lstat().st_mtime_ns for p in folder.rglob("*")}
    beside = {p.name for p in folder.parent.iterdir()}
    beside |= {f"{folder.name}.txt", f"{folder.name}.out"}
    sys.dont_write_bytecode = True
    said = folder.with_suffix(".txt")
    child = os.fork()
    if child == 0:
        _child(read, folder, said)
    end = time.monotonic() + LONGEST_WAIT
    status = None
    while status is None and time.monotonic() < end:
        done, code = os.waitpid(child, os.WNOHANG)
        status = code if done else time.sleep(0.005)
    if status is None:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return "hang", ""
    text = said.read_text(errors="replace") if said.exists() else ""
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU:
        return "hang", text
    if os.WIFSIGNALED(status):
        return "crash", f"signal {os.WTERMSIG(status)} {text}"
    changed = [
        p
        for p in folder.rglob("*")
        if before.get(p) != p.lstat().st_mtime_ns and p.is_file() and p.name not in OUTPUTS
    ]
    # a name must not lead out of the folder; what stands beside it is the harness's own
    changed += [p for p in folder.parent.iterdir() if p.name not in beside]
    if changed or list(folder.parent.glob(f"{folder.name}/**/.write-*")):
        return "half-written", f"{changed} {text}"
    return ("accepted", "sentence", "traceback")[min(os.WEXITSTATUS(status), 2)], text


def _child(read: Callable[[Path], object], folder: Path, said: Path) -> None:
    code = 0
    told = io.StringIO()
    try:
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + LARGEST_MEMORY,) * 2)
        resource.setrlimit(resource.RLIMIT_CPU, (int(LONGEST), int(LONGEST_WAIT)))
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(told):
            try:
                read(folder)
            except InputError as error:
                print(error, file=told)
                raise SystemExit(2) from None
    except SystemExit as error:
        lines = told.getvalue().splitlines()
        said.write_text(told.getvalue()[:3000])
        readable = lines and max(map(len, lines)) < LONGEST_SENTENCE
        code = {2: 1 if readable else 2}.get(error.code, 2 if error.code else 0)
    except BaseException:
        code = 2
        said.write_text(traceback.format_exc())
    finally:
        os._exit(code)


def _broken_twice(case: Path, chance: random.Random) -> str:
    return " and ".join(broken(case, chance) for _ in range(chance.choice((1, 1, 1, 2))))


def _drawn(case: Path, chance: random.Random) -> str:
    """Write valid files in a process of its own: their libraries keep some of them open."""
    seeds = [chance.getrandbits(32) for _ in range(DRAWN_FILES)]
    child = os.fork()
    if child == 0:
        from valid_files import write

        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            write(case, seeds)
        os._exit(0)
    os.waitpid(child, 0)
    return f"files of {seeds}"


def rounds(kinds: list[str]) -> Iterator[tuple[str, int]]:
    """Yield kind after kind, round after round, those that take long only in their turns."""
    for turn in itertools.count(1):
        for kind in kinds:
            if turn % SELDOM.get(kind, 1) == 0:
                yield kind, turn


def main() -> int:
    """Break inputs until the time or the number of cases is up, and count how they end."""
    for module in pkgutil.walk_packages(deboom.__path__, "deboom."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)  # once, before the cases are forked
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--cases", type=int, default=10**9)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", help="one kind of input only")
    arguments = parser.parse_args()
    end = time.monotonic() + arguments.seconds
    counts: Counter[tuple[str, str]] = Counter()
    kinds = [arguments.kind] if arguments.kind else list(KINDS)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as place:
        for kind, turn in itertools.islice(rounds(kinds), arguments.cases):
            if time.monotonic() > end:
                break
            good = Path(place) / kind.replace(" ", "_")
            case = Path(place) / "case"
            if not good.exists():
                with contextlib.redirect_stdout(io.StringIO()):
                    KINDS[kind][0](good)
                valid = outcome(KINDS[kind][1], shutil.copytree(good, case))
                assert valid[0] == "accepted", f"{kind} is not valid: {valid}"
                shutil.rmtree(case)
            chance = random.Random(f"{arguments.seed} {kind} {turn}")
            shutil.copytree(good, case)
            if kind == DRAWN:
                done, files = _drawn(case, chance), DRAWN_FILES
            else:
                done, files = _broken_twice(case, chance), 1
            kind_of_end, text = outcome(KINDS[kind][1], case)
            counts[kind, kind_of_end] += files
            if kind_of_end in FAULTS:
                print(f"{kind_of_end}: {kind}, round {turn}: {done}\n{text}", flush=True)
            shutil.rmtree(case)
            case.with_suffix(".txt").unlink(missing_ok=True)
            shutil.rmtree(case.with_suffix(".out"), ignore_errors=True)
    ends = ("sentence", "accepted", *FAULTS)
    print(f"{'kind':<18}" + "".join(f"{name:>13}" for name in ends))
    for kind in kinds:
        print(f"{kind:<18}" + "".join(f"{counts[kind, name]:>13}" for name in ends))
    faults = sum(count for (_, name), count in counts.items() if name in FAULTS)
    print(f"{counts.total()} cases, seed {arguments.seed}: {faults} faults")
    return 1 if faults or not counts else 0


if __name__ == "__main__":
    sys.exit(main())
