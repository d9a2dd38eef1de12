"""Valid files of other programs, with features of their formats drawn by chance, for `fuzz.py`.

Damaged bytes seldom make a formula that runs, a data set that lies in another file, or one that is
stored in a thousandth of its size; the libraries that write these formats do.
"""

from __future__ import annotations

import contextlib
import os
import random
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import asammdf
import h5py
import nptdms
import numpy as np
import pyuff
from scipy.io import savemat
from scipy.sparse import csr_matrix

SECRET = 12345.678
"""Number in a file that none of the others may bring."""
N = 64
NAMES = ("A1 x", "TSM z", "driver ear")
TIME = np.arange(N) / 2048.0
KINDS = ("i1", "u1", "<i2", ">i2", "<u4", ">i4", "<i8", "<u8", "<f4", ">f4", "<f8", ">f8", "?")
OTHER_KINDS = ("<f2", "<c16", "S5", "<U5", "f16")
HUGE = (2**16, 2**27, 134_000_000, 2**31, 2**40)


def values(chance: random.Random, others: bool = False) -> Any:
    """Return numbers of some type, or with `others` seldom something else."""
    kind = chance.choice(OTHER_KINDS if others and chance.random() < 0.1 else KINDS)
    return (50 * np.sin(40 * TIME) + 50).astype(kind)


def mdf(stem: Path, chance: random.Random) -> Path:
    """Write an MDF file with conversions, structures, texts, gaps, attachments and compression."""
    version = chance.choice(("4.10", "4.10", "4.20", "4.00", "3.30", "3.00", "2.14"))
    touch = f"touch {stem.with_name('ran')}"
    found = '[c for c in ().__class__.__base__.__subclasses__() if c.__name__=="_wrap_close"][0]'
    code = f'{found}.__init__.__globals__["system"]("{touch}")'
    table = {"raw_0": 0.0, "phys_0": 1.0, "raw_1": 50.0, "phys_1": 2.0}
    conversions: tuple[Any, ...] = (
        None,
        {"a": chance.choice((2.0, 0.0, -1e300, np.nan)), "b": 1.0},
        {f"P{k}": chance.choice((0.0, 1.0, -2.0, 1e-3)) for k in range(1, 7)},
        {f"P{k}": float(k) for k in range(1, 8)},
        {**table, "interpolation": chance.random() < 0.5},
        {"lower_0": 0.0, "upper_0": 9.0, "phys_0": 1.0, "default": 2.0},
        {"val_0": 1, "text_0": b"on", "default": b"off"},
        {"val_0": 1, "text_0": {"formula": f"X1+(f'{{{code}}}'=='9')"}, "default": b"off"},
        {"lower_0": 0, "upper_0": 9, "text_0": b"low", "default": b"high"},
        {"formula": chance.choice(("2 * X1", f"X1 + (f'{{{code}}}' == '9')", "sqrt(X1)", "("))},
    )
    with asammdf.MDF(version=version) as file:
        for _ in range(chance.choice((1, 1, 2))):
            signals = []
            for name in chance.sample(NAMES, chance.choice((1, 2, 3))):
                extra: dict[str, Any] = {"conversion": chance.choice(conversions)}
                if version >= "4" and chance.random() < 0.2:
                    extra["invalidation_bits"] = np.arange(N) == chance.choice((3, -1))
                samples = values(chance, others=True)
                if chance.random() < 0.1:
                    samples = np.rec.fromarrays([np.ones((N, 2))], dtype=[(name, "f8", (2,))])
                if samples.dtype.kind in "SUV":
                    extra["encoding"] = "utf-8"
                    samples = samples.astype("S5") if samples.dtype.kind == "U" else samples
                comment = chance.choice(("", "<CNcomment><TX>a</TX></CNcomment>"))
                signals.append(
                    asammdf.Signal(samples, TIME, unit="g", name=name, comment=comment, **extra)
                )
            file.append(signals, common_timebase=chance.random() < 0.7)
        if version >= "4" and chance.random() < 0.3:
            file.attach(b"x" * 99, "a.txt", compression=True, embedded=True)
        if chance.random() < 0.3:  # the time of a channel is converted as well
            converted = [c.conversion for group in file.groups for c in group.channels]
            file.groups[0].channels[0].conversion = chance.choice(converted)
        path = stem.with_suffix(".mf4" if version >= "4" else ".mdf")
        return Path(file.save(path, overwrite=True, compression=chance.choice((0, 1, 2))))


