"""Files from elsewhere: none runs code, none writes outside its folder, none takes the memory."""

import io
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import sysconfig
import time
import zipfile
from pathlib import Path

import asammdf
import h5py
import numpy as np
import pandas as pd
import pytest
from broken_files import refused
from mounts_library_samples import campaign, mount
from scipy.io import savemat
from test_files_time_data import matlab_73

from deboom.errors import InputError
from deboom.files import reader_process, workbook_parts
from deboom.files.disk import opened_zip, read_arrays
from deboom.files.function_table import matlab_table
from deboom.files.limits import load_parts
from deboom.files.rows import CampaignChannel, MountRow
from deboom.files.run_folder import Run, RunEntry, check_files, hash_files, read_run
from deboom.files.tables import read_frame, read_table, workbook_bytes
from deboom.files.time_data import read_time_signals, time_functions
from deboom.files.units import Unit
from deboom.mounts import library as mount_library
from deboom.mounts.library import open_library
from deboom.names import LONGEST_NAME, look_alikes, name_fault, path_inside
from deboom.report import Report
from deboom.runs.rebuilt import prepared_again, study_of
from deboom.runs.runner import Study
from deboom.tabled import csv_text, table_of

MARKER = "import pathlib; pathlib.Path({!r}).write_text('ran')\n"
SHADOWS = ("numpy", "scipy", "deboom", "sitecustomize", "socket", "struct", "pickle", "ast")
"""Modules that a process imports early."""


@pytest.fixture
def reader_per_folder(monkeypatch, reader_of_each_folder):
    """Read each folder by a process of its own, which starts with the environment of the test."""
    monkeypatch.setattr(reader_process, "_reader_of", reader_of_each_folder)


@pytest.fixture
def archive(tmp_path, monkeypatch):
    """Return a working folder full of modules that tell when one of them is imported."""
    folder = tmp_path / "archive"
    folder.mkdir()
    for name in SHADOWS:
        (folder / f"{name}.py").write_text(MARKER.format(str(tmp_path / "ran")))
    monkeypatch.chdir(folder)
    return folder


def functions(path):
    names = np.array(["a"], dtype=object)
    values = np.ones((3, 1), dtype=complex)
    savemat(path, {"frequency": [1.0, 2.0, 3.0], "names": names, "values": values, "units": "N"})


@pytest.mark.usefixtures("reader_per_folder")
def test_modules_beside_a_matlab_file_are_not_imported(archive, tmp_path, monkeypatch):
    functions(archive / "a.mat")
    for path in ("", ".", str(archive)):
        reader_process._end()
        monkeypatch.setenv("PYTHONPATH", path)
        lines, columns = matlab_table(Path("a.mat"))
        assert (lines.size, list(columns)) == (3, ["a"])
    assert not (tmp_path / "ran").exists()


def test_packages_that_a_user_installed_for_herself_read_matlab_files(tmp_path):
    """The base interpreter has no packages; a path file in the user's site adds ours."""
    functions(tmp_path / "a.mat")
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    scheme = sysconfig.get_preferred_scheme("user")
    site = Path(sysconfig.get_path("purelib", scheme, {"userbase": str(tmp_path / "base")}))
    assert version in site.as_posix() or os.name == "nt"
    site.mkdir(parents=True)
    packages = [sysconfig.get_path("purelib"), str(Path(mount_library.__file__).parents[2])]
    (site / "ours.pth").write_text("\n".join(packages))
    words = "from deboom.files.function_table import matlab_table; from pathlib import Path; "
    words += "print(list(matlab_table(Path('a.mat'))[1]))"
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    environment["PYTHONUSERBASE"] = str(tmp_path / "base")
    done = subprocess.run(
        [getattr(sys, "_base_executable", sys.executable), "-P", "-c", words],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment,
        check=False,
    )
    assert done.stdout == "['a']\n", done.stderr


