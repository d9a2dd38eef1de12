"""Time data of measuring systems: what each library wrote reads back, broken files are refused."""

import os
import re
import shutil
import struct
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import asammdf
import h5py
import nptdms
import numpy as np
import pandas as pd
import pytest
from broken_files import edited
from scipy.io import savemat, wavfile

from command_line import call
from deboom.bench.campaign import CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.errors import InputError
from deboom.files.campaign import read_campaign, read_time_run
from deboom.files.function_table import read_function_table
from deboom.files.rows import CampaignChannel
from deboom.files.time_data import read_time_signals, time_functions
from deboom.files.uff import write_uff
from deboom.files.units import Unit

RATE = 2048.0
TIME = np.arange(64) / RATE
SIGNALS = {
    "A1 x": ("g", np.sin(40.0 * TIME)),
    "TSM z": ("kN", 0.3 * np.cos(7.0 * TIME)),
    "driver ear": ("Pa", 2.0 * np.sin(90.0 * TIME)),
}


def mdf(path, signals, time):
    with asammdf.MDF(version="4.10") as file:
        for name, (unit, values) in signals.items():
            file.append(asammdf.Signal(values, time, unit=unit, name=name))
        file.save(path, overwrite=True)


def tdms(path, signals, time):
    step = {"wf_increment": time[1] - time[0], "wf_start_offset": time[0]}
    with nptdms.TdmsWriter(path) as file:
        for name, (unit, values) in signals.items():
            properties = {**step, "unit_string": unit}
            file.write_segment([nptdms.ChannelObject("run", name, values, properties)])


def hdf5(path, signals, time):
    with h5py.File(path, "w") as file:
        file.attrs["sample_rate"] = 1 / (time[1] - time[0])
        for name, (unit, values) in signals.items():
            file.create_dataset(f"run/{name}", data=values).attrs["unit"] = unit


def hdf5_with_time(path, signals, time):
    with h5py.File(path, "w") as file:
        file["time"] = time
        for name, (unit, values) in signals.items():
            file.create_dataset(name, data=values).attrs["units"] = unit


def matlab(path, signals, time):
    names, units = (np.array(texts, dtype=object) for texts in (list(signals), units_of(signals)))
    values = np.column_stack([values for _, values in signals.values()])
    savemat(path, {"time": time, "names": names, "values": values, "units": units})


