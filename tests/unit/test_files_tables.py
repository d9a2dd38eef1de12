"""Tables: units, numbers and cells are read exactly or refused by line and column."""

import io
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest
from broken_files import content, edits, refused

from deboom.errors import InputError
from deboom.files.rows import ChannelRow, HammerChannel, MountRow, PlacedImpact
from deboom.files.tables import read_table, workbook_bytes, write_table
from deboom.files.units import RANGES, SEVERAL_MEANINGS, UNITS, Unit, parse_unit

MOUNTS = """\
mount,piece,x [mm],y [mm],z [m]
TSM,,200,-60,-0.27

Du,left,-500.5,-300,-0.1
Du,right,-500.5,300,-0.1
"""
CHANNELS = """\
channel,quantity,mount,piece,axis,node,direction,unit
TSM x,displacement,TSM,,x,11,+x,m
TSM x,force,TSM,,x,11,+x,kN
Du left x,displacement,Du,left,x,21,-x,µm
Du x,noise transfer function,Du,,x,31,+x,Pa/N
"""


@pytest.fixture
def mounts(tmp_path):
    path = tmp_path / "mounts.csv"
    path.write_text(MOUNTS, encoding="utf-8")
    return path


@pytest.fixture
def channels(tmp_path):
    path = tmp_path / "channels.csv"
    path.write_text(CHANNELS, encoding="utf-8")
    return path


def test_positions_are_converted_by_the_unit_of_each_column(mounts):
    tsm, left, right = read_table(mounts, MountRow)
    assert (tsm.mount, tsm.piece) == ("TSM", "")
    assert tsm.position == pytest.approx((0.2, -0.06, -0.27))
    assert (left.mount, left.piece, right.piece) == ("Du", "left", "right")
    assert left.position == pytest.approx((-0.5005, -0.3, -0.1))


def test_a_spreadsheet_export_with_byte_order_mark_and_blanks_is_read(mounts):
    text = MOUNTS.replace(",", " , ").replace("\n", "\r\n")
    mounts.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert read_table(mounts, MountRow)[0].position == pytest.approx((0.2, -0.06, -0.27))


def test_mount_tables_round_trip(tmp_path):
    rows = (MountRow("TSM", "", (0.1, 1 / 3, -2e-9)), MountRow("Du", "left", (1.0, 2.0, 3.0)))
    write_table(tmp_path / "a.csv", MountRow, rows)
    assert read_table(tmp_path / "a.csv", MountRow) == rows
    assert "rx [deg]" not in (tmp_path / "a.csv").read_text()
    turned = (replace(rows[0], angles=(0.1, 0.0, -math.pi / 6)), rows[1])
    write_table(tmp_path / "b.csv", MountRow, turned)
    again = read_table(tmp_path / "b.csv", MountRow)
    assert again[1] == rows[1]
    assert again[0].angles == pytest.approx(turned[0].angles)
    assert (tmp_path / "a.csv").read_bytes().startswith(b"mount,piece,x [m],y [m],z [m]\nTSM,,0.1,")


def test_rotations_of_mounts_come_together_and_are_angles(tmp_path):
    path = tmp_path / "mounts.csv"
    header = "mount,piece,x [m],y [m],z [m]"
    path.write_text(f"{header},rx [deg],ry [deg]\nTSM,,0,0,0,1,2\n")
    with pytest.raises(InputError, match="column 'rz' is missing"):
        read_table(path, MountRow)
    path.write_text(f"{header},rx [rad],ry [rad],rz [rad]\nTSM,,0,0,0,0,30,0\n")
    with pytest.raises(InputError, match=r"line 2: mount 'TSM' is turned by 0, 1718.87, 0 deg"):
        read_table(path, MountRow)
    path.write_text(f"{header},rx,ry [deg],rz [deg]\nTSM,,0,0,0,0,30,0\n")
    with pytest.raises(InputError, match="column 'rx' has no unit"):
        read_table(path, MountRow)