@pytest.mark.usefixtures("reader_per_folder")
def test_a_matlab_file_without_its_packages_is_not_called_damaged(tmp_path, monkeypatch):
    functions(tmp_path / "a.mat")
    monkeypatch.setattr(sys, "executable", getattr(sys, "_base_executable", sys.executable))
    monkeypatch.setenv("PYTHONNOUSERSITE", "1")
    if Path(sys.executable).resolve().parent == Path(sys.prefix) / "bin":
        pytest.skip("no other interpreter")
    refused(lambda folder: matlab_table(folder / "a.mat"), tmp_path, "which lacks a package (")


FORMULA = (
    """X1 + (f'{[c for c in ().__class__.__base__.__subclasses__() if c.__name__=="_wrap_close"]"""
    """[0].__init__.__globals__["system"]("touch MARKER")}' == '9')"""
)
"""What numexpr takes for a quoted text, and Python for code that touches a file."""


@pytest.mark.parametrize("of", ["A1 x", "time"])
@pytest.mark.parametrize(("version", "name"), [("4.10", "a.mf4"), ("3.30", "a.mdf")])
def test_a_formula_of_an_mdf_file_is_not_run(tmp_path, version, name, of):
    time = np.arange(8.0)
    marker = tmp_path / "ran"
    formula = {"formula": FORMULA.replace("MARKER", str(marker))}
    whose = {} if of == "time" else {"conversion": formula}
    with asammdf.MDF(version=version) as file:
        file.append([asammdf.Signal(time, time, unit="g", name="A1 x", **whose)])
        if of == "time":
            other = asammdf.Signal(time, time, name="B", conversion=formula)
            file.append([other])
            file.groups[0].channels[0].conversion = file.groups[1].channels[1].conversion
        file.save(tmp_path / name)
    refused(
        lambda folder: read_time_signals(folder / name, ["A1 x"]),
        tmp_path,
        "channel 'A1 x' is converted to text or by a formula, which is not run",
    )
    assert not marker.exists()
    if of == "A1 x":  # the library alone runs it
        with asammdf.MDF(tmp_path / name) as file:
            file.get("A1 x")
        assert marker.exists()


def elsewhere(file, folder):
    (folder / "secret").write_bytes(np.arange(8.0).tobytes())
    file.create_dataset("A1 x", (8,), "f8", external=[(folder / "secret", 0, 64)])


def endless(file, folder):
    os.mkfifo(folder / "pipe")
    file.create_dataset("A1 x", (8,), "f8", external=[(folder / "pipe", 0, 64)])


def other_file(folder):
    with h5py.File(folder / "other.h5", "w") as other:
        other["A1 x"] = np.arange(8.0)
    return folder / "other.h5"


def assembled(file, folder):
    layout = h5py.VirtualLayout((8,), "f8")
    layout[:] = h5py.VirtualSource(other_file(folder), "A1 x", (8,))
    file.create_virtual_dataset("A1 x", layout)


def linked(file, folder):
    file["A1 x"] = h5py.ExternalLink(other_file(folder), "A1 x")


def linked_twice(file, folder):
    file.create_group("g")["away"] = h5py.ExternalLink(other_file(folder), "/")
    file["A1 x"] = np.zeros(8)
    file["time"] = h5py.SoftLink("/g/away/A1 x")


def timed_elsewhere(file, folder):
    file["A1 x"] = np.zeros(8)
    (folder / "secret").write_bytes(np.arange(8.0).tobytes())
    file.create_dataset("time", (8,), "f8", external=[(folder / "secret", 0, 64)])


OUTSIDE_HDF5 = [
    (elsewhere, "data set '/A1 x' takes its numbers from another file"),
    (endless, "data set '/A1 x' takes its numbers from another file"),
    (assembled, "data set '/A1 x' takes its numbers from another file"),
    (linked, "'A1 x' is a link to another file"),
    (linked_twice, "'g/away' is a link to another file"),
    (timed_elsewhere, "data set '/time' takes its numbers from another file"),
]


@pytest.mark.parametrize(("build", "sentence"), OUTSIDE_HDF5)
def test_numbers_of_another_file_are_not_read(tmp_path, build, sentence):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.attrs["sample_rate"] = 100.0
        build(file, tmp_path)
    with pytest.raises(InputError, match=re.escape(sentence)):
        read_time_signals(tmp_path / "a.h5", ["A1 x"])