def matlab_73(path, signals, time, axis="time"):
    """Write what MATLAB writes: turned axes, cells as references to numbers of characters."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for variable, texts in (("names", list(signals)), ("units", units_of(signals))):
            cells = []
            for k, text in enumerate(texts):
                numbers = np.array([[ord(c)] for c in text], dtype=np.uint16)
                cell = file.create_dataset(f"#refs#/{variable}{k}", data=numbers)
                cell.attrs["MATLAB_class"] = np.bytes_("char")
                cells.append([cell.ref])
            file.create_dataset(variable, data=np.array(cells, dtype=h5py.ref_dtype))
        file[axis] = time[:, np.newaxis].T
        values = np.stack([values for _, values in signals.values()])
        if np.iscomplexobj(values):
            values = values.view([("real", "f8"), ("imag", "f8")])
        file["values"] = values
    data = bytearray(path.read_bytes())
    data[:30] = b"MATLAB 7.3 MAT-file, Platform:"
    path.write_bytes(bytes(data))


def units_of(signals):
    return [unit for unit, _ in signals.values()]


def lvm(path, signals, time, layout="One", comma=False, separator="Tab", blank=True, end="\r\n"):
    """Write the layouts of LabVIEW: `blank` is the empty column of instants where it has none."""
    between = {"Tab": "\t", "Comma": ","}[separator]

    def cells(*values):
        texts = [value if isinstance(value, str) else f"{value:.9e}" for value in values]
        return between.join(text.replace(".", ",") if comma else text for text in texts)

    def head(key, *values):
        gap = [""] if layout == "Multi" else []
        return cells(key, *[cell for value in values for cell in (value, *gap)])

    n, step = len(signals), time[1] - time[0]
    lines = ["LabVIEW Measurement", cells("Writer_Version", "2"), cells("Reader_Version", "2")]
    lines += [cells("Separator", separator), f"Decimal_Separator{between}{',' if comma else '.'}"]
    lines += [cells("Multi_Headings", "No"), cells("X_Columns", layout)]
    lines += [cells("Time_Pref", "Relative"), cells("***End_of_Header***", ""), ""]
    lines += ["***Start_Special***", "anything", "***End_Special***"]
    lines += [
        cells("Notes", "run", "3"),
        cells("Channels", str(n)),
        head("Samples", *[str(time.size)] * n),
    ]
    lines += [head("Y_Unit_Label", *units_of(signals)), head("X_Dimension", *["Time"] * n)]
    lines += [head("X0", *[time[0]] * n), head("Delta_X", *[step] * n)]
    lines += [cells("***End_of_Header***", "", "")]
    first = {"One": ["X_Value"], "No": ["X_Value"] if blank else [], "Multi": []}[layout]
    names = [name for pair in signals for name in ("X_Value", pair)]
    lines += [cells(*first, *(names if layout == "Multi" else signals), "Comment")]
    for k, instant in enumerate(time):
        row = [value[k] for _, value in signals.values()]
        first = {"One": [instant], "Multi": [], "No": [""] if blank else []}[layout]
        if layout == "Multi":
            row = [each for value in row for each in (instant, value)]
        lines.append(cells(*first, *row, *(["a remark"] if k == 3 else [])))
    path.write_text(end.join([*lines, ""]), encoding="cp1252", newline="")


def wav(path, signals, time, kind=np.float32):
    rows, tracks = ["channel,full_scale,unit"], []
    for name, (unit, values) in signals.items():
        scale = 1.01 * float(np.abs(values).max())
        middle, largest = {np.float32: (0, 1), np.uint8: (128, 128)}.get(kind, (0, 32768))
        tracks.append(middle + values / scale * largest)
        rows.append(f"{name},{scale!r},{unit}")
    table = np.column_stack(tracks)
    table = table if kind is np.float32 else np.round(table)
    wavfile.write(path, round(1 / (time[1] - time[0])), table.astype(kind))
    path.with_suffix(".csv").write_text("\n".join([*rows, ""]))


def rf64(path, signals, time):
    """Write the head of files above 4 GiB: sizes of 64 bits in a chunk of their own."""
    wav(path, signals, time)
    data = path.read_bytes()
    place = data.index(b"data")
    (size,) = struct.unpack("<I", data[place + 4 : place + 8])
    ds64 = struct.pack("<4sIQQQI", b"ds64", 28, len(data) + 36 - 8, size, len(time), 0)
    tail = data[12:place] + b"data" + b"\xff" * 4 + data[place + 8 :]
    path.write_bytes(b"RF64" + b"\xff" * 4 + b"WAVE" + ds64 + tail)


def table(path, signals, time, first="time [s]"):
    columns = {first: time * {"time [s]": 1.0, "time [ms]": 1e3}[first]}
    columns |= {f"{name} [{unit}]": values for name, (unit, values) in signals.items()}
    frame = pd.DataFrame(columns)
    frame.to_csv(path, index=False) if path.suffix == ".csv" else frame.to_excel(path, index=False)


def table_with_rate(path, signals, time):
    columns = {f"{name} [{unit}]": values for name, (unit, values) in signals.items()}
    frame = pd.DataFrame(columns | {"sample rate [Hz]": ""})
    frame.loc[0, "sample rate [Hz]"] = f"{1 / (time[1] - time[0]):g}"
    frame.to_csv(path, index=False)


WRITERS = {
    "rf64": (rf64, "run.wav", 1e-6),
    "csv": (table, "run.csv", 1e-12),
    "csv in ms": (partial(table, first="time [ms]"), "run.csv", 1e-12),
    "csv with rate": (table_with_rate, "run.csv", 1e-12),
    "xlsx": (table, "run.xlsx", 1e-12),
    "mdf": (mdf, "run.mf4", 1e-12),
    "tdms": (tdms, "run.tdms", 1e-12),
    "hdf5": (hdf5, "run.h5", 1e-12),
    "hdf5 with time": (hdf5_with_time, "run.hdf5", 1e-12),
    "matlab": (matlab, "run.mat", 1e-12),
    "matlab 7.3": (matlab_73, "run.mat", 1e-12),
    "lvm": (lvm, "run.lvm", 1e-8),
    "wav": (wav, "run.wav", 1e-6),
}


@pytest.mark.parametrize("kind", WRITERS)
def test_what_was_written_is_read(tmp_path, kind):
    write, name, precision = WRITERS[kind]
    write(tmp_path / name, SIGNALS, TIME)
    read = read_time_signals(tmp_path / name, [*reversed(SIGNALS), "not there"])
    assert list(read) == list(reversed(SIGNALS))
    for channel, signal in read.items():
        unit, values = SIGNALS[channel]
        assert signal.unit == unit
        assert signal.values == pytest.approx(values, abs=precision)
        assert signal.time == pytest.approx(TIME, abs=1e-9)


@pytest.mark.parametrize(("kind", "step"), [(np.int16, 2.0**-15), (np.uint8, 2.0**-7)])
def test_whole_numbers_of_a_wav_file_are_calibrated(tmp_path, kind, step):
    path = tmp_path / "run.wav"
    wav(path, SIGNALS, TIME, kind)
    values = read_time_signals(path, ["driver ear"])["driver ear"].values
    assert values == pytest.approx(SIGNALS["driver ear"][1], abs=0.6 * 2.02 * step)


LAYOUTS_OF_LABVIEW = [
    {"layout": layout, "comma": comma, "separator": separator, "blank": blank, "end": end}
    for layout in ("No", "One", "Multi")
    for comma, separator in ((False, "Tab"), (True, "Tab"), (False, "Comma"))
    for blank, end in ((True, "\r\n"), (False, "\n"))
]


@pytest.mark.parametrize(
    "layout", LAYOUTS_OF_LABVIEW, ids=lambda layout: " ".join(map(str, layout.values()))
)
def test_layouts_of_labview(tmp_path, layout):
    path = tmp_path / "run.lvm"
    signals = {
        "A1 x": ("m/s²", SIGNALS["A1 x"][1]),
        **{name: SIGNALS[name] for name in list(SIGNALS)[1:]},
    }
    lvm(path, signals, TIME + 0.5, **layout)
    read = read_time_signals(path, list(signals))
    assert list(read) == list(signals)
    for name, signal in read.items():
        assert signal.unit == signals[name][0]
        assert signal.values == pytest.approx(signals[name][1], abs=1e-8)
        assert signal.time == pytest.approx(TIME + 0.5, abs=1e-8)


def test_rounded_instants_of_labview_are_those_of_the_header(tmp_path):
    """At 51.2 kHz six decimals of a second err by 2.6 % of a step."""
    path = tmp_path / "run.lvm"
    time = np.arange(64) / 51200
    lvm(path, SIGNALS, time)
    lines = path.read_text(encoding="cp1252").split("\n")
    begin = next(k for k, line in enumerate(lines) if line.startswith("X_Value")) + 1
    for k, instant in enumerate(time):
        lines[begin + k] = f"{instant:.6f}" + lines[begin + k][lines[begin + k].index("\t") :]
    path.write_text("\n".join(lines), encoding="cp1252")
    assert read_time_signals(path, ["A1 x"])["A1 x"].time == pytest.approx(time, abs=1e-12)


def test_a_shorter_and_slower_channel_beside_one_column_of_instants(tmp_path):
    """The column of instants is that of the longest channel, the others have X0 and Delta_X."""
    path = tmp_path / "run.lvm"
    rows = [
        "Channels\t2",
        "Samples\t6\t3",
        "Y_Unit_Label\tN\tm/s^2",
        "X0\t1.0\t1.0",
        "Delta_X\t0.01\t0.02",
        "***End_of_Header***\t",
        "X_Value\tfast\tslow\tComment",
        "1.00\t0\t7",
        "1.01\t1\t8",
        "1.02\t2\t9",
        "1.03\t3\t",
        "1.04\t4",
        "1.05\t5\t",
    ]
    head = ["LabVIEW Measurement", "Separator\tTab", "X_Columns\tOne", "***End_of_Header***", ""]
    path.write_text("\n".join([*head, *rows, ""]))
    fast, slow = read_time_signals(path, ["fast", "slow"]).values()
    assert (fast.unit, slow.unit) == ("N", "m/s^2")
    assert fast.values == pytest.approx(np.arange(6))
    assert slow.values == pytest.approx([7, 8, 9])
    assert slow.time == pytest.approx([1.0, 1.02, 1.04])


def second_record(layout):
    """Write a second record below the first, as LabVIEW appends it to one header."""

    def write(folder):
        path = folder / "run.lvm"
        lvm(path, SIGNALS, TIME, layout)
        text = path.read_text(encoding="cp1252")
        path.write_text(text + text[text.index("Comment") + 8 :].lstrip(), encoding="cp1252")
        if layout == "No":
            path.write_text(
                text + "\t" + text[text.index("Comment") + 8 :].lstrip(), encoding="cp1252"
            )
        return path

    return write


def second_segment(folder):
    path = folder / "run.lvm"
    lvm(path, SIGNALS, TIME)
    text = path.read_text(encoding="cp1252").replace("Channels", "Time\t10:45:47.03\nChannels")
    again = text[text.index("Time\t10") :].replace("10:45:47.03", "10:46:02.51")
    path.write_text(text + again, encoding="cp1252")
    return path


def test_functions_over_frequency_of_matlab_7_3(tmp_path):
    path = tmp_path / "wagon.mat"
    functions = {"TSM x": ("Pa/kN", np.exp(1j * TIME)), "EnM x": ("Pa/N", 2.0 - 1j * TIME)}
    matlab_73(path, functions, 20.0 + TIME, "frequency")
    table = read_function_table(path)
    assert table.frequency == pytest.approx(20.0 + TIME)
    assert table.spectrum("TSM x")[1] == pytest.approx(1e-3 * functions["TSM x"][1])
    assert table.spectrum("EnM x")[1] == pytest.approx(functions["EnM x"][1])


def marked(path, variable, kind, numbers, **attributes):
    """Exchange a variable of a file of version 7.3 for one of another of MATLAB's classes."""
    with h5py.File(path, "r+") as file:
        del file[variable]
        data = file.create_dataset(variable, data=np.array(numbers))
        data.attrs.update({"MATLAB_class": np.bytes_(kind), **attributes})


