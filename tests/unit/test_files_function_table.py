"""Functions in tables: the same numbers from every format, and a sentence for what is none."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from deboom.errors import DataWarning, InputError
from deboom.files.function_table import (
    Dof,
    FunctionMatrix,
    frf_functions,
    is_table,
    read_function_table,
)
from deboom.files.uff import write_uff
from deboom.measurement.channels import Frf, Spectrum

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


@pytest.mark.parametrize("ending", ["csv", "xlsx", "mat"])
def test_a_line_at_0_hz_is_left_out_and_said(tmp_path, ending, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "LINES", LINES - 20.0)
    path = written(tmp_path, ending)
    with pytest.warns(DataWarning, match=f"functions.{ending}: the line at 0 Hz is left out"):
        table = read_function_table(path)
    assert table.frequency == pytest.approx(LINES[1:], rel=1e-12)
    assert table.spectrum(NAMES[1])[1] == pytest.approx(1e3 * VALUES[1:, 1], rel=1e-13)


WINDOWED = Frf(LINES, VALUES[:, :, None], ("A1 x", "A1 y"), ("I1",), "(m/s^2)/N", 2.5)
RESPONSES = (Dof("A1 x", 11, "+x"), Dof("A1 y", 11, "-y", sign=-1.0))
STRUCK = (Dof("I1", 21, "+z"),)


@pytest.mark.parametrize("rate", [2.5, 0.0])
def test_the_decay_of_an_exponential_window_travels_with_a_uff_file(tmp_path, rate):
    frf = replace(WINDOWED, added_decay_rate=rate)
    write_uff(tmp_path / "frf.uff", frf_functions(frf, RESPONSES, STRUCK), binary=True)
    matrix = FunctionMatrix(tmp_path / "frf.uff", "", (4,))
    back = matrix.frf(RESPONSES, STRUCK, "acceleration", "m/s^2/N", "(m/s^2)/N")
    assert back.added_decay_rate == rate
    np.testing.assert_array_equal(back.values, frf.values)
    assert (back.outputs, back.inputs, back.unit) == (frf.outputs, frf.inputs, frf.unit)


def test_unlike_windows_in_a_file_and_an_impossible_one_are_refused(tmp_path):
    first, other = frf_functions(WINDOWED, RESPONSES, STRUCK)
    matrix = FunctionMatrix(tmp_path, "", (4,), (first, replace(other, id_lines=())))
    with pytest.raises(InputError, match=r"added decay rate of 2\.5 1/s and .* 0 1/s"):
        _ = matrix.added_decay_rate
    wrong = replace(first, id_lines=("added decay rate -2 1/s",))
    with pytest.raises(InputError, match="is no rate"):
        _ = FunctionMatrix(tmp_path, "", (4,), (wrong,)).added_decay_rate
    with pytest.raises(InputError, match="'N' are not written"):
        frf_functions(replace(WINDOWED, unit="N"), RESPONSES, STRUCK)
    with pytest.raises(InputError, match="2 responses and 2 references do not fit"):
        frf_functions(WINDOWED, RESPONSES, STRUCK * 2)


@pytest.mark.parametrize("ending", ["csv", "xlsx", "mat"])
def test_a_table_states_the_decay_in_a_column(tmp_path, ending):
    path = tmp_path / f"windowed.{ending}"
    if ending == "mat":
        names = np.array([*NAMES, "added decay rate [1/s]"], dtype=object)
        values = np.column_stack([VALUES, np.full(7, 2.5)])
        savemat(path, variables(names=names, values=values, units=np.array(["N", "N", "1/s"])))
    else:
        frame = pd.DataFrame({**columns(), "added decay rate [1/s]": 2.5})
        frame.to_csv(path, index=False) if ending == "csv" else frame.to_excel(path, index=False)
    table = read_function_table(path)
    assert table.added_decay_rate == 2.5
    assert set(table.functions) == set(NAMES)
    assert WINDOWED.table["added decay rate [1/s]"].tolist() == [2.5] * 7
    if ending == "csv":
        frame["added decay rate [1/s]"] = np.arange(7.0)
        frame.to_csv(path, index=False)
        with pytest.raises(InputError, match="one number for all lines"):
            read_function_table(path)


def test_a_windowed_function_is_no_synthesis():
    with pytest.raises(InputError, match="peaks are too low"):
        WINDOWED @ Spectrum(LINES, VALUES[:, :1], ("I1",), "N")


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


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_structures_of_another_program_are_named_with_the_export_that_works(tmp_path, version):
    """A structure as Simcenter Testlab saves it does not say how its unit is converted."""
    path = tmp_path / "testlab.mat"
    lines = {"start_value": 20.0, "increment": 0.5, "number_of_values": 7.0}
    if version == "5":
        saved = {"function_record": {"name": "FRF"}, "x_values": lines}
        savemat(path, {"FRF_driver": saved | {"y_values": {"values": VALUES}}})
    else:
        with h5py.File(path, "w", userblock_size=512) as file:
            group = file.create_group("FRF_driver")
            group.attrs["MATLAB_class"] = np.bytes_("struct")
        with path.open("r+b") as stream:
            stream.write(b"MATLAB 7.3 MAT-file".ljust(512))
    with pytest.raises(InputError, match=r"FRF_driver: MATLAB structures.* export universal files"):
        read_function_table(path)


def function_matrix(folder, **changes):
    """One function of an accelerometer, as a UFF file holds it."""
    dof = Dof("A1 x", 1, "+x")
    function = replace(dof.function(LINES, VALUES[:, 0], 12, "acceleration", "m/s^2"), **changes)
    path = folder / "a.uff"
    write_uff(path, [function], binary=True)
    return FunctionMatrix(path, "", (12,)), [dof]


def test_real_functions_that_are_stored_as_complex_are_real(tmp_path):
    stored = VALUES[:, 0].real + 0j
    matrix, dofs = function_matrix(tmp_path, values=stored)
    read = matrix.values(dofs, ordinate="acceleration", unit="m/s^2", is_complex=False)
    np.testing.assert_array_equal(read[:, 0, 0], stored.real)
    assert read.dtype == np.float64
    stored[3] += 1e-9j
    matrix, dofs = function_matrix(tmp_path, values=stored)
    with pytest.raises(InputError, match="acceleration 'A1 x' is complex: export it as real"):
        matrix.values(dofs, ordinate="acceleration", unit="m/s^2", is_complex=False)


@pytest.mark.parametrize(("quantity", "code"), [("unknown", 0), ("general", 1)])
def test_a_function_without_a_quantity_is_told_the_codes(tmp_path, quantity, code):
    matrix, dofs = function_matrix(tmp_path, ordinate=quantity)
    sentence = (
        f"acceleration 'A1 x' (node 1 +x) is not in it: the data type of the ordinate there is "
        f"{code}, {quantity}; write 12, acceleration"
    )
    with pytest.raises(InputError, match=re.escape(sentence)):
        matrix.values(dofs, ordinate="acceleration", unit="m/s^2")


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
        (
            "frequency [Hz],a level [dB],a phase [deg]|20,3,4|21,3,4",
            "there are none; 'a level [dB]', 'a phase [deg]' are neither: export real and",
        ),
        (
            "frequency,a amplitude,a phase,b real,b imag|Hz,N,deg,N,N|20,3,4,1,1|21,3,4,1,1",
            "there are 'b'; 'a amplitude [N]', 'a phase [deg]' are neither: export real and",
        ),
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