def test_a_matlab_file_takes_no_numbers_from_another_file(tmp_path):
    matlab_73(tmp_path / "a.mat", {"a": ("N", np.zeros(8))}, np.arange(8.0))
    with h5py.File(tmp_path / "a.mat", "r+") as file:
        del file["values"]
        (tmp_path / "secret").write_bytes(np.arange(8.0).tobytes())
        file.create_dataset("values", (1, 8), "f8", external=[(tmp_path / "secret", 0, 64)])
    refused(
        lambda folder: matlab_table(folder / "a.mat", "time"),
        tmp_path,
        "data set '/values' takes its numbers from another file",
    )


def channels_of_zeros(path, counts, rates=(1000.0,), **storage):
    """Write channels that take no room in the file: A0, A1 and so on, each of its own rate."""
    with h5py.File(path, "w") as file:
        for k, count in enumerate(counts):
            group = file.create_group(str(k))
            group.attrs["sample_rate"] = rates[k % len(rates)]
            options = {"dtype": "f8", "chunks": (min(count, 2**20),), **storage}
            group.create_dataset(f"A{k}", (count,), **options).attrs["unit"] = "g"
    return path


ROWS = [
    CampaignChannel(f"A{k}", "acceleration", k + 1, "+x", Unit("g", "m/s^2", 9.80665))
    for k in range(40)
]


def test_numbers_of_all_channels_are_added_up_before_they_are_read(tmp_path):
    path = channels_of_zeros(tmp_path / "a.h5", [40_000_000] * 4, (1e3, 1e3, 2e3, 3e3))
    assert path.stat().st_size < 20_000
    begin = time.process_time()
    with pytest.raises(InputError, match="announces 280000000 numbers, at most 251658240"):
        read_time_signals(path, ["A0", "A1", "A2", "A3"])
    assert time.process_time() - begin < 1.0


def test_what_is_resampled_is_added_up_before(tmp_path):
    path = channels_of_zeros(tmp_path / "a.h5", [8_000_000] + [4000] * 39, (2e6, *[1e3] * 39))
    with pytest.raises(InputError, match=r"is resampled to 2e\+06 Hz announces 336312000 numbers"):
        time_functions(path, ROWS)


def test_a_chunk_that_unpacks_to_too_much_is_refused(tmp_path):
    path = channels_of_zeros(tmp_path / "a.h5", [2**26], chunks=(2**26,), compression="gzip")
    with pytest.raises(InputError, match="in chunks of 512 MiB, at most 256 MiB"):
        read_time_signals(path, ["A0"])


@pytest.mark.usefixtures("reader_per_folder")
def test_one_process_reads_the_files_of_a_folder(tmp_path):
    (tmp_path / "other").mkdir()
    for path in ("a.h5", "b.h5", "other/a.h5"):
        channels_of_zeros(tmp_path / path, [8])
    pids = []
    for path in ("a.h5", "b.h5", "other/a.h5", "b.h5"):
        assert read_time_signals(tmp_path / path, ["A0"])["A0"].values.tolist() == [0.0] * 8
        pids.append(reader_process._readers[0].process.pid)
    assert pids[0] == pids[1]
    assert len(set(pids)) == 3
    os.kill(pids[-1], signal.SIGKILL)  # such as for want of memory, between two files
    reader_process._readers[0].process.wait()
    assert read_time_signals(tmp_path / "a.h5", ["A0"])
    folder = Path(reader_process._readers[0].folder.name)
    assert list(folder.iterdir()) == []


def test_a_reader_that_goes_on_and_on_is_ended(tmp_path, monkeypatch):
    path = channels_of_zeros(tmp_path / "a.h5", [8])
    monkeypatch.setattr(reader_process, "LONGEST_WAIT", 0.0)
    with pytest.raises(InputError, match=r"a\.h5 takes more than 60 s to read"):
        read_time_signals(path, ["A0"])
    monkeypatch.undo()
    assert read_time_signals(path, ["A0"])


def test_without_lazy_loader_the_command_says_a_sentence():
    code = "import sys; sys.modules['lazy_loader'] = None; sys.argv = ['deboom']; import deboom"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr == (
        "deboom needs lazy_loader, which is not installed: pip install lazy-loader\n"
    )