@pytest.mark.parametrize(
    ("variable", "kind", "numbers", "attributes", "sentence"),
    [
        # two names as MATLAB's strings: a reference to where the text is, in six numbers
        (
            "names",
            "string",
            np.uint32([[0xDD000000, 2, 1, 1, 1, 1]]),
            {"MATLAB_object_decode": np.int32(3)},
            "variable 'names' is of MATLAB's class string: save cellstr(names)",
        ),
        (
            "values",
            "table",
            np.uint32([[0xDD000000, 2, 1, 1, 1, 1]]),
            {"MATLAB_object_decode": np.int32(3)},
            "variable 'values' is of MATLAB's class table: save numbers, or text in a cell array",
        ),
        # an empty text is the size 0 x 0
        (
            "units",
            "char",
            np.uint64([0, 0]),
            {"MATLAB_empty": np.uint8(1)},
            "states no unit: export it with one",
        ),
    ],
)
def test_classes_of_matlab_7_3(tmp_path, variable, kind, numbers, attributes, sentence):
    path = tmp_path / "run.mat"
    matlab_73(path, SIGNALS, TIME)
    marked(path, variable, kind, numbers, **attributes)
    row = CampaignChannel("driver ear", "acceleration", 1, "scalar", Unit("Pa", "Pa", 1.0))
    with pytest.raises(InputError, match=re.escape(sentence)):
        time_functions(path, [row])


