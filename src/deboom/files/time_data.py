"""Time data of measuring systems: MDF, TDMS, HDF5, MATLAB, LabVIEW LVM, WAV and UFF."""

from __future__ import annotations

import io
import math
import re
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from traceback import walk_tb
from typing import Annotated, Any

import numpy as np
from scipy.io import wavfile

from deboom.arrays import RealArray, RealOrComplexArray
from deboom.errors import InputError, naming
from deboom.files.disk import kind_of, library, read_bytes, refuse_announced
from deboom.files.function_table import TIME_SIGNAL, matlab_table
from deboom.files.rows import CampaignChannel
from deboom.files.schema import noting, telling
from deboom.files.tables import InUnitOfRow, TableRow, number_in, read_table
from deboom.files.uff import UffFunction, read_uff
from deboom.files.units import Unit, parse_unit

LARGEST_JITTER = 0.05
"""Largest distance of a sample from an even step, in steps."""


@dataclass(frozen=True, eq=False)
class TimeSignal:
    """Signal of one channel over time, as it stands in its file.

    - `unit`: label of the file; ``""`` where it states none.
    - `time` (n,): instants of the samples [s].
    - `values` (n,): [unit].
    """

    unit: str
    time: RealArray
    values: RealArray


_Loaded = tuple[str, Any, Any]
"""Unit, instants [s] and values of a channel."""
_Channels = Iterator[tuple[str, Callable[[], _Loaded]]]
"""Name of every channel, and what reads it."""


def read_time_signals(path: Path, names: Sequence[str]) -> dict[str, TimeSignal]:
    """Read channels of a file by their names.

    - `path`: MDF, TDMS, HDF5, MATLAB, LVM or WAV file; its content tells which.
    - `names`: channels that are read where the file has them.
    - returns: name to signal, in the order of `names`; a name that the file lacks is left out.
    - raises InputError: a file of another kind or damaged, a library that is not installed, none of
      the channels, one that comes twice or holds no numbers. Even sampling is not checked.
    """
    kind = kind_of(path)
    if kind not in _READERS:
        raise InputError(
            f"{path} is {kind}: time data are read from UFF, {', '.join(_ENDINGS)}; export it as "
            "one of these"
        )
    loaded = defaultdict[str, list[_Loaded]](list)
    there: list[str] = []
    with _readable(path, kind):
        for name, load in _READERS[kind](path):
            there.append(name)
            if name in names:
                loaded[name].append(load())
    if not loaded:
        more = f" and {len(there) - 5} more" if len(there) > 5 else ""
        holds = f"it holds {', '.join(map(repr, there[:5]))}{more}" if there else "it holds none"
        raise InputError(
            f"{path}: none of its channels is in the channel table; {holds}: name them alike"
        )
    with telling(None) as tell:
        signals = {}
        for name in names:
            with noting(tell):
                if name in loaded:
                    signals[name] = _signal(f"{path}: channel '{name}'", loaded[name])
    return signals


def _signal(what: str, loaded: Sequence[_Loaded]) -> TimeSignal:
    if len(loaded) > 1:
        raise InputError(f"{what} comes {len(loaded)} times: keep or rename one")
    (unit, instants, values), *_ = loaded
    numbers = np.asarray(values)
    if numbers.ndim != 1 or numbers.dtype.kind not in "biuf":
        raise InputError(f"{what} holds no numbers over time: export it as a signal")
    time = np.asarray(instants, dtype=np.float64)
    if time.shape != numbers.shape or time.size < 2:
        raise InputError(f"{what} has {numbers.size} values at {time.size} instants: export again")
    return TimeSignal(str(unit), time, numbers.astype(np.float64))