WORK = """
from typer.testing import CliRunner
from deboom.cli import app
from deboom.explore.workers import process_pool
if __name__ == "__main__":
    CliRunner().invoke(app, ["studies"])
    with process_pool(1) as pool:
        print(pool.submit(abs, -1).result())
"""


@pytest.mark.slow("begins a script and its processes")
def test_workers_import_nothing_from_the_working_folder(archive, tmp_path):
    (tmp_path / "command.py").write_text(WORK)
    words = [sys.executable, tmp_path / "command.py"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.stdout == "1\n", done.stderr
    assert not (tmp_path / "ran").exists()


NAMES = [
    ("", "at least one character"),
    ("a b", "no blanks"),
    ("a\u200bb", "no controls"),
    ("a\u202eb", "no controls"),
    ("a\u034fb", "take the invisible U+034F out"),
    ("\u115f", "take the invisible U+115F out"),
    ("\u2800", "take the invisible U+2800 out"),
    ("\u3164", "take the invisible U+3164 out"),
    ("a\ufe0f", "take the invisible U+FE0F out"),
    ("a\U000e0100", "take the invisible U+E0100 out"),
    ("../../../../X", "none of"),
    ("a\\b", "none of"),
    ("a:b", "none of"),
    ("Du\u0308", "two characters"),
    (".hidden", "neither begins nor ends with a dot"),
    ("U06.", "neither begins nor ends with a dot"),
    ("..", "neither begins nor ends with a dot"),
    ("Aux", "Windows keeps this name"),
    ("com1.uff", "Windows keeps this name"),
    ("x" * (LONGEST_NAME + 1), "at most 60 characters, not 61"),
]


@pytest.mark.parametrize(("name", "fault"), NAMES)
def test_a_name_that_no_file_should_have_is_at_fault(name, fault):
    assert fault in name_fault(name)


@pytest.mark.parametrize(
    "name", ["U06-1", "NA", "=1+1", "ü", "前", "$x$", "g5_wot220", "v1.2", "x" * 60]
)
def test_a_name_of_another_kind_is_none(name):
    assert name_fault(name) == ""


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        (["U06", "u06"], "group 'u06' beside 'U06' differs in capitals only: keep or rename one"),
        (["U06", "UO6"], "group 'UO6' beside 'U06' differs hardly"),
        (["Bl", "B1"], "group 'B1' beside 'Bl' differs hardly"),
        (["\u0410udi", "Audi"], "differs hardly"),
        (["\u0501\u051d\u051b", "dwq"], "differs hardly"),
        (["\u04bb\u04cf\u0475\u057d", "hivu"], "differs hardly"),
        (["Kem", "Kern"], "differs hardly"),
        (["a\u2014b", "a-b"], "differs hardly"),
        (["a_b", "a-b"], "differs hardly"),
        (["Ａ1", "A1"], "differs hardly"),
    ],
)
def test_names_that_look_alike_are_told(names, sentence):
    (told,) = look_alikes("group", names)
    assert sentence in told


def test_different_names_are_not_called_alike():
    names = [
        "U06-1",
        "U06-2",
        "F39",
        "F45",
        "U06-1",
        "Dul",
        "Dur",
        "DuL1",
        "TSM",
        "TSN",
        "left",
        "\u00e4",
        "a",
    ]
    assert list(look_alikes("mount", names)) == []


OUTSIDE = ("../a", "/a", "a/../../b", "a\\b", "c:a", "", ".", "a\0b", "a\nb")


@pytest.mark.parametrize("name", OUTSIDE)
def test_no_name_leaves_its_folder(tmp_path, name):
    with pytest.raises(InputError, match="is not a file name within"):
        path_inside(tmp_path, name)
    with pytest.raises(InputError, match="is not a file name within"):
        Run(tmp_path, 1, ()).save_text(name, "x")
    report = Report("t", "q?")
    report.attach(name, b"x")
    with pytest.raises(InputError, match="is not a file name within"):
        report.write(tmp_path / "page")
    entry = RunEntry(tmp_path, {"files_sha256": {name: "0"}})
    with pytest.raises(InputError, match="is not a file name within"):
        check_files(entry)


