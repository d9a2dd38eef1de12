import re
import tracemalloc
from dataclasses import fields, replace

import numpy as np
import pytest
import pyuff
from hypothesis import given, settings
from hypothesis import strategies as st

from deboom.errors import InputError
from deboom.files import uff
from deboom.files.uff import DIRECTIONS, AxisDriftWarning, UffFunction, read_uff, set_58, write_uff

LINES = 20.0 + 0.25 * np.arange(9)


def spectrum(**changes):
    values = np.exp(0.3j * np.arange(LINES.size)) * np.linspace(1e-7, 3.0, LINES.size)
    function = UffFunction(LINES, values, 0, 11, "+x", ordinate="force", ordinate_unit="N")
    texts = {"id_lines": ("order 1.5 at a virtual point", "bench 1"), "response_name": "EnM"}
    return replace(function, **texts | changes)


def transfer_function(**changes):
    quantities = {"ordinate": "pressure", "ordinate_unit": "Pa"}
    quantities |= {"denominator": "force", "denominator_unit": "N", "function_type": 4}
    response = {"response_node": 901, "response_direction": "scalar", "response_name": "ear"}
    reference = {"reference_node": 11, "reference_direction": "-z", "reference_name": "EnM"}
    return spectrum(**quantities | response | reference | changes)


def edit(path, old, new, count=1):
    text = path.read_bytes()
    assert text.count(old) >= 1
    path.write_bytes(text.replace(old, new, count))


def same(a, b, rtol=0.0):
    np.testing.assert_array_equal(a.abscissa, b.abscissa)
    np.testing.assert_allclose(b.values, a.values, rtol=rtol, atol=0)
    for field in fields(a):
        if field.name not in ("abscissa", "values", "file_unit"):
            assert getattr(a, field.name) == getattr(b, field.name), field.name


# ---- round trips


@pytest.mark.parametrize("binary", [False, True])
def test_what_is_written_reads_back(tmp_path, binary):
    given_functions = [spectrum(), transfer_function(), spectrum(values=LINES**2, response_node=12)]
    given_functions += [spectrum(function_type=kind, response_node=kind) for kind in (12, 27)]
    given_functions += [spectrum(function_type=1, abscissa_quantity="")]
    write_uff(tmp_path / "a.uff", given_functions, binary=binary)
    read = read_uff(tmp_path / "a.uff")
    for a, b in zip(given_functions, read, strict=True):
        same(a, b, rtol=0 if binary else 5e-12)
    assert [f.unit for f in read] == ["N", "Pa/N", "N", "N", "N", "N"]
    assert [f.function_type for f in read[3:]] == [12, 27, 1]
    assert [f.abscissa_quantity for f in read] == ["frequency"] * 5 + ["time"]
    assert read[2].values.dtype == np.float64


@pytest.mark.parametrize("direction", DIRECTIONS.values())
def test_every_direction_round_trips(tmp_path, direction):
    unit = "rad" if "r" in direction and direction != "scalar" else "m"
    function = spectrum(response_direction=direction, ordinate="displacement", ordinate_unit=unit)
    write_uff(tmp_path / "a.uff", [function])
    same(function, read_uff(tmp_path / "a.uff")[0], rtol=5e-12)


def test_an_uneven_abscissa_round_trips_in_ascii_and_is_refused_in_binary(tmp_path):
    uneven = np.array([10.0, 12.5, 16.0, 20.0, 25.0, 31.5, 40.0, 50.0, 63.0])
    for values in (np.arange(9.0), np.arange(9) * (1 + 2j)):
        function = spectrum(abscissa=uneven, values=values)
        write_uff(tmp_path / "a.uff", [function])
        same(function, read_uff(tmp_path / "a.uff")[0], rtol=5e-12)
    with pytest.raises(InputError, match=r"b\.uff: node 11 \+x force: an uneven .*write ASCII"):
        write_uff(tmp_path / "b.uff", [function], binary=True)
    assert not (tmp_path / "b.uff").exists()