def time_functions(path: Path, channels: Sequence[CampaignChannel]) -> tuple[UffFunction, ...]:
    """Read signals over time at the degrees of freedom of a channel table.

    - `path`: UFF, where node and direction say which channel is which; or a file of
      `read_time_signals`, whose names are ``<channel>`` or ``<channel> <quantity>``.
    - `channels`: rows of the table that are wanted.
    - returns: in SI, one per row of `channels`; of a UFF file all its functions.
    - raises InputError: as `read_uff` or `read_time_signals`; a channel that is missing or states
      no unit; one that is not sampled evenly.
    """
    if kind_of(path) == "a UFF file":
        whole = read_uff(path)
        _check_even(path, [(function.dof, function.abscissa) for function in whole])
        return whole
    names = [(f"{row.channel} {row.quantity}", row.channel) for row in channels]
    signals = read_time_signals(path, [name for pair in names for name in pair])
    functions = []
    with telling(None) as tell:
        for row, pair in zip(channels, names, strict=True):
            with noting(tell):
                name = next((name for name in pair if name in signals), "")
                if not name:
                    raise InputError(
                        f"{path}: there is no channel '{row.channel}' ({row.quantity}): export it, "
                        "or name it as the channel table does"
                    )
                functions.append(_function(f"{path}: channel '{name}'", row, signals[name]))
        _check_even(path, [(name, signal.time) for name, signal in signals.items()])
    return tuple(functions)


def _function(what: str, row: CampaignChannel, signal: TimeSignal) -> UffFunction:
    # pulses of a tacho count, their height in whatever unit does not
    unit = Unit("1", "1", 1.0)
    if row.quantity != "tacho":
        if not signal.unit.strip():
            raise InputError(f"{what} states no unit: export it with one, such as {row.unit.label}")
        with naming(what):
            unit = parse_unit(signal.unit)
    with naming(what):
        return UffFunction(
            abscissa=signal.time,
            values=signal.values * unit.factor,
            function_type=TIME_SIGNAL,
            response_node=row.node,
            response_direction=row.direction,
            ordinate=row.ordinate,
            ordinate_unit=unit.si,
            file_unit=unit.label,
        )


def _check_even(path: Path, axes: Sequence[tuple[str, RealArray]]) -> None:
    """Refuse instants that are not evenly spaced: filters and angles need a rate."""
    seen: set[int] = set()
    for name, time in axes:
        step = (time[-1] - time[0]) / (time.size - 1)
        if id(time) in seen or not step > 0:  # instants that do not rise are refused elsewhere
            continue
        seen.add(id(time))
        off = np.abs(time - time[0] - step * np.arange(time.size)) / step
        if off.max() > LARGEST_JITTER:
            k = int(np.argmax(off))
            raise InputError(
                f"{path}: {name} is not sampled evenly: sample {k + 1} at {time[k]:.9g} s is "
                f"{off[k]:.2g} steps off; export it with one sampling rate"
            )


