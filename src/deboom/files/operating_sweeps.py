"""Sweeps of a running compressor in UFF files: spectra of first order, or channels over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.arrays import RealArray, RealOrComplexArray
from deboom.errors import InputError
from deboom.files.inertance_test_tables import PlacedSensor
from deboom.files.operating_sweep_file import Row, SweepFile
from deboom.files.uff import UffFunction, write_uff
from deboom.measurement.channels import Spectrum
from deboom.measurement.time_record import TimeRecord

_SPECTRA = (0, 12, 27)
"""UFF function types that hold complex spectra: general, spectrum, order function."""
_OVER_TIME = (1,)
ENTITY_NAME = 10
"""Characters of a channel's name that UFF keeps; the DoF is what counts."""
_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class SweepNodes:
    """What the nodes of the UFF files are.

    Parameters
    ----------
    sensors : tuple of PlacedSensor
        Triaxial accelerometers on the compressor, in their own axes.
    tacho : int
        Direction scalar.
    holders : tuple of (str, int)
        Name and node of each triaxial accelerometer on the body side of a mount, in the axes of
        the position sheet.
    microphones : tuple of (str, int)
        Name and node, direction scalar.
    """

    sensors: tuple[PlacedSensor, ...]
    tacho: int
    holders: tuple[tuple[str, int], ...] = ()
    microphones: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, eq=False)
class SweepSpectra:
    """What one file of order spectra holds.

    Parameters
    ----------
    acceleration : Spectrum
        Channels ``A1 x`` … of the compressor [m/s^2].
    holder, sound : Spectrum or None
        Channels ``mount 1 x`` … [m/s^2] and the microphones [Pa]; None where there are none.
    """

    acceleration: Spectrum
    holder: Spectrum | None
    sound: Spectrum | None


@dataclass(frozen=True, eq=False)
class SweepRecord:
    """What one file over time holds.

    Parameters
    ----------
    tacho : array, shape (n_sample,)
        [V or 1].
    acceleration : TimeRecord
        As in `SweepSpectra`.
    holder, sound : TimeRecord or None
    """

    tacho: RealArray
    acceleration: TimeRecord
    holder: TimeRecord | None
    sound: TimeRecord | None


