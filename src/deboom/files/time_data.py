"""Time data of measuring systems: MDF, TDMS, HDF5, MATLAB, LabVIEW LVM, WAV, CSV, xlsx, UFF."""

from __future__ import annotations

import math
import os
import re
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.io import wavfile
from scipy.signal import resample_poly

from deboom.arrays import PERCENT, RealArray
from deboom.errors import InputError, naming
from deboom.files.binary_formats import HDF5, MATLAB, MDF, TDMS
from deboom.files.disk import (
    LARGEST_FILE,
    MEBIBYTE,
    blocks,
    kind_of,
    opened_file,
    refuse_announced,
    text_of,
)
from deboom.files.function_table import (
    SAME_LINE,
    TIME_SIGNAL,
    matlab_table,
    real_where_it_is,
    same_lines,
)
from deboom.files.reader_process import read_apart
from deboom.files.rows import CAMPAIGN_QUANTITIES, CampaignChannel
from deboom.files.schema import noting, telling
from deboom.files.tables import (
    Columns,
    Numbers,
    TableRow,
    name_and_unit,
    number_in,
    read_columns,
    read_table,
)
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
    - `note`: which of several rasters of one name it is; ``""`` where there is one.
    """

    unit: str
    time: RealArray
    values: RealArray
    note: str = ""


_Loaded = tuple[str, Any, Any]
"""Unit, instants [s] and values of a channel."""
_Channels = Iterator[tuple[str, _Loaded | None]]
"""Name of every channel, and what the file has of it; None where it is not asked for."""


def read_time_signals(path: Path, names: Sequence[str] | None) -> dict[str, TimeSignal]:
    """Read channels of a file by their names.

    - `path`: MDF, TDMS, HDF5, MATLAB, LVM or WAV file, whose content tells which; or CSV or xlsx.
    - `names`: channels that are read where the file has them; None reads all of them.
    - returns: name to signal, in the order of `names`; a name that the file lacks is left out.
    - raises InputError: a file of another kind or damaged, a library that is not installed, none of
      the channels, one that comes twice or holds no numbers. Even sampling is not checked.
    """
    kind = _TABLE if _is_table(path) else kind_of(path)
    if kind not in _READERS:
        raise InputError(
            f"{path} is {kind}: time data are read from UFF, {', '.join(_FORMATS)}; export it as "
            "one of these"
        )
    loaded = defaultdict[str, list[_Loaded]](list)
    channels: list[str] = []
    with _readable(path, kind):
        if names is None:
            names = tuple(dict.fromkeys(name for name, _ in _READERS[kind](path, ())))
        for name, content in _READERS[kind](path, names):
            channels.append(name)
            if content is not None:
                loaded[name].append(content)
    if not loaded:
        more = f" and {len(channels) - 5} more" if len(channels) > 5 else ""
        holds = (
            f"it holds {', '.join(map(repr, channels[:5]))}{more}" if channels else "it holds none"
        )
        raise InputError(
            f"{path}: none of its channels is in the channel table; {holds}: name them alike"
        )
    with telling() as tell:
        signals = {}
        for name in names:
            with noting(tell):
                if name in loaded:
                    signals[name] = _signal(f"{path}: channel '{name}'", loaded[name])
    return signals


def _signal(what: str, loaded: Sequence[_Loaded]) -> TimeSignal:
    signals = [_single_signal(what, *each) for each in loaded]
    if len(signals) == 1:
        return signals[0]
    rates = [_rate(signal.time) for signal in signals]
    fastest = int(np.argmax(rates))
    listed = " and ".join(f"{rate:.6g} Hz" for rate in rates)
    others = [rate for k, rate in enumerate(rates) if k != fastest]
    if max(others) > rates[fastest] * (1 - LARGEST_JITTER):
        raise InputError(
            f"{what} comes {len(loaded)} times, at {listed}: keep or rename one, such as with its "
            "quantity"
        )
    note = f"{what} comes {len(loaded)} times, at {listed}: that at {rates[fastest]:.6g} Hz is used"
    return replace(signals[fastest], note=note)


def _single_signal(what: str, unit: Any, instants: Any, values: Any) -> TimeSignal:
    if np.iscomplexobj(values):
        raise InputError(f"{what} holds no numbers over time: export it as a signal")
    if instants.shape != values.shape or instants.size < 2:
        raise InputError(
            f"{what} has {values.size} values at {instants.size} instants: export again"
        )
    if any(np.isnan(values[part]).any() for part in blocks(values.size)):
        # a slower channel has holes beside a faster one; whether one is missing is checked later
        filled = ~np.isnan(values)
        instants, values = instants[filled], values[filled]
        if values.size < 2:
            raise InputError(f"{what} has {values.size} values: export it again")
    instants.setflags(write=False)  # channels of one raster share it
    return TimeSignal(str(unit), instants, values)


@dataclass(frozen=True, eq=False)
class TimeFunctions:
    """Signals of a recording on one raster.

    - `functions`: in SI, all at the same instants.
    - `rates`: channels to their sampling rate in the file [Hz], in the order of `functions`.
    - `notes`: what was resampled or chosen, in words.
    """

    functions: tuple[UffFunction, ...]
    rates: tuple[float, ...]
    notes: tuple[str, ...] = ()


def time_functions(path: Path, channels: Sequence[CampaignChannel]) -> TimeFunctions:
    """Read signals over time at the degrees of freedom of a channel table, on one raster.

    - `path`: UFF, where node and direction say which channel is which; or a file of
      `read_time_signals`, whose names are ``<channel>`` or ``<channel> <quantity>``.
    - `channels`: rows of the table that are wanted.
    - returns: one per row of `channels`; of a UFF file all its functions. Slower channels are
      resampled to the raster of the fastest, band-limited, over the time that all of them cover.
      `SLOW_QUANTITIES` may come at uneven instants, as from a bus, and are interpolated between.
    - raises InputError: as `read_uff` or `read_time_signals`; a channel that is missing or states
      no unit; another one that is not sampled evenly, or one with a gap; channels that overlap by
      too little.
    """
    if kind_of(path) == "a UFF file":
        whole = read_uff(path)
        by_dof = {(row.node, row.direction.lstrip("+-"), row.ordinate): row for row in channels}
        labels, quantities, functions = [], [], []
        for function in whole:
            values = real_where_it_is(function.values)
            if np.iscomplexobj(values):
                raise InputError(f"{path}: {function.dof} is complex: export it as a signal")
            if np.iscomplexobj(function.values):
                function = replace(function, values=values)
            functions.append(function)
            at = function.response_node, function.response_direction.lstrip("+-")
            row = by_dof.get((*at, function.ordinate))
            if row and row.quantity == "tacho":  # its pulses count, in whatever unit
                functions[-1] = replace(functions[-1], ordinate_unit="1", file_unit="1")
            labels.append(f"{row.channel} ({row.quantity})" if row else function.dof)
            quantities.append(row.quantity if row else "")
        return _on_one_raster(path, labels, functions, quantities)
    names = [(f"{row.channel} {row.quantity}", row.channel) for row in channels]
    signals = read_time_signals(path, [name for pair in names for name in pair])
    functions = []
    chosen = [next((name for name in pair if name in signals), "") for pair in names]
    with telling() as tell:
        for row, name in zip(channels, chosen, strict=True):
            with noting(tell):
                if not name:
                    raise InputError(
                        f"{path}: there is no channel '{row.channel}' ({row.quantity}): export it, "
                        "or name it as the channel table does"
                    )
                what, signal = f"{path}: channel '{name}'", signals[name]
                unit = _unit(what, row, signal)
                if unit.factor != 1.0 and chosen.count(name) == 1:
                    signal.values[:] *= unit.factor  # a copy would double the memory
                elif unit.factor != 1.0:
                    signal = replace(signal, values=signal.values * unit.factor)
                functions.append(_function(what, row, signal, unit))
    labels = [f"{row.channel} ({row.quantity})" for row in channels]
    several = tuple(signal.note for signal in signals.values() if signal.note)
    read = _on_one_raster(path, labels, functions, [row.quantity for row in channels])
    return replace(read, notes=(*several, *read.notes))


SLOW_QUANTITIES = ("engine torque", "engine speed", "static force")
"""Quantities that change little from one instant of a bus to the next."""
LONGEST_INTERVAL = 1.5
"""Longest interval between samples, in median ones: in a longer one a sample is missing."""
LEAST_OVERLAP = 0.5
"""Share of the longest channel that all channels must cover."""
OVERSAMPLED = 8
"""Samples per sample of a slow channel through which a cubic spline is laid."""


_PART, _MARGIN = 2**17, 64
"""Samples of a slow channel that are resampled at once, and more on both sides, whose influence on
them is below rounding."""


def _rate(time: RealArray) -> float:
    return (time.size - 1) / float(time[-1] - time[0])


def _on_one_raster(
    path: Path,
    labels: Sequence[str],
    functions: Sequence[UffFunction],
    quantities: Sequence[str],
) -> TimeFunctions:
    """Resample what is slower than the fastest channel, and cut all to the time they share."""
    rates = tuple(_rate(function.abscissa) for function in functions)
    if not functions:
        return TimeFunctions((), ())
    fastest = int(np.argmax(rates))
    on_bus = [
        quantity in SLOW_QUANTITIES and rate < rates[fastest]
        for quantity, rate in zip(quantities, rates, strict=True)
    ]
    axes = [function.abscissa for function in functions]
    _check_instants(path, list(zip(labels, axes, on_bus, strict=True)))
    raster = functions[fastest].abscissa
    alike = [_is_same(raster, function.abscissa) for function in functions]
    if all(alike):
        return TimeFunctions(tuple(functions), rates)
    n_read = sum(2 * function.abscissa.size for function in functions)
    n_resampled = raster.size * (1 + alike.count(False))
    refuse_announced(f"{path}: what is resampled to {rates[fastest]:.6g} Hz", n_read + n_resampled)
    begins = [float(function.abscissa[0]) for function in functions]
    ends = [float(function.abscissa[-1]) for function in functions]
    first, last = int(np.argmax(begins)), int(np.argmin(ends))
    longest = max(end - begin for begin, end in zip(begins, ends, strict=True))
    if ends[last] - begins[first] < LEAST_OVERLAP * longest:
        raise InputError(
            f"{path}: {labels[first]} begins at {begins[first]:.3f} s and {labels[last]} ends at "
            f"{ends[last]:.3f} s, so that less than half of the recording has all channels: "
            "export the same time of all"
        )
    slack = SAME_LINE / rates[fastest]
    shared = raster[(raster >= begins[first] - slack) & (raster <= ends[last] + slack)]
    shared.setflags(write=False)
    on_raster, resampled = [], defaultdict[str, list[str]](list)
    for label, rate, function in zip(labels, rates, functions, strict=True):
        inside = np.searchsorted(function.abscissa, shared[0] - slack)
        same = function.abscissa[inside : inside + shared.size]
        if same_lines(shared, same):
            values = function.values[inside : inside + shared.size]
        else:
            worst, _ = _unevenness(function.abscissa)
            even = worst <= LARGEST_JITTER
            values = (_resampled if even else _interpolated)(function, shared)
            way = (
                "band-limited"
                if even
                else f"between instants up to {PERCENT * worst:.0f} % of a step off"
            )
            resampled[f"from {rate:.6g} Hz to {rates[fastest]:.6g} Hz, {way}"].append(label)
        on_raster.append(replace(function, abscissa=shared, values=values))
    notes = [f"resampled {how}: {_listed(names)}" for how, names in resampled.items()]
    if (shared.size - 1) / rates[fastest] < longest - 1 / min(rates):
        notes.append(f"cut to {shared[0]:.3f} to {shared[-1]:.3f} s, which all channels have")
    return TimeFunctions(tuple(on_raster), rates, tuple(notes))


def _is_same(raster: RealArray, abscissa: RealArray) -> bool:
    return abscissa is raster or same_lines(raster, abscissa)


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - 4} more" if len(names) > 4 else ""
    return f"{', '.join(names[:4])}{more}"


def _resampled(function: UffFunction, instants: RealArray) -> RealArray:
    """Band-limited values at other instants, within the function's own time."""
    time, values = function.abscissa, function.values
    n = time.size
    # a straight line beside the signal: what the filter sees begins and ends at zero
    line = values[0] + (values[-1] - values[0]) * (time - time[0]) / (time[-1] - time[0])
    above, even = values - line, np.linspace(time[0], time[-1], n)
    at = np.clip(instants, time[0], time[-1])
    resampled = np.asarray(np.interp(at, time, line))
    for start in range(0, n - 1, _PART):
        stop = min(start + _PART, n - 1)
        low, high = max(start - _MARGIN, 0), min(stop + _MARGIN, n - 1)
        dense = resample_poly(above[low : high + 1], OVERSAMPLED, 1)
        dense = dense[: OVERSAMPLED * (high - low) + 1]
        spline = CubicSpline(np.linspace(even[low], even[high], dense.size), dense)
        first, last = np.searchsorted(at, (even[start], even[stop]))
        inside = slice(first, at.size if stop == n - 1 else last)
        resampled[inside] += spline(at[inside])
    resampled.setflags(write=False)
    return resampled