def hdf5(stem: Path, chance: random.Random) -> Path:
    """Write an HDF5 file with links, storage elsewhere, references, filters and huge shapes."""
    path = stem.with_suffix(".h5")
    options = {"libver": chance.choice(("earliest", "latest")), "track_order": True}
    with h5py.File(path, "w", userblock_size=chance.choice((0, 0, 0, 512)), **options) as file:
        rate: Any = (100.0, 0.0, -1.0, "fast", np.nan, [1.0, 2.0], np.float32(5), h5py.Empty("f8"))
        file.attrs["sample_rate"] = chance.choice(rate if chance.random() < 0.3 else rate[:1])
        group = file.create_group("run") if chance.random() < 0.5 else file
        for name in chance.sample([*NAMES, "time"], 3):
            _data_set(group, name, chance, stem.with_name("secret"), stem.with_name("other.h5"))
            if name in group and chance.random() < 0.8:
                unit: Any = chance.choice(("g", b"g", 1.0, [1, 2], h5py.Empty("S1"), "ü" * 999))
                attributes = group.get(name, getlink=True)
                if isinstance(attributes, h5py.HardLink):
                    group[name].attrs[chance.choice(("unit", "units"))] = unit
        for name in chance.sample(["again", "away", "hard"], chance.choice((0, 0, 1, 2))):
            away = h5py.ExternalLink("other.h5", "/x")
            link = {"again": h5py.SoftLink("/run/time"), "away": away}
            file[name] = link.get(name, file)
    return path


def _data_set(group: Any, name: str, chance: random.Random, secret: Path, other: Path) -> None:
    way = chance.randrange(12)
    if way == 0:
        source = chance.choice((secret, secret.with_name("pipe")))
        group.create_dataset(name, (N,), "f8", external=[(source, 0, 8 * N)])
    elif way == 1:
        layout = h5py.VirtualLayout((N,), "f8")
        layout[:] = h5py.VirtualSource(other, "x", (N,))
        group.create_virtual_dataset(name, layout)
    elif way == 2:
        group[name] = h5py.ExternalLink(chance.choice((str(other), "pipe")), "/x")
    elif way == 3:
        group[name] = h5py.SoftLink(chance.choice(("/away", "/nowhere", f"/{name}", "/run")))
    elif way == 4:
        group.create_group(name)
    elif way == 5:
        shape = (chance.choice(HUGE),)
        chunk = (min(shape[0], chance.choice((2**10, 2**20, 2**26))),)
        group.create_dataset(name, shape, "f8", chunks=chunk, compression="gzip")
    elif way == 6:
        group[name] = np.array([group.name] * N, dtype=object)
    elif way == 7:
        group[name] = np.array([group.ref] * N, dtype=h5py.ref_dtype)
    elif way == 8:
        group[name] = chance.choice((np.ones((N, 2)), np.float64(1), np.ones(0), np.ones(1)))
    elif way == 9:
        group[name] = np.zeros(N, dtype=[("real", "f8"), ("imag", "f8")])
    else:
        data = TIME if name == "time" else values(chance, others=True).astype("f8")
        filters: tuple[dict[str, Any], ...] = (
            {},
            {"compression": "gzip", "shuffle": True},
            {"compression": "lzf", "fletcher32": True},
            {"maxshape": (None,), "chunks": (7,)},
            {"scaleoffset": 3},
            {"fillvalue": 2.0, "chunks": (N,)},
        )
        group.create_dataset(name, data=data, **chance.choice(filters))