@pytest.mark.parametrize(
    ("fault", "sentence"),
    edits(
        """
x [mm] | x | column 'x' has no unit: write 'x [mm]' or [m]
x [mm] | x [] | column 'x []': a unit is missing
x [mm] | x [furlong] | column 'x [furlong]': unknown unit 'furlong'
x [mm] | x [N] | column 'x [N]' is not in m or a multiple of it
x [mm] | y [mm] | column 'x' is missing; the columns are mount, piece, x, y, z
mount,piece,x [mm], | mount,piece,x [mm],x [mm], | column 'x' is unknown or doubled
200 | nan | mounts.csv line 2, column 'x': 'nan' is no finite number
,-0.27 |  | mounts.csv line 2, column 'z': '' is no finite number
,-0.27 | ,-0.27,9 | no comma-separated table: line 2 has 6 cells and the header 5
right | left | mounts.csv line 5: 'Du left' already stands in line 4: correct one
TSM, | , | mounts.csv line 2: column 'mount' is empty: fill it in
""",
        "mounts.csv",
    ),
)
def test_a_bad_mount_table_is_refused_with_row_and_column(mounts, fault, sentence):
    fault(mounts.parent)
    told = refused(lambda _: read_table(mounts, MountRow), mounts.parent, sentence)
    assert all(line.startswith(str(mounts)) for line in told.splitlines())


def test_a_german_table_is_read(mounts):
    text = "mount;piece;x [mm];y [mm];z [mm]\nTSM;;1,5;-2;1e3\n"
    mounts.write_text(text, encoding="utf-8")
    assert read_table(mounts, MountRow)[0].position == pytest.approx((1.5e-3, -2e-3, 1.0))


HEADER = "mount,piece,x [m],y [m],z [m]"
NO_TABLES = [
    ("csv", None, r"mounts\.csv cannot be read \(No such file"),
    ("csv", "", r"mounts\.csv is empty"),
    ("csv", b"mount,piece,x [m\xb3],y [m],z [m]\nTSM,,1,1,1\n", r"'x \[m³\]': unknown unit 'm³'"),
    ("csv", f"{HEADER}\n\n", "has a header and no rows"),
    ("csv", f"{HEADER},w\nTSM,,1,1,1,1\n", "column 'w' is unknown or doubled"),
    ("csv", HEADER.replace(",", "|"), "are mount, piece, x, y, z, separated by commas"),
    *(
        ("csv", f'{HEADER}\nTSM,,"{number}",1,1\n', "line 2, column 'x'.*is no finite number")
        for number in ("398_0", "１２", "1,500", "0x10", "1e400", "- 1")
    ),
    ("xlsx", b"\xd0\xcf\x11\xe0" + bytes(600), "old .xls workbook or has a password"),
    ("xlsx", "mount,piece", r"is no Excel file .*: save it as \.xlsx once more; if it is text, n"),
    ("xlsx", b"PK\x03\x04" + bytes(60), "is no Excel file"),
]


@pytest.mark.parametrize(("suffix", "data", "sentence"), NO_TABLES)
def test_what_is_no_table_is_refused(tmp_path, suffix, data, sentence):
    path = tmp_path / f"mounts.{suffix}"
    content(path.name, data)(tmp_path)
    with pytest.raises(InputError, match=sentence):
        read_table(path, MountRow)


def test_a_stray_cell_far_away_is_named(tmp_path):
    path = tmp_path / "mounts.xlsx"
    book = openpyxl.Workbook()
    book.active["A1"], book.active["XFD1048576"] = "mount", "stray"
    book.save(path)
    with pytest.raises(InputError, match="delete stray cells"):
        read_table(path, MountRow)


def test_channels_carry_their_unit_and_sign(channels):
    x, force, left, path = read_table(channels, ChannelRow)
    assert (x.channel, x.node, x.direction, x.sign) == ("TSM x", 11, "+x", 1.0)
    assert (force.quantity, force.unit.si, force.unit.factor) == ("force", "N", 1000.0)
    assert (left.piece, left.unit.factor, left.sign) == ("left", 1e-6, -1.0)
    assert (path.quantity, path.node) == ("noise transfer function", 31)


def test_channel_tables_round_trip(tmp_path):
    of_files = Unit("", "", 1.0)
    rows = (
        ChannelRow("Du right x", "force", "Du", "right", "x", 22, "+x", of_files),
        ChannelRow("Du left x", "force", "Du", "left", "x", 21, "-x", parse_unit("kN")),
        ChannelRow("TSM z", "displacement", "TSM", "", "z", 11, "+z", parse_unit("mm")),
    )
    hammer = HammerChannel("A1 x", "acceleration", 11, "+x", parse_unit("mm/s^2"), range=490.0)
    for kind, written in ((ChannelRow, rows), (HammerChannel, (hammer,))):
        write_table(tmp_path / f"{kind.__name__}.csv", kind, written)
        assert read_table(tmp_path / f"{kind.__name__}.csv", kind) == written