def _interpolated(function: UffFunction, instants: RealArray) -> RealArray:
    """Values of a spline through uneven instants, within the function's own time."""
    time = function.abscissa
    values = CubicSpline(time, function.values)(np.clip(instants, time[0], time[-1]))
    values.setflags(write=False)
    return np.asarray(values)


def _unit(what: str, row: CampaignChannel, signal: TimeSignal) -> Unit:
    # pulses of a tacho count, their height in whatever unit does not
    if row.quantity == "tacho":
        return Unit("1", "1", 1.0)
    si = CAMPAIGN_QUANTITIES[row.quantity][1]
    if not signal.unit.strip():
        example = row.unit.label or si
        raise InputError(f"{what} states no unit: export it with one, such as {example}")
    with naming(what):
        return parse_unit(signal.unit, si)


def _function(what: str, row: CampaignChannel, signal: TimeSignal, unit: Unit) -> UffFunction:
    signal.values.setflags(write=False)
    with naming(what):
        return UffFunction(
            abscissa=signal.time,
            values=signal.values,
            function_type=TIME_SIGNAL,
            response_node=row.node,
            response_direction=row.direction,
            ordinate=row.ordinate,
            ordinate_unit=unit.si,
            file_unit=unit.label,
        )


def _check_instants(path: Path, axes: Sequence[tuple[str, RealArray, bool]]) -> None:
    """Refuse gaps, and uneven steps of what is not from a bus: filters and angles need a rate."""
    seen: set[int] = set()
    for name, time, on_bus in axes:
        if id(time) in seen:
            continue
        seen.add(id(time))
        worst, k = _unevenness(time)
        if worst <= LARGEST_JITTER:
            continue
        intervals = np.diff(time)
        widest = int(np.argmax(intervals))
        if intervals[widest] > LONGEST_INTERVAL * np.median(intervals):
            raise InputError(
                f"{path}: {name} has no value between {time[widest]:.9g} s and "
                f"{time[widest + 1]:.9g} s; export it again, deboom does not fill gaps"
            )
        if not on_bus:
            raise InputError(
                f"{path}: {name} is not sampled evenly: sample {k + 1} at {time[k]:.9g} s is "
                f"{worst:.2g} steps off; export it with one sampling rate"
            )