def intact(kind):
    """Write a file of a kind as it should be."""

    def write(folder):
        WRITERS[kind][0](folder / WRITERS[kind][1], SIGNALS, TIME)
        return folder / WRITERS[kind][1]

    return write


def cut(kind, share):
    """Write a file of a kind, and cut off its end."""

    def write(folder):
        path = intact(kind)(folder)
        os.truncate(path, int(share * path.stat().st_size))
        return path

    return write


def changed(kind, old, new, name=None):
    def write(folder):
        path = intact(kind)(folder)
        edited(name or path.name, old, new)(folder)
        return path

    return write


def data(name, content):
    def write(folder):
        (folder / name).write_bytes(content)
        return folder / name

    return write


def waveforms(*groups, **properties):
    """Write A1 x into each group of a TDMS file."""

    def write(folder):
        with nptdms.TdmsWriter(folder / "run.tdms") as file:
            for group in groups:
                file.write_segment([nptdms.ChannelObject(group, "A1 x", TIME, properties)])
        return folder / "run.tdms"

    return write


def scale(k, kind):
    """Properties of a scale of a TDMS channel: 0.5 + 2 x, where it is linear."""
    begin = f"NI_Scale[{k}]"
    return {
        "NI_Number_Of_Scales": k + 1,
        "NI_Scaling_Status": "unscaled",
        f"{begin}_Scale_Type": kind,
        f"{begin}_Linear_Slope": 2.0,
        f"{begin}_Linear_Y_Intercept": 0.5,
        f"{begin}_Linear_Input_Source": 0xFFFFFFFF if k == 0 else k - 1,
    }


def in_group(properties):
    def write(folder):
        with nptdms.TdmsWriter(folder / "run.tdms") as file:
            channel = nptdms.ChannelObject("run", "A1 x", TIME, {"wf_increment": 0.1})
            file.write_segment([nptdms.GroupObject("run", properties), channel])
        return folder / "run.tdms"

    return write


@pytest.mark.parametrize(
    ("properties", "slope", "offset"),
    [
        (scale(0, "Linear"), 2.0, 0.5),
        ({**scale(0, "Linear"), **scale(1, "Linear")}, 4.0, 1.5),
        ({**scale(0, "Linear"), "NI_Scaling_Status": "scaled"}, 1.0, 0.0),
        ({**scale(0, "Reciprocal"), "NI_Scaling_Status": "scaled"}, 1.0, 0.0),
        ({}, 1.0, 0.0),
    ],
)
def test_scales_of_tdms_are_applied_once(tmp_path, properties, slope, offset):
    path = waveforms("run", wf_increment=0.1, **properties)(tmp_path)
    assert read_time_signals(path, ["A1 x"])["A1 x"].values == pytest.approx(offset + slope * TIME)


RAW = np.arange(-20, 44, dtype=np.int16)
TABLE_X, TABLE_Y = np.array([-10.0, 0.0, 30.0]), np.array([5.0, 1.0, -2.0])
TABLE = {
    f"{name}_{k}": value
    for k, pair in enumerate(zip(TABLE_X, TABLE_Y, strict=True))
    for name, value in zip(("raw", "phys"), pair, strict=True)
}
RANGES = {"lower_0": -10.0, "upper_0": 0.0, "phys_0": 5.0}
RANGES |= {"lower_1": 1.0, "upper_1": 30.0, "phys_1": 6.0, "default": -1.0}
CONVERSIONS = {
    "linear": ({"a": 2.5, "b": -3.0}, 2.5 * RAW - 3.0),
    "rational": (
        {"P1": 0.5, "P2": 2.0, "P3": 1.0, "P4": 0.25, "P5": 0.5, "P6": 40.0},
        (0.5 * RAW**2.0 + 2 * RAW + 1) / (0.25 * RAW**2.0 + 0.5 * RAW + 40),
    ),
    "table between": ({**TABLE, "interpolation": True}, np.interp(RAW, TABLE_X, TABLE_Y)),
    "table": ({**TABLE, "interpolation": False}, np.select([RAW <= -5, RAW <= 15], [5.0, 1.0], -2)),
    "ranges": (
        RANGES,
        np.select([(RAW >= -10) & (RAW <= 0), (RAW >= 1) & (RAW <= 30)], [5.0, 6.0], -1.0),
    ),
}


