"""Files that are made to break a reader: each ends in a sentence, soon and in little memory."""

import io
import json
import sqlite3
import zipfile

import numpy as np
import pandas as pd
import pytest
from broken_files import refused
from mounts_library_samples import campaign, mount

from deboom.errors import InputError
from deboom.files import tables
from deboom.files.disk import read_json
from deboom.files.limits import load_parts
from deboom.files.rows import MountRow
from deboom.files.run_folder import find_run, readable_runs
from deboom.files.tables import read_table, write_frame
from deboom.files.uff import UffFunction, read_uff, write_uff
from deboom.mounts.library import open_library
from deboom.runs.overview import refresh_overview
from deboom.runs.runner import load_study

STUDY = """'What is it?'
from dataclasses import dataclass
@dataclass(frozen=True)
class Options:
    {}
prepare = run = lambda *_: None
"""
MOUNTS = "mount,piece,x [m],y [m],z [m]\n"


def mounts(folder):
    return read_table(next(folder.iterdir()), MountRow)


def parts(folder):
    return load_parts(folder / "a.toml")


def again(folder):
    return read_json(folder / "a.json", "again")


def study(folder):
    return load_study(folder / "a.py")


def record(folder):
    return find_run(folder, "s", "r")


def workbook(rows):
    """Return an xlsx file of rows that no library had to hold."""
    memory = io.BytesIO()
    pd.DataFrame({"mount": ["a"]}).to_excel(memory, index=False)
    sheet = (
        '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
    )
    cells = "".join(f'<row r="{k}"><c><v>1</v></c></row>' for k in range(1, rows + 1))
    out = io.BytesIO()
    with zipfile.ZipFile(memory) as book, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for name in book.namelist():
            text = f"{sheet}{cells}</sheetData></worksheet>".encode()
            new.writestr(name, text if "sheet1.xml" in name else book.read(name))
    return out.getvalue()


def other_data_type(path):
    lines = np.arange(10.0, 20.0)
    write_uff(path, [UffFunction(lines, lines, 0, 1, "+x", ordinate_unit="1")], binary=True)
    lines = path.read_bytes().split(b"\n")
    place = next(k for k, line in enumerate(lines) if line.startswith(b"         4        10"))
    lines[place] = b"         7" + lines[place][10:]
    path.write_bytes(b"\n".join(lines))


CASES = [
    (mounts, "m.xlsx", workbook(2_001), "at most 2000 rows, 2000 columns"),
    (mounts, "m.csv", MOUNTS + "a,,1,1,1\n" * 2_001, "at most 2000 rows, 2000 columns"),
    (mounts, "m.csv", MOUNTS[:-1] + "," * 3000, "at most 2000 rows, 2000 columns"),
    (mounts, "m.csv", MOUNTS + f"a,,{'9' * 100_000},1,1\n", "999' is no finite number"),
    (mounts, "m.csv", MOUNTS + "a\0,,1,1,x\n", "line 2, column 'z': 'x' is no finite number"),
    (mounts, "m.csv", MOUNTS + "a,,428,1,1\n", "line 2: its position is up to 428 m, and none is"),
    (parts, "a.toml", "a = " + "[" * 5000 + "]" * 5000, "is nested too deeply: write it as"),
    (parts, "a.toml", "format = " + "1" * 5000, "is not TOML: Exceeds the limit"),
    (parts, "a.toml", f"format = 1\n{'x' * 100_000} = 1", "unknown key 'xxx"),
    (parts, "a.toml", 'format = 1\nx = "a\0"', "is not TOML: Illegal character"),
    (again, "a.json", '{"a":' * 200_000, "nested too deeply"),
    (again, "a.json", '{"a": NaN}', "NaN is no number"),
    (again, "a.json", f'{{"a": {"1" * 5000}}}', "is not JSON"),
    (record, "s/r/run.json", '{"study": "s", "arguments": 3}', "key 'arguments' in the top level"),
    (record, "s/r/run.json", '{"study": "s", "seed": "x"}', "key 'seed' in the top level is \"x\""),
    (record, "s/r/run.json", '{"study": "s", "files_sha256": {"a": 1}}', "key 'files_sha256' in"),
    (study, "a.py", b'"""\xff?"""', "is not UTF-8 text: save it"),
    (study, "a.py", '"""q?"""\na = 1\0', "is not Python (source code"),
    (study, "a.py", '"""q?"""\n1 / 0', "a.py line 2 cannot be imported"),
    (study, "a.py", '"""q?"""\n', "there is no Options"),
    (study, "a.py", STUDY.format("n: 'Nowhere' = 1"), "every option has a default and a type"),
    (study, "a.py", STUDY.format("n: int"), "option n has no default: give"),
    (
        lambda f: load_study(f / "a.py").report({}),
        "a.py",
        STUDY.format("seed: int = 1"),
        "returns no Report",
    ),
]


