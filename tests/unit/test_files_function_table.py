"""Functions in tables: the same numbers from every format, and a sentence for what is none."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from deboom.errors import InputError
from deboom.files.function_table import is_table, read_function_table

LINES = 20.0 + 0.1 * np.arange(7)
VALUES = np.random.default_rng(2).normal(size=(7, 2)) + 1j * np.arange(14).reshape(7, 2)
HEADER = "frequency [Hz],a real [N],a imag [N]"
NAMES = ("TSM x", "Du left x force")


def columns(unit="kN"):
    table = {"frequency [Hz]": LINES}
    for name, values in zip(NAMES, VALUES.T, strict=True):
        table |= {f"{name} real [{unit}]": values.real, f"{name} imag [{unit}]": values.imag}
    return table


def variables(**changes):
    content = {
        "frequency": LINES[:, None],
        "names": np.array(NAMES, dtype=object),
        "values": VALUES,
        "units": "kN",
    }
    return {name: value for name, value in (content | changes).items() if value is not None}


def written(folder, ending):
    path = folder / f"functions.{ending}"
    if ending == "csv":
        pd.DataFrame(columns()).to_csv(path, index=False)
    elif ending == "xlsx":
        pd.DataFrame({"remark": "ok", **columns()}).to_excel(path, index=False)
    else:
        savemat(path, variables())
    return path


@pytest.mark.parametrize("ending", ["csv", "xlsx", "mat"])
def test_every_format_gives_the_same_functions_in_si(tmp_path, ending):
    path = written(tmp_path, ending)
    table = read_function_table(path)
    assert is_table(path)
    assert table.frequency == pytest.approx(LINES, rel=1e-14)
    for name, wanted in zip(NAMES, VALUES.T, strict=True):
        unit, values = table.spectrum(name)
        assert (unit.label, unit.si) == ("kN", "N")
        assert values == pytest.approx(1e3 * wanted, rel=1e-13)


def test_other_endings_are_uff():
    assert not any(is_table(path) for path in map(Path, ("a.uff", "a.unv", "a")))


def test_mat_files_may_hold_one_function_or_a_unit_per_name_or_a_char_matrix(tmp_path):
    path = tmp_path / "one.mat"
    savemat(path, variables(names="TSM x", values=VALUES[:, 0], units="N"))
    assert read_function_table(path).spectrum("TSM x")[1] == pytest.approx(VALUES[:, 0])
    units = np.array(["mm", "N"], dtype=object)
    savemat(path, variables(names=np.array(["TSM x", "Du x  "]), units=units))
    table = read_function_table(path)
    assert table.spectrum("TSM x")[1] == pytest.approx(1e-3 * VALUES[:, 0])
    assert table.spectrum("Du x")[0].si == "N"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"units": None}, "there is no variable 'units': save frequency [Hz], names"),
        ({"frequency": None, "names": None}, "there is no variable 'frequency', 'names'"),
        ({"values": VALUES.T}, "values of size 2 x 7 do not fit together"),
        ({"values": np.array(["a", "b"], dtype=object)}, "must be numbers"),
        ({"names": np.array(["a", "a"], dtype=object)}, "the name 'a' comes twice"),
        ({"frequency": LINES[::-1].copy()}, "that increase: line 2 is 20.5 Hz"),
        ({"frequency": np.where(LINES > 20.3, np.nan, LINES)}, "line 5 is nan Hz"),
    ],
)
def test_a_wrong_mat_file_is_refused(tmp_path, changes, sentence):
    path = tmp_path / "wrong.mat"
    savemat(path, variables(**changes))
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        read_function_table(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF", "of version 7.3"),
        (b"no MATLAB file at all", "is damaged, or no MATLAB file"),
    ],
)
def test_what_is_no_mat_file_is_refused(tmp_path, data, sentence):
    path = tmp_path / "wrong.mat"
    path.write_bytes(data)
    with pytest.raises(InputError, match=re.escape(sentence)):
        read_function_table(path)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("f [Hz],a real [N],a imag [N]|20,1,2", "there is no column 'frequency [Hz]'"),
        ("frequency [Hz]:a real [N]|20:1", "add it, columns separated by commas"),
        ("frequency [Hz],a real [N],a real [N]|20,1,2", "column 'a real [N]' comes twice"),
        (f"{HEADER}|x,1,2", "line 2, column 'frequency [Hz]': 'x'"),
        (f"{HEADER}|20,1,2", "two lines or more"),
        (HEADER, "has a header and no rows"),
        ("frequency [Hz],a real [N]|20,1|21,2|,", "no column 'a imag [unit]'"),
        (HEADER.replace("g [N", "g [kN") + "|20,1,2|21,3,4", "one unit in brackets, the same"),
        (f"{HEADER}|20,x,2|21,3,1e999", "or)\nline 3, column 'a imag [N]': '1e999'"),
        (HEADER.replace("N", "parsec") + "|20,1,2|21,3,4", "unknown unit 'parsec'"),
        (HEADER.replace(",a", ",b") + "|20,1,2|21,3,4", "no function 'a': add it, with real and"),
    ],
)
def test_a_wrong_table_or_function_is_refused(tmp_path, text, sentence):
    path = tmp_path / "wrong.csv"
    path.write_text(text.replace("|", "\n") + "\n")
    with pytest.raises(InputError, match=re.escape(sentence)):
        read_function_table(path).spectrum("a")


def test_a_value_that_is_not_finite_is_named_by_its_line(tmp_path):
    path = tmp_path / "gap.mat"
    savemat(path, variables(values=np.where(np.arange(14).reshape(7, 2) == 4, np.nan, VALUES)))
    table = read_function_table(path)
    table.spectrum(NAMES[1])
    with pytest.raises(InputError, match=r"line 3 is .*nan.*does not fill gaps"):
        table.spectrum(NAMES[0])


@pytest.mark.parametrize("ending", ["csv", "xlsx"])
def test_functions_below_a_title_and_beside_remarks(tmp_path, ending):
    """Lines are counted as the file does, and a decimal comma may be text of a sheet."""
    rows = [["Wagon, run 3"], [*columns(), "remark"]]
    rows += [[*map(float, each), "ok"] for each in zip(*columns().values(), strict=True)]
    rows.insert(4, ["# repeated from here on"])
    path = tmp_path / f"functions.{ending}"
    width = len(rows[1])
    frame = pd.DataFrame([row + [""] * (width - len(row)) for row in rows], dtype=object)
    if ending == "csv":
        frame.to_csv(path, index=False, header=False)
    else:
        text = frame.map(
            lambda cell: str(cell).replace(".", ",") if isinstance(cell, float) else cell
        )
        text.to_excel(path, index=False, header=False)
    table = read_function_table(path)
    assert table.frequency == pytest.approx(LINES, rel=1e-14)
    for name, wanted in zip(NAMES, VALUES.T, strict=True):
        assert table.spectrum(name)[1] == pytest.approx(1e3 * wanted, rel=1e-13)
    frame.iloc[6, 1] = "x"
    frame.to_csv(tmp_path / "wrong.csv", index=False, header=False)
    with pytest.raises(InputError, match=r"line 7, column 'TSM x real \[kN\]': 'x' is no finite"):
        read_function_table(tmp_path / "wrong.csv").spectrum("TSM x")