def _unevenness(time: RealArray) -> tuple[float, int]:
    """Return the largest distance of a sample from an even step, in steps, and which it is."""
    step = (time[-1] - time[0]) / (time.size - 1)
    worst, k = 0.0, 0
    for part in blocks(time.size):
        indices = np.arange(part.start, part.stop)
        off = np.abs(time[part] - time[0] - step * indices) / step
        if off.max() > worst:
            worst, k = float(off.max()), int(indices[np.argmax(off)])
    return worst, k


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


def _apart(kind: str, path: Path, names: Sequence[str]) -> _Channels:
    """Read the channels with these names in a process of its own."""
    content, arrays = read_apart(path, kind, names)
    for name, unit, time, values in content["signals"]:
        yield name, (unit, arrays[time], arrays[values])
    for name in content["channels"]:
        yield name, None


def _matlab(path: Path, names: Sequence[str]) -> _Channels:
    time, columns = matlab_table(path, "time")
    for name, (unit, values) in columns.items():
        yield name, (unit, time, values) if name in names else None


@dataclass(frozen=True)
class WavChannel(TableRow):
    """Calibration of one track of a WAV file, in the order of the tracks.

    - `channel`: name of the channel.
    - `full_scale`: value at the largest number that the file can hold [unit].
    - `unit`: unit of the channel, such as ``Pa``; of a tacho in whatever unit.
    """

    unique = ("channel '{0.channel}'",)
    channel: str
    full_scale: Annotated[float, Numbers(("full_scale",))]
    unit: str

    def _check(self) -> None:
        if not self.full_scale > 0:
            raise InputError(f"full_scale of '{self.channel}' is not positive: state it")