@pytest.mark.parametrize(
    ("fault", "sentence"),
    edits(
        """
x,21,-x, | x,11,+x, | line 4: displacement at node 11 +x already stands in line 2: correct one
11,+x,m\\n | 11,+x,V\\n | line 2: displacement 'TSM x': unit 'V' is that of no mechanical quantity
kN | mm | line 3: force 'TSM x' is in 'mm', which is no unit of it: use N
Pa/N | Pa | 'Du x' is in 'Pa', which is no unit of it: use Pa/N or a multiple
force,TSM,,x,11,+x,kN | displacement,TSM,,x,12,+x,m | line 3: displacement 'TSM x' already stands in
force | pressure | line 3: unknown quantity 'pressure', use displacement, force,
TSM x,disp | TSM y,disp | line 2: channel 'TSM y' of mount 'TSM', piece '', axis 'x'
TSM,,x,11,+x,m | TSM,,u,11,+x,m | line 2: unknown axis 'u', use x, y, z
11,+x,m | 11,+y,m | has direction '+y', which is not along 'x'
11,+x,m | 11,x,m | has direction 'x', which is none: use +x, -x
11,+x,m | 11.5,+x,m | node '11.5' is no whole number from 1
""",
        "channels.csv",
    ),
)
def test_a_bad_channel_table_is_refused_with_its_row(channels, fault, sentence):
    fault(channels.parent)
    refused(lambda _: read_table(channels, ChannelRow), channels.parent, str(channels), sentence)


CONVENTIONS = (Path(__file__).parents[2] / "docs" / "conventions.md").read_text(encoding="utf-8")


def test_labels_of_files_reach_si_as_the_conventions_say():
    rows = re.findall(r"^\| [\w, -]+ \| (`.*`.*) \|$", CONVENTIONS, re.M)
    listed = {}
    for row in rows:
        (si, _), *others = re.findall(r"`(.*?)` ?([\d.e-]*)", row)
        si = si.replace("²", "^2")
        for label, factor in ((si, "1"), *others):
            unit = parse_unit(label)
            assert (unit.label, unit.si) == (label, si)
            assert unit.factor == pytest.approx(float(factor), rel=1e-14)
            listed.setdefault(si, []).append(label.replace("²", "^2").replace("µ", "u"))
    assert listed == {si: list(labels) for si, labels in UNITS.items()}
    ratio = parse_unit("mm/kN")
    assert (ratio.si, ratio.factor) == ("m/N", pytest.approx(1e-6, rel=1e-15))


def test_labels_of_several_meanings_are_those_of_the_conventions():
    rows = re.findall(r"^\| `(.*?)` \| (\S+) `(.*?)`.*?; (\S+) `(.*?)` \|$", CONVENTIONS, re.M)
    assert [label for label, *_ in rows] == list(SEVERAL_MEANINGS)
    for label, *meanings in rows:
        for factor, si in zip(meanings[::2], meanings[1::2], strict=True):
            unit = parse_unit(label, si.replace("²", "^2"))
            assert (unit.si, unit.factor) == (si.replace("²", "^2"), pytest.approx(float(factor)))
        if label != "g":
            with pytest.raises(InputError, match=rf"may mean {meanings[0][:7]}.* or .*: write"):
                parse_unit(label)