@settings(max_examples=25, deadline=None)
@given(
    values=st.lists(
        st.complex_numbers(max_magnitude=1e30, allow_nan=False, allow_infinity=False),
        min_size=2,
        max_size=11,
    ),
    node=st.integers(0, 2**31 - 1),
    name=st.from_regex(r"\A[A-Za-z][A-Za-z0-9 _+\-]{0,8}[A-Za-z0-9]\Z").filter("NONE".__ne__),
    line=st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=80).filter(
        "NONE".__ne__
    ),
    binary=st.booleans(),
)
def test_any_function_round_trips(tmp_path_factory, values, node, name, line, binary):
    path = tmp_path_factory.mktemp("uff") / "a.uff"
    function = spectrum(
        abscissa=20.0 + np.arange(len(values)),
        values=np.array(values),
        response_node=node,
        response_name=name,
        id_lines=(line,),
    )
    write_uff(path, [function], binary=binary)
    (read,) = read_uff(path)
    scale = np.max(np.abs(np.array(values)))
    np.testing.assert_allclose(read.values, function.values, rtol=1e-11, atol=1e-11 * scale)
    assert (read.response_node, read.response_name) == (node, name)
    assert read.id_lines[0] == line


def test_a_failed_writing_keeps_the_old_file_and_a_good_one_replaces_it(tmp_path):
    path = tmp_path / "a.uff"
    path.write_text("old")
    with pytest.raises(InputError):
        write_uff(path, [spectrum(), spectrum(response_name="longer than ten")])
    assert path.read_text() == "old"
    write_uff(path, [spectrum()])
    assert len(read_uff(path)) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["a.uff"]


def test_a_file_that_does_not_read_back_as_it_was_given_never_appears(tmp_path, monkeypatch):
    def shifted(function, binary):
        return {**set_58(function, binary), "rsp_node": 0}

    monkeypatch.setattr(uff, "set_58", shifted)
    with pytest.raises(InputError, match="rsp_node 11 reads back as 0; nothing was written"):
        write_uff(tmp_path / "a.uff", [spectrum()])
    monkeypatch.setattr(uff, "set_58", lambda *_: {"type": 999})
    with pytest.raises(InputError, match=r"the sets read back as \[164\]; nothing was written"):
        write_uff(tmp_path / "a.uff", [spectrum()])
    assert list(tmp_path.iterdir()) == []


