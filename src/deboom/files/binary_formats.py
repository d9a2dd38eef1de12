"""Read MDF, TDMS, HDF5 and MATLAB files; runs in a process of its own, see `reader_process`.

Each line of the standard input is a task, and each line of the standard output its answer, in JSON.
Arrays are written into the working folder of the process as ``0.npy``, ``1.npy`` and so on. What
a file announces is added up before any of it is read.
"""

from __future__ import annotations

import errno
import importlib
import json
import math
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError
from deboom.files.disk import BLOCK, LARGEST_MEMORY, MEBIBYTE, blocks, refuse_announced

MDF, TDMS, HDF5, MATLAB = "an MDF file", "a TDMS file", "an HDF5 file", "a MATLAB file"
"""Kinds of files as `deboom.files.disk.kind_of` names them."""
MATLAB_73 = "a MATLAB file of version 7.3"
LIBRARIES = {
    MDF: ("asammdf", "mdf"),
    TDMS: ("nptdms", "tdms"),
    HDF5: ("h5py", "hdf5"),
    MATLAB_73: ("h5py", "hdf5"),
    MATLAB: ("scipy.io", ""),
}
"""Kind of file → library that reads it, and deboom's extra with the library."""
LONGEST_READING = 60
"""Processor time that reading one file may take [s]."""
MOST_CHANNELS = 100_000
"""Channels of a file that is read."""
LARGEST_CHUNK = 256 * MEBIBYTE
"""Largest piece of an HDF5 data set that is stored, and unpacked, at once [bytes]."""

_Blocks = Callable[[], Iterable[npt.NDArray[Any]]]


@dataclass(frozen=True, eq=False)
class _Array:
    """Array of a file, announced and not yet read.

    - `shape`: of the array.
    - `blocks`: reads its numbers, column after column.
    - `kind`: type of its numbers in what is written.
    """

    shape: tuple[int, ...]
    blocks: _Blocks
    kind: str = "<f8"


@dataclass(frozen=True, eq=False)
class _Channel:
    """Channel of a file, announced and not yet read.

    - `unit`: label of the file.
    - `time`: instants [s]; channels of one raster have one and the same array.
    - `values`: [unit].
    """

    name: str
    unit: str
    time: _Array
    values: _Array


_Channels = Sequence[tuple[str, Callable[[], _Channel]]]
"""Name of every channel, and what tells what it announces."""