POUND_FORCE = 0.45359237 * 9.80665
LABELS = {
    ("m/s^2", 1.0): "m/s²|m/s2|m/s**2|(m/s^2)|[m/s²]|m/sec^2|m s^-2|m·s⁻²|ms⁻²|ms-2|m/s/s|m / s ^ 2"
    "|M/SEC2|M/S^2|M/S**2|M/S/S",
    ("m/s^2", 9.80665): "g|gn|g's|g_n",
    ("m/s^2", 1e-3): "mm/s^2|MM/SEC2|MM/S**2",
    ("m", 1e-3): "mm|MM",
    ("m/s", 1 / 3.6): "km/h|KM/H",
    ("m/s^2", 0.0254): "IN/SEC2|in/s^2|in/sec²|inch/s2|in/s/s",
    ("m/s^2/N", 1.0): "m/s^2/N|(m/s²)/N|m/(s² N)|m/(N·s²)|m s^-2 N^-1|(1/N)*(m/s²)|m/s²/Newton"
    "|M/SEC2/N",
    ("m/s^2/N", 9.80665): "g/N|gn/N|(g)/(N)",
    ("m/s^2/N", 0.0254 / POUND_FORCE): "in/s^2/lbf|(in/s²)/lbf",
    ("m/s/N", 1.0): "m/s/N|(m/s)/N|m/(s N)",
    ("m/N", 1e-6): "mm/kN|µm/N|um/N",
    ("Pa/N", 1.0): "PA/N|Pa/N|Pa / N|Pascal/Newton",
    ("Pa/m/s^2", 1.0): "Pa/(m/s^2)|Pa/m/s²",
    ("rad/s^2/N m", 1.0): "rad/s^2/(N m)|rad/s²/Nm|(rad/s^2)/(N·m)",
    ("rad/s", np.pi / 180): "deg/s|°/s",
    ("rad", np.pi / 180): "deg|°|degrees",
    ("N", POUND_FORCE): "lbf|LBF",
    ("N", 1.0): "N|Newton|Newtons|newtons",
    ("N", 9.80665): "kgf|kp",
    ("N m", 1.0): "N-M|N*M|Nm|N·m|N*m|N-m|N.m|N m",
    ("N m", 12 * 0.0254 * POUND_FORCE): "ft-lbf|lbf·ft|ft lb|lb-ft",
    ("N m/rad", 180 / np.pi): "Nm/deg|N·m/°",
    ("N/m", POUND_FORCE / 0.0254): "lbf/in|lbf/inch",
    ("N/m", 1e6): "kN/mm|N/µm",
    ("rpm", 1.0): "rpm|RPM|1/min|min^-1|min-1|min⁻¹|U/min|rev/min|r/min",
    ("Pa", 1e5): "bar",
    ("Pa", 1.0): "Pa|Pascal|N/m^2|N/m²",
    ("Pa", 1e6): "MPa|N/mm²",
    ("Pa", POUND_FORCE / 0.0254**2): "psi",
    ("Hz", 1.0): "Hz|hz|HZ",
    ("dB(A)", 1.0): "dB(A)|dBA",
    ("N s/m", 1.0): "Ns/m|N s/m|N·s/m|N*s/m|NS/M",
    ("N s/m", 1e3): "Ns/mm|N·s/mm",
    ("1", 1.0): "1|-",
}


@pytest.mark.parametrize("unit", LABELS, ids=lambda unit: f"{unit[1]:.6g} {unit[0]}")
def test_labels_that_laboratories_write(unit):
    for label in LABELS[unit].split("|"):
        read = parse_unit(label)
        assert (read.label, read.si, read.factor) == (label, unit[0], pytest.approx(unit[1]))
        assert parse_unit(label, unit[0]) == read


@pytest.mark.parametrize("label", ["V", "mV", "Volts", "EU", "counts"])
def test_raw_electrical_values_are_refused(label):
    with pytest.raises(InputError, match="apply the sensor's sensitivity before the export"):
        parse_unit(label)


@pytest.mark.parametrize("label", ["g rms", "Pa RMS", "m/s^2 pk", "N (peak)", "Pa_rms"])
def test_a_label_that_states_rms_or_peak_is_refused(label):
    with pytest.raises(InputError, match="states how an amplitude is counted"):
        parse_unit(label)


def test_ranges_are_those_of_the_conventions():
    rows = re.findall(r"^\| (.+?) \[(.+?)\] \| (\S+) \| (\S+) \| (\S+) \|$", CONVENTIONS, re.M)
    assert [name for name, *_ in rows] == list(RANGES)
    for name, shown, *limits in rows:
        stated = RANGES[name]
        assert stated.shown == shown
        values = stated.factor * np.array([*stated.usual, stated.largest])
        np.testing.assert_allclose(values, np.array(limits, float), rtol=1e-12)


@pytest.mark.parametrize("label", ["furlong", "Pa/furlong", "M", "MPA", "MN", "GN", "T", "n", "  "])
def test_an_unknown_or_missing_label_is_refused_by_name(label):
    with pytest.raises(InputError, match=f"unknown unit '{label}'|a unit is missing"):
        parse_unit(label)