# ---- refused on writing


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"response_name": "Wheel hub L"}, "'Wheel hub L' does not fit its field of 10"),
        ({"reference_name": "Zylinderkopf"}, "'Zylinderkopf' does not fit its field of 10"),
        ({"response_name": "Rä"}, "plain ASCII"),
        ({"id_lines": ("x" * 81,)}, "does not fit its field of 80"),
        ({"id_lines": ("two\nlines",)}, "does not fit its field of 80"),
        ({"id_lines": ("    -1",)}, "would not read back"),
        ({"id_lines": ("NONE",)}, "would not read back"),
        ({"ordinate_unit": ""}, "force is in no unit; convert it to N"),
        ({"ordinate_unit": "kN"}, "force is in kN; convert it to N"),
        ({"response_direction": "+rx"}, "force is in N; convert it to N m"),
        ({"ordinate": "displacement", "ordinate_unit": "mm"}, "is in mm; convert it to m"),
        ({"ordinate": "unknown", "ordinate_unit": ""}, "unknown has no unit; write '1'"),
        ({"ordinate": "loudness"}, "unknown quantity 'loudness'"),
        ({"denominator_unit": "N"}, "unit 'N' of a denominator that is 'none'"),
        ({"function_type": 8}, "function type 8 cannot be written"),
        ({"response_node": -1}, "node -1 is not between 0"),
        ({"reference_node": 2**31}, "node 2147483648 is not between 0"),
    ],
)
def test_what_would_not_read_back_is_refused(tmp_path, changes, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        write_uff(tmp_path / "a.uff", [spectrum(**changes)])
    assert str(tmp_path / "a.uff") in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"values": np.ones(8)}, "one equal length of at least 2"),
        ({"values": np.ones(1), "abscissa": np.ones(1)}, "one equal length of at least 2"),
        ({"abscissa": np.array([1.0, 2.0, 2.0]), "values": np.ones(3)}, "does not increase after"),
        ({"response_direction": "x"}, "unknown direction 'x'"),
        ({"id_lines": ("a",) * 6}, "6 ID lines"),
        *(
            ({"values": np.where(np.arange(9) == 4, bad, 1)}, "+x force: the value of line 5 is")
            for bad in (np.nan, np.inf, -np.inf, 1j * np.nan)
        ),
    ],
)
def test_what_is_no_function_is_refused(changes, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        spectrum(**changes)


def test_a_function_owns_its_arrays():
    values = np.ones(9)
    function = spectrum(values=values)
    values[0] = 7.0
    assert function.values[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        function.values[0] = 2.0


def test_no_function_and_no_folder_are_refused(tmp_path):
    with pytest.raises(InputError, match="no function to write"):
        write_uff(tmp_path / "a.uff", [])
    with pytest.raises(InputError, match=r"absent.a\.uff cannot be written"):
        write_uff(tmp_path / "absent" / "a.uff", [spectrum()])


def test_a_small_drift_of_the_axis_warns_and_a_large_one_is_refused(tmp_path):
    # a third of a hertz keeps 6 digits: 0.333333, short by 3.3e-7 Hz per line
    thirds = spectrum(abscissa=20 + np.arange(121) / 3, values=np.ones(121, dtype=complex))
    with pytest.warns(AxisDriftWarning, match=r"errs by 4e-05, 0\.00012 of a line spacing"):
        write_uff(tmp_path / "a.uff", [thirds])
    n = 60_001
    fine = spectrum(abscissa=np.arange(n) / 3, values=np.ones(n))
    with pytest.raises(InputError, match=r"0\.06 of a line spacing \(bound 0\.05\); choose a step"):
        write_uff(tmp_path / "b.uff", [fine])
    assert not (tmp_path / "b.uff").exists()


def test_a_time_axis_is_judged_by_its_phase(tmp_path):
    def record(seconds):
        n = int(seconds * 51_200)
        return spectrum(
            abscissa=np.arange(n) / 51_200,
            values=np.zeros(n),
            function_type=1,
            abscissa_quantity="time",
        )

    with pytest.warns(AxisDriftWarning, match=r"0\.129 deg at 140 Hz \(bound 1 deg\)"):
        write_uff(tmp_path / "a.uff", [record(1.0)], binary=True)
    with pytest.raises(InputError, match=r"1\.\d+ deg at 140 Hz \(bound 1 deg\)"):
        write_uff(tmp_path / "b.uff", [record(10.0)], binary=True)


# ---- refused on reading


def test_missing_empty_and_foreign_files_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"no\.uff cannot be read \(No such file"):
        read_uff(tmp_path / "no.uff")
    for content, sentence in (
        (b"", "is empty"),
        (b" \n", "is empty"),
        (b"frequency;pressure\n20;1\n", "is not a UFF file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(200), "is not a UFF file"),
        (b"    -1\n    -1\n", "set 1 states no type"),
        (b"    -1\nnot a number\n    -1\n", "set 1 states no type"),
        (b"    -1\n    58\ntoo short\n    -1\n", "set 1 is damaged"),
        (b"    -1\n    15\n    -1\n", "holds no function (data set 58), only sets 15"),
    ):
        (tmp_path / "a.uff").write_bytes(content)
        with pytest.raises(InputError, match=re.escape(sentence)) as caught:
            read_uff(tmp_path / "a.uff")
        assert "a.uff" in str(caught.value)


@pytest.mark.parametrize("binary", [False, True])
def test_a_file_cut_anywhere_is_refused_or_lacks_whole_functions(tmp_path, binary):
    whole, cut = tmp_path / "whole.uff", tmp_path / "cut.uff"
    functions = [spectrum(response_node=node) for node in (11, 12, 13)]
    write_uff(whole, functions, binary=binary)
    data = whole.read_bytes()
    n_read = set()
    for end in range(0, len(data), 7):
        cut.write_bytes(data[:end])
        try:
            read = read_uff(cut)
        except InputError:
            continue
        n_read.add(len(read))
        for function, original in zip(read, functions, strict=False):
            same(original, function, rtol=5e-12)
    assert n_read <= {1, 2, 3}


# ---- what one edit of a file does


FORCE_LABEL = b"force                N   "


@pytest.fixture
def newtons(tmp_path):
    path = tmp_path / "a.uff"
    write_uff(path, [spectrum(values=np.full(9, 2.0 + 0j))])
    return path


def without_units(path):
    """Take out data set 164, as most vendors leave it."""
    data = path.read_bytes()
    path.write_bytes(data[data.index(b"    -1\n    58") :])


def scaled_units(length, force):
    return b"   1.0000000000000000D+00" * 2, b"%25.16E%25.16E" % (length, force)


NUMBER = b"   2.00000000000e+00"
NO_LABEL = (FORCE_LABEL, b"force                NONE")
KILO = (FORCE_LABEL, b"force                kN  ")


@pytest.mark.parametrize(
    ("edits", "sentence"),
    [
        ([(b"\n         6         9", b"\n         6        10")], "10 values are announced and 9"),
        ([(b"\n         6         9", b"\n         6         8")], "set 2: node 11 +x: 8"),
        ([(NUMBER, b"NaN".rjust(20))], "a.uff: set 2: node 11 +x force: the value of line 1"),
        ([(NUMBER, b"Infinity".rjust(20))], "set 2: node 11 +x force: the value of line 1"),
        ([(NUMBER, b"1.0e+400".rjust(20))], "set 2: node 11 +x force: the value of line 1"),
        ([(NUMBER, b"twice".rjust(20))], "set 2 is damaged"),
        ([(b"        11   1", b"        11   9")], "direction 9 is not a UFF direction"),
        (
            [scaled_units(1e3, 1e-3)],
            "force is labelled 'N', 1 N, but data set 164 makes it 1000 N: correct",
        ),
        ([scaled_units(1e3, 1e-3), NO_LABEL], "no unit label and data set 164 is not SI; export"),
        ([scaled_units(0.0, 1.0)], "states length 0.0"),
        ([without_units, (FORCE_LABEL, b"force                mm  ")], "labelled 'mm', which is"),
    ],
)
def test_what_one_edit_makes_wrong_is_refused(newtons, edits, sentence):
    make(newtons, edits)
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        read_uff(newtons)
    assert str(caught.value).startswith(str(newtons))


@pytest.mark.parametrize(
    ("edits", "unit", "file_unit", "value"),
    [
        ([without_units, KILO], "N", "kN", 2000.0),
        ([without_units, NO_LABEL], "", "", 2.0),
        ([NO_LABEL], "N", "N", 2.0),
        ([scaled_units(1e3, 1e-3), KILO], "N", "kN", 2000.0),
        ([without_units, (FORCE_LABEL, b"force                lbf ")], "N", "lbf", 8.896443230521),
    ],
)
def test_units_come_from_the_label_or_from_164(newtons, edits, unit, file_unit, value):
    make(newtons, edits)
    (read,) = read_uff(newtons)
    assert (read.ordinate_unit, read.file_unit, read.unit) == (unit, file_unit, unit)
    np.testing.assert_allclose(read.values, value)


def test_units_of_164_scale_as_length_and_force_do():
    turning = "displacement +rx 2 2, velocity +rx 2 2, acceleration -rz 2 2, force +rx 2 0.5"
    for case in f"{turning}, force +x 2 1, pressure scalar 2 4, mass +x 2 2".split(", "):
        quantity, direction, *scale = case.split()
        assert uff._unit(case, quantity, "", direction, tuple(map(float, scale))).factor == 1.0


def make(path, edits):
    for change in edits:
        change(path) if callable(change) else edit(path, *change)


def test_two_different_164_are_refused(newtons):
    data = newtons.read_bytes()
    edit(newtons, *scaled_units(1000.0, 1.0))
    newtons.write_bytes(data + newtons.read_bytes())
    with pytest.raises(InputError, match="data sets 164 state different units"):
        read_uff(newtons)


# ---- layouts that other programs write


def padded_row(last):
    """Five complex values in rows of three, the last row filled up."""
    values = np.array([1 + 2j, 3 - 4j, -5 + 6j, 7j, 8.5])
    numbers = [part for value in [*values, last] for part in (value.real, value.imag)]
    rows = ["".join(f"{number:13.5e}" for number in numbers[k : k + 6]) for k in (0, 6)]
    return values, rows


@pytest.mark.parametrize("last", [0j, 8.5 + 0j])
def test_a_last_row_filled_up_holds_the_announced_values(tmp_path, last):
    """Programs fill it up with zeros, or repeat its last value."""
    path = tmp_path / "a.uff"
    values, rows = padded_row(last)
    write_uff(path, [spectrum()])
    rewritten(path, rows=rows, n_points=5)
    (read,) = read_uff(path)
    np.testing.assert_allclose(read.values, values)
    np.testing.assert_allclose(read.abscissa, LINES[:5])


def test_a_last_row_filled_up_with_other_values_is_refused(tmp_path):
    path = tmp_path / "a.uff"
    write_uff(path, [spectrum()])
    rewritten(path, rows=padded_row(8.4 + 0j)[1], n_points=5)
    with pytest.raises(InputError, match="5 values are announced and 6 are there"):
        read_uff(path)


def with_names(path, name="", node=11, reference="", reference_node=0):
    """Exchange the record of names and nodes by one whose names are as long as they are."""
    lines = path.read_text().split("\n")
    place = next(k for k, line in enumerate(lines) if line.endswith("0   0"))
    lines[place] = f"{4:5}{0:10}{1:5}{0:10} {name:10}{node:10}{1:4} {reference:10}"
    lines[place] += f"{reference_node:10}{1 if reference_node else 0:4}"
    path.write_text("\n".join(lines))


@pytest.mark.parametrize(
    ("record", "told"),
    [
        ({"name": "engine mou"}, ""),
        ({"node": 1234567890, "name": "engine mou"}, ""),
        ({"name": "engine moun"}, "response"),
        ({"name": "channel0001"}, "response"),
        ({"name": "channel0001", "node": 7}, "response"),
        ({"name": "engine mount 1", "node": 7}, "response"),
        ({"reference": "channel0001", "reference_node": 7}, "reference"),
        ({"reference": "channel0001"}, "reference"),
    ],
)
def test_a_name_that_moves_node_and_direction_is_refused(tmp_path, record, told):
    path = tmp_path / "a.uff"
    write_uff(path, [spectrum()])
    with_names(path, **record)
    if not told:
        (read,) = read_uff(path)
        assert (read.response_name, read.response_node) == ("engine mou", record.get("node", 11))
        return
    sentence = f"a.uff: set 2: node and direction of its {told} do not stand in their columns beh"
    with pytest.raises(InputError, match=sentence):
        read_uff(path)


def test_a_header_longer_than_headers_are_is_read_as_before(tmp_path):
    write_uff(tmp_path / "a.uff", [spectrum()])
    edit(tmp_path / "a.uff", b"bench 1", b"b" * 9000)
    (read,) = read_uff(tmp_path / "a.uff")
    assert (read.id_lines[1], read.response_node) == ("b" * 80, 11)


@pytest.mark.parametrize("code", ["cp1252", "utf-8"])
@pytest.mark.parametrize("binary", [False, True])
def test_texts_of_windows_are_read(tmp_path, code, binary):
    path = tmp_path / "a.uff"
    function = spectrum(ordinate="acceleration", ordinate_unit="m/s^2")
    write_uff(path, [function], binary=binary)
    without_units(path)
    edit(path, b"m/s^2 ", "mm/s² ".encode(code))
    edit(path, b"bench 1", "Prüfst. 1".encode(code))
    edit(path, b"   EnM", "Träger".encode(code))
    (read,) = read_uff(path)
    np.testing.assert_allclose(read.values, 1e-3 * function.values, rtol=1e-11)
    assert (read.ordinate_unit, read.file_unit) == ("m/s^2", "mm/s²")
    assert (read.id_lines[1], read.response_name) == ("Prüfst. 1", "Träger")


def rewritten(path, *, rows, n_points):
    """Exchange the numbers of an ASCII function for single-precision rows."""
    lines = path.read_text().split("\n")
    begin = next(k for k, line in enumerate(lines) if line.startswith("         6         9"))
    spacing = "         1" + lines[begin][30:]
    lines[begin] = f"{5:10d}{n_points:10d}{spacing}"
    path.write_text("\n".join([*lines[: begin + 5], *rows, "    -1", ""]))


@pytest.mark.parametrize("values", [np.exp(1j * LINES), np.sin(LINES)])
@pytest.mark.parametrize("exponent", ["e", "E", "D"])
@pytest.mark.parametrize("width", [0, 80])
def test_rows_as_fortran_writes_them_are_read(tmp_path, values, exponent, width):
    """Double precision in records of 80 columns, the last one filled up with blanks."""
    path = tmp_path / "a.uff"
    write_uff(path, [spectrum(values=values)])
    lines = path.read_text().split("\n")
    begin = (
        next(
            k
            for k, line in enumerate(lines)
            if line.startswith("         6  " if np.iscomplexobj(values) else "         4  ")
        )
        + 5
    )
    for k in range(begin, len(lines) - 2):
        lines[k] = lines[k].replace("e", exponent).ljust(width)
    path.write_text("\n".join(lines))
    np.testing.assert_allclose(read_uff(path)[0].values, values, rtol=1e-11)


@pytest.mark.parametrize(("n_points", "n_written"), [(7, 6), (3, 6), (2, 6)])
def test_more_than_a_row_of_zeros_is_refused(tmp_path, n_points, n_written):
    path = tmp_path / "a.uff"
    write_uff(path, [spectrum()])
    rewritten(path, rows=padded_row(0j)[1], n_points=n_points)
    with pytest.raises(
        InputError, match=f"{n_points} values are announced and {n_written} are there"
    ):
        read_uff(path)


NODES_OF_COLOUR_MINUS_ONE = b"""    -1
  2411
         1         1         1        -1
   1.0000000000000000E+00   2.0000000000000000E+00   3.0000000000000000E+00
         2         1         1        -1
   4.0000000000000000E+00   5.0000000000000000E+00   6.0000000000000000E+00
    -1
    -1
    82
         1         3        -1
NONE
         1         2         0
    -1
"""


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("ends", [b"\n", b"\r\n"])
def test_a_row_that_ends_in_minus_one_is_no_separator(tmp_path, binary, ends):
    path = tmp_path / "a.uff"
    function = spectrum(id_lines=("drift of channel 3     -1",))
    write_uff(path, [function], binary=binary)
    data = NODES_OF_COLOUR_MINUS_ONE + path.read_bytes()
    path.write_bytes(data if binary else data.replace(b"\n", ends))
    (read,) = read_uff(path)
    same(function, read, rtol=0 if binary else 5e-12)


def numbers_like_separators(places):
    """Values of which some have the bytes of a separator."""
    values = np.linspace(1.0, 2.0, 9)
    values[places] = np.frombuffer(b"    -1\r\n", dtype=np.float64)
    return values


@pytest.mark.parametrize(
    ("announced", "places"), [(72, slice(0, 9)), (36, [4]), (0, [2, 4]), (5000, [4, 6])]
)
def test_binary_numbers_may_hold_the_bytes_of_a_separator(tmp_path, announced, places):
    path = tmp_path / "a.uff"
    values = numbers_like_separators(places)
    functions = [spectrum(values=values), spectrum(response_node=12)]
    write_uff(path, functions, binary=True)
    edit(path, b"%12d" % 72, b"%12d" % announced)
    read = read_uff(path)
    assert len(read) == 2
    np.testing.assert_array_equal(read[0].values, values)
    np.testing.assert_array_equal(read[1].values, functions[1].values)


@pytest.mark.parametrize(
    ("label", "outcome"),
    [
        (b"hz", 1.0),
        (b"1/s", 1.0),
        (b"kHz", 1e3),
        (b"rpm", "its frequency is labelled 'rpm': export it in Hz"),
        (b"line", "its frequency is labelled 'line': export it in Hz"),
    ],
)
def test_a_frequency_is_in_the_unit_of_its_label(tmp_path, label, outcome):
    path = tmp_path / "a.uff"
    write_uff(path, [spectrum()])
    edit(path, b"frequency            Hz  ", b"frequency            %-4s" % label)
    if isinstance(outcome, str):
        with pytest.raises(InputError, match=re.escape(outcome)):
            read_uff(path)
    else:
        np.testing.assert_allclose(read_uff(path)[0].abscissa, outcome * LINES)


WHOLE_LABEL = b"pressure             %-20s"


@pytest.mark.parametrize(
    ("above", "below", "factor"),
    [
        (b"Pa/N", b"NONE", 1.0),
        (b"Pa/N", b"N", 1.0),
        (b"(Pa)/(kN)", b"NONE", 1e-3),
        (b"kPa/lbf", b"lbf", 1e3 / 4.4482216152605),
    ],
)
def test_an_ordinate_label_may_name_the_denominator(tmp_path, above, below, factor):
    path = tmp_path / "a.uff"
    write_uff(path, [transfer_function()])
    without_units(path)
    edit(path, WHOLE_LABEL % b"Pa", WHOLE_LABEL % above)
    edit(path, b"force                N   ", b"force                %-4s" % below)
    (read,) = read_uff(path)
    assert (read.unit, read.denominator_unit) == ("Pa/N", "N")
    np.testing.assert_allclose(read.values, factor * transfer_function().values, rtol=1e-10)


def test_an_ordinate_label_may_name_a_denominator_without_a_quantity(tmp_path):
    path = tmp_path / "a.uff"
    write_uff(path, [transfer_function()])
    without_units(path)
    edit(path, WHOLE_LABEL % b"Pa", WHOLE_LABEL % b"kPa/N")
    edit(
        path,
        b"        13    0    0    0 force                N   ",
        b"         0    0    0    0 NONE                 NONE",
    )
    (read,) = read_uff(path)
    assert (read.unit, read.denominator, read.file_unit) == ("Pa/N", "unknown", "kPa/N")
    np.testing.assert_allclose(read.values, 1e3 * transfer_function().values, rtol=1e-10)


def test_two_labels_of_one_denominator_that_differ_are_refused(tmp_path):
    path = tmp_path / "a.uff"
    write_uff(path, [transfer_function()])
    without_units(path)
    edit(path, WHOLE_LABEL % b"Pa", WHOLE_LABEL % b"Pa/N")
    edit(path, b"force                N ", b"force                kN")
    with pytest.raises(InputError, match="pressure is labelled 'Pa/N', which is no unit of it"):
        read_uff(path)


def test_g_beside_a_data_set_164_in_si_is_refused_with_both_meanings(tmp_path):
    path = tmp_path / "a.uff"
    write_uff(path, [spectrum(ordinate="acceleration", ordinate_unit="m/s^2")])
    edit(path, b"acceleration         m/s^2", b"acceleration         g    ")
    sentence = "labelled 'g', 9.80665 m/s^2, but data set 164 makes it 1 m/s^2: correct the label"
    with pytest.raises(InputError, match=re.escape(sentence)):
        read_uff(path)
    without_units(path)
    (read,) = read_uff(path)
    np.testing.assert_allclose(read.values, 9.80665 * spectrum().values, rtol=1e-11)


def stored_as(path, values, kind, code):
    """Replace the numbers of every binary set by others of another type."""
    begin, *sets = path.read_bytes().split(b"    58b")
    body, order = values.astype(kind), 2 if kind[0] == ">" else 1
    for place, text in enumerate(sets):
        lines = text.split(b"\n", 12)
        lines[0] = b"%6d%6d%12d%12d" % (order, 2, 11, body.nbytes)
        lines[7] = b"%10d" % code + lines[7][10:]
        next_set = b"    -1\n" if place < len(sets) - 1 else b""
        sets[place] = b"\n".join((*lines[:12], body.tobytes(), b"    -1", next_set))
    path.write_bytes(b"    58b".join((begin, *sets)))


@pytest.mark.parametrize(
    ("binary", "stored", "n_lines", "most"),
    [
        (True, ("<f8", 4), 2**15, 1.2),
        (True, ("<f4", 2), 2**16, 1.2),
        (True, ("<c8", 5), 2**15, 1.2),
        (True, ("<c16", 6), 2**14, 1.2),
        (False, ("<f8", 4), 2**12, 1.0),
    ],
    ids=["58b", "58b single", "58b complex single", "58b complex", "58"],
)
def test_reading_takes_little_more_memory_than_the_file(tmp_path, binary, stored, n_lines, most):
    """Sixteen signals: numbers once as the file has them, the common abscissa once."""
    path = tmp_path / "long.uff"
    time = 2.5e-4 * np.arange(n_lines)
    values = np.random.default_rng(1).normal(size=n_lines)
    if "c" in stored[0]:
        values = values + 1j * values[::-1]
    values = values.astype(stored[0])
    acceleration = {"ordinate": "acceleration", "ordinate_unit": "m/s^2"}
    signals = [UffFunction(time, values, 1, node, "+x", **acceleration) for node in range(1, 17)]
    write_uff(path, signals, binary=binary)
    if binary:
        stored_as(path, values, *stored)
    tracemalloc.start()
    read = read_uff(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < most * path.stat().st_size
    assert all(function.abscissa is read[0].abscissa for function in read)
    assert read[-1].values.dtype in (np.float64, np.complex128)
    np.testing.assert_allclose(read[-1].values, values, rtol=0, atol=1e-11)


def test_single_precision_in_g_is_converted_within_its_digits(tmp_path):
    path = tmp_path / "a.uff"
    acceleration = {"ordinate": "acceleration", "ordinate_unit": "m/s^2"}
    write_uff(path, [spectrum(**acceleration)], binary=True)
    stored_as(path, spectrum().values, "<c8", 5)
    edit(path, b"m/s^2", b"g    ")
    without_units(path)
    (read,) = read_uff(path)
    assert read.values.dtype == np.complex128
    np.testing.assert_allclose(read.values, 9.80665 * spectrum().values, rtol=3e-7)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("kind", "code"), [("f4", 2), ("f8", 4), ("c8", 5), ("c16", 6)])
def test_binary_numbers_are_those_of_pyuff(tmp_path, order, kind, code):
    """Every precision and byte order, against pyuff's own reading of the same bytes."""
    path = tmp_path / "a.uff"
    write_uff(path, [spectrum()], binary=True)
    values = spectrum().values if "c" in kind else spectrum().values.real
    stored_as(path, values, order + kind, code)
    (read,) = read_uff(path)
    theirs = pyuff.UFF(str(path)).read_sets(1)
    np.testing.assert_array_equal(read.values, theirs["data"])
    np.testing.assert_allclose(read.abscissa, LINES)


@pytest.mark.parametrize(("kind", "code"), [("f4", 2), ("f8", 4), ("f4", 5), ("f8", 6)])
def test_an_uneven_abscissa_stands_before_each_binary_value(tmp_path, kind, code):
    path = tmp_path / "a.uff"
    values = spectrum().values if code in (5, 6) else spectrum().values.real
    parts = [values.real, values.imag] if code in (5, 6) else [values]
    uneven = 0.5 * LINES**1.5
    write_uff(path, [spectrum()], binary=True)
    stored_as(path, np.column_stack([uneven, *parts]), f"<{kind}", code)
    before = b"%10d%10d%10d" % (code, LINES.size, 1)
    edit(path, before, b"%10d%10d%10d" % (code, LINES.size, 0))
    (read,) = read_uff(path)
    digits = 1e-6 if kind == "f4" else 1e-15
    np.testing.assert_allclose(read.abscissa, uneven, rtol=digits)
    np.testing.assert_allclose(read.values, values, rtol=digits, atol=digits)