def test_no_link_leads_out_of_a_folder(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "listen").symlink_to(tmp_path)
    with pytest.raises(InputError, match="is a link out of"):
        path_inside(tmp_path / "run", "listen")
    assert path_inside(tmp_path / "run", "figures/a.png") == tmp_path / "run" / "figures/a.png"


def test_a_toml_file_as_large_as_no_hand_writes_is_refused_at_once(tmp_path):
    (tmp_path / "a.toml").write_text("a = 1\n" + "#" * (9 * 2**20))
    refused(lambda folder: load_parts(folder / "a.toml"), tmp_path, "has 9 MiB, at most 8 MiB")


def test_no_hash_is_made_of_what_has_no_end(tmp_path):
    with pytest.raises(InputError, match="is a device or a pipe"):
        hash_files([Path("/dev/zero")], tmp_path)


QUESTION = '"""Is it?"""\n'
SCRIPT = QUESTION + (
    "from dataclasses import dataclass\n"
    "@dataclass(frozen=True)\n"
    "class Options:\n    seed: int = 1\n"
    "prepare = run = lambda *_: None\n"
)


def run_of(folder, text, study="mine"):
    folder.mkdir(parents=True)
    record = {"study": study, "seed": 1, "arguments": {"seed": 1}, "study_text": text}
    (folder / "run.json").write_text(json.dumps(record))
    return read_run(folder)


def test_a_script_beside_results_is_imported_only_where_its_folder_is_named(archive, tmp_path):
    text = SCRIPT + MARKER.format(str(tmp_path / "ran"))
    (archive / "studies").mkdir()
    (archive / "studies" / "mine.py").write_text(text)
    entry = run_of(archive / "results" / "mine" / "run", text)
    with pytest.raises(InputError, match=r"imports no script that lies beside results.*--studies"):
        study_of(entry, None)
    other = run_of(archive / "results" / "mine" / "another", SCRIPT)
    with pytest.raises(InputError, match="script is not there: say with --studies"):
        study_of(other, None)
    assert not (tmp_path / "ran").exists()
    assert study_of(entry, Path("studies")).name == "mine"
    assert (tmp_path / "ran").exists()


def test_a_shipped_study_stands_before_one_of_its_name_beside_results(archive, tmp_path):
    text = SCRIPT + MARKER.format(str(tmp_path / "ran"))
    (archive / "studies").mkdir()
    (archive / "studies" / "front.py").write_text(text)
    shipped = study_of(run_of(archive / "a", "another text", "front"), None)
    assert shipped.path.resolve().parent == Path(__file__).parents[2] / "studies"
    with pytest.raises(InputError, match="imports no script that lies beside results"):
        study_of(run_of(archive / "b", text, "front"), None)
    assert not (tmp_path / "ran").exists()


def test_a_run_that_was_copied_is_of_the_study_that_its_record_says(tmp_path):
    assert run_of(tmp_path / "mail" / "attachment", SCRIPT, "front").study == "front"
    assert RunEntry(tmp_path / "old_study" / "run", {}).study == "old_study"


def test_a_run_of_a_script_elsewhere_says_where_to_name_it(tmp_path):
    entry = run_of(tmp_path / "run", SCRIPT)
    entry.record["inputs_sha256"] = {"../data/channels.csv": "0"}
    study = Study(tmp_path / "studies" / "mine.py", "q?", None)
    with pytest.raises(InputError, match=r"channels.csv is not there.*say in which with --studies"):
        prepared_again(entry, study)


SHEET = '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
STYLES = '<styleSheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><cellXfs>'
ENDLESS = [
    ("xl/worksheets/sheet1.xml", SHEET, '<row r="1"/>', 1_100_000, "row 1048577 with 0 cells"),
    ("xl/worksheets/sheet1.xml", SHEET + "<row>", "<c/>", 20_000, "row 1 with 16385 cells"),
    ("xl/worksheets/sheet1.xml", SHEET + "<row><c><v>", "1", 2_000_000, "a text without an end"),
    ("xl/worksheets/sheet1.xml", SHEET + '<row r="', "1", 2_000_000, "a text without an end"),
    ("xl/styles.xml", STYLES, "<xf/>", 250_000, "its elements"),
    ("xl/styles.xml", '<!DOCTYPE a [<!ENTITY b "c">]>' + STYLES, "", 0, "a document type"),
]