@pytest.mark.parametrize("kind", CONVERSIONS)
@pytest.mark.parametrize(("version", "name"), [("4.10", "run.mf4"), ("3.30", "run.mdf")])
def test_conversions_of_mdf(tmp_path, version, name, kind):
    conversion, values = CONVERSIONS[kind]
    if version == "3.30" and kind == "ranges":
        pytest.skip("MDF 3 has no table of ranges")
    with asammdf.MDF(version=version) as file:
        file.append([asammdf.Signal(RAW, TIME, unit="g", name="A1 x", conversion=conversion)])
        file.save(tmp_path / name)
    signal = read_time_signals(tmp_path / name, ["A1 x"])["A1 x"]
    assert (signal.unit, signal.values) == ("g", pytest.approx(values, rel=1e-14))
    np.testing.assert_array_equal(signal.time, TIME)


def test_a_channel_of_several_numbers_or_texts_is_no_signal(tmp_path):
    states = {"val_0": 0, "text_0": b"off", "val_1": 1, "text_1": b"on", "default": b"?"}
    pairs = np.rec.fromarrays([np.ones((64, 3))], dtype=[("A1 x", "f8", (3,))])
    for content, sentence in (
        ({"samples": RAW % 2, "conversion": states}, "is converted to text or by a formula"),
        ({"samples": pairs}, "'A1 x' holds no numbers over time"),
    ):
        with asammdf.MDF(version="4.10") as file:
            file.append([asammdf.Signal(timestamps=TIME, unit="g", name="A1 x", **content)])
            file.save(tmp_path / "run.mf4", overwrite=True)
        with pytest.raises(InputError, match=sentence):
            read_time_signals(tmp_path / "run.mf4", ["A1 x"])


def times_as_text(folder):
    with h5py.File(folder / "run.h5", "w") as file:
        file["A1 x"] = TIME
        file["time"] = [f"{instant:.6f}" for instant in TIME]
    return folder / "run.h5"


def without_rate(folder):
    path = folder / "run.h5"
    with h5py.File(path, "w") as file:
        file["A1 x"] = TIME
    return path


def without_calibration(folder):
    path = intact("wav")(folder)
    path.with_suffix(".csv").unlink()
    return path


def invalid(folder):
    path = folder / "run.mf4"
    bits = np.arange(TIME.size) == 3
    with asammdf.MDF(version="4.10") as file:
        file.append(asammdf.Signal(TIME, TIME, unit="g", name="A1 x", invalidation_bits=bits))
        file.save(path)
    return path