def write_sweep(
    path: Path,
    nodes: SweepNodes,
    frequency: RealArray,
    acceleration: RealOrComplexArray,
    *,
    holder: RealOrComplexArray | None = None,
    sound: RealOrComplexArray | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write order spectra, and the speed of the tacho, as UFF functions of type 0.

    Parameters
    ----------
    path : Path
        UFF file.
    nodes : SweepNodes
        What is written.
    frequency : array, shape (f,)
        Of the rotation, evenly spaced [Hz].
    acceleration : array, shape (f, 3 n_sensor)
        Complex peak, phase from the tacho's pulse [m/s²].
    holder : array, shape (f, 3 n_holder), optional
        [m/s²].
    sound : array, shape (f, n_microphone), optional
        [Pa].
    notes : sequence of str
        Up to four lines on where it comes from.

    Raises
    ------
    InputError
        Columns that are not the channels of the nodes, or a file that cannot be written.
    """
    lines = ("order 1", *notes)
    columns = _columns(path, nodes, acceleration, holder, sound)
    columns.append(("tacho", nodes.tacho, "scalar", "rpm", "rpm", np.asarray(60.0 * frequency)))
    write_uff(path, _functions(frequency, columns, 0, lines), binary=True)


def write_sweep_record(
    path: Path,
    nodes: SweepNodes,
    rate: float,
    tacho: RealArray,
    acceleration: RealArray,
    *,
    holder: RealArray | None = None,
    sound: RealArray | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write channels over time as UFF functions of type 1.

    Parameters
    ----------
    path, nodes, notes
        As for `write_sweep`.
    rate : float
        Samples per second; ``operation.toml`` keeps it exactly [Hz].
    tacho : array, shape (n_sample,)
        One pulse per revolution; its rising edge marks the angle [1].
    acceleration, holder, sound : array, shape (n_sample, ...)
        As for `write_sweep`, over time.

    Raises
    ------
    InputError
        As `write_sweep`.
    """
    # UFF keeps six digits of a step
    step = float(f"{1 / rate:.5e}")
    time = np.asarray(step * np.arange(len(tacho)), dtype=np.float64)
    columns = _columns(path, nodes, acceleration, holder, sound)
    columns.append(("tacho", nodes.tacho, "scalar", "general", "1", tacho))
    write_uff(path, _functions(time, columns, 1, notes), binary=True)


def read_sweep(path: Path, nodes: SweepNodes) -> SweepSpectra:
    """Read order spectra.

    Raises
    ------
    InputError
        The file cannot be read as UFF; the tacho is missing or does not fit the lines; a channel is
        missing, doubled, dead, real, or of another order, type or unit.
    """
    file = SweepFile(path, _SPECTRA, is_complex=True)
    frequency = file.axis
    file.check_order()
    file.check_speed(nodes.tacho)

    def spectrum(rows: list[Row], ordinate: str, unit: str) -> Spectrum | None:
        if not rows:
            return None
        return Spectrum(frequency, file.columns(rows, ordinate, unit), _names(rows), unit)

    acceleration = spectrum(_sensor_rows(nodes), "acceleration", "m/s^2")
    assert acceleration is not None
    return SweepSpectra(
        acceleration,
        spectrum(_holder_rows(nodes), "acceleration", "m/s^2"),
        spectrum(_microphone_rows(nodes), "pressure", "Pa"),
    )


def read_sweep_record(path: Path, nodes: SweepNodes, rate: float) -> SweepRecord:
    """Read channels over time.

    Parameters
    ----------
    path : Path
        UFF file.
    nodes : SweepNodes
        What is read.
    rate : float
        Samples per second [Hz].

    Raises
    ------
    InputError
        As `read_sweep`; a rate that is not the file's.
    """
    file = SweepFile(path, _OVER_TIME, is_complex=False)
    stated = (file.axis.size - 1) / (file.axis[-1] - file.axis[0])
    if abs(stated / rate - 1) > 1e-4:
        raise InputError(
            f"{path}: its samples are {1 / stated:.6g} s apart, but sample_rate_hz says "
            f"{rate:g}: correct the wrong one"
        )
    tacho = file.tacho(nodes.tacho, "general").astype(np.float64)

    def record(rows: list[Row], ordinate: str, unit: str) -> TimeRecord | None:
        if not rows:
            return None
        return TimeRecord(file.columns(rows, ordinate, unit).real, rate, _names(rows), unit)

    acceleration = record(_sensor_rows(nodes), "acceleration", "m/s^2")
    assert acceleration is not None
    return SweepRecord(
        tacho,
        acceleration,
        record(_holder_rows(nodes), "acceleration", "m/s^2"),
        record(_microphone_rows(nodes), "pressure", "Pa"),
    )


_Column = tuple[str, int, str, str, str, RealOrComplexArray]
"""Name, node, direction, quantity, unit and values."""


def _sensor_rows(nodes: SweepNodes) -> list[Row]:
    return [(f"{s.sensor} {axis}", s.node, f"+{axis}") for s in nodes.sensors for axis in _AXES]


def _holder_rows(nodes: SweepNodes) -> list[Row]:
    return [(f"{name} {axis}", node, f"+{axis}") for name, node in nodes.holders for axis in _AXES]


def _microphone_rows(nodes: SweepNodes) -> list[Row]:
    return [(name, node, "scalar") for name, node in nodes.microphones]


def _names(rows: list[Row]) -> tuple[str, ...]:
    return tuple(name for name, *_ in rows)


def _columns(
    path: Path,
    nodes: SweepNodes,
    acceleration: RealOrComplexArray,
    holder: RealOrComplexArray | None,
    sound: RealOrComplexArray | None,
) -> list[_Column]:
    columns: list[_Column] = []
    for what, rows, values, ordinate, unit in (
        ("acceleration", _sensor_rows(nodes), acceleration, "acceleration", "m/s^2"),
        ("holder", _holder_rows(nodes), holder, "acceleration", "m/s^2"),
        ("sound", _microphone_rows(nodes), sound, "pressure", "Pa"),
    ):
        width = 0 if values is None else values.shape[1]
        if width != len(rows):
            raise InputError(
                f"{path}: {what} has {width} columns, the nodes have {len(rows)} channels"
            )
        if values is not None:
            columns += [
                (*row, ordinate, unit, column) for row, column in zip(rows, values.T, strict=True)
            ]
    return columns


def _functions(
    axis: RealArray, columns: Sequence[_Column], kind: int, notes: Sequence[str]
) -> list[UffFunction]:
    return [
        UffFunction(
            abscissa=axis,
            values=values,
            function_type=kind,
            response_node=node,
            response_direction=direction,
            reference_node=0,
            reference_direction="scalar",
            ordinate=ordinate,
            ordinate_unit=unit,
            denominator="none",
            denominator_unit="",
            id_lines=tuple(notes),
            response_name=name.replace(" ", "")[:ENTITY_NAME],
        )
        for name, node, direction, ordinate, unit, values in columns
    ]