@pytest.mark.parametrize(("part", "start", "each", "count", "words"), ENDLESS)
def test_a_workbook_without_an_end_is_refused_while_it_is_counted(
    tmp_path, part, start, each, count, words
):
    table = pd.DataFrame({"mount": ["a"]})
    book = zipfile.ZipFile(io.BytesIO(workbook_bytes({"a": table}, "a")))
    with zipfile.ZipFile(tmp_path / "m.xlsx", "w", zipfile.ZIP_DEFLATED) as new:
        for name in book.namelist():
            new.writestr(name, start + each * count if name == part else book.read(name))
    refused(lambda folder: read_table(folder / "m.xlsx", MountRow), tmp_path, part, words)


def test_cells_and_texts_of_all_parts_are_counted_together(tmp_path, monkeypatch):
    monkeypatch.setattr(workbook_parts, "MOST_ELEMENTS", 300)
    table = pd.DataFrame({"mount": ["a"] * 100, "x [m]": [1.0] * 100})
    (tmp_path / "m.xlsx").write_bytes(workbook_bytes({"a": table}, "a"))
    refused(lambda folder: read_table(folder / "m.xlsx", MountRow), tmp_path, "goes on and on")


def test_an_archive_of_too_many_or_too_large_parts_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as new:
        for name in range(10_001):
            new.writestr(str(name), b"")
    data = (tmp_path / "a.zip").read_bytes()
    with (
        pytest.raises(InputError, match="more than 10000 parts"),
        opened_zip(tmp_path / "a.zip", data, 10**6),
    ):
        pass
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as new:
        new.writestr("a", bytes(3 * 2**20))
    data = (tmp_path / "a.zip").read_bytes()
    with (
        pytest.raises(InputError, match="unpacks to 3 MiB, at most 1 MiB are read"),
        opened_zip(tmp_path / "a.zip", data, 2**20),
    ):
        pass


def archive_of(header, data=b""):
    """Return an npz whose one array announces what `header` says."""
    text = header.encode().ljust(117) + b"\n"
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as new:
        new.writestr(
            "designs.npy", b"\x93NUMPY\x01\0" + len(text).to_bytes(2, "little") + text + data
        )
    return stream.getvalue()


ANNOUNCED = [
    ("(6000000000000,)", "<f8"),
    ("(100000, 100000, 100000)", "<c16"),
    ("(-1,)", "<f8"),
    ("(6000000000000,)", "|V0"),
    ("(1,)", "|O"),
    ("(2,)", "<f8"),
    ("[" * 60, "<f8"),
    ("(1,)", "no type"),
]


@pytest.mark.parametrize(("shape", "dtype"), ANNOUNCED)
def test_an_array_that_announces_what_is_not_there_is_refused(tmp_path, shape, dtype):
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}}}"
    (tmp_path / "a.npz").write_bytes(archive_of(header, bytes(8)))
    refused(
        lambda folder: read_arrays(folder / "a.npz", "again"), tmp_path, "cannot be read ... again"
    )


def test_arrays_come_back_as_they_were(tmp_path):
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.array(["x", ""]), "c": np.zeros((0, 3))}
    np.savez_compressed(tmp_path / "a.npz", **arrays)
    for name, values in read_arrays(tmp_path / "a.npz", "again").items():
        np.testing.assert_array_equal(values, arrays[name])