# a workbook holds the time of its making: in a test's name it would part the workers of a run
@pytest.mark.parametrize(
    ("read", "name", "content", "sentence"),
    CASES,
    ids=[f"{number}-{name}" for number, (_, name, _, _) in enumerate(CASES)],
)
def test_a_hard_case_ends_in_a_sentence(tmp_path, read, name, content, sentence, monkeypatch):
    monkeypatch.setattr(tables, "MOST_ROWS", 2_000)  # the same with less to write
    path = tmp_path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    refused(read, tmp_path, sentence)


def test_a_device_without_an_end_is_no_file(tmp_path):
    (tmp_path / "mounts.csv").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="is a device or a pipe: name a file on disk"):
        read_table(tmp_path / "mounts.csv", MountRow)


def test_a_uff_function_of_another_data_type_is_named(tmp_path):
    other_data_type(tmp_path / "a.uff")
    refused(lambda folder: read_uff(folder / "a.uff"), tmp_path, "a.uff: set 2 is damaged: its hea")


def test_a_damaged_record_ends_no_later_run(tmp_path, capsys):
    for name, text in (("r", '{"arguments": 3}'), ("q", json.dumps({"study": "s", "seed": 1}))):
        (tmp_path / "s" / name).mkdir(parents=True)
        (tmp_path / "s" / name / "run.json").write_text(text)
    (tmp_path / "s" / "q" / "summary.json").write_text("[1")
    runs, damaged = readable_runs(tmp_path)
    assert [run.name for run in runs] == ["q"]
    assert "key 'arguments'" in str(damaged[0])
    refresh_overview(tmp_path)
    assert "Traceback" not in capsys.readouterr().err


def test_texts_that_look_like_formulas_come_back_as_they_were(tmp_path):
    names = ["=1+1", "+cmd", "-cmd|' /C calc'!A0", "@sum", "'=x", "\tx", "Du left"]
    table = pd.DataFrame({"mount": names, "piece": "", **{f"{a} [m]": -1.5 for a in "xyz"}})
    write_frame(tmp_path / "mounts.csv", table)
    lines = (tmp_path / "mounts.csv").read_text().splitlines()[1:]
    assert not any(line[0] in '=+-@\t"' and line[:2] != "\"'" for line in lines)
    assert all(line.endswith(",-1.5,-1.5,-1.5") for line in lines)
    rows = read_table(tmp_path / "mounts.csv", MountRow)
    assert [row.mount for row in rows] == [name.strip() for name in names]
    signed = pd.DataFrame({"direction": ["+x", "-rz", "-", "-1.5", "+2e3"], "value": range(5)})
    write_frame(tmp_path / "a.csv", signed)
    text = (tmp_path / "a.csv").read_text()
    assert text == "direction,value\n+x,0\n-rz,1\n-,2\n-1.5,3\n+2e3,4\n"


def every_mount(path):
    with open_library(path) as library:
        return [library.load(identity) for identity in library.identities()]


def test_a_library_of_wrong_types_is_refused(tmp_path):
    with open_library(tmp_path / "m.db", create=True) as library:
        library.add([campaign()], [mount()])
    for value in (b"\0\1", "DELETE FROM mount", 3):
        copy = tmp_path / "copy.db"
        copy.write_bytes((tmp_path / "m.db").read_bytes())
        with sqlite3.connect(copy) as base:
            names = base.execute("SELECT name FROM sqlite_master WHERE type='table'").fetchall()
            for (table,) in names:
                for _, column, kind, *_ in base.execute(f"PRAGMA table_info({table})").fetchall():
                    if "CHAR" not in kind or value == b"\0\1":
                        try:
                            base.execute(f"UPDATE {table} SET {column} = ?", (value,))
                        except sqlite3.Error:
                            continue
        base.close()
        refused(lambda folder: every_mount(folder / "copy.db"), tmp_path, "copy.db")