def test_a_workbook_reads_back_with_units_and_empty_cells():
    table = pd.DataFrame({"direction": ["A x", "=1+1"], "today [N/mm]": [np.float64(2.5), np.nan]})

    book = openpyxl.load_workbook(io.BytesIO(workbook_bytes({"one": table}, "A title")))

    rows = list(book["one"].iter_rows(values_only=True))
    assert rows == [("direction", "today [N/mm]"), ("A x", 2.5), ("=1+1", None)]
    assert book["one"]["A3"].data_type == "s"
    assert (book.properties.title, book.properties.creator) == ("A title", "deboom")
    assert book["one"].freeze_panes == "A2"
    assert book["one"]["B2"].number_format == "0.0"
    assert book["one"].sheet_properties.pageSetUpPr.fitToPage


@pytest.mark.parametrize("sheets", [{"a/b": 1}, {"n" * 32: 1}, {" ": 1}])
def test_sheets_that_cannot_be_are_refused(sheets):
    with pytest.raises(InputError, match="sheet"):
        workbook_bytes({name: pd.DataFrame({"a": [1]}) for name in sheets}, "title")


# ---- what people write around a table

TITLE = "Mounts, measured on the bench; positions from the c.g."
REMARKED = [
    ["mount", "serial number", "piece", "x [mm]", "y [mm]", "#by", "z [mm]"],
    ["# tape measure, 3 May"],
    ["TSM", "4711", "", 200, -60.5, "Li", -270],
    [],
    ["Du", "4712", "left", -500.25, -300, "Li", -100],
    ["Remark: right one not measured"],
]
POSITIONS = [(0.2, -0.0605, -0.27), (-0.50025, -0.3, -0.1)]


def text_table(rows, separator, point):
    cells = [[str(cell).replace(".", point) for cell in row] for row in rows]
    width = max(map(len, rows))
    lines = [separator.join(row + [""] * (width - len(row))) for row in cells]
    return "\n".join([*lines, ""])


def sheet(path, rows, name="Sheet1"):
    book = openpyxl.Workbook()
    book.active.title = name
    for row in rows:
        book.active.append(row)
    book.save(path)


@pytest.mark.parametrize("titles", [[], [[TITLE]], [["a;b"], [], [TITLE, "", "x"]]])
@pytest.mark.parametrize("kind", ["comma", "semicolon", "xlsx", "xlsx with decimal commas"])
def test_titles_remarks_and_serial_numbers_stand_around_a_table(tmp_path, titles, kind):
    rows = [*titles, *REMARKED]
    path = tmp_path / ("mounts.csv" if "xlsx" not in kind else "mounts.xlsx")
    if kind == "comma":
        path.write_text(text_table(rows, ",", ".").replace(TITLE, f'"{TITLE}"'))
    elif kind == "semicolon":
        path.write_text(text_table(rows, ";", ",").replace(TITLE, f'"{TITLE}"'))
    elif kind == "xlsx":
        sheet(path, rows)
    else:
        # numbers that were typed as text under a German locale
        texts = [[str(c).replace(".", ",") if isinstance(c, float) else c for c in r] for r in rows]
        sheet(path, texts)
    read = read_table(path, MountRow)
    assert [(row.mount, row.piece) for row in read] == [("TSM", ""), ("Du", "left")]
    for row, position in zip(read, POSITIONS, strict=True):
        assert row.position == pytest.approx(position, rel=1e-14)


def test_a_line_below_a_title_is_named_as_the_file_counts_it(tmp_path):
    path = tmp_path / "mounts.csv"
    path.write_text(text_table([["Bench 3"], *REMARKED], ",", ".").replace("-300", "x"))
    with pytest.raises(InputError, match=r"mounts\.csv line 6, column 'y': 'x' is no finite"):
        read_table(path, MountRow)


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (
            [["TSM", "", "1,500", 1, 1]],
            "line 2, column 'x': '1,500' is no finite number: write 1.5",
        ),
        ([["TSM", "", "1.234,5", 1, 1]], r"column 'x': '1.234,5' is no finite number \(decimal po"),
        (
            [["Hub 3: not yet"], ["Du", "", 1, 1, 1]],
            "line 2: 'Hub 3: not yet' stands alone: fill in",
        ),
        ([["TSM"], ["Du", "", 1, 1, 1]], "line 2, column 'x': '' is no finite number: fill it in"),
        ([["#1", "", "", "", ""], ["Du", "", 1, 1, 1]], "line 2, column 'x': '' is no finite"),
        ([["TSM", "", 1, 1, 1, 7]], "column 6 has entries and no name: name it"),
    ],
)
def test_entries_around_a_table_are_refused(tmp_path, rows, sentence):
    path = tmp_path / "mounts.xlsx"
    sheet(path, [HEADER.split(","), *rows])
    with pytest.raises(InputError, match=sentence):
        read_table(path, MountRow)