COLUMNS = "'c' campaign, 'm' mount, 'v' variant, 'p' part_number, 's' serial, 'x' supplier"
FOREIGN = [
    ("CREATE VIEW a AS SELECT 1", "has a view 'a'"),
    ("CREATE TRIGGER a AFTER INSERT ON deboom_mount BEGIN SELECT 1; END", "has a trigger 'a'"),
    ("CREATE VIRTUAL TABLE a USING fts5(b)", "has a virtual table 'a'"),
    ("CREATE TABLE a (b, c AS (printf('%.*c', 900000000, b)))", "has a computed column 'c'"),
    (
        "DROP TABLE deboom_mount; CREATE VIEW deboom_mount AS WITH RECURSIVE r(n) AS (SELECT 1 "
        f"UNION ALL SELECT n + 1 FROM r) SELECT {COLUMNS}, '' document, '' sha256 FROM r",
        "has a view 'deboom_mount'",
    ),
    ("INSERT INTO deboom_version VALUES (3, 'x')", "holds an entry twice: it is damaged"),
    ("UPDATE deboom_mount SET supplier = zeroblob(60000000)", "an entry of more than 32 MiB"),
    ("UPDATE deboom_mount SET supplier = printf('%.*c', 1000000, 'x')", "cannot be kept"),
]


@pytest.mark.parametrize(("script", "sentence"), FOREIGN)
def test_a_library_that_computes_or_holds_what_none_does_is_refused(tmp_path, script, sentence):
    with open_library(tmp_path / "m.db", create=True) as library:
        library.add([campaign()], [mount()])
    base = sqlite3.connect(tmp_path / "m.db")
    base.executescript(script)
    base.close()

    def identities(folder):
        with open_library(folder / "m.db") as library:
            return library.identities()

    refused(identities, tmp_path, "m.db", sentence)


def test_a_query_of_a_library_ends(tmp_path, monkeypatch):
    with open_library(tmp_path / "m.db", create=True) as library:
        library.add([campaign()], [mount()])
    monkeypatch.setattr(mount_library, "_STEPS_PER_LOOK", 1)
    monkeypatch.setattr(mount_library, "MOST_STEPS", 5)
    with pytest.raises(InputError, match=r"m\.db takes too long to read"):
        open_library(tmp_path / "m.db")


def test_a_table_that_deboom_wrote_comes_back_with_names_like_formulas_and_na(tmp_path):
    names = ["NA", "=1+1", "nan", "0601", "None", "-x"]
    table = pd.DataFrame({"vehicle": names, **{f"{name} level [dB]": 1.5 for name in names}})
    text = csv_text(table)
    assert not any(cell[:1] in tuple("=@") for line in text.split("\n") for cell in line.split(","))
    pd.testing.assert_frame_equal(table_of(text, ("vehicle",)), table)
    (tmp_path / "a.csv").write_text(text)
    pd.testing.assert_frame_equal(read_frame(tmp_path / "a.csv", ("vehicle",)), table)
    gaps = table_of("a [1],failure\n1.0,\n,because\n", ("failure",))
    assert gaps["failure"].isna().tolist() == [True, False]
    assert gaps["a [1]"].isna().tolist() == [False, True]


def test_what_is_no_table_of_a_run_is_told(tmp_path):
    (tmp_path / "a.csv").write_text("a,b\n1,2,3\n1\n1,2,3,4\n")
    refused(lambda folder: read_frame(folder / "a.csv"), tmp_path, "a.csv is no table")


def test_security_limits_are_those_of_the_code():
    text = (Path(__file__).parents[2] / "SECURITY.md").read_text(encoding="utf-8")
    from deboom.files import binary_formats, disk, schema, tables, time_data

    for figure in (
        f"{disk.LARGEST_FILE >> 20} MiB",
        f"{disk.LARGEST_TEXT >> 20} MiB",
        f"TOML file | {schema.LARGEST_TOML >> 20} MiB",
        f"{tables.LARGEST_WORKBOOK >> 20} MiB",
        f"{mount_library.LARGEST_LIBRARY >> 20} MiB",
        f"{mount_library.LARGEST_ENTRY >> 20} MiB",
        f"{binary_formats.LONGEST_READING} s of processor time",
        f"{reader_process.LONGEST_WAIT} s by the clock",
        f"{binary_formats.LARGEST_CHUNK >> 20} MiB",
        f"{binary_formats.MOST_CHANNELS:,} channels".replace(",", " "),
        f"{disk.MOST_NUMBERS // 10**6} million numbers",
        f"{time_data.LARGEST_LVM >> 20} MiB",
        f"{tables.MOST_ROWS:,}".replace(",", " "),
        f"{LONGEST_NAME} characters",
    ):
        assert figure in text, figure