def _wav(path: Path, names: Sequence[str]) -> _Channels:
    with opened_file(path, LARGEST_FILE) as file:
        start, size = file.read(28), os.fstat(file.fileno()).st_size
    stated = 8 + int.from_bytes(start[4:8], "little")
    if start[:4] == b"RF64":  # longer than 4 GiB, or written so that it may become that
        stated = 8 + int.from_bytes(start[20:28], "little")
    if start[:4] in (b"RIFF", b"RF64") and size < stated:
        raise InputError(f"{path} has {size} of {stated} bytes: copy it again")
    try:
        rate, tracks = wavfile.read(path, mmap=True)
    except ValueError:  # 24 bits are no type of numbers: they are read, and take four times more
        refuse_announced(str(path), size // 2)
        rate, tracks = wavfile.read(path)
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
    wanted = sum(row.channel in names for row in rows)
    refuse_announced(str(path), (wanted + 1) * len(tracks) + size // 8)
    kind = tracks.dtype
    largest = 1.0 if kind.kind == "f" else -float(np.iinfo(kind).min) or 128.0
    middle = 128.0 if kind == np.uint8 else 0.0
    time = np.arange(len(tracks), dtype=np.float64)
    time /= rate
    for row, track in zip(rows, tracks.T, strict=True):
        if row.channel not in names:
            yield row.channel, None
            continue
        values = track.astype(np.float64)
        values -= middle
        values *= row.full_scale / largest
        yield row.channel, (row.unit, time, values)


_END = "***End_of_Header***"
_BEGIN_SPECIAL, _END_SPECIAL = "***Start_Special***", "***End_Special***"
LARGEST_LVM = 128 * MEBIBYTE
"""Largest LVM file that is read; text takes many times its size of memory [bytes]."""
MOST_CELLS = 12_000_000
"""Cells of an LVM file that are read; of usual width, the largest file has as many."""
_COMMENT = "Comment"
"""Name of the last column, which LabVIEW writes behind the channels."""


def _lvm(path: Path, names: Sequence[str]) -> _Channels:
    """LabVIEW's text: a header of the file, one of the segment, names, and a line per sample."""
    text = text_of(path, LARGEST_LVM)  # LabVIEW writes in the code page of its machine
    if sum(map(text.count, "\t,\n\r")) > MOST_CELLS:
        raise InputError(
            f"{path} has more than {MOST_CELLS} cells: save a shorter record, or a TDMS file"
        )
    lines = _without_special(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"))
    ends = [k for k, line in enumerate(lines) if line.strip().startswith(_END)]
    if len(ends) != 2:
        begun = [line[5:].split("\t")[0] for line in lines[sum(ends[:1]) :] if line[:4] == "Time"]
        when = f", begun at {', '.join(begun)}" if begun else ""
        raise InputError(
            f"{path} has {max(len(ends) - 1, 0)} segments{when}: save every record as a file of "
            "its own, with one header and one segment"
        )
    facts = dict(re.split(r"[\t,]", f"{line}\t", maxsplit=1) for line in lines[: ends[0]])
    separator = "," if facts.get("Separator", "").strip() == "Comma" else "\t"
    segment = _LvmSegment(
        path,
        {cells[0]: cells[1:] for cells in (each.split(separator) for each in lines[: ends[1]])},
        tuple(each.split(separator) for each in lines[ends[1] + 1 :] if each.strip()),
        comma=facts.get("Decimal_Separator", "").strip() == ",",
    )
    for k, name in enumerate(segment.names):
        yield name, segment.channel(k) if name in names else None


def _without_special(lines: Sequence[str]) -> list[str]:
    """Leave out the blocks of LabVIEW's special headers, with the lines that begin and end them."""
    kept: list[str] = []
    inside = False
    for line in lines:
        inside = inside or line.startswith(_BEGIN_SPECIAL)
        if not inside:
            kept.append(line)
        inside = inside and not line.startswith(_END_SPECIAL)
    return kept


@dataclass(frozen=True)
class _LvmSegment:
    """Segment of a LabVIEW file.

    - `head`: key to its cells, of both headers.
    - `table`: names of the columns, then a row per sample.
    - `comma`: numbers have decimal commas.
    """

    path: Path
    head: Mapping[str, Sequence[str]]
    table: Sequence[Sequence[str]]
    comma: bool

    @cached_property
    def layout(self) -> str:
        """Columns of instants: ``No``, ``One``, or ``Multi`` for one before every channel."""
        return self.head["X_Columns"][0].strip()

    @cached_property
    def columns(self) -> range:
        """Columns of the channels."""
        n = int(self.head["Channels"][0])
        header = [name.strip() for name in self.table[0]]
        while header and header[-1] in ("", _COMMENT):
            header.pop()
        # an empty column of instants stands before the channels, as a rule
        width = 2 * n if self.layout == "Multi" else n if self.layout == "No" else n + 1
        if self.layout not in ("No", "One", "Multi") or len(header) - width not in (
            (0, 1) if self.layout == "No" else (0,)
        ):
            raise InputError(
                f"{self.path} has {n} channels, X_Columns {self.layout} and {len(header)} names of "
                "columns, which do not fit: name every channel in LabVIEW and export again"
            )
        if self.layout == "Multi":
            return range(1, width, 2)
        return range(len(header) - n, len(header))

    @property
    def names(self) -> list[str]:
        """Names of the channels."""
        return [self.table[0][column].strip() for column in self.columns]

    def fact(self, key: str, channel: int) -> str:
        """Text that the header states of a channel; ``""`` where it states none."""
        cells = self.head.get(key, ())
        # with a column of instants for every channel, a channel has two cells here, too
        stated = [cell.strip() for cell in self.head["Samples"][: len(self.columns)]]
        step = 2 if self.layout == "Multi" and not all(stated) else 1
        return cells[step * channel].strip() if step * channel < len(cells) else ""

    def number(self, text: str) -> float:
        """Return a number of the file; nan where it is none."""
        return number_in(text.strip().replace(",", ".") if self.comma else text.strip())

    def channel(self, k: int) -> _Loaded:
        """Return unit, instants [s] and values of a channel."""
        what = f"{self.path}: channel '{self.names[k]}'"
        column, rows = self.columns[k], self.table[1:]
        texts = [row[column].strip() if column < len(row) else "" for row in rows]
        # a shorter channel than the others has empty cells below
        n = next((i for i in range(len(texts), 0, -1) if texts[i - 1]), 0)
        n_stated = int(self.fact("Samples", k) or 0)
        if n < n_stated or n < 2:
            raise InputError(
                f"{what} has {n_stated} samples by its header and {n} in the file: copy or export "
                "it again"
            )
        values = np.array([self.number(text) for text in texts[:n]])
        unit = self.fact("Y_Unit_Label", k)
        dimension = self.fact("X_Dimension", k)
        if dimension not in ("", "Time"):
            raise InputError(f"{what} is over {dimension}: export it over time")
        start, step = self.number(self.fact("X0", k) or "0"), self.number(self.fact("Delta_X", k))
        time = start + step * np.arange(n)
        if self.layout == "No" or (self.layout == "One" and not self._shares_instants(k)):
            if not step > 0:
                raise InputError(f"{what} has neither instants nor a Delta_X: export it again")
            if n != n_stated:
                raise InputError(
                    f"{what} has {n_stated} samples by its header and {n} in the file: several "
                    "records stand below each other, and nothing says when each began; save one "
                    "record per file, or with one X column per channel"
                )
        else:
            before = [row[column - 1 if self.layout == "Multi" else 0] for row in rows[:n]]
            written = np.array([self.number(text) for text in before])
            again = np.flatnonzero(np.diff(written) < 0)
            if again.size:
                raise InputError(
                    f"{what} begins again at sample {again[0] + 2}, at {written[again[0] + 1]:g} s "
                    f"after {written[again[0]]:g} s: several records stand below each other; save "
                    "one record per file"
                )
            # the instants of the file are rounded, those of its header are not
            if not np.abs(written - time).max() <= LARGEST_JITTER * step:
                time = written
        with naming(what):
            second = parse_unit(self.fact("X_Unit_Label", k) or "s", "s")
        if second.si != "s":
            raise InputError(f"{what} has instants in {second.label}: export them in s")
        return unit, second.factor * time, values

    def _shares_instants(self, k: int) -> bool:
        """Tell whether the one column of instants, which is the longest channel's, holds for it."""
        channels = range(len(self.columns))
        sizes = [int(self.fact("Samples", each) or 0) for each in channels]
        first = sizes.index(max(sizes))
        return all(self.fact(key, k) == self.fact(key, first) for key in ("X0", "Delta_X"))


_TIME, _RATE = "time", "sample rate"
"""Columns of a table: instants, or the number of samples per second."""


def _is_table(path: Path) -> bool:
    """Tell a table by its ending, unless its content says otherwise."""
    kind = kind_of(path)
    text = path.suffix.lower() == ".csv" and kind.startswith("text ")
    return text or (path.suffix.lower() == ".xlsx" and kind.startswith("a workbook"))


def _table(path: Path, names: Sequence[str]) -> _Channels:
    """Columns ``name [unit]`` beside one of instants, or of the sampling rate."""
    columns = read_columns(path, _TIME)
    headers = columns.by_name(path)
    if (_TIME in headers) == (_RATE in headers):
        raise InputError(
            f"{path}: time data have a column 'time [s]', or a column 'sample rate [Hz]' with one "
            "number: add one of them"
        )
    time = _instants(path, columns, headers) if _TIME in headers else _even(path, columns, headers)
    for name, header in headers.items():
        if name not in (_TIME, _RATE):
            yield name, _of_table(path, columns, header, time) if name in names else None


def _of_table(path: Path, columns: Columns, header: str, time: RealArray) -> _Loaded:
    with naming(path):
        (values,) = columns.numbers(header, with_holes=True)
    return name_and_unit(header)[1] or "", time, values


def _instants(path: Path, columns: Columns, headers: Mapping[str, str]) -> RealArray:
    with naming(path):
        (time,) = columns.numbers(headers[_TIME])
        label = name_and_unit(headers[_TIME])[1]
        if not label:
            raise InputError(f"column '{headers[_TIME]}' has no unit: write 'time [s]'")
        unit = parse_unit(label, "s")
        if unit.si != "s":
            raise InputError(f"column '{headers[_TIME]}' is not in s or a multiple of it")
    return np.asarray(time * unit.factor)


def _even(path: Path, columns: Columns, headers: Mapping[str, str]) -> RealArray:
    stated = {text for text in columns.texts[headers[_RATE]] if text}
    rate = number_in(stated.pop()) if len(stated) == 1 else math.nan
    if headers[_RATE] != f"{_RATE} [Hz]" or not 0 < rate < math.inf:
        raise InputError(
            f"{path}: column '{headers[_RATE]}': state one number of samples per second below "
            "'sample rate [Hz]'"
        )
    return np.arange(len(columns.lines)) / rate


_TABLE = "a table"
_READERS: Mapping[str, Callable[[Path, Sequence[str]], _Channels]] = {
    **{kind: partial(_apart, kind) for kind in (MDF, TDMS, HDF5)},
    MATLAB: _matlab,
    "a LabVIEW measurement file": _lvm,
    "a WAV file": _wav,
    _TABLE: _table,
}
_FORMATS = ("MDF (.mf4)", "TDMS", "HDF5", "MATLAB (.mat)", "LabVIEW (.lvm)", "WAV", "CSV", "xlsx")