def test_an_item_whose_name_begins_like_a_remark_is_kept(tmp_path):
    path = tmp_path / "mounts.csv"
    path.write_text(f"{HEADER}\n# 1,,1,2,3\n# by tape, in May, twice, at 20 deg, by Li, Wu\n")
    assert [row.mount for row in read_table(path, MountRow)] == ["# 1"]


UNITS_BELOW = [
    "mount,piece,x,y,z\n,,[mm],[mm],[mm]\nTSM,,1500,125,12\n",
    "mount,piece,x [mm],y,z\n,-,mm,in,m\nTSM,,1500,4.921259842519685,0.012\n",
    'mount,piece,x [m],y [m],z [m]\nTSM,,"1,500","0,125","0,012"\n',
    "mount\tpiece\tx [m]\ty [m]\tz [m]\nTSM\t\t1,5\t0,125\t0,012\n",
    "mount;piece;x [µm];y [m];z [m]\nTSM;;1500000;0,125;0,012\n".encode("cp1252"),
    "mount\tpiece\tx [µm]\ty [m]\tz [m]\nTSM\t\t1500000\t0,125\t0,012\n".encode("utf-16"),
]


@pytest.mark.parametrize("text", UNITS_BELOW)
def test_tables_of_spreadsheets_and_of_windows_are_read(tmp_path, text):
    path = tmp_path / "mounts.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    (row,) = read_table(path, MountRow)
    assert (row.mount, row.position) == ("TSM", pytest.approx((1.5, 0.125, 0.012)))


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        ("x [mm],y [mm],z [mm]\n,,m,mm,mm\n", "'x [mm]': the row below it says 'm': state one"),
        ("x [m],y [m],z [m]\nTSM,,1,5,0,125,0,012\n", "line 2 has 8 cells and the header 5; deci"),
        ("x,y,z\n,,mm,mm,V\nTSM,,1,1,1\n", "column 'z [V]': unit 'V' is that of no mechanical"),
    ],
)
def test_units_that_differ_and_commas_of_two_kinds_are_named(tmp_path, rows, sentence):
    path = tmp_path / "mounts.csv"
    path.write_text(f"mount,piece,{rows}")
    with pytest.raises(InputError, match=re.escape(sentence)):
        read_table(path, MountRow)


def test_a_decimal_comma_of_one_cell_tells_that_of_the_others(tmp_path):
    path = tmp_path / "mounts.xlsx"
    sheet(path, [HEADER.replace("[m]", "[mm]").split(","), ["TSM", "", "1,500", "0,125", "12"]])
    assert read_table(path, MountRow)[0].position == pytest.approx((1.5e-3, 1.25e-4, 0.012))


def test_faults_of_a_sheet_do_not_speak_of_commas(tmp_path):
    path = tmp_path / "positions.xlsx"
    columns = ["impact", "node", "x [mm]", "y [mm]", "z [mm]", "dx", "dy"]
    sheet(path, [columns, ["I1", 1, 0, 0, 0, 1, 0]], "impacts")
    with pytest.raises(InputError) as caught:
        read_table(path, PlacedImpact)
    sentence = "column 'dz' is missing; the columns are impact, node, dx, dy, dz, x, y, z"
    assert str(caught.value).endswith(sentence)
    assert "sheet 'impacts'" in str(caught.value)


@pytest.mark.parametrize("label", ["x" * 100_000, "m/" * 40 + "s", "m" + "/s" * 12])
def test_a_label_without_end_is_no_unit(label):
    with pytest.raises(InputError, match="unknown unit"):
        parse_unit(label)