REFUSED = {
    "mdf cut": (cut("mdf", 0.4), "is an MDF file, but damaged"),
    "mdf invalid samples": (invalid, "'A1 x' has 1 samples that are marked invalid"),
    "tdms cut": (cut("tdms", 0.9), "its last segment is cut off: copy it again"),
    "tdms twice": (
        waveforms("a", "b", wf_increment=0.1),
        "channel 'A1 x' comes 2 times, at 10 Hz and 10 Hz: keep or rename one",
    ),
    "tdms without step": (waveforms("run"), "has no property wf_increment: write it as a waveform"),
    "hdf5 cut": (cut("hdf5", 0.5), "is an HDF5 file, but damaged"),
    "hdf5 time as text": (times_as_text, "data set '/time' holds no numbers over time"),
    "hdf5 without rate": (without_rate, "nor an attribute 'sample_rate' [Hz]: add one of them"),
    "matlab cut": (cut("matlab", 0.7), "is damaged, or no MATLAB file"),
    "matlab 7.3 cut": (cut("matlab 7.3", 0.7), "a damaged MATLAB file of version 7.3"),
    "lvm cut in a line": (cut("lvm", 0.9), "'A1 x' has 64 samples by its header and 57 in the"),
    "lvm without samples": (changed("lvm", "Channels\t3", "Channels\tx"), "but damaged"),
    "lvm two records without instants": (
        second_record("No"),
        "'A1 x' has 64 samples by its header and 128 in the file: several records stand below",
    ),
    **{
        f"lvm two records, {layout}": (
            second_record(layout),
            "begins again at sample 65, at 0 s after 0.0307617 s: several records stand below",
        )
        for layout in ("One", "Multi")
    },
    "lvm two segments": (second_segment, "has 2 segments, begun at 10:45:47.03, 10:46:02.51"),
    "lvm over frequency": (
        changed("lvm", "X_Dimension\tTime", "X_Dimension\tFrequency"),
        "'A1 x' is over Frequency: export it over time",
    ),
    "lvm without a name": (changed("lvm", "\tTSM z", ""), "names of columns, which do not fit"),
    **{
        f"tdms scale {kind}": (
            waveforms("run", wf_increment=0.1, **scale(0, kind)),
            f"'A1 x' has raw numbers, whose scale 0 of type '{kind}' is not known: export it sc",
        )
        for kind in ("Reciprocal", "", "linear", "Map")
    },
    "tdms second scale": (
        waveforms("run", wf_increment=0.1, **(scale(0, "Linear") | scale(1, "Own"))),
        "whose scale 1 of type 'Own' is not known",
    ),
    "tdms scale of the group": (in_group(scale(0, "Reciprocal")), "whose scale 0 of type 'Recip"),
    "tdms fewer scales": (
        waveforms("run", wf_increment=0.1, **(scale(0, "Linear") | {"NI_Number_Of_Scales": 0})),
        "whose scale 0 of type 'Linear' is not known",
    ),
    "tdms unscaled": (
        waveforms("run", wf_increment=0.1, NI_Scaling_Status="unscaled"),
        "'A1 x' has raw numbers and states no scale: export it scaled",
    ),
    "wav cut": (cut("wav", 0.7), "bytes: copy it again"),
    "rf64 cut": (cut("rf64", 0.7), "bytes: copy it again"),
    "csv without time": (changed("csv", "time [s]", "t [s]"), "have a column 'time [s]', or a c"),
    "csv without unit of time": (changed("csv", "time [s]", "time"), "column 'time' has no unit"),
    "csv time in Hz": (changed("csv", "time [s]", "time [Hz]"), "is not in s or a multiple"),
    "csv no number": (changed("csv", "0.0,0.0,0.3", "0.0,x,0.3"), "line 2, column 'A1 x [g]': 'x'"),
    "csv name twice": (
        changed("csv", "TSM z [kN]", "A1 x [m/s^2]"),
        "two columns are named 'A1 x'",
    ),
    "csv two rates": (
        changed("csv with rate", "Hz]\n0.0,0.3,0.0,2048", "Hz]\n0.0,0.3,0.0,-1"),
        "column 'sample rate [Hz]': state one number of samples per second",
    ),
    "xlsx cut": (cut("xlsx", 0.5), "is no Excel file"),
    "wav without calibration": (without_calibration, "write run.csv beside it"),
    "wav full scale": (changed("wav", "A1 x,", "A1 x,-", "run.csv"), "is not positive: state it"),
    "famos": (data("run.dat", b"|CF,2,1,1;"), "is an imc FAMOS file: time data are read from UFF"),
    "text": (data("run.asc", b"Datum;Zeit\n1;2\n"), "is text that begins with 'Datum;Zeit'"),
    "empty": (data("run.mf4", b""), "is empty: export it again"),
    "other names": (intact("mdf"), "none of its channels is in the channel table; it holds 'A1 x'"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_a_broken_file_ends_in_a_sentence(tmp_path, fault):
    write, sentence = REFUSED[fault]
    path = write(tmp_path)
    names = ["B9 x"] if fault == "other names" else list(SIGNALS)
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        read_time_signals(path, names)
    assert path.stem in str(caught.value)
    assert "\n" not in str(caught.value)


def test_special_headers_without_an_end_are_read_once(tmp_path):
    """Each looked for its end through the whole file: 29 s for 400 kB."""
    path = tmp_path / "run.lvm"
    path.write_text("LabVIEW Measurement\t\n" + "***Start_Special***\n" * 20_000)
    begin = time.process_time()
    with pytest.raises(InputError, match="has 0 segments"):
        read_time_signals(path, ["A1 x"])
    assert time.process_time() - begin < 5.0


@pytest.mark.parametrize(
    ("write", "ending", "limit", "sentence"),
    [
        (lvm, "lvm", "time_data.MOST_CELLS", "has more than 100 cells: save a shorter record"),
        (lvm, "lvm", "time_data.LARGEST_LVM", "at most 0 MiB are read"),
        (wav, "wav", "disk.MOST_NUMBERS", "announces 359 numbers, at most 100 are read"),
    ],
)
def test_what_would_fill_the_memory_is_refused(
    tmp_path, monkeypatch, write, ending, limit, sentence
):
    write(tmp_path / f"run.{ending}", SIGNALS, TIME)
    monkeypatch.setattr(f"deboom.files.{limit}", 100)
    with pytest.raises(InputError, match=sentence):
        read_time_signals(tmp_path / f"run.{ending}", list(SIGNALS))


@pytest.mark.parametrize(
    ("kind", "module", "extra"),
    [
        ("mdf", "asammdf", "mdf"),
        ("tdms", "nptdms", "tdms"),
        ("hdf5", "h5py", "hdf5"),
        ("matlab 7.3", "h5py", "hdf5"),
    ],
)
def test_a_missing_library_is_one_sentence(tmp_path, monkeypatch, kind, module, extra):
    path = intact(kind)(tmp_path)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(
        InputError, match=rf"needs {module} to be read: pip install 'deboom.{extra}"
    ):
        read_time_signals(path, list(SIGNALS))


NAME = "g5_wot220_time"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    over_time = TimeRunPlan(last_speed=1700.0, duration=2.0, sample_rate=2048.0)
    runs = (PlannedRun(5, 60.0, full_load=False),)
    plan = CampaignPlan(("M1",), runs, 1, frequency=np.arange(30.0, 60.5, 1.5), time_run=over_time)
    folder = write_campaign(tmp_path_factory.mktemp("bench") / "campaign", 1, plan)
    orders(folder, "uff")
    return folder


def recorded_as(folder):
    """Exchange the UFF file of the run over time for an MDF file in other units."""
    run = read_time_run(folder, NAME)
    time = 2.0 + np.arange(run.tacho.size) / run.sample_rate
    signals = {"tacho": ("V", 4.0 * run.tacho), "engine torque": ("N m", run.engine_torque)}
    for names, values, quantity, unit, factor in (
        (run.acceleration_channels, run.acceleration, "acceleration", "g", 1 / 9.80665),
        (run.cell_force_channels, run.cell_force, "cell force", "N", 1.0),
        (run.static_force_names, run.static_force, "static force", "N", 1.0),
    ):
        for name, column in zip(names, values.T, strict=True):
            signals[f"{name} {quantity}"] = (unit, factor * column)
    mdf(folder / "run.mf4", signals, time)
    return "run.mf4"


def orders(folder, name):
    call("orders", folder, NAME, "--name", name, "--rpm-step", 50)


def test_time_data_of_a_measuring_system_go_through_orders(written, tmp_path):
    folder = Path(shutil.copytree(written, tmp_path / "campaign"))
    name = recorded_as(folder)
    text = (folder / "campaign.toml").read_text()
    (uff,) = re.findall(r'file = "([^"]*time[^"]*\.uff)"', text)
    (folder / "campaign.toml").write_text(text.replace(f'file = "{uff}"', f'file = "{name}"'))
    table = folder / "channels.csv"
    rows = table.read_text()
    rows = re.sub("(,tacho,.*),1\n", r"\1,V\n", rows)
    table.write_text(re.sub(r"(,acceleration,.*),m/s\^2", r"\1,g", rows))
    orders(folder, "other")
    table.write_text(rows)
    first, second = read_campaign(folder).runs[-2:]
    assert (first.name, second.name) == ("uff", "other")
    size = np.abs(first.acceleration.values).max()
    assert second.acceleration.values == pytest.approx(first.acceleration.values, abs=1e-5 * size)
    assert second.cell_force.values == pytest.approx(first.cell_force.values, abs=1e-3)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda signals, _: signals.pop("tacho"), "there is no channel 'tacho' (tacho): export it"),
        (
            lambda _, time: time[50:].__iadd__(3.767e-5),
            "sample 50 at 2.02392578 s is 0.06 steps off",
        ),
        (
            lambda signals, _: signals.update({"engine torque": ("", signals["tacho"][1])}),
            "'engine torque' states no unit: export it with one, such as N m",
        ),
        (
            lambda signals, _: signals.update({"engine torque": ("furlong", signals["tacho"][1])}),
            "'engine torque': unknown unit 'furlong'",
        ),
        (
            lambda signals, _: signals["tacho"][1].__setitem__(7, np.nan),
            "no value between 2.00",
        ),
    ],
)
def test_channels_that_do_not_fit_the_table_are_named(tmp_path, change, sentence):
    rows = [
        CampaignChannel(name, name, node, "scalar", Unit(unit, si, 1.0))
        for node, (name, unit, si) in enumerate(
            [("tacho", "1", "1"), ("engine torque", "N m", "N m")], 1
        )
    ]
    time = 2.0 + TIME
    signals = {"tacho": ("V", np.ones(64)), "engine torque": ("N m", 40.0 + TIME)}
    change(signals, time)
    mdf(tmp_path / "run.mf4", signals, time)
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        time_functions(tmp_path / "run.mf4", rows)
    assert str(caught.value).startswith(str(tmp_path / "run.mf4"))