@contextmanager
def _readable(path: Path, kind: str) -> Iterator[None]:
    """Make one sentence of whatever a library raises on a damaged file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception:  # each library has a dozen kinds
        raise InputError(f"{path} is {kind}, but damaged: export it again") from None


def _mdf(path: Path) -> _Channels:
    opened = library(path, "asammdf", "mdf").MDF
    try:
        file = opened(io.BytesIO(read_bytes(path)))
    except Exception as error:
        # left half open, the library would complain on the console when it is cleared away
        for frame, _ in walk_tb(error.__traceback__):
            half: Any = frame.f_locals.get("self")
            if hasattr(half, "_tempfile"):
                half._tempfile.close()
                half._closed = True
        raise
    with file:
        for number, group in enumerate(file.groups):
            master = file.masters_db.get(number)
            for index, channel in enumerate(group.channels):
                if index != master:
                    yield channel.name, partial(_of_mdf, path, file, number, index)


def _of_mdf(path: Path, file: Any, group: int, index: int) -> _Loaded:
    header = file.groups[group].channel_group
    refuse_announced(f"{path}: group {group + 1}", max(header.cycles_nr, 0))
    # without this, invalid samples are left out in silence
    signal = file.get(None, group, index, ignore_invalidation_bits=True)
    invalid = 0 if signal.invalidation_bits is None else int(np.sum(signal.invalidation_bits))
    if invalid:
        raise InputError(
            f"{path}: channel '{signal.name}' has {invalid} samples that are marked invalid: cut "
            "them off, deboom does not fill gaps"
        )
    return signal.unit, signal.timestamps, signal.samples


_LEAD_IN = 28
"""Bytes before each segment of a TDMS file; the last 16 say how far it goes."""


def _tdms(path: Path) -> _Channels:
    data, end = read_bytes(path), 0
    while end < len(data):
        end += _LEAD_IN + int.from_bytes(data[end + 12 : end + 20], "little")
    if end != len(data):  # the library reads what is there in silence
        raise InputError(f"{path} is a TDMS file, but its last segment is cut off: copy it again")
    with library(path, "nptdms", "tdms").TdmsFile.open(path) as file:
        for group in file.groups():
            for channel in group.channels():
                yield channel.name, partial(_of_tdms, path, channel)


def _of_tdms(path: Path, channel: Any) -> _Loaded:
    properties = channel.properties
    if "wf_increment" not in properties:
        raise InputError(
            f"{path}: channel '{channel.name}' has no property wf_increment: write it as a waveform"
        )
    refuse_announced(f"{path}: channel '{channel.name}'", len(channel))
    unit = properties.get("unit_string") or properties.get("NI_UnitDescription") or ""
    step, start = properties["wf_increment"], properties.get("wf_start_offset", 0.0)
    return unit, start + step * np.arange(len(channel)), channel[:]


def _hdf5(path: Path) -> _Channels:
    with library(path, "h5py", "hdf5").File(path, "r") as file:
        names: list[str] = []
        file.visit(names.append)
        for name in names:
            if hasattr(file[name], "shape") and file[name].name.rpartition("/")[2] != "time":
                yield name.rpartition("/")[2], partial(_of_hdf5, path, file[name])


def _of_hdf5(path: Path, data: Any) -> _Loaded:
    refuse_announced(f"{path}: data set '{data.name}'", math.prod(map(int, data.shape)))
    around = (data, data.parent, data.file)
    unit = next((data.attrs[key] for key in ("unit", "units") if key in data.attrs), "")
    unit = unit.decode() if isinstance(unit, bytes) else unit
    if "time" in data.parent:
        announced = math.prod(map(int, data.parent["time"].shape))
        refuse_announced(f"{path}: the time of '{data.name}'", announced)
        return unit, data.parent["time"][:], data[:]
    rate = next((each.attrs["sample_rate"] for each in around if "sample_rate" in each.attrs), 0.0)
    if not float(rate) > 0:
        raise InputError(
            f"{path}: data set '{data.name}' has neither a data set 'time' [s] beside it nor an "
            "attribute 'sample_rate' [Hz]: add one of them"
        )
    return unit, np.arange(data.shape[0]) / float(rate), data[:]


def _matlab(path: Path) -> _Channels:
    time, columns = matlab_table(path, "time")
    for name, (unit, values) in columns.items():
        yield name, partial(_loaded, unit, time, values if np.any(values.imag) else values.real)


def _loaded(unit: str, time: RealArray, values: RealOrComplexArray) -> _Loaded:
    return unit, time, values


@dataclass(frozen=True)
class WavChannel(TableRow):
    """Calibration of one track of a WAV file, in the order of the tracks.

    - `channel`: name of the channel.
    - `full_scale`: value at the largest number that the file can hold, in SI; in the table [unit].
    - `unit`: unit of the channel, such as ``Pa``.
    """

    unique = ("channel '{0.channel}'",)
    channel: str
    full_scale: Annotated[float, InUnitOfRow]
    unit: Unit

    def _check(self) -> None:
        if not 0 < self.full_scale < math.inf:
            raise InputError(f"full_scale of '{self.channel}' is not positive: state it")


def _wav(path: Path) -> _Channels:
    data = read_bytes(path)
    stated = 8 + int.from_bytes(data[4:8], "little")
    if data[:4] == b"RIFF" and len(data) < stated:
        raise InputError(f"{path} has {len(data)} of {stated} bytes: copy it again")
    rate, tracks = wavfile.read(io.BytesIO(data))
    tracks = tracks[:, np.newaxis] if tracks.ndim == 1 else tracks
    table = path.with_suffix(".csv")
    if not table.is_file():
        raise InputError(
            f"{path} states no calibration: write {table.name} beside it with the columns channel, "
            "full_scale, unit and one row per track, such as 'driver ear,20,Pa'"
        )
    rows = read_table(table, WavChannel)
    if len(rows) != tracks.shape[1]:
        raise InputError(
            f"{table} has {len(rows)} rows and {path.name} {tracks.shape[1]} tracks: one row each"
        )
    kind = tracks.dtype
    largest = 1.0 if kind.kind == "f" else -float(np.iinfo(kind).min) or 128.0
    middle = 128.0 if kind == np.uint8 else 0.0
    time = np.arange(len(tracks)) / rate
    for row, track in zip(rows, tracks.T, strict=True):
        scale = row.full_scale / row.unit.factor / largest
        values = (track.astype(np.float64) - middle) * scale
        yield row.channel, partial(_loaded, row.unit.label, time, values)


_END = "***End_of_Header***"


def _lvm(path: Path) -> _Channels:
    """LabVIEW's text: a header of the file, one of the segment, names, and a line per sample."""
    lines = read_bytes(path).decode("utf-8", errors="replace").splitlines()
    ends = [k for k, line in enumerate(lines) if line.strip().startswith(_END)]
    if len(ends) != 2:
        raise InputError(
            f"{path} has {max(len(ends) - 1, 0)} segments: save it with one header and one segment"
        )
    facts = dict(re.split(r"[\t,]", f"{line}\t", maxsplit=1) for line in lines[: ends[0]])
    separator = "," if facts.get("Separator", "").strip() == "Comma" else "\t"
    comma = facts.get("Decimal_Separator", "").strip() == ","
    head = {cells[0]: cells[1:] for cells in (line.split(separator) for line in lines[: ends[1]])}
    names, *rows = (line.split(separator) for line in lines[ends[1] + 1 :] if line.strip())
    n_channel, layout = int(head["Channels"][0]), head["X_Columns"][0]
    columns = {"No": range(n_channel), "One": range(1, n_channel + 1)}.get(
        layout, range(1, 2 * n_channel, 2)
    )
    short = next((k for k, row in enumerate(rows, 1) if len(row) <= columns[-1]), None)
    if short is not None:
        raise InputError(f"{path}: sample {short} has too few columns: export the file again")
    for k, column in enumerate(columns):
        values = _lvm_numbers(rows, column, comma)
        if layout == "No":
            start, step = (_lvm_numbers([head[key]], k, comma)[0] for key in ("X0", "Delta_X"))
            time = start + step * np.arange(len(values))
        else:
            time = _lvm_numbers(rows, 0 if layout == "One" else column - 1, comma)
        unit = head.get("Y_Unit_Label", [""] * n_channel)[k]
        yield names[column].strip(), partial(_loaded, unit, time, values)


def _lvm_numbers(rows: Sequence[Sequence[str]], column: int, comma: bool) -> RealArray:
    texts = (row[column].strip() for row in rows)
    return np.array([number_in(text.replace(",", ".") if comma else text) for text in texts])


_READERS: Mapping[str, Callable[[Path], _Channels]] = {
    "an MDF file": _mdf,
    "a TDMS file": _tdms,
    "an HDF5 file": _hdf5,
    "a MATLAB file": _matlab,
    "a LabVIEW measurement file": _lvm,
    "a WAV file": _wav,
}
_ENDINGS = ("MDF (.mf4)", "TDMS", "HDF5", "MATLAB (.mat)", "LabVIEW (.lvm)", "WAV")