def _write(arrays: Sequence[_Array]) -> None:
    """Write arrays by their numbers in the sequence; what they announce is added up before."""
    count = sum(math.prod(array.shape) * np.dtype(array.kind).itemsize // 8 for array in arrays)
    refuse_announced("what is read of it", count)
    for number, array in enumerate(arrays):
        with Path(f"{number}.npy").open("xb") as file:
            header = {"descr": array.kind, "fortran_order": True, "shape": array.shape}
            np.lib.format.write_array_header_1_0(file, header)
            n = 0
            for block in array.blocks():
                for part in blocks(block.size):
                    file.write(np.ascontiguousarray(block[part], dtype=array.kind).data)
                n += block.size
        if n != math.prod(array.shape):
            raise ValueError(f"{n} of {array.shape} numbers are there")


def _check_numbers(what: str, axes: int, kind: np.dtype[Any]) -> None:
    if axes != 1 or kind.kind not in "biuf":
        raise InputError(f"{what} holds no numbers over time: export it as a signal")


def _signals(path: Path, kind: str, names: Sequence[str]) -> dict[str, Any]:
    """Write the channels with these names, with their instants."""
    with _FORMATS[kind](path) as channels:
        if len(channels) > MOST_CHANNELS:
            raise InputError(
                f"it has {len(channels)} channels, at most {MOST_CHANNELS} are read: export fewer"
            )
        wanted = [describe() for name, describe in channels if name in names]
        for channel in wanted:
            n, n_time = channel.values.shape[0], channel.time.shape[0]
            if n != n_time or n < 2:
                raise InputError(
                    f"channel '{channel.name}' has {n} values at {n_time} instants: export again"
                )
        arrays = list(dict.fromkeys(a for each in wanted for a in (each.time, each.values)))
        _write(arrays)
    return {
        "channels": [name for name, _ in channels],
        "signals": [
            (each.name, each.unit, arrays.index(each.time), arrays.index(each.values))
            for each in wanted
        ],
        "arrays": len(arrays),
    }


_NUMERIC = {"4": (0, 1, 2, 4, 5, 6), "3": (65535, 0, 1, 2, 6, 7, 8, 9)}
"""Version of MDF → conversions from number to number that need no formula of the file."""
_RATIONAL = {"4": 2, "3": 9}
_POLYNOMIAL = _RANGES = 6
"""Conversion of MDF 3, and of MDF 4."""


@contextmanager
def _mdf(path: Path) -> Iterator[_Channels]:
    asammdf = importlib.import_module("asammdf")
    with (
        path.open("rb") as source,  # given a path, the library would map and copy whole blocks
        asammdf.MDF(source, process_bus_logging=False, use_display_names=False) as file,
    ):
        version = "4" if file.version >= "4" else "3"
        # the library runs formulas of the file as Python: it gets no conversion to apply
        conversions: dict[tuple[int, int], Any] = {}
        for number, group in enumerate(file.groups):
            for index, channel in enumerate(group.channels):
                conversions[number, index] = channel.conversion
                channel.conversion = None
        axes: dict[int, _Array] = {}
        yield [
            (channel.name, partial(_of_mdf, file, version, conversions, axes, number, index))
            for number, group in enumerate(file.groups)
            for index, channel in enumerate(group.channels)
            if index != file.masters_db.get(number)
        ]


def _of_mdf(
    file: Any,
    version: str,
    conversions: Mapping[tuple[int, int], Any],
    axes: dict[int, _Array],
    number: int,
    index: int,
) -> _Channel:
    group = file.groups[number]
    channel = group.channels[index]
    what = f"channel '{channel.name}'"
    if group.channel_dependencies[index]:
        raise InputError(f"{what} holds no numbers over time: export it as a signal")
    shape = (max(group.channel_group.cycles_nr, 0),)

    def values() -> Iterator[npt.NDArray[Any]]:
        # without the last word, invalid samples are left out in silence
        raw, invalid = file.get(
            group=number,
            index=index,
            raw=True,
            samples_only=True,
            ignore_invalidation_bits=True,
        )
        if invalid is not None and np.any(invalid):
            raise InputError(
                f"{what} has {int(np.sum(invalid))} samples that are marked invalid: cut them off, "
                "deboom does not fill gaps"
            )
        _check_numbers(what, raw.ndim, raw.dtype)
        return _converted(version, conversions[number, index], raw)

    def instants() -> Iterator[npt.NDArray[Any]]:
        return _converted(version, conversions.get(master), file.get_master(number))

    # groups may have the master channel of another one
    remote = getattr(group.channel_group, "cg_master_index", None)
    with_master = number if remote is None else remote
    master = (with_master, file.masters_db.get(with_master, -1))
    _refuse_formula(what, version, conversions[number, index])
    _refuse_formula(f"the time of {what}", version, conversions.get(master))
    unit = getattr(channel, "unit", "") or getattr(conversions[number, index], "unit", "")
    axis = axes.setdefault(number, _Array(shape, instants))
    return _Channel(channel.name, str(unit), axis, _Array(shape, values))


def _refuse_formula(what: str, version: str, conversion: Any) -> None:
    if conversion is not None and conversion.conversion_type not in _NUMERIC[version]:
        raise InputError(
            f"{what} is converted to text or by a formula, which is not run: export it with "
            "converted numbers, or with a linear conversion"
        )


def _converted(version: str, conversion: Any, raw: Any) -> Iterator[npt.NDArray[Any]]:
    """Apply a conversion in blocks, without the library's formulas for rational functions."""
    kind = None if conversion is None else conversion.conversion_type
    for part in blocks(len(raw)):
        x = raw[part]
        if kind == _RATIONAL[version]:
            p1, p2, p3, p4, p5, p6 = (getattr(conversion, f"P{k}") for k in range(1, 7))
            x = x.astype(np.float64)
            yield (p1 * x**2 + p2 * x + p3) / (p4 * x**2 + p5 * x + p6)
        elif version == "3" and kind == _POLYNOMIAL:
            p1, p2, p3, p4, p5, p6 = (getattr(conversion, f"P{k}") for k in range(1, 7))
            x = x.astype(np.float64) - p5 - p6
            yield (p2 - p4 * x) / (p3 * x - p1)
        elif version == "4" and kind == _RANGES:
            yield _of_ranges(conversion, x)
        else:
            yield x if conversion is None else conversion.convert(x)


def _of_ranges(conversion: Any, x: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Look numbers up; the library finds a whole number only at the ends of its range."""
    lower, upper, values = (
        np.array([conversion[f"{name}_{k}"] for k in range((conversion.val_param_nr - 1) // 3)])
        for name in ("lower", "upper", "phys")
    )
    at = np.searchsorted(lower, x, side="right") - 1
    within = x < upper[at] if x.dtype.kind == "f" else x <= upper[at]
    return np.where((at >= 0) & within, values[at], conversion.default)


_LEAD_IN = 28
"""Bytes before each segment of a TDMS file; the last 16 say how far it goes."""


@contextmanager
def _tdms(path: Path) -> Iterator[_Channels]:
    nptdms = importlib.import_module("nptdms")
    # given a path, the library would read an index file beside it
    with path.open("rb") as source:
        size, end = os.fstat(source.fileno()).st_size, 0
        while end < size:
            source.seek(end + 12)
            end += _LEAD_IN + int.from_bytes(source.read(8), "little")
        if end != size:  # the library reads what is there in silence
            raise InputError("its last segment is cut off: copy it again")
        source.seek(0)
        with nptdms.TdmsFile.open(source) as file:
            axes: dict[tuple[float, float, int], _Array] = {}
            yield [
                (channel.name, partial(_of_tdms, file, group, channel, axes))
                for group in file.groups()
                for channel in group.channels()
            ]


def _of_tdms(file: Any, group: Any, channel: Any, axes: dict[Any, _Array]) -> _Channel:
    what, properties = f"channel '{channel.name}'", channel.properties
    if "wf_increment" not in properties:
        raise InputError(f"{what} has no property wf_increment: write it as a waveform")
    _check_scales(what, file, group, channel)
    _check_numbers(what, 1, np.dtype(channel.dtype))
    unit = properties.get("unit_string") or properties.get("NI_UnitDescription") or ""
    step, start = float(properties["wf_increment"]), float(properties.get("wf_start_offset", 0.0))
    n = len(channel)
    axis = axes.setdefault(
        (start, step, n), _Array((n,), lambda: (start + step * k for k in _indices(n)))
    )

    def values() -> Iterator[npt.NDArray[Any]]:
        return (chunk[:] for chunk in channel.data_chunks())

    return _Channel(channel.name, str(unit), axis, _Array((n,), values))


def _indices(n: int) -> Iterator[npt.NDArray[np.int64]]:
    return (np.arange(part.start, part.stop) for part in blocks(n))


_SCALE_TYPE = re.compile(r"NI_Scale\[(\d+)\]_Scale_Type")
_SCALES = (
    "Polynomial",
    "Linear",
    "RTD",
    "Strain",
    "Table",
    "Thermistor",
    "Thermocouple",
    "Add",
    "Subtract",
    "AdvancedAPI",
)
"""Types of scales that npTDMS applies; of any other it returns the raw numbers without a word."""


def _check_scales(what: str, file: Any, group: Any, channel: Any) -> None:
    """Refuse raw numbers whose way into the channel's unit is not known."""
    for properties in (channel.properties, group.properties, file.properties):
        types = {
            int(match[1]): properties[match[0]]
            for match in map(_SCALE_TYPE.fullmatch, properties)
            if match
        }
        status = properties.get("NI_Scaling_Status")
        if status == "scaled":
            return
        number = int(properties.get("NI_Number_Of_Scales", max(types, default=-1) + 1))
        if not channel.scaler_data_types:  # scalers of a DAQmx recording state no type
            types = {k: types.get(k, "") for k in range(number)} | types
        unknown = {k: kind for k, kind in types.items() if kind not in _SCALES or k >= number}
        if unknown:
            k, kind = min(unknown.items())
            raise InputError(
                f"{what} has raw numbers, whose scale {k} of type '{kind}' is not known: export it "
                "scaled, such as by 'Write to Measurement File' or DIAdem"
            )
        if number > 0:
            return
        if status == "unscaled":
            raise InputError(f"{what} has raw numbers and states no scale: export it scaled")


@contextmanager
def _opened_hdf5(path: Path) -> Iterator[Any]:
    """Open a file whose links all stay in it."""
    h5py = importlib.import_module("h5py")

    def leading_out(name: str, link: Any) -> str | None:
        return None if isinstance(link, h5py.HardLink | h5py.SoftLink) else name

    with h5py.File(path, "r") as file:
        if name := file.visititems_links(leading_out):
            raise InputError(
                f"'{name}' is a link to another file, which is not read: save it in the file itself"
            )
        yield file


def _check_stored_inside(data: Any) -> None:
    """Refuse a data set whose numbers are those of another file, or that is unpacked at once."""
    what = f"data set '{data.name}'"
    if data.external or data.is_virtual:
        raise InputError(
            f"{what} takes its numbers from another file, which is not read: save it in the file "
            "itself"
        )
    chunk = math.prod(data.chunks or ()) * data.dtype.itemsize
    if chunk > LARGEST_CHUNK:
        raise InputError(
            f"{what} is stored in chunks of {chunk / MEBIBYTE:.0f} MiB, at most "
            f"{LARGEST_CHUNK / MEBIBYTE:.0f} MiB are read: save it in smaller chunks"
        )


@contextmanager
def _hdf5(path: Path) -> Iterator[_Channels]:
    with _opened_hdf5(path) as file:
        names: list[str] = []
        file.visit(names.append)
        axes: dict[tuple[str, int], _Array] = {}
        yield [
            (name.rpartition("/")[2], partial(_of_hdf5, file[name], axes))
            for name in names
            if hasattr(file[name], "shape") and file[name].name.rpartition("/")[2] != "time"
        ]


def _of_hdf5(data: Any, axes: dict[tuple[str, int], _Array]) -> _Channel:
    around = (data, data.parent, data.file)
    unit = next((data.attrs[key] for key in ("unit", "units") if key in data.attrs), "")
    unit = unit.decode() if isinstance(unit, bytes) else unit
    values = _data_set(data)
    (n,) = values.shape
    if "time" in data.parent:
        time = data.parent["time"]
        if not hasattr(time, "shape"):
            raise InputError(f"'{time.name}' is a group and no data set: save instants there")
        axis = axes.get((time.name, 0)) or axes.setdefault((time.name, 0), _data_set(time))
        return _Channel(data.name.rpartition("/")[2], str(unit), axis, values)
    rate = next((each.attrs["sample_rate"] for each in around if "sample_rate" in each.attrs), 0.0)
    if not float(rate) > 0:
        raise InputError(
            f"data set '{data.name}' has neither a data set 'time' [s] beside it nor an attribute "
            "'sample_rate' [Hz]: add one of them"
        )
    axis = axes.setdefault(
        (str(float(rate)), n), _Array((n,), lambda: (k / float(rate) for k in _indices(n)))
    )
    return _Channel(data.name.rpartition("/")[2], str(unit), axis, values)


def _data_set(data: Any) -> _Array:
    _check_numbers(f"data set '{data.name}'", data.ndim, data.dtype)
    _check_stored_inside(data)
    (n,) = data.shape
    # a chunk is unpacked once
    step = -(-BLOCK // data.chunks[0]) * data.chunks[0] if data.chunks else BLOCK
    return _Array((n,), lambda: (data[start : start + step] for start in range(0, n, step)))


def _columns(path: Path, kind: str, axis: str) -> dict[str, Any]:
    """Write lines and values of a MATLAB file, and answer with names and units of the columns."""
    variables = (axis, "names", "values", "units")
    read = _variables_of_hdf5 if kind == MATLAB_73 else _variables
    content, structures = read(path, variables)
    missing = [name for name in variables if name not in content]
    if missing:
        unit = "Hz" if axis == "frequency" else "s"
        other = (
            f" ({', '.join(structures)}: MATLAB structures, such as Simcenter Testlab saves; from "
            "there export universal files, data set 58)"
            if structures
            else ""
        )
        raise InputError(
            f"there is no variable {', '.join(map(repr, missing))}{other}: save {axis} [{unit}], "
            "names (cell array of text; of strings, cellstr(names)), values (lines x names) and "
            "units, each a variable of its own"
        )
    names, units = (
        [str(text).strip() for text in np.ravel(content[name])] for name in ("names", "units")
    )
    units = units * len(names) if len(units) == 1 else units
    lines, values = np.ravel(content[axis]), np.asarray(content["values"])
    if lines.dtype.kind not in "biuf" or values.dtype.kind not in "biufc":
        raise InputError(f"variables '{axis}' and 'values' must be numbers")
    values = values.reshape(-1, 1) if values.ndim < 2 and len(names) == 1 else values
    if values.shape != (lines.size, len(names)) or len(units) != len(names):
        raise InputError(
            f"{lines.size} lines of {axis}, {len(names)} names, {len(units)} units and values of "
            f"size {' x '.join(map(str, values.shape))} do not fit together: values need one row "
            "per line and one column per name, units one text for all or one per name"
        )
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled is not None:
        raise InputError(f"the name '{doubled}' comes twice in 'names': keep one")
    is_real = values.dtype.kind != "c" or not any(np.any(column.imag) for column in values.T)
    columns = (column.real if is_real else column for column in values.T)
    _write(
        [
            _Array(lines.shape, lambda: [lines]),
            _Array(values.shape, lambda: columns, "<f8" if is_real else "<c16"),
        ]
    )
    return {"names": names, "units": units, "arrays": 2}


def _variables(path: Path, names: Sequence[str]) -> tuple[dict[str, Any], list[str]]:
    """Return variables of a file of version 4 to 7.2, and the names of its structures."""
    io = importlib.import_module("scipy.io")
    stated = io.whosmat(path, appendmat=False)
    for name, shape, _ in stated:
        if name in names:
            refuse_announced(f"variable '{name}'", math.prod(shape))
    content = io.loadmat(path, appendmat=False, squeeze_me=True, variable_names=list(names))
    return content, [name for name, _, kind in stated if kind == "struct"]


def _variables_of_hdf5(path: Path, names: Sequence[str]) -> tuple[dict[str, Any], list[str]]:
    """Return the same of a file of version 7.3: HDF5 with turned axes, and texts as numbers."""
    h5py = importlib.import_module("h5py")

    def plain(name: str, file: Any, data: Any, *, inside: bool = False) -> Any:
        kind = data.attrs.get("MATLAB_class", b"").decode()
        if kind == "string" or "MATLAB_object_decode" in data.attrs or hasattr(data, "keys"):
            remedy = f"cellstr({name})" if kind == "string" else "numbers, or text in a cell array"
            raise InputError(f"variable '{name}' is of MATLAB's class {kind}: save {remedy}")
        refuse_announced(f"data set '{data.name}'", math.prod(map(int, data.shape)))
        _check_stored_inside(data)
        if data.dtype == h5py.ref_dtype:
            if inside:
                raise ValueError("a cell holds cells")
            cells = [plain(name, file, file[each], inside=True) for each in np.ravel(data[()])]
            return np.array([str(cell) for cell in cells])
        if kind == "char":
            empty = data.attrs.get("MATLAB_empty", 0)
            return np.array("" if empty else "".join(map(chr, np.ravel(data[()].T))))
        values = data[()].T
        return values["real"] + 1j * values["imag"] if values.dtype.names else values

    with _opened_hdf5(path) as file:
        structures = [name for name in file if file[name].attrs.get("MATLAB_class") == b"struct"]
        return {name: plain(name, file, file[name]) for name in names if name in file}, structures


_FORMATS: Mapping[str, Callable[[Path], AbstractContextManager[_Channels]]] = {
    MDF: _mdf,
    TDMS: _tdms,
    HDF5: _hdf5,
}


def _answer(path: str, kind: str, names: Sequence[str]) -> dict[str, Any]:
    """Return what a file holds, or why it could not be read."""
    _limit(None)
    try:
        importlib.import_module(LIBRARIES[kind][0])
    except ImportError as error:
        return {"lacks": str(error)}
    _limit(LARGEST_MEMORY)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if kind in _FORMATS:
                return _signals(Path(path), kind, names)
            return _columns(Path(path), kind, *names)
    except InputError as error:
        return {"refused": str(error)}
    except MemoryError:
        return {"fault": "memory"}
    except Exception as error:  # each library has a dozen kinds
        full = isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT)
        return {"fault": "disk" if full else "damage"}


def _limit(memory: int | None) -> None:
    """Let the process take so much more memory, and time for one file; Windows limits neither."""
    try:
        resource = importlib.import_module("resource")
    except ImportError:
        return
    used = resource.getrusage(resource.RUSAGE_SELF)
    limits = {
        resource.RLIMIT_CPU: math.ceil(used.ru_utime + used.ru_stime) + LONGEST_READING,
        resource.RLIMIT_FSIZE: LARGEST_MEMORY,
        resource.RLIMIT_AS: resource.RLIM_INFINITY,
    }
    statistics = Path("/proc/self/statm")
    if memory is not None and statistics.exists():
        pages = int(statistics.read_text(encoding="ascii").split()[0])
        limits[resource.RLIMIT_AS] = pages * resource.getpagesize() + memory
    for kind, wanted in limits.items():
        _, most = resource.getrlimit(kind)
        beyond = wanted == resource.RLIM_INFINITY or wanted > most != resource.RLIM_INFINITY
        resource.setrlimit(kind, (most if beyond else wanted, most))


def main() -> None:
    """Answer the tasks of the standard input, until it ends."""
    # what a library prints is no answer
    with os.fdopen(os.dup(1), "w", encoding="ascii") as answers:
        os.dup2(2, 1)
        for line in sys.stdin:
            print(json.dumps(_answer(*json.loads(line))), file=answers, flush=True)
    folder = Path.cwd()
    os.chdir(folder.parent)
    with suppress(OSError):  # deboom removes it as well, unless it was killed
        folder.rmdir()


if __name__ == "__main__":
    main()