ROWS = [
    CampaignChannel("tacho", "tacho", 1, "scalar", Unit("1", "1", 1.0)),
    CampaignChannel("engine torque", "engine torque", 2, "scalar", Unit("N m", "N m", 1.0)),
]


@pytest.mark.parametrize("kind", ["wav", "uff"])
def test_a_tacho_may_be_in_volts(tmp_path, kind):
    time, torque, path = np.arange(64) / 2000.0, 40.0 + TIME, tmp_path / f"run.{kind}"
    pulses = np.where(np.arange(64) % 8 < 2, 4.0, 0.0)
    rows = ROWS
    if kind == "wav":
        wav(path, {"tacho": ("V", pulses), "engine torque": ("N m", torque)}, time)
    else:
        rows = [ROWS[0], replace(ROWS[1], direction="+ry")]
        functions = [row.dof.function(time, pulses, 1, "general", "V") for row in rows[:1]]
        functions += [row.dof.function(time, torque, 1, "force", "N m") for row in rows[1:]]
        write_uff(path, functions, binary=True)
    tacho, other = time_functions(path, rows).functions
    assert (tacho.unit, other.unit) == ("1", "N m")
    np.testing.assert_allclose(tacho.values, pulses, atol=1e-6)
    np.testing.assert_allclose(other.values, torque, rtol=1e-6)


def test_other_channels_may_not_be_in_volts(tmp_path):
    wav(tmp_path / "run.wav", {"tacho": ("V", TIME), "engine torque": ("V", TIME)}, TIME)
    sentence = "channel 'engine torque': unit 'V' is that of no mechanical quantity"
    with pytest.raises(InputError, match=sentence):
        time_functions(tmp_path / "run.wav", ROWS)


def torque_at(time):
    """Components up to 40 Hz, 0.8 of the band of 100 Hz, on a ramp."""
    return 50 + 20 * time + 8 * np.sin(2 * np.pi * 11.3 * time) + 2 * np.cos(2 * np.pi * 40 * time)


def two_rasters(path, slow_start=0.0, slow_end=2.0, rate=100.0):
    fast, slow = np.arange(8192) / 4096.0, np.arange(slow_start, slow_end, 1 / rate)
    with asammdf.MDF(version="4.10") as file:
        file.append(asammdf.Signal(np.sign(np.sin(99.0 * fast)), fast, unit="V", name="tacho"))
        file.append(asammdf.Signal(torque_at(slow), slow, unit="N m", name="engine torque"))
        file.save(path, overwrite=True)
    return path