def tdms(stem: Path, chance: random.Random) -> Path:
    """Write a TDMS file with scales, properties of all types, segments and an index beside it."""
    scale = "NI_Scale[0]"
    kinds = ("Linear", "Polynomial", "RTD", "Strain", "Table", "Thermistor", "Thermocouple", "Add")
    properties: tuple[dict[str, Any], ...] = (
        {},
        {"NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": chance.choice((0, 1, 2, -1))},
        {f"{scale}_Scale_Type": chance.choice((*kinds, "Subtract", "AdvancedAPI", "Map", 3))},
        {
            f"{scale}_Scale_Type": "Linear",
            f"{scale}_Linear_Slope": chance.choice((2.0, "x", np.nan)),
            f"{scale}_Linear_Y_Intercept": 0.5,
            f"{scale}_Linear_Input_Source": chance.choice((0xFFFFFFFF, 0, 7)),
        },
        {
            f"{scale}_Scale_Type": "Polynomial",
            f"{scale}_Polynomial_Coefficients_Size": chance.choice((1, 2, 10**6)),
            f"{scale}_Polynomial_Coefficients[0]": 1.0,
            f"{scale}_Polynomial_Coefficients[1]": 2.0,
        },
    )
    path = stem.with_suffix(".tdms")
    with nptdms.TdmsWriter(str(path), index_file=chance.random() < 0.3) as file:
        for _ in range(chance.choice((1, 2, 5))):
            name = chance.choice(NAMES)
            step = chance.choice((1e-3, 1e-3, 1e-3, 0.0, np.nan, "fast", True, 2**62, -1e300))
            common = {"wf_increment": step, "unit_string": chance.choice(("g", "", 3))}
            common |= chance.choice(properties)
            data = values(chance, others=chance.random() < 0.3)
            data = data.astype(data.dtype.newbyteorder("="))
            if data.dtype.kind == "V" or (data.dtype.itemsize == 2 and data.dtype.kind == "f"):
                data = TIME
            if data.dtype.kind == "S":
                data = data.astype("U5")
            channel = nptdms.ChannelObject("run", name, data, common)
            parents = [nptdms.RootObject(chance.choice(properties))]
            file.write_segment([*parents[: chance.choice((0, 0, 0, 1))], channel])
    return path


def matlab(stem: Path, chance: random.Random) -> Path:
    """Write a MATLAB file of version 4, 5 or 7.3 with structures, cells and all types."""
    if chance.random() < 0.3:
        path = hdf5(stem, chance)
        data = bytearray(path.read_bytes())
        if data[:4] != b"\x89HDF":
            data[:30] = b"MATLAB 7.3 MAT-file, Platform:"
        path.unlink()
        path.with_suffix(".mat").write_bytes(bytes(data))
        return path.with_suffix(".mat")
    version = chance.choice(("4", "5", "5", "5"))
    cells = np.array(NAMES, dtype=object)
    numbers = np.stack([values(chance).astype("f8") for _ in NAMES], axis=1)
    content: dict[str, Any] = {"time": TIME, "names": cells, "values": numbers, "units": "g"}
    strange: tuple[Any, ...] = (
        {"a": 1, "b": {"c": cells}},
        csr_matrix(numbers),
        numbers + 1j,
        numbers.astype(chance.choice(("i1", "u2", "f4", "?", "i8"))),
        np.array([[cells, 1.0], ["x", numbers]], dtype=object),
        np.zeros((0, 3)),
        "text",
        np.ones((2, 3, 4)),
        np.nan,
    )
    if version == "4":
        content["names"] = "A1 x"
    for name in chance.sample(list(content), chance.choice((0, 0, 1, 2))):
        content[name] = chance.choice(strange)
    path = stem.with_suffix(".mat")
    options: dict[str, Any] = {"do_compression": version == "5" and chance.random() < 0.5}
    savemat(path, content, format=version, oned_as=chance.choice(("row", "column")), **options)
    return path


def npz(stem: Path, chance: random.Random) -> Path:
    """Write an npz file as SDynPy does, with other types and shapes of each field."""
    number = chance.choice(("f8", "f8", "f8", ">f8", "f4", "O", "U5", "m8[s]"))
    ordinate = chance.choice(("c16", "c16", "f8", ">c8", "U5", "O"))
    place = [("node", chance.choice(("u8", "f8", "U3", "i8"))), ("direction", "i1")]
    record = np.dtype(
        [
            ("abscissa", number, (N,)),
            ("ordinate", ordinate, (chance.choice((N, N, N, 2)),)),
            *((f"comment{k}", chance.choice(("U80", "U80", "S80", "f8"))) for k in range(1, 6)),
            ("coordinate", place, (chance.choice((1, 2, 2, 2, 3)),)),
        ]
    )
    data = np.zeros(chance.choice(((2,), (2, 2), (), (0,))), dtype=record)
    if number in ("f8", ">f8", "f4") and data.size:
        data["abscissa"] = np.arange(1.0, N + 1)
    kind: Any = chance.choice((4, 4, [4], [[4]], [4, 4], 4.0, "4", -1, None, 2**70, True))
    path = stem.with_suffix(".npz")
    chance.choice((np.savez, np.savez_compressed))(path, data=data, function_type=kind)
    path.with_suffix(".csv").write_text(
        "role,node,quantity,unit\nresponse,,acceleration,g\nreference,,force,N\n"
    )
    return path