@pytest.mark.parametrize("start", [0.0, 0.00371])
def test_a_slow_channel_is_resampled_within_its_band(tmp_path, start):
    read = time_functions(two_rasters(tmp_path / "run.mf4", start), ROWS)
    tacho, torque = read.functions
    assert read.rates == pytest.approx((4096.0, 100.0))
    np.testing.assert_array_equal(torque.abscissa, tacho.abscissa)
    inside = (torque.abscissa > 0.2) & (torque.abscissa < 1.75)
    np.testing.assert_allclose(torque.values[inside], torque_at(torque.abscissa[inside]), atol=0.03)
    assert read.notes[0] == (
        "resampled from 100 Hz to 4096 Hz, band-limited: engine torque (engine torque)"
    )
    # a hundredth of a second is one sample of the slow channel, and no cut worth a word
    assert len(read.notes) == (2 if start else 1)


def test_messages_of_a_bus_are_interpolated_at_their_instants(tmp_path):
    """Instants 20 % of a step off, as on CAN: samples of a fast channel must be even."""
    slow = (np.arange(200) + np.random.default_rng(1).uniform(-0.2, 0.2, 200)) / 100.0
    torque = 50 + 20 * slow + 8 * np.sin(2 * np.pi * 5 * slow)
    fast = np.arange(8192) / 4096.0
    path = tmp_path / "run.mf4"

    def write(kept):
        with asammdf.MDF(version="4.10") as file:
            file.append(asammdf.Signal(np.sign(np.sin(99.0 * fast)), fast, unit="V", name="tacho"))
            signal = asammdf.Signal(torque[kept], slow[kept], unit="N m", name="engine torque")
            file.append(signal)
            file.save(path, overwrite=True)

    write(np.arange(200))
    read = time_functions(path, ROWS)
    time, values = read.functions[1].abscissa, read.functions[1].values
    exact = 50 + 20 * time + 8 * np.sin(2 * np.pi * 5 * time)
    np.testing.assert_allclose(values[50:-50], exact[50:-50], atol=0.03)
    assert "100.058 Hz to 4096 Hz, between instants up to 30 % of a step off" in read.notes[0]
    write(np.delete(np.arange(200), 77))
    with pytest.raises(InputError, match=r"engine torque\) has no value between 0.76"):
        time_functions(path, ROWS)


@pytest.mark.parametrize("kind", ["empty cells", "NaN", "NaN of MATLAB", "two rasters"])
def test_holes_of_a_slower_channel_are_no_gaps(tmp_path, kind):
    fast, slow = np.arange(400) / 400.0, np.arange(100) / 100.0
    if kind == "two rasters":  # of 400 and 90 Hz, as an outer join writes them
        slow = np.arange(90) / 90.0
    time = np.union1d(fast, slow)
    tacho, torque = (np.where(np.isin(time, each), time, np.nan) for each in (fast, slow))
    path = tmp_path / "run.csv"
    if kind == "NaN of MATLAB":
        path = path.with_suffix(".mat")
        matlab(path, {"tacho": ("V", tacho), "engine torque": ("N m", torque)}, time)
    else:
        empty = "NaN" if kind == "NaN" else ""
        table = pd.DataFrame({"time": time, "tacho": tacho, "engine torque": torque})
        text = table.to_csv(index=False, na_rep=empty)
        path.write_text(text.replace("\n", "\ns,V,N m\n", 1))  # units stand below the names
    read = time_functions(path, ROWS)
    shared = read.functions[0].abscissa
    np.testing.assert_allclose(shared, fast[fast <= slow[-1]], atol=1e-12)
    np.testing.assert_allclose(read.functions[1].values, shared, atol=1e-9)
    assert read.rates == pytest.approx((400.0, slow.size))


def test_a_long_slow_channel_is_resampled_as_in_one_piece(tmp_path, monkeypatch):
    path = two_rasters(tmp_path / "run.mf4", 0.00371)
    whole = time_functions(path, ROWS).functions[1].values
    monkeypatch.setattr("deboom.files.time_data._PART", 70)
    parts = time_functions(path, ROWS).functions[1].values
    np.testing.assert_allclose(parts, whole, rtol=0, atol=1e-11)


def test_channels_that_hardly_overlap_are_refused_by_name(tmp_path):
    with pytest.raises(InputError, match=r"engine torque \(engine torque\) begins at 1.500 s"):
        time_functions(two_rasters(tmp_path / "run.mf4", 1.5), ROWS)


def test_the_fastest_raster_of_a_signal_is_taken_and_said(tmp_path):
    fast, slow = np.arange(64) / 1000.0, np.arange(8) / 100.0
    with asammdf.MDF(version="4.10") as file:
        for time in (slow, fast):
            file.append(asammdf.Signal(2.0 * time, time, unit="g", name="A1 x"))
        file.save(tmp_path / "run.mf4")
    signal = read_time_signals(tmp_path / "run.mf4", ["A1 x"])["A1 x"]
    np.testing.assert_allclose(signal.values, 2.0 * fast)
    assert "comes 2 times, at 100 Hz and 1000 Hz: that at 1000 Hz is used" in signal.note