def uff(stem: Path, chance: random.Random) -> Path:
    """Write data sets 58, 164, 15, 82, 151 and 55 by pyuff, in text and in binary."""
    path = stem.with_suffix(".uff")
    written = pyuff.UFF(str(path))
    abscissa = np.arange(1.0, N + 1) / chance.choice((1.0, 8.0, 3.0))
    for _ in range(chance.choice((1, 2, 4))):
        kind = chance.choice((np.float64, np.complex128, np.float32, np.complex64))
        content = pyuff.prepare_58(
            binary=chance.choice((0, 1)),
            func_type=chance.choice((0, 1, 2, 4, 6, 9)),
            rsp_node=chance.choice((1, 2, 99_999)),
            rsp_dir=chance.choice((0, 1, -3, 6)),
            ref_dir=chance.choice((0, -2, 3)),
            ref_node=chance.choice((0, 7)),
            data=np.ones(N, dtype=kind),
            x=abscissa,
            id1=chance.choice(("", "NONE", "added decay rate 2.5 1/s", "x" * 200, "    -1")),
            rsp_ent_name="a",
            ref_ent_name="b",
            abscissa_spacing=chance.choice((0, 1)),
            abscissa_spec_data_type=chance.choice((17, 18, 0, 19)),
            abscissa_axis_units_lab=chance.choice(("s", "Hz", "ms", "")),
            ordinate_spec_data_type=chance.choice((8, 12, 13, 15, 0)),
            ordinate_axis_units_lab=chance.choice(("m/s^2", "g", "N", "Pa", "NONE", "m/s^2/N")),
            orddenom_spec_data_type=chance.choice((0, 13)),
            orddenom_axis_units_lab=chance.choice(("N", "kN", "NONE")),
        )
        written.write_sets([content], mode="add")
    if chance.random() < 0.4:
        units = pyuff.prepare_164(units_code=1, units_description="SI", temp_mode=1, length=1.0)
        units |= {"force": chance.choice((1.0, 1e-3)), "temp": 1.0, "temp_offset": 0.0}
        written.write_sets([units], mode="add")
    if chance.random() < 0.3:
        nodes = {"type": 15, "node_nums": [1, 2], "def_cs": [0, 0], "disp_cs": [0, 0]}
        nodes |= {"color": [1, 1], "x": [0.0, 1.0], "y": [0.0, 1.0], "z": [0.0, 1.0]}
        written.write_sets([nodes], mode="add")
    return path


WRITERS: tuple[Callable[[Path, random.Random], Path], ...] = (mdf, hdf5, tdms, matlab, npz, uff)


def write(folder: Path, seeds: Iterable[int]) -> None:
    """Write a valid file of some format for each seed; what a library refuses is drawn again."""
    (folder / "secret").write_bytes(np.full(N, SECRET).tobytes())
    os.mkfifo(folder / "pipe")
    with h5py.File(folder / "other.h5", "w") as other:
        other["x"] = np.full(N, SECRET)
    for number, seed in enumerate(seeds):
        chance = random.Random(seed)
        is_written = False
        while not is_written:
            for left in folder.glob(f"{number}.*"):
                left.unlink()
            with warnings.catch_warnings(), contextlib.suppress(Exception):
                warnings.simplefilter("ignore")
                chance.choice(WRITERS)(folder / str(number), chance)
                is_written = True


def read(path: Path) -> None:
    """Read a file as deboom does; refuse numbers that come from another file."""
    from deboom.files.function_table import matlab_table, read_nodal
    from deboom.files.time_data import read_time_signals

    if path.suffix in (".npz", ".uff"):
        arrays = [function.values for function in read_nodal(path)]
    elif path.suffix == ".mat":
        arrays = [values for _, values in matlab_table(path, "time")[1].values()]
    else:
        signals = read_time_signals(path, NAMES).values()
        arrays = [array for signal in signals for array in (signal.time, signal.values)]
    if any(np.any(array == SECRET) for array in arrays):
        raise AssertionError(f"{path} brings numbers of another file")
